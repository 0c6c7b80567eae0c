"""Damaged caches of the compiled law: files and folders that a disk, a person or another version changed.

``python tests/hostile/caches.py 200`` damages so many, lets a command meet each in a process that is forked from this
one, and prints how that ended. Each has to work, to the same bytes, and to mend what can be mended. What compiles takes
half a minute, so it is replaced by what it has compiled before. A second number is the seed.
"""

from __future__ import annotations

import os
import random
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from forked import Prepare, forked  # noqa: E402
from harms import BYTES, Harm  # noqa: E402
from kinds import BASE, TUBE  # noqa: E402
from mutations import document  # noqa: E402

from trainmj.collision import compiled, kernel  # noqa: E402

COMMANDS = {
    "run": ("run", "base.yaml", "--figures", "none"),
    "sweep": ("sweep", "base.yaml", "--vary", "mass_t=30,36", "--threads", "2"),
}
_DIGEST = 32


def _again(file: Path, change: Callable[[bytes], bytes]) -> None:
    """Another content with the digest of that."""
    content = change(file.read_bytes()[:-_DIGEST])
    file.write_bytes(content + sha256(content).digest())


def _version(file: Path, draw: random.Random) -> None:
    """What another version wrote: its code would crash."""
    _again(file, lambda content: draw.randbytes(_DIGEST) + draw.randbytes(len(content)))


def _no_code(file: Path, draw: random.Random) -> None:
    """What is said to be of this version, and is no code."""
    _again(file, lambda content: content[:_DIGEST] + draw.choice([b"", b"\x7fELF", draw.randbytes(900)]))


def _swap(file: Path, draw: random.Random) -> None:
    """The code of another function."""
    others = sorted(set(file.parent.iterdir()) - {file})
    shutil.copy(draw.choice(others), file)


def _mode(file: Path, draw: random.Random) -> None:
    """Others may write it, or nobody may read it."""
    file.chmod(draw.choice([0o666, 0o664, 0o622, 0o000, 0o200]))


def _away(file: Path, draw: random.Random) -> None:
    """A link to the file, sound or not, at another place."""
    shutil.move(file, target := file.parent.parent / "elsewhere")
    if draw.random() < 0.5:
        BYTES["flip"](target, draw)
    file.symlink_to(target)


def _folder(file: Path, draw: random.Random) -> None:
    """The folder is a file or a link to nowhere, or it cannot be written or is open to all."""
    match draw.randrange(4):
        case 0:
            shutil.rmtree(file.parent)
            file.parent.write_text("a file")
        case 1:
            shutil.rmtree(file.parent)
            file.parent.symlink_to("nowhere")
        case _:
            file.parent.chmod(draw.choice([0o555, 0o777, 0o000]))


HARMS: Mapping[str, Harm] = {
    **BYTES,
    **{"version": _version, "no code": _no_code, "swap": _swap, "mode": _mode, "away": _away, "folder": _folder},
}


def met(caches: Path, known: Mapping[str, bytes]) -> Prepare:
    """First in a process: the law is looked for in these caches, and what compiles it gives what is known."""

    def prepare() -> None:
        def compile_(function: Any, signature: str, name: str) -> tuple[int, bytes]:
            return compiled._linked(name, known[name]), known[name]

        os.environ["NUMBA_CACHE_DIR"] = str(caches)
        kernel._callbacks.cache_clear()
        compiled._compiled = compile_

    return prepare


def judged(place: Path, caches: Path, known: Mapping[str, bytes], name: str) -> str:
    """Let a command meet damaged caches, twice, and say what is wrong with how that ends; empty if nothing is."""
    for when in ("at first", "then"):
        out = place / "out"
        shutil.rmtree(out, ignore_errors=True)
        ended = forked(place, *COMMANDS[name], "--out", out, prepare=met(caches, known))
        if ended.returncode or "Traceback" in ended.stderr:
            return f"exit {ended.returncode} {when}: {ended.stderr[-300:]}"
        for file in (place / name).iterdir():
            if (out / file.name).read_bytes() != file.read_bytes():
                return f"another {file.name} {when}"
    said = ended.stderr.replace("\n", " ")
    if said and "is not kept between processes" not in said:
        return f"not mended: {said[-300:]}"
    return ""


def main(count: int, seed: int = 1) -> int:
    """Print how so many trials end, and what is wrong; how many are."""
    draw, wrong, hows = random.Random(seed), 0, Counter[str]()
    kernel._callbacks()
    here, known = compiled._folder(), {}
    for file in here.glob(f"law.*.{compiled._machine().mark}"):
        known[file.name.split(".")[1]] = file.read_bytes()[_DIGEST:-_DIGEST]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "base.yaml").write_text(document(BASE))
        (place / "tube.csv").write_bytes(TUBE)
        for name, words in COMMANDS.items():  # the sound caches come about with it
            ended = forked(place, *words, "--out", name, prepare=met(place / "sound", known))
            assert (ended.returncode, ended.stderr) == (0, ""), ended
        (files,) = (place / "sound").iterdir()
        names = sorted(file.name for file in files.iterdir())
        for number in range(count):
            caches = place / f"caches {number}"
            shutil.copytree(place / "sound", caches)
            how, harm = draw.choice(list(HARMS.items()))
            file = caches / files.name / draw.choice(names)
            harm(file, draw)
            hows[how] += 1
            if said := judged(place, caches, known, draw.choice(list(COMMANDS))):
                wrong += 1
                print(f"{number}: {file.name} {how}: {said}", flush=True)  # noqa: T201
    print(f"{count} damaged caches ({dict(hows)}), {wrong} wrong")  # noqa: T201
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(int(sys.argv[1]), *map(int, sys.argv[2:]))))
