"""Devices with the force over their stroke, and the path that the collision took on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import BaseModel

from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.output.blocks import Section
from trainmj.output.plot import GREY, Trace, axes, line, named_upright, upright
from trainmj.output.style import PALETTE
from trainmj.scenario.curves import Curve
from trainmj.scenario.devices import DEVICE, AnyDevice, StagedDevice
from trainmj.scenario.lines import AnyLine
from trainmj.single.devices import Drawn, Place, as_built, curves, pulled, table, users
from trainmj.single.page_histories import MOST_LINES
from trainmj.units import KJ, KN, MM, MS, readable, unit_of, words

_MOST_POINTS = 1500  # of a path
_LIGHT, _DARK = "#b4bac4", "#7a808a"


def add_devices(section: Section, result: Result) -> None:
    """Put each device, its force over its stroke and the paths taken on it, into a section."""
    chain = result.chain
    used = users(chain, result.scenario.as_built)
    section.table(table(result.scenario, chain))
    if result.scenario.as_built:
        section.table(as_built(result.scenario))
        section.text("A device that differs as built follows a curve of its own, not the grey one of its kind.")
    section.text(
        "Grey: force over stroke of a new device, pressed (solid) and let go (dotted) at rest; darker, where the force "
        "depends on the rate, at the largest rate that it sees as the sides close. In colour: stroke and force of the "
        f"collision, one point for every record ({chain.record_interval / MS:.3g} ms); a shorter event, such as a "
        "shear-off, may fall between two of them. Negative: force and extension of an interface that is pulled. Paths "
        "of the partner: click their names."
    )
    if result.not_valid:
        section.text(f"Dotted paths: {result.not_valid}.")
    for name, places in used.items():
        section.plot(
            [*_curves(result, places), *_paths(result, places)],
            axes("Stroke", "mm", "Force", "kN", **_limits(places)),
            title=f"Device {name}",
            note=_words(result.scenario.devices[name], places),
            height=420,
            half=True,
        )
    unused = [name for name in result.scenario.devices if name not in used]
    if unused:
        section.text(f"Devices of the scenario that this collision does not use: {', '.join(unused)}.")


def _limits(places: list[Place]) -> dict[str, Any]:
    """Entries of a layout that show at which strokes of a device its stages reach their limits."""
    found = {
        f"limit{'' if stage.name == DEVICE else f' of {stage.name}'}": (stage.start + stage.limit) / MM
        for stage in places[0].device.stages
        if np.isfinite(stage.limit)
    }
    names = [named_upright(at, name) for name, at in found.items()]
    return {"shapes": [upright(at) for at in found.values()], "annotations": names} if found else {}


def _curves(result: Result, places: list[Place]) -> list[Trace]:
    """Force over stroke up to a little beyond the largest stroke, in and out, and of the draw gear."""
    _, strokes, _ = (np.concatenate(values) for values in zip(*(_path(result, p) for p in places), strict=True))
    reached, out = (float(way.max(initial=0.0)) * MM for way in (strokes, -strokes))
    drawn = list(curves(result.chain, places, reached))
    drawn += [pulled(place.interface, out) for place in places if place.device.pull and place.interface.draws][:1]
    return [trace for one in drawn for trace in _both_ways(one)]


def _both_ways(drawn: Drawn) -> list[Trace]:
    """Pressed, and let go again."""
    colour = _DARK if drawn.name.startswith("at ") and drawn.name != "at rest" else _LIGHT
    (u, f), (back, falling) = drawn.parts
    return [
        line(drawn.name, u, f, "kN", colour, width=4, mode="lines"),
        line(f"{drawn.name}, let go", back, falling, "kN", colour, width=2, line={"dash": "dot"}, showlegend=False),
    ]


def _stroke(result: Result, place: Place) -> Array:
    """(n_sample,) stroke of a device; negative, that of its interface where its draw gear is pulled [m]."""
    whole = result.stroke[:, place.index]
    own = result.of_device("stroke", place.index, place.side)
    return np.where(whole < 0.0, whole if place.device.pull else 0.0, own)


def _path(result: Result, place: Place) -> tuple[Array, Array, Array]:
    """Times [s], strokes [mm] and forces [kN] while a device carries force."""
    u, f = _stroke(result, place), result.force[:, place.index]
    moved = np.append(True, np.hypot(np.diff(u) / 1e-5, np.diff(f) / 10.0) > 1.0)  # more than 0.01 mm or 10 N
    rows = np.flatnonzero(((u > 0.0) | ((f < 0.0) & (u < 0.0))) & moved)
    rows = rows[:: -(-max(1, rows.size) // _MOST_POINTS)]
    return result.time[rows], u[rows] / MM, f[rows] / KN


def _paths(result: Result, places: list[Place]) -> list[Trace]:
    """Force over stroke at the places nearest to the front; those of the partner are hidden at first."""
    traces, until = [], result.tally.valid_until
    for n, place in enumerate(places[: 2 * MOST_LINES]):
        more: Trace = {"visible": "legendonly"} if place.index > result.chain.front else {}
        time, u, f = _path(result, place)
        valid, colour = time <= until, PALETTE[n % len(PALETTE)]
        traces.append(line(place.name, u[valid], f[valid], "kN", colour, width=1.3, **more))
        if not valid.all():
            name = f"{place.name}, {result.not_valid}"
            traces.append(line(name, u[~valid], f[~valid], "kN", GREY, width=1.3, line={"dash": "dot"}, **more))
    return traces


def _words(spec: AnyDevice, places: list[Place]) -> str:
    """Constants, stages with their limits, and where the device stands."""
    parts = []
    if isinstance(spec, StagedDevice):
        parts += [f"{name}: {_values(stage)}" for name, stage in spec.stages.items() if _values(stage)]
    parts += [_values(spec)]
    device = places[0].device
    limited = [s.start + s.limit for s in device.stages if np.isfinite(s.limit)]
    if limited:
        parts.append(f"{readable(device.envelope.energy(limited[-1]) / KJ, 1)} kJ at rest up to the last limit")
    parts.append("at " + ", ".join(p.name for p in places[:4]) + (" and more" if len(places) > 4 else ""))
    return "; ".join(filter(None, parts)) + "."


def _values(part: BaseModel) -> str:
    """The plain values of a part of a scenario, with their units: "unloading stiffness 357 kN/mm".

    Lines have a table of their own, in the vertical plane.
    """
    said = []
    for key, value in part:
        if isinstance(value, BaseModel) and not isinstance(value, Curve | AnyLine) and (inner := _values(value)):
            said.append(f"{words(key)} {inner}")
        elif isinstance(value, (int, float)) and not isinstance(value, bool) and value:
            said.append(f"{words(key)} {value:g} {unit_of(key)}".rstrip())
    return ", ".join(said)
