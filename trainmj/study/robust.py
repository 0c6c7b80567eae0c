"""Robust designs: statistics of many trains as built take the place of the responses of one.

A limit that a share p of the trains may pass is one on a quantile: at most p of them pass it where the quantile 1 - p
keeps it. So a robust study is a study of the same factors whose responses are means and quantiles, each over the same
draws of what scatters, and all its steps are those of any study.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trainmj.cases.rows import Row
from trainmj.cases.runner import numbers_of
from trainmj.cases.scatter import scatter_of, together
from trainmj.collision.status import UNUSABLE, Kind
from trainmj.doe import normal_draws, proportion
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.study import figures_front as figures
from trainmj.study import fronts
from trainmj.study.choice import Choice, decision, weights
from trainmj.study.designs import Designs
from trainmj.study.file import (
    AtQuantile,
    ConstraintPart,
    MeanAndSigmas,
    OwnWeights,
    ResponsePart,
    StatisticPart,
    name_in,
)
from trainmj.study.folder import Output, Tables
from trainmj.study.plan import Response, Study
from trainmj.study.rules import DEFAULT, NOMINAL, ROBUST
from trainmj.study.simulator import Simulator
from trainmj.study.surrogates import Models

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ANY = "any of them"
_ATTEMPTS = 6  # of finding margins
_FURTHER = 1.1  # a margin over what a prediction was short of: the next design is another one
_CHUNK = 2048  # trains at a time
_LEAST_USABLE = 0.99  # share of the trains as built that must have numbers for a mean


@dataclass(frozen=True)
class Statistic:
    """What many trains as built come to.

    Attributes:
        name: in the names of responses: mean, q99, mean_2s.
        quantile: of the trains, from the better to the worse; None for a mean.
        sigmas: standard deviations that are added to a mean.
        worse: 1 if more is worse, -1 if less is.
    """

    name: str
    worse: int
    quantile: float | None = None
    sigmas: float = 0.0

    def of(self, values: FloatArray, sure: bool = False) -> float:
        """The statistic of values (n,), nan for a train without numbers; nan if it has none itself.

        A train without numbers counts as worse than any other for a quantile; a mean leaves it out, and there is none
        if more than 1 % are without.

        Args:
            values: of trains as built.
            sure: of a quantile, take the value that so few trains pass that the interval of their share does not reach
                beyond what the quantile stands for.
        """
        known = values[np.isfinite(values)]
        if self.quantile is not None:
            n = len(values)
            found = self.worse * np.sort(np.where(np.isfinite(values), self.worse * values, np.inf))
            place = min(max(int(np.ceil(n * self.quantile - 1e-9)), 1), n)
            while sure and place < n and proportion(n - place, n).upper > 1.0 - self.quantile:
                place += 1
            return float(found[place - 1]) if np.isfinite(found[place - 1]) else np.nan
        if len(known) < max(2, _LEAST_USABLE * len(values)):
            return np.nan
        return float(known.mean() + self.worse * self.sigmas * known.std(ddof=1))


def _objective(part: StatisticPart, worse: int) -> Statistic:
    match part:
        case AtQuantile(quantile=q):
            return _quantile(q if worse > 0 else 1.0 - q, worse)
        case MeanAndSigmas(sigmas=k):
            return Statistic(f"mean_{k:g}s".replace(".", "_"), worse, sigmas=k)
    return Statistic("mean", worse)


def _quantile(worst: float, worse: int) -> Statistic:
    """The value that all but the worst share keep; named by the share that lies below it."""
    below = worst if worse > 0 else 1.0 - worst
    return Statistic(f"q{100 * below:.10g}".replace(".", "_"), worse, quantile=worst)


@dataclass(frozen=True)
class Robust:
    """A study, and that of the statistics of its responses.

    Attributes:
        nominal: of the train as designed.
        study: the same, whose responses are statistics.
        statistics: of each of its responses, with the column of which it is one, (r,).
    """

    nominal: Study
    study: Study
    statistics: tuple[tuple[str, Statistic], ...]


def robust_of(study: Study) -> Robust:
    """The study of the statistics that a study asks for under ``robust``."""
    spec, part = study.spec, study.spec.robust
    assert part is not None
    asked: dict[str, tuple[str, Statistic]] = {}  # by new name: name of the response, and what of it

    def named(name: str, statistic: Statistic) -> str:
        new = f"{name}_{statistic.name}"
        asked[new] = name, statistic
        return new

    def limited(constraints: Mapping[str, ConstraintPart]) -> dict[str, ConstraintPart]:
        found = {}
        for name, limit in constraints.items():
            share = part.probabilities.get(name, part.probability)
            if limit.at_most is not None:
                new = named(name, _quantile(1.0 - share, 1))
                found[new] = ConstraintPart(at_most=limit.at_most, margin=limit.margin)
            if limit.at_least is not None:
                new = named(name, _quantile(1.0 - share, -1))
                found[new] = ConstraintPart(at_least=limit.at_least, margin=limit.margin)
        return found

    def lifted(constraints: Mapping[str, ConstraintPart]) -> dict[str, ConstraintPart]:
        """No limits in place of both sides of those of all cases: a case may state only one of them."""
        return {
            name: ConstraintPart() for name in limited({k: v for k, v in spec.constraints.items() if k in constraints})
        }

    goals = {
        named(name, _objective(part.objectives.get(name, "mean"), -1 if goal == "maximise" else 1)): goal
        for name, goal in spec.objectives.items()
    }
    changed: dict[str, Any] = {"objectives": goals, "constraints": limited(spec.constraints), "robust": None}
    if spec.cases:
        changed["cases"] = {
            case: of.model_copy(update={"constraints": lifted(of.constraints) | limited(of.constraints)})
            for case, of in spec.cases.items()
        }
    responses: list[Response] = []
    statistics: list[tuple[str, Statistic]] = []
    for new, (name, statistic) in asked.items():
        for response in (r for r in study.responses if r.stated == name):
            column = f"{response.column}, {statistic.name}"
            responses.append(Response(name_in(new, response.case), column, response.unit, response.case, new))
            statistics.append((response.column, statistic))
    changed["responses"] = {
        new: ResponsePart(column=spec.column(name), cases=spec.cases_of(name)) if spec.cases else spec.column(name)
        for new, (name, _) in asked.items()
    }
    changed["surrogates"] = {key: value for key, value in spec.surrogates.items() if key == DEFAULT} | {
        new: spec.surrogates[name] for new, (name, _) in asked.items() if name in spec.surrogates
    }
    if isinstance(spec.weights, OwnWeights):
        own = {new: spec.weights.own[asked[new][0]] for new in goals}
        changed["weights"] = spec.weights.model_copy(update={"own": own})
    changed["optimiser"] = spec.optimiser.model_copy(update={"on": part.on})
    if spec.decision.front not in (None, part.on) and part.on != "both":
        changed["decision"] = spec.decision.model_copy(update={"front": None})
    derived = replace(study, spec=spec.model_copy(update=changed), responses=tuple(responses))
    return Robust(study, derived, tuple(statistics))


class Sampler:
    """Simulates many trains as built of each design, as a :class:`Simulator` does one as designed.

    Attributes:
        nominal: the study of the train as designed.
        part: what is asked of robust designs.
    """

    def __init__(self, robust: Robust, simulator: Simulator) -> None:
        """Simulate by the simulator of the nominal study."""
        self._robust, self._simulator, self.nominal = robust, simulator, robust.nominal
        spec = self.nominal.spec.robust
        assert spec is not None
        self.part = spec
        self._columns = tuple(dict.fromkeys(response.column for response in self.nominal.responses))

    @property
    def study(self) -> Study:
        """Of the statistics."""
        return self._robust.study

    @property
    def unseen(self) -> range:
        """The draws of the check: by none of them a design or a margin was found."""
        return range(self.part.check_draws, 2 * self.part.check_draws)

    @property
    def asks(self) -> list[Any]:
        """What its numbers depend on besides the scenarios and points."""
        return [self.part.model_dump(), [[column, vars(of)] for column, of in self._robust.statistics]]

    def at(self, points: FloatArray) -> Designs:
        """Simulate points (n, d) of the space, as many trains of each as the study states."""
        return self._designs(points, {}, range(self.part.draws))

    def check(self, points: FloatArray) -> Designs:
        """Simulate points (n, d) as the check asks, with draws that no search has seen."""
        return self._designs(points, self.study.spec.check.set, self.unseen)

    def sure(self, point: FloatArray) -> FloatArray:
        """The statistics (r,) of a design (d,) as the check asks, but with other draws; quantiles hold surely.

        Raises:
            InputError: if a tolerance does not fit the design.
        """
        return self._statistics(self.trains(point, self.study.spec.check.set, range(self.part.check_draws)), sure=True)

    def as_it_stands(self) -> dict[str, Row]:
        """Status, reason and statistics of the trains of each load case, without the factors of the study."""
        rows = self.trains(None, {}, range(self.part.draws))
        values = self._statistics(rows).tolist()
        found: dict[str, Row] = {case: {"status": Kind.OVER.value, "reason": ""} for case in rows}
        for response, value in zip(self.study.responses, values, strict=True):
            found[response.case][response.column] = value
        return found

    def trains(self, point: FloatArray | None, changes: Mapping[str, Any], draws: range) -> dict[str, list[Row]]:
        """The rows of the trains as built of a design (d,), or of the scenario as it stands, by load case.

        Args:
            point: of the space; None for the scenario as it stands.
            changes: of every scenario besides.
            draws: their numbers.

        Raises:
            InputError: if a tolerance does not fit the design.
        """
        simulator = self._simulator
        design = {} if point is None else simulator.case(point)
        scenarios = {
            case: scenario.with_values({**changes, **design}) for case, scenario in simulator.study.scenarios.items()
        }
        fleet = together({case: scatter_of(scenario) for case, scenario in scenarios.items()})
        found: dict[str, list[Row]] = {case: [] for case in scenarios}
        for first in draws[::_CHUNK]:
            z = normal_draws(fleet.d, min(_CHUNK, draws.stop - first), seed=self.part.seed, first=first)
            for case, scenario in scenarios.items():
                found[case] += simulator.rows(fleet.cases(case, z), scenario, self._columns)
        return found

    def _statistics(self, rows: Mapping[str, Sequence[Row]], sure: bool = False) -> FloatArray:
        """The statistics of the trains, (r,)."""
        pairs = zip(self.study.responses, self._robust.statistics, strict=True)
        return np.array([of.of(numbers_of(rows[response.case], column), sure) for response, (column, of) in pairs])

    def _designs(self, points: FloatArray, changes: Mapping[str, Any], draws: range) -> Designs:
        found: list[FloatArray] = []
        ended: list[tuple[str, str]] = []
        for point in points:
            try:
                rows = self.trains(point, changes, draws)
            except InputError as error:  # the design breaks a rule
                found.append(np.full(len(self.study.responses), np.nan))
                ended.append((Kind.REFUSED, str(error)))
                continue
            found.append(self._statistics(rows))
            ended.append(self._ended(rows, found[-1]))
        status, reason = zip(*ended, strict=True)
        return Designs(self.study, points, np.array(found), status, reason)

    def _ended(self, rows: Mapping[str, Sequence[Row]], values: FloatArray) -> tuple[str, str]:
        """Status and reason of a design: whether it keeps its limits, and how many trains have no numbers."""
        without = [(case, row) for case, of_case in rows.items() for row in of_case if row["status"] in UNUSABLE]
        said = [
            f"{len(without)} of {sum(map(len, rows.values()))} trains have no numbers that may be used, the first "
            + " ".join(filter(None, (f"in load case {case}:" if case else "", row["status"], row["reason"])))
            for case, row in without[:1]
        ]
        broken = [
            limit.text
            for limit, by in zip(self.study.limits, self.study.excess(values[None])[0], strict=True)
            if by > 0
        ]
        return Kind.LIMIT if broken else Kind.OVER, "; ".join((*broken, *said))


def margins(study: Study, models: Models, simulated: Designs, sampler: Sampler) -> Output[dict[str, float]]:
    """How far inside its limits the search on the surrogates must stay for the chosen design to keep them surely.

    The tail of a few hundred trains is uncertain, and a search picks what it flatters. So the design that is chosen is
    built as often as the check asks, by other draws, and where it passes a limit, the margin becomes 1.1 times what the
    prediction was short of.

    Args:
        study: of the statistics.
        models: their surrogates.
        simulated: the design of experiments.
        sampler: builds the trains.

    Returns:
        Margins by the text of each limit.

    Raises:
        InputError: if no design keeps the limits with such margins.
    """
    import pandas as pd

    found = {limit.text: limit.margin for limit in study.limits}
    rows: list[dict[str, Any]] = []
    for attempt in range(1, _ATTEMPTS + 1):
        inside = replace(study, margins=found)
        front = fronts.on_surrogates(inside, models).value
        chosen = decision(inside, front, weights(inside, simulated, front).value).value.chosen
        values = sampler.sure(chosen.points[0])
        passed = ~(study.excess(values[None])[0] <= 0)  # also without a number
        for limit, over in zip(study.limits, passed.tolist(), strict=True):
            k = study.responses.index(limit.response)
            predicted, now = float(chosen.responses[0, k]), float(values[k])
            design = zip(
                (f.head for f in study.space.factors), study.space.decode(chosen.points[0]).values(), strict=True
            )
            row = {"attempt": attempt, **dict(design), "limit": limit.text}
            rows.append(row | {"margin": found[limit.text], "predicted": predicted, "simulated": now, "passed": over})
            if over and np.isfinite(now):
                found = found | {limit.text: _FURTHER * limit.sign * (now - predicted)}
        if not passed.any():
            break
    tables = {"04_margins": pd.DataFrame(rows)}
    facts = {"attempts": attempt, "margins": margins_in(tables), "kept": not passed.any()}
    return Output(margins_in(tables), tables, facts, {})


def margins_in(tables: Tables) -> dict[str, float]:
    """The margins that a table of them ends at."""
    table = tables["04_margins"]
    last = table[table["attempt"] == table["attempt"].max()]
    return dict(zip(last["limit"], last["margin"].astype(float), strict=True))


def held(sampler: Sampler, nominal: Choice, robust: Choice) -> Output[None]:
    """How designs hold: the share of trains as built that pass each limit, and what that costs of the objectives."""
    import pandas as pd

    study, part = sampler.nominal, sampler.part
    designs = {NOMINAL: nominal.chosen.points[0], ROBUST: robust.chosen.points[0]}
    for name, design in part.also.items():
        designs[name] = np.array([factor.encode([design[factor.name]])[0] for factor in study.space.factors])
    rows: list[dict[str, Any]] = []
    spread: list[dict[str, Any]] = []
    used: dict[str, FloatArray] = {}
    for name, point in designs.items():
        try:
            trains = sampler.trains(point, study.spec.check.set, sampler.unseen)
            found = {r: numbers_of(trains[r.case], r.column) for r in study.responses}
        except InputError:  # the design breaks a rule, as the check of it says
            found = dict.fromkeys(study.responses, np.full(part.check_draws, np.nan))
        beyond = np.stack([limit.excess(found[limit.response]) for limit in study.limits])
        unknown = np.asarray(np.isnan(beyond))
        for k, limit in enumerate(study.limits):
            wanted = part.probabilities.get(limit.response.stated, part.probability)
            rows.append({"design": name, "limit": limit.text} | _share(beyond[k] > 0, unknown[k], wanted))
        passed = np.asarray((beyond > 0).any(axis=0))
        lost = np.asarray(unknown.any(axis=0)) & ~passed
        rows.append({"design": name, "limit": ANY} | _share(passed, lost, None))
        scale = np.array([abs(limit.value) or 1.0 for limit in study.limits])
        used[name] = 100.0 * (1.0 + (beyond / scale[:, None]).max(axis=0))
        for response in (r for r in study.responses if r.stated in study.spec.objectives):
            known = found[response][np.isfinite(found[response])]
            enough = known.size >= max(2, _LEAST_USABLE * len(found[response]))
            some = known if enough else np.full(2, np.nan)  # those with numbers may be the better ones
            quantiles = zip(("q5", "q50", "q95"), np.quantile(some, (0.05, 0.5, 0.95)).tolist(), strict=True)
            about = {"design": name, "response": response.name, "unit": response.unit}
            spread.append(about | {"mean": float(some.mean()), "sd": float(some.std(ddof=1)), **dict(quantiles)})
    chosen = study.space.table(np.stack(list(designs.values()))).to_dict("records")
    pictures: dict[str, Callable[[], Figure]] = {"11_probabilities": partial(figures.held, used)}
    if len(study.objectives) > 1:
        statistics = robust.front.study
        pictures["11_fronts"] = partial(
            figures.both_fronts,
            study,
            study.criteria(nominal.front.responses),
            statistics.criteria(robust.front.responses),
            list(statistics.spec.objectives),
        )
    return Output(
        None,
        {"11_probabilities": pd.DataFrame(rows), "11_objectives": pd.DataFrame(spread)},
        {
            "trains": part.check_draws,
            "limits": rows,
            "objectives": spread,
            "designs": dict(zip(designs, chosen, strict=True)),
        },
        pictures,
    )


def _share(passed: NDArray[np.bool_], unknown: NDArray[np.bool_], wanted: float | None) -> dict[str, Any]:
    """The share of trains that pass a limit, with its interval; those without numbers count as such that do."""
    found = proportion(int(passed.sum()), len(passed), failed=int(unknown.sum()))
    return {
        "passed": int(passed.sum()),
        "without_numbers": int(unknown.sum()),
        "probability": found.value,
        "lower": found.lower,
        "upper": found.upper,
        "wanted": wanted,
        "kept": None if wanted is None else found.value <= wanted,
    }
