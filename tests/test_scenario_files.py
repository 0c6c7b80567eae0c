"""Scenario files: what loads, what is refused, and in which words."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from builders import values
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from pydantic import BaseModel
from ruamel.yaml import YAML

import trainmj
from trainmj.collision.lineup import line_up
from trainmj.collision.stability import largest_step
from trainmj.errors import InputError, OutputError, TrainmjError
from trainmj.files.yaml import as_yaml, parse, read_value
from trainmj.identification.file import TargetsFile
from trainmj.scenario import Scenario, from_yaml, load, save, schema, shipped, to_yaml
from trainmj.scenario.parts import Parts
from trainmj.study.file import StudyFile
from trainmj.sweep.file import SweepFile
from trainmj.units import unit_of

GOOD = """\
title: A small case
parameters: {mass_t: trains.t.mass_t, both: [trains.t.mass_t, trains.t.length_m]}
curves:
  tube: {stroke_mm: [0, 10, 500], force_kN: [0, 900, 900]}
devices:
  head: {curve: tube, stiffness_kN_per_mm: 100, stroke_limit_mm: 400}
  link: {curve: [tube, {stroke_mm: [501, 600], force_kN: [1200, 1200]}], stiffness_kN_per_mm: 100}
trains:
  t: {vehicles: 3, mass_t: 33, front: head, rear: head, coupler: link}
collision: {train: t, speed_km_h: 20, partner: t}
"""


def written(folder: Path, text: str, name: str = "my.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def shape(scenario: Scenario) -> Any:
    """What a scenario simulates, in numbers that can be compared."""
    c = line_up(scenario)
    return (
        c.vehicles,
        [
            (i.name, d.name, d.stages, d.lines, [curve.tolist() for curve in d.law.curves], d.law.parameters, d.law.end)
            for i in c.interfaces
            for d in i.devices
        ],
        (c.n_moving, c.gap, c.grade, c.step, c.steps_per_record, c.time_limit, c.integrator),
    )


# what loads


@pytest.mark.parametrize("name", sorted(shipped()))
def test_shipped_scenarios_survive_a_round_trip_and_can_be_simulated(name, tmp_path):
    scenario = load(name)
    assert shape(from_yaml(to_yaml(scenario))) == shape(scenario), "to_yaml must state all of it, curves too"
    save(scenario, tmp_path / "copy.yaml")
    assert shape(load(tmp_path / "copy.yaml")) == shape(scenario)
    line_up(scenario)
    assert scenario.title
    for parameter in scenario.parameters:
        value = 1.05 * (scenario.locate(parameter)[0] or 20)
        assert shape(scenario.with_values({parameter: value})) != shape(scenario), f"{parameter} changes nothing"


def test_the_scenarios_of_the_package_are_there():
    assert set(shipped()) >= {
        "b_type", "b_type_s08", "b_type_scenario_1", "b_type_scenario_2", "b_type_wall", "wagon_80t", "en15227_c1",
        "fra_cem_single", "fra_cem_two", "fra_cem_train", "fra_conventional_single", "fra_conventional_train",
    }  # fmt: skip


def test_a_file_may_have_a_byte_order_mark(tmp_path):
    """Editors on Windows write one."""
    path = tmp_path / "bom.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.encode())
    assert shape(load(path)) == shape(from_yaml(GOOD))


def test_a_file_may_have_windows_line_ends(tmp_path):
    path = tmp_path / "crlf.yaml"
    path.write_bytes(GOOD.replace("\n", "\r\n").encode())
    assert shape(load(path)) == shape(from_yaml(GOOD))


def test_builds_on_a_file_beside_it_and_changes_a_few_values(tmp_path):
    written(tmp_path, GOOD, "base.yaml")
    path = written(
        tmp_path,
        """\
        builds_on: base.yaml
        trains: {t: {mass_t: 40}}
        curves: {tube: {stroke_mm: [0, 450], force_kN: [700, 700]}}
        collision: {gap_mm: 12}
        """,
    )
    changed, base = load(path), load(tmp_path / "base.yaml")
    assert changed.trains["t"].mass_t == 40
    assert changed.trains["t"].vehicles == base.trains["t"].vehicles
    assert changed.collision.speed_km_h == 20
    assert changed.collision.gap_mm == 12
    assert changed.curves["tube"].stroke_mm == [0, 450], "a curve is replaced as a whole, never mixed with the old one"


def test_builds_on_a_shipped_scenario_and_through_several_files(tmp_path):
    written(tmp_path, "builds_on: b_type_wall\ncollision: {speed_km_h: 10}\n", "one.yaml")
    path = written(tmp_path, "builds_on: one.yaml\ntrains: {b_type: {mass_t: 31}}\n", "two.yaml")
    scenario = load(path)
    assert (scenario.collision.speed_km_h, scenario.collision.partner) == (10, "rigid_wall")
    assert scenario.trains["b_type"].mass_t == 31


CURVE = [(0.0, 0.0), (10.5, 900.0), (500.0, 901.25)]


@pytest.mark.parametrize(
    "text",
    [
        "stroke_mm,force_kN\n0,0\n10.5,900\n500,901.25\n",
        "stroke_mm;force_kN\n0;0\n10,5;900\n500;901,25\n",
        "force_kN\tstroke_mm\tremark\n0\t0\t\n900\t10.5\tyield\n901.25\t500\tend\n",
        "# measured in May\n\nstroke_mm, force_kN\n0, 0\n# yield\n10.5, 9e2\n500, 901.25\n\n",
        '"stroke_mm","force_kN"\r\n0,0\r\n10.5,900\r\n500,901.25\r\n',
        "\ufeffstroke_mm,force_kN\n0,0\n10.5,900\n500,901.25\n",
    ],
    ids=["commas", "semicolons and decimal commas", "tabs, other columns", "comments", "quotes, CRLF", "BOM"],
)
def test_curves_from_csv_files(tmp_path, text):
    (tmp_path / "tube.csv").write_text(text, encoding="utf-8", newline="")
    path = written(tmp_path, GOOD.replace("{stroke_mm: [0, 10, 500], force_kN: [0, 900, 900]}", "{file: tube.csv}"))
    scenario = load(path)
    curve = scenario.curves["tube"]
    assert list(zip(curve.stroke_mm, curve.force_kN, strict=True)) == CURVE
    assert shape(from_yaml(to_yaml(scenario))) == shape(scenario), "a written scenario needs no CSV file beside it"


# what a scenario becomes


def test_a_device_of_stages_is_laid_end_to_end():
    v = values([(0, 0), (10, 900), (100, 900)], 100)
    v["devices"]["d"] = {
        "stiffness_kN_per_mm": 100.0,
        "stages": {
            "coupler": {
                "empty_stroke_mm": 5.0,
                "curve": {"stroke_mm": [0.0, 100.0], "force_kN": [800.0, 800.0]},
                "shear_off": {"force_kN": 900.0, "ramp_mm": 1.0},
            },
            "climber": {
                "empty_stroke_mm": 20.0,
                "curve": {"stroke_mm": [0.0, 300.0], "force_kN": [1200.0, 1250.0]},
                "stroke_limit_mm": 250.0,
            },
        },
    }
    (interface,) = line_up(Scenario.from_values(v)).interfaces
    device = interface.devices[0]
    assert [(s.name, s.start, s.end, s.limit) for s in device.stages] == [
        ("coupler", pytest.approx(0.005), pytest.approx(0.105), np.inf),
        ("climber", pytest.approx(0.125), np.inf, pytest.approx(0.250)),
    ]
    e = device.envelope
    probe = {0.002: 0, 0.006: 800e3, 0.1049: 800e3, 0.106: 900e3, 0.1071: 0, 0.12: 0, 0.1251: 1200e3, 0.4: 1245.83e3}
    for stroke, force in probe.items():
        assert e.force_at(stroke) == pytest.approx(force, rel=1e-3, abs=1.0), f"at {stroke * 1e3} mm"


def test_partner_may_be_struck_at_its_rear():
    v = values([(0, 0), (10, 900), (100, 900)], 100, mass_t=[30.0, 31.0, 32.0], partner="t")
    front = line_up(Scenario.from_values(v))
    rear = line_up(Scenario.from_values(v | {"collision": v["collision"] | {"partner_end": "rear"}}))
    assert (front.mass / 1e3).tolist() == [32, 31, 30, 30, 31, 32]
    assert (rear.mass / 1e3).tolist() == [32, 31, 30, 32, 31, 30]
    assert [x.name for x in rear.vehicles] == ["M3", "M2", "M1", "S1", "S2", "S3"]


def test_couplers_stay_with_their_joint_when_the_partner_is_turned():
    v = values([(0, 0), (10, 900), (100, 900)], 100, mass_t=[30.0, 31.0, 32.0], partner="t")
    v["devices"]["soft"] = v["devices"]["d"] | {"stiffness_kN_per_mm": 50.0}
    v["trains"]["t"]["vehicles"][0]["coupler"] = "soft"  # between the first and the second vehicle
    v["collision"]["partner_end"] = "rear"
    by_name = {i.name: i.devices[0].name for i in line_up(Scenario.from_values(v)).interfaces}
    assert by_name == {"M2-M3": "d", "M1-M2": "soft", "S1-M1": "d", "S1-S2": "d", "S2-S3": "soft"}


def backwards(train: dict[str, Any]) -> dict[str, Any]:
    """A train with its vehicles listed from the other end, and all that has a direction turned."""

    def turned(part: dict[str, Any]) -> dict[str, Any]:
        body = part.get("body", {})
        return part | ({"body": body | {"attached_m": body["attached_m"][::-1]}} if "attached_m" in body else {})

    couplers = [car.get("coupler") for car in train["vehicles"][-2::-1]]
    couplers = [coupler[::-1] if isinstance(coupler, list) else coupler for coupler in couplers]
    bare = [{key: value for key, value in car.items() if key != "coupler"} for car in train["vehicles"][::-1]]
    cars = [turned(car | ({"coupler": c} if c else {})) for car, c in zip(bare, [*couplers, None], strict=True)]
    coupler = train["coupler"][::-1] if isinstance(train["coupler"], list) else train["coupler"]
    ends = {"front": train["rear"], "rear": train["front"]}
    return turned(train) | ends | {"vehicles": cars, "coupler": coupler}


@pytest.mark.parametrize("partner", ["other", "t", "rigid_wall"])
def test_a_train_led_by_its_rear_is_the_train_listed_backwards(partner):
    """Breaks if vehicles, couplers of two, bodies or end devices are not turned together, on either side."""
    v = values([(0, 0), (10, 900), (100, 900)], 100, mass_t=[30.0, 31.0, 32.0], partner="t")
    v["devices"] |= {name: v["devices"]["d"] | {"stiffness_kN_per_mm": k} for name, k in (("p", 50.0), ("q", 70.0))}
    v["devices"]["tail"] = v["devices"]["p"] | {"empty_stroke_mm": 20}
    train = v["trains"]["t"]
    train |= {"rear": "tail", "coupler": ["p", "q"], "body": {"stiffness_kN_per_mm": 800, "attached_m": [1, 7]}}
    train["vehicles"][0]["coupler"] = "q"
    train["vehicles"][1]["body"] = {"stiffness_kN_per_mm": 900, "attached_m": [0, 11]}
    v["trains"]["other"] = copy.deepcopy(train)
    v["simulation"] = v.get("simulation", {}) | {"step_ms": 0.02, "time_limit_s": 0.2}
    v["collision"] |= {"train_end": "rear", "partner": partner}
    if partner == "t":
        v["collision"]["partner_end"] = "rear"
    led = Scenario.from_values(v)
    v["trains"]["t"] = backwards(train)
    v["collision"] |= {"train_end": "front", "partner_end": "front"}
    listed = Scenario.from_values(v)
    a, b = trainmj.run(led), trainmj.run(listed)
    assert a.position.tobytes() == b.position.tobytes()
    assert a.force.tobytes() == b.force.tobytes()
    assert trainmj.summarise(a).row() == trainmj.summarise(b).row()
    said = "t (3 vehicles, 93 t), led by its rear, at"
    assert said in led.subject
    assert "led by" not in listed.subject
    assert trainmj.run(led.with_values({"collision.train_end": None})).position.tobytes() != a.position.tobytes()


ENDS = """\
devices:
  p: {curve: {stroke_mm: [0, 10, 300], force_kN: [0, 500, 900]}, stiffness_kN_per_mm: 100}
  q: {curve: {stroke_mm: [0, 30, 300], force_kN: [0, 700, 900]}, stiffness_kN_per_mm: 90, stroke_limit_mm: 40}
  h: {curve: {stroke_mm: [0, 10, 900], force_kN: [0, 1000, 1200]}, stiffness_kN_per_mm: 100}
trains:
  t: {mass_t: 40, front: h, ends: p, vehicles: [{name: A, rear: q}, {name: B, coupler: q}, {name: C}, {name: D}]}
collision: {train: t, speed_km_h: 15, partner: rigid_wall}
simulation: {step_ms: 0.02, time_limit_s: 0.4}
"""


def test_what_a_vehicle_states_at_its_ends_beats_what_the_train_states_for_all():
    """Breaks if an end has another device, or two at the ends are not the two of a coupler to the last bit."""
    ends = from_yaml(ENDS)
    assert ends.trains["t"].joints() == [("h",), ("q", "p"), ("q",), ("p", "p")]
    assert ends.with_values({"trains.t.rear": "h"}).trains["t"].joints("rear") == [
        ("h",),
        ("p", "p"),
        ("q",),
        ("p", "q"),
    ]
    two = from_yaml(ENDS.replace("ends: p", "coupler: [p, p]").replace("rear: q", "coupler: [q, p]"))
    a, b = trainmj.run(ends), trainmj.run(two)
    assert a.position.tobytes() == b.position.tobytes()
    row = trainmj.summarise(a).row()
    assert row == trainmj.summarise(b).row()
    assert {"stroke_M1_M2_M1_mm", "stroke_M1_M2_M2_mm", "stroke_M2_M3_mm", "energy_M3_M4_M4_kJ"} <= set(row)
    last = from_yaml(ENDS.replace("name: A,", "name: A, front: h,").replace("front: h, ends", "ends"))
    assert trainmj.run(last).position.tobytes() == a.position.tobytes(), "the first vehicle may state its front itself"


def test_ends_are_judged_each_by_its_own_limit():
    """Breaks if a limit of an end is judged at the other one, or one for all interfaces leaves an end out."""
    ends = from_yaml(ENDS).with_values({"limits": {"stroke_mm": 500, "stroke_M1_M2_M1_mm": 60}})
    summary = trainmj.summarise(trainmj.run(ends))
    strokes = {i.name: i.stroke_mm for i in summary.interfaces}
    one, two, own = summary.limits
    assert (one.where, one.found) == max(strokes.items(), key=lambda item: item[1])
    assert two.found == strokes["M1-M2 M1"]
    assert (own.where, own.limit) == ("M1-M2 M1" if strokes["M1-M2 M1"] > strokes["M2-M3"] else "M2-M3", 40)
    with pytest.raises(InputError, match=r"stroke_M1_M2_mm = 60: there is no .* did you mean 'stroke_M1_M2_M\d_mm'"):
        line_up(ends.with_values({"limits": {"stroke_M1_M2_mm": 60}}))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("ends: p,", "ends: x,", r"trains\.t\.ends = 'x': there is no device"),
        ("rear: q", "rear: x", r"vehicles\.0\.rear = 'x': there is no device"),
        ("ends: p,", "ends: p, coupler: p,", r"ends = 'p': does not go with coupler, .* leave one of them out"),
        ("name: A,", "name: A, coupler: p,", r"vehicles\.0\.coupler = 'p': does not go with rear"),
        ("name: C", "name: C, front: p", r"vehicles\.1\.coupler = 'q': does not go with front of the next vehicle, C"),
        ("ends: p,", "coupler: p,", r"vehicles\.0\.rear = 'q': needs a device at the front of the next vehicle, B"),
        ("ends: p, vehicles: [{name: A, rear: q}, {name: B,", "coupler: p, vehicles: [{name: A}, {name: B, front: q,",
         r"vehicles\.1\.front = 'q': needs a device at the rear of the vehicle before, A"),
        ("ends: p,", "", r"vehicles\.2: has no coupler to the next vehicle and no devices at the ends there"),
        ("name: A,", "name: A, front: p,", r"vehicles\.0\.front = 'p': is at the front of the train, which states"),
        ("name: D", "name: D, rear: p", ""),
        ("front: h, ends", "ends", r"trains\.t: states no device at its front, .*: add front"),
    ],
)  # fmt: skip
def test_what_is_between_two_vehicles_is_stated_once_and_whole(old, new, said):
    """Breaks if half of an interface is taken from somewhere else, or one of two statements silently wins."""
    text = ENDS.replace(old, new)
    assert text != ENDS
    if not said:
        from_yaml(text)
        return
    with pytest.raises(InputError, match=said):
        from_yaml(text)


POWERS = {"mm": 1, "m": 1, "t": 3, "kN": 2, "kN/mm": 1, "kN s/m": 2, "s": 1, "ms": 1}
"""The power of the scale by which values of a unit go in a model at the same speeds."""


def model_of(part: Any, scale: float, key: str = "") -> Any:
    """The values of a scenario at a scale; friction has the same part in it if its coefficient is larger by that."""
    if isinstance(part, dict):
        return {name: model_of(value, scale, name) for name, value in part.items()}
    if isinstance(part, list):
        return [model_of(value, scale, key) for value in part]
    power = -1 if key == "rail_friction" else POWERS.get(unit_of(key), 0)
    return part * scale**power if power else part


@pytest.mark.parametrize(("name", "worst"), [("b_type", 0.0), ("en15227_c1", 0.0), ("wagon_80t", 3e-6)])
def test_a_model_of_an_eighth_of_the_size_collides_as_the_trains_do(name, worst):
    """Breaks if a threshold of the core, or a bound of the scenario, holds for full-size trains only.

    Two different devices in series are brought to forces equal within 0.01 N, whatever these are.
    """
    values = load(name).values()
    for device in values["devices"].values():
        if device.get("beyond") == "car_body":
            device["beyond"] = {"kind": "car_body", "collapse_force_kN": 2000}
        for stage in device.get("stages", {}).values():
            if "shear_off" in stage:
                stage["shear_off"] = {"ramp_mm": 0.25} | stage["shear_off"]
    values = {key: values[key] for key in ("devices", "trains", "curves", "collision", "simulation") if key in values}
    values["simulation"] = {"step_ms": 0.1, "record_every_ms": 1, "time_limit_s": 3} | values.get("simulation", {})
    whole, model = (trainmj.run(Scenario.from_values(model_of(values, scale))) for scale in (1.0, 0.125))
    pairs = (
        (model.position * 8, whole.position),
        (model.velocity, whole.velocity),
        (model.stroke * 8, whole.stroke),
        (model.force * 64, whole.force),
        (model.tally.device_peak / 8, whole.tally.device_peak),
        (model.tally.stroke_max * 8, whole.tally.stroke_max),
    )
    assert max(np.abs(a - b).max() / np.abs(b).max() for a, b in pairs) <= worst


@pytest.mark.parametrize(
    ("mass_t", "force_kN", "stroke_mm", "said"),
    [
        (0.1, 2.9, 40.0, ""),
        (0.1, 0.0029, 40.0, r"has 0\.0029 kN at most, less than 0\.112 kN, for a lighter side of 0\.1 t: .* in MN"),
        (0.1, 2.9, 0.04, r"has 0\.04 mm of stroke in all, less than 0\.747 mm, for .* if strokes are in m"),
        (33, 0.9, 400.0, r"has 0\.9 kN at most, less than 5 kN: multiply by 1000 if forces are in MN"),
        (33, 900, 0.4, r"has 0\.4 mm of stroke in all, less than 5 mm: multiply"),
        (0.001, 0.3, 2.0, ""),
        (0.0009, 0.3, 2.0, r"mass_t = 0\.0009: must be at least 0\.001"),
    ],
)
def test_wrong_units_are_told_by_the_size_of_what_collides(mass_t, force_kN, stroke_mm, said):
    """Breaks if a model is refused, or a device in MN or m passes, at either size."""
    v = values([(0, 0), (stroke_mm / 10, force_kN), (stroke_mm, force_kN)], 1, mass_t=[mass_t], partner="rigid_wall")
    if not said:
        Scenario.from_values(v)
        return
    with pytest.raises(InputError, match=said):
        Scenario.from_values(v)


# changes


@pytest.fixture(scope="module")
def good() -> Scenario:
    return from_yaml(GOOD, "good.yaml")


def test_changes_by_path_and_by_parameter(good):
    changed = good.with_values({"mass_t": 40, "collision.gap_mm": 50, "devices.head.stroke_limit_mm": 450})
    assert changed.trains["t"].mass_t == 40
    assert changed.collision.gap_mm == 50
    assert changed.devices["head"].stroke_limit_mm == 450
    assert good.trains["t"].mass_t == 33, "a change makes a copy"
    assert good.with_values({"both": 25}).trains["t"].length_m == 25, "a parameter may move several values"


def test_changes_reach_into_lists_by_position_and_by_name(good):
    standard = load("b_type")
    by_position = standard.with_values({"trains.b_type.vehicles.0.mass_t": 40})
    others = [c.mass_t for c in standard.trains["b_type"].cars()][1:]
    assert [c.mass_t for c in by_position.trains["b_type"].cars()] == [40, *others]
    named = good.with_values({"trains.t.vehicles": [{"name": "A"}, {"name": "B"}]})
    assert [c.mass_t for c in named.with_values({"trains.t.vehicles.B.mass_t": 40}).trains["t"].cars()] == [33, 40]
    forces = standard.curves["buffer"].force_kN
    last = len(forces) - 1
    point = standard.with_values({f"curves.buffer.force_kN.{last}": 810})
    assert point.curves["buffer"].force_kN == [*forces[:-1], 810]


def test_a_section_that_the_file_leaves_out_can_be_changed(good):
    assert good.with_values({"simulation.step_ms": 0.05}).simulation.step_ms == 0.05


def test_changes_come_one_upon_the_other(good):
    assert good.with_values({"mass_t": 40}).with_values({"collision.gap_mm": 5}).trains["t"].mass_t == 40


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mas_t": 33}, r"mas_t.*did you mean 'mass_t'"),
        ({"trains.x.mass_t": 33}, r"no 'x' in trains.*known: t"),
        ({"trains.t.mas_t": 33}, r"trains\.t\.mas_t = 33: unknown key; did you mean 'mass_t'"),
        ({"trains.t.body.members": 3}, r"no 'body' in trains\.t: state it as a whole, trains\.t\.body=\{\.\.\.\}"),
        ({"trains.t.mass_t.x": 33}, r"trains\.t\.mass_t is a single value"),
        ({"mass_t": -5}, r"mass_t=-5.*must be at least 0.001"),
        ({"mass_t": "heavy"}, r"'heavy'.*must be a number"),
        ({"curves.tube.stroke_mm.9": 1}, r"no entry '9'.*has 3"),
        ({"": 1}, r"there is no ''"),
        ({"collision.partner": "tt"}, r"no train, obstacle or partner file of this name.*did you mean 't'"),
    ],
)
def test_changes_that_lead_nowhere_are_refused(good, changes, said):
    with pytest.raises(InputError, match=said):
        good.with_values(changes)


@pytest.mark.parametrize(
    ("names", "path", "said"),
    [
        (
            "ABA",
            "A",
            r"2 entries are called 'A': say which by its position, trains\.t\.vehicles\.0 or trains\.t\.vehicles\.2",
        ),
        ("AAA", "A", r"3 entries .* trains\.t\.vehicles\.0, trains\.t\.vehicles\.1 or trains\.t\.vehicles\.2"),
        ("10", "0", r"'0' is both a position in trains\.t\.vehicles and the name of another entry"),
    ],
)
def test_a_name_that_several_vehicles_have_is_refused_wherever_a_path_is_resolved(good, tmp_path, names, path, said):
    """Breaks if a change, a case or a parameter moves one of two vehicles of a name, and nobody says which."""
    several = good.with_values({"trains.t.vehicles": [{"name": name} for name in names]})
    path = f"trains.t.vehicles.{path}.mass_t"
    save(several, tmp_path / "base.yaml")
    parameter = written(tmp_path, f"builds_on: base.yaml\nparameters: {{m: {path}}}\n")
    for use in (
        lambda: several.with_values({path: 40}),
        lambda: several.locate(path),
        lambda: load(parameter),
        lambda: trainmj.grid_of(several, {path: [30, 33]}),
        lambda: trainmj.run_cases(several, {path: [30, 33]}),
        lambda: trainmj.sweep_of({"scenario": "base.yaml", "together": {path: [30, 33]}}, tmp_path),
    ):
        with pytest.raises(InputError, match=said):
            use()


def test_null_takes_a_value_back(good, tmp_path):
    """Breaks if a file or a change cannot go back to a default, or takes back what is not there in silence."""
    assert good.with_values({"devices.head.stroke_limit_mm": None}).devices["head"].stroke_limit_mm is None
    with_gap = good.with_values({"collision.gap_mm": 5, "limits.TS_mm": 900})
    back = with_gap.with_values({"collision.gap_mm": None, "limits.TS_mm": None})
    changed = ["collision.gap_mm", "limits.TS_mm"]
    assert back.values() == {**good.values(), "limits": {}, "changed": changed}
    assert good.with_values({"collision.gap_mm": None}).collision.gap_mm == 0, "stated or not, the default applies"
    save(with_gap, tmp_path / "base.yaml")
    over = "builds_on: base.yaml\n"
    taken = load(
        written(tmp_path, over + "collision: {gap_mm: ~}\nlimits: null\ndevices: {head: {stroke_limit_mm: }}\n")
    )
    assert (taken.collision.gap_mm, taken.limits, taken.devices["head"].stroke_limit_mm) == (0, {}, None)
    written(tmp_path, over + "limits: {TS_mm: null}\n", "middle.yaml")
    again = written(tmp_path, "builds_on: middle.yaml\nlimits: {TAMA_g: 5}\n")
    assert load(again).limits == {"TAMA_g": 5}
    for text, said in (
        ("collision: {speed_km_h: null}", r"my\.yaml:2:13: collision\.speed_km_h: is missing"),
        ("collision: {gap: null}", r"my\.yaml:2:13: collision\.gap = None: unknown key; did you mean 'gap_mm'"),
        ("limits: {TSS_mm: null}", r"my\.yaml:2:10: .*null takes back what is stated there, and nothing is"),
        ("devices: {head: {curve: null}}", r"my\.yaml.*devices\.head: needs curve or stages"),
    ):
        with pytest.raises(InputError, match=said):
            load(written(tmp_path, over + text + "\n"))


def test_a_title_is_never_alone_over_what_was_changed_since(good, tmp_path):
    """A run headed "25 km/h" that was computed with 10 km/h lies."""
    save(good.with_values({"title": "Two cars, 25 km/h"}), tmp_path / "base.yaml")
    slow = load(tmp_path / "base.yaml", {"collision.speed_km_h": 10.5})
    assert slow.heading == "Two cars, 25 km/h; changed: collision.speed_km_h = 10.5"
    assert " at 10.5 km/h into " in slow.subject
    assert from_yaml(to_yaml(slow)).heading == slow.heading, "and says so in its own file"
    assert slow.with_values({"title": "Slow"}).heading == "Slow", "a title that is written after the change knows of it"
    assert (
        load(tmp_path / "base.yaml", {"collision.speed_km_h": good.collision.speed_km_h}).heading == "Two cars, 25 km/h"
    )
    over = written(tmp_path, "builds_on: base.yaml\ncollision: {speed_km_h: 11}\nnotes: mine\n")
    assert load(over).heading == "Two cars, 25 km/h; changed: collision.speed_km_h = 11"
    own = written(tmp_path, "builds_on: base.yaml\ntitle: Mine\ncollision: {speed_km_h: 11}\n")
    assert load(own).heading == "Mine"


def test_changed_values_that_somebody_wrote_by_hand_are_checked_and_bounded(good, tmp_path):
    """Names that lead nowhere, or are no names, must not take a command down or fill its pages."""
    save(good.with_values({"title": "T"}), tmp_path / "base.yaml")
    for text, said in (("5", "must be a list"), ("[5, {a: 1}, [x]]", r"changed\.1: must be text")):
        with pytest.raises(InputError, match=said):
            load(written(tmp_path, f"builds_on: base.yaml\nchanged: {text}\n"))
    odd = load(written(tmp_path, f"builds_on: base.yaml\ncollision: {{gap_mm: 3}}\nchanged: [{'z' * 900}, no.where]\n"))
    assert odd.heading == f"T; changed: collision.gap_mm = 3, no.where, {'z' * 117}..."


def test_stages_over_a_curve_replace_what_does_not_go_with_them(tmp_path):
    """Breaks if the keys of the device below make the stated stages wrong, or go, or stay, without a word."""
    written(
        tmp_path, GOOD.replace("{curve: tube,", "{curve: tube, damping_kN_s_per_m: 7, empty_stroke_mm: 5,"), "base.yaml"
    )
    stages = "devices: {head: {stages: {a: {curve: tube}, b: {curve: tube, empty_stroke_mm: 9}}}}\n"
    path = written(tmp_path, "builds_on: base.yaml\n" + stages, "staged.yaml")
    staged = load(path)
    assert list(staged.devices["head"].all_stages()) == ["a", "b"]
    assert staged.devices["head"].stiffness_kN_per_mm == 100
    assert staged.devices["head"].damping_kN_s_per_m == 7, "a dashpot goes with stages as well"
    (note,) = staged.told
    gone = f"devices.head: curve, empty_stroke_mm, stroke_limit_mm of {tmp_path / 'base.yaml'} given up"
    assert note == f"{path}:2:11: {gone}"
    back = load(written(tmp_path, "builds_on: staged.yaml\ndevices: {head: {curve: tube}}\n"))
    assert list(back.devices["head"].all_stages()) == ["device"]
    assert back.told == (note, f"{tmp_path / 'my.yaml'}:2:11: devices.head: stages of {path} given up")
    with pytest.raises(InputError, match="stages: does not go with curve: leave one of them out"):
        load(written(tmp_path, "builds_on: base.yaml\n" + stages.replace("{stages", "{curve: tube, stages")))


def test_numbers_of_numpy_are_numbers(good):
    """Breaks if a scenario with a value from numpy's linspace or arange can be run, but not saved."""
    changes = {
        "mass_t": np.float64(40),
        "trains.t.length_m": np.int64(20),
        "curves.tube.force_kN": np.array([10.0, 20, 30]),
        "curves.tube.stroke_mm": (0, 10, 500),
    }
    changed = good.with_values(changes)
    assert shape(from_yaml(to_yaml(changed))) == shape(changed)


# where a wrong value stands


REPLACED = [
    ("devices: {d: {curve: {file: c.csv}}}", {}, "DIR/c.csv:4: point 3", "d.curve.stroke_mm.2 = 50.0: must be more"),
    ("curves: {t: {file: c.csv}}", {}, "DIR/c.csv:4: point 3", "curves.t.stroke_mm.2 = 50.0: must be more"),
    (
        "curves: {t: {file: late.csv}}",
        {},
        "DIR/late.csv:2: point 1",
        "curves.t.stroke_mm.0 = 1.0: the curve of devices.e",
    ),
    (
        "devices: {d: {curve: {stroke_mm: [0, 9, 5], force_kN: [0, 1, 1]}}}",
        {},
        "DIR/s.yaml:2:41",
        "devices.d.curve.stroke_mm.2 = 5: must be more",
    ),
    (
        "trains: {t: {vehicles: [{name: A}, {name: B, mass_t: 999}]}}",
        {},
        "DIR/s.yaml:2:46",
        "trains.t.vehicles.1.mass_t = 999: must be at most",
    ),
    (
        "title: x",
        {"devices.d.curve.stroke_mm": [0, 900, 40]},
        "change devices.d.curve.stroke_mm=[0, 900, 40]",
        "devices.d.curve.stroke_mm.2 = 40: must be more than the 900 mm",
    ),
    (
        "title: x",
        {"devices.d.curve.stroke_mm": [0, 900]},
        "DIR/base.yaml:5:5 with change devices.d.curve.stroke_mm=[0, 900]",
        "devices.d.curve: needs as many strokes as forces",
    ),
    (
        "title: x",
        {"devices.d": {"curve": "t", "stiffness_kN_per_mm": -1}},
        "change devices.d={'curve': 't', 'stiffness_kN_per_mm': -1}",
        "devices.d.stiffness_kN_per_mm = -1: must be at least",
    ),
    (
        "title: x",
        {"trains.t.mass_t": None},
        "DIR/base.yaml:9:3 with change trains.t.mass_t=null",
        "trains.t: has no mass_t",
    ),
    ("title: x", {"mass": -1}, "change mass=-1", "trains.t.mass_t = -1: must be at least 0.001"),
    ("title: x", {"collision.gap_mm": -1}, "change", "collision.gap_mm = -1: must be at least 0"),
]


@pytest.mark.parametrize("levels", [1, 3])
@pytest.mark.parametrize(("over", "changes", "place", "words"), REPLACED)
def test_a_message_names_the_place_where_the_wrong_value_stands(tmp_path, over, changes, place, words, levels):
    """Breaks if a message leads to the line of a value that was replaced, which is right."""
    written(tmp_path, PLACED, "base.yaml")
    written(tmp_path, "stroke_mm,force_kN\n0,0\n50,800\n50,900\n", "c.csv")
    written(tmp_path, "stroke_mm,force_kN\n1,0\n50,800\n", "late.csv")
    base = "base"
    for n in range(1, levels):
        written(tmp_path, f"builds_on: {base}.yaml\ntitle: level {n}\n", f"level{n}.yaml")
        base = f"level{n}"
    file = written(tmp_path, f"builds_on: {base}.yaml\n{over}\n", "s.yaml")
    with pytest.raises(InputError) as caught:
        load(file, changes)
    at = place.replace("DIR", str(tmp_path))
    assert re.match(rf"{re.escape(at)}: \S*{re.escape(words)}", str(caught.value)), caught.value


PLACED = """\
parameters: {mass: trains.t.mass_t}
curves: {t: {stroke_mm: [0, 500], force_kN: [100, 100]}}
devices:
  d:
    curve: {stroke_mm: [0, 50, 1500], force_kN: [0, 800, 1200]}
    stiffness_kN_per_mm: 100
  e: {curve: t, stiffness_kN_per_mm: 100}
trains:
  t: {vehicles: 2, mass_t: 30, front: d, coupler: e}
collision: {train: t, speed_km_h: 15, partner: t}
"""


@pytest.mark.parametrize("key", ["set", "study"])
def test_a_change_of_another_file_is_placed_there(tmp_path, key):
    """Breaks if the line of the scenario is named for a value that a sweep or a study sets."""
    written(tmp_path, PLACED, "base.yaml")
    wrong = {"scenario": "base.yaml", "set": {"devices.d.curve.stroke_mm": [0, 900, 40]}}
    sweep = written(tmp_path, f"# a sweep\n{json.dumps(wrong | {'vary': {'mass': [30, 33]}})}\n", "s.sweep.yaml")
    study = {
        "factors": {"M": {"sets": "mass", "bounds": [30, 36]}},
        "responses": {"TS": "TS_mm"},
        "objectives": {"TS": "minimise"},
        "design": {"n": 5},
    }
    file = sweep if key == "set" else written(tmp_path, f"# a study\n{json.dumps(wrong | study)}\n", "s.study.yaml")
    read = trainmj.load_sweep if key == "set" else trainmj.load_study
    with pytest.raises(InputError, match=rf"^{re.escape(str(file))}:2:\d+: set.*stroke_mm\.2 = 40: must be more"):
        read(file)


# what is refused: a change of one line of GOOD, and what the message says


def said_of(old: str, new: str, *said: str) -> Any:
    assert old in GOOD
    return pytest.param(GOOD.replace(old, new), said, id=new[:40].strip())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        said_of("mass_t: 33", "mas_t: 33", r"trains\.t\.mas_t = 33: unknown key; did you mean 'mass_t'", ":9:"),
        said_of("mass_t: 33", "mass_t: -33", r"mass_t = -33: must be at least 0.001", ":9:"),
        said_of("mass_t: 33", "mass_t: 33000", r"mass_t = 33000: must be at most 200: masses are in t; divide by"),
        said_of("vehicles: 3", "vehicles: 3, length_m: 2e4", r"at most 60: lengths are in m; divide by 1000"),
        said_of("[0, 900, 900]", "[0, 9e5, 9e5]", r":4:.*force_kN\.1.*at most 50000: .* divide by 1000 if .* in N"),
        said_of("[0, 10, 500]", "[0, 10, 5e5]", r"at most 10000: strokes are in mm; no device is longer than 10 m"),
        said_of("[0, 10, 500]", "[0, 0.1, 0.5]", r"head: has 0\.5 mm of stroke in all.*: multiply by 1000 if"),
        said_of("[0, 900, 900]", "[0, 0.9, 0.9]", r"head: has 0\.9 kN at most, .*: multiply by 1000 if .* in MN"),
        said_of("collision:", "simulation: {time_limit_s: 1e-9}\ncollision:", r"must be at least record_every_ms \(1"),
        said_of("100, stroke", "100000, stroke", r"at most 50000: .* divide by 1000 if .* in N/mm"),
        said_of("100, stroke", "100, damping_kN_s_per_m: 2e5, stroke", r"at most 100000: .* if it is in N s/m"),
        said_of("collision:", "simulation: {time_limit_s: 3000}\ncollision:", r"at most 60: .* if it is in ms"),
        said_of("mass_t: 33", "mass_t: " + "9" * 400, r":9:\d+: trains\.t\.mass_t = .*: is too large: numbers go up"),
        said_of("mass_t: 33", "mass_t: heavy", r"mass_t = 'heavy': must be a number"),
        said_of("mass_t: 33", "mass_t: '33'", r"mass_t = '33': must be a number"),
        said_of("mass_t: 33", "mass_t: true", r"mass_t = True: must be a number"),
        said_of("mass_t: 33", "mass_t: .nan", r"mass_t = nan: must be a finite number"),
        said_of("mass_t: 33", "mass_t: .inf", r"mass_t = inf: must be a finite number"),
        said_of("mass_t: 33", "mass_t: [1, 2]", r"mass_t: must be a number"),
        said_of("mass_t: 33, ", "", r"trains\.t: has no mass_t"),
        said_of("coupler: link", "rear: head", r"(?i)duplicate|twice|key"),
        said_of(", coupler: link", "", r"trains\.t: has no coupler to the next vehicle"),
        said_of("vehicles: 3", "vehicles: 0", r"vehicles = 0: must be at least 1"),
        said_of("vehicles: 3", "vehicles: 2.5", r"vehicles = 2\.5: must be a whole number"),
        said_of("vehicles: 3", "vehicles: 201", r"more than 400 vehicles"),
        said_of("vehicles: 3", "vehicles: 401", r"vehicles = 401: must be at most 400"),
        said_of("vehicles: 3", "vehicles: [{mass_t: 3}]", r"vehicles\.0\.name: is missing"),
        said_of("[0, 10, 500]", "[0, 10, 9]", r"stroke_mm\.2 = 9: must be more than the 10 mm before it: strokes grow"),
        said_of("[0, 10, 500]", "[0, 10, 10]", r"stroke_mm\.2 = 10: must be more than the 10 mm before it"),
        said_of("[0, 10, 500]", "[0, 10]", r"as many strokes as forces; it has 2 and 3"),
        said_of("[0, 10, 500]", "[1, 10, 500]", r"must start at a stroke of 0, not 1 mm"),
        said_of("[0, 900, 900]", "[0, -900, 900]", r"force_kN\.1 = -900: must be at least 0"),
        said_of("[0, 900, 900]", "[0, .nan, 900]", r"force_kN\.1 = nan: must be a finite number"),
        said_of("[501, 600]", "[400, 600]", r"curve\.1: must begin at more than the 500 mm .* not at 400 mm: strokes"),
        said_of("[501, 600]", "[500, 600]", r"curve\.1: must begin at more than the 500 mm .* ends, not at 500 mm"),
        said_of("[501, 600]", "[499.9999, 600]", r"more than the 500 mm at which .* ends, not at 499\.9999 mm"),
        said_of("[501, 600]", "[500.0000005, 600]", r"ends by 0\.000001 mm or more, not at 500\.0000005 mm"),
        said_of("[0, 10, 500]", "[0, 73.2231234, 73.2231233]", r"= 73\.2231233: must be more than the 73\.2231234 mm"),
        said_of("curve: tube,", "curve: tub,", r"devices\.head\.curve = 'tub': there is no curve.*did you mean 'tube'"),
        said_of("front: head", "front: haed", r"trains\.t\.front = 'haed': there is no device.*did you mean 'head'"),
        said_of("partner: t", "partner: u", r"partner = 'u': there is no train, obstacle or partner"),
        said_of("train: t,", "train: u,", r"train = 'u': there is no train of this name"),
        said_of("partner: t", "partner: rigid_wal", r"did you mean 'rigid_wall'"),
        said_of("stroke_limit_mm: 400", "stroke_limit_mm: 501", r"must be within the curve, which ends at 500 mm"),
        said_of("stiffness_kN_per_mm: 100, stroke", "stiffness_kN_per_mm: 0, stroke", r"= 0: must be at least 1e-06"),
        said_of("stiffness_kN_per_mm: 100, ", "", r"devices\.head\.stiffness_kN_per_mm: is missing"),
        said_of("curve: tube, ", "", r"devices\.head: needs curve or stages"),
        said_of("{curve: tube", "{curv: tube", r"devices\.head\.curv = 'tube': unknown key; did you mean 'curve'"),
        said_of("{curve: tube", "{stages: {a: {curve: tube}}, curve: tube", r"stages: does not go with curve: leave"),
        said_of("{curve: tube", "{stages: {a: {curve: tube}}", r"stroke_limit_mm = 400: .* belongs in stages\.<name>"),
        said_of("{curve: tube", "{curve: 5", r"head\.curve = 5: must be the name of a curve, its points, or a list"),
        said_of("{curve: tube", "{curve: {stroke_mm: [0]}", r"devices\.head\.curve\.force_kN: is missing"),
        said_of("{curve: tube", "{curve: {}", r"head\.curve: needs stroke_mm and force_kN, or file"),
        said_of("{curve: tube", "{curve: {file: a, force_kN: [0]}", r"curve\.force_kN: does not go with file"),
        said_of("[tube, {", "[5, {", r"devices\.link\.curve\.0 = 5: must be the name of a curve, or its points"),
        said_of("title: A small case", "gap_mm: 5", r"gap_mm = 5: unknown key; it belongs in collision"),
        said_of("speed_km_h: 20", "speed_km_h: 0", r"speed_km_h = 0: must be more than partner_speed_km_h"),
        said_of("speed_km_h: 20", "speed_km_h: 20, partner_speed_km_h: 20", r"the two sides must approach each other"),
        said_of("speed_km_h: 20", "speed_km_h: 20, gap_mm: -1", r"gap_mm = -1: must be at least 0"),
        said_of("speed_km_h: 20", "speed_km_h: 20, rail_friction: 1.5", r"rail_friction = 1\.5: must be at most 1"),
        said_of("speed_km_h: 20", "speed_km_h: 20, partner_end: middle", r"partner_end = 'middle': must be 'front' or"),
        said_of("partner: t", "partner: rigid_wall, partner_speed_km_h: -5", r"the rigid wall does not move"),
        said_of("rear: head, ", "", r"ok"),
        said_of("front: head, ", "", r"states no device at its front"),
        said_of("rear: head, coupler: link}\ncollision: {", "coupler: link}\ncollision: {train_end: rear, ",
                r"trains\.t: states no device at its rear, the end that meets the other side: add rear"),
        said_of("title: A", "titel: A", r"titel = '.*': unknown key; did you mean 'title'"),
        said_of("title: A small case", "title: [1]", r"title: must be text"),
        said_of("collision:", "simulation: {integrator: RK4}\ncollision:", r"'RK4': must be 'euler'"),
        said_of("collision:", "simulation: {integrator: heun}\ncollision:", r"'heun': must be 'euler'"),
        said_of("collision:", "simulation: {record_every_ms: 0.25}\ncollision:", r"a whole multiple of step_ms"),
        said_of("collision:", "simulation: {step_ms: 0}\ncollision:", r"step_ms = 0: must be at least 0\.0001"),
        said_of(
            "collision:", "simulation: {step_ms: 0.0001, record_every_ms: 1, time_limit_s: 60}\ncollision:",
            r"takes more than 5000000 steps",
        ),
        said_of("  tube:", "  1tube:", r"curves\.1tube.*letters, digits and _"),
        said_of("title: A small case", "title: &a [*a]", r"must be|deep|valid"),
        said_of("title: A small case", "title: !!python/object:os.system x", r"."),
        said_of("mass_t: 33", "mass_t: 2026-11-22", r"mass_t = '2026-11-22': must be a number"),
        said_of("vehicles: 3", "vehicles: 1e2000", r"vehicles = 1e2000: is too large: numbers go up to 1e\+100"),
        said_of("parameters: {mass_t: trains.t.mass_t,", "parameters: {mass_t: trains.u.mass_t,",
                r":2:14: parameters\.mass_t = 'trains\.u\.mass_t': .*there is no 'u' in trains; known: t"),
        said_of("trains:", "trains: [", r":\d+:\d+: is not valid YAML"),
        said_of("trains:", "\ttrains:", r":\d+:\d+: is not valid YAML"),
        said_of("devices:", "Devices:", r"Devices: unknown key; did you mean 'devices'", r"devices: is missing"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_with_file_key_value_and_rule(tmp_path, text, said):
    path = written(tmp_path, text)
    if said == ("ok",):
        load(path)  # only the end that meets the other side needs a device
        return
    with pytest.raises(InputError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(str(path)), "a message must begin with the file it is about"
    for words in said:
        assert re.search(words, message), message


def test_every_mistake_of_a_file_is_said_at_once(tmp_path):
    text = GOOD.replace("mass_t: 33", "mass_t: -1").replace("speed_km_h: 20", "speed_kmh: 20")
    with pytest.raises(InputError) as caught:
        load(written(tmp_path, text))
    assert len(str(caught.value).splitlines()) == 3, "mass, the misspelt speed, and the speed that is missing"


def test_duplicate_keys_are_refused(tmp_path):
    """YAML readers that keep the last one silently run something else than was written."""
    with pytest.raises(InputError, match=r"my\.yaml:11:.*not valid YAML.*duplicate key"):
        load(written(tmp_path, GOOD + "collision: {train: t, speed_km_h: 1, partner: t}\n"))


def raw(folder: Path, content: bytes) -> Path:
    path = folder / "raw.yaml"
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "must be a group of keys and values"),
        (b"   \n# nothing\n", "must be a group of keys and values"),
        (b"- a\n- b\n", "must be a group of keys and values"),
        (b"just words", "must be a group of keys and values"),
        (b"\x89PNG\r\n\x1a\n\x00\xff\xfe", "is not UTF-8 text"),
        (GOOD.encode("utf-16"), "is not UTF-8 text"),
        (b"title: \x00\x01\n", "is not valid YAML"),
        (b"{" * 1000, "is not valid YAML|too deep"),
        (b"a: " + b"[" * 300 + b"]" * 300, "nested too deeply|not valid YAML|too deep"),
        (b"1: 2\n", "key 1 must be text"),
        (b"null: 2\n", "must be text"),
        (b"? [a, b]\n: 1\n", "must be text|not valid YAML"),
        (b"title: a\n" + b"#" * 5_100_000, "is larger than 5 MB"),
        (b"--- {a: 1}\n--- {b: 2}\n", "is not valid YAML"),
    ],
)
def test_files_that_are_no_scenarios_are_refused(tmp_path, content, said):
    path = raw(tmp_path, content)
    with pytest.raises(InputError, match=said) as caught:
        load(path)
    assert str(path) in str(caught.value)


def test_anchors_that_multiply_are_refused(tmp_path):
    """A file of a kilobyte that unfolds into thousands of millions of values."""
    lines = ["a: &a [x, x, x, x, x, x, x, x, x]"]
    for one, next_ in zip("abcdefgh", "bcdefghi", strict=True):
        lines.append(f"{next_}: &{next_} [{', '.join([f'*{one}'] * 9)}]")
    with pytest.raises(InputError, match="too many values"):
        load(written(tmp_path, "\n".join(lines)))


@pytest.mark.filterwarnings("error")
def test_an_anchor_may_be_used_again():
    text = GOOD.replace("vehicles: 3", "vehicles: &a 3").replace("speed_km_h: 20", "speed_km_h: &a 20, gap_mm: *a")
    assert from_yaml(text).collision.gap_mm == 20


def test_circles_of_builds_on_are_refused(tmp_path):
    written(tmp_path, "builds_on: b.yaml\n", "a.yaml")
    written(tmp_path, "builds_on: a.yaml\n", "b.yaml")
    with pytest.raises(InputError, match=r"leads back to this file"):
        load(tmp_path / "a.yaml")
    written(tmp_path, "builds_on: self.yaml\n", "self.yaml")
    with pytest.raises(InputError, match=r"leads back to this file"):
        load(tmp_path / "self.yaml")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("builds_on: b_typ\n", r"my\.yaml:1:1: builds_on = 'b_typ': there is no such file.*did you mean 'b_type'"),
        ("builds_on: 5\n", r"builds_on = 5: must be the name of a scenario file"),
        ("builds_on: [a]\n", r"builds_on: must be the name of a scenario file"),
    ],
)
def test_builds_on_something_else_is_refused(tmp_path, line, said):
    with pytest.raises(InputError, match=said):
        load(written(tmp_path, line))


def test_a_mistake_in_the_file_below_is_placed_there(tmp_path):
    written(tmp_path, GOOD.replace("mass_t: 33", "mass_t: -3"), "base.yaml")
    with pytest.raises(InputError, match=r"base\.yaml:9:\d+: trains\.t\.mass_t = -3"):
        load(written(tmp_path, "builds_on: base.yaml\ncollision: {gap_mm: 3}\n"))


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("other.csv", None, r"file = 'other\.csv': there is no such file beside it; did you mean 'tube\.csv'"),
        ("../tube.csv", None, r"must be in the folder of the file that names it"),
        ("/etc/passwd", None, r"must be in the folder of the file that names it"),
        ("tube.csv", "", r"is empty"),
        ("tube.csv", "stroke_deg,force_N\n0,0\n", r"has no column 'stroke_mm'; .* and is 'stroke_deg, force_kN'"),
        ("tube.csv", "stroke_mm,force_kN\n0,0\n10,many\n", r"line 3: row 2: force_kN = 'many': must be a number"),
        ("tube.csv", "stroke_mm,force_kN\n0,0\n10,\n", r"line 3: row 2: force_kN = '': must be a number"),
        ("tube.csv", "stroke_mm,force_kN\n0,0\n10,nan\n", r"row 2: force_kN = 'nan': must be a number"),
        ("tube.csv", "stroke_mm,force_kN\n0,0\n10,1_0\n", r"row 2: force_kN = '1_0': must be a number"),
        ("tube.csv", "stroke_mm,force_kN\n0,0\n10,9\n\n5,9\n", r"tube\.csv:5: .*\.2 = 5.* the 10 mm before it"),
        (
            "tube.csv",
            "stroke_mm,force_kN\n0,0\n50,8e5\n",
            r"tube\.csv:3: .* = 800000.0: .* kN; divide by 1000 if .* in N",
        ),
        (
            "tube.csv",
            "stroke_mm,force_kN\n0,0\n0.5,800\n",
            r"0.5 mm of stroke in all.*: multiply by 1000 if strokes are in m",
        ),
        ("tube.csv", "stroke_mm,force_kN\n" + "1,1\n" * 2001, r"has more than 2000 points"),
    ],
)
def test_curve_files_that_cannot_be_used_are_refused(tmp_path, name, text, said):
    (tmp_path / "tube.csv").write_text("stroke_mm,force_kN\n0,0\n9,9\n" if text is None else text)
    path = written(tmp_path, GOOD.replace("{stroke_mm: [0, 10, 500], force_kN: [0, 900, 900]}", f"{{file: {name}}}"))
    with pytest.raises(InputError, match=said):
        load(path)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("b_tpye", "did you mean 'b_type'"),
        ("nowhere.yaml", "there is no such file or shipped scenario"),
        (".", "is a folder"),
        ("a\0b", "not a usable file name|no such file"),
        ("x" * 5000, "not a usable file name|no such file"),
    ],
)
def test_names_that_lead_to_no_file_are_refused(name, said):
    with pytest.raises(InputError, match=said):
        load(name)


def test_saving_where_it_cannot_be_is_an_output_error(good, tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        save(good, tmp_path / "missing" / "a.yaml")


@settings(max_examples=75, deadline=None)
@given(st.text(max_size=200) | st.binary(max_size=200).map(lambda b: b.decode("latin-1")))
def test_no_text_ends_in_anything_but_trainmjs_own_error(text):
    """A typing mistake must never end in a traceback of a library."""
    with pytest.raises(TrainmjError):
        from_yaml(text)


PATHS = [
    "mass_t",
    "trains.t.vehicles",
    "devices.head.curve",
    "collision",
    "curves.tube.force_kN",
    "parameters",
    "title",
]
anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(PATHS), anything)
def test_no_value_ends_in_anything_but_a_scenario_or_trainmjs_own_error(good, path, value):
    try:
        changed = good.with_values({path: value})
    except InputError:
        return
    line_up(changed)


# YAML means one thing


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("040", 40), ("-040", -40), ("0o17", 15), ("0x1F", 31), ("+12", 12),
        (".5", 0.5), ("-.5", -0.5), ("5.", 5.0), ("1e3", 1000.0), ("1.0e+3", 1000.0), ("1E-2", 0.01),
        (".inf", float("inf")), ("-.INF", float("-inf")),
        ("true", True), ("FALSE", False), ("~", None), ("null", None), ("", None),
        ("yes", "yes"), ("no", "no"), ("on", "on"), ("Off", "Off"), ("y", "y"),
        ("1_000", "1_000"), ("1:30", "1:30"), ("0b11", "0b11"), ("1e", "1e"), (".", "."), ("2026-11-22", "2026-11-22"),
        ("<<", "<<"), ("=", "="), ("'5'", "5"), ('"true"', "true"), ("!!str 5", "5"), ("!!float 040", 40.0),
    ],
)  # fmt: skip
def test_a_scalar_is_what_yaml_1_2_says(text, value):
    """Breaks if 040 becomes 32, 1:30 becomes 90 or yes becomes true, as YAML 1.1 has it."""
    found = parse(f"a: {text}", "my.yaml").values["a"]
    assert (found, type(found)) == (value, type(value))
    again = parse(as_yaml({"a": value}), "my.yaml").values["a"]
    assert (again, type(again)) == (value, type(value)), "and what is written is read again"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("%YAML 1.1\n---\n", 1),
        ("# a comment\n\n%YAML 1.1\n---\n", 3),
        ("%TAG ! tag:yaml.org,2002:\n%YAML 1.1\n---\n", 2),
        ("\ufeff%YAML 1.1\n---\n", 1),
        ("# one\r%YAML 1.1\n---\n", 1),
        ("...\n%YAML 1.3\n---\n", 2),
        ("%YAML 2.0\n---\n", 1),
    ],
)
def test_a_file_in_another_yaml_is_refused(text, line):
    """Breaks if a line at the top of a file changes what its numbers mean, in silence."""
    with pytest.raises(
        InputError, match=rf"^my\.yaml:{line}:1: states YAML \d\.\d: files are read as YAML 1\.2; remove"
    ):
        parse(text + "a: 040\n", "my.yaml")


def test_a_file_may_state_yaml_1_2():
    assert parse("# a comment\n%YAML 1.2\n---\na: 040\n", "my.yaml").values == {"a": 40}


@pytest.mark.parametrize("text", ["!!bool yes", "!!null 5", "!!int 1.5", "!!int 1_0", "!!float 1:30"])
def test_a_tag_does_not_make_a_value_of_another_one(text):
    with pytest.raises(InputError, match=r"my\.yaml:1:1: a = .*: is not a YAML (bool|null|int|float)"):
        parse(f"a: {text}", "my.yaml")


@pytest.mark.parametrize("text", ["9" * 150, "9" * 5000, "-" + "9" * 400, "0x" + "f" * 400, "1e400", "-1e101"])
def test_numbers_beyond_all_measure_are_refused_wherever_they_are_written(tmp_path, text):
    """Breaks if hundreds of digits end in a traceback, in infinity, or in minutes of work."""
    said = (
        r"is too large: numbers go up to 1e\+100|two numbers and a whole number|whole number of \d+ bits is too large"
    )
    with pytest.raises(InputError, match=said):
        load(written(tmp_path, GOOD.replace("mass_t: 33", f"mass_t: {text}")))
    with pytest.raises(InputError, match=said):
        read_value(text, "--set mass_t=")
    for text_of in (f"1:{text}:3", f"30,{text}"):
        with pytest.raises(InputError, match=said):
            trainmj.grid_of("b_type", {"mass_t": text_of})
    with pytest.raises(InputError, match=said):
        load("b_type", {"mass_t": 10**5000})
    assert parse("a: " + "0" * 5000 + "7", "my.yaml").values == {"a": 7}


# whole numbers


def models_below(type_: Any, seen: set[Any]) -> Iterator[type[BaseModel]]:
    for inner in get_args(type_):
        yield from models_below(inner, seen)
    if isinstance(type_, type) and issubclass(type_, BaseModel) and type_ not in seen:
        seen.add(type_)
        yield type_
        for field in type_.model_fields.values():
            yield from models_below(field.annotation, seen)


@pytest.mark.parametrize("model", [Parts, SweepFile, StudyFile, TargetsFile])
def test_every_whole_number_may_be_written_as_2_0(model):
    """Breaks if a new key is refused because a spreadsheet, pandas or --vary writes 2 as 2.0."""
    for part in models_below(model, set()):
        for name, field in part.model_fields.items():
            text = repr(field.annotation) + repr(field.metadata)
            assert len(re.findall(r"\bint\b", text)) in (0, text.count("_whole"), name == "levels"), (part, name)


@pytest.mark.parametrize("vehicles", [2, 2.0, np.float64(2.0), np.int64(2)])
def test_a_whole_number_is_taken_as_it_is_written(good, vehicles):
    scenario = good.with_values({"trains.t.vehicles": vehicles})
    assert shape(scenario) == shape(good.with_values({"trains.t.vehicles": 2}))
    assert type(scenario.trains["t"].vehicles) is int


@pytest.mark.parametrize("vehicles", [2.5, True, "2", float("nan"), float("inf")])
def test_what_is_no_whole_number_is_refused(good, vehicles):
    with pytest.raises(InputError, match=r"vehicles = .*must be"):
        good.with_values({"trains.t.vehicles": vehicles})


# the step that a scenario may ask for


def test_a_step_that_would_be_unstable_is_refused_with_one_that_is_not():
    """Breaks if the step that the message proposes is refused in turn, having been rounded up."""
    largest = 1e3 * largest_step(line_up(load("b_type")))
    scenario = load("b_type", {"simulation.step_ms": 1.0, "simulation.record_every_ms": 1.0})
    with pytest.raises(InputError, match="step_ms = 1: must be at most") as refused:
        line_up(scenario)
    proposed = float(str(refused.value).split("must be at most ")[1].split()[0])
    assert largest - 1e-3 < proposed <= largest
    chain = line_up(load("b_type", {"simulation.step_ms": proposed, "simulation.record_every_ms": 2 * proposed}))
    assert chain.step == pytest.approx(1e-3 * proposed)


# the schema for editors


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    Draft202012Validator.check_schema(schema())
    return Draft202012Validator(schema())


@pytest.mark.parametrize("name", sorted(shipped()))
def test_schema_accepts_what_ships(validator, name):
    tree = YAML(typ="safe").load(shipped()[name])
    assert [e.message for e in validator.iter_errors(tree)] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mass_t: 33", "mas_t: 33"),
        ("mass_t: 33", "mass_t: -3"),
        ("mass_t: 33", "mass_t: heavy"),
        ("partner: t", "prtner: t"),
        ("vehicles: 3", "vehicles: 0"),
        ("devices:", "occupants: {free_flight_mm: [600, 600]}\ndevices:"),
        ("devices:", "device:"),
        ("{curve: tube", "{curve: tube, stages: {a: {curve: tube}}"),
        ("{curve: tube, ", "{"),
        ("{curve: tube", "{curve: {file: a.csv, stroke_mm: [0], force_kN: [0]}"),
    ],
)
def test_schema_refuses_what_the_loader_refuses(validator, old, new):
    assert list(validator.iter_errors(YAML(typ="safe").load(GOOD))) == []
    assert list(validator.iter_errors(YAML(typ="safe").load(GOOD.replace(old, new)))) != []


def test_a_parameter_stands_for_something():
    """Breaks if a value that is set, or varied, sets nothing and nobody says so."""
    with pytest.raises(InputError, match=r"parameters.mass_t: must have at least 1 entry"):
        load("b_type", {"parameters.mass_t": []})
