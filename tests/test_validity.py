"""Where a curve ended behind which nothing is stated, everything that shows later numbers says so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.collision.status import Kind
from trainmj.output.page import Page
from trainmj.scenario import save
from trainmj.single.figures import collision
from trainmj.single.page import page_of_run
from trainmj.single.page_animation import animation_data
from trainmj.single.page_devices import add_devices
from trainmj.single.page_histories import add_histories

EVERY_KIND = Path(__file__).parent / "every_kind.yaml"
SHORT = {"devices.open.curve": {"stroke_mm": [0, 10, 30], "force_kN": [0, 200, 300]}}
"""A curve of M4-M5 that ends, with nothing stated behind it."""

SETS = ("--set", "devices.open.curve={stroke_mm: [0, 10, 30], force_kN: [0, 200, 300]}")
HELD = ("--set", "devices.open.beyond=hold")


@pytest.fixture(scope="module")
def result():
    return trainmj.run(trainmj.load(EVERY_KIND, SHORT))


@pytest.fixture(scope="module")
def summary(result):
    return trainmj.summarise(result)


def command(*args, code=1):
    done = CliRunner().invoke(main, [str(arg) for arg in args])
    assert done.exit_code == code, done.output
    return done.stdout


def one_line(text):
    return " ".join(text.split())


def test_it_is_when_the_stroke_reaches_the_end_of_the_curve(result, summary):
    """Breaks if the time is that of another device, or of the last and not the first end."""
    (open_,) = (i for i in summary.interfaces if i.device == "open")
    assert summary.status.where == ("M4-M5",)
    assert [i.name for i in summary.interfaces if i.beyond_curve] == ["M4-M5"]
    k = [i.name for i in result.chain.interfaces].index("M4-M5")
    passed = result.time[np.argmax(result.stroke[:, k] > 0.030)]
    assert passed - result.chain.record_interval <= summary.valid_until_s <= passed
    assert open_.stroke_mm > 30


def test_run_prints_it_above_and_beside_the_numbers():
    """Breaks if a table, a criterion or a verdict stands there as if it were valid."""
    said = command("run", EVERY_KIND, *SETS)
    assert max(map(len, said.splitlines())) <= 80
    assert "NOT VALID after 0.2" in said
    assert "Cure: a longer curve, or beyond: car_body, stop or hold." in one_line(said)
    mark = "not valid after 0.2"
    for line in ("TS: ", "TAMA: ", "Interfaces: ", "Vehicles: ", "Energy: ", "Limit: "):
        assert any(found.startswith(line) and mark in found for found in said.splitlines()), line
    assert said.count("NOT VALID") == 1 + 4, "four limits, none of which is kept or broken"
    assert "valid until, of the time simulated" in said


def test_its_exit_code_is_that_of_numbers_that_may_not_be_used():
    """As of an unstable run; with the user's own word on what follows it is 0."""
    assert "not valid" not in command("run", EVERY_KIND, *SETS, *HELD, "--set", "limits=null", code=0).lower()
    command("run", EVERY_KIND, *SETS, "--set", "limits=null", "--json", code=1)


def test_json_and_files_say_it(tmp_path, summary):
    """Breaks if a file can be read on its own and its numbers be taken for valid ones."""
    found = json.loads(command("run", EVERY_KIND, *SETS, "--json", "--out", tmp_path / "out", "--figures", "none"))
    assert (found["valid"], found["valid_until_s"]) == (False, summary.valid_until_s)
    assert {limit["valid"] for limit in found["limits"]} == {limit["kept"] for limit in found["limits"]} == {False}
    table = pd.read_csv(tmp_path / "out" / "histories.csv")
    assert (table["valid"] == (table["time_s"] <= summary.valid_until_s)).all()
    assert set(table["valid"]) == {0, 1}
    for name in ("interfaces", "vehicles"):
        rows = pd.read_csv(tmp_path / "out" / f"{name}.csv")
        assert rows["valid_until_s"].to_numpy() == pytest.approx(summary.valid_until_s, rel=1e-8)
    with xr.open_dataset(tmp_path / "out" / "result.nc", engine="scipy", decode_timedelta=False) as data:
        assert data.attrs["valid_until_s"] == summary.valid_until_s


def test_a_valid_run_has_no_mark(standard_result, standard_summary):
    assert (standard_result.not_valid, standard_summary.not_valid) == ("", "")
    assert standard_result.table()["valid"].all()
    plain = standard_summary.as_dict()
    assert (plain["valid"], plain["valid_until_s"]) == (True, None)
    assert "NOT VALID" not in page_of_run(standard_result, standard_summary, Path("result.nc")).html()


def test_the_page_marks_banner_tables_plots_paths_and_animation(result, summary):
    """Breaks if a part of the page shows what is not valid like what is."""
    html = page_of_run(result, summary, Path("result.nc")).html()
    assert "NOT VALID" in html
    assert "Cure: a longer curve" in html
    for title in ("Interfaces", "Vehicles", "Energy", "Limit"):
        assert f"{title}: {summary.not_valid}" in html
    section = Page("p").section("s")
    add_histories(section, result)
    plots = [json.loads(block.content["figure"]) for block in section.blocks if block.kind == "plot"]
    assert len(plots) == 6
    for plot in plots:
        (shape,) = (shape for shape in plot["layout"]["shapes"] if shape["type"] == "rect")  # beside lines of limits
        assert (shape["x0"], shape["x1"]) == pytest.approx((summary.valid_until_s, result.time[-1]))
        assert shape["label"]["text"] == "not valid"
    section = Page("p").section("s")
    add_devices(section, result)
    names = [t["name"] for b in section.blocks if b.kind == "plot" for t in json.loads(b.content["figure"])["data"]]
    assert f"M4-M5, {summary.not_valid}" in names
    assert animation_data(result)["valid_until"] == summary.valid_until_s


def test_the_figure_is_grey_where_it_is_not_valid(result, summary):
    picture = collision(result)
    assert f"Grey: {summary.not_valid}" in picture.get_suptitle()
    for axes in picture.axes:
        (grey,) = axes.patches
        assert grey.get_x() == pytest.approx(summary.valid_until_s)


def test_a_step_that_is_halved_is_marked_too():
    said = command(
        "run", EVERY_KIND, *SETS, "--set", "simulation.time_limit_s=0.25", "--converge", "--responses", "TS_mm"
    )
    assert "The step, halved until the responses settle: not valid after 0.2" in one_line(said)


def test_a_sweep_counts_such_cases_with_their_interface(tmp_path):
    """Breaks if they are counted as good, or only as past a limit, or enter the main effects."""
    vary = ("--vary", "collision.speed_km_h=5,8,25")
    words = ("sweep", EVERY_KIND, *SETS, "--set", "limits=null", *vary, "--out", tmp_path)
    said = command(*words, "--report", code=0)
    assert "0 of 3 cases end within all limits; 1 not valid; 2 cut off by the time limit." in said
    assert "The first: case 2, curve ended: at M4-M5 (" in said
    command(*words, "--fail-on-limit", code=1)
    table = trainmj.read_table(tmp_path)
    assert table["status"].tolist() == ["time limit", "time limit", Kind.CURVE_ENDED]
    assert table["valid_until_s"].notna().tolist() == [False, False, True]
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Crosses are not valid" in html
    assert "Not valid: a curve ended behind which nothing is stated" in html
    command("sweep", EVERY_KIND, *SETS, "--vary", "collision.speed_km_h=25,26", "--out", tmp_path / "all", code=1)


STUDY = {
    "factors": {
        "L": {"sets": "devices.open.curve.stroke_mm.2", "bounds": [30, 150], "unit": "mm"},
        "v": {"sets": "collision.speed_km_h", "bounds": [10, 25], "unit": "km/h"},
    },
    "responses": {"TAMA": "TAMA_g", "pull": "pull_M2_M3_kN", "body": "stroke_S1_M1_car_body_mm"},
    "design": {"kind": "full_factorial", "levels": {"L": 3, "v": 3}},
    "objectives": {"TAMA": "minimise", "pull": "minimise"},
    "surrogates": {"default": {"order": 1}},
    "cross_validation": {"against": []},
    "optimiser": {
        "on": "both", "surrogate": {"particles": 10, "iterations": 3}, "simulator": {"particles": 6, "iterations": 2},
    },
}  # fmt: skip


@pytest.mark.thorough
def test_a_study_uses_none_of_them(tmp_path):
    """Breaks if a design that is not valid enters correlation, surrogates or a front, or a check passes on one."""
    stiff = {"stroke_mm": [0, 10, 30], "force_kN": [0, 300, 500]}
    save(trainmj.load(EVERY_KIND, {"devices.open.curve": stiff, "limits": None}), tmp_path / "short.yaml")
    study = trainmj.study_of(STUDY | {"scenario": "short.yaml"}, tmp_path)
    found = trainmj.run_study(study, tmp_path / "out", figures=())
    simulated = found.tables["02_simulations"]
    invalid = int((simulated["status"] == Kind.CURVE_ENDED).sum())
    assert 0 < invalid < len(simulated) - 3
    assert (found.summary["simulations"]["failed"], found.summary["simulations"]["not_valid"]) == (invalid, invalid)
    assert found.summary["surrogates"]["n"] == len(simulated) - invalid
    assert set(found.tables["03_correlation"]["n"]) == {len(simulated) - invalid}
    assert Kind.CURVE_ENDED not in set(found.tables["06_front_simulator"].get("status", []))
    stands = {row["response"]: row["as_it_stands"] for row in found.summary["check"]["rows"]}
    assert stands == {"TAMA": None, "pull": None, "body": None}, "as it stands, it is not valid"
    assert "curve ended" in found.summary["as_it_stands"]["status"]
