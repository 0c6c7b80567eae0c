"""Reports as a person sees them, in headless Chromium: no error, no request to the net, all is drawn."""

import shutil

import numpy as np
import pytest
from builders import planar
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.files.cover import Cover
from trainmj.output.page import Page
from trainmj.output.table import Table, passed, worded
from trainmj.single.page import page_of_file
from trainmj.single.page_animation import add_animation

pytestmark = pytest.mark.thorough

KINDS = ["run_folder", "sweep_folder", "study_folder"]
WIDTHS = {"desktop": 1280, "phone": 360}

PLOTS = """[...document.querySelectorAll('.plot .canvas')].map((canvas) => {
    const svg = canvas.querySelector('svg.main-svg');
    const marks = canvas.querySelectorAll('.scatterlayer path, .barlayer path, .heatmaplayer image');
    return { width: svg ? svg.clientWidth : 0, height: svg ? svg.clientHeight : 0, marks: marks.length,
             right: canvas.getBoundingClientRect().right };
})"""


@pytest.fixture(params=KINDS)
def report(request):
    return request.getfixturevalue(request.param) / "report.html"


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_everything_is_there_and_nothing_else_is_asked_for(report, look, width, markup):
    seen = look(report, width)
    assert seen.errors == []
    assert seen.requests == [report.resolve().as_uri()]
    for heads, least in (("h1", 1), ("h2", 5), ("nav a", 5), ("table", 2), ("footer pre", 1)):
        shown = [element.is_visible() for element in seen.page.locator(heads).all() if not _folded(element)]
        assert len(shown) >= least
        assert all(shown)
    seen.page.wait_for_function(f"() => {PLOTS}.every((plot) => plot.marks > 0)")
    plots = seen.value(PLOTS)
    assert len(plots) >= 3
    for plot in plots:
        assert plot["width"] > 250
        assert plot["height"] > 150
        assert plot["marks"] > 0
        assert plot["right"] <= width
    assert seen.value("document.documentElement.scrollWidth") <= width  # nothing sticks out sideways
    assert all(
        seen.value("[...document.querySelectorAll('nav a')].map((a) => document.querySelector(a.hash) !== null)")
    )
    assert markup in seen.page.locator("h1").inner_text()  # a name is text
    assert seen.page.locator("h1 script, h1 img, p script, p img").count() == 0
    assert seen.value("window.hacked") is None


def test_an_assessment_fits_a_phone(look, tmp_path):
    """Breaks when the tables of an assessment push the page sideways, or the page asks for something."""
    words = ["assess", "en15227_c1", "--standard", "en15227", "--category", "C-I", "--out", str(tmp_path), "--report"]
    CliRunner().invoke(main, words)
    seen = look(tmp_path / "report.html", 360)
    assert seen.errors == []
    assert len(seen.requests) == 1
    assert seen.value("document.documentElement.scrollWidth") <= 360
    assert seen.page.locator("table").count() >= 5


OFF_PAGE = """(width) => [...document.querySelectorAll("header *, nav *, main *, footer *")].filter((e) => {
    const seen = e.getBoundingClientRect();
    const scrolls = (p) => ["auto", "scroll", "hidden"].includes(getComputedStyle(p).overflowX);
    for (let p = e.parentElement; p; p = p.parentElement)
        if (scrolls(p) && p.getBoundingClientRect().right <= width + 1) return false;
    return seen.width > 0 && (seen.right > width + 1 || seen.left < -1);
}).map((e) => e.outerHTML.slice(0, 80))"""
"""What is past the edge of a page, and not in a block that scrolls."""


LETTERS = "[...document.querySelectorAll('p, td, dd, li')].map((e) => parseFloat(getComputedStyle(e).fontSize))"


@pytest.fixture
def client_page(run_folder, tmp_path):
    """The report of a run with a full head, and a table with long cells of several lines below it."""
    page = page_of_file(run_folder / "result.nc").headed(
        Cover(project="Line 4", client="City", author="A. B.", revision="B", date="2026-05-04")
    )
    rows = [(f"row {n}", "words " * (5 + 7 * n % 40), passed()) for n in range(80)]
    page.section("Long").table(Table([*worded("Row", "what it says", "verdict")], rows))
    page.write(tmp_path / "report.html")
    return tmp_path / "report.html"


def test_a_phone_shows_verdicts_first_and_nothing_off_the_page(client_page, look):
    """Breaks if the verdict is below the first screen, an element is past the edge, or a row's verdict scrolls away."""
    seen = look(client_page, 390, 844)
    whole = seen.page.locator(".whole").bounding_box()
    assert whole["y"] + whole["height"] < 500
    assert seen.value(f"({OFF_PAGE})(390)") == []
    assert seen.value(f"Math.min(...{LETTERS})") >= 13  # pixels
    verdicts = "[...document.querySelectorAll('.scroll td.held')].map((e) => e.getBoundingClientRect().right)"
    assert max(seen.value(verdicts)) <= 390
    bar = seen.page.locator(".bars tbody tr").nth(1)
    assert "227.2 of 265" in bar.inner_text()
    assert bar.locator(".track").bounding_box()["width"] > 300


def test_a_sheet_of_paper_splits_no_row_and_cuts_nothing(client_page, look):
    """Breaks if a row, a card or a bar is split between two pages, or anything is wider than the sheet.

    Columns as large as a sheet break where pages do.
    """
    seen = look(client_page, 688)
    seen.page.emulate_media(media="print")
    seen.value("window.dispatchEvent(new Event('beforeprint'))")
    assert seen.value(f"({OFF_PAGE})(688)") == []
    seen.page.add_style_tag(content="main { columns: 688px; height: 1000px; width: 688px; column-fill: auto; }")
    parts = "[...document.querySelectorAll('tbody tr, .card, .whole')].map((e) => e.getClientRects().length)"
    assert set(seen.value(parts)) <= {0, 1}  # 0 of what is folded away
    assert seen.value("getComputedStyle(document.querySelector('thead')).display") == "table-header-group"
    seen.page.add_style_tag(content="tr { break-inside: auto !important; }")
    assert max(seen.value(parts)) > 1, "otherwise, rows of several lines would be split here"


def _folded(element):
    return element.evaluate("(e) => e.closest('details:not([open])') !== null")


def test_the_page_itself_may_not_ask_for_anything(run_folder, look):
    seen = look(run_folder / "report.html")
    outcome = seen.value("fetch('http://127.0.0.1:9/').then(() => 'went', () => 'refused')")
    seen.value("document.body.append(Object.assign(new Image(), { src: 'http://127.0.0.1:9/x.png' }))")
    script = (
        "document.body.append(Object.assign(document.createElement('script'), { textContent: 'window.hacked = 1' }))"
    )
    seen.value(script)
    assert outcome == "refused"
    assert seen.value("window.hacked") is None
    assert any("Content Security Policy" in error for error in seen.errors)


@pytest.fixture(scope="module")
def opened(run_folder, look):
    """The report of a run on a desktop, opened once for the tests that put it back as it was."""
    return look(run_folder / "report.html")


def test_plots_zoom_and_read_out(opened):
    seen = opened
    canvas = seen.page.locator(".plot .canvas").first
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    before = canvas.evaluate("(c) => c.layout.xaxis.range[1]")
    middle = box["y"] + 0.4 * box["height"]
    seen.page.mouse.move(box["x"] + 0.5 * box["width"], middle)
    seen.page.wait_for_selector(".hoverlayer .legend .traces, .hoverlayer .hovertext")
    assert "M1" in canvas.locator(".hoverlayer").inner_html()
    seen.page.mouse.down()
    seen.page.mouse.move(box["x"] + 0.7 * box["width"], middle, steps=4)
    seen.page.mouse.up()
    seen.page.wait_for_function(
        "(end) => document.querySelector('.plot .canvas').layout.xaxis.range[1] < end", arg=before
    )
    assert seen.errors == []


def test_the_animation_of_the_vertical_plane_shows_step_and_lift(look, tmp_path):
    """Breaks if vehicles stay level or their ends rise by another scale than the list of heights says."""
    result = trainmj.run(
        planar(
            {
                "collision.offset_mm": {"M": 40},
                "collision.speed_km_h": 15,
                "simulation.step_ms": 0.5,
                "simulation.time_limit_s": 0.4,
            }
        )
    )
    page = Page("Plane", command="trainmj run", versions={})
    add_animation(page.section("The collision"), result)
    page.write(tmp_path / "page.html")
    seen = look(tmp_path / "page.html")
    up = """() => {
        const [left, right] = [...document.querySelectorAll('.animation .device')][5].querySelectorAll('.crush');
        return right.getBoundingClientRect().top - left.getBoundingClientRect().top;
    }"""
    drop = seen.page.evaluate(up)
    seen.page.locator(".animation .time").focus()
    seen.page.keyboard.press("End")
    at_end = seen.page.evaluate(up)
    assert at_end / drop == pytest.approx(result.step[-1, result.chain.front] / 0.04, rel=0.02)
    seen.page.select_option(".animation .heights", "3")
    assert seen.page.evaluate(up) == pytest.approx(3 * at_end, rel=0.02)
    middles = """() => [...document.querySelectorAll('.animation .wheel')].map((wheel) => {
        const box = wheel.getBoundingClientRect();
        return (box.top + box.bottom) / 2;
    })"""
    found, rise = np.array(seen.page.evaluate(middles)), result.wheel_rise[-1]
    scale = at_end / result.step[-1, result.chain.front]
    assert rise.max() > 5e-3
    assert found.max() - found == pytest.approx(3 * scale * rise, abs=0.05)
    assert seen.errors == []


class TestAnimation:
    """The side view plays, stops and is moved, with the mouse and with keys."""

    TIME = "Number(document.querySelector('.animation').dataset.time)"
    COUNT = """() => new Promise((done) => {
        const figure = document.querySelector('.animation'), times = new Set();
        figure.querySelector('.play').click();
        const began = performance.now();
        const watch = () => {
            times.add(figure.dataset.time);
            if (performance.now() - began < 1200) requestAnimationFrame(watch);
            else done(times.size);
        };
        watch();
    })"""
    """How many pictures are seen in 1.2 s of playing."""

    @pytest.fixture
    def seen(self, opened):
        opened.page.locator(".animation").scroll_into_view_if_needed()
        yield opened
        opened.page.locator(".animation .time").focus()
        opened.page.keyboard.press("Home")

    def test_waits_until_it_is_played(self, seen):
        seen.page.wait_for_timeout(150)
        assert seen.value(self.TIME) == 0.0
        assert seen.page.locator(".animation .car").count() == 12
        assert seen.page.locator(".animation .device").count() == 11

    def test_plays_and_pauses(self, seen):
        place = "document.querySelector('.animation .car').getAttribute('transform')"
        at_rest = seen.value(place)
        seen.page.get_by_role("button", name="Play").click()
        seen.page.wait_for_function(f"() => {self.TIME} > 0.01")
        seen.page.get_by_role("button", name="Pause").click()
        now = seen.value(self.TIME)
        assert seen.value(place) != at_rest
        seen.page.wait_for_timeout(150)
        assert seen.value(self.TIME) == now

    def test_ends_with_the_numbers_of_the_result(self, seen, standard_summary):
        seen.page.locator(".animation .time").focus()
        seen.page.keyboard.press("End")
        front = standard_summary.interfaces[0]
        energies = [seen.page.locator(f".animation text.energy.{side}").text_content() for side in ("left", "right")]
        assert energies == [f"{front.energy_kJ:.0f}"] * 2, "of either train's side, as the table has it"
        strokes = [seen.page.locator(f".animation text.stroke.{side}").text_content() for side in ("left", "right")]
        assert [float(text) for text in strokes] == pytest.approx([front.stroke_mm] * 2, abs=1.5)
        speeds = [float(t) for t in seen.page.locator(".animation .speed").all_text_contents()]
        finals = {v.name: v.final_speed_km_h for v in standard_summary.vehicles}
        assert speeds == pytest.approx(
            [finals[f"M{i}"] for i in range(6, 0, -1)] + [finals[f"S{i}"] for i in range(1, 7)], abs=0.06
        )

    def test_keys(self, seen):
        slider = seen.page.locator(".animation .time")
        slider.focus()
        seen.page.keyboard.press("Space")
        seen.page.wait_for_function(f"() => {self.TIME} > 0")
        seen.page.keyboard.press("Space")
        now = seen.value(self.TIME)
        seen.page.keyboard.press("ArrowRight")
        assert seen.value(self.TIME) == pytest.approx(now, abs=0.01)
        seen.page.keyboard.press("Home")
        assert seen.value(self.TIME) == 0.0
        assert slider.get_attribute("aria-valuetext") == "0.000 s"

    def test_moves_in_few_steps_where_motion_is_not_wanted(self, seen, run_folder, look):
        calm = look(run_folder / "report.html", reduced_motion="reduce")
        assert 2 <= calm.page.evaluate(self.COUNT) <= 4
        assert seen.page.evaluate(self.COUNT) > 4


def test_print(run_folder, look, tmp_path):
    """Without navigation, plots within the sheet, the animation at its end; afterwards all is as it was."""
    seen = look(run_folder / "report.html")
    widths = [plot["width"] for plot in seen.value(PLOTS)]
    sheet = seen.page.pdf(format="A4")
    (tmp_path / "report.pdf").write_bytes(sheet)
    assert [plot["width"] for plot in seen.value(PLOTS)] == widths
    seen.page.emulate_media(media="print")
    seen.value("window.dispatchEvent(new Event('beforeprint'))")
    assert not seen.page.locator("nav").is_visible()
    assert not seen.page.locator(".animation .play").is_visible()
    assert max(plot["width"] for plot in seen.value(PLOTS)) <= 688  # A4 less its margins, in pixels of CSS
    assert seen.value(TestAnimation.TIME) > 0.5
    assert seen.errors == []
    if shutil.which("pdftotext"):
        import subprocess

        text = subprocess.run(["pdftotext", tmp_path / "report.pdf", "-"], capture_output=True, text=True, check=True)
        assert "TAMA" in text.stdout
