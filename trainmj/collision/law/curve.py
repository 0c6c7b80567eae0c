"""A piecewise linear curve in a block: for each point its stroke, the value there and the slope behind it.

A curve of n points takes 3 n + 1 places; the last one is an infinite stroke.
"""

from __future__ import annotations

import math

from trainmj.collision.fields import Block
from trainmj.collision.jitable import inlined, jitable


@inlined
def segment(s: Block, curve: int, start: int, stroke: float) -> int:
    """The segment of a curve in which a stroke is, searched for from another one: a step moves it by one or two."""
    k = start
    while k > 0 and stroke < s[curve + 3 * k]:
        k -= 1
    while stroke >= s[curve + 3 * k + 3]:
        k += 1
    return k


@inlined
def follow(s: Block, curve: int, place: int, stroke: float) -> int:
    """The segment in which a stroke is, searched for from the one kept at a place in the block, and then kept there."""
    before = int(s[place])
    k = segment(s, curve, before, stroke)
    if k != before:
        s[place] = k
    return k


@inlined
def value(s: Block, curve: int, k: int, stroke: float) -> float:
    """The value of a curve at a stroke in its segment k."""
    at = curve + 3 * k
    return s[at + 1] + s[at + 2] * (stroke - s[at])


@jitable
def ahead(s: Block, curve: int, k: int) -> float:
    """The stroke at which segment k ends; infinite for the last one."""
    return s[curve + 3 * k + 3]


@jitable
def behind(s: Block, curve: int) -> int:
    """The place behind a curve."""
    while s[curve] != math.inf:
        curve += 3
    return curve + 1
