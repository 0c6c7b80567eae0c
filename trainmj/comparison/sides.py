"""One of two things that are compared: its channels over time, and what computed them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from trainmj.collision.chain import Chain, places_of_sides
from trainmj.collision.channels import channels
from trainmj.collision.deceleration import SETTLED
from trainmj.collision.device import Device
from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary, summarise
from trainmj.units import unit_of

PARTNER = "_partner"


class Series(NamedTuple):
    """A value over time."""

    time: Array  # (n,) [s], growing
    values: Array  # (n,) finite
    unit: str
    origin: str = ""  # of a test: column and unit that it was made of; empty if that is called like it, in its unit

    def at(self, time: Array) -> Array:
        """Values in between, on straight lines; asked for within the series only."""
        return np.interp(time, self.time, self.values)

    @property
    def interval(self) -> float:
        """The longest time from one value to the next [s]."""
        return float(np.diff(self.time).max())


@dataclass(frozen=True)
class Side:
    """A result or a test.

    Attributes:
        name: as it was given.
        channels: by name, unit included: ``velocity_M1_km_h``, ``stroke_S1_M1_mm``.
        result: None of a test.
        left_out: columns of a test that no channel was made of.
        clock: column that the times of a test are made of, and how; empty if each channel states its own.
    """

    name: str
    channels: Mapping[str, Series]
    result: Result | None = None
    left_out: tuple[str, ...] = field(default=())
    clock: str = ""

    @cached_property
    def summary(self) -> Summary | None:
        """The numbers of a result; None of a test."""
        return None if self.result is None else summarise(self.result)

    def shifted(self, offset: float) -> Self:
        """The same by a clock that is ahead by so much [s]."""
        moved = {name: one._replace(time=one.time + offset) for name, one in self.channels.items()}
        return replace(self, channels=moved)


def of_result(name: str, result: Result) -> Side:
    """The channels of a result at its recorded times, as far as they are valid."""
    table, filtered = result.table(both_sides=True), channels(result)
    valid = result.tally.valid_until
    found = {channel_name(head): (table[head], valid) for head in table.columns if head not in ("time_s", "valid")}
    for head in filtered.columns:
        if "cfc60" in head:  # the filter looks ahead
            found[head] = (filtered[head], valid - SETTLED)
    series = {}
    for key, (column, until) in found.items():
        values = column.to_numpy(dtype=np.float64)
        there = np.isfinite(values) & (result.time <= until)
        if there.sum() > 1:
            series[key] = Series(result.time[there], values[there], unit_of(key))
    return Side(name, series, result)


def channel_name(text: str) -> str:
    """The name of a channel as it is written here: ``stroke_S1_M1_mm`` for ``stroke_S1-M1_mm``."""
    return text.strip().replace("-", "_").replace(" ", "_")


class Place(NamedTuple):
    """A device at an interface, as it is reported."""

    name: str  # S1-M1, or S1-M1 partner
    device: Device
    twin: bool = False  # the partner's side of a front whose sides are equal

    def channel(self, side: Side, quantity: str, unit: str) -> Series | None:
        """A channel of it: stroke, force or energy; both sides of a front have the same force."""
        key = f"{quantity}_{channel_name(self.name)}"
        if quantity == "force":
            own = side.channels.get(f"{key}_{unit}")
            return own or side.channels.get(f"{key.removesuffix(PARTNER)}_{unit}")
        return side.channels.get(f"{key}_{unit}")


def places(chain: Chain) -> Iterator[Place]:
    """Every device, both sides of the front."""
    front = chain.interfaces[chain.front]
    for k, side in places_of_sides(chain):
        interface = chain.interfaces[k]
        yield Place(interface.sides[side], interface.devices[side])
        if k == chain.front and front.equal_sides:
            yield Place(f"{front.name} partner", front.devices[1], twin=True)
