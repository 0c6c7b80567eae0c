"""Spread the points of a Latin hypercube: simulated annealing on phi_p, several chains in one array.

A move exchanges two values within one column, so the result has the same values in each column as the start: a Latin
hypercube stays one (Morris and Mitchell 1995, doi 10.1016/0378-3758(94)00035-T). All chains take their step in the same
numpy calls, which costs hardly more than one chain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from trainmj.doe.arrays import FloatArray

P = 50.0  # exponent of phi_p: lower ones sometimes prefer many fair distances to one larger smallest distance
HOT, COLD = 5.0, 0.03  # temperatures at both ends, times the number of pairs
TINY = 1e-6  # squared distance below which points count as equally bad, so that coinciding ones keep a finite phi_p


def smallest_distance(unit: FloatArray) -> float:
    """Smallest distance between any two of the points (n, d); infinite for a single one."""
    return float(pdist(unit).min()) if len(unit) > 1 else np.inf


def phi_p(unit: FloatArray) -> float:
    """(sum over pairs of distance^-P)^(1/P) of the points (n, d); infinite if two coincide."""
    distances = pdist(unit)
    if distances.size == 0:
        return 0.0
    closest = distances.min()
    if closest == 0.0:
        return np.inf
    return float(((closest / distances) ** P).sum() ** (1 / P) / closest)  # scaled: distance^-P alone can overflow


def spread_columns(columns: FloatArray, rng: np.random.Generator, *, chains: int, iterations: int) -> FloatArray:
    """Order the values in each column so that the points lie as far apart as annealing can bring them.

    Args:
        columns: the values of each column, scaled to [0, 1], (d, n).
        rng: the random numbers.
        chains: independent annealings.
        iterations: exchanges that each chain tries.

    Returns:
        Of the best of each chain, the ordering with the largest smallest distance, then the smallest phi_p, (n, d).
    """
    state = _start(columns, rng, chains)
    if columns.shape[0] > 1:  # with one column every order is the same set of points
        pairs = columns.shape[1] * (columns.shape[1] - 1) / 2
        # one exchange changes log(phi_p) by about 1 / pairs: above HOT chains only shuffle, below COLD only descend
        for temperature in np.geomspace(HOT / pairs, COLD / pairs, iterations):
            _step(state, float(temperature), rng)
    results = [best.T for best in state.best]
    return max(results, key=lambda unit: (round(smallest_distance(unit), 12), -phi_p(unit)))


@dataclass
class _Chains:
    """What the chains carry from step to step; c chains, d columns, n points."""

    x: FloatArray  # (c, d, n) values
    squared: FloatArray  # (c, n, n) squared distances, inf on the diagonal
    weight: FloatArray  # (c, n, n) distance^-P
    total: FloatArray  # (c,) sum of weight
    best: FloatArray  # (c, d, n) values at the smallest total so far
    least: FloatArray  # (c,) that total


def _start(columns: FloatArray, rng: np.random.Generator, chains: int) -> _Chains:
    x = np.array([_ordered(columns, rng) for _ in range(chains)])
    squared = ((x[:, :, :, None] - x[:, :, None, :]) ** 2).sum(axis=1)
    diagonal = np.arange(columns.shape[1])
    squared[:, diagonal, diagonal] = np.inf
    weight = np.maximum(squared, TINY) ** (-P / 2)
    total = weight.sum(axis=(1, 2))
    return _Chains(x, squared, weight, total, x.copy(), total.copy())


def _ordered(columns: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The columns (d, n), each in a random order in which no point occurs twice, if there are as many points.

    Exchanges alone hardly find one where most points of the space are taken, and at the temperatures here they never
    give it up.
    """
    d, n = columns.shape
    held = [np.unique(column, return_counts=True) for column in columns]
    sizes = np.array([len(values) for values, _ in held])
    if (sizes == n).any() or np.prod(sizes, dtype=np.float64) < n:  # any order will do, or none
        return np.array([rng.permutation(column) for column in columns])
    turn = rng.permutation(d)
    codes = _distinct(sizes[turn].tolist(), n)[rng.permutation(n)].T
    ordered = np.empty_like(columns)
    for i, code in zip(turn, codes, strict=True):
        values, wanted = held[i]
        shuffle, other = rng.permutation(sizes[i]), rng.permutation(sizes[i])
        # codes that occur more often stand for values that do; which of them for which is random
        often = shuffle[np.argsort(np.bincount(code, minlength=sizes[i])[shuffle], kind="stable")]
        name = np.empty(sizes[i])
        name[often] = values[other[np.argsort(wanted[other], kind="stable")]]
        ordered[i] = name[code]
    return ordered


def _distinct(sizes: list[int], n: int) -> NDArray[np.int64]:
    """Make n different points (n, d) of a full grid, the levels of each axis in shares that differ by at most one.

    The grid of the other axes is taken as often as it goes into n, and the rest chosen from it in the same way. In the
    order of these points the last axis counts round and round: points that share the rest follow each other, no more of
    them than it has levels.
    """
    if not sizes:
        return np.zeros((n, 0), dtype=np.int64)
    *others, last = sizes
    grid = math.prod(others)
    points = _distinct(others, n % grid)
    if n >= grid:
        whole = np.stack(np.unravel_index(np.arange(grid), others), axis=1) if others else np.zeros((1, 0), np.int64)
        points = np.concatenate([points, np.repeat(whole, n // grid, axis=0)])
    if others:
        points = points[np.lexsort(points.T)]
    return np.column_stack([points, np.arange(n) % last])


def _step(state: _Chains, temperature: float, rng: np.random.Generator) -> None:
    """Try one exchange in every chain."""
    c, d, n = state.x.shape
    chain = np.arange(c)
    column = rng.integers(d, size=(c,))
    # every other exchange starts from a crowded point: only there can the smallest distance grow
    crowded = np.argmax(state.weight.sum(axis=2) * rng.random((c, n)), axis=1)
    i = np.where(rng.random(c) < 0.5, crowded, rng.integers(n, size=(c,)))
    j = (i + 1 + rng.integers(n - 1, size=(c,))) % n

    values: FloatArray = state.x[chain, column]  # (c, n)
    change = (values[chain, j, None] - values) ** 2 - (values[chain, i, None] - values) ** 2
    change[chain, i] = change[chain, j] = 0.0  # the distance between the two exchanged points stays
    near_i, near_j = state.squared[chain, i] + change, state.squared[chain, j] - change
    weight_i, weight_j = np.maximum(near_i, TINY) ** (-P / 2), np.maximum(near_j, TINY) ** (-P / 2)
    gain = (weight_i - state.weight[chain, i] + weight_j - state.weight[chain, j]).sum(axis=1)
    # the subtraction can cancel to nothing or less when two points were all but equal: that is an improvement anyway
    ratio = np.maximum(1.0 + 2.0 * gain / state.total, 1e-300)
    accepted = np.flatnonzero(np.log(ratio) / P < temperature * rng.exponential(size=c))

    i, j, column = i[accepted], j[accepted], column[accepted]
    for matrix, row_i, row_j in ((state.squared, near_i, near_j), (state.weight, weight_i, weight_j)):
        matrix[accepted, i] = matrix[accepted, :, i] = row_i[accepted]
        matrix[accepted, j] = matrix[accepted, :, j] = row_j[accepted]
    state.x[accepted, column, j] = values[accepted, i]
    state.x[accepted, column, i] = values[accepted, j]
    state.total[accepted] = state.weight[accepted].sum(axis=(1, 2))  # afresh: running sums would lose the small ones
    better = state.total < state.least
    state.least[better] = state.total[better]
    state.best[better] = state.x[better]
