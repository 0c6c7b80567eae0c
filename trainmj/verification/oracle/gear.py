"""Vehicles in the vertical plane, by absolute heights and pitches: a body on two bogies, each on two wheelsets.

The coordinates of a vehicle are, in this order: x, height and pitch of its body; heights of the links of both bogies;
pitches of both frames; heights of the four wheelsets. Heights are counted from where it stands as designed, pitch is
positive with the end at +x up, and left is before right. A link lies on the body's own vertical through the bogie's
centre, so that its place along the track follows from its height; that of a wheelset likewise from its frame:

    x_link = x + a / cos(theta) - (h + z_link - z) tan(theta)
    x_axle = x_link + e / cos(phi) - (d + z_axle - z_link) tan(phi)

Horizontally a mass moves with all of these, vertically with its own height: M q'' = Q - (what turning makes of q').
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from trainmj.verification.oracle.motion import G

Array = np.ndarray
N = 11
X, Z, PITCH = 0, 1, 2
LINK, FRAME, AXLE = slice(3, 5), slice(5, 7), slice(7, 11)
_LINKS, _FRAMES = [3, 3, 4, 4], [5, 5, 6, 6]  # over each wheelset
_WHEELS = [2, 3, 5, 6]
"""Rows of the wheelsets among the masses: body; left frame, its left and right wheelset; the right ones."""


class Spring:
    """Suspensions of all vehicles: stiffness, damper, stops; arrays of shape (n, 1)."""

    def __init__(self, stated: Sequence[Mapping[str, Any]]) -> None:
        """Take the values of the scenario."""

        def column(key: str, unit: float, none: float = math.inf) -> Array:
            found = [one.get(key, none) for one in stated]
            return np.array([[none if value in ("none", None) else value * unit] for value in found])

        self.k, self.c = column("kN_per_mm", 1e6, 0.0), column("kN_s_per_m", 1e3, 0.0)
        self.lift, self.bump = column("lift_stop_mm", 1e-3), column("bump_stop_mm", 1e-3)
        self.stop = column("stop_kN_per_mm", 1e6, 0.0)

    def _beyond(self, s: Array) -> Array:
        """How far the stops are pressed, those against extension as negative numbers."""
        return np.asarray(np.maximum(s - self.bump, 0.0) + np.minimum(s + self.lift, 0.0))

    def push(self, s: Array) -> Array:
        """Force against compression s, from the design position, of spring and stops [N]."""
        return np.asarray(self.k * s + self.stop * self._beyond(s))

    def energy(self, s: Array) -> Array:
        """[J]."""
        return np.asarray(0.5 * self.k * s**2 + 0.5 * self.stop * self._beyond(s) ** 2)


class Pose(NamedTuple):
    """What follows from the coordinates of all vehicles: of both bogies (n, 2), of the wheelsets (n, 4), or (n, 1)."""

    s: Array  # compression of the secondary suspensions
    w: Array  # of the primary ones
    st: Array  # sine and cosine of the pitch of the body
    ct: Array
    sp: Array  # likewise of the frame over each wheelset
    cp: Array
    high: Array  # links over the centre of gravity
    low: Array  # axles over links


class Gears:
    """The vehicles of a collision, left to right; q and rates are arrays (n, 11)."""

    def __init__(
        self, stated: Sequence[Mapping[str, Any]], mass: Sequence[float], ahead: Sequence[float], gravity: float = G
    ) -> None:
        """Take types of vehicles as a scenario states them, with what collisions state of each: offset_m, pitch_rad.

        Args:
            stated: of each vehicle.
            mass: of the whole vehicles [kg].
            ahead: 1 for those whose front end points along +x, -1 for others.
            gravity: [m/s2].
        """
        n = len(stated)
        self.n, self.g = n, gravity

        def column(group: str, key: str, unit: float, default: float = math.nan) -> Array:
            return np.array([(one.get(group) or {}).get(key, default) * unit for one in stated])

        self.offset = np.array([one["offset_m"] for one in stated])
        self.start_pitch = np.array([one["pitch_rad"] for one in stated])
        self.frame, self.wheelset = column("bogies", "frame_t", 1e3), column("bogies", "wheelset_t", 1e3)
        self.frame_inertia = column("bogies", "frame_pitch_t_m2", 1e3)
        self.body = np.array(mass) - 2 * self.frame - 4 * self.wheelset
        radius = column("body", "radius_of_gyration_m", 1.0)
        own = column("body", "pitch_inertia_t_m2", 1e3)
        self.inertia = np.where(np.isnan(radius), own, self.body * radius**2)
        self.cog = column("body", "cog_height_m", 1.0)
        self.cog_x = column("body", "cog_x_m", 1.0, 0.0) * np.array(ahead)
        link, axle = column("bogies", "link_height_m", 1.0), column("bogies", "axle_height_m", 1.0)
        self.a = np.multiply.outer(column("bogies", "centres_m", 0.5), [-1.0, 1.0]) - self.cog_x[:, None]  # (n, 2)
        self.e = np.multiply.outer(column("bogies", "wheelbase_m", 0.5), [-1.0, 1.0, -1.0, 1.0])  # (n, 4)
        self.h = (link - self.cog)[:, None]
        self.d = (axle - link)[:, None]
        self.f = (column("bogies", "cog_height_m", 1.0) - link)[:, None]
        self.radius = (axle + self.offset)[:, None]  # of the wheels
        self.height = self.cog + self.offset  # of the centre of gravity, as designed
        self.link, self.axle = link + self.offset, axle + self.offset
        self.secondary = Spring([one["secondary"] for one in stated])
        self.primary = Spring([one["primary"] for one in stated])
        self.rail = column("rail", "kN_per_mm", 1e6, 1200.0)[:, None]
        self.rail_damping = column("rail", "kN_s_per_m", 1e3, 100.0)[:, None]
        self.masses = np.stack([self.body, *2 * [self.frame, self.wheelset, self.wheelset]], axis=1)
        self.weight = np.zeros((n, N))
        self.weight[:, Z], self.weight[:, LINK] = -self.body * gravity, -self.frame[:, None] * gravity
        self.weight[:, AXLE] = -self.wheelset[:, None] * gravity
        self._stand()

    def _stand(self) -> None:
        """Preloads with which it stands still at its pitch, with frames level and wheelsets where they are designed.

        Each link carries a part of the body that keeps its pitch; each wheelset half of that and of its frame.
        """
        self.start = np.zeros((self.n, N))
        self.start[:, PITCH] = self.start_pitch
        sine, cosine = np.sin(self.start_pitch), np.cos(self.start_pitch)
        arm = self.a - self.h * sine[:, None]  # times cos: from the centre of gravity to the links
        share = np.stack([arm[:, 1], -arm[:, 0]], axis=1) / (arm[:, 1] - arm[:, 0])[:, None]
        carried = share * (self.body * self.g)[:, None]
        self.preload = carried * cosine[:, None]
        self.primary_preload = np.repeat(0.5 * (carried + (self.frame * self.g)[:, None]), 2, axis=1)
        self.load = self.primary_preload + (self.wheelset * self.g)[:, None]
        self.sunk = self.load / self.rail
        s, w, *_ = self.pose(self.start)
        # the preload holds what the springs hold there
        self.preload = self.preload - self.secondary.push(s)
        self.primary_preload = self.primary_preload - self.primary.push(w)

    def pose(self, q: Array) -> Pose:
        """Where they stand."""
        theta, phi = q[:, PITCH : PITCH + 1], q[:, _FRAMES]
        st, ct, sp, cp = np.sin(theta), np.cos(theta), np.sin(phi), np.cos(phi)
        high, low = self.h + q[:, LINK] - q[:, Z : Z + 1], self.d + q[:, AXLE] - q[:, _LINKS]
        return Pose((high - self.a * st) / ct - self.h, (low - self.e * sp) / cp - self.d, st, ct, sp, cp, high, low)

    def along(self, pose: Pose, v: Array) -> tuple[Array, Array]:
        """Derivatives of the places of the masses along the track (n, 7, 11), and what rates accelerate (n, 7)."""
        _, _, st, ct, sp, cp, high, low = pose
        tt, tp, rate = st / ct, sp / cp, v[:, PITCH : PITCH + 1]
        J, c = np.zeros((self.n, 7, N)), np.zeros((self.n, 7))
        J[:, :, X] = 1.0
        turn = (self.a * st - high) / ct**2
        climb = v[:, LINK] - v[:, Z : Z + 1]
        bent = (self.a * (1.0 + st**2) / ct**3 - 2.0 * high * st / ct**3) * rate**2 - 2.0 / ct**2 * rate * climb
        own = (self.e * sp - low) / cp**2
        frame_rate, climb = v[:, _FRAMES], v[:, AXLE] - v[:, _LINKS]
        bent_own = (self.e * (1.0 + sp**2) / cp**3 - 2.0 * low * sp / cp**3) * frame_rate**2
        bent_own -= 2.0 / cp**2 * frame_rate * climb
        for b in (0, 1):
            rows = slice(1 + 3 * b, 4 + 3 * b)
            J[:, rows, Z] = tt
            J[:, rows, PITCH] = turn[:, b : b + 1]
            J[:, rows, 3 + b] = -tt
            c[:, rows] = bent[:, b : b + 1]
            J[:, 1 + 3 * b, 5 + b] = -self.f[:, 0] * cp[:, 2 * b]
            c[:, 1 + 3 * b] += self.f[:, 0] * sp[:, 2 * b] * v[:, 5 + b] ** 2
            for k in (2 * b, 2 * b + 1):
                row = _WHEELS[k]
                J[:, row, 3 + b] += tp[:, k]
                J[:, row, 5 + b] = own[:, k]
                J[:, row, 7 + k] = -tp[:, k]
                c[:, row] += bent_own[:, k]
        return J, c

    def mass_matrix(self, q: Array, J: Array) -> Array:
        """(n, 11, 11)."""
        M = np.matmul(J.transpose(0, 2, 1), self.masses[:, :, None] * J)
        fall = self.f * np.sin(q[:, FRAME])  # how much a frame's centre of gravity sinks as it turns
        M[:, Z, Z] += self.body
        M[:, PITCH, PITCH] += self.inertia
        for b in (0, 1):
            M[:, 3 + b, 3 + b] += self.frame
            M[:, 5 + b, 5 + b] += self.frame_inertia + self.frame * fall[:, b] ** 2
            M[:, 3 + b, 5 + b] -= self.frame * fall[:, b]
            M[:, 5 + b, 3 + b] -= self.frame * fall[:, b]
        for k in range(7, 11):
            M[:, k, k] += self.wheelset
        return np.asarray(M)

    def turning(self, q: Array, v: Array, J: Array, c: Array) -> Array:
        """Forces that rates make [N, N m] (n, 11)."""
        Q = -np.matmul(J.transpose(0, 2, 1), (self.masses * c)[:, :, None])[:, :, 0]
        fall = -self.f * np.cos(q[:, FRAME]) * v[:, FRAME] ** 2 * self.frame[:, None]
        Q[:, LINK] -= fall
        Q[:, FRAME] += self.f * np.sin(q[:, FRAME]) * fall
        return np.asarray(Q)

    def suspended(self, pose: Pose, q: Array, v: Array) -> tuple[Array, Array]:
        """Forces of weights, springs, dampers and stops (n, 11), and what dampers take of each vehicle [W]."""
        s, w, st, ct, sp, cp, *_ = pose
        tt, tp = st / ct, sp / cp
        turn, own = -self.a + (s + self.h) * tt, -self.e + (w + self.d) * tp  # ds/dtheta, dw/dphi
        s_rate = (v[:, LINK] - v[:, Z : Z + 1]) / ct + turn * v[:, PITCH : PITCH + 1]
        w_rate = (v[:, AXLE] - v[:, _LINKS]) / cp + own * v[:, _FRAMES]
        damped, damped_own = self.secondary.c * s_rate, self.primary.c * w_rate
        F = self.preload + self.secondary.push(s) + damped
        P = self.primary_preload + self.primary.push(w) + damped_own
        Q = self.weight.copy()
        Q[:, Z] += (F / ct).sum(axis=1)
        Q[:, PITCH] -= (F * turn).sum(axis=1)
        Q[:, LINK] += (P / cp).reshape(-1, 2, 2).sum(axis=2) - F / ct
        Q[:, FRAME] -= (P * own).reshape(-1, 2, 2).sum(axis=2)
        Q[:, FRAME] += self.frame[:, None] * self.g * self.f * np.sin(q[:, FRAME])
        Q[:, AXLE] -= P / cp
        return Q, (damped * s_rate).sum(axis=1) + (damped_own * w_rate).sum(axis=1)

    def on_rail(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Loads of the wheelsets [N] (n, 4), and what the contact takes of each vehicle [W]."""
        gap = self.gaps(q)
        spring = np.where(gap < 0.0, -self.rail * gap, 0.0)
        load = np.where(gap < 0.0, np.maximum(0.0, spring - self.rail_damping * v[:, AXLE]), 0.0)
        return load, ((spring - load) * v[:, AXLE]).sum(axis=1)

    def gaps(self, q: Array) -> Array:
        """Of the wheelsets over the rail, negative where they are pressed into it [m] (n, 4)."""
        return np.asarray(q[:, AXLE] - self.sunk)

    def held(self, J: Array) -> Array:
        """What a force of 1 at rail level, a quarter at each wheelset, does to each coordinate (n, 11).

        The frame holds the moment that turns the wheels.
        """
        pulled = J[:, _WHEELS, :].mean(axis=1)
        pulled[:, FRAME] += 0.5 * self.radius
        return np.asarray(pulled)

    def places(self, q: Array, x0: Array) -> tuple[Array, Array]:
        """Along the track and over the rail, of the masses (n, 7) [m]; x0 is where bodies are at q = 0."""
        _, _, st, ct, sp, cp, high, low = self.pose(q)
        x, z = np.zeros((self.n, 7)), np.zeros((self.n, 7))
        x[:, 0], z[:, 0] = x0 + q[:, X], self.height + q[:, Z]
        link = x[:, :1] + (self.a - high * st) / ct
        x[:, [1, 4]] = link - self.f * sp[:, ::2]
        z[:, [1, 4]] = self.link[:, None] + q[:, LINK] + self.f * cp[:, ::2]
        x[:, _WHEELS] = np.repeat(link, 2, axis=1) + (self.e - low * sp) / cp
        z[:, _WHEELS] = self.axle[:, None] + q[:, AXLE]
        return x, z

    def speeds(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Of the masses along the track and upwards (n, 7) [m/s]."""
        J, _ = self.along(self.pose(q), v)
        up = np.zeros((self.n, 7))
        up[:, 0] = v[:, Z]
        up[:, [1, 4]] = v[:, LINK] - self.f * np.sin(q[:, FRAME]) * v[:, FRAME]
        up[:, _WHEELS] = v[:, AXLE]
        return np.asarray((J @ v[:, :, None])[:, :, 0]), up

    def kinetic(self, q: Array, v: Array) -> float:
        """[J]."""
        along, up = self.speeds(q, v)
        turning = (self.inertia * v[:, PITCH] ** 2).sum() + (self.frame_inertia[:, None] * v[:, FRAME] ** 2).sum()
        return float(0.5 * (self.masses * (along**2 + up**2)).sum() + 0.5 * turning)

    def potential(self, q: Array, rails: bool = True) -> float:
        """Of weights, springs, stops and rails [J]."""
        s, w, *_ = self.pose(q)
        _, z = self.places(q, np.zeros(self.n))
        found = self.g * (self.masses * z).sum()
        found += (self.preload * s + self.secondary.energy(s)).sum()
        found += (self.primary_preload * w + self.primary.energy(w)).sum()
        return float(found + (0.5 * self.rail * np.minimum(self.gaps(q), 0.0) ** 2).sum() * rails)

    def momenta(self, q: Array, v: Array, x0: Array) -> tuple[float, float, float]:
        """Along the track, upwards [N s], and about the rail at x = 0, positive with +x up [N m s]."""
        (x, z), (along, up) = self.places(q, x0), self.speeds(q, v)
        spin = (self.inertia * v[:, PITCH]).sum() + (self.frame_inertia[:, None] * v[:, FRAME]).sum()
        m = self.masses
        return float((m * along).sum()), float((m * up).sum()), float((m * (x * up - z * along)).sum() + spin)
