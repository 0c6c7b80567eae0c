"""How a collision ended: a kind, where it happened, and what there is to say about it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """The ways in which a case can end; their values stand in tables and JSON."""

    OVER = "over"
    TIME_LIMIT = "time limit"
    NO_CONTACT = "no contact"
    CURVE_ENDED = "curve ended"
    EXHAUSTED = "stroke exhausted"
    LIMIT = "limit passed"
    UNSTABLE = "unstable"
    REFUSED = "refused"


MEANING = {
    Kind.OVER: "no device is pressed any more",
    Kind.TIME_LIMIT: "computed, but the collision was not over at the time limit",
    Kind.NO_CONTACT: "computed, but no device was pressed",
    Kind.CURVE_ENDED: "computed, but a curve ended behind which nothing is stated: what came later is not valid",
    Kind.EXHAUSTED: "computed, but a stroke limit was passed, or a car body gave way",
    Kind.LIMIT: "computed, but a limit that the scenario states was passed",
    Kind.UNSTABLE: "an energy balance is off, or a value is not finite",
    Kind.REFUSED: "the values break a rule, which the reason names",
}

FAILED = (Kind.REFUSED, Kind.UNSTABLE)
"""Kinds of cases whose responses are of no use."""

PAST_LIMITS = (Kind.CURVE_ENDED, Kind.EXHAUSTED, Kind.LIMIT)
"""Kinds of cases that a design does not pass."""


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
    def failed(self) -> bool:
        """Whether the responses are of no use."""
        return self.kind in FAILED

    @property
    def reason(self) -> str:
        """What stands beside the kind in a table."""
        return f"at {self.detail}" if self.where else self.detail

    def __str__(self) -> str:
        """Give the sentence that is printed."""
        if not self.detail:
            return self.kind.value
        return f"{self.kind.value}{' ' if self.where else ': '}{self.reason}"
