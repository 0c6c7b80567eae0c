"""Run a sweep: compute what is not yet in its file, keep every case as it ends."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trainmj.cases.store import CASE, FILE, Store
from trainmj.cases.table import FAILED, REFUSED, Engine, Row, case_rows, chosen, ordered
from trainmj.collision.identity import identity
from trainmj.collision.simulation import run
from trainmj.errors import InputError
from trainmj.files.folder import held
from trainmj.scenario import to_yaml
from trainmj.sweep.plan import Plan

COMMIT_EVERY = 0.5
"""Longest time that finished cases wait to be written [s]."""

_MOST_WAITING = 500  # cases written in one transaction

_MAY_CHANGE = ("version_python", "version_platform")  # the nodes of a cluster may differ


@dataclass(frozen=True)
class Outcome:
    """What a sweep did.

    Attributes:
        folder: where its files are.
        cases: how many the plan has.
        computed: how many were computed now; the others were there.
        failed: how many of all are refused or unstable.
        first_failure: number, status and reason of the first of these; empty if there is none.
        seconds: wall time.
    """

    folder: Path
    cases: int
    computed: int
    failed: int
    first_failure: str
    seconds: float


def run_sweep(
    plan: Plan,
    folder: str | Path,
    threads: int = 0,
    resume: bool = False,
    engine: Engine | None = None,
    progress: Callable[[int], None] = lambda finished: None,
) -> Outcome:
    """Compute the cases of a plan and keep them in a folder.

    The folder gets results.sqlite, written as cases end, and at the end results.csv and the histories asked for.
    Whatever stops a sweep, what is in the file stays; with resume the rest is computed and the table is the same.

    Args:
        plan: scenario and cases.
        folder: made if it is not there.
        threads: native threads; 0 for all cores.
        resume: go on with the sweep in the folder; without one there, begin.
        engine: computes the cases; by default this process.
        progress: called with the number of finished cases of all.

    Raises:
        InputError: if a sweep is there and resume is not asked for, or it is another one.
        OutputError: if the folder or file cannot be written, or another process writes there; what was finished is
            kept.
    """
    began = time.monotonic()
    with held(folder) as folder:
        if (folder / FILE).exists() and not resume:
            raise InputError(f"{folder}: has a sweep already: go on with --resume, or take another folder")
        with Store(folder / FILE) as store:
            _agree(store, plan)
            finished = store.finished()
            progress(len(finished))
            compute = engine or (lambda cases: case_rows(plan.scenario, cases, threads))
            _compute(plan, store, compute(plan.cases(left_out=finished)), len(finished), progress)
            store.arrange([*plan.names, *ordered(set(store.columns()) - {CASE, *plan.names})])
            store.write_csv(folder / "results.csv")
            failed = _failures(store)
        write_histories(plan, folder)
        computed, seconds = len(plan) - len(finished), time.monotonic() - began
        return Outcome(folder, len(plan), computed, len(failed), next(iter(failed), ""), seconds)


def _failures(store: Store) -> list[str]:
    """What is said of each case of a finished sweep that could not be computed."""
    ends = zip(store.column("status"), store.column("reason"), strict=True)
    return [f"case {n}, {status}: {reason}" for n, (status, reason) in enumerate(ends) if status in FAILED]


def _compute(
    plan: Plan, store: Store, rows: Iterator[tuple[int, Row]], finished: int, progress: Callable[[int], None]
) -> None:
    """Take rows as they come and write them in transactions, also when something stops the work."""
    waiting: list[tuple[int, dict[str, Any]]] = []
    written = time.monotonic()
    keep: dict[tuple[str, ...], list[str]] = {}
    try:
        for number, row in rows:
            names = tuple(row)
            if names not in keep:
                keep[names] = list(names) if row["status"] == REFUSED else chosen(names, plan.responses)
            waiting.append((number, plan.case(number) | {name: row[name] for name in keep[names]}))
            finished += 1
            if len(waiting) == _MOST_WAITING or time.monotonic() - written > COMMIT_EVERY:
                batch, waiting = waiting, []
                store.add(batch)
                written = time.monotonic()
                progress(finished)
    except KeyboardInterrupt:
        if waiting:
            store.add(waiting)
        raise
    if waiting:
        store.add(waiting)
    progress(finished)


def _agree(store: Store, plan: Plan) -> None:
    """See that the sweep in the file is this one; write what it is if the file is new."""
    mine = {
        "format": "trainmj sweep 1",
        "fingerprint": plan.fingerprint,
        "scenario": to_yaml(plan.scenario),
        "cases": str(len(plan)),
        "varied": json.dumps(plan.names),
        "seed": json.dumps(plan.seed),
        **{f"version_{name}": version for name, version in identity().items()},
    }
    there = store.about()
    if not there:
        store.describe(mine)
        return
    changed = [key for key in mine if key not in _MAY_CHANGE and there.get(key) != mine[key]]
    if not changed:
        return
    cure = "run it as it was, or take another folder"
    for key, what in (("scenario", "the scenario has changed"), ("fingerprint", "the cases or responses have changed")):
        if key in changed:
            raise InputError(f"{store.file}: {what} since this sweep began: {cure}")
    key = changed[0]
    raise InputError(f"{store.file}: {key} was {there.get(key)} when this sweep began and is {mine[key]} now: {cure}")


def write_histories(plan: Plan, folder: Path) -> None:
    """Compute the cases whose histories are wanted once more and save them as case_NUMBER.nc, unless refused."""
    for number in plan.histories:
        file = folder / f"case_{number}.nc"
        if file.exists():
            continue
        try:
            result = run(plan.scenario.with_values(plan.case(number)))
        except InputError:
            continue  # its row says why
        result.save(file)
