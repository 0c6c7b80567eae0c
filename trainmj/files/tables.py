"""Tables: those that trainmj wrote as CSV, to the last digit, and those of other people.

Theirs are CSV files, sheets of a workbook, or curves in a keyword file; all are read here, by :func:`read_beside`.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import Field

from trainmj.errors import InputError, close_match
from trainmj.files.heads import Column, Known, exactly, factors_of, is_unit, read_heads, with_unit
from trainmj.files.keyword import curve_in, curves_in, is_deck
from trainmj.files.numbers import GROUPED, WRITTEN, read_number
from trainmj.files.parts import WHOLE, Either, Part
from trainmj.files.spreadsheet import Flaw, Percent, chosen, is_workbook, read_workbook, table_in, tables_on
from trainmj.files.text import HIDDEN, beside, decoded, read_bytes

if TYPE_CHECKING:
    import pandas as pd

_MOST_BYTES = 50_000_000
_MOST_BYTES_BACK = 500_000_000  # of a table that trainmj wrote
_MOST_CELLS = 1_000_000
_MOST_COLUMNS = 1000
_LONGEST_LINE = 1_000_000  # characters
_SHOWN = 60  # characters of a cell in a message
_ENDINGS = (".csv", ".xlsx", ".xlsm", ".k", ".key", ".txt")

_START = re.compile(  # a separator as Excel states it, blank lines and comments, the heads
    r'(?:"?sep=(?P<stated>.)"?[ \t]*\n)?(?:[ ,;\t]*\n|[ \t]*#[^\n]*\n)*(?P<heads>(?:[^"\n]+|"[^"]*")*)', re.IGNORECASE
)
_QUOTED = re.compile(r'"[^"]*"')
_EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")  # thousands, or three decimals
_CURE = "write numbers with one decimal mark, and no marks between thousands"


class TablePlace(Part):
    """Where a table is: a file, and the part of it that has the table."""

    file: str = Field(
        description="name of a CSV file, an Excel workbook (.xlsx), or, of curves, an LS-DYNA keyword file"
    )
    sheet: str | None = Field(default=None, description="sheet of a workbook; may be left out if only one has a table")
    range: str | None = Field(
        default=None, description="cells of the sheet with the heads, as in B3:C20; may be left out if it has one table"
    )
    id: Annotated[int, Field(ge=0), WHOLE] | None = Field(default=None, description="LCID of a curve in a keyword file")
    units: dict[str, str] = Field(
        default_factory=dict,
        max_length=100,
        description="units of columns whose heads state none, by head: { stroke: mm, force: N }; a keyword file needs "
        "them",
    )


OneTable = Annotated[str | TablePlace, Either(said="the name of a file, or a group with file, sheet and range")]


@dataclass(frozen=True)
class Table:
    """A table that somebody else wrote.

    Attributes:
        file: where it is.
        columns: cells by name, (n,) each: whole numbers, or numbers with nan where a cell is empty, or text; in the
            units of the names. Cells that cannot be used are text, of the kind Flaw.
        lines: of the file or sheet, where each row begins, (n,).
        sheet: of a workbook; empty if it is in a text file.
        letters: of the sheet's columns, by name.
        written: head and cells as they are in the file, by name, of columns with other heads.
        notes: how the table was read, where it could have been meant otherwise, in words.
    """

    file: Path
    columns: Mapping[str, list[Any]]
    lines: Sequence[int]
    sheet: str = ""
    letters: Mapping[str, str] = field(default_factory=dict)
    written: Mapping[str, tuple[str, list[Any]]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def note(self) -> str:
        """How it was read, if there is something to know, in a line that names it."""
        named = f"{self.file.name}, {self.sheet}" if self.sheet else self.file.name
        return f"{named}: {'; '.join(self.notes)}" if self.notes else ""

    def place(self, row: int, column: str = "") -> str:
        """Where a row or a cell is: ``line 7``, or ``coupler!C7`` on a sheet; the first row is 0 here."""
        if not self.sheet:
            return f"line {self.lines[row]}"
        return f"{self.sheet}!{self.letters.get(column, '')}{self.lines[row]}"

    def origin(self, row: int, column: str = "") -> str:
        """File and place: ``c.csv:7``, ``devices.xlsx: coupler!C7``."""
        return f"{self.file}: {self.place(row, column)}" if self.sheet else f"{self.file}:{self.lines[row]}"

    def said(self, row: int, column: str) -> str:
        """Place of a cell and what is in it, to begin a message with; the first row is 0 here, and said as 1."""
        head, cells = self.written.get(column, (column, self.columns[column]))
        cell = cells[row]
        text = ascii("" if cell != cell else str(cell) if isinstance(cell, Flaw) else cell)
        shown = f"{text[:_SHOWN]}{'...' * (len(text) > _SHOWN)}"
        return f"{self.place(row, column)}: {'' if self.sheet else f'row {row + 1}: '}{head[:_SHOWN]} = {shown}"

    def refusal(self, row: int, column: str, rule: str) -> InputError:
        """The error about a cell: that it breaks a rule, or cannot be used at all."""
        cell = self.columns[column][row]
        return InputError(f"{self.said(row, column)}: {cell.rule if isinstance(cell, Flaw) else rule}")

    def column(self, name: str) -> list[Any]:
        """The cells of a column, (n,).

        Raises:
            InputError: naming the first one that cannot be used.
        """
        for row, cell in enumerate(self.columns[name]):
            if isinstance(cell, Flaw):
                raise self.refusal(row, name, cell.rule)
        return self.columns[name]

    def numbers(self, name: str) -> list[float]:
        """A column of which every cell must be a number, (n,).

        Raises:
            InputError: naming the first cell that is not.
        """
        row = first_of_no_number(self.columns[name], empty=True)
        if row is not None:
            raise self.refusal(row, name, "must be a number")
        return [float(cell) for cell in self.columns[name]]


def first_of_no_number(cells: Sequence[Any], empty: bool = False) -> int | None:
    """Position of the first cell for which a column is text, or which is empty, if that counts; None if there is none.

    In a column of text, cells that are written as numbers are text too.
    """

    def wrong(cell: Any) -> bool:
        if isinstance(cell, Flaw):
            return True
        blank = cell == "" or cell != cell
        return empty if blank else isinstance(cell, str) and not WRITTEN.fullmatch(cell)

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


def read_beside(
    folder: Path,
    place: str | TablePlace,
    said: str,
    known: Known = lambda name: None,
    texts: Collection[str] = (),
    curve: Sequence[str] = (),
) -> Table:
    """The table that an input file names, in a file beside it, in folder, or below.

    Columns of a CSV file are separated by commas, semicolons or tabs, as the heads are, or as a line ``sep=;`` before
    them states. The decimal mark is a point or a comma. Separators in quotes are text. Lines that begin with # and
    lines without values are skipped, and so are columns with neither head nor values.

    Args:
        folder: of the file that names it.
        place: the file, or file, sheet, range and so on.
        said: begins the message of an error.
        known: the unit of each column that the table may have, by its name. A head may state the same in another unit,
            such as ``Stroke [m]`` for stroke_mm; the numbers are converted, and notes of the table say so.
        texts: names of columns that are text, whatever is in them.
        curve: names of the two columns that a curve of a keyword file stands for; none if it may be no such file.

    Raises:
        InputError: if there is no such file, the name leads out of the folder, it is not a table, a row is longer or
            shorter than the heads, or a number could be read in two ways.
    """
    place = TablePlace(file=place) if isinstance(place, str) else place
    path = beside(folder, place.file, said)
    if path is None:
        there = [path.name for ending in _ENDINGS for path in folder.glob(f"*{ending}")]
        raise InputError(f"{said}: there is no such file beside it{close_match(place.file, there)}")
    try:
        return _read(path, place, known, texts, curve)
    except InputError as error:
        raise InputError(f"{said}: {error}") from None


class Listed(NamedTuple):
    """A table of a file, as :func:`tables_in` lists it."""

    place: TablePlace  # reads it: by sheet and range, or the id of a curve
    heads: list[str]  # as they are written, with the units below them; none of a curve in a keyword file
    rows: int
    hidden: bool = False  # whether its sheet is


def tables_in(file: Path) -> list[Listed]:
    """The tables of a CSV file or a workbook, sheet by sheet, or the curves of a keyword file.

    Raises:
        InputError: if it is none of these, or damaged.
    """
    try:
        content = read_bytes(file, _MOST_BYTES)
        if is_workbook(content, file.suffix.lower()):
            return [
                Listed(
                    TablePlace(file=file.name, sheet=grid.sheet, range=str(grid.box)),
                    *_headed(grid.heads, grid.rows),
                    hidden=sheet.hidden,
                )
                for sheet in read_workbook(content)
                for grid in tables_on(sheet)
                if grid.heads
            ]
        text, _ = decoded(content)
        if is_deck(text):
            return [Listed(TablePlace(file=file.name, id=n), [], points) for n, points in curves_in(text)]
        found = _of_text(file, text)
        _check(found)
        return [Listed(TablePlace(file=file.name), *_headed(found.heads, found.rows))]
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _headed(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> tuple[list[str], int]:
    """Heads with the units below them, and how many rows come then."""
    if len(rows) > 1 and _is_of_units(rows):
        return [with_unit(head, str(unit)) for head, unit in zip(heads, rows[0], strict=True)], len(rows) - 1
    return list(heads), len(rows)


def _read(file: Path, place: TablePlace, known: Known, texts: Collection[str], curve: Sequence[str]) -> Table:
    """The table in a file; errors do not name it."""
    content = read_bytes(file, _MOST_BYTES)
    if is_workbook(content, file.suffix.lower()):
        _refuse(place, "an Excel workbook", "id")
        grid = table_in(chosen(read_workbook(content), place.sheet, known), place.range, known)
        found = _Found(file, grid.heads, grid.rows, grid.lines, grid.sheet, grid.letters, f"{grid.box.top}")
        return _made(found, place, known, texts)
    text, notes = decoded(content)
    if is_deck(text):
        _refuse(place, "a keyword file", "sheet", "range")
        return _of_deck(file, text, place, curve)
    _refuse(place, "a CSV file", "sheet", "range", "id")
    return _made(replace(_of_text(file, text), notes=notes), place, known, texts)


def _refuse(place: TablePlace, kind: str, *keys: str) -> None:
    if stated := [key for key in keys if getattr(place, key) is not None]:
        raise InputError(f"is {kind}, which has no {stated[0]}: leave {stated[0]} out")


def _of_deck(file: Path, text: str, place: TablePlace, names: Sequence[str]) -> Table:
    """A curve of a keyword file as a table."""
    if not names:
        raise InputError("is a keyword file, from which only curves are read: use a CSV file or a workbook")
    factors = factors_of(names, place.units)
    found = curve_in(text, place.id)
    columns = dict(zip(names, found.columns(factors), strict=True))
    said = ", ".join(f"{name} in {unit}" for name, unit in place.units.items())
    note = f"curve {found.id} is read{' with its scale factors and offsets' * found.scaled}: {said}"
    return Table(file, columns, found.lines, notes=(note,))


@dataclass(frozen=True)
class _Found:
    """A table as it was found: heads, and rows as long as these."""

    file: Path
    heads: Sequence[str]
    rows: Sequence[Sequence[Any]]  # text in text files; text, numbers and flaws on sheets
    lines: Sequence[int]
    sheet: str = ""
    letters: Sequence[str] = ()
    line: str = ""  # of the heads on a sheet
    separator: str = ""
    notes: tuple[str, ...] = ()


def _made(found: _Found, place: TablePlace, known: Known, texts: Collection[str]) -> Table:
    """The table with its columns by their names, numbers read as such, in the units of the names."""
    _check(found)
    heads, rows, lines = list(found.heads), list(found.rows), list(found.lines)
    if len(rows) > 1 and _is_of_units(rows):
        heads = [with_unit(head, unit) for head, unit in zip(heads, rows.pop(0), strict=True)]
        del lines[0]
    places = [f"{found.sheet}!{letter}{found.line}: " for letter in found.letters] or [""] * len(heads)
    meant = dict(zip(heads, read_heads(heads, places, known, place.units), strict=True))
    cells = {head: [row[k] for row in rows] for k, head in enumerate(heads)}
    if not any(cells.get("", ())):
        cells.pop("", None)
    table = Table(found.file, cells, lines, found.sheet, dict(zip(heads, found.letters, strict=False)))
    of_text = {head for head, column in meant.items() if column.name in texts}
    if found.sheet:
        typed = {head: _of_sheet(column, head in of_text, meant[head]) for head, column in cells.items()}
    else:
        typed = _typed(table, found.separator, of_text)
    return Table(
        found.file,
        {meant[head].name: _converted(column, meant[head].factor) for head, column in typed.items()},
        lines,
        found.sheet,
        {meant[head].name: letter for head, letter in table.letters.items()},
        {meant[head].name: (head, column) for head, column in typed.items() if meant[head].name != head},
        (*found.notes, *(note for head, column in meant.items() if (note := column.note(head)))),
    )


def _check(found: _Found) -> None:
    """Refuse heads that stand twice, columns without one, a table without rows, and one that is too large."""
    heads, rows = found.heads, found.rows
    if len(heads) > _MOST_COLUMNS:
        raise InputError(f"has {len(heads)} columns, more than {_MOST_COLUMNS}")
    if heads and all(WRITTEN.fullmatch(head) for head in heads):
        raise InputError("begins with numbers: it must have a line of heads above them")
    double = [head for head, count in Counter(heads).items() if head and count > 1]
    if double:
        raise InputError(f"has two columns {double[0][:_SHOWN]!r}")
    if not rows:
        raise InputError(f"{'' if heads else 'is empty: it '}must have a line of heads, and one line or more of values")
    for k, head in enumerate(heads):
        if not head and heads.count("") > 1 and any(row[k] != "" for row in rows):
            raise InputError(f"column {found.letters[k] if found.letters else k + 1} has values, but no head")
        numbers = [n for n, row in enumerate(rows) if found.sheet and not head and not isinstance(row[k], str)]
        if 0 < len(numbers) < len(rows):  # else it numbers the rows; text is a remark
            at = f"{found.sheet}!{found.letters[k]}{found.lines[numbers[0]]}"
            raise InputError(f"{at} = {rows[numbers[0]][k]}: has no head: give the column one, or state range")
    for cell in (*heads, *(cell for row in rows for cell in row)) if found.sheet else ():
        if isinstance(cell, str) and (hidden := HIDDEN.search(cell)):
            raise InputError(f"{found.sheet}: has the character {hidden[0]!a} in {str(cell)[:_SHOWN]!a}")


def _is_of_units(rows: Sequence[Sequence[Any]]) -> bool:
    """Whether the first row is a line of units: nothing but these, each above a column of numbers."""
    stated = {k: str(cell) for k, cell in enumerate(rows[0]) if cell != ""}
    units = [k for k, cell in stated.items() if cell.strip("[]()-")]

    def numbers(k: int) -> bool:
        below = [row[k] for row in rows[1:] if row[k] != ""]
        return bool(below) and all(not isinstance(cell, str) or bool(WRITTEN.fullmatch(cell)) for cell in below)

    return bool(units) and all(map(is_unit, stated.values())) and all(map(numbers, units))


def _of_sheet(cells: Sequence[Any], text: bool, meant: Column) -> list[Any]:
    """A column of a sheet: text, or numbers with nan where a cell is empty; of what is neither, each cell as it is."""
    if text:
        return [cell if isinstance(cell, str) else str(cell) for cell in cells]
    made = [_number_of(cell, meant) for cell in cells]
    filled = [cell for cell in made if cell != ""]
    if not filled or any(isinstance(cell, str) for cell in filled) or all(isinstance(cell, int) for cell in made):
        return made
    return [math.nan if cell == "" else float(cell) for cell in made]


def _number_of(cell: Any, meant: Column) -> Any:
    """A cell that is no text by its column; flawed if it shows something else than its value, or has it as text."""
    if isinstance(cell, Percent):
        if meant.known and not meant.unit and not meant.stated:
            return float(cell)
        return Flaw(f"{float(cell):.12g}", f"is shown in percent, as {100 * cell:.12g} %: format it as a number")
    if isinstance(cell, str) and not isinstance(cell, Flaw) and (WRITTEN.fullmatch(cell) or GROUPED.fullmatch(cell)):
        return Flaw(cell, "is text in the spreadsheet, not a number: enter it again in a cell formatted as number")
    return cell


def _converted(cells: list[Any], factor: Fraction) -> list[Any]:
    """Numbers in another unit; empty cells and text as they are."""
    if factor == 1:
        return cells
    return [cell if isinstance(cell, str) or cell != cell else exactly(cell, factor) for cell in cells]


def _of_text(file: Path, text: str) -> _Found:
    """The table in a text file."""
    text = text.replace("\r", "\n")
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
    if len(heads) > _MOST_COLUMNS or len(set(filter(None, heads))) < len([*filter(None, heads)]):
        return _Found(file, heads, (), (), separator=separator)  # is refused for these
    return _Found(file, heads, *_rows(heads, records, separator), separator=separator)


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
            if cell and not WRITTEN.fullmatch(cell):
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
    others = [cell for cell in cells if not WRITTEN.fullmatch(cell)]
    return len(others) < len(cells) and all(not cell or GROUPED.fullmatch(cell) for cell in others)


def _numbers(table: Table, head: str) -> list[int] | list[float]:
    """A column of numbers and empty cells; one that has both, or a number that is not whole, is one of floats."""
    found = []
    for row, cell in enumerate(table.columns[head]):
        try:
            found.append(read_number(cell.replace(",", ".")) if cell else math.nan)
        except ValueError as error:
            raise InputError(f"{table.said(row, head)}: {error}") from None
    return found if all(isinstance(number, int) for number in found) else [float(number) for number in found]
