"""From a chain of vehicles to a MuJoCo model: the base scene, a body for each vehicle, a tendon for each interface.

Names are those a person uses: body and joint M1, tendon S1-M1, sensor "stroke S1-M1". A joint's position is 0 where
the two sides touch, so a tendon's length is the stroke of its interface.
"""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np

from trainmj.chain import WALL, Chain, Vehicle
from trainmj.device import Array
from trainmj.errors import EngineError, OutputError
from trainmj.layout import Layout
from trainmj.resources import shipped_folder

SENSED = ("force", "energy", "stroke", "stroke rate")
"""What is sensed at every interface, in the order of the sensor data; then each vehicle's MOTION."""

MOTION = ("position", "velocity", "acceleration")

_INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
}
_COUPLING = 0.8  # visible distance between two car bodies [m]


def build(chain: Chain, layout: Layout | None = None, bare: bool = False) -> mujoco.MjModel:
    """The compiled model of a chain.

    Args:
        chain: what to model.
        layout: room for the device law's block; by default what this chain needs.
        bare: only what moves: no track, shapes, tendons or sensors. The motion is the same to the last bit.
    """
    model = spec(chain, layout, bare).compile()
    check_integrator(model)
    return model


def check_integrator(model: mujoco.MjModel) -> None:
    """Refuse an integrator that evaluates forces more than once a step.

    Raises:
        EngineError: for RK4 and the discrete integrator.
    """
    if model.opt.integrator not in _INTEGRATORS.values():
        name = mujoco.mjtIntegrator(model.opt.integrator).name
        raise EngineError(
            f"the integrator {name} does not evaluate forces exactly once a step, as the plastic state of a device "
            f"needs: use one of {', '.join(_INTEGRATORS)}"
        )


def spec(chain: Chain, layout: Layout | None = None, bare: bool = False) -> mujoco.MjSpec:
    """The editable model of a chain; arguments as in :func:`build`."""
    base = mujoco.MjSpec() if bare else mujoco.MjSpec.from_file(str(shipped_folder("mjcf") / "base.xml"))
    if bare:
        _copy_options(base)
    base.option.timestep = chain.step
    base.option.integrator = _INTEGRATORS[chain.integrator]
    base.nuserdata = (layout or Layout.of(chain)).size
    for i, vehicle in enumerate(chain.vehicles):
        _add_vehicle(base, chain, i, vehicle, bare)
    base.add_key(name="start", qpos=chain.start, qvel=chain.speed)
    if bare:
        return base
    if chain.interfaces[-1].right == WALL:
        base.worldbody.add_geom(
            name="wall",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[1, 3, 2.5],
            pos=[1, 0, 2.5],
            material="wall",
            contype=0,
            conaffinity=0,
        )
    for interface in chain.interfaces:
        tendon = base.add_tendon(name=interface.name)
        tendon.wrap_joint(chain.vehicles[interface.left].name, 1.0)
        if interface.right != WALL:
            tendon.wrap_joint(chain.vehicles[interface.right].name, -1.0)
    _add_sensors(base, chain)
    return base


def export(chain: Chain, title: str = "") -> str:
    """The model as MJCF text, which MuJoCo's own programs open.

    Args:
        chain: what to model.
        title: said in the comment at the top.
    """
    xml = spec(chain).to_xml()
    comment = (
        f"<!-- {_comment_text(title)}\n"
        "     Written by trainmj. The keyframe 'start' has both trains at speed. The forces of couplers, crush tubes,\n"
        "     anti-climbers and rails are not MJCF: trainmj brings them as callbacks. Without it the vehicles keep\n"
        "     their speeds and pass through each other. -->\n"
    )
    return comment + str(xml)


def write(text: str, file: str | Path) -> None:
    """Write text to a file.

    Raises:
        OutputError: if that is not possible.
    """
    try:
        Path(file).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error.strerror})") from None


def _comment_text(title: str) -> str:
    words = " ".join(re.sub("-{2,}", "-", title).split())  # XML forbids two dashes in a comment
    return words or "Train collision"


def _copy_options(bare: mujoco.MjSpec) -> None:
    """The options of the base scene, without sensors."""
    base = mujoco.MjSpec.from_file(str(shipped_folder("mjcf") / "base.xml"))
    bare.option.disableflags = base.option.disableflags | int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    bare.option.enableflags = base.option.enableflags


def _centre(chain: Chain, index: int) -> float:
    """Position of a vehicle's middle at the start [m]; the two sides would touch at 0."""
    lengths = [v.length for v in chain.vehicles]
    if index < chain.n_moving:
        return -chain.gap - sum(lengths[index + 1 : chain.n_moving]) - lengths[index] / 2
    return sum(lengths[chain.n_moving : index]) + lengths[index] / 2


def _add_vehicle(base: mujoco.MjSpec, chain: Chain, index: int, vehicle: Vehicle, bare: bool) -> None:
    # the inertia tensor is a uniform box's; it never matters on a slide joint, but MuJoCo wants a physical one
    x, y, z = vehicle.length, 2.8, 3.6
    body = base.worldbody.add_body(
        name=vehicle.name,
        pos=[_centre(chain, index), 0, 0],
        mass=vehicle.mass,
        ipos=[0, 0, 0],
        inertia=np.array([y * y + z * z, x * x + z * z, x * x + y * y]) * vehicle.mass / 12,
        explicitinertial=True,
    )
    body.add_joint(name=vehicle.name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0], ref=float(chain.start[index]))
    if not bare:
        _add_shapes(body, chain, index, vehicle)


def _add_shapes(body: mujoco.MjsBody, chain: Chain, index: int, vehicle: Vehicle) -> None:
    """A car body with a window band, on two bogies; for the eye only."""
    box = mujoco.mjtGeom.mjGEOM_BOX
    half = max(0.1, (vehicle.length - _COUPLING) / 2)
    shell = "moving" if index < chain.n_moving else "partner"
    bogie = min(1.2, half / 3)
    shapes = [
        ("body", [half, 1.4, 1.3], [0, 0, 2.35], shell),
        ("windows", [half * 0.92, 1.41, 0.38], [0, 0, 2.75], "window"),
        ("bogie 1", [bogie, 1.1, 0.4], [half * 0.7, 0, 0.45], "bogie"),
        ("bogie 2", [bogie, 1.1, 0.4], [-half * 0.7, 0, 0.45], "bogie"),
    ]
    for name, size, pos, material in shapes:
        body.add_geom(
            name=f"{vehicle.name} {name}",
            type=box,
            size=size,
            pos=pos,
            material=material,
            contype=0,
            conaffinity=0,
            mass=0,
        )


def _add_sensors(base: mujoco.MjSpec, chain: Chain) -> None:
    kind, thing = mujoco.mjtSensor, mujoco.mjtObj
    for sensed in SENSED:
        for interface in chain.interfaces:
            sensor = base.add_sensor(name=f"{sensed} {interface.name}")
            if sensed in ("force", "energy"):  # from the device law, which writes the first user sensors
                sensor.type, sensor.dim, sensor.needstage = kind.mjSENS_USER, 1, mujoco.mjtStage.mjSTAGE_ACC
            else:
                sensor.type = kind.mjSENS_TENDONPOS if sensed == "stroke" else kind.mjSENS_TENDONVEL
                sensor.objtype, sensor.objname = thing.mjOBJ_TENDON, interface.name
    kinds = {
        "position": kind.mjSENS_JOINTPOS,
        "velocity": kind.mjSENS_JOINTVEL,
        "acceleration": kind.mjSENS_FRAMELINACC,
    }
    for motion in MOTION:
        for vehicle in chain.vehicles:
            sensor = base.add_sensor(name=f"{motion} {vehicle.name}", type=kinds[motion], objname=vehicle.name)
            sensor.objtype = thing.mjOBJ_BODY if motion == "acceleration" else thing.mjOBJ_JOINT


def split_sensors(chain: Chain, logged: Array) -> dict[str, Array]:
    """Logged sensor data by name.

    Args:
        chain: whose model it is.
        logged: (n_sample, n_sensordata).

    Returns:
        (n_sample, n_interface) for each of SENSED, (n_sample, n_vehicle) for each of MOTION.
    """
    m, n = len(chain.interfaces), len(chain.vehicles)
    columns = {name.replace(" ", "_"): logged[:, k * m : (k + 1) * m] for k, name in enumerate(SENSED)}
    start = len(SENSED) * m
    columns["position"] = logged[:, start : start + n]
    columns["velocity"] = logged[:, start + n : start + 2 * n]
    columns["acceleration"] = logged[:, start + 2 * n : start + 5 * n : 3]  # its x component
    return columns
