"""What is written: files replaced as a whole, folders that one process holds, and values as JSON holds them.

Whatever stops the program, the old file or the new one is there, complete.
"""

from __future__ import annotations

import math
import os
import re
import stat
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from trainmj.errors import OutputError
from trainmj.files.arguments import path_given

try:
    import fcntl
except ImportError:  # pragma: no cover - not on Windows
    fcntl = None  # type: ignore[assignment]

_MOMENT = 0.1  # for those who only look whether a folder is held [s]


_STREAM = re.compile(r"/dev/[^/]+|/dev/fd/\d+|/proc/[^/]+/fd/\d+")
"""Paths that are written to as they are."""


@contextmanager
def replacing(file: str | Path) -> Iterator[Path]:
    """A path to write to, which replaces the file when the block ends without an error, and is removed otherwise.

    Args:
        file: what is made or replaced. A link is replaced, never followed. Streams such as /dev/stdout are written to
            directly; other pipes and devices are refused.

    Raises:
        OutputError: if it cannot be written, for example because the disk is full.
    """
    file = Path(file)
    stream = bool(_STREAM.fullmatch(os.path.abspath(file)))
    part = file if stream else file.with_name(part_name(file.name[:200]))
    try:
        if not stream:
            if what := special(file):
                raise OutputError(f"{file}: cannot be written ({what}): remove it, or choose another place")
            os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))  # follows no link that lies there
        yield part
        if stream:
            return
        with part.open("rb+") as written:
            os.fsync(written.fileno())
        os.replace(part, file)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error.strerror or error})") from None
    finally:
        if not stream:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def part_name(name: str) -> str:
    """The hidden name of a file that this process has not finished, unlike any that is there."""
    return f".{name}.{os.getpid()}.{token_hex(4)}.part"


def special(file: Path) -> str:
    """What a file is that can neither be replaced nor removed as one: a folder, pipe or device; empty for others."""
    try:
        mode = file.lstat().st_mode
    except (OSError, ValueError):
        return ""
    if stat.S_ISREG(mode) or stat.S_ISLNK(mode):
        return ""
    return "is a folder" if stat.S_ISDIR(mode) else "is a pipe or a device"


def write_bytes(file: str | Path, content: bytes) -> None:
    """Make or replace a file with this content.

    Raises:
        OutputError: if it cannot be written.
    """
    with replacing(file) as part:
        part.write_bytes(content)


def remove(file: Path) -> None:
    """Remove a file if it is there.

    Raises:
        OutputError: if it cannot be removed.
    """
    try:
        file.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{file}: cannot be removed ({error.strerror or error})") from None


@contextmanager
def held(folder: str | Path) -> Iterator[Path]:
    """Make a folder, if it is not there, and hold it, so that nothing else writes results there meanwhile.

    The lock is on the folder itself: it leaves no file, and the system lifts it however the process ends. Where a file
    system has no locks nobody is refused.

    Raises:
        OutputError: if it cannot be made, or something else holds it.
    """
    folder = path_given(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made a folder ({error.strerror})") from None
    handle = _locked(folder)
    try:
        yield folder
    finally:
        if handle is not None:
            fcntl.flock(handle, fcntl.LOCK_UN)  # a forked process may still have the handle
            os.close(handle)


def is_held(folder: Path) -> bool:
    """Whether something is writing results to a folder."""
    try:
        with held(folder):
            return False
    except OutputError:
        return True


def _locked(folder: Path) -> int | None:
    """A handle that holds the folder; None where there are no locks."""
    if fcntl is None:  # pragma: no cover
        return None
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_MOMENT)
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise OutputError(
            f"{folder}: another trainmj is writing to this folder: wait for it, or take another folder"
        ) from None
    except OSError:
        os.close(handle)
        return None
    return handle


def finite(value: Any) -> Any:
    """The same value with None for infinities and NaN, which JSON does not have, in groups and lists too."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
