"""What measures speed: processes that do as they are asked, and what is made of their times."""

from __future__ import annotations

import importlib
import json
from types import ModuleType

import pytest
from pages import ROOT


@pytest.fixture
def module(monkeypatch):
    """Gives a module of the folder benchmarks by name."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module


@pytest.fixture
def performance(module) -> ModuleType:
    return module("performance")


def test_competitors_take_turns_and_the_first_one_does_not_count(module):
    done: list[str] = []

    def compete(name: str) -> dict[str, float]:
        done.append(name)
        return {"wall": float(len(done))}

    turns = module("turns")
    found = turns.alternate({name: lambda name=name: compete(name) for name in "ab"}, 2)
    assert done == ["b", "a", "a", "b", "b", "a"]
    assert found == {"a": [{"wall": 3.0}, {"wall": 6.0}], "b": [{"wall": 4.0}, {"wall": 5.0}]}
    assert turns.medians(found["a"]) == {"wall": 4.5}


def test_a_ratio_is_the_median_of_those_of_the_turns(module):
    """Breaks if a turn that was slow for both counts as a gain of one."""
    above, below = ([{"wall": wall, "cpu": 3} for wall in walls] for walls in ([2, 40, 3], [1, 20, 1]))
    assert module("turns").ratio(above, below) == {"value": 2, "from": 2, "to": 3, "cpu": 1}


def test_errors_are_those_of_the_worst_case_and_interface(performance):
    exact = {"TS_mm": [100, 200], "TAMA_g": [1, 2], "stroke_mm": [[1, 2], [3, 4]], "force_kN": [[10, 0], [10, 10]]}
    found = {"TS_mm": [100, 198], "TAMA_g": [1.05, 2], "stroke_mm": [[1, 2], [3, 4.5]], "force_kN": [[10, 0], [8, 10]]}
    off = {"TS_percent": 1.0, "TAMA_percent": 5.0, "stroke_mm": 0.5, "force_percent": 20.0}
    assert performance.errors(found, exact) == pytest.approx(off)


def test_more_threads_gain_until_the_lock_is_always_taken(performance):
    """Two cases are exact: all of the time with the lock, and next to none of it."""
    assert performance.more_threads(1.0, 0.0)["threads"]["8"] == pytest.approx({"demand": 8, "gain": 1})
    assert performance.more_threads(1e-9, 1.0)["threads"]["8"] == pytest.approx({"demand": 0, "gain": 8}, abs=1e-6)
    found = performance.more_threads(1.0, 9.0)
    assert found["full_at_threads"] == 10
    gains = [one["gain"] for one in found["threads"].values()]
    assert gains == sorted(gains)
    assert gains[0] == pytest.approx(10 * 20 / 101)  # of 2, by the balance of three states
    assert gains[-1] == pytest.approx(10, rel=1e-6)


@pytest.mark.thorough
def test_a_process_measures_a_sweep_mujoco_and_the_loop(module):
    """Breaks if a piece of work of the benchmark does not run, or the bare loop computes something else."""
    turns = module("turns")
    vary = {"speed_km_h": [20, 25]}
    asked = {"scenario": "b_type", "vary": vary, "changes": {"simulation.step_ms": 0.5}}
    with turns.Worker(turns.ROOT) as worker:
        swept = worker("sweep", **asked)
        assert swept["cases"] == 2
        assert 0 < swept["mujoco"] < swept["cpu"]
        assert 2000 < swept["steps"] < 4000
        assert worker("bare", steps=swept["steps"], threads=1)["cpu"] > 0
        found = worker("outcomes", **asked)
        loop = worker("loop", scenario="b_type", vary=vary, steps_ms=[0.01], seconds=0.9)["0.01"]
        assert loop["TS_mm"] == pytest.approx(found["TS_mm"], rel=1e-4)
        assert "at most" in worker("outcomes", **asked | {"changes": {"simulation.step_ms": 1}})["refused"]


def test_a_page_that_lacks_a_table_is_not_printed(module):
    """Breaks if a table that is measured is shown nowhere, or the page keeps one that is not measured any more."""
    tables = module("tables")
    page, figures = tables.PAGE.read_text(encoding="utf-8"), json.loads(tables.FIGURES.read_text(encoding="utf-8"))
    for other in (page.replace("<!-- speed -->", ""), page.replace("<!-- speed -->", "<!-- pace -->")):
        with pytest.raises(ValueError, match="has places for"):
            tables.printed(other, figures)


def test_a_number_has_the_digits_that_it_needs(module):
    assert [module("tables")._n(x) for x in (1, 0.95, 12.345, 1234.5, 0.01234, 0, None)] == [
        "1.00", "0.950", "12.3", "1234", "0.0123", "0.00", "",
    ]  # fmt: skip
