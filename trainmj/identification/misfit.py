"""How far trials are from what is wanted: residuals, their norm and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trainmj.collision.device import Array
from trainmj.identification.plan import Identification
from trainmj.identification.trials import Trials
from trainmj.identification.unknowns import Point

REFUSED = 1e6
"""Residual of every value of a trial that cannot be simulated."""

_LARGEST = 1e5  # residual of one that can: its powers stay finite

_INSIDE = 0.95  # fraction of a bar beyond which a value is pushed back


@dataclass
class Misfit:
    """Residuals over the unit cube of an identification.

    A residual is (found - wanted) / tolerance * weight. A value beyond 95 % of its bar adds a second one, a constraint
    that is missed one more.
    """

    plan: Identification
    trials: Trials  # simulates the fitted cases
    step: float | None  # of integration [ms]; that of the scenario if None
    cases: int | None = None  # how many cases are simulated, spread over the list; None for all
    norm: float = 2.0  # p of the sum of |residual|^p that is minimised
    size: float = 1.0  # residual that counts as 1 in a norm other than 2, so that powers stay within bounds
    ratio: float | None = (
        None  # of neighbouring slopes of a curve that counts as one residual; None for no such residual
    )
    bars: bool = True  # whether values near their bars are pushed back; a search across valleys does better without

    def __post_init__(self) -> None:
        """Nothing is simulated yet."""
        self._sample, self._cases = sample, _ = self.plan.fitted.some(self.cases)
        self._counted = sample.weight > 0
        self._scale = np.divide(sample.weight, sample.tolerance)
        self._barred = np.isfinite(sample.bar) & self._counted & self.bars

    def residuals(self, units: Sequence[Array]) -> Array:
        """Residuals of places of the unit cube (n_axes,), as one batch.

        Returns:
            (k, n_residual), so that the sum of their squares is the sum of |residual|^p.
        """
        points = [self.plan.unknowns.point(unit) for unit in units]
        plain = self.of_points(points)
        if self.ratio is not None:
            rough = np.array([self.plan.unknowns.roughness(unit) for unit in units]) / np.log(self.ratio)
            plain = np.concatenate([plain, rough], axis=1)
        if self.norm == 2.0:
            return plain
        return np.asarray(np.sign(plain) * (np.abs(plain) / self.size) ** (self.norm / 2.0))

    def of_points(self, points: Sequence[Point]) -> Array:
        """Plain residuals (k, n_residual) of trials, as one batch."""
        plan, sample = self.plan, self._sample
        responses = self.trials([plan.unknowns.changes(p.value) for p in points], self.step, self._cases)
        off = plan.found(sample, responses) - sample.wanted
        beyond = np.maximum(0.0, np.abs(off[:, self._barred]) / sample.bar[self._barred] - _INSIDE)
        missed = np.array([p.missed for p in points]).reshape(len(points), -1)
        parts = [
            (off * self._scale)[:, self._counted],
            plan.spec.method.bar_weight * np.sign(off[:, self._barred]) * beyond,
            missed,
        ]
        return np.asarray(np.nan_to_num(np.clip(np.concatenate(parts, axis=1), -_LARGEST, _LARGEST), nan=REFUSED))

    def cost(self, units: Sequence[Array]) -> Array:
        """Half of the sum of |residual|^p at places of the unit cube (k,)."""
        return np.asarray(0.5 * np.sum(self.residuals(units) ** 2, axis=1))

    def jacobian(self, unit: Array, difference: float) -> Array:
        """Derivatives (n_residual, n_axes) at a place of the unit cube, one-sided; all trials are one batch.

        Responses are smooth except for small jumps, where an event falls on another step: differences must be wide
        enough to drown the jumps, and narrow enough for the curvature.
        """
        size = unit.size
        sides = np.where(unit + difference <= 1.0, 1.0, -1.0)
        ahead = [unit + difference * side * np.eye(size)[k] for k, side in enumerate(sides)]
        here, *there = self.residuals([unit, *ahead])
        columns = [(far - here) / (difference * side) for far, side in zip(there, sides, strict=True)]
        lost = [k for k, far in enumerate(there) if _refused(far)]
        if lost:  # beyond the edge of what can be simulated: look the other way
            behind = self.residuals([unit - difference * sides[k] * np.eye(size)[k] for k in lost])
            for k, far in zip(lost, behind, strict=True):
                columns[k] = np.zeros_like(here) if _refused(far) else (here - far) / (difference * sides[k])
        return np.column_stack(columns)


def _refused(residuals: Array) -> bool:
    return bool(np.abs(residuals).max() >= REFUSED)
