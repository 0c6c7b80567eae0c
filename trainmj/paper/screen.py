"""What ``trainmj paper`` prints: bars missed, verdicts, laws that do not hold, defects, optima.

And what its option ``--beyond`` prints.
"""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from trainmj.output.console import new_console, print_table
from trainmj.output.table import Table
from trainmj.paper.beyond import Beyond
from trainmj.paper.laws_beyond import RULES
from trainmj.paper.page import REACHED, holding, optima_table, outcome, scatter_table, verdict_tables
from trainmj.paper.page_beyond import HOW, law_tables, reasons, turns_table
from trainmj.paper.reproduce import Reproduction


def print_paper(reproduction: Reproduction) -> None:
    """Print the bars that are missed, verdicts, optima, the laws that do not hold, and the defects."""
    console = new_console()
    console.print(Text("Liu et al. 2022, the B-type subway train: published against computed", style="bold"))
    _list(console, outcome(reproduction), [v.missed for v in reproduction.missed])
    for table in verdict_tables(reproduction):
        shown = [k for k, column in enumerate(table.columns) if k not in (1, 2) and column.name != "floor"]
        _table(console, table, table.title, shown)  # without the numbers themselves
    console.print()
    console.print(REACHED, markup=False)
    found = scatter_table(reproduction)
    _table(console, found, found.title, range(len(found.columns)))
    console.print(found.note, markup=False)
    K, misfit = reproduction.scatter.best
    console.print(f"Of stiffnesses K from 1e3 to 4e5 kN/mm, {K:.0f} leaves least: {misfit:.3f} of its square.")
    optima = optima_table(reproduction)
    _table(console, optima, "Optimum", range(len(optima.columns) - 1))  # without the stroke of the anti-climber
    laws, defects = reproduction.laws, reproduction.defects
    title = f"Laws stated in words: {holding(reproduction)} hold on our results; these do not"
    failing = [law for law in laws if not law.holds and not law.impossible]
    _list(console, title, [f"Section {w.section}: {w.statement}. Ours: {w.ours}" for w in failing])
    cannot = [f"Section {w.section}: {w.statement}. Ours: {w.ours}; {w.impossible}" for w in laws if w.impossible]
    _list(console, "Statements that cannot hold", cannot)
    title = f"Defects of the paper: {len(defects)}, shown by arithmetic on its own numbers"
    _list(console, title, [f"{d.title} ({d.where})" for d in defects])


def print_beyond(found: Beyond) -> None:
    """Print where the laws hold beyond the paper's range, and what begins where they break."""
    console = new_console()
    title = f"Liu et al. 2022, beyond its range: {len(RULES)} laws on {found.n} conditions"
    console.print(Text(title, style="bold"))
    console.print(HOW, markup=False)
    for table in (*law_tables(found), turns_table(found)):
        _table(console, table, table.title, range(len(table.columns)))
    _list(console, "Why laws break, and where (the numbers there: --out)", reasons(found))


def _table(console: Console, table: Table, title: str, at: Iterable[int]) -> None:
    """The columns of a table that fit the terminal."""
    console.print()
    rows = [[row[k] for k in at] for row in table.rows]
    print_table(console, Table([table.columns[k] for k in at], rows, title))


def _list(console: Console, title: str, items: Iterable[str]) -> None:
    console.print()
    console.print(Text(title, style="bold"))
    for item in items:
        row = Grid.grid(padding=(0, 1))
        row.add_row("-", Text(item))
        console.print(row)
