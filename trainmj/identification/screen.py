"""What ``trainmj identify`` prints: how it gets on, and the closing summary, at most 80 columns wide."""

from __future__ import annotations

import sys
import time

import pandas as pd
from rich.console import Console
from rich.status import Status
from rich.table import Table
from rich.text import Text

from trainmj.identification import tables
from trainmj.identification.found import FOUND, Found
from trainmj.identification.search import Progress
from trainmj.output.console import new_console, new_table

_WHAT = {"explore": "trials explored", "refine": "iterations of the refinement", "finish": "iterations of the finish"}
_MOST_LINES = 8
_LONGEST = 30  # letters of a name that fit beside its numbers


class Screen:
    """One moving line on a terminal; silent where there is none."""

    def __init__(self) -> None:
        """On the error stream, so that what is printed stays clean."""
        self._status = Status("simulating the start values", console=Console(stderr=True, highlight=False))
        self._began = time.monotonic()
        self._trials = 0
        self._said = "simulating the start values"
        if sys.stderr.isatty():
            self._status.start()

    def watch(self, progress: Progress) -> None:
        """Show a generation or an iteration."""
        what = _WHAT[progress.phase]
        self._said = f"{progress.done} of at most {progress.of} {what}, misfit {progress.cost:.5g}"
        self._show()

    def trials(self, finished: int) -> None:
        """Count trials."""
        self._trials += finished
        self._show()

    def stop(self) -> None:
        """Take the line away."""
        self._status.stop()

    def _show(self) -> None:
        self._status.update(f"{self._said}; {self._trials} trials in {time.monotonic() - self._began:.0f} s")


def print_found(found: Found) -> None:
    """The closing summary of an identification."""
    console = new_console()
    plan, known = found.plan, found.known
    console.print(Text(plan.title, style="bold"))
    lines = [
        f"{len(plan.unknowns.free)} values sought from {len(plan.fitted)} in {len(plan.fitted.cases)} cases; "
        f"{found.simulated} trials simulated now" + (f", {found.there} were there" if found.there else ""),
        f"Misfit: {known.chi2:.3g} per degree of freedom ({known.freedom}); "
        + ("about 1 is what the tolerances say" if known.chi2 >= 0.3 else "below 1: the tolerances are wide"),
    ]
    for line in lines:
        console.print(line, markup=False)
    for role in dict.fromkeys(found.fit["role"]):
        console.print()
        console.print(_fit(role, found.fit[found.fit["role"] == role]))
    console.print("out: values beyond their tolerance, or their bar where there is one", markup=False)
    console.print()
    console.print(_parameters(found.parameters))
    console.print()
    for line in [*_constraints(found), *_undetermined(found)]:
        console.print(line, markup=False)
    console.print(f"{found.seconds:.1f} s; written to {found.folder}", markup=False, soft_wrap=True)
    console.print(f"Run what was found: trainmj run {found.folder / FOUND}", markup=False, soft_wrap=True)


def _fit(role: str, rows: pd.DataFrame) -> Table:
    title = "Fit" if role == "fitted" else "Held out: never seen by the search"
    table = new_table("Target", "values", "rms", "bias", "largest", "largest\n%", "out", "bars", title=title)
    for row in rows.to_dict("records"):
        kept = "" if row["kept"] is None else "kept" if row["kept"] else "NOT"
        table.add_row(
            _cut(f"{row['target']} {row['unit']}".strip(), _LONGEST),
            str(row["values"]),
            f"{row['rms']:.3g}",
            f"{row['bias']:+.2g}",
            f"{row['largest']:+.3g}",
            f"{row['largest_percent']:+.2f}",
            str(row["outside"] or "-"),
            kept,
        )
    return table


def _parameters(rows: pd.DataFrame) -> Table:
    table = new_table("Parameter", "value", "95 % from", "to", "stages", title="Found")
    table.columns[-1].header = ""
    table.columns[-1].no_wrap = True
    for row in rows.to_dict("records"):
        remark = "solved" if row["remark"].startswith("solved") else row["remark"]
        name = _cut(f"{row['parameter']} {row['unit']}".strip(), _LONGEST)
        table.add_row(name, f"{row['value']:.6g}", *tables.interval(row), remark)
    return table


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _constraints(found: Found) -> list[str]:
    return [
        f"Constraint {row['constraint']}: {row['found_kJ']:.4g} kJ of {row['wanted_kJ']:g} kJ"
        + ("" if row["met"] else ": NOT MET, its parameter is at a bound")
        for row in found.summary["constraints"]
    ]


def _undetermined(found: Found) -> list[str]:
    """The directions that the data leave open."""
    loose = [d for d in found.known.directions if not d.determined]
    if not loose:
        return ["The data determine every combination of the parameters."]
    names = found.plan.unknowns.names
    lines = ["Not determined by the data (one standard deviation, as part of the ranges):"]
    for d in loose[:_MOST_LINES]:
        wide = "> 1000 %" if d.deviation > 10 else f"{100 * d.deviation:.0f} %"
        lines.append(f"  {wide:>8}  {tables.in_words(d, names)}")
    return lines + ([f"  and {len(loose) - _MOST_LINES} more"] if len(loose) > _MOST_LINES else [])
