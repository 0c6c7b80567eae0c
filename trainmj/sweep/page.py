"""The report of a sweep, finished or not."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import numpy as np

from trainmj.cases.store import FILE, read_table
from trainmj.cases.table import FAILED
from trainmj.errors import InputError
from trainmj.files.text import printable
from trainmj.output.blocks import Card, Column, Section, failed, judged, passed, warned
from trainmj.output.page import Page
from trainmj.sweep.page_responses import (
    Factor,
    add_effects,
    add_map,
    add_responses,
    chosen_responses,
    factors_of,
    short,
)
from trainmj.units import unit_of

if TYPE_CHECKING:
    import pandas as pd

_MOST_ROWS = 100  # of cases and of reasons that are listed


@dataclass(frozen=True)
class Sweep:
    """What a folder holds.

    Attributes:
        about: scenario, number of cases, versions and so on, as the store keeps them.
        table: a row for each finished case.
        factors: what was varied.
        responses: names of the columns that are drawn.
    """

    about: dict[str, str]
    table: pd.DataFrame
    factors: list[Factor]
    responses: list[str]

    @property
    def usable(self) -> pd.DataFrame:
        """The cases that could be computed."""
        return self.table[~self.table["status"].isin(FAILED)]


def page_of_folder(folder: Path) -> Page:
    """The report of the folder of a sweep.

    Raises:
        InputError: if it holds no sweep, or one without a finished case.
    """
    sweep = _read(folder)
    about, planned, n = sweep.about, int(sweep.about["cases"]), len(sweep.table)
    title = next((line for line in about["scenario"].splitlines() if line.startswith("title:")), "")
    name = folder.resolve().name
    page = Page(
        f"Sweep: {title.removeprefix('title:').strip() or 'train collisions'}",
        subtitle=f"{n} of {planned} cases over {', '.join(f.name for f in sweep.factors)}",
        command=_commands(sweep, name),
        versions={k.removeprefix("version_"): v for k, v in about.items() if k.startswith("version_")},
    )
    _add_outcome(page.section("Outcome"), sweep, planned)
    section = page.section("Responses over what was varied")
    if len(sweep.usable) and sweep.responses:
        add_responses(section, sweep.usable, sweep.factors, sweep.responses)
        add_effects(page.section("Main effects"), sweep.usable, sweep.factors, sweep.responses)
    else:
        section.text("No case could be computed.")
    _add_failures(page.section("Failures and limits"), sweep)
    _add_cases(page.section("Cases"), sweep)
    page.section("Scenario").code(about["scenario"], "Scenario that the cases vary", folded=True)
    return page


def _read(folder: Path) -> Sweep:
    from pandas.errors import DatabaseError

    try:
        table = read_table(folder)
        with sqlite3.connect(f"{(folder / FILE).resolve().as_uri()}?mode=ro", uri=True) as db:
            about = dict(db.execute("SELECT key, value FROM about"))
        names = json.loads(about["varied"])
        int(about["cases"])
        about["scenario"]
    except (sqlite3.Error, DatabaseError, KeyError, ValueError, TypeError) as error:
        reason = printable(str(error)).splitlines()[-1:] or [type(error).__name__]
        raise InputError(f"{folder / FILE}: is not the file of a sweep, or damaged ({reason[0]})") from None
    if table.empty or "status" not in table:
        raise InputError(f"{folder}: no case of this sweep is finished: go on with trainmj sweep ... --resume")
    return Sweep(about, table, factors_of(table, names), chosen_responses(table, names))


def _commands(sweep: Sweep, folder: str) -> str:
    text = f"trainmj report {quote(folder)}"
    levels = [f.levels for f in sweep.factors]
    total = int(np.prod([len(v) for v in levels]))
    if total != int(sweep.about["cases"]) or len(sweep.table) != total or any(f.nested for f in sweep.factors):
        return text
    vary = " ".join(quote(f"--vary={f.name}={','.join(f.say(v) for v in f.levels)}") for f in sweep.factors)
    return (
        f"{text}\n\n# the sweep again: save the scenario above as scenario.yaml\n"
        f"trainmj sweep scenario.yaml {vary} --out again --report"
    )


def _add_outcome(section: Section, sweep: Sweep, planned: int) -> None:
    table = sweep.table
    counts = table["status"].value_counts()
    bad = int(sum(counts.get(s, 0) for s in FAILED))
    spent = int(counts.get("stroke exhausted", 0))
    n = len(table)
    section.cards(
        Card(
            "Cases",
            str(n),
            f"of {planned}",
            verdict=passed("all finished") if n == planned else warned("unfinished: go on with --resume"),
        ),
        Card("Failed", str(bad), "cases", "refused or unstable", verdict=judged(bad == 0, "none", "see below")),
        Card("Past a limit", str(spent), "cases", verdict=warned("see below") if spent else passed("none")),
    )
    section.table(
        [Column("Status", text=True), Column("cases"), Column("share", "%", 1), Column("what it means", text=True)],
        [(s, int(c), 100.0 * int(c) / n, _MEANING.get(str(s), "")) for s, c in counts.items()],
        title="How the cases ended",
    )
    section.table(
        [Column("Varied", text=True), Column("unit", text=True), Column("from"), Column("to"), Column("levels")],
        [(f.name, f.unit, f.say(f.levels[0]), f.say(f.levels[-1]), len(f.levels)) for f in sweep.factors],
        title="What was varied",
    )


_MEANING = {
    "over": "no device is pressed any more",
    "time limit": "the collision was not over at the time limit",
    "no contact": "computed, but no device was pressed",
    "stroke exhausted": "computed, but a stroke limit or the end of a curve was passed",
    "unstable": "the energy balance is off, or a value is not finite",
    "refused": "the values break a rule; the reason names it",
}


def _add_failures(section: Section, sweep: Sweep) -> None:
    """Statuses over what was varied, and the reasons with their cases."""
    off = sweep.table[sweep.table["status"] != "over"]
    if off.empty:
        section.text("Every case came to its end within all limits.")
        return
    add_map(section, sweep.table, sweep.factors)
    for statuses, title in (
        (FAILED, "Failed cases"),
        (("stroke exhausted", "time limit"), "Limits passed"),
        (("no contact",), "No contact"),
    ):
        rows = off[off["status"].isin(statuses)]
        if rows.empty:
            continue
        shown = rows.head(_MOST_ROWS)
        section.table(
            [
                Column("Case"),
                *(Column(*f.axis) for f in sweep.factors),
                Column("status", text=True),
                Column("reason", text=True),
            ],
            [
                (
                    int(str(case)),
                    *(f.say(row[f.name]) for f in sweep.factors),
                    failed(row["status"]) if row["status"] in FAILED else warned(row["status"]),
                    str(row["reason"] or ""),
                )
                for case, row in shown.iterrows()
            ],
            title=title,
            note=f"The first {_MOST_ROWS} of {len(rows)}; all are in results.csv." if len(rows) > _MOST_ROWS else "",
        )


def _add_cases(section: Section, sweep: Sweep) -> None:
    names = sweep.responses
    shown = sweep.table.head(_MOST_ROWS)
    section.table(
        [
            Column("Case"),
            *(Column(*f.axis) for f in sweep.factors),
            Column("status", text=True),
            *(Column(short(name), unit_of(name)) for name in names),
        ],
        [
            (
                int(str(case)),
                *(f.say(row[f.name]) for f in sweep.factors),
                str(row["status"]),
                *(f"{row[name]:.6g}" if row[name] is not None and np.isfinite(row[name]) else None for name in names),
            )
            for case, row in shown.iterrows()
        ],
        title="Cases with some of their responses",
        note=f"{len(shown)} of {len(sweep.table)} cases, {len(names)} of the responses; all are in results.csv.",
        folded=True,
    )
