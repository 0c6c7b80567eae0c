"""Values of a scenario by path, such as ``trains.b_type.mass_t``, or by the short name that it gives to a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from trainmj.errors import InputError, close_match
from trainmj.files.source import Path, Source, dotted
from trainmj.scenario.parts import Parts


def changed(source: Source, parameters: Mapping[str, str | list[str]], changes: Mapping[str, Any]) -> Source:
    """The values of a scenario with some of them replaced; what is not on the way to one is shared, not copied.

    Args:
        source: the values.
        parameters: short names and the path or paths they stand for.
        changes: new values by path or short name.

    Raises:
        InputError: if a path leads nowhere.
    """
    values, origins = dict(source.values), dict(source.origins)
    for name, value in changes.items():
        targets = parameters.get(name, name)
        for target in [targets] if isinstance(targets, str) else targets:
            path = _replace(values, target, value, parameters)
            origins[path] = f"change {name}={value}" if name != target else "change"
    return replace(source, values=values, origins=origins)


def find(values: Mapping[str, Any], parameters: Mapping[str, str | list[str]], name: str) -> list[Any]:
    """The values at the places that a name stands for; None where a key has only a default.

    Raises:
        InputError: if it leads nowhere.
    """
    places = changed(Source(values), parameters, {name: None}).origins
    found = []
    for path in places:
        here: Any = values
        for key in path:
            here = here.get(key) if isinstance(here, dict) else here[key]
            if here is None:
                break
        found.append(here)
    return found


def _replace(values: dict[str, Any], target: str, value: Any, parameters: Mapping[str, object]) -> Path:
    """Put a value at a path, copying each container on the way; return the path with list positions resolved."""
    path: list[str | int] = []
    here: Any = values
    keys = target.split(".")
    for n, text in enumerate(keys):
        key = _resolve(here, text, path, target, parameters if n == 0 else {})
        path.append(key)
        if n == len(keys) - 1:
            here[key] = value
        else:
            inner = here[key]
            here[key] = inner.copy() if isinstance(inner, (dict, list)) else inner
            here = here[key]
    return tuple(path)


def _resolve(here: Any, text: str, path: list[str | int], target: str, parameters: Mapping[str, object]) -> str | int:
    """The key or position that a part of a path means in the container it is in."""
    last = target.count(".") == len(path)
    if isinstance(here, dict):
        # a key that has a default may be missing at the end of a path; the checks know whether it exists
        if text in here or (last and path):
            return text
        if not path and text in Parts.model_fields:
            here[text] = {}
            return text
        raise InputError(f"{target}: there is no {text!r}{_within(path)}{close_match(text, {*here, *parameters})}")
    if isinstance(here, list):
        names = [v.get("name") if isinstance(v, dict) else None for v in here]
        if text in names:
            return names.index(text)
        if text.isdecimal() and int(text) < len(here):
            return int(text)
        raise InputError(f"{target}: there is no entry {text!r}{_within(path)}, which has {len(here)} (0 is the first)")
    raise InputError(f"{target}: {dotted(tuple(path))} is a single value and has no {text!r} inside")


def _within(path: list[str | int]) -> str:
    return f" in {dotted(tuple(path))}" if path else " in the scenario"
