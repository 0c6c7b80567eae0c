"""Designs with their responses, as the steps of a study hand them on: as arrays, kept as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from trainmj.cases.rows import STATUS, Row
from trainmj.collision.status import UNUSABLE
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.study.plan import LIMITS, Study

if TYPE_CHECKING:
    import pandas as pd


class Simulates(Protocol):
    """What gives the responses of designs: a simulator, or statistics of many simulations of each."""

    @property
    def asks(self) -> list[Any]:
        """What its numbers depend on besides the scenarios and points, as JSON can hold it."""

    def at(self, points: FloatArray) -> Designs:
        """Simulate points (n, d) of the space."""

    def check(self, points: FloatArray) -> Designs:
        """Simulate points (n, d) as the check of the study asks."""

    def as_it_stands(self) -> dict[str, Row]:
        """Status, reason and responses by column of each load case, without the factors of the study."""


def governs(name: str) -> str:
    """Head of the column that says which load case an objective is of, or which limit is nearest."""
    return "nearest_limit" if name == LIMITS else f"{name}_governed_by"


@dataclass(frozen=True)
class Designs:
    """Designs with their responses, simulated or predicted."""

    study: Study
    points: FloatArray  # natural values, (n, d)
    responses: FloatArray  # (n, r); nan where a case failed
    status: Sequence[str] = ()  # of each simulation, (n,); empty for predictions
    reason: Sequence[str] = ()  # of each status, (n,)

    def __len__(self) -> int:
        """Number of designs."""
        return len(self.points)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each design has no usable responses: refused, unstable, not valid, or without one of them, (n,)."""
        return np.isin(self.status, UNUSABLE) | ~np.isfinite(self.responses).all(axis=1)

    def usable(self) -> tuple[FloatArray, FloatArray]:
        """Points (n, d) and responses (n, r) of the simulations whose responses may be used.

        Raises:
            InputError: if there are fewer than three of them.
        """
        good = ~self.failed
        if good.sum() >= 3:  # columns in one piece are added up most accurately
            return np.asfortranarray(self.points[good]), np.asfortranarray(self.responses[good])
        if good.all():
            raise InputError(f"the design has {len(self)} points, too few to go on: give three or more")
        said = f"only {int(good.sum())} of the {len(self)} cases of the design can be used, too few to go on"
        raise InputError(f"{said}; the first that failed is {self.first_failure}")

    @property
    def first_failure(self) -> str | None:
        """Status and reason of the first simulation that cannot be used, and what it has no number for."""
        failed = np.flatnonzero(self.failed)
        if not failed.size:
            return None
        k = failed[0]
        lost = [
            r.name for r, value in zip(self.study.responses, self.responses[k], strict=True) if not np.isfinite(value)
        ]
        without = "" if self.status[k] in UNUSABLE else f"{', '.join(lost)} came to no number"
        return f"{self.status[k]}: {'; '.join(filter(None, (self.reason[k], without)))}".rstrip(": ")

    def table(self) -> pd.DataFrame:
        """A row for each design: factors, status and reason if it was simulated, responses."""
        import pandas as pd

        parts = [self.study.space.table(self.points)]
        if len(self.status):
            parts.append(pd.DataFrame(dict(zip(STATUS, (self.status, self.reason), strict=True))))
        parts.append(pd.DataFrame(self.responses, columns=[r.head for r in self.study.responses]))
        if self.study.spec.cases:
            worst = self.study.with_worst(self.responses)[:, len(self.study.responses) :]
            parts.append(pd.DataFrame(worst, columns=[r.head for r in self.study.worst_of_cases]))
            rows = [{governs(name): case for name, case in row.items()} for row in self._governing()]
            parts.append(pd.DataFrame(rows))
        return pd.concat(parts, axis=1)

    def _governing(self) -> list[dict[str, str]]:
        """The load cases that govern each design; nothing of one that failed."""
        usable: list[bool] = np.asarray(np.isfinite(self.responses).all(axis=1)).tolist()
        found = self.study.governing(np.nan_to_num(self.responses))
        return [row if whole else {} for row, whole in zip(found, usable, strict=True)]

    @classmethod
    def read(cls, study: Study, table: pd.DataFrame) -> Designs:
        """The designs of a table that :meth:`table` made, to the last digit."""
        responses = table[[r.head for r in study.responses]].to_numpy(dtype=np.float64)
        simulated = [table[name].tolist() for name in STATUS if name in table.columns]
        return cls(study, study.space.from_table(table), responses, *simulated)
