"""A lot of cases without a chain for each: what differs between them is computed for all at once.

The chain of one case is made with symbols in place of the numbers that differ (:mod:`trainmj.symbol`); their tape is
then played for all others. What is played has the bits of what Python computes for one case alone: sums, products and
comparisons are those of IEEE 754 in both, and powers are taken value by value.
"""

from __future__ import annotations

import logging
import math
import operator
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import partial
from threading import Lock
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from trainmj.collision.block import Layout
from trainmj.collision.cases import Cases
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.lineup import line_up
from trainmj.collision.lot import structure_of
from trainmj.collision.model import numbers_of
from trainmj.scenario import Scenario
from trainmj.symbol import CALL, CONSTANT, INPUT, Symbol, Tape

_CHECKED = 32  # every so many lots of a trace one is checked, the first ones more often

log = logging.getLogger(__name__)

_FUNCTIONS: dict[Any, Any] = {
    operator.add: np.add,
    operator.sub: np.subtract,
    operator.mul: np.multiply,
    operator.truediv: np.divide,
    operator.neg: np.negative,
    operator.abs: np.absolute,
    operator.pow: pow,  # case by case: the powers of arrays have other bits
    max: lambda one, other: np.where(other > one, other, one),
    min: lambda one, other: np.where(other < one, other, one),
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


class Trace:
    """The chain of one case with symbols in it, and what they stand for in all cases that take the same way.

    Attributes:
        scenario: which the cases change.
        chain: of the case, with symbols.
        sample: the same with its numbers.
        sound: whether nothing that was played has differed from what was computed for a case alone.
    """

    def __init__(
        self,
        scenario: Scenario,
        sample: Chain,
        changes: Callable[[Sequence[Any]], Mapping[str, Any]],
        numbers: Sequence[float],
        asked: Iterable[Callable[[Chain], Any]] = (),
    ) -> None:
        """Make the chain of a case with symbols.

        Args:
            scenario: which the cases change.
            sample: the chain of the case.
            changes: of the scenario, with so many numbers or symbols in place of what differs between the cases.
            numbers: which these are in the case.
            asked: functions of a chain of which values will be asked: their ways through the code are guarded, too.

        Raises:
            TraceError: if somewhere only a plain number will do.
        """
        self.scenario, self.sample, self.sound = scenario, sample, True
        self._tape = Tape()
        self.chain = line_up(scenario.with_values(changes([self._tape.symbol(number) for number in numbers])))
        self._outputs: dict[Hashable, _Output] = {}
        self._lock = Lock()  # several threads ask for values
        self._n_lots = 0
        self.guarded = self._guarded()
        self._layout = Layout.of(sample)
        for of in (*asked, self._numbers):
            self.output(of)

    def output(self, of: Callable[[Chain], Any]) -> _Output:
        """What a function gives for the chain, by places on the tape."""
        with self._lock:
            key = _key(of)
            if key not in self._outputs:
                before = len(self._tape.guards)
                values = np.array(of(self.chain), dtype=object)
                if len(self._tape.guards) > before:
                    self.guarded = self._guarded()
                flat = values.ravel().tolist()
                at = [n for n, value in enumerate(flat) if type(value) is Symbol]
                places = [self._tape.place(flat[n]) for n in at]
                plain = np.array([0.0 if type(value) is Symbol else value for value in flat], dtype=np.float64)
                program = _program(self._tape, places)
                self._outputs[key] = _Output(
                    values.shape, plain, np.array(at, dtype=int), places, program, self.guarded
                )
            return self._outputs[key]

    def _guarded(self) -> _Guarded:
        guards = self._tape.guards
        program = _program(self._tape, [place for _, *sides, _ in guards for place in sides])
        return _Guarded(len(self._tape.guards), program, [(_RELATIONS[r], a, b, found) for r, a, b, found in guards])

    def due(self) -> bool:
        """Whether the next lot is to be checked: more rarely, the more have been."""
        with self._lock:
            self._n_lots += 1
            return self._n_lots & (self._n_lots - 1) == 0 or self._n_lots % _CHECKED == 0

    def agrees(self, lot: Traced, place: int, alone: Chain) -> bool:
        """Whether the numbers of a case of a lot are those of its own chain, bit for bit; not sound if they are not."""
        found = structure_of(alone) == structure_of(self.sample) and np.array_equal(
            lot.values(self._numbers)[place].view(np.int64),
            np.array(self._numbers(alone), dtype=np.float64).view(np.int64),
        )
        if not found:
            self.sound = False
            log.warning(
                "case %s: what was computed for many cases at once is not what is for it alone", lot.keys[place]
            )
        return found

    def _numbers(self, chain: Chain) -> Array:
        """All numbers of a chain with which a simulation begins, plain or symbols."""
        model = [values.ravel() for values in numbers_of(chain).values()]
        return np.concatenate([self._layout.block(chain, object), chain.start_qpos, chain.start_qvel, *model])


def _key(of: Callable[[Chain], Any]) -> Hashable:
    """What tells a function from others: the same code with the same values around it is the same one."""
    if isinstance(of, partial):
        return _key(of.func), of.args, tuple(of.keywords.items())
    if isinstance(of, FunctionType):
        return of.__code__, of.__defaults__, tuple(cell.cell_contents for cell in of.__closure__ or ())
    return of


class _Program(NamedTuple):
    """Steps of a tape, in their order."""

    size: int  # of the tape
    constants: list[tuple[int, float]]
    steps: list[tuple[Any, int, int, int]]  # function, place, places of its arguments


class _Guarded(NamedTuple):
    """Guards, and what they need."""

    n: int  # how many the tape has
    program: _Program
    guards: list[tuple[Any, int, int, bool]]


class _Output(NamedTuple):
    """What a function gives for a chain with symbols."""

    shape: tuple[int, ...]
    plain: Array  # (size,) its numbers; 0 where symbols are
    at: npt.NDArray[np.intp]  # (n,) where these are
    places: list[int]  # (n,) of them on the tape
    program: _Program
    guarded: _Guarded  # under which it is true


def _program(tape: Tape, wanted: Iterable[int]) -> _Program:
    """The steps that places of a tape need."""
    open_, needed = list(wanted), set[int]()
    while open_:
        place = open_.pop()
        if place not in needed:
            needed.add(place)
            operation, one, other = tape.steps[place]
            open_ += tape.calls[one][1] if operation == CALL else [at for at in (one, other) if at >= 0]
    constants, steps = [], []
    for place in sorted(needed):
        operation, one, other = tape.steps[place]
        if operation == CONSTANT:
            constants.append((place, tape.constants[place]))
        elif operation == CALL:
            steps.append((tape.calls[one], place, one, other))
        elif operation != INPUT:
            steps.append((_FUNCTIONS[operation], place, one, other))
    return _Program(len(tape.steps), constants, steps)


class _Played:
    """The numbers of a tape for many cases."""

    def __init__(self, tape: Tape, numbers: Array) -> None:
        """Take the numbers (n_number, n_case) that the symbols stand for."""
        self._n = numbers.shape[1]
        self._values: list[Any] = [None] * len(tape.steps)
        for place, row in zip(tape.inputs, numbers, strict=True):
            self._values[place] = row
        self._answers: dict[int, Array] = {}
        self.lost = np.zeros(self._n, dtype=bool)  # cases of which something cannot be computed

    def kept(self, guarded: _Guarded) -> npt.NDArray[np.bool_]:
        """(n_case,) which cases keep guards."""
        self._run(guarded.program)
        values, kept = self._values, np.ones(self._n, dtype=bool)
        with np.errstate(all="ignore"):
            for relation, one, other, outcome in guarded.guards:
                kept &= relation(values[one], values[other]) == outcome
        return kept & ~self.lost

    def values(self, output: _Output) -> Array:
        """(n_case, ...) what a function gives."""
        self._run(output.program)
        found = np.empty((self._n, output.plain.size))
        found[:] = output.plain
        if output.places:
            found[:, output.at] = np.array([self._values[place] for place in output.places]).T
        return found.reshape(self._n, *output.shape)

    def _run(self, program: _Program) -> None:
        values = self._values
        values += [None] * (program.size - len(values))
        for place, number in program.constants:
            values[place] = number
        with np.errstate(all="ignore"):
            for function, place, one, other in program.steps:
                if values[place] is None:
                    if isinstance(function, tuple):
                        values[place] = self._answer(one, *function)[other]
                    elif function is pow:
                        values[place] = self._case_by_case(pow, (one, other), 1)[0]
                    else:
                        values[place] = function(values[one]) if other < 0 else function(values[one], values[other])

    def _answer(self, number: int, function: Callable[..., Any], places: Sequence[int], n_value: int) -> Array:
        """(n_value, n_case) what a function gives case by case."""
        if number not in self._answers:
            self._answers[number] = self._case_by_case(function, places, n_value)
        return self._answers[number]

    def _case_by_case(self, function: Callable[..., Any], places: Sequence[int], n_value: int) -> Array:
        found = np.full((n_value, self._n), np.nan)
        columns = [np.broadcast_to(self._values[place], self._n).tolist() for place in places]
        for n, arguments in enumerate(zip(*columns, strict=True)):
            try:
                answer = np.ravel(function(*arguments))
            except (ArithmeticError, ValueError):
                self.lost[n] = True
                continue
            if answer.size == n_value and answer.dtype == np.float64:
                found[:, n] = answer
            else:
                self.lost[n] = True
        return found


class Traced:
    """A lot of which one case has been traced, and the others follow its way.

    Attributes:
        keys: what the caller calls each case.
        chain: of the case that was traced, which need not be one of them.
    """

    def __init__(self, trace: Trace, cases: Cases, numbers: Array) -> None:
        """Take cases, and which numbers (n_number, n_case) the symbols stand for in them."""
        self.keys, self.chain = cases.keys, trace.sample
        self._trace, self._cases, self._numbers = trace, cases, numbers
        self._played = _Played(trace._tape, numbers)
        self._n_guards = 0  # of which it is known who keeps them
        self._astray = np.zeros(len(cases), dtype=bool)
        self._found: dict[int, Array] = {}

    def astray(self, guarded: _Guarded) -> npt.NDArray[np.bool_]:
        """(n_case,) which cases take another way than the one that was traced."""
        if guarded.n > self._n_guards:
            self._astray |= ~self._played.kept(guarded)
            self._n_guards = guarded.n
        return self._astray | self._played.lost

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self.keys)

    def values(self, of: Callable[[Chain], Any]) -> Array:
        """(n_case, ...) a number, or an array of numbers, of every case."""
        output = self._trace.output(of)
        if id(output) not in self._found:
            found = self._played.values(output)
            for place in np.flatnonzero(self.astray(output.guarded)).tolist():
                found[place] = of(self.chain_of(place))
            self._found[id(output)] = found
        return self._found[id(output)]

    def blocks(self, layout: Layout) -> Array:
        """(n_case, size) the block of each case before its first step."""
        return self.values(partial(layout.block, dtype=object))

    def chain_of(self, place: int) -> Chain:
        """The chain of one case."""
        return line_up(self._trace.scenario.with_values(self._cases[place]))

    def take(self, places: Sequence[int]) -> Traced:
        """Some of the cases, in this order."""
        at = list(places)
        found = Traced(self._trace, self._cases.take(at), self._numbers[:, at])
        found._n_guards, found._astray = self._n_guards, self._astray[at]
        found._found = {output: values[at] for output, values in self._found.items()}
        return found


def followers(trace: Trace, cases: Cases, numbers: Array) -> tuple[Traced | None, npt.NDArray[np.bool_]]:
    """The lot of those cases that follow a trace, if any do, and which do; the numbers are those of :class:`Traced`."""
    whole = Traced(trace, cases, numbers)
    follow = ~whole.astray(trace.guarded)
    if follow.all():
        return whole, follow
    return whole.take(np.flatnonzero(follow).tolist()) if follow.any() else None, follow
