"""Which factor matters.

Correlation goes by points and their responses, Sobol' indices by a function, such as a surrogate:

    found = correlate(X, Y, x_names=("D", "M"), y_names=("TS", "TAMA"))
    found.table()            # a row for each pair: r, lower, upper, p
    sobol_sensitivity(space, model.predict, seed=1).table()
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtr

from trainmj.doe.arrays import FloatArray, as_matrix, as_names, as_vector, check_choice, check_level, frozen, varies
from trainmj.doe.space import Space
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
    The probabilities are two-sided, by Student's t with n - 2 degrees of freedom.

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
    check_choice("method", method, get_args(Method))
    check_level(level)
    names = as_names("x_names", x_names, x.shape[1], "x"), as_names("y_names", y_names, y.shape[1], "y")
    r = np.clip(_standardised(x, method).T @ _standardised(y, method), -1.0, 1.0)
    with np.errstate(divide="ignore"):  # |r| = 1 has p = 0 and the interval [r, r]
        t = np.abs(r) * np.sqrt((n - 2) / (1.0 - r**2))
        z = np.arctanh(r)
    spread = np.full_like(r, np.nan)
    if n > 3:
        spread = np.sqrt((1.0 + r**2 / 2.0) / (n - 3)) if method == "spearman" else 1.0 / np.sqrt(n - 3)
    half = float(ndtri(0.5 + level / 2.0)) * spread
    lower, upper, p = np.tanh(z - half), np.tanh(z + half), 2.0 * stdtr(n - 2, -t)
    return Correlation(method, *names, frozen(r), frozen(lower), frozen(upper), frozen(p), level, n)


def _standardised(a: FloatArray, method: Method) -> FloatArray:
    """Columns (n, k), or their ranks, centred and of length 1; nan where the column varies by round-off at most."""
    constant = ~varies(a)
    if method == "spearman":
        from scipy.stats import rankdata

        a = rankdata(a, axis=0)
    centred = a - a.mean(axis=0)
    length = np.linalg.norm(centred, axis=0)
    length[constant] = np.nan
    return np.asarray(centred / length, dtype=np.float64)


@dataclass(frozen=True)
class Sensitivity:
    """Shares of a response's variance.

    Attributes:
        names: the factors.
        first: share that each factor causes alone, (d,).
        total: share in which each factor takes part, (d,).
        first_interval: confidence limits of ``first``, (d, 2).
        total_interval: confidence limits of ``total``, (d, 2).
    """

    names: tuple[str, ...]
    first: FloatArray
    total: FloatArray
    first_interval: FloatArray = field(repr=False)
    total_interval: FloatArray = field(repr=False)

    def table(self) -> pd.DataFrame:
        """A row for each factor."""
        import pandas as pd

        columns = {"first": self.first, "total": self.total}
        for name, limits in (("first", self.first_interval), ("total", self.total_interval)):
            columns[f"{name}_lower"], columns[f"{name}_upper"] = limits.T
        return pd.DataFrame(columns, index=list(self.names)).rename_axis("factor")


def sobol_sensitivity(
    space: Space, predict: Callable[[FloatArray], FloatArray], *, n: int = 4096, seed: int, level: float = 0.95
) -> Sensitivity:
    """Estimate first-order and total Sobol' indices of a response over the whole space.

    The factors are uniform and independent. Estimators of Saltelli et al. (2010, doi 10.1016/j.cpc.2009.09.018) on a
    scrambled Sobol sequence. (scipy.stats.sobol_indices has the same ones, but its intervals cannot be seeded.)

    Args:
        space: the factors.
        predict: X (k, d) -> y (k,), usually a surrogate's ``predict``: it is asked for n (d + 2) points in one call.
        n: size of the sample, a power of two.
        seed: of the random numbers.
        level: confidence level of the bootstrap intervals.

    Raises:
        InputError: n is no power of two, level outside (0, 1), or the response does not vary.
    """
    from scipy.stats import qmc

    if n < 2 or n & (n - 1):
        raise InputError(f"n must be a power of two, at least 2 (got {n}); the next is {1 << max(1, n.bit_length())}")
    check_level(level)
    rng = np.random.default_rng(seed)
    d = space.d
    pairs = qmc.Sobol(2 * d, scramble=True, rng=rng).random_base2(n.bit_length() - 1)  # (n, 2 d)
    a, b = pairs[:, :d], pairs[:, d:]
    mixed = np.repeat(a[None], d, axis=0)  # (d, n, d): a with column i from b
    mixed[np.arange(d), :, np.arange(d)] = b.T
    points = np.concatenate([a, b, mixed.reshape(-1, d)])
    y = as_vector("response", predict(space.from_quantile(points)), len(points)).reshape(d + 2, n)
    if not varies(y.ravel()):
        raise InputError("the response must vary over the space (it is the same at every point): its shares are 0/0")
    y = y - y[:2].mean()  # the estimators' errors grow with the mean
    first, total = _indices(y)
    drawn = np.array([_indices(y[:, rng.integers(n, size=n)]) for _ in range(200)])  # (200, 2, d)
    limits = np.quantile(drawn, [0.5 - level / 2, 0.5 + level / 2], axis=0)  # (2, 2, d)
    return Sensitivity(space.names, frozen(first), frozen(total), limits[:, 0].T, limits[:, 1].T)


def _indices(y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First-order and total indices, (d,) each, from the responses at a, b and the mixed points, (d + 2, n)."""
    a, b, mixed = y[0], y[1], y[2:]
    variance = y[:2].var()
    return (b * (mixed - a)).mean(axis=1) / variance, ((a - mixed) ** 2).mean(axis=1) / (2.0 * variance)
