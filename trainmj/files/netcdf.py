"""NetCDF 3 files, byte for byte as xarray writes them by way of scipy, whose imports take longer than a collision."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Variable = tuple[str | tuple[str, ...], Any, Mapping[str, Any]]
"""Dimensions, values and attributes, as xarray takes them."""

_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12
_KINDS = {"b": 1, "S": 2, "i": 4, "f": 6}  # bytes, characters, 4-byte integers, 8-byte floats
_STORED = {"b": ">i1", "S": "S1", "i": ">i4", "f": ">f8"}


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
