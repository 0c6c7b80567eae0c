"""Collide trains as they are built within tolerances, and find how likely limits are passed."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.cases.engine import Case, Computed, Engine, Local, Row
from trainmj.cases.load_cases import within
from trainmj.cases.origin import Origin
from trainmj.cases.runner import fill, onwards
from trainmj.cases.store import CASE, KEY, Store
from trainmj.cases.table import STATUS
from trainmj.collision.limits import Criterion
from trainmj.collision.quantities import Column
from trainmj.collision.status import FAILED
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
            result = ReliabilityResult(
                plan, folder, passed, scattered, draws.endings, draws.first_unusable, (), (), 0, 0.0, engine.identity
            )
            result = replace(
                result,
                searched=tuple(searches.search(passed)),
                indices=tuple(indices_of(searches, result.governing)),
                computed=computed + searches.computed,
                seconds=time.monotonic() - began,
            )
            with staged(folder, _MADE, SUMMARY) as stage:
                _write(result, store, stage, formats, figure_width)
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
        (designed,) = engine.of(scenario)([(0, {})])
        if designed.row["status"] in FAILED:
            with within(name):
                raise InputError(f"the train as designed: {designed.row['status']}: {designed.row['reason']}")
        limits[name], columns[name] = designed.limits, designed.columns
    return limits, columns


def _fill(plan: Reliability, store: Store, engine: Engine, progress: Callable[[int], None]) -> int:
    """Collide every draw that the store lacks in every load case; return how many there were."""
    n, cases = plan.spec.runs, len(plan.cases)
    there = np.zeros(n * cases, dtype=bool)
    there[np.fromiter(store.column(CASE, n * cases), dtype=np.int64)] = True
    before = int(there.sum())
    computed = 0
    for k, case in enumerate(plan.cases):
        missing = ~there[k::cases]
        if missing.any():
            wanted = plan.responses(case, plan.patterns)
            fill(
                store,
                engine.of(plan.scenarios[case]),
                _missing(plan, case, missing),
                _keeper(plan, case, list(wanted)),
                onwards(progress, before + computed),
            )
            computed += int(missing.sum())
    return computed


def _missing(plan: Reliability, case: str, missing: np.ndarray) -> Iterator[tuple[int, Case]]:
    """Key and changes of every draw of a load case that is missing."""
    k, cases = plan.cases.index(case), len(plan.cases)
    for first, z in plan.chunks():
        here = np.flatnonzero(missing[first : first + len(z)])
        for row, changes in zip(here.tolist(), plan.scatter.cases(case, z[here]) if here.size else (), strict=True):
            yield (first + row) * cases + k, changes


def _keeper(plan: Reliability, case: str, wanted: Sequence[str]) -> Callable[[Computed], Row]:
    """Gives what is kept of a draw: its number, its status, what became of each limit, and the responses wanted."""

    def keep(computed: Computed) -> Row:
        row: dict[str, Any] = {"draw": computed.key // len(plan.cases)} | ({"load_case": case} if case else {})
        row |= {name: computed.row[name] for name in STATUS}
        for c in computed.limits:
            row |= {f"{c.name} found": c.found, f"{c.name} at": c.where}
            row |= {f"{c.name} used": c.used, f"{c.name} passed": int(not c.kept)}  # the limit itself may scatter
        return row | {name: computed.row[name] for name in wanted if name in computed.row}

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
