"""The compiled law in the vertical plane: devices along their lines, wheelsets on the rails, stops of suspensions.

A line gives its element a stroke u and a slip s across it, both as functions of the position of the two bodies. Its
force acts along the gradient of u, and that of the tie along the gradient of s, so that what a device absorbs is what
the vehicles lose. See docs/vertical-plane.md for the equations.
"""

from __future__ import annotations

import math
from typing import Any

from trainmj.collision.element import narrowest
from trainmj.collision.fields import (
    ELEMENT,
    ENDS,
    FRAME,
    HEAD,
    JOINT,
    LINE,
    N_ELEMENT,
    N_ENDS,
    N_FRAME,
    N_JOINT,
    N_LINE,
    N_POINT,
    N_WHEEL,
    POINT,
    WHEEL,
    Block,
)
from trainmj.collision.gear import BOGIES, N_DOF, N_WHEELSET
from trainmj.collision.jitable import inlined, jitable
from trainmj.collision.joint import count, press

_PINS_MET = 0.02
"""Part of its length that a strut has left when its pins are taken to have met."""

_LEAST = 1e-6  # length of a strut [m]


@jitable
def turn(s: Block, qpos: Any) -> None:
    """Note sine and cosine of the pitch of every vehicle, once for all that hangs on it."""
    for i in range(int(s[HEAD.N_VEHICLE])):
        f = int(s[HEAD.FRAMES]) + N_FRAME * i
        if s[f + FRAME.DOFS] != 1.0:
            pitch = qpos[int(s[f + FRAME.DOF]) + 2]
            s[f + FRAME.SINE], s[f + FRAME.COSINE] = math.sin(pitch), math.cos(pitch)


@inlined
def _at(s: Block, f: int, ahead: float, above: float, qpos: Any, qvel: Any) -> Any:
    """A point of a body: how far it has come along the track, its height, its velocity, and its arm."""
    d = int(s[f + FRAME.DOF])
    if s[f + FRAME.DOFS] == 1.0:
        return qpos[d], s[f + FRAME.HEIGHT] + above, qvel[d], 0.0, ahead, above
    sine, cosine = s[f + FRAME.SINE], s[f + FRAME.COSINE]
    rx, rz = ahead * cosine - above * sine, ahead * sine + above * cosine
    return (
        qpos[d] + rx - ahead,
        s[f + FRAME.HEIGHT] + qpos[d + 1] + rz,
        qvel[d] - rz * qvel[d + 2],
        qvel[d + 1] + rx * qvel[d + 2],
        rx,
        rz,
    )


@inlined
def _turned(s: Block, f: int, qpos: Any, qvel: Any) -> Any:
    """Pitch of a body and its rate."""
    if s[f + FRAME.DOFS] == 1.0:
        return 0.0, 0.0
    d = int(s[f + FRAME.DOF])
    return qpos[d + 2], qvel[d + 2]


@jitable
def along(s: Block, line: int, left: int, right: int, qpos: Any, qvel: Any) -> Any:
    """Where a line stands.

    Args:
        s: the block.
        line: place of the line.
        left: place of the vehicle on the left.
        right: place of that on the right; negative for a wall.
        qpos: of MuJoCo.
        qvel: of MuJoCo.

    Returns:
        How much closer the points are than designed, and its rate; direction of the line (x, z); slip; arms of both
        points (x, z each); the same as the first two along the track alone; pitch of both bodies; distance of the
        points.
    """
    lx, lz, lvx, lvz, lrx, lrz = _at(s, left, s[line + LINE.LEFT_X], s[line + LINE.LEFT_Z], qpos, qvel)
    lt, lw = _turned(s, left, qpos, qvel)
    rx, rz, rvx, rvz, rrx, rrz, rt, rw = 0.0, s[line + LINE.RIGHT_Z], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if right >= 0:
        rx, rz, rvx, rvz, rrx, rrz = _at(s, right, s[line + LINE.RIGHT_X], s[line + LINE.RIGHT_Z], qpos, qvel)
        rt, rw = _turned(s, right, qpos, qvel)
    gx, gz, gvx, gvz = lx - rx, lz - rz, lvx - rvx, lvz - rvz
    if s[line + LINE.STRUT] != 0.0:
        dx = s[line + LINE.LENGTH] - gx
        length = max(_LEAST, math.sqrt(dx * dx + gz * gz))
        nx, nz = dx / length, -gz / length
        u, rate, slip = s[line + LINE.LENGTH] - length, nx * gvx + nz * gvz, gz
    else:
        mean = 0.5 * (lt + rt)
        nx, nz, length = math.cos(mean), math.sin(mean), 1.0
        u, slip = gx * nx + gz * nz, gz * nx - gx * nz
        rate = gvx * nx + gvz * nz + slip * 0.5 * (lw + rw)
    return u, rate, nx, nz, slip, lrx, lrz, rrx, rrz, gx, gvx, lt, rt, length


@inlined
def _push(s: Block, f: int, p: int, fx: float, fz: float, moment: float) -> None:
    """A force on a body, with its moment about the centre of gravity."""
    s[p + POINT.LOAD] += fx
    if s[f + FRAME.DOFS] != 1.0:
        s[f + FRAME.G1] += fz
        s[f + FRAME.G2] += moment


@jitable
def way_to_narrow(s: Block, step: float, qpos: Any, qvel: Any) -> float:
    """Narrowest part of a curve that lies within two steps ahead, as a part of what its element moves in one.

    Infinite where there is none.
    """
    found = math.inf
    turn(s, qpos)
    for k in range(int(s[HEAD.N_INTERFACE])):
        j = int(s[HEAD.JOINTS]) + N_JOINT * k
        left, right = _frames(s, j)
        line, e = int(s[int(s[HEAD.ENDS]) + N_ENDS * k + ENDS.LINE]), int(s[j + JOINT.FIRST])
        for _ in range(int(s[j + JOINT.COUNT])):
            u, rate = along(s, line, left, right, qpos, qvel)[:2]
            way = abs(rate) * step
            if way > 0.0:
                found = min(found, narrowest(s, e, u - s[line + LINE.ZERO], rate, 2.0 * way) / way)
            e += int(s[e + ELEMENT.NEXT])
            line += N_LINE
    return found


@inlined
def _frames(s: Block, j: int) -> tuple[int, int]:
    """Places of the vehicles on both sides of an interface; -1 for a wall."""
    frames = int(s[HEAD.FRAMES])
    left, right = int(s[j + JOINT.LEFT]), int(s[j + JOINT.RIGHT])
    return frames + N_FRAME * left, frames + N_FRAME * right if right >= 0 else -1


@jitable
def devices(s: Block, qpos: Any, qvel: Any, elapsed: float, time: float) -> tuple[bool, bool, float]:
    """Move the devices along their lines and add up their forces on the vehicles.

    Returns:
        Whether one carries force, or draw gear comes taut; whether one had its largest force on the way; the impulse of
        the wall.
    """
    points, frames = int(s[HEAD.POINTS]), int(s[HEAD.FRAMES])
    for i in range(int(s[HEAD.N_VEHICLE])):
        f = frames + N_FRAME * i
        for k in range(int(s[f + FRAME.DOFS])):
            s[f + FRAME.G0 + k] = 0.0
    turn(s, qpos)
    active = peaked = False
    wall = 0.0
    for k in range(int(s[HEAD.N_INTERFACE])):
        j, ends = int(s[HEAD.JOINTS]) + N_JOINT * k, int(s[HEAD.ENDS]) + N_ENDS * k
        left, right = _frames(s, j)
        p, q = points + N_POINT * int(s[j + JOINT.LEFT]), points + N_POINT * int(s[j + JOINT.RIGHT])
        force, stroke, touched = 0.0, 0.0, False
        e, line = int(s[j + JOINT.FIRST]), int(s[ends + ENDS.LINE])
        for n in range(int(s[j + JOINT.COUNT])):
            u, rate, nx, nz, slip, lrx, lrz, rrx, rrz, gx, gvx, lt, rt, length = along(s, line, left, right, qpos, qvel)
            if n == 0:
                stroke, s[ends + ENDS.RATE] = gx - s[line + LINE.ZERO], gvx
            one, taut, one_peaked = press(s, j, e, u - s[line + LINE.ZERO], rate, elapsed, time)
            force += one
            active |= taut
            peaked |= one_peaked
            touched |= one != 0.0
            fx, fz = one * nx, one * nz  # of the law, along the gradient of the stroke
            half = 0.0 if s[line + LINE.STRUT] != 0.0 else 0.5 * slip
            tied = _tie(s, line, one, slip, time)
            vx, vz = -tied * nz, tied * nx  # of the tie, along that of the slip
            lm = -(-lrz * fx + lrx * fz + one * half) - (-lrz * vx + lrx * vz - 0.5 * tied * u)
            rm = (-rrz * fx + rrx * fz) - one * half + (-rrz * vx + rrx * vz) + 0.5 * tied * u
            if s[line + LINE.STRUT] != 0.0:
                ml, mr = _swing(s, line, e, math.atan2(nz, nx), lt, rt, u - s[line + LINE.ZERO])
                # the moments of the stops turn the strut, whose ends give way across it
                sx, sz = (ml + mr) * nz / length, -(ml + mr) * nx / length
                vx, vz = vx + sx, vz + sz
                lm += ml - (-lrz * sx + lrx * sz)
                rm += mr + (-rrz * sx + rrx * sz)
                met = length < _PINS_MET * s[line + LINE.LENGTH] and s[line + LINE.DEAD] == 0.0
                if met and s[line + LINE.OFF_TIME] < 0.0:
                    s[line + LINE.OFF_TIME] = time
            _push(s, left, p, -fx - vx, -fz - vz, lm)
            if right >= 0:
                _push(s, right, q, fx + vx, fz + vz, rm)
            else:
                wall -= s[line + LINE.PUSH] * elapsed
            s[line + LINE.PUSH] = fx + vx
            e += int(s[e + ELEMENT.NEXT])
            line += N_LINE
        active |= touched
        count(s, j, stroke, force, time)
        _step(s, ends, left, right, qpos, touched, time)
    return active, peaked, wall


@jitable
def _step(s: Block, ends: int, left: int, right: int, qpos: Any, touched: bool, time: float) -> None:
    """The step between two ends."""
    step = _rise(s, left, s[left + FRAME.RIGHT_END], qpos)
    step -= _rise(s, right, s[right + FRAME.LEFT_END], qpos) if right >= 0 else s[ends + ENDS.WALL]
    s[ends + ENDS.STEP] = step
    if touched and abs(step) > s[ends + ENDS.STEP_MAX]:
        s[ends + ENDS.STEP_MAX], s[ends + ENDS.STEP_TIME] = abs(step), time


@inlined
def _rise(s: Block, f: int, ahead: float, qpos: Any) -> Any:
    """How much higher an end of a vehicle is than designed [m]."""
    if s[f + FRAME.DOFS] == 1.0:
        return s[f + FRAME.OFFSET]
    d = int(s[f + FRAME.DOF])
    return s[f + FRAME.OFFSET] + qpos[d + 1] + ahead * s[f + FRAME.SINE]


@jitable
def _tie(s: Block, line: int, force: float, slip: float, time: float) -> float:
    """Force of the vertical tie of two faces, down on the left one; it holds while they are engaged."""
    before, held = s[line + LINE.TIED], s[line + LINE.HELD]
    if force != 0.0 and s[line + LINE.MET_TIME] < 0.0:
        s[line + LINE.MET], s[line + LINE.MET_TIME] = slip, time
    if s[line + LINE.STRUT] != 0.0:
        return 0.0
    if force <= 0.0:  # what the spring of the tie still held is lost
        if before != 0.0:
            s[line + LINE.TIE_LOST] += 0.5 * before * before / s[line + LINE.TIE]
        s[line + LINE.HELD] = s[line + LINE.ENGAGED] = slip
        s[line + LINE.TIED] = 0.0
        return 0.0
    if abs(slip) > s[line + LINE.OVERLAP] and s[line + LINE.OFF_TIME] < 0.0:
        s[line + LINE.OFF_TIME] = time
    stiffness = s[line + LINE.TIE]
    if stiffness == 0.0:
        s[line + LINE.SLIP_MAX] = max(s[line + LINE.SLIP_MAX], abs(slip - s[line + LINE.ENGAGED]))
        return 0.0
    capacity = s[line + LINE.FRICTION] * force + s[line + LINE.TOOTH]
    tied = stiffness * (slip - held)
    if abs(tied) > capacity:
        tied = math.copysign(capacity, tied)
        s[line + LINE.HELD] = slip - tied / stiffness
        way = s[line + LINE.HELD] - held
        s[line + LINE.TIE_LOST] += 0.5 * (before + tied) * way
        s[line + LINE.SLIP_MAX] = max(s[line + LINE.SLIP_MAX], abs(s[line + LINE.HELD] - s[line + LINE.ENGAGED]))
    s[line + LINE.TIED] = tied
    s[line + LINE.TIE_MAX] = max(s[line + LINE.TIE_MAX], abs(tied))
    return tied


@jitable
def _swing(s: Block, line: int, e: int, angle: float, lt: float, rt: float, stroke: float) -> tuple[float, float]:
    """Moments of the swing stops of a strut on both bodies, while it is coupled and has not sheared."""
    if s[line + LINE.DEAD] != 0.0:
        return 0.0, 0.0
    left, right = angle - lt, angle - rt
    if s[line + LINE.COUPLED] == 0.0:
        if stroke < 0.0 and s[line + LINE.INNER] == 0.0:
            return 0.0, 0.0
        s[line + LINE.COUPLED] = 1.0  # a stop that is reached already begins without a moment
        s[line + LINE.SET_LEFT] = _beyond(left, s[line + LINE.FREE_LEFT])
        s[line + LINE.SET_RIGHT] = _beyond(right, s[line + LINE.FREE_RIGHT])
    pair = int(s[e + ELEMENT.NEXT]) > N_ELEMENT
    a, b = (e + N_ELEMENT, e + 2 * N_ELEMENT) if pair else (e, e)
    if s[a + ELEMENT.STROKE_MAX] >= s[line + LINE.END_LEFT] or s[b + ELEMENT.STROKE_MAX] >= s[line + LINE.END_RIGHT]:
        s[line + LINE.DEAD] = 1.0
        s[line + LINE.SWING_LOST] = 0.5 * (
            s[line + LINE.SWING_LEFT] * s[line + LINE.TURN_LEFT] ** 2
            + s[line + LINE.SWING_RIGHT] * s[line + LINE.TURN_RIGHT] ** 2
        )
        s[line + LINE.TURN_LEFT] = s[line + LINE.TURN_RIGHT] = 0.0
        return 0.0, 0.0
    over_left, over_right = (
        _beyond(left - s[line + LINE.SET_LEFT], s[line + LINE.FREE_LEFT]),
        _beyond(right - s[line + LINE.SET_RIGHT], s[line + LINE.FREE_RIGHT]),
    )
    s[line + LINE.TURN_LEFT], s[line + LINE.TURN_RIGHT] = over_left, over_right
    ml, mr = s[line + LINE.SWING_LEFT] * over_left, s[line + LINE.SWING_RIGHT] * over_right
    s[line + LINE.SWING_MAX] = max(s[line + LINE.SWING_MAX], abs(ml), abs(mr))
    return ml, mr


@inlined
def _beyond(value: float, free: float) -> float:
    """What a value is beyond a free play to either side."""
    return value - free if value > free else value + free if value < -free else 0.0


@jitable
def carry(s: Block, qpos: Any, qvel: Any, elapsed: float, time: float) -> None:
    """Rails below the wheelsets, stops of the suspensions, and what the dampers take, of every vehicle on bogies."""
    w = int(s[HEAD.WHEELS])
    for i in range(int(s[HEAD.N_VEHICLE])):
        f = int(s[HEAD.FRAMES]) + N_FRAME * i
        d = int(s[f + FRAME.DOF])
        if s[f + FRAME.DOFS] != 1.0:
            _carry_one(s, f, d, w, qpos, qvel, elapsed, time)
            w += N_WHEEL * N_WHEELSET
        else:
            s[f + FRAME.Q0], s[f + FRAME.V0] = qpos[d], qvel[d]


@jitable
def _carry_one(s: Block, f: int, d: int, w: int, qpos: Any, qvel: Any, elapsed: float, time: float) -> None:
    """The same for one vehicle: f is the place of its record, d its first degree of freedom, w its first wheelset."""
    z, pitch, turning = qpos[d + 1], qpos[d + 2], qvel[d + 2]
    sine, cosine = s[f + FRAME.SINE], s[f + FRAME.COSINE]
    drop, base, axle = s[f + FRAME.DROP], s[f + FRAME.BASE], s[f + FRAME.AXLE]
    stiffness, damping = s[f + FRAME.RAIL_STIFFNESS], s[f + FRAME.RAIL_DAMPING]
    s[f + FRAME.PITCH_MAX], s[f + FRAME.PITCH_MIN] = (
        max(s[f + FRAME.PITCH_MAX], pitch),
        min(s[f + FRAME.PITCH_MIN], pitch),
    )
    s[f + FRAME.HEAVE_MAX], s[f + FRAME.HEAVE_MIN] = max(s[f + FRAME.HEAVE_MAX], z), min(s[f + FRAME.HEAVE_MIN], z)
    s[f + FRAME.LEVER] = 0.0
    for n in range(2):
        at = BOGIES[n]
        slide = qpos[d + at]
        arm = s[f + FRAME.ARM_0 + n]
        s[f + FRAME.G0 + at] += _stop(slide, s[f + FRAME.LIFT_S], s[f + FRAME.BUMP_S], s[f + FRAME.STOP_S])
        s[f + FRAME.DAMPED] += _damped(s, f, at, s[f + FRAME.DAMPING_S], slide, qvel[d + at])
        angle, spin = pitch + qpos[d + at + 1], qvel[d + at + 1]
        s1, c1 = math.sin(angle), math.cos(angle)
        link = arm * sine + (drop + slide) * cosine - drop  # rise of the link
        swung = arm * cosine - (drop + slide) * sine
        s[f + FRAME.SINE_0 + n], s[f + FRAME.LEVER_0 + n] = s1, 0.0
        for k in range(2):
            own = at + 2 + k
            travel = qpos[d + own]
            half = base if k else -base
            up = half * c1 - (axle + travel) * s1  # derivative of the rise by the pitch of the frame
            rise = z + link + half * s1 + (axle + travel) * c1 - axle
            s[f + FRAME.LEVER] += 0.25 * (s[f + FRAME.HEIGHT] + z - rise)
            s[f + FRAME.LEVER_0 + n] += 0.5 * (s[f + FRAME.LINK] + z + link - rise)
            speed = qvel[d + 1] + swung * turning + cosine * qvel[d + at] + up * (turning + spin) + c1 * qvel[d + own]
            gap = rise - s[w + WHEEL.PRELOAD] / stiffness
            load = max(0.0, -stiffness * gap - damping * speed) if gap < 0.0 else 0.0
            more = load - max(0.0, -stiffness * gap)
            before = s[w + WHEEL.RISE] - s[w + WHEEL.PRELOAD] / stiffness
            more_before = s[w + WHEEL.LOAD] - max(0.0, -stiffness * before)
            if s[HEAD.TIME] >= 0.0:
                s[f + FRAME.RAILED] -= 0.5 * (more + more_before) * (gap - before)
            s[w + WHEEL.LOAD], s[w + WHEEL.RISE] = load, rise
            s[w + WHEEL.LOAD_MIN] = min(s[w + WHEEL.LOAD_MIN], load)
            if gap > s[w + WHEEL.LIFT_MAX]:
                s[w + WHEEL.LIFT_MAX], s[w + WHEEL.LIFT_TIME] = gap, time
            if load == 0.0:
                s[w + WHEEL.OFF] += elapsed
            s[f + FRAME.G1] += load
            s[f + FRAME.G2] += load * (swung + up)
            s[f + FRAME.G0 + at] += load * cosine
            s[f + FRAME.G0 + at + 1] += load * up
            s[f + FRAME.G0 + own] += load * c1 + _stop(
                travel, s[f + FRAME.LIFT_P], s[f + FRAME.BUMP_P], s[f + FRAME.STOP_P]
            )
            s[f + FRAME.DAMPED] += _damped(s, f, own, s[f + FRAME.DAMPING_P], travel, qvel[d + own])
            w += N_WHEEL
    for k in range(N_DOF):
        s[f + FRAME.Q0 + k], s[f + FRAME.V0 + k] = qpos[d + k], qvel[d + k]


@inlined
def _stop(travel: float, lift: float, bump: float, stiffness: float) -> float:
    """Force of the stops of a suspension, which has come together by a travel."""
    if travel > bump:
        return -stiffness * (travel - bump)
    if travel < -lift:
        return -stiffness * (travel + lift)
    return 0.0


@inlined
def _damped(s: Block, f: int, at: int, damping: float, travel: float, rate: float) -> float:
    """What a damper has taken since the evaluation before."""
    return 0.5 * damping * (rate + s[f + FRAME.V0 + at]) * (travel - s[f + FRAME.Q0 + at])


@inlined
def rail_speed(s: Block, f: int, qvel: Any) -> Any:
    """Speed along the track at which the rails hold a vehicle: of its wheelsets where they touch them."""
    d = int(s[f + FRAME.DOF])
    speed = qvel[d]
    if s[f + FRAME.DOFS] != 1.0:
        speed += s[f + FRAME.LEVER] * qvel[d + 2]
        for n in range(2):
            at, sine = d + BOGIES[n], s[f + FRAME.SINE_0 + n]
            speed += 0.5 * (s[f + FRAME.LEVER_0 + n] * qvel[at + 1] - s[f + FRAME.SINE] * qvel[at])
            speed -= 0.25 * sine * (qvel[at + 2] + qvel[at + 3])
    return speed


@inlined
def hold(s: Block, f: int, friction: float) -> None:
    """Rail friction or brake below the wheelsets of a vehicle, a quarter each: what it does but along the track."""
    if s[f + FRAME.DOFS] != 1.0:
        s[f + FRAME.G2] += friction * s[f + FRAME.LEVER]
        for n in range(2):
            at, sine = f + FRAME.G0 + BOGIES[n], s[f + FRAME.SINE_0 + n]
            s[at] -= 0.5 * friction * s[f + FRAME.SINE]
            s[at + 1] += 0.5 * friction * s[f + FRAME.LEVER_0 + n]
            s[at + 2] -= 0.25 * friction * sine
            s[at + 3] -= 0.25 * friction * sine


@jitable
def give(s: Block, out: Any) -> None:
    """Hand the forces along all degrees of freedom to MuJoCo; that along the track is in the point of a vehicle."""
    for i in range(int(s[HEAD.N_VEHICLE])):
        f = int(s[HEAD.FRAMES]) + N_FRAME * i
        d = int(s[f + FRAME.DOF])
        out[d] += s[int(s[HEAD.POINTS]) + N_POINT * i + POINT.FORCE]
        for k in range(1, int(s[f + FRAME.DOFS])):
            out[d + k] += s[f + FRAME.G0 + k]
