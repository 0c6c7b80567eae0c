"""Car bodies that give: members between the points of a vehicle, each elastic or yielding, all of them side by side.

A bar of stiffness k and mass m is cut into N equal parts of stiffness N k; half of the mass of a part goes to each of
its ends. A dashpot stands beside each spring. A member yields at its collapse force F_c, inwards and outwards, and its
force then rises with the slope N h over the plastic travel, whichever way that goes.
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

    def _travel(self, u: Array) -> Array:
        """Plastic travel on the present branch: where the spring has the force of what yields."""
        over = self.way * self.k * (u - self.p) - np.where(self.way == 0.0, 0.0, self.limit)
        return np.where(self.way == 0.0, 0.0, over / (self.k + self.h))

    def springs(self, u: Array) -> Array:
        """Forces of the springs [N]."""
        return np.asarray(self.k * (u - self.p - self.way * self._travel(u)))

    def force(self, u: Array, v: Array) -> Array:
        """Forces of springs and dashpots [N]."""
        return np.asarray(self.springs(u) + self.c * v)

    def conditions(self, u: Array, v: Array) -> Array:
        """What is not negative while each branch lasts, with its slack."""
        elastic = self.limit - np.abs(self.k * (u - self.p)) + SLACK_N
        return np.where(self.way == 0.0, elastic, self.way * v + SLACK_M_S)

    def switch(self, u: Array, v: Array) -> int:
        """Leave the branches whose conditions fail; how many those are."""
        failed = self.conditions(u, v) < np.where(self.way == 0.0, SLACK_N, SLACK_M_S) / 2
        force = self.k * (u - self.p)
        failed &= (self.way != 0.0) | (force * v > 0.0)
        ends = failed & (self.way != 0.0)
        travel = np.where(ends, self._travel(u), 0.0)
        self.yielded += (np.where(ends, self.limit, 0.0) + 0.5 * self.h * travel) * travel
        self.p += self.way * travel
        self.limit = self.limit + self.h * travel
        self.way = np.where(failed, np.where(ends, 0.0, np.sign(force)), self.way)
        return int(failed.sum())

    def look(self, u: Array, v: Array) -> None:
        """Note the peaks."""
        self.stroke = np.maximum(self.stroke, u)
        self.most = np.maximum(self.most, np.abs(self.force(u, v)))

    def found(self, u: Array, viscous: Array) -> list[Given]:
        """What each did, at its shortening now, and with the energy of its dashpot [J]."""
        travel, springs = self._travel(u), self.springs(u)
        yielding = self.way != 0.0
        limit = np.where(yielding, self.limit, 0.0)
        lost = self.yielded + (limit + 0.5 * self.h * travel) * travel + viscous
        plastic, elastic = self.p + self.way * travel, 0.5 * springs**2 / self.k
        rows = zip(self.stroke, self.most, plastic, lost, elastic, strict=True)
        return [Given(*map(float, row)) for row in rows]
