"""What the collisions of a lot left behind, as their quantities need it: cases and vehicles as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Self

import numpy as np

from trainmj.collision.block import Layout, Tallies, Tally
from trainmj.collision.body import plastic_over
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.elementwise import picked, total
from trainmj.collision.envelope import Array, BoolArray, IntArray
from trainmj.collision.fields import KEPT, LASTING
from trainmj.collision.lot import Chains, Lot
from trainmj.collision.measured_plane import InPlane
from trainmj.collision.occupants import Flight
from trainmj.collision.sides import Sides
from trainmj.collision.used import Used

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


def convertible(walled: bool, mass: Array, speed: Array) -> Array:
    """The kinetic energy that a plastic collision takes, (...) of masses and speeds (..., n_vehicle) [kg, m/s], in J.

    That is the energy about the common centre of mass, or all of it at a wall: two trains that travel together cannot
    hide an error in it.
    """
    return np.asarray(0.5 * total(mass * speed**2)) if walled else spread(mass, speed)


def spread(mass: Array, speed: Array) -> Array:
    """The kinetic energy (...) of masses about their common centre, both (..., n) [kg, m/s], in J; 0 of none."""
    common = total(speed * mass) / total(mass) if mass.shape[-1] else np.zeros(mass.shape[:-1])
    return np.asarray(0.5 * total(mass * (speed - common[..., None]) ** 2))


class Measured:
    """What the collisions of a lot left behind, as their quantities need it.

    Arrays have an axis of the cases before all others.

    Attributes:
        lot: what was collided.
        chain: of the first case, for what is the same in all of them.
        tally: from every step.
        recorded: (n_case,) speeds of each case at its records, (n_record, n_vehicle) [m/s]; fastest where those of a
            vehicle are side by side in memory.
    """

    def __init__(self, lot: Lot, tally: Tallies, recorded: Sequence[Array]) -> None:
        """Take what was collided, the tallies and the records."""
        self.lot, self.chain = lot, lot.chain
        self.tally, self.recorded = tally, recorded
        self._time = self.chain.record_times(max(map(len, recorded)))
        self._impacts: dict[float, tuple[Array, Array]] = {}

    @classmethod
    def of(cls, lot: Lot, layout: Layout, blocks: Array, recorded: Sequence[Array]) -> Self:
        """From the blocks (n_case, size) of simulations, which must not change any more, and what they recorded."""
        return cls(lot, Tallies.of(layout, blocks), recorded)

    @classmethod
    def of_one(cls, chain: Chain, tally: Tally, time: Array, velocity: Array) -> Self:
        """Of one collision.

        Args:
            chain: what was collided.
            tally: from every step.
            time: (n_sample,) [s], evenly spaced.
            velocity: (n_sample, n_vehicle) [m/s].
        """
        found = cls(Chains([0], [chain]), Tallies.of_one(tally), [np.asfortranarray(velocity)])
        found._time = time
        return found

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self.recorded)

    def take(self, places: IntArray) -> Measured:
        """Some of the cases, in this order."""
        if np.array_equal(places, np.arange(len(self))):
            return self
        lot = self.lot.take(places.tolist())
        return Measured(lot, self.tally.take(places), [self.recorded[place] for place in places])

    # what was collided

    @cached_property
    def mass(self) -> Array:
        """(n_case, n_vehicle) masses [kg]."""
        return self.lot.values(lambda chain: chain.mass)

    @cached_property
    def speed(self) -> Array:
        """(n_case, n_vehicle) initial speeds [m/s]."""
        return self.lot.values(lambda chain: chain.speed)

    @cached_property
    def convertible(self) -> Array:
        """(n_case,) the kinetic energy that a plastic collision takes [J]."""
        return convertible(self.chain.interfaces[-1].right == WALL, self.mass, self.speed)

    @cached_property
    def used(self) -> Used:
        """Every law with what is left of it, in the order of the records."""
        return Used(self.lot, self.tally)

    @cached_property
    def sides(self) -> Sides:
        """Every interface; the front as one side's, or as both where these are not equal."""
        return Sides(self.lot, self.tally, self.used)

    @cached_property
    def plane(self) -> InPlane:
        """What the vertical plane adds."""
        return InPlane(self.lot, self.tally)

    # energy and momentum

    @cached_property
    def kinetic(self) -> tuple[Array, Array]:
        """(n_case,) kinetic energy at the start and at the end [J]."""
        mass, start = self.lot.values(lambda chain: chain.point_mass), self.speed[:, self.chain.vehicle_of]
        end = self.plane.kinetic if self.chain.plane else 0.5 * total(mass * self.tally.point_speed**2)
        return 0.5 * total(mass * start**2), end

    @property
    def absorbed(self) -> Array:
        """(n_case,) energy lost in all interfaces [J], what pairs set free as they snap included."""
        return total(self.tally.dissipated)

    @property
    def by_rails(self) -> Array:
        """(n_case,) energy taken by rail friction [J]."""
        return total(self.tally.friction_work)

    @property
    def by_brakes(self) -> Array:
        """(n_case,) energy taken by the brakes [J]."""
        return total(self.tally.brake_work)

    @property
    def by_grade(self) -> Array:
        """(n_case,) energy taken by the grade [J]."""
        return total(self.tally.grade_work)

    @cached_property
    def energy_error(self) -> Array:
        """(n_case,) what is missing in the balance of energy, relative to what the collision can convert.

        The forces times the travel of a step give back the kinetic energy exactly, by the way the step is made, and
        would prove nothing. The absorbed energy is therefore added up from the law; it closes the balance only where
        the step is small enough.
        """
        start, end = self.kinetic
        left = self.used.held("elastic") + self.used.held("gas") + self.in_bodies + self.lost_in_bodies
        rails = self.by_rails + self.by_brakes
        if self.chain.plane:
            left = left + (self.plane.raised + self.plane.damped + self.plane.held + self.plane.lost)
        return np.asarray((start - end - left - self.absorbed - rails - self.by_grade) / self.convertible)

    @property
    def curve_error(self) -> Array:
        """(n_case,) the largest difference between what a device absorbed and the area below its curve.

        Relative to what the collision can convert. The area is that up to the largest stroke, less what the device
        gives back; a dashpot may add to it. It comes from the curve of the device alone, so it does not hide steps that
        jumped over a part of the curve. Devices whose force depends on the rate, or that recover, have no such area.
        """
        return np.asarray(self.sides.beside_curves[0] / self.convertible)

    @property
    @np.errstate(all="ignore")
    def jumped(self) -> BoolArray:
        """(n_case,) whether steps passed a peak of a curve unseen that would have been the largest, or a part of it."""
        tally = self.tally
        unseen = (tally.unseen_peak > tally.device_peak * (1.0 + UNSEEN)).any(axis=-1)
        unseen |= (tally.unseen_force > tally.force_max * (1.0 + UNSEEN)).any(axis=-1)
        return np.asarray(unseen | ~((np.abs(self.energy_error) <= UNSTABLE) & (self.curve_error <= UNSTABLE)))

    @property
    def momentum_error(self) -> Array:
        """(n_case,) momentum less the impulses of rails and wall, relative to the sum of ``|m v|`` at the start."""
        mass, speed = self.mass, self.speed
        if self.chain.plane:
            momentum = self.plane.momentum - total(mass * speed) - self.tally.impulse
        else:
            momentum = total(mass * (self.tally.speed - speed)) - self.tally.impulse
        return np.asarray(momentum / total(mass * np.abs(speed)))

    # bodies that give

    @cached_property
    def body_plastic(self) -> tuple[Array, Array]:
        """(n_case, n_vehicle) plastic shortening of the body [m], and the largest within a length of it; 0 if rigid."""
        whole, within = np.zeros_like(self.mass), np.zeros_like(self.mass)
        spans = self.lot.values(lambda chain: [member.span or (0.0, 0.0) for member in chain.members])
        for i, vehicle in enumerate(self.chain.vehicles):
            if vehicle.body is None:
                continue
            of_body = self.chain.members_of(i)
            plastic = picked(self.tally.member_plastic, of_body)
            whole[:, i] = total(plastic)
            rows = zip(spans[:, of_body].tolist(), plastic.tolist(), strict=True)
            within[:, i] = [plastic_over(places, shortened) for places, shortened in rows]
        return whole, within

    def body_peak(self) -> Array:
        """(n_case, n_vehicle) largest |acceleration| of any point of the body by all forces, bogies left out [m/s2]."""
        peaks = self.tally.total_peak.copy()
        for i, vehicle in enumerate(self.chain.vehicles):
            if vehicle.body is not None:
                of_body = slice(self.chain.edge(i, 0), self.chain.edge(i, 1) + 1)
                peaks[:, i] = self.tally.point_peak[:, of_body].max(axis=-1)
        return peaks

    def body_energy(self) -> Array:
        """(n_case, n_vehicle) energy lost in the body of each vehicle [J]."""
        found = np.zeros_like(self.mass)
        for k, member in enumerate(self.chain.members):
            found[:, member.vehicle] += self.tally.member_dissipated[:, k]
        return found

    @property
    def in_bodies(self) -> Array:
        """(n_case,) energy that bodies still hold at the end [J]."""
        stiffness = self.lot.values(lambda chain: [member.stiffness for member in chain.members])
        return total(0.5 * self.tally.member_force**2 / stiffness)

    @property
    def lost_in_bodies(self) -> Array:
        """(n_case,) energy lost in bodies, by yielding and by damping [J]."""
        return total(self.tally.member_dissipated)

    @property
    def used_up(self) -> BoolArray:
        """(n_case, n_vehicle) whether a member of the body was shortened by its whole length."""
        found = np.zeros_like(self.mass, dtype=bool)
        for k, member in enumerate(self.chain.members):
            found[:, member.vehicle] |= self.tally.member_end_time[:, k] >= 0.0
        return found

    # means of the acceleration

    @property
    def window_peak(self) -> Array:
        """(n_case, n_vehicle) largest |mean| of the acceleration by the devices over windows from time 0 on [m/s2].

        The devices push no more behind the end of a run that is over, in which the last window may end. A run that
        was cut off has only its whole windows; nan if there is none.
        """
        window, peak = self.chain.window, self.tally.window_peak
        last = np.abs(self.tally.window_impulse) / (window * self.mass)
        whole = np.where((self.tally.time > window * (1.0 - 1e-9))[:, None], peak, np.nan)
        return np.where(self.tally.is_over[:, None], np.maximum(peak, last), whole)

    @cached_property
    def contacts(self) -> tuple[Array, Array, Array]:
        """Start [s], end [s] and mean acceleration [m/s2] of the contact windows of every vehicle.

        (n_case, n_vehicle, n + 1) each, n as many as any vehicle has of those that are kept, 0 where there is none; in
        the last place the one that is open at the end of the run, up to there.
        """
        tally = self.tally
        most = np.fmax.reduce(tally.contacts, axis=None)
        n = int(min(most, KEPT)) if most > 0.0 else 0
        is_open = (tally.open != 0.0) & (tally.time[:, None] > tally.open_start)
        start = np.where(is_open, tally.open_start, 0.0)
        end = np.where(is_open, tally.time[:, None], 0.0)
        mass_times = np.where(is_open, self.mass * (end - start), 1.0)
        mean = np.where(is_open, np.abs(tally.open_impulse), 0.0) / mass_times
        kept = tally.contact_start, tally.contact_end, tally.contact_mean
        start, end, mean = (
            np.concatenate([values[..., :n], last[..., None]], axis=-1)
            for values, last in zip(kept, (start, end, mean), strict=True)
        )
        return start, end, mean

    @property
    def n_contacts(self) -> Array:
        """(n_case, n_vehicle) contact windows, those included that are not kept."""
        return np.asarray(self.tally.contacts + (self.contacts[1][..., -1] > 0.0))

    def contacts_of(self, case: int, i: int) -> Iterator[tuple[float, float, float, bool]]:
        """Start [s], end [s] and mean [m/s2] of the contact windows of vehicle i, and whether it was cut off there."""
        *windows, last = zip(*(values[case, i].tolist() for values in self.contacts), strict=True)
        for start, end, mean in windows[: int(self.tally.contacts[case, i])]:
            if end > 0.0:
                yield start, end, mean, False
        if last[1] > 0.0:
            yield *last, True

    def mean_deceleration(self) -> Array:
        """(n_case, n_vehicle) over the first contact window [m/s2]; 0 if there is none."""
        mean = self.contacts[2]
        return np.where(self.tally.contacts > 0.0, mean[..., 0], mean[..., -1])

    def worst_mean_deceleration(self) -> Array:
        """(n_case, n_vehicle) largest over any contact window that lasts at least LASTING [m/s2]; 0 if none does."""
        start, end, mean = self.contacts
        return np.asarray(np.where(end - start >= LASTING, mean, 0.0).max(axis=-1))

    def front_mean_deceleration(self) -> Array:
        """(n_case, n_vehicle) from the first to the last force at the front, by all forces [m/s2]."""
        front, tally = self.chain.front, self.tally
        duration = (tally.last_force_time - tally.first_force_time)[:, front, None]
        return np.where(duration > 0.0, np.abs(tally.speed_last - tally.speed_first) / duration, 0.0)

    # histories

    @cached_property
    def histories(self) -> list[tuple[Array, Array, bool]]:
        """Of each case its times (n_sample,), speeds (n_sample, n_vehicle), and whether it was cut off at their end."""
        cut = (~self.tally.is_over).tolist()
        return [(self._time[: len(speeds)], speeds, ends) for speeds, ends in zip(self.recorded, cut, strict=True)]

    def of_histories(self, of: Callable[[Array, Array, bool], Array]) -> Array:
        """(n_case, n_vehicle) what a function makes of times, speeds and whether they were cut off, case by case."""
        return np.array([of(*history) for history in self.histories])

    @cached_property
    def _flights(self) -> list[Flight]:
        """The free flights of the occupants."""
        return [Flight(time, velocity, cut=cut) for time, velocity, cut in self.histories]

    def impacts(self, distance: float) -> tuple[Array, Array]:
        """(n_case, n_vehicle) speeds [m/s] and times [s] of the impacts of occupants after a free flight [m]."""
        if distance not in self._impacts:
            speeds, times = zip(*(flight.impacts(distance) for flight in self._flights), strict=True)
            self._impacts[distance] = np.array(speeds), np.array(times)
        return self._impacts[distance]

    def balance_time(self) -> Array:
        """(n_case, n_vehicle) when the interface on the side of the impact had its largest stroke [s]."""
        n = self.chain.n_moving
        ahead = [i if i < n else i - 1 for i in range(len(self.chain.vehicles))]
        return picked(self.tally.stroke_max_time, ahead)
