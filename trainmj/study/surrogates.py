"""The surrogates of a study: fitted to the responses, measured, and compared with other kinds."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.doe import (
    Polynomial,
    Surrogate,
    accuracy,
    cross_validate,
    fit_kriging,
    fit_polynomial,
    full_order,
    parse_terms,
    select_terms,
    sobol_sensitivity,
)
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.study import figures as plotting
from trainmj.study.file import SurrogatePart
from trainmj.study.folder import Output
from trainmj.study.plan import Response, Study
from trainmj.study.rules import DEFAULT
from trainmj.study.steps import labels, usable

if TYPE_CHECKING:
    import pandas as pd

_SAMPLE = 256  # of the sensitivity; its intervals say what that is worth
_ORDERS = {"linear": 1, "quadratic": 2, "cubic": 3}

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
            indices = sobol_sensitivity(study.space, model.predict, n=_SAMPLE, seed=0)
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
                predicted = cross_validate(fit, x, values, folds=folds, seed=part.seed)
                found = accuracy(values, predicted, over="range")
                row = {"surrogate": name, "are_over_range": found.are, "rmse_over_range": found.rmse, "r2": found.r2}
                table = pd.DataFrame([row | {"largest_over_range": found.largest}])
            except InputError as error:
                table = pd.DataFrame({"surrogate": [name], "note": [str(error)]})
            tables.append(table.assign(response=response.name))
    joined = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame({"surrogate": [], "response": []})
    return joined[["response", *joined.columns.drop("response")]]
