"""A small train whose parameters are known, and targets made from its own responses."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

import trainmj
from trainmj.identification import Identification, targets_of
from trainmj.scenario import Scenario

SCENARIO: dict[str, Any] = {
    "title": "Two short trains",
    "parameters": {"mass_t": "trains.t.mass_t", "speed_km_h": "collision.speed_km_h"},
    "curves": {
        "buffer": {"stroke_mm": [0, 10, 30, 60], "force_kN": [0, 250, 460, 600]},
        "tube": {"stroke_mm": [60.5, 200, 201, 900], "force_kN": [800, 800, 900, 900]},
    },
    "devices": {
        "front": {"curve": ["buffer", "tube"], "stiffness_kN_per_mm": 150, "damping_kN_s_per_m": 20, "beyond": "hold"},
        "coupler": {"curve": "buffer", "stiffness_kN_per_mm": 80, "damping_kN_s_per_m": 200, "beyond": "hold"},
    },
    "trains": {"t": {"vehicles": 3, "mass_t": 30, "front": "front", "coupler": "coupler"}},
    "collision": {"train": "t", "speed_km_h": 20, "partner": "t"},
    "simulation": {"step_ms": 0.5, "time_limit_s": 0.6},
}

KNOWN = {"k": 80.0, "c": 200.0, "tube": 800.0, "f10": 250.0, "f30": 460.0}
"""The values by which the responses are made."""

AREA_KJ = 0.5 * (250 * 10 + (250 + 460) * 20 + (460 + 600) * 30) / 1e3

TARGETS = {
    "a2": "peak_device_M2_g",
    "a3": "peak_device_M3_g",
    "s1": "stroke_S1_M1_mm",
    "s12": "stroke_M1_M2_mm",
    "s23": "stroke_M2_M3_mm",
    "both": "TS_mm - stroke_S1_M1_mm",
    "e12": "energy_M1_M2_kJ",
    "end": "final_speed_M3_km_h",
}
CASES = [(30.0, 20.0), (30.0, 16.0), (34.0, 18.0), (26.0, 22.0), (38.0, 14.0)]


def scenario() -> Scenario:
    """The train with its known values."""
    return Scenario.from_values(copy.deepcopy(SCENARIO))


@cache
def _computed(cases: tuple[tuple[float, float], ...]) -> list[dict[str, float]]:
    """What the known values give, by name of response; once, as most tests need no others."""
    table = trainmj.run_cases(scenario(), pd.DataFrame(cases, columns=["mass_t", "speed_km_h"]), threads=1)
    table[TARGETS["both"]] = table.TS_mm - table.stroke_S1_M1_mm
    return table.to_dict("records")


def rows(scatter: float = 0.0, seed: int = 0, cases: list[tuple[float, float]] = CASES) -> list[dict[str, float]]:
    """A row for each case with the responses of the known values, scattered by a part of each."""
    rng = np.random.default_rng(seed)
    result = []
    for case in _computed(tuple(cases)):
        row = {"M": case["mass_t"], "V": case["speed_km_h"]}
        for name, response in TARGETS.items():
            row[name] = float(case[response] * (1 + scatter * rng.standard_normal()))
        result.append(row)
    return result


def values(**changes: Any) -> dict[str, Any]:
    """The plain values of a targets file that seeks the five known values; ``a__b=1`` changes a value inside."""
    result: dict[str, Any] = {
        "scenario": "train.yaml",
        "parameters": {
            "k": {"sets": "devices.coupler.stiffness_kN_per_mm", "bounds": [20, 400], "scale": "log", "start": 200},
            "c": {"sets": "devices.coupler.damping_kN_s_per_m", "bounds": [20, 900], "scale": "log", "start": 90},
            "tube": {
                "sets": ["curves.tube.force_kN.0", "curves.tube.force_kN.1"],
                "bounds": [650, 890],
                "start": 700,
            },
            "f10": {"sets": "curves.buffer.force_kN.1", "bounds": [100, 400], "start": 150},
            "f30": {"sets": "curves.buffer.force_kN.2", "bounds": [150, 600], "start": 500, "above": "f10"},
        },
        "constraints": {"energy": {"of": "curves.buffer", "to_mm": 60, "area_kJ": AREA_KJ, "by": "f30"}},
        "targets": {name: {"response": response, "tolerance": "1 %"} for name, response in TARGETS.items()},
        "data": {
            "tests": {
                "rows": rows(),
                "cases": {"M": "mass_t", "V": "speed_km_h"},
                "values": {name: name for name in TARGETS},
            }
        },
        "method": {"seed": 1, "explore": {"trials": 40}, "refine": {"iterations": 20}},
    }
    for path, value in changes.items():
        *way, last = path.split("__")
        here = result
        for key in way:
            here = here.setdefault(key, {})
        if value is None:
            del here[last]
        else:
            here[last] = value
    return result


def plan(folder: Any, given: Mapping[str, Any]) -> Identification:
    """The identification of plain values, its scenario beside it."""
    trainmj.scenario.save(scenario(), folder / "train.yaml")
    return targets_of(given, folder)
