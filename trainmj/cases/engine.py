"""What computes cases: this process here, or a cluster in :mod:`trainmj.cases.cluster`."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from trainmj.cases.rows import Limited, Rows, refused
from trainmj.collision.cases import Cases
from trainmj.collision.chain import Chain
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import fitting
from trainmj.errors import InputError
from trainmj.scenario import Scenario

if TYPE_CHECKING:
    from trainmj.collision.quantities import Column
    from trainmj.collision.summary import Summary

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
        from trainmj.collision.batch import run_chains  # loads MuJoCo and numba

        lost: deque[Rows] = deque()

        def chains() -> Iterator[tuple[Any, Chain]]:
            for some in cases:
                for key, changes in zip(some.keys, some, strict=True):
                    try:
                        chain = line_up(self.scenario.with_values(changes))
                    except InputError as error:
                        lost.append(refused([key], [str(error)]))
                    else:
                        yield key, chain

        wanted: dict[tuple[str, ...], Mapping[str, Column]] = {}
        for key, summary in run_chains(chains(), self.threads, channels=self.channels):
            names = tuple(summary.columns)
            if names not in wanted:
                wanted[names] = fitting(self.responses, summary.columns)
            yield _rows(key, summary, wanted[names])
            while lost:
                yield lost.popleft()
        yield from lost


def _rows(key: Any, summary: Summary, columns: Mapping[str, Column]) -> Rows:
    """The row of one case, with some of its responses."""
    values = {"status": [summary.status.kind.value], "reason": [summary.status.reason]}
    packed = {name: [trace.packed()] for name, trace in summary.channels.items()}
    numbers = np.array([[summary.responses[name] for name in columns]], dtype=np.float64)
    return Rows([key], {**values, **packed}, columns, numbers, tuple(Limited.of([one]) for one in summary.limits))
