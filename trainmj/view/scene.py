"""The shapes of a collision in a MuJoCo model: track, car bodies, and the parts of every device at rest."""

from __future__ import annotations

import mujoco
import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.model import spec
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
    made: set[str] = set()
    for i in range(len(chain.vehicles)):
        _add_car(model, chain, i, made)
    for end in ends(chain):
        for part in end.parts:
            _add_part(model.body(chain.vehicles[end.vehicle].name), part, end.direction)
    return model


def _add_car(model: mujoco.MjSpec, chain: Chain, i: int, made: set[str]) -> None:
    """A car body of meshes; equal cars share them."""
    vehicle = chain.vehicles[i]
    moving = i < chain.n_moving
    side = range(chain.n_moving) if moving else range(chain.n_moving, len(chain.vehicles))
    rear, front = (vehicle.length / 2 - setback(chain, i, direction) for direction in (-1, 1))
    wagon = not moving and len(side) == 1
    cabs = () if wagon else tuple(d for d in (-1, 1) if i == (side[0] if d < 0 else side[-1]))
    key = f"car {rear:.3f} {front:.3f} {cabs}" if not wagon else f"wagon {rear:.3f} {front:.3f}"
    pieces = meshes.wagon(-rear, front) if wagon else meshes.car(-rear, front, cabs)
    body = model.body(vehicle.name)
    livery = "moving" if moving else "partner"
    for material, mesh in pieces.items():
        name = f"{key} {material}"
        if name not in made:
            made.add(name)
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
