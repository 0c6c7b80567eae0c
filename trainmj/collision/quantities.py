"""Every response of a collision, once: name, unit, digits, heads, meaning, and the function that computes it.

Terminal, CSV, JSON, the columns of sweeps, reports and the documentation all read these tables, and so does the list
that a wrong name is held against. To add a response, add a row here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache, cached_property
from typing import Any, Generic, NamedTuple, TypeVar, cast

import numpy as np

from trainmj.collision.block import Tally
from trainmj.collision.chain import WALL, Chain, Interface
from trainmj.collision.deceleration import FILTER_INTERVAL, cfc60_peak, mean_deceleration, window_peak
from trainmj.collision.device import Array, Device
from trainmj.errors import InputError, close_match
from trainmj.units import KJ, KM_H, KN, MM, MS, TONNE, G, head

T = TypeVar("T")


class Column(NamedTuple):
    """A column of a table of responses.

    Attributes:
        name: its head, unit included: ``stroke_M1_M2_mm``.
        unit: of its values; empty for plain numbers.
        digits: decimals worth reading.
        title: in words, without the unit: ``stroke M1-M2``.
        meaning: of the quantity.
        quantity: name of the quantity: ``stroke_mm``.
        place: sorts the columns of different chains as one table has them: whole collision, interfaces, vehicles.
    """

    name: str
    unit: str
    digits: int
    title: str
    meaning: str
    quantity: str
    place: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Quantity(Generic[T]):
    """One quantity.

    Attributes:
        key: what it is, without its unit.
        unit: of its values; empty for plain numbers.
        digits: decimals worth reading; negative for significant digits, as of errors.
        heading: what stands above its column, in the lines of a narrow one: ``largest`` over ``stroke``.
        meaning: one line.
        value: computes it, in its unit.
        column: what it is called in the name of a column of a sweep; empty if it has none.
    """

    key: str
    unit: str
    digits: int
    heading: str
    meaning: str
    value: Callable[[T], Any]
    column: str = ""

    @cached_property
    def name(self) -> str:
        """Key and unit: the name of the attribute, and in JSON and CSV."""
        return head(self.key, self.unit)

    def head_of(self, thing: str = "") -> str:
        """Name of its column for a vehicle, an interface or, if empty, the whole collision."""
        return head("_".join(filter(None, (self.column, thing.replace("-", "_").replace(" ", "_")))), self.unit)

    def text(self, value: float) -> str:
        """A value with the digits that are worth reading."""
        return f"{value:.{self.digits}f}" if self.digits >= 0 else f"{value:.{-self.digits}g}"


@dataclass(frozen=True, eq=False)
class Measured:
    """What a collision left behind, as its quantities need it.

    Attributes:
        chain: what was collided.
        tally: from every step.
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].
    """

    chain: Chain
    tally: Tally
    time: Array
    velocity: Array

    @cached_property
    def sides(self) -> tuple[Side, ...]:
        """Every interface; the front as one side's, or as both where these are not equal."""
        return tuple(Side(self, k, side) for k, side in places_of_sides(self.chain))

    @cached_property
    def kinetic(self) -> tuple[float, float]:
        """Kinetic energy at the start and at the end [J]."""
        mass = self.chain.mass
        start, end = (float(0.5 * np.sum(mass * v**2)) for v in (self.chain.speed, self.tally.speed))
        return start, end

    @cached_property
    def elastic(self) -> float:
        """Energy in the springs of all interfaces at the end [J]."""
        left = [max(0.0, float(u - p)) for u, p in zip(self.tally.stroke, self.tally.plastic, strict=True)]
        return sum(0.5 * i.envelope.stiffness * u**2 for i, u in zip(self.chain.interfaces, left, strict=True))

    @cached_property
    def energy_error(self) -> float:
        """What is missing in the balance of energy, relative to what a plastic collision takes.

        That is the kinetic energy about the common centre of mass, or all of it at a wall: two trains that travel
        together cannot hide an error in it. The forces times the travel of a step give back the kinetic energy
        exactly, by the way the step is made, and would prove nothing. The absorbed energy is therefore added up from
        the law; it closes the balance only where the step is small enough.
        """
        mass, speed = self.chain.mass, self.chain.speed
        common = 0.0 if self.chain.interfaces[-1].right == WALL else float((speed * mass).sum() / mass.sum())
        convertible = float(0.5 * np.sum(mass * (speed - common) ** 2))
        start, end = self.kinetic
        absorbed, friction = float(self.tally.dissipated.sum()), float(self.tally.friction_work.sum())
        return (start - end - self.elastic - absorbed - friction) / convertible

    @cached_property
    def momentum_error(self) -> float:
        """Momentum less the impulses of rails and wall, relative to the sum of ``|m v|`` at the start."""
        mass, speed = self.chain.mass, self.chain.speed
        momentum = float(np.sum(mass * (self.tally.speed - speed))) - self.tally.impulse
        return float(momentum / np.sum(mass * np.abs(speed)))

    def mean_deceleration(self) -> Array:
        """(n_vehicle,) from the first to the last force at the front [m/s2]."""
        front = self.chain.front
        first, last = self.tally.first_force_time[front], self.tally.last_force_time[front]
        return mean_deceleration(float(first), float(last), self.time, self.velocity)

    def balance_time(self) -> Array:
        """(n_vehicle,) when the interface on the side of the impact had its largest stroke [s]."""
        n = self.chain.n_moving
        ahead = [i if i < n else i - 1 for i in range(len(self.chain.vehicles))]
        return np.asarray(self.tally.stroke_max_time[ahead])


def places_of_sides(chain: Chain) -> list[tuple[int, int]]:
    """Index of the interface and its side (0 left, 1 right), from the front backwards, the moving train first."""
    front = chain.front
    own = [(k, 0) for k in range(front, -1, -1)]
    unequal = len(chain.interfaces[front].devices) == 2 and not chain.interfaces[front].equal_sides
    return own + [(front, 1)] * unequal + [(k, 0) for k in range(front + 1, len(chain.interfaces))]


def order_of_vehicles(chain: Chain) -> list[int]:
    """Indices of the vehicles from the front backwards, the moving train first."""
    return [*range(chain.front, -1, -1), *range(chain.n_moving, len(chain.vehicles))]


def name_of_side(interface: Interface, side: int) -> str:
    """What a side of an interface is called: the partner's side of an unequal front is "S1-M1 partner"."""
    return interface.name + (" partner" if side else "")


class Side:
    """One interface as it is reported, or one train's side of the front."""

    def __init__(self, measured: Measured, index: int, side: int) -> None:
        """Look at one side of the interface of an index."""
        self._tally, self._index, self._side = measured.tally, index, side
        self.interface = measured.chain.interfaces[index]
        self.device: Device = self.interface.devices[side]
        self._largest = float(measured.tally.stroke_max[index])
        self.stroke = self.interface.side_stroke(self._largest, side)

    @property
    def name(self) -> str:
        """Of the interface, and of its side where both are reported."""
        return name_of_side(self.interface, self._side)

    @property
    def beyond_curve(self) -> bool:
        """Whether the stroke went past the last point of the curve, where the force is only held."""
        return bool(self.stroke > self.device.envelope.stroke[-1])

    @property
    def permanent(self) -> float:
        """Permanent set [m].

        What an interface gives back its sides share as their stiffnesses say: K is 1 / (1 / K_left + 1 / K_right).
        """
        back = self._largest - float(self._tally.plastic[self._index])
        back = back * self.interface.envelope.stiffness / self.device.envelope.stiffness
        return max(0.0, self.stroke - back)

    @property
    def energy(self) -> float:
        """Absorbed energy [J]."""
        return self._share() * float(self._tally.dissipated[self._index])

    def tallied(self, name: str) -> float:
        """A value of the tally at this interface."""
        return float(getattr(self._tally, name)[self._index])

    def _share(self) -> float:
        """Part of the absorbed energy that this side takes: its work up to the stroke, less what it gives back."""
        interface, stroke = self.interface, self._largest
        if len(interface.devices) == 1:
            return 1.0
        if interface.equal_sides:
            return 0.5
        envelope = interface.envelope
        inner = envelope.stroke[envelope.stroke < stroke]
        until = np.append(inner, stroke)
        left = np.array([interface.side_stroke(x, 0) for x in until])
        peak = envelope.force_at(stroke)
        force = np.append(envelope.force[: inner.size], peak)
        own = float(np.trapezoid(force, left)) - 0.5 * peak**2 / interface.devices[0].envelope.stiffness
        total = float(np.trapezoid(force, until)) - 0.5 * peak**2 / envelope.stiffness
        share = min(1.0, max(0.0, own / total)) if total > 0 else 0.5
        return share if self._side == 0 else 1.0 - share


INTERFACE: tuple[Quantity[Side], ...] = (
    Quantity(
        "stroke", "mm", 1, "largest\nstroke", "largest stroke; at the front that of one train",
        lambda s: s.stroke / MM, "stroke",
    ),
    Quantity(
        "permanent", "mm", 1, "permanent\nset", "stroke that remains without force",
        lambda s: s.permanent / MM, "permanent",
    ),
    Quantity(
        "peak_force", "kN", 1, "peak\nforce", "largest force", lambda s: s.tallied("force_max") / KN, "force",
    ),
    Quantity(
        "energy", "kJ", 2, "absorbed\nenergy", "absorbed energy; at the front by one train",
        lambda s: s.energy / KJ, "energy",
    ),
    Quantity(
        "peak_time", "s", 3, "at", "when the stroke was largest", lambda s: s.tallied("stroke_max_time"),
    ),
)  # fmt: skip
"""Quantities of an interface, or of one train's side of the front; a number each."""

VEHICLE: tuple[Quantity[Measured], ...] = (
    Quantity("mass", "t", -6, "mass", "mass", lambda m: m.chain.mass / TONNE),
    Quantity(
        "peak_device_acceleration", "g", 4, "device\npeak",
        "largest |acceleration| by the devices alone, from every step",
        lambda m: m.tally.device_peak / G, "peak_device",
    ),
    Quantity(
        "peak_acceleration", "g", 3, "total\npeak", "largest |acceleration|, rail friction included",
        lambda m: m.tally.total_peak / G, "peak_acceleration",
    ),
    Quantity(
        "mean_deceleration", "g", 3, "mean\nall", "mean from the first to the last force at the front",
        lambda m: m.mean_deceleration() / G, "mean_deceleration",
    ),
    Quantity(
        "mean_30ms", "g", 3, "mean\n30 ms", "largest mean over 30 ms",
        lambda m: window_peak(0.030, m.time, m.velocity) / G, "mean_30ms",
    ),
    Quantity(
        "mean_100ms", "g", 3, "mean\n100 ms", "largest mean over 100 ms",
        lambda m: window_peak(0.100, m.time, m.velocity) / G, "mean_100ms",
    ),
    Quantity(
        "cfc60_peak", "g", 3, "CFC 60\npeak", "largest |acceleration| behind a CFC 60 filter (SAE J211)",
        lambda m: cfc60_peak(m.time, m.velocity) / G, "cfc60_peak",
    ),
    Quantity(
        "final_speed", "km/h", 2, "final\nspeed", "speed at the end of the run",
        lambda m: m.tally.speed / KM_H, "final_speed",
    ),
    Quantity(
        "balance_time", "s", 3, "balance\ntime", "when the interface on the side of the impact had its largest stroke",
        lambda m: m.balance_time(), "balance_time",
    ),
)  # fmt: skip
"""Quantities of a vehicle; (n_vehicle,) numbers in the order of the chain each."""

TRAIN: tuple[Quantity[Measured], ...] = (
    Quantity(
        "TS", "mm", 1, "TS",
        "compression along the moving train, empty strokes not counted",
        lambda m: sum(crush_mm(s) for s in m.sides[: m.chain.n_moving]), "TS",
    ),
    Quantity(
        "TAMA", "g", 4, "TAMA", "mean of the peak device accelerations of the moving train",
        lambda m: float(np.mean(m.tally.device_peak[m.chain.front :: -1] / G)), "TAMA",
    ),
)  # fmt: skip
"""Criteria of the moving train, Eqs. (1) and (2) of doi 10.1186/s10033-022-00755-8; a number each."""

COLLISION: tuple[Quantity[Measured], ...] = (
    Quantity("duration", "s", 3, "duration", "simulated time", lambda m: m.tally.time, "duration"),
)
"""Quantities of the whole collision; a number each."""

BALANCE: tuple[Quantity[Measured], ...] = (
    Quantity("kinetic_start", "kJ", 1, "kinetic at the start", "kinetic energy at the start",
             lambda m: m.kinetic[0] / KJ),
    Quantity("kinetic_end", "kJ", 1, "kinetic at the end", "kinetic energy at the end", lambda m: m.kinetic[1] / KJ),
    Quantity("elastic", "kJ", 1, "elastic, still in the devices", "energy still in the springs of the devices",
             lambda m: m.elastic / KJ),
    Quantity("absorbed", "kJ", 1, "absorbed by the devices", "energy absorbed by all devices",
             lambda m: float(m.tally.dissipated.sum()) / KJ, "absorbed"),
    Quantity("friction", "kJ", 1, "by the rails", "energy taken by rail friction",
             lambda m: float(m.tally.friction_work.sum()) / KJ),
    Quantity("energy_error", "", -2, "energy balance",
             "what is missing in the balance of energy, relative to what the collision can convert",
             lambda m: m.energy_error, "energy_error"),
    Quantity("momentum_error", "", -2, "momentum balance",
             "what is missing in the balance of momentum, relative to the sum of |m v| at the start",
             lambda m: m.momentum_error, "momentum_error"),
)  # fmt: skip
"""Where energy and momentum went; a number each."""

STAGE = Quantity[float](
    "stroke", "mm", 1, "stroke", "largest stroke of one stage of a device", lambda u: u / MM, "stroke"
)
"""The quantity of a stage; devices of one stage have no column for it."""


def groups() -> dict[str, tuple[Quantity[Any], ...]]:
    """All tables by what their quantities belong to."""
    return {
        "The moving train": TRAIN,
        "The whole collision": COLLISION,
        "Energy and momentum": BALANCE,
        "An interface": INTERFACE,
        "A stage": (STAGE,),
        "A vehicle": VEHICLE,
    }


def of_each() -> dict[str, Quantity[Any]]:
    """The quantities of every vehicle and interface by name."""
    return {q.name: q for q in (*cast(tuple[Quantity[Any], ...], VEHICLE), *INTERFACE)}


def crush_mm(side: Side) -> float:
    """Stroke of a side without empty strokes [mm]: what counts in TS."""
    return sum(stage.stroke(side.stroke) / MM for stage in side.device.stages)


def columns_of(chain: Chain) -> dict[str, Column]:
    """Every response of a chain by the name of its column, in the order of tables."""
    sides = [(chain.interfaces[k], k, side) for k, side in places_of_sides(chain)]
    return _columns(
        tuple(
            (name_of_side(i, side), bool(side) or k > chain.front, abs(k - chain.front), _stages(i.devices[side]))
            for i, k, side in sides
        ),
        tuple(chain.vehicles[i].name for i in order_of_vehicles(chain)),
        chain.n_moving,
    )


def _stages(device: Device) -> tuple[str, ...]:
    """Names of the stages that have a column of their own."""
    return tuple(stage.name for stage in device.stages) if len(device.stages) > 1 else ()


@cache
def _columns(
    sides: tuple[tuple[str, bool, int, tuple[str, ...]], ...], vehicles: tuple[str, ...], n_moving: int
) -> dict[str, Column]:
    """Columns of all chains whose interfaces and vehicles have these names; not to be changed."""
    found: list[Column] = []

    def add(quantity: Quantity[Any], thing: str, *place: int) -> None:
        title = f"{quantity.column.replace('_', ' ')} {thing.replace('_', ' ')}".rstrip()
        name = quantity.head_of(thing)
        found.append(Column(name, quantity.unit, quantity.digits, title, quantity.meaning, quantity.name, place))

    for n, whole in enumerate(with_column((*TRAIN, *COLLISION, *BALANCE))):
        add(whole, "", 0, n)
    for name, partner, away, stages in sides:
        for n, of_interface in enumerate(with_column(INTERFACE)):
            add(of_interface, name, 1, partner, away, n)
        for n, stage in enumerate(stages):
            add(STAGE, f"{name} {stage}", 1, partner, away, len(INTERFACE) + n)
    for k, name in enumerate(vehicles):
        for n, of_vehicle in enumerate(with_column(VEHICLE)):
            add(of_vehicle, name, 2, k >= n_moving, k if k < n_moving else k - n_moving, n)
    return {column.name: column for column in found}


@cache
def with_column(quantities: tuple[Quantity[Any], ...]) -> tuple[Quantity[Any], ...]:
    """Those that have a column."""
    return tuple(q for q in quantities if q.column)


@cache
def names_of(quantities: tuple[Quantity[Any], ...]) -> tuple[str, ...]:
    """Names of those that have a column."""
    return tuple(q.name for q in with_column(quantities))


def matching(patterns: Iterable[str], columns: Mapping[str, Column]) -> dict[str, Column]:
    """The columns that names or patterns choose, in their own order.

    Args:
        patterns: such as ``"TS_mm"`` or ``"stroke_*"``.
        columns: that there are, by name.

    Raises:
        InputError: if one chooses none.
    """
    patterns = list(patterns)
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in columns):
            raise InputError(f"responses: no response is called {pattern!r}{close_match(pattern, columns)}")
    return {name: c for name, c in columns.items() if any(fnmatchcase(name, pattern) for pattern in patterns)}


def no_number(column: Column, chain: Chain) -> str:
    """Why a response of a chain is not a number, and the cure; empty if it is one."""
    interval = chain.step * chain.steps_per_record
    if not column.quantity.startswith("cfc60") or interval <= FILTER_INTERVAL:
        return ""
    longest = int(FILTER_INTERVAL * 1e4) / 10
    return (
        f"{column.name} is not a number with simulation.record_every_ms = {interval / MS:g}, too far apart for its "
        f"filter: take at most {longest:g}"
    )


def ordered(columns: Iterable[Column]) -> list[Column]:
    """Columns of several chains in the order of one table, each once."""
    return sorted(dict.fromkeys(columns), key=lambda column: (column.place, column.name))
