"""Collisions that must come out alike: seen from a moving train, in a mirror, at another scale, against a wall."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.kind import Law
from trainmj.collision.law import crush
from trainmj.collision.summary import Summary
from trainmj.units import KM_H
from trainmj.verification.check import Check, alike, at_least
from trainmj.verification.systems import FRICTIONLESS, collide, follow, shipped

INTERFACE = ("stroke_mm", "permanent_mm", "peak_force_kN", "energy_kJ")
VEHICLE = (
    *("peak_device_acceleration_g", "mean_deceleration_g", "worst_mean_deceleration_g"),
    *("mean_30ms_g", "cfc60_peak_g", "balance_time_s"),
)


def interfaces(summary: Summary) -> Array:
    """(n, 4) strokes, permanent sets, forces and energies of the interfaces."""
    return np.array([[i.values[name] for name in INTERFACE] for i in summary.interfaces])


def vehicles(summary: Summary, side: str) -> Array:
    """(n, 6) accelerations and balance times of one train."""
    return np.array([[v.values[name] for name in VEHICLE] for v in summary.vehicles if v.name.startswith(side)])


def twin_and_wall() -> Iterator[Check]:
    """Without rail friction V into a standing twin is V/2 against a wall, vehicle by vehicle.

    Yao et al. 2019, doi 10.1177/0954409718779940.
    """
    name = "Twin at V, wall at V/2"
    twin, wall = collide(shipped(changes=FRICTIONLESS), shipped("b_type_wall", FRICTIONLESS))
    yield alike(name, "interfaces", interfaces(twin)[:6], interfaces(wall)[:6], 1e-6)
    yield alike(name, "moving vehicles", vehicles(twin, "M"), vehicles(wall, "M"), 1e-6)
    yield alike(name, "standing vehicles", vehicles(twin, "S"), vehicles(wall, "M"), 1e-6)
    yield Check(name, "TS", wall.TS_mm, twin.TS_mm, 1e-6, unit="mm")
    yield at_least(name, "front crushed (or little is compared)", 500.0, twin.interfaces[0].stroke_mm)


def galilean() -> Iterator[Check]:
    """Adding one speed to all vehicles changes nothing; with rail friction it would."""
    for more in (-25.0, -12.5, 30.0):
        name = f"{more:+g} km/h for all vehicles"
        still, moving = collide(
            shipped(changes=FRICTIONLESS),
            shipped(changes=FRICTIONLESS | {"collision.speed_km_h": 25 + more, "collision.partner_speed_km_h": more}),
        )
        yield alike(name, "interfaces", interfaces(moving), interfaces(still), 1e-8)
        for side in "MS":
            yield alike(name, f"vehicles {side}", vehicles(moving, side), vehicles(still, side), 1e-8)
        final = [np.array([v.final_speed_km_h for v in s.vehicles]) for s in (still, moving)]
        yield alike(name, "speeds at the end", final[1] - more, final[0], 1e-7)


def mirrored(case: Chain) -> Chain:
    """The same collision seen in a mirror."""
    n = len(case.vehicles)
    return replace(
        case,
        vehicles=tuple(replace(v, speed=-v.speed) for v in case.vehicles[::-1]),
        interfaces=tuple(replace(i, left=k, right=k + 1) for k, i in enumerate(case.interfaces[::-1])),
        n_moving=n - case.n_moving,
    )


def mirror() -> Iterator[Check]:
    """A sign mistake on one side only, in the law or in rail friction, would show here."""
    name = "Seen in a mirror"
    case = shipped("b_type_scenario_2")
    seen, image = follow(case), follow(mirrored(case))
    yield alike(name, "strokes", image.stroke_max[::-1], seen.stroke_max, 1e-9)
    yield alike(name, "forces", image.force_max[::-1], seen.force_max, 1e-9)
    yield alike(name, "speeds at the end", -image.speed[::-1], seen.speed, 1e-9)


def scaled(case: Chain, scale: float) -> Chain:
    """A model of a collision: lengths / scale, forces / scale2, masses / scale3, times / scale, speeds equal.

    Rail friction scales as the forces only if its coefficient is larger by the scale.
    """
    return replace(
        case,
        vehicles=tuple(
            replace(v, mass=v.mass / scale**3, length=v.length / scale, rail_friction=scale * v.rail_friction)
            for v in case.vehicles
        ),
        interfaces=tuple(
            replace(i, elements=tuple(replace(e, laws=tuple(_small(law, scale) for law in e.laws)) for e in i.elements))
            for i in case.interfaces
        ),
        gap=case.gap / scale,
        step=case.step / scale,
        time_limit=case.time_limit / scale,
    )


def _small(law: Law, scale: float) -> Law:
    """A law of a crush device at a scale."""
    e = law.loading
    return crush.law_of(Envelope(e.stroke / scale, e.force / scale**2, e.stiffness / scale, e.damping / scale**2))


def similitude() -> Iterator[Check]:
    """The train of Shao et al. 2016 (doi 10.1155/2016/3084052) at their scale of 1/8: all factors are powers of two."""
    name = "Eight-car train at 1/8 scale"
    full = replace(shipped("en15227_c1"), time_limit=2.0)
    large, small = follow(full), follow(scaled(full, 8.0))
    yield alike(name, "strokes x 8", 8 * small.stroke_max, large.stroke_max, 1e-12)
    yield alike(name, "forces x 64", 64 * small.force_max, large.force_max, 1e-12)
    yield alike(name, "accelerations / 8", small.device_peak / 8, large.device_peak, 1e-12)
    yield alike(name, "energies x 512", 512 * small.dissipated, large.dissipated, 1e-12)
    yield alike(name, "speeds at the end", small.speed / KM_H, large.speed / KM_H, 1e-12)


CASES = (twin_and_wall, galilean, mirror, similitude)
