"""What is printed of an identification: what would run, how it gets on, and what was found."""

from __future__ import annotations

import sys
import time

from rich.console import Console
from rich.status import Status
from rich.text import Text

from trainmj.identification import tables
from trainmj.identification.found import FOUND, Found
from trainmj.identification.plan import Identification
from trainmj.identification.search import Progress
from trainmj.identification.uncertainty import MEANING, Uncertainty
from trainmj.output.console import new_console, print_table, print_verdict
from trainmj.output.waiting import hush

_WHAT = {"explore": "trials explored", "refine": "iterations of the refinement", "finish": "iterations of the finish"}
_MOST_LINES = 8


class Screen(Status):
    """One moving line on a terminal; silent where there is none."""

    def __init__(self) -> None:
        """On the error stream, so that what is printed stays clean."""
        self._said = "simulating the start values"
        self._began = time.monotonic()
        self._trials = 0
        super().__init__(self._said, console=Console(stderr=True, highlight=False))
        hush()
        if sys.stderr.isatty():
            self.start()

    def watch(self, progress: Progress) -> None:
        """Show a generation or an iteration."""
        what = _WHAT[progress.phase]
        self._said = f"{progress.done} of at most {progress.of} {what}, misfit {progress.cost:.5g}"
        self.trials(0)

    def trials(self, finished: int) -> None:
        """Count trials."""
        self._trials += finished
        self.update(f"{self._said}; {self._trials} trials in {time.monotonic() - self._began:.0f} s")


def print_plan(plan: Identification) -> None:
    """What an identification would seek: parameters, targets, and how long."""
    console = new_console()
    console.print(Text(plan.title, style="bold"))
    held_out = f"; {len(plan.held_out)} more are held out" if len(plan.held_out) else ""
    method = plan.spec.method
    explored = f"at most {method.explore.trials} trials in each of {method.explore.searches} searches"
    console.print(f"Identification: {tables.size(plan)}{held_out}")
    console.print(f"Method: {explored}, then {method.refine.iterations} iterations by least squares")
    for table in (tables.sought(plan), tables.wanted(plan)):
        console.print()
        print_table(console, table)
    for note in plan.source.told:
        console.print(f"Note: {note}", soft_wrap=True, markup=False)


def _misfit(known: Uncertainty) -> str:
    """How well the values are met, and what that says of the tolerances."""
    if not known.freedom > 0:
        return "tells nothing: as many values are sought as there are to meet"
    wide = "; below 1: the tolerances are wide" if known.chi2 < 0.3 else ", about 1 if the tolerances are right"
    return f"{known.chi2:.3g} per degree of freedom ({known.freedom:g}){wide}"


def print_found(found: Found) -> None:
    """The closing summary of an identification."""
    console = new_console()
    plan = found.plan
    before = f", {found.there} collisions were there" if found.there else ""
    console.print(Text(plan.title, style="bold"))
    console.print(f"{tables.size(plan)}; {found.simulated} new trials{before}", markup=False)
    print_verdict(console, tables.verdict(found))
    console.print(f"Misfit: {_misfit(found.known)}", markup=False)
    for role in found.samples:
        console.print()
        print_table(console, tables.fit(found, role))
    console.print()
    print_table(console, tables.parameters(found))
    console.print()
    for name, verdict in tables.constraints(found).items():
        console.print(f"Constraint {name}: {verdict.text}", markup=False)
    for line in _undetermined(found):
        console.print(line, markup=False)
    console.print(f"{found.seconds:.1f} s; written to {found.folder}", markup=False, soft_wrap=True)
    console.print(f"Run what was found: trainmj run {found.folder / FOUND}", markup=False, soft_wrap=True)


def _undetermined(found: Found) -> list[str]:
    """How many parameters the data determine, what that means, and the combinations that they leave open."""
    count, verdict = tables.determined(found)
    lines = [f"Determined by the data: {count} parameters; {verdict.text}.", MEANING]
    loose = [d for d in found.known.directions if not d.determined]
    if loose:
        lines.append("Combinations left open (one standard deviation, in percent of the ranges):")
    for d in loose[:_MOST_LINES]:
        wide = f"{100 * d.deviation:.0f} %" if d.deviation <= 10 else "> 1000 %"
        lines.append(f"  {wide:>8}  {d.in_words(found.plan.unknowns.names)}")
    return lines + ([f"  and {len(loose) - _MOST_LINES} more"] if len(loose) > _MOST_LINES else [])
