"""What an identification found, and the file that states it: a scenario that builds on the one it was found for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.files.yaml import as_yaml
from trainmj.identification.plan import Identification
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
        scenario: with these values.
        known: how well.
        fit: a row for each target.
        residuals: a row for each value that was wanted.
        parameters: a row for each parameter.
        correlations: between their errors.
        directions: combinations of parameters, worst determined first.
        way: of the search.
        summary: numbers and words, JSON only.
        folder: where the files are.
        simulated: trials simulated now.
        there: trials that were in the folder before.
        seconds: wall time.
    """

    plan: Identification
    point: Point
    scenario: Scenario
    known: Uncertainty
    fit: pd.DataFrame
    residuals: pd.DataFrame
    parameters: pd.DataFrame
    correlations: pd.DataFrame
    directions: pd.DataFrame
    way: tuple[Progress, ...]
    summary: dict[str, Any]
    folder: Path
    simulated: int
    there: int
    seconds: float

    @property
    def kept(self) -> bool:
        """Whether every bar of the fitted targets is kept."""
        rows = self.fit[self.fit["role"] == "fitted"]
        return not any(kept is False for kept in rows["kept"])


def found_yaml(scenario: Scenario, changes: Mapping[str, float], base: str, title: str) -> str:
    """The text of a scenario file that builds on another one and states the values that differ.

    Lists and curves replace what they build on as a whole, so these stand in full.

    Args:
        scenario: the one that base holds.
        changes: new values by path.
        base: name of its file, beside the new one.
        title: of the new scenario.
    """
    before, after = scenario.values(), scenario.with_values(changes).values()
    return as_yaml({BUILDS_ON: base, "title": title, **_changed(before, after)})


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
