"""Films and stills: shapes at their true places, colours by energy, files whole, clear words where it cannot be."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import get_args

import mujoco
import numpy as np
import pytest
from builders import few
from forked import forked
from PIL import Image

from trainmj.cli import main
from trainmj.collision import simulation
from trainmj.collision.lineup import line_up
from trainmj.collision.summary import summarise
from trainmj.collision.wear import Wear, seen_at
from trainmj.errors import EngineError, InputError, OutputError
from trainmj.scenario import Scenario, load, trains
from trainmj.single import page_animation
from trainmj.view import film, offscreen, parts
from trainmj.view.cameras import Director, reach
from trainmj.view.curves import Line, Panel
from trainmj.view.drawings import DRAWINGS
from trainmj.view.frame import Box, Frame
from trainmj.view.scene import visible
from trainmj.view.shapes import Shapes, colour, largest_energy
from trainmj.view.sheet import INK, Sheet
from trainmj.view.warnings import Warnings

SMALL = (192, 108)


@pytest.fixture(scope="module", autouse=True)
def _draws() -> None:
    try:
        offscreen.check_platform()
    except EngineError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def saved(standard_result, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("rendering") / "result.nc"
    standard_result.save(file)
    return file


@pytest.fixture(scope="module")
def worn(standard_result) -> Wear:
    return worn_by(standard_result)


def worn_by(result) -> Wear:
    wear = Wear(result.chain)
    for sample in range(len(result.time)):
        wear.update(seen_at(result, sample))
    return wear


# wear


def test_total_compression_ends_where_the_summary_says(worn, standard_summary):
    assert worn.TS_mm == pytest.approx(standard_summary.TS_mm, rel=1e-3)


def test_energies_of_devices_are_those_of_the_summary(worn, standard_result, standard_summary):
    front = standard_result.chain.front
    left, right = worn.worn[front, 0].energy, worn.worn[front, 1].energy
    assert worn.energy(front) / 1e3 == pytest.approx(standard_summary.interfaces[0].energy_kJ, rel=1e-3)
    assert left == pytest.approx(right)
    assert worn.energy(front - 1) / 1e3 == pytest.approx(standard_summary.interfaces[1].energy_kJ, rel=1e-3)


def test_stages_of_a_device_share_its_energy_as_their_strokes_tell(worn, standard_result):
    """The coupler takes what lies below its part of the curve, the anti-climber the rest."""
    interface = standard_result.chain.interfaces[standard_result.chain.front]
    coupler, *_ = interface.devices[0].stages
    below = interface.devices[0].envelope.energy(coupler.end)
    assert worn.worn[standard_result.chain.front, 0].energy[0] == pytest.approx(below, rel=0.03)


def test_sides_of_an_unequal_front_share_its_energy_as_the_summary_says():
    result = simulation.run(load("wagon_80t"))
    wear = worn_by(result)
    sides = [i.energy_kJ for i in summarise(result).interfaces if i.name.startswith("S1-M1")]
    found = [wear.worn[result.chain.front, side].energy.sum() / 1e3 for side in (0, 1)]
    assert sum(found) == pytest.approx(sum(sides), rel=1e-3)
    assert found == pytest.approx(sides, rel=1e-3)


def test_more_energy_is_darker():
    """So that the colours are told apart without seeing colour."""
    light = colour(np.linspace(0.04, 1, 50)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) < 0).all()


# shapes


@pytest.mark.parametrize("name", ["b_type", "b_type_wall", "wagon_80t"])
def test_bodies_stand_back_behind_the_faces_of_their_couplers(name):
    chain = line_up(load(name))
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for i, vehicle in enumerate(chain.vehicles):
        body = model.body(vehicle.name).id
        shell = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body and model.geom_type[g] == 7]
        assert shell, "a car body of meshes"
        corners = np.concatenate([_corners(model, data, g) for g in shell])[:, 0] - data.xpos[body, 0]
        assert corners.max() < vehicle.length / 2 - parts.setback(chain, i, 1) + 0.06
        assert corners.min() > -vehicle.length / 2 + parts.setback(chain, i, -1) - 0.06


def _corners(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    mesh = model.geom_dataid[geom]
    start = model.mesh_vertadr[mesh]
    own = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
    return own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def test_devices_meet_at_true_scale_as_they_are_crushed(standard_result):
    """Heads touch while there is force, and the tubes behind them are shorter by their stroke."""
    chain = standard_result.chain
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    wear, devices = Wear(chain), Shapes(model, chain, largest_energy(standard_result))
    tube = model.geom("M1 front coupler tube").id
    at_rest = 2 * model.geom_size[tube, 1]
    coupler = chain.interfaces[chain.front].devices[0].stages[0]
    for sample in range(len(standard_result.time)):
        wear.update(seen_at(standard_result, sample))
        if sample % 50:
            continue
        devices.show(wear)
        data.qpos[:] = standard_result.position[sample]
        mujoco.mj_kinematics(model, data)
        for left, right, k in (("M1 front", "S1 rear", 5), ("M2 front", "M1 rear", 4), ("S1 front", "S2 rear", 6)):
            if standard_result.force[sample, k] > 0:
                a, b = (data.geom(f"{end} coupler head") for end in (left, right))
                half = [model.geom(f"{end} coupler head").size[0] for end in (left, right)]
                assert a.xpos[0] + half[0] == pytest.approx(b.xpos[0] - half[1], abs=1e-9)
        shorter = at_rest - 2 * model.geom_size[tube, 1]
        assert shorter == pytest.approx(min(wear.shown(chain.front, 0), coupler.end), abs=1e-9)
    assert shorter == pytest.approx(coupler.end), "sheared off at the end of its stage"
    energy = 255 * model.geom_rgba[tube, :3]
    assert energy == pytest.approx(
        255 * colour(wear.worn[chain.front, 0].energy[0] / largest_energy(standard_result)), abs=1
    )


DRAWN = {
    "curves": {"tube": {"stroke_mm": [0, 1, 300], "force_kN": [0, 900, 900]}},
    "devices": {
        "tube": {"curve": "tube", "stiffness_kN_per_mm": 300, "beyond": "car_body"},
        "oil": {
            "kind": "gas_hydraulic",
            "stroke_mm": 400,
            "orifice_kN_s2_per_m2": 20,
            "gas": {"force_kN": 50, "length_mm": 480, "exponent": 1.3, "preload_stiffness_kN_per_mm": 100},
            "rebound_orifice_kN_s2_per_m2": 400,
            "beyond": {"kind": "stop", "stiffness_kN_per_mm": 100},
        },
        "gear": {
            "kind": "hysteresis",
            "loading": {"stroke_mm": [0, 100], "force_kN": [50, 1000]},
            "unloading": {"stroke_mm": [0, 100], "force_kN": [10, 200]},
            "transition_stiffness_kN_per_mm": 250,
            "beyond": {"kind": "stop"},
            "pull": {"stiffness_kN_per_mm": 5, "slack_mm": 20},
        },
    },
    "trains": {
        "train": {"vehicles": 2, "mass_t": 36, "length_m": 20, "front": "tube", "rear": "oil", "coupler": "gear"},
        "loco": {"vehicles": 1, "mass_t": 80, "length_m": 17, "front": "oil", "drawing": "locomotive"},
        "wagons": {"vehicles": 2, "mass_t": 20, "length_m": 14, "front": "oil", "coupler": "gear", "drawing": "wagon"},
        "unit": {
            "vehicles": [{"name": "unit", "length_m": 44}, {"name": "coach", "length_m": 26, "drawing": "coach"}],
            "mass_t": 60,
            "front": "oil",
            "coupler": "gear",
            "drawing": "regional",
        },
    },
    "obstacles": {
        "lorry": {"mass_t": 15, "length_m": 8, "front": "tube", "rail_friction": 0.3},
        "block": {"mass_t": 3, "length_m": 4, "front": "tube", "drawing": "block"},
        "stop": {"fixed": True, "front": "oil"},
    },
    "collision": {"train": "train", "speed_km_h": 36, "partner": "loco"},
    "simulation": {"time_limit_s": 0.6},
}


def drawn(partner: str, **more):
    return simulation.run(Scenario.from_values(DRAWN).with_values({"collision.partner": partner, **more}))


@pytest.mark.parametrize("partner", few(["train", "lorry", "stop", "unit", "loco", "wagons", "block"], 3))
def test_every_drawing_stands_where_it_is_struck(partner, tmp_path):
    """Breaks if a train or obstacle is not drawn, or its device does not reach to the place of contact."""
    result = drawn(partner)
    chain = result.chain
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    (struck,) = (end for end in parts.ends(chain) if (end.interface, end.side) == (chain.front, 1))
    reach = [data.geom(part.name).xpos[0] - 0.5 * (part.end - part.start) for part in struck.parts]
    assert min(reach) == pytest.approx(0.0, abs=1e-9)
    film.render(result, tmp_path / "a.png", "front", size=SMALL, at=0.0, smooth=False)
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB"), dtype=int)
    assert (np.abs(picture - (205, 141, 0)).sum(axis=2) < 110).sum() > 20, "in the colour of partners"


def test_drawings_differ(tmp_path):
    """Breaks if a locomotive, a wagon or a lorry looks like a passenger car."""
    seen = set()
    partners = ("train", "unit", "loco", "wagons", "lorry", "block")
    for partner in partners:
        chain = line_up(Scenario.from_values(DRAWN).with_values({"collision.partner": partner}))
        model = visible(chain).compile()
        shapes = [model.geom(g).name for g in range(model.ngeom) if model.geom(g).name.startswith("S1 ")]
        seen.add(frozenset((name, int(model.mesh_vertnum[model.geom(name).dataid[0]])) for name in shapes))
    assert len(seen) == len(partners)


def test_whatever_a_file_may_state_is_drawn():
    """Breaks if a name that scenarios take has no drawing in films, or none in the animation of the report."""
    stated = {*get_args(trains.Drawing), *get_args(get_args(trains.ObstacleSpec.model_fields["drawing"].annotation)[0])}
    assert stated == set(DRAWINGS)
    script = Path(page_animation.__file__).with_name("templates").joinpath("animation.js").read_text(encoding="utf-8")
    for name in stated:
        assert f"    {name}: (g, w" in script or f"drawings.{name} = " in script


@pytest.mark.parametrize(
    ("partner", "drawings"),
    [
        ("wagon_80t", ["wagon"]),
        ("regional_129t", ["regional"]),
        ("obstacle_15t", ["lorry"]),
        ("obstacle_3t", ["block"]),
        ("locomotive_led_train", ["locomotive", *["coach"] * 5]),
    ],
)
def test_shipped_partners_are_drawn_as_what_they_are(partner, drawings):
    """Breaks if a partner is drawn as the train that strikes it, or a vehicle loses what it states for itself."""
    chain = line_up(load("b_type", {"collision.partner": partner}))
    assert [v.drawing for v in chain.vehicles[chain.n_moving :]] == drawings
    assert {v.drawing for v in chain.vehicles[: chain.n_moving]} == {"passenger"}


def test_what_recovers_comes_back_and_what_was_crushed_stays_short():
    """Breaks if a film shows a buffer that has come back as crushed, or a crush tube as new."""
    result = drawn("loco", **{"simulation.time_limit_s": 2.0})
    wear, chain = worn_by(result), result.chain
    assert result.stroke[-1, chain.front] < -0.1, "they are apart"
    assert result.of_device("stroke", chain.front, 1).max() > 0.2
    assert wear.shown(chain.front, 1) < 0.02
    left = result.of_device("stroke", chain.front, 0)
    assert left.max() - 0.01 < wear.shown(chain.front, 0) <= left.max()


def test_a_draw_gear_holds_couplers_together_until_it_breaks():
    """Breaks if a film shows a gap between coupled vehicles, or none where the gear has broken."""
    for force, together in ((1e4, True), (60.0, False)):
        path = "devices.gear.pull.breaking_force_kN"
        result = drawn("wagons", **{path: force})
        wear = Wear(result.chain)
        k = next(k for k, i in enumerate(result.chain.interfaces) if i.name == "S1-S2")
        lowest = int(result.stroke[:, k].argmin())
        for sample in range(lowest + 1):
            wear.update(seen_at(result, sample))
        assert result.stroke[lowest, k] < -0.021
        gap = 2 * wear.shown(k, 0) - result.stroke[lowest, k]
        assert (abs(gap) < 1e-9) == together


def test_a_car_body_gives_way_at_its_own_end_and_takes_the_colour():
    """Breaks if car bodies run into each other, or the energy of a body is shown on its anti-climbers."""
    result = drawn("lorry", **{"collision.speed_km_h": 80, "trains.train.mass_t": 80})
    chain, full = result.chain, largest_energy(result)
    model = visible(chain).compile()
    shapes, wear = Shapes(model, chain, full), worn_by(result)
    (end,) = (end for end in parts.ends(chain) if (end.interface, end.side) == (chain.front, 0))
    skin = model.geom(f"{end.body.name} skin")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = _corners(model, data, skin.id)[:, 0].max()
    moved = shapes.show(wear)
    given = wear.worn[chain.front, 0].used[-1]
    assert given > 0.05
    assert int(skin.dataid[0]) in moved
    assert before - _corners(model, data, skin.id)[:, 0].max() == pytest.approx(
        end.body.shorter(wear.shown(chain.front, 0)), abs=1e-5
    )
    assert 0.8 * given < end.body.shorter(wear.shown(chain.front, 0)) <= given
    share = wear.worn[chain.front, 0].energy[-1] / full
    assert model.geom_rgba[skin.id, :3] == pytest.approx(colour(share), abs=1e-6)
    assert shapes.show(wear) == [], "nothing has moved since"


# what is written


def told(result, size: tuple[int, int], at: float = 1e9, marks: list[str] | None = None):
    """The sheet of a picture at a time, without drawing the scene, and the overlay that wrote it."""
    chain, full = result.chain, largest_energy(result)
    ends = reach(chain, result.point_position)
    frame = Frame.of(*size, ends[1] - ends[0])
    director = Director("overview", chain, frame, ends)
    wear, marked = Wear(chain), Warnings(result)
    overlay = film.overlay_of(result, frame, "0.1 x real time", full, marked)
    sample = int(np.abs(result.time - at).argmin())
    for k in range(sample + 1):
        wear.update(seen_at(result, k))
        marked.follow(float(result.time[k]), wear)
    said = film.said_at(result, sample, wear, marked, director, full)
    if marks is not None:
        said, overlay = replace(said, marks=marks), replace(overlay, marked=len(marks))
    return overlay.written(np.full((size[1], size[0], 3), 200, dtype=np.uint8), said), overlay


LONG = {"trains.b_type.vehicles": 60, "simulation.time_limit_s": 0.02}
SIZES = [(640, 360), (360, 640), (1280, 720), (1920, 1080), (600, 900), (720, 720), (1200, 400), (192, 108), (64, 64)]


@pytest.fixture(scope="module")
def of_length(standard_result):
    return {6: standard_result, 60: simulation.run(load("b_type", LONG))}


@pytest.mark.parametrize(("vehicles", "size"), [*((6, size) for size in SIZES), (60, (640, 360)), (60, (600, 900))])
def test_texts_never_overlap(of_length, vehicles, size):
    """Breaks if texts cover each other or leave the picture, or what a client must see has no room."""
    sheet, overlay = told(
        of_length[vehicles], size, 0.15, marks=["not valid after 0.1 s: " + "override at M1-S1 " * 9] * 2
    )
    boxes = [box for _, box in sheet.texts]
    assert not [pair for pair in combinations(boxes, 2) if pair[0].meets(pair[1])]
    assert not [pair for pair in combinations(sheet.plates, 2) if pair[0].meets(pair[1])]
    assert all(Box(0, 0, *size).holds(box) for box in (*boxes, *sheet.plates))
    texts = [text for text, _ in sheet.texts]
    if min(size) >= 360:
        assert {"M1", "S1", "force at the front [kN]", "speed [km/h]", "time [s]", "TS so far"} <= set(texts)
        assert any(text.startswith("not valid after") for text in texts)
        assert any(text.startswith("absorbed energy [kJ]") for text in texts)
        assert any(text.startswith("Six-car") for text in texts)
        if vehicles == 6:
            energies = [box for text, box in sheet.texts if overlay.frame.energies.holds(box) and text]
            assert len(energies) == 11
    assert size == (64, 64) or any(text.endswith(" s") for text in texts)


def test_parts_of_a_picture_fill_it():
    """Breaks if parts of a picture overlap, or leave no scene."""
    for size in ((w, h) for w in range(64, 2000, 197) for h in range(64, 2000, 189)):
        for extent in (20.0, 300.0, 8000.0):
            frame = Frame.of(*size, extent)
            rows = [frame.header, frame.scene, frame.strip, frame.names, frame.energies, *frame.curves]
            assert sum(row.width * row.height for row in rows) == size[0] * size[1]
            assert not [pair for pair in combinations(rows, 2) if pair[0].meets(pair[1])]
            assert frame.scene.height >= 0.34 * size[1]


def test_names_stand_below_their_vehicles():
    """Breaks if the words below the strip are not where MuJoCo draws the vehicles."""
    result = drawn("wagons", **{"simulation.time_limit_s": 0.3})
    chain, last = result.chain, len(result.time) - 1
    data = mujoco.MjData(visible(chain).compile())
    data.qpos[:] = result.point_position[last]
    mujoco.mj_kinematics(data.model, data)
    ends = reach(chain, result.point_position)
    director = Director("overview", chain, Frame.of(1000, 600, ends[1] - ends[0]), ends)
    _, strip = director.views(result.point_position[last])
    shown = strip.height * 1000 / strip.place[3]
    left, right = director.faces(result.point_position[last])
    for i, vehicle in enumerate(chain.vehicles):
        across = (data.body(vehicle.name).xpos[0] - strip.target[0]) / shown + 0.5
        assert 0.5 * (left + right)[i] == pytest.approx(1000 * across)


def test_the_camera_stays_at_the_front_and_the_strip_stands_still(of_length):
    """Breaks if the front leaves the picture, or the whole train does not move in the strip."""
    result = drawn("loco")
    ends = reach(result.chain, result.point_position)
    frame = Frame.of(1280, 720, ends[1] - ends[0])
    director = Director("overview", result.chain, frame, ends)
    scenes, strips = zip(*(director.views(position) for position in result.point_position[::50]), strict=True)
    meeting = result.point_position[::50, 1:3].mean(axis=1)
    assert [view.target[0] for view in scenes] == pytest.approx(meeting)
    assert np.ptp(meeting) > 1
    assert len({view.target[0] for view in strips}) == 1
    left, right = director.faces(result.point_position[-1])
    assert left.min() > 0
    assert right.max() < 1280
    long = of_length[60]
    ends = reach(long.chain, long.point_position)
    director = Director("overview", long.chain, Frame.of(640, 360, ends[1] - ends[0]), ends)
    left, right = director.faces(long.point_position[-1])
    assert right[long.chain.front] == pytest.approx(320, abs=2), "of a train that is too long, what is near the impact"
    assert left.min() < 0


def test_what_is_passed_is_said_from_then_on():
    """Breaks if a frame says too early or too late that a limit is passed or numbers are not valid."""
    fast = {"collision.speed_km_h": 80, "trains.train.mass_t": 80}
    for more, words, of_end in (
        ({"devices.tube.stroke_limit_mm": 150}, "stroke limit of 150 mm passed: S1-M1", 0.15),
        ({}, "car body gives way: S1-M1", 0.301),
        ({"devices.tube.beyond": None}, "not valid after", None),
    ):
        result = drawn("lorry", **fast, **more)
        stroke = result.of_device("stroke", result.chain.front, 0)
        since = result.tally.valid_until if of_end is None else result.time[int((stroke > of_end).argmax())]
        assert 0 < since < result.time[-1]
        first = int((result.time >= since).argmax())
        before, after = (told(result, (640, 360), result.time[k])[0].texts for k in (first - 1, first))
        assert any(words in text for text, _ in after), after
        assert not any(words in text for text, _ in before)


def test_a_limit_on_the_whole_collision_is_said_at_its_end():
    """Breaks if a film shows a mean deceleration as passed before its window has closed, or never."""
    result = simulation.run(load("b_type", {"limits": {"mean_deceleration_g": 0.1}, "simulation.time_limit_s": 0.1}))
    words = [[text for text, _ in told(result, (640, 360), at)[0].texts] for at in (0.09, 0.1)]
    assert [any("limit passed: mean deceleration" in text for text in texts) for texts in words] == [False, True]


def test_curves_run_up_to_the_cursor(standard_result):
    """Breaks if a curve shows another time than the picture, or the values beside it are those of another one."""
    sheet, overlay = told(standard_result, (1280, 720), 0.3)
    force = standard_result.force[int(np.abs(standard_result.time - 0.3).argmin()), standard_result.chain.front]
    assert f"{force / 1e3:.0f}" in [text for text, _ in sheet.texts]
    box = overlay.frame.curves[0]
    dark = np.asarray(sheet.image.convert("L"), dtype=int)[int(box.top) + 35 : int(box.bottom) - 30, 60:610] < 90
    share = np.flatnonzero(dark.any(axis=0)).max() / 565
    assert share == pytest.approx(0.3 / standard_result.time[-1], abs=0.02)


@pytest.mark.parametrize("values", [(0.0, 900.0, 900.0), (0.0, 0.0, 900.0)], ids=["above", "below"])
def test_no_curve_strikes_out_that_it_is_not_valid(values):
    """Breaks if "not valid" is written where a force that is held behind its curve runs through it."""
    line = Line("", np.repeat(values, 20), INK)
    panel = Panel(Box(0, 0, 340, 140), 1.0, "force", "kN", np.linspace(0.0, 1.0, 60), [line], 0.4)
    sheet = Sheet(Image.new("RGB", (340, 140)))
    panel.show(sheet, 59)
    (box,) = [box for text, box in sheet.texts if text == "not valid"]
    pixels = np.asarray(sheet.image.convert("L"), dtype=int)
    assert (pixels[int(box.top) : int(box.bottom), int(box.left) : int(box.right)].min(axis=1) >= 60).all()


# pictures


def test_film_shows_the_whole_collision_at_its_pace(standard_result, tmp_path):
    file = tmp_path / "crash.webp"
    told: list[int] = []
    frames = film.render(standard_result, file, slow=0.5, fps=5, size=SMALL, smooth=False, watch=told.append)
    with Image.open(file) as picture:
        assert picture.n_frames == frames == told[-1]
        assert picture.size == SMALL
        shown = [0.0] * frames
        first, last = (np.asarray(_at(picture, k).convert("RGB"), dtype=int) for k in (0, frames - 1))
        for k in range(frames):
            picture.seek(k)
            picture.load()
            shown[k] = picture.info["duration"]
    assert shown[:-1] == [200] * (frames - 1)
    assert frames == int(standard_result.time[-1] / 0.1) + 1 or frames == int(standard_result.time[-1] / 0.1) + 2
    assert np.abs(first - last).mean() > 3, "it moves"
    assert os.listdir(tmp_path) == ["crash.webp"], "nothing else is left"


def _at(picture: Image.Image, frame: int) -> Image.Image:
    picture.seek(frame)
    return picture.copy()


@pytest.mark.thorough
def test_mp4_has_every_frame(standard_result, tmp_path):
    av = pytest.importorskip("av")
    file = tmp_path / "crash.mp4"
    frames = film.render(standard_result, file, "front", slow=0.5, fps=5, size=SMALL, smooth=False)
    with av.open(str(file)) as container:
        decoded = [f.to_image() for f in container.decode(video=0)]
    assert len(decoded) == frames + 5, "it rests for a second on the last one"
    assert decoded[0].size == SMALL


@pytest.mark.parametrize("position", [np.nan, np.inf, 1e300])
def test_vehicles_that_are_nowhere_are_not_drawn(standard_result, tmp_path, position):
    """Breaks if a run that became unstable, or a forged result, ends in a traceback of the package that draws."""
    lost = replace(standard_result, point_position=np.full_like(standard_result.point_position, position))
    with pytest.raises(InputError, match="cannot be drawn"):
        film.render(lost, tmp_path / "still.png")


def _still(result, tmp_path: Path, camera: str, at: float | None) -> np.ndarray:
    film.render(result, tmp_path / "frame.png", camera, size=(480, 270), at=at, smooth=False)
    return np.asarray(Image.open(tmp_path / "frame.png").convert("RGB"), dtype=int)


@pytest.mark.parametrize("camera", few(film.CAMERAS, 1))
def test_every_camera_sees_both_trains(standard_result, tmp_path, camera):
    picture = _still(standard_result, tmp_path, camera, 0.0)
    for livery in ((0, 103, 160), (205, 141, 0)):
        assert (np.abs(picture - livery).sum(axis=2) < 80).sum() > 40


def test_crushed_devices_change_colour(standard_result, tmp_path):
    red = []
    for at in (0.0, 0.3):
        picture = _still(standard_result, tmp_path, "front", at)[60:200, 150:330]
        r, g, b = np.moveaxis(picture, 2, 0)
        red.append(((r > 120) & (g < 0.6 * r) & (b < 0.4 * r)).sum())  # more so than the livery
    assert red[0] == 0
    assert red[1] > 100


def test_saved_results_are_shown_without_simulating(saved, standard_result, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(simulation, "run", lambda _: pytest.fail("simulated again"))
    for source in (saved, saved.parent):
        with pytest.raises(SystemExit) as stop:
            main(["render", str(source), "--out", str(tmp_path / "a.png"), "--size", "192x108", "--fast"])
        assert stop.value.code == 0
    film.render(standard_result, tmp_path / "b.png", size=SMALL, smooth=False)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes(), "the same picture, byte by byte"


# mistakes and faults


@pytest.mark.parametrize(
    ("file", "more", "error", "words"),
    [
        ("a.gif", {}, InputError, "must be|ends in .webp or .mp4"),
        ("a", {}, InputError, "no ending"),
        ("a.mp4", {"size": (193, 108)}, InputError, "must be even"),
        ("a.png", {"size": (10, 10)}, InputError, "from 64x64"),
        ("a.png", {"at": 99.0}, InputError, "followed from 0 to"),
        ("a.webp", {"at": 0.1}, InputError, "end in .png"),
        ("a.webp", {"slow": 0.0}, InputError, "times real time"),
        ("a.webp", {"slow": float("nan")}, InputError, "times real time"),
        ("a.webp", {"fps": 1e9}, InputError, "frames a second"),
        ("a.png", {"camera": "roof"}, InputError, "overview, front, follow"),
        ("missing/a.png", {}, OutputError, "there is no folder"),
    ],
)
def test_what_cannot_be_drawn_is_refused(standard_result, tmp_path, file, more, error, words):
    with pytest.raises(error, match=words):
        film.render(standard_result, tmp_path / file, **more)
    assert not list(tmp_path.iterdir())


def test_a_film_without_its_package_is_refused_before_anything_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(film, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"pip install 'trainmj\[film\]'"):
        film.check(tmp_path / "a.mp4", "front", 1.0, SMALL)
    film.check(tmp_path / "a.webp", "front", 1.0, SMALL)


def test_results_cannot_be_changed(saved, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["render", str(saved), "--out", str(tmp_path / "a.png"), "--set", "mass_t=33"])
    assert stop.value.code == 2
    assert "cannot be changed" in capsys.readouterr().err


def test_an_interrupted_film_leaves_the_old_file(standard_result, tmp_path):
    file = tmp_path / "crash.webp"
    file.write_text("old")

    def stop(done: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film.render(standard_result, file, slow=0.5, fps=5, size=SMALL, smooth=False, watch=stop)
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == ["crash.webp"]


def _process(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own, after some code."""
    code += "\nfrom trainmj.cli import main\nmain()"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        env={k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")} | environment,
    )


@pytest.mark.thorough
@pytest.mark.parametrize("ending", ["webp", "mp4"])
def test_a_full_disk_leaves_the_old_file(saved, tmp_path, ending):
    """Files may not grow beyond 2 kB in that process, which is what a full disk does."""
    if ending == "mp4":
        pytest.importorskip("av")
    file = tmp_path / f"crash.{ending}"
    file.write_text("old")
    words = ("render", saved, "--out", file, "--size", "192x108", "--slow", "1", "--fast")
    done = forked(tmp_path, *words, prepare=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048)))
    assert done.returncode == 2
    assert "cannot be written (File too large)" in done.stderr
    assert "Traceback" not in done.stderr
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == [file.name]


@pytest.mark.thorough
def test_without_osmesa_the_package_is_named(saved, tmp_path):
    """The loader is made to fail as it does where the library is not installed."""
    code = """
import ctypes, ctypes.util
load, find = ctypes.CDLL.__init__, ctypes.util.find_library
def hidden(self, name, *more, **options):
    if name and "osmesa" in name.lower():
        raise OSError(f"{name}: cannot open shared object file")
    return load(self, name, *more, **options)
ctypes.CDLL.__init__ = hidden
ctypes.util.find_library = lambda name: None if "osmesa" in name.lower() else find(name)
"""
    file = tmp_path / "a.png"
    done = _process(code, "render", str(saved), "--out", str(file), MUJOCO_GL="osmesa")
    assert done.returncode == 2
    assert "apt install libosmesa6" in done.stderr
    assert "Traceback" not in done.stderr
    assert not file.exists()


@pytest.mark.thorough
def test_without_a_screen_the_viewer_says_so():
    done = _process("", "view", "b_type")
    assert done.returncode == 2
    assert "needs a screen" in done.stderr
    assert "trainmj render" in done.stderr
    assert "Traceback" not in done.stderr
