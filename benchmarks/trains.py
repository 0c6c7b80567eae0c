"""Trains to measure: of one kind of device, and of every kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

TUBE = {"stroke_mm": [0, 5, 60, 400], "force_kN": [0, 300, 700, 800]}
CRUSH = {"curve": TUBE, "stiffness_kN_per_mm": 500, "damping_kN_s_per_m": 50, "beyond": "car_body"}
BEYOND = {"kind": "stop", "stiffness_kN_per_mm": 100}
HYDRAULIC = {"stroke_mm": 105, "orifice_kN_s2_per_m2": 100, "beyond": BEYOND}
DEVICES: dict[str, dict[str, Any]] = {
    "crush": CRUSH,
    "rate": CRUSH | {"rate": {"C_m_per_s": 20, "P": 5}},
    "hysteresis": {
        "kind": "hysteresis",
        "loading": {"stroke_mm": [0, 90, 400], "force_kN": [60, 800, 900]},
        "unloading": {"stroke_mm": [0, 90, 400], "force_kN": [10, 200, 250]},
        "transition_stiffness_kN_per_mm": 250,
        "beyond": "stop",
    },
    "hydraulic": HYDRAULIC | {"kind": "hydraulic"},
    "gas_hydraulic": HYDRAULIC
    | {
        "kind": "gas_hydraulic",
        "gas": {"force_kN": 50, "length_mm": 150, "exponent": 1.3, "preload_stiffness_kN_per_mm": 100},
        "rebound_orifice_kN_s2_per_m2": 400,
    },
    "crush_and_pull": CRUSH | {"pull": {"stiffness_kN_per_mm": 50, "slack_mm": 5}},
}
STAGES = {
    "coupler": {"curve": TUBE, "shear_off": {"force_kN": 1100, "ramp_mm": 0.25}},
    "absorber": {"empty_stroke_mm": 20, "curve": {"stroke_mm": [0, 2, 900], "force_kN": [0, 1200, 1200]}},
}
FRONTS = {
    "tube": CRUSH | {"curve": {"stroke_mm": [0, 2, 1500], "force_kN": [0, 900, 900]}},
    "staged": {"stages": STAGES, "stiffness_kN_per_mm": 1000, "damping_kN_s_per_m": 50, "beyond": "car_body"},
}


def scenario_of(couplers: Sequence[str], fronts: tuple[str, str] = ("tube", "tube")) -> dict[str, Any]:
    """The values of a scenario: two trains with couplers, from the front, at 25 km/h."""
    vehicles = [
        {"name": f"car {k}", "mass_t": 33, "coupler": coupler} for k, coupler in enumerate([*couplers, "crush"])
    ]
    trains = {f"train_{k}": {"vehicles": vehicles, "front": front} for k, front in enumerate(fronts)}
    collision = {"train": "train_0", "partner": "train_1", "speed_km_h": 25, "rail_friction": 0.008}
    return {
        "devices": DEVICES | FRONTS,
        "trains": trains,
        "collision": collision,
        "simulation": {"step_ms": 0.1},
    }
