"""Pages as such: what is escaped, what is in the file once, what a table shows."""

import base64
import hashlib
import json
import re

import numpy as np
import pytest
from markupsafe import Markup
from matplotlib.figure import Figure

from trainmj.errors import OutputError
from trainmj.output.blocks import Card
from trainmj.output.console import new_console, print_table
from trainmj.output.page import Page
from trainmj.output.plot import across, axes, dots, layout_of, line, numbers, room_for_name, shade
from trainmj.output.table import Column, Table, failed, judged, passed

NASTY = "</script><script>alert('1')</script>&\"'"
PLOTLY = "plotly.js v"


def page(**more):
    return Page("A page", **more)


def scripts(html):
    return re.findall(r"<script>(.*?)</script>", html, flags=re.DOTALL)


def test_text_is_escaped_wherever_it_stands():
    p = Page(NASTY, NASTY, command=NASTY, versions={NASTY: NASTY})
    section = p.section(NASTY)
    section.text(NASTY)
    section.notes([NASTY])
    section.cards(Card(NASTY, NASTY, NASTY, NASTY, failed(NASTY)))
    section.facts({NASTY: NASTY, "verdict": passed(NASTY)})
    section.table(Table([Column(NASTY, NASTY), Column("b", text=True)], [(NASTY, passed(NASTY))], NASTY, NASTY))
    section.table(Table([Column(NASTY)], [(1,)], NASTY), folded=True)
    section.code(NASTY, NASTY)
    section.picture(_figure(), NASTY, NASTY)
    assert "<script" not in p.html()
    assert "alert" in p.html()
    section.plot([line(NASTY, [0, 1], [1, 2], NASTY)], axes(NASTY, NASTY, NASTY, NASTY), NASTY, NASTY)
    assert all("alert('1')" not in script for script in scripts(p.html()))
    (data,) = re.findall(r'<script type="application/json">(.*?)</script>', p.html())
    assert "<" not in data
    assert json.loads(data)["data"][0]["y"] == [1, 2]


def test_markup_is_markup():
    p = page()
    p.section("s").text(Markup("<b>{}</b>").format("<i>"))
    assert "<b>&lt;i&gt;</b>" in p.html()


def _figure():
    figure = Figure()
    figure.subplots().plot([1, 2])
    return figure


def test_plotly_is_there_once_and_only_for_plots():
    plain = page()
    plain.section("s").text("t")
    assert PLOTLY not in plain.html()
    assert len(plain.html()) < 20_000
    assert "script-src &#39;none&#39;" in plain.html()
    plots = page()
    for _ in range(2):
        plots.section("s").plot([line("a", [0, 1], [1, 2])], axes("x", "mm", "y", "kN"), title="t")
    assert plots.html().count(PLOTLY) == 1


def test_the_policy_names_the_scripts_of_the_page_alone():
    p = page()
    section = p.section("s")
    section.plot([line("a", [0, 1], [1, 2])], {}, title="t")
    for _ in range(2):
        section.raw(Markup("<div></div>"), "window.mine = 1;")
    html = p.html()
    policy = re.search(r'Content-Security-Policy" content="(.*?)"', html)[1].replace("&#39;", "'")
    digests = {base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts(html)}
    assert set(re.findall(r"'sha256-(.*?)'", policy)) == digests
    assert len(digests) == 3
    assert "default-src 'none'" in policy
    assert "http" not in policy


def test_the_same_content_gives_the_same_file(tmp_path):
    def written(name):
        p = page()
        p.section("s").picture(_figure(), alt="a line")
        p.write(tmp_path / name)
        return (tmp_path / name).read_bytes()

    assert written("a.html") == written("b.html")
    assert sorted(f.name for f in tmp_path.iterdir()) == ["a.html", "b.html"]


def test_a_page_that_cannot_be_written(tmp_path):
    with pytest.raises(OutputError, match=r"a\.html"):
        page().write(tmp_path / "nowhere" / "a.html")


@pytest.mark.parametrize(
    ("column", "value", "shown"),
    [
        (Column("a", digits=1), -1.25, "-1.2"),
        (Column("a", digits=1), -0.01, "0.0"),
        (Column("a", digits="+.2g"), 0.123, "+0.12"),
        (Column("a"), 1234.5678, "1235"),
        (Column("a", digits=2), 3, 3),
        (Column("a"), None, "-"),
        (Column("a"), float("nan"), "-"),
        (Column("a"), np.float64("inf"), "-"),
        (Column("a", text=True), "over", "over"),
    ],
)
def test_cells(column, value, shown):
    assert column.show(value) == shown


def test_a_row_must_fit_its_columns():
    with pytest.raises(ValueError, match="row 2 of the table has 1 cells for 2 columns"):
        Table([Column("a"), Column("b")], [(1, 2), (1,)])


TABLE = Table(
    [Column("Interface", text=True), Column("largest stroke", "mm", 1), Column("limit", text=True)],
    [("S1-M1", -618.34, failed("over")), ("M1-M2", None, passed())],
    title="Strokes",
    note="At the front: one side.",
)


def test_a_table_on_a_page_is_set_as_print():
    p = page()
    p.section("s").table(TABLE)
    text = re.sub(r"<[^>]+>", " ", p.html())
    assert re.search(r"Strokes\s+Interface\s+largest stroke\s+mm\s+limit", text)
    assert re.search(r"S1-M1\s+−618\.3\s+✗\s+over\s+M1-M2\s+–\s+✓\s+pass\s+At the front", text)


def test_the_same_table_on_a_terminal_is_plain():
    console = new_console()
    with console.capture() as said:
        print_table(console, TABLE)
    lines = [" ".join(line.split()) for line in said.get().splitlines()]
    assert lines[:4] == ["Strokes", "largest", "stroke", "Interface mm limit"]
    assert lines[5:7] == ["S1-M1 -618.3 OVER", "M1-M2 - pass"]


def test_a_table_too_wide_for_a_terminal_goes_on_below():
    wide = Table([Column("Name", text=True), *(Column(f"c{k}", "mm", 3) for k in range(20))], [("M1", *[1.0] * 20)])
    console = new_console()
    with console.capture() as said:
        print_table(console, wide)
    lines = said.get().splitlines()
    assert max(map(len, lines)) <= 80
    assert sum(line.split()[:1] == ["M1"] for line in lines) == 2, "the first column stands in both parts"
    assert said.get().count("1.000") == 20


def test_verdicts_are_told_without_colour():
    signs = [judged(kept).sign for kept in (True, False, None)]
    assert len(set(signs)) == 3
    p = page()
    p.section("s").table(Table([Column("v")], [(failed("past the limit"),), (judged(None),)]))
    assert "✗" in p.html()
    assert "past the limit" in p.html()


def test_plots_know_no_nan():
    trace = line("a", [0.0, 0.1, 0.2], [1.0, np.nan, np.inf], "mm")
    assert trace["y"] == [1.0, None, None]
    assert (trace["x0"], trace["dx"]) == (0.0, 0.1)
    assert "x" not in trace
    assert line("a", [0.0, 0.1, 0.3], [1, 2, 3])["x"] == [0.0, 0.1, 0.3]
    assert numbers([123456.789]) == [123460.0]
    assert dots("a", ["<b>", "c"], [1, 2])["x"] == ["&lt;b&gt;", "c"]


def test_layouts_share_a_look_and_keep_what_is_given():
    layout = layout_of(axes("Time", "s", "Force", "kN", yaxis2={"side": "right"}))
    assert layout["xaxis"]["title"]["text"] == "Time (s)"
    assert layout["yaxis2"]["automargin"]
    assert layout["yaxis2"]["side"] == "right"


def test_shades_run_from_end_to_end():
    scale = ("#000000", "#808080", "#ffffff")
    assert [shade(p, scale) for p in (-1, 0, 0.5, 0.75, 1, 2)] == [
        "#000000",
        "#000000",
        "#808080",
        "#c0c0c0",
        "#ffffff",
        "#ffffff",
    ]


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        ((420.89, 0.9), ["420.89", "0.90"]),
        ((0.619, 0.0078), ["0.619", "0.008"]),
        ((0.00291, None), ["0.00291", "-"]),
        ((1e-12, 0.0), ["0.00", "0.00"]),  # what round-off leaves
    ],
)
def test_a_column_of_small_values_has_the_decimals_to_read_them(values, shown):
    """Breaks if a model's energies are shown as 0.00, or the columns of full-size trains get more digits."""
    table = Table([Column("energy", "kJ", 2)], [(value,) for value in values])
    assert [table.columns[0].show(value) for value in values] == shown


@pytest.mark.parametrize(
    ("digits", "values", "shown"),
    [
        (0, [2.0, 1.0], ["2", "1"]),  # windows are counted
        (0, [0.25, 0.1], ["0.250", "0.100"]),
        (1, [0.0123, 0.0], ["0.0123", "0.0000"]),
        (1, [618.34, 0.0123], ["618.3", "0.0"]),
    ],
)
def test_a_column_has_the_decimals_that_its_largest_value_needs(digits, values, shown):
    """Breaks when the numbers of a small model are shown as zeros, or a count with decimals."""
    (column,) = Table([Column("a", digits=digits)], [(value,) for value in values]).columns
    assert [column.show(value) for value in values] == shown


@pytest.mark.parametrize(("low", "said"), [(0.0, "limit of coupler_a_b"), (-5.25, "two lines: " + "limit " * 9)])
def test_the_name_of_a_limit_has_room_above_its_line(low, said):
    """Breaks if the name of the highest limit is cut at the edge of a plot on paper, where a line takes a tenth."""
    shape = across(5.0, said)
    lines = 1 + shape["label"]["text"].count("<br>")
    top = room_for_name(shape, low)
    assert (top - 5.0) / (top - low) == pytest.approx(0.03 + 0.1 * lines)
