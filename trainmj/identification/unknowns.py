"""What is sought: the way from the unit cube of a search to values of a scenario, and back.

A search moves in the unit cube, with an axis for each free parameter. The axis of an ordered parameter runs from the
parameter that it stays above to its own upper bound, so every point of the cube is allowed. A parameter that a
constraint solves for has no axis; it follows from the others. A whole curve has an axis for each of its slopes rather
than for each force: it rises from its first to its last point, whatever they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from trainmj.collision.device import Array
from trainmj.files.source import Source
from trainmj.identification.file import AreaPart
from trainmj.scenario import Scenario
from trainmj.scenario.paths import changed
from trainmj.units import KJ, KN, MM

_BENT = 3.0  # largest logarithm of the power that bends a curve: it gives nearly no area, or nearly all

_MET = 1e-10  # part of an area by which a constraint may be missed


class Setting(NamedTuple):
    """A path of the scenario that is set to factor * parameter + offset."""

    path: str
    factor: float = 1.0
    offset: float = 0.0

    def of(self, parameter: float) -> float:
        """What the path is set to."""
        return self.factor * parameter + self.offset


@dataclass(frozen=True)
class Unknown:
    """A parameter.

    Attributes:
        name: the user's.
        unit: of its value; empty if there is none.
        lower: bound.
        upper: bound.
        start: value at which the search may start.
        settings: what it sets.
        log: whether search and uncertainty use its logarithm.
        above: place of the parameter that it stays above; None if there is none.
        gap: by how much at least.
    """

    name: str
    unit: str
    lower: float
    upper: float
    start: float
    settings: tuple[Setting, ...]
    log: bool = False
    above: int | None = None
    gap: float = 0.0

    def scaled(self, value: float) -> float:
        """The value on its axis, which is straight or logarithmic."""
        return float(np.log(value)) if self.log else value

    def value(self, scaled: float) -> float:
        """The value of a place on its axis."""
        return float(np.exp(scaled)) if self.log else scaled

    @property
    def range(self) -> float:
        """From bound to bound on its axis."""
        return self.scaled(self.upper) - self.scaled(self.lower)


@dataclass(frozen=True)
class Area:
    """A constraint: the area under a curve.

    Attributes:
        name: the user's.
        part: its entry in the file: curve, strokes and area.
        by: place of the parameter that is solved for.
        tolerance: deviation that counts as one standard deviation [kJ].
    """

    name: str
    part: AreaPart
    by: int
    tolerance: float

    def under(self, stroke: Array, force: Array) -> float:
        """Area under points [mm], [kN] between the strokes of the constraint [kJ]."""
        lower, upper = self.part.from_mm, self.part.to_mm
        inner = (stroke > lower) & (stroke < upper)
        at = np.concatenate([[lower], stroke[inner], [upper]])
        return float(np.trapezoid(np.interp(at, stroke, force), at)) * (KN * MM / KJ)


@dataclass(frozen=True)
class Rise:
    """A whole curve: its inner forces lie between the first and the last one, and never fall.

    Its axes are the logarithms of its slopes; only their ratios count, so the last force stays. Bending raises the rise
    of each force, as a share of the rise to the last one, to a power, which gives the curve any area.

    Attributes:
        name: the user's.
        members: places of its inner forces among the parameters.
        stroke: (n + 1,) of its points [mm].
        first: force at the first one [kN].
        last: force at the last one [kN], above the first.
        factor: each slope is within this factor of their middle, up or down, before bending.
    """

    name: str
    members: tuple[int, ...]
    stroke: Array
    first: float
    last: float
    factor: float

    @property
    def n(self) -> int:
        """Number of slopes, one more than inner forces."""
        return self.stroke.size - 1

    def widest(self, lower: float, upper: float) -> int:
        """The member between two strokes [mm] that carries most of the area between its neighbours."""
        inner = (self.stroke[1:-1] > lower) & (self.stroke[1:-1] < upper)
        return self.members[int(np.argmax(np.where(inner, self.stroke[2:] - self.stroke[:-2], 0.0)))]

    def slopes(self, unit: Array) -> Array:
        """Logarithms of the slopes (n,) at a place on its axes, up to a common constant."""
        return np.asarray((2.0 * unit - 1.0) * np.log(self.factor))

    def forces(self, unit: Array, bend: float = 0.0) -> Array:
        """Inner forces (n - 1,) [kN] at a place on its axes; bend is the logarithm of the power."""
        rise = np.cumsum(np.exp(self.slopes(unit)) * np.diff(self.stroke))
        share = (rise[:-1] / rise[-1]) ** np.exp(bend)
        return np.asarray(self.first + (self.last - self.first) * share)

    def place(self, forces: Array) -> Array:
        """The place on its axes (n,) of the curve with these inner forces, or of the nearest one that rises."""
        rise = np.diff(np.concatenate([[self.first], forces, [self.last]]))
        mean = (self.last - self.first) / self.n
        slopes = np.log(np.maximum(rise, 1e-9 * mean) / np.diff(self.stroke))
        return np.asarray(np.clip(0.5 + 0.5 * (slopes - np.median(slopes)) / np.log(self.factor), 0.0, 1.0))


class Point(NamedTuple):
    """A trial.

    Attributes:
        value: (n,) of every parameter.
        missed: (n_constraint,) by how much each constraint is missed, in units of its tolerance.
    """

    value: Array
    missed: Array


class Unknowns:
    """All parameters and constraints of an identification.

    Args:
        scenario: whose values are set.
        parameters: in the order of the file, a curve's inner forces in its place.
        constraints: each solved by a parameter of its own.
        curves: those sought as a whole.
    """

    def __init__(
        self,
        scenario: Scenario,
        parameters: tuple[Unknown, ...],
        constraints: tuple[Area, ...],
        curves: tuple[Rise, ...] = (),
    ) -> None:
        """Order the parameters so that each comes behind the one it stays above."""
        self.parameters = parameters
        self.constraints = constraints
        self.curves = curves
        self._source = Source(scenario.values())
        self._short = dict(scenario.parameters)
        solved = {c.by for c in constraints}
        self.free = [k for k in range(len(parameters)) if k not in solved]
        members = {k for curve in curves for k in curve.members}
        self._alone = [k for k in self.free if k not in members]
        self._order = [k for k in _ordered(parameters) if k in self._alone]

    @property
    def n_axes(self) -> int:
        """Number of axes of the unit cube: those of single parameters, then those of each curve."""
        return len(self._alone) + sum(curve.n for curve in self.curves)

    @property
    def names(self) -> list[str]:
        """Of all parameters."""
        return [p.name for p in self.parameters]

    def point(self, unit: Array) -> Point:
        """The trial at a place of the unit cube (n_axes,)."""
        unit = np.clip(unit, 0.0, 1.0)
        values = np.array([p.start for p in self.parameters])
        along = dict(zip(self._alone, unit, strict=False))
        for k in self._order:
            low, high = self._span(k, values)
            values[k] = self.parameters[k].value(low + float(along[k]) * (high - low))
        for curve, part in self._parts(unit):
            self._bend(curve, part, values)
        return self.solved(values)

    def place(self, values: Array) -> Array:
        """Where in the unit cube (n_axes,) a trial of these values is."""
        unit = np.empty(self.n_axes)
        for n, k in enumerate(self._alone):
            low, high = self._span(k, values)
            unit[n] = (self.parameters[k].scaled(values[k]) - low) / (high - low) if high > low else 0.5
        for curve, part in self._parts(unit):
            part[:] = curve.place(values[list(curve.members)])
        return np.clip(unit, 0.0, 1.0)

    def roughness(self, unit: Array) -> Array:
        """Logarithms of the ratios of neighbouring slopes of all curves at a place of the unit cube."""
        return np.concatenate([np.diff(curve.slopes(part)) for curve, part in self._parts(unit)] or [np.empty(0)])

    def solved(self, values: Array) -> Point:
        """The trial whose free values are given and whose others follow from the constraints."""
        values = values.copy()
        for c in self.constraints:
            values[c.by] = self._solve(c, values)
        missed = [(self.area(c, values) - c.part.area_kJ) / c.tolerance for c in self.constraints]
        return Point(values, np.array(missed))

    def start(self) -> Point:
        """The trial of the start values."""
        return self.solved(np.array([p.start for p in self.parameters]))

    def changes(self, values: Array) -> dict[str, float]:
        """What a trial sets in the scenario, by path; rounded to ten digits, which a file can hold."""
        return {
            s.path: rounded(s.of(float(value)), 10)
            for p, value in zip(self.parameters, values, strict=True)
            for s in p.settings
        }

    def area(self, constraint: Area, values: Array) -> float:
        """Area under the curve of a constraint [kJ]."""
        given = changed(self._source, self._short, self.changes(values)).values
        return constraint.under(*curve_points(given, constraint.part.of))

    def _parts(self, unit: Array) -> Iterator[tuple[Rise, Array]]:
        """Each curve and its part of a place of the unit cube, as a view."""
        at = len(self._alone)
        for curve in self.curves:
            yield curve, unit[at : at + curve.n]
            at += curve.n

    def _bend(self, curve: Rise, unit: Array, values: Array) -> None:
        """Put the inner forces of a curve into the values, bent to the area that a constraint asks for, if any."""
        members = list(curve.members)
        constraint = next((c for c in self.constraints if c.by in members), None)

        def miss(bend: float) -> float:
            values[members] = inner = curve.forces(unit, bend)
            if constraint is None:
                return 0.0
            force = np.concatenate([[curve.first], inner, [curve.last]])
            return constraint.under(curve.stroke, force) - constraint.part.area_kJ

        if constraint is not None and miss(-_BENT) * miss(_BENT) < 0.0:
            miss(float(brentq(miss, -_BENT, _BENT, xtol=1e-12)))
        else:
            miss(0.0)

    def _span(self, k: int, values: Array) -> tuple[float, float]:
        """The ends of a parameter's axis."""
        p = self.parameters[k]
        low = p.lower if p.above is None else max(p.lower, float(values[p.above]) + p.gap)
        return p.scaled(min(low, p.upper)), p.scaled(p.upper)

    def _solve(self, constraint: Area, values: Array) -> float:
        """The value of the parameter that meets a constraint, or the nearest bound."""
        p = self.parameters[constraint.by]
        low, high = map(p.value, self._span(constraint.by, values))

        def miss(value: float) -> float:
            trial = values.copy()
            trial[constraint.by] = value
            return self.area(constraint, trial) - constraint.part.area_kJ

        if abs(miss(values[constraint.by])) <= _MET * constraint.part.area_kJ:
            return float(values[constraint.by])
        ends = miss(low), miss(high)
        if ends[0] * ends[1] >= 0:
            return low if abs(ends[0]) <= abs(ends[1]) else high
        return float(brentq(miss, low, high, xtol=1e-12 * max(abs(low), abs(high)), rtol=1e-14))


def rounded(value: float, digits: int) -> float:
    """A value to so many significant digits."""
    return float(f"{value:.{digits}g}")


def curve_points(values: Mapping[str, Any], path: str) -> tuple[Array, Array]:
    """Strokes [mm] and forces [kN] of a curve in the plain values of a scenario.

    Raises:
        LookupError: if the path leads to no curve.
    """
    here: Any = values
    for key in path.split("."):
        here = here[int(key)] if isinstance(here, list) else here[key]
    stroke: list[float] = []
    force: list[float] = []
    for part in here if isinstance(here, list) else [here]:
        curve = values["curves"][part] if isinstance(part, str) else part
        stroke += curve["stroke_mm"]
        force += curve["force_kN"]
    return np.array(stroke, dtype=float), np.array(force, dtype=float)


def _ordered(parameters: tuple[Unknown, ...]) -> list[int]:
    """Places of the parameters, each behind the one it stays above."""
    order: list[int] = []
    while len(order) < len(parameters):
        ready = [k for k, p in enumerate(parameters) if k not in order and (p.above is None or p.above in order)]
        order += ready
    return order
