"""Every response of a collision, once: name, unit, digits, heads, meaning, and the function that computes it.

Terminal, CSV, JSON, sweep columns, reports and documentation all read these tables, and a wrong name is compared with
them. To add a response, add a row here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache, cached_property, partial
from typing import NamedTuple, Self

import numpy as np

from trainmj.collision.chain import Chain, n_own_sides, order_of_vehicles, places_of_sides
from trainmj.collision.deceleration import FILTER_INTERVAL, WINDOW_RECORDS, cfc60_peak, window_peak
from trainmj.collision.device import Device
from trainmj.collision.envelope import Array
from trainmj.collision.fields import LASTING
from trainmj.collision.measured import Measured
from trainmj.collision.occupants import longest_interval
from trainmj.errors import InputError, close_match
from trainmj.files.arguments import listed
from trainmj.scenario.devices import DEVICE
from trainmj.units import KJ, KM_H, KN, MM, MRAD, MS, TONNE, G, against, head


class Column(NamedTuple):
    """A column of a table of responses.

    Attributes:
        name: its head, unit included: ``stroke_M1_M2_mm``.
        unit: of its values; empty for plain numbers.
        digits: decimals worth reading; negative for significant digits.
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

    @property
    def of_partner(self) -> bool:
        """Whether it is of a vehicle or an interface of the partner."""
        return bool(self.place[0] and self.place[1])


class Columns(dict[str, Column]):
    """Responses by the names of their columns, as tables carry them; not to be changed."""

    def __deepcopy__(self, memo: object) -> Self:
        """Itself: pandas copies what a table carries whenever a part of it is taken."""
        return self


@dataclass(frozen=True, eq=False)
class Quantity:
    """One quantity.

    Attributes:
        key: what it is, without its unit.
        unit: of its values; empty for plain numbers.
        digits: decimals worth reading; negative for significant digits, as of errors.
        heading: what stands above its column, in the lines of a narrow one: ``largest`` over ``stroke``.
        meaning: one line.
        value: computes it, in its unit, of all cases of a lot: (n_case,) of a whole collision, otherwise (n_case, n).
        column: what it is called in the name of a column of a sweep; empty if it has none.
        interval: longest time between two records with which it is a number [s].
        there: whether a collision has it: some need what a scenario may or may not state.
        least: whether the least value is the worst, so that a limit, which is a largest magnitude, would mislead.
    """

    key: str
    unit: str
    digits: int
    heading: str
    meaning: str
    value: Callable[[Measured], Array]
    column: str = ""
    interval: float = math.inf
    there: Callable[[Chain], bool] = lambda _: True
    least: bool = False

    def is_number(self, chain: Chain) -> bool:
        """Whether the records of a chain are close enough for it."""
        return chain.record_interval <= self.interval * (1 + 1e-9)

    @cached_property
    def name(self) -> str:
        """Key and unit: the name of the attribute, and in JSON and CSV."""
        return head(self.key, self.unit)

    def head_of(self, thing: str = "") -> str:
        """Name of its column for a vehicle, an interface or, if empty, the whole collision."""
        return head("_".join(filter(None, (self.column, thing.replace("-", "_").replace(" ", "_")))), self.unit)

    def text(self, value: float, limit: float | None = None) -> str:
        """A value with the digits that are worth reading, beside a limit with those that tell them apart."""
        return against(value, limit, self.digits)


def _averages(chain: Chain) -> bool:
    return chain.steps_per_window > 0


def _bodies_give(chain: Chain) -> bool:
    return bool(chain.members)


def _in_plane(chain: Chain) -> bool:
    return chain.plane


INTERFACE: tuple[Quantity, ...] = (
    Quantity(
        "stroke", "mm", 1, "largest\nstroke", "largest stroke; at the front of one train's side",
        lambda m: m.sides.stroke / MM, "stroke",
    ),
    Quantity(
        "permanent", "mm", 1, "permanent\nset", "stroke that remains without force",
        lambda m: m.sides.permanent / MM, "permanent",
    ),
    Quantity(
        "peak_force", "kN", 1, "peak\nforce", "largest force", lambda m: m.sides.tallied("force_max") / KN, "force",
    ),
    Quantity(
        "peak_pull", "kN", 1, "peak\npull", "largest force of the draw gear, where there is one",
        lambda m: m.sides.tallied("pull_max") / KN, "pull",
    ),
    Quantity(
        "energy", "kJ", 2, "absorbed\nenergy", "absorbed energy; at the front of one train's side",
        lambda m: m.sides.energy / KJ, "energy",
    ),
    Quantity(
        "peak_time", "s", 3, "at", "when the stroke was largest", lambda m: m.sides.tallied("stroke_max_time"),
    ),
)  # fmt: skip
"""Quantities of an interface, or of one train's side of the front; (n_case, n_side) numbers each."""


ENDS: tuple[Quantity, ...] = (
    Quantity(
        "step", "mm", 1, "largest\nstep",
        "largest difference in height of the two ends, each against its design height, while a device between them "
        "carries force; 0 if none does",
        lambda m: m.sides.of_ends("step_max") / MM, "step", there=_in_plane,
    ),
    Quantity(
        "met_step", "mm", 1, "step as\nfaces met",
        "step of the two faces of the last path when they first carried force; blank if there are none, or they "
        "never did",
        lambda m: m.sides.met_step / MM, "met_step", there=_in_plane,
    ),
    Quantity(
        "slip", "mm", 2, "slip", "largest way that engaged faces have slipped past each other since they engaged",
        lambda m: m.sides.of_lines("slip_max") / MM, "slip", there=_in_plane,
    ),
    Quantity(
        "tie_force", "kN", 1, "tie\nforce", "largest vertical force of the tie of engaged faces",
        lambda m: m.sides.of_lines("tie_max") / KN, "tie_force", there=_in_plane,
    ),
    Quantity(
        "swing_moment", "kN m", 1, "swing\nmoment", "largest moment of a swing stop of a strut",
        lambda m: m.sides.of_lines("swing_max") / KN, "swing_moment", there=_in_plane,
    ),
)  # fmt: skip
"""Quantities of an interface as well, in the vertical plane."""


def _over(ms: int) -> Quantity:
    """The largest mean over a moving window."""
    name, window = f"mean_{ms}ms", ms * MS
    return Quantity(
        name, "g", 3, f"{ms} ms\nmean", f"largest |mean acceleration| over any {ms} ms, by all forces",
        lambda m: m.of_histories(partial(window_peak, window)) / G, name, window / WINDOW_RECORDS,
    )  # fmt: skip


DECELERATION: tuple[Quantity, ...] = (
    Quantity(
        "mean_deceleration", "g", 3, "first\nwindow",
        "mean by the devices alone in the first contact window: from when the net force of the devices on the vehicle, "
        "away from the impact, first exceeds simulation.contact_threshold_kN until it next falls to it; 0 if it never "
        "does",
        lambda m: m.mean_deceleration() / G, "mean_deceleration",
    ),
    Quantity(
        "worst_mean_deceleration", "g", 3, "worst\nwindow",
        f"largest such mean of all contact windows that last at least {LASTING / MS:g} ms; 0 if none does",
        lambda m: m.worst_mean_deceleration() / G, "worst_mean_deceleration",
    ),
    Quantity("contact_windows", "", 0, "windows", "number of contact windows", lambda m: m.n_contacts),
    Quantity(
        "front_mean_deceleration", "g", 3, "at the\nfront",
        "mean by all forces from the first to the last force at the front, the same time for all vehicles",
        lambda m: m.front_mean_deceleration() / G, "front_mean_deceleration",
    ),
    *(_over(ms) for ms in (30, 100, 120)),
)  # fmt: skip
"""Quantities of a vehicle as well: its mean decelerations."""

VEHICLE: tuple[Quantity, ...] = (
    Quantity("mass", "t", -6, "mass", "mass", lambda m: m.mass / TONNE),
    Quantity(
        "peak_device_acceleration", "g", 4, "device\npeak",
        "largest |acceleration| by the devices alone, from every step",
        lambda m: m.tally.device_peak / G, "peak_device",
    ),
    Quantity(
        "averaged_device_acceleration", "g", 4, "window\nmean",
        "largest |mean acceleration| by the devices alone over consecutive windows of simulation.averaging_ms",
        lambda m: m.window_peak / G, "averaged_device", there=_averages,
    ),
    Quantity(
        "peak_acceleration", "g", 3, "total\npeak", "largest |acceleration|, rail friction included",
        lambda m: m.tally.total_peak / G, "peak_acceleration",
    ),
    *DECELERATION,
    Quantity(
        "cfc60_peak", "g", 3, "CFC 60\npeak",
        "largest |acceleration| behind a CFC 60 filter (SAE J211), which may overshoot a sharp peak",
        lambda m: m.of_histories(cfc60_peak) / G, "cfc60_peak", FILTER_INTERVAL,
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
"""Quantities of a vehicle; (n_case, n_vehicle) numbers in the order of the chain each."""

BODY: tuple[Quantity, ...] = (
    Quantity(
        "body_shortening", "mm", 1, "body\nshortening", "largest shortening of its body",
        lambda m: m.tally.shortened_max / MM, "body_shortening", there=_bodies_give,
    ),
    Quantity(
        "body_plastic", "mm", 1, "body\nplastic", "plastic shortening of its body",
        lambda m: m.body_plastic[0] / MM, "body_plastic", there=_bodies_give,
    ),
    Quantity(
        "body_plastic_5m", "mm", 1, "plastic\nin 5 m",
        "largest plastic shortening within 5 m of its body: a proxy of survival space, no measure of it",
        lambda m: m.body_plastic[1] / MM, "body_plastic_5m", there=_bodies_give,
    ),
    Quantity(
        "body_peak", "g", 3, "body\npeak",
        "largest |acceleration| at any point of its body, not filtered: at an end it grows with the number of members, "
        "as the mass of the point shrinks",
        lambda m: m.body_peak() / G, "body_peak", there=_bodies_give,
    ),
    Quantity(
        "body_energy", "kJ", 2, "body\nenergy", "energy lost in its body, by yielding and by damping",
        lambda m: m.body_energy() / KJ, "body_energy", there=_bodies_give,
    ),
)  # fmt: skip
"""Quantities of a vehicle as well, where bodies give."""

UPRIGHT: tuple[Quantity, ...] = (
    Quantity(
        "pitch", "mrad", 2, "largest\npitch",
        "pitch of largest magnitude; positive with the end that faces the impact up",
        lambda m: m.plane.pitch / MRAD, "pitch", there=_in_plane,
    ),
    Quantity(
        "heave", "mm", 1, "largest\nheave", "rise of the centre of gravity of the body of largest magnitude",
        lambda m: m.plane.heave / MM, "heave", there=_in_plane,
    ),
    Quantity(
        "wheel_lift", "mm", 2, "wheel\nlift",
        "largest lift of a wheelset off the rail; 0 as long as all stay on it, so that it jumps",
        lambda m: m.plane.of_vehicles(m.plane.lift, np.max, 0.0) / MM, "wheel_lift", there=_in_plane,
    ),
    Quantity(
        "wheel_load", "", 3, "least\nN/N0",
        "least load of a wheelset on the rail over its load at rest; it changes smoothly until it is 0",
        lambda m: m.plane.of_vehicles(m.plane.load, np.min, math.nan), "wheel_load", there=_in_plane, least=True,
    ),
)  # fmt: skip
"""Quantities of a vehicle as well, in the vertical plane; blank, or 0, of what has no wheelsets."""

WHEELSET: tuple[Quantity, ...] = (
    Quantity("lift", "mm", 2, "largest\nlift", "largest lift of a wheelset off the rail",
             lambda m: m.plane.lift / MM, "lift"),
    Quantity("lift_time", "s", 3, "at", "when its lift was largest; blank if it stays on the rail",
             lambda m: m.plane.lift_time),
    Quantity("off_time", "s", 3, "time off\nthe rail", "how long it was off the rail", lambda m: m.tally.wheel_off),
    Quantity("load", "", 3, "least\nN/N0", "least load of a wheelset on the rail over its load at rest",
             lambda m: m.plane.load, "load", least=True),
    Quantity("rest_load", "kN", 1, "load\nat rest", "load of a wheelset at rest", lambda m: m.plane.rest / KN),
)  # fmt: skip
"""Quantities of a wheelset, in the vertical plane; (n_case, n_wheelset) numbers each."""

MEMBER: tuple[Quantity, ...] = (
    Quantity(
        "shortening", "mm", 2, "largest\nshortening", "largest shortening of a member of a body",
        lambda m: m.tally.member_stroke_max / MM, "shortening",
    ),
    Quantity(
        "plastic", "mm", 2, "plastic", "plastic shortening of a member of a body; negative where it was drawn out",
        lambda m: m.tally.member_plastic / MM, "plastic",
    ),
    Quantity(
        "peak_force", "kN", 1, "peak\nforce", "largest |force| in a member of a body",
        lambda m: m.tally.member_force_max / KN, "force",
    ),
    Quantity(
        "energy", "kJ", 2, "lost\nenergy", "energy lost in a member of a body, by yielding and by damping",
        lambda m: m.tally.member_dissipated / KJ,
    ),
)  # fmt: skip
"""Quantities of a member of a body that gives, or of the link of a bogie; (n_case, n_member) numbers each."""

POINT: tuple[Quantity, ...] = (
    Quantity(
        "peak_acceleration", "g", 3, "total\npeak", "largest |acceleration| of a point of a body, by all forces",
        lambda m: m.tally.point_peak / G, "peak_acceleration",
    ),
)  # fmt: skip
"""Quantities of a point of a body that gives, or of a bogie; (n_case, n_point) numbers each."""

TRAIN: tuple[Quantity, ...] = (
    Quantity(
        "TS", "mm", 1, "TS",
        "compression along the moving train, empty strokes not counted",
        lambda m: m.sides.own_crush_mm, "TS",
    ),
    Quantity(
        "TAMA", "g", 4, "TAMA", "mean of the peak device accelerations of the moving train",
        lambda m: (m.tally.device_peak[:, m.chain.front :: -1] / G).mean(axis=-1), "TAMA",
    ),
    Quantity(
        "TAMA_averaged", "g", 4, "TAMA averaged",
        "mean of the averaged device accelerations of the moving train",
        lambda m: (m.window_peak[:, m.chain.front :: -1] / G).mean(axis=-1), "TAMA_averaged", there=_averages,
    ),
    Quantity(
        "largest_step", "mm", 1, "largest step",
        "largest step of all interfaces of the moving train, that at the front included",
        lambda m: m.plane.own_step / MM, "largest_step", there=_in_plane,
    ),
    Quantity(
        "largest_wheel_lift", "mm", 2, "largest wheel lift", "largest lift of all wheelsets of the moving train",
        lambda m: m.plane.own_lift / MM, "largest_wheel_lift", there=_in_plane,
    ),
    Quantity(
        "least_wheel_load", "", 3, "least wheel load", "least N/N0 of all wheelsets of the moving train",
        lambda m: m.plane.own_load, "least_wheel_load", there=_in_plane, least=True,
    ),
)  # fmt: skip
"""Criteria of the moving train, Eqs. (1) and (2) of doi 10.1186/s10033-022-00755-8; (n_case,) numbers each."""

COLLISION: tuple[Quantity, ...] = (
    Quantity("duration", "s", 3, "duration", "simulated time", lambda m: m.tally.time, "duration"),
    Quantity(
        "valid_until", "s", 4, "valid until",
        "when a curve ended behind which nothing is stated, or one vehicle overrode another: from then on no "
        "acceleration, force or energy is valid; "
        "blank if all are",
        lambda m: np.where(m.tally.valid_until < np.inf, m.tally.valid_until, np.nan), "valid_until",
    ),
)  # fmt: skip
"""Quantities of the whole collision; (n_case,) numbers each."""

BALANCE: tuple[Quantity, ...] = (
    Quantity("kinetic_start", "kJ", 1, "kinetic at the start", "kinetic energy at the start",
             lambda m: m.kinetic[0] / KJ),
    Quantity("kinetic_end", "kJ", 1, "kinetic at the end", "kinetic energy at the end", lambda m: m.kinetic[1] / KJ),
    Quantity("elastic", "kJ", 1, "elastic, still in the devices", "energy still in the springs of the devices",
             lambda m: m.used.held("elastic") / KJ),
    Quantity("gas", "kJ", 1, "in gas, still in the devices", "energy still in the gas of hydraulic devices",
             lambda m: m.used.held("gas") / KJ),
    Quantity("in_bodies", "kJ", 1, "elastic, still in the car bodies", "energy still in the car bodies",
             lambda m: m.in_bodies / KJ, there=_bodies_give),
    Quantity("bodies", "kJ", 1, "absorbed by the car bodies", "energy lost in car bodies, by yielding and by damping",
             lambda m: m.lost_in_bodies / KJ, "bodies", there=_bodies_give),
    Quantity("absorbed", "kJ", 1, "absorbed by the devices", "energy absorbed by all devices",
             lambda m: m.absorbed / KJ, "absorbed"),
    Quantity("crushed", "kJ", 1, "by crushing", "part of the absorbed energy that crushing took",
             lambda m: m.used.wasted("crushed") / KJ),
    Quantity("frictional", "kJ", 1, "by friction in devices", "part of the absorbed energy that slip in devices took",
             lambda m: m.used.wasted("frictional") / KJ),
    Quantity("viscous", "kJ", 1, "by speed", "part of the absorbed energy that dashpots and orifices took",
             lambda m: m.used.viscous / KJ),
    Quantity("friction", "kJ", 1, "by the rails", "energy taken by rail friction",
             lambda m: m.by_rails / KJ),
    Quantity("brakes", "kJ", 1, "by the brakes", "energy taken by the brakes",
             lambda m: m.by_brakes / KJ),
    Quantity("grade", "kJ", 1, "by the grade", "energy taken by the grade; negative where it runs downhill",
             lambda m: m.by_grade / KJ),
    Quantity("suspensions", "kJ", 1, "in weight, suspensions and rails",
             "energy that weight, suspension springs, stops and rails hold at the end, more than at the start",
             lambda m: m.plane.raised / KJ, there=_in_plane),
    Quantity("damped", "kJ", 1, "by suspensions and rails", "energy taken by dampers of suspensions, and in the rails",
             lambda m: m.plane.damped / KJ, "damped", there=_in_plane),
    Quantity("ties", "kJ", 1, "by ties and swing stops",
             "energy taken by ties that slip and swing stops of struts that shear, with what they still hold",
             lambda m: (m.plane.lost + m.plane.held) / KJ, there=_in_plane),
    Quantity("energy_error", "", -2, "energy balance",
             "what is missing in the balance of energy, relative to what the collision can convert",
             lambda m: m.energy_error, "energy_error"),
    Quantity("curve_error", "", -2, "absorbed, against the curves",
             "largest difference between what a device absorbed and the area below its own curve, relative to what the "
             "collision can convert",
             lambda m: m.curve_error),
    Quantity("momentum_error", "", -2, "momentum balance",
             "what is missing in the balance of momentum, relative to the sum of |m v| at the start",
             lambda m: m.momentum_error, "momentum_error"),
)  # fmt: skip
"""Where energy and momentum went; (n_case,) numbers each."""

STAGE = Quantity(
    "stroke",
    "mm",
    1,
    "stroke",
    "largest stroke of one stage of a device",
    lambda m: m.sides.stage_stroke / MM,
    "stroke",
)
"""The quantity of a stage, (n_case, n_stage) numbers; devices of one stage have no column for it."""


@cache
def of_flight(distance: float) -> tuple[Quantity, ...]:
    """The quantities of the occupants of a vehicle after a free flight over a distance [m]; the same ones each time."""
    mm, interval = f"{distance / MM:.0f}", longest_interval(distance)
    return (
        Quantity(
            f"SIV_{mm}mm", "m/s", 2, f"SIV\n{mm} mm",
            f"secondary impact velocity: of a free occupant against its vehicle after {mm} mm; 0 if never there",
            lambda m: m.impacts(distance)[0], f"SIV_{mm}mm", interval,
        ),
        Quantity(
            f"SIV_time_{mm}mm", "s", 3, f"time\n{mm} mm",
            f"when a free occupant has flown {mm} mm in its vehicle; blank if it never does",
            lambda m: m.impacts(distance)[1], f"SIV_time_{mm}mm", interval,
        ),
    )  # fmt: skip


def groups() -> dict[str, tuple[Quantity, ...]]:
    """All tables by what their quantities belong to."""
    return {
        "The moving train": TRAIN,
        "The whole collision": COLLISION,
        "Energy and momentum": BALANCE,
        "An interface": INTERFACE,
        "A stage": (STAGE,),
        "A vehicle": VEHICLE,
        "An interface, in the vertical plane": ENDS,
        "A vehicle, in the vertical plane": UPRIGHT,
        "A wheelset, in the vertical plane": WHEELSET,
        "The body of a vehicle, where one gives": BODY,
        "A member of a body that gives": MEMBER,
        "A point of a body that gives": POINT,
        "The occupants of a vehicle, for each distance that the scenario states": of_flight(0.6),
    }


def of_train(chain: Chain) -> tuple[Quantity, ...]:
    """The criteria that a chain has."""
    return tuple(q for q in TRAIN if q.there(chain))


def of_balance(chain: Chain) -> tuple[Quantity, ...]:
    """Where energy and momentum of a chain went."""
    return tuple(q for q in BALANCE if q.there(chain))


def of_vehicles(chain: Chain) -> tuple[Quantity, ...]:
    """The quantities of its vehicles that a chain has, those of their occupants last."""
    return (*(q for q in (*VEHICLE, *BODY, *UPRIGHT) if q.there(chain)), *of_occupants(chain))


def of_sides(chain: Chain) -> tuple[Quantity, ...]:
    """The quantities of its interfaces that a chain has."""
    return (*INTERFACE, *ENDS) if chain.plane else INTERFACE


def of_occupants(chain: Chain) -> tuple[Quantity, ...]:
    """The quantities of the occupants of its vehicles that a chain has."""
    return tuple(q for distance in chain.free_flights for q in of_flight(distance))


def of_each(chain: Chain) -> dict[str, Quantity]:
    """The quantities of every vehicle and interface of a chain by name; not to be changed."""
    return _by_name(of_vehicles(chain), of_sides(chain))


@cache
def _by_name(*tables: tuple[Quantity, ...]) -> dict[str, Quantity]:
    return {q.name: q for table in tables for q in table}


class _Source(NamedTuple):
    """Where the numbers of a column come from."""

    quantity: Quantity
    place: int  # among the numbers that the quantity has of each case


class Values:
    """The quantities of a lot, each computed once, when it is asked for.

    Attributes:
        columns: every response by the name of its column, in the order of tables.
    """

    def __init__(self, measured: Measured) -> None:
        """Nothing is computed yet."""
        self._measured, self._known = measured, dict[Quantity, Array]()
        self.columns, self._sources = _layout(measured.chain)

    def of(self, quantity: Quantity) -> Array:
        """(n_case, n) numbers of a quantity, n = 1 of a whole collision; nan where the records are too far apart."""
        if quantity not in self._known:
            if quantity.is_number(self._measured.chain):
                found = np.asarray(quantity.value(self._measured), dtype=np.float64)
            else:
                found = np.full_like(self._measured.mass, np.nan)
            self._known[quantity] = found.reshape(len(self._measured), -1)
        return self._known[quantity]

    def in_columns(self, names: Iterable[str]) -> Array:
        """(n_case, n_column) the responses of some columns, side by side."""
        sources, first, at = [self._sources[name] for name in names], dict[Quantity, int](), 0
        for quantity, _ in sources:
            if quantity not in first:
                first[quantity] = at
                at += self.of(quantity).shape[1]
        if not first:
            return np.empty((len(self._measured), 0))
        beside = np.concatenate([self.of(quantity) for quantity in first], axis=1)
        return beside.take([first[quantity] + place for quantity, place in sources], axis=1)


def columns_of(chain: Chain) -> dict[str, Column]:
    """Every response of a chain by the name of its column, in the order of tables."""
    return _layout(chain)[0]


def _layout(chain: Chain) -> tuple[dict[str, Column], dict[str, _Source]]:
    """The columns of a chain and their sources; not to be changed."""
    sides = [(chain.interfaces[k], k, side) for k, side in places_of_sides(chain)]
    own = n_own_sides(chain)
    return _columns(
        tuple(
            (i.sides[side], n >= own, abs(k - chain.front), i.draws, _stages(i.devices[side]))
            for n, (i, k, side) in enumerate(sides)
        ),
        tuple((i, chain.vehicles[i].name) for i in order_of_vehicles(chain)),
        chain.n_moving,
        of_train(chain),
        of_balance(chain),
        of_vehicles(chain),
        of_sides(chain),
        _parts(chain),
    )


def parts_of(chain: Chain) -> tuple[tuple[str, tuple[Quantity, ...]], ...]:
    """The kinds of parts of its vehicles that a chain has numbers of, with their quantities."""
    of_bodies = (("members", MEMBER), ("points", POINT)) if chain.members else ()
    return (*of_bodies, *((("wheelsets", WHEELSET),) if chain.plane else ()))


def names_of_parts(chain: Chain, kind: str, vehicle: int) -> list[tuple[int, str]]:
    """Index and name of each part of a kind of a vehicle, from the end that faces the impact."""
    if kind == "members":
        return [(k, chain.members[k].name) for k in chain.members_inward(vehicle)]
    if kind == "points":
        return [(k, chain.points[k].name) for k in chain.points_inward(vehicle)]
    found = [(n, chain.name_of_wheelset(i, k)) for n, (i, k) in enumerate(chain.wheelsets) if i == vehicle]
    return found[::-1] if chain.facing(vehicle) else found


def _parts(chain: Chain) -> tuple[tuple[tuple[tuple[Quantity, ...], tuple[tuple[int, str], ...]], ...], ...]:
    """The quantities, and index and name, of the parts of each vehicle, from the front backwards."""
    kinds = parts_of(chain)
    return tuple(
        tuple((table, tuple(names_of_parts(chain, kind, i))) for kind, table in kinds) for i in order_of_vehicles(chain)
    )


def _stages(device: Device) -> tuple[str, ...]:
    """Names of the stages, empty where one has no column of its own: that of a device of one curve."""
    several = len(device.stages) > 1
    return tuple(stage.name if several and stage.name != DEVICE else "" for stage in device.stages)


@cache
def _columns(
    sides: tuple[tuple[str, bool, int, bool, tuple[str, ...]], ...],
    vehicles: tuple[tuple[int, str], ...],
    n_moving: int,
    of_train: tuple[Quantity, ...],
    of_balance: tuple[Quantity, ...],
    of_vehicles: tuple[Quantity, ...],
    of_sides: tuple[Quantity, ...],
    parts: tuple[tuple[tuple[tuple[Quantity, ...], tuple[tuple[int, str], ...]], ...], ...],
) -> tuple[dict[str, Column], dict[str, _Source]]:
    """Columns, and their sources, of all chains with interfaces, vehicles and quantities of these names."""
    columns: dict[str, Column] = {}
    sources: dict[str, _Source] = {}

    def add(quantity: Quantity, index: int, thing: str, *place: int) -> None:
        title = f"{quantity.column.replace('_', ' ')} {thing.replace('_', ' ')}".rstrip()
        name = quantity.head_of(thing)
        columns[name] = Column(name, quantity.unit, quantity.digits, title, quantity.meaning, quantity.name, place)
        sources[name] = _Source(quantity, index)

    for n, whole in enumerate(with_column((*of_train, *COLLISION, *of_balance))):
        add(whole, 0, "", 0, n)
    before = 0  # stages of the sides before
    for k, (name, partner, away, draws, stages) in enumerate(sides):
        for of_interface in of_interfaces(of_sides, draws):
            add(of_interface, k, name, 1, partner, away, of_sides.index(of_interface))
        shown = [(index, stage) for index, stage in enumerate(stages, start=before) if stage]
        for n, (index, stage) in enumerate(shown):
            add(STAGE, index, f"{name} {stage}", 1, partner, away, len(of_sides) + n)
        before += len(stages)
    for k, (vehicle, name) in enumerate(vehicles):
        for n, of_vehicle in enumerate(with_column(of_vehicles)):
            add(of_vehicle, vehicle, name, 2, k >= n_moving, k if k < n_moving else k - n_moving, n)
        for quantities, things in parts[k]:
            for of_part in with_column(quantities):
                for n, (index, thing) in enumerate(things, start=len(of_vehicles)):
                    add(of_part, index, thing, 2, k >= n_moving, k if k < n_moving else k - n_moving, n)
    return columns, sources


@cache
def of_interfaces(quantities: tuple[Quantity, ...], draws: bool) -> tuple[Quantity, ...]:
    """The quantities of an interface that have a column, with draw gear or without."""
    return tuple(q for q in with_column(quantities) if draws or q.key != "peak_pull")


@cache
def with_column(quantities: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """Those that have a column."""
    return tuple(q for q in quantities if q.column)


_ALONG = "vehicles move along the track only: state plane: vertical"
_WITHOUT = {
    "no vehicle of the scenario has a body that gives": r"bod(y|ies)_|.*_(member|bogie)_\d|.*_[MS]\d+_\d",
    _ALONG: r"(met_)?step_|slip_|tie_force_|swing_moment_|pitch_|"
    r"heave_|wheel_(lift|load)_|(lift|load)_[MS]\d+_wheelset|largest_(step|wheel)|least_wheel|damped_",
    "the scenario does not state simulation.averaging_ms": "averaged_device_|TAMA_averaged",
}
"""Why a collision may have none of the responses whose names begin like a pattern."""


def only_in_plane(name: str) -> bool:
    """Whether a response of this name would be one of the vertical plane."""
    return why_absent(name, ()) == _ALONG


def in_place_of(name: str, known: Iterable[str]) -> str:
    """The end of a message about a name that no response has: how to have it, the nearest one, or all of them."""
    names = tuple(known)
    why = why_absent(name, names)
    return f"; {why}" if why else close_match(name, names)


def why_absent(name: str, known: Iterable[str]) -> str:
    """What a scenario does not state for the sake of a response; empty if it would not have one of the name anyway."""
    names = tuple(known)
    for why, pattern in _WITHOUT.items():
        if re.match(pattern, name) and not any(re.match(pattern, other) for other in names):
            return why
    flight = re.match(r"SIV_(?:time_)?(\d+)mm", name)
    if flight and not any(other.startswith(flight[0]) for other in names):
        return f"the scenario does not state {flight[1]} under occupants.free_flight_mm"
    return ""


def matching(patterns: Iterable[str], columns: Mapping[str, Column]) -> dict[str, Column]:
    """The columns that names or patterns choose, in their own order.

    Args:
        patterns: such as ``"TS_mm"`` or ``"stroke_*"``.
        columns: that there are, by name.

    Raises:
        InputError: if one chooses none.
    """
    patterns = listed(patterns)
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in columns):
            raise InputError(f"responses: no response is called {pattern!r}{in_place_of(pattern, columns)}")
    return fitting(patterns, columns)


def fitting(patterns: Iterable[str], columns: Mapping[str, Column]) -> dict[str, Column]:
    """The same, but for names and patterns that choose none."""
    patterns = listed(patterns)
    return {name: c for name, c in columns.items() if any(fnmatchcase(name, pattern) for pattern in patterns)}


def no_number(thing: Column | Quantity, chain: Chain) -> str:
    """Why a response or quantity of a chain is not a number, and the cure; empty if it is one."""
    quantity = thing if isinstance(thing, Quantity) else of_each(chain).get(thing.quantity)
    if quantity is None or quantity.is_number(chain):
        return ""
    return (
        f"{thing.name} is not a number with simulation.record_every_ms = {chain.record_interval / MS:g}, too far apart "
        f"for its filter, window or flight: take at most {int(quantity.interval * 1e4) / 10:g}"
    )


def no_limit(thing: Column | Quantity) -> str:
    """Why a response or quantity can have no limit, and the cure; empty if it can have one."""
    quantity = thing.quantity if isinstance(thing, Column) else thing.name
    if quantity not in {q.name for q in (*TRAIN, *UPRIGHT, *WHEELSET) if q.least}:
        return ""
    return (
        "is worst where it is least, and a limit is the largest magnitude that is allowed: state wheel_lift_mm, or "
        "judge the number by yourself"
    )


def ordered(columns: Iterable[Column]) -> list[Column]:
    """Columns of several chains in the order of one table, each once."""
    return sorted(dict.fromkeys(columns), key=lambda column: (column.place, column.name))
