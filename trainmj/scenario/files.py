"""Scenario files: read with the files that they name, checked and written; their schema; scenarios of other files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

from trainmj.errors import InputError, close_match
from trainmj.files.resources import find_file, shipped_files
from trainmj.files.source import Path, Problem, Source
from trainmj.files.tables import find_table, rows_given
from trainmj.files.text import beside, read_text
from trainmj.files.written import write_bytes
from trainmj.files.yaml import MOST_BYTES, as_yaml, parse, read_yaml
from trainmj.scenario.parts import MAX_POINTS, Parts
from trainmj.scenario.scenario import Scenario

BUILDS_ON = "builds_on"
JSON_SCHEMA = "https://json-schema.org/draft/2020-12/schema"
"""The dialect of the schemas for editors."""

_LONGEST_CHAIN = 10
_COLUMNS = ("stroke_mm", "force_kN")  # of a curve in a CSV file
_SHOWN = 120  # characters of heads in a message


def load(file: str | FilePath, changes: Mapping[str, Any] | None = None) -> Scenario:
    """Read a scenario file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name from :func:`shipped`.
        changes: values to change, by path or parameter, as in :meth:`Scenario.with_values`.

    Returns:
        The checked scenario.

    Raises:
        InputError: if the file cannot be read or breaks a rule; the message has file, line, key, value and rule.
    """
    scenario = Scenario.from_source(_read_built(find_file(file, ".yaml", "scenario"), ()))
    return scenario.with_values(changes) if changes else scenario


def shipped() -> dict[str, FilePath]:
    """Names and paths of the scenarios that ship with trainmj."""
    return shipped_files(".yaml")


def save(scenario: Scenario, file: str | FilePath) -> None:
    """Write a scenario as one self-contained YAML file.

    Raises:
        OutputError: if the file cannot be written.
    """
    write_bytes(file, to_yaml(scenario).encode())


def to_yaml(scenario: Scenario) -> str:
    """A scenario as the text of one self-contained YAML file."""
    return as_yaml(scenario.values())


def from_yaml(text: str, name: str = "scenario") -> Scenario:
    """The scenario in a self-contained YAML text; name stands for the file in messages."""
    return Scenario.from_source(parse(text, name))


def schema() -> dict[str, Any]:
    """JSON schema of a scenario file, for editors that complete and check it.

    A file that builds on another one may leave out anything; one that does not must be complete.
    """
    result: dict[str, Any] = _optional(Parts.model_json_schema())
    whole = Parts.model_json_schema(ref_template="#/$defs/Whole{model}")
    parts = {f"Whole{name}": part for name, part in whole.pop("$defs").items()}
    result["$defs"] |= parts | {"Whole": whole}
    result["$schema"] = JSON_SCHEMA
    result["title"] = "trainmj scenario"
    result["properties"][BUILDS_ON] = {"type": "string", "description": "scenario file whose values this file changes"}
    result |= {"if": {"required": [BUILDS_ON]}, "else": {"$ref": "#/$defs/Whole"}}
    return result


def _optional(part: Any) -> Any:
    """A schema that requires no key; several of the alternatives may fit then."""
    if isinstance(part, list):
        return [_optional(p) for p in part]
    if not isinstance(part, dict):
        return part
    kept = {k: _optional(v) for k, v in part.items() if not (k == "required" and isinstance(v, list))}
    return {"anyOf" if k == "oneOf" else k: v for k, v in kept.items()}


def find_beside(folder: FilePath, name: str, said: str) -> FilePath:
    """The scenario that another file names: beside that file, in folder, or a shipped one.

    Raises:
        InputError: if there is neither, or the name leads out of the folder; said tells where it stands.
    """
    known = shipped()
    found = beside(folder, name, said) or known.get(name.removesuffix(".yaml"))
    if found is None:
        raise InputError(f"{said}: there is no such file beside it or shipped scenario{close_match(name, known)}")
    return found


def scenario_of(source: Source, name: str, changes: Mapping[str, Any]) -> Scenario:
    """The scenario that a file names under ``scenario``, with the changes that it states under ``set``.

    Raises:
        InputError: if there is no such scenario, or a change breaks a rule.
    """
    scenario = load(find_beside(source.folder, name, source.said("scenario")))
    source.refuse(refused(("set",), {key: {key: value} for key, value in changes.items()}, scenario))
    return scenario.with_values(changes) if changes else scenario


def refused(at: Path, changes: Mapping[str, Mapping[str, Any]], scenario: Scenario) -> Iterator[Problem]:
    """What is wrong with changes that are made together: each that is wrong by itself, or else all of them.

    They are given by key below the path, at, that states them.
    """
    together = _refusal({path: value for part in changes.values() for path, value in part.items()}, scenario)
    if together:
        alone = {key: _refusal(part, scenario) for key, part in changes.items()}
        for key, part in changes.items():
            if key in part:  # the place that the rule is said of names the path already
                alone[key] = alone[key].removeprefix(f"change: {Source(part).said(key)}: ").removeprefix(f"{key}: ")
        yield from [Problem((*at, key), rule) for key, rule in alone.items() if rule] or [Problem(at, together)]


def nowhere(places: Iterable[tuple[Path, str]], scenario: Scenario) -> Iterator[Problem]:
    """Names that are not values of a scenario, each with the path that states it."""
    for at, name in places:
        try:
            scenario.locate(name)
        except InputError as error:
            yield Problem(at, str(error).removeprefix(f"{name}: "))


def _refusal(changes: Mapping[str, Any], scenario: Scenario) -> str:
    """What is wrong with changes; empty if nothing is."""
    try:
        scenario.with_values(changes)
    except InputError as error:
        return str(error)
    return ""


def _read_built(path: FilePath, before: tuple[FilePath, ...]) -> Source:
    """The values of a file, merged over those of the file that it builds on."""
    if path.resolve() in before:
        raise InputError(f"{path}: {BUILDS_ON} leads back to this file: break the circle")
    if len(before) >= _LONGEST_CHAIN:
        raise InputError(f"{path}: more than {_LONGEST_CHAIN} files build on each other")
    source = read_yaml(path)
    curves: list[str] = []  # the files that have them
    values = {key: _with_points(value, (key,), source, curves) for key, value in source.values.items()}
    source = source.reading(*curves)
    base = values.pop(BUILDS_ON, None)
    if base is None:
        return replace(source, values=values)
    if not isinstance(base, str):
        raise source.error("must be the name of a scenario file", BUILDS_ON)
    below = _read_built(find_beside(source.folder, base, source.said(BUILDS_ON)), (*before, path.resolve()))
    origins = {**below.origins, **source.origins}
    return replace(source, values=_merged(below.values, values), origins=origins, files=source.files | below.files)


def _with_points(value: Any, path: Path, source: Source, curves: list[str]) -> Any:
    """A value of a file, each curve in it that names a CSV file replaced by the points there; the name is noted."""
    if isinstance(value, dict) and set(value) == {"file"} and isinstance(value["file"], str):
        curves.append(value["file"])
        return _read_curve(value["file"], source.folder, source.said(*path, "file"))
    if isinstance(value, dict):
        return {key: _with_points(inner, (*path, key), source, curves) for key, inner in value.items()}
    if isinstance(value, list):
        return [_with_points(inner, (*path, n), source, curves) for n, inner in enumerate(value)]
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


def _merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Groups are merged key by key; everything else, such as lists and curves, is replaced."""
    result = dict(under)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, dict) and isinstance(value, dict) and "stroke_mm" not in value:
            value = _merged(below, value)
        result[key] = value
    return result
