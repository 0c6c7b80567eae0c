"""Small systems to collide: a scenario or a chain in a few words, and what their vehicles and devices do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from trainmj.collision import kernel
from trainmj.collision.batch import run_chains
from trainmj.collision.block import Joint, Layout, Tally
from trainmj.collision.chain import WALL, Chain, Interface, Vehicle
from trainmj.collision.device import Array, Device, Envelope, Stage
from trainmj.collision.lineup import line_up
from trainmj.collision.model import build
from trainmj.collision.simulation import start
from trainmj.collision.summary import Summary
from trainmj.scenario import Scenario, load

FRICTIONLESS = {"collision.rail_friction": 0}
"""Changes of a scenario under which momentum is kept."""


def envelope(points: Sequence[tuple[float, float]], stiffness: float, damping: float = 0.0) -> Envelope:
    """An envelope from points (mm, kN), its stiffness in kN/mm and its dashpot in kN s/m."""
    u, f = np.array(points, dtype=float).T
    return Envelope(u * 1e-3, f * 1e3, stiffness * 1e6, damping * 1e3)


def device(e: Envelope, name: str = "device") -> Device:
    """A device of one stage."""
    return Device(name, e, (Stage(name, 0.0, np.inf),))


def chain(
    mass_kg: Sequence[float],
    envelopes: Sequence[Envelope],
    speed: Sequence[float],
    n_moving: int = 1,
    friction: float = 0.0,
    step: float = 1e-5,
    time_limit: float = 1.0,
    gap: float = 0.0,
    steps_per_record: int = 10,
) -> Chain:
    """Vehicles in line with given envelopes between them, the last one against a wall if there is one for it."""
    n = len(mass_kg)
    vehicles = tuple(Vehicle(f"V{i}", "", m, 20.0, v) for i, (m, v) in enumerate(zip(mass_kg, speed, strict=True)))
    interfaces = tuple(
        Interface(f"I{i}", i, i + 1 if i + 1 < n else WALL, e, e.stroke, (device(e),)) for i, e in enumerate(envelopes)
    )
    return Chain(vehicles, interfaces, n_moving, gap, friction, step, steps_per_record, time_limit)


def values(
    points: Sequence[tuple[float, float]],
    stiffness: float,
    mass_t: Sequence[float] = (33,),
    partner: str = "rigid_wall",
    speed_m_s: float = 1.0,
    damping: float = 0.0,
    collision: dict[str, Any] | None = None,
    step_ms: float = 0.001,
    time_limit_s: float = 1.0,
) -> dict[str, Any]:
    """The values of a scenario file with one device everywhere; points in mm and kN, stiffness in kN/mm."""
    return {
        "devices": {
            "d": {
                "curve": {"stroke_mm": [float(p[0]) for p in points], "force_kN": [float(p[1]) for p in points]},
                "stiffness_kN_per_mm": float(stiffness),
                "damping_kN_s_per_m": float(damping),
            }
        },
        "trains": {
            "t": {
                "vehicles": [{"name": f"car {i + 1}", "mass_t": float(m)} for i, m in enumerate(mass_t)],
                "front": "d",
                "rear": "d",
                "coupler": "d",
            }
        },
        "collision": {"train": "t", "speed_km_h": 3.6 * speed_m_s, "partner": partner} | (collision or {}),
        "simulation": {"step_ms": step_ms, "record_every_ms": max(step_ms, 0.1), "time_limit_s": time_limit_s},
    }


def scenario(*args: Any, **kwargs: Any) -> Scenario:
    """A checked scenario; arguments as in :func:`values`."""
    return Scenario.from_values(values(*args, **kwargs))


def shipped(name: str = "b_type", changes: Mapping[str, Any] | None = None) -> Chain:
    """The chain of a shipped scenario, some values of it changed."""
    return line_up(load(name, changes or {}))


def collide(*cases: Chain) -> list[Summary]:
    """The numbers of each case, as engineers read them."""
    return [summary for _, summary in sorted(run_chains(enumerate(cases)), key=lambda item: item[0])]


class Ride:
    """A simulation that goes on as far as one wants, whether the collision is over or not."""

    def __init__(self, case: Chain) -> None:
        """At the start."""
        self.case, self.layout = case, Layout.of(case)
        self.model = build(case, bare=True)
        self.data = start(self.model, case, self.layout)

    def go(self, seconds: float) -> Ride:
        """Go on for a time."""
        with kernel.installed():
            mujoco.mj_step(self.model, self.data, nstep=round(seconds / self.case.step))
        return self

    def joint(self, field: Joint) -> Array:
        """(n_interface,) view of what the law keeps of each interface."""
        return self.layout.joint(self.data.userdata, field)

    @property
    def tally(self) -> Tally:
        """What the device law has counted."""
        return Tally.of(self.layout, self.data.userdata)


def follow(case: Chain, step: float | None = None) -> Tally:
    """What is counted up to the time limit of a case, at its own step or another one [s]."""
    case = case if step is None else replace(case, step=step)
    return Ride(case).go(case.time_limit).tally
