"""Every kind of device, what is beyond its end, draw gear, brakes, loads, obstacles: what loads, what is refused."""
# ruff: noqa: E501

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from trainmj.collision.lineup import line_up
from trainmj.collision.press import force_along
from trainmj.errors import InputError
from trainmj.files.yaml import parse
from trainmj.scenario import Scenario, from_yaml, load, schema, shipped, to_yaml
from trainmj.scenario.devices import COLLAPSE_FORCE, DeviceSpec
from trainmj.scenario.trains import Car

GOOD = """\
curves:
  tube: {stroke_mm: [0, 10, 400], force_kN: [0, 800, 800]}
devices:
  a: {kind: crush, curve: tube, stiffness_kN_per_mm: 100, rate: {C_m_per_s: 20, P: 5}, beyond: car_body}
  a2:
    curve: tube
    stiffness_kN_per_mm: 100
    shear_off: {force_kN: 1000}
    rate: {curves: [{speed_m_per_s: 2, curve: tube}, {speed_m_per_s: 5, curve: {stroke_mm: [0, 400], force_kN: [900, 900]}}]}
    beyond: {kind: car_body, collapse_force_kN: 1500, stiffness_kN_per_mm: 80}
    pull: {curve: tube, stiffness_kN_per_mm: 50, slack_mm: 20, breaking_force_kN: 600}
  b:
    kind: hysteresis
    loading: {stroke_mm: [0, 90], force_kN: [240, 2550]}
    unloading: {stroke_mm: [0, 90], force_kN: [50, 306.5]}
    transition_stiffness_kN_per_mm: 250
    empty_stroke_mm: 50
    beyond: {kind: stop}
  c:
    kind: hydraulic
    stroke_mm: 105
    orifice_kN_s2_per_m2: 40
    preload_kN: 100
    preload_stiffness_kN_per_mm: 90
    beyond: {kind: stop, stiffness_kN_per_mm: 100}
  d:
    kind: gas_hydraulic
    stroke_mm: 105
    metering: {stroke_mm: [0, 50, 105], orifice_kN_s2_per_m2: [20, 40, 200]}
    gas: {force_kN: 50, length_mm: 120, exponent: 1.3, preload_stiffness_kN_per_mm: 100}
    rebound_orifice_kN_s2_per_m2: 400
    beyond: {kind: car_body, stiffness_kN_per_mm: 110}
  e: {stages: {x: {curve: tube}, y: {curve: tube}}, stiffness_kN_per_mm: 100, beyond: hold}
  f: {curve: tube, stiffness_kN_per_mm: 100}
trains:
  t: {vehicles: 2, mass_t: 33, front: a, coupler: f}
  u:
    vehicles: [{name: Tc, mass_t: 30, load: {seats: 60}}, {name: X, coupler: a, load: {seats: 0}, brakes: {deceleration_m_per_s2: 1}}]
    mass_t: 33
    load: {share: 0.5, kg: 80}
    front: b
    coupler: [b, c]
    brakes: {force_kN: 33, delay_s: 0.5, rise_s: 1.5, adhesion: 0.15}
    rail_friction: 0.01
    drawing: wagon
obstacles:
  lorry: {mass_t: 15, front: a}
  stop: {fixed: true, front: b}
collision: {train: t, speed_km_h: 20, partner: t}
"""


def written(folder: Path, text: str, name: str = "my.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def good() -> Scenario:
    return from_yaml(GOOD, "good.yaml")


# what loads


def test_every_kind_and_what_is_beyond_its_end(good):
    """Breaks if a kind is taken for another one, or a default beyond its end is not the documented one."""
    assert {name: device.kind for name, device in good.devices.items()} == {
        "a": "crush", "a2": "crush", "b": "hysteresis", "c": "hydraulic", "d": "gas_hydraulic", "e": "crush",
        "f": "crush",
    }  # fmt: skip
    assert {name: device.end() for name, device in good.devices.items()} == {
        "a": ("car_body", COLLAPSE_FORCE, 100),
        "a2": ("car_body", 1500, 80),
        "b": ("stop", None, 250),
        "c": ("stop", None, 100),
        "d": ("car_body", COLLAPSE_FORCE, 110),
        "e": ("hold", None, None),
        "f": None,
    }
    assert COLLAPSE_FORCE == 2000
    assert from_yaml(to_yaml(good)).values() == good.values()


def test_every_curve_of_a_device_is_listed(good):
    """Breaks if points are not counted, or names not checked, where a kind has a curve that no other has."""
    assert [at for at, _ in good.devices["a2"].curves()] == [
        ("curve",), ("rate", "curves", 0, "curve"), ("rate", "curves", 1, "curve"), ("pull", "curve"),
    ]  # fmt: skip
    assert [at for at, _ in good.devices["e"].curves()] == [("stages", "x", "curve"), ("stages", "y", "curve")]
    assert [at for at, _ in good.devices["b"].curves()] == [("loading",), ("unloading",)]


def test_orifice_and_gas(good):
    """Breaks if an orifice without metering is not the same at each stroke, or the gas is another one."""
    assert good.devices["c"].orifice_points() == ([0, 105], [40, 40])
    assert good.devices["d"].orifice_points() == ([0, 50, 105], [20, 40, 200])
    assert good.devices["d"].gas.force_at_kN(0) == 50
    assert good.devices["d"].gas.force_at_kN(96.93066) == pytest.approx(426.540, abs=0.001)


def test_cars_have_what_their_train_states_for_all(good):
    """Breaks if a load, a friction, brakes or a second device of an interface is lost on the way to the collision."""
    first, second = good.trains["u"].cars()
    assert first == Car(
        "Tc", pytest.approx(32.4), 20, pytest.approx(2.4), 0.01, good.trains["u"].brakes, drawing="wagon"
    )
    assert second == Car("X", 33, 20, 0, 0.01, good.trains["u"].vehicles[1].brakes, drawing="wagon")
    assert (first.brakes.whole_kN(first.mass_t), second.brakes.whole_kN(second.mass_t)) == (33, 33)
    assert (first.brakes.delay_s, first.brakes.rise_s, first.brakes.adhesion) == (0.5, 1.5, 0.15)
    assert (second.brakes.delay_s, second.brakes.rise_s, second.brakes.adhesion) == (0, 0, None)
    assert good.trains["t"].cars() == [Car("1", 33, 20), Car("2", 33, 20)]
    assert good.trains["u"].joints()[1:] == [("b", "c")]
    changed = good.with_values({"trains.u.vehicles.Tc.load.share": 1})
    assert changed.trains["u"].cars()[0].mass_t == pytest.approx(34.8)


@pytest.mark.parametrize(
    ("partner", "more", "said"),
    [
        ("lorry", {}, "into lorry (15 t obstacle) standing"),
        ("lorry", {"partner_speed_km_h": -5}, "into lorry (15 t obstacle) running towards it at 5 km/h"),
        ("stop", {}, "into stop (fixed obstacle)"),
    ],
)
def test_an_obstacle_is_a_partner(good, partner, more, said):
    changes = {f"collision.{key}": value for key, value in ({"partner": partner} | more).items()}
    assert good.with_values(changes).subject == f"t (2 vehicles, 66 t) at 20 km/h {said}"


def test_obstacles_are_drawn_as_what_they_are(good):
    assert {name: obstacle.drawn for name, obstacle in good.obstacles.items()} == {
        "lorry": "lorry",
        "stop": "buffer_stop",
    }
    assert good.with_values({"obstacles.lorry.drawing": "buffer_stop"}).obstacles["lorry"].drawn == "buffer_stop"


@pytest.mark.parametrize("name", sorted(shipped()))
def test_shipped_devices_state_what_is_beyond_their_end(name):
    """Breaks if results of a shipped scenario stop being valid where a curve ends, though what follows is known."""
    assert [device for device, spec in load(name).devices.items() if spec.end() is None] == []


@pytest.mark.parametrize(
    ("old", "table"),
    [
        ("{stroke_mm: [0, 90], force_kN: [240, 2550]}", "stroke_mm;force_kN\n0;240\n90;2550,0\n"),
        ("{stroke_mm: [0, 90], force_kN: [50, 306.5]}", "stroke_mm,force_kN,remark\n0,50,\n90,306.5,measured\n"),
        ("{stroke_mm: [0, 400], force_kN: [900, 900]}", "stroke_mm,force_kN\n0,900\n400,900\n"),
        (
            "{stroke_mm: [0, 50, 105], orifice_kN_s2_per_m2: [20, 40, 200]}",
            "stroke_mm\torifice_kN_s2_per_m2\n0\t20\n50\t40\n105\t200\n",
        ),
        ("{stroke_mm: [0, 10, 400], force_kN: [0, 800, 800]}", "stroke_mm,force_kN\n0,0\n10,800\n400,800\n"),
    ],
    ids=["loading", "unloading", "rate", "metering", "curve"],
)
def test_every_table_may_be_a_csv_file(good, tmp_path, old, table):
    written(tmp_path, table, "x.csv")
    assert old in GOOD
    found = load(written(tmp_path, GOOD.replace(old, "{file: x.csv}")))
    assert found.values() == good.values()
    assert tmp_path / "x.csv" in found.files


def test_the_curve_of_a_draw_gear_may_be_a_csv_file(good, tmp_path):
    written(tmp_path, "stroke_mm,force_kN\n0,0\n5,250\n", "x.csv")
    found = load(written(tmp_path, GOOD.replace("pull: {curve: tube", "pull: {curve: {file: x.csv}")))
    assert found.curve_points(found.devices["a2"].pull.curve) == ([0, 5], [0, 250])


VEHICLES = """\
# from the weight report
name;mass_t;coupler;seats;length_m
007;30,5;;60;18
Mp;;f;0;
"""


def of_vehicles(folder: Path, table: str) -> Path:
    written(folder, table, "v.csv")
    text = re.sub(r"vehicles: \[.*\]", "vehicles: {file: v.csv}", GOOD)
    return written(folder, text)


def test_vehicles_may_be_a_csv_file(tmp_path):
    """Breaks if an empty cell is a value, or a name of digits a number."""
    scenario = load(of_vehicles(tmp_path, VEHICLES))
    first, second = scenario.trains["u"].cars()
    assert first[:4] == ("007", pytest.approx(32.9), 18, pytest.approx(2.4))
    assert second[:4] == ("Mp", 33, 20, 0)
    assert scenario.trains["u"].joints()[1:] == [("b", "c")]
    assert from_yaml(to_yaml(scenario)).trains == scenario.trains
    assert scenario.with_values({"trains.u.vehicles.Mp.mass_t": 35}).trains["u"].cars()[1].mass_t == 35


def test_a_table_of_vehicles_has_a_device_at_each_end(tmp_path):
    """Breaks if columns front, rear and drawing are not those of the vehicles, or empty cells are devices."""
    table = "name;seats;front;rear;drawing\nA;0;;d;locomotive\nB;0;c;a;\nC;0;d;;coach\nD;0;;;\n"
    scenario = load(of_vehicles(tmp_path, table))
    assert scenario.trains["u"].joints()[1:] == [("d", "c"), ("a", "d"), ("b", "c")]
    assert [car.drawing for car in scenario.trains["u"].cars()] == ["locomotive", "wagon", "coach", "wagon"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (
            "mass_t\n30\n",
            r"vehicles\.file = 'v\.csv': has no column 'name'; the first line must name name, and is 'mass_t'",
        ),
        ("name,mas_t\nA,30\n", r"has a column 'mas_t', which no vehicle has; did you mean 'mass_t'\?"),
        ("name,mass_t\nA,heavy\nB,30\n", r"line 2: row 1: mass_t = 'heavy': must be a number, or empty"),
        ("name,mass_t\nA,30000\n", r"v\.csv:2: vehicle 1: trains\.u\.vehicles\.0\.mass_t = 30000: .*divide by 1000"),
        ("name,coupler\nA,a\nB,x\n", r"v\.csv:3: vehicle 2: trains\.u\.vehicles\.1\.coupler = 'x': there is no device"),
        ("name,mass_t\nA,30\n,30\n", r"v\.csv:3: vehicle 2: trains\.u\.vehicles\.1\.name: is missing"),
        (
            "name\nA\n",
            r"my\.yaml:40:5: trains\.u\.load: has no seats, and not every vehicle states its own: .* seats: 0 for none",
        ),
        ("name\n" + "A\n" * 401, r"has more than 400 vehicles"),
    ],
)
def test_tables_of_vehicles_that_cannot_be_used_are_refused(tmp_path, table, said):
    with pytest.raises(InputError, match=said):
        load(of_vehicles(tmp_path, table))


def test_tables_are_only_read_beside_a_file(good):
    for path, key in (("devices.d.metering", "file"), ("trains.u.vehicles", "file"), ("devices.b.loading", "file")):
        with pytest.raises(InputError, match=rf"{path}.{key}.*: is only read when a scenario is loaded from its file"):
            good.with_values({path: {"file": "x.csv"}})


def test_a_kind_over_another_replaces_what_does_not_go_with_it(tmp_path):
    """Breaks if a file that builds on another one cannot make a friction gear of a tube, or leaves half a tube in it."""
    written(tmp_path, GOOD, "base.yaml")
    gear = "kind: hysteresis, loading: tube, unloading: tube, transition_stiffness_kN_per_mm: 90"
    path = written(tmp_path, f"builds_on: base.yaml\ndevices:\n  a2: {{{gear}}}\n  a: {{beyond: {{kind: stop}}}}\n")
    changed = load(path)
    assert changed.devices["a2"].kind == "hysteresis"
    assert changed.devices["a2"].end() == ("car_body", 1500, 80), "what goes with every kind stays"
    assert changed.told == (
        f"{path}:3:3: devices.a2: curve, stiffness_kN_per_mm, shear_off, rate of {tmp_path / 'base.yaml'} given up",
    )
    over = written(tmp_path, "builds_on: base.yaml\ndevices: {a2: {beyond: {kind: stop}}, c: {stroke_mm: 90}}\n")
    assert load(over).devices["a2"].end() == ("stop", None, 80)
    assert load(over).devices["c"].stroke_mm == 90
    written(tmp_path, f"builds_on: base.yaml\ndevices:\n  a2: {{{gear}}}\n", "gear.yaml")
    tube = "kind: crush, curve: tube, stiffness_kN_per_mm: 9"
    back = load(written(tmp_path, f"builds_on: gear.yaml\ndevices: {{a2: {{{tube}}}}}\n"))
    assert (back.devices["a2"].kind, back.devices["a2"].end()) == ("crush", ("car_body", 1500, 80))


# what is refused


def replaced(old: str, new: str, *said: str) -> tuple[str, str, tuple[str, ...]]:
    return old, new, said


BAD = [
    # kinds
    replaced("kind: crush,", "kind: crushed,", r"my\.yaml:4:7: devices\.a\.kind = 'crushed': must be 'crush', 'hys"),
    replaced("    kind: hysteresis\n", "", r"my\.yaml:12:3: devices\.b\.kind: is missing: loading belongs to kind hyst"),
    replaced("    empty_stroke_mm: 50", "    damping_kN_s_per_m: 5",
             r"my\.yaml:17:5: devices\.b\.damping_kN_s_per_m = 5: belongs to kind crush: hysteresis takes beyond, pull"),
    replaced("preload_kN: 100", "gas: {}", r"my\.yaml:23:5: devices\.c\.gas: belongs to kind gas_hydraulic: hydraulic"),
    replaced("preload_kN: 100", "preload: 100", r"devices\.c\.preload = 100: unknown key; did you mean 'preload_kN'"),
    # beyond
    replaced("beyond: hold", "beyond: nothing", r"devices\.e\.beyond = 'nothing': must be 'car_body', 'stop' or 'hold'"),
    replaced("beyond: hold", "beyond: 5", r"e\.beyond = 5: must be 'car_body', 'stop' or 'hold', or a group with kind"),
    replaced("beyond: {kind: stop}", "beyond: {}", r"my\.yaml:18:5: devices\.b\.beyond\.kind: .*'car_body' or 'stop'"),
    replaced("beyond: {kind: stop}", "beyond: {kind: stop, collapse_force_kN: 3000}",
             r"b\.beyond\.collapse_force_kN = 3000: belongs to kind car_body: stop takes stiffness_kN_per_mm"),
    replaced("collapse_force_kN: 1500", "collapse_force_kN: 950",
             r"my\.yaml:10:30: devices\.a2\.beyond\.collapse_force_kN = 950: must be at least the 1000 kN"),
    replaced("collapse_force_kN: 1500", "collapse_force_kN: 1.5e6", r"forces are in kN; divide by 1000 if it is in N"),
    replaced("beyond: {kind: stop}", "beyond: car_body",
             r"my\.yaml:18:5: devices\.b\.beyond = 'car_body': collapses at 2000 kN .* at least the 2550 kN"),
    replaced("{x: {curve: tube}, y: {curve: tube}}, stiffness_kN_per_mm: 100, beyond: hold",
             "{x: {curve: tube}, Car_body: {curve: tube}}, stiffness_kN_per_mm: 100, beyond: car_body",
             r"devices\.e\.stages\.Car_body: has the name of the car body that beyond states: choose another"),
    # rate
    replaced("C_m_per_s: 20, P: 5", "C_m_per_s: 20", r"devices\.a\.rate\.P: is missing"),
    replaced("C_m_per_s: 20, P: 5", "C_m_per_s: 0, P: 5", r"rate\.C_m_per_s = 0: must be at least 0.001"),
    replaced("C_m_per_s: 20, P: 5", "P: 5", r"devices\.a\.rate: needs C_m_per_s and P, or curves"),
    replaced("C_m_per_s: 20, P: 5", "C_m_per_s: 20, P: 5, curves: []", r"a\.rate\.curves: does not go with C_m_per_s"),
    replaced("speed_m_per_s: 5", "speed_m_per_s: 2",
             r"my\.yaml:9:\d+: devices\.a2\.rate\.curves\.1\.speed_m_per_s = 2: must be more than the 2 m/s before it"),
    replaced("stroke_mm: [0, 400], force_kN: [900, 900]", "stroke_mm: [0, 300], force_kN: [900, 900]",
             r"a2\.rate\.curves\.1\.curve: must end where the curve at rest does, at 400 mm, and ends at 300 mm"),
    replaced("stroke_mm: [0, 400], force_kN: [900, 900]", "stroke_mm: [5, 400], force_kN: [900, 900]",
             r"rate\.curves\.1\.curve\.stroke_mm\.0 = 5: the curve of devices\.a2\.rate\.curves\.1 must start at a str"),
    replaced("stroke_mm: [0, 400], force_kN: [900, 900]", "stroke_mm: [0, 400], force_kN: [900, 1600]",
             r"devices\.a2\.shear_off\.force_kN = 1000: must be at least the 1600 kN at which the curve at 5 m/s ends",
             r"devices\.a2\.beyond\.collapse_force_kN = 1500: must be at least the 1600 kN"),
    replaced("beyond: hold", "rate: {curves: [{speed_m_per_s: 2, curve: tube}]}",
             r"devices\.e\.rate\.curves: go with a device of one curve, not of stages: state C_m_per_s and P instead"),
    # pull
    replaced("pull: {curve: tube, stiffness_kN_per_mm: 50,", "pull: {", r"a2\.pull\.stiffness_kN_per_mm: is missing"),
    replaced("pull: {curve: tube", "pull: {curve: tubes", r"a2\.pull\.curve = 'tubes': there is no curve of this name"),
    replaced("breaking_force_kN: 600", "breaking_force_kN: 0", r"breaking_force_kN = 0: must be greater than 0"),
    replaced("slack_mm: 20", "slack: 20", r"a2\.pull\.slack = 20: unknown key; did you mean 'slack_mm'"),
    # hysteresis
    replaced("force_kN: [50, 306.5]", "force_kN: [50, 3000]",
             r"my\.yaml:15:5: devices\.b\.unloading: is above loading at 90 mm, 3000 kN over 2550 kN: lower it there"),
    replaced("stroke_mm: [0, 90], force_kN: [50, 306.5]", "stroke_mm: [0, 45, 90], force_kN: [50, 1500, 300]",
             r"b\.unloading: is above loading at 45 mm, 1500 kN over 1395 kN"),
    replaced("{stroke_mm: [0, 90], force_kN: [50, 306.5]}", "{stroke_mm: [0, 80], force_kN: [50, 306.5]}",
             r"devices\.b\.unloading: must reach as far as loading, to 90 mm, and ends at 80 mm: extend the curve"),
    replaced("{stroke_mm: [0, 90], force_kN: [50, 306.5]}", "{stroke_mm: [1, 90], force_kN: [50, 306.5]}",
             r"b\.unloading\.stroke_mm\.0 = 1: the curve of devices\.b\.unloading must start at a stroke of 0"),
    replaced("transition_stiffness_kN_per_mm: 250", "transition_stiffness_kN_per_mm: 25",
             r"b\.transition_stiffness_kN_per_mm = 25: must be more than every slope .*; loading rises by 25.6667 kN/mm"),
    replaced("    empty_stroke_mm: 50", "    stroke_limit_mm: 100", r"b\.stroke_limit_mm = 100: must be within the load"),
    replaced("[0, 90], force_kN: [240, 2550]", "[0, 0.09], force_kN: [240, 250]", r"devices\.b: .*strokes are in m"),
    # hydraulic
    replaced("    stroke_mm: 105\n    orifice", "    orifice", r"my\.yaml:19:3: devices\.c\.stroke_mm: is missing"),
    replaced("    stroke_mm: 105\n    orifice", "    stroke_mm: 0.105\n    orifice",
             r"c\.stroke_mm = 0\.105: must be at least 5 mm: multiply by 1000 if it is in m"),
    replaced("    orifice_kN_s2_per_m2: 40\n", "", r"my\.yaml:19:3: devices\.c: needs orifice_kN_s2_per_m2 or metering"),
    replaced("    rebound", "    orifice_kN_s2_per_m2: 1\n    rebound",
             r"my\.yaml:29:5: devices\.d\.metering: does not go with orifice_kN_s2_per_m2: leave one of them out"),
    replaced("orifice_kN_s2_per_m2: 40\n", "orifice_kN_s2_per_m2: 4e6\n", r"divide by 1000 if it is in N s2/m2"),
    replaced("orifice_kN_s2_per_m2: 40\n    preload_kN: 100", "orifice_kN_s2_per_m2: 0",
             r"devices\.c: has neither an orifice constant above 0 nor a preload: it gives no force"),
    replaced("    preload_stiffness_kN_per_mm: 90\n", "", r"devices\.c\.preload_stiffness_kN_per_mm: is missing: a pre"),
    replaced("    beyond: {kind: stop, stiffness_kN_per_mm: 100}\n", "",
             r"my\.yaml:19:3: devices\.c\.beyond: is missing: kind hydraulic needs a stop .* \{ kind: stop, stiffness_kN"),
    replaced("beyond: {kind: stop, stiffness_kN_per_mm: 100}", "beyond: hold", r"c\.beyond = 'hold': kind hydraulic ne"),
    replaced("beyond: {kind: stop, stiffness_kN_per_mm: 100}", "beyond: stop", r"c\.beyond = 'stop': kind hydraulic ne"),
    replaced("beyond: {kind: car_body, stiffness_kN_per_mm: 110}", "beyond: {kind: car_body}",
             r"devices\.d\.beyond: kind gas_hydraulic needs a stop or a car body with a stiffness of its own"),
    replaced("preload_kN: 100", "stroke_limit_mm: 106", r"c\.stroke_limit_mm = 106: must be within stroke_mm, which en"),
    replaced("{stroke_mm: [0, 50, 105], orifice", "{stroke_mm: [0, 50, 100], orifice",
             r"d\.metering\.stroke_mm\.2 = 100: must be at least the 105 mm of stroke of the device"),
    replaced("{stroke_mm: [0, 50, 105], orifice", "{stroke_mm: [1, 50, 105], orifice",
             r"my\.yaml:29:\d+: devices\.d\.metering\.stroke_mm\.0 = 1: must be 0: metering covers the stroke"),
    replaced("{stroke_mm: [0, 50, 105], orifice", "{stroke_mm: [0, 50, 50], orifice",
             r"d\.metering\.stroke_mm\.2 = 50: must be more than the 50 mm before it: strokes grow"),
    replaced("orifice_kN_s2_per_m2: [20, 40, 200]", "orifice_kN_s2_per_m2: [20, 40]",
             r"devices\.d\.metering: needs as many strokes as orifice constants; it has 3 and 2"),
    replaced("length_mm: 120", "length_mm: 105",
             r"d\.gas\.length_mm = 105: must be more than the 105 mm of stroke: gas is not pressed to nothing"),
    replaced("length_mm: 120", "length_mm: 105.01", r"gas\.length_mm = 105\.01: gives .* kN at 105 mm .*: lengthen it"),
    replaced("length_mm: 120", "length_mm: 110", r"devices\.d\.beyond\.collapse_force_kN: must .* without speed reaches"),
    replaced("    rebound_orifice_kN_s2_per_m2: 400\n", "", r"devices\.d\.rebound_orifice_kN_s2_per_m2: is missing"),
    replaced("exponent: 1.3", "exponent: 0.5", r"devices\.d\.gas\.exponent = 0\.5: must be at least 1"),
    # trains
    replaced("coupler: [b, c]", "coupler: [b, x]", r"trains\.u\.coupler\.1 = 'x': there is no device of this name"),
    replaced("coupler: [b, c]", "coupler: [b]", r"trains\.u\.coupler: must have at least 2 entries"),
    replaced("coupler: [b, c]", "coupler: 5", r"trains\.u\.coupler = 5: must be the name of a device, or those of two in"),
    replaced("share: 0.5", "share: 50", r"trains\.u\.load\.share = 50: must be at most 10: .* divide by 100 if in %"),
    replaced("share: 0.5, ", "", r"trains\.u\.vehicles\.0\.load: has no share, and the train states none for all"),
    replaced("seats: 60", "seats: 4500", r"vehicles\.0\.load: makes 210 t of 30 t, more than 200 t: kg is the mass of one"),
    replaced("force_kN: 33, delay_s", "force_kN: 33, deceleration_m_per_s2: 1, delay_s",
             r"trains\.u\.brakes\.\w+ = \d+: does not go with \w+: leave one of them out"),
    replaced("force_kN: 33, delay_s", "delay_s", r"trains\.u\.brakes: needs force_kN or deceleration_m_per_s2"),
    replaced("adhesion: 0.15", "adhesion: 15", r"brakes\.adhesion = 15: must be at most 1: .*divide by 100 if it is in %"),
    replaced("delay_s: 0.5", "delay_s: 500", r"brakes\.delay_s = 500: must be at most 60: .*divide by 1000 if it is in ms"),
    replaced("rail_friction: 0.01", "rail_friction: 1.5", r"trains\.u\.rail_friction = 1\.5: must be at most 1"),
    replaced("drawing: wagon", "drawing: waggon", r"u\.drawing = 'waggon': must be 'passenger', .*'wagon' or 'locomotive'"),
    # obstacles and the collision
    replaced("lorry: {mass_t: 15,", "lorry: {", r"obstacles\.lorry: has no mass_t: add it, or fixed: true if it does not"),
    replaced("fixed: true,", "fixed: true, mass_t: 15,", r"obstacles\.stop\.mass_t = 15: does not go with fixed"),
    replaced("fixed: true,", "fixed: true, rail_friction: 0.1,", r"obstacles\.stop\.rail_friction = 0\.1: does not go"),
    replaced("{mass_t: 15, front: a}", "{mass_t: 15}", r"obstacles\.lorry\.front: is missing"),
    replaced("{mass_t: 15, front: a}", "{mass_t: 15, front: z}", r"lorry\.front = 'z': there is no device of this name"),
    replaced("  lorry:", "  t:", r"obstacles\.t: is the name of a train, too: choose another name"),
    replaced("  lorry:", "  rigid_wall:", r"obstacles\.rigid_wall: is reserved for the rigid wall"),
    replaced("partner: t}", "partner: stop, partner_speed_km_h: -1}", r"partner_speed_km_h = -1: must be 0: stop does no"),
    replaced("partner: t}", "partner: lorry, partner_end: rear}", r"partner_end = 'rear': must be front: lorry is an obstacle"),
    replaced("partner: t}", "partner: lory}", r"partner = 'lory': there is no train, obstacle or partner file of this .*mean 'lorry'"),
    replaced("collision: {train: t,", "collision: {train: lorry,", r"collision\.train = 'lorry': there is no train of this"),
    replaced("partner: t}", "partner: t, grade_per_mille: 500}", r"grade_per_mille = 500: .*multiply by 10 if it is in %"),
]  # fmt: skip


NOTHING = "{stroke_mm: [0, 90], force_kN: [0, 0]}"


@pytest.mark.parametrize(
    "device",
    [
        f"curve: {NOTHING}",
        f"curve: {NOTHING}, beyond: hold",
        f"curve: {NOTHING}, damping_kN_s_per_m: 10",  # a dashpot goes no higher than the curve
        f"curve: {NOTHING}, rate: {{C_m_per_s: 20, P: 5}}",
        f"stages: {{x: {{curve: {NOTHING}}}, y: {{curve: {NOTHING}, empty_stroke_mm: 20}}}}",
        f"kind: hysteresis, loading: {NOTHING}, unloading: {NOTHING}, transition_",
        f"kind: hysteresis, loading: {NOTHING}, unloading: {NOTHING}, beyond: hold, transition_",
    ],
)
def test_a_device_without_force_is_refused_unless_something_is_behind_it(device):
    """Breaks if vehicles pass through each other, and that is called no contact."""
    comma = "" if device.endswith("transition_") else ", "
    text = GOOD.replace("{curve: tube, stiffness_kN_per_mm: 100}", f"{{{device}{comma}stiffness_kN_per_mm: 100}}")
    with pytest.raises(
        InputError, match=r":\d+:3: devices\.f: has no force at any stroke: it would be pressed without"
    ):
        from_yaml(text, "my.yaml")
    bounded = device.replace("beyond: hold, ", "").replace(", beyond: hold", "")
    found = from_yaml(text.replace(device, f"beyond: {{kind: stop, stiffness_kN_per_mm: 100}}, {bounded}"), "my.yaml")
    assert found.devices["f"].end().kind == "stop"


@pytest.mark.parametrize(("old", "new", "said"), BAD)
def test_bad_devices_trains_and_obstacles_are_refused_with_line_key_value_and_rule(tmp_path, old, new, said):
    assert GOOD.count(old) >= 1
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load(path)
    for line in str(caught.value).splitlines():
        assert re.match(rf"{re.escape(str(path))}:\d+:\d+: \S+", line), "a message begins with file, line and key"
    for words in said:
        assert re.search(words, str(caught.value)), caught.value


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    return Draft202012Validator(schema())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("kind: crush,", "kind: crushed,"),
        ("    kind: hysteresis\n", ""),
        ("    empty_stroke_mm: 50", "    damping_kN_s_per_m: 5"),
        ("preload_kN: 100", "gas: {}"),
        ("beyond: hold", "beyond: nothing"),
        ("beyond: {kind: stop}", "beyond: {kind: stop, collapse_force_kN: 3000}"),
        ("C_m_per_s: 20, P: 5", "C_m_per_s: 20, P: 5, curves: []"),
        ("slack_mm: 20", "slack: 20"),
        ("{stroke_mm: [0, 50, 105], orifice", "{force_kN: [0, 50, 105], orifice"),
        ("coupler: [b, c]", "coupler: [b]"),
        ("force_kN: 33, delay_s", "force_kN: 33, deceleration_m_per_s2: 1, delay_s"),
        ("drawing: wagon", "drawing: waggon"),
        ("fixed: true", "fixed: maybe"),
    ],
)
def test_the_schema_knows_the_keys_of_each_kind(validator, old, new):
    """Breaks if an editor takes what the loader refuses, or marks what is right."""
    assert list(validator.iter_errors(parse(GOOD, "good").values)) == []
    assert GOOD.count(old) >= 1
    assert list(validator.iter_errors(parse(GOOD.replace(old, new, 1), "bad").values)) != []


def test_every_kind_of_device_is_tried_here(good):
    """Breaks if a kind is added without a good example and bad ones."""
    kinds = {kind for spec in DeviceSpec.__origin__.__args__ for kind in spec.model_fields["kind"].annotation.__args__}
    assert kinds == {device.kind for device in good.devices.values()}


def test_what_only_unused_devices_state_changes_nothing(good):
    """Breaks if a device that the collision does not use stops it."""
    assert len(line_up(good.with_values({"devices.a.rate": None})).vehicles) == 4


def test_curves_at_speeds_begin_behind_the_empty_stroke_and_end_in_the_shear_off():
    """Breaks if a device that is quick has force before it engages, or its bolts hold longer or shear at less."""
    values = {
        "devices": {
            "d": {
                "curve": {"stroke_mm": [0, 100, 300], "force_kN": [100, 500, 500]},
                "stiffness_kN_per_mm": 1000,
                "empty_stroke_mm": 50,
                "shear_off": {"force_kN": 900, "ramp_mm": 5},
                "beyond": "hold",
                "rate": {"curves": [{"speed_m_per_s": 2, "curve": {"stroke_mm": [0, 300], "force_kN": [300, 800]}}]},
            }
        },
        "trains": {"t": {"vehicles": 1, "mass_t": 30, "front": "d"}},
        "collision": {"train": "t", "speed_km_h": 7.2, "partner": "rigid_wall"},
    }
    (element,) = line_up(Scenario.from_values(values)).interfaces[0].elements
    strokes = np.linspace(0.0, 0.37, 3701)
    at_rest, half, quick = (force_along(element, strokes, speed)[0] / 1e3 for speed in (0.0, 1.0, 2.0))
    for stroke_mm, slow, fast in (
        (20, 0, 0),
        (49, 0, 0),
        (150, 500, 300 + 500 / 3),
        (352.5, 700, 850),
        (355, 900, 900),
    ):
        k = round(stroke_mm * 10)
        assert at_rest[k] == pytest.approx(slow, abs=1.0)
        assert quick[k] == pytest.approx(fast, abs=1.0)
        assert half[k] == pytest.approx((slow + fast) / 2, abs=1.0)
