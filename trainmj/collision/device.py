"""Energy-absorbing devices: stages, crush curves, and two devices in series.

A device is compressed by a stroke u. Its envelope F_env(u) is piecewise linear; empty strokes and shear-off are parts
of it. The force follows from the law of the device, in :mod:`trainmj.collision.law`. Where the envelope rises faster
than the unloading stiffness K, the force climbs along K.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from trainmj.collision.law import crush
from trainmj.errors import InputError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """One part of a device that acts after the one before it: a coupler, then an anti-climber.

    Attributes:
        name: what the report calls it.
        start: stroke of the device at which the stage engages [m].
        end: stroke of the device at which it is used up [m]; infinite for the last stage.
        limit: largest stroke of the stage itself that the design allows [m]; infinite if none is stated.
    """

    name: str
    start: float
    end: float
    limit: float = np.inf

    def stroke(self, device_stroke: float) -> float:
        """Stroke of this stage when the whole device is compressed by device_stroke [m]."""
        return max(0.0, min(device_stroke, self.end) - self.start)


@dataclass(frozen=True, eq=False)
class Envelope:
    """A piecewise-linear crush curve with the elastic branch and dashpot that belong to it.

    Between points the force is linear; two points at one stroke are a jump; past the last point its force is held.

    Attributes:
        stroke: (n,) strokes of the points [m], from 0, never decreasing.
        force: (n,) crush forces [N], never negative.
        stiffness: unloading stiffness K [N/m].
        damping: dashpot c on the elastic branch [N s/m].
        slope: (n,) slope behind each point [N/m]; 0 across a jump and behind the last point. Computed.

    Raises:
        InputError: if a point or constant breaks these rules.
    """

    stroke: Array
    force: Array
    stiffness: float
    damping: float = 0.0
    slope: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the rules above and compute the slopes."""
        if self.stroke.shape != self.force.shape or self.stroke.ndim != 1 or self.stroke.size < 2:
            raise InputError("an envelope needs two or more points, as many strokes as forces")
        if not (np.isfinite(self.stroke).all() and np.isfinite(self.force).all()):
            raise InputError("an envelope must be finite at every point")
        width, rise = self.stroke[1:] - self.stroke[:-1], self.force[1:] - self.force[:-1]
        if self.stroke[0] != 0.0 or (width < 0).any():
            raise InputError("the strokes of an envelope must start at 0 and never go back")
        if (self.force < 0).any():
            raise InputError("the forces of an envelope must not be negative: devices push only")
        if not (0 < self.stiffness < np.inf and 0 <= self.damping < np.inf):
            raise InputError("an envelope needs a stiffness > 0 and a damping >= 0")
        slope = np.zeros_like(self.force)
        np.divide(rise, width, out=slope[:-1], where=width > 0)
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
        return force[0] > 0.0 or max(slope) > self.stiffness or any(jumps)

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
        return Envelope(found[:, 0], found[:, 1], self.stiffness, self.damping)

    def is_like(self, other: Envelope) -> bool:
        """Whether the other one is the same law, number by number."""
        return self is other or (
            np.array_equal(self.stroke, other.stroke)
            and np.array_equal(self.force, other.force)
            and (self.stiffness, self.damping) == (other.stiffness, other.damping)
        )

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

    def respond(self, stroke: float, rate: float, plastic: float) -> tuple[float, float]:
        """Force and plastic state after one step of the law.

        Args:
            stroke: compression u at the end of the step [m].
            rate: du/dt [m/s].
            plastic: plastic state u_p before the step [m].

        Returns:
            The force F [N] and the plastic state u_p [m] after the step.
        """
        return crush.respond(stroke, rate, plastic, self.stiffness, self.damping, self.force_at(stroke))


def work_along(stroke: Array, force: Array) -> Array:
    """(n,) work along a path up to each of its points, strokes [m] and forces [N] given [J]."""
    return np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke)))


@dataclass(frozen=True, eq=False)
class Device:
    """Everything at one end of a vehicle that absorbs energy: an envelope, and the stages it is made of.

    Attributes:
        name: its name in the scenario.
        envelope: the law's data.
        stages: in the order in which they act, at least one.
    """

    name: str
    envelope: Envelope
    stages: tuple[Stage, ...]


def in_series(first: Device, second: Device) -> tuple[Envelope, tuple[Array, Array]]:
    """Two devices, one behind the other, as one: equal force, strokes added.

    Two equal devices act alike: the force of one at twice the stroke, half the stiffness, half the dashpot. Of two
    different ones the weaker crushes first; while one drops after shear-off the other unloads along its stiffness.
    Where the pair would snap back, its force drops at constant stroke to where the path comes back to this stroke. A
    curve that rises faster than its stiffness counts as climbing along it, as it does alone. The path holds for loading
    without earlier unloading; the stiffnesses and dashpots combine as reciprocals, which is exact for the stiffnesses,
    and for the dashpots when c/K is the same on both sides.

    Args:
        first: the device on the left.
        second: the device on the right.

    Returns:
        The envelope of the pair, and of both devices (n,) the stroke [m] at each of its points.
    """
    a, b = first.envelope, second.envelope
    stiffness = 1.0 / (1.0 / a.stiffness + 1.0 / b.stiffness)
    damping = a.damping * b.damping / (a.damping + b.damping) if a.damping and b.damping else 0.0
    if a.is_like(b):
        return Envelope(2.0 * a.stroke, a.force, a.stiffness / 2.0, a.damping / 2.0), (a.stroke, a.stroke)
    path = _series_path(a.climbing, b.climbing)
    path = path[np.append(True, np.any(np.diff(path, axis=0) != 0.0, axis=1))]
    stroke = path[:, 0] + path[:, 1]
    largest = np.maximum.accumulate(stroke)
    back = np.flatnonzero((stroke[:-1] < largest[:-1]) & (stroke[1:] > largest[:-1]))  # between these two it comes back
    share = (largest[back] - stroke[back]) / (stroke[back + 1] - stroke[back])
    met = path[back] + share[:, None] * (path[back + 1] - path[back])
    path = np.insert(path, back + 1, met, axis=0)
    largest = np.insert(largest, back + 1, largest[back])
    return Envelope(largest, path[:, 2], stiffness, damping), (path[:, 0], path[:, 1])


def _series_path(a: Envelope, b: Envelope) -> Array:
    """(n, 3): strokes of both devices and their common force [m, m, N], as the pair is pressed together.

    The common force climbs through the forces of all points. At each, a device that does not carry more at once
    (a plateau, or a drop after shear-off) runs through that part of its curve before the force climbs on, while the
    other one unloads by what the force falls.
    """
    rows: list[tuple[float, float, float]] = []
    levels = np.unique(np.concatenate([a.force, b.force]))
    for level in levels[levels <= min(a.force.max(), b.force.max())]:
        held = [_reach(a, level), _reach(b, level)]
        for i, e, other in ((0, a, b), (1, b, a)):
            points = _excursion(e, level)
            for stroke, force in points:
                strokes = list(held)
                strokes[i] = stroke
                strokes[1 - i] -= (level - force) / other.stiffness
                rows.append((strokes[0], strokes[1], force))
            held[i] = points[-1][0] if points else held[i]
    largest, (u, v, force) = max(u + v for u, v, _ in rows), rows[-1]
    if u + v < largest:  # it has snapped at its end: what has ended runs on
        ended = [e.force.max() <= other.force.max() for e, other in ((a, b), (b, a))]
        on = (largest - u - v) / sum(ended)
        rows.append((u + on * ended[0], v + on * ended[1], force))
    return np.array(rows)


def _reach(e: Envelope, force: float) -> float:
    """Smallest stroke at which a curve carries a force."""
    k = int(np.argmax(e.force >= force))
    if k == 0 or e.force[k] == force:
        return float(e.stroke[k])
    share = (force - e.force[k - 1]) / (e.force[k] - e.force[k - 1])
    return float(e.stroke[k - 1] + share * (e.stroke[k] - e.stroke[k - 1]))


def _excursion(e: Envelope, force: float) -> list[tuple[float, float]]:
    """Points a curve runs through from where it first carries a force to where it carries more, or to its end."""
    first = int(np.argmax(e.force >= force))
    above = np.flatnonzero(e.force > force)
    until = int(above[0]) if above.size else e.force.size
    points = [(float(e.stroke[k]), float(e.force[k])) for k in range(first, until)]
    if points and above.size and points[-1][1] < force:
        k = until - 1
        share = (force - e.force[k]) / (e.force[until] - e.force[k])
        points.append((float(e.stroke[k] + share * (e.stroke[until] - e.stroke[k])), force))
    return points
