"""Targets files: what they mean, and that each mistake is said with place, value, rule and cure."""

import re
from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter
from twins import plan, rows, scenario, values

from trainmj.errors import InputError
from trainmj.identification import identify, load_targets, tables, targets_of
from trainmj.identification.data import observations, parse_sum
from trainmj.identification.file import DataPart, TableData
from trainmj.identification.plan import Simulated, at_step
from trainmj.scenario import load, save

K = {"sets": "devices.coupler.stiffness_kN_per_mm", "bounds": [20, 400]}
WHOLE = {
    "parameters__f10": None,
    "parameters__f30": None,
    "parameters__b": {"curve": "curves.buffer"},
    "constraints__energy__by": "b",
}
"""The buffer sought as a whole, not point by point."""
TABLE = "D,M,force,stroke\n20,30,1,10\n20,33,2,\n35,30,3,30\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("targets")
    save(scenario(), place / "train.yaml")
    (place / "table.csv").write_text(TABLE)
    (place / "other.csv").write_text("D,M,energy\n35,30,300\n20,30,100\n20,33,200\n")
    (place / "short.csv").write_text("D,M,energy\n35,30,300\n")
    (place / "no_case.csv").write_text("M,energy\n30,300\n")
    (place / "bad.csv").write_text("D,M,force\n20,30,1.5\n20,33,many\n")
    (place / "other_force.csv").write_text("D,M,force\n20,30,1\n20,33,2\n35,30,4\n")
    return place


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scenario": "trian.yaml"}, r"scenario = 'trian.yaml': there is no such file beside it or shipped scenario"),
        ({"scenario": "../train.yaml"}, "must be in the folder of the file that names it"),
        ({"parameter": {}}, "parameter: unknown key; did you mean 'parameters'?"),
        ({"parameters__k__bound": [1, 2]}, "parameters.k.bound: unknown key; did you mean 'bounds'?"),
        ({"parameters__k__bounds": [5]}, "parameters.k.bounds: must have at least 2 entries"),
        ({"parameters__k__bounds": [400, 20]}, "bounds: must be a lower and a higher value: 400 is not below 20"),
        ({"parameters__k__bounds": [0, 400]}, "bounds: must be above 0 on a log scale; the lower one is 0"),
        ({"parameters__k__bounds": [1, float("nan")]}, r"parameters.k.bounds.1 = nan: must be a finite number"),
        ({"parameters__k__start": 900}, "parameters.k.start = 900: must be within the bounds, 20 to 400"),
        ({"parameters__x": K}, "is set by the parameter k too: leave one of them out"),
        (
            {"parameters__k": {**K, "bounds": [1, 2]}},
            "bounds: must include the 80 that the scenario has now: widen them, or state a start",
        ),
        (
            {"parameters__k": {**K, "sets": "devices.coupler.stifness", "start": 80}},
            "k: at the start: .*stifness = 80.0: unknown key",
        ),
        ({"parameters__k__sets": "devices.copler.stiffness_kN_per_mm"}, "did you mean 'coupler'?"),
        (
            {"parameters__k__sets": "curves.buffer.force_kN"},
            "must lead to a number, not to a list: choose one of its 4, as in curves.buffer.force_kN.3",
        ),
        ({"parameters__k__sets": "trains.t.front"}, "must lead to a number, not to 'front'"),
        ({"parameters__f10__sets": "curves.buffer.stroke_mm.1"}, "f10: at the start: .*must be more than"),
        ({"parameters__k__sets": []}, "parameters.k.sets: must have at least 1 entry"),
        ({"parameters__k__sets": [5]}, "parameters.k.sets.0"),
        ({"data__tests__rows": [{"M": [1]}]}, "tests"),
        ({"data__tests__rows": None, "data__tests__table": []}, "data.tests.table: must have at least 1 entry"),
        ({"parameters__k__sets": {"path": "mass_t", "factor": 0}}, "sets.factor = 0: must not be 0"),
        (
            {"parameters__k__sets": {"path": "mass_t"}},
            "set by the parameter ., which is sought: a case cannot",
        ),
        (
            {"parameters__b": {"curve": "curves.bufer"}},
            "must be the path of a curve with points; did you mean 'curves.buffer'",
        ),
        (
            {"parameters__b": {"curve": "devices.coupler.curve"}},
            "must be the path of a curve with points; known: curves.buffer, curves.tube",
        ),
        ({"parameters__b": {"curve": "devices.front.curve.-1"}}, "must be the path of a curve with points"),
        ({"parameters__b": {"curve": 5}}, "parameters.b.curve = 5: must be text"),
        ({"parameters__b": 5}, "parameters.b = 5: must be a group of keys and values"),
        ({"parameters__b": {"curve": "curves.buffer", "slope": 3}}, "unknown key; did you mean 'slopes'"),
        ({"parameters__b": {"curve": "curves.buffer", "slopes": 1}}, "parameters.b.slopes = 1: must be greater than 1"),
        (
            {"parameters__b": {"curve": "curves.tube"}},
            "overlaps curves.tube.force_kN.0, which the parameter tube sets",
        ),
        (
            {
                "parameters__tube": None,
                "parameters__b": {"curve": "curves.tube"},
                "set": {"curves.tube.force_kN.1": 820},
            },
            "curves.tube overlaps curves.tube.force_kN.1, which the key set sets: leave one",
        ),
        (
            WHOLE | {"parameters__c2": {"curve": "curves.buffer"}},
            "parameters.c2.curve = 'curves.buffer': curves.buffer is set by the parameter b too",
        ),
        (
            WHOLE | {"parameters__b_10mm": K, "parameters__k": None},
            "has a force called b_10mm, like another parameter",
        ),
        (WHOLE | {"parameters__tube__above": "b"}, "parameters.tube.above = 'b': is a curve: name a single value"),
        (
            WHOLE | {"set": {"curves.buffer.force_kN.3": 0}},
            "overlaps curves.buffer.force_kN.3, which the key set sets",
        ),
        (
            WHOLE | {"constraints__energy__of": "curves.tube"},
            "by = 'b': is the curve curves.buffer: name a parameter",
        ),
        (
            WHOLE | {"constraints__energy__to_mm": 9},
            "by = 'b': has no point between from_mm and to_mm that could meet the area",
        ),
        (
            WHOLE | {"data__tests__set": {"curves.buffer.force_kN.2": 400}},
            "set by the parameter ., which is sought: a case cannot",
        ),
        ({"parameters__k__sets": {"way": "mass_t"}}, "parameters.k.sets.path: is missing"),
        ({"parameters__f30__above": "f1O"}, "above = 'f1O': there is no parameter of this name; did you mean 'f10'?"),
        ({"parameters__f10__above": "f30"}, "is itself solved from a constraint"),
        ({"parameters__f30__bounds": [150, 390]}, "must reach up to 400, so that there is room above f10"),
        ({"parameters__k__above": "c", "parameters__c__above": "k"}, "leads back to this parameter: break the circle"),
        ({"parameters__k__gap": 3}, "gap = 3: needs above"),
        ({"constraints__energy__by": "f31"}, "by = 'f31': there is no parameter of this name; did you mean 'f30'?"),
        ({"constraints__energy__of": "curves.bufer"}, "must be the path of a curve; did you mean 'curves.buffer'?"),
        ({"constraints__energy__to_mm": 70}, "to_mm = 70: must be within the curve, which ends at 60 mm"),
        ({"constraints__energy__from_mm": 60}, r"to_mm = 60: must be more than from_mm \(60\)"),
        (
            {"constraints__again": {"of": "curves.buffer", "to_mm": 30, "area_kJ": 5, "by": "f30"}},
            "is solved from the constraint energy already",
        ),
        ({"targets__s1__response": "stroke +"}, r"response = 'stroke \+': must be a name, or a sum such as"),
        ({"targets__s1__response": "eval(1)"}, "must be a name, or a sum such as"),
        ({"targets__s1__tolerance": 0}, "targets.s1.tolerance = 0: must be greater than 0"),
        ({"targets__s1__tolerance": "0 %"}, "must be more than 0 %"),
        (
            {"targets__s1__tolerance": "much"},
            "targets.s1.tolerance = 'much': must be a number above 0, .* or a percentage such as 1 %",
        ),
        ({"targets__s1__weight": -1}, "weight = -1: must be at least 0"),
        ({"targets__s9": {"response": "TS_mm", "tolerance": 1}}, "targets.s9: has no values: name it under values"),
        ({"targets__s1": None}, "data.tests.values.s1 = 's1': there is no target of this name"),
        ({"data__tests__rows": None}, "data.tests: needs table, or rows, or channels and time"),
        ({"data__tests__table": "a.csv"}, "data.tests.rows: does not go with table: leave one of them out"),
        ({"parameters__k": {"bounds": [1, 2]}}, "parameters.k: needs sets, curve or offset"),
        (
            {"parameters__k__curve": "curves.tube"},
            "k.curve = 'curves.tube': does not go with sets: leave one",
        ),
        ({"data__tests__cases__M": "mas_t"}, "data.tests.cases.M = 'mas_t'.*did you mean 'mass_t'?"),
        ({"data__tests__cases__Q": "mass_t"}, "data.tests: cases: there is no column 'Q'"),
        ({"data__tests__values__s1": "s_1"}, r"values.s1 = 's_1': there is no column 's_1'; did you mean 's1'?"),
        ({"data__tests__set": {"mass_t": 33}}, "is set by a column of cases too"),
        ({"data__tests__set": {"devices.coupler.stiffness_kN_per_mm": 33}}, "a case cannot set it too"),
        ({"data__tests__where": {"M": 31}}, "where.M: no row has the value 31"),
        ({"data__tests__leave_out": {"W": 31}}, "leave_out: there is no column 'W'"),
        ({"set": {"devices.coupler.stiffness_kN_per_mm": 70}}, "is set by the key set too: leave one of them out"),
        ({"set": {"simulation.step_ms": -1}}, "set.simulation.step_ms = -1: .*must be at least"),
        ({"method__seed": -1}, "method.seed = -1: must be at least 0"),
        ({"method__explore__step_ms": 5}, "step_ms = 5: must be at most 2"),
        ({"method__refin": {}}, "method.refin: unknown key; did you mean 'refine'?"),
        ({"held_out__tests": {"rows": [{"s1": 1}], "values": {"s1": "s1"}}}, "is the name of an entry in data"),
    ],
)
def test_mistakes_are_said(folder, changes, message):
    with pytest.raises(InputError) as error:
        targets_of(values(**changes), folder)
    assert re.search(message, str(error.value)), str(error.value)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"table": "tabel.csv"}, "there is no such file beside it; did you mean 'table.csv'?"),
        ({"table": "table3_devices_vs_D"}, "there is no such file beside it; known: bad.csv"),  # it ships, elsewhere
        ({"table": "../table.csv"}, "must be in the folder"),
        ({"table": ["table.csv", "short.csv"]}, "has no row for the case D = 20, M = 30"),
        ({"table": ["table.csv", "no_case.csv"]}, "has no column 'D', by which tables are joined"),
        ({"table": "bad.csv", "values": {"s": "force"}}, "row 2: force = 'many': must be a number"),
        (
            {"table": ["table.csv", "other_force.csv"], "values": {"s": "force"}},
            "column 'force' has other values in a table before it",
        ),
        ({"rows": [{"D": 20, "M": None, "force": 1}], "values": {"s": "force"}}, "row 1: M: is empty"),
        ({"rows": [{"D": 20, "M": [1], "force": 1}], "values": {"s": "force"}}, "row 1: M: must be a number or text"),
        (
            {"rows": [{"D": 20, "M": "=1+1", "force": 1}], "values": {"s": "force"}},
            "must not begin like a spreadsheet formula",
        ),
        ({"rows": [{"D": 20, "M": 10**400, "force": 1}], "values": {"s": "force"}}, "row 1: M: must be a number"),
        ({"rows": [{"D": 20, "M": 1, "force": 10**400}], "values": {"s": "force"}}, "force = 1000.*: must be a number"),
        ({"rows": [{"D": 20, "M": 1, "force": True}], "values": {"s": "force"}}, "force = True: must be a number"),
        ({"table": "table.csv", "where": {"D": 10**400}}, "where.D: no row has the value"),
        ({"rows": [{"D": 20, "M": 1, "force": None}], "values": {"s": "force"}}, "has no values"),
    ],
)
def test_mistakes_in_tables_are_said(folder, part, message):
    given = {"cases": {"D": "empty_stroke_mm", "M": "mass_t"}, "values": {"s": "stroke"}} | part
    with pytest.raises(InputError, match=message):
        observations("x", TypeAdapter(DataPart).validate_python(given), folder)


def test_tables_are_joined_and_chosen_by_their_cases(folder):
    part = TableData(
        table=["table.csv", "other.csv"],
        cases={"D": "empty_stroke_mm", "M": "mass_t"},
        values={"e": "energy - 10 * force", "s": "stroke"},
        leave_out={"M": 33, "D": 20},
    )
    found = [
        (o.target, o.case["empty_stroke_mm"], o.case["mass_t"], o.wanted) for o in observations("x", part, folder)[0]
    ]
    assert found == [("e", 20, 30, 90.0), ("s", 20, 30, 10.0), ("e", 35, 30, 270.0), ("s", 35, 30, 30.0)]


def test_an_empty_cell_is_no_value(folder):
    part = TableData(table="table.csv", cases={"D": "a", "M": "b"}, values={"s": "stroke"})
    assert [o.wanted for o in observations("x", part, folder)[0]] == [10.0, 30.0]


def test_rows_are_taken_by_a_list_of_values(folder):
    part = TableData(table="table.csv", where={"M": [33], "D": [20, 35]}, values={"f": "force"})
    assert [o.wanted for o in observations("x", part, folder)[0]] == [2]


@pytest.mark.parametrize(
    ("text", "terms"),
    [
        ("TS_mm", {"TS_mm": 1}),
        ("a - b", {"a": 1, "b": -1}),
        (" -2*a+ 0.5 *b - a ", {"a": -3, "b": 0.5}),
        ("1e-3 * a", {"a": 0.001}),
    ],
)
def test_sums(text, terms):
    assert parse_sum(text) == terms


@pytest.mark.parametrize(
    "text",
    ["a - a", "0 * a", "", "a b", "a *", "2", "a--b", "a/b", "a()", "__import__('os')", "+" * 9, "a" + "+a" * 60],
)
def test_what_is_no_sum(text):
    with pytest.raises(InputError):
        parse_sum(text)


def test_a_column_may_have_any_name():
    assert parse_sum("Force [kN]", ["Force [kN]"]) == {"Force [kN]": 1.0}


def test_tolerances_and_bars_are_in_units_or_percent(tmp_path):
    given = values(
        targets__s1__tolerance=2,
        targets__s12__bars={"each": "2 %"},
        targets__s23__weight=0.5,
        targets__e12__tolerance="2%",
    )
    sample = plan(tmp_path, given).fitted
    of = {name: np.array([o.target == name for o in sample.observations]) for name in ("s1", "s12", "s23", "e12")}
    assert (sample.tolerance[of["s1"]] == 2).all()
    np.testing.assert_allclose(sample.tolerance[of["e12"]], 0.02 * sample.wanted[of["e12"]])
    np.testing.assert_allclose(sample.bar[of["s12"]], 0.02 * sample.wanted[of["s12"]])
    assert np.isinf(sample.bar[of["s1"]]).all()
    assert (sample.weight[of["s23"]] == 0.5).all()


def test_equal_cases_of_several_tables_are_simulated_once(tmp_path):
    given = values()
    given["data"]["more"] = given["data"]["tests"] | {"rows": rows()[:2], "values": {"s1": "s1"}}
    mine = plan(tmp_path, given)
    assert len(mine.fitted.cases) == 5
    assert len(mine.fitted) == 8 * 5 + 2


def test_a_response_that_does_not_exist_is_said_before_the_search(tmp_path):
    with pytest.raises(
        InputError, match=r"targets.s1.response = 'stroke_S1_M1': there is no response.*'stroke_S1_M1_mm'"
    ):
        plan(tmp_path, values(targets__s1__response="stroke_S1_M1"))


def shorter(**changes):
    """Targets of which one is of an interface that the shorter of two trains does not have."""
    given = values(constraints={}, method={"explore": {"trials": 0}, "refine": {"iterations": 1}}, **changes)
    short = [{"n": 2, "s12": 100.0}]
    given["data"]["short"] = {"rows": short, "cases": {"n": "trains.t.vehicles"}, "values": {"s12": "s12"}}
    return given


def test_a_response_that_a_case_lacks_and_no_value_asks_for_is_no_mistake(tmp_path):
    """Breaks if data of trains of different length cannot be used together, or one empties the other's values."""
    mine = plan(tmp_path, shorter())
    found = identify(mine, tmp_path / "out", figures=())
    assert np.isfinite(found.residuals["found"]).all()
    assert found.fit["without_number"].tolist() == [0] * len(mine.targets)
    lacking = shorter()
    lacking["data"]["short"]["rows"][0]["s23"] = 5.0
    lacking["data"]["short"]["values"]["s23"] = "s23"
    with pytest.raises(
        InputError, match=r"targets\.s23\.response.*there is no response 'stroke_M2_M3_mm' in the case .*: 2"
    ):
        plan(tmp_path, lacking)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"set": {"simulation.record_every_ms": 5}},
            r"targets\.c\.response = 'peak_device_M1_g - 2 \* cfc60_peak_M1_g': cfc60.*at most 1\.6",
        ),
        (
            {"data__tests__set": {"simulation.record_every_ms": 2}},
            r"targets\.c\.response.*record_every_ms = 2.*in the case",
        ),
        ({"method__explore__step_ms": 2}, r"method\.explore\.step_ms = 2: targets\.c: cfc60_peak_M1_g is not a number"),
        (
            {"method__refine__step_ms": 1.9, "parameters__c__bounds": [20, 20000], "parameters__c__start": 20000},
            r"method\.refine\.step_ms = 1\.9: at the start values, in the case .*must be at most",
        ),
    ],
)
def test_a_response_without_a_number_is_refused_before_anything_is_computed(tmp_path, change, said):
    """Breaks if a search goes through trials of which none can ever be compared with what is wanted."""
    given = values(**change)
    given["targets"]["c"] = {"response": "peak_device_M1_g - 2 * cfc60_peak_M1_g", "tolerance": 1}
    given["data"]["tests"]["values"]["c"] = "s1"
    with pytest.raises(InputError, match=said):
        plan(tmp_path, given)


def test_a_value_without_a_number_stays_by_itself_and_is_said(tmp_path):
    """Breaks if one target that comes to no number in a case takes the numbers of others with it, or goes unsaid."""
    mine = plan(tmp_path, values(method={"explore": {"trials": 0}, "refine": {"iterations": 0}}))
    found = identify(mine, tmp_path / "out", figures=())
    responses = np.ones((len(mine.fitted.cases), len(mine.columns)))
    responses[1, mine.columns.index("stroke_S1_M1_mm")] = np.nan
    (lost,) = mine.found(mine.fitted, Simulated(responses[None], []), [found.point])
    of = [(mine.targets[k].name, case) for k, case in zip(mine.fitted.target, mine.fitted.case, strict=True)]
    assert {of[n] for n in np.flatnonzero(np.isnan(lost))} == {("s1", 1), ("both", 1)}, (
        "both is TS_mm - stroke_S1_M1_mm"
    )
    partly = replace(found, samples={"fitted": (mine.fitted, lost)})
    fit = partly.fit.set_index("target")
    assert fit["without_number"].to_dict() == {name: int(name in ("s1", "both")) for name in fit.index}
    assert fit["rms"].isna().to_dict() == {name: name in ("s1", "both") for name in fit.index}
    assert "end too early: s1 (1), both (1)." in tables.fit(partly, "fitted").note
    assert "too early" not in tables.fit(found, "fitted").note


def test_a_response_is_no_sum_of_different_units(tmp_path):
    """Breaks if millimetres and g are added, and the sum is compared with a number of one of them."""
    save(scenario(), tmp_path / "train.yaml")
    (name, target), *_ = values()["targets"].items()
    mixed = f"{target['response']} - duration_s"
    with pytest.raises(InputError, match=r"adds duration_s in s to a response in \w+"):
        targets_of(values(**{f"targets__{name}__response": mixed}), tmp_path)


def test_start_values_that_cannot_be_simulated_are_refused(tmp_path):
    given = values(parameters__c__bounds=[20, 1e5], parameters__c__start=1e5)
    with pytest.raises(InputError, match=r"start values, the case .*step_ms = 0.5: must be at most"):
        plan(tmp_path, given)


def test_files_of_other_kinds_are_told_apart():
    with pytest.raises(InputError, match="is not a targets file, which states scenario, parameters"):
        load_targets("scenarios/b_type.yaml")
    with pytest.raises(InputError, match="there is no such file or shipped targets file; did you mean 'b_type'"):
        load_targets("b_typ")


@pytest.mark.parametrize("name", ["b_type", "b_type_s08"])
def test_the_shipped_files_are_right(name):
    mine = load_targets(name)
    assert len(mine.fitted.cases) == 17
    fitted = {(o.target, tuple(o.case.values())) for o in mine.fitted.observations}
    assert len(fitted) == len(mine.fitted)  # none counts twice
    assert sum(o.target.startswith("a_M") for o in mine.fitted.observations) == 102
    held_out = {o.data for o in mine.held_out.observations}
    assert {"table_9", "table_13"} <= held_out


@pytest.mark.thorough
def test_both_laws_of_the_b_type_train_are_held_against_the_same_values():
    """Breaks if one of the two shipped targets files is given other data than its sibling."""
    one, other = (load_targets(name) for name in ("b_type", "b_type_s08"))
    tables = [[(o.data, o.target, o.wanted) for o in mine.fitted.observations] for mine in (one, other)]
    assert tables[0] == tables[1]
    (stiffness,) = (p for p in other.unknowns.parameters if p.name == "stiffness")
    assert len(stiffness.settings) == 3, "one K for all devices"


def test_a_coarser_step_of_the_search_keeps_the_window_of_means():
    """Or comes as near as its steps allow; breaks if a search with another step is refused or averages otherwise."""
    case = load("b_type_s08")
    assert at_step(case, 0.1)["simulation.averaging_ms"] == pytest.approx(3.8)
    coarse = case.with_values(at_step(case, 0.25))
    assert coarse.simulation.averaging_ms == pytest.approx(3.75)
    assert "simulation.averaging_ms" not in at_step(load("b_type"), 0.25)
