"""What the README and the docs show works as it is written there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import trainmj

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def test_the_python_of_the_readme_runs(tmp_path):
    (code,) = blocks(README, "python")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("over 1354."), "TS of the standard case at an empty stroke of 35 mm"


def test_the_train_of_ones_own_in_the_readme_loads_and_runs(tmp_path):
    (text,) = blocks(README, "yaml")
    (tmp_path / "coupler.csv").write_text("stroke_mm,force_kN\n0,0\n73,700\n600,700\n", encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    scenario = trainmj.load(tmp_path / "mine.yaml", {"simulation.step_ms": 0.5})
    assert trainmj.summarise(trainmj.run(scenario)).interfaces[1].peak_force_kN == pytest.approx(700)


@pytest.mark.parametrize("command", re.findall(r"^trainmj [^#\n]+", README, flags=re.MULTILINE))
def test_commands_of_the_readme_have_the_options_they_use(command):
    """The options are those the command knows; what the commands do is tested elsewhere."""
    name, *words = command.split()[1:]
    text = subprocess.run(
        [sys.executable, "-m", "trainmj", name, "--help"], capture_output=True, text=True, check=True
    ).stdout
    unknown = [w for w in words if w.startswith("--") and w not in text]
    assert not unknown


def test_the_whole_scenario_file_of_the_docs_runs(tmp_path):
    text = blocks(page("scenario-files.md"), "yaml")[0]
    (tmp_path / "shuttle.yaml").write_text(text, encoding="utf-8")
    scenario = trainmj.load(tmp_path / "shuttle.yaml", {"mass_t": 38, "trains.shuttle.vehicles.B.mass_t": 34})
    summary = trainmj.summarise(trainmj.run(scenario))
    assert summary.status == "over"
    assert [v.mass_t for v in summary.vehicles] == [38, 34]


def test_the_sweep_file_of_the_docs_is_a_plan(tmp_path):
    text = blocks(page("sweeps.md"), "yaml")[0]
    (tmp_path / "cases.csv").write_text("simulation.time_limit_s\n1.5\n2\n", encoding="utf-8")
    (tmp_path / "many.yaml").write_text(text, encoding="utf-8")
    plan = trainmj.load_plan(tmp_path / "many.yaml")
    assert len(plan) == 9 * 3 * 3 * 2 * 2 * 100


def test_links_of_the_readme_and_docs_lead_somewhere():
    for file in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        for target in re.findall(r"\]\(([^)#:]+)\)", file.read_text(encoding="utf-8")):
            assert (file.parent / target).exists(), f"{file.name}: {target}"
