"""The batch engine gives the numbers of single runs, whatever runs beside them."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

import trainmj
from trainmj.cases.engine import Local
from trainmj.cases.table import chosen
from trainmj.collision.batch import run_chains
from trainmj.collision.cases import gathered
from trainmj.collision.lineup import line_up
from trainmj.collision.lot import Chains
from trainmj.collision.measured import Measured
from trainmj.collision.quantities import columns_of, ordered
from trainmj.collision.waiting import Waiting

FAST = {"simulation.step_ms": 0.5}


@pytest.fixture(scope="module")
def scenarios():
    """Cases of several sizes, mixed: masses, strokes, stiffness, friction, gap, wall, wagon, formation."""
    rng = np.random.default_rng(7)
    base = [trainmj.load(name, FAST) for name in ("b_type", "b_type_wall", "wagon_80t")]
    made = []
    for k in range(24):
        changes = {
            "collision.rail_friction": float(rng.choice([0.0, 0.008])),
            "collision.gap_mm": float(rng.choice([0, 40])),
            **({"simulation.averaging_ms": 3.5} if k % 4 == 1 else {}),
            **({"simulation.time_limit_s": 0.25} if k % 6 == 2 else {}),
        }
        scenario = base[k % 3]
        if k % 3 < 2:
            changes |= {
                "mass_t": float(rng.uniform(30, 36)),
                "empty_stroke_mm": float(rng.uniform(20, 50)),
                "devices.coupler_c_d.stiffness_kN_per_mm": float(rng.uniform(500, 2500)),
                "occupants.free_flight_mm": [300, 600][: 1 + k % 2],
            }
        made.append(scenario.with_values(changes))
    made.append(base[0].with_values({"trains.b_type.vehicles": 3}))
    return made


@pytest.fixture(scope="module")
def single(scenarios):
    return [trainmj.summarise(trainmj.run(s)) for s in scenarios]


@pytest.mark.parametrize(("threads", "places", "backwards"), [(1, 3, False), (2, 128, True), (2, 5, False)])
def test_a_batch_case_equals_the_single_run_to_the_last_bit(scenarios, single, threads, places, backwards):
    numbered = [(k, line_up(s)) for k, s in enumerate(scenarios)]
    found = dict(run_chains(numbered[::-1] if backwards else numbered, threads, places))
    assert sorted(found) == list(range(len(scenarios))), "a case is missing or double"
    different = [k for k, summary in enumerate(single) if found[k] != summary]
    assert not different, "a batch case depends on threads, places, order or neighbours"


@pytest.mark.thorough
def test_more_sizes_than_are_looked_ahead_for_still_all_run(scenarios, monkeypatch):
    monkeypatch.setattr("trainmj.collision.waiting._LOOK_AHEAD", 2)
    monkeypatch.setattr("trainmj.collision.batch._ENGINES", 1)
    numbered = [(k, line_up(s)) for k, s in enumerate(scenarios)]
    assert sorted(key for key, _ in run_chains(numbered)) == list(range(len(scenarios)))


@pytest.mark.parametrize(("n_lots", "threads"), [(1, 1), (1, 2), (3, 2), (5, 4)])
def test_the_last_cases_are_shared_by_all_threads(n_lots, threads):
    """Breaks if a sweep of one lot keeps one thread busy and the others waiting, or a case is lost or double."""
    chain = line_up(trainmj.load("b_type", FAST))
    lots = [Chains(range(100 * n, 100 * n + 100), [chain] * 100) for n in range(n_lots)]
    waiting = Waiting(lots, threads)
    size, _ = waiting.fullest()
    shares, taken = [waiting.share], [list(lot.keys) for lot in waiting.take(size)]
    assert [key for keys in taken for key in keys] == list(range(100 * n_lots))
    assert waiting.fullest() is None
    assert len(taken[0]) == (50 if (n_lots, threads) == (1, 2) else 100)  # whole ones while more may come
    assert len(taken[-1]) <= max(-(-100 // threads), 32)
    shares.append(waiting.share)
    assert shares == [-(-100 // threads) if n_lots == 1 and threads > 1 else 2**31, -(-100 * n_lots // threads)]


def test_cases_are_taken_as_they_are_needed():
    scenario = trainmj.load("b_type", FAST)
    taken = []

    def cases():
        for k in range(500):
            taken.append(k)
            yield k, line_up(scenario)

    rows = run_chains(cases(), places=8)
    next(rows)
    assert len(taken) < 50, "the whole sweep is read ahead: memory would grow with its length"


def test_a_table_in_gives_a_table_out():
    cases = pd.DataFrame({"mass_t": [30, 33.5, 36], "empty_stroke_mm": [20, 35, 50]}, index=["a", "b", "c"])
    table = trainmj.run_cases(trainmj.load("b_type", FAST), cases, responses=["TS_mm", "stroke_S1_*"])
    assert list(table.index) == ["a", "b", "c"]
    assert list(table.columns[:5]) == ["mass_t", "empty_stroke_mm", "status", "reason", "TS_mm"]
    alone = trainmj.summarise(trainmj.run(trainmj.load("b_type", FAST | {"mass_t": 33.5, "empty_stroke_mm": 35})))
    assert table.loc["b", "TS_mm"] == alone.TS_mm
    assert table.loc["b", "stroke_S1_M1_anti_climber_mm"] == alone.interfaces[0].stages[1].stroke_mm


def test_a_refused_or_unstable_case_is_a_row_and_the_others_go_on():
    # between the largest stable step by the rule and far beyond it, a light car on a stiff coupler
    cases = pd.DataFrame({"mass_t": [33, -3, 33], "simulation.step_ms": [0.5, 0.5, 2.0]})
    table = trainmj.run_cases(trainmj.load("b_type"), cases)
    assert list(table.status) == ["over", "refused", "refused"]
    assert "mass_t" in table.reason[1]
    assert "step_ms" in table.reason[2]
    assert np.isnan(table.TS_mm[1])


def test_an_unstable_case_says_so_and_does_not_disturb_its_neighbours(monkeypatch):
    monkeypatch.setattr(Measured, "jumped", np.array([False]))  # without the smaller steps that would mend it
    scenario = trainmj.load("b_type", FAST)
    good = line_up(scenario)
    bad = dataclasses.replace(good, step=2e-3, steps_per_record=1)
    found = dict(run_chains([("good", good), ("bad", bad), ("again", good)]))
    assert str(found["bad"].status).startswith("unstable")
    assert found["good"] == found["again"] == trainmj.summarise(trainmj.run(scenario))


def test_an_unknown_column_is_refused_before_anything_runs():
    with pytest.raises(trainmj.InputError, match=r"mas_t.*did you mean 'mass_t'"):
        trainmj.run_cases(trainmj.load("b_type"), pd.DataFrame({"mas_t": [33]}))


def test_an_unknown_response_is_refused():
    with pytest.raises(trainmj.InputError, match=r"TSmm.*did you mean 'TS_mm'"):
        chosen(["TSmm"], columns_of(line_up(trainmj.load("b_type", FAST))))


def test_columns_stand_in_one_order_whatever_order_the_cases_ended_in():
    (case,) = Local(trainmj.load("b_type", FAST))(gathered([("a key", {"mass_t": 33})]))
    assert list(case.row(0)) == ["status", "reason", *case.columns]
    names = [column.name for column in ordered(case.columns.values())]
    assert names == [column.name for column in ordered(reversed(case.columns.values()))]
    assert names[:2] == ["TS_mm", "TAMA_g"]
    places = [names.index(n) for n in ("stroke_S1_M1_mm", "stroke_M1_M2_mm", "stroke_S1_S2_mm", "peak_device_M1_g")]
    assert places == sorted(places), "front first, then along each train, then the vehicles"


def test_trains_of_different_size_share_one_order_of_columns():
    long, short = (line_up(trainmj.load("b_type", FAST | {"trains.b_type.vehicles": n})) for n in (4, 2))
    union = ordered([*columns_of(short).values(), *columns_of(long).values()])
    assert union == ordered(columns_of(long).values())
    cases = pd.DataFrame({"trains.b_type.vehicles": [2, 4], "collision.partner": ["rigid_wall", "b_type"]})
    table = trainmj.run_cases(trainmj.load("b_type", FAST), cases)
    walled = columns_of(line_up(trainmj.load("b_type", FAST | cases.iloc[0].to_dict())))
    both = ordered([*walled.values(), *columns_of(long).values()])
    assert list(table.columns) == [*cases.columns, "status", "reason", *(column.name for column in both)]
