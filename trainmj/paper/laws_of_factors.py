"""Laws of Sections 5 and 6, over the empty stroke D and the mass M, checked on our results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.device import Array
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.paper import bars
from trainmj.paper.collisions import Collisions
from trainmj.paper.comparison import OURS, Comparison
from trainmj.paper.finding import Law
from trainmj.paper.printed import numbers, published, split_unit

if TYPE_CHECKING:
    import pandas as pd

_NAMES = {"anti_climber": "S_anti", "stroke_m1_m2": "S12", "stroke_m2_m3": "S23"} | {
    f"energy_{a}": f"E_{b}" for a, b in (("s1_m1", "front"), ("m1_m2", "12"), ("m2_m3", "23"))
}

_LEVELS = (0.70, 0.65, 0.60, 0.55)  # of the initial speed: M1 passes them after the empty stroke, before it balances
_LEVELS_SAID = "0.70, 0.65, 0.60, 0.55 of V"


def laws_of_D(collisions: Collisions, tables: Mapping[str, Comparison]) -> Iterator[Law]:
    """Section 5."""
    three = tables["3"].found[OURS]
    yield _trend("5.1", "S_anti grows with D in general", numbers(three, "anti_climber_mm"), "mm", up=True)
    yield _trend("5.1", "S12 grows with D in general", numbers(three, "stroke_m1_m2_mm"), "mm", up=True)
    yield _trend(
        "5.1", "S23 gradually falls with D", numbers(three, "stroke_m2_m3_mm"), "mm", up=False, throughout=True
    )
    yield _rest("5.1", "D", collisions.over_D(), collisions)
    yield from _changes("5.1", tables["3"], bars.CHANGE_POINTS)
    yield _rank("5.1", tables["3"])
    yield _sheared("5.1", "D", tables["3"])
    first, last = collisions.over_D()[0], collisions.over_D()[-1]
    apart = {n: _apart(first, last, n) for n in range(6)}
    V = float(first.chain.speed[0])
    since = [_since(first, last, n) for n in (0, 1)]
    yield Law(
        "5.2",
        "With D the speeds of M1 and M2 shift, from 0.2 s on",
        "0.2 s",
        f"apart by 1 % of V since {since[0]:.3f} and {since[1]:.3f} s",
        all(abs(t - 0.2) < 0.05 for t in since),
        "0.2 s within 0.05 s",
    )
    later = [_later(first, last, n) for n in (0, 1)]
    yield Law(
        "5.2",
        "The shifted speeds of M1 and M2 run parallel",
        "",
        "; ".join(f"M{n + 1} later by {_said(t)} ms" for n, t in enumerate(later)) + f" at {_LEVELS_SAID}",
        all(np.ptp(t) < 0.1 * t.mean() for t in later),
        "the delay at falling speed varies by less than a tenth",
    )
    rest = max(apart[n] for n in range(2, 6))
    yield Law(
        "5.2",
        "The speeds of M3 to M6 remain the same under D",
        "",
        "at most apart: " + ", ".join(f"M{n + 1} {100 * apart[n] / V:.1f} %" for n in range(6)) + " of V",
        rest < 0.5 * max(apart[0], apart[1]) and rest < 0.05 * V,
        "below 5 % of V, and less than half of what M1 or M2 move apart",
    )
    yield from _balance("5.2", tables["balance"], "D_mm")
    yield from _changes("5.2", tables["4"], bars.CHANGE_POINTS_OF_PEAKS)
    yield from _changes("5.3", tables["5"], bars.CHANGE_POINTS_OF_PEAKS)


def laws_of_M(collisions: Collisions, tables: Mapping[str, Comparison]) -> Iterator[Law]:
    """Section 6."""
    six = tables["6"].found[OURS]
    for name, head in (("S_anti", "anti_climber_mm"), ("S12", "stroke_m1_m2_mm"), ("S23", "stroke_m2_m3_mm")):
        yield _trend("6.1", f"{name} grows with M in general", numbers(six, head), "mm", up=True)
    yield _rest("6.1", "M", collisions.over_M(), collisions)
    yield from _changes("6.1", tables["6"], bars.CHANGE_POINTS)
    yield _rank("6.1", tables["6"])
    yield _sheared("6.1", "M", tables["6"])
    first, last = collisions.over_M()[0], collisions.over_M()[-1]
    later = [_later(first, last, n) for n in range(6)]
    yield Law(
        "6.2",
        "With M the speeds of all vehicles shift and gradually diverge",
        "",
        "; ".join(f"M{n + 1} later by {_said(later[n])} ms" for n in (0, 1, 5)) + f" at {_LEVELS_SAID}",
        all((np.diff(t) > 0).all() for t in later),
        "the delay grows as the speed falls, for every vehicle",
    )
    yield from _balance("6.2", tables["balance"], "M_t")
    spread = [_spread_of_force(collisions.over_M(), collisions, n) for n in range(6)]
    yield Law(
        "6.2",
        "Peak accelerations fall with M (said: linearly; it is as 1/M)",
        "",
        "mass times peak varies by " + ", ".join(f"M{n + 1} {100 * s:.2f}" for n, s in enumerate(spread)) + " %",
        max(spread) < 0.03,
        "below 3 % while M grows by 20 %",
    )
    yield from _changes("6.2", tables["7"], bars.CHANGE_POINTS_OF_PEAKS)
    yield from _changes("6.3", tables["8"], bars.CHANGE_POINTS_OF_PEAKS)


def _trend(section: str, statement: str, y: Array, unit: str, up: bool, throughout: bool = False) -> Law:
    steps = np.diff(y) if up else -np.diff(y)
    against = int((steps < 0).sum())
    said = f"{y[0]:.1f} to {y[-1]:.1f} {unit}" + (f", {against} of {len(steps)} steps against it" if against else "")
    holds = against == 0 if throughout else steps.sum() > 0
    return Law(section, statement, "", said, bool(holds), "every row" if throughout else "last row against the first")


def _rest(section: str, factor: str, results: Sequence[Result], collisions: Collisions) -> Law:
    """The last three interfaces hardly change."""
    strokes = np.array([[i.stroke_mm for i in _summary(r, collisions).interfaces[3:6]] for r in results])
    change = float((np.ptp(strokes, axis=0)).max())
    return Law(
        section,
        f"Strokes of the last three interfaces hardly change with {factor}",
        "",
        f"sum {strokes.sum(axis=1).min():.1f} to {strokes.sum(axis=1).max():.1f} mm, each by at most {change:.2f} mm",
        change < 2.0,
        "each by less than 2 mm",
    )


def _changes(section: str, table: Comparison, bar: float) -> Iterator[Law]:
    """Relative changes from the first row to the last, one law for a table."""
    printed = published("relative_changes")
    number = table.title.split(".")[0].removeprefix("Table ")
    rows = printed[printed["table"] == int(number)]
    ours = []
    for quantity in rows["quantity"]:
        (head,) = (h for h in table.heads if split_unit(h)[0] == quantity)
        y = table.found[OURS][head]
        ours.append(100 * float(y.iloc[-1] / y.iloc[0] - 1))
    names = [_NAMES.get(q, q.replace("peak_acc_m", "M")) for q in rows["quantity"]]
    off = np.abs(np.array(ours) - rows["relative_change_percent"].to_numpy())
    yield Law(
        section,
        f"Relative changes, Table {number}: {', '.join(names)}",
        ", ".join(f"{v:+.2f}" for v in rows["relative_change_percent"]) + " %",
        ", ".join(f"{v:+.2f}" for v in ours) + " %",
        bool(off.max() <= bar),
        f"each within {bar:g} points (largest {off.max():.2f})",
    )


def _rank(section: str, table: Comparison) -> Law:
    """Which of the first three interfaces changes most."""
    heads = ("anti_climber_mm", "stroke_m1_m2_mm", "stroke_m2_m3_mm")

    def order(rows: pd.DataFrame) -> list[str]:
        change = {h: abs(float(numbers(rows, h)[-1] / numbers(rows, h)[0] - 1)) for h in heads}
        return [_NAMES[split_unit(h)[0]] for h in sorted(heads, key=lambda h: -change[h])]

    printed, ours = order(table.published), order(table.found[OURS])
    factor = "D" if "D_mm" in table.keys else "M"
    return Law(
        section,
        f"Strokes in the order in which {factor} changes them",
        ", ".join(printed),
        ", ".join(ours),
        printed == ours,
        "the same order",
    )


def _sheared(section: str, factor: str, table: Comparison) -> Law:
    least = float(table.found[OURS]["coupler_mm"].min())
    return Law(
        section,
        f"The coupler of the front is used up and sheared off for every {factor}",
        f"{table.published['coupler_mm'].min():g} mm",
        f"{least:.1f} mm at least",
        bool(least >= table.published["coupler_mm"].max() - bars.COUPLER_MM),
        "every row",
    )


def _balance(section: str, table: Comparison, parameter: str) -> Iterator[Law]:
    rows = np.flatnonzero(table.keys["parameter"] == parameter)
    printed, ours = (t["balance_time_s"].to_numpy() for t in (table.published, table.found[OURS]))
    for first, last in zip(rows[::2], rows[1::2], strict=True):
        vehicle, low, high = (table.keys[k].iloc[i] for k, i in (("vehicle", first), ("value", first), ("value", last)))
        off = np.abs(ours[[first, last]] / printed[[first, last]] - 1).max()
        name, unit = split_unit(parameter)
        yield Law(
            section,
            f"Balance time of {vehicle} for {name} from {low:g} to {high:g} {unit}",
            f"{printed[first]:.3f} to {printed[last]:.3f} s",
            f"{ours[first]:.3f} to {ours[last]:.3f} s" + (" (M3)" if vehicle == "M3-M6" else ""),
            bool(off <= bars.BALANCE_TIME_EACH),
            f"within {100 * bars.BALANCE_TIME_EACH:g} % (largest {100 * off:.1f} %)",
        )


def _summary(result: Result, collisions: Collisions) -> Summary:
    """The numbers of a result among those computed already."""
    (case,) = (c for c, r in collisions.results.items() if r is result)
    return collisions.summaries[case]


def _speed(result: Result, n: int, time: Array) -> Array:
    """Speed of M(n+1) at some times [m/s], held after the end."""
    return np.asarray(np.interp(time, result.time, result.velocity[:, result.chain.front - n]))


def _apart(first: Result, last: Result, n: int) -> float:
    """Largest distance between two speeds of a vehicle at one time [m/s]."""
    time = first.time if len(first.time) > len(last.time) else last.time
    return float(np.abs(_speed(first, n, time) - _speed(last, n, time)).max())


def _since(first: Result, last: Result, n: int) -> float:
    """When two speeds of a vehicle are first apart by 1 % of the initial speed [s]."""
    gap = np.abs(_speed(first, n, first.time) - _speed(last, n, first.time))
    return float(first.time[np.argmax(gap > 0.01 * float(first.chain.speed[0]))])


def _later(first: Result, last: Result, n: int) -> Array:
    """By how much later a vehicle falls through some speeds, of the last case against the first [s]."""
    V = float(first.chain.speed[0])
    times = []
    for result in (first, last):
        speed = np.minimum.accumulate(result.velocity[:, result.chain.front - n])
        times.append(np.interp(-np.array(_LEVELS) * V, -speed, result.time))
    return np.asarray(times[1] - times[0])


def _said(times: Array) -> str:
    return ", ".join(f"{1e3 * t:.1f}" for t in times)


def _spread_of_force(results: Sequence[Result], collisions: Collisions, n: int) -> float:
    """Range of mass times peak acceleration over its mean."""
    vehicles = [_summary(r, collisions).vehicles[n] for r in results]
    force = [v.mass_t * v.peak_device_acceleration_g for v in vehicles]
    return float(np.ptp(force) / np.mean(force))
