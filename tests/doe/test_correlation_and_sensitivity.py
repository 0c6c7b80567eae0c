"""Correlation and Sobol' indices against other implementations and known answers."""

import numpy as np
import pytest
import scipy.stats
from known import ishigami

from trainmj.doe import Factor, Space, correlate, sobol_sensitivity
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
