"""YAML as plain values: numbers, text, lists and groups, and the place of each. Nothing in a file can make an object.

The YAML package only composes the text to nodes; what a scalar means is said here, by the core schema of YAML 1.2
(https://yaml.org/spec/1.2.2/#103-core-schema) and nothing else: 040 is 40, and yes, 1:30 and 1_000 are text. Length,
depth, number and size of values are bounded, including what anchors expand to.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, lru_cache
from itertools import accumulate
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, NamedTuple

from trainmj.errors import InputError
from trainmj.files.numbers import LARGEST
from trainmj.files.source import Path, Source, dotted
from trainmj.files.text import HIDDEN, printable, read_text

if TYPE_CHECKING:
    from ruamel.yaml.nodes import Node

MOST_BYTES = 5_000_000
_MOST_MARKS = 100_000  # characters that can separate values: each costs the YAML package about 0.1 ms
_MOST_KEYS = 10_000  # each costs more than two others
_MOST_VALUES = 100_000
_DEEPEST = 30
_SHORT = 20_000  # characters: the nodes of longer texts are not kept in memory
_DEEPER = {"[": 1, "{": 1, "]": -1, "}": -1}
_SHOWN = 120  # characters of a command's option in a message
_TAG = "tag:yaml.org,2002:"
_VERSION = re.compile(r"\ufeff?(?:(?:[ \t]*(?:#[^\r\n]*)?|%(?!YAML\b)[^\r\n]*|\.\.\.[ \t]*)[\r\n])*%YAML[ \t]+(\S*)")
"""The version of YAML that a file states before its first value."""


class _Kind(NamedTuple):
    """A kind of scalar: how it is written, and read."""

    pattern: re.Pattern[str]
    read: Callable[[str], Any]


def _int(text: str) -> int | float:
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    digits = text.lstrip("+-0ox")
    if len(digits) > len(f"{LARGEST:.0f}"):  # Python does not convert thousands of them
        return math.inf
    return int(digits or "0", base) * (-1 if text.startswith("-") else 1)


_KINDS = {
    f"{_TAG}null": _Kind(re.compile(r"null|Null|NULL|~|"), lambda text: None),
    f"{_TAG}bool": _Kind(re.compile(r"true|True|TRUE|false|False|FALSE"), lambda text: text.lower() == "true"),
    f"{_TAG}int": _Kind(re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+"), _int),
    f"{_TAG}float": _Kind(
        re.compile(
            r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"
        ),
        lambda text: float(re.sub(r"\.(?=[in])", "", text.lower())),
    ),
    f"{_TAG}str": _Kind(re.compile(r"(?s:.*)"), str),
}
"""The core schema: a plain scalar is of the first kind that it is written as."""


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
    said = said[:_SHOWN] + "..." * (len(said) > _SHOWN)
    try:
        line = f"value: {text}"
        values = parse(line, said).values
    except InputError as error:
        rule = re.sub(r"^(:\d+:\d+)?: (value[^:]*: )?", "", str(error).removeprefix(said))
        raise InputError(f"{said}: {rule}") from None
    if set(values) != {"value"}:
        raise InputError(f"{said}: must be a single value")
    if text.lstrip().startswith("#") or line[_nodes(line).value[0][1].end_mark.index :].strip():
        raise InputError(
            f"{said}: what follows # is a comment in YAML: put text with # into quotes, as in '\"No. #2\"'"
        )
    return values["value"]


def as_yaml(values: Mapping[str, Any]) -> str:
    """Plain values as the text of a YAML file."""
    text = io.StringIO()
    yaml = _yaml()
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False
    yaml.width = 120
    yaml.representer.ignore_aliases = lambda *_: True  # every value in full, without anchors
    yaml.dump(dict(values), text)
    return text.getvalue()


def parse(text: str, name: str) -> Source:
    """Plain values of one YAML document, a group of keys and values, and the place of each in the file of a name.

    Raises:
        InputError: with file, line and column.
    """
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    _measure(text, name)
    stated = _VERSION.match(text)
    if stated and stated[1] != "1.2":
        at = f"{name}:{text.count(chr(10), 0, stated.start(1)) + 1}:1"
        raise InputError(f"{at}: states YAML {printable(stated[1])[:20]}: files are read as YAML 1.2; remove this line")
    try:
        root = _nodes(text) if len(text) <= _SHORT else _nodes.__wrapped__(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        place = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise InputError(f"{name}{place}: is not valid YAML: {printable(str(error.problem))[:200]}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        reason = "too deep" if isinstance(error, RecursionError) else (str(error).splitlines() or [""])[0]
        raise InputError(f"{name}: is not valid YAML: {printable(reason)[:200]}") from None
    if root is None or root.tag != f"{_TAG}map":
        raise InputError(f"{name}: must be a group of keys and values such as 'devices:'")
    reader = _Reader(name)
    return Source(reader.group(root, ()), reader.origins)


@lru_cache(maxsize=32)
def _nodes(text: str) -> Any:
    """What the YAML package makes of a text, never changed here. It takes its time, and commands read files again."""
    from ruamel.yaml.error import ReusedAnchorWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ReusedAnchorWarning)  # YAML allows it: the last one before counts
        return _yaml().compose(text)


def _yaml() -> Any:
    """The YAML package, with the core schema instead of its own."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.Resolver = _resolver()
    return yaml


@cache
def _resolver() -> Any:
    from ruamel.yaml.nodes import ScalarNode
    from ruamel.yaml.resolver import VersionedResolver
    from ruamel.yaml.tag import Tag

    class Core(VersionedResolver):
        processing_version = (1, 2)

        def resolve(self, kind: Any, value: Any, implicit: Any) -> Any:
            if kind is ScalarNode and implicit[0]:
                return Tag(suffix=next(tag for tag, of in _KINDS.items() if of.pattern.fullmatch(value)))
            return super().resolve(kind, value, (False, implicit[1]) if kind is ScalarNode else implicit)

    return Core


def _measure(text: str, name: str) -> None:
    """Refuse text that the YAML package would take long to read, or to refuse."""
    marks = re.findall(r"[\[\]{},:?\n]", text)
    most = max(accumulate((_DEEPER.get(mark, 0) for mark in marks), initial=0))
    if most > _DEEPEST:
        raise InputError(f"{name}: is nested too deeply")
    if len(marks) > _MOST_MARKS:
        raise InputError(f"{name}: has too many values: put long curves into CSV files")
    if marks.count(":") > _MOST_KEYS:
        raise InputError(f"{name}: has more than {_MOST_KEYS} keys: put long tables into CSV files")


class _Reader:
    """Reads the nodes of a file."""

    def __init__(self, name: str) -> None:
        self.origins: dict[Path, str] = {(): name}  # file, line and column of each value
        self._name = name

    def group(self, node: Node, path: Path) -> dict[str, Any]:
        """A mapping as a dict."""
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            at = self._place(key_node)
            key = key_node.value
            if key_node.tag != f"{_TAG}str":
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
        kind = _KINDS.get(tag)
        if kind is None or not isinstance(node.value, str):
            said = ascii(tag.removeprefix(_TAG))[1:-1][:60]
            raise InputError(f"{at}: {dotted(path)}: must be a number, text, list or group, not a YAML {said}")
        shown = f"{at}: {dotted(path)} = {ascii(node.value)[1:-1][:60]}{'...' * (len(node.value) > 60)}"
        if not kind.pattern.fullmatch(node.value):
            raise InputError(f"{shown}: is not a YAML {tag.removeprefix(_TAG)}")
        value = kind.read(node.value)
        if (
            type(value) in (int, float)
            and not abs(value) <= LARGEST
            and not node.value.lower().endswith((".inf", ".nan"))
        ):
            raise InputError(f"{shown}: is too large: numbers go up to {LARGEST:g}")
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
