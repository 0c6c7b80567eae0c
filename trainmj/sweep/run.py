"""Run a sweep: compute what is not yet in its store, and keep every case as it ends."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.cases.engine import Engine, Local
from trainmj.cases.origin import Origin, stated
from trainmj.cases.reader import read_about, read_sweep, read_table
from trainmj.cases.rows import STATUS, Rows
from trainmj.cases.runner import fill, onwards
from trainmj.cases.store import FILE, Store
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import Column, columns_of, fitting, matching, no_number
from trainmj.collision.saved import load_result
from trainmj.collision.simulation import run
from trainmj.collision.status import COARSE, FAILED, NOT_VALID, PAST_LIMITS, UNUSABLE, Kind
from trainmj.errors import InputError
from trainmj.files.arguments import given
from trainmj.files.folder import filling, own_files, remove_own
from trainmj.files.shown import Shown
from trainmj.files.written import remove
from trainmj.output.table import Verdict
from trainmj.scenario import Scenario, to_yaml
from trainmj.sweep.outcome import Outcome, first_of, outcome_of, says_use, verdict, with_uses
from trainmj.sweep.plan import LOAD_CASES, Sweep, load_sweep

if TYPE_CHECKING:
    import pandas as pd

_MADE_OF_IT = r"results\.(csv|parquet)|report\.html"
OWN = rf"results\.sqlite(-\w+)?|{_MADE_OF_IT}|case_\d+\.(nc|html)"
"""The files of the folder, as a pattern of their names."""

_HISTORIES = "histories"
_MOST_LOOKED_AT = 1000  # cases, for a response that those before do not have


@dataclass(frozen=True)
class SweepResult(Shown):
    """What a sweep did.

    Attributes:
        folder: where its files are.
        cases: how many the sweep has.
        computed: how many were computed now; the others were there.
        failed: how many of all are refused or unstable.
        first_failure: number, status and reason of the first of these; empty if there is none.
        not_valid: how many of all have numbers that are not valid: a curve ended, or one vehicle overrode another.
        first_not_valid: likewise.
        past_limits: how many of all passed a limit, with valid numbers.
        first_past_limits: likewise.
        verdict: how the cases ended, in one sentence.
        seconds: wall time [s].
        outcome: of each load case, and which of them governs; None if the sweep has none.
        coarse: how many of all say that their step is coarse for their peaks.
    """

    folder: Path
    cases: int
    computed: int
    failed: int
    first_failure: str
    not_valid: int
    first_not_valid: str
    past_limits: int
    first_past_limits: str
    verdict: Verdict
    seconds: float
    outcome: Outcome | None = None
    coarse: int = 0

    def __repr__(self) -> str:
        """How the cases ended, and where they are."""
        return f"<SweepResult {self.verdict.text} In {self.folder}>"

    @property
    def all_kept(self) -> bool:
        """Whether every case has usable numbers and passed no limit."""
        return not (self.failed or self.not_valid or self.past_limits)

    def to_frame(self) -> pd.DataFrame:
        """A row for each case: its values, status, reason and responses, as :func:`trainmj.read_table` reads it."""
        return read_table(self.folder)


def run_sweep(
    sweep: Sweep | str | Path,
    folder: str | Path,
    *,
    threads: int = 0,
    fresh: bool = False,
    engine: Engine | None = None,
    progress: Callable[[int], None] = lambda finished: None,
) -> SweepResult:
    """Compute the cases of a sweep and keep them in a folder.

    The folder gets results.sqlite, written as cases end, and at the end results.csv and the histories asked for.
    Whatever stops a sweep, finished cases are kept; the same sweep goes on from there to the same table.

    Args:
        sweep: a sweep, or a sweep file.
        folder: made if it is not there.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        fresh: start over: remove what a sweep left in the folder.
        engine: computes the cases; by default this process.
        progress: called with the number of finished cases.

    Raises:
        InputError: if the file breaks a rule, or the folder has the results of another sweep or of other versions; the
            message says what differs.
        OutputError: if something cannot be written, or another process writes there; finished cases are kept.
    """
    began = time.monotonic()
    sweep = given(sweep, Sweep, load_sweep)
    engine = engine or Local(sweep.scenario, threads)
    check_responses(sweep)
    with filling(folder, OWN, sweep.files) as folder:
        file = folder / FILE
        if fresh:
            ours = {_history(number).stem for number in {*sweep.histories, *_histories_in(read_about(file))}}
            others = {found.name for found in own_files(folder, r"case_.*") if found.stem not in ours}
            remove_own(folder, OWN, kept=others)
        with Store(file) as store:
            store.agree(Origin("sweep", sweep.load_cases or sweep.scenario, sweep.inputs, engine.identity))
            histories = {*sweep.histories, *_there(sweep, folder)}
            store.describe(_further(sweep, histories | _histories_in(store.about())))
            finished = store.there(len(sweep))
            progress(there := int(finished.sum()))
            if there < len(sweep):
                remove_own(folder, _MADE_OF_IT)  # of fewer cases than there will be
                store.prepare(sweep.case(0) | dict.fromkeys(STATUS, ""))
            for scenario, cases in sweep.by_scenario(finished):
                at_work = engine.of(scenario, sweep.responses)
                fill(store, at_work, cases, _keeper(sweep), onwards(progress, len(store)))
            if there < len(sweep):
                remove_own(folder, _MADE_OF_IT)  # made while it ran
            store.write_csv(folder / "results.csv")
            endings = store.endings()
            failed, invalid, past = (_said(endings, kinds) for kinds in (FAILED, NOT_VALID, PAST_LIMITS))
            _, first = _said(endings, (*UNUSABLE, *PAST_LIMITS))
            coarse = store.saying(COARSE)
            store.finish()
        _write_histories(sweep, histories, folder)
    seconds = time.monotonic() - began
    titles = _titles(sweep)
    outcome = outcome_of(read_sweep(folder, says_use)[0], titles, len(sweep)) if titles else None
    whole = verdict({kind: count for kind, (count, *_) in endings.items()}, len(sweep), first, outcome)
    return SweepResult(
        folder, len(sweep), len(sweep) - there, *failed, *invalid, *past, whole, seconds, outcome, coarse
    )


def _said(endings: Mapping[str, tuple[int, int, str]], kinds: Sequence[Kind]) -> tuple[int, str]:
    """How many cases ended in one of these ways, and the first of them in words."""
    found = [(number, kind, reason) for kind in kinds if kind in endings for _, number, reason in [endings[kind]]]
    return sum(endings[kind][0] for _, kind, _ in found), first_of(sorted(found))


def check_responses(sweep: Sweep) -> None:
    """Refuse a response that no case has, or that is a number in none, before anything is computed.

    Of each load case those are looked at that differ from its first one by the row of one block; a thousand at most.

    Raises:
        InputError: naming the response.
    """
    missing = {pattern: "" for pattern in sweep.responses if pattern not in STATUS}  # and why it is no number
    columns: dict[str, Column] = {}
    for number in islice(_looked_at(sweep), _MOST_LOOKED_AT):
        try:
            chain = line_up(sweep.scenario_of(number))
        except InputError:
            continue  # the case is refused; its row will say why
        there = columns_of(chain)
        columns |= there
        for pattern in list(missing):
            reasons = [no_number(column, chain) for column in fitting([pattern], there).values()]
            if reasons and not all(reasons):
                del missing[pattern]
            elif reasons:
                missing[pattern] = reasons[0]
        if not missing:
            return
    if columns:  # otherwise all of them are refused
        matching(missing, columns)
        raise InputError(f"responses: {next(filter(None, missing.values()))}")


def _looked_at(sweep: Sweep) -> Iterator[int]:
    """Numbers of cases of each load case: its first one, and those that differ from it by the row of one block."""
    each = len(sweep) // len(sweep.scenarios)
    firsts = range(0, len(sweep), each)
    yield from firsts
    apart = each
    for block in sweep.blocks:
        rows = len(next(iter(block.values())))
        apart //= rows
        yield from (first + row * apart for row in range(1, rows) for first in firsts)


def _further(sweep: Sweep, histories: Iterable[int]) -> dict[str, str]:
    """What the store says of a sweep for those who read it, and of the files that it leaves beside the store."""
    said: dict[str, Any] = {"cases": len(sweep), "varied": [name for block in sweep.crossed for name in block]}
    said |= {"seed": sweep.seed, _HISTORIES: sorted(histories), LOAD_CASES: _titles(sweep)}
    return {name: json.dumps(value) for name, value in said.items()}


def _titles(sweep: Sweep) -> dict[str, str]:
    """What load cases are, in words, by their names."""
    return {name: sweep.titles.get(name, "") for name in sweep.load_cases}


def _histories_in(about: Mapping[str, str]) -> set[int]:
    """Numbers of the cases whose histories are in the folder."""
    said = stated(about, _HISTORIES)
    return {number for number in said if isinstance(number, int)} if isinstance(said, list) else set()


def _history(number: int) -> Path:
    return Path(f"case_{number}.nc")


def _keeper(sweep: Sweep) -> Callable[[Rows], Rows]:
    """Gives what is kept of cases: the values they change, too, and of load cases how much they use of each limit."""

    def keep(rows: Rows) -> Rows:
        rows = with_uses(rows) if sweep.load_cases else rows
        if double := set(sweep.names).intersection(rows.columns):
            raise InputError(f"{min(double)}: is a column of the results: give the parameter another name")
        return rows.beside(sweep.columns(np.array(rows.keys)))

    return keep


def _there(sweep: Sweep, folder: Path) -> set[int]:
    """Numbers of the cases of a sweep of which a folder has histories or reports, of whatever sweep they are."""
    files = own_files(folder, r"case_\d{1,9}\.(nc|html)")
    return {number for file in files if (number := int(file.stem.removeprefix("case_"))) < len(sweep)}


def _write_histories(sweep: Sweep, numbers: Iterable[int], folder: Path) -> None:
    """Compute cases whose histories are wanted once more, and save those, unless they are there and of this sweep."""
    for number in sorted(numbers):
        file = folder / _history(number)
        try:
            scenario = sweep.scenario_of(number)
        except InputError:  # the case is refused; its row says why
            remove(file)
            remove(file.with_suffix(".html"))  # its report
            continue
        if not _is_of(file, scenario):
            remove(file.with_suffix(".html"))
            run(scenario).save(file)


def _is_of(file: Path, scenario: Scenario) -> bool:
    """Whether a file has the history of this very scenario, as this very trainmj computes it."""
    try:
        found = load_result(file)
    except InputError:
        return False
    return found.versions == identity() and to_yaml(found.scenario) == to_yaml(scenario)
