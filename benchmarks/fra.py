"""How far the FRA's train-to-train test of 2006 can be told from its two tests against a wall: many curves, one answer.

python benchmarks/fra.py [--curves N] [--seed N]

Three numbers are known of the crushable car end: 3 ft of one car against a wall, 3 ft and 2 ft of two. The curve of
the scenarios ``fra_cem_*`` has a shape that is assumed. Here shapes are drawn at random: how far the coupler is pushed
back, how steep the forces rise, whether the last force grows or falls, how the end unloads. For each its two forces are
fitted to the three numbers, and the test of two trains, which nothing was fitted to, is computed with it.

"as printed": the three numbers are met within 2 %. "rounded": each within a quarter of a foot, for they are printed as
"about"; the numbers that the forces are fitted to are drawn within that, and masses and speeds within what is known of
them. A shape with which this cannot be had counts as rejected. Nothing is chosen by what it makes of the two trains.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

import trainmj
from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.errors import InputError

FOOT = 304.8
PRINTED = np.array([3.0, 3.0, 2.0]) * FOOT
WITHIN = 0.02
LEAD, ZONES = 900.0, 18 * FOOT
ROUNDING = 0.25 * FOOT
_END = "devices.cem_end.stages"


@dataclass(frozen=True)
class Curve:
    """A curve that meets the tests against a wall, and what it makes of the two trains."""

    forces: np.ndarray  # (2,) push-back and crush zone [kN]
    met: np.ndarray  # (3,) the three numbers as computed [mm]
    lead: float  # [mm]
    zones: float  # [mm]


def shape(rng: np.random.Generator) -> dict[str, float]:
    """A shape of the curve: strokes [mm], part by which the last force changes over 1 m, stiffness [kN/mm]."""
    return {
        "rise": rng.uniform(5, 60),
        "push_back": rng.uniform(80, 350),
        "transition": rng.uniform(5, 100),
        "slope": rng.uniform(-0.3, 0.5),
        "stiffness": 10 ** rng.uniform(1.7, 3),
    }


def surroundings(rng: np.random.Generator) -> dict[str, Any]:
    """Masses and speeds: recalled or assumed within 5, 10 and 20 %; "about", within half a mile per hour."""
    car = 34.0 * rng.uniform(0.95, 1.05)
    locomotives, freight = 117.9 * rng.uniform(0.9, 1.1, 2), 85.0 * rng.uniform(0.8, 1.2)
    return {
        "trains.cars.mass_t": car,
        "trains.cem_train.mass_t": car,
        "trains.cem_train.vehicles.locomotive.mass_t": locomotives[0],
        "trains.standing.vehicles.locomotive.mass_t": locomotives[1],
        "trains.standing.vehicles.freight car 1.mass_t": freight,
        "trains.standing.vehicles.freight car 2.mass_t": freight,
        "speeds": np.array([56.33, 46.67, 49.89]) + 0.8 * rng.uniform(-1, 1, 3),
    }


def changes_of(forces: np.ndarray, of: Mapping[str, float]) -> dict[str, Any]:
    """The values of the scenario for a curve."""
    push_back, crush = map(float, forces)
    top, length = of["transition"], 1255.0
    return {
        f"{_END}.push_back.curve.stroke_mm": [0.0, of["rise"], of["rise"] + of["push_back"]],
        f"{_END}.push_back.curve.force_kN": [0.0, push_back, push_back],
        f"{_END}.crush_zone.curve.stroke_mm": [0.0, top, length],
        f"{_END}.crush_zone.curve.force_kN": [push_back, crush, crush * (1 + of["slope"] * (length - top) / 1e3)],
        "devices.cem_end.stiffness_kN_per_mm": of["stiffness"],
    }


class Tests:
    """The three tests with masses and speeds of one draw."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        """Values of the scenario, and speeds of the three tests [km/h]."""
        given = dict(values)
        speeds = map(float, given.pop("speeds"))
        of_tests = (
            {"trains.cars.vehicles": 1},
            {"trains.cars.vehicles": 2},
            {"collision.train": "cem_train", "collision.partner": "standing"},
        )
        base = trainmj.load("fra_cem_single", given)
        self.scenarios = [
            base.with_values({**own, "collision.speed_km_h": v}) for own, v in zip(of_tests, speeds, strict=True)
        ]

    def row(self, n: tuple[int, ...], changes: Mapping[str, Any]) -> list[dict[str, Any]]:
        """The responses of some of the tests."""
        found = dict(run_chains(enumerate(line_up(self.scenarios[k].with_values(changes)) for k in n)))
        return [found[k].row() for k in range(len(n))]

    def walls(self, changes: Mapping[str, Any]) -> np.ndarray:
        """The three numbers of the tests against a wall [mm]."""
        one, two = self.row((0, 1), changes)
        between = two["stroke_M1_M2_M1_mm"] + two["stroke_M1_M2_M2_mm"]
        return np.array([one["stroke_M1_wall_mm"], two["stroke_M1_wall_mm"], between])


def draws(seed: int, rounded: bool) -> Iterator[Curve | None]:
    """Curves without end, None for a shape with which the numbers cannot be met."""
    rng = np.random.default_rng(seed)
    while True:
        of, around = shape(rng), surroundings(rng)
        wanted = PRINTED + ROUNDING * rng.uniform(-1, 1, 3)
        if rounded:
            yield fitted(Tests(around), of, wanted, np.full(3, ROUNDING))
        else:
            yield fitted(Tests({"speeds": (56.33, 46.67, 49.89)}), of, PRINTED, WITHIN * PRINTED)


def fitted(tests: Tests, of: Mapping[str, float], wanted: np.ndarray, room: np.ndarray) -> Curve | None:
    """A shape with forces fitted to numbers; None if it misses printed ones by more than the room [mm]."""

    def missed(forces: np.ndarray) -> np.ndarray:
        return np.asarray(tests.walls(changes_of(forces, of)) / wanted - 1)

    try:
        found = least_squares(
            missed, [2000.0, 5500.0], bounds=([300, 1000], [8000, 20000]), diff_step=1e-3, x_scale=[500, 500]
        )
    except InputError:  # a curve that no device may have
        return None
    changes = changes_of(found.x, of)
    met = tests.walls(changes)
    if np.any(np.abs(met - PRINTED) > room):
        return None
    (row,) = tests.row((2,), changes)
    zones = row["TS_mm"] - row["stroke_M5_M6_M6_mm"]
    return Curve(found.x, met, row["stroke_S1_M1_mm"], zones)


def sample(count: int, seed: int = 1, rounded: bool = False) -> tuple[list[Curve], int]:
    """So many curves that meet the tests against a wall, and how many shapes were rejected on the way."""
    curves: list[Curve] = []
    rejected = 0
    for curve in draws(seed, rounded):
        if curve is None:
            rejected += 1
        else:
            curves.append(curve)
        if len(curves) == count:
            return curves, rejected
    raise AssertionError("draws have no end")


def main() -> None:
    """Print both intervals."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--curves", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    print(f"Published: lead car {LEAD:.0f} mm, all crush zones {ZONES:.0f} mm")
    for words, rounded in (("as printed", False), ("rounded", True)):
        curves, rejected = sample(arguments.curves, arguments.seed, rounded)
        worst = max(float(np.abs(c.met - PRINTED).max()) for c in curves)
        print(f"{words}: {len(curves)} curves, {rejected} rejected; numbers met within {worst:.1f} mm")
        rows = {
            "push-back force, kN": [c.forces[0] for c in curves],
            "crush force, kN": [c.forces[1] for c in curves],
            "lead car, mm": [c.lead for c in curves],
            "all crush zones, mm": [c.zones for c in curves],
        }
        for name, values in rows.items():
            low, middle, high = np.percentile(values, [0, 50, 100])
            print(f"  {name:22} {low:6.0f} to {high:6.0f}, median {middle:6.0f}")


if __name__ == "__main__":
    main()
