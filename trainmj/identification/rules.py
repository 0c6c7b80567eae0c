"""Rules that concern several parts of a targets file: names that must exist, values that must fit together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.errors import InputError, close_match
from trainmj.files.source import Path, Problem, no_such
from trainmj.identification.data import Observation, channels_of, parse_sum, shares
from trainmj.identification.file import (
    MAX_PARAMETERS,
    MAX_VALUES,
    ChannelData,
    ChannelTarget,
    CurvePart,
    OffsetPart,
    ParameterPart,
    TargetPart,
    TargetsFile,
    absolute,
)
from trainmj.identification.sought import curve_points, members, offset_start, settings_of, single, start_of
from trainmj.scenario import Scenario
from trainmj.scenario.files import nowhere, refused
from trainmj.units import ROUND_OFF


def broken_rules(
    spec: TargetsFile, scenario: Scenario, fitted: Sequence[Observation], held_out: Sequence[Observation]
) -> Iterator[Problem]:
    """Every rule that the parts of a targets file break between them."""
    sought = [*_singles(spec, scenario), *_curves(spec, scenario), *_offsets(spec), *_set_twice(spec, scenario)]
    yield from sought or _starts(spec, scenario)
    yield from _order(spec)
    yield from _constraints(spec, scenario)
    yield from _targets(spec)
    yield from _data(spec, scenario)
    yield from _percentages(spec, [*fitted, *held_out])
    if fitted and not sought:
        yield from _enough(spec, scenario, fitted)
    for key, found in (("data", fitted), ("held_out", held_out)):
        if len(found) > MAX_VALUES:
            yield Problem((key,), f"states {len(found)} values, more than {MAX_VALUES}")


def _singles(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    for name, part in spec.singles().items():
        at: Path = ("parameters", name)
        low, high = part.bounds
        broken = list(_sets(at, part, scenario))
        yield from broken
        if part.scale == "log" and low <= 0:
            yield Problem((*at, "bounds"), f"must be above 0 on a log scale; the lower one is {low:g}")
        if broken:
            continue
        start = start_of(part, scenario)
        if start is None:
            stated = settings_of(part, scenario)[0].path.rpartition(".")[2]
            yield Problem(at, f"needs a start: the scenario states no {stated} there")
        elif not low <= start <= high and part.start is not None:
            yield Problem((*at, "start"), f"must be within the bounds, {low:g} to {high:g}")
        elif not low <= start <= high:
            rule = f"must include the {start:g} that the scenario has now: widen them, or state a start"
            yield Problem((*at, "bounds"), rule)


def _sets(at: Path, part: ParameterPart, scenario: Scenario) -> Iterator[Problem]:
    """What is wrong with the places that a parameter sets."""
    for place, one in part.listed():
        where = (*at, *place)
        if one.factor == 0:
            yield Problem((*where, "factor"), "must not be 0")
        lost = list(nowhere([(where, one.path)], scenario))
        yield from lost
        for value in scenario.locate(one.path) if not lost else ():
            if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
                yield Problem(where, f"must lead to a number, not to {_described(one.path, value)}")


def _described(path: str, value: Any) -> str:
    """A value that is no number, and how to go on from a list or a group to the number that is meant."""
    if isinstance(value, list):
        return "a list" + (f": choose one of its {len(value)}, as in {path}.{len(value) - 1}" if value else "")
    if isinstance(value, dict):
        return "a group" + (f": choose one of {', '.join(map(str, value))}" if value else "")
    return f"{value!a}"


def _curves(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    total = len(spec.parameters)
    for name, part in spec.curves().items():
        at: Path = ("parameters", name)
        points = _points(part.curve, scenario)
        if points is None or not isinstance(scenario.locate(part.curve)[0], dict):
            known = close_match(part.curve, [f"curves.{curve}" for curve in scenario.curves])
            yield Problem((*at, "curve"), f"must be the path of a curve with points{known}")
            continue
        stroke, force = points
        total += stroke.size - 3
        if stroke.size < 3:
            yield Problem((*at, "curve"), "has no points between its first and its last one: add some")
        elif not force[0] < force[-1]:
            rule = f"must rise: its last force ({force[-1]:g} kN) is not above its first one ({force[0]:g} kN)"
            yield Problem((*at, "curve"), rule)
        for member in members(name, stroke):
            if member in spec.parameters:
                yield Problem(at, f"has a force called {member}, like another parameter: choose another name")
    if total > MAX_PARAMETERS:
        yield Problem(("parameters",), f"are {total}, counting the forces of curves, more than {MAX_PARAMETERS}")


def _offsets(spec: TargetsFile) -> Iterator[Problem]:
    channels, owners = spec.channels(), dict[str, str]()
    for name, part in spec.offsets().items():
        at: Path = ("parameters", name)
        unknown = [entry for entry in part.shifted if entry not in channels]
        for entry in part.shifted:
            if entry in unknown:
                known = close_match(entry, channels) if channels else ""
                yield Problem((*at, "offset"), f"must name channels in data: {entry!r} has none{known}")
            elif entry in owners:
                yield Problem((*at, "offset"), f"{entry} is shifted by {owners[entry]} already: leave one of them out")
            owners[entry] = name
        if unknown:
            continue
        if not any(entry in spec.data for entry in part.shifted):
            yield Problem((*at, "offset"), "must name channels in data: what is held out cannot tell it")
        low, high = part.bounds
        start = offset_start(part, channels)
        if not low <= start <= high:
            yield Problem((*at, "bounds"), f"must include the start, {start:g} ms")


def _points(path: str, scenario: Scenario) -> tuple[Array, Array] | None:
    """Strokes and forces of the curve at a path; None if there is none."""
    try:
        scenario.locate(path)
        return curve_points(scenario.values(), path)
    except (InputError, LookupError, TypeError, ValueError):
        return None


def _set_twice(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    """Values that two parameters set, or a parameter and ``set``."""
    owners = {path: "the key set" for name in spec.set for path in scenario.paths(name)}
    for name, part in spec.parameters.items():
        key = "curve" if isinstance(part, CurvePart) else "sets"
        for path in _paths(part, scenario):
            for other, owner in owners.items():
                if scenario.overlap(path, other):
                    twice = f"is set by {owner} too" if path == other else f"overlaps {other}, which {owner} sets"
                    yield Problem(("parameters", name, key), f"{path} {twice}: leave one of them out")
            owners[path] = f"the parameter {name}"


def _paths(part: ParameterPart | CurvePart | OffsetPart, scenario: Scenario) -> list[str]:
    """The paths that a parameter sets."""
    if isinstance(part, OffsetPart):
        return []
    return [part.curve] if isinstance(part, CurvePart) else [s.path for s in settings_of(part, scenario)]


def _starts(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    """Start values that the scenario refuses."""
    unknowns = [single(name, part, scenario, None) for name, part in spec.singles().items()]
    starts = {u.name: {s.path: s.of(u.start) for s in u.settings} for u in unknowns}
    for problem in refused(("parameters",), starts, scenario):
        yield Problem(problem.path, f"at the start: {problem.rule}")


def _order(spec: TargetsFile) -> Iterator[Problem]:
    solved = {c.by for c in spec.constraints.values()}
    singles = spec.singles()
    for name, part in singles.items():
        at: Path = ("parameters", name, "above")
        if part.above is None:
            if "gap" in part.model_fields_set:
                yield Problem(("parameters", name, "gap"), "needs above: the parameter that this one stays above")
        elif part.above in spec.curves():
            yield Problem(at, "is a curve: name a single value")
        elif part.above not in singles:
            yield no_such("parameter", at, part.above, singles)
        elif part.above in solved:
            yield Problem(at, "is itself solved from a constraint: name a parameter that is searched")
        elif name in _below(part.above, singles):
            yield Problem(at, "leads back to this parameter: break the circle")
        elif part.bounds[1] < (least := singles[part.above].bounds[1] + part.gap):
            rule = f"must reach up to {least:g}, so that there is room above {part.above} at its upper bound"
            yield Problem(("parameters", name, "bounds"), rule)


def _below(name: str | None, singles: dict[str, ParameterPart]) -> list[str]:
    """A parameter, the one that it stays above, and so on, each once."""
    found: list[str] = []
    while name in singles and name not in found:
        found.append(name)
        name = singles[name].above
    return found


def _constraints(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    owner: dict[str, str] = {}
    for name, c in spec.constraints.items():
        at: Path = ("constraints", name)
        if c.by not in spec.parameters:
            yield no_such("parameter", (*at, "by"), c.by, spec.parameters)
        elif c.by in spec.offsets():
            yield Problem((*at, "by"), "is a time offset: name a parameter that changes the area")
        elif c.by in owner:
            yield Problem((*at, "by"), f"is solved from the constraint {owner[c.by]} already: take another parameter")
        owner[c.by] = name
        if c.from_mm >= c.to_mm:
            yield Problem((*at, "to_mm"), f"must be more than from_mm ({c.from_mm:g})")
        points = _points(c.of, scenario)
        if points is None:
            known = [f"curves.{curve}" for curve in scenario.curves]
            yield Problem((*at, "of"), f"must be the path of a curve{close_match(c.of, known)}")
            continue
        stroke, _ = points
        if c.to_mm > stroke[-1]:
            yield Problem((*at, "to_mm"), f"must be within the curve, which ends at {stroke[-1]:g} mm")
        bent = spec.curves().get(c.by)
        if bent is not None and bent.curve != c.of:
            yield Problem((*at, "by"), f"is the curve {bent.curve}: name a parameter that changes the area of {c.of}")
        elif bent is not None and not np.any((stroke[1:-1] > c.from_mm) & (stroke[1:-1] < c.to_mm)):
            yield Problem((*at, "by"), "has no point between from_mm and to_mm that could meet the area")
    if set(owner) >= set(spec.parameters) and not spec.curves():
        yield Problem(("constraints",), "leave nothing to search for: every parameter is solved from one")


def _targets(spec: TargetsFile) -> Iterator[Problem]:
    fitted = {target for part in spec.data.values() for target in part.values}
    used = {target for _, part in spec.tables() for target in part.values}
    for name, part in spec.targets.items():
        at: Path = ("targets", name)
        key, text = part.asked
        try:
            parse_sum(text)
        except InputError as error:
            yield Problem((*at, key), str(error))
        for bar, amount in part.bars if isinstance(part, ChannelTarget) else ():
            if isinstance(amount, str):
                yield Problem((*at, "bars", bar), "must be in the unit of the channel, whose values pass 0")
        if name not in used:
            yield Problem(at, "has no values: name it under values in data or held_out, or remove it")
    if fitted and all(spec.targets[t].weight == 0 for t in fitted if t in spec.targets):
        yield Problem(("targets",), "all have a weight of 0 where data has values: nothing is left to fit")


def _data(spec: TargetsFile, scenario: Scenario) -> Iterator[Problem]:
    sought = {path: name for name, part in spec.parameters.items() for path in _paths(part, scenario)}
    for at, part in spec.tables():
        cases = {} if isinstance(part, ChannelData) else part.cases
        places: list[tuple[Path, str]] = [((*at, "cases", column), place) for column, place in cases.items()]
        places += [((*at, "set", place), place) for place in part.set]
        yield from nowhere(places, scenario)
        for where, place in places:
            taken = [sought[s] for s in sought if scenario.overlap(place, s)]
            if taken:
                yield Problem(where, f"is set by the parameter {taken[0]}, which is sought: a case cannot set it too")
        for place in set(cases.values()) & set(part.set):
            yield Problem((*at, "set", place), "is set by a column of cases too: leave one of them out")
        for target in part.values:
            if target not in spec.targets:
                yield no_such("target", (*at, "values", target), target, spec.targets)
            elif isinstance(part, ChannelData) and isinstance(spec.targets[target], TargetPart):
                yield Problem((*at, "values", target), "is the target of a response: channels need one with channel")
            elif isinstance(spec.targets[target], ChannelTarget) and not isinstance(part, ChannelData):
                rule = "is the target of a channel: its values come from channels, a CSV file of one test"
                yield Problem((*at, "values", target), rule)
    for name in set(spec.data) & set(spec.held_out):
        yield Problem(("held_out", name), "is the name of an entry in data: choose another")


def _percentages(spec: TargetsFile, found: Sequence[Observation]) -> Iterator[Problem]:
    """A percentage of 0 is no tolerance."""
    zero = {o.target: o.data for o in found if o.wanted == 0}
    for name, part in spec.targets.items():
        for key, amount in (("tolerance", part.tolerance), ("bars", part.bars.each)):
            if isinstance(part, ChannelTarget) or not isinstance(amount, str):
                continue
            if absolute(amount, 1.0) == 0:
                yield Problem(("targets", name, key), "must be more than 0 %")
            elif name in zero:
                rule = f"is a percentage of the value, and {zero[name]} has one of 0"
                yield Problem(("targets", name, key), f"{rule}: state it in the unit of the response")


def _enough(spec: TargetsFile, scenario: Scenario, fitted: Sequence[Observation]) -> Iterator[Problem]:
    inner = sum(curve_points(scenario.values(), part.curve)[0].size - 2 for part in spec.curves().values())
    sought = len(spec.singles()) + len(spec.offsets()) + inner - len({c.by for c in spec.constraints.values()})
    counts = zip(fitted, shares(fitted, spec.targets), strict=True)
    counted = sum(share for o, share in counts if o.target in spec.targets and spec.targets[o.target].weight > 0)
    if counted < sought - ROUND_OFF:
        cure = "give more values, or fix some parameters"
        if channels_of(fitted):
            cure += "; a channel counts as one value, or as its length over independent_ms, if its target states that"
        yield Problem(("parameters",), f"are {sought}, and there are only {counted:.3g} values: {cure}")
