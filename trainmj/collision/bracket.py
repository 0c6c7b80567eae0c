"""A collision in the vertical plane between the extremes of what holds its ends together: ties free, stated, tied."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.files.written import finite
from trainmj.scenario import Scenario, scenario_given
from trainmj.scenario.lines import Ties

ALL: tuple[Ties, ...] = ("free", "stated", "tied")


def bracket(
    scenario: Scenario | str | Path,
    known: Summary | None = None,
    *,
    changes: Mapping[str, Any] | None = None,
    **parameters: Any,
) -> dict[Ties, Summary]:
    """Compute a collision with each of the ties that its scenario states under ``bracket``, or with all three.

    Args:
        scenario: in the vertical plane, or the path of its file.
        known: the numbers of the scenario as it stands, if they are there already.
        changes: values of the scenario to change, by path or parameter.
        parameters: the same, as keywords.

    Returns:
        The numbers by ties, in the order in which the scenario states them.

    Raises:
        InputError: if it is not in the vertical plane, or states no tie that ``tied`` could make stronger.
    """
    scenario = scenario_given(scenario, changes, parameters)
    if scenario.plane != "vertical":
        raise InputError("bracket: ties have an effect in the vertical plane only: state plane: vertical")
    asked = scenario.bracket or ALL
    found = {} if known is None else {scenario.ties: known}
    open_ = [ties for ties in asked if ties not in found]
    found |= run_chains([(ties, line_up(scenario.with_values({"ties": ties}))) for ties in open_])
    return {ties: found[ties] for ties in asked}


def rows_of(summaries: Mapping[Ties, Summary]) -> list[dict[str, Any]]:
    """A row of plain values for each: how it ended, limits kept, and what ties change; None for what is no number."""
    return [finite(_row(ties, summary)) for ties, summary in summaries.items()]


def _row(ties: Ties, summary: Summary) -> dict[str, Any]:
    own = [i for i in summary.interfaces if i.judged]
    return {
        "ties": ties,
        "status": summary.status.kind.value,
        "reason": summary.status.reason,
        "valid_until_s": summary.valid_until_s,
        "limits": len(summary.limits),
        "limits_kept": sum(limit.kept for limit in summary.limits),
        "largest_step_mm": summary.largest_step_mm,
        "met_step_mm": summary.interfaces[0].met_step_mm,
        "slip_mm": max(i.slip_mm for i in own),
        "largest_wheel_lift_mm": summary.largest_wheel_lift_mm,
        "least_wheel_load": summary.least_wheel_load,
        "TS_mm": summary.TS_mm,
        "TAMA_g": summary.TAMA_g,
    }
