"""Figures of an identification: deviations, channels, correlations between the parameters, and the search."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.output.style import BLUE, GREY, ORANGE, PALETTE, diverging, figure, grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trainmj.identification.found import Found

_MOST_WRITTEN = 16  # parameters whose correlations are written into their cells
_MOST_IN_COLUMN = 6
_MOST_PANELS = 12  # channels in a figure


def residuals(found: Found) -> Figure:
    """Deviation of each value over what is allowed, by target: filled if fitted, open if held out."""
    table = found.residuals
    targets = [t.name for t in found.plan.targets if t.name in set(table["target"])]
    picture = figure(height=22 + 6.5 * len(targets))
    axes = picture.subplots()
    for role, colour, shift in (("fitted", BLUE, -0.17), ("held out", ORANGE, 0.17)):
        of = table[table["role"] == role]
        if of.empty:
            continue
        rows = np.array([targets.index(name) for name in of["target"]])
        ratio = (of["deviation"] / of["allowed"]).to_numpy()
        look: dict[str, Any] = {
            "facecolors": colour if role == "fitted" else "none",
            "edgecolors": colour,
            "linewidths": 0.8,
        }
        axes.scatter(ratio, rows + shift, s=11, label=role, zorder=3, clip_on=False, **look)
    axes.axvspan(-1, 1, color="0.93", zorder=0)
    axes.axvline(0, color=GREY, linewidth=0.8)
    axes.set_yticks(range(len(targets)), targets)
    axes.set_ylim(len(targets) - 0.5, -0.5)
    reach = 1.05 * float(max(1.2, (table["deviation"] / table["allowed"]).abs().max()))
    axes.set_xlim(-reach, reach)
    axes.set_xlabel("(found - wanted) / allowed")
    picture.suptitle("Deviations; the grey band is allowed", x=0.01, ha="left", fontweight="bold")
    picture.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return picture


def correlations(found: Found) -> Figure:
    """Correlations between the errors of the parameters, without parameters at a bound."""
    names = found.plan.unknowns.names
    there = ~np.isnan(np.diag(found.known.correlation))
    shown = [name for name, yes in zip(names, there, strict=True) if yes]
    values = found.known.correlation[np.ix_(there, there)]
    n = len(shown)
    picture = figure("column" if n <= _MOST_IN_COLUMN else "page", float(np.clip(30 + 7 * n, 60, 165)))
    axes = picture.subplots()
    axes.grid(False)
    if n == 0:
        axes.text(0.5, 0.5, "every parameter is at a bound", ha="center", va="center", transform=axes.transAxes)
        axes.set_axis_off()
        return picture
    image = axes.imshow(values, cmap=diverging(), vmin=-1, vmax=1)
    axes.set_xticks(range(n), shown, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(n), shown)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    for (i, j), value in np.ndenumerate(values) if n <= _MOST_WRITTEN else ():
        axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=6, color="w" if abs(value) > 0.6 else "0.1")
    picture.colorbar(image, shrink=0.8, label="correlation")
    picture.suptitle("Correlations between the errors", x=0.01, ha="left", fontweight="bold")
    return picture


def channels(found: Found) -> Figure | None:
    """Each channel of the tests and the simulation over time; None if there are none."""
    of = [(role, channel) for role in found.samples for channel in found.channels(role)]
    if not of:
        return None
    picture, panels = grid(min(len(of), _MOST_PANELS), 42.0, most=2, narrowest=70.0)
    for axes, (role, channel) in zip(panels, of, strict=False):
        axes.plot(channel.time, channel.wanted, color=GREY, linewidth=2.4, alpha=0.6, label="test")
        axes.plot(channel.time, channel.found, color=BLUE, label="simulation")
        axes.set_title(channel.title + ", held out" * (role != "fitted"), loc="left")
        axes.set_ylabel(channel.target.unit)
        axes.set_xlabel("time of the test (s)")
    more = f"; the first {_MOST_PANELS} of {len(of)}" if len(of) > _MOST_PANELS else ""
    picture.suptitle(f"Channels{more}", x=0.01, ha="left", fontweight="bold")
    picture.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return picture


def search(found: Found) -> Figure | None:
    """The smallest misfit so far over the steps of the search; None if there was none."""
    if not found.way:
        return None
    picture = figure("column")
    axes = picture.subplots()
    for colour, (phase, (steps, costs)) in zip(PALETTE, found.phases().items(), strict=False):
        axes.semilogy(steps, costs, color=colour, label=phase)
    axes.set_xlabel("generations and iterations")
    axes.set_ylabel("misfit")
    axes.legend()
    return picture


FIGURES: dict[str, Callable[[Found], Figure | None]] = {
    "residuals": residuals,
    "channels": channels,
    "correlations": correlations,
    "search": search,
}
"""Every figure by the name of its file; draw under :func:`trainmj.output.style.styled`."""
