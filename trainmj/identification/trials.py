"""Trials: values for the unknowns, simulated in every case at once, and kept so that none is simulated twice.

What a trial gives depends on the values it sets, the cases and the step alone. The keys of its cases are made of these,
so a search that was stopped finds all that it had computed, and repeats itself to the same end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trainmj.cases.engine import Case, Computed, Local, Row
from trainmj.cases.runner import rows_of
from trainmj.cases.store import Store, key_of
from trainmj.cases.table import STATUS
from trainmj.collision.device import Array
from trainmj.collision.status import FAILED
from trainmj.scenario import Scenario


@dataclass
class Trials:
    """Simulates trials in a fixed list of m cases; the numbers do not depend on threads."""

    scenario: Scenario  # what trials and cases change
    cases: Sequence[Case]
    columns: Sequence[str]  # of the results that are kept
    store: Store  # keeps every case of every trial
    threads: int = 0  # native threads; 0 for all cores
    progress: Callable[[int], None] = lambda finished: None  # told of trials that just finished, those in the store too
    simulated: int = field(default=0, init=False)  # trials that were not in the store

    def __post_init__(self) -> None:
        """Nothing is simulated yet."""
        self._engine = Local(self.scenario, self.threads)

    def __call__(self, trials: Sequence[Case], step: float | None = None, places: Sequence[int] | None = None) -> Array:
        """Simulate trials, each given by what it sets in the scenario.

        Args:
            trials: n of them.
            step: integration step [ms]; that of the scenario if None.
            places: of the cases that are simulated, m of them; all if None.

        Returns:
            (n_trial, m, n_column) responses; all NaN for a trial that breaks a rule or is unstable in some case.
        """
        cases = self.cases if places is None else [self.cases[k] for k in places]
        fine = {} if step is None else _step(self.scenario, step)
        wanted: dict[str, Case] = {}
        keys = []
        for changes in trials:
            made = [{**changes, **case, **fine} for case in cases]
            keys.append([key_of(self.columns, case) for case in made])
            wanted |= zip(keys[-1], made, strict=True)
        computed: set[str] = set()

        def keep(case: Computed) -> Row:
            computed.add(case.key)
            return {name: case.row[name] for name in (*STATUS, *self.columns) if name in case.row}

        rows = rows_of(self.store, self._engine, wanted, keep)
        self.simulated += len({tuple(trial) for trial in keys if not computed.isdisjoint(trial)})
        self.progress(len(trials))
        found = np.array([self._responses([rows[key] for key in trial]) for trial in keys])
        return found.reshape(len(trials), len(cases), len(self.columns))

    def _responses(self, rows: Sequence[Mapping[str, Any]]) -> Array:
        """The responses (m, n_column) of one trial."""
        found = np.array([[row.get(column, np.nan) for column in self.columns] for row in rows])
        if any(row["status"] in FAILED for row in rows) or not np.isfinite(found).all():
            found[:] = np.nan
        return found


def _step(scenario: Scenario, step: float) -> dict[str, float]:
    """Another step [ms], and as many of them between records as come nearest to the interval of the scenario."""
    n = max(1, round(scenario.simulation.record_every_ms / step))
    return {"simulation.step_ms": step, "simulation.record_every_ms": n * step}
