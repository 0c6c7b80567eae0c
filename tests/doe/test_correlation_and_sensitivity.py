"""Correlation and Sobol' indices against other implementations and known answers."""

import numpy as np
import pytest
import scipy.stats
from builders import few
from known import g_function, g_shares, ishigami

from trainmj.doe import (
    Factor,
    Marginal,
    Scatter,
    Space,
    correlate,
    sobol_indices,
    sobol_points,
    sobol_sensitivity,
)
from trainmj.errors import InputError


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(5)
    x = rng.standard_normal((20, 2))
    return x, np.stack([x[:, 0] + rng.standard_normal(20), np.exp(x[:, 1]), x[:, 0] * 2], axis=1)


@pytest.mark.parametrize("method", ["pearson", "spearman"])
def test_coefficients_and_probabilities_agree_with_scipy(data, method):
    x, y = data
    found = correlate(x, y, method=method)
    for i in range(2):
        for j in range(3):
            oracle = getattr(scipy.stats, f"{method}r")(x[:, i], y[:, j])
            assert found.r[i, j] == pytest.approx(oracle.statistic, abs=1e-12)
            assert found.p[i, j] == pytest.approx(oracle.pvalue, abs=1e-9)


def test_pearson_interval_agrees_with_scipy(data):
    x, y = data
    found = correlate(x, y, level=0.9)
    oracle = scipy.stats.pearsonr(x[:, 0], y[:, 0]).confidence_interval(0.9)
    np.testing.assert_allclose([found.lower[0, 0], found.upper[0, 0]], oracle, atol=1e-12)


def test_perfect_correlation_and_constant_column():
    x = np.arange(5.0)
    found = correlate(x, np.stack([2 * x, np.full(5, 353.1)], axis=1))
    assert (found.r[0, 0], found.lower[0, 0], found.upper[0, 0], found.p[0, 0]) == pytest.approx((1, 1, 1, 0), abs=1e-6)
    assert np.isnan(found.r[0, 1])  # a coupler that always reaches its end is not correlated with anything
    assert found.table().shape == (2, 6)


@pytest.mark.parametrize("method", ["pearson", "spearman"])
def test_round_off_is_not_correlated_with_anything(method):
    x = np.arange(6.0)
    found = correlate(x, 353.1 * (1 + 1e-13 * x), method=method)
    assert np.isnan([found.r, found.lower, found.upper, found.p]).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: correlate([1, 2], [1, 2]), "at least 3 points"),
        (lambda: correlate([1, 2, 3], [1, 2]), "as many rows"),
        (lambda: correlate([1, 2, 3], [1, 2, 4], method="pearsn"), "'pearson' or 'spearman'"),
        (lambda: correlate([1, 2, 3], [1, 2, 4], level=95), "between 0 and 1"),
        (lambda: correlate([1, 2, 3], [1, 2, "a"]), "must be numbers"),
        (lambda: correlate([1, 2, 3], [1, 2, 4], x_names=("a", "b")), "name each of the 1 columns"),
        (lambda: sobol_sensitivity(BOX, lambda x: x[:, 0], n=100, seed=0), "power of two"),
        (lambda: sobol_points(3, 8, seed=0, groups=["a", "b"]), "group for each of the 3 columns"),
        (lambda: sobol_indices(np.arange(9.0), ("a", "b"), seed=0), "whole samples of 4 points"),
        (lambda: sobol_indices([1, np.inf, 1, 2, 3, 4], ("a",), seed=0), "finite, or nan"),
        (lambda: sobol_indices([1, np.nan, 1, 2, 3, 4], ("a",), seed=0), r"at least 2 samples .*1 of 2"),
        (lambda: sobol_sensitivity(BOX, lambda x: 0 * x[:, 0], n=64, seed=0), "must vary"),
        (lambda: sobol_sensitivity(BOX, lambda x: 353.1 + 1e-11 * x[:, 0], n=64, seed=0), "must vary"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()


BOX = Space(tuple(Factor(f"x{i}", -np.pi, np.pi) for i in range(3)))


def test_sobol_indices_of_ishigami():
    found = sobol_sensitivity(BOX, ishigami, n=4096, seed=1)
    np.testing.assert_allclose(found.first, [0.3139, 0.4424, 0.0], atol=0.02)
    np.testing.assert_allclose(found.total, [0.5576, 0.4424, 0.2437], atol=0.02)
    assert ((found.total_interval[:, 0] <= found.total) & (found.total <= found.total_interval[:, 1])).all()
    assert found.table().shape == (3, 6)


def test_sensitivity_repeats_with_its_seed():
    a, b = (sobol_sensitivity(BOX, ishigami, n=256, seed=7) for _ in range(2))
    np.testing.assert_array_equal(a.table(), b.table())


def test_indices_agree_with_scipy_on_the_same_sample_size():
    found = sobol_sensitivity(BOX, ishigami, n=4096, seed=1)
    oracle = scipy.stats.sobol_indices(
        func=lambda x: ishigami(x.T)[None, :],
        n=4096,
        dists=[scipy.stats.uniform(-np.pi, 2 * np.pi)] * 3,
        rng=np.random.default_rng(1),
    )
    np.testing.assert_allclose(found.first, oracle.first_order.ravel(), atol=0.02)
    np.testing.assert_allclose(found.total, oracle.total_order.ravel(), atol=0.02)


ISHIGAMI = ([0.31390, 0.44241, 0], [0.55759, 0.44241, 0.24368])


def on_cube(u):
    return ishigami(np.pi * (2 * u - 1))


@pytest.mark.parametrize(("function", "known", "d"), [(on_cube, ISHIGAMI, 3), (g_function, g_shares(), 8)])
@pytest.mark.parametrize("seeds", few([10, 40], 1))
def test_indices_are_within_two_hundredths_and_their_intervals_hold(function, known, d, seeds):
    """With 4096 samples for each of the seeds; the intervals of all indices together in at least 9 of 10."""
    held = 0
    for seed in range(seeds):
        found = sobol_indices(function(sobol_points(d, 4096, seed=seed)), "abcdefgh"[:d], seed=seed, resamples=60)
        held += all(
            (np.abs(share - value) < 0.02).all() and (limits[:, 0] <= value).all() and (value <= limits[:, 1]).all()
            for share, limits, value in zip(
                (found[0].first, found[0].total), (found[0].first_interval, found[0].total_interval), known, strict=True
            )
        )
        np.testing.assert_allclose([found[0].first, found[0].total], known, atol=0.02)
    assert held >= 0.9 * seeds


def test_indices_are_those_of_salib_to_round_off():
    analyze = pytest.importorskip("SALib.analyze.sobol").analyze
    y = on_cube(sobol_points(3, 256, seed=1))
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[0, 1]] * 3}
    oracle = analyze(problem, y, calc_second_order=False, seed=1, num_resamples=10)
    found = sobol_indices(y, "abc", seed=1)[0]
    np.testing.assert_allclose(found.first, oracle["S1"], atol=1e-12)
    np.testing.assert_allclose(found.total, oracle["ST"], atol=1e-12)


def test_groups_are_salibs_and_share_what_their_columns_do_together():
    """x1 and x3 of Ishigami's function act together only: their group has all but what x2 has."""
    sample = pytest.importorskip("SALib.sample.sobol").sample
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[0, 1]] * 3, "groups": ["one", "two", "one"]}
    assert len(sample(problem, 16, calc_second_order=False, seed=1)) == 16 * (2 + 2)
    u = sobol_points(3, 1024, seed=1, groups=problem["groups"])
    a, one, two, b = u.reshape(1024, 4, 3).transpose(1, 0, 2)
    np.testing.assert_array_equal(one, np.column_stack([b[:, 0], a[:, 1], b[:, 2]]))
    np.testing.assert_array_equal(two, np.column_stack([a[:, 0], b[:, 1], a[:, 2]]))
    found = sobol_indices(on_cube(u), ("one", "two"), seed=1)[0]
    np.testing.assert_allclose(found.first, [0.5576, 0.4424], atol=0.02)
    np.testing.assert_allclose(found.total, [0.5576, 0.4424], atol=0.02)


def test_many_responses_of_any_distribution_with_runs_that_failed():
    """A sum of normal quantities has their variances as shares; a failed run takes its sample with it, no other."""
    scatter = Scatter((Marginal.normal("a", 5, 1), Marginal.normal("b", 7, 2), Marginal.lognormal("c", 1, 0.3)))
    x = scatter.at_normal(scipy.stats.norm.ppf(sobol_points(3, 1024, seed=3)))
    y = np.stack([x[:, 0] + x[:, 1], x[:, 2], np.full(len(x), 353.1), x[:, 0]], axis=1)
    y[[7, 8, 4000], 3] = np.nan
    both, own, constant, gaps = sobol_indices(y, scatter.names, seed=1)
    np.testing.assert_allclose([both.first, both.total], [[0.2, 0.8, 0]] * 2, atol=0.01)
    np.testing.assert_allclose([own.first, own.total], [[0, 0, 1]] * 2, atol=0.01)
    assert np.isnan([constant.first, constant.total, *constant.first_interval.T]).all()
    assert (gaps.n, gaps.left_out, both.left_out) == (1022, 2, 0)
    kept = np.delete(y[:, 3].reshape(1024, 5), [1, 800], axis=0)
    np.testing.assert_array_equal(gaps.first, sobol_indices(y[:, 3], scatter.names, seed=9)[0].first)
    np.testing.assert_allclose(gaps.first, sobol_indices(kept.ravel(), scatter.names, seed=9)[0].first, atol=1e-12)
