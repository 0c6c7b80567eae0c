"""How the load cases of a sweep ended: which of them failed or passed a limit, which governs, and what passes in all.

With load cases each row says how much of each limit is used. A combination is what one row of each load case has in
common: the values that are varied.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.cases.rows import Rows
from trainmj.collision.limits import Limited
from trainmj.collision.quantities import Column as Response
from trainmj.collision.status import COARSE, FAILED, NOT_VALID, PAST_LIMITS, UNUSABLE, Kind
from trainmj.files.text import printable
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.sweep.plan import LOAD_CASE
from trainmj.units import against, beyond

if TYPE_CHECKING:
    import pandas as pd

USED = "limit_used"
"""The quantity of the columns that say how much of a limit is used."""

_MEANING = "how much of the limit is used where it is used most; blank if the numbers of the case may not be used"


@dataclass(frozen=True)
class Ending:
    """How the cases of one load case ended.

    Attributes:
        load_case: its name.
        title: what it is, in words.
        cases: how many are finished.
        failed: how many of them are refused or unstable.
        not_valid: how many have numbers that are not valid.
        past_limits: how many passed a limit, with valid numbers.
    """

    load_case: str
    title: str
    cases: int
    failed: int
    not_valid: int
    past_limits: int


@dataclass(frozen=True)
class Governing:
    """The case of a sweep that uses most of a limit, of those whose numbers may be used.

    Attributes:
        limit: in words.
        load_case: to which the case belongs.
        case: its number.
        used: how much of the limit it uses [%].
    """

    limit: str
    load_case: str
    case: int
    used: float

    @property
    def kept(self) -> bool:
        """Whether the limit is kept there, and so in every case."""
        return not beyond(self.used, 100.0)


@dataclass(frozen=True)
class Outcome:
    """How the load cases of a sweep ended.

    Attributes:
        endings: of each load case.
        governing: for each limit, in the order of the table.
        combinations: how many have been computed in every load case.
        passed: the first case of each of these that passes in every load case: it neither failed, nor is it not valid,
            nor past a limit.
    """

    endings: tuple[Ending, ...]
    governing: tuple[Governing, ...]
    combinations: int
    passed: tuple[int, ...]


def with_uses(rows: Rows) -> Rows:
    """Cases with how much of each limit they use [%], in columns of their own before those of the responses."""
    usable = rows.usable
    if not (rows.limits and usable.any()):
        return rows
    uses = {column.name: column for column in map(_column, rows.limits)}
    used = np.column_stack([limited.used for limited in rows.limits])
    used[~usable] = np.nan
    return replace(rows, columns={**uses, **rows.columns}, numbers=np.hstack([used, rows.numbers]))


def _column(limited: Limited) -> Response:
    place = (0, -1, int(not limited.of_scenario))  # before all responses
    return Response(f"percent_of_{limited.name}", "%", 1, f"limit of {limited.title}", _MEANING, USED, place)


def says_use(column: Response) -> bool:
    """Whether a column says how much of a limit is used."""
    return column.quantity == USED


def outcome_of(table: pd.DataFrame, titles: Mapping[str, str], planned: int) -> Outcome:
    """How the load cases ended.

    Args:
        table: of a sweep with load cases, as :func:`trainmj.read_table` gives it, finished or not; of its responses
            those are needed that say how much of a limit is used.
        titles: of the load cases by name, all of them.
        planned: how many cases the whole sweep has.
    """

    def ending(name: str) -> Ending:
        status = table["status"][table[LOAD_CASE] == name]
        counts = (int(status.isin(kinds).sum()) for kinds in (FAILED, NOT_VALID, PAST_LIMITS))
        return Ending(name, titles[name], len(status), *counts)

    governing = []
    for column in table.attrs["columns"].values():
        if says_use(column) and table[column.name].notna().any():
            case = table[column.name].idxmax()
            used = float(table[column.name][case])
            governing.append(Governing(column.title.removeprefix("limit of "), table[LOAD_CASE][case], int(case), used))
    passes = ~table["status"].isin((*UNUSABLE, *PAST_LIMITS))
    together = passes.groupby(table.index % (planned // len(titles))).agg(["size", "all"])
    together = together[together["size"] == len(titles)]
    passed = tuple(int(case) for case in together.index[together["all"]])
    return Outcome(tuple(map(ending, titles)), tuple(governing), len(together), passed)


def where_kept(table: pd.DataFrame, varied: Sequence[str], limits: Mapping[str, float]) -> Table | None:
    """From where to where cases pass no limit, over the value that is varied most, for each of the other values.

    Args:
        table: of a sweep, as :func:`trainmj.read_table` gives it, finished or not.
        varied: names of what is varied.
        limits: of the scenario, by quantity or column; those of columns are held beside what was found.

    Returns:
        A row for each range of neighbouring cases whose numbers may be used and that passed no limit; None if no
        numbers are varied, or not all of their combinations are there.
    """
    different = {name: table[name].nunique() for name in varied if name in table}
    numbers = [name for name in different if table[name].dtype.kind in "fiu" and different[name] > 1]
    if not numbers or math.prod(different.values()) != len(table):
        return None
    along = max(numbers, key=lambda name: different[name])
    others = [name for name in different if name != along and different[name] > 1]
    limited = [name for name in limits if name in table]
    kept = ~table["status"].isin((*UNUSABLE, *PAST_LIMITS))
    usable = ~table["status"].isin(UNUSABLE)
    rows: list[tuple[Any, ...]] = []
    for values, part in table.groupby(others, sort=False) if others else [((), table)]:
        part = part.sort_values(along)
        good, at = kept[part.index].tolist(), part[along].tolist()
        runs = [list(run) for of, run in groupby(range(len(at)), key=good.__getitem__) if of]
        for run in runs or [[]]:
            cases = part.iloc[run] if run else part[usable[part.index]]
            ends = [at[k] for k in (run[0] - 1, run[-1] + 1) if 0 <= k < len(at)] if run else []
            across = _from_to(cases[along]) if run else "nowhere"
            found = (_from_to(cases[name]) for name in limited)
            rows.append((*map(_said, values), across, len(run), ", ".join(map(_said, ends)) or "-", *found))
    more = len(rows) - _MOST_RANGES
    heads = [*worded(*others, along), Column("cases"), *worded("no longer at")]
    heads += worded(*(f"{name}, of {limits[name]:g}" for name in limited))
    note = "What is between two cases was not computed." + (f" And {more} more ranges." if more > 0 else "")
    return Table(heads, rows[:_MOST_RANGES], "Where limits are kept", note)


def _said(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float | int) else str(value)


def _from_to(values: pd.Series) -> str:
    """The least and the largest of some numbers."""
    ends = dict.fromkeys((_said(float(values.min())), _said(float(values.max()))))
    return " to ".join(ends) if values.notna().any() else "-"


_MOST_RANGES = 20  # that are listed


def tables_of(outcome: Outcome) -> list[Table]:
    """How each load case ended, and which one governs for each limit."""
    counts = [Column(name) for name in ("cases", "failed", "not valid", "past a limit")]
    titled = any(ending.title for ending in outcome.endings)
    heads = [*worded("Load case"), *(worded("what it is") if titled else ()), *counts]
    rows = [
        (e.load_case, *([e.title] if titled else ()), e.cases, e.failed, e.not_valid, e.past_limits)
        for e in outcome.endings
    ]
    tables = [Table(heads, rows)]
    if outcome.governing:
        heads = [*worded("Limit", "governed by"), Column("in case"), Column("used", "%"), *worded("verdict")]
        found = [(g.limit, g.load_case, g.case, against(g.used, 100.0, 1), judged(g.kept)) for g in outcome.governing]
        tables.append(Table(heads, found))
    return tables


def verdict(counts: Mapping[str, int], planned: int, first: str, outcome: Outcome | None) -> Verdict:
    """How many cases pass, what stops the others, and the first of them or, of load cases, which one governs.

    Args:
        counts: of finished cases, by their status.
        planned: how many cases the whole sweep has.
        first: what :func:`first_of` says of those that do not pass.
        outcome: of load cases; None if there are none.
    """
    n = sum(counts.values())
    found = {said: sum(counts.get(kind, 0) for kind in kinds) for said, kinds in _STOPPED.items()}
    stopped = [f"{count} {said}" for said, count in found.items() if count]
    said = "; ".join([f"{n - sum(found.values())} of {n} cases end within all limits", *stopped])
    if outcome is not None:
        said = f"{passing(outcome)}; {said}"
    if outcome is not None and outcome.governing:
        worst = max(outcome.governing, key=lambda one: one.used)
        said += f". Most is used of the limit of {worst.limit}: {against(worst.used, 100.0, 0)} % in case {worst.case}"
        said += f" of load case {worst.load_case}"
    elif first:
        said += f". The first: {first}"
    said += "." if n == planned else f". Unfinished: {n} of {planned} cases are computed."
    if n == sum(counts.get(kind, 0) for kind in (*UNUSABLE, *PAST_LIMITS)):
        return failed(said)
    return (warned if stopped or n < planned else passed)(said)


def say_coarse(count: int, cases: int) -> str:
    """That cases have peaks for which their step is coarse."""
    return f"{count} of {cases} cases have a {COARSE}, for the peaks in their reason: set a smaller simulation.step_ms"


def first_of(cases: Iterable[tuple[int, str, str]]) -> str:
    """The first of some cases in words, from their numbers, statuses and reasons; empty if there is none."""
    return next((printable(f"case {n}, {status}: {reason}") for n, status, reason in cases), "")


_STOPPED: dict[str, tuple[Kind, ...]] = {"failed": FAILED, "not valid": NOT_VALID, "past a limit": PAST_LIMITS}
_STOPPED |= {"cut off by the time limit": (Kind.TIME_LIMIT,), "without contact": (Kind.NO_CONTACT,)}


def passing(outcome: Outcome) -> str:
    """How many combinations pass in every load case."""
    if outcome.combinations == 1:
        return f"{'All' if outcome.passed else 'Not all'} load cases pass"
    return f"{len(outcome.passed)} of {outcome.combinations} combinations pass in every load case"
