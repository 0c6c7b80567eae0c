"""The same collision by other means: scipy's solve_ivp from switch to switch, without any code of the device law.

The law of docs/physics.md makes a hybrid system. Each interface is on one of five branches and each vehicle slides or
sticks; between two switches every force is a linear function of strokes and rates, so the motion is y' = A y + b. A
branch is left when one of its conditions, rows of G y + h >= 0, fails; DOP853 finds that moment by event location.

Nothing here calls the device law, compiled or not: a chain is taken as plain numbers (masses, speeds, curve points,
stiffnesses, dashpots, friction), and only :meth:`_Joint.force`, ``conditions`` and ``leave`` say what a device does.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from scipy.integrate import solve_ivp

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array, Envelope
from trainmj.errors import EngineError

_SLACK_M, _SLACK_M_S, _SLACK_N = 1e-12, 1e-11, 1e-3
"""How far a condition may be broken before its branch is left, so that what rests at a boundary rests."""

_LONGEST = 1e-3
"""Longest step [s]: what fails and holds again within one is not seen."""

_SAMPLE = 5e-5  # peaks between switches are looked for this often [s]


@dataclass(frozen=True, eq=False)
class Solution:
    """What an independent solution found; vehicles and interfaces in the order of the chain."""

    stroke: Array  # (n_interface,) largest strokes [m]
    force: Array  # (n_interface,) largest forces [N]
    acceleration: Array  # (n_vehicle,) largest |acceleration| by the devices alone [m/s2]
    speed: Array  # (n_vehicle,) at the end [m/s]
    switches: int  # how many times a branch was left


class Branch(Enum):
    """What an interface does."""

    FREE = auto()  # apart, or less compressed than its permanent set
    ELASTIC = auto()  # spring and dashpot
    SLACK = auto()  # the dashpot would pull, so there is no force
    CAPPED = auto()  # spring and dashpot would pass the envelope, the spring alone would not
    CRUSHING = auto()  # on the envelope, its permanent set growing


Line = tuple[float, float, float]
"""Coefficients (a, b, d) of a + b stroke + d rate."""


class _Joint:
    """An interface: its curve and constants, and where on them it is."""

    def __init__(self, envelope: Envelope) -> None:
        self.u, self.f = envelope.stroke.tolist(), envelope.force.tolist()
        self.k, self.c = envelope.stiffness, envelope.damping
        self.plastic = 0.0
        self.segment = 0
        self.branch = Branch.FREE

    def slope(self) -> float:
        """Of the segment it is on [N/m]."""
        i = self.segment
        return (self.f[i + 1] - self.f[i]) / (self.u[i + 1] - self.u[i]) if i + 1 < len(self.u) else 0.0

    def spring(self) -> Line:
        """Force of the spring alone."""
        return -self.k * self.plastic, self.k, 0.0

    def envelope(self) -> Line:
        """Force of the curve, on the segment it is on."""
        i, slope = self.segment, self.slope()
        return self.f[i] - slope * self.u[i], slope, 0.0

    def force(self) -> Line:
        """Force on the present branch."""
        if self.branch in (Branch.FREE, Branch.SLACK):
            return 0.0, 0.0, 0.0
        if self.branch is Branch.ELASTIC:
            return -self.k * self.plastic, self.k, self.c
        return self.envelope()

    def conditions(self) -> Iterator[tuple[Line, float]]:
        """Lines that are not negative while the present branch lasts, and the slack of each."""
        a, b, _ = self.spring()
        e, s, _ = self.envelope()
        if self.branch not in (Branch.FREE, Branch.SLACK) and self.segment + 1 < len(self.u):
            yield (self.u[self.segment + 1], -1.0, 0.0), _SLACK_M
        if self.branch is Branch.FREE:
            yield (self.plastic, -1.0, 0.0), _SLACK_M
        elif self.branch is Branch.SLACK:
            yield (-a, -b, -self.c), _SLACK_N
            yield (-self.plastic, 1.0, 0.0), _SLACK_M
        elif self.branch is Branch.ELASTIC:
            yield (-self.u[self.segment], 1.0, 0.0), _SLACK_M
            yield (a, b, self.c), _SLACK_N
            yield (e - a, s - b, -self.c), _SLACK_N
        elif self.branch is Branch.CAPPED:
            yield (a - e, b - s, self.c), _SLACK_N
            yield (e - a, s - b, 0.0), _SLACK_N
        else:
            yield (0.0, 0.0, 1.0), _SLACK_M_S

    def leave(self, u: float, rate: float) -> None:
        """Change to the branch that goes on from a stroke and rate at which a condition has failed."""
        if self.branch is Branch.CRUSHING:
            self.plastic = u - at(self.envelope(), u) / self.k
        self.segment = max(0, bisect_right(self.u, u) - 1)
        spring, crush = at(self.spring(), u), at(self.envelope(), u)
        if rate >= 0.0 and spring >= crush - 2 * _SLACK_N and u >= self.plastic:
            self.plastic, spring = max(self.plastic, u - crush / self.k), min(spring, crush)
            if self.slope() <= self.k:
                self.branch = Branch.CRUSHING
                return
        total = spring + self.c * rate
        if u < self.plastic or (u <= self.plastic + _SLACK_M and rate <= 0.0):
            self.branch = Branch.FREE
        elif total < 0.0:
            self.branch = Branch.SLACK
        else:
            self.branch = Branch.CAPPED if total > crush + _SLACK_N / 4 else Branch.ELASTIC


def at(line: Line, u: float, rate: float = 0.0) -> float:
    """Value of a line."""
    return line[0] + line[1] * u + line[2] * rate


def closing(chain: Chain) -> Array:
    """(n_interface, n_vehicle) what makes strokes of positions, and rates of speeds."""
    shape = len(chain.interfaces), len(chain.vehicles)
    return np.eye(*shape) - np.eye(*shape, k=1)  # the last interface may have the wall on its right


class _System:
    """All vehicles and interfaces of a chain as plain numbers, and the linear motion between two switches."""

    def __init__(self, chain: Chain) -> None:
        self.n, self.mass = len(chain.vehicles), chain.mass
        self.closing = closing(chain)
        self.joints = [_Joint(interface.envelope) for interface in chain.interfaces]
        self.grip = chain.friction
        self.way = np.where(self.grip > 0.0, np.sign(chain.speed), 0.0)  # in which a vehicle slides; 0 sticks or free

    def linear(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """(A, b) of the motion y' = A y + b, (G, h) of its conditions, (P, q) of the device forces P y + q."""
        n, d = self.n, self.closing
        a, b, c = np.array([j.force() for j in self.joints]).T
        P = np.hstack([b[:, None] * d, c[:, None] * d])
        push, base = -d.T @ P, -d.T @ a  # on the vehicles
        rows, least = [], []
        for k, joint in enumerate(self.joints):
            for (at_rest, per_stroke, per_rate), slack in joint.conditions():
                rows.append(np.concatenate([per_stroke * d[k], per_rate * d[k]]))
                least.append(at_rest + slack)
        A, b_ = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
        A[:n, n:] = np.eye(n)
        A[n:], b_[n:] = push / self.mass[:, None], (base - self.way * self.grip) / self.mass
        for i in np.flatnonzero(self.grip > 0.0):
            if self.way[i]:
                row = np.zeros(2 * n)
                row[n + i] = self.way[i]
                rows.append(row)
                least.append(_SLACK_M_S)
            else:
                A[[i, n + i]], b_[n + i] = 0.0, 0.0
                rows += [push[i], -push[i]]
                least += [self.grip[i] + _SLACK_N + base[i], self.grip[i] + _SLACK_N - base[i]]
        return A, b_, np.array(rows), np.array(least), P, a

    def switch(self, y: Array) -> int:
        """Leave every branch whose condition fails, until none does; how many were left."""
        n, left = self.n, 0
        for _ in range(100):
            u, rate = self.closing @ y[:n], self.closing @ y[n:]
            failed = [
                k
                for k, joint in enumerate(self.joints)
                if any(at(line, u[k], rate[k]) < -slack / 2 for line, slack in joint.conditions())
            ]
            for k in failed:
                self.joints[k].leave(float(u[k]), float(rate[k]))
            force = np.array([at(j.force(), x, v) for j, x, v in zip(self.joints, u, rate, strict=True)])
            net = -self.closing.T @ force
            slips = self._slip(y[n:], net)
            left += len(failed) + slips
            if not failed and not slips:
                return left
        raise EngineError(f"the independent solution does not come past a switch at {y}")

    def _slip(self, speed: Array, net: Array) -> int:
        """Let vehicles stick that have stopped, and slide that are pushed harder than the rails hold."""
        stopped = (self.way != 0.0) & (self.way * speed < -_SLACK_M_S / 2)
        stuck = (self.grip > 0.0) & (self.way == 0.0)
        held = np.abs(net) <= self.grip
        freed = (stuck & (np.abs(net) > self.grip + _SLACK_N / 2)) | (stopped & ~held)
        halted = stopped & held
        self.way[freed] = np.sign(net[freed])
        self.way[halted] = 0.0
        speed[stopped] = 0.0  # in place: from here on it stands, or starts the other way
        return int(np.count_nonzero(freed | halted))


def solve(chain: Chain, until: float) -> Solution:
    """Follow a collision from the start to a given time [s]; the chain's step and integrator are not used.

    Raises:
        EngineError: if the integration fails.
    """
    system = _System(chain)
    n = system.n
    y = np.concatenate([chain.start, chain.speed])
    stroke, peak = np.zeros(len(system.joints)), np.zeros(len(system.joints))
    acceleration = np.zeros(n)
    t, switches = 0.0, 0
    while True:
        switches += system.switch(y)
        A, b, G, h, P, q = system.linear()

        def motion(_: float, y: Array, A: Array = A, b: Array = b) -> Array:
            return A @ y + b

        def holds(_: float, y: Array, G: Array = G, h: Array = h) -> float:
            return float((G @ y + h).min())

        holds.terminal, holds.direction = True, -1  # type: ignore[attr-defined]
        # a first sample on the new branch, then evenly up to the next switch
        times = np.linspace(t, until, 2 + int((until - t) / _SAMPLE))
        found = solve_ivp(
            motion, (t, until), y, "DOP853", times, events=holds, max_step=_LONGEST, rtol=1e-9, atol=1e-13
        )
        if found.status < 0:
            raise EngineError(f"the independent solution stopped at {t} s: {found.message}")
        ended = found.status == 0
        last = found.y[:, -1] if ended else found.y_events[0][-1]
        states = np.column_stack([y, found.y, last])
        force = P @ states + q[:, None]
        stroke = np.maximum(stroke, (system.closing @ states[:n]).max(axis=1))
        peak = np.maximum(peak, force.max(axis=1))
        acceleration = np.maximum(acceleration, np.abs(system.closing.T @ force).max(axis=1) / system.mass)
        if ended:
            return Solution(stroke, peak, acceleration, last[n:].copy(), switches)
        t, y = float(found.t_events[0][-1]), last.copy()
