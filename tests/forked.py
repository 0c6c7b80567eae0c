"""Commands in processes forked from this one, which begin with all imports done and the law compiled."""

from __future__ import annotations

import os
import sys
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cma  # noqa: F401 these are what commands import late
import PIL.ImageDraw  # noqa: F401

from trainmj.cli import main

Prepare = Callable[[], None]
"""What is done first in the process of a command: patches, limits."""


@dataclass(frozen=True)
class Ended:
    """How a process ended: its exit code, or minus the signal that killed it."""

    returncode: int
    stdout: str
    stderr: str


class Forked:
    """A command as a user types it, under way."""

    def __init__(self, place: Path, *args: str | Path, prepare: Prepare = lambda: None) -> None:
        self._out, self._err = (tempfile.TemporaryFile() for _ in range(2))  # noqa: SIM115 closed when it has ended
        self._child = os.fork()
        if self._child == 0:
            self._run(place, args, prepare)

    def _run(self, place: Path, args: tuple[str | Path, ...], prepare: Prepare) -> None:
        code = 70
        try:
            os.chdir(place)
            os.dup2(self._out.fileno(), 1)
            os.dup2(self._err.fileno(), 2)
            sys.stdout, sys.stderr = (os.fdopen(fd, "w", encoding="utf-8", closefd=False) for fd in (1, 2))
            sys.argv = ["trainmj", *map(str, args)]
            sys.dont_write_bytecode = True  # where files may not grow, Python leaves torn ones, which stop later tests
            prepare()
            main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0
        except BaseException:  # noqa: BLE001 what a person would see as a traceback
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def send(self, number: int) -> None:
        """A signal."""
        os.kill(self._child, number)

    def ended(self) -> Ended:
        """Wait for its end."""
        returncode = os.waitstatus_to_exitcode(os.waitpid(self._child, 0)[1])
        said = []
        for file in (self._out, self._err):
            with file:
                file.seek(0)
                said.append(file.read().decode())
        return Ended(returncode, *said)


def forked(place: Path, *args: str | Path, prepare: Prepare = lambda: None) -> Ended:
    """A command as a user types it, to its end."""
    return Forked(place, *args, prepare=prepare).ended()
