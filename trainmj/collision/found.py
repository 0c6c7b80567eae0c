"""The numbers of the cases of a lot: responses and limits as arrays, and how each case ended."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.channels import Trace, traces_of
from trainmj.collision.ending import Endings
from trainmj.collision.envelope import Array, BoolArray
from trainmj.collision.limits import Limited, limits_of
from trainmj.collision.measured import Measured
from trainmj.collision.quantities import Column, Values

if TYPE_CHECKING:
    from trainmj.collision.summary import Summary


class Found:
    """The numbers of the cases of a lot; each of them has the bits that it has alone.

    Attributes:
        measured: what the collisions left behind.
        values: every quantity, computed when it is asked for.
        columns: the responses that are wanted, by name, in the order of tables.
        limits: every limit beside what was found: those of the scenario, then the strokes of stages.
        endings: how each case ended.
    """

    def __init__(self, measured: Measured, wanted: Collection[str] | None = None) -> None:
        """Take what was measured.

        Args:
            measured: what the collisions left behind.
            wanted: names of the columns that are; all without. No quantity is computed that they, the limits and the
                status do not need.
        """
        self.measured, self.values = measured, Values(measured)
        self.columns: Mapping[str, Column] = self.values.columns
        if wanted is not None:
            self.columns = {name: column for name, column in self.columns.items() if name in wanted}
        with np.errstate(all="ignore"):  # of a case that is unstable
            self.limits: tuple[Limited, ...] = limits_of(measured, self.values)
        self.endings = Endings(measured, self.limits)

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self.measured)

    @property
    def keys(self) -> Sequence[Any]:
        """(n_case,) what the caller calls each case."""
        return self.measured.lot.keys

    @property
    def kinds(self) -> list[str]:
        """(n_case,) status of each, in a word."""
        return [kind.value for kind in self.endings.kinds]

    @cached_property
    def reasons(self) -> list[str]:
        """(n_case,) what stands beside it in a table."""
        return [self.endings.of(case).reason for case in range(len(self))]

    @property
    def over(self) -> BoolArray:
        """(n_case,) whether no device was pressed any more; otherwise the time limit cut it off."""
        return self.measured.tally.is_over

    @cached_property
    @np.errstate(all="ignore")
    def numbers(self) -> Array:
        """(n_case, n_column) the responses, in the order of the columns."""
        return self.values.in_columns(self.columns)

    def channels(self, names: Sequence[str]) -> list[dict[str, Trace]]:
        """(n_case,) those of these channels that the cases have, by name."""
        if not names:
            return [{} for _ in range(len(self))]
        chain = self.measured.chain
        return [traces_of(chain, velocity, cut, names) for _, velocity, cut in self.measured.histories]

    def summary(self, case: int) -> Summary:
        """All numbers of one case."""
        from trainmj.collision.summary import summary_of  # which builds on this

        return summary_of(self, case)
