"""The report of a finished study: design, correlation, surrogates, fronts, weights, decision and check."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.files.yaml import as_yaml
from trainmj.output.blocks import Card, Column, Section, judged, passed, warned
from trainmj.output.page import Page
from trainmj.output.plot import GREY, Trace, axes, dots, numbers, plain
from trainmj.output.style import BLUE, GREEN, ORANGE, SKY, YELLOW
from trainmj.study.finished import Finished, number, read_study
from trainmj.study.page_front import add_decision, add_fronts
from trainmj.units import label

if TYPE_CHECKING:
    import pandas as pd

_DIVERGING = [[0.0, ORANGE], [0.5, "#ffffff"], [1.0, BLUE]]


def page_of_folder(folder: Path) -> Page:
    """The report of the folder of a study.

    Raises:
        InputError: if the study is not finished, or a file of it cannot be read.
    """
    study = read_study(folder)
    facts = study.facts
    factors = ", ".join(label(f, unit) for f, unit in study.factors.items())
    page = Page(
        f"Study: {facts['title'] or 'train collisions'}",
        subtitle=f"{factors}: {' and '.join(f'{goal} {name}' for name, goal in facts['objectives'].items())}",
        command=_commands(study),
        versions=facts["versions"],
    )
    _add_outcome(page.section("Outcome"), study)
    _add_design(page.section("Design"), study)
    _add_correlation(page.section("Correlation"), study)
    _add_surrogates(page.section("Surrogates"), study)
    add_fronts(page.section("Pareto front"), study)
    add_decision(page.section("Weights and decision"), study)
    section = page.section("Files")
    section.code(as_yaml(facts["study"]), "The study as it was read", folded=True)
    section.code(facts["scenario"], "Its scenario: scenario.yaml", folded=True)
    return page


def _commands(study: Finished) -> str:
    return (
        f"trainmj report {quote(study.folder.resolve().name)}\n\n"
        "# the study again: save the files above as again.study.yaml and scenario.yaml\n"
        "trainmj study again.study.yaml --out again --report"
    )


def _add_outcome(section: Section, study: Finished) -> None:
    facts = study.facts
    chosen, check = facts["decision"]["chosen"], facts["check"]
    cards = [Card(name, number(chosen[study.column(name)]), unit, "chosen") for name, unit in study.factors.items()]
    rows = {row["response"]: row for row in check["rows"]}
    for name in facts["objectives"]:
        row = rows[name]
        cards.append(
            Card(name, number(row["simulated"]), row["unit"], f"simulated; predicted {number(row['predicted'])}")
        )
    section.cards(
        *cards,
        Card(
            "Limits",
            str(sum(r["kept"] is True for r in check["rows"])),
            f"of {sum(r['kept'] is not None for r in check['rows'])} kept",
            f"check: {check['status']}",
            judged(bool(check["kept"]), "kept when simulated", "not kept when simulated"),
        ),
    )
    section.table(
        [
            Column("Response", text=True),
            Column("unit", text=True),
            Column("as it stands"),
            Column("predicted"),
            Column("simulated"),
            Column("error", "%", 2),
            Column("limit", text=True),
            Column("verdict", text=True),
        ],
        [
            (
                r["response"],
                r["unit"],
                number(r["as_it_stands"]),
                number(r["predicted"]),
                number(r["simulated"]),
                r["error_percent"],
                r["limit"].replace("<=", "≤").replace(">=", "≥"),
                judged(r["kept"]),
            )
            for r in check["rows"]
        ],
        title="The chosen design, simulated",
        note="As it stands: the scenario before the study. Error: predicted less simulated. "
        + (f"Status of the check: {check['status']} {check['reason']}".strip() + "."),
    )


def _add_design(section: Section, study: Finished) -> None:
    d, s = study.facts["design"], study.facts["simulations"]
    section.facts(
        {
            "Method": d["method"],
            "Points": f"{d['n']}" + ("" if d["seed"] is None else f", seed {d['seed']}"),
            "Smallest distance": f"{number(d['smallest_distance'])} (factors scaled to 0..1)",
            "phi_p": number(d["phi_p"]),
            "Centred discrepancy": number(d["centred_discrepancy"]),
            "Simulated": judged(s["failed"] == 0, f"all {s['n']}", f"{s['failed']} of {s['n']} failed"),
            "Past a stroke limit": warned(f"{s['exhausted']} of {s['n']}") if s["exhausted"] else passed("none"),
        }
    )
    table = study.tables["02_simulations"]
    for a, b in list(combinations(study.factors, 2))[:4]:
        traces = []
        for status, part in table.groupby("status", sort=False):
            good = status == "over"
            texts = [
                f"test {t}: {status} {reason or ''}" for t, reason in zip(part["test"], part["reason"], strict=True)
            ]
            traces.append(
                dots(
                    str(status),
                    *_placed(part, study, a, b),
                    BLUE if good else ORANGE,
                    "circle" if good else "triangle-up",
                    9,
                    texts,
                )
            )
        layout = axes(a, study.unit(a), b, study.unit(b))
        section.plot(traces, layout, title=f"Points of the design: {a} and {b}", height=360, half=True)
    names = [*study.factors, *study.responses]
    section.table(
        [
            Column("Test"),
            *(Column(n, study.unit(n)) for n in names),
            Column("status", text=True),
            Column("reason", text=True),
        ],
        [
            (int(row["test"]), *(number(row[study.column(n)]) for n in names), row["status"], str(row["reason"] or ""))
            for _, row in table.iterrows()
        ],
        title="Simulations of the design",
        folded=len(table) > 20,
    )


def _placed(table: pd.DataFrame, study: Finished, a: str, b: str) -> tuple[list[Any], list[Any]]:
    return table[study.column(a)].tolist(), table[study.column(b)].tolist()


def _add_correlation(section: Section, study: Finished) -> None:
    table = study.tables["03_correlation"]
    c = study.facts["correlation"]
    section.text(
        f"Between factors and responses over the points of the design, from −1 to 1; in the read-out the interval at "
        f"{100 * c['level']:g} % and the probability p of such a value where there is no correlation."
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


def _add_surrogates(section: Section, study: Finished) -> None:
    rows = study.facts["surrogates"]["responses"]
    section.table(
        [
            Column("Response", text=True),
            Column("surrogate", text=True),
            Column("range simulated"),
            Column("R² of the fit", "", 4),
            Column("mean error, left out", "% of range", 2),
            Column("RMSE, left out", "% of range", 2),
            Column("R², left out", "", 4),
        ],
        [
            (
                name,
                row["surrogate"],
                f"{number(row['range'])} {row['unit']}",
                row["r2_fit"],
                _times(row["are_loo"], 100),
                _times(row["rmse_loo"], 100),
                row["r2_loo"],
            )
            for name, row in rows.items()
        ],
        title="How good the surrogates are",
        note="Left out: each point predicted by a surrogate that was fitted to the others.",
    )
    _add_sensitivity(section, study)
    folded = (
        ("04_cross_validation", "Other kinds of surrogates, cross-validated"),
        ("04_coefficients", "Coefficients"),
        ("04_anova", "Analysis of variance"),
    )
    for name, title in folded:
        if name in study.tables:
            _add_plain_table(section, study.tables[name], title)


def _add_sensitivity(section: Section, study: Finished) -> None:
    table = study.tables.get("04_sensitivity")
    if table is None:
        return
    traces: list[Trace] = []
    for (factor, part), colour in zip(
        table.groupby("factor", sort=False), (BLUE, ORANGE, GREEN, SKY, YELLOW, GREY), strict=False
    ):
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
        note="Part of the response's variance that a factor brings in, alone or with others; with its interval.",
        height=340,
    )


def _add_plain_table(section: Section, table: pd.DataFrame, title: str) -> None:
    """A table of the folder as it is, folded away."""
    text = {c: not np.issubdtype(np.asarray(table[c].tolist()).dtype, np.number) for c in table.columns}
    section.table(
        [Column(str(c).replace("_", " "), text=text[c]) for c in table.columns],
        [tuple("" if v is None else v for v in row) for row in table.itertuples(index=False)],
        title=title,
        folded=True,
    )


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
