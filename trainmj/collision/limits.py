"""Limits: what a scenario allows the train under test, and how a collision keeps it.

A limit of a scenario is stated for a quantity of every vehicle or interface (``mean_deceleration_g``) or for one
response by the name of its column (``stroke_M1_M2_mm``). The train under test is the moving one; a partner is not
judged. The stroke limits of stages belong to the devices: those of a struck train are judged if it is the same train.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trainmj.collision.chain import Chain, n_own_sides, order_of_vehicles
from trainmj.collision.elementwise import picked
from trainmj.collision.envelope import Array, BoolArray, IntArray
from trainmj.collision.measured import Measured
from trainmj.collision.quantities import (
    STAGE,
    Column,
    Quantity,
    Values,
    of_each,
    of_sides,
)
from trainmj.collision.records import InterfaceMetrics, VehicleMetrics
from trainmj.files.provenance import source_of
from trainmj.scenario.devices import DEVICE
from trainmj.units import MM, against, beyond

_MET = "met_step_mm"  # a number of interfaces with faces only


@dataclass(frozen=True)
class Criterion:
    """One limit and what was found.

    Attributes:
        name: what is limited: a quantity, a column, or the stroke limit of a stage by its path in the scenario.
        title: the same in words.
        where: vehicle, interface or stage that comes nearest to the limit or passes it by most; empty for a response
            of the whole collision.
        found: its value.
        limit: the largest magnitude that is allowed.
        unit: of both.
        digits: decimals worth reading; negative for significant digits.
        of_scenario: whether the scenario states it under ``limits``; otherwise a device states it for a stroke.
        source: where the limit comes from, in words; empty if the scenario does not say.
        valid: whether what was found is: no curve ended behind which nothing is stated.
    """

    name: str
    title: str
    where: str
    found: float
    limit: float
    unit: str
    digits: int
    of_scenario: bool = False
    source: str = ""
    valid: bool = True

    @property
    def kept(self) -> bool:
        """Whether the limit is kept, whatever the sign of the value; never by one that is not finite or not valid."""
        return self.valid and math.isfinite(self.found) and not beyond(abs(self.found), self.limit)

    @property
    def used(self) -> float:
        """How much of the limit is used [%]."""
        return 100 * abs(self.found) / self.limit

    @property
    def text(self) -> str:
        """What was found, with the digits that are worth reading beside the limit."""
        return against(self.found, self.limit, self.digits)

    @property
    def said(self) -> str:
        """What was found against the limit: ``mean deceleration of M1 (5.214 of 5 g)``."""
        found = "no number" if math.isnan(self.found) else f"{self.text} of {self.limit:.12g} {self.unit}".rstrip()
        return f"{self.title}{f' of {self.where}' if self.where else ''} ({found})"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj run --json`` prints them."""
        names = ("name", "where", "found", "limit", "unit", "kept", "valid", "source")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, eq=False)
class Limited:
    """One limit and what was found in each case of a lot.

    Attributes:
        name: as a :class:`Criterion` has it, and so on.
        title: likewise.
        unit: likewise.
        digits: likewise.
        of_scenario: likewise.
        source: likewise.
        where: (n_case,) of each case.
        found: (n_case,) likewise.
        limit: (n_case,) likewise.
        valid: (n_case,) likewise.
    """

    name: str
    title: str
    unit: str
    digits: int
    of_scenario: bool
    source: str
    where: Sequence[str]
    found: Array
    limit: Array
    valid: BoolArray

    @property
    def kept(self) -> BoolArray:
        """(n_case,) whether the limit is kept; see :class:`Criterion`."""
        return np.asarray(self.valid & np.isfinite(self.found) & ~beyond(np.abs(self.found), self.limit))

    @property
    def used(self) -> Array:
        """(n_case,) how much of the limit is used [%]."""
        return np.asarray(100 * np.abs(self.found) / self.limit)

    def of(self, case: int) -> Criterion:
        """That of one case."""
        return Criterion(
            self.name,
            self.title,
            self.where[case],
            float(self.found[case]),
            float(self.limit[case]),
            self.unit,
            self.digits,
            self.of_scenario,
            self.source,
            bool(self.valid[case]),
        )


def limits_of(measured: Measured, values: Values) -> tuple[Limited, ...]:
    """What became of every limit of a lot: of those that the scenario states, then of the strokes of stages."""
    return (*_of_scenario(measured, values), *_of_stages(measured))


def _of_scenario(measured: Measured, values: Values) -> Iterator[Limited]:
    """The limits that the scenario states."""
    chain, valid = measured.chain, measured.tally.valid_until == math.inf
    stated = measured.lot.values(lambda chain: list(chain.limits.values())) if chain.limits else np.zeros((0, 0))
    of_name = of_each(chain) if chain.limits else {}
    for n, name in enumerate(chain.limits):
        if name in values.columns:
            (title, unit, digits), where = _said(values.columns[name]), [""] * len(measured)
            found = values.in_columns([name])[:, 0]
        else:
            quantity = of_name[name]
            (title, unit, digits), (where, found) = _said(quantity), _worst(*_parts(measured, values, quantity))
        source = source_of(chain.sources, f"limits.{name}")
        yield Limited(name, title, unit, digits, True, source, where, found, stated[:, n], valid)


def _parts(measured: Measured, values: Values, quantity: Quantity) -> tuple[list[str], Array]:
    """Names of the vehicles or interfaces of the moving train that a limit of a quantity is about, and its numbers."""
    chain, sides = measured.chain, measured.sides
    if quantity not in of_sides(chain):
        own = order_of_vehicles(chain)[: chain.n_moving]
        return [chain.vehicles[i].name for i in own], picked(values.of(quantity), own)
    own = list(range(n_own_sides(chain)))
    if quantity.name == _MET:
        own = [n for n in own if sides.faced[n]] or own
    return [sides.names[n] for n in own], picked(values.of(quantity), own)


def _of_stages(measured: Measured) -> Iterator[Limited]:
    """The stroke limit of each stage under test that has one, where most of it is used; it may differ as built."""
    chain, sides, valid = measured.chain, measured.sides, measured.tally.valid_until == math.inf
    found: dict[str, tuple[str, list[int]]] = {}
    limited = np.flatnonzero(sides.stage_limit[0] < np.inf).tolist()
    for k, stage in ((k, sides.stages[k]) for k in limited):
        if sides.judged[stage.side]:
            several = stage.name != DEVICE  # a device of one curve is its own stage, and has the limit itself
            device = sides.devices[stage.side]
            path = f"devices.{device}{f'.stages.{stage.name}' if several else ''}.stroke_limit_mm"
            found.setdefault(path, (f"stroke of {device}{f' {stage.name}' if several else ''}", []))[1].append(k)
    for path, (title, stages) in found.items():
        stroke, limit = picked(sides.stage_stroke, stages) / MM, picked(sides.stage_limit, stages) / MM
        at = _place_of_worst(100 * np.abs(stroke) / limit)
        where = [sides.names[sides.stages[stages[k]].side] for k in at[1].tolist()]
        source = source_of(chain.sources, path)
        yield Limited(path, title, STAGE.unit, STAGE.digits, False, source, where, stroke[at], limit[at], valid)


def reported(
    chain: Chain,
    columns: Mapping[str, Column],
    responses: Mapping[str, float],
    interfaces: Sequence[InterfaceMetrics],
    vehicles: Sequence[VehicleMetrics],
    name: str,
) -> Criterion:
    """A response, or a quantity where it is largest in the moving train, without a limit.

    Args:
        chain: what was collided.
        columns: what the responses are, by name.
        responses: by column.
        interfaces: from the front backwards, the moving train first.
        vehicles: likewise.
        name: of a response or a quantity.
    """
    if name in columns:
        title, unit, digits = _said(columns[name])
        return Criterion(name, title, "", responses[name], math.inf, unit, digits, True)
    title, unit, digits = _said(of_each(chain)[name])
    own: tuple[VehicleMetrics | InterfaceMetrics, ...] = (
        *vehicles[: chain.n_moving],
        *interfaces[: n_own_sides(chain)],
    )
    there = [part for part in own if name in part.values]
    faced = [part for part in there if not (name == _MET and isinstance(part, InterfaceMetrics) and not part.faces)]
    parts = faced or there
    (where,), (found,) = _worst([part.name for part in parts], np.array([[part.values[name] for part in parts]]))
    return Criterion(name, title, where, float(found), math.inf, unit, digits, True)


def _said(thing: Column | Quantity) -> tuple[str, str, int]:
    """Title, unit and digits."""
    if isinstance(thing, Quantity):
        return thing.key.replace("_", " "), thing.unit, thing.digits
    return f"{thing.title} of the partner" if thing.of_partner else thing.title, thing.unit, thing.digits


def _worst(names: Sequence[str], values: Array) -> tuple[list[str], Array]:
    """The name, and the largest magnitude with its sign, of each row of values (n_case, n); nan is larger than all."""
    at = _place_of_worst(values)
    return [names[k] for k in at[1].tolist()], values[at]


def _place_of_worst(values: Array) -> tuple[IntArray, IntArray]:
    """(n_case,) indices of the first of the largest magnitudes in each row (n_case, n)."""
    return np.arange(len(values)), np.where(np.isnan(values), np.inf, np.abs(values)).argmax(axis=-1)
