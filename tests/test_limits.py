"""The ends of what a scenario may ask for: each is computed with its balances closed, or refused with a reason."""

from __future__ import annotations

import pytest

from trainmj.collision.lineup import line_up
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.scenario import load
from trainmj.verification.systems import collide


def closed(**changes) -> Summary:
    """The collision, its balances closed."""
    case = line_up(load("b_type", {k.replace("__", "."): v for k, v in changes.items()}))
    (summary,) = collide(case)
    assert not str(summary.status).startswith("unstable"), summary.status
    assert abs(summary.balance.energy_error) <= 1e-3
    assert abs(summary.balance.momentum_error) <= 1e-9
    return summary


@pytest.mark.parametrize("mass_t", [1.0, 200.0])
@pytest.mark.parametrize("speed_km_h", [0.1, 200.0])
def test_lightest_and_heaviest_slowest_and_fastest(mass_t, speed_km_h):
    step_ms = 0.1 if mass_t > 1 else 0.005
    summary = closed(
        mass_t=mass_t,
        speed_km_h=speed_km_h,
        simulation__step_ms=step_ms,
        simulation__record_every_ms=1.0,
        simulation__time_limit_s=1.0,
    )
    assert summary.TS_mm > 0
    assert str(summary.status).startswith("stroke exhausted") == (speed_km_h > 100)


def test_what_is_too_light_for_its_devices_is_refused_by_the_step():
    """Breaks if a bound of masses stands in for what the integration can bear."""
    with pytest.raises(InputError, match=r"step_ms = 0\.1: must be at most .* ms for the stiffness and damping"):
        closed(mass_t=0.001)


@pytest.mark.parametrize(
    ("moving", "standing"), [(25.0, -25.0), (200.0, -200.0), (50.0, 25.0), (200.0, 199.9), (-20.0, -25.0)]
)
def test_both_trains_move(moving, standing):
    summary = closed(speed_km_h=moving, collision__partner_speed_km_h=standing)
    assert summary.interfaces[0].peak_force_kN > 0


@pytest.mark.parametrize("standing", [25.0, 24.95, 30.0])
def test_trains_that_do_not_come_closer_are_refused(standing):
    with pytest.raises(InputError, match=r"must be more than partner_speed_km_h .* by 0.1 km/h or more"):
        closed(speed_km_h=25.0, collision__partner_speed_km_h=standing)


@pytest.mark.parametrize("n", [1, 200])
@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_one_vehicle_and_four_hundred(n, friction):
    summary = closed(trains__b_type__vehicles=n, collision__rail_friction=friction, simulation__time_limit_s=0.3)
    assert len(summary.vehicles) == 2 * n


def test_more_vehicles_are_refused():
    with pytest.raises(InputError, match="more than 400 vehicles"):
        closed(trains__b_type__vehicles=201)


@pytest.mark.parametrize("gap_mm", [0.0, 50.0, 5000.0])
def test_a_gap_against_a_wall(gap_mm):
    summary = closed(
        trains__b_type__vehicles=1,
        collision__partner="rigid_wall",
        collision__gap_mm=gap_mm,
        collision__rail_friction=0.0,
    )
    assert summary.interfaces[0].peak_force_kN == pytest.approx(1250, rel=0.1)


@pytest.mark.parametrize(("friction", "ended"), [(0.008, "the two sides came to rest"), (0.0, "before the time limit")])
def test_a_train_that_does_not_arrive_says_so(friction, ended):
    summary = closed(speed_km_h=0.1, collision__gap_mm=1000.0, collision__rail_friction=friction)
    assert str(summary.status).startswith("no contact: ")
    assert ended in str(summary.status)
    assert summary.TS_mm == 0.0


def test_a_step_too_large_for_a_light_vehicle_is_refused_with_the_largest():
    with pytest.raises(InputError, match=r"must be at most \d\.?\d* ms|must be at most 0\.\d+ ms"):
        closed(mass_t=1.0, simulation__step_ms=2.0, simulation__record_every_ms=2.0)


def test_an_error_cannot_hide_behind_a_common_speed():
    """The balance is relative to what the collision converts, whatever speed all vehicles share."""
    slow = closed(collision__rail_friction=0.0)
    fast = closed(collision__rail_friction=0.0, speed_km_h=200.0, collision__partner_speed_km_h=175.0)
    assert fast.balance.kinetic_start_kJ > 50 * slow.balance.kinetic_start_kJ
    assert fast.balance.energy_error == pytest.approx(slow.balance.energy_error, rel=1e-3, abs=1e-9)
