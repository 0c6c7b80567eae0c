"""What a user installs: public names, and a wheel that has all it needs away from the checkout."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from importlib import import_module
from pathlib import Path

import mujoco
import pytest
from copies import as_compiled_here

import trainmj
from trainmj.files.resources import shipped_folder

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("name", trainmj.__all__)
def test_public_names_exist_where_they_are_said_to_be(name):
    thing = getattr(trainmj, name)
    assert thing.__doc__, f"{name} has no docstring"
    assert thing.__module__.startswith("trainmj."), f"{name} is not ours"


def test_public_names_are_listed_once():
    assert len(trainmj.__all__) == len(set(trainmj.__all__))
    assert dir(trainmj) == sorted(trainmj.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nosuch'"):
        trainmj.nosuch  # noqa: B018


def test_importing_the_package_is_cheap(python):
    """A program that only catches its errors must not load an engine."""
    done = python("-c", "import sys, trainmj; print(*{'numba', 'mujoco', 'numpy'} & set(sys.modules))")
    assert done.stdout.split() == [], done.stderr


def test_example_of_the_package_docstring_runs():
    lines = (trainmj.__doc__ or "").split("::")[1].split("Everything")[0]
    code = "\n".join(line[4:] for line in lines.splitlines())
    printed: list[object] = []
    exec(compile(code, "docstring", "exec"), {"print": printed.append})
    assert printed == [pytest.approx(1354, abs=10)]  # Table 5 of the paper, D = 35 mm: 1345 mm


ORDER = (
    ("errors",),
    ("units", "symbol"),
    ("files",),
    ("scenario", "doe", "output"),
    ("collision",),
    ("cases",),
    ("single", "sweep", "study", "identification", "assessment", "reliability", "view"),
    ("exchange", "explore", "comparison", "paper"),
    ("verification",),
    ("notebook",),
    ("cli",),
)
"""The rooms of the package, lowest first: each imports from itself and from those below, never from a neighbour."""


def test_rooms_import_downwards_only():
    """Breaks when a lower room learns of a higher one, as when the array library of studies learns of trains."""
    level = {name: n for n, names in enumerate(ORDER) for name in names}
    package = ROOT / "trainmj"
    rooms = {p.parent.name for p in package.glob("*/__init__.py")} | {p.stem for p in package.glob("[!_]*.py")}
    assert rooms == set(level), "a room that is not in the order"
    for file in package.rglob("*.py"):
        room = file.relative_to(package).parts[0].removesuffix(".py")
        if room not in level:
            continue
        for other in re.findall(r"^\s*from trainmj\.(\w+)", file.read_text(), flags=re.MULTILINE):
            allowed = other == room or level[other] < level[room]
            assert allowed, f"{file.relative_to(ROOT)} imports from {other}, which is not below {room}"


# the wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel of this checkout. Its build fetches hatchling, so it needs a network; CI has one."""
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", str(ROOT), "--no-deps", "--wheel-dir", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, f"the wheel cannot be built (its build needs a network):\n{done.stderr[-2000:]}"
    (file,) = out.glob("trainmj-*.whl")
    return file


@pytest.fixture(scope="module")
def target(wheel, tmp_path_factory) -> Path:
    """The package installed from the wheel into a folder of its own; its dependencies are those of these tests."""
    folder = tmp_path_factory.mktemp("target")
    command = [sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--target", str(folder), str(wheel)]
    subprocess.run(command, capture_output=True, check=True, timeout=120)
    as_compiled_here(folder / "trainmj")
    return folder


@pytest.mark.thorough
def test_wheel_has_scenarios_scene_tables_and_types(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    folder = shipped_folder("scenarios")
    wanted = {f"trainmj/scenarios/{path.relative_to(folder)}" for path in folder.rglob("*.*")}
    wanted |= {f"trainmj/mjcf/{path.name}" for path in shipped_folder("mjcf").glob("*.xml")}
    wanted |= {"trainmj/py.typed"}
    wanted |= {str(path.relative_to(ROOT)) for path in (ROOT / "trainmj").rglob("*.py")}
    assert len(wanted) > 60
    assert wanted <= names, sorted(wanted - names)
    assert not [n for n in names if "__pycache__" in n or n.startswith("tests")]
    assert any(n.endswith("entry_points.txt") for n in names)
    assert any("LICENSE" in n for n in names)


AWAY = """
import sys, trainmj
from click.testing import CliRunner
from trainmj.cli import main
from trainmj.identification.plan import load_targets
print(trainmj.__file__)
trainmj.load_study("b_type")
load_targets("b_type")  # reads the tables beside it
for line in sys.stdin:
    done = CliRunner().invoke(main, line.split())
    print(done.output, done.exit_code)
"""


@pytest.mark.thorough
def test_installed_package_works_away_from_the_checkout(target, tmp_path):
    """Listing needs the scenarios, a run and an export the scene, a report what it is filled into."""
    commands = (
        "scenarios",
        f"run b_type --set simulation.time_limit_s=0.1 --out {tmp_path / 'run'} --figures none --report",
        f"export b_type --out {tmp_path / 'model.xml'}",
    )
    done = subprocess.run(
        [sys.executable, "-c", AWAY],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(target)},
        input="\n".join(commands),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout.startswith(str(target)), done.stderr
    assert [line[-1] for line in done.stdout.splitlines() if line[-2:] in (" 0", " 1", " 2")] == ["0"] * 3, done.stdout
    assert "b_type_scenario_2" in done.stdout
    assert "TAMA" in done.stdout
    assert {"result.nc", "report.html"} <= {file.name for file in (tmp_path / "run").iterdir()}
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml")).nv == 12


def test_every_module_imports():
    for file in (ROOT / "trainmj").rglob("*.py"):
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        if not module.endswith("__main__"):
            import_module(module)
