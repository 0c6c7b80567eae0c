"""From tables to observations: which value is wanted in which case of the scenario.

A table is a CSV file beside the targets file, or rows in the file itself. What is wanted may be a sum of its columns:
``TS_mm - stroke_M1_M2_mm + 0.5 * stroke_M2_M3_mm``. Channels of a test are a CSV file of one case, and each of their
samples is an observation.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.errors import InputError, close_match
from trainmj.files.heads import exactly, factor_between, unit_stated
from trainmj.files.numbers import LARGEST
from trainmj.files.spreadsheet import Flaw
from trainmj.files.tables import TablePlace, first_of_no_number, read_beside
from trainmj.files.text import is_formula
from trainmj.identification.file import MAX_VALUES, ChannelData, ChannelTarget, RowsData, TableData, TargetPart

Row = dict[str, Any]
Sum = dict[str, float]
"""Factor by name."""

_MOST = 50  # terms
_FEWEST = 4  # samples of a channel
_RULE = "must be a number, or empty where there is none"
_TERM = re.compile(r"\s*([+-]?)\s*(?:(\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*\*\s*)?([A-Za-z_][A-Za-z0-9_]*)\s*")


@dataclass(frozen=True)
class Observation:
    """A value that is wanted of a response in a case."""

    data: str  # name of the table it is from
    target: str  # name of the target
    case: Mapping[str, Any]  # values of the scenario, by parameter or path
    wanted: float  # in the unit of the response
    time: float | None = None  # that of the test [s], of a sample of a channel
    head: str = ""  # of the column that it is from, if that states a unit


def observations(
    name: str,
    part: TableData | RowsData | ChannelData,
    folder: Path,
    unit: Callable[[str], str | None] = lambda name: None,
) -> tuple[list[Observation], list[str]]:
    """The observations in one table of the targets file; empty cells are skipped, but not those of channels.

    Args:
        name: of the table.
        part: where it is, and which columns are what.
        folder: of the targets file.
        unit: of a value of the scenario, by parameter or path. Cases whose column states another one are converted.

    Returns:
        The observations, in the units of their columns, and what there is to know of how they were read.

    Raises:
        InputError: without the place in the targets file, which the caller adds.
    """
    if isinstance(part, ChannelData):
        return _samples(name, part, folder)
    given = _given(part, folder)
    rows = _chosen(part, given.rows)
    heads = set(rows[0]) if rows else set()
    for column in part.cases:
        if column not in heads:
            raise InputError(f"cases: there is no column {column!r}{close_match(column, heads)}")
    sums = {target: _sum(f"values.{target}", text, heads) for target, text in part.values.items()}
    numbers = [column for terms in sums.values() for column in terms]
    for columns, flaws in (([*part.where, *part.leave_out, *numbers], given.double), (numbers, given.words)):
        for column in columns:
            if column in flaws:
                raise InputError(flaws[column])
    found, notes, factors = [], [], {}
    for column, place in part.cases.items():
        factors[column], note = _factor(column, unit(place), place)
        notes += [f"{name}: {note}"] * bool(note)
    for n, row in enumerate(rows, start=1):
        case = {
            place: _in_unit(_value(row[column], f"row {n}: {column}"), factors[column])
            for column, place in part.cases.items()
        }
        for target, terms in sums.items():
            wanted = sum(factor * _number(row[column], f"row {n}: {column}") for column, factor in terms.items())
            if not math.isnan(wanted):
                found.append(Observation(name, target, {**part.set, **case}, wanted, head=_stating(terms)))
    if not found:
        raise InputError("has no values: every row is left out or empty")
    return found, notes


def _stating(terms: Sum) -> str:
    """The column of a sum whose unit is that of the sum; none if there is none, or numbers convert it."""
    units = {unit_stated(head) for head in terms}
    return next(iter(terms)) if len(units) == 1 and "" not in units and {*map(abs, terms.values())} == {1.0} else ""


def _factor(head: str, unit: str | None, name: str) -> tuple[Fraction, str]:
    """The factor from the unit that a head states to that of what it stands for, and a note if it is not 1."""
    stated = unit_stated(head)
    if not stated or unit is None or (not unit and head.isidentifier()):
        return Fraction(1), ""
    try:
        factor = factor_between(stated, unit, f"column {head!r}")
    except InputError:
        if head.isidentifier():  # the end of a name that looks like a unit
            return Fraction(1), ""
        raise
    return factor, f"{head!r} is {name}, multiplied by {float(factor):.12g}" if factor != 1 else ""


def _in_unit(value: Any, factor: Fraction) -> Any:
    return exactly(value, factor) if factor != 1 and _is_number(value) else value


def in_units(found: Sequence[Observation], units: Mapping[str, str]) -> tuple[list[Observation], list[str]]:
    """Observations in the units of their targets, by name, and notes on what was converted.

    Raises:
        InputError: if a column states a unit of something else than its target is.
    """
    factors = {(o.head, o.target): _factor(o.head, units.get(o.target), o.target) for o in found if o.head}
    made = [replace(o, wanted=exactly(o.wanted, factors[o.head, o.target][0])) if o.head else o for o in found]
    return made, [note for _, note in factors.values() if note]


def _sum(key: str, text: str, heads: Iterable[str]) -> Sum:
    try:
        return parse_sum(text, heads)
    except InputError as error:
        raise InputError(f"{key} = {text!r}: {error}") from None


def _samples(name: str, part: ChannelData, folder: Path) -> tuple[list[Observation], list[str]]:
    """The samples of channels, one channel after the other, and notes on how their times were read."""
    said = f"channels {_named_file(part.channels)[:200]!a}"
    table = read_beside(folder, part.channels, said)
    sums = {key: _sum(key, text, table.columns) for key, text in (("time", part.time), *_named(part.values))}
    try:
        columns = {head: np.array(table.numbers(head)) for terms in sums.values() for head in terms}
    except InputError as error:
        raise InputError(f"{said}: {error}") from None
    time, *values = (
        np.sum([factor * columns[head] for head, factor in terms.items()], axis=0) for terms in sums.values()
    )
    seconds, note = _factor(_stating(sums["time"]), "s", "time")
    time = np.array([exactly(float(t), seconds) for t in time])
    if (back := np.flatnonzero(np.diff(time) <= 0.0)).size:
        rows, head = (int(back[0]), int(back[0]) + 1), next(iter(sums["time"]))
        rule = f"times must increase: {time[rows[0]]:.9g} s comes before it"
        raise InputError(f"{said}: {table.said(rows[1], head)}: {rule}")
    first, last = part.between_s or (-math.inf, math.inf)
    used = np.flatnonzero((time >= first) & (time <= last))
    if used.size < _FEWEST:
        of_all = f"of its {time.size} times, from {time[0]:.6g} to {time[-1]:.6g} s, {used.size} are used"
        raise InputError(f"{said}: a channel needs {_FEWEST} times or more: {of_all}")
    if (n := used.size * len(values)) > MAX_VALUES:
        raise InputError(f"{said}: has {n} values, more than {MAX_VALUES}: leave samples out, or use fewer (between_s)")
    found = [
        Observation(name, target, part.set, float(wanted[k]), float(time[k]), _stating(sums[f"values.{target}"]))
        for target, wanted in zip(part.values, values, strict=True)
        for k in used
    ]
    return found, [f"{name}: {note}"] * bool(note)


def _named(values: Mapping[str, str]) -> list[tuple[str, str]]:
    return [(f"values.{target}", text) for target, text in values.items()]


def channels_of(found: Sequence[Observation]) -> dict[tuple[str, str], list[int]]:
    """The places of the samples of each channel among observations, by data and target."""
    channels: dict[tuple[str, str], list[int]] = {}
    for k, o in enumerate(found):
        if o.time is not None:
            channels.setdefault((o.data, o.target), []).append(k)
    return channels


def shares(found: Sequence[Observation], targets: Mapping[str, TargetPart | ChannelTarget]) -> list[float]:
    """As how many independent values each observation counts: one, but a channel counts as a whole."""
    result = [1.0] * len(found)
    for (_, target), places in channels_of(found).items():
        part = targets.get(target)
        if isinstance(part, ChannelTarget):
            share = part.share([found[k].time or 0.0 for k in places])
            for k in places:
                result[k] = share
    return result


@dataclass(frozen=True)
class _Given:
    """Rows as they were given, and columns that cannot be used, each with the reason."""

    rows: list[Row]
    words: Mapping[str, str] = field(default_factory=dict)  # not as numbers: some of their cells are none
    double: Mapping[str, str] = field(default_factory=dict)  # not at all: tables that are joined disagree


def _given(part: TableData | RowsData, folder: Path) -> _Given:
    if isinstance(part, RowsData):
        heads = list(dict.fromkeys(head for row in part.rows for head in row))
        return _Given([{head: row.get(head) for head in heads} for row in part.rows])
    first, *others = part.places
    given = _read(first, folder)
    for place in others:
        given = _joined(given, _read(place, folder), list(part.cases), _named_file(place))
    return given


def _named_file(place: str | TablePlace) -> str:
    return place if isinstance(place, str) else place.file


def _read(place: str | TablePlace, folder: Path) -> _Given:
    """Rows of a file beside the targets file."""
    said = f"table {_named_file(place)[:200]!a}"
    table = read_beside(folder, place, said)
    words = {head: first_of_no_number(cells) for head, cells in table.columns.items()}
    return _Given(
        [dict(zip(table.columns, row, strict=True)) for row in zip(*table.columns.values(), strict=True)],
        {head: f"{said}: {table.refusal(n, head, _RULE)}" for head, n in words.items() if n is not None},
    )


def _joined(one: _Given, other: _Given, by: Sequence[str], name: str) -> _Given:
    """Rows of two tables side by side, matched by the columns of the cases."""
    left, right = one.rows, other.rows
    missing = [column for column in by if not right or column not in right[0]]
    if missing:
        raise InputError(f"table {name!r}: has no column {missing[0]!r}, by which tables are joined")
    there: dict[tuple[Any, ...], Row] = {}
    for row in right:
        key = tuple(row[column] for column in by)
        if key in there:
            raise InputError(f"table {name!r}: has two rows for the case {_said(row, by)}: it cannot be joined")
        there[key] = row
    result, double = [], dict(one.double)
    for row in left:
        match = there.get(tuple(row[column] for column in by))
        if match is None:
            raise InputError(f"table {name!r}: has no row for the case {_said(row, by)}")
        for column in match.keys() & row.keys():
            both = match[column], row[column]
            if not _same(*both) and not all(map(_is_empty, both)):
                double[column] = f"table {name!r}: column {column!r} has other values in a table before it: rename one"
        result.append(match | row)
    return _Given(result, {**other.words, **one.words}, double)


def _said(row: Row, by: Sequence[str]) -> str:
    return ", ".join(f"{column} = {row[column]}" for column in by)


def _chosen(part: TableData | RowsData, rows: Sequence[Row]) -> list[Row]:
    """The rows that ``where`` and ``leave_out`` select."""
    heads = set(rows[0])
    for key, conditions in (("where", part.where), ("leave_out", part.leave_out)):
        for column, value in conditions.items():
            if column not in heads:
                raise InputError(f"{key}: there is no column {column!r}{close_match(column, heads)}")
            for single in value if isinstance(value, list) else [value]:
                if not any(_same(row[column], single) for row in rows):
                    raise InputError(f"{key}.{column}: no row has the value {single!r}")
    return [row for row in rows if _meets(row, part.where) and not (part.leave_out and _meets(row, part.leave_out))]


def _meets(row: Row, conditions: Mapping[str, Any]) -> bool:
    return all(
        any(_same(row[column], single) for single in (value if isinstance(value, list) else [value]))
        for column, value in conditions.items()
    )


def _same(cell: Any, value: Any) -> bool:
    if _is_number(cell) and _is_number(value):
        return math.isclose(cell, value, rel_tol=1e-12)
    return bool(cell == value)


def _is_number(cell: Any) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool) and abs(cell) <= LARGEST


def _is_empty(cell: Any) -> bool:
    return cell is None or cell == "" or cell != cell


def _value(cell: Any, said: str) -> Any:
    """A cell that sets a value of the scenario."""
    if _is_empty(cell):
        raise InputError(f"{said}: is empty; a case needs every value")
    if isinstance(cell, Flaw):
        raise InputError(f"{said} = {cell[:60]!a}: {cell.rule}")
    if isinstance(cell, str):
        if is_formula(cell):
            raise InputError(f"{said} = {cell[:60]!a}: must not begin like a spreadsheet formula")
    elif not isinstance(cell, bool) and not _is_number(cell):
        raise InputError(f"{said}: must be a number or text")
    return cell


def _number(cell: Any, said: str) -> float:
    """A cell with a value that is wanted; NaN if it is empty."""
    if _is_empty(cell):
        return math.nan
    if not _is_number(cell):
        raise InputError(f"{said} = {ascii(cell)[:60]}: {_RULE}")
    return float(cell)


def parse_sum(text: str, known: Iterable[str] | None = None) -> Sum:
    """The factors of a sum by name; text that is itself a known name, whatever its letters, stands for that.

    Without known names any will do.

    Raises:
        InputError: if it is not a sum, or a name is unknown.
    """
    names = None if known is None else set(known)
    if names is not None and text in names:
        return {text: 1.0}
    result: Sum = {}
    at = 0
    for n in range(_MOST):
        found = _TERM.match(text, at)
        if found is None or (n and not found[1]):
            raise InputError("must be a name, or a sum such as TS_mm - 2 * stroke_M1_M2_mm")
        sign, factor, name = found.groups()
        if names is not None and name not in names:
            raise InputError(f"there is no column {name!r}{close_match(name, names)}")
        result[name] = result.get(name, 0.0) + (-1.0 if sign == "-" else 1.0) * float(factor or 1.0)
        at = found.end()
        if at == len(text):
            if not all(result.values()):
                raise InputError(f"{next(k for k, factor in result.items() if not factor)} cancels out")
            return result
    raise InputError(f"must have at most {_MOST} terms")


def cases_of(found: Sequence[Observation]) -> tuple[list[Mapping[str, Any]], list[int]]:
    """The different cases of observations in the order of their first use, and the place of each observation's case."""
    keys = [tuple(sorted((name, repr(_plain(value))) for name, value in o.case.items())) for o in found]
    first: dict[tuple[tuple[str, str], ...], Mapping[str, Any]] = {}
    for key, o in zip(keys, found, strict=True):
        first.setdefault(key, o.case)
    place = {key: n for n, key in enumerate(first)}
    return list(first.values()), [place[key] for key in keys]


def _plain(value: Any) -> Any:
    """33 and 33.0 are one case."""
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
