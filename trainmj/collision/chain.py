"""The mechanical system behind a scenario: vehicles in line along the track, devices between them, all in SI.

Vehicles stand in the order of their position along +x: the last car of the moving train first, its head M1, then
the partner from its struck end, S1, S2 and so on. The stroke of an interface is how much closer its two
vehicles are than when they touch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from trainmj.collision.device import Array, Device, Envelope
from trainmj.errors import InputError
from trainmj.units import G, rounded_down

WALL = -1
"""The vehicle on the right of an interface, where that is the rigid wall."""

_TOUCH = 1e-9  # round-off of strokes [m]


@dataclass(frozen=True)
class Vehicle:
    """One vehicle: a body on a slide joint."""

    name: str  # its place: M1 leads the moving train, S1 is struck first
    kind: str  # what its train calls it
    mass: float  # [kg]
    length: float  # [m]
    speed: float  # initial speed along +x [m/s]


@dataclass(frozen=True, eq=False)
class Interface:
    """What acts between two neighbouring vehicles, or between the last one and the wall.

    Attributes:
        name: such as S1-M1, M1-M2.
        left: index of the vehicle on the left.
        right: index of the vehicle on the right, or WALL.
        envelope: the law of the whole interface.
        left_stroke: (n,) stroke of the left device [m] at each point of the envelope; the right device takes the rest.
        devices: the device of the left side, and of the right side if it has its own, as at the front.
    """

    name: str
    left: int
    right: int
    envelope: Envelope
    left_stroke: Array
    devices: tuple[Device, ...]

    @cached_property
    def equal_sides(self) -> bool:
        """Whether both sides bring equal devices, so that one stands for both."""
        if len(self.devices) == 1:
            return False
        left, right = self.devices
        return left.stages == right.stages and bool(np.array_equal(self.left_stroke, self.envelope.stroke / 2))

    @property
    def shown_share(self) -> float:
        """Part of stroke and energy that tables and figures show: one side's half where both are equal."""
        return 0.5 if self.equal_sides else 1.0

    def side_stroke(self, stroke: float, side: int) -> float:
        """Stroke of one side's device when the interface is compressed by stroke [m]; side 0 is left, 1 right."""
        u = self.envelope.stroke
        beyond = max(0.0, stroke - u[-1]) * self._left_share_beyond()
        left = float(np.interp(stroke, u, self.left_stroke)) + beyond
        return float(left if side == 0 else stroke - left)

    def _left_share_beyond(self) -> float:
        """Part of the stroke past the last point that the left device takes: all, where only its curve has ended."""
        if len(self.devices) == 1:
            return 1.0
        last = float(self.left_stroke[-1]), float(self.envelope.stroke[-1] - self.left_stroke[-1])
        left, right = (x > d.envelope.stroke[-1] - _TOUCH for x, d in zip(last, self.devices, strict=True))
        return 0.5 if left == right else float(left)


@dataclass(frozen=True, eq=False)
class Chain:
    """Vehicles and interfaces of one collision, and how long to follow it.

    Attributes:
        vehicles: along +x.
        interfaces: interface k joins vehicles k and k + 1, the last one perhaps a vehicle and the wall.
        n_moving: how many vehicles, from the left, are the moving train.
        gap: distance between the two sides at the start [m].
        rail_friction: Coulomb coefficient of every vehicle.
        step: integration step [s].
        steps_per_record: steps from one recorded sample to the next.
        time_limit: [s].
        integrator: name of MuJoCo's integrator.
        limits: largest values that the scenario allows the moving train, by quantity or column of a response.
    """

    vehicles: tuple[Vehicle, ...]
    interfaces: tuple[Interface, ...]
    n_moving: int
    gap: float
    rail_friction: float
    step: float
    steps_per_record: int
    time_limit: float
    integrator: str = "euler"
    limits: Mapping[str, float] = field(default_factory=dict)

    @property
    def front(self) -> int:
        """Index of the interface at which the two sides meet."""
        return self.n_moving - 1

    @cached_property
    def mass(self) -> Array:
        """(n_vehicle,) masses [kg]."""
        return np.array([v.mass for v in self.vehicles])

    @cached_property
    def speed(self) -> Array:
        """(n_vehicle,) initial speeds [m/s]."""
        return np.array([v.speed for v in self.vehicles])

    @property
    def start(self) -> Array:
        """(n_vehicle,) positions at the start, counted from where the two sides would touch [m]."""
        return np.where(np.arange(len(self.vehicles)) < self.n_moving, -self.gap, 0.0)

    @property
    def n_records(self) -> int:
        """Most samples that a run can record."""
        return int(np.ceil(self.time_limit / (self.step * self.steps_per_record) - 1e-9)) + 1

    def record_times(self, n: int) -> Array:
        """(n,) times of the first n samples of a run [s]."""
        return np.asarray(np.arange(n) * (self.step * self.steps_per_record))

    @property
    def friction(self) -> Array:
        """(n_vehicle,) largest rail friction [N]."""
        return self.rail_friction * G * self.mass


def largest_step(chain: Chain) -> float:
    """Largest stable step of a chain [s].

    The semi-implicit Euler step with an explicit dashpot is stable where h2 K / 4 + h C / 2 < 1, K and C the matrices
    of stiffness and damping over mass with every interface on its elastic branch. Gershgorin's circles around the rows
    of a chain turn that into a bound for each interface: its own two vehicles, both of them held by another one as
    stiff. For a single oscillator it is 2 (sqrt(1 + z2) - z) / w.
    """
    steps = []
    mass = chain.mass
    for interface in chain.interfaces:
        inverse = 1.0 / mass[interface.left] + (1.0 / mass[interface.right] if interface.right >= 0 else 0.0)
        w2 = 2.0 * interface.envelope.stiffness * inverse
        damping = interface.envelope.damping * inverse  # half of 2 c / m
        steps.append(float(2.0 / (damping + np.sqrt(damping**2 + w2))))
    return min(steps)


def check_step(chain: Chain) -> None:
    """Refuse a step at which the integration is not stable.

    Raises:
        InputError: naming the largest step.
    """
    limit = largest_step(chain)
    if chain.step > limit:
        raise InputError(
            f"simulation.step_ms = {chain.step * 1e3:.12g}: must be at most {rounded_down(limit * 1e3, 3)} ms for the "
            "stiffness and damping of these devices and the mass of these vehicles, or the integration is unstable"
        )
