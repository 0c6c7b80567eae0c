"""Speeds, strokes, forces and energies over time, and flights of occupants, as plots with zoom and read-out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np

from trainmj.collision.chain import Brake, Chain, places_of_sides
from trainmj.collision.envelope import Array
from trainmj.collision.result import SHOWN, Result
from trainmj.output.blocks import Section
from trainmj.output.plot import GREY, VIRIDIS, Trace, across, axes, dots, line, room_for_name, shade, shaded
from trainmj.output.style import BLUE, GREEN, ORANGE, PURPLE, SKY, YELLOW
from trainmj.single.figures import BODIES, OF_INTERFACES, flight_of
from trainmj.single.marks import Mark, marks
from trainmj.units import KJ, KM_H, MM, MS

MOST_LINES = 8
"""Vehicles and interfaces of each side that are drawn, those nearest to the impact."""

_MOST_SAMPLES = 1000  # of a line over time; more are thinned
_DARK = "#404040"
_LOOKS = (("dash", "end"), ("dot", "middle"), ("dashdot", "start"))  # of limits, so that names do not meet
_MOVING = ("#08306b", "#7fb5de")
_PARTNER = ("#8c3a00", "#f5a65b")


def add_histories(section: Section, result: Result) -> None:
    """Put the plots over time into a section."""
    chain, step = result.chain, thinning(result)
    joints = nearest(chain, len(chain.interfaces))
    one_side = chain.interfaces[chain.front].equal_sides
    section.text(
        f"Drawn every {step * chain.record_interval / MS:.3g} ms; peaks in the tables are from every step. Drag to "
        "zoom, double-click to go back, click a name in a legend to hide or show its line."
    )
    for name, axis, more in (("velocity", "Speed", ""), ("acceleration", "Acceleration", ", rail friction included")):
        unit, lines = SHOWN[name].shown, vehicle_lines(result, name, step)
        plot_over_time(section, result, axis + more, lines, axis, unit, marked=marks(result, name))
    for name, title in OF_INTERFACES.items():
        traces = interface_lines(result, name, step, joints)
        notes = ["At the front: one train's side."] if one_side and name != "force" else []
        notes += ["Interfaces of the partner: click their names."] if any("visible" in t for t in traces) else []
        said, unit = " ".join(notes), SHOWN[name].shown
        plot_over_time(section, result, title, traces, title, unit, said, marks(result, name))
    for name, axis in BODIES.items() if chain.members else ():
        lines = vehicle_lines(result, name, step)
        if any(any(one["y"]) for one in lines):
            plot_over_time(section, result, f"{axis} of car bodies", lines, axis, SHOWN[name].shown)
    holds = "devices, suspensions, ties and motion up and down hold" if chain.plane else "the devices still hold"
    note = f"Stacked; what {holds} is the rest of the kinetic energy at the start."
    if chain.grade:
        note += " What a grade gives comes on top."
    plot_over_time(section, result, "Where the energy is", _balance_lines(result, step), "Energy", "kJ", note)
    left_out = len(chain.interfaces) - len(joints)
    if left_out:
        section.text(f"{left_out} interfaces and their vehicles further from the impact are not drawn.")


def add_occupants(section: Section, result: Result) -> None:
    """Put the flights of free occupants into a section: beside the speeds of the vehicles, and over the way flown."""
    chain, flight = result.chain, flight_of(result)
    step = thinning(result)
    speeds, flown = vehicle_lines(result, "velocity", step), []
    for i, trace in zip(nearest(chain, len(chain.vehicles)), list(speeds), strict=True):
        name, colour, first = chain.vehicles[i].name, trace["line"]["color"], chain.speed[i] / KM_H
        time, way, speed = flight.path(i, chain.free_flights[-1])
        drawn = np.unique([*range(0, len(way), step), len(way) - 1])
        with_vehicle: Trace = {"legendgroup": name, "showlegend": False}
        trace["legendgroup"] = name
        dotted = with_vehicle | {"line": {"dash": "dot"}}
        ends = [0.0, min(time[-1], result.time[-1])]
        speeds.append(line(f"{name} occupant", ends, [first, first], "km/h", colour, 1.0, **dotted))
        flown.append(line(name, np.abs(way[drawn]) / MM, np.abs(speed[drawn]), "m/s", colour, legendgroup=name))
        for distance, at, met in flight.met(i, chain.free_flights):
            said = [f"{met:.4g} m/s after {distance / MM:.0f} mm, at {at:.4g} s"]
            flown.append(dots(name, [distance / MM], [met], colour, size=6, texts=said, **with_vehicle))
    plot_over_time(section, result, "Speed of vehicles and, dotted, of their occupants", speeds, "Speed", "km/h")
    stated = {"type": "line", "y0": 0, "y1": 1, "yref": "paper", "line": {"color": GREY, "width": 1}}
    marks = [stated | {"x0": distance / MM, "x1": distance / MM} for distance in chain.free_flights]
    layout = axes("Free flight", "mm", "Relative speed", "m/s", shapes=marks, yaxis={"rangemode": "tozero"})
    note = "Dots: secondary impact velocities after the distances that the scenario states."
    note += f" {result.not_valid.capitalize()}." if result.not_valid else ""
    section.plot(flown, layout, title="Speed of occupants against their vehicle", note=note, height=400, half=True)


def plot_over_time(
    section: Section,
    result: Result,
    title: str,
    traces: list[Trace],
    axis: str,
    unit: str,
    note: str = "",
    marked: Sequence[Mark] = (),
) -> None:
    """A plot over time, all lines read out at once, limits as lines across it; shaded where not valid."""
    shapes = shaded(result.tally.valid_until, float(result.time[-1]), "not valid")["shapes"] if result.not_valid else []
    values = []
    for mark, (dash, place) in zip(marked, cycle(_LOOKS)):
        shapes.append(across(mark.value, mark.name, dash, place))
        low = -1.05 * mark.value if mark.both else 0.0
        values += [room_for_name(shapes[-1], low), low]
        shapes += [across(-mark.value, "", dash)] if mark.both else []
    seen = {"autorangeoptions": {"include": values}} if values else {}
    layout = axes("Time", "s", axis, unit, hovermode="x unified", xaxis={"hoverformat": ".4g"}, yaxis=seen)
    layout |= {"shapes": shapes} if shapes else {}
    section.plot(traces, layout, title=title, note=note, height=400, half=True)


def thinning(result: Result) -> int:
    """Of how many records of a result one is drawn."""
    return -(-len(result.time) // _MOST_SAMPLES)


def nearest(chain: Chain, n: int) -> list[int]:
    """Indices of those of n that are drawn, from the front backwards along the moving train, then along the partner."""
    own = range(chain.front, max(-1, chain.front - MOST_LINES), -1)
    return [*own, *range(chain.front + 1, min(n, chain.front + MOST_LINES))]


def vehicle_lines(result: Result, history: str, step: int) -> list[Trace]:
    """A line for each vehicle: the moving train in blue, its partner in orange, paler towards the rear."""
    chain, unit, shown, traces = result.chain, SHOWN[history].shown, result.shown(history), []
    for i in nearest(chain, len(chain.vehicles)):
        if chain.vehicles[i].name in shown:
            values = shown[chain.vehicles[i].name]
            traces.append(vehicle_line(chain, i, result.time[::step], values[::step], unit))
    return traces


def vehicle_line(chain: Chain, i: int, x: Array, y: Array, unit: str, **more: Any) -> Trace:
    """A line of a vehicle, in its colour."""
    moving = i < chain.n_moving
    away = chain.front - i if moving else i - chain.n_moving
    colour = shade(away / max(1, MOST_LINES - 2), _MOVING if moving else _PARTNER)
    look = more.pop("line", {}) | ({} if moving else {"dash": "4px,2px"})
    return line(chain.vehicles[i].name, x, y, unit, colour, **more, **({"line": look} if look else {}))


def interface_lines(result: Result, history: str, step: int, joints: list[int]) -> list[Trace]:
    """A line for each interface, in the same colour on both sides; those behind the partner's head are hidden."""
    chain, unit, traces = result.chain, SHOWN[history].shown, []
    most = max(1, max(abs(k - chain.front) for k in joints))
    places = places_of_sides(chain)
    if SHOWN[history].over == "ends":  # one line for both sides
        places = [(k, 0) for k in dict.fromkeys(k for k, _ in places)]
    for (k, side), (name, values) in zip(places, result.shown(history).items(), strict=True):
        if k in joints:
            colour = shade(0.88 * abs(k - chain.front) / most, VIRIDIS)
            more: Trace = {"line": {"dash": "dot"}} if side or k > chain.front else {}
            more |= {"visible": "legendonly"} if k > chain.front else {}
            traces.append(line(name, result.time[::step], values[::step], unit, colour, **more))
    return traces


def _balance_lines(result: Result, step: int) -> list[Trace]:
    """Kinetic energy, that absorbed in devices and bodies, work of rails, brakes and grade, and the rest [kJ]."""
    chain = result.chain
    way = np.vstack([np.zeros(len(chain.points)), np.abs(np.diff(result.point_position, axis=0))])
    kinetic = result.kinetic
    absorbed = np.sum(result.energy, axis=1)
    rails = np.cumsum(np.sum(chain.friction * way, axis=1))
    brakes = np.cumsum(np.sum(_braking(result)[:, chain.vehicle_of] * chain.carried * way, axis=1))
    grade = -np.sum(chain.grade_force * (result.point_position - result.point_position[0]), axis=1)
    yielded = np.sum(result.member_yielded, axis=1)
    elastic = np.sum(result.member_elastic, axis=1)
    held = np.maximum(0.0, kinetic[0] - kinetic - absorbed - yielded - elastic - rails - brakes - grade)
    rest = "elastic or gas, in the devices" + (" (or damped in car bodies)" if chain.members else "")
    rest += ", or in the vertical plane" if chain.plane else ""
    return [
        line(name, result.time[::step], values[::step] / KJ, "kJ", colour, width=0.8, stackgroup="energy")
        for name, values, colour in (
            ("absorbed by the devices", absorbed, BLUE),
            ("by yielding of car bodies", yielded, ORANGE),
            ("by the rails", rails, GREY),
            ("by the brakes", brakes, GREEN),
            ("by the grade", np.maximum(0.0, grade), SKY),
            ("elastic, in the car bodies", elastic, _DARK),
            (rest, held, PURPLE),
            ("kinetic", kinetic, YELLOW),
        )
        if values.any()
    ]


def _braking(result: Result) -> Array:
    """(n_sample, n_vehicle) brake force that there is [N], as the mean between a record and the one before."""
    brakes = [v.brake or Brake(0.0) for v in result.chain.vehicles]
    time = result.time - 0.5 * result.chain.record_interval
    rising = [
        np.clip((time - b.delay) / b.rise, 0.0, 1.0) if b.rise > 0.0 else (time >= b.delay).astype(float)
        for b in brakes
    ]
    return np.stack([np.minimum(b.force * part, b.most) for b, part in zip(brakes, rising, strict=True)], axis=1)
