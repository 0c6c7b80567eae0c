"""How long it takes to prepare a case: in lots, against a chain for each.

::

    python benchmarks/lots.py

The cases vary three values of the B-type train, scatter it within its tolerances, or vary six values of a train with
every kind of device. Prepared is what a simulation begins with: the block, positions and speeds. Times are processor
time; what is said behind them is how many cases went together.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import trainmj
from trainmj.cases.scatter import scatter_of
from trainmj.collision.block import Layout
from trainmj.collision.cases import Cases
from trainmj.collision.lineup import line_up
from trainmj.collision.lots import Lots, Refused
from trainmj.scenario import Scenario

EVERY_KIND = Path(__file__).parents[1] / "tests" / "every_kind.yaml"
N_CASES, AT_ONCE, N_ALONE = 16384, 1024, 50


def varied(scenario: Scenario, names: list[str], part: float) -> tuple[Scenario, Cases]:
    """Cases around the numbers of a scenario."""
    rng = np.random.default_rng(1)
    columns = [scenario.locate(name)[0] * (1.0 + part * rng.standard_normal(N_CASES)) for name in names]
    return scenario, Cases(range(N_CASES), [(name,) for name in names], columns)


def as_built() -> tuple[Scenario, Cases]:
    """The B-type train within its tolerances."""
    (scenario,) = trainmj.load_reliability("b_type_as_built").scenarios.values()
    scatter = scatter_of(scenario)
    changes = scatter.cases(np.random.default_rng(1).standard_normal((N_CASES, scatter.d)))
    rows = np.array([[number for _, number in numbers(each)] for each in changes], dtype=float)
    names = [name for name, _ in numbers(changes[0])]
    return scenario, Cases(range(N_CASES), names, list(rows.T))


def numbers(values: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], float]]:
    """The numbers of nested dicts and lists."""
    if isinstance(values, dict | list):
        for key, inner in values.items() if isinstance(values, dict) else enumerate(values):
            yield from numbers(inner, (*path, key))
    else:
        yield path, values


def in_lots(scenario: Scenario, cases: Cases) -> str:
    """Microseconds a case, and what the cases came in."""
    began, kinds = time.process_time(), Counter[str]()
    parts = (cases.take(np.arange(n, n + AT_ONCE)) for n in range(0, N_CASES, AT_ONCE))
    for lot in Lots(scenario)(parts):
        if isinstance(lot, Refused):
            kinds["refused"] += 1
            continue
        kinds[type(lot).__name__.lower()] += len(lot)
        lot.blocks(Layout.of(lot.chain, 0, 8))
        lot.values(lambda chain: chain.start_qpos)
        lot.values(lambda chain: chain.start_qvel)
    return f"{(time.process_time() - began) / N_CASES * 1e6:7.1f}   {dict(kinds)}"


def alone(scenario: Scenario, cases: Cases) -> str:
    """Microseconds a case."""
    began = time.process_time()
    for n in range(N_ALONE):
        chain = line_up(scenario.with_values(cases[n]))
        Layout.of(chain, 0, 8).block(chain)
    return f"{(time.process_time() - began) / N_ALONE * 1e6:7.1f}"


def main() -> None:
    """Print the times."""
    kinds = ["collision.speed_km_h", "trains.t.mass_t", "devices.gas.rebound_orifice_kN_s2_per_m2"]
    kinds += ["devices.gear.empty_stroke_mm", "devices.coupler.rate.P", "trains.t.rail_friction"]
    studied = {
        "b_type, 3 values": varied(trainmj.load("b_type"), ["mass_t", "empty_stroke_mm", "speed_km_h"], 0.02),
        "b_type_as_built": as_built(),
        "every kind, 6 values": varied(trainmj.load(EVERY_KIND), kinds, 0.02),
        "every kind, its gas": varied(trainmj.load(EVERY_KIND), ["devices.gas.gas.force_kN", kinds[0]], 0.01),
    }
    for name, (scenario, cases) in studied.items():
        print(f"{name}: alone {alone(scenario, cases)} us, in lots {in_lots(scenario, cases)}")


if __name__ == "__main__":
    main()
