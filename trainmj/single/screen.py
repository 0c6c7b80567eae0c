"""What is printed of one collision: tables of at most 80 columns, units in their heads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from trainmj.collision.chain import Chain, Interface, largest_step
from trainmj.collision.device import Device
from trainmj.collision.summary import InterfaceMetrics, Summary
from trainmj.output.console import new_console, new_table
from trainmj.scenario import Scenario
from trainmj.units import KM_H, KN_PER_MM, KN_S_PER_M, MM, MS, TONNE

if TYPE_CHECKING:
    from trainmj.collision.convergence import Convergence


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
