"""Reports from folders: what they say, how a folder is known, and what is refused."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import matplotlib.colors
import numpy as np
import pandas as pd
import pytest
from builders import changed, scenario, signed
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.cli.report import write_report
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import Column
from trainmj.collision.status import Kind
from trainmj.errors import InputError
from trainmj.output.page import Page
from trainmj.single import tables
from trainmj.single.page import page_of_run
from trainmj.single.page_animation import animation_data
from trainmj.single.page_devices import add_devices
from trainmj.single.page_histories import add_histories
from trainmj.sweep.page_limits import by_column, limits_of
from trainmj.sweep.page_responses import Factor, add_responses, chosen_responses, factors_of
from trainmj.units import KN, MM

BAR_MB = 7.0


def plots(section):
    """Content of the plots of a section, by title."""
    found = (block.content for block in section.blocks if block.kind == "plot")
    return {content["title"]: json.loads(content["figure"]) for content in found}


def text_of(file):
    """What a report says, without its scripts and styles."""
    html = re.sub(r"<(script|style)\b.*?</\1>", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html))


def without(folder, *names, to):
    """A copy of a folder without some files."""
    copy = to / "copy"
    shutil.copytree(folder, copy)
    for name in names:
        (copy / name).unlink()
    return copy


class TestRun:
    def test_says_what_the_summary_says(self, run_folder, standard_summary):
        said = text_of(run_folder / "report.html")
        assert f"{standard_summary.TS_mm:.1f}" in said
        assert f"{standard_summary.TAMA_g:.3f}" in said
        for v in standard_summary.vehicles:
            assert f"{v.peak_device_acceleration_g:.4f}" in said
        for i in standard_summary.interfaces:
            assert f"{i.stroke_mm:.1f}" in said
        for name, version in identity().items():
            assert f"{name} {version}" in said
        assert "trainmj report 'a run'" in said.replace("&#39;", "'")

    def test_lines_are_the_histories(self, standard_result):
        section = Page("p").section("s")
        add_histories(section, standard_result)
        found = plots(section)
        front = standard_result.chain.front
        force = next(t for t in found["Force"]["data"] if t["name"] == "S1-M1")
        assert force["dx"] == pytest.approx(1e-3)
        assert force["y"] == pytest.approx((standard_result.force[:, front] / KN).tolist(), rel=1e-4, abs=1e-3)
        stroke = next(t for t in found["Stroke"]["data"] if t["name"] == "S1-M1")
        assert max(stroke["y"]) == pytest.approx(standard_result.stroke[:, front].max() / 2 / MM, rel=1e-4)
        assert all("(" in found[name]["layout"]["yaxis"]["title"]["text"] for name in found)  # units

    def test_energies_add_up_to_that_of_the_start(self, standard_result, standard_summary):
        section = Page("p").section("s")
        add_histories(section, standard_result)
        lines = {t["name"]: np.array(t["y"]) for t in plots(section)["Where the energy is"]["data"]}
        b = standard_summary.balance
        assert sum(lines.values()) == pytest.approx(b.kinetic_start_kJ, rel=1e-4)
        assert lines["by the rails"][-1] == pytest.approx(b.friction_kJ, rel=0.01)
        assert lines["elastic or gas, in the devices"][-1] == pytest.approx(b.elastic_kJ, abs=1e-3 * b.kinetic_start_kJ)

    def test_paths_stay_on_or_below_the_envelope(self, standard_result):
        section = Page("p").section("s")
        add_devices(section, standard_result)
        devices = {d.name: d.envelope for i in standard_result.chain.interfaces for d in i.devices}
        for title, content in plots(section).items():
            at_rest, let_go, *paths = content["data"]
            assert (let_go["name"], let_go["y"][0]) == ("at rest, let go", at_rest["y"][-1])
            assert paths, title
            crush = devices[title.removeprefix("Device ")]
            u = np.unique(np.append(crush.stroke, crush.stroke[-1] * 2))
            envelope = {"x": u / MM, "y": [crush.force_at(x) / KN for x in u]}
            for path in paths:
                u, f = np.array(path["x"]), np.array(path["y"])
                allowed = np.maximum.reduce(
                    [np.interp(u + shift, envelope["x"], envelope["y"]) for shift in (-0.5, 0, 0.5)]
                )
                assert (f <= allowed + 1.0).all(), f"{title}: {path['name']}"

    def test_animation_has_the_strokes_and_energies_of_the_result(self, standard_result):
        data = animation_data(standard_result)
        front = data["front"]
        assert data["interfaces"][front] == "S1-M1"
        own, partner = data["devices"][front]
        assert own == partner
        pressed = [u / 2 for u in data["stroke"][front]]
        largest = int(np.argmax(pressed))
        shown = [max(0.0, u) for u in pressed[: largest + 1]]
        assert own["stroke"][: largest + 1] == pytest.approx(shown, rel=1e-3, abs=0.05), "as it is pressed"
        assert min(own["stroke"][largest:]) > max(pressed) - 2, "what was crushed stays short"
        (in_table,) = (i for i in trainmj.summarise(standard_result).interfaces if i.name == "S1-M1")
        assert max(own["stroke"]) == pytest.approx(in_table.stroke_mm, rel=1e-3), "as the table has it"
        assert own["energy"][-1] == pytest.approx(in_table.energy_kJ, rel=1e-3)

    @pytest.mark.thorough
    def test_a_long_train_shows_what_is_next_to_the_impact(self):
        long = scenario([(0, 0), (500, 2000)], 100, mass_t=[33] * 40, speed_m_s=2, step_ms=0.2, time_limit_s=0.3)
        result = trainmj.run(long)
        data = animation_data(result)
        assert data["vehicles"] == [f"M{k}" for k in range(7, 0, -1)]
        assert data["wall"]
        html = page_of_run(result, trainmj.summarise(result), Path("x/result.nc")).html()
        assert "33 vehicles further away are left out" in html

    def test_failed_limits_are_said(self, standard, tmp_path):
        result = trainmj.run(standard.with_values({"speed_km_h": 40}))
        summary = trainmj.summarise(result)
        assert summary.status.kind == Kind.EXHAUSTED
        page_of_run(result, summary, tmp_path / "result.nc").write(tmp_path / "report.html")
        said = text_of(tmp_path / "report.html")
        assert "not all are kept" in said
        assert "✗ fail" in said

    @pytest.mark.filterwarnings("ignore:invalid value encountered in subtract")  # inf - inf, put in here
    def test_values_that_are_not_finite_are_said_and_drawn_as_gaps(self, standard_result):
        force = standard_result.force.copy()
        velocity = standard_result.velocity.copy()
        force[100:], velocity[100:] = np.nan, np.inf
        energy = np.full_like(force, np.nan)
        stroke = np.full(len(standard_result.chain.interfaces), np.nan)
        tally = changed(standard_result.tally, stroke_max=stroke)
        result = replace(standard_result, force=force, velocity=velocity, energy=energy, tally=tally)
        summary = trainmj.summarise(result)
        html = page_of_run(result, summary, Path("x/result.nc")).html()
        assert "unstable" in html
        assert "NaN" not in re.sub(r"<script>.*?</script>", "", html, flags=re.DOTALL)

    def test_a_saved_result_of_another_name(self, run_folder, tmp_path):
        shutil.copy(run_folder / "result.nc", tmp_path / "case_3.nc")
        assert write_report(tmp_path / "case_3.nc") == tmp_path / "case_3.html"
        assert (tmp_path / "case_3.html").stat().st_size < 1e6 * BAR_MB

    @pytest.mark.thorough
    def test_size(self, run_folder, tmp_path, python):
        """A page can be mailed; most of it is the script that draws plots."""
        done = python("-m", "trainmj", "report", str(run_folder), "--out", str(tmp_path / "mine.html"))
        assert (done.returncode, done.stderr) == (0, "")
        assert "mine.html" in done.stdout
        assert (tmp_path / "mine.html").stat().st_size < 1e6 * BAR_MB


class TestSweep:
    def test_says_how_the_cases_ended(self, sweep_folder):
        table = trainmj.read_table(sweep_folder)
        said = text_of(sweep_folder / "report.html")
        assert f"{len(table)} of {len(table)}" in said
        for status, count in table["status"].value_counts().items():
            assert re.search(rf"{status} {count} ", said)
        assert "must be at least 0.001" in said  # why mass_t = -1 is refused

    def test_effects_are_differences_of_means(self, sweep_folder):
        table = trainmj.read_table(sweep_folder)
        good = table[table["status"] != Kind.REFUSED]
        means = good.groupby("empty_stroke_mm")["TS_mm"].mean()
        said = text_of(sweep_folder / "report.html")
        assert f"empty_stroke_mm {means.max() - means.min():.4g}" in said

    def test_the_factor_that_moves_a_response_most_is_on_the_axis(self):
        """Breaks if responses are drawn over the factor with most levels, whatever that does to them."""
        cases = [(a, b, case) for a in range(6) for b in range(2) for case in ("x", "y")]
        table = pd.DataFrame(cases, columns=["a_mm", "b_t", "load_case"]).assign(status="over")
        table = table.assign(
            of_a=table["a_mm"] * 1.0, of_b=table["b_t"] * 9.0, of_case=9.0 * (table["load_case"] == "x")
        )
        responses = [Column(name, "", 1, name, "", name, ()) for name in ("of_a", "of_b", "of_case")]
        section = Page("p").section("s")
        add_responses(section, table, factors_of(table, ["a_mm", "b_t", "load_case"]), responses)
        assert list(plots(section)) == ["of_a over a", "of_b over b", "of_case over a"]

    def test_limits_are_those_that_every_case_has(self, standard):
        """Breaks if the limit of an interface is drawn for a stage of it, or one that is varied as if it were one."""
        found = by_column(line_up(standard.with_values({"limits.stroke_mm": 500})))
        wanted = {"stroke_S1_M1_mm": 500.0, "stroke_S1_M1_anti_climber_mm": 265.0, "stroke_M1_M2_mm": 418.0}
        assert {name: found[name] for name in wanted} == wanted
        assert found["peak_device_M6_g"] == 5.0
        assert "peak_device_S1_g" not in found
        varied = [Factor("devices.coupler_a_b.stroke_limit_mm", [400.0, 418.0], True), Factor("mass_t", [30, -1], True)]
        same = limits_of([standard], varied)
        assert "stroke_M1_M2_mm" not in same
        assert same["stroke_M2_M3_mm"] == 418.0
        bare = standard.with_values({"limits": {}})
        assert not any(name.startswith("peak") for name in limits_of([standard, bare], [])), "of one load case only"

    def test_of_many_responses_those_near_the_impact_are_drawn(self, sweep_folder):
        drawn = chosen_responses(trainmj.read_table(sweep_folder))
        assert [r.name for r in drawn] == [
            "TS_mm",
            "TAMA_g",
            "stroke_M1_wall_mm",
            "stroke_S1_M1_mm",
            "stroke_M1_wall_anti_climber_mm",
            "stroke_S1_M1_anti_climber_mm",
            "peak_device_M1_g",
            "peak_device_M2_g",
        ]
        said = text_of(sweep_folder / "report.html")
        assert "stroke S1-M1 anti climber over" in said

    def test_units_are_those_of_the_store(self, sweep_folder, tmp_path):
        copy = without(sweep_folder, to=tmp_path)
        with sqlite3.connect(copy / "results.sqlite") as db:
            (columns,) = db.execute("SELECT value FROM about WHERE key = 'columns'").fetchone()
            columns = json.loads(columns)
            columns["TAMA_g"] |= {"unit": "m/s2", "title": "mean peak"}
            db.execute("UPDATE about SET value = ? WHERE key = 'columns'", (json.dumps(columns),))
            signed(db)
        said = text_of(write_report(copy))
        assert "mean peak over" in said
        assert "mean peak m/s2" in said

    def test_levels(self, sweep_folder):
        factors = factors_of(trainmj.read_table(sweep_folder), ["mass_t", "collision.partner"])
        assert factors[0].levels == [-1.0, 30.0, 36.0]
        assert not factors[1].numeric
        assert factors[1].places(["rigid_wall", "b_type"]).tolist() == [1.0, 0.0]

    def test_an_unfinished_sweep(self, sweep_folder, tmp_path):
        copy = without(sweep_folder, to=tmp_path)
        with sqlite3.connect(copy / "results.sqlite") as db:
            db.execute('DELETE FROM results WHERE "case" > 3')
            signed(db)
        assert "unfinished: the same command goes on" in text_of(write_report(copy))

    def test_no_finished_case(self, sweep_folder, tmp_path):
        copy = without(sweep_folder, to=tmp_path)
        with sqlite3.connect(copy / "results.sqlite") as db:
            db.execute("DELETE FROM results")
            signed(db)
        with pytest.raises(InputError, match="no case of this sweep is finished"):
            write_report(copy)

    def test_many_random_cases_are_points(self, standard, tmp_path):
        draw = np.random.default_rng(1)
        columns = {"empty_stroke_mm": draw.uniform(20, 50, 20).tolist(), "mass_t": draw.uniform(30, 36, 20).tolist()}
        sweep = trainmj.Sweep(standard.with_values({"simulation.step_ms": 0.5}), (columns,))
        trainmj.run_sweep(sweep, tmp_path)
        html = write_report(tmp_path).read_text(encoding="utf-8")
        assert '"colorbar"' in html
        assert "30 to" not in html or "classes" in html


class TestStudy:
    def test_correlation_has_the_colours_of_every_picture(self, study_folder):
        """Breaks if the same sign has one colour on a page and another one in a figure."""
        from trainmj.output.style import BLUE, ORANGE, diverging, styled

        with styled():
            ends = [matplotlib.colors.to_hex(diverging()(at)).upper() for at in (0.0, 0.5, 1.0)]
        assert ends == [ORANGE, "#FFFFFF", BLUE]
        html = (study_folder / "report.html").read_text()
        (scale,) = set(re.findall(r'"type":"heatmap".*?"colorscale":\[\[(.*?)\]\]', html))
        assert re.findall("#[0-9A-F]{6}", scale.upper()) == ends

    def test_says_what_was_chosen(self, study_folder):
        facts = json.loads((study_folder / "summary.json").read_text())
        said = text_of(study_folder / "report.html")
        assert facts["decision"]["chosen"]["C"] in said
        for row in facts["check"]["rows"]:
            assert f"{row['simulated']:.5g}" in said
        for weight in facts["weights"]["weights"].values():
            assert f"{weight:.4f}" in said

    def test_its_files_make_the_study_again(self, study_folder, tmp_path):
        from trainmj.files.yaml import as_yaml

        facts = json.loads((study_folder / "summary.json").read_text())
        (tmp_path / "again.study.yaml").write_text(as_yaml(facts["study"]))
        (tmp_path / "scenario.yaml").write_text(facts["scenario"])
        again = trainmj.load_study(tmp_path / "again.study.yaml")
        assert again.scenario.values() == trainmj.load("b_type", {"simulation.step_ms": 0.5}).values()
        assert [f.name for f in again.space.factors] == ["D", "C"]

    @pytest.mark.parametrize("missing", ["summary.json", "02_simulations.csv"])
    def test_unfinished(self, study_folder, tmp_path, missing):
        with pytest.raises(InputError, match=r"not finished|of a finished one|damaged"):
            write_report(without(study_folder, missing, to=tmp_path))

    @pytest.mark.parametrize("content", ["[]", "{", '{"check": 1}', '{"check": {"rows": null}}', "\udc00"])
    def test_damaged(self, study_folder, tmp_path, content):
        copy = without(study_folder, to=tmp_path)
        (copy / "summary.json").write_bytes(content.encode("utf-8", "surrogatepass"))
        with pytest.raises(InputError, match=r"study|damaged"):
            write_report(copy)


class TestFolder:
    def test_holds_nothing(self, tmp_path):
        with pytest.raises(InputError, match=r"holds no results: none of the files result\.nc \(a run\)"):
            write_report(tmp_path)

    def test_is_not_there(self, tmp_path):
        with pytest.raises(InputError, match="there is no such folder"):
            write_report(tmp_path / "nowhere")

    def test_is_another_file(self, tmp_path):
        (tmp_path / "a.txt").write_text("a")
        with pytest.raises(InputError, match="is not a result"):
            write_report(tmp_path / "a.txt")

    def test_holds_two(self, sweep_folder, run_folder, tmp_path):
        copy = without(sweep_folder, to=tmp_path)
        shutil.copy(run_folder / "result.nc", copy)
        with pytest.raises(InputError, match="a run and a sweep: name one"):
            write_report(copy)
        assert "Sweep" in text_of(write_report(copy / "results.sqlite"))

    @pytest.mark.parametrize(
        ("file", "cure"),
        [("trials.sqlite", "trainmj identify TARGETS --out .* --report"), ("paper.html", "trainmj paper --out")],
    )
    def test_holds_what_another_command_reports(self, tmp_path, file, cure):
        (tmp_path / file).touch()
        with pytest.raises(InputError, match=cure):
            write_report(tmp_path)
        (tmp_path / "result.nc").touch()
        with pytest.raises(InputError, match=r"holds a run and an? .*: name one"):
            write_report(tmp_path)

    @pytest.mark.parametrize("name", ["result.nc", "results.sqlite", "steps.json"])
    def test_holds_something_else_of_that_name(self, tmp_path, name):
        (tmp_path / name).write_bytes(b"\x00\xffnothing")
        with pytest.raises(InputError, match=re.escape(str(tmp_path))):
            write_report(tmp_path)


class TestCommand:
    def call(self, *arguments):
        return CliRunner().invoke(main, [str(a) for a in arguments])

    def test_run_with_report_needs_a_folder(self):
        done = self.call("run", "b_type", "--report")
        assert done.exit_code == 2
        assert "--report: needs --out" in done.stderr

    def test_sweep_with_report(self, tmp_path):
        out = tmp_path / "out"
        fast = ("--set", "simulation.step_ms=0.5")
        done = self.call("sweep", "b_type", *fast, "--vary", "mass_t=30,36", "--out", out, "--report")
        assert done.exit_code == 0, done.stderr
        assert f"Report: {out / 'report.html'}" in done.stdout.replace("\n", "")
        assert (out / "report.html").is_file()

    def test_errors_are_said_without_a_traceback(self, tmp_path):
        done = self.call("report", tmp_path)
        assert done.exit_code == 2
        assert done.stderr.startswith("Error: ")


EVERY_KIND = Path(__file__).parents[1] / "every_kind.yaml"


def line_of(trace):
    """(n,) values of a line, evenly spaced or not."""
    y = np.array(trace["y"])
    return np.array(trace["x"]) if "x" in trace else trace["x0"] + trace["dx"] * np.arange(len(y)), y


@pytest.fixture(scope="module")
def result():
    return trainmj.run(EVERY_KIND)


@pytest.fixture(scope="module")
def devices(result):
    section = Page("p").section("s")
    add_devices(section, result)
    found = {title.removeprefix("Device "): content["data"] for title, content in plots(section).items()}
    return {name: {t["name"]: line_of(t) for t in data} for name, data in found.items()}


class TestEveryKind:
    """The report of a train with every kind of device, against an unequal front."""

    def test_every_device_is_drawn_by_its_own_law(self, devices):
        """Breaks if a kind is drawn by its curve at rest alone, or by another kind's law."""
        assert list(devices) == ["coupler", "gear", "oil", "held", "open", "gas"]
        v = 25 / 3.6
        u, f = devices["oil"]["at 6.94 m/s"]
        assert np.interp(50, u, f) == pytest.approx(100 + 40 * v**2, rel=1e-3), "preload and orifice"
        u, f = devices["gas"]["at rest"]
        assert np.interp(60, u, f) == pytest.approx(50 * (1 - 60 / 120) ** -1.3, rel=1e-3)
        u, f = devices["coupler"]["at 6.94 m/s"]
        assert np.interp(30, u, f) == pytest.approx(300 * (1 + (v / 20) ** 0.2), rel=1e-3), "Cowper and Symonds"
        u, f = devices["gear"]["at rest, let go"]
        assert np.interp(-55, -u, f) == pytest.approx(50 + 45 * 150 / 90, rel=1e-3), "the lower curve"
        assert not any("m/s" in name for name in devices["held"]), "crush alone does not depend on the rate"

    def test_draw_gear_is_drawn_where_it_was_pulled(self, devices, result):
        """Breaks if a pull has no picture, or its slack or breaking force is not in it."""
        u, f = devices["gear"]["draw gear"]
        pulled = (u > -32.0 + 0.2) & (u < -20.0)
        assert f[pulled] == pytest.approx(-50 * (-u[pulled] - 20), rel=1e-3, abs=0.1)
        k = [i.name for i in result.chain.interfaces].index("M2-M3")
        assert result.force[:, k].min() < 0
        assert devices["gear"]["M2-M3"][1].min() == pytest.approx(result.force[:, k].min() / KN, rel=1e-3)

    def test_energies_add_up_with_brakes_and_grade(self, result):
        """Breaks if what brakes or a grade took is drawn as if devices held it."""
        section = Page("p").section("s")
        add_histories(section, result)
        lines = {t["name"]: np.array(t["y"]) for t in plots(section)["Where the energy is"]["data"]}
        b = trainmj.summarise(result).balance
        assert sum(lines.values()) == pytest.approx(b.kinetic_start_kJ, rel=1e-4)
        assert lines["by the brakes"][-1] == pytest.approx(b.brakes_kJ, rel=0.01)
        assert lines["by the grade"][-1] == pytest.approx(b.grade_kJ, rel=1e-3)
        held = lines["elastic or gas, in the devices"][-1]
        assert held == pytest.approx(b.elastic_kJ + b.gas_kJ, abs=2e-3 * b.kinetic_start_kJ)

    def test_tables_have_energies_of_stages_pulls_and_brakes(self, result):
        """Breaks if a stage is without its energy, or a vehicle without what brakes it."""
        summary = trainmj.summarise(result)
        table = tables.interfaces(summary)
        heads = [c.name for c in table.columns]
        rows = [dict(zip(heads, row, strict=True)) for row in table.rows]
        front = next(row for row in rows if row["Interface"] == "S1-M1")
        stages = [row for row in rows if row["Interface"].strip() in ("coupler", "anti_climber", "car_body")][:3]
        assert sum(row["absorbed energy"] for row in stages) == pytest.approx(front["absorbed energy"], rel=1e-6)
        assert "peak pull" in heads
        vehicles = tables.vehicles_of(result.chain)
        brakes = {row[0]: row[5:] for row in vehicles.rows}
        assert brakes["M2"] == pytest.approx((0.01, 34.6, 0, 0, np.inf))
        assert brakes["M1"] == pytest.approx((0.01, 33, 0.5, 1.5, 0.15 * 34.6 * 9.80665))
        assert brakes["S1"] == (0.0, None, None, None, None)

    @pytest.mark.parametrize(
        ("partner", "said", "halves"),
        [("lorry", "lorry, free obstacle, standing", 2), ("stop", "stop, fixed obstacle", 2)],
    )
    def test_an_obstacle_is_a_partner(self, partner, said, halves):
        """Breaks if the page calls it a train or a wall, or draws half of the devices."""
        changes = {"collision.partner": partner, "limits": None, "simulation.time_limit_s": 0.1}
        result = trainmj.run(trainmj.load(EVERY_KIND, changes))
        html = page_of_run(result, trainmj.summarise(result), Path("result.nc")).html()
        assert said in html
        assert len(animation_data(result)["devices"][-1]) == halves


def test_rows_of_what_does_not_occur_are_left_out(standard_summary):
    """Breaks if a crushed train is told of gas and brakes; the JSON has all."""
    names = [row[0].strip() for row in tables.energy(standard_summary).rows]
    assert names == [
        "kinetic at the start", "kinetic at the end", "elastic, still in the devices", "absorbed by the devices",
        "by crushing", "by speed", "by the rails",
    ]  # fmt: skip
    assert standard_summary.as_dict()["balance"]["brakes_kJ"] == 0.0
    assert "peak pull" not in [c.name for c in tables.interfaces(standard_summary).columns]
