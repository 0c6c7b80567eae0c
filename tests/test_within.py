"""Steps of the law within one of MuJoCo's: the bits of MuJoCo's own steps, and MuJoCo where the law has come to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from builders import ALONG, chain, envelope, few
from test_steps import apex

from trainmj.collision import batch, kernel
from trainmj.collision.batch import run_chains, steps_within
from trainmj.collision.block import Layout
from trainmj.collision.chain import Chain
from trainmj.collision.fields import Head
from trainmj.collision.lineup import line_up
from trainmj.collision.measured import Measured
from trainmj.collision.model import build
from trainmj.collision.simulation import run, start
from trainmj.collision.summary import summarise
from trainmj.errors import EngineError
from trainmj.scenario import Scenario, load
from trainmj.verification.mixed import random_scenario, with_bodies

EVERY_KIND = str(Path(__file__).with_name("every_kind.yaml"))
BODY = {"trains.b_type.body": {"stiffness_kN_per_mm": 1000}}
DOWNHILL = {"trains.b_type.brakes": {"force_kN": 30, "delay_s": 0.1, "rise_s": 0.3}, "collision.grade_per_mille": 20}


def alike(*scenarios: Scenario) -> None:
    """Side by side, the law making the steps, they have every bit of single runs, of which MuJoCo makes each step."""
    chains = [line_up(scenario) for scenario in scenarios]
    assert all(steps_within(chain) > 1 for chain in chains), "MuJoCo would make each step"
    found = dict(run_chains(enumerate(chains), threads=1))
    for n, scenario in enumerate(scenarios):
        assert found[n] == summarise(run(scenario))


@pytest.mark.parametrize("name", ALONG)
def test_shipped_scenarios_have_the_bits_of_single_runs(name: str):
    alike(load(name))


@pytest.mark.parametrize(
    "changes",
    few(
        [
            {"simulation.record_every_ms": 10},
            {"simulation.record_every_ms": 0.5, **BODY},
            {"simulation.record_every_ms": 3, "simulation.averaging_ms": 7.3, **DOWNHILL},
            {"simulation.record_every_ms": 1, "simulation.averaging_ms": 0.1, "collision.partner": "rigid_wall"},
            {"simulation.step_ms": 0.25, "simulation.record_every_ms": 0.5, "collision.gap_mm": 100},
            {"simulation.time_limit_s": 0.0503, "simulation.record_every_ms": 3},
        ],
        4,
    ),
)
@pytest.mark.parametrize("integrator", ["euler", "events"])
def test_whatever_is_recorded_averaged_or_acts(changes: dict[str, Any], integrator: str):
    alike(load("b_type", changes | {"simulation.integrator": integrator}))


@pytest.mark.parametrize("integrator", ["euler", "events"])
def test_every_kind_of_device_draw_gear_that_breaks_and_smaller_steps(integrator: str):
    changes = {"simulation.integrator": integrator}
    cases = [load(EVERY_KIND, changes), apex(step_ms=0.1).with_values(changes), load("b_type_wall", changes)]
    alike(*cases)
    assert run(cases[1]).chain.refined, "its step is one that is made in parts"


@pytest.mark.parametrize("seed", few([3, 4, 5, 8, 19, 24, 31, 34], 2))
def test_random_trains_with_bodies(seed: int):
    values = with_bodies(random_scenario(seed), seed)
    values["simulation"] |= {"step_ms": 0.02, "record_every_ms": 0.5, "time_limit_s": 0.2}
    alike(*(Scenario.from_values(values).with_values({"simulation.integrator": i}) for i in ("euler", "events")))


def test_steps_within_one_of_mujocos():
    """Up to 2 ms over several records, or one record where that is longer."""
    found = {
        record_ms: steps_within(line_up(load("b_type", {"simulation.record_every_ms": record_ms})))
        for record_ms in (0.1, 0.5, 1, 1.5, 3, 10)
    }
    assert found == {0.1: 16, 0.5: 20, 1: 20, 1.5: 15, 3: 30, 10: 100}
    assert steps_within(line_up(load("b_type", {"simulation.integrator": "implicitfast"}))) == 0
    assert steps_within(line_up(load("b_type_vertical"))) == 0


@pytest.mark.parametrize("case", [line_up(load("b_type", BODY)), line_up(load("b_type_wall"))], ids=["body", "wall"])
def test_mujoco_goes_where_the_law_has_come_to(case: Chain):
    within = steps_within(case)
    layout = Layout.of(case, n_ring=32, within=within)
    model = build(case, layout, bare=True)
    model.opt.timestep *= within
    data = start(model, case, layout)
    apart, steps = 0.0, 0
    with kernel.installed():
        while True:
            mujoco.mj_step(model, data)
            if data.userdata[Head.DONE]:
                break
            at = int(data.userdata[Head.MOTION])
            apart = max(apart, np.abs(data.qpos - data.userdata[at : at + model.nq]).max())
            steps += 1
    assert steps > 100
    assert apart < 1e-12
    assert data.userdata[Head.STRAYED] < 1e-12


def test_a_force_of_someone_else_is_said(monkeypatch):
    """Breaks if MuJoCo were to move vehicles without the law, or the law without MuJoCo."""
    advance = batch._Engine._advance

    def pushed(self, ids):
        self._batch.bind("qfrc_applied")[:] = 1e3
        return advance(self, ids)

    monkeypatch.setattr(batch._Engine, "_advance", pushed)
    with pytest.raises(EngineError, match="something else moved the vehicles"):
        dict(run_chains([(0, line_up(load("b_type")))], threads=1))


@pytest.mark.parametrize("step", [2e-3, 1e-2, 0.1])
@pytest.mark.parametrize("integrator", ["euler", "events"])
def test_a_step_that_is_too_large_ends_as_unstable_beside_its_neighbours(step: float, integrator: str, monkeypatch):
    monkeypatch.setattr(Measured, "jumped", np.array([False]))  # without the smaller steps that would mend it
    scenario = load("b_type", {"simulation.step_ms": 0.5, "simulation.integrator": integrator})
    good = line_up(scenario)
    springs = [envelope([(0, 0), (10, 3000)], 300)] * 2
    light = replace(chain([33e3, 1e3, 20e3], springs, [5.0, 0.0, 0.0]), integrator=integrator)
    bad = [replace(case, step=step, steps_per_record=1) for case in (good, light)]
    found = dict(run_chains(enumerate([good, *bad, good]), threads=1))
    assert all(str(found[n].status).startswith("unstable") for n in (1, 2))
    assert found[0] == found[3] == summarise(run(scenario))
