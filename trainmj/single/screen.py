"""What is printed of one collision: tables with units in their heads."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from trainmj.collision.chain import Chain
from trainmj.collision.quantities import of_train
from trainmj.collision.remarks import remarks
from trainmj.collision.result import Result
from trainmj.collision.stability import largest_step
from trainmj.collision.summary import Summary
from trainmj.collision.verdict import verdict
from trainmj.output.console import FAILED, new_console, print_table, print_verdict
from trainmj.output.sources import sources_table
from trainmj.output.text_plot import Line, text_plot
from trainmj.scenario import Scenario
from trainmj.single import devices, plane, tables, tables_plane
from trainmj.single.beside import Beside
from trainmj.units import MS, rounded_down

_MOST_CURVES = 4  # devices that are drawn
_CURVE_WIDTH, _CURVE_ROWS = 38, 8

if TYPE_CHECKING:
    from trainmj.collision.convergence import Convergence


def print_summary(result: Result, summary: Summary, beside: Beside | None = None) -> None:
    """Status, criteria, interfaces, vehicles, bodies, energy and checks of one collision."""
    console = new_console()
    _print_head(console, result.scenario)
    print_verdict(console, verdict(summary, () if beside is None else beside.worse))
    console.print(f"Status: {summary.status}, {summary.duration_s:.3f} s simulated")
    _print_not_valid(console, summary)
    mark = f" ({summary.not_valid})" if summary.not_valid else ""
    for quantity in of_train(result.chain):
        value = f"{quantity.text(summary.values[quantity.name])} {quantity.unit}".rstrip()
        console.print(f"{quantity.heading}: {value}{mark}, {quantity.meaning}")
    limits = summary.limits
    for table in (
        *([tables.limits(limits).marked(summary.not_valid)] if limits else []),
        tables.interfaces(summary),
        *tables.vehicles(result.chain, summary),
        *(tables_plane.in_plane(summary) if result.chain.plane else ()),
        *([tables.bodies(result.chain, summary)] if result.chain.members else []),
        tables.energy(summary),
        tables.checks(result, summary),
    ):
        console.print()
        print_table(console, table)
    acted = [plane.ruling(result, summary)] if result.chain.plane else []
    _print_notes(console, result.scenario, (*acted, *summary.remarks))


def print_beside(chain: Chain, beside: Beside) -> None:
    """What was computed beside a collision."""
    console = new_console()
    for table in beside.tables(chain):
        console.print()
        print_table(console, table)


def _print_not_valid(console: Console, summary: Summary) -> None:
    """Which numbers are not valid, and what to do about it."""
    if summary.not_valid:
        console.print(
            Text(
                f"{summary.not_valid.replace('not valid', 'NOT VALID')}: {tables.why_not_valid(summary)}",
                style=FAILED,
            )
        )


def _print_head(console: Console, scenario: Scenario) -> None:
    console.print(Text(scenario.heading, style="bold"))
    console.print(Text(scenario.subject))


def _print_notes(console: Console, scenario: Scenario, found: Iterable[str]) -> None:
    for note in scenario.told:
        console.print(Text(f"Note: {note}"), soft_wrap=True)  # paths in it stay whole
    for remark in found:
        console.print(Text(f"Note: {remark}"))


def print_convergence(convergence: Convergence) -> None:
    """What halving the step changes, and the error of the scenario's own step."""
    console = new_console()
    first = convergence.summaries[0]
    for table in tables.convergence(convergence):
        console.print()
        print_table(console, table.marked(first.not_valid))
    last = convergence.step_ms[-1]
    console.print()
    console.print(
        f"Settled at {last:g} ms."
        if convergence.settled
        else f"Not settled at {last:g} ms: single events, such as a shear-off, still move the responses.",
        style="bold",
    )


def _print_curves(console: Console, scenario: Scenario, chain: Chain) -> None:
    """Force over stroke of the first devices, two side by side where there is room."""
    users = devices.users(chain, scenario.as_built)
    console.print()
    console.print("Force (kN) over stroke (mm): * loading and . unloading at rest; + and - at a rate", style="bold")
    plots = [Text(_curve(chain, name, users[name])) for name in list(users)[:_MOST_CURVES]]
    beside = 2 if console.width >= 2 * _CURVE_WIDTH + 2 else 1
    for n in range(0, len(plots), beside):
        grid = Grid.grid(padding=(0, 2, 0, 0))
        grid.add_row(*plots[n : n + beside])
        console.print(grid, soft_wrap=True)
    left_out = list(users)[_MOST_CURVES:]
    if left_out:
        console.print(Text(f"Not drawn: {', '.join(left_out)}; the report of a run draws all."))


def _curve(chain: Chain, name: str, places: list[devices.Place]) -> str:
    """Force over stroke of a device in plain characters."""
    drawn = list(devices.curves(chain, places))
    lines = [
        Line(sign, u, f)
        for one, signs in zip(drawn, ("*.", "+-"), strict=False)
        for sign, (u, f) in zip(signs, one.parts, strict=True)
    ]
    title = ", + ".join([name, *(one.name for one in drawn[1:])])
    return text_plot(title, lines, "mm", _CURVE_WIDTH, _CURVE_ROWS)


def print_chain(scenario: Scenario, chain: Chain) -> None:
    """What would run: vehicles, interfaces and step."""
    console = new_console()
    _print_head(console, scenario)
    print_table(console, tables.vehicles_of(chain))
    console.print()
    if chain.members:
        print_table(console, tables.bodies_of(chain))
        console.print()
    print_table(console, tables.interfaces_of(chain))
    console.print()
    print_table(console, devices.table(scenario, chain))
    for table in (tables_plane.gear_of(chain), tables_plane.lines_of(chain)) if chain.plane else ():
        console.print()
        print_table(console, table)
    if scenario.as_built:
        console.print()
        print_table(console, devices.as_built(scenario))
    _print_curves(console, scenario, chain)
    if scenario.sources:
        console.print()
        print_table(console, sources_table(scenario.sources, scenario.values()))
    _print_notes(console, scenario, (*remarks(chain), *devices.narrow(chain)))
    if scenario.tolerances:
        names = ", ".join(scenario.tolerances)
        said = f"Tolerances ({names}) are for trainmj reliability and robust studies; a run has the values as stated."
        console.print(said, markup=False)
    if chain.grade:
        console.print(f"Grade {chain.grade * 1e3:g} per mille, positive uphill along the motion.")
    largest = rounded_down(largest_step(chain) / MS, 3)
    console.print(
        f"Step {chain.step / MS:g} ms ({chain.integrator}), stable up to {largest} ms; "
        f"a record every {chain.record_interval / MS:g} ms; at most {chain.time_limit:g} s."
    )
