"""The report of an identification: fit and deviations, values found, what the data do not determine, the search."""

from __future__ import annotations

from shlex import quote

import numpy as np

from trainmj.collision.identity import identity
from trainmj.identification import figures, tables
from trainmj.identification.found import FOUND, Found
from trainmj.identification.uncertainty import MEANING
from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.plot import GREY, axes, dots, line
from trainmj.output.style import BLUE, styled
from trainmj.output.table import judged
from trainmj.scenario import to_yaml

_BAND = {"fillcolor": "#888888", "opacity": 0.15, "line": {"width": 0}, "layer": "below"}


def page_of(found: Found, command: str = "") -> Page:
    """The page of an identification; the command makes it again."""
    plan = found.plan
    page = Page(plan.title, subtitle=tables.size(plan), command=command, versions=identity())
    page.verdict, page.cover = tables.verdict(found), plan.scenario.report
    _outcome(page.section("Outcome"), found)
    for role in found.samples:
        _fit(page.section(role.capitalize()), found, role)
    section = page.section("Values found")
    section.table(tables.parameters(found))
    section.facts(tables.constraints(found))
    section = page.section("What the data determine")
    section.table(tables.directions(found))
    with styled():
        section.picture(figures.correlations(found), alt="Correlations between the errors of the parameters")
    _search(page.section("Search"), found)
    files = page.section("Files")
    files.code(found.as_yaml(), f"{FOUND}: what has changed")
    files.code(to_yaml(plan.scenario), "Scenario that it was found for")
    if plan.spec.notes:
        files.text(plan.spec.notes)
    return page


def command_of(targets: str, found: Found) -> str:
    """The command that makes an identification again."""
    return f"trainmj identify {quote(targets)} --out {quote(found.folder.resolve().name)} --report"


def _outcome(section: Section, found: Found) -> None:
    known = found.known
    misfit = f"{known.chi2:.3g}" if np.isfinite(known.chi2) else "–"
    note = (
        f"per degree of freedom ({known.freedom:g}); about 1 if the tolerances are right"
        if known.freedom > 0
        else "as many values are sought as there are to meet"
    )
    cards = [Card("Misfit", misfit, note=note)]
    for role in found.samples:
        of = found.fit[found.fit["role"] == role]
        values, outside = int(of["values"].sum()), int(of["outside"].sum())
        stated = [kept for kept in of["kept"] if kept is not None]
        verdict = judged(all(stated) if stated else None, "bars kept", "a bar is not kept", "no bars")
        inside = f"{values - outside} of {values}"
        cards.append(Card(role.capitalize(), inside, note="values within what is allowed", verdict=verdict))
    count, verdict = tables.determined(found)
    cards.append(Card("Determined", count, note="parameters, each by itself", verdict=verdict))
    section.cards(*cards)
    section.text(MEANING)


def _fit(section: Section, found: Found, role: str) -> None:
    section.table(tables.fit(found, role))
    for channel in found.channels(role):
        unit = channel.target.unit
        traces = [
            line("test", channel.time, channel.wanted, unit, GREY, 4.0, opacity=0.5),
            line("simulation", channel.time, channel.found, unit, BLUE),
        ]
        layout = axes("time of the test", "s", channel.target.name, unit)
        section.plot(traces, layout, title=channel.title, note=f"{channel.note}.", height=260, half=True)
    table = tables.single_values(found, role)
    if table.empty:
        return
    ratio = (table["deviation"] / table["allowed"]).to_numpy()
    section.plot(
        [dots(role, ratio, table["target"].tolist(), texts=[_said(found, row) for row in tables.rows_of(table)])],
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
    section.table(tables.values(found, role), folded=True)


def _said(found: Found, row: tables.Row) -> str:
    return f"{tables.case_of(found, row)}: {row['found']:.5g} for {row['wanted']:.5g} {row['unit']}"


def _search(section: Section, found: Found) -> None:
    if not found.way:
        section.text("There was none: the start values were taken.")
        return
    traces = [line(phase, steps, costs) for phase, (steps, costs) in found.phases().items()]
    layout = axes("generations and iterations", "", "misfit", "", yaxis={"type": "log"})
    section.plot(traces, layout, title="Smallest misfit")
