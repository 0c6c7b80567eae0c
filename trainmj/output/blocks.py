"""What a section of a page can hold: text, key figures, tables, bars, pictures and plots."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from trainmj.files.written import finite
from trainmj.output.plot import layout_of
from trainmj.output.style import encode
from trainmj.output.table import Table, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Card:
    """One key figure, shown large."""

    name: str  # such as TS
    value: str  # as it is read, such as "1354.2"
    unit: str = ""  # such as mm
    note: str = ""  # what it means, in a few words
    verdict: Verdict | None = None  # how it compares with its limit


@dataclass(frozen=True)
class Bar:
    """One of several amounts that are compared, drawn beside what is allowed of it."""

    name: str  # of what has it, such as a device at an interface
    value: float
    limit: float | None = None  # a mark on the bar; None for none
    said: str = ""  # the numbers as they are read: "227.2 of 265"
    verdict: Verdict | None = None


@dataclass(frozen=True)
class Block:
    """A part of a section."""

    kind: str  # name of the macro in templates/blocks.html that shows it
    content: Mapping[str, Any]  # arguments of the macro
    half: bool = False  # whether it takes half the width of the page, where there is room
    script: str = ""  # that makes it live
    data: str = ""  # which that script shows, as JSON


@dataclass
class Section:
    """A part of a page with its own heading, listed in the table of contents."""

    title: str
    anchor: str
    blocks: list[Block] = field(default_factory=list)

    def text(self, *paragraphs: str | Markup) -> None:
        """Paragraphs."""
        self._add("text", paragraphs=paragraphs)

    def notes(self, items: Iterable[str | Markup]) -> None:
        """A list of remarks."""
        self._add("notes", items=tuple(items))

    def cards(self, *cards: Card) -> None:
        """Key figures side by side."""
        self._add("cards", cards=cards)

    def facts(self, items: Mapping[str, Any]) -> None:
        """Names with their values, one per line; a value may be a verdict."""
        self._add("facts", items=tuple(items.items()))

    def table(self, table: Table, half: bool = False, folded: bool = False) -> None:
        """A table, whose cells may be markup too; a folded one opens with a click on its title."""
        rows = [[_cell(c.show(v), v) for c, v in zip(table.columns, row, strict=True)] for row in table.rows]
        label = table.title or self.title
        judged = [any(isinstance(row[k], Verdict) for row in rows) for k in range(len(table.columns))]
        self._add("table", half, table=table, label=label, rows=rows, judged=judged, folded=folded)

    def bars(self, bars: Sequence[Bar], title: str, unit: str, note: str = "", half: bool = False) -> None:
        """Amounts as bars of one scale, from 0 on, each with its limit as a mark, its numbers and its verdict."""
        ends = [value for bar in bars for value in (bar.value, bar.limit or 0.0) if math.isfinite(value)]
        whole = max(ends, default=0.0) or 1.0
        rows = [(bar, _part(bar.value, whole), None if bar.limit is None else _part(bar.limit, whole)) for bar in bars]
        judged = any(bar.verdict for bar in bars)
        self._add("bars", half, rows=rows, title=title, unit=unit, note=note, judged=judged)

    def code(self, text: str, title: str) -> None:
        """A file as it stands, which opens with a click on its title."""
        self._add("code", text=text, title=title)

    def picture(self, figure: Figure, alt: str, title: str = "") -> None:
        """A matplotlib figure as SVG; alt says what it shows to those who do not see it."""
        # an SVG shown as an image cannot run scripts, and its names cannot clash with those of another
        source = "data:image/svg+xml;base64," + base64.b64encode(encode(figure, "svg")).decode()
        self._add("picture", source=source, alt=alt, title=title, width=float(figure.get_size_inches()[0]))

    def plot(
        self,
        data: Sequence[Mapping[str, Any]],
        layout: Mapping[str, Any],
        title: str,
        note: str = "",
        height: int = 380,
        half: bool = False,
    ) -> None:
        """A plot with zoom and read-out.

        Args:
            data: plotly.js traces as plain dicts; :mod:`trainmj.output.plot` makes the usual ones.
            layout: plotly.js layout, laid over the one that all plots share.
            title: above it, and read aloud for those who do not see it.
            note: below it.
            height: [pixels].
            half: whether it takes half the width, as in :class:`Block`.
        """
        figure = as_json({"data": list(data), "layout": layout_of(layout) | {"height": height}})
        self._add("plot", half, figure=figure, title=title, note=note, height=height)

    def raw(self, markup: Markup, script: str = "", data: str = "") -> None:
        """Trusted markup, and a script that makes it live; the page holds a script once, however often it is given.

        The markup holds the data of the script too; a page that draws them anew takes them from the block.
        """
        self.blocks.append(Block("raw", {"markup": markup}, script=script, data=data))

    def _add(self, kind: str, half: bool = False, **content: Any) -> None:
        self.blocks.append(Block(kind, content, half))


def as_json(value: Any) -> Markup:
    """A value as JSON that may stand within a script element; NaN and infinity as null."""
    try:
        text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    except ValueError:
        text = json.dumps(finite(value), separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))


def _part(value: float, whole: float) -> str:
    """How far a value goes along a bar, as CSS says it."""
    return f"{100 * min(max(value, 0.0) / whole, 1.0) if math.isfinite(value) else 0.0:.2f}%"


def _cell(shown: Any, value: Any) -> Any:
    """A cell in the signs of print: a minus for a hyphen, a dash for nothing."""
    if shown == "-":
        return "–"
    signed = isinstance(value, str) and value[:1] == "-" and value[1:2].isdigit()  # a number in words of its own
    return shown.replace("-", "−") if isinstance(value, float) or signed else shown
