"""Terms of a polynomial: which powers of which factors are multiplied.

A term is a tuple of exponents, one for each factor: with the factors D and M, (1, 0) is D, (0, 2) is M^2, (1, 1) is
D*M and (0, 0) the constant 1.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError, close_match

Term = tuple[int, ...]


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
    check_terms(terms, len(names))
    return tuple(terms)


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
    """Multiply out a polynomial in z = (x - centre) / half into one in x.

    Args:
        terms: terms in z.
        coefficients: one for each term.
        centre: (d,).
        half: (d,), half the range of each factor.

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
