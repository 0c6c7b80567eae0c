"""Where the cameras stand: an overview with the whole train below it, at the front interface, or beside the train."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from trainmj.collision.chain import WALL, Chain
from trainmj.collision.device import Array
from trainmj.view.offscreen import View

Camera = Literal["overview", "front", "follow"]
CAMERAS: tuple[Camera, ...] = get_args(Camera)

_EYES = {"overview": (-23.0, -30.0, 7.5), "front": (-1.3, -6.6, 2.3), "follow": (-19.0, -12.0, 5.0)}  # [m]
_ANGLES = {"overview": 0.52, "front": 0.58, "follow": 0.62}  # [rad]
_AIMS = {"overview": (-0.5, 0.0, 1.6), "front": (0.0, 0.0, 1.45), "follow": (-1.0, 0.0, 1.8)}
_AROUND = 4.0  # beyond the ends of the trains, in the strip that shows all of them [m]


def strip_height(camera: Camera, height: int) -> int:
    """Height of the strip at the bottom of a picture that shows the whole train [pixels]."""
    return round(0.13 * height) if camera == "overview" else 0


class Director:
    """The views of each frame.

    Args:
        camera: which one.
        chain: what it looks at.
        position: (n_sample, n_vehicle) of the whole collision [m].
        width: of the picture [pixels].
        height: [pixels].
    """

    def __init__(self, camera: Camera, chain: Chain, position: Array, width: int, height: int) -> None:
        """Find what must stay in the picture."""
        self._camera, self._chain, self._size = camera, chain, (width, height)
        self._wall = chain.interfaces[-1].right == WALL
        lengths = np.array([v.length for v in chain.vehicles])
        left = position[:, 0].min() - lengths[: chain.n_moving].sum()
        right = position[:, -1].max() + lengths[chain.n_moving :].sum() + (2.0 if self._wall else 0.0)
        self.extent = float(left - _AROUND), float(right + _AROUND)
        self._middle = float(np.median([self._meeting(p) for p in position]))

    def _meeting(self, position: Array) -> float:
        """Where the two sides meet, or would meet [m]."""
        n = self._chain.n_moving
        return float(position[n - 1] if self._wall else 0.5 * (position[n - 1] + position[n]))

    def views(self, position: Array) -> list[View]:
        """The cameras for one sample: (n_vehicle,) positions [m]."""
        width, height = self._size
        strip = strip_height(self._camera, height)
        front = float(position[self._chain.front])
        x = {"overview": self._middle, "front": self._meeting(position), "follow": front}[self._camera]
        at = np.array([x, 0.0, 0.0])
        wide = min(1.0, width / (height - strip) / (16 / 9))  # a tall picture keeps the width of the scene
        angle = 2 * np.arctan(np.tan(_ANGLES[self._camera] / 2) / wide)
        eye, aim = at + _EYES[self._camera], at + _AIMS[self._camera]
        views = [View(eye, aim, float(angle), 0.0, (0, strip, width, height - strip))]
        if strip:
            middle = np.array([0.5 * sum(self.extent), 0.0, 0.0])
            shown = (self.extent[1] - self.extent[0]) / width * strip
            side, above = np.array([0.0, -200.0, 0.0]), np.array([0.0, 0.0, 1.9 - 0.14 * shown])
            views.append(View(middle + side + above, middle + above, None, shown, (0, 0, width, strip)))
        return views

    def across(self, x: Array) -> Array:
        """Where places along the track [m] are in the strip [pixels from the left]."""
        return np.asarray((x - self.extent[0]) / (self.extent[1] - self.extent[0]) * self._size[0])
