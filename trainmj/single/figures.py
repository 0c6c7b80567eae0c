"""The figures of a collision: what happens over time, the flight of its occupants, and its bodies that give."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.chain import n_own_sides, order_of_vehicles
from trainmj.collision.occupants import Flight
from trainmj.collision.result import SHOWN, Result
from trainmj.collision.summary import Summary, summarise
from trainmj.output.style import Width, grid, styled
from trainmj.single.bodies import ALONG, along
from trainmj.single.marks import Mark, marks
from trainmj.single.plane import drawn, lifting_wheelsets, marks_of_steps, worst_wheelsets
from trainmj.units import MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_MOST_VEHICLES, _MOST_INTERFACES = 6, 8  # of one side, that are all named; of more the first ones and the last
_WIDEST = 44  # characters of a line of the name of a limit

OF_INTERFACES = {"stroke": "Stroke", "force": "Force", "energy": "Absorbed energy"}
"""Histories of interfaces that are drawn, and their titles."""

BODIES = {"body_shortening": "Shortening", "body_plastic": "Plastic shortening"}
"""Those of bodies."""


def drawings(result: Result, width: Width = "page", summary: Summary | None = None) -> dict[str, Callable[[], Figure]]:
    """The figures that there are of a collision, by the names of their files."""
    chain = result.chain
    found: dict[str, Callable[[], Figure]] = {"collision": partial(collision, result, width)}
    if chain.plane:
        found["plane"] = lambda: plane(result, summary or summarise(result), width)
    if chain.members:
        found["bodies"] = partial(bodies, result, width)
    if chain.free_flights:
        found["occupants"] = partial(occupants, result, width)
    return found


def collision(result: Result, width: Width = "page") -> Figure:
    """Speeds, strokes, forces and energies of one collision over time, in four panels, stacked in a column."""
    chain = result.chain
    with styled(width):
        figure, axes = grid(4, 62.0 if width == "page" else 50.0, most=2)
        _head(figure, result)
        front = chain.interfaces[chain.front]
        joints = range(n_own_sides(chain) + front.unequal_sides)  # then the partner's device at the front
        _draw(axes[0], result, "velocity", "Speed", *_sides(result))
        _legend_of_vehicles(axes[0], result)
        for panel, (name, title) in zip(axes[1:], OF_INTERFACES.items(), strict=True):
            _draw(panel, result, name, title, (joints, "viridis", 0.0, 0.9))
            if front.equal_sides and name != "force":  # above the panel there are the names of the lines
                panel.set_ylabel(f"{panel.get_ylabel()} (front: one train's side)")
            _across(panel, marks(result, name))
        apart = axes[1].get_ylim()[0] if chain.gap == 0 else 0.0
        strokes = result.shown("stroke")
        pulled = [float(strokes[side].min()) for i in chain.interfaces if i.draws for side in i.sides]
        axes[1].set_ylim(bottom=min([0.0, *(1.1 * least for least in pulled)] if pulled else [0.0, apart]))
        named = _named(
            axes[1].lines[: len(joints)], _MOST_INTERFACES - 2 * front.unequal_sides
        )  # the partner's name is a long one
        half = (len(named) + 1) // 2
        _legend(axes[1], [named[:half], named[half:]])  # the colours are the same in all three
        for axis in axes:
            _over_time(axis, result)
        for axis in axes[2:] if width == "page" else axes[3:]:
            axis.set_xlabel("Time (s)")
    return figure


def bodies(result: Result, width: Width = "page") -> Figure:
    """The bodies that give: how each shortens over time, and along them shortening, what remains, and accelerations."""
    from matplotlib import colormaps

    chain, shortening = result.chain, result.shown("body_shortening")
    drawn = {one: along(result, one) for one in ALONG}
    drawn = {one: lines for one, lines in drawn.items() if one.always or any(y.any() for _, y in lines.values())}
    with styled(width):
        figure, panels = grid(1 + len(drawn), 62.0 if width == "page" else 50.0, most=2)
        _head(figure, result)
        sides: tuple[list[Line2D], list[Line2D]] = [], []
        order = order_of_vehicles(chain)
        cars = order[: chain.n_moving], order[chain.n_moving :]
        for side, places, colours, dashes in zip(
            sides, cars, ("Blues_r", "Oranges_r"), ("-", (0, (4, 1.5))), strict=True
        ):
            for place, i in enumerate(places):
                if (name := chain.vehicles[i].name) in shortening:
                    colour = colormaps[colours](0.1 + 0.6 * _part(place, len(places)))
                    look: dict[str, Any] = {"color": colour, "linestyle": dashes}
                    side += panels[0].plot(result.time, shortening[name], label=name, **look)
                    for panel, (one, lines) in zip(panels[1:], drawn.items(), strict=True):
                        panel.plot(*lines[name], drawstyle="steps-post" if one.of_members else "default", **look)
        _legend(panels[0], [_named(side, _MOST_VEHICLES - 1) for side in sides if side])
        panels[0].set(title="Shortening", ylabel="mm", xlabel="Time (s)")
        _over_time(panels[0], result)
        for panel, one in zip(panels[1:], drawn, strict=True):
            panel.set(title=one.title, ylabel=one.unit, xlabel="Distance from the end that faces the impact (m)")
            panel.set_xlim(left=0)
    return figure


def plane(result: Result, summary: Summary, width: Width = "page") -> Figure:
    """The vertical plane over time: steps beside overlaps and limit, pitch, loads and lifts of the worst wheelsets."""
    chain = result.chain
    lifting = lifting_wheelsets(summary)
    with styled(width):
        figure, axes = grid(3 + bool(lifting), 62.0 if width == "page" else 50.0, most=2)
        _head(figure, result)
        _draw(axes[0], result, "step", "Step", (range(chain.front + 1), "viridis", 0.0, 0.9))
        named = _named(axes[0].lines, _MOST_INTERFACES)
        half = (len(named) + 1) // 2
        _legend(axes[0], [named[:half], named[half:]] if named[half:] else [named])
        _across(axes[0], [Mark(name, mm, both=True) for name, mm in marks_of_steps(result, summary).items()])
        _draw(axes[1], result, "pitch", "Pitch", *_sides(result))
        _across(axes[1], marks(result, "pitch"))
        _legend_of_vehicles(axes[1], result)
        for axis, name, title, names in (
            (axes[2], "load", "N/N0 up to lift", worst_wheelsets(summary)),
            *([(axes[3], "lift", "Lift", lifting)] if lifting else []),
        ):
            histories = drawn(result, name)
            lines = [axis.plot(result.time, histories[of], label=of.replace(" wheelset", ""))[0] for of in names]
            axis.set(title=title, ylabel=f"{SHOWN[name].shown} (vehicle and wheelset)".lstrip())
            _legend(axis, [lines[:3], lines[3:]] if lines[3:] else [lines])
            _across(axis, marks(result, name))
        axes[2].set_ylim(bottom=0.0)
        for axis in axes:
            _over_time(axis, result)
            axis.set_xlabel("Time (s)")
    return figure


def occupants(result: Result, width: Width = "page") -> Figure:
    """The flight of free occupants: beside the speed of each vehicle, and their relative speed over the way flown.

    The dots are the impacts after the distances that the scenario states; the lines end with the last of them.
    """
    chain = result.chain
    flight, longest = flight_of(result), chain.free_flights[-1]
    with styled(width):
        figure, axes = grid(2, 70.0 if width == "page" else 60.0, most=2)
        _head(figure, result)
        _draw(axes[0], result, "velocity", "Speed", *_sides(result))
        axes[0].set_ylabel(f"{axes[0].get_ylabel()} (dashed: occupants)")
        _legend_of_vehicles(axes[0], result)
        speeds = result.shown("velocity")
        for i, line in zip(order_of_vehicles(chain), list(axes[0].lines), strict=True):
            colour, own = line.get_color(), speeds[chain.vehicles[i].name]
            time, way, speed = flight.path(i, longest)
            axes[0].plot([0.0, time[-1]], [own[0]] * 2, color=colour, linestyle="--")
            axes[1].plot(np.abs(way) / MM, np.abs(speed), color=colour)
            late = time > result.tally.valid_until
            axes[1].plot(np.abs(way[late]) / MM, np.abs(speed[late]), color="0.75")
            for distance, at, met in flight.met(i, chain.free_flights):
                axes[0].plot(at, np.interp(at, result.time, own), ".", color=colour, markersize=4)
                axes[1].plot(distance / MM, met, ".", color=colour, markersize=4)
        _over_time(axes[0], result)
        axes[0].set_xlabel("Time (s)")
        axes[1].set_title("Secondary impact velocity")
        axes[1].set_xlabel("Free flight (mm)")
        axes[1].set_ylabel("m/s")
        for distance in chain.free_flights:
            axes[1].axvline(distance / MM, color="0.5", linewidth=0.8, linestyle=":", zorder=1)
        axes[1].set_xlim(0, 1.03 * longest / MM)
        axes[1].set_ylim(bottom=0)
    return figure


def flight_of(result: Result) -> Flight:
    """The free flights of the occupants of a collision."""
    return Flight(result.time, result.velocity, cut=not result.tally.over)


def _head(figure: Figure, result: Result) -> None:
    """What was collided, and what is not valid."""
    # lines are broken as if dollars were formulas, whatever parse_math says, unless they are written so
    lines = (result.scenario.heading, result.scenario.subject, result.not_valid and f"Grey: {result.not_valid}")
    title = "\n".join(filter(None, lines)).replace("$", r"\$")
    figure.suptitle(title, x=0.01, ha="left", wrap=True, parse_math=True)


def _sides(result: Result) -> tuple[tuple[range, str, float, float], ...]:
    """The vehicles of both sides and their colours, for :func:`_draw`."""
    n, both = result.chain.n_moving, len(result.chain.vehicles)
    return (range(n), "Blues_r", 0.1, 0.6), (range(n, both), "Oranges_r", 0.1, 0.6)


def _legend_of_vehicles(axes: Axes, result: Result) -> None:
    n = result.chain.n_moving
    _legend(axes, [_named(side, _MOST_VEHICLES) for side in (axes.lines[:n], axes.lines[n:])])


def _over_time(axes: Axes, result: Result) -> None:
    """An axis as long as the collision; grey where it is not valid."""
    axes.set_xlim(0, result.time[-1])
    if result.not_valid:
        axes.axvspan(result.tally.valid_until, result.time[-1], color="0.88", zorder=0)


def _across(axes: Axes, found: Sequence[Mark]) -> None:
    """A line across a panel for each limit, named on it; the names of neighbours stand apart."""
    for n, (mark, dash) in enumerate(zip(found, cycle(("--", ":", "-.")))):
        for value in (mark.value, -mark.value) if mark.both else (mark.value,):
            axes.axhline(value, color="0.35", linewidth=0.8, linestyle=dash, label="_limit")
        at, side = (0.99, "right") if n % 2 == 0 else (0.02, "left")
        look: dict[str, Any] = {"color": "0.3", "fontsize": "x-small", "va": "bottom", "ha": side}
        text = axes.text(
            at, mark.value, "\n".join(wrap(mark.name, _WIDEST)), transform=axes.get_yaxis_transform(), **look
        )
        text.set_in_layout(False)


def _draw(axes: Axes, result: Result, name: str, title: str, *sides: tuple[range, str, float, float]) -> None:
    """A history: for each side of the collision its places in it, a scale of colours, its start and length."""
    from matplotlib import colormaps

    lines = list(result.shown(name).items())  # none of the pitch of an obstacle; the force of both sides is one
    most = n_own_sides(result.chain) if name == "force" else len(lines)
    for places, colours, start, length in sides:
        for place, i in enumerate(places):
            colour = colormaps[colours](start + length * _part(place, len(places)))
            if i < most:
                axes.plot(result.time, lines[i][1], color=colour, label=lines[i][0])
    axes.set_title(title)
    axes.set_ylabel(SHOWN[name].shown)


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
