"""Why the paper's strokes scatter over the empty stroke D: what a law leaves of the scatter, and for which stiffness.

The scatter of a series is what a straight line in D leaves of it. What a law explains of it is seen in the differences
of paper and law: what a straight line in D leaves of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.polynomial import Polynomial

from trainmj.collision.batch import run_chains
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.kind import Law
from trainmj.collision.law.crush import law_of
from trainmj.collision.lineup import line_up
from trainmj.collision.summary import Summary
from trainmj.paper.collisions import DOCUMENTED, SCENARIO, Case, cases_of, simulate
from trainmj.paper.printed import EMPTY_STROKE_MM, MASS_T, STROKES, numbers, published, rms
from trainmj.paper.tables import OURS, S08, Comparison, Tables, strokes_of
from trainmj.scenario import load
from trainmj.units import KN_PER_MM, MS

PRINTED = "published"
OVER_D, HELD_OUT, OVER_M = "Table 3", "Table 9, D = 23, 47 mm", "Table 6"
"""Whose strokes: those over D at 33 t; the two more of Table 9 at 33 t, about the lines of Table 3; those over M."""

FINE_MM = 0.5
"""From one empty stroke to the next in the picture, in which a period of the ring must show."""

STIFFNESSES = np.union1d(np.geomspace(1e3, 4e5, 41), np.arange(38e3, 56e3, 1e3))
"""Unloading stiffnesses that are tried [kN/mm]."""

_STEP = {"simulation.step_ms": 0.1, "simulation.averaging_ms": None}
"""Fine enough to tell the stiffnesses apart: it moves the misfit of the best one by 0.002."""


@dataclass(frozen=True, eq=False)
class Scatter:
    """The scatter of S_anti, S12, S23, and what the laws leave of it."""

    left: pd.DataFrame  # rms [mm] by series and by whose: PRINTED, OURS, S08; heads of the strokes
    fine: pd.DataFrame  # by S08, over D in steps of FINE_MM
    misfit: pd.DataFrame  # by S08 with other stiffnesses: mean of the squares of what is left over the paper's scatter
    steps: Mapping[str, int]  # that a collision at 33 t and 35 mm takes, by law

    @property
    def best(self) -> tuple[float, float]:
        """Stiffness [kN/mm] with the smallest misfit, and that misfit."""
        K, misfit = self.misfit.iloc[self.misfit["misfit"].argmin()]
        return float(K), float(misfit)


def scatter(tables: Tables, laws: Mapping[str, Mapping[Case, Summary]], threads: int = 0) -> Scatter:
    """What the laws leave of the scatter, from their collisions and these beside the paper, and more with S08."""
    D = np.arange(20, 50 + FINE_MM / 2, FINE_MM)
    found = simulate([(float(d), MASS_T) for d in D], threads, DOCUMENTED)
    fine = pd.DataFrame([{"D_mm": case[0], **strokes_of(found[case])} for case in sorted(found)])
    steps = {}
    for source, scenario in ((OURS, SCENARIO), (S08, DOCUMENTED)):
        duration = laws[source][EMPTY_STROKE_MM, MASS_T].duration_s
        steps[source] = round(duration / (load(scenario).simulation.step_ms * MS))
    return Scatter(_left(tables), fine, misfit_over_stiffness(threads, STIFFNESSES), steps)


def _left(tables: Tables) -> pd.DataFrame:
    """What lines over D, and parabolas over M, leave of the printed strokes and of their differences from each law."""
    three, six, nine = (tables[number] for number in ("3", "6", "9"))
    D, more, M = (numbers(table.keys, head) for table, head in ((three, "D_mm"), (nine, "D_mm"), (six, "M_t")))
    same = numbers(nine.keys, "M_t") == MASS_T
    rows: list[dict[str, str | float]] = []

    def off(table: Comparison, head: str, source: str) -> Array:
        return numbers(table.published, head) if source == PRINTED else table.deviation(head, source)

    fits = {
        (power, source, head): Polynomial.fit(x, off(table, head, source), power)
        for power, x, table in ((1, D, three), (2, M, six))
        for source in (PRINTED, OURS, S08)
        for head in STROKES
    }
    for series, power, table, x, of_series in (
        (OVER_D, 1, three, D, slice(None)),
        (HELD_OUT, 1, nine, more, same),
        (OVER_M, 2, six, M, slice(None)),
    ):
        for source in (PRINTED, OURS, S08):
            left = {h: rms((off(table, h, source) - fits[power, source, h](x))[of_series]) for h in STROKES}
            rows.append({"series": series, "of": source, **left})
    return pd.DataFrame(rows)


def about_line(x: Array, values: Array) -> Array:
    """What the straight line that fits (n,) values best leaves of them."""
    return np.asarray(values - Polynomial.fit(x, values, 1)(x))


def misfit_over_stiffness(threads: int, stiffnesses: Array) -> pd.DataFrame:
    """The misfit of S08 over Table 3's strokes with one stiffness K [kN/mm] or another in all devices.

    It is the mean over S_anti, S12, S23 of the square of what is left over that of the paper's scatter: 1 explains
    nothing, 0 everything.
    """
    three = published("3")
    D = numbers(three, "D_mm")
    scenario = load(DOCUMENTED, _STEP)
    chains = {case: line_up(scenario.with_values({"empty_stroke_mm": case[0]})) for case in cases_of(three)}
    keyed = (((K, case), _unloading(chain, K)) for K in stiffnesses.tolist() for case, chain in chains.items())
    found = dict(run_chains(keyed, threads))
    printed = {head: numbers(three, head) for head in STROKES}
    misfits = []
    for K in stiffnesses.tolist():
        ours = pd.DataFrame([strokes_of(found[K, case]) for case in chains])
        shares = [rms(about_line(D, y - numbers(ours, h))) / rms(about_line(D, y)) for h, y in printed.items()]
        misfits.append(float(np.mean(np.square(shares))))
    return pd.DataFrame({"K_kN_per_mm": stiffnesses, "misfit": misfits})


def _unloading(chain: Chain, stiffness: float) -> Chain:
    """A chain of crushing devices that all unload along a stiffness [kN/mm], beyond what a scenario may state too."""

    def stiffer(law: Law) -> Law:
        return law_of(replace(law.loading, stiffness=stiffness * KN_PER_MM), law.end)

    interfaces = (
        replace(i, elements=tuple(replace(e, laws=tuple(map(stiffer, e.laws))) for e in i.elements))
        for i in chain.interfaces
    )
    return replace(chain, interfaces=tuple(interfaces))
