"""Hydraulic and gas-hydraulic: an orifice that resists the square of the speed, a gas spring, an end stop.

The plunger stands at d, which is the stroke while it is pressed::

    G(d) = min(K_pre d, F0 (1 - d / l)^-gamma)     gas spring; without gas a constant preload, or nothing
    inwards:    F = G + c(u) v^2
    outwards:   F = max(0, G - c_r v^2)
    left alone: the plunger comes out with the speed at which G = c_r v^2; without gas it stays
    behind the stroke L of the plunger:  F = G(L) + K_stop (u - L), at most the collapse force of the car body

u is without what the car body has given way.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trainmj.collision.device import Device, pull_of
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import ELEMENT, Block
from trainmj.collision.jitable import jitable
from trainmj.collision.kind import Kind, Law, Numbers, Response, points
from trainmj.collision.law import crush
from trainmj.collision.law.curve import follow, value
from trainmj.collision.law.stop import after, stop_of, stopped
from trainmj.scenario.devices import GasHydraulicDevice, Hydraulic, HydraulicDevice
from trainmj.scenario.parts import Parts
from trainmj.symbol import case_by_case, largest
from trainmj.units import KN, KN_PER_MM, MM

PLUNGER, GIVEN = ELEMENT.STATE_0, ELEMENT.STATE_1
TRAVEL, STOP, COLLAPSE = ELEMENT.P0, ELEMENT.P1, ELEMENT.P2
PRELOAD, PER_LENGTH, GAMMA, RAMP = ELEMENT.P3, ELEMENT.P4, ELEMENT.P5, ELEMENT.P6
REBOUND, KNEE, EMPTY = ELEMENT.P7, ELEMENT.P8, ELEMENT.P9
"""c_r [N s2/m2], infinite where nothing brings the plunger back; the d at which the ramp of the preload ends [m]; the
empty stroke before it all [m]."""

_GAS_POINTS = 60  # of the gas spring, for pictures


@jitable
def respond(s: Block, e: int, stroke: float, rate: float, elapsed: float) -> Response:
    """Force and state after one step of the law; see :class:`~trainmj.collision.kind.Kind`."""
    plunger, given = s[e + PLUNGER], s[e + GIVEN]
    own, before = stroke - s[e + EMPTY] - given, s[e + ELEMENT.STROKE] - s[e + EMPTY] - given
    if own <= 0.0 and plunger <= 0.0:
        return 0.0, 0.0, given, 0.0, 0.0
    travel, rebound = s[e + TRAVEL], s[e + REBOUND]
    gas_before = _gas(s, e, plunger)
    # where the plunger is: pressed by the stroke, or come out by itself
    now = min(own, travel)
    if now < plunger:
        if math.isinf(rebound):
            now = plunger
        elif rebound > 0.0:
            now = max(now, plunger - elapsed * math.sqrt(gas_before / rebound))
        now = max(now, 0.0)
    gas = _gas(s, e, now)
    # the stop behind its travel, and the car body behind that
    stop_before, _ = stopped(before - travel, s[e + STOP], s[e + COLLAPSE])
    stop, gives = stopped(own - travel, s[e + STOP], s[e + COLLAPSE])
    force = 0.0
    if own >= travel:
        force = gas + stop
    elif own >= now and rate >= 0.0:
        curve = int(s[e + ELEMENT.CURVE])
        k = follow(s, curve, e + ELEMENT.SEGMENT, stroke - given)
        force = gas + value(s, curve, k, stroke - given) * rate * rate
    elif own >= now and not math.isinf(rebound):
        force = max(0.0, gas - rebound * rate * rate)
    # lost by speed: the work that is neither in the gas nor at the stop
    end = 0.5 * (stop + stop_before) + (_gas(s, e, travel) if own > travel or before > travel else 0.0)
    crushed = end * gives
    viscous = 0.5 * (force + s[e + ELEMENT.FORCE]) * (own - before)
    viscous -= end * (max(own, travel) - max(before, travel))
    if not math.isinf(rebound):
        viscous -= _held(s, e, now) - _held(s, e, plunger)  # not by the mean of the forces: it may come out in one step
    return force, now, given + gives, crushed + viscous, viscous


@jitable
def _gas(s: Block, e: int, plunger: float) -> float:
    """Force of the gas, or of the preload."""
    if plunger <= s[e + KNEE]:
        return s[e + RAMP] * max(0.0, plunger)
    pressed: float = (1.0 - s[e + PER_LENGTH] * plunger) ** -s[e + GAMMA]
    return s[e + PRELOAD] * pressed


@jitable
def _held(s: Block, e: int, plunger: float) -> float:
    """Energy in the gas, or behind the preload [J]."""
    knee, per_length, gamma = s[e + KNEE], s[e + PER_LENGTH], s[e + GAMMA]
    ramped = min(plunger, knee)
    found: float = 0.5 * s[e + RAMP] * ramped * ramped
    if plunger > knee:
        if per_length == 0.0:
            found += s[e + PRELOAD] * (plunger - knee)
        elif gamma == 1.0:
            found += s[e + PRELOAD] / per_length * math.log((1.0 - per_length * knee) / (1.0 - per_length * plunger))
        else:
            before, now = (1.0 - per_length * knee) ** (1.0 - gamma), (1.0 - per_length * plunger) ** (1.0 - gamma)
            found += s[e + PRELOAD] / (per_length * (gamma - 1.0)) * (now - before)
    return found


def stored(law: Numbers, stroke: Any, force: Any, plunger: Any, given: Any) -> Array:
    """Energy in the gas and in the stop [J]."""
    one_by_one = np.vectorize(_stored, otypes=[np.float64])  # NumPy's own powers may differ in the last bit
    return np.asarray(one_by_one(stroke, plunger, given, *law.parameters))


def _stored(stroke: float, plunger: float, given: float, *parameters: float) -> float:
    """The same of one device."""
    travel, stop, *_, rebound, _, empty = numbers = [*parameters]
    over = max(0.0, stroke - empty - travel - given)
    carried = _gas(numbers, -ELEMENT.P0, travel)  # along the stop, too
    found = (carried + 0.5 * stop * over) * over
    return found if math.isinf(rebound) else found + _held(numbers, -ELEMENT.P0, plunger)


def bounds(law: Law, fastest: float) -> tuple[float, float]:
    """Largest dF/du and dF/drate [N/m, N s/m]: the orifice at the largest rate, the gas at the end of its travel."""
    travel, stop, _, preload, per_length, gamma, ramp, rebound, _, _ = law.parameters
    metering = law.curves[0]
    gas = preload * gamma * per_length * (1.0 - per_length * travel) ** (-gamma - 1.0)
    steepest = largest(abs(metering[2]).tolist()) * fastest**2
    orifice = largest([*metering[1].tolist(), rebound if rebound < math.inf else 0.0])
    return largest([stop, ramp, gas + steepest]), 2.0 * orifice * fastest


def device(name: str, spec: Hydraulic, parts: Parts) -> Device:
    """The device that a scenario describes."""
    empty, travel = spec.empty_stroke_mm * MM, spec.stroke_mm * MM
    u, c = (np.array(values) for values in spec.orifice_points())
    metering = after(empty, Envelope(u * MM, c * KN, 1.0))
    preload = ramp = per_length = 0.0
    gamma, rebound = 1.0, math.inf
    if isinstance(spec, HydraulicDevice):
        preload, ramp = spec.preload_kN * KN, (spec.preload_stiffness_kN_per_mm or 0.0) * KN_PER_MM
    if isinstance(spec, GasHydraulicDevice):
        gas = spec.gas
        preload, per_length, gamma = gas.force_kN * KN, 1.0 / (gas.length_mm * MM), gas.exponent
        ramp, rebound = gas.preload_stiffness_kN_per_mm * KN_PER_MM, spec.rebound_orifice_kN_s2_per_m2 * KN
    gas_spring = preload, per_length, gamma, ramp, travel
    knee = case_by_case(_knee, *gas_spring) if preload > 0.0 else 0.0
    strokes, spring = case_by_case(_spring, knee, *gas_spring)
    resting = after(empty, Envelope(strokes, spring, largest([ramp, 1.0])))
    stop = stop_of(spec, empty + travel, spring.tolist()[-1])
    numbers = (travel, stop.stiffness, stop.most, preload, per_length, gamma, ramp, rebound, knee, empty)
    law = Law(KIND, numbers, (points(metering),), stop.behind(resting))
    return Device(name, law, stop.stages(empty, spec.stroke_limit_mm), pull=pull_of(spec, parts, crush.law_of))


def _knee(preload: float, per_length: float, gamma: float, ramp: float, travel: float) -> float:
    """The stroke at which the ramp of the preload meets the gas [m]."""
    from scipy.optimize import brentq  # slow to load, and most trains have no such device

    def short(d: float) -> float:
        """What the ramp lacks of the gas."""
        return float(preload * (1.0 - per_length * d) ** -gamma - ramp * d)

    return float(brentq(short, 0.0, travel)) if short(travel) < 0.0 else travel


def _spring(knee: float, preload: float, per_length: float, gamma: float, ramp: float, travel: float) -> Array:
    """(2, n) strokes [m] and forces [N] of the gas spring."""
    strokes = np.unique(np.concatenate([[0.0, knee], np.linspace(knee, travel, _GAS_POINTS)]))
    forces = np.where(strokes <= knee, ramp * strokes, preload * (1.0 - per_length * strokes) ** -gamma)
    return np.array([strokes, forces])


def recovers(law: Numbers) -> Any:
    """Whether gas brings the plunger back."""
    return np.isfinite(law.parameters[7])


def permanent(law: Numbers, plunger: Any, given: Any) -> Array:
    """Stroke that remains without force [m]: of the car body, and of a plunger that nothing brings back."""
    return np.asarray(given + np.where(recovers(law), 0.0, plunger))


KIND = Kind("hydraulic", respond, device, stored, bounds, permanent, store="gas")
