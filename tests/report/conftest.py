"""Results that the report tests look at, made once, and a browser to look with."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import trainmj
from trainmj.cli.report import write_report
from trainmj.single.folder import write_run

MARKUP = "<script>window.hacked=1</script><img src=x onerror=window.hacked=1> & Co"
"""What somebody may write into a title."""

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@pytest.fixture(scope="session")
def markup():
    return MARKUP


@pytest.fixture(scope="session")
def run_folder(standard, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports") / "a run"
    folder.mkdir()
    result = trainmj.run(standard.with_values({"title": f"Twin {MARKUP}", "notes": f"Notes {MARKUP}"}))
    write_run(result, trainmj.summarise(result), folder, formats=())
    write_report(folder)
    return folder


@pytest.fixture(scope="session")
def sweep_folder(standard, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports") / "sweep"
    scenario = standard.with_values({"title": MARKUP, "simulation.step_ms": 0.5})
    vary = {
        "empty_stroke_mm": [20.0, 35.0, 50.0],
        "mass_t": [30.0, 36.0, -1.0],
        "collision.partner": ["b_type", "rigid_wall"],
    }
    trainmj.run_sweep(trainmj.grid_of(scenario, vary), folder)
    write_report(folder)
    return folder


STUDY: dict[str, Any] = {
    "title": MARKUP,
    "scenario": "b_type",
    "set": {"simulation.step_ms": 0.5},
    "factors": {
        "D": {"sets": "empty_stroke_mm", "bounds": [20, 50]},
        "C": {"sets": "trains.b_type.coupler", "levels": ["coupler_c_d", "coupler_a_b"]},
    },
    "responses": {"TS": "TS_mm", "TAMA": "TAMA_g", "S_anti": "stroke_S1_M1_anti_climber_mm"},
    "design": {"kind": "full_factorial", "levels": {"D": 4}},
    "surrogates": {"default": {"kind": "polynomial", "order": 1}},
    "objectives": {"TS": "minimise", "TAMA": "minimise"},
    "constraints": {"S_anti": {"at_most": 300}},
    "optimiser": {"on": "both", "seed": 1, "surrogate": {"particles": 10, "iterations": 5},
                  "simulator": {"particles": 6, "iterations": 2}, "resolution": {"D": 5}},
    "cross_validation": {"against": ["linear"]},
}  # fmt: skip


@pytest.fixture(scope="session")
def study_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports") / "study"
    trainmj.run_study(trainmj.study_of(STUDY), folder, figures=())
    write_report(folder)
    return folder


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium without a window."""
    api = pytest.importorskip("playwright.sync_api", reason="needs the Python package playwright")
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"needs a browser: none of {', '.join(BROWSERS)} is installed (Debian's package is chromium)")
    options = ["--no-sandbox"] if os.geteuid() == 0 else []
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=found, args=options)
        yield chromium
        chromium.close()


@dataclass
class Seen:
    """A page that is open, with all that went wrong and all that it asked for."""

    page: Any
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def value(self, script: str) -> Any:
        """What a script in the page gives."""
        return self.page.evaluate(script)


Open = Callable[..., Seen]


@pytest.fixture(scope="module")
def look(browser) -> Iterator[Open]:
    """Open a file as a double click does."""
    contexts = []

    def open_file(file: Path, width: int = 1280, height: int = 900, **options: Any) -> Seen:
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        seen = Seen(context.new_page())
        seen.page.on("console", lambda m: seen.errors.append(m.text) if m.type in ("error", "warning") else None)
        seen.page.on("pageerror", lambda error: seen.errors.append(str(error)))
        seen.page.on("request", lambda request: seen.requests.append(request.url))
        seen.page.goto(file.resolve().as_uri())
        seen.page.wait_for_load_state("load")
        return seen

    yield open_file
    for context in contexts:
        context.close()
