"""What the compiled law counts on the way, against the same counted afterwards from the history of a collision."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pytest
from builders import Alone, chain, envelope

from trainmj.collision import kernel
from trainmj.collision.block import Layout
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.envelope import Array
from trainmj.collision.fields import ELEMENT, Car, Element, Head, Joint, Point
from trainmj.collision.model import build
from trainmj.collision.simulation import start

ENVELOPES = (
    envelope([(0, 0), (10, 1000), (500, 1000)], 200, 50),
    envelope([(0, 0), (73, 300), (80, 300), (80.3, 400), (80.6, 0), (95, 0), (95.2, 1250), (900, 1250)], 356, 11),
    envelope([(0, 0), (1, 500), (300, 500)], 30, 700),  # rises faster than it unloads
    envelope([(0, 0), (5, 0), (5, 200), (20, 200), (20, 100), (400, 900)], 90),  # empty stroke, two jumps
)
MASS = (33e3, 20e3, 47e3, 26e3)
AGAINST_A_WALL = chain(MASS, ENVELOPES, (6.0,) * 4, n_moving=4, friction=0.05, step=1e-4, gap=0.02)
TWO_TRAINS = chain(MASS, ENVELOPES[:3], (9.0, 9.0, 0.0, -1.0), n_moving=2, friction=0.3, step=1e-4, steps_per_record=7)

TO_A_STANDSTILL = chain(MASS, ENVELOPES[:3], (1.5, 1.5, 0.0, 0.0), n_moving=2, friction=0.5, step=1e-4)


@dataclass
class History:
    """Every evaluation of the law: (n,) times, (n, n_vehicle) positions, speeds and forces, and what it left."""

    time: Array
    position: Array
    speed: Array
    passive: Array
    sensors: Array
    block: Array


def ride(case: Chain, layout: Layout, n: int) -> History:
    model = build(case, layout)
    data = start(model, case, layout)
    rows = []
    with kernel.installed():
        for _ in range(n):
            before = data.time, data.qpos.copy(), data.qvel.copy()
            mujoco.mj_step(model, data)
            rows.append((*before, data.qfrc_passive.copy(), data.sensordata.copy()))
    return History(*(np.array(column) for column in zip(*rows, strict=True)), data.userdata.copy())


@dataclass
class Counted:
    """The same from the history alone: fields of interfaces, of vehicles, and the impulse of rails and wall."""

    joint: dict[Joint, Array]
    element: dict[Element, Array]
    car: dict[Car, Array]
    impulse: float
    passive: Array
    sensors: Array


def count(case: Chain, h: History) -> Counted:
    """With whole histories instead of running sums; the force law is the readable one."""
    m = len(case.interfaces)
    walled = case.interfaces[-1].right == WALL
    position, speed = (np.column_stack([x, np.zeros(len(x))]) if walled else x for x in (h.position, h.speed))
    u, rate = -np.diff(position), -np.diff(speed)
    force, plastic = np.zeros_like(u), np.zeros_like(u)
    for k, interface in enumerate(case.interfaces):
        pressed = Alone(interface.elements[0])
        for n in range(len(u)):
            force[n, k] = pressed.to(float(u[n, k]), float(rate[n, k]))
            plastic[n, k] = pressed.of(ELEMENT.STATE_0)
    apart = np.where(np.arange(m) == case.front, -case.gap, 0.0)
    travel = np.diff(u, axis=0, prepend=apart[None])
    moved = np.diff(plastic, axis=0, prepend=0.0)
    mean = (force + np.vstack([np.zeros(m), force[:-1]])) / 2
    spring = np.maximum(0.0, np.array([i.devices[0].envelope.stiffness for i in case.interfaces]) * (u - plastic))
    lost = np.cumsum(mean * moved + (force - spring) * travel, axis=0)
    pushed = [np.flatnonzero(column) for column in force.T]
    joint = {
        Joint.STROKE: u[-1],
        Joint.FORCE: force[-1],
        Joint.STROKE_MAX: u.max(axis=0),
        Joint.STROKE_MAX_TIME: h.time[u.argmax(axis=0)],
        Joint.FORCE_MAX: force.max(axis=0),
        Joint.FIRST_FORCE_TIME: np.array([h.time[n[0]] for n in pushed]),
        Joint.LAST_FORCE_TIME: np.array([h.time[n[-1]] for n in pushed]),
    }
    element = {
        Element.STATE_0: plastic[-1],
        Element.STROKE: u[-1],
        Element.FORCE: force[-1],
        Element.DISSIPATED: lost[-1],
        Element.VISCOUS: ((force - spring) * travel).sum(axis=0),
        Element.STROKE_MAX: np.maximum(0.0, u.max(axis=0)),
    }
    pushes = np.column_stack([np.zeros(len(u)), force, *([] if walled else [np.zeros(len(u))])])
    net = pushes[:, :-1] - pushes[:, 1:]
    rails = np.clip(-(case.mass * h.speed / case.step + net), -case.friction, case.friction)
    dt = np.diff(h.time)[:, None]
    car = {
        Car.SPEED: h.speed[-1],
        Car.RAIL: rails[-1],
        Car.FRICTION_WORK: -(rails[:-1] * (h.speed[1:] + h.speed[:-1]) / 2 * dt).sum(axis=0),
        Car.DEVICE_PEAK: np.abs(net / case.mass).max(axis=0),
        Car.TOTAL_PEAK: np.abs((net + rails) / case.mass).max(axis=0),
    }
    impulse = float((rails[:-1] * dt).sum() - (force[:-1, -1:] * dt).sum() * walled)
    return Counted(joint, element, car, impulse, net + rails, np.hstack([force, lost]))


@pytest.mark.parametrize(
    ("case", "n"), [(AGAINST_A_WALL, 150), (AGAINST_A_WALL, 2500), (TWO_TRAINS, 700), (TO_A_STANDSTILL, 2500)]
)
def test_everything_counted_is_what_the_history_says(case, n):
    layout = Layout.of(case)
    h = ride(case, layout, n)
    c = count(case, h)
    for fields, view in ((c.joint, layout.joint), (c.element, layout.element)):
        for field, expected in fields.items():
            found = view(h.block, field)
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max()), field.name
    for field, expected in c.car.items():
        assert layout.car(h.block, field) == pytest.approx(expected, rel=1e-9, abs=1e-9), field.name
    assert layout.point(h.block, Point.FRICTION_LIMIT).tolist() == case.friction.tolist()
    assert layout.point(h.block, Point.SPEED).tolist() == h.speed[-1].tolist()
    assert h.passive == pytest.approx(c.passive, rel=1e-9, abs=1e-6)
    assert h.sensors[:, : c.sensors.shape[1]] == pytest.approx(c.sensors, rel=1e-9, abs=1e-6)
    assert h.block[Head.IMPULSE] == pytest.approx(c.impulse, rel=1e-9)
    assert h.block[Head.TIME] == h.time[-1]
    parameters = layout.block(case)
    for field in list(Element)[: Element.STROKE]:
        if field not in (Element.SEGMENT, Element.SEGMENT_2):
            assert layout.element(h.block, field).tolist() == layout.element(parameters, field).tolist(), field.name
    curves = slice(layout.size - layout.n_value, layout.size)
    assert h.block[curves].tolist() == parameters[curves].tolist(), "the law writes into its parameters"


def test_those_histories_reach_what_is_counted():
    """Guards the test above: crushing, rebound, standing and rolling vehicles, all within its histories."""
    for case in (AGAINST_A_WALL, TO_A_STANDSTILL):
        h = ride(case, Layout.of(case), 2500)
        c = count(case, h)
        assert (c.element[Element.STATE_0] > 1e-3).sum() > 1, "crushing"
        assert (c.joint[Joint.STROKE_MAX] > c.joint[Joint.STROKE] + 1e-3).any(), "rebound"
        assert (c.joint[Joint.FIRST_FORCE_TIME] > 0).any(), "later contact"
        assert (c.car[Car.FRICTION_WORK] > 0).all(), "rolling"
    still = np.abs(h.speed[:, -1]) < 1e-9
    pushed = c.sensors[:, 2] > 0
    assert (still & pushed).sum() > 3, "standing although it is pushed"
    assert (still & ~pushed)[-1], "standing in the end"


# over, or not


@pytest.mark.parametrize(
    ("speeds", "gap", "friction", "over"),
    [
        ((0.02, 0.0), 0.5, 0.0, False),  # coming closer
        ((0.005, 0.0), 0.5, 0.0, True),  # slower than that counts
        ((0.0, 1.0), 0.5, 0.0, True),  # leaving
        ((1.0, 0.0), -0.02, 4.0, False),  # pressed together
        ((2.0, 2.0), -0.02, 4.0, False),  # pressed together, and none comes closer
        ((1e-5, 0.0), -0.02, 4.0, False),  # pressed together, and hardly moving
        ((1e-7, -1e-7), -0.02, 4.0, True),  # ... and standing: friction holds what the devices press
        ((1e-7, -1e-7), -0.02, 3.0, False),  # ... which is more than it can hold: 1000 kN against 971 kN
        ((1e-6, 0.0), -0.02, 4.0, True),  # at that speed itself
        ((0.0, -1e-5), -0.02, 4.0, False),
    ],
)
def test_over_is_when_nothing_presses_or_comes_closer_or_all_stand(speeds, gap, friction, over):
    case = chain([33e3, 33e3], ENVELOPES[:1], speeds, gap=gap, friction=friction)
    layout = Layout.of(case)
    assert ride(case, layout, 1).block[Head.OVER] == float(over)


def test_a_collision_that_goes_on_after_a_standstill_is_not_over():
    """Breaks if two that are pressed together and held by nothing count as standing, because they have no speed yet."""
    case = chain([33e3, 33e3], ENVELOPES[:1], (0.0, 0.0), gap=-0.02)
    for n in (1, 2):
        assert ride(case, Layout.of(case), n).block[Head.OVER] == 0.0


# records


def rested(case: Chain, n: int, n_ring: int) -> tuple[Layout, History]:
    layout = Layout.of(case, n_ring=n_ring)
    return layout, ride(case, layout, n)


@pytest.mark.parametrize("n", [1, 7, 8, 15, 29, 36])
def test_records_are_the_latest_speeds_at_every_stride(n):
    layout, h = rested(TWO_TRAINS, n, n_ring=3)
    taken = h.speed[:: TWO_TRAINS.steps_per_record]
    assert h.block[Head.RECORDS] == len(taken)
    expected = np.zeros((3, 4))
    for k, row in enumerate(taken):
        expected[k % 3] = row
    assert layout.ring(h.block).tolist() == expected.tolist()
    assert h.block[Head.DONE] == 0.0


def test_every_step_may_be_a_record():
    case = replace(TWO_TRAINS, steps_per_record=1)
    layout, h = rested(case, 5, n_ring=9)
    assert h.block[Head.RECORDS] == 5.0
    assert layout.ring(h.block)[:5].tolist() == h.speed.tolist()


def test_after_the_last_record_the_law_rests():
    case = replace(TWO_TRAINS, time_limit=2.1e-3)  # the start and three more
    _, three = rested(case, 21, n_ring=9)
    assert (three.block[Head.RECORDS], three.block[Head.DONE]) == (3.0, 0.0)
    _, done = rested(case, 22, n_ring=9)
    assert (done.block[Head.RECORDS], done.block[Head.DONE]) == (4.0, 1.0)
    _, later = rested(case, 40, n_ring=9)
    assert later.block.tolist() == done.block.tolist()
    assert (later.passive[22:] == 0.0).all()


def test_the_law_rests_at_the_record_after_the_end():
    """Two that leave each other are over at once, which a record at the start says."""
    apart = chain([33e3, 33e3], ENVELOPES[:1], (0.0, 1.0), gap=0.5, steps_per_record=7)
    _, h = rested(apart, 1, n_ring=2)
    assert (h.block[Head.OVER], h.block[Head.DONE], h.block[Head.RECORDS]) == (1.0, 1.0, 1.0)
    # 20 mm of a spring unload within a few hundred steps: over in between records, done at the next
    case = chain([33e3, 33e3], ENVELOPES[:1], (0.0, 0.0), gap=-1e-6, step=1e-3, steps_per_record=50)
    _, h = rested(case, 200, n_ring=9)
    assert h.block[Head.DONE] == 1.0
    assert h.block[Head.TIME] == pytest.approx((h.block[Head.RECORDS] - 1) * 50e-3), "done at a record"


def test_the_law_rests_at_a_record_that_is_not_finite():
    layout = Layout.of(TWO_TRAINS, n_ring=4)
    model = build(TWO_TRAINS, layout)
    data = start(model, TWO_TRAINS, layout)
    with kernel.installed():
        mujoco.mj_step(model, data, nstep=7)
        data.userdata[Head.IMPULSE] = np.inf
        data.time, data.qvel[0] = 7e-4, np.nan
        mujoco.mj_forward(model, data)
    assert data.userdata[Head.DONE] == 1.0
    assert data.userdata[Head.RECORDS] == 2.0


def test_without_a_stride_the_law_never_rests():
    apart = chain([33e3, 33e3], ENVELOPES[:1], (0.0, 1.0), gap=0.5)
    h = ride(apart, Layout.of(apart), 30)
    assert (h.block[Head.OVER], h.block[Head.DONE], h.block[Head.RECORDS]) == (1.0, 0.0, 0.0)
    assert h.block[Head.TIME] == h.time[-1]
