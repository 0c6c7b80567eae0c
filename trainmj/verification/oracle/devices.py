"""What one device does, written as branches: on each the force is a smooth formula, and conditions say when it ends.

All is SI. Stroke u is counted from where the device touches, rate v is positive inwards. Nothing here is taken from the
code that it checks: the formulas are those of docs/physics.md and of the notes on each kind.
"""

# ruff: noqa: D102, D107 - what a method means is said once, in the protocol

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

SLACK_M, SLACK_M_S, SLACK_N = 1e-12, 1e-11, 1e-3
"""How far a condition may be broken before its branch is left, so that what rests at a boundary rests."""

Condition = tuple[float, float, float]
"""Value that is not negative while the branch lasts, its slack, and its growth per stroke (nan where it has none)."""

SLOW = 0.01
"""Below this rate [m/s] a rate factor is linear."""

CREEP = 1e-4
"""Over this rate [m/s] the constant preload of a buffer without rebound is reached, so that it can hold at rest."""

_DROP = 1e-6  # a force that falls at once falls within this stroke [m]
_NONE = math.nan


class Points:
    """A piecewise linear curve; it may jump up, holds its last force, and is 0 before its first stroke."""

    def __init__(self, points: Sequence[tuple[float, float]]) -> None:
        merged: list[tuple[float, float]] = [(0.0, 0.0)]
        for u, f in points:
            if u < merged[-1][0] - 1e-12:
                raise ValueError(f"strokes must grow: {points}")
            if u <= merged[-1][0] and f < merged[-1][1]:
                u = merged[-1][0] + _DROP
            if (u, f) != merged[-1]:
                merged.append((u, f))
        self.u = [u for u, _ in merged]
        self.f = [f for _, f in merged]
        self.end = self.u[-1]

    def segment(self, u: float) -> int:
        """The segment that goes on from u."""
        return max(0, bisect_right(self.u, u) - 1)

    def slope(self, i: int) -> float:
        """Of a segment [N/m]."""
        if i + 1 >= len(self.u):
            return 0.0
        return (self.f[i + 1] - self.f[i]) / (self.u[i + 1] - self.u[i])

    def line(self, i: int, u: float) -> float:
        """The line through a segment, at u."""
        return self.f[i] + self.slope(i) * (u - self.u[i])

    def at(self, u: float) -> float:
        """Force at u."""
        return self.line(self.segment(u), u) if u > 0.0 else 0.0

    def area(self, u: float) -> float:
        """Energy below the curve up to u [J]."""
        total = 0.0
        for i in range(len(self.u)):
            high = min(u, self.u[i + 1]) if i + 1 < len(self.u) else u
            if high > self.u[i]:
                total += 0.5 * (self.line(i, self.u[i]) + self.line(i, high)) * (high - self.u[i])
        return total

    def zero_until(self, u: float) -> float:
        """End of the stretch without force that goes on from u; u itself if there is none."""
        i = self.segment(u)
        while self.f[i] == 0.0 and (i + 1 >= len(self.u) or self.f[i + 1] == 0.0 or self.u[i + 1] <= self.u[i]):
            if i + 1 >= len(self.u):
                return math.inf
            i += 1
            u = self.u[i]
        return u


class Device(Protocol):
    """What the motion asks of a device."""

    has_plunger: bool  # whether a length of its own goes on by itself while it is free
    plunger: float  # this length [m]

    def force(self, u: float, v: float) -> float:
        """On the present branch [N]."""
        ...

    def slope(self, u: float) -> float:
        """Change of the force per stroke on the present branch [N/m]."""
        ...

    def rated(self) -> bool:
        """Whether the force on the present branch depends on the rate."""
        ...

    def viscous(self, u: float, v: float) -> float:
        """The part of the force that a dashpot or an orifice makes [N]."""
        ...

    def conditions(self, u: float, v: float) -> Iterator[Condition]:
        """What holds while the present branch lasts."""
        ...

    def grown(self, u: float, v: float) -> float:
        """A length that must not shrink while the present branch lasts; nan if there is none."""
        ...

    def branches(self, u: float, v: float, shrunk: bool) -> Iterator[None]:
        """Take one after the other the branches that may go on from here, the likeliest first."""
        ...

    def settle(self, u: float, v: float) -> None:
        """Write down the permanent set before a branch is left."""
        ...

    def stored(self, u: float) -> float:
        """Energy that it can give back [J]."""
        ...

    def free(self) -> float:
        """The stroke at which its force begins."""
        ...

    def release(self) -> None:
        """Take the branch without force."""
        ...

    def carries(self) -> bool:
        """Whether it is on a branch with force."""
        ...

    def plunges(self) -> float:
        """Rate of its plunger while it is free [m/s]."""
        ...


def factor_of(C: float, P: float) -> Callable[[float], float]:
    """Cowper-Symonds: what the force is multiplied by at a rate."""
    low = math.pow(SLOW / C, 1.0 / P) / SLOW

    def factor(v: float) -> float:
        if v <= 0.0:
            return 1.0
        return 1.0 + (low * v if v < SLOW else math.pow(v / C, 1.0 / P))

    return factor


@dataclass
class Crush:
    """A curve, an unloading stiffness, a dashpot; the force that crushes it may grow with the rate."""

    curve: Points
    k: float
    c: float = 0.0
    factor: Callable[[float], float] | None = None
    faster: tuple[tuple[float, Points], ...] = ()  # curves at other speeds than 0, on the same segments
    own: float = math.inf  # where its own curve ends, and with it the factor
    p: float = 0.0  # permanent set
    branch: str = "free"
    i: int = 0
    has_plunger: bool = False
    plunger: float = 0.0

    def _cap(self, u: float, v: float) -> float:
        rest = self.curve.line(self.i, u)
        if self.factor is not None:
            return rest * self.factor(v) if u <= self.own else rest
        if self.faster and v > 0.0:
            slow, low = 0.0, rest
            for speed, curve in self.faster:
                high = curve.line(self.i, u)
                if v <= speed:
                    return low + (high - low) * (v - slow) / (speed - slow)
                slow, low = speed, high
            return low
        return rest

    @property
    def _grows(self) -> bool:
        return self.factor is not None or bool(self.faster)

    def force(self, u: float, v: float) -> float:
        if self.branch in ("free", "slack"):
            return 0.0
        if self.branch == "elastic":
            return self.k * (u - self.p) + self.c * v
        return self._cap(u, v)

    def slope(self, u: float) -> float:
        if self.branch in ("free", "slack"):
            return 0.0
        return self.k if self.branch == "elastic" else self.curve.slope(self.i)

    def rated(self) -> bool:
        if self.branch == "elastic":
            return self.c > 0.0
        return self.branch in ("capped", "crushing") and self._grows

    def viscous(self, u: float, v: float) -> float:
        if self.branch in ("elastic", "capped"):
            return self.force(u, v) - self.k * (u - self.p)
        return -self.k * (u - self.p) if self.branch == "slack" else 0.0

    def conditions(self, u: float, v: float) -> Iterator[Condition]:
        if self.branch == "free":
            yield self.p - u, SLACK_M, -1.0
            return
        spring = self.k * (u - self.p)
        if self.branch == "slack":
            yield -spring - self.c * v, SLACK_N, _NONE
            yield u - self.p, SLACK_M, 1.0
            return
        s = self.curve.slope(self.i)
        if self.i + 1 < len(self.curve.u):
            yield self.curve.u[self.i + 1] - u, SLACK_M, -1.0
        if self.branch == "crushing":
            if not self._grows:
                yield v, SLACK_M_S, _NONE
            return
        yield u - self.curve.u[self.i], SLACK_M, 1.0
        cap, flat = self._cap(u, v), not self._grows and self.c == 0.0
        if self.branch == "elastic":
            yield spring + self.c * v, SLACK_N, self.k if self.c == 0.0 else _NONE
            yield cap - spring - self.c * v, SLACK_N, s - self.k if flat else _NONE
        else:
            yield spring + self.c * v - cap, SLACK_N, _NONE
            yield cap - spring, SLACK_N, s - self.k if not self._grows else _NONE

    def grown(self, u: float, v: float) -> float:
        return u - self._cap(u, v) / self.k if self.branch == "crushing" and self._grows else _NONE

    def settle(self, u: float, v: float) -> None:
        if self.branch == "crushing":
            self.p = max(self.p, u - self._cap(u, v) / self.k)

    def branches(self, u: float, v: float, shrunk: bool) -> Iterator[None]:
        self.i = self.curve.segment(u + math.copysign(SLACK_M / 4, v))
        if u < self.p or (u <= self.p + SLACK_M / 2 and v <= 0.0):  # where it may stay
            self.branch = "free"
            yield
            return
        spring, cap = self.k * (u - self.p), self._cap(u, v)
        order = ["elastic", "capped", "slack"] if self.c > 0.0 else ["elastic", "capped"]  # it takes a dashpot to relax
        if spring >= cap - 2 * SLACK_N and self.curve.slope(self.i) <= self.k:
            order.insert(len(order) if shrunk else 0, "crushing")
        before = self.p
        for branch in order:
            self.branch = branch
            # what was above the envelope, at the end of a segment, lies on it
            self.p = max(before, u - cap / self.k) if branch == "crushing" or spring > cap else before
            yield

    def stored(self, u: float) -> float:
        return 0.5 * self.k * max(0.0, u - self.p) ** 2 if self.branch != "free" else 0.0

    def free(self) -> float:
        return self.curve.zero_until(self.p)

    def release(self) -> None:
        self.branch = "free"

    def carries(self) -> bool:
        return self.branch != "free"

    def plunges(self) -> float:
        return 0.0


@dataclass
class Body:
    """The car body behind a device: rigid up to a force, then it crushes at that force."""

    collapse: float = math.inf
    p: float = 0.0


@dataclass
class Hysteresis:
    """Force between a loading and an unloading curve, along a transition stiffness from one to the other."""

    loading: Points
    unloading: Points
    k: float
    body: Body = field(default_factory=Body)
    slack: float = 0.0  # empty stroke before it
    q: float = 0.0
    branch: str = "free"
    i: int = 0
    has_plunger: bool = False
    plunger: float = 0.0

    @property
    def most(self) -> float:
        """Stroke at which the body begins to crush."""
        return _reached(self.loading, self.body.collapse)

    def _curve(self) -> Points:
        return self.loading if self.branch == "load" else self.unloading

    def force(self, u: float, v: float) -> float:
        w = u - self.body.p - self.slack
        if self.branch == "free":
            return 0.0
        if self.branch == "yield":
            return self.body.collapse
        if self.branch == "stick":
            return self.k * (w - self.q)
        return self._curve().line(self.i, w)

    def slope(self, u: float) -> float:
        if self.branch in ("free", "yield"):
            return 0.0
        return self.k if self.branch == "stick" else self._curve().slope(self.i)

    def rated(self) -> bool:
        return False

    def viscous(self, u: float, v: float) -> float:
        return 0.0

    def conditions(self, u: float, v: float) -> Iterator[Condition]:
        w = u - self.body.p - self.slack
        if self.branch == "free":
            yield -w, SLACK_M, -1.0
        elif self.branch == "yield":
            yield v, SLACK_M_S, _NONE
        elif self.branch == "stick":
            force = self.k * (w - self.q)
            a, b = self.loading, self.unloading
            yield w, SLACK_M, 1.0
            yield a.at(w) - force, SLACK_N, a.slope(a.segment(w)) - self.k
            yield force - b.at(w), SLACK_N, self.k - b.slope(b.segment(w))
            yield self.most - w, SLACK_M, -1.0
        else:
            curve = self._curve()
            inwards = 1.0 if self.branch == "load" else -1.0
            yield inwards * v, SLACK_M_S, _NONE
            if self.i + 1 < len(curve.u):
                yield curve.u[self.i + 1] - w, SLACK_M, -1.0
            yield w - curve.u[self.i], SLACK_M, 1.0
            if self.branch == "load":
                yield self.most - w, SLACK_M, -1.0

    def grown(self, u: float, v: float) -> float:
        return _NONE

    def settle(self, u: float, v: float) -> None:
        if self.branch == "yield":
            self.body.p = u - self.slack - self.most
        w = u - self.body.p - self.slack
        if self.branch in ("load", "unload"):
            self.q = w - self._curve().line(self.i, w) / self.k
        elif self.branch == "yield":
            self.q = w - self.body.collapse / self.k

    def branches(self, u: float, v: float, shrunk: bool) -> Iterator[None]:
        w = u - self.body.p - self.slack
        if w < 0.0 or (w <= SLACK_M and v <= 0.0):
            self.branch, self.q = "free", 0.0
            yield
            return
        force = self.k * (w - self.q)
        if v >= 0.0 and w >= self.most - 2 * SLACK_M:
            self.branch = "yield"
            yield
        if force >= self.loading.at(w) - 2 * SLACK_N:
            self.branch, self.i = "load", self.loading.segment(w + SLACK_M / 4)
            yield
        if force <= self.unloading.at(w) + 2 * SLACK_N:
            self.branch, self.i = "unload", self.unloading.segment(w - SLACK_M / 4)
            yield
        self.branch = "stick"
        yield

    def stored(self, u: float) -> float:
        if self.branch == "free":
            return 0.0
        w = min(u - self.body.p - self.slack, self.most)
        force = self.force(u, 0.0)
        q = w - force / self.k
        # below the unloading curve over q: its area less the triangle of the transition at its end
        low, high = 0.0, w + 1.0
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if middle - self.unloading.at(middle) / self.k < q else (low, middle)
        end = self.unloading.at(low)
        return 0.5 * force**2 / self.k + self.unloading.area(low) - 0.5 * end**2 / self.k

    def free(self) -> float:
        return self.slack + self.body.p + self.loading.zero_until(0.0)

    def release(self) -> None:
        self.branch, self.q = "free", 0.0

    def carries(self) -> bool:
        return self.branch != "free"

    def plunges(self) -> float:
        return 0.0


def _reached(curve: Points, force: float) -> float:
    """The stroke at which a curve first has a force; inf if it never has."""
    for i in range(len(curve.u) - 1):
        if curve.f[i + 1] >= force > curve.f[i]:
            return curve.u[i] + (force - curve.f[i]) / curve.slope(i)
    return math.inf


@dataclass
class Hydraulic:
    """A plunger that presses fluid through an orifice, against a preload or a gas, up to a stop."""

    length: float  # available stroke
    orifice: Points  # c(u)
    gas: Callable[[float], float]  # force G(d)
    gas_energy: Callable[[float], float]
    stop: float  # stiffness behind the stroke
    rebound: float | None  # c_r; None: nothing brings the plunger back
    body: Body = field(default_factory=Body)
    slack: float = 0.0  # empty stroke before it
    branch: str = "free"
    has_plunger: bool = True
    plunger: float = 0.0

    @property
    def most(self) -> float:
        """Stroke of the device at which the body begins to crush."""
        return self.length + (self.body.collapse - self.gas(self.length)) / self.stop

    def _w(self, u: float) -> float:
        return u - self.body.p - self.slack

    def force(self, u: float, v: float) -> float:
        w = self._w(u)
        if self.branch == "free":
            return 0.0
        if self.branch == "yield":
            return self.body.collapse
        if self.branch == "stop":
            return self.gas(self.length) + self.stop * (w - self.length)
        G, c = self.gas(w), self.orifice.at(max(w, 1e-15))
        if self.rebound is None:  # below a rate of 0, where this branch ends, it goes on as an odd function
            return G * max(-1.0, min(1.0, v / CREEP)) + c * v * abs(v)
        return G + (c if v >= 0.0 else self.rebound) * v * abs(v)

    def slope(self, u: float) -> float:
        if self.branch in ("free", "yield"):
            return 0.0
        if self.branch == "stop":
            return self.stop
        w, d = self._w(u), 1e-7
        return (self.gas(w + d) - self.gas(w - d)) / (2 * d)

    def rated(self) -> bool:
        return self.branch == "pressed"

    def viscous(self, u: float, v: float) -> float:
        if self.branch != "pressed":
            return 0.0
        return self.force(u, v) - (self.gas(self._w(u)) if self.rebound is not None else 0.0)

    def conditions(self, u: float, v: float) -> Iterator[Condition]:
        w = self._w(u)
        if self.branch == "free":
            yield self.plunger - w, SLACK_M, _NONE
        elif self.branch == "yield":
            yield v, SLACK_M_S, _NONE
        elif self.branch == "stop":
            yield w - self.length, SLACK_M, 1.0
            yield self.most - w, SLACK_M, -1.0
        else:
            yield w, SLACK_M, 1.0
            if self.rebound is None:  # one that only holds its preload may creep past the end
                yield max(self.length - w, CREEP - v), SLACK_M, _NONE
                yield v, SLACK_M_S, _NONE
                return
            yield self.length - w, SLACK_M, -1.0
            if v < 0.0:
                yield self.gas(w) - self.rebound * v * v, SLACK_N, _NONE

    def grown(self, u: float, v: float) -> float:
        return _NONE

    def settle(self, u: float, v: float) -> None:
        if self.branch == "yield":
            self.body.p = u - self.slack - self.most
        if self.branch != "free":
            creeps = self.branch == "pressed" and self.rebound is None
            self.plunger = max(0.0, self._w(u)) if creeps else min(max(0.0, self._w(u)), self.length)

    def branches(self, u: float, v: float, shrunk: bool) -> Iterator[None]:
        w = self._w(u)
        if self.plunger < 1e-11 and w < 1e-11:
            self.plunger = 0.0
        if w < self.plunger - SLACK_M / 2 or (w <= SLACK_M and v <= 0.0):
            self.branch = "free"
            yield
            return
        if w >= self.most - 2 * SLACK_M and v >= 0.0:
            self.branch = "yield"
            yield
        if w > self.length or (w >= self.length - 2 * SLACK_M and v > 0.0):
            self.branch = "stop"
            yield
            if self.rebound is not None or w > self.length + 1e-4:
                return
        self.branch = "pressed"
        yield
        self.branch = "free"
        yield

    def stored(self, u: float) -> float:
        gas = self.gas_energy(self.plunger if self.branch == "free" else min(self._w(u), self.length))
        if self.rebound is None:
            gas = 0.0
        if self.branch not in ("stop", "yield"):
            return gas
        more = min(self._w(u), self.most) - self.length
        return gas + self.gas(self.length) * more + 0.5 * self.stop * more**2

    def free(self) -> float:
        return self.slack + self.body.p + self.plunger

    def release(self) -> None:
        self.branch = "free"

    def carries(self) -> bool:
        return self.branch != "free"

    def plunges(self) -> float:
        if self.branch != "free" or self.rebound is None or self.plunger <= 0.0:
            return 0.0
        G = self.gas(self.plunger)
        return -math.sqrt(G / self.rebound) if self.rebound else -1e3
