"""Secondary impact velocities: free flights whose end is known, and what a scenario, tables and pages make of them."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from builders import scenario
from click.testing import CliRunner

from trainmj.cli import main
from trainmj.collision.lineup import line_up
from trainmj.collision.occupants import Flight, longest_interval
from trainmj.collision.quantities import columns_of, matching, of_vehicles
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.errors import InputError
from trainmj.scenario import load
from trainmj.single import tables
from trainmj.single.figures import occupants
from trainmj.single.page import page_of_run
from trainmj.units import G

FLIGHTS = {"occupants.free_flight_mm": [300, 600, 760]}


def constant(t):
    """Change of speed under 5 g."""
    return 5 * G * t


def for_a_while(t):
    """... under 5 g for 100 ms."""
    return 5 * G * np.minimum(t, 0.1)


def triangle(t):
    """... under a triangle of 8 g in 250 ms."""
    rest = 0.25 - np.minimum(t, 0.25)
    return np.where(t < 0.125, 8 * G * t**2 / 0.25, G - 8 * G * rest**2 / 0.25)


def rebound(t):
    """... under 5 g for 100 ms, then thrown back by 2 g for 200 ms."""
    return for_a_while(t) - 2 * G * np.clip(t - 0.1, 0.0, 0.2)


def oscillating(t):
    """... of a vehicle that is pushed to and fro by 4 m/s, at 10 rad/s."""
    return 4 * np.sin(10 * t)


def flown(change, interval=1e-3, end=0.4, first=20.0, cut=False):
    """Flights in a vehicle whose speed changes so."""
    time = np.arange(round(end / interval) + 1) * interval
    return Flight(time, first - change(time)[:, None], cut)


def within_rebound(d):
    """Speed and time after 5 g for 100 ms, then -2 g."""
    v0, s0, a = 0.5 * G, 0.025 * G, 2 * G
    speed = math.sqrt(v0**2 - 2 * a * (d - s0))
    return speed, 0.1 + (v0 - speed) / a


EXACT = [
    (constant, 0.3, 5.4240160, 0.11061914),
    (constant, 0.6, 7.6707171, 0.15643909),
    (constant, 0.76, 8.6331072, 0.17606639),
    (triangle, 0.3, 6.163011, 0.142246),
    (triangle, 0.6, 8.396708, 0.182971),
    (triangle, 0.76, 9.061272, 0.201264),
    (for_a_while, 0.2, 4.428691, 0.09032015),
    (for_a_while, 0.3, 4.903325, 0.1 + (0.3 - 0.025 * G) / (0.5 * G)),
    (rebound, 0.4, *within_rebound(0.4)),
    (oscillating, 0.6, 4 * math.sin(math.acos(-0.5)), math.acos(-0.5) / 10),
]


@pytest.mark.parametrize(("change", "distance", "speed", "time"), EXACT)
@pytest.mark.parametrize("interval", [1e-4, 1e-3])
@pytest.mark.parametrize(("way", "first"), [(1, 20.0), (-1, 0.0)])
def test_flights_end_as_formulas_say(change, distance, speed, time, interval, way, first):
    """Breaks if a way is off by more than 1e-5, or a standing vehicle that is pushed away counts otherwise."""
    speeds, times = flown(lambda t: way * change(t), interval, first=first).impacts(distance)
    assert speeds[0] == pytest.approx(speed, rel=1e-5)
    assert times[0] == pytest.approx(time, rel=1e-5)


@pytest.mark.parametrize("offset", [0.0, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("distance", [0.05, 0.3, 0.76])
def test_records_may_be_as_far_apart_as_is_allowed(distance, offset):
    """Breaks if the interval that is allowed gives a speed that is off by more than 1e-4 by a jump of 10 g."""
    interval = longest_interval(distance)
    flight = flown(lambda t: 10 * G * np.maximum(0.0, t - (10 + offset) * interval), interval)
    assert flight.impacts(distance)[0][0] == pytest.approx(math.sqrt(20 * G * distance), rel=1e-4)


def test_the_last_relative_speed_goes_on_behind_the_end():
    """Breaks if an occupant stops with the run, or turns round with the vehicle only while the run lasts."""
    ahead, back = flown(for_a_while, end=0.12), flown(lambda t: 5 * G * t * (t < 0.05) - 1.0 * (t >= 0.05), end=0.1)
    speeds, times = ahead.impacts(2.0)
    assert speeds[0] == pytest.approx(0.5 * G, rel=1e-12)
    assert times[0] == pytest.approx(0.1 + (2.0 - 0.025 * G) / (0.5 * G), rel=1e-9)
    speeds, times = back.impacts(0.5)
    assert back.way[-1, 0] > -0.05, "far from there yet"
    assert speeds[0] == 1.0
    assert times[0] == pytest.approx(0.1 + 0.5 + back.way[-1, 0], rel=1e-12), "behind it, not ahead"


@pytest.mark.parametrize("last", [0.0, 1e-9])
def test_who_never_gets_there_meets_nothing(last):
    """Breaks if a vehicle that has its first speed again is one of which nothing is known, or of 1e9 s."""
    flight = flown(lambda t: np.where((t > 0) & (t < 0.1), 1.0, last))
    speeds, times = flight.impacts(0.3)
    assert speeds[0] == 0.0
    assert math.isnan(times[0])


def test_a_flight_that_is_cut_off_says_nothing_of_what_follows():
    """Breaks if the speed at the time limit stands for that of an impact while the vehicle still slows down."""
    flight = flown(constant, end=0.12, cut=True)
    speeds, times = flight.impacts(0.3)
    assert (speeds[0], times[0]) == pytest.approx((5.4240160, 0.11061914), rel=1e-5), "reached before"
    speeds, times = flight.impacts(0.6)
    assert math.isnan(speeds[0])
    assert math.isnan(times[0])


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_few_records_are_enough(n):
    time = np.arange(n) * 1e-3
    speeds, _ = Flight(time, 10 - 30 * time[:, None]).impacts(0.5)
    assert speeds[0] == pytest.approx(30 * time[-1])


def test_a_distance_that_is_reached_at_a_record_is_reached_there():
    """Breaks if the search for the moment fails at the end of its interval."""
    time = np.arange(5) * 0.25
    flight = Flight(time, -np.array([[0.0], [1.0], [1.0], [1.0], [1.0]]))
    for way, at in zip(flight.way[1:, 0], time[1:], strict=True):
        assert flight.impacts(way)[1][0] == pytest.approx(at, rel=1e-12)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_an_unstable_run_has_no_flights(value):
    time = np.arange(6) * 1e-3
    with np.errstate(invalid="ignore"):
        speeds, times = Flight(time, np.array([5.0, 4.0, value, value, value, value])[:, None]).impacts(0.3)
    assert np.isnan([*speeds, *times]).all()


# collisions


@pytest.fixture(scope="module")
def b_type():
    return run(load("b_type", {"empty_stroke_mm": 22, **FLIGHTS}))


def test_b_type(b_type):
    """Breaks if the occupants of the shipped train meet something else, or stating a flight moves another number."""
    summary = summarise(b_type)
    found = [v.SIV_760mm_m_per_s for v in summary.vehicles[:6]]
    assert found == pytest.approx([3.45, 3.00, 2.90, 3.02, 3.11, 3.15], abs=0.01)
    without = summarise(run(load("b_type", {"empty_stroke_mm": 22})))
    assert {n: v for n, v in summary.responses.items() if "SIV" not in n} == without.responses
    assert not [n for n in without.responses if "SIV" in n]


def test_flights_are_responses_by_stable_names():
    """Breaks if the order or the writing of distances changes a name, or equal ones are different quantities."""
    chain = line_up(load("b_type", {"occupants.free_flight_mm": [760.0, 600]}))
    assert chain.free_flights == (0.6, 0.76)
    names = [n for n in columns_of(chain) if "M2" in n and "SIV" in n]
    assert names == ["SIV_600mm_M2_m_per_s", "SIV_time_600mm_M2_s", "SIV_760mm_M2_m_per_s", "SIV_time_760mm_M2_s"]
    assert columns_of(chain)[names[0]].unit == "m/s"
    other = line_up(load("b_type_wall", {"occupants.free_flight_mm": [760]}))
    assert of_vehicles(other)[-1] is of_vehicles(chain)[-1]


@pytest.mark.parametrize(
    ("flights", "said"),
    [
        ([600, 600.0], "states 600 more than once"),
        ([0.76], r"free_flight_mm.0 = 0.76: must be a whole number"),
        ([49], "must be at least 50"),
        ([20_000], "must be at most 10000: free flights are in mm"),
        ([600, 760.5], r"free_flight_mm.1 = 760.5: must be a whole number"),
        (760, "must be a list"),
        (["760"], "must be a whole number"),
        ([True], "must be a whole number"),
        ([100, 200, 300, 400, 500, 600], "must have at most 5 entries"),
    ],
)
def test_flights_that_make_no_sense_are_refused(flights, said):
    with pytest.raises(InputError, match=said):
        load("b_type", {"occupants.free_flight_mm": flights})


def test_limits_of_vehicles_and_of_one_of_the_partner():
    limits = {"limits.SIV_600mm_m_per_s": 3.0, "limits.SIV_760mm_S2_m_per_s": 3.0}
    summary = summarise(run(load("b_type", {**FLIGHTS, **limits})))
    found = {c.name: c for c in summary.limits}
    assert (found["SIV_600mm_m_per_s"].where, found["SIV_600mm_m_per_s"].kept) == ("M1", False)
    assert found["SIV_760mm_S2_m_per_s"].kept
    assert "SIV 600mm of M1 (3.08 of 3 m/s)" in str(summary.status)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("SIV_500mm_m_per_s", "the scenario does not state 500 under occupants.free_flight_mm"),
        ("SIV_time_500mm_M1_s", "the scenario does not state 500 under occupants.free_flight_mm"),
        ("SIV_600mm_M9_m_per_s", "did you mean 'SIV_600mm_M"),
    ],
)
def test_a_flight_that_is_not_stated_is_said_to_be_so(name, said):
    """Breaks if a limit or a response of a distance that is not stated only gets a list of others."""
    case = load("b_type", FLIGHTS)
    with pytest.raises(InputError, match=said):
        line_up(case.with_values({f"limits.{name}": 5}))
    with pytest.raises(InputError, match=said):
        matching([name], columns_of(line_up(case)))


def test_records_too_far_apart_are_no_flight():
    """Breaks if a number stands where a flight has too few records, or a limit on it is not refused."""
    coarse = {"simulation.record_every_ms": 4, **FLIGHTS}
    summary = summarise(run(load("b_type", coarse)))
    assert math.isnan(summary.vehicles[0].SIV_600mm_m_per_s)
    assert summary.vehicles[0].SIV_760mm_m_per_s == pytest.approx(3.4532, rel=1e-4)
    with pytest.raises(InputError, match=r"SIV_600mm_m_per_s = 5: .*filter, window or flight: take at most 3\.6"):
        line_up(load("b_type", {**coarse, "limits.SIV_600mm_m_per_s": 5}))


def test_a_collision_that_is_cut_off_has_blanks_and_says_why():
    case = load("b_type", {**FLIGHTS, "simulation.time_limit_s": 0.4, "limits.SIV_600mm_m_per_s": 5})
    summary = summarise(run(case))
    first, last = summary.vehicles[0], summary.vehicles[5]
    assert first.SIV_760mm_m_per_s == pytest.approx(3.4532, rel=1e-4), "reached in time"
    assert math.isnan(last.SIV_300mm_m_per_s)
    limit = next(c for c in summary.limits if c.name == "SIV_600mm_m_per_s")
    assert not limit.kept
    assert re.search(r"SIV 600mm of M\d \(no number\)", summary.status.reason)
    assert "nan" not in str(list(tables.limits(summary.limits).rows))
    assert "Missing values need" in list(tables.vehicles(line_up(case), summary))[-1].note


def test_an_occupant_who_is_never_hit_has_a_table_without_a_warning():
    """Breaks if a flight that does not end is taken for one that is not known: a limit would not be kept."""
    standing = scenario([(0, 0), (50, 50_000)], 1000, [30, 30], "t", 2.0, step_ms=0.01, time_limit_s=0.1)
    case = standing.with_values({"occupants.free_flight_mm": [5000], "limits": {"SIV_5000mm_m_per_s": 3}})
    result = run(case)
    summary = summarise(result)
    assert result.tally.over
    table = list(tables.vehicles(result.chain, summary))[-1]
    assert "Missing" not in table.note
    assert summary.limits[0].kept


def test_numbers_behind_the_end_of_a_curve_are_marked_in_the_table_of_occupants():
    """Breaks if the occupants' numbers look valid where those of the vehicles are not."""
    soft = scenario([(0, 0), (10, 500), (50, 500)], 100, [30], speed_m_s=5.0, step_ms=0.1, time_limit_s=0.5)
    result = run(soft.with_values({"occupants.free_flight_mm": [100]}))
    summary = summarise(result)
    assert "not valid after" in list(tables.vehicles(result.chain, summary))[-1].title
    assert (
        "Not valid after" in page_of_run(result, summary, Path("result.nc")).html().partition("Speed of occupants")[2]
    )


@pytest.mark.thorough
def test_everything_written_has_the_flights(tmp_path):
    """Breaks if an output of a run leaves the occupants out, or has them where no flight is stated."""
    stated = ["--set", "occupants.free_flight_mm=[760, 600]"]
    for name, more in (("with", stated), ("without", [])):
        out = str(tmp_path / name)
        done = CliRunner().invoke(main, ["run", "b_type_wall", *more, "--out", out, "--report", "--figures", "svg"])
        assert done.exit_code == 0, done.output
        assert ("Occupants" in done.output) == (name == "with")
        assert max(map(len, done.output.splitlines()[:-1])) <= 80
        written = {p.name for p in (tmp_path / name).iterdir()}
        assert ("occupants.svg" in written) == (name == "with")
        page = (tmp_path / name / "report.html").read_text()
        assert ("Speed of occupants against their vehicle" in page) == (name == "with")
    plain = json.loads((tmp_path / "with" / "summary.json").read_text())["vehicles"][0]
    assert 2.0 < plain["SIV_600mm_m_per_s"] < plain["SIV_760mm_m_per_s"] < 4.0
    row = pd.read_csv(tmp_path / "with" / "vehicles.csv").iloc[0]
    assert row["SIV_time_760mm_s"] == pytest.approx(plain["SIV_time_760mm_s"])


def test_the_figure_has_the_impacts_on_its_lines(b_type):
    """Breaks if a dot is of another vehicle, or beside the line that it ends."""
    summary = summarise(b_type)
    speed, flight = occupants(b_type).axes
    dots = [
        tuple(map(float, (*line.get_xdata(), *line.get_ydata()))) for line in flight.lines if line.get_marker() == "."
    ]
    found = {(mm, getattr(v, f"SIV_{mm}mm_m_per_s")) for v in summary.vehicles for mm in (300, 600, 760)}
    assert sorted(dots) == pytest.approx(np.array(sorted(found)), rel=1e-6)
    at = [float(line.get_xdata()[0]) for line in speed.lines if line.get_marker() == "."]
    assert len(at) == 36
    assert max(at) == pytest.approx(max(v.SIV_time_760mm_s for v in summary.vehicles))
