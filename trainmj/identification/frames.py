"""What an identification found, as the data frames of its CSV files: fit, residuals, parameters, correlations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.device import Array
from trainmj.identification.file import Amount, absolute
from trainmj.identification.plan import Identification, Sample, Target
from trainmj.identification.uncertainty import WIDE, Uncertainty

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, Any]
OPEN = "not determined"
"""Remark of a parameter whose standard error is a large part of its range."""

_LAST = ["target", "unit", "wanted", "found", "deviation", "deviation_percent", "allowed", "within"]


def residuals(plan: Identification, samples: Mapping[str, tuple[Sample, Array]]) -> pd.DataFrame:
    """A row for each observation.

    Args:
        plan: what was sought.
        samples: observations and the values found for them (n,), by role: fitted, held out.
    """
    import pandas as pd

    rows = [row for role, (sample, found) in samples.items() for row in _residuals(plan, role, sample, found)]
    table = pd.DataFrame(rows)
    return table[["role", "data", *[c for c in table.columns if c not in {"role", "data", *_LAST}], *_LAST]]


def _residuals(plan: Identification, role: str, sample: Sample, found: Array) -> Iterator[Row]:
    for n, o in enumerate(sample.observations):
        target = plan.targets[int(sample.target[n])]
        bar = float(sample.bar[n])
        allowed = bar if np.isfinite(bar) else float(sample.tolerance[n])
        off = float(found[n]) - o.wanted
        yield {
            "role": role,
            "data": o.data,
            **o.case,
            "target": target.name,
            "unit": target.unit,
            "wanted": o.wanted,
            "found": float(found[n]),
            "deviation": off,
            "deviation_percent": 100.0 * off / o.wanted if o.wanted else np.nan,
            "allowed": allowed,
            "within": bool(abs(off) <= allowed),
        }


def fit(plan: Identification, residuals: pd.DataFrame) -> pd.DataFrame:
    """A row for each target and role: how many values, rms, bias, largest deviation, bars and whether they are kept."""
    import pandas as pd

    targets = {target.name: target for target in plan.targets}
    groups = dict(iter(residuals.groupby(["role", "target"], sort=False)))
    order = [(role, name) for role in dict.fromkeys(residuals["role"]) for name in targets if (role, name) in groups]
    return pd.DataFrame([_fit(targets[name], role, groups[role, name]) for role, name in order])


def _fit(target: Target, role: str, of: pd.DataFrame) -> Row:
    off, wanted = of["deviation"].to_numpy(), of["wanted"].to_numpy()
    bars = target.part.bars
    kept = [
        None if bars.each is None else bool(of["within"].all()),
        _keeps(bars.rms, off, wanted, lambda x: np.sqrt(np.mean(x**2))),
        _keeps(bars.bias, off, wanted, lambda x: np.abs(np.mean(x))),
    ]
    return {
        "role": role,
        "target": target.name,
        "unit": target.unit,
        "values": len(of),
        "rms": float(np.sqrt(np.mean(off**2))),
        "bias": float(np.mean(off)),
        "largest": _furthest(off),
        "largest_percent": _furthest(of["deviation_percent"].to_numpy()),
        "outside": int((~of["within"]).sum()),
        "bar_each": bars.each,
        "bar_rms": bars.rms,
        "bar_bias": bars.bias,
        "kept": None if kept == [None] * 3 else False not in kept,
    }


def _furthest(values: Array) -> float:
    """The value furthest from 0; NaN where none is a number."""
    known = values[~np.isnan(values)]
    return float(known[np.argmax(np.abs(known))]) if known.size else np.nan


def _keeps(amount: Amount | None, off: Array, wanted: Array, measure: Callable[[Array], float]) -> bool | None:
    """Whether a measure of deviations is within a bar, which may be a percentage of the values; None without a bar."""
    if amount is None:
        return None
    if isinstance(amount, str):
        return bool(np.all(wanted != 0) and measure(off / np.abs(wanted)) <= absolute(amount, 1.0))
    return bool(measure(off) <= amount)


def parameters(plan: Identification, known: Uncertainty) -> pd.DataFrame:
    """A row for each parameter: value, 95 % interval, standard error, bounds, start, and remarks."""
    import pandas as pd

    rows = []
    solved = {c.by: c.name for c in plan.unknowns.constraints}
    for k, p in enumerate(plan.unknowns.parameters):
        remarks = [f"solved from {solved[k]}"] if k in solved else []
        if known.at_bound[k]:
            remarks.append(f"at its {known.at_bound[k]} bound")
        elif known.error[k] > WIDE * p.range:
            remarks.append(OPEN)
        rows.append(
            {
                "parameter": p.name,
                "unit": p.unit,
                "value": known.value[k],
                "standard_error": known.error[k] * (known.value[k] if p.log else 1.0),
                "low_95": known.lower[k],
                "high_95": known.upper[k],
                "lower_bound": p.lower,
                "upper_bound": p.upper,
                "start": p.start,
                "remark": ", ".join(remarks),
                "sets": " ".join(s.path for s in p.settings),
            }
        )
    return pd.DataFrame(rows)


def correlations(plan: Identification, known: Uncertainty) -> pd.DataFrame:
    """Correlations between the errors of the parameters: a row and a column for each, empty at bounds."""
    import pandas as pd

    names = plan.unknowns.names
    return pd.DataFrame(known.correlation, columns=names).assign(parameter=names)[["parameter", *names]]


def directions(plan: Identification, known: Uncertainty) -> pd.DataFrame:
    """Combinations of parameters, worst determined first: deviation in percent of the ranges, in words, and parts."""
    import pandas as pd

    names = plan.unknowns.names
    rows = [
        {
            "deviation_percent": 100.0 * d.deviation,
            "determined": d.determined,
            "in_words": d.in_words(names),
            **{name: float(part) for name, part in zip(names, d.parts, strict=True)},
        }
        for d in known.directions
    ]
    return pd.DataFrame(rows, columns=["deviation_percent", "determined", "in_words", *names])
