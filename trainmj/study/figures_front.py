"""Figures of a study's last steps: search, fronts, weights, decision, check; see :mod:`trainmj.study.figures`."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.doe import Weights
from trainmj.doe.arrays import FloatArray
from trainmj.output.style import BLUE, GREEN, GREY, ORANGE, SKY, grid
from trainmj.units import against

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from trainmj.study.plan import Study


def progress(history: pd.DataFrame, where: str) -> Figure:
    """Growth of the front and share of feasible points over the search."""
    figure, (volume, share) = grid(2, 58.0)
    most = history["hypervolume"].max()
    volume.plot(history["evaluations"], history["hypervolume"] / (most if most > 0 else 1.0), color=BLUE)
    volume.set(title="Hypervolume, part of the last", xlabel="evaluations", ylim=(None, 1.02))
    share.plot(history["evaluations"], 100 * history["feasible"], color=GREEN)
    share.set(title="Points that keep the limits (%)", xlabel="evaluations", ylim=(-2, 102))
    figure.suptitle(f"Search on the {where}", x=0.01, ha="left")
    return figure


def fronts(
    study: Study,
    predicted: FloatArray,
    simulated: FloatArray,
    direct: FloatArray,
    *,
    kept: NDArray[np.bool_],
    facts: Mapping[str, Any],
) -> Figure:
    """The surrogates' front, the same designs simulated, and the front found on the simulator; objectives (n, m)."""
    figure, panels = _pairs(study)
    for axes, i, j in panels:
        axes.scatter(direct[:, i], direct[:, j], s=40, color=SKY, label="found on the simulator", zorder=2)
        axes.plot(predicted[:, i], predicted[:, j], "s", ms=4, mfc="none", mec=ORANGE, mew=0.8,
                  label="found on the surrogates", zorder=3)  # fmt: skip
        axes.plot(simulated[kept, i], simulated[kept, j], ".", ms=5, color="black", zorder=4,
                  label="surrogates' front, simulated")  # fmt: skip
        if not kept.all():
            axes.plot(simulated[~kept, i], simulated[~kept, j], "x", ms=4, color=GREY, zorder=4,
                      label="the same, beyond a limit")  # fmt: skip
    _legend(figure, panels)
    title = "Hypervolume, surrogates' front over simulator's:\n"
    title += f"{facts['ratio_predicted']:.3f} predicted, {facts['ratio_simulated']:.3f} simulated"
    figure.suptitle(title, x=0.01, ha="left")
    return figure


def weights(found: Weights) -> Figure:
    """The weights of the objectives as bars."""
    figure, (axes,) = grid(1, 18.0 + 7 * len(found.names))
    _bars(axes, found.names, found.weight, BLUE, "{:.4f}".format)
    axes.set_xlabel("weight")
    axes.set_title(found.description[:1].upper() + found.description[1:], fontsize=7, fontweight="normal")
    return figure


def decision(study: Study, values: FloatArray, picked: Mapping[str, FloatArray], simulated: FloatArray) -> Figure:
    """The front (n, m), what the study's method, the first, and others choose, and the chosen design simulated (m,).

    A line joins the chosen design as it stands on the front with its simulation.
    """
    figure, panels = _pairs(study)
    (method, chosen), *others = picked.items()
    searched = "surrogates" if study.on_surrogates else "simulator"
    for axes, i, j in panels:
        pair = [i, j]
        axes.plot(values[:, i], values[:, j], ".", ms=5, color=GREY, label=f"front found on the {searched}", zorder=2)
        axes.plot(*np.stack([chosen, simulated])[:, pair].T, "-", color=ORANGE, lw=1.2, zorder=3)
        axes.plot(*chosen[pair], "o", ms=8, mfc="none", mec=ORANGE, ls="none", label=f"chosen: {method}", zorder=4)
        axes.plot(*simulated[pair], "o", ms=5, color=ORANGE, ls="none", label="the same, simulated", zorder=6)
        for (name, values_of), marker in zip(others, ("s", "^"), strict=False):
            axes.plot(*values_of[pair], marker, ms=11, mfc="none", mec=BLUE, mew=1.2, ls="none", label=name, zorder=5)
    _legend(figure, panels)
    return figure


def check(study: Study, table: pd.DataFrame) -> Figure:
    """Errors of the prediction at the chosen design, those too large in another colour, and what it uses of limits."""
    limited = [limit for limit in study.limits if limit.value != 0]
    height = 18.0 + 6 * max(len(table), len(limited))
    figure, panels = grid(2 if limited else 1, height, narrowest=80.0)
    colours = [ORANGE if missed else BLUE for missed in table["missed"]]
    errors = table["error_of_range_percent"].to_numpy()
    _bars(panels[0], table["response"].tolist(), errors, colours, "{:+z.2f}".format)
    panels[0].set(title="Predicted less simulated", xlabel="part of the range over the design (%)")
    if limited:
        simulated = table.set_index("response")["simulated"]
        used = np.array([100 * simulated[limit.response.name] / limit.value for limit in limited])
        _bars(panels[1], [limit.text for limit in limited], used, GREEN, lambda part: against(part, 100, 0))
        panels[1].axvline(100, color=ORANGE, linewidth=1.4)
        panels[1].set(title="Simulated, chosen design", xlabel="part of the limit (%)")
    return figure


def held(used: Mapping[str, FloatArray]) -> Figure:
    """Of trains as built (n,) of each design, the part of them that use more than a share of their limits [%]."""
    figure, (axes,) = grid(1, 78.0)
    colours = dict(zip(used, itertools.cycle((BLUE, ORANGE, GREEN, SKY, GREY))))
    for name, values in used.items():
        known = np.sort(values[np.isfinite(values)])
        part = 1.0 - np.arange(1, len(known) + 1) / (len(values) + 1)
        axes.step(known, 100 * part, where="post", color=colours[name], label=name)
    axes.axvline(100, color="0.3", linewidth=1.0)
    axes.set(
        title="How much trains as built use",
        xlabel="part of the nearest limit (%)",
        ylabel="trains that use more (%)",
        yscale="log",
    )
    axes.yaxis.set_major_formatter("{x:g}")
    axes.legend()
    return figure


def both_fronts(study: Study, nominal: FloatArray, robust: FloatArray, statistics: Sequence[str]) -> Figure:
    """The front of the train as designed and that of designs that hold, objectives (n, m) each, the latter named."""
    figure, panels = _pairs(study)
    for axes, i, j in panels:
        axes.plot(nominal[:, i], nominal[:, j], ".", ms=5, color=GREY, label="nominal: the train as designed")
        axes.plot(
            robust[:, i], robust[:, j], "o", ms=4, mfc="none", mec=ORANGE, label=f"robust: {', '.join(statistics)}"
        )
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=1)
    return figure


def _legend(figure: Figure, panels: list[tuple[Axes, int, int]]) -> None:
    """One legend, below all panels: within one, its signs could be taken for designs of the front."""
    entries = panels[0][0].get_legend_handles_labels()
    figure.legend(*entries, loc="outside lower center", ncols=2 if len(panels) == 1 else 4, labelspacing=0.9)


def _bars(
    axes: Axes, names: Sequence[str], values: FloatArray, colour: str | Sequence[str], said: Callable[[float], str]
) -> None:
    place = np.arange(len(names))[::-1]
    bars = axes.barh(place, np.nan_to_num(values), height=0.6, color=colour)
    for text in axes.bar_label(bars, [said(v) if np.isfinite(v) else "-" for v in values], padding=3, fontsize=7):
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.3})  # it may lie on a line
    axes.set_yticks(place, names)
    axes.margins(x=0.2)
    axes.locator_params(axis="x", nbins=5)
    axes.axvline(0, color="0.3", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.grid(visible=False, axis="y")


def _pairs(study: Study) -> tuple[Figure, list[tuple[Axes, int, int]]]:
    """A panel for each pair of objectives, with the indices of the two."""
    labels = [r.label for r in study.objectives]
    pairs = list(itertools.combinations(range(len(labels)), 2))
    figure, panels = grid(len(pairs), 80.0 if len(pairs) == 1 else 66.0)  # a single one has more lines of legend
    for axes, (i, j) in zip(panels, pairs, strict=True):
        axes.set(xlabel=labels[i], ylabel=labels[j])
    return figure, [(axes, i, j) for axes, (i, j) in zip(panels, pairs, strict=True)]
