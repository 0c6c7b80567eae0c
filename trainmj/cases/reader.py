"""Read what a sweep has stored, also while it is being written."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from trainmj.cases.store import CASE, FILE, about_in, connected, in_order, read_columns, responses_in, selected
from trainmj.collision.quantities import Column, Columns
from trainmj.errors import InputError, OutputError
from trainmj.files.arguments import path_given
from trainmj.files.folder import is_held
from trainmj.files.text import printable

if TYPE_CHECKING:
    import pandas as pd


def read_table(folder: str | Path) -> pd.DataFrame:
    """The results of a sweep, finished or not, a row for each case.

    Args:
        folder: where the sweep wrote, or is writing; or what run_sweep gave.

    Returns:
        The rows so far. ``table.attrs["columns"]`` says of each response by column name what it is: title, unit,
        meaning and so on, as a :class:`trainmj.collision.quantities.Column`.

    Raises:
        InputError: if there is no sweep, its file is damaged, or another process keeps it locked.
    """
    return read_sweep(path_given(folder))[0]


def read_sweep(
    folder: Path, wanted: Callable[[Column], bool] = lambda column: True
) -> tuple[pd.DataFrame, dict[str, str]]:
    """The table of a sweep as :func:`read_table` gives it, with the responses wanted, and what its store says of it."""
    import pandas as pd
    from pandas.errors import DatabaseError

    file = folder / FILE
    try:
        if not file.is_file():
            raise InputError(f"{folder}: has no {FILE}: it is not the folder of a sweep")
        with _reading(file) as db:
            db.execute("BEGIN")  # both from one moment
            about = about_in(db)
            known = read_columns(about, file)
            there = [name for _, name, *_ in db.execute("PRAGMA table_info(results)")]
            heads = [name for name in there if name not in known]
            columns = {name: known[name] for name in in_order(there, known) if name in known and wanted(known[name])}
            names = list(columns)
            every = {name: place for place, name in enumerate(name for name in there if name in known)}
            places = [every[name] for name in names]
            table = pd.read_sql(selected(heads, CASE), db, index_col=CASE)
            numbers, n = np.empty((len(table), len(names))), 0
            for found in responses_in(db, file):
                numbers[n : n + len(found)] = found[:, places]
                n += len(found)
    except (sqlite3.Error, DatabaseError, KeyError, TypeError, ValueError) as error:
        if folder.is_dir() and is_held(folder):
            raise InputError(f"{folder}: another trainmj is writing to this folder: try again in a moment") from None
        if isinstance(error, InputError):
            raise
        if "locked" in str(error):
            raise InputError(f"{file}: is being written by another process: try again in a moment") from None
        reason = printable(str(error)).splitlines()[-1:] or [type(error).__name__]
        raise InputError(f"{file}: is not the file of a sweep, or damaged ({reason[0]})") from None
    except OutputError as error:
        raise InputError(str(error)) from None
    table = pd.concat([table, pd.DataFrame(numbers, index=table.index, columns=names)], axis=1)
    table.attrs["columns"] = Columns(columns)
    return table, about


def read_about(file: Path) -> dict[str, str]:
    """What a store says of its cases; empty if there is no store, or a damaged one."""
    try:
        with _reading(file) as db:
            return about_in(db)
    except (sqlite3.Error, OutputError):
        return {}


_alone = Lock()
"""SQLite lets readers of one process in without a look at who waits to write: together they would keep a sweep out."""


@contextmanager
def _reading(file: Path) -> Iterator[sqlite3.Connection]:
    """A connection for reading; it may write, to take back what a killed process left half written."""
    with _alone, closing(connected(file, "rw")) as db:
        yield db
