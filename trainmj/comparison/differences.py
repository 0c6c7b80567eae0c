"""How far two channels differ while both are there: nothing is extrapolated.

Between their values both are straight lines; means and root mean squares are the integrals of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.comparison.sides import Series, Side
from trainmj.units import MS

_GRID = 201  # shifts that are tried before the best one is refined
_WIDEST = 0.25  # of the shorter record: the largest shift
_MOST_ALIGNED = 12  # channels that tell the shift


@dataclass(frozen=True)
class Difference:
    """A channel of both.

    Peaks are the values of largest magnitude; all is from ``from_s`` to ``to_s``, where both are there. Differences are
    those of the first from the second, and percentages are of the second.
    """

    channel: str
    unit: str
    offset_ms: float  # by which the clock of the second was put forward
    from_s: float
    to_s: float
    peak_a: float
    peak_b: float
    peak_time_a_s: float
    peak_time_b_s: float
    mean_a: float
    mean_b: float
    rms_b: float
    rms_difference: float  # root mean square of the difference

    @property
    def peak_percent(self) -> float:
        """How far the peaks differ [%]."""
        return percent(self.peak_a - self.peak_b, self.peak_b)

    @property
    def mean_percent(self) -> float:
        """How far the means differ [%]."""
        return percent(self.mean_a - self.mean_b, self.mean_b)

    @property
    def rms_percent(self) -> float:
        """The root mean square of the difference, of that of the second [%]."""
        return percent(self.rms_difference, self.rms_b)

    def as_row(self) -> dict[str, Any]:
        """Plain values for a table."""
        return asdict(self) | {
            "peak_difference": self.peak_a - self.peak_b,
            "peak_difference_percent": self.peak_percent,
            "peak_time_difference_s": self.peak_time_a_s - self.peak_time_b_s,
            "mean_difference": self.mean_a - self.mean_b,
            "mean_difference_percent": self.mean_percent,
            "rms_difference_percent": self.rms_percent,
        }


def percent(part: float, whole: float) -> float:
    """A part of a whole [%]; 0 of nothing is 0, something of nothing no number."""
    return 100.0 * part / abs(whole) if whole else (0.0 if part == 0.0 else math.nan)


def common(*series: Series) -> tuple[float, float] | None:
    """First and last time [s] at which all are there; None if there is no time in between."""
    start, end = max(one.time[0] for one in series), min(one.time[-1] for one in series)
    return (float(start), float(end)) if start < end else None


def instants(window: tuple[float, float], *series: Series) -> Array:
    """Every time in a window at which one of them has a value, its ends included."""
    start, end = window
    inner = np.concatenate([one.time[(one.time > start) & (one.time < end)] for one in series])
    return np.unique(np.concatenate([[start], inner, [end]]))


def difference(channel: str, a: Series, b: Series, offset_ms: float = 0.0) -> Difference | None:
    """The difference of a channel; None if there is no time at which both are there."""
    moved = b._replace(time=b.time + offset_ms * MS)
    window = common(a, moved)
    if window is None:
        return None
    time = instants(window, a, moved)
    one, other = a.at(time), moved.at(time)
    peaks = [int(np.argmax(np.abs(values))) for values in (one, other)]
    return Difference(
        channel,
        a.unit,
        offset_ms,
        *window,
        float(one[peaks[0]]),
        float(other[peaks[1]]),
        float(time[peaks[0]]),
        float(time[peaks[1]]),
        _mean(time, one),
        _mean(time, other),
        _rms(time, other),
        _rms(time, one - other),
    )


def _mean(time: Array, values: Array) -> float:
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _rms(time: Array, values: Array) -> float:
    """Root mean square of straight lines between values."""
    left, right = values[:-1], values[1:]
    squares = np.sum(np.diff(time) * (left**2 + left * right + right**2)) / 3.0
    return math.sqrt(max(0.0, float(squares) / float(time[-1] - time[0])))


def differences(a: Side, b: Side, offset_ms: float = 0.0) -> Iterator[Difference]:
    """Every channel that both have, in the order of the first."""
    for name, series in a.channels.items():
        if name in b.channels and (found := difference(name, series, b.channels[name], offset_ms)):
            yield found


def best_offset(a: Side, b: Side) -> float:
    """The shift of the second's clock with which the two differ least [ms].

    That is the sum over the first 12 channels of both of the mean square of the difference, over that of the second's
    channel; shifts up to a quarter of the shorter record are looked at.
    """
    from scipy.optimize import minimize_scalar

    names = [name for name in a.channels if name in b.channels][:_MOST_ALIGNED]
    pairs = {name: (a.channels[name], b.channels[name]) for name in names}
    spans = [float(series.time[-1] - series.time[0]) for pair in pairs.values() for series in pair]
    most = _WIDEST * min(spans) / MS
    shifts = np.linspace(-most, most, _GRID)
    costs = [_cost(pairs, shift) for shift in shifts]
    best = int(np.argmin(costs))
    low, high = shifts[max(0, best - 1)], shifts[min(_GRID - 1, best + 1)]
    found = minimize_scalar(lambda shift: _cost(pairs, shift), bounds=(low, high), method="bounded")
    return float(f"{found.x:.6g}") if found.fun < min(costs) else float(shifts[best])


def _cost(pairs: Mapping[str, tuple[Series, Series]], offset_ms: float) -> float:
    total = 0.0
    for name, (one, other) in pairs.items():
        found = difference(name, one, other, offset_ms)
        if found is None:
            return math.inf
        total += (found.rms_difference / found.rms_b) ** 2 if found.rms_b else 0.0
    return total
