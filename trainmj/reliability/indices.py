"""Sobol' indices of tolerances: which of them the scatter of a response comes from."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from trainmj.doe.influence import sobol_indices, sobol_points
from trainmj.errors import InputError
from trainmj.reliability.found import Index, Passed
from trainmj.reliability.searches import Searches


def indices_of(searches: Searches, governing: Passed | None) -> list[Index]:
    """The Sobol' indices that the plan asks for: of its responses, and of how much is used of the governing limit."""
    plan = searches.plan
    asked = plan.spec.sensitivity
    if asked is None:
        return []
    scatter, n = plan.scatter, 1 << (asked.runs - 1).bit_length()
    parts = list(dict.fromkeys(scatter.parts))
    z = ndtri(sobol_points(scatter.d, n, seed=plan.spec.seed, groups=scatter.parts))
    found: list[Index] = []
    for case in plan.cases:
        names = {name: column.title for name, column in plan.responses(case, asked.responses).items()}
        names |= {governing.name: governing.title} if governing is not None and governing.case == case else {}
        if not names:
            continue
        y = np.column_stack([searches.numbers(case, name, z) for name in names])
        try:
            shares = sobol_indices(y, parts, seed=plan.spec.seed, level=plan.spec.level)
        except InputError as error:
            raise InputError(f"sensitivity: {error}") from None
        for (name, title), share in zip(names.items(), shares, strict=True):
            for k, part in enumerate(parts):
                first = (float(share.first[k]), *share.first_interval[k].tolist())
                total = (float(share.total[k]), *share.total_interval[k].tolist())
                found.append(Index(case, name, title, part, first, total, share.left_out))
    return found
