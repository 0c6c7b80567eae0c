"""The tables of one collision, each told once for terminal and page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import compress, pairwise
from typing import TYPE_CHECKING, Any

from trainmj.collision.body import Body, nearest
from trainmj.collision.chain import Chain, Interface, Vehicle, names_in_runs, order_of_vehicles
from trainmj.collision.device import CAR_BODY
from trainmj.collision.fields import LASTING
from trainmj.collision.limits import Criterion
from trainmj.collision.measured import MOMENTUM, MOMENTUM_IN_PLANE, UNSTABLE
from trainmj.collision.quantities import (
    BALANCE,
    BODY,
    DECELERATION,
    INTERFACE,
    MEMBER,
    STAGE,
    UPRIGHT,
    Quantity,
    of_occupants,
    of_vehicles,
)
from trainmj.collision.records import InterfaceMetrics, StageUse
from trainmj.collision.result import Result
from trainmj.collision.stability import largest_step
from trainmj.collision.status import Kind
from trainmj.collision.summary import Summary
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.units import KM_H, KN, KN_PER_MM, MS, TONNE, against

if TYPE_CHECKING:
    from trainmj.collision.convergence import Convergence

_SEEN = 5e-4  # g: half a digit of the table
_INDENT = "\u00a0\u00a0"  # before what is part of the row above
_YIELDED = 0.05  # mm: plastic shortening of a member that is told
_MOST_MEMBERS = 8  # of a body, that are told
_ALWAYS = ("kinetic_start_kJ", "kinetic_end_kJ", "elastic_kJ", "absorbed_kJ", "friction_kJ")
_PARTS = ("crushed_kJ", "frictional_kJ", "viscous_kJ")
"""Rows of the balance that are always there, and those of what is absorbed, if it is more than one."""


def outcome(kind: Kind) -> Verdict:
    """The way in which a collision ended, as a verdict."""
    if kind is Kind.OVER:
        return passed(kind)
    return (warned if kind in (Kind.NO_CONTACT, Kind.TIME_LIMIT) else failed)(kind)


def why_not_valid(summary: Summary) -> str:
    """Why numbers are not valid, which ones, and the cure."""
    ended = dict.fromkeys(
        f"{'the draw gear of ' if i.drawn_out else ''}{i.device} at {i.name}"
        for i in summary.interfaces
        if i.beyond_curve
    )
    bodies = ", ".join(v.name for v in summary.vehicles if v.used_up)
    cures = []
    if ended:
        cures.append("a longer curve, or beyond: car_body, stop or hold")
    if any(i.drawn_out for i in summary.interfaces):
        cures.append("for draw gear a longer curve")
    if bodies:
        cures.append("more hardening_kN_per_mm or collapse_force_kN of the body, or fewer members")
    slid = [f"{i.name} {one}" for i in summary.interfaces for one in i.slid]
    if slid:
        cures.append("faces of more overlap, a stronger tie, or couplers that swing less")
    what = [f"the curve of {', '.join(ended)} ended"] if ended else []
    what += [f"a member of the body of {bodies} was shortened by its whole length"] if bodies else []
    held = "From then on its last force is only held, and " if what else "From then on "
    what += ["nothing is stated behind it"] if what else []
    what = [f"override at {', '.join(slid)}, and how one vehicle climbs the other is not computed", *what][not slid :]
    return (
        f"{', and '.join(what)}. {held}no force, stroke, acceleration, speed or energy is valid; nor is any number "
        f"that depends on them. Cure: {'; '.join(cures)}."
    )


def limits(criteria: Sequence[Criterion]) -> Table:
    """The limits of the scenario beside what was found."""
    heads = [*worded("Limit", "at"), Column("found"), Column("allowed"), Column("used", "%"), *worded("verdict")]
    rows = [
        (
            c.title,
            c.where,
            f"{c.text} {c.unit}",
            f"{c.limit:.12g} {c.unit}",
            against(c.used, 100, 0),
            judged(c.kept) if c.valid else failed("not valid"),
        )
        for c in criteria
    ]
    titles: dict[str, list[str]] = {}
    for c in criteria:
        titles.setdefault(c.source, []).append(c.title)
    said = [f"{', '.join(of)}: {source}" for source, of in titles.items() if source]
    return Table(heads, rows, note=f"Where limits come from. {'. '.join(said)}." if said else "")


def interfaces(summary: Summary) -> Table:
    """Every interface and the stages of its devices, from the front backwards, the moving train first."""
    rows: list[tuple[Any, ...]] = []
    draws = any(i.draws for i in summary.interfaces)
    shown = [q for q in INTERFACE if q.name != "peak_pull_kN" or draws]
    cells: dict[str, Any]
    for i in summary.interfaces:
        used = _used(i)
        stages = used if len(used) > 1 else ()
        own = used[0].limit_mm if len(used) == 1 else None
        cells = {**i.values, "stroke_mm": STAGE.text(i.stroke_mm, own)}
        rows.append((i.name, i.device, *(cells[q.name] for q in shown), _end(i)))
        for s in stages:
            cells = {"stroke_mm": STAGE.text(s.stroke_mm, s.limit_mm), "energy_kJ": s.energy_kJ}
            rows.append((f"{_INDENT}{s.name}", "", *(cells.get(q.name, "") for q in shown), _limit(s, i.judged)))
    heads = [*worded("Interface", "device"), *columns_for(shown), Column("limit", "mm", text=True)]
    if not any(row[-1] for row in rows):  # nothing states a limit
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    table = Table(
        heads,
        rows,
        "Interfaces",
        "At the front: one train's side. From the front backwards, the moving train first.",
    )
    return table.marked(summary.not_valid)


def _end(interface: InterfaceMetrics) -> Verdict | str:
    """Whether the curve or the only stage's limit was passed; the limits of several stages stand in their rows."""
    if interface.beyond_curve:
        return failed("curve ended")
    used = _used(interface)
    return _limit(used[0], interface.judged) if len(used) == 1 else ""


def _used(interface: InterfaceMetrics) -> tuple[StageUse, ...]:
    """Its stages, without a car body that nothing reached."""
    return tuple(stage for stage in interface.stages if stage.name != CAR_BODY or stage.stroke_mm > 0.0)


def _limit(stage: StageUse, under_test: bool) -> Verdict | str:
    """How a stage stands to its limit; only said, not judged, of a partner that is not under test."""
    if stage.limit_mm is None and not stage.collapsed:
        return ""
    bad = stage.collapsed or stage.exhausted
    text = "crushed" if stage.limit_mm is None else f"{'>' if stage.exhausted else '≤'} {stage.limit_mm:.12g}"
    return judged(not bad, text, text) if under_test else text


def vehicles(chain: Chain, summary: Summary) -> Iterator[Table]:
    """The vehicles from the front backwards, the moving train first; their mean decelerations; occupants, if any."""
    occupants = of_occupants(chain)
    own = [q for q in of_vehicles(chain) if q not in (*occupants, *BODY, *UPRIGHT, *DECELERATION)]
    note = (
        "Peaks are from every step: by the devices alone, and by all forces; CFC 60 is the filter of SAE J211. Balance "
        "time: when the interface on the side of the impact had its largest stroke."
    )
    if any(v.cfc60_peak_g - v.peak_acceleration_g > _SEEN for v in summary.vehicles):
        note += " A CFC 60 peak above the total peak is the filter's overshoot, no acceleration that was there."
    yield _of_vehicles(summary, "Vehicles", own, note, own)
    note = (
        "Contact windows: from when the net force of the devices on a vehicle, away from the impact, exceeds "
        f"{chain.contact_threshold / KN:g} kN until it falls to it. Their means are by the devices alone; the worst is "
        f"of those that last at least {LASTING / MS:g} ms. At the front: from the first to the last force there. That, "
        "and the largest means over 30, 100 and 120 ms, are by all forces."
    )
    yield _of_vehicles(summary, "Mean decelerations", DECELERATION, note, DECELERATION)
    if occupants:
        note = (
            "SIV: secondary impact velocity, of an occupant who keeps the first speed of the vehicle, against the "
            "vehicle, after a flight of so far in it, forwards or backwards; 0 and no time if it never is so far."
        )
        yield _of_vehicles(summary, "Occupants", occupants, note, [q for q in occupants if q.unit == "m/s"])


def _of_vehicles(
    summary: Summary, title: str, quantities: Sequence[Quantity], note: str, needed: Sequence[Quantity]
) -> Table:
    """Some quantities of every vehicle; those that are needed are missed if they are no numbers."""
    if any(math.isnan(v.values[q.name]) for v in summary.vehicles for q in needed):
        note += " Missing values need records closer together (record_every_ms), or a collision that is not cut off."
    table = Table(
        [*worded("Vehicle", "type"), *columns_for(quantities)],
        [(v.name, v.kind, *(v.values[q.name] for q in quantities)) for v in summary.vehicles],
        title,
        note,
    )
    return table.marked(summary.not_valid)


def contacts(summary: Summary) -> Table | None:
    """The contact windows of the vehicles that have several; None if none has."""
    rows: list[tuple[Any, ...]] = []
    for v in summary.vehicles:
        for k, w in enumerate(v.contacts if len(v.contacts) > 1 else ()):
            length, end = (w.end_s - w.start_s) / MS, warned("cut off") if w.cut else ""
            rows.append(("" if k else v.name, w.start_s, w.end_s, length, w.mean_g, end))
    heads = [*worded("Vehicle"), Column("from", "s", 4), Column("to", "s", 4), Column("length", "ms", 1)]
    heads += [Column("mean", "g", 3), Column("end", text=True)]
    note = "Of vehicles with several windows; cut off where the run ended before the window."
    table = Table(heads, rows, "Contact windows", note)
    return table.marked(summary.not_valid) if rows else None


def bodies(chain: Chain, summary: Summary) -> Table:
    """Every body that gives, and below it those of its members that have yielded."""
    of = {q.key: q for q in MEMBER}
    force = of["peak_force"]
    rows: list[tuple[Any, ...]] = []
    for i, v in zip(order_of_vehicles(chain), summary.vehicles, strict=True):
        body = chain.vehicles[i].body
        if body is None:
            continue
        members = v.members[: body.n_members]  # behind them there are the links of bogies
        most = max(member.values[force.name] for member in members)
        rows.append((v.name, *(v.values[q.name] for q in BODY[:3]), most, *(v.values[q.name] for q in BODY[3:])))
        yielded = [m for m in members if abs(m.values[of["plastic"].name]) >= _YIELDED]
        for m in yielded[:_MOST_MEMBERS] if len(members) > 1 else ():
            shortening, plastic, peak, lost = (m.values[q.name] for q in MEMBER)
            name = m.name.removeprefix(f"{v.name} ")
            rows.append((f"{_INDENT}{name}", shortening, plastic, "", peak, "", lost))
        if yielded[_MOST_MEMBERS:]:
            rows.append((f"{_INDENT}{len(yielded) - _MOST_MEMBERS} more", *[""] * 6))
    table = Table(
        [*worded("Body"), *columns_for((*BODY[:3], force, *BODY[3:]))],
        rows,
        "Bodies that give",
        "Below a body the members that have yielded, from the end that faces the impact. Plastic in 5 m is a proxy of "
        "survival space, no measure of it. Body peak: at any of its points, by all forces, not filtered; at an end it "
        "grows with the number of members.",
    )
    return table.marked(summary.not_valid)


def columns_for(quantities: Iterable[Quantity]) -> list[Column]:
    """Heads of quantities in a table."""
    return [
        Column(q.heading.replace("\n", " "), q.unit, q.digits if q.digits >= 0 else f".{-q.digits}g", head=q.heading)
        for q in quantities
    ]


def energy(summary: Summary) -> Table:
    """Where the kinetic energy went; what no device or vehicle of the collision has is left out."""
    values = summary.balance.values
    start = values["kinetic_start_kJ"]
    several = sum(values[name] != 0.0 for name in _PARTS) > 1
    rows = [
        (f"{_INDENT * (q.name in _PARTS)}{q.heading}", values[q.name], 100 * values[q.name] / start)
        for q in BALANCE
        if q.name in values
        and q.unit == "kJ"
        and (q.name in _ALWAYS or (values[q.name] != 0.0 and (several or q.name not in _PARTS)))
    ]
    table = Table([*worded("Energy"), Column("", "kJ", 1), Column("share", "%", 2)], rows)
    return table.marked(summary.not_valid)


def checks(result: Result, summary: Summary) -> Table:
    """What must hold for the numbers to be trusted."""
    b, chain = summary.balance, result.chain
    step, largest = chain.step / MS, largest_step(chain) / MS
    errors = (
        ("energy balance", b.energy_error, UNSTABLE),
        ("absorbed energy, against the curves", b.curve_error, UNSTABLE),
        ("momentum balance", b.momentum_error, MOMENTUM_IN_PLANE if chain.plane else MOMENTUM),
    )
    stable, end, last = f"{against(largest, step, -3)} ms", summary.duration_s, chain.time_limit
    valid = min(result.tally.valid_until, end)
    made = "" if chain.integrator == "euler" else f" ({chain.integrator})"
    rows = [
        *((name, against(abs(e), most, -2), f"{most:.0e}", judged(abs(e) <= most)) for name, e, most in errors),
        (f"step{made}, against the largest stable one", f"{step:.12g} ms", stable, judged(step <= largest)),
        ("valid until, of the time simulated", f"{valid:.4g} s", f"{end:.4g} s", judged(not summary.not_valid)),
        ("end, before the time limit", f"{end:.3f} s", f"{last:g} s", judged(result.tally.over)),
    ]
    return Table(
        [*worded("Check"), Column("found"), Column("allowed"), *worded("verdict")],
        rows,
        note="Energy relative to what the collision can convert, momentum to the sum of |m v| at the start. Curves: "
        "absorbed energy against the area below each one.",
    )


def vehicles_of(chain: Chain) -> Table:
    """The vehicles as they stand along the track, with what holds them there."""
    measures = [("mass", "t"), ("length", "m"), ("speed", "km/h"), ("rail friction", "")]
    braked = any(v.brake for v in chain.vehicles)
    if braked:
        measures += [("brake force", "kN"), ("brake after", "s"), ("brake rise", "s"), ("adhesion", "kN")]

    def brake(v: Vehicle) -> tuple[float | None, ...]:
        b = v.brake
        return (None,) * 4 if b is None else (b.force / KN, b.delay, b.rise, b.most / KN)

    return Table(
        [*worded("Vehicle", "type"), *(Column(name, unit, ".6g") for name, unit in measures)],
        [
            (v.name, v.kind, v.mass / TONNE, v.length, v.speed / KM_H, v.rail_friction, *(brake(v) if braked else ()))
            for v in chain.vehicles
        ],
        "Vehicles along the track",
    )


def bodies_of(chain: Chain) -> Table:
    """The bodies that give, those that are alike in one row."""
    names: dict[tuple[Any, ...], list[str]] = {}
    for i in order_of_vehicles(chain):
        v, facing = chain.vehicles[i], chain.facing(i)
        if v.body is None:
            continue
        b, own = v.body, v.body.own(v.mass)
        at = [nearest(b, v.length, v.length - a if end else a) for end, a in enumerate(b.attached)]
        inward = [v.length * n / b.n_members for n in (at[0], b.n_members - at[1])]
        numbers = (
            b.stiffness / KN_PER_MM,
            b.frequency(own),
            0.5 * math.sqrt(b.stiffness / own),
            b.collapse / KN,
            b.hardening / KN_PER_MM if b.collapse < math.inf else None,
            b.damping_ratio,
        )
        row = (b.n_members, *numbers, ", ".join(f"{inward[end]:.4g}" for end in (facing, 1 - facing)), _bogies(b))
        names.setdefault(row, []).append(v.name)
    heads = [
        Column("Body", text=True),
        Column("members", digits=0),
        Column("stiffness EA / L", "kN/mm", ".5g", head="EA / L"),
        Column("first mode", "Hz", ".4g"),
        Column("first mode of a bar", "Hz", ".4g", head="of a\nbar"),
        Column("collapse force", "kN", ".6g"),
        Column("hardening", "kN/mm", ".4g"),
        Column("damping ratio"),
        Column("devices at", "m", text=True, head="devices\nat"),
        Column("bogies", text=True),
    ]
    rows = [(names_in_runs(of), *row) for row, of in names.items()]
    note = "First axial mode of the free body without bogies: of its members, and of a uniform bar."
    inner = any(v.body and any(v.body.attached) for v in chain.vehicles)
    if inner:
        note += (
            " Devices are attached at the points nearest to where they are stated to be, here from the end that faces "
            "the impact, and from the other one."
        )
    shown = [True] * (len(heads) - 2) + [inner, any(v.body and v.body.bogies for v in chain.vehicles)]
    return Table(list(compress(heads, shown)), [tuple(compress(row, shown)) for row in rows], "Bodies that give", note)


def _bogies(body: Body) -> str:
    b = body.bogies
    return f"2 x {b.mass / TONNE:.4g} t, {b.centres:.4g} m, {b.stiffness / KN_PER_MM:.4g} kN/mm" if b else "-"


def interfaces_of(chain: Chain) -> Table:
    """The devices along the track, a row for each end that is reported."""
    rows = [row for interface in chain.interfaces for row in _devices(interface)]
    return Table(worded("Interface", "device"), rows, "Interfaces")


def _devices(interface: Interface) -> Iterator[tuple[str, str]]:
    """The ends of an interface that are reported, each with its device; two devices where both sides are one."""
    names = [device.name for device in interface.devices]
    if interface.ends:
        yield from zip(interface.ends, names, strict=True)
    else:
        yield interface.name, f"2 x {names[0]}" if len(names) == 2 and names[0] == names[1] else " + ".join(names)


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
