"""Drawing without a screen: OpenGL in memory, through OSMesa or EGL."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from trainmj.collision.device import Array
from trainmj.errors import EngineError

Picture = NDArray[np.uint8]
"""(height, width, 3) red, green and blue, the top row first."""

_NAMES = {"osmesa": "OSMesa", "egl": "EGL"}
_PACKAGES = {"osmesa": "libosmesa6", "egl": "libegl1 libopengl0 libgl1-mesa-dri"}
_NEAR, _FAR = 0.3, 3000.0  # what a camera sees [m]


@dataclass(frozen=True)
class View:
    """A camera and the part of the picture it fills."""

    eye: Array  # (3,) where it stands [m]
    target: Array  # (3,) what it looks at [m]
    angle: float | None  # vertical field of view [rad]; None for parallel projection
    height: float  # of what it shows in parallel projection [m]
    place: tuple[int, int, int, int]  # left, bottom, width and height in the picture [pixels]


class Canvas:
    """A picture in memory on which MuJoCo draws a model; use it as a context manager, in one thread.

    Args:
        model: what is drawn.
        width: [pixels].
        height: [pixels].
        samples: for each pixel; 0 is fastest, 4 smooths edges.

    Raises:
        EngineError: if the library that draws is missing.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, samples: int = 0) -> None:
        """Open the context and send it the model's meshes."""
        self._model = model
        self._size = width, height
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples, model.vis.quality.shadowsize = samples, 0
        self._gl = new_context(width, height)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 10)
        for flag in (mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_SHADOW):
            self._scene.flags[flag] = 0
        self._option, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._option.flags[mujoco.mjtVisFlag.mjVIS_TENDON] = 0

    def __enter__(self) -> Canvas:
        """Draw on it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give its memory back."""
        self._context.free()
        self._gl.free()

    def draw(self, data: mujoco.MjData, views: Sequence[View]) -> Picture:
        """The model as it stands, seen by one or several cameras."""
        width, height = self._size
        picture = np.empty((height, width, 3), dtype=np.uint8)
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self._option, None, self._camera, every, self._scene)
        for view in views:
            _aim(self._scene, view)
            mujoco.mjr_render(mujoco.MjrRect(*view.place), self._scene, self._context)
        mujoco.mjr_readPixels(picture, None, mujoco.MjrRect(0, 0, width, height), self._context)
        return picture[::-1]


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
    try:
        if platform == "egl":
            from mujoco.egl import GLContext
        else:
            from mujoco.osmesa import GLContext
        context = GLContext(width, height)
        context.make_current()
    except (ImportError, AttributeError, OSError):  # PyOpenGL's ways to miss a library
        raise EngineError(
            f"pictures are drawn in memory by {_NAMES[platform]}, which is not installed; on Debian and Ubuntu: "
            f"apt install {_PACKAGES[platform]}"
        ) from None
    except RuntimeError as error:
        raise EngineError(f"{_NAMES[platform]} cannot draw on this machine ({error})") from None
    return context


def check_platform() -> None:
    """Try the library that draws, before anything is simulated.

    Raises:
        EngineError: if it is missing.
    """
    new_context(16, 16).free()
