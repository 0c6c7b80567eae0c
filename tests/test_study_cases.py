"""Studies of several load cases: one design for all, judged by the worst, and held to the limits of each."""

import numpy as np
import pytest
from studies import run, small

import trainmj
from trainmj.study.page import page_of_folder
from trainmj.study.screen import print_plan, print_study

FAST = {"fast": {"set": {"speed_km_h": 26.5}}}
CASES = {
    "normal": {},
    "wagon": {"set": {"collision.partner": "wagon_80t"}, "constraints": {"S_anti": {"at_most": 500}}},
}


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    """The twin, and the wagon, in which the anti-climber may be crushed further."""
    responses = {"TS": "TS_mm", "TAMA": {"column": "TAMA_g", "cases": ["normal"]}}
    study = small(cases=CASES, responses=responses | {"S_anti": "stroke_S1_M1_anti_climber_mm"})
    return run(study, tmp_path_factory.mktemp("several") / "out")


def test_rows_are_single_runs_and_objectives_the_worst_of_them(several):
    """Breaks if a load case is computed with other values than a run of it, or the worst is not told from the rest."""
    table = several.tables["02_simulations"]
    for case, changes in (("normal", {}), ("wagon", {"collision.partner": "wagon_80t"})):
        scenario = trainmj.load("b_type", {"simulation.step_ms": 0.5} | changes)
        rows = trainmj.run_cases(scenario, {"empty_stroke_mm": table["D_mm"], "mass_t": table["M_t"]})
        assert (table[f"TS_{case}_mm"] == rows["TS_mm"]).all()
        assert (table[f"S_anti_{case}_mm"] == rows["stroke_S1_M1_anti_climber_mm"]).all()
    both = table[["TS_normal_mm", "TS_wagon_mm"]].to_numpy()
    assert (table["TS_mm"] == both.max(axis=1)).all()
    assert table["TS_governed_by"].tolist() == [("normal", "wagon")[k] for k in both.argmax(axis=1)]
    assert set(table["TS_governed_by"]) == {"normal", "wagon"}
    assert "TAMA_wagon_g" not in table
    assert set(table["TAMA_governed_by"]) == {"normal"}


def test_each_case_has_its_own_limits_and_all_outputs_name_the_one_that_governs(several, capsys):
    """Breaks if the limit of all cases is taken where a case states another one."""
    assert [limit.text for limit in several.study.limits] == ["S_anti_normal <= 265 mm", "S_anti_wagon <= 500 mm"]
    rows = {row["response"]: row for row in several.summary["check"]["rows"]}
    assert rows["S_anti_normal"]["kept"]
    assert 265 < rows["S_anti_wagon"]["simulated"] <= 500
    assert rows["S_anti_wagon"]["kept"]
    worst = max(("normal", "wagon"), key=lambda case: rows[f"TS_{case}"]["simulated"])
    assert several.summary["check"]["governing"]["TS"] == rows["TS"]["load_case"] == worst
    assert rows["TS"]["simulated"] == rows[f"TS_{worst}"]["simulated"]
    front = several.tables["05_front_surrogate"]
    assert several.summary["front_on_the_surrogates"]["governing"]["TS"] == dict(front["TS_governed_by"].value_counts())
    print_plan(several.study)
    print_study(several)
    screen = " ".join(capsys.readouterr().out.split())
    assert "wagon b_type (6 vehicles, 198 t) at 25 km/h into wagon_80t" in screen
    assert f"Governed: TS by {worst}, TAMA by normal." in screen
    assert "TS, worst" in screen
    assert f"TS is governed by {several.summary['decision']['chosen']['TS_governed_by']}." in screen
    page = page_of_folder(several.folder).html()
    assert "The limit that is nearest" in page
    assert "TS is governed by" in page


def test_a_design_that_is_best_for_one_case_and_fails_another_is_refused(small_study, tmp_path):
    """Breaks if a study of several cases chooses a design that does not pass one of them."""
    both = run(small(cases={"normal": {}} | FAST), tmp_path / "both")
    best = {key: small_study.summary["decision"]["chosen"][key] for key in ("D_mm", "M_t")}
    scenario = trainmj.load("b_type", {"simulation.step_ms": 0.5})
    values = {"empty_stroke_mm": best["D_mm"], "mass_t": best["M_t"]}
    normal, fast = (
        trainmj.run_cases(scenario, [values | {"speed_km_h": speed}])["stroke_S1_M1_anti_climber_mm"].iloc[0]
        for speed in (25, 26.5)
    )
    assert normal <= 265 < fast
    front = both.tables["05_front_surrogate"]
    assert not ((front["D_mm"] == best["D_mm"]) & (front["M_t"] == best["M_t"])).any()
    assert (front["S_anti_fast_mm"] <= 263).all()  # the margin is 2 mm
    rows = {row["response"]: row for row in both.summary["check"]["rows"]}
    assert rows["S_anti_fast"]["kept"]
    assert both.summary["check"]["governing"]["limits"] == "S_anti_fast <= 265 mm"
    assert rows["TS_normal"]["simulated"] < rows["TS_fast"]["simulated"] == rows["TS"]["simulated"]


@pytest.mark.thorough
def test_going_on_knows_which_case_has_changed(tmp_path):
    """Breaks if a step is taken over from another load case, or one that has not changed is computed again."""
    first = run(small(cases={"normal": {}} | FAST), tmp_path)
    again = run(small(cases={"normal": {}} | FAST), tmp_path)
    assert not again.computed
    assert not again.simulated
    slower = run(small(cases={"normal": {}, "fast": {"set": {"speed_km_h": 26}}}), tmp_path)
    assert "cases.fast.set.speed_km_h 26.5 then, 26 now" in slower.changes
    kept, new = first.tables["02_simulations"], slower.tables["02_simulations"]
    assert (kept["TS_normal_mm"] == new["TS_normal_mm"]).all()
    assert (kept["TS_fast_mm"] > new["TS_fast_mm"]).all()
    assert np.isfinite(new["TS_fast_mm"]).all()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cases": {"wall": {"set": {"collision.partner": "rigid_wal"}}}}, "cases.wall.set.collision.partner"),
        ({"cases": {"other": {"scenario": "b_typ"}}}, "cases.other.scenario = 'b_typ': there is no such file"),
        (
            {"cases": {"normal": {}}, "responses__TAMA": {"column": "TAMA_g", "cases": ["norml"]}},
            "responses.TAMA.cases.norml: there is no load case of this name; did you mean 'normal'?",
        ),
        ({"responses__TAMA": {"column": "TAMA_g", "cases": ["normal"]}}, "there is no load case of this name"),
        (
            {"cases": {"normal": {}, "wagon": {"scenario": "wagon_80t"}}},
            "(in load case wagon)",
        ),
        ({"cases": {"heavy": {"set": {"mass_t": 34}}}}, "is fixed under cases.heavy.set"),
        (
            {"cases": {"a": {"constraints": {"S": {"at_most": 1}}}}},
            "cases.a.constraints.S: there is no response of this name",
        ),
        (
            {
                "cases": {"a": {}, "b": {"constraints": {"TAMA": {"at_most": 1}}}},
                "responses__TAMA": {"column": "TAMA_g", "cases": ["a"]},
            },
            "cases.b.constraints.TAMA: is not asked in this load case",
        ),
        (
            {"cases": {"a": {}}, "responses__TS_a": "TS_mm", "objectives": {"TS_a": "minimise"}},
            "makes a second column 'TS_a_mm'",
        ),
    ],
)
def test_what_does_not_fit_is_refused(changes, said):
    with pytest.raises(trainmj.InputError) as error:
        small(**changes)
    assert said in str(error.value)
