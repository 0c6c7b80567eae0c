"""Plots with zoom and read-out, as the plain dicts that plotly.js takes; one look for all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

import numpy as np
import numpy.typing as npt

from trainmj.output.style import PALETTE
from trainmj.units import label

Trace = dict[str, Any]
"""One line, or one set of points, as plotly.js takes it."""

GREY, INK = "#7a808a", "#22262e"
VIRIDIS = ("#440154", "#3b528b", "#21918c", "#5ec962", "#fde725")
"""A scale of colours, from low to high."""

_ON_A_LINE = 44  # letters in a line of the name of a limit, so that it fits a plot on a phone
_LONGEST = 18  # letters in a line of the title of a vertical axis, so that it fits a plot on paper

_AXIS = {
    "gridcolor": "#e8eaee",
    "zerolinecolor": "#b9bec7",
    "linecolor": "#b9bec7",
    "automargin": True,
    "ticks": "",
    "title": {"standoff": 10},
}
_LAYOUT: dict[str, Any] = {
    "autosize": True,
    "font": {"family": "system-ui, sans-serif", "size": 12, "color": INK},
    "colorway": list(PALETTE),
    "paper_bgcolor": "#ffffff",
    "plot_bgcolor": "#ffffff",
    "margin": {"l": 58, "r": 14, "t": 8, "b": 44},
    "hovermode": "closest",
    "hoverlabel": {"font": {"size": 12}},
    "legend": {"orientation": "h", "x": 0, "yref": "container", "y": 0, "yanchor": "bottom", "font": {"size": 11}},
    "xaxis": _AXIS,
    "yaxis": _AXIS,
}


def layout_of(layout: Mapping[str, Any]) -> dict[str, Any]:
    """A layout laid over the one that all plots share; every axis gets the shared look."""
    merged = _merged(_LAYOUT, layout)
    for name in merged:
        if name[:5] in ("xaxis", "yaxis"):
            merged[name] = _merged(_AXIS, merged[name])
    return merged


def axes(x: str, x_unit: str, y: str, y_unit: str, **more: Any) -> dict[str, Any]:
    """A layout with names and units, which may be empty, on both axes, and with further entries."""
    title = "<br>".join(wrap(plain(label(y, y_unit)), _LONGEST, break_long_words=False))
    named = {"xaxis": {"title": {"text": plain(label(x, x_unit))}}, "yaxis": {"title": {"text": title}}}
    return _merged(named, more)


def shaded(start: float, end: float, said: str) -> dict[str, Any]:
    """Entries of a layout that shade a plot from a value of x to another one, and say why."""
    part = {"x0": float(f"{start:.7g}"), "x1": float(f"{end:.7g}"), "y0": 0, "y1": 1, "yref": "paper"}
    look = {"type": "rect", "fillcolor": INK, "opacity": 0.12, "layer": "below", "line": {"width": 0}}
    named = {"text": plain(said), "textposition": "top left", "font": {"size": 11}}
    return {"shapes": [part | look | {"label": named}]}


def across(y: float, said: str, dash: str = "dash", place: str = "end") -> dict[str, Any]:
    """A shape of a layout: a line across a whole plot at a value of y, such as a limit, named at a place on it."""
    named = {"text": _in_lines(said, _ON_A_LINE), "textposition": place, "yanchor": "bottom", "font": {"size": 11}}
    return _ruled(dash) | {"x0": 0, "x1": 1, "xref": "paper", "y0": _near(y), "y1": _near(y), "label": named}


def room_for_name(shape: Mapping[str, Any], low: float) -> float:
    """Up to where a vertical axis from a value on has to reach for a name on a line to be whole, on paper too."""
    share = 0.03 + 0.1 * (1 + shape["label"]["text"].count("<br>"))
    return float((shape["y0"] - share * low) / (1.0 - share))


def upright(x: float, dash: str = "dash") -> dict[str, Any]:
    """The same up a plot at a value of x, without a name."""
    return _ruled(dash) | {"y0": 0, "y1": 1, "yref": "paper", "x0": _near(x), "x1": _near(x)}


def named_upright(x: float, said: str) -> dict[str, Any]:
    """An annotation of a layout: the name of such a line, along it from the top."""
    named = {"text": plain(said), "textangle": -90, "showarrow": False, "font": {"size": 11}}
    return named | {"x": _near(x), "xanchor": "right", "y": 1, "yref": "paper", "yanchor": "top"}


def _ruled(dash: str) -> dict[str, Any]:
    return {"type": "line", "line": {"color": INK, "width": 1, "dash": dash}}


def _near(value: float) -> float:
    return float(f"{value:.7g}")


def _in_lines(text: str, longest: int) -> str:
    return "<br>".join(map(plain, wrap(text, longest, break_long_words=False)))


def line(
    name: str,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    unit: str = "",
    colour: str | None = None,
    width: float = 1.6,
    **more: Any,
) -> Trace:
    """A line.

    Args:
        name: in legend and read-out; shown as text, never as markup.
        x: (n,) values; evenly spaced ones are kept as start and step.
        y: (n,) values.
        unit: of y, in the read-out.
        colour: by default the next of the palette.
        width: [pixels].
        more: further entries of the trace.
    """
    said = f" {plain(unit)}" if unit else ""
    trace: Trace = {
        "type": "scatter",
        "mode": "lines",
        "name": plain(name),
        **_spaced(x),
        "y": numbers(y),
        "line": {"width": width} | ({"color": colour} if colour else {}),
        "hovertemplate": f"%{{y:.5~g}}{said}<extra>{plain(name)}</extra>",
    }
    return _merged(trace, more)


def dots(
    name: str,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    colour: str | None = None,
    symbol: str = "circle",
    size: float = 7,
    texts: Sequence[str] | None = None,
    **more: Any,
) -> Trace:
    """Points.

    Args:
        name: in the legend.
        x: (n,) numbers, or words for an axis of categories.
        y: (n,) the same.
        colour: by default the next of the palette.
        symbol: plotly.js's name of a sign.
        size: [pixels].
        texts: (n,) what the read-out says of each.
        more: further entries of the trace.
    """
    trace: Trace = {
        "type": "scatter",
        "mode": "markers",
        "name": plain(name),
        "x": _values(x),
        "y": _values(y),
        "marker": {"size": size, "symbol": symbol} | ({"color": colour} if colour else {}),
    }
    if texts is not None:
        trace |= {"text": [plain(t) for t in texts], "hovertemplate": f"%{{text}}<extra>{plain(name)}</extra>"}
    return _merged(trace, more)


def plain(text: str) -> str:
    """Text as plotly.js shows it literally; its labels understand some markup otherwise."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def numbers(values: npt.ArrayLike, digits: int = 5) -> list[float | None]:
    """Values of so many significant digits, which keeps a page small; None for those that are not finite."""
    array = np.atleast_1d(np.asarray(values, dtype=np.float64))
    finite = np.isfinite(array)
    size = np.abs(np.where(finite, array, 0.0))
    power = digits - 1 - np.floor(np.log10(size, where=size > 0.0, out=np.zeros_like(size)))
    up, down = 10.0 ** np.clip(power, 0.0, 300.0), 10.0 ** np.maximum(-power, 0.0)
    rounded = np.rint(array / down * up, where=finite, out=np.zeros_like(array)) * down / up + 0.0  # no -0
    listed: list[float | None] = rounded.tolist()
    for place in np.flatnonzero(~finite):
        listed[place] = None
    return listed


def _values(values: npt.ArrayLike) -> list[Any]:
    """Numbers, or words as they stand."""
    array = np.asarray(values)
    return numbers(array) if array.dtype.kind in "fiub" else [plain(str(v)) for v in array.tolist()]


def scale(colours: Sequence[str]) -> list[list[Any]]:
    """Colours from low to high as the ``colorscale`` of a trace."""
    return [[k / (len(colours) - 1), colour] for k, colour in enumerate(colours)]


def shade(part: float, colours: Sequence[str] = VIRIDIS) -> str:
    """A colour of a scale at a part of its length, from 0 to 1."""
    at = min(max(part, 0.0), 1.0) * (len(colours) - 1)
    k = min(int(at), len(colours) - 2)
    low, high = (np.array([int(colours[i][j : j + 2], 16) for j in (1, 3, 5)]) for i in (k, k + 1))
    return "#" + "".join(f"{round(float(c)):02x}" for c in low + (at - k) * (high - low))


def _spaced(x: npt.ArrayLike) -> dict[str, Any]:
    """Values along x: start and step where they are evenly spaced."""
    values = np.asarray(x, dtype=np.float64)
    if values.size > 2:
        step = (values[-1] - values[0]) / (values.size - 1)
        if step > 0 and np.abs(np.diff(values) - step).max() <= 1e-6 * step:
            return {"x0": float(f"{values[0]:.12g}"), "dx": float(f"{step:.12g}")}
    return {"x": numbers(values, 7)}


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Nested settings laid over others."""
    result = dict(base)
    for key, value in over.items():
        both = isinstance(value, Mapping) and isinstance(result.get(key), Mapping)
        result[key] = _merged(result[key], value) if both else value
    return result
