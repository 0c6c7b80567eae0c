"""What is printed of one collision: tables of at most 80 columns, units in their heads."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from trainmj.collision.chain import Chain, largest_step
from trainmj.collision.quantities import TRAIN
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.output.console import new_console, new_table, print_table
from trainmj.scenario import Scenario
from trainmj.single import tables
from trainmj.single.limits import limits_table
from trainmj.units import MS

if TYPE_CHECKING:
    from trainmj.collision.convergence import Convergence


def print_summary(result: Result, summary: Summary) -> None:
    """Status, criteria, interfaces, vehicles, energy and checks of one collision."""
    console = new_console()
    console.print(Text(result.scenario.title or "Train collision", style="bold"))
    console.print(f"Status: {summary.status}, {summary.duration_s:.3f} s simulated", markup=False, highlight=False)
    for quantity in TRAIN:
        value = f"{quantity.text(summary.values[quantity.name])} {quantity.unit}"
        console.print(f"{quantity.heading}: {value}, {quantity.meaning}", markup=False, highlight=False)
    limits = summary.limits
    for table in (
        *([limits_table(limits)] if limits else []),
        tables.interfaces(summary),
        tables.vehicles(summary),
        tables.energy(summary),
        tables.checks(result, summary),
    ):
        console.print()
        print_table(console, table)


def print_convergence(convergence: Convergence) -> None:
    """What halving the step changes, and the error of the scenario's own step."""
    console = new_console()
    table = new_table(
        "Step\nms",
        "TS\nmm",
        "change\n%",
        "TAMA\ng",
        "change\n%",
        "largest change\nof a stroke, mm",
        "energy\nbalance",
        title="The step, halved until TS and TAMA settle",
    )
    before = None
    rows = zip(convergence.step_ms, convergence.summaries, convergence.stroke_changes_mm, strict=True)
    for step, s, stroke in rows:
        changes = [
            "" if before is None else f"{100 * (getattr(s, name) / (getattr(before, name) or 1.0) - 1):+.4f}"
            for name in ("TS_mm", "TAMA_g")
        ]
        error = s.balance.energy_error
        values = f"{s.TS_mm:.3f}", changes[0], f"{s.TAMA_g:.5f}", changes[1], f"{stroke:.3f}", f"{error:.0e}"
        table.add_row(f"{step:g}", *values)
        before = s
    console.print()
    console.print(table)
    own = convergence.step_ms[0]
    for name, estimate, unit in (("TS", convergence.TS, "mm"), ("TAMA", convergence.TAMA, "g")):
        how = "extrapolated" if estimate.order is not None else "the smallest step's"
        console.print(
            f"{name}: {estimate.value:.6g} {unit} ({how}, sure to {100 * estimate.doubt:.1g} %); a step of {own:g} ms "
            f"is off by {100 * estimate.error:.2g} %.",
            markup=False,
        )
    console.print(
        f"Settled at {convergence.step_ms[-1]:g} ms."
        if convergence.settled
        else f"Not settled at {convergence.step_ms[-1]:g} ms: single events, such as a shear-off, still move the "
        "criteria.",
        style="bold",
    )


def print_chain(scenario: Scenario, chain: Chain) -> None:
    """What would run: vehicles, interfaces and step."""
    console = new_console()
    console.print(Text(scenario.title or "Train collision", style="bold"))
    print_table(console, tables.vehicles_of(chain))
    console.print()
    print_table(console, tables.interfaces_of(chain))
    steep = [i.name for i in chain.interfaces if (i.envelope.slope > i.envelope.stiffness).any()]
    if steep:
        console.print(
            f"Note: the envelope of {', '.join(steep)} rises faster than the unloading stiffness in places; there the "
            "force climbs along the stiffness.",
            markup=False,
        )
    console.print(
        f"Step {chain.step / MS:g} ms ({chain.integrator}), stable up to {largest_step(chain) / MS:.3g} ms; "
        f"a record every {chain.step * chain.steps_per_record / MS:g} ms; at most {chain.time_limit:g} s.",
        markup=False,
        highlight=False,
    )
