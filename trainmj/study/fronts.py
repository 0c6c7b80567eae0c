"""The fronts of a study: searched on the surrogates, searched on the simulator, and one compared with the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np

from trainmj.doe import Lattice, SwarmOptions, hypervolume, mopso
from trainmj.doe.arrays import FloatArray
from trainmj.doe.optimiser import InfeasibleError
from trainmj.doe.pareto import default_reference
from trainmj.errors import InputError
from trainmj.study import figures_front as figures
from trainmj.study.designs import Designs, Simulates
from trainmj.study.folder import Output
from trainmj.study.plan import Study
from trainmj.study.surrogates import Models
from trainmj.units import against, head

FILES = {"surrogate": "05_front_surrogate", "simulator": "06_front_simulator"}
"""Tables of the fronts by what was searched."""


def on_surrogates(study: Study, models: Models) -> Output[Designs]:
    """Search the front on the surrogates."""

    def values(points: FloatArray) -> FloatArray:
        return np.stack([model.predict(points) for model in models], axis=1)

    return _search(study, "surrogate", values)


def on_simulator(study: Study, simulator: Simulates) -> Output[Designs]:
    """Search the front on the simulator: each step of the swarm is one batch of collisions."""

    def values(points: FloatArray) -> FloatArray:
        found = simulator.at(points)
        return np.where(found.failed[:, None], np.nan, found.responses)

    return _search(study, "simulator", values)


def _search(
    study: Study, where: Literal["surrogate", "simulator"], values: Callable[[FloatArray], FloatArray]
) -> Output[Designs]:
    """Search a front, by responses (n, r) as a function of natural values (n, d); nan where a case failed."""
    import pandas as pd

    part = study.spec.optimiser
    swarm = part.surrogate if where == "surrogate" else part.simulator
    lattice = Lattice(study.space, part.resolution)

    def evaluate(steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = values(lattice.natural(steps))
        return study.minimised(found), study.excess(found, margins=where == "surrogate")

    try:
        front = mopso(
            lattice.steps,
            evaluate,
            seed=part.seed,
            constraints=[limit.text for limit in study.limits],
            options=SwarmOptions(**swarm.model_dump()),
        )
    except InfeasibleError as error:
        point = lattice.natural(error.nearest[None])
        broken = _broken(Designs(study, point, values(point)), where)
        said = f"search on the {where}: no design of {error.evaluations} keeps all limits; the nearest, {broken}"
        raise study.source.error(said, "constraints") from None
    except InputError as error:
        place = "constraints" if study.limits else "optimiser"
        raise study.source.error(f"search on the {where}: {error}", place) from None
    points = lattice.natural(front.points)
    found = Designs(study, points, values(points))
    criteria = study.criteria(found.responses)
    ends = zip(study.spec.objectives, criteria.min(axis=0).tolist(), criteria.max(axis=0).tolist(), strict=True)
    facts = {
        "points": len(found),
        "evaluations": front.history[-1].evaluations,
        "failed": sum(p.failed for p in front.history),
        "status": front.status,
        "seed": front.seed,
        "extent": {name: [low, high] for name, low, high in ends},
        "hypervolume": front.hypervolume,
        "governing": _counted(study.governing(found.responses)),
    }
    progress = pd.DataFrame([vars(p) for p in front.history])
    name = FILES[where]
    return Output(
        found,
        {name: found.table(), f"{name}_progress": progress},
        facts,
        {f"{name}_progress": partial(figures.progress, progress, where)},
    )


def _counted(governing: list[dict[str, str]]) -> dict[str, dict[str, int]]:
    """For how many designs each load case governs an objective, or a limit is the nearest."""
    names = dict.fromkeys(name for row in governing for name in row)
    return {name: dict(Counter(row[name] for row in governing).most_common()) for name in names}


def _broken(nearest: Designs, where: str) -> str:
    """A design in words, with the limits that it breaks, and what to do about it."""
    study, (row,), broken = nearest.study, nearest.table().to_dict("records"), []
    for limit in study.limits:
        value, margin = float(row[limit.response.head]), limit.margin * (where == "surrogate")
        if limit.excess(np.array(value), margin) > 0:
            inside = f" with its margin of {margin:g}" if margin else ""
            shown = against(value, limit.value - limit.sign * margin, -5)
            broken.append(
                f"{limit.response.name} = {shown} {limit.response.unit}".rstrip() + f", not {limit.text}{inside}"
            )
    factors = ", ".join(f"{f.name} = {_short(row[f.head])} {f.unit}".rstrip() for f in study.space.factors)
    return f"{factors}, has {' and '.join(broken)}: loosen these limits, or widen the factors' bounds"


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def compared(study: Study, predicted: Designs, direct: Designs, simulator: Simulates) -> Output[None]:
    """Simulate the surrogates' front and compare it with the one found on the simulator.

    The hypervolumes share one reference, a tenth of the range beyond the direct front. A point of the surrogates' front
    counts as simulated only if it keeps the constraints then.
    """
    import pandas as pd

    real = simulator.at(predicted.points)
    kept = ~real.failed & (study.excess(real.responses) <= 0).all(axis=1)
    target = study.minimised(direct.responses)
    corner = default_reference(target)
    volume = hypervolume(target, corner)
    told = hypervolume(study.minimised(predicted.responses), corner)
    true = hypervolume(study.minimised(real.responses[kept]), corner) if kept.any() else 0.0
    facts = {
        "hypervolume_direct": volume,
        "ratio_predicted": told / volume if volume > 0 else np.nan,
        "ratio_simulated": true / volume if volume > 0 else np.nan,
        "kept": int(kept.sum()),
        "points": len(predicted),
    }
    simulated = pd.DataFrame(real.responses, columns=[head(f"{r.name}_simulated", r.unit) for r in study.responses])
    table = pd.concat([predicted.table(), simulated.assign(status=real.status, kept=kept)], axis=1)
    fronts = [study.criteria(designs.responses) for designs in (predicted, real, direct)]
    draw = partial(figures.fronts, study, *fronts, kept=kept, facts=facts)
    return Output(None, {"07_fronts": table}, facts, {"07_fronts": draw} if len(study.objectives) > 1 else {})
