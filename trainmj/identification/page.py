"""The report of an identification: fit and deviations, values found, what the data do not determine, the way there."""

from __future__ import annotations

from collections.abc import Mapping
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.identity import identity
from trainmj.identification import figures, tables
from trainmj.identification.found import FOUND, Found
from trainmj.identification.search import phases
from trainmj.output.blocks import Card, Column, Section, Verdict, failed, judged, passed, unjudged, warned
from trainmj.output.page import Page
from trainmj.output.plot import axes, dots, line
from trainmj.output.style import styled
from trainmj.scenario import to_yaml

if TYPE_CHECKING:
    import pandas as pd

PAGE = "report.html"
_BAND = {"fillcolor": "#888888", "opacity": 0.15, "line": {"width": 0}, "layer": "below"}
_ROLES = {"fitted": "Fit", "held out": "Held out"}


def page_of(found: Found, command: str = "") -> Page:
    """The page of an identification.

    Args:
        found: what it found.
        command: that makes it again.
    """
    plan = found.plan
    page = Page(
        plan.title,
        subtitle=f"{len(plan.unknowns.free)} values sought from {len(plan.fitted)} in {len(plan.fitted.cases)} cases",
        command=command,
        versions=identity(),
    )
    _outcome(page.section("Outcome"), found)
    for role, title in _ROLES.items():
        of = found.fit[found.fit["role"] == role]
        if len(of):
            _fit(page.section(title), found, role, of)
    _parameters(page.section("Values found"), found)
    _determined(page.section("What the data determine"), found)
    _search(page.section("Search"), found)
    files = page.section("Files")
    files.code((found.folder / FOUND).read_text(encoding="utf-8"), f"{FOUND}: what has changed", folded=True)
    files.code(to_yaml(plan.scenario), "Scenario that it was found for", folded=True)
    if plan.spec.notes:
        files.text(plan.spec.notes)
    return page


def command_of(targets: str, found: Found) -> str:
    """The command that makes an identification again."""
    return f"trainmj identify {quote(targets)} --out {quote(found.folder.resolve().name)} --resume --report"


def _outcome(section: Section, found: Found) -> None:
    known, fit = found.known, found.fit
    cards = [
        Card(
            "Misfit",
            f"{known.chi2:.3g}" if np.isfinite(known.chi2) else "–",
            "",
            f"per degree of freedom ({known.freedom}); 1 is what the tolerances say",
        )
    ]
    for role, title in _ROLES.items():
        of = fit[fit["role"] == role]
        values, outside = int(of["values"].sum()), int(of["outside"].sum())
        if values:
            stated = [kept for kept in of["kept"] if kept is not None]
            verdict = unjudged("no bars") if not stated else judged(all(stated), "bars kept", "a bar is not kept")
            cards.append(Card(title, f"{values - outside} of {values}", "", "values within what is allowed", verdict))
    loose = sum(not d.determined for d in known.directions)
    cards.append(
        Card(
            "Determined",
            f"{len(known.directions) - loose} of {len(known.directions)}",
            "",
            "combinations of parameters",
            warned(f"{loose} left open") if loose else passed("all of them"),
        )
    )
    section.cards(*cards)


def _fit(section: Section, found: Found, role: str, of: pd.DataFrame) -> None:
    if role == "held out":
        section.text("Values that the search never saw.")
    rows = [
        (
            row["target"],
            row["unit"],
            row["values"],
            float(row["rms"]),
            float(row["bias"]),
            float(row["largest"]),
            float(row["largest_percent"]),
            row["outside"],
            _bars(row),
        )
        for row in of.to_dict("records")
    ]
    columns = [
        Column("Target", text=True),
        Column("Unit", text=True),
        Column("values"),
        Column("rms"),
        Column("bias"),
        Column("largest"),
        Column("largest", "%", digits=2),
        Column("outside"),
        Column("bars", text=True),
    ]
    section.table(columns, rows, note="Outside: beyond the tolerance, or the bar on each value where there is one.")
    table = found.residuals[found.residuals["role"] == role]
    ratio = (table["deviation"] / table["allowed"]).to_numpy()
    said = [_said(found, row) for row in table.to_dict("records")]
    section.plot(
        [dots(role, ratio, table["target"].tolist(), texts=said)],
        axes(
            "(found - wanted) / allowed",
            "",
            "",
            "",
            yaxis={"autorange": "reversed", "type": "category"},
            shapes=[{"type": "rect", "xref": "x", "yref": "paper", "x0": -1, "x1": 1, "y0": 0, "y1": 1, **_BAND}],
        ),
        title="Deviations",
        note="The grey band is allowed.",
        height=160 + 26 * table["target"].nunique(),
    )
    cells = [
        (
            r["data"],
            _case(found, r),
            r["target"],
            r["unit"],
            *(float(r[key]) for key in ("wanted", "found", "deviation")),
            passed("within") if r["within"] else failed("outside"),
        )
        for r in table.to_dict("records")
    ]
    heads = [
        Column("Data", text=True),
        Column("Case", text=True),
        Column("Target", text=True),
        Column("Unit", text=True),
        Column("wanted"),
        Column("found"),
        Column("deviation"),
        Column("", text=True),
    ]
    section.table(heads, cells, title=f"All {len(cells)} values", folded=True)


def _bars(row: Mapping[Any, Any]) -> Verdict:
    bars = {key: row[f"bar_{key}"] for key in ("each", "rms", "bias")}
    stated = [
        f"{key} {bar}" for key, bar in bars.items() if bar is not None and bar == bar
    ]  # NaN where a table has none
    kept = None if row["kept"] is None else bool(row["kept"])
    return judged(kept, ", ".join(stated), f"not kept: {', '.join(stated)}", "none")


def _case(found: Found, row: Mapping[Any, Any]) -> str:
    names = {name for o in (*found.plan.fitted.observations, *found.plan.held_out.observations) for name in o.case}
    return ", ".join(f"{name} = {row[name]}" for name in row if name in names and row[name] == row[name])


def _said(found: Found, row: Mapping[Any, Any]) -> str:
    return f"{_case(found, row)}: {row['found']:.5g} for {row['wanted']:.5g} {row['unit']}"


def _parameters(section: Section, found: Found) -> None:
    columns = [
        Column("Parameter", text=True),
        Column("Unit", text=True),
        Column("value"),
        Column("standard error"),
        Column("95 % from"),
        Column("to"),
        Column("lower bound"),
        Column("upper bound"),
        Column("", text=True),
    ]
    rows = [
        (
            row["parameter"],
            row["unit"],
            float(row["value"]),
            float(row["standard_error"]) if row["remark"] != tables.OPEN else None,
            *tables.interval(row),
            float(row["lower_bound"]),
            float(row["upper_bound"]),
            row["remark"],
        )
        for row in found.parameters.to_dict("records")
    ]
    section.table(
        columns,
        rows,
        note="Errors follow from the derivatives at the values found, tolerances taken as standard deviations; they "
        "grow with the misfit where that is larger than the tolerances say.",
    )
    for row in found.summary["constraints"]:
        section.facts({row["constraint"]: judged(row["met"], f"{row['found_kJ']:.5g} kJ", f"{row['found_kJ']:.5g} kJ")})


def _determined(section: Section, found: Found) -> None:
    names = found.plan.unknowns.names
    section.text(
        "Combinations of parameters, worst determined first: one standard deviation along each, as part of the ranges "
        "between the bounds."
    )
    rows = [
        (
            tables.in_words(d, names),
            100.0 * d.deviation if np.isfinite(d.deviation) else "no limit",
            passed("determined") if d.determined else warned("left open"),
        )
        for d in found.known.directions
    ]
    section.table([Column("Combination", text=True), Column("deviation", "%"), Column("", text=True)], rows)
    with styled():
        section.picture(figures.correlations(found), alt="Correlations between the errors of the parameters")


def _search(section: Section, found: Found) -> None:
    traces = []
    for phase in dict.fromkeys(p.phase for p in found.way):
        steps = [n for n, p in enumerate(found.way) if p.phase == phase]
        traces.append(line(phases(found.plan)[phase], steps, [found.way[n].cost for n in steps]))
    if traces:
        section.plot(
            traces, axes("generations and iterations", "", "misfit", "", yaxis={"type": "log"}), title="Smallest misfit"
        )
    else:
        section.text("There was none: the start values were taken.")
