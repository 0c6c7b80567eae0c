"""Scenario files: read with the files that they name, checked and written; their schema; scenarios of other files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

from trainmj.errors import InputError, close_match
from trainmj.files.arguments import changes_given, given
from trainmj.files.kinds import SCENARIO
from trainmj.files.resources import find_file, shipped_files
from trainmj.files.source import Path, Problem, Source, dotted, giving_way, has_key, inside, placed, put, type_at
from trainmj.files.text import Folders, allowing, beside
from trainmj.files.written import write_bytes
from trainmj.files.yaml import as_yaml, parse, read_yaml
from trainmj.scenario.partners import with_partner
from trainmj.scenario.parts import Parts
from trainmj.scenario.reading import tables_of, with_tables
from trainmj.scenario.scenario import Scenario, marked, names_partner, without_old_sources

BUILDS_ON = "builds_on"
JSON_SCHEMA = "https://json-schema.org/draft/2020-12/schema"
"""The dialect of the schemas for editors."""

_LONGEST_CHAIN = 10


def load(
    file: str | FilePath,
    changes: Mapping[str, Any] | None = None,
    *,
    allow_folder: Folders = (),
    **parameters: Any,
) -> Scenario:
    """Read a scenario file, or one that ships with trainmj by its name: ``load("b_type", speed_km_h=20)``.

    Args:
        file: path of a YAML file, or a name from :func:`shipped`.
        changes: values to change, by path or parameter, as in :meth:`Scenario.with_values`.
        allow_folder: in which, or below which, input files may name files besides their own folder; one or several.
        parameters: the same, as keywords.

    Returns:
        The checked scenario.

    Raises:
        InputError: if the file cannot be read or breaks a rule; the message has file, line, key, value and rule.
    """
    with allowing(allow_folder):
        scenario = Scenario.from_source(_read_built(find_file(file, SCENARIO.ending, "scenario"), ()))
        scenario.refuse(_lost(scenario))
        changes = changes_given(changes, parameters)
        return scenario.with_values(changes) if changes else scenario


def shipped() -> dict[str, FilePath]:
    """Names and paths of the scenarios that ship with trainmj."""
    return shipped_files(SCENARIO.ending)


def scenario_given(
    scenario: Scenario | str | FilePath,
    changes: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Scenario:
    """A scenario, or the one that the path of a file or the name of a shipped one leads to, with changes.

    Raises:
        InputError: if the file cannot be read or breaks a rule, or a change does.
        TypeError: if it is something else.
    """
    found, changes = given(scenario, Scenario, load), changes_given(changes, parameters or {})
    return found.with_values(changes) if changes else found


def save(scenario: Scenario | str | FilePath, file: str | FilePath) -> None:
    """Write a scenario as one self-contained YAML file.

    Raises:
        OutputError: if the file cannot be written.
    """
    write_bytes(file, to_yaml(scenario_given(scenario)).encode())


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
    """A schema that requires no key and takes null for each; several of the alternatives may fit then."""
    if isinstance(part, list):
        return [_optional(p) for p in part]
    if not isinstance(part, dict):
        return part
    kept = {k: _optional(v) for k, v in part.items() if not (k == "required" and isinstance(v, list))}
    for key, values in kept.items():
        if key in ("properties", "patternProperties"):
            kept[key] = {name: _or_null(value) for name, value in values.items()}
        elif key == "additionalProperties" and isinstance(values, dict):
            kept[key] = _or_null(values)
    return {"anyOf" if k == "oneOf" else k: v for k, v in kept.items()}


def _or_null(part: dict[str, Any]) -> dict[str, Any]:
    about: dict[str, Any] = {key: part[key] for key in ("title", "description") if key in part}
    return {"anyOf": [part, {"type": "null"}], **about}


def _lost(scenario: Scenario) -> Iterator[Problem]:
    """Parameters and sources that stand for no value."""
    for name in scenario.parameters:
        try:
            scenario.places(name)
        except InputError as error:
            yield Problem(("parameters", name), str(error))
    for name in scenario.sources:
        if name in scenario.parameters:
            rule = f"is a parameter: state the source of the path, {' and of '.join(scenario.paths(name))}"
            yield Problem(("sources", name), rule)
            continue
        try:
            ((path,), (value,)) = scenario.places(name), scenario.locate(name)
        except InputError as error:
            yield Problem(("sources", name), str(error))
            continue
        if value is None and not has_key(type_at(Parts, path[:-1]), path[-1]):
            known = scenario.locate(dotted(path[:-1]))[0] or ()
            yield Problem(("sources", name), f"leads to no value{close_match(str(path[-1]), known)}")


def find_beside(folder: FilePath, name: str, said: str) -> FilePath:
    """The scenario that another file names: beside that file, in folder, or a shipped one.

    Raises:
        InputError: if there is neither, or the name leads out of the folder; said tells where it stands.
    """
    known = shipped()
    found = beside(folder, name, said) or known.get(name.removesuffix(SCENARIO.ending))
    if found is None:
        raise InputError(f"{said}: there is no such file beside it or shipped scenario{close_match(name, known)}")
    return found


def scenario_of(source: Source, name: str, changes: Mapping[str, Any], at: Path = ()) -> Scenario:
    """The scenario that a file names under ``scenario``, with the changes that it states under ``set``.

    Args:
        source: of the file.
        name: of the scenario.
        changes: values by parameter or path.
        at: path of the group that states both.

    Raises:
        InputError: if there is no such scenario, or a change breaks a rule.
    """
    scenario = load(find_beside(source.folder, name, source.said(*at, "scenario")))
    source.refuse(refused((*at, "set"), {key: {key: value} for key, value in changes.items()}, scenario))
    return scenario.with_values(changes) if changes else scenario


def refused(at: Path, changes: Mapping[str, Mapping[str, Any]], scenario: Scenario) -> Iterator[Problem]:
    """What is wrong with changes that are made together: each that is wrong by itself, or else all of them.

    They are given by key below the path, at, that states them. One by itself still has the partner that they name, from
    whose file its value may be.
    """
    every = {path: value for part in changes.values() for path, value in part.items()}
    together = refusal(every, scenario)
    if together:
        partner = {path: value for path, value in every.items() if names_partner(path, scenario.parameters)}
        partner = {} if refusal(partner, scenario) else partner
        alone = {key: refusal({**partner, **part}, scenario) for key, part in changes.items()}
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


def refusal(changes: Mapping[str, Any], scenario: Scenario) -> str:
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
    source = with_tables(read_yaml(path), Parts)
    values = dict(source.values)
    base = values.pop(BUILDS_ON, None)
    if base is None:
        return with_partner(replace(source, values=values))
    if not isinstance(base, str):
        raise source.error("must be the name of a scenario file", BUILDS_ON)
    below = _read_built(find_beside(source.folder, base, source.said(BUILDS_ON)), (*before, path.resolve()))
    return with_partner(_built(below, replace(source, values=values)))


def _built(below: Source, over: Source) -> Source:
    """The values of a file over those of the file that it builds on.

    Groups are merged key by key; everything else, such as lists and curves, is replaced. Null takes a value back. Keys
    that do not go with the alternative that is stated over them give way, as a curve does to stages.
    """
    replaced: list[Path] = []
    new: list[Path] = []
    displaced: list[str] = []

    def merged(under: Mapping[str, Any], values: Mapping[str, Any], path: Path, type_: Any) -> dict[str, Any]:
        old = giving_way(type_, under, values)
        if old:
            displaced.append(f"{over.origin(*path)}: {dotted(path)}: {', '.join(old)} of {below.origin()} given up")
        replaced.extend((*path, key) for key in old)
        result = {key: value for key, value in under.items() if key not in old}
        for key, value in values.items():
            there, at, inner = under.get(key), (*path, key), inside(type_, key)
            of_points = bool(tables_of(inner))  # which go together: all of them are replaced
            if isinstance(there, dict) and isinstance(value, dict) and not (of_points and "stroke_mm" in value):
                result[key] = merged(there, value, at, inner)
            else:
                replaced.append(at)
                new.extend([at] if value != there else [])
                put(result, key, value, type_)
        return result

    values = merged(below.values, over.values, (), Parts)
    values = without_old_sources(values, new, over.values.get("sources") or {})
    built = replace(
        over,
        values=values,
        origins=placed(below.origins, replaced, over.origins),
        told=(*below.told, *over.told, *displaced),
        files=below.files | over.files,
    )
    if "title" in over.values:  # what is below it is its own
        stated = {"changed": over.values["changed"]} if "changed" in over.values else {}
        return replace(built, values={key: v for key, v in values.items() if key != "changed"} | stated)
    before = values.get("changed", [])
    if not (isinstance(before, list) and all(isinstance(name, str) for name in before)):
        return built  # the checks say what is wrong with it
    return marked(built, {*before, *map(dotted, new)})
