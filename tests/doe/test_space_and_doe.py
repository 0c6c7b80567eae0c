"""Factors, spaces and designs."""

import hypothesis.strategies as st
import numpy as np
import pandas as pd
import pytest
from hypothesis import given as forall
from hypothesis import settings

from trainmj.doe import (
    Design,
    Factor,
    Lattice,
    Space,
    central_composite,
    full_factorial,
    optimal_latin_hypercube,
    sobol,
)
from trainmj.errors import InputError

PAPER = Space((Factor("D", 20, 50, unit="mm", kind="integer"), Factor("M", 30, 36, unit="t", kind="integer")))
MIXED = Space(
    (
        Factor("c", 2.0, 3.0, unit="kN"),
        Factor("n", 0, 4, kind="integer"),
        Factor("k", kind="choice", levels=("a", "b", "z")),
    )
)


def unit_space(d):
    return Space(tuple(Factor(f"x{i}", 0, 1) for i in range(d)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Factor("D", 50, 20), r"'D': bounds must be finite with lower < upper \(got 50, 20\)"),
        (lambda: Factor("D"), "bounds must be finite"),
        (lambda: Factor("D", 0, 1, kind="whole"), "kind must be 'continuous', 'integer' or 'choice'"),
        (lambda: Factor("D", 0.5, 3, kind="integer"), "whole numbers"),
        (lambda: Factor("D", kind="choice", levels=("a",)), "at least two different levels"),
        (lambda: Factor("D", kind="choice", levels=(1, "1")), "at least two different levels"),
        (lambda: Factor("D", 0, 5, kind="choice", levels=("a", "b")), "levels, not bounds"),
        (lambda: Factor("D", 0, 1, levels=("a", "b")), "levels belong to kind='choice'"),
        (lambda: Space(()), "at least one factor"),
        (lambda: Space((Factor("D", 0, 1), Factor("D", 0, 2, unit="mm"))), "must differ"),
        (lambda: Space((Factor("D_mm", 0, 1), Factor("D", 0, 2, unit="mm"))), r"must differ .*'D_mm', 'D_mm'"),
        (lambda: Design(PAPER, [[20, 37]]), r"points\[0\], factor 'M': must lie in \[30, 36\] \(got 37\)"),
        (lambda: Design(PAPER, [[20.5, 33]]), "whole number"),
        (lambda: Design(PAPER, [[20, np.nan]]), "finite"),
        (lambda: PAPER.from_table(pd.DataFrame({"D": [20]})), "no column 'M'"),
        (lambda: MIXED.from_table(pd.DataFrame({"c": [2.5], "n": [1], "k": ["q"]})), "no level 'q'"),
        (lambda: optimal_latin_hypercube(PAPER, 1, seed=0), "at least 2"),
        (lambda: optimal_latin_hypercube(PAPER, 10, seed=0, levels="center"), "'edge' or 'centre'"),
        (lambda: optimal_latin_hypercube(Space((Factor("a", 0, 1, kind="integer"),)), 5, seed=0), "2 different points"),
        (lambda: full_factorial(MIXED), "'c' is continuous"),
        (lambda: full_factorial(PAPER, [9, 9]), "at most 7"),
        (lambda: central_composite(MIXED), "a choice has none"),
    ],
)
def test_bad_input_is_refused_with_rule_and_value(make, message):
    with pytest.raises(InputError, match=message):
        make()


@forall(st.lists(st.floats(0, 1), min_size=3, max_size=3))
def test_scaling_there_and_back_and_rounding_stay_in_the_space(u):
    x = MIXED.from_unit([u])
    MIXED.check(x)
    np.testing.assert_allclose(MIXED.from_unit(MIXED.to_unit(x)), x)
    np.testing.assert_allclose(MIXED.to_coded(x), 2 * MIXED.to_unit(x) - 1)
    np.testing.assert_array_equal(MIXED.round(x), x)


def test_a_table_with_units_and_levels_reads_back_as_the_same_points():
    x = sobol(MIXED, 32, seed=1).points
    table = MIXED.table(x)
    assert list(table.columns) == ["c_kN", "n", "k"]
    assert set(table["k"]) == {"a", "b", "z"}
    np.testing.assert_array_equal(MIXED.from_table(table), x)
    np.testing.assert_array_equal(MIXED.from_table(table.rename(columns={"c_kN": "c"})), x)


def test_levels_that_are_numbers_are_known_in_a_column_of_another_type():
    factor = Factor("k", kind="choice", levels=(30, 32.5, "a"))
    np.testing.assert_array_equal(factor.encode([30.0, 32.5, "a"]), [0, 1, 2])
    np.testing.assert_array_equal(factor.encode(["30", "32.5", "a"]), [0, 1, 2])


def test_a_lattice_counts_in_steps_and_gives_round_values():
    lattice = Lattice(Space((Factor("M", 30, 36), Factor("n", 0, 4, kind="integer"))), {"M": 0.05})
    assert lattice.steps.factors[0].count == 121
    np.testing.assert_array_equal(lattice.natural([[3, 2], [120, 0]]), [[30.15, 2], [36, 0]])


def test_decode_gives_what_a_scenario_takes():
    assert MIXED.decode([2.5, 3.0, 2.0]) == {"c": 2.5, "n": 3, "k": "z"}


def test_quantiles_give_every_level_the_same_share():
    x = sobol(MIXED, 3 * 5 * 256, seed=1).points
    for column, count in ((1, 5), (2, 3)):
        shares = np.unique(x[:, column], return_counts=True)[1] / len(x)
        np.testing.assert_allclose(shares, 1 / count, atol=0.01)


@settings(max_examples=15, deadline=None)
@forall(n=st.integers(2, 12), d=st.integers(1, 4), seed=st.integers(0, 100))
def test_annealing_keeps_a_latin_hypercube(n, d, seed):
    points = optimal_latin_hypercube(unit_space(d), n, seed=seed, iterations=50, chains=2).points
    np.testing.assert_allclose(np.sort(points, axis=0), np.tile(np.linspace(0, 1, n)[:, None], (1, d)), atol=1e-12)


def few(*counts):
    """A space of integers and choices of these numbers of values in turn."""
    return Space(
        tuple(
            Factor(f"x{i}", kind="choice", levels=tuple(range(count)))
            if i % 2
            else Factor(f"x{i}", 5, 4 + count, kind="integer")
            for i, count in enumerate(counts)
        )
    )


@pytest.mark.parametrize("levels", ["edge", "centre"])
@pytest.mark.parametrize(
    ("space", "n"),
    [
        (few(3, 3), 9),
        (few(9, 9), 50),
        (few(9, 9), 80),  # all points but one
        (few(2, 3, 4), 23),
        (few(2, 2, 2, 2), 16),
        (few(2, 7, 3), 41),
        (few(10, 2), 13),
        (few(12, 3, 5), 7),  # fewer points than values of a factor
        (Space((*few(3, 2).factors, Factor("c", 0, 1))), 20),
        (Lattice(Space((Factor("c", 0, 1), Factor("m", 30, 31))), {"c": 0.25, "m": 0.5}).steps, 14),
    ],
)
def test_every_value_has_an_equal_share_and_no_point_occurs_twice(space, n, levels):
    """Rounded levels gave 2, 4 and 3 of 9 points, and annealing alone left points twice where few are free."""
    points = optimal_latin_hypercube(space, n, seed=1, levels=levels, iterations=50).points
    assert len(np.unique(points, axis=0)) == n
    for factor, column in zip(space.factors, points.T, strict=True):
        shares = np.unique(column, return_counts=True)[1]
        assert len(shares) == min(n, factor.count or n)
        assert np.ptp(shares) <= 1


@settings(max_examples=40, deadline=None)
@forall(st.lists(st.integers(2, 6), min_size=1, max_size=4), st.floats(0, 1), st.integers(0, 9))
def test_shares_are_equal_and_points_differ_for_any_numbers_of_values(counts, part, seed):
    n = max(2, round(part * min(np.prod(counts), 100)))
    points = optimal_latin_hypercube(few(*counts), n, seed=seed, iterations=5, chains=2).points
    assert len(np.unique(points, axis=0)) == n
    for count, column in zip(counts, points.T, strict=True):
        shares = np.unique(column, return_counts=True)[1]
        assert (len(shares), np.ptp(shares) <= 1) == (min(count, n), True)


def test_levels_reach_from_bound_to_bound_where_there_are_fewer_points_than_values():
    points = optimal_latin_hypercube(PAPER, 4, seed=1, iterations=50).points
    np.testing.assert_array_equal(np.sort(points, axis=0).T, [[20, 30, 40, 50], [30, 32, 34, 36]])


def test_small_maximin_design_is_the_known_optimum():
    """n = 10, d = 2: sqrt(10) cells (van Dam et al. 2007, doi 10.1287/opre.1060.0317); median of 4 seeds."""
    found = [
        optimal_latin_hypercube(unit_space(2), 10, seed=s, levels="centre").quality().smallest_distance
        for s in range(4)
    ]
    assert np.median(found) == pytest.approx(np.sqrt(10) / 10)
    assert np.median(found) >= 0.31


@pytest.mark.thorough
def test_large_maximin_design_reaches_the_bar_on_one_seed():
    """n = 50, d = 5: 0.51; benchmarks/designs.py has the median of 8 seeds."""
    assert optimal_latin_hypercube(unit_space(5), 50, seed=0, levels="centre").quality().smallest_distance >= 0.51


@pytest.mark.thorough
def test_the_papers_kind_of_design_is_as_good_as_the_papers():
    quality = [optimal_latin_hypercube(PAPER, 10, seed=s).quality() for s in range(4)]
    assert max(q.smallest_distance for q in quality) >= 0.348
    assert all(q.levels == (10, 7) for q in quality)


def test_same_seed_same_design_and_other_seed_another():
    first, again, other = (optimal_latin_hypercube(PAPER, 10, seed=s, iterations=200).points for s in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_the_global_random_state_is_left_alone():
    np.random.seed(1)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    optimal_latin_hypercube(PAPER, 5, seed=0, iterations=20)
    sobol(PAPER, 5, seed=0)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_full_factorial_has_every_combination_once():
    points = full_factorial(MIXED, [3, None, None]).points
    assert points.shape == (3 * 5 * 3, 3)
    assert len(np.unique(points, axis=0)) == 45


def test_central_composite_points():
    face = central_composite(unit_space(3)).points
    assert face.shape == (8 + 6 + 1, 3)
    assert set(np.unique(face)) == {0.0, 0.5, 1.0}
    inscribed = central_composite(unit_space(2), kind="inscribed").points
    radius = np.linalg.norm(2 * inscribed[:8] - 1, axis=1)
    np.testing.assert_allclose(radius, 1.0)  # two factors: corners and axis points on one circle


def test_quality_of_known_points():
    quality = Design(unit_space(2), [[0, 0], [1, 0], [0, 1], [1, 1]]).quality()
    assert quality.smallest_distance == 1.0
    assert quality.phi_p == pytest.approx((4 + 2 * np.sqrt(2) ** -50) ** (1 / 50))
    assert Design(unit_space(2), [[0, 0], [0, 0]]).quality().phi_p == np.inf


def test_points_of_a_design_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        sobol(PAPER, 4, seed=0).points[0, 0] = 1.0
