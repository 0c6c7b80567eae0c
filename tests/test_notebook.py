"""What a notebook shows of things, and what it takes for an answer."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from builders import values

import trainmj
from trainmj.collision.verdict import verdict as verdict_of
from trainmj.comparison import page as comparison_page
from trainmj.comparison import tables
from trainmj.comparison.screen import print_comparison
from trainmj.scenario import Scenario
from trainmj.single import page as single_page
from trainmj.single.screen import print_summary
from trainmj.sweep import page as sweep_page
from trainmj.sweep.screen import print_sweep

LIMITS = {"TS_mm": 5, "TAMA_g": 400}
TITLE = "<b>A & B</b>"
SOUGHT = {
    "scenario": "b_type",
    "set": {"simulation.step_ms": 0.5},
    "parameters": {"mass": {"sets": "mass_t", "bounds": [28, 36]}},
    "targets": {"TS": {"response": "TS_mm", "tolerance": "1 %"}},
    "data": {
        "tests": {
            "rows": [{"V": 20, "TS": 900}, {"V": 22, "TS": 1080}],
            "cases": {"V": "speed_km_h"},
            "values": {"TS": "TS"},
        }
    },
    "method": {"seed": 1, "explore": {"trials": 8}, "refine": {"iterations": 2}},
}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    of = Scenario.from_values(values([(0, 0), (10, 900), (500, 900)], 100))
    return of.with_values({"simulation.time_limit_s": 0.03, "limits": LIMITS, "title": TITLE})


@pytest.fixture(scope="module")
def result(scenario) -> trainmj.Result:
    return trainmj.run(scenario)


@pytest.fixture(scope="module")
def things(scenario, result, tmp_path_factory) -> dict[str, object]:
    folder = tmp_path_factory.mktemp("out")
    sweep = trainmj.grid_of(scenario, {"collision.gap_mm": [0, 5]})
    return {
        "Scenario": scenario,
        "Result": result,
        "Summary": trainmj.summarise(result),
        "Comparison": trainmj.compare(result, trainmj.run(scenario, {"collision.gap_mm": 1})),
        "Convergence": trainmj.converge(scenario),
        "Sweep": sweep,
        "SweepResult": trainmj.run_sweep(sweep, folder / "sweep"),
        "Study": trainmj.load_study("b_type"),
        "Identification": trainmj.load_targets("b_type"),
        "Standard": trainmj.load_assessment("en15227"),
        "Reliability": trainmj.load_reliability("b_type_as_built"),
    }


SAID = {
    "Scenario": [r"1 vehicle", "km/h"],
    "Result": ["limit passed", "TS", r"0\.030 s"],
    "Summary": ["limit passed", "1 of 2 limits is passed: TS"],
    "Comparison": [r"rules .*kept"],
    "Convergence": ["ettled at", "TS_mm"],
    "Sweep": ["2 cases", "collision.gap_mm"],
    "SweepResult": ["0 of 2 cases end within all limits; 2 past a limit"],
    "Study": ["D, M for TS, TAMA"],
    "Identification": ["11 values from"],
    "Standard": ["EN 15227", "identical_train"],
    "Reliability": ["1000 draws of 23"],
}


@pytest.mark.parametrize("name", SAID)
def test_a_thing_says_in_a_few_lines_what_it_is_and_how_it_ended(things, name):
    """Breaks if the last line of a cell fills the screen with arrays, or hides that a limit was passed."""
    said = repr(things[name])
    assert said.startswith(f"<{name} ")
    assert len(said) < 400
    assert "array(" not in said
    for words in SAID[name]:
        assert re.search(words, said), said


@pytest.mark.parametrize("name", SAID)
def test_a_notebook_shows_the_tables_of_the_report_escaped_and_light(things, name):
    """Breaks if a title runs as markup, a script or another address is loaded, or a cell weighs as much as a page."""
    html = things[name]._repr_html_()
    assert "<table>" in html
    assert len(html) < 60_000
    for forbidden in (TITLE, "<script", "http", "<html"):
        assert forbidden not in html
    if name in ("Scenario", "Result"):
        assert "&lt;b&gt;A &amp; B&lt;/b&gt;" in html


def test_numbers_of_a_cell_are_those_of_the_summary(things):
    summary = things["Summary"]
    html = summary._repr_html_()
    assert "1 of 2 limits is passed: TS" in html
    assert f"{summary.TS_mm:.1f} mm" in html
    assert 'class="verdict fail"' in html


def test_a_verdict_is_one_sentence_wherever_it_is_read(things, capsys):
    """Breaks if terminal, report, notebook and Python judge the same result in words of their own."""
    result, summary, swept, compared = (things[name] for name in ("Result", "Summary", "SweepResult", "Comparison"))
    for verdict, thing, page, show in (
        (
            verdict_of(summary),
            summary,
            single_page.page_of_run(result, summary),
            lambda: print_summary(result, summary),
        ),
        (swept.verdict, swept, sweep_page.page_of_folder(swept.folder), lambda: print_sweep(swept)),
        (tables.verdict(compared), compared, comparison_page.page_of(compared, ""), lambda: print_comparison(compared)),
    ):
        show()
        assert verdict.text in " ".join(capsys.readouterr().out.split())
        assert verdict.text in repr(thing)
        assert verdict.text in unescape(thing._repr_html_())
        assert page.verdict == verdict


def test_what_is_not_valid_says_so_in_both_ways():
    """Breaks if a result whose curve ended looks like a good one."""
    found = trainmj.run(Scenario.from_values(values([(0, 0), (10, 90), (20, 90)], 100)))
    assert "not valid after" in repr(found)
    assert "NOT VALID" in found._repr_html_()


def test_values_are_changed_by_keywords_and_by_paths(scenario):
    """Breaks if a keyword is ignored, or numpy's numbers are no numbers."""
    named = scenario.with_values({"parameters": {"speed": "collision.speed_km_h"}})
    asked = trainmj.run(named, {"collision.gap_mm": np.float64(5)}, speed=np.int64(12))
    assert asked.scenario.collision.speed_km_h == 12
    assert asked.scenario.collision.gap_mm == 5
    again = trainmj.run(named.with_values({"collision.gap_mm": 5, "speed": 12}))
    assert trainmj.repeated(asked, again).same
    assert trainmj.load("b_type", speed_km_h=20).collision.speed_km_h == 20
    assert named.with_values(speed=7).collision.speed_km_h == 7
    with pytest.raises(trainmj.InputError, match=r"sped.*did you mean 'speed'"):
        trainmj.run(named, sped=12)
    with pytest.raises(trainmj.InputError, match="speed: is given twice"):
        trainmj.run(named, {"speed": 3}, speed=4)


def test_neighbours_of_run_take_changes_too(scenario):
    changes = {"simulation.step_ms": 0.05}
    assert trainmj.converge(scenario, changes=changes).step_ms[0] == 0.05
    for call in (trainmj.bracket, trainmj.margins):
        with pytest.raises(trainmj.InputError, match="nosuch"):
            call(scenario, nosuch=1)


def test_a_summary_is_a_table_of_responses_interfaces_stages_vehicles_or_limits(things):
    summary = things["Summary"]
    whole = summary.to_frame()
    assert whole.loc["TS_mm", "value"] == summary.TS_mm
    assert whole.loc["TS_mm", "unit"] == "mm"
    assert list(whole.index) == list(summary.responses)
    assert summary.to_frame("interfaces")["stroke_mm"].tolist() == [i.stroke_mm for i in summary.interfaces]
    assert summary.to_frame("vehicles").index.tolist() == [v.name for v in summary.vehicles]
    assert summary.to_frame("limits")["kept"].tolist() == [False, True]
    assert len(summary.to_frame("stages")) == sum(len(i.stages) for i in summary.interfaces)
    with pytest.raises(trainmj.InputError, match=r"vehicle: there is no such table here; did you mean 'vehicles'"):
        summary.to_frame("vehicle")


def test_a_sweep_that_ended_is_its_table(things):
    assert things["SweepResult"].to_frame()["collision.gap_mm"].tolist() == [0, 5]


def test_a_plot_is_the_figure_of_the_folder(result):
    """Breaks if a notebook shows a plot as text, or another one than the command writes."""
    picture = result.plot(width="column")
    png, size = picture._repr_png_()
    assert png.startswith(b"\x89PNG")
    assert size["width"] == pytest.approx(84 / 25.4 * 96, abs=1)
    for name, said in (("bodies", "no such figure here; known: collision"), ("colision", "did you mean 'collision'")):
        with pytest.raises(trainmj.InputError, match=said):
            result.plot(name)
    with pytest.raises(trainmj.InputError, match="'wide' is no width"):
        result.plot(width="wide")


def test_the_report_of_a_result_in_memory(result, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert trainmj.write_report(result) == Path("report.html")
    page = Path("report.html").read_text(encoding="utf-8")
    assert "trainmj run scenario.yaml --out again --report" in page
    assert "trainmj report" not in page
    assert trainmj.write_report(result, "other.html") == Path("other.html")


@pytest.mark.thorough
def test_what_long_work_found_is_shown_too(small_study, tmp_path):
    """Breaks if a study, an identification, a reliability run, an assessment or a verification shows as nothing."""
    plan = trainmj.load_reliability("b_type_as_built", {"simulation.step_ms": 0.5})
    plan = replace(plan, spec=plan.spec.model_copy(update={"runs": 8, "rare": None, "sensitivity": None}))
    sought = trainmj.targets_of(SOUGHT)
    found = {
        "StudyResult": small_study,
        "ReliabilityResult": trainmj.run_reliability(plan, tmp_path / "reliability", figures=()),
        "Found": trainmj.identify(sought, tmp_path / "found", figures=()),
        "Assessment": trainmj.assess("en15227_c1", "en15227", "C-I"),
    }
    for name, thing in found.items():
        assert repr(thing).startswith(f"<{name} ")
        assert len(repr(thing).replace(str(tmp_path), "")) < 300
        html = thing._repr_html_()
        assert "<table>" in html
        assert "<script" not in html
        assert len(html) < 100_000
    for thing, figure in ((found["Found"], "residuals"), (found["ReliabilityResult"], "convergence")):
        assert thing.plot(figure)._repr_png_()[0].startswith(b"\x89PNG")
