"""What a process that measures can do: a line of JSON with a piece of work in, a line with what it found out.

:mod:`performance` starts it with the checkout to be measured in PYTHONPATH. Only names that any checkout has are used
for what is compared with another one: scenarios, sweeps, tables, and MuJoCo's own batches.
"""

from __future__ import annotations

import ctypes
import json
import logging
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import mujoco.batch
import numba
import numpy as np

import trainmj
from trainmj.collision.identity import identity

Numbers = dict[str, Any]

SPIN = 200_000_000
"""Rounds of a loop that does nothing else than count, for what two processes gain here."""

SCIPY = (("LSODA", 1e-3), ("RK23", 1e-4))
"""The fastest methods of solve_ivp, each at the loosest tolerance with which TS is within 0.05 %."""


@numba.cfunc("float64()", cache=True)  # type: ignore[misc]
def _no_clock() -> float:
    return 0.0


_CLOCK = ctypes.CFUNCTYPE(ctypes.c_double)(_no_clock.address)
"""A clock for MuJoCo that stands still, as it does while the law of the devices is installed."""

_in_mujoco: list[float] = []  # processor time of each call into a batch [s]
_to_close = ExitStack()
_batches: list[tuple[mujoco.MjModel, int]] = []  # model and places of the last batch that was made


def _watch_batches() -> None:
    """Time the calls into MuJoCo's batches, in the thread that makes them, and note what they are of."""
    step, make = mujoco._batch.Batch.step, mujoco.batch.Batch.__init__

    def timed(batch: Any, *args: Any, **options: Any) -> Any:
        began = time.thread_time()
        try:
            return step(batch, *args, **options)
        finally:
            _in_mujoco.append(time.thread_time() - began)

    def noted(batch: Any, model: mujoco.MjModel, nsim: int, *args: Any, **options: Any) -> None:
        make(batch, model, nsim, *args, **options)
        _batches[:] = [(model, nsim)]

    mujoco._batch.Batch.step, mujoco.batch.Batch.__init__ = timed, noted


@contextmanager
def _timed(found: Numbers) -> Iterator[None]:
    """Add the wall and processor time of a block to what was found, and that of MuJoCo in it."""
    _in_mujoco.clear()
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    found |= {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu, "mujoco": sum(_in_mujoco)}


def about() -> Numbers:
    """Where trainmj comes from, and the versions of what computes."""
    return {"package": str(Path(trainmj.__file__).parent), **identity()}


def _planned(scenario: str | dict[str, Any], changes: dict[str, Any], vary: dict[str, Any], only: Sequence[str]) -> Any:
    base = trainmj.load(scenario) if isinstance(scenario, str) else trainmj.Scenario.from_values(scenario)
    return trainmj.grid_of(base.with_values(changes) if changes else base, vary, only)


def sweep(
    scenario: str | dict[str, Any],
    vary: dict[str, Any],
    changes: dict[str, Any] | None = None,
    threads: int = 1,
    only: Sequence[str] = ("*",),
) -> Numbers:
    """A sweep with its files, from the scenario to the table: its times, cases, and steps of ``step_ms``."""
    found: Numbers = {}
    with tempfile.TemporaryDirectory() as folder:
        with _timed(found):
            planned = _planned(scenario, changes or {}, vary, only)
            trainmj.run_sweep(planned, folder, threads=threads)
        durations = trainmj.read_table(folder)["duration_s"]
        bytes_kept = sum(file.stat().st_size for file in Path(folder).iterdir())
    steps = float(durations.sum()) / (planned.scenario.simulation.step_ms / 1e3)
    return found | {"cases": len(planned), "steps": round(steps), "bytes": bytes_kept}


def bare(steps: int, threads: int) -> Numbers:
    """MuJoCo alone, its timers off: so many steps of the model of the last sweep, in as many places in each thread."""
    ((model, places),) = _batches
    batch = mujoco.batch.Batch(model, places * threads, threads)
    _batches[:] = [(model, places)]
    found: Numbers = {}
    mujoco.set_mjcb_time(_CLOCK)
    try:
        with _timed(found):
            batch.step(nstep=round(steps / (places * threads)))
    finally:
        mujoco.set_mjcb_time(None)
    return found


def spin() -> Numbers:
    """A loop that needs no memory and no lock."""
    found: Numbers = {}
    with _timed(found):
        _spin(SPIN)
    return found


@numba.njit(cache=True)  # type: ignore[misc]
def _spin(rounds: int) -> int:
    x = np.uint64(1)
    for _ in range(rounds):
        x ^= x << np.uint64(13)
        x ^= x >> np.uint64(7)
        x ^= x << np.uint64(17)
    return int(x)


def outcomes(
    scenario: str | dict[str, Any], vary: dict[str, Any], changes: dict[str, Any], threads: int = 0
) -> Numbers:
    """What a sweep finds, case by case: TS, TAMA, and stroke and peak force of every interface; why, if it cannot."""
    found: Numbers = {}
    try:
        with tempfile.TemporaryDirectory() as folder:
            with _timed(found):
                trainmj.run_sweep(_planned(scenario, changes, vary, ("*",)), folder, threads=threads)
            table = trainmj.read_table(folder)
    except trainmj.InputError as error:
        return {"refused": str(error)}
    if "TS_mm" not in table or table["TS_mm"].isna().any():
        return {"refused": max(table["reason"])}
    interfaces = [name[len("force_") : -len("_kN")] for name in table if name.startswith("force_")]
    return found | {
        "TS_mm": table["TS_mm"].tolist(),
        "TAMA_g": table["TAMA_g"].tolist(),
        "stroke_mm": table[[f"stroke_{one}_mm" for one in interfaces]].to_numpy().tolist(),
        "force_kN": table[[f"force_{one}_kN" for one in interfaces]].to_numpy().tolist(),
    }


def loop(scenario: str, vary: dict[str, Any], steps_ms: Sequence[float], seconds: float) -> dict[str, Numbers]:
    """The same equations in one compiled loop, by its step [ms]: times [s], and TS and strokes of each case.

    Every case is followed for so many seconds, as the loop does not know when a collision is over.
    """
    from others import bare_loop, crushed, loop_arguments, ts_of

    found = {}
    planned = _planned(scenario, {}, vary, ("*",))
    chains = [trainmj.line_up(planned.scenario_of(number)) for number in range(len(planned))]
    bare_loop(*loop_arguments(chains[0], 1e-4, 1))  # compiles it
    for step_ms in steps_ms:
        step = step_ms / 1e3
        ts, strokes, spent = [], [], {"wall": 0.0, "cpu": 0.0}
        for chain in chains:
            arguments = loop_arguments(chain, step, round(seconds / step))
            wall, cpu = time.perf_counter(), time.thread_time()
            most = bare_loop(*arguments)
            spent["wall"] += time.perf_counter() - wall
            spent["cpu"] += time.thread_time() - cpu
            ts.append(ts_of(chain, most) * 1e3)
            strokes.append((most * crushed(chain)[1] * 1e3).tolist())  # of one side, where two twins meet
        found[f"{step_ms:g}"] = {**spent, "cases": len(chains), "TS_mm": ts, "stroke_mm": strokes}
    return found


def by_ways(turns: int) -> dict[str, Numbers]:
    """The standard collision as it ships, computed in several ways in turns: times, and how far TS is off [%]."""
    from others import PythonLaw, bare_loop, by_scipy, loop_arguments, ts_of
    from turns import alternate, medians

    scenario, fine = trainmj.load("b_type"), trainmj.load("b_type", {"simulation.step_ms": 0.005})
    exact = trainmj.summarise(trainmj.run(fine)).TS_mm
    chain = trainmj.line_up(scenario)
    until = float(trainmj.run(scenario).time[-1])
    steps = round(until / chain.step)
    ways: dict[str, tuple[Callable[[], Any], Callable[[Any], float] | None]] = {
        "trainmj.run": (lambda: trainmj.run(scenario), lambda result: trainmj.summarise(result).TS_mm),
        "law in Python, called back by MuJoCo": (lambda: PythonLaw(chain).run(steps), None),
        **{
            f"scipy solve_ivp, {method}, rtol {rtol:g}": (
                lambda m=method, r=rtol: by_scipy(chain, until, r, m),
                lambda strokes: ts_of(chain, strokes) * 1e3,
            )
            for method, rtol in SCIPY
        },
        "bare compiled loop": (
            lambda: bare_loop(*loop_arguments(chain, chain.step, steps)),
            lambda strokes: ts_of(chain, strokes) * 1e3,
        ),
    }

    def one(work: Callable[[], Any], ts: Callable[[Any], float] | None) -> Numbers:
        found: Numbers = {}
        with _timed(found):
            result = work()
        return found | ({"TS_percent": abs(ts(result) / exact - 1) * 100} if ts else {})

    taken = alternate({name: lambda way=way: one(*way) for name, way in ways.items()}, turns)
    return {name: medians(turns_of_it) for name, turns_of_it in taken.items()}


def by_dask(workers: int, scenario: str, vary: dict[str, Any], changes: dict[str, Any]) -> Numbers:
    """A sweep on a local Dask cluster of so many worker processes of one thread, which are there already."""
    from trainmj.cases.cluster import engine

    found: Numbers = {}
    planned = _planned(scenario, changes, vary, ("*",))
    computing = engine(_client(workers), planned.scenario)
    with tempfile.TemporaryDirectory() as folder, _timed(found):
        trainmj.run_sweep(planned, folder, engine=computing)
    return found | {"cases": len(planned)}


@cache
def _client(workers: int) -> Any:
    from dask.distributed import Client, LocalCluster

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # of workers that end slowly
    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address="127.0.0.1:0")
    return _to_close.enter_context(Client(_to_close.enter_context(cluster)))


def main() -> None:
    """Do what is asked for until there is nothing more."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what is printed is no answer
    _watch_batches()
    known = {work.__name__: work for work in (about, sweep, bare, spin, outcomes, loop, by_ways, by_dask)}
    with _to_close:
        for line in sys.stdin:
            work, arguments = json.loads(line)
            print(json.dumps(known[work](**arguments)), file=answers, flush=True)


if __name__ == "__main__":
    main()
