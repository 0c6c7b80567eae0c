"""Cases of a scenario put together into lots: who takes the same way from its values to its numbers goes together."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from trainmj.collision.cases import Cases
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.lineup import line_up
from trainmj.collision.lot import Chains, Lot, structure_of
from trainmj.collision.traced import CANNOT, Trace, Traced
from trainmj.errors import InputError
from trainmj.scenario import Scenario
from trainmj.symbol import Tape

SIZE = 256
"""Most cases of a lot."""

_WORTH = 12  # cases of a kind that make up for a trace
_TRACES = 8  # that are kept of a kind
_KINDS = 64  # that are kept
_FAILURES = 3  # to make one, after which cases are computed alone

log = logging.getLogger(__name__)

Asked = Sequence[Callable[[Chain], Any]]


class Refused(NamedTuple):
    """A case that breaks a rule."""

    key: Hashable
    reason: str


class Lots:
    """What puts the cases of a scenario into lots; it keeps what it has found out about them from call to call."""

    def __init__(self, scenario: Scenario, asked: Asked = (), size: int = SIZE) -> None:
        """Take what the cases have in common.

        Args:
            scenario: which the cases change.
            asked: functions of a chain of which the values of a lot will be asked, so that its cases take the same way
                through these, too; for other functions, cases that do not are computed alone.
            size: most cases of a lot.
        """
        self._scenario, self._asked, self._size = scenario, asked, size
        self._kinds: dict[Hashable, _Kind] = {}
        self._fixed: dict[Hashable, set[int]] = {}  # by names

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Lot | Refused]:
        """Put cases into lots, some at a time, by one thread at a time.

        Yields:
            Lots, each of one structure, its cases in the order in which they came; and cases that break a rule.
        """
        for some in cases:
            names = tuple(some.names)
            if names not in self._fixed:
                self._fixed[names] = _fixed(self._scenario, some)
            table = _Table(some, self._fixed[names])
            for stated, places in table.by_stated().items():
                kind = self._kinds.pop((names, stated), None) or _Kind(self._scenario, self._asked)
                self._kinds[names, stated] = kind  # the latest one last
                if len(self._kinds) > _KINDS:
                    del self._kinds[next(iter(self._kinds))]
                for begin in range(0, len(places), self._size):
                    yield from kind.lots(table, places[begin : begin + self._size])


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
    found = {n for n, name in enumerate(cases.names) if _of_simulation(scenario, str(name[0]))}
    for place in range(min(len(cases), _WORTH)):
        while True:
            table, tape = _Table(cases, found), Tape()
            symbols = [tape.symbol(number) for number in table.numbers[:, place].tolist()]
            try:
                scenario.with_values(table.changes(place, symbols))
            except InputError:
                break  # another one may be valid
            except CANNOT as error:
                at = [
                    n for n, symbol in zip(table.at, symbols, strict=True) if symbol is getattr(error, "symbol", None)
                ]
                if not at:
                    return found
                found.update(at)
            else:
                return found
    return found


def _of_simulation(scenario: Scenario, name: str) -> bool:
    try:
        return any(place[0] == "simulation" for place in scenario.places(name))
    except InputError:
        return True  # leads nowhere


class _Kind:
    """Cases that differ in numbers only, as far as they state it: of one structure, or of a few."""

    def __init__(self, scenario: Scenario, asked: Asked) -> None:
        """Take the scenario, and what will be asked."""
        self._scenario, self._asked = scenario, asked
        self._traces: list[Trace] = []
        self._failed = 0  # attempts to make one
        self._alone = 0  # cases that were computed alone

    def lots(self, table: _Table, places: Sequence[int]) -> Iterator[Lot | Refused]:
        """Those of some of the cases of a table."""
        left = list(places)
        for trace in list(self._traces):
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
            new = self._trace(table, place, chain) if self._alone + len(left) >= _WORTH else None
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
            yield Chains(keys, chains)

    def _following(
        self, trace: Trace, table: _Table, places: list[int], first: Chain | None = None
    ) -> Generator[Lot, None, list[int]]:
        """The lot of those cases that follow a trace; what is left are the others.

        Of a new trace, whose first case has the chain that is given, and of some lots of each, cases are checked.
        """
        if not (places and trace.sound):
            return places
        lot = Traced(trace, table.cases, places, table.numbers[:, places])
        follow = lot.follows
        if not follow.any():
            return places
        if not follow.all():
            lot = lot.take(np.flatnonzero(follow).tolist())
        checked = {len(lot) - 1} if trace.due() else set[int]()
        if first is not None:
            checked |= {0, len(lot) // 2}
        for place in checked:
            if not trace.agrees(lot, place, first if place == 0 and first is not None else lot.chain_of(place)):
                return places
        yield lot
        return [place for place, follows in zip(places, follow.tolist(), strict=True) if not follows]

    def _trace(self, table: _Table, place: int, chain: Chain) -> Trace | None:
        """A new trace, of a case and its chain; None if there are enough, or it cannot be made."""
        if len(self._traces) == _TRACES or self._failed == _FAILURES:
            return None
        changes, numbers = partial(table.changes, place), table.numbers[:, place].tolist()
        try:
            trace = Trace(self._scenario, chain, changes, numbers, self._asked)
        except CANNOT as error:
            log.info("case %s cannot stand for others: %s", table.cases.keys[place], error)
            self._failed += 1
            return None
        self._traces.append(trace)
        self._alone = 0
        return trace
