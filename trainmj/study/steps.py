"""The first steps of a study: the scenario as it stands, design, simulations, correlation."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial

import numpy as np

from trainmj.collision.status import FAILED, NOT_VALID, PAST_LIMITS, UNUSABLE
from trainmj.doe import (
    Design,
    Lattice,
    Space,
    central_composite,
    correlate,
    full_factorial,
    optimal_latin_hypercube,
    sobol,
)
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.study import figures
from trainmj.study.designs import Designs, Simulates
from trainmj.study.file import CentralComposite, FullFactorial, GivenPoints, LatinHypercube, SobolSequence
from trainmj.study.folder import Output, Tables
from trainmj.study.plan import Study
from trainmj.study.simulator import ending_of


def as_it_stands(study: Study, simulator: Simulates) -> Output[FloatArray]:
    """Simulate the scenario as it stands; the value is the study's responses, (r,).

    Raises:
        InputError: if it cannot be computed.
    """
    import pandas as pd

    rows = simulator.as_it_stands()
    for case, row in rows.items():
        if row["status"] in FAILED:
            where = f"the load case {case}" if case else "the scenario"
            raise InputError(f"{where} as it stands is {row['status']}: {row['reason']}")
    table = pd.concat(
        pd.DataFrame({"response": list(row), "value": [str(value) for value in row.values()]}).assign(
            **({"load_case": case} if case else {})
        )
        for case, row in rows.items()
    )
    tables = {"00_as_it_stands": table}
    status, reason = ending_of(rows)
    facts = {"status": status, "reason": reason, "set": study.spec.set, "step_ms": study.steps_ms()}
    return Output(read_as_it_stands(study, tables), tables, facts, {})


def read_as_it_stands(study: Study, tables: Tables) -> FloatArray:
    """The study's responses (r,) among all of those of the scenarios; nan where they are not valid."""
    table = tables["00_as_it_stands"]
    cases = table["load_case"] if study.spec.cases else [""] * len(table)
    found = dict(zip(zip(cases, table["response"], strict=True), table["value"], strict=True))
    usable = {case: found[case, "status"] not in UNUSABLE for case in study.scenarios}
    return np.array([float(found[r.case, r.column]) if usable[r.case] else np.nan for r in study.responses])


def design(study: Study) -> Output[FloatArray]:
    """Choose the points (n, d) to simulate."""
    made = design_of(study)
    table = study.space.table(made.points)
    table.insert(0, "test", np.arange(1, len(table) + 1))
    facts = {"method": made.method, "n": len(table), "seed": made.seed, **asdict(made.quality())}
    draw = partial(figures.design, study.space, made.points)
    return Output(made.points, {"01_design": table}, facts, {"01_design": draw})


def design_of(study: Study) -> Design:
    """The design of a study.

    Raises:
        InputError: if there is none of its kind for these factors.
    """
    part = study.spec.design
    if isinstance(part, GivenPoints):
        return Design(study.space, np.array(study.given))
    lattice = Lattice(study.space, part.resolution)
    try:
        made = _spread(lattice.steps, part)
    except InputError as error:
        raise study.source.error(str(error), "design") from None
    return Design(study.space, lattice.natural(made.points), made.method, made.seed)


def _spread(space: Space, part: LatinHypercube | SobolSequence | FullFactorial | CentralComposite) -> Design:
    match part:
        case LatinHypercube():
            return optimal_latin_hypercube(space, part.n, seed=part.seed, levels=part.placement)
        case SobolSequence():
            return sobol(space, part.n, seed=part.seed)
        case FullFactorial():
            return full_factorial(space, [part.levels.get(name) for name in space.names])
        case CentralComposite():
            return central_composite(space, kind=part.form)


def simulations(study: Study, points: FloatArray, simulator: Simulates) -> Output[Designs]:
    """Simulate the points (n, d) of the design."""
    found = simulator.at(points)
    table = found.table()
    table.insert(0, "test", np.arange(1, len(table) + 1))
    good = ~found.failed
    facts = {
        "n": len(found),
        "failed": int((~good).sum()),
        "not_valid": sum(status in NOT_VALID for status in found.status),
        "first_failure": found.first_failure,
        "past_limits": sum(status in PAST_LIMITS for status in found.status),
    }
    draw = partial(figures.responses, study, found.points[good], found.responses[good])
    return Output(found, {"02_simulations": table}, facts, {"02_simulations": draw} if good.any() else {})


def correlation(study: Study, simulated: Designs) -> Output[None]:
    """Correlate factors and responses."""
    import pandas as pd

    x, y = simulated.usable()
    part = study.spec.correlation
    names = [r.name for r in study.responses]
    found = [
        correlate(x, y, x_names=study.space.names, y_names=names, method=method, level=part.level)
        for method in dict.fromkeys(part.methods)
    ]
    table = pd.concat([c.table().assign(method=c.method, n=c.n) for c in found], ignore_index=True)
    first = found[0]
    strongest = {}
    for k, name in enumerate(names):
        if np.isfinite(first.r[:, k]).all():
            i = int(np.argmax(np.abs(first.r[:, k])))
            strongest[name] = {"factor": first.x_names[i], "r": float(first.r[i, k])}
    return Output(
        None,
        {"03_correlation": table.rename(columns={"x": "factor", "y": "response"})},
        {"method": first.method, "level": part.level, "strongest": strongest},
        {"03_correlation": partial(figures.correlations, found)},
    )
