"""What became of a train under a standard."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from trainmj.assessment.file import FromLineSpeed
from trainmj.assessment.outcome import Outcome, Row
from trainmj.assessment.plan import Case, Standard, leading, limits_of, speed_of, speed_stated, states_of
from trainmj.collision.chain import Chain
from trainmj.collision.limits import Criterion, reported
from trainmj.collision.summary import Summary
from trainmj.files.shown import Shown
from trainmj.scenario import Scenario

if TYPE_CHECKING:
    import pandas as pd

_NO_LIMIT = "no limit is stated of what was computed"


@dataclass(frozen=True, eq=False)
class Assessment(Shown):
    """What became of a train under a standard.

    Attributes:
        train: the scenario whose moving train was assessed.
        standard: what it must pass.
        category: of the train; empty where the standard has none.
        line_speed_km_h: of the line; None if not given.
        outcomes: every case, in the order of the file: collision scenario, end, load state.
        versions: of what computed it.
    """

    train: Scenario
    standard: Standard
    category: str
    line_speed_km_h: float | None
    outcomes: tuple[Outcome, ...]
    versions: Mapping[str, str]

    def __repr__(self) -> str:
        """Title and verdict: an assessment holds whole scenarios."""
        from trainmj.assessment.tables import verdict  # which is made of this

        return f"<Assessment {self.title}. {verdict(self).text}>"

    @property
    def title(self) -> str:
        """What was assessed after what: "After EN 15227, C-II: b_type (6 vehicles, 198 t)"."""
        category = f", {self.category}" if self.category else ""
        return f"{self.standard.spec.title}{category}: {self.train.under_test}"

    @cached_property
    def rows(self) -> list[Row]:
        """Every criterion of every case that was computed."""
        return [
            Row(outcome, criterion)
            for outcome in self.outcomes
            if outcome.summary and outcome.case.chain
            for criterion in (
                *outcome.summary.limits,
                *(
                    _reported(outcome.case.chain, outcome.summary, name)
                    for name in dict.fromkeys(self.standard.spec.reported)
                    if name not in outcome.case.absent and f"limits.{name}" not in outcome.case.changes
                ),
            )
        ]

    def governing(self) -> Iterator[list[Row]]:
        """For each criterion of each collision scenario its rows, the one that governs first."""
        found: dict[tuple[str, str], list[Row]] = {}
        for row in self.rows:
            found.setdefault((row.outcome.case.key, row.criterion.name), []).append(row)
        for rows in found.values():
            yield sorted(rows, key=lambda row: row.rank, reverse=True)

    @property
    def judged(self) -> list[Row]:
        """The row that governs each criterion with a limit."""
        return [rows[0] for rows in self.governing() if rows[0].judged]

    @property
    def kept_of_judged(self) -> str:
        """How many criteria are kept: "7 of 8 criteria kept"."""
        judged = self.judged
        return f"{sum(row.criterion.kept for row in judged)} of {len(judged)} criteria kept"

    @property
    def not_computed(self) -> dict[str, str]:
        """What the standard asks and nothing here answers, with the reason."""
        spec = self.standard.spec
        found = {key.replace("_", " "): reason for key, reason in spec.not_computed.items()}
        for scenario in spec.scenarios.values():
            stated = speed_stated(scenario, self.category)
            if stated is not None and speed_of(scenario, self.category, self.line_speed_km_h) == 0.0:
                found[scenario.title] = f"a line of {self.line_speed_km_h:g} km/h leaves no speed for it"
        why: dict[tuple[str, str], list[str]] = {}
        for outcome in self.outcomes:
            for name, reason in outcome.case.absent.items():
                keys = why.setdefault((name, reason), [])
                keys += [outcome.case.key] if outcome.case.key not in keys else []
        computed = list(dict.fromkeys(o.case.key for o in self.outcomes))
        for (name, reason), keys in why.items():
            where = "" if keys == computed else f" in {', '.join(spec.scenarios[key].title for key in keys)}"
            limited = any(name not in spec.reported or name in limits_of(spec, key) for key in keys)
            of = f"{'limit of ' if limited else ''}{name}{where}"
            found[of] = f"{found[of]}; {reason}" if of in found else reason
        judged = {row.outcome.case.key for row in self.rows if row.judged}
        for key in computed:
            if key not in judged and any(o.summary for o in self.outcomes if o.case.key == key):
                found[f"criteria of {spec.scenarios[key].title}"] = _NO_LIMIT
        return found

    @property
    def remarks(self) -> list[str]:
        """What a reader must know about what was computed."""
        spec, said = self.standard.spec, []
        if spec.load_states and list(states_of(spec, self.train)) == [""]:
            states = ", ".join(load.title or name for name, load in spec.load_states.items())
            said.append(
                f"The train states no seats under load, so its masses are taken as they stand; the load states of the "
                f"file ({states}) are not computed."
            )
        if self.line_speed_km_h is None:
            for scenario in spec.scenarios.values():
                one = speed_stated(scenario, self.category)
                if isinstance(one, FromLineSpeed):
                    speed = f"{one.at_most_km_h:g} km/h"
                    said.append(f"{scenario.title}: no line speed is given, so the highest speed, {speed}, is taken.")
        asked = [key for key in spec.scenarios if any(o.case.key == key for o in self.outcomes)]
        lines = [spec.scenarios[key].notes for key in asked]
        cut = [self.titled(outcome) for outcome in self.outcomes if outcome.cut]
        if cut:
            said.append(f"Not over at the time limit, so what came later is not known: {'; '.join(cut)}.")
        return [*said, *(note.strip() for note in lines if note)]

    @property
    def failed(self) -> list[str]:
        """What is not passed, a sentence each; empty if all that is computed is."""
        judged = self.judged
        said = [f"{self.titled(row.outcome)}: {row.criterion.said}" for row in judged if not row.criterion.kept]
        said += [f"{self.titled(o)}: {text}" for o in self.outcomes if (text := o.fault)]
        return said if said or judged else [_NO_LIMIT]

    @property
    def passed(self) -> bool:
        """Whether every criterion that is computed is kept in every case, and all cases could be computed."""
        return not self.failed

    def titled(self, outcome: Outcome) -> str:
        """A case in words: "Into a standing identical train, rear leading, empty"."""
        return f"{self.standard.spec.scenarios[outcome.case.key].title}, {self.state_of(outcome.case)}"

    def state_of(self, case: Case) -> str:
        """End and load state of a case in words: "rear leading, empty"."""
        return leading(self.standard.spec, case.end, case.state)

    def to_frame(self) -> pd.DataFrame:
        """Every criterion of every case as a table, a row each."""
        import pandas as pd

        return pd.DataFrame(self.table())

    def table(self) -> list[dict[str, Any]]:
        """Plain values of every criterion of every case."""
        return [
            {
                "scenario": row.outcome.case.key,
                "end": row.outcome.case.end,
                "load_state": row.outcome.case.state,
                "criterion": row.criterion.name,
                "at": row.criterion.where,
                "value": row.criterion.found,
                "limit": row.criterion.limit if row.judged else None,
                "unit": row.criterion.unit,
                "margin_percent": row.margin if row.judged else None,
                "kept": row.criterion.kept if row.judged else None,
                "valid": row.criterion.valid,
                "source": row.criterion.source,
                "status": row.outcome.status,
            }
            for row in self.rows
        ]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj assess --json`` prints them."""
        spec = self.standard.spec
        return {
            "standard": spec.title,
            "edition": spec.edition,
            "category": self.category,
            "line_speed_km_h": self.line_speed_km_h,
            "train": self.train.heading,
            "passed": self.passed,
            "failed": self.failed,
            "not_computed": self.not_computed,
            "remarks": self.remarks,
            "cases": [
                {
                    "scenario": o.case.key,
                    "end": o.case.end,
                    "load_state": o.case.state,
                    "changes": dict(o.case.changes),
                    "status": o.status,
                    "remarks": list(o.summary.remarks) if o.summary else [],
                    "responses": dict(o.summary.responses) if o.summary else None,
                }
                for o in self.outcomes
            ],
            "criteria": self.table(),
        }


def _reported(chain: Chain, summary: Summary, name: str) -> Criterion:
    found = reported(chain, summary.columns, summary.responses, summary.interfaces, summary.vehicles, name)
    return replace(found, valid=not summary.not_valid)
