"""Reliability: probabilities against what is known, what counts as passed, and that nothing stops a run for good."""

from __future__ import annotations

import json
import math
import signal
import sqlite3
import time
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from builders import each_alone, points, signed
from click.testing import CliRunner
from forked import Forked
from scipy.stats import norm

import trainmj
from trainmj.cases.rows import Rows
from trainmj.cli import main
from trainmj.collision.limits import Limited
from trainmj.errors import InputError
from trainmj.reliability.screen import remarks

SMALL = {
    "title": "Two cars on crush tubes",
    "parameters": {"mass_t": "trains.two.mass_t", "speed": "collision.speed_km_h"},
    "devices": {
        "tube": {
            "curve": points((0, 0), (1, 400), (1200, 550)),
            "stiffness_kN_per_mm": 200,
            "stroke_limit_mm": 780,
            "beyond": {"kind": "stop"},
        }
    },
    "trains": {
        "two": {"vehicles": 2, "mass_t": 30, "length_m": 18, "front": "tube", "coupler": "tube"},
    },
    "collision": {"train": "two", "partner": "rigid_wall", "speed_km_h": 12},
    "limits": {"TS_mm": 780},
    "simulation": {"step_ms": 0.5, "time_limit_s": 1.0},
}
TOLERANCES = {
    "mass": {"of": "mass_t", "percent": 3, "copies": "independent"},
    "tube": {"of": "devices.tube", "scales": "force", "percent": 4, "copies": "independent"},
}


def plan(**keys):
    """A plan over the small train, beside which its scenario lies."""
    return trainmj.reliability_of(FILE | keys, keys.pop("folder", "."))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the small train, in which the command runs."""
    (tmp_path / "small.yaml").write_text(json.dumps(SMALL), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


FILE = {"scenario": "small.yaml", "tolerances": TOLERANCES, "runs": 64, "seed": 3}


def command(*words):
    """The command within this process."""
    return CliRunner().invoke(main, ["reliability", *map(str, words)])


def run(out, threads=1, figures=(), engine=None, **keys):
    return trainmj.run_reliability(plan(**keys), out, threads=threads, figures=figures, engine=engine)


def files_of(out):
    """What a folder holds, but for the stores, whose pages depend on the order of the rows."""
    return {file.name: file.read_bytes() for file in Path(out).iterdir() if ".sqlite" not in file.name}


# what is found


class Linear:
    """Computes nothing: a limit is passed where y, the normal score of the only quantity, the gap, is above beta."""

    def __init__(self, beta=1.0, fails=lambda y: False, reason=""):
        self.beta, self.fails, self.reason = beta, fails, reason
        self.identity = {"code": "none"}

    def of(self, scenario, responses=("*",)):
        designed = trainmj.summarise(trainmj.run(scenario))
        self.designed, self.columns = designed.limits[0], {"TS_mm": designed.columns["TS_mm"]}
        return self

    def __call__(self, cases):
        for some in cases:
            y = {key: case.get("collision.gap_mm", 50.0) - 50.0 for key, case in zip(some.keys, some, strict=True)}
            lost = [key for key in y if self.fails(y[key])]
            if lost:
                yield unstable(lost)
            if there := [key for key in y if key not in lost]:
                c, n = self.designed, len(there)
                found = np.array([c.limit * (1.0 + (y[key] - self.beta) / 10.0) for key in there])
                same = (c.name, c.title, c.unit, c.digits, c.of_scenario, c.source)
                limited = Limited(*same, [c.where] * n, found, np.full(n, c.limit), np.full(n, True))
                facts = {"status": np.where(limited.kept, "over", "limit passed").tolist(), "reason": [self.reason] * n}
                yield Rows(there, facts, self.columns, found[:, None], (limited,))


def unstable(keys):
    """Rows of cases without numbers."""
    return Rows(keys, {"status": ["unstable"] * len(keys), "reason": ["made so"] * len(keys)})


GAP = {"tolerances": {"gap": {"of": "collision.gap_mm", "sigma": 1}}, "set": {"collision.gap_mm": 50}}


def test_a_limit_that_scatters_is_used_by_its_own_value(folder):
    """Breaks if the worst draw, the causes and the distribution go by the limit as designed."""
    tolerances = {"limit": {"of": "limits.TS_mm", "sigma": 60}, "mass": TOLERANCES["mass"]}
    found = run("out", tolerances=tolerances, runs=16)
    (ts, *_), draws = found.passed, pd.read_csv("out/draws.csv")
    judged = [trainmj.scenario_of_draw(found.plan, n).limits["TS_mm"] for n in range(16)]
    used = 100 * draws["TS_mm found"] / judged
    assert (ts.worst, ts.passes) == (used.argmax(), (used > 100).sum())
    assert ts.used[-1] == pytest.approx(used.max(), rel=1e-12)
    assert min(cause.correlation for cause in ts.causes if cause.name == "limit") < -0.5


def test_a_known_probability_its_cause_and_its_quantiles_are_found(folder):
    """Breaks if draws are counted in the wrong column, or an interval does not belong to its probability."""
    found = run("out", engine=Linear(1.0), runs=2048, responses=["TS_mm"], **GAP)
    (ts, whole) = found.passed
    exact = norm.sf(1.0)
    assert ts.name == "TS_mm"
    assert ts.estimate.lower < exact < ts.estimate.upper
    assert ts.estimate.value == pytest.approx(exact, abs=0.003)  # quasi-random
    assert whole.estimate == ts.estimate
    (cause,) = ts.causes
    assert cause.shift == pytest.approx(norm.pdf(1.0) / exact, rel=0.02)  # E[y | y > 1]
    assert cause.correlation == pytest.approx(1.0)
    (quantiles,) = [s for s in found.scattered if s.name == "TS_mm"]
    assert quantiles.mean.value == pytest.approx(780 * 0.9, rel=1e-3)
    assert quantiles.deviation == pytest.approx(78, rel=0.01)
    for q, e in quantiles.quantiles:
        assert e.lower <= e.value <= e.upper
        assert e.value == pytest.approx(780 * (0.9 + 0.1 * norm.ppf(q)), rel=0.02)
    draws = pd.read_csv("out/draws.csv")
    assert ts.worst == draws["TS_mm found"].argmax()
    assert (draws["TS_mm passed"].sum(), len(draws)) == (ts.passes, 2048)
    summary = json.loads(Path("out/summary.json").read_text())
    assert summary["probabilities"][0]["estimate"]["value"] == ts.estimate.value


def test_what_has_no_usable_number_is_never_counted_as_safe(folder):
    """Breaks if a run that fails lowers the probability, or is left out of it without a word."""
    sure = run("sure", engine=Linear(1.0), runs=512, **GAP).any
    found = run("out", engine=Linear(1.0, fails=lambda y: y < -2.0), runs=512, **GAP)
    ts = found.passed[0]
    lost = found.unusable
    assert lost == ts.unknown > 0
    assert ts.estimate.value == pytest.approx(sure.estimate.value + lost / 512)
    assert ts.estimate.lower == pytest.approx(sure.estimate.lower)
    assert ts.estimate.upper > sure.estimate.upper
    assert "unstable: made so" in found.first_unusable
    (quantiles,) = [s for s in found.scattered if s.name == "TS_mm"]
    assert quantiles.quantiles[-1][1].upper == math.inf  # it may have been any of those that failed


def test_draws_whose_step_is_coarse_for_their_peaks_are_counted(folder):
    found = run("out", engine=Linear(reason="coarse step for the peak forces of M1"), **GAP)
    assert found.coarse == found.collisions == 64
    assert any("64 of 64 collisions have a coarse step" in said for said in remarks(found))
    assert not any("coarse step" in said for said in remarks(run("other", engine=Linear(), **GAP)))


def test_what_passes_in_one_load_case_passes_whatever_becomes_of_it_in_another(folder):
    """Breaks if a draw without usable numbers in one load case undoes the limit that it passed in another."""

    class Failing(Linear):
        def __call__(self, cases):
            cases = list(cases)
            gap = {
                key: case.get("collision.gap_mm", 50.0)
                for some in cases
                for key, case in zip(some.keys, some, strict=True)
            }
            for rows in each_alone(super().__call__(cases)):
                yield unstable(rows.keys) if rows.keys[0] % 2 and gap[rows.keys[0]] > 50.0 else rows

    found = run("out", engine=Failing(1.0), runs=64, cases={"a": {}, "b": {}}, **GAP)
    of = {(p.case, p.name): p for p in found.passed}
    a, b, whole = of["a", "any"], of["b", "any"], of["", "any"]
    assert 0 < a.passes < b.unknown == 32
    assert (whole.passes, whole.unknown) == (32, 32 - a.passes)


def test_a_curve_that_ends_counts_as_passed_and_is_said(folder):
    """Breaks if numbers behind the end of a curve are taken for valid ones."""
    ends = {"devices.tube.beyond": None, "devices.tube.curve": points((0, 0), (1, 400), (300, 500)), "speed": 14}
    ends |= {"devices.tube.stroke_limit_mm": None}
    Path("my.reliability.yaml").write_text(json.dumps(FILE | {"set": ends, "runs": 16}))
    done = command("my.reliability.yaml", "--out", "out", "--threads", 1, "--figures", "none")
    said = " ".join(done.output.split())
    assert done.exit_code == 1, done.output
    assert "16 of 16 collisions have no usable numbers and count as passed; the first, draw 0, curve ended" in said
    (ts, whole) = json.loads(Path("out/summary.json").read_text())["probabilities"]
    assert (ts["unknown"], ts["estimate"]["value"], whole["estimate"]["value"]) == (16, 1.0, 1.0)
    assert ts["estimate"]["lower"] == 0.0


def test_a_draw_has_the_criteria_and_numbers_of_a_single_run_of_its_scenario(folder):
    """Breaks if a draw is another train than the one that is written for trainmj run."""
    cases = {"slow": {}, "fast": {"set": {"speed": 14}}}
    found = run("out", cases=cases, runs=12, responses=["*"])
    draws = pd.read_csv("out/draws.csv")
    assert len(draws) == 24
    for number, case in ((0, "slow"), (11, "fast")):
        asked = plan(cases=cases)
        trainmj.save(trainmj.scenario_of_draw(asked, number, case), "draw.yaml")
        single = trainmj.summarise(trainmj.run("draw.yaml"))
        (row,) = draws[(draws["draw"] == number) & (draws["load_case"] == case)].to_dict("records")
        for name, value in single.responses.items():
            assert row[name] == value or math.isnan(value), name
        for criterion in single.limits:
            assert row[f"{criterion.name} found"] == criterion.found
            assert row[f"{criterion.name} passed"] == (not criterion.kept)
    either = draws.groupby("draw")["status"].agg(lambda s: (s != "over").any()).sum()
    assert found.any.passes == either
    assert [one.case for one in found.passed] == ["slow"] * 3 + ["fast"] * 3 + [""]


# going on


@pytest.mark.thorough
def test_threads_kills_and_more_runs_leave_the_same_files(folder):
    """Breaks if a result depends on threads, on where a run was stopped, or on how many draws were asked for first."""
    keys = {"rare": {"limits": ["TS_mm"], "runs": 100, "levels": 2}}
    keys |= {"sensitivity": {"runs": 16}}
    whole = run("whole", runs=24, **keys)
    expected = files_of("whole")
    assert {"draws.csv", "limits.csv", "rare.csv", "indices.csv", "summary.json"} <= set(expected)
    run("threads", threads=2, runs=24, **keys)
    assert files_of("threads") == expected
    run("more", runs=8)
    with closing(sqlite3.connect("more/draws.sqlite")) as db, db:
        db.execute('DELETE FROM results WHERE "case" IN (0, 5)')  # as if they had not been written yet
        signed(db)
    again = run("more", runs=24, **keys)
    assert files_of("more") == expected
    assert again.computed < whole.computed
    fewer = run("more", runs=8)
    assert fewer.computed == 0
    assert len(pd.read_csv("more/draws.csv")) == 8


def test_other_input_is_refused_and_fresh_starts_over(folder):
    """Breaks if draws of another seed, tolerance or load case are mixed with those that are there."""
    run("out", runs=4)
    with pytest.raises(InputError, match="holds other results: seed 3 then, 4 now"):
        run("out", runs=4, seed=4)
    with pytest.raises(InputError, match=r"tolerances\.mass\.percent 3 then, 2 now"):
        run("out", runs=4, tolerances=TOLERANCES | {"mass": TOLERANCES["mass"] | {"percent": 2}})
    again = run("out", runs=4, set={"report": {"revision": "B"}, "title": "Revision B"})
    assert (again.computed, next(iter(again.plan.scenarios.values())).report.revision) == (0, "B")
    trainmj.run_reliability(plan(runs=4, seed=4), "out", fresh=True, threads=1, figures=())


@pytest.mark.thorough
def test_a_run_that_is_killed_goes_on_to_the_same_files(folder):
    """Breaks if what a killed process leaves is taken for finished, or lost."""
    run("whole", runs=500)

    Path("my.reliability.yaml").write_text(json.dumps(FILE | {"runs": 500}))

    def prepare():
        trainmj.cases.runner.COMMIT_EVERY = 0.0
        trainmj.cases.engine.SIZE = 16  # few in a lot, which end one after the other
        trainmj.collision.batch.steps_within = lambda chain: 0  # slower, with the same bits

    words = ("reliability", "my.reliability.yaml", "--out", "killed", "--figures", "none")
    process = Forked(folder, *words, prepare=prepare)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        time.sleep(0.02)
        with suppress(sqlite3.Error), closing(sqlite3.connect("file:killed/draws.sqlite?mode=ro", uri=True)) as db:
            if db.execute("SELECT count(*) FROM results").fetchone()[0] > 50:
                break
    process.send(signal.SIGKILL)
    assert process.ended().returncode == -signal.SIGKILL
    assert not Path("killed/summary.json").exists()
    run("killed", runs=500)
    assert files_of("killed") == files_of("whole")


# searches and indices


@pytest.mark.thorough
def test_subset_simulation_and_importance_sampling_find_a_small_probability(folder):
    """Breaks if a search goes by another limit than the draws, or its points are not those of the plan's seed."""
    for method in ("subset_simulation", "importance_sampling"):
        found = run(method, engine=Linear(3.0), runs=64, **GAP, rare={"method": method, "runs": 400, "limits": "any"})
        (one,) = found.searched
        assert one.rare.trusted, one.rare.status
        assert one.rare.lower < norm.sf(3.0) < one.rare.upper
        assert found.any.passes == 0


def test_searches_go_automatically_to_limits_that_few_draws_pass(folder):
    """Breaks if a limit that plain draws say enough of costs a search, or one that they do not is left out."""
    assert [s.name for s in run("a", engine=Linear(2.5), runs=64, **GAP, rare={"runs": 100}).searched] == ["TS_mm"]
    assert run("b", engine=Linear(0.0), runs=64, **GAP, rare={"runs": 100}).searched == ()
    with pytest.raises(InputError, match=r"rare\.limits: there is no limit 'TS_m'; did you mean 'TS_mm'"):
        run("c", runs=4, rare={"limits": ["TS_m"]})


def test_indices_are_those_of_a_linear_train(folder):
    """Breaks if the copies of a part are taken for parts of their own, or shares go to the wrong tolerance."""
    found = run("out", runs=16, sensitivity={"runs": 32, "responses": ["TS_mm"]})
    share = {(i.response, i.part): i for i in found.indices}
    mass, tube = share["TS_mm", "mass"], share["TS_mm", "tube"]
    assert {i.part for i in found.indices} == {"mass", "tube"}
    assert mass.total[0] + tube.total[0] == pytest.approx(1.0, abs=0.25)
    assert found.governing.name in {i.response for i in found.indices}


@pytest.mark.thorough
def test_searches_agree_with_plain_draws_on_a_train(folder):
    """Breaks if a method is biased where collisions, not formulas, are the limit state: P is about 1 in 100."""
    limit = {"set": {"limits.TS_mm": 830, "devices.tube.stroke_limit_mm": None}}
    plain = run("plain", threads=0, runs=1500, draws="random", **limit).any.estimate
    assert 0.004 < plain.value < 0.03
    for method in ("subset_simulation", "importance_sampling"):
        found = run(method, threads=0, runs=16, **limit, rare={"method": method, "runs": 500, "limits": "any"})
        rare = found.searched[0].rare
        assert rare.trusted
        assert max(rare.lower, plain.lower) < min(rare.upper, plain.upper), (rare, plain)


# the command, as it is typed


def test_the_command_from_a_scenario_alone(folder):
    """Breaks if tolerances of a scenario, or what a reader is told first, get lost on the way."""
    Path("built.yaml").write_text(json.dumps(SMALL | {"tolerances": TOLERANCES}))
    words = ("built.yaml", "--runs", 32, "--seed", 3, "--out", "out", "--threads", 1, "--report")
    done = command(*words)
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert "32 scrambled Sobol' draws of 4 random quantities" in said
    assert "A limit is passed with a probability of " in said
    assert "mean if passed" in said
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert "Running probability: any limit" in page
    assert Path("out/convergence.png").stat().st_size > 10_000
    assert "--runs 32 --seed 3 --out out --report" in page
    again = command(*words, "--json")
    assert json.loads(again.output) == json.loads(Path("out/summary.json").read_text())
    other = CliRunner().invoke(main, ["report", "out"])
    assert other.exit_code == 2
    assert "trainmj reliability FILE --out out --report, which computes nothing again" in other.output


def test_the_command_writes_a_draw_that_runs(folder):
    """Breaks if --draw computes, or writes something that trainmj run does not take."""
    Path("my.reliability.yaml").write_text(json.dumps(FILE | {"cases": {"slow": {}, "fast": {"set": {"speed": 14}}}}))
    done = command("my.reliability.yaml", "--draw", 7, "--case", "fast", "--out", "out")
    assert (done.exit_code, done.output) == (0, "Draw 7 in fast: trainmj run out/draw_7_fast.yaml\n")
    assert [file.name for file in Path("out").iterdir()] == ["draw_7_fast.yaml"]
    assert trainmj.load("out/draw_7_fast.yaml").collision.speed_km_h == 14


def test_check_and_schema_know_the_file(folder):
    """Breaks if the file cannot be checked before it is run, or an editor does not know its keys."""
    Path("my.yaml").write_text(json.dumps(FILE | {"cases": {"slow": {}, "fast": {"set": {"speed": 14}}}}))
    done = CliRunner().invoke(main, ["check", "my.yaml"])
    assert done.exit_code == 0, done.output
    for words in ("64 scrambled Sobol' draws of 4 random quantities, each in 2", "normal, percent 3", "fast: "):
        assert words in done.output
    Path("built.yaml").write_text(json.dumps(SMALL | {"tolerances": TOLERANCES}))
    assert "normal, percent 3" in CliRunner().invoke(main, ["check", "built.yaml"]).output
    wrong = CliRunner().invoke(main, ["check", "built.yaml", "--set", "tolerances.mass.of=mas_t"])
    assert (wrong.exit_code, "mas_t: there is no 'mas_t' in the scenario" in wrong.output) == (2, True), wrong.output
    schema = json.loads(CliRunner().invoke(main, ["schema", "reliability"]).output)
    assert {"tolerances", "cases", "rare", "sensitivity"} <= set(schema["properties"])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"runs": 0}, "my.reliability.yaml:1:"),
        ({"tolerances": {}}, "my.reliability.yaml: tolerances: the scenario has none: state what scatters"),
        ({"tolerances": {"mass": {"of": "mas_t", "percent": 1}}}, "there is no 'mas_t' in the scenario"),
        ({"tolerances": {"mass": {"of": "mass_t", "percent": 1}}}, "leads to 2 vehicles or devices: state copies"),
        ({"tolerances": {"mass": {"of": "mass_t", "percnt": 1}}}, "percnt"),
        ({"cases": {"fast": {"set": {"spee": 14}}}}, "cases.fast.set.spee"),
        ({"cases": {"fast": {"scenario": "no.yaml"}}}, "cases.fast.scenario = 'no.yaml'"),
        ({"responses": ["TS_m"]}, "responses: no response is called 'TS_m'; did you mean 'TS_mm'"),
        ({"quantiles": [95]}, "quantiles"),
        ({"draws": "sobo"}, "must be 'sobol', 'random' or 'latin_hypercube'"),
        ({"rare": {"method": "form"}}, "rare.method"),
        ({"set": {"simulation.step_ms": 20}}, "step_ms"),
        ({"sources": {"tolerances.nothing": "a guess"}}, "leads to no value of this file"),
    ],
)
def test_bad_input_is_said_with_its_place(folder, keys, said):
    """Breaks if a wrong file ends in a traceback, or in a message that does not lead to the key."""
    Path("my.reliability.yaml").write_text(json.dumps(FILE | keys))
    done = command("my.reliability.yaml", "--out", "out")
    assert done.exit_code == 2, done.output
    assert said in done.output, done.output
    assert "Traceback" not in done.output
    assert not Path("out/summary.json").exists()


def test_what_does_not_go_together_on_the_command_line_is_said(folder):
    """Breaks if a wrong option is ignored."""
    Path("my.reliability.yaml").write_text(json.dumps(FILE))
    assert "--case: goes with --draw" in command("my.reliability.yaml", "--case", "x", "--out", "out").output
    said = command("my.reliability.yaml", "--draw", 1, "--case", "x", "--out", "out")
    assert (said.exit_code, "there is no load case 'x'" in said.output) == (2, True)
    assert "is a study file" in command("b_type.study.yaml", "--out", "out").output
    assert command("small.yaml", "--out", "out").exit_code == 2  # it states no tolerances


def test_a_scenario_without_limits_is_told_so(folder):
    """Breaks if a probability of 0 is printed where nothing is judged."""
    bare = {"set": {"limits": None, "devices.tube.stroke_limit_mm": None}, "runs": 8}
    Path("my.reliability.yaml").write_text(json.dumps(FILE | bare))
    done = command("my.reliability.yaml", "--out", "out", "--threads", 1, "--figures", "png")
    assert done.exit_code == 0, done.output
    assert "Note: no limit is stated, and no device has a stroke limit" in " ".join(done.output.split())
    assert not Path("out/distribution.png").exists()


def test_python_takes_a_scenario(folder):
    """Breaks if the public function needs a file."""
    scenario = trainmj.Scenario.from_values(SMALL | {"tolerances": TOLERANCES})
    found = trainmj.run_reliability(scenario, "out", engine=Linear(), figures=())
    assert repr(found).startswith(
        "<ReliabilityResult Reliability: Two cars on crush tubes. A limit is passed with a prob"
    )
    assert found.plan.spec.runs == 1000
    asked = trainmj.load_reliability("small.yaml", {"tolerances": TOLERANCES})
    assert asked.scenarios[""].tolerances == scenario.tolerances
    assert np.array_equal(asked.draws(5, 3), asked.draws(0, 8)[5:])
    with pytest.raises(TypeError, match="needs a Reliability, or the path of its file"):
        trainmj.run_reliability(7, "out")
