"""What is printed: no character, and no reader who leaves, stops a command."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress
from typing import Any, TextIO

from trainmj.errors import OutputError


def prepare() -> None:
    """Make standard output and standard error bear what is written to them.

    Characters that an encoding does not have are written out, such as ``\\u2013``. When the reader of a pipe has gone,
    the command goes on to its end without a word. A full disk behind standard output is an OutputError; behind standard
    error there is nowhere to say it.
    """
    sys.stdout = _bearing(sys.stdout, OutputError)
    sys.stderr = _bearing(sys.stderr, None)


def _bearing(stream: TextIO | None, error: type[OutputError] | None) -> TextIO:
    if stream is None:  # closed before the start: the next file that is opened must not take its place
        return open(os.devnull, "w", encoding="utf-8")
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="backslashreplace")
        if not stream.isatty():
            with suppress(OSError):  # one in memory has no number
                buffer = io.BufferedWriter(_Raw(stream.fileno(), error))
                return io.TextIOWrapper(buffer, stream.encoding, stream.errors)
    return stream


class _Raw(io.FileIO):
    """A file that leads nowhere once it has failed."""

    def __init__(self, number: int, error: type[OutputError] | None) -> None:
        super().__init__(number, "w", closefd=False)
        self._error = error

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            if self._error is None or isinstance(error, BrokenPipeError):
                return len(content)
            raise self._error(f"standard output: cannot be written ({error.strerror})") from None
