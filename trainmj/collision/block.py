"""Where the device law keeps its parameters and its state: a block of mjData.userdata for each simulation.

The block is part of MuJoCo's state row, so that every simulation of a batch has devices and plastic states of its
own, and the compiled law needs nothing else. It holds a header, one array per vehicle field, one per interface
field, then the envelopes. All values are float64 in SI.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, auto

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.device import Array

MAGIC = 20261122.5
"""First value of a block; the law leaves any other simulation of the process alone."""


class _Count(IntEnum):
    @staticmethod
    def _generate_next_value_(name: str, start: int, count: int, last_values: list[int]) -> int:
        return count


class Head(_Count):
    """Header fields."""

    MAGIC = auto()
    N_VEHICLE = auto()
    N_INTERFACE = auto()
    N_POINT = auto()  # room for the points of each envelope
    TIME = auto()  # of the last evaluation; -1 before the first
    OVER = auto()  # 1 when no interface carries force or comes closer
    IMPULSE = auto()  # of rail friction and wall on all vehicles [N s]
    STRIDE = auto()  # evaluations from one record of the speeds to the next; 0 for no records
    DUE = auto()  # evaluations until the next record
    RECORDS = auto()  # taken so far
    MOST = auto()  # records after which the simulation is done
    DONE = auto()  # 1 when, at a record, it was over, out of records or not finite: the law rests from then on
    N_RING = auto()  # records that are kept


class Car(_Count):
    """Fields of a vehicle."""

    FRICTION_LIMIT = auto()
    SPEED = auto()
    FRICTION = auto()
    FRICTION_WORK = auto()
    DEVICE_PEAK = auto()  # largest |acceleration| by the devices alone
    TOTAL_PEAK = auto()  # largest |acceleration|, rail friction included


class Joint(_Count):
    """Fields of an interface."""

    STIFFNESS = auto()
    DAMPING = auto()
    PLASTIC = auto()
    STROKE = auto()
    FORCE = auto()
    WORK = auto()
    DISSIPATED = auto()  # by crushing and dashpot, from the law and not from the work
    STROKE_MAX = auto()
    STROKE_MAX_TIME = auto()
    FORCE_MAX = auto()
    FIRST = auto()  # time of the first force; -1 before it
    LAST = auto()  # time of the last force
    SEGMENT = auto()  # of the envelope, where the search starts


@dataclass(frozen=True)
class Layout:
    """Sizes and places of a block for chains of one size.

    Attributes:
        n_vehicle: vehicles.
        n_interface: interfaces; as many as vehicles if there is a wall, else one less.
        n_point: room for the points of each envelope.
        n_ring: latest records of the speeds that the law keeps; with 0 it takes none and never rests.
    """

    n_vehicle: int
    n_interface: int
    n_point: int
    n_ring: int = 0

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
        block[[Head.MAGIC, Head.N_VEHICLE, Head.N_INTERFACE, Head.N_POINT, Head.TIME]] = (
            MAGIC,
            self.n_vehicle,
            self.n_interface,
            self.n_point,
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
        self.joint(block, Joint.FIRST)[:] = -1.0
        curves = block[self._curves : self._ring].reshape(self.n_interface, 3, self.n_point)
        curves[:, 0] = np.inf
        for rows, e in zip(curves, envelopes, strict=True):
            rows[:, : e.stroke.size] = e.stroke, e.force, e.slope
        return block
