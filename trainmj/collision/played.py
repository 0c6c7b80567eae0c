"""What is on a tape of symbols, computed for many cases at once.

What is played has the bits of what Python computes for one case alone: sums, products, quotients, roots and comparisons
are those of IEEE 754 in both, and powers are taken value by value. Steps that do not need each other are computed
together, as rows of one matrix.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from trainmj.collision.envelope import Array
from trainmj.symbol import CALL, CONSTANT, INPUT, Tape


def _larger(one: Array, other: Array) -> Any:
    return np.where(other > one, other, one)


def _smaller(one: Array, other: Array) -> Any:
    return np.where(other < one, other, one)


_FUNCTIONS: dict[Any, Any] = {
    operator.add: np.add,
    operator.sub: np.subtract,
    operator.mul: np.multiply,
    operator.truediv: np.divide,
    operator.neg: np.negative,
    operator.abs: np.absolute,
    max: _larger,
    min: _smaller,
    math.sqrt: np.sqrt,
    round: np.rint,
}
_RELATIONS: dict[Any, Any] = {
    operator.lt: np.less,
    operator.le: np.less_equal,
    operator.gt: np.greater,
    operator.ge: np.greater_equal,
    operator.eq: np.equal,
    operator.ne: np.not_equal,
}

RAISED = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""What code raises for numbers that it is not made for, and where it needs a number and a symbol is none."""

Mask = npt.NDArray[np.bool_]
_Rows = slice | npt.NDArray[np.intp]


class _Batch(NamedTuple):
    """Steps that are computed together."""

    operation: Any
    to: slice  # rows of what they give
    sides: list[_Rows | Array]  # rows that they take, or plain numbers as a column


class _Guards(NamedTuple):
    """Guards that are looked at together."""

    relation: Any
    outcome: bool
    left: npt.NDArray[np.intp]  # rows
    right: Array  # rows, or plain numbers


@dataclass(frozen=True, eq=False)
class Program:
    """A tape, in the order in which it is played.

    Attributes:
        size: steps of the tape that it has.
        n_guards: guards of the tape that it has.
        n_rows: rows of the matrix of its numbers.
        row_of: that of a place of the tape.
    """

    size: int
    n_guards: int
    n_rows: int
    row_of: dict[int, int]
    _batches: list[_Batch]
    _guards: list[_Guards]

    @classmethod
    def of(cls, tape: Tape) -> Program:
        """The program of a tape as it is now."""
        level = [0] * len(tape.steps)
        together: dict[Any, list[int]] = {}
        for place, (operation, one, other) in enumerate(tape.steps):
            if operation in (INPUT, CONSTANT):
                continue
            needs = tape.calls[one][1] if operation == CALL else [one] if other < 0 else [one, other]
            level[place] = 1 + max(level[need] for need in needs)
            plain = () if operation == CALL else tuple(need in tape.constants for need in needs)
            together.setdefault((level[place], id(operation), one if operation == CALL else plain), []).append(place)
        rows = {place: n for n, place in enumerate(tape.inputs)}
        batches: list[_Batch] = []
        for key in sorted(together, key=lambda key: key[0]):
            places = together[key]
            operation, one, _ = tape.steps[places[0]]
            to = slice(len(rows), len(rows) + len(places))
            if operation == CALL:
                called, needs, _ = tape.calls[one]
                batches.append(_Batch(called, to, [_side(tape, rows, [need]) for need in needs]))
            else:
                n_sides = 1 if tape.steps[places[0]][2] < 0 else 2
                sides = [_side(tape, rows, [tape.steps[place][1 + n] for place in places]) for n in range(n_sides)]
                batches.append(_Batch(operation, to, sides))
            rows |= {place: to.start + n for n, place in enumerate(places)}
        alike: dict[Any, list[tuple[int, float]]] = {}
        for relation, left, right, outcome in tape.guards:
            against: float = tape.constants[right] if right in tape.constants else rows[right]
            alike.setdefault((relation, outcome, type(against)), []).append((rows[left], against))
        guards = [
            _Guards(relation, outcome, *map(np.array, zip(*pairs, strict=True)))
            for (relation, outcome, _), pairs in alike.items()
        ]
        return cls(len(tape.steps), len(tape.guards), len(rows), rows, batches, guards)

    def play(self, numbers: Array) -> Played:
        """Compute all for the numbers (n_number, n_case) of the symbols that nothing was computed for."""
        values = np.empty((self.n_rows, numbers.shape[1]))
        values[: len(numbers)] = numbers
        lost = np.zeros(numbers.shape[1], dtype=bool)
        with np.errstate(all="ignore"):
            for operation, to, sides in self._batches:
                taken = [_taken(values, side) for side in sides]
                if operation in _FUNCTIONS:
                    values[to] = _FUNCTIONS[operation](*taken)
                elif operation is operator.pow:
                    values[to] = _powers(taken[0], taken[1], lost)
                else:
                    values[to] = _case_by_case(operation, taken, to.stop - to.start, lost)
            kept = ~lost
            low, high = values.min(axis=1), values.max(axis=1)
            for relation, outcome, left, right in self._guards:
                if right.dtype == np.float64:  # most are kept by all cases, as those at both ends show
                    open_ = ~_by_all(relation, outcome, low[left], high[left], right)
                    left, other = left[open_], right[open_, None]
                else:
                    other = values[right]
                if left.size:
                    kept &= (_RELATIONS[relation](values[left], other) == outcome).all(axis=0)
        return Played(self, values, kept)


@dataclass(frozen=True, eq=False)
class Played:
    """The numbers of a tape for many cases.

    Attributes:
        program: that was played.
        kept: (n_case,) which cases keep all guards; the numbers of others are not theirs.
    """

    program: Program
    _values: Array
    kept: Mask

    def rows(self, places: Sequence[int]) -> Array:
        """(n_place, n_case) numbers at places of the tape."""
        return np.asarray(self._values[[self.program.row_of[place] for place in places]])

    def take(self, at: Sequence[int]) -> Played:
        """The same of some of the cases."""
        return Played(self.program, self._values[:, at], self.kept[at])


def _by_all(relation: Any, outcome: bool, low: Array, high: Array, limit: Array) -> Mask:
    """Whether all numbers from a lowest to a highest one certainly compare with a limit as they should."""
    if relation in (operator.eq, operator.ne):
        equal = outcome == (relation is operator.eq)
        return np.asarray((low == limit) & (high == limit) if equal else (limit < low) | (high < limit))
    below = relation in (operator.lt, operator.le)
    strict = relation in (operator.lt, operator.gt)
    if below != outcome:  # must not be below, or must be above
        return np.asarray(low > limit if strict == outcome else low >= limit)
    return np.asarray(high < limit if strict == outcome else high <= limit)


def _side(tape: Tape, rows: dict[int, int], places: list[int]) -> _Rows | Array:
    """Where numbers at places of a tape are found: rows, or a column of plain numbers."""
    if all(place in tape.constants for place in places):
        return np.array([[tape.constants[place]] for place in places])
    found = np.array([rows[place] for place in places])
    first, n = int(found[0]), len(found)
    return slice(first, first + n) if np.array_equal(found, np.arange(first, first + n)) else found


def _taken(values: Array, side: _Rows | Array) -> Array:
    if isinstance(side, slice):
        return values[side]
    return np.asarray(side) if side.dtype == np.float64 else values[side.astype(np.intp, copy=False)]


def _powers(base: Array, exponent: Array, lost: Mask) -> Array:
    """Powers as Python takes them one by one: those of arrays have other bits."""
    bases, exponents = np.broadcast_arrays(base, exponent)
    both = zip(bases.ravel().tolist(), exponents.ravel().tolist(), strict=True)
    try:
        return np.array([math.pow(*pair) for pair in both]).reshape(bases.shape)
    except (ArithmeticError, ValueError):  # of a few cases, most likely
        rows = zip(bases, exponents, strict=True)
        return np.array([_case_by_case(math.pow, [one[None], other[None]], 1, lost)[0] for one, other in rows])


def _case_by_case(function: Callable[..., Any], taken: Sequence[Array], n_value: int, lost: Mask) -> Array:
    """(n_value, n_case) what a function gives; cases for which it gives nothing of this size are lost."""
    found = np.full((n_value, lost.size), np.nan)
    columns = [np.broadcast_to(rows[0], lost.size).tolist() for rows in taken]
    for n, arguments in enumerate(zip(*columns, strict=True)):
        try:
            answer = function(*arguments)
        except RAISED:  # for a case that breaks a rule, most likely, which it says alone
            lost[n] = True
            continue
        if np.size(answer) != n_value:
            lost[n] = True
        else:
            found[:, n] = answer if n_value == 1 else np.ravel(answer)
    return found
