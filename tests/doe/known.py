"""Functions whose answers are known, to try a method on before it is trusted with a simulation; a second opinion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from trainmj.doe import Factor, Space, hypervolume
from trainmj.doe.arrays import FloatArray


@dataclass(frozen=True)
class Problem:
    """An optimisation problem with its true front.

    Attributes:
        space: the factors.
        evaluate: X (n, d) -> objectives (n, 2), constraints (n, c) or None.
        front: points on the true front, densely, (k, 2).
    """

    space: Space
    evaluate: Callable[[FloatArray], tuple[FloatArray, FloatArray | None]]
    front: FloatArray = field(repr=False)


def zdt1(d: int = 30) -> Problem:
    """Give ZDT1 (Zitzler, Deb and Thiele 2000, doi 10.1162/106365600568202): a convex front, d factors."""

    def evaluate(x: FloatArray) -> tuple[FloatArray, None]:
        g = 1.0 + 9.0 * x[:, 1:].mean(axis=1)
        return np.stack([x[:, 0], g * (1.0 - np.sqrt(x[:, 0] / g))], axis=1), None

    f1 = np.linspace(0.0, 1.0, 20001) ** 2  # squared: the front is steep at 0
    return Problem(_box([(0.0, 1.0)] * d), evaluate, np.stack([f1, 1.0 - np.sqrt(f1)], axis=1))


def bnh() -> Problem:
    """Give BNH (Binh and Korn 1997): two factors, two constraints."""

    def evaluate(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        a, b = x.T
        y = np.stack([4 * a**2 + 4 * b**2, (a - 5) ** 2 + (b - 5) ** 2], axis=1)
        return y, np.stack([(a - 5) ** 2 + b**2 - 25, 7.7 - (a - 8) ** 2 - (b + 3) ** 2], axis=1)

    a = np.linspace(0.0, 5.0, 20001)
    front = evaluate(np.stack([a, np.minimum(a, 3.0)], axis=1))[0]
    return Problem(_box([(0.0, 5.0), (0.0, 3.0)]), evaluate, front)


def ctp1() -> Problem:
    """Give CTP1 (Deb, Pratap and Meyarivan 2001, doi 10.1007/3-540-44719-9_20): the constraints cut the front."""
    a, b = np.array([0.858, 0.728]), np.array([0.541, 0.295])

    def evaluate(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        g = 1.0 + x[:, 1]
        f1, f2 = x[:, 0], g * np.exp(-x[:, 0] / g)
        return np.stack([f1, f2], axis=1), a * np.exp(-b * f1[:, None]) - f2[:, None]

    f1 = np.linspace(0.0, 1.0, 20001)
    f2 = np.maximum(np.exp(-f1), (a * np.exp(-b * f1[:, None])).max(axis=1))
    return Problem(_box([(0.0, 1.0), (0.0, 1.0)]), evaluate, np.stack([f1, f2], axis=1))


def share(problem: Problem, values: FloatArray, beyond: float) -> float:
    """Part of the true hypervolume, up to ``beyond`` times the true front's range past its worst values."""
    reference = problem.front.max(axis=0) + beyond * np.ptp(problem.front, axis=0)
    return hypervolume(values, reference) / hypervolume(problem.front, reference)


def nsga2(problem: Problem, population: int, generations: int) -> FloatArray:
    """The front of pymoo's NSGA-II, (k, 2)."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem as Base
    from pymoo.optimize import minimize

    space = problem.space
    limits = problem.evaluate(space.lower[None])[1]
    constraints = 0 if limits is None else limits.shape[1]

    class Same(Base):
        def __init__(self) -> None:
            super().__init__(n_var=space.d, n_obj=2, n_ieq_constr=constraints, xl=space.lower, xu=space.upper)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"], limits = problem.evaluate(x)
            if limits is not None:
                out["G"] = limits

    return np.asarray(minimize(Same(), NSGA2(pop_size=population), ("n_gen", generations), seed=1).F)


def ishigami(x: FloatArray, a: float = 7.0, b: float = 0.1) -> FloatArray:
    """Give Ishigami's function of three factors in [-pi, pi], (n, 3) -> (n,).

    With the default a and b the first-order Sobol' indices are 0.3139, 0.4424, 0 and the total ones 0.5576, 0.4424,
    0.2437 (Ishigami and Homma 1990, doi 10.1109/ISUMA.1990.151285).
    """
    return np.asarray(np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0]))


G_TERMS = np.array([0, 1, 4.5, 9, 99, 99, 99, 99])


def g_function(u: FloatArray) -> FloatArray:
    """Give Sobol's g-function of eight factors in [0, 1], (n, 8) -> (n,)."""
    return np.asarray(np.prod((np.abs(4 * u - 2) + G_TERMS) / (1 + G_TERMS), axis=1))


def g_shares() -> tuple[FloatArray, FloatArray]:
    """First-order and total indices of the g-function, (8,) each (Saltelli et al. 2010)."""
    parts = 1 / (3 * (1 + G_TERMS) ** 2)
    others = np.array([np.prod(1 + np.delete(parts, i)) for i in range(8)])
    variance = np.prod(1 + parts) - 1
    return parts / variance, parts * others / variance


def _box(bounds: list[tuple[float, float]]) -> Space:
    return Space(tuple(Factor(f"x{i + 1}", low, high) for i, (low, high) in enumerate(bounds)))
