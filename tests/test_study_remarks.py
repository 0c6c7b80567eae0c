"""What a study says of itself: what makes it not to be trusted, what it warns of, and of what it does not."""

import copy
import json
from dataclasses import asdict

import numpy as np
import pytest
from click.testing import CliRunner
from ruamel.yaml import YAML
from studies import SMALL, changed, run, small

import trainmj
from trainmj.cli import main
from trainmj.output.style import styled
from trainmj.study import figures_front
from trainmj.study.designs import Designs
from trainmj.study.page import page_of_folder
from trainmj.study.remarks import of_plan, of_result
from trainmj.study.screen import print_plan, print_study


@pytest.fixture
def good(small_study):
    return small_study


@pytest.fixture(scope="module")
def blind(tmp_path_factory):
    """A study whose surrogate of an objective does not know the factor on which that depends."""
    study = small(surrogates={"TS": {"terms": ["1", "D"]}})
    return run(study, tmp_path_factory.mktemp("blind") / "out")


def found(result, study=None, tables=(), **changes):
    """Remarks by kind and what they are about, with facts of the study changed: surrogates__TS__r2."""
    facts = copy.deepcopy(dict(result.summary))
    for path, value in changes.items():
        *outer, last = path.split("__")
        inner = facts
        for key in outer:
            inner = inner[int(key) if key.isdecimal() else key]
        inner[last] = value
    remarks = of_result(study or result.study, facts, dict(result.tables) | dict(tables))
    return {(r.kind, r.about): r.text for r in remarks}


def test_a_study_that_rests_on_a_bad_surrogate_is_not_to_be_trusted_and_says_so_everywhere(blind, capsys):
    """Breaks if a study is all green while its numbers are worthless."""
    assert not blind.summary["trusted"]
    said = {(r["kind"], r["about"]): r["text"] for r in blind.summary["remarks"]}
    assert "R² of points left out is -0.1" in " ".join(r["text"] for r in blind.summary["remarks"])
    assert ("fail", "TS") in said
    assert "no term in M, with which it correlates strongly (r = +0.99" in said["warn", "TS"]
    print_study(blind)
    screen, page = " ".join(capsys.readouterr().out.split()), page_of_folder(blind.folder).html()
    for where in (screen, page):
        assert "not to be trusted, for 2 reasons" in where
        assert "the search rests on this surrogate" in where
        assert "misses the simulation" in where
        assert "poor" in where
    assert {"10_check", "09_ranking"} <= set(blind.tables)  # all of it is there


def test_the_command_ends_with_1_where_the_study_is_not_to_be_trusted(blind, tmp_path):
    folder = tmp_path / "copy"
    folder.mkdir()
    for file in blind.folder.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    with (tmp_path / "blind.study.yaml").open("w", encoding="utf-8") as out:
        YAML().dump(changed(SMALL, "surrogates", {"TS": {"terms": ["1", "D"]}}), out)
    words = ["study", str(tmp_path / "blind.study.yaml"), "--out", str(folder), "--figures", "none"]
    told = CliRunner().invoke(main, words)
    assert told.exit_code == 1, told.output
    assert "FAIL     TS" in told.stdout
    assert ", not to be trusted, for " in " ".join(told.stdout.split())


def test_a_good_study_is_verified_with_what_there_is_to_know(good):
    """Ten points, whose factors are correlated as those of the published design are."""
    assert good.summary["trusted"]
    said = found(good)
    assert [asdict(r) for r in of_result(good.study, good.summary, good.tables)] == good.summary["remarks"]
    x = good.tables["01_design"][["D_mm", "M_t"]]
    assert f"r = {np.corrcoef(x.T)[0, 1]:+.2f}" in said["warn", "D and M"]
    assert {kind for kind, _ in said} == {"warn"}


def test_a_surrogate_on_which_nothing_rests_only_warns(blind, tmp_path):
    """The decision is on the simulator's front, whatever the surrogate says."""
    other = small(surrogates={"TS": {"terms": ["1", "D"]}}, optimiser={"on": "both"}, decision__front="simulator")
    texts = [r.text for r in of_result(other, blind.summary, blind.tables)]
    assert any("nothing rests on this surrogate" in text for text in texts)
    assert all(r.kind == "warn" for r in of_result(other, blind.summary, blind.tables))


def test_a_limit_out_of_reach_does_not_rest_on_its_surrogate(good):
    """A stroke of at most 300 mm below a limit of 418 mm keeps it, however roughly that is predicted."""
    bad = {"surrogates__responses__S_anti__poor": True, "surrogates__responses__S_anti__r2": 0.6}
    assert "the search rests" in found(good, **bad)["fail", "S_anti"]
    far = small(constraints={"S_anti": {"at_most": 418}})
    assert "its limit is out of reach" in found(good, far, **bad)["warn", "S_anti"]
    near = bad | {"surrogates__responses__S_anti__error": 60.0}  # 3 x 60 mm reach from 290 to 418 mm
    assert ("fail", "S_anti") in found(good, far, **near)


@pytest.mark.thorough
def test_a_response_that_hardly_varies_is_no_false_alarm(tmp_path):
    """R² of a response within round-off or noise means nothing: its error against its value counts."""
    values = changed(SMALL, "responses.F", "force_S1_M1_kN")
    values = changed(values, "objectives.F", "minimise")
    result = run(trainmj.study_of(values), tmp_path / "out")
    row = result.summary["surrogates"]["responses"]["F"]
    assert row["range"] < 0.005 * row["high"]
    assert not row["poor"]
    said = found(result)
    assert "hardly varies over the design" in said["warn", "F"]
    assert result.summary["trusted"]


def test_the_bars_are_those_of_the_file(blind, good):
    """Breaks if quality: in a file changes nothing."""
    strict = small(quality={"confounding_correlation": 0.5})
    assert ("warn", "D and M") not in found(good, strict)
    row = blind.summary["surrogates"]["responses"]["TS"]
    assert row["poor"]
    assert found(blind, small(quality={"strong_correlation": 1}))["warn", "D and M"]
    assert "no term in M" not in " ".join(found(blind, small(quality={"strong_correlation": 1})).values())
    with pytest.raises(trainmj.InputError, match=r"quality\.least_r2 = 2"):
        small(quality={"least_r2": 2})


def test_a_prediction_is_measured_by_the_range_over_the_design(good, blind):
    ranged = {row["response"]: row for row in blind.summary["check"]["rows"]}["TS"]
    simulated = blind.tables["02_simulations"]["TS_mm"]
    part = 100 * (ranged["predicted"] - ranged["simulated"]) / np.ptp(simulated)
    assert ranged["error_of_range_percent"] == pytest.approx(part, rel=1e-12)
    assert ranged["missed"] == (abs(part) > 10)
    assert not any(row["missed"] for row in good.summary["check"]["rows"])


def test_what_the_check_finds_decides(good):
    row = good.summary["check"]["rows"].index(
        next(r for r in good.summary["check"]["rows"] if r["response"] == "S_anti")
    )
    at = f"check__rows__{row}__"
    beyond = {f"{at}kept": False, f"{at}simulated": 266.0, "check__kept": False}
    assert "S_anti <= 265 mm is not kept when simulated (266)" in found(good, **beyond)["fail", "S_anti"]
    close = {f"{at}predicted": 262.0, f"{at}simulated": 264.0}
    assert "comes to 1 mm of S_anti <= 265 mm" in found(good, **close)["warn", "S_anti"]
    exact = {f"{at}predicted": 265 + 1e-12, f"{at}simulated": 265.0}
    assert ("warn", "S_anti") not in found(good, **exact)
    unusable = {"check__status": "unstable", "check__reason": "energy"}
    assert "no numbers that may be used" in found(good, **unusable)["fail", "chosen design"]
    assert "came to no number" in found(good, **{f"{at}simulated": np.nan})["fail", "S_anti"]
    past = {"check__status": "stroke exhausted", "check__reason": "at M1-M2", "check__kept": True}
    assert "no constraint of the study forbids" in found(good, **past)["warn", "chosen design"]


def test_points_that_were_left_out_near_the_chosen_design_are_said(good):
    table = good.tables["02_simulations"].copy()
    chosen = good.tables["09_decision"].iloc[0]
    near = (((table["D_mm"] - chosen["D_mm"]) / 30) ** 2 + ((table["M_t"] - chosen["M_t"]) / 6) ** 2).idxmin()
    table.loc[near, "status"] = "curve ended"
    said = found(good, tables={"02_simulations": table})["warn", "chosen design"]
    assert f"test {near + 1}, was left out (curve ended)" in said


def test_a_choice_at_a_bound_and_few_degrees_of_freedom_are_said(good):
    picked = good.tables["09_decision"].reset_index(drop=True)
    picked.loc[0, "D_mm"] = 50.0
    assert "at its upper bound, 50 mm" in found(good, tables={"09_decision": picked})["warn", "D"]
    anova = good.tables["04_anova"].copy()
    anova.loc[anova["source"] == "residuals", "dof"] = 1
    assert "leaves 1 degree of freedom" in found(good, tables={"04_anova": anova})["warn", "TAMA"]


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        ("speed_km_h", "is a load"),  # a parameter that leads to collision.speed_km_h
        ("collision.grade_per_mille", "is a load"),
        ("collision.rail_friction", "is a load"),
        ("trains.b_type.rail_friction", "is a load"),
        ("simulation.contact_threshold_kN", "is a setting of the computation"),
        ("empty_stroke_mm", None),
        ("trains.b_type.mass_t", None),  # of the train under test, and of its twin
    ],
)
def test_a_load_that_is_optimised_as_a_design_is_warned_of_before_anything_runs(sets, said, capsys):
    factors = {"L": {"sets": sets, "bounds": [20, 40] if said is None else [0.01, 0.9]}}
    study = small(factors=factors, design={"n": 10})
    print_plan(study)
    assert ("warning  L" in capsys.readouterr().out) == (said is not None)
    remarks = of_plan(study)
    assert [(r.kind, r.about) for r in remarks] == [("warn", "L")] * (said is not None)
    for remark in remarks:
        assert said in remark.text
        assert "fix it under set, or vary it with trainmj sweep" in remark.text


@pytest.mark.parametrize("sets", ["trains.wagon.mass_t", "devices.buffer.stiffness_kN_per_mm"])
def test_what_is_only_the_partners_is_no_design_of_the_train(sets):
    values = trainmj.load("b_type").values()
    values["devices"]["buffer"] = copy.deepcopy(values["devices"]["front"])
    values["trains"]["wagon"] = {"vehicles": 1, "mass_t": 80, "front": "buffer", "rear": "buffer"}
    values["collision"]["partner"] = "wagon"
    scenario = trainmj.Scenario.from_values(values)
    from trainmj.study.remarks import _not_of_the_train

    (place,) = scenario.places(sets)
    assert _not_of_the_train(scenario, place) == "a value of the partner"
    assert _not_of_the_train(scenario, ("devices", "front", "stiffness_kN_per_mm")) == ""
    assert _not_of_the_train(scenario, ("trains", "b_type", "mass_t")) == ""


def test_pictures_and_page_show_the_chosen_design_where_it_was_simulated(blind):
    """Breaks if the chosen design is drawn only where the surrogates believe it is."""
    rows = {row["response"]: row for row in blind.summary["check"]["rows"]}
    predicted, simulated = (np.array([rows[n][key] for n in ("TS", "TAMA")]) for key in ("predicted", "simulated"))
    front = blind.study.criteria(Designs.read(blind.study, blind.tables["09_ranking"]).responses)
    with styled():
        (axes,) = figures_front.decision(blind.study, front, {"TOPSIS": predicted}, simulated).axes
    drawn = {line.get_label(): line.get_xydata() for line in axes.lines}
    assert drawn["the same, simulated"].tolist() == [simulated.tolist()]
    assert drawn["chosen: TOPSIS"].tolist() == [predicted.tolist()]
    assert any(line.get_xydata().tolist() == [predicted.tolist(), simulated.tolist()] for line in axes.lines)
    plots = [block.content for s in page_of_folder(blind.folder).sections for block in s.blocks if block.kind == "plot"]
    (plot,) = (json.loads(plot["figure"]) for plot in plots if plot["title"] == "Front: TS and TAMA")
    (star,) = (trace for trace in plot["data"] if trace["name"] == "the same, simulated")
    assert [*star["x"], *star["y"]] == pytest.approx(simulated.tolist(), rel=1e-3)
    assert star["x"] != pytest.approx(predicted[:1].tolist(), rel=1e-2)


def test_tests_whose_step_is_coarse_for_their_peaks_are_counted(good):
    assert not any("coarse step" in text for text in found(good).values())
    table = good.tables["02_simulations"].copy()
    table["reason"] = table["reason"].astype(object)
    table.loc[[0, 2], "reason"] = "coarse step for the peak forces of M1"
    said = found(good, tables={"02_simulations": table})["warn", "step"]
    assert said.startswith(f"2 of {len(table)} tests have a coarse step")
    check = {"check__reason": "coarse step for the peak forces of M1"}
    both = found(good, tables={"02_simulations": table}, **check)["warn", "step"]
    assert f"2 of {len(table)} tests and the chosen design have a coarse step" in both
    assert found(good, **check)["warn", "step"].startswith("The chosen design has a coarse step")
