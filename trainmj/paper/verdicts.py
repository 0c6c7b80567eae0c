"""The verdicts: each item as published and as found, what was wanted of it, what was reached, and what can be."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from trainmj.collision.envelope import Array
from trainmj.paper import bars
from trainmj.paper.analysis import TERMS
from trainmj.paper.bars import FROM_PRINT, GROUPS, ITSELF, Item
from trainmj.paper.collisions import cases_of
from trainmj.paper.defects_of_study import rounding_reach
from trainmj.paper.floors import floor
from trainmj.paper.printed import MASS_T, published, rms, split_unit
from trainmj.paper.tables import OURS, RECOMPUTED, S08, Tables
from trainmj.units import against

_MEASURES: dict[str, Callable[[Array], float]] = {
    "rms": rms,
    "mean": lambda off: float(np.mean(off)),
    "each": lambda off: float(np.abs(off).max()),
    "largest": lambda off: float(off[np.argmax(np.abs(off))]),
}


@dataclass(frozen=True)
class Verdict:
    """One item of the comparison."""

    group: str  # one of GROUPS
    item: str  # what is compared
    published: str  # the printed value, or how many and in which range
    ours: str  # what stands against it, likewise
    deviation: float  # how far off it is: what was reached
    unit: str  # of deviation, bar and floor
    bar: float | None  # most that was wanted, stated before it was reached; None where nothing was
    floor: float | None = None  # what any law as smooth as ours must miss; None where it is not known
    s08: float | None = None  # the deviation with S08 as documented; None where it was not computed

    @property
    def met(self) -> bool | None:
        """Whether the deviation is within the bar; None without a bar."""
        return None if self.bar is None else bool(abs(self.deviation) <= self.bar)

    def said(self, value: float | None) -> str:
        """Deviation, bar or floor as it is read, with its unit and the digits that tell it from the bar."""
        if value is None:
            return "-"
        if self.unit == "values":
            return f"{value:.0f} differ" if value != 1 else "1 differs"
        digits = -2 if self.unit == "g" else -3
        return f"{f'{value:g}' if value == self.bar else against(value, self.bar, digits)} {self.unit}"

    @property
    def missed(self) -> str:
        """What was reached for what was wanted, in words: ``Table 9: TS, 0.704 % for 0.6 %``."""
        least = self.bar is not None and self.floor is not None and self.floor > self.bar
        floor = f", and no law as smooth as ours comes below {self.said(self.floor)}" if least else ""
        return f"{self.item}, {self.said(self.deviation)} for {self.said(self.bar)}{floor}"


def verdicts(tables: Tables) -> list[Verdict]:
    """All verdicts, in the order of GROUPS."""
    found = [*verdicts_of_collisions(tables), *verdicts_of_study(tables)]
    return sorted(found, key=lambda v: GROUPS.index(v.group))


def verdicts_of_collisions(tables: Tables) -> Iterator[Verdict]:
    """What needs no study: the relative changes that are printed, and our collisions against the printed ones."""
    changes = published("relative_changes")
    again = [tables[str(r.table)].changes(str(r.quantity))[0] for r in changes.itertuples()]
    off = _differ(changes["relative_change_percent"], again, 2)
    yield _counted("Relative changes, last rows of Tables 3 to 8", off, len(changes))
    for item in bars.ITEMS:
        yield judge(item, tables)


def judge(item: Item, tables: Tables) -> Verdict:
    """The verdict on one item."""
    each = [_values(item.tables, head, tables) for head in item.heads]
    printed, ours = (np.concatenate([values[k] for values in each]) for k in (1, 2))
    scale = 100 if item.relative else 1

    def deviation(found: Array) -> float:
        return scale * _MEASURES[item.measure](found / printed - 1 if item.relative else found - printed)

    s08 = None
    if all(S08 in tables[number].found for number in item.tables.split(",")[0].split()):
        s08 = deviation(np.concatenate([_values(item.tables, head, tables, S08)[2] for head in item.heads]))
    name = item.said + {"rms": ", rms", "mean": ", mean deviation"}.get(item.measure, "")
    unit = split_unit(item.heads[0])[1]
    if item.measure in ("mean", "each"):
        shown = f"{printed.size} values", "mean" if item.measure == "mean" else "largest deviation"
    else:
        shown = _range(printed, unit, item.digits, as_printed=True), _range(ours, unit, item.digits)
    floors = [floor(item.measure, *values, item.relative, unit == "g") for values in each]
    least = max((f for f in floors if f is not None), default=None)
    bar, least = (None if amount is None else scale * amount for amount in (item.bar, least))
    return Verdict(item.group, name, *shown, deviation(ours), "%" if item.relative else unit, bar, least, s08)


def _values(numbers: str, head: str, tables: Tables, source: str = OURS) -> tuple[Array, Array, Array]:
    """D and M (n, 2), published and found values (n,) of a quantity; 17 from two tables over D and M."""
    if numbers == bars.MEANS_OF_7:
        seven = tables["7"]
        means = seven.published.mean(axis=1).to_numpy()
        return np.array(cases_of(seven.keys)), means, tables["8"].pair(head, source)[1]
    first, *rest = (tables[n] for n in numbers.split())
    cases, (printed, ours) = np.array(cases_of(first.keys)), first.pair(head, source)
    if numbers == "13":  # of its two rows, the one by collision dynamics
        return cases[1:], printed[1:], ours[1:]
    for table in rest:
        once = table.keys["M_t"].to_numpy() != MASS_T
        more, our_more = table.pair(head, source)
        cases = np.concatenate([cases, np.array(cases_of(table.keys))[once]])
        printed, ours = np.append(printed, more[once]), np.append(ours, our_more[once])
    return cases, printed, ours


def _range(values: Array, unit: str, digits: int, as_printed: bool = False) -> str:
    """From which to which value, with so many decimals or those that are printed."""
    low, high = (f"{round(v, 5):.15g}" if as_printed else f"{v:.{digits}f}" for v in (values.min(), values.max()))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def verdicts_of_study(tables: Tables) -> Iterator[Verdict]:
    """Tables 10 to 13 from the printed Table 9: how many differ in a printed digit; and our surrogates."""
    ten, equations, thirteen = (tables[n] for n in ("10", "Eqs", "13"))
    printed, found = (t.to_numpy(dtype=float) for t in (ten.published, ten.found[RECOMPUTED]))
    cut = np.trunc(found * 1000) / 1000
    off = int(((np.round(found, 3) != printed) & (cut != printed)).sum())
    yield _counted("Table 10, rounded or, for one value, cut off", off, printed.size)
    # no further from the fit than the rounding of Table 9 and of the equation explains
    outside = np.abs(equations.deviation("TS_mm", RECOMPUTED)) > rounding_reach() + 0.0005
    yield _counted("Eq. (7), within the rounding of Table 9", int(outside.sum()), len(TERMS))
    digits = {"1": 3, "D": 3, "M": 3, "D^3": 8, "M^3": 4}
    rows = zip(equations.keys["term"], *equations.pair("TAMA_g", RECOMPUTED), strict=True)
    off = sum(_differ(printed, found, digits[term]) for term, printed, found in rows if term in digits)
    yield _counted("Eq. (8), the five terms not misprinted", off, len(digits))
    for number, places in (("11", 3), ("12", 5)):
        table = tables[number]
        off = sum(_differ(*table.pair(head, RECOMPUTED), places) for head in table.heads)
        yield _counted(f"Table {number}", off, table.published.size)
    for head in thirteen.heads:
        printed, found = (values[:1] for values in thirteen.pair(head, RECOMPUTED))
        yield _counted(f"Table 13, surrogate's {split_unit(head)[0]}", _differ(printed, found, 1), 1)
    for head, places in zip(thirteen.heads, (1, 4), strict=True):
        name, unit = split_unit(head)
        surrogate, simulated = (float(v) for v in thirteen.pair(head, OURS)[1])
        shown = f"{simulated:.{places}f} {unit}", f"{surrogate:.{places}f} {unit}"
        deviation = 100 * (surrogate / simulated - 1)
        yield Verdict(ITSELF, f"{name} at the paper's optimum", *shown, deviation, "%", 100 * bars.surrogate_bar(name))


def _counted(item: str, off: int, n: int) -> Verdict:
    return Verdict(FROM_PRINT, item, f"{n} value{'s' * (n > 1)}", f"{n - off} to the digit", off, "values", 0)


def _differ(printed: ArrayLike, found: ArrayLike, digits: int) -> int:
    """How many found values, rounded, are not the printed ones."""
    p, f = (np.asarray(v, dtype=np.float64) for v in (printed, found))
    return int((np.abs(np.round(f, digits) - p) > 1e-9).sum())
