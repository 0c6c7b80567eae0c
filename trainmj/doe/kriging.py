"""Gaussian-process surrogate (kriging), by scikit-learn: needs the extra ``trainmj[kriging]``.

    model = fit_kriging(X, y, space=space, seed=1)
    model.predict(X_new)

It needs no choice of terms and follows any smooth response, but has no equation to print. Matern covariance 5/2 with
one length for each factor, and a noise that is fitted too; lengths by maximum likelihood from several starts.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, frozen, varies
from trainmj.doe.space import Space
from trainmj.errors import InputError

_FEW = 300  # points up to which the threads of the linear algebra take longer to meet than to compute


@dataclass(frozen=True)
class Kriging:
    """A fitted Gaussian process.

    Attributes:
        space: the factors.
        y: the fitted response, (n,).
        regressor: scikit-learn's fitted process, in unit factors and standardised response.
    """

    space: Space
    y: FloatArray = field(repr=False)
    regressor: Any = field(repr=False)

    @property
    def description(self) -> str:
        """The fitted covariance; lengths are fractions of the factors' ranges."""
        return f"kriging, {self.regressor.kernel_}"

    def predict(self, x: ArrayLike) -> FloatArray:
        """Predict the response (n,) at natural values (n, d)."""
        return np.asarray(self.regressor.predict(self.space.to_unit(x)), dtype=np.float64)

    def leave_one_out(self) -> FloatArray:
        """Predict each fitted point from all others, (n,), with the lengths and the noise kept as they are.

        Closed form (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, Eq. 5.12);
        `trainmj.doe.accuracy.cross_validate` fits the lengths afresh instead.
        """
        centre, scale = self.y.mean(), self.y.std()
        covariance = self.regressor.kernel_(self.regressor.X_train_) + self.regressor.alpha * np.eye(len(self.y))
        inverse = cho_solve(cho_factor(covariance), np.eye(len(self.y)))
        standard = (self.y - centre) / scale
        return np.asarray(self.y - scale * (inverse @ standard) / np.diag(inverse), dtype=np.float64)


def fit_kriging(x: ArrayLike, y: ArrayLike, *, space: Space, seed: int, starts: int = 2) -> Kriging:
    """Fit a Gaussian process by maximum likelihood.

    Args:
        x: natural values, (n, d).
        y: response, (n,).
        space: the factors.
        seed: of the random starts of the search for the lengths.
        starts: number of random starts beside the standard one.

    Raises:
        InputError: fewer than 3 points, a response that does not vary, or scikit-learn is not installed.
    """
    x = as_matrix("x", x, space.d)
    y = as_vector("y", y, len(x))
    if len(y) < 3:
        raise InputError(f"kriging needs at least 3 points (got {len(y)})")
    if not varies(y):
        raise InputError(f"y must vary for kriging (every value is {y[0]:g})")
    try:  # scikit-learn takes a second to import, so only here
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
        from threadpoolctl import threadpool_limits  # scikit-learn depends on it
    except ImportError as error:
        raise InputError(
            "kriging needs scikit-learn, which is not installed: pip install 'trainmj[kriging]', or use fit_polynomial"
        ) from error
    covariance = ConstantKernel(1.0, (1e-2, 1e4)) * Matern(np.ones(space.d), (0.05, 50.0), nu=2.5)
    regressor = GaussianProcessRegressor(
        covariance + WhiteKernel(1e-4, (1e-10, 1.0)),
        alpha=1e-10,
        normalize_y=True,
        n_restarts_optimizer=starts,
        random_state=seed,
    )
    with warnings.catch_warnings(), threadpool_limits(1 if len(y) < _FEW else None):
        # a length or the noise at its bound is an ordinary result: an idle factor, an exact model; and the regressor
        # keeps the best of all searches, so one that ends early is harmless
        warnings.simplefilter("ignore", ConvergenceWarning)
        regressor.fit(space.to_unit(x), y)
    return Kriging(space, frozen(y), regressor)
