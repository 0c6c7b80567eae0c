"""What is sought: between the unit cube of a search and the values of a scenario.

A search moves in the unit cube, one axis for each free parameter. An ordered parameter takes its axis between the one
that it stays above and its own upper bound, so that every point of the cube is allowed. Parameters that a constraint
solves for have no axis: they follow from the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from trainmj.device import Array
from trainmj.scenario import Scenario
from trainmj.scenario.paths import changed
from trainmj.units import KJ, KN, MM


class Setting(NamedTuple):
    """A place in the scenario that gets factor * parameter + offset."""

    path: str
    factor: float
    offset: float


@dataclass(frozen=True)
class Unknown:
    """A parameter.

    Attributes:
        name: the user's.
        unit: of its value; empty if there is none.
        lower: bound.
        upper: bound.
        log: whether the search and the uncertainty are in its logarithm.
        start: value at which the search may begin.
        above: place of the parameter it never falls below; None if there is none.
        gap: by how much it stays above that one.
        settings: what it sets.
    """

    name: str
    unit: str
    lower: float
    upper: float
    log: bool
    start: float
    above: int | None
    gap: float
    settings: tuple[Setting, ...]

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
        curve: path of the curve.
        lower: stroke at which the area begins [mm].
        upper: stroke at which it ends [mm].
        energy: what it must be [kJ].
        by: place of the parameter that is solved for.
        tolerance: miss that counts as one standard deviation [kJ].
    """

    name: str
    curve: str
    lower: float
    upper: float
    energy: float
    by: int
    tolerance: float


class Point(NamedTuple):
    """A trial.

    Attributes:
        value: (n,) of every parameter.
        missed: (n_constraint,) by how much each constraint is missed, in its tolerances.
    """

    value: Array
    missed: Array


class Unknowns:
    """All parameters and constraints of an identification.

    Args:
        scenario: whose values are set.
        parameters: in the order of the file.
        constraints: each solved by a parameter of its own.
    """

    def __init__(self, scenario: Scenario, parameters: tuple[Unknown, ...], constraints: tuple[Area, ...]) -> None:
        """Order the parameters so that each comes behind the one it stays above."""
        self.parameters = parameters
        self.constraints = constraints
        self._values = scenario.values()
        self._short = dict(scenario.parameters)
        solved = {c.by for c in constraints}
        self.free = [k for k in range(len(parameters)) if k not in solved]
        self._order = _ordered(parameters)

    @property
    def names(self) -> list[str]:
        """Of all parameters."""
        return [p.name for p in self.parameters]

    def point(self, unit: Array) -> Point:
        """The trial at a place of the unit cube (n_free,)."""
        values = np.full(len(self.parameters), np.nan)
        along = dict(zip(self.free, unit, strict=True))
        for k in self._order:
            if k in along:
                low, high = self._span(k, values)
                values[k] = self.parameters[k].value(low + float(np.clip(along[k], 0.0, 1.0)) * (high - low))
        return self.solved(values)

    def place(self, values: Array) -> Array:
        """Where in the unit cube (n_free,) a trial of these values is."""
        unit = np.empty(len(self.free))
        for n, k in enumerate(self.free):
            low, high = self._span(k, values)
            unit[n] = (self.parameters[k].scaled(values[k]) - low) / (high - low) if high > low else 0.5
        return np.clip(unit, 0.0, 1.0)

    def solved(self, values: Array) -> Point:
        """The trial whose free values are given and whose others follow from the constraints."""
        values = values.copy()
        for k in {c.by for c in self.constraints}:
            values[k] = self.parameters[k].start
        for c in self.constraints:
            values[c.by] = self._solve(c, values)
        missed = [(self.area(c, values) - c.energy) / c.tolerance for c in self.constraints]
        return Point(values, np.array(missed))

    def start(self) -> Point:
        """The trial of the start values."""
        return self.solved(np.array([p.start for p in self.parameters]))

    def changes(self, values: Array) -> dict[str, float]:
        """What a trial sets in the scenario, by path; to ten digits, so that a file can hold just that."""
        return {
            s.path: rounded(s.factor * float(value) + s.offset, 10)
            for p, value in zip(self.parameters, values, strict=True)
            for s in p.settings
        }

    def area(self, constraint: Area, values: Array) -> float:
        """Area under the curve of a constraint [kJ]."""
        given, _ = changed(self._values, {}, self._short, self.changes(values))
        stroke, force = curve_points(given, constraint.curve)
        inner = (stroke > constraint.lower) & (stroke < constraint.upper)
        at = np.concatenate([[constraint.lower], stroke[inner], [constraint.upper]])
        return float(np.trapezoid(np.interp(at, stroke, force), at)) * (KN * MM / KJ)

    def _span(self, k: int, values: Array) -> tuple[float, float]:
        """From where to where a parameter may go, on its axis."""
        p = self.parameters[k]
        low = p.lower if p.above is None else max(p.lower, float(values[p.above]) + p.gap)
        return p.scaled(min(low, p.upper)), p.scaled(p.upper)

    def _solve(self, constraint: Area, values: Array) -> float:
        """The value of the parameter that meets a constraint, or the bound that comes nearest."""
        p = self.parameters[constraint.by]
        low, high = map(p.value, self._span(constraint.by, values))

        def miss(value: float) -> float:
            trial = values.copy()
            trial[constraint.by] = value
            return self.area(constraint, trial) - constraint.energy

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
