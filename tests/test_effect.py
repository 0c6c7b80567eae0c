"""Values of which others take the place: a column that says nothing is refused, and none that says something."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import SHIPPED, few
from click.testing import CliRunner
from studies import SMALL

import trainmj
from trainmj.cases.effect import OF_MANY, idle, idle_held
from trainmj.cli import main
from trainmj.explore.session import Session
from trainmj.explore.values import values_of
from trainmj.scenario import Scenario, from_yaml

EVERY_KIND = from_yaml(Path(__file__).with_name("every_kind.yaml").read_text(encoding="utf-8"))
MASSES = {f"{side}{n}": {"mass_t": 33.0} for side in "MS" for n in range(1, 7)}
FRICTION = "trains.b_type.rail_friction"


LOAD = "trains.b_type.load"
OTHER = {"trains.other": {"vehicles": 1, "mass_t": 30, "front": "front"}}


def found(scenario: Scenario, *blocks: dict[str, list[Any]]) -> dict[str, str]:
    return {name: rule for (name,), rule in idle([scenario], blocks)}


B_TYPE = trainmj.load("b_type")


@pytest.mark.parametrize(
    ("changes", "blocks", "said"),
    [
        ({"as_built": MASSES}, [{"mass_t": [30, 36]}], {"mass_t": r"as_built\.M1\.mass_t, .* and others"}),
        (
            {"as_built": MASSES},
            [{"trains.b_type.mass_t": [30, 36]}, {"as_built.M1.mass_t": [30, 31]}],
            {"trains.b_type.mass_t": r"as_built"},
        ),
        ({}, [{"mass_t": [30, 36]}, {"as_built": [MASSES]}], {"mass_t": r"as_built"}),
        (
            {"trains.b_type.vehicles": [{"name": "A", "mass_t": 30}, {"name": "B", "mass_t": 31}]},
            [{"mass_t": [30, 36]}],
            {"mass_t": r"trains\.b_type\.vehicles\.0\.mass_t and trains\.b_type\.vehicles\.1\.mass_t: leave it out"},
        ),
        (
            {},
            [{"collision.rail_friction": [0.01, 0.02], FRICTION: [0.01, 0.03]}],
            {"collision.rail_friction": rf"is stated by {re.escape(FRICTION)}: leave it out"},
        ),
        ({FRICTION: 0.01}, [{"collision.rail_friction": [0.5]}], {"collision.rail_friction": "is stated by"}),
        ({LOAD: {"seats": 60, "share": 0, "kg": 75}}, [{f"{LOAD}.kg": [70, 80]}], {f"{LOAD}.kg": "nothing"}),
        ({}, [{"ties": ["free", "tied"]}], {"ties": "nothing that collides depends on it"}),
        ({}, [{"tolerances": [{}, {"m": {"of": "mass_t", "percent": 2}}]}], {"tolerances": "nothing that collides"}),
        ({"devices.spare": {"curve": {"stroke_mm": [0, 100], "force_kN": [0, 100]}, "stiffness_kN_per_mm": 10}},
         [{"devices.spare.stiffness_kN_per_mm": [10, 20]}, {"mass_t": [30, 36]}],
         {"devices.spare.stiffness_kN_per_mm": "nothing that collides"}),
    ],
)  # fmt: skip
def test_a_value_without_effect_is_found_with_what_takes_its_place(changes, blocks, said):
    rules = found(B_TYPE.with_values(changes), *blocks)
    assert rules.keys() == said.keys()
    for name, rule in rules.items():
        assert rule.startswith("has no effect: ")
        assert re.search(said[name], rule), rule


@pytest.mark.parametrize(
    ("changes", "blocks"),
    [
        ({}, [{"mass_t": [30.0]}]),
        ({"as_built": {"M1": {"mass_t": 33.0}}}, [{"mass_t": [30, 36]}]),
        ({}, [{"mass_t": [30, 36]}, {"as_built": [MASSES, None]}]),
        ({LOAD: {"seats": 60, "share": 0, "kg": 75}}, [{f"{LOAD}.kg": [70, 80]}, {f"{LOAD}.share": [0, 0.5]}]),
        (OTHER, [{"collision.partner": ["rigid_wall"] * 999 + ["other"], "trains.other.mass_t": [30, 40] * 500}]),
        (OTHER, [{"trains.other.mass_t": [30, 40]}, {"collision.partner": ["rigid_wall", "other"]}]),
        ({}, [{"trains.b_type.coupler": ["front", "coupler_c_d"]}, {"trains.b_type.vehicles": [1, 2]}]),
        ({}, [{"collision.train_end": ["front", "rear"]}]),
        ({}, [{"title": ["one", "other"], "mass_t": [30, 36]}]),
        ({}, [{"notes": ["one", "other"]}]),
        ({}, [{"limits.TAMA_g": [4, 5]}]),
        ({}, [{"simulation.contact_threshold_kN": [1, 2]}]),
        ({}, [{"simulation.averaging_ms": [30, 100]}]),
        ({}, [{"simulation.record_every_ms": [1, 2]}]),
        ({}, [{"occupants.free_flight_mm": [[300], [600]]}]),
        ({}, [{"collision.gap_mm": [0]}]),
        ({}, [{"mass_t": [1e9, 2e9]}]),
        ({}, [{"mass_t": [1e9, 33]}]),
        ({}, [{"plane": ["line", "vertical"]}]),
    ],
)  # fmt: skip
def test_a_value_with_effect_in_some_case_or_of_which_it_cannot_be_told_is_none(changes, blocks):
    assert found(B_TYPE.with_values(changes), *blocks) == {}


def test_an_effect_in_one_load_case_is_enough():
    overridden, free = (B_TYPE.with_values({"as_built": built}) for built in (MASSES, {}))
    assert list(idle([overridden, overridden], [{"mass_t": [30, 36]}]))
    assert not list(idle([overridden, free], [{"mass_t": [30, 36]}]))


@pytest.mark.parametrize("name", SHIPPED)
def test_every_parameter_of_a_shipped_scenario_has_an_effect(name):
    scenario = trainmj.load(name)
    values = {key: scenario.locate(key)[0] for key in scenario.parameters}
    numbers = {key: value for key, value in values.items() if isinstance(value, int | float)}
    assert not list(idle_held([scenario], numbers))


NUMBERS = values_of(EVERY_KIND)[0]


@pytest.mark.parametrize("kind", few(range(8), 2))
def test_what_has_no_effect_changes_no_bit_of_a_result(kind):
    """Two ways to the same: chains that are the same, and collisions that are."""
    scenario = EVERY_KIND.with_values({"simulation.time_limit_s": 0.05})
    numbers = [n for n in NUMBERS if n.name.partition(".")[0] not in OF_MANY and n.name != "simulation.time_limit_s"]
    before, told = trainmj.run(scenario), 0
    for number in numbers[kind::8]:
        if not list(idle_held([scenario], {number.name: number.value})):
            continue
        told += 1
        for value in (1.1 * number.value, number.value + 1):
            try:
                after = trainmj.run(scenario.with_values({number.name: value}))
            except trainmj.InputError:
                continue
            assert {k: v.tobytes() for k, v in after.numbers().items()} == {
                k: v.tobytes() for k, v in before.numbers().items()
            }, number.name
    assert told < len(numbers[kind::8])
    assert told or kind > 1, "nothing was compared"


WITHOUT = "has no effect: what it would change is stated by trains.b_type.rail_friction"
BOTH = {"collision.rail_friction": [0.01, 0.02], FRICTION: [0.01, 0.02]}


def test_sweeps_refuse_it(tmp_path):
    with pytest.raises(trainmj.InputError, match=f"collision.rail_friction: {WITHOUT}"):
        trainmj.sweep_of({"scenario": "b_type", "vary": BOTH})
    with pytest.raises(trainmj.InputError, match=f"collision.rail_friction: {WITHOUT}"):
        trainmj.grid_of("b_type", {"mass_t": [30, 36]}, changes=dict.fromkeys(BOTH, 0.01))
    held = {"first": {}, "second": {"set": dict.fromkeys(BOTH, 0.01)}}
    with pytest.raises(trainmj.InputError, match=rf"collision.rail_friction: {WITHOUT}.* \(in load case second\)"):
        trainmj.sweep_of({"scenario": "b_type", "cases": held, "vary": {"mass_t": [30, 36]}})
    with pytest.raises(trainmj.InputError, match=f"collision.rail_friction: {WITHOUT}"):
        trainmj.run_cases("b_type", BOTH)


def test_studies_refuse_it_where_it_is_stated():
    factors = {name: {"sets": path, "bounds": [0.01, 0.02]} for name, path in zip("AB", BOTH, strict=True)}
    with pytest.raises(trainmj.InputError, match=f"factors.A.sets = 'collision.rail_friction': {WITHOUT}"):
        trainmj.study_of(SMALL | {"factors": factors})
    with pytest.raises(trainmj.InputError, match=f"set.collision.rail_friction = 0.01: {WITHOUT}"):
        trainmj.study_of(SMALL | {"set": SMALL["set"] | dict.fromkeys(BOTH, 0.01)})


def test_identifications_refuse_it():
    data = {"rows": [{"v": v, "TS": ts} for v, ts in ((20, 900), (25, 1300))], "cases": {"v": "speed_km_h"}}
    given = {
        "scenario": "b_type",
        "set": {FRICTION: 0.01},
        "parameters": {"mu": {"sets": "collision.rail_friction", "bounds": [0.001, 0.1], "start": 0.01}},
        "targets": {"TS": {"response": "TS_mm", "tolerance": "1 %"}},
        "data": {"tests": data | {"values": {"TS": "TS"}}},
    }
    with pytest.raises(trainmj.InputError, match=f"parameters.mu.*: {WITHOUT}"):
        trainmj.targets_of(given)
    mass = {"m": {"sets": "mass_t", "bounds": [30, 36], "start": 33}}
    with pytest.raises(trainmj.InputError, match=f"set.collision.rail_friction = 0.01: {WITHOUT}"):
        trainmj.targets_of(given | {"parameters": mass, "set": dict.fromkeys(BOTH, 0.01)})
    assert trainmj.targets_of(given | {"set": {"simulation.step_ms": 0.5}})


def test_reliability_runs_refuse_it():
    tolerance = {"of": "collision.rail_friction", "kind": "discrete", "values": [0.005, 0.01]}
    given = {"scenario": "b_type", "tolerances": {"friction": tolerance}}
    with pytest.raises(trainmj.InputError, match=f"tolerances.friction: {WITHOUT}"):
        trainmj.reliability_of(given | {"set": {FRICTION: 0.01}})
    assert trainmj.reliability_of(given)
    mass = {"mass": {"of": "mass_t", "percent": 2, "copies": "same"}}
    with pytest.raises(trainmj.InputError, match=f"collision.rail_friction: {WITHOUT}"):
        trainmj.reliability_of(given | {"tolerances": mass, "set": dict.fromkeys(BOTH, 0.01)})


def test_the_command_line_refuses_it_and_takes_what_holds_anyway():
    both = [word for name in BOTH for word in ("--set", f"{name}=0.01")]
    for command in (["run"], ["check"], ["export"]):
        done = CliRunner().invoke(main, [*command, "b_type", *both], prog_name="trainmj")
        assert (done.exit_code, WITHOUT in done.output) == (2, True), done.output
    done = CliRunner().invoke(main, ["check", "b_type", "--set", "mass_t=33", "--set", "title=Other"])
    assert done.exit_code == 0, done.output


def test_the_page_that_answers_says_it_at_the_value():
    session = Session("b_type", B_TYPE, {FRICTION: 0.01, "simulation.time_limit_s": 0.02}, str)
    answer = session.answer({"collision.rail_friction": 0.02}, "collision.rail_friction")
    assert f'{{"wrong": {{"collision.rail_friction": "collision.rail_friction: {WITHOUT}' in answer
    assert session.answer({FRICTION: 0.02}, FRICTION).startswith('{"shown"')
    with pytest.raises(trainmj.InputError, match=WITHOUT):
        Session("b_type", B_TYPE, dict.fromkeys(BOTH, 0.01), str)


def test_a_plan_of_many_cases_takes_no_longer_for_it(monkeypatch):
    """The check is of the plan: a few chains for each name, however many cases there are."""
    lined_up: list[Scenario] = []
    from trainmj.cases import effect

    one = effect.line_up
    monkeypatch.setattr(effect, "line_up", lambda scenario: lined_up.append(scenario) or one(scenario))
    trainmj.sweep_of(
        {
            "scenario": "b_type",
            "together": {"mass_t": np.linspace(30, 36, 50_000).tolist()},
            "vary": {"speed_km_h": [20, 25]},
        }
    )
    assert len(lined_up) == 4
