"""The page of ``trainmj verify``: every case, expected beside found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from trainmj.collision.identity import identity
from trainmj.output.blocks import Card
from trainmj.output.page import Page
from trainmj.output.table import Column, Table, judged
from trainmj.units import against
from trainmj.verification.check import Check, Kind
from trainmj.verification.published import NOT_CHECKED
from trainmj.verification.suite import Verification


def page_of(verification: Verification, command: str) -> Page:
    """The page, with the command that makes it again."""
    title = "Collisions whose outcome is known without this program, computed on this machine"
    page = Page("Verification", title, command, identity())
    n, failed = len(verification.checks), len(verification.failed)
    page.verdict = verification.verdict
    summary = page.section("Result")
    summary.cards(
        Card("Checks", f"{n - failed} of {n}", note="within their tolerance", verdict=judged(verification.passed)),
        Card("Time", f"{verification.seconds:.0f}", "s"),
    )
    columns = [Column("Group", text=True), Column("checks"), Column("failed"), Column("", text=True)]
    rows = [
        (group.title, len(checks), bad := sum(not c.passed for c in checks), judged(bad == 0))
        for group, checks in verification.groups
    ]
    summary.table(Table(columns, rows))
    for group, checks in verification.groups:
        section = page.section(group.title)
        section.text(group.note)
        section.table(table_of(checks))
    page.section("Not checked").notes(NOT_CHECKED)
    return page


def table_of(checks: Sequence[Check], title: str = "") -> Table:
    """The checks of a group below the names of their cases; the verdict first, for on a phone the rest scrolls."""
    words = Column("", text=True), Column("Case", text=True)
    return Table([*words, *map(Column, ("expected", "found", "tolerance"))], list(_rows(checks)), title)


def _rows(checks: Sequence[Check]) -> Iterator[tuple[object, ...]]:
    for case, of in groupby(checks, lambda c: c.case):
        yield "", case, "", "", ""
        for c in of:
            yield _row(c)


def _row(c: Check) -> tuple[object, ...]:
    what = f"\u00a0\u00a0{c.what}" + (f" [{c.unit}]" if c.unit else "")
    if c.kind is Kind.AT_LEAST:
        expected, tolerance = f"at least {_number(c.expected - c.tolerance)}", ""
    else:
        expected = _number(c.expected)
        tolerance = f"{100 * c.tolerance:.6g} %" if c.kind is Kind.RELATIVE else _number(c.tolerance)
    return judged(c.passed), what, expected, _number(c.found, c.nearest_end), tolerance


def _number(value: float, limit: float | None = None) -> str:
    return against(value, limit, -2 if 0 < abs(value) < 1e-3 else -7)
