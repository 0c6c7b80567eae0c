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
        value, points = _shown(value_at(values, path))
        rows.append((path, value, f"{points}: {source}" if points else source, mark))
    marks = {mark for *_, mark in rows}
    note = " ".join(f"{mark.capitalize()}: {meaning}." for mark, meaning in MEANING.items() if mark in marks)
    return Table(worded("Value", "is", "source", "mark"), rows, title, note)


def _shown(value: Any) -> tuple[str, str]:
    """A value, a dash for a group; and the points of a curve."""
    if isinstance(value, dict) and {"stroke_mm", "force_kN"} <= value.keys():
        points = zip(value["stroke_mm"], value["force_kN"], strict=False)
        return "-", " ".join(f"({stroke:g} mm, {force:g} kN)" for stroke, force in points)
    if isinstance(value, bool):
        return str(value).lower(), ""
    return f"{value:.6g}" if isinstance(value, int | float) else "-", ""
