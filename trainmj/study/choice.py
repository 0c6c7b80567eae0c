"""The last steps of a study: weights of the objectives, the choice of one design, its check by simulation."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.status import FAILED
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
from trainmj.study import figures_front as plotting
from trainmj.study.folder import Output
from trainmj.study.plan import Study
from trainmj.study.simulator import Simulator
from trainmj.study.steps import points_of, usable

if TYPE_CHECKING:
    import pandas as pd


def weights(study: Study, simulated: pd.DataFrame, front: pd.DataFrame) -> Output:
    """Weigh the objectives: by entropy over the design or the front, equally, or as the user says."""
    found = _weights(study, simulated, front)
    table = found.table().reset_index().rename(columns={"criterion": "objective"})
    facts = {"description": found.description, "weights": dict(zip(found.names, found.weight.tolist(), strict=True))}
    return Output({"08_weights": table}, facts, {"08_weights": partial(plotting.weights, found)})


def _weights(study: Study, simulated: pd.DataFrame, front: pd.DataFrame) -> Weights:
    part = study.spec.weights
    names = list(study.spec.objectives)
    if part.method != "entropy":
        return own_weights(part.own or dict.fromkeys(names, 1.0))
    if part.of == "front":
        values = front[[r.head for r in study.objectives]].to_numpy(dtype=np.float64)
    else:
        _, y = usable(study, simulated)
        values = y[:, [study.responses.index(r) for r in study.objectives]]
    try:
        found = entropy_weights(values, normalised=part.form != "paper", transform=part.data or "raw", names=names)
    except InputError as error:
        raise study.problem(str(error), "weights") from None
    if (found.weight < 0).any():
        raise study.problem(f"gives negative weights ({found.weight.round(4).tolist()}): take another form", "weights")
    return found


def decision(study: Study, front: pd.DataFrame, weighed: pd.DataFrame) -> Output:
    """Choose one design of the front, and see whether other methods and near weights choose it too."""
    import pandas as pd

    part = study.spec.decision
    values = front[[r.head for r in study.objectives]].to_numpy(dtype=np.float64)
    weight = weighed["weight"].to_numpy(dtype=np.float64)
    picks = {name: rank.best for name, rank in _rankings(study, values, weight).items()}
    own = _method(study, part.method)
    chosen = own(values, weight)
    rows = [{"method": _said(part.method), "picked_for": chosen.description, **front.iloc[chosen.best].to_dict()}]
    rows += [{"method": name, "picked_for": "comparison", **front.iloc[k].to_dict()} for name, k in picks.items()]
    facts: dict[str, Any] = {
        "method": chosen.description,
        "alternatives": len(front),
        "chosen": front.iloc[chosen.best].to_dict(),
        "others": {name: {h: _plain(front.iloc[k][h]) for h in study.heads} for name, k in picks.items()},
    }
    tables = {"09_decision": pd.DataFrame(rows)}
    share = np.zeros(len(front))
    if part.method != "knee" and len(weight) > 1:
        near = weight_sensitivity(
            values, weight, seed=part.seed, method=own, spread=part.spread, maximise=study.maximise, samples=500
        )
        share = near.share
        stays = zip(study.spec.objectives, near.lower.tolist(), near.upper.tolist(), strict=True)
        facts["stays"] = {name: [low, high] for name, low, high in stays}
        facts["share"] = float(near.share[near.best])
        facts["spread"] = part.spread
    ranked = front.assign(score=chosen.score, share_of_near_weights=share).iloc[chosen.order]
    ranked.insert(0, "rank", np.arange(1, len(ranked) + 1))
    tables["09_ranking"] = ranked
    facts["chosen"] = {name: _plain(value) for name, value in facts["chosen"].items()}
    draw = partial(plotting.decision, study, values, chosen.best, picks, _said(part.method))
    return Output(tables, facts, {"09_decision": draw} if len(weight) > 1 else {})


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _said(method: str) -> str:
    return {"weighted_sum": "weighted sum", "topsis": "TOPSIS", "knee": "knee point"}[method]


def _method(study: Study, name: str) -> Any:
    """A method of the library as (values, weights) -> ranking, with the study's directions."""
    normalisation = study.spec.decision.normalisation if name == study.spec.decision.method else None
    given = {"normalisation": normalisation} if normalisation else {}
    if name == "knee":
        return lambda values, _, **__: knee_point(values, maximise=study.maximise)

    def rank(values: FloatArray, weight: FloatArray, **_: Any) -> Ranking:
        return (weighted_sum if name == "weighted_sum" else topsis)(values, weight, maximise=study.maximise, **given)

    return rank


def _rankings(study: Study, values: FloatArray, weight: FloatArray) -> dict[str, Ranking]:
    """What the methods not chosen would pick."""
    names = [n for n in ("weighted_sum", "topsis", "knee") if n != study.spec.decision.method]
    return {_said(name): _method(study, name)(values, weight) for name in names}


def check(study: Study, decided: pd.DataFrame, as_it_stands: pd.DataFrame, simulator: Simulator) -> Output:
    """Simulate the chosen design and set it against the prediction, as Table 13 of doi 10.1186/s10033-022-00755-8."""
    import pandas as pd

    chosen = decided.iloc[[0]]
    point = points_of(study, chosen)
    scenario = study.scenario.with_values(study.spec.check.set)
    found = simulator.at(point, scenario).iloc[0]
    before = dict(zip(as_it_stands["response"], as_it_stands["value"], strict=True))
    rows = []
    for r in study.responses:
        predicted, simulated = float(chosen.iloc[0][r.head]), float(found[r.head])
        limits = [limit for limit in study.limits if limit.response == r]
        rows.append(
            {
                "response": r.name,
                "unit": r.unit,
                "as_it_stands": float(before[r.column]),
                "predicted": predicted,
                "simulated": simulated,
                "error_percent": 100.0 * (predicted - simulated) / simulated if simulated else np.nan,
                "limit": "; ".join(limit.text for limit in limits),
                "kept": all(limit.excess(np.array([simulated]))[0] <= 0 for limit in limits) if limits else None,
            }
        )
    table = pd.DataFrame(rows)
    kept = found["status"] not in FAILED and all(row["kept"] is not False for row in rows)
    facts = {"status": found["status"], "reason": found["reason"], "kept": kept, "rows": rows}
    return Output({"10_check": table}, facts, {"10_check": partial(plotting.check, study, table)})
