"""From a drag to the redrawn page of `trainmj explore`, in a real browser: ``python benchmarks/explore.py [SCENARIO]``.

A mouse drags a slider for some seconds, as fast as a hand does and in single steps, in one tab and in two at once. Each
input event is timed in the page, up to the second animation frame after the page shows it, or a newer one. No value
comes twice. The time that the server's process computes for one picture is told too: it depends less on what else the
machine does. Needs the Python package playwright and the system's Chromium.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

MEDIAN, WORST = 100.0, 250.0  # ms that are meant to be kept, the worst 5 % left out

WATCH = """(name) => {
  window.times = [];
  const waiting = new Map();
  document.addEventListener("input", (event) => {
    if (event.target.type === "range") waiting.set(Number(document.body.dataset.sent), performance.now());
  });
  document.addEventListener("drawn", (event) => requestAnimationFrame(() => requestAnimationFrame(() => {
    for (const [n, from] of waiting) if (n <= event.detail) {
      window.times.push(performance.now() - from);
      waiting.delete(n);
    }
  })));
}"""


async def drag(page: Any, slider: int, seconds: float, pause: float) -> list[float]:
    """Latencies [ms] of the input events of a drag along a slider."""
    await page.evaluate("window.times.length = 0")
    box = await page.locator(".control input[type=range]").nth(slider).bounding_box()
    y, left, width = box["y"] + box["height"] / 2, box["x"] + 0.2 * box["width"], 0.6 * box["width"]
    await page.mouse.move(left, y)
    await page.mouse.down()
    loop = asyncio.get_running_loop()
    start = loop.time()
    while (part := (loop.time() - start) / seconds) < 1.0:
        await page.mouse.move(left + part * width, y)
        await asyncio.sleep(pause)
    await page.mouse.up()
    await page.wait_for_timeout(1000)
    times: list[float] = await page.evaluate("window.times")
    return times


def computed(pid: int) -> float:
    """Processor time of a process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def measure(address: str, pid: int, seconds: float) -> bool:
    """Print what is found; whether it keeps the bar."""
    from playwright.async_api import async_playwright

    found = next(path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name)))
    kept = True
    async with async_playwright() as playwright:
        options = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = await playwright.chromium.launch(executable_path=found, args=options)
        pages = []
        for _ in range(2):
            context = await browser.new_context(viewport={"width": 1400, "height": 900})
            page = await context.new_page()
            await page.goto(address)
            await page.wait_for_function("() => document.body.dataset.live === 'yes'")
            await page.evaluate(WATCH)
            pages.append(page)
        n = await pages[0].locator(".control input[type=range]").count()
        await drag(pages[0], n - 1, 1.0, 0.016)  # what is compiled on first use
        for name, tabs, pause in (
            ("one tab, dragged without a pause", 1, 0.016),
            ("one tab, in steps of 0.3 s", 1, 0.3),
            ("two tabs, both dragged without a pause", 2, 0.016),
        ):
            for page in pages:  # as given again, so that all drags begin alike
                await page.click("#back")
                await page.wait_for_timeout(1000)
            drawn = [int(await page.evaluate("document.body.dataset.pictures")) for page in pages]
            before = computed(pid)
            drags = (drag(page, (n - 1 - k) % n, seconds, pause) for k, page in enumerate(pages[:tabs]))
            times = np.concatenate(await asyncio.gather(*drags))
            spent = computed(pid) - before
            pictures = sum([int(await page.evaluate("document.body.dataset.pictures")) for page in pages]) - sum(drawn)
            median, worst = np.percentile(times, [50, 95])
            kept &= tabs == 2 or bool(median <= MEDIAN and worst <= WORST)
            print(
                f"{name}: median {median:.0f} ms, 95 % within {worst:.0f} ms, {times.size} events, {pictures} pictures "
                f"of {1000 * spent / max(1, pictures):.0f} ms of processor time each"
            )
        await browser.close()
    return kept


def main() -> int:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="?", default="b_type")
    parser.add_argument("--seconds", type=float, default=6.0, help="of each drag")
    given = parser.parse_args()
    command = [sys.executable, "-m", "trainmj", "explore", given.scenario, "--no-browser"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = server.stdout.readline().split()[1]
        load = os.getloadavg()[0]
        print(f"{given.scenario}, {os.cpu_count()} cores, load {load:.1f} from others")
        kept = asyncio.run(measure(address, server.pid, given.seconds))
    finally:
        server.terminate()
        server.wait(20)
    print(f"{'Keeps' if kept else 'Does not keep'} {MEDIAN:.0f} ms at the median and {WORST:.0f} ms in 95 %.")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
