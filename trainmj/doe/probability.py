"""Probabilities, quantiles and means from samples, each with an interval; and probabilities too small to be sampled.

    proportion(0, 1000)                                  # 0, at most 0.0037
    quantile_interval(values, 0.95)
    mean_interval(values, replicates_of(len(values)))    # of quasi-random draws
    rare = subset_simulation(limit_state, d, seed=1)     # failure where limit_state(z) > 0, z (n, d) standard normal
    rare.value, rare.lower, rare.upper, rare.runs, rare.status
    importance_sampling(limit_state, d, start=rare, seed=2)

A run that fails gives nan. It is neither safe nor not: what is computed from it counts it as beyond the limit, a lower
end as safe, and how many there were is stated.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaincinv, ndtri, stdtrit

from trainmj.doe.arrays import FloatArray, as_vector, check_choice, check_level, frozen
from trainmj.errors import InputError

LimitState = Callable[[FloatArray], ArrayLike]

_ACCEPTED = 0.44  # share of accepted steps that the spread of a step is tuned to (Papaioannou et al. 2015)
_FEW = 50.0  # effective failures below which an interval of importance sampling is not to be trusted
_DEFENSIVE = 0.1  # share of importance sampling drawn from where it came from: no weight is above 1 / this
_CENTRES = 8  # normal distributions in a mixture of importance sampling


@dataclass(frozen=True)
class Estimate:
    """A number with its confidence interval.

    Attributes:
        value: the estimate.
        lower: lower end; -inf if the sample is too small to have one.
        upper: upper end; inf likewise.
        level: confidence level of the interval.
        n: size of the sample.
    """

    value: float
    lower: float
    upper: float
    level: float
    n: int


@dataclass(frozen=True)
class Rare:
    """A probability of failure found by a search.

    Attributes:
        value: the estimate; nan if no failure was found.
        lower: lower end of the interval; 0 if no failure was found.
        upper: upper end; likewise that of the first points, of which none failed.
        level: confidence level of the interval.
        cov: coefficient of variation of the estimate; nan if no failure was found.
        runs: points at which the limit state was computed.
        failed: runs that gave nan, counted as beyond the limit.
        trusted: whether the interval can be: a failure was found, by enough points.
        status: how it went, in words.
        thresholds: values of the limit state that were passed on the way; 0 is the last if failure was reached.
        effective: the number of independent failures that would say as much about the last step.
        points: of those that fail, standard normal, (k, d).
    """

    value: float
    lower: float
    upper: float
    level: float
    cov: float
    runs: int
    failed: int
    trusted: bool
    status: str
    thresholds: tuple[float, ...]
    effective: float
    points: FloatArray = field(repr=False)


def proportion(
    k: int, n: int, *, failed: int = 0, level: float = 0.95, method: Literal["exact", "wilson"] = "exact"
) -> Estimate:
    """Estimate a probability from k cases of n.

    Args:
        k: how often it happened.
        n: how often it could have.
        failed: further cases of the n of which nothing is known: they count as if it had happened in the value and
            the upper end, as if not in the lower end.
        level: confidence level of the interval.
        method: ``exact`` never covers less than stated (Clopper and Pearson 1934, doi 10.1093/biomet/26.4.404);
            ``wilson`` does so on average and is shorter (1927, doi 10.1080/01621459.1927.10502953). Both need
            independent cases; for quasi-random ones they are wider than need be, as a rule.

    Raises:
        InputError: no cases, more than there are, an unknown method, or level outside (0, 1).
    """
    if n < 1 or k < 0 or failed < 0 or k + failed > n:
        raise InputError(f"a proportion needs 0 <= k + failed <= n and n >= 1 (got k {k}, failed {failed}, n {n})")
    check_level(level)
    check_choice("method", method, ("exact", "wilson"))
    most, alpha = k + failed, 1.0 - level
    if method == "exact":
        lower = 0.0 if k == 0 else float(betaincinv(k, n - k + 1, alpha / 2))
        upper = 1.0 if most == n else float(betaincinv(most + 1, n - most, 1.0 - alpha / 2))
    else:
        lower = max(0.0, _wilson(k, n, float(ndtri(alpha / 2))))
        upper = min(1.0, _wilson(most, n, float(ndtri(1.0 - alpha / 2))))
    return Estimate(most / n, lower, upper, level, n)


def _wilson(k: int, n: int, z: float) -> float:
    """The end of Wilson's interval on the side of z; exactly 0 and 1 where nothing and everything happened."""
    if (k == 0 and z < 0) or (k == n and z > 0):
        return float(k == n)
    p = k / n
    return (p + z * z / (2 * n) + z * math.sqrt(p * (1 - p) / n + (z / (2 * n)) ** 2)) / (1 + z * z / n)


def quantile_interval(values: ArrayLike, q: float, *, level: float = 0.95) -> Estimate:
    """Estimate a quantile by order statistics: the interval holds for any distribution (David and Nagaraja 2003,
    doi 10.1002/0471722162, section 7.1) of independent values.

    Args:
        values: (n,); nan for a run that failed, whose value may have been anything: lower end and upper end are those
            of the worst case, and the value is that with all of them beyond.
        q: between 0 and 1: 0.95 is the value that 5 % exceed.
        level: confidence level of the interval.

    Returns:
        The estimate; an end is infinite if there are too few values for it.

    Raises:
        InputError: no values, or q or level outside (0, 1).
    """
    x = np.array(values, dtype=np.float64).ravel()
    check_level(level)
    if not 0 < q < 1:
        raise InputError(f"q must lie between 0 and 1 (got {q})")
    if x.size == 0 or np.isinf(x).any():
        raise InputError(f"a quantile needs values, finite or nan for a run that failed (got {x.size} values)")
    from scipy.stats import binom

    n = x.size
    alpha = 1.0 - level
    below, above = (np.sort(np.where(np.isnan(x), end, x)) for end in (-np.inf, np.inf))
    i = int(binom.ppf(alpha / 2, n, q))  # of the order statistics, from 1: P(more than i - 1 values below) is enough
    j = int(binom.ppf(1.0 - alpha / 2, n, q)) + 1
    lower = float(below[i - 1]) if i >= 1 else -np.inf
    upper = float(above[j - 1]) if j <= n else np.inf
    place = min(max(math.ceil(n * q - 1e-9), 1), n)
    return Estimate(float(above[place - 1]), lower, upper, level, n)


def mean_interval(values: ArrayLike, replicates: ArrayLike | None = None, *, level: float = 0.95) -> Estimate:
    """Estimate a mean: by Student's t from independent values, or from the means of independent replicates.

    Quasi-random values are not independent, so how they scatter does not tell the error of their mean; how the means of
    independent scramblings scatter does (see `trainmj.doe.normal_draws`). Of zeros and ones the mean is a probability.

    Args:
        values: (n,).
        replicates: to which replicate each value belongs, (n,), as `replicates_of` gives it; all independent if None.
        level: confidence level of the interval.

    Raises:
        InputError: values that are not finite, fewer than 2 replicates, replicates of unequal size by more than one
            value in two, or level outside (0, 1).
    """
    x = as_vector("values", values)
    check_level(level)
    group = np.arange(x.size) if replicates is None else as_vector("replicates", replicates, x.size, each="value")
    _, which, size = np.unique(group, return_inverse=True, return_counts=True)
    count = size.size
    if count < 2:
        raise InputError(f"an interval of a mean needs at least 2 independent values or replicates (got {count})")
    if size.max() > 2 * size.min():
        raise InputError(
            f"replicates must be of about equal size (got {size.min()} to {size.max()} values): draw a multiple"
        )
    mean = float(x.mean())
    # of a ratio of totals: with equal sizes, the scatter of the replicates' means
    off = (np.bincount(which, weights=x) - mean * size) / size.mean()
    half = float(stdtrit(count - 1, 0.5 + level / 2)) * math.sqrt(float((off**2).sum()) / (count * (count - 1)))
    return Estimate(mean, mean - half, mean + half, level, x.size)


def subset_simulation(
    limit_state: LimitState,
    d: int,
    *,
    seed: int,
    n: int = 8000,
    p0: float = 0.1,
    most: int = 12,
    level: float = 0.95,
) -> Rare:
    """Estimate the probability that limit_state(z) > 0 for standard normal z, as a product of larger ones.

    Each level takes the share p0 of its points that come nearest to failure, and from each of them a Markov chain of
    points that come at least as near (Au and Beck 2001, doi 10.1016/S0266-8920(01)00019-4), by conditional sampling
    with adaptive steps (Papaioannou et al. 2015, doi 10.1016/j.probengmech.2015.06.006). It finds several regions of
    failure as long as chains of all of them reach the last level, and cannot tell of one that none has reached.

    Args:
        limit_state: z (k, d) -> (k,), failure where above 0; asked for n points at first, then for p0 n at a time.
            nan, of a run that failed, counts as failure, beyond all others: the value and the upper end have such
            runs as failures, the lower end as safe.
        d: number of random quantities.
        seed: of the random numbers.
        n: points of each level.
        p0: part of a level's points from which the next begins; between 0.05 and 0.5.
        most: levels after which it gives up: probabilities below about p0^most are not found.
        level: confidence level of the interval, which takes the logarithm of the estimate as normal; of the first
            level's proportion where that is failure already.

    Raises:
        InputError: a number outside its range, or limit_state returned the wrong number of values.
    """
    check_level(level)
    if d < 1 or most < 1 or not 0.05 <= p0 <= 0.5 or n * p0 < 10:
        raise InputError(
            f"d and most must be at least 1, p0 lie in [0.05, 0.5] and n p0 be at least 10 (got {d}, {most}, {p0}, {n})"
        )
    rng = np.random.default_rng(seed)
    ask = _Asker(limit_state)
    seeds = round(n * p0)
    z = rng.standard_normal((n, d))
    g = ask(z)
    bound = proportion(int((g > 0).sum()), n, level=level).upper
    chain: NDArray[np.int64] = np.arange(n)  # to which chain of its level each point belongs
    first = chain  # from which of the first points it descends
    thresholds: list[float] = []
    log_p, spread, squared = 0.0, 0.6, 0.0
    while True:
        threshold = float(np.sort(g)[-seeds - 1])
        inside, fails = g > threshold, g > 0
        reached = fails.sum() >= inside.sum() and fails.any()
        p = float((fails if reached else inside).mean())
        if not reached and (p == 0 or len(thresholds) + 1 >= most):
            why = f"no failure within {most} levels"
            if p == 0:
                why = "the limit state is the same at the points nearest to failure, so it does not lead there"
            reach = f"the last level, of probability {math.exp(log_p):.1e}, is at {g.max():.4g}"
            return ask.nothing(f"not reached: {why}; {reach}", bound, level, thresholds, d)
        part = (1.0 - p) / (p * n) * (1.0 + _correlation(fails if reached else inside, chain, p))
        squared += part
        log_p += math.log(p)
        thresholds.append(0.0 if reached else threshold)
        if reached:
            break
        start = rng.choice(np.flatnonzero(inside), seeds, replace=bool(inside.sum() < seeds))
        z, g, chain, spread = _chains(ask, z[start], g[start], threshold, n, spread, rng)
        first = first[start][chain]
    # levels are alike too, as points of one descent: how the failures scatter over the first points tells (Lee and
    # Whiteley 2018, doi 10.1093/biomet/asy028); it is itself uncertain, so the larger one counts
    descent = np.bincount(first[fails]) / fails.sum()
    squared = max(squared, float((descent**2).sum()) - len(thresholds) / n)
    value, cov = math.exp(log_p), math.sqrt(squared)
    lost = int(np.isposinf(g).sum())
    unknown = lost / int(fails.sum())
    if len(thresholds) == 1:
        known = proportion(int(fails.sum()) - lost, n, failed=lost, level=level)
        lower, upper = known.lower, known.upper
    else:
        lower, upper = _lognormal(value, squared, unknown, level)
    status = f"failure reached at level {len(thresholds)}, {int(fails.sum())} of {n} points"
    if unknown:  # nothing says that these are failures: they may be all of the estimate, and none of it
        status += f"; {unknown:.0%} of them are runs that failed (nan), counted as failures"
    effective = (1.0 - p) / (p * part) if p < 1 else float(n)
    return Rare(
        value=value,
        lower=lower,
        upper=upper,
        level=level,
        cov=cov,
        runs=ask.runs,
        failed=ask.failed,
        trusted=True,
        status=status,
        thresholds=tuple(thresholds),
        effective=effective,
        points=frozen(z[fails]),
    )


class _Asker:
    """Computes a limit state, and counts."""

    def __init__(self, limit_state: LimitState) -> None:
        self.limit_state = limit_state
        self.runs = self.failed = 0

    def __call__(self, z: FloatArray) -> FloatArray:
        """The limit state (k,) at points (k, d); inf for a run that failed."""
        g = np.array(self.limit_state(z.copy()), dtype=np.float64)
        if g.shape != (len(z),):
            raise InputError(f"the limit state must return one value for each of {len(z)} points (got shape {g.shape})")
        lost = np.isnan(g)
        self.runs += len(z)
        self.failed += int(lost.sum())
        return np.where(lost, np.inf, np.minimum(g, np.finfo(np.float64).max))

    def nothing(self, status: str, upper: float, level: float, thresholds: list[float], d: int) -> Rare:
        """What is to be said where no failure was found."""
        return Rare(
            value=math.nan,
            lower=0.0,
            upper=upper,
            level=level,
            cov=math.nan,
            runs=self.runs,
            failed=self.failed,
            trusted=False,
            status=status,
            thresholds=tuple(thresholds),
            effective=0.0,
            points=frozen(np.zeros((0, d))),
        )


def _chains(
    ask: _Asker, z: FloatArray, g: FloatArray, threshold: float, n: int, spread: float, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, NDArray[np.int64], float]:
    """From each seed (k, d) a chain of points above the threshold, all a step at a time, until there are n."""
    k, d = z.shape
    deviation = z.std(axis=0)
    points, values = [z], [g]
    for step in range(1, -(-n // k)):
        move = np.minimum(1.0, spread * deviation)
        new = np.sqrt(1.0 - move**2) * z + move * rng.standard_normal((k, d))
        value = ask(new)
        good = value > threshold
        z, g = np.where(good[:, None], new, z), np.where(good, value, g)
        points.append(z)
        values.append(g)
        spread *= math.exp((float(good.mean()) - _ACCEPTED) / math.sqrt(step))
    chain = np.tile(np.arange(k), len(points))
    return np.concatenate(points)[:n], np.concatenate(values)[:n], chain[:n], spread


def _correlation(inside: NDArray[np.bool_], chain: NDArray[np.int64], p: float) -> float:
    """By how much the variance of a share is larger as points of a chain are alike, as a part of it."""
    sums = np.bincount(chain, weights=inside - p)
    alone = p * (1.0 - p) * inside.size
    return max(0.0, float((sums**2).sum()) / alone - 1.0) if alone > 0 and sums.size < inside.size else 0.0


def _lognormal(value: float, squared: float, unknown: float, level: float) -> tuple[float, float]:
    """Ends of an interval by the squared coefficient of variation; runs that failed, a share, are safe in the lower."""
    wide = math.exp(float(ndtri(0.5 + level / 2)) * math.sqrt(math.log1p(squared)))
    return value / wide * (1.0 - unknown), min(1.0, value * wide)


def importance_sampling(
    limit_state: LimitState, d: int, *, seed: int, n: int = 4000, start: Rare | None = None, level: float = 0.95
) -> Rare:
    """Estimate the probability that limit_state(z) > 0 for standard normal z from points drawn where failure is.

    They come from normal distributions about the centres of up to 8 groups of the points of failure that ``start``
    found, and a tenth from where z itself does, so that no weight is above 10. It cannot tell of a region of failure
    that ``start`` has missed, but for that tenth.

    Args:
        limit_state: z (k, d) -> (k,), failure where above 0, nan counted so; asked for n points in one call.
        d: number of random quantities.
        seed: of the random numbers.
        n: points.
        start: what `subset_simulation` found; one with 3000 points a level is made if None.
        level: confidence level of the interval, which takes the logarithm of the estimate as normal.

    Returns:
        The estimate; ``runs`` and ``failed`` are those of ``start`` too. It is not ``trusted`` where the weights leave
        fewer than 50 effective failures, (sum w)^2 / sum w^2, or the interval and that of ``start`` do not meet.

    Raises:
        InputError: n below 100, another d than that of ``start``, or limit_state returned the wrong number of values.
    """
    check_level(level)
    if n < 100:
        raise InputError(f"n must be at least 100 (got {n})")
    rng = np.random.default_rng(seed)
    start = start or subset_simulation(limit_state, d, seed=int(rng.integers(2**32)), n=3000, level=level)
    if start.points.shape[1] != d:
        raise InputError(f"start must be of the same {d} quantities (got {start.points.shape[1]})")
    ask = _Asker(limit_state)
    ask.runs, ask.failed = start.runs, start.failed
    if not len(start.points):
        return ask.nothing(f"no points of failure to start from: {start.status}", start.upper, level, [], d)
    centres, share = _centres(start.points, rng)
    which = rng.choice(len(share), n, p=share)
    z = centres[which] + rng.standard_normal((n, d))
    g = ask(z)
    # density of the mixture over that of z, by the component's centre c: exp(c z - c c / 2)
    ratio = np.exp(z @ centres.T - (centres**2).sum(axis=1) / 2) @ share
    w = np.where(g > 0, 1.0 / ratio, 0.0)
    total = float(w.sum())
    if total == 0.0:
        return ask.nothing("no failure among the points drawn where it should be", start.upper, level, [], d)
    value = total / n
    cov = float(w.std(ddof=1)) / value / math.sqrt(n)
    effective = total**2 / float((w**2).sum())
    unknown = float(w[np.isposinf(g)].sum()) / total
    lower, upper = _lognormal(value, cov**2, unknown, level)
    meets = lower <= start.upper and start.lower <= upper
    status = f"{int((w > 0).sum())} of {n} points fail, as good as {effective:.0f} independent failures"
    if effective < _FEW:
        status += f"; fewer than {_FEW:.0f}: not to be trusted, take more points or subset simulation"
    if not meets:
        status += (
            f"; at odds with the start, {start.value:.3g} ({start.lower:.3g} to {start.upper:.3g}): not to be trusted"
        )
    if unknown:
        status += f"; {unknown:.0%} of the estimate are runs that failed (nan), counted as failures"
    return Rare(
        value=value,
        lower=lower,
        upper=upper,
        level=level,
        cov=cov,
        runs=ask.runs,
        failed=ask.failed,
        trusted=meets and effective >= _FEW,
        status=status,
        thresholds=(0.0,),
        effective=effective,
        points=frozen(z[g > 0]),
    )


def _centres(points: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Centres (m, d) of groups of points (k, d), the origin last, and the share (m,) to draw about each."""
    from scipy.cluster.vq import kmeans2

    k = min(_CENTRES, 1 + len(points) // 20)
    with warnings.catch_warnings():  # of a group that ends up empty: it is left out
        warnings.simplefilter("ignore", UserWarning)
        centres, group = kmeans2(points, k, minit="++", rng=rng)
    size = np.bincount(group, minlength=k)
    centres, size = centres[size > 0], size[size > 0]
    share = np.append((1.0 - _DEFENSIVE) * size / size.sum(), _DEFENSIVE)
    return np.concatenate([centres, np.zeros((1, points.shape[1]))]), share
