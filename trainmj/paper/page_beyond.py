"""What ``trainmj paper --beyond`` tells: tables for terminal, page and CSV, figures, and the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pandas as pd

from trainmj.collision.identity import identity
from trainmj.output.blocks import Card
from trainmj.output.page import Page
from trainmj.output.style import BLUE, GREEN, GREY, ORANGE, figure, styled
from trainmj.output.table import Column, Table, Verdict
from trainmj.paper.beyond import EMPTY, ENDING, MASS, PARTNER, SAME, SPEED, TWO, Along, Axis, Beyond
from trainmj.paper.laws_beyond import HALF_D_MM, HALF_M_T, RULES, Rule, strokes
from trainmj.paper.printed import (
    DOI,
    LIMIT_ANTI_CLIMBER_MM,
    LIMIT_OTHERS_MM,
    SPEED_KM_H,
    STROKES,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RANGES = {SPEED: (SPEED_KM_H, SPEED_KM_H), MASS: (30.0, 36.0), EMPTY: (20.0, 50.0)}
"""What the paper covers."""

_STEPS = ", ".join(f"{axis.resolution:g} {axis.unit}" for axis in (SPEED, MASS, EMPTY))
HOW = (
    f"Each law is judged on five collisions around a condition: D by {HALF_D_MM:g} mm and the mean mass by "
    f"{HALF_M_T:g} t less and more, as in the paper. A law holds at the values given and breaks at most "
    f"{_STEPS} further away from the paper's condition; between them it holds at every value tried."
)
"""How the laws were judged."""

CAPTIONS = {
    "beyond_laws": "Where the laws hold around the paper's condition (25 km/h, 33 t, 35 mm), which the dashed line "
    "marks; grey: the paper's range. Orange lines: where devices begin to do something else",
    "beyond_turns": "S12 falls with D as long as M1 and M2 still close when the anti-climber meets. Dashed: how far "
    "the front runs until they stop",
    "beyond_strokes": "Strokes over the speed at 33 t and 35 mm: b_type, whose devices go on behind their limits, and "
    "b_type_ends, where the car body takes over",
}
"""What each figure shows, by the name of its file."""


def law_tables(found: Beyond) -> Iterator[Table]:
    """Where each law holds along each axis."""
    for title, axes in (
        ("Where the laws hold: from ... to", (SPEED, MASS, EMPTY)),
        ("Unequal masses: where the laws hold", (PARTNER, SAME, TWO)),
        ("Devices that end at 265 and 418 mm (b_type_ends)", ENDING),
    ):
        columns = [Column("Law", text=True, head="Law")]
        columns += [Column(a.title, a.unit, text=True, head=a.head) for a in axes]
        rows = [
            (f"{rule.statement} ({rule.section})", *(cell(found.along[a.name], rule) for a in axes)) for rule in RULES
        ]
        yield Table(columns, rows, title)


def cell(along: Along, rule: Rule) -> str:
    """Where a law holds along an axis, in a few characters."""
    if not along.judged[rule][along.axis.start].holds:
        return "not in paper's range"
    low, high = along.breaks(rule)
    if not along.axis.resolution:
        if high is None:
            return "all"
        judged = along.judged[rule][high.first]
        return f"to {high.last:g}; {judged.held} of {judged.n} at {high.first:g}"
    if low is None or high is None:
        return "all" if low is high else f"from {low.last:g}" if low else f"to {high.last:g}" if high else ""
    return f"{low.last:g} to {high.last:g}"


def reasons(found: Beyond) -> Iterator[str]:
    """Why laws break, with the laws and where: a line for each axis and reason."""
    for along in found.along.values():
        of: dict[str, list[str]] = {}
        for rule in RULES:
            for side, place in zip(("below", "above"), along.breaks(rule), strict=True):
                if place and not (along.axis.scenario and side == "below"):  # where both are the same train
                    of.setdefault(place.because, []).append(f"{rule.statement}, {side} {place.last:g}")
        for because, laws in of.items():
            yield f"{_named(along.axis)} ({along.axis.unit}): {because}. {'; '.join(laws)}"


def _named(axis: Axis) -> str:
    return axis.title + (f", {axis.scenario}" if axis.scenario else "")


def begins_table(found: Beyond) -> Table:
    """What devices begin to do along the axes."""
    rows = [
        (_named(along.axis), state, f"{last:g} -> {first:g} {along.axis.unit}")
        for along in found.along.values()
        for state, last, first in along.begins()
    ]
    columns = [Column(name, text=True) for name in ("Along", "what begins", "between")]
    return Table(columns, rows, "What devices do that they do not in the paper's range")


def turns_table(found: Beyond) -> Table:
    """Why S12 turns over D."""
    columns = [
        Column("Speed", "km/h", 0),
        Column("M1 and M2 stop closing after", "ms", 1, head="M1, M2 stop\nclosing after"),
        Column("front has run", "mm", 1, head="front\nhas run"),
        Column("S12 least at D", "mm", 1, head="S12 least\nat D"),
    ]
    return Table(
        columns,
        [(t.speed_km_h, t.stop_ms, t.run_mm, t.least_mm) for t in found.turns],
        "Why S12 falls with D, then grows",
    )


def loaded_table(found: Beyond) -> Table:
    """The laws in the formations of Table 2: whether they hold, and the numbers where they do not."""
    columns = [Column(name, text=True) for name in ("Law", *found.loaded)]
    rows = []
    for rule in RULES:
        judged = [rule.judge(around) for around in found.loaded.values()]
        rows.append((rule.statement, *("holds" if holds else f"no: {said}" for holds, said in judged)))
    return Table(columns, rows, "The formations of Table 2")


def breaks(found: Beyond) -> pd.DataFrame:
    """Every place where a law breaks: between which values, the numbers there, and why."""
    rows = []
    for along in found.along.values():
        axis = along.axis
        for rule in RULES:
            start = along.judged[rule][axis.start]
            common: dict[str, Any] = {
                "axis": axis.name,
                "unit": axis.unit,
                "section": rule.section,
                "law": rule.statement,
            }
            common |= {"rule": rule.rule, "holds_in_paper": start.holds, "in_paper": start.said}
            sides = dict(zip(("below", "above"), along.breaks(rule), strict=True))
            for side, place in sides.items():
                if place:
                    rows.append(common | {"side": side} | place._asdict())
            if not any(sides.values()):
                rows.append(common | {"side": "none"})
    return pd.DataFrame(rows)


def values(found: Beyond) -> pd.DataFrame:
    """The verdict of each law on each value of each axis."""
    return pd.DataFrame(
        {"axis": along.axis.name, "value": value, "law": rule.statement, "held": j.held, "of": j.n, "numbers": j.said}
        for along in found.along.values()
        for rule in RULES
        for value, j in along.judged[rule].items()
    )


def responses(found: Beyond) -> pd.DataFrame:
    """The collisions on the axes themselves."""
    rows = []
    for along in found.along.values():
        for value, some in along.around.items():
            for n, around in enumerate(some):
                s = around.mid
                three = dict(zip(STROKES, strokes(s)[:3], strict=True))
                more: dict[str, Any] = {"status": s.status.kind.value, "reason": s.status.reason}
                rows.append(
                    {"axis": along.axis.name, "value": value, "formation": n}
                    | {"coupler_mm": s.interfaces[0].stages[0].stroke_mm, **three, "TS_mm": s.TS_mm, "TAMA_g": s.TAMA_g}
                    | more
                )
    return pd.DataFrame(rows)


def tables(found: Beyond) -> dict[str, pd.DataFrame]:
    """Everything that is written as CSV, by the name of its file."""
    given = {
        "beyond_begins": begins_table(found),
        "beyond_turns": turns_table(found),
        "beyond_table2": loaded_table(found),
    }
    shown = {name: pd.DataFrame(t.rows, columns=[c.name for c in t.columns]) for name, t in given.items()}
    return {
        "beyond_breaks": breaks(found),
        "beyond_values": values(found),
        "beyond_responses": responses(found),
        **shown,
    }


def figures(found: Beyond) -> dict[str, Figure]:
    """Every figure, by the name of its file."""
    with styled("page"):
        return dict(zip(CAPTIONS, (_laws(found), _turns(found), _strokes(found)), strict=True))


def _laws(found: Beyond) -> Figure:
    picture = figure(height=150)
    panels = picture.subplots(1, 3, sharey=True)
    at = range(len(RULES))
    for axes, (axis, (low, high)) in zip(panels, RANGES.items(), strict=True):
        along = found.along[axis.name]
        points = list(along.around)
        axes.axvspan(low, high, color="0.92", zorder=0)
        for n, rule in enumerate(RULES):
            axes.broken_barh(_spans(along, rule), (n - 0.35, 0.7), color=BLUE, linewidth=0)
        for state, last, first in along.begins():
            if " passes " not in state:
                axes.axvline((last + first) / 2, color=ORANGE, linewidth=0.9)
        axes.axvline(axis.start, color="0.1", linestyle="--", linewidth=0.8)
        axes.set(xlabel=f"{axis.title} ({axis.unit})", xlim=(points[0], points[-1]))
        axes.grid(False, axis="y")
    panels[0].set_yticks(at, [rule.statement for rule in RULES], fontsize=5.5)
    panels[0].set_ylim(len(RULES) - 0.5, -0.5)
    return picture


def _spans(along: Along, rule: Rule) -> list[tuple[float, float]]:
    """Start and length of the stretches on which a law holds, which end half way to the next value."""
    ends: list[tuple[float, float]] = []
    for a, b in pairwise(along.around):
        middle, held = (a + b) / 2, [along.judged[rule][value].holds for value in (a, b)]
        low, high = a if held[0] else middle, b if held[1] else middle
        if ends and ends[-1][1] == low:
            low, _ = ends.pop()
        if high > low:
            ends.append((low, high))
    return [(low, high - low) for low, high in ends]


def _turns(found: Beyond) -> Figure:
    picture = figure(height=66)
    axes = picture.subplots()
    for t, colour in zip(found.turns, (GREEN, BLUE, ORANGE), strict=True):
        D = list(t.over_D)
        axes.plot(
            D,
            [s.interfaces[1].stroke_mm for s in t.over_D.values()],
            color=colour,
            marker="o",
            markersize=2.5,
            label=f"{t.speed_km_h:g} km/h",
        )
        axes.axvline(t.run_mm, color=colour, linestyle="--", linewidth=0.9)
    axes.axvspan(*RANGES[EMPTY], color="0.92", zorder=0)
    axes.set(xlabel="Empty stroke D (mm)", ylabel="S12 (mm)", xlim=(0, 152))
    axes.legend(loc="upper center", ncols=3)
    axes.set_ylim(top=510)
    return picture


def _strokes(found: Beyond) -> Figure:
    picture = figure(height=70)
    panels = picture.subplots(1, 3, sharex=True)
    for axes, (k, name) in zip(panels, enumerate(("S_anti", "S12", "S23")), strict=True):
        for axis, colour, label in ((SPEED, BLUE, "b_type"), (ENDING[0], ORANGE, "b_type_ends")):
            around = found.along[axis.name].around
            axes.plot(list(around), [strokes(some[0].mid)[k] for some in around.values()], color=colour, label=label)
        axes.axhline(LIMIT_ANTI_CLIMBER_MM if k == 0 else LIMIT_OTHERS_MM, color=GREY, linestyle=":", linewidth=1)
        axes.axvline(SPEED_KM_H, color="0.1", linestyle="--", linewidth=0.8)
        axes.set(title=name, xlabel="Speed (km/h)", xlim=(10, 36))
    panels[0].set_ylabel("Stroke (mm)")
    panels[0].legend(loc="upper left")
    return picture


def page_of(found: Beyond, drawn: Mapping[str, Figure], command: str) -> Page:
    """The page, with figures by the name of their file and the command that makes it again."""
    page = Page(
        "Beyond the range of a published train collision study",
        f"The laws of Liu et al. 2022, doi {DOI}, for other speeds, masses and empty strokes, and for unequal masses",
        command,
        identity(),
    )
    whole = sum(not any(any(along.breaks(rule)) for along in found.along.values()) for rule in RULES)
    said = f"{whole} of {len(RULES)} laws hold wherever they were judged; the others break somewhere."
    page.verdict = Verdict("none", said)
    section = page.section("Result")
    section.cards(
        Card("Laws", str(len(RULES)), note="stated as rules that can be judged anywhere"),
        Card("Conditions", str(found.n), note="on which each was judged, five collisions each"),
    )
    section.text(HOW)
    section.picture(drawn["beyond_laws"], alt=CAPTIONS["beyond_laws"], title=CAPTIONS["beyond_laws"])
    for table in law_tables(found):
        section.table(table)
    section = page.section("Why they break")
    section.table(begins_table(found))
    section.table(turns_table(found))
    for name in ("beyond_turns", "beyond_strokes"):
        section.picture(drawn[name], alt=CAPTIONS[name], title=CAPTIONS[name])
    section = page.section("Each break with its numbers")
    for along in found.along.values():
        section.table(_breaks_table(along), folded=True)
    page.section("The formations of Table 2").table(loaded_table(found))
    return page


def _breaks_table(along: Along) -> Table:
    axis = along.axis
    columns = [
        Column(n, text=True) for n in ("Section", "Law", "rule", "holds to", "not at", "numbers there", "because")
    ]
    rows = [
        (
            rule.section,
            rule.statement,
            rule.rule,
            f"{b.last:g} {axis.unit}",
            f"{b.first:g} {axis.unit}",
            b.said,
            b.because,
        )
        for rule in RULES
        for b in along.breaks(rule)
        if b
    ]
    return Table(columns, rows, f"{_named(axis)}: {len(rows)} breaks")
