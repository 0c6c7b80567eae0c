"""What is picked out and said of the vertical plane: lines to compare steps with, the worst wheelsets, what acted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from trainmj.collision.chain import order_of_vehicles
from trainmj.collision.envelope import Array
from trainmj.collision.gear import BOGIES, SUSPENDED
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.units import MM

_MOST = 6  # wheelsets that are drawn


def worst_wheelsets(summary: Summary) -> list[str]:
    """Names of the wheelsets with the least loads, the least first."""
    found = sorted((w.load, w.name) for v in summary.vehicles for w in v.wheelsets)
    return [name for _, name in found[:_MOST]]


def drawn(result: Result, history: str) -> dict[str, Array]:
    """(n_sample,) load or lift of each wheelset as it is drawn: loads up to where it lifts; one that lands bounces."""
    shown = result.shown(history)
    return {name: _until_lifted(loads) for name, loads in shown.items()} if history == "load" else shown


def _until_lifted(loads: Array) -> Array:
    """(n_sample,) loads of a wheelset up to where it first leaves the rail, then nan."""
    off = np.flatnonzero(loads <= 0.0)
    return np.asarray(np.where(np.arange(loads.size) > off[0], np.nan, loads)) if off.size else loads


def lifting_wheelsets(summary: Summary) -> list[str]:
    """Names of the wheelsets that lift, those that lift most first."""
    found = sorted((-w.lift_mm, w.name) for v in summary.vehicles for w in v.wheelsets if w.lift_mm > 0.0)
    return [name for _, name in found[:_MOST]]


def marks_of_steps(result: Result, summary: Summary) -> dict[str, float]:
    """What steps are to be compared with, by name [mm]: overlaps of faces, and the limit of steps if one is stated."""
    found: dict[float, list[str]] = {}
    for interface in summary.interfaces:
        for face in interface.faces:
            found.setdefault(face.overlap_mm, []).append(interface.name)
    marks = {f"overlap of {listed(names)}": overlap for overlap, names in found.items()}
    limit = result.chain.limits.get("step_mm")
    return marks if limit is None else {**marks, "limit of steps": limit}


def listed(names: Iterable[str]) -> str:
    """Names in a row, of many the first three and how many more there are."""
    each = list(dict.fromkeys(names))
    return ", ".join(each) if len(each) <= 4 else f"{', '.join(each[:3])} and {len(each) - 3} more"


def ruling(result: Result, summary: Summary) -> str:
    """Which of the values that are seldom published acted in a collision, in a sentence or two."""
    held = [i.name for i in summary.interfaces if i.tie_force_kN > 0.0]
    slipped = [i.name for i in summary.interfaces if i.slip_mm > 0.0 and i.name in held]
    swung = [i.name for i in summary.interfaces if i.swing_moment_kN_m > 0.0]
    slip = ", which slipped" if slipped == held else f", of which {listed(slipped)} slipped" if slipped else ""
    acted = [f"ties at {listed(held)}{slip}"] if held else []
    acted += [f"swing stops at {listed(swung)}"] if swung else []
    stops: dict[str, list[str]] = {}
    for stop, vehicle in _at_stops(result):
        stops.setdefault(stop, []).append(vehicle)
    acted += [f"{stop} of {listed(vehicles)}" for stop, vehicles in stops.items()]
    if not acted:
        return "Ties, swing stops and stops of suspensions are seldom published; none that the scenario states acted."
    cure = "Vary them." if result.scenario.bracket else "Vary them, or state bracket: [free, stated, tied]."
    return f"Of what is seldom published, these acted and rule the answer: {'; '.join(acted)}. {cure}"


def _at_stops(result: Result) -> Iterator[tuple[str, str]]:
    """The stops of suspensions that acted at a recorded time, and the vehicle of each."""
    chain = result.chain
    for i in order_of_vehicles(chain):
        gear = chain.vehicles[i].gear
        if gear is None:
            continue
        for name, dofs in (("secondary", BOGIES), ("primary", [dof for dof in SUSPENDED if dof not in BOGIES])):
            moved = result.dof[:, [chain.first_dof[i] + dof for dof in dofs]]
            suspension = gear.suspension(dofs[0])
            if moved.min() < -suspension.lift_stop:
                yield f"{name} lift stops", chain.vehicles[i].name
            if moved.max() > suspension.bump_stop:
                yield f"{name} bump stops", chain.vehicles[i].name


def mm(metres: float) -> float | None:
    """A length in mm, rounded as it was stated; None for one without end."""
    return round(metres / MM, 9) if np.isfinite(metres) else None
