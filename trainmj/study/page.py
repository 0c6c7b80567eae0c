"""The report of a finished study: design, correlation, surrogates, fronts, weights, decision and check."""

from __future__ import annotations

from itertools import combinations, islice
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.status import Kind
from trainmj.errors import InputError
from trainmj.files.sealed import unsealed
from trainmj.files.text import read_bytes
from trainmj.files.yaml import as_yaml
from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.plot import axes, dots, line, numbers, plain, scale
from trainmj.output.style import BLUE, DIVERGING, ORANGE, PALETTE, YELLOW
from trainmj.output.table import Column, judged
from trainmj.scenario import from_yaml
from trainmj.study import tables
from trainmj.study.folder import ROBUST_FILES, Folder
from trainmj.study.fronts import FILES
from trainmj.study.run import SUMMARY
from trainmj.study.tables import Summary, columns, number, table_of
from trainmj.units import head, label

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import pandas as pd

    from trainmj.study.folder import Tables

_MOST_BYTES = 50_000_000  # of the summary
_LOOKS = {"surrogate": (YELLOW, "square-open"), "simulator": (BLUE, "circle")}
"""Colour and sign of each search."""

_MOST_FACTORS = 4  # pairs of factors over which the design is drawn
_MOST_OBJECTIVES = 6  # pairs of objectives over which the front is drawn
_MOST_ROWS = 20  # of simulations that are shown unfolded
_MOST_RANKED = 15


def page_of_folder(folder: Path) -> Page:
    """The report of the folder of a study.

    Raises:
        InputError: if the study is not finished, or one of its files cannot be read.
    """
    summary, files = _read(folder)
    factors = ", ".join(label(c.name, c.unit) for c in columns(summary, "factors").values())
    page = Page(
        f"Study: {summary['title']}",
        subtitle=f"{factors}: {' and '.join(f'{goal} {name}' for name, goal in summary['objectives'].items())}",
        command=f"trainmj report {quote(folder.resolve().name)}\n\n"
        f"# the study again: save the files above as again.study.yaml and {' and '.join(_scenarios(summary))}\n"
        "trainmj study again.study.yaml --out again --report",
        versions=summary["versions"],
        verdict=tables.verdict(summary),
        cover=from_yaml(summary["scenario"], str(folder / SUMMARY)).report,
    )
    _add_outcome(page.section("Outcome"), summary)
    _add_design(page.section("Design"), summary, files["02_simulations"])
    _add_correlation(page.section("Correlation"), summary, files["03_correlation"])
    _add_surrogates(page.section("Surrogates"), summary, files)
    _add_fronts(page.section("Pareto front"), summary, files)
    _add_decision(page.section("Weights and decision"), summary, files["09_ranking"])
    if "robust" in summary:
        _add_robust(page, summary, files)
    section = page.section("Files")
    section.code(as_yaml(summary["study"]), "The study as it was read")
    for name, text in _scenarios(summary).items():
        section.code(text, f"Its scenario: {name}")
    return page


def _add_robust(page: Page, summary: Summary, files: Tables) -> None:
    """The search for designs that hold under the tolerances, and how they do."""
    found = summary["robust"]
    own = {name.removeprefix(ROBUST_FILES): table for name, table in files.items() if name.startswith(ROBUST_FILES)}
    section = page.section("Robust designs")
    section.cards(Card("Robust design", "", verdict=tables.trust(found)))
    for table in tables.held(summary):
        section.table(table)
    section.table(tables.check(found))
    if found["remarks"]:
        section.table(tables.remarks(found))
    _add_surrogates(page.section("Robust: surrogates"), found, own)
    _add_fronts(page.section("Robust: Pareto front"), found, own)
    _add_decision(page.section("Robust: weights and decision"), found, own["09_ranking"])


def _scenarios(summary: Summary) -> dict[str, str]:
    """The scenarios of a study, by file."""
    return {"scenario.yaml": summary["scenario"], **summary["scenarios"]}


def _read(folder: Path) -> tuple[Summary, Tables]:
    """The summary of a finished study and its tables by file name without ending."""
    unfinished = InputError(f"{folder}: this study is not finished: the same trainmj study command goes on")
    if not (folder / SUMMARY).exists():
        raise unfinished
    try:
        summary = unsealed(read_bytes(folder / SUMMARY, _MOST_BYTES, follow=False))
    except ValueError as error:
        raise InputError(f"{folder / SUMMARY}: {error}: the same trainmj study command makes it again") from None
    if "check" not in summary:
        raise unfinished
    return summary, Folder(folder, (), "page").tables()


def _pairs(columns: Mapping[str, Column], most: int) -> Iterable[tuple[tuple[str, Column], tuple[str, Column]]]:
    """Pairs of columns with their heads, for the axes of plots."""
    return islice(combinations(columns.items(), 2), most)


def _add_outcome(section: Section, summary: Summary) -> None:
    chosen, check = summary["decision"]["chosen"], summary["check"]
    cards = [Card(c.name, number(chosen[key]), c.unit, "chosen") for key, c in columns(summary, "factors").items()]
    rows = {row["response"]: row for row in check["rows"]}
    for name, row in ((name, rows[name]) for name in summary["objectives"]):
        note = f"simulated; predicted {number(row['predicted'])}"
        cards.append(Card(name, number(row["simulated"]), row["unit"], note))
    limited = [row["kept"] for row in check["rows"] if row["kept"] is not None]
    verdict = judged(bool(check["kept"]), "kept when simulated", "not kept when simulated")
    kept = Card("Limits", str(sum(limited)), f"of {len(limited)} kept", f"check: {check['status']}", verdict)
    section.cards(Card("Study", "", verdict=tables.trust(summary)), *cards, kept)
    if summary["remarks"]:
        section.table(tables.remarks(summary))
    section.table(tables.check(summary))


def _add_design(section: Section, summary: Summary, simulated: pd.DataFrame) -> None:
    section.facts(tables.design(summary))
    for (x, a), (y, b) in _pairs(columns(summary, "factors"), _MOST_FACTORS):
        traces = []
        for status, part in simulated.groupby("status", sort=False):
            texts = [
                f"test {test}: {status} {reason}" for test, reason in zip(part["test"], part["reason"], strict=True)
            ]
            look = (BLUE, "circle") if status == Kind.OVER else (ORANGE, "triangle-up")
            traces.append(dots(str(status), part[x], part[y], *look, 9, texts))
        layout = axes(a.name, a.unit, b.name, b.unit)
        section.plot(traces, layout, title=f"Points of the design: {a.name} and {b.name}", height=360, half=True)
    ends = {name: Column(name, text=True) for name in ("status", "reason")}
    shown = {"test": Column("Test")} | columns(summary, "factors", "responses") | ends
    table = table_of(simulated.to_dict("records"), shown, "Simulations of the design")
    section.table(table, folded=len(simulated) > _MOST_ROWS)


def _add_correlation(section: Section, summary: Summary, table: pd.DataFrame) -> None:
    section.text(
        "Between factors and responses over the points of the design, from −1 to 1. The read-out has the interval at "
        f"{100 * summary['correlation']['level']:g} % and the probability p of such a value without a correlation."
    )
    intervals = zip(table["lower"], table["upper"], table["p"], strict=True)
    table = table.assign(interval=[f"{low:+.3f} to {high:+.3f}, p = {p:.2g}" for low, high, p in intervals])
    for method, part in table.groupby("method", sort=False):
        rows = {str(response): row for response, row in part.groupby("response", sort=False)}
        section.plot(
            [
                {
                    "type": "heatmap",
                    "x": [plain(str(factor)) for factor in part["factor"].unique()],
                    "y": [plain(response) for response in rows],
                    "z": [numbers(row["r"], 4) for row in rows.values()],
                    "text": [[f"{r:+.3f}" for r in row["r"]] for row in rows.values()],
                    "customdata": [row["interval"].tolist() for row in rows.values()],
                    "texttemplate": "%{text}",
                    "hovertemplate": "%{y} with %{x}: %{text} (%{customdata})<extra></extra>",
                    "zmin": -1,
                    "zmax": 1,
                    "colorscale": scale(DIVERGING),
                    "colorbar": {"thickness": 12, "outlinewidth": 0},
                }
            ],
            {"xaxis": {"type": "category"}, "yaxis": {"autorange": "reversed", "type": "category"}},
            title=f"{str(method).capitalize()} correlation, {int(part['n'].iloc[0])} points",
            height=120 + 44 * len(rows),
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
    for table, title in ((files[name], title) for name, title in folded.items() if name in files):
        numeric = table.select_dtypes("number").columns
        shown = {key: Column(str(key).replace("_", " "), text=key not in numeric) for key in table.columns}
        section.table(table_of(table.to_dict("records"), shown, title), folded=True)


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


def _add_fronts(section: Section, summary: Summary, files: Tables) -> None:
    """The fronts that were searched, the chosen design on them, and how the searches went."""
    there = {where: files[FILES[where]] for where in _LOOKS if FILES[where] in files}
    section.notes(tables.notes_on_fronts(summary))
    section.table(tables.fronts(summary))
    chosen, named = summary["decision"]["chosen"], columns(summary, "factors", "responses")
    simulated = chosen | {head(row["response"], row["unit"]): row["simulated"] for row in summary["check"]["rows"]}
    method = summary["decision"]["method"]
    ends = {f"chosen ({method})": (chosen, "star-open"), "the same, simulated": (simulated, "star")}

    def read_out(row: Mapping[Any, Any]) -> str:
        return ", ".join(f"{c.name} {number(row[key])} {c.unit}".rstrip() for key, c in named.items())

    for (x, a), (y, b) in _pairs(columns(summary, "objectives"), _MOST_OBJECTIVES):
        traces = []
        for where, table in there.items():
            texts = [read_out(row) for row in table.to_dict("records")]
            traces.append(dots(f"found on the {where}", table[x], table[y], *_LOOKS[where], 7, texts))
        joined: dict[str, Any] = {"showlegend": False, "hoverinfo": "skip"}
        traces.append(line("", [chosen[x], simulated[x]], [chosen[y], simulated[y]], "", ORANGE, **joined))
        for said, (row, sign) in ends.items():
            traces.append(dots(said, [row[x]], [row[y]], ORANGE, sign, 16, [read_out(row)]))
        section.plot(
            traces,
            axes(a.name, a.unit, b.name, b.unit),
            title=f"Front: {a.name} and {b.name}",
            note="The read-out names each design. A line joins the chosen design with its simulation.",
            height=460,
        )
    for where in there:
        progress = files.get(f"{FILES[where]}_progress")
        if progress is not None and len(progress) > 1:
            section.plot(
                [line("hypervolume", progress["evaluations"], progress["hypervolume"], "", _LOOKS[where][0])],
                axes("Evaluations", "", "Hypervolume", ""),
                title=f"Search on the {where}",
                height=300,
                half=True,
            )


def _add_decision(section: Section, summary: Summary, ranked: pd.DataFrame) -> None:
    """Weights, the chosen design, what other methods would choose, and the best of the rest."""
    section.table(tables.weights(summary), half=True)
    section.table(tables.decision(summary), half=True)
    section.notes(tables.notes_on_decision(summary))
    shown = {"rank": Column("Rank")} | columns(summary, "factors", "responses") | {"score": Column("score")}
    title = f"The best {min(_MOST_RANKED, len(ranked))} of {len(ranked)} designs"
    section.table(table_of(ranked.head(_MOST_RANKED).to_dict("records"), shown, title))
