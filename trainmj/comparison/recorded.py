"""Channels of a test: from a table with a column for each, or from an ISO-MME folder; units are converted and said."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.comparison.sides import Series, Side, channel_name
from trainmj.errors import InputError, close_match
from trainmj.files import mme
from trainmj.files.heads import factor_between, read_heads, stem, unit_stated
from trainmj.files.tables import Table, TablePlace, first_of_no_number, read_beside
from trainmj.identification.data import parse_sum
from trainmj.units import unit_of

TABLES = (".csv", ".txt", ".tsv", ".xlsx", ".xlsm")
"""Endings of tables."""

_VALID = "valid"  # the column of histories.csv that is 0 where a row is not
_TIMES = re.compile(r"(time|t)([\s_(\[/,].*)?", re.IGNORECASE)
_SIGNED = re.compile(r"\s*(?P<sign>[+-]?)\s*(?:(?P<factor>[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*\*\s*)?(?P<name>\S.*?)\s*")
_FEWEST = 2  # values of a channel
_RULE = "must be a number, or empty where there is none"
_PLAIN_UNITS = {"m/(s*s)": "m/s2"}  # as laboratories write them


class Asked(NamedTuple):
    """What is said of a test beside its name."""

    channels: Mapping[str, str] = {}  # column of a channel, or a sum such as -a or 3.6 * v, by the name of the channel
    time: str | None = None  # column of times, or a sum; by default the one called time
    sheet: str | None = None  # of a workbook
    cells: str | None = None  # range of the sheet with the heads

    def __bool__(self) -> bool:
        """Whether anything is."""
        return any((self.channels, self.time, self.sheet, self.cells))


@dataclass(frozen=True)
class _Columns:
    """What a test has: numbers by head."""

    said: str  # begins a message
    series: Mapping[str, tuple[Array, Array]]  # times [s] and values, nan where there is none
    units: Mapping[str, str]  # empty where a head states none
    own: Mapping[str, str]  # head by the channel that it is called like
    written: Mapping[str, str] = field(default_factory=dict)  # heads as they are in the file, where they are others
    flaws: Mapping[str, str] = field(default_factory=dict)  # why a column cannot be used
    clock: str = ""  # how times were made; empty if channels state their own

    def made(self, text: str, unit: str) -> tuple[Array, Array, str]:
        """Times, values in a unit, and how they were made of columns."""
        terms = self.terms(text)
        head, factor = next(iter(terms.items()))
        bare = text.strip().lstrip("+- ")
        if bare in (head, self.written.get(head)):  # no factor is stated
            times, values = self.series[head]
            stated = self.units[head]
            size = _factor(head, stated, unit)
            how = f", taken as {unit or 'a plain number'}" if not stated and unit else ""
            how = f", {stated} turned into {unit}" if size != 1.0 else how
            shown = "-" * (factor < 0.0) + self.written.get(head, head)
            return times, factor * size * values, f"{shown}{how}"
        times = self.series[head][0]
        if any(not np.array_equal(self.series[other][0], times) for other in terms):
            raise InputError("its channels are not at the same times")
        total = np.sum([part * self.series[other][1] for other, part in terms.items()], axis=0)
        return times, total, f"{text}, taken as {unit or 'a plain number'}"

    def terms(self, text: str) -> dict[str, float]:
        """The factors of columns in a sum; a head of any letters may stand alone, with a sign and a factor."""
        heads = {head: head for head in (*self.series, *self.flaws)}
        heads |= {written: head for head, written in self.written.items()}
        match = _SIGNED.fullmatch(text)
        if text in heads:
            found = {heads[text]: 1.0}
        elif match and match["name"] in heads:
            found = {heads[match["name"]]: (-1.0 if match["sign"] == "-" else 1.0) * float(match["factor"] or 1.0)}
        else:
            found = parse_sum(text, heads.values())
        for head in found:
            if head in self.flaws:
                raise InputError(self.flaws[head])
        return found


def of_test(given: Any, name: str, known: Collection[str], asked: Asked) -> Side:
    """The channels of a test.

    Args:
        given: path of a table or of an ISO-MME folder, or a pandas table.
        name: of the test in words.
        known: names of the channels that the other side has.
        asked: which columns are which channels, and where they are.

    Raises:
        InputError: naming file, column and rule.
    """
    wanted = {_known(key, known): text for key, text in asked.channels.items()}
    columns = _read(given, name, known, asked)
    found: dict[str, Series] = {}
    taken: set[str] = set()
    for key, text in ({**columns.own, **wanted}).items():
        try:
            times, values, origin = columns.made(text, unit_of(key))
            head = columns.written.get(text, text)
            plain = key not in wanted and (channel_name(head) == key or unit_stated(head) == unit_of(key))
            found[key] = Series(*_whole(times, values), unit_of(key), "" if plain else origin)
            taken |= set(columns.terms(text))
        except InputError as error:
            raise InputError(f"{columns.said}: {key} = {text[:80]}: {error}") from None
    if not found:
        there, heads = ", ".join(list(known)[:6]), ", ".join(list(columns.series)[:8])
        raise InputError(
            f"{columns.said}: no column is called like a channel: say which is which with --channel "
            f"{next(iter(known))}=COLUMN. Channels: {there} and so on; columns: {heads}"
        )
    return Side(name, found, None, tuple(head for head in columns.series if head not in taken), columns.clock)


def _known(key: str, known: Collection[str]) -> str:
    name = channel_name(key)
    if name not in known:
        raise InputError(f"--channel {key}: the result has no such channel{close_match(name, known)}")
    return name


def _factor(head: str, stated: str, wanted: str) -> float:
    """By what values are multiplied to be in a wanted unit."""
    if not stated or stated == wanted:
        return 1.0
    try:
        return float(factor_between(_PLAIN_UNITS.get(stated, stated), wanted, f"column {head[:60]!r}"))
    except InputError as error:
        raise InputError(f"{error}; if its head means something else, state a factor, as in '1 * NAME'") from None


def _whole(times: Array, values: Array) -> tuple[Array, Array]:
    """A channel without the empty cells before and behind it."""
    there = np.flatnonzero(np.isfinite(values))
    if there.size < _FEWEST:
        raise InputError(f"has {there.size} values, and needs {_FEWEST} or more")
    part = slice(int(there[0]), int(there[-1]) + 1)
    if there.size < part.stop - part.start:
        empty = part.start + int(np.flatnonzero(~np.isfinite(values[part]))[0])
        raise InputError(f"has no value at {times[empty]:.6g} s, between others: nothing is made up there")
    return times[part], values[part]


def _read(given: Any, name: str, known: Collection[str], asked: Asked) -> _Columns:
    if not isinstance(given, Path):
        heads = [str(head) for head in given.columns]
        if double := [head for n, head in enumerate(heads) if head in heads[:n]]:
            raise InputError(f"{name}: has two columns {double[0][:60]!r}")
        cells, written = {}, {}
        for one, head in zip(read_heads(heads, [""] * len(heads), _unit(known), {}), heads, strict=True):
            column = given.iloc[:, heads.index(head)]
            values = (column if column.dtype.kind in "fiuO" else column.astype(str)).tolist()
            cells[one.name] = [value if one.factor == 1 else float(one.factor) * value for value in values]
            if one.name != head:
                written[one.name] = head, values
        table = Table(Path(name), cells, range(2, len(given) + 2), written=written)
        return _of_table(table, name, known, asked.time)
    file = mme.find(given)
    if file is None:
        if not given.is_file():
            raise InputError(f"{given}: there is no such file")
        file = given.resolve()  # a person may name a link
        place = TablePlace(file=file.name, sheet=asked.sheet, range=asked.cells)
        return _of_table(read_beside(file.parent, place, str(given), _unit(known)), str(given), known, asked.time)
    if asked.time or asked.sheet or asked.cells:
        raise InputError(f"{file}: its channels state their times, and are in files of their own: name no others")
    return _of_folder(file, known)


def _unit(known: Collection[str]) -> Callable[[str], str | None]:
    """The unit of each column that is called like a channel."""
    return lambda name: unit_of(channel_name(name)) if channel_name(name) in known else None


def _of_table(table: Table, said: str, known: Collection[str], time: str | None) -> _Columns:
    first = {head: first_of_no_number(cells) for head, cells in table.columns.items()}
    flaws = {head: str(table.refusal(row, head, _RULE)) for head, row in first.items() if row is not None}
    numbers = {head: _numbers(table, head) for head, row in first.items() if row is None}
    own = {channel_name(head): head for head in table.columns if channel_name(head) in known}
    units = {head: unit_of(channel_name(head)) if head in own.values() else unit_stated(head) for head in numbers}
    written = {head: table.written[head][0] for head in numbers if head in table.written}
    try:
        clock = time or next((head for head in numbers if _TIMES.fullmatch(head)), "")
        if not clock:
            raise InputError("no column is called time: name it with --time COLUMN")
        of_times = _Columns(said, {head: (values, values) for head, values in numbers.items()}, units, {}, {}, flaws)
        _, times, how = of_times.made(clock, "s")
        clocks = [*of_times.terms(clock), _VALID]
    except InputError as error:
        raise InputError(f"{said}: {f'--time {time}: ' if time else ''}{error}") from None
    if not np.isfinite(times).all():
        row = int(np.flatnonzero(~np.isfinite(times))[0])
        raise InputError(f"{said}: {table.place(row)}: has no time")
    if (back := np.flatnonzero(np.diff(times) <= 0.0)).size:
        row = int(back[0]) + 1
        rule = f"{times[row]:.9g} s does not come after {times[row - 1]:.9g} s"
        raise InputError(f"{said}: {table.place(row)}: times must increase: {rule}")
    if _VALID in numbers:  # as trainmj marks rows
        numbers = {head: np.where(numbers[_VALID] == 0.0, np.nan, values) for head, values in numbers.items()}
    series = {head: (times, values) for head, values in numbers.items() if head not in clocks}
    return _Columns(said, series, units, own, written, flaws, how)


def _numbers(table: Table, head: str) -> Array:
    return np.array([np.nan if cell == "" else cell for cell in table.columns[head]], dtype=np.float64)


def _of_folder(file: Path, known: Collection[str]) -> _Columns:
    series: dict[str, tuple[Array, Array]] = {}
    units: dict[str, str] = {}
    own: dict[str, str] = {}
    names = {stem(key): key for key in known}
    for channel in mme.read(file):
        if channel.code in series:
            raise InputError(f"{file}: has two channels {channel.code}")
        if (np.diff(channel.time) <= 0.0).any():
            raise InputError(f"{file}: {channel.code}: times must increase")
        series[channel.code] = channel.time, channel.values
        units[channel.code] = channel.unit
        key = names.get(channel_name(channel.own))
        if key in own:
            raise InputError(f"{file}: {own[key]} and {channel.code} both have the laboratory code {channel.own}")
        if key:
            own[key] = channel.code
    return _Columns(str(file), series, units, own)
