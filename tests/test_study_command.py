"""The command study: what it leaves, what it does again and what not, and what it refuses."""

import hashlib
import json
import os
import signal

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from forked import forked
from ruamel.yaml import YAML
from studies import SMALL, changed, run, small

import trainmj
from trainmj.cases.store import Store
from trainmj.cli import main
from trainmj.collision.summary import summarise
from trainmj.files.sealed import unsealed
from trainmj.study import tables
from trainmj.study.designs import Designs
from trainmj.study.page import page_of_folder
from trainmj.study.screen import print_study

COUPLER = {"sets": "trains.b_type.coupler", "levels": ["coupler_c_d", "coupler_a_b"]}
BEFORE_FRONTS = {"as it stands", "design", "simulations", "correlation", "surrogates"}


def study_file(folder, values, name="mine.study.yaml"):
    file = folder / name
    with file.open("w", encoding="utf-8") as out:
        YAML().dump(values, out)
    return file


def digests(folder):
    return {
        f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in folder.iterdir() if f.suffix in (".csv", ".png")
    }


@pytest.fixture
def again(small_study, tmp_path):
    """A copy of the finished study's folder."""
    folder = tmp_path / "copy"
    folder.mkdir()
    for file in small_study.folder.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    return folder


# the command


def command(*arguments):
    """The command within this process."""
    return CliRunner().invoke(main, ["study", *map(str, arguments)])


@pytest.fixture(scope="module")
def typed(tmp_path_factory):
    """The command as a user types it, on a file of their own, with figures."""
    folder = tmp_path_factory.mktemp("typed")
    values = changed(SMALL, "optimiser", {
        "on": "both", "seed": 1, "resolution": {"D": 2, "M": 0.2},
        "surrogate": {"particles": 30, "iterations": 20}, "simulator": {"particles": 12, "iterations": 4},
    })  # fmt: skip
    file = study_file(folder, values)
    with pytest.MonkeyPatch.context() as terminal:
        terminal.setenv("COLUMNS", "80")
        return folder, command(file, "--out", folder / "out", "--figures", "svg")


def test_the_command_prints_a_summary_of_80_columns_that_tells_the_whole_story(typed):
    _, told = typed
    assert told.exit_code in (0, 1), told.output
    assert told.stderr == ""
    assert max(map(len, told.stdout.splitlines())) <= 80
    said = " ".join(told.stdout.split())
    for words in (
        "Smallest distance", "Simulated: all 10", "left out", "Hypervolume, surrogates' front over simulator's",
        "Weights", "chosen: TOPSIS", "as it", "predicted", "simulated", "≤ 265 mm", "of the check: over",
        "Chosen: D = ", "its limit is kept: S_anti ≤ 265 mm, found ",
    ):  # fmt: skip
        assert words in said


def test_each_step_leaves_its_table_and_figure(typed):
    folder, _ = typed
    names = {f.name for f in (folder / "out").iterdir()}
    for step in (
        "01_design", "02_simulations", "03_correlation", "04_surrogates", "05_front_surrogate_progress",
        "06_front_simulator_progress", "07_fronts", "08_weights", "09_decision", "10_check",
    ):  # fmt: skip
        assert {f"{step}.csv", f"{step}.svg"} <= names
    assert {"05_front_surrogate.csv", "06_front_simulator.csv", "04_coefficients.csv", "summary.json"} <= names
    assert not [n for n in names if n.endswith(".part")]


def test_both_fronts_are_allowed_and_the_ratio_is_reported(typed):
    folder, _ = typed
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert pd.read_csv(folder / "out" / "05_front_surrogate.csv")["S_anti_mm"].max() <= 263
    direct = pd.read_csv(folder / "out" / "06_front_simulator.csv")
    assert direct["S_anti_mm"].max() <= 265
    assert np.allclose(direct["D_mm"] % 2, 0)
    compared = summary["fronts_compared"]
    assert 0.9 < compared["ratio_predicted"] < 1.2
    assert 0 < compared["kept"] <= compared["points"]


def test_json_is_the_summary_and_a_finished_study_is_only_read(typed):
    folder, first = typed
    told = command(folder / "mine.study.yaml", "--out", folder / "out", "--figures", "svg", "--json")
    assert told.exit_code == first.exit_code
    summary = json.loads(told.stdout)
    assert summary == unsealed((folder / "out" / "summary.json").read_bytes())
    assert set(summary) >= {
        "title", "factors", "objectives", "constraints", "design", "simulations", "correlation", "surrogates",
        "front_on_the_surrogates", "front_on_the_simulator", "fronts_compared", "weights", "decision", "check",
    }  # fmt: skip
    assert set(summary["decision"]["chosen"]) == {"D_mm", "M_t", "TS_mm", "TAMA_g", "S_anti_mm"}
    row = summary["check"]["rows"][0]
    assert row["error_percent"] == pytest.approx(100 * (row["predicted"] - row["simulated"]) / row["simulated"])


def test_the_shipped_study_is_found_by_name_and_by_path():
    by_name = trainmj.load_study("b_type")
    assert by_name.spec == trainmj.load_study("b_type.study.yaml").spec
    assert by_name.space.names == ("D", "M")
    assert by_name.limits[0].text == "S_anti <= 265 mm"


# the numbers


def test_the_api_gives_the_tables_that_are_in_the_folder(small_study):
    table = pd.read_csv(small_study.folder / "02_simulations.csv")
    assert list(table.columns) == ["test", "D_mm", "M_t", "status", "reason", "TS_mm", "TAMA_g", "S_anti_mm"]
    pd.testing.assert_series_equal(table["TS_mm"], small_study.tables["02_simulations"]["TS_mm"])
    cases = table[["D_mm", "M_t"]].set_axis(["empty_stroke_mm", "mass_t"], axis=1)
    plain = trainmj.run_cases(trainmj.load("b_type", {"simulation.step_ms": 0.5}), cases)
    np.testing.assert_array_equal(plain["TS_mm"], table["TS_mm"])


def test_the_chosen_design_is_simulated_again(small_study):
    chosen = small_study.summary["decision"]["chosen"]
    changes = {"simulation.step_ms": 0.5, "empty_stroke_mm": chosen["D_mm"], "mass_t": chosen["M_t"]}
    alone = trainmj.summarise(trainmj.run(trainmj.load("b_type", changes)))
    row = small_study.summary["check"]["rows"][0]
    assert row["simulated"] == pytest.approx(alone.TS_mm, rel=1e-9)
    assert abs(row["error_percent"]) < 1


def test_maximising_is_minimising_the_negative(again):
    front = run(small(objectives={"TS": "maximise", "S_anti": "minimise"}), again)
    table = front.tables["05_front_surrogate"]
    assert np.corrcoef(table["TS_mm"], table["S_anti_mm"])[0, 1] > 0.9


def test_a_coarser_step_moves_TS_by_less_than_a_twentieth_of_a_per_cent():
    """What the shipped study's step rests on."""
    cases = pd.DataFrame({"empty_stroke_mm": [20, 35, 50], "mass_t": [30, 33, 36]})
    shipped = trainmj.load_study("b_type")
    fine = trainmj.run_cases(trainmj.load("b_type", {"simulation.step_ms": 0.05}), cases)
    coarse = trainmj.run_cases(shipped.scenario, cases)
    np.testing.assert_allclose(coarse["TS_mm"], fine["TS_mm"], rtol=5e-4)
    np.testing.assert_allclose(coarse["TAMA_g"], fine["TAMA_g"], rtol=3e-3)


# what is done again


def test_nothing_is_done_again_when_nothing_has_changed(small_study, again):
    second = run(small(), again)
    assert second.computed == ()
    assert second.simulated == 0
    assert digests(again) == digests(small_study.folder)
    assert second.summary == small_study.summary


@pytest.mark.parametrize(
    ("changes", "redone", "simulated"),
    [
        ({"weights": {"method": "equal"}}, {"weights", "decision", "check"}, {0, 1}),
        ({"decision__method": "knee"}, {"decision", "check"}, {0, 1}),
        ({"correlation": {"level": 0.9}}, {"correlation"}, {0}),
        ({"cross_validation__against": ["linear"]}, {"surrogates"}, {0}),
        ({"check": {"set": {"simulation.step_ms": 0.25}}}, {"check"}, {1}),
    ],
)
def test_a_change_redoes_only_what_depends_on_it(again, changes, redone, simulated):
    second = run(small(**changes), again)
    assert set(second.computed) <= redone
    assert next(iter(second.computed)) in redone
    assert second.simulated in simulated


@pytest.mark.thorough
def test_what_is_done_again_from_files_is_what_a_new_study_finds(again, tmp_path):
    changes = {"weights": {"of": "front"}, "surrogates": {"default": {"order": 1}}, "design__resolution": {"D": 1}}
    run(small(design__resolution={"D": 1}), again)
    second, fresh = run(small(**changes), again), run(small(**changes), tmp_path / "out")
    assert {"design", "simulations"}.isdisjoint(second.computed)
    assert digests(again) == digests(fresh.folder)


def test_other_surrogates_need_no_new_simulations(again):
    second = run(small(surrogates={"default": {"order": 1}}), again)
    assert {"surrogates", "front on the surrogates"} <= set(second.computed)
    assert not {"design", "simulations", "correlation"} & set(second.computed)
    assert second.simulated <= 1  # the check


def test_a_surrogate_that_is_constant_has_no_sensitivity_and_the_study_goes_on(again):
    run(small(surrogates={"TAMA": {"terms": ["1"]}}), again)
    assert set(pd.read_csv(again / "04_sensitivity.csv")["response"]) == {"TS", "S_anti"}


@pytest.mark.thorough
def test_another_design_redoes_everything_behind_it(again):
    second = run(small(design__seed=5), again)
    assert set(second.computed) >= BEFORE_FRONTS - {"as it stands"} | {"front on the surrogates"}
    assert "as it stands" not in second.computed


@pytest.mark.thorough
def test_another_scenario_redoes_everything_with_new_simulations(again):
    second = run(small(set={"simulation.step_ms": 0.25}), again)
    assert "design" not in second.computed
    assert {"as it stands", "simulations", "check"} <= set(second.computed)
    assert second.simulated == 12


def test_one_more_response_needs_no_new_simulations(again):
    second = run(small(responses__S12="stroke_M1_M2_mm"), again)
    assert second.simulated <= 1
    assert "S12_mm" in second.tables["02_simulations"]


def test_a_file_that_was_changed_or_lost_is_made_again(small_study, again):
    (again / "03_correlation.csv").unlink()
    (again / "02_simulations.csv").write_text("test,D_mm\n1,2\n", encoding="utf-8")
    second = run(small(), again)
    assert set(second.computed) == {"simulations", "correlation"}
    assert second.simulated == 0
    assert digests(again) == digests(small_study.folder)


@pytest.mark.thorough
def test_files_of_a_step_that_is_no_longer_wanted_are_taken_away(tmp_path):
    both = {
        "on": "both",
        "surrogate": {"particles": 8, "iterations": 2},
        "simulator": {"particles": 6, "iterations": 1},
    }
    folder = tmp_path / "out"
    run(small(optimiser=both), folder)
    assert (folder / "06_front_simulator.csv").exists()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    run(small(), folder)
    assert not (folder / "06_front_simulator.csv").exists()
    assert not (folder / "07_fronts.csv").exists()
    assert (folder / "notes.txt").exists()


@pytest.mark.thorough
def test_a_damaged_record_of_steps_only_costs_time(again, small_study):
    (again / "steps.json").write_text("[1, 2", encoding="utf-8")
    second = run(small(), again)
    assert second.simulated == 0
    assert digests(again) == digests(small_study.folder)


@pytest.mark.thorough
def test_a_killed_study_goes_on_and_ends_as_if_nothing_had_happened(tmp_path):
    """Killed in the middle of its simulations; what was finished is not computed again."""
    file = study_file(tmp_path, changed(SMALL, "design", {"kind": "sobol", "n": 40, "seed": 1}))

    def prepare():
        add, finished = Store.add, []

        def killing(self, rows):
            add(self, rows)
            finished.extend(key for some in rows for key in some.keys)
            if len(finished) == 20:
                os.kill(os.getpid(), signal.SIGKILL)

        Store.add = killing
        trainmj.cases.runner.COMMIT_EVERY = 0.0
        trainmj.cases.engine.SIZE = 1

    words = ("study", file, "--out", tmp_path / "out", "--figures", "none", "--threads", "1")
    assert forked(tmp_path, *words, prepare=prepare).returncode == -signal.SIGKILL
    second = run(file, tmp_path / "out")
    assert second.simulated == 42 - 20  # as it stands, 40 points, the check
    whole = run(file, tmp_path / "out")
    assert whole.computed == ()


# cases that fail, limits that cannot be kept


def test_cases_that_are_refused_are_reported_and_left_out(tmp_path):
    """Below an empty stroke of 0.53 mm the shear-off ramp has no room, so these cases break a rule."""
    study = small(factors__D={"sets": "empty_stroke_mm", "bounds": [0, 30]}, design__resolution={"D": 1})
    result = run(study, tmp_path / "out")
    facts = result.summary["simulations"]
    assert facts["failed"] >= 1
    assert "empty_stroke_mm" in facts["first_failure"]
    assert result.summary["surrogates"]["n"] == 10 - facts["failed"]
    assert "refused" in set(result.tables["02_simulations"]["status"])


def test_too_few_cases_are_refused_with_the_first_reason(tmp_path):
    study = small(factors__D={"sets": "empty_stroke_mm", "bounds": [-4000, 30]}, design__resolution={"D": 1})
    with pytest.raises(trainmj.InputError, match=r"only [01] of the 10 cases.*refused"):
        run(study, tmp_path / "out")


@pytest.mark.parametrize(
    ("path", "value", "where"),
    [
        ("set", {"simulation.step_ms": 0.5, "simulation.record_every_ms": 5}, "cfc60"),
        ("factors.R", {"sets": "simulation.record_every_ms", "bounds": [1, 5]}, "with R = 5.0: cfc60"),
        ("factors.R", {"sets": "simulation.record_every_ms", "levels": [1, 4, 5]}, "with R = 4: cfc60"),
        ("check", {"set": {"simulation.record_every_ms": 5}}, "in the check: cfc60"),
        (
            "factors.N",
            {"sets": "trains.b_type.vehicles", "bounds": [2, 4], "kind": "integer"},
            "with N = 2.0: the scenario has no",
        ),
    ],
)
def test_a_response_without_a_number_is_refused_before_anything_is_computed(path, value, where):
    """Breaks if the cases of a design cannot be used, and only their count says so, when all are computed."""
    couple = {"set": {"simulation.step_ms": 0.5, "trains.b_type.coupler": "coupler_c_d", "trains.b_type.mass_t": 33}}
    wanted = {"factors.M": None, "responses.C": "cfc60_peak_M1_g", "responses.S34": "stroke_M3_M4_mm"}
    if path != "factors.N":
        wanted.pop("responses.S34")
    study = SMALL | couple
    for key, new in (*wanted.items(), (path, value)):
        study = changed(study, key, new)
    study["design"] = {"n": 10}
    said = rf"responses\.{'S34' if path == 'factors.N' else 'C'} = .*{where}"
    with pytest.raises(trainmj.InputError, match=said):
        trainmj.study_of(study)


def test_a_simulation_without_a_number_is_said_with_the_name_of_the_response():
    study = small()
    points = np.array([[20.0, 30.0]])
    lost = Designs(study, points, np.array([[1.0, np.nan, 2.0]]), ["over"], [""])
    assert lost.first_failure == "over: TAMA came to no number"
    assert Designs(study, points, np.full((1, 3), np.nan), ["refused"], ["mass"]).first_failure == "refused: mass"


def test_limits_that_no_design_keeps_are_named(tmp_path, again):
    """With the nearest design in the units of its factors, not in steps of their resolution, and its value."""
    steps = {"D": 1, "M": 0.1}
    with pytest.raises(trainmj.InputError) as refused:
        run(small(constraints={"S_anti": {"at_most": 100, "margin": 2}}, optimiser__resolution=steps), again)
    said = str(refused.value)
    assert "constraints: search on the surrogate: no design of 630 keeps all limits; the nearest, D = 20 mm" in said
    assert ", M = 30 t, has S_anti = 1" in said
    assert "mm, not S_anti <= 100 mm with its margin of 2: loosen" in said


def test_a_limit_that_only_round_off_passes_is_kept():
    """A crush tube of one force keeps a limit at that force, though its surrogate says 800.0000000000003 kN."""
    (limit,) = small(constraints={"S_anti": {"at_most": 800}}).limits
    assert limit.excess(np.array([800.0000000000003, 800.001])).tolist() == [0.0, pytest.approx(0.001)]
    (other,) = small(constraints={"S_anti": {"at_least": 800}}).limits
    assert other.excess(np.array([799.9999999999997]))[0] == 0.0


def test_what_as_it_stands_means_is_said(tmp_path, again, capsys):
    """TS as it stands is of the study's step: who compares it with trainmj run must read so, and find its number."""
    result = run(small(check={"set": {"simulation.step_ms": 0.25}}), again)
    assert result.summary["as_it_stands"]["set"] == {"simulation.step_ms": 0.5}
    assert result.summary["check"]["set"] == {"simulation.step_ms": 0.25}
    print_study(result)
    said = " ".join(capsys.readouterr().out.split())
    page = page_of_folder(again).html()
    for where in (said, page):
        assert "As it stands: the scenario with simulation.step_ms = 0.5. Simulated: the chosen design with" in where
        assert "simulation.step_ms = 0.25. trainmj run on the scenario sets none of this" in where
    alone = summarise(trainmj.run(trainmj.load("b_type", {"simulation.step_ms": 0.5})))
    row = result.summary["check"]["rows"][0]
    assert (row["response"], row["as_it_stands"]) == ("TS", pytest.approx(alone.TS_mm, rel=1e-12))


@pytest.mark.parametrize(
    ("stands", "check", "said"),
    [
        ({"step_ms": [0.1]}, {"step_ms": [0.1]}, "the scenario at a step of 0.1 ms. Simulated: the chosen design at a"),
        (
            {"step_ms": [0.5], "set": {"simulation.step_ms": 0.5}},
            {"step_ms": [0.1, 0.2]},
            "design at a step of 0.1 and 0.2",
        ),
    ],
)
def test_the_step_of_what_is_compared_is_said_where_no_change_says_it(stands, check, said):
    """Breaks if numbers of two time steps stand side by side without a word."""
    over = {"status": "over", "reason": ""}
    assert said in tables.check({"check": over | {"rows": []} | check, "as_it_stands": over | stands}).note


def test_the_check_shows_the_digits_that_its_verdict_needs():
    """265.004 mm beside a limit of 265 mm is not 265 mm and broken."""
    row = {"response": "S", "unit": "mm", "as_it_stands": 1.0, "predicted": 265.0, "error_percent": 0.0}
    row |= {"error_of_range_percent": 0.0, "limit": "S <= 265 mm", "limits": [265.0]}
    for simulated, shown, kept in ((265.004, "265.004", False), (265.0, "265", True), (264.9996, "264.9996", True)):
        rows = [row | {"simulated": simulated, "kept": kept}]
        over = {"status": "over", "reason": ""}
        table = tables.check({"check": over | {"rows": rows}, "as_it_stands": over})
        assert table.rows[0][4] == shown


# other kinds of study


@pytest.mark.thorough
def test_three_factors_one_of_them_a_choice_and_three_objectives(tmp_path):
    values = changed(
        SMALL, "factors.device", {"sets": "trains.b_type.coupler", "levels": ["coupler_c_d", "coupler_a_b"]}
    )
    values = changed(values, "design", {"kind": "full_factorial", "levels": {"D": 3, "M": 3}})
    values = changed(values, "surrogates", {"default": {"terms": ["1", "D", "M", "device", "D*M"]}})
    values = changed(values, "objectives.S_anti", "minimise")
    values = changed(values, "weights", {"method": "own", "own": {"TS": 2, "TAMA": 1, "S_anti": 1}})
    values = changed(values, "constraints", None)
    result = run(trainmj.study_of(values), tmp_path / "out")
    assert len(result.tables["02_simulations"]) == 18
    assert set(result.tables["02_simulations"]["device"]) == {"coupler_c_d", "coupler_a_b"}
    assert result.summary["weights"]["weights"] == {"TS": 0.5, "TAMA": 0.25, "S_anti": 0.25}
    assert run(trainmj.study_of(values), tmp_path / "out").computed == ()


@pytest.mark.thorough
def test_levels_may_be_whole_numbers_and_others(tmp_path):
    """In a table they are one column of numbers: the level 30 is written as 30.0."""
    values = changed(SMALL, "factors.M", {"sets": "mass_t", "levels": [30, 32.5, 36]})
    values = changed(values, "design", {"kind": "full_factorial", "levels": {"D": 3}})
    values = changed(values, "surrogates", {"default": {"order": 1}})
    result = run(trainmj.study_of(values), tmp_path / "out")
    assert set(result.tables["02_simulations"]["M_t"]) == {30, 32.5, 36}
    again = run(trainmj.study_of(changed(values, "correlation", {"level": 0.9})), tmp_path / "out")
    assert again.computed == ("correlation",)


@pytest.mark.thorough
def test_surrogates_are_fitted_once(tmp_path, again, monkeypatch):
    """Both the step that measures them and the search on them need them."""
    fitted = []
    fit = trainmj.study.surrogates.fit_all
    monkeypatch.setattr(trainmj.study.surrogates, "fit_all", lambda *asked: fitted.append(1) or fit(*asked))
    assert {"surrogates", "front on the surrogates"} <= set(run(small(), tmp_path / "out").computed)
    assert len(fitted) == 1
    assert run(small(optimiser__seed=2), again).computed[0] == "front on the surrogates"
    assert len(fitted) == 2


@pytest.mark.thorough
def test_one_factor_one_objective_and_a_design_from_a_file(tmp_path):
    (tmp_path / "points.csv").write_text("M_t\n30\n31\n33\n35\n36\n", encoding="utf-8")
    values = changed(SMALL, "factors.D", None)
    values = changed(values, "design", {"kind": "table", "file": "points.csv"})
    values = changed(values, "objectives", {"TAMA": "minimise"})
    result = run(study_file(tmp_path, values), tmp_path / "out")
    assert result.tables["01_design"]["M_t"].tolist() == [30, 31, 33, 35, 36]
    assert len(result.tables["05_front_surrogate"]) == 1
    from trainmj.study.screen import print_study

    print_study(result)


# what is refused


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("scenario", "b_typ", ["scenario = 'b_typ'", "did you mean 'b_type'"]),
        ("desing", {}, ["desing: unknown key", "did you mean 'design'"]),
        ("design", None, ["design: is missing"]),
        ("set", {"simulation.step": 1}, ["simulation.step", "step"]),
        ("set", {"simulation.step_ms": -1}, ["set.simulation.step_ms = -1", "at least"]),
        ("factors.D.sets", "empty_strok_mm", ["factors.D.sets", "did you mean 'empty_stroke_mm'"]),
        ("factors.D.bounds", [50, 20], ["factors.D.bounds", "50 is not below 20"]),
        ("factors.D.bounds", [20], ["factors.D.bounds", "at least 2"]),
        ("factors.D.bounds", None, ["factors.D", "needs bounds or levels"]),
        ("factors.D", {"sets": "empty_stroke_mm", "kind": "choice"}, ["factors.D.levels", "is missing"]),
        ("factors.D.kind", "whole", ["factors.D.kind = 'whole'", "'integer'"]),
        ("factors.D.levels", [1, 2], ["factors.D.levels", "belongs to kind choice: continuous takes sets"]),
        ("factors.E", {"sets": "mass_t", "bounds": [30, 36]}, ["factors.E.sets", "already set by the factor M"]),
        ("factors.a b", {"sets": "speed_km_h", "bounds": [20, 36]}, ["factors.a b", "letters, digits"]),
        ("set.mass_t", 33, ["factors.M.sets", "fixed under set"]),
        ("set", {"trains.b_type.mass_t": 33}, ["factors.M.sets", "fixed under set"]),
        (
            "factors.E",
            {"sets": "trains.b_type.mass_t", "bounds": [30, 36]},
            ["factors.E.sets", "already set by the factor M"],
        ),
        ("factors.D", {"sets": "mass_t", "levels": ["=1", "b"]}, ["factors.D.levels.0 = '=1'", "formulas"]),
        ("factors.D", {"sets": "mass_t", "levels": [1, [2]]}, ["factors.D.levels.1", "must be text"]),
        ("factors.test", COUPLER, ["factors.test", "second column 'test'"]),
        ("responses.D", "TS_mm", ["responses.D", "name of a factor"]),
        ("responses.TS", "TS_m", ["responses.TS = 'TS_m'", "no response of this name", "did you mean 'TS_mm'"]),
        ("design.n", 1, ["design.n = 1", "at least 2"]),
        ("design.levels", {"D": 3}, ["design.levels", "belongs to kind full_factorial: optimal_latin_hypercube takes"]),
        ("design.resolution", {"D": 7}, ["design.resolution.D = 7", "divide the range"]),
        ("design.sed", 3, ["design.sed = 3", "did you mean 'seed'"]),
        ("design.kind", "sobl", ["design.kind = 'sobl'", "'sobol'"]),
        ("design", {"kind": "sobol"}, ["design.n", "is missing"]),
        ("design", {"kind": "table", "file": "no.csv"}, ["design.file = 'no.csv'", "no such file"]),
        ("design", {"kind": "full_factorial"}, ["design", "needs levels for the continuous factor D"]),
        ("surrogates", {"TSS": {}}, ["surrogates.TSS", "did you mean 'TS'"]),
        ("surrogates", {"TS": {"terms": ["1", "Q"]}}, ["surrogates.TS.terms", "no factor 'Q'"]),
        (
            "surrogates",
            {"TS": {"kind": "kriging", "order": 2}},
            ["surrogates.TS.order = 2", "belongs to kind polynomial"],
        ),
        ("surrogates", {"TS": {"terms": ["1"], "order": 2}}, ["surrogates.TS.order = 2", "does not go with terms"]),
        ("objectives", {"TAM": "minimise"}, ["objectives.TAM", "did you mean 'TAMA'"]),
        ("objectives.TS", "down", ["objectives.TS = 'down'", "'minimise' or 'maximise'"]),
        ("constraints.S_anti", {}, ["constraints.S_anti", "needs at_most"]),
        ("constraints.S_ant", {"at_most": 3}, ["constraints.S_ant", "did you mean 'S_anti'"]),
        ("optimiser.simulator", {"particles": 9}, ["optimiser.simulator", "is not used"]),
        ("optimiser.surrogate.particles", 1, ["optimiser.surrogate.particles = 1", "at least 4"]),
        ("optimiser.seed", -1, ["optimiser.seed = -1", "at least 0"]),
        ("weights", {"method": "own", "own": {"TS": 1}}, ["weights.own", "a weight for TAMA"]),
        ("weights", {"method": "equal", "data": "raw"}, ["weights.data", "belongs to method entropy"]),
        ("weights", {"normalised": "no"}, ["weights.normalised = 'no'", "must be true or false"]),
        ("decision", {"method": "knee", "normalisation": "sum"}, ["decision.normalisation", "weighted_sum or topsis"]),
        ("decision.front", "simulator", ["decision.front", "is not searched"]),
        ("check", {"set": {"simulation.stp": 1}}, ["check.set.simulation.stp"]),
        ("check", {"set": {"trains.b_type.mass_t": 33}}, ["is set by the factor M: the check is of the chosen design"]),
        ("factors.M.sets", [], ["factors.M.sets: must have at least 1 entry"]),
        (
            "factors.M.bounds",
            [30000, 36000],
            ["factors.M: the scenario takes none of 30000.0, 36000.0, 33000.0", "if it is in kg"],
        ),
    ],
)
def test_a_wrong_study_file_is_refused_with_place_value_and_rule(tmp_path, path, value, words):
    file = study_file(tmp_path, _without(SMALL, path, value))
    with pytest.raises(trainmj.InputError) as caught:
        trainmj.load_study(file)
    said = str(caught.value)
    assert "mine.study.yaml" in said
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("M_t\n30\n99\n", "must lie in [30, 36] (got 99)"),
        ("M\n30\nheavy\n", "line 3: row 2: M = 'heavy': must be a number"),
        ("M\n30\n3_1\n", "line 3: row 2: M = '3_1': must be a number"),
        ("M\n30\n" + "9" * 400 + "\n", "line 3: row 2: M = '99999"),
        ("M,M_t\n30,31\n31,31\n", "two columns for factor 'M': M and M_t"),
        ("V\n30\n31\n", "no column 'M'"),
    ],
)
def test_points_of_a_file_are_checked_when_the_study_is_read(tmp_path, text, rule):
    (tmp_path / "points.csv").write_text(text, encoding="utf-8")
    values = changed(changed(SMALL, "factors.D", None), "design", {"kind": "table", "file": "points.csv"})
    with pytest.raises(trainmj.InputError, match=r"mine\.study\.yaml:\d+:\d+: design\.file = 'points\.csv'") as caught:
        trainmj.load_study(study_file(tmp_path, values))
    assert rule in str(caught.value)


def _without(values, path, value):
    if path == "factors.a b":
        return values | {"factors": values["factors"] | {"a b": value}}
    if path == "set.mass_t":
        return values | {"set": {"mass_t": value}}
    return changed(values, path, value)


def test_everything_wrong_is_said_at_once_with_lines(tmp_path):
    values = changed(changed(SMALL, "objectives.TX", "minimise"), "design.resolution", {"Q": 1})
    file = study_file(tmp_path, values)
    with pytest.raises(trainmj.InputError) as caught:
        trainmj.load_study(file)
    lines = str(caught.value).splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"{file}:") and line.split(":")[1].isdecimal() for line in lines)


def test_too_few_points_for_the_terms_name_the_response(again):
    with pytest.raises(trainmj.InputError, match=r"surrogates\.TS.*response TS"):
        run(small(surrogates={"TS": {"order": 4}}), again)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("b_typ", ["b_typ", "no such file or shipped study", "did you mean 'b_type'"]),
        ("scenarios", ["is a folder"]),
        ("wall.yaml", ["is not a study file, which states scenario, factors"]),
    ],
)
def test_the_command_refuses_what_is_no_study_in_one_message(tmp_path, monkeypatch, name, words):
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "wall.yaml").write_text("builds_on: b_type\ncollision: {partner: rigid_wall}\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    told = command(name, "--out", "out")
    assert told.exit_code == 2
    assert told.stderr.startswith("Error: ")
    for word in words:
        assert word in told.stderr
