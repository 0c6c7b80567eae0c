"""What a collision left behind, as its quantities need it: vehicles as arrays, interfaces side by side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trainmj.collision.block import Tally
from trainmj.collision.chain import WALL, Chain, name_of_side, places_of_sides
from trainmj.collision.device import Array
from trainmj.units import MM


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
        """What is missing in the balance of energy, relative to what the collision can convert.

        The forces times the travel of a step give back the kinetic energy exactly, by the way the step is made, and
        would prove nothing. The absorbed energy is therefore added up from the law; it closes the balance only where
        the step is small enough.
        """
        start, end = self.kinetic
        absorbed, friction = float(self.tally.dissipated.sum()), float(self.tally.friction_work.sum())
        return (start - end - self.elastic - absorbed - friction) / self.convertible

    @cached_property
    def curve_error(self) -> tuple[float, Side]:
        """The largest difference between what a device absorbed and the area below its curve, and where it is.

        Relative to what the collision can convert. The area is that up to the largest stroke, less what the device
        gives back; a dashpot may add to it. It comes from the curve of the device alone, so it does not hide a path of
        two devices in series that is not theirs, or steps that jumped over a part of the curve.
        """
        excess = [side.energy - side.energy_by_curve for side in self.sides]
        damped = [side.interface.envelope.damping > 0.0 for side in self.sides]
        errors = [max(0.0, -more) if dashpot else abs(more) for more, dashpot in zip(excess, damped, strict=True)]
        worst = int(np.argmax(errors))  # of NaN, the first
        return errors[worst] / self.convertible, self.sides[worst]

    @cached_property
    def convertible(self) -> float:
        """The kinetic energy that a plastic collision takes [J].

        That is the energy about the common centre of mass, or all of it at a wall: two trains that travel together
        cannot hide an error in it.
        """
        mass, speed = self.chain.mass, self.chain.speed
        common = 0.0 if self.chain.interfaces[-1].right == WALL else float((speed * mass).sum() / mass.sum())
        return float(0.5 * np.sum(mass * (speed - common) ** 2))

    @cached_property
    def momentum_error(self) -> float:
        """Momentum less the impulses of rails and wall, relative to the sum of ``|m v|`` at the start."""
        mass, speed = self.chain.mass, self.chain.speed
        momentum = float(np.sum(mass * (self.tally.speed - speed))) - self.tally.impulse
        return float(momentum / np.sum(mass * np.abs(speed)))

    def mean_deceleration(self) -> Array:
        """(n_vehicle,) from the first to the last force at the front [m/s2]."""
        front, tally = self.chain.front, self.tally
        duration = float(tally.last_force_time[front] - tally.first_force_time[front])
        change = np.abs(tally.speed_last - tally.speed_first)
        return np.asarray(change / duration if duration > 0.0 else np.zeros_like(change))

    def balance_time(self) -> Array:
        """(n_vehicle,) when the interface on the side of the impact had its largest stroke [s]."""
        n = self.chain.n_moving
        ahead = [i if i < n else i - 1 for i in range(len(self.chain.vehicles))]
        return np.asarray(self.tally.stroke_max_time[ahead])


class Side:
    """One interface as it is reported, or one train's side of the front."""

    def __init__(self, measured: Measured, index: int, side: int) -> None:
        """Look at one side of the interface of an index."""
        self._tally, self._index, self._side = measured.tally, index, side
        self.interface = measured.chain.interfaces[index]
        self.device = self.interface.devices[side]
        self._largest = float(measured.tally.stroke_max[index])
        self.stroke = self.interface.side_largest(self._largest, side)

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
        return max(0.0, float(self.interface.side_stroke(self._largest, self._side)) - back)

    @cached_property
    def energy(self) -> float:
        """Absorbed energy [J]."""
        share = self.interface.energy_shares(np.array([self._largest]))[self._side]
        return float(share[0] * self._tally.dissipated[self._index])

    @property
    def energy_by_curve(self) -> float:
        """Area below the device's own curve, climbed as the law does, up to the stroke, less what it gives back [J]."""
        path = self.device.envelope.climbing
        stroke = max(0.0, self.stroke)
        return path.energy(stroke) - 0.5 * path.force_at(stroke) ** 2 / path.stiffness

    @property
    def crush_mm(self) -> float:
        """Stroke without empty strokes [mm]: what counts in TS."""
        return sum(stage.stroke(self.stroke) / MM for stage in self.device.stages)

    def tallied(self, name: str) -> float:
        """A value of the tally at this interface."""
        return float(getattr(self._tally, name)[self._index])
