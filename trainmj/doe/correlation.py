"""Correlation between factors and responses, with confidence intervals.

found = correlate(X, Y, x_names=("D", "M"), y_names=("TS", "TAMA"))
found.r                  # (2, 2)
found.table()            # a row for each pair: r, lower, upper, p
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtr

from trainmj.doe.arrays import FloatArray, as_matrix, as_names, check_choice, check_level, frozen
from trainmj.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Method = Literal["pearson", "spearman"]


@dataclass(frozen=True)
class Correlation:
    """Correlation coefficients of every x with every y.

    Attributes:
        method: pearson (of the values) or spearman (of their ranks).
        x_names: rows.
        y_names: columns.
        r: coefficients, (n_x, n_y); nan where a column does not vary.
        lower: lower ends of the confidence intervals, (n_x, n_y); nan with fewer than 4 points.
        upper: upper ends, (n_x, n_y).
        p: probability of an |r| as large if there were no correlation, (n_x, n_y).
        level: confidence level of the intervals.
        n: number of points.
    """

    method: Method
    x_names: tuple[str, ...]
    y_names: tuple[str, ...]
    r: FloatArray = field(repr=False)
    lower: FloatArray = field(repr=False)
    upper: FloatArray = field(repr=False)
    p: FloatArray = field(repr=False)
    level: float
    n: int

    def matrix(self) -> pd.DataFrame:
        """The coefficients as a table, x in rows, y in columns."""
        import pandas as pd

        return pd.DataFrame(self.r, index=list(self.x_names), columns=list(self.y_names))

    def table(self) -> pd.DataFrame:
        """A row for each pair: x, y, r, lower, upper, p."""
        import pandas as pd

        x, y = np.meshgrid(self.x_names, self.y_names, indexing="ij")
        columns = {"x": x, "y": y, "r": self.r, "lower": self.lower, "upper": self.upper, "p": self.p}
        return pd.DataFrame({name: np.ravel(values) for name, values in columns.items()})


def correlate(
    x: ArrayLike,
    y: ArrayLike,
    *,
    x_names: Sequence[str] | None = None,
    y_names: Sequence[str] | None = None,
    method: Method = "pearson",
    level: float = 0.95,
) -> Correlation:
    """Correlate every column of x with every column of y.

    The intervals are Fisher's; for ranks with the standard error of Bonett and Wright (2000, doi 10.1007/BF02294183).

    Args:
        x: (n, n_x).
        y: (n, n_y).
        x_names: names of x's columns; x1, x2, ... if None.
        y_names: names of y's columns; y1, y2, ... if None.
        method: pearson or spearman.
        level: confidence level of the intervals, between 0 and 1.

    Raises:
        InputError: fewer than 3 points, unequal numbers of points, unknown method, level outside (0, 1).
    """
    x = as_matrix("x", x)
    y = as_matrix("y", y)
    n = len(x)
    if n != len(y):
        raise InputError(f"x and y must have as many rows as there are points (got {n} and {len(y)})")
    if n < 3:
        raise InputError(f"a correlation needs at least 3 points (got {n})")
    check_choice("method", method, ("pearson", "spearman"))
    check_level(level)
    if method == "spearman":
        x, y = _ranks(x), _ranks(y)
    r = np.clip(_standardised(x).T @ _standardised(y), -1.0, 1.0)
    lower, upper = _interval(r, n, method, level)
    return Correlation(
        method=method,
        x_names=as_names("x_names", x_names, x.shape[1], "x"),
        y_names=as_names("y_names", y_names, y.shape[1], "y"),
        r=frozen(r),
        lower=frozen(lower),
        upper=frozen(upper),
        p=frozen(_probability(r, n)),
        level=level,
        n=n,
    )


def _ranks(a: FloatArray) -> FloatArray:
    """Ranks within each column, (n, k); equal values share the mean of their ranks."""
    from scipy.stats import rankdata

    return np.asarray(rankdata(a, axis=0), dtype=np.float64)


def _standardised(a: FloatArray) -> FloatArray:
    """Columns (n, k) centred, of length 1; nan where the column is constant."""
    centred = a - a.mean(axis=0)
    length = np.linalg.norm(centred, axis=0)
    constant = np.ptp(a, axis=0) == 0.0  # the mean's round-off would give a constant column a length
    return np.asarray(centred / np.where(constant, np.nan, length), dtype=np.float64)


def _interval(r: FloatArray, n: int, method: Method, level: float) -> tuple[FloatArray, FloatArray]:
    """Confidence limits of r (n_x, n_y)."""
    if n < 4:
        return np.full_like(r, np.nan), np.full_like(r, np.nan)
    spread = np.sqrt((1.0 + r**2 / 2.0) / (n - 3)) if method == "spearman" else 1.0 / np.sqrt(n - 3)
    with np.errstate(divide="ignore"):  # |r| = 1 has the interval [r, r]
        z = np.arctanh(r)
    half = float(ndtri(0.5 + level / 2.0)) * spread
    return np.tanh(z - half), np.tanh(z + half)


def _probability(r: FloatArray, n: int) -> FloatArray:
    """Two-sided probability of |r| under no correlation, by Student's t with n - 2 degrees of freedom."""
    with np.errstate(divide="ignore"):
        t = np.abs(r) * np.sqrt((n - 2) / (1.0 - r**2))
    return np.asarray(2.0 * stdtr(n - 2, -t), dtype=np.float64)
