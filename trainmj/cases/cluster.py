"""Cases on a Dask cluster: the same code and the same numbers on any number of machines.

A task is as many cases as take a fraction of a second. Dask gives the tasks of a worker that dies to another one, so
nothing is lost; finished cases are in the store already.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from copy import copy
from itertools import islice
from typing import Any

from trainmj.cases.engine import ALL, Engine, Local
from trainmj.cases.rows import Rows
from trainmj.collision.cases import Cases
from trainmj.collision.identity import changes, identity
from trainmj.errors import EngineError, InputError, TrainmjError
from trainmj.files.text import printable
from trainmj.scenario import Scenario, from_yaml, to_yaml

try:
    from dask.distributed import Client, Scheduler, Security, SpecCluster, Worker, as_completed
    from dask.system import CPU_COUNT
    from distributed.comm.core import connect
    from distributed.node import ServerNode
except ImportError:
    raise InputError("--dask needs the package dask: pip install 'trainmj[dask]'") from None

LOCAL = "local"
CASES_PER_TASK = 32
"""Fewest cases in one task, and as many as are in the first ones; a task costs Dask about 2 ms."""

_MOST_PER_TASK = 512
_TASK_TIME = 0.25  # that a task shall take [s]: what is finished is kept soon
_TASKS_PER_THREAD = 3  # handed out ahead, so that no worker waits
_PATIENCE = 10.0  # with a scheduler that does not answer [s]
_LONGER = 30.0  # with workers, which may have to read trainmj from a slow disk, or to be started again [s]
_PAUSE = 0.01  # from one look for results to the next [s]
_MAY_DIFFER = "platform"  # between this process and the workers, not among the workers
_KEPT = "finished cases are kept: the same command goes on"


@contextmanager
def connected(address: str, scenario: Scenario) -> Iterator[Engine]:
    """An engine that computes on a cluster.

    Args:
        address: of a Dask scheduler ("tcp://host:8786"), or "local" for a worker in this process.
        scenario: what the cases vary.

    Raises:
        InputError: if no scheduler answers at the address, or it has no workers or unsuitable ones.
    """
    for name in ("distributed", "distributed.client", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors come back as exceptions
    if address == LOCAL:
        with _local_client() as client:
            yield engine(client, scenario, _LONGER)
        return
    with _client(address) as client:
        yield engine(client, scenario, _PATIENCE)


@contextmanager
def _local_client() -> Iterator[Client]:
    """A client of a worker in this process, with a thread for each core; nothing listens: nobody else hands it work."""
    here = {"protocol": "inproc://", "dashboard": False}
    scheduler = {"cls": _Scheduler, "options": here}
    worker = {"cls": _Worker, "options": {**here, "nthreads": CPU_COUNT}}
    with SpecCluster(scheduler=scheduler, workers={0: worker}) as cluster, Client(cluster) as client:
        yield client


class _Silent(ServerNode):
    """A part of a cluster without the HTTP server that Dask starts even where no dashboard is asked for."""

    def start_http_server(self, *_: object, **__: object) -> None:
        """Start none."""


class _Scheduler(_Silent, Scheduler):
    """The scheduler in this process."""


class _Worker(_Silent, Worker):
    """The worker in this process."""


def _client(address: str) -> Client:
    try:
        with ThreadPoolExecutor(1) as apart:  # from a loop that runs here, as in a notebook
            apart.submit(asyncio.run, _reach(address)).result()
        return Client(address, timeout=_PATIENCE)
    except Exception as error:  # noqa: BLE001 another service answers what it likes
        said = printable(str(error)) or "timed out"
        raise InputError(f"--dask {address}: no scheduler answers at this address ({said})") from None


async def _reach(address: str) -> None:
    """Find out whether a scheduler answers; a client would wait for another service for ever."""
    async with asyncio.timeout(_PATIENCE):
        comm = await connect(address, **Security().get_connection_args("client"))
        await comm.close()


def engine(client: Client, scenario: Scenario, patience: float | None = None) -> Engine:
    """An engine that computes with a given Dask client.

    Args:
        client: of a scheduler.
        scenario: what the cases vary.
        patience: how long to wait for the first worker, and for others when all have left [s]; by default as long as it
            takes, since jobs may stand in a queue.

    Raises:
        InputError: if there is no worker, one does not answer or has other versions than this process, or another
            processor than the other workers.
        EngineError: if the scheduler does not answer.
    """
    with _working(client):
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise InputError(f"the scheduler {_address(client)} has no workers: start some first") from None
    return _Cluster(client, scenario, queue=patience is None)


class _Cluster:
    """The workers of a client."""

    def __init__(self, client: Client, scenario: Scenario, queue: bool) -> None:
        self._client, self._queue, self._per_task = client, queue, CASES_PER_TASK
        self._scenario, self._responses = to_yaml(scenario), ALL
        self.identity = identity()
        with _working(self._client):
            workers = self._workers()
            first = next((found for found in workers.values() if isinstance(found, dict)), {})
            self.identity |= {_MAY_DIFFER: first.get(_MAY_DIFFER, "")}
            self._agree(workers)

    def of(self, scenario: Scenario, responses: Sequence[str] = ALL) -> Engine:
        """The same for cases of another scenario, and the responses that names or patterns choose."""
        other = copy(self)
        other._scenario, other._responses = to_yaml(scenario), tuple(responses)
        return other

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Rows]:
        """Hand cases out and yield those of each task as it ends."""
        tasks = self._tasks(cases)
        running = as_completed([], with_results=True)
        while True:
            with _working(self._client):
                threads = self._client.sync(self._client.nthreads, callback_timeout=_PATIENCE)
                most = max(1, sum(threads.values())) * _TASKS_PER_THREAD
            for task in islice(tasks, max(0, most - running.count())):
                running.add(self._client.submit(compute, self._scenario, self._responses, task, pure=False))
            if running.is_empty():
                return
            with _working(self._client):
                worker, found, seconds, computed = self._next(running)
                self._agree({worker: found})
            n = sum(map(len, computed))
            self._per_task = min(max(CASES_PER_TASK, int(_TASK_TIME * n / seconds)), _MOST_PER_TASK)
            yield from computed

    def _tasks(self, cases: Iterable[Cases]) -> Iterator[Cases]:
        """The cases of one task after the other."""
        for some in cases:
            first = 0
            while first < len(some):
                yield some.take(range(first, first := min(first + self._per_task, len(some))))

    def _next(self, running: as_completed) -> Any:
        """The next result; asks the workers whether they are there when there is none for long."""
        until = time.monotonic() + _LONGER
        while not running.has_ready():
            time.sleep(_PAUSE)
            if time.monotonic() > until:
                self._agree(self._workers())
                until = time.monotonic() + _LONGER
        _, result = next(running)
        if isinstance(result, Exception):  # Dask returns the error of a task that failed, or was cancelled
            raise result
        return result

    def _workers(self) -> dict[str, Any]:
        """What each worker says of its identity, or the error that it ends in."""

        async def asked(worker: str) -> Any:
            try:
                answer = self._client.run(identity, workers=[worker], on_error="return")
                return (await asyncio.wait_for(answer, _LONGER))[worker]
            except TimeoutError:
                return TimeoutError(f"no answer in {_LONGER:g} s")

        async def all_asked() -> dict[str, Any]:
            workers = list(await asyncio.wait_for(self._client.nthreads(), _PATIENCE))
            return dict(zip(workers, await asyncio.gather(*map(asked, workers)), strict=True))

        found: dict[str, Any] = self._client.sync(all_asked)
        if not found and not self._queue:
            raise OSError("no worker is left")
        return found

    def _agree(self, workers: Mapping[str, Any]) -> None:
        """Refuse workers that would compute other numbers, or none."""
        for worker, found in workers.items():
            if isinstance(found, OSError):
                raise InputError(f"worker {worker}: does not answer ({_said(found)}): stop it; {_KEPT}")
            if isinstance(found, Exception):
                raise InputError(
                    f"worker {worker}: trainmj cannot be used there ({_said(found)}): install the same version"
                )
            if differs := "; ".join(changes(found, self.identity, ("there", "here"))):
                raise InputError(f"worker {worker}: would compute other numbers: {differs}: make all machines alike")


@contextmanager
def _working(client: Client) -> Iterator[None]:
    """Say that the cluster failed, whatever Dask says."""
    try:
        yield
    except TrainmjError:
        raise
    except Exception as error:  # noqa: BLE001 Dask raises many kinds
        raise EngineError(f"the cluster {_address(client)} failed ({_said(error)}); {_KEPT}") from None


def _address(client: Client) -> str:
    return str(client.scheduler.address) if client.scheduler else ""


def _said(error: BaseException) -> str:
    """The first line of what an error says."""
    lines = printable(str(error)).splitlines()
    return lines[0] if lines else type(error).__name__


def compute(scenario: str, responses: Sequence[str], cases: Cases) -> tuple[str, dict[str, str], float, list[Rows]]:
    """Compute cases in a worker, on one thread.

    Args:
        scenario: what they vary, as YAML text.
        responses: patterns of those that are wanted.
        cases: of one task.

    Returns:
        The address and the identity of the worker, how long it took [s], and the cases.
    """
    from dask.distributed import get_worker

    began = time.monotonic()
    computed = list(Local(from_yaml(scenario), threads=1, responses=responses)([cases]))
    return get_worker().address, identity(), time.monotonic() - began, computed
