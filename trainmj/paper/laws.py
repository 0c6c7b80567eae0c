"""The laws that the paper states in words, checked on our results: those of Sections 3.2, 7 and 8."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trainmj.collision.result import Result
from trainmj.collision.summary import summarise
from trainmj.paper.analysis import Analysis
from trainmj.paper.collisions import Collisions, cases_of
from trainmj.paper.finding import Law
from trainmj.paper.laws_of_bodies import laws_of_bodies
from trainmj.paper.laws_of_factors import laws_of_D, laws_of_M
from trainmj.paper.printed import (
    EMPTY_STROKE_MM,
    LIMIT_ACCELERATION_G,
    LIMIT_OTHERS_MM,
    MASS_T,
    PEAKS,
    STRONG,
    published,
)
from trainmj.paper.tables import OURS, Comparison, Tables
from trainmj.units import KM_H, against


def laws(collisions: Collisions, tables: Tables, ours: Analysis) -> Iterator[Law]:
    """All of them, in the order of the paper."""
    for number, (rigid, elastic) in enumerate(zip(collisions.scenarios, collisions.elastic, strict=True), start=1):
        yield from laws_of_validation(rigid, f"3.2, scenario {number}")
        yield from laws_of_bodies(rigid, elastic, f"3.2, scenario {number}")
    yield from laws_of_D(collisions, tables)
    yield from laws_of_M(collisions, tables)
    yield from laws_of_correlation(tables["10"])
    yield from laws_of_optimisation(collisions, ours)


def laws_of_validation(result: Result, section: str) -> Iterator[Law]:
    """Section 3.2, for one scenario of Table 2."""
    summary, n = summarise(result), result.chain.n_moving
    balance, interfaces = summary.balance, summary.interfaces
    error = abs(balance.energy_error)
    rule = "below 0.001 of the initial kinetic energy"
    yield Law(section, "The total energy keeps the same", f"off by {error:.1e}", error < 1e-3, rule)
    half = (balance.absorbed_kJ + balance.elastic_kJ) / balance.kinetic_start_kJ
    said = "The internal energy is finally about half of the initial kinetic energy"
    yield Law(section, said, f"{half:.4f}", abs(half - 0.5) < 0.01, "0.5 within 0.01", published="0.5")
    front = interfaces[0].stroke_mm * 2
    moving, standing = ([i.stroke_mm for i in side] for side in (interfaces[1:n], interfaces[n:]))
    off = max(abs(a - b) for a, b in zip(moving, standing, strict=True))
    rule = "below 1 % of the largest stroke; rail friction brakes the moving train alone at first"
    said = "Strokes are symmetrical about S1-M1"
    yield Law(section, said, f"differ by at most {off:.2f} mm", off < 0.01 * front, rule)
    found = f"{front:.0f} mm, the next {moving[0]:.0f} mm"
    yield Law(section, "S1-M1 has the largest stroke", found, front > max(moving + standing))
    said = "Strokes gradually decrease from S1-M1 towards the ends"
    found = ", ".join(f"{s:.0f}" for s in [front, *moving]) + " mm"
    decrease = bool((np.diff([front, *moving]) < 0).all())
    yield Law(section, said, found, decrease, "every stroke smaller than the one before it")
    share = sum(i.energy_kJ for i in interfaces[:3]) / sum(i.energy_kJ for i in interfaces[:n])
    said = "The first three interfaces absorb most of the energy"
    yield Law(section, said, f"{100 * share:.1f} % of the train's", share > 0.9, "above 90 %")
    final = float(np.mean([v.final_speed_km_h for v in summary.vehicles])) / (float(result.chain.speed[0]) / KM_H)
    rule = "0.5 within 0.05; rail friction takes the rest"
    said = "The final speed is about half of the initial one"
    yield Law(section, said, f"{final:.3f}", abs(final - 0.5) < 0.05, rule, published="0.5")


def laws_of_correlation(table: Comparison) -> Iterator[Law]:
    """Section 7: signs and strength of the correlations on our ten responses."""
    heads = table.heads
    for row, factor in enumerate(table.keys["parameter"]):
        printed, ours = table.published.iloc[row], table.found[OURS].iloc[row]
        wrong = [h for h in heads if np.sign(printed[h]) != np.sign(ours[h])]
        said = f"Signs of {factor}'s correlations with the seven responses"
        differing = "".join(f"; {h} {ours[h]:+.2f} for {printed[h]:+.2f}" for h in wrong)
        found = f"{len(heads) - len(wrong)} the same{differing}"
        yield Law("7", said, found, not wrong, "all signs the same", published=f"{len(heads)} signs")
        expected, strong = ([h for h in heads if abs(r[h]) >= STRONG] for r in (printed, ours))
        names = [", ".join(some) if len(some) < len(heads) else "all" for some in (expected, strong)]
        said = f"Responses strongly correlated with {factor}"
        rule = f"|r| of {STRONG:g} or more is strong"
        yield Law("7", said, names[1], strong == expected, rule, published=names[0])


def laws_of_optimisation(collisions: Collisions, ours: Analysis) -> Iterator[Law]:
    """Section 8: limits, the shape of the front, and what the optimum gains."""
    summaries = collisions.summaries
    largest = max(v.peak_device_acceleration_g for s in summaries.values() for v in s.vehicles)
    printed = max(float(published(table)[list(PEAKS)].to_numpy().max()) for table in "47")
    yield Law(
        "8.2",
        f"All peak accelerations are below {LIMIT_ACCELERATION_G:g} g",
        f"largest {against(largest, LIMIT_ACCELERATION_G, 2)} g",
        largest < LIMIT_ACCELERATION_G,
        "EN 15227 limits the mean deceleration, which is smaller still",
        published=f"largest {printed:.2f} g",
    )
    stroke = max(i.stroke_mm for s in summaries.values() for i in s.interfaces if i.name != "S1-M1")
    said = f"Couplers behind the front stay below {LIMIT_OTHERS_MM:g} mm"
    yield Law("8.2", said, f"largest {against(stroke, LIMIT_OTHERS_MM, 0)} mm", stroke <= LIMIT_OTHERS_MM)
    TS, TAMA = ours.front.values.T
    found = f"TS {TS.min():.0f} to {TS.max():.0f} mm against TAMA {TAMA.max():.3f} to {TAMA.min():.3f} g"
    falls = bool((np.diff(TAMA[np.argsort(TS)]) < 0).all())
    yield Law("8.2", "On the front TAMA grows as TS falls", found, falls, "every design of the front")
    optimum, middle = summaries[cases_of(published("13"))[0]], summaries[EMPTY_STROKE_MM, MASS_T]
    change = [100 * (getattr(optimum, c) / getattr(middle, c) - 1) for c in ("TS_mm", "TAMA_g")]
    said = "The optimum improves both criteria (against 35 mm, 33 t)"
    found = f"TS {change[0]:+.2f} %, TAMA {change[1]:+.2f} %"
    yield Law("9", said, found, max(change) < 0, "both smaller", published="significantly")
