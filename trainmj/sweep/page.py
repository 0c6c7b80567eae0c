"""The report of a sweep, finished or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import prod
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from trainmj.cases.origin import scenario_of, versions_in
from trainmj.cases.reader import read_sweep
from trainmj.cases.store import FILE
from trainmj.collision.quantities import Column as Response
from trainmj.collision.status import COARSE, FAILED, MEANING, NOT_VALID, PAST_LIMITS, UNUSABLE, WHY_NOT_VALID, Kind
from trainmj.errors import InputError
from trainmj.files.text import from_json
from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.scenario import Scenario, from_yaml
from trainmj.sweep.outcome import first_of, outcome_of, passing, say_coarse, tables_of, verdict
from trainmj.sweep.page_limits import limits_of
from trainmj.sweep.page_responses import Factor, add_effects, add_map, add_responses, chosen_responses, factors_of
from trainmj.sweep.plan import LOAD_CASE, LOAD_CASES

if TYPE_CHECKING:
    import pandas as pd

_MOST_ROWS = 100  # of cases and of reasons that are listed


@dataclass(frozen=True)
class Swept:
    """What a folder holds."""

    about: dict[str, str]  # what the store says of the sweep: versions and so on
    scenarios: dict[str, str]  # as YAML, by load case; under no name, "", if there are none
    titles: dict[str, str]  # of the load cases, by name
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
    scenarios = {case: from_yaml(text, str(folder / FILE)) for case, text in sweep.scenarios.items()}
    first, *_ = scenarios.values()
    varied = ", ".join(f.name for f in sweep.factors)
    page = Page(
        f"Sweep of {len(scenarios)} load cases: {first.title}" if sweep.titles else f"Sweep: {first.heading}",
        subtitle=f"{len(sweep.table)} of {sweep.planned} cases over {varied}"
        + ("" if sweep.titles else f"; otherwise {first.subject}"),
        command=_commands(sweep, folder.resolve().name),
        versions=versions_in(sweep.about),
        verdict=_verdict(sweep),
        cover=first.report,
    )
    _add_outcome(page.section("Outcome"), sweep)
    if sweep.titles:
        _add_load_cases(page.section("Load cases"), sweep, scenarios)
    section = page.section("Responses over what was varied")
    if len(sweep.computed) and sweep.responses:
        limits = limits_of(scenarios.values(), sweep.factors)
        add_responses(section, sweep.computed, sweep.factors, sweep.responses, limits)
        if len(sweep.usable):
            add_effects(page.section("Main effects"), sweep.usable, sweep.factors, sweep.responses)
    else:
        section.text("No case could be computed.")
    _add_failures(page.section("Failures and limits"), sweep)
    _add_cases(page.section("Cases"), sweep)
    section = page.section("Scenarios" if sweep.titles else "Scenario")
    for case, text in sweep.scenarios.items():
        section.code(text, f"Scenario of load case {case}" if case else "Scenario that the cases vary")
    return page


def _read(folder: Path) -> Swept:
    table, about = read_sweep(folder)
    try:
        names, planned = from_json(about["varied"]), int(about["cases"])
        titles: dict[str, str] = from_json(about.get(LOAD_CASES, "{}"))
        scenarios = {case: about[scenario_of(case)] for case in titles or ("",)}
        if titles and (planned < len(titles) or not set(table[LOAD_CASE]) <= titles.keys()):
            raise ValueError(LOAD_CASES)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{folder / FILE}: is not the file of a sweep, or damaged ({error})") from None
    if table.empty or "status" not in table:
        raise InputError(f"{folder}: no case of this sweep is finished: the command that began it goes on")
    return Swept(about, scenarios, titles, planned, table, factors_of(table, names), chosen_responses(table))


def _commands(sweep: Swept, folder: str) -> str:
    text = f"trainmj report {quote(folder)}"
    total = prod(len(f.levels) for f in sweep.factors)
    if sweep.titles or total != sweep.planned or len(sweep.table) != total or any(f.nested for f in sweep.factors):
        return text
    vary = " ".join(quote(f"--vary={f.name}={','.join(f.say(v) for v in f.levels)}") for f in sweep.factors)
    return (
        f"{text}\n\n# the sweep again: save the scenario above as scenario.yaml\n"
        f"trainmj sweep scenario.yaml {vary} --out again --report"
    )


def _verdict(sweep: Swept) -> Verdict:
    status = sweep.table["status"]
    wrong = sweep.table[status.isin((*UNUSABLE, *PAST_LIMITS))][["status", "reason"]].fillna("")
    first = first_of((int(n), str(status), str(reason)) for n, status, reason in wrong.itertuples())
    outcome = outcome_of(sweep.table, sweep.titles, sweep.planned) if sweep.titles else None
    return verdict({str(kind): int(n) for kind, n in status.value_counts().items()}, sweep.planned, first, outcome)


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
            WHY_NOT_VALID,
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


def _add_load_cases(section: Section, sweep: Swept, scenarios: Mapping[str, Scenario]) -> None:
    """What collides in each load case, how its cases ended, which governs, and how each combination ended in all."""
    outcome = outcome_of(sweep.table, sweep.titles, sweep.planned)
    colliding = [(case, scenario.subject) for case, scenario in scenarios.items()]
    section.table(Table(worded("Load case", "what collides"), colliding, "What collides"))
    for table, title in zip(tables_of(outcome), ("How the load cases ended", "Limits, and what governs"), strict=False):
        section.table(replace(table, title=title))
    if not (factors := [f for f in sweep.factors if f.name != LOAD_CASE]):
        return
    section.text(f"{passing(outcome)}: none of their cases failed, is not valid, or passed a limit.")
    each, rows = sweep.planned // len(sweep.titles), sweep.table
    shown = sorted(set(rows.index % each))[:_MOST_ROWS]
    cells = []
    for n in shown:
        there = [k * each + n for k in range(len(sweep.titles))]
        known = [case for case in there if case in rows.index]
        verdicts = [_ended(str(rows["status"][case])) if case in known else None for case in there]
        cells.append((n, *(f.say(rows[f.name][known[0]]) for f in factors), *verdicts))
    heads = [Column(f"case of {next(iter(sweep.titles))}"), *(Column(*f.axis) for f in factors), *worded(*sweep.titles)]
    note = f"The first {_MOST_ROWS} of {each}; results.csv has all." if each > _MOST_ROWS else ""
    section.table(Table(heads, cells, "Combinations in all load cases", note))


def _ended(status: str) -> Verdict:
    return judged(status not in (*UNUSABLE, *PAST_LIMITS), status, status)


def _add_failures(section: Section, sweep: Swept) -> None:
    """How the cases ended over what was varied, and the reasons with their cases."""
    coarse = sweep.table[sweep.table["reason"].fillna("").str.contains(COARSE, regex=False)]
    if len(coarse):
        section.text(f"{say_coarse(len(coarse), len(sweep.table))}.")
        _add_reasons(section, sweep, coarse, warned, "Coarse steps")
    if (sweep.table["status"] == Kind.OVER).all():
        section.text("Every case came to its end within all limits.")
        return
    add_map(section, sweep.table, sweep.factors)
    for kinds, say, title in (
        (FAILED, failed, "Failed cases"),
        (NOT_VALID, failed, f"Not valid: {WHY_NOT_VALID}"),
        (PAST_LIMITS, failed, "Limits passed"),
        ((Kind.TIME_LIMIT,), warned, "Cut off by the time limit"),
        ((Kind.NO_CONTACT,), warned, "No contact"),
    ):
        rows = sweep.table[sweep.table["status"].isin(kinds)]
        if len(rows):
            _add_reasons(section, sweep, rows, say, title)


def _add_reasons(section: Section, sweep: Swept, rows: pd.DataFrame, say: Callable[[str], Verdict], title: str) -> None:
    """The first of some cases with their reasons."""
    said = rows.assign(status=rows["status"].map(say), reason=rows["reason"].fillna(""))
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
