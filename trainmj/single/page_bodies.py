"""The bodies that give of one collision: how they shorten, where, and what is felt along them."""

from __future__ import annotations

from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.output.blocks import Section
from trainmj.output.plot import axes
from trainmj.single import tables
from trainmj.single.bodies import ALONG, along
from trainmj.single.page_histories import nearest, vehicle_line


def add_bodies(section: Section, result: Result, summary: Summary) -> None:
    """Put the table of bodies, and plots along them, into a section."""
    chain = result.chain
    section.table(tables.bodies(chain, summary))
    section.text(
        "Along a body: each member by its length at rest, so that members of different lengths compare; peaks are from "
        "every step."
    )
    drawn = [i for i in nearest(chain, len(chain.vehicles)) if chain.vehicles[i].body]
    for one in ALONG:
        lines = along(result, one)
        steps = {"line": {"shape": "hv"}} if one.of_members else {"mode": "lines+markers"}
        traces = [vehicle_line(chain, i, *lines[chain.vehicles[i].name], one.unit, **steps) for i in drawn]
        if one.always or any(any(trace["y"]) for trace in traces):
            layout = axes("Distance from the end that faces the impact", "m", one.axis, one.unit, hovermode="x unified")
            section.plot(traces, layout, title=one.title, height=400, half=True)
