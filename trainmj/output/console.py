"""The terminal: tables as wide as it is, at most 80 columns where there is none, and what moves while one waits."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal

from rich import box
from rich import progress as bars
from rich.align import Align
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table as Grid
from rich.text import Text

from trainmj.output.table import Column, Table, Verdict
from trainmj.output.waiting import hush

WIDTH = 80  # where there is no terminal
WIDEST = 200
_LONGEST_WORD = 30  # that is not broken in a column of words

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


def console_table(table: Table) -> Grid:
    """A table as rich prints it: numbers to the right, never broken, words to the left, broken where they must be."""
    grid = Grid(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        show_edge=False,
        title=table.title or None,
        title_justify="left",
        title_style="bold",
        caption=table.note or None,
        caption_justify="left",
    )
    for k, column in enumerate(table.columns):
        side: Literal["left", "right"] = "left" if column.text else "right"
        cells = [str(_cell(column.show(row[k]))) for row in table.rows]
        grid.add_column(
            Align(_head(column), side, vertical="bottom"),
            justify=side,
            no_wrap=not column.text,
            overflow="fold",
            min_width=_least(column, cells),
        )
    for row in table.rows:
        grid.add_row(*(_cell(column.show(value)) for column, value in zip(table.columns, row, strict=True)))
    return grid


def _least(column: Column, cells: Iterable[str]) -> int:
    """Characters that a column needs so that no number, no head and no word of usual length is broken."""
    texts = [*_head(column).split("\n"), *cells]
    words = [word for text in texts for word in text.split()] if column.text else texts
    longest = max(map(len, words), default=1)
    return min(longest, _LONGEST_WORD) if column.text else longest


def print_table(console: Console, table: Table) -> None:
    """Print a table; the columns that a line has no room for go below, with the first column again."""
    whole = console_table(replace(table, note=""))  # a note takes the whole line, however narrow the table is
    width = _width(console, whole)
    words = all(column.text for column in table.columns)  # which can be broken
    if (width.minimum if words else width.maximum) <= console.width:
        console.print(whole)
    else:
        _print_parts(console, table)
    if table.note:
        console.print(table.note, style="italic")


def _print_parts(console: Console, table: Table) -> None:
    """Print the columns of a table in several ones, each as wide as a line."""
    parts = [[0]]
    for k in range(1, len(table.columns)):
        longer = console_table(_of_columns(table, [*parts[-1], k]))
        if len(parts[-1]) > 1 and _width(console, longer).maximum > console.width:
            parts.append([0])
        parts[-1].append(k)
    for part in parts:
        if part is not parts[0]:
            console.print()
        title = table.title if part is parts[0] else ""
        console.print(console_table(_of_columns(table, part, title)))


def _width(console: Console, grid: Grid) -> Measurement:
    """Characters that a line of a table takes at least, and at most, its title and note aside."""
    return Measurement.get(console, console.options.update(max_width=10_000), grid)


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
