"""The tables of a reliability run: those of terminal and page, and those that are written as CSV."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from trainmj.collision.status import FAILED, MEANING, NOT_VALID, PAST_LIMITS, Kind
from trainmj.doe.probability import Estimate
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.reliability.found import Passed, ReliabilityResult
from trainmj.reliability.plan import Reliability
from trainmj.units import against, readable

if TYPE_CHECKING:
    import pandas as pd

_MOST_INDICES = 8
_TOLD = 3.0  # standard errors of a shift that are told from none


def tolerances(plan: Reliability) -> Table:
    """What scatters: each tolerance with its distribution and how many random quantities it makes."""
    rows = []
    known = {name: t for scenario in plan.scenarios.values() for name, t in scenario.tolerances.items()}
    for name, tolerance in known.items():
        spread = tolerance.model_dump(exclude_unset=True, exclude={"of", "scales", "copies", "kind", "correlated"})
        said = ", ".join(f"{key} {_listed(value)}" for key, value in spread.items())
        of = ", ".join(tolerance.targets) + (f" ({tolerance.scales})" if tolerance.scales else "")
        rows.append((name, of, f"{tolerance.kind.replace('_', ' ')}, {said}", plan.scatter.parts.count(name)))
    return Table([*worded("Tolerance", "of", "distribution"), Column("random quantities")], rows)


def _listed(value: Any) -> str:
    return " to ".join(f"{v:g}" for v in value) if isinstance(value, list) and len(value) == 2 else str(value)


def size(plan: Reliability) -> str:
    """How many draws of what, in words."""
    n, d, cases = plan.spec.runs, plan.scatter.d, len(plan.cases)
    each = f", each in {cases} load cases" if cases > 1 else ""
    kind = {"sobol": "scrambled Sobol'", "latin_hypercube": "Latin hypercube"}.get(plan.spec.draws, "random")
    return f"{n} {kind} draws of {d} random quantit{'ies' if d > 1 else 'y'}{each}"


def verdict(result: ReliabilityResult) -> Verdict:
    """How likely a limit is passed, and which one is most likely to be, in one sentence."""
    whole, one = result.any.estimate, result.governing
    found = (
        f"with a probability of {share(whole.value)} ({100 * result.plan.spec.level:g} % interval {interval(whole)})"
    )
    if one is None:
        more = f"; a car body gives way, or numbers may not be used, {found}." if whole.value else "."
        return Verdict("none", f"No limit is stated, so that none is judged{more}")
    place = f", mostly at {one.place}" if one.place else ""
    return Verdict("none", f"A limit is passed {found}; {titled(one)} governs with {share(one.estimate.value)}{place}.")


def titled(one: Passed) -> str:
    """A limit and its load case in words."""
    return f"{one.title}{f', {one.case}' if one.case else ''}"


def probabilities(result: ReliabilityResult) -> Table:
    """How likely each limit is passed."""
    heads = [
        *worded("Load case", "Limit passed"),
        Column("P"),
        Column("interval"),
        Column("draws passed", head="passed"),
        Column("limit"),
        Column("as designed"),
        *worded("most often at"),
        Column("worst draw"),
    ]
    rows = [_probability(one) for one in result.passed]
    note = (
        f"Interval: {100 * result.plan.spec.level:g} %, of independent draws (Clopper and Pearson), which is cautious "
        "for the others. A draw without usable numbers counts as passed in P and the upper end, as kept in the lower."
    )
    return _by_case(result, heads, rows, "Probability that a limit is passed", note)


def _probability(one: Passed) -> tuple[Any, ...]:
    place = f"{one.place} ({100 * one.share:.0f} %)" if one.place else "-"
    limit = "-" if one.limit is None else f"{one.limit:.12g} {one.unit}".rstrip()
    designed = "-" if one.designed is None else against(one.designed, one.limit, one.digits)
    p = one.estimate
    return (one.case or "all", one.title, share(p.value), interval(p), one.passes, limit, designed, place, one.worst)


def _by_case(
    result: ReliabilityResult, heads: list[Column], rows: list[tuple[Any, ...]], title: str, note: str = ""
) -> Table:
    """A table whose first column is the load case, which is left out where there is only one."""
    first = 0 if len(result.plan.cases) > 1 else 1
    return Table(heads[first:], [row[first:] for row in rows], title, note)


def share(value: float) -> str:
    """A probability to read: three digits."""
    return "0" if value == 0 else f"{value:.3g}" if math.isfinite(value) else "-"


def interval(estimate: Estimate) -> str:
    """The interval of a probability, to read."""
    return f"{share(estimate.lower)} to {share(estimate.upper)}"


def causes(result: ReliabilityResult) -> Table:
    """Which random quantities go with the limit that governs."""
    heads = [
        *worded("Scatters"),
        Column("mean among the draws that passed", "sigma", "+.2f", head="mean if passed"),
        Column("correlation with how much is used", "", "+.2f", head="correlation"),
    ]
    one = result.governing
    if one is None:
        return Table(heads, [])
    case = f" in {one.case}" if one.case else ""
    known = max(one.passes - one.unknown, 0)
    note = (
        f"Of {known} draws that passed. A mean within {_TOLD / math.sqrt(known):.2f} sigma of 0 may be chance."
        if known
        else "No draw passed it; the correlation tells what brings it near."
    )
    rows = [(cause.name, cause.shift, cause.correlation) for cause in one.causes]
    return Table(heads, rows, f"What goes with {one.title}{case}", note)


def quantiles(result: ReliabilityResult) -> Table:
    """How limited quantities and responses scatter."""
    asked = result.plan.spec.quantiles
    heads = [
        *worded("Load case", "Response", "unit"),
        Column("mean"),
        Column("standard deviation", head="std.\ndev."),
        *(Column(f"{100 * q:g} % quantile", head=f"{100 * q:g} %") for q in asked),
    ]
    rows = []
    for one in result.scattered:
        shown = [readable(e.value, one.digits) if math.isfinite(e.value) else "-" for _, e in one.quantiles]
        shown += ["-"] * (len(asked) - len(shown))
        numbers = [readable(v, one.digits) if math.isfinite(v) else "-" for v in (one.mean.value, one.deviation)]
        rows.append((one.case, one.title, one.unit, *numbers, *shown))
    note = "Of limited quantities the largest of all places in each draw. Intervals are in quantiles.csv."
    return _by_case(result, heads, rows, "How responses scatter", note)


def endings(result: ReliabilityResult) -> Table:
    """How the draws ended, where not all were over within all limits."""
    rows = []
    for case, of in result.endings.items():
        for kind in (kind for kind in Kind if of[kind]):
            verdict = failed if kind in (*FAILED, *NOT_VALID, *PAST_LIMITS) else warned
            said = passed(kind) if kind is Kind.OVER else verdict(kind)
            rows.append((case, said, of[kind], MEANING[kind]))
    heads = [*worded("Load case", "Ended"), Column("draws"), *worded("what it means")]
    return _by_case(result, heads, rows, "How the draws ended")


def rare(result: ReliabilityResult) -> Table:
    """Small probabilities that were searched for."""
    heads = [
        *worded("Limit passed"),
        Column("P"),
        Column("interval"),
        Column("runs"),
        *worded("trusted", "how it went"),
    ]
    rows = []
    for one in result.searched:
        title = f"{one.title} in {one.case}" if one.case else one.title
        r = one.rare
        ends = f"{share(r.lower)} to {share(r.upper)}"
        rows.append((title, share(r.value), ends, r.runs, judged(r.trusted, "yes", "no"), r.status))
    note = (
        "Levels of a search are in % of the limit beyond it. Not reached: the upper end is that of its first draws."
        if rows
        else ""
    )
    return Table(heads, rows, "Small probabilities, searched for", note)


def indices(result: ReliabilityResult) -> Table:
    """Sobol' indices, the largest shares first."""
    heads = [
        *worded("Load case", "Response", "tolerance"),
        Column("first order", "", ".2f", head="alone"),
        Column("interval"),
        Column("total", "", ".2f"),
        Column("interval"),
    ]
    rows = []
    keys = dict.fromkeys((one.case, one.response) for one in result.indices)
    for key in keys:
        of = [one for one in result.indices if (one.case, one.response) == key]
        for one in sorted(of, key=lambda one: -one.total[0])[:_MOST_INDICES]:
            rows.append((one.case, one.title, one.part, one.first[0], _ends(one.first), one.total[0], _ends(one.total)))
    note = "Share of the variance that a tolerance, with all its copies, causes alone, and in which it takes part."
    if any(t.correlated for scenario in result.plan.scenarios.values() for t in scenario.tolerances.values()):
        note += " Of correlated tolerances, what they share goes to the one that comes first."
    if lost := max((one.left_out for one in result.indices), default=0):
        note += f" Up to {lost} samples are left out, as a collision of theirs has no usable number."
    return _by_case(result, heads, rows, "Which tolerance the scatter comes from (Sobol' indices)", note)


def _ends(found: Sequence[float]) -> str:
    _, lower, upper = found
    return f"{lower:.2f} to {upper:.2f}"


def _frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(rows)


def _limits(result: ReliabilityResult) -> pd.DataFrame:
    return _frame(
        [
            {
                "load_case": one.case,
                "limit": one.name,
                "unit": one.unit,
                "allowed": one.limit,
                "as_designed": one.designed,
                "probability": one.estimate.value,
                "lower": one.estimate.lower,
                "upper": one.estimate.upper,
                "draws": one.estimate.n,
                "passed": one.passes,
                "without_usable_numbers": one.unknown,
                "most_often_at": one.place,
                "share_there": one.share,
                "worst_draw": one.worst,
                "worst_value": one.found,
            }
            for one in result.passed
        ]
    )


def _causes(result: ReliabilityResult) -> pd.DataFrame:
    return _frame(
        [
            {
                "load_case": one.case,
                "limit": one.name,
                "scatters": c.name,
                "shift_sigma": c.shift,
                "correlation": c.correlation,
            }
            for one in result.passed
            for c in one.causes
        ]
    )


def _quantiles(result: ReliabilityResult) -> pd.DataFrame:
    rows = []
    for one in result.scattered:
        about = {"load_case": one.case, "response": one.name, "unit": one.unit}
        of = [("mean", one.mean), *((f"quantile {q:g}", e) for q, e in one.quantiles)]
        rows += [about | {"statistic": name, "value": e.value, "lower": e.lower, "upper": e.upper} for name, e in of]
        rows.append(about | {"statistic": "standard deviation", "value": one.deviation})
    return _frame(rows)


def _convergence(result: ReliabilityResult) -> pd.DataFrame:
    rows = []
    for one in result.passed:
        r = one.running
        for n, value, lower, upper in zip(r.draws, r.value, r.lower, r.upper, strict=True):
            rows.append(
                {
                    "load_case": one.case,
                    "limit": one.name,
                    "draws": n,
                    "probability": value,
                    "lower": lower,
                    "upper": upper,
                }
            )
    return _frame(rows)


def _rare(result: ReliabilityResult) -> pd.DataFrame:
    names = {
        "value": "probability",
        "lower": "lower",
        "upper": "upper",
        "runs": "runs",
        "failed": "without_usable_numbers",
    }
    names |= {"trusted": "trusted", "status": "status"}
    return _frame(
        [
            {"load_case": one.case, "limit": one.name} | {head: getattr(one.rare, name) for name, head in names.items()}
            for one in result.searched
        ]
    )


def _indices(result: ReliabilityResult) -> pd.DataFrame:
    rows = []
    for one in result.indices:
        row: dict[str, Any] = {"load_case": one.case, "response": one.response, "tolerance": one.part}
        for order, numbers in (("first", one.first), ("total", one.total)):
            row |= dict(zip((order, f"{order}_lower", f"{order}_upper"), numbers, strict=True))
        rows.append(row | {"samples_left_out": one.left_out})
    return _frame(rows)


TABLES: dict[str, Callable[[ReliabilityResult], pd.DataFrame]] = {
    "limits": _limits,
    "causes": _causes,
    "quantiles": _quantiles,
    "convergence": _convergence,
    "rare": _rare,
    "indices": _indices,
}
"""The tables of the folder, by the names of their files."""
