"""Folders that one command fills. It knows its own files there by their names, and touches nothing else.

What a command is about to write never stands beside what an earlier one left: the old report, say, goes before the new
numbers come. What a command reads is never written over.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from trainmj.errors import OutputError
from trainmj.files.arguments import path_given
from trainmj.files.written import UNFINISHED, part_name, remove, special

_MOMENT = 0.1  # for those who only look whether a folder is held [s]

try:
    import fcntl
except ImportError:  # pragma: no cover - not on Windows
    fcntl = None  # type: ignore[assignment]

_STAGE = "trainmj"


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
    for file in own_files(folder, UNFINISHED.pattern):
        name, process = UNFINISHED.fullmatch(file.name).groups()  # type: ignore[union-attr]
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
