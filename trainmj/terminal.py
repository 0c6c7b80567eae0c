"""What the command line prints: tables of at most 80 columns, units in their heads."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich import progress as bars
from rich.console import Console
from rich.table import Table
from rich.text import Text

from trainmj.chain import Chain, Interface, largest_step
from trainmj.device import Device
from trainmj.metrics import InterfaceMetrics, Summary
from trainmj.scenario import Scenario
from trainmj.units import KM_H, KN_PER_MM, KN_S_PER_M, MM, MS, TONNE

if TYPE_CHECKING:
    from trainmj.convergence import Convergence
    from trainmj.sweep.run import Outcome

WIDTH = 80


def print_summary(scenario: Scenario, summary: Summary) -> None:
    """Interfaces, vehicles, criteria and balance of one collision."""
    console = new_console()
    console.print(Text(scenario.title or "Train collision", style="bold"))
    console.print(f"Status: {summary.status}, {summary.duration_s:.3f} s simulated", markup=False, highlight=False)
    for table in (_interfaces(summary.interfaces), _vehicles(summary)):
        console.print()
        console.print(table)
    console.print()
    b = summary.balance
    criteria = Table.grid(padding=(0, 2))
    for name, value, what in (
        ("TS", f"{summary.TS_mm:.1f} mm", "compression along the moving train, no empty strokes"),
        ("TAMA", f"{summary.TAMA_g:.4f} g", "mean of its peak device accelerations"),
        ("Energy", f"{b.kinetic_start_kJ:.1f} kJ", "kinetic at the start, of which"),
        ("", f"{b.kinetic_end_kJ:.1f} kJ", "kinetic at the end"),
        ("", f"{b.absorbed_kJ:.1f} kJ", "absorbed by the devices"),
        ("", f"{b.friction_kJ:.1f} kJ", "by the rails"),
        ("", f"{b.elastic_kJ:.1f} kJ", "elastic, still in the devices"),
        ("Checks", f"{b.energy_error:.1e}", "relative error of the energy balance"),
        ("", f"{b.momentum_error:.1e}", "relative error of the momentum balance"),
    ):
        criteria.add_row(Text(name, style="bold"), Text(value, justify="right"), what)
    console.print(criteria)


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


def _interfaces(interfaces: Sequence[InterfaceMetrics]) -> Table:
    table = new_table(
        "Interface",
        "largest\nstroke\nmm",
        "permanent\nset\nmm",
        "peak\nforce\nkN",
        "absorbed\nenergy\nkJ",
        "at\ns",
        title="Interfaces (at the front: one train's side)",
    )
    for i in interfaces:
        flag = " !" if i.exhausted else ""
        table.add_row(
            i.name + flag,
            f"{i.stroke_mm:.1f}",
            f"{i.permanent_mm:.1f}",
            f"{i.peak_force_kN:.1f}",
            f"{i.energy_kJ:.2f}",
            f"{i.peak_time_s:.3f}",
        )
        for stage in i.stages if len(i.stages) > 1 else ():
            limit = "" if stage.limit_mm is None else f" of {stage.limit_mm:g}"
            table.add_row(f"  {stage.name}{limit}", f"{stage.stroke_mm:.1f}", "", "", "", "")
    if any(i.exhausted for i in interfaces):
        table.caption = "! a stroke limit, or the end of a curve, was passed"
    return table


def _vehicles(summary: Summary) -> Table:
    table = new_table(
        "Vehicle",
        "mass\nt",
        "device\npeak\ng",
        "total\npeak\ng",
        "CFC 60\npeak\ng",
        "mean\n30 ms\ng",
        "mean\n100 ms\ng",
        "mean\nall\ng",
        "final\nspeed\nkm/h",
        "balance\ntime\ns",
        title="Vehicles (accelerations)",
    )
    for v in summary.vehicles:
        table.add_row(
            v.name,
            f"{v.mass_t:g}",
            f"{v.peak_device_acceleration_g:.4f}",
            f"{v.peak_acceleration_g:.3f}",
            f"{v.cfc60_peak_g:.3f}",
            f"{v.mean_30ms_g:.3f}",
            f"{v.mean_100ms_g:.3f}",
            f"{v.mean_deceleration_g:.3f}",
            f"{v.final_speed_km_h:.2f}",
            f"{v.balance_time_s:.3f}",
        )
    return table


def print_chain(scenario: Scenario, chain: Chain) -> None:
    """What would run: vehicles, interfaces and step."""
    console = new_console()
    console.print(Text(scenario.title or "Train collision", style="bold"))
    table = new_table("Vehicle", "type", "mass\nt", "length\nm", "speed\nkm/h")
    for v in chain.vehicles:
        table.add_row(v.name, v.kind, f"{v.mass / TONNE:g}", f"{v.length:g}", f"{v.speed / KM_H:g}")
    console.print(table)
    table = new_table("Interface", "device", "stiffness\nkN/mm", "dashpot\nkN s/m", "points", "stages (limit mm)")
    notes = []
    for i in chain.interfaces:
        stages = " + ".join(dict.fromkeys(_stages(device) for device in i.devices))
        e = i.envelope
        table.add_row(
            i.name, _names(i), f"{e.stiffness / KN_PER_MM:g}", f"{e.damping / KN_S_PER_M:g}", str(e.stroke.size), stages
        )
        if (e.slope > e.stiffness).any():
            notes.append(i.name)
    console.print(table)
    if notes:
        console.print(
            f"Note: the envelope of {', '.join(notes)} rises faster than the unloading stiffness in places; there the "
            "force climbs along the stiffness.",
            markup=False,
        )
    console.print(
        f"Step {chain.step / MS:g} ms ({chain.integrator}), stable up to {largest_step(chain) / MS:.3g} ms; "
        f"a record every {chain.step * chain.steps_per_record / MS:g} ms; at most {chain.time_limit:g} s.",
        markup=False,
        highlight=False,
    )


def _stages(device: Device) -> str:
    return "; ".join(f"{s.name} ({s.limit / MM:g})" if s.limit < np.inf else s.name for s in device.stages)


def _names(interface: Interface) -> str:
    names = [device.name for device in interface.devices]
    return f"2 x {names[0]}" if len(names) == 2 and names[0] == names[1] else " + ".join(names)


def print_scenarios(scenarios: Mapping[str, Scenario]) -> None:
    """Names, titles and parameters of scenarios."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column("Name", style="bold", no_wrap=True)
    table.add_column("What it is")
    table.add_column("Parameters")
    for name, scenario in scenarios.items():
        table.add_row(name, scenario.title, "\n".join(scenario.parameters))
    new_console().print(table)


class Progress:
    """A bar with rate and time left on a terminal; silent where there is none."""

    def __init__(self, total: int) -> None:
        """For a known number of cases."""
        self._began: tuple[float, int] | None = None
        self._bar = bars.Progress(
            bars.TextColumn("{task.completed}/{task.total}"),
            bars.BarColumn(),
            bars.TextColumn("{task.fields[rate]}"),
            bars.TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._task = self._bar.add_task("", total=total, rate="")

    def __enter__(self) -> Progress:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take it away."""
        self.stop()

    def stop(self) -> None:
        """Take it away."""
        self._bar.stop()

    def __call__(self, finished: int) -> None:
        """Show how many are finished."""
        now = time.monotonic()
        if self._began is None:
            self._began = (now, finished)
        since, before = self._began
        rate = (finished - before) / (now - since) if now > since else 0.0
        self._bar.update(self._task, completed=finished, rate=f"{rate:.0f}/s")


def print_outcome(outcome: Outcome) -> None:
    """The last line of a sweep."""
    there = outcome.cases - outcome.computed
    rate = outcome.computed / outcome.seconds if outcome.seconds > 0 else 0.0
    console = new_console()
    cases = f"{outcome.cases} case{'s' if outcome.cases > 1 else ''}" + (f" ({there} were there)" if there else "")
    console.print(
        f"{cases}, {outcome.failed} failed, {outcome.seconds:.1f} s, {rate:.0f} collisions a second; "
        f"written to {outcome.folder}",
        markup=False,
        soft_wrap=True,
    )
    if outcome.first_failure:
        console.print(f"The first that failed: {outcome.first_failure}", markup=False, soft_wrap=True)


def new_table(first: str, *heads: str, title: str | None = None) -> Table:
    """A table whose first column is text and whose others are numbers."""
    table = Table(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        show_edge=False,
        title=title,
        title_justify="left",
        title_style="bold",
        caption_justify="left",
    )
    table.add_column(first, no_wrap=True, vertical="bottom")
    for head in heads:
        text = head in ("type", "device") or head.startswith("stages")
        table.add_column(head, justify="left" if text else "right", no_wrap=not text, vertical="bottom")
    return table


def new_console() -> Console:
    """A console at most 80 columns wide."""
    console = Console(highlight=False, emoji=False)
    if console.width > WIDTH or not console.is_terminal:
        console.width = WIDTH
    return console
