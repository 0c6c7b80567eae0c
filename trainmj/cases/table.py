"""From a table of cases to a table of responses: the one bridge between scenarios and whatever studies them.

::

    scenario = trainmj.load("b_type")
    cases = pandas.DataFrame({"mass_t": [30, 33, 36], "empty_stroke_mm": [20, 35, 50]})
    table = trainmj.run_cases(scenario, cases)

Each case changes values of the scenario, by parameter or path. A case that breaks a rule or becomes unstable is a row
with its status and reason; the others go on.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from trainmj.collision.chain import Chain, line_up
from trainmj.collision.summary import Summary
from trainmj.errors import InputError, close_match
from trainmj.scenario import Scenario

if TYPE_CHECKING:
    import pandas as pd

Case = Mapping[str, Any]
"""New values by parameter or path."""

Row = dict[str, Any]
"""One case's responses by column name, its status first."""

Engine = Callable[[Iterable[tuple[int, Case]]], Iterator[tuple[int, Row]]]
"""Computes numbered cases; yields the row of each as it ends, in any order."""

REFUSED = "refused"

FAILED = (REFUSED, "unstable")
"""Statuses of cases whose responses are of no use."""

_VEHICLE = (
    "peak_device_acceleration_g",
    "peak_acceleration_g",
    "mean_deceleration_g",
    "mean_30ms_g",
    "mean_100ms_g",
    "cfc60_peak_g",
    "final_speed_km_h",
    "balance_time_s",
)


def run_cases(
    scenario: Scenario, cases: pd.DataFrame, threads: int = 0, responses: Sequence[str] = ("*",)
) -> pd.DataFrame:
    """Compute every case of a table and return the table with its responses beside it.

    Args:
        scenario: what the cases vary.
        cases: a row for each case, a column for each parameter or path.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        responses: the columns wanted, as names or patterns such as ``"stroke_*"``.

    Returns:
        The columns of cases, then status, reason and responses, units in their names; the index of cases.

    Raises:
        InputError: if a column is not a value of the scenario, or no response has a name asked for.
    """
    import pandas as pd

    check_columns(scenario, [str(c) for c in cases.columns])
    plain = (
        {str(k): _plain(v) for k, v in zip(cases.columns, row, strict=True)} for row in cases.itertuples(index=False)
    )
    rows: dict[int, Row] = dict(case_rows(scenario, enumerate(plain), threads))
    table = pd.DataFrame([rows[i] for i in range(len(cases))], index=cases.index)
    table = table[chosen(ordered(table.columns), responses)]
    return pd.concat([cases, table], axis=1)


def case_rows(scenario: Scenario, cases: Iterable[tuple[int, Case]], threads: int = 0) -> Iterator[tuple[int, Row]]:
    """Compute numbered cases as they come and yield the row of each as it ends, in no fixed order.

    Args:
        scenario: what the cases vary.
        cases: number and changes of each; taken as they are needed.
        threads: native threads; 0 for all cores.
    """
    from trainmj.collision.batch import run_chains  # takes MuJoCo and numba with it

    refused: deque[tuple[int, Row]] = deque()

    def prepared() -> Iterator[tuple[int, Chain]]:
        for number, changes in cases:
            try:
                chain = line_up(scenario.with_values(changes))
            except InputError as error:
                refused.append((number, {"status": REFUSED, "reason": str(error)}))
            else:
                yield number, chain

    for number, summary in run_chains(prepared(), threads):
        yield number, responses_of(summary)
        while refused:
            yield refused.popleft()
    yield from refused


def responses_of(summary: Summary) -> Row:
    """All responses of a collision in one row, units in the names: ``stroke_S1_M1_mm``, ``peak_device_M1_g``."""
    return summary.row()


def chosen(names: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """The names that patterns choose, in their own order; status and reason always.

    Raises:
        InputError: if a pattern chooses none.
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise InputError(f"responses: no response is called {pattern!r}{close_match(pattern, names)}")
    return [n for n in names if n in ("status", "reason") or any(fnmatchcase(n, p) for p in patterns)]


def ordered(names: Iterable[str]) -> list[str]:
    """Column names of responses in one order for all cases: the whole collision, interfaces, vehicles, front first."""
    return sorted(names, key=_place)


WHOLE = ("status", "reason", "TS_mm", "TAMA_g", "duration_s", "absorbed_kJ", "energy_error", "momentum_error")
"""Columns that belong to the whole collision."""

_PART = re.compile(r"_(?:(S1_M1|M1_wall)(_partner)?|([MS])(\d+)_[MS]\d+|([MS])(\d+))_")
_WHAT = ("stroke", "permanent", "force", "energy", *(name.rpartition("_")[0] for name in _VEHICLE))


def _place(name: str) -> tuple[int, str, int, int, str]:
    """Sort key of a column: what it belongs to, train, place in the train, kind."""
    if name in WHOLE:
        return 0, "", WHOLE.index(name), 0, name
    found = _PART.search(name)
    if found is None:
        return 3, "", 0, 0, name
    front, partner, train, number, own, place = found.groups()
    kind = next((k for k, what in enumerate(_WHAT) if name.startswith(what)), len(_WHAT))
    if not own and "_" in name[found.end() :]:
        kind = len(_WHAT)  # a stage, behind its whole device
    if front:
        return 1, "S" if partner else "M", 0, kind, name
    return (1, train, int(number), kind, name) if train else (2, own, int(place), kind, name)


def check_columns(scenario: Scenario, columns: Sequence[str]) -> None:
    """Refuse a column that is no value of the scenario, before any case runs.

    Raises:
        InputError: naming the column.
    """
    for name in columns:
        scenario.locate(name)


def _plain(value: Any) -> Any:
    """A cell of a table as a plain Python value."""
    return value.item() if hasattr(value, "item") else value
