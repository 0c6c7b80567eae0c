"""Sums and comparisons of many cases at once, with the bits that one case has by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trainmj.collision.envelope import Array, IntArray


def total(values: Array) -> Array:
    """(...) sums of (..., n) along the last axis, each as NumPy adds an array of that length."""
    return np.asarray(np.ascontiguousarray(values).sum(axis=-1))


def added(values: Array) -> Array:
    """(...) sums of (..., n) along the last axis, each as Python adds a list of that length."""
    n = values.shape[-1]
    if n <= 2:  # where no order and no compensation matters
        return np.asarray(sum((values[..., k] for k in range(n)), np.zeros(values.shape[:-1])))
    sums = [sum(row) for row in values.reshape(-1, n).tolist()]
    return np.array(sums, dtype=np.float64).reshape(values.shape[:-1])


def positive(values: Any) -> Array:
    """Values, and 0 where they are less or not a number, as ``max(0.0, value)`` has it."""
    return np.where(values > 0.0, values, 0.0)


def lesser(values: Any, others: Any) -> Array:
    """The lesser of two, and of one that is not a number the first one, as ``min(value, other)`` has it."""
    return np.asarray(np.where(others < values, others, values))


def picked(values: Array, places: Sequence[int] | IntArray) -> Array:
    """(..., k) the values (..., n) at some places of the last axis, side by side in memory."""
    return np.asarray(values.take(places, axis=-1))


def in_rows(values: Array, rows: Sequence[Sequence[int]], fill: float) -> Array:
    """(n_case, n_row, most) the values (n_case, n) at the places of each row, and behind a shorter one a filling."""
    most = max(map(len, rows), default=0)
    end = values.shape[-1]
    padded = np.append(values, np.full((len(values), 1), fill), axis=-1)
    places = [[*row, *[end] * (most - len(row))] for row in rows]
    return np.asarray(padded.take(np.array(places, dtype=int).reshape(len(rows), most), axis=-1))
