"""Compute the cases that a store lacks and keep each as it ends."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from trainmj.cases.engine import Case, Computed, Engine, Key, Row
from trainmj.cases.store import Store
from trainmj.collision.quantities import Column
from trainmj.collision.status import UNUSABLE
from trainmj.doe.arrays import FloatArray

COMMIT_EVERY = 0.5
"""Longest time that finished cases wait to be written [s]."""

_MOST_WAITING = 500  # cases in one transaction


def fill(
    store: Store,
    engine: Callable[[Iterable[tuple[Any, Case]]], Iterator[Computed]],
    cases: Iterable[tuple[Any, Case]],
    keep: Callable[[Computed], Row],
    progress: Callable[[int], None],
) -> None:
    """Compute cases and write what is kept of each as they end, also when something stops the work.

    Cases, each a key and its changes, are taken as they are needed. Progress is the number of cases written so far.
    """
    waiting: list[tuple[Key, Row]] = []
    columns: dict[str, Column] = {}
    written, finished = time.monotonic(), 0

    def write() -> None:
        nonlocal waiting, written, finished
        if waiting:
            store.add(waiting, columns)
        finished += len(waiting)
        waiting, written = [], time.monotonic()
        progress(finished)

    try:
        for computed in engine(cases):
            waiting.append((computed.key, keep(computed)))
            columns.update(computed.columns)
            if len(waiting) == _MOST_WAITING or time.monotonic() - written > COMMIT_EVERY:
                write()
    finally:
        write()


def rows_of(
    store: Store,
    engine: Engine,
    cases: Mapping[Any, Case],
    keep: Callable[[Computed], Row],
    progress: Callable[[int], None] = lambda finished: None,
) -> dict[Any, Row]:
    """The rows of cases by key, as the store keeps them; those that it lacks are computed first."""
    found = store.read(cases)
    missing = {key: case for key, case in cases.items() if key not in found}
    if missing:
        fill(store, engine, missing.items(), keep, progress)
        found |= store.read(missing)
    return found


def numbers_of(rows: Sequence[Row], column: str) -> FloatArray:
    """A column of rows, (n,); nan where a case has no number that may be used."""
    found = [np.nan if row["status"] in UNUSABLE else row.get(column, np.nan) for row in rows]
    return np.array(found, dtype=np.float64)


def onwards(progress: Callable[[int], None], before: int) -> Callable[[int], None]:
    """Progress for :func:`fill` that counts on from a number of cases that were there before."""
    return lambda finished: progress(before + finished)
