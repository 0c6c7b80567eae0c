"""What is said about the paper: a defect of its own, or a law that it states, each with its numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

Shown = tuple[bool | np.bool, *tuple[str, ...]]
"""Whether the printed numbers show the defect, and sentences that say how."""

Show = Callable[[], Shown]


@dataclass(frozen=True)
class Defect:
    """One thing in the paper that is inconsistent."""

    title: str  # what is wrong, in one line
    where: str  # tables, equations or sections
    arithmetic: tuple[str, ...]  # sentences with the numbers that show it
    stands: bool  # whether the printed numbers show it; false if the copies of the tables were corrected


@dataclass(frozen=True)
class Defects:
    """Defects in the order of the code; iterating over them does their arithmetic."""

    _shown: list[tuple[str, str, Show]] = field(default_factory=list)

    def __call__(self, title: str, where: str) -> Callable[[Show], Show]:
        """Add the defect that the decorated function shows."""

        def added(show: Show) -> Show:
            self._shown.append((title, where, show))
            return show

        return added

    def __iter__(self) -> Iterator[Defect]:
        """Each defect with its arithmetic."""
        for title, where, show in self._shown:
            stands, *arithmetic = show()
            yield Defect(title, where, tuple(arithmetic), bool(stands))


@dataclass(frozen=True)
class Law:
    """One law that the paper states in words."""

    section: str  # where
    statement: str  # the law
    published: str = field(default="", kw_only=True)  # the paper's number; empty if it gives none
    ours: str  # our number
    holds: bool  # whether it holds on our results
    judged: str = ""  # the rule by which that was decided
    impossible: str = ""  # why it cannot hold, if it cannot, with the numbers that show it
