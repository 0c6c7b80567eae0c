"""Where everything stands in a picture: a header, the scene, the whole train in a strip, and curves over time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import NamedTuple

_LEAST = 0.62  # of the usual size of text, at which it is still legible
_TALL = 5.4  # height of what the strip shows of a train [m]
_LOW, _HIGH = 30, 64  # least and most height of that strip [points]
_FEWEST = 1.1  # pixels of the strip for a metre; of a longer train it shows what is near the impact
_SCENE = 0.35  # of the height of a picture, at least
_CURVES = 0.42  # of the height of a picture, at most
_WIDE = 1.6  # width of a scene over its height, at least; what a tall picture has more goes to the curves


class Box(NamedTuple):
    """A rectangle in a picture, from its upper left corner [pixels]."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        """From left to right [pixels]."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """From top to bottom [pixels]."""
        return self.bottom - self.top

    def meets(self, other: Box) -> bool:
        """Whether the two have a place in common."""
        across = self.left < other.right and other.left < self.right
        return across and self.top < other.bottom and other.top < self.bottom

    def holds(self, other: Box) -> bool:
        """Whether the other one is within this one."""
        across = self.left <= other.left and other.right <= self.right
        return across and self.top <= other.top and other.bottom <= self.bottom

    def less(self, edge: float) -> Box:
        """Without so much at each side [pixels]."""
        return Box(self.left + edge, self.top + edge, self.right - edge, self.bottom - edge)


@dataclass(frozen=True)
class Frame:
    """The parts of a picture. What there is no room for has no height: the curves go first, then the strip.

    Attributes:
        width: of the picture [pixels].
        height: [pixels].
        header: time and title.
        scene: what the camera sees.
        strip: the whole train.
        names: below it, of the vehicles.
        energies: below them, of the interfaces.
        curves: one box for each panel.
    """

    width: int
    height: int
    header: Box
    scene: Box
    strip: Box
    names: Box
    energies: Box
    curves: tuple[Box, Box]

    @classmethod
    def of(cls, width: int, height: int, extent: float) -> Frame:
        """The parts of a picture of a size [pixels] of trains that reach so far [m]."""
        scale = _scale(width, height)
        lines = [
            round(scale * points) for points in (46, max(_LOW, min(_HIGH, _TALL * width / extent / scale)), 22, 24)
        ]
        header, strip, names, energies = lines
        below, curves = strip + names + energies, round(scale * 150)
        room = height - header
        if room - below - curves < _SCENE * height:
            curves = 0
        if room - below - curves < _SCENE * height:
            strip = names = energies = below = 0
        if header > (1 - 2 * _SCENE) * height:
            header = 0
        if curves:
            scene = max(round(width / _WIDE), round(_SCENE * height))
            curves = max(curves, min(height - header - below - scene, round(_CURVES * height)))
        edges = list(accumulate((0, header, height - header - below - curves, strip, names, energies)))
        rows = [Box(0, top, width, bottom) for top, bottom in pairwise(edges)]
        panels = _panels(Box(0, height - curves, width, height), 1.5 * width)
        return cls(width, height, rows[0], rows[1], rows[2], rows[3], rows[4], panels)

    def px(self, points: float) -> int:
        """Pixels of a length that is given for a picture of 1000 x 720 pixels; text stays legible in small ones."""
        return max(1, round(points * _scale(self.width, self.height)))

    def shown(self, extent: float) -> float:
        """How much the strip shows of trains that reach so far, at least what it has the height for [m]."""
        return max(min(extent, self.width / _FEWEST), self.width * _TALL / max(1.0, self.strip.height))


def _scale(width: int, height: int) -> float:
    return max(_LEAST, min(height / 720, width / 1000))


def _panels(room: Box, wide: float) -> tuple[Box, Box]:
    """Two panels side by side, or one above the other where there is more height than width for them."""
    if 4 * room.height > wide:
        middle = round(0.5 * (room.top + room.bottom))
        return room._replace(bottom=middle), room._replace(top=middle)
    middle = round(0.5 * room.width)
    return room._replace(right=middle), room._replace(left=middle)
