"""Turn equations into MathML while the site is built; browsers draw it without a script or a request."""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

_EQUATION = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', flags=re.DOTALL
)


def on_page_content(text: str, **_: Any) -> str:
    """Replace what arithmatex marked as LaTeX."""
    return _EQUATION.sub(_mathml, text)


def _mathml(match: re.Match[str]) -> str:
    block = match["tag"] == "div"
    made = convert(html.unescape(match["latex"]).strip(), display="block" if block else "inline")
    return f'<div class="equation">{made}</div>' if block else made
