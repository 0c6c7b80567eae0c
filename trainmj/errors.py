"""The errors trainmj raises: one root, and a class for each thing a caller can do about it."""

from __future__ import annotations

import difflib
import errno
from collections.abc import Iterable

_LONGEST = 100  # characters of a word for which near ones are looked for
_MOST_NAMES = 500  # that it is compared with
_MOST_SAID = 30


class TrainmjError(Exception):
    """Root of every error that trainmj raises on purpose; the command line exits with 2 on it."""


class InputError(TrainmjError, ValueError):
    """The input breaks a rule: the message names place, value, rule and cure."""


class OutputError(TrainmjError, OSError):
    """A result cannot be written or read: missing folder, full disk, damaged file."""


class EngineError(TrainmjError, RuntimeError):
    """MuJoCo, or the way it is set up, cannot run the device law."""


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known name that is most like a word; None if none is much like it."""
    names = sorted(known)[:_MOST_NAMES]
    return next(iter(difflib.get_close_matches(word, names, n=1, cutoff=0.6)), None) if len(word) <= _LONGEST else None


def close_match(word: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: the nearest known one, or all of them.

    Args:
        word: the name that was not found.
        known: the names that would be valid.

    Returns:
        ``"; did you mean 'mass_t'?"`` or ``"; known: a, b, c"``; empty if there is nothing to offer.
    """
    names = sorted(known)
    near = nearest(word, names)
    if near:
        return f"; did you mean {near!r}?"
    more = f" and {len(names) - _MOST_SAID} more" if len(names) > _MOST_SAID else ""
    return f"; known: {', '.join(names[:_MOST_SAID])}{more}" if names else ""


_SAID_OF_MEMORY = ("allocate memory", "out of memory", "bad_alloc", "failed to map segment", "start new thread")


def out_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or what it came of, is a lack of memory; libraries raise many kinds then."""
    while error is not None:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if any(words in str(error).lower() for words in _SAID_OF_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False
