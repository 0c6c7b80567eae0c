"""Cases of one structure, prepared and measured together: what differs between them is arrays over the cases.

Two chains are of one structure where they differ in numbers only: as many vehicles, interfaces, elements and points of
curves, the same kinds of laws, names and options.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import cache
from types import NoneType
from typing import Any, Protocol, Self

import numpy as np

from trainmj.collision.block import Layout
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.kind import Kind


class Lot(Protocol):
    """Cases of one structure.

    Attributes:
        keys: what the caller calls each case.
        chain: of one of the structure, which need not be one of them: what is no number in it, and its step and time
            limit, hold for every case.
    """

    keys: Sequence[Any]
    chain: Chain

    def __len__(self) -> int:
        """How many cases there are."""

    def values(self, of: Callable[[Chain], Any]) -> Array:
        """(n_case, ...) a number, or an array of numbers, of every case: ``lot.values(lambda chain: chain.mass)``."""

    def blocks(self, layout: Layout) -> Array:
        """(n_case, size) the block of each case before its first step."""

    def chain_of(self, place: int) -> Chain:
        """The chain of one case."""

    def take(self, places: Sequence[int]) -> Self:
        """Some of the cases, in this order."""


class Chains:
    """A lot made of chains: every number is asked of each of them."""

    def __init__(self, keys: Sequence[Any], chains: Sequence[Chain]) -> None:
        """Take the chain of each key."""
        self.keys, self.chain, self._chains = keys, chains[0], chains

    def __len__(self) -> int:
        """How many cases there are."""
        return len(self._chains)

    def values(self, of: Callable[[Chain], Any]) -> Array:
        """(n_case, ...) a number, or an array of numbers, of every case."""
        return np.array([of(chain) for chain in self._chains], dtype=np.float64)

    def blocks(self, layout: Layout) -> Array:
        """(n_case, size) the block of each case before its first step."""
        return self.values(layout.block)

    def chain_of(self, place: int) -> Chain:
        """The chain of one case."""
        return self._chains[place]

    def take(self, places: Sequence[int]) -> Chains:
        """Some of the cases, in this order."""
        return Chains([self.keys[i] for i in places], [self._chains[i] for i in places])


def structure_of(chain: Chain) -> Hashable:
    """What is the same for all chains of one structure: all but numbers.

    Step and time limit count as well, and free flights, by which responses are called.
    """
    return chain.step, chain.time_limit, chain.free_flights, _structure(chain, {}, numbers=False)


def contents_of(chain: Chain) -> Hashable:
    """All that a collision follows from: chains of which it is the same have the same numbers.

    Where values come from, and whether some act in the vertical plane only, is not among it.
    """
    return _structure(replace(chain, sources={}, flattened=False), {}, numbers=True)


def _structure(thing: Any, known: dict[int, Hashable], numbers: bool) -> Hashable:
    """The same of a part of a chain, with its numbers or without.

    Known are parts that have been seen, which several others may have.
    """
    if isinstance(thing, float):
        return thing if numbers else "number" if math.isfinite(thing) else str(thing)
    if isinstance(thing, str | int | NoneType):
        return thing
    if isinstance(thing, tuple):
        return tuple([_structure(part, known, numbers) for part in thing])
    if isinstance(thing, np.ndarray):
        return ("array", *thing.shape, thing.tobytes() if numbers else b"")
    if isinstance(thing, Kind):
        return thing.name
    if is_dataclass(thing):
        if id(thing) not in known:
            kind: Any = type(thing)
            known[id(thing)] = tuple([_structure(getattr(thing, name), known, numbers) for name in _names(kind)])
        return known[id(thing)]
    if isinstance(thing, Mapping):
        return tuple((key, _structure(part, known, numbers)) for key, part in thing.items())
    assert callable(thing)  # there is nothing else in a chain; what it gives, elements have
    return "function"


@cache
def _names(kind: Any) -> tuple[str, ...]:
    """Of the fields of a dataclass."""
    return tuple(field.name for field in fields(kind))
