"""The CSV files that a scenario file names: what is there takes the place of the groups that name them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from trainmj.errors import InputError
from trainmj.files.source import Path, Source, groups_of, inside
from trainmj.files.tables import read_beside
from trainmj.scenario.curves import TableFile

_SHOWN = 120  # characters of heads in a message


def with_tables(source: Source, model: type[BaseModel]) -> Source:
    """A file, each part of it that names a CSV file replaced by what is there, which has places of its own."""
    origins, names = dict(source.origins), []

    def read(value: Any, path: Path, type_: Any) -> Any:
        if isinstance(value, dict) and set(value) == {"file"} and isinstance(value["file"], str):
            kinds = tables_of(type_)
            if not kinds:
                return value  # the checks say what is wrong with it
            content, places = _read_table(kinds[0], value["file"], path, source)
            names.append(value["file"])
            origins.update(places)
            return content
        if isinstance(value, dict):
            return {key: read(inner, (*path, key), inside(type_, key)) for key, inner in value.items()}
        if isinstance(value, list):
            return [read(inner, (*path, n), inside(type_, n)) for n, inner in enumerate(value)]
        return value

    return replace(source, values=read(source.values, (), model), origins=origins).reading(*names)


def tables_of(type_: Any) -> list[type[TableFile]]:
    """The table in a CSV file that a type allows, if it does."""
    return [group for group in groups_of(type_) if issubclass(group, TableFile)]


def _read_table(kind: type[TableFile], name: str, at: Path, source: Source) -> tuple[Any, dict[Path, str]]:
    """What a CSV file stands for, and the place of each value; columns that its kind does not read are ignored."""
    said = source.said(*at, "file")
    table = read_beside(source.folder, name, said, kind.texts)
    missing = [column for column in kind.columns if column not in table.columns]
    if missing:
        there = ascii(", ".join(table.columns))[:_SHOWN]
        raise InputError(
            f"{said}: has no column {missing[0]!r}; the first line must name {' and '.join(kind.columns)}, "
            f"and is {there}"
        )
    if len(table.lines) > kind.most:
        raise InputError(f"{said}: has more than {kind.most} {kind.row}s")
    try:
        values, rows = kind.values_of(table)
    except InputError as error:
        raise InputError(f"{said}: {error}") from None
    of_rows = {path: f":{table.lines[row]}: {kind.row} {row + 1}" for path, row in rows.items() if row is not None}
    return values, {(*at, *path): f"{table.file}{of_rows.get(path, '')}" for path in rows}
