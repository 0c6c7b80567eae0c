"""The figure of a comparison: channels of both over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trainmj.comparison.differences import Difference
from trainmj.comparison.found import Comparison
from trainmj.output.style import BLUE, GREY, Width, grid, styled
from trainmj.units import MS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_PANELS = 12


def chosen(found: Comparison, most: int) -> list[Difference]:
    """The channels that are drawn: of more than so many those that differ most, in their order."""
    some = found.shifted or found.differences
    if len(some) <= most:
        return list(some)
    worst = sorted(some, key=lambda one: -one.rms_percent if one.rms_percent == one.rms_percent else 0.0)[:most]
    return [one for one in some if one in worst]


def overlay(found: Comparison, width: Width = "page") -> Figure:
    """Channels of both over time, as they are compared."""
    drawn = chosen(found, _MOST_PANELS)
    with styled(width):
        picture, panels = grid(len(drawn), 42.0, most=2, narrowest=70.0)
        for panel, one in zip(panels, drawn, strict=True):
            a, b = found.a.channels[one.channel], found.b.channels[one.channel]
            panel.plot(b.time + one.offset_ms * MS, b.values, color=GREY, linewidth=2.4, alpha=0.6, label="B")
            panel.plot(a.time, a.values, color=BLUE, label="A")
            panel.set_title(one.channel)
            panel.set_ylabel(one.unit)
            panel.set_xlabel("Time (s)")
        more = f"; those {len(drawn)} of {len(found.differences)} that differ most" * (
            len(drawn) < len(found.differences)
        )
        picture.suptitle(f"Channels of A and B{more}", x=0.01, ha="left")
        handles, names = panels[0].get_legend_handles_labels()
        picture.legend(handles[::-1], names[::-1], loc="outside upper right", ncols=2)
    return picture
