"""Scenario files: YAML that may build on another file, with curves from CSV files beside it."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

from trainmj.errors import InputError, OutputError, close_match
from trainmj.resources import shipped_folder
from trainmj.scenario.parts import MAX_POINTS, Parts
from trainmj.scenario.problems import Path, dotted
from trainmj.scenario.scenario import Scenario

BUILDS_ON = "builds_on"
_MOST_BYTES = 5_000_000
_MOST_NODES = 200_000
_DEEPEST = 30
_LONGEST_CHAIN = 10


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
    values, origins = _read_built(find_file(file, str(file), shipped(), "scenario"), ())
    scenario = Scenario.from_values(values, origins)
    return scenario.with_values(changes) if changes else scenario


def shipped() -> dict[str, FilePath]:
    """Names and paths of the scenarios that ship with trainmj."""
    files = sorted(shipped_folder("scenarios").glob("*.yaml"))
    return {path.stem: path for path in files if "." not in path.stem}  # x.sweep.yaml is not a scenario


def save(scenario: Scenario, file: str | FilePath) -> None:
    """Write a scenario as one self-contained YAML file.

    Raises:
        OutputError: if the file cannot be written.
    """
    try:
        FilePath(file).write_text(to_yaml(scenario), encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error.strerror})") from None


def to_yaml(scenario: Scenario) -> str:
    """A scenario as the text of one self-contained YAML file."""
    from ruamel.yaml import YAML

    text = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 120
    yaml.representer.ignore_aliases = lambda *_: True  # every value in full where it stands
    yaml.dump(scenario.values(), text)
    return text.getvalue()


def from_yaml(text: str, name: str = "scenario") -> Scenario:
    """The scenario that a self-contained YAML text states; name stands for the file in messages."""
    values, origins = _parse(text, name)
    return Scenario.from_values(values, origins)


def read_yaml(path: FilePath) -> tuple[dict[str, Any], dict[Path, str]]:
    """Plain values of a YAML file, and file, line and column of each by path.

    Raises:
        InputError: if the file cannot be read or is not a YAML group of keys and values.
    """
    return _parse(_text(path), str(path))


def read_value(text: str, said: str) -> Any:
    """A value as YAML reads it: a number, text, or a list or group in brackets.

    Raises:
        InputError: if it is not valid YAML; said says where it stands.
    """
    values, _ = _parse(f"value: {text}", said)
    if set(values) != {"value"}:
        raise InputError(f"{said}: must be a single value")
    return values["value"]


def schema() -> dict[str, Any]:
    """JSON schema of a scenario file, for editors that complete and check while one types.

    A file that builds on another may leave out what that one states, at any depth; one that does not must be whole.
    """
    result: dict[str, Any] = _optional(Parts.model_json_schema())
    whole = Parts.model_json_schema(ref_template="#/$defs/Whole{model}")
    parts = {f"Whole{name}": part for name, part in whole.pop("$defs").items()}
    result["$defs"] |= parts | {"Whole": whole}
    result["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    result["title"] = "trainmj scenario"
    result["properties"][BUILDS_ON] = {"type": "string", "description": "scenario file whose values this one changes"}
    result |= {"if": {"required": [BUILDS_ON]}, "else": {"$ref": "#/$defs/Whole"}}
    return result


def _optional(part: Any) -> Any:
    """A schema that requires no key."""
    if isinstance(part, list):
        return [_optional(p) for p in part]
    if not isinstance(part, dict):
        return part
    return {k: _optional(v) for k, v in part.items() if not (k == "required" and isinstance(v, list))}


def find_file(file: str | FilePath, name: str, known: Mapping[str, FilePath], what: str) -> FilePath:
    """The file of a path, or the shipped one of a name.

    Args:
        file: what the user wrote.
        name: what it would be called if it were a shipped one.
        known: the shipped ones by name.
        what: scenario or study, for messages.

    Raises:
        InputError: if there is neither.
    """
    path = FilePath(file)
    try:
        if path.is_file():
            return path
    except (OSError, ValueError):
        raise InputError(f"{ascii(str(file))[:200]}: is not a usable file name") from None
    if name in known:
        return known[name]
    kind = f"is a folder, not a {what} file" if path.is_dir() else f"there is no such file or shipped {what}"
    raise InputError(f"{file}: {kind}{close_match(FilePath(name).stem, known)}")


def _read_built(path: FilePath, before: tuple[FilePath, ...]) -> tuple[dict[str, Any], dict[Path, str]]:
    """Values and origins of a file merged over those of the file it builds on."""
    if path.resolve() in before:
        raise InputError(f"{path}: {BUILDS_ON} leads back to this file: break the circle")
    if len(before) >= _LONGEST_CHAIN:
        raise InputError(f"{path}: more than {_LONGEST_CHAIN} files build on each other")
    values, origins = read_yaml(path)
    _read_curves(values, origins, path.parent)
    base = values.pop(BUILDS_ON, None)
    if base is None:
        return values, origins
    where = origins[(BUILDS_ON,)]
    if not isinstance(base, str):
        raise InputError(f"{where}: {BUILDS_ON}: must be the name of a scenario file")
    beside, known = path.parent / base, shipped()
    ships = known.get(base.removesuffix(".yaml"))
    if not beside.is_file() and ships is None:
        raise InputError(f"{where}: {BUILDS_ON} = {base!r}: there is no such file beside it{close_match(base, known)}")
    under, under_origins = _read_built(
        beside if ships is None or beside.is_file() else ships, (*before, path.resolve())
    )
    return _merged(under, values), under_origins | origins


def _merged(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """Mappings merge key by key; everything else, lists and curves too, is replaced."""
    result = dict(under)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, dict) and isinstance(value, dict) and "stroke_mm" not in value:
            value = _merged(below, value)
        result[key] = value
    return result


def _text(path: FilePath) -> str:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path}: is larger than {_MOST_BYTES // 10**6} MB")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}): save it as UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def _parse(text: str, name: str) -> tuple[dict[str, Any], dict[Path, str]]:
    """Plain values of a YAML text, and the line and column of each."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    if _brackets(text) > _DEEPEST:
        raise InputError(f"{name}: is nested too deeply")
    try:
        tree = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        place = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise InputError(f"{name}{place}: is not valid YAML: {error.problem}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        raise InputError(
            f"{name}: is not valid YAML: {str(error).splitlines()[0] if str(error) else 'too deep'}"
        ) from None
    if not isinstance(tree, dict):
        raise InputError(f"{name}: must be a group of keys and values such as 'devices:'")
    origins: dict[Path, str] = {(): name}
    values: dict[str, Any] = _plain(tree, (), name, origins)
    return values, origins


def _brackets(text: str) -> int:
    """How deep brackets are nested; the YAML parser would take seconds to fail on thousands of them."""
    depth = most = 0
    for mark in re.findall(r"[\[\]{}]", text):
        depth += 1 if mark in "[{" else -1
        most = max(most, depth)
    return most


def _plain(node: Any, path: Path, name: str, origins: dict[Path, str]) -> Any:
    """A YAML node as dict, list, str, int, float, bool or None, noting where each child stands."""
    if len(path) > _DEEPEST or len(origins) > _MOST_NODES:
        raise InputError(f"{name}: is nested too deeply or has too many values")
    if isinstance(node, dict):
        result = {}
        for key, value in node.items():
            if not isinstance(key, str):
                raise InputError(f"{origins[path]}: key {ascii(key)[:60]} must be text")
            origins[(*path, key)] = _place(node, key, name, origins[path])
            result[str(key)] = _plain(value, (*path, key), name, origins)
        return result
    if isinstance(node, list):
        items = []
        for i, value in enumerate(node):
            origins[(*path, i)] = _place(node, i, name, origins[path])
            items.append(_plain(value, (*path, i), name, origins))
        return items
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    if node is None:
        return None
    raise InputError(
        f"{origins[path]}: {dotted(path)}: must be a number, text, list or group, not a {type(node).__name__}"
    )


def _place(node: Any, key: str | int, name: str, around: str) -> str:
    """File, line and column of a child of a YAML node; of the node itself for what came in by an anchor."""
    mark = (node.lc.data or {}).get(key)
    return f"{name}:{mark[0] + 1}:{mark[1] + 1}" if mark else around


def _read_curves(values: Any, origins: dict[Path, str], folder: FilePath, path: Path = ()) -> None:
    """Replace each curve that names a CSV file by the points in it."""
    items = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, value in items:
        at = (*path, key)
        if isinstance(value, dict) and set(value) == {"file"} and isinstance(value["file"], str):
            values[key] = _read_curve(value["file"], folder, origins[at])
        else:
            _read_curves(value, origins, folder, at)


def _read_curve(name: str, folder: FilePath, where: str) -> dict[str, list[float]]:
    """Points of a CSV file with columns stroke_mm and force_kN; commas, semicolons or tabs between them."""
    path = folder / name
    said = f"{where}: file = {name!a}"
    if "\0" in name or not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{said}: must be in the folder of the scenario")
    if not path.is_file():
        raise InputError(f"{said}: there is no such file{close_match(name, [p.name for p in folder.glob('*.csv')])}")
    text = _text(path)
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise InputError(f"{path}: is empty; the first line must be stroke_mm,force_kN")
    separator = next((s for s in ";\t" if s in lines[0]), ",")
    heads = [h.strip().strip('"') for h in lines[0].split(separator)]
    missing = [h for h in ("stroke_mm", "force_kN") if h not in heads]
    if missing:
        raise InputError(f"{path}:1: has no column {missing[0]!r}; the first line must name stroke_mm and force_kN")
    if len(lines) - 1 > MAX_POINTS:
        raise InputError(f"{path}: has more than {MAX_POINTS} points")
    stroke, force = heads.index("stroke_mm"), heads.index("force_kN")
    points: dict[str, list[float]] = {"stroke_mm": [], "force_kN": []}
    for n, row in enumerate(csv.reader(lines[1:], delimiter=separator), start=2):
        for key, column in (("stroke_mm", stroke), ("force_kN", force)):
            cell = row[column].strip() if column < len(row) else ""
            points[key].append(_number(cell, separator, f"{path}: point {n - 1}: {key}"))
    return points


def _number(cell: str, separator: str, said: str) -> float:
    try:
        value = float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        raise InputError(f"{said} = {ascii(cell)[:60]}: must be a number") from None
    if not math.isfinite(value):
        raise InputError(f"{said} = {cell}: must be a finite number")
    return value
