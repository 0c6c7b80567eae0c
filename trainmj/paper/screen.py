"""What ``trainmj paper`` prints: verdicts, laws that do not hold, defects, optima; at most 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from trainmj.output.console import console_table, new_console
from trainmj.output.table import Table
from trainmj.paper.page import optima_table, verdict_tables
from trainmj.paper.reproduce import Reproduction

_VERDICT = ("Item", "deviation", "bar", "verdict")


def print_paper(reproduction: Reproduction) -> None:
    """The closing summary."""
    console = new_console()
    console.print(Text("Liu et al. 2022, the B-type subway train: published against computed", style="bold"))
    tables = [_only(table, _VERDICT, table.title) for table in verdict_tables(reproduction)]
    optima = optima_table(reproduction)
    shown = [column.name for column in optima.columns if not column.name.startswith("S_anti")]
    for table in (*tables, _only(optima, shown, "Optimum")):
        console.print()
        console.print(console_table(table))
    laws, defects = reproduction.laws, reproduction.defects
    title = f"Laws stated in words: {sum(law.holds for law in laws)} of {len(laws)} hold on our results; these do not"
    failing = [f"Section {w.section}: {w.statement}. Ours: {w.ours}" for w in laws if not w.holds]
    _list(console, title, failing)
    title = f"Defects of the paper: {len(defects)}, shown by arithmetic on its own numbers"
    _list(console, title, [f"{d.title} ({d.where})" for d in defects])


def _only(table: Table, names: Sequence[str], title: str) -> Table:
    """The columns of a table that fit the terminal."""
    at = [k for k, column in enumerate(table.columns) if column.name in names]
    return Table([table.columns[k] for k in at], [[row[k] for k in at] for row in table.rows], title)


def _list(console: Console, title: str, items: list[str]) -> None:
    console.print()
    console.print(Text(title, style="bold"))
    for item in items:
        row = Grid.grid(padding=(0, 1))
        row.add_row("-", Text(item))
        console.print(row)
