"""A folder for results, held by one process at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from trainmj.errors import OutputError

try:
    import fcntl
except ImportError:  # pragma: no cover - not on Windows
    fcntl = None  # type: ignore[assignment]


@contextmanager
def held(folder: str | Path) -> Iterator[Path]:
    """Make a folder and hold it, so that nothing else writes results there meanwhile.

    The lock is on the folder itself: it leaves no file, and the system lifts it however the process ends. Where a file
    system has no locks nobody is refused.

    Args:
        folder: made if it is not there.

    Yields:
        The folder.

    Raises:
        OutputError: if it cannot be made, or something else holds it.
    """
    folder = Path(folder)
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
