"""The terminal: tables at most 80 columns wide, and a progress bar."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace

from rich import box
from rich import progress as bars
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from trainmj.output.table import Column, Table, Verdict

WIDTH = 80


class Progress:
    """A bar with rate and time left on a terminal; silent where there is none."""

    def __init__(self, total: int) -> None:
        """For a known number of cases."""
        self._began: tuple[float, int] | None = None
        self._bar = bars.Progress(
            bars.TextColumn("{task.completed}/{task.total}"),
            bars.BarColumn(),
            bars.TextColumn("{task.fields[rate]}"),
            bars.TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not sys.stderr.isatty(),
            transient=True,
        )
        self._task = self._bar.add_task("", total=total, rate="")

    def __enter__(self) -> Progress:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Take it away."""
        self.stop()

    def stop(self) -> None:
        """Take it away."""
        self._bar.stop()

    def __call__(self, finished: int) -> None:
        """Show how many are finished."""
        now = time.monotonic()
        if self._began is None:
            self._began = (now, finished)
        since, before = self._began
        rate = (finished - before) / (now - since) if now > since else 0.0
        self._bar.update(self._task, completed=finished, rate=f"{rate:.0f}/s")


def console_table(table: Table) -> Grid:
    """A table as rich prints it: numbers to the right and never broken, words to the left and broken where they must.

    Args:
        table: columns and rows.
    """
    grid = _grid(table.title)
    grid.caption = table.note or None
    for column in table.columns:
        grid.add_column(
            _head(column), justify="left" if column.text else "right", no_wrap=not column.text, vertical="bottom"
        )
    for row in table.rows:
        grid.add_row(*(_cell(column.show(value)) for column, value in zip(table.columns, row, strict=True)))
    return grid


def print_table(console: Console, table: Table) -> None:
    """Print a table; one that is too wide goes on below, its first column again.

    Args:
        console: where.
        table: columns and rows.
    """
    for n, part in enumerate(_parts(table, console.width)):
        if n:
            console.print()
        console.print(console_table(part))


def _parts(table: Table, width: int) -> Iterator[Table]:
    """The table in parts that are no wider than a number of characters, where its columns allow that."""
    cells = zip(*table.rows, strict=True) if table.rows else [()] * len(table.columns)
    sizes = [
        max(
            len(line)
            for text in (_head(c), *(str(_cell(c.show(v))) for v in values))
            for line in text.splitlines() or [""]
        )
        for c, values in zip(table.columns, cells, strict=True)
    ]
    parts: list[list[int]] = [[0]]
    for k in range(1, len(sizes)):
        if len(parts[-1]) > 1 and sum(sizes[i] + 1 for i in parts[-1]) + sizes[k] > width:
            parts.append([0])
        parts[-1].append(k)
    for part in parts:
        yield replace(
            table,
            columns=[table.columns[k] for k in part],
            rows=[[row[k] for k in part] for row in table.rows],
            title=table.title if part is parts[0] else "",
            note=table.note if part is parts[-1] else "",
        )


def _head(column: Column) -> str:
    head = column.head or (column.name if column.text else column.name.replace(" ", "\n"))
    return f"{head}\n{column.unit}" if column.unit else head


def _cell(shown: object) -> Text:
    if isinstance(shown, Verdict):
        return Text(shown.text.upper(), style="bold reverse") if shown.kind == "fail" else Text(shown.text)
    return Text(str(shown))


def _grid(title: str | None) -> Grid:
    return Grid(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        show_edge=False,
        title=title or None,
        title_justify="left",
        title_style="bold",
        caption_justify="left",
    )


def new_table(first: str, *heads: str, title: str | None = None) -> Grid:
    """A table whose first column is text and whose others are numbers: :func:`console_table` takes its place."""
    table = _grid(title)
    table.add_column(first, no_wrap=True, vertical="bottom")
    for head in heads:
        text = head in ("type", "device") or head.startswith("stages")
        table.add_column(head, justify="left" if text else "right", no_wrap=not text, vertical="bottom")
    return table


def new_console() -> Console:
    """A console at most 80 columns wide."""
    console = Console(highlight=False, emoji=False)
    if console.width > WIDTH or not console.is_terminal:
        console.width = WIDTH
    return console
