"""The published study, recomputed from the paper's own Table 9 (doi 10.1186/s10033-022-00755-8).

A failure here means that a step of the chain no longer does what the paper did.
"""

from importlib.resources import files

import numpy as np
import pandas as pd
import pytest

from trainmj.study import (
    Factor,
    Space,
    accuracy,
    correlate,
    entropy_weights,
    fit_polynomial,
    given,
    parse_terms,
)

TERMS = ("1", "D", "M", "D^2", "M^2", "D*M", "D^3", "M^3")


def published(name):
    return pd.read_csv(files("trainmj.paper") / "published" / f"{name}.csv")


@pytest.fixture(scope="module")
def table9():
    return published("table9_doe_responses")


@pytest.fixture(scope="module")
def space():
    return Space((Factor("D", 20, 50, unit="mm", kind="integer"), Factor("M", 30, 36, unit="t", kind="integer")))


@pytest.fixture(scope="module")
def x(table9):
    return table9[["D_mm", "M_t"]].to_numpy(dtype=float)


@pytest.fixture(scope="module")
def models(table9, space, x):
    terms = parse_terms(TERMS, space.names)
    return {name: fit_polynomial(x, table9[f"{name}_{unit}"], space=space, terms=terms) for name, unit in UNITS.items()}


UNITS = {"TS": "mm", "TAMA": "g"}


def test_table_10_correlations_to_the_printed_digit(table9, x):
    printed = published("table10_correlation").set_index("parameter")
    found = correlate(x, table9.iloc[:, 3:], x_names=("D", "M"), y_names=printed.columns).matrix()
    # printed -0.819, cut off: Table 9's rounding moves r by less than 0.0001
    assert found.loc["D", "stroke_m2_m3"] == pytest.approx(-0.81967, abs=5e-6)
    found.loc["D", "stroke_m2_m3"] = -0.819
    np.testing.assert_array_equal(found.to_numpy().round(3), printed.to_numpy())


def test_eq_7_coefficients_within_the_rounding_of_table_9(models, table9, x):
    """Rounding TS to 0.01 mm in Table 9 moves the constant by up to 34; each printed coefficient lies within that."""
    printed = published("eq7_eq8_coefficients_as_printed").set_index("term")["TS_mm"]
    found = models["TS"].coefficients()
    d, m = x.T
    columns = np.stack([np.ones(10), d, m, d**2, m**2, d * m, d**3, m**3], axis=1)
    reach = (
        0.005 * np.abs(np.linalg.pinv(columns, rcond=1e-17)).sum(axis=1) + 0.0005
    )  # Table 9's and the equation's digits
    assert list(found.index) == list(TERMS) == list(printed.index)
    assert (np.abs(found - printed) <= reach).all()
    np.testing.assert_allclose(found["1"], 4050.37959, atol=1e-3)


def test_eq_8_coefficients_with_more_digits_than_printed(models):
    expected = [-12.771, -0.0459, 1.4618, 0.00158, -0.04684, -0.00022, -1.5e-5, 0.000487]
    digits = [5e-4, 5e-5, 5e-5, 5e-6, 5e-6, 5e-6, 5e-7, 5e-7]
    assert (np.abs(models["TAMA"].coefficients().to_numpy() - expected) <= digits).all()


def test_table_13_optimum_predicted_by_the_surrogates(models):
    printed = published("table13_optimum").set_index("method").loc["surrogate"]
    at = [[printed["D_mm"], printed["M_t"]]]
    assert models["TS"].predict(at)[0] == pytest.approx(1307.52, abs=0.005)
    assert round(models["TS"].predict(at)[0], 1) == printed["TS_mm"]
    assert round(models["TAMA"].predict(at)[0], 1) == printed["TAMA_g"]


def test_table_11_leave_one_out_over_the_range_to_the_printed_digit(models, table9):
    printed = published("table11_surrogate_accuracy").set_index("criterion")
    for name, unit in UNITS.items():
        found = accuracy(table9[f"{name}_{unit}"], models[name].leave_one_out(), over="range")
        assert [round(v, 3) for v in (found.are, found.rmse, found.r2)] == printed.loc[name].tolist()


def test_table_12_entropy_weights_to_the_printed_digit(table9):
    printed = published("table12_entropy_weights").set_index("criterion")
    found = entropy_weights(table9[["TS_mm", "TAMA_g"]], form="paper", transform="raw", names=("TS", "TAMA"))
    np.testing.assert_array_equal(found.table().round(5).to_numpy(), printed.to_numpy())
    np.testing.assert_allclose(found.entropy, [2.301106, 2.300933], atol=5e-7)


def test_t_scores_as_the_text_says_change_the_sides_of_the_weights(table9):
    found = entropy_weights(table9[["TS_mm", "TAMA_g"]], form="paper", transform="t_score")
    np.testing.assert_allclose(found.entropy, [2.2825, 2.2826], atol=5e-5)
    assert found.weight[0] < 0.5 < found.weight[1]


def test_quality_of_the_papers_own_ten_points(space, x):
    quality = given(space, x).quality()
    assert quality.smallest_distance == pytest.approx(0.348, abs=5e-4)
    assert quality.levels == (10, 7)
