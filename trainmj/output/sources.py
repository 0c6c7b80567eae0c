"""The table of where values come from, of whatever file states them."""

from __future__ import annotations

from collections.abc import Mapping

from trainmj.files.provenance import MEANING, Provenance
from trainmj.output.table import Table, worded


def sources_table(sources: Mapping[str, str | Provenance], title: str = "Where values come from") -> Table:
    """The sources of a file, by the paths of their values, and what the marks mean."""
    rows = [
        (path, entry.source, entry.mark) if isinstance(entry, Provenance) else (path, entry, "-")
        for path, entry in sources.items()
    ]
    marks = {mark for *_, mark in rows}
    note = " ".join(f"{mark.capitalize()}: {meaning}." for mark, meaning in MEANING.items() if mark in marks)
    return Table(worded("Value", "source", "mark"), rows, title, note)
