"""Curves over time below the scene, drawn up to now and, faintly, beyond, with a cursor that moves along them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from PIL import Image
from PIL.ImageDraw import Draw

from trainmj.collision.envelope import Array
from trainmj.units import enough
from trainmj.view.frame import Box
from trainmj.view.sheet import ALARM, INK, PAPER, SOFT, Colour, Sheet, font

T = TypeVar("T", float, Array)

_FINE = 3  # times as many pixels each way as the picture has, for smooth lines
_GRID, _FAULT = (226, 229, 232), (252, 228, 226)
_STEPS = (1.0, 2.0, 5.0, 10.0)
_LEAST = 24, 12  # width and height of a panel below which it has no curve [pixels]


@dataclass(frozen=True, eq=False)
class Line:
    """One quantity over time."""

    name: str  # that is written beside its value
    values: Array  # (n_sample,) in the unit of its panel
    colour: Colour


class Panel:
    """Some quantities of one unit over time."""

    def __init__(
        self, box: Box, points: float, title: str, unit: str, time: Array, lines: Sequence[Line], until: float
    ) -> None:
        """Draw what does not change.

        Args:
            box: where it stands in the picture.
            points: pixels for a point of text.
            title: of its axis.
            unit: of its axis.
            time: (n_sample,) [s].
            lines: what it shows.
            until: when the numbers cease to be valid [s], or infinite.
        """
        self._box, self._points, self._title, self._unit, self._lines = box, points, title, unit, lines
        self._time, self._until = time, until
        self._small = font(max(7, round(13 * points)))
        low = min(0.0, *(float(line.values.min()) for line in lines))
        high = max(0.0, *(float(line.values.max()) for line in lines)) or (1.0 if low == 0.0 else 0.0)
        self._end = float(time[-1]) or 1.0
        self._ticks = _nice(low, high, max(2, int((box.height / points - 56) / 24)))
        self._low, self._high = min(low, self._ticks[0]), high + 0.06 * (high - low)
        labels = [self._said(tick) for tick in self._ticks]
        wide = max(self._small.getlength(label) for label in labels) + round(8 * points)
        pad = round(12 * points)
        self._plot = Box(
            round(box.left + pad + wide),
            round(box.top + 30 * points),
            round(box.right - 1.5 * pad),
            round(box.bottom - 26 * points),
        )
        self._fits = self._plot.width >= _LEAST[0] and self._plot.height >= _LEAST[1]
        self._times = _nice(0.0, self._end, max(2, int(self._plot.width / (90 * points)))) if self._fits else []
        self._ahead = self._drawn(past=False) if self._fits else None
        self._past = self._drawn(past=True) if self._fits else None

    def show(self, sheet: Sheet, sample: int) -> None:
        """Draw it at a sample."""
        if self._ahead is None or self._past is None:
            return
        plot, points, box = self._plot, self._points, self._box
        sheet.draw.rectangle(box, fill=PAPER)
        x = self._x(float(self._time[sample]))
        sheet.image.paste(self._ahead, (int(plot.left), int(plot.top)))
        sheet.image.paste(
            self._past.crop((0, 0, round(x - plot.left), self._past.height)), (int(plot.left), int(plot.top))
        )
        sheet.draw.line((x, plot.top, x, plot.bottom), fill=SOFT, width=max(1, round(points)))
        radius = max(2.0, 4 * points)
        for line in self._lines:
            y = self._y(float(line.values[sample]))
            sheet.draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=line.colour, outline=PAPER)
        self._write(sheet, sample)

    def _write(self, sheet: Sheet, sample: int) -> None:
        """Values at the cursor, then the axes."""
        plot, points, box = self._plot, self._points, self._box
        y, bold = box.top + 16 * points, font(max(7, round(14 * points)), True)
        right = plot.right
        largest = max(float(np.abs(line.values).max()) for line in self._lines)
        digits = enough(0, largest)
        for line in self._lines[::-1]:
            value = f"{line.values[sample]:z.{digits}f}"
            widest = max(bold.getlength(f"{v:z.{digits}f}") for v in (line.values.min(), line.values.max()))
            if sheet.put(value, (right, y), bold, line.colour, "rm", box):
                right -= widest + 5 * points
            if line.name and sheet.put(line.name, (right, y), self._small, line.colour, "rm", box):
                right -= self._small.getlength(line.name) + 14 * points
        sheet.put(f"{self._title} [{self._unit}]", (plot.left, y), self._small, INK, "lm", box)
        for tick in self._ticks:
            sheet.put(self._said(tick), (plot.left - 5 * points, self._y(tick)), self._small, SOFT, "rm", box)
        low = plot.bottom + 12 * points
        sheet.put("time [s]", (plot.right, low), self._small, SOFT, "rm", box)
        for tick in self._times:
            said = f"{tick:.6g}"
            sheet.put(said, (self._x(tick), low), self._small, SOFT, "mm", box)
        if self._until < self._end:
            start = self._x(max(0.0, self._until))
            wide = self._small.getlength("not valid") + 6 * points
            if plot.right - start > wide:
                at, high = np.linspace(start, start + wide, 20), 9 * points
                lines = [np.interp(at, self._x(self._time), self._y(line.values)) for line in self._lines]
                struck = float(np.abs(np.array(lines) - (plot.top + high)).min()) < 0.7 * high
                y = plot.bottom - high if struck else plot.top + high
                sheet.put("not valid", (start + 4 * points, y), self._small, ALARM, "lm", plot)

    def _drawn(self, past: bool) -> Image.Image:
        """The curves, with a grid, at their full strength or faint."""
        plot = self._plot
        image = Image.new("RGB", (_FINE * int(plot.width), _FINE * int(plot.height)), PAPER)
        draw = Draw(image)
        wide, tall = image.size
        if self._until < self._end:
            draw.rectangle(((self._x(max(0.0, self._until)) - plot.left) * _FINE, 0, wide, tall), fill=_FAULT)
        thin = max(1, round(_FINE * self._points))
        for tick in self._ticks:
            y = (self._y(tick) - plot.top) * _FINE
            draw.line((0, y, wide, y), fill=SOFT if tick == 0 else _GRID, width=thin)
        for tick in self._times:
            x = (self._x(tick) - plot.left) * _FINE
            draw.line((x, 0, x, tall), fill=_GRID, width=thin)
        draw.line((0, 0, 0, tall), fill=SOFT, width=2 * thin)
        for line in self._lines:
            points = np.column_stack([self._x(self._time) - plot.left, self._y(line.values) - plot.top]) * _FINE
            paint = line.colour if past else tuple(round(255 - 0.3 * (255 - c)) for c in line.colour)
            draw.line(points.ravel().tolist(), fill=paint, width=2 * thin, joint="curve")
        return image.resize((int(plot.width), int(plot.height)), Image.Resampling.BOX)

    def _x(self, time: T) -> T:
        return self._plot.left + time / self._end * self._plot.width

    def _y(self, value: T) -> T:
        return self._plot.bottom - (value - self._low) / (self._high - self._low) * self._plot.height

    def _said(self, tick: float) -> str:
        return f"{tick:.6g}"


def _nice(low: float, high: float, most: int) -> list[float]:
    """Round numbers between two, 0 among them, at most about so many above it."""
    rough = max(high - low, 1e-12) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(s * power for s in _STEPS if s * power >= rough * (1 - 1e-9))
    return [k * step for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]
