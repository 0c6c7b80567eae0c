"""What joins two vehicles: one device, two equal ones, or two different ones in series, whose joint has no mass.

The joint of a pair is where the forces of both devices are equal. If the force of one of them depends on its rate, this
gives the rate of the joint; if not, the slopes share the rate out, and where both together have none that holds, the
joint jumps at constant stroke to where the forces meet again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from trainmj.errors import EngineError
from trainmj.verification.oracle.devices import SLACK_M, SLACK_N, Crush, Device, Hydraulic, Hysteresis

Array = np.ndarray
Side = tuple[float, float]  # stroke and rate of one device


def _holds(device: Device, u: float, v: float) -> bool:
    """Whether the present branch may go on from here."""
    for value, slack, growth in device.conditions(u, v):
        if value < -slack / 2:
            return False
        if value <= slack / 4 and not math.isnan(growth) and growth * v < -1e-12 * max(1.0, abs(growth)):
            return False
    return True


@dataclass
class Element:
    """One path of force between a left and a right vehicle (or a wall)."""

    left: int
    right: int  # -1: wall
    offset: float  # closing at which it begins
    sign: float = 1.0  # -1: it acts when the vehicles part
    share: float = 1.0  # 2: two equal devices, each of which takes half
    breaking: float = math.inf
    broken: bool = False
    lost: float = 0.0  # with what broke, or set free when the joint jumped [J]
    devices: list[Device] = field(default_factory=list)
    ends: list[float] = field(default_factory=list)  # strokes of the devices from which on nothing is known
    top: list[float] = field(default_factory=list)  # largest stroke of each device
    jumped: list[float] = field(default_factory=lambda: [0.0, 0.0])  # work of each device while the joint jumped [J]

    @property
    def extra(self) -> int:
        """How many lengths of its own it has: split of the joint, plungers."""
        return 1 + len(self.devices)

    def closing(self, u: float, v: float) -> Side:
        """Stroke and rate of the element from those of the interface."""
        return (self.sign * u - self.offset) / self.share, self.sign * v / self.share

    def sides(self, u: float, v: float, z: Array) -> list[Side]:
        """Stroke and rate of each device, of the element's own closing."""
        for device, plunger in zip(self.devices, z[1:], strict=True):
            if device.has_plunger and not device.carries():
                device.plunger = plunger
        if len(self.devices) == 1:
            return [(u, v)]
        u1, v1 = self._split(u, v, float(z[0]))
        return [(u1, v1), (u - u1, v - v1)]

    def force(self, sides: list[Side]) -> float:
        """What it pushes with [N]."""
        if self.broken:
            return 0.0
        # where only one depends on its rate, the joint's rate follows from the other one, which is exact
        k = 1 if len(sides) == 2 and self.devices[0].rated() and not self.devices[1].rated() else 0
        return self.devices[k].force(*sides[k])

    def rates(self, sides: list[Side]) -> list[float]:
        """Rates of its own lengths."""
        joint = sides[0][1] if len(sides) == 2 and self.carries() else 0.0
        return [joint, *(d.plunges() if d.has_plunger else 0.0 for d in self.devices)]

    def carries(self) -> bool:
        """Whether it is on a branch with force."""
        return not self.broken and any(d.carries() for d in self.devices)

    def free(self) -> float:
        """Closing at which its force begins."""
        return sum(d.free() for d in self.devices)

    def conditions(self, u: float, v: float, sides: list[Side]) -> Iterator[tuple[float, float]]:
        """What is not negative while its branches last, with the slack of each."""
        if self.broken:
            return
        if math.isfinite(self.breaking):
            yield self.breaking - self.force(sides), SLACK_N
        if len(self.devices) == 2 and not self.carries():
            yield self.free() - u, SLACK_M
            return
        relaxed = self._slack()
        if len(sides) == 2 and not relaxed:  # the joint must have a rate at which the forces agree
            forces = [d.force(*side) for d, side in zip(self.devices, sides, strict=True)]
            yield 2.0 + 2e-6 * abs(forces[0]) - abs(forces[0] - forces[1]), 1e-3
        if relaxed:
            yield self._excess(sides, v), 1e-9
        for device, (w, rate) in zip(self.devices, sides, strict=True):
            if relaxed and not (isinstance(device, Crush) and device.branch == "slack"):
                continue  # it waits where its force begins
            for value, slack, growth in device.conditions(w, rate):
                if not (relaxed and math.isnan(growth)):
                    yield value, slack

    def switch(self, u: float, v: float, z: Array, shrunk: bool) -> None:
        """Take the branches that go on from here; z is changed in place."""
        sides = self.sides(u, v, z)
        if len(sides) == 2 and self.carries() and not self._slack() and not any(d.rated() for d in self.devices):
            # what the integrator's tolerance has let the forces drift apart
            (a, b), ((u1, v1), (u2, v2)) = self.devices, sides
            k = a.slope(u1) + b.slope(u2)
            apart = (b.force(u2, v2) - a.force(u1, v1)) / k if k else 0.0
            if abs(apart) < 1e-9:
                sides = [(u1 + apart, v1), (u2 - apart, v2)]
        for device, side in zip(self.devices, sides, strict=True):
            device.settle(*side)
        if self.force(sides) >= self.breaking - 2 * SLACK_N:
            self.lost += self.share * self.devices[0].stored(u)
            self.broken = True
            return
        if len(self.devices) == 1:
            for _ in self.devices[0].branches(u, v, shrunk):
                if _holds(self.devices[0], u, v):
                    break
            else:
                raise EngineError(f"no branch goes on at {u} m, {v} m/s: {self.devices[0]}")
        else:
            self._switch_pair(u, v, z, sides, shrunk)
        for k, device in enumerate(self.devices):
            z[1 + k] = device.plunger

    # a pair

    def _split(self, u: float, v: float, u1: float) -> Side:
        a, b = self.devices
        if not self.carries():
            low, high = u - b.free(), a.free()
            return min(high, max(u1, low)), 0.0
        if self._slack():
            x1, x2 = u1 - a.free(), u - u1 - b.free()
            return u1, v * x1 / (x1 + x2) if x1 + x2 > 0.0 else 0.5 * v
        v1 = self._joint(u, v, u1)
        return u1, (0.0 if math.isnan(v1) else v1)

    def _joint(self, u: float, v: float, u1: float) -> float:
        """Rate of the joint on the present branches; nan if there is none."""
        a, b = self.devices
        if not a.rated() and not b.rated():
            k1, k2 = a.slope(u1), b.slope(u - u1)
            if k1 == k2 == 0.0:
                return 0.5 * v  # two plateaus: any split will do
            return v * k2 / (k1 + k2) if abs(k1 + k2) > 1e-9 * (abs(k1) + abs(k2)) else math.nan

        def unequal(w: float) -> float:
            return a.force(u1, w) - b.force(u - u1, v - w)

        reach = 2.0 * abs(v) + 1e-6
        while reach < 1e5:
            low, high = unequal(-reach), unequal(reach)
            if low <= 0.0 <= high:
                if low == high:
                    return math.nan
                return float(brentq(unequal, -reach, reach, xtol=1e-15, rtol=1e-14, maxiter=300))
            reach *= 4.0
        return math.nan

    def _slack(self) -> bool:
        return len(self.devices) == 2 and any(isinstance(d, Crush) and d.branch == "slack" for d in self.devices)

    def _excess(self, sides: list[Side], v: float) -> float:
        """How much faster than their dashpots allow two relaxed devices part."""
        rest = 0.0
        for device, (w, _) in zip(self.devices, sides, strict=True):
            if isinstance(device, Crush) and device.c > 0.0:
                rest -= device.k * max(0.0, w - device.p) / device.c
        return rest - v

    def _switch_pair(self, u: float, v: float, z: Array, sides: list[Side], shrunk: bool) -> None:
        a, b = self.devices
        carried = self.carries()
        u1 = sides[0][0]
        free = self.free()
        if u < free - SLACK_M or (u <= free + SLACK_M and v <= 0.0):
            z[0] = min(a.free(), max(u1, u - b.free()))
            for device in self.devices:
                device.release()
            return
        if not carried:
            u1, rates = a.free(), (0.5 * v, 0.5 * v)
        else:
            rates = (sides[0][1], sides[1][1])
        for _ in range(20):
            found = self._choose(u, v, u1, rates, shrunk)
            if found:
                z[0] = u1
                return
            u1 = self._jump(u, u1)
            if u < self.free() - SLACK_M:
                z[0] = min(a.free(), max(u1, u - b.free()))
                for device in self.devices:
                    device.release()
                return
        raise EngineError(f"the joint of a pair finds no place at {u} m, {v} m/s: {a}, {b}")

    def _choose(self, u: float, v: float, u1: float, rates: Side, shrunk: bool) -> bool:
        a, b = self.devices
        kept = [dict(vars(d)) for d in (a, b)]
        sets: list[list[dict[str, object]]] = []
        for device, w, rate, state in ((a, u1, rates[0], kept[0]), (b, u - u1, rates[1], kept[1])):
            there: list[dict[str, object]] = []
            for guess in (max(rate, 1e-9), min(rate, -1e-9)):
                for _ in device.branches(w, guess, shrunk):
                    if vars(device) not in there:
                        there.append(dict(vars(device)))
                device.__dict__.update(state)
            sets.append(there)
        # where no rate matters, the forces agree over a range of rates, at whose edges a branch with a rate fits too:
        # those come later, and last of all what has just failed
        failed = [(state["branch"], state.get("i")) for state in kept]
        pairs = [(state_a, state_b) for state_a in sets[0] for state_b in sets[1]]
        again = [pair for pair in pairs if [(state["branch"], state.get("i")) for state in pair] == failed]
        for some, rated in ((pairs, False), (pairs, True), (again, False), (again, True)):
            for pair in some:
                if some is pairs and pair in again:
                    continue
                for device, state in zip((a, b), pair, strict=True):
                    device.__dict__.update(state)
                if not (a.carries() and b.carries()) or self._slack() or (a.rated() or b.rated()) is not rated:
                    continue
                w1 = self._joint(u, v, u1)
                if math.isnan(w1):
                    continue
                f1, f2 = a.force(u1, w1), b.force(u - u1, v - w1)
                if abs(f1 - f2) > 1.0 + 1e-6 * abs(f1):
                    continue
                if _holds(a, u1, w1) and _holds(b, u - u1, v - w1):
                    return True
        for state_a in sets[0]:  # relaxed: both without force
            for state_b in sets[1]:
                a.__dict__.update(state_a)
                b.__dict__.update(state_b)
                if self._slack() and self._excess([(u1, 0.0), (u - u1, 0.0)], v) >= -1e-9:
                    return True
        for device, state in zip((a, b), kept, strict=True):
            device.__dict__.update(state)
        return False

    def _jump(self, u: float, u1: float) -> float:
        """Move the joint at constant stroke, one device inwards, the other one back, until the forces meet."""
        for inwards in (1, 0):
            kept = [dict(vars(d)) for d in self.devices]
            start = (u1, u - u1)
            s = self._march(start, inwards)
            if s > 0.0:
                return u1 - s if inwards == 1 else u1 + s
            for device, state in zip(self.devices, kept, strict=True):
                device.__dict__.update(state)
        a, b = self.devices
        raise EngineError(f"the joint of a pair cannot jump at {u} m: {u1}, {a}, {b}")

    def _march(self, start: Side, inwards: int) -> float:
        soft, other = self.devices[inwards], self.devices[1 - inwards]
        press, back = _presses(soft), _returns(other)
        far = 0.2
        steps = [np.geomspace(1e-11, 1e-5, 61), np.linspace(1e-5, far, 40_000)[1:]]
        ahead, s0, pressed, given = False, 0.0, 0.0, 0.0
        f0, g0 = press(start[inwards], True), back(start[1 - inwards])
        for s in np.concatenate(steps):
            f = press(start[inwards] + s, True)
            g = back(start[1 - inwards] - s)
            over = g - f
            if not ahead and over < -1e-3:
                return 0.0  # this one does not soften
            ahead = ahead or over > 1e-3
            if ahead and over <= 0.0:
                s = float(
                    brentq(lambda x: back(start[1 - inwards] - x) - press(start[inwards] + x, False), s0, s, xtol=1e-15)
                )
                break
            pressed += 0.5 * (f + f0) * (s - s0)
            given += 0.5 * (g + g0) * (s - s0)
            s0, f0, g0 = float(s), f, g
        else:
            return 0.0
        _put(soft, start[inwards] + s)
        _put(other, start[1 - inwards] - s)
        self.jumped[inwards] += pressed
        self.jumped[1 - inwards] -= given
        self.lost += self.share * (given - pressed)
        return s


def _presses(device: Device) -> Callable[[float, bool], float]:
    """Force without rate while a device is pressed on from where it is; states go along if moved."""

    def press(u: float, moves: bool) -> float:
        if isinstance(device, Crush):
            cap = device.curve.at(u)
            p = max(device.p, u - cap / device.k)
            if moves:
                device.p = p
            return max(0.0, device.k * (u - p))
        if isinstance(device, Hysteresis):
            w = u - device.body.p - device.slack
            q = max(device.q, w - device.loading.at(w) / device.k)
            if moves:
                device.q = q
            return device.k * (w - q)
        assert isinstance(device, Hydraulic)
        w = u - device.body.p - device.slack
        rest = device.gas(device.length) + device.stop * (w - device.length) if w > device.length else device.gas(w)
        return min(rest, device.body.collapse)

    return press


def _returns(device: Device) -> Callable[[float], float]:
    """Force without rate while a device goes back from where it is."""

    def back(u: float) -> float:
        if isinstance(device, Crush):
            return max(0.0, device.k * (u - device.p))
        if isinstance(device, Hysteresis):
            w = u - device.body.p - device.slack
            return max(device.unloading.at(w), device.k * (w - device.q))
        assert isinstance(device, Hydraulic)
        w = u - device.body.p - device.slack
        if w > device.length:
            return device.gas(device.length) + device.stop * (w - device.length)
        return device.gas(w) if device.rebound is not None else 0.0

    return back


def _put(device: Device, u: float) -> None:
    """Write down where a device is after a jump."""
    if isinstance(device, Crush):
        device.p = max(device.p, u - device.curve.at(u) / device.k)
        device.branch, device.i = "elastic", device.curve.segment(u)
    elif isinstance(device, Hysteresis):
        w = u - device.body.p - device.slack
        device.q = min(max(device.q, w - device.loading.at(w) / device.k), w - device.unloading.at(w) / device.k)
        device.branch = "stick"
    elif isinstance(device, Hydraulic):
        w = u - device.body.p - device.slack
        device.plunger = min(w, device.length)
        device.branch = "stop" if w > device.length else "pressed"
