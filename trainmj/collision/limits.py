"""Limits: what a scenario allows the train under test, and how a collision keeps it.

A limit of a scenario is stated for a quantity of every vehicle or interface (``mean_deceleration_g``) or for one
response by the name of its column (``stroke_M1_M2_mm``). The train under test is the moving one; a partner is not
judged. The stroke limits of stages belong to the devices: those of a struck train are judged if it is the same train.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from trainmj.collision.chain import Chain, n_own_sides
from trainmj.collision.quantities import STAGE, Column, of_each
from trainmj.collision.records import InterfaceMetrics, VehicleMetrics
from trainmj.files.provenance import source_of
from trainmj.scenario.devices import DEVICE
from trainmj.units import against, beyond

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


def of_responses(
    chain: Chain,
    columns: Mapping[str, Column],
    responses: Mapping[str, float],
    interfaces: Sequence[InterfaceMetrics],
    vehicles: Sequence[VehicleMetrics],
) -> Iterator[Criterion]:
    """What became of the limits that a scenario states.

    Args:
        chain: what was collided.
        columns: what the responses are, by name.
        responses: by column.
        interfaces: from the front backwards, the moving train first.
        vehicles: likewise.
    """
    for name, limit in chain.limits.items():
        found = reported(chain, columns, responses, interfaces, vehicles, name)
        yield replace(found, limit=limit, source=source_of(chain.sources, f"limits.{name}"))


def reported(
    chain: Chain,
    columns: Mapping[str, Column],
    responses: Mapping[str, float],
    interfaces: Sequence[InterfaceMetrics],
    vehicles: Sequence[VehicleMetrics],
    name: str,
) -> Criterion:
    """A response, or a quantity where it is largest in the moving train, without a limit; arguments as above."""
    column = columns.get(name)
    if column is not None:
        title = f"{column.title} of the partner" if column.of_partner else column.title
        return Criterion(name, title, "", responses[name], math.inf, column.unit, column.digits, True)
    quantity = of_each(chain)[name]
    own: tuple[VehicleMetrics | InterfaceMetrics, ...] = (
        *vehicles[: chain.n_moving],
        *interfaces[: n_own_sides(chain)],
    )
    there = [part for part in own if name in part.values]
    faced = [part for part in there if not (name == _MET and isinstance(part, InterfaceMetrics) and not part.faces)]
    worst = max(faced or there, key=lambda part: _badness(part.values[name]))
    title, found = quantity.key.replace("_", " "), worst.values[name]
    return Criterion(name, title, worst.name, found, math.inf, quantity.unit, quantity.digits, True)


def of_stages(chain: Chain, interfaces: Iterable[InterfaceMetrics]) -> Iterator[Criterion]:
    """The stroke limit of each stage under test that has one, where most of it is used; it may differ as built."""
    found: dict[str, Criterion] = {}
    for interface in interfaces:
        for stage in interface.stages if interface.judged else ():
            if stage.limit_mm is not None:
                several = stage.name != DEVICE  # a device of one curve is its own stage, and has the limit itself
                path = f"devices.{interface.device}{f'.stages.{stage.name}' if several else ''}.stroke_limit_mm"
                title = f"stroke of {interface.device}{f' {stage.name}' if several else ''}"
                what = path, title, interface.name, stage.stroke_mm, stage.limit_mm, STAGE.unit, STAGE.digits
                one = Criterion(*what, source=source_of(chain.sources, path))
                found[path] = max(found.get(path, one), one, key=lambda criterion: _badness(criterion.used))
    yield from found.values()


def _badness(value: float) -> float:
    return math.inf if math.isnan(value) else abs(value)
