"""An input file as it was read: plain values, the place of each, and what is wrong with them, in words that help."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path as FilePath
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from trainmj.errors import InputError, close_match, nearest
from trainmj.files.parts import Either, Spelt, alternatives, base_of, is_group, keys_of

Model = TypeVar("Model", bound=BaseModel)
Path = tuple[str | int, ...]
"""Keys and positions that lead to a value."""

_SHOWN = 60  # characters of a value in a message
_LONGEST = 300  # characters of a path in a message
_MOST = 20  # problems in one message
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


@dataclass(frozen=True)
class Source:
    """Plain values, and where they come from."""

    values: Mapping[str, Any]  # nested dicts, lists, strings and numbers, as a YAML file gives them
    origins: Mapping[Path, str] = field(default_factory=dict, repr=False)  # "my.yaml:12:5" or "change mass_t=33"
    folder: FilePath = FilePath()  # where the files that the values name are
    files: frozenset[FilePath] = field(default=frozenset(), repr=False)  # that the values were read from

    def reading(self, *names: str) -> Source:
        """The same with further files that were read, beside the file that names them."""
        return replace(self, files=self.files.union(self.folder / name for name in names))

    def checked(self, model: type[Model]) -> Model:
        """The values as a model.

        Raises:
            InputError: listing every key and value that is wrong.
        """
        try:
            return model.model_validate(self.values)
        except ValidationError as error:
            kind, keys = model.model_config.get("title"), keys_of(model)
            if kind and 2 * sum(key in keys for key in self.values) < len(self.values):
                needed = ", ".join(key for key, field in keys.items() if field.is_required())
                rule = f"is not a {kind}, which states {needed}"
                raise InputError(f"{self.origins[()]}: {rule}" if () in self.origins else rule) from None
            raise self.refusal(_from_pydantic(error, model)) from None

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise the error that lists problems, if there are any.

        Raises:
            InputError: with the place and value of each.
        """
        listed = list(islice(problems, _MOST + 1))
        if listed:
            raise self.refusal(listed)

    def refusal(self, problems: Iterable[Problem]) -> InputError:
        """The error that lists problems, each with its place and value."""
        listed = list(islice(problems, _MOST + 1))
        lines = [f"{self.said(*problem.path)}: {problem.rule}" for problem in listed[:_MOST]]
        return InputError("\n".join(lines + ["and more"] * (len(listed) > _MOST)))

    def error(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value."""
        return self.refusal([Problem(path, rule)])

    def said(self, *path: str | int) -> str:
        """Place, key and value, to begin a message with: ``my.yaml:1:1: scenario = 'b_typ'``."""
        origin = next((self.origins[path[:n]] for n in range(len(path), -1, -1) if path[:n] in self.origins), "")
        value: Any = self.values
        try:
            for key in path:
                value = value[key]
            text = "" if isinstance(value, (dict, list)) else ascii(value)
        except (KeyError, IndexError, TypeError):
            text = ""
        shown = f" = {text[:_SHOWN]}{'...' if len(text) > _SHOWN else ''}" if text else ""
        return f"{f'{origin}: ' if origin else ''}{dotted(path)[:_LONGEST] or 'file'}{shown}"


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


def _from_pydantic(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
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
    """A place in a model."""

    path: Path
    type: Any  # what is allowed there, with its annotations; None if nothing is known
    above: _Place | None = None  # the place that contains it
    union: Any = None  # the type whose alternative was chosen; None if there are no alternatives

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
