"""Free occupants: how fast they are against their vehicle when they have flown a distance in it.

An occupant keeps the speed that the vehicle had at the start of the run, from time 0 on, until it meets what is that
far ahead of it, or behind it. Its way relative to the vehicle is the integral of the recorded speeds over time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from trainmj.collision.deceleration import WINDOW_RECORDS
from trainmj.collision.envelope import Array
from trainmj.units import G

_AT_REST = 1e-6  # relative speed that counts as none: an occupant that slow gets nowhere [m/s]
_HARD = 10 * G  # deceleration under which a flight still has as many records as a window


def longest_interval(distance: float) -> float:
    """Longest time between two records with which a flight over a distance [m] has enough of them [s].

    One jump of the acceleration by 10 g between two records then changes the speed by less than 1e-4 of it.
    """
    return math.sqrt(2.0 * distance / _HARD) / WINDOW_RECORDS


class Flight:
    """The free flights of the occupants of every vehicle.

    Between two records the acceleration is linear. Of the two parabolas through the speeds of an interval and those
    before or behind it the flatter one counts, as the other one has a jump of the acceleration in it.

    Attributes:
        time: (n_sample,) [s], evenly spaced.
        speed: (n_sample, n_vehicle) of the occupant relative to the vehicle, positive forwards [m/s].
        way: (n_sample, n_vehicle) likewise [m].
    """

    def __init__(self, time: Array, velocity: Array, cut: bool = False) -> None:
        """Follow the occupants.

        Args:
            time: (n_sample,) [s], evenly spaced.
            velocity: (n_sample, n_vehicle) of the vehicles [m/s].
            cut: whether the collision was cut off at the last record, so that what follows is not known; otherwise
                the last relative speeds stay.
        """
        self.time, self.speed, self._cut = time, velocity[0] - velocity, cut
        self._interval = float(time[1] - time[0]) if len(time) > 1 else 0.0
        self._bend = np.zeros_like(self.speed[1:])  # second difference of the speed in each interval
        if len(time) > 2:
            bend = np.diff(self.speed, 2, axis=0)
            before, behind = np.vstack([bend[:1], bend]), np.vstack([bend, bend[-1:]])
            self._bend = np.where(np.abs(before) < np.abs(behind), before, behind)
        steps = self._interval * (0.5 * (self.speed[:-1] + self.speed[1:]) - self._bend / 12.0)
        self.way = np.vstack([np.zeros_like(self.speed[:1]), np.cumsum(steps, axis=0)])

    def impacts(self, distance: float) -> tuple[Array, Array]:
        """The impacts after a distance in either direction.

        Args:
            distance: [m].

        Returns:
            (n_vehicle,) relative speeds [m/s], and the times [s]. An occupant that never gets there has the speed 0
            and no time (NaN); one of which that is not known has neither.
        """
        found = np.array([self._impact(i, distance) for i in range(self.speed.shape[1])])
        return found[:, 0], found[:, 1]

    def met(self, i: int, distances: Iterable[float]) -> list[tuple[float, float, float]]:
        """Distance [m], time [s] and relative speed [m/s] of each impact of the occupant of vehicle i."""
        found = [(distance, *self._impact(i, distance)) for distance in distances]
        return [(distance, time, speed) for distance, speed, time in found if math.isfinite(time)]

    def path(self, i: int, distance: float) -> tuple[Array, Array, Array]:
        """Of the occupant of vehicle i, up to the impact after a distance [m] or to the last record before it.

        Returns:
            (n,) times [s], ways relative to the vehicle [m] and relative speeds [m/s], signed.
        """
        there = np.abs(self.way[:, i]) >= distance
        n = int(there.argmax()) if there.any() else len(there)
        time, way, speed = self.time[:n], self.way[:n, i], self.speed[:n, i]
        impact, at = self._impact(i, distance)
        if math.isnan(at):
            return time, way, speed
        sign = math.copysign(1.0, self.speed[min(n, len(there) - 1), i])
        return np.append(time, at), np.append(way, sign * distance), np.append(speed, sign * impact)

    def _impact(self, i: int, distance: float) -> tuple[float, float]:
        """Relative speed and time of the impact in one vehicle."""
        way, speed = self.way[:, i], self.speed[:, i]
        there = np.abs(way) >= distance
        k = int(there.argmax()) - 1
        if k >= 0 and np.isfinite(way[k + 1]):
            return self._within(i, k, distance)
        left, last = distance - float(way[-1] * np.sign(speed[-1])), abs(float(speed[-1]))
        if self._cut or not math.isfinite(left):
            return math.nan, math.nan
        return (last, float(self.time[-1]) + left / last) if last > _AT_REST else (0.0, math.nan)

    def _within(self, i: int, k: int, distance: float) -> tuple[float, float]:
        """The same, of an impact between the records k and k + 1."""
        from scipy.optimize import brentq

        h = self._interval
        start, end = float(self.speed[k, i]), float(self.speed[k + 1, i])
        gain, bend = end - start, float(self._bend[k, i])
        before, behind = float(self.way[k, i]), float(self.way[k + 1, i])
        goal = math.copysign(distance, behind)

        def over(x: float) -> float:
            """How far the way is beyond the distance, at a part of the interval."""
            moved = start * x + gain * x * x / 2.0 + bend * (x**3 / 6.0 - x * x / 4.0)
            return before + h * moved - goal

        x = 1.0 if behind == goal or over(0.0) * over(1.0) >= 0.0 else float(brentq(over, 0.0, 1.0, xtol=1e-14))
        return abs(start + gain * x + bend / 2.0 * x * (x - 1.0)), float(self.time[k]) + h * x
