"""What ``trainmj paper`` prints: verdicts, laws that do not hold, defects, optima; at most 80 columns."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from trainmj.output.console import new_console, new_table
from trainmj.paper.reproduce import Reproduction
from trainmj.paper.verdicts import GROUPS

_WORDS = {True: "agrees", False: "DIFFERS", None: "no bar"}
_SOURCES = {"published": "the paper", "from_table_9": "its Table 9", "ours": "our responses"}


def print_paper(reproduction: Reproduction) -> None:
    """The closing summary."""
    console = new_console()
    console.print(Text("Liu et al. 2022, the B-type subway train: published against computed", style="bold"))
    for group in GROUPS:
        table = new_table("Item", "deviation", "bar", "", title=group[0].upper() + group[1:])
        for v in reproduction.verdicts:
            if v.group == group:
                bar = "-" if v.bar is None else v.said(v.bar)
                table.add_row(v.item, v.said(v.deviation), bar, _WORDS[v.agrees])
        console.print()
        console.print(table)
    table = new_table(
        "Decision from",
        "D\nmm",
        "M\nt",
        "TS\nsurrogate\nmm",
        "TS\nsimulated\nmm",
        "TAMA\nsurrogate\ng",
        "TAMA\nsimulated\ng",
        title="Optimum",
    )
    for row in reproduction.optima.itertuples(index=False):
        values = (f"{row.D_mm:g}", f"{row.M_t:g}", f"{row.TS_surrogate_mm:.1f}", f"{row.TS_simulated_mm:.1f}")
        table.add_row(_SOURCES[str(row.source)], *values, f"{row.TAMA_surrogate_g:.3f}", f"{row.TAMA_simulated_g:.3f}")
    console.print()
    console.print(table)
    hold = sum(law.holds for law in reproduction.laws)
    failing = [f"Section {w.section}: {w.statement}. Ours: {w.ours}" for w in reproduction.laws if not w.holds]
    title = f"Laws stated in words: {hold} of {len(reproduction.laws)} hold on our results; these do not"
    _list(console, title, failing)
    defects = [f"{d.title} ({d.where})" for d in reproduction.defects]
    _list(console, f"Defects of the paper: {len(defects)}, shown by arithmetic on its own numbers", defects)


def _list(console: Console, title: str, items: list[str]) -> None:
    console.print()
    console.print(Text(title, style="bold"))
    for item in items:
        row = Table.grid(padding=(0, 1))
        row.add_row("-", Text(item))
        console.print(row)
