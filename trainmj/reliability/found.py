"""What the draws of a reliability run say: how often limits are passed and where, why, and how responses scatter."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainmj.cases.store import Store
from trainmj.collision.limits import Criterion
from trainmj.collision.quantities import Column
from trainmj.collision.status import PAST_LIMITS, UNUSABLE
from trainmj.doe.arrays import FloatArray
from trainmj.doe.draws import replicates_of
from trainmj.doe.probability import Estimate, Rare, mean_interval, proportion, quantile_interval
from trainmj.files.shown import Drawn
from trainmj.files.written import finite
from trainmj.reliability.file import ANY
from trainmj.reliability.plan import Reliability

FEW = 10
"""Passes below which plain draws say little of a probability."""

_MOST_CAUSES = 5
_STEPS = 60  # of a running probability
_POINTS = 1001  # of a distribution that is drawn
_LEAST = 16  # draws from which replicates are told apart

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Cause:
    """How a random quantity goes with the passing of a limit.

    Attributes:
        name: of the random quantity.
        shift: mean of its normal score among the draws that passed [standard deviations]; nan if none did.
        correlation: of its normal score with how much of the limit is used, over all draws.
    """

    name: str
    shift: float
    correlation: float


@dataclass(frozen=True)
class Running:
    """A probability over the number of draws behind it, (n,) each."""

    draws: NDArray[np.int64]
    value: FloatArray
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True)
class Passed:
    """How likely a limit is passed in a load case.

    Attributes:
        case: load case; empty for all of them, or if there is only one.
        name: of the limit, as single runs judge it; "any" for whichever is passed.
        title: in words.
        estimate: the probability with its interval.
        unknown: draws without a usable number (failed, refused, not valid); they count as passed in the estimate and
            its upper end, and as not passed in the lower end.
        place: where it is passed most often; empty if it is never, or has no place.
        share: part of the passes that are there.
        worst: number of the draw that uses most of the limit; None if none has a usable number.
        causes: random quantities, the most telling first.
        running: the probability over the draws.
        limit: the limit as designed; None for any.
        designed: what the train as designed comes to; None for any.
        found: what the worst draw comes to.
        used: quantiles of how much of the limit is used [%], (n,) evenly spaced from the least to the most.
        unit: of limit, designed and found.
        digits: decimals of them.
    """

    case: str
    name: str
    title: str
    estimate: Estimate
    unknown: int
    place: str
    share: float
    worst: int | None
    causes: tuple[Cause, ...]
    running: Running = field(repr=False)
    limit: float | None = None
    designed: float | None = None
    found: float | None = None
    used: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    unit: str = ""
    digits: int = 1

    @property
    def passes(self) -> int:
        """Draws that passed it, those without usable numbers among them."""
        return round(self.estimate.value * self.estimate.n)


@dataclass(frozen=True)
class Scattered:
    """How a response scatters over the draws with usable numbers.

    Attributes:
        case: load case.
        name: of its column, or of a limited quantity where it is largest.
        title: in words.
        mean: with its interval.
        deviation: standard deviation.
        quantiles: with their intervals; draws without a usable number may have been anything.
        unknown: draws without a usable number.
        unit: of all numbers.
        digits: decimals.
    """

    case: str
    name: str
    title: str
    mean: Estimate
    deviation: float
    quantiles: tuple[tuple[float, Estimate], ...]
    unknown: int
    unit: str
    digits: int


@dataclass(frozen=True)
class Searched:
    """A probability that was searched for, of a limit in a load case; of any limit in any case if both are empty."""

    case: str
    name: str
    title: str
    rare: Rare


@dataclass(frozen=True)
class Index:
    """Shares of the variance of a response, or of how much of a limit is used, that go back to a tolerance.

    Attributes:
        case: load case.
        response: name of the response or limit.
        title: in words.
        part: name of the tolerance, with all its copies.
        first: share that it causes alone, and ends of its interval.
        total: share in which it takes part, and ends of its interval.
        left_out: samples left out, as a collision of theirs has no usable number.
    """

    case: str
    response: str
    title: str
    part: str
    first: tuple[float, ...]
    total: tuple[float, ...]
    left_out: int


@dataclass(frozen=True, eq=False)
class ReliabilityResult(Drawn):
    """What a reliability run found.

    Attributes:
        plan: what was asked.
        folder: where its files are.
        passed: by load case: each limit, then any of them; at last any limit in any case, if there are several.
        scattered: by load case.
        endings: how the draws ended, by load case: how many of each kind.
        first_unusable: the first without usable numbers, in words; empty if there is none.
        coarse: collisions of the draws whose step is coarse for their peaks.
        searched: small probabilities that were searched for.
        indices: Sobol' indices.
        computed: collisions that were computed now; the others were there.
        seconds: wall time [s].
        versions: of what computed it.
    """

    plan: Reliability
    folder: Path
    passed: tuple[Passed, ...]
    scattered: tuple[Scattered, ...]
    endings: Mapping[str, Counter[str]]
    first_unusable: str
    coarse: int
    searched: tuple[Searched, ...]
    indices: tuple[Index, ...]
    computed: int
    seconds: float
    versions: Mapping[str, str]

    def __repr__(self) -> str:
        """Title and verdict."""
        from trainmj.reliability.tables import verdict  # which is made of this

        return f"<ReliabilityResult {self.plan.title}. {verdict(self).text}>"

    @property
    def any(self) -> Passed:
        """Any limit in any load case."""
        return self.passed[-1]

    @property
    def governing(self) -> Passed | None:
        """The limit that is most likely to be passed, or else comes nearest to it; None if there is none."""
        limits = [one for one in self.passed if one.name != ANY]
        return max(limits, key=lambda one: (one.estimate.value, _most(one.used)), default=None)

    @property
    def unusable(self) -> int:
        """Draws without usable numbers, in all cases together."""
        return sum(count for of in self.endings.values() for kind, count in of.items() if kind in UNUSABLE)

    @property
    def collisions(self) -> int:
        """Collisions of the plain draws."""
        return self.plan.spec.runs * len(self.plan.cases)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj reliability --json`` prints them and summary.json has them."""
        governing = self.governing
        plain: dict[str, Any] = finite(
            {
                "title": self.plan.title,
                "draws": self.plan.spec.runs,
                "load_cases": [case for case in self.plan.cases if case],
                "random_quantities": list(self.plan.scatter.names),
                "level": self.plan.spec.level,
                "governing": {"case": governing.case, "limit": governing.name} if governing else None,
                "probabilities": [_plain(one) for one in self.passed],
                "quantiles": [asdict(one) for one in self.scattered],
                "endings": {case: dict(of) for case, of in self.endings.items()},
                "coarse": self.coarse,
                "rare": [_searched(one) for one in self.searched],
                "indices": [asdict(one) for one in self.indices],
            }
        )
        return plain


def _plain(one: Passed) -> dict[str, Any]:
    kept = {name: value for name, value in vars(one).items() if name not in ("running", "used", "digits", "title")}
    return kept | {"estimate": asdict(one.estimate), "causes": [asdict(cause) for cause in one.causes]}


def _searched(one: Searched) -> dict[str, Any]:
    names = ("value", "lower", "upper", "level", "runs", "failed", "trusted", "status")
    return {"case": one.case, "limit": one.name} | {name: getattr(one.rare, name) for name in names}


def _most(used: FloatArray) -> float:
    return float(used[-1]) if used.size else -math.inf


class Draws:
    """The rows of a store, column by column: memory is that of a few columns.

    Args:
        plan: what was asked.
        store: with all draws.
        designed: the limits of each load case beside what the train as designed comes to.
        columns: of the responses, by load case.
    """

    def __init__(
        self,
        plan: Reliability,
        store: Store,
        designed: Mapping[str, Sequence[Criterion]],
        columns: Mapping[str, Mapping[str, Column]],
    ) -> None:
        """Read nothing yet."""
        self._plan, self._store, self._designed, self._columns = plan, store, designed, columns
        self.endings: dict[str, Counter[str]] = {}
        self.first_unusable = ""
        self._unusable: dict[str, Flags] = {}

    def passed(self) -> Iterator[Passed]:
        """How likely each limit is passed, and any of them."""
        n = self._plan.spec.runs
        everywhere, unknown_somewhere, most_of_all = np.zeros(n, bool), np.zeros(n, bool), np.full(n, np.nan)
        for case in self._plan.cases:
            status = [str(kind) for kind in self._column("status", case)]
            self.endings[case] = Counter(status)
            lost = np.array([kind in UNUSABLE for kind in status])
            any_of_them = np.array([kind in PAST_LIMITS for kind in status])
            most = np.full(n, np.nan)  # that is used of any limit
            self._unusable[case] = lost
            if lost.any() and not self.first_unusable:
                self.first_unusable = self._said(case, int(np.argmax(lost)))
            for criterion in self._designed[case]:
                one, flags, used = self._of(case, criterion, lost)
                any_of_them |= flags
                most = np.fmax(most, used)
                yield one
            if len(self._plan.cases) > 1:
                yield self._any(case, any_of_them, lost, most)
            everywhere |= any_of_them
            unknown_somewhere |= lost
            most_of_all = np.fmax(most_of_all, most)
        yield self._any("", everywhere, unknown_somewhere, most_of_all)

    def scattered(self) -> Iterator[Scattered]:
        """How limited quantities and responses scatter."""
        for case in self._plan.cases:
            done = set()
            for c in self._designed[case]:
                yield self._scattered(case, f"{c.name} found", c.name, c.title, c.unit, c.digits)
                done.add(c.name)
            for name, column in self._plan.responses(case, self._plan.spec.responses).items():
                if name not in done:
                    yield self._scattered(case, name, name, column.title, column.unit, column.digits)

    def _column(self, name: str, case: str) -> Iterator[Any]:
        """A value for each draw of a load case."""
        plan = self._plan
        values = self._store.column(name, plan.spec.runs * len(plan.cases))
        return (v for k, v in enumerate(values) if k % len(plan.cases) == plan.cases.index(case))

    def _numbers(self, name: str, case: str) -> FloatArray:
        """The same as numbers (n,); nan where there is none that may be used."""
        values = (math.nan if v is None else v for v in self._column(name, case))
        found = np.fromiter(values, dtype=np.float64, count=self._plan.spec.runs)
        found[self._unusable[case]] = math.nan
        return found

    def _said(self, case: str, draw: int) -> str:
        """How a draw ended, in words."""
        status, reason = (list(self._column(name, case))[draw] for name in ("status", "reason"))
        return f"draw {draw}{f' of {case}' if case else ''}, {status}: {reason}"

    def _of(self, case: str, criterion: Criterion, lost: Flags) -> tuple[Passed, Flags, FloatArray]:
        found = self._numbers(f"{criterion.name} found", case)
        unknown = lost | np.isnan(found)
        passed = np.fromiter((v != 0 for v in self._column(f"{criterion.name} passed", case)), bool) & ~unknown
        places = Counter(
            place for place, yes in zip(self._column(f"{criterion.name} at", case), passed, strict=True) if yes
        )
        place, often = places.most_common(1)[0] if places else ("", 0)
        used = self._numbers(f"{criterion.name} used", case)
        worst = _largest(used)
        return (
            Passed(
                case,
                criterion.name,
                criterion.title,
                *self._estimate(passed, unknown),
                place or "",
                often / passed.sum() if often else 0.0,
                worst,
                self._causes(case, passed, used),
                self._running(passed, unknown),
                criterion.limit,
                criterion.found,
                None if worst is None else float(found[worst]),
                np.quantile(used[~unknown], np.linspace(0.0, 1.0, _POINTS)) if (~unknown).any() else np.zeros(0),
                criterion.unit,
                criterion.digits,
            ),
            passed,
            used,
        )

    def _any(self, case: str, passed: Flags, lost: Flags, used: FloatArray) -> Passed:
        unknown = lost & ~passed  # what passed a limit in one load case did, whatever became of the others
        title = "any limit in any load case" if not case and len(self._plan.cases) > 1 else "any limit"
        worst, causes = _largest(used), self._causes(case, passed, used)
        return Passed(
            case, ANY, title, *self._estimate(passed, unknown), "", 0.0, worst, causes, self._running(passed, unknown)
        )

    def _estimate(self, passed: Flags, unknown: Flags) -> tuple[Estimate, int]:
        n, lost = len(passed), int(unknown.sum())
        return proportion(int(passed.sum()), n, failed=lost, level=self._plan.spec.level), lost

    def _running(self, passed: Flags, unknown: Flags) -> Running:
        """The probability after 10 draws, and on to all of them."""
        n, level = len(passed), self._plan.spec.level
        at = np.unique(np.geomspace(min(10, n), n, _STEPS).round().astype(np.int64))
        counts = zip(np.cumsum(passed)[at - 1].tolist(), np.cumsum(unknown)[at - 1].tolist(), at.tolist(), strict=True)
        found = [proportion(k, m, failed=lost, level=level) for k, lost, m in counts]
        columns = ([getattr(one, name) for one in found] for name in ("value", "lower", "upper"))
        return Running(at, *map(np.array, columns))

    def _causes(self, case: str, passed: Flags, used: FloatArray) -> tuple[Cause, ...]:
        """The random quantities of a case, or of all, that go most with how much of a limit is used."""
        plan = self._plan
        acting = plan.scatter.columns.get(case, list(range(plan.scatter.d)))
        d = len(acting)
        known = np.isfinite(used)
        k, m = int(passed.sum()), int(known.sum())
        mean = float(used[known].mean()) if m else 0.0
        of_passed, cross, squares, sums = (np.zeros(d) for _ in range(4))
        for first, z in plan.chunks():
            y = plan.scatter.scores(z)[:, acting]
            here = slice(first, first + len(z))
            of_passed += y[passed[here]].sum(axis=0)
            y = y[known[here]]
            cross += (used[here][known[here]] - mean) @ y
            squares += (y**2).sum(axis=0)
            sums += y.sum(axis=0)
        scale = np.sqrt(max(0.0, float(((used[known] - mean) ** 2).sum())) * (squares - sums**2 / max(m, 1)))
        correlation = np.divide(cross, scale, out=np.zeros(d), where=scale > 0)
        shift = of_passed / k if k else np.full(d, math.nan)
        order = np.argsort(-np.abs(correlation), kind="stable")[:_MOST_CAUSES]
        return tuple(Cause(plan.scatter.names[acting[j]], float(shift[j]), float(correlation[j])) for j in order)

    def _scattered(self, case: str, column: str, name: str, title: str, unit: str, digits: int) -> Scattered:
        spec, lost = self._plan.spec, self._unusable[case]
        values = self._numbers(column, case)
        group = replicates_of(len(values), method=spec.draws)
        known = np.isfinite(values)
        there = values[known]
        asked = spec.quantiles if known.any() else []
        quantiles = [(q, quantile_interval(values[known | lost], q, level=spec.level)) for q in asked]
        deviation = float(there.std(ddof=1)) if there.size > 1 else math.nan
        mean = _mean(there, group[known], spec.level)
        return Scattered(case, name, title, mean, deviation, tuple(quantiles), int(lost.sum()), unit, digits)


def _largest(values: FloatArray) -> int | None:
    """Where the largest of some values (n,) is; None if all are nan."""
    return int(np.nanargmax(values)) if np.isfinite(values).any() else None


def _mean(values: FloatArray, group: NDArray[np.int64], level: float) -> Estimate:
    """The mean with its interval: by the replicates of the draws where these are of about equal size."""
    if values.size < 2:
        value = float(values[0]) if values.size else math.nan
        return Estimate(value, -math.inf, math.inf, level, values.size)
    _, sizes = np.unique(group, return_counts=True)
    told = values.size >= _LEAST and sizes.size > 1 and sizes.max() <= 2 * sizes.min()
    return mean_interval(values, group if told else None, level=level)
