"""A whole scenario: checked, frozen, and varied by copies.

Values are found by path, such as ``trains.b_type.mass_t``, or by the short name that the scenario gives to a path.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any, Self

from pydantic import PrivateAttr

from trainmj.errors import InputError, close_match
from trainmj.files.source import Path, Problem, Source, dotted
from trainmj.scenario.parts import Parts
from trainmj.scenario.rules import broken_rules

_NOWHERE = Source({})


class Scenario(Parts):
    """A scenario whose names all exist and whose values can all be simulated."""

    _source: Source = PrivateAttr(default_factory=lambda: _NOWHERE)  # a default would be copied for every case

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> Self:
        """Check plain values, as a YAML file gives them, and make the scenario.

        Args:
            values: nested dicts, lists, strings and numbers, keys as in a scenario file.

        Raises:
            InputError: listing every key, value and rule that is broken.
        """
        return cls.from_source(Source(values))

    @classmethod
    def from_source(cls, source: Source) -> Self:
        """Check plain values whose places are known.

        Raises:
            InputError: listing every key, value and rule that is broken, each with its place.
        """
        scenario = source.checked(cls)
        source.refuse(broken_rules(scenario))
        scenario._source = source
        return scenario

    @property
    def files(self) -> frozenset[FilePath]:
        """The files that it was read from."""
        return self._source.files

    def values(self) -> dict[str, Any]:
        """The plain values this scenario was made from; a copy."""
        return copy.deepcopy(dict(self._source.values))

    def with_values(self, changes: Mapping[str, Any]) -> Self:
        """A copy with some values changed.

        Args:
            changes: new values by path (``"devices.front.stiffness_kN_per_mm"``) or parameter (``"mass_t"``).

        Raises:
            InputError: if a path leads nowhere or the changed scenario breaks a rule.
        """
        return self.from_source(changed(self._source, self.parameters, changes))

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise the error that lists problems with the places of their values, if there are any.

        Raises:
            InputError: with the place and value of each.
        """
        self._source.refuse(problems)

    def paths(self, name: str) -> tuple[str, ...]:
        """The paths that a parameter stands for; any other name stands for itself."""
        paths = self.parameters.get(name, name)
        return (paths,) if isinstance(paths, str) else tuple(paths)

    def locate(self, name: str) -> list[Any]:
        """The present values at a path or parameter; None for a key that only has a default.

        Raises:
            InputError: if it leads nowhere.
        """
        found = []
        for path in changed(Source(self._source.values), self.parameters, {name: None}).origins:
            here: Any = self._source.values
            for key in path:
                here = here.get(key) if isinstance(here, dict) else here[key]
                if here is None:
                    break
            found.append(here)
        return found


def changed(source: Source, parameters: Mapping[str, str | list[str]], changes: Mapping[str, Any]) -> Source:
    """The values of a scenario with changes by path, or by a short name from its parameters.

    What is not on the way to a changed value is shared, not copied.

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
