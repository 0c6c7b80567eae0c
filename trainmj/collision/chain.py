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

from trainmj.collision.device import Device
from trainmj.collision.envelope import Array
from trainmj.collision.kind import Law
from trainmj.errors import InputError
from trainmj.units import G, rounded_down

WALL = -1
"""The vehicle on the right of an interface, where that is the rigid wall."""


@dataclass(frozen=True)
class Brake:
    """The brake of a vehicle.

    Attributes:
        force: when fully applied [N].
        delay: time at which it begins to act [s].
        rise: time that its force then takes to rise [s].
        most: what the rail can take of it by adhesion [N]; infinite for any.
    """

    force: float
    delay: float = 0.0
    rise: float = 0.0
    most: float = np.inf


@dataclass(frozen=True)
class Vehicle:
    """One vehicle: a body on a slide joint."""

    name: str  # its place: M1 leads the moving train, S1 is struck first
    kind: str  # what its train calls it
    mass: float  # [kg]
    length: float  # [m]
    speed: float  # initial speed along +x [m/s]
    rail_friction: float = 0.0  # Coulomb coefficient
    brake: Brake | None = None
    drawing: str = "passenger"  # what pictures show it as


@dataclass(frozen=True, eq=False)
class Element:
    """What acts between two vehicles, alone or beside other elements.

    Attributes:
        laws: one, or two in series: the left side's and the right side's.
        share: part of the stroke that it takes; a half where one law stands for two equal devices in series.
        sign: 1 where it pushes, -1 where it pulls.
        start: stroke of the interface, or extension, at which it engages [m].
        breaks: force at which it breaks for good [N].
        starts: of each law, the stroke of its device at which it engages [m].
        right_only: whether its one law is that of the right side alone.
    """

    laws: tuple[Law, ...]
    share: float = 1.0
    sign: float = 1.0
    start: float = 0.0
    breaks: float = np.inf
    starts: tuple[float, ...] = (0.0, 0.0)
    right_only: bool = False

    @property
    def n_places(self) -> int:
        """Records that it takes: two laws in series have one each, behind that of the pair."""
        return 1 if len(self.laws) == 1 else 3

    def law_of(self, side: int, two_sided: bool) -> int | None:
        """The place among its laws of that of a side (0 left, 1 right); None if it has none there."""
        if len(self.laws) > 1:
            return side
        if self.share < 1.0 or not two_sided:
            return 0
        return 0 if side == int(self.right_only) else None

    def bounds(self, fastest: float) -> tuple[float, float]:
        """Largest dF/du and dF/drate [N/m, N s/m] at up to a rate [m/s]."""
        found = [law.kind.bounds(law, fastest * self.share) for law in self.laws]
        if len(found) == 1:
            return self.share * found[0][0], self.share * found[0][1]
        (k, c), (other_k, other_c) = found
        if c and other_c:
            return max(k, other_k), c * other_c / (c + other_c)
        if c or other_c:  # a dashpot that locks leaves the spring of the other one
            return (other_k if c else k), 0.0
        return 1.0 / (1.0 / k + 1.0 / other_k), 0.0


@dataclass(frozen=True, eq=False)
class Interface:
    """What acts between two vehicles, or between one and the wall.

    Attributes:
        name: such as S1-M1, M1-M2.
        left: index of the vehicle on the left.
        right: index of the vehicle on the right, or WALL.
        elements: side by side; the first one acts from the first contact.
        devices: the device of the left side, and of the right side if it has its own.
        ends: names of the two sides, where each has its own device.
    """

    name: str
    left: int
    right: int
    elements: tuple[Element, ...]
    devices: tuple[Device, ...]
    ends: tuple[str, ...] = ()

    @property
    def sides(self) -> tuple[str, ...]:
        """What the sides that are reported are called: one for all, or both."""
        return self.ends or (self.name,)

    @property
    def two_sided(self) -> bool:
        """Whether both sides bring devices."""
        return len(self.devices) == 2

    @cached_property
    def unequal_sides(self) -> bool:
        """Whether both sides bring devices, and these differ."""
        return self.two_sided and not self.devices[0].is_like(self.devices[1])

    @property
    def is_shared(self) -> bool:
        """Whether one device stands between two vehicles, so that each side has half of its stroke."""
        return not self.two_sided and self.right != WALL

    @property
    def equal_sides(self) -> bool:
        """Whether both sides bring equal devices, so that one stands for both."""
        return self.two_sided and not self.unequal_sides

    @property
    def draws(self) -> bool:
        """Whether draw gear holds the two vehicles together."""
        return any(element.sign < 0.0 for element in self.elements)

    def bounds(self, fastest: float) -> tuple[float, float]:
        """Largest dF/du and dF/drate [N/m, N s/m] at up to a rate [m/s]: it pushes or it pulls."""
        sums = [
            np.sum([e.bounds(fastest) for e in self.elements if e.sign == sign] or [(0.0, 0.0)], axis=0)
            for sign in (1.0, -1.0)
        ]
        stiffness, damping = np.max(sums, axis=0)
        return float(stiffness), float(damping)


def meet(left: Device, right: Device | None = None, *, coupled: bool = True) -> tuple[Element, ...]:
    """The elements of an interface.

    Two equal devices in series act as one with half of the stroke each. Two different ones act in series, each with its
    own state. Where both have a stage behind a shear-off, there are two ways side by side, coupler with coupler and
    anti-climber with anti-climber, which meet at the sum of their starts whichever coupler has sheared.

    Args:
        left: the device of the left side, or of the whole interface.
        right: the device of the right side, if it has its own.
        coupled: whether the draw gear of the devices holds the vehicles together, as between those of a train.
    """
    pulls = [device.pull for device in (left, right) if device is not None and device.pull is not None]
    found: list[Element] = []
    if right is None:
        found.append(Element((left.law,)))
    elif left.is_like(right):
        found.append(Element((left.law,), share=0.5))
    else:
        n = min(left.n_paths, right.n_paths)
        found += [
            Element((a.law, b.law), start=a.start + b.start, starts=(a.start, b.start))
            for a, b in zip(left.paths(n), right.paths(n), strict=True)
        ]
    if coupled and pulls:
        start, breaks = sum(pull.slack for pull in pulls), min(pull.breaks for pull in pulls)
        laws = tuple(pull.law for pull in pulls)
        alike = len(laws) == 2 and laws[0].is_like(laws[1])
        found.append(
            Element(
                laws[:1] if alike else laws,
                0.5 if alike else 1.0,
                -1.0,
                start,
                breaks,
                right_only=left.pull is None,
            )
        )
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Chain:
    """Vehicles and interfaces of one collision, and how long to follow it.

    Attributes:
        vehicles: along +x.
        interfaces: interface k joins vehicles k and k + 1, the last one perhaps a vehicle and the wall.
        n_moving: how many vehicles, from the left, are the moving train.
        gap: distance between the two sides at the start [m].
        step: integration step [s].
        steps_per_record: steps from one recorded sample to the next.
        time_limit: [s].
        integrator: name of MuJoCo's integrator.
        grade: of the track, as the part of the weight that it takes; positive uphill along +x.
        refined: whether steps are made smaller at narrow parts of curves.
        steps_per_window: steps in a window over which device forces are averaged; 0 for none.
        limits: largest values that the scenario allows the moving train, by quantity or column of a response.
        obstacle: what stands fixed at the wall, as a vehicle; for pictures.
    """

    vehicles: tuple[Vehicle, ...]
    interfaces: tuple[Interface, ...]
    n_moving: int
    gap: float
    step: float
    steps_per_record: int
    time_limit: float
    integrator: str = "euler"
    grade: float = 0.0
    refined: bool = False
    steps_per_window: int = 0
    limits: Mapping[str, float] = field(default_factory=dict)
    obstacle: Vehicle | None = None

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

    @cached_property
    def records(self) -> tuple[tuple[tuple[int, ...], ...], ...]:
        """Of every interface and each of its elements, the places of its laws among the records of all elements.

        An element of one law has one record; two laws in series have one each, behind that of the pair.
        """
        at, found = 0, []
        for interface in self.interfaces:
            places = []
            for element in interface.elements:
                pair = len(element.laws) > 1
                places.append((at + 1, at + 2) if pair else (at,))
                at += element.n_places
            found.append(tuple(places))
        return tuple(found)

    @property
    def n_places(self) -> int:
        """Records that all its elements take."""
        return sum(element.n_places for interface in self.interfaces for element in interface.elements)

    @property
    def record_interval(self) -> float:
        """Time from one recorded sample to the next [s]."""
        return self.step * self.steps_per_record

    @property
    def window(self) -> float:
        """Length of a window over which device forces are averaged [s]; 0 for none."""
        return self.step * self.steps_per_window

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
        return np.asarray(np.array([v.rail_friction for v in self.vehicles]) * G * self.mass)

    @property
    def grade_force(self) -> Array:
        """(n_vehicle,) force of the grade along +x [N]."""
        return np.asarray(-self.mass * G * self.grade)

    @property
    def rolling(self) -> bool:
        """Whether vehicles that have come apart may come together again: by brakes, grade or unequal friction."""
        rails = {v.rail_friction for v in self.vehicles}
        return bool(self.grade or len(rails) > 1 or any(v.brake for v in self.vehicles))

    @cached_property
    def closing_speed(self) -> float:
        """Largest difference of the initial speeds [m/s]."""
        return float(np.ptp(self.speed)) if self.interfaces[-1].right != WALL else float(np.abs(self.speed).max())

    @property
    def stand_in_speed(self) -> float:
        """Speed at which what stands in for an orifice has its force [m/s]: half of the largest difference."""
        return 0.5 * self.closing_speed


def places_of_sides(chain: Chain) -> list[tuple[int, int]]:
    """Index of the interface and its side (0 left, 1 right), from the front backwards, the moving train first.

    At the front, equal sides are reported as one; elsewhere every device is.
    """
    front = chain.front
    inner = [(k, side) for k in range(front) for side in range(len(chain.interfaces[k].sides))]
    struck = [(front, side) for side in range(1, len(chain.interfaces[front].sides))]
    behind = [
        (k, side) for k in range(front + 1, len(chain.interfaces)) for side in range(len(chain.interfaces[k].sides))
    ]
    return [(front, 0), *inner[::-1], *struck, *behind]


def n_own_sides(chain: Chain) -> int:
    """How many of them are of the moving train."""
    return 1 + sum(len(interface.sides) for interface in chain.interfaces[: chain.front])


def order_of_vehicles(chain: Chain) -> list[int]:
    """Indices of the vehicles from the front backwards, the moving train first."""
    return [*range(chain.front, -1, -1), *range(chain.n_moving, len(chain.vehicles))]


def largest_step(chain: Chain) -> float:
    """Largest stable step of a chain [s].

    The semi-implicit Euler step with an explicit dashpot is stable where h2 K / 4 + h C / 2 < 1, K and C the matrices
    of stiffness and damping over mass with every interface at its stiffest. Gershgorin's circles around the rows of a
    chain turn that into a bound for each interface: its own two vehicles, both of them held by another one as stiff.
    For a single oscillator it is 2 (sqrt(1 + z2) - z) / w. What resists the speed, such as an orifice, is taken at the
    speed at which the two sides close.
    """
    steps = []
    mass = chain.mass
    for interface in chain.interfaces:
        inverse = 1.0 / mass[interface.left] + (1.0 / mass[interface.right] if interface.right >= 0 else 0.0)
        stiffness, damper = interface.bounds(chain.closing_speed)
        w2 = 2.0 * stiffness * inverse
        damping = damper * inverse  # half of 2 c / m
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
