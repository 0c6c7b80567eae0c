"""Digests of what a store has: a changed digit, a lost row and one more are found when they are read.

Each cell has a number that depends on its column and its value, a row one that depends on those of its cells, and the
digest of all rows is the sum of theirs: whatever the order of rows and columns, and empty cells do not count. They find
damage and edits, not malice: whoever can write the file can write its digests.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from hashlib import blake2b, sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainmj.doe.arrays import FloatArray
from trainmj.files.text import from_json

RESPONSES = "columns"
"""Under which the table about says what the responses are, by name."""

DIGESTS = ("digest_of_rows", "digest_of_the_rest")
"""Under which the table about has the digest of all rows, and that of what else it says and of the heads."""

STATE = "INSERT OR REPLACE INTO about VALUES (?, ?)"
IN_A_PIECE = 50
"""Rows that are read at a time: they fit into the cache of a processor."""

_ROWS, _REST = DIGESTS
_NUMBERS = 2**64  # that a digest can be


def digest_of(names: Sequence[str], heads: Iterable[Sequence[Any]], numbers: FloatArray) -> int:
    """The digest of rows, to be added to those of others.

    Args:
        names: of all columns, (h + k,), the key among them.
        heads: the first columns, of any values that SQLite holds, (h, n).
        numbers: the others, (n, k); nan where there is none.

    Raises:
        TypeError: if a value is nothing that SQLite holds.
    """
    values = np.column_stack([*([_number(value) for value in head] for head in heads), numbers])
    cells = _mixed((values + 0.0).view(np.uint64) + _places(tuple(names)))  # SQLite keeps no sign of 0
    cells[np.isnan(values)] = 0
    return int(_mixed(cells.sum(axis=1)).sum())


def _number(value: Any) -> float:
    """A number for a value, and the same one for whatever SQLite makes of it in a column of another type."""
    if value is None:
        return math.nan
    if isinstance(value, bytes):
        return _short(value)
    return _number_of(value) if isinstance(value, str) else float(value)


@lru_cache(maxsize=1000)
def _number_of(text: str) -> float:
    try:
        if math.isfinite(number := float(text)):
            return number
    except ValueError:
        pass
    return _short(text.encode("utf-8", "surrogatepass"))


def _short(content: bytes) -> float:
    """A whole number that a float holds, for content of any length."""
    return float(int.from_bytes(blake2b(content, digest_size=6).digest(), "little"))


@lru_cache(maxsize=100)
def _places(names: tuple[str, ...]) -> NDArray[np.uint64]:
    return _mixed(np.array([_short(name.encode()) for name in names], dtype=np.uint64))


def _mixed(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Other numbers for other numbers, of which each bit depends on all bits (the finaliser of splitmix64)."""
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))


def sign(db: sqlite3.Connection) -> None:
    """State the digest of what a store says of its cases, and of the heads of its results."""
    db.execute(STATE, (_REST, _rest(db)))


def count(db: sqlite3.Connection, digest: int) -> None:
    """Add the digest of rows that are added to a store."""
    db.execute(STATE, (_ROWS, str((_stated(db) + digest) % _NUMBERS)))


def is_as_said(db: sqlite3.Connection) -> bool:
    """Whether what a store says of its cases, and the heads of its results, are as they were written.

    Raises:
        sqlite3.Error: if it cannot be read.
    """
    tables = {name for (name,) in db.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
    if not tables:
        return True  # new
    if tables != {"about", "results"}:
        return False
    (empty,) = db.execute("SELECT NOT EXISTS (SELECT 1 FROM about) AND NOT EXISTS (SELECT 1 FROM results)").fetchone()
    stated = db.execute("SELECT value FROM about WHERE key = ?", (_REST,)).fetchone()
    return bool(empty) or stated == (_rest(db),)


def responses_in(db: sqlite3.Connection) -> Iterator[FloatArray]:
    """The responses of some cases at a time, (n, k), in the order of the columns in the table and of its rows.

    Raises:
        OverflowError, TypeError, ValueError: at the end at the latest, if the rows are not as they were written.
        sqlite3.Error: if they cannot be read.
    """
    total = 0
    for digest, numbers in _pieces(db):
        total += digest
        yield numbers
    if total % _NUMBERS != _stated(db):
        raise ValueError("rows were changed, lost or added")


def digest_of_rows(db: sqlite3.Connection) -> int:
    """The digest of all rows that a store has."""
    return sum(digest for digest, _ in _pieces(db)) % _NUMBERS


def _pieces(db: sqlite3.Connection) -> Iterator[tuple[int, FloatArray]]:
    """The digest and the responses of some rows at a time."""
    responses = _responses(db)
    names = sorted((name for name, _ in _heads(db)), key=lambda name: name in responses)
    n = sum(name not in responses for name in names)
    quoted = ('"' + name.replace('"', '""') + '"' for name in names)
    found = db.execute(f"SELECT {', '.join(quoted)} FROM results ORDER BY rowid")
    while rows := found.fetchmany(IN_A_PIECE):
        heads = zip(*(row[:n] for row in rows), strict=True)
        numbers = np.array([row[n:] for row in rows], dtype=np.float64)  # NaN where there is None
        yield digest_of(names, heads, numbers), numbers


def _stated(db: sqlite3.Connection) -> int:
    found = db.execute("SELECT value FROM about WHERE key = ?", (_ROWS,)).fetchone()
    return int(found[0]) if found else 0


def _rest(db: sqlite3.Connection) -> str:
    said = db.execute("SELECT key, value FROM about WHERE key NOT IN (?, ?) ORDER BY key", DIGESTS).fetchall()
    return sha256(json.dumps([said, sorted(_heads(db))], default=str).encode()).hexdigest()


def _heads(db: sqlite3.Connection) -> list[tuple[str, str]]:
    """Names and types of the columns."""
    return [(name, kind) for _, name, kind, *_ in db.execute("PRAGMA table_info(results)")]


def _responses(db: sqlite3.Connection) -> set[str]:
    """Columns that have nothing but numbers."""
    try:
        ((text,),) = db.execute("SELECT value FROM about WHERE key = ?", (RESPONSES,))
        return set(from_json(text))
    except (TypeError, ValueError):
        return set()
