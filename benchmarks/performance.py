"""How fast collisions are computed, against what, and how that grows: one command; the docs are printed from its JSON.

    python benchmarks/performance.py [--quick | --long] [--against DIR] [--json FILE] [--print FILE]

DIR is an older checkout, such as ``git worktree add ../older REVISION`` makes; it runs in a process of its own with
the packages of this environment. Competitors take turns (:mod:`turns`); quote the ratios. FILE of --json gets all
figures, and keeps those of an earlier run with --long. --print writes the tables of docs/performance.md from such a
file and measures nothing. Linux only.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import tables
from trains import DEVICES, scenario_of
from turns import ROOT, Numbers, Worker, alternate, command, medians, ratio, together

Figures = dict[str, Any]

STEP, FINE_STEP, DEVICES_STEP, FINEST_STEP = 0.5, 0.1, 0.25, 0.005
"""Steps [ms]: of many cases, of the scenarios as they ship, of every kind of device, and of what is taken for exact."""

SWEEPS: dict[str, dict[str, Any]] = {
    "0.5": {"simulation.step_ms": STEP},
    "0.1": {"simulation.step_ms": FINE_STEP},
    "events": {"simulation.step_ms": STEP, "simulation.integrator": "events"},
}
"""What the sweeps set that are held against others, by a name; an older checkout may not know ``events``."""

SWEEPS_OF_OLDER = ("0.5", "0.1")
EQUAL = {"0.5": "0.5", "0.1": "0.1", "events": "0.1"}
"""What an older checkout sets to be no more accurate than each of them."""

LOOP_STEPS = (0.5, 0.4, 0.25, 0.2, 0.16, 0.125, 0.1, 0.08, 0.05, 0.04, 0.025, 0.02, 0.0125, 0.01)
TRADE_OFF_STEPS = (0.05, 0.1, 0.2, 0.25, 0.5, 1.0)
TRADE_OFF = {"b_type": 25.0, "b_type_wall": 12.5, "wagon_80t": 36.0, "en15227_c1": 36.0}
"""Scenarios along the track, with the speeds that they state [km/h]."""

VEHICLES = (4, 8, 12, 24, 50, 100, 200)
COUPLERS, MOST_COUPLERS = (2, 5), 5
"""How many of a kind, in each of two trains of six vehicles."""

SIZES = {10: (5, 2, 1), 100: (10, 5, 2), 1000: (10, 10, 10), 10_000: (25, 20, 20), 100_000: (50, 50, 40)}
"""Cases of a sweep over empty stroke, mass and speed."""

THREADS = (2, 4, 8, 16, 32, 64)
MANY = 10_000_000  # cases
CORES = (10, 100, 1000)


@dataclass
class Bench:
    """The processes that measure, and how long."""

    here: Worker
    twin: Worker  # a second process of the same checkout
    older: Worker | None
    older_checkout: Path | None
    quick: bool
    folder: Path
    numbers: Iterator[int] = field(default_factory=count)

    @property
    def turns(self) -> int:
        """Of what a bar is set for."""
        return 3 if self.quick else 5

    @property
    def few(self) -> int:
        """Turns of what shows how something grows."""
        return 1 if self.quick else 3

    def cases(self, most: int) -> int:
        """So many, or fewer if it must be quick; a multiple of ten."""
        return most // 30 * 10 if self.quick else most

    def fresh(self) -> str:
        """A folder that is not there yet."""
        return str(self.folder / str(next(self.numbers)))


def grid(cases: int) -> dict[str, str]:
    """Mass and speed of so many cases of ``b_type``, a multiple of 20."""
    return {"mass_t": f"30:36:{cases // 10}", "speed_km_h": "20:28:10"}


def speeds(most: float, cases: int) -> dict[str, str]:
    """Speeds of a scenario, up to the one that it states [km/h]."""
    return {"collision.speed_km_h": f"{0.8 * most}:{most}:{cases}"}


def at(step: float, **changes: Any) -> dict[str, Any]:
    """Changes of a scenario with a step [ms]."""
    return {"simulation.step_ms": step, **changes}


# accuracy


def errors(found: Numbers, exact: Numbers) -> Numbers:
    """How far TS and TAMA [%], strokes [mm] and peak forces [%] of cases are off, at worst."""

    def percent(name: str) -> float:
        return max(abs(a / b - 1) * 100 for a, b in zip(found[name], exact[name], strict=True))

    def apart(name: str) -> Iterator[tuple[float, float]]:
        for row, exact_row in zip(found[name], exact[name], strict=True):
            yield from zip(row, exact_row, strict=True)

    off = {"TS_percent": percent("TS_mm"), "stroke_mm": max(abs(a - b) for a, b in apart("stroke_mm"))}
    if "TAMA_g" in found:
        off["TAMA_percent"] = percent("TAMA_g")
        off["force_percent"] = max(abs(a / b - 1) * 100 for a, b in apart("force_kN") if b > 0)
    return off


def _followed(so: bool) -> dict[str, str]:
    """Changes of a scenario that has devices followed through what happens within a step, or not."""
    return {"simulation.integrator": "events" if so else "euler"}


def accuracy(bench: Bench) -> Figures:
    """Errors of the sweeps against the finest step, of the case that ships and of several; and of the bare loop.

    The step of the loop is the largest below which it is no further off than the sweep, in any of the several cases.
    """
    sets = {"as it ships": {"speed_km_h": [25]}, "16 cases": {"mass_t": "30:36:4", "speed_km_h": "20:28:4"}}
    found: Figures = {}
    for cases, vary in sets.items():
        exact = bench.here("outcomes", scenario="b_type", vary=vary, changes=at(FINEST_STEP, **_followed(True)))
        loops = bench.here("loop", scenario="b_type", vary=vary, steps_ms=[*LOOP_STEPS, FINEST_STEP], seconds=0.9)
        for name, changes in SWEEPS.items():
            of_sweep = found.setdefault(name, {}).setdefault(cases, {})
            places = {"sweep": bench.here} | ({"older": bench.older} if bench.older and name in SWEEPS_OF_OLDER else {})
            for place, worker in places.items():
                of_sweep[place] = errors(worker("outcomes", scenario="b_type", vary=vary, changes=changes), exact)
        reference = loops.pop(f"{FINEST_STEP:g}")
        found.setdefault("loop", {})[cases] = {step: errors(one, reference) for step, one in loops.items()}
    loop = found["loop"]["16 cases"]
    for name in SWEEPS:
        own = {error: 1.001 * off for error, off in found[name]["16 cases"]["sweep"].items()}  # round-off
        worse = (n for n in sorted(LOOP_STEPS) if any(loop[f"{n:g}"][e] > own[e] for e in ("TS_percent", "stroke_mm")))
        first = next(worse, math.inf)
        found[name]["loop_step_ms"] = max((n for n in LOOP_STEPS if n < first), default=min(LOOP_STEPS))
    return found


# speed


def sweeps(bench: Bench, name: str, cases: int, loop_step: float) -> Figures:
    """A sweep with files against the older checkout, MuJoCo alone, two processes and a bare loop, in turns."""
    asked, step = {"scenario": "b_type", "changes": SWEEPS[name]}, SWEEPS[name]["simulation.step_ms"]
    of_older = {"scenario": "b_type", "changes": SWEEPS[EQUAL[name]]}
    first = bench.here("sweep", **asked, vary=grid(cases))
    steps = first["steps"]
    seconds = steps / cases * step / 1e3
    some = grid(100)

    def loop() -> Numbers:
        (found,) = bench.here("loop", scenario="b_type", vary=some, steps_ms=[loop_step], seconds=seconds).values()
        return {name: found[name] / found["cases"] * cases for name in ("wall", "cpu")}

    competitors: dict[str, Callable[[], Numbers]] = {
        "1 thread": lambda: bench.here("sweep", **asked, vary=grid(cases)),
        "MuJoCo alone, 1 thread": lambda: bench.here("bare", steps=steps, threads=1),
        "2 threads": lambda: bench.here("sweep", **asked, vary=grid(cases), threads=2),
        "MuJoCo alone, 2 threads": lambda: bench.here("bare", steps=steps, threads=2),
        "2 processes": lambda: together([bench.here, bench.twin], "sweep", **asked, vary=grid(cases // 2)),
        "bare loop": loop,
    }
    if older := bench.older:
        competitors["older, 1 thread"] = lambda: older("sweep", **of_older, vary=grid(cases))
    taken = alternate(competitors, bench.turns)
    ratios = {
        "MuJoCo alone / sweep, 1 thread": ("MuJoCo alone, 1 thread", "1 thread"),
        "MuJoCo alone / sweep, 2 threads": ("MuJoCo alone, 2 threads", "2 threads"),
        "2 processes / 2 threads": ("2 processes", "2 threads"),
        "1 thread / 2 threads": ("1 thread", "2 threads"),
        "sweep / bare loop": ("1 thread", "bare loop"),
        "older / sweep": ("older, 1 thread", "1 thread"),
    }
    found = {name: medians(turns) for name, turns in taken.items()}
    one = found["1 thread"]
    return {
        "step_ms": step,
        "older_step_ms": of_older["changes"]["simulation.step_ms"],
        "cases": cases,
        "steps": steps,
        "bytes": one["bytes"] / cases,
        "ms": {name: of["wall"] / cases * 1e3 for name, of in found.items()},
        "cpu_ms": {name: of["cpu"] / cases * 1e3 for name, of in found.items()},
        "mujoco_ms": one["mujoco"] / cases * 1e3,
        "python_ms": (one["cpu"] - one["mujoco"]) / cases * 1e3,
        "ratios": {name: ratio(taken[a], taken[b]) for name, (a, b) in ratios.items() if a in taken},
    }


def two_processes(bench: Bench) -> Figures:
    """What two processes that have nothing to do with each other gain here: a loop without memory or lock."""
    taken = alternate(
        {"one": partial(bench.here, "spin"), "two": partial(together, [bench.here, bench.twin], "spin")}, bench.turns
    )
    return ratio([{name: 2 * spent for name, spent in turn.items()} for turn in taken["one"]], taken["two"])


def starts(bench: Bench) -> Figures:
    """Whole commands from the second start on, in turns: wall time [s]."""
    places = {"": ROOT} | ({", older": bench.older_checkout} if bench.older_checkout else {})
    competitors: dict[str, Callable[[], Numbers]] = {"trainmj --help": lambda: command(["--help"])}
    for name, place in places.items():
        competitors[f"trainmj run b_type{name}"] = partial(command, ["run", "b_type"], place)
        competitors[f"trainmj run b_type --out DIR{name}"] = lambda place=place: command(
            ["run", "b_type", "--out", bench.fresh()], place
        )
    return {name: medians(turns) for name, turns in alternate(competitors, bench.turns).items()}


# growth


def costs(bench: Bench, asked: Mapping[str, Mapping[str, Any]]) -> dict[str, Numbers]:
    """What sweeps cost in one thread, in turns: the step in MuJoCo with the law [us], and Python a case [ms]."""
    taken = alternate({name: partial(bench.here, "sweep", **one) for name, one in asked.items()}, bench.few)
    return {
        name: {
            "step_us": found["mujoco"] / found["steps"] * 1e6,
            "python_ms": (found["cpu"] - found["mujoco"]) / found["cases"] * 1e3,
            "case_ms": found["cpu"] / found["cases"] * 1e3,
            "steps": found["steps"] / found["cases"],
        }
        for name, found in ((name, medians(turns)) for name, turns in taken.items())
    }


def by_vehicles(bench: Bench) -> Figures:
    """What a case costs by the vehicles of both trains."""
    return costs(
        bench,
        {
            str(n): {
                "scenario": "b_type",
                "changes": at(STEP, **{"trains.b_type.vehicles": n // 2}),
                "vary": speeds(25.0, max(20, bench.cases(2400) // n)),
                "only": ["TS_mm", "duration_s"],  # a table of 200 vehicles has more columns than SQLite
            }
            for n in VEHICLES
        },
    )


def by_devices(bench: Bench) -> Figures:
    """What a case costs with so many couplers of each kind in each of two trains, the others crushing devices."""
    vary = speeds(25.0, bench.cases(90))
    kinds = [kind for kind in DEVICES if kind != "crush"]
    values = {"crush": scenario_of(["crush"] * MOST_COUPLERS)}
    values |= {f"{n} {k}": scenario_of([k] * n + ["crush"] * (MOST_COUPLERS - n)) for k in kinds for n in COUPLERS}
    found = costs(
        bench, {name: {"scenario": one, "changes": at(DEVICES_STEP), "vary": vary} for name, one in values.items()}
    )
    return {"crush": found["crush"]} | {kind: {str(n): found[f"{n} {kind}"] for n in COUPLERS} for kind in kinds}


def by_model(bench: Bench) -> Figures:
    """What a case costs along the track, with bodies that give, and in the vertical plane."""
    bodies = {"trains.b_type.body": {"stiffness_kN_per_mm": 1000, "members": 4}}
    asked = {"b_type": {}, "b_type, bodies of 4 members": bodies, "b_type_vertical": {}}
    return costs(
        bench,
        {
            name: {
                "scenario": name.partition(",")[0],
                "changes": at(FINE_STEP, **changes),
                "vary": speeds(25.0, bench.cases(30)),
            }
            for name, changes in asked.items()
        },
    )


def by_cases(bench: Bench, most: int) -> Figures:
    """Whole commands by the cases of a sweep: seconds, and peak memory [MB]."""
    found = {}
    for n, (d, m, v) in SIZES.items():
        if n <= most:
            last = f"speed_km_h=20:28:{v}" if v > 1 else "speed_km_h=25"
            vary = [
                word for one in (f"empty_stroke_mm=20:50:{d}", f"mass_t=30:36:{m}", last) for word in ("--vary", one)
            ]
            words = ["sweep", "b_type", "--out", bench.fresh(), "--set", f"simulation.step_ms={STEP}"]
            found[str(n)] = command([*words, *vary])
    return found


def by_workers(bench: Bench, cases: int) -> Figures:
    """Sweeps on one and two local Dask workers, which are there already, in turns."""
    asked = {"scenario": "b_type", "vary": grid(cases), "changes": at(STEP)}
    with Worker(ROOT) as one, Worker(ROOT) as two:
        taken = alternate(
            {
                "1": partial(one, "by_dask", workers=1, **asked),
                "2": partial(two, "by_dask", workers=2, **asked),
            },
            bench.few,
        )
    return {
        n: {"case_ms": found["wall"] / cases * 1e3, "client_ms": found["cpu"] / cases * 1e3}
        for n, found in ((n, medians(turns)) for n, turns in taken.items())
    }


def more_threads(python: float, mujoco: float) -> Figures:
    """What more threads would demand of Python's lock, if all that Python does were done with it held.

    A thread holds the lock for ``python`` of each case and steps without it for ``mujoco``. The demand is how many
    threads would hold the lock at once if they could. The gain is that of a closed queue with one server, by mean value
    analysis: X(n) = n / (mujoco + r), r = python (1 + X(n-1) r(n-1)), which takes the times as random.

    Args:
        python: processor time a case beside MuJoCo.
        mujoco: processor time a case in it, in the same unit.
    """
    found, waiting, alone = {}, 0.0, 1 / (python + mujoco)
    for n in range(1, max(THREADS) + 1):
        held = python * (1 + waiting)
        rate = n / (mujoco + held)
        waiting = rate * held
        if n in THREADS:
            found[str(n)] = {"demand": n * python / (python + mujoco), "gain": rate / alone}
    return {"full_at_threads": (python + mujoco) / python, "threads": found}


def on_cluster(sweep: Figures, workers: Figures) -> Figures:
    """What very many cases would cost on a cluster, extrapolated: they do not depend on each other.

    A worker takes as long for a case as the only one does here. The client, which hands out cases and writes the table,
    takes its processor time for each, whoever computes it: that is the most cases a second that one client can have.
    """
    worker, client = workers["1"]["case_ms"] / 1e3, workers["1"]["client_ms"] / 1e3
    return {
        "cases": MANY,
        "core_hours": MANY * worker / 3600,
        "client_hours": MANY * client / 3600,
        "most_workers": worker / client,
        "GB": MANY * sweep["bytes"] / 1e9,
        "hours": {str(cores): MANY * max(worker / cores, client) / 3600 for cores in CORES},
    }


def trade_off(bench: Bench) -> Figures:
    """What a step costs and how far it is off, for several scenarios; cases at 0.8 to 1 times the speed stated."""
    found: Figures = {}
    for name, speed in TRADE_OFF.items():
        few, many = speeds(speed, 4 if bench.quick else 12), speeds(speed, bench.cases(30))
        exact = bench.here("outcomes", scenario=name, vary=few, changes=at(FINEST_STEP, **_followed(True)))
        found[name] = {}
        for integrator in ("euler", "events"):
            rows: Figures = {}
            changes = {f"{step:g}": at(step, **_followed(integrator == "events")) for step in TRADE_OFF_STEPS}
            for step, changed in changes.items():
                one = bench.here("outcomes", scenario=name, vary=few, changes=changed)
                rows[step] = one if "refused" in one else errors(one, exact)
            asked = {
                step: {"scenario": name, "vary": many, "changes": changes[step]}
                for step, row in rows.items()
                if "refused" not in row
            }
            for step, cost in costs(bench, asked).items():
                rows[step]["case_ms"] = cost["case_ms"]
            found[name][integrator] = rows
    return found


# what takes long


def long_ones(bench: Bench) -> Figures:
    """What takes an hour: the identification that ships, from nothing, and a sweep of 100 000 cases."""
    found: Figures = {"about": about(bench)}
    places = {"here": ROOT} | ({"older": bench.older_checkout} if bench.older_checkout else {})
    found["identify"] = {
        name: command(["identify", "b_type", "--out", bench.fresh()], place, NUMBA_CACHE_DIR=bench.fresh())
        for name, place in places.items()
    }
    found["cases"] = by_cases(bench, max(SIZES))
    return found


# the command


def about(bench: Bench) -> Figures:
    """Of what and where the figures are."""
    model = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    versions = {k: v for k, v in bench.here.about.items() if k in ("mujoco", "numba", "numpy", "python")}
    return {
        "revision": _revision(ROOT),
        "older": _revision(bench.older_checkout) if bench.older_checkout else None,
        "processor": model[1] if model else platform.machine(),
        "system": f"{platform.system()} {platform.machine()}",
        "cores": len(os.sched_getaffinity(0)),
        "load": os.getloadavg()[0],
        "versions": versions,
        "turns": bench.turns,
    }


def _revision(checkout: Path) -> str:
    def git(*words: str) -> str:
        done = subprocess.run(["git", "-C", str(checkout), *words], capture_output=True, text=True, check=False)
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", "trainmj", "scenarios")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (" with changes" if changed else "")


def measure(bench: Bench, long: bool) -> Figures:
    """All figures."""
    began = time.monotonic()

    def section(title: str, work: Callable[[], Figures]) -> Figures:
        print(f"{time.monotonic() - began:5.0f} s  {title}", flush=True)
        return work()

    found: Figures = {"about": about(bench)}
    found["accuracy"] = section("accuracy of the steps", partial(accuracy, bench))
    for name, cases in (("0.5", bench.cases(900)), ("0.1", bench.cases(300)), ("events", bench.cases(300))):
        loop_step = found["accuracy"][name]["loop_step_ms"]
        found[f"sweep_{name}"] = section(f"sweeps: {name}", partial(sweeps, bench, name, cases, loop_step))
    found["two_processes"] = section("what two processes gain", partial(two_processes, bench))
    found["starts"] = section("starts of commands", partial(starts, bench))
    found["ways"] = section("other ways to compute a collision", partial(bench.here, "by_ways", turns=bench.few))
    found["trade_off"] = section("the step: cost and errors", partial(trade_off, bench))
    found["vehicles"] = section("growth with vehicles", partial(by_vehicles, bench))
    found["devices"] = section("growth with devices", partial(by_devices, bench))
    found["models"] = section("kinds of model", partial(by_model, bench))
    found["cases"] = section("growth with cases", partial(by_cases, bench, 1000 if bench.quick else 10_000))
    found["workers"] = section("Dask workers", partial(by_workers, bench, bench.cases(600)))
    fast = found[f"sweep_{STEP:g}"]
    found["more_threads"] = more_threads(fast["python_ms"], fast["mujoco_ms"])
    found["cluster"] = on_cluster(fast, found["workers"])
    if long:
        found["long"] = section("what takes an hour", partial(long_ones, bench))
    found["about"] |= {"load_at_end": os.getloadavg()[0], "seconds": time.monotonic() - began}
    return found


@contextmanager
def processes(options: argparse.Namespace) -> Iterator[Bench]:
    """The processes that measure."""
    older = options.against.resolve() if options.against else None
    with ExitStack() as stack:
        here, twin = (stack.enter_context(Worker(ROOT)) for _ in range(2))
        worker = stack.enter_context(Worker(older)) if older else None
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        yield Bench(here, twin, worker, older, options.quick, Path(folder))


def finite(value: Any) -> Any:
    """The same without numbers that JSON does not have, and in six digits."""
    if isinstance(value, Mapping):
        return {name: finite(one) for name, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [finite(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


def main() -> None:
    """Measure, print, write; or only print the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    much = parser.add_mutually_exclusive_group()
    much.add_argument("--quick", action="store_true", help="fewer turns and cases")
    much.add_argument("--long", action="store_true", help="also an identification and 100 000 cases: an hour")
    parser.add_argument("--against", type=Path, help="folder of an older checkout")
    parser.add_argument("--json", type=Path, help="file for the figures")
    parser.add_argument("--print", type=Path, dest="of", help="write the page of the docs from a file; measure nothing")
    options = parser.parse_args()
    if options.of:
        page = tables.PAGE.read_text(encoding="utf-8")
        tables.PAGE.write_text(tables.printed(page, json.loads(options.of.read_text())), encoding="utf-8")
        return
    if options.against and not (options.against / "trainmj" / "__init__.py").exists():
        parser.error(f"--against {options.against}: is no checkout of trainmj")
    before: Figures = {}
    if options.json:  # before anything is measured
        with options.json.open("a+", encoding="utf-8") as file:
            file.seek(0)
            before = json.loads(file.read() or "{}")
    with processes(options) as bench:
        figures = finite(measure(bench, options.long))
    if "long" in before:
        figures.setdefault("long", before["long"])
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    print("\n" + tables.bars(figures))


if __name__ == "__main__":
    main()
