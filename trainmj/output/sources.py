"""The table of where values come from, of whatever file states them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trainmj.files.provenance import MEANING, Provenance, value_at
from trainmj.output.table import Table, worded


def sources_table(
    sources: Mapping[str, str | Provenance], values: Mapping[str, Any], title: str = "Where values come from"
) -> Table:
    """The sources of a file, by the paths of its values, the values that are no groups, and what the marks mean.

    Args:
        sources: by path.
        values: plain values of the file.
        title: above the table.
    """
    rows = []
    for path, entry in sources.items():
        source, mark = (entry.source, entry.mark) if isinstance(entry, Provenance) else (entry, "-")
        rows.append((path, _shown(values, path), source, mark))
    marks = {mark for *_, mark in rows}
    note = " ".join(f"{mark.capitalize()}: {meaning}." for mark, meaning in MEANING.items() if mark in marks)
    return Table(worded("Value", "is", "source", "mark"), rows, title, note)


def _shown(values: Any, path: str) -> str:
    """A value at a path, or the points of a curve; a dash for a group."""
    here = value_at(values, path)
    if isinstance(here, dict) and {"stroke_mm", "force_kN"} <= here.keys():
        points = zip(here["stroke_mm"], here["force_kN"], strict=False)
        return " ".join(f"({stroke:g} mm, {force:g} kN)" for stroke, force in points)
    if isinstance(here, bool):
        return str(here).lower()
    return f"{here:.6g}" if isinstance(here, int | float) else "-"
