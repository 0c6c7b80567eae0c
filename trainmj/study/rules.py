"""Rules that concern several parts of a study file: names that must exist, keys that belong together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from trainmj.doe import Factor, parse_terms
from trainmj.errors import InputError, close_match
from trainmj.files.problems import Path, Problem
from trainmj.files.text import FORMULA
from trainmj.scenario import Scenario
from trainmj.study.file import MAX_POINTS, DesignPart, FactorPart, StudyFile
from trainmj.units import unit_of

DEFAULT = "default"

_MOST_SPREAD = 300  # points of an optimal Latin hypercube: every exchange looks at all distances
_MOST_CORNERED = 10  # factors of a central composite design
_MOST_STEPS = 1e9  # of a resolution over the range of a factor
_HIGHEST = 9  # exponent of a term
_MOST_COMBINATIONS = 100_000  # of exponents that are gone through for the terms up to an order
_MOST_PREDICTED = 10_000_000
_MOST_SIMULATED = 1_000_000

_DESIGN_KEYS = {
    "optimal_latin_hypercube": {"n": True, "seed": False, "placement": False},
    "sobol": {"n": True, "seed": False},
    "full_factorial": {"levels": False},
    "central_composite": {"form": False},
    "table": {"file": True},
}


def broken_rules(spec: StudyFile, scenario: Scenario) -> Iterator[Problem]:
    """Every rule that the parts of a study file break between them."""
    yield from _factors(spec, scenario)
    yield from _responses(spec)
    yield from _design(spec)
    yield from _surrogates(spec)
    yield from _criteria(spec)
    yield from _optimiser(spec)
    yield from _weights(spec)
    yield from _decision(spec)
    yield from _paths(("check", "set"), spec.check.set, scenario)


def factor_of(name: str, part: FactorPart) -> Factor:
    """The factor that a part states.

    Raises:
        InputError: if bounds, kind and levels do not fit together.
    """
    kind = part.kind or ("choice" if part.levels is not None else "continuous")
    if kind != "choice" and part.bounds is None:
        raise InputError("needs bounds: the lower and the upper one, as in bounds: [20, 50]")
    if kind == "choice" and part.levels is None:
        raise InputError("is a choice and needs levels: the values it takes")
    if part.bounds is not None and part.levels is not None:
        raise InputError("takes either bounds, or levels, not both")
    if any(not isinstance(level, (str, int, float)) for level in part.levels or ()):
        raise InputError("has levels that are neither numbers nor text")
    if any(isinstance(level, str) and level.startswith(FORMULA) for level in part.levels or ()):
        raise InputError(f"has a level that begins with one of {' '.join(FORMULA)}, a formula to a spreadsheet")
    sets = targets_of(part)
    unit = part.unit if part.unit is not None else unit_of(sets[0])
    if part.levels is not None:
        return Factor(name, unit=unit, kind=kind, levels=tuple(part.levels))
    lower, upper = part.bounds or [0.0, 0.0]
    return Factor(name, lower, upper, unit=unit, kind=kind)


def targets_of(part: FactorPart) -> tuple[str, ...]:
    """The parameters and paths that a factor sets."""
    return (part.sets,) if isinstance(part.sets, str) else tuple(part.sets)


def paths_set(spec: StudyFile, scenario: Scenario) -> Iterator[Problem]:
    """Values of ``set`` that lead nowhere; looked at before the scenario is changed by them."""
    yield from _paths(("set",), spec.set, scenario)


def _paths(where: Path, names: Iterable[str], scenario: Scenario) -> Iterator[Problem]:
    for name in names:
        try:
            scenario.locate(name)
        except InputError as error:
            yield Problem((*where, name), str(error))


def _factors(spec: StudyFile, scenario: Scenario) -> Iterator[Problem]:
    owner: dict[str, str] = {}
    for name, part in spec.factors.items():
        at: Path = ("factors", name)
        try:
            factor_of(name, part)
        except InputError as error:
            yield Problem(at, str(error).removeprefix(f"factor {name!r}: "))
        for target in targets_of(part):
            yield from (Problem((*at, "sets"), p.rule) for p in _paths((), [target], scenario))
            paths = scenario.parameters.get(target, target)
            for path in [paths] if isinstance(paths, str) else paths:
                if path in owner:
                    yield Problem((*at, "sets"), f"is set by the factor {owner[path]} already")
                owner[path] = name
            if target in spec.set:
                yield Problem((*at, "sets"), "is fixed under set: leave it out there")


def _responses(spec: StudyFile) -> Iterator[Problem]:
    for name in spec.responses:
        if name in spec.factors:
            yield Problem(("responses", name), "is the name of a factor: choose another")
        if name == DEFAULT:
            yield Problem(("responses", name), "is kept for the surrogate of all others: choose another")


def _design(spec: StudyFile) -> Iterator[Problem]:
    design = spec.design
    allowed = _DESIGN_KEYS[design.kind]
    for key in ("n", "seed", "placement", "levels", "form", "file"):
        given = getattr(design, key) is not None
        if given and key not in allowed:
            yield Problem(("design", key), f"does not belong to a {design.kind}; its keys: {', '.join(allowed)}")
        if not given and allowed.get(key):
            yield Problem(("design",), f"is a {design.kind} and needs {key}")
    yield from _names(("design", "levels"), design.levels or {}, spec.factors, "factor")
    if design.kind == "full_factorial":
        yield from _levels(spec, design)
    if design.kind == "optimal_latin_hypercube" and (design.n or 0) > _MOST_SPREAD:
        yield Problem(("design", "n"), f"must be at most {_MOST_SPREAD} for points spread best; sobol takes more")
    if design.kind == "central_composite" and len(spec.factors) > _MOST_CORNERED:
        yield Problem(("design",), f"takes at most {_MOST_CORNERED} factors, whose corners it has all")
    yield from _resolution(spec, ("design", "resolution"), design.resolution)


def _levels(spec: StudyFile, design: DesignPart) -> Iterator[Problem]:
    for name, part in spec.factors.items():
        free = part.levels is None and part.kind in (None, "continuous")
        if free and name not in (design.levels or {}) and name not in design.resolution:
            yield Problem(("design",), f"needs levels for the continuous factor {name}, as in levels: {{{name}: 5}}")
            return
    count = math.prod(_count(name, part, design) for name, part in spec.factors.items())
    if count > MAX_POINTS:
        yield Problem(("design",), f"has more than {MAX_POINTS} points: give fewer levels")


def _count(name: str, part: FactorPart, design: DesignPart) -> int:
    """How many values a factor takes in a full factorial."""
    if design.levels and name in design.levels:
        return design.levels[name]
    if part.levels is not None:
        return len(part.levels)
    lower, upper = part.bounds or [0.0, 0.0]
    return max(0, int((upper - lower) / design.resolution.get(name, 1.0) + 0.5)) + 1


def _resolution(spec: StudyFile, at: Path, resolution: dict[str, float]) -> Iterator[Problem]:
    yield from _names(at, resolution, spec.factors, "factor")
    for name, step in resolution.items():
        part = spec.factors.get(name)
        if part is None:
            continue
        if part.bounds is None or part.kind not in (None, "continuous"):
            yield Problem((*at, name), "is for continuous factors only")
            continue
        count = (part.bounds[1] - part.bounds[0]) / step
        if not 0.5 <= count <= _MOST_STEPS or abs(count - round(count)) > 1e-6:
            yield Problem(
                (*at, name), f"must divide the range of {name}, from {part.bounds[0]:g} to {part.bounds[1]:g}"
            )


def _surrogates(spec: StudyFile) -> Iterator[Problem]:
    yield from _names(("surrogates",), spec.surrogates, {*spec.responses, DEFAULT}, "response")
    for name, part in spec.surrogates.items():
        at: Path = ("surrogates", name)
        if part.kind == "kriging":
            for key in ("order", "terms", "selection"):
                if key in part.model_fields_set:
                    yield Problem((*at, key), "belongs to a polynomial; kriging has no terms")
        elif part.terms is not None:
            if part.order is not None:
                yield Problem(at, "takes either order or terms, not both")
            try:
                terms = parse_terms(part.terms, list(spec.factors))
                if max(map(max, terms)) > _HIGHEST:
                    yield Problem((*at, "terms"), f"must not have an exponent above {_HIGHEST}")
            except InputError as error:
                yield Problem((*at, "terms"), str(error))
        elif ((part.order or 2) + 1) ** len(spec.factors) > _MOST_COMBINATIONS:
            yield Problem(at, f"has too many terms with {len(spec.factors)} factors: state the terms, or use kriging")


def _criteria(spec: StudyFile) -> Iterator[Problem]:
    yield from _names(("objectives",), spec.objectives, spec.responses, "response")
    yield from _names(("constraints",), spec.constraints, spec.responses, "response")
    for name, limit in spec.constraints.items():
        if limit.at_most is None and limit.at_least is None:
            yield Problem(("constraints", name), "needs at_most, at_least or both")
        elif limit.at_most is not None and limit.at_least is not None and limit.at_least > limit.at_most:
            yield Problem(("constraints", name, "at_least"), f"must not exceed at_most ({limit.at_most:g})")


def _optimiser(spec: StudyFile) -> Iterator[Problem]:
    yield from _resolution(spec, ("optimiser", "resolution"), spec.optimiser.resolution)
    for target, most in (("surrogate", _MOST_PREDICTED), ("simulator", _MOST_SIMULATED)):
        swarm = getattr(spec.optimiser, target)
        if swarm.particles * swarm.iterations > most:
            yield Problem(("optimiser", target), f"asks for more than {most} evaluations: take less of both")
        if target in spec.optimiser.model_fields_set and spec.optimiser.on not in (target, "both"):
            yield Problem(("optimiser", target), f"is not used: the search is on the {spec.optimiser.on}")


def _weights(spec: StudyFile) -> Iterator[Problem]:
    weights = spec.weights
    for key in ("form", "data", "of"):
        if getattr(weights, key) is not None and weights.method != "entropy":
            yield Problem(("weights", key), f"belongs to method: entropy, not {weights.method}")
    if weights.own is not None and weights.method != "own":
        yield Problem(("weights", "own"), f"needs method: own, not {weights.method}")
    if weights.method != "own":
        return
    own = weights.own or {}
    yield from _names(("weights", "own"), own, spec.objectives, "objective")
    missing = [name for name in spec.objectives if name not in own]
    if missing:
        yield Problem(("weights",), f"needs own: a weight for {', '.join(missing)}")
    elif sum(own.values()) == 0:
        yield Problem(("weights", "own"), "must not all be 0")


def _decision(spec: StudyFile) -> Iterator[Problem]:
    decision, on = spec.decision, spec.optimiser.on
    if decision.normalisation is not None and decision.method == "knee":
        yield Problem(("decision", "normalisation"), "does not belong to a knee point, which takes min_max")
    if decision.front is not None and on not in (decision.front, "both"):
        yield Problem(("decision", "front"), f"is not searched: the optimiser works on the {on}")


def _names(at: Path, names: Iterable[str], known: Iterable[str], what: str) -> Iterator[Problem]:
    offered = list(known)
    for name in names:
        if name not in offered:
            yield Problem((*at, name), f"there is no {what} of this name{close_match(name, offered)}")
