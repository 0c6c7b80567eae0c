"""Global sensitivity: which factor makes a response vary, alone and together with the others (Sobol' indices)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from trainmj.doe.arrays import FloatArray, as_vector, check_level, frozen
from trainmj.doe.space import Space
from trainmj.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


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
    if np.ptp(y) == 0.0:
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
