"""A result beside another one, or beside a test: differences that are known exactly, rules at their edges."""

from __future__ import annotations

import copy
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pages import blocks, file_block
from test_cli import fails, works
from test_cli import trainmj as command

import trainmj
from trainmj.collision.result import Result
from trainmj.comparison import Comparison, compare, figures
from trainmj.comparison.differences import difference
from trainmj.comparison.page import page_of
from trainmj.comparison.rules import ENERGY, FORCE, SEQUENCE, STROKE, Rule
from trainmj.comparison.sides import Series
from trainmj.errors import InputError
from trainmj.exchange import mme
from trainmj.scenario import Scenario

STAGES = {
    "buffer": {"curve": {"stroke_mm": [0, 100], "force_kN": [0, 800]}},
    "tube": {"curve": {"stroke_mm": [0, 300], "force_kN": [1000, 1000]}},
}
WAGONS: dict[str, Any] = {
    "devices": {"end": {"stages": STAGES, "stiffness_kN_per_mm": 400}},
    "trains": {"wagon": {"vehicles": 2, "mass_t": 40, "front": "end", "coupler": "end"}},
    "collision": {"train": "wagon", "speed_km_h": 10, "partner": "rigid_wall"},
    "simulation": {"step_ms": 0.2},
}


def wagons(**collision: Any) -> Result:
    values = copy.deepcopy(WAGONS)
    values["collision"] |= collision
    return trainmj.run(Scenario.from_values(values))


@pytest.fixture(scope="module")
def result() -> Result:
    return wagons()


@pytest.fixture(scope="module")
def test(result: Result) -> pd.DataFrame:
    """What a test would have recorded, had it gone as the simulation did; no channel is called as here."""
    table = result.table()
    return pd.DataFrame(
        {
            "t [ms]": table["time_s"] * 1e3,
            "lead": table["velocity_M1_km_h"] / 3.6,
            "cell [MN]": table["force_M1-wall_kN"] / 1e3,
            "crush_m": table["stroke_M1-wall_mm"] / 1e3,
        }
    )


NAMED = {
    "velocity_M1_km_h": "3.6 * lead",
    "force_M1_wall_kN": "cell [MN]",
    "stroke_M1-wall_mm": "crush_m",
}


def of(found: Comparison, name: str) -> list[Rule]:
    return [rule for rule in found.rules if rule.name == name]


def scaled(result: Result, **factors: float) -> Result:
    """A result some of whose histories are multiplied."""
    return replace(result, **{name: factor * getattr(result, name) for name, factor in factors.items()})


# differences of channels


def test_a_result_is_kept_against_itself(result):
    """Breaks if any channel differs from itself, or a rule does."""
    found = compare(result, result)
    table = found.to_frame()
    some = {"velocity_M1_km_h", "stroke_M1_M2_mm", "force_M1_wall_kN", "acceleration_cfc60_M2_g"}
    assert set(table["channel"]) >= some
    differences = ["peak_difference", "peak_time_difference_s", "mean_difference", "rms_difference"]
    assert (table[differences] == 0.0).all().all()
    assert found.kept is True
    assert repr(found).endswith(
        f": {len(found.differences)} channels. All 10 rules that can be judged are kept; no compliance is claimed.>"
    )
    assert all(rule.kept for rule in found.rules)
    assert {rule.name for rule in found.rules} == {SEQUENCE, ENERGY, STROKE, FORCE}


def test_differences_are_those_that_were_made(result):
    """Breaks if A and B are exchanged, a percentage is of A, or a mean is not over time."""
    faster = replace(result, velocity=result.velocity + 0.5)
    table = compare(faster, result).to_frame().set_index("channel")
    row = table.loc["velocity_M1_km_h"]
    assert row["mean_difference"] == pytest.approx(1.8)
    assert row["rms_difference"] == pytest.approx(1.8)
    assert row["peak_difference"] == pytest.approx(1.8)
    assert row["peak_difference_percent"] == pytest.approx(100 * 1.8 / row["peak_b"])
    assert row["rms_difference_percent"] == pytest.approx(100 * 1.8 / row["rms_b"])


def test_integrals_are_those_of_straight_lines():
    """Breaks if uneven samples count alike, or the records of both must agree."""
    a = Series(np.array([0.0, 1.0, 4.0]), np.array([0.0, 3.0, 0.0]), "g")
    b = Series(np.array([-1.0, 9.0]), np.array([0.0, 0.0]), "g")
    found = difference("x", a, b)
    assert found is not None
    assert (found.from_s, found.to_s, found.peak_a, found.peak_time_a_s) == (0.0, 4.0, 3.0, 1.0)
    assert found.mean_a == pytest.approx(1.5)
    assert found.rms_difference == pytest.approx(math.sqrt(3.0)), "of a triangle: its height over root 3"
    assert math.isnan(found.peak_percent), "of nothing there is no part"
    assert difference("x", a, b._replace(time=b.time + 5.5)) is None


def test_a_channel_that_ends_early_is_compared_only_while_both_are_there(result):
    """Breaks if something is made up behind the end of a record."""
    table = result.table().rename(columns={"velocity_M1_km_h": "velocity_M1_m_per_s"})
    table["velocity_M1_m_per_s"] /= 3.6
    table.loc[table["time_s"] > 0.1, "velocity_M1_m_per_s"] = np.nan
    table.loc[table["time_s"] < 0.02, "velocity_M1_m_per_s"] = np.nan
    found = compare(result, table[["time_s", "velocity_M1_m_per_s"]])
    (row,) = found.differences
    assert (row.from_s, row.to_s) == pytest.approx((0.02, 0.1))
    assert row.rms_difference < 1e-9, "and m/s is turned into km/h"
    assert "Compared only while both are there: from 0.02 to 0.1 s velocity_M1_km_h" in " ".join(found.remarks)
    table.loc[50, "velocity_M1_m_per_s"] = np.nan
    with pytest.raises(InputError, match=r"velocity_M1_km_h = .*has no value at 0\.05 s, between others"):
        compare(result, table)


def test_records_and_lengths_may_differ_and_are_said(result):
    other = trainmj.run(result.scenario.with_values({"simulation.record_every_ms": 3, "simulation.time_limit_s": 0.15,
                                                        "title": "Another", "report": {"revision": "B"}}))  # fmt: skip
    found = compare(other, result)
    said = " ".join(found.remarks)
    assert "Records are 3 ms apart in A and 1 ms in B" in said
    assert "The scenarios differ: simulation.record_every_ms 3 in A, not stated in B, simulation.time_limit_s" in said
    assert "title" not in said
    assert "report" not in said
    assert "Only in B: acceleration_cfc60_M1_g" in said
    assert all(row.to_s <= 0.15 for row in found.differences)
    worst = found.to_frame().set_index("channel")["rms_difference_percent"]
    assert worst["velocity_M1_km_h"] < 0.5
    assert found.kept is True


# the clock


def test_a_shifted_clock_is_found_and_said(result, test):
    """Breaks if the shift has the other sign, or the differences without it are no longer there."""
    late = test.assign(**{"t [ms]": test["t [ms]"] + 4.0})
    found = compare(result, late[5:], NAMED, time="t [ms]", align=True)
    assert found.offset_ms == pytest.approx(-4.0, abs=0.05)
    assert {row.offset_ms for row in found.differences} == {0.0}
    assert max(row.rms_percent for row in found.differences) > 1.0
    assert max(row.rms_percent for row in found.shifted) < 0.2
    assert "put forward by -4" in " ".join(found.remarks)
    stated = compare(result, late, NAMED, offset_ms=-4.0)
    assert max(row.rms_percent for row in stated.shifted) < 1e-9
    assert len(stated.to_frame()) == 6


# rules


@pytest.mark.parametrize(("factor", "kept"), [(1.09, True), (0.91, True), (1.1, True), (1.11, False), (0.89, False)])
def test_forces_within_a_tenth_are_kept(result, factor, kept):
    """Breaks if the bar is another one, or the difference is told of A."""
    found = compare(scaled(result, force=factor), result)
    rules = of(found, FORCE)
    assert [rule.where for rule in rules] == ["M1-wall buffer", "M1-wall tube", "M1-M2 buffer", "M1-M2 tube"]
    assert [rule.percent for rule in rules] == pytest.approx([100 * (factor - 1)] * 4)
    assert {rule.kept for rule in rules} == {kept}
    assert found.kept is kept
    assert all(rule.kept for rule in found.rules if rule.name != FORCE)


def test_the_mean_force_is_that_of_the_curve(result):
    """Breaks if a stage has the work of another one, or the way back counts."""
    buffer, tube, *_ = of(compare(result, result), FORCE)
    assert buffer.b == pytest.approx(400, rel=0.01)
    assert tube.b == pytest.approx(1000, rel=0.01)


@pytest.mark.parametrize(("judged", "mean", "other"), [("tube", 1000, "buffer"), ("buffer", 313, "tube")])
def test_a_mean_force_is_of_recorded_strokes_alone(result, judged, mean, other):
    """Breaks if the force where records begin or end is taken for what was before or comes after."""
    names = {"stroke_M1-wall_mm": "stroke_M1_wall_mm", "force_M1-wall_kN": "force_M1_wall_kN"}
    test = result.table()[["time_s", *names]].rename(columns=names)
    stroke = test["stroke_M1_wall_mm"]
    test["force_M1_wall_kN"] = test["force_M1_wall_kN"].where(stroke > 120 if judged == "tube" else stroke < 80)
    last = int(stroke.argmax()) if judged == "tube" else len(test)
    found = {rule.where: rule for rule in of(compare(result, test[:last]), FORCE)}
    rule, unknown = found[f"M1-wall {judged}"], found[f"M1-wall {other}"]
    assert (rule.a, rule.b, rule.kept) == (pytest.approx(mean, rel=0.02), rule.a, True)
    without = float(rule.said.removeprefix("without ").partition(" mm of it, of which there are no records")[0])
    assert without == pytest.approx(20, abs=3)
    assert (unknown.kept, unknown.said) == (
        None,
        "not judged: there are no records of force and stroke while it is pressed",
    )


@pytest.mark.parametrize(("factor", "kept"), [(1.09, True), (1.11, False)])
def test_strokes_within_a_tenth_are_kept(result, factor, kept):
    """Breaks if a stage is judged by the stroke of the whole device: a buffer that is used up has all its stroke."""
    whole = result.left_stroke[:, 1].max() / 1e-3
    tube = (factor * (whole - 100) + 100) / whole  # the tube alone has so much more
    found = compare(scaled(result, left_stroke=tube), result)
    rules = {rule.where: rule for rule in of(found, STROKE)}
    assert rules["M1-wall tube"].percent == pytest.approx(100 * (factor - 1), rel=1e-6)
    assert rules["M1-wall tube"].kept is kept
    assert rules["M1-wall buffer"].percent == 0.0


@pytest.mark.parametrize(("share", "kept"), [(0.099, True), (-0.099, True), (0.101, False)])
def test_energy_is_judged_by_the_initial_energy(result, share, kept):
    """Breaks if the absorbed energy itself is the measure."""
    start = trainmj.summarise(result).balance.kinetic_start_kJ
    absorbed = float(result.energy[-1].sum()) / 1e3
    (rule,) = of(compare(scaled(result, left_energy=1 + share * start / absorbed), result), ENERGY)
    assert rule.percent == pytest.approx(100 * share)
    assert (rule.b, rule.kept) == (pytest.approx(absorbed), kept)
    assert "2 of 2 devices" in rule.said


def test_energy_of_a_record_that_is_cut_short_is_not_judged(result, test):
    """Breaks if hardly any energy is found to differ by less than a tenth of the initial one, and that is kept."""
    absorbed = result.energy.sum(axis=1)
    n = int(np.argmax(absorbed > 0.4 * absorbed[-1]))
    (rule,) = of(compare(result, test[:n], NAMED), ENERGY)
    assert rule.kept is None
    assert "not judged: the time in common has" in rule.said
    assert "% of what A absorbs" in rule.said


def test_another_order_of_events_is_not_kept(result):
    """Breaks if only the strokes count, whenever they are there."""
    early = result.left_stroke.copy()
    early[:, 0] = np.concatenate([early[60:, 0], np.full(60, early[-1, 0])])  # M1-M2 by 60 ms
    found = compare(replace(result, left_stroke=early), result)
    (rule,) = of(found, SEQUENCE)
    assert rule.kept is False
    assert "M1-wall buffer acts after M1-M2 buffer in A, and not in B" in rule.said


def test_a_device_that_acts_in_one_only_is_not_kept(result):
    (rule,) = of(compare(scaled(result, left_stroke=0.3), result), SEQUENCE)
    assert rule.kept is False
    assert "M1-wall tube acts in B only" in rule.said


def test_events_within_a_record_have_no_order(result):
    """Breaks if two ends that meet at once, recorded seldom, are told apart by chance."""
    seldom = trainmj.run(result.scenario.with_values({"simulation.record_every_ms": 20}))
    moved = seldom.left_stroke.copy()
    moved[1:, 0] = moved[:-1, 0]
    (rule,) = of(compare(replace(seldom, left_stroke=moved), seldom), SEQUENCE)
    assert rule.kept is True


def test_what_cannot_be_judged_is_said_and_is_no_failure(result, test):
    found = compare(result, test, {"velocity_M1_km_h": "3.6 * lead"}, time="t [ms]")
    assert found.kept is None
    assert [(rule.name, rule.kept) for rule in found.rules] == [(n, None) for n in (SEQUENCE, ENERGY, STROKE, FORCE)]
    assert all(rule.said.startswith("not judged: ") for rule in found.rules)


def test_numbers_that_are_not_valid_are_never_kept():
    """Breaks if a collision past the end of its curve is compared as if its forces were some, and passes."""
    ended = wagons(speed_km_h=30)
    assert ended.not_valid
    found = compare(ended, ended)
    assert found.kept is False
    assert found.unusable
    assert all(row.to_s <= ended.tally.valid_until for row in found.differences)
    assert "Numbers may not be used" in found.remarks[0]


def test_both_sides_of_the_front_count_for_energy_and_once_for_the_rest():
    twin = wagons(partner="wagon")
    found = compare(twin, twin)
    (energy,) = of(found, ENERGY)
    assert energy.a == pytest.approx(trainmj.summarise(twin).balance.absorbed_kJ)
    assert [rule.where for rule in of(found, STROKE)].count("S1-M1 buffer") == 1
    assert not [rule for rule in found.rules if "partner" in rule.where]


# tests


def test_units_of_a_test_are_converted_and_said(result, test, tmp_path):
    """Breaks if a force in MN is compared as one in kN, or nobody is told what was taken for what."""
    test.to_csv(tmp_path / "test.csv", sep=";", index=False)
    found = compare(result, tmp_path / "test.csv", NAMED)
    assert len(found.differences) == 3
    assert max(row.rms_percent for row in found.differences) < 1e-9
    said = " ".join(found.remarks)
    parts = ("cell [MN], MN turned into kN", "crush_m, m turned into mm", "3.6 * lead, taken as km/h")
    for part in (*parts, "times = t [ms], ms turned into s"):
        assert part in said
    assert found.kept is True
    (energy,) = of(found, ENERGY)
    work = np.trapezoid(result.force[:, 1], result.left_stroke[:, 1]) / 1e3
    assert (energy.b, energy.said) == (pytest.approx(work), "1 of 2 devices; initial energy 308.642 kJ, of A")


def test_a_negative_sign_and_a_partial_name_do_not_hide(result, test):
    turned = test.assign(lead=-test["lead"])
    found = compare(result, turned, {"velocity_M1_km_h": "-3.6 * lead"}, time="t [ms]")
    assert found.differences[0].rms_difference < 1e-9


def test_channels_of_an_iso_mme_folder_are_found_by_their_names(result, tmp_path):
    """Breaks if what trainmj wrote is another collision when it is read again."""
    mme.write(result, trainmj.summarise(result), tmp_path / "m")
    found = compare(result, tmp_path / "m")
    assert len(found.differences) == 2 * 4 + 2 * 3
    raw = [row for row in found.differences if "cfc60" not in row.channel]
    assert max(row.rms_percent for row in raw) < 1e-6
    assert max(row.rms_percent for row in found.differences) < 1.0
    assert found.kept is True
    again = compare(result, tmp_path / "m" / "m.mme", {"velocity_M1_km_h": "10VEHC02CG00VEX0"})
    assert again.to_frame().set_index("channel").loc["velocity_M1_km_h", "rms_difference"] > 0.1


def test_a_test_in_a_workbook_is_the_same_one(result, test, tmp_path):
    """Breaks if a sheet is read as another table than a CSV file, or one of several is guessed."""
    file = tmp_path / "test.xlsx"
    with pd.ExcelWriter(file) as book:
        test.to_excel(book, sheet_name="front", index=False)
        test.assign(lead=0.0).to_excel(book, sheet_name="rear", index=False)
    with pytest.raises(InputError, match="has tables on 2 sheets: state sheet, one of 'front', 'rear'"):
        compare(result, file, NAMED)
    found = compare(result, file, NAMED, sheet="front")
    assert max(row.rms_percent for row in found.differences) < 1e-9
    part = compare(result, file, {"velocity_M1_km_h": "3.6 * lead"}, sheet="front", cells="A1:B51")
    assert part.differences[0].to_s == pytest.approx(0.049)


def test_a_factor_that_is_stated_is_the_only_one(result, test):
    """Breaks if a column whose name ends like a unit is converted against its owner's word."""
    table = test.rename(columns={"lead": "v_in"})
    with pytest.raises(InputError, match=r"is in in, a length, and must be a speed.* state a factor"):
        compare(result, table, {"velocity_M1_km_h": "v_in"})
    (row,) = compare(result, table, {"velocity_M1_km_h": "3.6 * v_in"}).differences
    assert row.rms_difference < 1e-9


def test_rows_that_trainmj_marked_as_not_valid_are_left_out():
    """Breaks if a table that trainmj wrote brings forces behind the end of a curve back."""
    ended = wagons(speed_km_h=30)
    found = compare(wagons(speed_km_h=29), ended.table())
    assert all(row.to_s <= ended.tally.valid_until for row in found.differences)


BAD: list[tuple[str, dict[str, str], dict[str, Any], str]] = [
    ("t,a\n0,1\n1,2\n", {}, {}, "no column is called like a channel"),
    ("t,a\n0,1\n1,2\n", {"velocity_M1_km_h": "b"}, {}, "velocity_M1_km_h = b: there is no column 'b'"),
    ("t,a\n0,1\n1,2\n", {"velocity_M7_km_h": "a"}, {}, "has no such channel; did you mean 'velocity_M"),
    ("t,a_kN\n0,1\n1,2\n", {"velocity_M1_km_h": "a_kN"}, {}, "is in kN, a force, and must be a speed, such as km/h"),
    ("x,a\n0,1\n1,2\n", {"velocity_M1_km_h": "a"}, {}, "no column is called time: name it with --time"),
    ("t,a\n0,1\n0,2\n", {"velocity_M1_km_h": "a"}, {}, "line 3: times must increase: 0 s does not come after 0 s"),
    ("t,a\n0,1\n,2\n", {"velocity_M1_km_h": "a"}, {}, "line 3: has no time"),
    ("t,a\n0,1\n1,\n", {"velocity_M1_km_h": "a"}, {}, "has 1 values, and needs 2 or more"),
    ("t,velocity_M1 [mph],velocity_M1 [m/s]\n0,1,1\n1,2,2\n", {}, {}, "may both be velocity_M1_km_h"),
    ("t,a\n0,one\n1,two\n", {"velocity_M1_km_h": "a"}, {}, "line 2: row 1: a = 'one': must be a number"),
    ("t,a\n5,1\n6,2\n", {"velocity_M1_km_h": "a"}, {}, "no channel is in both at the same time"),
    ("t,a\n0,1\n1,2\n", {"velocity_M1_km_h": "a"}, {"time": "b"}, "--time b: there is no column 'b'"),
    ("t,a\n0,1\n1,2\n", {"velocity_M1_km_h": "a"}, {"align": True, "offset_ms": 2.0}, "either sought or stated"),
]


@pytest.mark.parametrize(("text", "channels", "more", "said"), BAD)
def test_a_test_that_cannot_be_compared_says_why(result, tmp_path, text, channels, more, said):
    (tmp_path / "test.csv").write_text(text)
    with pytest.raises(InputError) as error:
        compare(result, tmp_path / "test.csv", channels, **more)
    assert said in str(error.value)


def test_a_newcomer_compares_a_test_as_the_docs_write_it(tmp_path, monkeypatch):
    """Breaks if the page needs more than five commands, or shows what does not work."""
    monkeypatch.chdir(tmp_path)
    for title in ("wagons.yaml", "test.csv"):
        Path(title).write_text(file_block("docs/compare.md", title), encoding="utf-8")
    commands = [words for block in blocks("docs/compare.md")[1:] for words in block.commands]
    assert [words[0] for words in commands] == ["run", "compare"]
    trainmj.run("wagons.yaml").save("result.nc")
    asked = commands[1][2:]
    text = works("compare", "result.nc", *asked[: asked.index("--out")])
    assert "All 6 rules that can be judged are kept" in text
    assert "load cell [MN], MN turned into kN" in " ".join(text.split())


def test_arguments_that_cannot_be_meant_are_refused(result):
    with pytest.raises(TypeError, match="needs a Result"):
        compare(5, result)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="needs a Result"):
        compare(result, None)
    twice = pd.DataFrame([[0, 1, 1], [1, 2, 2]], columns=["t", "a", "a"])
    with pytest.raises(InputError, match="the table: has two columns 'a'"):
        compare(result, twice, {"velocity_M1_km_h": "a"})
    dated = pd.DataFrame({"t": [0.0, 0.1], "a": pd.to_datetime(["2026-01-01", "2026-01-02"])})
    with pytest.raises(InputError, match=r"a = '2026-01-01': must be a number"):
        compare(result, dated, {"velocity_M1_km_h": "a"})
    with pytest.raises(InputError, match=r"a = 'True': must be a number"):
        compare(result, pd.DataFrame({"t": [0.0, 0.1], "a": [True, False]}), {"velocity_M1_km_h": "a"})
    with pytest.raises(InputError, match=r"offset_ms = nan: must be a finite number"):
        compare(result, result, offset_ms=math.nan)
    with pytest.raises(TypeError, match=r"channels: must be a dict of columns by channel, not list"):
        compare(result, twice, ["a"])  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"is a result, which has no columns to name"):
        compare(result, result, {"velocity_M1_km_h": "a"})


# the command


@pytest.fixture(scope="module")
def folders(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two results, the second with forces too large."""
    folder = tmp_path_factory.mktemp("compared")
    result.save(folder / "a.nc")
    scaled(result, force=1.2).save(folder / "b.nc")
    return folder


def test_the_command_says_what_is_kept_by_its_exit_code(folders):
    a, b = str(folders / "a.nc"), str(folders / "b.nc")
    text = works("compare", a, a)
    assert "All 10 rules that can be judged are kept" in text
    done = command("compare", a, b)
    assert (done.exit_code, done.stderr) == (1, "")
    assert "NOT KEPT" in done.stdout
    assert "-16.67" in done.stdout, "of B"
    assert max(len(line.rstrip()) for line in (text + done.stdout).splitlines()) <= 80
    found = json.loads(command("compare", a, b, "--json").stdout)
    assert found["kept"] is False
    assert {rule["name"] for rule in found["rules"] if rule["kept"] is False} == {FORCE}
    assert len(found["channels"]) == len(compare(a, b).differences)


@pytest.mark.thorough
def test_the_folder_has_tables_figure_and_report(folders, tmp_path):
    both = str(folders / "a.nc"), str(folders / "b.nc")
    done = command("compare", *both, "--out", str(tmp_path / "c"), "--report", "--figures", "svg")
    assert done.exit_code == 1
    files = {file.name for file in (tmp_path / "c").iterdir()}
    assert files == {"comparison.json", "differences.csv", "rules.csv", "overlay.svg", "report.html"}
    page = (tmp_path / "c" / "report.html").read_text()
    for words in ("not kept", "no compliance is claimed", "force_M1_wall_kN", "Nothing is extrapolated", "--report"):
        assert words in page
    table = pd.read_csv(tmp_path / "c" / "differences.csv").set_index("channel")
    assert table.loc["force_M1_wall_kN", "peak_difference_percent"] == pytest.approx(-100 / 6)
    assert "trainmj compare A B" in fails("report", str(tmp_path / "c"))


def test_many_channels_are_drawn_where_they_differ_most(result):
    """Breaks if a figure of a long train has a hundred panels, or leaves out what matters."""
    found = compare(scaled(result, force=1.2), result)
    assert [one.channel for one in figures.chosen(found, 2)] == ["force_M1_wall_kN", "force_M1_M2_kN"]
    html = page_of(found, "trainmj compare a b --report").html()
    for words in ("not kept", "no compliance is claimed", "force_M1_wall_kN", "Nothing is extrapolated", "--report"):
        assert words in html


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("{a}", "nosuch.csv"), "there is no such file"),
        (("nosuch", "{a}"), "nosuch"),
        (("t.csv", "{a}"), "the result comes first"),
        (("{a}", "."), "holds no result.nc"),
        (("{a}", "{a}", "--report"), "--report: needs --out"),
        (("{a}", "{a}", "--time", "t"), "is a result, which has no columns to name"),
        (("{a}", "t.csv", "--channel", "velocity_M1_km_h"), "must be PATH=VALUE"),
        (("{a}", "t.csv", "--channel", "x=a", "--channel", "x=b"), "x is named twice"),
        (("{a}", "{a}", "--out", "{here}"), "has a result that is compared"),
        (("{a}", "t.csv", "--align", "--offset-ms", "3"), "leave one of them out"),
    ],
)
def test_wrong_words_are_refused(folders, tmp_path, monkeypatch, args, said):
    monkeypatch.chdir(tmp_path)
    Path("t.csv").write_text("t,a\n0,1\n")
    assert said in fails("compare", *(arg.format(a=folders / "a.nc", here=folders) for arg in args))
