"""What people see of a collision in the vertical plane: tables, files, figures, pages; brackets and margins of ties."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from builders import planar
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.collision.lineup import line_up
from trainmj.collision.margin import MOST
from trainmj.collision.result import SHOWN
from trainmj.errors import InputError
from trainmj.files.sealed import unsealed
from trainmj.scenario import Scenario, load
from trainmj.single import figures, plane, tables, tables_plane
from trainmj.single.beside import beside_of
from trainmj.single.page import page_of_run
from trainmj.sweep.page_responses import chosen_responses

SHORT = {
    "trains.b_type.vehicles": [{"name": "Tc", "coupler": "coupler_a_b"}, {"name": "Mp"}],
    "collision.offset_mm": {"M": 40},
    "simulation.step_ms": 0.5,
    "limits": {"wheel_lift_mm": 21, "step_mm": 155},
}
"""Two vehicles into their like; its ties hold, and without them it keeps its limits too."""


def short(**more: object) -> Scenario:
    return planar({**SHORT, **{path.replace("__", "."): value for path, value in more.items()}})


@pytest.fixture(scope="module")
def result():
    return trainmj.run(short())


@pytest.fixture(scope="module")
def summary(result):
    return trainmj.summarise(result)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The folder of a run with all that there is, and what it printed as JSON."""
    folder = tmp_path_factory.mktemp("plane")
    trainmj.save(short(bracket=["free", "stated", "tied"]), folder / "train.yaml")
    args = ["run", str(folder / "train.yaml"), "--margin", "--slip", "5", "--out", str(folder / "out")]
    done = CliRunner().invoke(main, [*args, "--report", "--figures", "svg", "--json"])
    assert done.exit_code == 0, done.output
    return folder / "out", json.loads(done.stdout)


def slid(**more: object) -> Scenario:
    """The same, so high that the faces slide off each other."""
    return short(collision__offset_mm={"M": 60}, **more)


# histories


def test_histories_of_the_plane_are_its_own(result, summary):
    """Steps, pitch, lifts or loads would be missing, of another sign or wheelset, or offered without the plane."""
    peaks = {v.name: v.pitch_mrad for v in summary.vehicles}
    for name, values in result.shown("pitch").items():
        assert values[np.abs(values).argmax()] == pytest.approx(peaks[name], rel=0.01)
    wheelsets = {w.name: w for v in summary.vehicles for w in v.wheelsets}
    for name, values in result.shown("load").items():
        assert values[0] == pytest.approx(1.0)
        assert values.min() == pytest.approx(wheelsets[name].load, abs=0.01)
    assert list(result.shown("load")) == list(wheelsets)
    assert list(result.shown("step")) == ["S1-M1", "M1-M2", "S1-S2"]
    assert result.shown("step")["S1-M1"][0] == pytest.approx(40.0), "the left vehicle stands so much higher"
    flat = trainmj.run(load("b_type_wall", {"simulation.time_limit_s": 0.01}))
    assert [name for name in SHOWN if name in ("step", "pitch", "lift", "load") and flat.shown(name)] == []
    assert not [name for name in flat.table() if name.startswith(("step", "pitch", "lift", "load"))]


def test_lift_over_time_is_the_lift_that_is_tallied():
    """The rise by which a rail springs back would be drawn as lift, or lift left out."""
    result = trainmj.run(short(vehicle_types__metro__body__cog_height_m=2.6, collision__offset_mm={"M": 100}))
    found = {w.name: w.lift_mm for v in trainmj.summarise(result).vehicles for w in v.wheelsets}
    assert max(found.values()) > 1.0
    for name, values in result.shown("lift").items():
        assert values.max() == pytest.approx(found[name], abs=0.2)


# tables


def test_faces_are_told_with_their_overlap(summary):
    """A step that comes near the overlap, or passes it, would read as one that does not."""
    (row,) = tables_plane._faces(summary).rows
    assert row[:3] == ("S1-M1", "anti_climber", pytest.approx(120))
    assert row[3] == summary.interfaces[0].met_step_mm
    assert (row[4], row[5].kind) == (pytest.approx(100 * row[3] / 120), "pass")
    early = trainmj.summarise(trainmj.run(short(simulation__time_limit_s=0.05)))
    assert tables_plane._faces(early).rows == [("1 more", "", None, None, None, "did not meet")]
    gone = trainmj.summarise(trainmj.run(slid()))
    (row,) = tables_plane._faces(gone).rows
    assert row[4] > 100
    assert (row[5].kind, row[5].text[:8]) == ("fail", "slid off")
    said = tables.why_not_valid(gone)
    assert said.startswith("override at S1-M1 anti_climber")
    assert "only held" not in said, "no curve ended"


def test_the_plane_has_a_table_of_its_own(result, summary):
    """Its columns would squeeze the table of vehicles to unreadable parts."""
    upright = list(tables_plane.in_plane(summary))[-1]
    assert [c.name for c in upright.columns][2:] == ["largest pitch", "largest heave", "wheel lift", "least N/N0"]
    others = {c.name for table in tables.vehicles(result.chain, summary) for c in table.columns}
    assert not others & {c.name for c in upright.columns[2:]}
    assert len(tables_plane.wheelsets(summary).rows) == 16


def test_running_gear_and_lines_are_listed(result):
    """A wrong frequency, height or tie in the input would not be seen before it has its effect."""
    moving, struck = tables_plane.gear_of(result.chain).rows
    assert (moving[0], struck[0]) == ("M1 to M2", "S1 to S2")
    assert (moving[4], struck[4]) == (pytest.approx(40), 0)
    body = 33 - 2 * 2.56 - 4 * 1.42
    heave = math.sqrt(2e6 / (1 / 0.7 + 0.5 / 3.4) / (body * 1e3)) / (2 * math.pi)
    assert (moving[1], moving[6]) == (pytest.approx(body), pytest.approx(heave))
    lines = {row[0]: row[1:] for row in tables_plane.lines_of(result.chain).rows}
    assert lines["front coupler"] == ("strut", 660, 1500, "2 MN m/rad from 100 mrad")
    assert lines["front anti_climber"] == ("face", 950, 120, "friction 0.2 + 0 kN, 100 kN/mm")
    lower = short(as_built={"S1-M1": {"stages.anti_climber.line.height_mm": 930}})
    rows = {row[0]: row[2] for row in tables_plane.lines_of(line_up(lower)).rows}
    assert (rows["front anti_climber at S1-M1 M1"], rows["front anti_climber at S1-M1 S1"]) == (930, pytest.approx(950))


def test_what_acted_of_what_is_seldom_published_is_said(result, summary):
    """The unpublished inputs that an answer hangs on would be taken for known."""
    said = plane.ruling(result, summary)
    assert "ties at S1-M1, which slipped" in said
    assert "swing stops" not in said
    swung = short(devices__front__stages__coupler__line__swing={"free_mrad": 10, "MN_m_per_rad": 2})
    again = trainmj.run(swung)
    assert "swing stops at S1-M1" in plane.ruling(again, trainmj.summarise(again))


# brackets


def test_a_bracket_is_the_same_collision_with_other_ties(ran):
    """Free, stated and tied would be mixed up, or differ from the runs that --set ties makes."""
    rows = {row["ties"]: row for row in ran[1]["bracket"]}
    assert list(rows) == ["free", "stated", "tied"]
    for ties, row in rows.items():
        alone = trainmj.summarise(trainmj.run(short(ties=ties)))
        assert row["largest_step_mm"] == alone.largest_step_mm
        assert row["slip_mm"] == alone.interfaces[0].slip_mm
        assert row["limits_kept"] == sum(c.kept for c in alone.limits)
    assert rows["tied"]["largest_step_mm"] < rows["stated"]["largest_step_mm"]
    assert rows["tied"]["slip_mm"] == 0 < rows["stated"]["slip_mm"] < rows["free"]["slip_mm"]
    with pytest.raises(InputError, match="plane: vertical"):
        trainmj.bracket("b_type")


@pytest.mark.parametrize(
    ("values", "option", "code"),
    [
        ({"collision__speed_km_h": 35, "collision__offset_mm": {"M": 80}}, [], 0),  # free, it overrides
        ({"collision__speed_km_h": 35, "collision__offset_mm": {"M": 80}}, ["--fail-on-limit"], 1),
        ({"limits": {"slip_mm": 10}}, [], 0),
        ({"limits": {"slip_mm": 10}}, ["--fail-on-limit"], 1),  # free, it slips further
    ],
)
def test_the_worst_of_a_bracket_fails_on_a_limit(tmp_path, values, option, code):
    """A collision that fails for want of a tie would pass where only the tie as stated holds it."""
    scenario = short(bracket=["free", "stated"], **values)
    assert not trainmj.summarise(trainmj.run(scenario)).status.unusable
    trainmj.save(scenario, tmp_path / "train.yaml")
    assert CliRunner().invoke(main, ["run", str(tmp_path / "train.yaml"), *option]).exit_code == code


# margins


def test_a_margin_is_where_the_ties_begin_to_fail(ran):
    """A factor would be no boundary: ties as strong would slip too far, or weaker ones hold as well."""
    (found,) = ran[1]["margins"]
    assert (found["interface"], found["slip_mm"]) == ("S1-M1", 5)
    assert 0 < found["factor"] < 1

    def slips(factor: float) -> float:
        tie = {"friction": 0.2 * factor, "tooth_kN": 0, "kN_per_mm": 100}
        changed = short(devices__front__stages__anti_climber__line__tie=tie)
        return trainmj.summarise(trainmj.run(changed)).interfaces[0].slip_mm

    assert slips(found["factor"]) <= 5 < slips(0.99 * found["factor"])
    assert "down to" in found["said"]


def test_margins_without_a_number_say_why():
    """Ties that never hold, or are not needed, would read as ones with a margin."""
    (needless,) = trainmj.margins(short(), slip_mm=100)
    assert (needless.factor, needless.said) == (0.0, "holds without any tie")
    (hopeless,) = trainmj.margins(slid())
    assert (hopeless.factor, hopeless.as_dict()["factor"]) == (math.inf, None)
    assert hopeless.said == f"never holds, up to {MOST:g} times its capacity"
    (without,) = trainmj.margins(short(devices__front__stages__anti_climber__line__tie="none"))
    assert without.said == "does not hold: no tie is stated"
    weak = replace(needless, factor=2.5)
    assert weak.said == "too weak: needs 2.5 times its capacity"
    verdicts = [row[-2].kind for row in tables_plane.margins([needless, weak, hopeless]).rows]
    assert verdicts == ["pass", "fail", "fail"]
    assert trainmj.margins(short(simulation__time_limit_s=0.05)) == (), "no faces met"


@pytest.mark.parametrize(
    ("scenario", "slip", "said"),
    [
        (load("b_type"), 10.0, "plane: vertical"),
        (short(ties="free"), 10.0, "ties: free"),
        (short(), math.nan, "nan mm"),
        (short(), -1.0, "-1 mm"),
    ],
)
def test_margins_are_of_ties_as_stated(scenario, slip, said):
    """A factor on what is not there, or a slip that nothing keeps, would give a number."""
    with pytest.raises(InputError, match=said):
        trainmj.margins(scenario, slip)


# files, figures, pages


def test_the_folder_has_all_of_the_plane(ran):
    """Wheelsets, a bracket or margins would be on the screen only."""
    folder, printed = ran
    assert unsealed((folder / "summary.json").read_bytes()) == printed
    for name in ("bracket", "margins"):
        read = pd.read_csv(folder / f"{name}.csv").to_dict("records")
        assert [row[next(iter(row))] for row in read] == [row[next(iter(row))] for row in printed[name]]
    wheelsets = pd.read_csv(folder / "wheelsets.csv")
    assert wheelsets["name"].tolist() == [w["name"] for v in printed["vehicles"] for w in v["wheelsets"]]
    assert {"step_mm", "met_step_mm"} <= set(pd.read_csv(folder / "interfaces.csv"))
    assert {"pitch_mrad", "wheel_load"} <= set(pd.read_csv(folder / "vehicles.csv"))
    assert (folder / "plane.svg").is_file()


def test_a_report_made_later_has_the_bracket_and_margins(ran):
    """A report from the folder would leave out what only the command had computed."""
    folder, printed = ran
    result = trainmj.load_result(folder / "result.nc")
    beside = beside_of(folder / "result.nc", result, trainmj.summarise(result))
    assert json.loads(json.dumps(beside.rows())) == {name: printed[name] for name in ("bracket", "margins")}
    first = (folder / "report.html").read_bytes()
    assert trainmj.write_report(folder).read_bytes() == first
    text = first.decode()
    for title in ("Bracket", "Margins of ties", "Running gear", "Lines of devices", "Loads of the wheelsets"):
        assert title in text


def test_a_summary_changed_by_hand_is_refused(ran, tmp_path):
    """A bracket that trainmj did not write would end in a traceback."""
    for name in ("result.nc", "summary.json"):
        (tmp_path / name).write_bytes((ran[0] / name).read_bytes())
    for text in ('{"bracket": [{}]}', '{"bracket": 1}', '{"margins": [{"factor": "x"}]}', "[]", "{"):
        (tmp_path / "summary.json").write_text(text)
        with pytest.raises(InputError, match="damaged or was changed"):
            trainmj.write_report(tmp_path)


def test_an_override_is_shown_from_when_on():
    """A page, a figure or a screen would show what is no prediction as a result."""
    result = trainmj.run(slid(limits={"step_mm": 10}))
    summary = trainmj.summarise(result)
    page = page_of_run(result, summary, Path("result.nc")).html()
    assert f"after {summary.valid_until_s:.4g} s: override at" in page
    figure = figures.plane(result, summary)
    assert all(axis.patches for axis in figure.axes), "shaded"
    names = [text.get_text() for text in figure.axes[0].texts]
    assert names == ["overlap of S1-M1", "limit of steps"]


def test_a_sweep_in_the_plane_draws_what_is_of_the_plane():
    """Steps and wheel loads, which the plane is computed for, would not be among the few responses that are drawn."""
    table = trainmj.run_cases(short(), {"collision.offset_mm.M": [20.0, 40.0]})
    drawn = {response.quantity for response in chosen_responses(table)}
    assert {"TS_mm", "largest_step_mm", "met_step_mm", "least_wheel_load"} <= drawn
