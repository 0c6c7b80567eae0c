"""The command identify: what it leaves, that it goes on where it was stopped, and what it refuses."""

import copy
import json
import signal
import sqlite3
import time
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from forked import Forked
from ruamel.yaml import YAML
from twins import CASES, KNOWN, rows, scenario, values

import trainmj
from trainmj.cases.store import KEY, Store
from trainmj.cli import main
from trainmj.identification.misfit import Trials
from trainmj.scenario import save

QUICK = {"method": {"seed": 3, "explore": {"trials": 24}, "refine": {"iterations": 2}, "finish": {"iterations": 1}}}
PLAIN = ["--figures", "none"]


def targets_file(folder: Path, **changes) -> Path:
    save(scenario(), folder / "train.yaml")
    file = folder / "mine.targets.yaml"
    with file.open("w", encoding="utf-8") as out:
        YAML().dump(values(**copy.deepcopy(QUICK), data__tests__rows=rows(cases=CASES[:2]), **changes), out)
    return file


def wait_for_trials(folder: Path) -> None:
    """Until some are in the store."""
    deadline = time.monotonic() + 60
    file = folder / "trials.sqlite"
    while time.monotonic() < deadline:
        if file.exists():
            with closing(sqlite3.connect(file)) as db, suppress(sqlite3.OperationalError):
                if db.execute("SELECT count(*) FROM results").fetchone()[0]:
                    return
        time.sleep(0.002)
    raise AssertionError("no trial was kept within a minute")


def left_in(folder: Path) -> dict[str, bytes]:
    """What an identification leaves but its store of trials."""
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.suffix != ".sqlite"}


@pytest.mark.thorough
def test_same_bytes_on_any_threads_and_after_a_kill(tmp_path):
    file = targets_file(tmp_path)
    whole = tmp_path / "whole"
    done = CliRunner().invoke(main, ["identify", str(file), "--out", str(whole), "--threads", "2", *PLAIN])
    assert done.exit_code == 0, done.output
    assert max(map(len, done.stdout.splitlines()[:-2])) <= 80  # but for the folder's name

    killed = tmp_path / "killed"
    process = Forked(tmp_path, "identify", file, "--out", killed, "--threads", "1", *PLAIN)
    wait_for_trials(killed)
    process.send(signal.SIGKILL)
    assert process.ended().returncode == -signal.SIGKILL
    assert not (killed / "found.yaml").exists()

    again = CliRunner().invoke(main, ["identify", str(file), "--out", str(killed), "--threads", "1", *PLAIN])
    assert again.exit_code == 0, again.output
    assert "collisions were there" in " ".join(again.output.split())
    assert left_in(killed) == left_in(whole)
    expected = {"correlations", "directions", "fit", "parameters", "residuals", "search"}
    assert {name for name in left_in(whole) if name.endswith(".csv")} == {f"{name}.csv" for name in expected}
    assert {"found.yaml", "scenario.yaml", "summary.json"} <= set(left_in(whole))


def test_what_was_found_runs_and_is_built_on_what_it_was_found_for(tmp_path):
    file = targets_file(tmp_path, targets__s1__bars={"each": "90 %"}, targets__s12__bars={"rms": 900})
    runner = CliRunner()
    done = runner.invoke(main, ["identify", str(file), "--out", str(tmp_path / "out"), "--json", "--report"])
    assert done.exit_code == 0, done.output
    pictures = {file.name for file in (tmp_path / "out").glob("*.png")}
    assert pictures == {"residuals.png", "correlations.png", "search.png"}
    summary = json.loads(done.stdout)
    assert set(summary["parameters"]) == set(KNOWN)
    page = (tmp_path / "out" / "report.html").read_text()
    assert all(f">{name}<" in page for name in KNOWN)
    assert "solved from energy" in page
    assert "each 90 %<" in page.replace("\n", "")
    assert "nan" not in page.partition("<script")[0]
    ran = runner.invoke(main, ["run", str(tmp_path / "out" / "found.yaml"), "--json"])
    assert ran.exit_code == 0, ran.output
    text = (tmp_path / "out" / "found.yaml").read_text()
    assert text.startswith("builds_on: scenario.yaml")
    assert "trains:" not in text  # only what has changed


def test_a_bar_that_is_not_kept_is_told_by_the_exit_code(tmp_path):
    bars = {"response": "stroke_S1_M1_mm", "tolerance": "1 %", "bars": {"each": 1e-9}}
    file = targets_file(tmp_path, targets__s1=bars)
    arguments = ["identify", str(file), "--out", str(tmp_path / "out"), "--figures", "none"]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 1
    assert "NOT" in done.output


@pytest.mark.thorough
def test_trials_serve_another_search_but_not_another_scenario(tmp_path):
    file = targets_file(tmp_path)
    arguments = ["identify", str(file), "--out", str(tmp_path / "out"), "--figures", "none", "--json"]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    targets_file(tmp_path, targets__s1__tolerance=3)  # other weights: the first trials are the same
    changed = CliRunner().invoke(main, arguments)
    assert changed.exit_code == 0, changed.output
    with (tmp_path / "train.yaml").open("a") as out:
        out.write("notes: changed\nlimits: {TS_mm: 1000}\n")
    refused = CliRunner().invoke(main, arguments)
    assert refused.exit_code == 2
    assert 'trials.sqlite: holds other results: limits not stated then, {"TS_mm": 1000} now' in refused.output


def test_a_trial_that_fails_in_one_case_has_no_response_there_whether_it_is_simulated_or_read(tmp_path):
    cases = [{"speed_km_h": 20}, {"speed_km_h": 20, "simulation.step_ms": 60.0}, {"speed_km_h": 16}]
    for n in range(2):
        with Store(tmp_path / "trials.sqlite", KEY) as store:
            trials = Trials(scenario(), cases, ["TS_mm", "final_speed_M3_km_h"], store, threads=1)
            assert np.isnan(trials([{"mass_t": 30.0}]).responses[0]).all(axis=1).tolist() == [False, True, False]
            one = trials([{"mass_t": 30.0}, {"mass_t": 31.0}], places=[0, 2]).responses
            assert trials.simulated == 2 - n * 2
            assert np.isfinite(one).all()
    table = trainmj.run_cases(scenario(), pd.DataFrame({"mass_t": [30.0, 30.0], "speed_km_h": [20, 16]}))
    assert one[0].tobytes() == table[["TS_mm", "final_speed_M3_km_h"]].to_numpy().tobytes()


@pytest.mark.parametrize("content", ["[]", "targets: {", "scenario: b_type\n", "\0"])
def test_files_that_are_none_end_in_one_message(tmp_path, content):
    file = tmp_path / "x.targets.yaml"
    file.write_text(content)
    done = CliRunner().invoke(main, ["identify", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert done.output.startswith(f"Error: {file}")
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    file = targets_file(tmp_path)
    (tmp_path / "out").write_text("a file")
    done = CliRunner().invoke(main, ["identify", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "cannot be made a folder" in done.output


def test_a_damaged_store_is_said(tmp_path):
    file = targets_file(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "trials.sqlite").write_bytes(b"no database" * 500)
    done = CliRunner().invoke(main, ["identify", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "is damaged or no SQLite file" in done.output


def test_an_interrupt_ends_with_130_and_keeps_the_trials(tmp_path):
    explore = {"trials": 20_000, "population": 16, "step_ms": 0.02}  # too many and too slow to end before
    file = targets_file(tmp_path, **{f"method__explore__{key}": value for key, value in explore.items()})
    out = tmp_path / "out"
    process = Forked(tmp_path, "identify", file, "--out", out, "--threads", "1")
    wait_for_trials(out)
    process.send(signal.SIGINT)
    ended = process.ended()
    assert ended.returncode == 130
    assert "the same command goes on" in ended.stderr
    assert "Traceback" not in ended.stderr
