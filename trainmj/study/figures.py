"""Figures of a study's first steps: design, responses, correlation, surrogates.

Draw them under :func:`trainmj.output.style.styled`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.doe import Correlation, Factor, Space, Surrogate
from trainmj.doe.arrays import FloatArray, varies
from trainmj.output.style import BLUE, GREY, ORANGE, diverging, figure, grid, set_width
from trainmj.units import label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from trainmj.study.plan import Study

_LONG = 6  # letters of a level's name that fit beside the next
_CELL = 20  # width of a coefficient with its interval [mm]
_GRID = 61  # points along each side of a surface


def design(space: Space, points: FloatArray) -> Figure:
    """The points (n, d) of a design, each pair of factors against each other."""
    pairs = list(itertools.combinations(range(space.d), 2)) or [(0, 0)]
    picture, panels = grid(len(pairs), 56.0 if len(pairs) > 1 else 76.0)
    for axes, (i, j) in zip(panels, pairs, strict=True):
        y = points[:, j] if i != j else np.zeros(len(points))
        axes.scatter(points[:, i], y, s=18, color=BLUE, zorder=3, clip_on=False)
        _name_axis(axes, "x", space.factors[i])
        if i != j:
            _name_axis(axes, "y", space.factors[j])
        else:
            axes.set_yticks([])
    picture.suptitle(f"Design: {len(points)} points", x=0.01, ha="left", fontweight="bold")
    return picture


def responses(study: Study, points: FloatArray, values: FloatArray) -> Figure:
    """Responses (n, r) against each factor of the points (n, d)."""

    def draw(axes: Axes, i: int, k: int) -> None:
        axes.scatter(points[:, i], values[:, k], s=12, color=BLUE, zorder=3, clip_on=False)

    return _responses_by_factor(study, draw)


def _responses_by_factor(study: Study, draw: Callable[[Axes, int, int], None]) -> Figure:
    """A row of panels for each response, a column for each factor; each drawn by the indices of the two."""
    space = study.space
    picture = figure("column" if space.d == 1 else None, 13 + 36 * len(study.responses))
    axes = picture.subplots(len(study.responses), space.d, sharex="col", sharey="row", squeeze=False)
    for k, response in enumerate(study.responses):
        for i in range(space.d):
            draw(axes[k, i], i, k)
        axes[k, 0].set_ylabel(response.label)
    for i, factor in enumerate(space.factors):
        _name_axis(axes[-1, i], "x", factor)
    picture.align_ylabels(axes[:, 0])
    return picture


def correlations(found: Sequence[Correlation]) -> Figure:
    """Coefficients of each response with each factor, their confidence intervals below."""
    rows, columns = found[0].r.shape
    wide = columns > rows * 2 or len(found) * columns * _CELL > set_width()
    height = 13 + 11 * rows
    picture = figure(None, height * len(found) if wide else height)
    down, across = (len(found), 1) if wide else (1, len(found))
    panels = picture.subplots(down, across, squeeze=False).ravel()
    for axes, c in zip(panels, found, strict=True):
        axes.imshow(c.r, vmin=-1, vmax=1, cmap=diverging(), aspect="auto")
        axes.set_xticks(range(columns), c.y_names)
        axes.set_yticks(range(rows), c.x_names)
        axes.set_title(f"{c.method.capitalize()}, n = {c.n}, {100 * c.level:g} % interval")
        axes.grid(visible=False)
        axes.tick_params(length=0)
        for i, k in itertools.product(range(rows), range(columns)):
            _cell(axes, k, i, c)
    picture.colorbar(panels[0].images[0], ax=list(panels), label="r", fraction=0.04, pad=0.02, ticks=[-1, 0, 1])
    return picture


def _cell(axes: Axes, k: int, i: int, c: Correlation) -> None:
    r, low, high = c.r[i, k], c.lower[i, k], c.upper[i, k]
    centred: dict[str, Any] = {"ha": "center", "va": "center", "color": "white" if abs(r) > 0.65 else "black"}
    below = np.isfinite(low)
    axes.text(k, i - 0.14 * below, f"{r:.2f}" if np.isfinite(r) else "–", **centred)
    if below:
        axes.text(k, i + 0.24, f"{low:.2f} … {high:.2f}", fontsize=5, **centred)


def parity(study: Study, values: FloatArray, predicted: FloatArray) -> Figure:
    """Each point as the surrogate fitted without it predicts it, against its simulation; both (n, r)."""
    picture, panels = grid(len(study.responses), 56.0)
    for k, (axes, response) in enumerate(zip(panels, study.responses, strict=True)):
        both = np.concatenate([values[:, k], predicted[:, k]])
        ends = np.array([both.min(), both.max()])
        ends += np.array([-0.05, 0.05]) * (np.ptp(ends) or 1.0)
        axes.plot(ends, ends, color=GREY, linewidth=0.8, zorder=2)
        axes.scatter(values[:, k], predicted[:, k], s=14, color=BLUE, zorder=3)
        axes.set(xlim=ends, ylim=ends, title=response.label, xlabel="simulated", ylabel="predicted")
        axes.locator_params(nbins=5)
        axes.set_aspect("equal")
    picture.suptitle("Surrogates: points predicted from the others", x=0.01, ha="left")
    return picture


def surfaces(study: Study, models: Sequence[Surrogate], points: FloatArray) -> Figure:
    """The surrogates: contours over two factors, or the effect of each factor with the others at their centre.

    Dots are where the design was simulated, (n, d).
    """
    space = study.space
    if space.d == 2 and not any(f.kind == "choice" for f in space.factors):
        return _contours(study, models, points)
    picture = _responses_by_factor(study, lambda axes, i, k: _effect(axes, space, i, models[k]))
    picture.suptitle("Surrogates, other factors at their centre", x=0.01, ha="left")
    return picture


def _effect(axes: Axes, space: Space, i: int, model: Surrogate) -> None:
    unit = np.full((_GRID, space.d), 0.5)
    unit[:, i] = np.linspace(0, 1, _GRID)
    x = np.unique(space.from_unit(unit), axis=0)
    style = ".-" if space.factors[i].kind != "continuous" else "-"
    axes.plot(x[:, i], model.predict(x), style, color=BLUE)


def _contours(study: Study, models: Sequence[Surrogate], points: FloatArray) -> Figure:
    picture, panels = grid(len(study.responses), 56.0)
    first, second = study.space.factors
    a, b = np.meshgrid(np.linspace(first.lower, first.upper, _GRID), np.linspace(second.lower, second.upper, _GRID))
    x = np.stack([a.ravel(), b.ravel()], axis=1)
    for axes, response, model in zip(panels, study.responses, models, strict=True):
        z = model.predict(x).reshape(a.shape)
        if varies(z.ravel()):
            lines = axes.contour(a, b, z, levels=7, cmap="viridis", linewidths=0.9)
            for text in axes.clabel(lines, fontsize=6, fmt="%g"):
                text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.3})
                text.set_zorder(4)  # above the dots
        for excess in (limit.excess(z) for limit in study.limits if limit.response == response):
            if excess.min() < 0 < excess.max():
                axes.contourf(a, b, excess, levels=[0, np.inf], colors=[ORANGE], alpha=0.18)
                axes.contour(a, b, excess, levels=[0], colors=[ORANGE], linewidths=1.4)
        axes.scatter(points[:, 0], points[:, 1], s=6, color="black", zorder=3, clip_on=False)
        axes.set_title(response.label)
        axes.grid(visible=False)
        _name_axis(axes, "x", first)
        _name_axis(axes, "y", second)
    title = "Surrogates; dots: simulated" + ("; shaded: beyond the limit" if study.limits else "")
    picture.suptitle(title, x=0.01, ha="left")
    return picture


def _name_axis(axes: Axes, which: str, factor: Factor) -> None:
    """Label an axis by a factor with its unit; a choice by its levels."""
    spread = 0.03 * (factor.upper - factor.lower)
    settings: dict[str, Any] = {
        f"{which}label": label(factor.name, factor.unit),
        f"{which}lim": (factor.lower - spread, factor.upper + spread),
    }
    axes.set(**settings)
    if factor.kind == "choice":
        ticks = axes.set_xticks if which == "x" else axes.set_yticks
        ticks(range(len(factor.levels)), [str(level) for level in factor.levels])
        if which == "x" and max(len(str(level)) for level in factor.levels) > _LONG:
            axes.tick_params(axis="x", labelrotation=15)
