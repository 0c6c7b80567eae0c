"""What is printed of a reliability run: what would run, and what was found."""

from __future__ import annotations

from collections.abc import Iterator

from rich.text import Text

from trainmj.collision.status import COARSE, UNUSABLE, Kind
from trainmj.files.text import printable
from trainmj.output.console import new_console, print_table, print_verdict
from trainmj.reliability import tables
from trainmj.reliability.found import ReliabilityResult
from trainmj.reliability.plan import Reliability


def print_plan(plan: Reliability) -> None:
    """What would scatter, in which load cases."""
    console = new_console()
    console.print(Text(plan.title, style="bold"))
    console.print(tables.size(plan), soft_wrap=True)
    print_tolerances(plan)
    for name, scenario in plan.scenarios.items():
        if name:
            console.print(Text(f"Load case {name}: {scenario.subject}"))


def print_tolerances(plan: Reliability) -> None:
    """What scatters."""
    print_table(new_console(), tables.tolerances(plan))


def print_reliability(result: ReliabilityResult) -> None:
    """The probabilities, what causes them, how responses scatter, and how the draws ended."""
    console = new_console()
    console.print(Text(result.plan.title, style="bold"))
    console.print(tables.size(result.plan), soft_wrap=True)
    print_verdict(console, tables.verdict(result))
    for remark in remarks(result):
        console.print(Text(f"Note: {remark}"))
    for made in (tables.probabilities, tables.causes, tables.rare, tables.indices, tables.quantiles):
        table = made(result)
        if table.rows:
            console.print()
            print_table(console, table)
    console.print()
    there = "all were there" if not result.computed else f"{result.computed} collisions computed now"
    console.print(f"{there.capitalize()}, {result.seconds:.1f} s")
    console.print(f"Written to {result.folder}", soft_wrap=True)


def remarks(result: ReliabilityResult) -> Iterator[str]:
    """What a reader must know of the draws."""
    if result.governing is None:
        yield "no limit is stated, and no device has a stroke limit: only car bodies that give way are judged."
    if result.unusable:
        yield printable(
            f"{result.unusable} of {result.collisions} collisions have no usable numbers and count as passed; the "
            f"first, {result.first_unusable}"
        )
    cut = sum(of[Kind.TIME_LIMIT] for of in result.endings.values())
    if cut:
        yield (
            f"{cut} collisions were cut off by the time limit and are judged by what came before: state a longer "
            "simulation.time_limit_s."
        )
    if result.coarse:
        yield (
            f"{result.coarse} of {result.collisions} collisions have a {COARSE}, for the peaks in their reason: where "
            "limits are on peaks, set a smaller simulation.step_ms."
        )
    missed = sum(of[Kind.NO_CONTACT] for of in result.endings.values())
    if missed:
        yield f"in {missed} collisions no device was pressed; they count as kept."


def usable(result: ReliabilityResult) -> bool:
    """Whether any collision has numbers that may be used."""
    return any(count for of in result.endings.values() for kind, count in of.items() if kind not in UNUSABLE)
