"""What computes cases: this process here, or a cluster in :mod:`trainmj.cases.cluster`."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from trainmj.collision.chain import Chain
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.collision.status import Kind
from trainmj.errors import InputError
from trainmj.scenario import Scenario

if TYPE_CHECKING:
    from trainmj.collision.limits import Criterion
    from trainmj.collision.quantities import Column

Key = int | str
"""What the caller calls a case."""

Case = Mapping[str, Any]
"""New values by parameter or path."""

Row = dict[str, Any]
"""Status, reason and responses of a case by column name; the responses are missing where the case was refused."""


class Computed(NamedTuple):
    """A case that has been computed or refused; the columns are those of its responses, by name."""

    key: Any
    row: Row
    columns: Mapping[str, Column]
    limits: tuple[Criterion, ...] = ()  # every limit beside what was found; none of a case that was refused


class Engine(Protocol):
    """Computes cases."""

    @property
    def identity(self) -> Mapping[str, str]:
        """What computes the cases: :func:`trainmj.collision.identity.identity` there."""

    def __call__(self, cases: Iterable[tuple[Any, Case]]) -> Iterator[Computed]:
        """Take cases, each a key and its changes, as they are needed, and yield each as it ends, in any order."""

    def of(self, scenario: Scenario) -> Engine:
        """The same for cases of another scenario."""


@dataclass(frozen=True)
class Local:
    """Computes cases of a scenario in this process."""

    scenario: Scenario
    threads: int = 0  # native ones; 0 for all cores
    channels: Sequence[str] = ()  # that rows have too, packed, under their names
    identity: Mapping[str, str] = field(default_factory=identity)

    def of(self, scenario: Scenario) -> Local:
        """The same for cases of another scenario."""
        return replace(self, scenario=scenario)

    def __call__(self, cases: Iterable[tuple[Any, Case]]) -> Iterator[Computed]:
        """Compute cases; one that breaks a rule is a row with its reason."""
        from trainmj.collision.batch import run_chains  # loads MuJoCo and numba

        refused: deque[Computed] = deque()

        def chains() -> Iterator[tuple[Any, Chain]]:
            for key, changes in cases:
                try:
                    chain = line_up(self.scenario.with_values(changes))
                except InputError as error:
                    refused.append(Computed(key, {"status": Kind.REFUSED.value, "reason": str(error)}, {}))
                else:
                    yield key, chain

        for key, summary in run_chains(chains(), self.threads, channels=self.channels):
            packed = {name: trace.packed() for name, trace in summary.channels.items()}
            yield Computed(key, summary.row() | packed, summary.columns, summary.limits)
            while refused:
                yield refused.popleft()
        yield from refused
