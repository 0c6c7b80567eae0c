"""A collision as a MuJoCo model with shapes: track, car bodies, and the parts of every device at rest."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from textwrap import fill

import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.device import CAR_BODY, Stage
from trainmj.collision.law.hydraulic import recovers
from trainmj.collision.mj import mujoco, undisturbed
from trainmj.collision.model import spec, stand_in_of
from trainmj.units import KN, KN_PER_MM
from trainmj.view import meshes
from trainmj.view.parts import SKIN, Body, Part, ends, middle_of, setback

_TRACK = 120.0  # track beyond the ends of the trains [m]
_SLEEPERS = 800  # at most; a longer track has them near the impact only
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
        body = model.worldbody if end.vehicle == WALL else model.body(chain.vehicles[end.vehicle].name)
        for part in end.parts:
            _add_part(body, part, end.direction, middle_of(chain, end.vehicle))
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
        f"\n       {i.name}: {force / KN:.0f} kN, {stiffness / KN_PER_MM:.6g} kN/mm"
        for i in chain.interfaces
        for stiffness, force in [stand_in_of(i, chain.stand_in_speed)]
    )
    said = (
        "Written by trainmj. Start from the keyframe 'start', which has both trains at speed: in MuJoCo's viewer, "
        "section Simulation, Load key. The devices of the scenario are NOT in this file: MJCF cannot express them. "
        "Stand-ins take their place, one for each interface: ideal elasto-plastic tendons (springyield, of MuJoCo 4.0) "
        "that push and never pull, with the unloading stiffness of the devices and one force, their mean up to the "
        f"first stroke limit. Left out: {'; '.join(_left_out(chain))}. Strokes and accelerations differ from those of "
        "trainmj."
    )
    lines = fill(said, 112, initial_indent="     ", subsequent_indent="     ", break_on_hyphens=False)
    comment = f"<!-- {words or 'Train collision'}\n{lines}"
    return f"{comment}{stand_ins} -->\n{visible(chain, stand_in=True).to_xml()}"


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
        "friction of rails and ground": any(vehicle.rail_friction for vehicle in chain.vehicles),
        "brakes": any(vehicle.brake for vehicle in chain.vehicles),
        "the grade of the track": bool(chain.grade),
    }
    return (said for said, applies in words.items() if applies)


def _add_vehicle(model: mujoco.MjSpec, chain: Chain, i: int, given: Sequence[Body]) -> None:
    """The body of a vehicle, of meshes; equal vehicles share them, but for the ends that give way."""
    vehicle = chain.vehicles[i]
    rear, front = (vehicle.length / 2 - setback(chain, i, direction) for direction in (-1, 1))
    side = range(chain.n_moving) if i < chain.n_moving else range(chain.n_moving, len(chain.vehicles))
    cabs = tuple(direction for direction, end in ((-1, side[0]), (1, side[-1])) if i == end)
    pieces = _pieces(vehicle.drawing, -rear, front, cabs)
    key = f"{vehicle.drawing} {rear:.3f} {front:.3f} {cabs} {[body.name.split()[1] for body in given]}"
    skin = next(iter(pieces))
    for body in given:
        direction = 1 if "front" in body.name.split() else -1
        for material in [m for m in pieces if m != "shade"]:
            whole = pieces.pop(material)
            kept, end = meshes.cut(whole, direction * body.start, direction)
            if kept is not None:
                pieces[material] = kept
            if end is not None:
                name = f"{body.name} {SKIN if material == skin else material}"
                _add_shape(model.body(vehicle.name), model, name, name, end, _paint(material, i < chain.n_moving))
    for material, mesh in pieces.items():
        paint = _paint(material, i < chain.n_moving)
        _add_shape(model.body(vehicle.name), model, f"{vehicle.name} {material}", f"{key} {material}", mesh, paint)


def _pieces(drawing: str, rear: float, front: float, cabs: Sequence[int] = ()) -> dict[str, meshes.Mesh]:
    """The meshes of a drawing by material, that of the outside first."""
    if drawing == "passenger":
        return meshes.car(rear, front, cabs)
    drawings = {
        "wagon": meshes.wagon,
        "locomotive": meshes.locomotive,
        "lorry": meshes.lorry,
        "buffer_stop": meshes.buffer_stop,
    }
    return drawings[drawing](rear, front)


def _paint(material: str, moving: bool) -> str:
    """The material of the base scene."""
    return ("moving" if moving else "partner") if material == "livery" else material


def _add_shape(
    body: mujoco.MjsBody, model: mujoco.MjSpec, name: str, key: str, mesh: meshes.Mesh, material: str, x: float = 0.0
) -> None:
    """A shape made of a mesh, which is added where there is none of its key."""
    if model.mesh(key) is None:
        _add_mesh(model, key, mesh)
    body.add_geom(name=name, type=_MESH, meshname=key, material=material, pos=[x, 0, 0], **_WEIGHTLESS)


def _add_mesh(model: mujoco.MjSpec, name: str, mesh: meshes.Mesh) -> None:
    model.add_mesh(
        name=name,
        uservert=mesh.vertices.ravel().tolist(),
        userface=mesh.faces.ravel().tolist(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )


def _add_part(body: mujoco.MjsBody, part: Part, direction: int, middle: float) -> None:
    half, section = 0.5 * (part.end - part.start), part.shape.section
    is_round = len(section) == 1
    body.add_geom(
        name=part.name,
        type=_CYLINDER if is_round else _BOX,
        size=[*section, half, 0] if is_round else [half, *section],
        pos=[middle + direction * 0.5 * (part.start + part.end), *part.place],
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
        pieces = _pieces(obstacle.drawing, setback(chain, WALL, -1) - half, half)
        for material, mesh in pieces.items():
            name = f"obstacle {material}"
            _add_shape(world, model, name, name, mesh, _paint(material, False), half)
    world.add_geom(name="wall", type=_BOX, size=[1, 3, 2.5], pos=[face + 1, 0, 2.5], material="wall", **_UNTOUCHED)
