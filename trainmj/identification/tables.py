"""The tables of an identification, each told once for terminal and page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.identification.file import absolute
from trainmj.identification.found import OPEN, Found
from trainmj.identification.plan import Identification
from trainmj.output.table import Column, Table, Verdict, judged, passed, warned, worded
from trainmj.units import against

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[str, Any]

HELD = " They hold only while parameters at a bound are held there."
"""What is added to the errors where there are such parameters."""

ROLES = {"fitted": "Fit", "held out": "Held out: never seen by the search"}

_FIT = {
    "target": Column("Target", text=True),
    "unit": Column("unit", text=True),
    "values": Column("values"),
    "rms": Column("rms", digits=".4g"),
    "bias": Column("bias", digits="+.4g"),
    "largest": Column("largest", digits="+.4g"),
    "largest_percent": Column("largest", "%", digits="+.2f"),
    "outside": Column("outside"),
    "verdict": Column("bars", text=True),
    "bars": Column("stated", text=True),
}
_PARAMETERS = {
    "parameter": Column("Parameter", text=True),
    "unit": Column("unit", text=True),
    "value": Column("value", digits=".6g"),
    "low": Column("95 % from", head="95 %\nfrom"),
    "high": Column("to"),
    "judged": Column("determined", text=True),
    "standard_error": Column("standard error"),
    "lower_bound": Column("lower bound"),
    "upper_bound": Column("upper bound"),
}
_VALUES = {
    "data": Column("Data", text=True),
    "case": Column("case", text=True),
    "target": Column("target", text=True),
    "unit": Column("unit", text=True),
    "wanted": Column("wanted"),
    "found": Column("found"),
    "deviation": Column("deviation"),
    "verdict": Column("", text=True),
}


def verdict(found: Found) -> Verdict:
    """Whether the bars of fit and check are kept, and how many values are within what is allowed."""
    stated = [kept for kept in found.fit["kept"] if kept is not None]
    counts = []
    for role in found.samples:
        of = found.fit[found.fit["role"] == role]
        values, outside = int(of["values"].sum()), int(of["outside"].sum())
        counts.append(f"{values - outside} of {values} values of {role}")
    said = f"{', '.join(counts)} are within what is allowed"
    if not stated:
        return Verdict("none", f"{said}; no bars are stated.")
    return judged(
        all(stated), f"All bars are kept; {said}.", f"{stated.count(False)} of {len(stated)} bars are not kept; {said}."
    )


def size(plan: Identification) -> str:
    """How much is sought from how much."""
    fitted = plan.fitted
    given = [(int(np.isnan(fitted.time).sum()), "values"), (len(fitted.channels), "channels")]
    given = [(n, what) for n, what in given if n]
    of = f"{len(fitted)}" if not fitted.channels else " and ".join(_counted(n, what) for n, what in given)
    return f"{len(plan.unknowns.free)} values sought from {of} in {_counted(len(fitted.cases), 'cases')}"


def _counted(n: int, what: str) -> str:
    return f"{n} {what if n != 1 else what.removesuffix('s')}"


def sought(plan: Identification) -> Table:
    """The parameters, and where they may be."""
    name, unit, lower, upper = (_PARAMETERS[key] for key in ("parameter", "unit", "lower_bound", "upper_bound"))
    rows = [[p.name, p.unit, p.start, p.lower, p.upper, ", ".join(p.meant)] for p in plan.unknowns.parameters]
    return Table([name, unit, Column("start"), lower, upper, *worded("sets")], rows)


def wanted(plan: Identification) -> Table:
    """The targets, and how many values each has."""
    columns = [*(_FIT[key] for key in ("target", "unit", "values")), Column("held out"), *worded("response or channel")]
    counts = [np.bincount(sample.target, minlength=len(plan.targets)) for sample in (plan.fitted, plan.held_out)]
    rows = [[t.name, t.unit, int(m), int(n), t.part.asked[1]] for t, m, n in zip(plan.targets, *counts, strict=True)]
    return Table(columns, rows)


def fit(found: Found, role: str) -> Table:
    """How closely each target is met, by the values that were fitted or held out."""
    rows = [row | _bars(row) for row in rows_of(found.fit[found.fit["role"] == role])]
    columns = {key: column for key, column in _FIT.items() if key != "bars" or any(row[key] for row in rows)}
    note = "Outside: beyond the tolerance, or the bar on each value where there is one."
    lost = [f"{row['target']} ({row['without_number']})" for row in rows if row["without_number"]]
    if lost:
        note += " Values without a number, in cases that are refused, unstable, not valid or end too early: "
        note += f"{', '.join(lost)}."
    return _table(columns, rows, ROLES[role], note)


def parameters(found: Found) -> Table:
    """The values found, and how well they are known."""
    return _table(
        _PARAMETERS,
        [row | _known(row) for row in rows_of(found.parameters)],
        "Parameters",
        "Errors follow from the derivatives at the values found, tolerances taken as standard deviations; they "
        "grow with the misfit where that is larger than the tolerances say." + HELD * any(found.known.at_bound),
    )


def determined(found: Found) -> tuple[str, Verdict]:
    """How many parameters the data determine, and what becomes of the others."""
    counts = found.known.standing
    n = sum(counts.values())
    others = [f"{count} {name}" for name, count in counts.items() if count and name != "determined"]
    return f"{counts['determined']} of {n}", warned(", ".join(others)) if others else passed("all of them")


def directions(found: Found) -> Table:
    """Combinations of parameters, worst determined first."""
    columns = [Column("Combination", text=True), Column("deviation", "%"), Column("", text=True)]
    rows = [
        [
            d.in_words(found.plan.unknowns.names),
            100.0 * d.deviation if np.isfinite(d.deviation) else "no limit",
            passed("determined") if d.determined else warned("left open"),
        ]
        for d in found.known.directions
    ]
    note = "One standard deviation along each, in percent of the ranges between the bounds."
    return Table(columns, rows, "Combinations of parameters, worst determined first", note)


def values(found: Found, role: str) -> Table:
    """Every value that was fitted or held out, with its case, but samples of channels."""
    rows = rows_of(single_values(found, role))
    more = [{"case": case_of(found, row), "verdict": judged(row["within"], "within", "outside")} for row in rows]
    return _table(_VALUES, [row | m for row, m in zip(rows, more, strict=True)], f"All {len(rows)} values")


def single_values(found: Found, role: str) -> pd.DataFrame:
    """The residuals of a role without those of channels."""
    table = found.residuals[found.residuals["role"] == role]
    return table[table["time_s"].isna()] if "time_s" in table else table


def rows_of(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a data frame, by the heads of its columns."""
    return [{str(key): value for key, value in row.items()} for row in frame.to_dict("records")]


def _table(columns: Mapping[str, Column], rows: Sequence[Row], title: str = "", note: str = "") -> Table:
    """Some of the values of rows, under their heads."""
    return Table(list(columns.values()), [[row[key] for key in columns] for row in rows], title, note)


def _bars(row: Row) -> dict[str, Any]:
    """Whether the bars are kept, and what they are."""
    bars = {key: row[f"bar_{key}"] for key in ("each", "rms", "bias") if _is_there(row[f"bar_{key}"])}
    said = ", ".join(f"{key} {bar}" if isinstance(bar, str) else f"{key} {bar:g}" for key, bar in bars.items())
    kept = None if row["kept"] is None else bool(row["kept"])
    shown = {"verdict": judged(kept, "kept", "not kept", "none"), "bars": said}
    each = bars.get("each")
    if isinstance(each, str):
        shown["largest_percent"] = _beside(row["largest_percent"], 100 * absolute(each, 1.0), 2)
    limits = {"rms": bars.get("rms"), "bias": bars.get("bias"), "largest": each}
    for measure, bar in limits.items():
        if isinstance(bar, float | int):
            shown[measure] = _beside(row[measure], bar, -3).removeprefix("+" if measure == "rms" else "")
    return shown


def _beside(value: float, bar: float, digits: int) -> str:
    """A deviation with its sign and the digits that tell it from its bar."""
    return ("+" if value >= 0 else "") + against(value, bar, digits)


def _is_there(value: Any) -> bool:
    """Whether a cell of a data frame holds something; pandas puts NaN for None among numbers."""
    return value is not None and value == value


def _known(row: Row) -> dict[str, Any]:
    """Both ends of the 95 % interval, and the standard error; of an end beyond a bound, only that it is."""
    low, high, remark = row["low_95"], row["high_95"], row["remark"]
    return {
        "low": f"< {row['lower_bound']:.4g}" if low < row["lower_bound"] else _number(low),
        "high": f"> {row['upper_bound']:.4g}" if high > row["upper_bound"] else _number(high),
        "standard_error": None if OPEN in remark else row["standard_error"],
        "judged": passed(f"yes, {remark}" if remark else "yes") if row["determined"] else warned(remark),
    }


def _number(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "-"


def case_of(found: Found, row: Row) -> str:
    """The case of a row of the residuals in words: ``mass_t = 33, speed_km_h = 20``."""
    names = dict.fromkeys(name for sample, _ in found.samples.values() for case in sample.cases for name in case)
    return ", ".join(f"{name} = {row[name]}" for name in names if _is_there(row[name]))


def constraints(found: Found) -> dict[str, Verdict]:
    """What each constraint came to, by its name."""
    verdicts = {}
    for row in found.summary["constraints"]:
        area, wanted = f"{against(row['found_kJ'], row['wanted_kJ'], -5)} kJ", f"{row['wanted_kJ']:.12g} kJ"
        missed = f"{area} for {wanted}: NOT MET, its parameter is at a bound"
        verdicts[row["constraint"]] = judged(row["met"], wanted, missed)
    return verdicts
