"""What a cell of a notebook shows: the blocks of a page, without the page around them."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from trainmj.output.blocks import Section
from trainmj.output.page import environment

_STYLE = Path(__file__).resolve().parent / "templates" / "cell.css"


class Cell(Section):
    """A section with a line below its title; it holds no plots and no scripts."""

    def __init__(self, title: str, subtitle: str = "") -> None:
        """Begin a cell."""
        super().__init__(title, "")
        self.subtitle = subtitle

    def html(self) -> str:
        """Markup for a notebook, escaped, with a style that touches nothing else there."""
        style = Markup(_STYLE.read_text(encoding="utf-8"))
        html: str = environment().get_template("cell.html").render(cell=self, style=style)
        return html.encode(errors="backslashreplace").decode()
