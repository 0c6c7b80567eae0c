"""Many collisions at once: the same law and the same numbers as :func:`trainmj.run`, on all cores.

Cases of one size share a compiled model; each simulation has masses, devices, speeds and friction of its own in its
state row. A simulation whose collision is over gives its place to the next case, so none waits for the slowest, and
memory depends on the places, not on the number of cases.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Generic, NamedTuple, TypeVar

import mujoco
import numpy as np
from mujoco.batch import Batch

from trainmj import native
from trainmj.chain import WALL, Chain
from trainmj.device import Array
from trainmj.layout import Car, Head, Layout
from trainmj.metrics import Summary, measure
from trainmj.model import build
from trainmj.result import Tally
from trainmj.simulation import n_records

PLACES = 128
"""Simulations that run side by side; a call into MuJoCo costs about as much as ten steps of one of them."""

WINDOW = 1024
"""Cases that are sorted by size at a time."""

_HISTORY_BYTES = 64 * 2**20  # recorded speeds of all places together
_POINTS = 16  # room for envelope points grows in these steps, so that few models are compiled

Key = TypeVar("Key")


class _Size(NamedTuple):
    """What cases must share to run in one batch."""

    n_vehicle: int
    walled: bool
    n_point: int
    step: float
    steps_per_record: int
    integrator: str
    n_records: int


def run_chains(
    cases: Iterable[tuple[Key, Chain]], threads: int = 0, places: int = PLACES
) -> Iterator[tuple[Key, Summary]]:
    """Compute collisions side by side and yield each as it ends.

    Every number equals that of a single run, bit for bit, whatever the threads, places and order.

    Args:
        cases: a key of the caller's and the chain, taken as they are needed.
        threads: native threads; 0 for all cores.
        places: simulations side by side.

    Yields:
        The key and the numbers of each case, in the order in which they end.
    """
    cases = iter(cases)
    engines: dict[_Size, _Engine[Key]] = {}
    with native.installed():
        while window := list(islice(cases, max(WINDOW, 4 * places))):
            groups: dict[_Size, list[tuple[Key, Chain]]] = {}
            for key, chain in window:
                groups.setdefault(_size(chain), []).append((key, chain))
            for size, group in groups.items():
                if size not in engines:
                    if len(engines) >= 8:
                        engines.pop(next(iter(engines)))
                    engines[size] = _Engine(group[0][1], size, min(places, max(len(group), 1)), threads)
                yield from engines[size].run(group)
                if engines[size].places < min(places, len(group)):
                    del engines[size]


def _size(chain: Chain) -> _Size:
    points = max(i.envelope.stroke.size for i in chain.interfaces)
    return _Size(
        len(chain.vehicles),
        chain.interfaces[-1].right == WALL,
        -(-points // _POINTS) * _POINTS,
        chain.step,
        chain.steps_per_record,
        chain.integrator,
        n_records(chain),
    )


@dataclass
class _Place(Generic[Key]):
    """A simulation under way."""

    key: Key
    chain: Chain


class _Engine(Generic[Key]):
    """A batch of MuJoCo for cases of one size."""

    def __init__(self, chain: Chain, size: _Size, places: int, threads: int) -> None:
        self.layout = Layout.of(chain, size.n_point)
        self._interval = size.step * size.steps_per_record
        self._stride = size.steps_per_record
        self._most = size.n_records
        row = self._most * size.n_vehicle * 8
        self.places = max(1, min(places, _HISTORY_BYTES // row if row < _HISTORY_BYTES else 1))
        self._batch = Batch(build(chain, self.layout, bare=True), self.places, threads)
        self._mass = self._batch.expand("body_mass")
        self._blocks = self._batch.bind("userdata")
        self._qpos, self._qvel, self._time = (self._batch.bind(name) for name in ("qpos", "qvel", "time"))
        self._fresh_row = self._batch.state[0].copy()
        self._speeds = self.layout.car(self._blocks, Car.SPEED)
        self._history = np.empty((self.places, self._most, size.n_vehicle))
        self._recorded = np.zeros(self.places, dtype=int)

    def run(self, cases: Iterable[tuple[Key, Chain]]) -> Iterator[tuple[Key, Summary]]:
        """Compute cases of this engine's size."""
        waiting = iter(cases)
        free = list(range(self.places))
        under_way: dict[int, _Place[Key]] = {}
        while True:
            begun = []
            for place, (key, chain) in zip(list(free), waiting, strict=False):
                self._load(place, chain)
                under_way[place] = _Place(key, chain)
                begun.append(place)
            free = [p for p in free if p not in under_way]
            if begun:
                self._advance(np.sort(begun), 1)  # the law sees the start
            if not under_way:
                return
            ended: list[int] = self._ended(np.sort(begun)) if begun else []
            while not ended:
                ids = np.sort(np.fromiter(under_way, dtype=int))
                self._advance(ids, self._stride)
                ended = self._ended(ids)
            for place in ended:
                done = under_way.pop(place)
                free.append(place)
                yield done.key, self._measure(place, done.chain)

    def _load(self, place: int, chain: Chain) -> None:
        self._batch.state[place] = self._fresh_row
        self._mass[place, 1:] = chain.mass
        self._time[place] = 0.0
        self._qpos[place] = chain.start
        self._qvel[place] = chain.speed
        self._blocks[place] = self.layout.block(chain)
        self._recorded[place] = 0

    def _advance(self, ids: np.ndarray, steps: int) -> None:
        """Step some simulations and record their speeds."""
        self._batch.step(ids=ids, nstep=steps)
        self._history[ids, self._recorded[ids]] = self._speeds[ids]
        self._recorded[ids] += 1

    def _ended(self, ids: np.ndarray) -> list[int]:
        """Those that are over, out of time, or no longer finite."""
        ended = (
            (self._blocks[ids, Head.OVER] != 0.0)
            | (self._recorded[ids] >= self._most)
            | ~np.isfinite(self._blocks[ids, Head.IMPULSE])
        )
        return [int(p) for p in ids[ended]]

    def _measure(self, place: int, chain: Chain) -> Summary:
        n = int(self._recorded[place])
        time: Array = np.arange(n) * self._interval
        return measure(chain, Tally.of(self.layout, self._blocks[place]), time, self._history[place, :n])


def largest_threads() -> int:
    """Native threads used where none are asked for."""
    return int(Batch(mujoco.MjModel.from_xml_string("<mujoco/>"), 1).nthread)
