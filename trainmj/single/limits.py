"""The limits of a scenario beside what a collision found, for terminal and page."""

from __future__ import annotations

from collections.abc import Sequence

from trainmj.collision.limits import Criterion
from trainmj.output.table import Column, Table, judged


def limits_table(criteria: Sequence[Criterion]) -> Table:
    """A row for each limit."""
    return Table(
        [
            Column("Limit", text=True),
            Column("at", text=True),
            Column("found"),
            Column("allowed"),
            Column("used", "%", digits=0),
            Column("verdict", text=True),
        ],
        [
            (c.title, c.where, f"{c.text} {c.unit}", f"{c.limit:g} {c.unit}", 100 * c.found / c.limit, judged(c.kept))
            for c in criteria
        ],
    )
