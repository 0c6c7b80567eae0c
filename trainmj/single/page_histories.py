"""Speeds, strokes, forces and energies over time, as plots with zoom and read-out."""

from __future__ import annotations

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.device import Array
from trainmj.collision.result import Result
from trainmj.output.blocks import Section
from trainmj.output.plot import GREY, VIRIDIS, Trace, line, over_time, shade
from trainmj.output.style import BLUE, PURPLE, YELLOW
from trainmj.units import KJ, KM_H, KN, MM, G

MOST_SAMPLES = 1000
"""Of a line over time; more are thinned."""

MOST_LINES = 8
"""Vehicles, and interfaces, of each side that are drawn: those next to the impact."""

_MOVING = ("#08306b", "#7fb5de")
_PARTNER = ("#8c3a00", "#f5a65b")


def add_histories(section: Section, result: Result) -> None:
    """Put the plots over time into a section."""
    chain = result.chain
    step = -(-len(result.time) // MOST_SAMPLES)
    time = result.time[::step]
    every = 1e3 * (time[1] - time[0]) if len(time) > 1 else 0.0
    joints = _nearest(chain, len(chain.interfaces), chain.front)
    share = np.array([interface.shown_share for interface in chain.interfaces])
    own = "; the front is one train's side" if share[chain.front] == 0.5 else ""
    section.text(
        f"Drawn every {every:.3g} ms; peaks in the tables are from every step. Drag to zoom, double-click to go back, "
        "click a name in a legend to hide or show its line."
    )
    for title, values, unit in (
        ("Speed", result.velocity / KM_H, "km/h"),
        ("Acceleration, rail friction included", result.acceleration / G, "g"),
    ):
        traces = _vehicle_lines(chain, time, values[::step], unit)
        section.plot(traces, over_time(title.partition(",")[0], unit), title=title, height=400, half=True)
    for title, values, unit in (
        ("Stroke", result.stroke * share / MM, "mm"),
        ("Force", result.force / KN, "kN"),
        ("Absorbed energy", result.energy * share / KJ, "kJ"),
    ):
        traces = _interface_lines(chain, joints, time, values[::step], unit)
        partner = " Interfaces of the partner: click their names." if any("visible" in t for t in traces) else ""
        note = (f"At each interface{own}." if own or partner else "") + partner
        section.plot(traces, over_time(title, unit), title=title, note=note, height=400, half=True)
    section.plot(
        _balance_lines(result, step, time),
        over_time("Energy", "kJ"),
        title="Where the energy is",
        note="Stacked; elastic is what remains of the kinetic energy at the start.",
        height=400,
        half=True,
    )
    left_out = len(chain.interfaces) - len(joints)
    if left_out:
        section.text(f"{left_out} interfaces and their vehicles further from the impact are not drawn.")


def _nearest(chain: Chain, n: int, middle: int) -> list[int]:
    """Indices of what is drawn, from the front backwards along the moving train, then along the partner."""
    own = list(range(middle, max(-1, middle - MOST_LINES), -1))
    return own + list(range(middle + 1, min(n, middle + MOST_LINES)))


def _vehicle_lines(chain: Chain, time: Array, values: Array, unit: str) -> list[Trace]:
    """A line for each vehicle: the moving train in blue, its partner in orange, paler towards the rear."""
    indices = _nearest(chain, len(chain.vehicles), chain.front)
    counts = {True: 0, False: 0}
    traces = []
    for i in indices:
        moving = i < chain.n_moving
        part = counts[moving] / max(1, MOST_LINES - 2)
        counts[moving] += 1
        colour = shade(part, _MOVING if moving else _PARTNER)
        more: Trace = {} if moving else {"line": {"dash": "4px,2px"}}
        traces.append(line(chain.vehicles[i].name, time, values[:, i], unit, colour, **more))
    return traces


def _interface_lines(chain: Chain, joints: list[int], time: Array, values: Array, unit: str) -> list[Trace]:
    """A line for each interface, in the same colour on both sides; the partner's wait in the legend."""
    most = max(1, max(abs(k - chain.front) for k in joints))
    traces = []
    for k in joints:
        colour = shade(0.88 * abs(k - chain.front) / most, VIRIDIS)
        more: Trace = {"line": {"dash": "dot"}, "visible": "legendonly"} if k > chain.front else {}
        traces.append(line(chain.interfaces[k].name, time, values[:, k], unit, colour, **more))
    return traces


def _balance_lines(result: Result, step: int, time: Array) -> list[Trace]:
    """Kinetic energy, absorbed energy, work of the rails and the elastic rest, stacked [kJ].

    A rail's friction works over the way of its vehicle; a vehicle that stands has none.
    """
    chain = result.chain
    way = np.vstack([np.zeros(len(chain.vehicles)), np.cumsum(np.abs(np.diff(result.position, axis=0)), axis=0)])
    kinetic = 0.5 * np.sum(chain.mass * result.velocity**2, axis=1)
    absorbed = np.sum(result.energy, axis=1)
    rails = np.sum(chain.friction * way, axis=1)
    elastic = np.maximum(0.0, kinetic[0] - kinetic - absorbed - rails)
    traces = []
    for name, values, colour in (
        ("absorbed by the devices", absorbed, BLUE),
        ("by the rails", rails, GREY),
        ("elastic, in the devices", elastic, PURPLE),
        ("kinetic", kinetic, YELLOW),
    ):
        trace = line(name, time, values[::step] / KJ, "kJ", colour, width=0.8, stackgroup="energy")
        traces.append(trace)
    return traces
