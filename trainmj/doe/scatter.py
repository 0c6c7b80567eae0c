"""Quantities that scatter: what values they take, how often, and which belong together.

    mass, wheel = Marginal.normal("M", 32, 0.5, unit="t"), Marginal.discrete("wheel", ("new", "worn"), (0.3, 0.7))
    scatter = Scatter((mass, wheel))
    z = scatter.draws(800, seed=1)          # (800, 2) standard normal scores
    x = scatter.at_normal(z)                # (800, 2) values
    scatter.decode(x[0])                    # {"M": 32.41, "wheel": "worn"}

Every quantity is a monotonic function of a standard normal score, so that limits, reliability and sensitivity are
computed in the space of these scores, where all is alike. A point is a row of floats: the value of a continuous
quantity, and of a discrete one the position of its level (0, 1, ...), as a choice has in `trainmj.doe.space`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, frozen
from trainmj.doe.draws import DrawMethod, normal_draws
from trainmj.doe.space import Level
from trainmj.errors import InputError
from trainmj.units import head


@dataclass(frozen=True)
class Marginal:
    """One quantity that scatters: made by a method named after its distribution.

    Attributes:
        name: symbol, unique in its `Scatter`.
        distribution: a frozen distribution of scipy.stats, or whatever else has its ppf, isf, mean and std.
        unit: unit of the values; empty if they have none.
        levels: the values of a discrete quantity, in the order of their positions.
    """

    name: str
    distribution: Any = field(repr=False)
    unit: str = ""
    levels: tuple[Level, ...] = ()

    @classmethod
    def normal(cls, name: str, mean: float, sd: float, *, unit: str = "") -> Marginal:
        """Normal distribution.

        Raises:
            InputError: a number that is not finite, sd not above 0. So for all methods below.
        """
        from scipy import stats

        _check(name, mean=mean, sd=sd)
        return cls(name, stats.norm(mean, sd), unit)

    @classmethod
    def truncated_normal(
        cls, name: str, mean: float, sd: float, lower: float, upper: float, *, unit: str = ""
    ) -> Marginal:
        """Normal distribution of which only [lower, upper] is left; mean and sd are those before it was cut."""
        from scipy import stats

        _check(name, mean=mean, sd=sd, lower=lower, upper=upper)
        a, b = (lower - mean) / sd, (upper - mean) / sd
        if ndtr(b) - ndtr(a) < 1e-6 and ndtr(-a) - ndtr(-b) < 1e-6:
            raise InputError(
                f"quantity {name!r}: next to nothing of a normal distribution of mean {mean:g} and sd {sd:g} lies "
                f"within its bounds (got {lower:g}, {upper:g})"
            )
        return cls(name, stats.truncnorm(a, b, mean, sd), unit)

    @classmethod
    def uniform(cls, name: str, lower: float, upper: float, *, unit: str = "") -> Marginal:
        """All values in [lower, upper] equally likely."""
        from scipy import stats

        _check(name, lower=lower, upper=upper)
        return cls(name, stats.uniform(lower, upper - lower), unit)

    @classmethod
    def lognormal(cls, name: str, mean: float, sd: float, *, unit: str = "") -> Marginal:
        """Lognormal distribution; mean, above 0, and sd are those of the quantity, not of its logarithm."""
        from scipy import stats

        _check(name, mean=mean, sd=sd)
        if mean <= 0:
            raise InputError(f"quantity {name!r}: mean of a lognormal distribution must be above 0 (got {mean:g})")
        spread = math.sqrt(math.log1p((sd / mean) ** 2))
        return cls(name, stats.lognorm(spread, scale=mean * math.exp(-(spread**2) / 2)), unit)

    @classmethod
    def discrete(
        cls, name: str, levels: Sequence[Level], probabilities: Sequence[float] | None = None, *, unit: str = ""
    ) -> Marginal:
        """One of some levels, numbers or text, with these probabilities; equal ones if None.

        `ppf` and `at_normal` give the position of the level, `decode` the level itself.

        Raises:
            InputError: fewer than two levels, the same twice, or probabilities that are not one for each, above 0 and
                1 in sum.
        """
        levels = tuple(levels)
        if len(levels) < 2 or min(len(set(levels)), len({str(level) for level in levels})) < len(levels):
            raise InputError(f"quantity {name!r} needs at least two different levels (got {levels})")
        k = len(levels)
        p = np.full(k, 1.0 / k) if probabilities is None else as_vector(name, probabilities, k, each="level")
        if (p <= 0).any() or abs(p.sum() - 1.0) > 1e-9:
            raise InputError(
                f"quantity {name!r}: probabilities must be above 0 and add up to 1 (got {p.tolist()}, sum {p.sum():g})"
            )
        return cls(name, _Positions(np.cumsum(p / p.sum()), levels), unit, levels)

    @property
    def head(self) -> str:
        """Head of its column in tables: ``M_t``."""
        return head(self.name, self.unit)

    @property
    def mean(self) -> float:
        """Mean of the values; nan for levels that are not numbers."""
        return float(self.distribution.mean())

    @property
    def sd(self) -> float:
        """Standard deviation of the values; nan for levels that are not numbers."""
        return float(self.distribution.std())

    def ppf(self, u: ArrayLike) -> FloatArray:
        """The quantiles of probabilities, in the same shape."""
        return np.asarray(self.distribution.ppf(u), dtype=np.float64)

    def at_normal(self, z: ArrayLike) -> FloatArray:
        """The quantiles at standard normal scores, in the same shape; exact far out on both sides."""
        z = np.asarray(z, dtype=np.float64)
        tail = ndtr(-np.abs(z))
        return np.where(z < 0, self.ppf(tail), np.asarray(self.distribution.isf(tail), dtype=np.float64))

    def decode(self, value: float) -> Level:
        """The value that a coordinate stands for: a float or a level."""
        return self.levels[round(value)] if self.levels else float(value)


@dataclass(frozen=True)
class _Positions:
    """The distribution of the positions of some levels; mean and std are those of the levels."""

    cumulated: FloatArray
    levels: tuple[Level, ...]

    def ppf(self, u: ArrayLike) -> FloatArray:
        return np.searchsorted(self.cumulated[:-1], np.asarray(u, dtype=np.float64)).astype(np.float64)

    def isf(self, q: ArrayLike) -> FloatArray:
        return self.ppf(1.0 - np.asarray(q, dtype=np.float64))

    def mean(self) -> float:
        return float(np.diff(self.cumulated, prepend=0.0) @ self._numbers())

    def std(self) -> float:
        return float(np.sqrt(np.diff(self.cumulated, prepend=0.0) @ (self._numbers() - self.mean()) ** 2))

    def _numbers(self) -> FloatArray:
        numbers = all(isinstance(level, (int, float)) and not isinstance(level, bool) for level in self.levels)
        return np.array(self.levels, dtype=np.float64) if numbers else np.full(len(self.levels), np.nan)


@dataclass(frozen=True, eq=False)
class Scatter:
    """Some quantities that scatter, each on its own or together.

    Attributes:
        marginals: the quantities, in the order of the columns of every sample.
        correlation: of their normal scores, (d, d); independent if None (a Gaussian copula: Nataf 1962; Liu and Der
            Kiureghian 1986, doi 10.1016/0266-8920(86)90033-0). Of the ranks of the values it is 6 / pi asin(r / 2),
            whatever the distributions; of the values themselves it is r only where both are normal.
    """

    marginals: tuple[Marginal, ...]
    correlation: ArrayLike | None = field(default=None, repr=False)
    _root: FloatArray | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Raise InputError for names that occur twice, or a matrix that no quantities can have."""
        object.__setattr__(self, "marginals", tuple(self.marginals))
        if not self.marginals:
            raise InputError("a scatter needs at least one quantity (got none)")
        heads = [marginal.head for marginal in self.marginals]
        if min(len(set(self.names)), len(set(heads))) < self.d:
            raise InputError(f"names of quantities must differ, with and without their units (got {heads})")
        if self.correlation is not None:
            matrix = as_matrix("correlation", self.correlation, self.d)
            object.__setattr__(self, "correlation", frozen(matrix))
            object.__setattr__(self, "_root", self._checked(matrix))

    def _checked(self, matrix: FloatArray) -> FloatArray:
        """The root of a matrix that all names can have."""
        if matrix.shape[0] != self.d or not np.allclose(matrix, matrix.T, rtol=0, atol=1e-12):
            raise InputError(f"correlation must be a symmetric matrix ({self.d}, {self.d}) (got {matrix.tolist()})")
        if not np.allclose(np.diag(matrix), 1.0, rtol=0, atol=1e-12):
            raise InputError(f"correlation must have 1 all along its diagonal (got {np.diag(matrix).tolist()})")
        beyond = np.argwhere(np.triu(np.abs(matrix), 1) >= 1.0)
        if len(beyond):
            i, j = beyond[0]
            raise InputError(
                f"correlation of {self.names[i]!r} with {self.names[j]!r} must lie between -1 and 1, without the ends "
                f"(got {matrix[i, j]:g}); quantities that go along with each other are one"
            )
        return correlation_root(matrix)

    @property
    def d(self) -> int:
        """Number of quantities."""
        return len(self.marginals)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities, (d,)."""
        return tuple(marginal.name for marginal in self.marginals)

    def draws(
        self, n: int, *, seed: int, method: DrawMethod = "sobol", first: int = 0, replicates: int = 8
    ) -> FloatArray:
        """Independent standard normal points (n, d): see `normal_draws`."""
        return normal_draws(self.d, n, seed=seed, method=method, first=first, replicates=replicates)

    def at_normal(self, z: ArrayLike) -> FloatArray:
        """Map independent standard normal points (n, d) to values (n, d), correlated as stated."""
        z = as_matrix("normal points", z, self.d)
        if self._root is not None:
            z = z @ self._root.T
        return np.stack([m.at_normal(column) for m, column in zip(self.marginals, z.T, strict=True)], axis=1)

    def decode(self, point: ArrayLike) -> dict[str, Level]:
        """The values of one point (d,) by name: floats and levels."""
        values = as_vector("point", point, self.d, each="quantity")
        return {m.name: m.decode(float(v)) for m, v in zip(self.marginals, values, strict=True)}


def correlation_root(matrix: FloatArray) -> FloatArray:
    """The lower triangular root L (d, d) of a matrix of correlations: L L' = matrix.

    Raises:
        InputError: if it is not positive definite.
    """
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < 1e-10:
        raise InputError(
            f"correlation must be positive definite (its smallest eigenvalue is {least:.3g}): no quantities can "
            "have these coefficients together; make them smaller"
        )
    return frozen(np.asarray(np.linalg.cholesky(matrix), dtype=np.float64))


def _check(name: str, **numbers: float) -> None:
    """Raise InputError for a number that is not finite, an sd that is not above 0, or bounds the wrong way round."""
    if not name:
        raise InputError("a quantity must have a name (got '')")
    for key, value in numbers.items():
        if not math.isfinite(value) or (key == "sd" and value <= 0):
            rule = "finite and above 0" if key == "sd" else "finite"
            raise InputError(f"quantity {name!r}: {key} must be {rule} (got {value})")
    if "lower" in numbers and not numbers["lower"] < numbers["upper"]:
        raise InputError(
            f"quantity {name!r}: lower must be below upper (got {numbers['lower']:g}, {numbers['upper']:g})"
        )
