"""The package with edits: what is added in one place appears everywhere, and a law that is edited is compiled afresh.

To compile the law takes as long as all else here, so that a response and a device law are added to the same copy.
"""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from copies import copied
from pages import file_block

pytestmark = pytest.mark.thorough

PAGE = "docs/architecture.md"

MADE_UP = '''
def _half_change(m: Measured) -> Array:
    """(n_case, n_vehicle) half of the change of speed [m/s]."""
    return np.abs(m.tally.speed - m.speed) / 2


VEHICLE = (
    *VEHICLE,
    Quantity(
        "half_change", "m/s", 2, "half\\nchange", "half of the change of speed", _half_change, "half_change",
    ),
)  # fmt: skip
'''
"""What somebody adds to quantities.py, behind its table of vehicles."""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy with the response, and with the device law as the architecture says."""
    package = copied(tmp_path_factory.mktemp("edited"))
    table = package / "collision" / "quantities.py"
    text = table.read_text()
    at = text.index("TRAIN: tuple")
    table.write_text(f"{text[:at]}{MADE_UP}\n{text[at:]}")
    (package / "collision" / "law" / "damper.py").write_text(file_block(PAGE, "damper.py"), encoding="utf-8")
    devices = package / "scenario" / "devices.py"
    before, union, after = devices.read_text(encoding="utf-8").partition("DeviceSpec = Annotated[\n    ")
    text = f"{before}{file_block(PAGE, 'devices.py')}\n\n{union}DamperDevice | {after}"
    devices.write_text(text, encoding="utf-8")
    return package


@pytest.fixture
def python(package: Path, tmp_path: Path) -> Callable[..., str]:
    """Run Python with the copy, in a folder that has the docs: what it prints."""
    (tmp_path / "docs").symlink_to(package.parent / "docs")
    environment = os.environ | {"PYTHONPATH": str(package.parent), "PYTHONSAFEPATH": "1", "COLUMNS": "80"}

    def call(*words: str) -> str:
        command = [sys.executable, *words]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return call


@pytest.fixture
def trainmj(python: Callable[..., str]) -> Callable[..., str]:
    return lambda *words: python("-m", "trainmj", *words)


def test_a_response_that_is_added_in_one_file_appears_everywhere(python, trainmj, tmp_path):
    """Breaks if a second place must be told of a response, or reads its unit from its name: m/s ends in s."""
    screen = trainmj("run", "b_type_wall", "--out", "run", "--report", "--figures", "none")
    assert "half" in screen
    assert "m/s" in screen
    plain = json.loads((tmp_path / "run" / "summary.json").read_text())
    found = plain["vehicles"][0]["half_change_m_per_s"]
    assert 12.5 / 3.6 / 2 < found < 2.0, "half of 12.5 km/h and of the rebound"
    assert pd.read_csv(tmp_path / "run" / "vehicles.csv")["half_change_m_per_s"][0] == pytest.approx(found)
    page = re.sub(r"<script.*?</script>", "", (tmp_path / "run" / "report.html").read_text(), flags=re.DOTALL)
    assert re.search(r"half change\s*(<[^>]*>\s*)*m/s", page)

    trainmj("sweep", "b_type_wall", "--vary", "mass_t=30,33", "--out", "sweep", "--report")
    assert pd.read_csv(tmp_path / "sweep" / "results.csv")["half_change_M1_m_per_s"][1] == pytest.approx(found)
    vary = ("--vary", "mass_t=30,33", "--responses", "half_change_M1_m_per_s")
    trainmj("sweep", "b_type_wall", *vary, "--out", "one", "--report")
    page = re.sub(r"<script.*?</script>", "", (tmp_path / "one" / "report.html").read_text(), flags=re.DOTALL)
    assert re.search(r"half change M1\s*(<[^>]*>\s*)*m/s", page)

    code = "import sys; sys.path.insert(0, 'docs/hooks'); import responses; print(responses.page())"
    assert "| `half_change_m_per_s` | `half_change_M1_m_per_s` | m/s |" in python("-c", code)


def test_a_device_law_is_added_as_the_architecture_says(python, trainmj, tmp_path):
    """Breaks if a kind needs a file that the page does not name, or the law that it shows is wrong."""
    (tmp_path / "damper.yaml").write_text(file_block(PAGE, "damper.yaml"), encoding="utf-8")
    assert "buffer" in trainmj("check", "damper.yaml")
    plain = json.loads(trainmj("run", "damper.yaml", "--json"))
    (device,) = plain["interfaces"]
    m, c, k, v, stroke = 40e3, 200e3, 100e6, 1.0, 0.1
    last = v - c / m * stroke  # the speed falls in proportion to the stroke
    assert plain["status"] == "over"
    assert device["stroke_mm"] == pytest.approx((stroke + last * (m / k) ** 0.5) * 1e3, rel=1e-5)
    assert device["peak_force_kN"] == pytest.approx(last * (m * k) ** 0.5 / 1e3, rel=1e-4)
    assert device["energy_kJ"] == pytest.approx(0.5 * m * (v**2 - last**2) / 1e3, rel=1e-4)
    assert plain["balance"]["viscous_kJ"] == pytest.approx(device["energy_kJ"])
    trainmj("sweep", "damper.yaml", "--vary", "devices.buffer.damping_kN_s_per_m=100,200", "--out", "sweep")
    with (tmp_path / "sweep" / "results.csv").open(encoding="utf-8") as file:
        strokes = [float(row["stroke_M1_wall_mm"]) for row in csv.DictReader(file)]
    assert strokes == pytest.approx([115, 110], rel=1e-5)
    assert "damping_kN_s_per_m" in trainmj("schema")
    code = "import sys; sys.path.insert(0, 'docs/hooks'); import fields; print(fields.scenario_page())"
    assert "| `kind` | `damper` |" in python("-c", code)


def test_an_edited_law_is_compiled_afresh(python, package):
    """Breaks if machine code on disk serves the law as it was before an edit."""
    code = (
        "import trainmj; from trainmj.collision.identity import identity; "
        "r = trainmj.run(trainmj.load('b_type_wall')); print(trainmj.summarise(r).TS_mm, identity()['law'])"
    )

    def ask() -> tuple[float, str]:
        stroke, law = python("-c", code).split()
        return float(stroke), law

    before = ask()
    assert ask() == before, "the second process takes the compiled law from disk"
    law = package / "collision" / "law" / "crush.py"
    code_before = law.read_text()
    edited = code_before.replace("force, now = crush, stroke - crush", "force, now = 0.9 * crush, stroke - 0.9 * crush")
    assert edited != code_before
    law.write_text(edited)
    try:
        after = ask()
    finally:
        law.write_text(code_before)
    assert after[0] > 1.02 * before[0]
    assert after[1] != before[1]
