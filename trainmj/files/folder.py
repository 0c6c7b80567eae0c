"""Folders that a command fills. It knows its own files there by their names, and touches nothing else.

What a command is about to write never stands beside what an earlier one left: the old report, say, goes before the new
numbers come. What a command reads is never written over.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from trainmj.errors import OutputError
from trainmj.files.written import held, part_name, remove, special

_STAGE = "trainmj"
_PART = re.compile(r"\.(.+)\.(\d+)\.\w{8}\.part")  # of written.part_name, and of a stage


@contextmanager
def filling(folder: str | Path, own: str, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """Make and hold a folder to write results into, and remove what a killed process has left unfinished there.

    Args:
        folder: to be filled.
        own: pattern of the names of the files that the command may write there.
        inputs: files that it reads.

    Raises:
        OutputError: if it cannot be made or written to, something else holds it, or a file to be written is one of the
            inputs, or a folder, pipe or device.
    """
    with held(folder) as folder:
        spare(inputs, folder, own)
        for file in own_files(folder, own):
            if what := special(file):
                raise OutputError(f"{file}: cannot be removed or replaced ({what}): put it elsewhere")
        _check_writable(folder)
        _remove_unfinished(folder, own)
        yield folder


def spare(inputs: Iterable[Path], out: Path, own: str | None = None) -> None:
    """Refuse to write over what is read.

    Args:
        inputs: files that are read.
        out: the file that will be replaced; or the folder, if own is given.
        own: pattern of the names of the files that may be replaced there.

    Raises:
        OutputError: naming the first input that would be lost.
    """
    folder, names = (out.parent, re.escape(out.name)) if own is None else (out, own)
    place = folder.resolve()
    for file in sorted(inputs):
        for read in (file.resolve(), file.parent.resolve() / file.name):
            if read.parent == place and re.fullmatch(names, read.name):
                raise OutputError(f"{file}: is read by this command, which would replace it: take another --out")


def own_files(folder: Path, own: str) -> list[Path]:
    """The files of a folder that a command may have written, by the pattern of their names."""
    try:
        return sorted(file for file in folder.iterdir() if re.fullmatch(own, file.name))
    except OSError as error:
        raise OutputError(f"{folder}: cannot be read ({error.strerror})") from None


def remove_own(folder: Path, own: str, kept: Container[str] = ()) -> None:
    """Remove the files that a command may have written, except those of some names.

    Raises:
        OutputError: if one cannot be removed.
    """
    for file in own_files(folder, own):
        if file.name not in kept:
            remove(file)


@contextmanager
def staged(folder: Path, own: str, last: str, kept: Iterable[str] = ()) -> Iterator[Path]:
    """A place to write files to, which replace all own files of the folder when the block ends without an error.

    Args:
        folder: that the command fills.
        own: pattern of the names of its files.
        last: the name of the file that is away before the first and comes after all others: where it is, they belong
            to it.
        kept: names of own files that stay.

    Raises:
        OutputError: if a file cannot be written; those of earlier are there as they were.
    """
    stage = ""
    try:
        with TemporaryDirectory(prefix=f".{_STAGE}.{os.getpid()}.", suffix=".part", dir=folder) as stage:
            yield Path(stage)
            remove(folder / last)
            files = sorted(Path(stage).iterdir(), key=lambda file: file.name == last)
            remove_own(folder, own, {*kept, *(file.name for file in files)})
            for file in files:
                os.replace(file, folder / file.name)
    except OutputError as error:
        raise OutputError(str(error).replace(f"{stage}{os.sep}", f"{folder}{os.sep}")) from None
    except OSError as error:
        at = folder / Path(error.filename).name if stage and error.filename else folder
        raise OutputError(f"{at}: cannot be written ({error.strerror or error})") from None


def _check_writable(folder: Path) -> None:
    """Refuse a folder that takes no file, before anything is computed for it."""
    trial = folder / part_name(_STAGE)
    try:
        os.close(os.open(trial, os.O_CREAT | os.O_EXCL))
        trial.unlink()
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error.strerror})") from None


def _remove_unfinished(folder: Path, own: str) -> None:
    """Remove what a process that is no more has not finished."""
    for file in own_files(folder, _PART.pattern):
        name, process = _PART.fullmatch(file.name).groups()  # type: ignore[union-attr]
        if (name == _STAGE or re.fullmatch(own, name)) and not _runs(int(process)):
            with suppress(OSError):
                shutil.rmtree(file) if file.is_dir() and not file.is_symlink() else file.unlink()


def _runs(process: int) -> bool:
    """Whether there is a process of a number on this machine."""
    if os.name != "posix":
        return True  # there is no way to ask that does no harm
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True
