"""What computes cases: this process here, or a cluster in :mod:`trainmj.cases.cluster`."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Protocol

from trainmj.cases.rows import Rows, Values, refused
from trainmj.collision.cases import Cases
from trainmj.collision.chain import Chain
from trainmj.collision.identity import identity
from trainmj.collision.lot import Lot
from trainmj.collision.lots import SIZE, Lots, Refused
from trainmj.collision.quantities import columns_of, fitting
from trainmj.scenario import Scenario

if TYPE_CHECKING:
    from trainmj.collision.measured import Measured

ALL: Sequence[str] = ("*",)
"""The pattern of all responses."""


class Engine(Protocol):
    """Computes cases."""

    @property
    def identity(self) -> Mapping[str, str]:
        """What computes the cases: :func:`trainmj.collision.identity.identity` there."""

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Rows]:
        """Take cases as they are needed, and yield some at a time as they end, in any order."""

    def of(self, scenario: Scenario, responses: Sequence[str] = ALL) -> Engine:
        """The same for cases of another scenario, and the responses that names or patterns choose."""


@dataclass(frozen=True)
class Local:
    """Computes cases of a scenario in this process."""

    scenario: Scenario
    threads: int = 0  # native ones; 0 for all cores
    channels: Sequence[str] = ()  # that rows have too, packed, under their names
    responses: Sequence[str] = ALL  # that rows have, by name or pattern
    identity: Mapping[str, str] = field(default_factory=identity)

    def of(self, scenario: Scenario, responses: Sequence[str] = ALL) -> Local:
        """The same for cases of another scenario, and the responses that names or patterns choose."""
        return replace(self, scenario=scenario, responses=responses)

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Rows]:
        """Compute cases; one that breaks a rule is a row with its reason."""
        from trainmj.collision.batch import run_lots  # loads MuJoCo

        lost: deque[Refused] = deque()

        def accepted() -> Iterator[Lot]:
            for lot in self._lots(cases):
                if isinstance(lot, Refused):
                    lost.append(lot)
                else:
                    yield lot

        for rows in run_lots(accepted(), self._rows, self.threads):
            yield rows
            if lost:
                yield _refused(lost)
        if lost:
            yield _refused(lost)

    @cached_property
    def _lots(self) -> Lots:
        """Puts cases into lots; what it has found out about them serves the next ones, too."""
        return Lots(self.scenario, size=SIZE)

    def _rows(self, measured: Measured) -> Rows:
        """The rows of some cases."""
        from trainmj.collision.found import Found  # loads the law

        found = Found(measured, self._wanted(measured.chain))
        facts: dict[str, Values] = {"status": found.kinds, "reason": found.reasons}
        traces = found.channels(self.channels)
        for name in self.channels:
            if any(name in kept for kept in traces):
                facts[name] = [kept[name].packed() if name in kept else None for kept in traces]
        return Rows(found.keys, facts, found.columns, found.numbers, found.limits)

    @cached_property
    def _wanted(self) -> Callable[[Chain], Collection[str]]:
        """Gives the names of the columns that are wanted of a chain; lots of one structure have the same one."""
        return lru_cache(maxsize=8)(lambda chain: fitting(self.responses, columns_of(chain)))


def _refused(lost: deque[Refused]) -> Rows:
    """The rows of all cases that are there; they are taken away."""
    some = [lost.popleft() for _ in range(len(lost))]
    return refused([case.key for case in some], [case.reason for case in some])
