"""Optimal Latin hypercubes: smallest distance (median of 8 seeds) and time, beside OpenTURNS if it is installed.

    python benchmarks/designs.py

The bars: 0.31 for 10 points of 2 factors, 0.51 for 50 points of 5.
"""

from __future__ import annotations

import time

import numpy as np

from trainmj.doe import Factor, Space, optimal_latin_hypercube
from trainmj.doe.anneal import smallest_distance

BARS = {(10, 2): 0.31, (50, 5): 0.51}


def ours(n: int, d: int, seed: int) -> float:
    """Smallest distance of our design with its default settings."""
    space = Space(tuple(Factor(f"x{i}", 0, 1) for i in range(d)))
    return optimal_latin_hypercube(space, n, seed=seed, levels="centre").quality().smallest_distance


def openturns(n: int, d: int, seed: int) -> float:
    """Smallest distance of OpenTURNS' annealed design, geometric cooling, 50 000 exchanges."""
    import openturns as ot

    ot.RandomGenerator.SetSeed(seed)
    hypercube = ot.LHSExperiment(ot.JointDistribution([ot.Uniform(0, 1)] * d), n, True, False)
    search = ot.SimulatedAnnealingLHS(hypercube, ot.SpaceFillingPhiP(50), ot.GeometricProfile(10.0, 0.999, 50_000))
    return smallest_distance(np.array(search.generate()))


def main() -> None:
    """Print one line for each size and maker."""
    makers = {"trainmj": ours}
    try:
        import openturns as _  # noqa: F401
    except ImportError:
        print("OpenTURNS is not installed: no comparison")
    else:
        makers["OpenTURNS"] = openturns
    for (n, d), bar in BARS.items():
        for name, make in makers.items():
            clock = time.perf_counter()
            found = [make(n, d, seed) for seed in range(8)]
            each = (time.perf_counter() - clock) / 8
            middle, least = np.median(found), min(found)
            print(f"n={n} d={d} {name:9} median {middle:.4f} least {least:.4f} (bar {bar}) {each:.2f} s each")


if __name__ == "__main__":
    main()
