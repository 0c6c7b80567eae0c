"""Crush: a device follows its envelope as it is pressed, and unloads along its stiffness.

The plastic state u_p is the stroke at which the force would vanish. With the unloading stiffness K and the dashpot c::

    F_el = K (u - u_p)
    F_el >= F_env(u):   F = F_env(u), u_p = u - F / K           crushing: the state moves, energy is lost
    0 < F_el < F_env:   F = F_el + c du/dt, within [0, F_env]   unloading and reloading
    otherwise           F = 0                                   devices push, they never pull
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numba.extending import register_jitable

from trainmj.collision.fields import ELEMENT
from trainmj.collision.law.curve import segment, value
from trainmj.collision.law.kind import Kind, Response

if TYPE_CHECKING:
    from trainmj.collision.device import Law

STIFFNESS, DAMPING = ELEMENT.P0, ELEMENT.P1
PLASTIC = ELEMENT.STATE_0


@register_jitable
def respond(s: Any, e: int, stroke: float, rate: float, elapsed: float) -> Response:
    """Force and state after one step of the law; see :class:`~trainmj.collision.law.kind.Kind`."""
    plastic, curve = s[e + PLASTIC], int(s[e + ELEMENT.CURVE])
    if stroke <= plastic:
        return 0.0, plastic, 0.0, 0.0, 0.0
    before = int(s[e + ELEMENT.SEGMENT])
    k = segment(s, curve, before, stroke)
    s[e + ELEMENT.SEGMENT] = k
    return pressed(s, e, stroke, rate, value(s, curve, k, stroke), before, k)


@register_jitable
def pressed(s: Any, e: int, stroke: float, rate: float, crush: float, before: int, k: int) -> Response:
    """The law where u > u_p, F_env(u) given, when the last stroke was in one segment of the curve and this is in k."""
    plastic, stiffness = s[e + PLASTIC], s[e + STIFFNESS]
    now = plastic
    elastic = stiffness * (stroke - plastic)
    if elastic >= crush:
        force, now = crush, stroke - crush / stiffness
    else:
        force = min(crush, max(0.0, elastic + s[e + DAMPING] * rate))
    if k > before:
        s[e + ELEMENT.PEAK] = _passed(s, e, before, k)
    # lost: mean force over plastic travel, and what the dashpot adds to the spring over the whole
    spring = max(0.0, stiffness * (stroke - now))
    viscous = (force - spring) * (stroke - s[e + ELEMENT.STROKE])
    return force, now, 0.0, 0.5 * (force + s[e + ELEMENT.FORCE]) * (now - plastic) + viscous, viscous


@register_jitable
def _passed(s: Any, e: int, before: int, k: int) -> float:
    """Largest force at the points of the curve that were passed between two strokes, climbing along K to each."""
    curve = int(s[e + ELEMENT.CURVE])
    n, at = int(s[curve]), curve + 1
    plastic, stiffness = s[e + PLASTIC], s[e + STIFFNESS]
    peak = 0.0
    for point in range(before + 1, k + 1):
        crush = s[at + n + 1 + point]
        climbed = stiffness * (s[at + point] - plastic)
        if climbed >= crush:
            plastic = s[at + point] - crush / stiffness
        peak = max(peak, min(climbed, crush))
    return peak


def stored(law: Law, stroke: float, force: float, plastic: float, _: float) -> float:
    """Energy in the spring [J]."""
    left = max(0.0, stroke - plastic)
    return 0.5 * law.parameters[0] * left**2


def bounds(law: Law, _: float) -> tuple[float, float]:
    """Largest dF/du and dF/drate [N/m, N s/m]."""
    return law.parameters[0], law.parameters[1]


KIND = Kind("crush", respond, stored, bounds)
