"""A collision as a MuJoCo model with shapes: track, car bodies, and the parts of every device at rest."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from textwrap import fill

import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.body import nearest
from trainmj.collision.chain import WALL, Chain, Interface
from trainmj.collision.device import CAR_BODY, Stage
from trainmj.collision.gear import Gear
from trainmj.collision.law.hydraulic import recovers
from trainmj.collision.mj import mujoco, undisturbed
from trainmj.collision.model import StandIn, spec, stand_in_of
from trainmj.collision.model_plane import SMALLEST
from trainmj.units import KN, KN_PER_MM, readable
from trainmj.view import meshes
from trainmj.view.drawings import DRAWINGS, HUNG, on_bogies, wall
from trainmj.view.parts import SHADE, SKIN, Body, Part, ends, middle_of, rail_of, setback

_TRACK = 120.0  # track beyond the ends of the trains [m]
_BOGIES = 0.17  # of the length of a body, from its ends to the middles of its bogies
_CLEAR = 0.9  # from an axle to what hangs below the floor between the bogies [m]
_SLIVER = 0.005  # what is shorter of a car body is not drawn [m]
_SLEEPERS = 800  # at most; a longer track has them near the impact only
_PLANE = (
    "In the vertical plane each of them acts along the track at one height, the mean of the heights of its lines by "
    "what each absorbs. Weight, springs and dampers are those of the scenario. Contacts without friction, about as "
    "soft as the rails of the scenario, stand in for these, and limits of joints for the stops of the suspensions. "
)
_BOX, _CYLINDER, _MESH = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_MESH
_UNTOUCHED = {"contype": 0, "conaffinity": 0}
_NOTHING = Stage("", 0.0, 0.0)  # before the first one
_WEIGHTLESS = {**_UNTOUCHED, "mass": 0}


def visible(chain: Chain, layout: Layout | None = None, stand_in: bool = False) -> mujoco.MjSpec:
    """The editable model of a chain with all its shapes, which cost time at every step and change no number.

    Args:
        chain: what to model.
        layout: room for the device law's block; by default what this chain needs.
        stand_in: with elasto-plastic tendons in place of the device law.
    """
    model = spec(chain, layout, scene=True, stand_in=stand_in)
    _add_track(model, chain)
    found = list(ends(chain))
    for i in range(len(chain.vehicles)):
        _add_vehicle(model, chain, i, [end.body for end in found if end.vehicle == i and end.body is not None])
    for end in found:
        body = model.worldbody if end.point == WALL else model.body(chain.points[end.point].name)
        for part in end.parts:
            _add_part(body, part, end.direction, middle_of(chain, end.point), rail_of(chain, end.point))
    return model


@undisturbed()
def export(chain: Chain, title: str = "") -> str:
    """The model as MJCF text that MuJoCo's own programs can run.

    MJCF cannot hold the device law. MuJoCo's elasto-plastic tendons take its place, with one plateau for each
    interface (:func:`~trainmj.collision.model.stand_in_of`). The file has no room for the law's block, so the two never
    act together.

    Args:
        chain: what to model.
        title: for the comment at the top.
    """
    words = " ".join(re.sub("-{2,}", "-", title).split())  # XML forbids two dashes in a comment
    stand_ins = "".join(
        f"\n       {i.name}: {_said(i, stand_in_of(i, chain.stand_in_speed))}" for i in chain.interfaces
    )
    stand_ins += "".join(f"\n       {line}" for line in _bodies(chain))
    bodies = (
        "Car bodies that give have such a tendon for each member, which shortens and is drawn out; it yields at the "
        "collapse force of the scenario, or has the dashpot of the member if none is stated. "
        if chain.members
        else ""
    )
    said = (
        "Written by trainmj. Start from the keyframe 'start', which has both trains at speed: in MuJoCo's viewer, "
        "section Simulation, Load key. The devices of the scenario are NOT in this file: MJCF cannot express them. "
        "Stand-ins take their place, one for each interface: ideal elasto-plastic tendons (springyield, of MuJoCo 4.0) "
        "that push and never pull, with the unloading stiffness of the devices and one force, their mean up to the "
        f"first stroke limit. {bodies}{_PLANE if chain.plane else ''}Left out: {'; '.join(_left_out(chain))}. "
        "Strokes and accelerations differ from those of trainmj."
    )
    lines = fill(said, 112, initial_indent="     ", subsequent_indent="     ", break_on_hyphens=False)
    comment = f"<!-- {words or 'Train collision'}\n{lines}"
    return f"{comment}{stand_ins} -->\n{visible(chain, stand_in=True).to_xml()}"


def _said(interface: Interface, found: StandIn) -> str:
    """A stand-in in words."""
    words = f"{readable(found.force / KN, 0)} kN, {found.stiffness / KN_PER_MM:.6g} kN/mm"
    if interface.elements[0].line is None:
        return words
    heights = dict.fromkeys(f"{height:.3f} m" for height in found.heights)
    return f"{words}, at {' and '.join(heights)}"


def _bodies(chain: Chain) -> Iterator[str]:
    """A line for the body of each vehicle that gives."""
    for i, vehicle in enumerate(chain.vehicles):
        inner = [member for member in chain.members if member.vehicle == i]
        for whole, said in ((True, "member"), (False, "bogie")):
            alike = [member for member in inner if bool(member.span) == whole]
            if alike:
                collapse = f", yields at {readable(alike[0].collapse / KN, 0)} kN" if alike[0].collapse < np.inf else ""
                stiffness = f"{alike[0].stiffness / KN_PER_MM:.6g} kN/mm"
                yield f"{vehicle.name}, {len(alike)} {said}{'s' * (len(alike) > 1)}: {stiffness} each{collapse}"


def _left_out(chain: Chain) -> Iterator[str]:
    """What a scenario has and an exported file has not."""
    devices = [device for interface in chain.interfaces for device in interface.devices]
    elements = [element for interface in chain.interfaces for element in interface.elements]
    laws = [law for element in elements for law in element.laws]
    kinds = {law.kind.name for law in laws}
    gaps = [b.start > a.end for device in devices for a, b in pairwise((_NOTHING, *device.stages))]
    falls = [(f[:-1] > 0.0) & (f[1:] == 0.0) for f in (device.envelope.force for device in devices)]
    behind = any(d.stages[-1].name == CAR_BODY or d.envelope.last_slope > 0.0 for d in devices)
    words = {
        "the shape of curves": bool(kinds - {"hydraulic"}),
        "empty strokes": any(gaps),
        "shear-off": any(fall.any() for fall in falls),
        "dashpots": any(law.loading.damping > 0.0 for law in laws),
        "rate dependence": "rate" in kinds,
        "recovery, and the lower curve along which it goes": "hysteresis" in kinds,
        f"orifices, but for their force at {chain.stand_in_speed:.3g} m/s, half the closing speed": "hydraulic"
        in kinds,
        "gas springs, but for their force": any(d.law.kind.store == "gas" and recovers(d.law) for d in devices),
        "stops and car bodies behind the end of a device": behind,
        "that two devices in series have a state each": any(len(element.laws) > 1 for element in elements),
        "parallel paths": any(sum(e.sign > 0 for e in i.elements) > 1 for i in chain.interfaces),
        "draw gear": any(element.sign < 0 for element in elements),
        "dashpots of members that yield": any(m.damping and m.collapse < np.inf for m in chain.members),
        "that members of car bodies harden as they yield": any(member.hardening for member in chain.members),
        "that struts turn about their pins, and their swing stops": any(line.strut for line in chain.lines),
        "vertical ties of faces": any(line.tie for line in chain.lines),
        "that faces slide off each other": any(line.overlap < np.inf for line in chain.lines),
        "friction of rails and ground": any(vehicle.rail_friction for vehicle in chain.vehicles),
        "brakes": any(vehicle.brake for vehicle in chain.vehicles),
        "the grade of the track": bool(chain.grade),
    }
    return (said for said, applies in words.items() if applies)


def _add_vehicle(model: mujoco.MjSpec, chain: Chain, i: int, given: Sequence[Body]) -> None:
    """The body of a vehicle, of meshes; equal vehicles share them, but for what gives way."""
    vehicle = chain.vehicles[i]
    rear, front = (vehicle.length / 2 - setback(chain, i, direction) for direction in (-1, 1))
    side = range(chain.n_moving) if i < chain.n_moving else range(chain.n_moving, len(chain.vehicles))
    cabs = tuple(direction for direction, end in ((-1, side[0]), (1, side[-1])) if i == end)
    hung = _hung(vehicle.gear)
    pieces = DRAWINGS[vehicle.drawing](-rear, front, cabs, hung)
    key = f"{vehicle.drawing} {rear:.3f} {front:.3f} {cabs} {[body.name.split()[1] for body in given]}"
    key += f" {hung:.3f}" if hung != HUNG else ""
    skin = next(iter(pieces))
    for material, whole in pieces.items():
        paint = _paint(material, i < chain.n_moving)
        for name, point, piece in _sections(chain, i, whole):
            body, x = model.body(chain.points[point].name), (middle_of(chain, point), rail_of(chain, point))
            kept: meshes.Mesh | None = piece
            for end in given if material != SHADE else ():
                direction = 1 if "front" in end.name.split() else -1
                kept, crumpling = meshes.cut(kept, direction * end.start, direction) if kept else (None, None)
                if crumpling is not None:
                    of_end = f"{end.name}{f' {name}' if vehicle.body else ''} {SKIN if material == skin else material}"
                    _add_shape(body, model, of_end, of_end, crumpling, paint, x)
            if kept is not None:
                own = f"{name} {SKIN if vehicle.body and material == skin else material}"
                _add_shape(body, model, own, own if vehicle.body else f"{key} {material}", kept, paint, x)
    if vehicle.gear is not None:
        _add_gear(model, chain, i, vehicle.gear)
    else:
        _add_bogies(model, chain, i, rear, front)


def _sections(chain: Chain, i: int, mesh: meshes.Mesh) -> Iterator[tuple[str, int, meshes.Mesh]]:
    """A mesh of a vehicle, cut where its members meet: names, the points that hold the pieces, and these."""
    vehicle = chain.vehicles[i]
    inner = [chain.members[k] for k in chain.members_of(i)]
    if not inner:
        yield vehicle.name, chain.first[i], mesh
        return
    rest: meshes.Mesh | None = mesh
    for member in inner:
        piece = rest
        if member is not inner[-1] and rest is not None and member.span is not None:
            piece, rest = meshes.cut(rest, member.span[1] - 0.5 * vehicle.length, 1)
        if piece is not None and np.ptp(piece.vertices[:, 0]) > _SLIVER:
            yield member.name, member.left, piece


def _add_bogies(model: mujoco.MjSpec, chain: Chain, i: int, rear: float, front: float) -> None:
    """The two bogies of a vehicle: on points of their own, if it has such, or on the nearest one."""
    vehicle, length = chain.vehicles[i], rear + front
    if not on_bogies(vehicle.drawing):
        return
    body = vehicle.body
    places = -rear + _BOGIES * length, front - _BOGIES * length
    for k, place in enumerate(places):
        point = chain.first[i]
        if body and body.bogies:
            point += body.n_members + 1 + k
            place = (k - 0.5) * body.bogies.centres
        elif body:
            point += nearest(body, vehicle.length, place + 0.5 * vehicle.length)
        name = f"{vehicle.name} bogie {'left' if k == 0 else 'right'}"
        _add_shape(
            model.body(chain.points[point].name),
            model,
            name,
            f"bogie {length:.3f}",
            meshes.bogie(length),
            "bogie",
            (place + middle_of(chain, point), 0.0),
        )


def _add_gear(model: mujoco.MjSpec, chain: Chain, i: int, gear: Gear) -> None:
    """The frames and wheelsets of a vehicle in the vertical plane, each on the body that moves it.

    A vehicle that stands higher stands on larger wheels: those of the others are worn.
    """
    axle = gear.axle_height + gear.offset
    radius = max(SMALLEST, axle)
    frame, wheelset = meshes.frame(gear.wheelbase, gear.axle_height), meshes.wheelset(radius)
    for bogie in range(2):
        name = chain.name_of_bogie(i, bogie)
        key = f"frame {gear.wheelbase:.3f} {gear.axle_height:.3f}"
        _add_shape(model.body(name), model, name, key, frame, "bogie", (0.0, -gear.link_height))
    for k in range(4):
        name = chain.name_of_wheelset(i, k)
        _add_shape(model.body(name), model, name, f"wheelset {radius:.3f}", wheelset, "bogie", (0.0, -axle))


def _hung(gear: Gear | None) -> float:
    """Half the length of what hangs below the floor, for which bogies at their true places leave room [m]."""
    return HUNG if gear is None else min(HUNG, 0.5 * (gear.centres - gear.wheelbase) - _CLEAR)


def _paint(material: str, moving: bool) -> str:
    """The material of the base scene."""
    return ("moving" if moving else "partner") if material == "livery" else material


def _add_shape(
    body: mujoco.MjsBody,
    model: mujoco.MjSpec,
    name: str,
    key: str,
    mesh: meshes.Mesh,
    material: str,
    at: tuple[float, float],
) -> None:
    """A shape made of a mesh, which is added where there is none of its key, at a place and a height [m]."""
    if model.mesh(key) is None:
        _add_mesh(model, key, mesh)
    body.add_geom(name=name, type=_MESH, meshname=key, material=material, pos=[at[0], 0, at[1]], **_WEIGHTLESS)


def _add_mesh(model: mujoco.MjSpec, name: str, mesh: meshes.Mesh) -> None:
    model.add_mesh(
        name=name,
        uservert=mesh.vertices.ravel().tolist(),
        userface=mesh.faces.ravel().tolist(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )


def _add_part(body: mujoco.MjsBody, part: Part, direction: int, middle: float, rail: float) -> None:
    half, section = 0.5 * (part.end - part.start), part.shape.section
    is_round = len(section) == 1
    body.add_geom(
        name=part.name,
        type=_CYLINDER if is_round else _BOX,
        size=[*section, half, 0] if is_round else [half, *section],
        pos=[middle + direction * 0.5 * (part.start + part.end), part.place[0], part.place[1] + rail],
        quat=[np.sqrt(0.5), 0, np.sqrt(0.5), 0] if is_round else [1, 0, 0, 0],  # a cylinder's axis is its z
        material=part.shape.material,
        **_WEIGHTLESS,
    )


def _add_track(model: mujoco.MjSpec, chain: Chain) -> None:
    """Sleepers below the trains, rails to beyond their ends, and the wall if there is one."""
    lengths = np.array([v.length for v in chain.vehicles])
    left, right = lengths[: chain.n_moving].sum() + chain.gap + _TRACK, lengths[chain.n_moving :].sum() + _TRACK
    for name in ("ballast", "rail left", "rail right"):
        geom = model.geom(name)
        geom.size[0], geom.pos[0] = (left + right) / 2, (right - left) / 2
    reach = 0.3 * _SLEEPERS
    _add_mesh(model, "sleepers", meshes.sleepers(max(-left, -reach), min(right, reach)))
    world = model.worldbody
    world.add_geom(name="sleepers", type=_MESH, meshname="sleepers", material="sleeper", **_UNTOUCHED)
    if chain.interfaces[-1].right == WALL:
        _add_wall(model, chain)


def _add_wall(model: mujoco.MjSpec, chain: Chain) -> None:
    """The wall, and what stands fixed at it."""
    world, obstacle, face = model.worldbody, chain.obstacle, 0.0
    if obstacle is not None:
        face, half = obstacle.length, 0.5 * obstacle.length
        pieces = DRAWINGS[obstacle.drawing](setback(chain, WALL, -1) - half, half, (), HUNG)
        for material, mesh in pieces.items():
            name = f"obstacle {material}"
            _add_shape(world, model, name, name, mesh, _paint(material, False), (half, 0.0))
    for material, mesh in wall(face).items():
        name = "wall" if material == "wall" else f"wall {material}"
        _add_shape(world, model, name, name, mesh, material, (0.0, 0.0))
