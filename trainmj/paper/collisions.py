"""The collisions of the paper, computed: 17 of Tables 3 to 8, ten of Table 9, one of Table 13, two of Table 2."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.collision.summary import Summary, summarise
from trainmj.paper.printed import EMPTY_STROKE_MM, MASS_T, SERIES, published
from trainmj.scenario import Scenario, load

Case = tuple[float, float]
"""Empty stroke D [mm] and mass of every vehicle M [t]."""

SCENARIO = "b_type"
"""The shipped scenario that stands for the paper's train."""

BODY = {"trains.b_type.body": {"stiffness_kN_per_mm": 1000}}
"""Car bodies that stand for those of the paper's finite element model, whose stiffness it does not state.

At 1000 and at 1500 kN/mm every statement that it makes of that model comes out, but the one that momentum forbids.
"""

DOCUMENTED = "b_type_s08"
"""The same train with devices that unload as the law does that the paper names, LS-DYNA's S08, as it is documented."""


@dataclass(frozen=True, eq=False)
class Collisions:
    """What the paper's tables and figures need of our simulator."""

    summaries: Mapping[Case, Summary]  # of every case of Tables 3 to 9 and 13
    results: Mapping[Case, Result]  # with histories, of the 17 cases of Tables 3 to 8
    documented: Mapping[Case, Summary]  # of every case of Tables 3 to 9 and 13, with S08 as documented
    scenarios: tuple[Result, ...]  # with histories, of the two scenarios of Table 2
    elastic: tuple[Result, ...]  # the same with bodies that give

    def over(self, factor: str) -> list[tuple[Result, Summary]]:
        """The nine collisions over the empty stroke, "D", as in Figures 5 and 6, or the mass, "M", as in 7 and 8."""
        return [(self.results[case], self.summaries[case]) for case in _cases_over(factor)]


def cases_of(table: pd.DataFrame) -> list[Case]:
    """The case of each row of a table over D, M or both."""
    D = table.get("D_mm", [EMPTY_STROKE_MM] * len(table))
    M = table.get("M_t", [MASS_T] * len(table))
    return [(float(d), float(m)) for d, m in zip(D, M, strict=True)]


def _cases_over(factor: str) -> list[Case]:
    return cases_of(published(SERIES[factor].tables[0]))


def one_factor_cases() -> list[Case]:
    """The 17 cases of Tables 3 to 8; the one that both series share (35 mm, 33 t) comes once."""
    return list(dict.fromkeys(case for factor in SERIES for case in _cases_over(factor)))


def all_cases() -> list[Case]:
    """The 28 cases of Tables 3 to 9 and 13."""
    return list(dict.fromkeys([*one_factor_cases(), *cases_of(published("9")), *cases_of(published("13"))]))


def collide(threads: int = 0) -> Collisions:
    """Compute the paper's collisions on the shipped scenarios, with 0 threads on all cores."""
    standard = load(SCENARIO)
    results = {case: run(_scenario(standard, case)) for case in one_factor_cases()}
    two = [load(f"{SCENARIO}_scenario_{n}") for n in published("2")["scenario"]]
    scenarios, elastic = tuple(map(run, two)), tuple(run(scenario.with_values(BODY)) for scenario in two)
    summaries = {case: summarise(result) for case, result in results.items()}
    summaries |= simulate([case for case in all_cases() if case not in summaries], threads)
    documented = simulate(all_cases(), threads, DOCUMENTED)
    return Collisions(summaries, results, documented, scenarios, elastic)


def simulate(cases: Iterable[Case], threads: int = 0, scenario: str = SCENARIO) -> dict[Case, Summary]:
    """Compute cases of a shipped scenario side by side, without histories."""
    standard = load(scenario)
    chains = {case: line_up(_scenario(standard, case)) for case in cases}
    return dict(run_chains(chains.items(), threads))


def _scenario(standard: Scenario, case: Case) -> Scenario:
    return standard.with_values({"empty_stroke_mm": case[0], "mass_t": case[1]})
