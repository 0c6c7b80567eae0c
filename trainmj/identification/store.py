"""Trials in one SQLite file, which survives whatever stops the process that writes it."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np

from trainmj.collision.device import Array
from trainmj.errors import InputError, OutputError

FILE = "trials.sqlite"


class TrialStore:
    """The file of one identification, held by one process at a time.

    Args:
        file: made if it is not there.

    Raises:
        OutputError: if the file cannot be opened, is damaged, or another process is writing to it.
    """

    def __init__(self, file: Path) -> None:
        """Open or make the file and hold it."""
        self.file = file
        try:
            self._db = sqlite3.connect(file, timeout=1.0, isolation_level=None)
            self._db.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._db.execute("PRAGMA synchronous = NORMAL")
            self._db.execute("BEGIN EXCLUSIVE")
            self._db.execute("CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT)")
            self._db.execute("CREATE TABLE IF NOT EXISTS trials (key TEXT PRIMARY KEY, responses BLOB) WITHOUT ROWID")
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            raise self._trouble(error) from None

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._db.close()

    def agree(self, about: Mapping[str, str]) -> None:
        """See that the trials in the file are of this scenario and these versions; say so in a new file.

        Raises:
            InputError: naming what has changed.
        """
        there = dict(self._db.execute("SELECT key, value FROM about"))
        if not there:
            self._write("INSERT INTO about VALUES (?, ?)", list(about.items()))
        for key, value in about.items() if there else ():
            if there.get(key) != value:
                was = f": {there.get(key)} then, {value} now" if len(value) < 40 else ""
                raise InputError(
                    f"{self.file}: {key} has changed since these trials were computed{was}; take another folder"
                )

    def get(self, key: str, shape: tuple[int, int]) -> Array | None:
        """The responses of a trial; None if it is not there."""
        row = self._db.execute("SELECT responses FROM trials WHERE key = ?", (key,)).fetchone()
        if row is None or len(row[0]) != 8 * shape[0] * shape[1]:
            return None
        return np.frombuffer(row[0], dtype="<f8").reshape(shape).astype(float)

    def add(self, trials: Mapping[str, Array]) -> None:
        """Add trials in one transaction.

        Raises:
            OutputError: if they cannot be written; none of them is in the file then.
        """
        rows = [(key, np.ascontiguousarray(found, dtype="<f8").tobytes()) for key, found in trials.items()]
        self._write("INSERT OR REPLACE INTO trials VALUES (?, ?)", rows)

    def __len__(self) -> int:
        """How many trials there are."""
        return int(self._db.execute("SELECT count(*) FROM trials").fetchone()[0])

    def _write(self, statement: str, rows: list[tuple[str, bytes]] | list[tuple[str, str]]) -> None:
        try:
            self._db.execute("BEGIN IMMEDIATE")
            self._db.executemany(statement, rows)
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise self._trouble(error) from None

    def _trouble(self, error: sqlite3.Error) -> OutputError:
        text = str(error)
        if "locked" in text:
            return OutputError(f"{self.file}: another process is writing to this file: wait, or take another folder")
        if "full" in text:
            return OutputError(f"{self.file}: the disk is full; trials are kept: make room and go on with --resume")
        if "not a database" in text or "malformed" in text:
            return OutputError(f"{self.file}: is damaged or no SQLite file ({text}): take another folder")
        return OutputError(f"{self.file}: cannot be written ({text}); trials are kept")
