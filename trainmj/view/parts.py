"""The parts that devices are drawn with: where each is at rest, and where it goes as its device is compressed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trainmj.collision.chain import WALL, Chain, Interface, Vehicle
from trainmj.collision.device import CAR_BODY, Device, Stage
from trainmj.collision.line import LineEnd

_HEAD, _ROD = 0.20, 0.10  # lengths of a coupler's head and of the rod behind it [m]
_RINGS = 6  # folds that are drawn on a crush tube
_LEAST = 0.25  # room that any device has [m]
_SHORTEST = 0.03  # length of a fully crushed tube [m]
_END = 0.1  # of half a vehicle: the part of its body that gives way, in front of the wheels
_CRUMPLED = 0.8  # of the end of a car body, at most

SHADE = "shade"
"""The last word of names of geoms that are the shadow of a vehicle on the ground, and its material."""

SKIN = "skin"
"""The last word of names of geoms that take the colour of the energy a car body has absorbed."""


@dataclass(frozen=True)
class Shape:
    """The cross section of a part, and what it is made of."""

    section: tuple[float, ...]  # (radius,) of a cylinder, or half width and half height of a box [m]
    material: str  # of the base scene; "device" takes the colour of the energy absorbed

    def times(self, tall: float) -> Shape:
        """A box so many times as high."""
        width, height = self.section
        return Shape((width, height * tall), self.material)


_COUPLER, _ANTI_CLIMBER, _GANGWAY = (0.0, 0.78), (0.85, 1.22), (0.0, 2.12)  # y and z above the rail [m]
_COUPLER_TUBE, _COUPLER_RING = Shape((0.13,), "device"), Shape((0.155,), "device")
_COUPLER_ROD, _COUPLER_HEAD = Shape((0.07,), "steel"), Shape((0.21, 0.19), "steel")
_TUBE, _RING = Shape((0.13, 0.11), "device"), Shape((0.155, 0.135), "device")
_PLATE, _TOOTH = Shape((0.30, 0.20), "steel"), Shape((0.30, 0.025), "steel")
_TALL = 0.40  # height of that plate, and nearly that of a head [m]
_BELLOWS = Shape((0.62, 1.02), "gangway")
_SIDES = {  # of an obstacle that is struck as a whole: cross section and place
    "lorry": (Shape((1.25, 1.5), "device"), (0.0, 2.1)),
    "block": (Shape((1.2, 0.765), "device"), (0.0, 0.885)),
}


@dataclass(frozen=True)
class Zone:
    """The length along a vehicle that one stage of a device crushes, measured towards the face of its coupler."""

    start: float  # at rest, from the middle of the vehicle [m]
    end: float  # at rest [m]
    begin_at: float  # stroke of the device at which the stage begins [m]
    end_at: float  # stroke at which it ends; from there on the stage is pushed back as it is [m]
    stage: int  # which of the device's stages
    path: int = 0  # way through the device that the stage is on
    pin: float | None = (
        None  # of a strut, which turns about it in the vertical plane, from the middle of the vehicle [m]
    )


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
        """Begin and end [m] when the device is compressed by a stroke [m], or drawn out where that is negative."""
        zone = self.zone
        least = min(0.0, stroke) if zone.begin_at == 0.0 else 0.0
        u = min(max(least, stroke - zone.begin_at), zone.end_at - zone.begin_at)
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
class Body:
    """The end of a car body that gives way behind its device, in a vehicle's own direction."""

    name: str  # with which those of its geoms begin
    start: float  # from the middle of the vehicle [m]
    end: float  # [m]
    begin_at: float  # stroke, as it is shown, at which it begins to give way [m]

    def shorter(self, stroke: float) -> float:
        """By how much it is shorter at a stroke [m]."""
        return min(max(0.0, stroke - self.begin_at), _CRUMPLED * (self.end - self.start))


@dataclass(frozen=True)
class End:
    """One end of a vehicle with the device that it carries there."""

    vehicle: int  # index in the chain, or WALL for what stands fixed at the wall
    point: int  # at which its device is attached, or WALL
    direction: int  # 1 if the end faces +x, -1 if it faces -x
    interface: int  # index of the interface
    side: int  # 0 on the left of the interface, 1 on the right
    parts: tuple[Part, ...]  # what is drawn of the device
    body: Body | None = None  # of the vehicle, if it gives way behind the device


def ends(chain: Chain) -> Iterator[End]:
    """The ends of all vehicles that carry a device, along +x, and that of what stands fixed at the wall."""
    for k, interface in enumerate(chain.interfaces):
        yield _end(chain, k, interface, 0)
        if interface.right != WALL or chain.obstacle is not None:
            yield _end(chain, k, interface, 1)


def bearer(chain: Chain, vehicle: int) -> Vehicle:
    """The vehicle of an index, or what stands fixed at the wall."""
    if vehicle != WALL:
        return chain.vehicles[vehicle]
    assert chain.obstacle is not None
    return chain.obstacle


def middle_of(chain: Chain, point: int) -> float:
    """Where the middle of a vehicle is, seen from a point of it [m]; at the wall, from where the two sides touch."""
    if point == WALL:
        return 0.5 * bearer(chain, WALL).length
    of = chain.points[point]
    vehicle = chain.vehicles[of.vehicle]
    return 0.5 * vehicle.length - of.place - (vehicle.gear.cog_x if vehicle.gear else 0.0)


def rail_of(chain: Chain, point: int) -> float:
    """Height of the rails below a vehicle as designed, seen from a point of it [m]."""
    return 0.0 if point == WALL else -chain.cog_height(chain.points[point].vehicle)


def device_of(interface: Interface, side: int) -> Device:
    """The device that one side of an interface carries, or shares with the other side."""
    return interface.devices[min(side, len(interface.devices) - 1)]


def setback(chain: Chain, vehicle: int, direction: int) -> float:
    """From the face of a vehicle's coupler back to its body [m], at the end that faces +x (1) or -x (-1)."""
    k = vehicle if direction > 0 else vehicle - 1
    if vehicle == WALL:
        k = len(chain.interfaces) - 1
    if not 0 <= k < len(chain.interfaces) or (vehicle == WALL and direction > 0):
        return 0.5  # the end of a train
    interface = chain.interfaces[k]
    device = device_of(interface, int(direction < 0))
    last = _stages(device)[-1]
    end = last.end if np.isfinite(last.end) else float(device.envelope.stroke[-1])
    crush = last.limit if np.isfinite(last.limit) else min(0.5, end - last.start)
    room = (last.start + crush) / (2 if interface.is_shared else 1) + _LEAST
    return float(min(room, 0.3 * bearer(chain, vehicle).length))


def _lines(device: Device) -> list[tuple[int, LineEnd | None]]:
    """Of each stage of a device, the path it is on and, in the vertical plane, its end of the line of that."""
    if not device.lines:
        return [(0, None)] * len(device.stages)
    paths = device.paths(device.n_paths)
    return [(n, line) for n, (path, line) in enumerate(zip(paths, device.lines, strict=True)) for _ in path.stages]


def _stages(device: Device) -> tuple[Stage, ...]:
    """The stages of a device itself."""
    return tuple(stage for stage in device.stages if stage.name != CAR_BODY)


def _end(chain: Chain, k: int, interface: Interface, side: int) -> End:
    """One side of an interface."""
    vehicle, direction = ((interface.left, 1), (interface.right, -1))[side]
    of, device = bearer(chain, vehicle), device_of(interface, side)
    name = f"{of.name} {'front' if direction > 0 else 'rear'}"
    body, face = of.length / 2 - setback(chain, vehicle, direction), of.length / 2
    share = 0.5 if interface.is_shared else 1.0
    if of.drawing in _SIDES:
        parts = _side_wall(name, of.drawing, body, face, device)
    else:
        parts = _coupler(name, body, face, device, interface)
    point = chain.ends(interface)[side]
    attached = WALL if point == WALL else -direction * middle_of(chain, point)
    if vehicle != WALL and of.body and attached < body - _ROD:  # a bar from there to the end of the body
        parts = (*parts, Part(f"{name} draw bar", _COUPLER_ROD, _COUPLER, attached, body, parts[0].zone))
    crumpling = None
    if device.stages[-1].name == CAR_BODY and vehicle != WALL:
        crumpling = Body(f"{name} body", (1.0 - _END) * body, body, share * device.stages[-1].start)
    return End(vehicle, point, direction, k, side, parts, crumpling)


def _side_wall(name: str, drawing: str, body: float, face: float, device: Device) -> tuple[Part, ...]:
    """The side of an obstacle."""
    zone = Zone(body, face, 0.0, _stages(device)[-1].end, 0)
    return (Part(f"{name} side wall", *_SIDES[drawing], body, face, zone),)


def _coupler(name: str, body: float, face: float, device: Device, interface: Interface) -> tuple[Part, ...]:
    """A coupler, and a pair of anti-climbers for each further stage."""
    first, *others = _stages(device)
    share = 0.5 if interface.is_shared else 1.0
    head = face - min(_HEAD, 0.3 * (face - body))
    rod = head - min(_ROD, 0.2 * (face - body))
    lines = _lines(device)
    path, line = lines[0]
    at = (_COUPLER[0], line.height) if line else _COUPLER
    zone = Zone(body, rod, 0.0, share * first.end, 0, path, _pin(line, face))
    parts = [
        Part(f"{name} coupler tube", _COUPLER_TUBE, at, body, rod, zone),
        *_rings(f"{name} coupler", _COUPLER_RING, at, zone),
        Part(f"{name} coupler rod", _COUPLER_ROD, at, rod, head, zone),
        Part(f"{name} coupler head", _COUPLER_HEAD.times(_tall(line)), at, head, face, zone),
    ]
    for number, (stage, (path, line)) in enumerate(zip(others, lines[1:], strict=False), 1):
        plate, (y, z), tall = face - share * stage.start, _ANTI_CLIMBER, _tall(line)
        z = line.height if line else z
        start, end = share * stage.start, share * stage.end
        zone = Zone(body, max(plate - 0.14, body + _SHORTEST), start, end, number, path, _pin(line, face))
        for side, sign in (("left", -1), ("right", 1)):
            where, place = f"{name} anti-climber {number} {side}", (sign * y, z)
            parts += [
                Part(f"{where} tube", _TUBE.times(tall), place, zone.start, zone.end, zone),
                *_rings(where, _RING.times(tall), place, zone),
                Part(f"{where} plate", _PLATE.times(tall), place, zone.end, plate - 0.03, zone),
            ]
            for tooth in range(3):
                place = sign * y, z + 0.14 * tall * (tooth - 1)
                parts.append(Part(f"{where} tooth {tooth}", _TOOTH.times(tall), place, plate - 0.03, plate, zone))
    if not others and interface.is_shared:
        parts.append(
            Part(f"{name} gangway", _BELLOWS, _GANGWAY, body, face, Zone(body, face, 0.0, share * first.end, 0))
        )
    return tuple(parts)


def _tall(line: LineEnd | None) -> float:
    """How high faces are drawn, as a part of what is usual: as they overlap, so that they part in pictures too."""
    return min(line.overlap, _TALL) / _TALL if line else 1.0


def _pin(line: LineEnd | None, face: float) -> float | None:
    """Where the pin of a strut is, from the middle of the vehicle [m]."""
    return face - line.pin if line and line.strut else None


def _rings(name: str, shape: Shape, place: tuple[float, float], zone: Zone) -> Iterator[Part]:
    for k in range(_RINGS):
        middle = zone.start + (zone.end - zone.start) * (k + 0.5) / _RINGS
        yield Part(f"{name} ring {k + 1}", shape, place, middle - 0.012, middle + 0.012, zone)
