"""From a table of cases to a table of responses: the one bridge between scenarios and whatever studies them.

::

    scenario = trainmj.load("b_type")
    cases = pandas.DataFrame({"mass_t": [30, 33, 36], "empty_stroke_mm": [20, 35, 50]})
    table = trainmj.run_cases(scenario, cases)

Each case changes values of the scenario, by parameter or path. A case that breaks a rule or becomes unstable is a row
with its status and reason; the others go on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from trainmj.cases.engine import Local, Row
from trainmj.collision.quantities import Column, matching, ordered
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

    for name in cases.columns:
        scenario.locate(str(name))  # refuses a name before any case runs
    rows: dict[int, Row] = {}
    columns: dict[str, Column] = {}
    records: Any = cases.rename(columns=str).to_dict("records")  # plain Python values
    for number, row, of_row in Local(scenario, threads)(enumerate(records)):
        rows[number] = row
        columns.update(of_row)
    names = chosen(responses, {column.name: column for column in ordered(columns.values())})
    found = pd.DataFrame([rows[i] for i in range(len(cases))], index=cases.index, columns=names)
    table = pd.concat([cases, found], axis=1)
    table.attrs["columns"] = {name: columns[name] for name in names if name in columns}
    return table


def chosen(patterns: Sequence[str], columns: Mapping[str, Column]) -> list[str]:
    """Status and reason, then the responses that names or patterns choose; no responses if every case was refused."""
    asked = [pattern for pattern in patterns if pattern not in STATUS]
    return [*STATUS, *(matching(asked, columns) if columns else ())]
