"""The tables of one collision, each told once for terminal and page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.chain import Chain, Interface, largest_step
from trainmj.collision.device import Device
from trainmj.collision.limits import Criterion
from trainmj.collision.quantities import BALANCE, INTERFACE, STAGE, VEHICLE, Quantity
from trainmj.collision.records import InterfaceMetrics, StageUse
from trainmj.collision.result import Result
from trainmj.collision.status import Kind, Status
from trainmj.collision.summary import UNSTABLE, Summary
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.units import KM_H, KN_PER_MM, KN_S_PER_M, MM, MS, TONNE, against

if TYPE_CHECKING:
    from trainmj.collision.convergence import Convergence

_SEEN = 5e-4  # g: half a digit of the table
_MOMENTUM = 1e-9  # momentum is kept to round-off; a larger error, relative to the sum of |m v|, is a fault


def outcome(status: Status) -> Verdict:
    """The way in which a collision ended, as a verdict."""
    if status.kind is Kind.OVER:
        return passed(status.kind)
    return (warned if status.kind in (Kind.NO_CONTACT, Kind.TIME_LIMIT) else failed)(status.kind)


def limits(criteria: Sequence[Criterion]) -> Table:
    """The limits of the scenario beside what was found."""
    heads = [*worded("Limit", "at"), Column("found"), Column("allowed"), Column("used", "%"), *worded("verdict")]
    rows = [
        (c.title, c.where, f"{c.text} {c.unit}", f"{c.limit:.12g} {c.unit}", against(c.used, 100, 0), judged(c.kept))
        for c in criteria
    ]
    return Table(heads, rows)


def interfaces(summary: Summary) -> Table:
    """Every interface and the stages of its devices, from the front backwards, the moving train first."""
    rows: list[tuple[Any, ...]] = []
    blank = [""] * (len(INTERFACE) - 1)
    for i in summary.interfaces:
        stages = i.stages if len(i.stages) > 1 else ()
        stroke, *others = i.values.values()
        own = i.stages[0].limit_mm if len(i.stages) == 1 else None
        rows.append((i.name, i.device, STAGE.text(stroke, own), *others, _end(i)))
        rows += [(f"\u00a0\u00a0{s.name}", "", STAGE.text(s.stroke_mm, s.limit_mm), *blank, _limit(s)) for s in stages]
    return Table(
        [*worded("Interface", "device"), *_columns(INTERFACE), Column("limit", "mm", text=True)],
        rows,
        "Interfaces",
        "At the front: one train's side. From the front backwards, the moving train first.",
    )


def _end(interface: InterfaceMetrics) -> Verdict | str:
    """Whether the curve or the only stage's limit was passed; the limits of several stages stand in their rows."""
    if interface.beyond_curve:
        return failed("past the curve")
    return _limit(interface.stages[0]) if len(interface.stages) == 1 else ""


def _limit(stage: StageUse) -> Verdict | str:
    if stage.limit_mm is None:
        return ""
    limit = f"{stage.limit_mm:.12g}"
    return failed(f"> {limit}") if stage.exhausted else passed(f"≤ {limit}")


def vehicles(summary: Summary) -> Table:
    """Every vehicle, from the front backwards, the moving train first."""
    note = (
        "Peaks are from every step: by the devices alone, and by all forces; CFC 60 is the filter of SAE J211. Balance "
        "time: when the interface on the side of the impact had its largest stroke."
    )
    if any(v.cfc60_peak_g - v.peak_acceleration_g > _SEEN for v in summary.vehicles):
        note += " A CFC 60 peak above the total peak is the filter's overshoot, no acceleration that was there."
    if any(np.isnan(list(v.values.values())).any() for v in summary.vehicles):
        note += " Missing values need records closer together (record_every_ms), or a collision that is not cut off."
    return Table(
        [*worded("Vehicle", "type"), *_columns(VEHICLE)],
        [(v.name, v.kind, *v.values.values()) for v in summary.vehicles],
        "Vehicles",
        note,
    )


def _columns(quantities: Iterable[Quantity[Any]]) -> list[Column]:
    return [
        Column(q.heading.replace("\n", " "), q.unit, q.digits if q.digits >= 0 else f".{-q.digits}g", head=q.heading)
        for q in quantities
    ]


def energy(summary: Summary) -> Table:
    """Where the kinetic energy went."""
    values = summary.balance.values
    start = values["kinetic_start_kJ"]
    rows = [(q.heading, values[q.name], 100 * values[q.name] / start) for q in BALANCE if q.unit == "kJ"]
    return Table([*worded("Energy"), Column("", "kJ", 1), Column("share", "%", 2)], rows)


def checks(result: Result, summary: Summary) -> Table:
    """What must hold for the numbers to be trusted."""
    b, chain = summary.balance, result.chain
    step, largest = chain.step / MS, largest_step(chain) / MS
    errors = (
        ("energy balance", b.energy_error, UNSTABLE),
        ("absorbed energy, against the curves", b.curve_error, UNSTABLE),
        ("momentum balance", b.momentum_error, _MOMENTUM),
    )
    stable, end, last = f"{against(largest, step, -3)} ms", summary.duration_s, chain.time_limit
    rows = [
        *((name, against(abs(e), most, -2), f"{most:.0e}", judged(abs(e) <= most)) for name, e, most in errors),
        ("step, against the largest stable one", f"{step:.12g} ms", stable, judged(step <= largest)),
        ("end, before the time limit", f"{end:.3f} s", f"{last:g} s", judged(result.tally.over)),
    ]
    return Table(
        [*worded("Check"), Column("found"), Column("allowed"), *worded("verdict")],
        rows,
        note="Energy relative to what the collision can convert, momentum to the sum of |m v| at the start. Curves: "
        "absorbed energy against the area below each one.",
    )


def vehicles_of(chain: Chain) -> Table:
    """The vehicles as they stand along the track."""
    measures = [Column(name, unit, ".6g") for name, unit in (("mass", "t"), ("length", "m"), ("speed", "km/h"))]
    return Table(
        [*worded("Vehicle", "type"), *measures],
        [(v.name, v.kind, v.mass / TONNE, v.length, v.speed / KM_H) for v in chain.vehicles],
        "Vehicles along the track",
    )


def interfaces_of(chain: Chain) -> Table:
    """The interfaces with their devices."""
    constants = [Column("stiffness", "kN/mm", ".6g"), Column("dashpot", "kN s/m", ".6g"), Column("points")]
    return Table(
        [*worded("Interface", "device"), *constants, *worded("stages (limit mm)")],
        [
            (
                i.name,
                _devices(i),
                i.envelope.stiffness / KN_PER_MM,
                i.envelope.damping / KN_S_PER_M,
                i.envelope.stroke.size,
                " + ".join(dict.fromkeys(_stages(device) for device in i.devices)),
            )
            for i in chain.interfaces
        ],
        "Interfaces",
    )


def _stages(device: Device) -> str:
    return "; ".join(f"{s.name} ({s.limit / MM:g})" if s.limit < np.inf else s.name for s in device.stages)


def _devices(interface: Interface) -> str:
    names = [device.name for device in interface.devices]
    return f"2 x {names[0]}" if len(names) == 2 and names[0] == names[1] else " + ".join(names)


def convergence(found: Convergence) -> Iterator[Table]:
    """What halving the step changes: in all strokes, in each response, and how far off the first step is."""
    steps, own = found.step_ms, f"{found.step_ms[0]:g} ms"
    yield Table(
        [Column("Step", "ms", "g"), Column("largest stroke change", "mm", 3), Column("energy balance", digits=".0e")],
        [
            (step, change, summary.balance.energy_error)
            for step, change, summary in zip(steps, found.stroke_changes_mm, found.summaries, strict=True)
        ],
        "The step, halved until the responses settle",
        "Strokes against those of the smallest step.",
    )
    halvings = [Column(f"at {step:g} ms", "%", "+.4f", head=f"at\n{step:g} ms") for step in steps[1:]]
    yield Table(
        [*worded("Response"), Column(f"at {own}", head=f"at\n{own}"), *halvings],
        [
            (
                column.title,
                f"{values[0]:.7g} {column.unit}",
                *(_change(before, now) for before, now in pairwise(values)),
            )
            for column, values in zip(found.columns.values(), found.values.values(), strict=True)
        ],
        "What each halving changes",
    )
    yield Table(
        [
            *worded("Response"),
            Column("value"),
            Column("order", digits=1),
            Column("known within", "%", ".1g"),
            Column(f"error at {own}", "%", ".2g", head=f"error at\n{own}"),
        ],
        [
            (found.columns[name].title, f"{e.value:.6g} {e.unit}", e.order, 100 * e.doubt, 100 * e.error)
            for name, e in found.estimates.items()
        ],
        "In the limit of small steps",
        "Extrapolated if the last halvings follow an order of convergence; otherwise the value at the smallest step.",
    )


def _change(before: float, now: float) -> float | None:
    """Relative change [%]; none from 0 to something else."""
    if before == now:
        return 0.0
    return 100 * (now / before - 1) if before else None
