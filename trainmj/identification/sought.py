"""From the parameters and constraints of a targets file to unknowns: what they set, and what is solved."""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from trainmj.collision.device import Array
from trainmj.identification.file import CurvePart, ParameterPart, TargetsFile, absolute
from trainmj.identification.unknowns import Area, Rise, Setting, Unknown, Unknowns, curve_points
from trainmj.scenario import Scenario
from trainmj.units import unit_of


def unknowns_of(spec: TargetsFile, scenario: Scenario) -> Unknowns:
    """The unknowns of a checked file, in its order; a curve is its inner forces."""
    points = {name: curve_points(scenario.values(), part.curve) for name, part in spec.curves().items()}
    sizes = [points[name][0].size - 2 if name in points else 1 for name in spec.parameters]
    places = dict(zip(spec.parameters, accumulate(sizes, initial=0), strict=False))  # of a curve, of its first force
    parameters: list[Unknown] = []
    rises: dict[str, Rise] = {}
    for name, part in spec.parameters.items():
        if isinstance(part, CurvePart):
            stroke, force = points[name]
            members = tuple(range(places[name], places[name] + stroke.size - 2))
            rises[name] = Rise(name, members, stroke, float(force[0]), float(force[-1]), part.slopes)
            parameters += _inner(name, part, stroke, force)
        else:
            parameters.append(_single(name, part, scenario, places))
    areas = []
    for name, c in spec.constraints.items():
        by = rises[c.by].widest(c.from_mm, c.to_mm) if c.by in rises else places[c.by]
        areas.append(Area(name, c, by, absolute(c.tolerance, c.area_kJ)))
    return Unknowns(scenario, tuple(parameters), tuple(areas), tuple(rises.values()))


def settings_of(part: ParameterPart, scenario: Scenario) -> tuple[Setting, ...]:
    """The places that a parameter sets; a short name of the scenario stands for all of its paths."""
    return tuple(Setting(path, one.factor, one.offset) for _, one in part.listed() for path in scenario.paths(one.path))


def start_of(part: ParameterPart, scenario: Scenario) -> float | None:
    """Where a parameter starts: as stated, or as the first place that it sets has it; None if that states no value."""
    if part.start is not None:
        return part.start
    first = settings_of(part, scenario)[0]
    value = scenario.locate(first.path)[0]
    return None if value is None else (float(value) - first.offset) / first.factor


def start_values(part: ParameterPart, scenario: Scenario) -> dict[str, float]:
    """What a parameter sets at its start, by path."""
    start = start_of(part, scenario)
    return {} if start is None else {s.path: s.of(start) for s in settings_of(part, scenario)}


def member_name(curve: str, stroke_mm: float) -> str:
    """What an inner force of a curve that is sought as a whole is called."""
    return f"{curve}_{stroke_mm:g}mm"


def _single(name: str, part: ParameterPart, scenario: Scenario, places: dict[str, int]) -> Unknown:
    settings, start = settings_of(part, scenario), start_of(part, scenario)
    assert start is not None  # held by the rules
    return Unknown(
        name,
        _unit_of_path(settings[0].path) if part.unit is None else part.unit,
        part.bounds[0],
        part.bounds[1],
        start,
        settings,
        log=part.scale == "log",
        above=None if part.above is None else places[part.above],
        gap=part.gap,
    )


def _unit_of_path(path: str) -> str:
    """The unit at the end of a path, or before the number of a point."""
    return next((unit for key in reversed(path.split(".")) if (unit := unit_of(key))), "")


def _inner(name: str, part: CurvePart, stroke: Array, force: Array) -> list[Unknown]:
    """The inner forces of a curve that is sought as a whole, by the strokes at which they are."""
    first, last = float(force[0]), float(force[-1])
    settings = [(Setting(f"{part.curve}.force_kN.{k}"),) for k in range(stroke.size)]
    start = np.clip(force, first, last).tolist()
    return [
        Unknown(member_name(name, stroke[k]), "kN", first, last, start[k], settings[k])
        for k in range(1, stroke.size - 1)
    ]
