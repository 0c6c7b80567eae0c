"""The text on a picture: time, criteria, scale of colours and names of vehicles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import distribution

import numpy as np
from PIL import Image
from PIL.ImageDraw import Draw, ImageDraw
from PIL.ImageFont import FreeTypeFont, truetype

from trainmj.units import enough, in_digits
from trainmj.view.offscreen import Picture
from trainmj.view.shapes import colour

_INK, _SOFT, _PAPER = (25, 30, 36), (84, 92, 101), (255, 255, 255)


@dataclass(frozen=True)
class Label:
    """A word below the strip with the whole train."""

    text: str  # name of a vehicle, or the energy of an interface in kJ
    x: float  # where [pixels from the left]
    share: float | None = None  # of the full energy; None for a name


@dataclass(frozen=True)
class Overlay:
    """Writes on pictures of one film."""

    width: int  # [pixels]
    height: int  # [pixels]
    title: tuple[str, ...]  # of the collision, in lines
    full_kJ: float  # energy at the end of the colours
    strip: int = 0  # height of the strip [pixels]
    bodies: bool = False  # whether bodies give, which then take the same colours

    def write(
        self, picture: Picture, time: float, rows: Sequence[tuple[str, str]], labels: Sequence[Label]
    ) -> Image.Image:
        """The picture with the time [s], what is read then and its value, and labels below the strip.

        Names come in order of importance, as there may not be room for all.
        """
        image = Image.fromarray(picture)
        draw = Draw(image, "RGBA")
        self._numbers(draw, time, rows)
        self._scale(image, draw)
        if self.strip:
            self._names(draw, labels)
        return image

    def _pixels(self, points: float) -> int:
        """A size given for a picture of 1000 x 720 pixels; text stays legible in small ones."""
        return max(1, round(points * max(0.55, min(self.height / 720, self.width / 1000))))

    def _plate(self, draw: ImageDraw, box: tuple[float, float, float, float]) -> None:
        """What text stands on."""
        draw.rounded_rectangle(box, self._pixels(8), fill=(*_PAPER, 215))

    def _numbers(self, draw: ImageDraw, time: float, rows: Sequence[tuple[str, str]]) -> None:
        p = self._pixels
        normal = font(p(17))
        wide = p(246)
        self._plate(draw, (p(18), p(18), p(18) + wide, p(18) + p(62 + 25 * len(rows))))
        draw.text((p(32), p(26)), f"{time:.3f} s", _INK, font(p(30), True))
        for k, (name, value) in enumerate(rows):
            y = p(82 + 25 * k)
            draw.text((p(32), y), name, _SOFT, normal, anchor="lm")
            draw.text((p(18) + wide - p(12), y), value, _INK, normal, anchor="rm")
        lines = [_cut(draw, line, normal, self.width - wide - p(90)) for line in self.title]
        left = self.width - p(42) - max(draw.textlength(line, normal) for line in lines)
        self._plate(draw, (left, p(18), self.width - p(18), p(26 + 24 * len(lines))))
        for k, line in enumerate(lines):
            draw.text((self.width - p(30), p(34 + 24 * k)), line, _SOFT if k else _INK, normal, anchor="rm")

    def _scale(self, image: Image.Image, draw: ImageDraw) -> None:
        p = self._pixels
        small = font(p(14))
        length, thick = p(280), p(12)
        right, bottom = self.width - p(30), self.height - self.strip - p(44)
        said = ["absorbed energy (front: of one train)", *self.bodies * ["bodies: each member, by yielding"]]
        top = bottom - p(14 + 18 * len(said))
        self._plate(draw, (right - length - p(12), top, right + p(12), bottom + thick + p(26)))
        bar = (255 * colour(np.linspace(0, 1, length))).astype(np.uint8)
        image.paste(Image.fromarray(np.repeat(bar[None], thick, axis=0)), (right - length, bottom))
        for k, line in enumerate(said):
            draw.text((right - length, top + p(17 + 18 * k)), line, _INK, small, anchor="lm")
        for share, anchor in ((0.0, "lm"), (0.5, "mm"), (1.0, "rm")):
            text = in_digits(share * self.full_kJ, enough(0, self.full_kJ)) + (" kJ" if share == 1.0 else "")
            draw.text((right - length * (1 - share), bottom + thick + p(12)), text, _SOFT, small, anchor=anchor)

    def _names(self, draw: ImageDraw, labels: Sequence[Label]) -> None:
        p = self._pixels
        draw.line((0, self.height - self.strip, self.width, self.height - self.strip), (*_PAPER, 255), p(3))
        y = self.height - p(17)
        energies = [label for label in labels if label.share is not None]
        bare = [label.x for label in energies if not label.text]
        narrow = min([2 * p(4), *(0.8 * np.diff(bare))]) / 2  # of a long train they stay apart
        for label in energies:
            paint = (255 * colour(label.share or 0.0)).astype(int)
            half = max(p(6), draw.textlength(label.text, font(p(12))) / 2 + p(5)) if label.text else narrow
            box = (label.x - half, y - p(9), label.x + half, y + p(9))
            draw.rounded_rectangle(box, min(p(5), half), fill=(*paint, 255))
            ink = _PAPER if paint @ (0.30, 0.59, 0.11) < 140 else _INK
            draw.text((label.x, y), label.text, ink, font(p(12)), anchor="mm")
        above = p(24) if bare else 0
        taken: list[tuple[float, float]] = []
        for label in labels:
            half = draw.textlength(label.text, font(p(13))) / 2 + p(4)
            x = min(max(label.x, half), self.width - half)
            ends = x - half, x + half
            if label.share is None and all(ends[1] <= a or b <= ends[0] for a, b in taken):
                taken.append(ends)
                draw.text((x, y - above), label.text, _INK, font(p(13)), anchor="mm")


def _cut(draw: ImageDraw, text: str, fount: FreeTypeFont, room: float) -> str:
    """As much of a text as there is room for."""
    text = " ".join(text.split())
    if draw.textlength(text, fount) <= room:
        return text
    while text and draw.textlength(text + " ...", fount) > room:
        text = text[:-1]
    return text.rstrip() + " ..."


@cache
def font(size: int, bold: bool = False) -> FreeTypeFont:
    """The font of all figures, which comes with matplotlib, so that pictures look the same on every machine."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return truetype(str(distribution("matplotlib").locate_file(f"matplotlib/mpl-data/fonts/ttf/{name}")), size)
