"""Channels: what a test records over time and a collision of a batch has too, from recorded speeds of vehicles."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from trainmj.collision.chain import Chain, order_of_vehicles
from trainmj.collision.deceleration import FILTER_INTERVAL, cfc60
from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.collision.saved import result_given
from trainmj.units import KM_H, MS, G, head

if TYPE_CHECKING:
    import pandas as pd


class Trace(NamedTuple):
    """A value over time, at evenly spaced instants."""

    start: float  # first instant [s]
    interval: float  # from one to the next [s]
    before: float  # value at any time before the first one
    after: float  # value behind the last one; NaN if it is not known, where a collision was cut off
    values: Array  # (n,)

    def at(self, time: Array) -> Array:
        """Values at other times (k,) [s], by a cubic spline."""
        from scipy.interpolate import CubicSpline

        place = (np.asarray(time) - self.start) / self.interval
        last = self.values.size - 1
        near = np.clip(place, 0.0, last)
        inside = CubicSpline(np.arange(last + 1.0), self.values)(near) if last > 0 else np.full(near.shape, self.values)
        edge = 1e-6  # of an interval: the last instant is not behind the end
        return np.asarray(np.where(place < -edge, self.before, np.where(place > last + edge, self.after, inside)))

    def packed(self) -> bytes:
        """As a store keeps it."""
        return np.array([*self[:4], *self.values]).tobytes()

    @classmethod
    def unpacked(cls, kept: bytes) -> Trace:
        """What :meth:`packed` made.

        Raises:
            ValueError: if it is something else.
        """
        numbers = np.frombuffer(kept)
        if numbers.size < 5 or not numbers[1] > 0.0:
            raise ValueError("is no trace")
        start, interval, before, after = numbers[:4].tolist()
        return cls(start, interval, before, after, numbers[4:])


class Channel(NamedTuple):
    """What a vehicle has over time."""

    key: str
    unit: str  # of its values
    meaning: str
    of: Callable[[float, Array, bool], Trace]  # of the interval of records, a vehicle's speeds, and whether cut off
    interval: float = math.inf  # longest time between two records with which it is a number [s]

    def no_number(self, chain: Chain) -> str:
        """Why it is not a number with the records of a chain, and the cure; empty if it is one."""
        if chain.record_interval <= self.interval * (1 + 1e-9):
            return ""
        return (
            f"{self.key} is not a number with simulation.record_every_ms = {chain.record_interval / MS:g}: "
            f"take at most {int(self.interval * 1e4) / 10:g}"
        )


def _speed(interval: float, speeds: Array, cut: bool) -> Trace:
    """Speeds are held before the start, and behind the end if the collision was over there."""
    values = speeds / KM_H
    return Trace(0.0, interval, float(values[0]), math.nan if cut else float(values[-1]), values)


def _filtered(interval: float, speeds: Array, cut: bool) -> Trace:
    """The filter looks ahead: there is something before the start, too."""
    first, values = cfc60(interval, speeds[:, None], cut)
    return Trace(first, interval, 0.0, math.nan if cut else 0.0, values[0] / G)


CHANNELS = (
    Channel("velocity", "km/h", "speed along +x, of the centre of mass", _speed),
    Channel(
        "acceleration_cfc60",
        "g",
        "acceleration of the centre of mass along +x, by all forces, behind a CFC 60 filter (SAE J211)",
        _filtered,
        FILTER_INTERVAL,
    ),
)
"""Every channel of a vehicle, once."""


def channels_of(chain: Chain) -> dict[str, tuple[Channel, int]]:
    """Every channel of a chain, and the place of its vehicle, by name: ``velocity_M1_km_h``."""
    return {
        head(f"{channel.key}_{chain.vehicles[i].name}", channel.unit): (channel, i)
        for channel in CHANNELS
        for i in order_of_vehicles(chain)
    }


def channels(result: Result | str | Path) -> pd.DataFrame:
    """Every channel of a computed collision at its recorded times, as the channels of a test are given to identify.

    Args:
        result: what :func:`trainmj.run` gave, or the path of a saved one.

    Returns:
        A row for each record: ``time_s``, then a column for each channel, ``velocity_M1_km_h`` and so on. Channels that
        are no number with these records are left out; a value that is not known, because the collision was cut off, is
        NaN.
    """
    import pandas as pd

    result = result_given(result)
    chain, there = result.chain, channels_of(result.chain).items()
    names = [name for name, (channel, _) in there if not channel.no_number(chain)]
    traces = traces_of(chain, result.velocity, not result.tally.over, names)
    return pd.DataFrame({"time_s": result.time} | {name: trace.at(result.time) for name, trace in traces.items()})


def traces_of(chain: Chain, velocity: Array, cut: bool, names: Sequence[str]) -> dict[str, Trace]:
    """Those of these channels that a collision has.

    Args:
        chain: what was collided.
        velocity: (n_sample, n_vehicle) recorded speeds [m/s].
        cut: whether the collision was cut off at the last record.
        names: of the channels.
    """
    there = channels_of(chain) if names else {}
    of_vehicles = {name: there[name] for name in names if name in there}
    return {name: channel.of(chain.record_interval, velocity[:, i], cut) for name, (channel, i) in of_vehicles.items()}
