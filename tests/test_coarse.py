"""Peaks for which the step is coarse: what the law notes of them, what a run says, and what the right values are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_tally import AGAINST_A_WALL, TO_A_STANDSTILL, TWO_TRAINS, ride

from trainmj.collision.batch import run_chains
from trainmj.collision.block import Layout
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.fields import Car, Joint
from trainmj.collision.lineup import line_up
from trainmj.collision.simulation import run
from trainmj.collision.status import COARSE
from trainmj.collision.summary import Summary, summarise
from trainmj.scenario import Scenario, load
from trainmj.sweep.page import page_of_folder
from trainmj.sweep.plan import grid_of
from trainmj.sweep.run import run_sweep
from trainmj.sweep.screen import said_of_result


def on_a_wall(device: dict[str, Any], mass_t: float, speed_m_s: float, **more: Any) -> Scenario:
    """A vehicle with a device, that runs into a wall."""
    return Scenario.from_values(
        {
            "devices": {"d": device},
            "trains": {"t": {"vehicles": 1, "mass_t": mass_t, "front": "d"}},
            "collision": {"train": "t", "speed_km_h": 3.6 * speed_m_s, "partner": "rigid_wall", **more},
            "simulation": {"time_limit_s": 0.2},
        }
    )


def found_at(scenario: Scenario, step_ms: float = 0.1) -> Summary:
    return summarise(run(scenario.with_values({"simulation.step_ms": step_ms})))


def says(summary: Summary) -> bool:
    return COARSE in str(summary.status)


# narrow peaks that are passed within a step, with a dashpot, and at a rate

PEAK = {"stroke_mm": [0, 5, 60, 60.1, 60.2, 400], "force_kN": [0, 1300, 1300, 1850, 1300, 1300]}
DAMPED = {"curve": PEAK, "stiffness_kN_per_mm": 800, "damping_kN_s_per_m": 110, "beyond": "hold"}
RATED = {"curve": PEAK, "stiffness_kN_per_mm": 8000, "rate": {"C_m_per_s": 50, "P": 1}, "beyond": "hold"}


def test_a_peak_between_two_steps_has_the_dashpot_on_the_way_up():
    """800 kN/mm climb by 80 kN within 0.1 mm, 600 mm a step; with 110 kN s/m at 6 m/s the device reaches 1850 kN."""
    result = run(on_a_wall(DAMPED, 30, 6))
    assert result.chain.refined
    assert summarise(result).interfaces[0].peak_force_kN == pytest.approx(1850, rel=1e-9)


def test_a_peak_between_two_steps_is_higher_at_a_rate():
    scenario = on_a_wall(RATED, 60, 6).with_values({"simulation.time_limit_s": 0.02})
    summary, fine = found_at(scenario), found_at(scenario, 0.0005)
    assert summary.interfaces[0].peak_force_kN == pytest.approx(fine.interfaces[0].peak_force_kN, rel=2e-3)
    assert summary.interfaces[0].peak_force_kN > 1850 * 1.1


# sharp peaks

UNDAMPED = DAMPED | {"damping_kN_s_per_m": 0}


def test_a_sharp_peak_is_off_by_no_more_than_is_said():
    """From 60 mm on the force climbs along 800 kN/mm until it meets the flank that falls by 5500 kN/mm."""
    scenario = on_a_wall(UNDAMPED, 40, 3)
    coarse, fine = found_at(scenario), found_at(scenario, 0.001)
    exact = 1300 + 800 * (1850 - 1300 + 5500 * 0.1) / (5500 + 800)
    error = abs(coarse.interfaces[0].peak_force_kN / exact - 1)
    assert error > 0.03
    (said,) = (remark for remark in coarse.remarks if "steps before and behind" in remark)
    share = float(said.partition("M1-wall (")[2].partition("%")[0]) / 100
    assert error < share < 0.15
    assert str(coarse.status) == f"over: {COARSE} for the peak forces of M1-wall, M1"
    assert fine.interfaces[0].peak_force_kN == pytest.approx(exact, rel=2e-3)
    assert not says(fine)


# peaks that come late, after many swings

STOPS = {"curve": {"stroke_mm": [0, 20], "force_kN": [0, 10000]}, "stiffness_kN_per_mm": 500, "empty_stroke_mm": 5}
RATTLING = {
    "devices": {
        "stops": STOPS | {"beyond": "hold"},
        "tube": {"curve": {"stroke_mm": [0, 1, 2000], "force_kN": [0, 300, 300]}, "stiffness_kN_per_mm": 300},
    },
    "trains": {
        "t": {
            "vehicles": [{"name": f"{mass} t", "mass_t": mass, "coupler": "stops"} for mass in (26, 14, 9, 22)],
            "front": "tube",
        }
    },
    "collision": {"train": "t", "speed_km_h": 20, "partner": "rigid_wall"},
    "simulation": {"time_limit_s": 1.0},
}


def test_vehicles_that_rattle_have_peaks_that_hang_on_the_step():
    """At 0.1 ms a peak is 16 % off, which a step of a fifth has within 0.2 %, as one of an eighth shows."""
    scenario = Scenario.from_values(RATTLING)
    coarse, fine, finer = (found_at(scenario, step) for step in (0.1, 0.02, 0.0125))
    names = [name for name in fine.responses if name.startswith("peak_device_")]
    errors = [abs(coarse.responses[name] / fine.responses[name] - 1) for name in names]
    assert max(errors) > 0.1
    assert [finer.responses[name] for name in names] == pytest.approx(
        [fine.responses[name] for name in names], rel=1e-3
    )
    assert says(coarse)
    assert not says(fine)
    assert any("has swung so often" in remark for remark in coarse.remarks)


# nothing to say


@pytest.mark.parametrize(
    "device",
    [
        UNDAMPED | {"curve": {"stroke_mm": [0, 5, 60, 65, 70, 400], "force_kN": [0, 1300, 1300, 1850, 1300, 1300]}},
        {"kind": "hydraulic", "stroke_mm": 400, "orifice_kN_s2_per_m2": 40}
        | {"beyond": {"kind": "stop", "stiffness_kN_per_mm": 100}},
    ],
)
def test_nothing_is_said_of_a_peak_that_the_step_meets(device: dict[str, Any]):
    scenario = on_a_wall(device, 40, 3)
    found, fine = found_at(scenario), found_at(scenario, 0.0125)
    assert found.interfaces[0].peak_force_kN == pytest.approx(fine.interfaces[0].peak_force_kN, rel=5e-3)
    assert not says(found)


# what the law notes, and where it is shown


@pytest.mark.parametrize("case", [AGAINST_A_WALL, TWO_TRAINS, TO_A_STANDSTILL])
def test_the_notes_are_what_the_history_says(case: Chain):
    """To the last bit, of forces as the sensors have them."""
    layout, n = Layout.of(case), 2500
    h = ride(case, layout, n)
    m = len(case.interfaces)
    force = h.sensors[:, :m]
    walled = case.interfaces[-1].right == WALL
    sides = np.column_stack([np.zeros(n), force, *([] if walled else [np.zeros(n)])])
    for k in range(m):
        noted = [layout.joint(h.block, field)[k] for field in (Joint.FORCE_RISE, Joint.FORCE_FALL)]
        assert noted == beside(force[:, k])
    for i, net in enumerate((sides[:, :-1] - sides[:, 1:]).T):
        if np.abs(net[-1]) < np.abs(net).max():  # one that is still there at the end has not fallen yet
            noted = [layout.car(h.block, field)[i] for field in (Car.PEAK_RISE, Car.PEAK_FALL)]
            assert noted == beside(net)
        swung = np.abs(np.diff(net, prepend=0.0))[: np.abs(net).argmax() + 1].sum()
        assert layout.car(h.block, Car.PEAK_SWUNG)[i] == pytest.approx(swung, rel=1e-12)


def beside(force: np.ndarray) -> list[float]:
    """By how much the largest magnitude is above those before and behind it."""
    at = int(np.abs(force).argmax())
    sign, peak = np.sign(force[at]), abs(force[at])
    return [peak - sign * force[at - 1], peak - sign * force[at + 1]]


def test_a_batch_and_a_sweep_say_the_same(tmp_path):
    sharp, rattling = on_a_wall(UNDAMPED, 40, 3), Scenario.from_values(RATTLING)
    found = dict(
        run_chains([(0, line_up(sharp)), (1, line_up(load("b_type_wall"))), (2, line_up(rattling))], threads=1)
    )
    assert found[0] == summarise(run(sharp))
    assert found[2] == summarise(run(rattling))
    assert [says(found[n]) for n in range(3)] == [True, False, True]
    result = run_sweep(grid_of(sharp, {"collision.speed_km_h": [0.36, 10.8]}, "TS_mm"), tmp_path)
    table = result.to_frame()
    assert result.coarse == 1
    assert [COARSE in str(reason) for reason in table["reason"]] == [False, True]
    assert table["reason"][1] == found[0].status.reason
    assert any(f"1 of 2 cases have a {COARSE}" in line for line in said_of_result(result))
    assert f"1 of 2 cases have a {COARSE}" in page_of_folder(tmp_path).html()


def test_in_the_vertical_plane_it_is_said_too():
    """Of cars that ring without dashpots, in a single run and in a batch; with them nothing is to be said."""
    shorter = {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.4}
    undamped = {f"devices.{name}.damping_kN_s_per_m": 0 for name in ("front", "coupler_a_b", "coupler_c_d")}
    scenario, damped = load("b_type_vertical", shorter | undamped), load("b_type_vertical", shorter)
    summary = summarise(run(scenario))
    assert says(summary)
    assert COARSE in summary.row()["reason"]
    found = dict(run_chains([(0, line_up(scenario)), (1, line_up(damped))], threads=1))
    assert found[0] == summary
    assert not says(found[1])
