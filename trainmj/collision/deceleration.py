"""Accelerations that need a history: means over a moving window, and the channel filter.

They use recorded speeds. A mean acceleration is a difference of speeds divided by a time, so it misses no peak between
two records.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from trainmj.collision.envelope import Array

_J211 = 2.0775  # SAE J211: a channel filter is designed for this times its class, so that -3 dB is at CFC / 0.6
FILTER_INTERVAL = 1 / 600
"""Longest time between two records that the channel filter takes [s]."""

WINDOW_RECORDS = 30
"""Fewest records in a moving window: with them a mean misses at most a few tenths of a percent of its peak."""

SETTLED = 0.010
"""What comes later than this moves a filtered value by less than 0.2 % of its own size [s]."""

_SILENCE = 0.05  # around a signal, by which the filter has died away [s]


def window_peak(window: float, time: Array, velocity: Array, cut: bool = False) -> Array:
    """Largest |mean acceleration| over a moving window; after the end the speeds are held.

    Args:
        window: its length [s].
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].
        cut: whether the collision was cut off at the last record: what follows is not known then, and only windows
            that end before count.

    Returns:
        (n_vehicle,) [m/s2]; NaN of a collision that was cut off before the end of the first window.
    """
    if len(time) < 2:
        return np.full(velocity.shape[1], np.nan if cut else 0.0)
    shift = window / (time[1] - time[0])
    whole = round(shift)
    rows = velocity.T  # one vehicle each
    if cut:
        latest = float(time[-1]) - window
        if latest < time[0] - 1e-9 * window:
            return np.full(velocity.shape[1], np.nan)
        start = np.append(time[time < latest], latest)
        change = np.array([np.abs(np.interp(start + window, time, v) - np.interp(start, time, v)).max() for v in rows])
    elif abs(shift - whole) < 1e-6:
        inside = max(0, len(time) - whole)  # windows that end at a record; the others end at the last speed
        change = np.abs(rows[:, -1:] - rows[:, inside:]).max(axis=1)
        if inside:
            change = np.maximum(change, np.abs(rows[:, whole:] - rows[:, :inside]).max(axis=1))
    else:
        change = np.array([np.abs(np.interp(time + window, time, v) - v).max() for v in rows])
    return np.asarray(change / window)


def cfc60_peak(time: Array, velocity: Array, cut: bool = False) -> Array:
    """Largest |acceleration| behind the channel filter CFC 60 of SAE J211: 100 Hz, four poles, no phase.

    The filter, a two-pole Butterworth run forward and back, acts on the mean acceleration between records; running it
    twice multiplies the spectrum by the square of its gain. Before the impact and behind the end there is silence.

    Args:
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].
        cut: whether the collision was cut off at the last record: the silence behind it is not real then, and only
            instants to which it does not reach count.

    Returns:
        (n_vehicle,) [m/s2]; NaN if the records are too far apart for the filter, more than 1/600 s, or too few of a
        collision that was cut off.
    """
    if len(time) < 2:
        return np.zeros(velocity.shape[1])
    interval = float(time[1] - time[0])
    if interval > FILTER_INTERVAL:
        return np.full(velocity.shape[1], np.nan)
    filtered = np.abs(_filtered(interval, velocity))
    if cut:
        filtered = filtered[:, : _known(interval, len(time))]
    return np.asarray(filtered.max(axis=1)) if filtered.size else np.full(velocity.shape[1], np.nan)


def cfc60(interval: float, velocity: Array, cut: bool = False) -> tuple[float, Array]:
    """Acceleration behind the channel filter of :func:`cfc60_peak`, from the silence before the impact to that behind.

    Args:
        interval: between two records [s], at most 1/600.
        velocity: (n_sample, n_vehicle) [m/s].
        cut: whether the collision was cut off at the last record: it then ends where the silence behind does not reach.

    Returns:
        The first instant [s], half an interval off the records, and (n_vehicle, n) [m/s2] from there, an interval
        apart.
    """
    quiet = int(np.ceil(_SILENCE / interval))
    filtered = _filtered(interval, velocity)
    end = _known(interval, len(velocity)) if cut else len(velocity) - 1 + quiet
    return (0.5 - quiet) * interval, np.concatenate([filtered[:, -quiet:], filtered[:, :end]], axis=1)


def _filtered(interval: float, velocity: Array) -> Array:
    """(n_vehicle, n) filtered accelerations [m/s2], the silence behind the end, and that before the impact."""
    known = len(velocity) - 1
    n = known + 2 * int(np.ceil(_SILENCE / interval))
    n = 1 << (n - 1).bit_length()
    spectrum = np.fft.rfft(np.diff(velocity.T) / interval, n)
    return np.asarray(np.fft.irfft(spectrum * _gain(interval, n), n))


@lru_cache(maxsize=16)
def _gain(interval: float, n: int) -> Array:
    """(n // 2 + 1,) square of the gain of the filter at the frequencies of n values; not to be changed."""
    corner = np.tan(np.pi * 60 * _J211 * interval)
    return np.asarray(1.0 / (1.0 + (np.tan(np.pi * np.fft.rfftfreq(n)) / corner) ** 4))


def _known(interval: float, n_sample: int) -> int:
    """How many filtered values the silence behind the last record does not reach."""
    return max(0, n_sample - 1 - int(np.ceil(SETTLED / interval)))
