"""The scenarios in the vertical plane that ship, and every number of the page about them."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import pytest
from pages import read

import trainmj
from trainmj.collision.lineup import line_up
from trainmj.files.provenance import entry_of
from trainmj.scenario import Scenario, load

PAGE = "docs/vertical-plane.md"
TRAINS = ("b_type_vertical", "emu_vertical")

TYPES = {"b_type_vertical": ["car"], "emu_vertical": ["trailer", "motor"]}


@cache
def scenario(name: str) -> Scenario:
    return load(name)


def face(height_mm: float) -> dict[str, Any]:
    tie = {"friction": 0.2, "tooth_kN": 0, "kN_per_mm": 100}
    return {"acts": "face", "height_mm": height_mm, "overlap_mm": 120, "tie": tie}


def ended(name: str, changes: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    """Status and responses of a shipped scenario with changes."""
    summary = trainmj.summarise(trainmj.run(scenario(name).with_values(changes)))
    return summary.status.kind.value, summary.responses


def cells(*values: Any) -> str:
    return "| " + " | ".join(map(str, values)) + " |"


def answers(name: str, changes: Mapping[str, Any]) -> tuple[str, ...]:
    """Status, step at the front, largest step, lift, and least load of a run, as the page has them."""
    status, found = ended(name, changes)
    lift, load = found["largest_wheel_lift_mm"], found["least_wheel_load"]
    steps = f"{found['step_S1_M1_mm']:.0f}", f"{found['largest_step_mm']:.0f}"
    return status, *steps, f"{lift:.1f}", f"{load:.2f}"


def brackets() -> Iterator[str]:
    for name in TRAINS:
        for ties in ("free", "stated", "tied"):
            yield cells(f"`{name}`", ties, *answers(name, {"ties": ties}))


def speeds() -> Iterator[str]:
    for speed in (10, 12, 15, 18, 20, 22, 25, 30):
        row = []
        for offset in (0, 40, 76.2):
            status, found = ended("b_type_vertical", {"offset_mm": offset, "speed_km_h": speed})
            met = found["met_step_S1_M1_mm"]
            row.append(f"{found['step_S1_M1_mm']:.0f}{', override' if status == 'override' else ''}")
            row.append("-" if math.isnan(met) else f"{met:.0f}")
        yield cells(speed, *row)


INNER = ("devices.coupler_a_b.line", "devices.coupler_c_d.line")
CAR = "vehicle_types.car"
ONE_BY_ONE: dict[str, dict[str, Any]] = {
    "as shipped": {},
    "offset 0 mm": {"offset_mm": 0},
    "offset 76.2 mm": {"offset_mm": 76.2},
    "15 km/h": {"speed_km_h": 15},
    "15 km/h, couplers of the front swing by 20 mrad": {"speed_km_h": 15, "front_free_mrad": 20},
    "couplers of the front swing by 20 mrad": {"front_free_mrad": 20},
    "couplers of the front as faces": {"devices.front.stages.coupler.line": face(660)},
    "couplers between cars swing by 50 mrad": {"inner_free_mrad": 50},
    "by 20 mrad": {"inner_free_mrad": 20},
    "by 0 mrad, stop of 2 MN m/rad": {"inner_free_mrad": 0},
    "by 0 mrad, stop of 1 MN m/rad": {"inner_free_mrad": 0, "inner_stop_MN_m_per_rad": 1},
    "by 0 mrad, stop of 0.5 MN m/rad": {"inner_free_mrad": 0, "inner_stop_MN_m_per_rad": 0.5},
    "couplers between cars as faces": dict.fromkeys(INNER, face(660)),
    "friction 0.05": {"friction": 0.05},
    "friction 0": {"friction": 0},
    "secondary springs 20 % stiffer": {"secondary_kN_per_mm": 1.2},
    "secondary dampers ten times as strong": {f"{CAR}.secondary.kN_s_per_m": 60},
    "centre of gravity 20 % higher": {"cog_height_m": 1.92},
    "secondary lift stop at 30 mm": {f"{CAR}.secondary.lift_stop_mm": 30},
    "no secondary lift stop": {f"{CAR}.secondary.lift_stop_mm": "none"},
    "secondary bump stop at 30 mm": {f"{CAR}.secondary.bump_stop_mm": 30},
    "no primary stops": {f"{CAR}.primary.lift_stop_mm": "none", f"{CAR}.primary.bump_stop_mm": "none"},
}


def one_by_one() -> Iterator[str]:
    for label, changes in ONE_BY_ONE.items():
        yield cells(label, *answers("b_type_vertical", changes))


def ties() -> Iterator[str]:
    tie = "devices.front.stages.anti_climber.line.tie"
    for stiffness in (20, 100, 500):
        for friction in (0.2, 1.0):
            _, found = ended("b_type_vertical", {f"{tie}.kN_per_mm": stiffness, f"{tie}.friction": friction})
            yield cells(
                stiffness, friction, f"{found['tie_force_S1_M1_kN']:.0f}", f"{found['slip_S1_M1_mm']:.1f}",
                f"{found['step_S1_M1_mm']:.1f}",
            )  # fmt: skip


def steps() -> Iterator[str]:
    for name in TRAINS:
        for tied in ("free", "stated", "tied"):
            for step in (0.05, 0.1, 0.25, 0.5):
                _, found = ended(name, {"ties": tied, "simulation.step_ms": step})
                numbers = (found[key] for key in ("TS_mm", "largest_step_mm", "largest_wheel_lift_mm"))
                yield cells(f"`{name}`", tied, step, *(f"{n:.2f}" for n in numbers), f"{found['least_wheel_load']:.4f}")


def raised(name: str, key: str) -> dict[str, Any]:
    """A value of every type of vehicle, 20 % up."""
    paths = [f"vehicle_types.{of}.{key}" for of in TYPES[name]]
    return {path: 1.2 * scenario(name).locate(path)[0] for path in paths}


def trends() -> Iterator[str]:
    """What the centre of gravity and the secondary stiffness do to the lift, or to the least load, of the lead cars."""
    for name in TRAINS:
        for tied in ("free", "stated", "tied"):
            found = [
                ended(name, {"ties": tied, **changes})[1]
                for changes in ({}, raised(name, "body.cog_height_m"), raised(name, "secondary.kN_per_mm"))
            ]
            lifts = [max(f["wheel_lift_M1_mm"], f["wheel_lift_S1_mm"]) for f in found]
            loads = [min(f["wheel_load_M1"], f["wheel_load_S1"]) for f in found]
            lifted = lifts[0] > 0
            values = lifts if lifted else loads
            worse = [(v - values[0]) * (1 if lifted else -1) for v in values[1:]]
            said = [
                "worse, as theirs" if worse[0] > 0 else "better, against theirs",
                "better, as theirs" if worse[1] < 0 else "worse, against theirs",
            ]
            shown = [f"{v:.1f} mm" if lifted else f"N/N0 = {v:.3f}" for v in values]
            yield cells(f"`{name}`", tied, shown[0], f"{shown[1]}: {said[0]}", f"{shown[2]}: {said[1]}")


INPUTS = {
    "offset_mm": "0 to 76.2 mm",
    "front_free_mrad": "20 to 120 mrad",
    "inner_free_mrad": "0 to 100 mrad",
    "inner_stop_MN_m_per_rad": "1 to 10 MN m/rad",
    "friction": "0 to 0.3",
    "secondary_kN_per_mm": "0.5 to 1.5 kN/mm",
    "cog_height_m": "1.4 to 1.8 m",
}


def inputs() -> Iterator[str]:
    """Rank correlations of the shipped sweep over its valid cases."""
    responses = ["step_S1_M1_mm", "largest_step_mm", "least_wheel_load"]
    with tempfile.TemporaryDirectory() as folder:
        trainmj.run_sweep(trainmj.load_sweep("b_type_vertical_inputs"), folder)
        table = trainmj.read_table(folder)
    valid = table[table["status"] != "override"]
    found = {
        case: valid[valid["load_case"] == case][[*INPUTS, *responses]].corr(method="spearman")
        for case in ("v15", "v25")
    }
    for name, span in INPUTS.items():
        numbers = (found[case].loc[name, response] for case in found for response in responses)
        yield cells(f"`{name}`, {span}", *(f"{n:+.2f}" for n in numbers))


TABLES = {f.__name__: f for f in (brackets, speeds, one_by_one, ties, inputs, trends, steps)}


# what ships


@pytest.mark.parametrize("name", TRAINS)
def test_what_decides_in_the_plane_says_where_it_comes_from(name):
    """Breaks if a value of the running gear or of a line ships as if somebody had published it."""
    values = scenario(name).values()
    sources = scenario(name).sources

    def leaves(at: Any, path: str) -> Iterator[str]:
        if not isinstance(at, dict):
            yield path
            return
        for key, below in at.items():
            yield from leaves(below, f"{path}.{key}")

    stated = [path for key in ("vehicle_types", "devices") for path in leaves(values[key], key)]
    stated = [path for path in stated if path.startswith("vehicle_types") or ".line." in path]
    assert len(stated) > 40
    for path in [*stated, "collision.offset_mm.M", "limits.step_mm", "limits.wheel_lift_mm"]:
        entry = entry_of(sources, path)
        assert entry is not None, path
        assert not isinstance(entry, str), f"{path}: without a mark"


def test_along_the_track_the_metro_is_the_one_it_builds_on():
    """Breaks if the metro with running gear is another train, so that the two planes cannot be compared."""
    line = {"plane": "line", "simulation.step_ms": 0.5}
    ours, theirs = (trainmj.run(load(name, line)) for name in ("b_type_vertical", "b_type"))
    assert ours.stroke.tobytes() == theirs.stroke.tobytes()
    assert ours.velocity.tobytes() == theirs.velocity.tobytes()


def test_the_electric_train_differs_from_the_one_it_builds_on_as_it_says():
    """Breaks if its devices are others than those of the train of Shao et al. 2016, but for the shear-off."""
    ours, theirs = (load(name).values()["devices"] for name in ("emu_vertical", "en15227_c1"))
    for device, behind in (("head", "absorber"), ("between", "car_body")):
        ours[device]["stages"]["coupler"].pop("shear_off")
        for stage in ours[device]["stages"].values():
            stage.pop("line")
        assert ours[device]["stages"][behind].pop("empty_stroke_mm") == 1
        assert ours[device]["stages"][behind]["curve"]["force_kN"].pop(0) == 0
        theirs[device]["stages"][behind]["curve"]["force_kN"].pop(0)
        assert ours[device] == theirs[device]


def test_the_electric_train_has_the_published_frequencies():
    """Breaks if a suspension is taken per wheel, or the page tells other frequencies."""
    gears = [v.gear for v in line_up(scenario("emu_vertical")).vehicles[7:5:-1]]  # a trailer and a motor car
    trailer, motor = ([f"{f:.2f}" for f in gear.frequencies.values()] for gear in gears if gear is not None)
    assert trailer == ["0.75", "0.84", "5.99", "7.10"]
    assert motor == ["0.84", "0.97", "6.27", "4.78"]
    page = " ".join(read("docs/validation.md").split())
    assert "trailer 0.75 and 0.84 Hz, of the motor car 0.84 and 0.97 Hz" in page
    assert "for the motor car 6.27 and 4.78 Hz" in page


# the page


def test_an_answer_of_the_page_is_that_of_the_file():
    """Breaks if the page tells other numbers of the metro than the file that ships gives; the rest takes minutes."""
    assert cells("`b_type_vertical`", "stated", *answers("b_type_vertical", {})) in read(PAGE)


@pytest.mark.thorough
@pytest.mark.parametrize("table", TABLES)
def test_a_table_of_the_page_is_what_the_files_give(table):
    """Breaks if the page tells other numbers than the files that ship give."""
    page = read(PAGE).splitlines()
    wrong = [row for row in TABLES[table]() if row not in page]
    assert not wrong, "the files give:\n" + "\n".join(wrong)


def said_of_steps() -> str:
    """What the page says of its table of time steps, by that table."""
    found: dict[tuple[str, str], dict[str, list[float]]] = {}
    for row in read(PAGE).splitlines():
        cell = [c.strip() for c in row.strip("|").split("|")]
        if len(cell) == 7 and cell[0].strip("`") in TRAINS and cell[2][:1].isdigit():
            found.setdefault((cell[0], cell[1]), {})[cell[2]] = [float(c) for c in cell[3:]]
    assert len(found) == 6
    ts, step, lift, _ = (max(abs(s["0.25"][n] - s["0.05"][n]) for s in found.values()) for n in range(4))
    _, coarse, _, load = (max(abs(s["0.5"][n] - s["0.05"][n]) for s in found.values()) for n in range(4))
    assert lift <= 0.1
    assert step <= 0.5
    return (
        f"From 0.05 to 0.25 ms lifts move by at most {lift:.2f} mm, steps by {step:.2f} mm and TS by {ts:.2f} mm; with "
        f"0.5 ms steps move by at most {coarse:.2f} mm and the least load by {load:.4f}."
    )


def test_the_step_that_ships_is_as_fine_as_the_page_says():
    """Breaks if the table of steps misses the bar, 0.1 mm of lift and 0.5 mm of step, or the page says otherwise."""
    assert said_of_steps() in " ".join(read(PAGE).split())
    assert all(scenario(name).simulation.step_ms == 0.25 for name in TRAINS)


@pytest.mark.thorough
def test_the_margin_of_the_page_is_that_of_the_file():
    """Breaks if the page tells another factor on the ties of the front than the command finds."""
    (margin,) = trainmj.margins(scenario("b_type_vertical"))
    assert f"down to {margin.factor:.3f} of what is stated" in " ".join(read(PAGE).split())
