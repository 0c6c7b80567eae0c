"""The verdict on a collision in one sentence: the same on the terminal, in a report, a notebook and Python."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from trainmj.collision.status import FAILED, Kind
from trainmj.output.table import Verdict, failed, passed, warned
from trainmj.units import against

if TYPE_CHECKING:
    from trainmj.collision.summary import Summary


def verdict(summary: Summary, worse: Sequence[str] = ()) -> Verdict:
    """Whether the limits are kept: by which one it stands or falls, and by how much.

    Args:
        summary: of the collision.
        worse: what ends worse with other ties, as sentences; what is kept by the stated ones alone is no plain pass.
    """
    found = _by_stated_ties(summary)
    return warned(" ".join([found.text, *worse])) if worse and found.kind != "fail" else found


def _by_stated_ties(summary: Summary) -> Verdict:
    kind = summary.status.kind
    if kind in FAILED:
        return failed(f"No number may be used. {_sentence(str(summary.status))}.")
    if summary.not_valid:
        reason = summary.status.detail.partition(";")[0]
        return failed(f"{_sentence(summary.not_valid)}, so that no limit can be judged: {kind} at {reason}.")
    limits = sorted(summary.limits, key=lambda c: -c.used if math.isfinite(c.used) else -math.inf)
    past = [c for c in limits if not c.kept]
    gave = "; ".join(summary.gave_way)
    bodies = f"{'Car bodies' if summary.gave_way[1:] else 'A car body'} gave way: {gave}."
    cut = {
        Kind.TIME_LIMIT: " The time limit cut the collision off before it was over.",
        Kind.NO_CONTACT: " No device was pressed.",
    }.get(kind, "" if summary.over else " The time limit cut the collision off before it was over.")
    if past:
        worst = past[0]
        by = _over(worst.used)
        passed_by = "are passed, by most:" if past[1:] else "is passed:"
        which = f"{len(past)} of {len(limits)} limits {passed_by}" if limits[1:] else "The limit is passed:"
        return failed(f"{which} {worst.said}{by}.{f' {bodies}' if gave else ''}{cut}")
    if gave:
        return failed(f"{bodies}{cut}")
    if not limits:
        said = f"No limit is stated, so that none is judged.{cut}"
        return warned(said) if cut else Verdict("none", said)
    nearest = limits[0]
    n = len(limits)
    kept = "The limit is kept:" if n == 1 else f"{'Both' if n == 2 else f'All {n}'} limits are kept; nearest:"
    said = f"{kept} {nearest.said}, {against(nearest.used, 100.0, 0)} % used.{cut}"
    return (warned if cut else passed)(said)


def _over(used: float) -> str:
    """By how much a limit is passed of which so many % are used; nothing of a value that is no number."""
    if not 100.0 < used < math.inf:
        return ""
    return f", {used - 100.0:.2g} % over" if used < 199.5 else f", {used / 100.0:.3g} times the limit"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
