"""What ``trainmj verify`` prints: one table for each group."""

from __future__ import annotations

from trainmj.output.console import FAILED, new_console, print_table
from trainmj.verification.page import table_of
from trainmj.verification.published import NOT_CHECKED
from trainmj.verification.suite import Verification


def print_verification(verification: Verification) -> None:
    """Print every check, then how many passed."""
    console = new_console()
    for group, checks in verification.groups:
        print_table(console, table_of(checks, group.title))
        console.print()
    n, failed = len(verification.checks), len(verification.failed)
    console.print(
        f"{n} checks in {verification.seconds:.0f} s: "
        + ("all pass." if verification.passed else f"{failed} FAIL{'S' if failed == 1 else ''}."),
        style="bold" if verification.passed else FAILED,
    )
    console.print(f"Not checked: {NOT_CHECKED[0]}")
