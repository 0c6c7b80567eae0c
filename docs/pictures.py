"""Make the pictures of README and docs: ``python docs/pictures.py [NAME ...]``, all of them without a name.

The film needs OSMesa and the picture of a report needs Chromium; the others need only trainmj.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "osmesa")

import numpy as np
from PIL import Image

import trainmj
from trainmj.collision.device import Device, Envelope, in_series
from trainmj.output import style
from trainmj.output.style import save

FOLDER = Path(__file__).resolve().parent / "images"


def law_loop() -> None:
    """Loading, unloading and reloading of one device, without and with a dashpot."""
    turns = [(0, 60), (60, 46), (46, 95), (95, 72)]
    stroke = np.concatenate([np.linspace(*turn, 500) for turn in turns]) * 1e-3
    rate = np.repeat([1.0, -1.0, 1.0, -1.0], 500)
    with style.styled():
        picture = style.figure(height=64)
        panels = picture.subplots(1, 2, sharey=True)
        for axes, damping in zip(panels, (0.0, 1.2e5), strict=True):
            envelope = Envelope(np.array([0, 0.04, 0.12]), np.array([0, 6e5, 8e5]), stiffness=4e7, damping=damping)
            plastic, force = 0.0, []
            for u, v in zip(stroke, rate, strict=True):
                f, plastic = envelope.respond(float(u), float(v), plastic)
                force.append(f / 1e3)
            axes.plot(envelope.stroke * 1e3, envelope.force / 1e3, color=style.GREY, ls="--", label="envelope")
            axes.plot(stroke * 1e3, force, color=style.BLUE, label="force")
            axes.set_title("no dashpot" if damping == 0 else f"c = {damping / 1e3:g} kN s/m, 1 m/s")
            axes.set_xlabel("stroke u (mm)")
            axes.annotate("uₚ", (plastic * 1e3, 0), (plastic * 1e3 + 12, 90), arrowprops={"arrowstyle": "->"})
            axes.set_ylim(0, 850)
        panels[0].annotate("slope K", (54, 400), (66, 300), arrowprops={"arrowstyle": "->"})
        panels[0].set_ylabel("force (kN)")
        panels[0].legend(loc="upper left")
    save(picture, FOLDER / "law_loop", ["svg"])


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
    envelope = _device("two_stages", {"stages": stages, "stiffness_kN_per_mm": 300}).envelope
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


def law_series() -> None:
    """Two devices in series: force over the stroke of the pair and of each side."""
    flat = {"stiffness_kN_per_mm": 100}
    left = _device("left", {"curve": {"stroke_mm": [0, 40, 200], "force_kN": [0, 600, 600]}, **flat})
    right = _device(
        "right", {"curve": {"stroke_mm": [0, 40, 120, 140, 300], "force_kN": [0, 400, 400, 900, 900]}, **flat}
    )
    pair, of_left = in_series(left, right)
    with style.styled():
        picture = style.figure(height=64)
        one, both = picture.subplots(1, 2, sharey=True)
        one.plot(left.envelope.stroke * 1e3, left.envelope.force / 1e3, color=style.BLUE, label="left")
        one.plot(right.envelope.stroke * 1e3, right.envelope.force / 1e3, color=style.ORANGE, ls="--", label="right")
        one.set(title="each alone", xlabel="stroke (mm)", ylabel="force (kN)", xlim=(0, 330))
        both.plot(pair.stroke * 1e3, pair.force / 1e3, color="0.2", label="pair")
        both.plot(of_left * 1e3, pair.force / 1e3, color=style.BLUE, label="left device")
        both.plot((pair.stroke - of_left) * 1e3, pair.force / 1e3, color=style.ORANGE, ls="--", label="right device")
        both.set(title="in series: equal force, strokes added", xlabel="stroke (mm)", xlim=(0, 420))
        for axes in (one, both):
            axes.legend(loc="lower right")
    save(picture, FOLDER / "law_series", ["svg"])


def b_type_devices() -> None:
    """The envelopes of the shipped train."""
    scenario = trainmj.load("b_type")
    with style.styled():
        picture = style.figure(height=68)
        axes = picture.subplots()
        looks = zip(scenario.devices, style.PALETTE, ("-", "--", ":", "-."), strict=False)
        for name, colour, line in looks:
            envelope = _device(name, scenario.values()["devices"][name], scenario.values()["curves"]).envelope
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
    """The film of the front interface, small enough for a README."""
    from trainmj.view import render

    render(trainmj.run(trainmj.load("b_type")), FOLDER / "crash.webp", "front", slow=0.15, size=(720, 405), fps=12)


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


def _device(name: str, spec: dict[str, object], curves: dict[str, object] | None = None) -> Device:
    """The device of a scenario, which needs a vehicle and a wall around it."""
    values = {
        "curves": curves or {},
        "devices": {name: spec},
        "trains": {"one": {"vehicles": 1, "mass_t": 30, "front": name}},
        "collision": {"train": "one", "speed_km_h": 10, "partner": "rigid_wall"},
    }
    return trainmj.line_up(trainmj.Scenario.from_values(values)).interfaces[0].devices[0]


def _trainmj(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "trainmj", *words], check=True, capture_output=True)


def _smaller(source: Path, target: Path, width: int) -> None:
    """Save a picture with few colours and bytes."""
    with Image.open(source) as image:
        flat = image.convert("RGB")
        flat.thumbnail((width, 10_000))
        flat.quantize(128, dither=Image.Dither.NONE).save(target, optimize=True)


PICTURES = {f.__name__: f for f in (law_loop, law_stages, law_series, b_type_devices, b_type, crash, report)}

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for chosen in sys.argv[1:] or PICTURES:
        PICTURES[chosen]()
