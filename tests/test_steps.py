"""The step: what is too large for a kind of device, and where steps are made smaller by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import KINDS_OF_DEVICE, SHIPPED, built, few

from trainmj.collision.batch import run_chains
from trainmj.collision.chain import WALL, Chain, Interface, Vehicle, meet
from trainmj.collision.lineup import line_up
from trainmj.collision.measured import Measured
from trainmj.collision.simulation import run
from trainmj.collision.stability import largest_step
from trainmj.collision.status import COARSE
from trainmj.collision.summary import Summary, summarise
from trainmj.scenario import Scenario, load

APEX = {
    "devices": {
        "d": {
            "stages": {
                "coupler": {
                    "curve": {"stroke_mm": [0, 73, 300], "force_kN": [0, 800, 1000]},
                    "shear_off": {"force_kN": 2000, "ramp_mm": 0.25},
                },
                "climber": {
                    "empty_stroke_mm": 50,
                    "curve": {"stroke_mm": [0, 1, 400], "force_kN": [0, 1250, 1250]},
                },
            },
            "stiffness_kN_per_mm": 5000,
        }
    },
    "trains": {"t": {"vehicles": 1, "mass_t": 40, "front": "d"}},
    "collision": {"train": "t", "speed_km_h": 25, "partner": "rigid_wall"},
}


def apex(**simulation: float) -> Scenario:
    return Scenario.from_values(APEX | {"simulation": simulation})


def test_a_peak_between_two_steps_is_found_by_smaller_ones():
    """A step of 0.7 mm jumps over bolts that shear within 0.5 mm: 1250 kN and 3.2 g would stand for 2000 kN and 5.1."""
    result = run(apex())
    summary = summarise(result)
    assert result.chain.refined
    assert summary.interfaces[0].peak_force_kN == pytest.approx(2000, rel=2e-3)
    assert summary.vehicles[0].peak_device_acceleration_g == pytest.approx(2000 / 40 / 9.80665, rel=2e-3)
    assert any("made smaller there" in remark for remark in summary.remarks)
    fine = run(apex(step_ms=0.001, record_every_ms=1))
    by_itself = summarise(fine)
    assert summary.interfaces[0].peak_force_kN == pytest.approx(by_itself.interfaces[0].peak_force_kN, rel=2e-3)
    assert summary.interfaces[0].stroke_mm == pytest.approx(by_itself.interfaces[0].stroke_mm, rel=2e-3)


def test_a_batch_makes_the_same_smaller_steps():
    """To the last bit, beside cases that need none."""
    cases = {name: line_up(s) for name, s in (("apex", apex()), ("plain", load("b_type_wall")), ("again", apex()))}
    found = dict(run_chains(cases.items(), threads=1))
    assert found["apex"] == found["again"] == summarise(run(apex()))
    assert found["plain"] == summarise(run(load("b_type_wall")))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_need_no_smaller_steps(name):
    """Breaks if every user of a shipped scenario were to pay for two runs, or be told of a step that does."""
    result = run(load(name))
    assert not result.chain.refined
    assert COARSE not in str(summarise(result).status)


@pytest.mark.parametrize("ramp_mm", [0.05, 0.01])
def test_ramps_that_are_far_narrower_than_a_step_are_no_instability(ramp_mm):
    values = run(load("b_type_wall")).scenario.values()
    values["devices"]["front"]["stages"]["coupler"]["shear_off"]["ramp_mm"] = ramp_mm
    assert not str(summarise(run(Scenario.from_values(values))).status).startswith("unstable")


def ridden(name: str, other: str | None, factor: float, integrator: str = "euler") -> tuple[Summary, Chain]:
    """40 t with a device, or two in series, against a wall at 3 m/s, at a part of the largest step."""
    devices = built()
    sides = (devices[name],) if other is None else (devices[name], devices[other])
    joint = Interface("I0", 0, WALL, meet(*sides, coupled=False), sides, ("I0", "I0 partner") if other else ())
    case = Chain((Vehicle("V0", "", 4e4, 20.0, 3.0),), (joint,), 1, 0.0, 1e-4, 1, 2.0, integrator)
    case = replace(case, step=factor * largest_step(case))
    (found,) = dict(run_chains([(0, case)])).values()
    return found, case


@pytest.mark.parametrize("other", few([None, "damped", "tube", "oil"], 2))
@pytest.mark.parametrize("name", KINDS_OF_DEVICE)
def test_just_below_the_largest_step_no_energy_is_made(name, other):
    """Breaks if the bound of a kind is too large: the vehicle would come back faster than it came."""
    if other == name:
        return
    found, _ = ridden(name, other, 0.99)
    assert found.balance.kinetic_end_kJ <= found.balance.kinetic_start_kJ * (1 + 1e-9)
    assert np.isfinite(found.balance.energy_error)


@pytest.mark.parametrize("name", ["held", "stopped", "damped"])
def test_far_above_the_largest_step_the_balance_breaks(name, monkeypatch):
    """Breaks if the bound were needlessly small by far; without the smaller steps that would mend it."""
    monkeypatch.setattr(Measured, "jumped", np.array([False]))
    found, _ = ridden(name, None, 20.0)
    assert str(found.status).startswith("unstable")
