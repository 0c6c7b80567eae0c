"""One table of quantities: what stands in it appears everywhere, and nothing else is needed for that."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import trainmj
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of, groups, ordered
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import load
from trainmj.units import against, rounded_down, unit_of, words

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ["b_type", "b_type_s08", "b_type_wall", "wagon_80t", "en15227_c1"])
def test_columns_are_known_before_a_collision_is_computed(name):
    """Breaks if a row has a value that its chain's columns do not announce, or in another order."""
    scenario = load(name, {"simulation.time_limit_s": 0.05})
    columns = columns_of(line_up(scenario))
    row = summarise(run(scenario)).row()
    assert list(row) == ["status", "reason", *columns]
    assert [c.name for c in ordered(columns.values())] == list(columns), "one chain is in the order of tables already"


def test_columns_of_trains_of_different_length_make_one_table():
    """M10 stands behind M2, and the longer train's columns among those of the shorter one."""
    short, long = (columns_of(line_up(load("b_type", {"trains.b_type.vehicles": n, "trains.b_type.mass_t": 33})))
                   for n in (3, 11))  # fmt: skip
    names = [c.name for c in ordered([*short.values(), *long.values()])]
    assert names == list(long), "every column of three vehicles is one of eleven"
    assert names.index("peak_device_M2_g") < names.index("peak_device_M10_g") < names.index("peak_device_S1_g")


def test_a_table_is_taken_apart_without_a_copy_of_what_it_carries():
    """Breaks if pandas copies the words about every column whenever one column is taken: nine times as long."""
    table = trainmj.run_cases(load("b_type", {"simulation.time_limit_s": 0.05}), [{"mass_t": 33}])
    assert table.attrs["columns"]["TS_mm"].unit == "mm"
    assert table["TS_mm"].attrs["columns"] is table.attrs["columns"]


def test_names_are_unique_and_columns_carry_their_unit():
    columns = columns_of(line_up(load("b_type")))
    assert columns["final_speed_M1_km_h"].unit == "km/h"
    assert columns["stroke_S1_M1_anti_climber_mm"].title == "stroke S1-M1 anti climber"
    for quantities in groups().values():
        assert len({q.name for q in quantities}) == len(quantities)
        assert all(q.meaning and q.heading for q in quantities)


@pytest.mark.parametrize(
    ("key", "unit", "said"),
    [
        ("empty_stroke_mm", "mm", "empty stroke"),
        ("devices.front.stiffness_kN_per_mm", "kN/mm", "devices.front.stiffness"),
        ("line.tie.kN_per_mm", "kN/mm", "line.tie"),
        ("collision.offset_mm.M", "mm", "collision.offset M"),
        ("collision.pitch_mrad.S12", "mrad", "collision.pitch S12"),
        ("speed_m_per_s", "m/s", "speed"),
        ("power_kJ_per_s", "", "power kJ per s"),
        ("mass", "", "mass"),
    ],
)
def test_an_input_key_ends_in_its_unit(key, unit, said):
    """Breaks if m/s is taken for s because it ends so, or a name is read with its unit or without its vehicle."""
    assert unit_of(key) == unit
    assert words(key) == said


@pytest.mark.parametrize(
    ("value", "limit", "digits", "shown"),
    [
        (380.04, 380.0, 1, "380.04"),
        (379.96, 380.0, 1, "379.96"),
        (380.0, 380.0, 1, "380.0"),
        (379.9, 380.0, 1, "379.9"),
        (-380.04, 380.0, 1, "-380.04"),
        (-5.0004, -5.0, -3, "-5.0004"),
        (1.004e-3, 1e-3, -2, "0.001004"),
        (1.0049, 1.0, -3, "1.005"),
        (100.4, 100.0, 0, "100.4"),
        (800.0000000000003, 800.0, 1, "800.0"),
        (800.0001, 800.0, -5, "800.0001"),
        (math.nan, 1.0, 1, "-"),
        (2.0, None, 1, "2.0"),
        (2.0, math.inf, 1, "2.0"),
    ],
)
def test_a_value_beside_a_limit_is_read_as_it_is_judged(value, limit, digits, shown):
    """Breaks if a table says that 380.0 mm of 380 mm is too much."""
    assert against(value, limit, digits) == shown


@pytest.mark.parametrize(
    ("limit", "shown"), [(0.49996, "0.499"), (0.5, "0.5"), (0.3, "0.3"), (12.349, "12.3"), (1e-5, "1e-05")]
)
def test_a_limit_that_is_proposed_may_be_used(limit, shown):
    """Breaks if a message proposes a step that is refused next."""
    assert rounded_down(limit, 3) == shown
    assert float(shown) <= limit
