"""Weights and picks: worked examples, invariants, agreement with another library."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given as forall
from hypothesis import settings
from hypothesis.extra.numpy import arrays

from trainmj.doe import entropy_weights, knee_point, normalise, own_weights, topsis, weight_sensitivity, weighted_sum
from trainmj.doe.weights import t_scores
from trainmj.errors import InputError

# four fighter aircraft by speed, range, payload, price, reliability, manoeuvrability
# (the worked example of Hwang and Yoon 1981, doi 10.1007/978-3-642-48318-9)
AIRCRAFT = np.array(
    [
        [2.0, 1500, 20000, 5.5, 5, 9],
        [2.5, 2700, 18000, 6.5, 3, 5],
        [1.8, 2000, 21000, 4.5, 7, 7],
        [2.2, 1800, 20000, 5.0, 5, 5],
    ]
)
BENEFIT = [True, True, True, False, True, True]
positive = arrays(float, st.tuples(st.integers(3, 10), st.integers(2, 4)), elements=st.floats(0.1, 10), unique=True)


def test_entropy_weights_of_the_published_aircraft_example():
    """The book rounds the shares to four digits before it takes their logarithms, hence the tolerance."""
    found = entropy_weights(AIRCRAFT)
    np.testing.assert_allclose(found.entropy, [0.9946, 0.9829, 0.9989, 0.9931, 0.9703, 0.9770], atol=2e-4)
    np.testing.assert_allclose(found.weight, [0.0649, 0.2055, 0.0133, 0.0829, 0.3570, 0.2764], atol=2e-3)


def test_topsis_of_the_published_aircraft_example():
    found = topsis(AIRCRAFT, [0.2, 0.1, 0.1, 0.1, 0.2, 0.3], maximise=BENEFIT)
    np.testing.assert_allclose(found.score, [0.643, 0.268, 0.613, 0.312], atol=1.5e-3)
    assert found.order.tolist() == [0, 2, 3, 1]


@settings(max_examples=25, deadline=None)
@forall(positive)
def test_entropy_weights_agree_with_pymcdm(values):
    weights = pytest.importorskip("pymcdm.weights")
    np.testing.assert_allclose(entropy_weights(values).weight, weights.entropy_weights(values), atol=1e-9)


@pytest.mark.filterwarnings("ignore:Alternatives with indices")
@settings(max_examples=25, deadline=None)
@forall(positive)
def test_topsis_agrees_with_pymcdm(values):
    methods = pytest.importorskip("pymcdm.methods")
    normalisations = pytest.importorskip("pymcdm.normalizations")
    w = np.full(values.shape[1], 1 / values.shape[1])
    oracle = methods.TOPSIS(normalisations.minmax_normalization)(values, w, -np.ones(values.shape[1]))
    np.testing.assert_allclose(topsis(values, w, normalisation="min_max").score, oracle, atol=1e-9)


@settings(max_examples=25, deadline=None)
@forall(positive, st.floats(0.01, 100))
def test_weights_add_to_one_and_units_do_not_matter(values, factor):
    for normalised in (False, True):
        try:
            found = entropy_weights(values, normalised=normalised)
        except InputError:  # of few alternatives some weights are negative
            assert not normalised
            continue
        assert found.weight.sum() == pytest.approx(1)
        scaled = values.copy()
        scaled[:, 0] *= factor
        np.testing.assert_allclose(entropy_weights(scaled, normalised=normalised).weight, found.weight, atol=1e-9)


@pytest.mark.parametrize("normalised", [True, False])
@pytest.mark.parametrize("transform", ["raw", "t_score", "min_max"])
@pytest.mark.parametrize("constant", [800.0, 0.0, -3.0, 0.1])
def test_a_constant_criterion_weighs_exactly_nothing(transform, constant, normalised):
    """A weight of -5e-14 ended a study in which one objective was the same everywhere."""
    for n in range(2 if normalised else 12, 61):
        steady = constant * (1 + np.where(np.arange(n) % 2, 2e-16, 0.0))  # and one that varies by round-off
        values = np.column_stack([np.linspace(1, 2, n), np.full(n, constant), np.linspace(3, 4, n) ** 2, steady])
        weight = entropy_weights(values, transform=transform, normalised=normalised).weight
        assert weight[1] == weight[3] == 0
        assert not np.signbit(weight).any()
        assert (weight[[0, 2]] > 0).all()


def test_a_difference_that_rounding_would_hide_is_kept():
    """Shares that differ by 1e-9: 1 - e is 1e-19, which 1 - 0.9999999999999999 cannot hold."""
    values = np.column_stack([[1, 1 + 1e-9], [1, 1 + 2e-9]])
    np.testing.assert_allclose(entropy_weights(values).weight, [0.2, 0.8], rtol=1e-5)


@settings(max_examples=60, deadline=None)
@forall(
    arrays(
        float, st.tuples(st.integers(2, 40), st.integers(1, 3)), elements=st.sampled_from([-7.0, 0, 0, 0, 1, 2, 90])
    ),
    st.sampled_from(["raw", "t_score", "min_max"]),
    st.booleans(),
)
def test_the_cure_that_a_refusal_proposes_works(values, transform, normalised):
    """A user who does as told must not be refused again."""
    try:
        entropy_weights(values, transform=transform, normalised=normalised)
    except InputError as error:
        said = str(error).rpartition(": ")[2]
        if said == "give equal weights, or your own":
            own_weights(dict.fromkeys(range(values.shape[1]), 1))
            return
        other = next((t for t in ("raw", "t_score", "min_max") if f"{t} data" in said), transform)
        entropy_weights(values, transform=other, normalised=normalised or "normalised" in said)


def test_entropies_divided_by_ln_n_or_not_favour_opposite_criteria():
    values = np.stack([np.linspace(1, 2, 10), np.linspace(1, 10, 10)], axis=1)  # the second varies more
    assert entropy_weights(values).weight[1] > 0.5
    found = entropy_weights(values, normalised=False)
    assert found.weight[1] < 0.5
    assert (found.difference < 0).all()
    assert "not divided by ln n" in found.description


def test_a_dominating_alternative_wins_every_way():
    values = np.array([[3.0, 3.0], [1.0, 1.0], [2.0, 4.0]])
    for normalisation in ("min_max", "max", "sum", "vector", "none"):
        for method in (weighted_sum, topsis):
            assert method(values, [0.3, 0.7], normalisation=normalisation).best == 1
    assert weighted_sum(values, [1, 1], maximise=[True, True]).best != 1


def test_weighted_sum_by_hand():
    found = weighted_sum([[0, 10], [5, 4], [10, 0]], [0.5, 0.5])
    np.testing.assert_allclose(found.score, [-0.5, -0.45, -0.5])
    assert found.order[0] == found.best == 1


def test_knee_of_a_bent_front():
    t = np.linspace(0, 1, 101)
    front = np.stack([t * 1000, (1 - np.sqrt(t)) * 0.2 + 1.3], axis=1)
    assert t[knee_point(front).best] == pytest.approx(0.25)  # where 1 - sqrt(t) has slope -1
    straight = np.stack([t, 1 - t], axis=1)
    np.testing.assert_allclose(knee_point(straight).score, 0, atol=1e-12)


STEADY = 353.1 * (1 + 1e-13 * np.array([0, 3, -2, 1, -4, 2]))  # the same but for round-off
FALLING = np.array([6.0, 5, 3, 2.5, 2, 1])


@pytest.mark.parametrize("normalisation", ["min_max", "max", "sum", "vector", "none"])
@pytest.mark.parametrize("method", [weighted_sum, topsis])
@pytest.mark.parametrize("column", [STEADY, np.full(6, 353.1), np.zeros(6)])
def test_a_constant_criterion_decides_nothing(method, normalisation, column):
    """Scaled to [0, 1], round-off would weigh as much as what varies."""
    assert method(np.stack([column, FALLING], axis=1), [0.9, 0.1], normalisation=normalisation).order.tolist() == [
        *range(5, -1, -1)
    ]
    alike = method(np.stack([column, column], axis=1), [0.3, 0.7], normalisation=normalisation)
    assert np.ptp(alike.score) == 0
    assert alike.best == 0


@pytest.mark.parametrize("column", [STEADY, np.full(6, 353.1), np.zeros(6)])
def test_knee_of_a_front_with_a_constant_criterion_is_that_of_the_others(column):
    front = np.stack([FALLING, FALLING[::-1] ** 2], axis=1)
    with_it = knee_point(np.column_stack([column, front]))
    np.testing.assert_allclose(with_it.score, knee_point(front).score)
    alone = knee_point(np.stack([column, FALLING], axis=1))
    assert alone.order.tolist() == [*range(5, -1, -1)]
    assert np.ptp(knee_point(np.stack([column, column], axis=1)).score) == 0


def test_the_knee_is_the_alternative_that_is_best_in_everything():
    assert knee_point([[3, 3], [2, 4], [1, 1]]).best == 2
    assert knee_point([3, 1, 2]).best == 1


def test_weights_of_constant_criteria_do_not_move_the_pick():
    found = weight_sensitivity(np.stack([STEADY, FALLING], axis=1), [0.5, 0.5], seed=0, method=weighted_sum)
    assert (found.best, found.share[5], found.lower[0]) == (5, 1, 0)
    assert found.upper[0] > 0.999


def test_normalised_columns():
    x = [[1.0, 5.0], [3.0, 5.0]]
    np.testing.assert_allclose(normalise(x, "min_max"), [[0, 0], [1, 0]])
    np.testing.assert_allclose(normalise(x, "sum").sum(axis=0), 1)
    np.testing.assert_allclose((normalise(x, "vector") ** 2).sum(axis=0), 1)


def test_weight_interval_is_where_the_pick_changes():
    """By hand: the middle beats the ends of (0,10) (5,4) (10,0) for first weights from 4/9 to 6/11."""
    values = [[0, 10], [5, 4], [10, 0]]
    found = weight_sensitivity(values, [0.5, 0.5], seed=0, method=weighted_sum)
    low, high = found.lower[0], found.upper[0]
    assert (found.best, found.share.sum()) == (1, pytest.approx(1))
    assert low == pytest.approx(4 / 9, abs=1e-5)
    assert high == pytest.approx(6 / 11, abs=1e-5)
    np.testing.assert_allclose(found.lower[1], 1 - high, atol=1e-5)
    assert np.argmax(found.share) == 1


def test_own_weights_are_scaled_to_one():
    np.testing.assert_allclose(own_weights({"TS": 3, "TAMA": 1}).weight, [0.75, 0.25])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: entropy_weights([[1, 2]]), "at least 2 alternatives"),
        (
            lambda: entropy_weights([[1, -2], [1, 3]], names=("a", "b")),
            "'b' has negative values, .*: take min_max data",
        ),
        (lambda: entropy_weights([[1, 2], [1, 2]], names=("a", "b")), r"no criterion \(a, b\) varies"),
        (
            lambda: entropy_weights([[1, 2], [2, 300], [3, 4]], normalised=False),
            r"negative weights \('y1' -0.01297\): take",
        ),
        (lambda: t_scores([[1, 2], [1, 3]]), r"columns \[0\]"),
        (lambda: t_scores(np.stack([FALLING, STEADY], axis=1)), r"columns \[1\]"),
        (lambda: entropy_weights(STEADY), r"no criterion \(y1\) varies"),
        (lambda: entropy_weights([[1, 2], [2, 3]], transform="t-score"), "'raw', 't_score' or 'min_max'"),
        (lambda: own_weights({"a": -1}), "at least 0"),
        (lambda: own_weights({}), "at least 0"),
        (lambda: topsis([[1, 2], [2, 1]], [1]), "2 values, one for each criterion"),
        (lambda: topsis([[1, 2], [2, 1]], [1, -1]), "at least 0"),
        (lambda: topsis([[1, 2], [2, 1]], [1, 1], maximise=[True]), "one for each criterion, True or False"),
        (lambda: weighted_sum([[1, 2], [2, 1]], [1, 1], normalisation="minmax"), "normalisation must be 'min_max'"),
        (lambda: weight_sensitivity([[1, 2], [2, 1]], [1, 1], seed=0, spread=0), "spread must be above 0"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()
