"""The tables of an identification, each told once for terminal and page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trainmj.identification.found import Found
from trainmj.identification.frames import OPEN
from trainmj.identification.plan import Identification
from trainmj.output.table import Column, Table, Verdict, judged, passed, warned

ROLES = {"fitted": "Fit", "held out": "Held out: never seen by the search"}


def size(plan: Identification) -> str:
    """How much is sought from how much."""
    return f"{len(plan.unknowns.free)} values sought from {len(plan.fitted)} in {len(plan.fitted.cases)} cases"


def fit(found: Found, role: str) -> Table:
    """How closely each target is met, by the values that were fitted or held out."""
    rows = found.fit[found.fit["role"] == role].to_dict("records")
    keys = ("target", "unit", "values", "rms", "bias", "largest", "largest_percent", "outside")
    return Table(
        [
            Column("Target", text=True),
            Column("unit", text=True),
            Column("values"),
            Column("rms", digits=".3g"),
            Column("bias", digits="+.2g"),
            Column("largest", digits="+.3g"),
            Column("largest", "%", digits="+.2f"),
            Column("outside"),
            Column("bars", text=True),
        ],
        [(*(row[key] for key in keys), _bars(row)) for row in rows],
        ROLES[role],
        "Outside: beyond the tolerance, or the bar on each value where there is one.",
    )


def _bars(row: Mapping[Any, Any]) -> Verdict:
    stated = [f"{key} {row[f'bar_{key}']}" for key in ("each", "rms", "bias") if _is_there(row[f"bar_{key}"])]
    kept = None if row["kept"] is None else bool(row["kept"])
    return judged(kept, ", ".join(stated), f"not kept: {', '.join(stated)}", "none")


def _is_there(value: Any) -> bool:
    """Whether a cell of a data frame holds something; pandas puts NaN for None among numbers."""
    return value is not None and value == value


def parameters(found: Found) -> Table:
    """The values found, and how well they are known."""
    return Table(
        [
            Column("Parameter", text=True),
            Column("unit", text=True),
            Column("value", digits=".6g"),
            Column("95 % from"),
            Column("to"),
            Column("remark", text=True),
            Column("standard error"),
            Column("lower bound"),
            Column("upper bound"),
        ],
        [
            (
                row["parameter"],
                row["unit"],
                row["value"],
                *_interval(row),
                row["remark"],
                None if row["remark"] == OPEN else row["standard_error"],
                row["lower_bound"],
                row["upper_bound"],
            )
            for row in found.parameters.to_dict("records")
        ],
        "Values found",
        "Errors follow from the derivatives at the values found, tolerances taken as standard deviations; they grow "
        "with the misfit where that is larger than the tolerances say.",
    )


def _interval(row: Mapping[Any, Any]) -> tuple[str, str]:
    """Both ends of the 95 % interval; of an end beyond a bound, only that it is."""
    low, high = row["low_95"], row["high_95"]
    return (
        f"< {row['lower_bound']:.4g}" if low < row["lower_bound"] else _number(low),
        f"> {row['upper_bound']:.4g}" if high > row["upper_bound"] else _number(high),
    )


def _number(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "-"


def directions(found: Found) -> Table:
    """Combinations of parameters, worst determined first."""
    names = found.plan.unknowns.names
    return Table(
        [Column("Combination", text=True), Column("deviation", "%"), Column("", text=True)],
        [
            (
                d.in_words(names),
                100.0 * d.deviation if np.isfinite(d.deviation) else "no limit",
                passed("determined") if d.determined else warned("left open"),
            )
            for d in found.known.directions
        ],
        "Combinations of parameters, worst determined first",
        "One standard deviation along each, in percent of the ranges between the bounds.",
    )


def values(found: Found, role: str) -> Table:
    """Every value that was fitted or held out, with its case."""
    rows = found.residuals[found.residuals["role"] == role].to_dict("records")
    return Table(
        [
            Column("Data", text=True),
            Column("case", text=True),
            Column("target", text=True),
            Column("unit", text=True),
            Column("wanted"),
            Column("found"),
            Column("deviation"),
            Column("", text=True),
        ],
        [
            (
                row["data"],
                case_of(found, row),
                row["target"],
                row["unit"],
                row["wanted"],
                row["found"],
                row["deviation"],
                judged(row["within"], "within", "outside"),
            )
            for row in rows
        ],
        f"All {len(rows)} values",
    )


def case_of(found: Found, row: Mapping[Any, Any]) -> str:
    """The case of a row of the residuals in words: ``mass_t = 33, speed_km_h = 20``."""
    names = dict.fromkeys(name for sample, _ in found.samples.values() for case in sample.cases for name in case)
    return ", ".join(f"{name} = {row[name]}" for name in names if _is_there(row[name]))


def constraints(found: Found) -> dict[str, Verdict]:
    """What each constraint came to, by its name."""
    areas = {row["constraint"]: (row["met"], f"{row['found_kJ']:.5g} kJ") for row in found.summary["constraints"]}
    return {
        name: judged(met, area, f"{area}: NOT MET, its parameter is at a bound") for name, (met, area) in areas.items()
    }
