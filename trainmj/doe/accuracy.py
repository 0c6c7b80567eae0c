"""What every surrogate can do, and how good it is.

A surrogate is fitted to one response. `trainmj.doe.polynomial` and `trainmj.doe.kriging` have the two kinds; both can
do what `Surrogate` says, so the caller picks one by the function that fits it:

    fit = partial(fit_polynomial, space=space, terms=full_order(2, 2))
    model = fit(X, y)
    model.predict(X)                          # (n,)
    accuracy(y, model.leave_one_out(), over="range")
    accuracy(y, cross_validate(fit, X, y, folds=10, seed=1), over="range")
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, check_choice, varies
from trainmj.errors import InputError


class Surrogate(Protocol):
    """A fitted function of the factors that stands in for the simulation."""

    def predict(self, x: ArrayLike) -> FloatArray:
        """Predict the response (n,) at natural values (n, d)."""

    def leave_one_out(self) -> FloatArray:
        """Predict each fitted point from all others, (n,)."""

    @property
    def description(self) -> str:
        """What it is, in a line."""


Fit = Callable[[FloatArray, FloatArray], Surrogate]


@dataclass(frozen=True)
class Accuracy:
    """Errors of predictions against computed values.

    Attributes:
        are: average relative error, a fraction (not per cent).
        rmse: root mean square error: in the unit of the response, or a fraction of its range if over="range".
        r2: 1 - sum of squared errors / sum of squared deviations of the computed values from their mean.
        largest: largest error, measured as ``rmse``.
    """

    are: float
    rmse: float
    r2: float
    largest: float


def accuracy(y: ArrayLike, predicted: ArrayLike, *, over: Literal["value", "range"] = "value") -> Accuracy:
    """Compare predictions with computed values: Eqs (9) to (11) of doi 10.1186/s10033-022-00755-8.

    Eq. (11) as printed puts the predictions into the denominator; its Table 11 has the computed values there (0.952 and
    not 0.954 for TS), and so does this function. That table is ``accuracy(y, model.leave_one_out(), over="range")``.

    Args:
        y: computed values, (n,).
        predicted: predictions, (n,).
        over: ``value`` as Eqs (9) and (10) print it; ``range`` divides all errors by max - min of y.

    Raises:
        InputError: unequal lengths, values that do not vary, a value of zero with over="value", unknown ``over``.
    """
    y = as_vector("y", y)
    error = np.abs(as_vector("predicted", predicted, y.size) - y)
    check_choice("over", over, ("value", "range"))
    spread = float(np.ptp(y))
    if not varies(y):
        raise InputError(f"y must vary for R2 to have a meaning (every value is {y[0]:g})")
    if over == "value" and (y == 0.0).any():
        raise InputError("y must not be zero with over='value', which divides by it; use over='range'")
    scale = spread if over == "range" else 1.0
    return Accuracy(
        are=float(np.mean(error / (scale if over == "range" else np.abs(y)))),
        rmse=float(np.sqrt(np.mean(error**2))) / scale,
        r2=float(1.0 - (error**2).sum() / ((y - y.mean()) ** 2).sum()),
        largest=float(error.max() / scale),
    )


def cross_validate(fit: Fit, x: ArrayLike, y: ArrayLike, *, folds: int | None = None, seed: int = 0) -> FloatArray:
    """Predict each point by a surrogate fitted afresh without it.

    Unlike `Surrogate.leave_one_out` this repeats all of the fitting, including the choice of terms or length scales.

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
