"""The tables of an assessment, each told once for terminal and page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from trainmj.assessment.file import FromLineSpeed
from trainmj.assessment.found import Assessment
from trainmj.assessment.outcome import Outcome, Row
from trainmj.assessment.plan import Standard, source_of_limit
from trainmj.files.provenance import Provenance
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.units import against

_INDENT = "\u00a0\u00a0"


def verdict(assessment: Assessment) -> Verdict:
    """The whole in a sentence, with the criterion that comes nearest to its limit, or passes it by most."""
    least = max(assessment.judged, key=lambda row: row.rank, default=None)
    said = f"{'Passed as far as computed' if assessment.passed else 'Not passed'}: {assessment.kept_of_judged}"
    if assessment.failed and all(row.criterion.kept for row in assessment.judged):
        said += ", and more is wrong"
    if least is not None:
        c, case = least.criterion, assessment.state_of(least.outcome.case)
        nearest = "nearest" if c.kept else "worst"
        said += f"; {nearest}: {c.said}, {case}" + f" (margin {margin(least)} %)" * (
            c.valid and not math.isnan(c.found)
        )
    not_answered = len(assessment.not_computed)
    are = "requirement is" if not_answered == 1 else "requirements are"
    said += f". {not_answered} {are} not computed." if not_answered else "."
    if assessment.failed:
        return failed(said)
    return (warned if any(outcome.cut for outcome in assessment.outcomes) else passed)(said)


def criteria(assessment: Assessment) -> Table:
    """Every criterion of every collision scenario where it is kept least, and which case that is."""
    heads = [
        *worded("Criterion"),
        Column("value"),
        Column("limit"),
        Column("margin", "%"),
        *worded("verdict", "governed by", "limit from"),
    ]
    rows: list[tuple[Any, ...]] = []
    last = ""
    for of_criterion in assessment.governing():
        worst = of_criterion[0]
        key = worst.outcome.case.key
        if key != last:
            rows.append((assessment.standard.spec.scenarios[key].title, "", "", "", "", "", ""))
            last = key
        rows.append(_row(assessment, worst, of_criterion))
    note = (
        "Each criterion in the case that comes nearest to its limit. Limit from: how far the number of the standard "
        "was seen, or the train, whose file states it. Without a limit: reported, not judged."
    )
    return Table(heads, rows, note=note)


def _row(assessment: Assessment, worst: Row, rows: Sequence[Row]) -> tuple[Any, ...]:
    c = worst.criterion
    said, governed = f"{_INDENT}{c.title}", _governed(assessment, worst, rows)
    digits = c.text if worst.judged else f"{c.found:.{max(c.digits, 0)}f}"
    value = "no number" if math.isnan(c.found) else f"{digits} {c.unit}".rstrip()
    if not worst.judged:
        return said, value, "-", "-", "reported" if c.valid else failed("not valid"), governed, "-"
    shown = judged(c.kept) if c.valid else failed("not valid")
    limit = f"{c.limit:.12g} {c.unit}".rstrip()
    return said, value, limit, margin(worst), shown, governed, _mark(assessment, worst)


def margin(row: Row) -> str:
    """What is left of a limit, in %; a dash where what was found is no number."""
    return "-" if math.isnan(row.margin) else against(row.margin, 0, 0)


def _governed(assessment: Assessment, worst: Row, rows: Sequence[Row]) -> str:
    """The case and the place that come nearest; not which case where all have the same value."""
    same = len(rows) > 1 and len({row.criterion.found for row in rows}) == 1
    case = "all cases alike" if same else assessment.state_of(worst.outcome.case)
    return ", ".join(filter(None, (case, worst.criterion.where)))


def _mark(assessment: Assessment, row: Row) -> str:
    """How far the number of a limit was seen; of the train's own limits that they are."""
    name, case = f"limits.{row.criterion.name}", row.outcome.case
    if name not in case.changes:
        return "the train"
    entry = source_of_limit(assessment.standard, case.key, name)
    return entry.mark if isinstance(entry, Provenance) else "the standard's file"


def cases(assessment: Assessment) -> Table:
    """Every case with how it ended and its balances."""
    heads = [
        *worded("Case", "train", "into"),
        Column("speed", "km/h"),
        Column("mass of the train", "t", ".6g", head="mass"),
        Column("TS", "mm", 1),
        Column("energy balance", "", ".0e"),
        Column("momentum balance", "", ".0e"),
        *worded("ended"),
    ]
    rows = []
    for n, o in enumerate(assessment.outcomes, start=1):
        changes, summary, chain = o.case.changes, o.summary, o.case.chain
        rows.append(
            (
                f"{n}",
                assessment.state_of(o.case),
                str(changes["collision.partner"]),
                f"{changes['collision.speed_km_h']:.4g}",
                float(chain.mass[: chain.n_moving].sum()) * 1e-3 if chain else None,
                summary.TS_mm if summary else None,
                abs(summary.balance.energy_error) if summary else None,
                abs(summary.balance.momentum_error) if summary else None,
                _ended(o),
            )
        )
    note = "Balances: what is missing, energy relative to what the collision can convert, momentum to the sum of |m v|."
    return Table(heads, rows, note=note)


def _ended(outcome: Outcome) -> Verdict:
    kind = outcome.summary.status.kind if outcome.summary else "refused"
    if outcome.fault or outcome.summary is None:
        return failed(kind)
    return warned(kind) if outcome.cut else judged(outcome.summary.status.kind == "over", kind, kind)


def remarks(assessment: Assessment) -> Table:
    """What there is to know of single cases, as their own runs say it."""
    found: dict[str, list[int]] = {}
    for n, outcome in enumerate(assessment.outcomes, start=1):
        for remark in outcome.summary.remarks if outcome.summary else ():
            found.setdefault(remark, []).append(n)
    rows = [(", ".join(map(str, cases)), remark) for remark, cases in found.items()]
    return Table(worded("Cases", "what there is to know"), rows)


def not_computed(assessment: Assessment) -> Table:
    """What is asked and not answered here."""
    return Table(worded("Not computed", "why"), list(assessment.not_computed.items()))


def asked(standard: Standard) -> Table:
    """The collision scenarios of a standard, with the speed of each category."""
    categories = list(standard.spec.categories) or [""]
    rows = []
    for scenario in standard.spec.scenarios.values():
        speeds = [_speed(scenario.speed_by_category_km_h.get(name, scenario.speed_km_h)) for name in categories]
        rows.append((scenario.title, scenario.partner, *speeds))
    heads = [
        *worded("Collision scenario", "into"),
        *(Column(name or "speed", "km/h", text=True) for name in categories),
    ]
    return Table(heads, rows)


def _speed(speed: float | FromLineSpeed | None) -> str:
    if isinstance(speed, FromLineSpeed):
        return f"line - {speed.line_speed_less_km_h:g}, at most {speed.at_most_km_h:g}"
    return "-" if speed is None else f"{speed:.4g}"
