"""Collisions that must come out alike: seen from a moving train, in a mirror, at another scale, against a wall."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.device import Array, Envelope
from trainmj.collision.block import Tally
from trainmj.collision.summary import Summary
from trainmj.units import KM_H
from trainmj.verification.check import Check, Kind, furthest
from trainmj.verification.systems import FRICTIONLESS, collide, follow, numbers, shipped


def vehicle_numbers(summary: Summary, side: str) -> Array:
    """(n, 4) accelerations and balance times of one train."""
    rows = [
        [v.peak_device_acceleration_g, v.mean_30ms_g, v.cfc60_peak_g, v.balance_time_s]
        for v in summary.vehicles
        if v.name.startswith(side)
    ]
    return np.array(rows)


def interface_numbers(summary: Summary, n: int | None = None) -> Array:
    """(n, 4) strokes, permanent sets, forces and energies of the first interfaces."""
    rows = [[i.stroke_mm, i.permanent_mm, i.peak_force_kN, i.energy_kJ] for i in summary.interfaces[:n]]
    return np.array(rows)


def _same(case: str, what: str, found: Array, expected: Array, tolerance: float) -> Check:
    return Check(case, f"{what}, largest difference", 0.0, furthest(found, expected), tolerance, Kind.ABSOLUTE)


def twin_and_wall() -> Iterator[Check]:
    """Without rail friction V into a standing twin is V/2 against a wall, vehicle by vehicle.

    Yao et al. 2019, doi 10.1177/0954409718779940.
    """
    name = "Twin at V, wall at V/2"
    twin, wall = collide(shipped(changes=FRICTIONLESS), shipped("b_type_wall", FRICTIONLESS))
    yield _same(name, "interfaces", interface_numbers(twin, 6), interface_numbers(wall, 6), 1e-6)
    yield _same(name, "moving vehicles", vehicle_numbers(twin, "M"), vehicle_numbers(wall, "M"), 1e-6)
    yield _same(name, "standing vehicles", vehicle_numbers(twin, "S"), vehicle_numbers(wall, "M"), 1e-6)
    yield Check(name, "TS", wall.TS_mm, twin.TS_mm, 1e-6, unit="mm")
    yield Check(name, "front crushed (or little is compared)", 500.0, twin.interfaces[0].stroke_mm, 0.0, Kind.AT_LEAST)


def galilean() -> Iterator[Check]:
    """Adding one speed to all vehicles changes nothing; with rail friction it would."""
    for more in (-25.0, -12.5, 30.0):
        name = f"{more:+g} km/h for all vehicles"
        still, moving = collide(
            shipped(changes=FRICTIONLESS),
            shipped(changes=FRICTIONLESS | {"collision.speed_km_h": 25 + more, "collision.partner_speed_km_h": more}),
        )
        yield _same(name, "interfaces", interface_numbers(moving), interface_numbers(still), 1e-8)
        for side in "MS":
            yield _same(name, f"vehicles {side}", vehicle_numbers(moving, side), vehicle_numbers(still, side), 1e-8)
        final = [np.array([v.final_speed_km_h for v in s.vehicles]) for s in (still, moving)]
        yield _same(name, "speeds at the end", final[1] - more, final[0], 1e-7)


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
    seen, image = numbers(follow(case)), numbers(follow(mirrored(case)))
    yield _same(name, "strokes", image[0][::-1], seen[0], 1e-9)
    yield _same(name, "forces", image[1][::-1], seen[1], 1e-9)
    yield _same(name, "speeds at the end", -image[2][::-1], seen[2], 1e-9)


def scaled(case: Chain, scale: float) -> Chain:
    """A model of a collision: lengths / scale, forces / scale2, masses / scale3, times / scale, speeds equal.

    Rail friction scales as the forces only if its coefficient is larger by the scale.
    """
    interfaces = []
    for i in case.interfaces:
        e = i.envelope
        small = Envelope(e.stroke / scale, e.force / scale**2, e.stiffness / scale, e.damping / scale**2)
        interfaces.append(replace(i, envelope=small, left_stroke=i.left_stroke / scale))
    return replace(
        case,
        vehicles=tuple(replace(v, mass=v.mass / scale**3, length=v.length / scale) for v in case.vehicles),
        interfaces=tuple(interfaces),
        gap=case.gap / scale,
        rail_friction=scale * case.rail_friction,
        step=case.step / scale,
        time_limit=case.time_limit / scale,
    )


def similitude() -> Iterator[Check]:
    """The train of Shao et al. 2016 (doi 10.1155/2016/3084052) at their scale of 1/8: all factors are powers of two."""
    name = "Eight-car train at 1/8 scale"
    full = replace(shipped("en15227_c1"), time_limit=2.0)
    large: Tally = follow(full)
    small = follow(scaled(full, 8.0))
    yield _same(name, "strokes x 8", 8 * small.stroke_max, large.stroke_max, 1e-12)
    yield _same(name, "forces x 64", 64 * small.force_max, large.force_max, 1e-12)
    yield _same(name, "accelerations / 8", small.device_peak / 8, large.device_peak, 1e-12)
    yield _same(name, "energies x 512", 512 * small.dissipated, large.dissipated, 1e-12)
    yield _same(name, "speeds at the end", small.speed / KM_H, large.speed / KM_H, 1e-12)
