"""Two results, or a result and a test, held against each other.

::

    found = trainmj.compare("results", "test.csv", channels={"force_S1_M1_kN": "load cell"})
    found.kept          # whether the rules that could be judged are
    found.to_frame()    # how far each channel differs
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.cases.origin import differing
from trainmj.collision.result import Result
from trainmj.collision.saved import find_result, load_result, result_given
from trainmj.collision.simulation import run
from trainmj.comparison.differences import Difference, best_offset, differences
from trainmj.comparison.recorded import TABLES, Asked, of_test
from trainmj.comparison.rules import Rule, rules
from trainmj.comparison.sides import Side, of_result
from trainmj.errors import InputError
from trainmj.files import mme
from trainmj.files.shown import Shown
from trainmj.files.written import finite
from trainmj.scenario import Scenario, shipped
from trainmj.units import MS

if TYPE_CHECKING:
    import pandas as pd

_MOST_SAID = 6  # differences between two scenarios, and names of channels


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """A result held against another one, or against a test.

    Attributes:
        a: the result.
        b: what it is held against: a result or a test. Percentages are of its values.
        offset_ms: by which the clock of b was put forward; 0 if it was not.
        aligned: whether that was sought.
        differences: of each channel that both have, by their clocks as they are.
        shifted: likewise with the clock of b put forward; empty if it was not.
        rules: what the validation of a model by EN 15227 speaks of, and what was found. No compliance is claimed.
    """

    a: Side
    b: Side
    offset_ms: float
    aligned: bool
    differences: tuple[Difference, ...]
    shifted: tuple[Difference, ...]
    rules: tuple[Rule, ...]

    @property
    def unusable(self) -> tuple[str, ...]:
        """Why the numbers of a result may not be used, if they may not."""
        return tuple(
            f"{letter} ({side.name}): {side.summary.status}"
            for letter, side in (("A", self.a), ("B", self.b))
            if side.summary is not None and side.summary.status.unusable
        )

    @property
    def kept(self) -> bool | None:
        """Whether all rules are kept that could be judged; None if none could, never if numbers may not be used."""
        judged = [rule.kept for rule in self.rules if rule.kept is not None]
        return False if self.unusable else all(judged) if judged else None

    def __repr__(self) -> str:
        """What is compared, and the verdict."""
        from trainmj.comparison.tables import verdict  # which is made of this

        channels = f"{len(self.differences)} channels"
        return f"<Comparison of {self.a.name} with {self.b.name}: {channels}. {verdict(self).text}>"

    def to_frame(self) -> pd.DataFrame:
        """A row for each channel that both have, and once more with a clock put forward: peaks, means, differences."""
        import pandas as pd

        return pd.DataFrame([one.as_row() for one in (*self.differences, *self.shifted)])

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj compare --json`` prints them; None for what is no number."""
        plain: dict[str, Any] = finite(
            {
                "a": self.a.name,
                "b": self.b.name,
                "kept": self.kept,
                "unusable": self.unusable,
                "offset_ms": self.offset_ms,
                "rules": [rule.as_dict() for rule in self.rules],
                "channels": [one.as_row() for one in (*self.differences, *self.shifted)],
                "remarks": self.remarks,
            }
        )
        return plain

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What there is to know: other scenarios, records and lengths; columns taken; channels left out."""
        return tuple(_remarks(self))


def compare(
    a: Result | Scenario | str | Path,
    b: Any,
    channels: Mapping[str, str] | None = None,
    time: str | None = None,
    align: bool = False,
    offset_ms: float = 0.0,
    sheet: str | None = None,
    cells: str | None = None,
) -> Comparison:
    """Hold a result against another one, or against a test.

    Args:
        a: a result, or the path of one or of its folder; a scenario, or its path or name, is computed.
        b: likewise; or the path of a table with a column for each channel, or of an ISO-MME folder; or a pandas table.
        channels: of a test: column, or a sum such as ``-a_front`` or ``3.6 * v``, by the name of the channel. Columns
            that are called like a channel need not be named.
        time: of a test: column of times, or a sum such as ``0.001 * t_ms``; by default the one called time.
        align: whether to seek the shift of the clock of b with which the two differ least; it is said, and differences
            without it are there too.
        offset_ms: a shift of the clock of b that is known: added to its times.
        sheet: of a workbook with a test; may be left out if only one has a table.
        cells: of a test on a sheet, its heads included: B3:F200; may be left out if the sheet has one table.

    Raises:
        InputError: if one cannot be read, or they have no channel in common.
        TypeError: if one is something else.
    """
    if align and offset_ms:
        raise InputError("the offset is either sought or stated")
    if not math.isfinite(offset_ms):
        raise InputError(f"offset_ms = {offset_ms}: must be a finite number of ms")
    if channels is not None and not isinstance(channels, Mapping):
        raise TypeError(f"channels: must be a dict of columns by channel, not {type(channels).__name__}")
    one = _result(a)
    first = of_result(_name(a, "A"), one)
    second = _second(b, first, Asked(channels or {}, time, sheet, cells))
    plain = tuple(differences(first, second))
    if not plain and not offset_ms:
        raise InputError(f"{first.name} and {second.name}: no channel is in both at the same time")
    offset = best_offset(first, second) if align else offset_ms
    moved = second.shifted(offset * MS) if offset else second
    shifted = tuple(differences(first, second, offset)) if offset else ()
    if offset and not shifted:
        raise InputError(f"{first.name} and {second.name}: no channel is in both at the same time with that offset")
    return Comparison(first, second, offset, align, plain, shifted, tuple(rules(first, moved)))


def _name(thing: Any, letter: str) -> str:
    if isinstance(thing, (str, PathLike)):
        return str(thing)
    scenario = thing.scenario if isinstance(thing, Result) else thing
    return getattr(scenario, "heading", "") or letter


def _result(thing: Any) -> Result:
    """A result, read or computed."""
    if isinstance(thing, Scenario):
        return run(thing)
    if not isinstance(thing, (str, PathLike)):
        return result_given(thing)
    path = Path(thing)
    if find_result(path) is not None:
        return load_result(path)
    if path.suffix.lower() == ".nc":
        return load_result(path)
    if is_test(path):
        raise InputError(f"{path}: is a test: the result comes first, as in trainmj compare RESULT {path.name}")
    if path.is_dir() and str(path) not in shipped():
        raise InputError(f"{path}: holds no result.nc, which trainmj run --out leaves")
    return run(path)


def is_test(path: Path) -> bool:
    """Whether a path leads to a table or an ISO-MME folder."""
    return path.suffix.lower() in TABLES or mme.find(path) is not None or path.suffix.lower() == ".mme"


def _second(b: Any, first: Side, asked: Asked) -> Side:
    import pandas as pd

    frame = isinstance(b, pd.DataFrame)
    if frame or (isinstance(b, (str, PathLike)) and find_result(Path(b)) is None and is_test(Path(b))):
        given, name = (b, "the table") if frame else (Path(b), str(b))
        return of_test(given, name, list(first.channels), asked)
    if asked:
        raise InputError(
            f"{_name(b, 'B')}: is a result, which has no columns to name: leave channel, time and sheet out"
        )
    return of_result(_name(b, "B"), _result(b))


def _remarks(found: Comparison) -> Iterator[str]:
    a, b = found.a, found.b
    if found.unusable:
        yield f"Numbers may not be used: {'; '.join(found.unusable)}. Channels end where they are no longer valid."
    if a.result is not None and b.result is not None:
        changed = list(differing(_of_collision(a.result.scenario), _of_collision(b.result.scenario)))
        said = [f"{path} {one} in A, {other} in B" for path, one, other in changed]
        if said:
            yield f"The scenarios differ: {_listed(said)}."
        steps = a.result.chain.record_interval / MS, b.result.chain.record_interval / MS
        if steps[0] != steps[1]:
            yield f"Records are {steps[0]:g} ms apart in A and {steps[1]:g} ms in B: values between are interpolated."
    compared = {one.channel for one in found.shifted or found.differences}
    windows: dict[str, list[str]] = {}
    for one in found.shifted or found.differences:
        if _cut(found, one.channel, one.from_s, one.to_s):
            windows.setdefault(f"from {one.from_s:.4g} to {one.to_s:.4g} s", []).append(one.channel)
    if windows:
        said = [f"{when} {_listed(names)}" for when, names in windows.items()]
        yield f"Compared only while both are there: {_listed(said)}. Nothing is extrapolated."
    if b.result is None:
        said = [f"{name} = {series.origin}" for name, series in b.channels.items() if series.origin]
        called = len(b.channels) - len(said)
        said += [f"{called} as their columns are called"] * bool(called) + [f"times = {b.clock}"] * bool(b.clock)
        yield f"Channels of the test: {'; '.join(said)}."
        if b.left_out:
            yield f"Columns of the test that were not used: {_listed(b.left_out)}."
    else:
        for letter, side, other in (("A", a, b), ("B", b, a)):
            alone = [name for name in side.channels if name not in other.channels]
            if alone:
                yield f"Only in {letter}: {_listed(alone)}."
    apart = [name for name in a.channels if name in b.channels and name not in compared]
    if apart:
        yield f"At no time in both: {_listed(apart)}."
    if found.offset_ms:
        how = "sought, as the shift with which the two differ least" if found.aligned else "as stated"
        yield f"The clock of B was put forward by {found.offset_ms:.6g} ms, {how}; rules are judged with it."


def _of_collision(scenario: Scenario) -> dict[str, Any]:
    """The values of a scenario without words about it."""
    return {key: value for key, value in scenario.counted().items() if key != "parameters"}


def _cut(found: Comparison, name: str, start: float, end: float) -> bool:
    """Whether a channel is compared for less time than one of both has it."""
    shift = found.offset_ms * MS
    spans = [(one.time[0] + by, one.time[-1] + by, one.interval)
             for one, by in ((found.a.channels[name], 0.0), (found.b.channels[name], shift))]  # fmt: skip
    slack = max(interval for *_, interval in spans)
    return any(start - first > slack or last - end > slack for first, last, _ in spans)


def _listed(names: Any) -> str:
    every = list(names)
    more = f" and {len(every) - _MOST_SAID} more" if len(every) > _MOST_SAID else ""
    return f"{', '.join(every[:_MOST_SAID])}{more}"
