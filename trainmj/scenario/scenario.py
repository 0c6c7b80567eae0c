"""A whole scenario: checked, frozen, and varied by copies."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any, Self

from pydantic import PrivateAttr

from trainmj.errors import InputError
from trainmj.files.problems import Origins, Problem, refuse, validated
from trainmj.scenario.parts import Parts
from trainmj.scenario.paths import changed, find
from trainmj.scenario.rules import broken_rules


class Scenario(Parts):
    """A scenario of which every name exists and every value can be simulated."""

    _values: dict[str, Any] = PrivateAttr(default_factory=dict)
    _origins: Origins = PrivateAttr(default_factory=dict)

    @classmethod
    def from_values(cls, values: Mapping[str, Any], origins: Origins | None = None) -> Self:
        """Check plain values, as a YAML file gives them, and make the scenario.

        Args:
            values: nested dicts, lists, strings and numbers, keys as in a scenario file.
            origins: where each value comes from, for messages.

        Raises:
            InputError: listing every key, value and rule that is broken.
        """
        origins = origins or {}
        scenario = validated(cls, values, origins)
        problems = list(islice(broken_rules(scenario), 100))  # more are not said, and may take long to find
        if problems:
            raise refuse(problems, values, origins)
        scenario._values = dict(values)
        scenario._origins = origins
        return scenario

    def values(self) -> dict[str, Any]:
        """The plain values this scenario was made from; a copy."""
        return copy.deepcopy(self._values)

    def with_values(self, changes: Mapping[str, Any]) -> Self:
        """A copy with some values changed.

        Args:
            changes: new values by path (``"devices.front.stiffness_kN_per_mm"``) or parameter (``"mass_t"``).

        Raises:
            InputError: if a path leads nowhere or the changed scenario breaks a rule.
        """
        values, origins = changed(self._values, self._origins, self.parameters, changes)
        return type(self).from_values(values, origins)

    def refusal(self, problems: Iterable[Problem]) -> InputError:
        """The error that lists what is found wrong in this scenario later, with the place of each value."""
        return refuse(problems, self._values, self._origins)

    def paths(self, name: str) -> tuple[str, ...]:
        """The paths that a parameter stands for; any other name stands for itself."""
        paths = self.parameters.get(name, name)
        return (paths,) if isinstance(paths, str) else tuple(paths)

    def locate(self, name: str) -> list[Any]:
        """The values that a path or parameter stands for now; None for a key that only has a default.

        Raises:
            InputError: if it leads nowhere.
        """
        return find(self._values, self.parameters, name)
