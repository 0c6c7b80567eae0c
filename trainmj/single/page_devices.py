"""Devices with their curves, and the path that each collision took on them."""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel

from trainmj.collision.chain import Chain, Interface
from trainmj.collision.device import Array, Device
from trainmj.collision.result import Result
from trainmj.output.blocks import Section
from trainmj.output.plot import COLOURS, Trace, axes, line
from trainmj.scenario.parts import Curve, DeviceSpec, StagedDevice
from trainmj.single.page_histories import MOST_LINES
from trainmj.units import KJ, KN, MM, head, unit_of

_MOST_POINTS = 1500  # of a path


def add_devices(section: Section, result: Result) -> None:
    """Put each device's curve, and the paths taken on it, into a section."""
    chain = result.chain
    section.text(
        "Grey: the envelope, along which a device crushes. In colour: stroke and force as they were, from "
        f"every record ({1e3 * chain.step * chain.steps_per_record:.3g} ms); what is shorter, such as a shear-off, may "
        "lie between two of them. Paths of the partner: click their names."
    )
    users = _users(chain)
    for name, places in users.items():
        section.plot(
            [_envelope(result, places), *_paths(result, places)],
            axes("Stroke", "mm", "Force", "kN"),
            title=f"Device {name}",
            note=_words(result.scenario.devices[name], places),
            height=420,
            half=True,
        )
    unused = [name for name in result.scenario.devices if name not in users]
    if unused:
        section.text(f"Devices of the scenario that this collision does not use: {', '.join(unused)}.")


Place = tuple[Interface, int, int]
"""An interface, its index, and which of its sides a device stands at."""


def _users(chain: Chain) -> dict[str, list[Place]]:
    """Where each device stands, the front first; of two equal ones at the front one stands for both."""
    found: dict[str, list[Place]] = {}
    n = len(chain.interfaces)
    order = [*range(chain.front, -1, -1), *range(chain.front + 1, n)]
    for k in order:
        interface = chain.interfaces[k]
        sides = 1 if interface.equal_sides else len(interface.devices)
        for side in range(sides):
            found.setdefault(interface.devices[side].name, []).append((interface, k, side))
    return found


def _envelope(result: Result, places: list[Place]) -> Trace:
    """The curve, cut where nothing happens any more: a bit beyond the largest stroke and the limits."""
    device = _device(places[0])
    e = device.envelope
    reached = max(_largest(result, place) for place in places)
    limits = [s.start + s.limit for s in device.stages if np.isfinite(s.limit)]
    last = max(1.15 * max([reached, *limits]), float(e.stroke[1]))
    inner = e.stroke < last
    u = np.append(e.stroke[inner], last)
    f = np.append(e.force[inner], e.force_at(last))
    return line("envelope", u / MM, f / KN, "kN", "#b4bac4", width=4, mode="lines")


def _device(place: Place) -> Device:
    interface, _, side = place
    return interface.devices[side]


def _largest(result: Result, place: Place) -> float:
    interface, k, side = place
    return interface.side_stroke(max(0.0, float(result.tally.stroke_max[k])), side)


def _paths(result: Result, places: list[Place]) -> list[Trace]:
    """Force over stroke at each place, those nearest to the front; the partner's wait in the legend."""
    traces = []
    for n, (interface, k, side) in enumerate(places[: 2 * MOST_LINES]):
        stroke, force = _path(result, interface, k, side)
        partner = " partner" if side else ""
        more: Trace = {"visible": "legendonly"} if k > result.chain.front else {}
        traces.append(line(interface.name + partner, stroke, force, "kN", COLOURS[n % len(COLOURS)], width=1.3, **more))
    return traces


def _path(result: Result, interface: Interface, k: int, side: int) -> tuple[Array, Array]:
    """Strokes [mm] and forces [kN] of one side while the interface is pressed."""
    u, f = result.stroke[:, k], result.force[:, k]
    moved = np.append(True, np.hypot(np.diff(u) / 1e-5, np.diff(f) / 10.0) > 1.0)  # more than 0.01 mm or 10 N
    rows = np.flatnonzero((u > 0.0) & moved)
    rows = rows[:: -(-max(1, rows.size) // _MOST_POINTS)]
    stroke = np.array([interface.side_stroke(float(x), side) for x in u[rows]])
    return stroke / MM, f[rows] / KN


def _words(spec: DeviceSpec, places: list[Place]) -> str:
    """Constants, stages with their limits, and where the device stands."""
    parts = []
    if isinstance(spec, StagedDevice):
        parts += [f"{name}: {_values(stage)}" for name, stage in spec.stages.items() if _values(stage)]
    parts += [_values(spec)]
    last = _device(places[0]).stages[-1]
    if np.isfinite(last.limit):
        parts.append(f"{_device(places[0]).envelope.energy(last.start + last.limit) / KJ:.1f} kJ up to the last limit")
    parts.append("at " + ", ".join(i.name for i, _, _ in places[:4]) + (" and more" if len(places) > 4 else ""))
    return "; ".join(parts) + "."


def _values(part: BaseModel) -> str:
    """The plain values of a part of a scenario, with their units: "unloading stiffness 357 kN/mm"."""
    said = []
    for key, value in part:
        if isinstance(value, BaseModel) and not isinstance(value, Curve):
            said.append(f"{key.replace('_', ' ')} {_values(value)}")
        elif isinstance(value, (int, float)) and not isinstance(value, bool) and value:
            unit = unit_of(key)
            said.append(f"{_without_unit(key, unit)} {value:g} {unit}".rstrip())
    return ", ".join(said)


def _without_unit(key: str, unit: str) -> str:
    return key.removesuffix(head("", unit)).replace("_", " ")
