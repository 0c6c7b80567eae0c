"""Competitors in turns: processes that wait for work, whole processes, medians and ratios.

A machine that others use, too, slows one minute and not the next. Competitors therefore alternate within one run, each
first once without counting, and what is quoted is a ratio: that of each turn, then the median of these.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from types import TracebackType
from typing import Any, Self

ROOT = Path(__file__).resolve().parents[1]
WORKS = Path(__file__).with_name("works.py")

Numbers = dict[str, Any]
"""What a piece of work found: its wall and processor time [s], and what else it counts."""


def alternate(competitors: Mapping[str, Callable[[], Numbers]], turns: int) -> dict[str, list[Numbers]]:
    """What each found in each turn, after one that does not count; every other turn in reverse order."""
    found: dict[str, list[Numbers]] = {name: [] for name in competitors}
    for turn in range(turns + 1):
        for name in list(competitors)[:: 1 if turn % 2 else -1]:
            numbers = competitors[name]()
            if turn:
                found[name].append(numbers)
    return found


def timed(work: Callable[[], Any]) -> Numbers:
    """Wall and processor time of a piece of work in this process [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}


def medians(turns: Sequence[Numbers]) -> Numbers:
    """The median of each number over the turns."""
    return {name: median(turn[name] for turn in turns) for name in turns[0]}


def ratio(above: Sequence[Numbers], below: Sequence[Numbers]) -> Numbers:
    """One wall time by another: the median over the turns, and its range; and the median of processor times."""
    wall, cpu = ([a[time] / b[time] for a, b in zip(above, below, strict=True)] for time in ("wall", "cpu"))
    return {"value": median(wall), "from": min(wall), "to": max(wall), "cpu": median(cpu)}


class Worker:
    """A process with one checkout of trainmj, which does pieces of work (:mod:`works`) as it is asked to."""

    def __init__(self, checkout: Path) -> None:
        """Start it.

        Raises:
            RuntimeError: if it takes trainmj from elsewhere.
        """
        self._process = subprocess.Popen(
            [sys.executable, str(WORKS)],
            env=os.environ | {"PYTHONPATH": str(checkout)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.about = self("about")
        if Path(self.about.pop("package")).parent != checkout:
            raise RuntimeError(f"{checkout}: is not what its process imports")

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """End it."""
        self._process.kill() if kind else self._process.communicate()

    def begin(self, work: str, **arguments: Any) -> None:
        """Ask for a piece of work, and do not wait for it."""
        assert self._process.stdin
        self._process.stdin.write(json.dumps([work, arguments]) + "\n")
        self._process.stdin.flush()

    def end(self) -> Numbers:
        """Wait for it."""
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"a process that measures has ended with {self._process.wait()}")
        found: Numbers = json.loads(line)
        return found

    def __call__(self, work: str, **arguments: Any) -> Numbers:
        """Do a piece of work."""
        self.begin(work, **arguments)
        return self.end()


def together(workers: Sequence[Worker], work: str, **arguments: Any) -> Numbers:
    """The same piece of work in several processes at once: wall time of the slowest [s], processor time of all."""
    for worker in workers:
        worker.begin(work, **arguments)
    found = [worker.end() for worker in workers]
    return {"wall": max(one["wall"] for one in found), "cpu": sum(one["cpu"] for one in found)}


_COMMAND = """
import sys
from trainmj.cli import main
try:
    main(sys.argv[1:])
finally:
    with open("/proc/self/status") as status:
        print(next(line.split()[1] for line in status if line.startswith("VmHWM")), file=sys.stderr)
"""


def command(words: Sequence[str], checkout: Path = ROOT, **environment: str) -> Numbers:
    """A command of trainmj as a whole process (on Linux): wall and processor time [s], and its peak memory [MB].

    The process reads its own high-water mark: what the system counts for a child includes the parent's at the fork.
    """
    before, began = os.times(), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", _COMMAND, *words],
        env=os.environ | {"PYTHONPATH": str(checkout)} | environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    wall, after = time.perf_counter() - began, os.times()
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        raise RuntimeError(f"trainmj {' '.join(words)} ended with {done.returncode}\n{done.stderr}")
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return {"wall": wall, "cpu": cpu, "peak_MB": int(done.stderr.split()[-1]) / 1024}
