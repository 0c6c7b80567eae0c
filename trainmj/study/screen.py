"""What is printed of a study: what would run, its progress, and the closing summary."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console
from rich.status import Status
from rich.text import Text

from trainmj.output.console import new_console, print_table, print_verdict
from trainmj.output.table import Table, Verdict
from trainmj.output.waiting import hush
from trainmj.study import tables
from trainmj.study.file import LatinHypercube, SobolSequence
from trainmj.study.folder import Step
from trainmj.study.plan import Study
from trainmj.study.remarks import of_plan
from trainmj.study.run import StudyResult, Watch
from trainmj.study.steps import design_of

_SEARCHED = {"surrogate": "surrogates", "simulator": "simulator", "both": "surrogates and on the simulator"}


class Screen(Watch):
    """Shows the steps on a terminal as they are done; where there is none, only what has changed."""

    def __init__(self) -> None:
        """Write to the error stream, so that output can be piped."""
        self._console = Console(stderr=True, highlight=False)
        self._status = Status("", console=self._console)
        self._shown = sys.stderr.isatty()
        self._step = ""

    def changed(self, changes: Sequence[str]) -> None:
        """Print what has changed, which explains why steps are done again."""
        if changes:
            hush()
        for change in changes:
            self._console.print(f"Changed: {change}", markup=False, soft_wrap=True)

    def begin(self, step: str) -> None:
        """Show the step."""
        self._step = step
        if self._shown:
            hush()
            self._status.update(step)
            self._status.start()

    def simulated(self, count: int) -> None:
        """Show how many collisions have been computed."""
        self._status.update(f"{self._step}: {count} collisions so far")

    def done(self, step: Step[Any]) -> None:
        """Print a line for it."""
        if self._shown:
            said = "  there" if step.seconds is None else f"{step.seconds:5.1f} s"
            number = min(step.tables)[:2]  # its files begin with it
            self._console.print(f"{number} {step.name:<26}{said}")

    def stop(self) -> None:
        """Remove the status line."""
        self._status.stop()


def print_plan(study: Study) -> None:
    """What a study would do: its factors, responses and design.

    Raises:
        InputError: if there is no such design.
    """
    console = new_console()
    console.print(Text(study.title, style="bold"))
    part = study.spec.design
    n = part.n if isinstance(part, (LatinHypercube, SobolSequence)) else len(design_of(study).points)
    where = _SEARCHED[study.spec.optimiser.on]
    console.print(f"Study: {n} points ({part.kind}), then a search on the {where}")
    found = of_plan(study)
    shown = [tables.cases_of(study)] if study.spec.cases else []
    shown += [tables.factors_of(study), tables.responses_of(study), *[tables.remarks_of(found)] * bool(found)]
    for table in shown:
        console.print()
        print_table(console, table)
    for note in study.source.told:
        console.print(f"Note: {note}", soft_wrap=True, markup=False)


def print_study(result: StudyResult) -> None:
    """The closing summary of a study."""
    console = new_console()
    summary = result.summary

    def show(table: Table, notes: Iterable[str] = ()) -> None:
        console.print()
        print_table(console, table)
        for note in notes:
            console.print(note, markup=False)

    console.print(Text(summary["title"], style="bold"))
    print_verdict(console, tables.verdict(summary))
    for name, value in tables.design(summary).items():
        text = value.text if isinstance(value, Verdict) else value
        console.print(f"{name}: {text}", markup=False)

    def show_search(found: tables.Summary) -> None:
        show(tables.surrogates(found))
        show(tables.fronts(found), tables.notes_on_fronts(found))
        show(tables.weights(found))
        show(tables.decision(found), tables.notes_on_decision(found))
        show(tables.check(found))
        if found["remarks"]:
            show(tables.remarks(found))

    show_search(summary)
    console.print()
    if "robust" in summary:
        console.print(Text("Robust: the same search on statistics of trains as built", style="bold"))
        show_search(summary["robust"])
        for table in tables.held(summary):
            show(table)
        console.print()
    console.print(
        f"Written to {result.folder}; {result.simulated} collisions computed now, steps done now: "
        f"{', '.join(result.computed) or 'none'}",
        markup=False,
    )
