"""The figure of a collision: speeds, strokes, forces and energies over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.result import Result
from trainmj.output.style import Width, grid, styled
from trainmj.units import KJ, KM_H, KN, MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_MOST_VEHICLES, _MOST_INTERFACES = 6, 8  # of one side, that are all named; of more the first ones and the last


def collision(result: Result, width: Width = "page") -> Figure:
    """Speeds, strokes, forces and energies of one collision over time, in four panels.

    The front interface is shown for one train, as the tables are, where both trains bring the same devices.

    Args:
        result: of the collision.
        width: of the figure; in a column the panels stand one below the other.
    """
    chain = result.chain
    with styled(width):
        figure, axes = grid(4, 62.0 if width == "page" else 50.0, most=2)
        if result.scenario.title:
            # lines are broken as if dollars were formulas, whatever parse_math says, unless they are written so
            title = result.scenario.title.replace("$", r"\$")
            figure.suptitle(title, x=0.01, ha="left", wrap=True, parse_math=True)
        _speeds(axes[0], result)
        share = np.array([interface.shown_share for interface in chain.interfaces])
        own = _own_interfaces(chain)
        _lines(axes[1], result, "Stroke", result.stroke[:, own] * share[own] / MM, "mm", own)
        _lines(axes[2], result, "Force", result.force[:, own] / KN, "kN", own)
        _lines(axes[3], result, "Absorbed energy", result.energy[:, own] * share[own] / KJ, "kJ", own)
        axes[1].set_ylim(bottom=min(0.0, axes[1].get_ylim()[0]) if chain.gap == 0 else 0.0)
        named = _named(axes[1].lines, _MOST_INTERFACES)
        half = (len(named) + 1) // 2
        _legend(axes[1], [named[:half], named[half:]])  # the colours are the same in all three
        for axis in axes:
            axis.set_xlim(0, result.time[-1])
        for axis in axes[2:] if width == "page" else axes[3:]:
            axis.set_xlabel("Time (s)")
    return figure


def _own_interfaces(chain: Chain) -> list[int]:
    """The front interface and those of the moving train, from the front backwards."""
    return list(range(chain.front, -1, -1))


def _speeds(axes: Axes, result: Result) -> None:
    from matplotlib import colormaps

    chain = result.chain
    sides = (
        ("moving train", range(chain.front, -1, -1), colormaps["Blues_r"]),
        ("partner", range(chain.n_moving, len(chain.vehicles)), colormaps["Oranges_r"]),
    )
    for _, indices, colours in sides:
        for place, i in enumerate(indices):
            shade = 0.1 + 0.6 * _part(place, len(indices))
            axes.plot(result.time, result.velocity[:, i] / KM_H, color=colours(shade), label=chain.vehicles[i].name)
    axes.set_title("Speed")
    axes.set_ylabel("km/h")
    _legend(
        axes, [_named(side, _MOST_VEHICLES) for side in (axes.lines[: chain.n_moving], axes.lines[chain.n_moving :])]
    )


def _lines(axes: Axes, result: Result, title: str, values: np.ndarray, unit: str, interfaces: list[int]) -> None:
    from matplotlib import colormaps

    colours = colormaps["viridis"]
    for place, k in enumerate(interfaces):
        name = result.chain.interfaces[k].name
        axes.plot(result.time, values[:, place], color=colours(0.9 * _part(place, len(interfaces))), label=name)
    axes.set_title(title)
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
