"""Random points that can be asked for by number.

Draw 1000 of a seed is the same, however many are drawn and in how many parts: a run can be resumed and made longer.

    z = normal_draws(3, 800, seed=1)                        # (800, 3), standard normal
    more = normal_draws(3, 800, seed=1, first=800)          # the next ones
    groups = replicates_of(1600)                            # (1600,), for `trainmj.doe.mean_interval`
"""

from __future__ import annotations

import warnings
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from trainmj.doe.arrays import FloatArray, check_choice
from trainmj.errors import InputError

DrawMethod = Literal["sobol", "random", "latin_hypercube"]

_BITS = 32  # of a coordinate, the most with which scipy goes forward; half a step from 0 and 1 is 6.3 deviations out
_MOST = 21201  # coordinates for which scipy has direction numbers
_BLOCK = 1024  # random points made at a time
_HYPERCUBE = 100  # points of a Latin hypercube: it cannot be made longer, so there is one after the other


def normal_draws(
    d: int, n: int, *, seed: int, method: DrawMethod = "sobol", first: int = 0, replicates: int = 8
) -> FloatArray:
    """Give the draws first, first + 1, ... of a seed as independent standard normal numbers (n, d).

    Args:
        d: number of coordinates.
        n: number of draws.
        seed: of the random numbers, at least 0.
        method: ``sobol``, scrambled Sobol' points; ``random``; or ``latin_hypercube``, hypercubes of 100 draws each.
        first: number of the first draw, from 0.
        replicates: of ``sobol``, how many independent scramblings take turns. Each is a quasi-random sample of its own,
            so their means tell the error (Owen 1997, doi 10.1214/aos/1031594731). Numbers of draws that are a power of
            two times this are spread best.

    Raises:
        InputError: a number below its least, an unknown method, or more coordinates than the method has (21 201).
    """
    check_choice("method", method, get_args(DrawMethod))
    for name, value, least in (("d", d, 1), ("n", n, 1), ("seed", seed, 0), ("first", first, 0)):
        if value < least:
            raise InputError(f"{name} must be at least {least} (got {value})")
    if method == "random":
        blocks = range(first // _BLOCK, (first + n - 1) // _BLOCK + 1)
        z = np.concatenate([_rng(seed, "random", b).standard_normal((_BLOCK, d)) for b in blocks])
        return z[first % _BLOCK :][:n]
    if method == "latin_hypercube":
        from scipy.stats import qmc

        cubes = range(first // _HYPERCUBE, (first + n - 1) // _HYPERCUBE + 1)
        made = np.concatenate([qmc.LatinHypercube(d, rng=_rng(seed, method, c)).random(_HYPERCUBE) for c in cubes])
        tiny = 2.0 ** -(_BITS + 1)
        return np.asarray(ndtri(np.clip(made, tiny, 1 - tiny))[first % _HYPERCUBE :][:n], dtype=np.float64)
    if replicates < 1:
        raise InputError(f"replicates must be at least 1 (got {replicates})")
    u = np.empty((n, d))
    for r in range(replicates):
        start = (r - first) % replicates  # row of the first draw of this replicate
        rows = u[start::replicates]
        if len(rows):
            rows[:] = sobol_units(d, len(rows), _rng(seed, method, r), (first + start) // replicates)
    return np.asarray(ndtri(u), dtype=np.float64)


def replicates_of(n: int, *, method: DrawMethod = "sobol", first: int = 0, replicates: int = 8) -> NDArray[np.int64]:
    """To which independent replicate each of the draws of `normal_draws` belongs, (n,).

    Raises:
        InputError: an unknown method.
    """
    check_choice("method", method, get_args(DrawMethod))
    k = np.arange(first, first + n)
    return k % replicates if method == "sobol" else k // (_HYPERCUBE if method == "latin_hypercube" else 1)


def sobol_units(d: int, n: int, rng: np.random.Generator, first: int = 0) -> FloatArray:
    """Scrambled Sobol' points (n, d) from number ``first`` on, inside (0, 1).

    Raises:
        InputError: d above 21 201.
    """
    from scipy.stats import qmc

    if d > _MOST:
        raise InputError(f"Sobol' points have at most {_MOST} coordinates (got {d}); take fewer, or random draws")
    sequence = qmc.Sobol(d, scramble=True, bits=_BITS, rng=rng)
    if first:
        sequence.fast_forward(first)
    with warnings.catch_warnings():  # that n is no power of two: parts of a sequence need not be
        warnings.simplefilter("ignore", UserWarning)
        u = sequence.random(n)
    return np.asarray(u + 2.0 ** -(_BITS + 1), dtype=np.float64)


def _rng(seed: int, method: DrawMethod, part: int) -> np.random.Generator:
    """Random numbers of one part of the draws, independent of those of all others."""
    return np.random.default_rng((seed, get_args(DrawMethod).index(method), part))
