"""The laws that the paper states in words, checked on our results: those of Sections 3.2, 7 and 8."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trainmj.collision.result import Result
from trainmj.collision.summary import summarise
from trainmj.paper.analysis import Analysis
from trainmj.paper.collisions import Collisions
from trainmj.paper.comparison import OURS, Comparison
from trainmj.paper.finding import Law
from trainmj.paper.laws_of_factors import laws_of_D, laws_of_M
from trainmj.paper.printed import LIMIT_ACCELERATION_G, LIMIT_OTHERS_MM, published
from trainmj.units import KM_H

STRONG = 0.5
"""Least |r| that Section 7 calls strong: 0.554 is, 0.446 is not."""


def laws(collisions: Collisions, tables: Mapping[str, Comparison], ours: Analysis) -> Iterator[Law]:
    """All of them, in the order of the paper."""
    for number, result in enumerate(collisions.scenarios, start=1):
        yield from laws_of_validation(result, f"scenario {number}")
    yield from laws_of_D(collisions, tables)
    yield from laws_of_M(collisions, tables)
    yield from laws_of_correlation(tables["10"])
    yield from laws_of_optimisation(collisions, ours)


def laws_of_validation(result: Result, which: str) -> Iterator[Law]:
    """Section 3.2, for one scenario of Table 2."""
    summary, chain = summarise(result), result.chain
    section, balance = f"3.2, {which}", summary.balance
    yield Law(
        section,
        "The total energy keeps the same",
        "",
        f"off by {abs(balance.energy_error):.1e}",
        abs(balance.energy_error) < 1e-3,
        "below 0.001 of the initial kinetic energy",
    )
    half = (balance.absorbed_kJ + balance.elastic_kJ) / balance.kinetic_start_kJ
    yield Law(
        section,
        "The internal energy is finally about half of the initial kinetic energy",
        "0.5",
        f"{half:.4f}",
        abs(half - 0.5) < 0.01,
        "0.5 within 0.01",
    )
    n = chain.n_moving
    moving, standing = summary.interfaces[1:n], summary.interfaces[n:]
    front = summary.interfaces[0].stroke_mm * 2
    off = max(abs(a.stroke_mm - b.stroke_mm) for a, b in zip(moving, standing, strict=True))
    yield Law(
        section,
        "Strokes are symmetrical about S1-M1",
        "",
        f"differ by at most {off:.2f} mm",
        off < 0.01 * front,
        "below 1 % of the largest stroke; rail friction brakes the moving train alone at first",
    )
    yield Law(
        section,
        "S1-M1 has the largest stroke",
        "",
        f"{front:.0f} mm, the next {moving[0].stroke_mm:.0f} mm",
        front > max(i.stroke_mm for i in (*moving, *standing)),
        "",
    )
    strokes = [i.stroke_mm for i in moving]
    yield Law(
        section,
        "Strokes gradually decrease from S1-M1 towards the ends",
        "",
        ", ".join(f"{s:.0f}" for s in [front, *strokes]) + " mm",
        bool((np.diff([front, *strokes]) < 0).all()),
        "every stroke smaller than the one before it",
    )
    first_three = sum(i.energy_kJ for i in summary.interfaces[:3]) / sum(i.energy_kJ for i in summary.interfaces[:n])
    yield Law(
        section,
        "The first three interfaces absorb most of the energy",
        "",
        f"{100 * first_three:.1f} % of the train's",
        first_three > 0.9,
        "above 90 %",
    )
    final = float(np.mean([v.final_speed_km_h for v in summary.vehicles])) / (float(chain.speed[0]) / KM_H)
    yield Law(
        section,
        "The final speed is about half of the initial one",
        "0.5",
        f"{final:.3f}",
        abs(final - 0.5) < 0.05,
        "0.5 within 0.05; rail friction takes the rest",
    )


def laws_of_correlation(table: Comparison) -> Iterator[Law]:
    """Section 7: signs and strength of the correlations on our ten responses."""
    ours = table.found[OURS]
    for row, factor in enumerate(table.keys["parameter"]):
        printed, found = table.published.iloc[row], ours.iloc[row]
        wrong = [h for h in table.heads if np.sign(printed[h]) != np.sign(found[h])]
        yield Law(
            "7",
            f"Signs of {factor}'s correlations with the seven responses",
            f"{len(table.heads)} signs",
            f"{len(table.heads) - len(wrong)} the same"
            + "".join(f"; {h} {found[h]:+.2f} for {printed[h]:+.2f}" for h in wrong),
            not wrong,
            "all signs the same",
        )
        strong = [h for h in table.heads if abs(found[h]) >= STRONG]
        expected = [h for h in table.heads if abs(printed[h]) >= STRONG]
        yield Law(
            "7",
            f"Responses strongly correlated with {factor}",
            ", ".join(expected) if len(expected) < len(table.heads) else "all",
            ", ".join(strong) if len(strong) < len(table.heads) else "all",
            strong == expected,
            f"|r| of {STRONG:g} or more is strong",
        )


def laws_of_optimisation(collisions: Collisions, ours: Analysis) -> Iterator[Law]:
    """Section 8: limits, the shape of the front, and what the optimum gains."""
    largest = max(v.peak_device_acceleration_g for s in collisions.summaries.values() for v in s.vehicles)
    tables = (published("table4_acceleration_vs_D"), published("table7_acceleration_vs_M"))
    printed = max(float(table.filter(like="peak").to_numpy().max()) for table in tables)
    yield Law(
        "8.2",
        f"All peak accelerations are below {LIMIT_ACCELERATION_G:g} g",
        f"largest {printed:.2f} g",
        f"largest {largest:.2f} g",
        largest < LIMIT_ACCELERATION_G,
        "EN 15227 limits the mean deceleration, which is smaller still",
    )
    stroke = max(i.stroke_mm for s in collisions.summaries.values() for i in s.interfaces if i.name != "S1-M1")
    yield Law(
        "8.2",
        f"Couplers behind the front stay below {LIMIT_OTHERS_MM:g} mm",
        "",
        f"largest {stroke:.0f} mm",
        stroke <= LIMIT_OTHERS_MM,
        "",
    )
    TS, TAMA = ours.front.values.T
    yield Law(
        "8.2",
        "On the front TAMA grows as TS falls",
        "",
        f"TS {TS.min():.0f} to {TS.max():.0f} mm against TAMA {TAMA.max():.3f} to {TAMA.min():.3f} g",
        bool((np.diff(TAMA[np.argsort(TS)]) < 0).all()),
        "every design of the front",
    )
    at = published("table13_optimum").iloc[0]
    optimum = collisions.summaries[float(at["D_mm"]), float(at["M_t"])]
    middle = collisions.summaries[35.0, 33.0]
    change = [100 * (getattr(optimum, c) / getattr(middle, c) - 1) for c in ("TS_mm", "TAMA_g")]
    yield Law(
        "9",
        "The optimum improves both criteria (against 35 mm, 33 t)",
        "significantly",
        f"TS {change[0]:+.2f} %, TAMA {change[1]:+.2f} %",
        max(change) < 0,
        "both smaller",
    )
