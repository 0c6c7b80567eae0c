"""Crush curves: piecewise linear, with an unloading stiffness and a dashpot.

Empty strokes and shear-off are parts of an envelope. Where it rises faster than the unloading stiffness K, the force
climbs along K.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from trainmj.errors import InputError
from trainmj.symbol import largest
from trainmj.units import beyond

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Envelope:
    """A piecewise-linear crush curve with the elastic branch and dashpot that belong to it.

    Between points the force is linear; two points at one stroke are a jump; past the last point its force is held, or
    rises along a last slope.

    Attributes:
        stroke: (n,) strokes of the points [m], from 0, never decreasing.
        force: (n,) crush forces [N], never negative.
        stiffness: unloading stiffness K [N/m].
        damping: dashpot c on the elastic branch [N s/m].
        last_slope: slope behind the last point [N/m], as of an end stop.
        slope: (n,) slope behind each point [N/m]; 0 across a jump. Computed.

    Raises:
        InputError: if a point or constant breaks these rules.
    """

    stroke: Array
    force: Array
    stiffness: float
    damping: float = 0.0
    last_slope: float = 0.0
    slope: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the rules above and compute the slopes."""
        if self.stroke.shape != self.force.shape or self.stroke.ndim != 1 or self.stroke.size < 2:
            raise InputError("an envelope needs two or more points, as many strokes as forces")
        if not ((abs(self.stroke) < np.inf).all() and (abs(self.force) < np.inf).all()):
            raise InputError("an envelope must be finite at every point")
        width, rise = self.stroke[1:] - self.stroke[:-1], self.force[1:] - self.force[:-1]
        if self.stroke[0] != 0.0 or (width < 0).any():
            raise InputError("the strokes of an envelope must start at 0 and never go back")
        if (self.force < 0).any():
            raise InputError("the forces of an envelope must not be negative: devices push only")
        if not 0 <= self.last_slope < np.inf:
            raise InputError("the last slope of an envelope must not be negative")
        if not (0 < self.stiffness < np.inf and 0 <= self.damping < np.inf):
            raise InputError("an envelope needs a stiffness > 0 and a damping >= 0")
        slope = np.zeros(self.force.shape, np.result_type(self.stroke, self.force, np.asarray(self.last_slope)))
        np.divide(rise, width, out=slope[:-1], where=width > 0)
        slope[-1] = self.last_slope
        object.__setattr__(self, "slope", slope)

    def force_at(self, stroke: float) -> float:
        """Crush force at a stroke [m] of first loading [N]; at a jump, the force behind it."""
        at, force, slope = self._points
        k = max(0, bisect_right(at, stroke) - 1)
        return force[k] + slope[k] * (stroke - at[k])

    @cached_property
    def steep(self) -> bool:
        """Whether it rises faster than its stiffness in places."""
        at, force, slope = self._points
        jumps = (v == u and g > f for (u, v), (f, g) in zip(pairwise(at), pairwise(force), strict=True))
        return force[0] > 0.0 or beyond(largest(slope), self.stiffness) or any(jumps)

    @cached_property
    def climbing(self) -> Envelope:
        """The path of first loading: the crush curve, and the climb along K to it where it rises faster."""
        if not self.steep:
            return self
        strokes, forces, slopes = self._points
        at, force = 0.0, 0.0
        path = [(at, force)]
        for k in range(1, len(strokes)):
            if strokes[k - 1 : k] == strokes[k : k + 1] == strokes[k + 1 : k + 2]:
                continue  # within a jump: the law goes from its first point to its last
            stroke, crush = strokes[k], forces[k]
            climbed = force + self.stiffness * (stroke - at)
            missing = forces[k - 1] - force
            if climbed > crush and missing > 0.0 and stroke > at:  # the climb reaches the curve on the way
                met = at + missing / (self.stiffness - slopes[k - 1])
                path.append((met, self.force_at(met)))
            at, force = stroke, min(climbed, crush)
            path.append((at, force))
        if force < forces[-1]:
            path.append((at + (forces[-1] - force) / self.stiffness, forces[-1]))
        found = np.array(path)
        return Envelope(found[:, 0], found[:, 1], self.stiffness, self.damping, min(self.last_slope, self.stiffness))

    def energy(self, stroke: float) -> float:
        """Work of first loading from 0 to a stroke [m] along the envelope [J]."""
        at, force, _ = self._points
        k = max(0, bisect_right(at, stroke) - 1)
        return self._work[k] + 0.5 * (force[k] + self.force_at(stroke)) * (stroke - at[k])

    @cached_property
    def _points(self) -> tuple[list[float], list[float], list[float]]:
        """Strokes, forces and slopes as plain numbers, which are quicker one by one."""
        return self.stroke.tolist(), self.force.tolist(), self.slope.tolist()

    @cached_property
    def _work(self) -> list[float]:
        """(n,) work up to each point [J]."""
        work: list[float] = work_along(self.stroke, self.force).tolist()
        return work


def work_along(stroke: Array, force: Array) -> Array:
    """(n,) work along a path up to each of its points, strokes [m] and forces [N] given [J]."""
    return np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke)))
