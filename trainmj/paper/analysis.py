"""The study of Sections 7 and 8 on a table of ten responses: the published Table 9, or ours at the same points.

What the paper leaves open is decided here once: the surrogates that keep the limits of Eq. (12) are quadratic, the
search is a swarm on whole millimetres and tenths of a tonne, and the decision is a weighted sum of criteria scaled to
[0, 1] over the front.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd

from trainmj.collision.envelope import Array
from trainmj.doe import (
    Correlation,
    Factor,
    Front,
    Lattice,
    Polynomial,
    Space,
    accuracy,
    correlate,
    entropy_weights,
    fit_polynomial,
    full_order,
    mopso,
    parse_terms,
    weighted_sum,
)
from trainmj.paper.printed import LIMIT_ANTI_CLIMBER_MM, LIMIT_OTHERS_MM, STROKES, published, split_unit

SPACE = Space((Factor("D", 20, 50, unit="mm"), Factor("M", 30, 36, unit="t")))
"""The factors and their ranges, Section 4.1."""

TERMS = ("1", "D", "M", "D^2", "M^2", "D*M", "D^3", "M^3")
"""Terms of Eqs (7) and (8)."""

CRITERIA = {"TS": "TS_mm", "TAMA": "TAMA_g"}
"""What is minimised, with its head in Table 9."""

CONSTRAINTS = dict(zip(STROKES, (LIMIT_ANTI_CLIMBER_MM, LIMIT_OTHERS_MM, LIMIT_OTHERS_MM), strict=True))
"""Largest strokes that Eq. (12) allows, of those that Table 9 has."""

RESOLUTION = {"D": 1.0, "M": 0.1}
"""Designs that differ by less are one; the optimum of Table 13 is given so."""


@dataclass(frozen=True, eq=False)
class Analysis:
    """Surrogates, front and choice from one table of responses."""

    responses: pd.DataFrame  # factors and responses, heads as in Table 9
    correlation: Correlation  # Pearson's r of factors and responses, Eq. (3) and Table 10
    models: Mapping[str, Polynomial]  # cubic surrogate of each criterion, Eqs (7) and (8)
    limits: Mapping[str, Polynomial]  # surrogate of each constrained stroke
    front: Front  # designs of which none is better in both criteria, on the surrogates
    points: Array  # those designs, D [mm] and M [t], (k, 2)
    chosen: tuple[float, float]  # the one that the weights choose, as D, M

    def predict(self, D_mm: float, M_t: float) -> dict[str, float]:
        """Both criteria on the surrogates at one design, heads as in Table 9."""
        return {head: float(self.models[name].predict([[D_mm, M_t]])[0]) for name, head in CRITERIA.items()}

    def front_table(self) -> pd.DataFrame:
        """The front: designs, criteria, and the constrained strokes on their surrogates."""
        designs = {"D_mm": self.points[:, 0], "M_t": self.points[:, 1]}
        criteria = dict(zip(CRITERIA.values(), np.asarray(self.front.values).T, strict=True))
        return pd.DataFrame(designs | criteria | {head: m.predict(self.points) for head, m in self.limits.items()})

    def coefficients(self) -> pd.DataFrame:
        """Eqs (7) and (8): a row for each term."""
        found = {head: self.models[name].coefficients() for name, head in CRITERIA.items()}
        return pd.DataFrame(found).loc[list(TERMS)]

    def accuracies(self) -> pd.DataFrame:
        """Table 11: errors of each point left out in turn, over the range of the response."""
        left = ((self.responses[head], self.models[name].leave_one_out()) for name, head in CRITERIA.items())
        found = [accuracy(y, predicted, over="range") for y, predicted in left]
        return pd.DataFrame([{"ARE": a.are, "RMSE": a.rmse, "R2": a.r2} for a in found])


def entropies(responses: pd.DataFrame) -> pd.DataFrame:
    """Table 12: entropy, difference coefficient and weight of each criterion, Eqs (15) to (18) on the responses."""
    return entropy_weights(responses[list(CRITERIA.values())], normalised=False, names=tuple(CRITERIA)).table()


def points_of(responses: pd.DataFrame) -> Array:
    """D and M of each row, (n, 2)."""
    return responses[["D_mm", "M_t"]].to_numpy(dtype=np.float64)


def analyse(responses: pd.DataFrame, order: int = 2) -> Analysis:
    """Go from ten responses to the chosen design.

    Args:
        responses: heads as in Table 9.
        order: of the constraints' surrogates, for 3 the terms of Eqs (7) and (8); the paper states none.
    """
    x = points_of(responses)
    heads = [str(head) for head in responses.columns if head not in ("test", "D_mm", "M_t")]
    names = [split_unit(head)[0] for head in heads]
    correlation = correlate(x, responses[heads], x_names=SPACE.names, y_names=names)
    cubic = parse_terms(TERMS, SPACE.names)
    models = {name: fit_polynomial(x, responses[head], space=SPACE, terms=cubic) for name, head in CRITERIA.items()}
    terms = full_order(SPACE.d, order) if order < 3 else cubic
    limits = {head: fit_polynomial(x, responses[head], space=SPACE, terms=terms) for head in CONSTRAINTS}
    front, points = _search(models, limits)
    best = weighted_sum(front.values, entropies(responses)["weight"].to_numpy()).best
    return Analysis(
        responses, correlation, models, limits, front, points, (float(points[best, 0]), float(points[best, 1]))
    )


@cache
def from_table_9() -> Analysis:
    """The paper's study, redone on its own Table 9."""
    return analyse(published("9"))


def _search(models: Mapping[str, Polynomial], limits: Mapping[str, Polynomial]) -> tuple[Front, Array]:
    """The front of Eq. (12) on surrogates, and its designs."""
    lattice = Lattice(SPACE, RESOLUTION)

    def evaluate(steps: Array) -> tuple[Array, Array]:
        at = lattice.natural(steps)
        criteria = [models[name].predict(at) for name in CRITERIA]
        excess = [limits[head].predict(at) - most for head, most in CONSTRAINTS.items()]
        return np.stack(criteria, axis=1), np.stack(excess, axis=1)

    front = mopso(lattice.steps, evaluate, seed=1, constraints=list(CONSTRAINTS))
    return front, lattice.natural(front.points)
