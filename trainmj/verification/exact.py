"""The exact numbers of every kind of device, brake and grade beside what a run finds at a fine step."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import groupby

import numpy as np

from trainmj.collision.kernel import STILL_SPEED
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.scenario import Scenario
from trainmj.units import KJ, KN, MM
from trainmj.verification import kinds
from trainmj.verification.check import Check, zero
from trainmj.verification.kinds import Exact

FINE = 1e-5
"""What exact numbers are met to, relative; most are met far better."""

BREAK = 1e-4
"""... and the energy of a draw gear that breaks, for it breaks at the end of a step."""

FINER = 0.1
"""Of the step of a case of less than 0.1 ms."""

_WORDS = {
    "stroke_mm": ("largest stroke", "mm", MM),
    "force_kN": ("largest force", "kN", KN),
    "pull_kN": ("largest pull", "kN", KN),
    "speed_m_s": ("speed at the end", "m/s", 1.0),
    "travel_m": ("way", "m", 1.0),
    "lost_kJ": ("lost in devices", "kJ", KJ),
    "time_s": ("time", "s", 1.0),
    "stands_s": ("comes to rest", "s", 1.0),
}


def found(result: Result, quantity: str) -> float:
    """A quantity of a collision, as :class:`~trainmj.verification.kinds.Exact` names it."""
    (what, where), chain, tally = quantity.split(), result.chain, result.tally
    by = _WORDS[what][2]
    names = [vehicle.name for vehicle in chain.vehicles]
    if where in names:
        if what == "stands_s":
            still = np.abs(result.velocity[:, names.index(where)]) < STILL_SPEED
            return float(result.time[np.argmax(still)])
        way = result.position[-1] - result.position[0]
        return float((way if what == "travel_m" else tally.speed)[names.index(where)])
    if where in ("all", "end"):
        return float(tally.dissipated.sum() / by if what == "lost_kJ" else tally.time)
    joints = [interface.name for interface in chain.interfaces]
    k = joints.index(where) if where in joints else chain.front
    if where in ("moving", "struck"):
        return float(tally.element_stroke_max[chain.records[k][0][where == "struck"]] / by)
    of = {"stroke_mm": "stroke_max", "force_kN": "force_max", "pull_kN": "pull_max", "time_s": "stroke_max_time"}
    return float(getattr(tally, of[what])[k] / by)


def computed(exact: Exact, finer: float = FINER) -> Result:
    """The collision of an exact number, at a part of its step if that is less than 0.1 ms."""
    scenario = Scenario.from_values(dict(exact.values))
    step = exact.values["simulation"]["step_ms"]
    step = step * finer if step < 0.1 else step
    interval = step * max(1, round(0.1 / step))
    return run(scenario.with_values({"simulation.step_ms": step, "simulation.record_every_ms": interval}))


def _of_collision(exacts: tuple[Exact, ...]) -> Iterator[Check]:
    result = computed(exacts[0])
    for exact in exacts:
        what, where = exact.quantity.split()
        words, unit, _ = _WORDS[what]
        words = f"{words}{'' if where in ('all', 'end') else ', ' + where}"
        tolerance = BREAK if "breaks" in exact.name and what == "lost_kJ" else FINE
        check = Check(exact.name, words, exact.exact, found(result, exact.quantity), tolerance, unit=unit)
        yield check if exact.exact else zero(exact.name, words, check.found, 1e-9, unit)


def _cases() -> Iterator[partial[Iterator[Check]]]:
    """One case for each collision."""
    for name, exacts in groupby(kinds.cases(), lambda exact: exact.name):
        case = partial(_of_collision, tuple(exacts))
        case.__name__ = name  # type: ignore[attr-defined]
        yield case


CASES = tuple(_cases())
