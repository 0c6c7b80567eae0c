"""Results in the files of other programs: workbooks, ISO-MME folders, tables with other separators."""

from __future__ import annotations

import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pandas as pd
import pytest
from test_cli import fails, works

import trainmj
from trainmj.collision.deceleration import cfc60
from trainmj.collision.result import HISTORIES, Result
from trainmj.errors import InputError
from trainmj.exchange import mme, tables, workbook
from trainmj.files import mme as format_of_mme
from trainmj.scenario import Scenario
from trainmj.units import unit_of

STAGES = {
    "buffer": {"curve": {"stroke_mm": [0, 100], "force_kN": [0, 800]}},
    "tube": {"curve": {"stroke_mm": [0, 300], "force_kN": [1000, 1000]}, "stroke_limit_mm": 250},
}
HEADED: dict[str, Any] = {
    "title": "=SUM(A1) two wagons",
    "devices": {"end": {"stages": STAGES, "stiffness_kN_per_mm": 400}},
    "trains": {"wagon": {"vehicles": 2, "mass_t": 40, "front": "end", "coupler": "end"}},
    "collision": {"train": "wagon", "speed_km_h": 18, "partner": "wagon"},
    "simulation": {"step_ms": 0.2, "record_every_ms": 1.6},
}


@pytest.fixture(scope="module")
def result() -> Result:
    """Two wagons into a standing twin."""
    return trainmj.run(Scenario.from_values(HEADED))


@pytest.fixture(scope="module")
def ended() -> Result:
    """The same, faster, with a curve behind which nothing is stated."""
    values = HEADED | {"collision": HEADED["collision"] | {"speed_km_h": 60}}
    found = trainmj.run(Scenario.from_values(values))
    assert found.not_valid
    return found


@pytest.fixture(scope="module")
def book(result: Result) -> Any:
    return book_of(result)


def book_of(result: Result) -> Any:
    return openpyxl.load_workbook(io.BytesIO(workbook.write(result, trainmj.summarise(result))))


def near(value: Any) -> Any:
    """To 16 digits, which a workbook holds."""
    return pytest.approx(value, rel=1e-15, abs=0)


def rows_of(sheet: Any) -> list[dict[str, Any]]:
    _, _, heads, *rows = sheet.iter_rows(values_only=True)
    return [dict(zip(heads, row, strict=True)) for row in rows]


# the workbook


def test_a_workbook_holds_every_digit_of_the_summary(book, result):
    """Breaks if a cell is rounded, in another unit than its head says, or in another row."""
    summary = trainmj.summarise(result)
    names = "Summary Limits Interfaces Stages Vehicles Energy Checks Histories Scenario"
    assert book.sheetnames == names.split()
    for row, interface in zip(rows_of(book["Interfaces"]), summary.interfaces, strict=True):
        assert row["name"] == interface.name
        assert row["stroke [mm]"] == near(interface.stroke_mm)
        assert row["peak force [kN]"] == near(interface.peak_force_kN)
        assert row["energy [kJ]"] == near(interface.energy_kJ)
    stages = [
        (i.name, s.name, near(s.stroke_mm), s.limit_mm, near(s.energy_kJ)) for i in summary.interfaces for s in i.stages
    ]
    keys = ("interface", "stage", "stroke [mm]", "limit [mm]", "energy [kJ]")
    assert [tuple(row[key] for key in keys) for row in rows_of(book["Stages"])] == stages
    peaks = [row["cfc60 peak [g]"] for row in rows_of(book["Vehicles"])]
    assert peaks == near([v.cfc60_peak_g for v in summary.vehicles])
    values = {row["Quantity"]: row["Value"] for row in rows_of(book["Summary"])}
    assert (values["TS"], values["TAMA"], values["Status"]) == (near(summary.TS_mm), near(summary.TAMA_g), "over")
    energies = {row["Energy"]: row["[kJ]"] for row in rows_of(book["Energy"])}
    assert energies["absorbed by the devices"] == near(summary.balance.absorbed_kJ)
    found = {row["at"]: row["found"] for row in rows_of(book["Limits"])}
    assert found["S1-M1"] == near(summary.interfaces[0].stages[1].stroke_mm)
    table = result.table(both_sides=True)
    sheet = pd.DataFrame(rows_of(book["Histories"]))
    np.testing.assert_allclose(sheet.to_numpy(dtype=float), table.to_numpy(), rtol=1e-15)
    assert "stroke S1-M1 partner [mm]" in sheet.columns
    assert next(row["scenario.yaml"] for row in rows_of(book["Scenario"])) == "title: =SUM(A1) two wagons"


def test_a_workbook_opens_well(book):
    """Breaks if heads scroll away, columns are too narrow for their numbers, or all digits are shown."""
    for sheet in book:
        assert sheet.freeze_panes[-1] == "4", sheet.title
        assert sheet["A3"].font.bold
        assert sheet.page_setup.orientation == "landscape"
        for column in sheet.iter_cols(min_row=3, max_row=40):
            width = sheet.column_dimensions[column[0].column_letter].width
            words = [cell.value for cell in column[1:] if isinstance(cell.value, str)]
            assert width >= min(60, max(map(len, words), default=0)), (sheet.title, column[0].value)
    force = next(cell for cell in book["Interfaces"][3] if cell.value == "peak force [kN]")
    assert book["Interfaces"].cell(4, force.column).number_format == "0.0"


@pytest.mark.parametrize("bad", [False, True])
def test_every_sheet_says_whether_its_numbers_are_valid(book, ended, bad):
    """Breaks if a sheet that is printed by itself passes numbers on that are not valid."""
    book = book_of(ended) if bad else book
    for sheet in book:
        said = sheet["A1"].value
        assert ("NOT VALID AFTER" in said) == bad
        assert ("all numbers are valid" in said) != bad
        assert (sheet["A1"].fill.fgColor.rgb == "00C00000") == bad
    verdicts = {row["verdict"] for row in rows_of(book["Limits"])}
    assert (verdicts == {"NOT VALID"}) == bad


def test_no_text_of_a_scenario_becomes_a_formula(book):
    """Breaks if the title of a file from elsewhere is computed where the workbook is opened."""
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert book["Summary"]["A1"].value.startswith("=SUM(A1)")
    assert not [cell.coordinate for cell in cells if cell.data_type == "f"]


def test_equal_results_give_equal_workbooks(result, monkeypatch):
    histories = ("time", *HISTORIES)
    short = replace(result, **{name: value[:5] for name, value in vars(result).items() if name in histories})
    first = workbook.write(short, trainmj.summarise(result))
    monkeypatch.setattr("time.time", lambda: 2e9)
    assert workbook.write(short, trainmj.summarise(result)) == first


def test_what_no_spreadsheet_holds_is_refused(result, monkeypatch):
    monkeypatch.setattr(workbook, "_MOST_ROWS", 10)
    with pytest.raises(InputError, match=r"has \d+ rows and \d+ columns, too many for a spreadsheet: take csv"):
        workbook.write(result, trainmj.summarise(result))


# ISO-MME


def read_mme(folder: Path) -> tuple[dict[str, str], dict[str, tuple[dict[str, str], np.ndarray, np.ndarray]]]:
    """A reader that knows no more than ISO/TS 13499: the test, and by code descriptors, times and values."""
    (head,) = folder.glob("*.mme")
    lines = head.read_text(encoding="ascii").splitlines()
    listed = (folder / "Channel" / f"{head.stem}.chn").read_text(encoding="ascii").splitlines()
    about = dict(line.split(":", 1) for line in lines)
    found = {}
    for n, line in enumerate(listed[1:], start=1):
        key, code = line.split(":", 1)
        assert key.strip() == f"Name of channel {n:03}"
        text = (folder / "Channel" / f"{head.stem}.{n:03}").read_text(encoding="ascii").splitlines()
        told = {k.strip(): v for k, v in (one.split(":", 1) for one in text if ":" in one)}
        values = np.array([float(one) for one in text if ":" not in one])
        assert told["Number of samples"] == str(len(values))
        assert told["Channel code"] == code.split(" / ")[0]
        start, step = (float(told[key]) for key in ("Time of first sample", "Sampling interval"))
        found[told["Channel code"]] = told, start + step * np.arange(len(values)), values
    assert listed[0].split(":")[1] == str(len(found))
    return {key.strip(): value for key, value in about.items()}, found


def test_channels_are_those_of_the_result(result, tmp_path):
    """Breaks if a channel is that of another vehicle or side, in another unit, or at other times."""
    mme.write(result, trainmj.summarise(result), tmp_path / "two wagons")
    about, found = read_mme(tmp_path / "two wagons")
    assert about["Data format edition number"] == "1.6"
    assert (about["Mass test object 1"], about["Velocity test object 1"]) == ("80000", "5")
    assert all(len(code) == 16 for code in found)
    front, first = result.chain.front, result.chain.n_moving - 1
    wanted = {
        "10VEHC01CG00VEX0": ("m/s", result.velocity[:, first]),
        "10VEHC02CG00DSX0": ("m", result.position[:, first - 1]),
        "20VEHC02CG00ACX0": ("m/(s*s)", result.acceleration[:, first + 2]),
        "102IFC010000FOX0": ("N", result.force[:, front]),
        "202IFC010000FOX0": ("N", result.force[:, front]),
        "102IFC020000DSX0": ("m", result.left_stroke[:, front - 1]),
        "202IFC010000DSX0": ("m", result.right_stroke[:, front]),
        "202IFC010000ENX0": ("J", result.right_energy[:, front]),
    }
    for code, (unit, values) in wanted.items():
        told, time, written = found[code]
        assert told["Unit"] == unit
        assert told["Channel frequency class"] == "NOVALUE"
        np.testing.assert_allclose(written, values, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(time, result.time, atol=1e-9)
    told, time, written = found["10VEHC01CG00ACXD"]
    assert told["Channel frequency class"] == "60"
    start, filtered = cfc60(result.chain.record_interval, result.velocity[:, [first]])
    np.testing.assert_allclose(written, filtered[0], rtol=1e-9)
    assert time[0] == pytest.approx(start)
    again = {channel.code: channel for channel in format_of_mme.read(tmp_path / "two wagons" / "two_wagons.mme")}
    assert again.keys() == found.keys()
    assert np.array_equal(again["10VEHC01CG00ACXD"].values, written)


def test_channels_end_where_they_are_no_longer_valid(ended, tmp_path):
    """Breaks if a laboratory's program draws forces behind the end of a curve."""
    mme.write(ended, trainmj.summarise(ended), tmp_path / "bad")
    about, found = read_mme(tmp_path / "bad")
    assert "NOT VALID AFTER" in about["Comments"]
    end = ended.tally.valid_until
    assert all(time[-1] <= end for _, time, _ in found.values())
    _, time, _ = found["10VEHC01CG00VEX0"]
    assert time[-1] > end - 2 * ended.chain.record_interval
    assert found["10VEHC01CG00ACXD"][1][-1] < end - 0.009, "the filter looks ahead"


def test_what_the_codes_cannot_number_is_refused(result, monkeypatch, tmp_path):
    monkeypatch.setattr(mme, "_MOST_NUMBER", 1)
    with pytest.raises(InputError, match="cannot number: write csv"):
        mme.write(result, trainmj.summarise(result), tmp_path / "a")
    with pytest.raises(InputError, match="more than the 999"):
        format_of_mme.texts("a", {}, [None] * 1000)  # type: ignore[list-item]


CHANNEL = "Channel code :11VEHC000000VEXP\nUnit :m/s\nTime of first sample :0\nSampling interval :0.1\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (CHANNEL + "1\ntwo\n", "line 6: 'two': must be a number"),
        (CHANNEL.replace("0.1", "0") + "1\n2\n", "Sampling interval = 0: must be more than 0 s"),
        (CHANNEL.replace("0.1", "fast") + "1\n2\n", "Sampling interval = 'fast': must be a number of seconds"),
        (CHANNEL + "Number of samples :3\n1\n2\n", "Number of samples = 3: it has 2"),
        (CHANNEL.replace("11VEHC000000VEXP", "v1") + "1\n2\n", "Channel code = 'v1': must have 16 letters"),
        (CHANNEL + "Reference channel :explicit\n1\n2\n", "must be a channel of 2 times of this test"),
        (CHANNEL + "1\ninf\n", "has an infinite value"),
    ],
)
def test_a_damaged_channel_is_refused(tmp_path, text, said):
    (tmp_path / "Channel").mkdir()
    (tmp_path / "t.mme").write_text("")
    (tmp_path / "Channel" / "t.001").write_text(text)
    with pytest.raises(InputError, match=r"t\.001: ") as error:
        format_of_mme.read(tmp_path / "t.mme")
    assert said in str(error.value)


def test_channels_as_laboratories_write_them_are_read(tmp_path):
    """Breaks on Latin-1, times in a channel of their own, values that are missing, or other capitals in names."""
    (tmp_path / "CHANNEL").mkdir()
    (tmp_path / "T.MME").write_text("Title :x\n")
    clock = "Channel code :11TIRS000000TI00\nDimension :TI\nUnit :s\n0\n0.1\n0.3\n"
    told = "Reference channel :explicit\nReference channel name :11TIRS000000TI00\nName of the channel :Prüfung\n"
    (tmp_path / "CHANNEL" / "T.001").write_text(clock, encoding="latin-1")
    values = f"Channel code :11VEHC000000VEXP\n{told}Unit :m/s\r\n1.5\r\nNOVALUE\r\n-2E0\r\n"
    (tmp_path / "CHANNEL" / "T.002").write_bytes(values.encode("latin-1"))
    (channel,) = format_of_mme.read(tmp_path / "T.MME")
    assert (channel.name, channel.unit, channel.time.tolist()) == ("Prüfung", "m/s", [0, 0.1, 0.3])
    np.testing.assert_array_equal(channel.values, [1.5, math.nan, -2])


# tables, and the command


def test_tables_have_the_separators_that_are_asked_for(result, tmp_path):
    tables.write(result, trainmj.summarise(result), tmp_path / "t", separator=";", decimal=",")
    table = pd.read_csv(tmp_path / "t" / "histories.csv", sep=";", decimal=",")
    np.testing.assert_allclose(table.to_numpy(), result.table(both_sides=True).to_numpy(), rtol=1e-8, atol=1e-12)
    stages = pd.read_csv(tmp_path / "t" / "stages.csv", sep=";", decimal=",")
    assert stages["stage"].tolist()[:2] == ["buffer", "tube"]
    assert all(unit_of(head) for head in table.columns if head != "valid")


def test_both_sides_of_an_equal_front_are_there_once_each(result):
    """Breaks if the partner's stroke at the front is missing, or is the moving train's."""
    table, front = result.table(both_sides=True), result.chain.front
    sides = table["stroke_S1-M1_mm"] + table["stroke_S1-M1_partner_mm"]
    np.testing.assert_allclose(sides, result.stroke[:, front] / 1e-3, atol=1e-9)
    assert "stroke_S1-M1_partner_mm" not in result.table().columns


def test_a_saved_result_and_a_scenario_are_exported(result, tmp_path):
    """Breaks if either is refused, or a result is computed once more."""
    result.save(tmp_path / "result.nc")
    trainmj.save(result.scenario, tmp_path / "two.yaml")
    assert works("export", str(tmp_path), "--to", "xlsx", "--out", str(tmp_path / "r.xlsx")).startswith("Written to ")
    written = openpyxl.load_workbook(tmp_path / "r.xlsx", read_only=True)["Summary"]["B6"].value
    assert written == near(trainmj.summarise(result).TS_mm)
    for given, out in ((tmp_path, "a"), (tmp_path / "two.yaml", "b")):
        works("export", str(given), "--to", "csv", "--out", str(tmp_path / out))
    assert (tmp_path / "a" / "stages.csv").read_text() == (tmp_path / "b" / "stages.csv").read_text()
    assert works("export", str(tmp_path)).startswith("<!--"), "the model of a result"
    works("export", str(tmp_path), "--to", "csv", "--separator", "tab", "--out", str(tmp_path / "c"))
    assert "time_s\tvalid" in (tmp_path / "c" / "histories.csv").read_text()


def test_an_export_of_numbers_that_are_not_valid_says_so(ended, tmp_path):
    ended.save(tmp_path / "result.nc")
    assert "NOT VALID AFTER" in works("export", str(tmp_path), "--to", "mme", "--out", str(tmp_path / "m"))


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("--to", "xlsx"), "--to xlsx: needs --out, the file to write"),
        (("--to", "mme"), "--to mme: needs --out, the folder to write"),
        (("--to", "xlsx", "--out", "a.xls"), "must end in .xlsx"),
        (("--separator", ";"), "--separator: goes with --to csv"),
        (("--to", "csv", "--decimal", ",", "--out", "t"), "--decimal ,: needs another separator"),
        (("--to", "csv", "--out", "{here}"), "has the result that is exported"),
        (("--to", "xlsx", "--out", "t.xlsx", "--set", "collision.speed_km_h=5"), "is a result, which has no other"),
        (("--to", "xlsx", "--out", "/nowhere/t.xlsx"), "cannot be written"),
        (("--out", "result.nc"), "is read by this command, which would replace it"),
    ],
)
def test_what_cannot_be_exported_is_said(result, tmp_path, monkeypatch, args, said):
    monkeypatch.chdir(tmp_path)
    result.save("result.nc")
    assert said in fails("export", str(tmp_path), *(arg.format(here=tmp_path) for arg in args))
    assert [file.name for file in tmp_path.iterdir()] == ["result.nc"]


def test_a_folder_of_channels_is_replaced_as_a_whole(result, tmp_path):
    """Breaks if channels of an earlier result stand beside those of a new one."""
    summary = trainmj.summarise(result)
    mme.write(result, summary, tmp_path / "m")
    n = len(list((tmp_path / "m" / "Channel").iterdir()))
    (tmp_path / "m" / "Channel" / "m.900").write_text("old")
    (tmp_path / "m" / "note.txt").write_text("mine")
    mme.write(replace(result), summary, tmp_path / "m")
    assert len(list((tmp_path / "m" / "Channel").iterdir())) == n
    assert (tmp_path / "m" / "note.txt").exists()
