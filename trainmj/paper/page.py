"""The page of ``trainmj paper``: what was wanted of each number, what was reached, and what is wrong in the paper."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

from markupsafe import Markup

from trainmj.collision.identity import identity
from trainmj.output.blocks import Card
from trainmj.output.page import Page
from trainmj.output.table import Column, Table, judged
from trainmj.paper.bars import FROM_PRINT, GROUPS, ITSELF
from trainmj.paper.figures import CAPTIONS
from trainmj.paper.printed import DOI, EMPTY_STROKE_MM, ENERGIES, MASS_T, PEAKS, STROKES, split_unit
from trainmj.paper.reproduce import Reproduction
from trainmj.paper.scatter import HELD_OUT, OVER_D, OVER_M, PRINTED
from trainmj.paper.tables import OURS, RECOMPUTED, S08, Comparison
from trainmj.units import KN_PER_MM, TONNE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trainmj.output.blocks import Section

NOT_REPRODUCED = (
    "Figures 1 to 3 are drawings. Figure 2, the device curves, is given in words only; the curves used here were "
    "identified from Tables 3 to 8, so agreement there shows that one set of devices explains 17 collisions. Table 9's "
    "strokes and TS, Table 13 and the balance times were never used: agreement there is a test.",
    "Of Figures 4 to 9 only the captions and what the text says of them are available. They are drawn here from our "
    "results; no published curve can be laid over them.",
    "The finite element model of Sections 3.1 and 3.2 is not described to the point where it could be built. Car "
    "bodies of 1000 kN/mm in four members stand for it, as their stiffness is not stated; what the text says of both "
    "models is checked on them. It also comes out with 1500 kN/mm.",
    "How the paper's front was searched and its optimum chosen is not stated; see the defects.",
)
"""What cannot be reproduced, and why."""

FLOOR = (
    "Floor: what any law as smooth as ours must miss, because the printed values scatter: the least that a quadratic "
    "in D and M leaves of them, less what one leaves of ours. No bar: none was stated before the result was known."
)
"""What stands below the verdicts."""

REACHED = (
    "Reached, and judged, is what the shipped b_type comes to. S08 is b_type_s08, the same train with devices that "
    "unload as LS-DYNA's law of that name is documented."
)
"""What the columns of the verdicts are."""

_NEAR = 0.2
"""Part of the best stiffness K within which another one counts as the same valley."""

_SAID = {"s08": "S08"}
_SOURCES = {PRINTED: "published", RECOMPUTED: "from published Table 9", OURS: "ours", S08: "S08"}
_NAMES = {split_unit(head)[0]: name for head, name in (STROKES | ENERGIES).items()} | {
    "anti_climber_simulated": "S_anti simulated",
    **{split_unit(head)[0]: f"peak {name}" for head, name in PEAKS.items()},
}
_HEADS = {FROM_PRINT: ("printed", "recomputed"), ITSELF: ("simulation", "surrogate")}
_judged = partial(judged, yes="met", no="missed", unknown="no bar")
_DIGITS = {"mm": 2, "kJ": 2, "g": 4, "s": 3, "t": 2, "km/h": 1, "": 3}
_DIGITS_OF = {"D": 0, "M": 1, "entropy": 5, "difference": 5, "weight": 5}


def verdict_tables(reproduction: Reproduction) -> Iterator[Table]:
    """The verdicts, a table for each group."""
    for group in GROUPS:
        words = [Column(name, text=True) for name in ("Item", *_HEADS.get(group, ("published", "ours")))]
        verdicts = [v for v in reproduction.verdicts if v.group == group]
        amounts = ["wanted", "reached"]
        amounts += [key for key in ("s08", "floor") if any(getattr(v, key) is not None for v in verdicts)]
        rows = []
        for v in verdicts:
            said = {"wanted": v.bar, "reached": v.deviation, "s08": v.s08, "floor": v.floor}
            rows.append((v.item, v.published, v.ours, *(v.said(said[name]) for name in amounts), _judged(v.met)))
        columns = [*words, *(Column(_SAID.get(name, name)) for name in amounts), Column("verdict", text=True)]
        yield Table(columns, rows, group[0].upper() + group[1:], f"{REACHED} {FLOOR}" if "floor" in amounts else "")


def holding(reproduction: Reproduction) -> str:
    """How many laws hold, of those that can."""
    laws = [law for law in reproduction.laws if not law.impossible]
    return f"{sum(law.holds for law in laws)} of {len(laws)}"


def outcome(reproduction: Reproduction) -> str:
    """How many bars are met, and which are missed."""
    judged, missed = reproduction.judged, reproduction.missed
    said = f"{len(judged) - len(missed)} of {len(judged)} bars met"
    return said + (f"; {len(missed)} missed:" if missed else ".")


def optima_table(reproduction: Reproduction) -> Table:
    """The same decision on the paper's numbers and on ours."""
    optima = reproduction.optima
    columns = [Column("Decision from", text=True), *(_column(str(head)) for head in optima.columns[1:])]
    rows = [(_SOURCES.get(source, source), *map(float, values)) for source, *values in optima.itertuples(index=False)]
    return Table(columns, rows, note="In the first row the surrogate is the paper's, as printed in Table 13.")


def page_of(reproduction: Reproduction, figures: Mapping[str, Figure], command: str) -> Page:
    """The page, with figures by the name of their file and the command that makes it again."""
    page = Page(
        "A published train collision study, end to end",
        f"Liu et al. 2022, Chinese Journal of Mechanical Engineering, doi {DOI}: every table and figure of the B-type "
        "subway train, published beside computed",
        command,
        identity(),
    )
    missed = len(reproduction.missed)
    said = f"{outcome(reproduction).rstrip(':.')}; {holding(reproduction)} laws in words hold."
    page.verdict = judged(not missed, said, said)
    _result(page.section("Result"), reproduction)
    section = page.section("Verdicts")
    for table in verdict_tables(reproduction):
        section.table(table)
    _scatter(page.section("Why the strokes scatter over D"), reproduction, figures)
    _laws(page.section("Laws stated in words"), reproduction)
    _defects(page.section("Defects of the paper"), reproduction)
    _optimum(page.section("Optimum"), reproduction, figures)
    section = page.section("Figures")
    for name in figures:
        if name not in ("figure9_front", "scatter_over_D", "misfit_over_K"):
            _picture(section, name, figures)
    section = page.section("Tables")
    section.text("The same tables are beside this page as CSV files, with every digit and all deviations.")
    for comparison in reproduction.tables.values():
        section.table(_side_by_side(comparison))
    return page


def _result(section: Section, r: Reproduction) -> None:
    judged_, missed = r.judged, r.missed
    verdict = judged(not missed, "all met", f"{len(missed)} missed")
    section.cards(
        Card("Bars", f"{len(judged_) - len(missed)} of {len(judged_)}", note="stated in advance, met", verdict=verdict),
        Card("Laws in words", holding(r), note="hold on our results"),
        Card("Defects", str(len(r.defects)), note="of the paper, each shown by arithmetic on its own numbers"),
        *(
            Card(f"{name} at the optimum", v.ours, note=f"published {v.published}; held out", verdict=_judged(v.met))
            for name in ("TS", "TAMA")
            for v in r.verdicts
            if v.item.startswith(f"Table 13: {name}")
        ),
    )
    if missed:
        section.text(outcome(r))
        section.notes(v.missed for v in missed)
    section.text(
        "The 17 collisions of Tables 3 to 8, the two scenarios of Table 2, the ten of Table 9 and the one of Table 13 "
        "were computed, and the study of Tables 9 to 13 was done twice: on the published Table 9, and on our responses "
        "at the same ten points. Accelerations are those of the device forces alone, as the paper counts them; at the "
        "front, strokes and energies are of one train's side.",
        "What cannot be reproduced:",
    )
    section.notes(NOT_REPRODUCED)


def scatter_table(reproduction: Reproduction) -> Table:
    """What lines over D, and parabolas over M, leave of the strokes: of the printed ones, and of ours beside them."""
    of = {PRINTED: "the printed values", OURS: "published less ours", S08: "published less S08"}
    rows = []
    for series, source, *left in reproduction.scatter.left.itertuples(index=False):
        rows.append((series if source == PRINTED else "", of[source], *left))
    columns = [Column("Series", text=True), Column("left of", text=True), *(_column(head) for head in STROKES)]
    note = (
        f"Root mean squares. {OVER_D}: about a straight line in D; {HELD_OUT}, held out: about the same line. "
        f"{OVER_M}: about a parabola in M."
    )
    return Table(columns, rows, "Scatter of the strokes, and what the laws leave of it", note)


def _laws(section: Section, r: Reproduction) -> None:
    section.text("What the text says, with our number for it and the rule by which it was judged.")
    columns = [Column(n, text=True) for n in ("Section", "Law", "verdict", "published", "ours", "rule")]
    rows = []
    for law in r.laws:
        verdict = "impossible" if law.impossible else judged(law.holds, "holds", "does not")
        rule = law.impossible or law.judged or "-"
        rows.append((law.section, law.statement, verdict, law.published or "-", law.ours, rule))
    section.table(Table(columns, rows))


def _defects(section: Section, r: Reproduction) -> None:
    section.text(
        "Each follows from the printed numbers alone. Nothing was tuned to them; comparisons say where one matters."
    )
    for n, defect in enumerate(r.defects, start=1):
        section.text(Markup("<b>{}. {}.</b> {}.").format(n, defect.title, defect.where))
        section.notes(defect.arithmetic)


def _scatter(section: Section, r: Reproduction, figures: Mapping[str, Figure]) -> None:
    (K, least), over_K, steps = r.scatter.best, r.scatter.misfit, r.scatter.steps
    lowest, highest = over_K["K_kN_per_mm"].min(), over_K["K_kN_per_mm"].max()
    elsewhere = over_K["misfit"][(over_K["K_kN_per_mm"] - K).abs() > _NEAR * K].min()
    at_once = r.collisions.documented[EMPTY_STROKE_MM, MASS_T].vehicles[3].peak_device_acceleration_g
    four = r.tables["4"]
    printed = four.published.loc[four.keys["D_mm"] == EMPTY_STROKE_MM, "peak_acc_m4_g"].item()
    section.text(
        "The paper's law is LS-DYNA's S08, without constants. As it is documented, a device unloads and loads again "
        "along a stiffness K, F = K (u - u_p) between 0 and its crush force, remembers its slack and has no dashpot. "
        "The devices of b_type lock instead; b_type_s08 follows the document, with one very stiff K for all devices "
        "and curves of its own.",
        "When the coupler has sheared off, M1 is driven by the force of M1-M2 alone. Some 10 ms later the two stop "
        f"closing and ring on K, {_ring_hz(K):.0f} times a second, until the anti-climber meets. The phase of the ring "
        "in which it does so sets S_anti, S12 and S23: a period is some 8.5 mm of D, and the nine values of D lie "
        "3.75 mm apart, so that the ring looks like scatter.",
    )
    section.table(scatter_table(r))
    _picture(section, "scatter_over_D", figures)
    _picture(section, "misfit_over_K", figures)
    section.text(
        "K is unique. The misfit is the mean over the three strokes of the square of what is left over that of the "
        f"paper's scatter: {least:.3f} at {K:.0f} kN/mm, and nowhere below {elsewhere:.2f} from {lowest:.0f} to "
        f"{highest:.0f} kN/mm where K is more than {100 * _NEAR:.0f} % off.",
        f"What it costs: a step that follows the ring, 0.02 ms for 0.1 ms; a collision takes {steps[S08]} steps for "
        f"{steps[OURS]}. The ring is in the forces, too: at instants they exceed the paper's peaks (M4 at "
        f"D = {EMPTY_STROKE_MM:g} mm: {at_once:.2f} g for {printed:.2f} g), and only their means, here over windows of "
        "3.8 ms, agree with these. That the paper's output was averaged is an inference.",
        f"What stays unexplained: the scatter over the mass, of which either law leaves most ({OVER_M}). With equal "
        "masses the mass enters through V sqrt(M) alone, so that no regular law gives it.",
    )


def _ring_hz(K: float) -> float:
    """Frequency at which two vehicles ring on a stiffness [kN/mm]."""
    return math.sqrt(2 * K * KN_PER_MM / (MASS_T * TONNE)) / (2 * math.pi)


def _optimum(section: Section, r: Reproduction, figures: Mapping[str, Figure]) -> None:
    section.text(
        "Surrogates with the terms of Eqs (7) and (8), quadratic ones for the strokes that Eq. (12) limits, a particle "
        "swarm on whole millimetres and tenths of a tonne, entropy weights as in Table 12, a weighted sum of criteria "
        "scaled to [0, 1] over the front. On the published Table 9 this does not end at the paper's optimum; see "
        "the defects. The last column shows how far the limit of the anti-climber, 265 mm, is kept when simulated."
    )
    section.table(optima_table(r))
    _picture(section, "figure9_front", figures)


def _picture(section: Section, name: str, figures: Mapping[str, Figure]) -> None:
    section.picture(figures[name], alt=CAPTIONS[name], title=CAPTIONS[name])


def _side_by_side(compared: Comparison) -> Table:
    """Under each other: what is published, what was found, and our deviation where there is one source only."""
    values = {"published": compared.published, **compared.found}
    for source in (OURS, S08) if RECOMPUTED not in compared.found else ():
        if source in compared.found:
            values[f"{_SOURCES[source]}, deviation"] = compared.found[source][compared.heads] - compared.published
    rows = []
    for k, keys in enumerate(compared.keys.itertuples(index=False)):
        said = [f"{key:g}" if isinstance(key, float) else str(key) for key in keys]
        for source, table in values.items():
            rows.append((*said, _SOURCES.get(source, source), *map(float, table[compared.heads].iloc[k])))
            said = [""] * len(said)
    digits = ".6g" if compared.name.startswith("eq") else ""
    columns = [Column(*_named(str(key)), text=True) for key in compared.keys]
    columns += [Column("", text=True), *(_column(head, digits) for head in compared.heads)]
    return Table(columns, rows, compared.title, compared.note)


def _column(head: str, digits: str = "") -> Column:
    """A column of numbers, by default with the digits that its quantity is read in."""
    quantity, unit = split_unit(head)
    return Column(*_named(head), digits or _DIGITS_OF.get(quantity, _DIGITS.get(unit, ".4g")))


def _named(head: str) -> tuple[str, str]:
    """Name and unit of a column from its head."""
    quantity, unit = split_unit(head)
    return _NAMES.get(quantity, quantity.replace("_", " ")), unit
