"""Public functions: what they take for what they need, and in which words they refuse the rest."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders import values

import trainmj
from trainmj.assessment.file import AssessmentFile
from trainmj.cli.options import set_again, split_assignment
from trainmj.files.kinds import KINDS, PARTNER, RELIABILITY, SWEEP, kind_of
from trainmj.files.parts import keys_of
from trainmj.files.yaml import read_value
from trainmj.identification.file import TargetsFile
from trainmj.reliability.file import ReliabilityFile
from trainmj.scenario import Scenario
from trainmj.scenario.files import BUILDS_ON
from trainmj.scenario.partners import PartnerFile
from trainmj.scenario.parts import Parts
from trainmj.study.file import StudyFile
from trainmj.sweep.file import SweepFile

SHORT = {"simulation.time_limit_s": 0.02}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return Scenario.from_values(values([(0, 0), (10, 900), (500, 900)], 100)).with_values(SHORT)


@pytest.fixture(scope="module")
def result(scenario: Scenario) -> trainmj.Result:
    return trainmj.run(scenario)


@pytest.fixture
def file(scenario: Scenario, tmp_path: Path) -> Path:
    trainmj.save(scenario, tmp_path / "my.yaml")
    return tmp_path / "my.yaml"


def test_a_file_stands_for_its_scenario_and_a_saved_result_for_itself(scenario, result, file, tmp_path):
    """Breaks if run("b_type") ends in an AttributeError."""
    for given in (file, str(file)):
        assert trainmj.repeated(trainmj.run(given), result).same
        assert trainmj.line_up(given).step == result.chain.step
    assert trainmj.converge(file).settled in (True, False)
    assert len(trainmj.grid_of(file, {"collision.gap_mm": [0, 5]})) == 2
    assert len(trainmj.run_cases(file, {"collision.gap_mm": [0, 5]}, responses="TS_mm")) == 2
    trainmj.save(file, tmp_path / "copy.yaml")
    assert trainmj.load(tmp_path / "copy.yaml").values() == scenario.values()
    result.save(tmp_path / "result.nc")
    for given in (tmp_path, str(tmp_path / "result.nc")):
        assert trainmj.summarise(given).as_dict() == trainmj.summarise(result).as_dict()
        assert trainmj.repeated(given, result).same
        assert trainmj.load_result(given).numbers().keys() == result.numbers().keys()
    assert trainmj.run("wagon_80t").scenario.title == trainmj.load("wagon_80t").title


CASES: list[Any] = [
    {"collision.gap_mm": [0, 5]},
    {"collision.gap_mm": np.array([0.0, 5.0])},
    {"collision.gap_mm": (0, 5), "collision.rail_friction": 0},
    [{"collision.gap_mm": 0}, {"collision.gap_mm": 5}],
    ({"collision.gap_mm": gap} for gap in (0, 5)),
    pd.DataFrame({"collision.gap_mm": [0.0, 5.0]}),
]


@pytest.mark.parametrize("cases", CASES, ids=lambda cases: type(cases).__name__)
def test_cases_may_be_lists_by_column_or_a_dict_for_each(scenario, cases):
    table = trainmj.run_cases(scenario, cases)
    assert table["status"].tolist() == ["time limit"] * 2
    assert table["collision.gap_mm"].tolist() == [0, 5]
    single = trainmj.run_cases(scenario, {"collision.gap_mm": 5})
    assert single["TS_mm"].tolist() == table["TS_mm"].tolist()[1:]


@pytest.mark.parametrize("empty", [np.nan, None, pd.NA])
def test_an_empty_cell_refuses_its_case_and_no_other(scenario, empty):
    """Breaks if an empty cell is computed with some other value."""
    cases = pd.DataFrame({"collision.gap_mm": pd.Series([0.0, empty], dtype=object)})
    assert trainmj.run_cases(scenario, cases)["status"].tolist() == ["time limit", "refused"]


def test_cases_whose_columns_contradict_each_other_are_refused(scenario):
    """Breaks if a column of the table says something that was not computed."""
    twice = pd.DataFrame([[0, 5]], columns=["collision.gap_mm", "collision.gap_mm"])
    named = scenario.with_values({"parameters": {"gap": "collision.gap_mm"}})
    for cases in (twice, {"gap": [0], "collision.gap_mm": [5]}, {"collision.gap_mm": [0], "collision": [{}]}):
        with pytest.raises(trainmj.InputError, match="set the same value"):
            trainmj.run_cases(named, cases)
        with pytest.raises(trainmj.InputError, match=r"set the same value|is varied twice"):
            trainmj.Sweep(named, tuple({str(name): [0]} for name in cases))
    with pytest.raises(trainmj.InputError, match="equal length; these have gap 2, mass 1"):
        trainmj.run_cases(named, {"gap": [1, 2], "mass": [1]})


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("trainmj.run(result)", "needs a Scenario, or the path of its file, not Result: trainmj.load"),
        ("trainmj.run({'devices': {}})", "needs a Scenario, .*not dict: .*Scenario.from_values makes one of plain"),
        ("trainmj.run(None)", "needs a Scenario"),
        ("trainmj.converge(5)", "needs a Scenario"),
        ("trainmj.line_up(result)", "needs a Scenario"),
        ("trainmj.save(result, 'a.yaml')", "needs a Scenario"),
        ("trainmj.grid_of(None, {})", "needs a Scenario"),
        ("trainmj.Sweep('b_type', ())", "needs a Scenario, not str"),
        ("trainmj.run_cases(result, {})", "needs a Scenario"),
        (
            "trainmj.run_cases(scenario, 'mass_t')",
            "needs a pandas table, lists by column in a dict, or a list of dicts",
        ),
        ("trainmj.run_cases(scenario, [1, 2])", "needs a pandas table.*not list"),
        ("trainmj.run_cases(scenario, 5)", "needs a pandas table.*not int"),
        ("trainmj.summarise(scenario)", "needs a Result, .*not Scenario: trainmj.run computes one"),
        ("trainmj.repeated(scenario, result)", "needs a Result"),
        ("trainmj.load(scenario)", "needs the path of a file, or the name of a shipped one, not Scenario"),
        ("trainmj.load({})", "needs the path of a file.*Scenario.from_values"),
        ("trainmj.load('b_type', 'mass_t=33')", "needs a dict of values by key or path, not str"),
        ("trainmj.load_study({})", "needs the path of a file.*study_of"),
        ("trainmj.load_sweep(scenario)", "needs the path of a file"),
        ("trainmj.load_targets(None)", "needs the path of a file"),
        ("trainmj.study_of('b_type')", "needs a dict of values.*load_study"),
        ("trainmj.sweep_of(scenario)", "needs a dict of values"),
        ("trainmj.targets_of('b_type')", "needs a dict of values"),
        ("trainmj.Scenario.from_values('b_type')", "needs a dict of values"),
        ("scenario.with_values('mass_t')", "needs a dict of values"),
        ("trainmj.grid_of(scenario, 'mass_t')", "needs a dict of values"),
        ("trainmj.run_sweep(scenario, 'out')", "needs a Sweep, .*not Scenario: trainmj.grid_of"),
        ("trainmj.run_study(scenario, 'out')", "needs a Study"),
        ("trainmj.identify(scenario, 'out')", "needs an Identification, .*targets_of"),
        ("trainmj.run_sweep(trainmj.grid_of(scenario, {'collision.gap_mm': 5}), None)", "needs the path of a folder"),
        ("trainmj.read_table(result)", "needs the path of a folder.*not Result: its save writes it to a file"),
        ("trainmj.write_report(scenario)", "needs the path of a folder.*not Scenario"),
        ("trainmj.run(pd.DataFrame())", "needs a Scenario, .*not DataFrame: trainmj.load"),
        ("trainmj.run(summary)", "needs a Scenario, .*not Summary"),
        ("trainmj.summarise(summary)", "needs a Result, .*not Summary: trainmj.run computes one"),
        ("trainmj.summarise(pd.DataFrame())", "needs a Result, .*not DataFrame"),
        ("trainmj.channels(summary)", "needs a Result, .*not Summary"),
        ("trainmj.write_report(summary)", "needs the path of a folder.*not Summary: .*Result"),
        ("trainmj.write_report(pd.DataFrame())", "needs the path of a folder.*not DataFrame"),
        ("trainmj.assess(result, 'en15227')", "needs a Scenario, .*not Result"),
        ("trainmj.assess(scenario, scenario)", "needs a Standard, .*not Scenario"),
        ("trainmj.run('b_type', 20)", "needs a dict of values by key or path, not int"),
        ("trainmj.run('b_type', pd.DataFrame())", "needs a dict of values by key or path, not DataFrame"),
        ("trainmj.load_result(scenario)", "needs the path of a folder"),
    ],
)
def test_what_cannot_be_meant_is_a_type_error_that_says_what_is_needed(
    scenario, result, call, said, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    things = {"scenario": scenario, "result": result, "summary": trainmj.summarise(result)}
    with pytest.raises(TypeError, match=said):
        eval(call, {"trainmj": trainmj, "pd": pd, **things})
    assert not list(tmp_path.iterdir())


def test_what_a_sweep_gave_stands_for_its_folder(scenario, tmp_path):
    done = trainmj.run_sweep(trainmj.grid_of(scenario, {"collision.gap_mm": (0, 5)}, "TS_mm"), tmp_path / "out")
    assert trainmj.read_table(done)["TS_mm"].tolist() == trainmj.read_table(tmp_path / "out")["TS_mm"].tolist()
    assert trainmj.write_report(done) == tmp_path / "out" / "report.html"


def test_formats_of_figures_are_checked_before_the_work(tmp_path):
    for work, plan in (
        (trainmj.run_study, trainmj.load_study("b_type")),
        (trainmj.identify, trainmj.load_targets("b_type")),
    ):
        with pytest.raises(trainmj.InputError, match="figures: 'gif' is not a format of figures; known: png"):
            work(plan, tmp_path / "out", figures="gif")
    assert not (tmp_path / "out").exists()


def test_the_kinds_of_files_are_told_apart_by_the_keys_that_only_they_have():
    """Breaks if a new key of a file is not in the table by which files are told apart."""
    models = (Parts, SweepFile, StudyFile, TargetsFile, AssessmentFile, PartnerFile, ReliabilityFile)
    keys = {model.model_config["title"]: set(keys_of(model)) for model in models}
    keys["scenario file"].add(BUILDS_ON)
    for kind in KINDS:
        # a partner file is a piece of a scenario: what both have does not tell it from other kinds
        others = [of for name, of in keys.items() if name != kind.name and PARTNER.name != name]
        # a key of two kinds counts for the one that may have no other: a table of cases, tolerances of a scenario
        others = [of - {SWEEP: {"cases"}, RELIABILITY: {"tolerances"}}.get(kind, set()) for of in others]
        if kind is PARTNER:
            others.remove(keys["scenario file"])
            others.append({"title", "notes", "sources"})
        assert kind.own == keys[kind.name] - set().union(*others), kind.name
        assert kind_of(keys[kind.name]) is kind
    assert kind_of(["title", "notes", "scenario", "set"]) is None


def test_command_of_a_page_sets_the_same_values_again():
    """Breaks if null, a truth value or a group means something else in the command that a page gives."""
    changes = {"a": None, "b": True, "c": {"k": [1, 2.5]}, "d": "wagon 80", "e": 1e-5, "f": 33}
    texts = shlex.split(" ".join(set_again(changes)))[1::2]
    assignments = (split_assignment("--set", text, "") for text in texts)
    assert {path: read_value(value, "") for path, value in assignments} == changes
