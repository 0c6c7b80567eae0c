"""Energy-absorbing devices: a law, the stages it is made of, and the draw gear that pulls.

A device is compressed by a stroke u; its force follows from its law, a kind of :mod:`trainmj.collision.law`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from trainmj.collision.envelope import Envelope
from trainmj.collision.kind import Law
from trainmj.collision.line import LineEnd
from trainmj.scenario.devices import AnyDevice
from trainmj.scenario.parts import Parts
from trainmj.units import KN, KN_PER_MM, KN_S_PER_M, MM

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
        n_paths: ways through it, one more than there are shear-offs with a stage behind.
        divided: the device as a number of paths, up to n_paths, the last of which takes the rest; see paths.
        pull: its draw gear, if it has one.
        lines: its end of the line of each of the n_paths, in the vertical plane; otherwise none.
    """

    name: str
    law: Law
    stages: tuple[Stage, ...]
    n_paths: int = 1
    divided: Callable[[int, bool], tuple[Path, ...]] = field(repr=False, default=lambda n, idle: ())
    pull: Pull | None = None
    lines: tuple[LineEnd, ...] = ()

    @property
    def envelope(self) -> Envelope:
        """Its curve of first loading at rest."""
        return self.law.loading

    def paths(self, n: int, idle: bool = False) -> tuple[Path, ...]:
        """The device as n paths, at most n_paths; with idle each includes the empty stroke before it."""
        return self.divided(n, idle) if n > 1 else (Path(0.0, self.law, self.stages),)

    def is_like(self, other: Device) -> bool:
        """Whether the other one is the same device, number by number, whatever its name."""
        return self.stages == other.stages and self.law.is_like(other.law)


def pull_of(spec: AnyDevice, parts: Parts, law_of: Callable[[Envelope, float], Law]) -> Pull | None:
    """The draw gear of a device, whose law is made of an envelope and the stroke [m] at which that ends unstated."""
    pull = spec.pull
    if pull is None:
        return None
    stiffness = pull.stiffness_kN_per_mm * KN_PER_MM
    breaks = np.inf if pull.breaking_force_kN is None else pull.breaking_force_kN * KN
    damping = pull.damping_kN_s_per_m * KN_S_PER_M
    if pull.curve is None:
        linear = Envelope(np.array([0.0, 1.0]), np.array([0.0, stiffness]), stiffness, damping, stiffness)
        return Pull(law_of(linear, np.inf), pull.slack_mm * MM, breaks)
    stroke, force = (np.array(values) for values in parts.curve_points(pull.curve))
    envelope = Envelope(stroke * MM, force * KN, stiffness, damping)
    return Pull(law_of(envelope, envelope.stroke[-1]), pull.slack_mm * MM, breaks)
