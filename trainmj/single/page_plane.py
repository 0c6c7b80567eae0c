"""The vertical plane of one collision: steps between ends, pitch of vehicles, wheel loads and lifts."""

from __future__ import annotations

from collections.abc import Sequence

from trainmj.collision.result import SHOWN, Result
from trainmj.collision.summary import Summary
from trainmj.output.blocks import Section
from trainmj.output.plot import Trace, line
from trainmj.output.style import PALETTE
from trainmj.single import plane, tables_plane
from trainmj.single.marks import Mark, marks
from trainmj.single.page_histories import (
    interface_lines,
    nearest,
    plot_over_time,
    thinning,
    vehicle_lines,
)


def add_plane(section: Section, result: Result, summary: Summary) -> None:
    """Put the tables of the vertical plane, and what happens there over time, into a section."""
    for table in tables_plane.in_plane(summary):
        section.table(table)
    section.text(plane.ruling(result, summary))
    chain, step = result.chain, thinning(result)
    steps = interface_lines(result, "step", step, nearest(chain, len(chain.interfaces)))
    compared = [Mark(name, mm, both=True) for name, mm in plane.marks_of_steps(result, summary).items()]
    note = "Positive where the end on the left is higher. Faces bear while they are engaged only."
    plot_over_time(section, result, "Steps between ends", steps, "Step", SHOWN["step"].shown, note, compared)
    pitch = vehicle_lines(result, "pitch", step)
    note = "Positive with the end that faces the impact up."
    plot_over_time(section, result, "Pitch", pitch, "Pitch", SHOWN["pitch"].shown, note, marks(result, "pitch"))
    note = "Loads over those at rest, up to where a wheelset lifts: one that lands bounces, with many times its load."
    worst = _wheelsets(result, "load", plane.worst_wheelsets(summary), step)
    plot_over_time(section, result, "Loads of the wheelsets that lose most", worst, "N/N0", "", note)
    if lifting := plane.lifting_wheelsets(summary):
        lifts = _wheelsets(result, "lift", lifting, step)
        plot_over_time(
            section, result, "Wheelsets that lift", lifts, "Lift", SHOWN["lift"].shown, "", marks(result, "lift")
        )
    section.table(tables_plane.wheelsets(summary), folded=True)


def _wheelsets(result: Result, history: str, names: Sequence[str], step: int) -> list[Trace]:
    """A line for each of some wheelsets."""
    drawn, unit = plane.drawn(result, history), SHOWN[history].shown
    return [
        line(name, result.time[::step], drawn[name][::step], unit, colour)
        for name, colour in zip(names, PALETTE, strict=False)
    ]
