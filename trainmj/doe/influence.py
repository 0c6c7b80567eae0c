"""Which factor matters.

Correlation goes by points and their responses, Sobol' indices by a function, such as a surrogate, or by the responses
at points made for them:

    found = correlate(X, Y, x_names=("D", "M"), y_names=("TS", "TAMA"))
    found.table()            # a row for each pair: r, lower, upper, p
    sobol_sensitivity(space, model.predict, seed=1).table()

    u = sobol_points(3, 1024, seed=1)                    # (1024 (3 + 2), 3)
    ts, tama = sobol_indices(simulate(u), ("D", "M", "F"), seed=1)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtr

from trainmj.doe.arrays import FloatArray, as_matrix, as_names, as_vector, check_choice, check_level, frozen, varies
from trainmj.doe.draws import sobol_units
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
    """Shares of a response's variance; nan if it does not vary.

    Attributes:
        names: the factors, quantities or groups of them, (g,).
        first: share that each causes alone, (g,).
        total: share in which each takes part, (g,).
        first_interval: confidence limits of ``first``, (g, 2).
        total_interval: confidence limits of ``total``, (g, 2).
        n: samples that it was found from, of g + 2 points each.
        left_out: samples of which a point had no response.
    """

    names: tuple[str, ...]
    first: FloatArray
    total: FloatArray
    first_interval: FloatArray = field(repr=False)
    total_interval: FloatArray = field(repr=False)
    n: int
    left_out: int = 0

    def table(self) -> pd.DataFrame:
        """A row for each factor."""
        import pandas as pd

        columns = {"first": self.first, "total": self.total}
        for name, limits in (("first", self.first_interval), ("total", self.total_interval)):
            columns[f"{name}_lower"], columns[f"{name}_upper"] = limits.T
        return pd.DataFrame(columns, index=list(self.names)).rename_axis("factor")


def sobol_points(d: int, n: int, *, seed: int, groups: Sequence[str] | None = None) -> FloatArray:
    """Make the points at which Sobol' indices need the responses: n samples of g + 2 points each, one after another.

    A sample is a point, the same with the columns of one group from a second point, for each group, and that second one
    (Saltelli et al. 2010, doi 10.1016/j.cpc.2009.09.018), from a scrambled Sobol' sequence.

    Args:
        d: number of columns.
        n: number of samples, a power of two.
        seed: of the random numbers.
        groups: to which group each column belongs, (d,): columns of one name change together, as the copies of a part
            that scatter on their own. Each column is a group if None.

    Returns:
        Uniform numbers in (0, 1), (n (g + 2), d): `Space.from_quantile` and `Marginal.ppf` take them, and as normal
        scores, scipy.special.ndtri of them, `Scatter.at_normal`. The shares add up to those of the response only if the
        columns are independent; of correlated quantities they are those of the scores.

    Raises:
        InputError: n is no power of two, groups of the wrong length, or more than 10 600 columns.
    """
    if n < 2 or n & (n - 1):
        raise InputError(f"n must be a power of two, at least 2 (got {n}); the next is {1 << max(1, n.bit_length())}")
    label = np.arange(d).astype(str) if groups is None else np.array(list(groups), dtype=object)
    if len(label) != d:
        raise InputError(f"groups must name a group for each of the {d} columns (got {len(label)})")
    pairs = sobol_units(2 * d, n, np.random.default_rng(seed))
    first, second = pairs[:, None, :d], pairs[:, None, d:]
    changed = np.array([label == name for name in dict.fromkeys(label)])  # (g, d)
    return np.concatenate([first, np.where(changed, second, first), second], axis=1).reshape(-1, d)


def sobol_indices(
    y: ArrayLike, names: Sequence[str], *, seed: int, level: float = 0.95, resamples: int = 200
) -> tuple[Sensitivity, ...]:
    """Estimate first-order and total Sobol' indices of responses at the points of `sobol_points`.

    First order by Saltelli et al. (2010, doi 10.1016/j.cpc.2009.09.018), total by Jansen (1999, doi
    10.1016/S0010-4655(98)00154-4). The intervals resample the n samples, which is cautious for quasi-random ones.

    Args:
        y: responses, (n (g + 2), r), or (n (g + 2),) for one; nan for a point that has none, as its run failed. The
            whole sample is left out then: if failures gather somewhere, so is that place, and the shares are those of
            the rest.
        names: the groups, or columns, in their order, (g,); a group comes where its first column is.
        seed: of the resampling.
        level: confidence level of the intervals.
        resamples: how many.

    Returns:
        Of each response, (r,).

    Raises:
        InputError: no whole number of samples, infinite responses, fewer than 2 samples that are complete, or level
            outside (0, 1).
    """
    check_level(level)
    y = as_matrix("responses", y, finite=False)
    points = len(names) + 2
    if len(y) % points or resamples < 1:
        raise InputError(
            f"responses must be those of whole samples of {points} points, for {len(names)} names, and resamples at "
            f"least 1 (got {len(y)} responses, {resamples} resamples)"
        )
    if np.isinf(y).any():
        raise InputError("responses must be finite, or nan for a run that failed (got inf)")
    rng = np.random.default_rng(seed)
    weights: dict[int, FloatArray] = {}
    found = []
    for column in y.T:
        sample = column.reshape(-1, points)  # (n, g + 2)
        whole = np.isfinite(sample).all(axis=1)
        n = int(whole.sum())
        if n < 2:
            raise InputError(f"Sobol' indices need at least 2 samples without nan (got {n} of {len(sample)})")
        if n not in weights:
            drawn = rng.integers(n, size=(resamples, n)) + n * np.arange(resamples)[:, None]
            counts = np.bincount(drawn.ravel(), minlength=resamples * n).reshape(resamples, n)
            weights[n] = np.asarray(np.vstack([np.ones(n), counts]) / n, dtype=np.float64)
        shares = _shares(sample[whole], weights[n])  # (1 + resamples, 2, g)
        limits = np.quantile(shares[1:], [0.5 - level / 2, 0.5 + level / 2], axis=0)  # (2, 2, g)
        first, total = shares[0]
        intervals = frozen(limits[:, 0].T), frozen(limits[:, 1].T)
        found.append(Sensitivity(tuple(names), frozen(first), frozen(total), *intervals, n, len(sample) - n))
    return tuple(found)


def _shares(sample: FloatArray, weights: FloatArray) -> FloatArray:
    """First-order and total indices (k, 2, g) of samples (n, g + 2), by each row of their weights (k, n)."""
    g = sample.shape[1] - 2
    if not varies(sample.ravel()):
        return np.full((len(weights), 2, g), np.nan)
    sample = sample - sample.mean()  # the estimators' errors grow with the mean
    a, mixed, b = sample[:, :1], sample[:, 1:-1], sample[:, -1:]
    terms = np.hstack([a + b, a**2 + b**2, b * (mixed - a), (a - mixed) ** 2])
    means = weights @ terms
    variance = means[:, 1:2] / 2.0 - (means[:, :1] / 2.0) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):  # a resample of a response that hardly varies may not vary
        return np.stack([means[:, 2 : 2 + g] / variance, means[:, 2 + g :] / (2.0 * variance)], axis=1)


def sobol_sensitivity(
    space: Space, predict: Callable[[FloatArray], FloatArray], *, n: int = 4096, seed: int, level: float = 0.95
) -> Sensitivity:
    """Estimate first-order and total Sobol' indices of a response over the whole space.

    The factors are uniform and independent; see `sobol_points` and `sobol_indices`, which serve any others.

    Args:
        space: the factors.
        predict: X (k, d) -> y (k,), usually a surrogate's ``predict``: it is asked for n (d + 2) points in one call.
        n: size of the sample, a power of two.
        seed: of the random numbers.
        level: confidence level of the bootstrap intervals.

    Raises:
        InputError: n is no power of two, level outside (0, 1), or the response does not vary.
    """
    check_level(level)
    points = space.from_quantile(sobol_points(space.d, n, seed=seed))
    y = as_vector("response", predict(points), len(points))
    if not varies(y):
        raise InputError("the response must vary over the space (it is the same at every point): its shares are 0/0")
    return sobol_indices(y, space.names, seed=seed, level=level)[0]
