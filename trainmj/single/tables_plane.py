"""The tables of one collision in the vertical plane, each told once for terminal and page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trainmj.collision.chain import WALL, Chain, names_in_runs, order_of_vehicles
from trainmj.collision.line import LineEnd
from trainmj.collision.margin import MOST, Margin
from trainmj.collision.quantities import ENDS, UPRIGHT, WHEELSET, Quantity, of_train
from trainmj.collision.records import FaceUse
from trainmj.collision.status import Kind
from trainmj.collision.summary import Summary
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, worded
from trainmj.single.devices import Place, users
from trainmj.single.plane import listed, mm
from trainmj.single.tables import columns_for, outcome
from trainmj.units import KN, KN_PER_MM, MM, MN_M, MRAD, TONNE

_MET = "met_step_mm"

BRACKETED = ("largest_step_mm", _MET, "slip_mm", "largest_wheel_lift_mm", "least_wheel_load", "TS_mm", "TAMA_g")
"""What the table of a bracket shows."""


def in_plane(summary: Summary) -> Iterator[Table]:
    """Faces that met, what happened between ends, and vehicles; the front first, then backwards, moving train first."""
    if any(i.faces for i in summary.interfaces):
        yield _faces(summary).marked(summary.not_valid)
    yield _ends(summary).marked(summary.not_valid)
    yield _upright(summary).marked(summary.not_valid)


def _faces(summary: Summary) -> Table:
    rows: list[tuple[Any, ...]] = [
        (i.name, face.name, face.overlap_mm, face.met_step_mm, face.used, _met(face))
        for i in summary.interfaces
        for face in i.faces
        if face.met_step_mm is not None
    ]
    apart = sum(face.met_step_mm is None for i in summary.interfaces for face in i.faces)
    rows += [(f"{apart} more", "", None, None, None, "did not meet")] if apart else []
    heads = [
        *worded("Interface", "faces of"),
        Column("overlap", "mm", ".6g"),
        Column("step as they met", "mm", 1, head="step as\nthey met"),
        Column("used", "%", 0),
        *worded("verdict"),
    ]
    note = (
        "Step as they met: that of the two faces when they first carried force. One that is past the overlap while "
        "they carry force is an override, and what comes later is not valid."
    )
    return Table(heads, rows, "Faces", note)


def _met(face: FaceUse) -> Verdict:
    if face.off_s is not None:
        return failed(f"slid off at {face.off_s:.4g} s")
    return passed("held")


def _ends(summary: Summary) -> Table:
    shown = [q for q in ENDS if q.name != _MET]
    rows = [(i.name, *(i.values[q.name] for q in shown)) for i in summary.interfaces]
    note = (
        "Step: difference in height of the two ends, each against its design height, while a device between them "
        "carries force. Tie force: a stiff tie has a high one before it slips, so that it is no margin; trainmj run "
        "--margin finds one."
    )
    return Table([*worded("Interface"), *columns_for(shown)], rows, "Steps between ends", note)


def _upright(summary: Summary) -> Table:
    note = (
        "Pitch is positive with the end that faces the impact up. N/N0 is the load of a wheelset over that at rest, "
        "here the least of the vehicle: it falls smoothly until it is 0. Lift is 0 until then and jumps from there: "
        "N/N0 says how near it is, lift how far it went."
    )
    rows = [(v.name, v.kind, *(v.values[q.name] for q in UPRIGHT)) for v in summary.vehicles]
    return Table([*worded("Vehicle", "type"), *columns_for(UPRIGHT)], rows, "In the vertical plane", note)


def wheelsets(summary: Summary) -> Table:
    """Every wheelset, from the end of its vehicle that faces the impact."""
    rows = [(w.name, *(w.values[q.name] for q in WHEELSET)) for v in summary.vehicles for w in v.wheelsets]
    note = "Counted in each vehicle from the end that faces the impact. At: when the lift was largest."
    return Table([*worded("Wheelset"), *columns_for(WHEELSET)], rows, "Wheelsets", note).marked(summary.not_valid)


def gear_of(chain: Chain) -> Table:
    """What vehicles stand on, with their natural frequencies, those that are alike in one row."""
    names: dict[tuple[Any, ...], list[str]] = {}
    for i in order_of_vehicles(chain):
        gear = chain.vehicles[i].gear
        if gear is not None:
            measures = (gear.body_mass / TONNE, gear.body_inertia / TONNE, gear.cog_height)
            row = (*measures, gear.offset / MM, gear.pitch / MRAD * (1 if chain.facing(i) else -1))
            names.setdefault((*row, *gear.frequencies.values()), []).append(chain.vehicles[i].name)
    heads = [
        *worded("Vehicles"),
        Column("body", "t", ".5g"),
        Column("pitch inertia", "t m2", ".5g"),
        Column("centre of gravity", "m", ".4g", head="height\nof cog"),
        Column("offset", "mm", ".4g"),
        Column("pitch", "mrad", ".4g"),
        *(Column(name, "Hz", ".3g") for name in ("heave", "pitch", "bogie bounce", "bogie pitch")),
    ]
    note = (
        "Offset and pitch: how they stand at the start. Frequencies are closed forms of a vehicle with its centre of "
        "gravity in the middle, at the height of the links: the body on both suspensions in series, and a bogie below "
        "a body at rest."
    )
    return Table(heads, [(names_in_runs(of), *row) for row, of in names.items()], "Running gear", note)


def lines_of(chain: Chain) -> Table:
    """The lines along which devices act, one for each path through a device; those of single ones as built apart."""
    rows = []
    for name in users(chain):
        alike: dict[tuple[LineEnd, ...], list[Place]] = {}
        for k, interface in enumerate(chain.interfaces):
            for side, device in enumerate(interface.devices):
                if device.name == name:
                    alike.setdefault(device.lines, []).append(Place(interface, k, side))
        for lines, places in alike.items():
            paths = places[0].interface.paths(places[0].side)
            at = f" at {listed(_stands(chain, place) for place in places)}" if len(alike) > 1 else ""
            for path, end in zip(paths, lines, strict=True):
                stage = f" {path.stages[0].name}" if len(paths) > 1 else ""
                rows.append((f"{name}{stage}{at}", *_line(end)))
    heads = [
        *worded("Line of", "acts as"),
        Column("height", "mm", ".6g"),
        Column("pin or overlap", "mm", ".6g", head="pin or\noverlap"),
        Column("swing stop, or tie", text=True),
    ]
    note = (
        "Height above the rail of a vehicle as designed. Pin: from there to the coupling face. A tie carries friction "
        "times the force of the device, and its teeth; of two that meet, the weaker one counts."
    )
    return Table(heads, rows, "Lines of devices", note)


def _stands(chain: Chain, place: Place) -> str:
    """Where a device stands: at an interface or, where both sides bring one, on a vehicle of it."""
    if not place.interface.two_sided:
        return place.interface.name
    vehicle = place.interface.right if place.side else place.interface.left
    return f"{place.interface.name} {'wall' if vehicle == WALL else chain.vehicles[vehicle].name}"


def _line(end: LineEnd) -> tuple[str, float | None, float | None, str]:
    if end.strut:
        swing = f"{end.swing / MN_M:g} MN m/rad from {end.free / MRAD:.6g} mrad" if end.swing else "none"
        return "strut", mm(end.height), mm(end.pin), swing
    if not end.tie:
        return "face", mm(end.height), mm(end.overlap), "none"
    most = "any force" if end.tooth == math.inf else f"friction {end.friction:g} + {end.tooth / KN:g} kN"
    return "face", mm(end.height), mm(end.overlap), f"{most}, {end.tie / KN_PER_MM:g} kN/mm"


def bracket(chain: Chain, rows: Sequence[Mapping[str, Any]]) -> Table:
    """The same collision with other ties, side by side; rows as of :func:`trainmj.collision.bracket.rows_of`."""
    quantities: dict[str, Quantity] = {q.name: q for q in of_train(chain)} | {q.name: q for q in ENDS}
    said = {_MET: f"step as faces met at {chain.interfaces[chain.front].name}", "slip_mm": "largest slip"}
    cells: list[tuple[Any, ...]] = []
    for name in BRACKETED:
        q = quantities[name]
        values = ("-" if row[name] is None else q.text(float(row[name])) for row in rows)
        cells.append((said.get(name, q.heading.replace("\n", " ")), q.unit, *values))
    cells.append(("limits kept", "", *map(_kept, rows)))
    if any(row["valid_until_s"] is not None for row in rows):
        until = (row["valid_until_s"] for row in rows)
        cells.append(("valid until", "s", *("the end" if t is None else failed(f"{t:.4g}") for t in until)))
    cells.append(("status", "", *(outcome(Kind(row["status"])) for row in rows)))
    reasons = [f"{row['ties']}: {ended(row)}." for row in rows if row["reason"]]
    note = " ".join(
        [
            "Free: nothing holds ends together vertically; stated: what the scenario states does; tied: ties of any "
            "strength, and swing stops without free angle.",
            *reasons,
        ]
    )
    heads = [*worded("Ties", "unit"), *(Column(str(row["ties"])) for row in rows)]
    return Table(heads, cells, "Bracket", note)


def ended(row: Mapping[str, Any]) -> str:
    """How a collision of a bracket ended, and why."""
    reason = str(row["reason"])
    return f"{row['status']}{' ' if reason.startswith('at ') else ': '}{reason}"


def _kept(row: Mapping[str, Any]) -> Verdict | str:
    kept, limits = int(row["limits_kept"]), int(row["limits"])
    return judged(kept == limits, f"{kept} of {limits}", f"{kept} of {limits}") if limits else "none stated"


def margins(found: Sequence[Margin]) -> Table:
    """What the ties of faces have to spare, or lack."""
    rows: list[tuple[Any, ...]] = [
        (
            m.interface,
            m.slip_as_stated_mm,
            "-" if m.factor == float("inf") else f"{m.factor:.3g}",
            judged(m.factor <= 1.0) if m.valid else failed("not valid"),
            m.said,
        )
        for m in found
    ]
    slip = f"{found[0].slip_mm:g} mm" if found else ""
    heads = [
        *worded("Interface"),
        Column("slip as stated", "mm", 2, head="slip as\nstated"),
        Column("factor"),
        *worded("verdict", "ties"),
    ]
    note = (
        f"Ties hold if no face slides off the other and engaged faces slip by no more than {slip}. Factor: on the "
        "capacity of the ties of the interface, friction and teeth together, below which they no longer hold, to 1 %; "
        f"up to {MOST:g} is tried. The peak force of a tie is no margin: it grows with its stiffness."
    )
    if not rows:
        return Table(worded("Interface", "ties"), [("none", "no faces engaged")], "Margins of ties")
    return Table(heads, rows, "Margins of ties", note)
