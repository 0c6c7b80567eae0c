"""The swarm on ZDT1, BNH and CTP1: share of the true hypervolume and time, beside pymoo's NSGA-II if it is installed.

    python benchmarks/swarm.py

The bars: 0.99 of the true hypervolume, every point feasible, 3 s. The reference lies a tenth of the true front's range
beyond its worst values; the share with the reference at the worst values themselves, which is harder, stands beside it.
"""

from __future__ import annotations

import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from trainmj.doe import mopso

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "doe"))
from known import bnh, ctp1, nsga2, share, zdt1

BEYOND = (0.1, 1e-6)
"""How far the references lie past the worst values, in parts of the true front's range."""


def main() -> None:
    """Print one line for each problem and optimiser."""
    with_oracle = find_spec("pymoo") is not None
    if not with_oracle:
        print("pymoo is not installed: no comparison")
    for name, problem in (("ZDT1", zdt1()), ("BNH", bnh()), ("CTP1", ctp1())):
        found, seconds, feasible, evaluations = [], [], True, 0
        for seed in range(8):
            clock = time.perf_counter()
            front = mopso(problem.space, problem.evaluate, seed=seed)
            seconds.append(time.perf_counter() - clock)
            found.append([share(problem, front.values, beyond) for beyond in BEYOND])
            feasible &= bool((front.limits <= 0).all())
            evaluations = max(evaluations, front.history[-1].evaluations)
        (low, hard), slow = np.min(found, axis=0), max(seconds)
        print(f"{name:5} trainmj {low:.4f} / {hard:.4f} (least of 8), feasible {feasible}, {slow:.2f} s (longest)")
        if with_oracle:
            clock = time.perf_counter()
            values = nsga2(problem, population=200, generations=evaluations // 200)
            a, b = (share(problem, values, beyond) for beyond in BEYOND)
            print(f"{name:5} NSGA-II {a:.4f} / {b:.4f}, {time.perf_counter() - clock:.2f} s")


if __name__ == "__main__":
    main()
