"""What every surrogate can do, how good it is, and which of several is better.

A surrogate is fitted to one response. `trainmj.doe.polynomial` and `trainmj.doe.kriging` have the two kinds; both
answer the same four questions (see `Surrogate`), so the caller picks one by the function that fits it:

    fit = partial(fit_polynomial, space=space, terms=full_order(2, 2))
    model = fit(X, y)
    model.predict(X)                          # (n,)
    accuracy(y, model.leave_one_out(), over="range")
    compare({"quadratic": fit, "kriging": partial(fit_kriging, space=space, seed=1)}, X, y, folds=10, seed=1)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector
from trainmj.errors import InputError, close_match

if TYPE_CHECKING:
    import pandas as pd

Over = Literal["value", "range", "none"]


@dataclass(frozen=True)
class Prediction:
    """Predicted values with their interval.

    Attributes:
        mean: (n,).
        lower: lower ends of the interval for one new value, (n,).
        upper: upper ends, (n,).
        level: probability that the interval holds the value, if the surrogate's assumptions do.
    """

    mean: FloatArray
    lower: FloatArray
    upper: FloatArray
    level: float


class Surrogate(Protocol):
    """A fitted function of the factors that stands in for the simulation."""

    def predict(self, x: ArrayLike) -> FloatArray:
        """Predict the response (n,) at natural values (n, d)."""

    def interval(self, x: ArrayLike, level: float = 0.95) -> Prediction:
        """Predict with an interval for one new value at each point (n, d)."""

    def leave_one_out(self) -> FloatArray:
        """Predict each fitted point from all others, (n,)."""

    @property
    def description(self) -> str:
        """What it is, in a line."""


Fit = Callable[[FloatArray, FloatArray], Surrogate]


@dataclass(frozen=True)
class Accuracy:
    """Error figures of predictions against computed values: Eqs (9) to (11) of doi 10.1186/s10033-022-00755-8.

    Attributes:
        are: average relative error, a fraction (not per cent).
        rmse: root mean square error: in the unit of the response, or a fraction of its range if over="range".
        r2: 1 - sum of squared errors / sum of squared deviations of the computed values from their mean.
        over: what the errors are divided by in ``are``: each value, or the range of the values.
    """

    are: float
    rmse: float
    r2: float
    over: Over


def accuracy(y: ArrayLike, predicted: ArrayLike, *, over: Over = "value") -> Accuracy:
    """Compare predictions with computed values.

    The paper's Table 11 is ``accuracy(y, model.leave_one_out(), over="range")``. Eq. (11) as printed puts the
    predictions into the denominator; Table 11 has the computed values there (0.952 and not 0.954 for TS), and so has
    this.

    Args:
        y: computed values, (n,).
        predicted: predictions, (n,).
        over: ``value`` as Eqs (9) and (10) print it; ``range`` divides ARE and RMSE by max - min of y; ``none``
            leaves both in the unit of y.

    Returns:
        The three figures.

    Raises:
        InputError: unequal lengths, values that do not vary, a value of zero with over="value", unknown ``over``.
    """
    y = as_vector("y", y)
    error = np.abs(as_vector("predicted", predicted, y.size) - y)
    if over not in ("value", "range", "none"):
        raise InputError(
            f"over must be 'value', 'range' or 'none' (got {over!r}){close_match(over, ('value', 'range', 'none'))}"
        )
    if np.ptp(y) == 0.0:
        raise InputError(f"y must vary for R2 to have a meaning (every value is {y[0]:g})")
    if over == "value" and (y == 0.0).any():
        raise InputError("y must not be zero with over='value', which divides by it; use over='range'")
    spread = float(np.ptp(y))
    base = {"value": np.abs(y), "range": spread, "none": 1.0}[over]
    return Accuracy(
        are=float(np.mean(error / base)),
        rmse=float(np.sqrt(np.mean(error**2))) / (spread if over == "range" else 1.0),
        r2=float(1.0 - (error**2).sum() / ((y - y.mean()) ** 2).sum()),
        over=over,
    )


def cross_validate(fit: Fit, x: ArrayLike, y: ArrayLike, *, folds: int | None = None, seed: int = 0) -> FloatArray:
    """Predict each point by a surrogate fitted afresh without it.

    Unlike `Surrogate.leave_one_out` this repeats all of the fitting, also the choice of terms or length scales.

    Args:
        fit: (X, y) -> surrogate.
        x: (n, d).
        y: (n,).
        folds: number of groups left out in turn; n (one point at a time) if None.
        seed: of the grouping, which is random if folds < n.

    Returns:
        Predictions, (n,).

    Raises:
        InputError: folds outside 2..n, or a group without which the surrogate cannot be fitted.
    """
    x = as_matrix("x", x)
    y = as_vector("y", y, len(x))
    n = len(x)
    count = n if folds is None else folds
    if not 2 <= count <= n:
        raise InputError(f"folds must lie between 2 and the number of points, {n} (got {count})")
    order = np.arange(n) if count == n else np.random.default_rng(seed).permutation(n)
    predicted = np.empty(n)
    for left_out in np.array_split(order, count):
        kept = np.setdiff1d(np.arange(n), left_out)
        predicted[left_out] = fit(x[kept], y[kept]).predict(x[left_out])
    return predicted


def compare(
    fits: Mapping[str, Fit], x: ArrayLike, y: ArrayLike, *, folds: int | None = None, seed: int = 0
) -> pd.DataFrame:
    """Cross-validate several kinds of surrogate on the same groups of points.

    Args:
        fits: name -> (X, y) -> surrogate.
        x: (n, d).
        y: (n,).
        folds: see `cross_validate`.
        seed: see `cross_validate`.

    Returns:
        One row for each kind, best first: ARE and RMSE over the range, R2, largest error over the range.

    Raises:
        InputError: no kind at all, or as `cross_validate`.
    """
    import pandas as pd

    if not fits:
        raise InputError("fits must name at least one kind of surrogate (got none)")
    y = as_vector("y", y)
    rows = {}
    for name, fit in fits.items():
        predicted = cross_validate(fit, x, y, folds=folds, seed=seed)
        found = accuracy(y, predicted, over="range")
        rows[name] = {
            "are_over_range": found.are,
            "rmse_over_range": found.rmse,
            "r2": found.r2,
            "largest_over_range": float(np.abs(predicted - y).max() / np.ptp(y)),
        }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("surrogate").sort_values("rmse_over_range")
