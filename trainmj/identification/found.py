"""What an identification found: values, how well they are known, and the scenario that has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.collision.identity import identity
from trainmj.files.shown import Drawn
from trainmj.files.written import finite
from trainmj.files.yaml import as_yaml
from trainmj.identification.file import Amount, absolute
from trainmj.identification.plan import Identification, Sample, Target
from trainmj.identification.search import Progress
from trainmj.identification.uncertainty import MEANING, Uncertainty
from trainmj.identification.unknowns import Point
from trainmj.scenario import Scenario
from trainmj.scenario.files import BUILDS_ON

if TYPE_CHECKING:
    import pandas as pd

BASE = "scenario.yaml"
FOUND = "found.yaml"
OPEN = "not determined"
"""Remark of a parameter whose standard error is a large part of its range."""


@dataclass(frozen=True)
class Fitted:
    """A channel of a test beside the simulation with the values found."""

    data: str  # name of the test
    target: Target
    time: Array  # (n,) of the test [s]
    wanted: Array  # (n,) its values
    found: Array  # (n,) those of the simulation; NaN where there is none
    count: float  # as how many values it counts

    @property
    def title(self) -> str:
        """What it is: test, target."""
        return f"{self.data}: {self.target.name}"

    @property
    def rms(self) -> float:
        """Root of the mean square of its deviations."""
        return float(np.sqrt(np.mean((self.found - self.wanted) ** 2)))

    @property
    def note(self) -> str:
        """How well it is met, and what it counts, in words."""
        rms = f"{self.rms:.3g} {self.target.unit} rms, tolerance {self.target.part.tolerance}"
        return f"{rms}; counts as {self.count:.3g} value{'s' * (self.count != 1.0)}"


@dataclass(frozen=True)
class Found(Drawn):
    """What an identification found.

    Attributes:
        plan: what was sought.
        point: the values found.
        known: how well.
        samples: observations, and what the values found give for them (n,), by role: fitted, held out.
        way: of the search.
        folder: where the files are.
        simulated: trials simulated now.
        there: collisions that were in the folder before.
        seconds: wall time.
    """

    plan: Identification
    point: Point
    known: Uncertainty
    samples: Mapping[str, tuple[Sample, Array]]
    way: tuple[Progress, ...]
    folder: Path
    simulated: int
    there: int
    seconds: float

    def __repr__(self) -> str:
        """Title, misfit, verdict, and where it is."""
        from trainmj.identification.tables import verdict  # which is made of this

        return f"<Found {self.plan.title}: misfit {self.known.chi2:.3g}. {verdict(self).text} In {self.folder}>"

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario with the values found."""
        return self.plan.scenario.with_values(self.plan.unknowns.changes(self.point.value))

    def channels(self, role: str) -> list[Fitted]:
        """The channels that were fitted, or held out."""
        sample, found = self.samples[role]
        return [
            Fitted(
                data,
                self.plan.targets[sample.target[places[0]]],
                sample.time[places],
                sample.wanted[places],
                found[places],
                float(sample.share[places].sum()),
            )
            for (data, _), places in sample.channels.items()
        ]

    @cached_property
    def residuals(self) -> pd.DataFrame:
        """A row for each value that was wanted: its case, what was found, and how far it may deviate.

        Samples of channels have a time, which is that of the test.
        """
        import pandas as pd

        samples = [sample for sample, _ in self.samples.values()]
        role = [role for role, (sample, _) in self.samples.items() for _ in sample.observations]
        observations = [o for sample in samples for o in sample.observations]
        targets = [self.plan.targets[k] for sample in samples for k in sample.target]
        found = np.concatenate([found for _, found in self.samples.values()])
        wanted = np.concatenate([sample.wanted for sample in samples])
        allowed = np.concatenate([np.where(np.isfinite(s.bar), s.bar, s.tolerance) for s in samples])
        off = found - wanted
        time = np.concatenate([sample.time for sample in samples])
        no_part = np.isfinite(time) | (wanted == 0)  # a channel passes 0
        percent = np.divide(100.0 * off, wanted, out=np.full(off.size, np.nan), where=~no_part)
        head = pd.DataFrame({"role": role, "data": [o.data for o in observations]})
        if np.isfinite(time).any():
            head["time_s"] = time
        cases = pd.DataFrame([o.case for o in observations])
        values = {
            "target": [target.name for target in targets],
            "unit": [target.unit for target in targets],
            "wanted": wanted,
            "found": found,
            "deviation": off,
            "deviation_percent": percent,
            "allowed": allowed,
            "within": np.abs(off) <= allowed,
        }
        return pd.concat([head, cases, pd.DataFrame(values)], axis=1)

    @cached_property
    def fit(self) -> pd.DataFrame:
        """A row for each target and role: how many values, rms, bias, largest deviation, bars and whether they hold."""
        import pandas as pd

        groups = dict(iter(self.residuals.groupby(["role", "target"], sort=False)))
        order = [(role, target) for role in self.samples for target in self.plan.targets]
        return pd.DataFrame([_fit(role, t, groups[role, t.name]) for role, t in order if (role, t.name) in groups])

    @cached_property
    def parameters(self) -> pd.DataFrame:
        """A row for each parameter: value, 95 % interval, standard error, bounds, start, and remarks."""
        import pandas as pd

        known, unknowns = self.known, self.plan.unknowns
        log = np.array([p.log for p in unknowns.parameters])
        return pd.DataFrame(
            {
                "parameter": unknowns.names,
                "unit": [p.unit for p in unknowns.parameters],
                "value": self.point.value,
                "standard_error": known.error * np.where(log, self.point.value, 1.0),
                "low_95": known.lower,
                "high_95": known.upper,
                "lower_bound": [p.lower for p in unknowns.parameters],
                "upper_bound": [p.upper for p in unknowns.parameters],
                "start": [p.start for p in unknowns.parameters],
                "determined": known.determined,
                "remark": [self._remark(k) for k in range(log.size)],
                "sets": [" ".join(p.meant) if p.settings else ", ".join(p.meant) for p in unknowns.parameters],
            }
        )

    def _remark(self, k: int) -> str:
        """What there is to say about the parameter at a place."""
        known, names = self.known, self.plan.unknowns.names
        said = [f"solved from {c.name}" for c in self.plan.unknowns.constraints if c.by == k]
        if known.at_bound[k]:
            said.append(f"at its {known.at_bound[k]} bound")
        if known.open[k]:
            said.append(OPEN)
        if known.tied[k]:
            said.append(
                "only with " + " and ".join(f"{names[j]} ({known.correlation[k, j]:+.2f})" for j in known.tied[k])
            )
        return ", ".join(said)

    @cached_property
    def correlations(self) -> pd.DataFrame:
        """Correlations between the errors of the parameters: a row and a column for each, empty at bounds."""
        import pandas as pd

        names = self.plan.unknowns.names
        return pd.DataFrame(self.known.correlation, columns=names).assign(parameter=names)[["parameter", *names]]

    @cached_property
    def directions(self) -> pd.DataFrame:
        """Combinations of parameters, worst determined first: deviation in percent of the ranges, words, parts."""
        import pandas as pd

        names = self.plan.unknowns.names
        rows = [(100 * d.deviation, d.determined, d.in_words(names), *d.parts.tolist()) for d in self.known.directions]
        return pd.DataFrame(rows, columns=["deviation_percent", "determined", "in_words", *names])

    @property
    def search(self) -> pd.DataFrame:
        """A row for each step of the search."""
        import pandas as pd

        return pd.DataFrame(self.way, columns=Progress._fields)

    def phases(self) -> dict[str, tuple[list[int], list[float]]]:
        """Numbers of the steps of the search and the smallest misfit so far, by phase: misfits cannot be compared."""
        some, all_of = self.plan.spec.method.explore.cases, len(self.plan.fitted.cases)
        part = f", {some} of {all_of} cases" if some is not None and some < all_of else ""
        called = {"explore": f"explore{part}", "refine": "refine", "finish": "finish, in its own norm"}
        result: dict[str, tuple[list[int], list[float]]] = {}
        for n, progress in enumerate(self.way):
            steps, costs = result.setdefault(called[progress.phase], ([], []))
            steps.append(n)
            costs.append(progress.cost)
        return result

    @property
    def kept(self) -> bool:
        """Whether every bar of the fitted targets is kept."""
        rows = self.fit[self.fit["role"] == "fitted"]
        return not any(kept is False for kept in rows["kept"])

    @cached_property
    def summary(self) -> dict[str, Any]:
        """All of it in short: numbers and words, as JSON holds them."""
        plan, known, names = self.plan, self.known, self.plan.unknowns.names
        return {
            "title": plan.title,
            "seed": plan.spec.method.seed,
            "sought": len(plan.unknowns.free),
            "values": len(plan.fitted),
            "cases": len(plan.fitted.cases),
            "chi2_per_degree_of_freedom": finite(known.chi2),
            "degrees_of_freedom": known.freedom,
            "parameters": dict(zip(names, finite(self.point.value.tolist()), strict=True)),
            "constraints": [
                {
                    "constraint": c.name,
                    "by": names[c.by],
                    "wanted_kJ": c.part.area_kJ,
                    "found_kJ": plan.unknowns.area(c, self.point.value),
                    "met": bool(abs(missed) <= 1.0),
                }
                for c, missed in zip(plan.unknowns.constraints, self.point.missed, strict=True)
            ],
            "determined": [name for name, yes in zip(names, known.determined, strict=True) if yes],
            "determined_means": MEANING,
            "determined_only_together": [
                {"parameters": [names[k], names[j]], "correlation": float(known.correlation[k, j])}
                for k, others in enumerate(known.tied)
                for j in others
                if j > k
            ],
            "not_determined": [d.in_words(names) for d in known.directions if not d.determined],
            "at_bounds": [name for name, bound in zip(names, known.at_bound, strict=True) if bound],
            "fit": finite(self.fit.to_dict("records")),
            "versions": identity(),
        }

    def as_yaml(self) -> str:
        """The scenario found as the text of a file that builds on scenario.yaml and states the values that differ.

        Lists and curves replace what they build on as a whole, so these stand in full.
        """
        base = self.plan.scenario
        title = f"{base.title}: {self.plan.title}" if base.title not in ("", self.plan.title) else self.plan.title
        found = _changed(base.values(), self.scenario.values())
        found.pop("changed", None)  # since its title was written, which is a new one
        return as_yaml({BUILDS_ON: BASE, "title": title, **found})


def _fit(role: str, target: Target, of: pd.DataFrame) -> dict[str, Any]:
    off, wanted = of["deviation"].to_numpy(), of["wanted"].to_numpy()
    bars = target.part.bars
    kept = [
        None if bars.each is None else bool(of["within"].all()),
        _keeps(bars.rms, off, wanted, lambda x: np.sqrt(np.mean(x**2))),
        _keeps(bars.bias, off, wanted, lambda x: np.abs(np.mean(x))),
    ]
    return {
        "role": role,
        "target": target.name,
        "unit": target.unit,
        "values": len(of),
        "without_number": int(np.isnan(off).sum()),
        "rms": float(np.sqrt(np.mean(off**2))),
        "bias": float(np.mean(off)),
        "largest": _furthest(off),
        "largest_percent": _furthest(of["deviation_percent"].to_numpy()),
        "outside": int((~of["within"]).sum()),
        "bar_each": bars.each,
        "bar_rms": bars.rms,
        "bar_bias": bars.bias,
        "kept": None if kept == [None] * 3 else False not in kept,
    }


def _furthest(values: Array) -> float:
    """The value furthest from 0; NaN where none is a number."""
    known = values[~np.isnan(values)]
    return float(known[np.argmax(np.abs(known))]) if known.size else np.nan


def _keeps(amount: Amount | None, off: Array, wanted: Array, measure: Callable[[Array], float]) -> bool | None:
    """Whether a measure of deviations is within a bar, which may be a percentage of the values; None without a bar."""
    if amount is None:
        return None
    if isinstance(amount, str):
        return bool(np.all(wanted != 0) and measure(off / np.abs(wanted)) <= absolute(amount, 1.0))
    return bool(measure(off) <= amount)


def _changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of nested values that differ."""
    result = {}
    for key, value in after.items():
        there = before.get(key)
        if there == value:
            continue
        if isinstance(value, dict) and isinstance(there, dict) and "stroke_mm" not in value:
            value = _changed(there, value)
        result[key] = value
    return result
