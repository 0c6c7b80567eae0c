"""What is written: files replaced as a whole, and values as JSON holds them.

Whatever stops the program, the old file or the new one is there, complete.
"""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from trainmj.errors import OutputError

_STREAM = re.compile(r"/dev/[^/]+|/dev/fd/\d+|/proc/[^/]+/fd/\d+")
"""Paths that are written to as they are."""


@contextmanager
def replacing(file: str | Path, mode: int = 0o666) -> Iterator[Path]:
    """A path to write to, which replaces the file when the block ends without an error, and is removed otherwise.

    Args:
        file: what is made or replaced. A link is replaced, never followed. Streams such as /dev/stdout are written to
            directly; other pipes and devices are refused.
        mode: who may read and write it, less what the process allows nobody.

    Raises:
        OutputError: if it cannot be written, for example because the disk is full.
    """
    file = Path(file)
    stream = bool(_STREAM.fullmatch(os.path.abspath(file)))
    part = file if stream else file.with_name(part_name(file.name))
    try:
        if not stream:
            if what := special(file):
                raise OutputError(f"{file}: cannot be written ({what}): remove it, or choose another place")
            os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))  # follows no link that lies there
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


_LONGEST = 200  # bytes of a name that stay in another one; file systems have 255
UNFINISHED = re.compile(r"\.(.+)\.(\d+)\.\w{8}\.part")
"""Hidden names of what a process has not finished: name and process."""


def part_name(name: str) -> str:
    """The hidden name of a file that this process has not finished, unlike any that is there."""
    begin = os.fsdecode(os.fsencode(name)[:_LONGEST]).encode("utf-8", "ignore").decode()  # no half of a letter
    return f".{begin}.{os.getpid()}.{token_hex(4)}.part"


def special(file: Path) -> str:
    """What a file is that can neither be replaced nor removed as one: a folder, pipe or device; empty for others."""
    try:
        mode = file.lstat().st_mode
    except (OSError, ValueError):
        return ""
    if stat.S_ISREG(mode) or stat.S_ISLNK(mode):
        return ""
    return "is a folder" if stat.S_ISDIR(mode) else "is a pipe or a device"


def write_bytes(file: str | Path, content: bytes, mode: int = 0o666) -> None:
    """Make or replace a file with this content; mode as of :func:`replacing`.

    Raises:
        OutputError: if it cannot be written.
    """
    with replacing(file, mode) as part:
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


def finite(value: Any) -> Any:
    """The same value with None for infinities and NaN, which JSON does not have, in groups and lists too."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
