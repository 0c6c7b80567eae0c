"""The collisions of the paper, computed: 17 of Tables 3 to 8, ten of Table 9, one of Table 13, two of Table 2."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.collision.summary import Summary, summarise
from trainmj.paper.printed import EMPTY_STROKE_MM, MASS_T, published
from trainmj.scenario import Scenario, load

if TYPE_CHECKING:
    import pandas as pd

Case = tuple[float, float]
"""Empty stroke D [mm] and mass of every vehicle M [t]."""

SCENARIO = "b_type"
"""The shipped scenario that stands for the paper's train."""

SERIES = {"D": "table3_devices_vs_D", "M": "table6_devices_vs_M"}
"""The published table whose rows are the cases over each factor."""


@dataclass(frozen=True, eq=False)
class Collisions:
    """What the paper's tables and figures need of our simulator.

    Attributes:
        summaries: of every case of Tables 3 to 9 and 13.
        results: with histories, of the 17 cases of Tables 3 to 8.
        scenarios: with histories, of the two scenarios of Table 2.
    """

    summaries: Mapping[Case, Summary]
    results: Mapping[Case, Result]
    scenarios: tuple[Result, ...]

    def over(self, factor: str) -> list[tuple[Result, Summary]]:
        """The nine collisions over the empty stroke, "D", as in Figures 5 and 6, or the mass, "M", as in 7 and 8."""
        return [(self.results[case], self.summaries[case]) for case in cases_of(published(SERIES[factor]))]


def cases_of(table: pd.DataFrame) -> list[Case]:
    """The case of each row of a table over D, M or both."""
    D = table.get("D_mm", [EMPTY_STROKE_MM] * len(table))
    M = table.get("M_t", [MASS_T] * len(table))
    return [(float(d), float(m)) for d, m in zip(D, M, strict=True)]


def one_factor_cases() -> list[Case]:
    """The 17 cases of Tables 3 to 8; the one that both series share (35 mm, 33 t) comes once."""
    return list(dict.fromkeys(case for name in SERIES.values() for case in cases_of(published(name))))


def all_cases() -> list[Case]:
    """The 28 cases of Tables 3 to 9 and 13."""
    others = cases_of(published("table9_doe_responses")) + cases_of(published("table13_optimum"))
    return list(dict.fromkeys(one_factor_cases() + others))


def collide(threads: int = 0) -> Collisions:
    """Compute the paper's collisions on the shipped scenarios.

    Args:
        threads: native threads for the cases without histories; 0 for all cores.
    """
    standard = load(SCENARIO)
    results = {case: run(_scenario(standard, case)) for case in one_factor_cases()}
    scenarios = tuple(run(load(f"{SCENARIO}_scenario_{n}")) for n in published("table2_scenarios")["scenario"])
    summaries = {case: summarise(result) for case, result in results.items()}
    summaries |= simulate([case for case in all_cases() if case not in summaries], threads)
    return Collisions(summaries, results, scenarios)


def simulate(cases: Iterable[Case], threads: int = 0) -> dict[Case, Summary]:
    """Compute cases side by side, without histories."""
    standard = load(SCENARIO)
    chains = {case: line_up(_scenario(standard, case)) for case in cases}
    return dict(run_chains(chains.items(), threads))


def _scenario(standard: Scenario, case: Case) -> Scenario:
    return standard.with_values({"empty_stroke_mm": case[0], "mass_t": case[1]})
