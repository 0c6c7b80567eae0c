"""Finished cases in one SQLite file, which survives whatever stops the process that writes it.

Table ``results`` has a row for each finished case: its key, then its values by column name, units in the names. Table
``about`` says what they were computed from, and in ``columns`` what the responses are, as JSON. It also has digests of
all of it (:mod:`trainmj.cases.intact`): what is not as it was written is refused. A transaction is complete or absent.
The writer holds the folder (:func:`trainmj.files.folder.held`); others may read meanwhile.
"""

from __future__ import annotations

import csv
import json
import os
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from trainmj.cases import intact
from trainmj.cases.lines import lines_of
from trainmj.cases.origin import Origin, in_words
from trainmj.cases.rows import STATUS, Key, Row, Rows, Values
from trainmj.collision.quantities import Column, ordered
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError, OutputError
from trainmj.files.text import from_json, printable
from trainmj.files.written import replacing, special

FILE = "results.sqlite"
CASE = "case"
KEY = "key"
MOST_COLUMNS = 1990
"""Columns that a store may have, a few less than SQLite allows."""

PATIENCE = 30.0
"""How long writer and readers wait for each other [s]."""

_BESIDE = ("", "-journal", "-wal", "-shm")
"""What SQLite appends to the name of a file for those that it keeps beside it."""

_MOST_BYTES = 100_000_000
"""Longest value in a file that somebody else may have made."""

_TABLE = re.compile(
    r"CREATE TABLE about \(key TEXT PRIMARY KEY, value TEXT\)"
    r'|CREATE TABLE results \("\w+" (INTEGER|TEXT) PRIMARY KEY(, "([^"]|"")+"( INTEGER| REAL| TEXT)?)*\)'
)
"""How the tables of a store are made, and nothing else in it."""

_MOST_ASKED = 500  # keys in one query
_TROUBLES = {
    "locked": "another process is using this file: wait for it, or take another folder",
    "full": "the disk is full; finished cases are kept: make room, and the same command goes on",
    **dict.fromkeys(
        ("not a database", "malformed", "no such", "too big"),
        "is damaged or no SQLite file ({}): take another folder, or start over with --fresh",
    ),
    "": "cannot be written ({}); finished cases are kept",
}
"""What is wrong, and what to do, by a word in what SQLite says."""


class Store:
    """Finished cases in a file, which is made if it is not there.

    The first column has the keys of the cases: numbers if its name is "case", otherwise text. What cannot be read or
    written is an OutputError, and so is what :func:`connected` refuses.
    """

    def __init__(self, file: Path, key: str = CASE) -> None:
        """Open or make the file."""
        self.file, self._key, self._numbered = file, key, key == CASE
        with self._troubles():
            self._db = connected(file, "rwc")
            self._db.execute("PRAGMA synchronous = NORMAL")
        with self._transaction() as db:
            if not db.execute("SELECT 1 FROM sqlite_schema").fetchone():
                self._make_tables("main", {})
        self._names = self._kinds()
        self._known = read_columns(self.about(), file)
        with self._troubles():
            for _ in responses_in(self._db, file):
                pass  # that all of them are as they were written

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._db.close()

    def __len__(self) -> int:
        """How many cases there are."""
        ((count,),) = self._select("SELECT count(*) FROM results")
        return int(count)

    def about(self) -> dict[str, str]:
        """What the file says of its cases; empty for a new file."""
        with self._troubles():
            return about_in(self._db)

    def describe(self, about: Mapping[str, str]) -> None:
        """State what the cases are computed from."""
        with self._transaction() as db:
            db.executemany(intact.STATE, about.items())
            intact.sign(db)

    def agree(self, origin: Origin) -> None:
        """State the origin, with its words as they are now, in place of any other if there are no cases of that.

        Raises:
            InputError: naming what has changed.
        """
        there = self.about()
        if not len(self):
            self.clear()  # of columns and words that were stated for other cases
        elif there and (changed := origin.new_identity(there) + origin.new_input(there)):
            raise InputError(
                f"{self.file}: holds other results: {in_words(changed)}: run it as it was, take another folder, "
                "or start over with --fresh"
            )
        self.describe(origin.about())

    def there(self, n: int) -> NDArray[np.bool_]:
        """(n,) whether the case of each number from 0 on is in the file."""
        there = np.zeros(n, dtype=bool)
        keys = np.fromiter(self.column(self._key, n), dtype=np.int64)
        there[keys[keys >= 0]] = True
        return there

    def endings(self) -> dict[str, tuple[int, Any, str]]:
        """How many cases ended in each way, and the key and reason of the first of them, by status."""
        query = f'SELECT status, count(*), min("{self._key}"), reason FROM results GROUP BY status'  # that of the first
        return {status: (count, first, reason) for status, count, first, reason in self._select(query)}

    def saying(self, words: str) -> int:
        """How many cases have some words in their reason."""
        ((count,),) = self._select("SELECT count(*) FROM results WHERE instr(reason, ?) > 0", (words,))
        return int(count)

    def column(self, name: str, before: Key) -> Iterator[Any]:
        """The values of a column in the order of the keys, of those before a key; None where a case has none."""
        name = _quoted(name) if name in self._names else "NULL"
        query = f'SELECT {name} FROM results WHERE "{self._key}" < ? ORDER BY "{self._key}"'
        return (value for (value,) in self._select(query, (before,)))

    def read(self, keys: Iterable[Key]) -> dict[Key, Row]:
        """The rows of those keys that are in the file, without their empty values."""
        found: dict[Key, Row] = {}
        keys, (_, *names) = list(keys), self._names
        for first in range(0, len(keys), _MOST_ASKED):
            some = tuple(keys[first : first + _MOST_ASKED])
            query = f'SELECT * FROM results WHERE "{self._key}" IN ({", ".join("?" * len(some))})'
            for key, *values in self._select(query, some):
                row = {name: value for name, value in zip(names, values, strict=True) if value is not None}
                texts = list(map(type, row.values())).count(str)
                if texts != len(STATUS) or not all(isinstance(row.get(name), str) for name in STATUS):
                    raise damaged(self.file)
                found[key] = row
        return found

    def prepare(self, values: Mapping[str, Any]) -> None:
        """Make the columns of which every case will have a value, each of the type of one value.

        Columns that are not prepared are of the type of the first value that is added.
        """
        with self._widened({name: [value] for name, value in values.items()}, {}):
            pass

    def add(self, rows: Sequence[Rows]) -> None:
        """Add finished cases that are not there yet in one transaction.

        Raises:
            InputError: if there are more columns than SQLite can hold.
        """
        alike: dict[tuple[tuple[str, ...], tuple[str, ...]], list[Rows]] = {}
        for some in rows:
            alike.setdefault((tuple(some.facts), tuple(some.columns)), []).append(some)
        values: dict[str, Values] = {}
        columns: dict[str, Column] = {}
        for first, *_ in alike.values():
            values |= {name: column for name, column in first.facts.items() if name not in values}
            columns = _merged(columns, first.columns)
        with self._widened(values, columns) as kinds:
            digest = 0
            for facts, responses in alike:
                heads = (self._key, *facts)
                names = (*heads, *responses)
                query = f"INSERT INTO results ({', '.join(map(_quoted, names))}) VALUES ({', '.join('?' * len(names))})"
                for some in alike[facts, responses]:
                    found = [some.keys, *(_plain(some.facts[name], kinds[name]) for name in facts)]
                    numbers = some.numbers if responses else np.empty((len(some), 0))
                    digest += intact.digest_of(names, found, numbers)
                    records = zip(*found, strict=True)  # SQLite takes NaN for NULL
                    self._db.executemany(query, ((*a, *b) for a, b in zip(records, numbers.tolist(), strict=True)))
            intact.count(self._db, digest)

    @contextmanager
    def _widened(self, values: Mapping[str, Values], columns: Mapping[str, Column]) -> Iterator[dict[str, str]]:
        """A transaction in which the table has these columns; yields the types of all by name."""
        known = _merged(self._known, columns)
        new = in_order((name for name in (*values, *columns) if name not in self._names), known)
        if len(self._names) + len(new) > MOST_COLUMNS:
            raise InputError(
                f"the table would have {len(self._names) + len(new)} columns and SQLite holds 2000: "
                "choose some with --responses, as in --responses 'TS_mm,TAMA_g,stroke_*'"
            )
        kinds = {name: self._kind(0.0 if name in columns else _plain(values[name][:1])[0]) for name in new}
        with self._transaction() as db:
            for name, kind in kinds.items():
                db.execute(f"ALTER TABLE results ADD COLUMN {_quoted(name)} {kind}".rstrip())
            if said_more := known != self._known:
                known = {name: known[name] for name in in_order(known, known)}
                said = json.dumps({name: column._asdict() for name, column in known.items()})
                db.execute(intact.STATE, (intact.RESPONSES, said))
            if kinds or said_more:
                intact.sign(db)
            yield self._names | kinds
        self._names |= kinds
        self._known = known

    def clear(self) -> None:
        """Take all cases out, and what is said of them."""
        with self._transaction() as db:
            db.execute("DROP TABLE about")
            db.execute("DROP TABLE results")
            self._make_tables("main", {})
        self._names = self._kinds()
        self._known = {}

    def write_csv(self, file: Path, before: Key | None = None) -> None:
        """Write the table as CSV in one order of columns and rows, whatever order the cases ended in.

        Args:
            file: made or replaced.
            before: key from which on rows are left out; by default none is.
        """
        names = in_order(self._names, self._known)
        n = sum(name not in self._known for name in names)  # that are no responses
        query = selected(names, self._key, "" if before is None else f'WHERE "{self._key}" < ?')
        try:
            with replacing(file) as part, part.open("w", newline="", encoding="utf-8") as out:
                csv.writer(out).writerow(names)
                with self._troubles():
                    found = self._db.execute(query, () if before is None else (before,))
                    while rows := found.fetchmany(intact.IN_A_PIECE):
                        out.write(lines_of(rows, n))
        except OutputError as error:
            raise OutputError(f"{error}; the results are in {self.file}") from None

    def finish(self) -> None:
        """Put a file in place that has the same in one order, and so the same bytes however it came about; close it."""
        names = in_order(self._names, self._known)
        with replacing(self.file) as part, self._troubles():
            self._db.execute("ATTACH ? AS new", (_uri(part, "rw"),))
            self._db.execute("PRAGMA new.journal_mode = OFF")  # nobody knows this file before it is finished
            self._db.execute("PRAGMA new.synchronous = OFF")
            with self._transaction() as db:
                self._make_tables("new", {name: self._names[name] for name in names[1:]})
                db.execute("INSERT INTO new.about SELECT * FROM main.about ORDER BY key")
                db.execute(f"INSERT INTO new.results {selected(names, self._key)}")
            self._db.close()

    def _make_tables(self, schema: str, kinds: Mapping[str, str]) -> None:
        """Make both tables in a file that is main or attached, with columns of these types behind the key."""
        columns = [f'"{self._key}" {"INTEGER" if self._numbered else "TEXT"} PRIMARY KEY']
        columns += [f"{_quoted(name)} {kind}".rstrip() for name, kind in kinds.items()]
        self._db.execute(f"CREATE TABLE {schema}.about (key TEXT PRIMARY KEY, value TEXT)")
        self._db.execute(f"CREATE TABLE {schema}.results ({', '.join(columns)})")

    def _kinds(self) -> dict[str, str]:
        """The types of all columns by name."""
        return {name: kind for _, name, kind, *_ in self._select("PRAGMA table_info(results)")}

    def _kind(self, value: Any) -> str:
        """The type of a column: none where only trainmj reads it, so that -0.0 stays what it is."""
        if not self._numbered:
            return ""
        if isinstance(value, (bool, int)):
            return "INTEGER"
        return "REAL" if isinstance(value, float) else "TEXT"

    def _select(self, query: str, values: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
        with self._troubles():
            yield from self._db.execute(query, values)

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """Write all that the block executes, or nothing."""
        with self._troubles(), self._db:
            self._db.execute("BEGIN IMMEDIATE")
            yield self._db

    @contextmanager
    def _troubles(self) -> Iterator[None]:
        """Say what is wrong with the file, and what to do."""
        try:
            yield
        except sqlite3.Error as error:
            text = str(error)
            said = next(said for word, said in _TROUBLES.items() if word in text)
            raise OutputError(f"{self.file}: {said.format(text)}") from None


def damaged(file: Path) -> OutputError:
    """What to raise where a store has something else than was kept."""
    return OutputError(f"{file}: is damaged, or was changed by hand: start over with --fresh")


def key_of(*content: Any) -> str:
    """A key that changes with any of the content, which JSON can hold."""
    return sha256(json.dumps(content, default=str).encode()).hexdigest()[:32]


def connected(file: Path, mode: str) -> sqlite3.Connection:
    """A connection to a file that somebody else may have made, and in which nothing can run.

    It has two plain tables, and each page of it is in one place: reading ends, and takes no more memory than the file.

    Args:
        file: of a store.
        mode: rw or rwc, as SQLite's URIs have it. Readers write too: they take back what a killed process has left half
            written.

    Raises:
        OutputError: if the file, or one that SQLite keeps beside it, is no plain file, it has anything else in it, or
            what it says of its cases is not as it was written.
        sqlite3.Error: if it is damaged, or locked.
    """
    for beside in (file.with_name(file.name + end) for end in _BESIDE):
        if what := "is a link to another file" if beside.is_symlink() else special(beside):
            raise OutputError(f"{beside}: {what}: remove it, or take another folder")
    db = sqlite3.connect(_uri(file, mode), timeout=PATIENCE, isolation_level=None, uri=True)
    try:
        db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _MOST_BYTES)
        db.execute("PRAGMA trusted_schema = OFF")
        for kind, name, made in db.execute("SELECT type, name, sql FROM sqlite_schema"):
            if not (_TABLE.fullmatch(str(made)) or (made is None and str(name).startswith("sqlite_autoindex_"))):
                said = printable(f"{kind} {name}")[:60]
                raise OutputError(f"{file}: is not a file of trainmj: it has the {said}, which trainmj did not make")
        ((found,),) = db.execute("PRAGMA integrity_check(1)")  # that rows are found by their keys, too
        if found != "ok":
            raise sqlite3.DatabaseError(f"malformed: {printable(str(found)).splitlines()[-1][:100]}")
        db.execute("BEGIN")  # all from one moment
        if not intact.is_as_said(db):
            raise damaged(file)
        db.execute("COMMIT")
    except BaseException:
        db.close()
        raise
    return db


def responses_in(db: sqlite3.Connection, file: Path) -> Iterator[FloatArray]:
    """The responses of all cases, some at a time, (n, k), in the order of the columns in the table and of its rows.

    Raises:
        OutputError: at the end at the latest, if the rows are not as they were written.
    """
    try:
        yield from intact.responses_in(db)
    except (OverflowError, TypeError, ValueError):
        raise damaged(file) from None


def about_in(db: sqlite3.Connection) -> dict[str, str]:
    """What a file says of its cases.

    Raises:
        sqlite3.DatabaseError: if it is no text.
    """
    about = dict(db.execute("SELECT key, value FROM about WHERE key NOT IN (?, ?)", intact.DIGESTS))
    if not all(isinstance(text, str) for item in about.items() for text in item):
        raise sqlite3.DatabaseError("malformed: the table about has other things than text")
    return about


def read_columns(about: Mapping[str, str], file: Path) -> dict[str, Column]:
    """What a store says of its responses, by column name."""
    if intact.RESPONSES not in about:
        return {}
    try:
        said: dict[str, dict[str, Any]] = from_json(about[intact.RESPONSES])
        return {name: Column(**{**column, "place": tuple(column["place"])}) for name, column in said.items()}
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{file}: is damaged, or was changed by hand ({printable(str(error))})") from None


def in_order(names: Iterable[str], columns: Mapping[str, Column]) -> list[str]:
    """Names that are no responses, then the responses in the order of all tables."""
    names = list(names)
    responses = ordered(columns[name] for name in names if name in columns)
    return [*(name for name in names if name not in columns), *(column.name for column in responses)]


def selected(names: Iterable[str], key: str, where: str = "") -> str:
    """The query for some columns in the order of the keys."""
    return f'SELECT {", ".join(map(_quoted, names))} FROM results {where} ORDER BY "{key}"'


def _merged(known: Mapping[str, Column], more: Mapping[str, Column]) -> dict[str, Column]:
    """What responses are; one that two chains have at two places has the first of these, whichever chain came first."""
    return {**known, **{name: min(column, known.get(name, column)) for name, column in more.items()}}


def _uri(file: Path, mode: str) -> str:
    """A path as SQLite takes it, of whatever bytes its name is."""
    return f"{Path(os.path.abspath(file)).as_uri()}?mode={mode}"


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _plain(values: Values, kind: str = "") -> list[Any]:
    """Values as SQLite holds them in a column of a type; lists and groups as JSON."""
    plain = values.tolist() if isinstance(values, np.ndarray) else values
    plain = [json.dumps(value) if isinstance(value, (list, dict)) else value for value in plain]
    if kind == "TEXT":  # SQLite itself would keep 15 digits of a number
        return [str(value + 0) if isinstance(value, (int, float)) else value for value in plain]
    return plain
