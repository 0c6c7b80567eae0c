"""YAML as plain values: numbers, text, lists and groups, and the place of each. Nothing in a file can make an object.

The YAML package only composes the text to nodes, which are read here: of its constructors, only those of numbers run.
Length, depth and number of values are bounded, including what anchors expand to.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from itertools import accumulate
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from trainmj.errors import InputError
from trainmj.files.source import Path, Source, dotted
from trainmj.files.text import HIDDEN, printable, read_text

if TYPE_CHECKING:
    from ruamel.yaml.nodes import Node

MOST_BYTES = 5_000_000
_MOST_MARKS = 100_000  # characters that can separate values: each costs the YAML package about 0.1 ms
_MOST_VALUES = 100_000
_DEEPEST = 30
_DEEPER = {"[": 1, "{": 1, "]": -1, "}": -1}
_TAG = "tag:yaml.org,2002:"


def read_yaml(path: FilePath) -> Source:
    """Plain values of a YAML file, and file, line and column of each.

    Raises:
        InputError: if the file cannot be read or is not a YAML group of keys and values.
    """
    try:
        text = read_text(path, MOST_BYTES)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return replace(parse(text, str(path)), folder=path.parent, files=frozenset({path}))


def read_value(text: str, said: str) -> Any:
    """A value as YAML reads it: a number, text, or a list or group in brackets.

    Raises:
        InputError: if it is not valid YAML; said stands for the place.
    """
    said = said[:200]
    values = parse(f"value: {text}", said).values
    if set(values) != {"value"}:
        raise InputError(f"{said}: must be a single value")
    return values["value"]


def as_yaml(values: Mapping[str, Any]) -> str:
    """Plain values as the text of a YAML file."""
    from ruamel.yaml import YAML

    text = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 120
    yaml.representer.ignore_aliases = lambda *_: True  # every value in full, without anchors
    yaml.dump(dict(values), text)
    return text.getvalue()


def parse(text: str, name: str) -> Source:
    """Plain values of one YAML document, a group of keys and values, and the place of each in the file of a name.

    Raises:
        InputError: with file, line and column.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, ReusedAnchorWarning, YAMLError

    _measure(text, name)
    yaml = YAML(typ="safe", pure=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ReusedAnchorWarning)  # YAML allows it: the last one before counts
            root = yaml.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        place = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise InputError(f"{name}{place}: is not valid YAML: {printable(str(error.problem))[:200]}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        reason = "too deep" if isinstance(error, RecursionError) else (str(error).splitlines() or [""])[0]
        raise InputError(f"{name}: is not valid YAML: {printable(reason)[:200]}") from None
    if root is None or root.tag != f"{_TAG}map":
        raise InputError(f"{name}: must be a group of keys and values such as 'devices:'")
    reader = _Reader(name, yaml.constructor)
    return Source(reader.group(root, ()), reader.origins)


def _measure(text: str, name: str) -> None:
    """Refuse text that the YAML package would take long to read, or to refuse."""
    marks = re.findall(r"[\[\]{},:?\n]", text)
    most = max(accumulate((_DEEPER.get(mark, 0) for mark in marks), initial=0))
    if most > _DEEPEST:
        raise InputError(f"{name}: is nested too deeply")
    if len(marks) > _MOST_MARKS:
        raise InputError(f"{name}: has too many values: put long curves into CSV files")


class _Reader:
    """Reads the nodes of a file."""

    def __init__(self, name: str, constructor: Any) -> None:
        self.origins: dict[Path, str] = {(): name}  # file, line and column of each value
        self._name = name
        self._scalars = {
            f"{_TAG}null": lambda node: None,
            f"{_TAG}bool": lambda node: node.value.lower() == "true",
            f"{_TAG}int": constructor.construct_yaml_int,
            f"{_TAG}float": constructor.construct_yaml_float,
            f"{_TAG}str": lambda node: str(node.value),
            f"{_TAG}value": lambda node: str(node.value),
        }

    def group(self, node: Node, path: Path) -> dict[str, Any]:
        """A mapping as a dict."""
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            at = self._place(key_node)
            key = key_node.value
            if key_node.tag not in (f"{_TAG}str", f"{_TAG}merge"):
                shown = printable(key)[:60] if isinstance(key, str) else "in brackets"
                raise InputError(f"{at}: key {shown} must be text")
            self._check_text(key, at, "key")
            if key in result:
                raise InputError(f"{at}: is not valid YAML: duplicate key {ascii(key)[:60]}")
            result[key] = self._value(value_node, (*path, key), at)
        return result

    def _value(self, node: Node, path: Path, at: str) -> Any:
        if len(path) > _DEEPEST or len(self.origins) > _MOST_VALUES:
            raise InputError(f"{self._name}: is nested too deeply or has too many values")
        self.origins[path] = at
        if node.tag == f"{_TAG}map":
            return self.group(node, path)
        if node.tag == f"{_TAG}seq":
            return [self._value(item, (*path, i), self._place(item)) for i, item in enumerate(node.value)]
        tag = str(node.tag)
        read = self._scalars.get(tag)
        if read is None or not isinstance(node.value, str):
            kind = tag.removeprefix(_TAG)
            raise InputError(
                f"{at}: {dotted(path)}: must be a number, text, list or group, not a YAML {ascii(kind)[1:-1][:60]}"
                + (": write it in quotes" if kind == "timestamp" else "")
            )
        try:
            value = read(node)
        except ValueError:
            raise InputError(f"{at}: {dotted(path)} = {ascii(node.value)[:60]}: cannot be read as a number") from None
        if isinstance(value, str):
            self._check_text(value, at, dotted(path))
        return value

    def _check_text(self, text: str, at: str, what: str) -> None:
        found = HIDDEN.search(text)
        if found:
            raise InputError(f"{at}: {what}: must be printable text, without the character {found[0]!a}")

    def _place(self, node: Node) -> str:
        mark = node.start_mark
        return f"{self._name}:{mark.line + 1}:{mark.column + 1}"
