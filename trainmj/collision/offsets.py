"""Where the running MuJoCo keeps the fields that the device law needs.

mjModel and mjData have no stable layout. The places are found in the structs themselves, by values known to stand
there, and checked on a second simulation of another size.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import NamedTuple

import numpy as np

from trainmj.collision.mj import mujoco
from trainmj.errors import EngineError

_PAGE = 4096
_SEARCHED = 16 * 2**20  # bytes of a struct looked through before giving up


class Offsets(NamedTuple):
    """Places [bytes] of fields: of mjModel, then of mjData."""

    nuserdata: int
    timestep: int
    time: int
    userdata: int
    qpos: int
    qvel: int
    qfrc_passive: int
    inertia: int
    sensordata: int


@cache
def field_offsets() -> Offsets:
    """Places of the fields that the law needs, in the MuJoCo that runs now.

    Raises:
        EngineError: if one cannot be found, or is elsewhere in a simulation of another size.
    """
    found, second = _probe(2, 61, 1.25e-5), _probe(5, 187, 3.5e-4)
    places = []
    for name in Offsets._fields:
        both = sorted(found[name] & second[name])
        if not both:
            raise EngineError(
                f"MuJoCo {mujoco.__version__} keeps {name} where it was not found: this version is not supported; "
                "install one that trainmj was tested with (mujoco 4.0)"
            )
        places.append(both[0])
    return Offsets(*places)


def _probe(n: int, nuserdata: int, timestep: float) -> dict[str, set[int]]:
    """For each field, every place in a small simulation that could be it."""
    spec = mujoco.MjSpec()
    spec.nuserdata, spec.option.timestep = nuserdata, timestep
    for i in range(n):
        body = spec.worldbody.add_body(mass=1.0, inertia=[1.0, 1.0, 1.0], explicitinertial=True)
        joint = body.add_joint(name=f"probe{i}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.time = 1.0 + timestep
    in_model = {"nuserdata": np.int64(nuserdata).tobytes(), "timestep": np.float64(timestep).tobytes()}
    in_data = {"time": np.float64(data.time).tobytes()}
    for field, name in (
        ("userdata", "userdata"),
        ("qpos", "qpos"),
        ("qvel", "qvel"),
        ("qfrc_passive", "qfrc_passive"),
        ("inertia", "M"),
        ("sensordata", "sensordata"),
    ):
        in_data[field] = np.uint64(getattr(data, name).ctypes.data).tobytes()
    return _search(model._address, in_model) | _search(data._address, in_data)


def _search(address: int, wanted: dict[str, bytes]) -> dict[str, set[int]]:
    """Places [bytes] of 8-byte values behind an address; reads whole pages, and none behind the last value."""
    found: dict[str, set[int]] = {name: set() for name in wanted}
    start = address
    while not all(found.values()) and start - address < _SEARCHED:
        size = _PAGE - start % _PAGE
        page = ctypes.string_at(start, size)
        for name, value in wanted.items():
            at = page.find(value)
            while at >= 0:
                if (start + at - address) % 8 == 0:
                    found[name].add(start + at - address)
                at = page.find(value, at + 1)
        start += size
    return found
