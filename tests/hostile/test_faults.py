"""What happens when the machine fails: each command with each fault, for real, in a process of its own.

The processes are forked from this one, so that each begins with all imports done. Another command is one more row of
COMMANDS. TRAINMJ_FAULTS=all has the slow rows too.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import pandas as pd
import pytest
from builders import few
from forked import Ended, Forked, Prepare, forked
from kinds import BASE, TARGETS, TUBE, WANTED, draws
from mutations import document
from PIL import Image

import trainmj
import trainmj.cases.engine
import trainmj.collision.identity
import trainmj.collision.kernel
import trainmj.collision.lots
import trainmj.collision.offsets
import trainmj.collision.simulation
import trainmj.identification.run
import trainmj.paper.output
import trainmj.paper.reproduce
import trainmj.single.page
import trainmj.verification.suite
import trainmj.view.film
import trainmj.view.scene
from trainmj.cli.report import write_report
from trainmj.collision.identity import identity
from trainmj.files.folder import held
from trainmj.files.sealed import unsealed
from trainmj.single.folder import write_run

pytestmark = pytest.mark.thorough

FAST = ("--set", "simulation.step_ms=0.5", "--set", "simulation.time_limit_s=0.1")
STUDY = {
    "scenario": "b_type_wall",
    "set": {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.1},
    "factors": {"D": {"sets": "empty_stroke_mm", "bounds": [20, 50]}, "M": {"sets": "mass_t", "bounds": [30, 36]}},
    "responses": {"TS": "TS_mm", "TAMA": "TAMA_g"},
    "design": {"kind": "sobol", "n": 8, "seed": 1},
    "surrogates": {"default": {"order": 1}},
    "objectives": {"TS": "minimise", "TAMA": "minimise"},
    "optimiser": {"surrogate": {"particles": 8, "iterations": 4}},
    "cross_validation": {"against": []},
}
ALL = os.environ.get("TRAINMJ_FAULTS") == "all"
root = hasattr(os, "geteuid") and os.geteuid() == 0


@dataclass(frozen=True)
class Command:
    """A command that leaves files.

    Attributes:
        args: what is typed, without the output.
        out: where it writes, in the folder of results; a folder if it is "out".
        whole: fails if what is there is torn; what is not there is no harm.
        works: a function that is called in the middle of its work.
        option: that names the output.
        less: called first in its process: makes what does not matter here shorter.
    """

    args: tuple[str, ...]
    out: str
    whole: Callable[[Path], None]
    works: tuple[Any, str] = (trainmj.collision.lots, "line_up")
    option: str = "--out"
    less: Callable[[], None] = lambda: None

    @property
    def folder(self) -> bool:
        """Whether it fills a folder."""
        return self.out == "out"


def whole_run(out: Path) -> None:
    if (out / "summary.json").exists():
        summary = unsealed((out / "summary.json").read_bytes())
        assert trainmj.summarise(trainmj.load_result(out / "result.nc")).as_dict() == summary
        assert len(pd.read_csv(out / "vehicles.csv")) == len(summary["vehicles"])
        trainmj.load(out / "scenario.yaml")
    elif (out / "result.nc").exists():
        trainmj.load_result(out / "result.nc")


def whole_export(out: Path) -> None:
    if out.exists():
        mujoco.MjModel.from_xml_path(str(out))


def whole_sweep(out: Path) -> None:
    if (out / "results.csv").exists():
        assert len(pd.read_csv(out / "results.csv")) == 6


def whole_study(out: Path) -> None:
    for table in out.glob("*.csv"):
        pd.read_csv(table)
    for facts in out.glob("*.json"):
        json.loads(facts.read_text())


def whole_identification(out: Path) -> None:
    whole_study(out)
    if (out / "summary.json").exists():
        assert len(pd.read_csv(out / "parameters.csv")) == len(TARGETS["parameters"])
        trainmj.load(out / "found.yaml")


def whole_page(out: Path) -> None:
    if out.exists():
        assert out.read_text(encoding="utf-8").rstrip().endswith("</html>")


def whole_picture(out: Path) -> None:
    if out.exists():
        Image.open(out).load()


def one_case_of_verify() -> None:
    groups = trainmj.verification.suite.GROUPS
    trainmj.verification.suite.GROUPS = (replace(groups[0], cases=groups[0].cases[:1]),)


COMMANDS = {
    "run": Command(
        ("run", "b_type_wall", *FAST, "--figures", "none"),
        "out",
        whole_run,
        works=(trainmj.collision.simulation, "line_up"),
    ),
    "export": Command(("export", "b_type_wall"), "model.xml", whole_export, works=(trainmj.view.scene, "spec")),
    "sweep": Command(
        ("sweep", "b_type_wall", *FAST, "--vary", "mass_t=30:36:6", "--threads", "1"),
        "out",
        whole_sweep,
    ),
    "study": Command(("study", "my.study.yaml", "--figures", "none", "--threads", "1"), "out", whole_study),
    "identify": Command(
        ("identify", "my.targets.yaml", "--figures", "none", "--threads", "1"),
        "out",
        whole_identification,
        works=(trainmj.identification.run, "uncertainty"),
    ),
    "report": Command(("report", "finished"), "page.html", whole_page, works=(trainmj.single.page, "summarise")),
    "render": Command(
        ("render", "finished", "--size", "320x180", "--fast"),
        "still.png",
        whole_picture,
        works=(trainmj.view.film, "write_still"),
    ),
    "paper": Command(("paper", "--figures", "none"), "out", whole_study, works=(trainmj.paper.output, "page_of")),
    "verify": Command(
        ("verify",),
        "page.html",
        whole_page,
        works=(trainmj.verification.suite, "run_case"),
        option="--page",
        less=one_case_of_verify,
    ),
}
NEEDS = {"render": pytest.mark.skipif(not draws(), reason="nothing here draws without a screen: install libosmesa6")}
SLOW = () if ALL else ("paper",)
ROWS = {
    name: pytest.param(row, id=name, marks=NEEDS.get(name, ())) for name, row in COMMANDS.items() if name not in SLOW
}
every_command = pytest.mark.parametrize("command", ROWS.values())
every_folder = pytest.mark.parametrize("command", [row for name, row in ROWS.items() if COMMANDS[name].folder])


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run. Making it also imports and compiles what processes forked from here need."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "my.study.yaml").write_text(document(STUDY))
    result = trainmj.run(trainmj.load("b_type_wall", {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.1}))
    write_run(result, trainmj.summarise(result), folder, formats=())
    write_report(folder)
    trainmj.run_study(folder / "my.study.yaml", folder / "study", threads=1, figures=())
    return folder


@pytest.fixture
def place(finished: Path) -> Iterator[Path]:
    """A folder that every user of the machine can reach."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "my.study.yaml").write_text(document(STUDY))
        for file, content in (("my.targets.yaml", TARGETS), ("base.yaml", BASE)):
            (folder / file).write_text(document(content))
        (folder / "tube.csv").write_bytes(TUBE)
        (folder / "wanted.csv").write_bytes(WANTED)
        (folder / "finished").mkdir()
        shutil.copy(finished / "result.nc", folder / "finished")
        yield folder


def done(place: Path, command: Command, *more: str, prepare: Prepare = lambda: None) -> Ended:
    def first() -> None:
        command.less()
        prepare()

    return forked(place, *command.args, *more, command.option, place / command.out, prepare=first)


def process(place: Path, *args: str | Path, **options: Any) -> subprocess.Popen[str]:
    """The command from the very start."""
    words = [sys.executable, "-m", "trainmj", *map(str, args)]
    return subprocess.Popen(words, cwd=place, stdout=-1, stderr=-1, text=True, **options)


def said_no(ended: Ended, *words: str) -> None:
    """One clear message, exit code 2, no traceback."""
    assert ended.returncode == 2, ended.stdout + ended.stderr
    assert ended.stderr.startswith("Error: ")
    assert "Traceback" not in ended.stderr
    for word in words:
        assert re.search(word, ended.stderr), ended.stderr


def worked(ended: Ended) -> None:
    assert ended.returncode == 0, ended.stdout + ended.stderr


def leftovers(folder: Path) -> list[str]:
    return [p.name for p in folder.rglob("*") if "part" in p.name]


@contextmanager
def disk(folder: Path, *options: str) -> Iterator[bool]:
    """A file system of its own in a folder, where this machine allows it."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", ",".join(options), "tmpfs", str(folder)]
    mounted = root and subprocess.run(mount, capture_output=True, check=False).returncode == 0
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", str(folder)], check=True)


@every_command
def test_a_full_disk_is_said_nothing_is_torn_and_with_room_it_goes_on(place: Path, command: Command) -> None:
    inside = replace(command, out=f"disk/{command.out}")
    with disk(place / "disk", "size=8k") as mounted:
        limit = (lambda: None) if mounted else partial(resource.setrlimit, resource.RLIMIT_FSIZE, (2000, 2000))
        said_no(done(place, inside, prepare=limit), r"cannot be (written|used|made)|disk is full")
        command.whole(place / inside.out)
        assert not leftovers(place / "disk")
        if mounted:
            subprocess.run(["mount", "-o", "remount,size=20m", str(place / "disk")], check=True)
        worked(done(place, inside))
        command.whole(place / inside.out)


@every_command
def test_a_folder_that_cannot_be_written_is_said(place: Path, command: Command) -> None:
    with disk(place / "disk", "ro") as mounted:
        if root and not mounted:
            pytest.skip("root may write everywhere, and may not mount here")
        (place / "disk").chmod(0o555) if not mounted else None
        said_no(done(place, replace(command, out=f"disk/{command.out}")), "Read-only|Permission denied")


@every_command
def test_output_that_exists_is_replaced_whole_or_gone_on_with(place: Path, command: Command) -> None:
    out = place / command.out
    worked(done(place, command))
    before = {p: p.read_bytes() for p in (out.rglob("*") if out.is_dir() else [out])}
    (place / "own.txt").write_text("mine")
    worked(done(place, command))
    after = {p: p.read_bytes() for p in before}
    different = [p.name for p in before if before[p] != after[p] and p.suffix in (".csv", ".xml", ".yaml", ".json")]
    assert not different, "the same command leaves the same files"
    command.whole(out)
    assert not leftovers(place)


@every_command
def test_killed_while_files_are_put_in_place_nothing_is_torn_and_it_can_be_done_again(
    place: Path, command: Command
) -> None:
    """Between two of them, or before the only one."""

    def prepare() -> None:
        put, left = os.replace, [3 if command.folder and "sweep" not in command.args else 1]

        def killing(*args: Any) -> None:
            left[0] -= 1
            if left[0] == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            put(*args)

        os.replace = killing  # type: ignore[assignment]

    ended = done(place, command, prepare=prepare)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    command.whole(place / command.out)
    worked(done(place, command))
    command.whole(place / command.out)
    assert not (command.folder and leftovers(place)), "what it left unfinished is gone"


def test_killed_at_any_moment_a_run_leaves_the_earlier_result_or_the_new_one(place: Path) -> None:
    command = COMMANDS["run"]
    worked(done(place, command))
    for wait in (0.1, 0.3, 0.4, 0.6):

        def prepare(wait: float = wait) -> None:
            signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGKILL))
            signal.setitimer(signal.ITIMER_REAL, wait)

        done(place, command, "--set", "mass_t=36", prepare=prepare)
        assert (place / "out" / "summary.json").exists()
        whole_run(place / "out")


def interrupt() -> None:
    """Ctrl-C."""
    os.kill(os.getpid(), signal.SIGINT)


def at(module: Any, name: str, act: Callable[[], None]) -> Prepare:
    """Something happens when a function is called."""

    def prepare() -> None:
        function = getattr(module, name)

        def now(*args: Any, **named: Any) -> Any:
            act()
            return function(*args, **named)

        setattr(module, name, now)

    return prepare


@every_command
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_ends_with_its_code_and_a_word(place: Path, command: Command, number: int) -> None:
    """Batch systems send SIGTERM, a terminal that is closed SIGHUP."""
    ended = done(place, command, prepare=at(*command.works, lambda: os.kill(os.getpid(), number)))
    assert ended.returncode == 128 + number, ended.stderr
    assert ended.stderr.startswith("Stopped")
    assert "Traceback" not in ended.stderr
    command.whole(place / command.out)
    assert not leftovers(place)


@every_command
def test_killed_in_the_middle_of_its_work_it_can_be_done_again(place: Path, command: Command) -> None:
    ended = done(place, command, prepare=at(*command.works, lambda: os.kill(os.getpid(), signal.SIGKILL)))
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    command.whole(place / command.out)
    worked(done(place, command))
    command.whole(place / command.out)


@every_folder
def test_a_second_one_in_the_same_folder_is_refused_and_may_come_later(place: Path, command: Command) -> None:
    with held(place / "out"):
        said_no(done(place, command), "out: another trainmj is writing to this folder: wait for it")
        assert not list((place / "out").iterdir())
    worked(done(place, command))


def test_two_at_once_and_the_first_one_ends_as_if_it_were_alone(place: Path) -> None:
    command = COMMANDS["sweep"]
    first = os.fork()
    if first == 0:
        ended = done(place, command, prepare=at(*command.works, lambda: time.sleep(0.3)))
        os._exit(ended.returncode)
    until = time.monotonic() + 60
    while not (place / "out" / "results.sqlite").exists() and time.monotonic() < until:
        time.sleep(0.01)
    said_no(done(place, command), "another trainmj is writing")
    assert os.waitstatus_to_exitcode(os.waitpid(first, 0)[1]) == 0
    whole_sweep(place / "out")


def test_a_command_in_the_background_whose_interruptions_are_ignored_can_be_ended(place: Path) -> None:
    """As shells start them: it would run to its end."""
    command = COMMANDS["sweep"]

    def prepare() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        at(*command.works, lambda: os.kill(os.getpid(), signal.SIGTERM))()

    assert done(place, command, prepare=prepare).returncode == 128 + signal.SIGTERM


def test_a_command_that_is_stopped_for_a_while_keeps_its_folder_and_goes_on(place: Path) -> None:
    """As with Ctrl-Z."""
    command = COMMANDS["sweep"]
    slow = at(*command.works, lambda: time.sleep(0.3))
    first = Forked(place, *command.args, command.option, place / command.out, prepare=slow)
    until = time.monotonic() + 60
    while not (place / "out" / "results.sqlite").exists() and time.monotonic() < until:
        time.sleep(0.01)
    first.send(signal.SIGSTOP)
    said_no(done(place, command), "another trainmj is writing")
    said_no(done(place, command, "--fresh"), "another trainmj is writing")
    first.send(signal.SIGCONT)
    worked(first.ended())
    whole_sweep(place / "out")


def test_an_interruption_while_the_law_is_compiled_is_not_lost(place: Path) -> None:
    def prepare() -> None:
        trainmj.collision.kernel._callbacks.cache_clear()
        at(trainmj.collision.kernel, "_compile", interrupt)()

    ended = done(place, COMMANDS["run"], prepare=prepare)
    assert (ended.returncode, ended.stderr) == (130, "Stopped.\n")


@pytest.mark.parametrize("command", [row for name, row in ROWS.items() if ALL or name in ("run", "render")])
def test_without_home_and_with_caches_that_cannot_be_written_it_works(place: Path, command: Command) -> None:
    """The law is compiled for this process alone."""
    with disk(place / "caches", "ro") as mounted:
        if root and not mounted:
            pytest.skip("root may write everywhere, and may not mount here")
        (place / "caches").chmod(0o555) if not mounted else None
        caches = dict.fromkeys(("NUMBA_CACHE_DIR", "MPLCONFIGDIR"), str(place / "caches"))
        env = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME")} | caches
        started = process(place, *command.args, command.option, place / command.out, env=env)
        _, said = started.communicate(timeout=300)
    assert started.returncode == 0, said
    assert "Traceback" not in said
    assert (place / command.out).exists()


def test_a_mujoco_that_keeps_its_fields_elsewhere_is_refused(place: Path) -> None:
    def prepare() -> None:
        search = trainmj.collision.offsets._search
        mujoco.__version__ = "9.9.9"
        trainmj.collision.offsets._search = lambda address, wanted: {
            name: set() if name == "qvel" else places for name, places in search(address, wanted).items()
        }
        trainmj.collision.offsets.field_offsets.cache_clear()
        trainmj.collision.kernel._callbacks.cache_clear()

    ended = forked(place, "run", "b_type_wall", *FAST, prepare=prepare)
    said_no(ended, r"MuJoCo 9\.9\.9 keeps qvel where it was not found: this version is not supported")
    ended = done(place, COMMANDS["verify"], prepare=prepare)
    assert ended.returncode == 1, ended.stderr
    assert "not supported" in " ".join((place / "page.html").read_text(encoding="utf-8").split())


def with_another_mujoco() -> None:
    """As if this were another version, all its fields where they can be found."""
    now = tuple((identity() | {"mujoco": "4.9.9"}).items())
    trainmj.collision.identity._identity = lambda: now  # type: ignore[assignment]


def test_another_mujoco_that_has_its_fields_runs_and_the_result_says_which(place: Path) -> None:
    worked(done(place, COMMANDS["run"], prepare=with_another_mujoco))
    ended = forked(place, "run", "out")
    worked(ended)
    assert "The same as the saved result, bit for bit." in ended.stdout
    assert f"mujoco 4.9.9 then, {mujoco.__version__} now" in ended.stdout


@pytest.mark.parametrize("name", ["sweep", "identify", "study"])
def test_nothing_goes_on_with_numbers_of_another_mujoco(place: Path, name: str) -> None:
    worked(done(place, COMMANDS[name], prepare=with_another_mujoco))
    said = f"mujoco 4.9.9 then, {mujoco.__version__} now"
    ended = done(place, COMMANDS[name])
    if name == "study":
        worked(ended)
        assert f"{said}: every collision is computed again" in ended.stderr
    else:
        said_no(ended, said)
        worked(done(place, COMMANDS[name], "--fresh"))


def test_export_writes_to_a_device_as_it_is(place: Path) -> None:
    """A disk that is full for real, and a device that must not be replaced by a file."""
    ended = forked(place, "export", "b_type_wall", "--out", "/dev/full")
    said_no(ended, "/dev/full: cannot be written .*No space left")
    assert not Path("/dev/full").is_file()
    assert "<mujoco" in forked(place, "export", "b_type_wall", "--out", "/dev/stdout").stdout


@pytest.mark.parametrize("times", few([2, 30], 1))
def test_further_interruptions_do_not_disturb_the_end_of_a_sweep(place: Path, times: int) -> None:
    """Breaks if native threads lose their law while they step: 6 of 24 second Ctrl-C were segmentation faults."""
    command = COMMANDS["sweep"]

    def prepare() -> None:
        def again() -> None:
            for _ in range(times):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.01)

        at(trainmj.cases.engine.Local, "_rows", lambda: threading.Thread(target=again, daemon=True).start())()

    ended = done(place, command, "--vary", "collision.gap_mm=20:50:60", "--threads", "2", prepare=prepare)
    assert ended.returncode == 130, ended.stderr
    assert ended.stderr == f"Stopped. What was finished is in {place / 'out'}; the same command goes on.\n"
    whole_sweep(place / "out")


def test_an_interruption_after_the_end_disturbs_nothing(place: Path) -> None:
    """Breaks if Python, which takes a moment to go, ends in a traceback or with another exit code."""
    code = "import atexit, os, signal, sys; from trainmj.cli import main; sys.argv = ['trainmj', 'scenarios']; "
    code += "atexit.register(os.kill, os.getpid(), signal.SIGINT); main()"
    ended = subprocess.run([sys.executable, "-c", code], cwd=place, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_an_interruption_that_a_package_loses_may_be_given_again(place: Path) -> None:
    """As some do that come while it is imported."""

    def lose() -> None:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    command = COMMANDS["sweep"]
    assert done(place, command, prepare=at(*command.works, lose)).returncode == 130
