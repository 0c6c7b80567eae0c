"""Small systems that the tests collide; most are those of the verification that ships."""

from __future__ import annotations

from typing import Any

from trainmj import native
from trainmj.chain import Chain, Interface
from trainmj.device import Envelope, in_series
from trainmj.simulation import start
from trainmj.verify.systems import chain, device, envelope, scenario, values

__all__ = ["chain", "device", "envelope", "joined", "scenario", "step_once", "values"]


def joined(left: Envelope, right: Envelope) -> Interface:
    """A front interface of two devices in series, between vehicles 0 and 1."""
    sides = device(left, "left"), device(right, "right")
    pair, left_stroke = in_series(*sides)
    return Interface("front", 0, 1, pair, left_stroke, sides)


def step_once(model: Any, chain: Chain) -> Any:
    """A simulation of a chain after one step with the law."""
    import mujoco

    from trainmj.layout import Layout

    data = start(model, chain, Layout.of(chain))
    with native.installed():
        mujoco.mj_step(model, data)
    return data
