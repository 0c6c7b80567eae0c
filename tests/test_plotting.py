"""The look of figures: sizes of a journal, fonts that stay, files that do not change from run to run."""

from __future__ import annotations

import re
import struct
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.text import Text

from trainmj.cli import main
from trainmj.collision.simulation import run
from trainmj.doe import correlate
from trainmj.errors import OutputError
from trainmj.identification import figures as identified
from trainmj.output.style import BLUE, DPI, FORMATS, ORANGE, PALETTE, WIDTHS, encode, figure, grid, save, styled
from trainmj.scenario import load
from trainmj.single.figures import collision
from trainmj.study import figures as studied
from trainmj.study.page import _add_correlation


@pytest.fixture(scope="module")
def result():
    return run(load("b_type", {"simulation.time_limit_s": 0.1}))


@pytest.fixture(scope="module")
def pictures(result):
    return {width: collision(result, width) for width in WIDTHS}


@pytest.fixture(scope="module")
def files(pictures):
    """A column in every format, other widths as PNG."""
    wanted = [(width, form) for width in pictures for form in FORMATS if width == "column" or form == "png"]
    return {(width, form): encode(pictures[width], form) for width, form in wanted}


@pytest.mark.thorough
def test_the_same_result_gives_the_same_bytes_without_a_date(result, files):
    again = collision(result, "column")
    for form in FORMATS:
        first = files["column", form]
        assert first == encode(again, form), form
        for word in (b"CreationDate", b"ModDate", b"<dc:date>", b"tIME", b"Creation Time"):
            assert word not in first


@pytest.mark.parametrize("width", ["column", "page"])
def test_figures_are_as_wide_as_a_journal_wants_them(pictures, files, width):
    png = files[width, "png"]
    assert struct.unpack(">I", png[16:20])[0] == pytest.approx(WIDTHS[width] / 25.4 * DPI, abs=1)
    across = {round(axes.get_position().x0, 3) for axes in pictures[width].axes}
    assert len(across) == (1 if width == "column" else 2), "panels below each other in a column"


def test_a_figure_is_as_wide_in_every_format(files):
    svg, pdf = files["column", "svg"], files["column", "pdf"]
    points = pytest.approx(WIDTHS["column"] / 25.4 * 72, rel=1e-4)
    assert float(re.search(rb'<svg[^>]* width="([\d.]+)pt"', svg)[1]) == points
    box = [float(x) for x in re.search(rb"/MediaBox \[([^\]]*)\]", pdf)[1].split()]
    assert box[2] - box[0] == points


def test_every_end_of_the_moving_train_is_drawn():
    """Breaks if the lines of a figure are counted by vehicles, so that the devices at rear ends are left out."""
    ends = {"trains.b_type.coupler": None, "trains.b_type.vehicles": 3, "trains.b_type.ends": "coupler_c_d"}
    drawn = collision(run(load("b_type", ends | {"simulation.time_limit_s": 0.05})))
    named = ["S1-M1", "M1-M2 M1", "M1-M2 M2", "M2-M3 M2", "M2-M3 M3"]
    for panel in drawn.axes[1:]:
        assert [line.get_label() for line in panel.lines if line.get_label() != "_limit"] == named


def test_fonts_survive_everywhere(files):
    """TrueType within the PDF, shapes in the SVG: neither needs a font of the reader's machine."""
    pdf, svg = files["column", "pdf"], files["column", "svg"]
    assert b"/FontFile2" in pdf
    assert b"/Subtype /Type3" not in pdf
    assert b"<text" not in svg


@pytest.mark.parametrize("width", ["column", "page"])
def test_legends_keep_clear_of_the_lines(pictures, files, width):
    legends = [(axes, axes.get_legend()) for axes in pictures[width].axes if axes.get_legend() is not None]
    assert len(legends) == 2, "vehicles and interfaces"
    for axes, legend in legends:
        panel = axes.get_window_extent()
        assert legend.get_window_extent().y0 > panel.y1 - 0.03 * panel.height


@pytest.mark.parametrize(("n", "width", "columns"), [(1, "page", 1), (2, "page", 2), (7, "page", 3), (7, "column", 1)])
def test_panels_stand_side_by_side_where_there_is_room(n, width, columns):
    with styled(width):
        picture, panels = grid(n, 40.0)
    picture.draw_without_rendering()
    assert len(panels) == n
    assert len({round(axes.get_position().x0, 2) for axes in panels}) == columns
    assert picture.get_figwidth() * 25.4 == pytest.approx(WIDTHS["column" if n == 1 else width])


@pytest.mark.thorough
def test_titles_and_numbers_are_read_as_written(result):
    """A dollar is a dollar, and no number of an axis shows the marks of a formula."""
    odd = replace(result, scenario=load("b_type", {"title": "5 $ and $\\nonsense{ $"}))
    picture = collision(odd)
    encode(picture, "pdf")
    texts = [t.get_text() for t in picture.findobj(Text)]
    assert any("$\\nonsense{" in t for t in texts)
    assert not [t for t in texts if "mathdefault" in t]


def test_the_style_leaves_other_figures_alone():
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    with styled("column"):
        assert figure().get_figwidth() * 25.4 == pytest.approx(WIDTHS["column"])
        assert mpl.rcParams["pdf.fonttype"] == 42
    assert dict(mpl.rcParams) == before


def test_colours_differ_for_colour_blind_eyes():
    """By lightness or hue after Vienot's simulation of missing red or green cones (1999, doi 10.1002/
    (SICI)1520-6378(199908)24:4<243::AID-COL5>3.0.CO;2-3)."""
    from matplotlib.colors import to_rgb

    linear = np.array([to_rgb(c) for c in PALETTE]) ** 2.2
    protan = np.array([[0.1124, 0.8876, 0.0], [0.1124, 0.8876, 0.0], [0.0040, -0.0040, 1.0]])
    deutan = np.array([[0.2928, 0.7072, 0.0], [0.2928, 0.7072, 0.0], [-0.0223, 0.0223, 1.0]])
    for seen in (np.eye(3), protan, deutan):
        shown = np.clip(linear @ seen.T, 0, 1) ** (1 / 2.2)
        apart = np.linalg.norm(shown[:, None] - shown[None], axis=2)[np.triu_indices(len(PALETTE), 1)]
        assert apart.min() > 0.12


def test_save_writes_each_format_and_says_what_it_cannot(tmp_path):
    picture = figure()
    written = save(picture, tmp_path / "crash", FORMATS)
    assert [f.name for f in written] == ["crash.png", "crash.svg", "crash.pdf"]
    assert [f.read_bytes()[:4] for f in written] == [b"\x89PNG", b"<?xm", b"%PDF"]
    with pytest.raises(OutputError, match="cannot be written"):
        save(picture, tmp_path / "missing" / "crash", ["png"])


@pytest.mark.thorough
def test_formats_are_chosen_on_the_command_line(tmp_path, capsys):
    for formats, expected in (("svg,PDF", {"collision.svg", "collision.pdf"}), ("none", set())):
        out = tmp_path / formats
        command = ["run", "b_type", "--set", "simulation.time_limit_s=0.05", "--out", str(out), "--figures", formats]
        with pytest.raises(SystemExit) as stop:
            main(command)
        assert stop.value.code == 0
        assert {f.name for f in out.iterdir() if f.stem == "collision"} == expected
    with pytest.raises(SystemExit) as stop:
        main(["run", "b_type", "--figures", "png,gif"])
    assert stop.value.code == 2
    assert "'gif' is not a format of figures; known: png, svg, pdf" in capsys.readouterr().err


def test_a_positive_correlation_is_blue_in_every_picture():
    """Breaks if one picture of a report is red for what another is blue for."""
    known = SimpleNamespace(correlation=np.array([[1.0, -0.5], [-0.5, 1.0]]))
    found = SimpleNamespace(known=known, plan=SimpleNamespace(unknowns=SimpleNamespace(names=["a", "b"])))
    x = np.arange(12.0)
    matrix = correlate(np.stack([x, (x * 5) % 12], axis=1), np.stack([x, -x], axis=1))
    blue, orange = to_rgba(BLUE), to_rgba(ORANGE)
    with styled():
        for picture in (identified.correlations(found), studied.correlations([matrix])):
            (image,) = picture.axes[0].images
            assert image.get_clim() == (-1, 1)
            assert image.to_rgba([1.0, -1.0, 0.0]).tolist() == [list(blue), list(orange), [1, 1, 1, 1]]
    drawn = []
    section = SimpleNamespace(text=lambda *_: None, plot=lambda traces, *_, **__: drawn.extend(traces))
    table = matrix.table().rename(columns={"x": "factor", "y": "response"}).assign(method="pearson", n=12)
    _add_correlation(section, {"correlation": {"level": 0.95}}, table)
    assert [drawn[0][key] for key in ("zmin", "zmax")] == [-1, 1]
    assert drawn[0]["colorscale"] == [[0.0, ORANGE], [0.5, "#ffffff"], [1.0, BLUE]]
