"""Spreadsheets as people keep them: each is read as it was meant, or refused with the cell and what helps."""

from __future__ import annotations

import datetime
import io
import zipfile

import openpyxl
import pytest

import trainmj
from trainmj.errors import InputError
from trainmj.files.tables import TablePlace, read_beside, tables_in
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


def cell(at, value, form=None):
    def change(s):
        s[at] = value
        if form:
            s[at].number_format = form

    return of(change)


def packed(**parts):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as made:
        for name, text in parts.items():
            made.writestr(name, text)
    return file.getvalue()


def with_part(change, name="xl/worksheets/sheet1.xml"):
    """A good workbook of which one part is changed."""
    file = io.BytesIO()
    of(lambda s: None).save(file)
    with zipfile.ZipFile(file) as good:
        parts = {part: good.read(part) for part in good.namelist()}
    return packed(**parts | {name: change(parts[name])})


RIGHT |= {
    "formulas with their values": (
        with_part(lambda xml: xml.replace(b"<v>800.25</v>", b"<f>C4+800.25</f><v>800.25</v>")),
        {},
    ),
    "formulas filled down that show nothing": (
        with_part(
            lambda xml: xml.replace(
                b"</sheetData>", b'<row r="7"><c r="B7" t="str"><f>IF(A7="","",A7)</f><v></v></c></row></sheetData>'
            )
        ),
        {},
    ),
    "a cell that is formatted as kN": (of(lambda s: setattr(s["C5"], "number_format", '_-* #,##0.00" kN"_-')), {}),
    "an unnamed index, as pandas writes it": (of(lambda s: put(s, [[0], [1], [2]], 4, 1)), {}),
    "sheets that are empty": (book(Sheet1=GOOD, Sheet2=[], Sheet3=[]), {}),
    "what it is of, right above": (of(lambda s: None, [["mass, t", 33], ["Force", "of the head"], *GOOD]), {}),
    "other tables without such heads": (of(lambda s: put(s, [["when", "who"], [2023, "N. N."]], 10, 6)), {}),
    "a number among the heads": (of(lambda s: None, [[*row, 2023] for row in GOOD]), {}),
    "a remark without a head": (cell("D5", "here it buckles"), {}),
    "a break in a head": (of(lambda s: None, [["Stroke_x000D_\n[mm]", "Kraft in kN"], *GOOD[1:]]), {}),
}


@pytest.mark.parametrize(("made", "place"), RIGHT.values(), ids=RIGHT)
def test_habits_of_spreadsheets_are_read_as_they_were_meant(tmp_path, made, place):
    """Fails if one of the ways in which people keep a table is refused, or gives other numbers."""
    assert read(tmp_path, made, **place) == READ


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
    "thousands": (cell("C5", 800250, "#,##0.0,"), {}, "coupler!C5: force_kN = '800250': is shown in thousands"),
    "a table on its side": (
        book(a=[list(column) for column in zip(*GOOD, strict=True)]),
        {},
        "a!A2: stroke_mm = 'force_kN': must",
    ),
    "heads again on the next page": (of(lambda s: put(s, GOOD, 7, 2)), {}, "coupler!B7: stroke_mm = 'stroke_mm': must"),
    "units that disagree": (book(a=[HEADS, ["mm", "N"], [0, 0]]), {}, "a!B1: .* states two units, kN and N"),
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
    "a row that is longer": (cell("D5", 5), {}, "coupler!D5 = 5: has no head: give the column one, or state range"),
    "more of it below a line of text": (
        of(lambda s: put(s, [["plateau"], [400], [500]], 8, 2)),
        {},
        "coupler: has 2 tables: state range, one of B3:C6, B8:B10",
    ),
    "more of it below, wider": (
        of(lambda s: put(s, [[400, 1e3, "torn"], ["x", 1, 2]], 8, 2)),
        {},
        "coupler!D9 = 2: has no head",
    ),
    "more of it beside, without heads": (
        of(lambda s: put(s, [[400, 1000], [500, 1100]], 4, 6)),
        {},
        r"coupler: has 2 tables .not all with heads.: state range, one of B3:C6, F4:G5",
    ),
    "an empty range": (of(lambda s: None), {"range": "H4:I6"}, "coupler!H4:I6: is empty"),
    "no range": (of(lambda s: None), {"range": "B4-C6"}, "coupler!B4-C6: range must be cells as in"),
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


MINE = """
title: mine
devices:
  head: { curve: { file: CURVE }, stiffness_kN_per_mm: 200, beyond: hold }
trains: { car: { vehicles: 2, mass_t: 33, front: head, coupler: head } }
collision: { train: car, speed_km_h: 10, partner: car }
"""


def mine(folder, curve):
    (folder / "s.yaml").write_text(MINE.replace("CURVE", curve))
    return trainmj.load(folder / "s.yaml")


def test_the_same_values_make_the_same_collision_to_the_last_bit(tmp_path):
    """Fails if a workbook, a keyword file or other units give other numbers than the CSV file with the same values."""
    points = [(0, 0), (35.7, 612.3), (73.1, 800.30000000000007), (300, 1e3)]
    (tmp_path / "c.csv").write_text("stroke_mm,force_kN\n" + "".join(f"{s!r},{f!r}\n" for s, f in points))
    of(lambda s: None, [HEADS, *points]).save(tmp_path / "c.xlsx")
    cards = "".join(f"{s!r:>20}{f!r:>20}\n" for s, f in points)
    (tmp_path / "c.k").write_text(f"*KEYWORD\n*DEFINE_CURVE\n{7:10}\n{cards}*END\n")
    (tmp_path / "n.csv").write_text("Weg [m];Kraft [N]\n0;0\n0,0357;612300\n0,0731;800300,00000000007\n0,3;1e6\n")
    places = ["c.csv", "c.xlsx, sheet: coupler, range: B3:C7", "c.k, units: {stroke: mm, force: kN}", "n.csv"]
    found = [trainmj.summarise(trainmj.run(mine(tmp_path, place))) for place in places]
    assert [each.responses for each in found[1:]] == [found[0].responses] * 3


def test_what_was_converted_is_said_and_stays_with_the_scenario(tmp_path):
    """Fails if nobody could see later that numbers were multiplied when they were read."""
    of(lambda s: None, [["s [m]", "F [N]"], [0, 0], [0.3, 1e6]]).save(tmp_path / "c.xlsx")
    scenario = mine(tmp_path, "c.xlsx")
    note = "c.xlsx, coupler: 's [m]' is stroke_mm, multiplied by 1000; 'F [N]' is force_kN, multiplied by 0.001"
    assert scenario.told == (f"devices.head.curve: {note}",)
    again = trainmj.scenario.from_yaml(trainmj.scenario.to_yaml(scenario))
    assert again.sources["devices.head.curve"].source == note
    assert again.devices["head"].curve.stroke_mm == [0, 300]


def test_a_value_that_breaks_a_rule_is_traced_to_its_cell(tmp_path):
    """Fails if the message of a rule does not say which cell of which sheet the number is from."""
    of(lambda s: None, [HEADS, [0, 0], [50, 800], [40, 900]]).save(tmp_path / "c.xlsx")
    with pytest.raises(InputError, match=r"c\.xlsx: coupler!B6: point 3: .*stroke_mm\.2 = 40"):
        mine(tmp_path, "c.xlsx")


def vehicles(folder, rows):
    book(train=rows).save(folder / "v.xlsx")
    text = MINE.replace("vehicles: 2, mass_t: 33", "vehicles: { file: v.xlsx }").replace("file: CURVE", "file: c.csv")
    (folder / "c.csv").write_text("stroke_mm,force_kN\n0,0\n300,1000\n")
    (folder / "s.yaml").write_text(text)
    return trainmj.load(folder / "s.yaml").trains["car"]


def test_a_share_may_be_shown_in_percent(tmp_path):
    """Fails if 50 % of the seats, which is what the cell shows and 0.5 what it holds, are read as something else."""
    made = of(lambda s: setattr(s["C4"], "number_format", "0%"), [["name", "share"], ["A", 0.5]])
    made.save(tmp_path / "t.xlsx")
    units = {"name": "", "share": ""}
    assert read_beside(tmp_path, "t.xlsx", "t", units.get, ["name"]).columns == {"name": ["A"], "share": [0.5]}


def test_masses_and_loads_of_vehicles_come_from_a_sheet(tmp_path):
    """Fails if masses, units or passengers of a table are not those of the vehicles."""
    head = ["Name", "Mass [kg]", "Length [ft]", "seats", "Share [%]", "kg", "Freight [kg]"]
    train = vehicles(tmp_path, [head, ["1", 33000, 65.6, 60, 50, 80, None], [2, 30000, None, None, None, None, 500]])
    assert [(car.name, car.mass_t, car.length_m) for car in train.cars()] == [
        ("1", 35.4, 19.99488),
        ("2", 30.5, 20),
    ]


VEHICLES = {
    "a sum": ([["name", "mass_t"], ["A", 33], [None, None], ["Total", 66]], "train!A4: name = 'Total': is a sum"),
    "merged": ([["name", "mass_t", "coupler"], ["A", 33, "head"], ["B", 33, None]], "train!C3: coupler = '.merged.'"),
    "a date": ([["name", "mass_t"], [datetime.date(2024, 1, 2), 33]], "train!A2: name = '2024-01-02.*is a date"),
    "two units": ([["name", "mass_t"], [None, "[kg]"], ["A", 33]], "states two units, t and kg"),
}


@pytest.mark.parametrize(("rows", "said"), VEHICLES.values(), ids=VEHICLES)
def test_rows_that_are_no_vehicles_are_refused(tmp_path, rows, said):
    """Fails if a sum, a merged cell or a date becomes a vehicle or leaves something out."""
    made = book(train=rows)
    if "merged" in said:
        made["train"].merge_cells("C2:C3")
    real, openpyxl.Workbook.save = openpyxl.Workbook.save, lambda self, path: real(made, path)
    try:
        with pytest.raises(InputError, match=said):
            vehicles(tmp_path, rows)
    finally:
        openpyxl.Workbook.save = real


def test_cases_points_and_records_come_from_sheets_in_their_units(tmp_path):
    """Fails if a table of cases, points or measured values is read from a workbook by other rules than a curve."""
    made = book(
        cases=[["Mass [kg]", "speed [mph]"], [33000, 10], [30000, 20]],
        points=[["D [m]", "M"], [0.02, 30], [0.05, 36]],
        tests=[["mass_kg", "Stroke [m]"], [33000, 0.0731], [30000, 0.05]],
    )
    made.save(tmp_path / "t.xlsx")
    sweep = trainmj.sweep_of({"scenario": "b_type", "table": {"file": "t.xlsx", "sheet": "cases"}}, tmp_path)
    assert [sweep.case(n) for n in range(2)] == [
        {"mass_t": 33, "speed_km_h": 16.09344},
        {"mass_t": 30, "speed_km_h": 32.18688},
    ]
    assert "'Mass [kg]' is mass_t, multiplied by 0.001" in sweep.told[0]
    factors = {"D": {"sets": "empty_stroke_mm", "bounds": [20, 50]}, "M": {"sets": "mass_t", "bounds": [30, 36]}}
    design = {"kind": "table", "file": "t.xlsx", "sheet": "points"}
    values = {"scenario": "b_type", "factors": factors, "responses": {"TS": "TS_mm"}, "design": design}
    study = trainmj.study_of({**values, "objectives": {"TS": "minimise"}}, tmp_path)
    assert study.given == [[20, 30], [50, 36]]
    data = {
        "table": {"file": "t.xlsx", "sheet": "tests"},
        "cases": {"mass_kg": "mass_t"},
        "values": {"S": "Stroke [m]"},
    }
    values = {
        "scenario": "b_type",
        "parameters": {"K": {"sets": "devices.front.stiffness_kN_per_mm", "bounds": [500, 2000]}},
        "targets": {"S": {"response": "stroke_M1_M2_mm", "tolerance": 1}},
        "data": {"x": data},
    }
    plan = trainmj.targets_of(values, tmp_path)
    assert [case["mass_t"] for case in plan.fitted.cases] == [33, 30]
    assert plan.fitted.wanted.tolist() == [73.1, 50]
    assert plan.source.told == (
        "x: 'mass_kg' is mass_t, multiplied by 0.001",
        "'Stroke [m]' is S, multiplied by 1000",
    )


# keyword files


def deck(folder, text, **place):
    (folder / "t.k").write_text(text)
    at = TablePlace(file="t.k", **{"units": {"stroke": "mm", "force": "kN"}, **place})
    table = read_beside(folder, at, "t", known, curve=HEADS)
    return table.columns["stroke_mm"], table.columns["force_kN"]


CURVE = (
    "*KEYWORD\n$ comment\n*DEFINE_CURVE_TITLE\n\n{card}\n{points}*NODE\n       1       0.0       0.0       0.0\n*END\n"
)
POINTS = "                 0.0                 0.0\n$#\n              0.0505              800250\n"
DECKS = {
    "columns": (f"{101:10}{0:10}", POINTS, ([0, 0.0505], [0, 800250])),
    "scaled after the offset": (
        f"{101:10}{0:10}{2.0:10}{0.001:10}{1:10}{-50:10}",
        POINTS,
        ([2, 2.101], [-0.05, 800.2]),
    ),
    "commas": ("101, 0, 1000., , , ", "0,0\n5.05D-2,8.0025+5\n", ([0, 50.5], [0, 800250])),
    "zero stands for one": ("101,0,0,0,0,0", "0.,0.\n1.,2.\n", ([0, 1], [0, 2])),
}


@pytest.mark.parametrize(("card", "points", "right"), DECKS.values(), ids=DECKS)
def test_curves_of_keyword_files_are_those_that_ls_dyna_reads(tmp_path, card, points, right):
    """Fails if columns, commas, Fortran exponents, scale factors or offsets are read in another way."""
    assert deck(tmp_path, CURVE.format(card=card, points=points)) == right


def test_long_format_and_units_of_keyword_files(tmp_path):
    """Fails if a long card is cut in the wrong columns, or the stated units are not used."""
    text = f"*KEYWORD LONG=Y\n*DEFINE_CURVE\n{101:20}{0:20}{1000.0:20}\n{POINTS}"
    assert deck(tmp_path, text, units={"stroke": "mm", "force": "N"}) == ([0, 50.5], [0, 800.25])
    text = f"*KEYWORD\n*DEFINE_CURVE+\n{101:20}{0:20}{1000.0:20}\n{POINTS}"
    assert deck(tmp_path, text, units={"stroke": "mm", "force": "N"}) == ([0, 50.5], [0, 800.25])


ONE = CURVE.format(card="101,0", points=POINTS)
BAD_DECKS = {
    "no units": (ONE, {"units": {}}, "has no units of its own: state that of stroke, as in units: { stroke: mm"),
    "no such curve": (ONE, {"id": 102}, "has no curve with id 102; did you mean '101'"),
    "several": (ONE.replace("*NODE", "*DEFINE_CURVE\n7\n1,2\n*NODE"), {}, "has 2 curves: state id, one of 101, 7"),
    "twice": (
        ONE.replace("*NODE", "*DEFINE_CURVE\n101\n1,2\n*NODE"),
        {"id": 101},
        "two curves with id 101, in lines 3",
    ),
    "a parameter": (ONE.replace("800250", " &fmax"), {}, "line 8: O1 = '&fmax': is a parameter"),
    "a word": (ONE.replace("800250", "   x12"), {}, "line 8: O1 = 'x12': must be a number"),
    "shifted columns": (CURVE.format(card="101", points="     0.0       0.0\n"), {}, "line 6: .* must be two numbers"),
    "no points": (CURVE.format(card="101", points=""), {}, "line 3: the curve has no points"),
    "another type": (CURVE.format(card="101,0,1,1,0,0,6", points=POINTS), {}, "DATTYP = 6"),
    "no curve": ("*KEYWORD\n*NODE\n", {}, "is a keyword file without"),
    "a curve elsewhere": ("*INCLUDE\nx.k\n", {}, "what its .INCLUDE names is not read: name that file itself"),
    "a tab in a card": ("*DEFINE_CURVE\n101\t\t2.0\n0,0\n9,9\n", {}, r"line 2: '101.*has a tab: write blanks"),
    "a tab in a point": ("*DEFINE_CURVE\n101\n0\t0\n9,9\n", {}, r"line 3: '0.*has a tab: write blanks"),
    "a sheet": (ONE, {"sheet": "a"}, "is a keyword file, which has no sheet: leave sheet out"),
}


@pytest.mark.parametrize(("text", "place", "said"), BAD_DECKS.values(), ids=BAD_DECKS)
def test_keyword_files_that_could_mean_something_else_are_refused(tmp_path, text, place, said):
    """Fails if a curve is guessed."""
    with pytest.raises(InputError, match=said):
        deck(tmp_path, text, **place)


# what is no workbook, or a hostile one


KINDS = "[Content_Types].xml"
HOSTILE = {
    "old": (b"\xd0\xcf\x11\xe0" + bytes(600), "is an old Excel file .*, or has a password"),
    "text": (b"stroke_mm,force_kN\n0,0\n", "has the name of a workbook, but is none"),
    "ods": (packed(mimetype="application/vnd.oasis", **{"content.xml": "<a/>"}), "is an OpenDocument file"),
    "xlsb": (packed(**{KINDS: "", "xl/workbook.bin": ""}), "is a binary workbook"),
    "zip": (packed(a="b"), "is a packed file, but no Excel workbook"),
    "cut": (with_part(bytes)[:2000], "is damaged"),
    "torn": (with_part(lambda xml: xml[:200]), "is damaged"),
    "bomb": (packed(**{KINDS: "", "xl/workbook.xml": "a" * 60_000_000}), "is larger than 50 MB when unpacked"),
    "cells": (with_part(lambda xml: xml + b"<c />" * 300_001), "has 300009 cells, more than 300000"),
    "entities": (with_part(lambda xml: b'<!DOCTYPE a [<!ENTITY b "c">]>' + xml), "is not as Excel writes it"),
    "merged": (
        with_part(
            lambda x: x.replace(
                b"</sheetData>", b'</sheetData><mergeCells><mergeCell ref="A1:XFD1048576"/></mergeCells>'
            )
        ),
        "has 17179869184 cells in merged ranges",
    ),
    "far": (
        with_part(
            lambda xml: xml.replace(
                b"</sheetData>", b'<row r="1048576"><c r="XFD1048576"><v>1</v></c></row></sheetData>'
            )
        ),
        None,
    ),
}


@pytest.mark.parametrize(("content", "said"), HOSTILE.values(), ids=HOSTILE)
def test_what_is_no_workbook_or_a_hostile_one_is_refused_at_once(tmp_path, content, said):
    """Fails if a file that is no plain workbook gets to openpyxl, or a far cell costs memory for all before it."""
    if said is None:
        assert read(tmp_path, content) == READ
        return
    with pytest.raises(InputError, match=said):
        read(tmp_path, content)


# text of other programs, and other folders


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252", "latin-1"])
def test_text_of_other_programs_is_read(tmp_path, encoding):
    """Fails if what Excel saves as CSV or Unicode text is refused or misread."""
    (tmp_path / "t.csv").write_bytes("Größe\tstroke_mm\r\nä\t0,5\r\n".encode(encoding))
    table = read_beside(tmp_path, "t.csv", "t")
    assert table.columns == {"Größe": ["ä"], "stroke_mm": [0.5]}
    assert bool(table.notes) == (encoding in ("cp1252", "latin-1"))


def test_files_in_other_folders_are_read_where_the_user_allows_it(tmp_path, monkeypatch):
    """Fails if a file from outside can name files elsewhere, or the folders that are allowed cannot be used."""
    from click.testing import CliRunner

    from trainmj.cli import main

    here, there = tmp_path / "mine", tmp_path / "common"
    here.mkdir()
    there.mkdir()
    (there / "c.csv").write_text("stroke_mm,force_kN\n0,0\n300,1000\n")
    with pytest.raises(InputError, match="allow_folder in Python"):
        mine(here, "../common/c.csv")
    assert trainmj.load(here / "s.yaml", allow_folder=there).devices["head"].curve.force_kN == [0, 1000]
    with pytest.raises(InputError, match="must be in the folder"):
        trainmj.load(here / "s.yaml", allow_folder=[here])  # and what was allowed before is not any more
    with pytest.raises(InputError, match="there is no such folder"):
        trainmj.load(here / "s.yaml", allow_folder=tmp_path / "none")
    ran = CliRunner().invoke(main, ["check", str(here / "s.yaml"), "--allow-folder", str(there)])
    assert ran.exit_code == 0, ran.output
    assert CliRunner().invoke(main, ["check", str(here / "s.yaml")]).exit_code == 2
    readers = ["run", "check", "sweep", "study", "identify", "assess", "reliability", "render", "view", "export"]
    assert all("allow_folder" in {option.name for option in main.commands[name].params} for name in readers)


def test_the_tables_of_a_file_are_listed_with_what_reads_them(tmp_path):
    """Fails if a table that is listed cannot be read by its place."""
    of(two).save(tmp_path / "t.xlsx")
    (tmp_path / "t.k").write_text(ONE)
    found = tables_in(tmp_path / "t.xlsx")
    assert [(one.place.sheet, one.place.range, one.heads, one.rows) for one in found] == [
        ("coupler", "B3:C6", HEADS, 3),
        ("coupler", "F3:G5", HEADS, 2),
    ]
    assert [len(read_beside(tmp_path, one.place, "t").lines) for one in found] == [3, 2]
    assert [(one.place.id, one.rows) for one in tables_in(tmp_path / "t.k")] == [(101, 2)]
