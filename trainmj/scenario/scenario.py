"""A whole scenario: checked, frozen, and varied by copies."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any, Self

from pydantic import PrivateAttr

from trainmj.errors import InputError
from trainmj.files.source import Problem, Source
from trainmj.scenario.parts import Parts
from trainmj.scenario.paths import changed, find
from trainmj.scenario.rules import broken_rules


class Scenario(Parts):
    """A scenario whose names all exist and whose values can all be simulated."""

    _source: Source = PrivateAttr(default=Source({}))

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

    def refusal(self, problems: Iterable[Problem]) -> InputError:
        """The error that lists what is found wrong in this scenario later, with the place of each value."""
        return self._source.refusal(problems)

    def paths(self, name: str) -> tuple[str, ...]:
        """The paths that a parameter stands for; any other name stands for itself."""
        paths = self.parameters.get(name, name)
        return (paths,) if isinstance(paths, str) else tuple(paths)

    def locate(self, name: str) -> list[Any]:
        """The present values at a path or parameter; None for a key that only has a default.

        Raises:
            InputError: if it leads nowhere.
        """
        return find(self._source.values, self.parameters, name)
