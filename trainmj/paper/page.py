"""The page of ``trainmj paper``: what agrees with the published numbers, what does not, and what is wrong in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from trainmj.collision.simulation import versions
from trainmj.output.blocks import Card, Column, judged
from trainmj.output.page import Page
from trainmj.paper.comparison import OURS, RECOMPUTED, Comparison
from trainmj.paper.figures import CAPTIONS
from trainmj.paper.printed import DOI, split_unit
from trainmj.paper.reproduce import Reproduction
from trainmj.paper.verdicts import FROM_PRINT, GROUPS, ITSELF

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trainmj.output.blocks import Section

NOT_REPRODUCED = (
    "Figures 1 to 3 are drawings. Figure 2, the device curves, is given in words only; the curves used here were "
    "identified from Tables 3 to 8, so agreement there shows that one set of devices explains 17 collisions. Table 9's "
    "strokes and TS, Table 13 and the balance times were never used: agreement there is a test.",
    "Of Figures 4 to 9 only the captions and what the text says of them are available. They are drawn here from our "
    "results; no published curve can be laid over them.",
    "The finite element model of Sections 3.1 and 3.2 is not described to the point where it could be built. What is "
    "checked of Figure 4 is what the text says of both models.",
    "How the paper's front was searched and its optimum chosen is not stated; see the defects.",
)
"""What cannot be reproduced, and why."""

_SOURCES = {"published": "published", RECOMPUTED: "from published Table 9", OURS: "ours"}
_NAMES = {
    "anti_climber": "S_anti",
    "anti_climber_simulated": "S_anti simulated",
    "stroke_m1_m2": "S12",
    "stroke_m2_m3": "S23",
    "energy_s1_m1": "S1-M1",
    "energy_m1_m2": "M1-M2",
    "energy_m2_m3": "M2-M3",
    **{f"peak_acc_m{n}": f"peak M{n}" for n in range(1, 7)},
}
_HEADS = {FROM_PRINT: ("printed", "recomputed"), ITSELF: ("simulation", "surrogate")}
_DIGITS = {"mm": 2, "kJ": 2, "g": 4, "s": 3, "t": 2, "km_h": 1}


def page_of(reproduction: Reproduction, figures: Mapping[str, Figure], command: str) -> Page:
    """The page.

    Args:
        reproduction: what was computed.
        figures: drawn, by the name of their file.
        command: makes it again.
    """
    page = Page(
        "A published train collision study, end to end",
        f"Liu et al. 2022, Chinese Journal of Mechanical Engineering, doi {DOI}: every table and figure of the B-type "
        "subway train, published beside computed",
        command,
        versions(),
    )
    _result(page.section("Result"), reproduction)
    _verdicts(page.section("Verdicts"), reproduction)
    _laws(page.section("Laws stated in words"), reproduction)
    _defects(page.section("Defects of the paper"), reproduction)
    _optimum(page.section("Optimum"), reproduction, figures)
    _figures(page.section("Figures"), figures)
    _tables(page.section("Tables"), reproduction)
    return page


def _result(section: Section, r: Reproduction) -> None:
    barred = [v for v in r.verdicts if v.agrees is not None]
    agree, hold = sum(bool(v.agrees) for v in barred), sum(law.holds for law in r.laws)
    ts, tama = (next(v for v in r.verdicts if v.item == f"Table 13: {name}") for name in ("TS", "TAMA"))
    section.cards(
        Card(
            "Numbers",
            f"{agree} of {len(barred)}",
            note="items within their bar",
            verdict=judged(agree == len(barred), "all agree", "some do not"),
        ),
        Card("Laws in words", f"{hold} of {len(r.laws)}", note="hold on our results"),
        Card("Defects", str(len(r.defects)), note="of the paper, each shown by arithmetic on its own numbers"),
        Card(
            "TS at the optimum",
            ts.ours,
            note=f"published {ts.published}; held out",
            verdict=judged(ts.agrees, "agrees", "differs"),
        ),
        Card(
            "TAMA at the optimum",
            tama.ours,
            note=f"published {tama.published}; held out",
            verdict=judged(tama.agrees, "agrees", "differs"),
        ),
    )
    section.text(
        "The 17 collisions of Tables 3 to 8, the two scenarios of Table 2, the ten of Table 9 and the one of Table 13 "
        "were computed, and the study of Tables 9 to 13 was done twice: on the published Table 9, and on our responses "
        "at the same ten points. Accelerations are those of the device forces alone, as the paper counts them; at the "
        "front, strokes and energies are one train's.",
        "What cannot be reproduced:",
    )
    section.notes(NOT_REPRODUCED)


def _verdicts(section: Section, r: Reproduction) -> None:
    for group in GROUPS:
        columns = [Column(name, text=True) for name in ("Item", *_HEADS.get(group, ("published", "ours")))]
        columns += [Column("deviation"), Column("bar"), Column("verdict", text=True)]
        rows = [
            (
                v.item,
                v.published,
                v.ours,
                v.said(v.deviation),
                "–" if v.bar is None else v.said(v.bar),
                judged(v.agrees, "agrees", "does not", "no bar"),
            )
            for v in r.verdicts
            if v.group == group
        ]
        section.table(columns, rows, title=group[0].upper() + group[1:])


def _laws(section: Section, r: Reproduction) -> None:
    section.text("What the text says, with our number for it and the rule by which it was judged.")
    columns = [Column(n, text=True) for n in ("Section", "Law", "verdict", "published", "ours", "rule")]
    rows = [
        (
            law.section,
            law.statement,
            judged(law.holds, "holds", "does not"),
            law.published or "–",
            law.ours,
            law.judged or "–",
        )
        for law in r.laws
    ]
    section.table(columns, rows)


def _defects(section: Section, r: Reproduction) -> None:
    section.text(
        "Each follows from the printed numbers alone. Nothing was tuned to them, and comparisons that meet one say so."
    )
    for n, defect in enumerate(r.defects, start=1):
        section.text(Markup("<b>{}. {}.</b> {}.").format(n, defect.title, defect.where))
        section.notes(defect.arithmetic)


def _optimum(section: Section, r: Reproduction, figures: Mapping[str, Figure]) -> None:
    section.text(
        "Surrogates with the terms of Eqs (7) and (8), quadratic ones for the strokes that Eq. (12) limits, a particle "
        "swarm on whole millimetres and tenths of a tonne, entropy weights as in Table 12, a weighted sum of criteria "
        "scaled to [0, 1] over the front. On the published Table 9 this does not end at the paper's optimum; see "
        "the defects. The last column shows how far the limit of the anti-climber, 265 mm, is kept when simulated."
    )
    columns = [Column("Decision from", text=True)]
    columns += [Column(*_named(str(head)), digits=_digits(str(head))) for head in r.optima.columns[1:]]
    rows = [(_SOURCES.get(str(row[0]), row[0]), *map(float, row[1:])) for row in r.optima.itertuples(index=False)]
    section.table(columns, rows, note="In the first row the surrogate is the paper's, as printed in Table 13.")
    _picture(section, "figure9_front", figures)


def _figures(section: Section, figures: Mapping[str, Figure]) -> None:
    for name in figures:
        if name != "figure9_front":
            _picture(section, name, figures)


def _picture(section: Section, name: str, figures: Mapping[str, Figure]) -> None:
    section.picture(figures[name], alt=CAPTIONS[name], title=CAPTIONS[name])


def _tables(section: Section, r: Reproduction) -> None:
    section.text("The same tables are beside this page as CSV files, with every digit and all deviations.")
    for table in r.tables.values():
        columns = [Column(*_named(str(k)), text=True) for k in table.keys.columns] + [Column("", text=True)]
        columns += [Column(*_named(head), digits=_digits(head)) for head in table.heads]
        section.table(columns, _rows(table), title=table.title, note=table.note)


def _rows(table: Comparison) -> Iterator[tuple[Any, ...]]:
    """Under each other: what is published, what was found, and our deviation where there is one source only."""
    blank = ("",) * len(table.keys.columns)
    for k in range(len(table.published)):
        yield (
            *(f"{v:g}" if isinstance(v, float) else str(v) for v in table.keys.iloc[k]),
            "published",
            *_cells(table, table.published, k),
        )
        for source, values in table.found.items():
            yield (*blank, _SOURCES[source], *_cells(table, values, k))
        if len(table.found) == 1:
            yield (*blank, "deviation", *(float(table.deviation(head)[k]) for head in table.heads))


def _cells(table: Comparison, values: Any, k: int) -> tuple[Any, ...]:
    row = [float(values[head].iloc[k]) for head in table.heads]
    return tuple(f"{v:.6g}".replace("-", "−") for v in row) if table.name.startswith("eq") else tuple(row)


def _named(head: str) -> tuple[str, str]:
    """Name and unit of a column from its head."""
    quantity, unit = split_unit(head)
    return _NAMES.get(quantity, quantity.replace("_", " ")), unit.replace("km_h", "km/h")


def _digits(head: str) -> int | None:
    quantity, unit = split_unit(head)
    if quantity in ("entropy", "difference", "weight"):
        return 5
    if quantity in ("ARE", "RMSE", "R2") or not unit:
        return 3
    return 1 if quantity == "M" else 0 if quantity == "D" else _DIGITS.get(unit)
