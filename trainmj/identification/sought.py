"""What is sought: single values, whole curves, and the areas that they must have; made from the parts of a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.identification.file import AreaPart, ChannelData, CurvePart, OffsetPart, ParameterPart, SetPart
from trainmj.scenario import Scenario
from trainmj.units import KJ, KN, MM, unit_of


@dataclass(frozen=True)
class Unknown:
    """A parameter: a single value, an inner force of a curve that is sought as a whole, or a time offset."""

    name: str
    unit: str  # empty if there is none
    lower: float  # bound
    upper: float
    start: float
    settings: tuple[SetPart, ...]  # what it sets
    log: bool = False  # whether search and uncertainty use its logarithm
    above: int | None = None  # place of the parameter that it stays above
    gap: float = 0.0  # by how much at least
    shifts: tuple[str, ...] = ()  # channels whose times it shifts, by the names of their data

    @property
    def meant(self) -> tuple[str, ...]:
        """The paths that it sets, or what else it changes."""
        return tuple(s.path for s in self.settings) or tuple(f"times of {name}" for name in self.shifts)

    def scaled(self, value: float) -> float:
        """The value on its axis, which is straight or logarithmic."""
        return float(np.log(value)) if self.log else value

    def value(self, scaled: float) -> float:
        """The value of a place on its axis."""
        return float(np.exp(scaled)) if self.log else scaled

    @property
    def range(self) -> float:
        """From bound to bound on its axis."""
        return self.scaled(self.upper) - self.scaled(self.lower)


@dataclass(frozen=True)
class Area:
    """A constraint: the area under a curve."""

    name: str
    part: AreaPart  # its entry in the file
    by: int  # place of the parameter that is solved for
    tolerance: float  # deviation that counts as one standard deviation [kJ]

    def under(self, stroke: Array, force: Array) -> float:
        """Area under points [mm], [kN] between the strokes of the constraint [kJ]."""
        lower, upper = self.part.from_mm, self.part.to_mm
        inner = (stroke > lower) & (stroke < upper)
        at = np.concatenate([[lower], stroke[inner], [upper]])
        return float(np.trapezoid(np.interp(at, stroke, force), at)) * (KN * MM / KJ)


@dataclass(frozen=True)
class Rise:
    """A whole curve: its inner forces lie between the first and the last one, and never fall.

    Its axes are the logarithms of its slopes; only their ratios count, so the last force stays. Bending raises the rise
    of each force, as a share of the rise to the last one, to a power, which gives the curve any area.
    """

    members: tuple[int, ...]  # places of its inner forces among the parameters
    stroke: Array  # (n + 1,) of its points [mm]
    first: float  # force at the first one [kN]
    last: float  # force at the last one [kN], above the first
    factor: float  # each slope is within this factor of their middle, up or down, before bending

    @property
    def n(self) -> int:
        """Number of slopes, one more than inner forces."""
        return self.stroke.size - 1

    def widest(self, lower: float, upper: float) -> int:
        """The member between two strokes [mm] that carries most of the area between its neighbours."""
        inner = (self.stroke[1:-1] > lower) & (self.stroke[1:-1] < upper)
        return self.members[int(np.argmax(np.where(inner, self.stroke[2:] - self.stroke[:-2], 0.0)))]

    def slopes(self, unit: Array) -> Array:
        """Logarithms of the slopes (n,) at a place on its axes, up to a common constant."""
        return np.asarray((2.0 * unit - 1.0) * np.log(self.factor))

    def forces(self, unit: Array, bend: float = 0.0) -> Array:
        """Inner forces (n - 1,) [kN] at a place on its axes; bend is the logarithm of the power."""
        rise = np.cumsum(np.exp(self.slopes(unit)) * np.diff(self.stroke))
        share = (rise[:-1] / rise[-1]) ** np.exp(bend)
        return np.asarray(self.first + (self.last - self.first) * share)

    def place(self, forces: Array) -> Array:
        """The place on its axes (n,) of the curve with these inner forces, or of the nearest one that rises."""
        rise = np.diff(np.concatenate([[self.first], forces, [self.last]]))
        mean = (self.last - self.first) / self.n
        slopes = np.log(np.maximum(rise, 1e-9 * mean) / np.diff(self.stroke))
        return np.asarray(np.clip(0.5 + 0.5 * (slopes - np.median(slopes)) / np.log(self.factor), 0.0, 1.0))


def single(name: str, part: ParameterPart, scenario: Scenario, above: int | None) -> Unknown:
    """A single value that is sought."""
    settings, start = settings_of(part, scenario), start_of(part, scenario)
    assert start is not None  # held by the rules
    of_path = next((unit for key in reversed(settings[0].path.split(".")) if (unit := unit_of(key))), "")
    unit = of_path if part.unit is None else part.unit
    lower, upper = part.bounds
    return Unknown(name, unit, lower, upper, start, settings, part.scale == "log", above, part.gap)


def offset(name: str, part: OffsetPart, channels: Mapping[str, ChannelData]) -> Unknown:
    """A time offset."""
    start = offset_start(part, channels)
    lower, upper = part.bounds
    return Unknown(name, "ms", lower, upper, start, (), shifts=tuple(part.shifted))


def offset_start(part: OffsetPart, channels: Mapping[str, ChannelData]) -> float:
    """Where a time offset starts: as stated, or as the first of its channels has it [ms]."""
    return channels[part.shifted[0]].offset_ms if part.start is None else part.start


def inner_forces(name: str, part: CurvePart, stroke: Array, force: Array) -> list[Unknown]:
    """The inner forces of a curve that is sought as a whole."""
    first, last = float(force[0]), float(force[-1])
    start = np.clip(force, first, last).tolist()
    return [
        Unknown(member, "kN", first, last, start[k], (SetPart(path=f"{part.curve}.force_kN.{k}"),))
        for k, member in enumerate(members(name, stroke), 1)
    ]


def members(curve: str, stroke: Array) -> list[str]:
    """What the inner forces of a curve are called, by the strokes [mm] at which they are."""
    return [f"{curve}_{u:g}mm" for u in stroke[1:-1]]


def settings_of(part: ParameterPart, scenario: Scenario) -> tuple[SetPart, ...]:
    """What a parameter sets, by path; a short name of the scenario stands for all of its paths."""
    return tuple(one.model_copy(update={"path": path}) for _, one in part.listed() for path in scenario.paths(one.path))


def start_of(part: ParameterPart, scenario: Scenario) -> float | None:
    """Where a parameter starts: as stated, or as the first place that it sets has it; None if that states no value."""
    if part.start is not None:
        return part.start
    first = settings_of(part, scenario)[0]
    value = scenario.locate(first.path)[0]
    return None if value is None else (float(value) - first.offset) / first.factor


def curve_points(values: Mapping[str, Any], path: str) -> tuple[Array, Array]:
    """Strokes [mm] and forces [kN] of a curve in the plain values of a scenario.

    Raises:
        LookupError: if the path leads to no curve.
    """
    here: Any = values
    for key in path.split("."):
        here = here[int(key)] if isinstance(here, list) else here[key]
    parts = here if isinstance(here, list) else [here]
    curves = [values["curves"][part] if isinstance(part, str) else part for part in parts]
    stroke, force = ([value for curve in curves for value in curve[key]] for key in ("stroke_mm", "force_kN"))
    return np.array(stroke, dtype=float), np.array(force, dtype=float)
