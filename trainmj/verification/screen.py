"""What ``trainmj verify`` prints: one table for each group."""

from __future__ import annotations

from trainmj.output.console import new_console, print_table, print_verdict
from trainmj.verification.page import table_of
from trainmj.verification.published import NOT_CHECKED
from trainmj.verification.suite import Verification


def print_verification(verification: Verification) -> None:
    """Print every check, then how many passed."""
    console = new_console()
    for group, checks in verification.groups:
        print_table(console, table_of(checks, group.title))
        console.print()
    print_verdict(console, verification.verdict)
    console.print(f"Computed in {verification.seconds:.0f} s")
    console.print(f"Not checked: {NOT_CHECKED[0]}")
