"""The report of a finished study: design, correlation, surrogates, fronts, weights, decision and check."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import numpy as np

from trainmj.errors import InputError
from trainmj.files.tables import read_back
from trainmj.files.yaml import as_yaml
from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.plot import axes, dots, numbers, plain
from trainmj.output.style import BLUE, ORANGE, PALETTE
from trainmj.output.table import Column, Table, judged
from trainmj.study import tables
from trainmj.study.page_front import add_decision, add_fronts
from trainmj.study.run import SUMMARY
from trainmj.study.tables import Summary
from trainmj.units import label

if TYPE_CHECKING:
    import pandas as pd

    from trainmj.study.folder import Tables

_DIVERGING = [[0.0, ORANGE], [0.5, "#ffffff"], [1.0, BLUE]]
_MOST_PAIRS = 4  # of factors whose points are drawn
_MOST_ROWS = 20  # of simulations that are shown unfolded


def page_of_folder(folder: Path) -> Page:
    """The report of the folder of a study.

    Raises:
        InputError: if the study is not finished, or one of its files cannot be read.
    """
    summary, files = _read(folder)
    unit = tables.units(summary)
    factors = ", ".join(label(name, unit[name]) for name in summary["factors"])
    page = Page(
        f"Study: {summary['title']}",
        subtitle=f"{factors}: {' and '.join(f'{goal} {name}' for name, goal in summary['objectives'].items())}",
        command=f"trainmj report {quote(folder.resolve().name)}\n\n"
        "# the study again: save the files above as again.study.yaml and scenario.yaml\n"
        "trainmj study again.study.yaml --out again --report",
        versions=summary["versions"],
    )
    _add_outcome(page.section("Outcome"), summary)
    _add_design(page.section("Design"), summary, files["02_simulations"])
    _add_correlation(page.section("Correlation"), summary, files["03_correlation"])
    _add_surrogates(page.section("Surrogates"), summary, files)
    add_fronts(page.section("Pareto front"), summary, files)
    add_decision(page.section("Weights and decision"), summary, files)
    section = page.section("Files")
    section.code(as_yaml(summary["study"]), "The study as it was read", folded=True)
    section.code(summary["scenario"], "Its scenario: scenario.yaml", folded=True)
    return page


def _read(folder: Path) -> tuple[Summary, Tables]:
    """The summary of a finished study and its tables by file name without ending."""
    unfinished = InputError(f"{folder}: this study is not finished: the same trainmj study command goes on")
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
        files = {file.stem: read_back(file) for file in sorted(folder.glob("[0-9][0-9]_*.csv"))}
    except FileNotFoundError:
        raise unfinished from None
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: a file of the study cannot be read ({error}): run it again") from None
    if not isinstance(summary, dict) or "check" not in summary:
        raise unfinished
    return summary, files


def _add_outcome(section: Section, summary: Summary) -> None:
    chosen, check = summary["decision"]["chosen"], summary["check"]
    rows = {row["response"]: row for row in check["rows"]}
    factors = tables.columns(summary, summary["factors"])
    limited = [row["kept"] for row in check["rows"] if row["kept"] is not None]
    verdict = judged(bool(check["kept"]), "kept when simulated", "not kept when simulated")
    section.cards(
        *(Card(c.name, tables.number(chosen[head]), c.unit, "chosen") for head, c in factors.items()),
        *(
            Card(
                name,
                tables.number(rows[name]["simulated"]),
                rows[name]["unit"],
                f"simulated; predicted {tables.number(rows[name]['predicted'])}",
            )
            for name in summary["objectives"]
        ),
        Card("Limits", str(sum(limited)), f"of {len(limited)} kept", f"check: {check['status']}", verdict),
    )
    section.table(tables.check(summary))


def _add_design(section: Section, summary: Summary, simulated: pd.DataFrame) -> None:
    section.facts(tables.design(summary))
    factors = tables.columns(summary, summary["factors"])
    for (x, a), (y, b) in list(combinations(factors.items(), 2))[:_MOST_PAIRS]:
        traces = []
        for status, part in simulated.groupby("status", sort=False):
            good = status == "over"
            texts = [f"test {row['test']}: {status} {row['reason'] or ''}" for row in part.to_dict("records")]
            colour, sign = (BLUE, "circle") if good else (ORANGE, "triangle-up")
            traces.append(dots(str(status), part[x].tolist(), part[y].tolist(), colour, sign, 9, texts))
        layout = axes(a.name, a.unit, b.name, b.unit)
        section.plot(traces, layout, title=f"Points of the design: {a.name} and {b.name}", height=360, half=True)
    named = factors | tables.columns(summary, summary["responses"])
    section.table(
        Table(
            [Column("Test"), *named.values(), Column("status", text=True), Column("reason", text=True)],
            [
                (row["test"], *(row[head] for head in named), row["status"], str(row["reason"] or ""))
                for row in simulated.to_dict("records")
            ],
            "Simulations of the design",
        ),
        folded=len(simulated) > _MOST_ROWS,
    )


def _add_correlation(section: Section, summary: Summary, table: pd.DataFrame) -> None:
    section.text(
        "Between factors and responses over the points of the design, from −1 to 1. The read-out has the interval at "
        f"{100 * summary['correlation']['level']:g} % and the probability p of such a value without a correlation."
    )
    for method, part in table.groupby("method", sort=False):
        factors, responses = part["factor"].unique().tolist(), part["response"].unique().tolist()
        cells = part.set_index(["response", "factor"])
        grid = [[cells.loc[(r, f)] for f in factors] for r in responses]
        section.plot(
            [
                {
                    "type": "heatmap",
                    "x": [plain(str(f)) for f in factors],
                    "y": [plain(str(r)) for r in responses],
                    "z": [numbers([v["r"] for v in row], 4) for row in grid],
                    "text": [[f"{v['r']:+.3f}" for v in row] for row in grid],
                    "customdata": [
                        [f"{v['lower']:+.3f} to {v['upper']:+.3f}, p = {v['p']:.2g}" for v in row] for row in grid
                    ],
                    "texttemplate": "%{text}",
                    "hovertemplate": "%{y} with %{x}: %{text} (%{customdata})<extra></extra>",
                    "zmin": -1,
                    "zmax": 1,
                    "colorscale": _DIVERGING,
                    "colorbar": {"thickness": 12, "outlinewidth": 0},
                }
            ],
            {"xaxis": {"type": "category"}, "yaxis": {"autorange": "reversed", "type": "category"}},
            title=f"{str(method).capitalize()} correlation, {int(part['n'].iloc[0])} points",
            height=120 + 44 * len(responses),
            half=True,
        )


def _add_surrogates(section: Section, summary: Summary, files: Tables) -> None:
    section.table(tables.surrogates(summary))
    if "04_sensitivity" in files:
        _add_sensitivity(section, files["04_sensitivity"])
    folded = {
        "04_cross_validation": "Other kinds of surrogates, cross-validated",
        "04_coefficients": "Coefficients",
        "04_anova": "Analysis of variance",
    }
    for name, title in folded.items():
        if name in files:
            section.table(_as_it_is(files[name], title), folded=True)


def _add_sensitivity(section: Section, table: pd.DataFrame) -> None:
    traces = []
    for (factor, part), colour in zip(table.groupby("factor", sort=False), PALETTE, strict=False):
        total = part["total"].to_numpy(dtype=np.float64)
        traces.append(
            {
                "type": "bar",
                "name": plain(str(factor)),
                "x": [plain(str(r)) for r in part["response"]],
                "y": numbers(total, 4),
                "marker": {"color": colour},
                "error_y": {
                    "array": numbers(part["total_upper"] - total, 4),
                    "arrayminus": numbers(total - part["total_lower"], 4),
                    "symmetric": False,
                    "thickness": 1,
                },
            }
        )
    section.plot(
        traces,
        {"yaxis": {"title": {"text": "Total Sobol' index"}}, "barmode": "group"},
        title="What each response depends on, by the surrogates",
        note="Share of the response's variance in which a factor takes part, alone or with others; with its interval.",
        height=340,
    )


def _as_it_is(table: pd.DataFrame, title: str) -> Table:
    """A table of the folder, unchanged."""
    text = {c: not np.issubdtype(np.asarray(table[c].tolist()).dtype, np.number) for c in table.columns}
    return Table(
        [Column(str(c).replace("_", " "), text=text[c]) for c in table.columns],
        [tuple("" if v is None else v for v in row) for row in table.itertuples(index=False)],
        title,
    )
