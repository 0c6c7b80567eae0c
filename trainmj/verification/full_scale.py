"""Full-scale tests of the FRA beside computed ones, and collisions of tests and standards whose loss is a formula."""

from __future__ import annotations

import math
from collections.abc import Iterator

from trainmj.units import KJ, KM_H, KN, KN_PER_MM, TONNE
from trainmj.verification.check import Check, Kind
from trainmj.verification.systems import chain, collide, envelope, shipped

FITTED = 0.02
"""What the tests against a wall are met to, from which the curve of the ends was identified."""

LEAD, ALL = 150.0, 0.30
"""Bars on what was held out: the lead car [mm], and all crush zones, relative."""

EXACT = 1e-5
"""What plastic losses are met to, relative."""

FOOT = 304.8  # mm
MPH = 0.44704  # m/s


def crash_energy_management() -> Iterator[Check]:
    """FRA 2003 to 2006: two tests against a wall, to which two forces were fitted, and that of two trains, held out."""
    names = ("fra_cem_single", "fra_cem_two", "fra_cem_train")
    single, two, train = (summary.row() for summary in collide(*map(shipped, names)))
    name = "FRA test of one car against a wall, 3 December 2003: fitted"
    yield Check(name, "crush", 3 * FOOT, single["stroke_M1_wall_mm"], FITTED, unit="mm")
    name = "FRA test of two cars against a wall, 26 February 2004: fitted"
    between = two["stroke_M1_M2_M1_mm"] + two["stroke_M1_M2_M2_mm"]
    yield Check(name, "crush at the wall", 3 * FOOT, two["stroke_M1_wall_mm"], FITTED, unit="mm")
    yield Check(name, "crush between the cars", 2 * FOOT, between, FITTED, unit="mm")
    name = "FRA test of two trains, 23 March 2006: held out"
    zones = train["TS_mm"] - train["stroke_M5_M6_M6_mm"]  # the locomotive's end is none
    yield Check(name, "crush of the lead car", 900.0, train["stroke_S1_M1_mm"], LEAD, Kind.ABSOLUTE, "mm")
    yield Check(name, "all crush zones", 18 * FOOT, zones, ALL, unit="mm")


def plastic() -> Iterator[Check]:
    """Partners of standards (a wagon, the same metro, the same electric train, a lorry), and MIRA's coach of 2009.

    Of the latter about 1.5 MJ is printed, which is the coach's kinetic energy, but no crush: it is no validation.
    """
    partners = (
        ("", 129.0, 80.0, 36.0),
        ("", 198.0, 198.0, 25.0),
        ("", 462.0, 462.0, 36.0),
        ("", 129.0, 15.0, 110.0),
        (" (MIRA 2009, 22 mph)", 32.0, 82.0, 22 * MPH / KM_H),
    )
    for note, own, other, km_h in partners:
        name = f"{own:g} t at {km_h:.4g} km/h into {other:g} t standing, plastic{note}"
        yield from _plastic(name, own, other, km_h * KM_H)


def _plastic(name: str, own: float, other: float, speed: float) -> Iterator[Check]:
    """Two masses [t] and a force F with a stiffness K so high that of m v2 / 2, m of both, all but F2 / 2 K is lost.

    They part at F / sqrt(K m).
    """
    force, stiffness = 2000.0, 2e5
    both = own * other / (own + other) * TONNE
    case = chain(
        [own * TONNE, other * TONNE],
        [envelope([(0, 0), (force / stiffness, force), (9900, force)], stiffness)],
        [speed, 0.0],
        step=2e-5,
        time_limit=3.0,
    )
    (summary,) = collide(case)
    f, k = force * KN, stiffness * KN_PER_MM
    lost = (0.5 * both * speed**2 - 0.5 * f**2 / k) / KJ
    change = both / (own * TONNE) * (speed + f / math.sqrt(k * both)) / KM_H
    yield Check(name, "lost", lost, summary.balance.absorbed_kJ, EXACT, unit="kJ")
    yield Check(
        name, "change of speed", change, speed / KM_H - summary.vehicles[0].final_speed_km_h, EXACT, unit="km/h"
    )


CASES = (crash_energy_management, plastic)
