"""The surrogates of a study: fitted to the responses, measured, and compared with other kinds."""

from __future__ import annotations

from collections.abc import Sequence
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
from trainmj.doe.accuracy import Fit
from trainmj.doe.arrays import FloatArray, varies
from trainmj.errors import InputError
from trainmj.study import figures
from trainmj.study.designs import Designs
from trainmj.study.file import FullPolynomial, KrigingPart, PolynomialOfTerms
from trainmj.study.folder import Output
from trainmj.study.plan import Response, Study
from trainmj.study.rules import DEFAULT

if TYPE_CHECKING:
    import pandas as pd

_SAMPLE = 256  # points of the sensitivity; its intervals show what they are worth
_ORDERS = {"linear": 1, "quadratic": 2, "cubic": 3}

Models = Sequence[Surrogate]
"""The surrogate of each response, in their order."""


def fit_all(study: Study, simulated: Designs) -> Models:
    """Fit the surrogate of each response.

    Raises:
        InputError: with the place in the study file, if one cannot be fitted to these points.
    """
    x, y = simulated.usable()
    models = []
    for response, values in zip(study.responses, y.T, strict=True):
        try:
            models.append(_fit(study, response)(x, values))
        except InputError as error:
            stated = [key for key in (response.name, DEFAULT) if key in study.spec.surrogates]
            raise study.source.error(f"response {response.name}: {error}", "surrogates", *stated[:1]) from None
    return models


def _fit(study: Study, response: Response) -> Fit:
    """How the surrogate of a response is fitted, choice of terms included."""
    stated = study.spec.surrogates
    part = stated.get(response.name) or stated.get(DEFAULT) or FullPolynomial()
    space = study.space

    def fit(x: FloatArray, y: FloatArray) -> Surrogate:
        if not varies(y):  # a response that does not vary is known
            return fit_polynomial(x, y, space=space, terms=full_order(space.d, 0))
        if isinstance(part, KrigingPart):
            return fit_kriging(x, y, space=space, seed=part.seed)
        if isinstance(part, PolynomialOfTerms):
            terms = parse_terms(part.terms, space.names)
        else:
            terms = full_order(space.d, part.order)
        if part.selection != "none":
            terms = select_terms(x, y, space=space, candidates=terms, criterion=part.selection)
        return fit_polynomial(x, y, space=space, terms=terms)

    return fit


def surrogates(study: Study, simulated: Designs) -> Output[Models]:
    """Fit the surrogates and tabulate coefficients, errors, analysis of variance and sensitivity."""
    import pandas as pd

    models = fit_all(study, simulated)
    x, y = simulated.usable()
    left_out = np.empty_like(y)
    rows, coefficients, anova, sensitivity = [], {}, {}, {}
    for k, (response, model) in enumerate(zip(study.responses, models, strict=True)):
        try:
            left_out[:, k] = model.leave_one_out()
        except InputError as error:
            raise study.source.error(f"response {response.name}: {error}", "surrogates") from None
        rows.append(_accuracy(response, model, x, y[:, k], left_out[:, k]))
        if isinstance(model, Polynomial):
            coefficients[response.name] = model.coefficients().rename_axis("term")
            anova[response.name] = model.anova()
        if varies(model.predict(x)):  # selected terms may be the constant alone
            sensitivity[response.name] = sobol_sensitivity(study.space, model.predict, n=_SAMPLE, seed=0).table()
    tables = {"04_surrogates": pd.DataFrame(rows), "04_cross_validation": _compare(study, x, y)}
    for name, parts in (("coefficients", coefficients), ("anova", anova), ("sensitivity", sensitivity)):
        if parts:
            tables[f"04_{name}"] = pd.concat(parts, names=["response"]).reset_index()
    return Output(
        models,
        tables,
        {"n": len(x), "responses": {row["response"]: row for row in rows}},
        {
            "04_surrogates": partial(figures.parity, study, y, left_out),
            "04_surfaces": partial(figures.surfaces, study, models, x),
        },
    )


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
        found = accuracy(y, predicted, over="range") if varies(y) else None
        for key in ("are", "rmse", "r2"):
            row[f"{key}_{name}"] = getattr(found, key) if found else np.nan
    return row


def _compare(study: Study, x: FloatArray, y: FloatArray) -> pd.DataFrame:
    """Cross-validate the chosen surrogates and other kinds; a note explains where one cannot be fitted."""
    import pandas as pd

    part = study.spec.cross_validation
    space = study.space
    others: dict[str, Fit] = {
        kind: partial(fit_kriging, space=space, seed=part.seed, starts=0)
        if kind == "kriging"
        else partial(fit_polynomial, space=space, terms=full_order(space.d, _ORDERS[kind]))
        for kind in part.against
    }
    folds = None if part.folds is None else min(part.folds, len(x))
    rows = []
    for response, values in zip(study.responses, y.T, strict=True):
        if not varies(values):
            continue
        for name, fit in ({"chosen": _fit(study, response)} | others).items():
            row: dict[str, Any] = {"response": response.name, "surrogate": name}
            try:
                predicted = cross_validate(fit, x, values, folds=folds, seed=part.seed)
                found = accuracy(values, predicted, over="range")
                row |= {"are_over_range": found.are, "rmse_over_range": found.rmse, "r2": found.r2}
                row["largest_over_range"] = found.largest
            except InputError as error:
                row["note"] = str(error)
            rows.append(row)
    return pd.DataFrame(rows, columns=None if rows else ["response", "surrogate"])
