"""Compute the cases that a store lacks and keep each as it ends."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from trainmj.cases.engine import Engine
from trainmj.cases.rows import Row, Rows
from trainmj.cases.store import Store
from trainmj.collision.cases import Cases
from trainmj.collision.interrupts import held_back
from trainmj.collision.status import UNUSABLE
from trainmj.doe.arrays import FloatArray

COMMIT_EVERY = 0.5
"""Longest time that finished cases wait to be written [s]."""

_MOST_WAITING = 2000  # cases in one transaction


def fill(
    store: Store,
    engine: Callable[[Iterable[Cases]], Iterator[Rows]],
    cases: Iterable[Cases],
    keep: Callable[[Rows], Rows],
    progress: Callable[[int], None],
) -> None:
    """Compute cases and write what is kept of them as they end, also when something stops the work.

    Cases are taken as they are needed. Progress is the number of cases written so far.
    """
    waiting: list[Rows] = []
    written, finished, n = time.monotonic(), 0, 0

    def write() -> None:
        nonlocal waiting, written, finished, n
        with held_back():  # what is written is not written again where a Ctrl-C comes
            if waiting:
                store.add(waiting)
            finished += n
            waiting, written, n = [], time.monotonic(), 0
        progress(finished)

    try:
        for rows in engine(cases):
            waiting.append(keep(rows))
            n += len(rows)
            if n >= _MOST_WAITING or time.monotonic() - written > COMMIT_EVERY:
                write()
    finally:
        write()


def rows_of(
    store: Store,
    engine: Engine,
    cases: Iterable[Cases],
    keep: Callable[[Rows], Rows] = lambda rows: rows,
    progress: Callable[[int], None] = lambda finished: None,
) -> dict[Any, Row]:
    """The rows of cases by key, as the store keeps them; those that it lacks are computed first, each once."""
    cases = list(cases)
    found = store.read(key for some in cases for key in some.keys)
    known, missing = set(found), []
    for some in cases:
        places = {key: place for place, key in enumerate(some.keys) if key not in known}
        known |= places.keys()
        missing += [some.take(list(places.values()))] if places else []
    if missing:
        fill(store, engine, missing, keep, progress)
        found |= store.read(key for some in missing for key in some.keys)
    return found


def numbers_of(rows: Sequence[Row], column: str) -> FloatArray:
    """A column of rows, (n,); nan where a case has no number that may be used."""
    found = [np.nan if row["status"] in UNUSABLE else row.get(column, np.nan) for row in rows]
    return np.array(found, dtype=np.float64)


def onwards(progress: Callable[[int], None], before: int) -> Callable[[int], None]:
    """Progress for :func:`fill` that counts on from a number of cases that were there before."""
    return lambda finished: progress(before + finished)
