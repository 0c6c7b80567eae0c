"""The swarm on ZDT1, BNH and CTP1: share of the true hypervolume and time, beside pymoo's NSGA-II if it is installed.

    python benchmarks/swarm.py

The bars: 0.99 of the true hypervolume, every point feasible, 3 s. The reference lies a tenth of the true front's range
beyond its worst values; the share with the reference at the worst values themselves, which is harder, stands beside it.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from trainmj.doe import hypervolume, mopso

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "study"))
from known import Problem, bnh, ctp1, zdt1


def shares(problem: Problem, values: np.ndarray) -> tuple[float, float]:
    """Parts of the true hypervolume, reference a tenth beyond and at the worst values."""
    worst, spread = problem.front.max(axis=0), np.ptp(problem.front, axis=0)
    corners = (worst + 0.1 * spread, worst + 1e-9)
    a, b = (hypervolume(values, c) / hypervolume(problem.front, c) for c in corners)
    return a, b


def nsga2(problem: Problem, evaluations: int, seed: int) -> np.ndarray:
    """The front of pymoo's NSGA-II with as many evaluations, (k, 2)."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem as Base
    from pymoo.optimize import minimize

    limits = problem.evaluate(problem.space.round([problem.space.lower]))[1]
    constraints = 0 if limits is None else limits.shape[1]

    class Same(Base):
        def __init__(self) -> None:
            low, high = problem.space.lower, problem.space.upper
            super().__init__(n_var=problem.space.d, n_obj=2, n_ieq_constr=constraints, xl=low, xu=high)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"], g = problem.evaluate(x)
            if g is not None:
                out["G"] = g

    return np.asarray(minimize(Same(), NSGA2(pop_size=200), ("n_gen", evaluations // 200), seed=seed).F)


def main() -> None:
    """Print one line for each problem and optimiser."""
    try:
        import pymoo as _  # noqa: F401

        with_oracle = True
    except ImportError:
        with_oracle = False
        print("pymoo is not installed: no comparison")
    for name, problem in (("ZDT1", zdt1()), ("BNH", bnh()), ("CTP1", ctp1())):
        found, seconds, feasible, evaluations = [], [], True, 0
        for seed in range(8):
            clock = time.perf_counter()
            front = mopso(problem.space, problem.evaluate, seed=seed)
            seconds.append(time.perf_counter() - clock)
            found.append(shares(problem, front.values))
            feasible &= bool((front.limits <= 0).all())
            evaluations = max(evaluations, front.history[-1].evaluations)
        (low, hard), slow = np.min(found, axis=0), max(seconds)
        print(f"{name:5} trainmj {low:.4f} / {hard:.4f} (least of 8), feasible {feasible}, {slow:.2f} s (longest)")
        if with_oracle:
            clock = time.perf_counter()
            a, b = shares(problem, nsga2(problem, evaluations, 1))
            print(f"{name:5} NSGA-II {a:.4f} / {b:.4f}, {time.perf_counter() - clock:.2f} s")


if __name__ == "__main__":
    main()
