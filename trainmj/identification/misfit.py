"""Trials of values for the unknowns, simulated, and how far they are from what is wanted.

What a trial gives depends on the values it sets, the cases and the step alone. The keys of its cases are made of these,
so a search that was stopped finds all that it had computed, and repeats itself to the same end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trainmj.cases.engine import Local
from trainmj.cases.rows import Rows
from trainmj.cases.runner import rows_of
from trainmj.cases.store import Store, damaged, key_of
from trainmj.collision.cases import Case, gathered
from trainmj.collision.channels import Trace
from trainmj.collision.envelope import Array
from trainmj.collision.status import UNUSABLE
from trainmj.identification.plan import Identification, Simulated, at_step
from trainmj.identification.unknowns import Point
from trainmj.scenario import Scenario

REFUSED = 1e6
"""Residual of every value of a trial that cannot be simulated."""

_LARGEST = 1e5  # residual of one that can: its powers stay finite

_INSIDE = 0.95  # fraction of a bar beyond which a value is pushed back


@dataclass
class Trials:
    """Simulates trials in a fixed list of m cases; the numbers do not depend on threads."""

    scenario: Scenario  # what trials and cases change
    cases: Sequence[Case]
    columns: Sequence[str]  # of the results that are kept
    store: Store  # keeps every case of every trial
    threads: int = 0  # native threads; 0 for all cores
    channels: Sequence[str] = ()  # that are kept
    progress: Callable[[int], None] = lambda finished: None  # told of trials that just finished, those in the store too
    simulated: int = field(default=0, init=False)  # trials that were not in the store

    def __post_init__(self) -> None:
        """Nothing is simulated yet."""
        self._engine = Local(self.scenario, self.threads, self.channels, self.columns)

    def __call__(
        self, trials: Sequence[Case], step: float | None = None, places: Sequence[int] | None = None
    ) -> Simulated:
        """Simulate trials, each given by what it sets in the scenario.

        Args:
            trials: n of them.
            step: integration step [ms]; that of the scenario if None.
            places: of the cases that are simulated, m of them; all if None.

        Returns:
            Their responses, NaN in a case that breaks a rule, is unstable or not valid, or lacks the response, and the
            channels of the other cases.
        """
        cases = self.cases if places is None else [self.cases[k] for k in places]
        fine = {} if step is None else at_step(self.scenario, step)
        wanted: dict[str, Case] = {}
        keys = []
        for changes in trials:
            made = [{**changes, **case, **fine} for case in cases]
            keys.append([key_of([*self.columns, *self.channels], case) for case in made])
            wanted |= zip(keys[-1], made, strict=True)
        computed: set[str] = set()

        def keep(rows: Rows) -> Rows:
            computed.update(rows.keys)
            return rows

        rows = rows_of(self.store, self._engine, gathered(wanted.items()), keep)
        self.simulated += len({tuple(trial) for trial in keys if not computed.isdisjoint(trial)})
        self.progress(len(trials))
        found = np.array([self._responses([rows[key] for key in trial]) for trial in keys])
        return Simulated(
            found.reshape(len(trials), len(cases), len(self.columns)),
            [[self._traces(rows[key]) for key in trial] for trial in keys],
        )

    def _responses(self, rows: Sequence[Mapping[str, Any]]) -> Array:
        """The responses (m, n_column) of one trial."""
        found = np.array([[row.get(column, np.nan) for column in self.columns] for row in rows])
        found[[row["status"] in UNUSABLE for row in rows]] = np.nan
        return np.where(np.isfinite(found), found, np.nan)

    def _traces(self, row: Mapping[str, Any]) -> dict[str, Trace]:
        """The channels of one case."""
        if row["status"] in UNUSABLE:
            return {}
        try:
            return {name: Trace.unpacked(row[name]) for name in self.channels if name in row}
        except (TypeError, ValueError):
            raise damaged(self.store.file) from None


@dataclass
class Misfit:
    """Residuals over the unit cube of an identification.

    A residual is (found - wanted) / tolerance * weight; those of a channel are smaller: all of them count as its target
    states. A value beyond 95 % of its bar adds a second one, a constraint that is missed one more.
    """

    plan: Identification
    trials: Trials  # simulates the fitted cases
    step: float | None  # of integration [ms]; that of the scenario if None
    cases: int | None = None  # how many cases are simulated, spread over the list; None for all
    norm: float = 2.0  # p of the sum of |residual|^p that is minimised
    size: float = 1.0  # residual that counts as 1 in a norm other than 2, so that powers stay within bounds
    ratio: float | None = None  # of neighbouring slopes of a curve that counts as one residual; None for no such one
    bars: bool = True  # whether values near their bars are pushed back; a search across valleys does better without

    def __post_init__(self) -> None:
        """Nothing is simulated yet."""
        self._sample, self._cases = sample, _ = self.plan.fitted.some(self.cases)
        self._counted = sample.weight > 0
        self._share = sample.share ** (1.0 / self.norm)  # a channel's residuals add up to those of what it counts
        self._scale = np.divide(sample.weight, sample.tolerance) * self._share
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
        simulated = self.trials([plan.unknowns.changes(p.value) for p in points], self.step, self._cases)
        off = plan.found(sample, simulated, points) - sample.wanted
        off[np.isnan(off[:, self._counted]).any(axis=1)] = np.nan  # a trial that lacks a value is refused as a whole
        beyond = np.maximum(0.0, np.abs(off[:, self._barred]) / sample.bar[self._barred] - _INSIDE)
        missed = np.array([p.missed for p in points]).reshape(len(points), -1)
        parts = [
            (off * self._scale)[:, self._counted],
            plan.spec.method.bar_weight * np.sign(off[:, self._barred]) * beyond * self._share[self._barred],
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
