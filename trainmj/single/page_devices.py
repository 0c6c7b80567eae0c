"""Devices with their curves, and the path that the collision took on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel

from trainmj.collision.chain import Chain, Interface, name_of_side, places_of_sides
from trainmj.collision.device import Array, Device
from trainmj.collision.result import Result
from trainmj.output.blocks import Section
from trainmj.output.plot import Trace, axes, line
from trainmj.output.style import PALETTE
from trainmj.scenario.curves import Curve
from trainmj.scenario.devices import DeviceSpec, StagedDevice
from trainmj.single.page_histories import MOST_LINES
from trainmj.units import KJ, KN, MM, MS, unit_of, words

_MOST_POINTS = 1500  # of a path


def add_devices(section: Section, result: Result) -> None:
    """Put each device's curve, and the paths taken on it, into a section."""
    chain = result.chain
    section.text(
        "Grey: the envelope, along which a device crushes. In colour: stroke and force of the collision, one point for "
        f"every record ({chain.record_interval / MS:.3g} ms); a shorter event, such as a shear-off, may "
        "fall between two of them. Paths of the partner: click their names."
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


@dataclass(frozen=True)
class Place:
    """Where a device stands."""

    interface: Interface  # at which interface
    index: int  # of the interface
    side: int  # 0 on its left, 1 on its right

    @property
    def device(self) -> Device:
        """What stands there."""
        return self.interface.devices[self.side]

    def largest(self, result: Result) -> float:
        """Largest stroke [m]."""
        return self.interface.side_largest(max(0.0, float(result.tally.stroke_max[self.index])), self.side)

    def path(self, result: Result) -> tuple[Array, Array]:
        """Strokes [mm] and forces [kN] while the interface is pressed."""
        u, f = result.stroke[:, self.index], result.force[:, self.index]
        moved = np.append(True, np.hypot(np.diff(u) / 1e-5, np.diff(f) / 10.0) > 1.0)  # more than 0.01 mm or 10 N
        rows = np.flatnonzero((u > 0.0) & moved)
        rows = rows[:: -(-max(1, rows.size) // _MOST_POINTS)]
        return self.interface.side_history(u, self.side)[rows] / MM, f[rows] / KN


def _users(chain: Chain) -> dict[str, list[Place]]:
    """Where each device stands, the front first; if both sides of the front are equal, one stands for both."""
    found: dict[str, list[Place]] = {}
    for k, side in places_of_sides(chain):
        place = Place(chain.interfaces[k], k, side)
        found.setdefault(place.device.name, []).append(place)
    return found


def _envelope(result: Result, places: list[Place]) -> Trace:
    """The curve up to a little beyond the largest stroke and the limits."""
    device = places[0].device
    e = device.envelope
    reached = max(place.largest(result) for place in places)
    limits = [s.start + s.limit for s in device.stages if np.isfinite(s.limit)]
    last = max(1.15 * max([reached, *limits]), float(e.stroke[1]))
    inner = e.stroke < last
    u = np.append(e.stroke[inner], last)
    f = np.append(e.force[inner], e.force_at(last))
    return line("envelope", u / MM, f / KN, "kN", "#b4bac4", width=4, mode="lines")


def _paths(result: Result, places: list[Place]) -> list[Trace]:
    """Force over stroke at the places nearest to the front; those of the partner are hidden at first."""
    traces = []
    for n, place in enumerate(places[: 2 * MOST_LINES]):
        name = name_of_side(place.interface, place.side)
        more: Trace = {"visible": "legendonly"} if place.index > result.chain.front else {}
        traces.append(line(name, *place.path(result), "kN", PALETTE[n % len(PALETTE)], width=1.3, **more))
    return traces


def _words(spec: DeviceSpec, places: list[Place]) -> str:
    """Constants, stages with their limits, and where the device stands."""
    parts = []
    if isinstance(spec, StagedDevice):
        parts += [f"{name}: {_values(stage)}" for name, stage in spec.stages.items() if _values(stage)]
    parts += [_values(spec)]
    device = places[0].device
    last = device.stages[-1]
    if np.isfinite(last.limit):
        parts.append(f"{device.envelope.energy(last.start + last.limit) / KJ:.1f} kJ up to the last limit")
    parts.append("at " + ", ".join(p.interface.name for p in places[:4]) + (" and more" if len(places) > 4 else ""))
    return "; ".join(parts) + "."


def _values(part: BaseModel) -> str:
    """The plain values of a part of a scenario, with their units: "unloading stiffness 357 kN/mm"."""
    said = []
    for key, value in part:
        if isinstance(value, BaseModel) and not isinstance(value, Curve) and (inner := _values(value)):
            said.append(f"{words(key)} {inner}")
        elif isinstance(value, (int, float)) and not isinstance(value, bool) and value:
            said.append(f"{words(key)} {value:g} {unit_of(key)}".rstrip())
    return ", ".join(said)
