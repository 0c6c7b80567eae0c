"""What is written on a picture: time and title, numbers, marks, scale of colours, names and energies of the strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from PIL import Image
from PIL.ImageFont import FreeTypeFont

from trainmj.units import enough, in_digits
from trainmj.view.curves import Panel
from trainmj.view.frame import Box, Frame
from trainmj.view.offscreen import Picture
from trainmj.view.shapes import colour
from trainmj.view.sheet import ALARM, INK, PAPER, SOFT, Sheet, cut, font

_STEPS = (1, 2, 5, 10, 20, 50, 100)  # of the numbers of vehicles that are named
_NARROW = 0.8  # of the distance between interfaces, a chip that has no room for its number


@dataclass(frozen=True)
class Name:
    """A vehicle below the strip."""

    text: str
    number: int  # from the front
    x: float  # of its middle [pixels from the left]


@dataclass(frozen=True)
class Energy:
    """What an interface has absorbed, below the strip."""

    text: str  # in kJ
    x: float  # [pixels from the left]
    share: float  # of the full energy


@dataclass(frozen=True)
class Said:
    """What is written at one sample."""

    sample: int
    time: float  # [s]
    rows: Sequence[tuple[str, str]]  # names and values, the most important ones first
    marks: Sequence[str]  # in red
    names: Sequence[Name]  # from left to right
    energies: Sequence[Energy]  # from the front to the ends


@dataclass(frozen=True)
class Overlay:
    """Writes on pictures of one film."""

    frame: Frame
    title: tuple[str, ...]  # of the collision, in lines
    pace: str  # of the film; empty for a still
    full_kJ: float  # energy at the end of the colours
    panels: Sequence[Panel]
    two_sided: bool = True  # whether the front has two sides, of which one is told
    bodies: bool = False  # whether bodies give, which then take the same colours
    marked: int = 0  # lines of marks at some time

    def write(self, picture: Picture, said: Said) -> Image.Image:
        """The picture with all that is written at a sample."""
        return self.written(picture, said).image

    def written(self, picture: Picture, said: Said) -> Sheet:
        """The same, with the places of its texts."""
        sheet = Sheet(Image.fromarray(picture), self.frame.px(4))
        self._head(sheet, said.time)
        self._marks(sheet, said.marks)
        self._scale(sheet)
        self._numbers(sheet, said.rows)
        self._below(sheet, said)
        for panel in self.panels:
            panel.show(sheet, said.sample)
        return sheet

    def _head(self, sheet: Sheet, time: float) -> None:
        p, header = self.frame.px, self.frame.header
        if not header.height:
            return
        sheet.draw.rectangle(header, fill=PAPER)
        left, middle = float(p(16)), 0.5 * (header.top + header.bottom)
        big, normal, small = font(p(28), True), font(p(16)), font(p(14))
        said, room = f"{time:.3f} s", header.less(1)
        sheet.put(said, (left, middle), big, INK, "lm", room)
        left += big.getlength("0.000 s") + p(14)
        if self.pace and small.getlength(self.pace) < 0.2 * header.width:
            sheet.put(self.pace, (left, middle), small, SOFT, "lm", room)
            left += small.getlength(self.pace) + p(14)
        wide = header.right - p(16) - left
        for line, fount, ink, y in zip(self.title, (normal, small), (INK, SOFT), (-p(10), p(11)), strict=True):
            fount = _fitting(line, fount, wide, p(11))
            sheet.put(cut(line, fount, wide), (header.right - p(16), middle + y), fount, ink, "rm", room)

    def _marks(self, sheet: Sheet, marks: Sequence[str]) -> None:
        p, scene = self.frame.px, self.frame.scene
        for k, line in enumerate(marks):
            top = scene.top + p(26) * k
            row = Box(scene.left, top, scene.right, top + p(26))
            if row.bottom > scene.top + 0.3 * scene.height:
                return
            fount = _fitting(line, font(p(15), True), row.width - p(32), p(11))
            sheet.draw.rectangle(row, fill=ALARM)
            words = cut(line, fount, row.width - p(32))
            sheet.put(words, (p(16), 0.5 * (row.top + row.bottom)), fount, PAPER, "lm", row)

    def _numbers(self, sheet: Sheet, rows: Sequence[tuple[str, str]]) -> None:
        p, scene = self.frame.px, self.frame.scene
        normal, strong = font(p(15)), font(p(15), True)
        top = scene.top + p(10) + self.marked * p(26)
        n = min(len(rows), int((0.45 * scene.height - p(16)) / p(22)))
        if n < 1:
            return
        names, values = (max(f.getlength(row[c]) for row in rows) for c, f in ((0, normal), (1, strong)))
        wide = names + values + p(40)
        plate = Box(p(12), top, p(12) + wide, top + p(12) + n * p(22))
        if plate.right > 0.5 * scene.width:
            return
        sheet.plate(plate, p(6))
        for k, (name, value) in enumerate(rows[:n]):
            y = top + p(17) + p(22) * k
            sheet.put(name, (plate.left + p(12), y), normal, SOFT, "lm", plate)
            sheet.put(value, (plate.right - p(12), y), strong, INK, "rm", plate)

    def _scale(self, sheet: Sheet) -> None:
        """What colours mean."""
        p, scene = self.frame.px, self.frame.scene
        small = font(p(13))
        said = [
            "absorbed energy [kJ]" + "; front: one train's side" * self.two_sided,
            *self.bodies * ["bodies: each member, by yielding"],
        ]
        length, thick = round(max(small.getlength(line) for line in said)), p(10)
        plate = Box(0, 0, length + p(24), p(18) * len(said) + thick + p(30))
        plate = Box(
            scene.right - plate.right - p(12), scene.bottom - plate.bottom - p(10), scene.right - p(12),
            scene.bottom - p(10),
        )  # fmt: skip
        if plate.left < 0.5 * scene.width or plate.height > 0.4 * scene.height:
            return
        sheet.plate(plate, p(6))
        left, top = round(plate.left + p(12)), plate.top + p(6)
        for k, line in enumerate(said):
            sheet.put(line, (left, top + p(18) * k + p(8)), small, INK, "lm", plate)
        bar = (255 * colour(np.linspace(0, 1, length))).astype(np.uint8)
        level = round(top + p(18) * len(said) + p(1))
        sheet.image.paste(Image.fromarray(np.repeat(bar[None], thick, axis=0)), (left, level))
        for share, anchor in ((0.0, "lm"), (1.0, "rm"), (0.5, "mm")):
            text = in_digits(share * self.full_kJ, enough(0, self.full_kJ))
            at = left + length * share, level + thick + p(10)
            sheet.put(text, at, small, SOFT, anchor, plate)

    def _below(self, sheet: Sheet, said: Said) -> None:
        """Names and energies below the strip."""
        p, frame = self.frame.px, self.frame
        if not frame.strip.height:
            return
        sheet.draw.rectangle((0, frame.names.top, frame.width, frame.energies.bottom), fill=PAPER)
        for row, line in ((frame.strip.top, PAPER), (frame.energies.bottom, (205, 209, 213))):
            sheet.draw.line((0, row, frame.width, row), fill=line, width=max(1, p(2)))
        names, small = font(p(13)), font(p(12))
        y = 0.5 * (frame.names.top + frame.names.bottom)
        for name in _named(said.names, names, p(8)):
            sheet.put(name.text, (name.x, y), names, INK, "mm", frame.names)
        widest = max(small.getlength(in_digits(self.full_kJ, enough(0, self.full_kJ))), small.getlength("00"))
        places = sorted(energy.x for energy in said.energies)
        apart = min(np.diff(places), default=float(frame.width))
        y = 0.5 * (frame.energies.top + frame.energies.bottom) - p(1)
        half, thin = 0.5 * widest + p(5), max(1.0, 0.5 * min(p(12), _NARROW * apart))
        all_told = apart > 2 * half + p(4)
        for n, energy in enumerate(said.energies):
            red, green, blue = (255 * colour(energy.share)).astype(int).tolist()
            ink = PAPER if 0.30 * red + 0.59 * green + 0.11 * blue < 140 else INK
            text, wide = (energy.text, half) if all_told or n == 0 else ("", thin)
            sheet.put(text, (energy.x, y), small, ink, "mm", frame.energies, (wide, p(9), (red, green, blue)))


def _named(names: Sequence[Name], fount: FreeTypeFont, gap: float) -> list[Name]:
    """The heads, then those of every second, fifth, tenth ... vehicle, so many as have room."""
    widest = max(fount.getlength(name.text) for name in names) + gap
    apart = min((abs(b.x - a.x) for a, b in pairwise(names)), default=widest)
    step = next((step for step in _STEPS if step * apart >= widest), _STEPS[-1])
    found = [name for name in names if name.number == 1 or name.number % step == 0]
    return sorted(found, key=lambda name: name.number)


def _fitting(line: str, fount: FreeTypeFont, room: float, least: int) -> FreeTypeFont:
    """The largest font in which a line has room, but not smaller than a size [pixels]."""
    name, size = "Bold" in (fount.getname()[1] or ""), int(fount.size)
    while size > least and font(size, name).getlength(line) > room:
        size -= 1
    return font(size, name)
