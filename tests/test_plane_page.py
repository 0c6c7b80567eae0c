"""The scenarios in the vertical plane that ship, and every number of the page about them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from pages import read

import trainmj
from trainmj.collision.lineup import line_up
from trainmj.files.provenance import entry_of
from trainmj.files.yaml import parse
from trainmj.scenario import Scenario, load, shipped

PAGE = "docs/vertical-plane.md"
TRAINS = {"b_type_vertical": "b_type", "emu_vertical": "en15227_c1"}
"""Scenarios in the vertical plane, and what they build on."""

FRONT = {"b_type_vertical": "devices.front.stages", "emu_vertical": "devices.head.stages"}
TYPES = {"b_type_vertical": ["car"], "emu_vertical": ["trailer", "motor"]}


@cache
def scenario(name: str) -> Scenario:
    return load(name)


def face(height_mm: float) -> dict[str, Any]:
    tie = {"friction": 0.2, "tooth_kN": 0, "kN_per_mm": 100}
    return {"acts": "face", "height_mm": height_mm, "overlap_mm": 120, "tie": tie}


def ended(name: str, changes: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    """Status and responses of a shipped scenario with changes."""
    summary = trainmj.summarise(trainmj.run(scenario(name).with_values(changes)))
    return summary.status.kind.value, summary.responses


def cells(*values: Any) -> str:
    return "| " + " | ".join(map(str, values)) + " |"


def answers(name: str, changes: Mapping[str, Any]) -> tuple[str, ...]:
    """Status, step at the front, largest step, lift, and least load of a run, as the page has them."""
    status, found = ended(name, changes)
    lift, load = found["largest_wheel_lift_mm"], found["least_wheel_load"]
    steps = f"{found['step_S1_M1_mm']:.0f}", f"{found['largest_step_mm']:.0f}"
    return status, *steps, f"{lift:.1f}", f"{load:.2f}"


def brackets() -> Iterator[str]:
    for name in TRAINS:
        for ties in ("free", "stated", "tied"):
            yield cells(f"`{name}`", ties, *answers(name, {"ties": ties}))


def speeds() -> Iterator[str]:
    for speed in (10, 12, 15, 18, 20, 22, 25, 30):
        row = []
        for offset in (0, 40, 76.2):
            status, found = ended("b_type_vertical", {"offset_mm": offset, "speed_km_h": speed})
            met = found["met_step_S1_M1_mm"]
            row.append(f"{found['step_S1_M1_mm']:.0f}{', override' if status == 'override' else ''}")
            row.append("-" if math.isnan(met) else f"{met:.0f}")
        yield cells(speed, *row)


INNER = ("devices.coupler_a_b.line", "devices.coupler_c_d.line")
CAR = "vehicle_types.car"
ONE_BY_ONE: dict[str, dict[str, Any]] = {
    "as shipped": {},
    "offset 0 mm": {"offset_mm": 0},
    "offset 76.2 mm": {"offset_mm": 76.2},
    "15 km/h": {"speed_km_h": 15},
    "15 km/h, couplers of the front swing by 20 mrad": {"speed_km_h": 15, "front_free_mrad": 20},
    "couplers of the front swing by 20 mrad": {"front_free_mrad": 20},
    "couplers of the front as faces": {"devices.front.stages.coupler.line": face(660)},
    "couplers between cars swing by 50 mrad": {"inner_free_mrad": 50},
    "by 20 mrad": {"inner_free_mrad": 20},
    "by 0 mrad, stop of 2 MN m/rad": {"inner_free_mrad": 0},
    "by 0 mrad, stop of 1 MN m/rad": {"inner_free_mrad": 0, "inner_stop_MN_m_per_rad": 1},
    "by 0 mrad, stop of 0.5 MN m/rad": {"inner_free_mrad": 0, "inner_stop_MN_m_per_rad": 0.5},
    "couplers between cars as faces": dict.fromkeys(INNER, face(660)),
    "friction 0.05": {"friction": 0.05},
    "friction 0": {"friction": 0},
    "secondary springs 20 % stiffer": {"secondary_kN_per_mm": 1.2},
    "secondary dampers ten times as strong": {f"{CAR}.secondary.kN_s_per_m": 60},
    "centre of gravity 20 % higher": {"cog_height_m": 1.92},
    "secondary lift stop at 30 mm": {f"{CAR}.secondary.lift_stop_mm": 30},
    "no secondary lift stop": {f"{CAR}.secondary.lift_stop_mm": "none"},
    "secondary bump stop at 30 mm": {f"{CAR}.secondary.bump_stop_mm": 30},
    "no primary stops": {f"{CAR}.primary.lift_stop_mm": "none", f"{CAR}.primary.bump_stop_mm": "none"},
}


def one_by_one() -> Iterator[str]:
    for label, changes in ONE_BY_ONE.items():
        yield cells(label, *answers("b_type_vertical", changes))


def ties() -> Iterator[str]:
    tie = f"{FRONT['b_type_vertical']}.anti_climber.line.tie"
    for stiffness in (20, 100, 500):
        for friction in (0.2, 1.0):
            _, found = ended("b_type_vertical", {f"{tie}.kN_per_mm": stiffness, f"{tie}.friction": friction})
            yield cells(
                stiffness, friction, f"{found['tie_force_S1_M1_kN']:.0f}", f"{found['slip_S1_M1_mm']:.1f}",
                f"{found['step_S1_M1_mm']:.1f}",
            )  # fmt: skip


def steps() -> Iterator[str]:
    for name in TRAINS:
        for tied in ("free", "stated", "tied"):
            for step in (0.05, 0.1, 0.25):
                _, found = ended(name, {"ties": tied, "simulation.step_ms": step})
                numbers = (found[key] for key in ("TS_mm", "largest_step_mm", "largest_wheel_lift_mm"))
                yield cells(f"`{name}`", tied, step, *(f"{n:.2f}" for n in numbers), f"{found['least_wheel_load']:.4f}")


def raised(name: str, key: str) -> dict[str, Any]:
    """A value of every type of vehicle, 20 % up."""
    paths = [f"vehicle_types.{of}.{key}" for of in TYPES[name]]
    return {path: 1.2 * scenario(name).locate(path)[0] for path in paths}


def trends() -> Iterator[str]:
    """What the centre of gravity and the secondary stiffness do to the lift, or to the least load, of the lead cars."""
    for name in TRAINS:
        for tied in ("free", "stated", "tied"):
            found = [
                ended(name, {"ties": tied, **changes})[1]
                for changes in ({}, raised(name, "body.cog_height_m"), raised(name, "secondary.kN_per_mm"))
            ]
            lifts = [max(f["wheel_lift_M1_mm"], f["wheel_lift_S1_mm"]) for f in found]
            loads = [min(f["wheel_load_M1"], f["wheel_load_S1"]) for f in found]
            lifted = lifts[0] > 0
            values = lifts if lifted else loads
            worse = [(v - values[0]) * (1 if lifted else -1) for v in values[1:]]
            said = ["worse, as theirs" if worse[0] > 0 else "better", "better, as theirs" if worse[1] < 0 else "worse"]
            shown = [f"{v:.1f} mm" if lifted else f"N/N0 = {v:.3f}" for v in values]
            yield cells(f"`{name}`", tied, shown[0], f"{shown[1]}: {said[0]}", f"{shown[2]}: {said[1]}")


TABLES = {f.__name__: f for f in (brackets, speeds, one_by_one, ties, steps, trends)}
