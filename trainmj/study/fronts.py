"""The fronts of a study: searched on the surrogates, searched on the simulator, and the one against the other."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.doe import Front, Lattice, SwarmOptions, hypervolume, mopso
from trainmj.doe.arrays import FloatArray
from trainmj.doe.pareto import default_reference
from trainmj.errors import InputError
from trainmj.study import figures_front as plotting
from trainmj.study.folder import Output
from trainmj.study.plan import Study
from trainmj.study.simulator import Simulator, failed
from trainmj.study.steps import points_of, usable, with_factors
from trainmj.study.surrogates import fit_all

if TYPE_CHECKING:
    import pandas as pd

Values = Callable[[FloatArray], FloatArray]
"""Responses (n, r) at points (n, d) in natural values; nan where a case failed."""


def on_surrogates(study: Study, simulated: pd.DataFrame) -> Output:
    """Search the front on the surrogates."""
    models = fit_all(study, *usable(study, simulated))

    def values(points: FloatArray) -> FloatArray:
        return np.stack([models[r.name].predict(points) for r in study.responses], axis=1)

    part = study.spec.optimiser.surrogate
    return _search(study, values, SwarmOptions(**part.model_dump()), "05_front_surrogate", margins=True)


def on_simulator(study: Study, simulator: Simulator) -> Output:
    """Search the front on the simulator: each step of the swarm is one batch of collisions."""
    heads = [r.head for r in study.responses]

    def values(points: FloatArray) -> FloatArray:
        table = simulator.at(points)
        found = table[heads].to_numpy(dtype=np.float64)
        return np.where(failed(table)[:, None], np.nan, found)

    part = study.spec.optimiser.simulator
    return _search(study, values, SwarmOptions(**part.model_dump()), "06_front_simulator", margins=False)


def _search(study: Study, values: Values, options: SwarmOptions, name: str, margins: bool) -> Output:
    """Search a front and tabulate it with all responses."""
    import pandas as pd

    lattice = Lattice.of(study.space, study.spec.optimiser.resolution)
    rows = {r.name: k for k, r in enumerate(study.responses)}

    def evaluate(steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = values(lattice.natural(steps))
        limits = [limit.excess(found[:, rows[limit.response.name]], limit.margin * margins) for limit in study.limits]
        return minimised(study, found), np.stack(limits, axis=1) if limits else np.zeros((len(steps), 0))

    try:
        front = mopso(
            lattice.steps,
            evaluate,
            seed=study.spec.optimiser.seed,
            constraints=[limit.text for limit in study.limits],
            options=options,
        )
    except InputError as error:
        where = "constraints" if study.limits else "optimiser"
        raise study.problem(f"search on the {name.rpartition('_')[2]}: {error}", where) from None
    points = lattice.natural(front.points)
    found = pd.DataFrame(values(points), columns=[r.head for r in study.responses])
    progress = pd.DataFrame([vars(p) for p in front.history])
    return Output(
        {name: with_factors(study, points, found), f"{name}_progress": progress},
        _facts(study, front, found),
        {f"{name}_progress": partial(plotting.progress, progress, name.rpartition("_")[2])},
    )


def minimised(study: Study, found: FloatArray) -> FloatArray:
    """Objectives (n, m), turned so that less is better, of responses (n, r)."""
    columns = [k for name in study.spec.objectives for k, r in enumerate(study.responses) if r.name == name]
    return np.asarray(found[:, columns] * np.where(study.maximise, -1.0, 1.0), dtype=np.float64)


def _facts(study: Study, front: Front, found: pd.DataFrame) -> dict[str, Any]:
    last = front.history[-1]
    extent = {r.name: [float(found[r.head].min()), float(found[r.head].max())] for r in study.objectives}
    return {
        "points": len(front.points),
        "evaluations": last.evaluations,
        "failed": sum(p.failed for p in front.history),
        "status": front.status,
        "seed": front.seed,
        "extent": extent,
        "hypervolume": front.hypervolume,
    }


def compared(study: Study, surrogate: pd.DataFrame, direct: pd.DataFrame, simulator: Simulator) -> Output:
    """Simulate the surrogates' front and set it against the one found on the simulator.

    The hypervolumes share one reference, a tenth of the range beyond the direct front. A point of the surrogates' front
    counts as simulated only if it keeps the constraints then.
    """
    heads = [r.head for r in study.responses]
    points = points_of(study, surrogate)
    table = simulator.at(points)
    predicted = surrogate[heads].to_numpy(dtype=np.float64)
    real = table[heads].to_numpy(dtype=np.float64)
    excess = [limit.excess(real[:, k]) for limit, k in _limited(study)]
    kept = ~failed(table) & np.all([g <= 0 for g in excess] or [np.ones(len(real), dtype=bool)], axis=0)
    target = minimised(study, direct[heads].to_numpy(dtype=np.float64))
    corner = default_reference(target)
    volume = hypervolume(target, corner)
    told = hypervolume(minimised(study, predicted), corner)
    true = hypervolume(minimised(study, real[kept]), corner) if kept.any() else 0.0
    columns = {
        f"{r.name}_simulated_{r.head.removeprefix(r.name).lstrip('_')}".rstrip("_"): real[:, k]
        for k, r in enumerate(study.responses)
    }
    import pandas as pd

    result = pd.concat([surrogate, pd.DataFrame({**columns, "status": table["status"], "kept": kept})], axis=1)
    facts = {
        "hypervolume_direct": volume,
        "ratio_predicted": told / volume if volume > 0 else np.nan,
        "ratio_simulated": true / volume if volume > 0 else np.nan,
        "kept": int(kept.sum()),
        "points": len(points),
    }
    draw = partial(plotting.fronts, study, predicted, real, kept, direct[heads].to_numpy(dtype=np.float64), facts)
    return Output({"07_fronts": result}, facts, {"07_fronts": draw} if len(study.objectives) > 1 else {})


def _limited(study: Study) -> list[tuple[Any, int]]:
    """Each limit with the place of its response."""
    places = {r.name: k for k, r in enumerate(study.responses)}
    return [(limit, places[limit.response.name]) for limit in study.limits]
