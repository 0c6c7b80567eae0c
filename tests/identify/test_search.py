"""The pieces of a search: the unit cube, constraints, residuals, and that each phase finds what it should."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from twins import AREA_KJ, KNOWN, plan, scenario, values

from trainmj.identify.misfit import Misfit
from trainmj.identify.search import explore, refine
from trainmj.identify.spec import ExplorePart
from trainmj.identify.unknowns import Area, Setting, Unknown, Unknowns


def unknowns(tolerance: float = 0.01) -> Unknowns:
    """Three forces of the buffer that never fall, the last one solved from the area."""
    force = "curves.buffer.force_kN"
    parameters = (
        Unknown("k", "", 20.0, 400.0, True, 80.0, None, 0.0, (Setting("devices.coupler.stiffness_kN_per_mm", 1, 0),)),
        Unknown("f10", "", 100.0, 400.0, False, 250.0, None, 0.0, (Setting(f"{force}.1", 1.0, 0.0),)),
        Unknown("f30", "", 150.0, 600.0, False, 460.0, 1, 5.0, (Setting(f"{force}.2", 1.0, 0.0),)),
        Unknown("f60", "", 200.0, 900.0, False, 600.0, 2, 0.0, (Setting(f"{force}.3", 1.0, 0.0),)),
    )
    return Unknowns(scenario(), parameters, (Area("energy", "curves.buffer", 0.0, 60.0, AREA_KJ, 3, tolerance),))


UNITS = arrays(float, 3, elements=st.floats(0, 1))


@settings(max_examples=60, deadline=None)
@given(UNITS)
def test_every_place_of_the_cube_is_in_bounds_and_in_order(unit):
    mine = unknowns()
    point = mine.point(unit)
    for p, value in zip(mine.parameters, point.value, strict=True):
        assert p.lower * (1 - 1e-12) <= value <= p.upper * (1 + 1e-12)
    _, f10, f30, f60 = point.value
    assert f30 >= f10 + 5 - 1e-9
    assert f60 >= f30


@settings(max_examples=60, deadline=None)
@given(UNITS)
def test_a_constraint_is_met_or_its_miss_is_told(unit):
    mine = unknowns()
    point = mine.point(unit)
    (miss,) = point.missed
    area = mine.area(mine.constraints[0], point.value)
    assert miss == pytest.approx((area - AREA_KJ) / 0.01, abs=1e-9)
    solved = point.value[3]
    inside = max(200.0, point.value[2]) * (1 + 1e-9) < solved < 900.0 * (1 - 1e-9)
    assert abs(miss) < 1e-6 or not inside


@settings(max_examples=60, deadline=None)
@given(arrays(float, 3, elements=st.floats(0.001, 0.999)))
def test_a_place_and_its_values_belong_together(unit):
    mine = unknowns()
    np.testing.assert_allclose(mine.place(mine.point(unit).value), unit, atol=1e-9)


def test_the_area_is_that_of_the_curve():
    mine = unknowns()
    assert mine.area(mine.constraints[0], mine.start().value) == pytest.approx(AREA_KJ, rel=1e-12)


def test_a_parameter_sets_several_places_with_factor_and_offset():
    both = (Setting("curves.tube.force_kN.0", 1.0, 0.0), Setting("curves.tube.force_kN.1", 2.0, -100.0))
    one = Unknowns(scenario(), (Unknown("x", "", 1.0, 900.0, False, 500.0, None, 0.0, both),), ())
    assert one.changes(np.array([450.0])) == {"curves.tube.force_kN.0": 450.0, "curves.tube.force_kN.1": 800.0}


class Valley:
    """Stands for a misfit: a curved valley in the unit cube (Rosenbrock's), its floor at (0.75, 0.75)."""

    asked = 0

    def residuals(self, units):
        self.asked += len(units)
        x = 4 * np.array(units) - 2
        return np.column_stack([10 * (x[:, 1] - x[:, 0] ** 2), 1 - x[:, 0]])

    cost = Misfit.cost
    jacobian = Misfit.jacobian


def test_the_refinement_follows_a_curved_valley():
    found = refine(Valley(), np.array([0.2, 0.7]), 60, 1e-5, "refine", lambda progress: None)
    np.testing.assert_allclose(found.unit, 0.75, atol=1e-4)


def test_the_exploration_finds_the_valley_and_depends_on_its_seed_alone():
    cube = SimpleNamespace(
        free=[0, 1], start=lambda: SimpleNamespace(value=None), place=lambda value: np.array([0.1, 0.9])
    )
    part = ExplorePart(trials=900)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    found = [explore(SimpleNamespace(unknowns=cube), Valley(), part, seed, lambda progress: None) for seed in (1, 1, 2)]
    assert (np.random.get_state()[1] == before).all()  # noqa: NPY002 - the caller's random numbers are left alone
    assert found[0][0].cost < 1e-3
    assert [p.cost for p in found[0]] == [p.cost for p in found[1]]
    assert [p.cost for p in found[0]] != [p.cost for p in found[2]]


class Line:
    """Stands for trials: the response is what the parameter k is."""

    def __init__(self, refused_above: float = np.inf):
        self.refused_above = refused_above

    def __call__(self, trials, step=None):
        k = np.array([changes["devices.coupler.stiffness_kN_per_mm"] for changes in trials])
        k = np.where(k > self.refused_above, np.nan, k)
        return np.repeat(k[:, None, None], 5, axis=1)


def line_plan(tmp_path, **target):
    """One value k, wanted to be 100 in five cases."""
    given = values(constraints={}, parameters={"k": values()["parameters"]["k"] | {"scale": "linear"}})
    given["targets"] = {"s1": {"response": "stroke_S1_M1_mm", "tolerance": 2} | target}
    given["data"]["tests"]["values"] = {"s1": "s1"}
    given["data"]["tests"]["rows"] = [row | {"s1": 100.0} for row in given["data"]["tests"]["rows"]]
    return plan(tmp_path, given)


def test_residuals_count_tolerance_weight_and_bar(tmp_path):
    unit = np.array([(130 - 20) / 380])  # k = 130
    plain = Misfit(line_plan(tmp_path), Line(), None).residuals([unit])
    np.testing.assert_allclose(plain, [[15.0] * 5])
    weighed = Misfit(line_plan(tmp_path, weight=0.5), Line(), None).residuals([unit])
    np.testing.assert_allclose(weighed, [[7.5] * 5])
    barred = Misfit(line_plan(tmp_path, bars={"each": "10 %"}), Line(), None).residuals([unit])
    np.testing.assert_allclose(barred, [[15.0] * 5 + [10 * (3 - 0.95)] * 5])
    inside = Misfit(line_plan(tmp_path, bars={"each": 40}), Line(), None).residuals([unit])
    np.testing.assert_allclose(inside, [[15.0] * 5 + [0.0] * 5])
    eighth = Misfit(line_plan(tmp_path), Line(), None, norm=8.0, size=5.0)
    np.testing.assert_allclose(eighth.cost([unit]), 0.5 * 5 * 3.0**8)


def test_derivatives_look_to_the_other_side_of_what_cannot_be_simulated(tmp_path):
    mine = line_plan(tmp_path)
    unit = np.array([(130 - 20) / 380])
    free = Misfit(mine, Line(), None).jacobian(unit, 1e-3)
    edge = Misfit(mine, Line(refused_above=130.1), None).jacobian(unit, 1e-3)
    np.testing.assert_allclose(free, 380 / 2)
    np.testing.assert_allclose(edge, 380 / 2, rtol=1e-6)


def test_a_higher_norm_makes_the_largest_deviation_smaller(tmp_path):
    """Five cases want 100, 100, 100, 100 and 120: the mean is 104, the middle between the ends 110."""
    mine = line_plan(tmp_path)
    mine.fitted.wanted[-1] = 120.0
    ends = {
        norm: refine(
            Misfit(mine, Line(), None, norm, size=10.0), np.array([0.1]), 60, 1e-4, "refine", lambda progress: None
        )
        for norm in (2.0, 16.0)
    }
    k = {norm: 20 + 380 * place.unit[0] for norm, place in ends.items()}
    assert k[2.0] == pytest.approx(104, abs=0.01)
    assert 109 < k[16.0] < 110


def test_the_known_values_are_the_start_of_nothing():
    """The twin's starts are away from what is to be found."""
    starts = {name: part["start"] for name, part in values()["parameters"].items()}
    assert all(abs(starts[name] - KNOWN[name]) > 0.05 * KNOWN[name] for name in starts)
