"""The page of ``trainmj verify``: every case, expected beside found."""

from __future__ import annotations

from trainmj.collision.identity import identity
from trainmj.output.blocks import Card, Column, judged
from trainmj.output.page import Page
from trainmj.verification.published import NOT_CHECKED
from trainmj.verification.screen import expected, number, tolerance, what
from trainmj.verification.suite import Verification


def page_of(verification: Verification, command: str) -> Page:
    """The page.

    Args:
        verification: what was found.
        command: makes it again.
    """
    page = Page(
        "Verification",
        "Collisions whose outcome is known without this program, computed on this machine",
        command,
        identity(),
    )
    n, failed = len(verification.checks), len(verification.failed)
    summary = page.section("Result")
    summary.cards(
        Card("Checks", f"{n - failed} of {n}", note="within their tolerance", verdict=judged(verification.passed)),
        Card("Time", f"{verification.seconds:.0f}", "s"),
    )
    summary.table(
        [Column("Group", text=True), Column("checks", digits=0), Column("failed", digits=0), Column("", text=True)],
        [
            (group.title, len(checks), bad := sum(not c.passed for c in checks), judged(bad == 0))
            for group, checks in verification.groups
        ],
    )
    for group, checks in verification.groups:
        section = page.section(group.title)
        section.text(group.note)
        columns = [
            Column("", text=True),  # the verdict first: on a phone the rest scrolls
            Column("Case", text=True),
            Column("what", text=True),
            Column("expected"),
            Column("found"),
            Column("tolerance"),
        ]
        before = ("", *(c.case for c in checks))  # a case is named in its first row
        rows = [
            (
                judged(c.passed),
                "" if c.case == last else c.case,
                what(c),
                expected(c),
                number(c.found),
                tolerance(c) or "–",
            )
            for c, last in zip(checks, before, strict=False)
        ]
        section.table(columns, rows)
    page.section("Not checked").notes(NOT_CHECKED)
    return page
