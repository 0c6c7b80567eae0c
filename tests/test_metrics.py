"""From a collision to an engineer's numbers: means of a known pulse, strokes, shares and statuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import chain, changed, envelope, joined, scenario, values

from trainmj.collision.batch import run_chains
from trainmj.collision.block import Tally
from trainmj.collision.chain import Chain
from trainmj.collision.fields import KEPT
from trainmj.collision.lineup import line_up
from trainmj.collision.measured import Measured
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.collision.stability import largest_step
from trainmj.collision.summary import Summary, measure, summarise
from trainmj.errors import InputError
from trainmj.scenario import Scenario, load
from trainmj.single import tables


def collide(case: Chain) -> Summary:
    return next(summary for _, summary in run_chains([(0, case)]))


# a known pulse


def pulse(interval: float) -> tuple[Chain, Tally, np.ndarray, np.ndarray]:
    """M1 slows down from 10 m/s at 50 m/s2 for 60 ms and at 20 m/s2 for the next 80 ms; S1 stands."""
    time = np.arange(0, 0.3, interval)
    speed = 10 - 50 * np.clip(time - 0.05, 0, 0.06) - 20 * np.clip(time - 0.11, 0, 0.08)
    result = run(scenario([(0, 0), (10, 1000), (900, 1000)], 100, partner="t", step_ms=0.1, time_limit_s=0.01))
    tally = changed(result.tally, first_force_time=np.array([0.05]), last_force_time=np.array([0.19]))
    tally = changed(tally, speed_first=np.array([10.0, 0.0]), speed_last=np.array([5.4, 0.0]), over=True)
    return result.chain, tally, time, np.column_stack([speed, np.zeros_like(speed)])


@pytest.mark.parametrize("interval", [1e-3, 0.7e-3])
def test_moving_windows_on_a_known_pulse(interval):
    """0.7 ms does not divide the windows: the end of a window then lies between two records."""
    first = {v.name: v for v in measure(*pulse(interval)).vehicles}["M1"]
    assert first.mean_30ms_g * 9.80665 == pytest.approx(50.0, rel=1e-6)
    assert first.mean_100ms_g * 9.80665 == pytest.approx((50 * 0.06 + 20 * 0.04) / 0.1, rel=1e-2)
    assert first.mean_120ms_g * 9.80665 == pytest.approx((50 * 0.06 + 20 * 0.06) / 0.12, rel=1e-2)
    assert first.front_mean_deceleration_g * 9.80665 == pytest.approx((50 * 0.06 + 20 * 0.08) / 0.14, rel=1e-2)
    assert first.cfc60_peak_g * 9.80665 == pytest.approx(50.0, rel=0.1), "the filter overshoots a little"


@pytest.fixture(scope="module")
def exact():
    return summarise(run(load("b_type", {"simulation.record_every_ms": 0.1})))


@pytest.mark.parametrize(
    ("interval_ms", "blank"),
    [
        (1, set()),
        (2, {"mean_30ms_g", "cfc60_peak_g"}),
        (4, {"mean_30ms_g", "cfc60_peak_g", "mean_100ms_g"}),
        (10, {"mean_30ms_g", "cfc60_peak_g", "mean_100ms_g", "mean_120ms_g"}),
        (100, {"mean_30ms_g", "cfc60_peak_g", "mean_100ms_g", "mean_120ms_g"}),
    ],
)
def test_a_mean_finer_than_the_record_is_no_number(exact, interval_ms, blank):
    """Records 100 ms apart have no mean over 30 ms: 1.59 g would stand where 2.43 g is right."""
    found = summarise(run(load("b_type", {"simulation.record_every_ms": interval_ms})))
    for one, other in zip(found.vehicles, exact.vehicles, strict=True):
        assert {name for name, value in one.values.items() if np.isnan(value)} == blank
        assert one.front_mean_deceleration_g == other.front_mean_deceleration_g, "from every step"
        assert one.contacts == other.contacts, "likewise"
        for name in {"mean_30ms_g", "mean_100ms_g", "mean_120ms_g"} - blank:
            assert one.values[name] == pytest.approx(other.values[name], rel=3e-3)


def test_a_filtered_peak_above_the_unfiltered_one_has_its_footnote():
    """Breaks if an overshoot of the filter is taken for an acceleration."""
    plateau = run(scenario([(0, 0), (1, 500), (900, 500)], 1000, step_ms=0.1))
    numbers = summarise(plateau)
    assert numbers.vehicles[0].cfc60_peak_g > numbers.vehicles[0].peak_acceleration_g
    assert "overshoot" in next(tables.vehicles(plateau.chain, numbers)).note
    spring = run(scenario([(0, 0), (500, 500), (900, 500)], 100, step_ms=0.1, speed_m_s=1.0))
    assert "overshoot" not in next(tables.vehicles(spring.chain, summarise(spring))).note


WINDOWS = {
    "plain": {},
    "wall": {"collision.partner": "rigid_wall", "collision.speed_km_h": 12.5},
    "cut off in a window": {"simulation.time_limit_s": 0.05},
    "refined": {
        "devices.front.stages.coupler.shear_off": {"force_kN": 2000, "ramp_mm": 0.25},
        "devices.front.stiffness_kN_per_mm": 5000,
        "devices.front.damping_kN_s_per_m": 0,
        "simulation.step_ms": 0.2,
    },
}


@pytest.mark.parametrize("changes", WINDOWS.values(), ids=WINDOWS)
@pytest.mark.parametrize("window_ms", [0.2, 3.8, 70])
def test_means_over_windows_are_the_changes_of_speed(window_ms, changes):
    """Without rail friction: breaks if a step is left out, counted twice or in the wrong window, or parts of a step
    count as whole ones.
    """
    case = load("b_type", {"collision.rail_friction": 0, "simulation.averaging_ms": window_ms, **changes})
    result = run(case.with_values({"simulation.record_every_ms": 0.2}))
    assert result.chain.refined == ("devices.front.stages.coupler.shear_off" in changes)
    ends = np.arange(0, len(result.time), round(window_ms / 0.2))
    if result.tally.over:  # and nothing is pushed any more
        ends = np.append(ends, len(result.time) - 1)
    means = np.abs(np.diff(result.velocity[ends], axis=0)).max(axis=0, initial=0) / (window_ms * 1e-3)
    means = means if len(ends) > 1 else np.full_like(means, np.nan)
    found = {v.name: v.averaged_device_acceleration_g for v in summarise(result).vehicles}
    wanted = {v.name: mean / 9.80665 for v, mean in zip(result.chain.vehicles, means, strict=True)}
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9, nan_ok=True)


def test_a_known_force_over_windows():
    """500 kN on 33 t from 1.25 windows on, for 8 ms: 0.75, 1 and 0.25 windows of it."""
    stop = 500e3 / 33e3 * 8e-3  # m/s, what the plateau stops in 8 ms
    case = scenario([(0, 500), (900, 500)], 5e4, step_ms=0.01, speed_m_s=stop)
    case = case.with_values({"simulation.averaging_ms": 4, "collision.gap_mm": stop * 5, "limits.TAMA_averaged_g": 0.5})
    summary = summarise(run(case))
    full = 500e3 / 33e3 / 9.80665
    assert summary.vehicles[0].averaged_device_acceleration_g == pytest.approx(full, rel=1e-3)
    assert summary.TAMA_averaged_g == summary.vehicles[0].averaged_device_acceleration_g
    long = summarise(run(case.with_values({"simulation.averaging_ms": 80})))
    change = (stop - long.vehicles[0].final_speed_km_h / 3.6) / 9.80665  # what it rebounds with is pushed, too
    assert long.TAMA_averaged_g == pytest.approx(change / 80e-3, rel=1e-9), "the whole impulse in one window"
    assert full / 10 < long.TAMA_averaged_g < 1.15 * full / 10
    assert not next(limit for limit in summary.limits if limit.of_scenario).kept


def test_without_a_window_there_are_no_means():
    """Breaks if a column of zeros stands where nothing was averaged."""
    one, other = (summarise(run(load("b_type_wall", changes))) for changes in ({}, {"simulation.averaging_ms": 4}))
    assert set(other.responses) - set(one.responses) == {
        "TAMA_averaged_g", *(f"averaged_device_M{n}_g" for n in range(1, 7))
    }  # fmt: skip
    assert one.responses == {name: other.responses[name] for name in one.responses}, "and nothing else changes"
    with pytest.raises(InputError, match=r"TAMA_averaged.*; the scenario does not state simulation.averaging_ms$"):
        line_up(load("b_type_wall", {"limits.TAMA_averaged_g": 1}))


def test_a_window_that_reaches_past_the_end_holds_the_last_speed():
    """A short collision has a small mean over 100 ms, not an undefined one."""
    case, tally, time, velocity = pulse(1e-3)
    short = measure(case, tally, time[:100], velocity[:100]).vehicles[0]
    assert short.mean_100ms_g * 9.80665 == pytest.approx(50 * 0.049 / 0.1, rel=1e-2)


# strokes and criteria


def test_total_stroke_leaves_out_empty_strokes_and_the_partner(standard_summary):
    """Eq. 1 of the paper: coupler and anti-climber of one train, then the joints M1-M2 to M5-M6."""
    own = {i.name: i for i in standard_summary.interfaces}
    coupler, climber, _ = own["S1-M1"].stages
    joints = [own[f"M{k}-M{k + 1}"].stroke_mm for k in range(1, 6)]
    assert standard_summary.TS_mm == pytest.approx(coupler.stroke_mm + climber.stroke_mm + sum(joints), rel=1e-12)
    assert own["S1-M1"].stroke_mm == pytest.approx(coupler.stroke_mm + 22 + climber.stroke_mm), "22 mm carry no force"
    peaks = [v.peak_device_acceleration_g for v in standard_summary.vehicles if v.name.startswith("M")]
    assert len(peaks) == 6
    assert standard_summary.TAMA_g == pytest.approx(np.mean(peaks), rel=1e-12)


def test_front_is_reported_for_one_train(standard_result, standard_summary):
    front, tally = standard_summary.interfaces[0], standard_result.tally
    assert front.stroke_mm == pytest.approx(1e3 * tally.stroke_max[5] / 2)
    assert front.permanent_mm == pytest.approx(1e3 * tally.element_state_0[5])
    assert 2 * front.energy_kJ == pytest.approx(standard_result.energy[-1, 5] / 1e3, rel=1e-6)
    assert front.peak_force_kN == pytest.approx(tally.force_max[5] / 1e3), "both trains feel the same force"


def test_order_is_from_the_front_backwards_the_moving_train_first(standard_summary):
    assert [v.name for v in standard_summary.vehicles] == [f"{s}{k}" for s in "MS" for k in range(1, 7)]
    names = ["S1-M1", *[f"M{k}-M{k + 1}" for k in range(1, 6)], *[f"S{k}-S{k + 1}" for k in range(1, 6)]]
    assert [i.name for i in standard_summary.interfaces] == names


def test_balance_time_is_that_of_the_interface_on_the_side_of_the_impact(standard_summary):
    times = {v.name: v.balance_time_s for v in standard_summary.vehicles}
    peaks = {i.name: i.peak_time_s for i in standard_summary.interfaces}
    assert times["M1"] == times["S1"] == peaks["S1-M1"]
    assert times["M4"] == peaks["M3-M4"]
    assert times["S4"] == peaks["S3-S4"]


def test_total_peak_has_rail_friction_and_device_peak_has_not(standard_summary):
    """The paper's accelerations come from the device forces alone; the two differ by mu g at most."""
    for v in standard_summary.vehicles:
        difference = abs(v.peak_acceleration_g - v.peak_device_acceleration_g)
        assert 0 < difference <= 0.008 * (1 + 1e-9), v.name
    frictionless = collide(line_up(load("b_type", {"collision.rail_friction": 0})))
    for v in frictionless.vehicles:
        assert v.peak_acceleration_g == v.peak_device_acceleration_g


def test_peaks_come_from_every_step_not_from_the_records():
    """Records 20 ms apart miss the peaks; the table must not."""
    dense, sparse = (summarise(run(load("b_type", {"simulation.record_every_ms": r}))) for r in (1, 20))
    for a, b in zip(dense.vehicles, sparse.vehicles, strict=True):
        assert a.peak_device_acceleration_g == b.peak_device_acceleration_g
        assert a.peak_acceleration_g == b.peak_acceleration_g
    assert dense.TS_mm == sparse.TS_mm
    assert [i.peak_force_kN for i in dense.interfaces] == [i.peak_force_kN for i in sparse.interfaces]


# numbers from a tally


@pytest.fixture(scope="module")
def against_a_wall() -> Result:
    """Two vehicles of 33 t at 2 m/s against a wall, for the tallies that tests put in."""
    v = values([(0, 0), (10, 500), (800, 500)], 100, mass_t=[33, 33], speed_m_s=2.0, step_ms=0.1, time_limit_s=0.01)
    v["devices"]["front"] = v["devices"]["d"] | {"stroke_limit_mm": 300.0}
    v["trains"]["t"]["front"] = "front"
    return run(Scenario.from_values(v))


def tallied(result: Result, **fields: object) -> Summary:
    """The numbers of a tally that closes its balances, some of its fields put in."""
    stroke_max = np.asarray(fields.get("stroke_max", [0.0655, 0.2075]))
    absorbed = 500e3 * stroke_max - 3.75e3  # below the curve, less 1.25 kJ that a spring of 100 kN/mm gives back
    tally = Tally(
        time=0.5,
        over=True,
        impulse=-2 * 33e3 * 2.0,
        speed=np.zeros(2),
        friction_work=np.array([1e3, 131e3 - absorbed.sum()]),
        device_peak=np.array([9.80665, 2 * 9.80665]),
        total_peak=np.array([3 * 9.80665, 4 * 9.80665]),
        brake_work=np.zeros(2),
        grade_work=np.zeros(2),
        unseen_peak=np.zeros(2),
        unseen_force=np.zeros(2),
        force_rise=np.zeros(2),
        force_fall=np.zeros(2),
        peak_rise=np.zeros(2),
        peak_fall=np.zeros(2),
        peak_swung=np.zeros(2),
        pull_max=np.zeros(2),
        steps=5000.0,
        stroke=stroke_max - 0.005,
        force=np.zeros(2),
        work=np.zeros(2),
        dissipated=absorbed,
        stroke_max=stroke_max,
        stroke_max_time=np.array([0.2, 0.1]),
        force_max=np.array([300e3, 500e3]),
        first_force_time=np.array([0.01, 0.0]),
        last_force_time=np.array([0.3, 0.4]),
        speed_first=np.array([2.0, 2.0]),
        speed_last=np.array([0.0, -1.0]),
    )
    tally = changed(tally, **fields)
    end_time = np.where(tally.stroke_max > [0.8, np.inf], 0.3, -1.0)
    of_elements = {
        "element_stroke": tally.stroke,
        "element_state_0": stroke_max - 0.005,
        "element_state_1": np.zeros(2),
        "element_force": np.maximum(0.0, 100e6 * (tally.stroke - stroke_max + 0.005)),
        "element_dissipated": tally.dissipated,
        "element_viscous": np.zeros(2),
        "element_stroke_max": tally.stroke_max,
        "element_end_time": end_time,
        "point_speed": tally.speed,
        "member_force": np.zeros(0),
        "member_dissipated": np.zeros(0),
        "member_end_time": np.zeros(0),
        "line_off_time": np.zeros(0),
        "contacts": np.zeros(2),
        "open": np.zeros(2),
        "open_start": np.zeros(2),
        "open_impulse": np.zeros(2),
        **{f"contact_{name}": np.zeros((2, KEPT)) for name in ("start", "end", "mean")},
    }
    return measure(result.chain, changed(tally, **of_elements), result.time, result.velocity)


def test_numbers_are_the_tally_in_engineering_units(against_a_wall):
    s = tallied(against_a_wall)
    assert (str(s.status), s.duration_s) == ("over", 0.5)
    front, joint = s.interfaces
    assert (front.name, joint.name) == ("M1-wall", "M1-M2")
    assert (front.stroke_mm, front.peak_force_kN, front.energy_kJ, front.peak_time_s) == pytest.approx(
        (207.5, 500.0, 100.0, 0.1)
    )
    assert (joint.stroke_mm, joint.peak_force_kN, joint.energy_kJ, joint.peak_time_s) == pytest.approx(
        (65.5, 300.0, 29.0, 0.2)
    )
    assert (front.permanent_mm, joint.permanent_mm) == (pytest.approx(202.5), pytest.approx(60.5))
    assert pytest.approx(273.0) == s.TS_mm
    assert pytest.approx(1.5) == s.TAMA_g
    first, second = s.vehicles
    assert (first.name, first.mass_t, second.name) == ("M1", 33.0, "M2")
    assert (first.peak_device_acceleration_g, first.peak_acceleration_g) == (2.0, 4.0)
    assert (first.balance_time_s, second.balance_time_s) == (0.1, 0.2)
    means = first.front_mean_deceleration_g * 9.80665, second.front_mean_deceleration_g * 9.80665
    assert means == pytest.approx((7.5, 5.0)), "3 m/s and 2 m/s in the 0.4 s of force at the front"
    b = s.balance
    assert (b.kinetic_start_kJ, b.kinetic_end_kJ, b.absorbed_kJ, b.friction_kJ) == (132.0, 0.0, 129.0, 3.0)
    assert (b.elastic_kJ, b.energy_error, b.momentum_error) == (0.0, 0.0, 0.0)


def test_what_is_left_at_the_end_is_in_the_balance(against_a_wall):
    """5 mm of a spring of 100 kN/mm hold 1.25 kJ; 33 t at -2 m/s carry 66 kJ; the rest is missing."""
    s = tallied(against_a_wall, stroke=np.array([0.0555, 0.2075]), speed=np.array([-2.0, 0.0]))
    b = s.balance
    assert [v.final_speed_km_h for v in s.vehicles] == pytest.approx([0.0, -7.2])
    assert b.elastic_kJ == pytest.approx(1.25), "a device that has come apart holds nothing"
    assert b.kinetic_end_kJ == 66.0
    assert b.energy_error == pytest.approx((132 - 66 - 1.25 - 129 - 3) / 132)
    assert b.momentum_error == pytest.approx(-33e3 * 2 / (2 * 33e3 * 2))


def test_energy_is_judged_by_what_a_collision_of_two_trains_can_convert():
    """11 t at 5 m/s into 33 t at 1 m/s meet at 2 m/s: 0.5 (11 * 3 * 3 + 33 * 1 * 1) = 66 kJ."""
    e = envelope([(0, 0), (100, 500), (800, 500)], 100)
    case = chain([11e3, 33e3], [e], [5.0, 1.0])
    assert abs(collide(case).balance.energy_error) < 1e-4
    model = run(scenario([(0, 0), (10, 500), (800, 500)], 100, partner="t", step_ms=0.1, time_limit_s=0.01))
    end = np.array([2.0, 2.0])
    tally = changed(model.tally, speed=end, point_speed=end, dissipated=np.array([65e3]), friction_work=np.zeros(2))
    tally = changed(tally, element_stroke=np.array([0.2]), element_state_0=np.array([0.2]))
    tally = changed(tally, element_force=np.zeros(1), element_dissipated=np.array([65e3]))
    assert measure(case, tally, model.time, model.velocity).balance.energy_error == pytest.approx(1 / 66)
    opposed = measure(chain([11e3, 33e3], [e], [5.0, -1.0]), changed(tally, impulse=0.0), model.time, model.velocity)
    assert opposed.balance.momentum_error == pytest.approx((88 - 22) / 88), "22 t m/s there were, of 88 either way"


@pytest.mark.parametrize("missing", [-0.9, 0.9, -1.1, 1.1])
def test_a_balance_that_is_off_by_a_thousandth_makes_a_run_unstable(against_a_wall, missing):
    s = tallied(against_a_wall, dissipated=np.array([29e3, 100e3 - missing * 132.0]))
    assert s.balance.energy_error == pytest.approx(missing * 1e-3)
    if abs(missing) < 1:
        assert str(s.status) == "over"
    else:
        assert str(s.status) == "unstable: the energy balance is off by 0.11%; take a smaller step"


def test_a_device_that_did_not_absorb_the_area_below_its_curve_makes_a_run_unstable(against_a_wall):
    """Two devices in series on a path that is not theirs keep the balance of energy, and lie about each device."""
    s = tallied(against_a_wall, dissipated=np.array([28e3, 101e3]))
    assert (s.balance.energy_error, s.balance.curve_error) == pytest.approx((0.0, 1 / 132))
    said = "unstable: front at M1-wall absorbed 101 kJ, and the area below its curve is 100 kJ; take a smaller step"
    assert str(s.status) == said


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        ({"over": False}, "time limit"),
        ({"stroke_max": np.array([0.05, np.nan])}, "unstable: a value is not finite; take a smaller step"),
        ({"first_force_time": np.array([-1.0, 0.1])}, "over"),  # the coupler behind was not pressed
        ({"first_force_time": np.array([-1.0, 0.0])}, "over"),  # pressed from the start
        (
            {"first_force_time": np.array([-1.0, -1.0])},
            "no contact: the two sides came to rest, or stopped coming closer, before a device was pressed",
        ),
        (
            {"first_force_time": np.array([-1.0, -1.0]), "over": False},
            "no contact: no device was pressed before the time limit",
        ),
        ({"stroke_max": np.array([0.05, 0.300])}, "over"),  # the limit itself may be reached
        ({"stroke_max": np.array([0.8, 0.2])}, "over"),  # and the end of a curve
        ({"stroke_max": np.array([0.05, 0.3012])}, "stroke exhausted at M1-wall (301.2 of 300 mm)"),
        (
            {"stroke_max": np.array([0.8012, 0.3012])},
            "curve ended at M1-M2 (801.2 mm, past the end of the curve of d); not valid after 0.3 s",
        ),
    ],
)
def test_status_in_words(against_a_wall, fields, status):
    assert str(tallied(against_a_wall, **fields).status) == status


def test_plain_values_have_none_where_json_has_no_number(against_a_wall):
    plain = tallied(
        against_a_wall, stroke_max_time=np.array([np.inf, 0.1]), device_peak=np.array([np.nan, 1.0])
    ).as_dict()
    assert [v["balance_time_s"] for v in plain["vehicles"]] == [0.1, None]
    assert plain["vehicles"][1]["peak_device_acceleration_g"] is None
    assert plain["criteria"]["TAMA_g"] is None
    assert plain["criteria"]["TS_mm"] == pytest.approx(273.0)
    assert set(plain) == {
        *(
            "status",
            "where",
            "reason",
            "criteria",
            "duration_s",
            "interfaces",
            "vehicles",
            "balance",
            "limits",
            "remarks",
            "valid",
            "valid_until_s",
        )
    }
    front = plain["interfaces"][0]
    assert (front["crush_mm"], front["exhausted"]) == (pytest.approx(207.5), False)
    assert front["stages"] == [
        {"name": "device", "stroke_mm": pytest.approx(207.5), "limit_mm": 300.0, "energy_kJ": pytest.approx(100.0)}
    ]
    assert plain["interfaces"][1]["stages"][0]["limit_mm"] is None


# a front of two different devices

SOFT = envelope([(0, 0), (100, 500), (400, 700), (401, 2500), (500, 2600)], 60)
HARD = envelope([(0, 0), (80, 600), (300, 2000), (600, 2100)], 90)


@pytest.fixture(scope="module", params=[False, True], ids=["soft into hard", "hard into soft"])
def unequal(request) -> tuple[Chain, Summary]:
    left, right = (HARD, SOFT) if request.param else (SOFT, HARD)
    front = joined(left, right)
    case = replace(chain([33e3, 50e3], [left], [7.0, 0.0], step=2e-5), interfaces=(front,))
    return case, collide(case)


def test_each_side_of_an_unequal_front_is_reported(unequal):
    case, summary = unequal
    own, partner = summary.interfaces
    assert (own.name, partner.name) == ("front", "front partner")
    assert (own.device, partner.device) == ("left", "right")
    assert own.peak_force_kN == partner.peak_force_kN
    for side in (own, partner):
        e = case.interfaces[0].devices[side is partner].envelope.climbing
        force = side.peak_force_kN * 1e3
        assert e.force_at(side.stroke_mm * 1e-3) == pytest.approx(force, rel=2e-3), "each side carries the peak force"
        recovered = force / e.stiffness * 1e3
        assert side.permanent_mm == pytest.approx(side.stroke_mm - recovered, rel=2e-3), "each gives back along its own"
        absorbed = e.energy(side.stroke_mm * 1e-3) - 0.5 * force**2 / e.stiffness
        assert side.energy_kJ * 1e3 == pytest.approx(absorbed, rel=2e-3), "each absorbs the area under its own curve"
    assert own.energy_kJ + partner.energy_kJ == pytest.approx(summary.balance.absorbed_kJ, rel=1e-3)
    assert summary.TS_mm == pytest.approx(own.stroke_mm), "TS is that of the moving train"


@pytest.mark.parametrize("speed", [1.5, 4.0, 6.0])
@pytest.mark.parametrize("swapped", [False, True])
def test_a_pair_that_snaps_gives_each_device_what_its_own_curve_takes(speed, swapped):
    """A device that shears off before a soft one is no instability, and what it sets free is not the partner's energy.

    On either side, each device has its largest stroke, before it sprang back, and the area below its curve.
    """
    shearing = envelope([(0, 0), (50, 1000), (50.2, 0), (100, 0), (180, 1500), (900, 1500)], 2000)
    spring = envelope([(0, 0), (20, 900), (400, 1300), (800, 1300)], 30)
    sides = (spring, shearing) if swapped else (shearing, spring)
    front = joined(*sides)
    case = replace(chain([33e3, 50e3], [spring], [speed, 0.0], step=2e-5), interfaces=(front,))
    summary = collide(case)
    assert str(summary.status) == "over"
    assert summary.balance.curve_error < 1e-4
    for side, e in zip(summary.interfaces, sides, strict=True):
        path, stroke = e.climbing, side.stroke_mm * 1e-3
        area = path.energy(stroke) - 0.5 * path.force_at(stroke) ** 2 / e.stiffness
        assert side.energy_kJ == pytest.approx(area / 1e3, abs=0.05)
    lost = summary.balance.absorbed_kJ - sum(side.energy_kJ for side in summary.interfaces)
    if speed == 1.5:
        assert lost == pytest.approx(0.0, abs=1e-9)
        assert not any("neither" in remark for remark in summary.remarks)
    else:
        assert summary.interfaces[0 if swapped else 1].stroke_mm > 50, "the soft one had 1000 kN before it sprang back"
        assert f"front: {lost:.4g} kJ of the absorbed energy are in neither device" in summary.remarks[-1]


def test_sides_of_equal_curve_but_different_limits_are_both_reported():
    """A partner whose device is allowed less stroke must not hide behind the moving train's."""
    v = values([(0, 0), (10, 500), (500, 500)], 100, partner="u", speed_m_s=3.0, step_ms=0.1)
    v["devices"]["short"] = {**v["devices"]["d"], "stroke_limit_mm": 20.0}
    v["trains"]["u"] = {**v["trains"]["t"], "front": "short"}
    summary = summarise(run(Scenario.from_values(v)))
    assert [i.name for i in summary.interfaces] == ["S1-M1", "S1-M1 partner"]
    assert [i.exhausted for i in summary.interfaces] == [False, True]


# statuses


def test_status_over(standard_summary):
    assert str(standard_summary.status) == "over"
    assert standard_summary.duration_s < 3.0


def test_status_time_limit():
    summary = summarise(run(load("b_type", {"simulation.time_limit_s": 0.2})))
    assert str(summary.status) == "time limit"
    assert summary.duration_s == pytest.approx(0.2, abs=2e-3)
    assert summary.balance.elastic_kJ > 0


def test_status_names_every_stage_that_passed_its_limit():
    """Breaks if the first stage of a device hides that the next one is at its end."""
    v = values([(0, 0), (10, 500), (800, 500)], 100, speed_m_s=5.0, step_ms=0.1)
    stage = {"stroke_mm": [0, 50, 100], "force_kN": [0, 500, 500]}
    stages = {"a": {"curve": stage, "stroke_limit_mm": 60}, "b": {"curve": stage, "stroke_limit_mm": 70}}
    v["devices"]["d"] = {"stages": stages, "stiffness_kN_per_mm": 100, "beyond": "hold"}
    status = summarise(run(Scenario.from_values(v))).status
    assert status.where == ("M1-wall a", "M1-wall b")
    assert status.detail.startswith("M1-wall a (100.0 of 60 mm), M1-wall b (")
    assert status.detail.endswith("of 70 mm)")


def test_each_stage_has_the_energy_of_its_own_part_of_the_curve():
    """Breaks where what the last stage gives back is taken from the one before, by the round-off of strokes."""

    def stage(stroke: float, force: float) -> dict:
        return {"curve": {"stroke_mm": [0, 5, stroke], "force_kN": [0, force, force]}}

    v = values([(0, 0), (10, 500), (800, 500)], 100, speed_m_s=3.0, step_ms=0.05)
    bolts = stage(31.7, 500) | {"shear_off": {"force_kN": 600}}
    stages = {"a": bolts, "b": stage(40.3, 700) | {"empty_stroke_mm": 11.1}, "c": stage(90, 1000)}
    other = {"a": bolts, "b": stage(300, 2500) | {"empty_stroke_mm": 12.3}}
    v["devices"]["d"] = {"stages": stages, "stiffness_kN_per_mm": 220, "beyond": "hold"}
    v["devices"]["e"] = {"stages": other, "stiffness_kN_per_mm": 600, "beyond": "hold"}
    v["obstacles"] = {"o": {"fixed": True, "front": "e"}}
    v["collision"]["partner"] = "o"
    for k in range(8):
        v["collision"]["speed_km_h"] = 20.0 + 0.07 * k
        _, b, c = summarise(run(Scenario.from_values(v))).interfaces[0].stages
        assert c.energy_kJ > 5.0, "it was pressed"
        assert b.energy_kJ == pytest.approx(700 * (40.3 - 2.5) / 1e3, rel=3e-2), k


@pytest.mark.parametrize("kind", ["crush", "gas_hydraulic"])
def test_a_car_body_absorbs_its_collapse_force_times_its_stroke(kind):
    """Breaks where what the spring gives back is taken from the last stage alone: it was compressed before."""
    if kind == "crush":
        v = values([(0, 0), (10, 800), (120, 800)], 20, mass_t=[40.0], speed_m_s=8.0, step_ms=0.05)
        v["devices"]["d"]["beyond"] = "car_body"
    else:
        v = values([(0, 0), (10, 800)], 100, mass_t=[40.0], speed_m_s=8.0, step_ms=0.05)
        gas = {"force_kN": 50, "length_mm": 120, "exponent": 1.3, "preload_stiffness_kN_per_mm": 50}
        beyond = {"kind": "car_body", "stiffness_kN_per_mm": 100}
        orifice = {"orifice_kN_s2_per_m2": 4, "rebound_orifice_kN_s2_per_m2": 4}
        v["devices"]["d"] = {"kind": kind, "stroke_mm": 100, "gas": gas, "beyond": beyond, **orifice}
    device, body = summarise(run(Scenario.from_values(v))).interfaces[0].stages
    assert body.stroke_mm > 50
    assert body.energy_kJ == pytest.approx(2.0 * body.stroke_mm, rel=1e-2)
    assert device.energy_kJ > 0


def test_status_stroke_exhausted_names_stage_stroke_and_limit():
    summary = summarise(run(load("b_type", {"speed_km_h": 30})))
    assert str(summary.status).startswith("stroke exhausted at S1-M1 anti_climber (")
    assert "of 265 mm" in str(summary.status)
    assert summary.interfaces[0].exhausted
    assert not summary.interfaces[0].beyond_curve


def test_status_past_the_end_of_a_curve():
    """Breaks if numbers from behind the end of a curve look as good as those before it."""
    v = values([(0, 0), (10, 500), (50, 500)], 100, speed_m_s=3.0, step_ms=0.1)
    summary = summarise(run(Scenario.from_values(v)))
    stroke, until = summary.interfaces[0].stroke_mm, summary.valid_until_s
    assert str(summary.status) == (
        f"curve ended at M1-wall ({stroke:.1f} mm, past the end of the curve of d); not valid after {until:.4g} s"
    )
    assert until == pytest.approx(0.050 / 3.0, abs=1e-3), "it has hardly slowed down by then"
    assert summary.interfaces[0].beyond_curve
    v["devices"]["d"]["beyond"] = "hold"
    held = summarise(run(Scenario.from_values(v)))
    assert (str(held.status), held.interfaces[0].stroke_mm) == ("over", stroke), "the same numbers, on the user's word"
    assert np.isnan(held.valid_until_s)


def test_status_of_a_draw_gear_past_the_end_of_its_curve():
    """Breaks if the curve for pressing is named, which did not end."""
    v = values([(0, 0), (10, 500), (800, 500)], 100, speed_m_s=5.0, step_ms=0.1)
    pull = {"curve": {"stroke_mm": [0, 5], "force_kN": [0, 20]}, "stiffness_kN_per_mm": 10}
    v["devices"]["c"] = {**v["devices"]["d"], "beyond": "hold", "pull": pull}
    train = v["trains"][v["collision"]["train"]]
    train |= {"mass_t": 40, "vehicles": [{"name": "a", "coupler": "c"}, {"name": "b", "brakes": {"force_kN": 100}}]}
    v["collision"]["gap_mm"] = 5000
    summary = summarise(run(Scenario.from_values(v)))
    assert str(summary.status).startswith(
        "curve ended at M1-M2 (drawn past the end of the curve of the draw gear of c);"
    )
    assert "the draw gear of c at M1-M2" in tables.why_not_valid(summary)


def test_two_that_never_meet_are_over_at_once_or_run_out_of_time():
    far = collide(line_up(load("b_type", {"collision.gap_mm": 60_000, "collision.rail_friction": 0})))
    assert str(far.status) == "no contact: no device was pressed before the time limit"
    assert far.TS_mm == 0.0
    assert {v.peak_device_acceleration_g for v in far.vehicles} == {0.0}
    assert [v.mean_deceleration_g for v in far.vehicles] == [0.0] * 12


def test_an_unequal_front_that_is_never_pressed_absorbs_nothing():
    front = joined(SOFT, HARD)
    case = replace(chain([33e3, 50e3], [SOFT], [0.0, 1.0], gap=0.1), interfaces=(front,))
    summary = collide(case)
    assert [i.energy_kJ for i in summary.interfaces] == [0.0, 0.0]
    assert str(summary.status).startswith("no contact")


def unstable(factor: float) -> Chain:
    """Three light vehicles on stiff springs, stepped beyond the stable limit."""
    e = envelope([(0, 0), (50, 50_000)], 1000)
    case = chain([1000.0] * 3, [e, e], [3.0, 0.0, 0.0])
    return replace(case, step=factor * largest_step(case), steps_per_record=1)


@pytest.mark.parametrize("factor", [1.5, 2.5, 5.0, 20.0])
def test_status_unstable_where_devices_give_back_more_than_they_took(factor, monkeypatch):
    """The balance of speeds and work closes whatever the step, so energy from nowhere must be seen elsewhere."""
    monkeypatch.setattr(Measured, "jumped", np.array([False]))  # without the smaller steps that would mend it
    summary = collide(unstable(factor))
    assert summary.balance.kinetic_end_kJ > 2 * summary.balance.kinetic_start_kJ, "this test needs an unstable case"
    assert str(summary.status).startswith("unstable: ")
    assert "smaller step" in str(summary.status)


def test_status_unstable_where_values_are_not_finite():
    ok = run(load("b_type", {"simulation.time_limit_s": 0.05}))
    broken = changed(ok.tally, point_speed=ok.tally.speed * np.nan)
    assert str(measure(ok.chain, broken, ok.time, ok.velocity).status).startswith("unstable: a value is not finite")


def test_summary_as_plain_values_has_the_keys_of_the_command_line(standard_summary: Summary, standard_result: Result):
    plain = standard_summary.as_dict()
    assert {"status", "criteria", "interfaces", "vehicles", "balance"} <= set(plain)
    assert set(plain["criteria"]) == {"TS_mm", "TAMA_g"}
    assert {"name", "stroke_mm", "permanent_mm", "peak_force_kN", "energy_kJ"} <= set(plain["interfaces"][0])
    assert {
        "name", "mass_t", "peak_device_acceleration_g", "peak_acceleration_g", "final_speed_km_h", "balance_time_s",
    } <= set(plain["vehicles"][0])  # fmt: skip
    assert {"energy_error", "momentum_error"} <= set(plain["balance"])
    assert len(plain["vehicles"]) == len(standard_result.chain.vehicles)


def test_a_passed_limit_does_not_hide_that_the_collision_was_cut_off():
    """Breaks if the strokes of a collision that was not over look final."""
    summary = summarise(run(load("b_type", {"collision.speed_km_h": 40, "simulation.time_limit_s": 0.2})))
    assert summary.status.kind == "stroke exhausted"
    assert summary.status.reason.endswith("; cut off by the time limit")


def test_a_draw_gear_of_one_side_counts_on_that_side_alone():
    """Breaks if the energies of the two devices of an interface add up to more than the interface has absorbed."""
    tube = {
        "curve": {"stroke_mm": [0, 1, 300], "force_kN": [0, 900, 900]},
        "stiffness_kN_per_mm": 300,
        "beyond": "hold",
    }
    gear = {"curve": {"stroke_mm": [0, 1, 300], "force_kN": [0, 30, 30]}, "stiffness_kN_per_mm": 50}
    values = {
        "devices": {"plain": tube, "pulls": tube | {"pull": gear}},
        "trains": {
            "t": {"vehicles": 1, "mass_t": 72, "front": "plain"},
            "u": {"vehicles": 2, "mass_t": 20, "front": "plain", "coupler": ["plain", "pulls"]},
        },
        "collision": {"train": "t", "speed_km_h": 36, "partner": "u"},
        "simulation": {"time_limit_s": 0.6},
    }
    result = run(Scenario.from_values(values))
    energies = {i.name: i.energy_kJ for i in summarise(result).interfaces}
    k = [i.name for i in result.chain.interfaces].index("S1-S2")
    assert result.stroke[:, k].min() < -0.003, "it was drawn apart"
    assert energies["S1-S2 S2"] > energies["S1-S2 S1"] + 0.1
    assert energies["S1-S2 S1"] + energies["S1-S2 S2"] == pytest.approx(result.energy[-1, k] / 1e3, rel=1e-9)
