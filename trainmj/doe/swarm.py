"""The parts of a particle swarm: particles, their memory, the archive of the best, one step.

Velocities and turbulence follow OMOPSO (Sierra and Coello 2005,
doi 10.1007/978-3-540-31880-4_35), the archive with crowding Raquel and Naval (2005, doi 10.1145/1068009.1068047),
constraints the feasibility rules of Deb (2000, doi 10.1016/S0045-7825(99)00389-8): feasible before infeasible, less
violation before more, dominance among the feasible.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainmj.doe.arrays import FloatArray
from trainmj.doe.pareto import crowding, nondominated, thin


@dataclass(frozen=True)
class Scores:
    """Evaluated points; y, g and violation are infinite where the evaluation failed."""

    u: FloatArray  # (n, d) positions in the unit cube, after rounding
    x: FloatArray  # (n, d) natural values
    y: FloatArray  # (n, m) objectives, minimised
    g: FloatArray  # (n, c) constraints, kept where <= 0
    violation: FloatArray  # (n, 1) sum of the scaled violations, 0 if feasible

    def __len__(self) -> int:
        """Number of points."""
        return len(self.y)

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Which points keep all constraints, (n,)."""
        return np.asarray(self.violation[:, 0] == 0.0)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which points could not be evaluated, (n,)."""
        return np.isinf(self.violation[:, 0])

    def take(self, index: NDArray[Any]) -> Scores:
        """Some of the points, by positions or mask."""
        return Scores(*(a[index] for a in vars(self).values()))

    def join(self, other: Scores) -> Scores:
        """These points, then the others."""
        return Scores(*map(np.concatenate, zip(vars(self).values(), vars(other).values(), strict=True)))

    def where(self, mask: NDArray[np.bool_], other: Scores) -> Scores:
        """These points where the mask (n,) holds, the others elsewhere."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Scores(*(np.where(mask[:, None], mine, theirs) for mine, theirs in pairs))


def random_hypercube(n: int, d: int, rng: np.random.Generator) -> FloatArray:
    """The first positions: a random Latin hypercube, (n, d)."""
    return (np.stack([rng.permutation(n) for _ in range(d)], axis=1) + rng.random((n, d))) / n


def best_of(scores: Scores, size: int) -> Scores:
    """The archive: the feasible front, thinned to ``size``; if no point is feasible, the least violating ones."""
    if not scores.feasible.any():
        return scores.take(np.argsort(scores.violation[:, 0], kind="stable")[: max(1, size // 10)])
    scores = scores.take(scores.feasible)
    _, first = np.unique(scores.y, axis=0, return_index=True)
    scores = scores.take(np.sort(first))
    scores = scores.take(nondominated(scores.y))
    return scores.take(thin(scores.y, size))


def improves(new: Scores, old: Scores) -> NDArray[np.bool_]:
    """Whether the new point of each particle should replace the one it remembers, (n,)."""
    dominated = (old.y <= new.y).all(axis=1) & (old.y < new.y).any(axis=1)
    less = (new.violation < old.violation)[:, 0]
    return np.asarray(np.where(new.feasible & old.feasible, ~dominated, less))


def step(
    u: FloatArray, velocity: FloatArray, memory: Scores, archive: Scores, progress: float, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Move every particle once: positions in the unit cube and velocities, (n, d) each, to new ones.

    Args:
        u: positions.
        velocity: their velocities.
        memory: the best point of each particle, n of them.
        archive: the best points of all.
        progress: share of the iterations done, 0 to 1; turbulence fades with it.
        rng: the random numbers.
    """
    n = len(u)
    leader = archive.u[_tournament(archive, n, rng)]
    inertia = rng.uniform(0.1, 0.5, (n, 1))
    own, social = rng.uniform(1.5, 2.0, (2, n, 1))
    velocity = (
        inertia * velocity + own * rng.random((n, 1)) * (memory.u - u) + social * rng.random((n, 1)) * (leader - u)
    )
    moved = u + velocity
    outside = (moved < 0.0) | (moved > 1.0)
    return _turbulence(np.clip(moved, 0.0, 1.0), progress, rng), np.where(outside, -velocity, velocity)


def _tournament(archive: Scores, n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Choose n leaders: of two at random, the less crowded one."""
    distance = crowding(archive.y) if np.isfinite(archive.y).all() else np.zeros(len(archive))
    pairs = rng.integers(len(archive), size=(2, n))
    return np.asarray(np.where(distance[pairs[0]] >= distance[pairs[1]], pairs[0], pairs[1]), dtype=np.intp)


def _turbulence(u: FloatArray, progress: float, rng: np.random.Generator) -> FloatArray:
    """Disturb two thirds of the particles: one third anywhere, one third less and less as the search goes on."""
    n, d = u.shape
    kind = np.arange(n) % 3
    hit = rng.random((n, d)) < 1.0 / d
    anywhere = u + rng.uniform(-0.5, 0.5, (n, d))
    reach = 1.0 - rng.random((n, d)) ** ((1.0 - progress) ** 5)  # non-uniform mutation: to 0 as progress goes to 1
    nearby = np.where(rng.random((n, d)) < 0.5, u + (1.0 - u) * reach, u - u * reach)
    disturbed = np.where(kind[:, None] == 0, anywhere, nearby)
    return np.clip(np.where(hit & (kind[:, None] < 2), disturbed, u), 0.0, 1.0)
