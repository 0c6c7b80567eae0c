"""The swarm against true fronts, hypervolumes against another library, NSGA-II as a second opinion."""

import time

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given as forall
from hypothesis import settings
from hypothesis.extra.numpy import arrays
from known import bnh, ctp1, nsga2, share, zdt1

from trainmj.doe import Factor, Space, SwarmOptions, hypervolume, mopso, nondominated
from trainmj.errors import InputError

PROBLEMS = {"ZDT1": zdt1, "BNH": bnh, "CTP1": ctp1}
SHORT = SwarmOptions(particles=20, iterations=15, archive=30)


@pytest.mark.parametrize("name", PROBLEMS)
def test_swarm_covers_the_true_front(name):
    """The bar: 0.99 with the usual reference a tenth beyond. At the nadir itself, which is harder, it holds as well."""
    problem = PROBLEMS[name]()
    clock = time.process_time()
    front = mopso(problem.space, problem.evaluate, seed=1)
    assert time.process_time() - clock <= 6.0  # 3 s is the bar (benchmarks/swarm.py); twice for a busy machine
    assert share(problem, front.values, 0.1) >= 0.99
    assert share(problem, front.values, 1e-6) >= 0.99
    assert (front.limits <= 0).all()
    assert nondominated(front.values).all()
    values, _ = problem.evaluate(front.points)
    np.testing.assert_array_equal(values, front.values)
    assert (np.diff(front.values[:, 0]) > 0).all()
    assert front.status.startswith("converged")
    assert front.hypervolume == front.history[-1].hypervolume


@pytest.mark.parametrize("name", PROBLEMS)
def test_same_seed_same_front_and_other_seed_another(name):
    problem = PROBLEMS[name]()
    first, again, other = (mopso(problem.space, problem.evaluate, seed=s, options=SHORT) for s in (4, 4, 5))
    np.testing.assert_array_equal(first.points, again.points)
    assert first.history == again.history or np.isnan(first.history[0].growth)
    assert first.points.shape != other.points.shape or (first.points != other.points).any()


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["BNH", "ZDT1"])
def test_second_opinion_nsga2(name):
    """With as many evaluations a library's NSGA-II is at most one part in two hundred ahead of the swarm."""
    pytest.importorskip("pymoo")
    problem = PROBLEMS[name]()
    options = SwarmOptions(iterations=79, archive=100, tolerance=0)
    front = mopso(problem.space, problem.evaluate, seed=1, options=options)
    oracle = nsga2(problem, population=100, generations=80)
    assert share(problem, front.values, 0.1) >= share(problem, oracle, 0.1) - 0.005


def test_history_has_every_iteration_and_grows():
    problem = bnh()
    front = mopso(problem.space, problem.evaluate, seed=0, options=SHORT)
    assert [p.iteration for p in front.history] == list(range(16))
    assert front.history[-1].evaluations == 16 * 20
    volumes = [p.hypervolume for p in front.history]
    assert volumes[-1] > volumes[0] > 0


def test_integers_and_choices_are_evaluated_on_their_levels():
    space = Space((Factor("n", 0, 9, kind="integer"), Factor("k", kind="choice", levels=("a", "b")), Factor("c", 0, 1)))

    def evaluate(x):
        space.check(x)
        assert set(np.unique(x[:, 1])) <= {0.0, 1.0}
        return np.stack([x[:, 0] + x[:, 1] + x[:, 2], (9 - x[:, 0]) + x[:, 1] + x[:, 2]], axis=1), None

    front = mopso(space, evaluate, seed=0, options=SwarmOptions(particles=40, iterations=60))
    np.testing.assert_array_equal(front.points[:, 0], np.arange(10))  # the whole true front: k = a, c = 0
    assert set(space.table(front.points)["k"]) == {"a"}
    np.testing.assert_allclose(front.points[:, 2], 0, atol=1e-3)


def test_failed_evaluations_are_counted_and_passed_over():
    problem = bnh()

    def evaluate(x):
        y, g = problem.evaluate(x)
        y[x[:, 0] > 4] = np.nan  # as a simulation that diverges
        return y, g

    front = mopso(problem.space, evaluate, seed=0, options=SHORT)
    assert front.history[0].failed > 0
    assert (front.points[:, 0] <= 4).all()


@pytest.mark.thorough
def test_three_objectives():
    space = Space(tuple(Factor(f"x{i}", 0, 1) for i in range(3)))

    def evaluate(x):  # an eighth of the unit sphere
        a, b = np.pi / 2 * x[:, 0], np.pi / 2 * x[:, 1]
        r = 1 + (x[:, 2] - 0.5) ** 2
        return r[:, None] * np.stack([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)], axis=1), None

    front = mopso(space, evaluate, seed=0, options=SwarmOptions(iterations=40))
    assert hypervolume(front.values, (1.1, 1.1, 1.1)) >= 0.9 * (1.1**3 - np.pi / 6)
    assert np.median(np.linalg.norm(front.values, axis=1)) == pytest.approx(1, abs=0.005)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: mopso(BOX, lambda x: (x, x + 1), seed=0, options=SHORT, constraints=("S",)),
            "no point .* breaks S by 1;",
        ),
        (
            lambda: mopso(BOX, lambda x: (x * np.nan, None), seed=0, options=SHORT),
            "all 320 evaluations gave nan or inf",
        ),
        (lambda: mopso(BOX, lambda x: (x[:3], None), seed=0), "one row for each of the 100 points .got 3"),
        (lambda: mopso(BOX, lambda x: (x, -x), seed=0, options=SHORT, constraints=("a", "b")), "name each of the 1"),
        (lambda: SwarmOptions(particles=1), "particles must be at least 4"),
        (lambda: SwarmOptions(tolerance=1.0), "tolerance"),
        (lambda: hypervolume([[1, 2]], [3]), "2 values, one for each objective"),
    ],
)
def test_what_cannot_be_searched_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()


BOX = Space((Factor("x", 0, 1),))


@settings(max_examples=40, deadline=None)
@forall(arrays(float, st.tuples(st.integers(1, 12), st.integers(2, 4)), elements=st.floats(0, 1.25, width=16)))
def test_hypervolume_agrees_with_moocore(y):
    moocore = pytest.importorskip("moocore")
    assert hypervolume(y, np.ones(y.shape[1])) == pytest.approx(
        moocore.hypervolume(y, ref=np.ones(y.shape[1])), abs=1e-12
    )


@settings(max_examples=60, deadline=None)
@forall(
    arrays(
        float, st.tuples(st.integers(1, 15), st.integers(2, 3)), elements=st.sampled_from([0.0, 1.0, 2.0, 3.0, np.inf])
    )
)
def test_nondominated_is_what_the_definition_says(y):
    plain = [not any((a <= b).all() and (a < b).any() for a in y) for b in y]
    assert nondominated(y).tolist() == plain


def test_hypervolume_by_hand():
    assert hypervolume([[1, 2], [2, 1], [2, 2], [5, 0]], [3, 3]) == 3.0
    assert hypervolume([[0, 0, 0], [1, 1, -1]], [2, 2, 2]) == 8.0 + 1.0


@pytest.mark.parametrize("spread", [0.0, 1e-13])
def test_an_objective_that_is_the_same_everywhere_leaves_one_best_point(spread):
    """Its round-off would make a compromise of every point."""

    def evaluate(x):
        return np.stack([(x[:, 0] - 0.25) ** 2 + 1, 353.1 * (1 + spread * np.sin(1e6 * x[:, 1]))], axis=1), None

    space = Space((Factor("a", 0, 1), Factor("b", 0, 1)))
    front = mopso(space, evaluate, seed=1, options=SwarmOptions(particles=20, iterations=40))
    assert np.ptp(front.values, axis=0) == pytest.approx([0, 0], abs=1e-15)
    assert front.values[0] == pytest.approx([1, 353.1], rel=1e-6)
    assert front.hypervolume == pytest.approx(0.1 * front.values[0, 0] * 35.31, rel=1e-6)
