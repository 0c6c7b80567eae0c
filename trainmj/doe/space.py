"""Factors and the space they span: names, units, bounds, levels, and the scaling between natural and coded values.

    space = Space((Factor("D", 20, 50, unit="mm", kind="integer", path="empty_stroke_mm"),
                   Factor("M", 30, 36, unit="t", path="mass_t")))
    X = space.from_unit(U)          # [0, 1] -> natural values, integers rounded
    space.decode(X[0])              # {'D': 35, 'M': 33.0}

A point is a row of floats throughout. A choice is stored as the position of its level (0, 1, ...), an integer as a
whole number; `Space.decode` gives the values that a scenario understands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import FloatArray, as_matrix
from trainmj.errors import InputError, close_match

if TYPE_CHECKING:
    import pandas as pd

Kind = Literal["continuous", "integer", "choice"]
Level = str | float | int | bool


@dataclass(frozen=True)
class Factor:
    """One thing that is varied.

    Attributes:
        name: symbol, unique in its space.
        lower: smallest value, in ``unit``; leave out for a choice.
        upper: largest value, in ``unit``; leave out for a choice.
        unit: unit of the values; empty if they have none.
        kind: continuous, integer (whole numbers) or choice (one of ``levels``).
        levels: the values of a choice, in the order in which they are coded 0, 1, ...
        path: what the factor sets; the study only keeps it for the caller.
    """

    name: str
    lower: float = math.nan
    upper: float = math.nan
    unit: str = ""
    kind: Kind = "continuous"
    levels: tuple[Level, ...] = ()
    path: str = ""

    def __post_init__(self) -> None:
        """Check the fields; a choice gets the bounds of its codes.

        Raises:
            InputError: unknown kind, bounds missing or out of order, an integer with broken bounds, levels where none
                belong.
        """
        where = f"factor {self.name!r}"
        if not self.name:
            raise InputError("a factor must have a name (got '')")
        kinds = ("continuous", "integer", "choice")
        if self.kind not in kinds:
            raise InputError(
                f"{where}: kind must be in {kinds} (got {self.kind!r}){close_match(str(self.kind), kinds)}"
            )
        if self.kind == "choice":
            self._check_choice(where)
            return
        if self.levels:
            raise InputError(f"{where}: levels belong to kind='choice' (got {self.levels} with kind={self.kind!r})")
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower < self.upper):
            raise InputError(
                f"{where}: bounds must be finite with lower < upper (got {self.lower}, {self.upper}); "
                "a value that does not vary is no factor"
            )
        if self.kind == "integer" and not (float(self.lower).is_integer() and float(self.upper).is_integer()):
            raise InputError(f"{where}: bounds of an integer must be whole numbers (got {self.lower}, {self.upper})")

    def _check_choice(self, where: str) -> None:
        levels = tuple(self.levels)
        if len(levels) < 2 or len(set(levels)) != len(levels):
            raise InputError(f"{where}: a choice needs at least two different levels (got {levels})")
        codes = (0.0, float(len(levels) - 1))
        if not all(math.isnan(b) or b == c for b, c in zip((self.lower, self.upper), codes, strict=True)):
            raise InputError(
                f"{where}: a choice has levels, not bounds (got {self.lower}, {self.upper}); leave the bounds out"
            )
        for field, value in zip(("levels", "lower", "upper"), (levels, *codes), strict=True):
            object.__setattr__(self, field, value)

    @property
    def label(self) -> str:
        """Name with its unit, as a table head: ``D [mm]``."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def count(self) -> int | None:
        """How many values an integer or a choice can take; None for a continuous factor."""
        return None if self.kind == "continuous" else int(self.upper - self.lower) + 1

    def decode(self, value: float) -> Level:
        """Give the value that the factor's path is set to: a float, an int or a level."""
        if self.kind == "continuous":
            return float(value)
        return self.levels[round(value)] if self.kind == "choice" else round(value)


@dataclass(frozen=True)
class Space:
    """The box that d factors span.

    Attributes:
        factors: the factors, in the order of the columns of every design.
    """

    factors: tuple[Factor, ...]

    def __post_init__(self) -> None:
        """Check that there are factors and that their names differ.

        Raises:
            InputError: no factor, or one name twice.
        """
        object.__setattr__(self, "factors", tuple(self.factors))
        if not self.factors:
            raise InputError("a space needs at least one factor (got none)")
        if len(set(self.names)) != len(self.names):
            raise InputError(f"factor names must differ from each other (got {list(self.names)})")

    @property
    def d(self) -> int:
        """Number of factors."""
        return len(self.factors)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the factors, (d,)."""
        return tuple(f.name for f in self.factors)

    @property
    def lower(self) -> FloatArray:
        """Lower bounds, (d,)."""
        return np.array([f.lower for f in self.factors], dtype=np.float64)

    @property
    def upper(self) -> FloatArray:
        """Upper bounds, (d,)."""
        return np.array([f.upper for f in self.factors], dtype=np.float64)

    @property
    def discrete(self) -> tuple[int, ...]:
        """Columns of the factors that take whole numbers."""
        return tuple(i for i, f in enumerate(self.factors) if f.kind != "continuous")

    def factor(self, name: str) -> Factor:
        """Give the factor of that name.

        Raises:
            InputError: there is none; the message offers the nearest.
        """
        for factor in self.factors:
            if factor.name == name:
                return factor
        raise InputError(f"no factor {name!r}{close_match(name, self.names)}")

    def to_unit(self, x: ArrayLike) -> FloatArray:
        """Scale natural values (n, d) to [0, 1]."""
        return (as_matrix("points", x, self.d) - self.lower) / (self.upper - self.lower)

    def from_unit(self, u: ArrayLike) -> FloatArray:
        """Scale [0, 1] (n, d) to natural values; integers and choices go to the nearest."""
        return self.round(self.lower + as_matrix("unit points", u, self.d) * (self.upper - self.lower))

    def from_quantile(self, u: ArrayLike) -> FloatArray:
        """Map uniform numbers (n, d) in [0, 1) to natural values; levels of an integer or choice get equal shares."""
        u = as_matrix("unit points", u, self.d)
        x = self.lower + u * (self.upper - self.lower)
        for i in self.discrete:
            count = self.factors[i].count or 1
            x[:, i] = self.lower[i] + np.minimum(np.floor(u[:, i] * count), count - 1)
        return self.round(x)

    def to_coded(self, x: ArrayLike) -> FloatArray:
        """Scale natural values (n, d) to [-1, 1]."""
        return 2.0 * self.to_unit(x) - 1.0

    def from_coded(self, z: ArrayLike) -> FloatArray:
        """Scale [-1, 1] (n, d) to natural values; integers and choices go to the nearest."""
        return self.from_unit((as_matrix("coded points", z, self.d) + 1.0) / 2.0)

    def round(self, x: ArrayLike) -> FloatArray:
        """Bring points (n, d) into the bounds, integers and choices to the nearest whole number."""
        x = np.clip(as_matrix("points", x, self.d), self.lower, self.upper)
        for i in self.discrete:
            x[:, i] = np.floor(x[:, i] + 0.5)  # halves always up: np.rint would favour even levels
        return x

    def check(self, x: ArrayLike, *, name: str = "points") -> FloatArray:
        """Give points (n, d) back if each lies in the bounds and on its levels.

        Raises:
            InputError: naming the first factor and point that do not.
        """
        x = as_matrix(name, x, self.d)
        slack = 1e-9 * (self.upper - self.lower)
        outside = (x < self.lower - slack) | (x > self.upper + slack)
        broken = np.zeros_like(outside)
        for i in self.discrete:
            broken[:, i] = np.abs(x[:, i] - np.rint(x[:, i])) > 1e-9
        for bad, rule in ((outside, "lie in [{0:g}, {1:g}]"), (broken, "be a whole number in [{0:g}, {1:g}]")):
            if bad.any():
                row, column = np.argwhere(bad)[0]
                factor = self.factors[column]
                text = rule.format(factor.lower, factor.upper)
                raise InputError(f"{name}[{row}], factor {factor.name!r}: must {text} (got {x[row, column]:g})")
        return self.round(x)

    def decode(self, point: ArrayLike) -> dict[str, Level]:
        """Give one point (d,) as what a scenario is set to: {name: float, int or level}."""
        row = as_matrix("point", np.reshape(np.asarray(point, dtype=np.float64), (1, -1)), self.d)[0]
        return {f.name: f.decode(float(v)) for f, v in zip(self.factors, row, strict=True)}

    def table(self, x: ArrayLike) -> pd.DataFrame:
        """Give points (n, d) as a table: one column a factor, heads with units, choices by their level."""
        import pandas as pd

        rows = [self.decode(row) for row in as_matrix("points", x, self.d)]
        return pd.DataFrame({f.label: [row[f.name] for row in rows] for f in self.factors})

    def from_table(self, table: pd.DataFrame) -> FloatArray:
        """Read points (n, d) from a table whose heads are the factors' names, or names with units.

        Raises:
            InputError: a factor has no column, or a value is not one of its levels.
        """
        heads: Sequence[str] = [str(c) for c in table.columns]
        columns = []
        for factor in self.factors:
            known = [h for h in heads if h in (factor.name, factor.label)]
            if not known:
                raise InputError(
                    f"the table has no column {factor.name!r} or {factor.label!r}{close_match(factor.name, heads)}"
                )
            columns.append(_codes(factor, list(table[known[0]])))
        return self.check(np.stack(columns, axis=1), name="table")


def _codes(factor: Factor, values: list[Level]) -> FloatArray:
    """Give a table's column (n,) as the factor's numbers."""
    if factor.kind == "choice":
        unknown = [v for v in values if v not in factor.levels]
        if unknown:
            names = [str(v) for v in factor.levels]
            raise InputError(f"factor {factor.name!r}: no level {unknown[0]!r}{close_match(str(unknown[0]), names)}")
        return np.array([factor.levels.index(v) for v in values], dtype=np.float64)
    return as_matrix(f"column {factor.name!r}", values, 1)[:, 0]
