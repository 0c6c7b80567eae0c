"""Rules between the parts of a study file: names that must exist, values that must fit together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from trainmj.cases.effect import idle, idle_held
from trainmj.cases.load_cases import in_case, in_vain
from trainmj.collision.chain import Chain
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import Column, columns_of, in_place_of, no_number
from trainmj.doe import Factor, parse_terms
from trainmj.errors import InputError, close_match
from trainmj.files.source import Path, Problem, dotted
from trainmj.files.text import FORMULA, is_formula
from trainmj.scenario import Scenario
from trainmj.scenario.files import nowhere, refusal, refused
from trainmj.study.file import (
    MAX_POINTS,
    CentralComposite,
    ChoiceFactor,
    ConstraintPart,
    ContinuousFactor,
    FactorPart,
    FullFactorial,
    FullPolynomial,
    GivenPoints,
    IntegerFactor,
    OwnWeights,
    PolynomialOfTerms,
    ResponsePart,
    StudyFile,
    name_in,
)
from trainmj.units import head

DEFAULT = "default"
NOMINAL, ROBUST = "nominal", "robust"
"""The designs that are chosen for the train as designed, and for the trains as built."""

_TAKEN = ("test", "status", "reason", "method", "picked_for", "rank", "score", "share_of_near_weights", "kept")
"""Columns that the study's tables have beside factors and responses."""

_MOST_CORNERED = 10  # factors of a central composite design
_MOST_STEPS = 1e9  # of a resolution over the range of a factor
_HIGHEST = 9  # exponent of a term
_MOST_COMBINATIONS = 100_000  # of exponents, among which the terms up to an order are found
_MOST_EVALUATIONS = {"surrogate": 10_000_000, "simulator": 1_000_000}


def broken_rules(spec: StudyFile, scenarios: Mapping[str, Scenario], chains: Mapping[str, Chain]) -> Iterator[Problem]:
    """Every rule that the parts of a study file break between them.

    Args:
        spec: the parts.
        scenarios: by load case, with the values under ``set``; one under no name, "", if there are none.
        chains: of the scenarios, which have the responses.
    """
    yield from _cases(spec)
    said: set[Path] = set()
    for case, scenario in scenarios.items():
        for problem in in_case(case, _of_case(spec, case, scenario, chains[case])):
            if problem.path not in said:
                yield problem
            said.add(problem.path)
    if not said:
        yield from _idle(spec, scenarios)
    yield from _heads(spec, {case: columns_of(chain) for case, chain in chains.items()})
    yield from _design(spec)
    yield from _surrogates(spec)
    yield from _criteria(spec)
    yield from _optimiser(spec)
    yield from _weights(spec)
    yield from _robust(spec)


def _of_case(spec: StudyFile, case: str, scenario: Scenario, chain: Chain) -> Iterator[Problem]:
    """The rules that the scenario of a load case, or of the whole study, is asked for."""
    yield from _factors(spec, case, scenario)
    yield from _responses(spec, case, chain)
    yield from _everywhere(spec, case, scenario, chain)
    yield from _check(spec, scenario)
    if spec.robust:
        yield from in_vain(("factors",), {name: part.targets for name, part in spec.factors.items()}, scenario)
    yield from _also(spec, scenario)
    yield from refused(("check", "set"), {name: {name: value} for name, value in spec.check.set.items()}, scenario)


def _cases(spec: StudyFile) -> Iterator[Problem]:
    """Load cases that responses and limits name."""
    for name, part in spec.responses.items():
        if isinstance(part, ResponsePart):
            yield from _names(("responses", name, "cases"), part.cases, spec.cases or (), "load case")
    for case, of in (spec.cases or {}).items():
        yield from _limits(("cases", case, "constraints"), of.constraints, spec)
        for name in of.constraints.keys() & spec.responses.keys():
            if case not in spec.cases_of(name):
                yield Problem(("cases", case, "constraints", name), "is not asked in this load case")


def factor_of(name: str, part: FactorPart) -> Factor:
    """The factor that a part states.

    Raises:
        InputError: if levels are not different, or the bounds of an integer not whole.
    """
    if isinstance(part, ChoiceFactor):
        return Factor(name, unit=part.stated_unit, kind="choice", levels=tuple(part.levels))
    lower, upper = part.bounds
    return Factor(name, lower, upper, unit=part.stated_unit, kind=part.kind)


def _factors(spec: StudyFile, case: str, scenario: Scenario) -> Iterator[Problem]:
    fixed_in = {("set",): spec.set} | ({("cases", case, "set"): spec.cases[case].set} if spec.cases else {})
    owner: dict[str, str] = {}
    for name, part in spec.factors.items():
        at: Path = ("factors", name)
        sets: Path = (*at, "sets")
        try:
            factor_of(name, part)
        except InputError as error:
            yield Problem(at, str(error).removeprefix(f"factor {name!r}: "))
        for k, level in enumerate(part.levels if isinstance(part, ChoiceFactor) else ()):
            if isinstance(level, str) and is_formula(level):
                rule = f"begins with one of {' '.join(FORMULA)}, as a spreadsheet's formulas"
                yield Problem((*at, "levels", k), rule)
        yield from nowhere([(sets, target) for target in part.targets], scenario)
        for target in part.targets:
            twice = next((owner[other] for other in owner if scenario.overlap(target, other)), None)
            if twice is not None:
                yield Problem(sets, f"is already set by the factor {twice}")
            owner[target] = name
            for group, stated in fixed_in.items():
                if any(scenario.overlap(target, fixed) for fixed in stated):
                    yield Problem(sets, f"is fixed under {dotted(group)}: leave it out there")


def _idle(spec: StudyFile, scenarios: Mapping[str, Scenario]) -> Iterator[Problem]:
    """Factors, and values that are set, which have no effect in any design."""
    blocks: list[dict[str, list[Any]]] = []
    for part in spec.factors.values():
        values: list[Any] = list(part.levels if isinstance(part, ChoiceFactor) else part.bounds)
        blocks.append(dict.fromkeys(part.targets, values))
    factors = {part.targets: name for name, part in spec.factors.items()}
    for targets, rule in idle(scenarios.values(), blocks, [*factors], ["tolerances"] if spec.robust else ()):
        yield Problem(("factors", factors[tuple(targets)], "sets"), rule)
    for name, rule in idle_held(scenarios.values(), spec.set, blocks):
        yield Problem(("set", name), rule)
    for case, of in (spec.cases or {}).items():
        for name, rule in idle_held([scenarios[case]], of.set, blocks):
            yield Problem(("cases", case, "set", name), rule)


def _check(spec: StudyFile, scenario: Scenario) -> Iterator[Problem]:
    """Factors that the check would take back: it would simulate another design than the chosen one."""
    for fixed in spec.check.set:
        for name, part in spec.factors.items():
            if any(scenario.overlap(target, fixed) for target in part.targets):
                yield Problem(
                    ("check", "set", fixed), f"is set by the factor {name}: the check is of the chosen design"
                )


def _also(spec: StudyFile, scenario: Scenario) -> Iterator[Problem]:
    """Further designs of a robust study that the scenario refuses, as it is or as the check changes it."""
    for name, design in spec.robust.also.items() if spec.robust else ():
        values = {
            target: value for f, value in design.items() if f in spec.factors for target in spec.factors[f].targets
        }
        if any(nowhere((((), target) for target in values), scenario)):
            continue  # said of the factor
        if reason := refusal({**spec.check.set, **values}, scenario):
            yield Problem(("robust", "also", name), f"the scenario does not take it: {reason}")


def _responses(spec: StudyFile, case: str, chain: Chain) -> Iterator[Problem]:
    for name, reason in _without_number(spec, case, chain):
        yield Problem(("responses", name), reason)
    for name in spec.responses:
        at: Path = ("responses", name)
        if name in spec.factors:
            yield Problem(at, "is the name of a factor: choose another")
        if name == DEFAULT:
            yield Problem(at, "is reserved for the surrogate of all others: choose another")


def _everywhere(spec: StudyFile, case: str, scenario: Scenario, as_it_stands: Chain) -> Iterator[Problem]:
    """Factors of values that the scenario refuses; responses that a value, or the check, leaves without a number."""
    ends = []
    for name, part in spec.factors.items():
        values: list[Any] = list(part.levels if isinstance(part, ChoiceFactor) else part.bounds)
        ends += [(dict.fromkeys(part.targets, value), f"with {name} = {value}") for value in values]
        tried = values if isinstance(part, ChoiceFactor) else [*values, sum(values) // 2]
        reasons = [refusal(dict.fromkeys(part.targets, value), scenario) for value in tried]
        if all(reasons) and not any(nowhere((((), target) for target in part.targets), scenario)):
            said = ", ".join(f"{value!r}" for value in tried[:3])
            yield Problem(("factors", name), f"the scenario takes none of {said}: {reasons[0]}")
    lost = {name for name, _ in _without_number(spec, case, as_it_stands)}  # said already
    for changes, where in (*ends, (spec.check.set, "in the check")):
        try:
            chain = line_up(scenario.with_values(changes))
        except InputError:
            continue  # said elsewhere, or the row of the case says why
        for name, reason in _without_number(spec, case, chain):
            if name not in lost:
                lost.add(name)
                yield Problem(("responses", name), f"{where}: {reason}")


def _without_number(spec: StudyFile, case: str, chain: Chain) -> Iterator[tuple[str, str]]:
    """The responses of a load case that its chain does not have, or not as numbers, and why."""
    columns = columns_of(chain)
    for name in spec.responses:
        column = spec.column(name)
        if case not in spec.cases_of(name):
            continue
        if column not in columns:
            yield name, f"the scenario has no response of this name{in_place_of(column, columns)}"
        elif reason := no_number(columns[column], chain):
            yield name, reason


def _heads(spec: StudyFile, columns: Mapping[str, Mapping[str, Column]]) -> Iterator[Problem]:
    """Factors and responses that would share the name of a column in the study's tables."""
    taken = set(_TAKEN)
    said: dict[str, tuple[str, str]] = {}  # by name in the tables, the response that it is of, and its unit
    made = [(("factors", name), head(name, part.stated_unit)) for name, part in spec.factors.items()]
    for name in spec.responses:
        units = {case: of[spec.column(name)].unit for case, of in columns.items() if spec.column(name) in of}
        names = [(name_in(name, case), units[case]) for case in spec.cases_of(name) if case in units]
        if spec.cases and name in spec.objectives and names:  # the worst of them, too
            names.append((name, names[0][1]))
        for named in names:
            other, unit = said.setdefault(named[0], (name, named[1]))
            if other != name and unit != named[1]:  # the columns tell them apart, their rows do not
                rule = f"is {named[0]} in the tables, as {other} is: choose another name"
                yield Problem(("responses", name), rule)
        made += [(("responses", name), head(*named)) for named in names]
    for (group, name), column in made:
        if column in taken and name not in spec.factors.keys() & spec.responses.keys():
            yield Problem((group, name), f"makes a second column {column!r} in the study's tables: choose another name")
        taken.add(column)


def _design(spec: StudyFile) -> Iterator[Problem]:
    design = spec.design
    if isinstance(design, GivenPoints):
        return
    if isinstance(design, FullFactorial):
        yield from _names(("design", "levels"), design.levels, spec.factors, "factor")
        yield from _levels(spec, design)
    if isinstance(design, CentralComposite) and len(spec.factors) > _MOST_CORNERED:
        yield Problem(("design",), f"takes at most {_MOST_CORNERED} factors, because it has all their corners")
    yield from _resolution(spec, ("design", "resolution"), design.resolution)


def _levels(spec: StudyFile, design: FullFactorial) -> Iterator[Problem]:
    for name, part in spec.factors.items():
        if isinstance(part, ContinuousFactor) and name not in design.levels and name not in design.resolution:
            yield Problem(("design",), f"needs levels for the continuous factor {name}, as in levels: {{{name}: 5}}")
            return
    count = math.prod(_count(name, part, design) for name, part in spec.factors.items())
    if count > MAX_POINTS:
        yield Problem(("design",), f"has more than {MAX_POINTS} points: give fewer levels")


def _count(name: str, part: FactorPart, design: FullFactorial) -> int:
    """How many values a factor takes in a full factorial."""
    if name in design.levels:
        return design.levels[name]
    if isinstance(part, ChoiceFactor):
        return len(part.levels)
    lower, upper = part.bounds
    return max(0, int((upper - lower) / design.resolution.get(name, 1.0) + 0.5)) + 1


def _resolution(spec: StudyFile, at: Path, resolution: dict[str, float]) -> Iterator[Problem]:
    yield from _names(at, resolution, spec.factors, "factor")
    for name, step in resolution.items():
        match spec.factors.get(name):
            case ContinuousFactor(bounds=[lower, upper]):
                count = (upper - lower) / step
                if not 0.5 <= count <= _MOST_STEPS or abs(count - round(count)) > 1e-6:
                    yield Problem((*at, name), f"must divide the range of {name}, from {lower:g} to {upper:g}")
            case IntegerFactor() | ChoiceFactor():
                yield Problem((*at, name), "is for continuous factors only")


def _surrogates(spec: StudyFile) -> Iterator[Problem]:
    yield from _names(("surrogates",), spec.surrogates, {*spec.responses, DEFAULT}, "response")
    for name, part in spec.surrogates.items():
        at: Path = ("surrogates", name)
        if isinstance(part, PolynomialOfTerms):
            try:
                terms = parse_terms(part.terms, list(spec.factors))
                if max(map(max, terms)) > _HIGHEST:
                    yield Problem((*at, "terms"), f"must not have an exponent above {_HIGHEST}")
            except InputError as error:
                yield Problem((*at, "terms"), str(error))
        elif isinstance(part, FullPolynomial) and (part.order + 1) ** len(spec.factors) > _MOST_COMBINATIONS:
            yield Problem(at, f"has too many terms with {len(spec.factors)} factors: state the terms, or use kriging")


def _criteria(spec: StudyFile) -> Iterator[Problem]:
    yield from _names(("objectives",), spec.objectives, spec.responses, "response")
    yield from _limits(("constraints",), spec.constraints, spec)


def _limits(at: Path, constraints: Mapping[str, ConstraintPart], spec: StudyFile) -> Iterator[Problem]:
    yield from _names(at, constraints, spec.responses, "response")
    for name, limit in constraints.items():
        if limit.at_most is None and limit.at_least is None:
            yield Problem((*at, name), "needs at_most, at_least or both")
        elif limit.at_most is not None and limit.at_least is not None and limit.at_least > limit.at_most:
            yield Problem((*at, name, "at_least"), f"must not exceed at_most ({limit.at_most:g})")


def _optimiser(spec: StudyFile) -> Iterator[Problem]:
    optimiser = spec.optimiser
    yield from _resolution(spec, ("optimiser", "resolution"), optimiser.resolution)
    for target, most in _MOST_EVALUATIONS.items():
        swarm = getattr(optimiser, target)
        if swarm.particles * swarm.iterations > most:
            yield Problem(("optimiser", target), f"asks for more than {most} evaluations: reduce both")
        searched = {optimiser.on, spec.robust.on if spec.robust else optimiser.on}
        if target in optimiser.model_fields_set and searched.isdisjoint((target, "both")):
            yield Problem(("optimiser", target), f"is not used: the search is on the {optimiser.on}")
    if spec.decision.front is not None and optimiser.on not in (spec.decision.front, "both"):
        yield Problem(("decision", "front"), f"is not searched: the optimiser works on the {optimiser.on}")


def _weights(spec: StudyFile) -> Iterator[Problem]:
    if not isinstance(spec.weights, OwnWeights):
        return
    own = spec.weights.own
    yield from _names(("weights", "own"), own, spec.objectives, "objective")
    missing = [name for name in spec.objectives if name not in own]
    if missing:
        yield Problem(("weights", "own"), f"needs a weight for {', '.join(missing)}")
    elif sum(own.values()) == 0:
        yield Problem(("weights", "own"), "must not all be 0")


def _robust(spec: StudyFile) -> Iterator[Problem]:
    if spec.robust is None:
        return
    at: Path = ("robust",)
    yield from _names((*at, "objectives"), spec.robust.objectives, spec.objectives, "objective")
    limited = {*spec.constraints, *(name for case in (spec.cases or {}).values() for name in case.constraints)}
    yield from _names((*at, "probabilities"), spec.robust.probabilities, limited, "constraint")
    if not limited:
        yield Problem(at, "has nothing to hold: state constraints")
    if spec.robust.check_draws < 2 * spec.robust.draws:
        rule = f"must be at least twice the {spec.robust.draws} draws of the search: it tells how much these say"
        yield Problem((*at, "check_draws"), rule)
    for name, design in spec.robust.also.items():
        there = (*at, "also", name)
        yield from _names(there, design, spec.factors, "factor")
        if missing := [factor for factor in spec.factors if factor not in design]:
            yield Problem(there, f"needs a value for {', '.join(missing)}")
        if name in (NOMINAL, ROBUST):
            yield Problem(there, "is the name of a design that is chosen: choose another")
        for factor, value in design.items():
            try:
                factor_of(factor, spec.factors[factor]).encode([value]) if factor in spec.factors else None
            except InputError as error:
                yield Problem((*there, factor), str(error).removeprefix(f"factor {factor!r}: "))


def _names(at: Path, names: Iterable[str], known: Iterable[str], what: str) -> Iterator[Problem]:
    offered = list(known)
    for name in names:
        if name not in offered:
            yield Problem((*at, name), f"there is no {what} of this name{close_match(name, offered)}")
