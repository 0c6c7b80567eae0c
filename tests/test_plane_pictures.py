"""The vertical plane in pictures, films, the animation of the page, and the exported model."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from builders import planar
from PIL import Image

from trainmj.collision import kernel, simulation
from trainmj.collision.block import Layout
from trainmj.collision.lineup import line_up
from trainmj.collision.model import build, stand_in_of
from trainmj.collision.simulation import start
from trainmj.collision.wear import Wear, seen_at
from trainmj.errors import EngineError
from trainmj.single.page_animation import animation_data
from trainmj.view import film, offscreen
from trainmj.view.scene import export, visible
from trainmj.view.shapes import Shapes, largest_energy

SMALL = (192, 108)
HIGHER = {"collision.offset_mm": {"M": 40}, "collision.speed_km_h": 15, "simulation.step_ms": 0.5}


@pytest.fixture(scope="module")
def result():
    return simulation.run(planar({**HIGHER, "simulation.time_limit_s": 0.45}))


@pytest.fixture(scope="module")
def drawn(result):
    """The scene at the largest step of the front, and the sample of that."""
    chain = result.chain
    model = visible(chain).compile()
    data, wear, shapes = mujoco.MjData(model), Wear(chain), Shapes(model, chain, largest_energy(result))
    at = int(np.abs(result.step[:, chain.front]).argmax())
    for sample in range(at + 1):
        wear.update(seen_at(result, sample))
    shapes.show(wear)
    data.qpos[:] = result.dof[at]
    mujoco.mj_kinematics(model, data)
    return model, data, at


def corners(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> np.ndarray:
    geom = model.geom(name).id
    mesh = model.geom_dataid[geom]
    first = model.mesh_vertadr[mesh]
    own = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    return own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def test_vehicles_are_drawn_where_the_result_says(result, drawn):
    """Breaks if a car body is drawn level, or turned about another point than its centre of gravity."""
    model, data, at = drawn
    chain, designed = result.chain, mujoco.MjData(model)
    mujoco.mj_kinematics(model, designed)
    tilted = 0.0
    for i, vehicle in enumerate(chain.vehicles):
        x, z, pitch = result.dof[at, chain.first_dof[i] :][:3]
        level, now = (corners(model, one, f"{vehicle.name} shell")[:, [0, 2]] for one in (designed, data))
        middle = np.array([designed.body(vehicle.name).xpos[0], vehicle.gear.cog_height + vehicle.gear.offset])
        turned = (level - middle) @ np.array([[np.cos(pitch), np.sin(pitch)], [-np.sin(pitch), np.cos(pitch)]])
        assert now == pytest.approx(middle + np.array([x, z]) + turned, abs=1e-5)
        assert level[:, 1].max() == pytest.approx(3.76 + vehicle.gear.offset, abs=1e-4), "on the rails as designed"
        tilted = max(tilted, np.ptp((now - level)[:, 1]))
    assert tilted > 0.1


def test_wheelsets_are_drawn_where_the_result_says(result, drawn):
    """Breaks if wheels follow the body and not their own joints, or hang above the rails where a vehicle is higher."""
    model, data, at = drawn
    chain = result.chain
    for n, (i, k) in enumerate(chain.wheelsets):
        gear = chain.vehicles[i].gear
        placed = gear.placed(result.dof[at, chain.first_dof[i] :][:11])
        shape = chain.name_of_wheelset(i, k)
        own = corners(model, data, shape)
        assert data.geom(shape).xpos[2] == pytest.approx(placed.z[[2, 3, 5, 6][k]], abs=1e-6)
        assert own[:, 2].min() == pytest.approx(result.wheel_rise[at, n], abs=1e-3)
    assert result.wheel_rise[at].max() > 5e-3


def test_couplers_meet_on_the_line_between_their_pins(result, drawn):
    """Breaks if the heads of two coupled struts are drawn at different heights."""
    model, data, at = drawn
    assert result.step[at, result.chain.front] > 0.2
    for left, right in (("M1 front", "S1 rear"), ("M2 front", "M1 rear"), ("S1 front", "S2 rear")):
        faces = []
        for end, sign in ((left, 1.0), (right, -1.0)):
            head, tube = data.geom(f"{end} coupler head"), data.geom(f"{end} coupler tube")
            faces.append(head.xpos + sign * head.xmat.reshape(3, 3)[:, 0] * model.geom(head.name).size[0])
            along = head.xmat.reshape(3, 3)[:, 0]
            assert np.cross(along, head.xpos - tube.xpos)[1] == pytest.approx(0.0, abs=1e-9), "in one line"
        assert faces[0] == pytest.approx(faces[1], abs=1e-3)


def test_faces_are_as_high_as_they_overlap(result, drawn):
    """Breaks if a picture shows anti-climbers that still hold each other where they have slid off."""
    model, data, at = drawn
    plates = [f"{end} anti-climber 1 left plate" for end in ("M1 front", "S1 rear")]
    assert [2.0 * model.geom(plate).size[2] for plate in plates] == pytest.approx([0.12, 0.12])
    step = data.geom(plates[0]).xpos[2] - data.geom(plates[1]).xpos[2]
    assert step == pytest.approx(result.step[at, result.chain.front], abs=0.02)


def test_shadows_stay_on_the_ground(result, drawn):
    """Breaks if a pitching vehicle lifts its shadow through the rails."""
    model, data, _ = drawn
    for vehicle in result.chain.vehicles:
        height = corners(model, data, f"{vehicle.name} shade")[:, 2]
        assert height.max() == pytest.approx(-0.145, abs=1e-5)
        assert np.ptp(height) == pytest.approx(0.005, abs=1e-5)


def test_pictures_tell_step_and_lift(result):
    """Breaks if a viewer has to guess motion that is too small to be seen."""
    wear, last = Wear(result.chain), len(result.time) - 1
    rows = dict(film._rows(result, last, wear))
    assert rows["front step"] == f"{1e3 * result.step[-1, result.chain.front]:.0f} mm"
    assert rows["lift so far"] == f"{1e3 * result.lift.max():.1f} mm"


@pytest.mark.thorough
def test_film_and_still_show_the_pitch(result, tmp_path):
    """Breaks if pictures show vehicles level."""
    try:
        offscreen.check_platform()
    except EngineError as error:
        pytest.skip(str(error))
    level = result.dof.copy()
    for first, end in pairwise(result.chain.first_dof):
        level[:, first + 1 : end] = 0.0
    seen = []
    for name, one in (("moving", result), ("level", replace(result, dof=level))):
        film.render(one, tmp_path / f"{name}.png", "front", size=SMALL, at=0.416, smooth=False)
        seen.append(np.asarray(Image.open(tmp_path / f"{name}.png").convert("RGB"), dtype=int))
    assert np.abs(seen[0] - seen[1]).mean() > 2
    frames = film.render(result, tmp_path / "a.webp", slow=1.0, fps=4, size=SMALL, smooth=False)
    with Image.open(tmp_path / "a.webp") as picture:
        assert picture.n_frames == frames


def test_shapes_change_no_number(result):
    """Breaks if what is drawn has mass, or touches."""
    chain, ends = result.chain, []
    layout = Layout.of(chain)
    with kernel.installed():
        for model in (visible(chain, layout).compile(), build(chain, layout, bare=True)):
            data = start(model, chain, layout)
            mujoco.mj_step(model, data, nstep=200)
            ends.append((data.qpos.copy(), data.userdata.copy()))
    for seen, bare in zip(*ends, strict=True):
        assert np.array_equal(seen, bare)


def test_the_animation_has_the_rises_of_the_result(result):
    """Breaks if the page shows another step or lift than the tables."""
    content, chain = animation_data(result), result.chain
    rises, frames = np.array(content["rises"]), np.array(content["time"])
    step = np.interp(frames, result.time, 1e3 * result.step[:, chain.front])
    assert rises[chain.front, 1] - rises[chain.front + 1, 0] == pytest.approx(step, abs=0.2)
    assert np.array(content["wheels"]).shape == (12, 4, len(frames))
    assert np.max(content["wheels"]) == pytest.approx(1e3 * result.wheel_rise.max(), abs=0.5)


# export


@pytest.fixture(scope="module")
def exported():
    chain = line_up(planar({**HIGHER, "collision.speed_km_h": 25, "collision.pitch_mrad": {"M1": 5}}))
    text = export(chain)
    return chain, text, mujoco.MjModel.from_xml_string(text)


def test_an_export_stands_by_itself(exported):
    """Breaks if springs, contacts and weight of the exported model are out of balance."""
    chain, _, model = exported
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert data.qpos == pytest.approx(chain.start_qpos, abs=1e-6)
    data.qvel[:] = 0.0
    mujoco.mj_step(model, data, nstep=round(0.5 / model.opt.timestep))
    assert data.qpos == pytest.approx(chain.start_qpos, abs=1e-4)
    assert data.ncon == 2 * len(chain.wheelsets)


def test_an_export_collides_and_pitches(exported):
    """Breaks if stand-ins have no force, act at rail level, or suspensions have no stops."""
    chain, text, model = exported
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    first = np.array(chain.first_dof[:-1])
    momentum, at_rest, pitch = chain.mass @ chain.speed, data.qpos[first + 2], 0.0
    for _ in range(40):
        mujoco.mj_step(model, data, nstep=round(0.02 / model.opt.timestep))
        pitch = max(pitch, np.abs(data.qpos[first + 2] - at_rest).max())
    assert np.isfinite(data.qpos).all()
    assert np.ptp(data.qvel[first]) < 1.5, "both trains move together, or nearly"
    assert chain.mass @ data.qvel[first] == pytest.approx(momentum, rel=1e-3)
    assert 1e-3 < pitch < 0.05
    gear = chain.vehicles[0].gear
    assert model.joint("M1 bogie 1 z").range == pytest.approx([-gear.secondary.lift_stop, gear.secondary.bump_stop])
    front = chain.interfaces[chain.front]
    found = stand_in_of(front, chain.stand_in_speed)
    assert 0.66 < found.heights[0] < 0.95, "between coupler and anti-climber"
    said = " ".join(text.split("-->")[0].split())
    assert f"S1-M1: {found.force / 1e3:.0f} kN, 500 kN/mm, at {found.heights[0]:.3f} m" in said
    for words in ("vertical ties of faces", "that struts turn about their pins", "limits of joints for the stops"):
        assert words in said
