"""A table, told once for page and terminal: columns with their units, rows, and verdicts among their cells."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from trainmj.units import enough

_SIGNS = {"pass": "✓", "fail": "✗", "warn": "!", "none": "–"}


@dataclass(frozen=True)
class Verdict:
    """How something stands: ``pass``, ``fail``, ``warn`` or ``none``, and in words.

    Make it with :func:`passed`, :func:`failed`, :func:`warned` or :func:`judged`.
    """

    kind: str
    text: str

    @property
    def sign(self) -> str:
        """What is read where colours are not seen."""
        return _SIGNS[self.kind]


def passed(text: str = "pass") -> Verdict:
    """A limit is kept, a check holds."""
    return Verdict("pass", text)


def failed(text: str = "fail") -> Verdict:
    """A limit is exceeded, a check does not hold."""
    return Verdict("fail", text)


def warned(text: str) -> Verdict:
    """Something to look at."""
    return Verdict("warn", text)


def judged(kept: bool | None, yes: str = "pass", no: str = "fail", unknown: str = "no limit") -> Verdict:
    """The verdict of a comparison; None if there is nothing to compare with."""
    return Verdict("none", unknown) if kept is None else passed(yes) if kept else failed(no)


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        name: in words, without the unit.
        unit: shown below the name.
        digits: decimals of its numbers, or a format such as "+.3g"; by default four significant digits.
        text: whether it holds words, set to the left; words may be broken into lines, numbers never are.
        head: the name on a terminal, where there is less room, its lines broken as given; by default the name, of a
            column of numbers one word a line.
    """

    name: str
    unit: str = ""
    digits: int | str = ".4g"
    text: bool = False
    head: str = ""

    def for_values(self, values: Iterable[Any]) -> Column:
        """The same with as many more decimals as it takes to read the largest of its values, if any are not whole."""
        numbers = [abs(v) for v in values if isinstance(v, float) and math.isfinite(v)]
        if isinstance(self.digits, str) or all(number.is_integer() for number in numbers):
            return self
        return replace(self, digits=enough(self.digits, max(numbers)))

    def show(self, value: Any) -> Any:
        """A cell as it is read: numbers rounded, a dash for None, NaN and infinity; anything else as it is."""
        if value is None:
            return "-"
        if not isinstance(value, float):
            return value
        form = f"z.{self.digits}f" if isinstance(self.digits, int) else self.digits
        return format(value, form) if math.isfinite(value) else "-"


def worded(*names: str) -> list[Column]:
    """Columns of words, one for each name."""
    return [Column(name, text=True) for name in names]


@dataclass(frozen=True)
class Table:
    """A table, for :meth:`trainmj.output.blocks.Section.table` or :func:`trainmj.output.console.print_table`.

    Attributes:
        columns: heads, units and digits.
        rows: one cell for each column: a number, text, None or a :class:`Verdict`.
        title: above it.
        note: below it.

    Raises:
        ValueError: if a row does not have one cell for each column.
    """

    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]]
    title: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """Check that every row fits the columns, and give these the decimals that small values need."""
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise ValueError(f"row {number} of the table has {len(row)} cells for {len(self.columns)} columns")
        cells = zip(*self.rows, strict=True) if self.rows else [()] * len(self.columns)
        columns = [column.for_values(values) for column, values in zip(self.columns, cells, strict=True)]
        object.__setattr__(self, "columns", columns)

    def marked(self, mark: str) -> Table:
        """The same with a mark beside its title, such as "not valid after 0.213 s"; itself where that is empty."""
        return replace(self, title=f"{self.title or self.columns[0].name}: {mark}") if mark else self
