"""Where the cameras stand: beside the impact, at the front interface, or beside the moving train."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from trainmj.collision.chain import WALL, Chain
from trainmj.collision.envelope import Array
from trainmj.view.frame import Box, Frame
from trainmj.view.offscreen import View
from trainmj.view.parts import setback

Camera = Literal["overview", "front", "follow"]
CAMERAS: tuple[Camera, ...] = get_args(Camera)

_PLACES = {  # where a camera stands and what it looks at, from what it follows [m], and its angle [rad]
    "overview": ((-3.0, -24.0, 4.2), (0.0, 0.0, 1.85), 0.2),
    "front": ((-1.0, -6.6, 2.1), (0.0, 0.0, 1.15), 0.42),
    "follow": ((-19.0, -12.0, 5.0), (-1.0, 0.0, 1.8), 0.62),
}
_ENDS = 9.0  # of both leading vehicles together, seen from beside the impact with the devices between them [m]
_AROUND = 4.0  # beyond the ends of the trains, in the strip that shows all of them [m]
_AHEAD = 3.0  # of the moving train, to where one looks while the other side is far away [m]
_WALL = 5.0  # how far a wall reaches [m]
_GROUND = 1.0  # below the rails, in the strip [m]


def reach(chain: Chain, position: Array) -> tuple[float, float]:
    """From where to where along the track both sides are in the whole collision, (n_sample, n_point) positions [m]."""
    lengths = np.array([v.length for v in chain.vehicles])
    left = float(position[:, 0].min() - lengths[: chain.n_moving].sum() - _AROUND)
    beyond = lengths[chain.n_moving :].sum() + (_WALL if chain.interfaces[-1].right == WALL else _AROUND)
    beyond += chain.obstacle.length if chain.obstacle is not None else 0.0
    return left, float(position[:, chain.edge(len(lengths) - 1, 1)].max() + beyond)


class Director:
    """The views of each frame.

    Args:
        camera: which one.
        chain: what it looks at.
        frame: the parts of a picture.
        ends: from where to where along the track both sides are [m].
    """

    def __init__(self, camera: Camera, chain: Chain, frame: Frame, ends: tuple[float, float]) -> None:
        """Find what must stay in the picture."""
        self._camera, self._chain, self.frame, self._ends = camera, chain, frame, ends
        self._wall = chain.interfaces[-1].right == WALL
        self._shown = frame.shown(ends[1] - ends[0])
        other = chain.front + 1 if not self._wall else WALL
        there = not self._wall or chain.obstacle is not None
        self._between = setback(chain, chain.front, 1) + (setback(chain, other, -1) if there else 0.0)

    def _meeting(self, position: Array) -> float:
        """Where the two sides meet, or are about to, from (n_point,) positions [m]."""
        chain = self._chain
        ours = position[chain.edge(chain.front, 1)]
        apart = 0.0 if self._wall else position[chain.edge(chain.front + 1, 0)] - ours
        return float(ours + min(0.5 * apart, _AHEAD))

    def views(self, position: Array) -> list[View]:
        """The cameras for one sample: (n_point,) positions [m]."""
        frame = self.frame
        meeting = self._meeting(position)
        followed = float(position[self._chain.edge(self._chain.front, 1)]) if self._camera == "follow" else meeting
        eye, aim, angle = _PLACES[self._camera]
        at = np.array([followed, 0.0, 0.0])
        shape = frame.scene.width / frame.scene.height
        half = np.tan(angle / 2)
        if self._camera == "overview":  # the devices and what is behind them on both sides
            half = max(half, 0.5 * (_ENDS + self._between) / (shape * float(np.linalg.norm(np.subtract(eye, aim)))))
        else:  # a tall picture keeps the width of the scene
            half /= min(1.0, shape / (16 / 9))
        views = [View(at + eye, at + aim, 2 * float(np.arctan(half)), 0.0, self._place(frame.scene))]
        if frame.strip.height:
            tall = self._shown / frame.width * frame.strip.height
            middle = np.array([self._middle(meeting), 0.0, 0.5 * tall - _GROUND])
            views.append(View(middle + np.array([0.0, -200.0, 0.0]), middle, None, tall, self._place(frame.strip)))
        return views

    def faces(self, position: Array) -> tuple[Array, Array]:
        """(n_vehicle,) where the left and the right ends of vehicles are in the strip [pixels from the left].

        Args:
            position: (n_point,) at one sample [m].
        """
        chain = self._chain
        edges = np.concatenate([[0.0], np.cumsum([v.length for v in chain.vehicles])])
        edges -= edges[chain.n_moving]  # where the two sides touch
        start = self._middle(self._meeting(position)) - 0.5 * self._shown
        across = self.frame.width / self._shown
        left, right = (
            (at + position[[chain.edge(i, end) for i in range(len(at))]] - start) * across
            for end, at in enumerate((edges[:-1], edges[1:]))
        )
        return left, right

    def _middle(self, meeting: float) -> float:
        """What is in the middle of the strip [m]; it goes with the impact where there is no room for all."""
        left, right = self._ends
        if self._shown >= right - left:
            return 0.5 * (left + right)
        return min(max(meeting, left + 0.5 * self._shown), right - 0.5 * self._shown)

    def _place(self, box: Box) -> tuple[int, int, int, int]:
        """Left, bottom, width and height, from the lower left corner [pixels]."""
        return int(box.left), int(self.frame.height - box.bottom), int(box.width), int(box.height)
