"""Car bodies that give: members between the points of a vehicle, each elastic or yielding, all of them side by side.

A bar of stiffness k and mass m is cut into N equal parts of stiffness N k; half of the mass of a part goes to each of
its ends. A dashpot stands beside each spring. Both together yield at the collapse force F_c, inwards and outwards, and
that rises with the slope N h over the plastic travel, whichever way that goes: k (u - p) + c (u' - p') is then the
force at which the member yields, from which p' follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from trainmj.verification.oracle.devices import SLACK_M_S, SLACK_N

Array = np.ndarray


@dataclass(frozen=True)
class Member:
    """A member, or the link of a bogie."""

    name: str
    left: int  # point
    right: int
    k: float  # [N/m]
    c: float = 0.0  # [N s/m]
    collapse: float = math.inf  # [N]
    h: float = 0.0  # slope of the force over plastic travel [N/m]


@dataclass(frozen=True)
class Given:
    """What a member did."""

    stroke: float  # largest shortening [m]
    force: float  # largest magnitude [N]
    plastic: float  # shortening that remains [m]
    lost: float  # by yielding and in the dashpot [J]
    elastic: float  # [J]


class Members:
    """Those of all vehicles; values are arrays with one for each."""

    def __init__(self, members: tuple[Member, ...]) -> None:
        """Put them at their start."""
        self.n = len(members)
        self.left = np.array([m.left for m in members], dtype=int)
        self.right = np.array([m.right for m in members], dtype=int)
        self.k, self.c, self.limit, self.h = (
            np.array([getattr(m, name) for m in members]) for name in ("k", "c", "collapse", "h")
        )
        self.p = np.zeros(self.n)  # plastic shortening, as the present branch began
        self.yielded = np.zeros(self.n)  # energy of yielding up to there [J]
        self.way = np.zeros(self.n)  # 1 where it yields inwards, -1 outwards, 0 where it is elastic
        self.stroke, self.most = np.zeros(self.n), np.zeros(self.n)

    def between(self, of_points: Array) -> Array:
        """Differences of values of the points."""
        return np.asarray(of_points[self.left] - of_points[self.right])

    def _elastic(self, u: Array, v: Array, p: Array) -> Array:
        """Forces, if none yields [N]."""
        return np.asarray(self.k * (u - p) + self.c * v)

    def _yields_at(self, p: Array) -> Array:
        """Magnitudes of the forces of those that yield [N]."""
        return np.asarray(np.where(self.way == 0.0, 0.0, self.limit) + self.h * self.way * (p - self.p))

    def force(self, u: Array, v: Array, p: Array) -> Array:
        """Forces of springs and dashpots [N], with plastic shortenings p [m]."""
        return np.asarray(np.where(self.way == 0.0, self._elastic(u, v, p), self.way * self._yields_at(p)))

    def rate(self, u: Array, v: Array, p: Array) -> Array:
        """Rates of the plastic shortenings [m/s]."""
        damped = self.c > 0.0
        over = self._elastic(u, v, p) - self.way * self._yields_at(p)
        found = np.where(damped, over / np.where(damped, self.c, 1.0), v * self.k / (self.k + self.h))
        return np.asarray(np.where(self.way == 0.0, 0.0, found))

    def viscous(self, u: Array, v: Array, p: Array) -> Array:
        """Power of the dashpots [W]."""
        return np.asarray(self.c * (v - self.rate(u, v, p)) ** 2)

    def conditions(self, u: Array, v: Array, p: Array) -> Array:
        """What is not negative while each branch lasts, with its slack."""
        elastic = self.limit - np.abs(self._elastic(u, v, p)) + SLACK_N
        return np.asarray(np.where(self.way == 0.0, elastic, self.way * self.rate(u, v, p) + SLACK_M_S))

    def switch(self, u: Array, v: Array, p: Array) -> int:
        """Leave the branches whose conditions fail; how many those are."""
        failed = self.conditions(u, v, p) < np.where(self.way == 0.0, SLACK_N, SLACK_M_S) / 2
        force = self._elastic(u, v, p)
        undamped = (self.way == 0.0) & (self.c == 0.0)
        failed &= ~undamped | (force * v > 0.0)
        ends = failed & (self.way != 0.0)
        travel = np.where(ends, self.way * (p - self.p), 0.0)
        self.yielded += (np.where(ends, self.limit, 0.0) + 0.5 * self.h * travel) * travel
        self.p = np.where(failed, p, self.p)
        self.limit = self.limit + self.h * travel
        self.way = np.where(failed, np.where(ends, 0.0, np.sign(force)), self.way)
        return int(failed.sum())

    def look(self, u: Array, v: Array, p: Array) -> None:
        """Note the peaks."""
        self.stroke = np.maximum(self.stroke, u)
        self.most = np.maximum(self.most, np.abs(self.force(u, v, p)))

    def found(self, u: Array, p: Array, viscous: Array) -> list[Given]:
        """What each did, at its shortening now, and with the energy of its dashpot [J]."""
        travel = self.way * (p - self.p)
        limit = np.where(self.way == 0.0, 0.0, self.limit)
        lost = self.yielded + (limit + 0.5 * self.h * travel) * travel + viscous
        elastic = 0.5 * self.k * (u - p) ** 2
        rows = zip(self.stroke, self.most, p, lost, elastic, strict=True)
        return [Given(*map(float, row)) for row in rows]
