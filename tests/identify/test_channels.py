"""Channels of a test: that they are those of a collision, what they count, what they tell, and what is refused."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders import each_alone, few

import trainmj
from trainmj.cases.engine import Local
from trainmj.collision.cases import gathered
from trainmj.collision.channels import Trace, channels_of
from trainmj.collision.lineup import line_up
from trainmj.errors import InputError
from trainmj.identification import Found, identify, targets_of
from trainmj.identification.figures import channels as figure_of_channels
from trainmj.identification.page import page_of
from trainmj.identification.screen import print_found
from trainmj.scenario import Scenario, save

WAGONS: dict[str, Any] = {
    "parameters": {"speed_km_h": "collision.speed_km_h"},
    "devices": {
        "buffer": {
            "curve": {"stroke_mm": [0, 100], "force_kN": [0, 2500]},
            "stiffness_kN_per_mm": 400,
            "beyond": "hold",
        }
    },
    "trains": {
        "wagon": {
            "vehicles": 2,
            "mass_t": 40,
            "front": "buffer",
            "coupler": "buffer",
            "body": {"stiffness_kN_per_mm": 150, "damping_ratio": 0.1},
        }
    },
    "collision": {"train": "wagon", "speed_km_h": 10, "partner": "rigid_wall"},
    "simulation": {"step_ms": 0.2},
}
KNOWN = {"stiffness": 150.0, "damping": 0.1, "shift": 4.0}
SPEEDS = {"speed_1": "velocity_M1_km_h", "speed_2": "velocity_M2_km_h"}
ACCELERATIONS = {"a_1": "acceleration_cfc60_M1_g", "a_2": "acceleration_cfc60_M2_g"}
BODY = "trains.wagon.body"
NO_SEARCH = {"explore": {"trials": 0}, "refine": {"iterations": 0}}


def wagons(**body: float) -> Scenario:
    """Two wagons into a wall, their bodies as known or otherwise."""
    values = copy.deepcopy(WAGONS)
    values["trains"]["wagon"]["body"] |= body
    return Scenario.from_values(values)


def recorded(noise: float = 0.0, every: int = 1, shift_ms: float = 0.0, **body: float) -> pd.DataFrame:
    """Channels of a test of 0.12 s whose clock begins later, with noise over about 5 ms, as a filter leaves it."""
    scenario = wagons(**body)
    (case,) = Local(scenario, 1, [*SPEEDS.values(), *ACCELERATIONS.values()])(gathered([("", {})]))
    time = np.arange(121) * 1e-3
    rng = np.random.default_rng(5)
    table = {"t": time}
    for name in (*SPEEDS.values(), *ACCELERATIONS.values()):
        scatter = np.convolve(rng.standard_normal(time.size), np.ones(5) / np.sqrt(5), "same")
        table[name] = Trace.unpacked(case.row(0)[name]).at(time + 1e-3 * shift_ms) + noise * scatter
    return pd.DataFrame(table)[::every]


def given(**changes: Any) -> dict[str, Any]:
    """The plain values of a targets file; ``a__b=1`` changes a value inside, None leaves it out."""
    values: dict[str, Any] = {
        "scenario": "train.yaml",
        "parameters": {
            "stiffness": {"sets": f"{BODY}.stiffness_kN_per_mm", "bounds": [50, 1000], "scale": "log"},
            "damping": {"sets": f"{BODY}.damping_ratio", "bounds": [0.005, 0.5], "scale": "log"},
        },
        "targets": {
            name: {"channel": channel, "tolerance": 0.05, "independent_ms": 5}
            for name, channel in (SPEEDS | ACCELERATIONS).items()
        },
        "data": {"test": {"channels": "test.csv", "time": "t", "values": dict(SPEEDS | ACCELERATIONS)}},
        "method": copy.deepcopy(NO_SEARCH),
    }
    for path, value in changes.items():
        *way, last = path.split("__")
        here = values
        for key in way:
            here = here.setdefault(key, {})
        here.pop(last, None)
        if value is not None:
            here[last] = value
    return values


def found_by(folder: Path, table: pd.DataFrame, threads: int = 1, out: str = "out", **changes: Any) -> Found:
    save(wagons(), folder / "train.yaml")
    table.to_csv(folder / "test.csv", index=False)
    return identify(targets_of(given(**changes), folder), folder / out, threads=threads, figures=())


STARTS = {
    "parameters__stiffness__start": 300.0,
    "parameters__damping__start": 0.03,
    "parameters__shift": {"offset": "test", "bounds": [-10, 10]},
    "method__refine__iterations": 15,
}
"""Away from what is to be found."""


def test_channels_of_a_batch_are_those_of_a_single_run_on_any_threads():
    """Breaks if a test is compared with another vehicle, another unit or another filter than is said."""
    scenario, names = wagons(), list(channels_of(line_up(wagons())))
    assert names == [f"{name}_{v}_{unit}" for name, unit in (("velocity", "km_h"), ("acceleration_cfc60", "g"))
                     for v in ("M1", "M2")]  # fmt: skip
    result = trainmj.run(scenario)
    alone = trainmj.channels(result)
    of = [v.name for v in result.chain.vehicles]
    for threads in (1, 2):
        engine = Local(scenario, threads, names)
        cases = [rows.row(0) for rows in each_alone(engine(gathered((k, {}) for k in range(3))))]
        assert len(cases) == 3
        assert len({case[name] for case in cases for name in names}) == len(names)
        for name in names:
            trace = Trace.unpacked(cases[0][name])
            np.testing.assert_allclose(trace.at(result.time), alone[name], rtol=0, atol=1e-9)
        for v in ("M1", "M2"):
            speed = Trace.unpacked(cases[0][f"velocity_{v}_km_h"])
            np.testing.assert_allclose(speed[4] / 3.6, result.velocity[:, of.index(v)], rtol=1e-14)
            filtered = Trace.unpacked(cases[0][f"acceleration_cfc60_{v}_g"])
            assert np.abs(filtered[4]).max() == cases[0][f"cfc60_peak_{v}_g"]


def test_a_filtered_channel_keeps_what_is_below_its_corner_and_its_time():
    """Breaks if the channel lags behind the test, or loses height between two records."""
    result = trainmj.run(wagons())
    a = result.acceleration[:, [v.name for v in result.chain.vehicles].index("M2")] / 9.80665
    filtered = trainmj.channels(result)["acceleration_cfc60_M2_g"]
    inside = slice(20, -20)
    assert np.abs(filtered - a)[inside].max() < 0.02 * np.abs(a).max()


def test_a_trace_is_held_outside_and_unknown_where_a_run_was_cut_off():
    trace = Trace(0.0, 0.5, 7.0, np.nan, np.array([7.0, 5.0, 1.0, 2.0]))
    np.testing.assert_allclose(trace.at(np.array([-1.0, 0.0, 0.5, 1.0, 1.5])), [7, 7, 5, 1, 2])
    assert np.isnan(trace.at(np.array([1.6]))).all()
    again = Trace.unpacked(trace.packed())
    assert again.packed() == trace.packed()
    cut = wagons().with_values({"simulation.time_limit_s": 0.1})
    table = trainmj.channels(trainmj.run(cut))
    known = table.set_index("time_s")["acceleration_cfc60_M1_g"].dropna()
    assert 0.085 < known.index[-1] <= 0.0905  # the silence behind the cut is not real
    assert table["velocity_M1_km_h"].notna().all()


def test_known_stiffness_damping_and_offset_come_back_within_their_intervals(tmp_path):
    """Breaks if the bodies of a scenario cannot be told from what a test records, or their errors are too small."""
    found = found_by(tmp_path, recorded(noise=0.05, shift_ms=4.0), **STARTS)
    table = found.parameters.set_index("parameter")
    for name, known in KNOWN.items():
        assert table.low_95[name] < known < table.high_95[name], name
        assert table.determined[name], name
    assert table.high_95["stiffness"] / table.low_95["stiffness"] < 1.1
    assert table.high_95["damping"] / table.low_95["damping"] < 2
    assert table.high_95["shift"] - table.low_95["shift"] < 0.3
    assert 0.5 < found.known.chi2 < 2
    assert found.known.freedom == pytest.approx(4 * 120 / 5 - 3)
    assert found.scenario.locate(f"{BODY}.damping_ratio") == [table.value["damping"]]


def test_channels_without_noise_give_the_known_values(tmp_path):
    found = found_by(tmp_path, recorded(shift_ms=4.0), **STARTS)
    values = dict(zip(found.plan.unknowns.names, found.point.value, strict=True))
    assert values == pytest.approx(KNOWN, rel=2e-3)


def test_damping_is_left_open_by_channels_that_carry_nothing_of_it(tmp_path):
    """Breaks if a damping of 2 %, which moves no speed by a tenth of what the test can tell, is said to be found."""
    kept = {f"targets__{name}": None for name in ACCELERATIONS} | {
        f"targets__{name}": {"channel": channel, "tolerance": 0.3, "independent_ms": 20}
        for name, channel in SPEEDS.items()
    }
    noisy = recorded(noise=0.1, damping_ratio=0.02)
    start = {"parameters__damping__start": 0.02, "parameters__damping__bounds": [0.002, 0.1]}
    found = found_by(tmp_path, noisy, data__test__values=SPEEDS, **kept, **start)
    table = found.parameters.set_index("parameter")
    assert table.remark["damping"] == "not determined"
    assert not table.determined["damping"]
    assert table.determined["stiffness"]
    assert table.low_95["stiffness"] < KNOWN["stiffness"] < table.high_95["stiffness"]


@pytest.mark.parametrize("independent", few([None, 10], 1))
def test_errors_do_not_shrink_with_the_sampling_rate(tmp_path, independent):
    """Breaks if a channel is believed more because it was sampled more often: its samples are not independent."""
    counts = {f"targets__{name}__independent_ms": independent for name in (SPEEDS | ACCELERATIONS)}
    errors = [found_by(tmp_path, recorded(every=n), out=f"{n}", **counts).known.error for n in (1, 4)]
    np.testing.assert_allclose(errors[0], errors[1], rtol=0.2)  # a fourth of the samples


def test_a_channel_counts_as_its_target_states(tmp_path):
    """Breaks if the squares of the residuals of a channel add up to another sum than its rms and its count make."""
    off = recorded()
    off["velocity_M1_km_h"] += 0.15  # three tolerances
    one = {f"targets__{name}__independent_ms": None for name in (SPEEDS | ACCELERATIONS)}
    found = found_by(tmp_path, off, out="one", **one)
    assert found.known.freedom == 4 - 2
    assert found.known.chi2 * 2 == pytest.approx(9)
    found = found_by(tmp_path, off, out="more", **(one | {"targets__speed_1__independent_ms": 30}))
    assert found.known.freedom == 3 + 4 - 2
    assert found.known.chi2 * 5 == pytest.approx(9 * 4)
    fit = found.fit.set_index("target")
    assert fit.rms["speed_1"] == pytest.approx(0.15)
    assert [round(c.count, 9) for c in found.channels("fitted")] == [4, 1, 1, 1]


def test_the_same_bytes_on_any_threads_and_nothing_is_simulated_again_for_other_times_or_offsets(tmp_path):
    """Breaks if trials serve one search only, or what they kept of a channel is not what they had computed."""
    table = recorded(noise=0.05, shift_ms=4.0)
    short = STARTS | {"method__refine__iterations": 2}
    one, two = found_by(tmp_path, table, 1, "one", **short), found_by(tmp_path, table, 2, "two", **short)
    kept = [{f.name: f.read_bytes() for f in found.folder.iterdir() if f.suffix != ".sqlite"} for found in (one, two)]
    assert kept[0] == kept[1]
    again = found_by(tmp_path, table, 1, "one", **short)
    assert (again.simulated, again.parameters.equals(one.parameters)) == (0, True)
    start = {**short, "method__refine__iterations": 0, "data__test__offset_ms": 2, "data__test__between_s": [0.01, 0.1]}
    first = found_by(tmp_path, table, 1, "two", **start)
    assert first.plan.unknowns.start().value[2] == 2
    moved = found_by(tmp_path, table, 1, "two", **(start | {"data__test__offset_ms": 3}))
    assert moved.simulated == 0
    assert moved.known.chi2 < first.known.chi2


def test_tests_of_their_own_speeds_and_clocks_are_each_compared_with_their_case(tmp_path):
    """Breaks if a channel is taken from the case of another test, or shifted by another clock, also while exploring."""
    (fast,) = Local(wagons(), 1, SPEEDS.values())(gathered([("", {"speed_km_h": 12})]))
    time = np.arange(100) * 1e-3
    of_fast = {name: Trace.unpacked(fast.row(0)[name]).at(time + 3e-3) for name in SPEEDS.values()}
    pd.DataFrame({"t": time} | of_fast).to_csv(tmp_path / "fast.csv", index=False)
    fast_data = {"channels": "fast.csv", "time": "t", "offset_ms": 3, "set": {"speed_km_h": 12}, "values": SPEEDS}
    found = found_by(
        tmp_path,
        recorded(shift_ms=-2.0),
        data__fast=fast_data,
        parameters__clock={"offset": "test", "bounds": [-5, 5], "start": -2},
        method__explore={"trials": 12, "cases": 1},
        data__test__between_s=[0.002, 0.12],
    )
    assert len(found.plan.fitted.cases) == 2
    assert [(c.data, c.target.name, c.rms < 1e-3) for c in found.channels("fitted")] == [
        *(("test", name, True) for name in (SPEEDS | ACCELERATIONS)),
        *(("fast", name, True) for name in SPEEDS),
    ]


def test_what_is_left_shows_test_beside_simulation(tmp_path, capsys):
    """Breaks if a reader sees numbers of a channel, but not where along it the simulation departs from the test."""
    table = recorded(noise=0.05)
    table.assign(t=1e3 * table.t).to_csv(tmp_path / "held.csv", index=False)
    held = {"channels": "held.csv", "time": "0.001 * t", "values": {"speed_1": "velocity_M1_km_h"}}
    found = found_by(tmp_path, table, held_out__other=held)
    rows = found.residuals
    assert len(rows) == 5 * 121
    assert rows.time_s.max() == pytest.approx(0.12)
    assert rows.deviation_percent.isna().all()
    picture = figure_of_channels(found)
    assert [axes.get_title(loc="left") for axes in picture.axes] == [
        *(f"test: {name}" for name in (SPEEDS | ACCELERATIONS)),
        "other: speed_1, held out",
    ]
    (measured, simulated), (channel, *_) = picture.axes[0].lines, found.channels("fitted")
    np.testing.assert_array_equal(measured.get_ydata(), table["velocity_M1_km_h"])
    np.testing.assert_array_equal(simulated.get_ydata(), channel.found)
    text = page_of(found).html()
    assert "tolerance 0.05; counts as 24 values." in text
    print_found(found)
    assert "2 values sought from 4 channels in 1 case" in capsys.readouterr().out


BAD = {
    "back": "t,v\n0,10\n0.01,9\n0.01,8\n0.02,7\n0.03,6\n",
    "nan": "t,v\n0,10\n0.01,\n0.02,8\n0.03,7\n",
    "word": "t,v\n0,10\n0.01,many\n0.02,8\n0.03,7\n",
    "short": "t,v\n0,10\n0.01,9\n0.02,8\n",
    "late": "t,v\n0,10\n0.01,9\n0.02,8\n5,7\n",
    "ended": "t,v\n0,10\n0.01,9\n0.02,8\n0.9,7\n",
    "early": "t,v\n-0.01,10\n0.01,9\n0.02,8\n0.03,7\n",
    "fine": "t,v\n0,10\n0.0001,9\n0.0002,8\n0.0003,7\n",
    "many": "t,v\n" + "".join(f"{k}e-5,1\n" for k in range(10_001)),
    "good": "t,v\n0,10\n0.01,9\n0.02,8\n0.03,7\n",
}
GOOD = {"channels": "good.csv", "time": "t", "values": {"speed_1": "v"}}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"channels": "god.csv"}, r"data.test: channels 'god.csv': there is no such file beside it; did you mean"),
        ({"channels": "back.csv"}, r"back.csv': line 4: row 3: t = 0.01: times must increase: 0.01 s comes before it"),
        ({"channels": "nan.csv"}, r"nan.csv': line 3: row 2: v = '': must be a number"),
        ({"channels": "word.csv"}, r"word.csv': line 3: row 2: v = 'many': must be a number"),
        ({"channels": "short.csv"}, r"needs 4 times or more: of its 3 times, from 0 to 0.02 s, 3 are used"),
        ({"between_s": [0.5, 0.9]}, r"of its 4 times, from 0 to 0.03 s, 0 are used"),
        ({"channels": "late.csv"}, r"its times end at 5 s, and simulation.time_limit_s is 3: times are in s \(time:"),
        ({"channels": "ended.csv"}, r"times end at 0.9 s, and the collision at 0.22\d s with the start values: use"),
        ({"channels": "early.csv"}, r"its times begin 0.01 s before the simulation: .*or shift them \(offset_ms\)"),
        ({"offset_ms": -3}, r"data.test.channels = 'good.csv': its times begin 0.003 s before the simulation"),
        ({"channels": "fine.csv"}, r"samples are 0.1 ms apart, finer than simulation.record_every_ms = 1: take at mo"),
        ({"channels": "many.csv"}, r"channels 'many.csv': has 10001 values, more than 10000: leave samples out, or"),
        ({"time": "time_s"}, r"data.test: time = 'time_s': there is no column 'time_s'; known: t, v"),
        ({"values": {"speed_1": "w"}}, r"data.test: values.speed_1 = 'w': there is no column 'w'"),
        ({"values": {"stroke": "v"}}, r"data.test.values.stroke.*: is the target of a response: channels need"),
        (
            {"set": {"simulation.time_limit_s": 0.035, "simulation.step_ms": 0.05}, "values": {"a_1": "v"}},
            r"cut off.*raise simulation.time_limit",
        ),
        ({"set": {"simulation.record_every_ms": 2}, "values": {"a_1": "v"}}, r"acceleration_cfc60 is not a number wit"),
        ({"cases": {"x": "speed_km_h"}}, r"data.test.cases"),
        ({"between_s": [0.03, 0]}, r"between_s: must be a lower and a higher value"),
    ],
)
def test_bad_channels_are_refused_with_place_and_cure(tmp_path, changes, message):
    """Breaks if samples are compared with something else than what the user recorded."""
    for name, text in BAD.items():
        (tmp_path / f"{name}.csv").write_text(text)
    targets = {f"targets__{name}": None for name in ("speed_2", "a_2")}
    stroke = {"response": "stroke_M1_wall_mm", "tolerance": 1}
    more = {"targets__stroke": stroke, "data__rows": {"rows": [{"s": 1}], "values": {"stroke": "s"}}}
    more |= {"targets__a_1__weight": 1, "parameters__damping": None}
    used = {"data__more": GOOD | {"values": {"a_1": "v"}}, "data__again": GOOD}
    with pytest.raises(InputError, match=message):
        found_by(tmp_path, recorded(), **targets, **more, **used, data__test=GOOD | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"targets__a_1__channel": "acceleration_M1_g"}, r"targets.a_1.channel.*no channel 'acceleration_M1_g' .*did"),
        ({"targets__a_1__channel": "velocity_M3_km_h"}, r"there is no channel 'velocity_M3_km_h' in the case {}"),
        ({"targets__a_1__channel": "velocity_M1_km_h - acceleration_cfc60_M1_g"}, r"adds acceleration.* in g to a ch"),
        ({"targets__a_1__tolerance": "5 %"}, r"targets.a_1.tolerance = '5 %': must be a number"),
        ({"targets__a_1__bars": {"rms": "5 %"}}, r"targets.a_1.bars.rms = '5 %': must be in the unit of the channel"),
        ({"targets__a_1": {"tolerance": 1}}, r"targets.a_1: needs response or channel"),
        (
            {"parameters__shift": {"offset": "tset", "bounds": [0, 1]}},
            r"must name channels in data: 'tset' has none; d",
        ),
        ({"parameters__shift": {"offset": "test", "bounds": [1, 2]}}, r"shift.bounds: must include the start, 0 ms"),
        (
            {f"parameters__{name}": {"offset": "test", "bounds": [0, 1]} for name in ("one", "two")},
            r"two.offset = 'test': test is shifted by one already",
        ),
        (
            {f"targets__{name}__independent_ms": None for name in (SPEEDS | ACCELERATIONS)}
            | {"data__test__values": {"speed_1": "velocity_M1_km_h"}}
            | {f"targets__{name}": None for name in ("speed_2", *ACCELERATIONS)},
            r"are 2, and there are only 1 values: .*; a channel counts as one value, or as its length over independ",
        ),
    ],
)
def test_bad_targets_of_channels_are_refused_with_place_and_cure(tmp_path, changes, message):
    with pytest.raises(InputError, match=message):
        found_by(tmp_path, recorded(), **changes)
