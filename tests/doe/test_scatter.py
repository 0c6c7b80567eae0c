"""Quantities that scatter, and draws that can be asked for by number."""

import numpy as np
import pytest
import scipy.stats

from trainmj.doe import Marginal, Scatter, mean_interval, normal_draws, replicates_of
from trainmj.errors import InputError

NORMAL = Marginal.normal("M", 32, 0.5, unit="t")
ALL = {
    "normal": (NORMAL, scipy.stats.norm(32, 0.5)),
    "truncated": (Marginal.truncated_normal("T", 1, 2, 0, 4), scipy.stats.truncnorm(-0.5, 1.5, 1, 2)),
    "uniform": (Marginal.uniform("U", 2, 5), scipy.stats.uniform(2, 3)),
    "lognormal": (Marginal.lognormal("L", 10, 2), scipy.stats.lognorm(np.sqrt(np.log(1.04)), 0, 10 / np.sqrt(1.04))),
}
WHEEL = Marginal.discrete("wheel", ("new", "worn", "flat"), (0.2, 0.5, 0.3))


@pytest.mark.parametrize("name", ALL)
def test_marginals_are_the_distributions_of_their_names(name):
    ours, oracle = ALL[name]
    u = np.array([1e-6, 0.1, 0.5, 0.9, 1 - 1e-6])
    np.testing.assert_allclose(ours.ppf(u), oracle.ppf(u), rtol=1e-12)
    np.testing.assert_allclose(ours.at_normal(scipy.stats.norm.ppf(u)), oracle.ppf(u), rtol=1e-9)
    assert (ours.mean, ours.sd) == (pytest.approx(oracle.mean()), pytest.approx(oracle.std()))
    assert np.isfinite(ours.at_normal([-8.0, 8.0])).all()


def test_mean_and_deviation_are_those_that_were_asked_for():
    assert (ALL["lognormal"][0].mean, ALL["lognormal"][0].sd) == pytest.approx((10, 2))
    assert NORMAL.at_normal([-9.0, 9.0]) == pytest.approx([27.5, 36.5], rel=1e-12)  # 1 - 1e-19 is 1 as a probability


def test_discrete_levels_come_as_often_as_stated_and_may_be_text():
    values = WHEEL.at_normal(normal_draws(1, 8000, seed=1)[:, 0])
    np.testing.assert_allclose(np.bincount(values.astype(int)) / 8000, [0.2, 0.5, 0.3], atol=0.002)
    assert [WHEEL.decode(v) for v in WHEEL.ppf([0.0, 0.2, 0.21, 0.7, 0.71, 1.0])] == [
        *("new", "new", "worn", "worn", "flat", "flat")
    ]
    assert np.isnan([WHEEL.mean, WHEEL.sd]).all()
    number = Marginal.discrete("n", (1, 2, 5))
    assert (number.mean, number.sd) == pytest.approx((8 / 3, np.std([1, 2, 5])))


def test_correlated_quantities_have_the_ranks_of_their_normal_scores():
    """Spearman's coefficient is 6 / pi asin(r / 2), whatever the distributions."""
    scatter = Scatter((NORMAL, ALL["lognormal"][0], WHEEL), [[1, 0.7, 0], [0.7, 1, 0.2], [0, 0.2, 1]])
    x = scatter.at_normal(scatter.draws(8192, seed=2))
    assert scipy.stats.spearmanr(x[:, 0], x[:, 1])[0] == pytest.approx(6 / np.pi * np.arcsin(0.35), abs=0.01)
    np.testing.assert_allclose(x[:, 1].mean(), 10, rtol=0.01)
    assert scatter.decode(x[0])["wheel"] in WHEEL.levels


@pytest.mark.parametrize("method", ["sobol", "random", "latin_hypercube"])
def test_draws_are_the_same_however_many_are_asked_for(method):
    """A run that was stopped, or made longer, has the numbers of one that was not."""
    whole = normal_draws(3, 2200, seed=4, method=method)
    parts = [(0, 5), (5, 1), (6, 700), (706, 1494)]
    again = [normal_draws(3, n, seed=4, method=method, first=first) for first, n in parts]
    np.testing.assert_array_equal(np.concatenate(again), whole)
    names = [replicates_of(n, method=method, first=first) for first, n in parts]
    np.testing.assert_array_equal(np.concatenate(names), replicates_of(2200, method=method))
    assert np.isfinite(whole).all()
    np.testing.assert_allclose(whole.mean(axis=0), 0, atol=0.06)
    np.testing.assert_allclose(whole.std(axis=0), 1, atol=0.05)
    assert (normal_draws(3, 5, seed=5, method=method) != whole[:5]).any()


@pytest.mark.parametrize("method", ["sobol", "random", "latin_hypercube"])
def test_replicates_are_independent_and_their_means_tell_the_error(method):
    """The 95 % interval of a mean that is known holds in at least 9 of 10 seeds; quasi-random ones are narrower."""
    held, width = 0, []
    for seed in range(20):
        z = normal_draws(4, 1600, seed=seed, method=method)
        found = mean_interval(np.exp(0.3 * z.sum(axis=1)), replicates_of(1600, method=method))
        held += found.lower <= np.exp(0.18) <= found.upper
        width.append(found.upper - found.lower)
    assert held >= 18
    assert np.median(width) < {"sobol": 0.03, "random": 0.1, "latin_hypercube": 0.05}[method]


def test_the_sobol_points_are_quasi_random_and_many_quantities_fit():
    z = normal_draws(2, 8 * 256, seed=1)
    counts = np.bincount((scipy.stats.norm.cdf(z[0::8, 0]) * 256).astype(int))
    np.testing.assert_array_equal(counts, np.ones(256))  # of each replicate one point in each of 256 equal parts
    assert np.isfinite(normal_draws(1500, 4, seed=1, replicates=1)).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Marginal.normal("M", 1, 0), "'M': sd must be finite and above 0"),
        (lambda: Marginal.normal("M", np.nan, 1), "mean must be finite"),
        (lambda: Marginal.normal("", 1, 1), "must have a name"),
        (lambda: Marginal.uniform("U", 2, 2), "lower must be below upper"),
        (lambda: Marginal.truncated_normal("T", 0, 1, 20, 30), "next to nothing"),
        (lambda: Marginal.lognormal("L", -1, 1), "must be above 0"),
        (lambda: Marginal.discrete("W", ("a",)), "two different levels"),
        (lambda: Marginal.discrete("W", ("a", "b"), (0.5, 0.6)), r"add up to 1 .*sum 1\.1"),
        (lambda: Marginal.discrete("W", ("a", "b"), (1, 0)), "above 0"),
        (lambda: Scatter(()), "at least one"),
        (lambda: Scatter((NORMAL, NORMAL)), "must differ"),
        (lambda: Scatter((NORMAL, WHEEL), [[1, 0.5], [0.4, 1]]), "symmetric"),
        (lambda: Scatter((NORMAL, WHEEL), [[2, 0.5], [0.5, 1]]), "diagonal"),
        (lambda: Scatter((NORMAL, WHEEL), [[1, 1], [1, 1]]), r"'M' with 'wheel' must lie between -1 and 1"),
        (
            lambda: Scatter((NORMAL, WHEEL, ALL["uniform"][0]), [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]),
            r"positive definite \(its smallest eigenvalue is -0.8",
        ),
        (lambda: normal_draws(3, 0, seed=1), "n must be at least 1"),
        (lambda: normal_draws(3, 1, seed=-1), "seed must be at least 0"),
        (lambda: normal_draws(3, 1, seed=1, method="halton"), "'sobol', 'random' or 'latin_hypercube'"),
        (lambda: normal_draws(21202, 1, seed=1), "at most 21201 coordinates"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()
