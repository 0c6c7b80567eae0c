"""Spreadsheets (.xlsx, .xlsm): values as Excel last saved them, and where on a sheet the tables are.

Nothing in a workbook is run or followed: formulas are not computed, macros and links are not loaded.
"""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, datetime, time, timedelta
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from trainmj.errors import InputError, close_match
from trainmj.files.heads import Known, is_named
from trainmj.files.numbers import GROUPED, LARGEST, WRITTEN

if TYPE_CHECKING:
    from openpyxl.cell.cell import Cell, MergedCell
    from openpyxl.worksheet.worksheet import Worksheet

MOST_BYTES = 50_000_000
"""Of a workbook, unpacked."""

_MOST_CELLS = 300_000  # each takes openpyxl about 20 microseconds
_MOST_SPANNED = 100_000  # cells in merged ranges and links, each of which it makes
_MOST_FILES = 10_000
_MOST_COLUMNS = 1 << 14  # that a sheet has
_MOST_BLOCKS = 200
_MOST_ABOVE = 100  # rows among which heads are sought
_SHOWN = 30  # names and tables in a message
_SAVE = "save it as an Excel workbook (.xlsx)"
_OLE = b"\xd0\xcf\x11\xe0"
_RANGE = re.compile(r"\$?[A-Za-z]{1,3}\$?[0-9]{1,7}(:\$?[A-Za-z]{1,3}\$?[0-9]{1,7})?|\$?[A-Za-z]{1,3}:\$?[A-Za-z]{1,3}")
_FORMULA = re.compile(rb"<(?:\w+:)?f[\s/>]")
_CELL = re.compile(rb"<(?:\w+:)?c[\s/>]")
_SPANS = re.compile(rb"<(?:\w+:)?(?:mergeCell|hyperlink)\s[^>]*?\bref\s*=\s*[\"']([^\"']*)")
_SCALED = re.compile(r"[0#?],+(?![0#?,])")  # a format that shows thousands
_QUOTED = re.compile(r'"[^"]*"|\\.|\[[^\]]*\]')  # in a number format


class Flaw(str):
    """The text of a cell that cannot be used, and why."""

    rule: str

    def __new__(cls, text: str, rule: str) -> Flaw:
        """Text as it is shown, rule as a message ends."""
        made = super().__new__(cls, text)
        made.rule = rule
        return made


class Percent(float):
    """A number that is shown in percent: 0.5 as 50 %."""


class Box(NamedTuple):
    """A part of a sheet, both ends included, counted from 1."""

    top: int
    left: int
    bottom: int
    right: int

    def __str__(self) -> str:
        """As Excel writes it: ``B3:C20``."""
        return f"{letters(self.left)}{self.top}:{letters(self.right)}{self.bottom}"

    @property
    def cells(self) -> int:
        """How many cells it has."""
        return (self.bottom - self.top + 1) * (self.right - self.left + 1)

    def near(self, other: Box) -> bool:
        """Whether two parts overlap or touch."""
        beside = self.left <= other.right + 1 and other.left <= self.right + 1
        return beside and self.top <= other.bottom + 1 and other.top <= self.bottom + 1

    def above(self, other: Box) -> bool:
        """Whether another part is below this one, in some of its columns."""
        return self.bottom < other.top and self.left <= other.right and other.left <= self.right

    def around(self, other: Box) -> Box:
        """The smallest part that has both."""
        return Box(*map(min, self[:2], other[:2]), *map(max, self[2:], other[2:]))


@dataclass(frozen=True)
class Sheet:
    """The cells of a sheet that have something in them.

    Attributes:
        name: of the sheet.
        hidden: whether Excel shows it.
        cells: text, numbers and flaws by row and column.
        merged: the range in which a cell other than its first one is merged, by row and column.
        rows, columns: that are hidden.
    """

    name: str
    hidden: bool
    cells: Mapping[tuple[int, int], Any]
    merged: Mapping[tuple[int, int], str] = field(default_factory=dict)
    rows: frozenset[int] = frozenset()
    columns: frozenset[int] = frozenset()


class Grid(NamedTuple):
    """A table on a sheet: heads, and the rows below them."""

    sheet: str
    box: Box
    heads: list[str]
    letters: list[str]  # columns of the sheet, one for each head
    lines: list[int]  # rows of the sheet, one for each row of cells
    rows: list[list[Any]]


def letters(column: int) -> str:
    """The name of a column: C for 3."""
    text = ""
    while column:
        column, rest = divmod(column - 1, 26)
        text = chr(65 + rest) + text
    return text


def is_workbook(content: bytes, ending: str) -> bool:
    """Whether the content of a file is a workbook that can be read.

    Raises:
        InputError: if it is a workbook of another kind, or has the name of one and is none.
    """
    if content.startswith(_OLE):
        raise InputError(f"is an old Excel file (.xls), or has a password: {_SAVE}, without a password")
    if content.startswith(b"PK"):
        return True
    if ending in (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods"):
        raise InputError(f"has the name of a workbook, but is none: {_SAVE}, or name it .csv if it is text")
    return False


@lru_cache(maxsize=2)
def read_workbook(content: bytes) -> list[Sheet]:
    """The sheets of a workbook, kept for the next table that is read from it.

    Raises:
        InputError: if it is damaged, too large, or of another kind; or a formula has no value.
    """
    formulas = _checked(content)
    try:
        sheets = _loaded(content, values=True)
        if not sheets:
            raise InputError(f"has no sheets, or is a Strict Open XML file: {_SAVE}, not a strict one")
        if not formulas:
            return [_sheet(sheet, {}) for sheet in sheets]
        asked = [_cells(sheet) for sheet in _loaded(content, values=False)]
    except (InputError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - openpyxl lets any kind out, of what damaged files hold
        raise InputError(f"is damaged: openpyxl cannot read it ({type(error).__name__}): {_SAVE} again") from None
    return [
        _sheet(sheet, {at: cell.value for at, cell in cells.items() if cell.data_type == "f"})
        for sheet, cells in zip(sheets, asked, strict=True)
    ]


def _checked(content: bytes) -> bool:
    """Refuse what would take long or is none; whether there are formulas."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as file:
            parts = file.infolist()
            names = {part.filename for part in parts}
            if "mimetype" in names or "content.xml" in names:
                raise InputError(f"is an OpenDocument file (.ods): {_SAVE}")
            if "xl/workbook.bin" in names:
                raise InputError(f"is a binary workbook (.xlsb): {_SAVE}")
            if "[Content_Types].xml" not in names or not any(name.startswith("xl/") for name in names):
                raise InputError(f"is a packed file, but no Excel workbook: {_SAVE}")
            if len(parts) > _MOST_FILES or sum(part.file_size for part in parts) > MOST_BYTES:
                raise InputError(f"is larger than {MOST_BYTES / 1e6:g} MB when unpacked")
            formulas, cells, spanned = False, 0, 0
            for part in parts:
                if part.filename.lower().endswith((".xml", ".rels")):
                    text = file.read(part)
                    if b"<!DOCTYPE" in text or b"<!ENTITY" in text or text.startswith((b"\xff\xfe", b"\xfe\xff")):
                        raise InputError(f"is not as Excel writes it ({part.filename[:60]!a}): {_SAVE} again")
                    formulas = formulas or _FORMULA.search(text) is not None
                    cells += len(_CELL.findall(text))
                    spanned += sum(_spanned(found[1].decode("ascii", "replace")) for found in _SPANS.finditer(text))
    except (InputError, MemoryError):
        raise
    except Exception:  # noqa: BLE001 - zipfile and zlib let any kind out, of what damaged files hold
        raise InputError(f"is damaged, or has a password: {_SAVE} again, without a password") from None
    if cells > _MOST_CELLS:
        raise InputError(f"has {cells} cells, more than {_MOST_CELLS}: save long tables as CSV")
    if spanned > _MOST_SPANNED:
        raise InputError(f"has {spanned} cells in merged ranges and links, more than {_MOST_SPANNED}")
    return formulas


def _spanned(cells: str) -> int:
    """How many cells a range has."""
    return _box(cells).cells if _RANGE.fullmatch(cells) else 1 << 34


def _loaded(content: bytes, values: bool) -> list[Worksheet]:
    import openpyxl

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what it leaves out: validation, conditional formats, pictures
        book = openpyxl.load_workbook(io.BytesIO(content), data_only=values, keep_links=False)
    return list(book.worksheets)


def _cells(sheet: Worksheet) -> dict[tuple[int, int], Cell | MergedCell]:
    """The cells that are there, those of a format alone among them; iter_rows would make up all up to the last one."""
    return sheet._cells


def _sheet(sheet: Worksheet, formulas: Mapping[tuple[int, int], Any]) -> Sheet:
    cells: dict[tuple[int, int], Any] = {}
    for at, cell in _cells(sheet).items():
        value = _value(cell)
        if value == "" and at in formulas and cell.data_type != "str":  # whose value is empty text
            text = str(getattr(formulas[at], "text", formulas[at]))
            if not text.startswith("="):
                text = f"={text}"
            value = Flaw(text, "is a formula without a value: open the file in Excel or LibreOffice and save it there")
        if value != "":
            cells[at] = value
    merged: dict[tuple[int, int], str] = {}
    for one in sheet.merged_cells.ranges:
        if (one.max_row - one.min_row + 1) * (one.max_col - one.min_col + 1) <= _MOST_CELLS - len(merged):
            merged |= {at: one.coord for row in one.rows for at in row}
            merged.pop((one.min_row, one.min_col))
    return Sheet(
        sheet.title,
        sheet.sheet_state != "visible",
        cells,
        merged,
        frozenset(n for n, row in sheet.row_dimensions.items() if row.hidden),
        frozenset(
            column
            for one in sheet.column_dimensions.values()
            if one.hidden
            for column in range(one.min or 1, min(one.max or 0, _MOST_COLUMNS) + 1)
        ),
    )


def _value(cell: Cell | MergedCell) -> Any:
    """What is in a cell: text, "" if it is empty, a number, or a flaw."""
    value = cell.value
    if value is None:
        return ""
    if cell.data_type == "e":
        return Flaw(str(value), "is an error of the spreadsheet: mend it there")
    if isinstance(value, bool):
        return Flaw(str(value).upper(), "is true or false, not a number")
    if isinstance(value, (datetime, date, time, timedelta)):
        rule = "is a date or a time of the spreadsheet: enter it again, in a cell that is formatted as number or text"
        return Flaw(str(value), rule)
    if isinstance(value, (int, float)):
        if not abs(value) <= LARGEST:
            return Flaw(str(value)[:100], f"must be a finite number of at most {LARGEST:g}")
        form = _QUOTED.sub("", cell.number_format or "").partition(";")[0]
        if _SCALED.search(form):
            return Flaw(f"{value:.12g}", "is shown in thousands: format it as a plain number")
        return Percent(value) if "%" in form else value
    return str(value).replace("\xa0", " ").replace("_x000D_", "").strip()  # a line break, as Excel writes it


def chosen(sheets: Sequence[Sheet], name: str | None, known: Known | None) -> Sheet:
    """The sheet of a name, or the only one that holds a table.

    Raises:
        InputError: if there is none of the name, or several hold tables.
    """
    if name is not None:
        found = [s for s in sheets if s.name == name] or [s for s in sheets if s.name.strip().lower() == name.lower()]
        if len(found) != 1:
            raise InputError(f"has no sheet {name[:60]!r}{close_match(name, [s.name for s in sheets])}")
        return found[0]
    shown = [sheet for sheet in sheets if not sheet.hidden]
    if len(shown) == 1:
        return shown[0]
    holding = [sheet for sheet in shown if any(grid.heads for grid in tables_on(sheet, known))]
    if len(holding) > 1:
        names = ", ".join(repr(sheet.name) for sheet in holding[:_SHOWN])
        raise InputError(f"has tables on {len(holding)} sheets: state sheet, one of {names}")
    if not holding:
        names = ", ".join(repr(sheet.name) for sheet in sheets[:_SHOWN])
        raise InputError(f"has no table on a sheet that is shown, with a line of heads above numbers; sheets: {names}")
    return holding[0]


def table_in(sheet: Sheet, within: str | None, known: Known | None) -> Grid:
    """The table in a range of a sheet, or the only one on it.

    Raises:
        InputError: if there is none, there are several, or a row of it is hidden; the message begins with the place.
    """
    try:
        if within is not None:
            grid = _grid(sheet, _cut(sheet, within), known)
            if grid is None:
                raise InputError("must have a line of heads, and one line or more of values")
        else:
            grid = _only(sheet, tables_on(sheet, known), known)
    except InputError as error:
        raise InputError(f"{sheet.name}{f'!{within}' if within else ''}: {error}") from None
    if hidden := [n for n in grid.lines if n in sheet.rows]:
        raise InputError(f"{sheet.name}!{hidden[0]}: the row is hidden, by hand or by a filter: show it, or delete it")
    return grid


def _only(sheet: Sheet, found: Sequence[Grid], known: Known | None) -> Grid:
    if len(found) > 1:
        there = ", ".join(str(grid.box) for grid in found[:_SHOWN])
        without = " (not all with heads)" if not all(grid.heads for grid in found) else ""
        raise InputError(f"has {len(found)} tables{without}: state range, one of {there}")
    if found and found[0].heads:
        return found[0]
    grid = _grid(sheet, _around(sheet.cells), known) if sheet.cells else None  # of text only
    if grid is None:
        raise InputError("has no table: it must have a line of heads, and one line or more of values")
    return grid


def _cut(sheet: Sheet, within: str) -> Box:
    """A range as it is written, cut to what has something in it."""
    if not _RANGE.fullmatch(within):
        raise InputError("range must be cells as in B3:C20 or B:C; the sheet is stated by sheet")
    asked = _box(within)
    there = [at for at in sheet.cells if asked.top <= at[0] <= asked.bottom and asked.left <= at[1] <= asked.right]
    if not there:
        raise InputError("is empty")
    return _around(there)


def _box(cells: str) -> Box:
    from openpyxl.utils import range_boundaries

    left, top, right, bottom = range_boundaries(cells.upper())
    return Box(top or 1, left or 1, bottom or 1 << 20, right or _MOST_COLUMNS)


def _around(cells: Iterable[tuple[int, int]]) -> Box:
    rows, columns = zip(*cells, strict=True)
    return Box(min(rows), min(columns), max(rows), max(columns))


def tables_on(sheet: Sheet, known: Known | None = None) -> list[Grid]:
    """The tables of a sheet: blocks of cells with a line of heads above numbers, from the top.

    Rows that empty ones part from a table above them belong to it, unless they have heads of their own. Blocks of text
    are notes, and so are tables without a known head above or beside some that have one. Numbers without any head are
    listed, too, as they may belong to either.

    Args:
        sheet: to look at.
        known: the columns that the table may have.
    """
    boxes = _blocks(sheet)
    if sum(box.cells for box in boxes) > _MOST_CELLS:
        raise InputError(f"is too large: tables go up to {_MOST_CELLS} cells; state range")
    found: list[Box] = []
    for box in boxes:
        over = [n for n, above in enumerate(found) if above.left <= box.right and box.left <= above.right]
        if over and (not _leading(sheet, box) or _is_row_of_texts(sheet, box)):
            found[over[-1]] = found[over[-1]].around(box)
        else:
            found.append(box)
    grids = [_grid(sheet, box, known) or Grid(sheet.name, box, [], [], [], _rows(sheet, box)) for box in found]
    grids = [grid for grid in grids if _is_table(grid)]
    wanted = [grid for grid in grids if known is not None and any(is_named(head, known) for head in grid.heads)]
    doubtful = [grid for grid in grids if not grid.heads or any(one.box.above(grid.box) for one in wanted)]
    return [grid for grid in grids if grid in wanted or grid in doubtful] if wanted else grids


def _blocks(sheet: Sheet) -> list[Box]:
    """The parts of a sheet that empty cells part from each other, from the top."""
    runs: dict[int, list[Box]] = {}
    for row, column in sorted(sheet.cells):
        line = runs.setdefault(row, [])
        if line and line[-1].right + 1 >= column:
            line[-1] = line[-1]._replace(right=column)
        else:
            line.append(Box(row, column, row, column))
    blocks: list[Box] = []  # those that nothing can touch any more
    growing: list[Box] = []
    for row, line in runs.items():
        blocks += [box for box in growing if box.bottom < row - 1]
        growing = [box for box in growing if box.bottom >= row - 1]
        for run in line:
            growing = _joined(growing, run)
        if len(blocks) + len(growing) > _MOST_BLOCKS:
            raise InputError("has too many blocks of cells to tell tables from notes: state range")
    apart: list[Box] = []
    for box in (*blocks, *growing):
        apart = _joined(apart, box)
    return sorted(apart)


def _joined(boxes: Sequence[Box], box: Box) -> list[Box]:
    """Boxes with one more, which takes in those that it touches."""
    apart = list(boxes)
    while touching := [one for one in apart if one.near(box)]:
        apart = [one for one in apart if not one.near(box)]
        for one in touching:
            box = box.around(one)
    return [*apart, box]


def _row(sheet: Sheet, box: Box, row: int) -> list[Any]:
    return [sheet.cells.get((row, column), "") for column in range(box.left, box.right + 1)]


def _is_text(cell: Any) -> bool:
    """Whether a cell is text that is no number."""
    return (
        isinstance(cell, str)
        and not isinstance(cell, Flaw)
        and not (WRITTEN.fullmatch(cell) or GROUPED.fullmatch(cell))
    )


def _leading(sheet: Sheet, box: Box) -> list[int]:
    """The rows of text at the top of a block, among which its heads are."""
    rows: list[int] = []
    for row in range(box.top, min(box.top + _MOST_ABOVE, box.bottom + 1)):
        cells = [cell for cell in _row(sheet, box, row) if cell != ""]
        if not all(map(_is_text, cells)):
            break
        rows += [row] if cells else []
    return rows


def _is_row_of_texts(sheet: Sheet, box: Box) -> bool:
    """Whether a block has texts in several columns and nothing else: below a table it is a part of it and no note."""
    return box.right > box.left and all(_is_text(cell) for row in _rows(sheet, box) for cell in row if cell != "")


def _is_table(grid: Grid) -> bool:
    """Whether there are numbers; where there are no heads, several, and nothing else."""
    cells = [cell for row in grid.rows for cell in row if cell != ""]
    if grid.heads:
        return not all(map(_is_text, cells))
    return len(cells) > 1 and not any(isinstance(cell, str) for cell in cells)


def _rows(sheet: Sheet, box: Box) -> list[list[Any]]:
    return [_row(sheet, box, row) for row in range(box.top, box.bottom + 1)]


def _grid(sheet: Sheet, box: Box, known: Known | None) -> Grid | None:
    """The table in a block; None if it has no heads, or nothing below them."""
    if box.cells > _MOST_CELLS:
        raise InputError(f"has more than {_MOST_CELLS} cells from {box}")
    top = _top(sheet, box, known)
    if top is None:
        return None
    heads = [_head(cell) for cell in _row(sheet, box, top)]
    lines = [n for n in range(top + 1, box.bottom + 1) if any(cell != "" for cell in _row(sheet, box, n))]
    rows = [[_cell(sheet, n, column) for column in range(box.left, box.right + 1)] for n in lines]
    kept = [k for k, head in enumerate(heads) if head or any(row[k] != "" for row in rows)]
    for k in kept:
        if not heads[k] and (within := sheet.merged.get((top, box.left + k))):
            raise InputError(f"the head {within} is merged over several columns: give each column a head of its own")
    return Grid(
        sheet.name,
        Box(top, box.left, box.bottom, box.right),
        [heads[k] for k in kept],
        [letters(box.left + k) for k in kept],
        lines,
        [[row[k] for k in kept] for row in rows],
    )


def _top(sheet: Sheet, box: Box, known: Known | None) -> int | None:
    """The row of heads: of text and above others, that with most known heads, or else that with most; None if none is.

    Where no row of text at the top has a known head, it is the row below them that has most.
    """
    leading = _leading(sheet, box)
    if leading and leading[-1] == box.bottom:
        leading.pop()  # of text only, the last row of which is no head

    def fits(row: int) -> tuple[int, int, int]:
        heads = [_head(cell) for cell in _row(sheet, box, row) if _is_text(cell) and cell]
        return sum(known is not None and is_named(head, known) for head in heads), len(heads), -row

    best = max(leading, key=fits, default=None)
    if known is None or (best is not None and fits(best)[0]):
        return best
    below = max(range(box.top, min(box.top + _MOST_ABOVE, box.bottom)), key=fits, default=None)  # not the last row
    return below if below is not None and fits(below)[0] else best


def _head(cell: Any) -> str:
    return " ".join(str(cell).split())


def _cell(sheet: Sheet, row: int, column: int) -> Any:
    """A cell below the heads."""
    value = sheet.cells.get((row, column), "")
    if value != "" and column in sheet.columns:
        return Flaw(str(value), f"is in a hidden column, {letters(column)}: show it, or delete it")
    if value == "" and (range_ := sheet.merged.get((row, column))):
        return Flaw(
            "(merged)", f"is merged: only the first cell of {range_} has the value; unmerge them and fill each in"
        )
    return value
