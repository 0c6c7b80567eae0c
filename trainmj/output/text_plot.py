"""A small plot of lines in plain characters, for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Line(NamedTuple):
    """A line: the character that draws it, and (n,) values, x growing or falling."""

    sign: str
    x: Array
    y: Array


def text_plot(title: str, lines: Sequence[Line], axis: str, width: int, rows: int) -> str:
    """A plot of lines from 0 on, the first ones on top.

    Args:
        title: above it.
        lines: to draw.
        axis: name of the horizontal axis.
        width: characters in a line, all told.
        rows: of the plot itself.
    """
    right = max(float(line.x.max()) for line in lines) or 1.0
    top = max(float(line.y.max()) for line in lines) or 1.0
    said = f"{top:.4g}"
    columns = width - len(said) - 2
    canvas = [[" "] * columns for _ in range(rows)]
    for line in reversed(lines):
        order = np.argsort(line.x, kind="stable")
        at, height = line.x[order], line.y[order]
        edges = np.linspace(0.0, right, columns + 1)
        ends = np.interp(edges, at, height)
        for column, (low, high) in enumerate(pairwise(edges)):
            reached = [*ends[column : column + 2], *height[(at >= low) & (at <= high)]]
            first, last = (round(max(0.0, float(v)) / top * (rows - 1)) for v in (min(reached), max(reached)))
            for row in range(first, last + 1):
                canvas[rows - 1 - row][column] = line.sign
    marks = [said, *[""] * (rows - 2), "0"]
    body = [f"{mark:>{len(said)}} |{''.join(row).rstrip()}" for mark, row in zip(marks, canvas, strict=True)]
    pad, end = " " * (len(said) + 1), f"{right:.4g}"
    return "\n".join([title, *body, f"{pad}+{'-' * columns}", f"{pad}0{axis:^{columns - len(end)}}{end}"])
