"""Choose the terms of a polynomial: the subset that predicts points left out best.

    terms = select_terms(X, y, space=space, candidates=full_order(2, 3))

The choice itself uses the data, so the PRESS of the chosen terms is optimistic. For an honest error, put the choice
inside the fit that `trainmj.doe.accuracy.cross_validate` repeats.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, check_choice
from trainmj.doe.space import Space
from trainmj.doe.terms import Term, check_terms, columns, is_hierarchical
from trainmj.errors import InputError

Criterion = Literal["press", "bic"]
Weigh = Callable[[tuple[int, ...]], float]
MOST = 14  # candidates searched exhaustively: 2^14 small least-squares problems take about a second


def select_terms(
    x: ArrayLike,
    y: ArrayLike,
    *,
    space: Space,
    candidates: Sequence[Term],
    criterion: Criterion = "press",
) -> tuple[Term, ...]:
    """Search the subsets of the candidate terms: all of them, or forward one by one if there are more than 14.

    Only subsets count that hold every divisor of every term; otherwise a shift of a factor's zero would change the
    answer.

    Args:
        x: natural values, (n, d).
        y: response, (n,).
        space: the factors.
        candidates: terms to choose from; the constant, if among them, is always kept.
        criterion: ``press`` (leave-one-out squared errors) or ``bic`` (Schwarz 1978, doi 10.1214/aos/1176344136).

    Returns:
        The best subset among those with at least one residual degree of freedom, in the order of the candidates.

    Raises:
        InputError: unknown criterion, bad candidates, or no subset that these points can support.
    """
    check_choice("criterion", criterion, ("press", "bic"))
    x = as_matrix("x", x, space.d)
    y = as_vector("y", y, len(x))
    candidates = check_terms(list(candidates), space.d)
    basis = columns(space.to_coded(x), candidates)

    def weigh(chosen: tuple[int, ...]) -> float:
        hierarchical = chosen and is_hierarchical(candidates[i] for i in chosen)
        return _criterion(basis[:, chosen], y, criterion) if hierarchical else np.inf

    search = _all_subsets if len(candidates) <= MOST else _forward
    weighed = {chosen: weigh(chosen) for chosen in search(candidates, weigh)}
    value, _, best = min((v, len(c), c) for c, v in weighed.items())
    if not np.isfinite(value):
        raise InputError(
            f"no subset of the {len(candidates)} candidate terms can be fitted to these {len(y)} points; add points"
        )
    return tuple(candidates[i] for i in best)


def _criterion(basis: FloatArray, y: FloatArray, criterion: Criterion) -> float:
    """PRESS or BIC of least squares on these columns (n, p); infinite if they cannot be fitted or predict nothing."""
    n, p = basis.shape
    if n <= p:
        return np.inf
    q, r = np.linalg.qr(basis)
    if np.abs(np.diag(r)).min() < 1e-9 * np.linalg.norm(basis, axis=0).max():
        return np.inf
    error = y - q @ (q.T @ y)
    exact = 1e-24 * float(y @ y)  # below this all fits are equally good, and the fewest terms win
    if criterion == "bic":
        return float(n * np.log(max((error**2).mean(), exact, 1e-300)) + p * np.log(n))
    left = 1.0 - (q**2).sum(axis=1)
    return max(float(((error / left) ** 2).sum()), exact) if left.min() > 1e-9 else np.inf


def _split(candidates: Sequence[Term]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Positions of the constant (always kept) and of the others."""
    constant = tuple(i for i, t in enumerate(candidates) if not any(t))
    return constant, tuple(i for i, t in enumerate(candidates) if any(t))


def _all_subsets(candidates: Sequence[Term], _: Weigh) -> Iterator[tuple[int, ...]]:
    constant, others = _split(candidates)
    for size in range(len(others) + 1):
        for chosen in itertools.combinations(others, size):
            yield tuple(sorted(constant + chosen))


def _forward(candidates: Sequence[Term], weigh: Weigh) -> Iterator[tuple[int, ...]]:
    """Add the best term at each step, until none is left that can be added."""
    constant, others = _split(candidates)
    chosen = constant
    while True:
        grown = [tuple(sorted((*chosen, i))) for i in others if i not in chosen]
        yield from grown
        values = [weigh(c) for c in grown]
        if not values or not np.isfinite(min(values)):
            return
        chosen = grown[int(np.argmin(values))]
