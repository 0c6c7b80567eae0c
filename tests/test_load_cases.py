"""Load cases: what a file may state of them, and a sweep over several of them."""

import json
import re
import shutil
import sqlite3

import pandas as pd
import pytest
from builders import each_alone, signed
from click.testing import CliRunner

import trainmj
from trainmj.cases.engine import Local
from trainmj.cli import main
from trainmj.sweep.outcome import outcome_of
from trainmj.sweep.run import check_responses

FAST = "simulation.step_ms: 0.5, simulation.time_limit_s: 0.2, simulation.record_every_ms: 5"
MINE = f"""\
scenario: b_type
set: {{{FAST}}}
cases:
  fast: {{title: As the standard has it, set: {{speed_km_h: 25, limits.TS_mm: 5000}}}}
  into_wagon: {{set: {{collision.partner: wagon_80t, trains.wagon_80t.mass_t: 60}}}}
  slow: {{set: {{speed_km_h: 15}}}}
vary: {{mass_t: [30, 36]}}
"""


def command(*words):
    return CliRunner().invoke(main, list(map(str, words)))


def text_of(page):
    """What is read on a page."""
    return " ".join(re.sub(r"<[^>]*>", " ", page.read_text(encoding="utf-8")).split())


def written(tmp_path, text=MINE):
    file = tmp_path / "my.sweep.yaml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A sweep with three load cases, on two threads, with histories and report."""
    folder = tmp_path_factory.mktemp("load_cases")
    out, file = folder / "out", written(folder, MINE + "histories: [3]\n")
    done = command("sweep", file, "--out", out, "--threads", "2", "--report", "--parquet")
    assert done.exit_code == 0, done.output
    return out, file, done.output


# what a file may state


def test_a_partner_file_may_be_taken_over_and_changed_in_one_go():
    """Breaks if a value of the new partner is looked for before its file is read."""
    changes = {"trains.wagon_80t.mass_t": 60, "collision.partner": "wagon_80t"}  # in either order
    together = trainmj.load("b_type", changes)
    one_by_one = trainmj.load("b_type", {"collision.partner": "wagon_80t"}).with_values({"trains.wagon_80t.mass_t": 60})
    assert together.values() == one_by_one.values()
    assert together.sources["trains.wagon_80t.mass_t"].mark == "changed"
    assert any(file.name == "wagon_80t.partner.yaml" for file in together.files)
    assert trainmj.load("wagon_80t").locate("trains.wagon_80t.mass_t") == [80], "the file of the partner was changed"
    with pytest.raises(trainmj.InputError, match=r"trains\.wagon_80t\.mass_t = -60: must be at least"):
        trainmj.load("b_type", changes | {"trains.wagon_80t.mass_t": -60})


def test_load_cases_change_what_the_file_states_or_take_another_scenario(tmp_path):
    (tmp_path / "tram.yaml").write_text("builds_on: b_type\ntitle: Tram\n", encoding="utf-8")
    text = (
        "scenario: b_type\nset: {collision.speed_km_h: 20, simulation.step_ms: 0.5}\n"
        "cases:\n  same: {}\n  faster: {set: {collision.speed_km_h: 30}}\n"
        "  tram: {scenario: tram.yaml}\n  main_line: {scenario: wagon_80t}\n"
    )
    sweep = trainmj.load_sweep(written(tmp_path, text))
    scenarios = sweep.load_cases
    assert [s.collision.speed_km_h for s in scenarios.values()] == [20, 30, 20, 20]
    assert {s.simulation.step_ms for s in scenarios.values()} == {0.5}
    assert (scenarios["tram"].title, scenarios["main_line"].collision.partner) == ("Tram", "wagon_80t")
    assert [values for _, values in sweep.cases()] == [{"load_case": name} for name in scenarios]
    assert {"tram.yaml", "wagon_80t.yaml"} <= {file.name for file in sweep.files}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("  fast:", "  1st:", "my.sweep.yaml:4:3: cases.1st: must be a letter, then letters, digits and _"),
        ("  fast:", "  f-1:", "must be a letter, then letters, digits and _"),
        (MINE[MINE.index("cases") :], "cases: {}\n", "my.sweep.yaml:3:1: cases: must have at least 1 entry"),
        (MINE[MINE.index("cases") :], "cases: 3\n", "cases = 3: must be load cases by name"),
        ("title:", "titel:", "cases.fast.titel = 'As the standard has it': unknown key; did you mean 'title'?"),
        ("{speed_km_h: 15}", "{speed: 15}", "my.sweep.yaml:6:16: cases.slow.set.speed = 15: there is no"),
        ("mass_t: 60", "mass_t: -60", "cases.into_wagon.set.trains.wagon_80t.mass_t = -60: must be at least"),
        ("  slow: {", "  slow: {scenario: b_typ, ", "cases.slow.scenario = 'b_typ': there is no such file"),
        (
            "  slow: {set: {speed_km_h: 15}}",
            "  slow: {scenario: en15227_c1}",
            "my.sweep.yaml:7:8: vary.mass_t: there is no 'mass_t' in the scenario",
        ),
        ("  slow: {set: {speed_km_h: 15}}", "  slow: {scenario: en15227_c1}", "(in load case slow)"),
        ("set: {sim", "set: {gap: 1, sim", "set.gap = 1: there is no 'gap' in the scenario"),
        ("set: {sim", "set: {mass_t: 1, sim", "mass_t: is varied, and set for every case"),
        ("{speed_km_h: 15}", "{trains.b_type.mass_t: 31}", "set, as trains.b_type.mass_t, in load case"),
        (MINE[MINE.index("cases") :], "cases: c.csv\ntable: c.csv\n", "cases = 'c.csv': is a file, and"),
        ("mass_t: [", "load_case: [", "there is no 'load_case' in the scenario"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_load_cases_is_said_with_its_place(tmp_path, old, new, words):
    assert old in MINE
    with pytest.raises(trainmj.InputError) as caught:
        trainmj.load_sweep(written(tmp_path, MINE.replace(old, new, 1)))
    assert words in str(caught.value)


def test_a_change_for_every_case_does_not_undo_a_load_case(tmp_path):
    """Breaks if --set of a speed makes load cases equal that differ by their speeds, and nobody is told."""
    file = written(tmp_path)
    done = command("sweep", file, "--set", "collision.speed_km_h=9", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "collision.speed_km_h: is set for every case and in a load case, which it would undo" in done.stderr
    assert "(in load case fast)" in done.stderr
    assert trainmj.load_sweep(file, {"limits.TAMA_g": 2}).load_cases["slow"].limits == {
        **trainmj.load("b_type").limits,
        "TAMA_g": 2,
    }


def test_a_table_of_cases_may_stand_beside_load_cases(tmp_path):
    (tmp_path / "rows.csv").write_text("collision.gap_mm,collision.rail_friction\n0,0\n10,0.01\n", encoding="utf-8")
    sweep = trainmj.load_sweep(written(tmp_path, MINE + "table: rows.csv\n"))
    assert len(sweep) == 3 * 2 * 2
    assert sweep.case(7) == {
        "load_case": "into_wagon", "mass_t": 36, "collision.gap_mm": 10, "collision.rail_friction": 0.01
    }  # fmt: skip
    plain = MINE[: MINE.index("cases")]
    old, new = (trainmj.load_sweep(written(tmp_path, f"{plain}{key}: rows.csv\n")) for key in ("cases", "table"))
    assert list(old.cases()) == list(new.cases())
    assert old.inputs == new.inputs, "a folder of the one is taken for that of another sweep"


# a sweep


def test_rows_are_single_runs_of_the_load_case_and_the_load_case_varies_slowest(swept):
    out, file, _ = swept
    table = trainmj.read_table(out)
    assert table.load_case.tolist() == ["fast", "fast", "into_wagon", "into_wagon", "slow", "slow"]
    assert list(table.columns[:3]) == ["load_case", "mass_t", "status"]
    fast = {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.2, "simulation.record_every_ms": 5}
    wagon = {"collision.partner": "wagon_80t", "trains.wagon_80t.mass_t": 60}
    own = [{"speed_km_h": 25, "limits.TS_mm": 5000}, wagon, {"speed_km_h": 15}]
    for number, row in table.iterrows():
        alone = trainmj.summarise(trainmj.run(trainmj.load("b_type", fast | own[number // 2] | {"mass_t": row.mass_t})))
        found = {name: row[name] for name in table.attrs["columns"] if not name.startswith("percent_of_")}
        assert {name: value for name, value in found.items() if not pd.isna(value)} == {
            name: value for name, value in alone.responses.items() if not pd.isna(value)
        }
        for limit in alone.limits:
            assert row[f"percent_of_{limit.name}"] == limit.used
    history = trainmj.load_result(out / "case_3.nc")
    assert trainmj.summarise(history).TS_mm == table.TS_mm[3]
    assert history.scenario.locate("trains.wagon_80t.mass_t") == [60]
    assert table["percent_of_TS_mm"].notna().tolist() == [True, True, *[False] * 4], "a limit of fast alone"
    assert pd.read_parquet(out / "results.parquet").load_case.tolist() == table.load_case.tolist()
    assert trainmj.load_sweep(file).scenario_of(3).values() == history.scenario.values()


def test_a_killed_sweep_goes_on_to_the_same_table_on_one_thread(swept, tmp_path):
    out, file, _ = swept
    sweep = trainmj.load_sweep(file)

    class Interrupted(Local):
        def __call__(self, cases):
            for n, computed in enumerate(each_alone(super().__call__(cases))):
                if n == 1 and self.scenario.collision.partner == "wagon_80t":
                    raise KeyboardInterrupt
                yield computed

    with pytest.raises(KeyboardInterrupt):
        trainmj.run_sweep(sweep, tmp_path, engine=Interrupted(sweep.scenario, 1))
    seen = []
    result = trainmj.run_sweep(sweep, tmp_path, threads=1, progress=seen.append)
    assert (result.cases, result.computed) == (6, 3)
    assert (seen[0], seen[-1], sorted(seen)) == (3, 6, seen)
    assert (tmp_path / "results.csv").read_bytes() == (out / "results.csv").read_bytes()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("speed_km_h: 15", "speed_km_h: 16", "cases.slow.collision.speed_km_h 15 then, 16 now"),
        ("  slow:", "  walk:", "cases.walk not stated then"),
        ("  slow: {set: {speed_km_h: 15}}\n", "", '["fast", "into_wagon", "slow"] then, ["fast", "into_wagon"] now'),
        (MINE[MINE.index("cases") : MINE.index("vary")], "", '"slow"] then, not stated now'),
    ],
)  # fmt: skip
def test_a_changed_load_case_is_other_input(swept, tmp_path, old, new, said):
    out, _, _ = swept
    with pytest.raises(trainmj.InputError) as caught:
        trainmj.run_sweep(trainmj.load_sweep(written(tmp_path, MINE.replace(old, new))), out)
    assert said in str(caught.value)
    assert "--fresh" in str(caught.value)


def test_the_words_of_a_title_are_no_input(swept, tmp_path):
    out, file, _ = swept
    file = written(tmp_path, file.read_text().replace("As the standard has it", "Standard"))
    result = trainmj.run_sweep(file, out)
    assert result.computed == 0
    assert result.outcome.endings[0].title == "Standard"


@pytest.mark.thorough
def test_the_best_design_of_one_load_case_that_passes_a_limit_in_another_is_seen(tmp_path):
    """Breaks if a design is praised for its least TS and nobody sees that it fails elsewhere."""
    text = (
        f"scenario: b_type\nset: {{{FAST.replace('0.2', '1.5')}}}\n"
        "cases:\n  standard: {}\n  faster: {title: A little faster, set: {speed_km_h: 26}}\n"
        "  light: {set: {collision.partner: wagon_80t, trains.wagon_80t.mass_t: 40, limits.TS_mm: 900}}\n"
        "vary: {empty_stroke_mm: [20, 35]}\nresponses: [TS_mm]\n"
    )
    done = command("sweep", written(tmp_path, text), "--out", tmp_path / "out", "--report")
    table = trainmj.read_table(tmp_path / "out")
    assert table.TS_mm[1] < table.TS_mm[0], "the design with the least TS where the standard has it"
    assert table.status.tolist() == ["over", "over", "over", "stroke exhausted", "over", "over"]
    outcome = trainmj.run_sweep(tmp_path / "my.sweep.yaml", tmp_path / "out").outcome
    assert [(e.load_case, e.past_limits) for e in outcome.endings] == [("standard", 0), ("faster", 1), ("light", 0)]
    assert (outcome.passed, outcome.combinations) == ((0,), 2)
    assert "1 of 2 combinations pass in every load case" in done.stdout
    governing = {g.limit: (g.load_case, g.case, g.kept) for g in outcome.governing}
    assert governing["stroke of front anti_climber"] == ("faster", 3, False)
    assert governing["TS"] == ("light", 4, True), "its own limit, however short its stroke"
    for g in outcome.governing:
        (name,) = (c.name for c in table.attrs["columns"].values() if c.title == f"limit of {g.limit}")
        assert (g.used, table.load_case[g.case]) == (table[name].max(), g.load_case)
        assert g.used == table[name][g.case]
    assert "1 35 ✓ over ✗ stroke exhausted ✓ over" in text_of(tmp_path / "out" / "report.html")


def test_a_response_of_some_load_cases_is_blank_elsewhere_and_refused_if_none_has_it(tmp_path):
    text = MINE.replace("0.2", "0.05")
    trainmj.run_sweep(written(tmp_path, text + "responses: [TS_mm, final_speed_S2_km_h]\n"), tmp_path / "out")
    table = trainmj.read_table(tmp_path / "out")
    assert table["final_speed_S2_km_h"].notna().tolist() == [True, True, False, False, True, True]
    for first in ("into_wagon: {set: {collision.partner: wagon_80t}}\n  ", ""):  # whichever comes first
        text = MINE.replace("  into_wagon: {set: {collision.partner: wagon_80t, trains.wagon_80t.mass_t: 60}}\n", "")
        text = text.replace("  fast:", f"  {first}fast:") + "responses: [final_speed_S2_km_h]\n"
        check_responses(trainmj.load_sweep(written(tmp_path, text)))
    done = command("sweep", written(tmp_path, MINE + "responses: [TS_mn]\n"), "--out", tmp_path / "other")
    assert done.exit_code == 2
    assert "responses: no response is called 'TS_mn'; did you mean 'TS_mm'?" in done.stderr
    assert not (tmp_path / "other").exists()


def test_a_response_that_the_first_case_does_not_have_is_no_mistake(tmp_path):
    """Breaks if a sweep of short and long trains is refused, or ends midway, for a vehicle that some do not have."""
    grid = trainmj.grid_of(
        "b_type",
        {"trains.b_type.vehicles": [1, 4, 2]},
        ["peak_device_M4_g"],
        changes={"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.05},
    )
    trainmj.run_sweep(grid, tmp_path)
    assert trainmj.read_table(tmp_path)["peak_device_M4_g"].notna().tolist() == [False, True, False]


def test_load_cases_are_shown_before_and_after(swept, tmp_path):
    out, file, said = swept
    plan = command("check", file)
    assert plan.exit_code == 0, plan.output
    words = " ".join(plan.output.split())
    assert "6 cases" in words
    assert "As the standard has it" in words
    assert "wagon_80t (1 vehicle, 60 t)" in words
    assert "governed by" in said
    page = text_of(out / "report.html")
    for words in ("Sweep of 3 load cases", "How the load cases ended", "Scenario of load case into_wagon"):
        assert words in page
    with sqlite3.connect(out / "results.sqlite") as db:
        about = dict(db.execute("SELECT key, value FROM about"))
    assert {"scenario_fast", "scenario_into_wagon", "scenario_slow"} <= set(about)
    assert list(json.loads(about["load_cases"])) == ["fast", "into_wagon", "slow"]


@pytest.mark.parametrize("said", ['["fast"]', "3", '{"fast": ""}', '{"fast": "", "other": ""}'])
def test_a_store_whose_load_cases_were_changed_by_hand_is_said_to_be_damaged(swept, tmp_path, said):
    shutil.copy(swept[0] / "results.sqlite", tmp_path)
    with sqlite3.connect(tmp_path / "results.sqlite") as db:
        db.execute("UPDATE about SET value = ? WHERE key = 'load_cases'", (said,))
        signed(db)
    with pytest.raises(trainmj.InputError, match="is not the file of a sweep, or damaged"):
        trainmj.write_report(tmp_path)


def test_the_report_of_an_unfinished_sweep_judges_what_all_load_cases_have(swept, tmp_path):
    """Breaks if a combination counts as one that passes in all load cases before all have been computed."""
    shutil.copy(swept[0] / "results.sqlite", tmp_path)
    with sqlite3.connect(tmp_path / "results.sqlite") as db:
        db.execute('DELETE FROM results WHERE "case" = 5')
        signed(db)
    outcome = outcome_of(trainmj.read_table(tmp_path), {"fast": "", "into_wagon": "", "slow": ""}, 6)
    assert outcome.combinations == 1
    assert [ending.cases for ending in outcome.endings] == [2, 2, 1]
    assert "of 6 cases over load_case, mass_t" in text_of(trainmj.write_report(tmp_path))


def test_load_cases_in_python_take_any_engine(tmp_path):
    """Breaks if an engine, as that of a cluster, computes the scenario that it was made for in each load case."""
    base = trainmj.load("b_type", {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.05})
    cases = {"a": base.with_values({"speed_km_h": 10}), "b": base.with_values({"speed_km_h": 20})}
    sweep = trainmj.Sweep(cases["a"], (), load_cases=cases)
    trainmj.run_sweep(sweep, tmp_path, engine=Local(base, 1))
    assert trainmj.read_table(tmp_path).TS_mm.tolist() == [
        trainmj.summarise(trainmj.run(s)).TS_mm for s in cases.values()
    ]
