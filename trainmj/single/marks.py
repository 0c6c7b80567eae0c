"""The limits that belong into the pictures of a collision over time, one home for page and figure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trainmj.collision.chain import Chain, n_own_sides, places_of_sides
from trainmj.collision.device import Device
from trainmj.collision.quantities import columns_of, of_sides
from trainmj.collision.result import Result
from trainmj.scenario.devices import DEVICE
from trainmj.single.plane import listed
from trainmj.units import KN, MM

_LIMITED = {
    "stroke": ("stroke_mm",),
    "force": ("peak_force_kN",),
    "energy": ("energy_kJ",),
    "pitch": ("pitch_mrad",),
    "lift": ("wheel_lift_mm",),
    "acceleration": ("peak_acceleration_g", "peak_device_acceleration_g"),
}
"""Quantities that are the largest value of a history, in its unit, so that their limits are lines across it."""

_OF_BOTH_SIGNS = ("acceleration", "pitch")


class Mark(NamedTuple):
    """A limit, as a line across a history."""

    name: str
    value: float  # in the unit in which the history is shown
    both: bool = False  # whether it holds for both signs


def marks(result: Result, history: str) -> list[Mark]:
    """The limits of a history: those that the scenario states, stroke limits of devices, forces at which bodies give.

    Of devices those of the moving train; equal limits are one mark.
    """
    of_devices = {"stroke": _strokes, "force": _forces}.get(history)
    found: dict[tuple[float, str], list[str]] = {}
    for value, what, name in _stated(result.chain, history) + (of_devices(result) if of_devices else []):
        found.setdefault((value, what), []).append(name)
    return [
        Mark(f"{what} {listed(names)}".rstrip(), value, history in _OF_BOTH_SIGNS)
        for (value, what), names in sorted(found.items())
    ]


_Found = list[tuple[float, str, str]]
"""Values, what is limited by them, and of what."""


def _stated(chain: Chain, history: str) -> _Found:
    columns = columns_of(chain)
    found = []
    for name, limit in chain.limits.items():
        column = columns.get(name)
        quantity = name if column is None else column.quantity
        of_stage = column is not None and column.place[0] == 1 and column.place[-1] >= len(of_sides(chain))
        if quantity in _LIMITED.get(history, ()) and not of_stage:
            title = quantity.rpartition("_")[0].replace("_", " ") if column is None else column.title
            found.append((float(limit), "limit of", title))
    return found


def _strokes(result: Result) -> _Found:
    """Where a stage reaches its limit, as the stroke of its device; not where it ends before."""
    return [
        (
            round((stage.start + stage.limit) / MM, 9),
            "limit of",
            device.name if stage.name == DEVICE else f"{device.name} {stage.name}",
        )
        for device in _own_devices(result.chain)
        for stage in device.stages
        if np.isfinite(stage.limit) and stage.start + stage.limit < stage.end
    ]


def _forces(result: Result) -> _Found:
    """At which force a car body gives way: one behind a device, or one that is a chain of masses itself."""
    ends = {device.name: result.scenario.devices[device.name].end() for device in _own_devices(result.chain)}
    found = [
        (end.collapse_force_kN, "car body gives way behind", name)
        for name, end in ends.items()
        if end is not None and end.collapse_force_kN is not None
    ]
    bodies = (v.body for v in result.chain.vehicles[: result.chain.n_moving])
    forces = {body.collapse for body in bodies if body is not None and np.isfinite(body.collapse)}
    return found + [(force / KN, "car body gives way", "") for force in sorted(forces)]


def _own_devices(chain: Chain) -> list[Device]:
    """The devices of the moving train, those that are alike once, from the front backwards."""
    own = (chain.interfaces[k].devices[side] for k, side in places_of_sides(chain)[: n_own_sides(chain)])
    return list({(device.name, device.stages): device for device in own}.values())
