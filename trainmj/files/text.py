"""Text from outside: read within bounds, and never a command to a terminal or a spreadsheet."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any
from unicodedata import normalize

from trainmj.errors import InputError

HIDDEN = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
"""Characters that control a terminal, change the direction of writing, or that XML or UTF-8 cannot hold."""

FORMULA = ("=", "+", "-", "@")
"""Characters with which a formula begins in a spreadsheet."""

Folders = str | Path | Iterable[str | Path]
"""A folder, or several."""

_allowed: ContextVar[tuple[Path, ...]] = ContextVar("allowed", default=())


def printable(text: str) -> str:
    """The text with hidden characters written out, such as ``\\x1b``, so that it can be printed anywhere."""
    return HIDDEN.sub(lambda found: ascii(found[0])[1:-1], text)


def is_formula(text: str) -> bool:
    """Whether a spreadsheet takes text for a formula: some pass over spaces, and over the width of letters."""
    return normalize("NFKC", text).lstrip().startswith(FORMULA)


def read_text(path: Path, most_bytes: int) -> str:
    """Read the text of a regular file from outside.

    Raises:
        InputError: saying what is wrong, without the name of the file.
    """
    content = read_bytes(path, most_bytes)
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"is not UTF-8 text (line {line}): save it as UTF-8") from None


def decoded(content: bytes) -> tuple[str, tuple[str, ...]]:
    """The text of a table in UTF-8, UTF-16 with its mark (Excel's Unicode text), or Windows-1252; and notes on it.

    Latin-1 is part of Windows-1252, as far as it is text.

    Raises:
        InputError: if it is in none of them.
    """
    wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        return content.decode("utf-16" if wide else "utf-8-sig").replace("\r\n", "\n"), ()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
    try:
        if not wide:
            note = f"is not UTF-8 (line {line}): its letters are read as Windows-1252, of which Latin-1 is a part"
            return content.decode("cp1252").replace("\r\n", "\n"), (note,)
    except UnicodeDecodeError:
        pass
    raise InputError(f"is not UTF-{'16' if wide else '8'} text (line {line}): save it as UTF-8")


def read_bytes(path: Path, most_bytes: int, follow: bool = True) -> bytes:
    """Read a regular file from outside; devices, pipes, folders and larger files are refused.

    Args:
        path: of the file.
        most_bytes: that it may have.
        follow: whether it may be a link.

    Raises:
        InputError: saying what is wrong, without the name of the file.
    """
    try:
        if not follow and path.is_symlink():
            raise InputError("is a link to another file")
        if not path.is_file():
            there = "is a pipe or a device, not a file" if path.exists() else "cannot be read (No such file)"
            raise InputError("is a folder, not a file" if path.is_dir() else there)
        with path.open("rb") as file:
            size, left = os.fstat(file.fileno()).st_size, most_bytes + 1
            larger, pieces = size > most_bytes, list[bytes]()
            while not larger and (piece := file.read(min(size + 4096, left))):  # it takes the memory that is asked for
                pieces.append(piece)
                left -= len(piece)
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})") from None
    except ValueError:
        raise InputError("cannot be read (not a usable file name)") from None
    if larger or left == 0:
        raise InputError(f"is larger than {most_bytes / 1e6:g} MB")
    return b"".join(pieces)


def from_json(text: str | bytes) -> Any:
    """The value that a text holds as JSON.

    Raises:
        ValueError: if it is none, however it is damaged.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("is nested too deeply") from None


@contextmanager
def allowing(folders: Folders) -> Iterator[None]:
    """Let files name files in these folders and below, too, while this lasts.

    Args:
        folders: one or several.

    Raises:
        InputError: if one is no folder.
    """
    given = [folders] if isinstance(folders, (str, Path)) else list(folders)
    for folder in given:
        if not str(folder) or not Path(folder).is_dir():
            raise InputError(f"allowed folder {str(folder)!a}: there is no such folder")
    token = _allowed.set((*_allowed.get(), *(Path(folder).resolve() for folder in given)))
    try:
        yield
    finally:
        _allowed.reset(token)


def allowed() -> tuple[Path, ...]:
    """The folders that are allowed besides a file's own."""
    return _allowed.get()


def beside(folder: Path, name: str, said: str) -> Path | None:
    """The file that another file names; None if there is no such file.

    A file may name only files in its own folder or below, and in folders that the user allows, after following all
    links: a file from outside cannot read anything on this machine that did not come with it.

    Raises:
        InputError: if it is not a file name, or leads out of the folder; said begins the message.
    """
    path = folder / name
    try:
        found = path.resolve()
        inside = any(found.is_relative_to(each) for each in (folder.resolve(), *allowed()))
        there = path.is_file()
    except (OSError, ValueError, RuntimeError):  # too long, a zero byte, a circle of links
        raise InputError(f"{said}: is not a usable file name") from None
    if not inside:
        raise InputError(
            f"{said}: must be in the folder of the file that names it, or below: copy it there, or allow its folder "
            "(--allow-folder DIR; allow_folder in Python)"
        )
    return path if there else None
