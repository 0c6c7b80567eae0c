"""Text on a picture that never overlaps: what has no room, or would cover other text, is left out."""

from __future__ import annotations

from functools import cache
from importlib.metadata import distribution

from PIL.Image import Image
from PIL.ImageDraw import Draw
from PIL.ImageFont import FreeTypeFont, truetype

from trainmj.view.frame import Box

Colour = tuple[int, int, int]
INK, SOFT, PAPER, ALARM = (25, 30, 36), (84, 92, 101), (255, 255, 255), (176, 18, 27)


class Sheet:
    """One picture that is written on.

    Attributes:
        image: the picture.
        draw: what else is drawn with on it.
        texts: what has been written, with the room that it takes.
        plates: what it stands on in the scene.
    """

    def __init__(self, image: Image, gap: float = 0.0) -> None:
        """Write on a picture, with a gap between texts beside each other [pixels]."""
        self.image, self.draw, self._gap = image, Draw(image, "RGBA"), gap
        self.texts: list[tuple[str, Box]] = []
        self.plates: list[Box] = []

    def put(
        self,
        text: str,
        at: tuple[float, float],
        fount: FreeTypeFont,
        ink: Colour = INK,
        anchor: str = "lm",
        within: Box | None = None,
        chip: tuple[float, float, Colour] | None = None,
    ) -> bool:
        """Write a text if there is room for it.

        Args:
            text: in one line.
            at: where its anchor is [pixels].
            fount: its font.
            ink: its colour.
            anchor: as Pillow has it: left, middle or right, then middle, ascender, ...
            within: what it may not leave; the picture if not given.
            chip: half width, half height [pixels] and colour of what it stands on, its middle at the anchor.

        Returns:
            Whether it was written.
        """
        box = Box(*self.draw.textbbox(at, text, fount, anchor=anchor)) if text else Box(*at, *at)
        if chip is not None:
            half, tall, paint = chip
            box = Box(at[0] - half, at[1] - tall, at[0] + half, at[1] + tall)
        room = within or Box(0, 0, *self.image.size)
        apart = box._replace(left=box.left - self._gap, right=box.right + self._gap)
        if not room.holds(box) or any(apart.meets(taken) for _, taken in self.texts):
            return False
        self.texts.append((text, box))
        if chip is not None:
            self.draw.rounded_rectangle(box, min(half, 0.5 * tall), fill=paint)
        self.draw.text(at, text, ink, fount, anchor=anchor)
        return True

    def plate(self, box: Box, radius: float) -> None:
        """What text stands on in the scene."""
        self.plates.append(box)
        self.draw.rounded_rectangle(box, radius, fill=(*PAPER, 222))


def cut(text: str, fount: FreeTypeFont, room: float) -> str:
    """As much of a text as there is room for [pixels]."""
    text = " ".join(text.split())
    if fount.getlength(text) <= room:
        return text
    while text and fount.getlength(text + " ...") > room:
        text = text[:-1]
    return text.rstrip() + " ..."


@cache
def font(size: int, bold: bool = False) -> FreeTypeFont:
    """The font of all figures, which comes with matplotlib, so that pictures look the same on every machine."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return truetype(str(distribution("matplotlib").locate_file(f"matplotlib/mpl-data/fonts/ttf/{name}")), size)
