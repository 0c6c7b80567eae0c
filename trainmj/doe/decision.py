"""Pick one design from a front: weighted sum, TOPSIS, knee point; and how far the pick depends on the weights.

    choice = topsis(front.values, weights.weight)
    front.points[choice.best]
    weight_sensitivity(front.values, weights.weight, seed=1, method=topsis).share

Every method takes the criteria of the alternatives in ``values`` (n, m), their ``weights`` (m,), scaled to add up to 1,
and in ``maximise`` (m,) whether more is better; less is, if None. It scales the criteria first (see `normalise`), and
the scaling changes the pick, so `Ranking.description` states it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, check_choice, frozen, varies
from trainmj.doe.weights import to_one
from trainmj.errors import InputError

Normalisation = Literal["min_max", "max", "sum", "vector", "none"]


@dataclass(frozen=True)
class Ranking:
    """Alternatives in order.

    Attributes:
        score: of each alternative, larger is better, (n,).
        order: positions of the alternatives, best first, (n,).
        description: method and normalisation.
    """

    score: FloatArray = field(repr=False)
    order: NDArray[np.intp] = field(repr=False)
    description: str

    @property
    def best(self) -> int:
        """Position of the best alternative."""
        return int(self.order[0])


def normalise(values: ArrayLike, how: Normalisation = "min_max") -> FloatArray:
    """Make criteria of different units comparable, (n, m) -> (n, m).

    Args:
        values: the criteria.
        how: ``min_max`` to [0, 1]; ``max``, ``sum``, ``vector`` divide by the largest magnitude, the sum of
            magnitudes, the root of the sum of squares; ``none`` leaves them.

    Returns:
        The scaled criteria; one that does not vary becomes 0 under min_max, one of zeros stays so.

    Raises:
        InputError: unknown ``how``.
    """
    x = as_matrix("values", values)
    x = np.where(varies(x), x, x[0])  # round-off is no reason to prefer anything
    check_choice("normalisation", how, get_args(Normalisation))
    size = np.abs(x)
    bases = {
        "min_max": np.ptp(x, axis=0),
        "max": size.max(axis=0),
        "sum": size.sum(axis=0),
        "vector": np.sqrt((x**2).sum(axis=0)),
        "none": np.ones(x.shape[1]),
    }
    if how == "min_max":
        x = x - x.min(axis=0)
    return np.asarray(x / np.where(bases[how] > 0, bases[how], 1.0), dtype=np.float64)


def weighted_sum(
    values: ArrayLike,
    weights: ArrayLike,
    *,
    normalisation: Normalisation = "min_max",
    maximise: Sequence[bool] | None = None,
) -> Ranking:
    """Rank by the weighted sum of the normalised criteria; the score is its negative.

    On a front that is nearly straight or bulges outwards it picks one of the ends: small changes of the weights then
    move the pick from one end to the other.

    Raises:
        InputError: wrong number of weights or directions, negative weights, unknown normalisation.
    """
    x = as_matrix("values", values)
    scaled = normalise(x, normalisation) * _signs(maximise, x.shape[1]) * _weights(weights, x.shape[1])
    score = -scaled.sum(axis=1)  # not a product of matrices, which may round equal rows differently
    return _rank(score, "weighted sum", normalisation)


def topsis(
    values: ArrayLike,
    weights: ArrayLike,
    *,
    normalisation: Normalisation = "vector",
    maximise: Sequence[bool] | None = None,
) -> Ranking:
    """Rank by closeness to the best and distance from the worst value of each criterion.

    The score is between 0 (worst in everything) and 1 (best in everything). Hwang and Yoon (1981,
    doi 10.1007/978-3-642-48318-9), who normalise by vector.

    Raises:
        InputError: as for `weighted_sum`.
    """
    x = as_matrix("values", values)
    scaled = normalise(x, normalisation) * _signs(maximise, x.shape[1]) * _weights(weights, x.shape[1])
    to_best = np.linalg.norm(scaled - scaled.min(axis=0), axis=1)
    to_worst = np.linalg.norm(scaled - scaled.max(axis=0), axis=1)
    both = to_best + to_worst
    score = np.where(both > 0, to_worst / np.where(both > 0, both, 1.0), 0.5)  # all alike: none is better
    return _rank(score, "TOPSIS", normalisation)


def knee_point(values: ArrayLike, *, maximise: Sequence[bool] | None = None) -> Ranking:
    """Rank by how far an alternative lies on the good side of the plane through the best of each criterion alone.

    The knee is where giving up a little in one criterion stops buying much in another (Das 1999, doi
    10.1007/s001580050111). Criteria are scaled to [0, 1], those that do not vary left out; no weights. The score is the
    distance from the plane, below 0 on the bad side.

    Raises:
        InputError: wrong number of directions.
    """
    x = as_matrix("values", values)
    varying = varies(x)  # what is the same all over has no best
    scaled = normalise(x * _signs(maximise, x.shape[1]), "min_max")[:, varying]
    ends = scaled[scaled.argmin(axis=0)]  # (k, k), the best alternative of each criterion that varies
    normal, offset = np.linalg.lstsq(ends, np.ones(len(ends)), rcond=None)[0], 1.0
    if not ends.any():  # one alternative is the best in all of them: any plane through it
        normal, offset = np.ones(len(ends)), 0.0
    score = (offset - (scaled * normal).sum(axis=1)) / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)
    return _rank(score, "knee point", "min_max")


@dataclass(frozen=True)
class WeightSensitivity:
    """How the pick depends on the weights.

    Attributes:
        best: the pick at the given weights.
        share: of random weights near the given ones at which each alternative is the pick, (n,).
        lower: for each criterion the smallest weight at which the pick stays, the others scaled to fill up to 1, (m,).
        upper: the largest, (m,).
    """

    best: int
    share: FloatArray = field(repr=False)
    lower: FloatArray
    upper: FloatArray


def weight_sensitivity(
    values: ArrayLike,
    weights: ArrayLike,
    *,
    seed: int,
    method: Callable[..., Ranking] = topsis,
    spread: float = 0.1,
    samples: int = 1000,
    maximise: Sequence[bool] | None = None,
) -> WeightSensitivity:
    """Change the weights and see whether the pick stays.

    Args:
        values: criteria of each alternative, (n, m).
        weights: of the criteria, (m,).
        seed: of the random weights.
        method: `weighted_sum` or `topsis`, or a partial of them with another normalisation.
        spread: deviation of the random weights, as part of each weight.
        samples: number of random weights.
        maximise: for each criterion whether more is better.

    Raises:
        InputError: as for ``method``, or spread <= 0.
    """
    x = as_matrix("values", values)
    m = x.shape[1]
    w = _weights(weights, m)
    if spread <= 0 or samples < 1:
        raise InputError(f"spread must be above 0 and samples at least 1 (got {spread}, {samples})")

    def pick(candidate: FloatArray) -> int:
        return method(x, candidate, maximise=maximise).best

    best = pick(w)
    drawn = w * np.exp(spread * np.random.default_rng(seed).standard_normal((samples, m)))
    share = np.bincount([pick(row) for row in drawn], minlength=len(x)) / samples
    lower, upper = np.array([_stays(pick, w, j, best) for j in range(m)]).T
    return WeightSensitivity(best, frozen(share), frozen(lower), frozen(upper))


def _stays(pick: Callable[[FloatArray], int], w: FloatArray, j: int, best: int) -> tuple[float, float]:
    """The interval around weight j in which the pick stays, to 1e-6, by bisection from the ends."""

    def at(value: float) -> bool:
        rest = np.delete(w, j).sum()
        others = w * ((1.0 - value) / rest) if rest > 0 else np.full(w.size, (1.0 - value) / max(w.size - 1, 1))
        return pick(np.where(np.arange(w.size) == j, value, others)) == best

    limits = []
    for end in (0.0, 1.0):
        inside, outside = float(w[j]), end
        if w.size == 1 or at(end):
            inside = end
        while abs(outside - inside) > 1e-6:
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if at(middle) else (inside, middle)
        limits.append(inside)
    return limits[0], limits[1]


def _weights(weights: ArrayLike, m: int) -> FloatArray:
    w = as_vector("weights", weights, m, each="criterion")
    return to_one(w, w.tolist())


def _signs(maximise: Sequence[bool] | None, m: int) -> FloatArray:
    """1 for a criterion to be minimised, -1 for one to be maximised, (m,)."""
    wanted = np.zeros(m) if maximise is None else as_vector("maximise", maximise, m, each="criterion, True or False")
    return np.where(wanted != 0, -1.0, 1.0)


def _rank(score: FloatArray, method: str, normalisation: Normalisation) -> Ranking:
    description = f"{method}, {normalisation.replace('_', '-')} normalisation"
    return Ranking(frozen(score), np.argsort(-score, kind="stable"), description)
