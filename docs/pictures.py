"""Make the pictures of README and docs: ``python docs/pictures.py [NAME ...]``, all of them without a name.

The film needs OSMesa, the pictures of a report and of explore need Chromium; the others need only trainmj.
"""

from __future__ import annotations

import copy
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

os.environ.setdefault("MUJOCO_GL", "osmesa")

import numpy as np
from matplotlib.axes import Axes
from PIL import Image

import trainmj
from trainmj.collision.chain import Element, meet
from trainmj.collision.device import Device
from trainmj.collision.envelope import Array
from trainmj.collision.press import force_along
from trainmj.output import style
from trainmj.output.style import save
from trainmj.paper.beyond import judge_beyond
from trainmj.paper.page_beyond import figures

FOLDER = Path(__file__).resolve().parent / "images"

FRICTION_GEAR: dict[str, Any] = {
    "kind": "hysteresis",
    "empty_stroke_mm": 50,
    "loading": {"stroke_mm": [0, 90], "force_kN": [240, 2553]},
    "unloading": {"stroke_mm": [0, 90], "force_kN": [50, 306.5]},
    "transition_stiffness_kN_per_mm": 250,
    "beyond": "stop",
}
GAS_BUFFER: dict[str, Any] = {
    "kind": "gas_hydraulic",
    "stroke_mm": 100,
    "orifice_kN_s2_per_m2": 40,
    "gas": {"force_kN": 50, "length_mm": 120, "exponent": 1.3, "preload_stiffness_kN_per_mm": 100},
    "rebound_orifice_kN_s2_per_m2": 400,
    "beyond": {"kind": "stop", "stiffness_kN_per_mm": 100},
}
"""As in docs/scenario-files.md."""


def law_crush() -> None:
    """Loading, unloading and reloading of a crushed device, without and with a dashpot."""
    spec = {"curve": {"stroke_mm": [0, 40, 120], "force_kN": [0, 600, 800]}, "stiffness_kN_per_mm": 40}
    with style.styled():
        picture = style.figure(height=64)
        panels = picture.subplots(1, 2, sharey=True)
        for axes, damping in zip(panels, (0, 120), strict=True):
            tube = _device(spec | {"damping_kN_s_per_m": damping})
            axes.plot(
                tube.envelope.stroke * 1e3, tube.envelope.force / 1e3, color=style.GREY, ls="--", label="envelope"
            )
            _loop(axes, tube, [0, 60, 46, 95, 72], 1.0, color=style.BLUE, label="force")
            axes.set_title("no dashpot" if damping == 0 else f"c = {damping:g} kN s/m, 1 m/s")
            axes.set_xlabel("stroke u (mm)")
            axes.annotate("uₚ", (76.4, 0), (88, 90), arrowprops={"arrowstyle": "->"})
            axes.set_ylim(0, 850)
        panels[0].annotate("slope K", (54, 360), (64, 240), arrowprops={"arrowstyle": "->"})
        panels[0].set_ylabel("force (kN)")
        panels[0].legend(loc="upper left")
    save(picture, FOLDER / "law_crush", ["svg"])


def law_stages() -> None:
    """How the keys of a file shape the envelope of a device in two stages."""
    stages = {
        "coupler": {
            "curve": {"stroke_mm": [0, 30, 73, 250], "force_kN": [0, 600, 800, 800]},
            "shear_off": {"force_kN": 1000, "ramp_mm": 3},
        },
        "anti_climber": {
            "empty_stroke_mm": 60,
            "curve": {"stroke_mm": [0, 5, 300], "force_kN": [0, 1250, 1250]},
            "stroke_limit_mm": 265,
        },
    }
    envelope = _device({"stages": stages, "stiffness_kN_per_mm": 300, "beyond": "hold"}).envelope
    with style.styled():
        picture = style.figure(height=72)
        axes = picture.subplots()
        axes.plot(envelope.stroke * 1e3, envelope.force / 1e3, color=style.BLUE)
        axes.set(xlabel="stroke of the device (mm)", ylabel="force (kN)", ylim=(-260, 1400), xlim=(0, 620))
        axes.axhline(0, color="0.3", lw=0.8)
        for start, end, text in (
            (0, 250, "coupler: curve"),
            (250, 310, "empty_\nstroke_mm"),
            (310, 575, "anti_climber: stroke_limit_mm"),
        ):
            axes.annotate("", (start, -60), (end, -60), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
            axes.text((start + end) / 2, -90, text, ha="center", va="top", fontsize=7)
        axes.annotate(
            "shear_off: up to force_kN and\ndown to 0, over ramp_mm each",
            (253, 1000),
            (60, 1130),
            arrowprops={"arrowstyle": "->"},
        )
        axes.set_yticks(range(0, 1401, 200))
    save(picture, FOLDER / "law_stages", ["svg"])


def law_beyond() -> None:
    """What follows at the end of a curve, as `beyond` states it."""
    spec = {"curve": {"stroke_mm": [0, 40, 150], "force_kN": [0, 600, 800]}, "stiffness_kN_per_mm": 50}
    ends = {"hold, or nothing stated": "hold", "car_body": "car_body", "stop": "stop"}
    with style.styled():
        picture = style.figure(height=64)
        axes = picture.subplots()
        for (label, beyond), line in zip(ends.items(), (":", "-", "--"), strict=True):
            _loop(axes, _device(spec | {"beyond": beyond}), [0, 260], ls=line, label=f"beyond: {label}")
        axes.axvline(150, color=style.GREY, lw=0.8)
        axes.text(152, 60, "end of the curve", fontsize=7)
        axes.axhline(2000, color=style.GREY, lw=0.8)
        axes.text(2, 2030, "collapse force", va="bottom", fontsize=7)
        axes.set(xlabel="stroke (mm)", ylabel="force (kN)", xlim=(0, 260), ylim=(0, 2600))
        axes.legend(loc="center left", bbox_to_anchor=(0.02, 0.58))
    save(picture, FOLDER / "law_beyond", ["svg"])


def law_rate() -> None:
    """The crush force at several speeds: by the formula of Cowper and Symonds, and by curves."""
    spec = {"curve": {"stroke_mm": [0, 10, 80], "force_kN": [0, 900, 900]}, "stiffness_kN_per_mm": 100}
    at = [
        {"speed_m_per_s": v, "curve": {"stroke_mm": [0, 10, 80], "force_kN": [0, f, f]}}
        for v, f in ((2, 980), (5, 1050))
    ]
    with style.styled():
        picture = style.figure(height=64)
        panels = picture.subplots(1, 2, sharey=True)
        for axes, rate, title in (
            (panels[0], {"C_m_per_s": 20, "P": 5}, "C = 20 m/s, P = 5"),
            (panels[1], {"curves": at}, "curves at 2 and 5 m/s"),
        ):
            tube = _device(spec | {"rate": rate, "beyond": "hold"})
            for speed, line in ((0.0, "-"), (1.0, "--"), (5.0, "-."), (10.0, ":")):
                _loop(axes, tube, [0, 40, 30, 60, 40], speed, ls=line, label=f"{speed:g} m/s" if speed else "at rest")
            axes.set(title=title, xlabel="stroke (mm)", ylim=(0, 2300))
            axes.legend(loc="upper left", ncols=2)
        panels[0].set_ylabel("force (kN)")
    save(picture, FOLDER / "law_rate", ["svg"])


def law_hysteresis() -> None:
    """A friction draft gear in its slack, inwards, outwards and in again."""
    gear = _device(FRICTION_GEAR)
    with style.styled():
        picture = style.figure(height=68)
        axes = picture.subplots()
        for key, line in (("loading", "--"), ("unloading", ":")):
            curve = FRICTION_GEAR[key]
            u = np.array(curve["stroke_mm"]) + FRICTION_GEAR["empty_stroke_mm"]
            axes.plot(u, curve["force_kN"], color=style.GREY, ls=line, label=key)
        _loop(axes, gear, [0, 100, 80, 125, 118, 130, 0], color=style.BLUE, label="force")
        axes.annotate("transition stiffness", (99.0, 1150), (56, 1500), arrowprops={"arrowstyle": "->"})
        axes.annotate("empty stroke", (25, 20), (25, 300), ha="center", arrowprops={"arrowstyle": "->"})
        axes.set(xlabel="stroke (mm)", ylabel="force (kN)", xlim=(0, 145), ylim=(0, 2700))
        axes.legend(loc="upper left")
    save(picture, FOLDER / "law_hysteresis", ["svg"])


def law_hydraulic() -> None:
    """Oil through a metered orifice at three speeds; oil and gas, in and out again."""
    stop = {"kind": "stop", "stiffness_kN_per_mm": 100}
    metering = {"stroke_mm": [0, 50, 105], "orifice_kN_s2_per_m2": [20, 40, 200]}
    oil = _device({"kind": "hydraulic", "stroke_mm": 105, "metering": metering, "beyond": stop})
    gas = _device(GAS_BUFFER)
    with style.styled():
        picture = style.figure(height=64)
        left, right = picture.subplots(1, 2)
        for speed, line in ((1.0, "-"), (2.0, "--"), (3.0, ":")):
            _loop(left, oil, [0, 108, 0], speed, ls=line, label=f"{speed:g} m/s")
        left.set(title="hydraulic, metered", xlabel="stroke (mm)", ylabel="force (kN)", ylim=(0, 2200))
        for speed, line in ((0.01, "-"), (0.3, "--"), (1.0, "-."), (2.0, ":")):
            _loop(right, gas, [0, 90, 0], speed, ls=line, label=f"{speed:g} m/s")
        right.set(title="gas_hydraulic, in and out", xlabel="stroke (mm)", ylim=(0, 650))
        for axes in (left, right):
            axes.legend(loc="upper left")
    save(picture, FOLDER / "law_hydraulic", ["svg"])


def law_pull() -> None:
    """A coupling that is pressed, drawn apart through its slack, and broken."""
    spec = {
        "curve": {"stroke_mm": [0, 20, 100], "force_kN": [0, 500, 500]},
        "stiffness_kN_per_mm": 50,
        "pull": {"stiffness_kN_per_mm": 50, "slack_mm": 10, "breaking_force_kN": 600},
    }
    strokes = _ways([0, 30, 0, -18, -5, -40])
    force = sum(force_along(element, strokes * 1e-3)[0] for element in meet(_device(spec)))
    with style.styled():
        picture = style.figure(height=64)
        axes = picture.subplots()
        axes.plot(strokes, force / 1e3, color=style.BLUE)
        axes.axhline(0, color="0.3", lw=0.8)
        axes.axvline(0, color="0.3", lw=0.8)
        axes.annotate("slack_mm", (-5, 0), (-5, 160), ha="center", arrowprops={"arrowstyle": "->"})
        axes.annotate("breaking_force_kN: no force from here on", (-22, -600), (-38, -700))
        axes.set(xlabel="stroke of the interface (mm); apart where negative", ylabel="force (kN)", ylim=(-760, 620))
    save(picture, FOLDER / "law_pull", ["svg"])


def law_series() -> None:
    """Two devices in series, pressed, released and pressed again."""
    left = _device({"curve": {"stroke_mm": [0, 40, 200], "force_kN": [0, 600, 600]}, "stiffness_kN_per_mm": 40})
    right = _device(
        {"curve": {"stroke_mm": [0, 40, 120, 140, 300], "force_kN": [0, 400, 400, 900, 900]}, "stiffness_kN_per_mm": 40}
    )
    strokes = _ways([0, 110, 95, 280, 255])
    force, sides = force_along(meet(left, right)[0], strokes * 1e-3)
    with style.styled():
        picture = style.figure(height=64)
        one, both = picture.subplots(1, 2, sharey=True)
        for axes, paths in (
            (one, [(left.envelope.stroke, left.envelope.force), (right.envelope.stroke, right.envelope.force)]),
            (both, [(sides[:, 0], force), (sides[:, 1], force)]),
        ):
            for (u, f), colour, line, label in zip(
                paths, (style.BLUE, style.ORANGE), ("-", "--"), ("left device", "right device"), strict=True
            ):
                axes.plot(u * 1e3, f / 1e3, color=colour, ls=line, label=label)
        both.plot(strokes, force / 1e3, color="0.2", lw=0.9, label="pair")
        one.set(title="curves", xlabel="stroke (mm)", ylabel="force (kN)", xlim=(0, 330))
        both.set(title="in series: equal force, strokes added", xlabel="stroke (mm)", xlim=(0, 300))
        for axes in (one, both):
            axes.set_ylim(0, 1250)
            axes.legend(loc="upper left")
    save(picture, FOLDER / "law_series", ["svg"])


def law_paths() -> None:
    """A front of two B-type ends of which one has stronger bolts, around where the weaker ones shear."""
    scenario = trainmj.load("b_type").values()
    near = scenario["devices"]["front"]
    far = copy.deepcopy(near)
    far["stages"]["coupler"]["shear_off"]["force_kN"] = 1260
    left, right = (_device(spec, scenario["curves"]) for spec in (near, far))
    strokes = _ways([0, 900], 9000)
    ways = {
        "two paths, as computed": meet(left, right, coupled=False),
        "one path, for comparison": (Element((left.law, right.law), starts=(0.0, 0.0)),),
    }
    with style.styled():
        picture = style.figure(height=68)
        axes = picture.subplots()
        for (label, elements), line in zip(ways.items(), ("-", ":"), strict=True):
            force = np.sum([force_along(element, strokes * 1e-3)[0] for element in elements], axis=0)
            axes.plot(strokes, force / 1e3, ls=line, label=label)
        axes.annotate("the weaker bolts shear", (707, 1200), (640, 1400), arrowprops={"arrowstyle": "->"})
        axes.annotate(
            "the anti-climbers\nmeet at 2 x 375 mm", (750.5, 400), (775, 320), arrowprops={"arrowstyle": "->"}
        )
        axes.set(xlabel="closing of the front (mm)", ylabel="force (kN)", xlim=(620, 850), ylim=(0, 1700))
        axes.legend(loc="upper right")
    save(picture, FOLDER / "law_paths", ["svg"])


def b_type_devices() -> None:
    """The envelopes of the shipped train."""
    scenario = trainmj.load("b_type")
    with style.styled():
        picture = style.figure(height=68)
        axes = picture.subplots()
        looks = zip(scenario.devices, style.PALETTE, ("-", "--", ":", "-."), strict=False)
        for name, colour, line in looks:
            envelope = _device(scenario.values()["devices"][name], scenario.values()["curves"]).envelope
            axes.plot(envelope.stroke * 1e3, envelope.force / 1e3, color=colour, ls=line, label=name)
        axes.set(xlabel="stroke (mm)", ylabel="force (kN)", xlim=(0, 700), ylim=(0, 1400))
        axes.legend(loc="lower right")
    save(picture, FOLDER / "b_type_devices", ["svg"])


def b_type() -> None:
    """The figure of a run."""
    with tempfile.TemporaryDirectory() as folder:
        _trainmj("run", "b_type", "--out", folder)
        _smaller(Path(folder, "collision.png"), FOLDER / "b_type.png", 1400)


def crash() -> None:
    """A film, small enough for a README."""
    from trainmj.view import render

    render(trainmj.run(trainmj.load("b_type")), FOLDER / "crash.webp", slow=0.2, size=(720, 405), fps=12)


def report() -> None:
    """The first screen of the report of a run."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        sys.exit("the picture of the report needs a Chromium: apt install chromium")
    with tempfile.TemporaryDirectory() as folder:
        _trainmj("run", "b_type", "--out", folder, "--figures", "none", "--report")
        shot = Path(folder, "shot.png")
        page = Path(folder, "report.html").as_uri()
        options = ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--window-size=1180,1500"]
        command = [
            browser,
            *options,
            "--virtual-time-budget=4000",
            f"--user-data-dir={folder}/profile",
            f"--screenshot={shot}",
            page,
        ]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
        _smaller(shot, FOLDER / "report.png", 1180)


def explore() -> None:
    """The page of trainmj explore, with a variant that is pinned and a value that was changed."""
    from playwright.sync_api import sync_playwright

    words = [sys.executable, "-m", "trainmj", "explore", "b_type", "--no-browser"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as served, sync_playwright() as playwright:
        assert served.stdout is not None
        address = served.stdout.readline().split()[1]
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address)
        field = page.locator("[id='value-empty_stroke_mm']")
        field.fill("35")
        field.press("Enter")
        page.wait_for_timeout(2000)
        with tempfile.TemporaryDirectory() as folder:
            page.screenshot(path=Path(folder, "shot.png"))
            _smaller(Path(folder, "shot.png"), FOLDER / "explore.png", 1180)
        browser.close()
        served.terminate()


def plane_vehicle() -> None:
    """A vehicle in the vertical plane from the side: its degrees of freedom, and the keys of its dimensions."""
    with style.styled():
        picture = style.figure(height=80)
        axes = picture.subplots()
        _body(axes, 0.0, 19.0, 1.1, 3.4)
        axes.plot(0, 1.9, "ko", ms=5)
        for bogie in (-6.3, 6.3):
            _bogie(axes, bogie)
        axes.axhline(0, color="0.3", lw=1.2)
        arrow = {"arrowstyle": "->", "color": style.ORANGE, "lw": 1.3}
        for start, end, text, at in (
            ((0, 1.9), (2.2, 1.9), "x", (2.4, 1.8)),
            ((0, 1.9), (0, 3.1), "z", (0.2, 3.0)),
            ((-6.3, 0.6), (-6.3, 1.6), "s", (-6.0, 1.35)),
            ((-8.15, 0.42), (-8.15, 1.25), "w", (-8.75, 1.0)),
        ):
            axes.annotate("", end, start, arrowprops=arrow)
            axes.text(*at, text, color=style.ORANGE)
        axes.annotate("", (1.3, 2.6), (1.5, 1.4), arrowprops=arrow | {"connectionstyle": "arc3,rad=0.45"})
        axes.text(1.9, 2.5, "θ", color=style.ORANGE)
        axes.annotate("", (-7.2, 0.95), (-5.5, 0.95), arrowprops=arrow | {"connectionstyle": "arc3,rad=0.3"})
        axes.text(-7.5, 0.98, "φ", color=style.ORANGE)
        for left, right, z, text in ((-6.3, 6.3, -0.9, "centres_m"), (5.15, 7.45, -0.45, "wheelbase_m")):
            _between(axes, (left, z), (right, z), text, (0.5 * (left + right), z - 0.08), ha="center", va="top")
        for x, z, text in (
            (4.3, 0.42, "axle_height_m"),
            (11.2, 0.66, "height_mm\nof a coupler"),
            (15.4, 0.95, "height_mm of\nan anti-climber"),
            (-0.7, 1.9, "cog_height_m"),
            (-5.0, 0.6, "link_height_m"),
        ):
            left = x in (4.3, -0.7)
            at = (x - 0.15, 0.25 if z < 1 else 0.85) if left else (x + 0.15, 0.3)
            _between(axes, (x, 0), (x, z), text, at, ha="right" if left else "left", va="center", fontsize=6)
        axes.plot([4.2, 5.15], [0.42, 0.42], color="0.6", lw=0.7)
        axes.plot([-6.3, -4.9], [0.6, 0.6], color="0.6", lw=0.7)
        axes.plot(-6.3, 0.6, "ko", ms=3)
        axes.plot([9.5, 11.5], [0.66, 0.66], color=style.BLUE, lw=2.5)
        axes.plot([9.5, 15.6], [0.95, 0.95], color="0.6", lw=0.7)
        axes.plot([9.5, 9.5], [0.85, 1.05], color=style.BLUE, lw=5)
        axes.text(-6.3, -0.35, "frame_t, wheelset_t", ha="center", va="top", fontsize=6)
        axes.text(-3.7, 2.3, "body: what the vehicle weighs,\nless frames and wheelsets", ha="center", fontsize=7)
        axes.set(xlim=(-10.5, 18.5), ylim=(-1.35, 3.7))
        axes.set_axis_off()
    save(picture, FOLDER / "plane_vehicle", ["svg"])


def plane_lines() -> None:
    """A strut between two pins and two faces that meet, between ends that stand at different heights."""
    with style.styled():
        picture = style.figure(height=74)
        strut, faces = picture.subplots(1, 2)
        arrow = {"arrowstyle": "->", "color": style.ORANGE, "lw": 1.3}
        pins = (-3.0, 0.9), (3.0, 0.1)
        for axes, title in ((strut, "acts: strut"), (faces, "acts: face")):
            axes.set_title(title)
            axes.set(xlim=(-5.2, 5.2), ylim=(-1.7, 2.6))
            axes.set_axis_off()
        for (x, z), outwards in zip(pins, (-1, 1), strict=True):
            _end(strut, x, z, outwards)
            strut.plot(x, z, "ko", ms=5)
            strut.plot([x, x - outwards * 1.6], [z, z], color="0.5", ls=":")
        strut.plot(*zip(*pins, strict=True), color=style.BLUE, lw=3)
        strut.annotate("", (1.0, 0.56), (-0.5, 0.76), arrowprops=arrow)
        strut.text(0.2, 0.75, "n", color=style.ORANGE)
        strut.text(-1.35, 1.5, "ψ - θ: beyond free_mrad\nthe stop turns it back", fontsize=7)
        below = [(x, z - 0.55) for x, z in pins]  # along the strut, as its length is
        _between(strut, *below, "D = D₀ - u", (-0.4, -0.35), ha="center", va="top")
        strut.text(-3.1, 1.35, "pin", ha="right", fontsize=7)
        for x, z, outwards in ((-0.12, 0.8, -1), (0.12, 0.2, 1)):
            _end(faces, x + outwards * 1.2, z, outwards)
            faces.plot([x, x + outwards * 1.2], [z, z], color=style.BLUE, lw=3)
            faces.plot([x, x], [z - 0.8, z + 0.8], color=style.BLUE, lw=4)
        faces.annotate("", (1.9, 1.75), (0.1, 1.75), arrowprops=arrow)
        faces.text(2.0, 1.65, "n: the mean pitch", color=style.ORANGE)
        faces.annotate("", (0.1, 2.5), (0.1, 1.75), arrowprops=arrow)
        faces.text(0.3, 2.35, "t", color=style.ORANGE)
        faces.plot([0.12, 0.75], [0.8, 0.8], color="0.6", lw=0.7)
        _between(faces, (0.6, 0.2), (0.6, 0.8), "s", (0.75, 0.5), ha="left", va="center")
        _between(faces, (-0.5, 0.0), (-0.5, 1.6), "overlap_mm", (-0.55, -0.1), ha="right", va="top")
        faces.text(0, -0.85, "tie: friction, tooth_kN,\nover kN_per_mm of slip", ha="center", va="top", fontsize=7)
    save(picture, FOLDER / "plane_lines", ["svg"])


def _between(axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str, at: tuple[float, float],
             **look: Any) -> None:  # fmt: skip
    """A dimension between two points."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, "color": "0.3"})
    axes.text(*at, text, **{"fontsize": 7} | look)


def _body(axes: Axes, middle: float, length: float, low: float, high: float) -> None:
    """A car body from the side."""
    left, right = middle - 0.5 * length, middle + 0.5 * length
    axes.fill([left, right, right, left], [low, low, high, high], fc="0.93", ec="0.3", lw=1.0)


def _bogie(axes: Axes, middle: float) -> None:
    """A frame on two wheelsets, below its secondary spring."""
    for wheel in (-1.15, 1.15):
        turn = np.linspace(0, 2 * np.pi, 60)
        axes.plot(middle + wheel + 0.95 * np.cos(turn), 0.42 + 0.42 * np.sin(turn), color="0.3", lw=1.0)
        _spring(axes, middle + wheel, 0.42, 0.72)
    axes.plot([middle - 1.5, middle + 1.5], [0.75, 0.75], color="0.3", lw=4)
    _spring(axes, middle + 0.35, 0.78, 1.1)


def _spring(axes: Axes, x: float, low: float, high: float) -> None:
    """An upright spring."""
    z = np.linspace(low, high, 9)
    axes.plot(x + 0.18 * np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]), z, color=style.BLUE, lw=1.0)


def _end(axes: Axes, x: float, z: float, outwards: int) -> None:
    """The end of a vehicle behind a pin or a device."""
    far = x + outwards * 1.8
    axes.fill([x, far, far, x], [z - 0.5, z - 0.5, z + 1.4, z + 1.4], fc="0.93", ec="0.3", lw=1.0)


def _device(spec: Mapping[str, Any], curves: Mapping[str, Any] | None = None) -> Device:
    """The device of a scenario, which needs a vehicle and a wall around it."""
    values = {
        "curves": curves or {},
        "devices": {"device": spec},
        "trains": {"one": {"vehicles": 1, "mass_t": 100, "front": "device"}},
        "collision": {"train": "one", "speed_km_h": 1, "partner": "rigid_wall"},
    }
    return trainmj.line_up(trainmj.Scenario.from_values(values)).interfaces[0].devices[0]


def _ways(turns: Sequence[float], points: int = 600) -> Array:
    """Strokes from each turn to the next."""
    return np.concatenate([np.linspace(*ends, points) for ends in pairwise(turns)])


def _loop(axes: Axes, device: Device, turns: Sequence[float], speed: float = 0.0, **look: Any) -> None:
    """Draw the force of a device from each stroke [mm] to the next at a speed [m/s]."""
    strokes = _ways(turns)
    force, _ = force_along(Element((device.law,)), strokes * 1e-3, speed)
    axes.plot(strokes, force / 1e3, **look)


def beyond() -> None:
    """Where the paper's laws hold, and why S12 turns."""
    drawn = figures(judge_beyond())
    for name in ("beyond_laws", "beyond_turns", "beyond_strokes"):
        save(drawn[name], FOLDER / name, ["svg"])


def _trainmj(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "trainmj", *words], check=True, capture_output=True)


def _smaller(source: Path, target: Path, width: int) -> None:
    """Save a picture with few colours and bytes."""
    with Image.open(source) as image:
        flat = image.convert("RGB")
        flat.thumbnail((width, 10_000))
        flat.quantize(128, dither=Image.Dither.NONE).save(target, optimize=True)


PICTURES = {
    f.__name__: f
    for f in (
        law_crush,
        law_stages,
        law_beyond,
        law_rate,
        law_hysteresis,
        law_hydraulic,
        law_pull,
        law_series,
        law_paths,
        plane_vehicle,
        plane_lines,
        b_type_devices,
        b_type,
        beyond,
        crash,
        report,
        explore,
    )
}

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for chosen in sys.argv[1:] or PICTURES:
        PICTURES[chosen]()
