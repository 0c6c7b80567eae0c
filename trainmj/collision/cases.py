"""What each of many cases changes in a scenario, by column: what can be done for all of them is not done for each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

Case = Mapping[str, Any]
"""New values by parameter or path."""

Name = tuple[str | int, ...]
"""A parameter or path, then the way from there into its value: keys, and places in lists from 0 on."""

AT_ONCE = 1024
"""Most cases that are put together."""


@dataclass(frozen=True, eq=False)
class Cases:
    """Cases that change the same values of a scenario.

    Attributes:
        keys: what the caller calls each of them, (n,).
        names: of the values that they change.
        values: those of each name (n,), as an array of numbers or a list.
    """

    keys: Sequence[Any]
    names: Sequence[Name]
    values: Sequence[Sequence[Any] | np.ndarray]

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self.keys)

    def __iter__(self) -> Iterator[Case]:
        """The changes of each case."""
        return map(self.__getitem__, range(len(self)))

    def __getitem__(self, place: int) -> Case:
        """The changes of one case, as :meth:`trainmj.Scenario.with_values` takes them."""
        values = (column[place] for column in self.values)
        plain = (value.item() if isinstance(value, np.generic) else value for value in values)
        return _grouped(zip(self.names, plain, strict=True))

    def take(self, places: Sequence[int]) -> Cases:
        """Some of the cases, in this order."""
        values = [v[places] if isinstance(v, np.ndarray) else [v[n] for n in places] for v in self.values]
        return Cases([self.keys[n] for n in places], self.names, values)


def gathered(cases: Iterable[tuple[Any, Case]]) -> Iterator[Cases]:
    """Cases that come one by one, each a key and its changes, put together where they change the same values.

    That is so many at a time: those of a trial may change other values each, and those of the next one these again.
    """
    source = iter(cases)
    while some := list(islice(source, AT_ONCE)):
        alike: dict[tuple[str, ...], list[tuple[Any, Case]]] = {}
        for key, changes in some:
            alike.setdefault(tuple(changes), []).append((key, changes))
        for names, same in alike.items():
            values = [[changes[name] for _, changes in same] for name in names]
            yield Cases([key for key, _ in same], [(name,) for name in names], values)


def _grouped(values: Iterable[tuple[Name, Any]]) -> dict[Any, Any]:
    """Values by the first part of their names, those with more parts in dicts and lists."""
    found: dict[Any, Any] = {}
    deeper: dict[Any, list[tuple[Name, Any]]] = {}
    for (first, *rest), value in values:
        if rest:
            deeper.setdefault(first, []).append((tuple(rest), value))
            found[first] = deeper[first]  # holds its place
        else:
            found[first] = value
    for first, inner in deeper.items():
        made = _grouped(inner)
        found[first] = list(made.values()) if isinstance(inner[0][0][0], int) else made
    return found
