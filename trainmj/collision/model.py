"""From a chain of vehicles to a MuJoCo model: a body for each vehicle, a tendon for each interface.

A vehicle with a body that gives has one for each of its points: M1 1, M1 2 and so on, from the end that faces the
impact. In the vertical plane each is a tree of bodies (:mod:`trainmj.collision.model_plane`), and only exported models
have tendons. Names are those a person uses: body and joint M1, tendon S1-M1, sensor "stroke S1-M1". A joint's position
is 0 where the two sides touch, so a tendon's length is the stroke of its interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.body import Member, Point
from trainmj.collision.chain import EVENTS, WALL, Chain, Interface
from trainmj.collision.envelope import Array
from trainmj.collision.mj import mujoco
from trainmj.collision.model_plane import add_rails_and_stops, add_vehicle, enable, names_of_dofs
from trainmj.collision.model_plane import numbers_of as numbers_in_plane
from trainmj.collision.press import press
from trainmj.errors import EngineError
from trainmj.files.memory import room
from trainmj.files.resources import shipped_folder

OF_DEVICES = ("force", "energy", "left stroke", "right stroke", "left energy", "right energy")
"""What the law of the devices writes for every interface; left and right are its devices."""

SENSED = (*OF_DEVICES, "stroke", "stroke rate")
"""What is sensed at every interface, in the order of the sensor data; then each point's MOTION."""

SENSED_IN_PLANE = (*SENSED, "step")
"""What the law writes for every interface in the vertical plane."""

OF_WHEELSETS = ("wheel load", "wheel rise")
"""What it writes there for every wheelset, behind that; then each vehicle's degrees of freedom, speed, acceleration."""

OF_MEMBERS = "plastic"
"""What the law of the members writes for every member of a body, behind that."""

MOTION = ("position", "velocity", "acceleration")

_INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    EVENTS: mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
}

_NEEDED = 64
"""For a model [MB]; without, MuJoCo's reader finds fault with the file, or ends the process."""

_NEVER = 1e3  # a tendon this far below its rest length pulls; nothing comes so far apart [m]


def build(chain: Chain, layout: Layout | None = None, bare: bool = False) -> mujoco.MjModel:
    """The compiled model of a chain.

    Args:
        chain: what to model.
        layout: room for the device law's block; by default what this chain needs.
        bare: only what moves: no tendons or sensors. The motion is the same to the last bit.
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


def spec(
    chain: Chain,
    layout: Layout | None = None,
    bare: bool = False,
    scene: bool = False,
    stand_in: bool = False,
) -> mujoco.MjSpec:
    """The editable model of a chain.

    Args:
        chain: what to model.
        layout: room for the device law's block; by default what this chain needs.
        bare: only what moves, as in :func:`build`.
        scene: with light, ground and materials of the base scene, for shapes to be added.
        stand_in: with elasto-plastic tendons in place of the device law, and no room for its block; in the vertical
            plane it stands on the rails of the base scene.
    """
    room(_NEEDED)
    base = mujoco.MjSpec.from_file(str(shipped_folder("mjcf") / "base.xml"))
    if not scene:
        base = _options_of(base)
    if bare:
        base.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    if chain.plane:
        enable(base.option)
    elif not stand_in:  # nothing in it has a spring of MuJoCo's, and to look for some takes time
        base.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SPRING)
    base.option.timestep = chain.step
    base.option.integrator = _INTEGRATORS[chain.integrator]
    base.nuserdata = 0 if stand_in else (layout or Layout.of(chain)).size
    if chain.plane:
        for i, place in enumerate(places_of(chain)):
            add_vehicle(base, chain, i, place)
    else:
        for i, point in enumerate(chain.points):
            _add_point(base, chain, i, point)
    base.add_key(name="start", qpos=chain.start_qpos, qvel=chain.start_qvel)
    if bare:
        return base
    if chain.plane and not stand_in:
        _add_sensors_in_plane(base, chain)
        return base
    for interface in chain.interfaces:
        _add_interface(base, chain, interface, stand_in)
    if stand_in:
        for member in chain.members:
            _add_member(base, chain, member)
        if chain.plane:
            add_rails_and_stops(base, chain)
    _add_sensors(base, chain, SENSED[len(OF_DEVICES) :] if stand_in else SENSED, stand_in)
    return base


def _add_interface(base: mujoco.MjSpec, chain: Chain, interface: Interface, stand_in: bool) -> None:
    """A tendon as long as the stroke of an interface; in the vertical plane that of a stand-in at its heights."""
    tendon, stroke_at_start = base.add_tendon(name=interface.name), 0.0
    found = stand_in_of(interface, chain.stand_in_speed) if stand_in else None
    for side, (point, sign) in enumerate(zip(chain.ends(interface), (1.0, -1.0), strict=True)):
        if point == WALL:
            continue
        name, gear = chain.points[point].name, chain.vehicles[chain.points[point].vehicle].gear
        tendon.wrap_joint(name, sign)
        if found and gear:
            lever = sign * (gear.cog_height - found.heights[side])
            tendon.wrap_joint(f"{name} pitch", lever)
            stroke_at_start += lever * gear.pitch
    if found:
        tendon.stiffness[0] = found.stiffness
        tendon.springyield = found.force / found.stiffness
        tendon.springlength[:] = -_NEVER, stroke_at_start


class StandIn(NamedTuple):
    """One force that stands in for the devices of an interface.

    Attributes:
        stiffness: with which it unloads [N/m].
        force: of the plateau [N].
        heights: above the rail, on the left and on the right, at which it acts in the vertical plane [m].
    """

    stiffness: float
    force: float
    heights: tuple[float, float] = (0.0, 0.0)


@lru_cache(maxsize=128)
def stand_in_of(interface: Interface, speed: float) -> StandIn:
    """What absorbs as much as an interface does up to its stroke limit.

    That is the mean force of first loading, up to where the first of its stages reaches its limit, or up to the end of
    a curve: at rest, but at a speed [m/s] where an orifice resists that alone. Its heights are the means of those of
    the lines, by what is absorbed until the next one takes over.
    """
    hydraulic = any(law.kind.name == "hydraulic" for element in interface.elements for law in element.laws)
    path = press(interface, speed=speed if hydraulic else 0.0)
    ends = [float(path.stroke[-1])]
    for side, device in enumerate(interface.devices):
        limit = min((stage.start + stage.limit for stage in device.stages), default=np.inf)
        if limit < path.sides[-1, side]:
            ends.append(float(np.interp(limit, path.sides[:, side], path.stroke)))
    stiffness = [device.envelope.stiffness for device in interface.devices]
    end = min(ends)
    whole = StandIn(1.0 / sum(1.0 / k for k in stiffness), path.work(end) / end)
    acting = [(element.line, element.start) for element in interface.elements if element.sign > 0]
    lines = [line for line, _ in acting if line]
    if not lines:
        return whole
    absorbed = np.diff([path.work(min(end, place)) for place in (0.0, *(start for _, start in acting[1:]), end)])
    heights = np.average([[line.left.height, line.right.height] for line in lines], axis=0, weights=absorbed)
    return whole._replace(heights=(float(heights[0]), float(heights[1])))


def _options_of(scene: mujoco.MjSpec) -> mujoco.MjSpec:
    """An empty model with the options of the base scene."""
    empty = mujoco.MjSpec()
    empty.option.disableflags = scene.option.disableflags
    empty.option.enableflags = scene.option.enableflags
    return empty


def places_of(chain: Chain) -> list[float]:
    """Where the middles of the vehicles stand, were there no gap [m]; the two sides touch at 0."""
    return [_centre(chain, i) + (chain.gap if i < chain.n_moving else 0.0) for i in range(len(chain.vehicles))]


def numbers_of(chain: Chain) -> dict[str, Array]:
    """The fields of a model in which chains of one size differ, by name; without those of the world."""
    return numbers_in_plane(chain, places_of(chain)) if chain.plane else {"body_mass": chain.point_mass}


def _centre(chain: Chain, index: int) -> float:
    """Position of a vehicle's middle at the start [m]; the two sides would touch at 0."""
    lengths = [v.length for v in chain.vehicles]
    if index < chain.n_moving:
        return -chain.gap - sum(lengths[index + 1 : chain.n_moving]) - lengths[index] / 2
    return sum(lengths[chain.n_moving : index]) + lengths[index] / 2


def _add_point(base: mujoco.MjSpec, chain: Chain, index: int, point: Point) -> None:
    vehicle = chain.vehicles[point.vehicle]
    # the inertia tensor is a uniform box's; it never matters on a slide joint, but MuJoCo wants a physical one
    x, y, z = vehicle.length, 2.8, 3.6
    body = base.worldbody.add_body(
        name=point.name,
        pos=[_centre(chain, point.vehicle) - 0.5 * vehicle.length + point.place, 0, 0],
        mass=point.mass,
        ipos=[0, 0, 0],
        inertia=np.array([y * y + z * z, x * x + z * z, x * x + y * y]) * point.mass / 12,
        explicitinertial=True,
    )
    body.add_joint(name=point.name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0], ref=float(chain.start[index]))


def _add_member(base: mujoco.MjSpec, chain: Chain, member: Member) -> None:
    """A member of a body as a tendon of MuJoCo's: a spring that yields but does not harden, or one with a dashpot.

    The dashpot of a tendon does not yield: in a fast collapse it alone would carry more than the member does.
    """
    tendon = base.add_tendon(name=member.name)
    tendon.wrap_joint(chain.points[member.left].name, 1.0)
    tendon.wrap_joint(chain.points[member.right].name, -1.0)
    tendon.stiffness[0] = member.stiffness
    tendon.springlength[:] = 0.0, 0.0
    if member.collapse < np.inf:
        tendon.springyield = member.collapse / member.stiffness
    else:
        tendon.damping[0] = member.damping


def _sense_law(base: mujoco.MjSpec, name: str) -> None:
    """What the law writes: the first sensors, of MuJoCo's kind for users."""
    base.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_USER, dim=1, needstage=mujoco.mjtStage.mjSTAGE_ACC)


def _sense_motion(base: mujoco.MjSpec, joints: Sequence[str], bodies: Sequence[str]) -> None:
    """The position of each joint; the speed and acceleration of each body along the track, on the joint of its name."""
    kind, thing = mujoco.mjtSensor, mujoco.mjtObj
    for motion, of_kind, names in (
        ("position", kind.mjSENS_JOINTPOS, joints),
        ("velocity", kind.mjSENS_JOINTVEL, bodies),
        ("acceleration", kind.mjSENS_FRAMELINACC, bodies),
    ):
        for name in names:
            sensor = base.add_sensor(name=f"{motion} {name}", type=of_kind, objname=name)
            sensor.objtype = thing.mjOBJ_BODY if motion == "acceleration" else thing.mjOBJ_JOINT


def _add_sensors_in_plane(base: mujoco.MjSpec, chain: Chain) -> None:
    for name in SENSED_IN_PLANE:
        for interface in chain.interfaces:
            _sense_law(base, f"{name} {interface.name}")
    for name in OF_WHEELSETS:
        for i, k in chain.wheelsets:
            _sense_law(base, f"{name} {chain.name_of_wheelset(i, k)}")
    dofs = [name for i in range(len(chain.vehicles)) for name in names_of_dofs(chain, i)]
    _sense_motion(base, dofs, [vehicle.name for vehicle in chain.vehicles])


def _add_sensors(base: mujoco.MjSpec, chain: Chain, sensed: Sequence[str], stand_in: bool) -> None:
    kind, thing = mujoco.mjtSensor, mujoco.mjtObj

    for name in (name for name in sensed if name in OF_DEVICES):
        for interface in chain.interfaces:
            _sense_law(base, f"{name} {interface.name}")
    for member in () if stand_in else chain.members:
        _sense_law(base, f"{OF_MEMBERS} {member.name}")
    for name in (name for name in sensed if name not in OF_DEVICES):
        for interface in chain.interfaces:
            of_tendon = kind.mjSENS_TENDONPOS if name == "stroke" else kind.mjSENS_TENDONVEL
            base.add_sensor(
                name=f"{name} {interface.name}", type=of_tendon, objtype=thing.mjOBJ_TENDON, objname=interface.name
            )
    points = [point.name for point in chain.points]
    _sense_motion(base, points, points)


def split_sensors(chain: Chain, logged: Array) -> dict[str, Array]:
    """Logged sensor data by name.

    Args:
        chain: whose model it is.
        logged: (n_sample, n_sensordata).

    Returns:
        (n_sample, n_interface) for each of SENSED; OF_MEMBERS (n_sample, n_member); each of MOTION (n_sample, n_point),
        and (n_sample, n_vehicle) of the centres of mass. In the vertical plane the step (n_sample, n_interface),
        OF_WHEELSETS (n_sample, n_wheelset), and all degrees of freedom (n_sample, n_dof).
    """
    if chain.plane:
        return _split_in_plane(chain, logged)
    m, n, inner = len(chain.interfaces), len(chain.points), len(chain.members)
    columns, start = {}, 0
    for name in SENSED:
        columns[name.replace(" ", "_")] = logged[:, start : start + m]
        start += m
        if name == OF_DEVICES[-1]:
            columns[f"member_{OF_MEMBERS}"] = logged[:, start : start + inner]
            start += inner
    motion = _motion(logged[:, start:], n, n)
    columns |= {f"point_{name}": values for name, values in motion.items()}
    columns |= {name: np.zeros((len(logged), 0)) for name in ("step", "wheel_load", "wheel_rise", "dof")}
    return columns | {name: chain.of_vehicles(values) for name, values in motion.items()}


def _split_in_plane(chain: Chain, logged: Array) -> dict[str, Array]:
    m, columns, start = len(chain.interfaces), {}, 0
    for name, width in (*((name, m) for name in SENSED_IN_PLANE), *((n, len(chain.wheelsets)) for n in OF_WHEELSETS)):
        columns[name.replace(" ", "_")] = logged[:, start : start + width]
        start += width
    dof, n = chain.first_dof[-1], len(chain.vehicles)
    motion = _motion(logged[:, start:], dof, n)
    dofs = motion["position"]
    motion["position"] = dofs[:, list(chain.first_dof[:-1])]
    columns |= {f"point_{name}": values for name, values in motion.items()}
    return columns | motion | {"dof": dofs, f"member_{OF_MEMBERS}": np.zeros((len(logged), 0))}


def _motion(logged: Array, n_joint: int, n_body: int) -> dict[str, Array]:
    """What :func:`_sense_motion` has sensed, by MOTION."""
    speeds, accelerations = n_joint + n_body, n_joint + 4 * n_body
    return {
        "position": logged[:, :n_joint],
        "velocity": logged[:, n_joint:speeds],
        "acceleration": logged[:, speeds:accelerations:3],  # its x component
    }
