"""What the validation of a model against a test by EN 15227 speaks of, as far as channels can tell it.

The clause was not read: a paper quotes it (doi 10.1007/978-3-319-96601-4_37), and no compliance is claimed. All is from
recorded values while both are there, straight lines between them. What each rule is computed of stands in ``MEANING``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from trainmj.collision.device import CAR_BODY, Stage
from trainmj.collision.envelope import Array
from trainmj.comparison.differences import common, instants, percent
from trainmj.comparison.sides import Place, Series, Side, places
from trainmj.scenario.devices import DEVICE
from trainmj.units import MM, ROUND_OFF

ALLOWED = 10.0
"""Largest difference that the rules of energy, stroke and mean force allow [%]."""

SEEN = 0.01
"""Part of the largest stroke, of an interface or of all stages, below which a stage does not count."""

ACTING = 0.1
"""Part of its largest force from which an interface acts whose stroke is not known."""

SEQUENCE, ENERGY, STROKE, FORCE = "sequence", "energy", "stroke", "mean force"

MEANING = {
    SEQUENCE: "the order in which the stages of the devices begin to act: when the stroke of a device is past the "
    f"start of a stage by {SEEN:.0%} of its largest stroke; where the stroke is not known, when the force reaches "
    f"{ACTING:.0%} of its largest. What is closer together than the coarser record is not put in order",
    ENERGY: "the energy absorbed by the interfaces that both have, at the end of the time in common; where it is not "
    "known, the work of the force over the stroke; as part of the initial kinetic energy. Judged where the time in "
    "common has nine tenths of what each absorbs",
    STROKE: "the largest stroke of each stage of a device",
    FORCE: "the work of the force over the stroke of a stage while it is pressed for the first time, over that stroke",
}
"""What each rule is computed of, in words."""


@dataclass(frozen=True)
class Rule:
    """One rule and what was found.

    Attributes:
        name: sequence, energy, stroke or mean force.
        where: interface and stage; empty of what is of the whole.
        a: value of the first; nan of a sequence.
        b: value of the second.
        unit: of both.
        percent: how far the first is off [%]: of the second, the energy of the initial energy.
        kept: whether the rule is kept; None if it could not be judged.
        said: why not, or what is out of order.
    """

    name: str
    where: str = ""
    a: float = math.nan
    b: float = math.nan
    unit: str = ""
    percent: float = math.nan
    kept: bool | None = None
    said: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        allowed = None if self.name == SEQUENCE else ALLOWED
        return asdict(self) | {"allowed_percent": allowed}


class _Event(NamedTuple):
    """When something begins to act."""

    name: str
    time: float  # [s]
    unsure: float  # the interval of records around it [s]


class _Pair(NamedTuple):
    """A device that both have, with what is recorded of it."""

    place: Place
    stages: Sequence[Stage]  # of the first
    other: Sequence[Stage]  # of the second; of a test those of the first
    stroke: tuple[Series, Series] | None  # [mm]
    force: tuple[Series, Series] | None  # [kN]
    energy: tuple[Series, Series] | None  # [kJ]
    again: bool  # whether another one says the same of both: the partner's side where both fronts have equal sides


def rules(a: Side, b: Side) -> list[Rule]:
    """What became of each rule; the first side is a result."""
    assert a.result is not None
    pairs = list(_pairs(a, b))
    once = [pair for pair in pairs if not pair.again]
    return [_sequence(once), _energy(a, b, pairs), *_of_stages(once)]


def _pairs(a: Side, b: Side) -> Iterator[_Pair]:
    """The devices of which both have something."""
    assert a.result is not None
    theirs = {place.name: place for place in places((b.result or a.result).chain)}
    for place in places(a.result.chain):
        if place.name not in theirs:
            continue
        found: dict[str, tuple[Series, Series] | None] = {}
        for quantity, unit in (("stroke", "mm"), ("force", "kN"), ("energy", "kJ")):
            both = [place.channel(side, quantity, unit) for side in (a, b)]
            one, other = both
            found[quantity] = None if one is None or other is None else (one, other)
        if place.twin and b.result is None and not (found["stroke"] or found["energy"]):
            continue  # its force is that of the other side
        if any(found.values()):
            there = theirs[place.name]
            again = place.twin and there.twin and b.result is not None
            yield _Pair(place, place.device.stages, there.device.stages, **found, again=again)


def _title(pair: _Pair, stage: Stage) -> str:
    """A stage with its interface: ``S1-M1 coupler``, ``M1-M2``."""
    return pair.place.name if stage.name == DEVICE else f"{pair.place.name} {stage.name}"


def _sequence(pairs: Sequence[_Pair]) -> Rule:
    events = [[event for pair in pairs for event in _events(pair, of)] for of in (0, 1)]
    if not any(events):
        return Rule(SEQUENCE, said="not judged: no stroke or force of an interface is in both")
    first, second = ({event.name: event for event in some} for some in events)
    alone = [f"{name} acts in {side} only" for one, other, side in ((first, second, "A"), (second, first, "B"))
             for name in one if name not in other]  # fmt: skip
    turned = [
        f"{x} acts {'before' if first[x].time < first[y].time else 'after'} {y} in A, and not in B"
        for x, y in combinations([name for name in first if name in second], 2)
        if _order(first[x], first[y]) * _order(second[x], second[y]) < 0
    ]
    wrong = [*alone, *turned]
    more = f"; and {len(wrong) - 3} more" if len(wrong) > 3 else ""
    order = ", ".join(sorted(second, key=lambda name: second[name].time)[:8])
    said = "; ".join(wrong[:3]) + more if wrong else f"in both: {order}{' and so on' if len(second) > 8 else ''}"
    return Rule(SEQUENCE, kept=not wrong, said=said)


def _order(one: _Event, other: _Event) -> int:
    """-1 if one comes first, 1 if the other does, 0 if records do not tell."""
    apart = one.time - other.time
    return 0 if abs(apart) <= max(one.unsure, other.unsure) else int(math.copysign(1, apart))


def _events(pair: _Pair, of: int) -> Iterator[_Event]:
    """When the stages of a device begin to act, in the first (0) or the second (1)."""
    series = pair.stroke or pair.force
    if series is None or (window := common(*series)) is None:
        return
    time = instants(window, series[of])
    values = series[of].at(time)
    largest = float(values.max())
    unsure = max(one.interval for one in series)
    if pair.stroke is None:
        reached = _reached(time, np.abs(values), ACTING * float(np.abs(values).max()))
        if reached is not None:
            yield _Event(pair.place.name, reached, unsure)
        return
    for stage in (pair.stages, pair.other)[of] if largest > 0.0 else ():
        reached = _reached(time, values, stage.start / MM + SEEN * largest)
        if reached is not None:
            yield _Event(_title(pair, stage), reached, unsure)


def _reached(time: Array, values: Array, level: float) -> float | None:
    """When values first go beyond a level [s]; None if they never do."""
    beyond = np.flatnonzero(values > level)
    if not beyond.size or level <= 0.0:
        return None
    k = int(beyond[0])
    if k == 0:
        return float(time[0])
    part = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(time[k - 1] + part * (time[k] - time[k - 1]))


def _energy(a: Side, b: Side, pairs: Sequence[_Pair]) -> Rule:
    found = [energies for pair in pairs if (energies := _energies(pair))]
    if not found:
        return Rule(ENERGY, said="not judged: no interface has its energy, or force and stroke, in both")
    one, other, *whole = (sum(energies[of] for energies in found) for of in range(4))
    whose = b if b.summary else a
    assert whose.summary is not None
    assert a.result is not None
    initial = whose.summary.balance.kinetic_start_kJ
    off = percent(one - other, initial)
    kept: bool | None = _within(off)
    n = sum(1 for _ in places(a.result.chain))
    said = f"{len(found)} of {n} devices; initial energy {initial:.6g} kJ{'' if b.summary else ', of A'}"
    seen = [part / all_of if all_of > 0.0 else 1.0 for part, all_of in zip((one, other), whole, strict=True)]
    if kept and min(seen) < 1.0 - ALLOWED / 100.0:  # of a little, any difference is little beside the initial energy
        least = "AB"[seen.index(min(seen))]
        kept, said = None, f"not judged: the time in common has {min(seen):.0%} of what {least} absorbs; {said}"
    return Rule(ENERGY, "", one, other, "kJ", off, kept, said)


def _energies(pair: _Pair) -> tuple[float, ...] | None:
    """What a device absorbed in both, in the time in common, and what it did in all that each has of it [kJ]."""
    if pair.energy and (window := common(*pair.energy)):
        one, other = (float(series.at(np.array(window[1:]))[0]) for series in pair.energy)
        return one, other, *(float(series.values[-1]) for series in pair.energy)
    if pair.stroke and pair.force and (window := common(*pair.stroke, *pair.force)):
        both = list(zip(pair.stroke, pair.force, strict=True))
        one, other = (_work(*series, window) for series in both)
        return one, other, *(_work(*series, common(*series) or window) for series in both)
    return None


def _work(stroke: Series, force: Series, window: tuple[float, float]) -> float:
    """Work of a force over a stroke [kJ]."""
    time = instants(window, stroke, force)
    return float(np.trapezoid(force.at(time), stroke.at(time) * MM))


def _of_stages(pairs: Sequence[_Pair]) -> Iterator[Rule]:
    """Strokes and mean forces of all stages that count."""
    found = [(pair, stage, other, strokes) for pair in pairs for stage, other, strokes in _strokes(pair)]
    largest = max((max(strokes) for *_, strokes in found), default=0.0)
    counting = [one for one in found if max(one[-1]) > SEEN * largest]
    if not counting:
        yield Rule(STROKE, said="not judged: no stroke of an interface is in both")
    for pair, stage, _, (one, other) in counting:
        off = percent(one - other, other)
        yield Rule(STROKE, _title(pair, stage), one, other, "mm", off, _within(off))
    n = 0
    for pair, stage, theirs, strokes in counting:
        if pair.stroke is None or pair.force is None or not min(strokes) > 0.0:
            continue
        n += 1
        yield _force(pair, stage, theirs, strokes)
    if not n:
        yield Rule(FORCE, said="not judged: no interface has force and stroke in both")


def _strokes(pair: _Pair) -> Iterator[tuple[Stage, Stage, tuple[float, float]]]:
    """The stages that both have by name, with their strokes [mm]."""
    if pair.stroke is None or (window := common(*pair.stroke)) is None:
        return
    one, other = (float(series.at(instants(window, series)).max()) * MM for series in pair.stroke)
    theirs = {stage.name: stage for stage in pair.other}
    for stage in pair.stages:
        if stage.name in theirs:
            strokes = stage.stroke(one) / MM, theirs[stage.name].stroke(other) / MM
            if stage.name != CAR_BODY or max(strokes) > 0.0:
                yield stage, theirs[stage.name], strokes


def _force(pair: _Pair, stage: Stage, theirs: Stage, strokes: tuple[float, float]) -> Rule:
    """The mean forces of a stage, over the part of its stroke for which both have records."""
    assert pair.stroke is not None
    assert pair.force is not None
    name, parts = _title(pair, stage), (stage, theirs)
    window = common(*pair.stroke, *pair.force)
    if window is None:
        return Rule(FORCE, name, said="not judged: force and stroke are at no time in both")
    paths = [_pressed(pair.stroke[of], pair.force[of], window) for of in (0, 1)]
    missed = max(0.0, *(float(way[0]) - part.start / MM for (way, _), part in zip(paths, parts, strict=True)))
    spans = [(part.start / MM + missed, min(float(way[-1]), part.end / MM))
             for (way, _), part in zip(paths, parts, strict=True)]  # fmt: skip
    if any(start >= end for start, end in spans):
        return Rule(FORCE, name, said="not judged: there are no records of force and stroke while it is pressed")
    one, other = (_mean_force(*path, *span) for path, span in zip(paths, spans, strict=True))
    off = percent(one - other, other)
    unseen = max(stroke - (end - start) for stroke, (start, end) in zip(strokes, spans, strict=True))
    said = f"without {unseen:.4g} mm of it, of which there are no records" if unseen > SEEN * max(strokes) else ""
    return Rule(FORCE, name, one, other, "kN", off, _within(off), said)


def _pressed(stroke: Series, force: Series, window: tuple[float, float]) -> tuple[Array, Array]:
    """Strokes that are reached for the first time [mm], growing, and the force at each [kN]."""
    time = instants(window, stroke, force)
    way, forces = stroke.at(time), force.at(time)
    last = int(np.argmax(way))
    way, forces = way[: last + 1], forces[: last + 1]
    highest = np.maximum.accumulate(way)
    first = np.concatenate([[True], way[1:] > highest[:-1]])  # the way back and again does not count
    return way[first], forces[first]


def _mean_force(way: Array, forces: Array, start: float, end: float) -> float:
    """Mean force from one stroke to another one [kN], both among the recorded ones."""
    inner = way[(way > start) & (way < end)]
    at = np.concatenate([[start], inner, [end]])
    return float(np.trapezoid(np.interp(at, way, forces), at) / (end - start))


def _within(off: float) -> bool:
    """Whether a difference is allowed; never one that is no number."""
    return abs(off) <= ALLOWED * (1.0 + ROUND_OFF)
