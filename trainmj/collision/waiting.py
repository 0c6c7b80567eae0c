"""Lots that wait to be computed, sorted by the size of their models; several threads take them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from threading import Lock
from typing import NamedTuple, Self

from trainmj.collision.block import n_values
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.lot import Lot

_LOOK_AHEAD = 1024  # cases of other sizes that are kept waiting while those of one size run
_VALUES = 256  # room for curves grows in these steps, so that few models are compiled
_LEAST = 32  # cases of a part of a lot: what takes as long for any number of them is no small share of fewer


class Size(NamedTuple):
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
    def of(cls, chain: Chain) -> Self:
        """That of a case."""
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


class Waiting:
    """Lots sorted by size as they are read, of a limited number of cases ahead.

    The last ones are handed out in parts, smaller and smaller ones, so that all threads end at about the same time.
    """

    def __init__(self, lots: Iterable[Lot], threads: int) -> None:
        """Take what gives lots, which is asked by one thread at a time, and how many threads there are."""
        self._source, self._reading = iter(lots), Lock()
        self._waiting: dict[Size, deque[Lot]] = {}
        self._lock = Lock()  # of what waits
        self._threads, self._ahead = threads, min(2, threads)  # to know the last lot, the one behind it is read
        self._n_read = 0  # cases
        self._all_read = False

    @property
    def share(self) -> int:
        """Cases that a thread may have under way so that the others have as many: without bound while more may come."""
        return max(_LEAST, -(-self._n_read // self._threads)) if self._all_read else 2**31

    def fullest(self) -> tuple[Size, Chain] | None:
        """The size with the most cases waiting, and one of their structure; None when there is no case left."""
        while True:
            over = self._all_read  # before what waits is looked at
            with self._lock:
                if sum(map(len, self._waiting.values())) >= (1 if over else self._ahead):
                    size = max(self._waiting, key=self._n_waiting)
                    return size, self._waiting[size][0].chain
            if over:
                return None
            self._read()

    def take(self, size: Size) -> Iterator[Lot]:
        """Lots of one size, until too many others are waiting."""
        while (lot := self._next(size)) is not None:
            yield lot

    def _next(self, size: Size) -> Lot | None:
        while True:
            over = self._all_read
            with self._lock:
                n = len(self._waiting.get(size, ()))
                full = sum(self._n_waiting(other) for other in self._waiting if other != size) >= _LOOK_AHEAD
                if n >= (1 if over or full else self._ahead):
                    return self._popped(size)
            if over or full:
                return None
            self._read()

    def _popped(self, size: Size) -> Lot:
        """The first lot of a size, or a part of it if few are left."""
        line, left = self._waiting[size], self._n_waiting(size)
        lot = line.popleft()
        n = max(_LEAST, -(-left // self._threads))
        if self._all_read and self._threads > 1 and n < len(lot):
            line.appendleft(lot.take(range(n, len(lot))))
            lot = lot.take(range(n))
        if not line:
            del self._waiting[size]
        return lot

    def _n_waiting(self, size: Size) -> int:
        return sum(map(len, self._waiting[size]))

    def _read(self) -> None:
        """Take one more lot from the source, if there is one."""
        with self._reading:
            for lot in self._source:
                with self._lock:
                    self._waiting.setdefault(Size.of(lot.chain), deque()).append(lot)
                    self._n_read += len(lot)
                return
            self._all_read = True
