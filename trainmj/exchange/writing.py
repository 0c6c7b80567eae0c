"""How decks write: in t, mm, s and N, numbers in columns of a fixed width, plain text."""

from __future__ import annotations

import unicodedata

LENGTH = 1e3
"""mm in a metre."""

MASS = 1e-3
"""t in a kilogram."""

FORCE_PER_LENGTH = 1e-3
"""N/mm in a N/m."""

FORCE_PER_RATE = 1e-3
"""N s/mm in a N s/m."""


def fixed(value: float, width: int) -> str:
    """A number in a column of some width, at the right, with a blank before it and as many digits as that leaves.

    It always has a point or an exponent, as a reader of Fortran needs to take it for a real number.
    """
    for digits in range(min(width, 15), 0, -1):
        text = f"{value:.{digits}G}"
        mantissa, _, exponent = text.partition("E")
        if "." not in mantissa:
            mantissa += ".0" if not exponent else "."
        text = f"{mantissa}E{int(exponent):+d}" if exponent else mantissa
        if len(text) < width:
            return text.rjust(width)
    raise AssertionError(f"{value} in {width} columns")


def plain(text: str) -> str:
    """A text in one line of ASCII that no program takes for a keyword or a comment of its own."""
    spread = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return " ".join(spread.split()).lstrip("*$#/& ") or "untitled"
