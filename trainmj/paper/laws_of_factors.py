"""Laws of Sections 5 and 6, over the empty stroke D and the mass M, checked on our results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.paper import bars
from trainmj.paper.collisions import Collisions
from trainmj.paper.finding import Law
from trainmj.paper.printed import SERIES, STROKES, numbers, published, split_unit
from trainmj.paper.tables import OURS, Comparison, Tables
from trainmj.units import against

_NAMES = {split_unit(head)[0]: name for head, name in STROKES.items()} | {
    "energy_s1_m1": "E_front",
    "energy_m1_m2": "E_12",
    "energy_m2_m3": "E_23",
}

_POINTS = 6.0  # of a relative change of strokes and energies: 5 mm at both ends of a stroke of 220 mm make 5
_POINTS_OF_PEAKS = 1.5  # of a relative change of peak accelerations, TS and TAMA: 1 % at both ends would make 2

_LEVELS = (0.70, 0.65, 0.60, 0.55)  # of the initial speed: M1 passes them after the empty stroke, before it balances


def laws_of_D(collisions: Collisions, tables: Tables) -> Iterator[Law]:
    """Section 5."""
    results, summaries = zip(*collisions.over("D"), strict=True)
    S_anti, S12, S23 = (numbers(tables["3"].found[OURS], head) for head in STROKES)
    yield _trend("5.1", "S_anti grows with D in general", S_anti)
    yield _trend("5.1", "S12 grows with D in general", S12)
    yield _trend("5.1", "S23 gradually falls with D", S23, falls=True)
    yield from _interfaces("5.1", "D", tables, summaries)
    yield from _shifted_speeds(results[0], results[-1])
    yield from _balance("5.2", tables["balance"], "D_mm")
    yield _changes("5.2", tables, "4")
    yield _changes("5.3", tables, "5")


def laws_of_M(collisions: Collisions, tables: Tables) -> Iterator[Law]:
    """Section 6."""
    results, summaries = zip(*collisions.over("M"), strict=True)
    for head, name in STROKES.items():
        yield _trend("6.1", f"{name} grows with M in general", numbers(tables["6"].found[OURS], head))
    yield from _interfaces("6.1", "M", tables, summaries)
    later = _later(results[0], results[-1])
    yield Law(
        "6.2",
        "With M the speeds of all vehicles shift and gradually diverge",
        _said_of_delays(later, (0, 1, 5)),
        bool((np.diff(later, axis=0) > 0).all()),
        "the delay grows as the speed falls, for every vehicle",
    )
    yield from _balance("6.2", tables["balance"], "M_t")
    force = np.array([[v.mass_t * v.peak_device_acceleration_g for v in s.vehicles[:6]] for s in summaries])
    spread = np.ptp(force, axis=0) / np.mean(force, axis=0)
    yield Law(
        "6.2",
        "Peak accelerations fall with M (said: linearly; it is as 1/M)",
        "mass times peak varies by " + ", ".join(f"M{n} {100 * s:.2f}" for n, s in enumerate(spread, start=1)) + " %",
        bool(spread.max() < 0.03),
        "below 3 % while M grows by 20 %",
    )
    yield _changes("6.2", tables, "7")
    yield _changes("6.3", tables, "8")


def _trend(section: str, statement: str, y: Array, falls: bool = False) -> Law:
    """A stroke [mm] that grows from the first row to the last, or falls from row to row."""
    steps = -np.diff(y) if falls else np.diff(y)
    against = int((steps < 0).sum())
    said = f"{y[0]:.1f} to {y[-1]:.1f} mm" + (f", {against} of {len(steps)} steps against it" if against else "")
    if falls:
        return Law(section, statement, said, against == 0, "every row")
    return Law(section, statement, said, bool(steps.sum() > 0), "last row against the first")


def _interfaces(section: str, factor: str, tables: Tables, summaries: Sequence[Summary]) -> Iterator[Law]:
    """What is said of the strokes and energies over one factor, beside their trends."""
    number = SERIES[factor].tables[0]
    table = tables[number]
    strokes = np.array([[i.stroke_mm for i in s.interfaces[3:6]] for s in summaries])
    total, change = strokes.sum(axis=1), float(np.ptp(strokes, axis=0).max())
    yield Law(
        section,
        f"Strokes of the last three interfaces hardly change with {factor}",
        f"sum {total.min():.1f} to {total.max():.1f} mm, each by at most {against(change, 2, 2)} mm",
        change < 2.0,
        "each by less than 2 mm",
    )
    yield _changes(section, tables, number, _POINTS)
    changes = {name: table.changes(split_unit(head)[0]) for head, name in STROKES.items()}
    printed, ours = (sorted(changes, key=lambda name: -abs(changes[name][k])) for k in (0, 1))
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


def _changes(section: str, tables: Tables, number: str, bar: float = _POINTS_OF_PEAKS) -> Law:
    """Relative changes from the first row of a table to the last."""
    rows = published("relative_changes").query(f"table == {number}")
    printed = numbers(rows, "relative_change_percent")
    ours = np.array([tables[number].changes(quantity)[1] for quantity in rows["quantity"]])
    names = [_NAMES.get(q, q.replace("peak_acc_m", "M")) for q in rows["quantity"]]
    off = np.abs(ours - printed)
    said = [", ".join(f"{v:+.2f}" for v in values) + " %" for values in (printed, ours)]
    statement = f"Relative changes, Table {number}: {', '.join(names)}"
    rule = f"each within {bar:g} points (largest {against(off.max(), bar, 2)})"
    return Law(section, statement, said[1], bool(off.max() <= bar), rule, published=said[0])


def _shifted_speeds(first: Result, last: Result) -> Iterator[Law]:
    """Section 5.2, of the speeds for the smallest and the largest empty stroke."""
    V = float(first.chain.speed[0])
    apart = np.abs(_speeds(first, first.time) - _speeds(last, first.time)) > 0.01 * V
    since = first.time[np.argmax(apart[:, :2], axis=0)]
    yield Law(
        "5.2",
        "With D the speeds of M1 and M2 shift, from 0.2 s on",
        f"apart by 1 % of V since {since[0]:.3f} and {since[1]:.3f} s",
        bool((np.abs(since - 0.2) < 0.05).all()),
        "0.2 s within 0.05 s",
        published="0.2 s",
    )
    later = _later(first, last)[:, :2]
    yield Law(
        "5.2",
        "The shifted speeds of M1 and M2 run parallel",
        _said_of_delays(later, (0, 1)),
        bool((np.ptp(later, axis=0) < 0.1 * later.mean(axis=0)).all()),
        "the delay at falling speed varies by less than a tenth",
    )
    time = max(first.time, last.time, key=len)
    most = np.abs(_speeds(first, time) - _speeds(last, time)).max(axis=0)
    yield Law(
        "5.2",
        "The speeds of M3 to M6 remain the same under D",
        "at most apart: " + ", ".join(f"M{n} {100 * a / V:.1f} %" for n, a in enumerate(most, start=1)) + " of V",
        bool(most[2:].max() < 0.5 * most[:2].max() and most[2:].max() < 0.05 * V),
        "below 5 % of V, and less than half of what M1 or M2 move apart",
    )


def _balance(section: str, table: Comparison, parameter: str) -> Iterator[Law]:
    """Balance times at the two ends of a factor's range, one law for each vehicle that is named."""
    rows = np.flatnonzero(table.keys["parameter"] == parameter)
    name, unit = split_unit(parameter)
    printed, ours = table.pair("balance_time_s")
    bar = bars.balance_time_bar()
    for k in rows.reshape(-1, 2):
        low, high = table.keys["value"].iloc[k]
        vehicle = table.keys["vehicle"].iloc[k[0]]
        times = [f"{t[k[0]]:.3f} to {t[k[1]]:.3f} s" for t in (printed, ours)]
        off = np.abs(ours[k] / printed[k] - 1).max()
        yield Law(
            section,
            f"Balance time of {vehicle} for {name} from {low:g} to {high:g} {unit}",
            times[1] + (" (M3)" if vehicle == "M3-M6" else ""),
            bool(off <= bar),
            f"within {100 * bar:g} % (largest {against(100 * off, 100 * bar, 1)} %)",
            published=times[0],
        )


def _moving(result: Result) -> Array:
    """(6, n_time) speeds of M1 to M6 [m/s]."""
    return result.velocity[:, result.chain.front :: -1].T


def _speeds(result: Result, time: Array) -> Array:
    """(n, 6) speeds of M1 to M6 at some times [m/s], held after the end."""
    return np.stack([np.interp(time, result.time, speed) for speed in _moving(result)], axis=1)


def _later(first: Result, last: Result) -> Array:
    """(n_level, 6) by how much later M1 to M6 fall through some speeds, of the last case against the first [s]."""
    levels = np.array(_LEVELS) * float(first.chain.speed[0])
    times = []
    for result in (first, last):
        falling = np.minimum.accumulate(_moving(result), axis=1)
        times.append([np.interp(-levels, -speed, result.time) for speed in falling])
    return np.subtract(times[1], times[0]).T


def _said_of_delays(later: Array, vehicles: Iterable[int]) -> str:
    said = (f"M{n + 1} later by {', '.join(f'{1e3 * t:.1f}' for t in later[:, n])} ms" for n in vehicles)
    return "; ".join(said) + f" at {', '.join(f'{level:.2f}' for level in _LEVELS)} of V"
