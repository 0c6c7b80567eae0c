"""A collision as a MuJoCo model with shapes: track, car bodies, and the parts of every device at rest."""

from __future__ import annotations

import re

import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.mj import mujoco, undisturbed
from trainmj.collision.model import plateau, spec
from trainmj.units import KN, KN_PER_MM
from trainmj.view import meshes
from trainmj.view.parts import Part, ends, setback

_TRACK = 120.0  # track beyond the ends of the trains [m]
_SLEEPERS = 800  # at most; a longer track has them near the impact only
_BOX, _CYLINDER, _MESH = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_MESH
_UNTOUCHED = {"contype": 0, "conaffinity": 0}
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
    for i in range(len(chain.vehicles)):
        _add_car(model, chain, i)
    for end in ends(chain):
        for part in end.parts:
            _add_part(model.body(chain.vehicles[end.vehicle].name), part, end.direction)
    return model


@undisturbed()
def export(chain: Chain, title: str = "") -> str:
    """The model as MJCF text that MuJoCo's own programs can run.

    MJCF cannot hold the device law. MuJoCo's elasto-plastic tendons take its place, with one plateau for each
    interface (:func:`~trainmj.collision.model.plateau`). The file has no room for the law's block, so the two never
    act together.

    Args:
        chain: what to model.
        title: for the comment at the top.
    """
    words = " ".join(re.sub("-{2,}", "-", title).split())  # XML forbids two dashes in a comment
    stand_ins = "".join(
        f"\n       {i.name}: {plateau(i) / KN:.0f} kN, {i.envelope.stiffness / KN_PER_MM:.6g} kN/mm"
        for i in chain.interfaces
    )
    comment = (
        f"<!-- {words or 'Train collision'}\n"
        "     Written by trainmj. Start from the keyframe 'start', which has both trains at speed: in MuJoCo's\n"
        "     viewer, section Simulation, Load key. The couplers, crush tubes and anti-climbers of the scenario are\n"
        "     NOT in this file: MJCF cannot express their curves, shear-off, empty strokes and dashpots. Stand-ins\n"
        "     take their place, one plateau each: ideal elasto-plastic tendons (springyield, of MuJoCo 4.0) that\n"
        "     push and never pull, with the unloading stiffness of the device and its mean force up to its stroke\n"
        "     limit. Rail friction is left out. Strokes and accelerations differ from those of trainmj."
    )
    return f"{comment}{stand_ins} -->\n{visible(chain, stand_in=True).to_xml()}"


def _add_car(model: mujoco.MjSpec, chain: Chain, i: int) -> None:
    """A car body of meshes; equal cars share them."""
    vehicle = chain.vehicles[i]
    moving = i < chain.n_moving
    side = range(chain.n_moving) if moving else range(chain.n_moving, len(chain.vehicles))
    rear, front = (vehicle.length / 2 - setback(chain, i, direction) for direction in (-1, 1))
    if not moving and len(side) == 1:
        key, pieces = f"wagon {rear:.3f} {front:.3f}", meshes.wagon(-rear, front)
    else:
        cabs = tuple(direction for direction, end in ((-1, side[0]), (1, side[-1])) if i == end)
        key, pieces = f"car {rear:.3f} {front:.3f} {cabs}", meshes.car(-rear, front, cabs)
    body = model.body(vehicle.name)
    livery = "moving" if moving else "partner"
    for material, mesh in pieces.items():
        name = f"{key} {material}"
        if model.mesh(name) is None:
            _add_mesh(model, name, mesh)
        body.add_geom(
            name=f"{vehicle.name} {material}",
            type=_MESH,
            meshname=name,
            material=livery if material == "livery" else material,
            **_WEIGHTLESS,
        )


def _add_mesh(model: mujoco.MjSpec, name: str, mesh: meshes.Mesh) -> None:
    model.add_mesh(
        name=name,
        uservert=mesh.vertices.ravel().tolist(),
        userface=mesh.faces.ravel().tolist(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )


def _add_part(body: mujoco.MjsBody, part: Part, direction: int) -> None:
    half, section = 0.5 * (part.end - part.start), part.shape.section
    is_round = len(section) == 1
    body.add_geom(
        name=part.name,
        type=_CYLINDER if is_round else _BOX,
        size=[*section, half, 0] if is_round else [half, *section],
        pos=[direction * 0.5 * (part.start + part.end), *part.place],
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
        world.add_geom(name="wall", type=_BOX, size=[1, 3, 2.5], pos=[1, 0, 2.5], material="wall", **_UNTOUCHED)
