"""The terminal: tables that fit it, or 80 columns where there is none, and a progress bar."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Literal, NamedTuple

from rich import box
from rich import progress as bars
from rich.align import Align
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from trainmj.output.table import Column, Table, Verdict
from trainmj.output.waiting import hush

WIDTH = 80  # where there is no terminal
WIDEST = 200
_BETWEEN = 2  # characters between columns
_LONGEST_WORD = 24  # that is not broken in a column of words

FAILED = "bold red"
"""What is not passed, beside the word for it."""


class Progress(bars.Progress):
    """A bar with rate and time left on a terminal; silent where there is none."""

    def __init__(self, total: int) -> None:
        """Make a bar for a number of cases."""
        super().__init__(
            bars.MofNCompleteColumn(),
            bars.BarColumn(),
            _Rate(),
            bars.TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._task = self.add_task("", total=total)

    def start(self) -> None:
        """Show the bar."""
        hush()
        super().start()

    def __call__(self, finished: int) -> None:
        """Show how many are finished."""
        self.update(self._task, completed=finished)


class _Rate(bars.ProgressColumn):
    """How many are finished a second; those that were there already do not count."""

    def render(self, task: bars.Task) -> Text:
        return Text("" if task.speed is None else f"{task.speed:.0f}/s")


def console_table(table: Table, widths: Sequence[int]) -> Grid:
    """A table as rich prints it: numbers to the right, never broken, words to the left, broken where they must be."""
    grid = Grid(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        show_edge=False,
        title=table.title or None,
        title_justify="left",
        title_style="bold",
    )
    for column, width in zip(table.columns, widths, strict=True):
        side: Literal["left", "right"] = "left" if column.text else "right"
        grid.add_column(
            Align(_head(column), side, vertical="bottom"),
            justify=side,
            no_wrap=not column.text,
            overflow="fold",
            width=width,
        )
    for row in table.rows:
        grid.add_row(*(_cell(column.show(value)) for column, value in zip(table.columns, row, strict=True)))
    return grid


class _Need(NamedTuple):
    """Characters that a column needs at least, with no number, no head and no word of usual length broken; at most."""

    least: int
    most: int

    @classmethod
    def of(cls, table: Table, k: int) -> _Need:
        column = table.columns[k]
        cells = (str(_cell(column.show(row[k]))) for row in table.rows)
        lines = [line for text in (_head(column), *cells) for line in text.split("\n")]
        most = max(map(cell_len, lines))
        longest = max((cell_len(word) for line in lines for word in line.split()), default=0)
        return cls(min(longest, _LONGEST_WORD) if column.text else most, most)


def _room(console: Console, columns: int) -> int:
    """Characters for the cells of a line."""
    return console.width - _BETWEEN * (columns - 1)


def _widths(needs: Sequence[_Need], room: int) -> list[int]:
    """Widths of columns that share a line: the widest one gives way, and breaks words only where all need more."""
    found = [min(need.most, room) for need in needs]
    while sum(found) > max(room, len(found)):
        wide = [k for k, need in enumerate(needs) if found[k] > need.least] or range(len(found))
        found[max(wide, key=found.__getitem__)] -= 1
    return found


def print_verdict(console: Console, verdict: Verdict) -> None:
    """The verdict on a whole, by itself."""
    console.print(Text(verdict.text, style=FAILED if verdict.kind == "fail" else "bold"))


def print_table(console: Console, table: Table) -> None:
    """Print a table; the columns that a line has no room for go below, with the first column again."""
    needs = [_Need.of(table, k) for k in range(len(table.columns))]
    words = all(column.text for column in table.columns)  # which can be broken
    parts = [[0]]
    for k in range(1, len(needs)):
        longer = [needs[n] for n in (*parts[-1], k)]
        takes = sum(need.least if words else need.most for need in longer)
        if len(parts[-1]) > 1 and takes > _room(console, len(longer)):
            parts.append([0])
        parts[-1].append(k)
    for n, part in enumerate(parts):
        if n:
            console.print()
        widths = _widths([needs[k] for k in part], _room(console, len(part)))
        console.print(console_table(_of_columns(table, part, "" if n else table.title), widths))
    if table.note:
        console.print(table.note, style="italic")  # which takes the whole line, however narrow the table is


def _of_columns(table: Table, chosen: Sequence[int], title: str = "") -> Table:
    """Some columns of a table."""
    return Table([table.columns[k] for k in chosen], [[row[k] for k in chosen] for row in table.rows], title)


def _head(column: Column) -> str:
    head = column.head or (column.name if column.text else column.name.replace(" ", "\n"))
    return f"{head}\n{column.unit}" if column.unit else head


def _cell(shown: object) -> Text:
    if isinstance(shown, Verdict):
        return Text(shown.text.upper(), style=FAILED) if shown.kind == "fail" else Text(shown.text)
    return Text(str(shown))


def new_console() -> Console:
    """A console as wide as the terminal, up to 200 columns; 80 where there is none. What moved is gone then."""
    hush()
    console = Console(highlight=False, emoji=False, markup=False)
    console.width = min(console.width, WIDEST) if console.is_terminal else WIDTH
    return console
