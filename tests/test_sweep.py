"""Sweeps: the cases a sweep makes, the file they are kept in, and that nothing stops them for good."""

import json
import os
import signal
import sqlite3
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from itertools import chain

import numpy as np
import pandas as pd
import pytest
from builders import few
from click.testing import CliRunner
from forked import Forked, forked

import trainmj
from trainmj.cases.engine import Local
from trainmj.cases.rows import Rows
from trainmj.cases.store import Store
from trainmj.cli import main
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of
from trainmj.files.folder import held
from trainmj.sweep.plan import grid_values

FAST = ["--set", "simulation.step_ms=0.5"]


def trainmj_sweep(*arguments):
    """The command within this process, which has imported all it needs."""
    done = CliRunner().invoke(main, ["sweep", *map(str, arguments)])
    return subprocess.CompletedProcess(arguments, done.exit_code, done.stdout, done.stderr)


def said_no(done, *words):
    """The command ended with one clear message, exit code 2 and no traceback."""
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
    return True


def sweep_in(tmp_path, text, name="many.yaml"):
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    return trainmj.load_sweep(file)


# the cases of a sweep


def test_a_grid_is_every_combination_and_the_last_varies_fastest():
    sweep = trainmj.grid_of(trainmj.load("b_type"), {"mass_t": "30,33", "empty_stroke_mm": "20:50:3"})
    assert [tuple(values.values()) for _, values in sweep.cases()] == [
        (30, 20.0), (30, 35.0), (30, 50.0), (33, 20.0), (33, 35.0), (33, 50.0)
    ]  # fmt: skip


def test_blocks_of_a_sweep_file_are_crossed(tmp_path):
    (tmp_path / "cases.csv").write_text("collision.gap_mm;speed_km_h\n0;20\n10;25\n", encoding="utf-8")
    sweep = sweep_in(
        tmp_path,
        "scenario: b_type\n"
        "set: {simulation.step_ms: 0.5}\n"
        "vary: {mass_t: {from: 30, to: 36, count: 3}}\n"
        "together: {empty_stroke_mm: [20, 30], collision.rail_friction: [0.0, 0.01]}\n"
        "cases: cases.csv\n",
    )
    assert len(sweep) == 3 * 2 * 2
    assert sweep.case(11) == {
        "mass_t": 36.0,
        "empty_stroke_mm": 30,
        "collision.rail_friction": 0.01,
        "collision.gap_mm": 10,
        "speed_km_h": 25,
    }
    assert sweep.scenario.simulation.step_ms == 0.5


@pytest.mark.parametrize("method", ["random", "latin_hypercube", "sobol"])
def test_a_sample_is_the_same_for_the_same_seed_and_follows_its_distributions(tmp_path, method):
    text = (
        "scenario: b_type\n"
        f"sample: {{count: 256, seed: 3, method: {method}, factors: {{mass_t: {{uniform: [30, 36]}}, "
        "speed_km_h: {normal: [25, 1]}, collision.gap_mm: {choice: [0, 10]}}}\n"
    )
    sweep = sweep_in(tmp_path, text)
    table = pd.DataFrame([values for _, values in sweep.cases()])
    assert table.equals(pd.DataFrame([values for _, values in sweep_in(tmp_path, text).cases()])), "not reproducible"
    assert sweep.seed == 3
    assert table.mass_t.between(30, 36).all()
    assert abs(table.mass_t.mean() - 33) < 0.4
    assert abs(table.speed_km_h.std() - 1) < 0.2
    assert set(table["collision.gap_mm"]) == {0, 10}


def test_a_sweep_of_plain_values_is_that_of_a_file(tmp_path):
    sweep = trainmj.sweep_of({"scenario": "b_type", "vary": {"mass_t": {"from": 30, "to": 36, "count": 3}}})
    file = sweep_in(tmp_path, "scenario: b_type\nvary: {mass_t: {from: 30, to: 36, count: 3}}\n")
    assert list(sweep.cases()) == list(file.cases())


def test_a_sweep_file_can_be_run_as_it_is(tmp_path):
    sweep = sweep_in(tmp_path, "scenario: b_type\nset: {simulation.step_ms: 0.5}\nvary: {mass_t: [30, 36]}\n")
    assert trainmj.run_sweep(tmp_path / "many.yaml", tmp_path / "out").computed == 2
    assert trainmj.run_sweep(sweep, tmp_path / "out").computed == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scenario: b_type\nvari: {mass_t: '30,33'}\n", ["many.yaml:2:1", "vari", "did you mean 'vary'"]),
        ("scenario: b_typ\nvary: {mass_t: '30,33'}\n", ["b_typ", "did you mean 'b_type'"]),
        ("scenario: b_type\nvary: {mas_t: '30,33'}\n", ["many.yaml:2:8: vary.mas_t", "did you mean 'mass_t'"]),
        ("scenario: b_type\nvary: {mass_t: '30:36'}\n", ["many.yaml:2:8", "vary.mass_t = '30:36'", "FROM:TO:COUNT"]),
        ("scenario: b_type\nvary: {mass_t: []}\n", ["many.yaml:2:8", "at least 1"]),
        ("scenario: b_type\n", ["nothing is varied"]),
        ("scenario: b_type\ntogether: {mass_t: [30, 33], speed_km_h: [1]}\n", ["together", "1, 2"]),
        ("scenario: b_type\nvary: {mass_t: '30,33'}\ntogether: {mass_t: [30]}\n", ["mass_t", "twice"]),
        ("scenario: b_type\ncases: none.csv\n", ["none.csv", "there is no such file"]),
        ("scenario: b_type\nsample: {count: 3, factors: {mass_t: {uniform: [3, 1]}}}\n", ["uniform", "lower"]),
        (
            "scenario: b_type\nsample: {count: 3, factors: {mass_t: {}}}\n",
            ["needs uniform, normal or choice"],
        ),
        ("scenario: b_type\nsample: {count: 0, factors: {mass_t: {uniform: [1, 3]}}}\n", ["count", "at least 1"]),
        ("scenario: b_type\nvary: {mass_t: '30,33'}\nhistories: [2]\n", ["no case 2", "last is 1"]),
        ("scenario: b_type\nset: {mass_t: 30}\nvary: {mass_t: '30,33'}\n", ["mass_t: is varied, and set for every"]),
        (
            "scenario: b_type\nset: {mass_t: 30}\nvary: {trains.b_type.mass_t: '30,33'}\n",
            ["trains.b_type.mass_t: is varied, and set, as mass_t, for every case"],
        ),
        (
            "scenario: b_type\nset: {mass_t: 30, trains.b_type.mass_t: 31}\nvary: {speed_km_h: [9]}\n",
            ["trains.b_type.mass_t takes the place of mass_t"],
        ),
        ("scenario: b_type\nvary: {mass_t: '1:2:900000', speed_km_h: '1:2:900000'}\n", ["cases, more than"]),
    ],
)
def test_a_wrong_sweep_file_is_refused_with_place_and_rule(tmp_path, text, words):
    with pytest.raises(trainmj.InputError) as caught:
        sweep_in(tmp_path, text)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("head", ["collision.gap_mm", "simulation.step_ms"])
def test_a_cell_that_is_no_number_is_named_though_the_scenario_states_no_value_there(tmp_path, head):
    """Breaks if one bad cell makes texts of its whole column, and every case is refused for a value that is right."""
    (tmp_path / "c.csv").write_text(f"mass_t,{head}\n30,1\n33,#N/A\n")
    with pytest.raises(trainmj.InputError, match=rf"line 3: row 2: {head} = '#N/A': must be a number"):
        sweep_in(tmp_path, "scenario: b_type\ncases: c.csv\n")


def test_what_a_set_group_holds_can_be_varied():
    """Breaks if a value inside what is set is taken for the same value."""
    device = {"curve": {"stroke_mm": [0, 10, 900], "force_kN": [0, 500, 800]}, "stiffness_kN_per_mm": 80}
    inner = "devices.coupler_c_d.stiffness_kN_per_mm"
    grid = trainmj.grid_of("b_type", {inner: "90,100"}, changes={"devices.coupler_c_d": device})
    assert grid.scenario.locate("devices.coupler_c_d") == [device]
    with pytest.raises(trainmj.InputError, match="is varied, and set, as"):
        trainmj.grid_of("b_type", {"devices.coupler_c_d": [device]}, changes={inner: 90})


@pytest.mark.parametrize("text", ["2:4:3", "2,3,4", "2.0,3.0,4.0"])
def test_a_grid_of_whole_numbers_is_computed(tmp_path, text):
    """Breaks if --vary of a number of vehicles, which makes 2.0, 3.0 and 4.0, is refused in every case."""
    file = tmp_path / "few.yaml"
    file.write_text("builds_on: b_type\ntrains: {b_type: {vehicles: 2, coupler: coupler_c_d, mass_t: 30}}\n")
    vary = ["--vary", f"trains.b_type.vehicles={text}", "--responses", "TS_mm"]
    done = trainmj_sweep(file, "--set", "simulation.time_limit_s=0.05", *vary, "--out", tmp_path / "out")
    assert "0 of 3 cases end within all limits; 3 cut off by the time limit." in done.stdout, done.stderr
    table = trainmj.read_table(tmp_path / "out")
    changes = {"simulation.time_limit_s": 0.05}
    alone = [trainmj.load(file, changes | {"trains.b_type.vehicles": n}) for n in (2, 3, 4)]
    assert table["TS_mm"].tolist() == [trainmj.summarise(trainmj.run(scenario)).TS_mm for scenario in alone]


def test_a_response_that_is_a_number_in_no_case_is_refused_before_anything_is_computed(tmp_path):
    """Breaks if hours of a sweep end in a column of empty cells."""
    coarse = ["--set", "simulation.record_every_ms=5"]
    vary = ["b_type", *FAST, *coarse, "--vary", "mass_t=30,33", "--out", tmp_path / "out", "--responses"]
    for names in ("cfc60_peak_M1_g", "TS_mm,cfc60_*"):
        assert said_no(trainmj_sweep(*vary, names), "cfc60_peak_M", "is not a number", "take at most 1.6")
    assert not (tmp_path / "out").exists()
    recorded = ["--vary", "simulation.record_every_ms=5,1", "--set", "simulation.time_limit_s=0.05"]
    vary = ["b_type", *FAST, *recorded, "--out", tmp_path / "out", "--responses", "cfc60_peak_M1_g"]
    assert trainmj_sweep(*vary).returncode == 0
    assert trainmj.read_table(tmp_path / "out")["cfc60_peak_M1_g"].isna().tolist() == [True, False]


@pytest.mark.parametrize("text", ["1:2", "1:2:x", "1:2:1", "::", "1,,2", "1:2:3.5"])
def test_wrong_values_of_a_grid_are_refused(text):
    with pytest.raises(trainmj.InputError, match="mass_t"):
        grid_values(text, "vary mass_t")


# the table


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A sweep of 120 cases that nothing stopped; one in four is refused."""
    folder = tmp_path_factory.mktemp("undisturbed") / "sweep"
    done = trainmj_sweep("b_type", *CASES, *FAST, "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder, done


CASES = ["--vary", "empty_stroke_mm=20:50:30", "--vary", "mass_t=30,33,36,-1"]


def csv_of(folder):
    return (folder / "results.csv").read_text(encoding="utf-8")


def test_a_sweep_ends_with_a_line_a_csv_and_an_sqlite_file(undisturbed):
    folder, done = undisturbed
    assert "61 of 120 cases end within all limits; 30 failed; 29 past a limit." in done.stdout
    assert "collisions a second" in done.stdout
    assert done.stderr == "", "a sweep is quiet where there is no terminal"
    table = trainmj.read_table(folder)
    assert len(table) == 120
    assert list(table.status).count("refused") == 30
    from_csv = pd.read_csv(folder / "results.csv", index_col="case", keep_default_na=False, na_values={"TS_mm": ""})
    assert list(from_csv.columns) == list(table.columns)
    assert list(from_csv.TS_mm.dropna()) == list(table.TS_mm.dropna())
    assert list(from_csv.reason) == list(table.reason)
    with sqlite3.connect(folder / "results.sqlite") as db:
        about = dict(db.execute("SELECT key, value FROM about"))
    assert "b_type" in about["scenario"]
    assert {"version_trainmj", "version_mujoco", "version_law", "values", "seed"} <= set(about)


def test_cases_past_a_limit_are_counted_and_can_be_the_exit_code(tmp_path):
    """Breaks if a sweep calls itself flawless where its cases passed the limits of their devices."""
    words = ["b_type", "--vary", "speed_km_h=20,30", "--set", "limits.TS_mm=1400", *FAST, "--out", tmp_path]
    done = trainmj_sweep(*words)
    assert (done.returncode, "1 of 2 cases end within all limits; 1 past a limit." in done.stdout) == (0, True), (
        done.stdout
    )
    assert "The first: case 1, stroke exhausted: at S1-M1 anti_climber (" in " ".join(done.stdout.split())
    assert trainmj_sweep(*words, "--fail-on-limit").returncode == 1
    table = trainmj.read_table(tmp_path)
    assert list(table.status) == ["over", "stroke exhausted"]
    assert "limit passed: TS (" in table.reason[1]


def test_a_sweep_of_which_nothing_could_be_computed_is_no_success(tmp_path):
    assert trainmj_sweep("b_type", "--vary", "mass_t=-1,-2", "--out", tmp_path).returncode == 1


def test_a_row_of_a_sweep_is_the_single_run(undisturbed):
    table = trainmj.read_table(undisturbed[0])
    row = table.iloc[5]
    values = {"empty_stroke_mm": row.empty_stroke_mm, "mass_t": row.mass_t, "simulation.step_ms": 0.5}
    summary = trainmj.summarise(trainmj.run(trainmj.load("b_type", values)))
    assert (row.TS_mm, row.TAMA_g) == (summary.TS_mm, summary.TAMA_g)
    assert row.peak_device_M4_g == summary.vehicles[3].peak_device_acceleration_g


@pytest.mark.parametrize("threads", few([1, 2], 1))
def test_the_table_does_not_depend_on_threads(undisturbed, tmp_path, threads):
    assert trainmj_sweep("b_type", *CASES, *FAST, "--out", tmp_path, "--threads", threads).returncode == 0
    assert csv_of(tmp_path) == csv_of(undisturbed[0])


def test_only_the_responses_asked_for_are_kept_and_histories_of_chosen_cases(tmp_path):
    done = trainmj_sweep(
        "b_type", "--vary", "mass_t=30,-1", *FAST, "--out", tmp_path, "--responses", "TS_mm,stroke_M?_*",
        "--histories", "0,1",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    columns = list(trainmj.read_table(tmp_path).columns)
    assert columns[:4] == ["mass_t", "status", "reason", "TS_mm"]
    assert all(name.startswith("stroke_M") for name in columns[4:])
    assert len(columns) == 14, "five strokes, and those of the car body behind five devices"
    assert trainmj.summarise(trainmj.load_result(tmp_path / "case_0.nc")).TS_mm == trainmj.read_table(tmp_path).TS_mm[0]
    assert not (tmp_path / "case_1.nc").exists(), "a refused case has no history"


def test_trains_of_different_length_share_a_table(tmp_path):
    done = trainmj_sweep(
        "b_type", "--vary", "trains.b_type.vehicles=1,4,2", "--vary", "collision.partner=b_type,rigid_wall", *FAST,
        "--out", tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    table = trainmj.read_table(tmp_path)
    assert list(table.peak_device_M4_g.notna()) == [False, False, True, True, False, False]
    assert list(table.stroke_M1_wall_mm.notna()) == [False, True] * 3


def test_parquet_holds_the_same_table(tmp_path):
    done = trainmj_sweep("b_type", "--vary", "mass_t=30,33", *FAST, "--out", tmp_path, "--parquet")
    assert done.returncode == 0, done.stderr
    table = pd.read_parquet(tmp_path / "results.parquet")
    assert list(table.TS_mm) == list(trainmj.read_table(tmp_path).TS_mm)


def test_more_columns_than_sqlite_holds_are_refused_with_the_cure(tmp_path):
    with Store(tmp_path / "results.sqlite") as store:
        with pytest.raises(trainmj.InputError, match="--responses"):
            store.add([Rows([0], {f"column_{k}": [1.0] for k in range(2100)})])
        store.add([Rows([0], {"status": ["over"]})])
        assert store.there(3).tolist() == [True, False, False]


# nothing is lost


@pytest.mark.thorough
def test_killed_five_times_and_gone_on_with_the_table_is_the_same(undisturbed, tmp_path):
    """After so much processor time, which other work on the machine does not shorten."""

    def sweep(folder, seconds=0.0):
        def prepare():
            trainmj.cases.runner.COMMIT_EVERY = 0.01
            trainmj.collision.batch._PATIENCE = 0.0
            trainmj.collision.batch.steps_within = lambda chain: 0  # slower, with the same bits
            trainmj.cases.engine.SIZE = 4  # few in a lot, and side by side, so that they end one after the other
            run_lots = trainmj.collision.batch.run_lots
            run_lots.__defaults__ = (0, 8)
            signal.setitimer(signal.ITIMER_PROF, seconds)  # its signal ends the process without a word

        return forked(tmp_path, "sweep", "b_type", *CASES, *FAST, "--out", folder, prepare=prepare)

    before = os.times()
    assert sweep("whole").returncode == 0
    after = os.times()
    whole = after.children_user + after.children_system - before.children_user - before.children_system
    seen, counts = set(), []
    for share in np.random.default_rng(11).uniform(0.3, 1.0, 5):  # before the first case, between commits, at the end
        assert sweep("killed", share * whole).returncode in (-signal.SIGPROF, 0)
        there = _finished(tmp_path / "killed" / "results.sqlite")
        assert seen <= there, "a finished case was lost"
        seen = there
        counts.append(len(seen))
    assert set(counts) - {0, 120}, "it was never killed in the middle"
    assert sweep("killed").returncode == 0
    assert csv_of(tmp_path / "killed") == csv_of(tmp_path / "whole") == csv_of(undisturbed[0])


def _finished(file):
    """Numbers of the cases that a file of a sweep has, be there one or not yet."""
    if not file.exists():
        return set()
    with sqlite3.connect(file) as db:
        if db.execute("SELECT count(*) FROM sqlite_master WHERE name = 'results'").fetchone() == (0,):
            return set()
        return {n for (n,) in db.execute('SELECT "case" FROM results')}


def test_finished_cases_are_not_computed_again(undisturbed, tmp_path):
    sweep = trainmj.grid_of(trainmj.load("b_type", {"simulation.step_ms": 0.5}), {"mass_t": "30,33,36"})
    columns = {"TS_mm": columns_of(line_up(sweep.scenario))["TS_mm"]}
    asked = []

    class Counting(Local):
        def __call__(self, cases):
            for number in chain.from_iterable(some.keys for some in cases):
                asked.append(number)
                yield Rows([number], {"status": ["over"], "reason": [""]}, columns, np.array([[float(number)]]))
                if number == 1 and len(asked) == 2:
                    raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trainmj.run_sweep(sweep, tmp_path, engine=Counting(sweep.scenario))
    result = trainmj.run_sweep(sweep, tmp_path, engine=Counting(sweep.scenario))
    assert asked == [0, 1, 2], "a case that ended before the interruption was computed twice, or one was left out"
    assert (result.cases, result.computed) == (3, 1)


@pytest.mark.thorough
def test_control_c_stops_cleanly_and_says_how_to_go_on(undisturbed, tmp_path):
    # at the scenario's own step, so that it lasts
    process = Forked(tmp_path, "sweep", "b_type", *CASES, "--out", tmp_path)
    until = time.monotonic() + 60
    while not (tmp_path / "results.sqlite").exists() and time.monotonic() < until:
        time.sleep(0.01)
    time.sleep(0.3)
    process.send(signal.SIGINT)
    ended = process.ended()
    assert ended.returncode == 130, ended.stderr
    assert ended.stderr == f"Stopped. What was finished is in {tmp_path}; the same command goes on.\n"
    assert "Traceback" not in ended.stderr


def test_a_finished_sweep_has_nothing_to_do_and_another_one_is_refused_with_what_differs(undisturbed):
    folder, _ = undisturbed
    before = csv_of(folder)
    done = trainmj_sweep("b_type", *CASES, *FAST, "--out", folder)
    assert done.returncode == 0
    assert "All 120 cases were there" in done.stdout
    other = [
        (("--set", "collision.speed_km_h=30"), "collision.speed_km_h 25 then, 30 now"),
        (("--vary", "speed_km_h=30"), 'speed_km_h not stated then, ["30"] now'),
        (("--responses", "TS_mm"), "responses * then, TS_mm now"),
    ]
    for more, said in other:
        assert said_no(trainmj_sweep("b_type", *CASES, *FAST, *more, "--out", folder), said.replace('"', ""), "--fresh")
    fewer = trainmj_sweep("b_type", *CASES[:3], "mass_t=30,33", *FAST, "--out", folder)
    assert said_no(fewer, "mass_t [30, 33, 36, -1] then, [30, 33] now")
    assert csv_of(folder) == before


def test_fresh_takes_away_what_a_sweep_left_and_nothing_else(tmp_path):
    few = ("b_type", "--vary", "mass_t=30,33", *FAST, "--out", tmp_path)
    assert trainmj_sweep(*few, "--histories", "0,1", "--report").returncode == 0
    for name in ("notes.txt", "case_7.nc"):
        (tmp_path / name).write_text("mine")
    wall = (*few, "--set", "collision.partner=rigid_wall")
    assert said_no(trainmj_sweep(*wall), "collision.partner b_type then, rigid_wall now")
    done = trainmj_sweep(*wall, "--fresh", "--histories", "1")
    assert done.returncode == 0, done.stderr
    left = {file.name for file in tmp_path.iterdir()}
    assert left == {"results.sqlite", "results.csv", "case_1.nc", "notes.txt", "case_7.nc"}
    assert trainmj.summarise(trainmj.load_result(tmp_path / "case_1.nc")).TS_mm == trainmj.read_table(tmp_path).TS_mm[1]


def test_fresh_starts_over_from_a_damaged_file(tmp_path):
    (tmp_path / "results.sqlite").write_bytes(b"not a database at all" * 100)
    assert trainmj_sweep("b_type", "--vary", "mass_t=30,33", *FAST, "--out", tmp_path, "--fresh").returncode == 0


@pytest.mark.thorough
def test_a_table_can_be_read_while_it_is_written(tmp_path):
    """In the middle of a commit a reader waits for its end, and says so if that does not come."""
    sweep = trainmj.grid_of(trainmj.load("b_type", {"simulation.step_ms": 0.5}), {"mass_t": "30:36:40"})
    seen = []

    def look(finished):
        if finished:
            seen.append(len(trainmj.read_table(tmp_path)))
            assert seen[-1] == finished

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("trainmj.cases.runner.COMMIT_EVERY", 0.0)
        patch.setattr("trainmj.cases.engine.SIZE", 2)
        trainmj.run_sweep(sweep, tmp_path, progress=look)
    assert len(set(seen)) > 10
    with closing(sqlite3.connect(tmp_path / "results.sqlite")) as writer, pytest.MonkeyPatch.context() as patch:
        patch.setattr("trainmj.cases.store.PATIENCE", 0.1)
        writer.execute("BEGIN EXCLUSIVE")
        with pytest.raises(trainmj.InputError, match="is being written by another process"):
            trainmj.read_table(tmp_path)


@pytest.mark.thorough
def test_many_readers_do_not_keep_a_sweep_from_writing(tmp_path, monkeypatch):
    """Breaks if a sweep gives up because others look at its table again and again: one of them would always read."""
    read_sql, seen, ended = pd.read_sql, [], threading.Event()

    def read_slowly(*args, **named):
        time.sleep(0.2)
        return read_sql(*args, **named)

    def look():
        while not ended.is_set():
            with suppress(trainmj.InputError):  # it comes too early
                seen.append(len(trainmj.read_table(tmp_path)))

    def prepare():
        trainmj.cases.runner.COMMIT_EVERY = 0.0
        trainmj.cases.store.PATIENCE = 2.0

    monkeypatch.setattr(pd, "read_sql", read_slowly)
    sweep = Forked(tmp_path, "sweep", "b_type", "--vary", "mass_t=30:36:6", *FAST, "--out", tmp_path, prepare=prepare)
    with ThreadPoolExecutor(4) as readers:
        looking = [readers.submit(look) for _ in range(4)]
        done = sweep.ended()
        ended.set()
    for reader in looking:
        reader.result()
    assert done.returncode == 0, done.stderr
    assert seen, "they did read"


def test_a_reader_who_comes_too_early_is_told_to_wait(tmp_path):
    """A sweep holds its folder some milliseconds before its table is there."""
    with held(tmp_path):
        for content in (None, b""):
            if content is not None:
                (tmp_path / "results.sqlite").write_bytes(content)
            with pytest.raises(trainmj.InputError, match="another trainmj is writing to this folder: try again"):
                trainmj.read_table(tmp_path)


def test_a_folder_that_somebody_only_looks_at_can_be_taken(tmp_path):
    """Breaks if a report that asks whether a sweep is running keeps it from starting."""
    looked = threading.Event()

    def look():
        with held(tmp_path):
            looked.set()
            time.sleep(0.02)

    with ThreadPoolExecutor(1) as other:
        other.submit(look)
        looked.wait()
        with held(tmp_path):
            pass


def test_what_a_killed_process_left_half_written_is_taken_back_by_a_reader(tmp_path):
    def prepare():
        def killed(self, progress):
            self._db.execute("PRAGMA cache_spill = 1")
            self._db.execute("PRAGMA cache_size = 1")
            self._db.execute("BEGIN IMMEDIATE")
            self._db.execute("DELETE FROM results")
            self._db.executemany(
                'INSERT INTO results ("case", status) VALUES (?, ?)', [(n, "x" * 4000) for n in range(500)]
            )
            os.kill(os.getpid(), signal.SIGKILL)

        trainmj.cases.store.Store.write_csv = killed

    words = ("sweep", "b_type", "--vary", "mass_t=30,33", *FAST, "--out", tmp_path)
    assert forked(tmp_path, *words, prepare=prepare).returncode == -signal.SIGKILL
    assert (tmp_path / "results.sqlite-journal").stat().st_size > 0
    assert list(trainmj.read_table(tmp_path).status) == ["over", "over"]


def test_a_table_knows_what_its_columns_are(tmp_path):
    sweep = trainmj.grid_of(trainmj.load("b_type", {"simulation.step_ms": 0.5}), {"trains.b_type.vehicles": "1,3"})
    trainmj.run_sweep(sweep, tmp_path)
    table = trainmj.read_table(tmp_path)
    columns = table.attrs["columns"]
    assert list(table.columns) == ["trains.b_type.vehicles", "status", "reason", *columns]
    assert (columns["final_speed_S3_km_h"].unit, columns["final_speed_S3_km_h"].digits) == ("km/h", 2)
    ran = trainmj.run_cases(sweep.scenario, pd.DataFrame({"trains.b_type.vehicles": [1, 3]}))
    assert ran.attrs["columns"] == columns
    assert list(ran.columns) == list(table.columns)


def test_two_sweeps_do_not_write_to_one_folder(tmp_path):
    with held(tmp_path):
        assert said_no(forked(tmp_path, "sweep", "b_type", *CASES, *FAST, "--out", tmp_path), "another trainmj")


def test_a_damaged_file_is_said_to_be_one(tmp_path):
    (tmp_path / "results.sqlite").write_bytes(b"not a database at all" * 100)
    assert said_no(trainmj_sweep("b_type", *CASES, *FAST, "--out", tmp_path), "damaged or no SQLite")


def test_a_folder_that_cannot_be_made_is_refused_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    assert said_no(trainmj_sweep("b_type", *CASES, "--out", tmp_path / "file" / "sweep"), "cannot be made a folder")


@pytest.mark.thorough
def test_a_full_disk_keeps_what_was_finished(undisturbed, tmp_path):
    import resource

    def small():
        resource.setrlimit(resource.RLIMIT_FSIZE, (120_000, 120_000))

    done = forked(tmp_path, "sweep", "b_type", *CASES, *FAST, "--out", tmp_path, prepare=small)
    assert said_no(done, "results.sqlite", "finished cases are kept")
    done = trainmj_sweep("b_type", *CASES, *FAST, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert csv_of(tmp_path) == csv_of(undisturbed[0])


def test_json_values_survive_in_the_table(tmp_path):
    sweep = trainmj.grid_of(trainmj.load("b_type", {"simulation.step_ms": 0.5}), {"curves.buffer": [
        {"stroke_mm": [0, 73], "force_kN": [0, 800]},
        {"stroke_mm": [0, 40, 73], "force_kN": [0, 700, 800]},
    ]})  # fmt: skip
    trainmj.run_sweep(sweep, tmp_path)
    assert json.loads(trainmj.read_table(tmp_path)["curves.buffer"][1])["force_kN"] == [0, 700, 800]
