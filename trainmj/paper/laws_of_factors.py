"""Laws of Sections 5 and 6, over the empty stroke D and the mass M, checked on our results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from trainmj.collision.device import Array
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.paper import bars
from trainmj.paper.bars import STROKES
from trainmj.paper.collisions import Collisions
from trainmj.paper.finding import Law
from trainmj.paper.printed import numbers, published, split_unit
from trainmj.paper.tables import OURS, Comparison

_NAMES = {"anti_climber": "S_anti", "stroke_m1_m2": "S12", "stroke_m2_m3": "S23"} | {
    f"energy_{a}": f"E_{b}" for a, b in (("s1_m1", "front"), ("m1_m2", "12"), ("m2_m3", "23"))
}

_LEVELS = (0.70, 0.65, 0.60, 0.55)  # of the initial speed: M1 passes them after the empty stroke, before it balances
_LEVELS_SAID = "0.70, 0.65, 0.60, 0.55 of V"


def laws_of_D(collisions: Collisions, tables: Mapping[str, Comparison]) -> Iterator[Law]:
    """Section 5."""
    results, summaries = zip(*collisions.over("D"), strict=True)
    three = tables["3"].found[OURS]
    yield _trend("5.1", "S_anti grows with D in general", numbers(three, "anti_climber_mm"))
    yield _trend("5.1", "S12 grows with D in general", numbers(three, "stroke_m1_m2_mm"))
    S23 = numbers(three, "stroke_m2_m3_mm")
    yield _trend("5.1", "S23 gradually falls with D", S23, up=False, throughout=True)
    yield from _interfaces("5.1", "D", tables, "3", summaries)
    yield from _shifted_speeds(results[0], results[-1])
    yield from _balance("5.2", tables["balance"], "D_mm")
    yield _changes("5.2", tables, "4")
    yield _changes("5.3", tables, "5")


def laws_of_M(collisions: Collisions, tables: Mapping[str, Comparison]) -> Iterator[Law]:
    """Section 6."""
    results, summaries = zip(*collisions.over("M"), strict=True)
    for head, name in STROKES.items():
        yield _trend("6.1", f"{name} grows with M in general", numbers(tables["6"].found[OURS], head))
    yield from _interfaces("6.1", "M", tables, "6", summaries)
    later = [_later(results[0], results[-1], n) for n in range(6)]
    yield Law(
        "6.2",
        "With M the speeds of all vehicles shift and gradually diverge",
        "; ".join(f"M{n + 1} later by {_said(later[n])} ms" for n in (0, 1, 5)) + f" at {_LEVELS_SAID}",
        all((np.diff(t) > 0).all() for t in later),
        "the delay grows as the speed falls, for every vehicle",
    )
    yield from _balance("6.2", tables["balance"], "M_t")
    spread = [_spread_of_force(summaries, n) for n in range(6)]
    yield Law(
        "6.2",
        "Peak accelerations fall with M (said: linearly; it is as 1/M)",
        "mass times peak varies by " + ", ".join(f"M{n + 1} {100 * s:.2f}" for n, s in enumerate(spread)) + " %",
        max(spread) < 0.03,
        "below 3 % while M grows by 20 %",
    )
    yield _changes("6.2", tables, "7")
    yield _changes("6.3", tables, "8")


def _trend(section: str, statement: str, y: Array, up: bool = True, throughout: bool = False) -> Law:
    """A stroke [mm] that grows or falls from row to row."""
    steps = np.diff(y) if up else -np.diff(y)
    against = int((steps < 0).sum())
    said = f"{y[0]:.1f} to {y[-1]:.1f} mm" + (f", {against} of {len(steps)} steps against it" if against else "")
    holds = against == 0 if throughout else steps.sum() > 0
    return Law(section, statement, said, bool(holds), "every row" if throughout else "last row against the first")


def _interfaces(
    section: str, factor: str, tables: Mapping[str, Comparison], number: str, summaries: Sequence[Summary]
) -> Iterator[Law]:
    """What is said of the strokes and energies over one factor, beside their trends."""
    strokes = np.array([[i.stroke_mm for i in s.interfaces[3:6]] for s in summaries])
    change = float((np.ptp(strokes, axis=0)).max())
    yield Law(
        section,
        f"Strokes of the last three interfaces hardly change with {factor}",
        f"sum {strokes.sum(axis=1).min():.1f} to {strokes.sum(axis=1).max():.1f} mm, each by at most {change:.2f} mm",
        change < 2.0,
        "each by less than 2 mm",
    )
    yield _changes(section, tables, number, bars.CHANGE_POINTS)
    table = tables[number]
    quantities = [split_unit(head)[0] for head in STROKES]
    printed, ours = ([_NAMES[q] for q in sorted(quantities, key=lambda q: -abs(table.changes(q)[k]))] for k in (0, 1))
    said = f"Strokes in the order in which {factor} changes them"
    yield Law(section, said, ", ".join(ours), printed == ours, "the same order", published=", ".join(printed))
    couplers, our_couplers = table.pair("coupler_mm")
    yield Law(
        section,
        f"The coupler of the front is used up and sheared off for every {factor}",
        f"{our_couplers.min():.1f} mm at least",
        bool(our_couplers.min() >= couplers.max() - bars.COUPLER_MM),
        "every row",
        published=f"{couplers.min():g} mm",
    )


def _changes(
    section: str, tables: Mapping[str, Comparison], number: str, bar: float = bars.CHANGE_POINTS_OF_PEAKS
) -> Law:
    """Relative changes from the first row of a table to the last."""
    rows = published("relative_changes").query(f"table == {int(number)}")
    printed = numbers(rows, "relative_change_percent")
    ours = [tables[number].changes(quantity)[1] for quantity in rows["quantity"]]
    names = [_NAMES.get(q, q.replace("peak_acc_m", "M")) for q in rows["quantity"]]
    off = np.abs(np.array(ours) - printed)
    said = [", ".join(f"{v:+.2f}" for v in values) + " %" for values in (printed, ours)]
    statement = f"Relative changes, Table {number}: {', '.join(names)}"
    rule = f"each within {bar:g} points (largest {off.max():.2f})"
    return Law(section, statement, said[1], bool(off.max() <= bar), rule, published=said[0])


def _shifted_speeds(first: Result, last: Result) -> Iterator[Law]:
    """Section 5.2, of the speeds for the smallest and the largest empty stroke."""
    V = float(first.chain.speed[0])
    since = [_since(first, last, n) for n in (0, 1)]
    yield Law(
        "5.2",
        "With D the speeds of M1 and M2 shift, from 0.2 s on",
        f"apart by 1 % of V since {since[0]:.3f} and {since[1]:.3f} s",
        all(abs(t - 0.2) < 0.05 for t in since),
        "0.2 s within 0.05 s",
        published="0.2 s",
    )
    later = [_later(first, last, n) for n in (0, 1)]
    yield Law(
        "5.2",
        "The shifted speeds of M1 and M2 run parallel",
        "; ".join(f"M{n + 1} later by {_said(t)} ms" for n, t in enumerate(later)) + f" at {_LEVELS_SAID}",
        all(np.ptp(t) < 0.1 * t.mean() for t in later),
        "the delay at falling speed varies by less than a tenth",
    )
    apart = [_apart(first, last, n) for n in range(6)]
    yield Law(
        "5.2",
        "The speeds of M3 to M6 remain the same under D",
        "at most apart: " + ", ".join(f"M{n + 1} {100 * a / V:.1f} %" for n, a in enumerate(apart)) + " of V",
        max(apart[2:]) < 0.5 * max(apart[:2]) and max(apart[2:]) < 0.05 * V,
        "below 5 % of V, and less than half of what M1 or M2 move apart",
    )


def _balance(section: str, table: Comparison, parameter: str) -> Iterator[Law]:
    """Balance times at the two ends of a factor's range, one law for each vehicle that is named."""
    rows = np.flatnonzero(table.keys["parameter"] == parameter)
    name, unit = split_unit(parameter)
    printed, ours = table.pair("balance_time_s")
    for ends in zip(rows[::2], rows[1::2], strict=True):
        k = list(ends)
        low, high = table.keys["value"].iloc[k]
        vehicle = table.keys["vehicle"].iloc[k[0]]
        times = [f"{t[k[0]]:.3f} to {t[k[1]]:.3f} s" for t in (printed, ours)]
        off = np.abs(ours[k] / printed[k] - 1).max()
        yield Law(
            section,
            f"Balance time of {vehicle} for {name} from {low:g} to {high:g} {unit}",
            times[1] + (" (M3)" if vehicle == "M3-M6" else ""),
            bool(off <= bars.BALANCE_TIME_EACH),
            f"within {100 * bars.BALANCE_TIME_EACH:g} % (largest {100 * off:.1f} %)",
            published=times[0],
        )


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


def _spread_of_force(summaries: Sequence[Summary], n: int) -> float:
    """Range of mass times peak acceleration over its mean."""
    force = [s.vehicles[n].mass_t * s.vehicles[n].peak_device_acceleration_g for s in summaries]
    return float(np.ptp(force) / np.mean(force))
