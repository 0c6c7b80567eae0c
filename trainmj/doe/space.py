"""Factors and the space they span: names, units, bounds, levels, and scaling between natural and coded values.

    space = Space((Factor("D", 20, 50, unit="mm", kind="integer"), Factor("M", 30, 36, unit="t")))
    X = space.from_unit(U)          # [0, 1] -> natural values, integers rounded
    space.table(X)                  # columns D_mm, M_t

A point is a row of floats throughout. A choice is stored as the position of its level (0, 1, ...), an integer as a
whole number; `Space.decode` and `Space.table` give the values themselves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, check_choice
from trainmj.errors import InputError, close_match
from trainmj.units import against, head

if TYPE_CHECKING:
    import pandas as pd

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
    """

    name: str
    lower: float = math.nan
    upper: float = math.nan
    unit: str = ""
    kind: Literal["continuous", "integer", "choice"] = "continuous"
    levels: tuple[Level, ...] = ()

    def __post_init__(self) -> None:
        """Raise InputError for fields that do not fit each other; a choice gets the bounds of its codes."""
        where = f"factor {self.name!r}"
        if not self.name:
            raise InputError("a factor must have a name (got '')")
        check_choice(f"{where}: kind", self.kind, ("continuous", "integer", "choice"))
        if self.kind == "choice":
            self._check_choice(where)
            return
        if self.levels:
            raise InputError(f"{where}: levels belong to kind='choice' (got {self.levels} with kind={self.kind!r})")
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower < self.upper):
            raise InputError(
                f"{where}: bounds must be finite with lower < upper (got {self.lower}, {self.upper}); "
                "a value that does not vary is not a factor"
            )
        if self.kind == "integer" and not (float(self.lower).is_integer() and float(self.upper).is_integer()):
            raise InputError(f"{where}: bounds of an integer must be whole numbers (got {self.lower}, {self.upper})")

    def _check_choice(self, where: str) -> None:
        levels = tuple(self.levels)
        different = min(len(set(levels)), len({str(level) for level in levels}))  # 1 and "1" look alike in a file
        if len(levels) < 2 or different != len(levels):
            raise InputError(f"{where}: a choice needs at least two different levels (got {levels})")
        codes = (0.0, float(len(levels) - 1))
        if not all(math.isnan(b) or b == c for b, c in zip((self.lower, self.upper), codes, strict=True)):
            raise InputError(
                f"{where}: a choice has levels, not bounds (got {self.lower}, {self.upper}); leave the bounds out"
            )
        for field, value in zip(("levels", "lower", "upper"), (levels, *codes), strict=True):
            object.__setattr__(self, field, value)

    @property
    def head(self) -> str:
        """Head of its column in tables: ``D_mm``."""
        return head(self.name, self.unit)

    @property
    def count(self) -> int | None:
        """How many values an integer or a choice can take; None for a continuous factor."""
        return None if self.kind == "continuous" else int(self.upper - self.lower) + 1

    def decode(self, value: float) -> Level:
        """The value that a coordinate stands for: a float, an int or a level."""
        if self.kind == "continuous":
            return float(value)
        return self.levels[round(value)] if self.kind == "choice" else round(value)

    def encode(self, values: Sequence[Level]) -> FloatArray:
        """The coordinates (n,) of values; levels of a choice may be given as text.

        Raises:
            InputError: a value that is not a number, or not one of the levels.
        """
        if self.kind != "choice":
            return as_matrix(f"column {self.name!r}", values, 1)[:, 0]
        codes: dict[Level, int] = {str(level): code for code, level in enumerate(self.levels)}
        codes |= {level: code for code, level in enumerate(self.levels)}  # 30.0 is the level 30, whatever its text
        unknown = [value for value in values if value not in codes]
        if unknown:
            known = [str(level) for level in self.levels]
            raise InputError(f"factor {self.name!r}: no level {unknown[0]!r}{close_match(str(unknown[0]), known)}")
        return np.array([codes[value] for value in values], dtype=np.float64)


@dataclass(frozen=True)
class Space:
    """The box that d factors span.

    Attributes:
        factors: the factors, in the order of the columns of every design.
    """

    factors: tuple[Factor, ...]

    def __post_init__(self) -> None:
        """Raise InputError if there is no factor, or a name or head occurs twice."""
        object.__setattr__(self, "factors", tuple(self.factors))
        if not self.factors:
            raise InputError("a space needs at least one factor (got none)")
        heads = [f.head for f in self.factors]
        if min(len(set(self.names)), len(set(heads))) < self.d:
            raise InputError(f"factor names must differ from each other, with and without their units (got {heads})")

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
    def discrete(self) -> NDArray[np.bool_]:
        """Which factors take whole numbers only, (d,)."""
        return np.array([f.kind != "continuous" for f in self.factors])

    def to_unit(self, x: ArrayLike) -> FloatArray:
        """Scale natural values (n, d) to [0, 1]."""
        return (as_matrix("points", x, self.d) - self.lower) / (self.upper - self.lower)

    def from_unit(self, u: ArrayLike) -> FloatArray:
        """Scale [0, 1] (n, d) to natural values; integers and choices go to the nearest."""
        return self.round(self.lower + as_matrix("unit points", u, self.d) * (self.upper - self.lower))

    def from_quantile(self, u: ArrayLike) -> FloatArray:
        """Map uniform numbers (n, d) in [0, 1) to natural values; levels of an integer or choice get equal shares."""
        u = as_matrix("unit points", u, self.d)
        span = self.upper - self.lower
        level = np.minimum(np.floor(u * (span + 1.0)), span)
        return self.round(self.lower + np.where(self.discrete, level, u * span))

    def to_coded(self, x: ArrayLike) -> FloatArray:
        """Scale natural values (n, d) to [-1, 1]."""
        return 2.0 * self.to_unit(x) - 1.0

    def round(self, x: ArrayLike) -> FloatArray:
        """Bring points (n, d) into the bounds, integers and choices to the nearest whole number."""
        x = np.clip(as_matrix("points", x, self.d), self.lower, self.upper)
        return np.where(self.discrete, np.floor(x + 0.5), x)  # halves always up: np.rint would favour even levels

    def check(self, x: ArrayLike, *, name: str = "points") -> FloatArray:
        """The same points (n, d), if each lies within the bounds and on its levels.

        Raises:
            InputError: naming the first factor and point that do not.
        """
        x = as_matrix(name, x, self.d)
        slack = 1e-9 * (self.upper - self.lower)
        outside = (x < self.lower - slack) | (x > self.upper + slack)
        broken = self.discrete & (np.abs(x - np.rint(x)) > 1e-9)
        for bad, rule in ((outside, "lie"), (broken, "be a whole number")):
            if bad.any():
                row, column = np.argwhere(bad)[0]
                f, got = self.factors[column], float(x[row, column])
                shown = against(got, f.upper if got > f.upper else f.lower if got < f.lower else round(got), -6)
                raise InputError(
                    f"{name}[{row}], factor {f.name!r}: must {rule} in [{f.lower:.12g}, {f.upper:.12g}] (got {shown})"
                )
        return self.round(x)

    def decode(self, point: ArrayLike) -> dict[str, Level]:
        """The values of one point (d,) by factor: floats, ints and levels."""
        values = as_vector("point", point, self.d, each="factor")
        return {f.name: f.decode(float(v)) for f, v in zip(self.factors, values, strict=True)}

    def table(self, x: ArrayLike) -> pd.DataFrame:
        """Points (n, d) as a table, a column for each factor, choices by their level."""
        import pandas as pd

        columns = zip(self.factors, as_matrix("points", x, self.d).T, strict=True)
        return pd.DataFrame({f.head: [f.decode(float(v)) for v in values] for f, values in columns})

    def from_table(self, table: pd.DataFrame) -> FloatArray:
        """Read points (n, d) from a table with a column for each factor, under its name or its head.

        Raises:
            InputError: a factor without a column or with two, a value that is not one of its levels, or a point outside
                the bounds.
        """
        found = [str(column) for column in table.columns]
        columns = []
        for factor in self.factors:
            known = [column for column in found if column in (factor.name, factor.head)]
            if not known:
                either = " or ".join(repr(name) for name in dict.fromkeys((factor.name, factor.head)))
                raise InputError(f"the table has no column {either}{close_match(factor.name, found)}")
            if len(known) > 1:
                raise InputError(f"the table has two columns for factor {factor.name!r}: {' and '.join(known)}")
            columns.append(factor.encode(list(table[known[0]])))
        return self.check(np.stack(columns, axis=1), name="table")


@dataclass(frozen=True)
class Lattice:
    """A space whose continuous factors are counted in steps: a mass to 0.05 t, an empty stroke to 1 mm.

    Attributes:
        space: natural values.
        resolution: step by name of a continuous factor; it divides the factor's range.
    """

    space: Space
    resolution: Mapping[str, float]

    @property
    def steps(self) -> Space:
        """The same space, with the factors that have a resolution as integers 0, 1, ..."""
        return Space(tuple(self._counted(factor) for factor in self.space.factors))

    def _counted(self, factor: Factor) -> Factor:
        if factor.name not in self.resolution:
            return factor
        count = round((factor.upper - factor.lower) / self.resolution[factor.name])
        return replace(factor, lower=0.0, upper=float(count), kind="integer")

    def natural(self, points: ArrayLike) -> FloatArray:
        """Natural values (n, d) of points (n, d) in steps."""
        values = as_matrix("points", points, self.space.d)
        for i, factor in enumerate(self.space.factors):
            if factor.name in self.resolution:
                values[:, i] = factor.lower + values[:, i] * self.resolution[factor.name]
        return self.space.round(np.round(values, 10))  # 30.150000000000002 is 30.15
