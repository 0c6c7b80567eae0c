"""How a collision ended: a kind, where it happened, and what there is to say about it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """The ways in which a case can end; their values stand in tables and JSON."""

    OVER = "over"
    TIME_LIMIT = "time limit"
    NO_CONTACT = "no contact"
    CURVE_ENDED = "curve ended"
    OVERRIDE = "override"
    EXHAUSTED = "stroke exhausted"
    LIMIT = "limit passed"
    UNSTABLE = "unstable"
    REFUSED = "refused"


MEANING = {
    Kind.OVER: "no device is pressed any more",
    Kind.TIME_LIMIT: "computed, but the collision was not over at the time limit",
    Kind.NO_CONTACT: "computed, but no device was pressed",
    Kind.CURVE_ENDED: "computed, but a curve or a member of a body ended: what came later is not valid",
    Kind.OVERRIDE: "computed, but one face slid off the other, or pins met: what came later is not valid",
    Kind.EXHAUSTED: "computed, but a stroke limit was passed, or a car body gave way",
    Kind.LIMIT: "computed, but a limit that the scenario states was passed",
    Kind.UNSTABLE: "an energy balance is off, or a value is not finite",
    Kind.REFUSED: "the values break a rule, which the reason names",
}

FAILED = (Kind.REFUSED, Kind.UNSTABLE)
"""Kinds of cases that could not be computed."""

NOT_VALID = (Kind.CURVE_ENDED, Kind.OVERRIDE)
"""Kinds of cases that were computed, and whose numbers are not valid from some time on."""

UNUSABLE = (*FAILED, *NOT_VALID)
"""Kinds of cases from whose responses nothing may be concluded."""

PAST_LIMITS = (Kind.EXHAUSTED, Kind.LIMIT)
"""Kinds of cases with valid numbers that a design does not pass."""


COARSE = "coarse step"
"""How a reason begins to say that there are peaks for which the step may be too coarse."""

WHY_NOT_VALID = "a curve ended behind which nothing is stated, or one vehicle overrode another"
"""How numbers come to be not valid, in words."""


def not_valid(until: float) -> str:
    """What marks numbers that are valid up to a time [s]: "not valid after 0.213 s"; empty if all are (inf, nan)."""
    return f"not valid after {until:.4g} s" if math.isfinite(until) else ""


@dataclass(frozen=True)
class Status:
    """How a collision ended.

    Attributes:
        kind: of end.
        where: the interfaces, or stages of their devices, that the kind is about; empty for the whole collision.
        detail: the numbers or the rule behind it; empty if there is nothing to add.
    """

    kind: Kind
    where: tuple[str, ...] = ()
    detail: str = ""

    @property
    def unusable(self) -> bool:
        """Whether nothing may be concluded from the responses: it failed, or they are not valid."""
        return self.kind in UNUSABLE

    @property
    def reason(self) -> str:
        """What stands beside the kind in a table."""
        return f"at {self.detail}" if self.where else self.detail

    def __str__(self) -> str:
        """Give the sentence that is printed."""
        if not self.detail:
            return self.kind.value
        return f"{self.kind.value}{' ' if self.where else ': '}{self.reason}"
