"""The vertical plane: what must hold of its model and law, and what a user sees of override."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import planar

from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.collision.saved import load_result
from trainmj.collision.simulation import run
from trainmj.collision.stability import largest_step
from trainmj.collision.status import Kind
from trainmj.collision.summary import Summary, summarise
from trainmj.errors import InputError
from trainmj.scenario import load
from trainmj.single import figures
from trainmj.verification import plane
from trainmj.verification.suite import run_case
from trainmj.verification.systems import Ride

SHORT = {
    "trains.b_type.vehicles": [{"name": "Tc", "coupler": "coupler_a_b"}, {"name": "Mp"}],
    "simulation.step_ms": 0.25,
    "simulation.time_limit_s": 0.5,
}
HIGH = {"collision.offset_mm": {"M": 40}}


def collided(*changes: dict) -> list[Summary]:
    """Summaries of short collisions in the plane, with changes each."""
    cases = enumerate(line_up(planar(SHORT | c)) for c in changes)
    found = dict(run_chains(cases, threads=1))
    return [found[k] for k in range(len(changes))]


_LONG = (plane.by_scipy, plane.locked, plane.batch_and_single)


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=c.__name__, marks=[pytest.mark.thorough] * (c in _LONG)) for c in plane.CASES],
)
def test_verification(case):
    """Statics, kinematics, forces or books of the plane would be wrong."""
    checks = list(run_case(case))
    assert checks
    assert [str(check) for check in checks if not check.passed] == []


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [3, 8])
def test_random_trains_beside_an_integration_by_scipy(seed):
    """A sign, a lever or a state of the plane would be wrong where no formula looks."""
    checks = list(plane.by_scipy([seed], 0.2))
    assert [str(check) for check in checks if not check.passed] == []


def test_without_the_plane_nothing_of_it_changes_a_number():
    """Vehicle types, lines and offsets would leak into one dimension."""
    plain = load("b_type", {"simulation.time_limit_s": 0.3})
    stated = planar(HIGH | {"plane": "line", "simulation.time_limit_s": 0.3})
    (_, a), (_, b) = run_chains(enumerate(map(line_up, (plain, stated))), threads=1)
    assert a.row() == b.row()


def test_a_result_is_read_back_as_it_was_saved(tmp_path):
    """Wheelsets, lines or degrees of freedom would be lost in the file."""
    result = run(planar(SHORT | HIGH))
    result.save(tmp_path / "result.nc")
    again = load_result(tmp_path / "result.nc")
    numbers, read = result.numbers(), again.numbers()
    assert numbers.keys() == read.keys()
    assert [name for name in numbers if not np.array_equal(numbers[name], read[name], equal_nan=True)] == []
    assert summarise(again).as_dict() == summarise(result).as_dict()
    assert result.dof.shape[1] == 4 * 11
    assert result.wheel_load.shape[1] == 4 * 4


def test_the_step_hardly_moves_the_answers():
    """A step that is too coarse for rails, stops or ties would pass as an answer."""
    steps = (0.05, 0.1, 0.25)
    runs = collided(*(HIGH | {"simulation.step_ms": h} for h in steps))
    for name, most in (("largest_step_mm", 0.5), ("largest_wheel_lift_mm", 0.1), ("least_wheel_load", 0.005)):
        assert np.ptp([r.values[name] for r in runs]) <= most


def test_faces_that_slide_off_each_other_end_what_can_be_said():
    """An override would be reported as a prediction."""
    kept, off = collided(HIGH, HIGH | {"devices.front.stages.anti_climber.line.overlap_mm": 60})
    assert kept.status.kind is Kind.TIME_LIMIT
    assert not kept.not_valid
    assert off.status.kind is Kind.OVERRIDE
    assert off.status.where == ("S1-M1",)
    assert "anti_climber" in off.status.detail
    assert "60 mm of overlap" in off.status.detail
    assert off.not_valid
    assert off.valid_until_s == pytest.approx(off.interfaces[0].peak_time_s, abs=0.5)
    assert off.interfaces[0].met_step_mm > 60 > 40


def test_ties_hold_what_slides_without_them():
    """Ties stated, free and tied would not be what they say."""
    free, stated, tied = (s.interfaces[0] for s in collided(*(HIGH | {"ties": t} for t in ("free", "stated", "tied"))))
    assert free.tie_force_kN == 0.0
    assert free.slip_mm > stated.slip_mm > 0.0
    assert tied.slip_mm == 0.0
    assert tied.tie_force_kN > 0.0


def test_a_strut_raises_the_step_before_the_faces_meet():
    """A coupler between pins would not push its ends apart; one that acts as a face at its height would."""
    face = planar().values()["devices"]["front"]["stages"]["anti_climber"]["line"] | {"height_mm": 660}
    strut, flat = collided(HIGH, HIGH | {"devices.front.stages.coupler.line": face})
    assert strut.interfaces[0].met_step_mm > 1.3 * flat.interfaces[0].met_step_mm
    assert flat.interfaces[0].met_step_mm == pytest.approx(40, abs=5)


def test_limits_of_the_plane_are_judged_as_others():
    """A limit on lift or step would be refused, or kept by whatever happens."""
    (found,) = collided(
        HIGH | {"limits": {"wheel_lift_mm": 0.001, "step_mm": 300, "largest_step_mm": 10, "met_step_mm": 119}}
    )
    assert {c.name: c.kept for c in found.limits if c.of_scenario} == {
        "wheel_lift_mm": found.largest_wheel_lift_mm <= 0.001,
        "step_mm": True,
        "largest_step_mm": False,
        "met_step_mm": True,  # of the front: couplers between cars have no faces
    }
    with pytest.raises(InputError, match="plane: vertical"):
        line_up(load("b_type", {"limits": {"wheel_lift_mm": 21}}))
    for least in ("wheel_load", "wheel_load_M1", "load_M1_wheelset_1", "least_wheel_load"):
        with pytest.raises(InputError, match=f"limits.{least} = 0.4: is worst where it is least"):
            line_up(planar({"limits": {least: 0.4}}))


def test_a_step_that_is_too_large_is_refused():
    """Stiff lines, rails and stops would run away unnoticed."""
    case = planar({"simulation.step_ms": 1.0})
    with pytest.raises(InputError, match="must be at most"):
        line_up(case)
    ride = Ride(replace(line_up(planar()), step=0.99 * largest_step(line_up(planar()))))
    assert np.abs(ride.go(0.3).data.qpos).max() < 10.0


def test_an_obstacle_only_slides():
    """A free obstacle would pitch on bogies that it does not have."""
    face = planar().values()["devices"]["front"]["stages"]["anti_climber"]["line"]
    lorry = {
        "obstacles": {"lorry": {"mass_t": 15, "front": "side"}},
        "devices.side": {
            "curve": {"stroke_mm": [0, 5, 1500], "force_kN": [0, 500, 500]},
            "stiffness_kN_per_mm": 10,
            "line": face,
        },
        "trains.b_type.front": "ram",
        "devices.ram": planar().values()["devices"]["coupler_c_d"] | {"line": face},
        "collision.partner": "lorry",
    }
    result = run(planar(SHORT | lorry))
    assert result.dof.shape[1] == 2 * 11 + 1
    (partner,) = (v for v in summarise(result).vehicles if v.name == "S1")
    assert partner.pitch_mrad == partner.wheel_lift_mm == 0.0
    assert np.isnan(partner.wheel_load)
    pitches = figures.plane(result, summarise(result)).axes[1].lines
    assert [line.get_label() for line in pitches] == ["M1", "M2"]


def test_a_strut_swings_before_what_is_fixed():
    """The stop at the pin of a fixed obstacle would not act, and yet count in the balance of energy."""
    device = {"curve": {"stroke_mm": [0, 50, 900], "force_kN": [0, 500, 900]}, "stiffness_kN_per_mm": 50}
    line = planar().values()["devices"]["front"]["stages"]["coupler"]["line"]
    stop = {
        "devices.ram": device | {"beyond": "stop", "line": line},
        "devices.side": device | {"beyond": "stop", "line": line | {"height_mm": 1000}},
        "obstacles": {"block": {"fixed": True, "front": "side"}},
        "trains.b_type.front": "ram",
        "trains.b_type.vehicles": [{"name": "Tc"}],
        "collision.partner": "block",
    }
    (found,) = collided(HIGH | stop)
    assert found.interfaces[0].swing_moment_kN_m > 50
    assert abs(found.balance.energy_error) < 1e-4


def test_vehicles_stand_as_stated():
    """Offsets and pitch would not be where the vehicles are, or not in equilibrium."""
    case = line_up(planar(SHORT | {"collision.offset_mm": {"M": 40, "M2": 10}, "collision.pitch_mrad": {"S1": 4}}))
    by_name = {v.name: v.gear for v in case.vehicles}
    assert [by_name[name].offset for name in ("M1", "M2", "S1")] == pytest.approx([0.04, 0.01, 0.0])
    assert by_name["S1"].pitch == pytest.approx(-0.004)  # the end that faces the impact, on its left, is up
