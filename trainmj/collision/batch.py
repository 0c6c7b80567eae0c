"""Many collisions at once: the same law and the same numbers as :func:`trainmj.run`, on all cores.

Cases of one size share a compiled model; the masses, devices, speeds and friction of each simulation are in its state
row. When a collision is over, the next case takes its place, so that none waits for the slowest, and memory depends on
the number of places, not of cases.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from queue import SimpleQueue
from threading import Event
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from trainmj.collision import kernel
from trainmj.collision.block import Layout
from trainmj.collision.chain import EVENTS, Chain
from trainmj.collision.envelope import Array
from trainmj.collision.fields import Head
from trainmj.collision.found import Found
from trainmj.collision.lot import Chains, Lot
from trainmj.collision.measured import Measured
from trainmj.collision.mj import undisturbed
from trainmj.collision.model import build, numbers_of
from trainmj.collision.simulation import LAW_NOT_CALLED
from trainmj.collision.summary import Summary
from trainmj.collision.waiting import Size, Waiting
from trainmj.errors import EngineError

with undisturbed():  # it compiles a model
    from mujoco.batch import Batch

PLACES = 128
"""Simulations side by side in a thread: the cost of a call into MuJoCo vanishes among them, and they fit its cache."""

_HISTORY_BYTES = 64 * 2**20  # recorded speeds of all places of a thread, at most: few collisions last to the limit
_RING, _SHORT_RING = 32, 8  # records that the law takes by itself between two calls; where MuJoCo makes its steps
_PATIENCE = 0.3  # that ended cases have with the others of their lot [s]
_CLOSE = 1e-9  # how far MuJoCo may be from where the law has come to, relative
_LONGEST = 2e-3  # step of MuJoCo's over several records [s]
_ENGINES = 8  # kept for sizes that come again

Key = TypeVar("Key")
Seen = TypeVar("Seen")


def run_lots(
    lots: Iterable[Lot], look: Callable[[Measured], Seen], threads: int = 0, places: int = PLACES
) -> Iterator[Seen]:
    """Compute the collisions of lots side by side and yield what is seen of them, some cases at a time, as they end.

    Every number equals that of a single run, bit for bit, whatever the threads, places and order.

    Args:
        lots: taken as they are needed, by one thread at a time.
        look: makes of what some cases of a lot left behind all that is needed of it, in the thread that computed them;
            what it does not take with it makes room for others.
        threads: 0 for all cores.
        places: simulations side by side in each thread.

    Yields:
        What was seen of parts of lots, in the order in which their cases end.
    """
    threads = threads or n_cores()
    waiting = Waiting(lots, threads)
    with kernel.installed():
        if threads == 1:
            yield from map(look, _work(waiting, places))
        else:
            yield from _in_threads(threads, waiting, places, look)


def run_chains(
    cases: Iterable[tuple[Key, Chain]], threads: int = 0, places: int = PLACES, *, channels: Sequence[str] = ()
) -> Iterator[tuple[Key, Summary]]:
    """The same of single chains, each with a key of the caller's; whole summaries.

    Args:
        cases: taken as they are needed, by one thread at a time.
        threads: 0 for all cores.
        places: simulations side by side in each thread.
        channels: those that each summary keeps, where the chain has them.

    Yields:
        The key and the numbers of each case, in the order in which they end.
    """
    lots = (Chains([key], [chain]) for key, chain in cases)
    for seen in run_lots(lots, partial(_summaries, channels), threads, places):
        yield from seen


def _summaries(channels: Sequence[str], measured: Measured) -> list[tuple[Any, Summary]]:
    """The key and the numbers of some cases."""
    found = Found(measured)
    kept = found.channels(channels)
    return [(key, replace(found.summary(case), channels=kept[case])) for case, key in enumerate(found.keys)]


def n_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def steps_within(chain: Chain) -> int:
    """Steps of the law within one of MuJoCo's; 0 where MuJoCo makes each of them.

    Along the track the law can make MuJoCo's own steps, to the last bit; MuJoCo then steps from one record to the next,
    or over several of them.
    """
    if chain.plane or chain.integrator not in ("euler", EVENTS):
        return 0
    records = 1
    while 2 * records <= _RING and 2 * records * chain.record_interval <= _LONGEST * (1.0 + 1e-9):
        records *= 2
    return records * chain.steps_per_record


def _work(waiting: Waiting, places: int) -> Iterator[Measured]:
    """Compute what is waiting, one size after the other."""
    engines: dict[Size, _Engine] = {}
    while (found := waiting.fullest()) is not None:
        size, chain = found
        if size not in engines:
            if len(engines) == _ENGINES:
                del engines[next(iter(engines))]
            engines[size] = _Engine(chain, size, min(places, waiting.share))
        yield from engines[size].run(waiting.take(size))


def _in_threads(threads: int, waiting: Waiting, places: int, look: Callable[[Measured], Seen]) -> Iterator[Seen]:
    """The same in several threads: while MuJoCo steps in one, Python prepares and measures in another."""
    ended: SimpleQueue[list[Seen] | None] = SimpleQueue()  # None behind the last of a thread
    stop = Event()

    def work() -> None:
        try:
            for measured in _work(waiting, places):
                ended.put([look(measured)])
                if stop.is_set():
                    return
        finally:
            ended.put(None)

    with ThreadPoolExecutor(threads, "trainmj") as pool:
        try:
            workers = [pool.submit(work) for _ in range(threads)]  # raises where no thread can be had
            while threads:
                seen = ended.get()
                if seen is None:
                    threads -= 1
                else:
                    yield from seen
            for worker in workers:
                worker.result()  # raises what stopped it
        finally:
            stop.set()


class _Begun:
    """A lot whose cases are under way: what they begin with, and what those that have ended left behind."""

    def __init__(self, lot: Lot, layout: Layout) -> None:
        self.lot = lot
        self.blocks = lot.blocks(layout)  # with which each case begins, then those that it ends with
        self.qpos, self.qvel = lot.values(lambda chain: chain.start_qpos), lot.values(lambda chain: chain.start_qvel)
        self.numbers = {name: lot.values(_number(name)) for name in numbers_of(lot.chain)}
        self.next = 0  # case to begin
        self._left: dict[int, Array] = {}  # records of each case that has ended
        self._since = 0.0  # when the first of them did
        self._open = len(lot)  # cases that have not

    def end(self, case: int, block: Array, recorded: Array) -> None:
        """Keep what a case left behind: its block, which is copied, and its records, which are not."""
        if not self._left:
            self._since = time.monotonic()
        self.blocks[case], self._left[case] = block, recorded
        self._open -= 1

    @property
    def is_over(self) -> bool:
        """Whether all cases have ended and been asked for."""
        return self._open == 0 and not self._left

    @property
    def due(self) -> bool:
        """Whether what has ended is to be measured: all, or some that have waited for long."""
        return bool(self._left) and (self._open == 0 or time.monotonic() - self._since > _PATIENCE)

    def measured(self, layout: Layout) -> Measured:
        """The cases that have ended since this was asked last."""
        cases, left = sorted(self._left), self._left
        self._left = {}
        whole = len(cases) == len(self.lot)
        lot, blocks = (self.lot, self.blocks) if whole else (self.lot.take(cases), self.blocks[cases])
        return Measured.of(lot, layout, blocks, [left[case] for case in cases])


@cache
def _number(name: str) -> Callable[[Chain], Array]:
    """What gives a field of a model in which chains differ."""
    return lambda chain: numbers_of(chain)[name]


class _Engine:
    """A batch of MuJoCo for cases of one size, stepped in the thread that calls it."""

    def __init__(self, chain: Chain, size: Size, places: int) -> None:
        self._within = steps_within(chain)
        self._n_ring = n_ring = _RING if self._within else _SHORT_RING
        self.layout = Layout.of(chain, size.n_value, n_ring, self._within)
        self._steps = n_ring * size.steps_per_record // (self._within or 1)
        rings = -(-size.n_records // n_ring)
        bytes_each = rings * n_ring * size.n_vehicle * np.dtype(float).itemsize
        self._places = max(1, min(places, _HISTORY_BYTES // bytes_each))
        model = build(chain, self.layout, bare=True)
        model.opt.timestep *= self._within or 1
        self._batch = Batch(model, self._places, 1)
        self._numbers = {name: self._batch.expand(name) for name in numbers_of(chain)}
        self._blocks = self._batch.bind("userdata")
        self._qpos, self._qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._fresh_row = self._batch.state[0].copy()
        self._rings = self.layout.ring(self._blocks)
        self._history = np.empty((rings, self._places, n_ring, size.n_vehicle))  # what few need stays untouched
        self._read = np.zeros(self._places, dtype=int)  # records of each place that are in its history

    def run(self, lots: Iterator[Lot]) -> Iterator[Measured]:
        """Compute lots of this engine's size."""
        free = list(range(self._places))
        under_way: dict[int, tuple[_Begun, int]] = {}  # lot and case, by place
        begun: deque[_Begun] = deque()  # lots of which not all cases have begun
        open_: list[_Begun] = []  # lots of which not all have been measured
        while True:
            new: list[int] = []
            while free:
                if not begun:
                    lot = next(lots, None)
                    if lot is None:
                        break
                    begun.append(_Begun(lot, self.layout))
                    open_.append(begun[-1])
                new += self._begin(begun[0], free, under_way)
                if begun[0].next == len(begun[0].lot):
                    begun.popleft()
            if new:
                self._batch.set_const(ids=np.sort(new))  # MuJoCo keeps inertias that follow from the masses
            if not under_way:
                return
            ids = np.sort(list(under_way))
            while (ended := self._advance(ids)).size == 0:
                pass
            for place in ended.tolist():
                of, case = under_way.pop(place)
                free.append(place)
                n = int(self._blocks[place, Head.RECORDS])
                records = self._history[: -(-n // self._n_ring), place].transpose(2, 0, 1)
                of.end(case, self._blocks[place], records.reshape(len(records), -1)[:, :n].T)  # reshaped is copied
            for of in [of for of in open_ if of.due]:
                measured = of.measured(self.layout)
                if of.is_over:
                    open_.remove(of)
                again = measured.jumped & (not of.lot.chain.refined)
                for place in np.flatnonzero(again).tolist():  # with smaller steps
                    chain = replace(measured.lot.chain_of(place), refined=True)
                    begun.appendleft(_Begun(Chains([measured.lot.keys[place]], [chain]), self.layout))
                    open_.append(begun[0])
                if not again.all():
                    yield measured.take(np.flatnonzero(~again))

    def _begin(self, lot: _Begun, free: list[int], under_way: dict[int, tuple[_Begun, int]]) -> list[int]:
        """Begin cases of a lot at free places, which are taken; return them."""
        n = min(len(free), len(lot.lot) - lot.next)
        places, cases = free[:n], range(lot.next, lot.next + n)
        del free[:n]
        lot.next += n
        under_way |= {place: (lot, case) for place, case in zip(places, cases, strict=True)}
        rows = slice(cases.start, cases.stop)
        self._batch.state[places] = self._fresh_row
        for name, values in lot.numbers.items():
            self._numbers[name][places, int(name.startswith("body")) :] = values[rows]  # body 0 is the world
        self._qpos[places], self._qvel[places] = lot.qpos[rows], lot.qvel[rows]
        self._blocks[places] = lot.blocks[rows]
        self._read[places] = 0
        return places

    def _advance(self, ids: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
        """Step some simulations through one ring of records, keep it, and return those that are done."""
        self._batch.step(ids=ids, nstep=self._steps)
        if (self._blocks[ids, Head.TIME] < 0.0).any():
            raise EngineError(LAW_NOT_CALLED)
        if (self._blocks[ids, Head.STRAYED] > _CLOSE).any():
            raise EngineError("something else moved the vehicles: a force that is none of the device law's")
        records, read, ring = self._blocks[ids, Head.RECORDS].astype(int), self._read[ids], self._n_ring
        if (read % ring == 0).all():
            self._history[read // ring, ids] = self._rings[ids]
        else:  # steps were made smaller, and a ring is no whole one
            for r in range(ring):
                new = read + r < records
                place, n = ids[new], read[new] + r
                self._history[n // ring, place, n % ring] = self._rings[place, n % ring]
        self._read[ids] = records
        return np.asarray(ids[self._blocks[ids, Head.DONE] != 0.0])
