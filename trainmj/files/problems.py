"""What is wrong with an input file, said so that its author can mend it: place, key, value, rule, cure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from trainmj.errors import InputError, close_match

Model = TypeVar("Model", bound=BaseModel)
Path = tuple[str | int, ...]
Origins = Mapping[Path, str]
"""Where each value stands: ``"my.yaml:12:5"`` or ``"--set"``, by path."""

_SHOWN = 60  # characters of a value in a message
_LONGEST = 300  # characters of a path in a message
_MOST = 20  # problems in one message
_MOST_ERRORS = 200  # that are put into words; several may be one problem


@dataclass(frozen=True)
class Problem:
    """A rule that the value at a path breaks."""

    path: Path
    rule: str


def refuse(problems: Iterable[Problem], values: Any, origins: Origins) -> InputError:
    """The error that lists problems, each with its place and value."""
    listed = list(islice(problems, _MOST + 1))
    lines = [_line(p, values, origins) for p in listed[:_MOST]]
    if len(listed) > _MOST:
        lines.append("and more")
    return InputError("\n".join(lines))


def _line(problem: Problem, values: Any, origins: Origins) -> str:
    key = dotted(problem.path)[:_LONGEST]
    found, value = _value(values, problem.path)
    shown = f" = {_short(value)}" if found and not isinstance(value, (dict, list)) else ""
    where = _origin(problem.path, origins)
    return f"{where}{key or 'file'}{shown}: {problem.rule}"


def dotted(path: Path) -> str:
    """A path as a person writes it: ``trains.b_type.mass_t``."""
    return ".".join(str(key) for key in path)


def _origin(path: Path, origins: Origins) -> str:
    for n in range(len(path), -1, -1):
        if path[:n] in origins:
            return f"{origins[path[:n]]}: "
    return ""


def _value(values: Any, path: Path) -> tuple[bool, Any]:
    for key in path:
        try:
            values = values[key]
        except (KeyError, IndexError, TypeError):
            return False, None
    return True, values


def _short(value: Any) -> str:
    text = ascii(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


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
    "string_pattern_mismatch": "must be letters, digits and _ (a label may also have spaces and . + / -)",
    "string_too_long": "must have at most {max_length} characters",
    "literal_error": "must be {expected}",
    "union_tag_invalid": "must be a name, points or a list of these",
}
_TAGS = frozenset({"name", "points", "list", "count", "str", "list[str]", "[key]", "[value]", "[curve]"})


def validated(model: type[Model], values: Any, origins: Origins) -> Model:
    """The model that plain values make.

    Raises:
        InputError: listing every key and value that is wrong.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise refuse(from_pydantic(error, model), values, origins) from None


def from_pydantic(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Problems from a failed validation of a model, in the words of this project."""
    problems: dict[Path, Problem] = {}
    for e in error.errors(include_url=False, include_input=False)[:_MOST_ERRORS]:
        path = _plain(e["loc"], model)
        if e["type"] == "extra_forbidden":
            rule = "unknown key" + close_match(str(path[-1]), _keys(model, path[:-1]))
        else:
            template = _RULES.get(e["type"])
            rule = template.format(**e.get("ctx", {})) if template else e["msg"]
        before = problems.get(path)
        if before is not None and before.rule != rule:
            rule = f"{before.rule}, or {rule}"
        problems[path] = Problem(path, rule)
    return list(problems.values())


def _plain(loc: Path, model: type[BaseModel]) -> Path:
    """The location without what pydantic adds for the branches of unions."""
    path: list[str | int] = []
    for key in loc:
        known = _keys(model, tuple(path))
        if isinstance(key, str) and key not in known and key in _TAGS and not _free(model, tuple(path)):
            continue
        path.append(key)
    return tuple(path)


def _free(model: type[BaseModel], path: Path) -> bool:
    """Whether the user chooses the keys at a path."""
    return any(get_origin(t) is dict for t in _types(model, path))


def _keys(model: type[BaseModel], path: Path) -> set[str]:
    """Keys that a model knows at a path."""
    return {
        name for t in _types(model, path) if isinstance(t, type) and issubclass(t, BaseModel) for name in t.model_fields
    }


def _types(model: type[BaseModel], path: Path) -> list[Any]:
    """Types that may stand at a path of a model, unions taken apart."""
    types: list[Any] = [model]
    for key in path:
        inner: list[Any] = []
        for t in types:
            if isinstance(t, type) and issubclass(t, BaseModel):
                if key in t.model_fields:
                    inner.append(t.model_fields[str(key)].annotation)
            elif get_origin(t) in (dict, list):
                inner.append(get_args(t)[-1])
        types = [leaf for t in inner for leaf in _leaves(t)]
    return types


def _leaves(t: Any) -> list[Any]:
    """The members of a union or annotation, down to plain types."""
    if get_origin(t) in (dict, list) or not get_args(t):
        return [t]
    args = get_args(t)[:1] if hasattr(t, "__metadata__") else get_args(t)
    return [leaf for a in args for leaf in _leaves(a)]
