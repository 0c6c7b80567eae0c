"""Where the device law keeps its parameters and its state: a block of mjData.userdata for each simulation.

The block is part of MuJoCo's state row, so that every simulation of a batch has devices and plastic states of its
own, and the compiled law needs nothing else. It holds a header, one array per vehicle field, one per interface
field, then the envelopes. All values are float64 in SI.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Self

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.device import Array
from trainmj.collision.identity import code_hash
from trainmj.collision.law import CRUSH

MAGIC = int(code_hash("collision")[:12], 16) + 0.5
"""First value of a block, made from the code of the law; the law leaves any other simulation of the process alone."""


class _Field(IntEnum):
    """A field: its place among those of its kind, with unit and meaning."""

    unit: str  # of its value
    meaning: str  # in words
    tallied: bool  # whether it is part of what a collision leaves behind

    def __new__(cls, unit: str, meaning: str, tallied: bool = False) -> Self:
        """Count the fields in the order in which they are written."""
        field = int.__new__(cls, len(cls.__members__))
        field._value_ = len(cls.__members__)
        field.unit, field.meaning, field.tallied = unit, meaning, tallied
        return field


class Head(_Field):
    """Header fields."""

    MAGIC = "1", "marks the block of a simulation with the device law"
    N_VEHICLE = "1", "vehicles"
    N_INTERFACE = "1", "interfaces"
    N_POINT = "1", "room for the points of each envelope"
    TIME = "s", "time of the last evaluation; -1 before the first", True
    OVER = "1", "1 when no interface carries force or comes closer, or all vehicles stand", True
    IMPULSE = "N s", "impulse of rail friction and wall on all vehicles together", True
    STRIDE = "1", "evaluations from one record of the speeds to the next; 0 for no records"
    DUE = "1", "evaluations until the next record"
    RECORDS = "1", "records taken so far"
    MOST = "1", "records after which the simulation is done"
    DONE = "1", "1 when, at a record, it was over, out of records or not finite: the law rests from then on"
    N_RING = "1", "records that are kept"
    FRONT = "1", "interface at which the two sides meet"


class Car(_Field):
    """Fields of a vehicle."""

    FRICTION_LIMIT = "N", "largest rail friction"
    SPEED = "m/s", "speed at the last evaluation", True
    FRICTION = "N", "rail friction"
    FRICTION_WORK = "J", "work done against rail friction", True
    DEVICE_PEAK = "m/s2", "largest |acceleration| by the devices alone", True
    TOTAL_PEAK = "m/s2", "largest |acceleration|, rail friction included", True
    SPEED_FIRST = "m/s", "speed at the first force at the front", True
    SPEED_LAST = "m/s", "speed at the last force at the front", True


class Joint(_Field):
    """Fields of an interface."""

    LAW = "1", "code of its law"
    STIFFNESS = "N/m", "unloading stiffness"
    DAMPING = "N s/m", "dashpot on the elastic branch"
    STROKE = "m", "stroke at the last evaluation", True
    PLASTIC = "m", "stroke at which the force would vanish: the permanent set", True
    FORCE = "N", "force"
    WORK = "J", "work done on the interface", True
    DISSIPATED = "J", "energy lost by crushing and in the dashpot, added up from the law and not from the work", True
    STROKE_MAX = "m", "largest stroke", True
    STROKE_MAX_TIME = "s", "time of the largest stroke", True
    FORCE_MAX = "N", "largest force", True
    FIRST_FORCE_TIME = "s", "time of the first force; -1 where there was none", True
    LAST_FORCE_TIME = "s", "time of the last force", True
    SEGMENT = "1", "segment of the envelope at which the search starts"


def places(fields: type[IntEnum]) -> Any:
    """The places of fields as plain whole numbers by their names, such as ``places(Head).TIME``."""
    kind: Any = namedtuple("places", [field.name for field in fields])  # type: ignore[misc]
    return kind(*map(int, fields))


@dataclass(frozen=True)
class Layout:
    """Sizes and places of a block for chains of one size."""

    n_vehicle: int  # vehicles
    n_interface: int  # interfaces; as many as vehicles if there is a wall, else one less
    n_point: int  # room for the points of each envelope
    n_ring: int = 0  # latest records of the speeds that the law keeps; with 0 it takes none and never rests

    @classmethod
    def of(cls, chain: Chain, n_point: int = 0, n_ring: int = 0) -> Layout:
        """The layout for a chain, with room for n_point points or for those it has."""
        most = max(i.envelope.stroke.size for i in chain.interfaces)
        return cls(len(chain.vehicles), len(chain.interfaces), max(n_point, most), n_ring)

    @property
    def _joints(self) -> int:
        return len(Head) + len(Car) * self.n_vehicle

    @property
    def _curves(self) -> int:
        return self._joints + len(Joint) * self.n_interface

    @property
    def _ring(self) -> int:
        return self._curves + 3 * self.n_interface * self.n_point

    @property
    def size(self) -> int:
        """Length of the block."""
        return self._ring + self.n_ring * self.n_vehicle

    def car(self, block: Array, field: Car) -> Array:
        """(..., n_vehicle) view of a vehicle field in blocks (..., size)."""
        start = len(Head) + field * self.n_vehicle
        return block[..., start : start + self.n_vehicle]

    def joint(self, block: Array, field: Joint) -> Array:
        """(..., n_interface) view of an interface field in blocks (..., size)."""
        start = self._joints + field * self.n_interface
        return block[..., start : start + self.n_interface]

    def ring(self, block: Array) -> Array:
        """(..., n_ring, n_vehicle) speeds at the latest records, in blocks (..., size); the oldest is overwritten."""
        return block[..., self._ring :].reshape(*block.shape[:-1], self.n_ring, self.n_vehicle)

    def block(self, chain: Chain) -> Array:
        """(size,) the block of a chain before its first step."""
        block = np.zeros(self.size)
        block[[Head.MAGIC, Head.N_VEHICLE, Head.N_INTERFACE, Head.N_POINT, Head.FRONT, Head.TIME]] = (
            MAGIC,
            self.n_vehicle,
            self.n_interface,
            self.n_point,
            chain.front,
            -1.0,
        )
        if self.n_ring:
            block[[Head.STRIDE, Head.MOST, Head.N_RING]] = chain.steps_per_record, chain.n_records, self.n_ring
        self.car(block, Car.FRICTION_LIMIT)[:] = chain.friction
        self.car(block, Car.SPEED)[:] = chain.speed
        envelopes = [i.envelope for i in chain.interfaces]
        self.joint(block, Joint.STROKE)[chain.front] = -chain.gap
        self.joint(block, Joint.STIFFNESS)[:] = [e.stiffness for e in envelopes]
        self.joint(block, Joint.DAMPING)[:] = [e.damping for e in envelopes]
        self.joint(block, Joint.LAW)[:] = CRUSH
        self.joint(block, Joint.FIRST_FORCE_TIME)[:] = -1.0
        curves = block[self._curves : self._ring].reshape(self.n_interface, 3, self.n_point)
        curves[:, 0] = np.inf
        for rows, e in zip(curves, envelopes, strict=True):
            rows[:, : e.stroke.size] = e.stroke, e.force, e.slope
        return block


@dataclass(frozen=True)
class Tallied:
    """A field that a collision leaves behind."""

    name: str  # of the attribute of a :class:`Tally`
    over: tuple[str, ...]  # what it has a value for: "vehicle", "interface", or nothing for the whole collision
    unit: str  # of its values
    meaning: str  # in words


TALLY = tuple(
    Tallied(field.name.lower(), over, field.unit, field.meaning)
    for fields, over in ((Head, ()), (Car, ("vehicle",)), (Joint, ("interface",)))
    for field in fields
    if field.tallied
)
"""Every tallied field: the header's, the vehicles', the interfaces'."""


class Tally:
    """What the device law counts at every step, as it stands at the end of a collision; all in SI.

    Its attributes are the fields of :data:`TALLY` by name: (n_vehicle,) or (n_interface,) arrays in the order of the
    chain, plain numbers for the whole collision.
    """

    def __init__(self, **values: Any) -> None:
        """Take the value of each field by name."""
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        """Say what is missing; what there is, is found without this."""
        raise AttributeError(f"the tally has no {name!r}; it has {', '.join(vars(self))}")

    @classmethod
    def of(cls, layout: Layout, block: Array) -> Tally:
        """The tally in a simulation's block of user data."""
        values: dict[str, Any] = {f.name.lower(): float(block[f]) for f in Head if f.tallied}
        values["over"] = bool(values["over"])
        values |= {f.name.lower(): layout.car(block, f).copy() for f in Car if f.tallied}
        values |= {f.name.lower(): layout.joint(block, f).copy() for f in Joint if f.tallied}
        return cls(**values)
