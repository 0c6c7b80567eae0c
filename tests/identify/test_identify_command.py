"""The command identify: what it leaves, that it goes on where it was stopped, and what it refuses."""

import json
import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from forked import Forked
from ruamel.yaml import YAML
from twins import KNOWN, scenario, values

from trainmj.cli import main
from trainmj.scenario import save

QUICK = {"method": {"seed": 3, "explore": {"trials": 24}, "refine": {"iterations": 2}, "finish": {"iterations": 1}}}
PLAIN = ["--figures", "none"]


def targets_file(folder: Path, **changes) -> Path:
    save(scenario(), folder / "train.yaml")
    file = folder / "mine.targets.yaml"
    with file.open("w", encoding="utf-8") as out:
        YAML().dump(values(**{**QUICK, **changes}), out)
    return file


def left_in(folder: Path) -> dict[str, bytes]:
    """What an identification leaves but its store of trials."""
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.suffix != ".sqlite"}


def test_same_bytes_on_any_threads_and_after_a_kill(tmp_path):
    file = targets_file(tmp_path)
    whole = tmp_path / "whole"
    done = CliRunner().invoke(main, ["identify", str(file), "--out", str(whole), "--threads", "2", *PLAIN])
    assert done.exit_code == 0, done.output
    assert max(map(len, done.stdout.splitlines()[:-2])) <= 80  # but for the folder's name

    killed = tmp_path / "killed"
    process = Forked(tmp_path, "identify", file, "--out", killed, "--threads", "1", *PLAIN)
    store = killed / "trials.sqlite"
    deadline = time.monotonic() + 60
    while not (store.exists() and store.stat().st_size > 20_000):
        assert time.monotonic() < deadline
        time.sleep(0.002)
    process.send(signal.SIGKILL)
    assert process.ended().returncode == -signal.SIGKILL
    assert not (killed / "found.yaml").exists()

    again = CliRunner().invoke(main, ["identify", str(file), "--out", str(killed), "--threads", "1", *PLAIN])
    assert again.exit_code == 2
    assert "has an identification already: go on with --resume" in again.output
    resumed = CliRunner().invoke(
        main, ["identify", str(file), "--out", str(killed), "--threads", "1", "--resume", *PLAIN]
    )
    assert resumed.exit_code == 0, resumed.output
    assert "were there" in resumed.output
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


def test_trials_serve_another_search_but_not_another_scenario(tmp_path, monkeypatch):
    file = targets_file(tmp_path)
    arguments = ["identify", str(file), "--out", str(tmp_path / "out"), "--figures", "none", "--resume", "--json"]
    assert CliRunner().invoke(main, arguments).exit_code == 0
    targets_file(tmp_path, targets__s1__tolerance=3)  # other weights: the first trials are the same
    changed = CliRunner().invoke(main, arguments)
    assert changed.exit_code == 0, changed.output
    with monkeypatch.context() as other_law:
        other_law.setattr("trainmj.identification.run.responses_of", lambda summary: {"TS_mm": 1.0})
        other_law.setattr("trainmj.identification.run._check_start", lambda plan, threads: None)
        refused = CliRunner().invoke(main, arguments)
        assert refused.exit_code == 2
        assert "what the simulation gives has changed since these trials were computed" in refused.output
    with (tmp_path / "train.yaml").open("a") as out:
        out.write("notes: changed\n")
    refused = CliRunner().invoke(main, arguments)
    assert refused.exit_code == 2
    assert "scenario has changed since these trials were computed; take another folder" in refused.output


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
    done = CliRunner().invoke(main, ["identify", str(file), "--out", str(tmp_path / "out"), "--resume"])
    assert done.exit_code == 2
    assert "is damaged or no SQLite file" in done.output


def test_an_interrupt_ends_with_130_and_keeps_the_trials(tmp_path):
    file = targets_file(tmp_path, method__explore__trials=20_000, method__explore__population=16)
    out = tmp_path / "out"
    process = Forked(tmp_path, "identify", file, "--out", out, "--threads", "1")
    deadline = time.monotonic() + 60
    while not ((out / "trials.sqlite").exists() and (out / "trials.sqlite").stat().st_size > 20_000):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send(signal.SIGINT)
    ended = process.ended()
    assert ended.returncode == 130
    assert "with --resume goes on" in ended.stderr
    assert "Traceback" not in ended.stderr
