"""What is said about the paper: a defect of its own, or a law that it states, each with its numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

Shown = tuple[bool, *tuple[str, ...]]
"""Whether the printed numbers do show a defect, and the sentences that say how."""


@dataclass(frozen=True)
class Defect:
    """One thing in the paper that is inconsistent.

    Attributes:
        title: what is wrong, in one line.
        where: tables, equations or sections.
        arithmetic: sentences with the numbers that show it.
        stands: whether the printed numbers do show it; false if the copy of the tables were mended.
    """

    title: str
    where: str
    arithmetic: tuple[str, ...]
    stands: bool


class Defects:
    """Defects, in the order in which their arithmetic is written down; going through them does it."""

    def __init__(self) -> None:
        """None so far."""
        self._shown: list[tuple[str, str, Callable[[], Shown]]] = []

    def __call__(self, title: str, where: str) -> Callable[[Callable[[], Shown]], Callable[[], Shown]]:
        """Add the defect that the decorated function shows.

        Args:
            title: what is wrong, in one line.
            where: tables, equations or sections.
        """

        def added(show: Callable[[], Shown]) -> Callable[[], Shown]:
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
    """One law that the paper states in words.

    Attributes:
        section: where.
        statement: the law.
        published: the paper's number; empty if it gives none.
        ours: our number.
        holds: whether it holds on our results.
        judged: the rule by which that was decided.
    """

    section: str
    statement: str
    published: str = field(default="", kw_only=True)
    ours: str
    holds: bool
    judged: str = ""
