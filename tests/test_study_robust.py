"""Robust studies: statistics of trains as built in place of responses, limits that few of them may pass."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from studies import run

import trainmj
from trainmj.cases.scatter import scatter_of
from trainmj.doe import normal_draws, proportion
from trainmj.study import tables
from trainmj.study.page import page_of_folder
from trainmj.study.remarks import of_plan
from trainmj.study.robust import Sampler, Statistic, held, robust_of
from trainmj.study.rules import NOMINAL
from trainmj.study.screen import print_study

TRAIN = """
title: two cars
simulation: { step_ms: 1, time_limit_s: 2 }
parameters: { mass_t: trains.t.mass_t, end_kN: devices.d.curve.force_kN.2 }
devices:
  d:
    curve: { stroke_mm: [0, 50, 1500], force_kN: [0, 800, 1200] }
    stiffness_kN_per_mm: 100
trains:
  t: { vehicles: 2, mass_t: 30, front: d, coupler: d }
collision: { train: t, speed_km_h: 15, partner: t }
"""
STUDY = {
    "scenario": "train.yaml",
    "tolerances": {
        "mass": {"of": "mass_t", "percent": 1, "copies": "independent"},
        "crush": {"of": "devices.d.curve", "scales": "force", "percent": 2.5, "copies": "same"},
    },
    "factors": {
        "M": {"sets": "mass_t", "bounds": [25, 35]},
        "F": {"sets": "end_kN", "bounds": [1000, 1400]},
    },
    "responses": {"TS": "TS_mm", "TAMA": "TAMA_g", "front": "stroke_S1_M1_mm"},
    "design": {"kind": "full_factorial", "levels": {"M": 3, "F": 3}},
    "cross_validation": {"against": []},
    "objectives": {"TS": "minimise", "TAMA": "minimise"},
    "constraints": {"front": {"at_most": 175}},
    "optimiser": {"on": "surrogate", "seed": 1, "surrogate": {"particles": 30, "iterations": 20}},
    "weights": {"method": "own", "own": {"TS": 0.2, "TAMA": 0.8}},
    "decision": {"method": "weighted_sum"},
    "robust": {"draws": 20, "seed": 3, "probability": 0.05, "check_draws": 100, "objectives": {"TAMA": {"sigmas": 2}}},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robust")
    (folder / "train.yaml").write_text(TRAIN, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def study(folder):
    return trainmj.study_of(STUDY, folder)


@pytest.fixture(scope="module")
def done(study, folder):
    return run(study, folder / "out", threads=1)


def trains_of(folder, design, draws, first=0):
    """The trains as built of a design, without the study."""
    values = {"tolerances": STUDY["tolerances"], "mass_t": design["M_t"], "end_kN": design["F_kN"]}
    scenario = trainmj.load(folder / "train.yaml", values)
    scatter = scatter_of(scenario)
    return trainmj.run_cases(scenario, scatter.cases(normal_draws(scatter.d, draws, seed=3, first=first)))


@pytest.mark.parametrize("n", [20, 64, 100])
@pytest.mark.parametrize("share", [0.01, 0.05, 0.2])
@pytest.mark.parametrize("worse", [1, -1])
def test_a_quantile_keeps_a_limit_exactly_where_few_enough_trains_pass_it(n, share, worse):
    """Breaks if a robust constraint says something else than the share that it stands for."""
    values = np.random.default_rng(n).normal(100, 10, n)
    for limit in np.sort(values) + 1e-9:
        quantile = Statistic("q", worse, quantile=1 - share).of(values)
        passed = (worse * (values - limit) > 0).mean()
        assert (worse * (quantile - limit) <= 0) == (passed <= share + 1e-12)


def test_trains_without_numbers_count_as_the_worst():
    values = np.array([1.0, 2.0, 3.0, math.nan])
    assert Statistic("q", 1, quantile=0.75).of(values) == 3.0
    assert math.isnan(Statistic("q", 1, quantile=0.9).of(values))
    assert Statistic("q", -1, quantile=0.75).of(values) == 1.0
    assert math.isnan(Statistic("mean", 1).of(values))
    many = np.append(np.arange(200.0), math.nan)
    assert Statistic("mean", 1).of(many) == 99.5
    assert Statistic("mean_2s", -1, sigmas=2).of(many) == pytest.approx(99.5 - 2 * np.arange(200.0).std(ddof=1))


@pytest.mark.thorough
def test_statistics_are_those_of_the_trains_as_built(done, folder):
    """Breaks if a design is given other draws, or tolerances around other values than its own."""
    table = done.tables["robust_02_simulations"]
    for row in table.iloc[[0, 5]].to_dict("records"):
        trains = trains_of(folder, row, 20)
        assert row["TS_mean_mm"] == pytest.approx(trains["TS_mm"].mean(), rel=1e-12)
        assert row["TAMA_mean_2s_g"] == pytest.approx(trains["TAMA_g"].mean() + 2 * trains["TAMA_g"].std(), rel=1e-12)
        assert row["front_q95_mm"] == np.sort(trains["stroke_S1_M1_mm"])[math.ceil(0.95 * 20) - 1]


@pytest.mark.thorough
def test_the_nominal_optimum_sits_on_the_limit_and_the_robust_one_is_confirmed(done, folder):
    """Breaks if the share of trains that pass a limit is not counted over the trains of that design."""
    held = {(row["design"], row["limit"]): row for row in done.summary["robust"]["held"]["limits"]}
    designs = done.summary["robust"]["held"]["designs"]
    for name in ("nominal", "robust"):
        row = held[name, "front <= 175 mm"]
        passed = int((trains_of(folder, designs[name], 100, first=100)["stroke_S1_M1_mm"] > 175).sum())
        assert row["passed"] == passed
        found = proportion(passed, 100)
        assert (row["probability"], row["lower"], row["upper"]) == (found.value, found.lower, found.upper)
    assert 0.3 < held["nominal", "front <= 175 mm"]["probability"] < 0.7
    assert held["robust", "front <= 175 mm"]["probability"] <= 0.05  # by draws that the search has not seen
    table, found = done.tables["robust_04_margins"], done.summary["robust"]["margins"]
    assert found["kept"]
    assert table["passed"].tolist() == [True] * (found["attempts"] - 1) + [False]
    assert found["attempts"] > 1  # 20 draws say too little of 5 %
    assert table["margin"].is_monotonic_increasing
    assert found["margins"]["front_q95 <= 175 mm"] == table["margin"].iloc[-1]
    cost = {(row["design"], row["response"]): row["mean"] for row in done.summary["robust"]["held"]["objectives"]}
    assert cost["robust", "TAMA"] != cost["nominal", "TAMA"]


@pytest.mark.thorough
def test_the_second_run_computes_nothing(done, study, folder):
    again = run(study, folder / "out")
    assert not again.simulated
    assert not again.computed


@pytest.mark.thorough
def test_threads_do_not_matter(done, study, folder):
    other = run(study, folder / "other", threads=2)
    for name, table in done.tables.items():
        assert table.equals(other.tables[name]), name


@pytest.mark.thorough
def test_screen_and_page_show_both_designs_side_by_side(done, capsys):
    print_study(done)
    screen, page = " ".join(capsys.readouterr().out.split()), page_of_folder(done.folder).html()
    for where in (screen, page):
        assert "Trains as built that pass a limit" in where
        assert "What it costs" in where
        assert "100 trains as built of each design" in where
    assert "front ≤ 175 mm" in screen


def test_names_of_statistics_say_what_they_are(study):
    names = [response.name for response in robust_of(study).study.responses]
    assert names == ["TS_mean", "TAMA_mean_2s", "front_q95"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"tolerances": {}}, "robust: tolerances: the scenario has none"),
        ({"tolerances": {"mass": {"of": "mas_t", "percent": 1}}}, "did you mean 'mass_t'?"),
        ({"constraints": {}}, "robust: has nothing to hold: state constraints"),
        ({"robust": {"objectives": {"front": "mean"}}}, "robust.objectives.front = 'mean': there is no objective"),
        ({"robust": {"probability": 0.7}}, "robust.probability = 0.7: must be less than 0.5"),
        ({"robust": {"also": {"old": {"M": 30}}}}, "robust.also.old: needs a value for F"),
        ({"robust": {"also": {"nominal": {"M": 30, "F": 1200}}}}, "is the name of a design that is chosen"),
        ({"robust": {"objectives": {"TS": {"quantil": 0.9}}}}, "robust.objectives.TS"),
        (
            {"tolerances": {"m": {"of": "mass_t", "mean": 30, "percent": 1, "copies": "same"}}},
            "factors.M: the tolerance m states values of its own for it, whatever is set here",
        ),
        ({"tolerances": {"m": {"of": "mass_t", "range": [29, 31], "copies": "same"}}}, "factors.M: the tolerance m"),
        (
            {
                "tolerances": {"v": {"of": "collision.speed_km_h", "kind": "uniform", "range": [14, 16]}},
                "cases": {"a": {}, "b": {"set": {"collision.speed_km_h": 8}}},
            },
            "cases.b.set.collision.speed_km_h = 8: the tolerance v states values of its own",
        ),
        ({"robust": {"draws": 64, "check_draws": 100}}, "must be at least twice the 64 draws of the search"),
        ({"robust": {"also": {"old": {"M": 30, "F": -1}}}}, "robust.also.old: the scenario does not take it"),
    ],
)
def test_what_does_not_fit_is_refused(folder, changes, said):
    with pytest.raises(trainmj.InputError) as error:
        trainmj.study_of(STUDY | changes, folder)
    assert said in str(error.value)


def test_limits_of_a_load_case_are_in_place_of_both_sides_of_those_of_all(folder):
    """Breaks if the robust search keeps a limit that a load case has taken back."""
    cases = {"slow": {}, "wall": {"constraints": {"front": {"at_least": 20}}}}
    study = trainmj.study_of(STUDY | {"cases": cases}, folder)
    assert [limit.text for limit in study.limits] == ["front_slow <= 175 mm", "front_wall >= 20 mm"]
    limits = robust_of(study).study.limits
    assert [limit.text for limit in limits] == ["front_q95_slow <= 175 mm", "front_q5_wall >= 20 mm"]


def test_names_that_load_cases_make_alike_are_refused(folder):
    """Breaks if a response of a case and the worst of another one share a name, under which they are judged."""
    responses = STUDY["responses"] | {"TS_a": "TAMA_g"}
    values = {
        "responses": responses,
        "objectives": {"TS": "minimise", "TS_a": "minimise"},
        "weights": {"method": "equal"},
    }
    with pytest.raises(trainmj.InputError, match="is TS_a in the tables, as TS is: choose another"):
        trainmj.study_of(STUDY | values | {"cases": {"a": {}, "b": {}}}, folder)


def test_a_share_that_so_few_draws_cannot_tell_is_said(folder):
    """Breaks if the worst of a few trains passes for a quantile far beyond them."""
    robust = STUDY["robust"] | {"probability": 0.001, "objectives": {"TAMA": {"quantile": 0.99}}}
    said = {remark.about: remark.text for remark in of_plan(trainmj.study_of(STUDY | {"robust": robust}, folder))}
    assert said["front"].startswith(f"0.1 % of {robust['draws']} trains is less than one")
    assert "Ask for 10000 draws" in said["front"]
    assert "Ask for 1000 draws" in said["TAMA"]


def test_a_design_that_breaks_a_rule_holds_nothing(study, monkeypatch):
    """Breaks if a chosen design without numbers ends the study, or counts as one that keeps its limits."""

    def refuse(*_):
        raise trainmj.InputError("no such train")

    robust = robust_of(study)
    monkeypatch.setattr(Sampler, "trains", refuse)
    chosen, front = (
        SimpleNamespace(points=np.array([[30.0, 1200.0]])),
        SimpleNamespace(study=robust.study, responses=np.ones((1, 3))),
    )
    one = SimpleNamespace(chosen=chosen, front=front)
    facts = held(Sampler(robust, None), one, one).facts
    assert [(row["probability"], row["kept"]) for row in facts["limits"] if row["wanted"]] == [(1.0, False)] * 2
    assert all(math.isnan(row["mean"]) for row in facts["objectives"])


@pytest.mark.thorough
def test_a_design_without_a_mean_is_shown_without_what_it_costs(done):
    """Breaks if a design of which no train has numbers, or a mean of 0, ends a finished study in a traceback."""
    summary = json.loads(json.dumps(done.summary))
    first, *_ = means = [row for row in summary["robust"]["held"]["objectives"] if row["design"] == NOMINAL]
    for row in means:
        row["mean"] = row["sd"] = None
    first["mean"] = 0.0
    _, costs = tables.held(summary)
    assert [row[-1] for row in costs.rows] == [None] * len(means)
