"""Halving the step: limits of known sequences, and what a user is told."""

from __future__ import annotations

import json

import numpy as np
import pytest
from builders import scenario
from click.testing import CliRunner

from trainmj.cli import main
from trainmj.collision import convergence
from trainmj.collision.convergence import converge, limit
from trainmj.errors import InputError
from trainmj.scenario import load
from trainmj.single.tables import _change


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_limit_of_a_sequence_that_follows_an_order(order):
    steps = 0.1 * 0.5 ** np.arange(4)
    found = limit([1370.0 + 40.0 * h**order for h in steps])
    assert found.value == pytest.approx(1370.0, rel=1e-12)
    assert found.order == pytest.approx(order, rel=1e-6)
    assert found.error == pytest.approx(40.0 * 0.1**order / 1370.0, rel=1e-6)


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 1.1, 1.3], [1.0, 1.1, 1.1], [0.0, 0.0, 0.0]])
def test_a_sequence_without_order_is_not_extrapolated(values):
    found = limit(values)
    assert found.order is None
    assert found.value == values[-1]


def test_smooth_collision_settles_and_its_error_is_that_of_the_formula():
    """A spring against a wall: the largest force is v sqrt(k m)."""
    case = scenario([(0, 0), (50, 50_000)], 1.0, mass_t=[1.0], step_ms=0.4, time_limit_s=0.2)
    found = converge(case)
    exact = np.sqrt(1e6 * 1e3) / 1e3 / 9.80665
    assert found.settled
    assert found.step_ms[0] == pytest.approx(0.4)
    assert found.step_ms[1] == pytest.approx(0.2)
    assert list(found.estimates) == ["TS_mm", "TAMA_g"]
    TAMA = found.estimates["TAMA_g"]
    assert TAMA.unit == "g"
    assert TAMA.value == pytest.approx(exact, rel=2e-4)
    assert TAMA.error == pytest.approx(abs(found.summaries[0].TAMA_g / exact - 1), abs=2e-4)
    assert found.stroke_changes_mm[-1] == 0.0


def test_not_settled_is_said_and_is_exit_code_1(monkeypatch):
    monkeypatch.setattr(convergence, "SETTLED", 0.0)
    monkeypatch.setattr(convergence, "MOST_HALVINGS", 3)
    said = CliRunner().invoke(main, ["run", "b_type_wall", "--converge"])
    assert said.exit_code == 1
    assert "Not settled at 0.0125 ms" in said.output
    assert max(len(line) for line in said.output.splitlines()) <= 80


def test_json_has_every_step():
    said = CliRunner().invoke(main, ["run", "b_type_wall", "--converge", "--json"])
    assert said.exit_code == 0
    found = json.loads(said.output)["convergence"]
    assert found["settled"]
    steps = [s["step_ms"] for s in found["steps"]]
    assert steps == pytest.approx([0.1 / 2**n for n in range(len(steps))])
    assert found["TAMA_g"]["error"] < 0.002


def test_a_step_that_cannot_be_halved_is_refused():
    case = load("b_type", {"simulation.step_ms": 0.0002, "simulation.time_limit_s": 0.001})
    with pytest.raises(InputError, match="cannot be halved often enough"):
        converge(case)


def test_other_responses_settle_by_their_names(monkeypatch):
    case = scenario([(0, 0), (50, 50_000)], 1.0, mass_t=[1.0], step_ms=0.4, time_limit_s=0.2)
    found = converge(case, ["stroke_*", "force_M1_wall_kN"])
    assert list(found.columns) == ["stroke_M1_wall_mm", "force_M1_wall_kN"]
    stroke, force = found.estimates.values()
    assert (stroke.unit, force.unit) == ("mm", "kN")
    assert stroke.value == pytest.approx(31.622777, rel=1e-4)
    assert force.value == pytest.approx(31.622777, rel=1e-4)
    assert found.values["force_M1_wall_kN"][0] == found.summaries[0].interfaces[0].peak_force_kN
    monkeypatch.setattr(convergence, "SETTLED", 1e-8)
    assert len(converge(case, ["duration_s"]).step_ms) == 4, "what no step moves settles at once"
    assert len(converge(case, ["duration_s", "force_*"]).step_ms) > 4, "each of them must settle"


@pytest.mark.thorough
def test_command_settles_what_is_asked_for():
    words = ["run", "b_type_wall", "--converge", "--responses", "stroke_M1_wall*, peak_device_*"]
    said = CliRunner().invoke(main, words)
    assert max(len(line) for line in said.output.splitlines()) <= 80
    shown = said.output.split("The step, halved")[1]
    for title in ("stroke M1-wall anti climber ", "peak device M6 "):
        assert shown.count(title) >= 2, "in the table of changes and that of limits"
    assert "TAMA" not in shown
    spoken = json.loads(CliRunner().invoke(main, [*words, "--json"]).output)["convergence"]
    assert spoken["peak_device_M6_g"]["unit"] == "g"
    assert len(spoken["steps"][0]) == 5 + 4 + 6, "of each step, of the front and its stages, of the vehicles"
    assert "TS_mm" not in spoken


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--responses", "TS_mm"], "--responses: needs --converge"),
        (["--converge", "--responses", "TS_m"], "no response is called 'TS_m'; did you mean 'TS_mm'?"),
        (["--converge", "--responses", "TS_mm, "], "no response is called ''"),
    ],
)
def test_responses_that_are_not_there_are_refused(words, message, tmp_path):
    said = CliRunner().invoke(main, ["run", "b_type_wall", "--out", str(tmp_path / "out"), "--figures", "none", *words])
    assert said.exit_code == 2
    assert message in said.output


def test_what_is_0_and_stays_0_does_not_change():
    assert [_change(*pair) for pair in ((0.0, 0.0), (0.0, 2.0), (2.0, 1.0))] == [0.0, None, -50.0]


def test_a_response_that_is_not_a_number_is_refused_with_the_reason():
    with pytest.raises(InputError, match="too far apart for its filter"):
        converge(load("b_type_wall", {"simulation.record_every_ms": 10}), ["cfc60*"])
