"""The numbers and curves of a scenario that may be changed, each with its path, range, unit and meaning."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from pydantic import BaseModel

from trainmj.errors import InputError
from trainmj.files.parts import keys_of
from trainmj.files.source import Path, dotted, groups_of, type_at
from trainmj.scenario import Scenario
from trainmj.scenario.curves import Curve, Metering, listed
from trainmj.scenario.parts import Parts
from trainmj.scenario.scenario import WORDS
from trainmj.units import unit_of, words

_ABOUT = (*WORDS, "parameters", "curves", "tolerances", "bracket")
"""Keys in which no number is looked for: no collision reads them, or devices lead to what is there."""

_USUAL = {"mm": 100.0, "m": 5.0, "km/h": 50.0, "t": 50.0, "kN": 1000.0, "kN/mm": 100.0, "kN s/m": 1000.0, "ms": 10.0}
_USUAL |= {"s": 1.0, "mrad": 10.0, "per mille": 20.0}
"""What the slider of a value that is 0 reaches, by its unit; 1 for others."""

_NOTCHES = 300  # of a slider, about


@dataclass(frozen=True)
class Number:
    """A number that may be changed.

    Attributes:
        name: its path, or the short name that the scenario gives to one path or several.
        value: as the scenario stands.
        least: the smallest that its type allows; None for any.
        most: the largest.
        open: whether the smallest itself is not allowed.
        whole: whether it is a whole number.
        meaning: in words; empty if nothing is said.
        differ: how many values of several it replaces that are not the same now.
    """

    name: str
    value: float
    least: float | None = None
    most: float | None = None
    open: bool = False
    whole: bool = False
    meaning: str = ""
    differ: int = 0
    unit: str = ""

    def slider(self) -> tuple[float, float, float]:
        """From where to where a slider goes, and its notch: half to twice the value, as far as that is allowed."""
        if self.value:
            low, high = sorted((0.5 * self.value, 2.0 * self.value))
        else:
            high = _USUAL.get(self.unit, 1.0)
            low = -high if self.least is None or self.least < 0.0 else 0.0
        if self.whole:
            low, high = math.floor(min(low, self.value - 2)), math.ceil(max(high, self.value + 2))
        low = low if self.least is None else max(low, self.least)
        high = high if self.most is None else min(high, self.most)
        notch = max(_nice((high - low) / _NOTCHES), 1.0 if self.whole else 0.0)
        return (low + notch if self.open and low == self.least else low), high, notch

    def as_dict(self) -> dict[str, Any]:
        """Plain values for the page."""
        low, high, notch = self.slider()
        return {
            "name": self.name,
            "words": words(self.name.rpartition(".")[2]) if "." in self.name else words(self.name),
            "value": self.value,
            "unit": self.unit,
            "allowed": self._allowed(),
            "meaning": self.meaning,
            "differ": self.differ,
            "low": low,
            "high": high,
            "notch": notch,
        }

    def _allowed(self) -> str:
        """The range that its type allows, in words."""
        low = f"{'above' if self.open else 'from'} {self.least:g}" if self.least is not None else ""
        high = f"to {self.most:.12g}" if self.most is not None else ""
        return " ".join(filter(None, (low, high, self.unit)))


@dataclass(frozen=True)
class Points:
    """The points of a force, or of an orifice, over the stroke: pieces of one curve, each at a path of its own."""

    name: str  # path of the curve
    height: str  # key of what is over the stroke
    pieces: tuple[tuple[str, list[float], list[float]], ...]  # path, strokes and heights of each

    def as_dict(self) -> dict[str, Any]:
        """Plain values for the page."""
        return {
            "name": self.name,
            "x": "stroke_mm",
            "y": self.height,
            "title": self.name.removeprefix("devices.").removesuffix(".curve").replace(".stages.", ", "),
            "axes": [f"{words(key)} ({unit_of(key)})".replace("_", " ") for key in ("stroke_mm", self.height)],
            "pieces": [{"path": path, "x": x, "y": y} for path, x, y in self.pieces],
        }


def values_of(scenario: Scenario) -> tuple[list[Number], list[Points]]:
    """All numbers at paths of their own, those that only have a default too, and all curves."""
    numbers, curves = [], []
    for found in _walk(scenario, scenario, {}, {}, ()):
        if isinstance(found, Points):
            curves.append(found)
        elif _leads_somewhere(scenario, found.name):
            numbers.append(found)
    return numbers, curves


def parameters_of(scenario: Scenario, numbers: list[Number]) -> list[Number]:
    """The numbers that the scenario gives short names to."""
    at = {number.name: number for number in numbers}
    found = []
    for name in scenario.parameters:
        there = [at[path] for path in map(dotted, scenario.places(name)) if path in at]
        if there and len(there) == len(scenario.places(name)):
            values = [one.value for one in there]
            differ = len(values) if len(set(values)) > 1 else 0
            unit = unit_of(name) or there[0].unit
            found.append(replace(there[0], name=name, differ=differ, unit=unit))
    return found


def _leads_somewhere(scenario: Scenario, name: str) -> bool:
    try:
        scenario.places(name)
    except InputError:
        return False
    return True


def _walk(
    scenario: Scenario, value: Any, schema: Mapping[str, Any], parts: Mapping[str, Any], path: Path
) -> Iterator[Number | Points]:
    """What is at a path and below it.

    Args:
        scenario: the whole of it.
        value: at the path.
        schema: of the value, as JSON has it.
        parts: schemas by the names that references in it have.
        path: keys and positions.
    """
    if path and (points := _curve(scenario, value, path)):
        yield points
    elif isinstance(value, BaseModel):
        own, parts = _schema(type(value))
        names = {field.alias or name: name for name, field in type(value).model_fields.items()}
        for key in keys_of(type(value)):
            if path or key not in _ABOUT:
                yield from _walk(scenario, getattr(value, names[key]), own.get(key, {}), parts, (*path, key))
    elif isinstance(value, dict):
        own = _fitting(schema, parts, "object")
        below: Any = own.get("additionalProperties") or next(iter(own.get("patternProperties", {}).values()), {})
        for key, inner in value.items():
            yield from _walk(scenario, inner, below if isinstance(below, dict) else {}, parts, (*path, str(key)))
    elif isinstance(value, list):
        below = _fitting(schema, parts, "array").get("items", {})
        for place, inner in enumerate(value):
            yield from _walk(scenario, inner, below, parts, (*path, place))
    elif isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        yield _number(value, schema, parts, path)


def _number(value: float, schema: Mapping[str, Any], parts: Mapping[str, Any], path: Path) -> Number:
    own = _fitting(schema, parts, "integer" if isinstance(value, int) else "number")
    whole = own.get("type") == "integer"
    low, high = own.get("minimum", own.get("exclusiveMinimum")), own.get("maximum", own.get("exclusiveMaximum"))
    name = dotted(path)
    meaning = schema.get("description") or own.get("description") or ""
    return Number(name, value, low, high, "exclusiveMinimum" in own, whole, meaning, unit=unit_of(name))


_MULTIPLE = ("anyOf", "oneOf")


def _fitting(schema: Mapping[str, Any], parts: Mapping[str, Any], kind: str) -> Mapping[str, Any]:
    """The alternative of a schema that is of a kind; a whole number fits where numbers do."""
    if "$ref" in schema:
        return _fitting(parts.get(schema["$ref"].rpartition("/")[2], {}), parts, kind)
    for key in _MULTIPLE:
        for one in schema.get(key, ()):
            if found := _fitting(one, parts, kind):
                return found
    fits = schema.get("type") == kind or (kind == "integer" and schema.get("type") == "number")
    return schema if fits else {}


@cache
def _schema(model: type[BaseModel]) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """The schemas of the keys of a group, and those that they refer to."""
    whole = model.model_json_schema()
    parts = whole.get("$defs", {})
    own = whole if "properties" in whole else _fitting(whole, parts, "object")
    return own.get("properties", {}), parts


def _curve(scenario: Scenario, value: Any, path: Path) -> Points | None:
    """The curve that a device names or states at a path, or its metering; None if nothing of the kind is there."""
    if isinstance(value, Metering):
        key = "orifice_kN_s2_per_m2"
        return Points(dotted(path), key, ((dotted(path), value.stroke_mm, value.orifice_kN_s2_per_m2),))
    if value is None or Curve not in groups_of(type_at(Parts, path)):
        return None
    pieces = []
    for below, part in listed(value):
        curve, at = (scenario.curves[part], ("curves", part)) if isinstance(part, str) else (part, (*path, *below))
        if isinstance(curve, Curve):
            pieces.append((dotted(at), curve.stroke_mm, curve.force_kN))
    return Points(dotted(path), "force_kN", tuple(pieces))


def _nice(size: float) -> float:
    """1, 2 or 5 times a power of ten, not above a size."""
    if not size > 0.0:
        return 1e-3
    power = 10.0 ** math.floor(math.log10(size))
    return float(f"{max(n for n in (1, 2, 5) if n * power <= size * (1 + 1e-9)) * power:.1g}")
