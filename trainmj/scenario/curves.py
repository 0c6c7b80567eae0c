"""Curves that a scenario takes from CSV files beside it."""

from __future__ import annotations

import math
from pathlib import Path as FilePath
from typing import Any

from trainmj.errors import InputError
from trainmj.files.source import Path, Source
from trainmj.files.tables import find_table, rows_given
from trainmj.files.text import read_text
from trainmj.files.yaml import MOST_BYTES
from trainmj.scenario.parts import MAX_POINTS

_COLUMNS = ("stroke_mm", "force_kN")
_SHOWN = 120  # characters of heads in a message


def read_curves(source: Source) -> dict[str, Any]:
    """The values of a file, each curve that names a CSV file replaced by the points in it.

    Raises:
        InputError: naming file and point, or where the scenario names the file.
    """
    return {key: _with_points(value, (key,), source) for key, value in source.values.items()}


def _with_points(value: Any, path: Path, source: Source) -> Any:
    if isinstance(value, dict) and set(value) == {"file"} and isinstance(value["file"], str):
        return _read_curve(value["file"], source.folder, source.said(*path, "file"))
    if isinstance(value, dict):
        return {key: _with_points(inner, (*path, key), source) for key, inner in value.items()}
    if isinstance(value, list):
        return [_with_points(inner, (*path, n), source) for n, inner in enumerate(value)]
    return value


def _read_curve(name: str, folder: FilePath, said: str) -> dict[str, list[float]]:
    """Points of a CSV file with columns stroke_mm and force_kN; others are ignored."""
    path = find_table(folder, name, said)
    try:
        heads, *rows = rows_given(read_text(path, MOST_BYTES)) or [[]]
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if not heads:
        raise InputError(f"{path}: is empty; the first line must be {','.join(_COLUMNS)}")
    missing = [column for column in _COLUMNS if column not in heads]
    if missing:
        there = ascii(", ".join(heads))[:_SHOWN]
        raise InputError(
            f"{path}: has no column {missing[0]!r}; the first line must name {' and '.join(_COLUMNS)}, and is {there}"
        )
    if len(rows) > MAX_POINTS:
        raise InputError(f"{path}: has more than {MAX_POINTS} points")
    places = {column: heads.index(column) for column in _COLUMNS}
    return {
        column: [
            _number(row[k] if k < len(row) else "", f"{path}: point {n}: {column}") for n, row in enumerate(rows, 1)
        ]
        for column, k in places.items()
    }


def _number(cell: str, said: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise InputError(f"{said} = {ascii(cell)[:60]}: must be a number") from None
    if not math.isfinite(value):
        raise InputError(f"{said} = {cell}: must be a finite number")
    return value
