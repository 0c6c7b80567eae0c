"""The vertical plane: what a step costs, and random trains beside an integration of their equations by scipy.

    python benchmarks/plane.py [--trains N] [--seconds S]

Times are the least of many turns in processor time of the thread, the plane and one dimension in turns. The trains are
those of trainmj.verification.mixed.random_train; differences are relative to the largest of their kind in each train.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from trainmj.collision import kernel
from trainmj.collision.block import Layout
from trainmj.collision.chain import Chain
from trainmj.collision.lineup import line_up
from trainmj.collision.mj import mujoco as mj
from trainmj.collision.model import build
from trainmj.collision.simulation import start
from trainmj.errors import EngineError
from trainmj.verification import plane
from trainmj.verification.systems import planar

STEPS = 2000  # of a collision, from the first contact on
TURNS = 7


def step_us(chain: Chain, law: bool = True) -> float:
    """Cost of a step of a bare model [us], with the law or by MuJoCo alone."""
    layout = Layout.of(chain)
    model = build(chain, layout, bare=True)
    data = start(model, chain, layout)
    if not law:
        data.userdata[:] = 0.0
    began = time.thread_time()
    mj.mj_step(model, data, nstep=STEPS)
    return (time.thread_time() - began) / STEPS * 1e6


def costs() -> None:
    """Print what a step costs."""
    high = {"collision.offset_mm": {"M": 40}}
    cases = {
        "one dimension, 12 vehicles": (line_up(planar({"plane": "line"})), True),
        "vertical plane, 12 vehicles": (line_up(planar(high)), True),
        "  MuJoCo alone": (line_up(planar(high)), False),
    }
    with kernel.installed():
        best = {name: min(step_us(*case) for _ in range(TURNS)) for name, case in cases.items()}
    for name, cost in best.items():
        print(f"{name:32} {cost:6.2f} us a step")


def trains(n: int, seconds: float) -> None:
    """Print how far random trains are from scipy's integration."""
    seeds, worst = np.arange(n), {}
    for seed in seeds:
        began = time.perf_counter()
        try:
            checks = list(plane.by_scipy([int(seed)], seconds))
        except EngineError as error:  # of the integration by scipy
            print(f"train {seed:3}: not integrated: {str(error)[:60]}")
            continue
        said = "  ".join(f"{c.what.split(',')[0]} {c.found:.1e}" for c in checks)
        missed = "" if all(c.passed for c in checks) else "MISSED "
        print(f"train {seed:3}: {said}  {missed}({time.perf_counter() - began:.1f} s)")
        for c in checks:
            worst[c.what] = max(worst.get(c.what, 0.0), c.found)
    for what, found in worst.items():
        print(f"worst {what}: {found:.1e}")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trains", type=int, default=0, help="how many random trains to compare")
    parser.add_argument("--seconds", type=float, default=0.5, help="how long each is followed")
    given = parser.parse_args()
    costs()
    if given.trains:
        trains(given.trains, given.seconds)


if __name__ == "__main__":
    main()
