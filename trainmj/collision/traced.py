"""A lot of cases without a chain for each: what differs between them is computed for all at once.

The chain of one case is made with symbols in place of the numbers that differ (:mod:`trainmj.symbol`); their tape is
then played for all others.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable, Mapping, Sequence
from copy import copy
from functools import partial
from threading import Lock
from types import FunctionType, MethodType, NoneType
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
from trainmj.collision.played import RAISED, Mask, Played, Program
from trainmj.scenario import Scenario
from trainmj.symbol import Symbol, Tape, TraceError, sampled

_CHECKED = 64  # every so many lots of a trace one is checked, and of the first ones several
_CHECKED_AT_FIRST = (1, 4, 16)

log = logging.getLogger(__name__)


class Trace:
    """The chain of one case with symbols in it, and what they stand for in all cases that take the same way.

    Attributes:
        scenario: which the cases change.
        chain: of the case, with symbols.
        sample: the same with its numbers.
        sound: whether nothing that was played has differed from what was computed for a case alone.
        n_cases: that have followed it.
    """

    def __init__(
        self,
        scenario: Scenario,
        sample: Chain,
        changes: Callable[[Sequence[Any]], Mapping[str, Any]],
        numbers: Sequence[float],
    ) -> None:
        """Make the chain of a case with symbols.

        Args:
            scenario: which the cases change.
            sample: the chain of the case.
            changes: of the scenario, with so many numbers or symbols in place of what differs between the cases.
            numbers: which these are in the case.

        Raises:
            TraceError: if somewhere only a plain number will do.
        """
        self.scenario, self.sample, self.sound, self.n_cases = scenario, sample, True, 0
        self._tape = Tape()
        self.chain = line_up(scenario.with_values(changes([self._tape.symbol(number) for number in numbers])))
        self._outputs: dict[Hashable, Output | None] = {}
        self._lock = Lock()  # several threads ask for values
        self._n_lots = 0
        self._structure = structure_of(sample)
        self._program: Program | None = None
        self._layout = Layout.of(sample)
        if self.output(self._numbers) is None:
            raise TraceError("what a simulation begins with")

    def output(self, of: Callable[[Chain], Any]) -> Output | None:
        """What a function gives for the chain, by places on the tape; None if it cannot be traced."""
        key = _key(of)
        with self._lock:
            if key in self._outputs:
                return self._outputs[key]
            try:
                found = self._output(of)
            except RAISED as error:
                log.info("what is asked of the chains of a lot is asked one by one: %s", error)
                found = None
            if key is not None:
                self._outputs[key] = found
            return found

    def _output(self, of: Callable[[Chain], Any]) -> Output | None:
        values = np.array(of(self.chain), dtype=object)
        flat = values.ravel().tolist()
        if not _same(np.array(sampled(flat), dtype=np.float64).reshape(values.shape), of(self.sample)):
            log.warning("what is asked of the chains of a lot is asked one by one: with symbols it is another number")
            return None
        at = [n for n, value in enumerate(flat) if type(value) is Symbol]
        places = [self._tape.place(flat[n]) for n in at]
        plain = np.array([0.0 if type(value) is Symbol else value for value in flat], dtype=np.float64)
        return Output(
            of, values.shape, plain, np.array(at, dtype=int), places, len(self._tape.steps), len(self._tape.guards)
        )

    def play(self, numbers: Array) -> Played:
        """Compute what is on the tape, for numbers (n_number, n_case) in place of the symbols."""
        with self._lock:
            tape, program = self._tape, self._program
            if program is None or (program.size, program.n_guards) != (len(tape.steps), len(tape.guards)):
                program = self._program = Program.of(tape)
        return program.play(numbers)

    def due(self) -> bool:
        """Whether the next lot is to be checked."""
        with self._lock:
            self._n_lots += 1
            return self._n_lots in _CHECKED_AT_FIRST or self._n_lots % _CHECKED == 0

    def agrees(self, lot: Traced, place: int, alone: Chain) -> bool:
        """Whether the numbers of a case of a lot are those of its own chain, bit for bit; not sound if they are not."""
        with self._lock:
            asked = [output.of for output in self._outputs.values() if output is not None]
        found = structure_of(alone) == self._structure and all(_same(lot.values(of)[place], of(alone)) for of in asked)
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


def _same(one: Array, other: Any) -> bool:
    """Whether numbers have the same bits."""
    plain = np.array(other, dtype=np.float64)
    return one.shape == plain.shape and one.tobytes() == plain.tobytes()


def _key(thing: Any) -> Hashable:
    """What tells a function from others: the same code with the same values around it; None if these cannot be told."""
    own: Hashable = None
    if isinstance(thing, partial):
        parts = [thing.func, *thing.args, *thing.keywords, *thing.keywords.values()]
    elif isinstance(thing, MethodType):
        parts = [thing.__func__, thing.__self__]
    elif isinstance(thing, FunctionType):
        own = thing.__module__, thing.__code__
        parts = [*(thing.__defaults__ or ()), *(cell.cell_contents for cell in thing.__closure__ or ())]
    elif isinstance(thing, tuple | list):
        parts = list(thing)
    else:
        return (type(thing).__name__, thing) if isinstance(thing, _TOLD) else None
    keys = [_key(part) for part in parts]
    return None if None in keys else (type(thing).__name__, own, *keys)


_TOLD = (int, float, str, type, NoneType, Layout, Trace)
"""Values of which equal ones are the same for all that is computed with them."""


class Output(NamedTuple):
    """What a function gives for a chain with symbols."""

    of: Callable[[Chain], Any]
    shape: tuple[int, ...]
    plain: Array  # (size,) its numbers; 0 where symbols are
    at: npt.NDArray[np.intp]  # (n,) where these are
    places: list[int]  # (n,) of them on the tape
    size: int  # of the tape, up to which it was played for this
    n_guards: int  # of the tape, that hold for this


class Traced:
    """A lot of which one case has been traced, and the others follow its way.

    Attributes:
        keys: what the caller calls each case.
        chain: of the case that was traced, which need not be one of them.
        places: of the cases among those that they were taken from.
    """

    def __init__(self, trace: Trace, cases: Cases, places: Sequence[int], numbers: Array) -> None:
        """Take cases by their places among some, and which numbers (n_number, n_case) the symbols stand for in them."""
        self.keys: Sequence[Any] = [cases.keys[place] for place in places]
        self.chain = trace.sample
        self._trace, self._cases, self.places, self._numbers = trace, cases, places, numbers
        self._played = trace.play(numbers)
        self._found: dict[Hashable, Array] = {}  # by what was asked
        self._alone: dict[int, Chain] = {}  # chains of single cases

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self.keys)

    @property
    def follows(self) -> Mask:
        """(n_case,) which cases take the way that was traced."""
        return self._played.kept

    def values(self, of: Callable[[Chain], Any]) -> Array:
        """(n_case, ...) a number, or an array of numbers, of every case."""
        key = _key(of)
        if key in self._found:
            return self._found[key]
        found = self._values(of)
        if key is not None:
            self._found[key] = found
        return found

    def _values(self, of: Callable[[Chain], Any]) -> Array:
        output = self._trace.output(of)
        if output is None:
            return np.array([of(self.chain_of(place)) for place in range(len(self))], dtype=np.float64)
        program = self._played.program
        if program.size < output.size or program.n_guards < output.n_guards:
            self._played = self._trace.play(self._numbers)
        found = np.empty((len(self), output.plain.size))
        found[:] = output.plain
        if output.places:
            found[:, output.at] = self._played.rows(output.places).T
        found = found.reshape(len(self), *output.shape)
        for place in np.flatnonzero(~self.follows).tolist():
            found[place] = of(self.chain_of(place))
        return found

    def blocks(self, layout: Layout) -> Array:
        """(n_case, size) the block of each case before its first step."""
        return self._values(partial(layout.block, dtype=object))  # not kept: they are large

    def chain_of(self, place: int) -> Chain:
        """The chain of one case."""
        at = self.places[place]
        if at not in self._alone:
            self._alone[at] = line_up(self._trace.scenario.with_values(self._cases[at]))
        return self._alone[at]

    def take(self, places: Sequence[int]) -> Traced:
        """Some of the cases, in this order."""
        at = list(places)
        found = copy(self)
        found.keys, found.places = [self.keys[n] for n in at], [self.places[n] for n in at]
        found._numbers, found._played = self._numbers[:, at], self._played.take(at)
        found._found = {key: values[at] for key, values in self._found.items()}
        return found
