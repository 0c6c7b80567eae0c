"""The first steps of a study: the scenario as it stands, design, simulations, correlation."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.status import FAILED
from trainmj.doe import (
    Design,
    Lattice,
    central_composite,
    correlate,
    full_factorial,
    optimal_latin_hypercube,
    sobol,
)
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.files.tables import read_given
from trainmj.study import figures as plotting
from trainmj.study.folder import Output
from trainmj.study.plan import Study
from trainmj.study.simulator import Simulator, failed

if TYPE_CHECKING:
    import pandas as pd


def baseline(study: Study, simulator: Simulator) -> Output:
    """Simulate the scenario as it stands, which also tells which responses there are.

    Raises:
        InputError: if it cannot be computed, or a response of the study is no column of it.
    """
    import pandas as pd

    (row,) = simulator.rows(study.scenario, [{}])
    if row["status"] in FAILED:
        raise InputError(f"the scenario as it stands is {row['status']}: {row['reason']}")
    table = pd.DataFrame({"response": list(row), "value": [str(value) for value in row.values()]})
    return Output({"00_as_it_stands": table}, {"status": row["status"]})


def design(study: Study) -> Output:
    """Choose the points to simulate."""
    made = _design(study)
    quality = made.quality()
    table = study.space.table(made.points, study.heads)
    table.insert(0, "test", np.arange(1, len(table) + 1))
    facts = {"method": made.method, "n": len(made.points), "seed": made.seed, **asdict(quality)}
    return Output(
        {"01_design": table},
        facts,
        {"01_design": partial(plotting.design, study.space, made.points)},
    )


def _design(study: Study) -> Design:
    part = study.spec.design
    lattice = Lattice.of(study.space, part.resolution)
    space = lattice.steps
    try:
        if part.kind == "table":
            return Design(study.space, study.space.from_table(_given_table(study), study.heads))
        if part.kind == "sobol":
            made = sobol(space, part.n or 0, seed=part.seed or 0)
        elif part.kind == "full_factorial":
            made = full_factorial(space, [(part.levels or {}).get(name) for name in space.names])
        elif part.kind == "central_composite":
            made = central_composite(space, kind=part.form or "face")
        else:
            made = optimal_latin_hypercube(space, part.n or 0, seed=part.seed or 0, levels=part.placement or "edge")
    except InputError as error:
        raise study.problem(str(error), "design") from None
    return Design(study.space, lattice.natural(made.points), made.method, made.seed)


def _given_table(study: Study) -> pd.DataFrame:
    """Points of a CSV file beside the study; heads are names, with or without units."""
    try:
        table = read_given(study.source.folder / str(study.spec.design.file))
    except InputError as error:
        raise study.problem(str(error), "design", "file") from None
    return table


def points_of(study: Study, table: pd.DataFrame) -> FloatArray:
    """Points (n, d) of one of the study's tables."""
    columns = []
    for factor, name in zip(study.space.factors, study.heads, strict=True):
        if factor.kind == "choice":  # levels such as 1 and "1" look alike in a file
            codes = {str(level): code for code, level in enumerate(factor.levels)}
            columns.append([float(codes[str(value)]) for value in table[name]])
        else:
            columns.append([float(value) for value in table[name]])
    return np.array(columns, dtype=np.float64).T


def with_factors(study: Study, points: FloatArray, table: pd.DataFrame) -> pd.DataFrame:
    """A table with the factors of its rows, points (n, d), in front."""
    import pandas as pd

    return pd.concat([study.space.table(points, study.heads), table.reset_index(drop=True)], axis=1)


def simulations(study: Study, chosen: pd.DataFrame, simulator: Simulator) -> Output:
    """Simulate the points of the design."""
    points = points_of(study, chosen)
    found = simulator.at(points)
    table = with_factors(study, points, found)
    table.insert(0, "test", np.arange(1, len(table) + 1))
    bad = failed(found)
    first = found[bad].iloc[0] if bad.any() else None
    facts = {
        "n": len(table),
        "failed": int(bad.sum()),
        "first_failure": None if first is None else f"{first['status']}: {first['reason']}".rstrip(": "),
        "exhausted": int((found["status"] == "stroke exhausted").sum()),
    }
    values = found.loc[~bad, [r.head for r in study.responses]].to_numpy(dtype=np.float64)
    draw = partial(plotting.responses, study.space, points[~bad], values, labels(study))
    return Output({"02_simulations": table}, facts, {"02_simulations": draw} if len(values) else {})


def labels(study: Study) -> list[str]:
    """Labels of the responses' axes."""
    return [r.label for r in study.responses]


def usable(study: Study, table: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Points (n, d) and responses (n, r) of the cases that could be computed.

    Raises:
        InputError: if there are fewer than three of them.
    """
    results = table[["status", "reason", *(r.head for r in study.responses)]]
    good = ~failed(results)
    if good.sum() < 3:
        if good.all():
            raise InputError(f"the design has {len(table)} points, too few to go on: give three or more")
        said = f"only {int(good.sum())} of the {len(table)} cases of the design could be computed, too few to go on"
        first = results[~good].iloc[0]
        raise InputError(f"{said}; the first that failed is {first['status']}: {first['reason']}")
    values = results.loc[good, [r.head for r in study.responses]].to_numpy(dtype=np.float64)
    return points_of(study, table[good]), values


def correlation(study: Study, simulated: pd.DataFrame) -> Output:
    """Correlate factors and responses."""
    import pandas as pd

    x, y = usable(study, simulated)
    part = study.spec.correlation
    names = [r.name for r in study.responses]
    found = [
        correlate(x, y, x_names=study.space.names, y_names=names, method=method, level=part.level)
        for method in dict.fromkeys(part.methods)
    ]
    table = pd.concat([c.table().assign(method=c.method, n=c.n) for c in found], ignore_index=True)
    table = table.rename(columns={"x": "factor", "y": "response"})
    first = found[0]
    strongest = {
        name: {"factor": first.x_names[i], "r": float(first.r[i, k])}
        for k, name in enumerate(names)
        if np.isfinite(first.r[:, k]).all()
        for i in [int(np.argmax(np.abs(first.r[:, k])))]
    }
    facts = {"method": first.method, "level": part.level, "strongest": strongest}
    return Output({"03_correlation": table}, facts, {"03_correlation": partial(plotting.correlations, found)})
