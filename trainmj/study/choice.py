"""The last steps of a study: weights of the objectives, the choice of one design, its check by simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from trainmj.collision.status import UNUSABLE
from trainmj.doe import (
    Ranking,
    Weights,
    entropy_weights,
    knee_point,
    own_weights,
    topsis,
    weight_sensitivity,
    weighted_sum,
)
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.study import figures_front as figures
from trainmj.study.designs import Designs, Simulates
from trainmj.study.file import DecisionPart, EntropyWeights, KneePoint, OwnWeights, Topsis, WeightedSum
from trainmj.study.folder import Output, Tables
from trainmj.study.plan import Study

_SAMPLES = 500  # of weights near the given ones
_METHODS: dict[str, DecisionPart] = {
    "weighted sum": WeightedSum(method="weighted_sum"),
    "TOPSIS": Topsis(),
    "knee point": KneePoint(method="knee"),
}
"""The methods by name, as they rank where the study states nothing else."""


@dataclass(frozen=True)
class Choice:
    """A front with the design that was chosen from it, and those that other methods would choose."""

    front: Designs
    picked: Designs  # the chosen one first
    methods: Sequence[str]  # of each that was picked

    @property
    def chosen(self) -> Designs:
        """The chosen design."""
        picked = self.picked
        return Designs(picked.study, picked.points[:1], picked.responses[:1])

    @classmethod
    def read(cls, study: Study, tables: Tables) -> Choice:
        """What the tables of a decision say."""
        picked, ranking = tables["09_decision"], tables["09_ranking"]
        return cls(Designs.read(study, ranking), Designs.read(study, picked), picked["method"].tolist())


def weights(study: Study, simulated: Designs, front: Designs) -> Output[FloatArray]:
    """Weigh the objectives: by entropy over the design or the front, equally, or as the user says; (m,)."""
    found = _weights(study, simulated, front)
    table = found.table().rename_axis("objective").reset_index()
    facts = {"description": found.description, "weights": dict(zip(found.names, found.weight.tolist(), strict=True))}
    return Output(found.weight, {"08_weights": table}, facts, {"08_weights": partial(figures.weights, found)})


def _weights(study: Study, simulated: Designs, front: Designs) -> Weights:
    part, names = study.spec.weights, list(study.spec.objectives)
    if isinstance(part, OwnWeights):
        return own_weights(part.own)
    if not isinstance(part, EntropyWeights):
        return own_weights(dict.fromkeys(names, 1.0))
    values = study.criteria(front.responses if part.of == "front" else simulated.usable()[1])
    try:
        return entropy_weights(values, normalised=part.normalised, transform=part.data, names=names)
    except InputError as error:
        raise study.source.error(str(error), "weights") from None


def _rank(part: DecisionPart, values: FloatArray, weights: FloatArray, *, maximise: Sequence[bool]) -> Ranking:
    """Rank alternatives, their objectives given (n, m), as a part of the study states."""
    if isinstance(part, KneePoint):
        return knee_point(values, maximise=maximise)
    rank = weighted_sum if isinstance(part, WeightedSum) else topsis
    return rank(values, weights, normalisation=part.normalisation, maximise=maximise)


def decision(study: Study, front: Designs, weight: FloatArray) -> Output[Choice]:
    """Choose one design of the front, and see whether other methods and weights nearby (m,) choose it too."""
    part, maximise, values = study.spec.decision, study.maximise, study.criteria(front.responses)
    chosen = _rank(part, values, weight, maximise=maximise)
    said = next(name for name, other in _METHODS.items() if other.method == part.method)
    others = {name: other for name, other in _METHODS.items() if name != said}
    picks = {name: _rank(other, values, weight, maximise=maximise).best for name, other in others.items()}
    picked = front.table().iloc[[chosen.best, *picks.values()]]
    first, *rest = picked.to_dict("records")
    facts: dict[str, Any] = {
        "method": chosen.description,
        "alternatives": len(front),
        "chosen": first,
        "others": {
            name: {f.head: row[f.head] for f in study.space.factors} for name, row in zip(picks, rest, strict=True)
        },
    }
    share = np.zeros(len(front))
    if not isinstance(part, KneePoint) and len(weight) > 1:
        near = weight_sensitivity(
            values,
            weight,
            seed=part.seed,
            method=partial(_rank, part),
            spread=part.spread,
            maximise=maximise,
            samples=_SAMPLES,
        )
        share = near.share
        stays = zip(study.spec.objectives, near.lower.tolist(), near.upper.tolist(), strict=True)
        facts["stays"] = {name: [low, high] for name, low, high in stays}
        facts["share"] = float(near.share[near.best])
        facts["spread"] = part.spread
    picked.insert(0, "method", [said, *picks])
    picked.insert(1, "picked_for", [chosen.description, *("comparison" for _ in picks)])
    ranked = front.table().assign(score=chosen.score, share_of_near_weights=share).iloc[chosen.order]
    ranked.insert(0, "rank", np.arange(1, len(ranked) + 1))
    tables = {"09_decision": picked, "09_ranking": ranked}
    return Output(Choice.read(study, tables), tables, facts, {})


def check(
    study: Study, choice: Choice, as_it_stands: FloatArray, of_design: Designs, simulator: Simulates
) -> Output[None]:
    """Simulate the chosen design and compare it with the prediction, and with the responses as they stand (r,).

    An error is measured by the response's range over the design. The picture of the decision is drawn here, because it
    shows the chosen design as simulated.
    """
    import pandas as pd

    chosen = choice.chosen
    found = simulator.check(chosen.points)
    (status,), (reason,) = found.status, found.reason
    usable = status not in UNUSABLE
    simulated = found.responses[0] if usable else np.full(len(study.responses), np.nan)
    as_simulated = study.criteria(simulated[None])[0]
    extents = np.ptp(study.with_worst(of_design.usable()[1]), axis=0).tolist()
    values = study.with_worst(np.stack([as_it_stands, chosen.responses[0], simulated]))
    governing = study.governing(np.nan_to_num(simulated)[None])[0] if usable else {}
    quality = study.spec.quality
    rows: list[dict[str, Any]] = []
    for response, (before, predicted, now), extent in zip(
        (*study.responses, *study.worst_of_cases), values.T.tolist(), extents, strict=True
    ):
        error = predicted - now
        noticed = abs(error) > quality.negligible_percent / 100 * abs(now)
        limits = [limit for limit in study.limits if limit.response == response]
        row = {
            "response": response.name,
            "unit": response.unit,
            "as_it_stands": before,
            "predicted": predicted,
            "simulated": now,
            "error_percent": 100.0 * error / now if now else np.nan,
            "error_of_range_percent": 100.0 * error / extent if extent else np.nan,
            "missed": noticed and abs(error) > quality.largest_error_percent / 100 * extent,
            "limit": "; ".join(limit.text for limit in limits),
            "limits": [limit.value for limit in limits],
            "kept": all(limit.excess(now) <= 0 for limit in limits) if limits else None,
        }
        if study.spec.cases:
            row |= {"stated": response.stated, "load_case": response.case or governing.get(response.name, "")}
        rows.append(row)
    table = pd.DataFrame(rows).drop(columns="limits")
    kept = usable and all(row["kept"] is not False for row in rows)
    changed = study.spec.set | study.spec.check.set
    facts = {"status": status, "reason": reason, "kept": kept, "rows": rows, "set": changed, "governing": governing}
    facts["step_ms"] = study.steps_ms(study.spec.check.set)
    pictures = {"10_check": partial(figures.check, study, table)}
    if len(study.objectives) > 1:
        others = dict(zip(choice.methods, study.criteria(choice.picked.responses), strict=True))
        pictures["09_decision"] = partial(
            figures.decision, study, study.criteria(choice.front.responses), others, as_simulated
        )
    return Output(None, {"10_check": table}, facts, pictures)
