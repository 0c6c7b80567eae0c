"""Floors: how far any law that is as smooth as ours must miss printed values, because these scatter.

Our responses follow a quadratic in D and M closely (of an acceleration, mass times it does), whatever the curves of the
devices; the printed ones scatter about any quadratic. By the triangle inequality a law misses the printed values by at
least what the best quadratic leaves of them, less what the best quadratic leaves of the law. The last is taken from our
own responses.
"""

from __future__ import annotations

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.paper.printed import EMPTY_STROKE_MM, MASS_T, rms

_TERMS = 6  # of a quadratic in two variables


def floor(measure: str, cases: Array, printed: Array, ours: Array, relative: bool, force: bool) -> float | None:
    """Least deviation of a law as smooth as ours; None where too few cases, or their mean, say nothing.

    Args:
        measure: of the deviations: "rms", "mean", or the largest: "largest", "each".
        cases: D [mm] and M [t] of each value, (n, 2).
        printed: published values, (n,).
        ours: our values, (n,).
        relative: whether deviations are parts of the printed values.
        force: whether mass times the values is smooth, rather than the values.
    """
    if measure == "mean" or len(np.unique(cases, axis=0)) <= _TERMS:
        return None
    scale = np.abs(printed) if relative else np.ones_like(printed)
    by_print, by_ours = (left_by_quadratic(measure, cases, values, scale, force) for values in (printed, ours))
    return max(0.0, by_print - by_ours)


def left_by_quadratic(measure: str, cases: Array, values: Array, scale: Array, force: bool = False) -> float:
    """What the quadratic that leaves least leaves of values (n,), in parts of a scale (n,): their rms, or the largest.

    The largest is found by linear programming, as the least bound that all deviations keep.
    """
    from scipy.optimize import linprog

    d, m = (cases - (EMPTY_STROKE_MM, MASS_T)).T / 10  # of order 1
    terms = np.stack([np.ones_like(d), d, m, d * d, m * m, d * m], axis=1)  # (n, 6)
    terms /= (scale * cases[:, 1] / MASS_T if force else scale)[:, None]
    values = values / scale
    if measure == "rms":
        return rms(values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0])
    bound = -np.ones((len(values), 1))
    rows = np.block([[terms, bound], [-terms, bound]])
    goal = np.append(np.zeros(_TERMS), 1.0)
    return float(linprog(goal, rows, np.append(values, -values), bounds=(None, None)).x[-1])
