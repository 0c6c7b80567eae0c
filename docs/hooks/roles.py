"""Docstrings refer to names as :func:`run`; the site shows the name alone."""

from __future__ import annotations

import re
from typing import Any

_ROLE = re.compile(r":(?:func|class|meth|mod|attr|data):<code>~?([^<]*)</code>")


def on_page_content(text: str, **_: Any) -> str:
    """Remove the roles, and the second colon before code."""
    return _ROLE.sub(r"<code>\1</code>", text).replace("::</p>", ":</p>")
