"""The device law, compiled, as the passive-force callback of MuJoCo.

MuJoCo calls it once in each step with its own model and data, without Python and without the interpreter's lock::

    with installed():
        mujoco.mj_step(model, data, nstep=8000)

It applies the elements of each interface (:mod:`trainmj.collision.element`) and, to each vehicle, the grade, and rail
friction and brake: the force that would stop the vehicle within the step, at most what rail and brake can give, so that
a standing vehicle stays where it is. All parameters and state are in mjData.userdata (:mod:`trainmj.collision.block`);
simulations without such a block are left alone.

The state moves once per step: a second evaluation at the same time returns the same forces. Integrators that evaluate
forces several times a step would move it several times; :mod:`trainmj.collision.model` refuses them. Where the block
asks for it, a step over a narrow part of a curve is made in smaller ones: the law sets the timestep of the model, which
belongs to one simulation at a time.

The places of MuJoCo's fields come from :mod:`trainmj.collision.offsets` and are compiled in.
"""

from __future__ import annotations

import ctypes
import logging
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from trainmj.collision import contact, plane
from trainmj.collision.block import MAGIC
from trainmj.collision.body import strain
from trainmj.collision.compiled import address_of
from trainmj.collision.element import narrowest
from trainmj.collision.fields import (
    CAR,
    ELEMENT,
    ENDS,
    FRAME,
    HEAD,
    JOINT,
    MEMBER,
    N_CAR,
    N_ELEMENT,
    N_ENDS,
    N_FRAME,
    N_HEAD,
    N_JOINT,
    N_MEMBER,
    N_POINT,
    N_WHEEL,
    POINT,
    WHEEL,
    Block,
)
from trainmj.collision.interrupts import held_back
from trainmj.collision.jitable import from_place as _from
from trainmj.collision.jitable import inlined, jitable
from trainmj.collision.jitable import integer_at as _size
from trainmj.collision.jitable import place_at as _in
from trainmj.collision.jitable import stored_at as _at
from trainmj.collision.joint import APPROACH_SPEED, count, peaks, press, swing
from trainmj.collision.law import SERIES
from trainmj.collision.mj import Shared, mujoco, put, undisturbed
from trainmj.collision.offsets import Offsets, field_offsets

log = logging.getLogger(__name__)

STILL_SPEED = 1e-6
"""... or when every vehicle is slower than this [m/s]."""

WIDE = 2.0
"""Steps are made smaller where a part of a curve is narrower than this many of them."""

PARTS = 16.0
"""Smaller steps that then go into the narrowest part."""

MOST_PARTS = 4096.0
"""Most smaller steps in a whole one."""

LAST_STAGE = int(mujoco.mjtStage.mjSTAGE_ACC)


@contextmanager
def installed() -> Iterator[None]:
    """Run MuJoCo with the device law; on leaving, restore the callbacks that were there.

    The block may be nested and entered from several threads: the law stays until the last one leaves. Meanwhile no
    other callback is called, MuJoCo's timers, which read the clock a dozen times a step, stand still, and its warnings
    go to the log.

    Raises:
        EngineError: if the running MuJoCo does not have the fields the law needs.
    """
    with undisturbed(), _law.held():
        yield


@cache
def _callbacks() -> tuple[Any, Any, Any, Any]:
    """The compiled passive, sensor and time callbacks and the one for warnings, as ctypes function pointers: those of
    the first slots.
    """
    offsets = field_offsets()
    void, pair = None, (ctypes.c_void_p, ctypes.c_void_p)
    with held_back():
        made = [
            (ctypes.CFUNCTYPE(void, *pair), *_compile(_passive, "void(voidptr, voidptr)", offsets)),
            (ctypes.CFUNCTYPE(void, *pair, ctypes.c_int), *_compile(_sensor, "void(voidptr, voidptr, intc)", offsets)),
            (ctypes.CFUNCTYPE(ctypes.c_double), *_compile(_no_clock, "float64()", offsets)),
        ]
    troubles = [trouble for *_, trouble in made if trouble]
    if troubles:
        log.warning("%s", troubles[0])
    passive, sensor, clock = (kind(address) for kind, address, _ in made)
    return passive, sensor, clock, _warned


def _compile(factory: Callable[[Offsets], Any], signature: str, offsets: Offsets) -> tuple[int, str]:
    """Address of a C function, and what was wrong with the copy of it on disk."""
    return address_of(factory, signature, offsets)


def _note(text: bytes) -> None:
    """Keep a warning of MuJoCo's from its log file and from someone's handler: the status of the case says it."""
    log.debug("%s", text.decode(errors="replace"))


_warned = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(_note)
_law = Shared(lambda: put(_callbacks()), lambda: put([]))


def _passive(offsets: Offsets) -> Any:
    at_nuserdata, at_timestep, at_time, at_userdata, at_qpos, at_qvel, at_passive, at_inertia, _ = offsets
    magic = MAGIC

    def passive(model: Any, data: Any) -> None:
        """Forces of all interfaces, rails, brakes and grade on the vehicles; moves the state where the time is new."""
        if _size(model, at_nuserdata) < N_HEAD:
            return
        s = _at(data, at_userdata)
        if s[HEAD.MAGIC] != magic or s[HEAD.DONE] != 0.0:
            return
        n = int(s[HEAD.N_VEHICLE])
        time = _in(data, at_time)[0]
        qpos, qvel, inertia = _at(data, at_qpos), _at(data, at_qvel), _at(data, at_inertia)
        out = _at(data, at_passive)
        if s[HEAD.WITHIN] != 0.0:
            if time != s[HEAD.ASKED]:  # MuJoCo may ask again at the same time: the state has moved already
                s[HEAD.ASKED] = time
                _within(s, n, qpos, qvel, inertia, _in(model, at_timestep)[0])
            _give(s, POINT.GIVEN, out)
            return
        if s[HEAD.PLANE] != 0.0:
            if time != s[HEAD.TIME]:
                _in(model, at_timestep)[0] = _in_plane(s, n, qpos, qvel, inertia, time)
            plane.give(s, out)
        else:
            if time != s[HEAD.TIME]:
                _in(model, at_timestep)[0] = _along_track(s, n, qpos, qvel, inertia, time)
            _give(s, POINT.FORCE, out)

    return passive


@jitable
def _give(s: Block, field: int, out: Any) -> None:
    """Hand a force of every point to MuJoCo."""
    p, joints = int(s[HEAD.POINTS]), int(s[HEAD.JOINTS])
    i = 0
    while p < joints:
        out[i] += s[p + field]
        p += N_POINT
        i += 1


@jitable
def _within(s: Block, n: int, qpos: Any, qvel: Any, inertia: Any, whole: float) -> None:
    """Follow the points through one step of MuJoCo's in smaller ones, and find the forces that take MuJoCo there too.

    The smaller steps are those that MuJoCo would make, to the last bit. Its own step then ends where they do: the speed
    that it keeps is the mean one of its step, and the force that it is given is what changes one mean into the next.
    """
    points = (int(s[HEAD.JOINTS]) - int(s[HEAD.POINTS])) // N_POINT
    q = _from(s, int(s[HEAD.MOTION]))
    v = _from(q, points)
    lightness = _from(v, points)
    for i in range(points):
        s[HEAD.STRAYED] = max(s[HEAD.STRAYED], abs(qpos[i] - q[i]) / (1.0 + abs(q[i])))
        lightness[i] = 1.0 / inertia[i]
    left = s[HEAD.WITHIN]
    while left > 0.0:
        step = _along_track(s, n, q, v, inertia, s[HEAD.CLOCK])
        if s[HEAD.DONE] != 0.0:
            break
        s[HEAD.CLOCK] += step
        p = int(s[HEAD.POINTS])
        for i in range(points):
            v[i] += step * (s[p + POINT.FORCE] * lightness[i])
            q[i] += step * v[i]
            p += N_POINT
        if s[HEAD.PARTS_LEFT] == 0.0:
            left -= 1.0
    p = int(s[HEAD.POINTS])
    for i in range(points):
        s[p + POINT.GIVEN] = inertia[i] * ((q[i] - qpos[i]) / whole - qvel[i]) / whole
        p += N_POINT


@jitable
def _along_track(s: Block, n: int, qpos: Any, qvel: Any, inertia: Any, time: float) -> float:
    """Move the state to a new time, find the forces there, and say how long the step from there is [s]."""
    return _evaluate(s, n, qpos, qvel, inertia, time, False)


@jitable
def _in_plane(s: Block, n: int, qpos: Any, qvel: Any, inertia: Any, time: float) -> float:
    """The same in the vertical plane."""
    return _evaluate(s, n, qpos, qvel, inertia, time, True)


@inlined
def _evaluate(s: Block, n: int, qpos: Any, qvel: Any, inertia: Any, time: float, in_plane: bool) -> float:
    """The same for both, each of which is compiled without what is of the other."""
    whole = s[HEAD.PARTS_LEFT] == 0.0
    step = _next_step(s, qpos, qvel, in_plane)
    elapsed = time - s[HEAD.TIME] if s[HEAD.TIME] >= 0.0 else 0.0
    if in_plane:
        active, peaked, wall = plane.devices(s, qpos, qvel, elapsed, time)
        plane.carry(s, qpos, qvel, elapsed, time)
    else:
        active, peaked, wall = _devices(s, qpos, qvel, elapsed, time)
        if s[HEAD.N_MEMBER] > 0.0:
            _members(s, qpos, qvel, elapsed, time)
    still, closing = _vehicles(s, n, qvel, inertia, step, elapsed, time, wall, in_plane)
    if s[HEAD.WINDOW] != 0.0:
        _windows(s, n, step, whole)
    if peaked:
        peaks(s)
    s[HEAD.TIME] = time
    quiet = still or not (active or closing)
    if not quiet:
        s[HEAD.BUSY] = time
    # a body that swings may have its largest forces after the last touch, and may touch again
    s[HEAD.OVER] = 1.0 if quiet and time - s[HEAD.BUSY] >= s[HEAD.LINGER] else 0.0
    if whole:
        _record(s, n)
    return step


@inlined
def _next_step(s: Block, qpos: Any, qvel: Any, in_plane: bool) -> float:
    """The step from here [s]: a whole one, or a part where the vehicles come to a narrow part of a curve."""
    s[HEAD.STEPS] += 1.0
    if s[HEAD.PARTS_LEFT] > 0.0:
        s[HEAD.PARTS_LEFT] -= 1.0
        return s[HEAD.PART]
    s[HEAD.GRID] += 1.0
    step = s[HEAD.STEP]
    if s[HEAD.REFINES] == 0.0:
        return step
    if in_plane:
        width = plane.way_to_narrow(s, step, qpos, qvel)
        parts = max(1.0, math.ceil(PARTS / width)) if width < WIDE else 1.0
    else:
        parts = _parts(s, step, qpos, qvel)
    return _parted(s, parts)


@jitable
def _parts(s: Block, step: float, qpos: Any, qvel: Any) -> float:
    """In how many smaller steps a whole one is made, along the track."""
    m = int(s[HEAD.N_INTERFACE])
    joints = int(s[HEAD.JOINTS])
    parts = 1.0
    for k in range(m):
        j = joints + N_JOINT * k
        left, right = int(s[j + JOINT.LEFT]), int(s[j + JOINT.RIGHT])
        u = qpos[left] - (qpos[right] if right >= 0 else 0.0)
        rate = qvel[left] - (qvel[right] if right >= 0 else 0.0)
        way = abs(rate) * step
        e = int(s[j + JOINT.FIRST])
        for _ in range(int(s[j + JOINT.COUNT])):
            width = narrowest(s, e, u, rate, 2.0 * way)
            if width < WIDE * way:
                parts = max(parts, math.ceil(PARTS * way / width))
            e += int(s[e + ELEMENT.NEXT])
    return parts


@jitable
def _parted(s: Block, parts: float) -> float:
    """The first of a number of smaller steps that a whole one is made in."""
    parts = min(parts, MOST_PARTS)
    s[HEAD.PARTS_LEFT] = parts - 1.0
    s[HEAD.PART] = s[HEAD.STEP] / parts
    return s[HEAD.PART]


@jitable
def _devices(s: Block, qpos: Any, qvel: Any, elapsed: float, time: float) -> tuple[bool, bool, float]:
    """Move the devices and add up their forces on the points.

    Returns:
        Whether one carries force, or draw gear comes taut; whether one had its largest force on the way; the impulse of
        the wall.
    """
    m = int(s[HEAD.N_INTERFACE])
    points, joints = int(s[HEAD.POINTS]), int(s[HEAD.JOINTS])
    follows = s[HEAD.FOLLOWS] != 0.0
    active = peaked = False
    wall = 0.0
    for k in range(m):
        j = joints + N_JOINT * k
        left, right = int(s[j + JOINT.LEFT]), int(s[j + JOINT.RIGHT])
        u = qpos[left] - (qpos[right] if right >= 0 else 0.0)  # the wall stands at 0
        rate = qvel[left] - (qvel[right] if right >= 0 else 0.0)
        force, late = 0.0, 0.0
        e = int(s[j + JOINT.FIRST])
        for _ in range(int(s[j + JOINT.COUNT])):
            one, taut, one_peaked = press(s, j, e, u, rate, elapsed, time)
            force += one
            active |= taut
            peaked |= one_peaked
            if follows:
                late += s[e + ELEMENT.SIGN] * s[e + ELEMENT.LATE]
            e += int(s[e + ELEMENT.NEXT])
        active |= force != 0.0
        if right < 0:
            wall -= s[j + JOINT.FORCE] * elapsed + s[j + JOINT.LATE]
        if follows:
            s[j + JOINT.LATE] = late
            s[points + N_POINT * left + POINT.LATE] -= late
            if right >= 0:
                s[points + N_POINT * right + POINT.LATE] += late
        count(s, j, u, force, time)
        s[points + N_POINT * left + POINT.LOAD] -= force
        if right >= 0:
            s[points + N_POINT * right + POINT.LOAD] += force
    return active, peaked, wall


@jitable
def _members(s: Block, qpos: Any, qvel: Any, elapsed: float, time: float) -> None:
    """Move the members of bodies and add up their forces on the points."""
    points = int(s[HEAD.POINTS])
    m = int(s[HEAD.MEMBERS])
    for _ in range(int(s[HEAD.N_MEMBER])):
        left, right = int(s[m + MEMBER.LEFT]), int(s[m + MEMBER.RIGHT])
        force = strain(s, m, qpos[left] - qpos[right], qvel[left] - qvel[right], elapsed)
        car = int(s[m + MEMBER.CAR])
        if car > 0:
            s[car + CAR.SHORTENED] += s[m + MEMBER.STROKE]
            if s[m + MEMBER.STROKE] >= s[m + MEMBER.LENGTH] and s[m + MEMBER.END_TIME] < 0.0:
                s[m + MEMBER.END_TIME] = time
        s[points + N_POINT * left + POINT.INNER] -= force
        s[points + N_POINT * right + POINT.INNER] += force
        m += N_MEMBER


@inlined
def _vehicles(
    s: Block, n: int, qvel: Any, inertia: Any, step: float, elapsed: float, time: float, wall: float, in_plane: bool
) -> tuple[bool, bool]:
    """The whole force on every point, with rail friction and brake, and what it does to the vehicles.

    Returns:
        Whether all stand; whether two come together, or may yet.
    """
    c, p = N_HEAD, int(s[HEAD.POINTS])
    meeting = int(s[HEAD.JOINTS]) + N_JOINT * int(s[HEAD.FRONT])
    touching = s[meeting + JOINT.FORCE] > 0.0
    first = touching and s[meeting + JOINT.FIRST_FORCE_TIME] == time
    rolling = s[HEAD.ROLLING] != 0.0
    follows = not in_plane and s[HEAD.FOLLOWS] != 0.0
    begins = s[HEAD.TIME] < 0.0
    approach = STILL_SPEED if rolling else APPROACH_SPEED
    impulse = late = 0.0
    still, closing = True, False
    speed_behind = accelerated_behind = 0.0
    i = 0
    for car in range(n):
        count = int(s[c + CAR.POINTS])
        net, rail, slope, whole, momentum, may = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if car + 1 == n:
            impulse += wall
        for _ in range(count):
            load, inner = s[p + POINT.LOAD], s[p + POINT.INNER]
            s[p + POINT.LOAD] = s[p + POINT.INNER] = 0.0
            if in_plane:
                f = int(s[HEAD.FRAMES]) + N_FRAME * car
                v, mass, before = qvel[int(s[f + FRAME.DOF])], s[c + CAR.MASS], s[c + CAR.SPEED]
                at_rail = plane.rail_speed(s, f, qvel)
            else:
                v, mass, before = qvel[i], inertia[i], s[p + POINT.SPEED]
                at_rail = v
            limit, held = s[p + POINT.FRICTION_LIMIT], s[p + POINT.FRICTION]
            if follows:
                late = s[p + POINT.LATE] / step
                s[p + POINT.LATE] = 0.0
                inner += late
                if begins:  # speeds are those of half a step before, but for the first ones
                    limit *= 0.5
            work = 0.5 * held * (s[p + POINT.SPEED] + at_rail) * elapsed
            grade = 0.0
            if rolling:
                grade = s[p + POINT.GRADE]
                s[c + CAR.GRADE_WORK] -= 0.5 * grade * (before + v) * elapsed
                braking = s[p + POINT.BRAKING]
                if braking > 0.0:  # rail and brake share the work
                    braked = work * braking / (limit + braking)
                    s[c + CAR.BRAKE_WORK] -= braked
                    work -= braked
                braking = _braking(s, p, time)
                s[p + POINT.BRAKING] = braking
                limit += braking
            s[c + CAR.FRICTION_WORK] -= work
            impulse += (held + grade) * elapsed
            # the friction that would stop it within this step, within what rail and brake can give
            friction = min(limit, max(-limit, -(mass * v / step + load + inner + grade)))
            force = load + inner + friction + grade
            if in_plane:
                plane.hold(s, f, friction)
            s[p + POINT.FORCE] = force
            if follows:
                force -= late
            s[p + POINT.SPEED] = at_rail
            s[p + POINT.FRICTION] = friction
            if count > 1:
                s[p + POINT.PEAK] = max(s[p + POINT.PEAK], abs(force) / mass)
            net += load
            rail += friction
            slope += grade
            whole += force
            may += limit
            momentum += mass * v
            p += N_POINT
            i += 1
        mass = s[c + CAR.MASS]
        speed = v if count == 1 else momentum / mass
        swing(s, c, net)
        contact.follow(s, c, car, net, elapsed, time)
        s[c + CAR.NET], s[c + CAR.RAIL], s[c + CAR.SLOPE] = net, rail, slope
        s[c + CAR.SPEED] = speed
        if count > 1:
            s[c + CAR.SHORTENED_MAX] = max(s[c + CAR.SHORTENED_MAX], s[c + CAR.SHORTENED])
            s[c + CAR.SHORTENED] = 0.0
        if touching:
            s[c + CAR.SPEED_LAST] = speed
            if first:
                s[c + CAR.SPEED_FIRST] = speed
        if abs(whole) > s[c + CAR.TOTAL_FORCE]:
            s[c + CAR.TOTAL_FORCE] = abs(whole)
            s[c + CAR.TOTAL_PEAK] = abs(whole) / mass
        if abs(speed) > STILL_SPEED or abs(net + slope) > may:
            still = False
        if car > 0 and speed_behind - speed > approach:
            closing = True
        if rolling:
            accelerated = whole / mass
            if car > 0 and accelerated_behind > accelerated and (speed_behind > STILL_SPEED or speed < -STILL_SPEED):
                closing = True
            accelerated_behind = accelerated
        speed_behind = speed
        c += N_CAR
    if int(s[HEAD.N_INTERFACE]) == n and speed_behind > approach:  # the last one stands before the wall
        closing = True
    s[HEAD.IMPULSE] += impulse
    s[HEAD.ELAPSED] = elapsed
    return still, closing


@jitable
def _braking(s: Block, p: int, time: float) -> float:
    """What the brake can give on a point at a time [N]."""
    rise, since = s[p + POINT.BRAKE_RISE], time - s[p + POINT.BRAKE_DELAY]
    part = 0.0 if since < 0.0 else 1.0 if since >= rise else since / rise
    return min(part * s[p + POINT.BRAKE], s[p + POINT.BRAKE_MOST])


@jitable
def _windows(s: Block, n: int, step: float, whole: bool) -> None:
    """Add the impulse of this step to the window of means that it is in; windows begin and end at whole steps."""
    window = s[HEAD.WINDOW]
    ends = whole and (s[HEAD.GRID] - 1.0) % window == 0.0
    for i in range(n):
        c = N_HEAD + N_CAR * i
        if ends:
            mean = abs(s[c + CAR.WINDOW_IMPULSE]) / (window * s[HEAD.STEP] * s[c + CAR.MASS])
            s[c + CAR.WINDOW_PEAK] = max(s[c + CAR.WINDOW_PEAK], mean)
            s[c + CAR.WINDOW_IMPULSE] = 0.0
        s[c + CAR.WINDOW_IMPULSE] += s[c + CAR.NET] * step


@jitable
def _record(s: Block, n: int) -> None:
    """Keep the speeds if they are due, and see whether the simulation is done."""
    if s[HEAD.STRIDE] == 0.0:
        return
    if s[HEAD.DUE] == 0.0:
        ring = int(s[HEAD.RING]) + n * (int(s[HEAD.RECORDS]) % int(s[HEAD.N_RING]))
        for i in range(n):
            s[ring + i] = s[N_HEAD + N_CAR * i + CAR.SPEED]
        s[HEAD.RECORDS] += 1.0
        s[HEAD.DUE] = s[HEAD.STRIDE]
        finite = s[HEAD.IMPULSE] - s[HEAD.IMPULSE] == 0.0
        if s[HEAD.OVER] != 0.0 or s[HEAD.RECORDS] == s[HEAD.MOST] or not finite:
            s[HEAD.DONE] = 1.0
    s[HEAD.DUE] -= 1.0


def _sensor(offsets: Offsets) -> Any:
    at_nuserdata, at_userdata, at_sensordata = offsets.nuserdata, offsets.userdata, offsets.sensordata
    magic = MAGIC

    def sensor(model: Any, data: Any, stage: int) -> None:
        """What :data:`trainmj.collision.model.SENSED` takes from the devices: the first user sensors of a model."""
        if stage != LAST_STAGE or _size(model, at_nuserdata) < N_HEAD:
            return
        s = _at(data, at_userdata)
        if s[HEAD.MAGIC] != magic:
            return
        m = int(s[HEAD.N_INTERFACE])
        out = _at(data, at_sensordata)
        for k in range(m):
            j = int(s[HEAD.JOINTS]) + N_JOINT * k
            out[k] = s[j + JOINT.FORCE]
            out[m + k] = 0.0
            e = int(s[j + JOINT.FIRST])
            left, right, left_energy, right_energy = 0.0, 0.0, 0.0, 0.0
            for n in range(int(s[j + JOINT.COUNT])):
                own = s[e + ELEMENT.STROKE]
                in_series = s[e + ELEMENT.KIND] == SERIES
                a, b = (e + N_ELEMENT, e + 2 * N_ELEMENT) if in_series else (e, e)
                both = in_series or s[e + ELEMENT.SHARE] < 1.0
                if s[e + ELEMENT.SIGN] > 0.0 and (n == 0 or own > 0.0):
                    shared = s[e + ELEMENT.SHARE] * s[e + ELEMENT.START]  # of its start, by one of two equal devices
                    left = s[a + ELEMENT.STROKE] + (s[a + ELEMENT.START] if in_series else shared)
                    right = s[b + ELEMENT.STROKE] + (s[b + ELEMENT.START] if in_series else shared) if both else 0.0
                out[m + k] += s[e + ELEMENT.TIMES] * s[e + ELEMENT.DISSIPATED]
                alone = s[e + ELEMENT.RIGHT_ONLY] != 0.0
                left_energy += 0.0 if alone else s[a + ELEMENT.DISSIPATED]
                right_energy += s[b + ELEMENT.DISSIPATED] if both or alone else 0.0
                e += int(s[e + ELEMENT.NEXT])
            out[2 * m + k], out[3 * m + k] = left, right
            out[4 * m + k], out[5 * m + k] = left_energy, right_energy
        member = int(s[HEAD.MEMBERS])
        for k in range(int(s[HEAD.N_MEMBER])):
            out[6 * m + k] = s[member + MEMBER.PLASTIC]
            member += N_MEMBER
        if s[HEAD.PLANE] != 0.0:  # there are no members
            for k in range(m):
                out[6 * m + k] = s[int(s[HEAD.JOINTS]) + N_JOINT * k + JOINT.STROKE]
                out[7 * m + k] = s[int(s[HEAD.ENDS]) + N_ENDS * k + ENDS.RATE]
                out[8 * m + k] = s[int(s[HEAD.ENDS]) + N_ENDS * k + ENDS.STEP]
            w, wheels = int(s[HEAD.WHEELS]), int(s[HEAD.N_WHEEL])
            for k in range(wheels):
                out[9 * m + k] = s[w + WHEEL.LOAD]
                out[9 * m + wheels + k] = s[w + WHEEL.RISE]
                w += N_WHEEL

    return sensor


def _no_clock(offsets: Offsets) -> Any:
    def clock() -> float:
        return 0.0

    return clock
