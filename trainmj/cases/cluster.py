"""Cases on a Dask cluster: the same code and the same numbers on any number of machines.

A task is a handful of cases. Dask gives the tasks of a worker that dies to another one, so nothing is lost; finished
cases are in the store already.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice
from typing import Any

from trainmj.cases.engine import Case, Computed, Engine, Local
from trainmj.collision.identity import changes, identity
from trainmj.errors import EngineError, InputError
from trainmj.scenario import Scenario, from_yaml, to_yaml

try:
    from dask.distributed import Client, LocalCluster, Security, as_completed
    from distributed.client import FutureCancelledError
    from distributed.comm.core import connect
    from distributed.scheduler import KilledWorker
except ImportError:
    raise InputError("--dask needs the package dask: pip install 'trainmj[dask]'") from None

LOCAL = "local"
CASES_PER_TASK = 32
"""Cases in one task: a task costs Dask about 2 ms, a collision ten."""

_TASKS_PER_THREAD = 3  # handed out ahead, so that no worker waits
_PATIENCE = 10.0  # with a scheduler that does not answer [s]
_MAY_DIFFER = "platform"  # between this process and the workers, not among the workers
_LOST = (CancelledError, FutureCancelledError, KilledWorker, OSError)
"""What Dask raises when the cluster is gone, or cases have killed their workers repeatedly."""


@contextmanager
def connected(address: str, scenario: Scenario) -> Iterator[Engine]:
    """An engine that computes on a cluster.

    Args:
        address: of a Dask scheduler ("tcp://host:8786"), or "local" for one worker per core of this machine.
        scenario: what the cases vary.

    Raises:
        InputError: if no scheduler answers at the address, or it has no workers or unsuitable ones.
    """
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors come back as exceptions
    if address == LOCAL:
        with LocalCluster(threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
            yield engine(client, scenario)
        return
    try:
        asyncio.run(asyncio.wait_for(_reach(address), _PATIENCE))  # a client would wait for another service for ever
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--dask {address}: no scheduler answers at this address ({str(error) or 'timed out'})"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError:
            raise InputError(f"--dask {address}: the scheduler has no workers: start some first") from None
        yield engine(client, scenario)


async def _reach(address: str) -> None:
    comm = await connect(address, **Security().get_connection_args("client"))
    await comm.close()


def engine(client: Client, scenario: Scenario) -> Engine:
    """An engine that computes with a given Dask client; waits for the first worker.

    Raises:
        InputError: if a worker has other versions than this process, or another processor than the other workers.
    """
    client.wait_for_workers(1)
    return _Cluster(client, scenario)


class _Cluster:
    """The workers of a client."""

    def __init__(self, client: Client, scenario: Scenario) -> None:
        self._client = client
        self._scenario = to_yaml(scenario)
        workers = client.run(identity, on_error="return")
        first = next((found for found in workers.values() if isinstance(found, dict)), {})
        self.identity = identity() | {_MAY_DIFFER: first.get(_MAY_DIFFER, "")}
        for worker, found in workers.items():
            self._agree(worker, found)

    def _agree(self, worker: str, found: Mapping[str, str] | Exception) -> None:
        """Refuse a worker that would compute other numbers."""
        if isinstance(found, Exception):
            raise InputError(f"worker {worker}: trainmj cannot be used there ({found}): install the same version")
        if differs := "; ".join(changes(found, self.identity, ("there", "here"))):
            raise InputError(f"worker {worker}: would compute other numbers: {differs}: make all machines alike")

    def __call__(self, cases: Iterable[tuple[Any, Case]]) -> Iterator[Computed]:
        """Hand cases out and yield each as its task ends."""
        source = iter(cases)
        tasks = iter(lambda: list(islice(source, CASES_PER_TASK)), [])
        running = as_completed([], with_results=True)
        try:
            while True:
                most = max(1, sum(self._client.nthreads().values())) * _TASKS_PER_THREAD
                for task in islice(tasks, max(0, most - running.count())):
                    running.add(self._client.submit(compute, self._scenario, task, pure=False))
                if running.is_empty():
                    return
                _, result = next(running)
                if isinstance(result, Exception):  # Dask returns the error of a cancelled task
                    raise result
                worker, found, computed = result
                self._agree(worker, found)
                yield from computed
        except _LOST as error:
            said = (str(error) or type(error).__name__).splitlines()[0]
            raise EngineError(
                f"the cluster failed ({said}); finished cases are kept: the same command goes on"
            ) from None


def compute(scenario: str, cases: list[tuple[Any, dict[str, Any]]]) -> tuple[str, dict[str, str], list[Computed]]:
    """Compute cases of a scenario (YAML text) in a worker, on one thread: its address, its identity, and the cases."""
    from dask.distributed import get_worker

    return get_worker().address, identity(), list(Local(from_yaml(scenario), threads=1)(cases))
