"""Rows in columns: what cases change, what became of them, and that a table is the same however they come."""

import csv
import io
import sqlite3
import tracemalloc
from contextlib import closing
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from builders import each_alone

import trainmj
from trainmj.cases.engine import Local
from trainmj.cases.lines import lines_of
from trainmj.cases.rows import Rows, refused
from trainmj.cases.runner import fill, rows_of
from trainmj.cases.store import KEY, Store
from trainmj.collision.cases import AT_ONCE, Cases, gathered
from trainmj.collision.limits import Limited
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of
from trainmj.sweep.outcome import with_uses

FAST = {"simulation.step_ms": 0.5}
COLUMNS = columns_of(line_up(trainmj.load("b_type")))


def some(n, first=0):
    """Columns of the first n responses from one on."""
    return dict(list(COLUMNS.items())[first : first + n])


# lines of CSV


def by_csv(rows):
    out = io.StringIO(newline="")
    csv.writer(out).writerows(rows)
    return out.getvalue()


TENS = [
    s * m * 10.0**k for s in (1, -1) for m in (1.0, 1.5, 9.999999999999999, 1.2345678901234567) for k in range(-30, 31)
]
EDGES = [0.0, -0.0, np.inf, -np.inf, 5e-324, 1.7976931348623157e308, 100000.0, 2.0**53, 9999999999999998.0, 1e16, 1e22]
EDGES += [0.0001, 0.00001, 9.9e-5, 10.00001, 100.0000123, 0.50000001, 0.10000123, None]


@pytest.mark.parametrize("bits", [False, True])
def test_numbers_are_written_as_csv_writes_them(bits):
    """Breaks if the JSON writer finds other digits than repr, or its exponents stay as they are."""
    rng = np.random.default_rng(3)
    if bits:  # every float there is
        values = rng.integers(0, 2**64, 60_000, dtype=np.uint64).view(np.float64)
    else:  # as responses are
        values = rng.standard_normal(60_000) * 10.0 ** rng.uniform(-8, 6, 60_000)
    values = [None if value != value else value for value in values.tolist()] + TENS + EDGES
    values += values[: -len(values) % 8]
    rows = [("a", k, *values[k : k + 8]) for k in range(0, len(values), 8)]
    assert lines_of(rows, 2) == by_csv(rows)
    assert "".join(lines_of(rows[k : k + 1], 2) for k in range(300)) == by_csv(rows[:300])


def test_texts_are_quoted_as_csv_quotes_them():
    rows = [(1, text, 0.5, None, None) for text in ("", 'said "no"', "a,b", "a\r\nb\n", "e0.0000n,null],[", "Ω", "I")]
    assert lines_of(rows, 3) == by_csv(rows)
    assert lines_of([(1, "a,b", 1e-7)], 3) == by_csv([(1, "a,b", 1e-7)])


@pytest.mark.parametrize("wrong", ["many", "1e-5", b"\xff", "null"])
def test_what_was_changed_by_hand_is_written_as_it_is(wrong):
    rows = [(1, "over", 0.00001, None), (2, "over", 0.5, wrong)]
    assert lines_of(rows, 2) == by_csv(rows)


# a table is the same however its rows come


def chunks_of(n, at_once, order=1):
    """n cases of two structures, every fifth of them refused, so many at a time."""
    rng = np.random.default_rng(1)
    numbers = rng.standard_normal((n, 6)) * 10.0 ** rng.integers(-7, 7, (n, 6))
    numbers[rng.random((n, 6)) < 0.1] = np.nan
    kinds = [
        [k for k in range(n) if k % 5 == 0],
        [k for k in range(n) if k % 5 and k % 2],
        [k for k in range(n) if k % 5 and not k % 2],
    ]
    chunks = []
    for kind, keys in enumerate(kinds):
        for here in (keys[k : k + at_once] for k in range(0, len(keys), at_once)):
            if kind == 0:
                chunks.append(refused(here, [f"no {k}, is wrong" for k in here]))
            else:
                facts = {"status": ["over"] * len(here), "reason": [""] * len(here)}
                width = 4 + kind
                chunks.append(Rows(here, facts, some(width, kind - 1), numbers[here, :width]))
    return chunks[::order]


def table_of(tmp_path, chunks, together):
    """Bytes of results.csv and the types of the columns, of chunks that are added so many at a time."""
    given = {"mixed": [1, 2.5, 3.0, 4], "text": ["a", 1, 2.0, [3]], "number": [1.0, 2.0, 1, 3.5]}
    with Store(tmp_path / "results.sqlite") as store:
        store.prepare({name: values[0] for name, values in given.items()} | {"status": "", "reason": ""})
        for k in range(0, len(chunks), together):
            store.add(
                [
                    rows.beside({name: [values[key % 4] for key in rows.keys] for name, values in given.items()})
                    for rows in chunks[k : k + together]
                ]
            )
        store.write_csv(tmp_path / "results.csv")
    with closing(sqlite3.connect(tmp_path / "results.sqlite")) as db:
        kinds = {name: kind for _, name, kind, *_ in db.execute("PRAGMA table_info(results)")}
    return (tmp_path / "results.csv").read_bytes(), kinds


@pytest.mark.parametrize(("at_once", "together", "order"), [(1, 1, -1), (7, 3, 1), (400, 99, -1)])
def test_a_table_is_the_same_however_its_rows_come(tmp_path, at_once, together, order):
    """Breaks if the type of a column, or the order of columns or rows, depends on what ended first."""
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
    text, kinds = table_of(tmp_path / "one", chunks_of(400, 50), 2)
    assert table_of(tmp_path / "other", chunks_of(400, at_once, order), together) == (text, kinds)
    assert (kinds["mixed"], kinds["text"], kinds["number"], kinds["TS_mm"]) == ("INTEGER", "TEXT", "REAL", "REAL")
    first, *_, last = text.decode().splitlines()
    assert first.split(",")[:6] == ["case", "mixed", "text", "number", "status", "reason"]
    assert last.startswith("399,4,[3],3.5,over,,")
    found = trainmj.read_table(tmp_path / "other")
    assert [name for name in found.columns if name in COLUMNS] == list(some(7))
    assert found["reason"][5] == "no 5, is wrong"
    numbers = {key: rows.row(n) for rows in chunks_of(400, 50) for n, key in enumerate(rows.keys)}
    for key in (0, 1, 2, 3, 398, 399):
        there = {name: value for name, value in numbers[key].items() if value == value}
        assert {name: value for name, value in found.loc[key].items() if name in there} == there
        assert found.loc[key, list(COLUMNS)[:7]].notna().sum() == len(there) - 2


def test_not_a_number_is_an_empty_cell_and_infinity_stays(tmp_path):
    with Store(tmp_path / "results.sqlite") as store:
        facts = {"status": ["over"], "reason": [""]}
        store.add([Rows([3], facts, some(4), np.array([[np.nan, np.inf, -0.0, 1e-5]]))])
        store.write_csv(tmp_path / "results.csv")
        assert store.endings() == {"over": (1, 3, "")}
    lines = (tmp_path / "results.csv").read_bytes().split(b"\r\n")
    assert lines[1:] == [b"3,over,,,inf,0.0,1e-05", b""]  # a column of numbers has no -0.0 in SQLite
    assert trainmj.read_table(tmp_path).iloc[0, 2:].isna().tolist() == [True, False, False, False]


def test_a_response_that_is_no_number_in_any_case_is_a_column_of_numbers(tmp_path):
    with Store(tmp_path / "results.sqlite") as store:
        store.add([Rows([0], {"status": ["over"], "reason": [""]}, some(2), np.array([[1.5, np.nan]]))])
    assert trainmj.read_table(tmp_path).dtypes.tolist()[2:] == [np.float64, np.float64]


def test_the_first_of_each_ending_is_that_of_the_least_number(tmp_path):
    with Store(tmp_path / "results.sqlite") as store:
        store.add([refused([7, 2, 5], ["c", "a", "b"]), Rows([1], {"status": ["over"], "reason": [""]})])
        assert store.endings() == {"refused": (3, 2, "a"), "over": (1, 1, "")}
        assert store.there(8).nonzero()[0].tolist() == [1, 2, 5, 7]


# what cases change


def test_cases_by_column_are_those_of_a_sweep_one_by_one():
    """Breaks if a case gets the value of another one, or an integer becomes another number."""
    sweep = trainmj.sweep_of(
        {
            "scenario": "b_type",
            "cases": {"slow": {"set": {"speed_km_h": 15}}, "fast": {"set": {"speed_km_h": 25}}},
            "vary": {"mass_t": [30, 33.5, 36], "collision.partner": ["b_type", "rigid_wall"]},
            "together": {"empty_stroke_mm": [20, 30], "collision.rail_friction": [0.0, 0.01]},
        }
    )
    there = np.zeros(len(sweep), dtype=bool)
    there[[0, 3, 13, 23]] = True
    found = {}
    for (name, scenario), (of, cases) in zip(sweep.load_cases.items(), sweep.by_scenario(there), strict=True):
        assert of is scenario
        found |= {key: {"load_case": name, **case} for some in cases for key, case in zip(some.keys, some, strict=True)}
    assert list(found) == np.flatnonzero(~there).tolist()
    assert all(repr(case) == repr(sweep.case(key)) for key, case in found.items())
    assert {key: [str(v) for v in case.values()] for key, case in found.items() if key == 21} == {
        21: ["fast", "36", "b_type", "30", "0.01"]
    }


def test_the_cases_of_a_large_sweep_are_not_held_in_memory():
    """Breaks if something is made for each case before it is computed."""
    sweep = trainmj.grid_of(
        "b_type", {"mass_t": "30:36:1000", "speed_km_h": "20:30:100", "collision.gap_mm": "1:9:100"}
    )
    there = np.ones(len(sweep), dtype=bool)
    there[[5, len(sweep) - 1]] = False
    tracemalloc.start()
    try:
        ((_, cases),) = sweep.by_scenario(there)
        assert [some.keys for some in cases] == [[5], [len(sweep) - 1]]
        there[: 40 * AT_ONCE] = False
        ((_, cases),) = sweep.by_scenario(there)
        assert max(len(some) for some in cases) == AT_ONCE
        assert tracemalloc.get_traced_memory()[1] < 2e6
    finally:
        tracemalloc.stop()


def test_values_deep_in_others_stand_where_their_names_say():
    names = (("mass_t",), ("as_built", "M1", "curve", "force_kN", 0), ("as_built", "S1", "mass_t"), ("curve", "x"))
    names += (("as_built", "M1", "curve", "force_kN", 1), ("as_built", "M1", "curve", "stroke_mm"))
    values = (np.array([30.0, 31.0]), [1, 2], np.array([5, 6]), ["p", None], [3.0, 4.0], [[0, 9]] * 2)
    cases = Cases(["a", "b"], names, values)
    curve = {"force_kN": [2, 4.0], "stroke_mm": [0, 9]}
    assert cases[1] == {
        "mass_t": 31.0,
        "as_built": {"M1": {"curve": curve}, "S1": {"mass_t": 6}},
        "curve": {"x": None},
    }
    assert type(cases[1]["mass_t"]) is float
    back = cases.take([1, 0])
    assert (back.keys, list(back)) == (["b", "a"], [cases[1], cases[0]])


def test_cases_one_by_one_are_put_together_where_neighbours_change_the_same():
    given = [
        ("a", {"x": 1}),
        ("b", {"x": 2}),
        ("c", {"y": 3}),
        ("d", {}),
        ("e", {"x": 4, "y": 5}),
        ("f", {"y": 6, "x": 7}),
    ]
    found = list(gathered(iter(given)))
    assert [some.keys for some in found] == [["a", "b"], ["c"], ["d"], ["e"], ["f"]]
    assert [(key, case) for some in found for key, case in zip(some.keys, some, strict=True)] == given
    assert [len(some) for some in gathered((n, {"x": n}) for n in range(2 * AT_ONCE + 1))] == [AT_ONCE, AT_ONCE, 1]


# an engine


def test_rows_have_the_responses_asked_for_and_the_limits_of_a_single_run():
    scenario = trainmj.load("b_type", FAST | {"limits.TS_mm": 900})
    cases = gathered(enumerate([{"mass_t": 30}, {"mass_t": -1}, {"speed_km_h": 30}]))
    engine = Local(scenario, 1).of(scenario, ["TS_mm", "stroke_M1_*"])
    found = {rows.keys[0]: rows for rows in each_alone(engine(cases))}
    assert list(found[0].row(0)) == ["status", "reason", "TS_mm", "stroke_M1_M2_mm", "stroke_M1_M2_car_body_mm"]
    assert (found[1].row(0)["status"], found[1].limits, found[1].usable.tolist()) == ("refused", (), [False])
    for key, changes in ((0, {"mass_t": 30}), (2, {"speed_km_h": 30})):
        alone = trainmj.summarise(trainmj.run(scenario.with_values(changes)))
        assert found[key].row(0)["TS_mm"] == alone.TS_mm
        assert tuple(limited.of(0) for limited in found[key].limits) == alone.limits
        assert [(one.kept[0], one.used[0]) for one in found[key].limits] == [
            (one.kept, one.used) for one in alone.limits
        ]


def test_cases_that_end_together_say_each_for_itself_how_much_they_use_of_a_limit():
    """Breaks if a case whose numbers may not be used says something, or one says what another uses."""
    ts = Limited(
        "TS_mm", "TS", "mm", 1, True, "", [""] * 3, np.array([450.0, 990.0, 9.0]), np.full(3, 900.0), np.full(3, True)
    )
    facts = {"status": ["over", "limit passed", "curve ended"], "reason": [""] * 3}
    rows = Rows([4, 5, 6], facts, some(1), np.array([[450.0], [990.0], [9.0]]), (ts,))
    found = with_uses(rows)
    assert list(found.columns) == ["percent_of_TS_mm", "TS_mm"]
    np.testing.assert_array_equal(found.numbers, [[50.0, 450.0], [110.0, 990.0], [np.nan, 9.0]])
    assert with_uses(refused([1], ["why"])).columns == {}
    lost = replace(rows, facts=facts | {"status": ["unstable"] * 3})
    assert with_uses(lost) is lost, "a limit that no case says anything of has no column"


def test_what_ends_is_kept_soon_and_in_order_of_its_end(tmp_path, monkeypatch):
    """Breaks if rows wait for more than others, or the last ones for the end of an interruption."""
    now = [0.0]
    monkeypatch.setattr("trainmj.cases.runner.time.monotonic", lambda: now[0])

    def engine(cases):
        for rows in each_alone(chunks_of(12, 100)):
            now[0] += 0.2
            yield rows
            if rows.keys == [4]:
                raise KeyboardInterrupt

    kept = []
    with Store(tmp_path / "results.sqlite") as store:

        def progress(finished):
            kept.append((now[0], finished, store.there(12).sum()))

        with pytest.raises(KeyboardInterrupt):
            fill(store, engine, [], lambda rows: rows, progress)
    assert all(finished == there for _, finished, there in kept)
    assert all(b - a <= 0.8 for (a, *_), (b, *_) in pairwise(kept))
    assert kept[-1][1] > kept[-2][1]


def test_equal_keys_are_computed_once_and_known_ones_never(tmp_path):
    computed = []

    def engine(cases):
        for some in cases:
            computed.extend(some.keys)
            yield Rows(some.keys, {"status": ["over"] * len(some), "reason": [""] * len(some)})

    with Store(tmp_path / "rows.sqlite", KEY) as store:
        cases = list(gathered([("a", {"x": 1}), ("b", {"x": 2}), ("a", {"x": 1}), ("c", {"y": 1}), ("b", {"y": 2})]))
        assert rows_of(store, engine, cases) == {key: {"status": "over", "reason": ""} for key in "abc"}
        assert computed == ["a", "b", "c"]
        rows_of(store, engine, [*cases, *gathered([("d", {"x": 1})])])
        assert computed == ["a", "b", "c", "d"]
