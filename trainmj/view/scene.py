"""The shapes of a collision in a MuJoCo model: track, car bodies, and the parts of every device at rest."""

from __future__ import annotations

import mujoco
import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.model import spec
from trainmj.view import meshes
from trainmj.view.parts import Part, ends, setback

_COUPLER_Z, _ANTI_CLIMBER_Z = 0.78, 1.22  # heights above the rail [m]
_TRACK = 120.0  # track beyond the ends of the trains [m]
_SLEEPERS = 800  # at most; a longer track has them about the place of the impact


def visible(chain: Chain, layout: Layout | None = None, stand_in: bool = False) -> mujoco.MjSpec:
    """The editable model of a chain with all its shapes, which cost time at every step and change no number.

    Args:
        chain: what to model.
        layout: room for the device law's block; by default what this chain needs.
        stand_in: with elasto-plastic tendons in place of the device law.
    """
    model = spec(chain, layout, scene=True, stand_in=stand_in)
    add(model, chain)
    return model


def add(spec: mujoco.MjSpec, chain: Chain) -> None:
    """Add all shapes of a chain to its model.

    Args:
        spec: with a body for every vehicle, built on the base scene.
        chain: whose model it is.
    """
    _add_track(spec, chain)
    made: set[str] = set()
    for i in range(len(chain.vehicles)):
        _add_car(spec, chain, i, made)
    for end in ends(chain):
        for part in end.parts:
            _add_part(spec.body(chain.vehicles[end.vehicle].name), part, end.direction)


def _add_car(spec: mujoco.MjSpec, chain: Chain, i: int, made: set[str]) -> None:
    """A car body of meshes; equal cars share them."""
    vehicle = chain.vehicles[i]
    moving = i < chain.n_moving
    side = range(chain.n_moving) if moving else range(chain.n_moving, len(chain.vehicles))
    rear, front = (vehicle.length / 2 - setback(chain, i, direction) for direction in (-1, 1))
    wagon = not moving and len(side) == 1
    cabs = () if wagon else tuple(d for d in (-1, 1) if i == (side[0] if d < 0 else side[-1]))
    key = f"car {rear:.3f} {front:.3f} {cabs}" if not wagon else f"wagon {rear:.3f} {front:.3f}"
    pieces = meshes.wagon(-rear, front) if wagon else meshes.car(-rear, front, cabs)
    body = spec.body(vehicle.name)
    livery = "moving" if moving else "partner"
    for material, mesh in pieces.items():
        name = f"{key} {material}"
        if name not in made:
            made.add(name)
            spec.add_mesh(
                name=name,
                uservert=mesh.vertices.ravel().tolist(),
                userface=mesh.faces.ravel().tolist(),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
        body.add_geom(
            name=f"{vehicle.name} {material}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            material=livery if material == "livery" else material,
            contype=0,
            conaffinity=0,
            mass=0,
        )


_BOX, _CYLINDER = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
_LOOKS = {  # last words of a part's name: shape, half width and height or radius, offset in y and z, material
    "coupler tube": (_CYLINDER, (0.13,), (0.0, _COUPLER_Z), "device"),
    "coupler rod": (_CYLINDER, (0.07,), (0.0, _COUPLER_Z), "steel"),
    "coupler head": (_BOX, (0.21, 0.19), (0.0, _COUPLER_Z), "steel"),
    "coupler ring": (_CYLINDER, (0.155,), (0.0, _COUPLER_Z), "device"),
    "gangway": (_BOX, (0.62, 1.02), (0.0, 2.12), "gangway"),
    "tube": (_BOX, (0.13, 0.11), (0.85, _ANTI_CLIMBER_Z), "device"),
    "ring": (_BOX, (0.155, 0.135), (0.85, _ANTI_CLIMBER_Z), "device"),
    "plate": (_BOX, (0.30, 0.20), (0.85, _ANTI_CLIMBER_Z), "steel"),
    "tooth": (_BOX, (0.30, 0.025), (0.85, _ANTI_CLIMBER_Z), "steel"),
}


def _add_part(body: mujoco.MjsBody, part: Part, direction: int) -> None:
    look = next(look for words, look in _LOOKS.items() if f" {words}" in part.name)
    kind, section, (y, z), material = look
    if " left " in part.name:
        y = -y
    if "tooth" in part.name:
        z += 0.14 * (int(part.name[-1]) - 1)
    half = 0.5 * (part.end - part.start)
    round_part = kind == _CYLINDER
    body.add_geom(
        name=part.name,
        type=kind,
        size=[section[0], half, 0] if round_part else [half, *section],
        pos=[direction * 0.5 * (part.start + part.end), y, z],
        quat=[np.sqrt(0.5), 0, np.sqrt(0.5), 0] if round_part else [1, 0, 0, 0],  # a cylinder's axis is its z
        material=material,
        contype=0,
        conaffinity=0,
        mass=0,
    )


def _add_track(spec: mujoco.MjSpec, chain: Chain) -> None:
    """Sleepers below the trains, rails to beyond their ends, and the wall if there is one."""
    lengths = np.array([v.length for v in chain.vehicles])
    left, right = lengths[: chain.n_moving].sum() + chain.gap + _TRACK, lengths[chain.n_moving :].sum() + _TRACK
    for name in ("ballast", "rail left", "rail right"):
        geom = spec.geom(name)
        geom.size[0], geom.pos[0] = (left + right) / 2, (right - left) / 2
    reach = 0.3 * _SLEEPERS
    mesh = meshes.sleepers(max(-left, -reach), min(right, reach))
    spec.add_mesh(
        name="sleepers",
        uservert=mesh.vertices.ravel().tolist(),
        userface=mesh.faces.ravel().tolist(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    spec.worldbody.add_geom(
        name="sleepers", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="sleepers", material="sleeper", contype=0,
        conaffinity=0,
    )  # fmt: skip
    if chain.interfaces[-1].right == WALL:
        spec.worldbody.add_geom(
            name="wall", type=_BOX, size=[1, 3, 2.5], pos=[1, 0, 2.5], material="wall", contype=0, conaffinity=0
        )
