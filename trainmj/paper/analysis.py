"""The study of Sections 7 and 8 on a table of ten responses: the published Table 9, or ours at the same points.

What the paper leaves open is decided here once: the surrogates that keep the limits of Eq. (12) are quadratic, the
search is a swarm on whole millimetres and tenths of a tonne, and the decision is a weighted sum of criteria scaled to
[0, 1] over the front.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.device import Array
from trainmj.doe import (
    Correlation,
    Factor,
    Front,
    Lattice,
    Polynomial,
    Space,
    SwarmOptions,
    accuracy,
    correlate,
    entropy_weights,
    fit_polynomial,
    full_order,
    mopso,
    parse_terms,
    weighted_sum,
)
from trainmj.paper.printed import LIMIT_ANTI_CLIMBER_MM, LIMIT_OTHERS_MM, split_unit

if TYPE_CHECKING:
    import pandas as pd

SPACE = Space((Factor("D", 20, 50, unit="mm"), Factor("M", 30, 36, unit="t")))
"""The factors and their ranges, Section 4.1."""

TERMS = ("1", "D", "M", "D^2", "M^2", "D*M", "D^3", "M^3")
"""Terms of Eqs (7) and (8)."""

CRITERIA = {"TS": "TS_mm", "TAMA": "TAMA_g"}
"""What is minimised, with its head in Table 9."""

CONSTRAINTS = {
    "anti_climber_mm": LIMIT_ANTI_CLIMBER_MM,
    "stroke_m1_m2_mm": LIMIT_OTHERS_MM,
    "stroke_m2_m3_mm": LIMIT_OTHERS_MM,
}
"""Largest strokes that Eq. (12) allows, of those that Table 9 has."""

RESOLUTION = {"D": 1.0, "M": 0.1}
"""Designs that differ by less are one; the optimum of Table 13 is given so."""

_ORDER = 2  # of the constraints' surrogates; the paper states none
_SEED = 1


@dataclass(frozen=True, eq=False)
class Analysis:
    """Surrogates, front and choice from one table of responses.

    Attributes:
        responses: factors and responses, heads as in Table 9.
        correlation: Pearson's r of factors and responses, Eq. (3) and Table 10.
        models: cubic surrogate of each criterion, Eqs (7) and (8).
        limits: surrogate of each constrained stroke.
        front: designs of which none is better in both criteria, on the surrogates.
        points: those designs, D [mm] and M [t], (k, 2).
        chosen: the one that the weights choose, as D, M.
    """

    responses: pd.DataFrame = field(repr=False)
    correlation: Correlation = field(repr=False)
    models: Mapping[str, Polynomial] = field(repr=False)
    limits: Mapping[str, Polynomial] = field(repr=False)
    front: Front = field(repr=False)
    points: Array = field(repr=False)
    chosen: tuple[float, float]

    def predict(self, D_mm: float, M_t: float) -> dict[str, float]:
        """Both criteria on the surrogates at one design, heads as in Table 9."""
        return {head: float(self.models[name].predict([[D_mm, M_t]])[0]) for name, head in CRITERIA.items()}

    def front_table(self) -> pd.DataFrame:
        """The front: designs, criteria, and the constrained strokes on their surrogates."""
        import pandas as pd

        designs = {"D_mm": self.points[:, 0], "M_t": self.points[:, 1]}
        criteria = np.asarray(self.front.values).T
        values = dict(zip(CRITERIA.values(), criteria, strict=True))
        return pd.DataFrame(designs | values | {head: m.predict(self.points) for head, m in self.limits.items()})

    def coefficients(self) -> pd.DataFrame:
        """Eqs (7) and (8): a row for each term."""
        import pandas as pd

        found = {head: self.models[name].coefficients() for name, head in CRITERIA.items()}
        return pd.DataFrame(found).loc[list(TERMS)]

    def accuracies(self) -> pd.DataFrame:
        """Table 11: errors of each point left out in turn, over the range of the response."""
        import pandas as pd

        rows = []
        for name, head in CRITERIA.items():
            found = accuracy(self.responses[head], self.models[name].leave_one_out(), over="range")
            rows.append({"ARE": found.are, "RMSE": found.rmse, "R2": found.r2})
        return pd.DataFrame(rows)


def entropies(responses: pd.DataFrame) -> pd.DataFrame:
    """Table 12: entropy, difference coefficient and weight of each criterion, Eqs (15) to (18) on the responses."""
    return entropy_weights(responses[list(CRITERIA.values())], normalised=False, names=tuple(CRITERIA)).table()


def points_of(responses: pd.DataFrame) -> Array:
    """D and M of each row, (n, 2)."""
    return responses[["D_mm", "M_t"]].to_numpy(dtype=np.float64)


def analyse(responses: pd.DataFrame) -> Analysis:
    """Go from ten responses to the chosen design.

    Args:
        responses: heads as in Table 9.
    """
    x = points_of(responses)
    heads = [str(head) for head in responses.columns if head not in ("test", "D_mm", "M_t")]
    names = [split_unit(head)[0] for head in heads]
    correlation = correlate(x, responses[heads], x_names=SPACE.names, y_names=names)
    terms = parse_terms(TERMS, SPACE.names)
    models = {name: fit_polynomial(x, responses[head], space=SPACE, terms=terms) for name, head in CRITERIA.items()}
    limits = fit_limits(responses, _ORDER)
    front, points = _search(models, limits)
    return Analysis(responses, correlation, models, limits, front, points, _choose(responses, front, points))


def fit_limits(responses: pd.DataFrame, order: int) -> dict[str, Polynomial]:
    """Surrogates of the constrained strokes: all terms up to an order, for 3 those of Eqs (7) and (8)."""
    terms = full_order(SPACE.d, order) if order < 3 else parse_terms(TERMS, SPACE.names)
    x = points_of(responses)
    return {head: fit_polynomial(x, responses[head], space=SPACE, terms=terms) for head in CONSTRAINTS}


def chosen_with(analysis: Analysis, order: int) -> tuple[float, float]:
    """The design that would be chosen with surrogates of the constraints of another order, as D, M."""
    front, points = _search(analysis.models, fit_limits(analysis.responses, order))
    return _choose(analysis.responses, front, points)


def _search(models: Mapping[str, Polynomial], limits: Mapping[str, Polynomial]) -> tuple[Front, Array]:
    """The front of Eq. (12) on surrogates, and its designs."""
    lattice = Lattice(SPACE, RESOLUTION)

    def evaluate(steps: Array) -> tuple[Array, Array]:
        at = lattice.natural(steps)
        criteria = [models[name].predict(at) for name in CRITERIA]
        excess = [limits[head].predict(at) - most for head, most in CONSTRAINTS.items()]
        return np.stack(criteria, axis=1), np.stack(excess, axis=1)

    front = mopso(
        lattice.steps,
        evaluate,
        seed=_SEED,
        constraints=list(CONSTRAINTS),
        options=SwarmOptions(),
    )
    return front, lattice.natural(front.points)


def _choose(responses: pd.DataFrame, front: Front, points: Array) -> tuple[float, float]:
    best = weighted_sum(front.values, entropies(responses)["weight"].to_numpy()).best
    return float(points[best, 0]), float(points[best, 1])
