"""How fast collisions are computed, and against what: one command, one table, one JSON file.

    python benchmarks/collisions.py [--quick] [--json FILE]

All figures are of one run on one machine; each is the least of several turns in which the competitors alternate, so
that a machine that others use, too, slows all of them alike. Quote the ratios. ``steps.py`` has what a step costs.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from others import PythonLaw, bare_loop, by_scipy, loop_arguments

import trainmj
from trainmj.collision import kernel
from trainmj.collision.batch import run_chains
from trainmj.collision.block import Layout
from trainmj.collision.chain import Chain
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.collision.model import build
from trainmj.collision.simulation import start

STEPS = 8000
FAST_STEP = 0.5  # ms; its TS is within 0.05 % of the converged one, as this script shows
SCIPY = (("LSODA", 1e-3), ("RK23", 1e-4))
"""The fastest methods of solve_ivp, each at the loosest tolerance with which TS is within 0.05 %."""


def seconds(work: Callable[[], Any]) -> float:
    """Wall time of a piece of work."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def alternate(competitors: dict[str, Callable[[], Any]], turns: int) -> dict[str, float]:
    """Least wall time of each [s], taken in turns after one that does not count."""
    times: dict[str, list[float]] = {name: [] for name in competitors}
    for turn in range(turns + 1):
        for name, work in competitors.items():
            spent = seconds(work)
            if turn:
                times[name].append(spent)
    return {name: min(taken) for name, taken in times.items()}


@contextmanager
def clockless() -> Iterator[None]:
    """MuJoCo's timers off, as they are while the device law is installed."""
    mujoco.set_mjcb_time(kernel._callbacks()[2])
    try:
        yield
    finally:
        mujoco.set_mjcb_time(None)


def one_collision(turns: int) -> dict[str, float]:
    """12 vehicles, 8000 steps, one thread: with the law, without it, and in other ways [s]."""
    chain = trainmj.line_up(trainmj.load("b_type"))
    layout = Layout.of(chain)
    models = {"full model": build(chain, layout), "bare model": build(chain, layout, bare=True)}

    def step(model: mujoco.MjModel, law: bool, clock: bool) -> None:
        data = start(model, chain, layout)
        if law:
            with kernel.installed():
                mujoco.mj_step(model, data, nstep=STEPS)
        elif clock:
            mujoco.mj_step(model, data, nstep=STEPS)
        else:
            with clockless():
                mujoco.mj_step(model, data, nstep=STEPS)

    work: dict[str, Callable[[], Any]] = {}
    for name, model in models.items():
        work[f"{name}, with the law"] = lambda m=model: step(m, True, False)
        work[f"{name}, without it"] = lambda m=model: step(m, False, True)
        work[f"{name}, without it or timers"] = lambda m=model: step(m, False, False)
    work["bare compiled loop (numba)"] = lambda: bare_loop(*loop_arguments(chain, STEPS))
    times = alternate(work, turns)
    times |= alternate(
        {
            "Python callback in MuJoCo": lambda: PythonLaw(chain).run(STEPS),
            **{
                f"scipy solve_ivp, {method}, rtol {rtol:g}": lambda m=method, r=rtol: by_scipy(chain, 0.75, r, m)
                for method, rtol in SCIPY
            },
        },
        max(1, turns // 4),
    )
    return times


def accuracy() -> dict[str, float]:
    """Deviation of TS from that of a step of 0.005 ms [%], of each step and of scipy."""
    fine = trainmj.summarise(trainmj.run(trainmj.load("b_type", {"simulation.step_ms": 0.005}))).TS_mm
    found = {}
    for step in (0.1, 0.2, 0.25, FAST_STEP):
        summary = trainmj.summarise(trainmj.run(trainmj.load("b_type", {"simulation.step_ms": step})))
        found[f"step {step} ms"] = (summary.TS_mm / fine - 1) * 100
    chain = trainmj.line_up(trainmj.load("b_type"))
    for method, rtol in SCIPY:
        strokes = by_scipy(chain, 0.75, rtol, method)
        front = chain.interfaces[chain.front]
        own = strokes[: chain.front].sum() + sum(s.stroke(strokes[chain.front] / 2) for s in front.devices[0].stages)
        found[f"scipy {method}, rtol {rtol:g}"] = (own * 1e3 / fine - 1) * 100
    return found


def cases(n: int, step: float) -> list[tuple[int, Chain]]:
    """n random cases of the B-type train: mass, empty stroke, speed."""
    rng = np.random.default_rng(0)
    base = trainmj.load("b_type", {"simulation.step_ms": step})
    return [
        (
            k,
            line_up(
                base.with_values(
                    {
                        "mass_t": float(rng.uniform(30, 36)),
                        "empty_stroke_mm": float(rng.uniform(20, 50)),
                        "speed_km_h": float(rng.uniform(20, 28)),
                    }
                )
            ),
        )
        for k in range(n)
    ]


def batch(n: int, turns: int) -> dict[str, float]:
    """Collisions a second with all their metrics, and the floor: as many bare steps without law or records."""
    chains = cases(n, 0.1)
    summaries = dict(run_chains(chains))
    steps = sum(round(s.duration_s / 1e-4) for s in summaries.values())
    layout = Layout.of(chains[0][1])
    model = build(chains[0][1], layout, bare=True)
    batches = {threads: Batch(model, 128, threads) for threads in (1, 2)}
    for b in batches.values():
        b.qvel = chains[0][1].speed
        b.userdata = layout.block(chains[0][1])

    def bare(threads: int, clock: bool) -> None:
        if clock:
            batches[threads].step(nstep=steps // 128)
        else:
            with clockless():
                batches[threads].step(nstep=steps // 128)

    times = alternate(
        {
            "1 thread": lambda: list(run_chains(chains, 1)),
            "2 threads": lambda: list(run_chains(chains, 2)),
            "floor, 1 thread": lambda: bare(1, True),
            "floor, 2 threads": lambda: bare(2, True),
            "floor without timers, 1 thread": lambda: bare(1, False),
            "floor without timers, 2 threads": lambda: bare(2, False),
        },
        turns,
    )
    return {name: n / taken for name, taken in times.items()}


def sweeps(n: int, turns: int) -> dict[str, float]:
    """Collisions a second of a whole sweep in a process that runs already: cases, metrics, files."""
    found = {}
    for step in (0.1, FAST_STEP):
        sweep = trainmj.grid_of(
            trainmj.load("b_type", {"simulation.step_ms": step}),
            {"mass_t": f"30:36:{n // 10}", "speed_km_h": "20:28:10"},
        )
        times = []
        for turn in range(turns + 1):
            with tempfile.TemporaryDirectory() as folder:
                result = trainmj.run_sweep(sweep, folder)
            if turn:
                times.append(result.seconds)
        found[f"step {step} ms"] = len(sweep) / min(times)
    return found


def growth_with_vehicles(turns: int) -> dict[str, float]:
    """Engine time of a step [us] with the law, by vehicles in all."""
    found = {}
    for n in (4, 8, 12, 24, 50, 100, 200):
        chain = line_up(trainmj.load("b_type", {"trains.b_type.vehicles": n // 2}))
        layout = Layout.of(chain)
        model = build(chain, layout, bare=True)
        steps = max(400, 20_000 // n)

        def step(
            model: mujoco.MjModel = model, chain: Chain = chain, layout: Layout = layout, steps: int = steps
        ) -> None:
            with kernel.installed():
                mujoco.mj_step(model, start(model, chain, layout), nstep=steps)

        found[str(n)] = alternate({"": step}, turns)[""] / steps * 1e6
    return found


def growth_with_cases(most: int) -> dict[str, dict[str, float]]:
    """Whole processes: seconds and peak memory [MB] of sweeps over D x M x V."""
    found = {}
    for n, grid in {10: (5, 2, 1), 100: (10, 5, 2), 1000: (10, 10, 10), 10_000: (25, 20, 20)}.items():
        if n > most:
            continue
        with tempfile.TemporaryDirectory() as folder:
            d, m, v = grid
            words = ["sweep", "b_type", "--out", f"{folder}/sweep"]
            words += ["--set", f"simulation.step_ms={FAST_STEP}", "--vary", f"empty_stroke_mm=20:50:{d}"]
            words += ["--vary", f"mass_t=30:36:{m}", "--vary", "speed_km_h=25" if v == 1 else f"speed_km_h=20:28:{v}"]
            taken, memory = process(words)
            found[str(n)] = {"seconds": taken, "peak MB": memory}
    return found


_REPORTING = """
import sys
from trainmj.cli import main
try:
    main(sys.argv[1:])
finally:
    with open("/proc/self/status") as status:
        print(next(line.split()[1] for line in status if line.startswith("VmHWM")), file=sys.stderr)
"""


def process(arguments: list[str]) -> tuple[float, float]:
    """Wall time [s] and peak memory [MB] of trainmj as a whole process (on Linux).

    The process reads its own high-water mark: what the system counts for a child includes the parent's at the fork.
    """
    began = time.perf_counter()
    words = [sys.executable, "-c", _REPORTING, *arguments]
    done = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=True)
    return time.perf_counter() - began, int(done.stderr.split()[-1]) / 1024


def whole_processes(turns: int) -> dict[str, float]:
    """Seconds from typing to the prompt, from the second start on."""
    with tempfile.TemporaryDirectory() as folder:
        numbers = iter(range(10_000))
        paper = Path(folder) / "paper.csv"
        rows = [(d, 33.0) for d in np.linspace(20, 50, 9)] + [(35.0, m) for m in np.linspace(30, 36, 9) if m != 33.0]
        paper.write_text("empty_stroke_mm,mass_t\n" + "".join(f"{d},{m}\n" for d, m in rows))
        sweep = Path(folder) / "paper.yaml"
        sweep.write_text("scenario: b_type\ncases: paper.csv\n")
        return alternate(
            {
                "trainmj --help": lambda: process(["--help"]),
                "trainmj run b_type": lambda: process(["run", "b_type"]),
                "the paper's 17 cases": lambda: process(["sweep", str(sweep), "--out", f"{folder}/{next(numbers)}"]),
            },
            turns,
        )


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer turns and cases")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    turns, n = (3, 256) if options.quick else (7, 1000)
    figures: dict[str, Any] = {"machine": f"{platform.machine()}, {os.cpu_count()} cores", "versions": identity()}
    figures["TS against a step of 0.005 ms [%]"] = accuracy()
    single = figures["one collision, 12 vehicles, 8000 steps [s]"] = one_collision(turns)
    many = figures["collisions a second, step 0.1 ms, metrics included"] = batch(n, turns)
    swept = figures["collisions a second of a sweep, files included"] = sweeps(n, max(1, turns // 2))
    figures["a step with the law [us], by vehicles"] = growth_with_vehicles(turns)
    figures["sweeps as whole processes, step 0.5 ms, by cases"] = growth_with_cases(1000 if options.quick else 10_000)
    figures["whole processes, from the second start on [s]"] = whole_processes(turns)
    fast = 1 / swept[f"step {FAST_STEP} ms"]
    standard = trainmj.run(trainmj.load("b_type"))
    per_python = single["Python callback in MuJoCo"] / STEPS * (standard.time[-1] / standard.chain.step)
    figures["ratios"] = {
        "law / no law, bare model": single["bare model, with the law"] / single["bare model, without it"],
        "law / no law or timers, bare model": single["bare model, with the law"]
        / single["bare model, without it or timers"],
        "law / no law, full model": single["full model, with the law"] / single["full model, without it"],
        "batch / floor, 2 threads": many["2 threads"] / many["floor, 2 threads"],
        "batch / floor without timers, 2 threads": many["2 threads"] / many["floor without timers, 2 threads"],
        "2 threads / 1 thread": many["2 threads"] / many["1 thread"],
        "2 threads / Python callback": per_python * many["2 threads"],
        "sweep at the fast step / best solve_ivp": min(v for k, v in single.items() if "solve_ivp" in k) / fast,
        "MuJoCo with the law / bare compiled loop": single["bare model, with the law"]
        / single["bare compiled loop (numba)"],
    }
    figures["peak memory of this process [MB]"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    show(figures)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2))


def show(figures: dict[str, Any]) -> None:
    """Print all figures."""
    for title, values in figures.items():
        if not isinstance(values, dict):
            print(f"{title}: {values:.0f}" if isinstance(values, float) else f"{title}: {values}")
            continue
        print(f"\n{title}")
        for name, value in values.items():
            if isinstance(value, dict):
                text = ", ".join(f"{v:.4g} {k}" for k, v in value.items())
            else:
                text = f"{value:.4g}" if isinstance(value, float) else str(value)
            print(f"  {name:45s} {text}")


if __name__ == "__main__":
    main()
