"""Hydraulic and gas-hydraulic: an orifice that resists the square of the speed, a gas spring, an end stop.

The plunger stands at d, which is the stroke while it is pressed::

    G(d) = min(K_pre d, F0 (1 - d / l)^-gamma)     gas spring; without gas a constant preload, or nothing
    inwards:    F = G + c(u) v^2
    outwards:   F = max(0, G - c_r v^2)
    left alone: the plunger comes out with the speed at which G = c_r v^2; without gas it stays
    behind the stroke L of the plunger:  F = G(L) + K_stop (u - L - p), at most the collapse force of the car body

p is what the car body has given way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from numba.extending import register_jitable

from trainmj.collision.fields import ELEMENT
from trainmj.collision.law.curve import segment, value
from trainmj.collision.law.kind import Kind, Response
from trainmj.collision.law.stop import stopped

if TYPE_CHECKING:
    from trainmj.collision.device import Law

PLUNGER, GIVEN = ELEMENT.STATE_0, ELEMENT.STATE_1
TRAVEL, STOP, COLLAPSE = ELEMENT.P0, ELEMENT.P1, ELEMENT.P2
PRELOAD, PER_LENGTH, GAMMA, RAMP = ELEMENT.P3, ELEMENT.P4, ELEMENT.P5, ELEMENT.P6
REBOUND, KNEE = ELEMENT.P7, ELEMENT.P8
"""c_r [N s2/m2], infinite where nothing brings the plunger back; and the d at which the ramp of the preload ends [m]."""


@register_jitable
def respond(s: Any, e: int, stroke: float, rate: float, elapsed: float) -> Response:
    """Force and state after one step of the law; see :class:`~trainmj.collision.law.kind.Kind`."""
    plunger, given = s[e + PLUNGER], s[e + GIVEN]
    if stroke <= 0.0 and plunger <= 0.0:
        return 0.0, 0.0, given, 0.0, 0.0
    travel, before = s[e + TRAVEL], s[e + ELEMENT.STROKE]
    gas_before = _gas(s, e, plunger)
    # where the plunger is: pressed by the stroke, or come out by itself
    now = min(stroke, travel)
    if now < plunger:
        rebound = s[e + REBOUND]
        if math.isinf(rebound):
            now = plunger
        elif rebound > 0.0:
            now = max(now, plunger - elapsed * math.sqrt(gas_before / rebound))
        now = max(now, 0.0)
    gas = _gas(s, e, now)
    touched = stroke >= now
    # the stop behind its travel, and the car body behind that
    stop_before, _ = stopped(before - travel, given, s[e + STOP], s[e + COLLAPSE])
    stop, gives = stopped(stroke - travel, given, s[e + STOP], s[e + COLLAPSE])
    force = 0.0
    if touched:
        force = gas + stop
        if rate > 0.0 and stroke < travel:
            curve = int(s[e + ELEMENT.CURVE])
            k = segment(s, curve, int(s[e + ELEMENT.SEGMENT]), stroke)
            s[e + ELEMENT.SEGMENT] = k
            force += value(s, curve, k, stroke) * rate * rate
        elif rate < 0.0 and stroke < travel:
            force = max(0.0, gas - s[e + REBOUND] * rate * rate) if not math.isinf(s[e + REBOUND]) else 0.0
    # lost by speed: the work that is neither in the gas nor at the stop
    crushed = 0.5 * (stop + stop_before) * (gives - given)
    beyond = max(stroke, travel) - max(before, travel)
    viscous = 0.5 * (force + s[e + ELEMENT.FORCE]) * (stroke - before)
    viscous -= 0.5 * (gas + gas_before) * (now - plunger) + 0.5 * (stop + stop_before) * beyond
    return force, now, gives, crushed + viscous, viscous


@register_jitable
def _gas(s: Any, e: int, plunger: float) -> float:
    """Force of the gas, or of the preload."""
    if plunger <= s[e + KNEE]:
        return s[e + RAMP] * max(0.0, plunger)
    return s[e + PRELOAD] * (1.0 - s[e + PER_LENGTH] * plunger) ** -s[e + GAMMA]


def stored(law: Law, stroke: float, force: float, plunger: float, given: float) -> float:
    """Energy in the gas and in the stop [J]."""
    travel, stop, _, preload, per_length, gamma, ramp, _, knee, _ = law.parameters
    found = 0.5 * ramp * min(plunger, knee) ** 2
    if plunger > knee:
        if per_length == 0.0:
            found += preload * (plunger - knee)
        elif gamma == 1.0:
            found += preload / per_length * math.log((1 - per_length * knee) / (1 - per_length * plunger))
        else:
            powers = [(1.0 - per_length * d) ** (1.0 - gamma) for d in (plunger, knee)]
            found += preload / (per_length * (gamma - 1.0)) * (powers[0] - powers[1])
    return found + 0.5 * stop * max(0.0, stroke - travel - given) ** 2


def bounds(law: Law, fastest: float) -> tuple[float, float]:
    """Largest dF/du and dF/drate [N/m, N s/m]: the orifice at the largest rate, the gas at the end of its travel."""
    travel, stop, _, preload, per_length, gamma, ramp, rebound, _, _ = law.parameters
    metering = law.curves[0]
    gas = preload * gamma * per_length * (1.0 - per_length * travel) ** (-gamma - 1.0)
    steepest = float(abs(metering[2]).max()) * fastest**2
    orifice = max(float(metering[1].max()), rebound if math.isfinite(rebound) else 0.0)
    return max(stop, ramp, gas + steepest), 2.0 * orifice * fastest


KIND = Kind("hydraulic", respond, stored, bounds, store="gas")
