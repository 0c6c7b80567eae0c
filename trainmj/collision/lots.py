"""Cases of a scenario put together into lots: who takes the same way from its values to its numbers goes together."""

from __future__ import annotations

import logging
from collections.abc import Generator, Hashable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

from trainmj.collision.cases import Cases, Name
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.lineup import line_up
from trainmj.collision.lot import Chains, Lot, structure_of
from trainmj.collision.played import RAISED
from trainmj.collision.traced import Trace, Traced
from trainmj.errors import InputError
from trainmj.scenario import Scenario
from trainmj.symbol import Tape

SIZE = 128
"""Most cases of a lot: as many as a thread of a batch has places for."""

_WORTH = 12  # cases of a kind that make up for a trace
_TRACES = 8  # that are kept of a kind
_KEPT = 64  # kinds that are kept
_FAILURES = 3  # to make one, after which cases are computed alone

log = logging.getLogger(__name__)

T = TypeVar("T")


class Refused(NamedTuple):
    """A case that breaks a rule."""

    key: Hashable
    reason: str


class Lots:
    """What puts the cases of a scenario into lots; it keeps what it has found out about them from call to call."""

    def __init__(self, scenario: Scenario, size: int = SIZE) -> None:
        """Take the scenario, which the cases change, and the most cases of a lot."""
        self._scenario, self._size = scenario, size
        self._kinds: dict[Hashable, _Kind] = {}
        self._fixed: dict[Hashable, set[int]] = {}  # by names

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Lot | Refused]:
        """Put cases into lots, some at a time, by one thread at a time.

        Yields:
            Lots, each of one structure, its cases in the order in which they came; and cases that break a rule.
        """
        for some in map(_spread, cases):
            names = tuple(some.names)
            fixed = self._fixed.get(names)
            if fixed is None:
                fixed = _kept(self._fixed, names, _fixed(self._scenario, some))
            table = _Table(some, fixed)
            for stated, places in table.by_stated().items():
                kind = self._kinds.pop((names, stated), None) or _Kind(self._scenario, self._size)
                yield from _kept(self._kinds, (names, stated), kind).lots(table, places)


def _kept(latest: dict[Hashable, T], key: Hashable, value: T) -> T:
    """A value, which is kept among the latest ones."""
    latest[key] = value
    if len(latest) > _KEPT:
        del latest[next(iter(latest))]
    return value


def _spread(cases: Cases) -> Cases:
    """The same cases, groups and lists that all of them state alike as columns of what is in them."""
    found: list[tuple[Name, Sequence[Any] | np.ndarray]] = []
    open_ = list(zip(cases.names, cases.values, strict=True))[::-1]
    while open_:
        name, column = open_.pop()
        keys = [] if isinstance(column, np.ndarray) else _keys_of_all(column)
        open_ += [((*name, key), [value[key] for value in column]) for key in keys[::-1]]
        if not keys:
            found.append((name, column))
    return Cases(cases.keys, [name for name, _ in found], [column for _, column in found])


def _keys_of_all(column: Sequence[Any]) -> list[Any]:
    """The keys of groups, or the positions in lists, that are the same in all of a column; none if they are not."""
    first = column[0] if len(column) else None
    if isinstance(first, dict):
        keys = list(first)
        return keys if all(isinstance(value, dict) and list(value) == keys for value in column) else []
    if isinstance(first, list):
        return list(range(len(first))) if all(isinstance(v, list) and len(v) == len(first) for v in column) else []
    return []


class _Table:
    """Cases that change the same values: numbers, in which cases of a lot differ, and what all cases of one share."""

    def __init__(self, cases: Cases, fixed: set[int]) -> None:
        """Take the cases, and which of their columns are no such numbers."""
        found = {n: _as_numbers(column) for n, column in enumerate(cases.values) if n not in fixed}
        self.cases = cases
        self.at = [n for n, numbers in found.items() if numbers is not None]
        self.numbers: Array = np.array([found[n] for n in self.at]).reshape(len(self.at), len(cases))

    def by_stated(self) -> dict[Hashable, list[int]]:
        """The places of cases by all that they change but numbers."""
        others = [column for n, column in enumerate(self.cases.values) if n not in self.at]
        if not others:
            return {tuple(self.at): list(range(len(self.cases)))}
        found: dict[Hashable, list[int]] = {}
        for place, values in enumerate(zip(*others, strict=True)):
            found.setdefault((tuple(self.at), repr(values)), []).append(place)
        return found

    def changes(self, place: int, numbers: Sequence[Any]) -> Mapping[str, Any]:
        """What a case changes, with other numbers, or symbols, in place of its own."""
        values = [column[place] for column in self.cases.values]
        for n, number in zip(self.at, numbers, strict=True):
            values[n] = number
        return Cases([self.cases.keys[place]], self.cases.names, [[value] for value in values])[0]


def _as_numbers(column: Sequence[Any] | Array) -> Array | None:
    """A column as an array of numbers; None if it is something else."""
    if isinstance(column, np.ndarray):
        return column.astype(np.float64, copy=False) if column.dtype.kind in "fiu" else None
    if not set(map(type, column)) <= {float, int, np.float64}:
        return None
    try:
        return np.array(column, dtype=np.float64)
    except OverflowError:
        return None


def _fixed(scenario: Scenario, cases: Cases) -> set[int]:
    """Which columns are values that are no number in a valid scenario, or by which its simulation is laid out."""
    found = {n for n, name in enumerate(cases.names) if _laid_out(scenario, str(name[0]))}
    for place in range(min(len(cases), _WORTH)):
        while True:
            table, tape = _Table(cases, found), Tape()
            symbols = [tape.symbol(number) for number in table.numbers[:, place].tolist()]
            try:
                scenario.with_values(table.changes(place, symbols))
            except InputError:
                break  # another one may be valid
            except RAISED as error:
                at = [
                    n for n, symbol in zip(table.at, symbols, strict=True) if symbol is getattr(error, "symbol", None)
                ]
                if not at:
                    return found
                found.update(at)
            else:
                return found
    return found


def _laid_out(scenario: Scenario, name: str) -> bool:
    """Whether a simulation, or what its results are called, is laid out by a value."""
    try:
        return any(place[0] in ("simulation", "occupants") for place in scenario.places(name))
    except InputError:
        return True  # leads nowhere


class _Kind:
    """Cases that differ in numbers only, as far as they state it: of one structure, or of a few."""

    def __init__(self, scenario: Scenario, size: int) -> None:
        """Take the scenario, and the most cases of a lot."""
        self._scenario, self._size = scenario, size
        self._traces: list[Trace] = []  # the latest one last
        self._failed = 0  # attempts to make one
        self._alone = 0  # cases that were computed alone since the latest one

    def lots(self, table: _Table, places: Sequence[int]) -> Iterator[Lot | Refused]:
        """Those of some of the cases of a table."""
        left = list(places)
        for trace in sorted(self._traces, key=lambda trace: -trace.n_cases):
            left = yield from self._following(trace, table, left)
        alone: dict[Hashable, tuple[list[Hashable], list[Chain]]] = {}
        while left:
            place, key = left[0], table.cases.keys[left[0]]
            try:
                chain = line_up(self._scenario.with_values(table.cases[place]))
            except InputError as error:
                yield Refused(key, str(error))
                del left[0]
                continue
            new = self._traced(table, place, chain) if self._worth(len(left)) else None
            if new is not None:
                left = yield from self._following(new, table, left, chain)
                if new.sound:
                    continue
            keys, chains = alone.setdefault(structure_of(chain), ([], []))
            keys.append(key)
            chains.append(chain)
            self._alone += 1
            del left[0]
        for keys, chains in alone.values():
            for n in range(0, len(keys), self._size):
                yield Chains(keys[n : n + self._size], chains[n : n + self._size])

    def _following(
        self, trace: Trace, table: _Table, places: list[int], first: Chain | None = None
    ) -> Generator[Lot, None, list[int]]:
        """Lots of those cases that follow a trace; the others are left. The first chain is that of a new trace."""
        left: list[int] = []
        waiting: list[int] = []  # to fill a lot
        for n in range(0, len(places), self._size):
            some = places[n : n + self._size]
            lot = Traced(trace, table.cases, some, table.numbers[:, some])
            follow = lot.follows.tolist()
            left += [place for place, follows in zip(some, follow, strict=True) if not follows]
            if not waiting and all(follow):
                ready = [lot]
            else:
                waiting += [place for place, follows in zip(some, follow, strict=True) if follows]
                ready = []
            last = n + self._size >= len(places)
            while len(waiting) >= self._size or (waiting and last):
                some, waiting = waiting[: self._size], waiting[self._size :]
                ready.append(Traced(trace, table.cases, some, table.numbers[:, some]))
            for lot in ready:
                if self._holds(trace, lot, first):
                    trace.n_cases += len(lot)
                    yield lot
                else:
                    left += lot.places
                first = None
        return sorted(left)

    def _holds(self, trace: Trace, lot: Traced, first: Chain | None) -> bool:
        """Whether a lot is what its cases are alone: of a new trace some are compared, and of some lots one."""
        if not trace.sound:
            return False
        checked: dict[int, Chain | None] = {len(lot) - 1: None} if trace.due() else {}
        if first is not None:
            checked |= {len(lot) // 2: None, 0: first}
        if all(trace.agrees(lot, place, chain or lot.chain_of(place)) for place, chain in checked.items()):
            return True
        self._traces.remove(trace)
        self._failed += 1
        return False

    def _worth(self, n: int) -> bool:
        """Whether another trace may be worth its while, with so many cases at hand."""
        if self._failed == _FAILURES:
            return False
        return self._alone + (n if len(self._traces) < _TRACES else 0) >= _WORTH

    def _traced(self, table: _Table, place: int, chain: Chain) -> Trace | None:
        """A new trace, of a case and its chain; None if it cannot be made."""
        changes, numbers = partial(table.changes, place), table.numbers[:, place].tolist()
        try:
            trace = Trace(self._scenario, chain, changes, numbers)
        except RAISED as error:
            log.info("case %s cannot stand for others: %s", table.cases.keys[place], error)
            self._failed += 1
            return None
        self._traces = [*self._traces[1 - _TRACES :], trace]
        self._alone = 0
        return trace
