"""Limits that a scenario states: judged for the moving train, at the worst place, and shown everywhere."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from builders import changed, few, scenario
from click.testing import CliRunner

from trainmj.cli import main
from trainmj.collision.limits import Criterion
from trainmj.collision.lineup import line_up
from trainmj.collision.records import StageUse
from trainmj.collision.simulation import run
from trainmj.collision.summary import measure, summarise
from trainmj.errors import InputError
from trainmj.scenario import load, save
from trainmj.single.page import page_of_run
from trainmj.single.tables import interfaces, limits

CURVE = [(0, 0), (10, 800), (1000, 800)]


def found_with(limits, **more):
    case = scenario(CURVE, 80.0, partner="t", mass_t=[20, 30], speed_m_s=3.0, time_limit_s=0.3, **more)
    return summarise(run(case.with_values({f"limits.{name}": value for name, value in limits.items()})))


def test_a_quantity_is_judged_at_the_worst_vehicle_of_the_moving_train():
    summary = found_with({"peak_device_acceleration_g": 2.0})
    (criterion,) = summary.limits
    own = {v.name: v.peak_device_acceleration_g for v in summary.vehicles if v.name.startswith("M")}
    assert criterion.where == max(own, key=own.get)
    assert criterion.found == own[criterion.where]
    assert not criterion.kept
    assert found_with({"peak_device_acceleration_g": 50.0}).limits[0].kept


def test_the_partner_is_not_judged():
    """The standing train ends faster than the moving one: only a limit between the two tells which is judged."""
    summary = found_with({})
    ends = {side: [v.final_speed_km_h for v in summary.vehicles if v.name[0] == side] for side in "MS"}
    assert max(ends["M"]) < max(ends["S"])
    limit = (max(ends["M"]) + max(ends["S"])) / 2
    assert found_with({"final_speed_km_h": limit}).limits[0].kept


def test_a_limit_is_one_of_the_magnitude():
    """Breaks if a value below zero keeps every limit, as the error of a balance often is."""
    summary = found_with({"energy_error": 1e-15, "momentum_error": 1.0})
    error, momentum = summary.limits
    assert abs(error.found) > 1e-15
    assert not replace(error, found=-abs(error.found)).kept
    assert replace(momentum, found=-0.5).kept
    assert replace(momentum, found=-0.5).used == 50.0


def test_a_limit_of_what_is_not_a_number_is_refused_with_the_reason():
    case = load("b_type", {"simulation.record_every_ms": 10, "limits.cfc60_peak_g": 3})
    with pytest.raises(
        InputError, match=r"limits.cfc60_peak_g = 3: .*too far apart for its filter, window or flight: take at most 1.6"
    ):
        line_up(case)


def test_the_limit_of_a_single_named_stage_has_its_own_path():
    """Breaks if JSON names a path that --set would refuse."""
    stages = {"only": {"curve": {"stroke_mm": [0, 10, 400], "force_kN": [0, 800, 800]}, "stroke_limit_mm": 70}}
    case = load("b_type_wall", {"devices.coupler_a_b": {"stages": stages, "stiffness_kN_per_mm": 100}})
    names = [c.name for c in summarise(run(case)).limits]
    path = "devices.coupler_a_b.stages.only.stroke_limit_mm"
    assert path in names
    assert case.with_values({path: 80}).locate(path) == [80]


def test_a_quantity_of_interfaces_and_a_single_response():
    summary = found_with({"stroke_mm": 1.0, "stroke_M1_M2_mm": 1e4, "TS_mm": 10.0})
    by_name = {c.name: c for c in summary.limits}
    assert by_name["stroke_mm"].where == "S1-M1"
    assert by_name["stroke_M1_M2_mm"].found == summary.interfaces[1].stroke_mm
    assert by_name["stroke_M1_M2_mm"].title == "stroke M1-M2"
    assert [c.kept for c in summary.limits] == [False, True, False]


def test_stage_limits_are_judged_where_the_stage_is_used_most():
    summary = summarise(run(load("b_type", {"collision.speed_km_h": 30})))
    by_name = {c.name: c for c in summary.limits}
    coupler = by_name["devices.coupler_c_d.stroke_limit_mm"]
    strokes = {i.name: i.stroke_mm for i in summary.interfaces if i.device == "coupler_c_d"}
    assert coupler.where == max(strokes, key=strokes.get)
    anti_climber = by_name["devices.front.stages.anti_climber.stroke_limit_mm"]
    assert anti_climber.found == summary.interfaces[0].stages[1].stroke_mm
    assert not anti_climber.kept
    assert len(summary.limits) == 5


@pytest.mark.parametrize("by", few([-1e-3, 1e-3], 1))
def test_what_is_shown_does_not_contradict_the_verdict(by):
    """A stroke of 105.4 of 105.4 mm that fails, at 100 % of the limit: digits are added until the two differ."""
    stroke = found_with({}).interfaces[1].stroke_mm
    summary = found_with({"stroke_M1_M2_mm": stroke + by})
    (row,) = limits(summary.limits).rows
    found, allowed = (float(cell.split()[0]) for cell in row[2:4])
    assert (found <= allowed, float(row[4]) <= 100, row[5].kind == "pass") == (by > 0,) * 3
    assert found != allowed
    stage = StageUse("tube", stroke, stroke + by, 1.0)
    front = replace(summary.interfaces[0], stages=(stage, stage))
    rows = interfaces(replace(summary, interfaces=(front,))).rows
    assert float(rows[1][2]) != pytest.approx(stage.limit_mm, abs=1e-4)
    assert rows[1][-1].kind == ("pass" if by > 0 else "fail")


def test_round_off_breaks_no_limit():
    """Breaks if 800.0000000000003 kN breaks a limit of 800 kN, at which nobody can see why."""
    kept = Criterion("F_kN", "F", "", 800.0000000000003, 800.0, "kN", 1)
    assert kept.kept
    assert kept.text == "800.0"
    assert not StageUse("tube", 380.00000000000006, 380.0, 1.0).exhausted
    assert StageUse("tube", 380.0001, 380.0, 1.0).exhausted


def test_a_value_that_is_not_a_number_is_not_kept():
    case = scenario(CURVE, 80.0, partner="t", mass_t=[20, 30], speed_m_s=3.0, time_limit_s=0.3)
    result = run(case.with_values({"limits.mean_deceleration_g": 5.0}))
    (of_m2,) = (i for i, v in enumerate(result.chain.vehicles) if v.name == "M2")
    means = result.tally.contact_mean.copy()
    means[of_m2] = math.nan
    broken = measure(result.chain, changed(result.tally, contact_mean=means), result.time, result.velocity)
    assert (broken.limits[0].where, broken.limits[0].kept) == ("M2", False)
    assert str(broken.status) == "limit passed: mean deceleration of M2 (no number)"
    assert not Criterion("a", "a", "", math.inf, 1.0, "", 1).kept


def test_a_limit_that_is_passed_is_the_status():
    """A case that is over but passed a limit must not read as one that kept all."""
    kept, over = found_with({"TAMA_g": 50.0}), found_with({"TAMA_g": 0.1, "peak_device_S1_g": 0.1, "energy_kJ": 50.0})
    assert (kept.status.kind, over.status.kind) == ("over", "limit passed")
    tama, partner, _ = over.limits
    assert str(over.status) == (
        f"limit passed: TAMA ({tama.text} of 0.1 g), peak device S1 of the partner ({partner.text} of 0.1 g)"
    )
    assert over.row()["status"] == "limit passed"


def test_a_limit_can_be_the_exit_code_of_a_run():
    words = ["run", "b_type_wall", "--set", "simulation.step_ms=0.5", "--set", "limits.TAMA_g=0.1"]
    assert [CliRunner().invoke(main, [*words, *more]).exit_code for more in ((), ("--fail-on-limit",))] == [0, 1]
    assert CliRunner().invoke(main, [*words[:-2], "--fail-on-limit"]).exit_code == 0


def test_a_device_past_its_limit_names_the_limits_of_the_scenario_too():
    found = summarise(run(load("b_type", {"speed_km_h": 30, "limits.TAMA_g": 1.0})))
    assert str(found.status).startswith("stroke exhausted at S1-M1 anti_climber (")
    assert "; limit passed: TAMA (" in str(found.status)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mean_decelleration_g", "limits.mean_decelleration_g = 5: .* did you mean 'mean_deceleration_g'?"),
        ("peak_device_acceleration_m_s2", "limits.peak_device_acceleration_m_s2 = 5: there is no quantity or response"),
        ("stroke_M6_M7_mm", "limits.stroke_M6_M7_mm = 5: .* did you mean 'stroke_M5_M6_mm'"),
        ("5_g", "limits.5_g = 5: must be a letter, then letters, digits and _"),
    ],
)
def test_an_unknown_name_is_refused_with_its_place(tmp_path, name, message):
    file = tmp_path / "mine.yaml"
    file.write_text(f"builds_on: b_type\nlimits:\n  {name}: 5\n")
    with pytest.raises(InputError, match=f"mine.yaml:3:3: {message}"):
        line_up(load(file))


@pytest.mark.parametrize("value", [0, -1, math.nan, "5 g"])
def test_a_limit_is_a_number_above_0(value):
    with pytest.raises(InputError, match=r"limits\.TS_mm"):
        load("b_type", {"limits.TS_mm": value})


def test_a_scenario_without_limits_shows_no_verdict(tmp_path):
    case = scenario(CURVE, 80.0, partner="t", speed_m_s=3.0, time_limit_s=0.3)
    result = run(case)
    summary = summarise(result)
    assert summary.limits == ()
    assert "not all are kept" not in page_of_run(result, summary, tmp_path / "result.nc").html()
    save(case, tmp_path / "train.yaml")
    said = CliRunner().invoke(main, ["run", str(tmp_path / "train.yaml")])
    assert said.exit_code == 0
    assert "allowed     %" not in said.output


def test_limits_are_on_the_terminal_in_json_and_in_the_report(tmp_path):
    words = ["run", "b_type_wall", "--set", "limits.TS_mm=1000"]
    said = CliRunner().invoke(main, words)
    assert said.exit_code == 0, "how a collision ends decides the exit code, not its limits"
    (line,) = (line for line in said.output.splitlines() if line.startswith("TS  "))
    assert "1000 mm" in line
    assert "FAIL" in line
    spoken = json.loads(CliRunner().invoke(main, [*words, "--json"]).output)
    keys = {"name", "where", "found", "limit", "unit", "kept", "valid", "source"}
    assert [set(c) for c in spoken["limits"]] == [keys] * 6
    ts = next(c for c in spoken["limits"] if c["name"] == "TS_mm")
    stated = {"name": "TS_mm", "where": "", "limit": 1000, "unit": "mm", "source": ""}
    assert ts == stated | {"found": ts["found"], "kept": False, "valid": True}
    assert ts["found"] == spoken["criteria"]["TS_mm"]
    out = tmp_path / "out"
    done = CliRunner().invoke(main, [*words, "--out", str(out), "--figures", "none", "--report"])
    assert done.exit_code == 0
    assert json.loads((out / "summary.json").read_text())["limits"] == spoken["limits"]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "5 of 6" in page
    assert "not all are kept" in page


def test_limits_on_pulls_car_bodies_and_whatever_is_not_valid():
    """Breaks if a limit for a draw gear or a car body has no name, or one is kept by a number that is not valid."""
    changes = {"limits": {"peak_pull_kN": 300, "stroke_S1_M1_car_body_mm": 2, "pull_M2_M3_kN": 600}}
    scenario = load(Path(__file__).parent / "every_kind.yaml", changes)
    pull, body, one = summarise(run(scenario)).limits[:3]
    assert (pull.where, pull.found, pull.kept) == ("M2-M3", pytest.approx(380, rel=5e-3), False)
    assert (body.found > 2, body.kept, one.found > 300, one.kept) == (True, False, True, True)
    short = {"stroke_mm": [0, 10, 30], "force_kN": [0, 200, 300]}
    for criterion in summarise(run(scenario.with_values({"devices.open.curve": short}))).limits:
        assert (criterion.valid, criterion.kept) == (False, False)
    with pytest.raises(InputError, match="pull_M3_M4_kN"):
        run(scenario.with_values({"limits.pull_M3_M4_kN": 5}))
