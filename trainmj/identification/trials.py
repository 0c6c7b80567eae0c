"""Trials: values for the unknowns, simulated in every case at once, and kept so that none is simulated twice.

What a trial gives depends on the values it sets, the cases and the step alone. Its key is made of these, so a search
that was stopped finds all that it had computed, and repeats itself to the same end.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from trainmj.cases.table import responses_of
from trainmj.collision.batch import run_chains
from trainmj.collision.chain import Chain, line_up
from trainmj.collision.device import Array
from trainmj.errors import InputError
from trainmj.identification.store import TrialStore
from trainmj.scenario import Scenario

Changes = Mapping[str, Any]
_CHUNK = 64  # trials between two writes


class Trials:
    """Simulates trials in a fixed list of cases.

    Args:
        scenario: what trials and cases change.
        cases: m of them.
        columns: of the results that are kept.
        store: keeps every trial.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        progress: called with the number of trials that were just finished, those from the store too.
    """

    def __init__(
        self,
        scenario: Scenario,
        cases: Sequence[Changes],
        columns: Sequence[str],
        store: TrialStore,
        threads: int = 0,
        progress: Callable[[int], None] = lambda finished: None,
    ) -> None:
        """Nothing is simulated yet."""
        self.scenario = scenario
        self.cases = cases
        self.columns = tuple(columns)
        self.simulated = 0
        self._store = store
        self._threads = threads
        self._progress = progress

    def __call__(
        self, trials: Sequence[Changes], step: float | None = None, places: Sequence[int] | None = None
    ) -> Array:
        """Simulate trials.

        Args:
            trials: what each of them sets in the scenario.
            step: integration step [ms]; that of the scenario if None.
            places: of the cases that are simulated, m of them; all if None.

        Returns:
            (n_trial, m, n_column) responses; all NaN for a trial that breaks a rule or is unstable in some case.
        """
        cases = self.cases if places is None else [self.cases[k] for k in places]
        about = json.dumps([list(map(dict, cases)), self.columns])
        keys = [_key(about, changes, step) for changes in trials]
        shape = (len(cases), len(self.columns))
        there = {key: found for key in dict.fromkeys(keys) if (found := self._store.get(key, shape)) is not None}
        self._progress(sum(key in there for key in keys))
        new = {key: changes for key, changes in zip(keys, trials, strict=True) if key not in there}
        waiting = list(new.items())
        for n in range(0, len(waiting), _CHUNK):
            made = self._simulate(dict(waiting[n : n + _CHUNK]), cases, step)
            self._store.add(made)
            there |= made
            self.simulated += len(made)
            self._progress(len(made))
        return np.array([there[key] for key in keys]).reshape(len(trials), *shape)

    def _simulate(
        self, trials: Mapping[str, Changes], cases: Sequence[Changes], step: float | None
    ) -> dict[str, Array]:
        result = {key: np.full((len(cases), len(self.columns)), np.nan) for key in trials}
        refused = set()

        def chains() -> Iterator[tuple[tuple[str, int], Chain]]:
            for key, changes in trials.items():
                try:
                    made = [self._chain(changes, case, step) for case in cases]
                except InputError:
                    continue
                for n, chain in enumerate(made):
                    yield (key, n), chain

        for (key, n), summary in run_chains(chains(), self._threads):
            row = responses_of(summary)
            if row["status"] == "unstable":
                refused.add(key)
            else:
                result[key][n] = [row[column] for column in self.columns]
        for key, rows in result.items():
            if key in refused or not np.isfinite(rows).all():
                rows[:] = np.nan
        return result

    def _chain(self, changes: Changes, case: Changes, step: float | None) -> Chain:
        fine = {} if step is None else _step(self.scenario, step)
        return line_up(self.scenario.with_values({**changes, **case, **fine}))


def _key(about: str, changes: Changes, step: float | None) -> str:
    content = json.dumps([sorted(changes.items()), step])
    return hashlib.sha256(f"{about}{content}".encode()).hexdigest()


def _step(scenario: Scenario, step: float) -> dict[str, float]:
    """Another step [ms], and as many of them between records as come nearest to the interval of the scenario."""
    n = max(1, round(scenario.simulation.record_every_ms / step))
    return {"simulation.step_ms": step, "simulation.record_every_ms": n * step}
