"""The parts that devices are drawn with: where each is at rest, and where it goes as its device is compressed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trainmj.collision.chain import WALL, Chain, Interface
from trainmj.collision.device import Device

_HEAD, _ROD = 0.20, 0.10  # lengths of a coupler's head and of the rod behind it [m]
_RINGS = 6  # folds that are drawn on a crush tube
_LEAST = 0.25  # room that any device has [m]
_SHORTEST = 0.03  # length of a fully crushed tube [m]


@dataclass(frozen=True)
class Shape:
    """The cross section of a part, and what it is made of."""

    section: tuple[float, ...]  # (radius,) of a cylinder, or half width and half height of a box [m]
    material: str  # of the base scene; "device" takes the colour of the energy absorbed


_COUPLER, _ANTI_CLIMBER, _GANGWAY = (0.0, 0.78), (0.85, 1.22), (0.0, 2.12)  # y and z above the rail [m]
_COUPLER_TUBE, _COUPLER_RING = Shape((0.13,), "device"), Shape((0.155,), "device")
_COUPLER_ROD, _COUPLER_HEAD = Shape((0.07,), "steel"), Shape((0.21, 0.19), "steel")
_TUBE, _RING = Shape((0.13, 0.11), "device"), Shape((0.155, 0.135), "device")
_PLATE, _TOOTH = Shape((0.30, 0.20), "steel"), Shape((0.30, 0.025), "steel")
_BELLOWS = Shape((0.62, 1.02), "gangway")


@dataclass(frozen=True)
class Zone:
    """The length along a vehicle that one stage of a device crushes, measured towards the face of its coupler."""

    start: float  # at rest, from the middle of the vehicle [m]
    end: float  # at rest [m]
    begin_at: float  # stroke of the device at which the stage begins [m]
    end_at: float  # stroke at which it ends; from there on the stage is pushed back as it is [m]
    stage: int  # which of the device's stages


@dataclass(frozen=True)
class Part:
    """A piece of a device, in a vehicle's own direction: along +x towards the face of its coupler."""

    name: str  # of its geom
    shape: Shape  # cross section and material
    place: tuple[float, float]  # y and z [m]
    start: float  # where it begins at rest, from the middle of the vehicle [m]
    end: float  # where it ends at rest [m]
    zone: Zone  # that moves it

    def placed(self, stroke: float) -> tuple[float, float]:
        """Begin and end [m] when the device is compressed by a stroke [m]."""
        zone = self.zone
        u = min(max(0.0, stroke - zone.begin_at), zone.end_at - zone.begin_at)
        beyond = max(0.0, stroke - zone.end_at)
        room = zone.end - zone.start - _SHORTEST
        shorter, pushed = min(u, room), max(0.0, u - room) + beyond
        if self.start <= zone.start and self.end >= zone.end:
            return zone.start - pushed, self.end - shorter - pushed
        middle, half = 0.5 * (self.start + self.end), 0.5 * (self.end - self.start)
        share = min(1.0, max(0.0, (middle - zone.start) / (zone.end - zone.start)))
        middle -= share * shorter + pushed
        return middle - half, middle + half


@dataclass(frozen=True)
class End:
    """One end of a vehicle with the device that it carries there."""

    vehicle: int  # index in the chain
    direction: int  # 1 if the end faces +x, -1 if it faces -x
    interface: int  # index of the interface
    side: int  # 0 on the left of the interface, 1 on the right
    parts: tuple[Part, ...]  # what is drawn of the device


def ends(chain: Chain) -> Iterator[End]:
    """The ends of all vehicles that carry a device, along +x."""
    for k, interface in enumerate(chain.interfaces):
        yield End(interface.left, 1, k, 0, _parts(chain, interface.left, 1, interface))
        if interface.right != WALL:
            yield End(interface.right, -1, k, 1, _parts(chain, interface.right, -1, interface))


def device_of(interface: Interface, side: int) -> Device:
    """The device that one side of an interface carries, or shares with the other side."""
    return interface.devices[min(side, len(interface.devices) - 1)]


def is_shared(interface: Interface) -> bool:
    """Whether one device stands between two vehicles, so that each side shows half of it."""
    return len(interface.devices) == 1 and interface.right != WALL


def setback(chain: Chain, vehicle: int, direction: int) -> float:
    """From the face of a vehicle's coupler back to its body [m], at the end that faces +x (1) or -x (-1)."""
    k = vehicle if direction > 0 else vehicle - 1
    if not 0 <= k < len(chain.interfaces):
        return 0.5  # the end of a train
    interface = chain.interfaces[k]
    device = device_of(interface, int(direction < 0))
    last = device.stages[-1]
    crush = last.limit if np.isfinite(last.limit) else min(0.5, float(device.envelope.stroke[-1]) - last.start)
    room = (last.start + crush) / (2 if is_shared(interface) else 1) + _LEAST
    return float(min(room, 0.3 * chain.vehicles[vehicle].length))


def _parts(chain: Chain, vehicle: int, direction: int, interface: Interface) -> tuple[Part, ...]:
    """What is drawn of the device of an interface at one end of a vehicle."""
    first, *others = device_of(interface, int(direction < 0)).stages
    share = 0.5 if is_shared(interface) else 1.0
    name = f"{chain.vehicles[vehicle].name} {'front' if direction > 0 else 'rear'}"
    face = chain.vehicles[vehicle].length / 2
    body = face - setback(chain, vehicle, direction)
    head = face - min(_HEAD, 0.3 * (face - body))
    rod = head - min(_ROD, 0.2 * (face - body))
    zone = Zone(body, rod, 0.0, share * first.end, 0)
    parts = [
        Part(f"{name} coupler tube", _COUPLER_TUBE, _COUPLER, body, rod, zone),
        *_rings(f"{name} coupler", _COUPLER_RING, _COUPLER, zone),
        Part(f"{name} coupler rod", _COUPLER_ROD, _COUPLER, rod, head, zone),
        Part(f"{name} coupler head", _COUPLER_HEAD, _COUPLER, head, face, zone),
    ]
    for number, stage in enumerate(others, 1):
        plate = face - share * stage.start
        zone = Zone(body, max(plate - 0.14, body + _SHORTEST), share * stage.start, np.inf, number)
        for side, sign in (("left", -1), ("right", 1)):
            where, (y, z) = f"{name} anti-climber {number} {side}", _ANTI_CLIMBER
            place = sign * y, z
            parts += [
                Part(f"{where} tube", _TUBE, place, zone.start, zone.end, zone),
                *_rings(where, _RING, place, zone),
                Part(f"{where} plate", _PLATE, place, zone.end, plate - 0.03, zone),
            ]
            for tooth in range(3):
                place = sign * y, z + 0.14 * (tooth - 1)
                parts.append(Part(f"{where} tooth {tooth}", _TOOTH, place, plate - 0.03, plate, zone))
    if not others and is_shared(interface):
        parts.append(Part(f"{name} gangway", _BELLOWS, _GANGWAY, body, face, Zone(body, face, 0.0, np.inf, 0)))
    return tuple(parts)


def _rings(name: str, shape: Shape, place: tuple[float, float], zone: Zone) -> Iterator[Part]:
    for k in range(_RINGS):
        middle = zone.start + (zone.end - zone.start) * (k + 0.5) / _RINGS
        yield Part(f"{name} ring {k + 1}", shape, place, middle - 0.012, middle + 0.012, zone)
