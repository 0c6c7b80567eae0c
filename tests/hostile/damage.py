"""Damaged state files: what trainmj left in a folder, with bytes that a disk, a transfer or a person changed.

``python tests/hostile/damage.py 2000`` damages so many files, uses each as a person would, in a process that is forked
from this one, and prints how that ended. None may end in a traceback, take long or much memory, or give other numbers
than the sound files give.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import sqlite3
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from forked import forked  # noqa: E402
from kinds import BASE, STUDY, TARGETS, TUBE, WANTED, command  # noqa: E402
from mutations import document  # noqa: E402

LONGEST = 5.0
"""Processor time of a command [s]."""

MOST = 1_000_000_000
"""Memory that a command may take beside what the process has when it begins [bytes]."""

GOES_ON = {
    "sweep": ("sweep", "base.yaml", "--vary", "mass_t=30,36", "--histories", "0", "--threads", "1"),
    "study": ("study", "my.study.yaml", "--figures", "none", "--threads", "1"),
    "identify": ("identify", "my.targets.yaml", "--figures", "none", "--threads", "1"),
    "run": ("run", "base.yaml", "--figures", "none"),
}
"""What goes on in each folder, or begins again."""

KINDS = {".sqlite": "SQLite", ".json": "JSON", ".csv": "CSV", ".nc": "NetCDF"}


@dataclass(frozen=True)
class Trial:
    """A file that is damaged, and the command that meets it."""

    file: Path
    how: str
    words: tuple[str, ...]


def sound(place: Path) -> dict[Path, bytes]:
    """Fill a place with a folder of every kind; the state files by their path in it."""
    files = {"base.yaml": document(BASE), "my.study.yaml": document(STUDY), "my.targets.yaml": document(TARGETS)}
    for name, text in (files | {"tube.csv": TUBE.decode(), "wanted.csv": WANTED.decode()}).items():
        (place / name).write_text(text, encoding="utf-8")
    before = Path.cwd()
    os.chdir(place)
    try:
        for name, words in GOES_ON.items():
            code, said = command(*words, "--out", name)
            assert code in (0, 1), said
    finally:
        os.chdir(before)
    folders = (place / name for name in GOES_ON)
    files_there = (file for folder in folders for file in sorted(folder.iterdir()) if file.suffix in KINDS)
    return {file.relative_to(place): file.read_bytes() for file in files_there}


def trials(files: dict[Path, bytes], seed: int) -> Iterator[tuple[Trial, Callable[[Path], None]]]:
    """Trials without an end, each with what does the damage at a path; kinds and folders in turn."""
    draw = random.Random(seed)
    by_kind = {kind: [file for file in files if file.suffix == kind] for kind in KINDS}
    while True:
        for kind, there in by_kind.items():
            file = draw.choice(there)
            how, damage = draw.choice([*BYTES.items(), *OF_KIND[kind].items()])
            folder = file.parts[0]
            words = (*GOES_ON[folder], "--out", folder)
            if kind == ".nc":
                words = draw.choice([words, ("report", str(file)), ("run", str(file))])
            elif folder in ("sweep", "study", "run") and draw.random() < 0.5:
                words = ("report", folder)
            yield Trial(file, how, words), partial(damage, draw=random.Random(draw.random()))


def _flip(path: Path, draw: random.Random) -> None:
    content = bytearray(path.read_bytes())
    for _ in range(draw.choice([1, 1, 1, 3, 40])):
        content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    path.write_bytes(content)


def _put(path: Path, draw: random.Random) -> None:
    content = path.read_bytes()
    at = draw.randrange(len(content))
    new = draw.choice([b"\0" * 512, b"\xff" * 7, b"9", b"-", b"e99", b"[" * 5000, b'"', b"\n", b"nan"])
    path.write_bytes(content[:at] + new + content[at + draw.choice([0, len(new)]) :])


def _cut(path: Path, draw: random.Random) -> None:
    content = path.read_bytes()
    a, b = sorted(draw.randrange(len(content)) for _ in range(2))
    path.write_bytes(draw.choice([content[:a], content[a:], content[:a] + content[b:], content[:b] + content[a:], b""]))


def _huge(path: Path, draw: random.Random) -> None:
    with path.open("r+b") as file:
        file.truncate(draw.choice([600_000_000, 13_000_000_000]))


def _other(path: Path, draw: random.Random) -> None:
    path.unlink()
    if draw.random() < 0.5:
        os.mkfifo(path)
    else:
        path.symlink_to(draw.choice(["/dev/zero", "/etc/passwd", "../base.yaml", "nowhere"]))


def _digit(path: Path, draw: random.Random) -> None:
    content = bytearray(path.read_bytes())
    digits = [n for n, byte in enumerate(content) if 48 <= byte <= 57]
    at = draw.choice(digits)
    content[at] = 48 + (content[at] - 47) % 10
    path.write_bytes(content)


def _deep(path: Path, draw: random.Random) -> None:
    path.write_text(draw.choice(["[", '{"a":']) * draw.choice([900, 200_000]))


def _key(path: Path, draw: random.Random) -> None:
    values = json.loads(path.read_text())
    group = draw.choice([values, *(value for value in values.values() if isinstance(value, dict) and value)])
    name = draw.choice(list(group))
    new = draw.choice([None, [], {}, "x", 1e308, -1, True])
    group.pop(name) if draw.random() < 0.4 else group.update({name: new})
    path.write_text(json.dumps(values))


def _sql(path: Path, draw: random.Random) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        heads = [name for _, name, *_ in db.execute("PRAGMA table_info(results)")]
        name = draw.choice(heads[1:])
        lines = [
            f'UPDATE results SET "{name}" = {draw.choice(["1", "NULL", "-1e300", "zeroblob(9)"])}',
            "DELETE FROM results WHERE rowid = (SELECT min(rowid) FROM results)",
            f'ALTER TABLE results RENAME COLUMN "{name}" TO other',
            "DELETE FROM about WHERE rowid = (SELECT min(rowid) FROM about)",
            "UPDATE about SET value = replace(value, '0', '1')",
            "CREATE TRIGGER t AFTER INSERT ON results BEGIN DELETE FROM about; END",
            f'CREATE VIEW v AS SELECT "{name}" FROM results',
            "UPDATE digests SET digest = digest + 1",
        ]
        with suppress(sqlite3.Error):
            db.execute(draw.choice(lines))


BYTES = {"flip": _flip, "put": _put, "cut": _cut, "huge": _huge, "other": _other}
OF_KIND = {
    ".sqlite": {"sql": _sql, "sql again": _sql},
    ".json": {"key": _key, "digit": _digit, "deep": _deep},
    ".csv": {"digit": _digit, "digit again": _digit},
    ".nc": {"digit": _digit},
}


def judged(place: Path, files: dict[Path, bytes], trial: Trial, damage: Callable[[Path], None]) -> str:
    """Do the damage in a copy, use it, and say what is wrong with how that ends; empty if nothing is."""
    copy = place.with_name("copy")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(place, copy)
    damage(copy / trial.file)
    damaged = copy / trial.file
    if damaged.is_file() and damaged.stat().st_size < 10**8 and damaged.read_bytes() == files[trial.file]:
        return ""

    def bound() -> None:
        size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + MOST, size + MOST))
        resource.setrlimit(resource.RLIMIT_CPU, (60, 60))

    began = sum(os.times()[2:4])
    ended = forked(copy, *trial.words, prepare=bound)
    seconds = sum(os.times()[2:4]) - began
    if "Traceback" in ended.stderr or ended.returncode not in (0, 1, 2):
        return f"exit {ended.returncode}: {ended.stderr[-300:]}"
    if seconds > LONGEST:
        return f"took {seconds:.1f} s"
    if ended.returncode == 2:
        return "" if ended.stderr.startswith("Error: ") else f"exit 2: {ended.stderr[:200]}"
    folder = trial.file.parts[0]
    if trial.words[0] in ("report", "run") and trial.words[-1] in (str(trial.file), folder):
        read = trial.words[0] == "report" or (trial.file.suffix == ".nc" and "--out" not in trial.words)
        taken = read and trial.file.name not in NOT_READ and not _same(damaged, place / trial.file)
        return "taken for sound" if taken else ""
    compared = [file for file in files if file.suffix != ".sqlite" and file.parts[0] == folder]
    others = [file for file in compared if not _same(copy / file, place / file)]
    return f"other numbers in {', '.join(map(str, others))}" if others else ""


def _same(file: Path, sound: Path) -> bool:
    """Whether a file, if it is there, says what a sound one says: JSON in whatever order, a database in its tables."""
    if not file.exists():
        return True
    if file.suffix == ".json":
        one, other = (json.loads(each.read_bytes()) for each in (file, sound))
        return bool(one | {"digest": 0} == other | {"digest": 0})
    if file.suffix == ".sqlite":
        said = []
        for each in (file, sound):
            with closing(sqlite3.connect(each)) as db:
                said.append(list(db.iterdump()))
        return said[0] == said[1]
    return file.stat().st_size == sound.stat().st_size and file.read_bytes() == sound.read_bytes()


NOT_READ = ("results.csv", "bodies.csv", "histories.csv", "interfaces.csv", "vehicles.csv")
NOT_READ += ("simulations.sqlite", "case_0.nc")
"""What a report of a folder does not read."""


def main(count: int, seed: int = 1) -> int:
    """Print how so many trials end, and what is wrong; how many are."""
    wrong, kinds, longest = 0, Counter[str](), 0.0
    with tempfile.TemporaryDirectory() as name:
        place = Path(name) / "sound"
        place.mkdir()
        files = sound(place)
        for number, (trial, damage) in zip(range(count), trials(files, seed), strict=False):
            began = time.monotonic()
            said = judged(place, files, trial, damage)
            longest = max(longest, time.monotonic() - began)
            kinds[KINDS[trial.file.suffix]] += 1
            if said:
                wrong += 1
                print(f"{number}: {trial.file} {trial.how}: trainmj {' '.join(trial.words)}: {said}", flush=True)  # noqa: T201
    print(f"{count} damaged files ({dict(kinds)}), {wrong} wrong; the longest {longest:.1f} s")  # noqa: T201
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(int(sys.argv[1]), *map(int, sys.argv[2:]))))
