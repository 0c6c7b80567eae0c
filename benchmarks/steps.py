"""What a step costs: of a train with one kind of device, of one with every kind, of each kind alone; and the start.

    python benchmarks/steps.py [--turns N] [--start]

Times of steps are the least of many short turns in which the competitors alternate: on a machine that others use, too,
that is what the work itself takes. With --start also the first start of processes, which compile the law, and later
ones, which find it on disk: medians of five, which takes some minutes.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numba
import numpy as np
from trains import DEVICES, scenario_of

import trainmj
from trainmj.collision import compiler, kernel
from trainmj.collision.block import Layout, alone
from trainmj.collision.chain import Chain, Element
from trainmj.collision.element import advance
from trainmj.collision.fields import Head
from trainmj.collision.lineup import line_up
from trainmj.collision.model import build
from trainmj.collision.simulation import start

STEPS = 300  # in a piece that is timed
PIECES = 16  # of a collision, from the first contact on


def chain_of(couplers: list[str], fronts: tuple[str, str] = ("tube", "tube")) -> Chain:
    """Two trains with couplers, from the front, at 25 km/h."""
    return line_up(trainmj.Scenario.from_values(scenario_of(couplers, fronts)))


BODIES = {"trains.b_type.body": {"stiffness_kN_per_mm": 1000, "members": 4}}
MIXED = ["crush", "rate", "hysteresis", "gas_hydraulic", "crush_and_pull"]
TRAINS: dict[str, Callable[[], Chain]] = {
    "b_type": lambda: line_up(trainmj.load("b_type")),
    "b_type, bodies of 4 members": lambda: line_up(trainmj.load("b_type", BODIES)),
    "crush alone": lambda: chain_of(["crush"] * 5),
    "every kind, unequal front": lambda: chain_of(MIXED, ("staged", "tube")),
    **{f"couplers: {name}": lambda name=name: chain_of([name] * 5) for name in DEVICES if name != "crush"},  # type: ignore[misc]
}


ALONE = {"MuJoCo alone": "b_type", "MuJoCo alone, bodies": "b_type, bodies of 4 members"}
"""What MuJoCo takes for the vehicles, or points of bodies, of a train."""


def steps(turns: int) -> dict[str, float]:
    """Time of a step of 12 vehicles [us], the mean of the least of every piece of a collision."""
    chains = {name: make() for name, make in TRAINS.items()}
    models = {name: build(chain, bare=True) for name, chain in chains.items()}
    taken = {name: np.full(PIECES, np.inf) for name in [*ALONE, *chains]}
    with kernel.installed():
        for _ in range(turns):
            for name, least in taken.items():
                of = ALONE.get(name, name)
                data = start(models[of], chains[of], Layout.of(chains[of]))
                data.userdata[Head.DONE] = name in ALONE  # then the law rests
                for piece in range(PIECES):
                    began = time.perf_counter()
                    mujoco.mj_step(models[of], data, nstep=STEPS)
                    least[piece] = min(least[piece], time.perf_counter() - began)
    return {name: float(least.mean()) / STEPS * 1e6 for name, least in taken.items()}


compiler.tell()


@numba.njit(error_model="numpy")  # type: ignore[misc]
def follow(block: np.ndarray, fresh: np.ndarray, strokes: np.ndarray, step: float) -> float:
    """Press a fresh element along strokes, as the compiled law does; the largest force."""
    block[:] = fresh
    most = 0.0
    for n in range(1, strokes.size):
        force, _ = advance(block, 0, strokes[n], (strokes[n] - strokes[n - 1]) / step, step, n * step)
        most = max(most, force)
    return most


def elements(turns: int) -> dict[str, float]:
    """Time of a step of one element [ns], pressed, let go by a third and pressed again, three times."""
    time_ = np.arange(0.0, 0.3, 1e-4)
    strokes = 0.25 * time_ + 0.01 * (1.0 - np.cos(2.0 * np.pi * time_ / 0.1))
    mixed = chain_of(MIXED, ("staged", "tube"))
    found: dict[str, Element] = {
        name: chain_of([name] * 5).interfaces[0].elements[-1] for name in DEVICES if name != "crush_and_pull"
    }
    found["two in series"] = mixed.interfaces[mixed.front].elements[0]
    least = dict.fromkeys(found, np.inf)
    for _ in range(20 * turns):
        for name, element in found.items():
            fresh = alone(element)
            block = fresh.copy()
            began = time.perf_counter()
            follow(block, fresh, strokes, 1e-4)
            least[name] = min(least[name], time.perf_counter() - began)
    return {name: taken / (strokes.size - 1) * 1e9 for name, taken in least.items()}


_RUN = "from trainmj.cli import main; main()"
_STARTS = {
    "import": ["import trainmj.collision.kernel"],
    "import and law": ["from trainmj.collision import kernel\nwith kernel.installed(): pass"],
    "trainmj run b_type": [_RUN, "run", "b_type"],
    "trainmj run b_type --out": [_RUN, "run", "b_type", "--out", "out"],
}


def starts(turns: int) -> dict[str, tuple[float, float]]:
    """Median wall and processor time [s] of processes that compile the law, and of later ones."""
    found = {}
    for name, words in _STARTS.items():
        with tempfile.TemporaryDirectory() as folder:
            caches = [Path(folder, str(turn)) for turn in range(turns)]
            first = [_process(words, cache, folder) for cache in caches]
            later = [_process(words, caches[0], folder) for _ in range(turns)]
        for when, taken in (("first", first), ("later", later)):
            wall, cpu = np.median(taken, axis=0)
            found[f"{when}: {name}"] = float(wall), float(cpu)
    return found


def _process(words: list[str], cache: Path, place: str) -> tuple[float, float]:
    """Wall and processor time of a Python process [s]."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["NUMBA_CACHE_DIR"] = str(cache)
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-c", *words], env=environment, cwd=place, stdout=subprocess.DEVNULL, check=True)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--turns", type=int, default=40, help="of the steps; 5 of the starts")
    parser.add_argument("--start", action="store_true", help="the start of processes, too")
    options = parser.parse_args()
    found = steps(options.turns)
    print(f"a step of 12 vehicles{'us':>23s}{'of b_type':>12s}{'law alone, us':>16s}")
    for name, taken in found.items():
        own = taken - found["MuJoCo alone, bodies" if "bodies" in name else "MuJoCo alone"]
        print(f"  {name:37s}{taken:7.3f}{taken / found['b_type']:12.2f}{own:16.3f}")
    print("\na step of one element, pressed by itself")
    for name, taken in elements(options.turns).items():
        print(f"  {name:37s}{taken:7.1f} ns")
    if options.start:
        print(f"\na process{'wall s':>35s}{'processor s':>15s}")
        for name, (wall, cpu) in starts(5).items():
            print(f"  {name:35s}{wall:7.2f}{cpu:15.2f}")


if __name__ == "__main__":
    main()
