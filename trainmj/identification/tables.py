"""What an identification found, as tables: fit, residuals, parameters, correlations, directions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.device import Array
from trainmj.identification.file import Amount, absolute
from trainmj.identification.plan import Identification, Sample, Target
from trainmj.identification.uncertainty import WIDE, Direction, Uncertainty
from trainmj.identification.unknowns import Point

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, Any]
OPEN = "not determined"
_WORDS = 4  # parameters that a direction is said in at most
_LEAST = 0.3  # part of a direction that is worth a word


def residual_table(plan: Identification, samples: dict[str, tuple[Sample, Array]]) -> pd.DataFrame:
    """A row for each observation.

    Args:
        plan: what was sought.
        samples: observations and the values found for them (n,), by role: fitted, held out.
    """
    import pandas as pd

    rows = [row for role, (sample, found) in samples.items() for row in _residuals(plan, role, sample, found)]
    table = pd.DataFrame(rows)
    last = ["target", "unit", "wanted", "found", "deviation", "deviation_percent", "allowed", "within"]
    return table[["role", "data", *[c for c in table.columns if c not in {"role", "data", *last}], *last]]


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


def fit_table(plan: Identification, residuals: pd.DataFrame) -> pd.DataFrame:
    """A row for each target and role: how many values, rms, bias, largest deviation, bars and whether they are kept."""
    import pandas as pd

    rows = []
    for role in dict.fromkeys(residuals["role"]):
        for target in plan.targets:
            of = residuals[(residuals["role"] == role) & (residuals["target"] == target.name)]
            if len(of):
                rows.append(_fit(target, role, of))
    return pd.DataFrame(rows)


def _fit(target: Target, role: str, of: pd.DataFrame) -> Row:
    off, wanted = of["deviation"].to_numpy(), of["wanted"].to_numpy()
    bars = target.part.bars
    rms, bias = float(np.sqrt(np.mean(off**2))), float(np.mean(off))
    kept = [
        bars.each is None or bool(of["within"].all()),
        _keeps(bars.rms, off, wanted, lambda x: np.sqrt(np.mean(x**2))),
        _keeps(bars.bias, off, wanted, lambda x: np.abs(np.mean(x))),
    ]
    stated = any(amount is not None for amount in (bars.each, bars.rms, bars.bias))
    return {
        "role": role,
        "target": target.name,
        "unit": target.unit,
        "values": len(of),
        "rms": rms,
        "bias": bias,
        "largest": _furthest(off),
        "largest_percent": _furthest(of["deviation_percent"].to_numpy()),
        "outside": int((~of["within"]).sum()),
        "bar_each": bars.each,
        "bar_rms": bars.rms,
        "bar_bias": bars.bias,
        "kept": all(kept) if stated else None,
    }


def _furthest(values: Array) -> float:
    """The value furthest from 0; NaN where none is a number."""
    known = values[~np.isnan(values)]
    return float(known[np.argmax(np.abs(known))]) if known.size else np.nan


def _keeps(amount: Amount | None, off: Array, wanted: Array, measure: Any) -> bool:
    """Whether a measure of deviations is within a bar, which may be a part of the values."""
    if amount is None:
        return True
    if isinstance(amount, str):
        return bool(np.all(wanted != 0) and measure(off / np.abs(wanted)) <= absolute(amount, 1.0))
    return bool(measure(off) <= amount)


def parameter_table(plan: Identification, known: Uncertainty) -> pd.DataFrame:
    """A row for each parameter: value, 95 % interval, standard error, bounds, start, and what there is to say."""
    import pandas as pd

    rows = []
    solved = {c.by: c.name for c in plan.unknowns.constraints}
    for k, p in enumerate(plan.unknowns.parameters):
        error = known.error[k] * (known.value[k] if p.log else 1.0)
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
                "standard_error": error,
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


def interval(row: Mapping[Any, Any]) -> tuple[str, str]:
    """Both ends of the 95 % interval of a row of the parameters, for reading; beyond a bound only that is said."""
    low, high = row["low_95"], row["high_95"]
    return (
        f"< {row['lower_bound']:.4g}" if low < row["lower_bound"] else _number(low),
        f"> {row['upper_bound']:.4g}" if high > row["upper_bound"] else _number(high),
    )


def _number(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "-"


def correlation_table(plan: Identification, known: Uncertainty) -> pd.DataFrame:
    """Correlations between the errors of the parameters; a row and a column for each, empty at bounds."""
    import pandas as pd

    names = plan.unknowns.names
    return pd.DataFrame(known.correlation, columns=names).assign(parameter=names)[["parameter", *names]]


def direction_table(plan: Identification, known: Uncertainty) -> pd.DataFrame:
    """Combinations of parameters, worst determined first: deviation in percent of the ranges, in words, and parts."""
    import pandas as pd

    names = plan.unknowns.names
    rows = [
        {
            "deviation_percent": 100.0 * d.deviation,
            "determined": d.determined,
            "in_words": in_words(d, names),
            **{name: float(part) for name, part in zip(names, d.parts, strict=True)},
        }
        for d in known.directions
    ]
    return pd.DataFrame(rows, columns=["deviation_percent", "determined", "in_words", *names])


def in_words(direction: Direction, names: list[str]) -> str:
    """What moves together along a direction: ``k_front up, c_front down``."""
    order = [k for k in np.argsort(-np.abs(direction.parts), kind="stable") if abs(direction.parts[k]) >= _LEAST]
    said = [f"{names[k]} {'up' if direction.parts[k] > 0 else 'down'}" for k in order[:_WORDS]]
    if len(said) == 1 and abs(direction.parts[order[0]]) > 0.95:
        return f"{names[order[0]]} alone"
    rest = float(np.sum(direction.parts**2) - np.sum(direction.parts[order[:_WORDS]] ** 2))
    return ", ".join(said or ["many"]) + (" and others" if rest > 0.3 else "")


def constraint_rows(plan: Identification, point: Point) -> list[Row]:
    """Each constraint: what it asks for and what the trial has."""
    return [
        {
            "constraint": c.name,
            "by": plan.unknowns.names[c.by],
            "wanted_kJ": c.energy,
            "found_kJ": plan.unknowns.area(c, point.value),
            "met": bool(abs(missed) <= 1.0),
        }
        for c, missed in zip(plan.unknowns.constraints, point.missed, strict=True)
    ]
