"""Twin experiments: responses made from known parameters give the parameters back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import t
from twins import AREA_KJ, CASES, KNOWN, plan, rows, scenario, values

from trainmj import run_cases
from trainmj.collision.lineup import line_up
from trainmj.collision.status import FAILED
from trainmj.identification import Found, identify, targets_of
from trainmj.identification.file import SetPart
from trainmj.identification.page import page_of
from trainmj.identification.screen import print_found
from trainmj.identification.sought import Unknown
from trainmj.identification.uncertainty import Uncertainty, uncertainty
from trainmj.identification.unknowns import Unknowns
from trainmj.scenario import Scenario, load, save


def found_by(folder: Path, given: dict[str, Any]) -> Found:
    return identify(plan(folder, given), folder / "out", threads=1, figures=())


def test_known_parameters_come_back(tmp_path):
    found = found_by(tmp_path, values(data__tests__rows=rows(cases=CASES[:3])))
    for name, value in zip(found.plan.unknowns.names, found.point.value, strict=True):
        assert value == pytest.approx(KNOWN[name], rel=2e-3), name
    assert found.residuals["deviation_percent"].abs().max() < 0.1
    assert found.residuals["within"].all()
    (constraint,) = found.summary["constraints"]
    assert constraint["met"]
    assert constraint["found_kJ"] == pytest.approx(AREA_KJ, rel=1e-5)


@pytest.mark.thorough
def test_a_curve_sought_whole_comes_back_from_a_cold_start(tmp_path):
    """From the middle of all bounds, the energy known: the forces by which the responses were made."""
    given = values(
        data__tests__rows=rows(cases=CASES[:3]),
        parameters__f10=None,
        parameters__f30=None,
        parameters__buffer={"curve": "curves.buffer"},
        constraints__energy__by="buffer",
        method__explore={
            "trials": 60,
            "searches": 2,
            "start": "middle",
            "spread": 0.15,
            "slope_ratio": 3,
            "cases": 3,
        },
        method__refine={"iterations": 12},
    )
    found = found_by(tmp_path, given)
    forces = dict(zip(found.plan.unknowns.names, found.point.value, strict=True))
    assert forces["buffer_10mm"] == pytest.approx(KNOWN["f10"], rel=2e-3)
    assert forces["buffer_30mm"] == pytest.approx(KNOWN["f30"], rel=2e-3)
    assert found.scenario.curves["buffer"].force_kN[0] == 0
    assert found.scenario.curves["buffer"].force_kN[-1] == 600
    remarks = found.parameters.set_index("parameter")["remark"]
    assert remarks["buffer_30mm"] == "solved from energy"
    assert found.parameters["high_95"].notna().all()


EVERY_KIND: dict[str, Any] = {
    "curves": {"load": {"stroke_mm": [0, 20, 50, 90], "force_kN": [50, 250, 500, 1000]}},
    "devices": {
        "front": {
            "kind": "hydraulic",
            "stroke_mm": 400,
            "orifice_kN_s2_per_m2": 150,
            "beyond": {"kind": "stop", "stiffness_kN_per_mm": 50},
        },
        "gear": {
            "kind": "hysteresis",
            "loading": "load",
            "unloading": {"stroke_mm": [0, 90], "force_kN": [10, 200]},
            "transition_stiffness_kN_per_mm": 200,
            "beyond": {"kind": "stop"},
        },
        "tube": {
            "curve": {"stroke_mm": [0, 1, 500], "force_kN": [0, 400, 400]},
            "stiffness_kN_per_mm": 200,
            "rate": {"C_m_per_s": 20, "P": 5},
            "beyond": "hold",
        },
    },
    "trains": {
        "t": {"vehicles": 3, "mass_t": 30, "front": "front", "coupler": "gear"},
        "struck": {"vehicles": 1, "mass_t": 40, "front": "tube", "brakes": {"force_kN": 40}},
    },
    "collision": {"train": "t", "speed_km_h": 14, "partner": "struck"},
    "simulation": {"step_ms": 0.2, "time_limit_s": 0.5},
}
"""A train with an oil buffer and friction gears runs into a braked vehicle whose tube is stronger when it is quick."""


@pytest.mark.thorough
def test_values_of_devices_of_every_kind_come_back(tmp_path):
    """Breaks if an orifice, a loading curve, a rate or a brake cannot be sought by its path."""
    known = {"orifice": 150.0, "C": 20.0, "brake": 40.0, "load_20mm": 250.0, "load_50mm": 500.0}
    responses = [
        "stroke_S1_M1_mm",
        "stroke_S1_M1_partner_mm",
        "stroke_M1_M2_mm",
        "energy_M1_M2_kJ",
        "stroke_M2_M3_mm",
        "peak_device_M2_g",
        "peak_device_M3_g",
        "final_speed_S1_km_h",
        "final_speed_M1_km_h",
    ]
    cases = [{"collision.speed_km_h": speed} for speed in (8.0, 11.0, 14.0)]
    table = run_cases(Scenario.from_values(EVERY_KIND), cases, threads=1).to_dict("records")
    assert all(row["status"] not in FAILED for row in table)
    given = {
        "scenario": "every.yaml",
        "parameters": {
            "orifice": {"sets": "devices.front.orifice_kN_s2_per_m2", "bounds": [50, 400], "start": 100},
            "C": {"sets": "devices.tube.rate.C_m_per_s", "bounds": [5, 80], "start": 40, "scale": "log"},
            "brake": {"sets": "trains.struck.brakes.force_kN", "bounds": [0, 100], "start": 20},
            "load": {"curve": "curves.load"},
        },
        "targets": {f"t{k}": {"response": name, "tolerance": "1 %"} for k, name in enumerate(responses)},
        "data": {
            "tests": {
                "rows": table,
                "cases": {"collision.speed_km_h": "collision.speed_km_h"},
                "values": {f"t{k}": name for k, name in enumerate(responses)},
            }
        },
        "method": {"seed": 1, "explore": {"trials": 60, "start": "middle"}, "refine": {"iterations": 20}},
    }
    save(Scenario.from_values(EVERY_KIND), tmp_path / "every.yaml")
    found = identify(targets_of(given, tmp_path), tmp_path / "out", threads=1, figures=())
    for name, value in zip(found.plan.unknowns.names, found.point.value, strict=True):
        assert value == pytest.approx(known[name], rel=5e-3), name
    unit = {p.name: p.unit for p in found.plan.unknowns.parameters}
    assert unit["orifice"] == "kN s2/m2"


@pytest.mark.thorough
def test_the_scenario_written_is_the_one_reported(tmp_path):
    """trainmj run found.yaml gives what the tables of the identification say."""
    found = found_by(tmp_path, values(method__refine={"iterations": 2}))
    read = load(tmp_path / "out" / "found.yaml")
    for mine, theirs in zip(line_up(read).interfaces, line_up(found.scenario).interfaces, strict=True):
        assert all(one.is_like(other) for one, other in zip(mine.devices, theirs.devices, strict=True))
    cases = found.residuals[found.residuals["target"] == "s12"]
    again = run_cases(read, cases[["mass_t", "speed_km_h"]], threads=1)
    np.testing.assert_array_equal(again["stroke_M1_M2_mm"], cases["found"])


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2])
def test_known_parameters_lie_in_the_intervals_of_scattered_responses(tmp_path, seed):
    """Responses scattered by the tolerance that is stated: the misfit says so, and so do the intervals."""
    given = values(
        data__tests__rows=rows(scatter=0.01, seed=seed), method__explore__trials=0, method__refine__iterations=12
    )
    found = found_by(tmp_path, given)
    assert 0.4 < found.known.chi2 < 1.8  # 36 degrees of freedom: 0.4 to 1.8 holds for 99.9 % of all seeds
    inside = [row["low_95"] <= KNOWN[row["parameter"]] <= row["high_95"] for row in found.parameters.to_dict("records")]
    assert all(inside), found.parameters
    widths = (found.parameters["high_95"] - found.parameters["low_95"]) / found.parameters["value"]
    assert widths.max() < 0.5  # and they are not so wide as to say nothing


def test_what_the_data_do_not_determine_is_named(tmp_path):
    """The tube's curve ends far behind the largest stroke: no response knows where."""
    given = values(
        parameters__end={"sets": "curves.tube.stroke_mm.3", "bounds": [800, 1000], "start": 900},
        **{f"parameters__{name}__start": KNOWN[name] for name in ("k", "c", "tube", "f10")},
        method__explore__trials=0,
        method__refine__iterations=0,
    )
    found = found_by(tmp_path, given)
    assert found.summary["not_determined"] == ["end alone"]
    assert found.directions["deviation_percent"][0] == np.inf
    remarks = found.parameters.set_index("parameter")["remark"]
    assert remarks["end"] == "not determined"
    assert remarks["k"] == ""
    assert remarks["f30"] == "solved from energy"


def test_the_standard_errors_are_those_of_a_linear_model():
    """Against the textbook covariance, on the derivatives themselves."""
    design = np.random.default_rng(0).normal(size=(30, 3))
    truth = np.array([2.0, 5.0, 7.0])
    noise = np.random.default_rng(1).normal(size=30) * 3.0

    class Straight:
        """A misfit that is linear in the parameters."""

        class plan:
            class fitted:
                weight = share = np.ones(30)

            unknowns = Unknowns(
                scenario(),
                tuple(Unknown(n, "", 0.0, 10.0 * (k + 1), 1.0, (SetPart(path=f"p{k}"),)) for k, n in enumerate("abc")),
                (),
            )

        def of_points(self, points):
            return np.array([design @ (p.value - truth) - noise for p in points])

    best = truth + np.linalg.lstsq(design, noise)[0]
    known = uncertainty(Straight(), Straight.plan.unknowns.solved(best), 1e-3)
    chi2 = np.sum((design @ (best - truth) - noise) ** 2) / 27
    covariance = chi2 * np.linalg.inv(design.T @ design)  # chi2 is about 9: tolerances were too narrow
    assert known.chi2 == pytest.approx(chi2)
    np.testing.assert_allclose(known.error, np.sqrt(np.diag(covariance)), rtol=1e-6)
    errors = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    np.testing.assert_allclose(known.correlation, covariance / errors, atol=1e-6)
    np.testing.assert_allclose(known.upper - best, t.ppf(0.975, 27) * known.error, rtol=1e-6)


def linear(design: np.ndarray, best: np.ndarray, upper: float = 100.0) -> Uncertainty:
    """What is known of parameters a, b, .. in [0, upper] that a linear misfit of this design has at its best."""
    n, m = design.shape

    class Straight:
        """A misfit that is linear in the parameters, with the scatter that its tolerances state."""

        class plan:
            class fitted:
                weight = share = np.ones(n)

            unknowns = Unknowns(
                scenario(), tuple(Unknown(c, "", 0.0, upper, 1.0, (SetPart(path=c),)) for c in "abcdef"[:m]), ()
            )

        def of_points(self, points):
            noise = np.where(np.arange(n) % 2, 1.0, -1.0)
            return np.array([design @ (p.value - best) + noise for p in points])

    return uncertainty(Straight(), Straight.plan.unknowns.solved(best), 1e-3)


@pytest.mark.parametrize(("r", "tied"), [(-0.98, True), (0.96, True), (0.94, False), (-0.5, False)])
def test_parameters_whose_errors_correlate_are_not_determined_each(r, tied):
    """Breaks if a card counts two parameters of which the data know only a combination, however small their errors."""
    root = np.linalg.cholesky(np.linalg.inv([[1.0, r, 0], [r, 1.0, 0], [0, 0, 1.0]]))
    known = linear(np.kron(root.T, np.ones((10, 1))), np.array([40.0, 60.0, 50.0]))
    assert known.correlation[0, 1] == pytest.approx(r, abs=1e-6)
    assert known.tied == (((1,), (0,), ()) if tied else ((), (), ()))
    assert known.determined == (not tied, not tied, True)
    assert known.standing["only together"] == 2 * tied


def test_a_parameter_at_its_bound_is_not_determined():
    """Breaks if the bounds of a search pass for what the data say."""
    known = linear(np.kron(np.eye(3), np.ones((10, 1))), np.array([100.0, 0.05, 50.0]))
    assert known.at_bound == ("upper", "lower", "")
    assert known.determined == (False, False, True)
    assert known.standing == {"determined": 1, "at a bound": 2, "only together": 0, "open": 0}


@pytest.mark.thorough
def test_terminal_page_and_files_count_only_what_the_data_determine(tmp_path, capsys):
    """The known stiffness is 80: with bounds from 100 it ends at the lower one, and no count may include it."""
    given = values(
        parameters__k__bounds=[100, 400],
        **{f"parameters__{name}__start": KNOWN[name] for name in ("c", "tube", "f10")},
        method__explore__trials=0,
        method__refine__iterations=12,
    )
    found = found_by(tmp_path, given)
    assert found.summary["at_bounds"] == ["k"]
    assert "k" not in found.summary["determined"]
    rows_of = found.parameters.set_index("parameter")
    assert not rows_of["determined"]["k"]
    assert rows_of["remark"]["k"] == "at its lower bound"
    n = len(found.summary["determined"])
    assert n == found.known.standing["determined"] == rows_of["determined"].sum() < 5
    print_found(found)
    page = page_of(found).html()
    screen = " ".join(capsys.readouterr().out.split())
    assert f"Determined by the data: {n} of 5 parameters" in screen
    assert f"{n} of 5" in page
    for said in (screen, page):
        assert "1 at a bound" in said
        assert "only while parameters at a bound are held there" in said
        assert "where the bounds put it and not the data" in said
