"""The page that a session is looked at with: the sections of a report, beside the values that they follow from."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from trainmj.explore.session import Session, thinned
from trainmj.output.blocks import Section, as_json
from trainmj.output.page import Page
from trainmj.single.page import ANIMATED, subjects

_TEMPLATES = Path(__file__).resolve().parent / "templates"
_LIVE = Markup('<div class="fragment"></div><div class="plots"></div>')
_VARIANTS = Markup(
    '<p>Dashed in the plots: what is pinned. Rows that differ are tinted.</p><div id="compared" class="scroll" '
    'tabindex="0" role="region" aria-label="Variants"></div><button type="button" id="all-rows"></button>'
)


def html(session: Session, connect: str) -> str:
    """The whole page, with the scenario as it stands already computed.

    Args:
        session: that answers to it.
        connect: the addresses to which it may connect.

    Raises:
        InputError: if the scenario cannot be computed as it stands.
    """
    seen = session.computed({})
    shown = Markup(session.told(seen, {}).replace("<", "\\u003c"))
    scenario = seen.result.scenario
    markup, plotting, script, style = (
        (_TEMPLATES / name).read_text(encoding="utf-8")
        for name in ("explore.html", "lines.js", "explore.js", "explore.css")
    )
    live = Page(session.base.heading, scenario.subject, versions=seen.result.versions, style=style, connect=connect)
    values = Section("Values", "values")
    file = f"{session.name}_explored.yaml"
    data = Markup('{{"values":{},"file":{},"shown":{}}}').format(as_json(session.values), as_json(file), shown)
    values.raw(Markup(markup.replace("DATA", data)), plotting)
    live.sections.append(values)
    for title, add in subjects(thinned(seen.result), seen.summary).items():
        own = live.section(title)
        if title == ANIMATED:
            add(own)
            own.blocks = [block for block in own.blocks if block.script]
        own.raw(_LIVE)
        if title == ANIMATED:
            variants = Section("Variants", "variants")
            variants.raw(_VARIANTS)
            live.sections.append(variants)
    last = Section("About this page", "about")
    last.text(
        "Every picture is a collision that was computed anew, from the whole scenario and with the numbers of trainmj "
        "run. Only the newest values are computed: those that a slider passed in the meantime are not. Nothing is "
        "written to disk unless you save it, and the page is served to this machine only, until the command is stopped."
    )
    if scenario.bracket:
        last.text("The bracket of ties that the scenario asks for is not computed here: trainmj run shows it.")
    last.raw(Markup(""), script)
    live.sections.append(last)
    return live.html()
