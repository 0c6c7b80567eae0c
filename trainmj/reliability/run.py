"""Collide trains as they are built within tolerances, and find how likely limits are passed."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from trainmj.cases.engine import Engine, Local
from trainmj.cases.load_cases import within
from trainmj.cases.origin import Origin
from trainmj.cases.rows import Rows, Values
from trainmj.cases.runner import fill, onwards
from trainmj.cases.store import KEY, Store
from trainmj.collision.cases import Cases, gathered
from trainmj.collision.limits import Criterion
from trainmj.collision.quantities import Column
from trainmj.collision.status import COARSE, FAILED
from trainmj.errors import InputError
from trainmj.files.folder import filling, remove_own, staged
from trainmj.output.style import ENDINGS, Format, Width, formats_given, save, styled
from trainmj.reliability.figures import FIGURES
from trainmj.reliability.found import Draws, ReliabilityResult
from trainmj.reliability.indices import indices_of
from trainmj.reliability.plan import Reliability, reliability_given
from trainmj.reliability.searches import Searches, check_limits
from trainmj.reliability.tables import TABLES
from trainmj.scenario import Scenario

FILE = "draws.sqlite"
SUMMARY = "summary.json"
_SEARCHES = "searches.sqlite"
_MADE = rf"(draws|{'|'.join(TABLES)})\.csv|({'|'.join(FIGURES)})\.{ENDINGS}|summary\.json|report\.html"
OWN = rf"(draws|searches)\.sqlite(-\w+)?|{_MADE}|draw_\d+(_\w+)?\.yaml"
"""The files of the folder, as a pattern of their names."""


def run_reliability(
    plan: Reliability | Scenario | str | Path,
    folder: str | Path,
    *,
    threads: int = 0,
    fresh: bool = False,
    engine: Engine | None = None,
    progress: Callable[[int], None] = lambda finished: None,
    figures: Sequence[Format] = ("png",),
    figure_width: Width = "page",
) -> ReliabilityResult:
    """Collide trains as they are built within tolerances, and find how likely limits are passed.

    Every collision is kept in the folder as it ends. Whatever stops the work, the same command goes on to the same
    files; more runs go on from those that are there.

    Args:
        plan: what is asked, the path of its file, or a scenario that states tolerances.
        folder: made if it is not there.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        fresh: start over: remove what this command left in the folder.
        engine: computes the collisions; by default this process.
        progress: called with the number of finished collisions.
        figures: formats of figures.
        figure_width: of figures.

    Raises:
        InputError: if the file breaks a rule, the train as designed cannot be collided, or the folder has the results
            of other input or other versions.
        OutputError: if something cannot be written, or another process writes there; finished collisions are kept.
    """
    began = time.monotonic()
    plan, formats = reliability_given(plan), formats_given(figures)
    first = next(iter(plan.scenarios.values()))
    engine = engine or Local(first, threads)
    with filling(folder, OWN, plan.files) as folder:
        if fresh:
            remove_own(folder, OWN)
        origin = Origin("reliability", first, plan.inputs, engine.identity)
        with Store(folder / FILE) as store, Store(folder / _SEARCHES, KEY) as searched:
            store.agree(origin)
            searched.agree(origin)
            designed, columns = _as_designed(plan, engine)
            check_limits(plan, designed)
            remove_own(folder, _MADE)
            computed = _fill(plan, store, engine, progress)
            draws = Draws(plan, store, designed, columns)
            passed, scattered = tuple(draws.passed()), tuple(draws.scattered())
            done = plan.spec.runs * len(plan.cases)
            searches = Searches(plan, searched, engine, designed, lambda n: progress(done + n))
            ended = draws.endings, draws.first_unusable, store.saying(COARSE)
            result = ReliabilityResult(plan, folder, passed, scattered, *ended, (), (), 0, 0.0, engine.identity)
            result = replace(
                result,
                searched=tuple(searches.search(passed)),
                indices=tuple(indices_of(searches, result.governing)),
                computed=computed + searches.computed,
                seconds=time.monotonic() - began,
            )
            with staged(folder, _MADE, SUMMARY) as stage:
                _write(result, store, stage, formats, figure_width)
            store.finish()
            searched.finish()
    return result


def scenario_of_draw(plan: Reliability | Scenario | str | Path, draw: int, case: str = "") -> Scenario:
    """The scenario of a draw in a load case: :func:`trainmj.run` has the same numbers of it to the bit.

    Args:
        plan: what is asked, the path of its file, or a scenario that states tolerances.
        draw: its number, from 0.
        case: load case; by default the first.

    Raises:
        InputError: if there is no such load case, or the draw was refused, with the reason.
    """
    plan = reliability_given(plan)
    case = case or plan.cases[0]
    if case not in plan.scenarios:
        raise InputError(f"case: there is no load case {case!r}: {', '.join(plan.cases) or 'the file states none'}")
    if draw < 0:
        raise InputError(f"draw {draw}: draws are numbered from 0")
    (changes,) = plan.scatter.cases(case, plan.draws(draw, 1))
    return plan.changed(case, changes)


def _as_designed(
    plan: Reliability, engine: Engine
) -> tuple[dict[str, tuple[Criterion, ...]], dict[str, Mapping[str, Column]]]:
    """The limits of each load case beside what the train as designed comes to, and the columns of its responses.

    Raises:
        InputError: if it cannot be collided.
    """
    limits: dict[str, tuple[Criterion, ...]] = {}
    columns: dict[str, Mapping[str, Column]] = {}
    for name, scenario in plan.scenarios.items():
        (designed,) = engine.of(scenario)(gathered([(0, {})]))
        row = designed.row(0)
        if row["status"] in FAILED:
            with within(name):
                raise InputError(f"the train as designed: {row['status']}: {row['reason']}")
        limits[name] = tuple(limited.of(0) for limited in designed.limits)
        columns[name] = designed.columns
    return limits, columns


def _fill(plan: Reliability, store: Store, engine: Engine, progress: Callable[[int], None]) -> int:
    """Collide every draw that the store lacks in every load case; return how many there were."""
    n, cases = plan.spec.runs, len(plan.cases)
    there = store.there(n * cases)
    before = int(there.sum())
    computed = 0
    for k, case in enumerate(plan.cases):
        missing = ~there[k::cases]
        if missing.any():
            at_work = engine.of(plan.scenarios[case], tuple(plan.responses(case, plan.patterns)))
            told = onwards(progress, before + computed)
            fill(store, at_work, _missing(plan, case, missing), _keeper(plan, case), told)
            computed += int(missing.sum())
    return computed


def _missing(plan: Reliability, case: str, missing: np.ndarray) -> Iterator[Cases]:
    """Every draw of a load case that is missing, some at a time."""
    k, cases = plan.cases.index(case), len(plan.cases)
    for first, z in plan.chunks():
        here = np.flatnonzero(missing[first : first + len(z)])
        if here.size:
            yield replace(plan.scatter.cases(case, z[here]), keys=((first + here) * cases + k).tolist())


def _keeper(plan: Reliability, case: str) -> Callable[[Rows], Rows]:
    """Gives what is kept of draws: their numbers, their status, what became of each limit, and the responses."""

    def keep(rows: Rows) -> Rows:
        facts: dict[str, Values] = {"draw": [key // len(plan.cases) for key in rows.keys]}
        facts |= {"load_case": [case] * len(rows)} if case else {}
        facts |= rows.facts
        for c in rows.limits:
            facts |= {f"{c.name} found": c.found, f"{c.name} at": c.where}
            facts |= {f"{c.name} used": c.used, f"{c.name} passed": 1 - c.kept}  # the limit itself may scatter
        return replace(rows, facts=facts)

    return keep


def _write(result: ReliabilityResult, store: Store, stage: Path, formats: Sequence[Format], width: Width) -> None:
    """Write tables, figures and the summary."""
    store.write_csv(stage / "draws.csv", result.collisions)
    for name, frame in TABLES.items():
        table = frame(result)
        if len(table):
            table.to_csv(stage / f"{name}.csv", index=False)
    for name, draw in FIGURES.items() if formats else ():
        with styled(width):
            picture = draw(result)
            if picture is not None:
                save(picture, stage / name, formats)
    (stage / SUMMARY).write_text(json.dumps(result.as_dict(), indent=2) + "\n", encoding="utf-8")
