"""Numbers from outside: how they are written, and how large they may be. Tables and YAML share these rules."""

from __future__ import annotations

import re

LARGEST = 1e100  # sums and squares stay finite
_LONGEST = 100  # characters
_PLAIN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")

WRITTEN = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
"""Numbers in tables, with either decimal mark."""

GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[.,'’_\s][0-9]{3})+(?:[.,][0-9]*)?")
"""Numbers with marks between thousands."""


def read_number(text: str) -> int | float:
    """The number that a text writes in ASCII digits, with a decimal point or an exponent if it is not whole.

    Python reads more than people write on purpose: ``1_200``, ``nan``, digits of other scripts.

    Raises:
        ValueError: if it is written in another way, is longer than 100 characters, or is too large.
    """
    if len(text) > _LONGEST:
        raise ValueError(f"must be a number of at most {_LONGEST} characters")
    if not _PLAIN.fullmatch(text):
        raise ValueError("must be a number")
    number = int(text) if text.lstrip("+-").isdecimal() else float(text)
    if not abs(number) <= LARGEST:
        raise ValueError(f"must be a finite number of at most {LARGEST:g}")
    return number
