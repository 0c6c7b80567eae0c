"""Where the values of a file come from, and how far that was seen: what stands under ``sources``."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from trainmj.files.parts import Either, Part, Spelt
from trainmj.files.source import Path, Problem

CHANGED = "changed"
MEANING = {
    "read": "read in the source named",
    "second-hand": "read in a source that quotes it",
    "recalled": "read in no source that could be named: check it against the document that you hold",
    "computed": "follows from other values",
    "assumed": "an assumption of whoever wrote the file",
    CHANGED: "changed since, in whole or in part: the source is that of the value before",
}
"""The marks, each with what it says of a value."""

Mark = Literal["read", "second-hand", "recalled", "computed", "assumed", "changed"]


class Provenance(Part):
    """Where a value comes from."""

    mark: Mark = Field(description="; ".join(f"{mark}: {meaning}" for mark, meaning in MEANING.items()))
    source: Annotated[str, Field(min_length=1, max_length=1000)] = Field(
        description="document, clause, table or address; of an assumption, what it rests on"
    )


Place = Annotated[
    str,
    Field(pattern=r"^[A-Za-z_][\w .+/-]*$", max_length=200),
    Spelt("must be the path of a value, or of a group of values, of this file"),
]
Sources = Annotated[
    dict[
        Place,
        Annotated[
            Annotated[str, Field(min_length=1, max_length=1000)] | Provenance,
            Either(said="the source as text, or a group with mark and source"),
        ],
    ],
    Field(max_length=1000),
]
"""Where values come from, by their paths; a path to a group stands for all that is in it."""


def said(entry: str | Provenance) -> str:
    """A source in words, its mark last: "EN 15227, clause 5.4 (recalled)"; only the text if it has none."""
    if isinstance(entry, str):
        return entry
    return f"changed; before: {entry.source}" if entry.mark == CHANGED else f"{entry.source} ({entry.mark})"


def value_at(values: Any, path: str) -> Any:
    """The plain value that a path leads to, entries of lists by position or name; None if it leads to nothing.

    A key may be a path itself, as those under ``set`` of an assessment file are.
    """
    here = values
    keys = path.split(".")
    for n, key in enumerate(keys):
        if isinstance(here, dict) and (rest := ".".join(keys[n:])) in here:
            return here[rest]
        if isinstance(here, list):
            named = [entry for entry in here if isinstance(entry, dict) and entry.get("name") == key]
            by_position = here[int(key)] if key.isdecimal() and len(key) < 10 and int(key) < len(here) else None
            here = named[0] if named else by_position
        else:
            here = here.get(key) if isinstance(here, dict) else None
    return here


def lost(values: Mapping[str, Any]) -> Iterator[Problem]:
    """The sources of a file that lead to none of its plain values."""
    for path in values.get("sources") or {}:
        if value_at(values, path) is None:
            yield Problem(("sources", path), "leads to no value of this file")


def entry_of(sources: Mapping[str, str | Provenance], path: str) -> str | Provenance | None:
    """The entry for a value, or for the innermost group around it that has one; None if there is none."""
    keys = path.split(".")
    names = (".".join(keys[:n]) for n in range(len(keys), 0, -1))
    return next((sources[name] for name in names if name in sources), None)


def source_of(sources: Mapping[str, str | Provenance], path: str) -> str:
    """Where a value comes from, in words; empty if nothing says."""
    entry = entry_of(sources, path)
    return "" if entry is None else said(entry)


def outdated(
    sources: Mapping[str, Any], new: Iterable[Path], find: Callable[[str], tuple[Path, bool] | None]
) -> dict[str, Any]:
    """Plain sources, those of values that were changed since marked as such.

    Args:
        sources: as they stand in a file, by path.
        new: paths of the values that were changed.
        find: the path that a name leads to, and whether a value is there; None if it leads nowhere any more.

    Returns:
        The entries; those of values that were taken back are gone.
    """
    kept: dict[str, Any] = {}
    changed = list(new)
    for name, entry in sources.items():
        found = find(name)
        if found is None:
            continue
        path, there = found
        touched = any(path[: len(at)] == at[: len(path)] for at in changed)
        if touched and not there:
            continue
        mark = entry.get("mark") if isinstance(entry, dict) else None
        if touched and mark != CHANGED:
            source = entry if isinstance(entry, str) else entry.get("source") if isinstance(entry, dict) else None
            entry = {"mark": CHANGED, "source": source if mark is None else f"{source} ({mark})"}
        kept[name] = entry
    return kept
