"""Figures 4 to 9 of the paper, drawn from our results, and its Tables 3 to 8 beside ours.

The paper's own figures are not available, only their captions and what the text says of them: nothing published can be
laid over Figures 4 to 8 but printed numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import Polynomial

from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.output.style import BLUE, GREEN, GREY, MARKERS, ORANGE, PALETTE, PURPLE, figure, styled
from trainmj.paper.analysis import CRITERIA
from trainmj.paper.collisions import Collisions
from trainmj.paper.printed import (
    ENERGIES,
    LIMIT_ANTI_CLIMBER_MM,
    PEAKS,
    SERIES,
    STROKES,
    number,
    numbers,
    published,
    rms,
)
from trainmj.paper.reproduce import Reproduction
from trainmj.paper.scatter import about_line
from trainmj.paper.tables import OURS, S08
from trainmj.units import KJ, KM_H, MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CAPTIONS = {
    "figure4_scenarios": "Figure 4. Energy, strokes (S1-M1: both sides) and speeds in the scenarios of "
    "Table 2: rigid vehicles, and car bodies of 1000 kN/mm, which stand for the finite element model",
    "figure5_devices_vs_D": "Figure 5. Compression and energy over time for nine empty strokes D, at 33 t",
    "figure6_speeds_vs_D": "Figure 6. Speeds over time for nine empty strokes D, at 33 t",
    "figure7_devices_vs_M": "Figure 7. Compression and energy over time for nine masses M, at D = 35 mm",
    "figure8_speeds_vs_M": "Figure 8. Speeds over time for nine masses M, at D = 35 mm",
    "figure9_front": "Figure 9. Pareto front of TS and TAMA",
    "scatter_over_D": "Strokes over the empty stroke D at 33 t: the paper, b_type and S08; below, without their own "
    "straight lines",
    "misfit_over_K": "What S08 leaves of the scatter over D, with one unloading stiffness K or another in all devices",
    "tables_vs_D": "Tables 3, 4, 5. Published and ours over the empty stroke D, at 33 t",
    "tables_vs_M": "Tables 6, 7, 8. Published and ours over the mass M, at D = 35 mm",
}
"""What each figure shows, by the name of its file."""

_BOTH = "rigid: wide, pale"


def figures(reproduction: Reproduction) -> dict[str, Figure]:
    """Every figure, at the width of a page, by the name of its file."""
    c = reproduction.collisions
    with styled("page"):
        drawn = (
            _scenarios(c),
            *(draw(c, factor) for factor in SERIES for draw in (_devices, _vehicles)),
            _fronts(reproduction),
            _scatter(reproduction),
            _misfit(reproduction),
            *(_tables(reproduction, factor) for factor in SERIES),
        )
    return dict(zip(CAPTIONS, drawn, strict=True))


def _scenarios(collisions: Collisions) -> Figure:
    """Energy conversion, strokes per interface and speeds of both scenarios, rigid vehicles beside bodies that give."""
    picture = figure(height=112)
    panels = picture.subplots(2, 3)
    for row, axes in enumerate(panels):
        first, second, third = (f"({letter})" for letter in ("abc", "def")[row])
        both = collisions.scenarios[row], collisions.elastic[row]
        _energy_conversion(axes[0], *both, f"{first} Energy, scenario {row + 1}")
        _strokes(axes[1], *both, f"{second} Largest strokes")
        _speeds(axes[2], *both, f"{third} Speeds")
    return picture


def _energy_conversion(axes: Axes, rigid: Result, elastic: Result, title: str) -> None:
    start = float(rigid.kinetic[0] / KJ)
    for result, width, alpha in ((rigid, 2.4, 0.35), (elastic, 0.8, 1.0)):
        kinetic, absorbed = result.kinetic / KJ, result.energy.sum(axis=1) / KJ
        lines = (
            ("kinetic", kinetic, BLUE),
            ("internal", absorbed, ORANGE),
            ("rail friction", start - kinetic - absorbed, GREEN),
            ("total", np.full_like(kinetic, start), GREY),
        )
        for name, values, colour in lines:
            said = name if result is elastic else None
            axes.plot(result.time, values, color=colour, label=said, linewidth=width, alpha=alpha)
    axes.set(title=title, xlabel="Time (s)", ylabel="Energy (kJ)", xlim=(0, elastic.time[-1]))
    axes.set_ylim(top=1.5 * start)
    axes.legend(
        loc="upper right", ncols=2, handlelength=1.4, columnspacing=1.0, borderpad=0, title=_BOTH, title_fontsize=6.5
    )


def _strokes(axes: Axes, rigid: Result, elastic: Result, title: str) -> None:
    names = [i.name for i in rigid.chain.interfaces]
    names[rigid.chain.front] += ", both sides"
    at = np.arange(len(names))
    for result, name, colour, shift in ((rigid, "rigid", GREY, -0.2), (elastic, "bodies give", BLUE, 0.2)):
        axes.bar(at + shift, result.tally.stroke_max / MM, color=colour, width=0.4, label=name)
    both = np.array([rigid.tally.stroke_max, elastic.tally.stroke_max]) / MM
    for x, (before, after) in enumerate(both.T):
        top = max(before, after)
        axes.annotate(f"{after - before:+.1f}", (x, top), ha="center", va="bottom", rotation=90, fontsize=5)
    axes.set_xticks(at, names, rotation=90, fontsize=6.5)
    axes.grid(False, axis="x")
    axes.set(title=title, ylabel="Stroke (mm)")
    axes.set_ylim(top=1.5 * float(both.max()))
    axes.legend(loc="upper center", ncols=2, title="above each: change in mm", title_fontsize=6.5)


def _speeds(axes: Axes, rigid: Result, elastic: Result, title: str) -> None:
    chain = rigid.chain
    for n in range(chain.n_moving):
        for i, line in ((chain.front - n, "-"), (chain.n_moving + n, "--")):
            colour = PALETTE[n % len(PALETTE)]
            axes.plot(rigid.time, rigid.velocity[:, i] / KM_H, color=colour, linewidth=2.2, alpha=0.3)
            said = f"M{n + 1}" if line == "-" else None
            axes.plot(elastic.time, elastic.velocity[:, i] / KM_H, line, color=colour, linewidth=0.7, label=said)
    axes.set(title=title, xlabel="Time (s)", ylabel="Speed (km/h)", xlim=(0, elastic.time[-1]))
    axes.legend(title=f"S1 to S6 dashed; {_BOTH}", title_fontsize=6.5, ncols=2, loc="upper right")
    axes.set_ylim(top=1.8 * float(chain.speed[0]) / KM_H)


def _devices(collisions: Collisions, factor: str) -> Figure:
    """Two blocks of six panels: compression (a) and energy (b) of each interface of the moving train."""
    picture = figure(height=178)
    panels = picture.subplots(4, 3, sharex=True)
    for _, result, colour in _series(collisions, factor, picture, panels):
        chain = result.chain
        for n, (stroke, energy) in enumerate(zip(panels[:2].flat, panels[2:].flat, strict=True)):
            k = chain.front - n
            stroke.plot(result.time, compression(result, k) / MM, color=colour, linewidth=0.9)
            name = chain.interfaces[k].name
            energy.plot(result.time, result.shown("energy")[name], color=colour, linewidth=0.9)
            name += ", one train's side" if n == 0 else ""
            stroke.set_title(f"(a) {name}")
            energy.set_title(f"(b) {name}")
    for axes, quantity in zip(panels[:, 0], ("Compression (mm)",) * 2 + ("Energy (kJ)",) * 2, strict=True):
        axes.set_ylabel(quantity)
    return picture


def compression(result: Result, k: int) -> Array:
    """Compression of an interface's devices over time, empty strokes not counted [m]; at the front one train's."""
    stages = result.chain.interfaces[k].devices[0].stages
    return np.array([sum(stage.stroke(u) for stage in stages) for u in result.of_device("stroke", k, 0)])


def _vehicles(collisions: Collisions, factor: str) -> Figure:
    """Six panels: the speed of each vehicle of the moving train; published balance times as dashed lines."""
    picture = figure(height=108)
    panels = picture.subplots(2, 3, sharex=True, sharey=True)
    times = published("balance").query(f"parameter == {SERIES[factor].head!r}")
    series = _series(collisions, factor, picture, panels)
    colours = {value: colour for value, _, colour in series}
    for _, result, colour in series:
        for n, axes in enumerate(panels.flat):
            axes.plot(result.time, result.velocity[:, result.chain.front - n] / KM_H, color=colour, linewidth=0.9)
            axes.set_title(f"M{n + 1}")
    for vehicle, axes in zip(("M1", "M2", "M3-M6"), panels[0], strict=True):
        own = times[times["vehicle"] == vehicle]
        for value, instant in zip(own["value"], own["balance_time_s"], strict=True):
            axes.axvline(instant, color=colours[value], linestyle="--", linewidth=0.9)
    for axes in panels[:, 0]:
        axes.set_ylabel("Speed (km/h)")
    picture.supxlabel("dashed: the balance times that the paper prints for the two ends of the range", fontsize=7)
    return picture


def _series(collisions: Collisions, factor: str, picture: Figure, panels: Any) -> list[tuple[float, Result, str]]:
    """Value, collision and colour from little to much over a factor, their bar beside panels that share the time."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize, to_hex

    head, results = SERIES[factor].head, [result for result, _ in collisions.over(factor)]
    values = numbers(published(SERIES[factor].tables[0]), head)
    shades = ListedColormap(colormaps["viridis"](np.linspace(0, 0.9, 256)))
    colours = ScalarMappable(Normalize(values.min(), values.max()), shades)
    picture.colorbar(
        colours, ax=panels, label=SERIES[factor].axis, ticks=list(values), format="%g", aspect=40, pad=0.01
    )
    for axes in panels[-1]:
        axes.set_xlabel("Time (s)")
    panels[0, 0].set_xlim(0, max(result.time[-1] for result in results))
    return list(zip(values.tolist(), results, map(to_hex, colours.to_rgba(values)), strict=True))


def _fronts(reproduction: Reproduction) -> Figure:
    """Fronts on the surrogates of the published Table 9 and of our responses, and the designs chosen on them."""
    picture = figure(height=84)
    axes = picture.subplots()
    for analysis, colour, marker, name in (
        (reproduction.recomputed, ORANGE, "^", "the published Table 9"),
        (reproduction.ours, BLUE, "o", "our responses"),
    ):
        TS, TAMA = analysis.front.values.T
        axes.plot(TS, TAMA, marker, color=colour, markersize=2.5, label=f"Front on surrogates of {name}")
        D, M = analysis.chosen
        said = f"Chosen from {name} ({D:g} mm, {M:g} t)"
        axes.plot(*analysis.predict(D, M).values(), "s", color=colour, markersize=7, label=said)
    for row, marker, name in (("surrogate", "P", "surrogate"), ("dynamics", "X", "collision dynamics")):
        at = [number("13", row, head) for head in CRITERIA.values()]
        axes.plot(*at, marker, color="0.1", markersize=7, label=f"Table 13, {name} (50 mm, 32.4 t)")
    at = [numbers(reproduction.optima, head)[0] for head in ("TS_simulated_mm", "TAMA_simulated_g")]
    axes.plot(*at, "D", mfc="none", color=GREEN, markersize=9, label="Our simulation of the paper's optimum")
    axes.set(xlabel="TS (mm)", ylabel="TAMA (g)")
    axes.legend(loc="upper right")
    return picture


def _scatter(reproduction: Reproduction) -> Figure:
    """Strokes over D with the straight line of each series, above; what the lines leave, with its rms, below."""
    three, fine = reproduction.tables["3"], reproduction.scatter.fine
    D, close = numbers(three.keys, "D_mm"), numbers(fine, "D_mm")
    picture = figure(height=112)
    panels = picture.subplots(2, 3, sharex=True)
    for (head, name), (above, below) in zip(STROKES.items(), panels.T, strict=True):
        for found, colour, marker, said in (
            (three.published, "0.1", "o", "published"),
            (three.found[OURS], BLUE, "^", "ours"),
            (three.found[S08], ORANGE, "s", "S08"),
        ):
            values = numbers(found, head)
            line = Polynomial.fit(D, values, 1)
            off = values - line(D)
            unlike = rms(about_line(D, values - numbers(three.published, head)))
            shown = f"{said}: rms {rms(off):.2f}{f', leaves {unlike:.2f}' if unlike else ''}"
            above.plot(D, line(D), color=colour, linewidth=0.7)
            if marker == "s":
                above.plot(close, fine[head], color=colour, linewidth=0.7, linestyle=":")
                below.plot(close, fine[head] - line(close), color=colour, linewidth=0.7, linestyle=":")
            above.plot(D, values, marker, color=colour, markersize=3.5)
            below.plot(D, off, marker, color=colour, markersize=3.5, label=shown)
        below.axhline(0, color=GREY, linewidth=0.7)
        above.set_title(name)
        below.set_xlabel(SERIES["D"].axis)
        low, high = below.get_ylim()
        below.set_ylim(low, high + 0.55 * (high - low))
        below.legend(loc="upper left", borderpad=0)
    panels[0, 0].set_ylabel("Stroke (mm)")
    panels[1, 0].set_ylabel("Off its line (mm)")
    picture.supxlabel(
        "dotted: S08 at every half millimetre of D; a law leaves the rms of published less law about a line, in mm",
        fontsize=7,
    )
    return picture


def _misfit(reproduction: Reproduction) -> Figure:
    """The misfit over the stiffness, and the stiffness that is shipped."""
    found = reproduction.scatter.misfit
    picture = figure(height=62)
    axes = picture.subplots()
    axes.loglog(found["K_kN_per_mm"], found["misfit"], color=ORANGE, marker="s", markersize=2.5)
    axes.axhline(1, color=GREY, linestyle="--", linewidth=0.9)
    axes.annotate("no more explained than by a straight line", (1e3, 1), (6, -3), textcoords="offset points", va="top")
    K, least = reproduction.scatter.best
    axes.annotate(f"{K:.0f} kN/mm: {least:.3f}", (K, least), (-6, 0), textcoords="offset points", ha="right")
    axes.set(xlabel="Unloading stiffness K of all devices (kN/mm)", ylabel="Misfit", xlim=(1e3, 4e5))
    return picture


def _tables(reproduction: Reproduction, factor: str) -> Figure:
    """Strokes, energies, peaks and criteria over a factor: published as points, ours as lines."""
    series = SERIES[factor]
    devices, peaks, criteria = (reproduction.tables[number] for number in series.tables)
    picture = figure(height=108)
    panels = picture.subplots(2, 3, sharex=True).ravel()
    names = list(PEAKS.items())
    parts = (
        (devices, STROKES, "Stroke (mm)"),
        (devices, ENERGIES, "Energy (kJ)"),
        (peaks, dict(names[:3]), "Peak acceleration (g)"),
        (peaks, dict(names[3:]), "Peak acceleration (g)"),
        (criteria, {"TS_mm": "TS"}, "TS (mm)"),
        (criteria, {"TAMA_g": "TAMA"}, "TAMA (g)"),
    )
    for axes, (table, heads, quantity) in zip(panels, parts, strict=True):
        x = table.keys[series.head]
        for (head, name), colour, marker in zip(heads.items(), (BLUE, ORANGE, GREEN), MARKERS, strict=False):
            axes.plot(x, table.published[head], marker, color=colour, markersize=4)
            axes.plot(x, table.found[OURS][head], color=colour, label=name)
        axes.set_ylabel(quantity)
    panels[0].axhline(LIMIT_ANTI_CLIMBER_MM, color=PURPLE, linestyle=":", linewidth=1.0)
    if factor == "M":
        panels[5].plot(peaks.keys[series.head], peaks.published.mean(axis=1), "x", color=GREY, label="mean of Table 7")
    for axes in panels:
        axes.legend(loc="best")
    for axes in panels[3:]:
        axes.set_xlabel(series.axis)
    picture.supxlabel("points: published; lines: ours; dotted: limit of S_anti in Eq. (12)", fontsize=7)
    return picture
