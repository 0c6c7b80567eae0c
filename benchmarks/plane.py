"""The vertical plane: random trains beside an integration of their equations by scipy.

    python benchmarks/plane.py [--trains N] [--seconds S]

The trains are those of trainmj.verification.mixed.random_train; differences are relative to the largest of their kind
in each train. What a step costs is measured by ``performance.py``.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from trainmj.errors import EngineError
from trainmj.verification import plane


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
    parser.add_argument("--trains", type=int, default=16, help="how many random trains to compare")
    parser.add_argument("--seconds", type=float, default=0.5, help="how long each is followed")
    given = parser.parse_args()
    trains(given.trains, given.seconds)


if __name__ == "__main__":
    main()
