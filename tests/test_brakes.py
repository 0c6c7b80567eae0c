"""Brakes, grade and rail friction: what holds, what rolls, and where the energy goes."""

from __future__ import annotations

from typing import Any

import pytest
from builders import values

from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import Scenario

G = 9.80665


def case(
    brakes: dict[str, Any] | None = None, struck: dict[str, Any] | None = None, limit_s: float = 3.0, **collision: float
) -> Scenario:
    """A wagon of 33 t at 5 m/s towards a standing one; what each train has beside that, and the collision."""
    v = values([(0, 0), (10, 500), (900, 500)], 100, partner="u", speed_m_s=5.0, step_ms=0.1, time_limit_s=limit_s)
    v["trains"]["u"] = {**v["trains"]["t"], **({"brakes": struck} if struck else {})}
    v["trains"]["t"] |= {"brakes": brakes} if brakes else {}
    v["collision"] |= collision
    return Scenario.from_values(v)


@pytest.mark.parametrize(("force_kN", "stays"), [(17.0, True), (15.0, False)])
def test_a_parked_wagon_stays_where_its_brake_holds_the_grade(force_kN, stays):
    """50 per mille pull 33 t with 16.18 kN."""
    result = run(case(struck={"force_kN": force_kN}, gap_mm=100_000, grade_per_mille=50))
    moved = float(result.position[-1, 1] - result.position[0, 1])
    if stays:
        assert abs(moved) < 1e-9
    else:
        assert moved == pytest.approx(-0.5 * (G * 0.05 - 15e3 / 33e3) * result.tally.time**2, rel=1e-2)


def test_adhesion_caps_the_brake():
    """0.1 m g of 33 t are 32.4 kN, whatever the brake could give."""
    result = run(case(brakes={"force_kN": 100.0, "adhesion": 0.1}, gap_mm=100_000, limit_s=2.0))
    assert 5.0 - result.tally.speed[0] == pytest.approx(0.1 * G * result.tally.time, rel=1e-6)


def test_work_is_split_between_rails_and_brake_by_their_limits():
    """0.01 m g of rail friction beside a brake of 4 times as much: a fifth of the work is the rails'."""
    brake = 4 * 0.01 * 33 * G
    result = run(case(brakes={"force_kN": brake}, gap_mm=100_000, limit_s=2.0, rail_friction=0.01))
    rails, brakes = float(result.tally.friction_work[0]), float(result.tally.brake_work[0])
    assert brakes == pytest.approx(4 * rails, rel=1e-9)
    lost = 0.5 * 33e3 * (5.0**2 - float(result.tally.speed[0]) ** 2)
    assert rails + brakes == pytest.approx(lost, rel=1e-4)


@pytest.mark.parametrize("grade", [-20.0, 0.0, 20.0])
def test_the_books_close_with_brakes_friction_and_grade(grade):
    """Breaks if the work of the grade has the wrong sign, or a brake works on a wagon that stands."""
    brakes = {"force_kN": 30.0, "delay_s": 0.2, "rise_s": 0.5}
    summary = summarise(run(case(brakes, {"force_kN": 20.0}, gap_mm=500, grade_per_mille=grade, rail_friction=0.01)))
    assert abs(summary.balance.energy_error) < 1e-4
    assert abs(summary.balance.momentum_error) < 1e-9


def test_without_brakes_and_grade_none_of_them_work():
    tally = run(case(gap_mm=500, rail_friction=0.01)).tally
    assert not tally.brake_work.any()
    assert not tally.grade_work.any()


def test_two_that_roll_together_again_are_not_over():
    """Breaks if a train that a brake slows down, or a grade lets roll back, ends its collision too early."""
    result = run(case(gap_mm=20_000, grade_per_mille=30, limit_s=20.0))
    assert result.tally.first_force_time[0] > 0.0, "they met on the way"
    uphill = run(case(gap_mm=0, struck={"force_kN": 200.0}, grade_per_mille=100, limit_s=3.0))
    assert uphill.tally.time <= 3.0 + 1e-3
