"""NetCDF 3 files, byte for byte as xarray writes them by way of scipy, whose imports take longer than a collision.

They are read here, too: a file may come from anyone, and takes no more memory than it has bytes, whatever it claims.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Variable = tuple[str | tuple[str, ...], Any, Mapping[str, Any]]
"""Dimensions, values and attributes, as xarray takes them."""

_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12
_KINDS = {"b": 1, "S": 2, "i": 4, "f": 6}  # bytes, characters, 4-byte integers, 8-byte floats
_STORED = {"b": ">i1", "S": "S1", "i": ">i4", "f": ">f8"}
_TYPES = {1: ">i1", 2: "S1", 3: ">i2", 4: ">i4", 5: ">f4", 6: ">f8"}
_MOST = 1000  # dimensions, variables or attributes: each becomes an object
_LONGEST_NAME = 1000  # bytes


@dataclass(frozen=True)
class Stored:
    """Values in a file that is being read; they are decoded when they are asked for.

    Attributes:
        shape: of the values; of an attribute, how many.
        type: of each, as numpy calls it.
    """

    shape: tuple[int, ...]
    type: np.dtype[Any]
    _content: memoryview
    _at: int

    @property
    def is_number(self) -> bool:
        """Whether they are numbers, and not characters."""
        return self.type.kind != "S"

    def values(self) -> npt.NDArray[Any]:
        """The values, of that shape: a view of the file, which cannot be changed.

        Raises:
            ValueError: if the file does not have so many.
        """
        count = math.prod(self.shape)
        if self._at + count * self.type.itemsize > len(self._content):
            raise ValueError("claims more than it holds")
        return np.frombuffer(self._content, self.type, count, self._at).reshape(self.shape)

    def value(self) -> Any:
        """What they are as an attribute: a text, or one number.

        Raises:
            ValueError: if they are neither.
        """
        return self.values().item() if self.is_number else self.values().tobytes().decode()


def unpacked(content: bytes) -> tuple[dict[str, Stored], dict[str, Stored]]:
    """The attributes and the variables of a file by name, none of them decoded yet.

    Raises:
        ValueError: if its head is not that of a NetCDF 3 file without a growing dimension, or it claims too much.
    """
    return _Head(content).read()


class _Head:
    """What a file says of itself, read from its beginning to where the values are."""

    def __init__(self, content: bytes) -> None:
        self._content, self._at = memoryview(content), 4
        if content[:4] not in (b"CDF\1", b"CDF\2"):
            raise ValueError("is of another format")
        self._place = 8 if content[3] == 2 else 4  # bytes of the place of a variable

    def read(self) -> tuple[dict[str, Stored], dict[str, Stored]]:
        """The attributes of the file, and its variables."""
        if self._integer():
            raise ValueError("has a growing dimension")
        sizes = [self._integer() for _ in self._names(_DIMENSIONS)]
        attributes = {name: self._attribute() for name in self._names(_ATTRIBUTES)}
        return attributes, {name: self._variable(sizes) for name in self._names(_VARIABLES)}

    def _variable(self, sizes: list[int]) -> Stored:
        over = [self._integer() for _ in range(self._bounded(self._integer()))]
        if any(dimension >= len(sizes) for dimension in over):
            raise ValueError("names a dimension that it has not")
        for _ in self._names(_ATTRIBUTES):
            self._attribute()
        type_ = self._type()
        self._integer()  # the bytes that it takes follow from its shape
        place = int.from_bytes(self._bytes(self._place), "big")
        return Stored(tuple(sizes[dimension] for dimension in over), type_, self._content, place)

    def _attribute(self) -> Stored:
        type_, count = self._type(), self._integer()
        found = Stored((count,), type_, self._content, self._at)
        self._bytes(count * type_.itemsize)
        self._fill()
        return found

    def _names(self, kind: int) -> Iterator[str]:
        """The names in a list; what belongs to each is read before the next one."""
        tag, count = self._integer(), self._bounded(self._integer())
        if tag != (kind if count else 0):
            raise ValueError("has something else in the place of a list")
        known: set[str] = set()
        for _ in range(count):
            length = self._integer()
            if length > _LONGEST_NAME:
                raise ValueError("has a name that is too long")
            name = bytes(self._bytes(length)).decode()
            self._fill()
            if name in known:
                raise ValueError("has a name twice")
            known.add(name)
            yield name

    def _bounded(self, count: int) -> int:
        if count > _MOST:
            raise ValueError("has too many entries")
        return count

    def _type(self) -> np.dtype[Any]:
        code = self._integer()
        if code not in _TYPES:
            raise ValueError("has values of no known type")
        return np.dtype(_TYPES[code])

    def _integer(self) -> int:
        return int.from_bytes(self._bytes(4), "big")

    def _fill(self) -> None:
        self._bytes(-self._at % 4)

    def _bytes(self, count: int) -> memoryview:
        if self._at + count > len(self._content):
            raise ValueError("claims more than it holds")
        self._at += count
        return self._content[self._at - count : self._at]


def packed(variables: Mapping[str, Variable], attributes: Mapping[str, Any]) -> bytes:
    """The bytes of a file.

    Args:
        variables: by name; values are floats, texts, or truth.
        attributes: of the file: texts, floats and integers.
    """
    sizes: dict[str, int] = {}
    found = {name: _stored(*variable) for name, variable in variables.items()}
    for over, values, _ in found.values():
        sizes |= dict(zip(over, values.shape, strict=True))
    ordered = sorted(found, key=lambda name: found[name][1].shape, reverse=True)
    places = {dimension: n for n, dimension in enumerate(sizes)}
    heads, data = [], [_padded(found[name][1].tobytes(), _fill(found[name][1])) for name in ordered]
    for name, content in zip(ordered, data, strict=True):
        over, values, about = found[name]
        heads.append(
            _text(name)
            + _integers(len(over), *(places[dimension] for dimension in over))
            + _listed(_ATTRIBUTES, (_text(key) + _attribute(value) for key, value in about.items()))
            + _integers(_KINDS[_kind(values)], len(content))
        )
    before = (
        b"CDF\2"  # with 8-byte places
        + _integers(0)
        + _listed(_DIMENSIONS, (_text(name) + _integers(size) for name, size in sizes.items()))
        + _listed(_ATTRIBUTES, (_text(key) + _attribute(value) for key, value in attributes.items()))
    )
    at = len(before) + 8 + sum(len(head) + 8 for head in heads)
    for n, content in enumerate(data):
        heads[n] += at.to_bytes(8, "big")
        at += len(content)
    return b"".join([before, _listed(_VARIABLES, heads), *data])


def _stored(
    over: str | tuple[str, ...], values: Any, about: Mapping[str, Any]
) -> tuple[tuple[str, ...], npt.NDArray[Any], dict[str, Any]]:
    """A variable as the file has it: texts as characters, truth as bytes."""
    array, over = np.asarray(values), (over,) if isinstance(over, str) else tuple(over)
    if array.dtype.kind == "U":
        encoded = np.char.encode(array, "utf-8")
        length = encoded.dtype.itemsize
        return (*over, f"string{length}"), encoded.view("S1").reshape(*array.shape, length), {"_Encoding": "utf-8"}
    if array.dtype.kind == "b":
        return over, array.astype(">i1"), {**about, "dtype": "bool"}
    return over, array.astype(">f8"), {**about, "_FillValue": np.nan}


def _kind(values: npt.NDArray[Any]) -> str:
    return "b" if values.dtype.itemsize == 1 and values.dtype.kind == "i" else values.dtype.kind


def _fill(values: npt.NDArray[Any]) -> bytes:
    """What fills up the last 4 bytes."""
    return b"\x81" if _kind(values) == "b" else b"\0"


def _attribute(value: Any) -> bytes:
    if isinstance(value, str):
        content = value.encode()
        return _integers(_KINDS["S"], len(content)) + _padded(content)
    kind = "i" if isinstance(value, int) else "f"
    return _integers(_KINDS[kind], 1) + np.array(value, dtype=_STORED[kind]).tobytes()


def _text(value: str) -> bytes:
    content = value.encode()
    return _integers(len(content)) + _padded(content)


def _listed(kind: int, items: Iterable[bytes]) -> bytes:
    found = list(items)
    return (_integers(kind, len(found)) if found else _integers(0, 0)) + b"".join(found)


def _integers(*values: int) -> bytes:
    return b"".join(value.to_bytes(4, "big") for value in values)


def _padded(content: bytes, fill: bytes = b"\0") -> bytes:
    return content + fill * (-len(content) % 4)
