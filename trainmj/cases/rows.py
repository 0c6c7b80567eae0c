"""What became of some cases, by column: status and reason, the responses as one matrix, the limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trainmj.collision.status import UNUSABLE, Kind
from trainmj.doe.arrays import FloatArray

if TYPE_CHECKING:
    from trainmj.collision.limits import Limited
    from trainmj.collision.quantities import Column

Key = int | str
"""What the caller calls a case."""

Row = dict[str, Any]
"""Status, reason and responses of a case by column name; the responses are missing where the case was refused."""

Values = Sequence[Any] | NDArray[Any]
"""A value for each case."""

STATUS = ("status", "reason")
"""Columns of every case, before its responses."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Cases of one structure that have been computed, or cases that have been refused.

    Attributes:
        keys: what the caller calls each of them, (n,).
        facts: status, reason, and what else is kept of each case, by the name of its column, (n,) each; None where
            there is nothing.
        columns: what the responses are, by name, in the order of the numbers.
        numbers: the responses (n, k); nan where one is no number.
        limits: every limit beside what was found; none of cases that were refused.
    """

    keys: Sequence[Any]
    facts: Mapping[str, Values]
    columns: Mapping[str, Column] = field(default_factory=dict)
    numbers: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    limits: tuple[Limited, ...] = ()

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self.keys)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """(n,) whether something may be concluded from the responses."""
        return np.array([kind not in UNUSABLE for kind in self.facts["status"]], dtype=bool)

    def row(self, place: int) -> Row:
        """The row of one case."""
        found = {name: values[place] for name, values in self.facts.items()}
        numbers = dict(zip(self.columns, self.numbers[place].tolist(), strict=True)) if self.columns else {}
        return {name: value for name, value in found.items() if value is not None} | numbers

    def beside(self, facts: Mapping[str, Values]) -> Rows:
        """The same rows with these facts before all others."""
        return replace(self, facts={**facts, **self.facts})


def refused(keys: Sequence[Any], reasons: Sequence[str]) -> Rows:
    """The rows of cases that break a rule."""
    return Rows(keys, {"status": [Kind.REFUSED.value] * len(keys), "reason": reasons})
