"""An end stop behind the stroke of a device, and the car body behind that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trainmj.collision.device import CAR_BODY, Stage
from trainmj.collision.envelope import Envelope
from trainmj.collision.jitable import jitable
from trainmj.scenario.devices import DEVICE, RecoveringDevice
from trainmj.symbol import largest
from trainmj.units import KN, KN_PER_MM, MM


@jitable
def stopped(over: float, stiffness: float, most: float) -> tuple[float, float]:
    """Force of a stop [N], and what the car body behind it gives way [m].

    Args:
        over: stroke behind the end of the device, without what the body has given way before [m].
        stiffness: of the stop [N/m].
        most: collapse force of the body, less what the device itself carries at its end [N]; infinite for none.
    """
    force = stiffness * over if over > 0.0 else 0.0
    if force > most:
        return most, over - most / stiffness
    return force, 0.0


@dataclass(frozen=True)
class Behind:
    """What is behind a device that recovers.

    Attributes:
        end: stroke at which the device ends [m].
        held: force that it carries there at rest [N].
        stiffness: of the stop [N/m]; 0 for none, where its last force is held.
        most: collapse force of the car body, less that [N]; infinite for none.
    """

    end: float
    held: float
    stiffness: float = 0.0
    most: float = np.inf

    def behind(self, loading: Envelope) -> Envelope:
        """A curve of first loading up to the end, with what is behind it."""
        inside = loading.stroke <= self.end * (1.0 + 1e-12)
        stroke, force = loading.stroke[inside], loading.force[inside]
        stiffness = largest([loading.stiffness, self.stiffness])  # the stop's rise is no climb along a softer one
        if self.most == np.inf:
            return Envelope(stroke, force, stiffness, 0.0, self.stiffness)
        stroke, force = (
            np.append(stroke, self.end + self.most / self.stiffness),
            np.append(force, self.held + self.most),
        )
        return Envelope(stroke, force, stiffness)

    def stages(self, start: float, limit_mm: float | None) -> tuple[Stage, ...]:
        """The stages: the device from a stroke [m] on, with its limit, and the car body."""
        limit = np.inf if limit_mm is None else limit_mm * MM
        if self.most == np.inf:
            return (Stage(DEVICE, start, np.inf, limit),)
        body = self.end + self.most / self.stiffness
        return Stage(DEVICE, start, body, limit), Stage(CAR_BODY, body, np.inf)


def stop_of(spec: RecoveringDevice, end: float, held: float) -> Behind:
    """What a scenario states behind a device that ends at a stroke [m] with a force [N]."""
    stated = spec.end()
    if stated is None or stated.kind == "hold":
        return Behind(end, held)
    assert stated.stiffness_kN_per_mm is not None  # held by the rules of a scenario
    stiffness = stated.stiffness_kN_per_mm * KN_PER_MM
    return Behind(
        end, held, stiffness, np.inf if stated.collapse_force_kN is None else stated.collapse_force_kN * KN - held
    )


def after(empty: float, envelope: Envelope) -> Envelope:
    """A curve behind an empty stroke [m]."""
    if not empty:
        return envelope
    stroke, force = np.append(0.0, envelope.stroke + empty), np.append(0.0, envelope.force)
    return Envelope(stroke, force, envelope.stiffness, envelope.damping, envelope.last_slope)
