"""The examples do what they say, as a user runs them; their commands are those of docs/examples.md."""

from __future__ import annotations

import json

import pandas as pd
import pytest
from pages import ROOT, blocks

pytestmark = pytest.mark.thorough

EXAMPLES = ROOT / "examples"


def test_every_example_is_in_the_docs():
    shown = "".join(b.text for b in blocks("docs/examples.md"))
    for folder in EXAMPLES.iterdir():
        assert not folder.is_dir() or f"examples/{folder.name}/" in shown, folder.name


def test_notebook(tmp_path):
    """Breaks if a cell of the notebook that ships fails, or shows a thing as bare text."""
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(EXAMPLES / "notebook" / "collision.ipynb", as_version=4)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code), "outputs are not kept in git"
    NotebookClient(book, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [set(output["data"]) for cell in code for output in cell.outputs if output.output_type == "execute_result"]
    assert len(shown) == len(code)
    assert sum("text/html" in kinds for kinds in shown) == 4
    assert sum("image/png" in kinds for kinds in shown) == 1
    assert (tmp_path / "collision.html").is_file()


def test_paper_case(python):
    done = python(str(EXAMPLES / "paper_case" / "compare.py"))
    assert done.returncode == 0, done.stderr
    *rows, _, last = done.stdout.splitlines()
    assert len(rows) == 1 + 9
    assert 0 < float(last.split()[-2]) < 1


def test_own_train(python, tmp_path):
    done = python(
        "-m", "trainmj", "run", str(EXAMPLES / "own_train" / "metro.yaml"), "--out", str(tmp_path), "--figures", "none"
    )
    assert done.returncode == 0, done.stderr
    assert "Status: over" in done.stdout
    coupler = pd.read_csv(tmp_path / "interfaces.csv").set_index("name").loc["M1-M2"]
    assert coupler["peak_force_kN"] == pytest.approx(900), "the end of the curve in coupler.csv, with decimal commas"


def test_sweep(python, tmp_path):
    out = str(tmp_path / "speeds")
    done = python("-m", "trainmj", "sweep", str(EXAMPLES / "sweep" / "speeds.yaml"), "--out", out)
    assert done.returncode == 0, done.stderr
    done = python(str(EXAMPLES / "sweep" / "first_over.py"), out)
    dry, greasy = (line.split() for line in done.stdout.splitlines())
    assert [dry[1], greasy[1]] == ["0:", "0.008:"]
    assert 25 < float(dry[3]) <= float(greasy[3]) < 32, "the design speed is kept, and friction helps"


def test_study(python, tmp_path):
    out = tmp_path / "plateaus"
    study = str(EXAMPLES / "study" / "plateaus.study.yaml")
    done = python("-m", "trainmj", "study", study, "--out", str(out), "--figures", "none")
    assert done.returncode == 0, f"{done.stdout[-1500:]}{done.stderr}"
    chosen = json.loads((out / "summary.json").read_text(encoding="utf-8"))["decision"]["chosen"]
    assert 350 <= chosen["head_kN"] <= 700
    assert 250 <= chosen["joint_kN"] <= 600
