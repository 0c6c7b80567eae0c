"""Responses over what was varied: lines and points, main effects, and how the cases ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trainmj.collision.envelope import Array
from trainmj.collision.quantities import Column as Response
from trainmj.collision.status import NOT_VALID, PAST_LIMITS, UNUSABLE, WHY_NOT_VALID, Kind
from trainmj.output.blocks import Section
from trainmj.output.plot import GREY, VIRIDIS, Trace, across, axes, dots, line, plain, room_for_name, scale, shade
from trainmj.output.style import PALETTE
from trainmj.output.table import Column, Table, worded
from trainmj.sweep.outcome import USED
from trainmj.sweep.plan import LOAD_CASE
from trainmj.units import label, unit_of, words

if TYPE_CHECKING:
    import pandas as pd

_MOST_RESPONSES = 8
_MOST_LINES = 8
_MOST_POINTS = 2000
_NEAR = 1.6  # times the largest value: a limit further up is not drawn
_BINS = 8  # of a factor with more levels, in main effects
_WANTED = {"TS_mm": 1, "TAMA_g": 1, "largest_step_mm": 1, "met_step_mm": 1, "least_wheel_load": 1}
_WANTED |= {"stroke_mm": 4, "peak_device_acceleration_g": 2}
"""Quantities that are drawn if there are many responses, and of how many places, those nearest to the impact first."""

_NEVER_DRAWN = ("duration_s", "valid_until_s", "energy_error", "momentum_error", USED)


@dataclass(frozen=True)
class Factor:
    """What was varied."""

    name: str  # parameter or path
    levels: list[Any]  # its distinct values, sorted if they are numbers
    numeric: bool  # whether they are

    @property
    def axis(self) -> tuple[str, str]:
        """Name in words and unit."""
        return words(self.name), unit_of(self.name)

    @property
    def nested(self) -> bool:
        """Whether a level is a list or a group, which a command line cannot hold."""
        return any(isinstance(v, str) and v[:1] in "[{" for v in self.levels)

    def say(self, value: Any) -> str:
        """A level as it is read."""
        return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)

    def places(self, values: Any) -> Array:
        """(n,) where values stand on an axis: themselves, or their place among the levels."""
        if self.numeric:
            return np.asarray(values, dtype=np.float64)
        place = {str(v): k for k, v in enumerate(self.levels)}
        return np.array([place[str(v)] for v in values], dtype=np.float64)

    @property
    def ticks(self) -> dict[str, Any]:
        """Settings of an axis whose levels are not numbers."""
        if self.numeric:
            return {}
        return {"tickvals": list(range(len(self.levels))), "ticktext": [plain(str(v)) for v in self.levels]}


def factors_of(table: pd.DataFrame, names: Sequence[str]) -> list[Factor]:
    """What was varied, with the levels that occur."""
    factors = []
    for name in names:
        values = list(dict.fromkeys(table[name].tolist()))
        numeric = all(isinstance(v, (int, float)) for v in values)
        factors.append(Factor(name, sorted(values) if numeric else values, numeric))
    return factors


def chosen_responses(table: pd.DataFrame) -> list[Response]:
    """The responses that are drawn: all if they are few, otherwise those that tell most about a collision."""
    found: list[Response] = [r for r in table.attrs["columns"].values() if r.quantity not in _NEVER_DRAWN]
    found = [r for r in found if r.name in table and table[r.name].notna().any()]
    found = [r for r in found if table[r.name].max() > table[r.name].min()] or found
    if len(found) <= _MOST_RESPONSES:
        return found
    wanted = [r for quantity, most in _WANTED.items() for r in [r for r in found if r.quantity == quantity][:most]]
    return [*wanted, *(r for r in found if r not in wanted)][:_MOST_RESPONSES]


def add_responses(
    section: Section,
    table: pd.DataFrame,
    factors: Sequence[Factor],
    responses: Sequence[Response],
    limits: Mapping[str, float] | None = None,
) -> None:
    """A plot of each response over the factor that moves it most; the others tell lines or colours apart.

    A limit of a response, by its column, is a line across its plot where the values come near it.
    """
    drawn = _thinned(table)
    said = ["Each over the number that moves its mean most, as main effects say."] if len(factors) > 1 else []
    if table["status"].isin(PAST_LIMITS).any():
        said.append("Hollow points: cases that passed a limit, be it of another response.")
    if said:
        section.text(" ".join(said))
    if table["status"].isin(NOT_VALID).any():
        section.text(f"Crosses are not valid: {WHY_NOT_VALID}. Main effects leave them out.")
    if len(drawn) < len(table):
        section.text(f"{len(drawn)} of {len(table)} cases are drawn.")
    usable = table[~table["status"].isin(UNUSABLE)]
    for r in responses:
        first, *others = _strongest_first(factors, usable if len(usable) else table, r)
        groups = _groups(drawn, others)
        if len(groups) <= _MOST_LINES and len(drawn) > len(groups):
            traces = _lines(groups, first, r)
        elif LOAD_CASE in (f.name for f in others):
            traces = _by_load_case(drawn, first, others, r)
        else:
            traces = [_coloured(drawn, first, others, r)]
        layout = axes(*first.axis, r.title, r.unit)
        layout["xaxis"] |= first.ticks
        limit = (limits or {}).get(r.name)
        if limit is not None and limit <= _NEAR * drawn[r.name].abs().max():
            layout["shapes"] = [across(limit, f"limit {limit:.6g} {r.unit}")]
            room = room_for_name(layout["shapes"][0], min(limit, float(drawn[r.name].min())))
            layout["yaxis"] |= {"autorangeoptions": {"include": [room]}}
        section.plot(traces, layout, title=f"{r.title} over {first.axis[0]}", height=360, half=True)


def _thinned(table: pd.DataFrame) -> pd.DataFrame:
    return table.iloc[:: -(-len(table) // _MOST_POINTS)]


def _most_levels_first(factors: Sequence[Factor]) -> list[Factor]:
    return sorted(factors, key=lambda f: (not f.numeric, -len(f.levels)))


def _strongest_first(factors: Sequence[Factor], table: pd.DataFrame, response: Response) -> list[Factor]:
    """Factors that are numbers before others, those first that move the mean of a response most; load cases last."""
    spans = {f.name: _span(_effect(table, f, response.name)[1]) or 0.0 for f in factors}
    return sorted(factors, key=lambda f: (f.name == LOAD_CASE, not f.numeric, -spans[f.name], -len(f.levels)))


def _setting(factors: Sequence[Factor], values: Sequence[Any]) -> str:
    """The values that a case has for some factors: "mass 30 t, empty stroke 20 mm"."""
    pairs = ((*f.axis, f.say(v)) for f, v in zip(factors, values, strict=True))
    return ", ".join(f"{name} {said} {unit}".strip() for name, unit, said in pairs)


def _groups(table: pd.DataFrame, others: Sequence[Factor]) -> dict[str, pd.DataFrame]:
    """Cases that differ in the first factor only, by what they have in common."""
    if not others:
        return {"": table}
    keys = [_setting(others, row) for row in zip(*(table[f.name] for f in others), strict=True)]
    return {str(key): part for key, part in table.groupby(keys, sort=False)}


def _lines(groups: dict[str, pd.DataFrame], first: Factor, response: Response) -> list[Trace]:
    traces = []
    for k, (said, part) in enumerate(groups.items()):
        x = first.places(part[first.name])
        order = np.argsort(x, kind="stable")
        y = part[response.name].to_numpy(dtype=np.float64)[order]
        colour = shade(0.85 * k / max(1, len(groups) - 1), VIRIDIS) if len(groups) > 1 else PALETTE[0]
        name = said or response.title
        marker = {"size": 6, "symbol": _symbols(part.iloc[order])}
        trace = line(name, x[order], y, response.unit, colour, mode="lines+markers", marker=marker)
        traces.append(trace | {"showlegend": len(groups) > 1})
    return traces


def _symbols(table: pd.DataFrame) -> list[str]:
    """Hollow for a case that passed a limit, a cross for one that is not valid."""
    signs = dict.fromkeys(PAST_LIMITS, "circle-open") | dict.fromkeys(NOT_VALID, "x")
    return [signs.get(status, "circle") for status in table["status"]]


def _by_load_case(table: pd.DataFrame, first: Factor, others: Sequence[Factor], response: Response) -> list[Trace]:
    """Points over the first factor, of each load case in a colour of its own."""
    parts = list(table.groupby(LOAD_CASE, sort=False))
    traces = [_points(part, first, others, response, str(case)) for case, part in parts]
    for k, trace in enumerate(traces):
        trace["marker"]["color"] = shade(0.85 * k / max(1, len(traces) - 1), VIRIDIS)
    return [trace | {"showlegend": True} for trace in traces]


def _points(table: pd.DataFrame, first: Factor, others: Sequence[Factor], response: Response, name: str = "") -> Trace:
    """Points over the first factor that say what all factors are."""
    factors = [first, *others]
    rows = zip(table.index, table[response.name], *(table[f.name] for f in factors), strict=True)
    texts = [f"case {n}: {y:.5g} {response.unit}; {_setting(factors, values)}" for n, y, *values in rows]
    x = first.places(table[first.name])
    trace = dots(name or response.title, x, table[response.name], texts=texts, size=6)
    trace["marker"]["symbol"] = _symbols(table)
    return trace


def _coloured(table: pd.DataFrame, first: Factor, others: Sequence[Factor], response: Response) -> Trace:
    """Points over the first factor, coloured by the second."""
    trace = _points(table, first, others, response)
    if others:
        second = others[0]
        bar = {"title": {"text": label(*second.axis), "side": "right"}, "thickness": 12, "outlinewidth": 0}
        trace["marker"] |= {
            "color": [float(v) for v in second.places(table[second.name])],
            "colorscale": scale(VIRIDIS),
            "colorbar": bar | second.ticks,
        }
    return trace


def add_effects(
    section: Section, table: pd.DataFrame, factors: Sequence[Factor], responses: Sequence[Response]
) -> None:
    """How far the mean of a response moves as one factor goes through its levels, whatever the others are."""
    effects = {(f.name, r.name): _effect(table, f, r.name) for f in factors for r in responses}
    section.text(
        "The mean of a response over all cases with valid numbers, at each level of one factor"
        f" (of more than {_BINS} levels: in {_BINS} classes of as many cases). The table shows the largest of these "
        "means less the smallest. If cases are missing or the design is not balanced, the effects of factors mix."
    )
    spans = [(f.name, *(_span(effects[f.name, r.name][1]) for r in responses)) for f in factors]
    heads = [*worded("Factor"), *(Column(r.title, r.unit) for r in responses)]
    section.table(Table(heads, spans, "Largest change of the mean"))
    for r in responses[:4] if len(factors) > 1 else ():
        traces = []
        for k, f in enumerate(factors):
            levels, means = effects[f.name, r.name]
            if len(means) < 2:
                continue
            colour, (name, unit) = PALETTE[k % len(PALETTE)], f.axis
            texts = [f"{name} {level} {unit}: {mean:.5g} {r.unit}" for level, mean in zip(levels, means, strict=True)]
            trace = dots(name, np.linspace(0, 100, len(means)), means, colour, texts=texts)
            traces.append(trace | {"mode": "lines+markers", "line": {"color": colour}})
        layout = axes("From the lowest to the highest level", "%", f"Mean of {r.title}", r.unit)
        section.plot(traces, layout, title=f"Main effects on {r.title}", height=340, half=True)


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


LOOK = {
    Kind.OVER: (PALETTE[0], "circle"),
    Kind.CURVE_ENDED: ("#22262e", "diamond"),
    Kind.OVERRIDE: ("#22262e", "star"),
    Kind.EXHAUSTED: (PALETTE[1], "triangle-up"),
    Kind.LIMIT: (PALETTE[1], "triangle-down"),
    Kind.TIME_LIMIT: (PALETTE[4], "square"),
    Kind.NO_CONTACT: (PALETTE[2], "circle-open"),
    Kind.UNSTABLE: ("#22262e", "x"),
    Kind.REFUSED: (GREY, "cross"),
}
"""Colour and symbol of each way in which a case can end."""


def add_map(section: Section, table: pd.DataFrame, factors: Sequence[Factor]) -> None:
    """How the cases ended, over the two factors with most levels, or one of them and the load cases."""
    x, *others = _most_levels_first(factors)
    y = next((f for f in others if f.name == LOAD_CASE), others[0] if others else None)
    traces = []
    for kind, part in _thinned(table).groupby("status", sort=False):
        colour, symbol = LOOK[Kind(str(kind))]
        height = y.places(part[y.name]) if y else np.zeros(len(part))
        texts = [f"case {case}: {kind}" for case in part.index]
        traces.append(dots(str(kind), x.places(part[x.name]), height, colour, symbol, 9, texts))
    layout = axes(*x.axis, *(y.axis if y else ("", "")))
    layout["xaxis"] |= x.ticks
    layout["yaxis"] |= y.ticks if y else {"visible": False}
    note = "Cases that differ only in other factors lie on top of each other." if len(factors) > 2 else ""
    section.plot(traces, layout, title="How the cases ended", note=note, height=360 if y else 220)
