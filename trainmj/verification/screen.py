"""What ``trainmj verify`` prints: one table for each group, at most 80 columns."""

from __future__ import annotations

from rich.padding import Padding
from rich.text import Text

from trainmj.output.console import new_console, new_table
from trainmj.verification.check import Check, Kind
from trainmj.verification.suite import Verification


def print_verification(verification: Verification) -> None:
    """Every check, then how many passed."""
    console = new_console()
    for group, checks in verification.groups:
        table = new_table("Case", "expected", "found", "tolerance", "", title=group.title)
        table.expand, table.columns[0].ratio, table.columns[0].no_wrap = True, 1, False
        case = ""
        for check in checks:
            if check.case != case:
                case = check.case
                table.add_row(Text(case, style="bold"), "", "", "", "")
            verdict = Text("pass") if check.passed else Text("FAIL", style="bold reverse")
            name = Padding(Text(what(check)), (0, 0, 0, 2))
            table.add_row(name, expected(check), number(check.found), tolerance(check), verdict)
        console.print(table)
        console.print()
    n, failed = len(verification.checks), len(verification.failed)
    console.print(
        f"{n} checks in {verification.seconds:.0f} s: "
        + ("all pass." if verification.passed else f"{failed} FAIL{'S' if failed == 1 else ''}."),
        style="bold",
    )


def what(check: Check) -> str:
    """What is compared, with its unit."""
    return f"{check.what} [{check.unit}]" if check.unit else check.what


def number(value: float) -> str:
    """A value as it is read."""
    return f"{value:.2g}" if 0 < abs(value) < 1e-3 else f"{value:.7g}"


def expected(check: Check) -> str:
    """The expected value, or the least one."""
    if check.kind is Kind.AT_LEAST:
        return f"at least {number(check.expected - check.tolerance)}"
    return number(check.expected)


def tolerance(check: Check) -> str:
    """How far off found may be."""
    if check.kind is Kind.AT_LEAST:
        return ""
    return f"{100 * check.tolerance:.2g} %" if check.kind is Kind.RELATIVE else number(check.tolerance)
