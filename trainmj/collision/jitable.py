"""Marks on functions that are compiled, and what these have in place of Python's own pointers.

Python calls all of them as they stand. The marks are notes only: :mod:`trainmj.collision.compiler` hands them to numba
when a law is not on disk, because importing numba takes longer than most collisions.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


class Noted(NamedTuple):
    """A function that compiled code may call."""

    function: Callable[..., Any]
    inlined: bool = False  # always
    apart: bool = False  # never inlined


NOTED: list[Noted] = []
"""Functions that the compiler has not been told of yet."""


def jitable(function: F) -> F:
    """Let compiled code call a function."""
    NOTED.append(Noted(function))
    return function


def inlined(function: F) -> F:
    """The same, for the few functions that each step goes through: they become a part of their caller."""
    NOTED.append(Noted(function, inlined=True))
    return function


def apart(function: F) -> F:
    """The same, for a function that must not become a part of its caller, which would lose its registers to it.

    It takes a block, and numbers; it returns a float.
    """
    NOTED.append(Noted(function, apart=True))
    return function


def stored_at(base: int, offset: int) -> Any:
    """Pointer to floats that is stored at base + offset."""
    return ctypes.POINTER(ctypes.c_double).from_address(base + offset)


def place_at(base: int, offset: int) -> Any:
    """Pointer to floats at base + offset itself."""
    return ctypes.cast(base + offset, ctypes.POINTER(ctypes.c_double))


def integer_at(base: int, offset: int) -> int:
    """The 64-bit integer at base + offset."""
    return ctypes.c_int64.from_address(base + offset).value


def from_place(values: Any, place: int) -> Any:
    """Pointer to the floats from a place of others on."""
    return place_at(ctypes.addressof(values.contents), 8 * place)
