"""Damaged state files: what trainmj left in a folder, with bytes that a disk, a transfer or a person changed.

``python tests/hostile/damage.py 2000`` damages so many files, uses each as a person would, in a process that is forked
from this one, and prints how that ended. None may end in a traceback, take long or much memory, or give other numbers
than the sound files give. A second number is the seed.
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
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from forked import forked  # noqa: E402
from harms import BYTES, OF_KIND, Harm, swap  # noqa: E402
from kinds import BASE, RELIABILITY, STUDY, TARGETS, TUBE, WANTED, command  # noqa: E402
from mutations import document  # noqa: E402

LONGEST = 5.0
"""Processor time of a command [s]."""

MOST = 1_000_000_000
"""Memory that a command may take beside what the process has when it begins [bytes]."""

GOES_ON = {
    "sweep": ("sweep", "base.yaml", "--vary", "mass_t=30,36", "--histories", "0", "--threads", "1"),
    "study": ("study", "my.study.yaml", "--figures", "none", "--threads", "1"),
    "identify": ("identify", "my.targets.yaml", "--figures", "none", "--threads", "1"),
    "reliability": ("reliability", "my.reliability.yaml", "--figures", "none", "--threads", "1"),
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
    reads: bool
    """Whether the command has to read the file and tells what is in it, so that it has to refuse what is not sound."""


def sound(place: Path) -> dict[Path, bytes]:
    """Fill a place with a folder of every kind; the state files by their path in it."""
    inputs = {"base": BASE, "my.study": STUDY, "my.targets": TARGETS, "my.reliability": RELIABILITY}
    texts = {f"{name}.yaml": document(values) for name, values in inputs.items()}
    for name, text in (texts | {"tube.csv": TUBE.decode(), "wanted.csv": WANTED.decode()}).items():
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
            how, harm = draw.choice([*BYTES.items(), *OF_KIND[kind].items()])
            words, reads = _met(file, harm, draw)
            yield Trial(file, how, words, reads), partial(harm, draw=random.Random(draw.random()))


def _met(file: Path, harm: Harm, draw: random.Random) -> tuple[tuple[str, ...], bool]:
    """A command that meets a file, and whether it has to read it."""
    folder = file.parts[0]
    if file.suffix == ".nc" and harm is not swap and draw.random() < 0.6:
        return draw.choice([("report", str(file)), ("run", str(file)), ("check", str(file))]), True
    if folder in ("sweep", "study", "run") and draw.random() < 0.5:
        return ("report", folder), file.name not in NOT_READ
    return (*GOES_ON[folder], "--out", folder), False


def judged(place: Path, files: dict[Path, bytes], trial: Trial, damage: Callable[[Path], None]) -> str | None:
    """Do the damage in a copy, use it, and say what is wrong with how that ends; None if it was no damage."""
    copy = place.with_name("copy")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(place, copy)
    damage(copy / trial.file)
    damaged = copy / trial.file
    alone = not list(damaged.parent.glob(f"{damaged.name}-*"))
    if alone and damaged.is_file() and damaged.stat().st_size < 10**8 and damaged.read_bytes() == files[trial.file]:
        return None
    empty = damaged.is_file() and not damaged.stat().st_size  # for SQLite a new database

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
    if trial.words[0] in ("check", "report") or "--out" not in trial.words:
        return "taken for sound" if trial.reads and not _same(damaged, place / trial.file) else ""
    told = empty or "is computed again" in ended.stderr  # then what a study says of itself is other, but no table
    compared = {file: content for file, content in files.items() if not told or file.suffix == ".csv"}
    others = [str(file) for file, content in compared.items() if not _is(copy / file, content)]
    return f"other content in {', '.join(others)}" if others else ""


def _is(file: Path, content: bytes) -> bool:
    return file.is_file() and file.stat().st_size == len(content) and file.read_bytes() == content


def _same(file: Path, sound: Path) -> bool:
    """Whether a file, if it is there, says what a sound one says: JSON in whatever order, a database in its tables."""
    if not os.path.lexists(file):
        return True
    if not file.is_file():
        return False
    try:
        if file.suffix == ".json" and file.stat().st_size < 10**8:
            one, other = (json.loads(each.read_bytes()) for each in (file, sound))
            return bool(one | {"digest": 0} == other | {"digest": 0})
        if file.suffix == ".sqlite":
            return _dump(file) == _dump(sound)
    except (sqlite3.Error, ValueError):
        return False
    return _is(file, sound.read_bytes())


def _dump(file: Path) -> list[str]:
    with closing(sqlite3.connect(file)) as db:
        return list(db.iterdump())


NOT_READ = ("results.csv", "bodies.csv", "histories.csv", "interfaces.csv", "vehicles.csv")
NOT_READ += ("simulations.sqlite", "case_0.nc")
"""What a report of a folder does not read."""


def main(count: int, seed: int = 1) -> int:
    """Print how so many trials end, and what is wrong; how many are."""
    wrong, kinds, hows, longest = 0, Counter[str](), Counter[str](), 0.0
    with tempfile.TemporaryDirectory() as name:
        place = Path(name) / "sound"
        place.mkdir()
        files = sound(place)
        for number, (trial, damage) in enumerate(trials(files, seed)):
            if kinds.total() == count:
                break
            began = time.monotonic()
            said = judged(place, files, trial, damage)
            longest = max(longest, time.monotonic() - began)
            if said is None:
                continue
            kinds[KINDS[trial.file.suffix]] += 1
            hows[trial.how] += 1
            if said:
                wrong += 1
                print(f"{number}: {trial.file} {trial.how}: trainmj {' '.join(trial.words)}: {said}", flush=True)  # noqa: T201
    print(f"{count} damaged files ({dict(kinds)}; {dict(hows)}), {wrong} wrong; the longest {longest:.1f} s")  # noqa: T201
    return wrong


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (8 * MOST, 8 * MOST))  # a fault in here harms nothing else
    sys.exit(bool(main(int(sys.argv[1]), *map(int, sys.argv[2:]))))
