"""Compute every collision that a standard asks of a train, and judge the train by them."""

from __future__ import annotations

from pathlib import Path

from trainmj.assessment.found import Assessment
from trainmj.assessment.outcome import Outcome
from trainmj.assessment.plan import Standard, cases_of, category_of, check_names, standard_given
from trainmj.collision.batch import run_chains
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.errors import InputError
from trainmj.scenario import Scenario, scenario_given


def assess(
    train: Scenario | str | Path,
    standard: Standard | str | Path,
    category: str | None = None,
    *,
    line_speed_km_h: float | None = None,
    threads: int = 0,
) -> Assessment:
    """Assess a train: every collision that a standard asks of it, computed as one batch and judged.

    Args:
        train: a scenario, or the path of its file; its moving train is assessed, with its own limits too.
        standard: an assessment, the path of its file, or the name of one that ships, such as ``en15227``.
        category: of the train, such as ``C-II``; None where the standard has none.
        line_speed_km_h: speed of the line on which it runs, if a speed of the standard follows from it.
        threads: native threads; 0 for all cores. The numbers do not depend on it.

    Returns:
        The assessment; each of its cases has the same numbers as a single run with its changes.

    Raises:
        InputError: if a file cannot be read or breaks a rule, or the standard does not have the category.
        TypeError: if the train or the standard is something else.
    """
    train, standard = scenario_given(train), standard_given(standard)
    category = category_of(standard, category)
    if line_speed_km_h is not None and not 0.0 < (line_speed_km_h := float(line_speed_km_h)) <= 500.0:
        raise InputError(f"line_speed_km_h = {line_speed_km_h:g}: must be above 0 and at most 500")
    line_up(train)  # what is wrong with the train as it stands
    cases = list(cases_of(standard, train, category, line_speed_km_h))
    check_names(standard, cases)
    if not cases:
        raise InputError(f"category: {standard.name} has no collision scenario for {category}")
    summaries = dict(run_chains(((n, case.chain) for n, case in enumerate(cases) if case.chain is not None), threads))
    outcomes = tuple(Outcome(case, summaries.get(n)) for n, case in enumerate(cases))
    return Assessment(train, standard, category, line_speed_km_h, outcomes, identity())
