"""Crush: a device follows its envelope as it is pressed, and unloads along its stiffness.

The plastic state u_p is the stroke at which the force would vanish. With the unloading stiffness K and the dashpot c::

    F_el = K (u - u_p)
    F_el >= F_env(u):   F = F_env(u), u_p = u - F / K           crushing: the state moves, energy is lost
    0 < F_el < F_env:   F = F_el + c du/dt, within [0, F_env]   unloading and reloading
    otherwise           F = 0                                   devices push, they never pull
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from trainmj.collision.device import CAR_BODY, Device, Path, Stage, pull_of
from trainmj.collision.elementwise import positive
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import ELEMENT, Block
from trainmj.collision.jitable import inlined, jitable
from trainmj.collision.kind import Kind, Law, Numbers, Response
from trainmj.collision.law.curve import follow, value
from trainmj.scenario.devices import CrushDevice
from trainmj.scenario.parts import Parts
from trainmj.units import KN, KN_PER_MM, KN_S_PER_M, MM

_ALONG = 1e-9  # of two slopes that differ by less, relative

STIFFNESS, DAMPING = ELEMENT.P0, ELEMENT.P1
PLASTIC = ELEMENT.STATE_0


@inlined
def respond(s: Block, e: int, stroke: float, rate: float, elapsed: float) -> Response:
    """Force and state after one step of the law; see :class:`~trainmj.collision.kind.Kind`."""
    plastic, curve = s[e + PLASTIC], int(s[e + ELEMENT.CURVE])
    if stroke <= plastic:
        return 0.0, plastic, 0.0, 0.0, 0.0
    before = int(s[e + ELEMENT.SEGMENT])
    k = follow(s, curve, e + ELEMENT.SEGMENT, stroke)
    crush = value(s, curve, k, stroke)
    return pressed(s, e, stroke, rate, crush, crush, before, k)


@inlined
def pressed(s: Block, e: int, stroke: float, rate: float, crush: float, own: float, before: int, k: int) -> Response:
    """The law where u > u_p, F_env(u) given, as it is and at rest, when the last stroke was in one segment of the curve
    and this is in k.
    """
    plastic, stiffness = s[e + PLASTIC], s[e + STIFFNESS]
    now = plastic
    elastic = stiffness * (stroke - plastic)
    if elastic >= crush:
        force, now = crush, stroke - crush / stiffness
    else:
        force = min(crush, max(0.0, elastic + s[e + DAMPING] * rate))
    if k > before:
        s[e + ELEMENT.PEAK] = _passed(s, e, rate, crush / own if own > 0.0 else 1.0, before, k)
    # lost: mean force over plastic travel, and what the dashpot adds to the spring over the whole
    spring = max(0.0, stiffness * (stroke - now))
    viscous = (force - spring) * (stroke - s[e + ELEMENT.STROKE])
    return force, now, 0.0, 0.5 * (force + s[e + ELEMENT.FORCE]) * (now - plastic) + viscous, viscous


@jitable
def _passed(s: Block, e: int, rate: float, faster: float, before: int, k: int) -> float:
    """Largest force at the points of the curve that were passed between two strokes, climbing along K to each.

    The dashpot adds to the climb as it does at a step; the curve is so many times higher at the rate than at rest.
    """
    curve = int(s[e + ELEMENT.CURVE])
    plastic, stiffness = s[e + PLASTIC], s[e + STIFFNESS]
    peak = 0.0
    for point in range(before + 1, k + 1):
        at = curve + 3 * point
        crush = s[at + 1] * faster
        climbed = stiffness * (s[at] - plastic)
        if climbed >= crush:
            plastic = s[at] - crush / stiffness
        peak = max(peak, min(climbed + s[e + DAMPING] * rate, crush))
    return peak


def stored(law: Numbers, stroke: Any, force: Any, plastic: Any, _: Any) -> Array:
    """Energy in the spring [J]."""
    left = positive(stroke - plastic)
    with np.errstate(over="ignore"):
        return np.asarray(0.5 * law.parameters[0] * left * left)


def bounds(law: Law, _: float) -> tuple[float, float]:
    """Largest dF/du and dF/drate [N/m, N s/m]."""
    return law.parameters[0], law.parameters[1]


def law_of(envelope: Envelope, end: float = np.inf) -> Law:
    """The law of an envelope, with the stroke [m] at which it ends where nothing is stated behind it."""
    return Law(KIND, (envelope.stiffness, envelope.damping), (climbable(envelope),), envelope, end=end)


def climbable(envelope: Envelope) -> Array:
    """(3, n) strokes, forces and slopes of an envelope with a dashpot, none of them that of the stiffness itself.

    Along such a part round-off would decide from step to step whether the device crushes or the dashpot acts.
    """
    slope = envelope.slope
    if envelope.damping > 0.0:
        along = abs(slope - envelope.stiffness) < _ALONG * envelope.stiffness
        slope = np.where(along, (1.0 + _ALONG) * envelope.stiffness, slope) if along.any() else slope
    return np.array([envelope.stroke, envelope.force, slope])


def device(name: str, spec: CrushDevice, parts: Parts) -> Device:
    """The device that a scenario describes: its stages laid end to end, then what is behind them."""
    return staged(name, spec, parts, lambda envelope, end, _: law_of(envelope, end))


def staged(name: str, spec: CrushDevice, parts: Parts, made: Callable[[Envelope, float, float], Law]) -> Device:
    """A device whose law is made of an envelope, the stroke at which it ends without a statement, and that at which its
    own curve ends, both [m].
    """
    pieces = list(_pieces(spec, parts))
    cuts = [n + 1 for n, piece in enumerate(pieces[:-1]) if piece.sheared]

    def divided(n: int, idle: bool) -> tuple[Path, ...]:
        ends = [0, *cuts[: n - 1], len(pieces)]
        return tuple(
            _path(pieces[i:j], spec if j == len(pieces) else None, spec, made, idle) for i, j in pairwise(ends)
        )

    (whole,) = divided(1, False)
    return Device(name, whole.law, whole.stages, len(cuts) + 1, divided, pull_of(spec, parts, law_of))


@dataclass(frozen=True)
class _Piece:
    """A stage of a device with its part of the envelope, in the units of the scenario."""

    stage: Stage  # [m]
    stroke: list[float]  # from the start of the device [mm]
    force: list[float]  # [kN]
    start: float  # where it engages [mm]
    sheared: bool  # whether bolts fail at its end


def _pieces(spec: CrushDevice, parts: Parts) -> Iterator[_Piece]:
    """The stages, laid end to end."""
    at = last = 0.0  # where the stage before ends, and its points [mm]
    for name, stage in spec.all_stages().items():
        u, f = parts.curve_points(stage.curve)
        start = at + stage.empty_stroke_mm
        idle = stage.empty_stroke_mm > 0
        stroke = [max(at, last), start] if idle else []
        force = [0.0, 0.0] if idle else []
        stroke += [start + x for x in u]
        force += f
        at = start + u[-1]
        if stage.shear_off is not None:
            ramp = stage.shear_off.ramp_mm
            stroke += [at + ramp, at + 2 * ramp]
            force += [stage.shear_off.force_kN, 0.0]
        last = stroke[-1]
        limit = np.inf if stage.stroke_limit_mm is None else stage.stroke_limit_mm * MM
        yield _Piece(Stage(name, start * MM, at * MM, limit), stroke, force, start, stage.shear_off is not None)


def _path(
    pieces: list[_Piece],
    ending: CrushDevice | None,
    spec: CrushDevice,
    made: Callable[[Envelope, float, float], Law],
    idle: bool,
) -> Path:
    """The path of some stages; with what is behind the device, if it ends with them.

    It begins where the first of them engages, or with idle at the end of the one before it, and its law is then that of
    the whole device from there on, the empty stroke included.
    """
    origin = pieces[0].stroke[0] if idle else 0.0 if pieces[0].stroke[0] == 0.0 else pieces[0].start
    stroke = [u - origin for piece in pieces for u in piece.stroke]
    force = [f for piece in pieces for f in piece.force]
    while stroke[0] < 0.0:  # the empty stroke before it
        del stroke[0], force[0]
    stages = [piece.stage for piece in pieces]
    own, last_slope, stated = stroke[-1] * MM, 0.0, ending is None
    end = ending.end() if ending is not None else None
    if end is not None:
        stated = True
        stiffness = end.stiffness_kN_per_mm or spec.stiffness_kN_per_mm
        if end.kind == "stop":
            last_slope = stiffness * KN_PER_MM
        elif end.collapse_force_kN is not None:
            stroke.append(stroke[-1] + (end.collapse_force_kN - force[-1]) / stiffness)
            force.append(end.collapse_force_kN)
            stages[-1] = replace(stages[-1], end=(origin + stroke[-1]) * MM)
            stages.append(Stage(CAR_BODY, (origin + stroke[-1]) * MM, np.inf))
    if ending is not None:
        stages[-1] = replace(stages[-1], end=np.inf)
    pairs = list(zip(stroke, force, strict=True))
    points_ = np.array(pairs[:1] + [after for before, after in pairwise(pairs) if after != before])
    envelope = Envelope(
        points_[:, 0] * MM,
        points_[:, 1] * KN,
        spec.stiffness_kN_per_mm * KN_PER_MM,
        spec.damping_kN_s_per_m * KN_S_PER_M,
        last_slope,
    )
    return Path(origin * MM, made(envelope, np.inf if stated else own, own), tuple(stages))


def permanent(law: Numbers, plastic: Any, _: Any) -> Array:
    """Stroke that remains without force [m]."""
    return np.asarray(plastic)


KIND = Kind("crush", respond, device, stored, bounds, permanent, follows=True)
