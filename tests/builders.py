"""Small systems that the tests collide; most are those of the verification that ships."""

from __future__ import annotations

from typing import Any

from trainmj.collision import kernel
from trainmj.collision.block import Tally, alone
from trainmj.collision.chain import Chain, Element, Interface, meet
from trainmj.collision.device import Device
from trainmj.collision.element import advance
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import ELEMENT, N_ELEMENT
from trainmj.collision.simulation import start
from trainmj.verification.systems import chain, device, envelope, scenario, values

__all__ = ["Alone", "chain", "changed", "device", "envelope", "joined", "scenario", "step_once", "values"]


def joined(left: Envelope, right: Envelope) -> Interface:
    """A front interface of two devices in series, between vehicles 0 and 1."""
    sides = device(left, "left"), device(right, "right")
    return Interface("front", 0, 1, meet(*sides, coupled=False), sides, ("front", "front partner"))


class Alone:
    """An element pressed by itself, by the law as plain Python."""

    def __init__(self, element: Element | Device | Envelope) -> None:
        """Take an element, or the one of a device or an envelope."""
        of = device(element) if isinstance(element, Envelope) else element
        self.element = meet(of)[0] if isinstance(of, Device) else of
        self.block: Array = alone(self.element)
        self.time = self.work = self.lost = self.viscous = 0.0

    def to(self, stroke: float, rate: float = 0.0, elapsed: float = 0.0) -> float:
        """Press it to a stroke [m] at a rate [m/s] within some time [s]; its force [N]."""
        self.time += elapsed
        before, force_before = self.stroke, self.force
        force, lost, viscous, _ = advance(self.block, 0, stroke, rate, elapsed, self.time)
        self.lost += lost
        self.viscous += viscous
        self.work += 0.5 * (force_before + self.force) * (self.stroke - before) / self.element.share
        return force

    @property
    def stroke(self) -> float:
        """Its own stroke [m]."""
        return float(self.block[ELEMENT.STROKE])

    @property
    def force(self) -> float:
        """Its own force, positive where it acts [N]."""
        return float(self.block[ELEMENT.FORCE])

    def of(self, field: int, law: int | None = None) -> float:
        """A field of its record, or of that of a law of two."""
        at = 0 if law is None else N_ELEMENT * (law + 1)
        return float(self.block[at + field])

    @property
    def stored(self) -> float:
        """Energy that its laws hold [J]."""
        pair = len(self.element.laws) == 2
        found = 0.0
        for n, law in enumerate(self.element.laws):
            fields = (ELEMENT.STROKE, ELEMENT.FORCE, ELEMENT.STATE_0, ELEMENT.STATE_1)
            found += law.kind.stored(law, *(self.of(field, n if pair else None) for field in fields))
        return float(found / self.element.share)


def step_once(model: Any, chain: Chain) -> Any:
    """A simulation of a chain after one step with the law."""
    import mujoco

    from trainmj.collision.block import Layout

    data = start(model, chain, Layout.of(chain))
    with kernel.installed():
        mujoco.mj_step(model, data)
    return data


def changed(tally: Tally, **fields: Any) -> Tally:
    """A tally with some of its fields replaced."""
    return Tally(**(vars(tally) | fields))
