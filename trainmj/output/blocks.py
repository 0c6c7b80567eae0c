"""What a section of a page can hold: text, key figures, tables, pictures, plots, and verdicts within them."""

from __future__ import annotations

import base64
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from markupsafe import Markup

from trainmj.files.plain import finite
from trainmj.output.plot import layout_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIGNS = {"pass": "✓", "fail": "✗", "warn": "!", "none": "–"}


@dataclass(frozen=True)
class Verdict:
    """How something stands: ``pass``, ``fail``, ``warn`` or ``none``, said in words.

    Make it with :func:`passed`, :func:`failed`, :func:`warned` or :func:`unjudged`; it may stand in a table's cell.
    """

    kind: str
    text: str

    @property
    def sign(self) -> str:
        """What is read where colours are not seen."""
        return _SIGNS[self.kind]


def passed(text: str = "pass") -> Verdict:
    """A limit is kept, a check holds."""
    return Verdict("pass", text)


def failed(text: str = "fail") -> Verdict:
    """A limit is passed, a check does not hold."""
    return Verdict("fail", text)


def warned(text: str) -> Verdict:
    """Something to look at."""
    return Verdict("warn", text)


def unjudged(text: str = "no limit") -> Verdict:
    """There is nothing to judge by."""
    return Verdict("none", text)


def judged(kept: bool | None, yes: str = "pass", no: str = "fail", unknown: str = "no limit") -> Verdict:
    """The verdict of a comparison; None where there is nothing to compare with."""
    return unjudged(unknown) if kept is None else passed(yes) if kept else failed(no)


@dataclass(frozen=True)
class Card:
    """One key figure, shown large.

    Attributes:
        name: what it is, such as TS.
        value: as it is to be read, such as "1354.2".
        unit: such as mm.
        note: what it means, in a few words.
        verdict: how it stands to its limit.
    """

    name: str
    value: str
    unit: str = ""
    note: str = ""
    verdict: Verdict | None = None


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        name: head of the column.
        unit: below it.
        digits: decimals of its numbers; None for four significant ones.
        text: whether it holds words, set to the left.
    """

    name: str
    unit: str = ""
    digits: int | None = None
    text: bool = False

    def show(self, value: Any) -> Any:
        """A cell as it is shown: numbers rounded, everything else as it is."""
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            return "–"
        if isinstance(value, float):
            return (f"{value:.4g}" if self.digits is None else f"{value:z.{self.digits}f}").replace("-", "−")
        return value


@dataclass(frozen=True)
class Block:
    """A part of a section; ``kind`` names the part of the template that shows it."""

    kind: ClassVar[str] = ""
    half: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class _Text(Block):
    kind: ClassVar[str] = "text"
    paragraphs: tuple[str | Markup, ...]


@dataclass(frozen=True)
class _Notes(Block):
    kind: ClassVar[str] = "notes"
    items: tuple[str | Markup, ...]


@dataclass(frozen=True)
class _Cards(Block):
    kind: ClassVar[str] = "cards"
    cards: tuple[Card, ...]


@dataclass(frozen=True)
class _Facts(Block):
    kind: ClassVar[str] = "facts"
    items: tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class _Table(Block):
    kind: ClassVar[str] = "table"
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]
    note: str
    folded: bool


@dataclass(frozen=True)
class _Code(Block):
    kind: ClassVar[str] = "code"
    text: str
    title: str
    folded: bool


@dataclass(frozen=True)
class _Picture(Block):
    kind: ClassVar[str] = "picture"
    source: str
    alt: str
    title: str
    width: float


@dataclass(frozen=True)
class Plot(Block):
    """A plot, its content as JSON."""

    kind: ClassVar[str] = "plot"
    figure: Markup
    title: str
    note: str
    height: int


@dataclass(frozen=True)
class Raw(Block):
    """Trusted markup, and the script that makes it live."""

    kind: ClassVar[str] = "raw"
    markup: Markup
    script: str


@dataclass
class Section:
    """A part of a page under a head of its own, and in the table of contents."""

    title: str
    anchor: str
    blocks: list[Block] = field(default_factory=list)

    def text(self, *paragraphs: str | Markup) -> None:
        """Paragraphs."""
        self.blocks.append(_Text(paragraphs))

    def notes(self, items: Iterable[str | Markup]) -> None:
        """A list of remarks."""
        self.blocks.append(_Notes(tuple(items)))

    def cards(self, *cards: Card) -> None:
        """Key figures side by side."""
        self.blocks.append(_Cards(cards))

    def facts(self, items: Mapping[str, Any], half: bool = False) -> None:
        """Names with their values, one per line; a value may be a verdict."""
        self.blocks.append(_Facts(tuple(items.items()), half=half))

    def table(
        self,
        columns: Sequence[Column],
        rows: Iterable[Sequence[Any]],
        title: str = "",
        note: str = "",
        half: bool = False,
        folded: bool = False,
    ) -> None:
        """A table; a cell may be a number, text, a verdict or markup. A folded one opens on a click on its title.

        Raises:
            ValueError: if a row has not one cell for each column.
        """
        cells = tuple(tuple(c.show(v) for c, v in zip(columns, row, strict=True)) for row in rows)
        self.blocks.append(_Table(title, tuple(columns), cells, note, folded, half=half))

    def code(self, text: str, title: str = "", folded: bool = False) -> None:
        """Text as it stands: a command, or a file; folded away behind its title if it is long."""
        self.blocks.append(_Code(text, title, folded))

    def picture(self, figure: Figure, alt: str, title: str = "", half: bool = False) -> None:
        """A matplotlib figure as SVG.

        Args:
            figure: drawn in the style of all figures.
            alt: what it shows, for those who do not see it.
            title: above it.
            half: whether it takes half the width of the page, where there is room.
        """
        width = float(figure.get_size_inches()[0])
        self.blocks.append(_Picture(_svg(figure), alt, title, width, half=half))

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
            half: whether it takes half the width of the page, where there is room.
        """
        content = {"data": list(data), "layout": layout_of(layout) | {"height": height}}
        self.blocks.append(Plot(as_json(content), title, note, height, half=half))

    def raw(self, markup: Markup, script: str = "") -> None:
        """Trusted markup, and a script that makes it live; a script is in the page once, however often given."""
        self.blocks.append(Raw(markup, script))


def as_json(value: Any) -> Markup:
    """A value as JSON that may stand within a script element; NaN and infinity as null."""
    try:
        text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    except ValueError:
        text = json.dumps(finite(value), separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))


def _svg(figure: Figure) -> str:
    """A figure as the address of an image: SVG within an image cannot run scripts, and shares no names."""
    import matplotlib as mpl

    content = io.BytesIO()
    with mpl.rc_context({"svg.fonttype": "path", "svg.hashsalt": "trainmj"}):
        figure.savefig(content, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(content.getvalue()).decode()
