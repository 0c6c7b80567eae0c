"""A piecewise linear curve in a block: strokes up to infinity, values, and the slope behind each point.

A curve of n points takes 3 n + 2 places: the number n, the strokes and infinity behind them, the values, the slopes.
"""

from __future__ import annotations

from typing import Any

from numba.extending import register_jitable


@register_jitable
def segment(s: Any, curve: int, start: int, stroke: float) -> int:
    """The segment of a curve in which a stroke is, searched for from another one: a step moves it by one or two."""
    k, at = start, curve + 1
    while k > 0 and stroke < s[at + k]:
        k -= 1
    while stroke >= s[at + k + 1]:
        k += 1
    return k


@register_jitable
def value(s: Any, curve: int, k: int, stroke: float) -> float:
    """The value of a curve at a stroke in its segment k."""
    n, at = int(s[curve]), curve + 1
    return s[at + n + 1 + k] + s[at + 2 * n + 1 + k] * (stroke - s[at + k])


@register_jitable
def ahead(s: Any, curve: int, k: int) -> float:
    """The stroke at which segment k ends; infinite for the last one."""
    return s[curve + 2 + k]


@register_jitable
def area(s: Any, curve: int, stroke: float) -> float:
    """Area below a curve from 0 to a stroke."""
    found = 0.0
    n, at = int(s[curve]), curve + 1
    for k in range(n):
        low = s[at + k]
        high = min(stroke, s[at + k + 1])
        if high <= low:
            break
        found += (high - low) * (s[at + n + 1 + k] + 0.5 * s[at + 2 * n + 1 + k] * (high - low))
    return found
