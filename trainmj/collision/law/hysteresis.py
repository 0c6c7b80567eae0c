"""Hysteresis: loading along one curve, unloading along a lower one, a stiff transition between the two.

Friction draft gears and rubber that recovers. With the loading curve L, the unloading curve U <= L, and the transition
stiffness Kt, steeper than both::

    F = Kt (u - q), within [U(u), L(u)]
    q = u - F / Kt where it is at either end

Both curves begin at the origin and climb along Kt, where they have a preload. What is lost is the area between L and U,
while the force slips along L. Behind its travel the device stands, and an end stop acts beside it. What the car body
behind it has given way is taken from the stroke u.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trainmj.collision.device import Device, pull_of
from trainmj.collision.elementwise import lesser, positive
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import ELEMENT, Block
from trainmj.collision.jitable import jitable
from trainmj.collision.kind import Kind, Law, Numbers, Response, points
from trainmj.collision.law import crush
from trainmj.collision.law.curve import follow, value
from trainmj.collision.law.stop import after, stop_of, stopped
from trainmj.scenario.devices import HysteresisDevice
from trainmj.scenario.parts import Parts
from trainmj.symbol import largest
from trainmj.units import KN, KN_PER_MM, MM

TRANSITION, TRAVEL, STOP, COLLAPSE = ELEMENT.P0, ELEMENT.P1, ELEMENT.P2, ELEMENT.P3
SLIPPED, GIVEN = ELEMENT.STATE_0, ELEMENT.STATE_1


@jitable
def respond(s: Block, e: int, stroke: float, rate: float, elapsed: float) -> Response:
    """Force and state after one step of the law; see :class:`~trainmj.collision.kind.Kind`."""
    given, travel = s[e + GIVEN], s[e + TRAVEL]
    own = stroke - given
    if own <= 0.0:
        return 0.0, 0.0, given, 0.0, 0.0
    if own <= travel:
        force, now, lost = _slip(s, e, own, s[e + ELEMENT.FORCE])
        return force, now, given, lost, 0.0
    stop, gives = stopped(own - travel, s[e + STOP], s[e + COLLAPSE])
    before, _ = stopped(s[e + ELEMENT.STROKE] - given - travel, s[e + STOP], s[e + COLLAPSE])
    force, now, lost = _slip(s, e, travel, s[e + ELEMENT.FORCE] - before)
    lost += (force + 0.5 * (stop + before)) * gives
    return force + stop, now, given + gives, lost, 0.0


@jitable
def _slip(s: Block, e: int, stroke: float, before: float) -> tuple[float, float, float]:
    """Force and slip at a stroke within the travel, and the energy lost; the force was another one before."""
    stiffness, slipped = s[e + TRANSITION], s[e + SLIPPED]
    loading, unloading = int(s[e + ELEMENT.CURVE]), int(s[e + ELEMENT.CURVE_2])
    high = value(s, loading, follow(s, loading, e + ELEMENT.SEGMENT, stroke), stroke)
    k = follow(s, unloading, e + ELEMENT.SEGMENT_2, stroke)
    low = value(s, unloading, k, stroke)
    elastic = stiffness * (stroke - slipped)
    if elastic > high:
        now = stroke - high / stiffness
        lost = (0.5 * (high + before) - _met(s, e, k, 0.5 * (now + slipped))) * (now - slipped)
        return high, now, lost
    if elastic < low:
        return low, stroke - low / stiffness, 0.0
    return elastic, slipped, 0.0


@jitable
def _met(s: Block, e: int, k: int, slipped: float) -> float:
    """Force at which the transition that ends at a stroke without force meets the unloading curve, below segment k."""
    curve, stiffness = int(s[e + ELEMENT.CURVE_2]), s[e + TRANSITION]
    while k > 0 and stiffness * (s[curve + 3 * k] - slipped) > s[curve + 3 * k + 1]:
        k -= 1
    at = curve + 3 * k
    if s[at + 2] >= stiffness * (1.0 - 1e-9):
        return s[at + 1]
    stroke = (s[at + 1] - s[at + 2] * s[at] + stiffness * slipped) / (stiffness - s[at + 2])
    return stiffness * (stroke - slipped)


def stored(law: Numbers, stroke: Any, force: Any, slipped: Any, given: Any) -> Array:
    """Energy that it gives back [J]: along the transition to the unloading curve, then along that; and in the stop."""
    stiffness, travel, stop, *_ = law.parameters
    u, f, slope = law.curves[1]
    own, over = stroke - given, positive(stroke - given - travel)
    with np.errstate(all="ignore"):  # where there is no force, or the transition is parallel
        left = force - stop * over
        reached = np.expand_dims(stiffness, -1) * (u - np.expand_dims(slipped, -1)) <= f
        start, high, steep = _at(np.maximum(0, reached.sum(axis=-1) - 1), u, f, slope)
        at = lesser(own, travel)
        crossing = (high - steep * start + stiffness * slipped) / (stiffness - steep)
        at = np.where(steep < stiffness * (1.0 - 1e-9), lesser(at, crossing), at)
        start, high, steep = _at((u[..., 1:] <= np.expand_dims(at, -1)).sum(axis=-1), u, f, slope)
        met = high + steep * (at - start)
        held = (left * left - met * met) / (2.0 * stiffness) + _area(u, f, slope, at)
        return np.where(force <= 0.0, 0.0, held + (left + 0.5 * stop * over) * over)


def _at(k: Any, *curve: Array) -> Iterator[Array]:
    """Stroke, value and slope (...) of a curve (..., n) at its points k."""
    for values in curve:
        yield np.take_along_axis(values, np.expand_dims(k, -1), axis=-1)[..., 0]


def _area(u: Array, f: Array, slope: Array, stroke: Array) -> Array:
    """Area below a curve from 0 to a stroke, added up from point to point."""
    found = np.zeros_like(stroke)
    for k in range(u.shape[-1]):
        end = u[..., k + 1] if k + 1 < u.shape[-1] else np.inf
        width = lesser(stroke, end) - u[..., k]
        more = width * (f[..., k] + 0.5 * slope[..., k] * width)
        found = np.where(u[..., k] < stroke, found + more, found)
    return found


def bounds(law: Law, _: float) -> tuple[float, float]:
    """Largest dF/du and dF/drate [N/m, N s/m]."""
    stiffness, _travel, stop, *_rest = law.parameters
    return largest([stiffness, stop]), 0.0


def device(name: str, spec: HysteresisDevice, parts: Parts) -> Device:
    """The device that a scenario describes."""
    stiffness = spec.transition_stiffness_kN_per_mm * KN_PER_MM
    empty = spec.empty_stroke_mm * MM

    def path(ref: Any) -> Envelope:
        u, f = (np.array(values) for values in parts.curve_points(ref))
        return after(empty, Envelope(u * MM, f * KN, stiffness).climbing)

    loading, unloading = path(spec.loading), path(spec.unloading)
    end = empty + parts.curve_points(spec.loading)[0][-1] * MM
    stop = stop_of(spec, end, loading.force_at(end))
    stated = spec.end() is not None
    numbers = (stiffness, end if stop.stiffness else np.inf, stop.stiffness, stop.most)
    law = Law(KIND, numbers, (points(loading), points(unloading)), stop.behind(loading), end=np.inf if stated else end)
    return Device(name, law, stop.stages(empty, spec.stroke_limit_mm), pull=pull_of(spec, parts, crush.law_of))


def permanent(law: Numbers, _: Any, given: Any) -> Array:
    """Stroke that remains without force [m]: what the car body has given way."""
    return np.asarray(given)


KIND = Kind("hysteresis", respond, device, stored, bounds, permanent, loss="frictional")
