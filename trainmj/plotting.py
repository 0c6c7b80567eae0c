"""Figures of a collision, drawn for a report: one look, colour-blind safe, units on every axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.chain import Chain
from trainmj.result import Result
from trainmj.units import KJ, KM_H, KN, MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
"""The look of every figure, as matplotlib's settings."""

_MOST_LABELS = 14  # more lines than this are told apart by a colour bar of numbers, not by name


def collision(result: Result) -> Figure:
    """Speeds, strokes, forces and energies of one collision over time, in four panels.

    The front interface is shown for one train, as the tables are, where both trains bring the same devices.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    chain = result.chain
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.5, 5.6), layout="constrained")
        axes = figure.subplots(2, 2, sharex=True)
        title = result.scenario.title
        if title:
            figure.suptitle(title, fontsize=9, x=0.01, ha="left")
        _speeds(axes[0, 0], result)
        share = np.array([_side_share(chain, k) for k in range(len(chain.interfaces))])
        own = _own_interfaces(chain)
        _lines(axes[0, 1], result, "Stroke", result.stroke[:, own] * share[own] / MM, "mm", own)
        _lines(axes[1, 0], result, "Force", result.force[:, own] / KN, "kN", own)
        _lines(axes[1, 1], result, "Absorbed energy", result.energy[:, own] * share[own] / KJ, "kJ", own)
        axes[0, 1].set_ylim(bottom=min(0.0, axes[0, 1].get_ylim()[0]) if chain.gap == 0 else 0.0)
        _legend(axes[0, 1], len(own), 1)  # the colours are the same in all three
        for axis in axes[1]:
            axis.set_xlabel("Time (s)")
        axes[0, 0].set_xlim(0, result.time[-1])
    return figure


def _own_interfaces(chain: Chain) -> list[int]:
    """The front interface and those of the moving train, from the front backwards."""
    return list(range(chain.front, -1, -1))


def _side_share(chain: Chain, k: int) -> float:
    interface = chain.interfaces[k]
    return (
        0.5
        if len(interface.devices) == 2 and np.allclose(interface.left_stroke * 2, interface.envelope.stroke)
        else 1.0
    )


def _speeds(axes: Axes, result: Result) -> None:
    from matplotlib import colormaps

    chain = result.chain
    sides = (
        ("moving train", range(chain.front, -1, -1), colormaps["Blues_r"]),
        ("partner", range(chain.n_moving, len(chain.vehicles)), colormaps["Oranges_r"]),
    )
    for _, indices, colours in sides:
        for place, i in enumerate(indices):
            shade = 0.1 + 0.6 * place / max(1, len(indices) - 1)
            axes.plot(result.time, result.velocity[:, i] / KM_H, color=colours(shade), label=chain.vehicles[i].name)
    axes.set_title("Speed")
    axes.set_ylabel("km/h")
    _legend(axes, len(chain.vehicles), 2)


def _lines(axes: Axes, result: Result, title: str, values: np.ndarray, unit: str, interfaces: list[int]) -> None:
    from matplotlib import colormaps

    colours = colormaps["viridis"]
    for place, k in enumerate(interfaces):
        name = result.chain.interfaces[k].name
        axes.plot(result.time, values[:, place], color=colours(0.9 * place / max(1, len(interfaces) - 1)), label=name)
    axes.set_title(title)
    axes.set_ylabel(unit)


def _legend(axes: Axes, n: int, columns: int) -> None:
    if n <= _MOST_LABELS:
        axes.legend(ncols=columns, loc="best", handlelength=1.2, columnspacing=1.0)
