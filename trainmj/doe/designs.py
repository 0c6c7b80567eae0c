"""Designs of experiments: where in the space to compute, and how well the points fill it.

    design = optimal_latin_hypercube(space, 10, seed=1)
    design.points            # (10, d) natural values, integers rounded
    design.quality()         # smallest distance, phi_p, centred discrepancy, distinct levels

The same seed gives the same design on every machine. Distances are taken after rounding, with every factor scaled to
[0, 1] by its bounds, so designs with integer factors are judged as they will be run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from trainmj.doe.anneal import phi_p, smallest_distance, spread_columns
from trainmj.doe.arrays import FloatArray, check_choice, frozen
from trainmj.doe.space import Space
from trainmj.errors import InputError


@dataclass(frozen=True)
class Quality:
    """How well a design fills its space.

    Attributes:
        smallest_distance: between any two points, factors scaled to [0, 1]; larger is better.
        phi_p: (sum over pairs of distance^-p)^(1/p), p = 50; smaller is better, infinite if two points coincide
            (Morris and Mitchell 1995, doi 10.1016/0378-3758(94)00035-T).
        centred_discrepancy: distance from a uniform spread; smaller is better (Hickernell 1998,
            doi 10.1090/S0025-5718-98-00894-1).
        levels: number of distinct values of each factor, (d,).
    """

    smallest_distance: float
    phi_p: float
    centred_discrepancy: float
    levels: tuple[int, ...]


@dataclass(frozen=True)
class Design:
    """The points of a design, made by a function of this module or chosen by somebody else.

    Attributes:
        space: the factors.
        points: natural values, (n, d), within the bounds, integers and choices on their levels; read-only.
        method: how the points were made, in words.
        seed: of the random numbers; None if there were none.
    """

    space: Space
    points: FloatArray = field(repr=False)
    method: str = "given"
    seed: int | None = None

    def __post_init__(self) -> None:
        """Raise InputError if a point is outside the bounds or off the levels."""
        object.__setattr__(self, "points", frozen(self.space.check(self.points)))

    def quality(self) -> Quality:
        """Measure how well the points fill the space."""
        from scipy.stats import qmc

        unit = self.space.to_unit(self.points)
        return Quality(
            smallest_distance=smallest_distance(unit),
            phi_p=phi_p(unit),
            centred_discrepancy=float(qmc.discrepancy(np.clip(unit, 0.0, 1.0), method="CD")),
            levels=tuple(len(np.unique(column)) for column in self.points.T),
        )


def optimal_latin_hypercube(
    space: Space,
    n: int,
    *,
    seed: int,
    chains: int = 8,
    iterations: int | None = None,
    levels: Literal["edge", "centre"] = "edge",
) -> Design:
    """Make the Latin hypercube whose closest points are farthest apart (maximin, by phi_p).

    Args:
        space: the factors.
        n: number of points, at least 2.
        seed: of the random numbers.
        chains: independent annealings; the best result is kept.
        iterations: exchanges each chain tries; 200 n if None (at most 40 000).
        levels: ``edge`` puts the n levels from bound to bound; ``centre`` in the middle of n equal cells, as tables of
            maximin designs do. Integers are rounded from there. A factor of fewer than n values, integer or choice,
            takes each of them n / count times, rounded up or down; no point occurs twice.

    Raises:
        InputError: fewer than 2 points, or more than the levels of the factors can tell apart.
    """
    if n < 2:
        raise InputError(f"n must be at least 2 for a Latin hypercube (got {n})")
    check_choice("levels", levels, ("edge", "centre"))
    if chains < 1 or (iterations is not None and iterations < 1):
        raise InputError(f"chains and iterations must be at least 1 (got {chains}, {iterations})")
    distinct = math.prod(f.count or math.inf for f in space.factors)
    if n > distinct:
        raise InputError(
            f"n must not exceed the {distinct} different points of this space (got {n}); use full_factorial"
        )
    columns = space.to_unit(_levels(space, n, levels)).T
    rng = np.random.default_rng(seed)
    unit = spread_columns(columns, rng, chains=chains, iterations=iterations or min(200 * n, 40_000))
    return Design(space, space.from_unit(unit), f"optimal Latin hypercube (maximin phi_p, {levels} levels)", seed)


def _levels(space: Space, n: int, levels: str) -> FloatArray:
    """The n values that each factor takes in a Latin hypercube, rounded to what it can be, (n, d)."""
    j = np.arange(n)
    share = j / (n - 1) if levels == "edge" else (j + 0.5) / n
    x = space.from_unit(np.tile(share[:, None], (1, space.d)))
    for i, factor in enumerate(space.factors):
        count = factor.count
        if count is not None and (count < n or factor.kind == "choice"):
            # rounding would give outer levels fewer points; midpoints give both ends the same, in whole numbers
            x[:, i] = factor.lower + (2 * j + 1) * count // (2 * n)
    return x


def full_factorial(space: Space, levels: Sequence[int | None] | None = None) -> Design:
    """Make every combination of evenly spaced levels, the last factor changing fastest.

    Args:
        space: the factors.
        levels: how many of each factor, (d,); None takes every value of an integer or choice.

    Raises:
        InputError: a continuous factor without levels, fewer than 2, or more than an integer or choice has.
    """
    wanted = [None] * space.d if levels is None else levels
    if len(wanted) != space.d:
        raise InputError(f"levels must give one number for each of the {space.d} factors (got {len(wanted)})")
    axes = []
    for factor, count in zip(space.factors, wanted, strict=True):
        most = factor.count
        k = most if count is None else count
        if k is None:
            raise InputError(
                f"factor {factor.name!r} is continuous: levels must say how many values it takes (got None)"
            )
        if k < 2 or (most is not None and k > most):
            limit = "" if most is None else f" and at most {most}"
            raise InputError(f"factor {factor.name!r}: levels must be at least 2{limit} (got {k})")
        axes.append(np.linspace(factor.lower, factor.upper, k))
    return Design(space, space.round(_grid(axes)), "full factorial")


def central_composite(space: Space, *, kind: Literal["face", "inscribed"] = "face") -> Design:
    """Make a central composite design: corners, axis points and the centre, 2^d + 2 d + 1 points within the bounds.

    Args:
        space: the factors; integers are rounded.
        kind: ``face`` has corners and axis points on the bounds; ``inscribed`` has the axis points on the bounds and
            the corners drawn in by 2^(d/4), so that the prediction variance depends on the distance from the centre
            only.

    Raises:
        InputError: a choice among the factors, which has no centre, or an unknown kind.
    """
    choices = [f.name for f in space.factors if f.kind == "choice"]
    if choices:
        raise InputError(
            f"a central composite design needs a centre, and a choice has none (got {choices}); use full_factorial"
        )
    check_choice("kind", kind, ("face", "inscribed"))
    d = space.d
    reach = 1.0 if kind == "face" else 2.0 ** (-d / 4)
    corners = _grid([np.array([-reach, reach])] * d)
    coded = np.concatenate([corners, -np.eye(d), np.eye(d), np.zeros((1, d))])
    return Design(space, space.from_unit((coded + 1.0) / 2.0), f"central composite ({kind})")


def _grid(axes: Sequence[FloatArray]) -> FloatArray:
    """Every combination of the values of d axes, (product of their lengths, d)."""
    return np.stack([values.ravel() for values in np.meshgrid(*axes, indexing="ij")], axis=1)


def sobol(space: Space, n: int, *, seed: int) -> Design:
    """Make the first n points of a scrambled Sobol sequence, every level of an integer or choice with an equal share.

    A power of two is spread best.

    Raises:
        InputError: n < 1.
    """
    from scipy.stats import qmc

    if n < 1:
        raise InputError(f"n must be at least 1 (got {n})")
    sequence = qmc.Sobol(space.d, scramble=True, rng=np.random.default_rng(seed))
    unit = sequence.random_base2(math.ceil(math.log2(n)))[:n]
    return Design(space, space.from_quantile(unit), "Sobol sequence (scrambled)", seed)
