"""Limits: what a scenario allows the train under test, and how a collision keeps it.

A limit of a scenario is stated for a quantity of every vehicle or interface (``mean_deceleration_g``) or for one
response by the name of its column (``stroke_M1_M2_mm``). The train under test is the moving one. The stroke limits of
stages belong to the devices and hold wherever these are built in.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from trainmj.collision.quantities import INTERFACE, STAGE, VEHICLE, Quantity, columns_of
from trainmj.errors import close_match
from trainmj.files.problems import Problem

if TYPE_CHECKING:
    from trainmj.collision.chain import Chain
    from trainmj.collision.summary import Summary

_EACH: dict[str, Quantity[Any]] = {q.name: q for q in VEHICLE} | {q.name: q for q in INTERFACE}


@dataclass(frozen=True)
class Criterion:
    """One limit and what was found.

    Attributes:
        name: what is limited: a quantity, a column, or the stroke limit of a stage by its path in the scenario.
        title: the same in words.
        where: vehicle, interface or stage that comes nearest to the limit or passes it by most; empty for a response
            of the whole collision.
        found: its value.
        limit: the largest value that is allowed.
        unit: of both.
        digits: decimals worth reading; negative for significant digits.
    """

    name: str
    title: str
    where: str
    found: float
    limit: float
    unit: str
    digits: int

    @property
    def kept(self) -> bool:
        """Whether the limit is kept; never by a value that is not finite."""
        return self.found <= self.limit

    @property
    def text(self) -> str:
        """What was found, with the digits that are worth reading."""
        return f"{self.found:.{self.digits}f}" if self.digits >= 0 else f"{self.found:.{-self.digits}g}"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj run --json`` prints them."""
        names = ("name", "where", "found", "limit", "unit", "kept")
        return {name: getattr(self, name) for name in names}


def unknown_limits(chain: Chain) -> Iterator[Problem]:
    """A problem for each limit of a chain whose name is neither a quantity nor a response of this chain."""
    known = {**_EACH, **columns_of(chain)} if chain.limits else {}
    for name in chain.limits:
        if name not in known:
            rule = "there is no quantity or response of this name"
            yield Problem(("limits", name), f"{rule}{close_match(name, known)}")


def judge(summary: Summary) -> tuple[Criterion, ...]:
    """Every limit beside what was found: those of the scenario, then the strokes of stages."""
    return (*_of_scenario(summary), *_of_stages(summary))


def _of_scenario(summary: Summary) -> Iterator[Criterion]:
    row = summary.row()
    for name, limit in summary.allowed.items():
        if name in summary.columns:
            column = summary.columns[name]
            yield Criterion(name, column.title, "", row[name], limit, column.unit, column.digits)
        else:
            quantity = _EACH[name]
            things = summary.vehicles if quantity in VEHICLE else summary.interfaces
            found = {thing.name: thing.values[name] for thing in things[: summary.n_moving]}
            where = max(found, key=lambda thing: _badness(found[thing]))
            title = quantity.key.replace("_", " ")
            yield Criterion(name, title, where, found[where], limit, quantity.unit, quantity.digits)


def _of_stages(summary: Summary) -> Iterator[Criterion]:
    """The stroke limit of each stage that has one, where the stage is used most."""
    found: dict[str, Criterion] = {}
    for interface in summary.interfaces:
        for stage in interface.stages:
            if stage.limit_mm is None:
                continue
            several = len(interface.stages) > 1
            path = f"devices.{interface.device}" + (f".stages.{stage.name}" if several else "")
            of = f"{interface.device} {stage.name}" if several else interface.device
            criterion = Criterion(
                f"{path}.stroke_limit_mm",
                f"stroke of {of}",
                interface.name,
                stage.stroke_mm,
                stage.limit_mm,
                STAGE.unit,
                STAGE.digits,
            )
            before = found.get(criterion.name)
            if before is None or _badness(before.found) < _badness(criterion.found):
                found[criterion.name] = criterion
    yield from found.values()


def _badness(value: float) -> float:
    return math.inf if math.isnan(value) else value
