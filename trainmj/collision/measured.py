"""What a collision left behind, as its quantities need it: vehicles as arrays, interfaces side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trainmj.collision.block import Tally
from trainmj.collision.body import plastic_over
from trainmj.collision.chain import WALL, Chain, n_own_sides, places_of_sides
from trainmj.collision.device import Stage
from trainmj.collision.envelope import Array
from trainmj.collision.fields import KEPT, LASTING
from trainmj.collision.kind import Law
from trainmj.collision.line import Line
from trainmj.collision.measured_plane import InPlane
from trainmj.collision.occupants import Flight
from trainmj.units import MM

UNSTABLE = 1e-3
"""A balance of energy, or of a device with its curve, that is further off makes a run unstable.

It is relative to the energy that the collision can convert.
"""

MOMENTUM, MOMENTUM_IN_PLANE = 1e-9, 5e-6
"""Most by which the balance of momentum may be off, relative to the sum of ``|m v|``: along the track it is kept to
round-off; in the vertical plane, where masses move against each other within a step, its error falls with the step.
"""

UNSEEN = 1e-3
"""Relative excess of a peak between two steps, over the largest at any step, that counts as unseen."""


def convertible(chain: Chain, speed: Array) -> float:
    """The kinetic energy that a plastic collision takes at some speeds of the vehicles, (n_vehicle,) [m/s], in J.

    That is the energy about the common centre of mass, or all of it at a wall: two trains that travel together cannot
    hide an error in it.
    """
    if chain.interfaces[-1].right == WALL:
        return float(0.5 * np.sum(chain.mass * speed**2))
    return spread(chain.mass, speed)


def spread(mass: Array, speed: Array) -> float:
    """The kinetic energy of masses about their common centre, both (n,) [kg, m/s], in J; 0 of none."""
    common = float((speed * mass).sum() / mass.sum()) if len(mass) else 0.0
    return float(0.5 * np.sum(mass * (speed - common) ** 2))


@dataclass(frozen=True, eq=False)
class Measured:
    """What a collision left behind, as its quantities need it."""

    chain: Chain  # what was collided
    tally: Tally  # from every step
    time: Array  # (n_sample,) [s], evenly spaced
    velocity: Array  # (n_sample, n_vehicle) [m/s]

    @cached_property
    def sides(self) -> tuple[Side, ...]:
        """Every interface; the front as one side's, or as both where these are not equal."""
        return tuple(Side(self, k, side) for k, side in places_of_sides(self.chain))

    @property
    def own_sides(self) -> tuple[Side, ...]:
        """Those of the moving train."""
        return self.sides[: n_own_sides(self.chain)]

    @cached_property
    def kinetic(self) -> tuple[float, float]:
        """Kinetic energy at the start and at the end [J]."""
        mass = self.chain.point_mass
        if self.chain.plane:
            return float(0.5 * np.sum(mass * self.chain.point_speed**2)), self.plane.kinetic
        start, end = (float(0.5 * np.sum(mass * v**2)) for v in (self.chain.point_speed, self.tally.point_speed))
        return start, end

    @cached_property
    def plane(self) -> InPlane:
        """What the vertical plane adds."""
        return InPlane(self.chain, self.tally)

    @cached_property
    def laws(self) -> tuple[Used, ...]:
        """Every law with what is left of it, in the order of the records."""
        return tuple(
            Used(self.tally, law, record, 1.0 / element.share, element.breaks < np.inf)
            for interface, records in zip(self.chain.interfaces, self.chain.records, strict=True)
            for element, places in zip(interface.elements, records, strict=True)
            for law, record in zip(element.laws, places, strict=True)
        )

    def stored(self, store: str) -> float:
        """Energy that devices still hold at the end [J], in one way: elastic, or in gas."""
        return float(sum(used.stored for used in self.laws if used.law.kind.store == store))

    def lost(self, loss: str) -> float:
        """Energy lost in devices other than by speed [J], in one way: crushed, or by friction."""
        return float(sum(used.lost - used.viscous for used in self.laws if used.law.kind.loss == loss))

    @property
    def viscous(self) -> float:
        """Energy lost in devices by speed [J]: in dashpots and orifices."""
        return float(sum(used.viscous for used in self.laws))

    @property
    def absorbed(self) -> float:
        """Energy lost in all interfaces [J], what pairs set free as they snap included."""
        return float(self.tally.dissipated.sum())

    @cached_property
    def body_plastic(self) -> tuple[Array, Array]:
        """(n_vehicle,) plastic shortening of the body [m], and the largest within a length of it; 0 without one."""
        whole, within = np.zeros(len(self.chain.vehicles)), np.zeros(len(self.chain.vehicles))
        for i, vehicle in enumerate(self.chain.vehicles):
            if vehicle.body is None:
                continue
            of_body = self.chain.members_of(i)
            plastic = self.tally.member_plastic[of_body]
            whole[i] = plastic.sum()
            within[i] = plastic_over([self.chain.members[k].span or (0.0, 0.0) for k in of_body], plastic.tolist())
        return whole, within

    def body_peak(self) -> Array:
        """(n_vehicle,) largest |acceleration| of any point of the body [m/s2], by all forces; bogies left out."""
        peaks = self.tally.total_peak.copy()
        for i, vehicle in enumerate(self.chain.vehicles):
            if vehicle.body is not None:
                peaks[i] = self.tally.point_peak[self.chain.edge(i, 0) : self.chain.edge(i, 1) + 1].max()
        return np.asarray(peaks)

    def body_energy(self) -> Array:
        """(n_vehicle,) energy lost in the body of each vehicle [J]."""
        of_vehicle = [member.vehicle for member in self.chain.members]
        return np.bincount(of_vehicle, self.tally.member_dissipated, len(self.chain.vehicles)).astype(np.float64)

    @property
    def in_bodies(self) -> float:
        """Energy that bodies still hold at the end [J]."""
        stiffness = np.array([member.stiffness for member in self.chain.members])
        return float(np.sum(0.5 * self.tally.member_force**2 / stiffness))

    @property
    def lost_in_bodies(self) -> float:
        """Energy lost in bodies, by yielding and by damping [J]."""
        return float(self.tally.member_dissipated.sum())

    @cached_property
    def energy_error(self) -> float:
        """What is missing in the balance of energy, relative to what the collision can convert.

        The forces times the travel of a step give back the kinetic energy exactly, by the way the step is made, and
        would prove nothing. The absorbed energy is therefore added up from the law; it closes the balance only where
        the step is small enough.
        """
        start, end = self.kinetic
        left = self.stored("elastic") + self.stored("gas") + self.in_bodies + self.lost_in_bodies
        rails = float(self.tally.friction_work.sum()) + float(self.tally.brake_work.sum())
        if self.chain.plane:
            left += self.plane.raised + self.plane.damped + self.plane.held + self.plane.lost
        return (start - end - left - self.absorbed - rails - float(self.tally.grade_work.sum())) / self.convertible

    @cached_property
    def curve_error(self) -> tuple[float, Side]:
        """The largest difference between what a device absorbed and the area below its curve, and where it is.

        Relative to what the collision can convert. The area is that up to the largest stroke, less what the device
        gives back; a dashpot may add to it. It comes from the curve of the device alone, so it does not hide steps that
        jumped over a part of the curve. Devices whose force depends on the rate, or that recover, have no such area.
        """
        worst, where = 0.0, self.sides[0]
        for side in self.sides:
            for used in side.laws:
                more = used.beside_curve
                error = max(0.0, -more) if used.damped else abs(more)
                if not error <= worst:  # NaN counts
                    worst, where = error, side
        return worst / self.convertible, where

    @cached_property
    def jumped(self) -> bool:
        """Whether steps passed a peak of a curve unseen that would have been the largest, or a part of a curve."""
        tally = self.tally
        unseen = (tally.unseen_peak > tally.device_peak * (1.0 + UNSEEN)).any()
        unseen |= (tally.unseen_force > tally.force_max * (1.0 + UNSEEN)).any()
        return bool(unseen) or not (abs(self.energy_error) <= UNSTABLE and self.curve_error[0] <= UNSTABLE)

    @cached_property
    def convertible(self) -> float:
        """The kinetic energy that a plastic collision takes [J]."""
        return convertible(self.chain, self.chain.speed)

    @cached_property
    def momentum_error(self) -> float:
        """Momentum less the impulses of rails and wall, relative to the sum of ``|m v|`` at the start."""
        mass, speed = self.chain.mass, self.chain.speed
        if self.chain.plane:
            momentum = self.plane.momentum - float(np.sum(mass * speed)) - self.tally.impulse
        else:
            momentum = float(np.sum(mass * (self.tally.speed - speed))) - self.tally.impulse
        return float(momentum / np.sum(mass * np.abs(speed)))

    @property
    def window_peak(self) -> Array:
        """(n_vehicle,) largest |mean| of the acceleration by the devices over windows from time 0 on [m/s2].

        The devices push no more behind the end of a run that is over, in which the last window may end. A run that
        was cut off has only its whole windows; nan if there is none.
        """
        if not self.tally.over:
            whole = self.tally.time > self.chain.window * (1.0 - 1e-9)
            return self.tally.window_peak if whole else np.full_like(self.tally.window_peak, np.nan)
        last = np.abs(self.tally.window_impulse) / (self.chain.window * self.chain.mass)
        return np.asarray(np.maximum(self.tally.window_peak, last))

    @cached_property
    def contacts(self) -> tuple[Array, Array, Array]:
        """Start [s], end [s] and mean acceleration [m/s2] of the contact windows of every vehicle.

        (n_vehicle, KEPT + 1) each, 0 where there is none; in the last place the one that is open at the end of the run,
        up to there.
        """
        tally = self.tally
        is_open = (tally.open != 0.0) & (tally.time > tally.open_start)
        last = np.where(is_open, [tally.open_start, np.full_like(tally.open_start, tally.time)], 0.0)
        mass_times = np.where(is_open, self.chain.mass * (last[1] - last[0]), 1.0)
        means = np.where(is_open, np.abs(tally.open_impulse), 0.0) / mass_times
        kept = tally.contact_start, tally.contact_end, tally.contact_mean
        start, end, mean = (np.column_stack(parts) for parts in zip(kept, (*last, means), strict=True))
        return start, end, mean

    @property
    def n_contacts(self) -> Array:
        """(n_vehicle,) contact windows, those included that are not kept."""
        return np.asarray(self.tally.contacts + (self.contacts[1][:, -1] > 0.0))

    def contacts_of(self, i: int) -> Iterator[tuple[float, float, float, bool]]:
        """Start [s], end [s] and mean [m/s2] of the contact windows of vehicle i, and whether it was cut off there."""
        places = [*range(min(int(self.tally.contacts[i]), KEPT)), KEPT]
        windows = (values[i, places].tolist() for values in self.contacts)
        for k, start, end, mean in zip(places, *windows, strict=True):
            if end > 0.0:
                yield start, end, mean, k == KEPT

    def mean_deceleration(self) -> Array:
        """(n_vehicle,) over the first contact window [m/s2]; 0 if there is none."""
        mean = self.contacts[2]
        return np.where(self.tally.contacts > 0.0, mean[:, 0], mean[:, -1])

    def worst_mean_deceleration(self) -> Array:
        """(n_vehicle,) largest over any contact window that lasts at least LASTING [m/s2]; 0 if none does."""
        start, end, mean = self.contacts
        return np.asarray(np.where(end - start >= LASTING, mean, 0.0).max(axis=1))

    def front_mean_deceleration(self) -> Array:
        """(n_vehicle,) from the first to the last force at the front [m/s2], rail friction and brakes included."""
        front, tally = self.chain.front, self.tally
        duration = float(tally.last_force_time[front] - tally.first_force_time[front])
        change = np.abs(tally.speed_last - tally.speed_first)
        return np.asarray(change / duration if duration > 0.0 else np.zeros_like(change))

    @cached_property
    def flight(self) -> Flight:
        """The free flights of the occupants."""
        return Flight(self.time, self.velocity, cut=not self.tally.over)

    def balance_time(self) -> Array:
        """(n_vehicle,) when the interface on the side of the impact had its largest stroke [s]."""
        n = self.chain.n_moving
        ahead = [i if i < n else i - 1 for i in range(len(self.chain.vehicles))]
        return np.asarray(self.tally.stroke_max_time[ahead])


class Used:
    """A law, and what a collision has left of it."""

    def __init__(self, tally: Tally, law: Law, record: int, times: float, breaks: bool) -> None:
        """Look at a record of the tally, which stands for a number of equal devices."""
        self.law, self.breaks = law, breaks
        self._tally, self._record, self._times = tally, record, times

    def left(self, name: str) -> float:
        """A value of the record."""
        return float(getattr(self._tally, f"element_{name}")[self._record])

    @property
    def stroke(self) -> float:
        """Largest stroke [m]."""
        return self.left("stroke_max")

    @property
    def stored(self) -> float:
        """Energy that all the devices it stands for hold [J]; none where it has broken."""
        if self.breaks and self.left("force") == 0.0:
            return 0.0
        state = self.left("stroke"), self.left("force"), self.left("state_0"), self.left("state_1")
        return float(self._times * self.law.kind.stored(self.law, *state))

    @property
    def lost(self) -> float:
        """Energy that they have lost [J]."""
        return self._times * self.left("dissipated")

    @property
    def viscous(self) -> float:
        """The part of it lost by speed [J]."""
        return self._times * self.left("viscous")

    @property
    def permanent(self) -> float:
        """Stroke that remains of one device [m]."""
        back = self.stroke - float(self.law.kind.permanent(self.law, self.left("state_0"), self.left("state_1")))
        return max(0.0, self.stroke - back)

    @property
    def damped(self) -> bool:
        """Whether a dashpot may add to what it absorbed."""
        return self.law.loading.damping > 0.0

    def _absorbed(self, stroke: float) -> float:
        """What one device absorbs up to a stroke [m] by its curve of first loading at rest [J].

        That is the area below it, climbed as the law does, less what it gives back.
        """
        path = self.law.loading.climbing
        force = path.force_at(stroke)
        return path.energy(stroke) - 0.5 * force * force / path.stiffness

    def within(self, start: float, stroke: float) -> float:
        """Energy that a stage has absorbed [J], which begins at a stroke of the law and has one of its own [m].

        By the curve of first loading at rest; speed may add to it.
        """
        return max(0.0, self._absorbed(start + stroke) - self._absorbed(start))

    @property
    def beside_curve(self) -> float:
        """What one device absorbed beside the area below its curve [J]; 0 where the area says nothing."""
        if not self.law.kind.follows or self.breaks:
            return 0.0
        return self.left("dissipated") - self._absorbed(max(0.0, self.stroke))


class Side:
    """One interface as it is reported, or one train's side of the front."""

    def __init__(self, measured: Measured, index: int, side: int) -> None:
        """Look at one side of the interface of an index."""
        self._tally, self._index, self._side = measured.tally, index, side
        self.interface = measured.chain.interfaces[index]
        self.device = self.interface.devices[side]
        pushing: list[Used] = []
        pulling: list[Used] = []
        for element, places in zip(self.interface.elements, measured.chain.records[index], strict=True):
            own = element.law_of(side, self.interface.two_sided)
            if own is None:
                continue  # the draw gear is that of the other side
            used = Used(measured.tally, element.laws[own], places[own], 1.0, element.breaks < np.inf)
            (pushing if element.sign > 0 else pulling).append(used)
        self.laws = (*pushing, *pulling)
        self._pulling = tuple(pulling)
        self._lines, self._places = measured.chain.lines, measured.chain.lines_of(index)
        self._paths = list(zip(self.interface.paths(side), pushing, strict=True))

    @property
    def name(self) -> str:
        """Of the interface, and of its side where both are reported."""
        return self.interface.sides[self._side]

    @cached_property
    def stroke(self) -> float:
        """Largest stroke of its device [m]; behind a shear-off, that by which the next path is pressed."""
        stroke = 0.0
        for path, used in self._paths:
            if path.start == 0.0:
                stroke = used.stroke
            elif used.stroke > 0.0:
                stroke = path.start + used.stroke
            else:
                return min(stroke, path.start)
        return stroke

    @property
    def stages(self) -> Iterator[tuple[Stage, float, float]]:
        """Each stage, its largest stroke [m] and the energy that it absorbed [J].

        The first stage of a law has what the others, by the curve, have not.
        """
        for path, used in self._paths:
            strokes = [stage.stroke(path.start + used.stroke) for stage in path.stages]
            others = [
                used.within(stage.start - path.start, stroke)
                for stage, stroke in zip(path.stages[1:], strokes[1:], strict=True)
            ]
            yield from zip(path.stages, strokes, [max(0.0, used.lost - sum(others)), *others], strict=True)

    @property
    def end_time(self) -> float:
        """When its curve ended, if nothing is stated behind it [s]; infinite if it did not."""
        times = [used.left("end_time") for used in self.laws]
        return min((time for time in times if time >= 0.0), default=np.inf)

    @property
    def drawn_out(self) -> bool:
        """Whether that of its draw gear did."""
        return any(used.left("end_time") >= 0.0 for used in self._pulling)

    @property
    def permanent(self) -> float:
        """Permanent set [m]."""
        found = 0.0
        for path, used in self._paths:
            if path.start == 0.0 or used.stroke > 0.0:
                found = path.start + used.permanent
        return found

    @property
    def energy(self) -> float:
        """Absorbed energy [J]."""
        return sum(used.lost for used in self.laws)

    @property
    def energy_by_curve(self) -> float:
        """What it would have absorbed by its curves alone [J]."""
        return sum(used.lost - used.beside_curve for used in self.laws)

    @property
    def crush_mm(self) -> float:
        """Stroke without empty strokes [mm]: what counts in TS."""
        return sum(stroke / MM for _, stroke, _ in self.stages)

    def of_ends(self, name: str) -> float:
        """A value of the tally at this interface, in the vertical plane."""
        return float(getattr(self._tally, f"ends_{name}")[self._index])

    def of_lines(self, name: str) -> float:
        """The largest value of the tally at its lines."""
        return float(getattr(self._tally, f"line_{name}")[self._places].max())

    @property
    def met_step(self) -> float:
        """Step of the faces of the last path when they first carried force [m]; nan if they never did."""
        last = self._places.start + len(self._paths) - 1
        return math.nan if self._lines[last].strut else self._met(last)

    def _met(self, place: int) -> float:
        """Step of the faces of a line when they first carried force [m]; nan if they never did."""
        return abs(float(self._tally.line_met[place])) if self._tally.line_met_time[place] >= 0.0 else math.nan

    @property
    def faces(self) -> Iterator[tuple[str, Line, float, float]]:
        """Stages that have faces, their lines, the step when they first carried force [m], and when one slid off [s].

        nan stands for what never happened.
        """
        for stage, place in self._on_lines:
            if not self._lines[place].strut:
                off = float(self._tally.line_off_time[place])
                yield stage, self._lines[place], self._met(place), off if off >= 0.0 else math.nan

    @property
    def slid(self) -> Iterator[tuple[str, Line, float]]:
        """Stages whose faces slid off each other, or whose pins met, their lines, and when they did [s]."""
        for stage, place in self._on_lines:
            if self._tally.line_off_time[place] >= 0.0:
                yield stage, self._lines[place], float(self._tally.line_off_time[place])

    @property
    def _on_lines(self) -> Iterator[tuple[str, int]]:
        """The stage that comes first on each path, with the place of its line; none along the track."""
        if self._lines:
            for place, (path, _) in enumerate(self._paths, start=self._places.start):
                yield path.stages[0].name, place

    def tallied(self, name: str) -> float:
        """A value of the tally at this interface."""
        return float(getattr(self._tally, name)[self._index])
