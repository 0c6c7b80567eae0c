"""A result as an Excel workbook: what stands in the tables of a run, each sheet with its validity on top.

Cells hold 16 digits, one more than Excel keeps; formats show those that are worth reading.
"""

from __future__ import annotations

import io
import math
import re
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from trainmj.collision.quantities import BALANCE, COLLISION, of_train
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.exchange.tables import tables, validity
from trainmj.files.text import printable
from trainmj.output.table import Verdict
from trainmj.scenario import to_yaml
from trainmj.single.tables import checks, why_not_valid
from trainmj.units import unit_of, words

_MOST_ROWS, _MOST_COLUMNS, _MOST_CELLS = 1_048_576, 16_384, 3_000_000
_LONGEST = 32_767  # characters of a cell
_WIDEST, _NARROWEST = 60, 9  # of a column, in characters
_A4 = 9  # of the paper sizes that Excel knows
_DATE = datetime(1980, 1, 1)  # of the files within, the earliest that a zip can state: equal results give equal files

_DIGITS = {"mm": 1, "kN": 1, "kJ": 2, "t": 3, "km/h": 2, "g": 4, "s": 4, "m": 3, "m/s": 2, "mrad": 2, "kN m": 1}
"""Decimals that are shown, by unit."""

_TITLES = {
    "interfaces": "At the front: one train's side. From the front backwards, the moving train first.",
    "stages": "The parts of each device and the energy that each absorbed. The limits are the devices' own.",
    "vehicles": "From the front backwards, the moving train first.",
    "bodies": "Members and points of car bodies that give, from the end that faces the impact.",
    "wheelsets": "From the end that faces the impact.",
    "histories": "Over time; where a row is not valid, valid is 0. Both sides of the front, the partner's named so.",
}


@dataclass
class _Sheet:
    """A sheet: heads with their formats, then rows."""

    name: str
    note: str
    heads: Sequence[str]
    rows: Sequence[Sequence[Any]]
    formats: Sequence[str] = ()
    frozen: int = 1  # columns that stay in sight
    units: bool = False  # whether the heads end in units, and may be broken into lines


def write(result: Result, summary: Summary) -> bytes:
    """The workbook.

    Raises:
        InputError: if a table is too long or too wide for a spreadsheet.
    """
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    scenario = result.scenario
    mark = f"{scenario.heading}: {scenario.subject}. {summary.status}; {validity(summary)}."
    for sheet in _sheets(result, summary):
        _add(book, sheet, mark, bool(summary.status.unusable))
    book.properties.creator, book.properties.title = "trainmj", scenario.heading
    book.properties.created = _DATE
    content = io.BytesIO()
    book.save(content)
    return _undated(content.getvalue())


def _sheets(result: Result, summary: Summary) -> Iterator[_Sheet]:
    yield _Sheet("Summary", _why(summary), ("Quantity", "Value", "Unit", "Meaning"), list(_summary(result, summary)))
    yield _limits(summary)
    found = tables(result, summary)
    histories = found.pop("histories")
    for name in sorted(found, key=list(_TITLES).index):
        yield _of_table(name, found[name])
    yield _energy(summary)
    yield _checks(result, summary)
    yield _of_table("histories", histories)
    lines = to_yaml(result.scenario).splitlines()
    yield _Sheet(
        "Scenario", "What was collided, as a scenario file has it.", ("scenario.yaml",), [[n] for n in lines], frozen=0
    )


def _why(summary: Summary) -> str:
    if summary.not_valid:
        return f"{summary.not_valid.upper()}: {why_not_valid(summary)}"
    return "Results are for engineering comparison. No compliance with a standard is claimed."


def _summary(result: Result, summary: Summary) -> Iterator[tuple[Any, ...]]:
    """Status, criteria, what there is to know, and what computed it."""
    yield "Status", str(summary.status), "", "how the collision ended"
    yield "Valid", not summary.status.unusable, "", validity(summary)
    for q in (*of_train(result.chain), *COLLISION):
        yield q.heading.replace("\n", " "), _Shown(summary.values[q.name], _decimals(q.digits)), q.unit, q.meaning
    for remark in summary.remarks:
        yield "Remark", "", "", remark
    for name, version in result.versions.items():
        yield f"Version of {name}", version, "", ""


def _limits(summary: Summary) -> _Sheet:
    heads = ("Limit", "at", "found", "allowed", "unit", "used [%]", "verdict", "source")
    rows = [
        (
            c.title,
            c.where,
            _Shown(c.found, _decimals(c.digits)),
            c.limit,
            c.unit,
            _Shown(c.used, "0.0"),
            _verdict(c.kept, c.valid),
            c.source,
        )
        for c in summary.limits
    ]
    note = "Limits of the scenario for the moving train, and the strokes that devices allow."
    return _Sheet("Limits", note, heads, rows or [("none is stated", *[""] * 7)])


def _verdict(kept: bool, valid: bool) -> Verdict:
    return Verdict("pass" if kept else "fail", "kept" if kept else "NOT KEPT" if valid else "NOT VALID")


def _of_table(name: str, table: Any) -> _Sheet:
    """A pandas table whose heads end in units."""
    heads = [f"{words(head)} [{unit}]" if (unit := unit_of(head)) else words(head) for head in table.columns]
    formats = [_decimals(_DIGITS[unit]) if (unit := unit_of(head)) in _DIGITS else "General" for head in table.columns]
    rows = list(zip(*(table[head].tolist() for head in table.columns), strict=True))
    return _Sheet(name.capitalize(), _TITLES[name], heads, rows, formats, 3 if name == "stages" else 1, units=True)


def _energy(summary: Summary) -> _Sheet:
    values = summary.balance.values
    start = values["kinetic_start_kJ"]
    rows = [
        (q.heading.replace("\n", " "), _Shown(values[q.name], "0.0"), _Shown(100 * values[q.name] / start, "0.00"))
        for q in BALANCE
        if q.name in values and q.unit == "kJ"
    ]
    return _Sheet("Energy", "Where the kinetic energy went.", ("Energy", "[kJ]", "share [%]"), rows)


def _checks(result: Result, summary: Summary) -> _Sheet:
    table = checks(result, summary)
    return _Sheet("Checks", table.note, [column.name for column in table.columns], list(table.rows))


@dataclass(frozen=True)
class _Shown:
    """A number with a format of its own."""

    value: float
    form: str


def _decimals(digits: int) -> str:
    """The format of numbers with so many decimals or, if negative, significant digits."""
    return f"0.{'0' * digits}".rstrip(".") if digits >= 0 else f"0.{'0' * (-digits - 1)}E+00".replace(".E", "E")


def _add(book: Any, sheet: _Sheet, mark: str, unusable: bool) -> None:
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Alignment, Font, PatternFill
    from openpyxl.utils import get_column_letter

    n_rows, n_columns = len(sheet.rows) + 3, len(sheet.heads)
    if n_rows > _MOST_ROWS or n_columns > _MOST_COLUMNS or n_rows * n_columns > _MOST_CELLS:
        raise InputError(
            f"{sheet.name} has {n_rows} rows and {n_columns} columns, too many for a spreadsheet: take csv"
        )
    page = book.create_sheet(sheet.name)
    page.freeze_panes = f"{get_column_letter(sheet.frozen + 1)}4"
    page.sheet_view.showGridLines = False
    page.sheet_properties.tabColor = "C00000" if unusable else "1F3864"
    if sheet.units:
        page.auto_filter.ref = f"A3:{get_column_letter(n_columns)}{n_rows}"
    page.page_setup.orientation, page.page_setup.paperSize = "landscape", _A4
    page.page_setup.fitToWidth, page.page_setup.fitToHeight = 1, 0
    page.sheet_properties.pageSetUpPr.fitToPage = True
    page.print_title_rows = "1:3"
    page.row_dimensions[1].height = 20
    page.row_dimensions[3].height = 45 if sheet.units else 20
    for k, width in enumerate(_widths(sheet), start=1):
        page.column_dimensions[get_column_letter(k)].width = width
    bold, white = Font(bold=True, size=12), Font(bold=True, color="FFFFFF")
    bad, good, head = (PatternFill("solid", fgColor=c) for c in ("C00000", "C6E0B4", "1F3864"))
    wrap = Alignment(wrap_text=True, vertical="center")
    top = Alignment(vertical="top", wrap_text=True) if sheet.name == "Summary" else None

    def cell(value: Any, form: str = "General") -> Any:
        if isinstance(value, _Shown):
            value, form = value.value, value.form
        verdict = value if isinstance(value, Verdict) else None
        if verdict is not None:
            value = verdict.text
        if isinstance(value, float) and not math.isfinite(value):
            value = None
        if isinstance(value, str):
            value = printable(value)[:_LONGEST]
        made = WriteOnlyCell(page, value)
        if isinstance(value, str):
            made.data_type = "s"  # whatever it begins with, it is no formula
        elif value is not None:
            made.number_format = form
        if top is not None:
            made.alignment = top
        if verdict is not None and verdict.kind in ("pass", "fail"):
            made.fill, made.font = (bad, white) if verdict.kind == "fail" else (good, Font(bold=True))
        return made

    title, note = cell(mark), cell(sheet.note)
    for one in (title, note):
        one.alignment = Alignment(wrap_text=False, vertical="center")
    title.font, note.font = bold, Font(italic=True, color="595959")
    if unusable:
        title.font, title.fill = Font(bold=True, size=12, color="FFFFFF"), bad
    page.append([title])
    page.append([note])
    heads = [cell(text) for text in sheet.heads]
    for one in heads:
        one.font, one.fill, one.alignment = white, head, wrap
    page.append(heads)
    forms = sheet.formats or ["General"] * n_columns
    for row in sheet.rows:
        page.append([cell(value, form) for value, form in zip(row, forms, strict=True)])


def _widths(sheet: _Sheet) -> Iterator[float]:
    """Width of each column by its longest cell; a head may be broken between words."""
    columns: Iterable[Sequence[Any]] = zip(*sheet.rows[:200], strict=True) if sheet.rows else [()] * len(sheet.heads)
    for head, cells in zip(sheet.heads, columns, strict=True):
        texts = [value.text if isinstance(value, Verdict) else value for value in cells]
        longest = max([len(text) for text in texts if isinstance(text, str)], default=0)
        words_of_head = max(len(word) for word in [*head.split(), ""]) if sheet.units else len(head)
        yield float(min(_WIDEST, max(_NARROWEST, longest + 2, words_of_head + 4)))


def _undated(content: bytes) -> bytes:
    """A workbook without the time at which it was written, so that equal results give equal files."""
    found = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(found, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            part = old.read(name)
            if name == "docProps/core.xml":
                part = re.sub(rb"(<dcterms:modified[^>]*>)[^<]*", rb"\g<1>1980-01-01T00:00:00Z", part)
            info = zipfile.ZipInfo(name, _DATE.timetuple()[:6])
            info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            new.writestr(info, part)
    return found.getvalue()
