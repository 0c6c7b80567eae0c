"""The pieces of a search: the unit cube, constraints, residuals, and that each phase finds what it should."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from twins import AREA_KJ, KNOWN, plan, scenario, values

from trainmj.identification.file import AreaPart, ExplorePart, SetPart
from trainmj.identification.misfit import REFUSED, Misfit
from trainmj.identification.plan import Simulated
from trainmj.identification.search import explore, refine
from trainmj.identification.sought import Area, Rise, Unknown
from trainmj.identification.unknowns import Unknowns


def buffer(area: float) -> AreaPart:
    return AreaPart(of="curves.buffer", to_mm=60, area_kJ=area, by="it")


def unknowns(tolerance: float = 0.01) -> Unknowns:
    """Three forces of the buffer that never fall, the last one solved from the area."""
    force = "curves.buffer.force_kN"
    parameters = (
        Unknown("k", "", 20.0, 400.0, 80.0, (SetPart(path="devices.coupler.stiffness_kN_per_mm"),), log=True),
        Unknown("f10", "", 100.0, 400.0, 250.0, (SetPart(path=f"{force}.1"),)),
        Unknown("f30", "", 150.0, 600.0, 460.0, (SetPart(path=f"{force}.2"),), above=1, gap=5.0),
        Unknown("f60", "", 200.0, 900.0, 600.0, (SetPart(path=f"{force}.3"),), above=2),
    )
    return Unknowns(scenario(), parameters, (Area("energy", buffer(AREA_KJ), 3, tolerance),))


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
    both = (
        SetPart(path="curves.tube.force_kN.0", factor=1.0, offset=0.0),
        SetPart(path="curves.tube.force_kN.1", factor=2.0, offset=-100.0),
    )
    one = Unknowns(scenario(), (Unknown("x", "", 1.0, 900.0, 500.0, both),), ())
    assert one.changes(np.array([450.0])) == {"curves.tube.force_kN.0": 450.0, "curves.tube.force_kN.1": 800.0}


def curve(area: float | None = AREA_KJ, factor: float = 10.0) -> Unknowns:
    """The buffer sought as a whole: 250 and 460 kN between 0 and 600 kN, at 10 and 30 of 60 mm."""
    force = "curves.buffer.force_kN"
    inner = tuple(
        Unknown(f"b{k}", "kN", 0.0, 600.0, value, (SetPart(path=f"{force}.{k}"),))
        for k, value in ((1, 250.0), (2, 460.0))
    )
    rise = Rise((0, 1), np.array([0.0, 10.0, 30.0, 60.0]), 0.0, 600.0, factor)
    energy = () if area is None else (Area("energy", buffer(area), rise.widest(0, 60), 0.01),)
    return Unknowns(scenario(), inner, energy, (rise,))


@settings(max_examples=60, deadline=None)
@given(UNITS)
def test_a_curve_sought_whole_rises_between_its_ends_and_has_its_area(unit):
    point = curve().point(unit)
    assert 0 < point.value[0] < point.value[1] < 600
    np.testing.assert_allclose(point.missed, 0, atol=1e-6)
    assert curve().area(curve().constraints[0], point.value) == pytest.approx(AREA_KJ, rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(arrays(float, 2, elements=st.floats(0.1, 0.9)))
def test_a_curve_comes_back_from_its_place(part):
    """With and without an area: forces, not places, for a bent curve has many."""
    forces = np.array([part[0] * 300, 300 + part[1] * 300])
    mine = curve(None, 1e3)
    np.testing.assert_allclose(mine.point(mine.place(forces)).value, forces, rtol=1e-9)
    held = curve(float(np.trapezoid([0, *forces, 600], [0, 10, 30, 60]) / 1e3), 1e3)
    np.testing.assert_allclose(held.point(held.place(forces)).value, forces, rtol=1e-7)


def test_the_middle_of_a_curve_is_a_straight_line_or_a_power_of_it():
    """Without knowing more than both ends: straight; with an area, share to the power that gives it."""
    middle = np.full(3, 0.5)
    np.testing.assert_allclose(curve(None).point(middle).value, [100, 300])
    one, two = curve().point(middle).value / 600
    assert np.log(one) / np.log(1 / 6) == pytest.approx(np.log(two) / np.log(1 / 2))
    assert curve().roughness(middle) == pytest.approx(0)


def test_the_force_that_meets_an_area_is_the_one_that_carries_most_of_it():
    """Were it another one, derivatives would take it far for a small change of the rest."""
    rise = curve().curves[0]
    assert rise.widest(0, 60) == 1
    assert rise.widest(0, 20) == 0


class Valley:
    """Stands for a misfit: a curved valley in the unit cube (Rosenbrock's), its floor at (0.75, 0.75)."""

    asked = 0
    plan = SimpleNamespace(
        unknowns=SimpleNamespace(
            n_axes=2, start=lambda: SimpleNamespace(value=None), place=lambda value: np.array([0.1, 0.9])
        )
    )

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
    part = ExplorePart(trials=900)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    found = [explore(Valley(), part, seed, lambda progress: None) for seed in (1, 1, 2)]
    assert (np.random.get_state()[1] == before).all()  # noqa: NPY002 - the caller's random numbers are left alone
    assert found[0][0].cost < 1e-3
    assert [p.cost for p in found[0]] == [p.cost for p in found[1]]
    assert [p.cost for p in found[0]] != [p.cost for p in found[2]]


def test_searches_side_by_side_do_not_touch_each_other():
    """One search more leaves those before it as they were; the best comes first."""
    ends = {}
    for n in (1, 3):
        part = ExplorePart(trials=60, searches=n, start="middle", spread=0.1)
        ends[n] = explore(Valley(), part, 7, lambda progress: None)
    costs = [place.cost for place in ends[3]]
    assert costs == sorted(costs)
    assert len(set(costs)) == 3
    assert ends[1][0].cost in costs


def test_exploring_some_of_the_cases_simulates_only_these(tmp_path):
    mine = line_plan(tmp_path)
    asked = []

    class Some(Line):
        def __call__(self, trials, step=None, places=None):
            asked.append(places)
            return Simulated(super().__call__(trials).responses[:, list(places)], [])

    unit = np.array([(130 - 20) / 380])
    found = Misfit(mine, Some(), None, cases=2).residuals([unit])
    assert asked == [(0, 4)]
    np.testing.assert_allclose(found, [[15.0] * 2])


def test_neighbouring_slopes_count_while_exploring(tmp_path):
    """A curve may not be rougher than the data ask for; the refinement does not know of it."""
    given = values(parameters={"b": {"curve": "curves.buffer"}}, constraints={}, data__tests__values={"s1": "s1"})
    mine = plan(tmp_path, given | {"targets": {"s1": given["targets"]["s1"]}})
    unit = np.array([0.75, 0.5, 0.5])  # the first slope is the root of 10 times the others

    class Nothing:
        def __call__(self, trials, step=None, places=None):
            return Simulated(np.zeros((len(trials), 5, 1)), [])

    rough = Misfit(mine, Nothing(), None, ratio=10.0).residuals([unit])
    plain = Misfit(mine, Nothing(), None).residuals([unit])
    np.testing.assert_allclose(rough[:, plain.shape[1] :], [[-0.5, 0.0]])


class Line:
    """Stands for trials: the response is what the parameter k is."""

    def __init__(self, refused_above: float = np.inf):
        self.refused_above = refused_above

    def __call__(self, trials, step=None, places=None):
        k = np.array([changes["devices.coupler.stiffness_kN_per_mm"] for changes in trials])
        k = np.where(k > self.refused_above, np.nan, k)
        return Simulated(np.repeat(k[:, None, None], 5, axis=1), [])


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


def test_a_trial_without_a_value_that_counts_is_refused_and_one_that_is_only_reported_takes_nothing_away(tmp_path):
    """Breaks if a target of weight 0 that comes to no number makes every trial as bad as any other."""

    class Partly(Line):
        def __call__(self, trials, step=None, places=None):
            found = np.repeat(super().__call__(trials).responses, 2, axis=2)
            found[:, 2, lost] = np.nan
            return Simulated(found, [])

    given = values(constraints={}, parameters={"k": values()["parameters"]["k"] | {"scale": "linear"}})
    given["targets"] = {
        "s1": {"response": "stroke_S1_M1_mm", "tolerance": 2},
        "s12": {"response": "stroke_M1_M2_mm", "tolerance": 2, "weight": 0},
    }
    given["data"]["tests"]["values"] = {"s1": "s1", "s12": "s12"}
    given["data"]["tests"]["rows"] = [row | {"s1": 100.0} for row in given["data"]["tests"]["rows"]]
    mine, unit = plan(tmp_path, given), np.array([(130 - 20) / 380])
    assert mine.columns == ("stroke_M1_M2_mm", "stroke_S1_M1_mm")
    lost = 0
    np.testing.assert_allclose(Misfit(mine, Partly(), None).residuals([unit]), [[15.0] * 5])
    lost = 1
    np.testing.assert_array_equal(Misfit(mine, Partly(), None).residuals([unit]), [[REFUSED] * 5])


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
            Misfit(mine, Line(), None, norm=norm, size=10.0), np.array([0.1]), 60, 1e-4, "refine", lambda progress: None
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
