"""What draws of a train as built cost beside the cases of a plain sweep of the same train.

::

    python benchmarks/reliability.py [CASES] [STEP_MS]

Three ways through the same code, in turns: a sweep that varies three values (mass, empty stroke, speed), one that
varies 22, and draws with 23 random quantities, 22 of them of single vehicles and couplers. Printed are collisions a
second, processor time of a collision, and the ratio of that to the first sweep's, each round by itself: other work on
the machine then falls on all of them.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import trainmj

ROUNDS = 5
DEVICES = ("front", "coupler_a_b", "coupler_c_d")


def few(n: int, step: float) -> trainmj.Sweep:
    """A sweep of three values."""
    rng = np.random.default_rng(1)
    values = {
        "mass_t": rng.normal(32.8, 0.33, n).tolist(),
        "empty_stroke_mm": rng.uniform(45, 50, n).tolist(),
        "speed_km_h": rng.uniform(24.5, 25.5, n).tolist(),
    }
    return trainmj.sweep_of({"scenario": "b_type", "set": {"simulation.step_ms": step}, "together": values})


def many(n: int, step: float) -> trainmj.Sweep:
    """A sweep of 22 values, four of them curves."""
    rng = np.random.default_rng(1)
    scenario = trainmj.load("b_type")

    def about(path: str, percent: float) -> list[object]:
        (value,) = scenario.locate(path)
        factors = 1.0 + percent / 100 * rng.standard_normal(n)
        if isinstance(value, (int, float)):
            return (value * factors).tolist()
        stroke, force = scenario.curve_points(_curve(scenario, path))
        return [{"stroke_mm": stroke, "force_kN": [f * factor for f in force]} for factor in factors.tolist()]

    paths = [f"trains.b_type.vehicles.{k}.mass_t" for k in range(6)]
    values: dict[str, list[object]] = {path: (33 * (1 + 0.01 * rng.standard_normal(n))).tolist() for path in paths}
    curves = [f"devices.front.stages.{stage}.curve" for stage in ("coupler", "anti_climber")]
    for path in [*curves, *(f"devices.{name}.curve" for name in DEVICES[1:])]:
        values[path] = about(path, 1.0)
    for name in DEVICES:
        for key in ("stiffness_kN_per_mm", "damping_kN_s_per_m", "beyond.collapse_force_kN"):
            values[f"devices.{name}.{key}"] = about(f"devices.{name}.{key}", 0.1)
    for path in ("collision.speed_km_h", "collision.rail_friction", "empty_stroke_mm"):
        values[path] = about(path, 1.0)
    return trainmj.sweep_of({"scenario": "b_type", "set": {"simulation.step_ms": step}, "together": values})


def _curve(scenario: trainmj.Scenario, path: str) -> object:
    _, device, *rest = path.split(".")
    return dict(scenario.devices[device].curves())[tuple(rest)]


def draws(n: int, step: float) -> trainmj.Reliability:
    """Draws with 23 random quantities: 12 masses, 10 couplers, the front."""
    couplers = ["devices.coupler_a_b", "devices.coupler_c_d"]
    tolerances = {
        "masses": {"of": "mass_t", "percent": 1.0, "copies": "independent"},
        "couplers": {"of": couplers, "scales": "force", "percent": 2.5, "copies": "independent"},
        "front": {"of": "devices.front", "scales": "force", "percent": 2.5, "copies": "same"},
    }
    set_ = {"simulation.step_ms": step, "mass_t": 32.8, "empty_stroke_mm": 50}
    return trainmj.reliability_of({"scenario": "b_type", "set": set_, "tolerances": tolerances, "runs": n})


def main(n: int = 512, step: float = 0.25) -> None:
    """Print the times and their ratios."""
    a, b, c = few(n, step), many(n, step), draws(n, step)
    ways: dict[str, Callable[[Path], object]] = {
        "sweep of 3 values": lambda folder: trainmj.run_sweep(a, folder),
        f"sweep of {len(b.names)} values": lambda folder: trainmj.run_sweep(b, folder),
        f"draws of {c.scatter.d} quantities": lambda folder: trainmj.run_reliability(c, folder, figures=()),
    }
    wall: dict[str, list[float]] = {name: [] for name in ways}
    cpu: dict[str, list[float]] = {name: [] for name in ways}
    for number in range(ROUNDS + 1):  # the first one compiles and loads
        for name, work in ways.items():
            with tempfile.TemporaryDirectory() as folder:
                began, used = time.perf_counter(), time.process_time()
                work(Path(folder))
                if number:
                    wall[name].append(time.perf_counter() - began)
                    cpu[name].append(time.process_time() - used)
    first = next(iter(ways))
    print(f"{n} collisions each, step {step:g} ms, {ROUNDS} rounds in turns")
    for name in ways:
        ratios = [t / t0 for t, t0 in zip(cpu[name], cpu[first], strict=True)]
        rate, each = n / statistics.median(wall[name]), 1e3 * statistics.median(cpu[name]) / n
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
        print(f"{name:24} {rate:6.0f}/s {each:7.2f} ms each  ratio {statistics.median(ratios):.2f} ({spread})")


if __name__ == "__main__":
    main(*(convert(text) for convert, text in zip((int, float), sys.argv[1:], strict=False)))
