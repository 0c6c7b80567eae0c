"""Sums of named columns, as a person writes them: ``TS_mm - stroke_M1_M2_mm + 0.5 * stroke_M2_M3_mm``."""

from __future__ import annotations

import re
from collections.abc import Iterable

from trainmj.errors import InputError, close_match

Sum = dict[str, float]
"""Factor by name."""

_MOST = 50  # terms
_TERM = re.compile(r"\s*([+-]?)\s*(?:(\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*\*\s*)?([A-Za-z_][A-Za-z0-9_]*)\s*")


def parse_sum(text: str, known: Iterable[str] | None = None) -> Sum:
    """The factors of a sum by name; text that is itself a known name, whatever its letters, stands for that.

    Args:
        text: such as ``TS_mm - 2 * stroke_M1_M2_mm``.
        known: names that may be used; any if None.

    Raises:
        InputError: if it is not a sum, or a name is unknown.
    """
    names = None if known is None else set(known)
    if names is not None and text in names:
        return {text: 1.0}
    result: Sum = {}
    at = 0
    for n in range(_MOST):
        found = _TERM.match(text, at)
        if found is None or (n and not found[1]):
            raise InputError("must be a name, or a sum such as TS_mm - 2 * stroke_M1_M2_mm")
        sign, factor, name = found.groups()
        if names is not None and name not in names:
            raise InputError(f"there is no column {name!r}{close_match(name, names)}")
        result[name] = result.get(name, 0.0) + (-1.0 if sign == "-" else 1.0) * float(factor or 1.0)
        at = found.end()
        if at == len(text):
            return result
    raise InputError(f"must have at most {_MOST} terms")
