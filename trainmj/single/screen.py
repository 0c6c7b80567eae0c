"""What is printed of one collision: tables of at most 80 columns, units in their heads."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from trainmj.collision.chain import Chain, largest_step
from trainmj.collision.quantities import TRAIN
from trainmj.collision.remarks import remarks
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.output.console import new_console, print_table
from trainmj.scenario import Scenario
from trainmj.single import tables
from trainmj.units import MS, rounded_down

if TYPE_CHECKING:
    from trainmj.collision.convergence import Convergence


def print_summary(result: Result, summary: Summary) -> None:
    """Status, criteria, interfaces, vehicles, energy and checks of one collision."""
    console = new_console()
    _print_head(console, result.scenario)
    console.print(f"Status: {summary.status}, {summary.duration_s:.3f} s simulated")
    for quantity in TRAIN:
        value = f"{quantity.text(summary.values[quantity.name])} {quantity.unit}"
        console.print(f"{quantity.heading}: {value}, {quantity.meaning}")
    limits = summary.limits
    for table in (
        *([tables.limits(limits)] if limits else []),
        tables.interfaces(summary),
        tables.vehicles(summary),
        tables.energy(summary),
        tables.checks(result, summary),
    ):
        console.print()
        print_table(console, table)
    _print_notes(console, result.scenario, summary.remarks)


def _print_head(console: Console, scenario: Scenario) -> None:
    console.print(Text(scenario.heading, style="bold"))
    console.print(Text(scenario.subject))


def _print_notes(console: Console, scenario: Scenario, found: Iterable[str]) -> None:
    for note in scenario.displaced:
        console.print(Text(f"Note: {note}"), soft_wrap=True)  # paths in it stay whole
    for remark in found:
        console.print(Text(f"Note: {remark}"))


def print_convergence(convergence: Convergence) -> None:
    """What halving the step changes, and the error of the scenario's own step."""
    console = new_console()
    for table in tables.convergence(convergence):
        console.print()
        print_table(console, table)
    last = convergence.step_ms[-1]
    console.print()
    console.print(
        f"Settled at {last:g} ms."
        if convergence.settled
        else f"Not settled at {last:g} ms: single events, such as a shear-off, still move the responses.",
        style="bold",
    )


def print_chain(scenario: Scenario, chain: Chain) -> None:
    """What would run: vehicles, interfaces and step."""
    console = new_console()
    _print_head(console, scenario)
    print_table(console, tables.vehicles_of(chain))
    console.print()
    print_table(console, tables.interfaces_of(chain))
    _print_notes(console, scenario, remarks(chain))
    largest = rounded_down(largest_step(chain) / MS, 3)
    console.print(
        f"Step {chain.step / MS:g} ms ({chain.integrator}), stable up to {largest} ms; "
        f"a record every {chain.record_interval / MS:g} ms; at most {chain.time_limit:g} s."
    )
