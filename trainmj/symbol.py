"""Symbols: numbers that stand for one value in each of many cases, so that code runs once for all of them.

A symbol is no float. What is computed with it is written down on its tape, and so is how each comparison came out for
the sample, the case that the code runs for::

    tape = Tape()
    mass = tape.symbol(33.0)
    0.5 * mass                                   # another symbol, 16.5 for the sample
    mass > 30.0                                  # True, and from now on a guard of the tape

:mod:`trainmj.collision.traced` computes what is on a tape for all cases at once, by the same operations in the same
order, so that every number has the bits that the code gives for its case alone. A case for which a guard comes out
otherwise takes another way through the code and is not in what the tape says. Nothing turns a symbol into a plain
number: whatever needs one raises a :class:`TraceError`, so that none is lost.

Plain sums, differences, products and quotients have the same bits wherever they are computed. What has not, is written
with the functions of this module, which take plain numbers as well.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NoReturn

INPUT, CONSTANT, CALL = "input", "constant", "call"
"""Steps of a tape that are no operation."""

Guard = tuple[Callable[[Any, Any], bool], int, int, bool]
"""A comparison, the places of both sides on a tape, and how it came out for the sample."""


class TraceError(TypeError):
    """A symbol was used where only a plain number will do; nothing is wrong with the input."""

    def __init__(self, what: str, symbol: Symbol | None = None) -> None:
        """Say what was asked of which symbol."""
        super().__init__(f"{what} of a number that stands for many cases")
        self.symbol = symbol


class Tape:
    """What was computed with symbols, place by place.

    Attributes:
        steps: for each place the operation and the places of its arguments, the second one -1 where there is one; of a
            call its number and which of its answers.
        constants: the plain numbers, by their places.
        inputs: places of the symbols that nothing was computed for, in their order.
        calls: functions that are asked case by case, the places of their arguments, and how many numbers they give.
        guards: comparisons and how they came out.
    """

    def __init__(self) -> None:
        """Begin an empty one."""
        self.steps: list[tuple[Any, int, int]] = []
        self.constants: dict[int, float] = {}
        self.inputs: list[int] = []
        self.calls: list[tuple[Callable[..., Any], tuple[int, ...], int]] = []
        self.guards: list[Guard] = []
        self._known: dict[Any, Any] = {}  # the same operation on the same numbers is written down once
        self._guarded: set[Guard] = set()

    def symbol(self, sample: float) -> Symbol:
        """A symbol that stands for a number of each case."""
        self.inputs.append(len(self.steps))
        return self._write((INPUT, -1, -1), float(sample))

    def place(self, value: Any) -> int:
        """The place of a symbol, or of a plain number."""
        if type(value) is Symbol:
            if value.tape is not self:
                raise TraceError("another tape", value)
            return value.place
        number = float(value)
        key = number.hex()  # tells 0.0 from -0.0
        place = self._known.get(key)
        if place is None:
            place = self._known[key] = len(self.steps)
            self.constants[place] = number
            self.steps.append((CONSTANT, -1, -1))
        return int(place)

    def operate(self, operation: Any, sample: float, one: Any, other: Any = None) -> Symbol:
        """The result of an operation on one or two numbers."""
        step = operation, self.place(one), -1 if other is None else self.place(other)
        found = self._known.get(step)
        if found is None:
            found = self._known[step] = self._write(step, sample)
        return found

    def guard(self, relation: Callable[[Any, Any], bool], one: Symbol, other: Any) -> bool:
        """How a comparison comes out for the sample, which it must for every case."""
        found = bool(relation(one.sample, other.sample if type(other) is Symbol else other))
        guard = relation, one.place, self.place(other), found
        if guard not in self._guarded:
            self._guarded.add(guard)
            self.guards.append(guard)
        return found

    def call(self, function: Callable[..., Any], arguments: list[Any], samples: list[float]) -> list[Symbol]:
        """The numbers that a function gives, asked case by case."""
        places = tuple(map(self.place, arguments))
        key = (function, places)
        if key not in self._known:
            number = len(self.calls)
            self.calls.append((function, places, len(samples)))
            self._known[key] = [self._write((CALL, number, n), sample) for n, sample in enumerate(samples)]
        return self._known[key]  # type: ignore[no-any-return]

    def _write(self, step: tuple[Any, int, int], sample: float) -> Symbol:
        self.steps.append(step)
        return Symbol(self, len(self.steps) - 1, sample)


def _two_sided(operation: Callable[[Any, Any], Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """An operator of symbols, and the same with the symbol on the right."""
    divides = operation is operator.truediv

    def ahead(self: Symbol, other: Any) -> Any:
        number = _sample(other)
        if number is None:
            return NotImplemented
        if divides and type(other) is Symbol:
            self.tape.guard(operator.ne, other, 0.0)  # plain numbers raise an error there, arrays do not
        return self.tape.operate(operation, operation(self.sample, number), self, other)

    def behind(self: Symbol, other: Any) -> Any:
        number = _sample(other)
        if number is None:
            return NotImplemented
        if divides:
            self.tape.guard(operator.ne, self, 0.0)
        return self.tape.operate(operation, operation(number, self.sample), other, self)

    return ahead, behind


def _compared(relation: Callable[[Any, Any], bool]) -> Callable[[Symbol, Any], Any]:
    """A comparison of symbols: a guard."""

    def compare(self: Symbol, other: Any) -> Any:
        return NotImplemented if _sample(other) is None else self.tape.guard(relation, self, other)

    return compare


def _refused(what: str) -> Callable[..., NoReturn]:
    """What would make a plain number of a symbol, or text."""

    def refuse(self: Symbol, *_: Any) -> NoReturn:
        raise TraceError(what, self)

    return refuse


def _sample(value: Any) -> float | None:
    """The number of the sample, of a symbol or a plain number; None if it is something else."""
    if type(value) is Symbol:
        return value.sample
    return float(value) if isinstance(value, float | int) else None


class Symbol:
    """A number that stands for one value in each case.

    Attributes:
        tape: on which it is.
        place: there.
        sample: its value in the case for which the code runs; for messages and comparisons only.
    """

    __slots__ = ("place", "sample", "tape")

    def __init__(self, tape: Tape, place: int, sample: float) -> None:
        """A tape makes them."""
        self.tape, self.place, self.sample = tape, place, sample

    __add__, __radd__ = _two_sided(operator.add)
    __sub__, __rsub__ = _two_sided(operator.sub)
    __mul__, __rmul__ = _two_sided(operator.mul)
    __truediv__, __rtruediv__ = _two_sided(operator.truediv)

    def __pow__(self, exponent: Any) -> Any:
        """A power as plain numbers give it, which is not that of arrays to the last bit."""
        return NotImplemented if _sample(exponent) is None else _power(self.tape, self, exponent)

    def __rpow__(self, base: Any) -> Any:
        """Likewise."""
        return NotImplemented if _sample(base) is None else _power(self.tape, base, self)

    def __neg__(self) -> Symbol:
        """Its negative."""
        return self.tape.operate(operator.neg, -self.sample, self)

    def __abs__(self) -> Symbol:
        """Its magnitude."""
        return self.tape.operate(operator.abs, abs(self.sample), self)

    def __round__(self, digits: None = None) -> int:
        """The nearest whole number, the same for every case."""
        if digits is not None:
            raise TraceError("digits", self)
        nearest = round(self.sample)
        self.tape.guard(operator.eq, self.tape.operate(round, float(nearest), self), nearest)
        return nearest

    def __bool__(self) -> bool:
        """Whether it is not 0: a guard."""
        return self.tape.guard(operator.ne, self, 0.0)

    __lt__, __le__ = _compared(operator.lt), _compared(operator.le)
    __gt__, __ge__ = _compared(operator.gt), _compared(operator.ge)
    __eq__, __ne__ = _compared(operator.eq), _compared(operator.ne)

    def __repr__(self) -> str:
        """For whoever looks for an error; a number in text is refused."""
        return f"<symbol {self.place}: {self.sample!r}>"

    __hash__ = _refused("hash")
    __str__, __format__ = _refused("text"), _refused("text")
    __float__, __complex__ = _refused("float"), _refused("complex")
    __int__, __index__, __trunc__ = _refused("int"), _refused("index"), _refused("int")
    __floor__, __ceil__ = _refused("floor"), _refused("ceil")


def _power(tape: Tape, base: Any, exponent: Any) -> Symbol:
    if type(base) is Symbol:
        tape.guard(operator.gt, base, 0.0)
    found = _sample(base) ** _sample(exponent)  # type: ignore[operator]
    if isinstance(found, complex):
        raise TraceError("a complex power")
    return tape.operate(operator.pow, found, base, exponent)


def square_root(value: float) -> float:
    """The square root of a number, or of a symbol as another one.

    Raises:
        ValueError: if it is below 0.
    """
    if isinstance(value, float | int):
        return math.sqrt(value)
    symbol: Any = value
    symbol.tape.guard(operator.ge, symbol, 0.0)
    found: float = symbol.tape.operate(math.sqrt, math.sqrt(symbol.sample), symbol)
    return found


def largest(values: Iterable[float]) -> float:
    """The largest of some numbers or symbols; which one that is may differ from case to case, unlike with max."""
    found: float = _extreme(max, operator.gt, values)
    return found


def least(values: Iterable[float]) -> float:
    """Likewise the least."""
    found: float = _extreme(min, operator.lt, values)
    return found


def _extreme(of: Callable[..., Any], passes: Callable[[Any, Any], bool], values: Iterable[Any]) -> Any:
    listed = list(values)
    if Symbol not in set(map(type, listed)):
        return of(listed)
    found, *others = listed
    for value in others:
        if type(found) is Symbol or type(value) is Symbol:
            a, b = sampled(found), sampled(value)
            tape = found.tape if type(found) is Symbol else value.tape
            found = tape.operate(of, float(b if passes(b, a) else a), found, value)
        elif passes(value, found):
            found = value
    return found


def case_by_case(function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function gives for numbers and lists or arrays of them; where symbols are among them, case by case.

    Args:
        function: gives a number, or an array whose shape is the same for all cases.
        arguments: numbers, and arrays of numbers.
    """
    found = list(symbols_in(arguments))
    if not found:
        return function(*arguments)
    import numpy as np

    parts = [np.array(argument, dtype=object) for argument in arguments]
    shapes = tuple(part.shape for part in parts)
    flat = [value for part in parts for value in part.ravel()]
    asked = _Asked(function, shapes)
    answer = np.asarray(asked(*(value.sample if type(value) is Symbol else value for value in flat)), dtype=float)
    symbols = found[0][1].tape.call(asked, flat, answer.ravel().tolist())
    return symbols[0] if answer.ndim == 0 else np.array(symbols, dtype=object).reshape(answer.shape)


class _Asked:
    """A function of numbers that takes them one by one."""

    def __init__(self, function: Callable[..., Any], shapes: tuple[tuple[int, ...], ...]) -> None:
        self._what = function, shapes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Asked) and self._what == other._what

    def __hash__(self) -> int:
        return hash(self._what)

    def __call__(self, *flat: float) -> Any:
        import numpy as np

        function, shapes = self._what
        at, arguments = 0, []
        for shape in shapes:
            size = math.prod(shape)
            part = flat[at : at + size]
            arguments.append(np.array(part, dtype=float).reshape(shape) if shape else part[0])
            at += size
        return function(*arguments)


def symbols_in(values: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Symbol]]:
    """The symbols within dicts, lists, tuples and arrays, each with the keys and positions that lead to it."""
    if type(values) is Symbol:
        yield path, values
    elif isinstance(values, dict):
        for key, inner in values.items():
            yield from symbols_in(inner, (*path, key))
    elif isinstance(values, list | tuple):
        for n, inner in enumerate(values):
            yield from symbols_in(inner, (*path, n))
    elif getattr(getattr(values, "dtype", None), "kind", "") == "O":
        yield from symbols_in(values.tolist(), path)


def sampled(values: Any) -> Any:
    """The same dicts and lists, with the number of the sample in place of each symbol."""
    if type(values) is Symbol:
        return values.sample
    if isinstance(values, dict):
        return {key: sampled(inner) for key, inner in values.items()}
    return [sampled(inner) for inner in values] if isinstance(values, list) else values
