"""What an identification found: values, how well they are known, and the scenario that has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.collision.device import Array
from trainmj.collision.identity import identity
from trainmj.files.plain import finite
from trainmj.files.yaml import as_yaml
from trainmj.identification import frames
from trainmj.identification.plan import Identification, Sample
from trainmj.identification.search import Progress
from trainmj.identification.uncertainty import Uncertainty
from trainmj.identification.unknowns import Point
from trainmj.scenario import Scenario
from trainmj.scenario.files import BUILDS_ON

if TYPE_CHECKING:
    import pandas as pd

BASE = "scenario.yaml"
FOUND = "found.yaml"


@dataclass(frozen=True)
class Found:
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

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario with the values found."""
        return self.plan.scenario.with_values(self.plan.unknowns.changes(self.point.value))

    @cached_property
    def residuals(self) -> pd.DataFrame:
        """A row for each value that was wanted."""
        return frames.residuals(self.plan, self.samples)

    @cached_property
    def fit(self) -> pd.DataFrame:
        """A row for each target and role."""
        return frames.fit(self.plan, self.residuals)

    @cached_property
    def parameters(self) -> pd.DataFrame:
        """A row for each parameter."""
        return frames.parameters(self.plan, self.known)

    @cached_property
    def correlations(self) -> pd.DataFrame:
        """Correlations between the errors of the parameters."""
        return frames.correlations(self.plan, self.known)

    @cached_property
    def directions(self) -> pd.DataFrame:
        """Combinations of parameters, worst determined first."""
        return frames.directions(self.plan, self.known)

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
                    "wanted_kJ": c.energy,
                    "found_kJ": plan.unknowns.area(c, self.point.value),
                    "met": bool(abs(missed) <= 1.0),
                }
                for c, missed in zip(plan.unknowns.constraints, self.point.missed, strict=True)
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
        return as_yaml({BUILDS_ON: BASE, "title": title, **_changed(base.values(), self.scenario.values())})


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
