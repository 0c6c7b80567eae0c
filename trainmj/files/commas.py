"""Tables as CSV, byte for byte as pandas writes them, whose import takes longer than a collision."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping
from typing import Any

Columns = Mapping[str, Any]
"""Sequences or arrays of values by the head of their column; None is an empty cell."""


def columns_of(rows: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """The columns of rows, in the order in which heads first come."""
    rows = list(rows)
    return {head: [row.get(head) for row in rows] for head in dict.fromkeys(head for row in rows for head in row)}


def as_csv(columns: Columns, number: str) -> str:
    """A table as text.

    Args:
        columns: of one length.
        number: format of numbers that are not whole, such as ``%.9g``.
    """
    out = io.StringIO()
    table = csv.writer(out, lineterminator=os.linesep)
    table.writerow(columns)
    table.writerows(zip(*(_cells(values, number) for values in columns.values()), strict=True))
    return out.getvalue()


def _cells(values: Any, number: str) -> list[str]:
    """The values of a column as text; whole numbers beside empty cells are written as the others."""
    values = values.tolist() if hasattr(values, "tolist") else list(values)
    given = [value for value in values if value is not None]
    numbers = all(isinstance(value, float | int) and not isinstance(value, bool) for value in given)
    if numbers and (len(given) < len(values) or any(isinstance(value, float) for value in given)):
        return ["" if value is None or value != value else number % value for value in values]
    return ["" if value is None or value != value else str(value) for value in values]
