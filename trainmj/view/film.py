"""From a computed collision to a film or a still; see :func:`render`."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL.Image import Image

from trainmj.collision.chain import WALL, Chain
from trainmj.collision.envelope import Array
from trainmj.collision.mj import mujoco, undisturbed
from trainmj.collision.result import Result
from trainmj.collision.wear import Wear, seen_at
from trainmj.errors import InputError, OutputError
from trainmj.units import KJ, KM_H, KN, MM, enough, in_digits
from trainmj.view.cameras import CAMERAS, Camera, Director, reach
from trainmj.view.curves import Line, Panel
from trainmj.view.files import FILMS, STILLS, write_film, write_still
from trainmj.view.frame import Frame
from trainmj.view.offscreen import canvas
from trainmj.view.overlay import Energy, Name, Overlay, Said
from trainmj.view.scene import visible
from trainmj.view.shapes import Shapes, largest_energy
from trainmj.view.warnings import Warnings

_FARTHEST = 1e6  # from the start [m]
_LARGEST = 7680, 4320  # most pixels of a picture, wide and high
_FORCE, _SPEEDS = (45, 52, 60), ((0, 96, 156), (176, 112, 0))  # colours of curves: as the trains, dark enough to read


@undisturbed()
def render(
    result: Result,
    file: str | Path,
    camera: Camera = "overview",
    slow: float = 0.1,
    size: tuple[int, int] = (1280, 720),
    at: float | None = None,
    fps: float = 15.0,
    smooth: bool = True,
    watch: Callable[[int], None] = lambda done: None,
) -> int:
    """Write a film (.webp, .mp4) or a still (.png) of a collision, at true scale.

    Args:
        result: of the collision; nothing is simulated again.
        file: what is written, whole or not at all.
        camera: one of CAMERAS.
        slow: how fast time passes in a film: 0.1 is a tenth of real time.
        size: width and height [pixels].
        at: time of a still [s]; by default the end.
        fps: frames a second of a film.
        smooth: draw smooth edges, which takes twice the time.
        watch: called with the number of finished frames of a film.

    Returns:
        The number of frames.

    Raises:
        InputError: if a value is out of its range.
        OutputError: if the file cannot be written.
        EngineError: if the library that draws without a screen is missing.
    """
    file = Path(file)
    check(file, camera, slow, size, at, fps)
    shown = samples(result, file, slow, fps, at)
    still = file.suffix.lower() in STILLS
    pace = "" if still else f"{slow:g} x real time"
    with closing(_draw(result, shown, camera, size, pace, smooth, watch)) as images:
        if still:
            write_still(file, next(images))
        else:
            write_film(file, images, len(shown), size, fps)
    return len(shown)


def samples(result: Result, file: Path, slow: float, fps: float, at: float | None) -> NDArray[np.intp]:
    """Indices of the samples that are shown: of a film those nearest to evenly spaced times, the last one included.

    Raises:
        InputError: if the time of a still is not within the collision, or vehicles are nowhere, or forces and speeds no
            numbers.
    """
    if not np.all(np.abs(_qpos(result)) < _FARTHEST):
        raise InputError("cannot be drawn: vehicles have no position, or are farther away than they can get")
    if not (np.isfinite(result.force).all() and np.isfinite(result.velocity).all()):
        raise InputError("cannot be drawn: a force or a speed is no number")
    end = float(result.time[-1])
    if file.suffix.lower() in STILLS:
        time = end if at is None else at
        if not 0 <= time <= end + 1e-9:
            raise InputError(f"at {time:g}: the collision was followed from 0 to {end:.4g} s")
        return np.array([np.abs(result.time - time).argmin()])
    step = slow / fps
    times = np.arange(0.0, end + 0.5 * step, step)
    return np.searchsorted(result.time, times - 1e-9).clip(max=len(result.time) - 1)


def check(
    file: Path, camera: str, slow: float, size: tuple[int, int], at: float | None = None, fps: float = 15.0
) -> None:
    """Refuse what :func:`render` cannot draw, before anything is simulated.

    Raises:
        InputError: naming the value, the rule and the cure.
        OutputError: if there is no folder for the file.
    """
    suffix = file.suffix.lower()
    if suffix not in FILMS + STILLS:
        raise InputError(f"{file}: a film ends in .webp or .mp4, a still in .png (got {suffix or 'no ending'!r})")
    if camera not in CAMERAS:
        raise InputError(f"camera {camera!r}: must be one of {', '.join(CAMERAS)}")
    check_pace(slow)
    if not 1 <= fps <= 120:
        raise InputError(f"fps {fps:g}: must be from 1 to 120 frames a second")
    if not all(64 <= s <= most for s, most in zip(size, _LARGEST, strict=True)):
        raise InputError(f"size {size[0]}x{size[1]}: must be from 64x64 to {_LARGEST[0]}x{_LARGEST[1]} pixels")
    if suffix == ".mp4" and find_spec("av") is None:
        raise InputError(f"{file}: MP4 needs an extra: pip install 'trainmj[film]'; .webp does not")
    if suffix == ".mp4" and (size[0] % 2 or size[1] % 2):
        raise InputError(f"size {size[0]}x{size[1]}: width and height of an MP4 film must be even")
    if at is not None and suffix not in STILLS:
        raise InputError(f"{file}: a time can be given for a still only: let the file end in .png")
    if not file.parent.is_dir():
        raise OutputError(f"{file}: there is no folder {file.parent}")
    if file.is_dir():
        raise OutputError(f"{file}: is a folder")


def check_pace(slow: float) -> None:
    """Refuse a pace that nobody could follow."""
    if not 1e-4 <= slow <= 10:
        raise InputError(f"slow {slow:g}: must be from 0.0001 to 10 times real time")


def _draw(
    result: Result,
    shown: NDArray[np.intp],
    camera: Camera,
    size: tuple[int, int],
    pace: str,
    smooth: bool,
    watch: Callable[[int], None],
) -> Generator[Image, None, None]:
    """The pictures, one after the other."""
    chain = result.chain
    model = visible(chain).compile()
    data = mujoco.MjData(model)
    full = largest_energy(result)
    wear, shapes, marks = Wear(chain), Shapes(model, chain, full), Warnings(result)
    ends = reach(chain, result.point_position)
    frame = Frame.of(*size, ends[1] - ends[0])
    director = Director(camera, chain, frame, ends)
    overlay = overlay_of(result, frame, pace, full, marks)
    with canvas(model, *size, samples=4 if smooth else 0) as draw:
        for n, sample in enumerate(shown):
            for k in range(shown[n - 1] + 1 if n else 0, sample + 1):
                wear.update(seen_at(result, k))
                marks.follow(float(result.time[k]), wear)
            moved = shapes.show(wear)
            data.qpos[:] = _qpos(result)[sample]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            picture = draw(data, director.views(result.point_position[sample]), moved)
            yield overlay.write(picture, said_at(result, sample, wear, marks, director, full))
            watch(n + 1)


def _qpos(result: Result) -> Array:
    """(n_sample, n) positions of the joints of its model [m, rad]."""
    return result.dof if result.chain.plane else result.point_position


def overlay_of(result: Result, frame: Frame, pace: str, full: float, marks: Warnings) -> Overlay:
    """What writes on the pictures of a collision; full is the energy at the end of the colours [J]."""
    chain, scenario = result.chain, result.scenario
    force = [Line("", result.force[:, chain.front] / KN, _FORCE)]
    speeds = [
        Line(chain.vehicles[i].name, result.velocity[:, i] / KM_H, paint)
        for i, paint in zip(_leading(chain), _SPEEDS, strict=False)
    ]
    panels = [
        Panel(box, frame.px(100) / 100, title, unit, result.time, lines, result.tally.valid_until)
        for box, title, unit, lines in zip(
            frame.curves, ("force at the front", "speed"), ("kN", "km/h"), (force, speeds), strict=True
        )
    ]
    title = scenario.heading, scenario.subject
    return Overlay(frame, title, pace, full / KJ, panels, two_sided(chain), bool(chain.members), marks.lines)


def said_at(result: Result, sample: int, wear: Wear, marks: Warnings, director: Director, full: float) -> Said:
    """What is written at a sample, to which wear and marks have followed the collision."""
    time = float(result.time[sample])
    names, energies = _labels(result, sample, director, wear, full)
    rows = [*_rows(result, sample, wear), *(() if director.frame.curves[0].height else _values(result, sample))]
    return Said(sample, time, rows, marks.said(time), names, energies)


def two_sided(chain: Chain) -> bool:
    """Whether the front has two sides, of which numbers tell one."""
    return chain.interfaces[chain.front].right != WALL or len(chain.interfaces[chain.front].devices) > 1


def _leading(chain: Chain) -> list[int]:
    """Indices of the leading vehicles, that of the moving train first."""
    return [chain.front] if chain.interfaces[-1].right == WALL else [chain.front, chain.n_moving]


def _rows(result: Result, sample: int, wear: Wear) -> Iterator[tuple[str, str]]:
    """What is read at a sample, beside the curves."""
    chain = result.chain
    yield "TS so far", f"{wear.TS_mm:.0f} mm"
    stroke = result.of_device("stroke", chain.front, 0)[: sample + 1].max(initial=0.0) / MM
    yield f"front stroke so far{', one side' if two_sided(chain) else ''}", f"{stroke:.0f} mm"
    if chain.plane:
        name = "front rise" if chain.interfaces[-1].right == WALL else "front step"
        yield name, f"{result.step[sample, chain.front] / MM:z.0f} mm"
        yield "lift so far", f"{result.lift[: sample + 1].max(initial=0.0) / MM:.1f} mm"


def _values(result: Result, sample: int) -> Iterator[tuple[str, str]]:
    """What curves would say, if there were room for them."""
    chain = result.chain
    force = result.force[:, chain.front] / KN
    yield "front force", f"{in_digits(force[sample], enough(0, np.abs(force).max()))} kN"
    for i in _leading(chain):
        yield f"speed {chain.vehicles[i].name}", f"{result.velocity[sample, i] / KM_H:z.1f} km/h"


def _labels(
    result: Result, sample: int, director: Director, wear: Wear, full: float
) -> tuple[list[Name], list[Energy]]:
    """Below the strip: the vehicles, and the energy that each interface has absorbed [kJ].

    Vehicles come from left to right, interfaces from the front to the ends.
    """
    chain = result.chain
    lefts, rights = director.faces(result.point_position[sample])
    names = [
        Name(vehicle.name, int(vehicle.name[1:]), x)
        for vehicle, x in zip(chain.vehicles, 0.5 * (lefts + rights), strict=True)
    ]
    digits = enough(0, full / KJ)
    energies = []
    for k, x in enumerate(rights[: len(chain.interfaces)]):
        energy = wear.energy(k)
        energies.append(Energy(in_digits(energy / KJ, digits), x, min(1.0, energy / full) if full > 0 else 0.0))
    near = sorted(range(len(energies)), key=lambda k: abs(k - chain.front))
    return names, [energies[k] for k in near]
