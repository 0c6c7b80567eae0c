"""Spreadsheets as people keep them: each is read as it was meant, or refused with the cell and what helps."""

from __future__ import annotations

import datetime

import openpyxl
import pytest

from trainmj.errors import InputError
from trainmj.files.tables import TablePlace, read_beside
from trainmj.units import unit_of

HEADS = ["stroke_mm", "force_kN"]
GOOD = [HEADS, [0, 0], [50.5, 800.25], [300, 1000]]
READ = ([0, 50.5, 300], [0, 800.25, 1000])


def put(sheet, rows, top=1, left=1):
    """Cells from a corner on; None leaves one empty."""
    for r, row in enumerate(rows):
        for c, value in enumerate(row):
            if value is not None:
                sheet.cell(top + r, left + c, value)


def book(**sheets):
    """A workbook with rows by sheet."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for name, rows in sheets.items():
        put(made.create_sheet(name), rows)
    return made


def known(name):
    return unit_of(name) if name in HEADS else None


def read(folder, made, **place):
    if isinstance(made, openpyxl.Workbook):
        made.save(folder / "t.xlsx")
    else:
        (folder / "t.xlsx").write_bytes(made)
    table = read_beside(folder, TablePlace(file="t.xlsx", **place), "table = 't.xlsx'", known)
    assert "stroke_mm" in table.columns, list(table.columns)
    return table.numbers("stroke_mm"), table.numbers("force_kN")


def of(change, rows=GOOD, top=3, left=2):
    """A workbook with a table on the sheet coupler, from B3 on, and a change made to it."""
    made = openpyxl.Workbook()
    made.active.title = "coupler"
    put(made.active, rows, top, left)
    change(made.active)
    return made


def titled(s):
    s["A1"], s["A2"] = "Coupler, quasi-static test", "17.05.2023"


def noted(s):
    s["E3"], s["E4"], s["B9"] = "remark", "second test of three", "Source: report 17"


def numbered_note(s):
    s["E4"], s["F4"] = "mass of the car", 33


def gaps(s):
    put(s, [[400, 1000]], 8, 2)


def far_format(s):
    s.cell(1_048_576, 9).number_format = "0.00"


def hidden_sheet(s):
    put(s.parent.create_sheet("old"), GOOD)
    s.parent["old"].sheet_state = "hidden"


def with_notes_sheet(s):
    put(s.parent.create_sheet("notes"), [["Author", "N. N."], ["tested in", "Velim"]])


def formulas(s):
    s["D3"], s["D4"] = "energy", "=B4*C4"


def extended(s):
    put(s, [["remark"], ["rubber"], [None], ["tube"]], 3, 4)


def styled(s):
    s["C5"].number_format = '#,##0.0" kN"'
    s.auto_filter.ref = "B3:C6"
    s.freeze_panes = "A4"


def commented(s):
    from openpyxl.comments import Comment

    s["C5"].comment = Comment("checked", "me")


def dated_beside(s):
    put(s, [["when"], *[[datetime.date(2023, 5, n)] for n in (1, 2, 3)]], 3, 4)


def merged_title(s):
    s["B2"] = "Loading"
    s.merge_cells("B2:C2")


UNITS = [["Stroke", "Force"], ["[mm]", "[kN]"], *GOOD[1:]]
RIGHT = {
    "plain": (of(lambda s: None), {}),
    "title and date above": (of(titled), {}),
    "merged title right above the heads": (of(merged_title), {}),
    "notes beside and below": (of(noted), {}),
    "a single number beside": (of(numbered_note), {}),
    "cells formatted down to the last row": (of(far_format), {}),
    "an older version on a hidden sheet": (of(hidden_sheet), {}),
    "a sheet of notes": (of(with_notes_sheet), {}),
    "a column of formulas that is not read": (of(formulas), {}),
    "another column": (of(extended), {}),
    "a column of dates that is not read": (of(dated_beside), {}),
    "formats, filter, frozen panes": (of(styled), {}),
    "a comment": (of(commented), {}),
    "units below the heads": (of(lambda s: None, UNITS), {}),
    "units in the heads": (of(lambda s: None, [["Stroke\n[mm]", "Force (kN)"], *GOOD[1:]]), {}),
    "m and N": (of(lambda s: None, [["s [m]", "F [N]"], [0, 0], [0.0505, 800250], [0.3, 1e6]]), {}),
    "units stated": (of(lambda s: None, [["Stroke", "Force"], *GOOD[1:]]), {"units": {"stroke": "mm", "force": "kN"}}),
    "columns the other way round": (of(lambda s: None, [row[::-1] for row in GOOD]), {}),
    "a line without values": (of(lambda s: None, [GOOD[0], GOOD[1], [None, None], *GOOD[2:]]), {}),
    "capitals": (of(lambda s: None, [["STROKE_MM", "FORCE_KN"], *GOOD[1:]]), {}),
    "a range of two tables": (
        of(lambda s: put(s, [HEADS, [0, 0], [1, 9]], 3, 6)),
        {"sheet": "coupler", "range": "B3:C6"},
    ),
    "whole columns": (of(lambda s: put(s, [HEADS, [0, 0], [1, 9]], 3, 6)), {"range": "B:C"}),
    "a sheet of several": (book(a=[HEADS, [0, 0], [1, 9]], b=GOOD), {"sheet": "b"}),
}


@pytest.mark.parametrize(("made", "place"), RIGHT.values(), ids=RIGHT)
def test_habits_of_spreadsheets_are_read_as_they_were_meant(tmp_path, made, place):
    """Fails if one of the ways in which people keep a table is refused, or gives other numbers."""
    assert read(tmp_path, made, **place) == READ


def cell(at, value, form=None):
    def change(s):
        s[at] = value
        if form:
            s[at].number_format = form

    return of(change)


def hide_row(s):
    s.row_dimensions[5].hidden = True


def hide_column(s):
    s.column_dimensions["C"].hidden = True


def merge(at):
    return of(lambda s: s.merge_cells(at))


def two(s):
    put(s, [HEADS, [0, 0], [1, 9]], 3, 6)


WRONG = {
    "text in a number": (cell("C5", "ca. 800"), {}, "coupler!C5: force_kN = 'ca. 800': must be a number"),
    "a number as text": (cell("C5", "800.25"), {}, "coupler!C5: .* is text in the spreadsheet, not a number"),
    "a decimal comma as text": (cell("C5", "800,25"), {}, "coupler!C5: .* is text in the spreadsheet"),
    "a number with its unit": (cell("C5", "800 kN"), {}, "coupler!C5: force_kN = '800 kN': must be a number"),
    "a date": (cell("C5", datetime.datetime(2024, 5, 12)), {}, "coupler!C5: force_kN = '2024-05-12.*: is a date"),
    "a percentage": (cell("C5", 0.8, "0.0%"), {}, "coupler!C5: force_kN = '0.8': is shown in percent, as 80 %"),
    "true": (cell("C5", True), {}, "coupler!C5: force_kN = 'TRUE': is true or false, not a number"),
    "#REF!": (cell("C5", "#REF!"), {}, "coupler!C5: force_kN = '#REF!': is an error of the spreadsheet"),
    "#N/A": (cell("B5", "#N/A"), {}, "coupler!B5: stroke_mm = '#N/A': is an error"),
    "a formula that was never computed": (cell("C5", "=C4+800.25"), {}, "coupler!C5: .*'=C4.800.25': is a formula"),
    "an empty cell": (cell("C5", None), {}, "coupler!C5: force_kN = '': must be a number"),
    "a hidden row": (of(hide_row), {}, "coupler!5: the row is hidden, by hand or by a filter"),
    "a hidden column": (of(hide_column), {}, "coupler!C4: force_kN = '0': is in a hidden column, C"),
    "merged numbers": (
        merge("C4:C5"),
        {},
        "coupler!C5: force_kN = '.merged.': is merged: only the first cell of C4:C5",
    ),
    "a merged head": (of(lambda s: s.merge_cells("B3:C3")), {}, "coupler: the head B3:C3 is merged over several"),
    "two tables on a sheet": (of(two), {}, "coupler: has 2 tables: state range, one of B3:C6, F3:G5"),
    "tables on two sheets": (book(a=GOOD, b=GOOD), {}, "has tables on 2 sheets: state sheet, one of 'a', 'b'"),
    "no such sheet": (book(coupler=GOOD), {"sheet": "couplers"}, "has no sheet 'couplers'; did you mean 'coupler'?"),
    "heads twice": (book(a=[HEADS * 2, [0, 0, 0, 0]]), {}, "has two columns 'stroke_mm'"),
    "no heads": (book(a=GOOD[1:]), {}, "a: has no table: it must have a line of heads"),
    "a range without heads": (of(lambda s: None), {"range": "B4:C6"}, "coupler!B4:C6: must have a line of heads"),
    "an empty range": (of(lambda s: None), {"range": "H4:I6"}, "coupler!H4:I6: is empty"),
    "no range": (of(lambda s: None), {"range": "B4-C6"}, "coupler!B4-C6: range must be as in Excel"),
    "a sum below": (of(lambda s: put(s, [["largest", 1000]], 8, 2)), {}, "coupler!B8: stroke_mm = 'largest'"),
    "a unit that nobody knows": (
        book(a=[["Stroke [smoot]", "force_kN"], [0, 0]]),
        {},
        "a!A1: head .*: the unit 'smoot' is not known",
    ),
    "tons": (
        book(a=[["stroke_mm", "Force (ton)"], [0, 0]]),
        {},
        "a!B1: head .*: the unit 'ton' may mean several things: write t, short ton",
    ),
    "no unit": (book(a=[["Stroke", "force_kN"], [0, 0]]), {}, "a!A1: head 'Stroke': states no unit: write Stroke .mm."),
    "a force in kg": (
        book(a=[["stroke_mm", "Force [kg]"], [0, 0]]),
        {},
        "a!B1: head .*: is in kg, a mass, and must be a force",
    ),
    "two strokes": (
        book(a=[["Weg [mm]", "Hub [mm]", "force_kN"], [0, 0, 0]]),
        {},
        "a!B1: heads .* may both be stroke_mm: rename one",
    ),
    "nothing": (book(a=[]), {}, "a: has no table"),
}


@pytest.mark.parametrize(("made", "place", "said"), WRONG.values(), ids=WRONG)
def test_what_may_be_something_else_is_refused_with_its_cell(tmp_path, made, place, said):
    """Fails if a cell that is no plain number becomes one, or the message does not say which cell it is."""
    with pytest.raises(InputError, match=said):
        read(tmp_path, made, **place)
