"""Channels of a test: from a table with a column for each, or from an ISO-MME folder; units are converted and said."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.comparison.sides import Series, Side, channel_name
from trainmj.errors import InputError, close_match
from trainmj.files import mme
from trainmj.files.tables import Table, first_of_no_number, read_beside
from trainmj.identification.data import parse_sum
from trainmj.units import KM_H, G, unit_of

TABLES = (".csv", ".txt", ".tsv", ".xlsx")
"""Endings of tables."""

_UNITS: dict[str, tuple[str, float]] = {
    "s": ("time", 1.0), "ms": ("time", 1e-3),
    "m": ("length", 1.0), "mm": ("length", 1e-3), "cm": ("length", 1e-2), "in": ("length", 0.0254),
    "ft": ("length", 0.3048),
    "m/s": ("speed", 1.0), "km/h": ("speed", KM_H), "mm/s": ("speed", 1e-3), "mph": ("speed", 0.44704),
    "m/s2": ("acceleration", 1.0), "g": ("acceleration", G),
    "N": ("force", 1.0), "kN": ("force", 1e3), "MN": ("force", 1e6), "lbf": ("force", 4.4482216152605),
    "kip": ("force", 4448.2216152605),
    "J": ("energy", 1.0), "kJ": ("energy", 1e3), "MJ": ("energy", 1e6),
    "rad": ("angle", 1.0), "mrad": ("angle", 1e-3),
}  # fmt: skip
"""What a unit measures, and its size in SI."""

_SPELT = {"-": "", "1": "", "m/(s*s)": "m/s2", "m/s^2": "m/s2", "m/s²": "m/s2", "kph": "km/h"}
_ENDS = {unit.replace("/", "_per_"): unit for unit in _UNITS} | {"km_h": "km/h"}
_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(]\s*([^\[\]]*?)\s*[\])]\s*")
_TIMES = ("time", "t")
_SIGNED = re.compile(r"\s*(?P<sign>[+-]?)\s*(?:(?P<factor>[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*\*\s*)?(?P<name>\S.*?)\s*")
_VALID = "valid"  # the column of histories.csv that is 0 where a row is not
_FEWEST = 2  # values of a channel


@dataclass(frozen=True)
class _Columns:
    """What a test has: numbers by head."""

    said: str  # begins a message
    series: Mapping[str, tuple[Array, Array]]  # times [s] and values, nan where there is none
    units: Mapping[str, str]  # empty where a head states none
    names: Mapping[str, str]  # of the channel that a head seems to be, without the unit

    def made(self, text: str, unit: str) -> tuple[Array, Array, str]:
        """Times, values in a unit, and how they were made of columns."""
        terms = _terms(text, self.series)
        head, factor = next(iter(terms.items()))
        if text.strip().lstrip("+- ") == head:  # no factor is stated
            times, values = self.series[head]
            size, how = _converted(head, self.units[head], unit)
            return times, factor * size * values, f"{text}, {how}" if how else text
        times = self.series[head][0]
        if any(not np.array_equal(self.series[other][0], times) for other in terms):
            raise InputError(f"{text}: its channels are not at the same times")
        total = np.sum([part * self.series[other][1] for other, part in terms.items()], axis=0)
        return times, total, f"{text}, taken as {unit or 'a plain number'}"


def of_test(given: Any, name: str, known: Collection[str], chosen: Mapping[str, str], time: str | None) -> Side:
    """The channels of a test.

    Args:
        given: path of a table or of an ISO-MME folder, or a pandas table.
        name: of the test in words.
        known: names of the channels that the other side has.
        chosen: column of a channel, or a sum such as ``-a_front`` or ``3.6 * v``, by the name of the channel.
        time: column of times, or a sum; by default the one called time.

    Raises:
        InputError: naming file, column and rule.
    """
    columns = _read(given, name, time)
    found: dict[str, Series] = {}
    taken: set[str] = set()
    wanted = {_known(key, known): text for key, text in chosen.items()}
    own: dict[str, str] = {}
    for head, base in columns.names.items():
        key = _named(base, known)
        if key in own and key not in wanted:
            raise InputError(f"{columns.said}: {own[key]!r} and {head!r} are both {key}: say which with --channel")
        if key:
            own[key] = head
    for key, text in (own | wanted).items():
        try:
            times, values, origin = columns.made(text, unit_of(key))
            found[key] = Series(*_whole(times, values), unit_of(key), origin)
        except InputError as error:
            raise InputError(f"{columns.said}: {key} = {text[:80]}: {error}") from None
        taken |= set(_terms(text, columns.series))
    if not found:
        there, heads = ", ".join(list(known)[:6]), ", ".join(list(columns.series)[:8])
        raise InputError(
            f"{columns.said}: no column is called like a channel: say which is which with --channel "
            f"{next(iter(known))}=COLUMN. Channels: {there} and so on; columns: {heads}"
        )
    return Side(name, found, None, tuple(head for head in columns.series if head not in taken))


def _known(key: str, known: Collection[str]) -> str:
    name = channel_name(key)
    if name not in known:
        raise InputError(f"--channel {key}: the result has no such channel{close_match(name, known)}")
    return name


def _named(base: str, known: Collection[str]) -> str:
    """The channel that a head without its unit seems to be; empty if there is none."""
    plain = channel_name(base)
    return next((key for key in known if key == plain or _without_unit(key) == plain), "")


def _without_unit(key: str) -> str:
    return _split(key)[0]


def _split(head: str) -> tuple[str, str]:
    """A head without its unit, and the unit: ``v_M1`` and ``m/s`` of ``v_M1_m_per_s`` and of ``v_M1 [m/s]``."""
    match = _BRACKETS.fullmatch(head)
    if match:
        return match[1], _SPELT.get(match[2], match[2])
    ends = [end for end in _ENDS if head.endswith(f"_{end}") and not head.endswith(f"_per_{end}")]
    end = max(ends, key=len, default="")
    return (head.removesuffix(f"_{end}"), _ENDS[end]) if end else (head, "")


def _converted(head: str, unit: str, wanted: str) -> tuple[float, str]:
    """By what values are multiplied to be in a wanted unit, and what was done, in words."""
    if unit == wanted:
        return 1.0, ""
    if not unit:
        return 1.0, f"taken as {wanted or 'a plain number'}"
    if unit not in _UNITS or wanted not in _UNITS or _UNITS[unit][0] != _UNITS[wanted][0]:
        raise InputError(
            f"the column {head[:60]!r} is in {unit[:20]!r}, which cannot be turned into {wanted!r}: "
            "if it is not, state a factor, as in '1 * NAME'"
        )
    return _UNITS[unit][1] / _UNITS[wanted][1], f"{unit} turned into {wanted}"


def _terms(text: str, heads: Collection[str]) -> dict[str, float]:
    """The factors of columns in a sum; a head of any letters may stand alone, with a sign and a factor."""
    match = _SIGNED.fullmatch(text)
    if match and match["name"] in heads:
        return {match["name"]: (-1.0 if match["sign"] == "-" else 1.0) * float(match["factor"] or 1.0)}
    return parse_sum(text, heads)


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


def _read(given: Any, name: str, time: str | None) -> _Columns:
    if isinstance(given, Path):
        file = mme.find(given)
        return _of_folder(file, time) if file else _of_table(_table(given), f"{given}", time)
    frame = Table(Path(name), {str(head): given[head].tolist() for head in given.columns}, range(2, len(given) + 2))
    return _of_table(frame, name, time)


def _table(file: Path) -> Table:
    if not file.is_file():
        raise InputError(f"{file}: there is no such file")
    return read_beside(file.parent, file.name, str(file))


def _of_table(table: Table, said: str, time: str | None) -> _Columns:
    there = [head for head, cells in table.columns.items() if first_of_no_number(cells) is None]
    numbers = {head: _numbers(table, head) for head in there}
    units = {head: _split(head)[1] for head in numbers}
    try:
        clock = time or next((head for head in numbers if _split(head)[0].lower() in _TIMES), "")
        if not clock:
            raise InputError("no column is called time: name it with --time COLUMN")
        of_times = _Columns(said, {head: (values, values) for head, values in numbers.items()}, units, {})
        _, times, _ = of_times.made(clock, "s")
    except InputError as error:
        raise InputError(f"{said}: {f'--time {time}: ' if time else ''}{error}") from None
    if not np.isfinite(times).all():
        row = int(np.flatnonzero(~np.isfinite(times))[0])
        raise InputError(f"{said}: line {table.lines[row]}: has no time")
    if (back := np.flatnonzero(np.diff(times) <= 0.0)).size:
        row = int(back[0]) + 1
        rule = f"{times[row]:.9g} s does not come after {times[row - 1]:.9g} s"
        raise InputError(f"{said}: line {table.lines[row]}: times must increase: {rule}")
    if _VALID in numbers:  # as trainmj marks rows
        numbers = {head: np.where(numbers[_VALID] == 0.0, np.nan, values) for head, values in numbers.items()}
    clocks = [*_terms(clock, numbers), _VALID]
    series = {head: (times, values) for head, values in numbers.items() if head not in clocks}
    return _Columns(said, series, units, {head: _split(head)[0] for head in series})


def _numbers(table: Table, head: str) -> Array:
    return np.array([np.nan if cell == "" else cell for cell in table.columns[head]], dtype=np.float64)


def _of_folder(file: Path, time: str | None) -> _Columns:
    if time is not None:
        raise InputError(f"--time {time}: the channels of {file} state their times")
    series: dict[str, tuple[Array, Array]] = {}
    units: dict[str, str] = {}
    names: dict[str, str] = {}
    for channel in mme.read(file):
        if channel.code in series:
            raise InputError(f"{file}: has two channels {channel.code}")
        if (np.diff(channel.time) <= 0.0).any():
            raise InputError(f"{file}: {channel.code}: times must increase")
        series[channel.code] = channel.time, channel.values
        units[channel.code] = _SPELT.get(channel.unit, channel.unit)
        names[channel.code] = channel.own
    return _Columns(str(file), series, units, names)
