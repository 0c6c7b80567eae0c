"""Trains in the vertical plane: vehicles on their gear, devices along struts and between faces, ties, stops and rails.

Devices, and when they switch, are those of one dimension; what they shorten is the distance along their line. Rails,
stops of suspensions and swing stops are one-sided springs without memory. A tie sticks or slips from one look to the
next, several in each step. Friction of the rails and brakes grow to their limits within a creep.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from trainmj.verification.oracle.devices import Crush
from trainmj.verification.oracle.elements import Element
from trainmj.verification.oracle.gear import AXLE, PITCH, Gears, N, X, Z
from trainmj.verification.oracle.motion import WALL, G, Interface, Motion, Point
from trainmj.verification.oracle.reading import (
    LineUp,
    Meeting,
    Values,
    curve_points,
    draw_gear,
    lined_up,
    series,
    system_of,
)

Array = np.ndarray

CREEP = 5e-5
"""Below this speed along the track [m/s] friction of the rails and brakes grows with it."""

_LEVEL = {"body": {"pitch_inertia_t_m2": 1.0, "cog_height_m": 0.0}, "secondary": {}, "primary": {}}
_BOGIES = ("centres_m", "wheelbase_m", "frame_t", "frame_pitch_t_m2", "wheelset_t", "axle_height_m", "link_height_m")
OBSTACLE = {**_LEVEL, "bogies": {**dict.fromkeys(_BOGIES, 0.0), "centres_m": 1.0, "cog_height_m": 0.0}}
"""Type of an obstacle, which only slides along."""


@dataclass
class Stop:
    """At a pin of a strut."""

    free: float  # [rad]
    k: float  # [N m/rad]
    set: float = 0.0  # beyond the free angle when the strut coupled [rad]

    def beyond(self, angle: float) -> float:
        """How far it is pressed [rad]."""
        angle -= self.set
        return max(angle - self.free, 0.0) + min(angle + self.free, 0.0)


@dataclass
class Path(Element):
    """An element along a line between two points, each fixed in a body; that of a wall stands still."""

    strut: bool = False
    points: tuple[tuple[float, float], ...] = ()  # from the centres of gravity, or of the wall: along, upwards [m]
    origins: tuple[tuple[float, float], ...] = ()  # design places of these centres: along, upwards [m]
    zero: float = 0.0  # what is between its points as the vehicles stand, were there no gap [m]
    length: float = 0.0  # of a strut, from pin to pin, where the ends touch
    stops: tuple[Stop, ...] = ()  # left, right
    shears: bool = False
    coupled: bool = False  # whether swing stops act
    dead: bool = False
    friction: float = 0.0  # of the tie
    tooth: float = 0.0
    k: float = 0.0
    overlap: float = math.inf
    origin: float = math.nan  # slip at which the tie has no force
    before: tuple[float, float] | None = None  # while it is without force: when it last was, and step of the ends then
    at: Any = None  # of x, height and pitch of both bodies and their rates in the state
    # what was found
    most: float = -math.inf
    push: float = 0.0
    began: float = math.nan
    step: float = math.nan
    slip: float = 0.0
    tied: float = 0.0
    overridden: float = math.inf

    def tie(self, s: float, force: float) -> float:
        """Force of the tie at a slip and a force of the path [N]."""
        if force <= 0.0 or not self.k:
            return 0.0
        capacity = self.friction * force + self.tooth
        return max(-capacity, min(capacity, self.k * (s - self.origin)))

    def swinging(self) -> bool:
        """Whether its swing stops act."""
        return bool(self.stops) and self.coupled and not self.dead


class Along(NamedTuple):
    """A path in some position; derivatives by x, height and pitch of the left and right body."""

    u: float  # along the line
    rate: float
    du: tuple[tuple[float, float, float], tuple[float, float, float]]
    s: float  # across it
    slip: float
    ds: tuple[tuple[float, float, float], tuple[float, float, float]]
    angle: float  # of the line
    pitches: tuple[float, float]


def along(e: Path, state: Sequence[float]) -> Along:
    """A path where x, height, pitch of both bodies and their rates are `state`; 0 for those of a wall."""
    (x1, z1, p1, vx1, vz1, w1), (x2, z2, p2, vx2, vz2, w2) = state[:6], state[6:]
    (a1, b1), (a2, b2) = e.points
    (x01, z01), (x02, z02) = e.origins
    c1, s1, c2, s2 = math.cos(p1), math.sin(p1), math.cos(p2), math.sin(p2)
    rx1, rz1, rx2, rz2 = a1 * c1 - b1 * s1, a1 * s1 + b1 * c1, a2 * c2 - b2 * s2, a2 * s2 + b2 * c2
    gx, gz = x01 + x1 + rx1 - x02 - x2 - rx2, z01 + z1 + rz1 - z02 - z2 - rz2  # from the right point to the left one
    vx, vz = vx1 - rz1 * w1 - vx2 + rz2 * w2, vz1 + rx1 * w1 - vz2 - rx2 * w2
    if e.strut:
        long = math.hypot(gx, gz)
        nx, nz, angle = -gx / long, -gz / long, math.atan2(-gz, -gx)
        u, h, k = e.length - long, 0.0, 0.0
    else:
        angle = 0.5 * (p1 + p2 * (e.right != WALL))
        nx, nz = math.cos(angle), math.sin(angle)
        u = gx * nx + gz * nz
        h, k = 0.5 * (gz * nx - gx * nz), -0.5 * u
    s = gz * nx - gx * nz
    du = (nx, nz, rx1 * nz - rz1 * nx + h), (-nx, -nz, rz2 * nx - rx2 * nz + h)
    ds = (-nz, nx, rx1 * nx + rz1 * nz + k), (nz, -nx, -rx2 * nx - rz2 * nz + k)
    turns = w1 + w2
    return Along(u - e.zero, vx * nx + vz * nz + h * turns, du, s, vz * nx - vx * nz + k * turns, ds, angle, (p1, p2))


@dataclass(frozen=True)
class FoundPath:
    """What a path of a device did."""

    closing: float  # largest along the line, of a strut also after it has sheared off [m]
    strokes: tuple[float, ...]  # largest of each device of it, from where the path begins [m]; two equal ones: both
    force: float  # largest [N]
    work: float  # up to the end [J]
    began: float  # when it first carried force [s]; nan if it never did
    step: float  # of the ends then [m]
    slip: float  # largest magnitude across the line while it carried force [m]
    tie: float  # largest magnitude of the tie's force [N]
    overridden: float  # when faces slid off each other [s]; inf if they did not


@dataclass(frozen=True)
class FoundEnds:
    """What an interface did."""

    paths: tuple[FoundPath, ...]
    step: float  # largest magnitude while its ends touched [m]; nan if they never did


@dataclass(frozen=True)
class FoundVehicle:
    """What a vehicle did; wheelsets from the end that faces the impact."""

    pitch: float  # largest magnitude [rad]
    heave: float  # likewise [m]
    lift: tuple[float, ...]  # largest gap of each wheelset over the rail [m]; not above 0: none
    load: tuple[float, ...]  # least load of each wheelset over its load at rest


@dataclass(frozen=True)
class InPlane:
    """What was found; histories over time, one column for each vehicle."""

    time: float  # at the end [s]
    interfaces: dict[str, FoundEnds]
    vehicles: dict[str, FoundVehicle]  # without an obstacle
    t: Array  # [s]
    x: Array  # travel [m]
    z: Array  # rise [m]
    pitch: Array  # [rad]
    speed: dict[str, float]  # along the track, at the end [m/s]
    momenta: tuple[tuple[float, float, float], ...]  # along, up, about the rail where fronts meet: start, end
    kinetic: tuple[float, float]  # at the start and at the end [J]
    missing: float  # error of the energy balance [J]
    valid_until: float  # [s]; inf if no curve ended and nothing was overridden
    rates: int  # how often the motion was computed


class PlaneMotion(Motion):
    """A collision on its way; the other ten coordinates of each vehicle follow what one dimension keeps."""

    rtol, atol = 1e-7, 1e-9
    longest_free = 1e-3

    def __init__(
        self, values: Values, gravity: bool = True, rails: bool = True, locked: bool = False, record: float = 1e-3
    ) -> None:
        """Put a scenario at its start.

        Args:
            values: as the YAML file gives them, with points in place of the names of files.
            gravity: whether there is any.
            rails: whether there are any, with their friction.
            locked: whether vehicles move along only.
            record: between the times of histories [s].
        """
        up = lined_up(values)
        self.up, self.rails = up, rails
        types = [_type(values, up, i) for i in range(len(up.cars))]
        ahead = [1.0 if up.front_right(i) else -1.0 for i in range(len(up.cars))]
        self.gears = Gears(types, [car["mass"] for car in up.cars], ahead, G * gravity)
        lengths = [car["length"] for car in up.cars]
        middle = np.cumsum(lengths) - np.multiply(0.5, lengths) - sum(lengths[: up.moving])
        self.x0 = middle + self.gears.cog_x  # of the centres of gravity, where the fronts touch
        half = np.multiply(0.5, lengths)
        self.ends = np.stack([-half - self.gears.cog_x, half - self.gears.cog_x], axis=1)
        points = [Point(i, car["mass"], car["speed"]) for i, car in enumerate(up.cars)]
        self.flat = [m.right == WALL and len(m.devices) == 1 for m in up.meetings]  # a wall without a height
        interfaces = [Interface(m.name, m.left, m.right, list(self._paths(values, m))) for m in up.meetings]
        super().__init__(system_of(values, up, points, interfaces))
        self.joints = ()
        self.brakes = [car["brake"] for car in up.cars]
        self.limit = np.array([car["friction"] * car["mass"] * G for car in up.cars]) * rails
        self.free = np.ones((self.n, N), dtype=bool)
        self.free[:, 1:] = not locked
        self.free[[i for i, car in enumerate(up.cars) if car.get("type") is None], 1:] = False
        self.planar = self.size
        self.ties = self.planar + 20 * self.n
        self.size = self.ties + len(self.elements)
        self.y = np.concatenate([self.y, np.zeros(20 * self.n + len(self.elements))])
        self.y[self.planar : self.planar + 10 * self.n] = self.gears.start[:, 1:].ravel()
        for e in self._lined():
            e.at = np.array(self._body(e.left) + self._body(e.right))
            touching = self.y.copy()
            touching[: self.n] = 0.0
            e.zero = self._along(touching, e).u
            if e.coupled:
                self._couple(e, self._along(touching, e))
        self.touched = [math.nan] * len(interfaces)
        self.pitch, self.heave = np.zeros(self.n), np.zeros(self.n)
        self.lift, self.load = np.full((self.n, 4), -math.inf), np.full((self.n, 4), math.inf)
        self.record, self.rates, self.freed = record, 0, 0.0
        self.rows: list[Array] = []
        q, v = self.of(self.y)
        self.first = self._energy(self.y), self.gears.momenta(q, v, self.x0), self.gears.kinetic(q, v)

    def _body(self, i: int) -> list[int]:
        """Where x, height and pitch of a body, and their rates, are in the state; a wall has none."""
        if i == WALL:
            return []
        rest, rates = self.planar + 10 * i, self.planar + 10 * (self.n + i)
        return [i, rest, rest + 1, self.n + i, rates, rates + 1]

    def _lined(self) -> list[Path]:
        return [e for e in self.elements if isinstance(e, Path)]

    def _paths(self, values: Values, m: Meeting) -> list[Path]:
        """Those of an interface, side by side."""
        ties = values.get("ties", "stated")
        runs = [_runs(name, values) for name in m.devices]
        plain = {**values, "devices": {key: spec for run in runs for key, spec, _, _ in run}}
        found = []
        for sides in zip(*runs, strict=True):
            lines = sides[0][2], sides[-1][2]
            e = series([key for key, *_ in sides], plain, m.left, m.right, sum(start for *_, start in sides))
            path = self._path(e, lines, m, ties)
            path.shears = "shear_off" in _last(sides[0][1])
            found.append(path)
        pull = draw_gear(m.devices, values, m.left, m.right) if m.inner else None
        return [*found, *([self._path(pull, (runs[0][0][2], runs[-1][0][2]), m, "free")] if pull else [])]

    def _path(self, e: Element, lines: tuple[Values, Values], m: Meeting, ties: str) -> Path:
        strut = lines[0]["acts"] == "strut"
        points: list[tuple[float, float]] = []
        origins: list[tuple[float, float]] = []
        pins = 0.0
        for line, i, end in zip(lines, (m.left, m.right), (1, 0), strict=True):
            high = line["height_mm"] / 1e3
            if i == WALL:
                if len(m.devices) == 1:  # a flat wall, at the height at which the vehicle before it stands
                    (a, b), (_, z), pitch = points[0], origins[0], self.gears.start[m.left, PITCH]
                    high = z + a * math.sin(pitch) + b * math.cos(pitch)
                points.append((0.0, high))
                origins.append((0.0, 0.0))
                continue
            pin = line["pin_m"] if strut else 0.0
            pins += pin
            points.append((self.ends[i, end] + (-pin if end else pin), high - self.gears.cog[i]))
            origins.append((self.x0[i], self.gears.height[i]))
        path = Path(**vars(e), strut=strut, points=tuple(points), origins=tuple(origins), length=pins)
        if ties == "free":
            return path
        if strut:
            swings = [line.get("swing") for line in lines]
            path.coupled = m.inner
            path.stops = tuple(
                _stop(None if i == WALL and len(m.devices) == 1 else one, ties == "tied")
                for one, i in zip(swings, (m.left, m.right), strict=True)
            )
            return path
        path.overlap = min(line.get("overlap_mm", math.inf) for line in lines) / 1e3
        both = [tie for tie in (line.get("tie") for line in lines) if isinstance(tie, Mapping)]
        if len(both) == 2:
            path.k = min(tie["kN_per_mm"] for tie in both) * 1e6
            path.friction = math.inf if ties == "tied" else min(tie["friction"] for tie in both)
            path.tooth = min(tie["tooth_kN"] for tie in both) * 1e3
        return path

    # the state

    def of(self, y: Array) -> tuple[Array, Array]:
        """Coordinates and rates of the vehicles, (n, 11) each."""
        n, at = self.n, self.planar
        q, v = np.empty((n, N)), np.empty((n, N))
        q[:, 0], v[:, 0] = y[:n], y[n : 2 * n]
        q[:, 1:] = y[at : at + 10 * n].reshape(n, 10)
        v[:, 1:] = y[at + 10 * n : at + 20 * n].reshape(n, 10)
        return q, v

    def _along(self, y: Array, e: Path) -> Along:
        return along(e, y[e.at].tolist() + [0.0] * (12 - len(e.at)))

    def _between(self, y: Array, e: Element) -> tuple[float, float]:
        assert isinstance(e, Path)
        a = self._along(y, e)
        return e.closing(a.u, a.rate)

    def _net(self, y: Array) -> tuple[Array, list[list[tuple[float, float]]], list[float]]:
        all_sides = [self._sides(y, k)[2] for k in range(len(self.elements))]
        return np.zeros(self.n), all_sides, [e.force(s) for e, s in zip(self.elements, all_sides, strict=True)]

    def rate(self, t: float, y: Array) -> Array:
        """Of everything that is followed."""
        n, d = self.n, np.zeros(self.size)
        self.rates += 1
        q, v = self.of(y)
        pose = self.gears.pose(q)
        Q, lost = self.gears.suspended(pose, q, v)
        if self.rails:
            load, taken = self.gears.on_rail(q, v)
            Q[:, AXLE] += load
            lost = lost + taken
        by_lines = np.zeros((n, 3))
        for k, e in enumerate(self._lined()):
            a = self._along(y, e)
            at = self.at[k]
            sides = e.sides(*e.closing(a.u, a.rate), y[at : at + e.extra])
            force = e.force(sides)
            tie = e.tie(a.s, force)
            swing = self._swing(e, a)
            for i, du, ds, turn in zip((e.left, e.right), a.du, a.ds, swing, strict=True):
                if i != WALL:
                    by_lines[i] += [-e.sign * force * g - tie * h + m for g, h, m in zip(du, ds, turn, strict=True)]
            d[self.ties + k] = tie * a.slip
            if e.broken:
                continue
            d[at : at + e.extra] = e.rates(sides)
            at += e.extra
            for j, (device, (w, rate)) in enumerate(zip(e.devices, sides, strict=True)):
                d[at + 2 * j], d[at + 2 * j + 1] = device.force(w, rate) * rate, device.viscous(w, rate) * rate
        Q[:, : PITCH + 1] += by_lines
        Q[:, X] += self.weight
        J, c = self.gears.along(pose, v)
        limits = self.limit + [brake.at(t) for brake in self.brakes]
        if limits.any():
            drag = -limits * np.clip(v[:, X] / CREEP, -1.0, 1.0)
            pulled = self.gears.held(J) * self.free
            Q += drag[:, None] * pulled
            d[self.books] = -float((drag * (pulled * v).sum(axis=1)).sum())
        Q += self.gears.turning(q, v, J, c)
        M = self.gears.mass_matrix(q, J)
        if not self.free.all():
            M *= self.free[:, :, None] & self.free[:, None, :]
            M[:, range(N), range(N)] += ~self.free
            Q *= self.free
        acceleration = np.linalg.solve(M, Q[:, :, None])[:, :, 0]
        d[:n], d[n : 2 * n] = v[:, 0], acceleration[:, 0]
        d[self.planar : self.ties] = np.concatenate([v[:, 1:].ravel(), acceleration[:, 1:].ravel()])
        d[self.books + 1] = float((lost * self.free[:, Z]).sum())
        d[self.books + 2] = float((self.weight * v[:, X]).sum())
        return d

    def _swing(self, e: Path, a: Along) -> tuple[tuple[float, float, float], ...]:
        """What the swing stops of a strut do to both bodies."""
        if not e.swinging():
            return ((0.0, 0.0, 0.0),) * 2
        moments = [stop.k * stop.beyond(a.angle - p) for stop, p in zip(e.stops, a.pitches, strict=True)]
        turn = sum(moments) / (
            e.length - a.u - e.zero
        )  # the line turns as its ends slip, the left one upwards: backwards
        left, right = ([turn * g for g in ds] for ds in a.ds)
        return (left[0], left[1], left[2] + moments[0]), (right[0], right[1], right[2] + moments[1])

    def _couple(self, e: Path, a: Along) -> None:
        """A stop that is reached as a strut couples begins without a moment."""
        e.coupled = True
        for stop, p in zip(e.stops, a.pitches, strict=False):  # there may be none
            stop.set = stop.beyond(a.angle - p)

    def _swung(self, e: Path, a: Along) -> float:
        """Energy of the swing stops [J]."""
        pressed = (0.5 * stop.k * stop.beyond(a.angle - p) ** 2 for stop, p in zip(e.stops, a.pitches, strict=True))
        return sum(pressed)

    # on the way

    def over(self, t: float) -> bool:
        """It is followed to its end."""
        return False

    def _note(self, t0: float, t1: float, dense: Any) -> None:
        while self.record * len(self.rows) <= t1:
            q, _ = self.of(dense(self.record * len(self.rows)))
            self.rows.append(q[:, :3])
        super()._note(t0, t1, dense)

    def look(self, t: float, y: Array) -> None:
        """Note the peaks, and let ties slip."""
        q, v = self.of(y)
        if self.rails:
            load, _ = self.gears.on_rail(q, v)
            self.lift = np.maximum(self.lift, self.gears.gaps(q))
            self.load = np.minimum(self.load, load / self.gears.load)
        self.pitch, self.heave = np.maximum(self.pitch, np.abs(q[:, PITCH])), np.maximum(self.heave, np.abs(q[:, Z]))
        ends, at_start = self._rises(q), self._rises(self.gears.start)
        k = 0
        for j, joint in enumerate(self.s.interfaces):
            met = at_start[joint.left, 1] if self.flat[j] else 0.0 if joint.right == WALL else ends[joint.right, 0]
            step = ends[joint.left, 1] - met
            for e in joint.elements:
                assert isinstance(e, Path)
                self.touched[j] = float(np.fmax(self.touched[j], self._look_at(t, y, k, e, float(step))))
                k += 1

    def _rises(self, q: Array) -> Array:
        """How much higher both ends of each vehicle are than designed."""
        risen = (self.gears.offset + q[:, Z])[:, None] + self.ends * np.sin(q[:, PITCH])[:, None]
        return np.asarray(risen)

    def _look_at(self, t: float, y: Array, k: int, e: Path, step: float) -> float:
        """Note its peaks; magnitude of the step if it carries force, or has just begun or ceased to; else nan."""
        a = self._along(y, e)
        _, _, sides = self._sides(y, k)
        force = e.force(sides)
        if e.sign < 0.0:
            return math.nan
        e.most, e.push = max(e.most, a.u), max(e.push, force)
        e.top = [max(top, w) for top, (w, _) in zip(e.top, sides, strict=True)]
        if e.strut and not e.dead:
            was = e.swinging()
            if not e.coupled and a.u >= 0.0:
                self._couple(e, a)
            ends = [d.curve.end for d in e.devices if isinstance(d, Crush)]
            e.dead = e.shears and any(w >= end - 1e-9 for (w, _), end in zip(sides, ends, strict=False))
            if was is not e.swinging():
                self.freed += self._swung(e, a) * (1.0 if was else -1.0)
        if force > 0.0:
            if math.isnan(e.began):
                e.began, e.step = e.before or (t, step)
            e.slip = max(e.slip, abs(a.s))
            if abs(a.s) > e.overlap:
                e.overridden = min(e.overridden, t)
                self.valid_until = min(self.valid_until, t)
            tie = e.tie(a.s, force)
            e.tied = max(e.tied, abs(tie))
            e.origin = a.s - tie / e.k if e.k else a.s
            most = max(abs(step), abs(e.before[1])) if e.before else abs(step)
            e.before = None
            return most
        e.origin, ceased = a.s, e.before is None and not math.isnan(e.began)
        e.before = t, step
        if not ceased:
            return math.nan
        e.slip = max(e.slip, abs(a.s))
        return abs(step)

    # at the end

    def _energy(self, y: Array) -> float:
        """Kinetic and stored in vehicles, rails and swing stops [J]."""
        q, v = self.of(y)
        swung = sum(self._swung(e, self._along(y, e)) for e in self._lined() if e.swinging())
        return self.gears.kinetic(q, v) + self.gears.potential(q, self.rails) + swung

    def found(self) -> InPlane:
        """All of it."""
        y = self.y
        q, v = self.of(y)
        interfaces, k = {}, 0
        done = 0.0
        for j, joint in enumerate(self.s.interfaces):
            paths = []
            for e in joint.elements:
                assert isinstance(e, Path)
                at = self.at[k] + e.extra
                work = e.share * sum(y[at + 2 * m] + e.jumped[m] for m in range(len(e.devices)))
                done += work + (0.0 if e.broken else e.lost)
                tops = tuple(map(float, e.top)) * (2 if e.share == 2.0 else 1)
                if e.sign > 0.0:
                    rest = map(float, (e.push, work, e.began, e.step, e.slip, e.tied, e.overridden))
                    paths.append(FoundPath(float(e.most), tops, *rest))
                k += 1
            interfaces[joint.name] = FoundEnds(tuple(paths), self.touched[j])
        done += y[self.ties :].sum() + y[self.books] + y[self.books + 1] - y[self.books + 2]
        vehicles = {}
        for i, name in enumerate(self.up.names):
            if self.up.cars[i].get("type") is None:
                continue
            order = slice(None, None, -1 if name.startswith("M") else 1)
            wheels = (tuple(a[i, order].tolist()) for a in (self.lift, self.load))
            vehicles[name] = FoundVehicle(float(self.pitch[i]), float(self.heave[i]), *wheels)
        rows = np.array(self.rows)
        missing = self.first[0] - self._energy(y) - done - self.freed
        start = np.where(np.arange(self.n) <= self.s.front, -self.s.gap, 0.0)
        return InPlane(
            self.t,
            interfaces,
            vehicles,
            self.record * np.arange(len(rows)),
            rows[:, :, X] - start,
            rows[:, :, Z],
            rows[:, :, PITCH],
            dict(zip(self.up.names, v[:, X].tolist(), strict=True)),
            (self.first[1], self.gears.momenta(q, v, self.x0)),
            (self.first[2], self.gears.kinetic(q, v)),
            float(missing),
            self.valid_until,
            self.rates,
        )


def _type(values: Values, up: LineUp, i: int) -> Mapping[str, Any]:
    """The type of a vehicle with what the collision states of it; that of an obstacle."""
    name, c = up.names[i], values["collision"]
    sided: list[dict[str, float]] = [c.get("offset_mm") or {}, c.get("pitch_mrad") or {}]
    offset, pitch = (one.get(name, one.get(name[0], 0.0)) / 1e3 for one in sided)
    car = up.cars[i]
    stated: Mapping[str, Any] = values["vehicle_types"][car["type"]] if car.get("type") else OBSTACLE
    return {**stated, "offset_m": offset, "pitch_rad": pitch if name.startswith("M") else -pitch}


def _stop(swing: Any, tied: bool) -> Stop:
    """The swing stop of a pin."""
    if not isinstance(swing, Mapping):
        return Stop(math.inf, 0.0)
    return Stop(0.0 if tied else swing["free_mrad"] / 1e3, swing["MN_m_per_rad"] * 1e6)


def _last(spec: Values) -> Values:
    """The last stage of a device."""
    return dict(list(spec["stages"].values())[-1]) if "stages" in spec else spec


def _runs(name: str, values: Values) -> list[tuple[str, Values, Values, float]]:
    """The paths of a device: a name, its values, its line, and the stroke at which it begins [m]."""
    spec = {key: value for key, value in values["devices"][name].items() if key not in ("line", "pull")}
    line = values["devices"][name].get("line", {})
    if "stages" not in spec:
        return [(name, spec, line, 0.0)]
    stages = list(spec["stages"].items())
    cuts = [0, *(k + 1 for k, (_, s) in enumerate(stages[:-1]) if s.get("shear_off")), len(stages)]
    found: list[tuple[str, Values, Values, float]] = []
    begin = 0.0
    for first, last in pairwise(cuts):
        run = stages[first:last]
        own = next((s["line"] for _, s in run if "line" in s), line)
        plain = {key: {k: v for k, v in s.items() if k != "line"} for key, s in run}
        start = begin
        if first:
            start += run[0][1].get("empty_stroke_mm", 0.0) / 1e3
            plain[run[0][0]]["empty_stroke_mm"] = 0.0
        found.append((f"{name}:{first}", {**spec, "stages": plain}, own, start))
        begin += sum(s.get("empty_stroke_mm", 0.0) / 1e3 + curve_points(s["curve"], values)[-1][0] for _, s in run)
    return found


def solve(values: Values, until: float | None = None, **given: Any) -> InPlane:
    """Follow a collision in the vertical plane to a time [s], or to its time limit.

    Args:
        values: a scenario with `plane: vertical` as its YAML file gives it, points in place of the names of files.
        until: the time.
        given: as `PlaneMotion` takes them.

    Raises:
        EngineError: if the integration fails.
    """
    motion = PlaneMotion(values, **given)
    motion.go(motion.s.time_limit if until is None else until, stop_when_over=False)
    return motion.found()
