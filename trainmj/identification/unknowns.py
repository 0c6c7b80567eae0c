"""All that is sought together: the way from the unit cube of a search to values of a scenario, and back.

A search moves in the unit cube, with an axis for each free parameter. The axis of an ordered parameter runs from the
parameter that it stays above to its own upper bound, so every point of the cube is allowed. A parameter that a
constraint solves for has no axis; it follows from the others. A whole curve has an axis for each of its slopes rather
than for each force: it rises from its first to its last point, whatever they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from trainmj.collision.envelope import Array
from trainmj.files.source import Source
from trainmj.identification.file import CurvePart, OffsetPart, TargetsFile, absolute
from trainmj.identification.sought import Area, Rise, Unknown, curve_points, inner_forces, offset, single
from trainmj.scenario import Scenario
from trainmj.scenario.scenario import changed

_BENT = 3.0  # largest logarithm of the power that bends a curve: it gives nearly no area, or nearly all

_MET = 1e-10  # part of an area by which a constraint may be missed


class Point(NamedTuple):
    """A trial."""

    value: Array  # (n,) of every parameter
    missed: Array  # (n_constraint,) by how much each constraint is missed, in units of its tolerance


@dataclass
class Unknowns:
    """All parameters and constraints of an identification."""

    scenario: Scenario  # whose values are set
    parameters: tuple[Unknown, ...]  # in the order of the file, a curve's inner forces in its place
    constraints: tuple[Area, ...] = ()  # each solved by a parameter of its own
    curves: tuple[Rise, ...] = ()  # those sought as a whole

    def __post_init__(self) -> None:
        """Tell the parameters with an axis of their own from those that are solved, and those of curves."""
        self._source = Source(self.scenario.values())
        solved = {c.by for c in self.constraints}
        members = {k for curve in self.curves for k in curve.members}
        self.free = [k for k in range(len(self.parameters)) if k not in solved]
        self._alone = [k for k in self.free if k not in members]
        self._near = {c.part.of: self._in_part_of(c.part.of) for c in self.constraints}

    @classmethod
    def of(cls, spec: TargetsFile, scenario: Scenario) -> Unknowns:
        """The unknowns of a checked file."""
        points = {name: curve_points(scenario.values(), part.curve) for name, part in spec.curves().items()}
        sizes = [points[name][0].size - 2 if name in points else 1 for name in spec.parameters]
        places = dict(
            zip(spec.parameters, accumulate(sizes, initial=0), strict=False)
        )  # of a curve, of its first force
        parameters: list[Unknown] = []
        rises: dict[str, Rise] = {}
        for name, part in spec.parameters.items():
            if isinstance(part, CurvePart):
                stroke, force = points[name]
                forces = inner_forces(name, part, stroke, force)
                members = tuple(range(len(parameters), len(parameters) + len(forces)))
                rises[name] = Rise(members, stroke, float(force[0]), float(force[-1]), part.slopes)
                parameters += forces
            elif isinstance(part, OffsetPart):
                parameters.append(offset(name, part, spec.channels()))
            else:
                above = None if part.above is None else places[part.above]
                parameters.append(single(name, part, scenario, above))
        areas = []
        for name, c in spec.constraints.items():
            by = rises[c.by].widest(c.from_mm, c.to_mm) if c.by in rises else places[c.by]
            areas.append(Area(name, c, by, absolute(c.tolerance, c.area_kJ)))
        return cls(scenario, tuple(parameters), tuple(areas), tuple(rises.values()))

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
        for k in sorted(self._alone, key=self._depth):  # each behind the one that it stays above
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
        near = self._near[constraint.part.of]
        changes = {name: value for name, value in self.changes(values).items() if name in near}
        given = changed(self._source, self.scenario.parameters, changes).values
        return constraint.under(*curve_points(given, constraint.part.of))

    def _in_part_of(self, curve: str) -> frozenset[str]:
        """What a trial sets that may have a part in a curve: in it, around it, or in a curve that has a name."""

        def touches(path: str) -> bool:
            return (
                path.startswith("curves.") or f"{path}.".startswith(f"{curve}.") or f"{curve}.".startswith(f"{path}.")
            )

        names = {setting.path for parameter in self.parameters for setting in parameter.settings}
        return frozenset(name for name in names if any(map(touches, self.scenario.paths(name))))

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

    def _depth(self, k: int) -> int:
        """How many parameters there are below a parameter, which stays above them."""
        above = self.parameters[k].above
        return 0 if above is None else 1 + self._depth(above)

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
