"""The report of a comparison: rules, overlays, differences, and what was compared."""

from __future__ import annotations

import numpy as np

from trainmj.comparison import tables
from trainmj.comparison.figures import chosen
from trainmj.comparison.found import Comparison
from trainmj.comparison.sides import Series
from trainmj.output.blocks import Card
from trainmj.output.page import Page
from trainmj.output.plot import GREY, Trace, axes, line
from trainmj.output.style import BLUE
from trainmj.units import MS, words

_MOST_PLOTS = 24
_MOST_SAMPLES = 1000
_MOST_ROWS = 24


def page_of(found: Comparison, command: str) -> Page:
    """The page of a comparison; the command makes it again."""
    assert found.a.result is not None
    page = Page(
        f"{found.a.name} against {found.b.name}",
        subtitle="A is held against B; percentages are of B",
        command=command,
        versions=found.a.result.versions,
        verdict=tables.verdict(found),
        cover=found.a.result.scenario.report,
    )
    outcome = page.section("Outcome")
    outcome.cards(
        Card("Rules", tables.count(found), "kept", "of those that could be judged"),
        Card("Channels", str(len(found.differences)), "in both", "compared while both are there"),
    )
    outcome.table(tables.rules(found))
    outcome.notes(tables.said(found))
    section = page.section("Over time")
    drawn = chosen(found, _MOST_PLOTS)
    if len(drawn) < len(found.differences):
        section.text(f"Those {len(drawn)} of {len(found.differences)} channels that differ most.")
    for one in drawn:
        a, b = found.a.channels[one.channel], found.b.channels[one.channel]
        moved = b._replace(time=b.time + one.offset_ms * MS)
        traces = [_line("B", moved, GREY, 4.0, opacity=0.5), _line("A", a, BLUE, 1.6)]
        layout = axes(
            "Time",
            "s",
            words(one.channel).split()[0].capitalize(),
            one.unit,
            hovermode="x unified",
            xaxis={"hoverformat": ".4g"},
        )
        note = f"Compared from {one.from_s:.4g} to {one.to_s:.4g} s."
        section.plot(traces, layout, title=one.channel, note=note, height=280, half=True)
    section = page.section("Differences")
    for title, some in tables.titled(found):
        section.table(tables.differences(some, title), folded=len(some) > _MOST_ROWS)
    section = page.section("What was compared")
    section.facts({"A": found.a.name, "B": found.b.name})
    section.notes(found.remarks)
    section = page.section("How it is computed")
    section.text("Channels are straight lines between their values. Nothing is extrapolated.")
    section.notes(tables.meanings())
    return page


def _line(name: str, series: Series, colour: str, width: float, **more: object) -> Trace:
    step = -(-len(series.time) // _MOST_SAMPLES)
    kept = np.unique([*range(0, len(series.time), step), len(series.time) - 1])
    return line(name, series.time[kept], series.values[kept], series.unit, colour, width, **more)
