"""The commands render and view, which show a collision."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trainmj.cli.options import say, takes_scenario, takes_time, with_set
from trainmj.errors import InputError

if TYPE_CHECKING:
    from trainmj.collision.result import Result
    from trainmj.view import Camera

_CAMERAS = ("overview", "front", "follow")


def _size(context: click.Context, parameter: click.Parameter, text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.strip().isdecimal() and height.strip().isdecimal()):
        raise InputError(f"--size {text}: must be WIDTHxHEIGHT in pixels, as in --size 1280x720")
    return int(width), int(height)


@click.command()
@takes_scenario
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Film (.webp, .mp4) or still (.png).")
@click.option("--camera", type=click.Choice(_CAMERAS), default="overview", show_default=True, help="Point of view.")
@click.option("--slow", type=float, default=0.1, show_default=True, help="Pace of a film; 1 is real time.")
@click.option("--fps", type=float, default=15.0, show_default=True, help="Frames of a film a second.")
@click.option(
    "--size", metavar="WxH", default="1280x720", show_default=True, callback=_size, help="Width and height in pixels."
)
@click.option("--at", type=float, metavar="SECONDS", help="Time of a still; the end if not given.")
@click.option("--smooth/--fast", default=True, help="Smooth edges (default), or half the time.")
@takes_time
def render(
    scenario: str,
    changes: dict[str, Any],
    out: Path,
    camera: Camera,
    slow: float,
    fps: float,
    size: tuple[int, int],
    at: float | None,
    smooth: bool,
) -> None:
    """Write a film or a still of a collision, at true scale.

    This needs no screen and no graphics card. SCENARIO may also be a saved result, result.nc or its folder, which is
    shown without simulating again.
    """
    from trainmj.view import film, offscreen

    film.check(out, camera, slow, size, at, fps)
    offscreen.check_platform()
    result = _result(scenario, changes)
    from trainmj.output.console import Progress

    with Progress(len(film.samples(result, out, slow, fps, at))) as bar:
        try:
            film.render(result, out, camera, slow, size, at, fps, smooth, bar)
        except KeyboardInterrupt:
            bar.stop()
            say(f"Stopped; {out} was not written.", err=True)
            sys.exit(130)
    say(f"Written to {out}")


@click.command()
@takes_scenario
@click.option("--slow", type=float, default=0.1, show_default=True, help="Pace; 1 is real time.")
def view(scenario: str, changes: dict[str, Any], slow: float) -> None:
    """Open MuJoCo's viewer and play the collision in it.

    This needs a screen.
    """
    from trainmj.view import viewer

    viewer.view(with_set(scenario, changes), slow)


def _result(scenario: str, changes: dict[str, Any]) -> Result:
    """A saved result, or that of a scenario, computed now."""
    from trainmj.collision.saved import find_result, load_result

    file = find_result(scenario)
    if file is None:
        from trainmj.collision.simulation import run

        return run(with_set(scenario, changes))
    if changes:
        raise InputError(f"--set {next(iter(changes))}: {scenario} is a result, which cannot be changed")
    return load_result(file)
