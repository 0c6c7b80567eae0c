"""Fronts of minimised objectives: which points are not dominated, how crowded they lie, how much they dominate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, varies


def nondominated(y: FloatArray) -> NDArray[np.bool_]:
    """For each point (n, m) whether no other is as good in all objectives and better in one, (n,)."""
    if y.shape[1] == 2:
        return _nondominated_pairs(y)
    dominates = (y[:, None, :] <= y[None, :, :]).all(axis=2) & (y[:, None, :] < y[None, :, :]).any(axis=2)
    return np.asarray(~dominates.any(axis=0))


def _nondominated_pairs(y: FloatArray) -> NDArray[np.bool_]:
    """The same for two objectives by one sort: the swarm asks for it at every step."""
    order = np.lexsort((y[:, 1], y[:, 0]))
    first, second = y[order].T
    best_before = np.concatenate([[np.inf], np.minimum.accumulate(second)[:-1]])
    new = np.concatenate([[True], (first[1:] != first[:-1]) | (second[1:] != second[:-1])])
    free = best_before > second
    free[0] = True  # the comparison misses it if it is infinite
    result = np.empty(len(y), dtype=np.bool_)
    result[order] = free[np.flatnonzero(new)][np.cumsum(new) - 1]  # equal points share the answer of the first of them
    return result


def crowding(y: FloatArray) -> FloatArray:
    """Crowding distance of each point of a front (n, m), (n,); infinite at the ends of each objective.

    Sum over the objectives of the gap between a point's neighbours, as part of the objective's range (Deb et al. 2002,
    doi 10.1109/4235.996017).
    """
    n, m = y.shape
    distance = np.zeros(n)
    for k in range(m):
        order = np.argsort(y[:, k], kind="stable")
        sorted_y = y[order, k]
        spread = sorted_y[-1] - sorted_y[0]
        distance[order[[0, -1]]] = np.inf
        if spread > 0:
            distance[order[1:-1]] += (sorted_y[2:] - sorted_y[:-2]) / spread
    return distance


def thin(y: FloatArray, size: int) -> NDArray[np.intp]:
    """Positions of at most ``size`` points of a front (n, m), the most crowded left out, in their order."""
    kept = np.arange(len(y))
    while kept.size > size:
        # half of the surplus at a time: all at once would empty crowded places, one by one is slow
        drop = (kept.size - size + 1) // 2
        order = np.argsort(-crowding(y[kept]), kind="stable")
        kept = np.sort(kept[order[: kept.size - drop]])
    return kept


def hypervolume(y: ArrayLike, reference: ArrayLike) -> float:
    """Volume that the points dominate, up to the reference point.

    A sweep for two objectives, slices of it for more: exact, fast for two or three objectives, slow beyond five.

    Args:
        y: objectives, minimised, (n, m); points that are not better than the reference in every objective do not count.
        reference: worst values that still count, (m,).

    Returns:
        The volume, in the product of the objectives' units.

    Raises:
        InputError: unequal numbers of objectives.
    """
    y = as_matrix("objectives", y)
    corner = as_vector("reference", reference, y.shape[1], each="objective")
    inside = y[(y < corner).all(axis=1)]
    return _volume(inside, corner) if len(inside) else 0.0


def _volume(y: FloatArray, corner: FloatArray) -> float:
    """Dominated volume of points (n, m), all better than the corner (m,)."""
    if y.shape[1] == 1:
        return float(corner[0] - y.min())
    if y.shape[1] == 2:
        y = y[np.lexsort((y[:, 1], y[:, 0]))]
        floor = np.minimum.accumulate(y[:, 1])
        width = np.diff(y[:, 0], append=corner[0])
        return float((width * (corner[1] - floor)).sum())
    y = y[np.argsort(y[:, -1], kind="stable")]
    depth = np.diff(y[:, -1], append=corner[-1])
    volume = 0.0
    front = np.empty((0, y.shape[1] - 1))
    for point, thickness in zip(y, depth, strict=True):  # slices, each with the front of all points below it
        front = np.concatenate([front, point[None, :-1]])
        front = front[nondominated(front)]
        if thickness > 0:
            volume += float(thickness) * _volume(front, corner[:-1])
    return volume


def default_reference(y: FloatArray) -> FloatArray:
    """The reference point a tenth of the front's range beyond its worst values: (n, m) -> (m,)."""
    worst, spread = y.max(axis=0), np.ptp(y, axis=0)
    return np.asarray(worst + 0.1 * np.where(varies(y), spread, np.maximum(np.abs(worst), 1.0)), dtype=np.float64)
