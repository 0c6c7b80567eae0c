"""MuJoCo's own viewer with the device law running; it needs a screen."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from trainmj.collision import kernel
from trainmj.collision.block import Layout
from trainmj.collision.fields import Head
from trainmj.collision.interrupts import held_back
from trainmj.collision.lineup import line_up
from trainmj.collision.mj import mujoco
from trainmj.collision.model import split_sensors
from trainmj.collision.simulation import run, start
from trainmj.collision.wear import Wear
from trainmj.errors import EngineError
from trainmj.scenario import Scenario
from trainmj.view.film import check_pace
from trainmj.view.scene import visible
from trainmj.view.shapes import Shapes, largest_energy

_FRAME = 1 / 30  # of the screen [s]
_PAUSE = 1.5  # before the collision begins, and before it begins again [s]
_CLOSING = 5.0  # at most, for the window to close [s]


def view(scenario: Scenario, slow: float = 0.1) -> None:
    """Play a collision in the viewer, slow times real time, again and again until its window is closed.

    Raises:
        InputError: if the step is too large or the pace out of its range.
        EngineError: if there is no screen, or MuJoCo cannot carry the device law.
    """
    check_pace(slow)
    _check_screen()
    chain = line_up(scenario)
    layout = Layout.of(chain)
    full = largest_energy(run(scenario))
    with kernel.installed():
        model = visible(chain, layout).compile()
        data = start(model, chain, layout)
        shapes = Shapes(model, chain, full)
        steps = max(1, round(_FRAME * slow / chain.step))
        with _window(model, data) as window:
            window.cam.lookat[:], window.cam.distance = (0.0, 0.0, 1.6), 40.0
            window.cam.azimuth, window.cam.elevation = 60.0, -10.0
            while window.is_running():
                with window.lock():
                    mujoco.mj_resetDataKeyframe(model, data, 0)
                    data.userdata[:] = layout.block(chain)
                    mujoco.mj_forward(model, data)
                    data.userdata[:] = layout.block(chain)
                wear = Wear(chain)
                _show(window, shapes, wear)
                _wait(window, _PAUSE)
                while window.is_running() and not data.userdata[Head.OVER] and data.time < chain.time_limit:
                    began = time.monotonic()
                    with window.lock():
                        mujoco.mj_step(model, data, nstep=steps)
                        seen = split_sensors(chain, data.sensordata[None])
                        wear.update({name: values[0] for name, values in seen.items()})
                    _show(window, shapes, wear)
                    time.sleep(max(0.0, steps * chain.step / slow - (time.monotonic() - began)))
                _wait(window, 2 * _PAUSE)


@contextmanager
def _window(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[mujoco.viewer.Handle]:
    """The viewer's window. The thread that draws in it has ended after the block: at the end of the process it crashes.

    Ctrl-C waits while the window opens and closes.
    """
    import mujoco.viewer

    others, window = set(threading.enumerate()), None
    try:
        with held_back():
            window = mujoco.viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
        yield window
    finally:
        with held_back():
            if window is not None:
                window.close()
            for thread in set(threading.enumerate()) - others:
                thread.join(_CLOSING)


def _show(window: mujoco.viewer.Handle, shapes: Shapes, wear: Wear) -> None:
    with window.lock():
        moved = shapes.show(wear)
    for mesh in moved:
        window.update_mesh(mesh)
    window.sync()


def _wait(window: mujoco.viewer.Handle, seconds: float) -> None:
    until = time.monotonic() + seconds
    while window.is_running() and time.monotonic() < until:
        window.sync()
        time.sleep(_FRAME)


def _check_screen() -> None:
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise EngineError(
            "the viewer needs a screen, and there is none (DISPLAY is not set); "
            "`trainmj render` makes films and stills without one"
        )
    import glfw

    if not glfw.init():
        raise EngineError(
            "the viewer could not open a window on this screen; `trainmj render` makes films and stills without one"
        )
