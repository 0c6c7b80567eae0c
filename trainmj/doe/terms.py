"""Terms of a polynomial: which powers of which factors are multiplied, and which terms predict best.

A term is a tuple of exponents, one for each factor: with the factors D and M, (1, 0) is D, (0, 2) is M^2, (1, 1) is
D*M and (0, 0) the constant 1.

    terms = select_terms(X, y, space=space, candidates=full_order(2, 3))
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, check_choice
from trainmj.doe.space import Space
from trainmj.errors import InputError, close_match

Term = tuple[int, ...]
Criterion = Literal["press", "bic"]

MOST = 14  # candidates searched exhaustively: 2^14 small least-squares problems take about a second


def full_order(d: int, order: int) -> tuple[Term, ...]:
    """All terms of d factors up to a total order, constant first, then by order.

    Raises:
        InputError: d < 1 or order < 0.
    """
    if d < 1 or order < 0:
        raise InputError(f"terms need at least one factor and an order of at least 0 (got {d} and {order})")
    powers = itertools.product(range(order + 1), repeat=d)
    return tuple(sorted((t for t in powers if sum(t) <= order), key=lambda t: (sum(t), tuple(-e for e in t))))


def parse_terms(texts: Iterable[str], names: Sequence[str]) -> tuple[Term, ...]:
    """Read terms such as ``"1"``, ``"D"``, ``"M^2"``, ``"D*M"``.

    Args:
        texts: the terms.
        names: the factors, in the order of the exponents.

    Returns:
        One tuple of exponents for each text, in the order given.

    Raises:
        InputError: an unknown factor, an exponent that is not a positive whole number, or a term that occurs twice.
    """
    terms = []
    for text in texts:
        exponents = dict.fromkeys(names, 0)
        for part in () if text.strip() == "1" else text.split("*"):
            name, _, power = (piece.strip() for piece in part.partition("^"))
            if name not in exponents:
                raise InputError(f"term {text!r}: no factor {name!r}{close_match(name, names)}")
            if "^" in part and not (power.isdecimal() and int(power) > 0):
                raise InputError(f"term {text!r}: an exponent must be a positive whole number (got {power!r})")
            exponents[name] += int(power) if power else 1
        terms.append(tuple(exponents.values()))
    return check_terms(terms, len(names))


def check_terms(terms: Sequence[Term], d: int) -> tuple[Term, ...]:
    """The same terms, if there are any, each has d exponents and none occurs twice.

    Raises:
        InputError: otherwise.
    """
    if not terms:
        raise InputError("a polynomial needs at least one term (got none); '1' is the constant")
    for term in terms:
        if len(term) != d or any(e < 0 or int(e) != e for e in term):
            raise InputError(f"a term must have {d} exponents, whole numbers from 0 (got {term})")
    if len(set(terms)) != len(terms):
        twice = [t for t in dict.fromkeys(terms) if list(terms).count(t) > 1]
        raise InputError(f"a term must occur only once (twice: {twice})")
    return tuple(tuple(int(e) for e in t) for t in terms)


def term_name(term: Term, names: Sequence[str]) -> str:
    """Write a term: ``1``, ``D``, ``M^2``, ``D*M``."""
    parts = [name if e == 1 else f"{name}^{e}" for name, e in zip(names, term, strict=True) if e]
    return "*".join(parts) or "1"


def columns(x: FloatArray, terms: Sequence[Term]) -> FloatArray:
    """Evaluate each term at each point: (n, d) -> (n, number of terms)."""
    return np.stack([np.prod(x ** np.array(term), axis=1) for term in terms], axis=1)


def divisors(term: Term) -> Iterator[Term]:
    """Every term that divides this one, itself included: D*M^2 has 1, D, M, D*M, M^2, D*M^2."""
    return itertools.product(*(range(e + 1) for e in term))


def is_hierarchical(terms: Iterable[Term]) -> bool:
    """Whether every divisor of every term is a term too.

    Only then is the polynomial the same family of functions in natural and in coded factors (Peixoto 1990,
    doi 10.1080/00031305.1990.10475687).
    """
    chosen = set(terms)
    return all(divisor in chosen for term in chosen for divisor in divisors(term))


def expand(terms: Sequence[Term], coefficients: FloatArray, centre: FloatArray, half: FloatArray) -> dict[Term, float]:
    """Multiply out a polynomial in z = (x - centre) / half, both (d,), into one in x.

    Returns:
        {term in x: coefficient}, with the lower terms that the shift brings in.
    """
    natural: dict[Term, float] = {}
    for term, coefficient in zip(terms, coefficients, strict=True):
        for part in divisors(term):
            factors = (
                math.comb(e, k) * (-c) ** (e - k) / h**e for e, k, c, h in zip(term, part, centre, half, strict=True)
            )
            natural[part] = natural.get(part, 0.0) + float(coefficient) * math.prod(map(float, factors))
    return natural


def select_terms(
    x: ArrayLike,
    y: ArrayLike,
    *,
    space: Space,
    candidates: Sequence[Term],
    criterion: Criterion = "press",
) -> tuple[Term, ...]:
    """Choose the terms that predict points left out best: try all subsets or, beyond 14 candidates, add one at a time.

    Only subsets count that hold every divisor of every term; otherwise a shift of a factor's zero would change the
    answer. The choice uses the data, so the PRESS of the chosen terms is optimistic. For an honest error, put the
    choice inside the fit that `cross_validate` repeats.

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
    check_choice("criterion", criterion, get_args(Criterion))
    x = as_matrix("x", x, space.d)
    y = as_vector("y", y, len(x))
    candidates = check_terms(list(candidates), space.d)
    basis = columns(space.to_coded(x), candidates)

    def weigh(chosen: tuple[int, ...]) -> float:
        hierarchical = chosen and is_hierarchical(candidates[i] for i in chosen)
        return _criterion(basis[:, chosen], y, criterion) if hierarchical else np.inf

    constant = tuple(i for i, t in enumerate(candidates) if not any(t))
    others = tuple(i for i, t in enumerate(candidates) if any(t))
    subsets = _all_subsets(constant, others) if len(candidates) <= MOST else _forward(constant, others, weigh)
    value, _, best = min((weigh(chosen), len(chosen), chosen) for chosen in subsets)
    if not np.isfinite(value):
        raise InputError(
            f"no subset of the {len(candidates)} candidate terms that holds all their divisors can be fitted to these "
            f"{len(y)} points; add points, or the constant '1' if it is missing"
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


def _all_subsets(constant: tuple[int, ...], others: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    for size in range(len(others) + 1):
        for chosen in itertools.combinations(others, size):
            yield tuple(sorted(constant + chosen))


def _forward(
    constant: tuple[int, ...], others: tuple[int, ...], weigh: Callable[[tuple[int, ...]], float]
) -> Iterator[tuple[int, ...]]:
    """Add the best term at each step, until none is left that can be added."""
    chosen = constant
    while True:
        grown = [tuple(sorted((*chosen, i))) for i in others if i not in chosen]
        yield from grown
        values = [weigh(c) for c in grown]
        if not values or not np.isfinite(min(values)):
            return
        chosen = grown[int(np.argmin(values))]
