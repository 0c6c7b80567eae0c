"""Tables that people hand over: a number is read as it was meant, or refused; in every table alike."""

from __future__ import annotations

import csv
import io
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import trainmj
from trainmj.errors import InputError
from trainmj.files.tables import read_beside
from trainmj.identification.data import observations
from trainmj.identification.file import TableData


def read(folder, text):
    (folder / "t.csv").write_text(text, encoding="utf-8", newline="")
    return read_beside(folder, "t.csv", "table = 't.csv'")


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("s;f\n50,5;800,5\n", {"s": [50.5], "f": [800.5]}),
        ("s\tf\n50.5\t800\n", {"s": [50.5], "f": [800]}),
        ("s;f\n50,5;1,200\n", {"s": [50.5], "f": [1.2]}),  # the first number tells what a comma is
        ("s\tf\n0.000\t0.000\n1.500\t1.200\n", {"s": [0, 1.5], "f": [0, 1.2]}),  # no thousands begin with 0
        ("s,f\n1.500,1.200\n", {"s": [1.5], "f": [1.2]}),
        ('s,f\n"50,5","1,25"\n', {"s": [50.5], "f": [1.25]}),
        ("s;f\n1,5e3;+2\n", {"s": [1500], "f": [2]}),
        ("s;f\n1,5;\n2;3\n", {"s": [1.5, 2], "f": [pytest.approx(float("nan"), nan_ok=True), 3]}),
        ("s;type\n1,5;a, b\n2;c,d\n", {"s": [1.5, 2], "type": ["a, b", "c,d"]}),
        ("s;type\n1,5;1.2\n2;x\n", {"s": [1.5, 2], "type": ["1.2", "x"]}),  # no column of numbers
        ("day;s\n12.05.2024;1,5\n", {"day": ["12.05.2024"], "s": [1.5]}),
        ("unit;s\n423 001;1,5\n423 002;2\n", {"unit": ["423 001", "423 002"], "s": [1.5, 2]}),
        ('s,f,"remark; source"\n1,2,a\n', {"s": [1], "f": [2], "remark; source": ["a"]}),
        ('s,"a\tb"\n1,2\n', {"s": [1], "a\tb": [2]}),
        ('"two\nlines";s\n"x\n#y";1,5\n', {"two\nlines": ["x\n#y"], "s": [1.5]}),
        ("sep=;\ns;f\n1,5;2\n", {"s": [1.5], "f": [2]}),
        ('\ufeff"SEP=,"\r\ns,f\r\n1,2\r\n', {"s": [1], "f": [2]}),
        ("sep=\t\ns\tf, g\n1\t2\n", {"s": [1], "f, g": [2]}),
        ("s;f;;\n1;2;;\n", {"s": [1], "f": [2]}),  # as spreadsheets fill up
        ("s;f\n1;2;;\n", {"s": [1], "f": [2]}),
        (",s\n0,5\n", {"": [0], "s": [5]}),  # as pandas numbers rows
        ("s,f\r1,2\r3,4\r", {"s": [1, 3], "f": [2, 4]}),
        ("# x\n\ns,f\n#,\"y\n1,2\n ,\n3,4\n\n", {"s": [1, 3], "f": [2, 4]}),
    ],
)  # fmt: skip
def test_what_people_write_is_read(tmp_path, text, columns):
    """Fails if a legitimate way to write a table is refused or read as something else."""
    assert read(tmp_path, text).columns == columns


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("s\tf\n0\t0\n50.5\t800.25\n1500\t1,200\n", "line 4: row 3: f = '1,200': has a comma, but .*'50.5' has"),
        ("s;f\n0;0\n50,0;800,5\n1500;1.200\n", "line 4: row 3: f = '1.200' has a point"),
        ("s\tf\n50\t800\n1500\t1,200\n", "line 3: row 2: f = '1,200': may be in thousands .*: leave the comma out"),
        ("s;f\n50;800\n1500;1.200\n", "line 3: row 2: f = '1.200': may be in thousands .*: leave the point out"),
        ('s,f\n50,800\n1500,"1,200"\n', "f = '1,200': may be in thousands"),
        ("s;f\n50;1.234,5\n60;7\n", "line 2: row 1: f = '1.234,5': has marks between thousands"),
        ("s;f\n50;1 200\n60;7\n", "f = '1 200': has marks between thousands"),
        ("s;f\n50;1\u202f200,5\n60;7\n", "has marks between thousands"),
        ("s,f\n50,1'200\n60,7\n", "has marks between thousands"),
        ("s,f\n50,1_200\n60,7\n", "has marks between thousands"),
        ("s;f\n50;1.200.300\n60;7\n", "has marks between thousands"),
        ("s,f\n0,0\n50,5,800,5\n", "line 3: row 2 has 4 values under 2 heads: numbers with decimal commas need"),
        ("m\n33,5\n", "line 2: row 1 has 2 values under 1 head: numbers with decimal commas"),
        ("s;f\n1;2;3;\n", "row 1 has 3 values under 2 heads$"),
        ("s,f\n1\n", "row 1 has 1 value under 2 heads$"),
        ("s,f,s,f\n0,0,0,0\n", "has two columns 's'"),
        (' s ,f,"s"\n0,0,0\n', "has two columns 's'"),
        ("s,,\n1,2,\n", "column 2 has values, but no head"),
        ("sep=|\ns|f\n1|2\n", "line 1: sep=|: columns must be separated by commas, semicolons or tabs"),
        ('s,f\n1,2\n"3,4\n', "line 3: is not a row of values"),
        ("s,f\n", "must have a line of heads, and one line or more of values"),
        ("#x\n", "is empty: it must have"),
        ("s\n" + "9" * 400 + "\n", "line 2: row 1: s = '9{59}...: must be a number of at most 100 characters"),
        ("s\n1e400\n", "s = '1e400': must be a finite number of at most 1e\\+100"),
        ("s\n" + "9" * 200_000 + "\n", "line 2: is not a row of values"),
    ],
)  # fmt: skip
def test_what_may_mean_something_else_is_refused_with_line_and_cure(tmp_path, text, said):
    """Fails if a number, a row or a head that can be taken in two ways is taken in one of them."""
    with pytest.raises(InputError, match=f"^table = 't.csv': .*{said}".replace("|", "\\|")):
        read(tmp_path, text)


NOT_NUMBERS = ["nan", "inf", "-Infinity", "0x10", "1d5", "٣", "1_2", "1e", "1.2.3", "--1", "1 2", "12:30", "50 %", "−5"]


@pytest.mark.parametrize("cell", NOT_NUMBERS)
def test_what_only_python_takes_for_a_number_is_none(tmp_path, cell):
    """Fails if float() or int() decide what people may write; the message is about the cell that is wrong."""
    table = read(tmp_path, f"s;f\n1,5;2\n3;{cell}\n")
    assert table.columns == {"s": [1.5, 3], "f": ["2", cell]}
    with pytest.raises(InputError, match=r"^line 3: row 2: f = .*: must be a number$"):
        table.numbers("f")


def grouped(value, mark, between):
    """A number as people of some country write it: 1.234,5."""
    whole, _, decimals = repr(value).partition(".")
    return f"{int(whole):,}".replace(",", between) + (mark + decimals if decimals else "")


COUNTRIES = {
    "plain": (".", ""),
    "us": (".", ","),
    "de": (",", "."),
    "fr": (",", "\u202f"),
    "ch": (".", "'"),
    "at": (",", " "),
}
values = st.integers(0, 2_000_000) | st.integers(0, 2_000_000_000).map(lambda n: n / 1000) | st.integers(0, 999)


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(sorted(COUNTRIES)),
    st.sampled_from([";", "\t"]),
    st.lists(st.lists(values, min_size=2, max_size=2), min_size=1, max_size=4),
)
def test_a_number_is_read_as_it_was_meant_or_refused(tmp_path_factory, country, separator, rows):
    """Fails if any country's way to write numbers gives other numbers."""
    text = io.StringIO()
    written = [[grouped(value, *COUNTRIES[country]) for value in row] for row in rows]
    csv.writer(text, delimiter=separator).writerows([["a", "b"], *written])
    try:
        table = read(tmp_path_factory.getbasetemp(), text.getvalue())
    except InputError:
        return
    for head, meant in zip("ab", zip(*rows, strict=True), strict=True):
        found = table.columns[head]
        assert found == list(meant) or all(isinstance(cell, str) for cell in found), text.getvalue()


@pytest.mark.parametrize(
    "text",
    [
        ",".join(f"h{n}" for n in range(100_000)) + "\n" + "1," * 99_999 + "1\n",
        "h\n" + "1," * 400_000 + "1\n",
        "h\n" + "1," * 4_000_000 + "1\n",
        "h\n" + "1\n" * 1_200_000,
        "a,b\n" + "1,2\n" * 600_000,
        "\n" * 40_000_000,
        '"' * 40_000_000,
        " " * 40_000_000,
        'h\n"' + "x\n" * 900_000,
    ],
    ids=["heads", "row", "line", "rows", "cells", "blank lines", "quotes", "blanks", "open quote"],
)
def test_a_table_that_is_too_large_is_refused_at_once(tmp_path, text):
    """Fails if the size of a table is found out by working through it."""
    (tmp_path / "t.csv").write_text(text)
    began = time.process_time()
    with pytest.raises(InputError):
        read_beside(tmp_path, "t.csv", "t")
    assert time.process_time() - began < 2


# every table alike


def curve(folder):
    (folder / "my.yaml").write_text("builds_on: b_type\ncurves: {buffer: {file: t.csv}}\n")
    return trainmj.load(folder / "my.yaml").curves["buffer"]


def cases(folder):
    return trainmj.sweep_of({"scenario": "b_type", "cases": "t.csv"}, folder)


def points(folder):
    factors = {
        "D": {"sets": "empty_stroke_mm", "bounds": [0, 2000]},
        "M": {"sets": "collision.gap_mm", "bounds": [0, 2000]},
    }
    design = {"kind": "table", "file": "t.csv"}
    values = {"scenario": "b_type", "factors": factors, "responses": {"TS": "TS_mm"}, "design": design}
    return trainmj.study_of({**values, "objectives": {"TS": "minimise"}}, folder)


def targets(folder):
    return observations("x", TableData(table="t.csv", cases={"D": "mass_t"}, values={"S": "M"}), folder)[0]


KINDS = [(curve, "stroke_mm", "force_kN"), (cases, "mass_t", "speed_km_h"), (points, "D", "M"), (targets, "D", "M")]
ALIKE = {
    "{a};{b}\n0;0\n50.5;1,200\n": "line 3: row 2: {b} = '1,200': has a comma, but",
    "{a},{b},{a},{b}\n0,0,0,0\n": "has two columns '{a}'",
    "{a},{b}\n0,0\n50,5,800,5\n": "line 3: row 2 has 4 values under 2 heads: numbers with decimal commas",
    "{a},{b}\n0,0\n50," + "9" * 400 + "\n": "line 3: row 2: {b} = '9999",
    "{a},{b}\n0,0\n50,1_0\n": "row 2: {b} = '1_0': must be a number",
    "{a},{b}\n0,0\n50,nan\n": "row 2: {b} = 'nan': must be a number",
    "{a},{b}\n0,0\n50,1 200\n": "line 3: row 2: {b} = '1 200': has marks between thousands",
    "{a},{b}," + ",".join(f"h{n}" for n in range(9000)) + "\n": "has 9002 columns, more than 1000",
}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind[0].__name__)
@pytest.mark.parametrize(("text", "said"), ALIKE.items(), ids=range(len(ALIKE)))
def test_curves_cases_points_and_targets_are_read_by_the_same_rules(tmp_path, kind, text, said):
    """Fails if one of the tables takes what the others refuse."""
    use, a, b = kind
    (tmp_path / "t.csv").write_text(text.replace("{a}", a).replace("{b}", b))
    with pytest.raises(InputError) as caught:
        use(tmp_path)
    assert "t.csv'" in str(caught.value)
    assert said.replace("{a}", a).replace("{b}", b) in str(caught.value)


def test_a_column_of_cases_that_sets_a_name_may_be_text(tmp_path):
    """Fails if text is refused, or changed, where the scenario has text."""
    (tmp_path / "t.csv").write_text('mass_t;collision.partner;title\n33,5;rigid_wall;"a, b; c"\n')
    assert cases(tmp_path).case(0) == {"mass_t": 33.5, "collision.partner": "rigid_wall", "title": "a, b; c"}
