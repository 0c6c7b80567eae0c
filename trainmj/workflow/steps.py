"""The first steps of a study: design, simulations, correlation, surrogates. Each gives its tables and figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj import plotting_study as plotting
from trainmj.errors import InputError
from trainmj.study import (
    Design,
    Polynomial,
    Surrogate,
    accuracy,
    central_composite,
    compare,
    correlate,
    fit_kriging,
    fit_polynomial,
    full_factorial,
    full_order,
    given,
    optimal_latin_hypercube,
    parse_terms,
    select_terms,
    sobol,
    sobol_sensitivity,
)
from trainmj.study.arrays import FloatArray
from trainmj.workflow.folder import Output
from trainmj.workflow.lattice import Lattice
from trainmj.workflow.plan import Response, Study
from trainmj.workflow.rules import DEFAULT
from trainmj.workflow.simulator import Simulator, failed
from trainmj.workflow.spec import SurrogatePart
from trainmj.workflow.tables import read_given

if TYPE_CHECKING:
    import pandas as pd

_ORDERS = {"linear": 1, "quadratic": 2, "cubic": 3}


def baseline(study: Study, simulator: Simulator) -> Output:
    """Simulate the scenario as it stands, which also tells which responses there are.

    Raises:
        InputError: if it cannot be computed, or a response of the study is no column of it.
    """
    import pandas as pd

    (row,) = simulator.rows(study.scenario, [{}])
    if row["status"] in ("refused", "unstable"):
        raise InputError(f"the scenario as it stands is {row['status']}: {row['reason']}")
    table = pd.DataFrame({"response": list(row), "value": [str(value) for value in row.values()]})
    return Output({"00_as_it_stands": table}, {"status": row["status"]})


def design(study: Study) -> Output:
    """Choose the points to simulate."""
    made = _design(study)
    quality = made.quality()
    table = made.table().reset_index()
    table.columns = _design_heads(study)
    facts = {"method": made.method, "n": made.n, "seed": made.seed, **asdict(quality)}
    return Output(
        {"01_design": table},
        facts,
        {"01_design": partial(plotting.design, study.space, made.points)},
    )


def _design_heads(study: Study) -> Any:
    import pandas as pd

    return pd.Index(["test", *study.heads])


def _design(study: Study) -> Design:
    part = study.spec.design
    lattice = Lattice.of(study.space, part.resolution)
    space = lattice.steps
    try:
        if part.kind == "table":
            return given(study.space, _given_table(study))
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
        table = read_given(study.folder / str(study.spec.design.file))
    except InputError as error:
        raise study.problem(str(error), "design", "file") from None
    return table.rename(columns=dict(zip(study.heads, study.space.names, strict=True)))


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

    factors = study.space.table(points)
    factors.columns = pd.Index(study.heads)
    return pd.concat([factors, table.reset_index(drop=True)], axis=1)


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
        first = results[~good].iloc[0]
        raise InputError(
            f"only {int(good.sum())} of the {len(table)} cases of the design could be computed, too few to go on; the "
            f"first that failed is {first['status']}: {first['reason']}"
        )
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


Models = dict[str, Surrogate]


def fit_all(study: Study, x: FloatArray, y: FloatArray) -> Models:
    """The surrogate of each response, by its short name.

    Raises:
        InputError: with the place in the study file, if one cannot be fitted to these points.
    """
    models = {}
    for response, values in zip(study.responses, y.T, strict=True):
        try:
            models[response.name] = _fit(study, response)(x, values)
        except InputError as error:
            key = response.name if response.name in study.spec.surrogates else DEFAULT
            at = ("surrogates", key) if key in study.spec.surrogates else ("surrogates",)
            raise study.problem(f"response {response.name}: {error}", *at) from None
    return models


def _fit(study: Study, response: Response) -> Callable[[FloatArray, FloatArray], Surrogate]:
    """How the surrogate of a response is fitted, choice of terms included."""
    surrogates = study.spec.surrogates
    part = surrogates.get(response.name) or surrogates.get(DEFAULT) or SurrogatePart()
    space = study.space

    def fit(x: FloatArray, y: FloatArray) -> Surrogate:
        if np.ptp(y) == 0.0:  # a response that does not vary is known
            return fit_polynomial(x, y, space=space, terms=full_order(space.d, 0))
        if part.kind == "kriging":
            return fit_kriging(x, y, space=space, seed=part.seed)
        terms = parse_terms(part.terms, space.names) if part.terms else full_order(space.d, part.order or 2)
        if part.selection != "none":
            terms = select_terms(x, y, space=space, candidates=terms, criterion=part.selection).terms
        return fit_polynomial(x, y, space=space, terms=terms)

    return fit


def surrogates(study: Study, simulated: pd.DataFrame) -> Output:
    """Fit the surrogates and say how good they are: coefficients, errors, analysis of variance, sensitivity."""
    import pandas as pd

    x, y = usable(study, simulated)
    models = fit_all(study, x, y)
    rows, coefficients, anova, sensitivity = [], [], [], []
    predicted = np.empty_like(y)
    for k, (name, model) in enumerate(models.items()):
        try:
            predicted[:, k] = model.leave_one_out()
        except InputError as error:
            raise study.problem(f"response {name}: {error}", "surrogates") from None
        rows.append(_accuracy(study.responses[k], model, x, y[:, k], predicted[:, k]))
        if isinstance(model, Polynomial):
            coefficients.append(model.coefficients().rename_axis("term").reset_index().assign(response=name))
            anova.append(model.anova().reset_index().assign(response=name))
        if np.ptp(y[:, k]) > 0:
            indices = sobol_sensitivity(study.space, model.predict, n=1024, seed=0)
            sensitivity.append(indices.table().reset_index().assign(response=name))
    tables = {"04_surrogates": pd.DataFrame(rows), "04_cross_validation": _compare(study, x, y)}
    for name, parts in (("coefficients", coefficients), ("anova", anova), ("sensitivity", sensitivity)):
        if parts:
            table = pd.concat(parts, ignore_index=True)
            tables[f"04_{name}"] = table[["response", *table.columns.drop("response")]]
    facts = {"n": len(x), "responses": {row["response"]: row for row in rows}}
    figures = {
        "04_surrogates": partial(plotting.parity, y, predicted, labels(study)),
        "04_surfaces": partial(plotting.surfaces, study, models, x),
    }
    return Output(tables, facts, figures)


def _accuracy(
    response: Response, model: Surrogate, x: FloatArray, y: FloatArray, left_out: FloatArray
) -> dict[str, Any]:
    """One row of the table of surrogates: errors of the fit and of points left out, over the range."""
    row: dict[str, Any] = {
        "response": response.name,
        "unit": response.unit,
        "range": float(np.ptp(y)),
        "surrogate": model.description,
    }
    for name, predicted in (("fit", model.predict(x)), ("loo", left_out)):
        found = accuracy(y, predicted, over="range") if np.ptp(y) > 0 else None
        for key in ("are", "rmse", "r2"):
            row[f"{key}_{name}"] = getattr(found, key) if found else np.nan
    return row


def _compare(study: Study, x: FloatArray, y: FloatArray) -> pd.DataFrame:
    """Cross-validate the chosen surrogates and other kinds; a kind that these points cannot support is left out."""
    import pandas as pd

    part = study.spec.cross_validation
    space = study.space
    tables = []
    folds = None if part.folds is None else min(part.folds, len(x))
    for response, values in zip(study.responses, y.T, strict=True):
        if np.ptp(values) == 0.0:
            continue
        fits: dict[str, Any] = {"chosen": _fit(study, response)}
        for kind in part.against:
            if kind == "kriging":
                fits[kind] = partial(fit_kriging, space=space, seed=part.seed, starts=0)
            else:
                fits[kind] = partial(fit_polynomial, space=space, terms=full_order(space.d, _ORDERS[kind]))
        for name, fit in fits.items():
            try:
                table = compare({name: fit}, x, values, folds=folds, seed=part.seed).reset_index()
            except InputError as error:
                table = pd.DataFrame({"surrogate": [name], "note": [str(error)]})
            tables.append(table.assign(response=response.name))
    joined = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame({"surrogate": [], "response": []})
    return joined[["response", *joined.columns.drop("response")]]
