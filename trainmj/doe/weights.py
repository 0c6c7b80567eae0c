"""Weights of criteria: by entropy, or the user's own.

`Weights.description` says how they were found:

    entropy_weights(values)                       # the criterion that varies more counts more
    entropy_weights(values, normalised=False)     # entropies not divided by ln n: nearly equal weights
    own_weights({"TS": 2, "TAMA": 1})             # scaled to add up to 1
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlog1py

from trainmj.doe.arrays import FloatArray, as_matrix, as_names, check_choice, frozen, varies
from trainmj.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Transform = Literal["raw", "t_score", "min_max"]


@dataclass(frozen=True)
class Weights:
    """Weights of the criteria, and where they come from.

    Attributes:
        names: the criteria, (m,).
        weight: they add up to 1, (m,).
        entropy: of each criterion, (m,); nan for the user's own weights.
        difference: 1 - entropy, (m,); nan for the user's own weights.
        description: method and data.
    """

    names: tuple[str, ...]
    weight: FloatArray
    entropy: FloatArray
    difference: FloatArray
    description: str

    def table(self) -> pd.DataFrame:
        """A row for each criterion: entropy, difference, weight."""
        import pandas as pd

        columns = {"entropy": self.entropy, "difference": self.difference, "weight": self.weight}
        return pd.DataFrame(columns, index=list(self.names)).rename_axis("criterion")


def t_scores(values: ArrayLike) -> FloatArray:
    """Standardise each criterion (n, m) to mean 50 and deviation 10: Eqs (13), (14) of doi 10.1186/s10033-022-00755-8.

    The deviation is the root of the mean square (divided by n); "mean squared error" in the paper.

    Raises:
        InputError: a criterion that does not vary.
    """
    values = as_matrix("values", values)
    if not varies(values).all():
        still = np.flatnonzero(~varies(values)).tolist()
        raise InputError(f"T-scores need criteria that vary (columns {still} do not); leave them out")
    return np.asarray(10.0 * (values - values.mean(axis=0)) / values.std(axis=0) + 50.0, dtype=np.float64)


def entropy_weights(
    values: ArrayLike,
    *,
    normalised: bool = True,
    transform: Transform = "raw",
    names: Sequence[str] | None = None,
) -> Weights:
    """Weigh criteria by how unevenly they are spread over the alternatives.

    p_ij = x_ij / sum_i x_ij; e_j = -k sum_i p_ij ln p_ij; g_j = 1 - e_j; w_j = g_j / sum g_j
    (Eqs 15 to 18 of doi 10.1186/s10033-022-00755-8). A criterion that does not vary has equal shares, whatever its
    value and the transform, and tells no alternatives apart: its weight is exactly 0.

    Args:
        values: criteria of each alternative, (n, m).
        normalised: divide the entropies by ln n, their largest value (k = 1 / ln n, Shannon's measure): entropies in
            [0, 1], more weight to the criterion that varies more. Without it (k = 1, as that paper computes) entropies
            are near ln n, differences negative, weights nearly equal, and the criterion that varies LESS gets more.
        transform: ``raw`` takes the values as they are, ``t_score`` those of `t_scores`, ``min_max`` scales each
            criterion to [0, 1]. They give different weights.
        names: of the criteria; y1, y2, ... if None.

    Raises:
        InputError: fewer than 2 alternatives, no variation at all, an unknown transform, or, naming the criterion and
            what works instead, one whose values would be negative where shares are taken, or whose weight would be.
    """
    check_choice("transform", transform, get_args(Transform))
    x = as_matrix("values", values)
    n, m = x.shape
    labels = as_names("names", names, m, "y")
    if n < 2:
        raise InputError(f"entropy weights need at least 2 alternatives (got {n}): give equal weights, or your own")
    if not varies(x).any():
        raise InputError(
            f"no criterion ({', '.join(labels)}) varies between the alternatives, so there is no information to weigh "
            "them by: give equal weights, or your own"
        )
    found = _weighed(x, normalised, transform, labels)
    if isinstance(found, Weights):
        return found
    raise InputError(f"{found}: {_cure(x, normalised, transform, labels)}")


def _weighed(x: FloatArray, normalised: bool, transform: Transform, names: tuple[str, ...]) -> Weights | str:
    """The weights, or why there are none; at least one criterion varies."""
    n, uneven = len(x), varies(x)
    shares = np.full(x.shape, 1.0 / n)
    data = _TRANSFORMS[transform](x[:, uneven])
    low = data.min(axis=0, initial=0.0)
    below = [repr(names[k]) for k, least in zip(np.flatnonzero(uneven), low, strict=True) if least < 0]
    if below:
        what = f"criterion {below[0]} has" if len(below) == 1 else f"criteria {', '.join(below)} have"
        return f"{what} negative values{'' if transform == 'raw' else f' as {transform} data'}, which have no shares"
    shares[:, uneven] = data / data.sum(axis=0)
    # 1 - e as a mean of terms that are none of them negative: nothing is lost to rounding where values hardly vary
    off = np.where(uneven, n * shares - 1.0, 0.0)
    lost = np.maximum(0.0, (xlog1py(1.0 + off, off) - off).mean(axis=0))  # ln n - e of k = 1
    difference = lost / np.log(n) if normalised else 1.0 - np.log(n) + lost
    weight = np.where(uneven, difference / difference[uneven].sum(), 0.0)
    if (weight < 0).any() or not np.isfinite(weight).all():
        negative = ", ".join(f"{name!r} {w:.4g}" for name, w in zip(names, weight, strict=True) if not w >= 0)
        return f"entropies that are not normalised give negative weights ({negative})"
    said = f"entropy{'' if normalised else ' not'} divided by ln n, {transform.replace('_', '-')} data"
    return Weights(names, frozen(weight), frozen(1.0 - difference), frozen(difference), said)


def _cure(x: FloatArray, normalised: bool, transform: Transform, names: tuple[str, ...]) -> str:
    """What works for these values instead, in words that hold for a call and for a study file."""
    ways: tuple[Transform, ...] = ("min_max", "t_score", "raw")
    for whether, other in itertools.product((normalised, True), ways):
        if isinstance(_weighed(x, whether, other, names), Weights):
            new = [f"{other} data"] * (other != transform) + ["normalised entropies"] * (whether != normalised)
            return f"take {' and '.join(new)}"
    return "give equal weights, or your own"


def own_weights(weights: Mapping[str, float]) -> Weights:
    """Take the user's weights, scaled to add up to 1.

    Raises:
        InputError: none, a negative one, or all zero.
    """
    w = to_one(np.array(list(weights.values()), dtype=np.float64), dict(weights))
    nothing = np.full(w.size, np.nan)
    return Weights(tuple(weights), frozen(w), nothing, nothing, "given by the user")


def to_one(weights: FloatArray, given: object) -> FloatArray:
    """Scale weights (m,) to add up to 1; a message shows them as they were given."""
    if weights.size == 0 or not np.isfinite(weights).all() or (weights < 0).any() or weights.sum() <= 0:
        raise InputError(f"weights must be finite, at least 0 and not all 0 (got {given})")
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def _min_max(values: FloatArray) -> FloatArray:
    return np.asarray((values - values.min(axis=0)) / np.ptp(values, axis=0), dtype=np.float64)


_TRANSFORMS: Mapping[Transform, Callable[[FloatArray], FloatArray]] = {
    "raw": lambda values: values,
    "t_score": t_scores,
    "min_max": _min_max,
}
