"""One number that is known without this program, beside the one it computes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from trainmj.files.written import finite


class Kind(StrEnum):
    """How a tolerance is meant; AT_LEAST lets the number found be any amount above the one expected."""

    RELATIVE = "relative"
    ABSOLUTE = "absolute"
    AT_LEAST = "at least"


@dataclass(frozen=True)
class Check:
    """A number found beside the one expected."""

    case: str  # the collision or property
    what: str  # the quantity that is compared
    expected: float  # known from elsewhere
    found: float  # by this program
    tolerance: float  # a share of expected, or in its unit
    kind: Kind = Kind.RELATIVE  # how the tolerance is meant
    unit: str = ""  # of expected and found

    @property
    def passed(self) -> bool:
        """Whether found is within the tolerance; a value that is not finite never is."""
        if not np.isfinite(self.found):
            return False
        if self.kind is Kind.AT_LEAST:
            return bool(self.found >= self.expected - self.tolerance)
        return bool(abs(self.found - self.expected) <= self._room)

    @property
    def nearest_end(self) -> float:
        """The end of what passes that is nearest to the number found, beside which it is read."""
        upper = self.kind is not Kind.AT_LEAST and self.found > self.expected
        return self.expected + self._room if upper else self.expected - self._room

    @property
    def _room(self) -> float:
        """The tolerance in the unit of the number."""
        return self.tolerance * abs(self.expected) if self.kind is Kind.RELATIVE else self.tolerance

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj verify --json`` prints them."""
        numbers = {name: float(getattr(self, name)) for name in ("expected", "found", "tolerance")}
        plain: dict[str, Any] = finite(asdict(self) | numbers | {"passed": self.passed})
        return plain


def zero(case: str, what: str, found: float, most: float, unit: str = "") -> Check:
    """A check of what should be 0: a difference, an error; most is its tolerance, in its unit."""
    return Check(case, what, 0.0, found, most, Kind.ABSOLUTE, unit)


def at_least(case: str, what: str, least: float, found: float, unit: str = "") -> Check:
    """A check of what should be this or more."""
    return Check(case, what, least, found, 0.0, Kind.AT_LEAST, unit)


def furthest(found: ArrayLike, expected: ArrayLike, scale: ArrayLike | None = None) -> float:
    """Largest |found - expected| over arrays, each over its own scale; by default over |expected|, 0 counting as 1."""
    a, b = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    if a.shape != b.shape:
        return float("nan")
    by = np.where(b == 0.0, 1.0, np.abs(b)) if scale is None else np.asarray(scale, dtype=float)
    return float(np.max(np.abs(a - b) / by))


def alike(
    case: str,
    what: str,
    found: ArrayLike,
    expected: ArrayLike,
    most: float,
    scale: ArrayLike | None = None,
    unit: str = "",
) -> Check:
    """A check of arrays that should be equal; most is the largest difference that passes, as :func:`furthest` finds it.

    A unit is that of the scale, where the difference is not relative.
    """
    said = f"{what}, largest difference{'' if unit else ', relative'}"
    return zero(case, said, furthest(found, expected, scale), most, unit)
