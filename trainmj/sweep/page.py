"""The report of a sweep, finished or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from trainmj.cases.origin import versions_in
from trainmj.cases.reader import read_sweep
from trainmj.cases.store import FILE
from trainmj.collision.quantities import Column as Response
from trainmj.collision.status import FAILED, MEANING, NOT_VALID, PAST_LIMITS, UNUSABLE, Kind
from trainmj.errors import InputError
from trainmj.files.text import from_json
from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.table import Column, Table, failed, judged, passed, warned, worded
from trainmj.scenario import from_yaml
from trainmj.sweep.page_responses import Factor, add_effects, add_map, add_responses, chosen_responses, factors_of

if TYPE_CHECKING:
    import pandas as pd

_MOST_ROWS = 100  # of cases and of reasons that are listed


@dataclass(frozen=True)
class Swept:
    """What a folder holds."""

    about: dict[str, str]  # what the store says of the sweep: scenario, versions and so on
    planned: int  # number of cases of the whole sweep
    table: pd.DataFrame  # a row for each finished case
    factors: list[Factor]  # what was varied
    responses: list[Response]  # what is drawn

    @property
    def usable(self) -> pd.DataFrame:
        """The cases whose responses may be used."""
        return self.table[~self.table["status"].isin(UNUSABLE)]

    @property
    def computed(self) -> pd.DataFrame:
        """The cases that could be computed, valid or not."""
        return self.table[~self.table["status"].isin(FAILED)]


def page_of_folder(folder: Path) -> Page:
    """The report of the folder of a sweep.

    Raises:
        InputError: if it holds no sweep, or one without a finished case.
    """
    sweep = _read(folder)
    text = sweep.about["scenario"]
    scenario = from_yaml(text, str(folder / FILE))
    varied = ", ".join(f.name for f in sweep.factors)
    page = Page(
        f"Sweep: {scenario.heading}",
        subtitle=f"{len(sweep.table)} of {sweep.planned} cases over {varied}; otherwise {scenario.subject}",
        command=_commands(sweep, folder.resolve().name),
        versions=versions_in(sweep.about),
    )
    _add_outcome(page.section("Outcome"), sweep)
    section = page.section("Responses over what was varied")
    if len(sweep.computed) and sweep.responses:
        add_responses(section, sweep.computed, sweep.factors, sweep.responses)
        if len(sweep.usable):
            add_effects(page.section("Main effects"), sweep.usable, sweep.factors, sweep.responses)
    else:
        section.text("No case could be computed.")
    _add_failures(page.section("Failures and limits"), sweep)
    _add_cases(page.section("Cases"), sweep)
    page.section("Scenario").code(text, "Scenario that the cases vary")
    return page


def _read(folder: Path) -> Swept:
    table, about = read_sweep(folder)
    try:
        names, planned = from_json(about["varied"]), int(about["cases"])
        about["scenario"]
    except (KeyError, ValueError) as error:
        raise InputError(f"{folder / FILE}: is not the file of a sweep, or damaged ({error})") from None
    if table.empty or "status" not in table:
        raise InputError(f"{folder}: no case of this sweep is finished: the command that began it goes on")
    return Swept(about, planned, table, factors_of(table, names), chosen_responses(table))


def _commands(sweep: Swept, folder: str) -> str:
    text = f"trainmj report {quote(folder)}"
    total = prod(len(f.levels) for f in sweep.factors)
    if total != sweep.planned or len(sweep.table) != total or any(f.nested for f in sweep.factors):
        return text
    vary = " ".join(quote(f"--vary={f.name}={','.join(f.say(v) for v in f.levels)}") for f in sweep.factors)
    return (
        f"{text}\n\n# the sweep again: save the scenario above as scenario.yaml\n"
        f"trainmj sweep scenario.yaml {vary} --out again --report"
    )


def _add_outcome(section: Section, sweep: Swept) -> None:
    counts = {Kind(str(kind)): int(count) for kind, count in sweep.table["status"].value_counts().items()}
    bad, invalid, past = (sum(counts.get(kind, 0) for kind in kinds) for kinds in (FAILED, NOT_VALID, PAST_LIMITS))
    n = len(sweep.table)
    all_there = passed("all finished") if n == sweep.planned else warned("unfinished: the same command goes on")
    section.cards(
        Card("Cases", str(n), f"of {sweep.planned}", verdict=all_there),
        Card("Failed", str(bad), "cases", "refused or unstable", verdict=judged(bad == 0, "none", "see below")),
        Card(
            "Not valid",
            str(invalid),
            "cases",
            "a curve ended behind which nothing is stated",
            verdict=judged(invalid == 0, "none", "see below"),
        ),
        Card(
            "Past a limit",
            str(past),
            "cases",
            "of the scenario or a device",
            verdict=judged(past == 0, "none", "see below"),
        ),
    )
    heads = [*worded("Status"), Column("cases"), Column("share", "%", 1), *worded("what it means")]
    endings = [(kind, count, 100.0 * count / n, MEANING[kind]) for kind, count in counts.items()]
    section.table(Table(heads, endings, "How the cases ended"))
    heads = [*worded("Varied", "unit"), *map(Column, ("from", "to", "levels"))]
    varied = [(f.name, f.axis[1], f.say(f.levels[0]), f.say(f.levels[-1]), len(f.levels)) for f in sweep.factors]
    section.table(Table(heads, varied, "What was varied"))


def _add_failures(section: Section, sweep: Swept) -> None:
    """How the cases ended over what was varied, and the reasons with their cases."""
    if (sweep.table["status"] == Kind.OVER).all():
        section.text("Every case came to its end within all limits.")
        return
    add_map(section, sweep.table, sweep.factors)
    for kinds, verdict, title in (
        (FAILED, failed, "Failed cases"),
        (NOT_VALID, failed, "Not valid: a curve ended behind which nothing is stated"),
        (PAST_LIMITS, failed, "Limits passed"),
        ((Kind.TIME_LIMIT,), warned, "Cut off by the time limit"),
        ((Kind.NO_CONTACT,), warned, "No contact"),
    ):
        rows = sweep.table[sweep.table["status"].isin(kinds)]
        if len(rows):
            said = rows.assign(status=rows["status"].map(verdict), reason=rows["reason"].fillna(""))
            note = f"The first {_MOST_ROWS} of {len(rows)}; results.csv has all." if len(rows) > _MOST_ROWS else ""
            section.table(_cases(sweep, said, {"reason": Column("reason", text=True)}, title, note))


def _add_cases(section: Section, sweep: Swept) -> None:
    n, drawn = len(sweep.table), {r.name: Column(r.title, r.unit, ".6g") for r in sweep.responses}
    note = f"{min(n, _MOST_ROWS)} of {n} cases, {len(drawn)} of the responses; results.csv has all."
    section.table(_cases(sweep, sweep.table, drawn, "Cases with some of their responses", note), folded=True)


def _cases(sweep: Swept, rows: pd.DataFrame, columns: Mapping[str, Column], title: str, note: str) -> Table:
    """The first cases of some: number, what was varied, status, and further columns by their names."""
    heads = [Column("Case"), *(Column(*f.axis) for f in sweep.factors), *worded("status"), *columns.values()]
    cells = [
        (n, *(f.say(row[f.name]) for f in sweep.factors), row["status"], *(row[name] for name in columns))
        for n, row in rows.head(_MOST_ROWS).iterrows()
    ]
    return Table(heads, cells, title, note)
