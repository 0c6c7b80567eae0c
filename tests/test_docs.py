"""What README and docs show works as it is written there.

The default run checks every command's words, every link and every file shown. Running each page from top to bottom, as
a newcomer would in a fresh clone, takes minutes: `pytest -m as_written`, which .ci/run does.
"""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Container
from dataclasses import replace
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import click
import pytest
from pages import PAGES, ROOT, blocks, file_block, read, script, without_blocks

import trainmj
from trainmj.cli import main
from trainmj.collision.lineup import line_up
from trainmj.doe import accuracy, cross_validate, fit_kriging, optimal_latin_hypercube
from trainmj.files.yaml import parse
from trainmj.paper.reproduce import reproduce
from trainmj.reliability.tables import probabilities
from trainmj.verification import kinds

NOT_RUN = {
    ("docs/beyond.md", "they compute the same once already"): 1,
    ("docs/explore.md", "opens a browser, and serves until Ctrl-C"): 1,
    ("docs/identification.md", "takes a quarter of an hour"): 1,
    ("docs/safety.md", "takes an hour"): 1,
    ("docs/safety.md", "takes a quarter of an hour"): 1,
    ("docs/performance.md", "takes a quarter of an hour"): 1,
    ("docs/reliability.md", "they compute the same once already"): 1,
    ("docs/studies.md", "takes several minutes"): 1,
    ("docs/studies.md", "they compute the same once already"): 1,
    ("docs/sweeps.md", "needs a SLURM cluster"): 1,
    ("docs/vertical-plane.md", "they compute the same once already"): 2,
}
"""Blocks that no test runs, by what they say themselves."""

IN_A_CLONE = ["README.md", "docs/start.md"]
"""Pages that begin with the installation, in the order in which they are read."""

TWO_COMMANDS = slice(0, 2)
"""The blocks of the README that install; what follows in it runs at the same time, as other pages do."""

WITH_ONE_STUDY = ["docs/studies.md", "docs/film.md", "docs/reports.md"]
"""Pages that show the study that ships, followed in one folder, where it is computed once and then gone on with."""

IN_THE_README = {"trainmj verify --page verification.html": "trainmj verify", "trainmj paper --out paper": None}
"""Commands that compute longest, whose files no later one needs: run as the README has them, where it is different."""

GENERATED = "reference/"
"""Pages that are made while the site is built, which then checks the links to them."""

QUIET = os.environ | {"NO_MKDOCS_2_WARNING": "1"}  # no advertisement of the theme's successor

EVERY = [block for page in PAGES for block in blocks(page)]


def test_blocks_that_no_test_runs_say_so_and_are_these():
    assert Counter((b.page, b.not_run) for b in EVERY if b.not_run) == NOT_RUN


def test_every_block_is_of_a_kind_that_is_tested():
    assert {b.language for b in EVERY} <= {"sh", "python", "yaml", "text"}
    for page in PAGES:
        hidden = re.search(r"\n\n    (trainmj|pip|python|import|from) .*", without_blocks(page))
        assert hidden is None, f"{page}: a command outside a block: {hidden}"


@pytest.mark.parametrize("page", PAGES)
def test_commands_are_ones_that_the_command_line_takes(page):
    """Each command parses: its name, its options, their values. What it does is tested elsewhere, or as written."""
    for words in (words for block in blocks(page) for words in block.commands):
        name, *rest = words
        above = click.Context(main, **main.context_settings)  # without it a command forgets -h for good
        main.commands[name].make_context(name, list(rest), parent=above)


def test_python_blocks_are_whole():
    for block in EVERY:
        if block.language == "python":
            compile(block.text, block.page, "exec")
            assert block.title or "import " in block.text, f"{block.page}: a block that cannot be pasted: {block.text}"


@pytest.mark.thorough
def test_the_python_of_the_readme_runs(python, tmp_path):
    (code,) = (b.text for b in blocks("README.md") if b.language == "python")
    done = python("-c", code, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    status, ts = done.stdout.split()[:2]
    assert status == "over"
    assert float(ts) == pytest.approx(1345.454, rel=0.01), "Table 5 of the paper at D = 35 mm"


@pytest.mark.parametrize("page", ["README.md", "docs/start.md"])
def test_the_own_curve_of_the_docs_makes_a_sensible_train(page, tmp_path):
    """Its coupler crushes in its tube, and no device passes what it has."""
    for title in ("coupler.csv", "soft.yaml"):
        (tmp_path / title).write_text(file_block(page, title), encoding="utf-8")
    scenario = trainmj.load(tmp_path / "soft.yaml", {"simulation.step_ms": 0.25})
    summary = trainmj.summarise(trainmj.run(scenario))
    assert summary.status.kind == "over"
    assert 950 < summary.interfaces[1].peak_force_kN < 1100


def test_the_whole_scenario_file_of_the_docs_runs(tmp_path):
    (tmp_path / "shuttle.yaml").write_text(file_block("docs/scenario-files.md", "shuttle.yaml"), encoding="utf-8")
    scenario = trainmj.load(tmp_path / "shuttle.yaml", {"mass_t": 38, "trains.shuttle.vehicles.B.mass_t": 34})
    summary = trainmj.summarise(trainmj.run(scenario))
    assert str(summary.status) == "over"
    assert [v.mass_t for v in summary.vehicles] == [38, 34]


def test_the_devices_of_the_docs_are_of_every_kind(tmp_path):
    """Breaks if the page shows a key that is refused, or leaves out a kind."""
    for title in ("shuttle.yaml", "devices.yaml"):
        (tmp_path / title).write_text(file_block("docs/scenario-files.md", title), encoding="utf-8")
    scenario = trainmj.load(tmp_path / "devices.yaml")
    kinds = {device.kind for device in scenario.devices.values()}
    section = read("docs/scenario-files.md").split("\n## Devices\n")[1].split("\n## ")[0]
    assert kinds == set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE))
    assert [car.mass_t for car in scenario.trains["goods"].cars()] == [20, 22.4]


def test_the_vertical_plane_of_the_docs_is_whole(tmp_path):
    """Breaks if the page leaves out what the vertical plane needs, or shows what is refused."""
    for title in ("shuttle.yaml", "vertical.yaml"):
        (tmp_path / title).write_text(file_block("docs/scenario-files.md", title), encoding="utf-8")
    first, second = line_up(tmp_path / "vertical.yaml").vehicles[::-1][:2]
    assert [gear.offset for v in (first, second) if (gear := v.gear)] == [0.04, 0.035]
    assert first.gear is not None
    assert first.gear.body_mass == pytest.approx(29_200)


def test_the_sweep_file_of_the_docs_is_the_plan_it_says(tmp_path):
    for title in ("table.csv", "many.yaml"):
        (tmp_path / title).write_text(file_block("docs/sweeps.md", title), encoding="utf-8")
    assert f"{len(trainmj.load_sweep(tmp_path / 'many.yaml'))} cases" in read("docs/sweeps.md")


def test_the_reliability_file_of_the_docs_is_the_plan_it_says(tmp_path):
    """Breaks if the page shows a key that is refused, or a train that cannot be collided."""
    for title in ("shuttle_train.yaml", "shuttle.reliability.yaml"):
        (tmp_path / title).write_text(file_block("docs/reliability.md", title), encoding="utf-8")
    plan = trainmj.load_reliability(tmp_path / "shuttle.reliability.yaml")
    assert plan.cases == ("as_is", "laden", "faster")
    assert plan.scatter.names == ("masses M1", "masses M2", "head", "friction")


PLATEAU = {"empty_stroke_mm": 50, "mass_t": 32.8, "simulation.step_ms": 0.5}
RISING = {"devices.front.stages.anti_climber.curve": {"stroke_mm": [0, 0.1385, 1147], "force_kN": [0, 1250, 1450]}}


@pytest.mark.parametrize(
    ("changes", "told"),
    [({}, "it keeps {1:.2f} mm and the other one takes {0:.1f} mm"), (RISING, "take {0:.1f} and {1:.1f} mm")],
)
def test_two_unequal_crush_elements_in_series_share_as_told(changes, told):
    """Breaks if the page tells another share of two anti-climbers, of which one is 0.8 % stronger."""
    scenario = trainmj.load("b_type", PLATEAU | changes)
    stroke, force = scenario.curve_points(scenario.devices["front"].stages["anti_climber"].curve)
    stronger = {"stages.anti_climber.curve": {"stroke_mm": stroke, "force_kN": [1260 / 1250 * f for f in force]}}
    as_built = {"as_built": {"S1-M1 partner": stronger}}
    found = trainmj.summarise(trainmj.run(scenario.with_values(as_built)))
    strokes = [i.stages[1].stroke_mm for i in found.interfaces if i.name.startswith("S1-M1")]
    assert told.format(*strokes) in " ".join(read("docs/reliability.md").split())


@pytest.mark.thorough
def test_the_probabilities_of_the_docs_are_those_of_the_command(tmp_path):
    """Breaks if the page tells other numbers than the file that ships gives, or another effect of copies."""
    page = " ".join(read("docs/reliability.md").split())
    plan = trainmj.load_reliability("b_type_as_built")
    plan = replace(plan, spec=plan.spec.model_copy(update={"runs": 256, "sensitivity": None}))
    shown = probabilities(trainmj.run_reliability(plan, tmp_path / "ship", figures=()))
    for title, *cells in (row[:6] for row in shown.rows[2:4]):
        assert " ".join([title, *map(str, cells[:4])]) in page
    for copies, changes, told in (
        ("independent", {}, "passed in every train (P = {:.0f} in 128 draws)"),
        ("same", {}, "`copies: same` in {:.2f} of them"),
        ("independent", RISING, "independent copies pass the limit in {:.2f} of the trains"),
    ):
        front = plan.scenarios[""].tolerances["front"].model_dump(exclude_unset=True) | {"copies": copies}
        tolerances = {name: t.model_dump(exclude_unset=True) for name, t in plan.scenarios[""].tolerances.items()}
        asked = {"scenario": "b_type", "set": PLATEAU | changes, "tolerances": tolerances | {"front": front}}
        asked |= {"runs": 128, "seed": 1}
        found = trainmj.run_reliability(trainmj.reliability_of(asked), tmp_path / f"{copies}{len(changes)}", figures=())
        (anti_climber,) = [one for one in found.passed if "anti_climber" in one.name]
        assert told.format(anti_climber.estimate.value) in page


@pytest.mark.thorough
def test_the_study_of_the_docs_is_sensible_and_ends_as_told(tmp_path):
    """Breaks if the example shows what nobody should copy: exhausted strokes, surrogates that do not fit, no front."""
    (tmp_path / "my.study.yaml").write_text(file_block("docs/studies.md", "my.study.yaml"), encoding="utf-8")
    found = trainmj.run_study(tmp_path / "my.study.yaml", tmp_path / "out", figures=()).summary
    told = " ".join(read("docs/studies.md").split())
    chosen, check = found["decision"]["chosen"], found["check"]
    assert check["kept"]
    assert check["status"] == "over"
    assert found["simulations"]["failed"] == 0
    assert (found["simulations"]["past_limits"], found["simulations"]["n"]) == (4, 20)  # three and one
    assert all(row["r2"] > 0.9 for row in found["surrogates"]["responses"].values())  # the example's own gate
    assert found["trusted"]
    assert [(r["kind"], r["about"]) for r in found["remarks"]] == [("warn", "D")]
    assert not any(row["missed"] for row in check["rows"])
    assert found["fronts_compared"]["ratio_simulated"] == pytest.approx(1, abs=0.02)
    assert found["fronts_compared"]["kept"] == found["fronts_compared"]["points"] > 30
    assert f"D = {chosen['D_mm']:g} mm, M = {chosen['M_t']:g} t and F = {chosen['F_kN']} kN" in told
    strokes = {row["response"]: f"{row['simulated']:.1f}" for row in check["rows"]}
    assert f"{strokes['S_anti']} of the 265 mm" in told
    assert f"{strokes['S12']} of the 418 mm" in told
    assert f"only {100 * found['decision']['share']:.0f} % of weights nearby" in told


@pytest.mark.thorough
def test_the_remarks_of_the_shipped_study_are_those_that_the_docs_read(tmp_path):
    """Breaks if the page explains a warning that is not there, or leaves one out."""
    study = trainmj.load_study("b_type")
    found = trainmj.run_study(study, tmp_path / "out", figures=())
    told = " ".join(read("docs/studies.md").split())
    about = [r["about"] for r in found.summary["remarks"]]
    assert found.summary["trusted"]
    assert about == ["S_anti", "S12", "TS", "TAMA", "D and M", "D"]
    assert f"*verified by simulation, with {len(about)} warnings*" in told
    surrogates = found.summary["surrogates"]["responses"]
    (row,) = (row for row in found.summary["check"]["rows"] if row["response"] == "S_anti")
    assert f"S_anti comes to {265 - row['simulated']:.3g} mm of its 265 mm" in told
    assert f"off by {abs(row['predicted'] - row['simulated']):.3g} mm" in told
    assert f"S12 has an R² of {surrogates['S12']['r2']:.3f}" in told
    assert f"S34 varies by {surrogates['S34']['range']:.2f} mm" in told
    assert f"Its R² of {surrogates['S34']['r2']:.3f} is no fault" in told
    points = optimal_latin_hypercube(study.space, 20, seed=1).points
    table = study.space.table(points).set_axis(["empty_stroke_mm", "mass_t"], axis=1)
    stroke = trainmj.run_cases(study.scenario, table)["stroke_M1_M2_mm"].to_numpy()
    left_out = cross_validate(partial(fit_kriging, space=study.space, seed=0), points, stroke)
    assert f"kriging reaches {accuracy(stroke, left_out).r2:.3f}" in told


@pytest.mark.thorough
def test_the_channels_of_the_docs_give_the_values_it_says(tmp_path, monkeypatch):
    """Breaks if the example finds other values than the page says, or not the known ones."""
    page = "docs/identification.md"
    monkeypatch.chdir(tmp_path)
    for title in ("wagons.yaml", "wagons.targets.yaml"):
        Path(title).write_text(file_block(page, title), encoding="utf-8")
    (code,) = (b.text for b in blocks(page) if b.language == "python" and "impact.csv" in b.text)
    exec(compile(code, page, "exec"), {})
    table = trainmj.identify("wagons.targets.yaml", "out", figures=()).parameters.set_index("parameter")
    stiffness, damping, clock = (table.loc[name, ["value", "low_95", "high_95"]] for name in table.index)
    assert all(row["low_95"] < known < row["high_95"] for row, known in ((stiffness, 150), (damping, 0.1), (clock, 4)))
    told = "{0[0]:.0f} kN/mm (95 % interval: {0[1]:.0f} to {0[2]:.0f}), a damping ratio of {1[0]:.3f} "
    told += "({1[1]:.3f} to {1[2]:.3f}) and {2[0]:.2f} ms ({2[1]:.2f} to {2[2]:.2f})"
    assert told.format(*(row.to_list() for row in (stiffness, damping, clock))) in " ".join(read(page).split())


def test_the_page_on_performance_is_printed_from_its_figures(monkeypatch):
    """Breaks if a number of a table was typed by hand, or the figures were measured and the page not printed."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    tables = importlib.import_module("tables")
    page = read("docs/performance.md")
    assert tables.printed(page, json.loads(read("docs/performance.json"))) == page


@pytest.mark.thorough  # the numbers themselves are held by the tests of the paper
def test_the_numbers_of_the_page_on_the_paper_are_those_of_the_command():
    """Breaks if the page of the docs calls a bar met that is missed, or the other way round."""
    paper = reproduce()
    rows = {v.item: [v.said(x) for x in (v.bar, v.deviation, v.floor)] for v in paper.missed}
    table = [line.strip("| ").split("|") for line in read("docs/paper.md").splitlines() if line.startswith("| Table")]
    told = {
        cells[0].strip().replace(" (held out)", ""): [c.strip() or "-" for c in cells[1:]] + ["-"] * (4 - len(cells))
        for cells in table
        if "wanted" not in cells and len(cells) >= 3 and any(unit in cells[1] for unit in (" %", " mm"))
    }
    assert told == rows
    assert f"{len(paper.judged) - len(paper.missed)} of {len(paper.judged)} bars are met" in read("docs/paper.md")


def test_links_lead_somewhere():
    for page in PAGES:
        folder = (ROOT / page).parent
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", read(page)):
            assert target.startswith(GENERATED) or (folder / target).exists(), f"{page}: {target}"


def test_make_runs_the_test_command_of_the_readme():
    (line,) = [line for b in blocks("README.md") for line in b.text.splitlines() if line.endswith("pytest")]
    assert f"\t{line}" in read("Makefile").splitlines()
    assert read(".ci/run").rstrip().endswith("ci")


def test_contributing_names_targets_that_make_has():
    targets = re.findall(r"^([a-z]+):", read("Makefile"), flags=re.MULTILINE)
    named = re.findall(r"^make ([a-z ]+?)(?:  |$)", read("CONTRIBUTING.md"), flags=re.MULTILINE)
    assert named
    assert {word for words in named for word in words.split()} <= set(targets)


def test_the_citation_is_of_this_version():
    cited = parse(read("CITATION.cff"), "CITATION.cff").values
    assert cited["cff-version"] == "1.2.0"
    assert str(cited["version"]) == version("trainmj")
    assert cited["references"][0]["doi"] in read("README.md")


def test_the_architecture_names_what_is_there():
    """Breaks if a module or name that the page sends its reader to has moved."""
    said = re.findall(r"`([\w./]+)`", without_blocks("docs/architecture.md"))
    packages = {p.parent.name for p in (ROOT / "trainmj").glob("*/__init__.py")}
    modules = [name for name in said if re.fullmatch(r"[a-z_]+(\.\w+)+", name) and name.split(".")[0] in packages]
    assert len(modules) > 20
    for name in modules:
        package, module, *rest = name.split(".")
        home = import_module(f"trainmj.{package}.{module}")
        assert all(hasattr(home, word) for word in rest[:1]), name
    files = [name for name in said if name.split("/")[0] in packages and name.endswith(".py")]
    assert len(files) > 10
    for file in files:
        assert (ROOT / "trainmj" / file).exists(), file


def test_every_public_name_has_its_place_in_the_reference(monkeypatch):
    """Breaks if a public name is missing on the page of Python, without which the site is not built."""
    monkeypatch.syspath_prepend("docs/hooks")
    page = importlib.import_module("api").page()
    assert all(f"trainmj.{name}" in page for name in trainmj.__all__)


LAWS = [block for block in EVERY if block.page == "docs/device-law.md" and block.language == "yaml"]


@pytest.mark.parametrize("block", LAWS, ids=range(len(LAWS)))
def test_the_devices_of_the_page_of_laws_are_accepted(block):
    """Breaks if the page shows a key that is refused, or a device that does not run."""
    devices = parse(block.text, block.page).values["devices"]
    for name in devices:
        values = {
            "devices": devices,
            "trains": {"t": {"vehicles": 2, "mass_t": 40, "front": name, "coupler": name}},
            "collision": {"train": "t", "speed_km_h": 5, "partner": "rigid_wall"},
        }
        summary = trainmj.summarise(trainmj.run(trainmj.Scenario.from_values(values)))
        assert summary.status.kind in ("over", "time limit", "stroke exhausted"), name


def test_exact_numbers_of_the_page_of_laws_are_those_that_are_checked():
    """Breaks if the page promises another outcome than the formula gives, in the digits that it shows."""
    exact = {abs(e.exact) for e in kinds.cases()}
    cells = [line.split("|") for line in read("docs/device-law.md").splitlines() if line.startswith("| ")]
    shown = [c[-3] for c in cells if len(c) > 4 and re.fullmatch(r" [\d.]+ (mm|s|m/s|kN|kJ) ", c[-3])]
    assert len(shown) > 20
    for cell in shown:
        value = float(cell.split()[0])
        assert any(value == pytest.approx(e, rel=1e-6) for e in exact), cell


RECIPES = [
    ("gas.yaml", {}, "over", {"stroke_M1_M2_M1_mm": "89.1 mm"}),
    ("gas.yaml", {"speed_km_h": 15}, "over", {"stroke_M1_M2_M2_mm": "52.0 mm"}),
    ("shunting.yaml", {}, "time limit", {"stroke_S1_M1_mm": "64.6 mm"}),
    ("parked.yaml", {}, "over", {"TS_mm": "1469.8 mm"}),
    ("lorry.yaml", {}, "time limit", {"stroke_S1_M1_mm": "3247 mm", "stroke_S1_M1_partner_mm": "171 mm"}),
    ("stop.yaml", {}, "over", {"stroke_M1_wall_partner_mm": "777 mm", "force_M1_wall_kN": "282 kN"}),
    (
        "seats.yaml",
        {},
        "over",
        {
            "SIV_600mm_M1_m_per_s": "3.08 m/s",
            "SIV_760mm_M1_m_per_s": "3.45 m/s",
            "SIV_600mm_S1_m_per_s": "3.05 m/s",
        },
    ),
    ("metro8.yaml", {}, "curve ended", {"stroke_M1_M2_mm": "1950 mm", "peak_device_M1_g": "1.78 g"}),
    ("metro8_body.yaml", {}, "stroke exhausted", {"stroke_M1_M2_mm": "651.5 mm", "peak_device_M1_g": "4.16 g"}),
]


@pytest.mark.parametrize(("title", "changes", "status", "told"), RECIPES)
def test_a_recipe_ends_as_told(title, changes, status, told, tmp_path):
    """Breaks if a recipe does not run, or the page tells another outcome."""
    for block in blocks("docs/recipes.md"):
        if block.title:
            (tmp_path / block.title).write_text(block.text, encoding="utf-8")
    summary = trainmj.summarise(trainmj.run(trainmj.load(tmp_path / title, changes)))
    assert summary.status.kind == status
    page = " ".join(read("docs/recipes.md").split())
    for column, said in told.items():
        digits = len(said.split()[0].partition(".")[2])
        assert f"{summary.responses[column]:.{digits}f} {said.split()[1]}" == said
        assert said in page


# every page as written


@pytest.mark.as_written
def test_newcomer_as_written(tmp_path):
    """Clone, then the README's two commands and the first page of the docs, each step as it stands."""
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
    for page, part in zip(IN_A_CLONE, (TWO_COMMANDS, slice(None)), strict=True):
        follow(page, clone, clone / ".venv" / "bin", part=part)


@pytest.mark.as_written
def test_readme_as_written(tmp_path):
    """Breaks if a command or program of the README does not do what it says, after its two commands."""
    follow("README.md", tmp_path, Path(sys.executable).parent, part=slice(TWO_COMMANDS.stop, None))


@pytest.mark.as_written
@pytest.mark.parametrize(
    "pages", [WITH_ONE_STUDY, *([page] for page in PAGES if page not in IN_A_CLONE + WITH_ONE_STUDY)], ids=" ".join
)
def test_page_as_written(pages, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    for page in pages:
        follow(page, tmp_path, Path(sys.executable).parent, without=IN_THE_README)


def test_what_is_left_to_the_readme_is_there():
    """Breaks if a command that other pages leave to the README is run nowhere."""
    lines = [line.partition("#")[0].strip() for b in blocks("README.md") for line in b.text.splitlines()]
    elsewhere = [
        line.partition("#")[0].strip() for b in EVERY if b.page not in IN_A_CLONE for line in b.text.splitlines()
    ]
    for command, there in IN_THE_README.items():
        assert command in elsewhere
        assert (there or command) in lines


@pytest.mark.as_written
def test_site_works_without_a_network(tmp_path):
    """Built without a warning; opened from its folder it asks nobody for anything, and its search finds."""
    sync = pytest.importorskip("playwright.sync_api")
    site = tmp_path / "site"
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-d", str(site)], cwd=ROOT, env=QUIET, check=True
    )
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 390, "height": 844})
        wrong: list[str] = []
        page.on("console", lambda m: wrong.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith("file:") else wrong.append(r.url))
        for file in sorted(f for f in site.rglob("*.html") if f.name != "404.html"):  # which only servers show
            page.goto(file.as_uri())
            assert page.evaluate("document.documentElement.scrollWidth") <= 390, f"{file.name} is wider than a phone"
        page.goto((site / "index.html").as_uri())
        page.locator("label[for=__search]").first.click()
        page.keyboard.type("shear", delay=50)
        page.wait_for_selector(".md-search-result__item", state="attached", timeout=20_000)
        browser.close()
    assert wrong == []


def follow(page: str, folder: Path, binaries: Path, without: Container[str] = (), part: slice = slice(None)) -> None:
    """Run a page, without some of its commands, in a folder; what fails is shown with the command that failed."""
    lines = (line for line in script(page, part).splitlines() if line not in without)
    text = "\n".join(line for line in lines if not line.endswith("pytest"))  # .ci/run does that
    outside = {key: value for key, value in os.environ.items() if key not in ("VIRTUAL_ENV", "PYTHONPATH")}
    done = subprocess.run(
        ["bash", "-euxo", "pipefail", "-c", text],
        cwd=folder,
        env=outside | {"PATH": f"{binaries}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=1800,
        check=False,
    )
    assert done.returncode == 0, f"{page}: exit code {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-3000:]}"
