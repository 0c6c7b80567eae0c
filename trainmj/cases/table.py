"""From a table of cases to a table of responses: the one bridge between scenarios and whatever studies them.

::

    scenario = trainmj.load("b_type")
    cases = pandas.DataFrame({"mass_t": [30, 33, 36], "empty_stroke_mm": [20, 35, 50]})
    table = trainmj.run_cases(scenario, cases)

Each case changes values of the scenario, by parameter or path. A case that breaks a rule or becomes unstable is a row
with its status and reason; the others go on.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.cases.effect import idle, refuse
from trainmj.cases.engine import Local
from trainmj.cases.rows import STATUS, Rows
from trainmj.collision.cases import Cases
from trainmj.collision.quantities import Column, Columns, matching, ordered
from trainmj.errors import InputError
from trainmj.files.arguments import listed
from trainmj.scenario import Scenario, scenario_given

if TYPE_CHECKING:
    import pandas as pd


def run_cases(
    scenario: Scenario | str | Path,
    cases: pd.DataFrame | Mapping[str, Any] | Sequence[Mapping[str, Any]],
    *,
    threads: int = 0,
    responses: Sequence[str] = ("*",),
) -> pd.DataFrame:
    """Compute every case of a table and return the table with its responses beside it.

    Args:
        scenario: what the cases vary, or the path of its file.
        cases: a row for each case, a column for each parameter or path: a table, lists by column, or a list of dicts.
            A case with an empty cell is refused.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        responses: the columns wanted, as names or patterns such as ``"stroke_*"``.

    Returns:
        The columns of cases, then status, reason and responses, units in their names; the index of cases.
        ``table.attrs["columns"]`` says of each response by column name what it is, as a
        :class:`trainmj.collision.quantities.Column`.

    Raises:
        InputError: if a column is not a value of the scenario, two columns set the same one, or no response has a name
            asked for.
        TypeError: if the scenario or the cases are something else.
    """
    import pandas as pd

    scenario, cases = scenario_given(scenario), _table(cases)
    if pair := scenario.twice(map(str, cases.columns)):  # refuses a name before any case runs
        raise InputError(f"cases: {pair[0]} and {pair[1]} set the same value: leave one of them out")
    found: list[Rows] = []
    columns: dict[str, Column] = {}
    lists = (cases.iloc[:, k].tolist() for k in range(cases.shape[1]))  # plain Python values
    values = [[math.nan if value is None else value for value in plain] for plain in lists]
    if len(cases):
        refuse(idle([scenario], [dict(zip(map(str, cases.columns), values, strict=True))]))
    made = Cases(range(len(cases)), [(str(name),) for name in cases.columns], values)
    for some in Local(scenario, threads)([made]):
        found.append(some)
        columns |= some.columns
    names = chosen(responses, {column.name: column for column in ordered(columns.values())})
    wanted = {name: columns[name] for name in names if name in columns}
    table = pd.concat([cases, _as_table(found, len(cases), list(wanted)).set_index(cases.index)], axis=1)
    table.attrs["columns"] = Columns(wanted)
    return table


def _as_table(found: Sequence[Rows], n: int, names: Sequence[str]) -> pd.DataFrame:
    """Status, reason and some responses of n cases in the order of their keys, from 0."""
    import pandas as pd

    texts: dict[str, list[Any]] = {name: [None] * n for name in STATUS}
    numbers = np.full((n, len(names)), math.nan)
    for some in found:
        for name, column in texts.items():
            for key, text in zip(some.keys, some.facts[name], strict=True):
                column[key] = text
        places = {name: k for k, name in enumerate(some.columns)}
        to = [k for k, name in enumerate(names) if name in places]
        if to:
            numbers[np.ix_(some.keys, to)] = some.numbers[:, [places[names[k]] for k in to]]
    return pd.DataFrame(texts).join(pd.DataFrame(numbers, columns=list(names)))


def _table(cases: Any) -> pd.DataFrame:
    """Cases as a table, from one, from lists by column, or from a list of dicts."""
    import pandas as pd

    if isinstance(cases, pd.DataFrame):
        return cases
    if isinstance(cases, Mapping):
        lists = {k: v for k, v in cases.items() if isinstance(v, Sized) and not isinstance(v, (str, Mapping))}
        if len({len(values) for values in lists.values()}) > 1:
            said = ", ".join(f"{name} {len(values)}" for name, values in lists.items())
            raise InputError(f"cases: needs lists of equal length; these have {said}")
        return pd.DataFrame(dict(cases) if lists else [cases])
    rows = list(cases) if isinstance(cases, Iterable) and not isinstance(cases, str) else [cases]
    if not all(isinstance(row, Mapping) for row in rows):
        kind = type(cases).__name__
        raise TypeError(f"needs a pandas table, lists by column in a dict, or a list of dicts, not {kind}")
    return pd.DataFrame(rows)


def chosen(patterns: Sequence[str], columns: Mapping[str, Column]) -> list[str]:
    """Status and reason, then the responses that names or patterns choose; no responses if every case was refused."""
    asked = [pattern for pattern in listed(patterns) if pattern not in STATUS]
    return [*STATUS, *(matching(asked, columns) if columns else ())]
