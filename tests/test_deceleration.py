"""Means over a moving window, and the channel filter, on signals whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, freqz, sosfilt, sosfreqz

from trainmj.collision.deceleration import cfc60_peak, window_peak

# moving windows


@pytest.mark.parametrize("interval", [1e-3, 0.7e-3])
def test_window_peak_is_the_largest_of_all_places(interval):
    """0.7 ms does not divide the windows: the end of a window then lies between two records."""
    time = np.arange(0.0, 0.3, interval)
    braked = 10 - 50 * np.clip(time - 0.05, 0, 0.06) - 20 * np.clip(time - 0.11, 0, 0.08)
    pushed = 30 * np.clip(time - 0.1, 0, 0.05)
    speeds = np.column_stack([braked, pushed])
    for clock in (time, time + 0.5):
        assert window_peak(0.030, clock, speeds).tolist() == pytest.approx([50.0, 30.0], rel=1e-9)
        assert window_peak(0.100, clock, speeds).tolist() == pytest.approx([38.0, 15.0], rel=1e-2)


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_a_window_of_whole_records_takes_their_speeds_to_the_last_digit(start):
    speeds = np.random.default_rng(5).normal(size=(300, 20))
    expected = np.abs(speeds[30:] - speeds[:-30]).max(axis=0)
    held = np.abs(speeds[-1] - speeds[-30:]).max(axis=0)
    found = window_peak(0.030, start + np.arange(300) * 1e-3, speeds)
    assert found.tolist() == (np.maximum(expected, held) / 0.030).tolist()


@pytest.mark.parametrize("interval", [1e-3, 0.7e-3])
def test_a_window_that_reaches_past_the_end_holds_the_last_speed(interval):
    """It looks ahead: the fall from 0.9 to 0.8 counts with the rise from 0, that from 1.0 alone does not."""
    time = np.arange(4) * interval
    speeds = np.array([[0.0, 3.0], [1.0, 2.5], [0.9, 2.0], [0.8, 1.0]])
    assert window_peak(0.030, time, speeds).tolist() == pytest.approx([0.8 / 0.030, 2.0 / 0.030])
    assert window_peak(0.030, time[:1], speeds[:1]).tolist() == [0.0, 0.0]
    assert window_peak(0.030, time[:2], speeds[:2]).tolist() == pytest.approx([1.0 / 0.030, 0.5 / 0.030])


def test_of_a_collision_that_was_cut_off_only_whole_windows_are_known():
    """10 m/s2 from 20 ms on, cut at 50 ms: held speeds would make 8 m/s2 of the 30 ms that begin later."""
    time = np.arange(51) * 1e-3
    speeds = 10 * np.clip(time - 0.02, 0, None)[:, None]
    assert window_peak(0.030, time, speeds, cut=True).tolist() == pytest.approx([10.0])
    assert window_peak(0.0307, time, speeds, cut=True).tolist() == pytest.approx([10 * 0.03 / 0.0307])
    assert window_peak(0.050, time, speeds, cut=True).tolist() == pytest.approx([6.0])
    assert np.isnan(window_peak(0.051, time, speeds, cut=True)).all()
    assert np.isnan(window_peak(0.030, time[:1], speeds[:1], cut=True)).all()


# CFC 60


def sine(frequency: float, interval: float = 1e-4, cycles: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Times and speeds (one vehicle) whose acceleration is a sine of amplitude 1 that fades in and out."""
    time = np.arange(0.0, cycles / frequency, interval)
    fade = np.minimum(1.0, np.minimum(time, time[-1] - time) * frequency / 10)
    acceleration = np.sin(2 * np.pi * frequency * time) * fade
    return np.append(time, time[-1] + interval), np.append(0.0, np.cumsum(acceleration) * interval)[:, None]


@pytest.mark.parametrize(
    ("frequency", "gain"),
    [(5.0, 1.0), (20.0, 1.0), (100.0, 10 ** (-3 / 20)), (200.0, None), (400.0, None)],
)
def test_cfc_60_passes_what_sae_j211_passes(frequency, gain):
    """-3 dB at 100 Hz is what the class 60 means; above it the gain falls as that of four poles."""
    if gain is None:
        corner = np.tan(np.pi * 60 * 2.0775 * 1e-4)
        gain = 1 / (1 + (np.tan(np.pi * frequency * 1e-4) / corner) ** 4)
    assert cfc60_peak(*sine(frequency))[0] == pytest.approx(gain, rel=0.01, abs=5e-3)


@pytest.mark.parametrize("interval", [1e-4, 1e-3])
def test_cfc_60_equals_scipys_butterworth_run_forward_and_back(interval):
    rng = np.random.default_rng(3)
    n = round(0.4 / interval)
    acceleration = rng.normal(size=(n, 3)) * np.exp(-np.linspace(0, 4, n))[:, None] * 30
    velocity = np.vstack([np.zeros(3), np.cumsum(acceleration, axis=0) * interval])
    time = np.arange(n + 1) * interval
    # SAE J211 App. C: the two-pole filter whose double run is -3 dB at CFC / 0.6 has its own corner at 2.0775 CFC
    sos = butter(2, 60 * 2.0775, fs=1 / interval, output="sos")
    silence = np.zeros((round(0.2 / interval), 3))
    padded = np.vstack([silence, acceleration, silence])
    expected = np.abs(sosfilt(sos, sosfilt(sos, padded, axis=0)[::-1], axis=0)[::-1]).max(axis=0)
    assert cfc60_peak(time, velocity) == pytest.approx(expected, rel=1e-6)
    assert cfc60_peak(time + 0.5, velocity) == pytest.approx(expected, rel=1e-6)


def test_the_filter_that_these_tests_compare_with_is_the_standards():
    """J211's own recipe for the coefficients, so that scipy's corner is not taken on trust."""
    interval, wd = 1e-4, 2 * np.pi * 60 * 2.0775
    wa = np.tan(wd * interval / 2)
    scale = 1 + np.sqrt(2) * wa + wa**2
    b = np.array([1, 2, 1]) * wa**2 / scale
    a = np.array([1, 2 * (wa**2 - 1) / scale, (1 - np.sqrt(2) * wa + wa**2) / scale])
    at = [20.0, 100.0, 300.0]
    printed = np.abs(freqz(b, a, at, fs=1 / interval)[1])
    assert np.abs(sosfreqz(butter(2, 60 * 2.0775, fs=1 / interval, output="sos"), at, fs=1 / interval)[1]) == (
        pytest.approx(printed, rel=1e-6)
    )


def test_cfc_60_says_nothing_where_records_are_too_far_apart():
    """Further apart than 1/600 s there is no telling what was between them."""
    speeds = np.cumsum(np.ones((200, 2)), axis=0)
    assert np.isnan(cfc60_peak(np.arange(200) / 599, speeds)).tolist() == [True, True]
    assert np.isfinite(cfc60_peak(np.arange(200) / 600, speeds)).all()
    assert cfc60_peak(np.array([0.0]), np.ones((1, 2))).tolist() == [0, 0]


def test_cfc_60_of_a_collision_that_was_cut_off_does_not_count_the_cut():
    """The signal that ends at once makes the filter ring; what comes later may be a step up or down or nothing."""
    time = np.arange(301) * 1e-3
    acceleration = 20 + 10 * np.sin(2 * np.pi * 7 * time[:-1])
    velocity = np.append(0.0, np.cumsum(acceleration) * 1e-3)[:, None]
    whole = cfc60_peak(time, velocity)
    for n in range(80, 300, 7):
        assert cfc60_peak(time[:n], velocity[:n], cut=True) <= whole * 1.002
    assert cfc60_peak(time[:252], velocity[:252])[0] > 1.02 * acceleration[200:251].max(), "as if silence followed"
    assert np.isnan(cfc60_peak(time[:8], velocity[:8], cut=True)).all()


@pytest.mark.parametrize("n", [2, 1025])
def test_cfc_60_sees_silence_before_and_behind(n):
    """A pulse in the last interval does not run into the first, although the transform goes around."""
    time = np.arange(n) * 1e-4
    pulse = np.zeros((n - 1, 2))
    pulse[-1] = 1.0, -2.0
    alone = cfc60_peak(time, np.vstack([np.zeros(2), np.cumsum(pulse, axis=0)]) * 1e-4)
    long = np.vstack([np.zeros((4000, 2)), pulse[-1], np.zeros((4000, 2))])
    assert alone == pytest.approx(
        cfc60_peak(np.arange(8002) * 1e-4, np.vstack([np.zeros(2), np.cumsum(long, axis=0)]) * 1e-4), rel=1e-6
    )
    pulse[0] += pulse[-1] if n > 2 else 0.0
    both = cfc60_peak(time, np.vstack([np.zeros(2), np.cumsum(pulse, axis=0)]) * 1e-4)
    assert both == pytest.approx(alone, rel=1e-6), "the first and the last interval are neighbours to the filter"
