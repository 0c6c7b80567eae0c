"""The page of a reliability run."""

from __future__ import annotations

import numpy as np

from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.plot import Trace, axes, line
from trainmj.output.sources import sources_table
from trainmj.output.style import PALETTE
from trainmj.reliability import tables
from trainmj.reliability.figures import shown
from trainmj.reliability.found import Passed, ReliabilityResult
from trainmj.reliability.screen import remarks
from trainmj.scenario import to_yaml


def page_of(result: ReliabilityResult, command: str = "") -> Page:
    """The page of a reliability run; the command makes it again."""
    plan = result.plan
    page = Page(plan.title, subtitle=f"{tables.size(plan)}.", command=command, versions=result.versions)
    page.verdict, page.cover = tables.verdict(result), next(iter(plan.scenarios.values())).report
    section = page.section("Probabilities")
    section.cards(*_cards(result))
    section.notes(remark[:1].upper() + remark[1:] for remark in remarks(result))
    section.table(tables.probabilities(result))
    for one in shown(result):
        _running(section, one, plan.spec.level)
    governing = result.governing
    if governing is not None and governing.used.size:
        section = page.section("The limit that governs")
        _distribution(section, governing)
        section.table(tables.causes(result))
    for title, table in (("Small probabilities", tables.rare(result)), ("Which tolerance", tables.indices(result))):
        if table.rows:
            page.section(title).table(table)
    section = page.section("Responses")
    section.table(tables.quantiles(result))
    section.table(tables.endings(result))
    section = page.section("Tolerances and scenarios")
    section.table(tables.tolerances(plan))
    if plan.spec.sources:
        section.table(sources_table(plan.spec.sources, plan.spec.model_dump(exclude_unset=True, by_alias=True)))
    section.text(*(paragraph for paragraph in (plan.spec.notes.strip(),) if paragraph))
    section.text(
        "trainmj reliability FILE --out FOLDER --draw N writes the scenario of a draw, which trainmj run computes."
    )
    for name, scenario in plan.scenarios.items():
        section.code(to_yaml(scenario), f"Scenario as designed{f', {name}' if name else ''}")
    return page


def _cards(result: ReliabilityResult) -> list[Card]:
    whole, governing = result.any, result.governing
    cards = [Card("P(any limit)", tables.share(whole.estimate.value), note=tables.interval(whole.estimate))]
    if governing is not None:
        cards.append(
            Card(
                "Governs",
                tables.share(governing.estimate.value),
                note=f"{tables.titled(governing)}, {tables.interval(governing.estimate)}",
            )
        )
    cards.append(Card("Draws", str(result.plan.spec.runs), note=f"{result.unusable} collisions without usable numbers"))
    return cards


def _running(section: Section, one: Passed, level: float) -> None:
    r = one.running
    edge = {"line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
    traces: list[Trace] = [
        {**line("upper", r.draws, r.upper), **edge},
        {
            **line(f"{100 * level:g} % interval", r.draws, r.lower),
            **edge,
            "fill": "tonexty",
            "fillcolor": "rgba(0,114,178,0.15)",
        },
        line("probability", r.draws, r.value, colour=PALETTE[0]),
    ]
    layout = axes("draws", "", "probability", "", xaxis={"type": "log"}, yaxis={"rangemode": "tozero"})
    section.plot(traces, layout, title=f"Running probability: {tables.titled(one)}", height=300, half=True)


def _distribution(section: Section, one: Passed) -> None:
    traces = [line("draws", one.used, np.linspace(0.0, 1.0, one.used.size), colour=PALETTE[0])]
    marks = {"limit": (100.0, PALETTE[1], "dash")}
    if one.designed is not None and one.limit:
        marks["as designed"] = (100.0 * abs(one.designed) / one.limit, "#7a808a", "dot")
    for name, (x, colour, dash) in marks.items():
        traces.append(line(name, [x, x], [0.0, 1.0], colour=colour, line={"dash": dash}))
    layout = axes(
        f"part of the limit of {one.limit:.12g} {one.unit} that is used", "%", "share of the draws at or below", ""
    )
    section.plot(traces, layout, title=f"How much is used: {tables.titled(one)}", height=320)
