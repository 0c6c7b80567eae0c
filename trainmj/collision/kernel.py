"""The device law, compiled, as the passive-force callback of MuJoCo.

MuJoCo calls it once in each step with its own model and data, without Python and without the interpreter's lock::

    with installed():
        mujoco.mj_step(model, data, nstep=8000)

It is the law of :mod:`trainmj.collision.device` for every interface of a chain, and rail friction for every vehicle:
the force that would stop the vehicle within the step, at most mu m g, so that a standing vehicle stands. All parameters
and all
state are in mjData.userdata (:mod:`trainmj.collision.block`); simulations without such a block are left alone.

The state moves once per step: an evaluation at the same time again returns the same forces. Integrators that
evaluate forces several times a step would move it several times; :mod:`trainmj.collision.model` refuses them.

The places of MuJoCo's fields come from :mod:`trainmj.collision.offsets` and are compiled in.
"""

from __future__ import annotations

import ctypes
import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, cast

import mujoco
import numba
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from trainmj.collision.block import MAGIC, Car, Head, Joint
from trainmj.collision.interrupts import held_back
from trainmj.collision.offsets import Offsets, field_offsets

log = logging.getLogger(__name__)

APPROACH_SPEED = 0.01
"""A collision is over when no interface carries force and none comes closer faster than this [m/s]."""

STILL_SPEED = 1e-6
"""... or when every vehicle is slower than this [m/s]."""


@contextmanager
def installed() -> Iterator[None]:
    """Run MuJoCo with the device law; on leaving, the callbacks that were there are put back.

    May be nested and entered from several threads: the law stays until the last one leaves. MuJoCo's timers, which
    read the clock a dozen times a step, stand still meanwhile.

    Raises:
        EngineError: if the running MuJoCo does not have the fields the law needs.
    """
    global _users, _before
    with _lock:
        if _users == 0:
            _before = [get() for get, _ in _SLOTS]
            try:
                _put([None] * len(_SLOTS))  # MuJoCo compiles no model, not even a probe, under a Python callback
                _put(_callbacks())
            except BaseException:
                _put(_before)
                raise
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if _users == 0:
                _put(_before)


def _put(functions: Sequence[Any]) -> None:
    for (_, put), function in zip(_SLOTS, functions, strict=True):
        put(function)


_SLOTS: tuple[tuple[Callable[[], Any], Callable[[Any], None]], ...] = (
    (mujoco.get_mjcb_passive, mujoco.set_mjcb_passive),
    (mujoco.get_mjcb_sensor, mujoco.set_mjcb_sensor),
    (mujoco.get_mjcb_time, mujoco.set_mjcb_time),
)
_lock = threading.Lock()
_users = 0
_before: list[Any] = []


@cache
def _callbacks() -> tuple[Any, Any, Any]:
    """The compiled passive, sensor and time callbacks as ctypes function pointers."""
    offsets = field_offsets()
    pair = (ctypes.c_void_p, ctypes.c_void_p)
    with held_back():
        return (
            ctypes.CFUNCTYPE(None, *pair)(_compile(_passive, "void(voidptr, voidptr)", offsets)),
            ctypes.CFUNCTYPE(None, *pair, ctypes.c_int)(_compile(_sensor, "void(voidptr, voidptr, intc)", offsets)),
            ctypes.CFUNCTYPE(ctypes.c_double)(_compile(_no_clock, "float64()", offsets)),
        )


_kept: list[Any] = []  # compiled functions live as long as the process: MuJoCo holds bare pointers


def _compile(factory: Callable[[Offsets], Any], signature: str, offsets: Offsets) -> int:
    """Address of a C function, from numba's cache on disk where there is one."""
    try:
        function = numba.cfunc(signature, cache=True)(factory(offsets))
    except RuntimeError as error:
        log.warning(
            "the compiled law is not kept between processes (%s); set NUMBA_CACHE_DIR to a writable folder", error
        )
        function = numba.cfunc(signature)(factory(offsets))
    _kept.append(function)
    return cast(int, function.address)


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


# Values that the compiled functions use are taken in as arguments of these factories: numba's cache on disk tells
# such functions apart, while module globals are baked in unnoticed.


def _passive(offsets: Offsets) -> Any:
    at_nuserdata, at_timestep, at_time, at_userdata, at_qpos, at_qvel, at_passive, at_inertia, _ = offsets
    magic, approach_speed, still_speed = MAGIC, APPROACH_SPEED, STILL_SPEED
    n_head, n_car, n_joint = len(Head), len(Car), len(Joint)
    h_vehicles, h_interfaces, h_points = int(Head.N_VEHICLE), int(Head.N_INTERFACE), int(Head.N_POINT)
    h_time, h_over, h_impulse = int(Head.TIME), int(Head.OVER), int(Head.IMPULSE)
    h_stride, h_due, h_records = int(Head.STRIDE), int(Head.DUE), int(Head.RECORDS)
    h_most, h_done, h_ring = int(Head.MOST), int(Head.DONE), int(Head.N_RING)
    c_limit, c_speed, c_friction = int(Car.FRICTION_LIMIT), int(Car.SPEED), int(Car.FRICTION)
    c_work, c_device, c_total = int(Car.FRICTION_WORK), int(Car.DEVICE_PEAK), int(Car.TOTAL_PEAK)
    j_stiffness, j_damping, j_plastic = int(Joint.STIFFNESS), int(Joint.DAMPING), int(Joint.PLASTIC)
    j_stroke, j_force, j_work, j_segment = int(Joint.STROKE), int(Joint.FORCE), int(Joint.WORK), int(Joint.SEGMENT)
    j_most, j_most_time, j_peak = int(Joint.STROKE_MAX), int(Joint.STROKE_MAX_TIME), int(Joint.FORCE_MAX)
    j_dissipated = int(Joint.DISSIPATED)
    j_first, j_last = int(Joint.FIRST), int(Joint.LAST)

    def passive(model: Any, data: Any) -> None:
        if _size(model, at_nuserdata) < n_head:
            return
        s = _at(data, at_userdata)
        if s[0] != magic:
            return
        if s[h_done] != 0.0:
            return
        n = int(s[h_vehicles])
        m = int(s[h_interfaces])
        room = int(s[h_points])
        time = _in(data, at_time)[0]
        step = _in(model, at_timestep)[0]
        qpos = _at(data, at_qpos)
        qvel = _at(data, at_qvel)
        out = _at(data, at_passive)
        inertia = _at(data, at_inertia)
        cars = n_head
        joints = cars + n_car * n
        curves = joints + n_joint * m
        fresh = time != s[h_time]
        elapsed = time - s[h_time] if s[h_time] >= 0.0 else 0.0
        active = False
        still = True
        behind = 0.0  # force of the interface behind a vehicle, which pushes it forward
        impulse = 0.0
        for i in range(n):
            v = qvel[i]
            ahead = 0.0
            if i < m:
                j = joints + i
                if fresh:
                    x_right = qpos[i + 1] if i + 1 < n else 0.0
                    v_right = qvel[i + 1] if i + 1 < n else 0.0
                    u = qpos[i] - x_right
                    rate = v - v_right
                    stiffness = s[j + j_stiffness * m]
                    plastic = s[j + j_plastic * m]
                    elastic = stiffness * (u - plastic)
                    if elastic > 0.0:
                        base = curves + 3 * room * i
                        k = int(s[j + j_segment * m])
                        while k > 0 and u < s[base + k]:
                            k -= 1
                        while k + 1 < room and u >= s[base + k + 1]:
                            k += 1
                        s[j + j_segment * m] = k
                        crush = s[base + room + k] + s[base + 2 * room + k] * (u - s[base + k])
                        if elastic >= crush:
                            ahead = crush
                            s[j + j_plastic * m] = u - crush / stiffness
                        else:
                            ahead = min(crush, max(0.0, elastic + s[j + j_damping * m] * rate))
                        if ahead > 0.0:
                            active = True
                            if s[j + j_first * m] < 0.0:
                                s[j + j_first * m] = time
                            s[j + j_last * m] = time
                            if ahead > s[j + j_peak * m]:
                                s[j + j_peak * m] = ahead
                    moved = s[j + j_plastic * m] - plastic
                    travel = u - s[j + j_stroke * m]
                    before = s[j + j_force * m]
                    spring = max(0.0, stiffness * (u - s[j + j_plastic * m]))
                    s[j + j_dissipated * m] += 0.5 * (ahead + before) * moved + (ahead - spring) * travel
                    if rate > approach_speed:
                        active = True
                    s[j + j_work * m] += 0.5 * (ahead + before) * travel
                    if i + 1 == n:
                        impulse -= before * elapsed
                    s[j + j_stroke * m] = u
                    s[j + j_force * m] = ahead
                    if u > s[j + j_most * m]:
                        s[j + j_most * m] = u
                        s[j + j_most_time * m] = time
                else:
                    ahead = s[j + j_force * m]
            net = behind - ahead
            behind = ahead
            c = cars + i
            if fresh:
                mass = inertia[i]
                limit = s[c + c_limit * n]
                friction = -(mass * v / step + net)
                friction = min(limit, max(-limit, friction))
                held = s[c + c_friction * n]
                s[c + c_work * n] -= 0.5 * held * (s[c + c_speed * n] + v) * elapsed
                impulse += held * elapsed
                s[c + c_speed * n] = v
                s[c + c_friction * n] = friction
                device = abs(net) / mass
                if device > s[c + c_device * n]:
                    s[c + c_device * n] = device
                total = abs(net + friction) / mass
                if total > s[c + c_total * n]:
                    s[c + c_total * n] = total
                if abs(v) > still_speed:
                    still = False
            else:
                friction = s[c + c_friction * n]
            out[i] += net + friction
        if fresh:
            s[h_time] = time
            s[h_over] = 1.0 if still or not active else 0.0
            s[h_impulse] += impulse
            if s[h_stride] > 0.0:
                if s[h_due] == 0.0:
                    ring = curves + 3 * room * m + n * (int(s[h_records]) % int(s[h_ring]))
                    for i in range(n):
                        s[ring + i] = qvel[i]
                    s[h_records] += 1.0
                    s[h_due] = s[h_stride]
                    finite = s[h_impulse] - s[h_impulse] == 0.0
                    if s[h_over] != 0.0 or s[h_records] == s[h_most] or not finite:
                        s[h_done] = 1.0
                s[h_due] -= 1.0

    return passive


def _sensor(offsets: Offsets) -> Any:
    at_nuserdata, at_userdata, at_sensordata = offsets.nuserdata, offsets.userdata, offsets.sensordata
    magic, n_head, n_car = MAGIC, len(Head), len(Car)
    h_vehicles, h_interfaces = int(Head.N_VEHICLE), int(Head.N_INTERFACE)
    j_force, j_dissipated = int(Joint.FORCE), int(Joint.DISSIPATED)
    last_stage = int(mujoco.mjtStage.mjSTAGE_ACC)

    def sensor(model: Any, data: Any, stage: int) -> None:
        """Force and absorbed energy of each interface, the first user sensors of a model built by trainmj."""
        if stage != last_stage or _size(model, at_nuserdata) < n_head:
            return
        s = _at(data, at_userdata)
        if s[0] != magic:
            return
        m = int(s[h_interfaces])
        out = _at(data, at_sensordata)
        for i in range(m):
            j = n_head + n_car * int(s[h_vehicles]) + i
            out[i] = s[j + j_force * m]
            out[m + i] = s[j + j_dissipated * m]

    return sensor


def _no_clock(offsets: Offsets) -> Any:
    def clock() -> float:
        return 0.0

    return clock
