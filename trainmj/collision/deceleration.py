"""Accelerations that need a history: means over a time or a moving window, and the channel filter.

They use recorded speeds. A mean acceleration is a difference of speeds divided by a time, so it misses no peak between
two records.
"""

from __future__ import annotations

import numpy as np

from trainmj.collision.device import Array

_J211 = 2.0775  # SAE J211: a channel filter is designed for this times its class, so that -3 dB is at CFC / 0.6
FILTER_INTERVAL = 1 / 600
"""Longest time between two records that the channel filter takes [s]."""

_SILENCE = 0.05  # around a signal, by which the filter has died away [s]


def mean_deceleration(first: float, last: float, time: Array, velocity: Array) -> Array:
    """|Change of speed| between two instants, over the time between them.

    Args:
        first: instant [s]; negative if there is none.
        last: instant [s].
        time: (n_sample,) [s].
        velocity: (n_sample, n_vehicle) [m/s].

    Returns:
        (n_vehicle,) [m/s2]; 0 if there is no time between the two, or only one record.
    """
    if first < 0 or last <= first or len(time) < 2:
        return np.zeros(velocity.shape[1])
    change = np.abs(_at(last, time, velocity) - _at(first, time, velocity))
    return np.asarray(change / (last - first))


def _at(instant: float, time: Array, velocity: Array) -> Array:
    """(n_vehicle,) speeds between two records [m/s]."""
    k = min(int(np.searchsorted(time, instant, side="right")), len(time) - 1)
    share = (instant - time[k - 1]) / (time[k] - time[k - 1])
    return np.asarray(velocity[k - 1] + share * (velocity[k] - velocity[k - 1]))


def window_peak(window: float, time: Array, velocity: Array) -> Array:
    """Largest |mean acceleration| over a moving window; after the end the speeds are held.

    Args:
        window: its length [s].
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].

    Returns:
        (n_vehicle,) [m/s2].
    """
    if len(time) < 2:
        return np.zeros(velocity.shape[1])
    shift = window / (time[1] - time[0])
    whole = round(shift)
    rows = velocity.T  # one vehicle each
    if abs(shift - whole) < 1e-6:
        inside = max(0, len(time) - whole)  # windows that end at a record; the others end at the last speed
        change = np.abs(rows[:, -1:] - rows[:, inside:]).max(axis=1)
        if inside:
            change = np.maximum(change, np.abs(rows[:, whole:] - rows[:, :inside]).max(axis=1))
    else:
        change = np.array([np.abs(np.interp(time + window, time, v) - v).max() for v in rows])
    return np.asarray(change / window)


def cfc60_peak(time: Array, velocity: Array) -> Array:
    """Largest |acceleration| behind the channel filter CFC 60 of SAE J211: 100 Hz, four poles, no phase.

    The filter, a two-pole Butterworth run forward and back, acts on the mean acceleration between records; running it
    twice multiplies the spectrum by the square of its gain. Before the impact and behind the end there is silence.

    Args:
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].

    Returns:
        (n_vehicle,) [m/s2]; NaN if the records are too far apart for the filter, more than 1/600 s.
    """
    if len(time) < 2:
        return np.zeros(velocity.shape[1])
    interval = float(time[1] - time[0])
    if interval > FILTER_INTERVAL:
        return np.full(velocity.shape[1], np.nan)
    n = len(time) - 1 + 2 * int(np.ceil(_SILENCE / interval))
    n = 1 << (n - 1).bit_length()
    corner = np.tan(np.pi * 60 * _J211 * interval)
    gain = 1.0 / (1.0 + (np.tan(np.pi * np.fft.rfftfreq(n)) / corner) ** 4)
    spectrum = np.fft.rfft(np.diff(velocity.T) / interval, n)
    return np.asarray(np.abs(np.fft.irfft(spectrum * gain, n)).max(axis=1))
