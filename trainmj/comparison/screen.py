"""What is printed of a comparison."""

from __future__ import annotations

from rich.text import Text

from trainmj.comparison import tables
from trainmj.comparison.found import Comparison
from trainmj.output.console import new_console, print_table, print_verdict

_MOST = 20  # channels that are printed


def print_comparison(found: Comparison) -> None:
    """Rules, differences and remarks."""
    console = new_console()
    console.print(Text(f"A: {found.a.name}"))
    console.print(Text(f"B: {found.b.name}"))
    print_verdict(console, tables.verdict(found))
    console.print()
    print_table(console, tables.rules(found))
    for text in tables.said(found):
        console.print(Text(text))
    for title, some in tables.titled(found):
        worst = sorted(some, key=lambda one: -abs(one.rms_percent) if one.rms_percent == one.rms_percent else 0.0)
        shown = [one for one in some if one in worst[:_MOST]]
        left = f" (those {_MOST} of {len(some)} that differ most)" if len(some) > _MOST else ""
        console.print()
        print_table(console, tables.differences(shown, title + left, means=False))
    console.print()
    for remark in found.remarks:
        console.print(Text(f"Note: {remark}"))
