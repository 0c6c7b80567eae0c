"""The tables of docs/performance.md, from the figures that :mod:`performance` measured; no number is typed by hand.

The page has a pair of comments for each, ``<!-- NAME -->`` and ``<!-- end -->``; what is between them is replaced.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

PAGE = Path(__file__).resolve().parents[1] / "docs" / "performance.md"
FIGURES = PAGE.with_suffix(".json")

Figures = Mapping[str, Any]

FOLLOWED = "with `events` at 0.5 ms"
_SWEEPS = {"0.5": "at 0.5 ms", "0.1": "at 0.1 ms", "events": FOLLOWED}

_PLACE = re.compile(r"<!-- (?!end)(\w+) -->\n.*?<!-- end -->", re.DOTALL)


_ERRORS = ("TS, %", "strokes, mm", "peak forces, %", "TAMA, %")


class Bar(NamedTuple):
    """What a figure is held to."""

    figure: str
    bar: float
    most: bool  # or else the least
    unit: str
    found: float
    ratio: Mapping[str, float] | None = None  # what else there is to know of it

    @property
    def met(self) -> bool:
        """Whether the figure is as it should be."""
        return self.found <= self.bar if self.most else self.found >= self.bar


def bars_of(figures: Figures) -> Iterator[Bar]:
    """Every bar for which there is a figure."""
    fast, fine, followed = figures["sweep_0.5"], figures["sweep_0.1"], figures["sweep_events"]
    for threads in ("1 thread", "2 threads"):
        name = f"MuJoCo alone / sweep, {threads}"
        yield _of_ratio(f"time of MuJoCo alone / of a sweep at 0.5 ms, {threads}", 0.85, False, fast["ratios"][name])
    yield _of_ratio(
        "sweep in 2 threads / in 2 processes, cases a second", 0.97, False, fast["ratios"]["2 processes / 2 threads"]
    )
    for found, name, bar in ((fast, "at 0.5 ms", 2.2), (fine, "at 0.1 ms", 3.5), (followed, FOLLOWED, 3.5)):
        if "older / sweep" in found["ratios"]:
            words = f"sweep {name} / with the older checkout at {found['older_step_ms']:g} ms, cases a second and core"
            yield _of_ratio(words, bar, False, found["ratios"]["older / sweep"])
    for name, said, strokes in (("0.5", "at 0.5 ms", 1.0), ("events", FOLLOWED, 0.05)):
        off = figures["accuracy"][name]["as it ships"]["sweep"]
        yield Bar(f"error of TS {said}, `b_type` as it ships", 0.01, True, "%", off["TS_percent"])
        yield Bar("largest error of a stroke, the same", strokes, True, "mm", off["stroke_mm"])
    yield Bar("Python beside MuJoCo, a case", 0.15, True, "ms", fast["python_ms"])
    for found, name in ((fast, "at 0.5 ms"), (fine, "at 0.1 ms"), (followed, FOLLOWED)):
        words = f"time of a sweep {name} / of the bare loop at equal accuracy"
        yield _of_ratio(words, 4.0, True, found["ratios"]["sweep / bare loop"])
    for command, bar in (("trainmj run b_type", 1.0), ("trainmj run b_type --out DIR", 1.6)):
        yield Bar(f"`{command}`, second start", bar, True, "s", figures["starts"][command]["wall"])
    if long := figures.get("long"):
        yield Bar("`trainmj identify b_type`, from nothing", 300.0, True, "s", long["identify"]["here"]["wall"])
        yield Bar("memory of a sweep of 100 000 cases", 400.0, True, "MB", long["cases"]["100000"]["peak_MB"])


def _of_ratio(figure: str, bar: float, most: bool, found: Mapping[str, float]) -> Bar:
    return Bar(figure, bar, most, "", found["value"], found)


def bars(figures: Figures) -> str:
    """What the figures are held to, and whether they are as they should be."""
    rows = [
        [
            bar.figure,
            f"at {'most' if bar.most else 'least'} {bar.bar:g} {bar.unit}".strip(),
            f"{_n(bar.found)} {bar.unit}".strip(),
            *([f"{_n(bar.ratio['from'])} to {_n(bar.ratio['to'])}", _n(bar.ratio["cpu"])] if bar.ratio else ["", ""]),
            "yes" if bar.met else "no",
        ]
        for bar in bars_of(figures)
    ]
    return _table(["figure", "wanted", "found", "turns", "of processor times", "met"], rows)


def machine(figures: Figures) -> str:
    """Where the figures are from."""
    of = figures["about"]
    versions = ", ".join(f"{name} {version}" for name, version in of["versions"].items())
    older = f" (older checkout: {of['older']})" if of["older"] else ""
    gain = figures["two_processes"]
    return (
        f"Revision {of['revision']}{older} on {of['processor']}, {of['cores']} cores, {of['system']}; {versions}. "
        f"Medians of {of['turns']} turns; load average {_n(of['load'])} at the start, {_n(of['load_at_end'])} at the "
        f"end. Two independent processes, each counting in a loop, got {_n(gain['value'])} times as much done as "
        f"one, {_n(gain['from'])} to {_n(gain['to'])} times in single turns."
    )


def speed(figures: Figures) -> str:
    """What a case costs in a sweep, against all that it is compared with."""
    all_ = {words: figures[f"sweep_{name}"] for name, words in _SWEEPS.items()}
    names = {
        "1 thread": "**sweep with its files, 1 thread**",
        "2 threads": "**the same, 2 threads**",
        "2 processes": "two processes with half the cases each",
        "MuJoCo alone, 1 thread": "as many steps of MuJoCo without law and timers, 1 thread",
        "MuJoCo alone, 2 threads": "the same, 2 threads",
        "bare loop": "bare compiled loop at equal accuracy, 1 thread",
        "older, 1 thread": "sweep of the older checkout, 1 thread; in the last column at 0.1 ms",
    }
    rows = []
    for name, words in names.items():
        if name in figures["sweep_0.5"]["ms"]:
            cells = [[_n(one["ms"][name]), _n(1e3 / one["ms"][name])] for one in all_.values()]
            rows.append([words, *(cell for pair in cells for cell in pair)])
    heads = [f"{what} {words}" for words in all_ for what in ("ms a case", "cases a second")]
    return _table(["`b_type`, 12 vehicles", *heads], rows)


def accuracy(figures: Figures) -> str:
    """How accurate what is compared is."""
    of = figures["accuracy"]
    rows = []
    for sweep, said in _SWEEPS.items():
        loop = f"{of[sweep]['loop_step_ms']:g}"
        names = {"sweep": f"sweep {said}", "older": f"older checkout {said}"}
        for cases in of["loop"]:
            rows += [[names[name], cases, *_errors(off)] for name, off in of[sweep][cases].items()]
            rows.append([f"bare loop at {loop} ms, for the sweep {said}", cases, *_errors(of["loop"][cases][loop])])
    return _table(["", "`b_type`", *_ERRORS], rows)


def parts(figures: Figures) -> str:
    """Where the time of a case goes."""
    rows = []
    for name, said in _SWEEPS.items():
        of = figures[f"sweep_{name}"]
        steps = of["steps"] / of["cases"]
        rows.append(
            [
                said,
                _n(steps, 4),
                _n(of["mujoco_ms"]),
                _n(of["mujoco_ms"] / steps * 1e3),
                _n(of["cpu_ms"]["MuJoCo alone, 1 thread"] / steps * 1e3),
                _n(of["python_ms"]),
            ]
        )
    heads = ["sweep", "steps a case", "MuJoCo with the law, ms a case", "us a step", "MuJoCo alone, us a step"]
    return _table([*heads, "Python, ms a case"], rows)


def ways(figures: Figures) -> str:
    """The standard collision in other ways."""
    of = figures["ways"]
    own = of["trainmj.run"]["wall"]
    rows = [
        [name, _n(one["wall"] * 1e3), _n(one["wall"] / own), _small(one.get("TS_percent"))] for name, one in of.items()
    ]
    return _table(["one collision of `b_type`, step 0.1 ms", "ms", "of `trainmj.run`", "TS, %"], rows)


def trade_off(figures: Figures) -> str:
    """What a step costs, and how far it is off."""
    rows = []
    for name, integrators in figures["trade_off"].items():
        for integrator, steps in integrators.items():
            for step, of in steps.items():
                cells = [*_errors(of), _n(of["case_ms"])] if "refused" not in of else ["refused", "", "", "", ""]
                rows.append([f"`{name}`", f"`{integrator}`", step, *cells])
    heads = ["scenario", "integrator", "step, ms", *_ERRORS, "processor time a case, ms"]
    return _table(heads, rows)


def vehicles(figures: Figures) -> str:
    """How cost grows with the vehicles."""
    rows = [
        [n, _n(of["step_us"]), _n(of["step_us"] / int(n)), _n(of["python_ms"]), _n(of["case_ms"])]
        for n, of in figures["vehicles"].items()
    ]
    heads = ["vehicles of both trains", "us a step", "us a step and vehicle", "Python, ms a case"]
    return _table([*heads, "processor time a case, ms"], rows)


def devices(figures: Figures) -> str:
    """How cost grows with devices that do not crush."""
    base = figures["devices"]["crush"]
    rows = [["`crush` alone", "", _n(base["step_us"]), "", _n(base["python_ms"])]]
    for kind, counts in figures["devices"].items():
        if kind != "crush":
            for n, of in counts.items():
                more = (of["step_us"] - base["step_us"]) / (2 * int(n)) * 1e3
                rows.append([f"`{kind}`", n, _n(of["step_us"]), _n(more, 2), _n(of["python_ms"])])
    heads = ["couplers", "of this kind in each train", "us a step", "more than `crush`, ns a step and device"]
    return _table([*heads, "Python, ms a case"], rows)


def models(figures: Figures) -> str:
    """What kinds of model cost."""
    base = figures["models"]["b_type"]["step_us"]
    rows = [
        [_name(name), _n(of["step_us"]), _n(of["step_us"] / base), _n(of["python_ms"])]
        for name, of in figures["models"].items()
    ]
    return _table(["12 vehicles", "us a step", "of `b_type`", "Python, ms a case"], rows)


def cases(figures: Figures) -> str:
    """Whole commands, by cases."""
    found = {int(n): of for n, of in {**figures["cases"], **figures.get("long", {}).get("cases", {})}.items()}
    rows = [[_thousands(n), _n(of["wall"]), _n(of["wall"] / n * 1e3), _n(of["peak_MB"])] for n, of in found.items()]
    return _table(["cases of `trainmj sweep`", "s", "ms a case", "memory at most, MB"], rows)


def threads(figures: Figures) -> str:
    """What threads gain, and what more of them would demand."""
    of = figures["more_threads"]
    rows = [[n, _n(one["demand"]), _n(one["gain"])] for n, one in of["threads"].items()]
    measured = figures["sweep_0.5"]["ratios"]["1 thread / 2 threads"]
    return (
        f"Two threads gain a factor of {_n(measured['value'])} here ({_n(measured['from'])} to {_n(measured['to'])}), "
        f"where two processes that have nothing to do with each other gain {_n(figures['two_processes']['value'])}. "
        f"Python's lock would always be taken from {_n(of['full_at_threads'])} threads on:\n\n"
        + _table(["threads", "threads that want Python's lock", "gain at most"], rows)
    )


def workers(figures: Figures) -> str:
    """What Dask's workers gain."""
    rows = [
        [n, _n(of["case_ms"]), _n(1e3 / of["case_ms"]), _n(of["client_ms"])] for n, of in figures["workers"].items()
    ]
    heads = ["Dask workers on this machine", "ms a case", "cases a second", "of it in the client, ms of processor time"]
    return _table(heads, rows)


def cluster(figures: Figures) -> str:
    """What very many cases would cost."""
    of = figures["cluster"]
    hours = "; ".join(f"{_n(hours)} h with {cores} workers" for cores, hours in of["hours"].items())
    return (
        f"So {_thousands(of['cases'])} collisions of `b_type` at 0.5 ms would take {_n(of['core_hours'])} core hours: "
        f"{hours}. One client keeps {_n(of['most_workers'])} workers busy, so that no number of them takes less than "
        f"{_n(of['client_hours'])} h. The files would have {_n(of['GB'])} GB."
    )


def starts(figures: Figures) -> str:
    """Whole commands."""
    rows = [[_name(name), _n(of["wall"]), _n(of["cpu"]), _n(of["peak_MB"])] for name, of in figures["starts"].items()]
    return _table(["from the second start on", "s", "processor time, s", "memory at most, MB"], rows)


def long(figures: Figures) -> str:
    """What takes long."""
    if "long" not in figures:
        return "`--long` has not been run."
    of = figures["long"]
    names = {"here": "`trainmj identify b_type`, from nothing", "older": "the same with the older checkout"}
    rows = [[names[name], _n(one["wall"]), _n(one["cpu"])] for name, one in of["identify"].items()]
    return f"With revision {of['about']['revision']}:\n\n" + _table(["", "s", "processor time, s"], rows)


_TABLES: tuple[Callable[[Figures], str], ...] = (
    machine, bars, speed, accuracy, parts, ways, trade_off, vehicles, devices, models, cases, threads, workers, cluster,
    starts, long,
)  # fmt: skip


def printed(page: str, figures: Figures) -> str:
    """The page with every table as the figures have it.

    Raises:
        ValueError: if the page lacks the place of a table, or has one for something else.
    """
    known = {table.__name__: table for table in _TABLES}
    if (there := sorted(_PLACE.findall(page))) != sorted(known):
        raise ValueError(f"the page has places for {there}, and there are tables for {sorted(known)}")
    return _PLACE.sub(lambda place: f"<!-- {place[1]} -->\n\n{known[place[1]](figures)}\n\n<!-- end -->", page)


def _errors(of: Mapping[str, float]) -> list[str]:
    return [_small(of.get(name)) for name in ("TS_percent", "stroke_mm", "force_percent", "TAMA_percent")]


def _small(value: float | None) -> str:
    if value is None:
        return ""
    return "< 0.001" if value < 0.001 else f"{value:.3f}" if value < 0.1 else f"{value:.2f}"


def _n(value: float | None, digits: int = 3) -> str:
    """A number in so many significant digits, and all of those before the point."""
    if value is None:
        return ""
    before = math.floor(math.log10(abs(value))) + 1 if value else 1
    return f"{value:.{max(0, digits - before)}f}"


def _thousands(n: int) -> str:
    return f"{n:,}".replace(",", " ")


def _name(name: str) -> str:
    """A command or scenario in code, what follows a comma in words."""
    code, comma, words = name.partition(",")
    words = " with the older checkout" if words == " older" else comma + words
    return f"`{code}`{words}"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|" for cells in lines)
