"""Tables on terminals of every width: no number, no head is cut or broken, and no line is too long."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

import trainmj
from trainmj.assessment import screen as assessed
from trainmj.identification import screen as identified
from trainmj.output import console
from trainmj.output.table import Column, Table, worded
from trainmj.paper.reproduce import reproduce
from trainmj.paper.screen import print_paper
from trainmj.reliability import screen as reliable
from trainmj.single import screen as single
from trainmj.study import screen as studied
from trainmj.sweep import screen as swept
from trainmj.verification import suite
from trainmj.verification.screen import print_verification

WIDTHS = (50, 64, 80, 120, 200)
STEP = {"simulation.step_ms": 0.5}
Screen = Callable[[], None]


@pytest.fixture
def seen(monkeypatch, capsys) -> Callable[[Screen, int], tuple[str, list[Table]]]:
    """What a terminal of a width shows, without its colours, and the tables that were printed."""
    tables: list[Table] = []
    made = console.console_table

    def record(table: Table, widths: list[int]) -> Any:
        tables.append(table)
        return made(table, widths)

    monkeypatch.setattr(console, "console_table", record)
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal

    def look(screen: Screen, width: int) -> tuple[str, list[Table]]:
        monkeypatch.setenv("COLUMNS", str(width))
        tables.clear()
        screen()
        return re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out), list(tables)

    return look


def check(shown: str, tables: list[Table], width: int) -> None:
    """Every number and every word of a head is there whole, and every line fits."""
    assert tables
    assert "…" not in shown
    for line in shown.splitlines():
        assert len(line.rstrip()) <= width or re.match(r"(Written|Run what|Note: )", line), line  # paths stay whole
    words = set(shown.split())
    for table in tables:
        for k, column in enumerate(table.columns):
            heads = (column.head or column.name).split() + column.unit.split()
            assert {head for head in heads if len(head) <= 24} <= words, column
            for row in table.rows if not column.text else ():
                assert set(str(console._cell(column.show(row[k]))).split()) <= words, (column.name, row[k])


@pytest.fixture(scope="module")
def screens(standard, tmp_path_factory) -> dict[str, Screen]:
    folder = tmp_path_factory.mktemp("screens")
    result = trainmj.run(standard.with_values(STEP))
    summary = trainmj.summarise(result)
    plane = trainmj.run("emu_vertical", {"simulation.time_limit_s": 0.3})
    limited = {"limits.TAMA_g": 1.3} | STEP
    sweep = trainmj.grid_of("b_type", {"empty_stroke_mm": [20, 60], "mass_t": [35, 36]}, changes=limited)
    done = trainmj.run_sweep(sweep, folder / "sweep")
    assessment = trainmj.assess("en15227_c1", "en15227", "C-I")
    plan = trainmj.load_reliability("b_type_as_built", STEP)
    plan = replace(plan, spec=plan.spec.model_copy(update={"runs": 8, "rare": None, "sensitivity": None}))
    found = trainmj.run_reliability(plan, folder / "reliability", figures=())
    study, targets = trainmj.load_study("b_type"), trainmj.load_targets("b_type")
    return {
        "run": lambda: single.print_summary(result, summary),
        "vertical": lambda: single.print_summary(plane, trainmj.summarise(plane)),
        "check": lambda: single.print_chain(result.scenario, result.chain),
        "check vertical": lambda: single.print_chain(plane.scenario, plane.chain),
        "sweep plan": lambda: swept.print_plan(sweep),
        "sweep": lambda: swept.print_sweep(done),
        "assess": lambda: assessed.print_assessment(assessment),
        "standard": lambda: assessed.print_plan(assessment.standard),
        "study plan": lambda: studied.print_plan(study),
        "targets": lambda: identified.print_plan(targets),
        "reliability plan": lambda: reliable.print_plan(plan),
        "reliability": lambda: reliable.print_reliability(found),
    }


NAMES = ["run", "vertical", "check", "check vertical", "sweep plan", "sweep", "assess", "standard", "study plan"]
NAMES += ["targets", "reliability plan", "reliability"]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.thorough] * n.endswith("vertical")) for n in NAMES]
)
def test_tables_fit_every_terminal_with_whole_numbers_and_heads(name, screens, seen):
    assert list(screens) == NAMES
    for width in WIDTHS:
        check(*seen(screens[name], width), width)


@pytest.mark.thorough
def test_tables_of_long_work_fit_every_terminal_too(seen, small_study, monkeypatch):
    monkeypatch.setattr(suite, "GROUPS", suite.GROUPS[:1])
    verified = trainmj.verify()
    paper = reproduce()
    for screen in (
        lambda: studied.print_study(small_study),
        lambda: print_verification(verified),
        lambda: print_paper(paper),
    ):
        for width in WIDTHS:
            check(*seen(screen, width), width)


def test_long_words_and_many_columns_are_parted_between_columns(seen):
    """Breaks if a table of words alone, or with one long word, breaks words that could stand whole."""
    table = Table(
        [*worded("Condition"), Column("balance time of the vehicle", "s", 3), *worded("what", "why it is so")],
        [("acceleration_of_a_vehicle", 18.123, "a" * 20, "because " * 20)],
    )
    for width in WIDTHS:
        shown, _ = seen(lambda: console.print_table(console.new_console(), table), width)
        assert {"18.123", "balance", "a" * 20, "because"} <= set(shown.split())
        assert max(map(len, shown.splitlines())) <= width


def test_the_first_lines_say_how_many_limits_were_passed(screens, seen):
    """Breaks if one has to read a table to know whether a limit was passed."""
    said = {
        "run": "All 5 limits are kept; nearest: ",
        "sweep": "2 of 4 cases end within all limits; 2 past a limit. The first: case ",
        "assess": "Not passed: 7 of 9 criteria kept",
    }
    for name, words in said.items():
        shown, _ = seen(screens[name], 120)
        assert words in "".join(shown.splitlines(keepends=True)[:4]), shown[:400]
