"""The page of trainmj explore as a person uses it, in headless Chromium."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

import trainmj

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def served():
    pytest.importorskip("uvicorn", reason="needs the extra explore")
    words = ["explore", "b_type", "--no-browser", "--set", "simulation.step_ms=0.5"]
    running = subprocess.Popen([sys.executable, "-m", "trainmj", *words], stdout=subprocess.PIPE, text=True)
    yield running.stdout.readline().split()[1]
    running.send_signal(signal.SIGINT)
    assert running.wait(20) == 130  # as every command that Ctrl-C stops


@pytest.fixture
def page(served, browser):
    """The page, open and connected; ``set`` types a value and waits for what it does."""
    context = browser.new_context(viewport={"width": 1400, "height": 900}, accept_downloads=True)
    seen = context.new_page()
    errors, requests = [], []
    seen.on("console", lambda message: errors.append(message.text) if message.type in ("error", "warning") else None)
    seen.on("pageerror", lambda error: errors.append(str(error)))
    seen.on("request", lambda request: requests.append(request.url))
    seen.goto(served)
    seen.wait_for_function("() => document.body.dataset.live === 'yes'")

    def settled():
        seen.wait_for_function("() => document.body.dataset.drawn === document.body.dataset.sent")

    def set_value(name, value):
        field = seen.locator(f"[id='value-{name}']")
        field.fill(str(value))
        field.press("Enter")
        settled()

    yield SimpleNamespace(page=seen, set=set_value, settled=settled, requests=requests)
    assert errors == []
    assert requests == [served]  # and nothing else, anywhere
    context.close()


def test_numbers_follow_a_slider(page):
    """Breaks when a drag does not reach the numbers, the train, the tables or the plots."""
    seen = page.page
    before = seen.inner_text("#bar-numbers"), seen.text_content(".animation")
    box = seen.locator(".control[data-name=speed_km_h] input[type=range]").bounding_box()
    y = box["y"] + box["height"] / 2
    seen.mouse.move(box["x"] + 0.34 * box["width"], y)
    seen.mouse.down()
    for part in (0.4, 0.5, 0.6, 0.7):
        seen.mouse.move(box["x"] + part * box["width"], y)
    seen.mouse.up()
    page.settled()
    speed = float(seen.input_value("[id='value-speed_km_h']"))
    assert speed > 35
    computed = trainmj.summarise(trainmj.run(trainmj.load("b_type", {"speed_km_h": speed, "simulation.step_ms": 0.5})))
    assert f"TS {computed.TS_mm:.1f} mm" in seen.inner_text("#bar-numbers")
    assert seen.inner_text("#bar-numbers") != before[0]
    assert computed.status.kind in seen.inner_text("#bar-status")
    seen.wait_for_function("() => !document.querySelector('.behind')")  # the rest has come
    assert seen.text_content(".animation") != before[1]
    assert computed.status.kind in seen.get_attribute("[data-title=Devices] h2", "data-status")
    seen.locator("[data-title='Over time'] .line-plot").first.scroll_into_view_if_needed()
    seen.wait_for_function("() => document.querySelector(\"[data-title='Over time'] .line-plot\").scales")
    assert seen.evaluate("document.querySelector(\"[data-title='Over time'] .line-plot\").scales.drawn.length") == 12


def test_a_bad_value_is_named_beside_it_and_the_last_good_picture_is_old(page):
    """Breaks when a value that cannot be computed leaves old numbers looking like new ones."""
    seen = page.page
    page.set("empty_stroke_mm", 30)
    good = seen.inner_text("#bar-numbers")
    page.set("mass_t", 3300)
    assert "must be at most 200" in seen.inner_text(".control[data-name=mass_t] .wrong")
    assert seen.inner_text("#bar-numbers") == good
    assert seen.inner_text("#bar-status").startswith("OLD")
    assert "empty_stroke_mm = 30" in seen.inner_text("#state")
    assert seen.locator("#save").is_disabled()
    assert seen.locator("main > section.of-old").count() >= 5
    page.set("mass_t", "heavy")
    assert "must be a number" in seen.inner_text(".control[data-name=mass_t] .wrong")
    page.set("mass_t", 34)
    assert seen.locator(".of-old").count() == 0
    assert seen.locator(".wrong:visible").count() == 0


def test_variants_are_pinned_saved_and_handed_over(page, tmp_path):
    """Breaks when a pinned variant, the saved file or the command is of other values than those on the page."""
    seen = page.page
    seen.click("#pin")
    seen.wait_for_selector("#compared table")
    seen.fill("#find", "front stiffness")
    seen.click("#found button >> nth=0")
    page.set("devices.front.stiffness_kN_per_mm", 1500)
    seen.locator("#editor circle").nth(8).click()
    for _ in range(3):
        seen.keyboard.press("ArrowUp")
    page.settled()
    words = shlex.split(seen.inner_text("#command"))
    sets = dict(word.split("=") for word in words if "=" in word)
    assert sets["devices.front.stiffness_kN_per_mm"] == "1500"
    assert float(sets["curves.buffer.force_kN.8"]) > 800
    assert "curves.buffer.stroke_mm.8" not in sets  # only moved up
    scenario = trainmj.load("b_type", {name: json.loads(value) for name, value in sets.items()})
    summary = trainmj.summarise(trainmj.run(scenario))
    with seen.expect_download() as download:
        seen.click("#save")
    download.value.save_as(tmp_path / download.value.suggested_filename)
    saved = trainmj.summarise(trainmj.run(tmp_path / "b_type_explored.yaml"))
    assert saved.TS_mm == summary.TS_mm
    row = seen.locator("#compared tr", has_text="TS (mm)").first.inner_text().split()
    first = trainmj.summarise(trainmj.run(trainmj.load("b_type", {"simulation.step_ms": 0.5})))
    assert row[-2:] == [f"{summary.TS_mm:.1f}", f"{first.TS_mm:.1f}"]


def test_nothing_is_off_the_screen_of_a_phone(page):
    """Breaks when the page is pushed sideways on a phone."""
    seen = page.page
    seen.set_viewport_size({"width": 390, "height": 844})
    seen.click("#pin")
    seen.wait_for_selector("#compared table")
    page.set("mass_t", 1e6)
    assert seen.evaluate("document.documentElement.scrollWidth") <= 390
    for name in ("#find", "#save", "#curve", "#bar"):
        box = seen.locator(name).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
