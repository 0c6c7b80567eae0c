"""How the cases of a lot ended: kinds for all at once, words for those that need them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from trainmj.collision.chain import order_of_vehicles
from trainmj.collision.coarse import Coarse
from trainmj.collision.device import CAR_BODY
from trainmj.collision.envelope import Array, BoolArray
from trainmj.collision.limits import Limited
from trainmj.collision.measured import UNSTABLE, Measured
from trainmj.collision.quantities import STAGE
from trainmj.collision.records import COLLAPSED
from trainmj.collision.status import Kind, Status, not_valid
from trainmj.units import KJ, MM, beyond

_WITHOUT_WORDS = (Kind.OVER, Kind.TIME_LIMIT)

_WITHOUT_PEAKS = (Kind.UNSTABLE, Kind.NO_CONTACT)

Said = tuple[str, str]
"""Where something is, and that with its numbers."""


@np.errstate(all="ignore")
def all_finite(measured: Measured) -> BoolArray:
    """(n_case,) whether the values that decide how a case ended are finite; it is unstable if not."""
    return np.asarray(np.isfinite(measured.energy_error) & np.isfinite(measured.tally.stroke_max).all(axis=-1))


class Endings:
    """How the cases of a lot ended."""

    def __init__(self, measured: Measured, limits: Sequence[Limited]) -> None:
        """Take what was measured, and the limits."""
        self._measured, self._limits = measured, limits
        self._sides, self._chain = measured.sides, measured.chain

    @cached_property
    @np.errstate(all="ignore")
    def kinds(self) -> list[Kind]:
        """(n_case,) the kind of each."""
        measured, tally, energy_error = self._measured, self._measured.tally, self._measured.energy_error
        sides, vehicles = self._judged
        limited = [~one.kept for one in self._limits if one.of_scenario]
        found: dict[Kind, Any] = {
            Kind.UNSTABLE: ~self._finite | (np.abs(energy_error) > UNSTABLE) | (measured.curve_error > UNSTABLE),
            Kind.NO_CONTACT: tally.first_force_time.max(axis=-1) < 0.0,
            Kind.OVERRIDE: ~np.isnan(self._sides.off_time[:, self._lines]).all(axis=-1),
            Kind.CURVE_ENDED: (self._sides.end_time < np.inf).any(axis=-1) | measured.used_up.any(axis=-1),
            Kind.EXHAUSTED: (self._passed | self._crushed)[:, sides].any(axis=-1)
            | self._collapsed[:, vehicles].any(axis=-1),
            Kind.LIMIT: np.any(limited, axis=0) if limited else np.zeros(len(measured), dtype=bool),
            Kind.OVER: tally.is_over,
        }
        names = [*found, Kind.TIME_LIMIT]
        first = np.array([*found.values(), np.ones(len(measured), dtype=bool)]).argmax(axis=0)
        return [names[k] for k in first.tolist()]

    def of(self, case: int) -> Status:
        """How one of them ended, in words, and whether the step is too coarse for its peaks."""
        status = self._ended_as(case)
        if status.kind in _WITHOUT_PEAKS or not self._coarse_cases[case]:
            return status
        return replace(status, detail="; ".join(filter(None, (status.detail, self.coarse.said(case)))))

    def _ended_as(self, case: int) -> Status:
        """How one of them ended."""
        kind = self.kinds[case]
        if kind in _WITHOUT_WORDS:
            return Status(kind)
        if kind is Kind.UNSTABLE:
            return Status(kind, detail=f"{self._unstable(case)}; take a smaller step")
        tally = self._measured.tally
        if kind is Kind.NO_CONTACT:
            return Status(
                kind,
                detail="the two sides came to rest, or stopped coming closer, before a device was pressed"
                if tally.is_over[case]
                else "no device was pressed before the time limit",
            )
        cut = "" if tally.is_over[case] else "; cut off by the time limit"
        passed = ", ".join(one.of(case).said for one in self._limits if one.of_scenario and not one.kept[case])
        if kind is Kind.LIMIT:
            return Status(kind, detail=passed + cut)
        if kind is Kind.EXHAUSTED:
            where, said = zip(*self.spent(case, True), strict=True)
            more = f"; {Kind.LIMIT}: {passed}" if passed else ""
            return Status(kind, where, ", ".join(said) + more + cut)
        ended = list(self._ended(case))
        until = f"; {not_valid(float(tally.valid_until[case]))}{cut}"
        if kind is Kind.CURVE_ENDED:
            where, said = zip(*ended, strict=True)
            return Status(kind, where, f"{', '.join(said)}{until}")
        slid = [(self._sides.names[n], one) for n in range(len(self._sides.places)) for one in self.slid(case, n)]
        also = f"; {Kind.CURVE_ENDED} at {', '.join(one for _, one in ended)}" if ended else ""
        detail = ", ".join(f"{name} {one}" for name, one in slid)
        return Status(kind, tuple(name for name, _ in slid), f"{detail}{also}{until}")

    def slid(self, case: int, side: int) -> list[str]:
        """Stages of a side whose faces slid off each other, or whose pins met, in words."""
        sides, found = self._sides, []
        for stage, place in sides.on_lines(side):
            if not math.isnan(time := float(sides.off_time[case, place])):
                overlap = sides.overlap[case, place] / MM
                met = self._chain.lines[place].strut
                how = "its pins met" if met else f"past its {overlap:.6g} mm of overlap"
                found.append(f"{stage} at {time:.4g} s ({how})")
        return found

    def spent(self, case: int, under_test: bool) -> list[Said]:
        """Each stage that passed its limit and each car body that gave way, under test or of the partner."""
        sides, stages, vehicles = self._sides, self._stages_mm, self._judged[1]
        found = []
        for k in self._beyond[case]:
            stage = sides.stages[k]
            if sides.judged[stage.side] != under_test:
                continue
            where = place(sides.names[stage.side], sides.n_stages[stage.side], stage.name)
            stroke, limit = (float(values[case, k]) for values in stages)
            if self._passed[case, k]:
                found.append((where, f"{where} ({STAGE.text(stroke, limit)} of {limit:.12g} mm)"))
            else:
                found.append((where, crushed(where, stroke)))
        for i in order_of_vehicles(self._chain) if self._chain.members else ():
            if (i in vehicles) == under_test and self._collapsed[case, i]:
                name = self._chain.vehicles[i].name
                found.append((f"body of {name}", collapsed(name, float(self._plastic_mm[case, i]))))
        return found

    def _unstable(self, case: int) -> str:
        """Why a case is unstable."""
        measured, sides = self._measured, self._sides
        if not self._finite[case]:
            return "a value is not finite"
        if (error := abs(float(measured.energy_error[case]))) > UNSTABLE:
            return f"the energy balance is off by {error:.2%}"
        side = int(sides.beside_curves[1][case])
        return (
            f"{sides.devices[side]} at {sides.names[side]} absorbed {sides.energy[case, side] / KJ:.4g} kJ, and the "
            f"area below its curve is {sides.energy_by_curve[case, side] / KJ:.4g} kJ"
        )

    def _ended(self, case: int) -> Iterator[Said]:
        """Interfaces whose device went past the end of its curve, with its stroke, and bodies that are used up."""
        sides = self._sides
        for n, (name, device) in enumerate(zip(sides.names, sides.devices, strict=True)):
            if sides.end_time[case, n] < np.inf:
                if sides.drawn_out[case, n]:
                    yield name, f"{name} (drawn past the end of the curve of the draw gear of {device})"
                else:
                    stroke = sides.stroke[case, n] / MM
                    yield name, f"{name} ({stroke:.1f} mm, past the end of the curve of {device})"
        for i in order_of_vehicles(self._chain):
            if self._measured.used_up[case, i]:
                where = f"body of {self._chain.vehicles[i].name}"
                yield where, f"{where} (a member shortened by its whole length)"

    @cached_property
    def coarse(self) -> Coarse:
        """The peaks for which the step may be too coarse."""
        return Coarse(self._measured)

    @cached_property
    def _coarse_cases(self) -> list[bool]:
        """(n_case,) whether there are any."""
        cases: list[bool] = self.coarse.cases.tolist()
        return cases

    @cached_property
    def _finite(self) -> BoolArray:
        """(n_case,) whether the values that decide are finite."""
        return all_finite(self._measured)

    @cached_property
    def _judged(self) -> tuple[list[int], list[int]]:
        """The stages and the vehicles whose limits count."""
        chain = self._chain
        stages = [k for k, stage in enumerate(self._sides.stages) if self._sides.judged[stage.side]]
        return stages, [i for i in range(len(chain.vehicles)) if chain.twin or i < chain.n_moving]

    @cached_property
    def _stages_mm(self) -> tuple[Array, Array]:
        """(n_case, n_stage) strokes of stages and what the design allows [mm]."""
        return self._sides.stage_stroke / MM, self._sides.stage_limit / MM

    @cached_property
    def _beyond(self) -> list[list[int]]:
        """(n_case,) the stages that passed their limits, or are a car body and have given way."""
        found: list[list[int]] = [[] for _ in range(len(self._measured))]
        for case, stage in zip(*np.nonzero(self._passed | self._crushed), strict=True):
            found[case].append(int(stage))
        return found

    @cached_property
    def _passed(self) -> BoolArray:
        """(n_case, n_stage) whether stages passed their limits."""
        stroke, limit = self._stages_mm
        return beyond(stroke, limit)

    @cached_property
    def _crushed(self) -> BoolArray:
        """(n_case, n_stage) whether they are the car body, and have given way."""
        bodies = np.array([stage.name == CAR_BODY for stage in self._sides.stages])
        return np.asarray(bodies & (self._stages_mm[0] > COLLAPSED))

    @cached_property
    def _plastic_mm(self) -> Array:
        """(n_case, n_vehicle) plastic shortening of bodies [mm]."""
        return np.asarray(self._measured.body_plastic[0] / MM)

    @cached_property
    def _collapsed(self) -> BoolArray:
        """(n_case, n_vehicle) whether bodies have given way."""
        if not self._chain.members:
            return np.zeros_like(self._measured.mass, dtype=bool)
        return np.asarray(np.abs(self._plastic_mm) > COLLAPSED)

    @property
    def _lines(self) -> list[int]:
        """The lines of the paths of all sides."""
        return [place for n in range(len(self._sides.places)) for _, place in self._sides.on_lines(n)]


def place(name: str, n_stages: int, stage: str) -> str:
    """Where a stage is: the interface, and the stage if it is one of several."""
    return f"{name} {stage}" if n_stages > 1 else name


def crushed(where: str, stroke_mm: float) -> str:
    """A car body behind a device that gave way, with by how much."""
    return f"{where} (crushed by {STAGE.text(stroke_mm)} mm)"


def collapsed(name: str, plastic_mm: float) -> str:
    """A body of a vehicle that gave way, with by how much."""
    how = "crushed" if plastic_mm > 0.0 else "drawn out"
    return f"body of {name} ({how} by {abs(plastic_mm):.1f} mm)"
