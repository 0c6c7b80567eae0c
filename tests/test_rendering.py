"""Films and stills: shapes at their true places, colours by energy, files whole, clear words where it cannot be."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from forked import forked
from PIL import Image

from trainmj.cli import main
from trainmj.collision import simulation
from trainmj.collision.lineup import line_up
from trainmj.collision.summary import summarise
from trainmj.collision.wear import Wear, seen_at
from trainmj.errors import EngineError, InputError, OutputError
from trainmj.scenario import load
from trainmj.view import film, offscreen, parts
from trainmj.view.scene import visible
from trainmj.view.shapes import DeviceShapes, colour, largest_energy

SMALL = (192, 108)


@pytest.fixture(scope="module", autouse=True)
def _draws() -> None:
    try:
        offscreen.check_platform()
    except EngineError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def saved(standard_result, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("rendering") / "result.nc"
    standard_result.save(file)
    return file


@pytest.fixture(scope="module")
def worn(standard_result) -> Wear:
    return worn_by(standard_result)


def worn_by(result) -> Wear:
    wear = Wear(result.chain)
    for sample in range(len(result.time)):
        wear.update(seen_at(result, sample))
    return wear


# wear


def test_total_compression_ends_where_the_summary_says(worn, standard_summary):
    assert worn.TS_mm == pytest.approx(standard_summary.TS_mm, rel=1e-3)


def test_energies_of_devices_are_those_of_the_summary(worn, standard_result, standard_summary):
    front = standard_result.chain.front
    left, right = worn.worn[front, 0].energy, worn.worn[front, 1].energy
    assert worn.energy(front) / 1e3 == pytest.approx(standard_summary.interfaces[0].energy_kJ, rel=1e-3)
    assert left == pytest.approx(right)
    assert worn.energy(front - 1) / 1e3 == pytest.approx(standard_summary.interfaces[1].energy_kJ, rel=1e-3)


def test_stages_of_a_device_share_its_energy_as_their_strokes_tell(worn, standard_result):
    """The coupler takes what lies below its part of the curve, the anti-climber the rest."""
    interface = standard_result.chain.interfaces[standard_result.chain.front]
    coupler, *_ = interface.devices[0].stages
    below = interface.devices[0].envelope.energy(coupler.end)
    assert worn.worn[standard_result.chain.front, 0].energy[0] == pytest.approx(below, rel=0.03)


def test_sides_of_an_unequal_front_share_its_energy_as_the_summary_says():
    result = simulation.run(load("wagon_80t"))
    wear = worn_by(result)
    sides = [i.energy_kJ for i in summarise(result).interfaces if i.name.startswith("S1-M1")]
    found = [wear.worn[result.chain.front, side].energy.sum() / 1e3 for side in (0, 1)]
    assert sum(found) == pytest.approx(sum(sides), rel=1e-3)
    assert found == pytest.approx(sides, rel=1e-3)


def test_more_energy_is_darker():
    """So that the colours are told apart without seeing colour."""
    light = colour(np.linspace(0.04, 1, 50)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) < 0).all()


# shapes


@pytest.mark.parametrize("name", ["b_type", "b_type_wall", "wagon_80t"])
def test_bodies_stand_back_behind_the_faces_of_their_couplers(name):
    chain = line_up(load(name))
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for i, vehicle in enumerate(chain.vehicles):
        body = model.body(vehicle.name).id
        shell = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body and model.geom_type[g] == 7]
        assert shell, "a car body of meshes"
        corners = np.concatenate([_corners(model, data, g) for g in shell])[:, 0] - data.xpos[body, 0]
        assert corners.max() < vehicle.length / 2 - parts.setback(chain, i, 1) + 0.06
        assert corners.min() > -vehicle.length / 2 + parts.setback(chain, i, -1) - 0.06


def _corners(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    mesh = model.geom_dataid[geom]
    start = model.mesh_vertadr[mesh]
    own = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
    return own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def test_devices_meet_at_true_scale_as_they_are_crushed(standard_result):
    """Heads touch while there is force, and the tubes behind them are shorter by their stroke."""
    chain = standard_result.chain
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    wear, devices = Wear(chain), DeviceShapes(model, chain, largest_energy(standard_result))
    tube = model.geom("M1 front coupler tube").id
    at_rest = 2 * model.geom_size[tube, 1]
    coupler = chain.interfaces[chain.front].devices[0].stages[0]
    for sample in range(len(standard_result.time)):
        wear.update(seen_at(standard_result, sample))
        if sample % 50:
            continue
        devices.show(wear)
        data.qpos[:] = standard_result.position[sample]
        mujoco.mj_kinematics(model, data)
        for left, right, k in (("M1 front", "S1 rear", 5), ("M2 front", "M1 rear", 4), ("S1 front", "S2 rear", 6)):
            if standard_result.force[sample, k] > 0:
                a, b = (data.geom(f"{end} coupler head") for end in (left, right))
                half = [model.geom(f"{end} coupler head").size[0] for end in (left, right)]
                assert a.xpos[0] + half[0] == pytest.approx(b.xpos[0] - half[1], abs=1e-9)
        shorter = at_rest - 2 * model.geom_size[tube, 1]
        assert shorter == pytest.approx(min(wear.shown(chain.front, 0), coupler.end), abs=1e-9)
    assert shorter == pytest.approx(coupler.end), "sheared off at the end of its stage"
    energy = 255 * model.geom_rgba[tube, :3]
    assert energy == pytest.approx(
        255 * colour(wear.worn[chain.front, 0].energy[0] / largest_energy(standard_result)), abs=1
    )


# pictures


def test_film_shows_the_whole_collision_at_its_pace(standard_result, tmp_path):
    file = tmp_path / "crash.webp"
    told: list[int] = []
    frames = film.render(standard_result, file, slow=0.5, fps=5, size=SMALL, smooth=False, watch=told.append)
    with Image.open(file) as picture:
        assert picture.n_frames == frames == told[-1]
        assert picture.size == SMALL
        shown = [0.0] * frames
        first, last = (np.asarray(_at(picture, k).convert("RGB"), dtype=int) for k in (0, frames - 1))
        for k in range(frames):
            picture.seek(k)
            picture.load()
            shown[k] = picture.info["duration"]
    assert shown[:-1] == [200] * (frames - 1)
    assert frames == int(standard_result.time[-1] / 0.1) + 1 or frames == int(standard_result.time[-1] / 0.1) + 2
    assert np.abs(first - last).mean() > 3, "it moves"
    assert os.listdir(tmp_path) == ["crash.webp"], "nothing else is left"


def _at(picture: Image.Image, frame: int) -> Image.Image:
    picture.seek(frame)
    return picture.copy()


def test_mp4_has_every_frame(standard_result, tmp_path):
    av = pytest.importorskip("av")
    file = tmp_path / "crash.mp4"
    frames = film.render(standard_result, file, "front", slow=0.5, fps=5, size=SMALL, smooth=False)
    with av.open(str(file)) as container:
        decoded = [f.to_image() for f in container.decode(video=0)]
    assert len(decoded) == frames + 5, "it rests for a second on the last one"
    assert decoded[0].size == SMALL


@pytest.mark.parametrize("position", [np.nan, np.inf, 1e300])
def test_vehicles_that_are_nowhere_are_not_drawn(standard_result, tmp_path, position):
    """Breaks if a run that became unstable, or a forged result, ends in a traceback of the package that draws."""
    lost = replace(standard_result, position=np.full_like(standard_result.position, position))
    with pytest.raises(InputError, match="cannot be drawn"):
        film.render(lost, tmp_path / "still.png")


def _still(result, tmp_path: Path, camera: str, at: float | None) -> np.ndarray:
    film.render(result, tmp_path / "frame.png", camera, size=(480, 270), at=at, smooth=False)
    return np.asarray(Image.open(tmp_path / "frame.png").convert("RGB"), dtype=int)


@pytest.mark.parametrize("camera", film.CAMERAS)
def test_every_camera_sees_both_trains(standard_result, tmp_path, camera):
    picture = _still(standard_result, tmp_path, camera, 0.0)
    for livery in ((0, 103, 160), (205, 141, 0)):
        assert (np.abs(picture - livery).sum(axis=2) < 80).sum() > 40


def test_crushed_devices_change_colour(standard_result, tmp_path):
    red = []
    for at in (0.0, 0.3):
        picture = _still(standard_result, tmp_path, "front", at)[60:200, 150:330]
        r, g, b = np.moveaxis(picture, 2, 0)
        red.append(((r > 120) & (g < 0.6 * r) & (b < 0.4 * r)).sum())  # more so than the livery
    assert red[0] == 0
    assert red[1] > 100


def test_saved_results_are_shown_without_simulating(saved, standard_result, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(simulation, "run", lambda _: pytest.fail("simulated again"))
    for source in (saved, saved.parent):
        with pytest.raises(SystemExit) as stop:
            main(["render", str(source), "--out", str(tmp_path / "a.png"), "--size", "192x108", "--fast"])
        assert stop.value.code == 0
    film.render(standard_result, tmp_path / "b.png", size=SMALL, smooth=False)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes(), "the same picture, byte by byte"


# mistakes and faults


@pytest.mark.parametrize(
    ("file", "more", "error", "words"),
    [
        ("a.gif", {}, InputError, "must be|ends in .webp or .mp4"),
        ("a", {}, InputError, "no ending"),
        ("a.mp4", {"size": (193, 108)}, InputError, "must be even"),
        ("a.png", {"size": (10, 10)}, InputError, "from 64x64"),
        ("a.png", {"at": 99.0}, InputError, "followed from 0 to"),
        ("a.webp", {"at": 0.1}, InputError, "end in .png"),
        ("a.webp", {"slow": 0.0}, InputError, "times real time"),
        ("a.webp", {"slow": float("nan")}, InputError, "times real time"),
        ("a.webp", {"fps": 1e9}, InputError, "frames a second"),
        ("a.png", {"camera": "roof"}, InputError, "overview, front, follow"),
        ("missing/a.png", {}, OutputError, "there is no folder"),
    ],
)
def test_what_cannot_be_drawn_is_refused(standard_result, tmp_path, file, more, error, words):
    with pytest.raises(error, match=words):
        film.render(standard_result, tmp_path / file, **more)
    assert not list(tmp_path.iterdir())


def test_a_film_without_its_package_is_refused_before_anything_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(film, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"pip install 'trainmj\[film\]'"):
        film.check(tmp_path / "a.mp4", "front", 1.0, SMALL)
    film.check(tmp_path / "a.webp", "front", 1.0, SMALL)


def test_results_cannot_be_changed(saved, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["render", str(saved), "--out", str(tmp_path / "a.png"), "--set", "mass_t=33"])
    assert stop.value.code == 2
    assert "cannot be changed" in capsys.readouterr().err


def test_an_interrupted_film_leaves_the_old_file(standard_result, tmp_path):
    file = tmp_path / "crash.webp"
    file.write_text("old")

    def stop(done: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film.render(standard_result, file, slow=0.5, fps=5, size=SMALL, smooth=False, watch=stop)
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == ["crash.webp"]


def _process(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own, after some code."""
    code += "\nfrom trainmj.cli import main\nmain()"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        env={k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")} | environment,
    )


@pytest.mark.parametrize("ending", ["webp", "mp4"])
def test_a_full_disk_leaves_the_old_file(saved, tmp_path, ending):
    """Files may not grow beyond 2 kB in that process, which is what a full disk does."""
    if ending == "mp4":
        pytest.importorskip("av")
    file = tmp_path / f"crash.{ending}"
    file.write_text("old")
    words = ("render", saved, "--out", file, "--size", "192x108", "--slow", "1", "--fast")
    done = forked(tmp_path, *words, prepare=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048)))
    assert done.returncode == 2
    assert "cannot be written (File too large)" in done.stderr
    assert "Traceback" not in done.stderr
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == [file.name]


def test_without_osmesa_the_package_is_named(saved, tmp_path):
    """The loader is made to fail as it does where the library is not installed."""
    code = """
import ctypes, ctypes.util
load, find = ctypes.CDLL.__init__, ctypes.util.find_library
def hidden(self, name, *more, **options):
    if name and "osmesa" in name.lower():
        raise OSError(f"{name}: cannot open shared object file")
    return load(self, name, *more, **options)
ctypes.CDLL.__init__ = hidden
ctypes.util.find_library = lambda name: None if "osmesa" in name.lower() else find(name)
"""
    file = tmp_path / "a.png"
    done = _process(code, "render", str(saved), "--out", str(file), MUJOCO_GL="osmesa")
    assert done.returncode == 2
    assert "apt install libosmesa6" in done.stderr
    assert "Traceback" not in done.stderr
    assert not file.exists()


def test_without_a_screen_the_viewer_says_so():
    done = _process("", "view", "b_type")
    assert done.returncode == 2
    assert "needs a screen" in done.stderr
    assert "trainmj render" in done.stderr
    assert "Traceback" not in done.stderr
