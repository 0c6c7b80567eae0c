"""``trainmj paper --beyond``: the paper's laws outside its range. All of it is computed once, in thorough runs."""

from __future__ import annotations

import json
import re

import pandas as pd
import pytest
from click.testing import CliRunner
from pages import read

import trainmj
from trainmj.cli import main
from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.paper import BEYOND
from trainmj.paper.beyond import AXES, EMPTY, ENDING, MASS, PARTNER, SPEED, Axis, conditions, judge_beyond, turn
from trainmj.paper.beyond import around as around_of
from trainmj.paper.laws_beyond import RULES, Around, s_anti, strokes
from trainmj.paper.output import summary_beyond, write_beyond
from trainmj.paper.page_beyond import law_tables
from trainmj.paper.printed import published
from trainmj.units import G


def at(axis: Axis, value: float) -> Around:
    (one,) = around_of({value: conditions(axis).at(value)}, {}, 0)[value]
    return one


def judged(around: Around) -> dict[str, bool]:
    return {rule.statement: rule.judge(around)[0] for rule in RULES}


# the rules


def test_every_law_holds_where_the_paper_found_it():
    """Breaks if a rule is not what the paper says, or judges the wrong collisions: then places mean nothing."""
    around = at(SPEED, 25.0)
    assert [name for name, holds in judged(around).items() if not holds] == []
    assert len(around.all) == len({s.TS_mm for s in around.all}) == 5
    middle = trainmj.summarise(trainmj.run(trainmj.load("b_type", {"empty_stroke_mm": 35, "simulation.step_ms": 0.2})))
    assert around.mid.TS_mm == middle.TS_mm
    heavy = trainmj.load("b_type", {"empty_stroke_mm": 35, "mass_t": 36, "simulation.step_ms": 0.2})
    assert around.over_M[2].TS_mm == trainmj.summarise(trainmj.run(heavy)).TS_mm


def test_below_shear_off_the_laws_over_D_break_and_those_over_M_stay():
    """Breaks if a law is called true whose subject, the anti-climber, is out of reach."""
    slow = at(SPEED, 16.0)
    held = judged(slow)
    assert max(s.interfaces[0].stages[0].stroke_mm for s in slow.over_D) < 353
    assert not any(held[f"{name} with D"] for name in ("S_anti grows", "S12 grows", "S23 falls", "TS falls"))
    assert not held["The coupler of the front is used up and sheared off"]
    assert held["TS grows with M"]
    assert held["S12 grows with M"]


def test_just_above_shear_off_M1_takes_the_anti_climber_alone():
    """Breaks if the page gives another reason than the forces do: 1250 kN on 33 t, nothing behind."""
    peak = at(SPEED, 18.5).mid.vehicles[0].peak_device_acceleration_g
    assert peak == pytest.approx(1250 / (33 * G), rel=1e-3)
    assert f"{peak:.2f} g at 33 t" in read("docs/beyond.md")


def test_unequal_trains_share_by_mass():
    """Breaks if the law of the final speed is judged by one half for trains that differ."""
    around = at(PARTNER, 66.0)
    rule = next(r for r in RULES if r.statement.startswith("The final speed"))
    holds, said = rule.judge(around)
    assert not holds
    assert said.endswith("without friction 0.333")
    assert float(said.split(";")[0]) == pytest.approx(1 / 3, abs=0.015)
    starts = [[round(c.start_s, 1) for c in at(PARTNER, t).mid.vehicles[3].contacts] for t in (60.0, 66.0)]
    assert len(starts[0]) == 1, "M4 is hit once"
    assert starts[1][1:] == [0.9] * len(starts[1][1:]) != [], "and again, as the page says"


def test_S12_is_least_where_M1_and_M2_stop_closing_as_the_anti_climber_meets():
    """The mechanism, found in one collision whose anti-climbers stay apart, against the least of many over D."""
    found = turn(28.0)
    assert abs(found.run_mm - found.least_mm) < 2.5
    assert found.least_mm > 35, "above 25 km/h it is later"
    three = published("3")
    assert three.loc[three["stroke_m1_m2_mm"].idxmin(), "D_mm"] == 23.75, "as the page says of the paper"


@pytest.mark.thorough
def test_turn_and_shear_off_do_not_depend_on_how_devices_unload():
    """With the law that the paper names, S08: breaks if the page takes for physics what one law of unloading makes."""
    scenario = trainmj.load("b_type_s08")
    cases = (
        {(25, D): 25 for D in (20, 25, 30)} | {(28, D): 28 for D in (35, 40, 45)} | {(V, 35): V for V in (18, 18.25)}
    )
    chains = {
        key: line_up(scenario.with_values({"speed_km_h": V, "empty_stroke_mm": key[1]})) for key, V in cases.items()
    }
    found = dict(run_chains(chains.items()))
    S12 = {key: s.interfaces[1].stroke_mm for key, s in found.items()}
    assert S12[25, 25] < min(S12[25, 20], S12[25, 30])
    assert S12[28, 40] < min(S12[28, 35], S12[28, 45])
    assert [s_anti(found[V, 35]) > 0 for V in (18, 18.25)] == [False, True]


# the shipped files


def test_two_formations_that_are_alike_are_the_twins_of_b_type():
    both = [trainmj.summarise(trainmj.run(name)) for name in ("b_type", "b_type_two_formations")]
    assert both[0].TS_mm == both[1].TS_mm
    assert both[0].TAMA_g == both[1].TAMA_g


def test_devices_that_end_are_those_of_b_type_up_to_their_ends():
    """Breaks if the two trains differ where neither limit is passed, or if a limit is passed without the car body."""
    within, past = ({"speed_km_h": v, "simulation.step_ms": 0.2} for v in (24, 27))
    same = [trainmj.summarise(trainmj.run(trainmj.load(name, within))) for name in ("b_type", "b_type_ends")]
    assert same[0].TS_mm == same[1].TS_mm
    ended = trainmj.summarise(trainmj.run(trainmj.load("b_type_ends", past)))
    assert ended.interfaces[0].stages[1].stroke_mm < 266
    assert [said.split(" (")[0] for said in ended.gave_way] == ["S1-M1 car_body"]


@pytest.mark.parametrize("name", sorted({axis.sweep for axis in AXES}))
def test_the_sweeps_have_the_values_that_the_page_says(name):
    sweep = trainmj.load_sweep(name)
    lists = [values for block in sweep.blocks for values in block.values()]
    if "formations" in name:
        assert all(16.5 < v < 49.5 for values in lists for v in values)
        assert f"scatter: {len(sweep)} " in read("docs/beyond.md")
    else:
        assert re.search(rf"\| {lists[0][0]:g} to {lists[0][-1]:g} (km/h|t|mm).*`{name}`", read("docs/beyond.md"))


# all of it


def the_tables_of_the_page_are_those_of_the_command(found):
    """Breaks if a place where a law breaks, or a turn, is told otherwise than it is found."""
    rows = [[c.strip() for c in line.strip("|").split("|")] for line in read("docs/beyond.md").splitlines()]
    told = [tuple(row) for row in rows]
    base, unequal, ends = law_tables(found)
    assert all(tuple(row) in told for table in (base, unequal) for row in table.rows)
    same = {row[0]: (row[1], row[3]) for row in base.rows}
    assert [r for r in ends.rows if (r in told) != (same[r[0]] != r[1:])] == []
    for t in found.turns:
        shown = (f"{t.speed_km_h:g} km/h", f"{t.stop_ms:.1f} ms", f"{t.run_mm:.1f} mm", f"{t.least_mm:.1f} mm")
        assert shown in told
    assert len(RULES) == 32
    text = read("docs/beyond.md")
    assert f"as {len(RULES)} rules" in text
    assert all(f"{a.resolution:g} {a.unit}" in text for a in (SPEED, MASS, EMPTY, PARTNER))


def what_the_page_says_of_the_formations_of_table_2(found):
    held = [sum(judged(around).values()) for around in found.loaded.values()]
    assert held == [32, 28, 17]
    assert "all 32 laws hold; with passengers (scenario 2) 28 do" in read("docs/beyond.md")
    assert "17 at its own 15 km/h" in read("docs/beyond.md")


def every_collision_is_valid_over_and_balanced(found):
    summaries = [s for a in found.along.values() for some in a.around.values() for one in some for s in one.all]
    assert len(summaries) > 2000
    assert not [s.not_valid for s in summaries if s.not_valid]
    assert all(s.over for s in summaries)
    assert max(abs(s.balance.energy_error) for s in summaries) < 3e-5


def speed_and_mass_meet_the_same_borders(found):
    """With one mass for all, strokes depend on M V^2 alone: two axes that were searched apart must agree."""
    places = [{s: sorted(p) for s, *p in found.along[axis.name].begins()} for axis in (SPEED, MASS)]
    for state, dM in (
        ("the coupler of the front does not shear off", -3),
        ("M1-M2 passes 418 mm", 3),
        ("M2-M3 passes 418 mm", 3),
    ):
        by_speed = [(33 + dM) * v**2 for v in places[0][state]]
        by_mass = [(m + dM) * 25**2 for m in places[1][state]]
        assert by_speed[0] < by_mass[1], state
        assert by_mass[0] < by_speed[1], state


def numbers_of_the_text(found):
    """What the page says outside its tables."""
    speed, ends = (found.along[axis.name].around for axis in (SPEED, ENDING[0]))
    coupler = {v: some[0].mid.interfaces[0].stages[0].stroke_mm for v, some in speed.items()}
    assert coupler[18.0] < 352 < coupler[18.25]
    S23 = {v: strokes(some[0].mid)[2] for v, some in speed.items()}
    assert (round(S23[18.0]), round(S23[19.5])) == (212, 136)
    assert min((v for v in S23 if v > 18), key=S23.__getitem__) == 19.5
    begins = {state: first for state, _, first in found.along[ENDING[0].name].begins()}
    assert begins["the car body is reached at M1-M2"] == 26.0
    assert {state: last for state, last, _ in found.along["speed"].begins()}["the car body is reached at M1-M2"] == 35.5
    late = {n for v in ends if v >= 27.75 for n, holds in judged(ends[v][0]).items() if not holds}
    trends = {r.statement for r in RULES if re.search(r"(grows|falls) with [DM]$", r.statement)}
    assert {"TS falls with D", "TS grows with M", "S12 grows with M", "S23 grows with M"} == trends - late
    each = [{row[0]: row[1:] for row in table.rows} for table in law_tables(found)]
    everywhere = {law.split(" (")[0] for law in each[0] if {c for rows in each for c in rows[law]} == {"all"}}
    assert everywhere == {"S1-M1 has the largest stroke", "S12 grows with M", "TS grows with M"}


@pytest.mark.thorough
def test_the_page_and_the_folder_are_what_the_command_finds(tmp_path):
    """Breaks if the page tells what is not found, a break has no reason or no numbers, or a figure or table is missing.

    One test, since half a minute of collisions is behind it.
    """
    found = judge_beyond()
    the_tables_of_the_page_are_those_of_the_command(found)
    what_the_page_says_of_the_formations_of_table_2(found)
    every_collision_is_valid_over_and_balanced(found)
    speed_and_mass_meet_the_same_borders(found)
    numbers_of_the_text(found)
    write_beyond(found, tmp_path, formats=())
    breaks = pd.read_csv(tmp_path / "beyond_breaks.csv")
    broken = breaks[breaks["side"] != "none"]
    assert broken[["last", "first", "said", "because"]].notna().all(axis=None)
    assert set(broken["axis"]) == {axis.name for axis in AXES}
    page = (tmp_path / BEYOND).read_text(encoding="utf-8")
    assert all(rule.statement in page for rule in RULES)
    assert page.count("data:image/svg+xml") == 3
    assert json.loads((tmp_path / "beyond.json").read_text()) == json.loads(json.dumps(summary_beyond(found)))
    report = CliRunner().invoke(main, ["report", str(tmp_path)])
    assert report.exit_code == 2
    assert "trainmj paper --beyond --out" in report.output


def test_the_command_writes_into_a_folder_of_the_paper_without_touching_it(tmp_path, monkeypatch):
    """Breaks if --beyond takes the files of the reproduction for its own."""
    monkeypatch.setattr("trainmj.paper.beyond.judge_beyond", lambda _: None)
    (tmp_path / "laws.csv").write_text("of the paper", encoding="utf-8")
    monkeypatch.setattr("trainmj.paper.output.write_beyond", lambda *_: None)
    monkeypatch.setattr("trainmj.paper.screen.print_beyond", lambda _: None)
    done = CliRunner().invoke(main, ["paper", "--beyond", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "laws.csv").read_text() == "of the paper"
    assert BEYOND in done.output
