"""Files that are wrong in any way end in a clear message and exit code 2: no traceback, no hang, bounded memory.

A long run: ``TRAINMJ_MUTATIONS=2000 pytest tests/hostile/test_mutated_files.py``, so many for each kind of file.
"""

from __future__ import annotations

import os
import re
import resource
import signal
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from builders import few
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st
from kinds import KINDS, RESULTS, Kind
from mutations import Mutant, good, mutants

from trainmj.errors import InputError
from trainmj.files.text import HIDDEN

SHARES = {"study": 2, "study of given points": 1, "study folder": 2, "sweep folder": 3, "result": 2}
OTHERS = 2  # of each other kind; TRAINMJ_MUTATIONS=1000 makes as many of each
LONGEST = 10.0  # of this process's own time [s]; the machine may be busy with others
LONGEST_WAIT = 600.0  # of any time [s]: something waits for what never comes
MEMORY = 1_500_000_000  # more than at the start [bytes]
CHEAP = 1e5  # cost of what is computed here
LONGEST_MESSAGE = 12_000  # characters

count: Counter[str] = Counter()


class TooLong(BaseException):
    """The time is over; no handler of the program catches it."""


@contextmanager
def bounded() -> Iterator[None]:
    """Time and memory of what runs inside are limited."""

    def stop(which: int, _: object) -> None:
        raise TooLong(signal.Signals(which).name)

    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before, hard = resource.getrlimit(resource.RLIMIT_AS)
    handlers = {s: signal.signal(s, stop) for s in (signal.SIGALRM, signal.SIGPROF)}
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, hard))
    signal.setitimer(signal.ITIMER_REAL, LONGEST_WAIT)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        resource.setrlimit(resource.RLIMIT_AS, (before, hard))
        for number, handler in handlers.items():
            signal.signal(number, handler)


def judge(kind: Kind, mutant: Mutant) -> None:
    """Use the files as a user would and look at how it ends."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "in"
        folder.mkdir()
        (Path(name) / "outside.yaml").write_text("title: not for you\n")
        mutant.write(folder)
        file = folder / kind.main
        with bounded(), warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                cost = kind.cost(kind.load(file))
            except InputError as error:
                said(str(error), folder, mutant)
                cost = 0.0
                count["refused"] += 1
            ends = kind.use(file, Path(name)) if cost < CHEAP else []
        for code, output in ends:
            assert code in (0, 1, 2), output
            count[f"exit {code}"] += 1
            if code == 2:
                assert output.startswith("Error: "), output
                said(output, folder, mutant)
            assert not HIDDEN.search(output), "a control character reaches the terminal"
        count["loaded only"] += not ends
        assert not list(Path(name).rglob("owned")), "a file has run a program"


def said(message: str, folder: Path, mutant: Mutant) -> None:
    """The message is fit to be read."""
    assert message.strip()
    assert len(message) < LONGEST_MESSAGE, len(message)
    assert "Traceback" not in message
    if not mutant.said.startswith("my."):  # a link that the user names is the user's own
        assert not re.search(r"root:x:|not for you|PATH=", message), "it shows a file from elsewhere"


@pytest.mark.parametrize("times", few([1, 4], 1))
@pytest.mark.parametrize("kind", KINDS + RESULTS, ids=lambda kind: kind.name)
def test_a_good_file_runs_and_a_mutated_one_ends_in_a_clear_message_or_runs(
    kind: Kind, times: int, tmp_path: Path
) -> None:
    Mutant(dict(good(kind)), "good").write(tmp_path)
    ends = kind.use(tmp_path / kind.main, tmp_path)  # and everything is imported
    assert {code for code, _ in ends} == {0}, ends

    @settings(
        max_examples=int(os.environ.get("TRAINMJ_MUTATIONS", times * SHARES.get(kind.name, OTHERS))),
        deadline=None,
        database=None,
        derandomize="TRAINMJ_MUTATIONS" not in os.environ,
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    @given(st.data())
    def one(data: st.DataObject) -> None:
        mutant = data.draw(mutants(kind))
        note(mutant.said)
        count["mutants"] += 1
        judge(kind, mutant)

    one()
    print(dict(count))  # noqa: T201
