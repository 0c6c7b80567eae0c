"""Sweeps on a Dask cluster: the same cases, the same code, the same table, on as many machines as there are.

A task is a handful of cases. Dask gives the tasks of a worker that dies to another one, so nothing is lost, and what
has ended is in the sweep's file already.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any

from trainmj.cases.table import Case, Engine, Row, case_rows
from trainmj.errors import InputError
from trainmj.scenario import Scenario, from_yaml, to_yaml

try:
    from dask.distributed import Client, LocalCluster, as_completed
except ImportError:
    raise InputError("--dask needs the package dask: pip install 'trainmj[dask]'") from None

LOCAL = "local"
CASES_PER_TASK = 32
"""Cases in one task: a task costs Dask about 2 ms, a collision ten."""

_TASKS_PER_THREAD = 3  # handed out ahead, so that no worker waits


@contextmanager
def connected(address: str, scenario: Scenario) -> Iterator[Engine]:
    """An engine for :func:`trainmj.run_sweep` that computes on a cluster.

    Args:
        address: of a Dask scheduler ("tcp://host:8786"), or "local" for one worker per core of this machine.
        scenario: what the cases vary.

    Raises:
        InputError: if there is no scheduler at the address.
    """
    if address == LOCAL:
        with LocalCluster(threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
            yield engine(client, scenario)
        return
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(f"--dask {address}: there is no scheduler to reach at this address ({error})") from None
    with client:
        yield engine(client, scenario)


def engine(client: Client, scenario: Scenario) -> Engine:
    """An engine that computes with a Dask client of the caller's."""
    text = to_yaml(scenario)

    def compute(cases: Iterable[tuple[int, Case]]) -> Iterator[tuple[int, Row]]:
        source = iter(cases)
        running = as_completed([], with_results=True)
        handed_out = 0

        def hand_out(most: int) -> None:
            nonlocal handed_out
            while handed_out < most and (chunk := list(islice(source, CASES_PER_TASK))):
                running.add(client.submit(compute_chunk, text, chunk, pure=False))
                handed_out += 1

        hand_out(_ahead(client))
        while handed_out:
            _, rows = next(running)
            handed_out -= 1
            hand_out(_ahead(client))
            yield from rows

    return compute


def compute_chunk(scenario: str, cases: list[tuple[int, dict[str, Any]]]) -> list[tuple[int, Row]]:
    """Compute some cases in a worker, on one thread.

    Args:
        scenario: as YAML text.
        cases: number and changes of each.
    """
    return list(case_rows(from_yaml(scenario), cases, threads=1))


def _ahead(client: Client) -> int:
    threads: int = sum(client.nthreads().values())
    return max(1, threads) * _TASKS_PER_THREAD
