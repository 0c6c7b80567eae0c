"""From a table of cases to a table of responses: the one bridge between scenarios and whatever studies them.

::

    scenario = trainmj.load("b_type")
    cases = pandas.DataFrame({"mass_t": [30, 33, 36], "empty_stroke_mm": [20, 35, 50]})
    table = trainmj.run_cases(scenario, cases)

Each case changes values of the scenario, by parameter or path. A case that breaks a rule or becomes unstable is a row
with its status and reason; the others go on.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from trainmj.cases.engine import Local, Row
from trainmj.collision.deceleration import FILTER_INTERVAL
from trainmj.collision.quantities import Column, ordered
from trainmj.errors import InputError, close_match
from trainmj.scenario import Scenario

if TYPE_CHECKING:
    import pandas as pd

STATUS = ("status", "reason")
"""Columns of every case, before its responses."""


def run_cases(
    scenario: Scenario, cases: pd.DataFrame, *, threads: int = 0, responses: Sequence[str] = ("*",)
) -> pd.DataFrame:
    """Compute every case of a table and return the table with its responses beside it.

    Args:
        scenario: what the cases vary.
        cases: a row for each case, a column for each parameter or path.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        responses: the columns wanted, as names or patterns such as ``"stroke_*"``.

    Returns:
        The columns of cases, then status, reason and responses, units in their names; the index of cases.
        ``table.attrs["columns"]`` says of each response by column name what it is, as a
        :class:`trainmj.collision.quantities.Column`.

    Raises:
        InputError: if a column is not a value of the scenario, or no response has a name asked for.
    """
    import pandas as pd

    check_columns(scenario, [str(c) for c in cases.columns])
    plain = (
        {str(k): _plain(v) for k, v in zip(cases.columns, row, strict=True)} for row in cases.itertuples(index=False)
    )
    rows: dict[int, Row] = {}
    columns: dict[str, Column] = {}
    for number, row, of_row in Local(scenario, threads)(enumerate(plain)):
        rows[number] = row
        columns |= of_row
    names = chosen([*STATUS, *(column.name for column in ordered(columns.values()))], responses)
    found = pd.DataFrame([rows[i] for i in range(len(cases))], index=cases.index, columns=names)
    table = pd.concat([cases, found], axis=1)
    table.attrs["columns"] = {name: columns[name] for name in names if name in columns}
    return table


def chosen(names: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """The names that patterns choose, in their own order; status and reason always.

    Raises:
        InputError: if a pattern chooses none.
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise InputError(f"responses: no response is called {pattern!r}{close_match(pattern, names)}")
    return [n for n in names if n in STATUS or any(fnmatchcase(n, p) for p in patterns)]


def check_columns(scenario: Scenario, columns: Sequence[str]) -> None:
    """Refuse a column that is no value of the scenario, before any case runs.

    Raises:
        InputError: naming the column.
    """
    for name in columns:
        scenario.locate(name)


def no_number(name: str, scenario: Scenario) -> str:
    """What is said of a response that is NaN: only the channel filter needs records that are close to each other."""
    longest = int(1e4 * FILTER_INTERVAL) / 10
    every = scenario.simulation.record_every_ms
    return f"{name} is not a number with simulation.record_every_ms = {every:g}: take at most {longest:g}"


def _plain(value: Any) -> Any:
    """A cell of a table as a plain Python value."""
    return value.item() if hasattr(value, "item") else value
