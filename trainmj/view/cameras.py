"""Where the cameras stand: an overview with the whole train below it, at the front interface, or beside the train."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from trainmj.collision.chain import WALL, Chain
from trainmj.collision.envelope import Array
from trainmj.view.offscreen import View

Camera = Literal["overview", "front", "follow"]
CAMERAS: tuple[Camera, ...] = get_args(Camera)

_PLACES = {  # where a camera stands and what it looks at, from what it follows [m], and its angle [rad]
    "overview": ((-23.0, -30.0, 7.5), (-0.5, 0.0, 1.6), 0.52),
    "front": ((-1.3, -6.6, 2.3), (0.0, 0.0, 1.45), 0.58),
    "follow": ((-19.0, -12.0, 5.0), (-1.0, 0.0, 1.8), 0.62),
}
_AROUND = 4.0  # beyond the ends of the trains, in the strip that shows all of them [m]


class Director:
    """The views of each frame.

    Args:
        camera: which one.
        chain: what it looks at.
        position: (n_sample, n_point) of the whole collision [m].
        width: of the picture [pixels].
        height: [pixels].

    Attributes:
        strip: height of the strip at the bottom that shows the whole train, 0 if there is none [pixels].
    """

    def __init__(self, camera: Camera, chain: Chain, position: Array, width: int, height: int) -> None:
        """Find what must stay in the picture."""
        self._camera, self._chain, self._size = camera, chain, (width, height)
        self._wall = chain.interfaces[-1].right == WALL
        self.strip = round(0.13 * height) if camera == "overview" else 0
        lengths = np.array([v.length for v in chain.vehicles])
        self._left = float(position[:, 0].min() - lengths[: chain.n_moving].sum() - _AROUND)
        beyond = lengths[chain.n_moving :].sum() + (2.0 if self._wall else 0.0)
        beyond += chain.obstacle.length if chain.obstacle is not None else 0.0
        self._right = float(position[:, self._chain.edge(len(lengths) - 1, 1)].max() + beyond + _AROUND)
        self._middle = np.median(self._meeting(position))

    def _meeting(self, position: Array) -> Array:
        """(...,) where the two sides meet, or would meet, from (..., n_point) positions [m]."""
        chain = self._chain
        ours = position[..., chain.edge(chain.front, 1)]
        return np.asarray(ours if self._wall else 0.5 * (ours + position[..., chain.edge(chain.front + 1, 0)]))

    def views(self, position: Array) -> list[View]:
        """The cameras for one sample: (n_point,) positions [m]."""
        width, height = self._size
        followed = {
            "overview": self._middle,
            "front": self._meeting(position),
            "follow": position[self._chain.edge(self._chain.front, 1)],
        }
        eye, aim, angle = _PLACES[self._camera]
        at = np.array([followed[self._camera], 0.0, 0.0])
        wide = min(1.0, width / (height - self.strip) / (16 / 9))  # a tall picture keeps the width of the scene
        angle = 2 * float(np.arctan(np.tan(angle / 2) / wide))
        views = [View(at + eye, at + aim, angle, 0.0, (0, self.strip, width, height - self.strip))]
        if self.strip:
            middle = np.array([0.5 * (self._left + self._right), 0.0, 0.0])
            shown = (self._right - self._left) / width * self.strip
            side, above = np.array([0.0, -200.0, 0.0]), np.array([0.0, 0.0, 1.9 - 0.14 * shown])
            views.append(View(middle + side + above, middle + above, None, shown, (0, 0, width, self.strip)))
        return views

    def across(self, x: Array) -> Array:
        """Where places along the track [m] are in the strip [pixels from the left]."""
        return np.asarray((x - self._left) / (self._right - self._left) * self._size[0])
