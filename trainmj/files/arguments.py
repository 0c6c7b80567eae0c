"""Arguments of public functions: what stands for another thing is taken, and what cannot be meant is said."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from trainmj.errors import InputError, close_match

T = TypeVar("T")

_MADE_BY = {
    "Scenario": "trainmj.load reads one, trainmj.Scenario.from_values makes one of plain values",
    "Result": "trainmj.run computes one, trainmj.load_result reads one",
    "Sweep": "trainmj.grid_of and trainmj.sweep_of make one",
    "Study": "trainmj.study_of makes one of plain values",
    "Identification": "trainmj.targets_of makes one of plain values",
    "Standard": "trainmj.load_assessment reads one",
    "Reliability": "trainmj.reliability_of makes one of plain values",
}
"""How to get what a function needs, by the name of its type."""


def given(thing: Any, kind: type[T], read: Callable[[Any], T] | None = None) -> T:
    """An argument that must be of a type; the path of a file, or the name of a shipped one, is read if it can be.

    Raises:
        TypeError: if it is something else; says what is needed, and what makes it.
    """
    if isinstance(thing, kind):
        return thing
    if read is not None and isinstance(thing, (str, PathLike)):
        return read(thing)
    name = kind.__name__
    needed = f"{'an' if name[0] in 'AEIOU' else 'a'} {name}{', or the path of its file' if read else ''}"
    raise TypeError(f"needs {needed}, not {type(thing).__name__}: {_MADE_BY[name]}")


def group_given(thing: Any) -> Mapping[str, Any]:
    """An argument that must be plain values by key.

    Raises:
        TypeError: if it is something else.
    """
    if isinstance(thing, Mapping):
        return thing
    readers = "trainmj.load, load_sweep, load_study, load_reliability and load_targets read files"
    raise TypeError(f"needs a dict of values by key or path, not {type(thing).__name__}: {readers}")


def changes_given(changes: Any, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Changes by path or parameter, and further ones that were given as keywords.

    Raises:
        InputError: if one is given both ways.
        TypeError: if changes are no dict.
    """
    found = dict(group_given({} if changes is None else changes))
    if twice := sorted(found.keys() & parameters.keys()):
        raise InputError(f"{twice[0]}: is given twice, in a dict and as a keyword: leave one of them out")
    return {**found, **parameters}


def path_given(thing: Any) -> Path:
    """An argument that must be the path of results; what left its files in a folder stands for that.

    Raises:
        TypeError: if it is something else.
    """
    found = getattr(thing, "folder", thing)
    if isinstance(found, (str, PathLike)):
        return Path(found)
    needed = "the path of a folder or of a file in it, or what run_sweep, run_study, run_reliability or identify gave"
    cure = {"Result": ": its save writes it to a file", "Summary": ": the Result that it was made of has more"}
    raise TypeError(f"needs {needed}, not {type(thing).__name__}{cure.get(type(thing).__name__, '')}")


def file_given(thing: Any) -> Path:
    """An argument that must be the path of an input file, or the name of a shipped one.

    Raises:
        TypeError: if it is something else.
    """
    if isinstance(thing, (str, PathLike)):
        return Path(thing)
    makers = "Scenario.from_values, sweep_of, study_of, reliability_of and targets_of take plain values"
    raise TypeError(f"needs the path of a file, or the name of a shipped one, not {type(thing).__name__}: {makers}")


def chosen_of(known: Mapping[str, T], name: str, what: str) -> T:
    """What a name stands for.

    Raises:
        InputError: if there is none of that name; what says of which kind, such as "table".
    """
    if name in known:
        return known[name]
    raise InputError(f"{name}: there is no such {what} here{close_match(str(name), known)}")


def listed(names: Any) -> tuple[str, ...]:
    """An argument that is a list of names; a single one stands for a list of it."""
    return (names,) if isinstance(names, str) else tuple(names)
