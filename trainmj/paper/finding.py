"""What is said about the paper: a defect of its own, or a law that it states, each with its numbers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Defect:
    """One thing in the paper that does not hold together.

    Attributes:
        title: what is wrong, in a line.
        where: tables, equations or sections.
        arithmetic: sentences with the numbers that show it.
        stands: whether the printed numbers do show it; false if the copy of the tables were mended.
    """

    title: str
    where: str
    arithmetic: tuple[str, ...]
    stands: bool


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
    published: str
    ours: str
    holds: bool
    judged: str
