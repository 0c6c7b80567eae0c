"""Tables in CSV files: those that trainmj wrote, to the last digit, and those of other people."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.errors import InputError, close_match
from trainmj.files.text import HIDDEN, beside, read_bytes, read_text

if TYPE_CHECKING:
    import pandas as pd

_MOST_BYTES = 50_000_000
_MOST_BYTES_BACK = 500_000_000  # of a table that trainmj wrote


def read_back(file: Path, follow: bool = False) -> pd.DataFrame:
    """Read a table that trainmj wrote; a column that is not all numbers stays text.

    Args:
        file: of the table.
        follow: whether it may be a link.

    Raises:
        InputError: if it cannot be read, without the name of the file.
    """
    try:
        text = read_bytes(file, _MOST_BYTES_BACK, follow).decode()
        return _table(csv.reader(io.StringIO(text, newline="")))
    except (csv.Error, UnicodeDecodeError, IndexError) as error:
        raise InputError(f"{file.name} is damaged ({error})") from None


def find_table(folder: Path, name: str, said: str) -> Path:
    """The CSV file that an input file names; it must be beside that file, in folder, or below.

    Raises:
        InputError: if there is no such file, or the name leads out of the folder; said begins the message.
    """
    path = beside(folder, name, said)
    if path is None:
        known = close_match(name, [path.name for path in folder.glob("*.csv")])
        raise InputError(f"{said}: there is no such file beside it{known}")
    return path


def read_beside(folder: Path, name: str, said: str) -> pd.DataFrame:
    """The table in a CSV file that an input file names, as :func:`find_table` finds it.

    Raises:
        InputError: if there is none that can be read.
    """
    path = find_table(folder, name, said)
    try:
        return read_given(path)
    except InputError as error:
        raise InputError(f"{said}: {error}") from None


def read_given(file: Path) -> pd.DataFrame:
    """Read a table that somebody else wrote, as :func:`rows_given` does.

    Raises:
        InputError: if it cannot be read, or its rows differ in length; without the name of the file.
    """
    text = read_text(file, _MOST_BYTES)
    found = HIDDEN.search(text)
    if found:
        raise InputError(f"has the character {found[0]!a}: it is not plain text")
    rows = rows_given(text)
    if len(rows) < 2:
        raise InputError("must have a line of heads, and one line or more of values")
    short = next((n for n, row in enumerate(rows) if len(row) != len(rows[0])), None)
    if short is not None:
        raise InputError(f"row {short} has {len(rows[short])} values under {len(rows[0])} heads")
    double = {head for head in rows[0] if rows[0].count(head) > 1}
    if double:
        raise InputError(f"has two columns {min(double)!r}")
    return _table(rows)


def rows_given(text: str) -> list[list[str]]:
    """The cells of a table that somebody else wrote, its heads first.

    Columns are separated by commas, semicolons or tabs, as in the first line; with semicolons or tabs the decimal mark
    may be a comma. Lines that begin with # and lines without values are skipped.

    Raises:
        InputError: if a cell is too long or its quotes do not close.
    """
    lines = [line for line in text.splitlines() if line.strip(" ,;\t") and not line.lstrip().startswith("#")]
    separator = next((s for s in ";\t" if lines and s in lines[0]), ",")
    try:
        rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator, strict=True)]
    except csv.Error as error:
        raise InputError(f"is not a table of comma-separated values ({error})") from None
    if separator != ",":
        rows[1:] = [[cell.replace(",", ".") for cell in row] for row in rows[1:]]
    return rows


def _table(rows: Iterable[list[str]]) -> pd.DataFrame:
    import pandas as pd

    heads, *cells = rows
    return pd.DataFrame({head: _column([row[k] for row in cells]) for k, head in enumerate(heads)}, columns=heads)


def _column(texts: list[str]) -> list[Any]:
    """Whole numbers, or numbers with nan where a cell is empty, or text."""
    if any(texts):
        for number in (int, lambda text: float(text) if text else math.nan):
            try:
                return [number(text) for text in texts]
            except ValueError:
                continue
    return list(texts)
