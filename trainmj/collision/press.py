"""An interface or a device pressed at rest, without a collision: what pictures and stand-ins show of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trainmj.collision.block import alone
from trainmj.collision.chain import Element, Interface
from trainmj.collision.element import advance
from trainmj.collision.envelope import Array, work_along
from trainmj.collision.fields import ELEMENT, N_ELEMENT

_POINTS = 400  # of a path


@dataclass(frozen=True)
class Path:
    """First loading of an interface at rest.

    Attributes:
        stroke: (n,) strokes [m].
        force: (n,) forces [N].
        sides: (n, 2) strokes of the devices of the left and the right side [m]; the same where there is only one.
    """

    stroke: Array
    force: Array
    sides: Array

    def work(self, stroke: float) -> float:
        """Work up to a stroke [J]."""
        return float(np.interp(stroke, self.stroke, work_along(self.stroke, self.force)))


def press(interface: Interface, end: float | None = None, speed: float = 0.0) -> Path:
    """Press an interface at rest, or at a speed.

    Args:
        interface: whose elements act side by side.
        end: stroke up to which [m]; by default where the curves of its devices have ended.
        speed: at which [m/s].
    """
    ends = [float(device.envelope.stroke[-1]) for device in interface.devices]
    end = end or (sum(ends) if len(ends) > 1 else ends[0])
    strokes = np.linspace(0.0, end, _POINTS)
    force, sides = np.zeros(_POINTS), np.zeros((_POINTS, 2))
    for n, element in enumerate(e for e in interface.elements if e.sign > 0):
        forces, own = force_along(element, strokes, speed)
        force += forces
        engaged = (strokes > element.start) if n else np.ones(_POINTS, dtype=bool)
        sides[engaged] = (own + np.resize(element.starts, 2))[engaged]
    return Path(strokes, force, sides)


def force_along(element: Element, strokes: Array, speed: float = 0.0) -> tuple[Array, Array]:
    """Forces (n,) [N] of an element along strokes (n,) of its interface [m], and strokes (n, 2) of its devices.

    Args:
        element: alone, from new.
        strokes: one after the other; back again where they fall.
        speed: at which [m/s]; 0 for at rest.
    """
    block = alone(element)
    forces, sides = np.zeros(len(strokes)), np.zeros((len(strokes), 2))
    pair = len(element.laws) > 1
    before = float(strokes[0])
    for n, stroke in enumerate(strokes.tolist()):
        way = stroke - before
        elapsed = abs(way) / speed if speed > 0.0 else 0.0
        rate = float(np.sign(way)) * speed
        forces[n], *_ = advance(block, 0, stroke, rate, elapsed, float(n))
        places = (N_ELEMENT, 2 * N_ELEMENT) if pair else (0, 0)
        sides[n] = [block[place + ELEMENT.STROKE] for place in places]
        before = stroke
    return forces, sides
