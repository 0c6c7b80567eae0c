"""The running gear of a vehicle in the vertical plane: a body on two bogies, each on two wheelsets.

A vehicle has eleven degrees of freedom, in this order: x and z of the centre of gravity of its body and its pitch;
then, of the left bogie and of the right one, how far it has come towards the body along the body's own vertical, its
pitch against the body about the link, and how far its left and its right wheelset have come towards the frame. Pitch is
positive with the end at +x up. All are 0 where everything stands as designed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.units import G

N_DOF = 11
X, Z, PITCH = 0, 1, 2
BOGIES = (3, 7)
"""First degree of freedom of each bogie; its pitch, left and right wheelset follow."""

SUSPENDED = (3, 5, 6, 7, 9, 10)
"""Degrees of freedom with a suspension."""

WHEELS = [2, 3, 5, 6]
"""Places of the wheelsets, left to right, among the masses of :class:`Placed`."""

N_WHEELSET = len(WHEELS)


@dataclass(frozen=True)
class Suspension:
    """A spring with a damper, and stops at both ends of its travel.

    Attributes:
        stiffness: [N/m].
        damping: [N s/m].
        lift_stop: extension from the design position at which the lift stop acts [m]; infinite without one.
        bump_stop: likewise the compression at which the bump stop acts [m].
        stop: stiffness of the stops [N/m].
    """

    stiffness: float
    damping: float
    lift_stop: float = math.inf
    bump_stop: float = math.inf
    stop: float = 0.0


class Placed(NamedTuple):
    """Masses of a vehicle in some position, body first, then of each bogie its frame and both wheelsets.

    Attributes:
        mass: (7,) [kg].
        inertia: (7,) pitch inertia about its own centre of gravity [kg m2].
        x: (7,) place along the track [m].
        z: (7,) height above the rail [m].
        along: (7, 11) derivatives of x.
        up: (7, 11) derivatives of z.
        turn: (7, 11) derivatives of the pitch.
    """

    mass: Array
    inertia: Array
    x: Array
    z: Array
    along: Array
    up: Array
    turn: Array


@dataclass(frozen=True)
class Gear:
    """What carries a vehicle, and the body that it carries.

    Attributes:
        body_mass: [kg].
        body_inertia: pitch inertia of the body about its centre of gravity [kg m2].
        cog_height: design height of that above the rail [m].
        cog_x: its place from the middle of the vehicle along +x [m].
        centres: distance between the bogies, which stand evenly about the middle of the vehicle [m].
        wheelbase: of a bogie [m].
        frame_mass: of each bogie frame [kg].
        frame_inertia: pitch inertia of that about its centre of gravity [kg m2].
        frame_height: height of that centre [m].
        wheelset_mass: [kg].
        axle_height: [m].
        link_height: of the links by which the bogies are drawn along [m].
        secondary: between body and frame, of each bogie.
        primary: between frame and wheelset, of each wheelset.
        rail_stiffness: of the contact of a wheelset with the rail [N/m].
        rail_damping: of the same [N s/m].
        offset: by which the whole vehicle stands higher than designed, wheels included [m].
        pitch: with which it stands at the start [rad].
        gravity: [m/s2]; none of what floats.
    """

    body_mass: float
    body_inertia: float
    cog_height: float
    cog_x: float
    centres: float
    wheelbase: float
    frame_mass: float
    frame_inertia: float
    frame_height: float
    wheelset_mass: float
    axle_height: float
    link_height: float
    secondary: Suspension
    primary: Suspension
    rail_stiffness: float = 1.2e9
    rail_damping: float = 1e5
    offset: float = 0.0
    pitch: float = 0.0
    gravity: float = G

    @property
    def mass(self) -> float:
        """Of the whole vehicle [kg]."""
        return self.body_mass + 2.0 * self.frame_mass + 4.0 * self.wheelset_mass

    @property
    def arms(self) -> tuple[float, float]:
        """From the centre of gravity of the body to the left and right bogie along +x [m]."""
        return -0.5 * self.centres - self.cog_x, 0.5 * self.centres - self.cog_x

    @property
    def drop(self) -> float:
        """How far the links are above the centre of gravity of the body [m]; mostly negative."""
        return self.link_height - self.cog_height

    def suspension(self, dof: int) -> Suspension:
        """That of one of the degrees of freedom SUSPENDED."""
        return self.secondary if dof in BOGIES else self.primary

    def placed(self, q: Array) -> Placed:
        """The masses where the degrees of freedom are q, (11,); x is 0 at the design place of the first."""
        mass = [self.body_mass, *2 * [self.frame_mass, self.wheelset_mass, self.wheelset_mass]]
        inertia = [self.body_inertia, *2 * [self.frame_inertia, 0.0, 0.0]]
        x, z = [float(q[X])], [self.cog_height + self.offset + float(q[Z])]
        along, up, turn = np.zeros((7, N_DOF)), np.zeros((7, N_DOF)), np.zeros((7, N_DOF))
        along[:, X] = up[:, Z] = turn[:, PITCH] = 1.0
        sine, cosine = math.sin(q[PITCH]), math.cos(q[PITCH])
        for n, (arm, at) in enumerate(zip(self.arms, BOGIES, strict=True)):
            high = self.drop + q[at]
            link_x, link_z = arm * cosine - high * sine, arm * sine + high * cosine
            s, c = math.sin(q[PITCH] + q[at + 1]), math.cos(q[PITCH] + q[at + 1])
            parts = (
                (0.0, self.frame_height - self.link_height, None),
                (-0.5 * self.wheelbase, self.axle_height - self.link_height + q[at + 2], at + 2),
                (0.5 * self.wheelbase, self.axle_height - self.link_height + q[at + 3], at + 3),
            )
            for k, (a, b, own) in enumerate(parts, start=1 + 3 * n):
                rx, rz = a * c - b * s, a * s + b * c
                x.append(x[0] + link_x + rx)
                z.append(z[0] + link_z + rz)
                along[k, PITCH], up[k, PITCH] = -link_z - rz, link_x + rx
                along[k, at], up[k, at] = -sine, cosine
                along[k, at + 1], up[k, at + 1] = -rz, rx
                turn[k, at + 1] = 1.0
                if own is not None:
                    along[k, own], up[k, own] = -s, c
        return Placed(np.array(mass), np.array(inertia), np.array(x), np.array(z), along, up, turn)

    def mass_matrix(self, q: Array) -> Array:
        """(11, 11) where the degrees of freedom are q, (11,)."""
        p = self.placed(q)
        weighed = p.mass[:, None]
        found = p.along.T @ (weighed * p.along) + p.up.T @ (weighed * p.up) + p.turn.T @ (p.inertia[:, None] * p.turn)
        return np.asarray(found)

    @cached_property
    def standing(self) -> Standing:
        """How it stands at the start.

        The body has the stated pitch about its centre of gravity; frames are level and wheelsets on the rail. Loads and
        preloads follow from the balance of each degree of freedom.
        """
        q = np.zeros(N_DOF)
        q[PITCH] = self.pitch
        for arm, at in zip(self.arms, BOGIES, strict=True):
            q[at] = (self.drop - arm * math.sin(self.pitch)) / math.cos(self.pitch) - self.drop
            q[at + 1] = -self.pitch
        p = self.placed(q)
        weight = self.gravity * p.mass @ p.up  # (11,) what the supports must give
        wheels = p.up[WHEELS]  # (4, 11)
        left, right = wheels[:2].sum(axis=0), wheels[2:].sum(axis=0)
        loads = np.linalg.solve(
            [[left[Z], right[Z]], [left[PITCH], right[PITCH]]], [weight[Z], weight[PITCH]]
        )  # of each wheelset of a bogie
        load = np.repeat(loads, 2)
        preload = (load @ wheels - weight)[list(SUSPENDED)]
        return Standing(q, load, preload)

    @property
    def frequencies(self) -> dict[str, float]:
        """Closed forms for a vehicle whose heights coincide and whose centre of gravity is in the middle [Hz].

        Heave and pitch of the body on both suspensions in series, bounce and pitch of a bogie below a body at rest.
        """
        k, kp = self.secondary.stiffness, self.primary.stiffness
        both = 2.0 / (1.0 / k + 0.5 / kp)
        squares = {
            "heave": both / self.body_mass,
            "pitch": both * (0.5 * self.centres) ** 2 / self.body_inertia,
            "bogie bounce": (k + 2.0 * kp) / self.frame_mass,
            "bogie pitch": 2.0 * kp * (0.5 * self.wheelbase) ** 2 / self.frame_inertia,
        }
        return {name: math.sqrt(square) / (2.0 * math.pi) for name, square in squares.items()}


class Standing(NamedTuple):
    """How a vehicle stands at the start.

    Attributes:
        q: (11,) degrees of freedom [m, rad].
        load: (4,) of the wheelsets on the rail, left to right [N].
        preload: (6,) what each suspension must give there, positive where it is pressed [N].
    """

    q: Array
    load: Array
    preload: Array
