"""An input file as it was read: plain values, the place of each, and what is wrong with them, in words that help."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path as FilePath
from typing import Annotated, Any, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ValidationError
from pydantic.fields import FieldInfo

from trainmj.errors import InputError, close_match, nearest
from trainmj.files.arguments import group_given
from trainmj.files.kinds import kind_of
from trainmj.files.numbers import LARGEST
from trainmj.files.parts import Above, Below, Either, Spelt, alternatives, base_of, is_group, keys_of
from trainmj.symbol import Symbol, TraceError, sampled, symbols_in

Model = TypeVar("Model", bound=BaseModel)
Path = tuple[str | int, ...]
"""Keys and positions that lead to a value."""

_SHOWN = 60  # characters of a value in a message
_LONGEST = 300  # characters of a path in a message
_MOST = 20  # problems in one message
_MOST_ERRORS = 200  # errors that are put into words; several can be one problem
_MOST_BITS = int(LARGEST).bit_length()
_MOST_OTHERS = 3  # other files and changes that a group has values from
_POINT = re.compile(r":\d+:\d+$|(:\d+|: [^:]*![A-Z]*\d+)?: \w+ \d+$")  # of a place in a file
_TAKES_BACK = "null takes back what is stated there, and nothing is"


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


_PLAIN = (float, str, bool, type(None))


def plain(value: Any) -> Any:
    """Values as a YAML file gives them: numbers and arrays of numpy and pandas as Python's, tuples as lists.

    Raises:
        InputError: if a whole number is larger than any that a file can hold.
    """
    if type(value) in _PLAIN:  # nearly all are, and the questions below take long
        return value
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        raise InputError(f"a whole number of {value.bit_length()} bits is too large: numbers go up to {LARGEST:g}")
    return value.tolist() if hasattr(value, "tolist") else value


def source_of(values: Mapping[str, Any], folder: str | FilePath = ".") -> Source:
    """Plain values that come from no file; folder is where the files that they name are.

    Raises:
        TypeError: if they are no mapping.
    """
    return Source(plain(group_given(values)), folder=FilePath(folder))


def placed(origins: Mapping[Path, str], replaced: Iterable[Path], by: Mapping[Path, str]) -> dict[Path, str]:
    """The places of values of which some, and all inside them, were replaced by others with places of their own."""
    gone: dict[int, set[Path]] = {}
    for path in replaced:
        gone.setdefault(len(path), set()).add(path)
    kept = {path: o for path, o in origins.items() if not any(path[:n] in paths for n, paths in gone.items())}
    return kept | dict(by)


@dataclass(frozen=True)
class Source:
    """Plain values, and where they come from."""

    values: Mapping[str, Any]  # nested dicts, lists, strings and numbers, as a YAML file gives them
    origins: Mapping[Path, str] = field(default_factory=dict, repr=False)  # "my.yaml:12:5" or "change mass_t=33"
    folder: FilePath = FilePath()  # where the files that the values name are
    told: tuple[str, ...] = field(default=(), repr=False)  # what gave way to values over it or was converted, in words
    files: frozenset[FilePath] = field(default=frozenset(), repr=False)  # that the values were read from

    def reading(self, *names: str, told: Iterable[str] = ()) -> Source:
        """The same with further files that were read, by their names, and what there is to know of how."""
        return replace(self, files=self.files.union(self.folder / name for name in names), told=(*self.told, *told))

    def checked(self, model: type[Model]) -> Model:
        """The values as a model.

        Raises:
            InputError: listing every key and value that is wrong.
        """
        try:
            return model.model_validate(self.values)
        except ValidationError as error:
            if symbols := list(symbols_in(self.values)):
                found: Model = _with_symbols(replace(self, values=sampled(self.values)).checked(model), model, symbols)
                return found
            kind, keys = model.model_config.get("title"), keys_of(model)
            other = kind_of(self.values)
            wrong = other is not None and other.name != kind
            if kind and (wrong or 2 * sum(key in keys for key in self.values) < len(self.values)):
                needed = ", ".join(key for key, field in keys.items() if field.is_required())
                rule = f"is not {'an' if kind[0] in 'aeiou' else 'a'} {kind}, which states {needed}"
                rule += f", but a {other.name}: {other.takes} reads it" if other is not None and wrong else ""
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
        lines = list(dict.fromkeys(f"{self.said(*problem.path)}: {problem.rule}" for problem in listed[:_MOST]))
        return InputError("\n".join(lines + ["and more"] * (len(listed) > _MOST)))

    def error(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value."""
        return self.refusal([Problem(path, rule)])

    def origin(self, *path: str | int) -> str:
        """Where a value comes from; of a group also which other files and changes have a part in it."""
        at = next((self.origins[path[:n]] for n in range(len(path), -1, -1) if path[:n] in self.origins), "")
        inside = (o for p, o in self.origins.items() if path and p[: len(path)] == path)
        others = [other for other in dict.fromkeys(_POINT.sub("", o) for o in inside) if other != _POINT.sub("", at)]
        return at + (f" with {', '.join(others[:_MOST_OTHERS])}" if others else "")

    def said(self, *path: str | int) -> str:
        """Place, key and value, to begin a message with: ``my.yaml:1:1: scenario = 'b_typ'``."""
        value: Any = self.values
        try:
            for key in path:
                value = value[key]
            text = "" if isinstance(value, (dict, list)) else ascii(value)
        except (KeyError, IndexError, TypeError):
            text = ""
        shown = f" = {text[:_SHOWN]}{'...' if len(text) > _SHOWN else ''}" if text else ""
        origin = self.origin(*path)
        if origin == change(dotted(path), value):
            origin = "change"  # the rest says the same
        return f"{f'{origin}: ' if origin else ''}{dotted(path)[:_LONGEST] or 'file'}{shown}"


def change(name: str, value: Any) -> str:
    """A change of a value, as the place of what it changes."""
    text = "null" if value is None else value if isinstance(value, str) else repr(value)
    return f"change {name}={text[:_SHOWN]}{'...' if len(text) > _SHOWN else ''}"


def _with_symbols(here: Any, type_: Any, symbols: list[tuple[Path, Symbol]]) -> Any:
    """What was validated for the sample of symbols, with these back in their places, and guards for their rules.

    Raises:
        TraceError: if something else was made of a number, or a rule of it is no bound.
    """
    bare, bounds = _bounded(type_)
    if any(isinstance(bound, BeforeValidator | AfterValidator) for bound in bounds):
        raise TraceError("validation", symbols[0][1])
    inner: dict[str | int, list[tuple[Path, Symbol]]] = {}
    for (key, *way), symbol in symbols:
        inner.setdefault(key, []).append((tuple(way), symbol))
    if isinstance(here, BaseModel):
        names = {field.alias or name: name for name, field in type(here).model_fields.items()}
        return here.model_copy(
            update={
                names[str(key)]: _put(getattr(here, names[str(key)]), inside(type(here), key), below)
                for key, below in inner.items()
            }
        )
    if members := alternatives(bare):
        bare = next((member for member in members.values() if isinstance(here, base_of(member))), None)
    found: Any = here.copy()
    if isinstance(here, list):
        of_each = inside(bare, 0)
        if not any(way for below in inner.values() for way, _ in below):
            kept = _bounded(of_each)[1]
            for key, ((_, symbol),) in inner.items():
                found[key] = _bound(here[int(key)], symbol, kept)
            return found
    for key, below in inner.items():
        found[key] = _put(here[key], inside(bare, key), below)
    return found


def _put(here: Any, type_: Any, symbols: list[tuple[Path, Symbol]]) -> Any:
    """The same, where there may be a single number."""
    way, symbol = symbols[0]
    return _with_symbols(here, type_, symbols) if way else _bound(here, symbol, _bounded(type_)[1])


def _bound(here: Any, symbol: Symbol, bounds: list[Any]) -> Symbol:
    """A symbol in place of a number, with guards for the bounds of its type."""
    if any(isinstance(bound, BeforeValidator | AfterValidator) for bound in bounds):
        raise TraceError("validation", symbol)
    if type(here) is not float or here != symbol.sample:
        raise TraceError("another type", symbol)
    keeps = -math.inf < symbol < math.inf
    for bound in bounds:
        for name, relation in _BOUNDS.items():
            keeps = keeps and (not hasattr(bound, name) or relation(symbol, getattr(bound, name)))
    assert keeps  # its sample does
    return symbol


def _bounded(type_: Any) -> tuple[Any, list[Any]]:
    """A type without None and annotations, and its bounds and validators."""
    bare, notes = _bare(type_)
    return bare, [bound for note in notes for bound in (note.metadata if isinstance(note, FieldInfo) else [note])]


_BOUNDS = {"ge": operator.ge, "gt": operator.gt, "le": operator.le, "lt": operator.lt}

_RULES = {
    "missing": "is missing",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:.12g}",
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
    "string_too_short": "must have at least {min_length} characters",
    "string_too_long": "must have at most {max_length} characters",
    "literal_error": "must be {expected}",
}


_BEYOND: dict[str, type[Above] | type[Below]] = {"less_than_equal": Above, "greater_than_equal": Below}


def _from_pydantic(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """The problems of a failed validation of a model."""
    problems: dict[Path, Problem] = {}
    for e in error.errors(include_url=False)[:_MOST_ERRORS]:
        place = _Place((), model)
        for key in e["loc"]:
            place = place.below(key)
        path, rule = place.path, _RULES.get(e["type"], "{msg}").format(**e.get("ctx", {}), msg=e["msg"])
        rule = rule.replace(" 1 entries", " 1 entry").replace(" 1 characters", " 1 character")
        if e["input"] is None and e["type"].endswith("_type"):
            rule = f"{rule}; {_TAKES_BACK}"
        if e["type"] == "extra_forbidden":
            rule = place.unknown()
        elif e["type"] == "string_pattern_mismatch":
            rule = next((note.rule for note in _bare(place.type)[1] if isinstance(note, Spelt)), rule)
        elif e["type"] in _BEYOND:
            cures = (note.cure for note in _bare(place.type)[1] if isinstance(note, _BEYOND[e["type"]]))
            rule = ": ".join([rule, *cures])
        elif e["type"].startswith("union_tag") or (e["type"] == "literal_error" and place.union):
            union, notes = _bare(place.union or place.type)
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
        return _Place((*self.path, key), inside(bare, key), self)

    def unknown(self) -> str:
        """The rule for a key that is not known at this place."""
        assert self.above is not None
        key, group = str(self.path[-1]), _bare(self.above.type)[0]
        union, notes = _bare(self.above.union)
        either = next((note for note in notes if isinstance(note, Either)), None)
        way = min(_ways(key, group), key=len, default=())
        home = f"it belongs in {'.'.join(way)}" if way else ""
        if either and (reason := either.misplaced(key, group, alternatives(union))):
            return f"{reason[0]}: {home or reason[1]}" if reason[1] else reason[0]
        known = keys_of(group)
        return f"unknown key; {home}" if home and not nearest(key, known) else f"unknown key{close_match(key, known)}"


def inside(type_: Any, key: str | int) -> Any:
    """The type of what a key or position leads to, in an alternative that has it; None if nothing is known."""
    bare, _ = _bare(type_)
    if members := alternatives(bare):
        return next((found for member in members.values() if (found := inside(member, key)) is not None), None)
    if is_group(bare):
        field = keys_of(bare).get(str(key))
        return None if field is None else _annotated(field)
    return get_args(bare)[-1] if base_of(bare) in (dict, list) and get_args(bare) else None


def type_at(type_: Any, path: Path) -> Any:
    """The type that is allowed at a path, without None and annotations; None if nothing is known."""
    for key in path:
        type_ = inside(type_, key)
    return _bare(type_)[0]


def groups_of(type_: Any) -> list[type[BaseModel]]:
    """The groups that a type allows; several if it has alternatives."""
    bare, _ = _bare(type_)
    return [member for member in alternatives(bare).values() or [bare] if is_group(member)]


def has_key(type_: Any, key: str | int) -> bool:
    """Whether a key is one that a group has; the keys of other mappings are the user's."""
    return any(key in keys_of(group) for group in groups_of(type_))


def has_values_by_name(type_: Any) -> bool:
    """Whether a type is a mapping whose keys are the user's and whose values are no groups."""
    bare, _ = _bare(type_)
    return base_of(bare) is dict and bool(get_args(bare)) and not groups_of(get_args(bare)[-1])


def put(group: dict[Any, Any], key: str | int, value: Any, type_: Any) -> None:
    """Put a value into a group of a type; None takes back the value that is there, so that the default applies."""
    if value is None and (key in group or has_key(type_, key)):
        group.pop(key, None)
    else:
        group[key] = value


def giving_way(type_: Any, under: Mapping[str, Any], over: Mapping[str, Any]) -> list[str]:
    """The keys of a group that do not go with the alternative which the values over it stand for."""
    union, notes = _bare(type_)
    either = next((note for note in notes if isinstance(note, Either)), None)
    return either.giving_way(under, over, alternatives(union)) if either else []


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
