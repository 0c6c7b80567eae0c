"""Polynomials and kriging: recovery of known functions, refusals, and agreement with other implementations."""

import itertools
from functools import partial

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given as forall
from hypothesis import settings

from trainmj.doe import (
    Factor,
    Space,
    accuracy,
    cross_validate,
    fit_kriging,
    fit_polynomial,
    full_order,
    optimal_latin_hypercube,
    parse_terms,
    select_terms,
    sobol,
)
from trainmj.doe.terms import columns, is_hierarchical
from trainmj.errors import InputError

SPACE = Space((Factor("D", 0.020, 0.050, unit="m"), Factor("M", 30e3, 36e3, unit="kg")))
CUBIC = full_order(2, 3)


def noisy(n=25, scale=0.1):
    x = sobol(SPACE, n, seed=2).points
    z = SPACE.to_coded(x)
    return x, 3 + 2 * z[:, 0] - z[:, 1] + 0.5 * z[:, 0] * z[:, 1] + scale * np.random.default_rng(1).standard_normal(n)


@settings(max_examples=30, deadline=None)
@forall(st.lists(st.floats(-10, 10), min_size=len(CUBIC), max_size=len(CUBIC)))
def test_a_known_polynomial_is_recovered_in_natural_units(coefficients):
    """SI units on purpose: M^3 is of the order 1e13, which unscaled least squares does not survive."""
    x = sobol(SPACE, 30, seed=3).points
    scale = 1.0 / np.abs(columns(x, CUBIC)).max(axis=0)
    truth = np.array(coefficients) * scale
    model = fit_polynomial(x, columns(x, CUBIC) @ truth, space=SPACE, terms=CUBIC)
    np.testing.assert_allclose(model.predict(x), columns(x, CUBIC) @ truth, atol=1e-9)
    np.testing.assert_allclose(
        columns(x, CUBIC) @ model.coefficients().to_numpy(), columns(x, CUBIC) @ truth, atol=1e-6
    )


def test_terms_without_their_divisors_are_multiplied_out():
    x, y = noisy()
    model = fit_polynomial(x, y, space=SPACE, terms=parse_terms(["1", "D*M"], SPACE.names))
    assert not is_hierarchical(model.terms)
    natural = model.coefficients()
    assert set(natural.index) == {"1", "D", "M", "D*M"}
    d, m = x.T
    by_hand = natural["1"] + natural["D"] * d + natural["M"] * m + natural["D*M"] * d * m
    np.testing.assert_allclose(by_hand, model.predict(x), rtol=1e-9)


@pytest.mark.parametrize("terms", [CUBIC, full_order(2, 1), parse_terms(["D", "M"], SPACE.names)])
def test_leave_one_out_is_what_fitting_again_gives(terms):
    x, y = noisy()
    model = fit_polynomial(x, y, space=SPACE, terms=terms)
    again = cross_validate(partial(fit_polynomial, space=SPACE, terms=terms), x, y)
    np.testing.assert_allclose(model.leave_one_out(), again, atol=1e-10)
    assert model.press == pytest.approx(((y - again) ** 2).sum())


def test_anova_agrees_with_statsmodels():
    api = pytest.importorskip("statsmodels.api")
    x, y = noisy()
    model = fit_polynomial(x, y, space=SPACE, terms=CUBIC)
    oracle = api.OLS(y, columns(SPACE.to_coded(x), CUBIC)).fit()
    table = model.anova()
    assert table.loc["model", "F"] == pytest.approx(oracle.fvalue)
    assert table.loc["model", "p"] == pytest.approx(oracle.f_pvalue)
    names = [n for n in model.term_names if n != "1"]
    np.testing.assert_allclose(table.loc[names, "F"], np.square(oracle.tvalues[1:]), rtol=1e-9)
    np.testing.assert_allclose(table.loc[names, "p"], oracle.pvalues[1:], atol=1e-12)


def test_selection_finds_the_terms_that_made_the_data():
    x, y = noisy(40, scale=0.02)
    for criterion in ("press", "bic"):
        found = select_terms(x, y, space=SPACE, candidates=CUBIC, criterion=criterion)
        assert is_hierarchical(found)
        assert set(parse_terms(["1", "D", "M", "D*M"], SPACE.names)) <= set(found)
    best = select_terms(x, y, space=SPACE, candidates=CUBIC, criterion="bic")
    assert set(best) == set(parse_terms(["1", "D", "M", "D*M"], SPACE.names))


def test_of_exact_fits_the_one_with_fewest_terms_is_selected():
    x, y = noisy(20, scale=0.0)
    for criterion in ("press", "bic"):
        found = select_terms(x, y, space=SPACE, candidates=CUBIC, criterion=criterion)
        assert set(found) == set(parse_terms(["1", "D", "M", "D*M"], SPACE.names))


def test_forward_search_takes_over_when_there_are_many_candidates():
    x, y = noisy(40, scale=0.02)
    many = select_terms(x, y, space=SPACE, candidates=full_order(2, 5), criterion="bic")
    assert set(parse_terms(["1", "D", "M", "D*M"], SPACE.names)) <= set(many)


def test_no_other_hierarchical_subset_has_a_smaller_press_than_the_selection():
    x, y = noisy()
    quadratic = full_order(2, 2)
    subsets = [t for n in range(1, 7) for t in itertools.combinations(quadratic, n) if is_hierarchical(t)]
    best = min(fit_polynomial(x, y, space=SPACE, terms=t).press for t in subsets)
    found = select_terms(x, y, space=SPACE, candidates=quadratic)
    assert fit_polynomial(x, y, space=SPACE, terms=found).press == pytest.approx(best)


X, Y = noisy(10)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: fit_polynomial(X[:9], Y[:9], space=SPACE, terms=CUBIC),
            "at least as many points as terms .got 9 points for 10",
        ),
        (lambda: fit_polynomial(X, Y, space=SPACE, terms=CUBIC).leave_one_out(), "more points than terms"),
        (lambda: fit_polynomial(X, Y, space=SPACE, terms=CUBIC).press, "more points than terms"),
        (lambda: fit_polynomial(X, Y, space=SPACE, terms=CUBIC).anova(), "more points than terms"),
        (
            lambda: fit_polynomial(TWO_LEVELS, Y[:8], space=SPACE, terms=full_order(2, 2)),
            r"cannot tell the terms \['M\^2'\]",
        ),
        (
            lambda: fit_polynomial(ALONE, Y[:5], space=SPACE, terms=full_order(2, 1)).press,
            r"points \[4\] .*leverage 1",
        ),
        (lambda: fit_polynomial(X, Y[:5], space=SPACE, terms=CUBIC), "10 values, one for each point .got 5"),
        (lambda: fit_polynomial(X, Y, space=SPACE, terms=[]), "at least one term"),
        (lambda: fit_polynomial(X, Y, space=SPACE, terms=[(0, 0), (0, 0)]), "only once"),
        (lambda: parse_terms(["D", "W"], SPACE.names), "term 'W': no factor 'W'"),
        (lambda: parse_terms(["D^1.5"], SPACE.names), "positive whole number"),
        (lambda: select_terms(X[:1], Y[:1], space=SPACE, candidates=CUBIC), "no subset"),
        (lambda: accuracy([1, 1], [1, 2]), "must vary"),
        (lambda: accuracy([0, 1], [1, 2]), "must not be zero"),
        (lambda: accuracy([0, 1], [1, 2], over="ranges"), "'value' or 'range'"),
        (lambda: cross_validate(partial(fit_polynomial, space=SPACE, terms=CUBIC), X, Y, folds=1), "between 2 and"),
        (lambda: fit_kriging(X[:2], Y[:2], space=SPACE, seed=0), "at least 3 points"),
        (lambda: fit_kriging(X, 0 * Y, space=SPACE, seed=0), "must vary"),
    ],
)
def test_what_cannot_be_answered_is_refused_with_the_reason(call, message):
    with pytest.raises(InputError, match=message):
        call()


TWO_LEVELS = SPACE.from_unit([[0, 0], [0.2, 0], [0.4, 0], [0.9, 0], [0, 1], [0.3, 1], [0.6, 1], [1, 1]])
ALONE = SPACE.from_unit([[0, 0], [0.2, 0], [0.4, 0], [0.9, 0], [0.5, 1]])


def test_accuracy_of_known_errors():
    found = accuracy([1.0, 2.0, 4.0], [1.1, 2.0, 3.8])
    assert (found.are, found.rmse) == pytest.approx(((0.1 + 0.05) / 3, np.sqrt(0.05 / 3)))
    assert found.largest == pytest.approx(0.2)
    over = accuracy([1.0, 2.0, 4.0], [1.1, 2.0, 3.8], over="range")
    assert (over.rmse, over.largest) == pytest.approx((np.sqrt(0.05 / 3) / 3, 0.2 / 3))


def branin(x):
    a, b = x.T
    return (b - 5.1 / (4 * np.pi**2) * a**2 + 5 / np.pi * a - 6) ** 2 + 10 * (1 - 1 / (8 * np.pi)) * np.cos(a) + 10


@pytest.fixture(scope="module")
def kriged():
    pytest.importorskip("sklearn")
    space = Space((Factor("a", -5, 10), Factor("b", 0, 15)))
    x = optimal_latin_hypercube(space, 36, seed=1, iterations=500).points
    return space, x, fit_kriging(x, branin(x), space=space, seed=1)


def test_kriging_follows_what_a_cubic_cannot(kriged):
    space, x, model = kriged
    new = sobol(space, 256, seed=3).points
    assert accuracy(branin(new), model.predict(new), over="range").rmse < 0.01
    fits = (partial(fit_polynomial, space=space, terms=CUBIC), partial(fit_kriging, space=space, seed=1, starts=0))
    cubic, kriging = (accuracy(branin(x), cross_validate(fit, x, branin(x), folds=6), over="range") for fit in fits)
    assert kriging.rmse < cubic.rmse


def test_kriging_leave_one_out_is_the_conditional_of_the_same_process(kriged):
    """The closed form against solving without each point, lengths and noise kept."""
    space, x, model = kriged
    kernel = model.regressor.kernel_
    covariance = kernel(space.to_unit(x)) + 1e-10 * np.eye(len(x))
    y = (model.y - model.y.mean()) / model.y.std()
    for i in (0, 7):
        rest = np.arange(len(x)) != i
        mean = covariance[i, rest] @ np.linalg.solve(covariance[np.ix_(rest, rest)], y[rest])
        assert model.leave_one_out()[i] == pytest.approx(mean * model.y.std() + model.y.mean(), rel=1e-6)


def test_kriging_repeats_with_its_seed(kriged):
    space, x, model = kriged
    np.testing.assert_array_equal(fit_kriging(x, branin(x), space=space, seed=1).predict(x), model.predict(x))


def test_missing_scikit_learn_names_the_extra(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "sklearn.gaussian_process", None)
    with pytest.raises(InputError, match=r"pip install 'trainmj\[kriging\]'"):
        fit_kriging(X, Y, space=SPACE, seed=0)


@pytest.mark.parametrize("spread", [0.0, 1e-13])
def test_a_constant_response_has_the_right_surface_and_no_variance_to_analyse(spread):
    x, _ = noisy()
    y = 353.1 * (1 + spread * np.sin(np.arange(len(x))))
    model = fit_polynomial(x, y, space=SPACE, terms=full_order(2, 2))
    np.testing.assert_allclose(model.predict(x), 353.1, rtol=1e-12)
    np.testing.assert_allclose(model.leave_one_out(), 353.1, rtol=1e-12)
    np.testing.assert_allclose(
        cross_validate(partial(fit_polynomial, space=SPACE, terms=CUBIC), x, y), 353.1, rtol=1e-12
    )
    assert (model.anova()["sum_of_squares"] == 0).all()
    assert model.anova()[["F", "p"]].isna().all(axis=None)
    with pytest.raises(InputError, match=r"must vary for R2 .*353\.1"):
        accuracy(y, model.predict(x))
    with pytest.raises(InputError, match=r"must vary for kriging .*353\.1"):
        fit_kriging(x, y, space=SPACE, seed=0)


@pytest.mark.parametrize("criterion", ["press", "bic"])
def test_a_constant_response_needs_the_constant_alone(criterion):
    x, _ = noisy()
    y = 353.1 * (1 + 1e-13 * np.sin(np.arange(len(x))))
    assert select_terms(x, y, space=SPACE, candidates=full_order(2, 2), criterion=criterion) == ((0, 0),)
