"""What is computed beside a collision in the vertical plane: the same with other ties, and what its ties can spare."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trainmj.collision.chain import Chain
from trainmj.collision.identity import identity
from trainmj.collision.margin import Margin
from trainmj.collision.result import Result
from trainmj.collision.saved import FILE
from trainmj.collision.status import PAST_LIMITS, UNUSABLE, Kind
from trainmj.collision.summary import Summary
from trainmj.files.sealed import unsealed
from trainmj.files.text import read_bytes
from trainmj.output.table import Table
from trainmj.single import tables_plane

SUMMARY = "summary.json"
"""The file of a run's folder that has all numbers, these among them."""

_MOST_BYTES = 100_000_000


@dataclass(frozen=True)
class Beside:
    """What is computed beside a collision.

    Attributes:
        bracket: a row for each of the ties, as of :func:`trainmj.collision.bracket.rows_of`; none if not asked for.
        margins: of the ties; None if not asked for.
    """

    bracket: tuple[Mapping[str, Any], ...] = ()
    margins: tuple[Margin, ...] | None = None

    def tables(self, chain: Chain) -> Iterator[Table]:
        """The tables of it, for terminal and page."""
        if self.bracket:
            yield tables_plane.bracket(chain, self.bracket)
        if self.margins is not None:
            yield tables_plane.margins(self.margins)

    def rows(self) -> dict[str, list[dict[str, Any]]]:
        """Plain values by name, as JSON and CSV have them."""
        found = {"bracket": [dict(row) for row in self.bracket]} if self.bracket else {}
        return found | ({} if self.margins is None else {"margins": [margin.as_dict() for margin in self.margins]})

    @property
    def worse(self) -> list[str]:
        """A sentence for each of the other ties with which a limit is passed, or numbers may not be used."""
        bad = [row for row in self.bracket if Kind(row["status"]) in (*PAST_LIMITS, *UNUSABLE)]
        return [f"With {row['ties']} ends: {tables_plane.ended(row)}." for row in bad if row["ties"] != "stated"]

    @property
    def past_limits(self) -> bool:
        """Whether with any of the ties a limit was passed, one vehicle overrode another, or it failed."""
        return any(Kind(row["status"]) in (*PAST_LIMITS, *UNUSABLE) for row in self.bracket)


def beside_of(file: Path, result: Result, own: Summary) -> Beside:
    """What the folder of a run has beside its result, with this summary; nothing for other results.

    Raises:
        ArithmeticError, LookupError, OSError, TypeError, ValueError: if a file there is not as it was written, or is of
            another result.
    """
    summary = file.with_name(SUMMARY)
    if file.name != FILE or not os.path.lexists(summary):
        return Beside()
    found = unsealed(read_bytes(summary, _MOST_BYTES))
    if result.versions == identity() and {**found, **own.as_dict()} != found:
        raise ValueError(f"is not the summary of {FILE}")
    rows = (
        {name: None if row[name] is None else kind(row[name]) for name, kind in _ROW.items()}
        for row in found.get("bracket", ())
    )
    return Beside(tuple(rows), tuple(map(_margin, found["margins"])) if "margins" in found else None)


def _margin(row: Mapping[str, Any]) -> Margin:
    factor = math.inf if row["factor"] is None else float(row["factor"])
    slips = float(row["slip_mm"]), float(row["slip_as_stated_mm"])
    return Margin(str(row["interface"]), factor, *slips, bool(row["tied"]), bool(row["valid"]))


_ROW: dict[str, Any] = {"ties": str, "status": Kind, "reason": str, "limits": int, "limits_kept": int}
_ROW |= dict.fromkeys(("valid_until_s", *tables_plane.BRACKETED), float)
"""What a row of a bracket has, and of which type each value is."""
