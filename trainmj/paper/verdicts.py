"""The verdicts: each item of the paper that can be checked, published, ours, deviation, bar, agreement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from trainmj.collision.device import Array
from trainmj.paper import bars
from trainmj.paper.analysis import TERMS
from trainmj.paper.comparison import OURS, RECOMPUTED, Comparison
from trainmj.paper.defects_of_study import rounding_reach
from trainmj.paper.printed import MASS_T, published, split_unit

Tables = Mapping[str, Comparison]
"""Comparisons by the number of their table: ``"3"``, ``"10"``, ``"Eqs"``, ``"balance"``."""

FROM_PRINT, IDENTIFIED, HELD_OUT, ITSELF = (
    "from the paper's own numbers",
    "ours, tables that the devices were identified from",
    "ours, held out: never used to identify the devices",
    "our surrogates against our simulation",
)
GROUPS = (FROM_PRINT, IDENTIFIED, HELD_OUT, ITSELF)


@dataclass(frozen=True)
class Verdict:
    """One item of the comparison.

    Attributes:
        group: one of GROUPS.
        item: what is compared.
        published: the printed value, or how many and in which range.
        ours: what stands against it, likewise.
        deviation: how far off it is.
        unit: of deviation and bar.
        bar: most that agrees; None where none is set.
    """

    group: str
    item: str
    published: str
    ours: str
    deviation: float
    unit: str
    bar: float | None

    @property
    def agrees(self) -> bool | None:
        """Whether the deviation is within the bar; None where none is set."""
        return None if self.bar is None else bool(abs(self.deviation) <= self.bar)

    def said(self, value: float) -> str:
        """Deviation or bar as it is read, with its unit."""
        if self.unit == "values":
            return f"{value:.0f} differ" if value != 1 else "1 differs"
        return f"{value:.3g} {self.unit}"


def verdicts(tables: Tables) -> list[Verdict]:
    """All verdicts, in the order of GROUPS."""
    return [*_from_print(tables), *_identified(tables), *_held_out(tables), *_surrogates(tables)]


def _from_print(tables: Tables) -> Iterator[Verdict]:
    """Tables 10 to 13 and the relative changes, recomputed from printed numbers: how many differ in a printed digit."""
    changes = published("relative_changes")
    again = [relative_change(tables[str(r.table)], str(r.quantity)) for r in changes.itertuples()]
    off = _differ(changes["relative_change_percent"], again, 2)
    yield _counted("Relative changes, last rows of Tables 3 to 8", off, len(changes))
    ten = tables["10"]
    printed, found = (t.to_numpy(dtype=float) for t in (ten.published, ten.found[RECOMPUTED]))
    cut = np.trunc(found * 1000) / 1000
    off = int(((np.round(found, 3) != printed) & (cut != printed)).sum())
    yield _counted("Table 10, rounded or, for one value, cut off", off, printed.size)
    yield _counted("Eq. (7), within the rounding of Table 9", int(_eq_7_outside(tables["Eqs"])), len(TERMS))
    yield _counted("Eq. (8), the five terms not misprinted", _eq_8_differ(tables["Eqs"]), 5)
    for number, digits in (("11", 3), ("12", 5)):
        table = tables[number]
        off = sum(_differ(table.published[h], table.found[RECOMPUTED][h], digits) for h in table.heads)
        yield _counted(f"Table {number}", off, table.published.size)
    thirteen = tables["13"]
    for head, digits in (("TS_mm", 1), ("TAMA_g", 1)):
        value = float(thirteen.found[RECOMPUTED][head].iloc[0])
        off = _differ(thirteen.published[head].iloc[:1], [value], digits)
        yield _counted(f"Table 13, surrogate's {split_unit(head)[0]}", off, 1)


def _identified(tables: Tables) -> Iterator[Verdict]:
    heads = tables["4"].heads
    every = {head: _both(tables["4"], tables["7"], head) for head in heads}
    largest = max(np.abs(ours / printed - 1).max() for printed, ours in every.values())
    yield Verdict(
        IDENTIFIED,
        "Tables 4, 7: each peak acceleration",
        f"{sum(p.size for p, _ in every.values())} values",
        "largest deviation",
        100 * float(largest),
        "%",
        100 * bars.PEAK_EACH,
    )
    for head, (vehicle, bar) in zip(heads, bars.PEAK_RMS_G.items(), strict=True):
        yield _rms(f"Tables 4, 7: peak of {vehicle}", every[head], "g", bar, digits=4)
    for head, bar in bars.STROKE_RMS_MM.items():
        pair = _both(tables["3"], tables["6"], head)
        yield _rms(f"Tables 3, 6: {_NAMES[head]}", pair, "mm", bar, digits=1)
        bias = float(np.mean(pair[1] - pair[0]))
        item = f"Tables 3, 6: {_NAMES[head]}, mean deviation"
        yield Verdict(IDENTIFIED, item, f"{pair[0].size} values", "mean", bias, "mm", bars.STROKE_BIAS_MM)
    for head, bar in bars.ENERGY_RMS.items():
        printed, ours = _both(tables["3"], tables["6"], head)
        relative = (np.ones_like(printed), ours / printed)
        verdict = _rms(f"Tables 3, 6: {_NAMES[head]}", relative, "%", 100 * bar, scale=100)
        yield _with_range(verdict, printed, ours, "kJ", 0)
    printed, ours = _both(tables["3"], tables["6"], "coupler_mm")
    yield _largest("Tables 3, 6: coupler used up", printed, ours, "mm", bars.COUPLER_MM, relative=False)
    yield _largest("Tables 5, 8: TS", *_both(tables["5"], tables["8"], "TS_mm"), "mm", bars.TS_EACH)
    five = _pair(tables["5"], "TAMA_g")
    yield _largest("Table 5: TAMA", *five, "g", bars.TAMA_EACH, digits=4)
    mean = tables["7"].published.mean(axis=1).to_numpy()
    ours = _pair(tables["8"], "TAMA_g")[1]
    yield _largest("Table 7: mean of each row (TAMA)", mean, ours, "g", bars.TAMA_OF_TABLE_7_EACH, digits=4)
    eight = _pair(tables["8"], "TAMA_g")
    yield _largest("Table 8: TAMA (see the defects)", *eight, "g", None, digits=4)


def _held_out(tables: Tables) -> Iterator[Verdict]:
    nine, thirteen = tables["9"], tables["13"]
    yield _largest("Table 9: TS", *_pair(nine, "TS_mm"), "mm", bars.TS_TABLE_9_EACH, group=HELD_OUT)
    for head in ("anti_climber_mm", "stroke_m1_m2_mm", "stroke_m2_m3_mm"):
        yield _rms(f"Table 9: {_NAMES[head]}", _pair(nine, head), "mm", None, digits=1, group=HELD_OUT)
    for head in ("peak_acc_m1_g", "peak_acc_m2_g", "TAMA_g"):
        name = split_unit(head)[0].replace("peak_acc_m", "peak of M")
        pair = _pair(nine, head)
        yield _largest(f"Table 9: {name} (see the defects)", *pair, "g", None, digits=2, group=HELD_OUT)
    for head, bar in (("TS_mm", bars.TS_TABLE_13), ("TAMA_g", bars.TAMA_TABLE_13)):
        printed, ours = (values[1:] for values in _pair(thirteen, head))
        name, unit = split_unit(head)
        digits = 2 if unit == "mm" else 4
        yield _largest(f"Table 13: {name}", printed, ours, unit, bar, digits, head == "TS_mm", HELD_OUT)
    balance = _pair(tables["balance"], "balance_time_s")
    yield _largest("Balance times", *balance, "s", bars.BALANCE_TIME_EACH, digits=3, group=HELD_OUT)


def _surrogates(tables: Tables) -> Iterator[Verdict]:
    found = tables["13"].found[OURS]
    for head, digits in (("TS_mm", 1), ("TAMA_g", 4)):
        name, unit = split_unit(head)
        surrogate, simulated = (float(v) for v in found[head])
        yield Verdict(
            ITSELF,
            f"{name} at the paper's optimum",
            f"{simulated:.{digits}f} {unit}",
            f"{surrogate:.{digits}f} {unit}",
            100 * (surrogate / simulated - 1),
            "%",
            100 * bars.SURROGATE,
        )


_NAMES = {
    "anti_climber_mm": "S_anti",
    "stroke_m1_m2_mm": "S12",
    "stroke_m2_m3_mm": "S23",
    "energy_s1_m1_kJ": "energy of S1-M1",
    "energy_m1_m2_kJ": "energy of M1-M2",
    "energy_m2_m3_kJ": "energy of M2-M3",
}


def relative_change(table: Comparison, quantity: str, source: str = "") -> float:
    """Last row over first row less 1 [%], of the published values or of a source's."""
    values = table.found[source] if source else table.published
    (head,) = (h for h in table.heads if split_unit(h)[0] == quantity)
    return 100 * float(values[head].iloc[-1] / values[head].iloc[0] - 1)


def _pair(table: Comparison, head: str) -> tuple[Array, Array]:
    """Published and our values of a column."""
    return (
        table.published[head].to_numpy(dtype=np.float64),
        table.found[OURS][head].to_numpy(dtype=np.float64),
    )


def _both(over_D: Comparison, over_M: Comparison, head: str) -> tuple[Array, Array]:
    """Published and ours over both series; the case that both have comes once: 17 values."""
    once = over_M.keys["M_t"].to_numpy() != MASS_T
    first, second = _pair(over_D, head), _pair(over_M, head)
    published_, ours = (np.concatenate([a, b[once]]) for a, b in zip(first, second, strict=True))
    return published_, ours


def _rms(
    item: str,
    pair: tuple[Array, Array],
    unit: str,
    bar: float | None,
    digits: int = 2,
    scale: float = 1.0,
    group: str = IDENTIFIED,
) -> Verdict:
    printed, ours = pair
    rms = scale * float(np.sqrt(np.mean((ours - printed) ** 2)))
    verdict = Verdict(group, f"{item}, rms", "", "", rms, unit, bar)
    return _with_range(verdict, printed, ours, unit, digits)


def _with_range(verdict: Verdict, printed: Array, ours: Array, unit: str, digits: int) -> Verdict:
    return replace(verdict, published=_range(printed, unit, digits), ours=_range(ours, unit, digits))


def _largest(
    item: str,
    printed: Array,
    ours: Array,
    unit: str,
    bar: float | None,
    digits: int = 1,
    relative: bool = True,
    group: str = IDENTIFIED,
) -> Verdict:
    """The largest deviation: relative in %, or in the unit."""
    off = ours / printed - 1 if relative else ours - printed
    worst = float(off[np.argmax(np.abs(off))])
    first, second = _range(printed, unit, digits), _range(ours, unit, digits)
    if relative:
        return Verdict(group, item, first, second, 100 * worst, "%", None if bar is None else 100 * bar)
    return Verdict(group, item, first, second, worst, unit, bar)


def _range(values: Array, unit: str, digits: int) -> str:
    low, high = f"{values.min():.{digits}f}", f"{values.max():.{digits}f}"
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _counted(item: str, off: int, n: int) -> Verdict:
    return Verdict(FROM_PRINT, item, f"{n} value{'s' * (n > 1)}", f"{n - off} to the digit", off, "values", 0)


def _differ(printed: ArrayLike, found: ArrayLike, digits: int) -> int:
    """How many found values, rounded, are not the printed ones."""
    p, f = (np.asarray(v, dtype=np.float64) for v in (printed, found))
    return int((np.abs(np.round(f, digits) - p) > 1e-9).sum())


def _eq_7_outside(table: Comparison) -> int:
    """Coefficients of Eq. (7) further from the fit than the rounding of Table 9 and of the equation explains."""
    off = np.abs(table.deviation("TS_mm", RECOMPUTED))
    return int((off > rounding_reach() + 0.0005).sum())


def _eq_8_differ(table: Comparison) -> int:
    """Printed coefficients of Eq. (8) that are not the fit's, of the terms that are not misprinted."""
    fit = dict(zip(table.keys["term"], table.found[RECOMPUTED]["TAMA_g"], strict=True))
    printed = dict(zip(table.keys["term"], table.published["TAMA_g"], strict=True))
    digits = {"1": 3, "D": 3, "M": 3, "D^3": 8, "M^3": 4}
    return sum(_differ([printed[t]], [fit[t]], n) for t, n in digits.items())
