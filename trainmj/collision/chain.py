"""The mechanical system behind a scenario: vehicles in line along the track, devices between them, all in SI.

Vehicles stand in the order of their position along +x: the last car of the moving train first, its head M1, then
the partner from its struck end, S1, S2 and so on. The stroke of an interface is how much closer its two
vehicles are than when they touch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from trainmj.collision.device import Array, Device, Envelope, work_along
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
        strokes: of each device, (n,) its stroke [m] at each point of the envelope; they add up to the envelope's, but
            for points that a pair passes as it snaps.
        devices: the device of the left side, and of the right side if it has its own, as at the front.
    """

    name: str
    left: int
    right: int
    envelope: Envelope
    strokes: tuple[Array, ...]
    devices: tuple[Device, ...]

    @cached_property
    def equal_sides(self) -> bool:
        """Whether both sides bring equal devices, so that one stands for both."""
        return len(self.devices) == 2 and not self.unequal_sides

    @cached_property
    def unequal_sides(self) -> bool:
        """Whether both sides bring devices, and these differ."""
        left, right = self.devices[0], self.devices[-1]
        return left.stages != right.stages or not left.envelope.is_like(right.envelope)

    def side_stroke(self, stroke: Any, side: int) -> Any:
        """Stroke of one side's device as the interface is first compressed by a stroke, or strokes (n,) [m].

        Side 0 is left, 1 right.
        """
        if not self.unequal_sides:
            return stroke / len(self.devices)
        u = self.envelope.stroke
        return np.interp(stroke, u, self.strokes[side]) + np.maximum(0.0, stroke - u[-1]) * self._beyond[side]

    def side_largest(self, stroke: float, side: int) -> float:
        """Largest stroke of one side's device [m] up to one of the interface: it springs back where the other drops."""
        if not self.unequal_sides:
            return stroke / len(self.devices)
        passed = self.strokes[side][: np.searchsorted(self.envelope.stroke, stroke, side="right")]
        return max(float(self.side_stroke(stroke, side)), float(passed.max(initial=0.0)))

    def side_history(self, stroke: Array, side: int) -> Array:
        """(n,) strokes of one side's device, from those of the interface over time (n,) [m].

        What the interface gives back its sides share as their stiffnesses say, and a gap between them equally.
        """
        if not self.unequal_sides:
            return stroke / len(self.devices)
        path, k = self.envelope.climbing, self.envelope.stiffness
        largest = np.maximum.accumulate(np.maximum(stroke, 0.0))
        back = largest - stroke
        sprung = np.minimum(back, np.interp(largest, path.stroke, path.force) / k)
        own = sprung * k / self.devices[side].envelope.stiffness
        return np.asarray(self.side_stroke(largest, side) - own - 0.5 * (back - sprung))

    def energy_shares(self, stroke: Array) -> tuple[Array, ...]:
        """For each side, (n,) parts of the absorbed energy that its device has taken, by strokes over time (n,) [m].

        That is the work on it up to the largest stroke so far less what it gives back, along the path of first loading.
        What a pair sets free as it snaps is in neither part.
        """
        if not self.unequal_sides:
            return (np.full_like(stroke, 1 / len(self.devices)),) * len(self.devices)
        e = self.envelope
        largest = np.maximum.accumulate(np.maximum(stroke, 0.0))
        k = np.searchsorted(e.stroke, largest, side="right") - 1
        force = np.array([e.force_at(float(u)) for u in largest])

        def absorbed(points: Array, at: Array, stiffness: float) -> Array:
            work = work_along(points, e.force)[k] + 0.5 * (e.force[k] + force) * (at - points[k])
            return np.asarray(work - 0.5 * force**2 / stiffness)

        whole = absorbed(e.stroke, largest, e.stiffness)
        return tuple(
            np.clip(np.divide(own, whole, out=np.full_like(own, 0.5), where=whole > 0), 0.0, 1.0)
            for own in (
                absorbed(points, self.side_stroke(largest, side), device.envelope.stiffness)
                for side, (points, device) in enumerate(zip(self.strokes, self.devices, strict=True))
            )
        )

    @cached_property
    def _beyond(self) -> tuple[float, ...]:
        """Parts of the stroke past the last point that the devices take: all, where only its curve has ended."""
        ended = [
            points[-1] > device.envelope.climbing.stroke[-1] - _TOUCH
            for points, device in zip(self.strokes, self.devices, strict=True)
        ]
        return tuple(1 / len(ended) if all(ended) or not any(ended) else float(end) for end in ended)


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
    def record_interval(self) -> float:
        """Time from one recorded sample to the next [s]."""
        return self.step * self.steps_per_record

    @property
    def n_records(self) -> int:
        """Most samples that a run can record."""
        return int(np.ceil(self.time_limit / self.record_interval - 1e-9)) + 1

    def record_times(self, n: int) -> Array:
        """(n,) times of the first n samples of a run [s]."""
        return np.asarray(np.arange(n) * self.record_interval)

    @property
    def friction(self) -> Array:
        """(n_vehicle,) largest rail friction [N]."""
        return self.rail_friction * G * self.mass


def places_of_sides(chain: Chain) -> list[tuple[int, int]]:
    """Index of the interface and its side (0 left, 1 right), from the front backwards, the moving train first."""
    front = chain.front
    partner = [(front, 1)] * chain.interfaces[front].unequal_sides
    return [(k, 0) for k in range(front, -1, -1)] + partner + [(k, 0) for k in range(front + 1, len(chain.interfaces))]


def order_of_vehicles(chain: Chain) -> list[int]:
    """Indices of the vehicles from the front backwards, the moving train first."""
    return [*range(chain.front, -1, -1), *range(chain.n_moving, len(chain.vehicles))]


def name_of_side(interface: Interface, side: int) -> str:
    """What a side of an interface is called: the partner's side of an unequal front is "S1-M1 partner"."""
    return interface.name + (" partner" if side else "")


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
