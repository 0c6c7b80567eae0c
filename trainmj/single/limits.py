"""What a collision found against its limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from trainmj.collision.summary import InterfaceMetrics, Summary
from trainmj.output.blocks import Verdict, judged, passed, warned
from trainmj.output.blocks import failed as against

_MOST = 16  # criteria shown

PEAK_LIMIT_G = 5.0
"""Largest acceleration: the limit that doi 10.1186/s10033-022-00755-8 sets for peaks; EN 15227 has it for the mean."""


@dataclass(frozen=True)
class Criterion:
    """One quantity and its limit.

    Attributes:
        name: what is limited.
        where: vehicle or interface at which it is largest.
        found: its value.
        limit: what is allowed; None where nothing is stated.
        unit: of both.
        digits: decimals of both.
    """

    name: str
    where: str
    found: float
    limit: float | None
    unit: str
    digits: int

    @property
    def kept(self) -> bool | None:
        """Whether the limit is kept; None without one."""
        return None if self.limit is None else self.found <= self.limit

    @property
    def verdict(self) -> Verdict:
        """The same as a verdict."""
        return judged(self.kept)


def criteria(summary: Summary) -> list[Criterion]:
    """Accelerations, and the stroke of every stage that has a limit or has gone past its curve."""
    peak = max(summary.vehicles, key=lambda v: v.peak_device_acceleration_g)
    mean = max(summary.vehicles, key=lambda v: v.mean_deceleration_g)
    found = [
        Criterion(
            "largest peak acceleration (devices)",
            peak.name,
            peak.peak_device_acceleration_g,
            PEAK_LIMIT_G,
            "g",
            3,
        ),
        Criterion("largest mean deceleration", mean.name, mean.mean_deceleration_g, PEAK_LIMIT_G, "g", 3),
    ]
    for interface in summary.interfaces:
        found += _strokes(interface)
    return found


def outcome(status: str) -> Verdict:
    """The status of a run as a verdict."""
    if status == "over":
        return passed("over: no device is pressed any more")
    if status.startswith("no contact"):
        return warned(status)
    if status == "time limit":
        return warned("time limit: the collision was not over")
    return against(status)


def _strokes(interface: InterfaceMetrics) -> Iterator[Criterion]:
    for stage in interface.stages:
        if stage.limit_mm is not None:
            of = f", {stage.name}" if len(interface.stages) > 1 else ""
            yield Criterion(f"stroke{of}", interface.name, stage.stroke_mm, stage.limit_mm, "mm", 1)


def most_used(found: list[Criterion]) -> tuple[list[Criterion], int]:
    """The criteria, or of many those nearest to their limits or beyond them; and how many are left out."""
    if len(found) <= _MOST:
        return found, 0
    used = sorted(range(len(found)), key=lambda k: -(found[k].found / (found[k].limit or found[k].found or 1.0)))
    kept = sorted(used[:_MOST])
    return [found[k] for k in kept], len(found) - _MOST
