"""Drawing without a screen: OpenGL in memory, through OSMesa or EGL."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainmj.collision.envelope import Array
from trainmj.collision.mj import mujoco
from trainmj.errors import EngineError, out_of_memory

Picture = NDArray[np.uint8]
"""(height, width, 3) red, green and blue, the top row first."""

_PLATFORMS = {"osmesa": ("OSMesa", "libosmesa6"), "egl": ("EGL", "libegl1 libopengl0 libgl1-mesa-dri")}
_NEAR, _FAR = 0.3, 3000.0  # what a camera sees [m]


@dataclass(frozen=True)
class View:
    """A camera and the part of the picture it fills."""

    eye: Array  # (3,) where it stands [m]
    target: Array  # (3,) what it looks at [m]
    angle: float | None  # vertical field of view [rad]; None for parallel projection
    height: float  # of what it shows in parallel projection [m]
    place: tuple[int, int, int, int]  # left, bottom, width and height in the picture [pixels]


@contextmanager
def canvas(
    model: mujoco.MjModel, width: int, height: int, samples: int = 0
) -> Iterator[Callable[[mujoco.MjData, Sequence[View], Sequence[int]], Picture]]:
    """A picture in memory on which MuJoCo draws a model, in one thread.

    Args:
        model: what is drawn.
        width: [pixels].
        height: [pixels].
        samples: for each pixel; 0 is fastest, 4 smooths edges.

    Yields:
        The function that draws the model as it stands, seen by one or several cameras; it is told which meshes have
        changed since the last picture.

    Raises:
        EngineError: if the library that draws is missing.
    """
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.quality.offsamples, model.vis.quality.shadowsize = samples, 0
    gl = new_context(width, height)
    context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
    scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 10)
    for flag in (mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_SHADOW):
        scene.flags[flag] = 0
    option, camera = mujoco.MjvOption(), mujoco.MjvCamera()
    option.flags[mujoco.mjtVisFlag.mjVIS_TENDON] = 0

    def draw(data: mujoco.MjData, views: Sequence[View], changed: Sequence[int]) -> Picture:
        for mesh in changed:
            mujoco.mjr_uploadMesh(model, context, mesh)
        picture = np.empty((height, width, 3), dtype=np.uint8)
        mujoco.mjv_updateScene(model, data, option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
        for view in views:
            _aim(scene, view)
            mujoco.mjr_render(mujoco.MjrRect(*view.place), scene, context)
        mujoco.mjr_readPixels(picture, None, mujoco.MjrRect(0, 0, width, height), context)
        return picture[::-1]

    try:
        yield draw
    finally:
        context.free()
        gl.free()


def _aim(scene: mujoco.MjvScene, view: View) -> None:
    forward = (view.target - view.eye) / np.linalg.norm(view.target - view.eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    up = np.cross(right / np.linalg.norm(right), forward)
    top = view.height / 2 if view.angle is None else _NEAR * np.tan(view.angle / 2)
    wide = 2 * top * view.place[2] / view.place[3]
    far = _FAR if view.angle is not None else max(_FAR, wide)  # the sky is as wide as it is far
    for camera in scene.camera:  # one for each eye; both the same
        camera.pos[:], camera.forward[:], camera.up[:] = view.eye, forward, up
        camera.orthographic = int(view.angle is None)
        camera.frustum_center, camera.frustum_width = 0.0, 0.0
        camera.frustum_bottom, camera.frustum_top = -top, top
        camera.frustum_near, camera.frustum_far = _NEAR, far


def new_context(width: int, height: int) -> Any:
    """An OpenGL context in memory, made current: EGL if MUJOCO_GL is egl, otherwise OSMesa.

    Raises:
        EngineError: if its library is missing, naming the package.
    """
    platform = "egl" if os.environ.get("MUJOCO_GL", "").strip().lower() == "egl" else "osmesa"
    loaded = os.environ.setdefault("PYOPENGL_PLATFORM", platform)
    if loaded.lower() != platform:
        raise EngineError(f"PYOPENGL_PLATFORM={loaded} prevents drawing with {platform}: unset it")
    name, packages = _PLATFORMS[platform]
    try:
        context = import_module(f"mujoco.{platform}").GLContext(width, height)
        context.make_current()
    except (ImportError, AttributeError, OSError) as error:  # PyOpenGL's ways to miss a library
        if out_of_memory(error):
            raise
        raise EngineError(
            f"pictures are drawn in memory by {name}, which is not installed; on Debian and Ubuntu: "
            f"apt install {packages}"
        ) from None
    except RuntimeError as error:
        raise EngineError(f"{name} cannot draw on this machine ({error})") from None
    return context


def check_platform() -> None:
    """Try the library that draws, before anything is simulated.

    Raises:
        EngineError: if it is missing.
    """
    new_context(16, 16).free()
