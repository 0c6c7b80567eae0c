"""Collisions drawn at random: trains of any length, devices of any shape, masses, speeds and friction."""

from __future__ import annotations

from typing import Any

import numpy as np

from trainmj.scenario import Scenario

STEP_MS = 0.005


def random_collision(seed: int, most: int = 40) -> Scenario:
    """A collision of 2 to most vehicles, the same one for the same seed.

    Both sides move or one stands; one may be longer than the other; there may be a gap and an empty stroke; devices
    have plateaus, bulges, shear-offs and steep rises; masses go from 10 t to 100 t, closing speeds from 2 to 30 km/h.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, most + 1))
    n_moving = int(rng.integers(1, n))
    kinds = [f"d{i}" for i in range(int(rng.integers(1, 5)))]
    speed = float(rng.uniform(2.0, 30.0))
    carried = float(rng.choice([0.0, 0.0, rng.uniform(-30.0, 30.0)]))

    def train(count: int) -> dict[str, Any]:
        mass = rng.uniform(10.0, 100.0, count) if rng.random() < 0.7 else np.full(count, rng.uniform(10.0, 100.0))
        cars = [
            {"name": f"car {i + 1}", "mass_t": float(m), "coupler": str(rng.choice(kinds))} for i, m in enumerate(mass)
        ]
        return {"vehicles": cars, "front": str(rng.choice(kinds))}

    return Scenario.from_values(
        {
            "devices": {name: _device(rng) for name in kinds},
            "trains": {"a": train(n_moving), "b": train(n - n_moving)},
            "collision": {
                "train": "a",
                "partner": "b",
                "speed_km_h": speed + carried,
                "partner_speed_km_h": carried,
                "gap_mm": float(rng.choice([0.0, rng.uniform(0.0, 100.0)])),
                "rail_friction": float(rng.choice([0.0, rng.uniform(0.0, 0.05)])),
            },
            "simulation": {"step_ms": STEP_MS, "record_every_ms": 1.0, "time_limit_s": 1.0},
        }
    )


def _device(rng: np.random.Generator) -> dict[str, Any]:
    """A device of one or two stages; where its curve rises faster than its stiffness, it climbs along that."""
    stiffness = float(10 ** rng.uniform(1.0, 3.0))  # kN/mm
    stages: dict[str, Any] = {"coupler": _stage(rng)}
    if rng.random() < 0.3:
        top = stages["coupler"]["curve"]["force_kN"][-1]
        stages["coupler"]["shear_off"] = {"force_kN": float(top * rng.uniform(1.0, 1.3)), "ramp_mm": 0.25}
        stages["absorber"] = {**_stage(rng), "empty_stroke_mm": float(rng.uniform(1.0, 60.0))}
    damping = float(rng.choice([0.0, 10 ** rng.uniform(0.0, 3.5)]))  # kN s/m
    return {"stages": stages, "stiffness_kN_per_mm": stiffness, "damping_kN_s_per_m": damping}


def _stage(rng: np.random.Generator) -> dict[str, Any]:
    """A curve that rises first, then rises, holds or falls from point to point."""
    n = int(rng.integers(1, 6))
    stroke = np.cumsum(np.concatenate([[0.0, rng.uniform(1.0, 80.0)], rng.uniform(0.5, 250.0, n)]))
    force = rng.uniform(200.0, 800.0) * np.cumprod(np.append(1.0, rng.choice([0.9, 1.0, 1.2, 1.7], n)))
    return {"curve": {"stroke_mm": stroke.tolist(), "force_kN": [0.0, *force.tolist()]}}
