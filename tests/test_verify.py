"""The verification that users run: that it can fail, what it prints, and that its oracle is itself right."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from builders import few, values
from click.testing import CliRunner

from trainmj.cli import main
from trainmj.errors import EngineError
from trainmj.paper import analysis
from trainmj.paper.bars import FROM_PRINT, HELD_OUT, IDENTIFIED, MISSED
from trainmj.scenario import load
from trainmj.verification import closed_forms, oracle, oracles, published, suite, symmetries
from trainmj.verification.check import Check, Kind, furthest
from trainmj.verification.oracle import solve


def never():
    raise EngineError("the law <b>did not</b> run")
    yield


@pytest.fixture
def short(monkeypatch) -> None:
    """A suite of three cases, one of which cannot be computed."""
    monkeypatch.setattr(
        suite,
        "GROUPS",
        (
            suite.Group("Good", "What holds.", (closed_forms.standing, symmetries.mirror)),
            suite.Group("Bad", "What does not.", (never,)),
        ),
    )


# checks


@pytest.mark.parametrize(
    ("kind", "found", "passed"),
    [
        (Kind.RELATIVE, 10.09, True),
        (Kind.RELATIVE, 10.11, False),
        (Kind.ABSOLUTE, 9.991, True),
        (Kind.ABSOLUTE, 9.98, False),
        (Kind.AT_LEAST, 9.995, True),
        (Kind.AT_LEAST, 9.98, False),
        (Kind.AT_LEAST, 99.0, True),
        (Kind.RELATIVE, np.nan, False),
        (Kind.AT_LEAST, np.inf, False),
    ],
)
def test_tolerance(kind, found, passed):
    assert Check("case", "what", 10.0, found, 0.01, kind).passed is passed


def test_furthest_sees_the_worst_place_and_a_wrong_shape():
    assert furthest([1.0, 2.2, 0.0], [1.0, 2.0, 0.0]) == pytest.approx(0.1)
    assert furthest([1.0, 2.0], [1.0, 2.5], 10.0) == pytest.approx(0.05)
    assert np.isnan(furthest([1.0], [1.0, 2.0]))
    assert np.isnan(furthest([np.nan, 1.0], [1.0, 1.0]))


# the oracle


def test_independent_solution_of_a_spring_against_a_wall():
    found = solve(values([(0, 0), (50, 50_000)], 1.0, mass_t=[1.0]), 0.2)
    front = found.interfaces["M1-wall"]
    assert front.stroke == pytest.approx(0.031622777, rel=1e-6)
    assert front.force == pytest.approx(31_622.777, rel=1e-6)
    assert found.speed["M1"] == pytest.approx(-1.0, rel=1e-8)


def test_independent_solution_of_ideal_plasticity_and_of_coasting():
    case = values([(0, 0), (10, 800), (1000, 800)], 80, partner="t", speed_m_s=3.0, collision={"gap_mm": 50})
    found = solve(case, 0.3)
    assert found.interfaces["S1-M1"].stroke == pytest.approx(0.1028125, rel=1e-7)
    assert found.speed["S1"] - found.speed["M1"] == pytest.approx(0.984732, rel=1e-6)
    mu, v = 0.2, 1.0
    rolls = values([(0, 0), (10, 800)], 80, collision={"gap_mm": 10_000, "rail_friction": mu})
    assert solve(rolls, 2 * v / (mu * 9.80665)).speed["M1"] == 0.0


@pytest.mark.parametrize("change", few([{"stiffness_kN_per_mm": 0.8}, {"damping_kN_s_per_m": 0.1}, {}], 1))
def test_a_law_that_is_a_little_off_is_seen(change, monkeypatch):
    """The independent solution of slightly other devices must not pass for the same collision; that of the same must.

    Of trains of two vehicles, which have a device of each kind of the standard ones.
    """
    two = {"trains.b_type.vehicles": [{"name": "Tc", "coupler": "coupler_a_b"}, {"name": "Mp"}]}

    def other(values, until):
        for name, factor in change.items():
            for device in values["devices"].values():
                device[name] *= factor
        return solve(values, until)

    monkeypatch.setattr(oracles, "solve", other)
    monkeypatch.setattr(oracles, "load", lambda name, changes: load(name, changes | two))
    monkeypatch.setattr(oracles, "FINE_STEP_MS", 0.005)
    assert bool([c for c in oracles.standard_by_scipy() if not c.passed]) is bool(change)


def test_the_oracle_uses_nothing_of_what_it_is_to_check():
    """It imports no code of collisions and scenarios, and so takes neither their laws nor what they make of a file."""
    for file in Path(oracle.__file__).parent.glob("*.py"):
        taken = re.findall(r"^\s*(?:from|import) (trainmj[\w.]*)", file.read_text(), flags=re.MULTILINE)
        assert {name for name in taken if not name.startswith("trainmj.verification.oracle")} <= {"trainmj.errors"}


def test_the_step_is_not_used_by_the_oracle():
    case = load("b_type_wall").values()
    a, b = (solve({**case, "simulation": {"step_ms": step}}, 0.05) for step in (0.1, 10.0))
    assert a.interfaces == b.interfaces


# the suite


def test_a_case_that_cannot_be_computed_fails_and_the_others_go_on(short):
    found = suite.verify()
    assert not found.passed
    assert len(found.failed) == 1
    assert "the law <b>did not</b> run" in found.failed[0].what
    assert len(found.checks) == 8


def test_published_numbers_need_no_study(monkeypatch):
    def called(*_, **__):
        raise AssertionError("did the paper's study")

    for name in ("fit_polynomial", "correlate", "entropy_weights", "mopso"):
        monkeypatch.setattr(analysis, name, called)
    checks = list(published.paper())
    assert len(checks) == 21
    assert all(check.passed for check in checks)
    assert not MISSED & {check.what for check in checks}
    assert all(item in published.NOT_CHECKED[0] for item in MISSED), "left out without a word"
    assert {check.case for check in checks} == {f"Paper: {group}" for group in (FROM_PRINT, IDENTIFIED, HELD_OUT)}


def test_an_empty_suite_does_not_pass(monkeypatch):
    monkeypatch.setattr(suite, "GROUPS", ())
    assert not suite.verify().passed


def test_command_prints_a_table_writes_a_page_and_exits_with_1(short, tmp_path):
    page = tmp_path / "verify.html"
    said = CliRunner().invoke(main, ["verify", "--page", str(page)])
    assert said.exit_code == 1
    assert "8 checks" in said.output
    assert re.search(r"\b1 of \d+ checks FAILS: ", said.output)
    assert max(len(line) for line in said.output.splitlines() if str(page) not in line) <= 80
    html = page.read_text(encoding="utf-8")
    assert "7 of 8" in html
    assert "&lt;b&gt;did not&lt;/b&gt;" in html
    assert "<b>did not" not in html


def test_command_exits_with_0_where_all_pass(short, monkeypatch):
    monkeypatch.setattr(suite, "GROUPS", suite.GROUPS[:1])
    said = CliRunner().invoke(main, ["verify", "--json"])
    assert said.exit_code == 0
    found = json.loads(said.output)
    assert found["passed"] is True
    assert [g["title"] for g in found["groups"]] == ["Good"]
    assert all(c["passed"] for g in found["groups"] for c in g["checks"])


def test_a_page_that_cannot_be_written_is_found_before_the_work(short, monkeypatch, tmp_path):
    monkeypatch.setattr(suite, "verify", lambda _: pytest.fail("the work was done"))
    said = CliRunner().invoke(main, ["verify", "--page", str(tmp_path / "no" / "verify.html")])
    assert said.exit_code == 2
    assert "cannot be written" in said.output
