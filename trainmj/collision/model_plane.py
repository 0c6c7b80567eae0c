"""What a MuJoCo model has of the vertical plane: a tree of bodies for each vehicle, with its suspensions as springs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.gear import BOGIES, N_DOF, SUSPENDED, Gear
from trainmj.collision.mj import mujoco
from trainmj.units import G

_SLIDE, _HINGE = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
_ALONG, _UP, _ACROSS = [1, 0, 0], [0, 0, 1], [0, -1, 0]  # the last makes pitch positive with the end at +x up
_GAUGE = 0.7525  # of the rails of the base scene, from the middle of the track [m]
SMALLEST = 0.05  # radius of a wheel, where an offset leaves none [m]
_NEVER = 1e3  # travel of a suspension without a stop [m]
_UNSEEN = 3  # group of geoms that viewers do not show at first
_NO_INERTIA = 1e-3
"""Of a wheelset, which does not pitch, about its axis: MuJoCo wants some [kg m2]; it pitches with its frame."""


def enable(option: mujoco.MjOption) -> None:
    """Switch on what the vertical plane needs of the options of the base scene: weight, springs, dampers.

    Dampers stay explicit: implicit ones would cost a second factorisation in every step, a seventh of its time, and
    theirs are not what limits the step.
    """
    off = mujoco.mjtDisableBit
    wanted = off.mjDSBL_GRAVITY | off.mjDSBL_SPRING | off.mjDSBL_DAMPER
    option.disableflags &= ~int(wanted)
    option.gravity[:] = 0.0, 0.0, -G


def names_of_dofs(chain: Chain, vehicle: int) -> list[str]:
    """The joints of a vehicle, in the order of its degrees of freedom: M1, M1 z, M1 pitch, M1 bogie 1 z and so on.

    Bogies and wheelsets are numbered from the end that faces the impact.
    """
    name = chain.vehicles[vehicle].name
    if chain.vehicles[vehicle].gear is None:
        return [name]
    found = [name, f"{name} z", f"{name} pitch"]
    for bogie in range(2):
        of_bogie = chain.name_of_bogie(vehicle, bogie)
        found += [f"{of_bogie} z", f"{of_bogie} pitch"]
        found += [f"{chain.name_of_wheelset(vehicle, 2 * bogie + k)} z" for k in range(2)]
    return found


def add_vehicle(base: mujoco.MjSpec, chain: Chain, i: int, place: float) -> None:
    """Add the tree of a vehicle whose middle stands at a place when its degrees of freedom are 0 [m]."""
    names, numbers = names_of_dofs(chain, i), _numbers(chain.vehicles[i].gear, chain.vehicles[i].mass)
    body = base.worldbody.add_body(name=names[0], **numbers.of_body(0, place))
    for name, kind, axis in zip(names, (_SLIDE, _SLIDE, _HINGE), (_ALONG, _UP, _ACROSS), strict=False):
        body.add_joint(name=name, type=kind, axis=axis)
    for bogie, at in enumerate(BOGIES if len(names) > 1 else ()):
        frame = body.add_body(name=chain.name_of_bogie(i, bogie), **numbers.of_body(1 + 3 * bogie))
        _suspend(frame, names[at], numbers, at)
        frame.add_joint(name=names[at + 1], type=_HINGE, axis=_ACROSS)
        for k in range(2):
            wheelset = chain.name_of_wheelset(i, 2 * bogie + k)
            _suspend(
                frame.add_body(name=wheelset, **numbers.of_body(2 + 3 * bogie + k)),
                names[at + 2 + k],
                numbers,
                at + 2 + k,
            )


def _suspend(body: mujoco.MjsBody, name: str, numbers: _Numbers, dof: int) -> None:
    joint = body.add_joint(name=name, type=_SLIDE, axis=_UP, springref=numbers.spring[dof])
    joint.stiffness[0], joint.damping[0] = numbers.stiffness[dof], numbers.damping[dof]


def add_rails_and_stops(base: mujoco.MjSpec, chain: Chain) -> None:
    """Stand-ins for what the law does below and in the suspensions: contacts of the wheels, and limits of the joints.

    MuJoCo counts how soft these are by the acceleration; here that is of the mass that swings on rail or stop alone.
    """
    base.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT)
    for i, k in chain.wheelsets:
        gear = chain.vehicles[i].gear
        assert gear is not None
        axle = gear.axle_height + gear.offset
        radius, soft = max(SMALLEST, axle), _softness(gear.wheelset_mass, gear.rail_stiffness, chain.step)
        for y, side in ((_GAUGE, "left"), (-_GAUGE, "right")):
            base.body(chain.name_of_wheelset(i, k)).add_geom(
                name=f"{chain.name_of_wheelset(i, k)} contact {side}",
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[radius, 0, 0],
                pos=[0, y, radius - axle],
                mass=0,
                contype=0,
                conaffinity=1,
                condim=1,
                priority=1,
                solref=soft,
                group=_UNSEEN,
            )
    for i, vehicle in enumerate(chain.vehicles):
        if vehicle.gear is not None:
            for dof in SUSPENDED:
                _limit(base.joint(names_of_dofs(chain, i)[dof]), vehicle.gear, dof, chain.step)


def _limit(joint: mujoco.MjsJoint, gear: Gear, dof: int, step: float) -> None:
    """Let the travel of a suspension end at its stops."""
    suspension = gear.suspension(dof)
    below, above = gear.wheelset_mass, gear.frame_mass
    if dof in BOGIES:
        below, above = gear.frame_mass + 2.0 * gear.wheelset_mass, 0.5 * gear.body_mass
    stops = np.array([-suspension.lift_stop, suspension.bump_stop])
    if np.isfinite(stops).any():
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = stops.clip(-_NEVER, _NEVER)
        joint.solref_limit = _softness(1.0 / (1.0 / below + 1.0 / above), suspension.stop, step)


def _softness(mass: float, stiffness: float, step: float) -> list[float]:
    """Time constant and damping ratio of a constraint of MuJoCo's, which wants two steps at least."""
    return [max(2.0 * step, math.sqrt(mass / stiffness)), 1.0]


def numbers_of(chain: Chain, places: Sequence[float]) -> dict[str, Array]:
    """The fields of a model in which chains of one size differ, by name; without those of the world.

    Args:
        chain: what is modelled.
        places: (n_vehicle,) where the middles of the vehicles stand when all degrees of freedom are 0 [m].
    """
    each = [_numbers(v.gear, v.mass) for v in chain.vehicles]
    pos = [n.pos.copy() for n in each]
    for own, place in zip(pos, places, strict=True):
        own[0, 0] += place
    return {
        "body_mass": np.concatenate([n.mass for n in each]),
        "body_inertia": np.concatenate([np.repeat(n.inertia[:, None], 3, axis=1) for n in each]),
        "body_pos": np.concatenate(pos),
        "body_ipos": np.concatenate([n.ipos for n in each]),
        "jnt_stiffness": np.concatenate([n.stiffness for n in each]),
        "dof_damping": np.concatenate([n.damping for n in each]),
        "qpos_spring": np.concatenate([n.spring for n in each]),
    }


class _Numbers(NamedTuple):
    """The numbers of a vehicle in the model, by body and by degree of freedom."""

    mass: Array
    inertia: Array
    pos: Array
    ipos: Array
    stiffness: Array
    damping: Array
    spring: Array

    def of_body(self, n: int, place: float = 0.0) -> dict[str, Any]:
        """What the spec of a body takes."""
        x, y, z = self.pos[n]
        inertia = [self.inertia[n]] * 3
        return {
            "pos": [x + place, y, z],
            "mass": self.mass[n],
            "ipos": self.ipos[n],
            "inertia": inertia,
            "explicitinertial": True,
        }


@lru_cache(maxsize=1024)
def _numbers(gear: Gear | None, mass: float) -> _Numbers:
    """The numbers of a vehicle on its gear, or of one that only slides; not to be changed."""
    if gear is None:
        no = np.zeros(1)
        return _Numbers(np.array([mass]), np.array([mass]), np.zeros((1, 3)), np.zeros((1, 3)), no, no, no)
    p, stands = gear.placed(np.zeros(N_DOF)), gear.standing
    pos, ipos = np.zeros((7, 3)), np.zeros((7, 3))
    pos[0] = gear.cog_x, 0.0, gear.cog_height + gear.offset
    for bogie, arm in enumerate(gear.arms):
        n = 1 + 3 * bogie
        pos[n, [0, 2]] = arm, gear.drop
        ipos[n, 2] = gear.frame_height - gear.link_height
        for k, side in enumerate((-0.5, 0.5)):
            pos[n + 1 + k, [0, 2]] = side * gear.wheelbase, gear.axle_height - gear.link_height
    stiffness, damping, spring = np.zeros(N_DOF), np.zeros(N_DOF), np.zeros(N_DOF)
    for dof, preload in zip(SUSPENDED, stands.preload, strict=True):
        suspension = gear.suspension(dof)
        stiffness[dof], damping[dof] = suspension.stiffness, suspension.damping
        spring[dof] = stands.q[dof] - preload / suspension.stiffness
    inertia = np.where(p.inertia > 0.0, p.inertia, _NO_INERTIA)
    return _Numbers(p.mass, inertia, pos, ipos, stiffness, damping, spring)
