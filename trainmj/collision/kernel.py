"""The device law, compiled, as the passive-force callback of MuJoCo.

MuJoCo calls it once in each step with its own model and data, without Python and without the interpreter's lock::

    with installed():
        mujoco.mj_step(model, data, nstep=8000)

It applies the law of each interface (:mod:`trainmj.collision.law`) and rail friction to each vehicle: the force that
would stop the vehicle within the step, at most mu m g, so that a standing vehicle stays where it is. All parameters and
state are in mjData.userdata (:mod:`trainmj.collision.block`); simulations without such a block are left alone.

The state moves once per step: a second evaluation at the same time returns the same forces. Integrators that evaluate
forces several times a step would move it several times; :mod:`trainmj.collision.model` refuses them.

The places of MuJoCo's fields come from :mod:`trainmj.collision.offsets` and are compiled in.
"""

from __future__ import annotations

import ctypes
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, register_jitable

from trainmj.collision.block import MAGIC, Car, Head, Joint, places
from trainmj.collision.compiled import address_of
from trainmj.collision.interrupts import held_back
from trainmj.collision.law import CRUSH, crush
from trainmj.collision.mj import Shared, mujoco, put, undisturbed
from trainmj.collision.offsets import Offsets, field_offsets

log = logging.getLogger(__name__)

APPROACH_SPEED = 0.01
"""A collision is over when no interface carries force and none comes closer faster than this [m/s]."""

STILL_SPEED = 1e-6
"""... or when every vehicle is slower than this [m/s]."""

HEAD, CAR, JOINT = places(Head), places(Car), places(Joint)  # numba takes no members of an Enum as indices
N_HEAD, N_CAR, N_JOINT = len(Head), len(Car), len(Joint)
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
    return address_of(factory(offsets), signature)


def _note(text: bytes) -> None:
    """Keep a warning of MuJoCo's from its log file and from someone's handler: the status of the case says it."""
    log.debug("%s", text.decode(errors="replace"))


_warned = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(_note)
_law = Shared(lambda: put(_callbacks()), lambda: put([]))


@intrinsic
def _at(typing_context: Any, base: Any, offset: Any) -> Any:
    """Pointer to float64 that is stored at base + offset."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        double = context.get_value_type(types.float64)
        place = cgutils.pointer_add(builder, args[0], args[1], double.as_pointer().as_pointer())
        return builder.load(place)

    return types.CPointer(types.float64)(types.voidptr, types.int64), codegen


@intrinsic
def _in(typing_context: Any, base: Any, offset: Any) -> Any:
    """Pointer to float64 at base + offset itself."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        double = context.get_value_type(types.float64)
        return cgutils.pointer_add(builder, args[0], args[1], double.as_pointer())

    return types.CPointer(types.float64)(types.voidptr, types.int64), codegen


@intrinsic
def _size(typing_context: Any, base: Any, offset: Any) -> Any:
    """The 64-bit integer at base + offset."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        integer = context.get_value_type(types.int64)
        return builder.load(cgutils.pointer_add(builder, args[0], args[1], integer.as_pointer()))

    return types.int64(types.voidptr, types.int64), codegen


# numba keeps compiled functions on disk. It finds them again by this file and by the values that a function closes
# over, and does not see an edit elsewhere. Each function therefore closes over the places of MuJoCo's fields and over
# the mark of a block, which changes with the code of the law; everything else may then be used by its name.

respond = register_jitable(crush.respond)


def _passive(offsets: Offsets) -> Any:
    at_nuserdata, at_timestep, at_time, at_userdata, at_qpos, at_qvel, at_passive, at_inertia, _ = offsets
    magic = MAGIC

    def passive(model: Any, data: Any) -> None:
        """Forces of all interfaces and rails on the vehicles; moves the state where the time is a new one."""
        if _size(model, at_nuserdata) < N_HEAD:
            return
        s = _at(data, at_userdata)
        if s[HEAD.MAGIC] != magic or s[HEAD.DONE] != 0.0:
            return
        n = int(s[HEAD.N_VEHICLE])
        m = int(s[HEAD.N_INTERFACE])
        room = int(s[HEAD.N_POINT])
        time = _in(data, at_time)[0]
        step = _in(model, at_timestep)[0]
        qpos = _at(data, at_qpos)
        qvel = _at(data, at_qvel)
        out = _at(data, at_passive)
        inertia = _at(data, at_inertia)
        # a field of vehicle i is at s[car + FIELD * n], one of interface i at s[joint + FIELD * m]
        cars = N_HEAD
        joints = cars + N_CAR * n
        curves = joints + N_JOINT * m
        fresh = time != s[HEAD.TIME]  # MuJoCo may ask again at the same time: the state has moved already
        elapsed = time - s[HEAD.TIME] if s[HEAD.TIME] >= 0.0 else 0.0
        active = False
        still = True
        behind = 0.0  # force of the interface behind a vehicle, which pushes it forward
        impulse = 0.0
        for i in range(n):
            v = qvel[i]
            ahead = 0.0  # force of the interface ahead of it, which pushes it back
            if i < m:
                j = joints + i
                if fresh:
                    u = qpos[i] - (qpos[i + 1] if i + 1 < n else 0.0)  # the wall stands at 0
                    rate = v - (qvel[i + 1] if i + 1 < n else 0.0)
                    stiffness = s[j + JOINT.STIFFNESS * m]
                    plastic = s[j + JOINT.PLASTIC * m]
                    now_plastic = plastic
                    if u > plastic:
                        # the segment of the envelope, from where it was: a step moves it by one or two
                        base = curves + 3 * room * i
                        k = int(s[j + JOINT.SEGMENT * m])
                        while k > 0 and u < s[base + k]:
                            k -= 1
                        while k + 1 < room and u >= s[base + k + 1]:
                            k += 1
                        s[j + JOINT.SEGMENT * m] = k
                        envelope = s[base + room + k] + s[base + 2 * room + k] * (u - s[base + k])
                        if s[j + JOINT.LAW * m] == CRUSH:
                            damping = s[j + JOINT.DAMPING * m]
                            ahead, now_plastic = respond(u, rate, plastic, stiffness, damping, envelope)
                        s[j + JOINT.PLASTIC * m] = now_plastic
                        if ahead > 0.0:
                            active = True
                            if s[j + JOINT.FIRST_FORCE_TIME * m] < 0.0:
                                s[j + JOINT.FIRST_FORCE_TIME * m] = time
                            s[j + JOINT.LAST_FORCE_TIME * m] = time
                            if ahead > s[j + JOINT.FORCE_MAX * m]:
                                s[j + JOINT.FORCE_MAX * m] = ahead
                    # lost: mean force over plastic travel, and what the dashpot adds to the spring over the whole
                    moved = now_plastic - plastic
                    travel = u - s[j + JOINT.STROKE * m]
                    before = s[j + JOINT.FORCE * m]
                    spring = max(0.0, stiffness * (u - now_plastic))
                    s[j + JOINT.DISSIPATED * m] += 0.5 * (ahead + before) * moved + (ahead - spring) * travel
                    s[j + JOINT.WORK * m] += 0.5 * (ahead + before) * travel
                    if rate > APPROACH_SPEED:
                        active = True
                    if i + 1 == n:
                        impulse -= before * elapsed  # of the wall
                    s[j + JOINT.STROKE * m] = u
                    s[j + JOINT.FORCE * m] = ahead
                    if u > s[j + JOINT.STROKE_MAX * m]:
                        s[j + JOINT.STROKE_MAX * m] = u
                        s[j + JOINT.STROKE_MAX_TIME * m] = time
                else:
                    ahead = s[j + JOINT.FORCE * m]
            net = behind - ahead
            behind = ahead
            c = cars + i
            if fresh:
                mass = inertia[i]
                # the friction that would stop the vehicle within this step, within what the rail can give
                limit = s[c + CAR.FRICTION_LIMIT * n]
                friction = min(limit, max(-limit, -(mass * v / step + net)))
                held = s[c + CAR.FRICTION * n]
                s[c + CAR.FRICTION_WORK * n] -= 0.5 * held * (s[c + CAR.SPEED * n] + v) * elapsed
                impulse += held * elapsed
                s[c + CAR.SPEED * n] = v
                s[c + CAR.FRICTION * n] = friction
                device = abs(net) / mass
                if device > s[c + CAR.DEVICE_PEAK * n]:
                    s[c + CAR.DEVICE_PEAK * n] = device
                total = abs(net + friction) / mass
                if total > s[c + CAR.TOTAL_PEAK * n]:
                    s[c + CAR.TOTAL_PEAK * n] = total
                if abs(v) > STILL_SPEED:
                    still = False
            else:
                friction = s[c + CAR.FRICTION * n]
            out[i] += net + friction
        if fresh:
            meeting = joints + int(s[HEAD.FRONT])
            if s[meeting + JOINT.FORCE * m] > 0.0:
                for i in range(n):
                    s[cars + CAR.SPEED_LAST * n + i] = qvel[i]
                    if s[meeting + JOINT.FIRST_FORCE_TIME * m] == time:
                        s[cars + CAR.SPEED_FIRST * n + i] = qvel[i]
            s[HEAD.TIME] = time
            s[HEAD.OVER] = 1.0 if still or not active else 0.0
            s[HEAD.IMPULSE] += impulse
            if s[HEAD.STRIDE] > 0.0:
                if s[HEAD.DUE] == 0.0:
                    ring = curves + 3 * room * m + n * (int(s[HEAD.RECORDS]) % int(s[HEAD.N_RING]))
                    for i in range(n):
                        s[ring + i] = qvel[i]
                    s[HEAD.RECORDS] += 1.0
                    s[HEAD.DUE] = s[HEAD.STRIDE]
                    finite = s[HEAD.IMPULSE] - s[HEAD.IMPULSE] == 0.0
                    if s[HEAD.OVER] != 0.0 or s[HEAD.RECORDS] == s[HEAD.MOST] or not finite:
                        s[HEAD.DONE] = 1.0
                s[HEAD.DUE] -= 1.0

    return passive


def _sensor(offsets: Offsets) -> Any:
    at_nuserdata, at_userdata, at_sensordata = offsets.nuserdata, offsets.userdata, offsets.sensordata
    magic = MAGIC

    def sensor(model: Any, data: Any, stage: int) -> None:
        """Force and absorbed energy of each interface, the first user sensors of a model built by trainmj."""
        if stage != LAST_STAGE or _size(model, at_nuserdata) < N_HEAD:
            return
        s = _at(data, at_userdata)
        if s[HEAD.MAGIC] != magic:
            return
        m = int(s[HEAD.N_INTERFACE])
        out = _at(data, at_sensordata)
        for i in range(m):
            j = N_HEAD + N_CAR * int(s[HEAD.N_VEHICLE]) + i
            out[i] = s[j + JOINT.FORCE * m]
            out[m + i] = s[j + JOINT.DISSIPATED * m]

    return sensor


def _no_clock(offsets: Offsets) -> Any:
    def clock() -> float:
        return 0.0

    return clock
