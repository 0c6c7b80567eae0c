"""Energy-absorbing devices: a law, the stages it is made of, and the draw gear that pulls.

A device is compressed by a stroke u; its force follows from its law, a kind of :mod:`trainmj.collision.law`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trainmj.collision.envelope import Envelope
from trainmj.collision.kind import Law

CAR_BODY = "car_body"
"""The name of the stage behind a device at whose end the car body gives way."""


@dataclass(frozen=True)
class Stage:
    """One part of a device that acts after the one before it: a coupler, then an anti-climber.

    Attributes:
        name: what the report calls it.
        start: stroke of the device at which the stage engages [m].
        end: stroke of the device at which it is used up [m]; infinite for the last stage.
        limit: largest stroke of the stage itself that the design allows [m]; infinite if none is stated.
    """

    name: str
    start: float
    end: float
    limit: float = np.inf

    def stroke(self, device_stroke: float) -> float:
        """Stroke of this stage when the whole device is compressed by device_stroke [m]."""
        return max(0.0, min(device_stroke, self.end) - self.start)


@dataclass(frozen=True)
class Path:
    """A way through a device by which force goes: the parts of it up to a shear-off, or behind one.

    Attributes:
        start: stroke of the device at which it engages [m].
        law: of the path, its strokes counted from there.
        stages: of the device that are on it.
    """

    start: float
    law: Law
    stages: tuple[Stage, ...]


@dataclass(frozen=True)
class Pull:
    """Draw gear.

    Attributes:
        law: its force over the extension behind the slack.
        slack: extension without force [m].
        breaks: force at which it breaks for good [N]; infinite for none.
    """

    law: Law
    slack: float = 0.0
    breaks: float = np.inf


@dataclass(frozen=True, eq=False)
class Device:
    """Everything at one end of a vehicle that absorbs energy.

    Attributes:
        name: its name in the scenario.
        law: of the whole, pressed.
        stages: in the order in which they act, at least one.
        paths: the ways through it, one behind each shear-off; one path is the whole.
        pull: its draw gear, if it has one.
    """

    name: str
    law: Law
    stages: tuple[Stage, ...]
    paths: tuple[Path, ...]
    pull: Pull | None = None

    @property
    def envelope(self) -> Envelope:
        """Its curve of first loading at rest."""
        return self.law.loading

    def is_like(self, other: Device) -> bool:
        """Whether the other one is the same device, number by number, whatever its name."""
        return self.stages == other.stages and self.law.is_like(other.law)
