"""Rules that concern several parts of a targets file: names that must exist, values that must fit together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from trainmj.errors import InputError, close_match
from trainmj.files.problems import Path, Problem
from trainmj.identification.data import Observation
from trainmj.identification.file import MAX_PARAMETERS, MAX_VALUES, CurvePart, ParameterPart, SetPart, TargetsFile
from trainmj.identification.sums import parse_sum
from trainmj.identification.unknowns import Setting, curve_points
from trainmj.scenario import Scenario
from trainmj.units import unit_of


def broken_rules(
    spec: TargetsFile, scenario: Scenario, fitted: Sequence[Observation], held_out: Sequence[Observation]
) -> Iterator[Problem]:
    """Every rule that the parts of a targets file break between them."""
    parameters = [*_parameters(spec, scenario), *_curves(spec, scenario)]
    yield from parameters or _starts(spec, scenario)
    yield from _order(spec)
    yield from _constraints(spec, scenario)
    yield from _targets(spec)
    yield from _data(spec, scenario)
    yield from _percentages(spec, [*fitted, *held_out])
    if fitted and not parameters:
        yield from _enough(spec, scenario, fitted)
    for key, found in (("data", fitted), ("held_out", held_out)):
        if len(found) > MAX_VALUES:
            yield Problem((key,), f"states {len(found)} values, more than {MAX_VALUES}")


def settings_of(part: ParameterPart, scenario: Scenario) -> tuple[Setting, ...]:
    """The places that a parameter sets; a short name of the scenario stands for all of its paths."""
    settings = []
    for one in part.sets if isinstance(part.sets, list) else [part.sets]:
        given = SetPart(path=one) if isinstance(one, str) else one
        paths = scenario.parameters.get(given.path, given.path)
        settings += [
            Setting(path, given.factor, given.offset) for path in ([paths] if isinstance(paths, str) else paths)
        ]
    return tuple(settings)


def member_name(curve: str, stroke_mm: float) -> str:
    """What an inner force of a curve that is sought as a whole is called."""
    return f"{curve}_{stroke_mm:g}mm"


def unit_of_path(path: str) -> str:
    """The unit at the end of a path, or before the number of a point."""
    return next((unit for key in reversed(path.split(".")) if (unit := unit_of(key))), "")


def _alone(spec: TargetsFile) -> dict[str, ParameterPart]:
    """The parameters that are single values."""
    return {name: part for name, part in spec.parameters.items() if isinstance(part, ParameterPart)}


def _whole(spec: TargetsFile) -> dict[str, CurvePart]:
    """The parameters that are curves."""
    return {name: part for name, part in spec.parameters.items() if isinstance(part, CurvePart)}


def _parameters(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    owner: dict[str, str] = {}
    for name, part in _alone(spec).items():
        at: Path = ("parameters", name)
        low, high = part.bounds
        if not low < high:
            yield Problem((*at, "bounds"), f"must be a lower and a higher one, as in [{min(low, high):g}, 100]")
            continue
        if part.scale == "log" and low <= 0:
            yield Problem((*at, "bounds"), f"must be greater than 0 on a log scale; the lower one is {low:g}")
            continue
        if part.start is not None and not low <= part.start <= high:
            yield Problem((*at, "start"), f"must be within the bounds, {low:g} to {high:g}")
            continue
        broken = list(_settings(at, part, scenario, part.start is None))
        yield from broken
        if broken:
            continue
        settings = settings_of(part, scenario)
        start = start_of(settings, scenario) if part.start is None else part.start
        if not low <= start <= high:
            yield Problem(
                (*at, "bounds"), f"leave out the {start:g} that the scenario has now: widen them, or state a start"
            )
            continue
        for path in (s.path for s in settings):
            if path in owner:
                yield Problem((*at, "sets"), f"{path} is set by {_by(owner[path], name)} already")
            owner[path] = name
            if path in spec.set:
                yield Problem((*at, "sets"), f"{path} is fixed under set: leave it out there")


def _curves(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    known = [f"curves.{curve}" for curve in scenario.curves]
    paths = {s.path: name for name, part in _alone(spec).items() for s in settings_of(part, scenario)}
    seen: dict[str, str] = {}
    total = len(spec.parameters)
    for name, part in _whole(spec).items():
        at: Path = ("parameters", name)
        try:
            if not isinstance(found := scenario.locate(part.curve)[0], dict):
                raise TypeError(_kind(found))
            stroke, force = curve_points(scenario.values(), part.curve)
        except (LookupError, TypeError, ValueError, InputError):
            yield Problem((*at, "curve"), f"must be the path of a curve with points{close_match(part.curve, known)}")
            continue
        total += stroke.size - 3
        if stroke.size < 3:
            yield Problem((*at, "curve"), "has no points between its first and its last one: state the strokes wanted")
        elif not force[0] < force[-1]:
            rule = f"must rise: its last force ({force[-1]:g} kN) is not above its first one ({force[0]:g} kN)"
            yield Problem((*at, "curve"), rule)
        if part.curve in seen:
            yield Problem((*at, "curve"), f"is sought by the parameter {seen[part.curve]} already")
        seen[part.curve] = name
        for path, owner in paths.items():
            if path.startswith(f"{part.curve}."):
                yield Problem((*at, "curve"), f"is sought whole, and {path} by {owner} besides: leave one of them out")
        for path in spec.set:
            if _within(path, part.curve) or _within(part.curve, path):
                yield Problem((*at, "curve"), f"is fixed under set by {path}: leave it out there")
        for u in stroke[1:-1]:
            if member_name(name, u) in spec.parameters:
                rule = f"has a force called {member_name(name, u)}, as another parameter is: choose another name"
                yield Problem(at, rule)
    if total > MAX_PARAMETERS:
        yield Problem(("parameters",), f"are {total}, the forces of curves counted, more than {MAX_PARAMETERS}")


def _starts(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    """What is wrong with the start values, by parameter where one is wrong by itself."""
    starts = {name: _at_start(part, scenario) for name, part in _alone(spec).items()}
    rule = _refused({path: value for changes in starts.values() for path, value in changes.items()}, scenario)
    if rule is None:
        return
    alone = {name: _refused(changes, scenario) for name, changes in starts.items()}
    wrong = [Problem(("parameters", name), f"at its start: {rule}") for name, rule in alone.items() if rule is not None]
    yield from wrong or [Problem(("parameters",), f"at their start: {rule}")]


def _at_start(part: ParameterPart, scenario: Scenario) -> dict[str, float]:
    settings = settings_of(part, scenario)
    start = start_of(settings, scenario) if part.start is None else part.start
    return {s.path: s.factor * start + s.offset for s in settings}


def _refused(changes: Mapping[str, Any], scenario: Scenario) -> str | None:
    try:
        scenario.with_values(changes)
    except InputError as error:
        return str(error)
    return None


def start_of(settings: Sequence[Setting], scenario: Scenario) -> float:
    """The value of a parameter that the scenario has now, read from the first place that it sets."""
    first = settings[0]
    return (float(scenario.locate(first.path)[0]) - first.offset) / first.factor


def _by(owner: str, name: str) -> str:
    return "this parameter" if owner == name else f"the parameter {owner}"


def _settings(at: Path, part: ParameterPart, scenario: Scenario, start: bool) -> Iterator[Problem]:
    """What is wrong with the places that a parameter sets; the first one must have a value if the start is not said."""
    stated = part.sets if isinstance(part.sets, list) else [part.sets]
    for n, one in enumerate(stated):
        where: Path = (*at, "sets", n) if isinstance(part.sets, list) else (*at, "sets")
        path, factor = (one, 1.0) if isinstance(one, str) else (one.path, one.factor)
        if factor == 0:
            yield Problem((*where, "factor"), "must not be 0")
        try:
            values = scenario.locate(path)
        except InputError as error:
            yield Problem(where, str(error))
            continue
        if n == 0 and start and values[0] is None:
            yield Problem(at, f"needs a start: the scenario states no {path.rpartition('.')[2]} there")
        for value in values:
            if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
                yield Problem(where, f"must lead to a number, not to {_kind(value)}{_inside(path, value)}")


def _kind(value: Any) -> str:
    return "a group" if isinstance(value, dict) else "a list" if isinstance(value, list) else f"{value!a}"


def _inside(path: str, value: Any) -> str:
    """How to go on from a list or a group to the number that is meant."""
    if isinstance(value, list) and value:
        return f": choose one of its {len(value)}, as in {path}.{len(value) - 1}"
    return f": choose one of {', '.join(map(str, value))}" if isinstance(value, dict) and value else ""


def _order(spec: TargetsFile) -> Iterator[Problem]:
    solved = {c.by for c in spec.constraints.values()}
    alone = _alone(spec)
    for name, part in alone.items():
        at: Path = ("parameters", name, "above")
        if part.above is None:
            if "gap" in part.model_fields_set:
                yield Problem(("parameters", name, "gap"), "needs above: the parameter that this one stays above")
            continue
        below = alone.get(part.above)
        if part.above in _whole(spec):
            yield Problem(at, "is a curve: name a single value")
        elif below is None:
            yield Problem(at, f"there is no parameter of this name{close_match(part.above, alone)}")
        elif part.above in solved:
            yield Problem(at, "is solved from a constraint, after this one: name a parameter that is sought")
        elif _in_circle(name, alone):
            yield Problem(at, "leads back to this parameter: break the circle")
        elif part.bounds[1] < below.bounds[1] + part.gap:
            yield Problem(
                ("parameters", name, "bounds"),
                f"must reach up to {below.bounds[1] + part.gap:g}, so that there is room above {part.above} at its "
                "upper bound",
            )


def _in_circle(name: str, alone: Mapping[str, ParameterPart]) -> bool:
    seen = {name}
    above = alone[name].above
    while above is not None and above in alone:
        if above in seen:
            return above == name
        seen.add(above)
        above = alone[above].above
    return False


def _constraints(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    owner: dict[str, str] = {}
    for name, c in spec.constraints.items():
        at: Path = ("constraints", name)
        if c.by not in spec.parameters:
            yield Problem((*at, "by"), f"there is no parameter of this name{close_match(c.by, spec.parameters)}")
        elif c.by in owner:
            yield Problem((*at, "by"), f"is solved from the constraint {owner[c.by]} already: take another parameter")
        owner[c.by] = name
        if c.from_mm >= c.to_mm:
            yield Problem((*at, "to_mm"), f"must be more than from_mm ({c.from_mm:g})")
        try:
            stroke, _ = curve_points(scenario.values(), c.of)
        except (LookupError, TypeError, ValueError):
            known = [f"curves.{curve}" for curve in scenario.curves]
            yield Problem((*at, "of"), f"must be the path of a curve{close_match(c.of, known)}")
            continue
        if c.to_mm > stroke[-1]:
            yield Problem((*at, "to_mm"), f"must be within the curve, which ends at {stroke[-1]:g} mm")
        bent = _whole(spec).get(c.by)
        if bent is not None and bent.curve != c.of:
            yield Problem((*at, "by"), f"seeks the curve {bent.curve}: name a parameter that the area of {c.of} is of")
        elif bent is not None and not np.any((stroke[1:-1] > c.from_mm) & (stroke[1:-1] < c.to_mm)):
            yield Problem((*at, "by"), "has no point between from_mm and to_mm that could meet the area")
    if spec.parameters and set(owner) >= set(spec.parameters) and not _whole(spec):
        yield Problem(("constraints",), "leave no parameter to be sought: each of them is solved from a constraint")


def _targets(spec: TargetsFile) -> Iterator[Problem]:
    fitted = {target for part in spec.data.values() for target in part.values}
    used = fitted | {target for part in spec.held_out.values() for target in part.values}
    for name, part in spec.targets.items():
        at: Path = ("targets", name)
        try:
            parse_sum(part.response)
        except InputError as error:
            yield Problem((*at, "response"), str(error))
        if name not in used:
            yield Problem(at, "has no value: name it under values in data or held_out, or leave it out")
    if fitted and all(spec.targets[t].weight == 0 for t in fitted if t in spec.targets):
        yield Problem(("targets",), "have a weight of 0, all that data has values for: nothing is left to fit")


def _data(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    sought = {
        path
        for part in _alone(spec).values()
        for one in (part.sets if isinstance(part.sets, list) else [part.sets])
        for path in _paths(one if isinstance(one, str) else one.path, scenario)
    }
    whole = [part.curve for part in _whole(spec).values()]
    for key in ("data", "held_out"):
        for name, part in getattr(spec, key).items():
            at: Path = (key, name)
            places = [((*at, "cases", column), place) for column, place in part.cases.items()]
            places += [((*at, "set", place), place) for place in part.set]
            for where, place in places:
                try:
                    scenario.locate(place)
                except InputError as error:
                    yield Problem(where, str(error))
                    continue
                for path in _paths(place, scenario):
                    if path in sought or any(_within(path, curve) or _within(curve, path) for curve in whole):
                        yield Problem(where, "is set by a parameter that is sought: a case cannot set it too")
            for place in set(part.cases.values()) & set(part.set):
                yield Problem((*at, "set", place), "is set by a column of cases too: leave one of them out")
            for target in part.values:
                if target not in spec.targets:
                    yield Problem(
                        (*at, "values", target), f"there is no target of this name{close_match(target, spec.targets)}"
                    )
    for name in set(spec.data) & set(spec.held_out):
        yield Problem(("held_out", name), "is the name of an entry in data: choose another")


def _within(path: str, group: str) -> bool:
    return f"{path}.".startswith(f"{group}.")


def _paths(place: str, scenario: Scenario) -> Iterable[str]:
    paths = scenario.parameters.get(place, place)
    return [paths] if isinstance(paths, str) else paths


def _percentages(spec: TargetsFile, found: Sequence[Observation]) -> Iterator[Problem]:
    """A part of nothing is no tolerance."""
    zero = {o.target: o.data for o in found if o.wanted == 0}
    for name, part in spec.targets.items():
        for key, amount in (("tolerance", part.tolerance), ("bars", part.bars.each)):
            if not isinstance(amount, str):
                continue
            if float(amount.strip().removesuffix("%")) == 0:
                yield Problem(("targets", name, key), "must be more than 0 %")
            elif name in zero:
                yield Problem(
                    ("targets", name, key),
                    f"is a part of the value, and {zero[name]} has one of 0: state it in the unit of the response",
                )


def _enough(spec: TargetsFile, scenario: Scenario, fitted: Sequence[Observation]) -> Iterator[Problem]:
    inner = (curve_points(scenario.values(), part.curve)[0].size - 2 for part in _whole(spec).values())
    sought = len(_alone(spec)) + sum(inner) - len({c.by for c in spec.constraints.values()})
    counted = sum(spec.targets[o.target].weight > 0 for o in fitted if o.target in spec.targets)
    if counted < sought:
        yield Problem(
            ("parameters",),
            f"are {sought} to be sought from {counted} values: give at least as many values, or fix some parameters",
        )
