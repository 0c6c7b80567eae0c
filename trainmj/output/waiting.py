"""What moves on a terminal from the first moment of a long command until it has something of its own to show."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

_lines: list[Progress] = []  # the one that is shown, if any


@contextmanager
def waiting(text: str) -> Iterator[None]:
    """Show a line with the time that passes, until the work ends or :func:`hush` takes it away."""
    if sys.stderr is not None and sys.stderr.isatty():
        from rich import progress as bars
        from rich.console import Console

        line = bars.Progress(
            bars.SpinnerColumn(),
            bars.TextColumn("{task.description}", markup=False),
            bars.TimeElapsedColumn(),
            console=Console(stderr=True, highlight=False),
            transient=True,
        )
        line.add_task(text)
        line.start()
        _lines.append(line)
    try:
        yield
    finally:
        hush()


def tell(text: str) -> None:
    """Say in the line what is being done."""
    for line in _lines:
        line.update(line.task_ids[0], description=text)


def hush() -> None:
    """Take the line away: something else is shown from now on."""
    while _lines:
        _lines.pop().stop()
