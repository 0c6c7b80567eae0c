"""Many collisions at once: the same law and the same numbers as :func:`trainmj.run`, on all cores.

Cases of one size share a compiled model; the masses, devices, speeds and friction of each simulation are in its state
row. When a collision is over, the next case takes its place, so that none waits for the slowest, and memory depends on
the number of places, not of cases.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from queue import SimpleQueue
from threading import Event, Lock
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from trainmj.collision import kernel
from trainmj.collision.block import Layout, Tally, n_values
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.channels import traces_of
from trainmj.collision.fields import Head
from trainmj.collision.measured import Measured
from trainmj.collision.mj import undisturbed
from trainmj.collision.model import build, numbers_of
from trainmj.collision.simulation import LAW_NOT_CALLED
from trainmj.collision.summary import Summary, summary_of
from trainmj.errors import EngineError

with undisturbed():  # it compiles a model
    from mujoco.batch import Batch

PLACES = 128
"""Simulations side by side in a thread: the cost of a call into MuJoCo vanishes among them, and they fit its cache."""

_LOOK_AHEAD = 1024  # cases of other sizes that are kept waiting while those of one size run
_HISTORY_BYTES = 32 * 2**20  # recorded speeds of all places of a thread
_VALUES = 256  # room for curves grows in these steps, so that few models are compiled
_RING = 8  # records that the law takes by itself between two calls
_ENGINES = 8  # kept for sizes that come again

Key = TypeVar("Key")


class _Size(NamedTuple):
    """What cases must share to run in one batch."""

    n_vehicle: int
    n_point: int
    n_member: int
    walled: bool
    n_element: int
    n_value: int
    step: float
    steps_per_record: int
    integrator: str
    n_records: int
    dofs: tuple[int, ...]
    n_line: int

    @classmethod
    def of(cls, chain: Chain) -> _Size:
        return cls(
            len(chain.vehicles),
            len(chain.points),
            len(chain.members),
            chain.interfaces[-1].right == WALL,
            chain.n_places,
            -(-n_values(chain) // _VALUES) * _VALUES,
            chain.step,
            chain.steps_per_record,
            chain.integrator,
            chain.n_records,
            chain.first_dof if chain.plane else (),
            len(chain.lines),
        )


def run_chains(
    cases: Iterable[tuple[Key, Chain]], threads: int = 0, places: int = PLACES, *, channels: Sequence[str] = ()
) -> Iterator[tuple[Key, Summary]]:
    """Compute collisions side by side and yield each as it ends.

    Every number equals that of a single run, bit for bit, whatever the threads, places and order.

    Args:
        cases: a key of the caller's and the chain, taken as they are needed, by one thread at a time.
        threads: 0 for all cores.
        places: simulations side by side in each thread.
        channels: those that each summary keeps, where the chain has them.

    Yields:
        The key and the numbers of each case, in the order in which they end.
    """
    threads = threads or n_cores()
    queue = _Queue(cases)
    with kernel.installed():
        if threads == 1:
            yield from _work(queue, places, channels)
        else:
            yield from _in_threads(threads, queue, places, channels)


def n_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _work(queue: _Queue[Key], places: int, channels: Sequence[str]) -> Iterator[tuple[Key, Summary]]:
    """Compute what is in a queue, one size after the other."""
    engines: dict[_Size, _Engine[Key]] = {}
    while (found := queue.fullest()) is not None:
        size, chain = found
        if size not in engines:
            if len(engines) == _ENGINES:
                del engines[next(iter(engines))]
            engines[size] = _Engine(chain, size, places, channels)
        yield from engines[size].run(queue.take(size))


def _in_threads(
    threads: int, queue: _Queue[Key], places: int, channels: Sequence[str]
) -> Iterator[tuple[Key, Summary]]:
    """The same in several threads: while MuJoCo steps in one, Python prepares and measures in another."""
    ended: SimpleQueue[tuple[Key, Summary] | None] = SimpleQueue()
    stop = Event()

    def work() -> None:
        try:
            for case in _work(queue, places, channels):
                ended.put(case)
                if stop.is_set():
                    return
        finally:
            ended.put(None)

    with ThreadPoolExecutor(threads, "trainmj") as pool:
        workers = [pool.submit(work) for _ in range(threads)]
        try:
            while threads:
                case = ended.get()
                if case is None:
                    threads -= 1
                else:
                    yield case
            for worker in workers:
                worker.result()  # raises what stopped it
        finally:
            stop.set()


class _Queue(Generic[Key]):
    """Cases sorted by size as they are read, a limited number ahead; shared by several threads."""

    def __init__(self, cases: Iterable[tuple[Key, Chain]]) -> None:
        self._source = iter(cases)
        self._waiting: dict[_Size, deque[tuple[Key, Chain]]] = {}
        self._lock = Lock()

    def fullest(self) -> tuple[_Size, Chain] | None:
        """The size with the most cases waiting, and one of them; None when there is no case left."""
        with self._lock:
            if not self._waiting and not self._read():
                return None
            size = max(self._waiting, key=lambda size: len(self._waiting[size]))
            return size, self._waiting[size][0][1]

    def take(self, size: _Size) -> Iterator[tuple[Key, Chain]]:
        """Cases of one size, until too many others are waiting."""
        while (case := self._next(size)) is not None:
            yield case

    def _next(self, size: _Size) -> tuple[Key, Chain] | None:
        with self._lock:
            while size not in self._waiting:
                if sum(len(line) for line in self._waiting.values()) >= _LOOK_AHEAD or not self._read():
                    return None
            line = self._waiting[size]
            case = line.popleft()
            if not line:
                del self._waiting[size]
            return case

    def _read(self) -> bool:
        """Take one more case from the source, if there is one."""
        for key, chain in self._source:
            self._waiting.setdefault(_Size.of(chain), deque()).append((key, chain))
            return True
        return False


class _Engine(Generic[Key]):
    """A batch of MuJoCo for cases of one size, stepped in the thread that calls it."""

    def __init__(self, chain: Chain, size: _Size, places: int, channels: Sequence[str]) -> None:
        self._channels = channels
        self.layout = Layout.of(chain, size.n_value, _RING)
        self._steps = _RING * size.steps_per_record
        rings = -(-size.n_records // _RING)
        bytes_each = rings * _RING * size.n_vehicle * np.dtype(float).itemsize
        self._places = max(1, min(places, _HISTORY_BYTES // bytes_each))
        self._batch = Batch(build(chain, self.layout, bare=True), self._places, 1)
        self._numbers = {name: self._batch.expand(name) for name in numbers_of(chain)}
        self._blocks = self._batch.bind("userdata")
        self._qpos, self._qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._fresh_row = self._batch.state[0].copy()
        self._ring = self.layout.ring(self._blocks)
        self._history = np.empty((self._places, rings * _RING, size.n_vehicle))
        self._read = np.zeros(self._places, dtype=int)  # records of each place that are in its history

    def run(self, cases: Iterator[tuple[Key, Chain]]) -> Iterator[tuple[Key, Summary]]:
        """Compute cases of this engine's size."""
        free = list(range(self._places))
        under_way: dict[int, tuple[Key, Chain]] = {}
        again: deque[tuple[Key, Chain]] = deque()  # with smaller steps
        while True:
            begun = {place: again.popleft() for place in free[: len(again)]}
            begun |= dict(zip(free[len(begun) :], cases, strict=False))
            if begun:
                for place, (_, chain) in begun.items():
                    self._load(place, chain)
                under_way |= begun
                self._batch.set_const(ids=np.sort(list(begun)))  # MuJoCo keeps inertias that follow from the masses
            if not under_way:
                return
            ids = np.sort(list(under_way))
            free = [place for place in range(self._places) if place not in under_way]
            while (ended := self._advance(ids)).size == 0:
                pass
            for place in ended.tolist():
                key, chain = under_way.pop(place)
                free.append(place)
                measured = self._measured(place, chain)
                if measured.jumped and not chain.refined:
                    again.append((key, replace(chain, refined=True)))
                else:
                    yield key, replace(summary_of(measured), channels=traces_of(measured, self._channels))

    def _load(self, place: int, chain: Chain) -> None:
        self._batch.state[place] = self._fresh_row
        for name, values in numbers_of(chain).items():
            self._numbers[name][place, int(name.startswith("body")) :] = values  # body 0 is the world
        self._qpos[place] = chain.start_qpos
        self._qvel[place] = chain.start_qvel
        self._blocks[place] = self.layout.block(chain)
        self._read[place] = 0

    def _advance(self, ids: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
        """Step some simulations through one ring of records, keep it, and return those that are done."""
        self._batch.step(ids=ids, nstep=self._steps)
        if (self._blocks[ids, Head.TIME] < 0.0).any():
            raise EngineError(LAW_NOT_CALLED)
        records = self._blocks[ids, Head.RECORDS].astype(int)
        for r in range(_RING):
            new = self._read[ids] + r < records
            place, n = ids[new], self._read[ids[new]] + r
            self._history[place, n] = self._ring[place, n % _RING]
        self._read[ids] = records
        return np.asarray(ids[self._blocks[ids, Head.DONE] != 0.0])

    def _measured(self, place: int, chain: Chain) -> Measured:
        n = int(self._blocks[place, Head.RECORDS])
        velocity = self._history[place, :n]
        return Measured(
            chain, Tally.of(self.layout, self._blocks[place]), chain.record_times(n), np.asfortranarray(velocity)
        )
