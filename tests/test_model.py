"""From a chain to a MuJoCo model: every configured number arrives, and the export opens elsewhere."""

from __future__ import annotations

from contextlib import nullcontext
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from builders import ALONG, SHIPPED
from builders import scenario as small

from trainmj.collision import kernel
from trainmj.collision.block import Layout
from trainmj.collision.chain import Chain
from trainmj.collision.fields import Element, Point
from trainmj.collision.lineup import line_up
from trainmj.collision.model import MOTION, SENSED, build, spec, stand_in_of
from trainmj.collision.simulation import start
from trainmj.files.resources import shipped_folder
from trainmj.scenario import Scenario, load
from trainmj.view.scene import export, visible

TABLE_2 = [34.08, 36.26, 36.26, 36.26, 36.26, 34.08]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """Table 2's scenario 1, with values that are nobody's defaults."""
    return load(
        "b_type_scenario_1",
        {
            "collision.gap_mm": 250,
            "collision.partner_speed_km_h": -5,
            "simulation.step_ms": 0.05,
            "trains.b_type.length_m": 19.5,
            "trains.b_type.vehicles.2.length_m": 21.0,
            "devices.coupler_a_b.stiffness_kN_per_mm": 3000,
            "devices.coupler_a_b.damping_kN_s_per_m": 20000,
        },
    )


@pytest.fixture(scope="module")
def case(scenario: Scenario) -> Chain:
    return line_up(scenario)


@pytest.fixture(scope="module")
def model(case: Chain) -> mujoco.MjModel:
    return build(case)


def test_vehicles_arrive_with_name_mass_and_place(case, model):
    names = ["M6", "M5", "M4", "M3", "M2", "M1", "S1", "S2", "S3", "S4", "S5", "S6"]
    assert [model.body(i).name for i in range(1, model.nbody)] == names
    assert [model.joint(i).name for i in range(model.njnt)] == names
    assert model.body_mass[1:] / 1e3 == pytest.approx(TABLE_2[::-1] + TABLE_2)
    assert (model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE).all()
    assert (model.jnt_axis == [1, 0, 0]).all()
    lengths = [19.5, 19.5, 21.0, 19.5, 19.5, 19.5]
    front = np.cumsum([0, *lengths])
    middles = (front[1:] + front[:-1]) / 2
    x = model.body_pos[1:, 0]
    assert x[6:] == pytest.approx(middles), "the partner's struck end is at x = 0"
    assert -x[5::-1] == pytest.approx(middles + 0.25), "the moving train stands its gap away"


def test_nothing_else_acts_on_the_vehicles(model):
    """MuJoCo's own springs, dashpots, rail friction or limits would add to the device law unseen."""
    assert model.nq == model.nv == 12
    for field in ("dof_damping", "dof_frictionloss", "dof_armature", "jnt_stiffness", "tendon_stiffness"):
        assert (getattr(model, field) == 0).all(), field
    for field in ("tendon_damping", "tendon_frictionloss", "tendon_limited", "jnt_limited", "geom_contype"):
        moving = getattr(model, field)[model.geom_bodyid > 0] if field == "geom_contype" else getattr(model, field)
        assert (moving == 0).all(), field
    off = mujoco.mjtDisableBit
    for bit in (off.mjDSBL_CONTACT, off.mjDSBL_GRAVITY, off.mjDSBL_CONSTRAINT, off.mjDSBL_EULERDAMP):
        assert model.opt.disableflags & bit, bit.name
    assert model.opt.disableflags & off.mjDSBL_AUTORESET, "a reset on its own would hide an unstable run"
    assert not model.opt.disableflags & off.mjDSBL_SENSOR


def test_options_arrive(case, model):
    assert model.opt.timestep == 5e-5
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    other = build(line_up(load("b_type", {"simulation.integrator": "implicitfast"})))
    assert other.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def test_interfaces_are_tendons_whose_length_is_the_stroke(case, model):
    names = ["M5-M6", "M4-M5", "M3-M4", "M2-M3", "M1-M2", "S1-M1", "S1-S2", "S2-S3", "S3-S4", "S4-S5", "S5-S6"]
    assert [model.tendon(i).name for i in range(model.ntendon)] == names
    data = mujoco.MjData(model)
    rng = np.random.default_rng(5)
    data.qpos[:], data.qvel[:] = rng.normal(size=12), rng.normal(size=12)
    mujoco.mj_forward(model, data)
    assert data.ten_length == pytest.approx(data.qpos[:-1] - data.qpos[1:])
    assert data.ten_velocity == pytest.approx(data.qvel[:-1] - data.qvel[1:])


def test_sensors_carry_names_of_what_they_measure(case, model):
    interfaces = [i.name for i in case.interfaces]
    vehicles = [v.name for v in case.vehicles]
    expected = [f"{s} {i}" for s in SENSED for i in interfaces] + [f"{s} {v}" for s in MOTION for v in vehicles]
    assert [model.sensor(i).name for i in range(model.nsensor)] == expected


def test_start_keyframe_has_both_sides_at_speed_and_apart(case, model):
    key = model.key("start")
    assert key.qvel == pytest.approx([25 / 3.6] * 6 + [-5 / 3.6] * 6)
    assert key.qpos == pytest.approx([-0.25] * 6 + [0.0] * 6)
    data = start(model, case, Layout.of(case))
    mujoco.mj_forward(model, data)
    assert data.sensor("stroke S1-M1").data[0] == pytest.approx(-0.25), "before contact the stroke is minus the gap"
    assert data.sensor("stroke M1-M2").data[0] == 0.0


def test_devices_arrive_in_the_block_of_user_data(scenario, case):
    layout = Layout.of(case)
    block = layout.block(case)
    assert layout.point(block, Point.FRICTION_LIMIT) == pytest.approx(0.008 * 9.80665 * case.mass)
    stiffness = layout.element(block, Element.P0) / 1e6
    damping = layout.element(block, Element.P1) / 1e3
    couplers = [name for joint in scenario.trains["b_type"].joints()[1:] for name in joint]
    used = [scenario.devices[name] for name in (*couplers[::-1], "front", *couplers)]
    share = np.where(np.arange(len(used)) == case.front, 0.5, 1)  # both trains' front devices in series
    assert stiffness == pytest.approx([d.stiffness_kN_per_mm for d in used])
    assert damping == pytest.approx([d.damping_kN_s_per_m for d in used])
    assert layout.element(block, Element.SHARE) == pytest.approx(share)


def test_front_curve_of_the_standard_case_is_that_of_the_file():
    """Two trains bring the same device, each with its own empty stroke."""
    scenario = load("b_type", {"empty_stroke_mm": 35})
    front = line_up(scenario).interfaces[5].devices[0].envelope
    coupler, climber = scenario.devices["front"].all_stages().values()
    tube, shear = coupler.curve[-1], coupler.shear_off
    end = tube.stroke_mm[-1]
    expected = list(zip(tube.stroke_mm, tube.force_kN, strict=True))
    expected += [(end + shear.ramp_mm, shear.force_kN), (end + 2 * shear.ramp_mm, 0), (end + 35, 0)]
    expected += [(end + 35 + climber.curve.stroke_mm[1], climber.curve.force_kN[1])]
    for stroke, force in expected:
        k = int(np.argmin(np.abs(front.stroke - 1e-3 * stroke)))
        assert front.stroke[k] == pytest.approx(1e-3 * stroke)
        assert front.force[k] == pytest.approx(1e3 * force)


@pytest.mark.parametrize("name", SHIPPED)
def test_bare_model_moves_as_the_full_one_to_the_last_bit(name):
    """The batch runs without tendons and sensors; its numbers must be those of a single run."""
    case = line_up(load(name))
    layout = Layout.of(case)
    ends = []
    with kernel.installed():
        for bare in (False, True):
            model = build(case, layout, bare)
            data = start(model, case, layout)
            mujoco.mj_step(model, data, nstep=4000)
            ends.append((data.qpos.copy(), data.qvel.copy(), data.userdata.copy()))
    for full, bare in zip(*ends, strict=True):
        assert np.array_equal(full, bare)
    assert ends[0][2].any()


def test_wall_stands_where_the_train_would_touch_it():
    model = visible(line_up(load("b_type_wall", {"collision.gap_mm": 100}))).compile()
    mesh = model.mesh(model.geom("wall").dataid[0])
    points = model.mesh_vert[mesh.vertadr[0] :][: mesh.vertnum[0]]
    turned = np.empty(9)
    mujoco.mju_quat2Mat(turned, model.geom("wall").quat)
    face = (points @ turned.reshape(3, 3).T)[:, 0].min() + model.geom("wall").pos[0]
    assert face == pytest.approx(0.0, abs=1e-6)
    assert model.body("M1").pos[0] + 10.0 == pytest.approx(-0.1)
    assert model.ntendon == 6


# export


@pytest.mark.parametrize("name", ALONG)
def test_export_reloads_with_masses_names_and_speeds(name):
    case = line_up(load(name))
    model = mujoco.MjModel.from_xml_string(export(case, name))
    assert [model.body(i).name for i in range(1, model.nbody)] == [v.name for v in case.vehicles]
    assert model.body_mass[1:] == pytest.approx(case.mass, rel=1e-6), "MjSpec drops inertials that have no position"
    assert [model.tendon(i).name for i in range(model.ntendon)] == [i.name for i in case.interfaces]
    assert model.key("start").qvel == pytest.approx(case.speed, rel=5e-6), "MjSpec writes six digits"
    assert model.opt.timestep == case.step


def test_export_collides_by_itself_with_stand_ins_of_the_stated_plateaus(standard):
    """MuJoCo's own elasto-plastic tendons: they push, never pull, and absorb about what the devices do."""
    case = line_up(standard)
    text = export(case)
    model = mujoco.MjModel.from_xml_string(text)
    plateaus = model.tendon_stiffness * model.tendon_springyield
    stated = [stand_in_of(i, case.stand_in_speed)[1] for i in case.interfaces]
    assert plateaus == pytest.approx(stated, rel=1e-5)
    assert plateaus.min() > 5e5, "a tendon that carries nothing would be no stand-in"
    assert f"S1-M1: {plateaus[case.front] / 1e3:.0f} kN" in text.split("-->")[0]
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    momentum, energy = case.mass @ case.speed, 0.5 * case.mass @ case.speed**2
    mujoco.mj_step(model, data, nstep=10_000)
    assert data.qvel.max() - data.qvel.min() < 1.0, "after 1 s both trains move together, or nearly"
    assert case.mass @ data.qvel == pytest.approx(momentum)
    assert 0.4 * energy < energy - 0.5 * case.mass @ data.qvel**2 < 0.51 * energy, "half of it, as between equal trains"
    front, speeds = data.qpos[5] - data.qpos[6], data.qvel.copy()
    data.qpos[6:] += 10.0
    mujoco.mj_step(model, data)
    assert front > 0.5
    assert data.qvel[5:7] == pytest.approx(speeds[5:7], abs=0.01), "apart, the trains do not pull each other back"


def test_stand_ins_and_device_law_never_act_together(standard):
    """Only an export has the tendons' springs, and it has no room for the law's block."""
    case = line_up(standard)
    exported = mujoco.MjModel.from_xml_string(export(case))
    assert exported.nuserdata == 0
    ends = []
    for law in (False, True):
        data = mujoco.MjData(exported)
        mujoco.mj_resetDataKeyframe(exported, data, 0)
        with kernel.installed() if law else nullcontext():
            mujoco.mj_step(exported, data, nstep=200)
        ends.append(data.qvel.copy())
    assert np.array_equal(*ends), "the law leaves an exported model alone"
    for made in (spec(case), visible(case)):
        model = made.compile()
        assert not model.tendon_stiffness.any()
        assert model.nuserdata == Layout.of(case).size


def test_plateau_absorbs_what_the_device_does_up_to_its_limit(standard):
    front = line_up(standard).interfaces[5]
    climber = front.devices[0].stages[1]
    limit = climber.start + climber.limit
    assert stand_in_of(front, 0.0)[1] * limit == pytest.approx(front.devices[0].envelope.energy(limit), rel=5e-3)


TUBE = {"stroke_mm": [0, 1, 400], "force_kN": [0, 800, 800]}
OF_KINDS = {
    "crush": ({"curve": TUBE, "stiffness_kN_per_mm": 300, "beyond": "hold"}, {"the shape of curves"}),
    "shear-off": (
        {
            "stages": {
                "one": {"curve": TUBE, "shear_off": {"force_kN": 900}},
                "two": {"curve": TUBE, "empty_stroke_mm": 50},
            },
            "stiffness_kN_per_mm": 300,
            "damping_kN_s_per_m": 10,
            "beyond": "hold",
        },
        {"the shape of curves", "empty strokes", "shear-off", "dashpots"},
    ),
    "rate": (
        {
            "curve": TUBE,
            "stiffness_kN_per_mm": 300,
            "rate": {"C_m_per_s": 20, "P": 5},
            "beyond": "car_body",
            "pull": {"stiffness_kN_per_mm": 50},
        },
        {
            "the shape of curves",
            "rate dependence",
            "stops and car bodies behind the end of a device",
            "draw gear",
        },
    ),
    "hysteresis": (
        {
            "kind": "hysteresis",
            "loading": TUBE,
            "unloading": {"stroke_mm": [0, 400], "force_kN": [0, 100]},
            "transition_stiffness_kN_per_mm": 900,
        },
        {"the shape of curves", "recovery, and the lower curve along which it goes"},
    ),
    "hydraulic": (
        {
            "kind": "hydraulic",
            "stroke_mm": 400,
            "orifice_kN_s2_per_m2": 32,
            "beyond": {"kind": "stop", "stiffness_kN_per_mm": 50},
        },
        {"orifices, but for their force at 5 m/s", "stops and car bodies behind the end of a device"},
    ),
}


@pytest.mark.parametrize("name", OF_KINDS)
def test_an_export_has_a_stand_in_for_every_kind_and_says_what_it_leaves_out(name):
    """Breaks if a kind gets a stand-in without force, or the comment hides or invents a simplification."""
    device, left_out = OF_KINDS[name]
    values = {
        "devices": {"d": device},
        "trains": {"t": {"vehicles": 2, "mass_t": 30, "front": "d", "coupler": "d"}},
        "collision": {"train": "t", "speed_km_h": 36, "partner": "rigid_wall"},
    }
    case = line_up(Scenario.from_values(values))
    text = export(case)
    said = " ".join(text.split("-->")[0].split())
    listed = said.split("Left out: ")[1].split(". Strokes")[0].replace(", half the closing speed", "").split("; ")
    assert set(listed) == left_out
    model = mujoco.MjModel.from_xml_string(text)
    forces = model.tendon_stiffness * model.tendon_springyield
    assert (forces > 5e5).all()
    if name == "hydraulic":
        assert forces == pytest.approx(800e3, rel=5e-3), "32 kN s2/m2 at 5 m/s"


def test_an_export_of_brakes_grade_and_friction_says_that_they_are_left_out():
    """Breaks if someone takes the exported file for the whole scenario."""
    train = {"vehicles": 1, "mass_t": 30, "front": "d", "brakes": {"force_kN": 30}}
    values = {
        "devices": {"d": OF_KINDS["crush"][0], "e": OF_KINDS["rate"][0]},
        "trains": {"t": train, "u": train | {"front": "e", "rail_friction": 0.1}},
        "collision": {"train": "t", "speed_km_h": 36, "partner": "u", "grade_per_mille": 5},
    }
    said = " ".join(export(line_up(Scenario.from_values(values))).split("-->")[0].split())
    for words in ("friction of rails", "brakes", "the grade", "two devices in series have a state each"):
        assert words in said
    assert "draw gear" not in said, "a front is not coupled"


@pytest.mark.parametrize("name", ["b_type", "b_type_wall", "wagon_80t"])
def test_visible_model_moves_as_the_bare_one(name):
    """What is there for the eye changes no number."""
    case = line_up(load(name))
    layout = Layout.of(case)
    ends = []
    with kernel.installed():
        for model in (visible(case, layout).compile(), build(case, layout, bare=True)):
            assert model.body_mass[1:] == pytest.approx(case.mass)
            data = start(model, case, layout)
            mujoco.mj_step(model, data, nstep=1000)
            ends.append((data.qpos.copy(), data.qvel.copy(), data.userdata.copy()))
    for seen, bare in zip(*ends, strict=True):
        assert np.array_equal(seen, bare)


@pytest.mark.parametrize(
    "title",
    ["", "a -- b", "--->", "<b>bold</b> & co", "ends with -", "two\nlines", "---", "Züge, 列车", "]]> <!-- "],
)
def test_no_title_breaks_the_exported_xml(title):
    text = export(line_up(small([(0, 0), (10, 800)], 80)), title)
    assert mujoco.MjModel.from_xml_string(text).nv == 1
    assert ElementTree.fromstring(text).tag == "mujoco", "MuJoCo's parser forgives what other XML tools do not"


def test_exported_title_can_be_read(standard):
    assert "25 km/h into a twin" in export(line_up(standard), "25 km/h into a twin").split("-->")[0]


def test_base_scene_has_what_models_are_built_on():
    """mjcf/base.xml is for people to edit; these are the names that trainmj takes from it."""
    base = mujoco.MjModel.from_xml_path(str(shipped_folder("mjcf") / "base.xml"))
    for material in ("moving", "partner", "shell", "window", "bogie", "device", "wall"):
        base.material(material)
    for camera in ("overview", "front"):
        base.camera(camera)
    assert base.nlight > 0


def test_400_vehicles_compile():
    """The largest chain a scenario file may state."""
    large = load("b_type", {"trains.b_type.vehicles": 200, "simulation.time_limit_s": 0.1})
    model = spec(line_up(large), bare=True).compile()
    assert model.nv == 400
