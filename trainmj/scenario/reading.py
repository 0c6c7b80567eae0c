"""The tables that a scenario file names: what is there takes the place of the groups that name them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pydantic import BaseModel, ValidationError

from trainmj.errors import InputError
from trainmj.files.source import Path, Source, dotted, groups_of, inside
from trainmj.files.tables import Table, read_beside
from trainmj.scenario.curves import TableFile

_SHOWN = 120  # characters of heads in a message


def with_tables(source: Source, model: type[BaseModel]) -> Source:
    """A file, each part of it that names a table replaced by what is there, which has places of its own.

    How a table was read that could have been meant otherwise, such as in other units, becomes the source of its values.
    """
    origins, names, notes = dict(source.origins), [], dict[str, str]()

    def read(value: Any, path: Path, type_: Any) -> Any:
        if isinstance(value, dict) and "file" in value and (kinds := tables_of(type_)):
            try:
                place = kinds[0].model_validate(value)
            except ValidationError:
                return value  # the checks say what is wrong with it
            table, content, places = _read_table(place, path, source)
            names.append(place.file)
            origins.update(places)
            if table.notes:
                notes[dotted(path)] = table.note
            return content
        if isinstance(value, dict):
            return {key: read(inner, (*path, key), inside(type_, key)) for key, inner in value.items()}
        if isinstance(value, list):
            return [read(inner, (*path, n), inside(type_, n)) for n, inner in enumerate(value)]
        return value

    values = read(source.values, (), model)
    told = [f"{path}: {note}" for path, note in notes.items()]
    return replace(source, values=_noted(values, notes), origins=origins).reading(*names, told=told)


def _noted(values: dict[str, Any], notes: Mapping[str, str]) -> dict[str, Any]:
    """The values of a file, its sources with what there is to know of how values were read."""
    sources = values.get("sources", {})
    if not (notes and isinstance(sources, dict)):
        return values  # nothing to tell, or the checks say what is wrong with them
    new = dict(sources)
    for path, note in notes.items():
        entry = sources.get(path)
        if isinstance(entry, dict):
            new[path] = entry | {"source": f"{entry.get('source')}; {note}"}
        else:
            new[path] = f"{entry}; {note}" if entry else {"mark": "read", "source": note}
    return values | {"sources": new}


def tables_of(type_: Any) -> list[type[TableFile]]:
    """The table in a file that a type allows, if it does."""
    return [group for group in groups_of(type_) if issubclass(group, TableFile)]


def _read_table(place: TableFile, at: Path, source: Source) -> tuple[Table, Any, dict[Path, str]]:
    """A table, what it stands for, and the place of each value; columns that its kind does not read are ignored."""
    said, kind = source.said(*at, "file"), type(place)
    table = read_beside(source.folder, place, said, kind.unit, kind.texts, kind.columns if kind.curve else ())
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
        values, rows = place.values_of(table)
    except InputError as error:
        raise InputError(f"{said}: {error}") from None
    places = {
        (*at, *path): f"{table.file}" if row is None else f"{table.origin(row, str(path[0]))}: {place.row} {row + 1}"
        for path, row in rows.items()
    }
    return table, values, places
