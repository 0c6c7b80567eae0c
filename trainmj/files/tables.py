"""Tables in CSV files: those that trainmj wrote, to the last digit, and those of other people."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.errors import InputError, close_match
from trainmj.files.numbers import read_number
from trainmj.files.text import HIDDEN, beside, read_bytes, read_text

if TYPE_CHECKING:
    import pandas as pd

_MOST_BYTES = 50_000_000
_MOST_BYTES_BACK = 500_000_000  # of a table that trainmj wrote
_MOST_CELLS = 1_000_000
_MOST_COLUMNS = 1000
_LONGEST_LINE = 1_000_000  # characters
_SHOWN = 60  # characters of a cell in a message

_START = re.compile(  # a separator as Excel states it, blank lines and comments, the heads
    r'(?:"?sep=(?P<stated>.)"?[ \t]*\n)?(?:[ ,;\t]*\n|[ \t]*#[^\n]*\n)*(?P<heads>(?:[^"\n]+|"[^"]*")*)', re.IGNORECASE
)
_QUOTED = re.compile(r'"[^"]*"')
_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[.,'’_\s][0-9]{3})+(?:[.,][0-9]*)?")  # thousands set apart
_EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")  # thousands, or three decimals
_CURE = "write numbers with one decimal mark, and no marks between thousands"


@dataclass(frozen=True)
class Table:
    """A table that somebody else wrote.

    Attributes:
        file: where it is.
        columns: cells by head, (n,) each: whole numbers, or numbers with nan where a cell is empty, or text.
        lines: of the file, where each row begins, (n,).
    """

    file: Path
    columns: Mapping[str, list[Any]]
    lines: Sequence[int]

    def said(self, row: int, head: str) -> str:
        """Place of a cell and what is in it, to begin a message with; the first row is 0 here, and said as 1."""
        cell = self.columns[head][row]
        text = ascii("" if cell != cell else cell)
        shown = f"{text[:_SHOWN]}{'...' * (len(text) > _SHOWN)}"
        return f"line {self.lines[row]}: row {row + 1}: {head[:_SHOWN]} = {shown}"

    def numbers(self, head: str) -> list[float]:
        """A column of which every cell must be a number, (n,).

        Raises:
            InputError: naming the first cell that is not.
        """
        row = first_of_no_number(self.columns[head], empty=True)
        if row is not None:
            raise InputError(f"{self.said(row, head)}: must be a number")
        return [float(cell) for cell in self.columns[head]]


def first_of_no_number(cells: Sequence[Any], empty: bool = False) -> int | None:
    """Position of the first cell for which a column is text, or which is empty, if that counts; None if there is none.

    In a column of text, cells that are written as numbers are text too.
    """

    def wrong(cell: Any) -> bool:
        blank = cell == "" or cell != cell
        return empty if blank else isinstance(cell, str) and not _NUMBER.fullmatch(cell)

    return next((k for k, cell in enumerate(cells) if wrong(cell)), None)


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


def read_beside(folder: Path, name: str, said: str, texts: Collection[str] = ()) -> Table:
    """The table in a CSV file that an input file names, beside that file, in folder, or below.

    Columns are separated by commas, semicolons or tabs, as the heads are, or as a line ``sep=;`` before them states.
    The decimal mark is a point or a comma. Separators in quotes are text. Lines that begin with # and lines without
    values are skipped, and so are columns with neither head nor values. Columns with a head of texts are text, whatever
    is in them.

    Raises:
        InputError: if there is no such file, the name leads out of the folder, it is not a table, a row is longer or
            shorter than the heads, or a number could be read in two ways; said begins the message.
    """
    path = beside(folder, name, said)
    if path is None:
        known = close_match(name, [path.name for path in folder.glob("*.csv")])
        raise InputError(f"{said}: there is no such file beside it{known}")
    try:
        return _read(path, texts)
    except InputError as error:
        raise InputError(f"{said}: {error}") from None


def _read(file: Path, texts: Collection[str]) -> Table:
    """The table in a file; errors do not name it."""
    text = read_text(file, _MOST_BYTES).replace("\r", "\n")
    count = text.count("\n") + 1
    if count > _MOST_CELLS:
        raise InputError(f"has {count} lines, more than {_MOST_CELLS}")
    found = HIDDEN.search(text)
    if found:
        raise InputError(f"has the character {found[0]!a}: it is not plain text")
    long = next((n for n, line in enumerate(text.split("\n"), 1) if len(line) > _LONGEST_LINE), None)
    if long:
        raise InputError(f"line {long}: is longer than {_LONGEST_LINE} characters")
    start = _START.match(text)
    assert start is not None  # all its parts may be empty
    separator = start["stated"] or next((s for s in ";\t" if s in _QUOTED.sub("", start["heads"])), ",")
    if separator not in ",;\t":
        raise InputError(f"line 1: sep={separator}: columns must be separated by commas, semicolons or tabs")
    records = _records(text[start.start("heads") :], text.count("\n", 0, start.start("heads")) + 1, separator)
    heads = next(records, (0, []))[1]
    if count * len(heads) > _MOST_CELLS:
        raise InputError(f"has {count} lines under {len(heads)} heads, more than {_MOST_CELLS} cells")
    rows, lines = _rows(heads, records, separator)
    columns = {head: list(cells) for head, cells in zip(heads, zip(*rows, strict=True), strict=True)}
    if not any(columns.get("", ())):
        columns.pop("", None)
    table = Table(file, columns, lines)
    return replace(table, columns=_typed(table, separator, texts))


def _records(text: str, line: int, separator: str) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of the heads and of each row; lines without values and comments are skipped."""
    begun = 0  # line where the row that is being read began: text in quotes may go over several

    def lines() -> Iterator[str]:
        nonlocal begun
        for n, content in enumerate(text.split("\n"), line):
            if begun or (content.strip(" ,;\t") and not content.lstrip().startswith("#")):
                begun = begun or n
                yield f"{content}\n"

    try:
        for cells in csv.reader(lines(), delimiter=separator, strict=True):
            yield begun, [cell.strip() for cell in cells]
            begun = 0
    except csv.Error as error:
        raise InputError(f"line {begun}: is not a row of values with separators between them ({error})") from None


def _rows(
    heads: Sequence[str], records: Iterator[tuple[int, list[str]]], separator: str
) -> tuple[list[list[str]], list[int]]:
    """The rows, each as long as the heads, and their lines."""
    if len(heads) > _MOST_COLUMNS:
        raise InputError(f"has {len(heads)} columns, more than {_MOST_COLUMNS}")
    double = [head for head, count in Counter(heads).items() if head and count > 1]
    if double:
        raise InputError(f"has two columns {double[0][:_SHOWN]!r}")
    rows: list[list[str]] = []
    lines: list[int] = []
    for line, row in records:
        while len(row) > len(heads) and not row[-1]:  # spreadsheets may end each row with more separators
            row.pop()
        if len(row) != len(heads):
            found, wanted = (f"{n} {what}{'s' * (n > 1)}" for n, what in ((len(row), "value"), (len(heads), "head")))
            said = f"line {line}: row {len(rows) + 1} has {found} under {wanted}"
            comma = len(row) > len(heads) and separator == ","
            raise InputError(said + ": numbers with decimal commas need semicolons or tabs between them" * comma)
        rows.append(row)
        lines.append(line)
    if not rows:
        raise InputError(f"{'' if heads else 'is empty: it '}must have a line of heads, and one line or more of values")
    for k, head in enumerate(heads):
        if not head and heads.count("") > 1 and any(row[k] for row in rows):
            raise InputError(f"column {k + 1} has values, but no head")
    return rows, lines


def _typed(table: Table, separator: str, texts: Collection[str]) -> dict[str, list[Any]]:
    """The columns of a table of texts, those of numbers read as such.

    Raises:
        InputError: if thousands are set apart, decimal marks differ, or one mark could be either.
    """
    numeric = {head: cells for head, cells in table.columns.items() if head not in texts and _are_numbers(cells)}
    marked: dict[str, tuple[int, str]] = {}  # where the first number with each decimal mark is
    told = separator == "," and not any("," in cell for cells in numeric.values() for cell in cells)
    for head, cells in numeric.items():
        for row, cell in enumerate(cells):
            mark = "." if "." in cell else "," if "," in cell else ""
            if cell and not _NUMBER.fullmatch(cell):
                raise InputError(f"{table.said(row, head)}: has marks between thousands: {_CURE}")
            if mark:
                marked.setdefault(mark, (row, head))
                told = told or not _EITHER.fullmatch(cell)  # the mark is not one between thousands
    if len(marked) > 1:
        points, commas = (table.said(*marked[mark]) for mark in ".,")
        raise InputError(f"{commas}: has a comma, but {points} has a point: {_CURE}")
    for mark, place in marked.items():
        if not told:
            raise InputError(
                f"{table.said(*place)}: may be in thousands or have three decimals, and no other number tells which: "
                f"leave the {'comma' if mark == ',' else 'point'} out, or write more or fewer decimals"
            )
    return {head: _numbers(table, head) if head in numeric else cells for head, cells in table.columns.items()}


def _are_numbers(cells: Sequence[str]) -> bool:
    """Whether a column has numbers, and no words: thousands set apart are no words."""
    others = [cell for cell in cells if not _NUMBER.fullmatch(cell)]
    return len(others) < len(cells) and all(not cell or _GROUPED.fullmatch(cell) for cell in others)


def _numbers(table: Table, head: str) -> list[int] | list[float]:
    """A column of numbers and empty cells; one that has both, or a number that is not whole, is one of floats."""
    found = []
    for row, cell in enumerate(table.columns[head]):
        try:
            found.append(read_number(cell.replace(",", ".")) if cell else math.nan)
        except ValueError as error:
            raise InputError(f"{table.said(row, head)}: {error}") from None
    return found if all(isinstance(number, int) for number in found) else [float(number) for number in found]
