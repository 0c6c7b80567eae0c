"""What every input file is made of: groups whose keys are all known, numbers, names, notes, and alternatives.

Alternatives are types, recognised by what is written::

    Curve = Annotated[str | Points | CurveFile, Either()]    # a name, or a group with stroke_mm or with file
    Design = Annotated[Sobol | Table, Either(by="kind")]     # kind: Literal["sobol"], kind: Literal["table"]

Text, numbers, lists and groups are recognised as such. Groups are told apart by the value of one key (``by``), and
otherwise by the required key that only one of them has; a group without such a key is taken if no other one fits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from trainmj.errors import nearest
from trainmj.files.numbers import LARGEST
from trainmj.files.text import HIDDEN


@dataclass(frozen=True)
class Spelt:
    """Marks text with a pattern: the rule in words, for messages, editors and the documentation."""

    rule: str

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Tell the rule to editors: Visual Studio Code and others show it instead of the pattern."""
        return handler(schema) | {"patternErrorMessage": self.rule}


@dataclass(frozen=True)
class Above:
    """Marks a number with an upper bound: what is probably wrong with one above it, for messages."""

    cure: str


@dataclass(frozen=True)
class Below:
    """Marks a number with a lower bound, ``ge``: what is probably wrong with one below it, likewise."""

    cure: str


Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Name = Annotated[
    str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40), Spelt("must be a letter, then letters, digits and _")
]


def _whole(value: Any) -> Any:
    """2.0 stands for 2, as YAML, CSV and pandas write it; true and text for no number."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


WHOLE = BeforeValidator(_whole)
"""Marks a whole number, behind its bounds: ``Annotated[int, Field(ge=1), WHOLE]``."""

Seed = Annotated[int, Field(ge=0, lt=2**32), WHOLE]


def _one_line(text: str) -> str:
    text = text.strip()
    if "\n" in text or "\t" in text or HIDDEN.search(text):
        raise PydanticCustomError("one_line", "must be one line of text")
    return text


ONE_LINE = AfterValidator(_one_line)
"""Marks text that heads something: with more lines it could say what the lines below it say."""

Title = Annotated[str, Field(max_length=200), ONE_LINE]
Notes = Annotated[str, Field(max_length=20_000)]


def _rising(bounds: list[float]) -> list[float]:
    low, high = bounds
    if not low < high:
        values = {"low": f"{low:g}", "high": f"{high:g}"}
        raise PydanticCustomError("bounds", "must be a lower and a higher value: {low} is not below {high}", values)
    return bounds


Bounds = Annotated[list[Number], Field(min_length=2, max_length=2), AfterValidator(_rising)]
"""A lower and a higher value."""


class Part(BaseModel):
    """A group of an input file: its keys are all known, its values fixed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


Group = type[BaseModel]
Alternatives = Mapping[str, Any]
"""The types of a union by tag; pydantic puts the tag into the location of an error."""

_WORDS = {str: "text", int: "a whole number", float: "a number", list: "a list", dict: "a group of keys and values"}


@dataclass(frozen=True)
class Either:
    """Marks a union whose members are alternatives."""

    by: str = ""  # key whose value tells groups apart; it may be left out for a group that has a default for it
    said: str = ""  # the alternatives in words, if these say more than the types: "the name of a curve, or its points"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """A union, tagged by the alternative that a value stands for."""
        members = alternatives(source)
        tags = {base_of(member): tag for tag, member in members.items()}
        tags |= {int: tags[float]} if float in tags and int not in tags else {}
        tags |= {float: tags[int]} if int in tags and float not in tags else {}
        kinds = {
            kind: {tag: next(iter(keys), None) for tag, keys in _own_keys(groups).items()}
            for kind, groups in self._by_kind(members).items()
        }

        def choose(value: Any) -> str | None:
            if isinstance(value, Mapping) and _groups(members):
                return _meant(value, kinds.get(self._kind_of(value), {}), members)
            return tags.get(type(value)) or next((tag for base, tag in tags.items() if _is_a(value, base)), None)

        schemas = {tag: handler.generate_schema(member) for tag, member in members.items()}
        return core_schema.tagged_union_schema(schemas, choose)

    def refusal(self, value: Any, members: Alternatives) -> tuple[str, str]:
        """The key that is wrong, if it is one, and the rule, for a value that fits no alternative."""
        if not (isinstance(value, Mapping) and _groups(members)):
            words = (_WORDS[dict if is_group(member) else base_of(member)] for member in members.values())
            return "", f"must be {self.said or one_of(words)}"
        kinds = self._by_kind(members)
        free = kinds.pop(self._kind_of(value), {})
        if free and self.by not in value and (of_kind := self._kind_with(value, free, kinds)):
            return self.by, f"is missing: {of_kind[0]} belongs to {self.by} {of_kind[1]}"
        if own := _own_keys(free):
            needs = [" and ".join(keys) for keys in own.values()]
            return "", f"needs {', or '.join(needs) if ' and ' in ' '.join(needs) else one_of(needs)}"
        offered = one_of(repr(kind) for kind in kinds if kind is not None)
        return self.by, f"must be {offered}" if self.by in value else f"is missing: {offered}"

    def misplaced(self, key: str, chosen: Group, members: Alternatives) -> tuple[str, str] | None:
        """Rule, and cure unless it is told, for a key of another group than the chosen one; None if no group has it."""
        takers = {tag: group for tag, group in _groups(members).items() if key in keys_of(group)}
        if not takers:
            return None
        kinds = self._kinds(chosen)
        if kinds and all(self._kinds(group) != kinds for group in takers.values()):
            owners = one_of(str(kind) for group in takers.values() for kind in self._kinds(group))
            known = [known for known in keys_of(chosen) if known != self.by] or ["no other key"]
            return f"belongs to {self.by} {owners}: {kinds[0]} takes {', '.join(known)}", ""
        own = _own_keys(takers | {chosen.__name__: chosen})
        mark = own.pop(chosen.__name__)
        if mark:
            return f"does not go with {mark[0]}", "leave one of them out"
        return f"needs {one_of(keys[0] for keys in own.values() if keys)}", "add it, or leave this out"

    def giving_way(self, under: Mapping[str, Any], over: Mapping[str, Any], members: Alternatives) -> list[str]:
        """The keys of a group that do not go with the alternative which the values over it stand for."""
        groups = _groups(members)
        kinds = self._by_kind(members)
        meant = kinds.get(self._kind_of(over) or self._kind_of(under), {}) or kinds[None]
        marks = {tag: own for tag, own in _own_keys(meant).items() if any(over.get(key) is not None for key in own)}
        if len(marks) == 1:
            meant = {tag: meant[tag] for tag in marks}
        there = {key for group in meant.values() for key in keys_of(group)}
        return [key for key in under if key not in there and any(key in keys_of(group) for group in groups.values())]

    def _kind_with(self, value: Mapping[Any, Any], free: Mapping[str, Group], kinds: Mapping[Any, Any]) -> Any:
        """A key that no group without a kind has, and the kinds that have it; None if there is no such key."""
        known = {key for group in free.values() for key in keys_of(group)}
        takers = {
            key: [kind for kind, groups in kinds.items() if any(key in keys_of(group) for group in groups.values())]
            for key in value
            if key not in known
        }
        return next(((key, one_of(map(str, found))) for key, found in takers.items() if found), None)

    def _by_kind(self, members: Alternatives) -> dict[Any, dict[str, Group]]:
        """The groups by the value of the key that tells them apart; None stands for a key that is not stated."""
        groups = _groups(members)
        if not self.by:
            return {None: groups}
        kinds = dict.fromkeys(kind for group in groups.values() for kind in self._kinds(group))
        free = {tag: group for tag, group in groups.items() if not keys_of(group)[self.by].is_required()}
        return {kind: {t: g for t, g in groups.items() if kind in self._kinds(g)} for kind in kinds} | {None: free}

    def _kind_of(self, value: Mapping[Any, Any]) -> Any:
        """The value of the key that tells groups apart; None if it is not stated."""
        kind = value.get(self.by) if self.by else None
        return kind if kind is None or isinstance(kind, str) else ""

    def _kinds(self, group: Group) -> tuple[Any, ...]:
        """The values that a group allows for the key that tells groups apart."""
        return get_args(group.model_fields[self.by].annotation) if self.by else ()


def alternatives(union: Any) -> dict[str, Any]:
    """The members of a union by tag; empty if a type is no union."""
    if get_origin(union) not in (Union, UnionType):
        return {}
    return {base_of(member).__name__: member for member in get_args(union) if member is not type(None)}


def base_of(annotation: Any) -> Any:
    """The class behind a type: list for ``Annotated[list[int], ...]``, str for ``Literal["a", "b"]``."""
    while hasattr(annotation, "__metadata__"):
        annotation = annotation.__origin__
    origin = get_origin(annotation)
    return type(get_args(annotation)[0]) if origin is Literal else origin or annotation


def is_group(annotation: Any) -> bool:
    """Whether a type is a group of known keys."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def keys_of(group: Group) -> dict[str, FieldInfo]:
    """The keys of a group, as they are written in a file."""
    return {field.alias or name: field for name, field in group.model_fields.items()}


def one_of(words: Iterable[str]) -> str:
    """Each word once: "a, b or c"."""
    *others, last = dict.fromkeys(words)
    return f"{', '.join(others)} or {last}" if others else last


def _groups(members: Alternatives) -> dict[str, Group]:
    return {tag: member for tag, member in members.items() if is_group(member)}


def _own_keys(groups: Mapping[str, Group]) -> dict[str, list[str]]:
    """The required keys that only one of the groups has, for each group."""
    keys = {tag: keys_of(group) for tag, group in groups.items()}
    return {
        tag: [
            key
            for key, field in own.items()
            if field.is_required() and not any(key in others for other, others in keys.items() if other != tag)
        ]
        for tag, own in keys.items()
    }


def _meant(value: Mapping[Any, Any], marks: Mapping[str, str | None], members: Alternatives) -> str | None:
    """The tag of the group that a value stands for: by the key that marks it, or one that is spelt almost like it."""
    if len(marks) == 1:
        return next(iter(marks))
    for tag, mark in marks.items():
        if mark in value:
            return tag
    unknown = [str(key) for key in value if not any(key in keys_of(members[tag]) for tag in marks)]
    near = [tag for tag, mark in marks.items() if mark and unknown and nearest(mark, unknown)]
    return next(iter(near or [tag for tag, mark in marks.items() if mark is None]), None)


def _is_a(value: Any, base: type) -> bool:
    """Whether a value is of a type; true and false are not numbers."""
    return isinstance(value, base) and not isinstance(value, bool)
