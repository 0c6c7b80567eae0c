"""Every collision of a study, computed once: designs, swarms and checks share one store of finished cases.

The store keeps all responses of a case under its scenario and values. A study that was stopped, or changed in a step,
finds there what it has computed before; a swarm with the same seed asks for the same points again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trainmj.cases.engine import ALL, Local
from trainmj.cases.origin import Origin, stated
from trainmj.cases.rows import STATUS, Row
from trainmj.cases.runner import rows_of
from trainmj.cases.store import MOST_COLUMNS, Store, key_of
from trainmj.collision.cases import Case, Cases, gathered
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of
from trainmj.collision.status import PAST_LIMITS, UNUSABLE, Kind
from trainmj.doe.arrays import FloatArray
from trainmj.scenario import Scenario
from trainmj.study.designs import Designs
from trainmj.study.plan import Study

FILE = "simulations.sqlite"
_CHANGES = "changes"
_WORST = (*UNUSABLE, *PAST_LIMITS, Kind.TIME_LIMIT, Kind.NO_CONTACT, Kind.OVER)
"""Kinds of status, the worst first."""

_DIGITS = 12  # significant digits of a factor's value: nearer points are the same case


class Simulator:
    """The simulations of a study.

    Args:
        store: of finished cases.
        study: scenario, factors and responses.
        threads: native threads; 0 for all cores.
        progress: called with the number of cases computed so far, as they end.

    Attributes:
        computed: how many cases have been computed.
        changes: what differs from the last run with this store that came to its end, in words.
    """

    def __init__(self, store: Store, study: Study, threads: int, progress: Callable[[int], None]) -> None:
        """Remove from the store what other versions or another machine computed."""
        self.study, self.computed = study, 0
        self._store, self._threads, self._progress = store, threads, progress
        self._texts = {name: key_of(scenario.counted()) for name, scenario in study.scenarios.items()}
        self._columns = {name: columns_of(line_up(scenario)) for name, scenario in study.scenarios.items()}
        wide = max(map(len, self._columns.values())) > MOST_COLUMNS - len(STATUS)
        self._only = tuple(dict.fromkeys(response.column for response in study.responses)) if wide else ()
        self.changes = _renewed(
            store, Origin("study", study.scenario, {"study": study.source.values, "points": study.given})
        )

    @property
    def asks(self) -> list[Any]:
        """What its numbers depend on besides the scenarios and points: nothing."""
        return []

    def at(self, points: FloatArray) -> Designs:
        """Simulate points (n, d) of the space in every load case, each once."""
        return self._designs(points, self.study.scenarios, self._texts)

    def check(self, points: FloatArray) -> Designs:
        """Simulate points (n, d) as the check asks."""
        changes = self.study.spec.check.set
        scenarios = {case: scenario.with_values(changes) for case, scenario in self.study.scenarios.items()}
        return self._designs(points, scenarios, {})

    def _designs(self, points: FloatArray, scenarios: Mapping[str, Scenario], texts: Mapping[str, str]) -> Designs:
        designs = [self.case(point) for point in points]
        rows = {case: self._rows(designs, of, self._only, texts.get(case)) for case, of in scenarios.items()}
        values = [[rows[r.case][n].get(r.column, np.nan) for r in self.study.responses] for n in range(len(points))]
        ended = [ending_of({case: of_case[n] for case, of_case in rows.items()}) for n in range(len(points))]
        status, reason = zip(*ended, strict=True)
        return Designs(self.study, points, np.array(values, dtype=np.float64), status, reason)

    def as_it_stands(self) -> dict[str, Row]:
        """Status, reason and every response of each load case, without the factors of the study."""
        if self._only:  # more responses than the store keeps
            engines = {case: Local(of, self._threads) for case, of in self.study.scenarios.items()}
            return {case: next(engine(gathered([("", {})]))).row(0) for case, engine in engines.items()}
        found = {case: self._rows([{}], of, (), self._texts[case])[0] for case, of in self.study.scenarios.items()}
        return {
            case: {name: row.get(name, np.nan) for name in (*STATUS, *self._columns[case])}
            for case, row in found.items()
        }

    def finish(self) -> None:
        """Record that the results of the study include all changes so far."""
        self._store.describe({_CHANGES: "[]"})

    def rows(self, cases: Cases, scenario: Scenario, columns: tuple[str, ...]) -> list[Row]:
        """Status, reason and some responses of cases of any scenario, in their order, each computed once."""
        return self._rows(cases, scenario, columns, None)

    def _rows(
        self, cases: Cases | Sequence[Case], scenario: Scenario, only: tuple[str, ...], text: str | None
    ) -> list[Row]:
        """The rows of cases of a scenario, in their order; with all responses, or only some."""
        text = text or key_of(scenario.counted())  # takes long to copy
        keys = [key_of(text, case, *only) for case in cases]
        before = self.computed

        def progress(finished: int) -> None:
            self.computed = before + finished
            self._progress(self.computed)

        engine = Local(scenario, self._threads, responses=only or ALL)
        made = [replace(cases, keys=keys)] if isinstance(cases, Cases) else gathered(zip(keys, cases, strict=True))
        rows = rows_of(self._store, engine, made, progress=progress)
        return [rows[key] for key in keys]

    def case(self, point: FloatArray) -> dict[str, Any]:
        """The changes of the scenario that a design (d,) is."""
        values = self.study.space.decode(point)
        case: dict[str, Any] = {}
        for value, targets in zip(values.values(), self.study.targets, strict=True):
            plain = float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
            case |= dict.fromkeys(targets, plain)
        return case


def ending_of(rows: Mapping[str, Row]) -> tuple[str, str]:
    """Status and reason of a design in all load cases: the worst, and why in each that is not simply over."""
    if len(rows) == 1:
        ((row,),) = (rows.values(),)
        return row["status"], row["reason"]
    ended = sorted(rows.items(), key=lambda end: _WORST.index(end[1]["status"]))
    worst = ended[0][1]["status"]
    said = (
        f"{case}: {row['reason'] if row['status'] == worst else ' '.join((row['status'], row['reason']))}".rstrip(": ")
        for case, row in ended
        if row["status"] != Kind.OVER or row["reason"]
    )
    return worst, "; ".join(said)


def _renewed(store: Store, origin: Origin) -> list[str]:
    """Make a store that of an origin, without the cases of another identity; return what has changed, in words."""
    about = store.about()
    changes: list[str] = []
    if about:
        said = stated(about, _CHANGES)
        changes += said if isinstance(said, list) else []
        others = "; ".join(origin.new_identity(about))
        if others:
            store.clear()
            changes.append(f"{others}: every collision is computed again")
        changes += origin.new_input(about)
    store.describe(origin.about() | {_CHANGES: json.dumps(changes)})
    return changes
