"""The compiled law: equal to the readable one, once per step, and a good guest in MuJoCo."""

from __future__ import annotations

import ctypes
import os
import shutil
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numba
import numpy as np
import pandas as pd
import pytest
from builders import KINDS_OF_DEVICE, Alone, built, chain, envelope, few, step_once

import trainmj
from trainmj.collision import compiled, compiler, identity, jitable, kernel, offsets
from trainmj.collision.block import MAGIC, Layout
from trainmj.collision.chain import WALL, Chain, Interface, Vehicle, meet
from trainmj.collision.device import Device
from trainmj.collision.envelope import Envelope
from trainmj.collision.fields import ELEMENT, N_ELEMENT, Car, Head, Joint
from trainmj.collision.fields import Element as Field
from trainmj.collision.lineup import line_up
from trainmj.collision.mj import SLOTS
from trainmj.collision.model import build, check_integrator
from trainmj.collision.simulation import run, start
from trainmj.collision.summary import summarise
from trainmj.errors import EngineError, OutputError
from trainmj.scenario import Scenario, load
from trainmj.view.scene import export

ROOT = Path(__file__).parents[1]

ENVELOPES = (
    envelope([(0, 0), (10, 1000), (500, 1000)], 200, 50),
    envelope(
        [(0, 0), (73, 800), (353, 1000), (353.3, 1200), (353.6, 0), (375, 0), (375.2, 1250), (900, 1250)], 356, 11
    ),
    envelope([(0, 0), (1, 1000), (300, 1000)], 30, 7000),  # rises faster than it unloads; a strong dashpot
    envelope([(0, 0), (50, 0), (50, 500), (80, 500), (80, 200), (400, 900)], 90),  # empty stroke, two jumps
)
MASS = (33e3, 20e3, 47e3, 1e3)


def walled(**kwargs: float) -> Chain:
    return chain(MASS, ENVELOPES, (0.0,) * 4, n_moving=4, **kwargs)


@pytest.fixture
def law() -> Iterator[None]:
    with kernel.installed():
        yield


@pytest.fixture(scope="module")
def system() -> tuple[mujoco.MjModel, Layout]:
    layout = Layout.of(walled())
    return build(walled(), layout), layout


PULLS = {
    "linear": {"stiffness_kN_per_mm": 50, "slack_mm": 5, "damping_kN_s_per_m": 20},
    "breaks": {"stiffness_kN_per_mm": 80, "breaking_force_kN": 400},
    "curved": {
        "curve": {"stroke_mm": [0, 10, 60], "force_kN": [50, 300, 500]},
        "stiffness_kN_per_mm": 60,
        "breaking_force_kN": 450,
    },
}


def pairs(devices: dict[str, Device]) -> list[tuple[Device, Device]]:
    """Each device with the next one, and with the one behind that."""
    names = list(devices)
    return [(devices[a], devices[names[(n + by) % len(names)]]) for n, a in enumerate(names) for by in (1, 2)]


def every_element() -> Chain:
    """Interfaces with a device of every kind, alone, twice, and beside another kind, with and without draw gear."""
    devices = built()
    drawn = built(**{f"{name}_{pull}": KINDS_OF_DEVICE[name] | {"pull": PULLS[pull]} for name, pull in DRAWN})
    drawn_pairs = list(zip(drawn.values(), list(drawn.values())[1:], strict=False))
    sides = [*((d,) for d in devices.values()), *((d, d) for d in devices.values()), *pairs(devices)]
    sides += [*((d,) for d in drawn.values()), *((d, d) for d in drawn.values()), *drawn_pairs]
    n = len(sides)
    interfaces = tuple(
        Interface(f"I{k}", k, k + 1 if k + 1 < n else WALL, meet(*each), each) for k, each in enumerate(sides)
    )
    return Chain(tuple(Vehicle(f"V{k}", "", 1e4, 20.0, 0.0) for k in range(n)), interfaces, n, 0.0, 1e-3, 1, 1.0)


DRAWN = [("tube", "linear"), ("gear", "breaks"), ("gas", "curved"), ("damped", "breaks"), ("sheared", "linear")]


@pytest.fixture(scope="module")
def every() -> tuple[Chain, mujoco.MjModel, Layout]:
    case = every_element()
    return case, build(case), Layout.of(case)


def history(rng: np.random.Generator, n: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """(steps, n) strokes and rates, not of one motion: small moves around a place, and now and then a jump."""
    moves = rng.uniform(-0.006, 0.008, (steps, n)) * rng.choice([0.1, 1.0, 4.0], (1, n))
    moves[rng.random((steps, n)) < 0.03] *= 20
    drift = np.where(np.arange(n) % 5 == 4, -1.0, 1.0)  # apart in one of five
    return np.clip(drift * np.cumsum(moves, axis=0), -0.2, 0.5), rng.uniform(-8, 8, (steps, n)) * rng.choice(
        [0, 1], (steps, n)
    )


@pytest.mark.parametrize("seed", few(range(6), 3))
def test_compiled_law_equals_the_plain_one_exactly(every, seed):
    """Breaks if the compiler, or a place in the block, makes another law than the one that can be read."""
    case, model, layout = every
    data = start(model, case, layout)
    alone = [[Alone(element) for element in interface.elements] for interface in case.interfaces]
    n = len(case.interfaces)
    for step, (u, rate) in enumerate(zip(*history(np.random.default_rng(seed), n, 40), strict=True)):
        data.time = 1e-3 * (step + 1)
        data.qpos[:] = np.cumsum(u[::-1])[::-1]  # a position is the sum of the strokes ahead of it
        data.qvel[:] = np.cumsum(rate[::-1])[::-1]
        with kernel.installed():
            mujoco.mj_forward(model, data)
        u = np.append(data.qpos[:-1] - data.qpos[1:], data.qpos[-1])
        rate = np.append(data.qvel[:-1] - data.qvel[1:], data.qvel[-1])
        before = alone[0][0].time
        forces = []
        for k, elements in enumerate(alone):
            forces.append(0.0)
            for one in elements:
                elapsed = data.time - before if step else 0.0
                one.time = data.time - elapsed
                forces[-1] += one.to(float(u[k]), float(rate[k]), elapsed)
                one.time = data.time
        assert data.sensordata[:n].tolist() == forces, "forces of the compiled law differ from those of the plain one"
        records = layout.element(data.userdata, Field.NEXT).size
        found = np.column_stack([layout.element(data.userdata, field) for field in Field])
        plain = np.concatenate([one.block[: N_ELEMENT * size(one)] for elements in alone for one in elements])
        plain = plain.reshape(records, N_ELEMENT)
        places = [field for field in Field if field not in (Field.CURVE, Field.CURVE_2)]
        np.testing.assert_array_equal(found[:, places], plain[:, places])
        behind = np.array([0.0, *forces[:-1]])
        assert data.qfrc_passive.tolist() == (behind - forces).tolist(), "vehicles feel other forces than interfaces"


def size(one: Alone) -> int:
    return 1 if len(one.element.laws) == 1 else 3


def test_at_its_edges_too():
    """Touching without pressing there is no dashpot force; on the envelope itself there is no dashpot relief."""
    e = Envelope(np.array([0.0, 1.0, 2.0]), np.array([2.0, 2.0, 2.0]), 4.0, 3.0)
    case = chain([1000.0], [e], [0.0], n_moving=1)
    model, layout = build(case), Layout.of(case)
    for u, rate, force, plastic in ((0.0, 1.0, 0.0, 0.0), (0.5, -0.25, 2.0, 0.0), (0.25, 0.125, 1.375, 0.0)):
        data = start(model, case, layout)
        data.qpos[:], data.qvel[:] = u, rate
        with kernel.installed():
            mujoco.mj_forward(model, data)
        assert (-data.qfrc_passive[0], layout.element(data.userdata, Field.STATE_0)[0]) == (force, plastic)


@pytest.mark.thorough
def test_histories_of_that_test_reach_every_branch_of_the_law():
    """Guards the test above: its histories must press, hold, release, break and end every kind."""
    rng = np.random.default_rng(1)
    case = every_element()
    n = len(case.interfaces)
    strokes, rates = history(rng, n, 400)
    pressed = pulled = unloaded = broken = ended = 0
    for k, interface in enumerate(case.interfaces):
        for element in interface.elements:
            one = Alone(element)
            forces = [one.to(float(u), float(v), 1e-3) for u, v in zip(strokes[:, k], rates[:, k], strict=True)]
            pressed += max(forces) > 1e5
            pulled += min(forces) < -1e5
            unloaded += max(forces) > 0.0 and 0.0 in forces[50:]
            broken += one.of(ELEMENT.BROKEN) > 0
            ended += one.of(ELEMENT.END_TIME) > 0
    assert pressed > 0.7 * n
    assert min(pulled, unloaded, broken, ended) > 1


def test_a_division_by_zero_in_the_law_makes_a_collision_not_finite(law):
    """An exception within MuJoCo's callback would be printed, and the collision go on with the forces of before."""
    e = envelope([(0, 0), (10, 1000)], 100)
    case = chain([33e3], [e], [1.0], n_moving=1, friction=0.1)
    model, layout = build(case), Layout.of(case)
    data = start(model, case, layout)
    model.opt.timestep = data.userdata[Head.STEP] = 0.0
    mujoco.mj_step(model, data)
    assert data.userdata[Head.TIME] == 0.0, "the law was cut off"
    layout.element(data.userdata, Field.P0)[:] = 0.0
    data.time, data.qpos[:] = 1e-3, 0.001
    mujoco.mj_forward(model, data)
    assert data.userdata[Head.TIME] == 1e-3, "the law was cut off"


def test_a_function_that_is_kept_apart_divides_like_its_caller():
    """numba would compile it with Python's exceptions, and a division by zero in a pair would cut the law off."""

    @jitable.apart
    def inverse(x):
        return 1.0 / x

    compiler.tell()
    assert numba.njit(error_model="numpy")(lambda x: inverse(x))(0.0) == np.inf


def test_callbacks_that_are_not_compiled_compute_the_same(every):
    """Python calls them as they stand: pointers are those of the running MuJoCo, and so is every number."""
    case, model, layout = every
    found = []
    places = offsets.field_offsets()
    for compiled_ in (True, False):
        data = start(model, case, layout)
        passive, sensor = kernel._callbacks()[:2]
        if not compiled_:
            passive, sensor = kernel._passive(places), kernel._sensor(places)
        for step, (u, rate) in enumerate(zip(*history(np.random.default_rng(7), len(case.interfaces), 3), strict=True)):
            data.time = 1e-3 * (step + 1)
            data.qpos[:] = np.cumsum(u[::-1])[::-1]
            data.qvel[:] = np.cumsum(rate[::-1])[::-1]
            passive(model._address, data._address)
            sensor(model._address, data._address, int(mujoco.mjtStage.mjSTAGE_ACC))
        found.append((data.userdata.tolist(), data.qfrc_passive.tolist(), data.sensordata.tolist()))
    assert found[0] == found[1]
    assert any(found[0][1])


def test_state_moves_once_per_time(law, system):
    """The engine may evaluate forces again at the same time (mj_forward); that must not crush a device further."""
    model, layout = system
    data = start(model, walled(), layout)
    data.time, data.qpos[:] = 0.001, [0.4, 0.3, 0.2, 0.1]
    mujoco.mj_forward(model, data)
    state, forces = data.userdata.copy(), data.qfrc_passive.copy()
    data.qpos[:] = [0.9, 0.6, 0.4, 0.2]
    for _ in range(3):
        mujoco.mj_forward(model, data)
        assert np.array_equal(data.userdata, state)
        assert np.array_equal(data.qfrc_passive, forces)
    data.time = 0.002
    mujoco.mj_forward(model, data)
    assert not np.array_equal(data.userdata, state), "the next time moves it"


def test_tally_counts_peaks_times_and_work(law, system):
    model, layout = system
    data = start(model, walled(), layout)
    path = np.concatenate([np.linspace(0, 0.2, 2001), np.linspace(0.2, 0.19, 101)[1:]])
    for n, u in enumerate(path):
        data.time, data.qpos[:] = 0.001 * (n + 1), [u, 0, 0, 0]
        mujoco.mj_forward(model, data)
    block = data.userdata
    first = {field: float(layout.joint(block, field)[0]) for field in Joint}
    assert first[Joint.STROKE_MAX] == 0.2
    assert first[Joint.STROKE_MAX_TIME] == pytest.approx(2.001)
    assert first[Joint.FORCE_MAX] == 1e6
    assert first[Joint.FIRST_FORCE_TIME] == pytest.approx(0.002)
    elastic = 0.5 * 1e6**2 / 200e6
    assert data.sensor("energy I0").data[0] == pytest.approx(ENVELOPES[0].energy(0.2) - elastic, rel=1e-3)
    assert layout.car(block, Car.DEVICE_PEAK).tolist() == pytest.approx([1e6 / 33e3, 1e6 / 20e3, 0, 0])
    assert float(layout.joint(block, Joint.FIRST_FORCE_TIME)[1]) == -1.0, (
        "an interface that never pushed has no first time"
    )


@pytest.mark.parametrize(
    ("limit", "speed", "pushed", "expected"),
    [
        (0.01, 2.0, 0.0, -0.01 * 9.80665 * 33e3),  # rolling: the whole of mu m g against the motion
        (0.01, -2.0, 0.0, 0.01 * 9.80665 * 33e3),
        (0.01, 0.0, 0.0, 0.0),  # standing and not pushed: nothing
        (0.01, 1e-6, 0.0, -33e3 * 1e-6 / 1e-3),  # nearly standing: what stops it within the step
        (0.0, 5.0, 0.0, 0.0),
    ],
)
def test_rail_friction_of_one_vehicle(law, limit, speed, pushed, expected):
    e = envelope([(0, 0), (10, 1000)], 100)
    case = chain([33e3], [e], [speed], friction=limit, step=1e-3, gap=1.0)
    model = build(case)
    data = start(model, case, Layout.of(case))
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[0] == pytest.approx(expected, rel=1e-12)


# a good guest


PHYSICS = [name for name in dir(mujoco) if name.startswith("set_mjcb_")]


def failing(*_: object) -> None:
    raise ZeroDivisionError("someone's own callback")


@pytest.fixture
def ours() -> Iterator[list[object]]:
    """Someone's own callbacks, in place while a test runs."""
    kernel._callbacks()
    calls: list[object] = []

    def passive(model, data) -> None:
        calls.append("passive")

    mujoco.set_mjcb_passive(passive)
    yield [passive, calls]
    for name in PHYSICS:
        getattr(mujoco, name)(None)
    mujoco.set_mju_user_warning(None)


@pytest.fixture(scope="module")
def fast() -> tuple[Scenario, float]:
    """A collision that takes little time, and its largest stroke without anyone else's callback."""
    scenario = load("b_type_wall", {"simulation.step_ms": 0.5})
    return scenario, summarise(run(scenario)).TS_mm


@pytest.mark.parametrize("name", few(["set_mju_user_warning", *PHYSICS], 3))
def test_nobodys_callback_is_called_and_it_is_back_afterwards(fast, ours, name):
    """Breaks if a callback of the user's, left from other work, changes a number, stops a run, or is lost."""
    mujoco.set_mjcb_passive(None)
    getattr(mujoco, name)(failing)
    scenario, stroke = fast
    assert summarise(run(scenario)).TS_mm == stroke
    table = trainmj.run_cases(scenario, pd.DataFrame({"mass_t": [33.0, 33.0]}), threads=2)
    assert list(table.TS_mm) == [stroke] * 2
    assert export(line_up(scenario)).startswith("<!--")
    assert getattr(mujoco, name.replace("set", "get", 1))() is failing


@pytest.mark.thorough
def test_a_callback_that_was_there_before_trainmj_stops_nothing(python):
    """MuJoCo compiles models as its parts are imported, too."""
    code = """
import mujoco, pandas, trainmj
def failing(model, data): raise ZeroDivisionError
mujoco.set_mjcb_passive(failing)
scenario = trainmj.load("b_type_wall", {"simulation.time_limit_s": 0.01})
print(trainmj.run_cases(scenario, pandas.DataFrame({"mass_t": [33]})).status[0])
assert mujoco.get_mjcb_passive() is failing
"""
    done = python("-c", code)
    assert done.stdout == "time limit\n", done.stderr


def test_a_callback_in_c_is_back_afterwards_too(ours):
    called: list[int] = []
    theirs = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda model, data: called.append(1))
    mujoco.set_mjcb_passive(None)
    mujoco.set_mjcb_control(theirs)
    case = walled()
    step_once(build(case), case)
    assert not called
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    mujoco.mj_step(model, mujoco.MjData(model))
    assert called


def slots() -> list[object]:
    return [get() for get, _ in SLOTS]


def test_leaving_puts_back_what_was_there(ours):
    before = slots()
    assert before[0] is ours[0]
    with kernel.installed():
        assert slots()[0] is not before[0]
    assert slots() == before


def test_nested_use_keeps_the_law_until_the_last_one_leaves(ours):
    before = slots()
    with kernel.installed():
        law = slots()
        with kernel.installed():
            pass
        assert slots()[0] is not before[0], "the inner one must not take the law away from the outer one"
        assert [type(x) for x in slots()] == [type(x) for x in law]
    assert slots() == before


def test_an_exception_inside_puts_back_too(ours):
    before = slots()
    with pytest.raises(ZeroDivisionError), kernel.installed():
        raise ZeroDivisionError
    assert slots() == before


def test_threads_may_enter_and_leave_as_they_like():
    """A thread that leaves early must not take the law away from one that still steps."""
    case = walled(friction=0.01, step=1e-4)
    model, layout = build(case), Layout.of(case)
    before = slots()

    def collide() -> np.ndarray:
        data = start(model, case, layout)
        data.qvel[:] = [4, 3, 2, 1]
        for _ in range(50):
            with kernel.installed():
                mujoco.mj_step(model, data, nstep=20)
        return data.userdata.copy()

    alone = collide()
    found: list[np.ndarray] = []
    threads = [threading.Thread(target=lambda: found.append(collide())) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4
    assert all(np.array_equal(block, alone) for block in found)
    assert slots() == before


@pytest.mark.parametrize(
    ("nuserdata", "first"),
    [(0, 0.0), (len(Head) - 1, MAGIC), (500, 1.0)],  # none; too short to be a block; long enough, but another's
)
def test_models_of_others_are_left_alone(law, nuserdata, first):
    xml = f"""<mujoco><size nuserdata="{nuserdata}"/><worldbody>
        <body><joint name="a" type="slide" axis="1 0 0" damping="2"/><geom size="1"/></body></worldbody>
        <sensor><user dim="1" needstage="acc"/></sensor></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    theirs = np.ones(nuserdata)  # one vehicle, one interface, one point, were it a block of ours
    theirs[Head.DONE : Head.DONE + 1] = 0.0
    theirs[:1] = first
    data.userdata[:] = theirs
    data.time, data.qpos[:], data.qvel[:] = 0.5, 5.0, 1.0
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive.tolist() == [-2.0]
    assert data.userdata.tolist() == theirs.tolist()
    assert data.sensordata.tolist() == [0.0]


def test_the_law_is_made_while_another_callback_is_in_place(ours):
    """MuJoCo compiles no model under a callback in Python, and the law needs one to find MuJoCo's fields."""
    kernel._callbacks.cache_clear()
    offsets.field_offsets.cache_clear()
    with kernel.installed():
        build(walled())
    assert mujoco.get_mjcb_passive() is ours[0]


def test_what_was_there_is_put_back_where_the_law_cannot_be_made(ours, monkeypatch):
    def broken() -> None:
        raise EngineError("not supported")

    monkeypatch.setattr(kernel, "_callbacks", broken)
    for _ in range(2):
        with pytest.raises(EngineError, match="not supported"), kernel.installed():
            pytest.fail("entered")
        assert mujoco.get_mjcb_passive() is ours[0]
    monkeypatch.undo()
    with kernel.installed():
        assert mujoco.get_mjcb_passive() is not ours[0], "what failed counts as no user"


def test_without_the_law_the_vehicles_pass_through_each_other():
    """What the comment in an exported model says, and what makes every other test here mean something."""
    case = walled()
    model = build(case)
    data = start(model, case, Layout.of(case))
    data.qpos[:] = [0.4, 0.3, 0.2, 0.1]
    mujoco.mj_forward(model, data)
    assert (data.qfrc_passive == 0).all()


# places of fields


def test_places_of_fields_are_those_of_this_mujoco():
    """Each place, read as raw memory, holds what MuJoCo's own Python says."""
    o = offsets.field_offsets()
    case = walled()
    model = build(case)
    data = mujoco.MjData(model)
    data.time = 1.2345
    read = ctypes.c_double.from_address
    assert read(data._address + o.time).value == 1.2345
    assert read(model._address + o.timestep).value == model.opt.timestep
    assert ctypes.c_int64.from_address(model._address + o.nuserdata).value == model.nuserdata
    for name, place in (("qpos", o.qpos), ("qvel", o.qvel), ("userdata", o.userdata), ("sensordata", o.sensordata)):
        assert ctypes.c_void_p.from_address(data._address + place).value == getattr(data, name).ctypes.data
    assert ctypes.c_void_p.from_address(data._address + o.qfrc_passive).value == data.qfrc_passive.ctypes.data
    assert ctypes.c_void_p.from_address(data._address + o.inertia).value == data.M.ctypes.data


@pytest.mark.parametrize("field", offsets.Offsets._fields)
def test_a_field_that_is_not_where_it_was_found_is_an_error(monkeypatch, field):
    """Going on with a wrong place would read and write foreign memory."""
    probe = offsets._probe

    def disagree(n: int, *args):
        found = probe(n, *args)
        return found | {field: {8 * n}}

    monkeypatch.setattr(offsets, "_probe", disagree)
    with pytest.raises(EngineError, match=rf"keeps {field} where it was not found.*mujoco 4\.0"):
        offsets.field_offsets.__wrapped__()


def test_a_field_that_cannot_be_found_at_all_is_an_error(monkeypatch):
    monkeypatch.setattr(offsets, "_probe", lambda *args: {name: set() for name in offsets.Offsets._fields})
    with pytest.raises(EngineError, match="this version is not supported"):
        offsets.field_offsets.__wrapped__()


@pytest.mark.parametrize("name", ["mjINT_RK4"])
def test_integrators_that_evaluate_forces_several_times_a_step_are_refused(name):
    model = build(walled())
    model.opt.integrator = getattr(mujoco.mjtIntegrator, name)
    with pytest.raises(EngineError, match=rf"{name} does not evaluate forces exactly once a step.*euler"):
        check_integrator(model)


@pytest.mark.parametrize("name", ["euler", "implicitfast", "implicit"])
def test_accepted_integrators_call_the_law_once_a_step(ours, name):
    from dataclasses import replace

    case = replace(walled(), integrator=name)
    mujoco.set_mjcb_passive(None)
    model = build(case)
    data = start(model, case, Layout.of(case))
    mujoco.set_mjcb_passive(ours[0])
    mujoco.mj_step(model, data, nstep=10)
    assert len(ours[1]) == 10


# the compiler's cache on disk


@pytest.mark.thorough
def test_functions_compiled_for_other_offsets_are_not_taken_from_the_cache(tmp_path, monkeypatch):
    """A function with the wrong places would read foreign memory."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    right = offsets.field_offsets()
    wrong = offsets.Offsets(*range(800, 1520, 80))
    signature = "void(voidptr, voidptr, intc)"
    made = compilations(monkeypatch)
    for places in (wrong, wrong, right):
        assert not kernel._compile(kernel._sensor, signature, places)[1]
    assert len(made) == 2, "one of each, and the second wrong one was there"
    case = walled()
    model, layout = build(case), Layout.of(case)
    data = start(model, case, layout)
    data.qpos[:] = [0.4, 0.3, 0.2, 0.1]
    with kernel.installed():
        mujoco.mj_forward(model, data)
    expected = data.sensordata.copy()
    data.sensordata[:] = 0.0
    address, _ = kernel._compile(kernel._sensor, signature, right)
    sensor = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)(address)
    sensor(model._address, data._address, int(mujoco.mjtStage.mjSTAGE_ACC))
    assert data.sensordata[:8].tolist() == expected[:8].tolist()
    assert expected[:4].all()


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """The file of one function."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert law_again() == ""
    (file,) = (file for file in tmp_path.rglob("*") if file.is_file())
    return file


def law_again() -> str:
    """Take a function from the cache, or compile it: what is said."""
    address, said = kernel._compile(kernel._no_clock, "float64()", offsets.field_offsets())
    assert ctypes.CFUNCTYPE(ctypes.c_double)(address)() == 0.0
    return said


def compilations(monkeypatch) -> list[object]:
    made: list[object] = []
    compile_ = compiler.compiled
    monkeypatch.setattr(compiler, "compiled", lambda *args: made.append(args) or compile_(*args))
    return made


@pytest.mark.parametrize(
    "harm",
    [
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(file.read_bytes()[:100]),
        lambda file: file.write_bytes(file.read_bytes()[:-1]),
        lambda file: file.write_bytes(b"\0" * file.stat().st_size),
        lambda file: file.write_bytes(os.urandom(5000)),
        lambda file: file.write_bytes(bytes([file.read_bytes()[0]]) + b"x" + file.read_bytes()[2:]),
        lambda file: (file.unlink(), os.mkfifo(file)),
        lambda file: (file.unlink(), file.symlink_to("/dev/zero")),
        lambda file: os.truncate(file, 13_000_000_000),
    ],
    ids=["empty", "cut", "a byte short", "zeros", "garbage", "a byte changed", "a pipe", "an endless link", "huge"],
)
def test_a_damaged_cache_is_said_compiled_afresh_and_mended(cache, monkeypatch, harm):
    """Breaks if a torn file stops every later start, costs every later start some seconds, or is run."""
    made = compilations(monkeypatch)
    harm(cache)
    assert law_again() == f"the compiled law on disk was damaged ({cache}): it is compiled afresh"
    assert len(made) == 1
    assert law_again() == ""
    assert len(made) == 1, "mended: the next start is fast again"


@pytest.mark.parametrize("harm", [lambda file: file.chmod(0o666), lambda file: os.chown(file, 65534, 65534)])
def test_code_that_another_user_may_have_written_is_not_run(cache, monkeypatch, harm):
    """Breaks if somebody who can write to a cache that users share runs code as each of them."""
    try:
        harm(cache)
    except PermissionError:
        pytest.skip("only root gives files away")
    made = compilations(monkeypatch)
    assert law_again() == f"the compiled law on disk is open to other users ({cache}): it is compiled afresh"
    assert law_again() == ""
    assert len(made) == 1
    assert (cache.stat().st_uid, cache.stat().st_mode & 0o022) == (os.geteuid(), 0)


def test_what_is_kept_is_open_to_nobody_else_whatever_a_process_allows(cache):
    cache.unlink()
    before = os.umask(0)
    try:
        assert law_again() == ""
    finally:
        os.umask(before)
    assert cache.stat().st_mode & 0o777 == 0o644


def test_a_cache_that_is_gone_or_old_is_filled_again_without_a_word(cache, monkeypatch):
    made = compilations(monkeypatch)
    cache.unlink()
    assert law_again() == law_again() == ""
    for part, value in (("numba", "0.1"), ("mujoco", "0.1")):
        monkeypatch.setitem(identity.IMPORTED, part, value)
        assert law_again() == law_again() == ""
    monkeypatch.setattr(compiled, "MAGIC", 0.5)
    assert law_again() == law_again() == ""
    shutil.rmtree(cache.parent)
    assert law_again() == law_again() == ""
    assert len(made) == 5


def test_machines_that_share_a_folder_keep_a_file_each(cache, monkeypatch):
    """Breaks if the nodes of a cluster replaced each other's, or one ran what another's processor can do."""
    made = compilations(monkeypatch)
    ours = compiled._machine()
    for features in ("-avx", ours.features, "-avx"):
        monkeypatch.setattr(compiled, "_machine", lambda features=features: ours._replace(features=features))
        assert law_again() == ""
    assert len(made) == 1
    assert len(list(cache.parent.iterdir())) == 2


def test_code_that_needs_more_than_this_process_has_is_not_run(cache, monkeypatch):
    """LLVM would end the process, or leave a call to nowhere."""
    made = compilations(monkeypatch)
    link = compiled._linked
    monkeypatch.setattr(compiled, "_linked", lambda name, code: link("no such function", code))
    said = "the compiled law is not kept between processes (LLVM alone cannot load it on this system)"
    assert law_again() == said
    assert len(made) == 1
    monkeypatch.undo()
    assert not compiled._linked("no_clock", b"")


def test_a_cache_that_cannot_be_written_is_said_and_the_law_works(cache):
    cache.unlink()
    cache.mkdir()
    said = law_again()
    assert said.startswith(f"the compiled law is not kept between processes ({cache}: cannot be ")
    assert said.endswith("; set NUMBA_CACHE_DIR to a writable folder")


def test_a_full_disk_under_the_cache_is_said_and_the_law_works(cache, monkeypatch):
    cache.unlink()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    made = compilations(monkeypatch)
    assert f"({cache}: cannot be written (No space left on device))" in law_again()
    assert len(made) == 1, "compiled once, not once more for itself"
    assert not list(cache.parent.iterdir())


def test_code_that_another_process_put_in_its_place_is_not_run(cache, monkeypatch):
    """Two processes with different laws name their files alike: one would run the law of the other."""

    def law(places: offsets.Offsets) -> Callable[[], float]:
        first = float(places[0])
        return lambda: first

    made = compilations(monkeypatch)
    for first in (800, 8, 8, 800):
        address, said = kernel._compile(law, "float64()", offsets.Offsets(*range(first, first + 9)))
        assert said == ""
        assert ctypes.CFUNCTYPE(ctypes.c_double)(address)() == first
    assert len(made) == 3, "compiled afresh, and then the right one is there"


def test_what_is_wrong_with_the_cache_is_said_once_for_the_whole_law(monkeypatch, caplog):
    """As in a container with a read-only home and package."""
    # the law itself would take seconds to compile
    monkeypatch.setattr(kernel, "_passive", lambda _: lambda model, data: None)
    monkeypatch.setattr(kernel, "_sensor", lambda _: lambda model, data, stage: None)
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setattr(compiled, "write_bytes", refuse)
    kernel._callbacks.__wrapped__()
    (said,) = (record.getMessage() for record in caplog.records)
    assert said.startswith("the compiled law is not kept between processes (")
    assert "NUMBA_CACHE_DIR" in said


def refuse(file: Path, content: bytes, mode: int) -> None:
    raise OutputError(f"{file}: cannot be written (Read-only file system)")


def test_with_a_cache_there_is_nothing_to_say(caplog):
    kernel._callbacks.__wrapped__()
    assert not caplog.records


def test_compiled_functions_live_on():
    """MuJoCo holds bare pointers into them."""
    assert {ctypes.cast(callback, ctypes.c_void_p).value for callback in kernel._callbacks()[:3]} <= set(compiled._kept)


def test_sensors_are_written_when_their_stage_is_reached_and_not_before(law, system):
    model, layout = system
    data = start(model, walled(), layout)
    data.qpos[:] = [0.4, 0.3, 0.2, 0.1]
    mujoco.mj_forward(model, data)
    expected = data.sensordata.copy()
    sensor = kernel._callbacks()[1]
    for stage in (mujoco.mjtStage.mjSTAGE_POS, mujoco.mjtStage.mjSTAGE_VEL, mujoco.mjtStage.mjSTAGE_ACC):
        data.sensordata[:] = 7.0
        sensor(model._address, data._address, int(stage))
        assert (data.sensordata[:8] == (expected[:8] if stage == mujoco.mjtStage.mjSTAGE_ACC else 7.0)).all()


def test_end_of_a_collision_is_seen_by_the_law(law):
    """Apart and untouched: over. Coming closer without touching yet: not over."""
    e = envelope([(0, 0), (10, 1000)], 100)
    coming = chain([33e3, 33e3], [e], [1.0, 0.0], gap=0.5)
    leaving = chain([33e3, 33e3], [e], [0.0, 1.0], gap=0.5)
    assert step_once(build(coming), coming).userdata[Head.OVER] == 0.0
    assert step_once(build(leaving), leaving).userdata[Head.OVER] == 1.0


def test_a_run_whose_law_was_replaced_is_an_error(standard):
    """Another's callback, set inside installed(), would else give a result without any force."""
    with kernel.installed():
        mujoco.set_mjcb_passive(None)
        with pytest.raises(EngineError, match="device law was not called"):
            run(standard)
