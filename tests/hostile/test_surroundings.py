"""What a command finds around it: settings meant for other programs, streams, names of folders."""

from __future__ import annotations

import errno
import json
import os
import re
import sqlite3
import sys
import tracemalloc
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pandas as pd
import pytest
from click.testing import CliRunner
from forked import Ended, forked
from kinds import BASE, TARGETS, TUBE, WANTED
from matplotlib import pyplot as plt
from mutations import document

import trainmj
from trainmj.cli import main
from trainmj.collision import batch
from trainmj.errors import InputError
from trainmj.files.text import read_bytes
from trainmj.output import style
from trainmj.output.page import Page
from trainmj.paper import scatter
from trainmj.single.figures import collision
from trainmj.verification import suite

SHORT = ("--set", "simulation.step_ms=0.5", "--set", "simulation.time_limit_s=0.1")
ALIEN = os.fsdecode(b"o\xfc")
"""The name of a folder that is not UTF-8."""


# settings for others


@pytest.fixture(scope="module")
def figure() -> bytes:
    """The figure of a short run, drawn where nothing is set."""
    result = trainmj.run(trainmj.load("b_type", {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.1}))
    return style.encode(collision(result), "png")


def run_as_a_process(python: Callable[..., Any], place: Path, **env: str) -> str:
    """What a run says on stderr."""
    done = python("-m", "trainmj", "run", "b_type", *SHORT, "--out", "out", cwd=place, **env)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Six-car B-type")
    return str(done.stderr)


WILD = """font.size: 30
savefig.bbox: tight
savefig.facecolor: red
axes.prop_cycle: cycler("color", ["r"])
axes.linewidth: 9
path.sketch: 1, 100, 2
backend: TkAgg
"""


@pytest.mark.thorough
def test_settings_for_others_do_not_reach_a_run(python, figure, tmp_path):
    """Breaks if a shell of Jupyter's, a foreign folder, or a variable for drawing stops a run or changes its figure."""
    (tmp_path / "matplotlibrc").write_text(f"text.usetex: True\n{WILD}no such key: 1\n")
    env = {"MPLBACKEND": "module://matplotlib_inline.backend_inline", "MUJOCO_GL": "cgl"}
    assert run_as_a_process(python, tmp_path, **env) == ""
    assert (tmp_path / "out" / "collision.png").read_bytes() == figure


def missing(place: Path) -> dict[str, str]:
    return {"MATPLOTLIBRC": "/nowhere"}


def a_pipe(place: Path) -> dict[str, str]:
    os.mkfifo(place / "matplotlibrc")
    return {}


def no_text(place: Path) -> dict[str, str]:
    (place / "matplotlibrc").write_bytes(b"\xff\xfe")
    return {}


def at_home(place: Path) -> dict[str, str]:
    folder = place / "home" / ".config" / "matplotlib"
    folder.mkdir(parents=True)
    (folder / "matplotlibrc").write_text(WILD)
    return {"HOME": str(place / "home"), "MPLCONFIGDIR": "", "XDG_CONFIG_HOME": ""}


def named(place: Path) -> dict[str, str]:
    (place / "rc").write_bytes(b"\xff")
    return {"MATPLOTLIBRC": "rc"}


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("surround", "env"),
    [
        (a_pipe, {"MUJOCO_GL": "garbage"}),
        (no_text, {"MUJOCO_GL": "egl"}),
        (at_home, {"MUJOCO_GL": "osmesa"}),
        (named, {"MUJOCO_GL": "glfw"}),
        (missing, {"MUJOCO_GL": "off", "MPLBACKEND": "nonsense"}),
    ],
)
def test_no_setting_for_others_reaches_a_run(python, figure, tmp_path, surround, env):
    """Settings for matplotlib and for MuJoCo, of which neither hides the other, together in a process."""
    said = run_as_a_process(python, tmp_path, **surround(tmp_path), **env)
    assert said == "" or "font cache" in said  # of a home that is new
    assert (tmp_path / "out" / "collision.png").read_bytes() == figure


@pytest.mark.thorough
def test_a_cache_of_matplotlib_that_cannot_be_written_is_said_and_does_no_harm(python, figure, tmp_path):
    (tmp_path / "file").write_text("")
    assert "MPLCONFIGDIR" in run_as_a_process(python, tmp_path, MPLCONFIGDIR=str(tmp_path / "file"))
    assert (tmp_path / "out" / "collision.png").read_bytes() == figure


@pytest.mark.thorough
@pytest.mark.parametrize("env", [{"MPLBACKEND": "nonsense", "MUJOCO_GL": "cgl"}, {"MATPLOTLIBRC": "rc"}])
def test_settings_that_stop_a_package_do_not_stop_a_session(python, tmp_path, env):
    (tmp_path / "rc").write_bytes(b"\xff")
    code = f"""
import os, trainmj
from trainmj.output import style
from trainmj.single.figures import collision
print(len(style.encode(collision(trainmj.run(trainmj.load("b_type_wall"))), "png")))
assert {{name: os.environ[name] for name in {env}}} == {env}
"""
    done = python("-c", code, cwd=tmp_path, **env)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 30_000


@pytest.mark.thorough
def test_a_session_has_its_own_settings_of_matplotlib_after_a_figure_of_ours(python, tmp_path):
    (tmp_path / "matplotlibrc").write_text("font.size: 17\n")
    code = """
from trainmj.output import style
with style.styled():
    style.encode(style.figure(), "png")
import matplotlib
print(matplotlib.rcParams["font.size"], matplotlib.get_backend())
"""
    done = python("-c", code, cwd=tmp_path, MPLBACKEND="svg")
    assert done.stdout.split() == ["17.0", "svg"], done.stderr


@pytest.mark.thorough
def test_a_session_that_draws_disturbs_no_figure_and_is_not_disturbed(figure):
    result = trainmj.run(trainmj.load("b_type", {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.1}))
    wild = {"font.size": 30, "savefig.bbox": "tight", "axes.linewidth": 9, "savefig.facecolor": "red", "figure.dpi": 20}
    with mpl.rc_context(wild | {"interactive": True}), warnings.catch_warnings():
        warnings.simplefilter("error")
        theirs = plt.figure()
        before, backend = dict(mpl.rcParams.copy()), plt.get_backend()
        assert style.encode(collision(result), "png") == figure
        assert dict(mpl.rcParams.copy()) == before
        assert (plt.get_backend(), plt.get_fignums(), plt.gcf()) == (backend, [theirs.number], theirs)
        plt.close(theirs)


def test_mujoco_is_imported_in_one_place():
    """Elsewhere it would be loaded with what MUJOCO_GL names, and fail where that is missing."""
    package = Path(trainmj.__file__).parent
    found = [p.name for p in package.rglob("*.py") if re.search("^(import|from) mujoco", p.read_text(), re.MULTILINE)]
    assert [name for name in found if name != "mj.py"] == []


# streams


@pytest.fixture
def titled(tmp_path: Path) -> str:
    """A scenario whose title no small encoding has."""
    (tmp_path / "tube.csv").write_bytes(TUBE)
    (tmp_path / "s.yaml").write_text(document(BASE | {"title": "Größe – 日本"}), encoding="utf-8")
    return str(tmp_path / "s.yaml")


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "latin-1", "utf-8"])
@pytest.mark.parametrize("command", ["run", "check", "sweep"])
def test_what_an_encoding_does_not_have_is_written_out(titled, tmp_path, encoding, command):
    more = ("--vary", "collision.gap_mm=1,2", "--out", str(tmp_path / "Größe – 日本")) if command == "sweep" else ()
    done = CliRunner(charset=encoding).invoke(main, (command, titled, *more))
    assert done.exit_code == 0, done.exception
    shown = (
        "Größe – 日本" if encoding == "utf-8" else "Größe – 日本".encode(encoding, "backslashreplace").decode(encoding)
    )
    assert shown in done.stdout_bytes.decode(encoding)


def test_json_and_messages_bear_any_encoding(titled):
    json.loads(CliRunner(charset="ascii").invoke(main, ("run", titled, "--json")).stdout)
    done = CliRunner(charset="latin-1").invoke(main, ("run", "日本"))
    assert (done.exit_code, done.stderr[:20]) == (2, "Error: \\u65e5\\u672c:")


def stream(name: str, leads_to: Callable[[], int]) -> Callable[[], None]:
    """In the process of a command: standard output or standard error leads to a file number."""

    def prepare() -> None:
        old = getattr(sys, name)
        os.dup2(leads_to(), old.fileno())
        setattr(sys, name, os.fdopen(old.fileno(), "w", closefd=False))

    return prepare


def full() -> int:
    return os.open("/dev/full", os.O_WRONLY)


def unread() -> int:
    reads, writes = os.pipe()
    os.close(reads)
    return writes


@pytest.mark.parametrize(
    "args", [("run", "b_type", *SHORT), ("run", "b_type", *SHORT, "--json"), ("--help",), ("scenarios",)]
)
def test_a_full_disk_behind_standard_output_is_said(tmp_path, args):
    ended = forked(tmp_path, *args, prepare=stream("stdout", full))
    said = "Error: standard output: cannot be written (No space left on device)\n"
    assert ended == Ended(2, "", said)


def test_a_full_disk_behind_standard_error_leaves_the_exit_code(tmp_path):
    assert forked(tmp_path, "run", "nosuch", prepare=stream("stderr", full)) == Ended(2, "", "")


@pytest.mark.thorough
def test_without_a_reader_a_command_goes_on_to_its_end(tmp_path):
    """Breaks if ``trainmj run ... | head -1`` leaves half of its files, or another exit code."""
    args = ("run", "b_type", *SHORT, "--out", "out", "--report")
    assert forked(tmp_path, *args, prepare=stream("stdout", unread)) == Ended(0, "", "")
    assert (tmp_path / "out" / "report.html").exists()
    assert forked(tmp_path, "run", "nosuch", prepare=stream("stderr", unread)) == Ended(2, "", "")


@pytest.mark.thorough
def test_without_streams_files_are_written_all_the_same(python, tmp_path):
    """As under a service manager; the first file opened would else take the place of standard output."""
    code = """
import os, sys
for number in (0, 1, 2):
    os.close(number)
words = ["-m", "trainmj", "sweep", "b_type", "--vary", "mass_t=30,33", "--out", "out"]
os.execv(sys.executable, [sys.executable, *words])
"""
    assert python("-c", code, cwd=tmp_path).returncode == 0
    assert list(trainmj.read_table(tmp_path / "out").status) == ["over", "over"]


# memory


LITTLE = """
import resource, sys
most = int(sys.argv.pop(1)) << 20
resource.setrlimit(resource.RLIMIT_AS, (most, most))
from trainmj.cli import main
main()
"""


@pytest.mark.thorough
@pytest.mark.parametrize("megabytes", [150, 250, 300, 500, 900])
@pytest.mark.parametrize(
    "args", [("run", "b_type"), ("sweep", "b_type", "--vary", "mass_t=30,33"), ("check", "b_type")]
)
def test_too_little_memory_is_said_before_a_library_meets_it(python, tmp_path, megabytes, args):
    """Breaks if a command hangs, as OpenBLAS does, or ends in a traceback."""
    out = () if args[0] == "check" else ("--out", str(tmp_path / "out"))
    done = python("-c", LITTLE, str(megabytes), *args, *out)
    said = f"Error: not enough memory within ulimit -v {megabytes * 1024}: 1000 MB are needed; raise this limit\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", said)


@pytest.mark.thorough
def test_commands_work_with_the_memory_that_is_asked_for(python, tmp_path):
    for args in (("run", "b_type"), ("sweep", "b_type", "--vary", "mass_t=30,33,36")):
        done = python("-c", LITTLE, "1050", *args, "--out", str(tmp_path / args[0]), "--report")
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
    assert list(trainmj.read_table(tmp_path / "sweep").status) == ["over"] * 3


LACKS = [
    MemoryError(),
    OSError(errno.ENOMEM, "Cannot allocate memory"),
    ImportError("x.so: failed to map segment from shared object"),
    RuntimeError("can't start new thread"),
    RuntimeError("Could not allocate memory"),
]


@pytest.mark.parametrize("lack", LACKS)
def test_a_lack_of_memory_is_known_whatever_a_library_makes_of_it(monkeypatch, lack):
    def fails(*_: object) -> None:
        raise ValueError("found fault with a file") from lack

    monkeypatch.setattr(trainmj.scenario, "load", fails)
    done = CliRunner().invoke(main, ("check", "b_type"))
    assert (done.exit_code, done.stderr[:25]) == (2, "Error: not enough memory:"), done.output


def test_memory_that_runs_out_loses_nothing_that_was_computed(tmp_path, monkeypatch):
    args = ("sweep", "b_type", "--vary", "mass_t=30,33,36", *SHORT, "--out", str(tmp_path / "out"))

    def some(*given: Any, **more: Any) -> Iterator[Any]:
        yield from islice(computed(*given, **more), 1)
        raise MemoryError

    computed = batch.run_lots
    monkeypatch.setattr(batch, "run_lots", some)
    done = CliRunner().invoke(main, args)
    assert (done.exit_code, done.stderr[:25]) == (2, "Error: not enough memory:"), done.output
    kept = len(trainmj.read_table(tmp_path / "out"))
    monkeypatch.setattr(batch, "run_lots", computed)
    assert kept > 0
    assert CliRunner().invoke(main, args).exit_code == 0
    assert len(trainmj.read_table(tmp_path / "out")) == 3


def test_a_file_is_read_with_the_memory_that_it_needs(tmp_path):
    (tmp_path / "small").write_bytes(b"x" * 10_000)
    tracemalloc.start()
    content = read_bytes(tmp_path / "small", 300_000_000)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (len(content), most < 1_000_000) == (10_000, True)
    for most_bytes in (9_999, 5_000):
        with pytest.raises(InputError, match="is larger than"):
            read_bytes(tmp_path / "small", most_bytes)
    assert read_bytes(tmp_path / "small", 10_000) == content


def test_no_other_error_is_taken_for_a_lack_of_memory(monkeypatch):
    monkeypatch.setattr(trainmj.scenario, "load", lambda *_: 1 / 0)
    assert isinstance(CliRunner().invoke(main, ("check", "b_type")).exception, ZeroDivisionError)


def test_a_current_folder_that_is_gone_is_said(tmp_path):
    (tmp_path / "gone").mkdir()
    ended = forked(tmp_path / "gone", "export", "b_type", "--out", "x.xml", prepare=(tmp_path / "gone").rmdir)
    said = "Error: the current folder cannot be used (No such file or directory): change to another one\n"
    assert ended == Ended(2, "", said)


def test_the_end_of_a_file_is_not_taken_for_ctrl_c(monkeypatch):
    def torn(*_: object) -> None:
        raise EOFError("Ran out of input")

    monkeypatch.setattr(trainmj.scenario, "load", torn)
    done = CliRunner().invoke(main, ("check", "b_type"))
    assert isinstance(done.exception, RuntimeError)
    assert "Aborted" not in done.output


# names


@pytest.fixture
def alien(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder whose name is not UTF-8, with a scenario and a targets file of such names in it; the current one."""
    folder = tmp_path / ALIEN
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("this file system has UTF-8 names only")
    for name, content in ((f"s{ALIEN}.yaml", BASE), ("base.yaml", BASE), (f"t{ALIEN}.yaml", TARGETS)):
        (folder / name).write_text(document(content))
    (folder / "tube.csv").write_bytes(TUBE)
    (folder / "wanted.csv").write_bytes(WANTED)
    monkeypatch.chdir(tmp_path)
    return Path(ALIEN)


def works(*args: str | Path) -> str:
    done = CliRunner().invoke(main, tuple(map(str, args)))
    assert done.exit_code == 0, done.output + repr(done.exception)
    return str(done.stdout)


@pytest.mark.thorough
def test_a_folder_whose_name_is_not_utf_8_works_and_is_written_out(alien):
    run = alien / ALIEN
    said = works("run", alien / f"s{ALIEN}.yaml", "--out", run, "--report")
    assert said.endswith("Written to o\\udcfc/o\\udcfc/; open o\\udcfc/o\\udcfc/report.html\n")
    works("report", run)
    assert "trainmj report &#39;o\\udcfc&#39;" in (run / "report.html").read_text(encoding="utf-8")
    json.loads(works("run", run, "--json"))
    sweep = ("sweep", alien / f"s{ALIEN}.yaml", "--vary", "collision.gap_mm=1,2", "--out", alien / "sweep")
    works(*sweep, "--histories", "1", "--parquet", "--report")
    works(*sweep, "--report")
    works("report", alien / "sweep" / "case_1.nc")
    table = trainmj.read_table(alien / "sweep")
    assert list(pd.read_parquet((alien / "sweep" / "results.parquet").open("rb")).TS_mm) == list(table.TS_mm)
    with closing(sqlite3.connect(alien / "sweep" / "results.sqlite")) as db:
        assert (
            db.execute("SELECT value FROM about WHERE key = 'scenario'").fetchone()[0].startswith("title: Two wagons")
        )
    works("export", alien / f"s{ALIEN}.yaml", "--out", alien / "model.xml")


@pytest.mark.thorough
def test_the_long_commands_work_in_such_a_folder_too(alien, monkeypatch):
    """What they write is looked at, so what they compute before is little; other tests compute all of it."""
    monkeypatch.setattr(suite, "GROUPS", (replace(suite.GROUPS[0], cases=suite.GROUPS[0].cases[:1]),))
    monkeypatch.setattr(scatter, "STIFFNESSES", scatter.STIFFNESSES[::10])
    monkeypatch.setattr(scatter, "FINE_MM", 10.0)
    study = {
        "scenario": "base.yaml",
        "factors": {"D": {"sets": "gap", "bounds": [20, 50]}, "M": {"sets": "mass_t", "bounds": [30, 36]}},
        "responses": {"TS": "TS_mm"},
        "design": {"kind": "sobol", "n": 8, "seed": 1},
        "surrogates": {"default": {"order": 1}},
        "objectives": {"TS": "minimise"},
        "optimiser": {"surrogate": {"particles": 8, "iterations": 4}},
        "cross_validation": {"against": []},
    }
    (alien / f"d{ALIEN}.yaml").write_text(document(study))
    works("study", alien / f"d{ALIEN}.yaml", "--out", alien / "study", "--report")
    works("report", alien / "study")
    works("identify", alien / f"t{ALIEN}.yaml", "--out", alien / "found", "--report")
    works("verify", "--page", alien / "page.html")
    works("paper", "--out", alien / "paper")
    works("run", alien / "base.yaml", "--out", alien / "run")
    for name in ("film.webp", "film.mp4", "still.png"):
        works("render", alien / "run", "--out", alien / name, "--size", "320x180")


def test_a_page_bears_any_text(tmp_path):
    page = Page(f"Title {ALIEN}", command=f"trainmj report {ALIEN}")
    page.section(f"Section {ALIEN}").text(f"Text {ALIEN}")
    page.write(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8").count("o\\udcfc") >= 4


def test_a_file_may_have_a_name_as_long_as_the_system_allows(tmp_path, monkeypatch):
    """120 letters of two bytes: the hidden name in the meantime was longer than 255 bytes."""
    monkeypatch.chdir(tmp_path)
    name = f"{'é' * 120}.xml"
    result = CliRunner().invoke(main, ["export", "b_type_wall", "--out", name])
    assert result.exit_code == 0, result.output
    assert (tmp_path / name).exists()
