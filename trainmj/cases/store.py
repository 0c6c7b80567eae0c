"""Results of a sweep in one SQLite file, which survives whatever stops the process that writes it.

Table ``results`` has a row for each finished case: its number, the values it changes, its responses, units in the
names. Table ``about`` has the scenario, versions, seed and fingerprint. A transaction is complete or absent.
"""

from __future__ import annotations

import csv
import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from trainmj.errors import InputError, OutputError
from trainmj.files.atomic import replacing

if TYPE_CHECKING:
    import pandas as pd

FILE = "results.sqlite"
CASE = "case"
_MOST_COLUMNS = 1990  # SQLite allows 2000


class Store:
    """The file of one sweep, held by one process at a time.

    Args:
        file: the SQLite file; made if it is not there.

    Raises:
        OutputError: if the file cannot be opened, is damaged, or another sweep is writing to it.
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
            self._db.execute(f'CREATE TABLE IF NOT EXISTS results ("{CASE}" INTEGER PRIMARY KEY)')
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            raise self._trouble(error) from None
        self._columns = self._read_columns()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._db.close()

    def about(self) -> dict[str, str]:
        """What the file says of its sweep; empty for a new one."""
        return dict(self._db.execute("SELECT key, value FROM about"))

    def describe(self, about: Mapping[str, str]) -> None:
        """State what the sweep is."""
        self._write([("INSERT OR REPLACE INTO about VALUES (?, ?)", list(about.items()))])

    def finished(self) -> set[int]:
        """Numbers of the cases that are in the file."""
        return {number for (number,) in self._db.execute(f'SELECT "{CASE}" FROM results')}

    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self._columns)

    def column(self, name: str) -> list[Any]:
        """All values of a column, in the order of the cases; empty if there is none of that name."""
        if name not in self._columns:
            return []
        return [value for (value,) in self._db.execute(f'SELECT {_quoted(name)} FROM results ORDER BY "{CASE}"')]

    def add(self, rows: Sequence[tuple[int, Mapping[str, Any]]]) -> None:
        """Add finished cases in one transaction.

        Raises:
            InputError: if they have more columns than SQLite can hold.
            OutputError: if they cannot be written; none of them is in the file then.
        """
        names = list(dict.fromkeys(name for _, row in rows for name in row))
        new = [name for name in names if name not in self._columns]
        if len(self._columns) + len(new) > _MOST_COLUMNS:
            raise InputError(
                f"the table would have {len(self._columns) + len(new)} columns and SQLite holds 2000: "
                "choose some with --responses, as in --responses 'TS_mm,TAMA_g,stroke_*'"
            )
        kinds = {name: value for _, row in reversed(rows) for name, value in row.items()}
        alter = [(f"ALTER TABLE results ADD COLUMN {_quoted(n)} {_kind(kinds[n])}", [()]) for n in new]
        marks = ", ".join("?" * (len(names) + 1))
        columns = ", ".join(map(_quoted, [CASE, *names]))
        values = [(number, *(_stored(row.get(name)) for name in names)) for number, row in rows]
        self._write([*alter, (f"INSERT INTO results ({columns}) VALUES ({marks})", values)])
        self._columns |= dict.fromkeys(new)

    def arrange(self, names: Sequence[str]) -> None:
        """Put the columns in a fixed order, whatever order the cases ended in.

        Args:
            names: all columns but the number of the case.
        """
        order = [CASE, *names]
        if order == self.columns():
            return
        kinds = {row[1]: row[2] for row in self._db.execute("PRAGMA table_info(results)")}
        made = ", ".join(f"{_quoted(n)} {kinds[n]}" + (" PRIMARY KEY" if n == CASE else "") for n in order)
        columns = ", ".join(map(_quoted, order))
        self._write(
            [
                (f"CREATE TABLE arranged ({made})", [()]),
                (f'INSERT INTO arranged SELECT {columns} FROM results ORDER BY "{CASE}"', [()]),
                ("DROP TABLE results", [()]),
                ("ALTER TABLE arranged RENAME TO results", [()]),
            ]
        )
        self._columns = self._read_columns()

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """The column names, then every row in the order of the cases."""
        cursor = self._db.execute(f'SELECT * FROM results ORDER BY "{CASE}"')
        yield tuple(column[0] for column in cursor.description)
        yield from cursor

    def write_csv(self, file: Path) -> None:
        """Write the table as CSV, row by row.

        Raises:
            OutputError: if the file cannot be written.
        """
        try:
            with replacing(file) as part, part.open("w", newline="", encoding="utf-8") as out:
                csv.writer(out).writerows(self.rows())
        except OutputError as error:
            raise OutputError(f"{error}; the results are in {self.file}") from None

    def _read_columns(self) -> dict[str, None]:
        return {row[1]: None for row in self._db.execute("PRAGMA table_info(results)")}

    def _write(self, statements: Sequence[tuple[str, Sequence[Any]]]) -> None:
        try:
            self._db.execute("BEGIN IMMEDIATE")
            for statement, values in statements:
                self._db.executemany(statement, values)
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise self._trouble(error) from None

    def _trouble(self, error: sqlite3.Error) -> OutputError:
        text = str(error)
        if "locked" in text:
            return OutputError(
                f"{self.file}: another sweep is writing to this file: wait for it, or take another folder"
            )
        if "full" in text:
            return OutputError(
                f"{self.file}: the disk is full; finished cases are kept: make room and go on with --resume"
            )
        if "not a database" in text or "malformed" in text:
            return OutputError(f"{self.file}: is damaged or no SQLite file ({text}): take another folder")
        return OutputError(f"{self.file}: cannot be written ({text}); finished cases are kept")


def read_table(folder: str | Path) -> pd.DataFrame:
    """The results of a sweep, finished or not, a row for each case.

    Args:
        folder: where the sweep wrote.

    Raises:
        InputError: if there is no sweep.
    """
    import pandas as pd

    file = Path(folder) / FILE
    if not file.is_file():
        raise InputError(f"{folder}: has no {FILE}: it is not the folder of a sweep")
    with sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True) as db:
        return pd.read_sql(f'SELECT * FROM results ORDER BY "{CASE}"', db, index_col=CASE)


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _kind(value: Any) -> str:
    if isinstance(value, (bool, int)):
        return "INTEGER"
    return "REAL" if isinstance(value, float) else "TEXT"


def _stored(value: Any) -> Any:
    """A value as SQLite holds it; lists and groups as JSON, NaN as NULL."""
    if isinstance(value, (list, dict)):
        return json.dumps(value)
    return value
