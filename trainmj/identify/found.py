"""The found values as a scenario file: what has changed, over the scenario it was found for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trainmj.scenario import Scenario
from trainmj.scenario.files import BUILDS_ON, as_yaml


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
