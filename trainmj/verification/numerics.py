"""The step and the batch: what must not matter, and by how much it does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from trainmj.collision.batch import run_chains
from trainmj.collision.chain import EVENTS, Chain
from trainmj.collision.lineup import line_up
from trainmj.collision.simulation import run
from trainmj.collision.stability import largest_step
from trainmj.collision.summary import summarise
from trainmj.scenario import load
from trainmj.units import MM, MS
from trainmj.verification import exact, kinds
from trainmj.verification.check import Check, Kind, alike, at_least, zero
from trainmj.verification.systems import chain, collide, envelope, follow, shipped

STEPS_MS = (0.2, 0.1, 0.05, 0.025)

JUMPING = ((0, 0), (10, 600), (60, 600), (60, 250), (110, 250), (110, 900), (140, 900), (200, 1400))
"""A plateau, a jump down to another one, a jump up, a ramp [mm, kN]."""

CLIMBED = (*JUMPING[:5], (110 + 650 / 800, 900), *JUMPING[6:])
"""The same where a stiffness of 800 kN/mm lets the force climb."""

JUMPING_STEPS_MS = (0.8, 0.4, 0.2, 0.1, 0.05)

PARTS = (1.0, 0.5, 0.25, 0.125)
"""Of the step of an exact case, 0.01 ms."""

ORDERED = (
    "Hysteresis, from zero force: stroke_mm front",
    "Rate factor, C 20 m/s, P 1: stroke_mm front",
    "Hydraulic buffer, constant orifice: speed_m_s M1",
    "Gas buffer, no orifice: stroke_mm front",
)
"""Exact numbers on the way to which no force jumps."""


def order_of_convergence() -> Iterator[Check]:
    """Errors fall with the step, at first order or better, where nothing jumps.

    On the B-type train they stay small instead: which of two devices is pressed on a hundredth of a millisecond earlier
    may hang on the step, and moves the stroke at the front by a tenth of a millimetre.
    """
    elastic = [envelope([(0, 0), (500, 5000)], 10), envelope([(0, 0), (500, 8000)], 16)]
    smooth = chain([33e3, 20e3, 41e3], elastic, [2.0, 0.0, 0.0], time_limit=0.15)
    exact = follow(smooth, 0.5e-6)
    runs = [follow(smooth, h * 1e-3) for h in STEPS_MS]
    for what, field in (("strokes", "stroke_max"), ("speeds", "speed")):
        errors = [float(np.linalg.norm(getattr(r, field) - getattr(exact, field))) for r in runs]
        order = float(np.polyfit(np.log(STEPS_MS), np.log(errors), 1)[0])
        yield Check("Three masses on springs", f"order of convergence of {what}", 1.0, order, 0.1, Kind.AT_LEAST)
    full = replace(shipped(), time_limit=0.6)
    strokes = follow(full, 1e-6).stroke_max
    worst = max(float(np.abs(follow(full, h * 1e-3).stroke_max - strokes).max()) for h in STEPS_MS)
    name = f"B-type train, steps of {STEPS_MS[-1]:g} to {STEPS_MS[0]:g} ms"
    yield zero(name, "strokes, largest error", worst / MM, 0.5, "mm")


def order_of_events() -> Iterator[Check]:
    """The integrator events is of second order through plateaus and jumps, where euler has none."""
    name, exact = "Events, a mass in a curve that jumps", stopped(CLIMBED, 40.0, 2.0)
    found = [stroke_in_jumps(EVENTS, step) for step in JUMPING_STEPS_MS]
    yield Check(name, f"stroke at a step of {JUMPING_STEPS_MS[0]:g} ms", exact, found[0], 1e-5, unit="mm")
    order = float(np.polyfit(np.log(JUMPING_STEPS_MS), np.log(np.abs(np.subtract(found, exact))), 1)[0])
    yield Check(name, "order of convergence", 2.0, order, 0.2, Kind.AT_LEAST)


def stroke_in_jumps(integrator: str, step_ms: float, damping: float = 0.0) -> float:
    """Largest stroke of 40 t at 2 m/s against a wall in the curve that jumps [mm], its dashpot in kN s/m."""
    device = envelope(JUMPING, 800, damping)
    case = chain([40e3], [device], [2.0], step=step_ms * MS, steps_per_record=1, time_limit=0.2)
    (found,) = collide(replace(case, integrator=integrator))
    return found.interfaces[0].stroke_mm


def stopped(points: Sequence[tuple[float, float]], mass_t: float, speed: float) -> float:
    """Where a mass comes to rest in a curve [mm, kN], the area below which is its kinetic energy [mm].

    Args:
        points: of the curve, as its stiffness lets the force climb.
        mass_t: of the vehicle [t].
        speed: at the first contact [m/s].
    """
    left = 0.5 * mass_t * speed**2  # [kJ]
    for (u, force), (to, force_there) in pairwise(points):
        area = 0.5 * (force + force_there) * (to - u) * MM
        if area >= left:
            slope = (force_there - force) / (to - u)
            return float(u + 2.0 * left / MM / (force + np.sqrt(force**2 + 2.0 * slope * left / MM)))
        left -= area
    return float("nan")


def order_by_kind() -> Iterator[Check]:
    """Against the exact numbers of a kind; the speed of an orifice and of a rate factor is that of the step before."""
    by_quantity = {f"{e.name}: {e.quantity}": e for e in kinds.cases()}
    for name in ORDERED:
        case = by_quantity[name]
        errors = [abs(exact.found(exact.computed(case, by), case.quantity) - case.exact) for by in PARTS]
        order = float(np.polyfit(np.log(PARTS), np.log(errors), 1)[0])
        yield Check(case.name, f"order of convergence of {case.quantity}", 1.0, order, 0.1, Kind.AT_LEAST)


def default_step() -> Iterator[Check]:
    """The default step moves the criteria by less than the bars against the paper allow: it is not a fitted number."""
    name = "B-type train, default step and a 20th of it"
    long = {"simulation.step_ms": 0.5, "simulation.integrator": EVENTS}
    default, fine, events = collide(shipped(), shipped(changes={"simulation.step_ms": 0.005}), shipped(changes=long))
    yield Check(name, "TS", fine.TS_mm, default.TS_mm, 1e-4, unit="mm")
    yield Check(name, "TAMA", fine.TAMA_g, default.TAMA_g, 1.5e-3, unit="g")
    found, expected = ([i.stroke_mm for i in summary.interfaces] for summary in (default, fine))
    yield alike(name, "strokes", found, expected, 2.0, 1.0, "mm")
    found, expected = ([v.peak_device_acceleration_g for v in summary.vehicles] for summary in (default, fine))
    yield alike(name, "peak accelerations", found, expected, 0.02, 1.0, "g")
    name = "B-type train, events at 0.5 ms and euler at 0.005 ms"
    yield Check(name, "TS", fine.TS_mm, events.TS_mm, 1e-5, unit="mm")
    found, expected = ([i.stroke_mm for i in summary.interfaces] for summary in (events, fine))
    yield alike(name, "strokes", found, expected, 0.02, 1.0, "mm")


def batch_and_single() -> Iterator[Check]:
    """Collisions side by side on all cores give the numbers of single runs, bit for bit."""
    scenarios = [load("b_type", {"mass_t": m, "empty_stroke_mm": d}) for m, d in ((30, 22), (33, 35), (36, 50))]
    batch = dict(run_chains(((k, line_up(s)) for k, s in enumerate(scenarios)), threads=2))
    differ = sum(batch[k].as_dict() != summarise(run(s)).as_dict() for k, s in enumerate(scenarios))
    yield zero("Batch and single runs", "cases of 3 that differ in any bit", differ, 0)


def growth(case: Chain, step: float) -> float:
    """Largest |eigenvalue| of one step with every interface at its stiffest; above 1 it is unstable."""
    n, m = len(case.vehicles), len(case.interfaces)
    pull = np.eye(m, n) - np.eye(m, n, k=1)  # what makes strokes of positions
    stiffness, damping = (
        pull.T @ (np.array(of)[:, None] * pull) / case.mass[:, None]
        for of in zip(*(i.bounds(case.closing_speed) for i in case.interfaces), strict=True)
    )
    speed = np.hstack([-step * stiffness, np.eye(n) - step * damping])
    place = np.hstack([np.eye(n), np.zeros((n, n))]) + step * speed
    return float(np.abs(np.linalg.eigvals(np.vstack([place, speed]))).max())


def stability() -> Iterator[Check]:
    """The largest step that the rule allows is stable, and not far from where stability ends."""
    for name in ("b_type", "b_type_wall", "wagon_80t"):
        case = shipped(name)
        limit = largest_step(case)
        beyond = max(0.0, growth(case, limit) - 1.0)
        yield zero(f"Largest step of {name}", "growth in a step, beyond 1", beyond, 1e-6)
        yield at_least(f"Largest step of {name}", "growth at 3 times it", 1.001, growth(case, 3 * limit))


CASES = (order_of_convergence, order_of_events, order_by_kind, default_step, stability, batch_and_single)
