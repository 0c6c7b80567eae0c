"""The mechanical system behind a scenario: vehicles in line along the track, devices between them, all in SI.

Vehicles stand in the order of their position along +x: the last car of the moving train first, its head M1, then
the partner from its struck end, S1, S2 and so on. The stroke of an interface is how much closer its two
vehicles are than when they touch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from trainmj.collision.body import Body, Member, Point, members_of, nearest, points_of
from trainmj.collision.device import Device, Path
from trainmj.collision.envelope import Array
from trainmj.collision.gear import N_DOF, N_WHEELSET, Gear
from trainmj.collision.kind import Law
from trainmj.collision.line import Line, LineEnd
from trainmj.symbol import largest, least
from trainmj.units import KN, G

_SWINGS = 2.0  # longest periods of its bodies that a chain is followed after its last force

_HEAVES = 0.5  # likewise, slowest periods of its vehicles on their suspensions

EVENTS = "events"
"""The integrator that follows devices through what happens to them within a step; its steps are those of euler."""

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
    """One vehicle: a mass that slides, several where its body gives, or in the vertical plane a body on its gear."""

    name: str  # its place: M1 leads the moving train, S1 is struck first
    kind: str  # what its train calls it
    mass: float  # [kg]
    length: float  # [m]
    speed: float  # initial speed along +x [m/s]
    rail_friction: float = 0.0  # Coulomb coefficient
    brake: Brake | None = None
    drawing: str = "passenger"  # what pictures show it as
    body: Body | None = None  # if it gives
    gear: Gear | None = None  # what it stands on, in the vertical plane


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
        line: along which it acts, in the vertical plane.
    """

    laws: tuple[Law, ...]
    share: float = 1.0
    sign: float = 1.0
    start: float = 0.0
    breaks: float = np.inf
    starts: tuple[float, ...] = (0.0, 0.0)
    right_only: bool = False
    line: Line | None = None

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
            return largest([k, other_k]), c * other_c / (c + other_c)
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

    def paths(self, side: int) -> tuple[Path, ...]:
        """The ways through the device of a side (0 left, 1 right), each of them in an element that pushes."""
        n = sum(element.sign > 0.0 for element in self.elements)
        return self.devices[side].paths(n, idle=not self.unequal_sides)

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
        (k, c), (pulled_k, pulled_c) = (both.tolist() for both in sums)
        return largest([k, pulled_k]), largest([c, pulled_c])


def meet(
    left: Device, right: Device | None = None, *, coupled: bool = True, lines: tuple[Line, ...] = ()
) -> tuple[Element, ...]:
    """The elements of an interface.

    Two equal devices in series act as one with half of the stroke each. Two different ones act in series, each with its
    own state. Where both have a stage behind a shear-off, there are two ways side by side, coupler with coupler and
    anti-climber with anti-climber, which meet at the sum of their starts whichever coupler has sheared. In the vertical
    plane these ways are apart for equal devices and for a single one as well, each along its own line; draw gear acts
    along the first.

    Args:
        left: the device of the left side, or of the whole interface.
        right: the device of the right side, if it has its own.
        coupled: whether the draw gear of the devices holds the vehicles together, as between those of a train.
        lines: in the vertical plane, that of each path; otherwise none.
    """
    pulls = [device.pull for device in (left, right) if device is not None and device.pull is not None]
    found: list[Element] = []
    if right is None or left.is_like(right):
        share = 1.0 if right is None else 0.5
        found += [
            Element((path.law,), share, start=path.start / share, starts=(path.start, path.start), line=line)
            for path, line in zip(left.paths(len(lines) or 1, idle=True), lines or (None,), strict=True)
        ]
    else:
        n = len(lines) or min(left.n_paths, right.n_paths)
        found += [
            Element((a.law, b.law), start=a.start + b.start, starts=(a.start, b.start), line=line)
            for a, b, line in zip(left.paths(n), right.paths(n), lines or n * (None,), strict=True)
        ]
    if coupled and pulls:
        start, breaks = sum(pull.slack for pull in pulls), least(pull.breaks for pull in pulls)
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
                line=lines[0] if lines else None,
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
        integrator: as the scenario names it.
        grade: of the track, as the part of the weight that it takes; positive uphill along +x.
        refined: whether steps are made smaller at narrow parts of curves.
        steps_per_window: steps in a window over which device forces are averaged; 0 for none.
        contact_threshold: net force of its devices above which a vehicle is in contact [N].
        limits: largest values that the scenario allows the train under test, by quantity or column of a response.
        sources: where values of the scenario come from, in words, by their paths.
        twin: whether the partner is the same train, whose devices are judged as those of the moving one.
        obstacle: what stands fixed at the wall, as a vehicle; for pictures.
        free_flights: distances over which occupants fly freely, rising [m].
        plane: whether vehicles move in the vertical plane, and not only along the track.
        flattened: whether they do not, and the scenario states what has an effect there only.
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
    contact_threshold: float = KN
    limits: Mapping[str, float] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    twin: bool = False
    obstacle: Vehicle | None = None
    free_flights: tuple[float, ...] = ()
    plane: bool = False
    flattened: bool = False

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
    def follows(self) -> bool:
        """Whether devices are followed through what happens to them within a step."""
        return self.integrator == EVENTS

    @cached_property
    def points(self) -> tuple[Point, ...]:
        """The point masses of all vehicles, in their order: one each, and several where a body gives."""
        return tuple(
            point
            for i, v in enumerate(self.vehicles)
            for point in points_of(v.name, i, v.mass, v.length, v.body, self.facing(i))
        )

    @cached_property
    def members(self) -> tuple[Member, ...]:
        """The members of all bodies that give, and the links of their bogies."""
        return tuple(
            replace(member, left=self.first[i] + member.left, right=self.first[i] + member.right)
            for i, v in enumerate(self.vehicles)
            if v.body is not None
            for member in members_of(v.name, i, v.mass, v.length, v.body, self.facing(i))
        )

    @cached_property
    def first(self) -> tuple[int, ...]:
        """(n_vehicle + 1,) index of the first point of each vehicle, and the number of points."""
        n = [0] * len(self.vehicles)
        for point in self.points:
            n[point.vehicle] += 1
        return tuple(int(place) for place in np.cumsum([0, *n]))

    def points_of(self, vehicle: int) -> slice:
        """The points of a vehicle."""
        return slice(self.first[vehicle], self.first[vehicle + 1])

    def edge(self, vehicle: int, end: int) -> int:
        """The point at the left end (0) or the right end (1) of a vehicle."""
        body = self.vehicles[vehicle].body
        return self.first[vehicle] + (body.n_members if body and end else 0)

    def ends(self, interface: Interface) -> tuple[int, int]:
        """The points at which the devices of an interface are attached, or WALL."""
        left, right = interface.left, interface.right
        return self._attached(left, 1), WALL if right == WALL else self._attached(right, 0)

    def _attached(self, vehicle: int, end: int) -> int:
        """The point of a vehicle at which the devices of its left end (0) or right end (1) are attached."""
        v, first = self.vehicles[vehicle], self.first[vehicle]
        if v.body is None:
            return first
        inward = v.body.attached[end]
        return first + nearest(v.body, v.length, v.length - inward if end else inward)

    @cached_property
    def point_mass(self) -> Array:
        """(n_point,) masses [kg]."""
        return np.array([point.mass for point in self.points])

    @cached_property
    def vehicle_of(self) -> Array:
        """(n_point,) index of the vehicle of each point."""
        return np.array([point.vehicle for point in self.points])

    @property
    def point_speed(self) -> Array:
        """(n_point,) initial speeds [m/s]."""
        return np.asarray(self.speed[self.vehicle_of])

    @cached_property
    def first_dof(self) -> tuple[int, ...]:
        """(n_vehicle + 1,) first degree of freedom of each vehicle in the vertical plane, and how many there are."""
        counts = [1 if v.gear is None else N_DOF for v in self.vehicles]
        return tuple(int(place) for place in np.cumsum([0, *counts]))

    def start_dofs(self, vehicle: int) -> Array:
        """(1,) or (11,) degrees of freedom of a vehicle in the plane at the start."""
        x, gear = self.start[vehicle], self.vehicles[vehicle].gear
        if gear is None:
            return np.array([x])
        q = gear.standing.q.copy()
        q[0] = x
        return q

    @property
    def start_qpos(self) -> Array:
        """(n_point,) positions at the start; in the vertical plane all degrees of freedom of all vehicles."""
        return np.concatenate([self.start_dofs(i) for i in range(len(self.vehicles))]) if self.plane else self.start

    @property
    def start_qvel(self) -> Array:
        """Their rates."""
        if not self.plane:
            return self.point_speed
        rates = np.zeros(self.first_dof[-1])
        rates[list(self.first_dof[:-1])] = self.speed
        return rates

    def end_arms(self, vehicle: int) -> tuple[float, float]:
        """From the centre of gravity of the body of a vehicle to its left and right end along +x [m]."""
        v = self.vehicles[vehicle]
        middle = 0.0 if v.gear is None else v.gear.cog_x
        return -0.5 * v.length - middle, 0.5 * v.length - middle

    def rise_at_start(self, vehicle: int) -> float:
        """How much higher the right end of a vehicle on bogies stands at the start than designed [m]."""
        gear = self.vehicles[vehicle].gear
        return 0.0 if gear is None else gear.offset + self.end_arms(vehicle)[1] * math.sin(gear.pitch)

    def point_of_line(self, vehicle: int, end: int, line: LineEnd) -> tuple[float, float]:
        """Where a line acts on the left end (0) or the right end (1) of a vehicle, its pin or its face.

        Returns:
            From the centre of gravity of the body, along the body towards +x and upwards [m]; of what only slides, from
            its middle on the rail.
        """
        left, right = self.end_arms(vehicle)
        return right - line.pin if end else left + line.pin, line.height - self.cog_height(vehicle)

    def cog_height(self, vehicle: int) -> float:
        """Design height of the centre of gravity of the body of a vehicle [m]; 0 of what only slides."""
        gear = self.vehicles[vehicle].gear
        return 0.0 if gear is None else gear.cog_height

    @cached_property
    def wheelsets(self) -> tuple[tuple[int, int], ...]:
        """(n_wheelset,) vehicle and number of each wheelset, left to right; none where vehicles only slide."""
        return tuple(
            (i, k) for i, v in enumerate(self.vehicles) if self.plane and v.gear is not None for k in range(N_WHEELSET)
        )

    def name_of_wheelset(self, vehicle: int, number: int) -> str:
        """Name of a wheelset, which is numbered left to right here and from the end that faces the impact there."""
        return f"{self.vehicles[vehicle].name} wheelset {N_WHEELSET - number if self.facing(vehicle) else number + 1}"

    def name_of_bogie(self, vehicle: int, number: int) -> str:
        """Likewise of a bogie."""
        return f"{self.vehicles[vehicle].name} bogie {2 - number if self.facing(vehicle) else number + 1}"

    def load(self, wheelset: int) -> float:
        """Load of a wheelset at rest [N]."""
        vehicle, number = self.wheelsets[wheelset]
        gear = self.vehicles[vehicle].gear
        assert gear is not None
        return float(gear.standing.load[number])

    @cached_property
    def lines(self) -> tuple[Line, ...]:
        """(n_line,) the lines of all elements in the vertical plane, in their order."""
        found = (element.line for interface in self.interfaces for element in interface.elements)
        return tuple(line for line in found if line is not None) if self.plane else ()

    def lines_of(self, interface: int) -> slice:
        """The lines of an interface."""
        counts = [len(i.elements) for i in self.interfaces[: interface + 1]]
        return slice(sum(counts[:-1]), sum(counts))

    @property
    def start(self) -> Array:
        """(n_point,) positions at the start, counted from where the two sides would touch [m]."""
        return np.where(self.vehicle_of < self.n_moving, -self.gap, 0.0)

    def facing(self, vehicle: int) -> int:
        """The end of a vehicle that faces the impact: 0 left, 1 right."""
        return int(vehicle < self.n_moving)

    def points_inward(self, vehicle: int) -> list[int]:
        """The points of the body of a vehicle from the end that faces the impact; bogies are last; none if rigid."""
        if self.vehicles[vehicle].body is None:
            return []
        return sorted(range(*self.points_of(vehicle).indices(len(self.points))), key=lambda i: self.points[i].order)

    def members_of(self, vehicle: int) -> list[int]:
        """The members of the body of a vehicle from left to right, without the links of its bogies."""
        return [k for k, member in enumerate(self.members) if member.vehicle == vehicle and member.span]

    def members_inward(self, vehicle: int) -> list[int]:
        """The members of its body from the end that faces the impact; links of bogies are last."""
        found = [k for k, member in enumerate(self.members) if member.vehicle == vehicle]
        return sorted(found, key=lambda k: self.members[k].order)

    def of_vehicles(self, values: Array) -> Array:
        """Values of points (..., n_point) as those of the centres of mass of their vehicles (..., n_vehicle)."""
        if not self.members:
            return values
        found = np.empty((*values.shape[:-1], len(self.vehicles)))
        for i, mass in enumerate(self.mass):
            first, end = self.first[i], self.first[i + 1]
            if end - first == 1:
                found[..., i] = values[..., first]
                continue
            total = 0.0
            for p in range(first, end):  # one after the other, as the compiled law adds them up
                total = total + self.point_mass[p] * values[..., p]
            found[..., i] = total / mass
        return found

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
    def carried(self) -> Array:
        """(n_point,) share of the weight of its vehicle that the wheels of each point carry."""
        return np.array([point.carried for point in self.points])

    @property
    def friction(self) -> Array:
        """(n_point,) largest rail friction [N]."""
        of_vehicles = np.array([v.rail_friction for v in self.vehicles]) * G * self.mass
        return np.asarray(of_vehicles[self.vehicle_of] * self.carried)

    @property
    def grade_force(self) -> Array:
        """(n_point,) force of the grade along +x [N]."""
        return np.asarray(-self.point_mass * G * self.grade)

    @property
    def rolling(self) -> bool:
        """Whether vehicles that have come apart may come together again: by brakes, grade or unequal friction."""
        first, *others = (v.rail_friction for v in self.vehicles)
        return bool(self.grade or any(rail != first for rail in others) or any(v.brake for v in self.vehicles))

    @property
    def linger(self) -> float:
        """How long nothing may touch before a collision is over [s]: what swings or pitches may touch or lift later."""
        swings = [_SWINGS / v.body.frequency(v.mass) for v in self.vehicles if v.body is not None]
        swings += [
            _HEAVES / min(v.gear.frequencies.values()) for v in self.vehicles if self.plane and v.gear is not None
        ]
        return largest(swings) if swings else 0.0

    @cached_property
    def closing_speed(self) -> float:
        """Largest difference of the initial speeds [m/s]."""
        speeds = [v.speed for v in self.vehicles]
        return largest(speeds) - least(speeds) if self.interfaces[-1].right != WALL else largest(map(abs, speeds))

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


def names_in_runs(names: Sequence[str]) -> str:
    """Names of vehicles, those that follow one another as a range: M1 to M6, S1."""
    runs: list[list[str]] = []
    for name in names:
        if runs and (runs[-1][-1][0], int(runs[-1][-1][1:]) + 1) == (name[0], int(name[1:])):
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(run[0] if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in runs)
