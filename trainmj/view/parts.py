"""The parts that devices are drawn with: where each is at rest, and where it goes as its device is compressed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trainmj.collision.chain import WALL, Chain, Interface
from trainmj.collision.device import Device

_HEAD, _ROD = 0.20, 0.10  # lengths of a coupler's head and of the rod behind it
_RINGS = 6  # folds that are drawn on a crush tube
_LEAST = 0.25  # room that any device has [m]
_SHORTEST = 0.03  # length of a tube that is crushed altogether [m]


@dataclass(frozen=True)
class Part:
    """A piece of a device, in a vehicle's own direction: along +x towards the face of its coupler.

    Attributes:
        name: of its shape.
        start: where it begins at rest, from the middle of the vehicle [m].
        end: where it ends at rest.
        tube: begin and end at rest of the tube that shortens, between body and head.
        begin_at: stroke of the device at which its stage begins [m].
        end_at: stroke at which its stage ends; from there on the stage is pushed back as it is.
        stage: which of the device's stages.
        coloured: whether it shows the energy absorbed.
    """

    name: str
    start: float
    end: float
    tube: tuple[float, float]
    begin_at: float
    end_at: float
    stage: int
    coloured: bool

    def placed(self, stroke: float) -> tuple[float, float]:
        """Begin and end [m] when the device is compressed by a stroke [m]."""
        u = min(max(0.0, stroke - self.begin_at), self.end_at - self.begin_at)
        beyond = max(0.0, stroke - self.end_at)
        a, b = self.tube
        room = b - a - _SHORTEST
        shorter, pushed = min(u, room), max(0.0, u - room) + beyond
        if self.start <= a and self.end >= b:
            return a - pushed, self.end - shorter - pushed
        middle, half = 0.5 * (self.start + self.end), 0.5 * (self.end - self.start)
        share = min(1.0, max(0.0, (middle - a) / (b - a)))
        middle -= share * shorter + pushed
        return middle - half, middle + half


@dataclass(frozen=True)
class End:
    """One end of a vehicle and the device it carries there.

    Attributes:
        vehicle: index in the chain.
        direction: 1 where the end faces +x, -1 where it faces -x.
        interface: index of the interface; None at the end of a train.
        side: 0 on the left of its interface, 1 on the right.
        parts: what is drawn of the device.
    """

    vehicle: int
    direction: int
    interface: int | None
    side: int
    parts: tuple[Part, ...]


def ends(chain: Chain) -> Iterator[End]:
    """Both ends of every vehicle, along +x."""
    for i in range(len(chain.vehicles)):
        for direction in (-1, 1):
            k = i - 1 if direction < 0 else i
            joined = 0 <= k < len(chain.interfaces)
            parts = device_parts(chain, i, direction) if joined else ()
            yield End(i, direction, k if joined else None, int(direction < 0), parts)


def device_of(interface: Interface, side: int) -> Device:
    """The device that one side of an interface carries, or shares with the other one."""
    return interface.devices[min(side, len(interface.devices) - 1)]


def setback(chain: Chain, index: int, direction: int) -> float:
    """From the face of a vehicle's coupler back to its body [m]."""
    k = index - 1 if direction < 0 else index
    if not 0 <= k < len(chain.interfaces):
        return 0.5
    interface = chain.interfaces[k]
    device = device_of(interface, int(direction < 0))
    last = device.stages[-1]
    crush = last.limit if np.isfinite(last.limit) else min(0.5, float(device.envelope.stroke[-1]) - last.start)
    shared = _shared(interface)
    room = (last.start + crush) / (2 if shared else 1) + _LEAST
    return float(min(room, 0.3 * chain.vehicles[index].length))


def device_parts(chain: Chain, index: int, direction: int) -> tuple[Part, ...]:
    """What is drawn of the device at one end of a vehicle.

    Args:
        chain: whose vehicle it is.
        index: of the vehicle.
        direction: 1 or -1, the end of the vehicle.
    """
    interface = chain.interfaces[index - 1 if direction < 0 else index]
    device = device_of(interface, int(direction < 0))
    share = 0.5 if _shared(interface) else 1.0
    name = f"{chain.vehicles[index].name} {'front' if direction > 0 else 'rear'}"
    face = chain.vehicles[index].length / 2
    body = face - setback(chain, index, direction)
    first, *others = device.stages
    head = min(_HEAD, 0.3 * (face - body))
    rod = min(_ROD, 0.2 * (face - body))
    tube = (body, face - head - rod)
    limits = (0.0, share * first.end)
    parts = [
        Part(f"{name} coupler tube", *tube, tube, *limits, 0, True),
        *_rings(f"{name} coupler", tube, limits, 0),
        Part(f"{name} coupler rod", tube[1], face - head, tube, *limits, 0, False),
        Part(f"{name} coupler head", face - head, face, tube, *limits, 0, False),
    ]
    for number, stage in enumerate(others, 1):
        plate = face - share * stage.start
        tube = (body, max(plate - 0.14, body + _SHORTEST))
        limits = (share * stage.start, np.inf)
        for side in ("left", "right"):
            where = f"{name} anti-climber {number} {side}"
            parts += [
                Part(f"{where} tube", *tube, tube, *limits, number, True),
                *_rings(where, tube, limits, number),
                Part(f"{where} plate", tube[1], plate - 0.03, tube, *limits, number, False),
                *(
                    Part(f"{where} tooth {tooth}", plate - 0.03, plate, tube, *limits, number, False)
                    for tooth in range(3)
                ),
            ]
    if not others and _shared(interface):
        parts.append(Part(f"{name} gangway", body, face, (body, face), 0.0, np.inf, 0, False))
    return tuple(parts)


def _shared(interface: Interface) -> bool:
    """Whether one device stands between two vehicles, so that each side shows half of it."""
    return len(interface.devices) == 1 and interface.right != WALL


def _rings(name: str, tube: tuple[float, float], limits: tuple[float, float], stage: int) -> Iterator[Part]:
    for k in range(_RINGS):
        middle = tube[0] + (tube[1] - tube[0]) * (k + 0.5) / _RINGS
        yield Part(f"{name} ring {k + 1}", middle - 0.012, middle + 0.012, tube, *limits, stage, True)
