"""Rate: a crush curve that is higher the faster it is crushed.

The law is that of :mod:`~trainmj.collision.law.crush` with F_env(u) (1 + (v / C)^(1/P)) in place of F_env(u) for v > 0
(Cowper and Symonds, on the rate of the stroke: C [m/s] is a strain rate times the length of a fold), or with curves at
several speeds. Below 1 cm/s the factor is linear in v: its slope is infinite at rest, and the force would chatter.
Behind the end of the device's own curve there is no factor.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from trainmj.collision.device import Device
from trainmj.collision.envelope import Envelope
from trainmj.collision.fields import ELEMENT, Block
from trainmj.collision.jitable import jitable
from trainmj.collision.kind import Kind, Law, Response, points
from trainmj.collision.law import crush
from trainmj.collision.law.crush import PLASTIC, pressed
from trainmj.collision.law.curve import behind, follow, segment, value
from trainmj.scenario.devices import CowperSymonds, CrushDevice
from trainmj.scenario.parts import Parts
from trainmj.symbol import largest
from trainmj.units import KN, MM

LINEAR = 0.01
"""Rate below which the factor is linear [m/s]."""

REFERENCE, EXPONENT, UNTIL, SPEEDS = ELEMENT.P2, ELEMENT.P3, ELEMENT.P4, ELEMENT.P5
"""C [m/s], 1/P, the stroke up to which it holds [m]; how many speeds, if there are curves at several."""


@jitable
def respond(s: Block, e: int, stroke: float, rate: float, elapsed: float) -> Response:
    """Force and state after one step of the law; see :class:`~trainmj.collision.kind.Kind`."""
    plastic, curve = s[e + PLASTIC], int(s[e + ELEMENT.CURVE])
    if stroke <= plastic:
        return 0.0, plastic, 0.0, 0.0, 0.0
    before = int(s[e + ELEMENT.SEGMENT])
    k = follow(s, curve, e + ELEMENT.SEGMENT, stroke)
    own = value(s, curve, k, stroke)
    crushing = own
    if rate > 0.0 and stroke <= s[e + UNTIL]:
        crushing = _faster(s, e, own, stroke, rate)
    return pressed(s, e, stroke, rate, crushing, own, before, k)


@jitable
def _faster(s: Block, e: int, own: float, stroke: float, rate: float) -> float:
    """Crush force at a rate above 0, where it is own at rest."""
    speeds = int(s[e + SPEEDS])
    if speeds == 0:
        reference, exponent = s[e + REFERENCE], s[e + EXPONENT]
        if rate < LINEAR:
            steepest: float = (LINEAR / reference) ** exponent
            return own * (1.0 + steepest * rate / LINEAR)
        more: float = (rate / reference) ** exponent
        return own * (1.0 + more)
    # one row for each speed: values of a curve over the stroke whose value is the force at that speed
    at = int(s[e + ELEMENT.CURVE_2])
    speed_below, below = 0.0, own
    for _ in range(speeds):
        here = value(s, at + 1, segment(s, at + 1, 0, stroke), stroke)
        if rate <= s[at]:
            return below + (here - below) * (rate - speed_below) / (s[at] - speed_below)
        speed_below, below = s[at], here
        at = behind(s, at + 1)
    return below


def bounds(law: Law, fastest: float) -> tuple[float, float]:
    """Largest dF/du and dF/drate [N/m, N s/m]: the factor is steepest below 1 cm/s, a table between two speeds."""
    stiffness, damping = crush.bounds(law, fastest)
    _, _, reference, exponent, _, speeds, *_ = law.parameters
    most = largest(law.curves[0][1].tolist())
    if speeds == 0:
        return stiffness, largest([damping, most * (LINEAR / reference) ** exponent / LINEAR])
    ends = np.concatenate([curve[0] for curve in law.curves])
    strokes = np.concatenate([ends, np.nextafter(ends, np.inf)])  # both sides of a jump
    rows = [(v, np.interp(strokes, c[0], c[1])) for v, c in zip((0.0, *law.speeds), law.curves, strict=True)]
    steepest = max(float(abs(b - a).max()) / (v - u) for (u, a), (v, b) in pairwise(rows))
    return stiffness, max(damping, steepest)


def device(name: str, spec: CrushDevice, parts: Parts) -> Device:
    """The device that a scenario describes."""

    def made(envelope: Envelope, end: float, own: float) -> Law:
        stiffness, damping = envelope.stiffness, envelope.damping
        if isinstance(spec.rate, CowperSymonds):
            numbers = (stiffness, damping, spec.rate.C_m_per_s, 1.0 / spec.rate.P, own)
            return Law(KIND, numbers, (crush.climbable(envelope),), envelope, end=end)
        (stage,) = spec.all_stages().values()
        empty = stage.empty_stroke_mm
        curves = [crush.climbable(envelope)]
        for row in spec.rate_curves():
            u, f = parts.curve_points(row.curve)
            beyond = envelope.stroke > (empty + u[-1]) * MM * (1.0 + 1e-12)  # the shear-off, and what is stated
            before = ([0.0, empty], [0.0, 0.0]) if empty else ([], [])
            stroke = np.append(np.array([*before[0], *(empty + x for x in u)]) * MM, envelope.stroke[beyond])
            force = np.append(np.array([*before[1], *f]) * KN, envelope.force[beyond])
            curves.append(points(Envelope(stroke, force, stiffness)))
        speeds = tuple(row.speed_m_per_s for row in spec.rate_curves())
        several = (stiffness, damping, 1.0, 1.0, own, float(len(speeds)))
        return Law(KIND, several, tuple(curves), envelope, speeds, end)

    return crush.staged(name, spec, parts, made)


KIND = Kind("rate", respond, device, crush.stored, bounds, crush.permanent)
