"""The HTML pages of trainmj: one file each, that works offline and is legible on a screen, a phone and paper.

A page has sections, a section has blocks::

    from trainmj.output.blocks import Card
    from trainmj.output.page import Page
    from trainmj.output.plot import axes, line
    from trainmj.output.table import Column, Table, passed

    page = Page("B-type train, 25 km/h", subtitle="...", command="trainmj report results", versions=identity())
    section = page.section("Criteria")
    section.text("What the simulation found, against its limits.")
    section.cards(Card("TS", "1354.2", "mm", "compression along the train", passed("below 1500")))
    section.table(Table([Column("Interface", text=True), Column("largest stroke", "mm", 1)], [("S1-M1", 618.3)]))
    section.plot([line("M1", time, speed)], axes("time", "s", "speed", "km/h"), title="Speed", half=True)
    section.picture(matplotlib_figure, alt="Pareto front of TS and TAMA")
    page.write(folder / "report.html")

What it guarantees:

* Text, names and cells are escaped. Intended markup is a :class:`markupsafe.Markup`; make it with
  ``Markup("<b>{}</b>").format(name)``, which escapes the name.
* No request leaves the page: a Content-Security-Policy forbids all of them, and all scripts except those of the page,
  identified by their hashes.
* plotly.js is in the file once, and only if there is a plot.
* A verdict is a sign and a word, never a colour alone.
* The same content gives the same file, byte by byte; no date is written but that of the cover.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Any

from markupsafe import Markup

from trainmj.errors import EngineError
from trainmj.files.cover import Cover
from trainmj.files.written import replacing
from trainmj.output.blocks import Block, Section
from trainmj.output.table import Verdict

REPORT = "report.html"
"""The name of a page beside the results that it shows."""

_SMALL = "font: 8pt system-ui, sans-serif; color: #5a616d;"  # what stands above and below a printed page
_LONGEST = 90  # characters of the title below a printed page
_TEMPLATES = Path(__file__).resolve().parent / "templates"


@dataclass
class Page:
    """A page.

    Attributes:
        title: of the page and its window.
        subtitle: a line below it.
        command: that makes the page again, in the footer.
        style: CSS that is laid over that of all pages.
        connect: addresses that its scripts may connect to; none by default.
        versions: of what computed the numbers, in the footer.
        sections: of the page, in their order.
        verdict: on the whole in one sentence, before everything else.
        cover: project, client, author, revision and date, at the head.
    """

    title: str
    subtitle: str = ""
    command: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    sections: list[Section] = field(default_factory=list)
    verdict: Verdict | None = None
    cover: Cover = field(default_factory=Cover)
    style: str = ""
    connect: str = ""

    def headed(self, given: Cover) -> Page:
        """The same with what a command gives for the cover, which it says again in the footer."""
        first, *more = self.command.split("\n")
        words = [f"--{name} {quote(text)}" for name, text in given.stated.items()]
        command = "\n".join([" ".join([first, *words]), *more])
        return replace(self, cover=self.cover.over(given), command=command)

    def section(self, title: str) -> Section:
        """Begin a section."""
        section = Section(title, f"section-{len(self.sections) + 1}")
        self.sections.append(section)
        return section

    def html(self) -> str:
        """The whole page."""
        blocks = [block for section in self.sections for block in section.blocks]
        scripts = list(dict.fromkeys(block.script for block in blocks if block.script))
        if any(block.kind == "plot" for block in blocks):
            scripts = [_plotly(), (_TEMPLATES / "plots.js").read_text(encoding="utf-8"), *scripts]
        style = Markup((_TEMPLATES / "page.css").read_text(encoding="utf-8") + self.style + self._running())
        marked = [Markup(script) for script in scripts]
        html: str = (
            environment()
            .get_template("page.html")
            .render(page=self, style=style, scripts=marked, policy=_policy(scripts, self.connect))
        )
        return html.encode(errors="backslashreplace").decode()  # the name of a folder need not be UTF-8

    def _running(self) -> str:
        """What stands above and below every printed page, as style: project and revision, title and number."""
        cover = self.cover
        above = {
            "top-left": " · ".join(filter(None, (cover.project, cover.client))),
            "top-right": " · ".join(filter(None, (cover.revision and f"revision {cover.revision}", cover.date))),
            "bottom-left": self.title if len(self.title) <= _LONGEST else f"{self.title[: _LONGEST - 3]}...",
        }
        boxes = "".join(
            f"@{place} {{ content: {_css_text(text)}; {_SMALL} }}\n" for place, text in above.items() if text
        )
        number = f'@bottom-right {{ content: counter(page) " of " counter(pages); {_SMALL} }}'
        return f"@page {{\n{boxes}{number}\n}}\n"

    def write(self, file: str | Path) -> None:
        """Write the page, whole or not at all.

        Raises:
            OutputError: if it cannot be written.
        """
        with replacing(file) as part:
            part.write_text(self.html(), encoding="utf-8", newline="\n")


def fragment(blocks: Iterable[Block]) -> Markup:
    """Blocks as a page shows them, for a page that is open."""
    show = environment().get_template("blocks.html").module
    return Markup(show.blocks(list(blocks), {name: getattr(show, name) for name in dir(show)}))


@cache
def environment() -> Any:
    """What fills the templates: text is escaped, markup is not."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(_TEMPLATES)
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.tests["verdict"] = lambda value: isinstance(value, Verdict)
    return environment


def _css_text(text: str) -> str:
    """Text as a string of a style sheet, which can end neither the string nor the sheet."""
    return '"' + "".join(c if (c.isascii() and c.isalnum()) or c == " " else f"\\{ord(c):x} " for c in text) + '"'


def _policy(scripts: Sequence[str], connect: str) -> str:
    """A Content-Security-Policy: no request to anywhere but what scripts may connect to, no script but these."""
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:; "
        f"base-uri 'none'; form-action 'none'{f'; connect-src {connect}' if connect else ''}"
    )


def _plotly() -> str:
    """The text of plotly.js, from the Python package, which is not imported: that takes long.

    Raises:
        EngineError: if the package is damaged.
    """
    package = find_spec("plotly")
    for folder in (package.submodule_search_locations or ()) if package else ():
        file = Path(folder) / "package_data" / "plotly.min.js"
        if file.is_file():
            return file.read_text(encoding="utf-8").replace("</script", "<\\/script")
    raise EngineError("the Python package plotly has no plotly.min.js: pip install --force-reinstall plotly")
