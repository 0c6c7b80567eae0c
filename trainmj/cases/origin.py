"""What finished cases were computed from, and how that differs from now."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from trainmj.collision import identity
from trainmj.errors import InputError
from trainmj.files.text import from_json, printable
from trainmj.files.yaml import parse
from trainmj.scenario import Scenario, to_yaml
from trainmj.scenario.scenario import without_words

_FORMAT = "format"
_VERSION = "version_"
_SCENARIO = "scenario"
_MOST_SAID = 4  # differences in one message
_LONGEST = 60  # characters of a value in a message


@dataclass(frozen=True)
class Origin:
    """What the numbers of a folder depend on; if all of it is the same, they may be used again.

    Attributes:
        task: what computes them, such as sweep.
        scenario: what the cases vary; of load cases, the scenarios by name.
        inputs: what else they depend on, as JSON can hold it; a mapping is compared key by key.
        identity: the code, packages and machine that compute them.
    """

    task: str
    scenario: Scenario | Mapping[str, Scenario]
    inputs: Mapping[str, Any] = field(default_factory=dict)
    identity: Mapping[str, str] = field(default_factory=identity.identity)

    @property
    def _format(self) -> str:
        return f"trainmj {self.task} 2"

    def about(self) -> dict[str, str]:
        """As a store keeps it."""
        return {
            _FORMAT: self._format,
            **{name: to_yaml(scenario) for name, scenario in self._scenarios().items()},
            **{name: json.dumps(value, default=str) for name, value in self.inputs.items()},
            **{f"{_VERSION}{name}": text for name, text in self.identity.items()},
        }

    def _scenarios(self) -> dict[str, Scenario]:
        """The scenarios by the names under which a store keeps them."""
        named = {"": self.scenario} if isinstance(self.scenario, Scenario) else self.scenario
        return {scenario_of(name): scenario for name, scenario in named.items()}

    def new_identity(self, about: Mapping[str, str]) -> list[str]:
        """What has changed in the identity: ``numba 0.60.0 then, 0.61.2 now``; or in what the store is made for."""
        formats = _differences(about.get(_FORMAT), self._format, _FORMAT)
        return [*formats, *identity.changes(versions_in(about), self.identity)]

    def new_input(self, about: Mapping[str, str]) -> list[str]:
        """What has changed in the input: ``collision.speed_km_h 25 then, 30 now``.

        Words about a scenario may change.
        """
        now = self.about()
        found: list[str] = []
        for name, scenario in self._scenarios().items():
            case = name.removeprefix(_SCENARIO).replace("_", "cases.", 1)
            if name not in about:
                found.append(f"{case or name} not stated then")
            elif about[name] != now[name]:
                try:
                    then = without_words(parse(about[name], name).values)
                    found += _differences(then, scenario.counted(), case)
                except InputError as error:
                    found.append(f"the {error}, then")
        for name in self.inputs:
            then, here = stated(about, name), stated(now, name)
            both = isinstance(then, dict) and isinstance(here, dict)
            found += _differences(then, here, "" if both else name)
        return found


def scenario_of(case: str) -> str:
    """The name under which a store keeps the scenario of a load case, or of all cases: "" is no load case."""
    return f"{_SCENARIO}_{case}" if case else _SCENARIO


def versions_in(about: Mapping[str, str]) -> dict[str, str]:
    """The identity that a store states."""
    return {name.removeprefix(_VERSION): text for name, text in about.items() if name.startswith(_VERSION)}


def in_words(changes: list[str]) -> str:
    """The first changes in one line."""
    more = len(changes) - _MOST_SAID
    return "; ".join(changes[:_MOST_SAID]) + (f"; and {more} more" if more > 0 else "")


def _differences(then: Any, now: Any, path: str = "") -> Iterator[str]:
    """Where two nested values differ: ``curves.buffer.force_kN.1 250 then, 260 now``."""
    return (f"{place} {one} then, {other} now" for place, one, other in differing(then, now, path))


def differing(one: Any, other: Any, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Where two nested values differ: path, and both in words."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            yield from differing(one.get(key), other.get(key), f"{path}.{key}".removeprefix("."))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for n, pair in enumerate(zip(one, other, strict=True)):
            yield from differing(*pair, f"{path}.{n}")
    elif one != other:
        yield path, _said(one), _said(other)


def stated(about: Mapping[str, str], name: str) -> Any:
    """A value that a store states as JSON; None if it states none."""
    try:
        return from_json(about.get(name, "null"))
    except ValueError:
        return None


def _said(value: Any) -> str:
    if value is None:
        return "not stated"
    text = printable(value if isinstance(value, str) else json.dumps(value, default=str, ensure_ascii=False))
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
