"""Small systems that the tests collide; most are those of the verification that ships."""

from __future__ import annotations

from typing import Any

from trainmj.collision import kernel
from trainmj.collision.block import Tally
from trainmj.collision.chain import Chain, Interface
from trainmj.collision.device import Envelope, in_series
from trainmj.collision.simulation import start
from trainmj.verification.systems import chain, device, envelope, scenario, values

__all__ = ["chain", "device", "envelope", "joined", "scenario", "step_once", "values"]


def joined(left: Envelope, right: Envelope) -> Interface:
    """A front interface of two devices in series, between vehicles 0 and 1."""
    sides = device(left, "left"), device(right, "right")
    pair, strokes = in_series(*sides)
    return Interface("front", 0, 1, pair, strokes, sides)


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
