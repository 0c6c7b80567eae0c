"""Small systems that the tests collide: a scenario or a chain in a few words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trainmj import native
from trainmj.chain import WALL, Chain, Interface, Vehicle
from trainmj.device import Device, Envelope, Stage, in_series
from trainmj.scenario import Scenario
from trainmj.simulation import start


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


def joined(left: Envelope, right: Envelope) -> Interface:
    """A front interface of two devices in series, between vehicles 0 and 1."""
    sides = device(left, "left"), device(right, "right")
    pair, left_stroke = in_series(*sides)
    return Interface("front", 0, 1, pair, left_stroke, sides)


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


def step_once(model: Any, chain: Chain) -> Any:
    """A simulation of a chain after one step with the law."""
    import mujoco

    from trainmj.layout import Layout

    data = start(model, chain, Layout.of(chain))
    with native.installed():
        mujoco.mj_step(model, data)
    return data
