"""Responses over what was varied: lines and points, main effects, and where cases ended how."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trainmj.collision.device import Array
from trainmj.output.blocks import Column, Section
from trainmj.output.plot import COLOURS, GREY, VIRIDIS, Trace, axes, dots, line, plain, shade
from trainmj.units import head, label, unit_of

if TYPE_CHECKING:
    import pandas as pd

_MOST_RESPONSES = 8
_MOST_LINES = 8
_MOST_POINTS = 2000
_BINS = 8  # of a factor with more levels, in main effects
_PAIR = re.compile(r"([MS]\d+)_([MS]\d+|wall)")
_WANTED = ("TS_mm", "TAMA_g", "stroke_S1_M1", "stroke_M1_wall", "stroke_M1_M2_mm", "stroke_M2_M3_mm", "peak_device_M1")


@dataclass(frozen=True)
class Factor:
    """What was varied.

    Attributes:
        name: parameter or path.
        unit: read from its name.
        levels: its distinct values, sorted if they are numbers.
        numeric: whether they are.
    """

    name: str
    unit: str
    levels: list[Any]
    numeric: bool

    @property
    def axis(self) -> tuple[str, str]:
        """Name and unit of an axis."""
        return (self.name.removesuffix(_end(self.name)) or self.name).replace("_", " "), self.unit

    @property
    def nested(self) -> bool:
        """Whether a level is a list or a group, which a command line cannot hold."""
        return any(isinstance(v, str) and v[:1] in "[{" for v in self.levels)

    def say(self, value: Any) -> str:
        """A level in words."""
        return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)

    def places(self, values: Any) -> Array:
        """(n,) where values stand on an axis: themselves, or their place among the levels."""
        if self.numeric:
            return np.asarray(values, dtype=np.float64)
        place = {str(v): k for k, v in enumerate(self.levels)}
        return np.array([place[str(v)] for v in values], dtype=np.float64)

    def ticks(self, which: str) -> dict[str, Any]:
        """Settings of an axis that names levels which are not numbers."""
        if self.numeric:
            return {}
        return {which: {"tickvals": list(range(len(self.levels))), "ticktext": [plain(str(v)) for v in self.levels]}}


def factors_of(table: pd.DataFrame, names: Sequence[str]) -> list[Factor]:
    """What was varied, with the levels that occur."""
    factors = []
    for name in names:
        values = list(dict.fromkeys(table[name].tolist()))
        numeric = all(isinstance(v, (int, float)) for v in values)
        factors.append(Factor(name, unit_of(name), sorted(values) if numeric else values, numeric))
    return factors


def chosen_responses(table: pd.DataFrame, varied: Sequence[str]) -> list[str]:
    """The responses that are drawn: all if they are few, otherwise those that tell most of a collision."""
    from pandas.api.types import is_numeric_dtype

    left_out = {*varied, "status", "reason", "energy_error", "momentum_error", "duration_s"}
    names = [
        str(c) for c in table.columns if c not in left_out and is_numeric_dtype(table[c]) and table[c].notna().any()
    ]
    names = [name for name in names if table[name].max() > table[name].min()] or names
    if len(names) > _MOST_RESPONSES:
        wanted = [name for name in names if name.startswith(_WANTED)]
        names = [*wanted, *(name for name in names if name not in wanted)][:_MOST_RESPONSES]
    return names


def add_responses(section: Section, table: pd.DataFrame, factors: Sequence[Factor], responses: Sequence[str]) -> None:
    """A plot of each response over the factor with most levels; the others tell lines or colours apart."""
    drawn = table.iloc[:: -(-len(table) // _MOST_POINTS)]
    if len(drawn) < len(table):
        section.text(f"{len(drawn)} of {len(table)} cases are drawn.")
    order = sorted(factors, key=lambda f: (not f.numeric, -len(f.levels)))
    first, others = order[0], order[1:]
    groups = _groups(drawn, others)
    for name in responses:
        unit = unit_of(name)
        layout = axes(*first.axis, short(name), unit, **first.ticks("xaxis"))
        if len(groups) <= _MOST_LINES and len(drawn) > len(groups):
            traces = _lines(groups, first, name)
        else:
            traces = [_coloured(drawn, first, others, name)]
        title = f"{short(name)} over {first.axis[0]}"
        section.plot(traces, layout, title=title, height=360, half=True)


def _groups(table: pd.DataFrame, others: Sequence[Factor]) -> dict[str, pd.DataFrame]:
    """Cases that differ in the first factor only, by what they have in common."""
    if not others:
        return {"": table}
    keys = [", ".join(f"{f.axis[0]} {f.say(v)} {f.unit}".strip() for f, v in zip(others, row, strict=True))
            for row in zip(*(table[f.name] for f in others), strict=True)]  # fmt: skip
    return {str(key): part for key, part in table.groupby(keys, sort=False)}


def _lines(groups: dict[str, pd.DataFrame], first: Factor, name: str) -> list[Trace]:
    traces = []
    for k, (said, part) in enumerate(groups.items()):
        x = first.places(part[first.name])
        order = np.argsort(x, kind="stable")
        y = part[name].to_numpy(dtype=np.float64)[order]
        colour = shade(0.85 * k / max(1, len(groups) - 1), VIRIDIS) if len(groups) > 1 else COLOURS[0]
        trace = line(said or short(name), x[order], y, unit_of(name), colour, mode="lines+markers", marker={"size": 5})
        traces.append(trace | {"showlegend": len(groups) > 1})
    return traces


def _coloured(table: pd.DataFrame, first: Factor, others: Sequence[Factor], name: str) -> Trace:
    """Points over the first factor, coloured by the second."""
    texts = _texts(table, [first, *others], name)
    trace = dots(short(name), first.places(table[first.name]), table[name], texts=texts, size=6)
    if others:
        colours = [[k / (len(VIRIDIS) - 1), c] for k, c in enumerate(VIRIDIS)]
        second = others[0]
        bar = {"title": {"text": label(*second.axis), "side": "right"}, "thickness": 12, "outlinewidth": 0}
        bar |= second.ticks("bar").get("bar", {})
        values = [float(v) for v in second.places(table[second.name])]
        trace["marker"] |= {"color": values, "colorscale": colours, "colorbar": bar}
    return trace


def _texts(table: pd.DataFrame, factors: Sequence[Factor], name: str) -> list[str]:
    rows = zip(table.index, table[name], *(table[f.name] for f in factors), strict=True)
    unit = unit_of(name)
    return [
        f"case {case}: {value:.5g} {unit}; "
        + ", ".join(f"{f.axis[0]} {f.say(v)} {f.unit}".strip() for f, v in zip(factors, values, strict=True))
        for case, value, *values in rows
    ]


def add_effects(section: Section, table: pd.DataFrame, factors: Sequence[Factor], responses: Sequence[str]) -> None:
    """How far the mean of a response moves as one factor goes through its levels, whatever the others are."""
    effects = {f.name: {name: _effect(table, f, name) for name in responses} for f in factors}
    section.text(
        "The mean of a response over all computed cases at each level of one factor"
        f" (of more than {_BINS} levels: in {_BINS} classes of as many cases). The table has the largest less the "
        "smallest of these means. Where cases are missing or the design is not balanced, factors mix."
    )
    section.table(
        [Column("Factor", text=True), *(Column(short(name), unit_of(name)) for name in responses)],
        [(f.name, *(_span(effects[f.name][name][1]) for name in responses)) for f in factors],
        title="Largest change of the mean",
    )
    if len(factors) < 2:
        return
    for name in responses[:4]:
        traces = []
        for k, f in enumerate(factors):
            levels, means = effects[f.name][name]
            if len(means) < 2:
                continue
            pairs = zip(levels, means, strict=True)
            texts = [f"{f.axis[0]} {level} {f.unit}: {mean:.5g} {unit_of(name)}" for level, mean in pairs]
            traces.append(
                dots(
                    f.axis[0],
                    np.linspace(0, 100, len(means)),
                    means,
                    COLOURS[k % len(COLOURS)],
                    texts=texts,
                    mode="lines+markers",
                    line={"color": COLOURS[k % len(COLOURS)]},
                )
            )
        section.plot(
            traces,
            axes("From the lowest to the highest level", "%", f"Mean of {short(name)}", unit_of(name)),
            title=f"Main effects on {short(name)}",
            height=340,
            half=True,
        )


def _effect(table: pd.DataFrame, factor: Factor, name: str) -> tuple[list[str], Array]:
    """Levels or classes of a factor in words, and the mean of a response in each."""
    x = factor.places(table[factor.name])
    y = table[name].to_numpy(dtype=np.float64)
    good = np.isfinite(y)
    x, y = x[good], y[good]
    levels = np.unique(x)
    if len(levels) > _BINS:
        parts: list[NDArray[np.intp]] = np.array_split(np.argsort(x, kind="stable"), _BINS)
        said = [f"{x[p].min():.4g} to {x[p].max():.4g}" for p in parts if p.size]
        return said, np.array([y[p].mean() for p in parts if p.size])
    names = [f"{v:.6g}" if factor.numeric else str(factor.levels[int(v)]) for v in levels]
    return names, np.array([y[x == v].mean() for v in levels])


def _span(means: Array) -> float | None:
    return float(np.ptp(means)) if means.size > 1 else None


_LOOK = {
    "over": (COLOURS[0], "circle"),
    "stroke exhausted": (COLOURS[1], "triangle-up"),
    "time limit": (COLOURS[4], "square"),
    "no contact": (COLOURS[2], "circle-open"),
    "unstable": ("#22262e", "x"),
    "refused": (GREY, "cross"),
}


def add_map(section: Section, table: pd.DataFrame, factors: Sequence[Factor]) -> None:
    """How the cases ended, over the two factors with most levels."""
    drawn = table.iloc[:: -(-len(table) // _MOST_POINTS)]
    order = sorted(factors, key=lambda f: (not f.numeric, -len(f.levels)))
    x, y = order[0], order[1] if len(order) > 1 else None
    traces = []
    for status, part in drawn.groupby("status", sort=False):
        colour, symbol = _LOOK.get(str(status), (GREY, "diamond"))
        height = y.places(part[y.name]) if y else np.zeros(len(part))
        texts = [f"case {case}: {status}" for case in part.index]
        traces.append(dots(str(status), x.places(part[x.name]), height, colour, symbol, 9, texts))
    layout = axes(*x.axis, *(y.axis if y else ("", "")), **x.ticks("xaxis"))
    if y is None:
        layout["yaxis"] |= {"visible": False}
    else:
        layout["yaxis"] |= y.ticks("yaxis").get("yaxis", {})
    more = " Cases that differ only in other factors lie on one another." if len(factors) > 2 else ""
    section.plot(traces, layout, title="How the cases ended", note=more.strip(), height=360 if y else 220)


def short(name: str) -> str:
    """A column's name in words, without its unit."""
    return _PAIR.sub(r"\1-\2", name.removesuffix(_end(name))).replace("_", " ")


def _end(name: str) -> str:
    unit = unit_of(name)
    return head("", unit) if unit else ""
