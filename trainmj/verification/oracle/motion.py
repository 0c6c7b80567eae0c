"""The motion from switch to switch: vehicles, elements, rails, brakes and grade, followed by scipy's integrators."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import DOP853, LSODA
from scipy.optimize import brentq

from trainmj.errors import EngineError
from trainmj.verification.oracle.bodies import Given, Member, Members
from trainmj.verification.oracle.devices import SLACK_M_S, SLACK_N, Crush, Hydraulic, Hysteresis
from trainmj.verification.oracle.elements import Element

Array = np.ndarray
G = 9.80665
WALL = -1
_INSIDE = 4  # looks at the conditions in each step
_CLOSING = 0.01  # below this rate nothing comes closer [m/s]


@dataclass(frozen=True)
class Brake:
    """Limit of a brake over time."""

    force: float  # [N]
    delay: float = 0.0
    rise: float = 0.0

    def shared(self, share: float) -> Brake:
        """A part of it."""
        return Brake(share * self.force, self.delay, self.rise)

    def at(self, t: float) -> float:
        """Its limit at a time [N]."""
        if t < self.delay:
            return 0.0
        return self.force * (min(1.0, (t - self.delay) / self.rise) if self.rise > 0.0 else 1.0)


@dataclass(frozen=True)
class Point:
    """A vehicle, or a part of one with a body that gives, as numbers in SI."""

    vehicle: int
    mass: float
    speed: float
    friction: float = 0.0  # largest force of the rails [N]
    brake: Brake = Brake(0.0)


@dataclass
class Interface:
    """All that joins two neighbours; or both ends of a body, whose members are elsewhere."""

    name: str
    left: int  # point
    right: int
    elements: list[Element]


@dataclass(frozen=True)
class System:
    """What is collided, left to right."""

    vehicles: tuple[str, ...]  # by name
    points: tuple[Point, ...]
    interfaces: tuple[Interface, ...]
    members: tuple[Member, ...]
    bodies: tuple[Interface, ...]  # from one end of a body that gives to the other one
    gap: float  # at the front
    front: int  # index of the last vehicle of the moving train
    slope: float  # sine of the angle of the track, positive uphill along +x
    time_limit: float


@dataclass(frozen=True)
class Found:
    """What an interface did."""

    stroke: float  # largest [m]
    time: float  # of the largest stroke [s]
    sides: tuple[float, ...]  # largest of each device of it [m]; those of a front: left, right
    force: float  # largest push [N]
    pull: float  # largest pull [N]
    energies: dict[str, float]  # at the end [J]: crushed, viscous, frictional, gas, elastic, set_free, broken
    broken: bool

    @property
    def absorbed(self) -> float:
        """All that does not come back [J]."""
        return sum(e for kind, e in self.energies.items() if kind != "elastic")


@dataclass(frozen=True)
class Solution:
    """What an independent solution found; vehicles and interfaces by the names that results give them."""

    time: float  # at the end [s]
    interfaces: dict[str, Found]
    speed: dict[str, float]  # at the end [m/s]
    travel: dict[str, float]  # from the start [m]
    acceleration: dict[str, float]  # largest magnitudes, by the devices alone [m/s2]
    kinetic: tuple[float, float]  # at the start and the end [J]
    convertible: float  # kinetic energy about the common centre of mass at the start, or all of it at a wall [J]
    rails: float  # [J]
    brakes: float
    grade: float  # work that the grade did on the vehicles [J]
    valid_until: float  # [s], inf if no curve ended
    switches: int
    over: float  # time at which it was over [s]; nan if it was not
    stood: dict[str, float] = field(default_factory=dict)  # when a vehicle of one mass last came to rest [s]
    members: dict[str, Given] = field(default_factory=dict)
    shortened: dict[str, float] = field(default_factory=dict)  # largest of each body that gives [m]

    @property
    def missing(self) -> float:
        """Error of the energy balance [J]."""
        kept = sum(f.absorbed + f.energies["elastic"] for f in self.interfaces.values())
        kept += sum(m.lost + m.elastic for m in self.members.values())
        return self.kinetic[0] + self.grade - self.kinetic[1] - self.rails - self.brakes - kept


class Motion:
    """A system on its way."""

    rtol, atol = 1e-10, 1e-12
    longest = 1e-3  # longest step while there is force [s]: what fails and holds again within one is not seen
    longest_free = 1e-2  # while there is none

    def __init__(self, system: System) -> None:
        """Put a system at its start."""
        self.s = system
        self.n = len(system.points)
        self.mass = np.array([p.mass for p in system.points])
        self.vehicle = np.array([p.vehicle for p in system.points])
        self.whole = np.bincount(self.vehicle, self.mass)
        self.members = Members(system.members)
        self.joints = (*system.interfaces, *system.bodies)
        self.elements = [e for i in system.interfaces for e in i.elements]
        self.at: list[int] = []
        at = 2 * self.n
        for e in self.elements:
            self.at.append(at)
            at += e.extra + 2 * len(e.devices)
        self.plastic = at
        self.dashpots = at + self.members.n
        self.books = self.dashpots + self.members.n
        self.size = self.books + 3
        self.weight = -self.mass * G * system.slope
        self.hold = np.array([p.friction for p in system.points])
        self.gripped = np.array([p.friction > 0.0 or p.brake.force > 0.0 for p in system.points])
        y = np.zeros(self.size)
        y[: self.n] -= np.where(self.vehicle <= system.front, system.gap, 0.0)
        y[self.n : 2 * self.n] = [p.speed for p in system.points]
        self.y = y
        self.way = np.sign(y[self.n : 2 * self.n])
        self.t = 0.0
        self.valid_until = math.inf
        self.switches = 0
        self.stroke = [-math.inf] * len(self.joints)
        self.stroke_time = [0.0] * len(self.joints)
        self.push = [0.0] * len(system.interfaces)
        self.pull = [0.0] * len(system.interfaces)
        self.peak = np.zeros(len(system.vehicles))
        self.stood: dict[str, float] = {}

    # the state

    def _between(self, y: Array, e: Element) -> tuple[float, float]:
        n = self.n
        u, v = y[e.left], y[n + e.left]
        if e.right != WALL:
            u, v = u - y[e.right], v - y[n + e.right]
        return e.closing(float(u), float(v))

    def _sides(self, y: Array, k: int) -> tuple[float, float, list[tuple[float, float]]]:
        e = self.elements[k]
        u, v = self._between(y, e)
        return u, v, e.sides(u, v, y[self.at[k] : self.at[k] + e.extra])

    def _limits(self, t: float) -> tuple[Array, Array]:
        brakes = np.array([p.brake.at(t) for p in self.s.points])
        return self.hold, brakes

    def _of_members(self, y: Array) -> tuple[Array, Array, Array]:
        """Their shortenings, rates and plastic shortenings."""
        u, v = self.members.between(y[: self.n]), self.members.between(y[self.n : 2 * self.n])
        return u, v, y[self.plastic : self.dashpots]

    def _net(self, y: Array) -> tuple[Array, list[list[tuple[float, float]]], list[float]]:
        net = self.weight.copy()
        all_sides, forces = [], []
        for k, e in enumerate(self.elements):
            _, _, sides = self._sides(y, k)
            f = e.force(sides) * e.sign
            net[e.left] -= f
            if e.right != WALL:
                net[e.right] += f
            all_sides.append(sides)
            forces.append(f)
        if self.members.n:
            inner = self.members.force(*self._of_members(y))
            net -= np.bincount(self.members.left, inner, self.n)
            net += np.bincount(self.members.right, inner, self.n)
        return net, all_sides, forces

    def rate(self, t: float, y: Array) -> Array:
        """Of everything that is followed."""
        n, d = self.n, np.zeros(self.size)
        net, all_sides, _ = self._net(y)
        rails, brakes = self._limits(t)
        d[:n] = y[n : 2 * n]
        a = (net - self.way * (rails + brakes)) / self.mass
        a[self.gripped & (self.way == 0.0)] = 0.0
        d[n : 2 * n] = a
        for k, e in enumerate(self.elements):
            at = self.at[k]
            if e.broken:
                continue
            d[at : at + e.extra] = e.rates(all_sides[k])
            at += e.extra
            for j, (device, (w, v)) in enumerate(zip(e.devices, all_sides[k], strict=True)):
                d[at + 2 * j] = device.force(w, v) * v
                d[at + 2 * j + 1] = device.viscous(w, v) * v
        speed = y[n : 2 * n]
        of_members = self._of_members(y)
        d[self.plastic : self.dashpots] = self.members.rate(*of_members)
        d[self.dashpots : self.books] = self.members.viscous(*of_members)
        d[self.books] = float((self.way * speed * rails).sum())
        d[self.books + 1] = float((self.way * speed * brakes).sum())
        d[self.books + 2] = float((self.weight * speed).sum())
        return d

    # conditions

    def conditions(self, t: float, y: Array) -> list[float]:
        """Values that are not negative while all branches last, with their slack added."""
        net, all_sides, _ = self._net(y)
        values = []
        for k, e in enumerate(self.elements):
            u, v = self._between(y, e)
            values += [value + slack for value, slack in e.conditions(u, v, all_sides[k])]
        values += self.members.conditions(*self._of_members(y)).tolist()
        rails, brakes = self._limits(t)
        for i in np.flatnonzero(self.gripped):
            if self.way[i]:
                values.append(self.way[i] * y[self.n + i] + SLACK_M_S)
            else:
                values.append(rails[i] + brakes[i] + SLACK_N - abs(net[i]))
        grown = self._grown(y)
        if grown:
            step = 1e-9
            ahead = self._grown(y + step * self.rate(t, y))
            values += [(b - a) / step + 1e-5 for a, b in zip(grown, ahead, strict=True)]
        return values

    def _grown(self, y: Array) -> list[float]:
        found = []
        for k, e in enumerate(self.elements):
            if any(isinstance(d, Crush) and d.branch == "crushing" for d in e.devices) and not e.broken:
                _, _, sides = self._sides(y, k)
                grown = [d.grown(*side) for d, side in zip(e.devices, sides, strict=True)]
                found += [g for g in grown if not math.isnan(g)]
        return found

    def worst(self, t: float, y: Array) -> float:
        """The least of the conditions; inf if there is none."""
        return min(self.conditions(t, y), default=math.inf)

    def switch(self, t: float) -> None:
        """Leave every branch whose condition fails, until none does."""
        y, n = self.y, self.n
        for _ in range(60):
            changed = False
            for k, e in enumerate(self.elements):
                if e.broken:
                    continue
                u, v, sides = self._sides(y, k)
                failed = any(value < -slack / 2 for value, slack in e.conditions(u, v, sides))
                shrunk = False
                if not failed and any(not math.isnan(d.grown(*s)) for d, s in zip(e.devices, sides, strict=True)):
                    step = 1e-9
                    ahead = y + step * self.rate(t, y)
                    _, _, then = self._sides(ahead, k)
                    for d, s, s2 in zip(e.devices, sides, then, strict=True):
                        a, b = d.grown(*s), d.grown(*s2)
                        shrunk |= not math.isnan(a) and (b - a) / step < -0.5e-5
                if failed or shrunk:
                    at = self.at[k]
                    e.switch(u, v, y[at : at + e.extra], shrunk)
                    self.switches += 1
                    changed = True
            yields = self.members.switch(*self._of_members(y))
            self.switches += yields
            changed |= yields > 0
            net, _, _ = self._net(y)
            rails, brakes = self._limits(t)
            for i in np.flatnonzero(self.gripped):
                limit = rails[i] + brakes[i]
                speed = y[n + i]
                if self.way[i] and self.way[i] * speed < -SLACK_M_S / 2:
                    y[n + i] = 0.0
                    self.stood[self.s.vehicles[self.vehicle[i]]] = t
                    self.way[i] = 0.0 if abs(net[i]) <= limit else np.sign(net[i])
                    changed = True
                    self.switches += 1
                elif not self.way[i] and abs(net[i]) > limit + SLACK_N / 2:
                    self.way[i] = np.sign(net[i])
                    changed = True
                    self.switches += 1
            if not changed:
                return
        raise EngineError(f"the independent solution does not come past a switch at {t} s")

    # from switch to switch

    def look(self, t: float, y: Array) -> None:
        """Note the peaks."""
        by_device = np.zeros(len(self.whole))
        k = 0
        for j, joint in enumerate(self.joints):
            u = y[joint.left] - (y[joint.right] if joint.right != WALL else 0.0)
            if u > self.stroke[j]:
                self.stroke[j], self.stroke_time[j] = float(u), t
        self.members.look(*self._of_members(y))
        for j, interface in enumerate(self.s.interfaces):
            push = pull = 0.0
            for e in interface.elements:
                _, _, sides = self._sides(y, k)
                f = e.force(sides)
                push, pull = (push + f, pull) if e.sign > 0 else (push, pull + f)
                if e.sign > 0 and not e.broken:
                    for m, (w, _) in enumerate(sides):
                        e.top[m] = max(e.top[m], w)
                k += 1
            self.push[j], self.pull[j] = max(self.push[j], push), max(self.pull[j], pull)
            by_device[self.vehicle[interface.left]] -= push - pull
            if interface.right != WALL:
                by_device[self.vehicle[interface.right]] += push - pull
        self.peak = np.maximum(self.peak, np.abs(by_device) / self.whole)

    def _ended(self, y: Array) -> float:
        """How far the device that is furthest past its curve is past it [m]."""
        most = -math.inf
        for k, e in enumerate(self.elements):
            if e.broken or not e.carries():
                continue
            _, _, sides = self._sides(y, k)
            most = max([most, *(w - end for (w, _), end in zip(sides, e.ends, strict=True))])
        return most

    def over(self, t: float) -> bool:
        """Whether nothing carries force and nothing comes closer, or everything stands."""
        net, _, forces = self._net(self.y)
        speed = self.y[self.n : 2 * self.n]
        rails, brakes = self._limits(t)
        if (np.abs(speed) < 1e-9).all() and (np.abs(net) <= rails + brakes + SLACK_N).all():
            return True
        if any(abs(f) > 1.0 for f in forces):
            return False
        return all(e.broken or self._between(self.y, e)[1] < _CLOSING for e in self.elements)

    def go(self, until: float, stop_when_over: bool) -> float:
        """Follow it to a time; returns when it was over, nan if it was not."""
        brakes = {p.brake for p in self.s.points}
        marks = {b.delay for b in brakes} | {b.delay + b.rise for b in brakes}
        stops = [*sorted(m for m in marks if 0.0 < m < until), until]
        self.look(0.0, self.y)
        for stop in stops:
            while self.t < stop:
                self.switch(self.t)
                self.t = self._stretch(self.t, stop)
                if stop_when_over and self.over(self.t):
                    return self.t
        return self.t if self.over(self.t) else math.nan

    def _stiff(self) -> bool:
        for e in self.elements:
            if e.carries() and len(e.devices) == 2 and any(d.rated() for d in e.devices):
                return True
            if any(isinstance(d, Hydraulic) and d.rebound is None and d.carries() for d in e.devices):
                return True
        return False

    def _stretch(self, t: float, stop: float) -> float:
        """One branch of everything; self.y is left at its end."""
        atol = np.full(self.size, self.atol)
        for k, e in enumerate(self.elements):
            atol[self.at[k] + e.extra : self.at[k] + e.extra + 2 * len(e.devices)] = 1e-5
        atol[self.books :] = 1e-5
        stiff = self._stiff()
        kind: Any = LSODA if stiff else DOP853
        carries = any(e.carries() for e in self.elements)
        step = self.longest if carries or self.members.n else self.longest_free
        rtol = 10 * self.rtol if stiff else self.rtol
        solver = kind(self.rate, t, self.y.copy(), stop, rtol=rtol, atol=atol, max_step=step)
        while solver.status == "running":
            message = solver.step()
            if solver.status == "failed":
                raise EngineError(f"the independent solution stopped at {solver.t} s: {message}")
            t0, t1 = solver.t_old, solver.t
            dense = solver.dense_output()
            last = t0
            looks: list[float] = np.linspace(t0, t1, _INSIDE + 1)[1:].tolist()
            for s in looks:
                y = solver.y if s == t1 else dense(s)
                if self.worst(s, y) < 0.0:
                    end = s
                    if self.worst(last, dense(last)) >= 0.0:
                        end = float(
                            brentq(lambda x, dense=dense: self.worst(x, dense(x)), last, s, xtol=1e-15, rtol=1e-14)
                        )
                        end = min(s, end + 4e-16 * max(1.0, s))
                        for _ in range(60):
                            if self.worst(end, dense(end)) < 0.0:
                                break
                            end = min(s, end + max(2 * (end - last) * 1e-12, 1e-15))
                    self._note(last, end, dense)
                    self.y = dense(end) if end != t1 else solver.y.copy()
                    self.look(end, self.y)
                    return end
                self._note(last, s, dense)
                last = s
            if not carries and t1 - t > 0.02:
                break  # to see whether it is over
        self.y = solver.y.copy()
        return float(solver.t)

    def _note(self, t0: float, t1: float, dense: Any) -> None:
        """What happened in a stretch without a switch: peaks inside it and at its end, and curves that ended."""

        def closing(y: Array, joint: Interface) -> float:
            return float(y[self.n + joint.left] - (y[self.n + joint.right] if joint.right != WALL else 0.0))

        y0, y1 = dense(t0), dense(t1)
        for joint in self.joints:
            if closing(y0, joint) > 0.0 > closing(y1, joint):
                t = float(brentq(lambda t, joint=joint: closing(dense(t), joint), t0, t1, xtol=1e-14))
                self.look(t, dense(t))
        if self.valid_until == math.inf and self._ended(y1) > 0.0:
            self.valid_until = t0
            if self._ended(y0) < 0.0:
                self.valid_until = float(brentq(lambda x: self._ended(dense(x)), t0, t1, xtol=1e-12))
        self.look(t1, y1)

    def _mean(self, values: Array) -> Array:
        """Of the points of each vehicle, by their masses."""
        return np.asarray(np.bincount(self.vehicle, self.mass * values) / self.whole)

    def solution(self, t: float, over: float) -> Solution:
        """All that was found."""
        n, y = self.n, self.y
        names = self.s.vehicles
        found, k = {}, 0
        for j, interface in enumerate(self.s.interfaces):
            energies = dict.fromkeys(("crushed", "viscous", "frictional", "gas", "elastic", "set_free", "broken"), 0.0)
            tops: tuple[float, ...] = ()
            broken = False
            for e in interface.elements:
                _, _, sides = self._sides(y, k)
                at = self.at[k] + e.extra
                for m, (device, (w, rate)) in enumerate(zip(e.devices, sides, strict=True)):
                    device.settle(w, rate)
                    work = y[at + 2 * m] + e.jumped[m]
                    viscous = y[at + 2 * m + 1]
                    stored = 0.0 if e.broken else device.stored(w)
                    rest = work - viscous - stored - (e.lost / e.share if e.broken else 0.0)
                    body = 0.0
                    if isinstance(device, Hysteresis | Hydraulic) and device.body.p > 0.0:
                        body = device.body.collapse * device.body.p
                    kind = {Hysteresis: "frictional", Hydraulic: "gas"}.get(type(device), "crushed")
                    for key, amount in (
                        ("viscous", viscous),
                        ("elastic", stored),
                        ("crushed", body),
                        (kind, rest - body),
                    ):
                        energies[key] += e.share * amount
                energies["broken" if e.broken else "set_free"] += e.lost
                broken |= e.broken
                if e.sign > 0 and (not tops or max(e.top) > 0.0):
                    before = e.offset / 2 if len(interface.elements) > 1 else 0.0
                    tops = tuple(top + before for top in e.top) if e.share == 1 else (e.top[0] + before,) * 2
                k += 1
            found[interface.name] = Found(
                self.stroke[j], self.stroke_time[j], tops, self.push[j], self.pull[j], energies, broken
            )
        speed0 = np.array([p.speed for p in self.s.points])
        kinetic = (0.5 * float((self.mass * speed0**2).sum()), 0.5 * float((self.mass * y[n : 2 * n] ** 2).sum()))
        common = 0.0
        if all(i.right != WALL for i in self.s.interfaces):
            common = float((self.mass * speed0).sum() / self.mass.sum())
        start = np.where(self.vehicle <= self.s.front, -self.s.gap, 0.0)
        shortening, _, plastic = self._of_members(y)
        given = self.members.found(shortening, plastic, y[self.dashpots : self.books])
        shortened = self.stroke[len(self.s.interfaces) :]
        return Solution(
            t,
            found,
            dict(zip(names, self._mean(y[n : 2 * n]).tolist(), strict=True)),
            dict(zip(names, self._mean(y[:n] - start).tolist(), strict=True)),
            dict(zip(names, self.peak.tolist(), strict=True)),
            kinetic,
            0.5 * float((self.mass * (speed0 - common) ** 2).sum()),
            float(y[self.books]),
            float(y[self.books + 1]),
            float(y[self.books + 2]),
            self.valid_until,
            self.switches,
            over,
            self.stood,
            {m.name: found for m, found in zip(self.s.members, given, strict=True)},
            {body.name: most for body, most in zip(self.s.bodies, shortened, strict=True)},
        )
