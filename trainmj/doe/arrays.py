"""The arrays that the study modules exchange: checked once, at the door."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trainmj.errors import InputError

FloatArray = NDArray[np.float64]


def as_matrix(name: str, value: ArrayLike, columns: int | None = None, *, finite: bool = True) -> FloatArray:
    """Give ``value`` as a float matrix, or say what is wrong with it.

    Args:
        name: what the message calls it.
        value: anything numpy can turn into an array; a vector becomes one column.
        columns: how many columns it must have; any if None.
        finite: refuse nan and inf.

    Returns:
        (n, columns), n >= 1, a copy.

    Raises:
        InputError: not numeric, not two-dimensional, empty, of the wrong width, or not finite.
    """
    try:
        matrix = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers in rows of equal length ({error})") from error
    if matrix.ndim == 1:
        matrix = matrix[:, None]
    if matrix.ndim != 2 or matrix.size == 0:
        raise InputError(f"{name} must be a non-empty matrix (points, columns) (got shape {matrix.shape})")
    if columns is not None and matrix.shape[1] != columns:
        raise InputError(f"{name} must have {columns} columns (got {matrix.shape[1]})")
    if finite and not np.isfinite(matrix).all():
        rows = np.flatnonzero(~np.isfinite(matrix).all(axis=1))
        raise InputError(
            f"{name} must be finite (rows {rows[:5].tolist()} hold nan or inf; drop or repeat these {rows.size} points)"
        )
    return matrix


def as_vector(name: str, value: ArrayLike, size: int | None = None) -> FloatArray:
    """Give ``value`` as a float vector of finite numbers.

    Args:
        name: what the message calls it.
        value: (n,) or (n, 1).
        size: how many values it must have; any if None.

    Returns:
        (n,), a copy.

    Raises:
        InputError: as for `as_matrix`, or of the wrong length.
    """
    vector = as_matrix(name, value, 1)[:, 0]
    if size is not None and vector.size != size:
        raise InputError(f"{name} must have {size} values, one for each point (got {vector.size})")
    return vector


def as_names(name: str, names: Sequence[str] | None, count: int, stem: str) -> tuple[str, ...]:
    """Give the names of ``count`` columns, made up as stem1, stem2, ... if None.

    Raises:
        InputError: wrong number of names, or one name twice.
    """
    if names is None:
        return tuple(f"{stem}{i + 1}" for i in range(count))
    if isinstance(names, str):
        names = (names,)
    if len(names) != count:
        raise InputError(f"{name} must name each of the {count} columns once (got {len(names)}: {list(names)})")
    if len(set(names)) != count:
        twice = sorted({n for n in names if list(names).count(n) > 1})
        raise InputError(f"{name} must differ from each other (twice: {twice})")
    return tuple(names)


def frozen(array: FloatArray) -> FloatArray:
    """Give the array back read-only, for keeping in a result."""
    array.setflags(write=False)
    return array
