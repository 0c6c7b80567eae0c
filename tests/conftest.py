"""What several test files share: the standard collision, run once."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:  # the process that only hands out tests starts them sooner without
    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary
    from trainmj.scenario import Scenario
    from trainmj.study.run import StudyResult

gc.set_threshold(100_000)  # as in commands: looking for garbage takes a fifth of the time of imports

# A shell that starts the tests in the background lets them ignore Ctrl-C, as nohup the end of a terminal, which what
# they start would inherit.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

os.fsync = lambda _: None  # no test cuts the power, and a busy disk is slow

# Hundreds of processes import what is tested: where Python may not keep what it compiled, half their time is compiling.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

os.environ["LP_NUM_THREADS"] = "0"  # Mesa's own threads would be missing in processes that tests fork

Python = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def standard() -> Scenario:
    from trainmj.scenario import load

    return load("b_type")


@pytest.fixture(scope="session")
def standard_result(standard: Scenario) -> Result:
    from trainmj.collision.simulation import run

    return run(standard)


@pytest.fixture(scope="session")
def standard_summary(standard_result: Result) -> Summary:
    from trainmj.collision.summary import summarise

    return summarise(standard_result)


@pytest.fixture(scope="session")
def small_study(tmp_path_factory: pytest.TempPathFactory) -> StudyResult:
    """A small study, finished; tests that change it work on copies of its folder."""
    from studies import run, small

    return run(small(), tmp_path_factory.mktemp("small") / "out")


@pytest.fixture(scope="session")
def python(tmp_path_factory: pytest.TempPathFactory) -> Python:
    """Run Python in a process of its own, as a user does, away from the checkout."""
    away = tmp_path_factory.mktemp("away")

    def call(*args: str, cwd: Path = away, **env: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *args],
            cwd=cwd,
            env=os.environ | {"COLUMNS": "80"} | env,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    return call


def pytest_collectstart() -> None:
    """Before any module with tests is imported, and not where they are only handed out."""
    import hypothesis

    hypothesis.settings.register_profile("any machine", deadline=None)  # a busy one is slow, not wrong
    hypothesis.settings.load_profile("any machine")


def pytest_collection_finish() -> None:
    gc.freeze()  # what was imported stays: looking through it again and again takes a twentieth of the time


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--random-trains", type=int, default=3, help="seeds of random trains against solve_ivp")


@pytest.fixture
def random_trains(request: pytest.FixtureRequest) -> int:
    return int(request.config.getoption("--random-trains"))
