"""The tables of a comparison, each told once for terminal and page."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trainmj.comparison.differences import Difference
from trainmj.comparison.found import Comparison
from trainmj.comparison.rules import ALLOWED, MEANING
from trainmj.output.table import Column, Table, Verdict, judged, worded
from trainmj.units import against


def verdict(found: Comparison) -> Verdict:
    """The verdict on the whole in one sentence."""
    wrong = [f"{rule.name} {rule.where}".rstrip() for rule in found.rules if rule.kept is False]
    if found.unusable:
        return judged(False, no=f"Numbers may not be used: {'; '.join(found.unusable)}.")
    if found.kept is None:
        return judged(None, unknown="No rule can be judged by the channels that both have.")
    more = f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
    n = sum(rule.kept is not None for rule in found.rules)
    every = "The one rule" if n == 1 else "Both rules" if n == 2 else f"All {n} rules"
    kept = f"{every} that can be judged {'is' if n == 1 else 'are'} kept; no compliance is claimed."
    are = "rule is" if n == 1 else "rules is" if len(wrong) == 1 else "rules are"
    return judged(found.kept, kept, f"{len(wrong)} of {n} {are} not kept: {', '.join(wrong[:3])}{more}.")


def count(found: Comparison) -> str:
    """How many rules are kept: ``7 of 8``."""
    stated = [rule.kept for rule in found.rules if rule.kept is not None]
    return f"{sum(stated)} of {len(stated)}"


def rules(found: Comparison) -> Table:
    """Every rule and what was found."""
    rows = [
        (
            rule.name,
            rule.where,
            *(None if math.isnan(value) else f"{value:.5g} {rule.unit}" for value in (rule.a, rule.b)),
            _off(rule.percent),
            judged(rule.kept, "kept", "not kept", "not judged"),
        )
        for rule in found.rules
    ]
    heads = [*worded("Rule", "at"), Column("A"), Column("B"), Column("difference", "%", head="off"), *worded("verdict")]
    note = (
        f"Difference of A from B: at most {ALLOWED:g} % of B, of the energy {ALLOWED:g} % of the initial energy. After "
        "what EN 15227 is said to ask of a model against a test; no compliance is claimed."
    )
    return Table(heads, rows, "Rules", note)


def _off(percent: float) -> str | None:
    """A difference with the digits that tell it from what is allowed."""
    if math.isnan(percent):
        return None
    text = against(percent, math.copysign(ALLOWED, percent), 2)
    return text if float(text) else text.removeprefix("-")


def said(found: Comparison) -> list[str]:
    """What there is to say of single rules."""
    return [f"{rule.name.capitalize()}: {rule.said}." for rule in found.rules if rule.said]


def meanings() -> list[str]:
    """What each rule is computed of."""
    return [f"{name.capitalize()}: {text}." for name, text in MEANING.items()]


def differences(found: Sequence[Difference], title: str, means: bool = True) -> Table:
    """How far channels differ; with their means, or without where there is less room."""
    heads = [
        *worded("Channel"),
        Column("peak A", digits=".5g", head="peak\nA"),
        Column("peak B", digits=".5g", head="peak\nB"),
        Column("difference", "%", "+.2f", head="off"),
        Column("time A", "s", 4, head="time\nA"),
        Column("time B", "s", 4, head="time\nB"),
        *([Column("mean A", digits=".4g"), Column("mean B", digits=".4g")] if means else []),
        Column("RMS of the difference", "%", ".3g", head="RMS\noff"),
    ]
    rows = [
        (
            one.channel,
            *(one.peak_a, one.peak_b, one.peak_percent, one.peak_time_a_s, one.peak_time_b_s),
            *((one.mean_a, one.mean_b) if means else ()),
            one.rms_percent,
        )
        for one in found
    ]
    note = (
        "While both are there. Peak: the value of largest magnitude, and when. RMS: root mean square of the difference "
        "over time, of that of B."
    )
    return Table(heads, rows, title, note)


def titled(found: Comparison) -> list[tuple[str, Sequence[Difference]]]:
    """The differences with their titles: by the clocks as they are, then with one put forward."""
    parts: list[tuple[str, Sequence[Difference]]] = [("Channels, by the clocks as they are", found.differences)]
    if found.shifted:
        parts.append((f"Channels, with the clock of B put forward by {found.offset_ms:.6g} ms", found.shifted))
    return parts
