"""Weights of criteria: by entropy, or the user's own.

`Weights.description` says how they were found:

    entropy_weights(values)                       # the criterion that varies more counts more
    entropy_weights(values, normalised=False)     # entropies not divided by ln n: nearly equal weights
    own_weights({"TS": 2, "TAMA": 1})             # scaled to add up to 1
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlogy

from trainmj.doe.arrays import FloatArray, as_matrix, as_names, check_choice, frozen
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
    _need_variation(values, "T-scores")
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
    (Eqs 15 to 18 of doi 10.1186/s10033-022-00755-8).

    Args:
        values: criteria of each alternative, (n, m), at least 0.
        normalised: divide the entropies by ln n, their largest value (k = 1 / ln n, Shannon's measure): entropies in
            [0, 1], more weight to the criterion that varies more. Without it (k = 1, as that paper computes) entropies
            are near ln n, differences negative, weights nearly equal, and the criterion that varies LESS gets more.
        transform: ``raw`` takes the values as they are, ``t_score`` those of `t_scores`, ``min_max`` scales each
            criterion to [0, 1]. They give different weights.
        names: of the criteria; y1, y2, ... if None.

    Raises:
        InputError: fewer than 2 alternatives, negative values, a criterion of zeros, no variation at all, or an unknown
            transform.
    """
    check_choice("transform", transform, get_args(Transform))
    x = as_matrix("values", values)
    n, m = x.shape
    labels = as_names("names", names, m, "y")
    if n < 2:
        raise InputError(f"entropy weights need at least 2 alternatives (got {n})")
    if transform == "t_score":
        x = t_scores(x)
    elif transform == "min_max":
        _need_variation(x, "min_max")
        x = (x - x.min(axis=0)) / np.ptp(x, axis=0)
    bad = (x < 0).any(axis=0) | (x.sum(axis=0) <= 0)
    if bad.any():
        raise InputError(
            f"criterion {labels[int(np.argmax(bad))]!r} must not be negative, nor zero throughout, to have shares; "
            "try transform='min_max'"
        )
    p = x / x.sum(axis=0)
    entropy = -xlogy(p, p).sum(axis=0) / (np.log(n) if normalised else 1.0)
    difference = 1.0 - entropy
    total = difference.sum()
    if abs(total) < 1e-12:
        raise InputError("the criteria must vary between the alternatives: equal values carry no information to weigh")
    said = f"entropy{'' if normalised else ' not'} divided by ln n, {transform.replace('_', '-')} data"
    return Weights(labels, frozen(difference / total), frozen(entropy), frozen(difference), said)


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
        raise InputError(f"weights must be at least 0 and not all 0 (got {given})")
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def _need_variation(values: FloatArray, what: str) -> None:
    constant = np.flatnonzero(np.ptp(values, axis=0) == 0.0)
    if constant.size:
        raise InputError(f"{what} need criteria that vary (columns {constant.tolist()} do not); leave them out")
