"""The future work that the paper names: whether its laws hold beyond its ranges, and with vehicles of unequal mass.

An axis leads away from the paper's condition: the speed, the mass of all vehicles, the empty stroke, the mass of the
standing train, the scatter of masses in a train. On each of its values the laws are judged around that condition; where
a verdict changes from one value to the next, the step is halved until the place is known to the axis' resolution.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from trainmj.collision.batch import run_chains
from trainmj.collision.device import CAR_BODY
from trainmj.collision.lineup import line_up
from trainmj.collision.simulation import run
from trainmj.collision.summary import Summary
from trainmj.paper.laws_beyond import COUPLER_MM, HALF_D_MM, HALF_M_T, RULES, Around, N, Rule, s_anti, used_up
from trainmj.paper.printed import (
    BUFFER_MM,
    EMPTY_STROKE_MM,
    LIMIT_ANTI_CLIMBER_MM,
    LIMIT_OTHERS_MM,
    MASS_T,
    PEAKS,
    SPEED_KM_H,
    published,
)
from trainmj.scenario import Scenario, load
from trainmj.scenario.devices import StagedDevice
from trainmj.sweep.plan import load_sweep
from trainmj.units import MM, MS, G

ENDS = "b_type_ends"
"""The shipped train whose devices end at the strokes of Eq. (12), with the car body behind them."""

SPREADS = (0.0, 5.0, 10.0, 20.0, 35.0, 50.0)
"""By how much vehicles differ from the mean at most, in % of it."""

TURNS_KM_H = (22.0, 25.0, 28.0)
TURN_D_MM = (*np.arange(5.0, 60.0, 2.5).tolist(), *np.arange(60.0, 151.0, 10.0).tolist())
_APART_MM = 300.0  # too far for the anti-climbers to meet before M1 and M2 stop closing
_USUAL_KN = published("4")[list(PEAKS)].max().to_numpy() * MASS_T * G
"""Largest force on each vehicle, ahead less behind, from Table 4."""

_HIT = 1.25  # times that, which takes a coupler behind that carries little

GRADUAL = "no device enters another part of its curve"
"""Why a law breaks where every device does what it does in the paper's range."""


class Axis(NamedTuple):
    """A way that leads out of the paper's condition."""

    name: str  # of its rows in tables
    title: str
    head: str  # the title where there is less room
    unit: str
    start: float  # where the paper is
    sweep: str  # the shipped sweep file with its values, coarse
    resolution: float | None  # to which the place of a change is found; None where values are only counted
    scenario: str | None = None  # in place of the one of the sweep


SPEED = Axis("speed", "Speed V", "Speed V", "km/h", SPEED_KM_H, "beyond_speeds", 0.25)
MASS = Axis("mass", "Mass M of all vehicles", "Mass M", "t", MASS_T, "beyond_masses", 0.375)
EMPTY = Axis("empty_stroke", "Empty stroke D", "Empty stroke D", "mm", EMPTY_STROKE_MM, "beyond_empty_strokes", 0.75)
PARTNER = Axis(
    "partner", "Mass of the standing train's vehicles", "standing\ntrain", "t", MASS_T, "beyond_partners", 0.75
)
SAME = Axis(
    "formation", "Scatter of masses, both trains alike", "scatter,\nboth alike", "%", 0.0, "beyond_formations", None
)
TWO = Axis(
    "two_formations",
    "Scatter of masses, each train its own",
    "scatter,\neach its own",
    "%",
    0.0,
    "beyond_two_formations",
    None,
)
ENDING = tuple(a._replace(name=f"{a.name}_ends", scenario=ENDS) for a in (SPEED, EMPTY))
AXES = (SPEED, MASS, EMPTY, PARTNER, SAME, TWO, *ENDING)


class Judged(NamedTuple):
    """A law on one value of an axis."""

    held: int  # by so many
    n: int  # of so many formations; 1 where there is only one
    said: str  # numbers; of the first formation where it does not hold, if there is one

    @property
    def holds(self) -> bool:
        """Whether it holds for all."""
        return self.held == self.n


class Break(NamedTuple):
    """Where a law stops holding, on one side of the paper's condition."""

    last: float  # value at which it still holds
    first: float  # next value, at which it does not
    said: str  # the numbers there
    because: str  # why, or what devices begin to do there


@dataclass(frozen=True, eq=False)
class Along:
    """The laws along one axis."""

    axis: Axis
    around: Mapping[float, Sequence[Around]]  # the collisions on each value, one for each formation, rising values

    @cached_property
    def judged(self) -> Mapping[Rule, Mapping[float, Judged]]:
        """Each law on each value."""
        return {rule: {value: _judge(rule, some) for value, some in self.around.items()} for rule in RULES}

    @cached_property
    def states(self) -> Mapping[float, tuple[str, ...]]:
        """What devices do on each value."""
        return {value: states_of(some) for value, some in self.around.items()}

    def breaks(self, rule: Rule) -> tuple[Break | None, Break | None]:
        """Where a law stops holding below and above the paper's condition; None where it holds as far as was tried."""
        values = list(self.around)
        at = values.index(self.axis.start)
        return self._first(rule, values[at::-1]), self._first(rule, values[at:])

    def _first(self, rule: Rule, way: Sequence[float]) -> Break | None:
        judged = self.judged[rule]
        for last, first in pairwise(way):
            if judged[last].holds and not judged[first].holds:
                new = [c for c in self._causes(first) if c not in self._causes(self.axis.start, paper=True)]
                begun = [c for c in new if c not in self._causes(last)]
                crushed = any("car body" in cause for cause in new)
                because = rule.why if rule.why and not crushed else "; ".join(begun or new) or GRADUAL
                return Break(last, first, judged[first].said, because)
        return None

    def _causes(self, value: float, paper: bool = False) -> list[str]:
        """What devices do on a value, without limits, which change nothing; of the paper without car bodies too."""
        left_out = (" passes ", "car body") if paper else (" passes ",)
        return [state for state in self.states[value] if not any(words in state for words in left_out)]

    def begins(self) -> Iterator[tuple[str, float, float]]:
        """What devices do somewhere and not in the paper's range, with the values between which that begins."""
        values = list(self.around)
        at = values.index(self.axis.start)
        known = set(self.states[self.axis.start])
        for way in (values[at::-1], values[at:]):
            for last, first in pairwise(way):
                for state in self.states[first]:
                    if state not in known and state not in self.states[last]:
                        known.add(state)
                        yield state, last, first


class Turn(NamedTuple):
    """At one speed: why S12 falls with D before it grows."""

    speed_km_h: float
    stop_ms: float  # from shear-off until M1 and M2 stop closing, where the anti-climber never meets
    run_mm: float  # how far each train's front has run by then
    over_D: Mapping[float, Summary]  # collisions over D, rising

    @property
    def least_mm(self) -> float:
        """The D of those computed at which S12 is least."""
        return min(self.over_D, key=lambda D: self.over_D[D].interfaces[1].stroke_mm)


@dataclass(frozen=True, eq=False)
class Beyond:
    """The laws along all axes, and in the formations of Table 2."""

    along: Mapping[str, Along]  # by the names of their axes
    loaded: Mapping[str, Around]  # by what they are
    turns: tuple[Turn, ...]

    @cached_property
    def n(self) -> int:
        """How many conditions were judged."""
        return sum(len(some) for a in self.along.values() for some in a.around.values()) + len(self.loaded)


def judge_beyond(threads: int = 0) -> Beyond:
    """Judge the laws along all axes.

    Args:
        threads: native threads; 0 for all cores. The numbers do not depend on it.
    """
    known: dict[_Key, Summary] = {}
    along = {axis.name: follow(axis, known, threads) for axis in AXES}
    return Beyond(along, _loaded(known, threads), tuple(turn(V, threads) for V in TURNS_KM_H))


def turn(speed_km_h: float, threads: int = 0) -> Turn:
    """The collisions over D at one speed, and one whose anti-climbers stay apart until M1 and M2 stop closing."""
    scenario = load_sweep(EMPTY.sweep).scenario.with_values({"speed_km_h": speed_km_h})
    cases = {D: scenario.with_values({"empty_stroke_mm": D}) for D in TURN_D_MM}
    over_D = dict(run_chains(((D, line_up(s)) for D, s in cases.items()), threads))
    apart = run(scenario.with_values({"empty_stroke_mm": _APART_MM, "simulation.record_every_ms": 0.2}))
    front = apart.chain.front
    run_mm = apart.of_device("stroke", front, 0) / MM - COUPLER_MM
    sheared = int(np.argmax(run_mm > 0.0))
    closing = apart.velocity[sheared:, front - 1] - apart.velocity[sheared:, front]
    stop = sheared + int(np.argmax(closing <= 0.0))
    ms = float(apart.time[stop] - apart.time[sheared]) / MS
    return Turn(speed_km_h, ms, float(run_mm[stop]), dict(sorted(over_D.items())))


def follow(axis: Axis, known: dict[_Key, Summary], threads: int = 0, refine: bool = True) -> Along:
    """Judge the laws along one axis; known is what was computed so far, and grows."""
    of = conditions(axis)
    values = list(of.coarse)
    found: dict[float, list[Around]] = {}
    while values:
        found |= around({value: of.at(value) for value in values}, known, threads)
        found = dict(sorted(found.items()))
        values = list(_halved(Along(axis, found), axis.resolution)) if refine and axis.resolution else []
    return Along(axis, found)


def _halved(along: Along, resolution: float) -> set[float]:
    """The middle of the two values between which a law breaks or something begins, where they are still apart."""
    breaks = [(b.last, b.first) for rule in RULES for b in along.breaks(rule) if b]
    begins = [(last, first) for _, last, first in along.begins()]
    return {(a + b) / 2 for a, b in breaks + begins if abs(b - a) > resolution}


class Conditions(NamedTuple):
    """The conditions of an axis."""

    coarse: Iterable[float]
    at: Callable[[float], list[Scenario]]  # one, or one for each formation


def conditions(axis: Axis) -> Conditions:
    """The coarse values of an axis, and the scenarios on any of its values."""
    sweep = load_sweep(axis.sweep)
    scenario = sweep.scenario
    if axis.scenario:
        step = scenario.simulation.step_ms
        scenario = load(axis.scenario, {"empty_stroke_mm": EMPTY_STROKE_MM, "simulation.step_ms": step})
    if axis.resolution:
        (factor,) = sweep.names
        coarse = {float(values[factor]) for _, values in sweep.cases()} | {axis.start}
        return Conditions(sorted(coarse), lambda value: [scenario.with_values({factor: value})])
    formations = [values for _, values in sweep.cases()]
    widest = SPREADS[-1]

    def scattered(spread: float) -> list[Scenario]:
        some = formations if spread else formations[:1]
        return [
            scenario.with_values({name: MASS_T + spread / widest * (m - MASS_T) for name, m in masses.items()})
            for masses in some
        ]

    return Conditions(SPREADS, scattered)


def _loaded(known: dict[_Key, Summary], threads: int) -> dict[str, Around]:
    """The formations of Table 2, at their speeds and at the paper's."""
    cases = {}
    for n, V in ((1, SPEED_KM_H), (2, SPEED_KM_H), (2, float(published("2")["speed_km_h"].iloc[1]))):
        step = load_sweep(SPEED.sweep).scenario.simulation.step_ms
        changes = {"speed_km_h": V, "empty_stroke_mm": EMPTY_STROKE_MM, "simulation.step_ms": step}
        cases[f"scenario {n} at {V:g} km/h"] = [load(f"b_type_scenario_{n}").with_values(changes)]
    return {name: some[0] for name, some in around(cases, known, threads).items()}


_Key = tuple[object, ...]
T = TypeVar("T")


def around(
    scenarios: Mapping[T, Sequence[Scenario]], known: dict[_Key, Summary], threads: int
) -> dict[T, list[Around]]:
    """Compute what is not known yet of the five collisions around each condition."""
    five = {at: [_five(scenario) for scenario in some] for at, some in scenarios.items()}
    new = {key: s for some in five.values() for one in some for key, s in one if key not in known}
    known |= dict(run_chains(((key, line_up(s)) for key, s in new.items()), threads))
    found: dict[T, list[Around]] = {}
    for at, some in five.items():
        found[at] = []
        for (mid, scenario), *others in some:
            low_D, high_D, low_M, high_M = (known[key] for key, _ in others)
            m = known[mid]
            found[at].append(Around((low_D, m, high_D), (low_M, m, high_M), scenario.collision.speed_km_h))
    return found


def _five(scenario: Scenario) -> list[tuple[_Key, Scenario]]:
    """A condition, then with less and more D, then with less and more M, each with what tells it from others."""
    c = scenario.collision
    front = scenario.devices["front"]
    assert isinstance(front, StagedDevice)
    D = front.stages["anti_climber"].empty_stroke_mm
    masses = {
        f"trains.{train}.vehicles.{n}.mass_t": float(car.mass_t or 0.0)
        for train in dict.fromkeys((c.train, c.partner))
        for n, car in enumerate(scenario.trains[train].cars())
    }
    mean = sum(masses.values()) / len(masses)
    end = scenario.devices["coupler_c_d"].model_dump_json()
    found = []
    for dD, dM in ((0.0, 0.0), (-HALF_D_MM, 0.0), (HALF_D_MM, 0.0), (0.0, -HALF_M_T), (0.0, HALF_M_T)):
        changes = {name: mass * (1 + dM / mean) for name, mass in masses.items()} | {"empty_stroke_mm": D + dD}
        key = (c.partner, end, c.speed_km_h, *(round(value, 9) for value in changes.values()))
        found.append((key, scenario.with_values(changes)))
    return found


def _judge(rule: Rule, some: Sequence[Around]) -> Judged:
    each = [rule.judge(a) for a in some]
    failing = [said for holds, said in each if not holds]
    return Judged(len(each) - len(failing), len(each), failing[0] if failing else each[0][1])


def states_of(some: Iterable[Around]) -> tuple[str, ...]:
    """What devices do in at least one of the collisions, in words."""
    found: dict[str, None] = {}
    for a in some:
        for s in a.all:
            found |= dict.fromkeys(_states(s))
    return tuple(found)


def _states(s: Summary) -> Iterator[str]:
    if s.not_valid:
        yield "a curve has ended behind which nothing is stated"
    if not used_up(s):
        yield "the coupler of the front does not shear off"
    if s_anti(s) > LIMIT_ANTI_CLIMBER_MM:
        yield f"the anti-climber passes {LIMIT_ANTI_CLIMBER_MM:g} mm"
    for k, i in enumerate(s.interfaces[1:N], start=1):
        if k < 3 and i.stroke_mm < BUFFER_MM:
            yield f"{i.name} stays in its buffer"
        if k >= 3 and i.stroke_mm > BUFFER_MM:
            yield f"the tube of {i.name} is crushed"
        if i.stroke_mm > LIMIT_OTHERS_MM:
            yield f"{i.name} passes {LIMIT_OTHERS_MM:g} mm"
    reached = [i.name for i in s.interfaces if any(g.name == CAR_BODY and g.stroke_mm > 0.0 for g in i.stages)]
    yield from (f"the car body is reached at {i.name}" for i in s.interfaces[:N] if i.name in reached)
    force = [v.mass_t * G * v.peak_device_acceleration_g for v in s.vehicles[:N]]
    if not reached and any(f > _HIT * usual for f, usual in zip(force, _USUAL_KN, strict=True)):
        yield "vehicles are hit while the couplers behind them carry little"
