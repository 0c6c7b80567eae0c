"""What is wrong with the values of an input file, in words that help its author: rule and cure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from trainmj.errors import close_match, nearest
from trainmj.files.either import Either, alternatives, base_of, is_group, keys_of
from trainmj.files.parts import Spelt

Path = tuple[str | int, ...]
"""Keys and positions that lead to a value."""

_MOST_ERRORS = 200  # errors that are put into words; several can be one problem


@dataclass(frozen=True)
class Problem:
    """A rule that the value at a path breaks."""

    path: Path
    rule: str


def no_such(what: str, path: Path, name: str, known: Iterable[str]) -> Problem:
    """The problem of a name that nothing has."""
    return Problem(path, f"there is no {what} of this name{close_match(name, known)}")


def dotted(path: Path) -> str:
    """A path as a person writes it: ``trains.b_type.mass_t``."""
    return ".".join(str(key) for key in path)


_RULES = {
    "missing": "is missing",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text",
    "bool_type": "must be true or false",
    "list_type": "must be a list",
    "dict_type": "must be a group of keys and values",
    "model_type": "must be a group of keys and values",
    "too_short": "must have at least {min_length} entries",
    "too_long": "must have at most {max_length} entries",
    "string_pattern_mismatch": "must match {pattern}",
    "string_too_long": "must have at most {max_length} characters",
    "literal_error": "must be {expected}",
}


def from_pydantic(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """The problems of a failed validation of a model."""
    problems: dict[Path, Problem] = {}
    for e in error.errors(include_url=False)[:_MOST_ERRORS]:
        place = _Place((), model)
        for key in e["loc"]:
            place = place.below(key)
        path, rule = place.path, _RULES.get(e["type"], "{msg}").format(**e.get("ctx", {}), msg=e["msg"])
        rule = rule.replace(" 1 entries", " 1 entry")
        if e["type"] == "extra_forbidden":
            rule = place.unknown()
        elif e["type"] == "string_pattern_mismatch":
            rule = next((note.rule for note in _bare(place.type)[1] if isinstance(note, Spelt)), rule)
        elif e["type"].startswith("union_tag"):
            union, notes = _bare(place.type)
            either = next(note for note in notes if isinstance(note, Either))
            key, rule = either.refusal(e["input"], alternatives(union))
            path = (*path, key) if key else path
        before = problems.get(path)
        if before is not None and before.rule != rule:
            rule = f"{before.rule}, or {rule}"
        problems[path] = Problem(path, rule)
    return list(problems.values())


@dataclass(frozen=True)
class _Place:
    """A place in a model.

    Attributes:
        path: keys and positions that lead to it.
        type: what is allowed there, with its annotations; None if nothing is known.
        above: the place that contains it.
        union: the type whose alternative was chosen; None if there are no alternatives.
    """

    path: Path
    type: Any
    above: _Place | None = None
    union: Any = None

    def below(self, key: str | int) -> _Place:
        """The place to which the next part of an error's location leads: key, position, or addition of pydantic."""
        outer, bare = _bare(self.above.type)[0] if self.above else None, _bare(self.type)[0]
        if key == "[key]" and base_of(outer) is dict:
            return replace(self, type=get_args(outer)[0])
        if members := alternatives(bare):
            return replace(self, type=members.get(str(key)), union=self.type)
        inner: Any = None
        if is_group(bare):
            field = keys_of(bare).get(str(key))
            inner = None if field is None else _annotated(field)
        elif base_of(bare) in (dict, list) and get_args(bare):
            inner = get_args(bare)[-1]
        return _Place((*self.path, key), inner, self)

    def unknown(self) -> str:
        """The rule for a key that is not known at this place."""
        assert self.above is not None
        key, group = str(self.path[-1]), _bare(self.above.type)[0]
        union, notes = _bare(self.above.union)
        either = next((note for note in notes if isinstance(note, Either)), None)
        way = min(_ways(key, group), key=len, default=())
        home = f"it belongs in {'.'.join(way)}" if way else ""
        if either and (reason := either.misplaced(key, group, alternatives(union))):
            return f"{reason[0]}: {home or reason[1]}"
        known = keys_of(group)
        return f"unknown key; {home}" if home and not nearest(key, known) else f"unknown key{close_match(key, known)}"


def _ways(key: str, type_: Any, way: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The ways to groups below a type that have a key."""
    bare, _ = _bare(type_)
    if is_group(bare):
        if way and key in keys_of(bare):
            yield way
        inner = {name: field.annotation for name, field in keys_of(bare).items()}
    else:
        inner = {"<name>" if base_of(bare) is dict else "<number>": get_args(bare)[-1]} if get_args(bare) else {}
    for member in alternatives(bare).values():
        yield from _ways(key, member, way)
    for name, below in inner.items() if not alternatives(bare) else ():
        yield from _ways(key, below, (*way, name))


def _annotated(field: FieldInfo) -> Any:
    """The type of a field with its annotations, which pydantic keeps apart."""
    return Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation


def _bare(type_: Any) -> tuple[Any, tuple[Any, ...]]:
    """A type without None and annotations, and the annotations."""
    notes: tuple[Any, ...] = ()
    while True:
        members = alternatives(type_)
        if hasattr(type_, "__metadata__"):
            notes += type_.__metadata__
            type_ = type_.__origin__
        elif len(members) == 1:
            (type_,) = members.values()
        else:
            return type_, notes
