"""Arrays, names and options as they enter this package: checked once, here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trainmj.errors import InputError

FloatArray = NDArray[np.float64]

ROUND_OFF = 1e-12  # part of the largest value by which equal values may differ


def as_matrix(name: str, value: ArrayLike, columns: int | None = None, *, finite: bool = True) -> FloatArray:
    """Copy anything that numpy takes into floats (n, columns), n >= 1; a vector becomes one column.

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


def as_vector(name: str, value: ArrayLike, size: int | None = None, each: str = "point") -> FloatArray:
    """Copy (n,) or (n, 1) into finite floats (n,), one for each point, or for each of something else.

    Raises:
        InputError: as for `as_matrix`, or of the wrong length.
    """
    vector = as_matrix(name, value, 1)[:, 0]
    if size is not None and vector.size != size:
        raise InputError(f"{name} must have {size} values, one for each {each} (got {vector.size})")
    return vector


def varies(x: FloatArray) -> NDArray[np.bool_]:
    """Whether each column (n, m), or a vector (n,), varies by more than round-off, (m,) or a scalar."""
    return np.asarray(np.ptp(x, axis=0) > ROUND_OFF * np.abs(x).max(axis=0))


def as_names(name: str, names: Sequence[str] | None, count: int, stem: str) -> tuple[str, ...]:
    """Names of ``count`` columns; stem1, stem2, ... if None.

    Raises:
        InputError: wrong number of names, or a name that occurs twice.
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


def check_choice(name: str, value: str, options: Sequence[str]) -> None:
    """Raise InputError if a value is not one of the options."""
    if value not in options:
        raise InputError(f"{name} must be {', '.join(map(repr, options[:-1]))} or {options[-1]!r} (got {value!r})")


def check_level(level: float) -> None:
    """Raise InputError if a confidence level is outside (0, 1)."""
    if not 0 < level < 1:
        raise InputError(f"level must lie between 0 and 1 (got {level})")


def frozen(array: FloatArray) -> FloatArray:
    """Make an array read-only, to be kept in a result."""
    array.setflags(write=False)
    return array
