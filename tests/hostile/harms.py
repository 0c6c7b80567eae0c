"""What happens to files: to bits, bytes, sizes and names; to numbers, keys, rows and journals by the kind of file."""

from __future__ import annotations

import json
import os
import random
import shutil
import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from pathlib import Path

Harm = Callable[[Path, random.Random], None]
"""Changes the file at a path, as a random number generator has it."""

_BLOCK = 512  # bytes that a disk loses at a time


def flip(path: Path, draw: random.Random) -> None:
    """One bit, or some."""
    content = bytearray(path.read_bytes())
    for _ in range(draw.choice([1, 1, 1, 3, 40])):
        content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    path.write_bytes(content)


def put(path: Path, draw: random.Random) -> None:
    """Some bytes inserted, or in the place of others."""
    content = path.read_bytes()
    at = draw.randrange(len(content))
    new = draw.choice([b"\0" * 512, b"\xff" * 7, b"9", b"-", b"e99", b"[" * 5000, b'"', b"\n", b"nan"])
    path.write_bytes(content[:at] + new + content[at + draw.choice([0, len(new)]) :])


def cut(path: Path, draw: random.Random) -> None:
    """The end, the beginning or the middle is lost, or everything; or a part is there twice."""
    content = path.read_bytes()
    a, b = sorted(draw.randrange(len(content)) for _ in range(2))
    path.write_bytes(draw.choice([content[:a], content[a:], content[:a] + content[b:], content[:b] + content[a:], b""]))


def blocks(path: Path, draw: random.Random) -> None:
    """Blocks of a disk are zeros, or those of another place."""
    content = bytearray(path.read_bytes())
    for _ in range(draw.choice([1, 1, 4])):
        at, other = (draw.randrange(-(-len(content) // _BLOCK)) * _BLOCK for _ in range(2))
        n = len(content[at : at + _BLOCK])
        content[at : at + n] = bytes(n) if draw.random() < 0.6 else content[other : other + n].ljust(n, b"\0")
    path.write_bytes(content)


def huge(path: Path, draw: random.Random) -> None:
    """Zeros without end behind it, which take no place on the disk."""
    with path.open("r+b") as file:
        file.truncate(draw.choice([600_000_000, 13_000_000_000]))


def other(path: Path, draw: random.Random) -> None:
    """A pipe, a folder, or a link to what is no such file."""
    path.unlink()
    match draw.randrange(4):
        case 0:
            os.mkfifo(path)
        case 1:
            path.mkdir()
        case _:
            path.symlink_to(draw.choice(["/dev/zero", "/etc/passwd", "../base.yaml", "nowhere"]))


def swap(path: Path, draw: random.Random) -> None:
    """A sound file of the same kind from the same place or a folder beside it, but with another content."""
    files = sorted({*path.parent.glob(f"*{path.suffix}"), *path.parent.parent.glob(f"*/*{path.suffix}")} - {path})
    if files:
        shutil.copy(draw.choice(files), path)


BYTES: Mapping[str, Harm] = {"flip": flip, "put": put, "cut": cut, "blocks": blocks, "huge": huge, "other": other}
"""To files of whatever kind."""


def _digit(path: Path, draw: random.Random) -> None:
    content = bytearray(path.read_bytes())
    digits = [n for n, byte in enumerate(content) if 48 <= byte <= 57]
    at = draw.choice(digits)
    content[at] = 48 + (content[at] - 47) % 10
    path.write_bytes(content)


def _rows(path: Path, draw: random.Random) -> None:
    """A line is there twice, is lost, or is that of another place; or two columns change places."""
    lines = path.read_text(encoding="utf-8").splitlines()
    a, b = (draw.randrange(len(lines)) for _ in range(2))
    match draw.randrange(4):
        case 0:
            lines.insert(b, lines[a])
        case 1:
            del lines[a]
        case 2:
            lines[a], lines[b] = lines[b], lines[a]
        case _:
            cells = [line.split(",") for line in lines]
            n = min(map(len, cells))
            c, d = draw.randrange(n), draw.randrange(n)
            for row in cells:
                row[c], row[d] = row[d], row[c]
            lines = list(map(",".join, cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _deep(path: Path, draw: random.Random) -> None:
    path.write_text(draw.choice(["[", '{"a":']) * draw.choice([900, 200_000]))


def _key(path: Path, draw: random.Random) -> None:
    values = json.loads(path.read_text())
    group = draw.choice([values, *(value for value in values.values() if isinstance(value, dict) and value)])
    name = draw.choice(list(group))
    new = draw.choice([None, [], {}, "x", 1e308, -1, True])
    group.pop(name) if draw.random() < 0.4 else group.update({name: new})
    path.write_text(json.dumps(values))


def _twice(path: Path, draw: random.Random) -> None:
    """A line of a JSON file, such as a key with its value, is there twice."""
    lines = path.read_text().splitlines(keepends=True)
    at = draw.randrange(len(lines))
    path.write_text("".join([*lines[:at], lines[at], *lines[at:]]))


def _sql(path: Path, draw: random.Random) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as db, suppress(sqlite3.Error):
        db.execute(draw.choice(_statements(db, draw)))


def _statements(db: sqlite3.Connection, draw: random.Random) -> list[str]:
    key, *heads = (name for _, name, *_ in db.execute("PRAGMA table_info(results)"))
    name, others = draw.choice(heads), ", ".join(f'"{head}"' for head in heads)
    return [
        f'UPDATE results SET "{name}" = {draw.choice(["1", "NULL", "-1e300", "zeroblob(9)"])}',
        f'UPDATE results SET "{name}" = "{name}" * (1 + 1e-15) WHERE rowid = (SELECT max(rowid) FROM results)',
        "DELETE FROM results WHERE rowid = (SELECT min(rowid) FROM results)",
        f'INSERT INTO results ("{key}", {others}) SELECT 9999, {others} FROM results LIMIT 1',
        f'ALTER TABLE results RENAME COLUMN "{name}" TO other',
        "DELETE FROM about WHERE rowid = (SELECT min(rowid) FROM about)",
        "UPDATE about SET value = replace(value, '0', '1')",
        "CREATE TRIGGER t AFTER INSERT ON results BEGIN DELETE FROM about; END",
        f'CREATE VIEW v AS SELECT "{name}" FROM results',
        "UPDATE about SET value = value + 1 WHERE key = 'digest_of_rows'",
    ]


def _wal(path: Path, draw: random.Random) -> None:
    """Another program has changed it, and what it wrote is still in the log beside it, sound or damaged."""
    log = path.with_name(f"{path.name}-wal")
    kept = [path.with_name(f"kept{end}") for end in ("", "-wal")]
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA journal_mode = WAL")
        with suppress(sqlite3.Error):
            db.execute(draw.choice(_statements(db, draw)))
        for file, copy in zip((path, log), kept, strict=True):
            shutil.copy(file, copy)
    for file, copy in zip((path, log), kept, strict=True):
        copy.replace(file)
    if log.stat().st_size and draw.random() < 0.6:
        draw.choice(list(BYTES.values()))(log, draw)


def _journal(path: Path, draw: random.Random) -> None:
    """What a killed process left half written, whose journal is beside it, damaged or that of another file."""
    journal, kept = path.with_name(f"{path.name}-journal"), path.with_name("kept-journal")
    before = path.read_bytes()
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA cache_size = 1")  # so that pages are written, and their old content to the journal before
        db.execute("BEGIN IMMEDIATE")
        db.execute("UPDATE about SET value = value || 'x'")
        db.execute(f"CREATE TABLE t AS SELECT * FROM results, (VALUES {', '.join(['(1)'] * 40)})")
        shutil.copy(journal, kept)
        torn = path.read_bytes()
        db.execute("ROLLBACK")
    kept.replace(journal)
    path.write_bytes(draw.choice([before, torn]))
    if draw.random() < 0.7:
        draw.choice([flip, put, cut, blocks, huge, other])(journal, draw)


OF_KIND: Mapping[str, Mapping[str, Harm]] = {
    ".sqlite": {"sql": _sql, "sql again": _sql, "wal": _wal, "journal": _journal, "swap": swap},
    ".json": {"key": _key, "digit": _digit, "deep": _deep, "twice": _twice, "swap": swap},
    ".csv": {"digit": _digit, "rows": _rows, "rows again": _rows, "swap": swap},
    ".nc": {"digit": _digit, "swap": swap},
}
"""To files of one kind, by the end of their names."""
