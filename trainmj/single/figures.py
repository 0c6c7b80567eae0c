"""The figure of a collision: speeds, strokes, forces and energies over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.device import Array
from trainmj.collision.result import HISTORIES, Result
from trainmj.output.style import Width, grid, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_MOST_VEHICLES, _MOST_INTERFACES = 6, 8  # of one side, that are all named; of more the first ones and the last

OF_INTERFACES = {"stroke": "Stroke", "force": "Force", "energy": "Absorbed energy"}
"""Histories of interfaces that are drawn, and their titles."""


def shown(result: Result, name: str) -> tuple[Array, str]:
    """(n_sample, n) values of a history as they are drawn, and their unit.

    Stroke and energy of the front are those of one train, as in the tables, if both trains bring the same device.

    Args:
        result: of the collision.
        name: of the history, such as stroke.
    """
    history = HISTORIES[name]
    values: Array = getattr(result, name)
    if name in ("stroke", "energy"):
        values = values * np.array([interface.shown_share for interface in result.chain.interfaces])
    return values / history.factor, history.shown


def collision(result: Result, width: Width = "page") -> Figure:
    """Speeds, strokes, forces and energies of one collision over time, in four panels.

    Args:
        result: of the collision.
        width: of the figure; in a column the panels are stacked.
    """
    chain = result.chain
    with styled(width):
        figure, axes = grid(4, 62.0 if width == "page" else 50.0, most=2)
        if result.scenario.title:
            # lines are broken as if dollars were formulas, whatever parse_math says, unless they are written so
            title = result.scenario.title.replace("$", r"\$")
            figure.suptitle(title, x=0.01, ha="left", wrap=True, parse_math=True)
        _speeds(axes[0], result)
        for panel, name in zip(axes[1:], OF_INTERFACES, strict=True):
            _lines(panel, result, name)
        axes[1].set_ylim(bottom=min(0.0, axes[1].get_ylim()[0]) if chain.gap == 0 else 0.0)
        named = _named(axes[1].lines, _MOST_INTERFACES)
        half = (len(named) + 1) // 2
        _legend(axes[1], [named[:half], named[half:]])  # the colours are the same in all three
        for axis in axes:
            axis.set_xlim(0, result.time[-1])
        for axis in axes[2:] if width == "page" else axes[3:]:
            axis.set_xlabel("Time (s)")
    return figure


def _speeds(axes: Axes, result: Result) -> None:
    from matplotlib import colormaps

    chain = result.chain
    values, unit = shown(result, "velocity")
    for indices, colours in (
        (range(chain.front, -1, -1), colormaps["Blues_r"]),
        (range(chain.n_moving, len(chain.vehicles)), colormaps["Oranges_r"]),
    ):
        for place, i in enumerate(indices):
            shade = 0.1 + 0.6 * _part(place, len(indices))
            axes.plot(result.time, values[:, i], color=colours(shade), label=chain.vehicles[i].name)
    axes.set_title("Speed")
    axes.set_ylabel(unit)
    sides = axes.lines[: chain.n_moving], axes.lines[chain.n_moving :]
    _legend(axes, [_named(side, _MOST_VEHICLES) for side in sides])


def _lines(axes: Axes, result: Result, name: str) -> None:
    """A line for each interface of the moving train, from the front backwards."""
    from matplotlib import colormaps

    values, unit = shown(result, name)
    colours, n = colormaps["viridis"], result.chain.n_moving
    for place, k in enumerate(range(result.chain.front, -1, -1)):
        colour = colours(0.9 * _part(place, n))
        axes.plot(result.time, values[:, k], color=colour, label=result.chain.interfaces[k].name)
    axes.set_title(OF_INTERFACES[name])
    axes.set_ylabel(unit)


def _part(place: int, n: int) -> float:
    """Where the line at a place of n stands on the scale of shades; of many lines the first differ more."""
    part = place / max(1, n - 1)
    return part if n <= _MOST_INTERFACES else float(np.sqrt(part))


def _named(lines: Sequence[Line2D], most: int) -> list[Line2D]:
    """The lines that a legend names: all of them, or the first ones, an ellipsis and the last."""
    from matplotlib.lines import Line2D

    more = Line2D([], [], linestyle="none", label="...")
    return list(lines) if len(lines) <= most else [*lines[: most - 2], more, lines[-1]]


def _legend(axes: Axes, rows: Sequence[Sequence[Line2D]]) -> None:
    """Names above the panel, clear of the lines, in rows."""
    from matplotlib.lines import Line2D

    columns = max(map(len, rows))
    empty = Line2D([], [], linestyle="none", label=" ")
    filled = [[*row, *[empty] * (columns - len(row))] for row in rows]
    axes.legend(
        handles=[row[k] for k in range(columns) for row in filled],  # matplotlib fills column by column
        ncols=columns,
        loc="lower right",
        bbox_to_anchor=(1.01, 0.99),
        borderaxespad=0.0,
        handlelength=1.0,
        handletextpad=0.4,
        columnspacing=0.8,
        labelspacing=0.25,
    )
