"""Every collision of a study, computed once: designs, swarms and checks share one store of finished cases.

The store keeps all responses of a case under its scenario and values. A study that was stopped, or changed in a step,
finds there what it has computed before; a swarm with the same seed asks for the same points again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from trainmj.cases.engine import Case, Computed, Local, Row
from trainmj.cases.origin import Origin, stated
from trainmj.cases.runner import rows_of
from trainmj.cases.store import MOST_COLUMNS, Store, key_of
from trainmj.cases.table import STATUS
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of
from trainmj.doe.arrays import FloatArray
from trainmj.scenario import Scenario, to_yaml
from trainmj.study.designs import Designs
from trainmj.study.plan import Study

FILE = "simulations.sqlite"
_CHANGES = "changes"
_DIGITS = 12  # significant digits of a factor's value: nearer points are the same case


class Simulator:
    """The simulations of a study.

    Args:
        store: of finished cases.
        study: scenario, factors and responses.
        threads: native threads; 0 for all cores.
        progress: called with the number of cases computed so far, as they end.

    Attributes:
        computed: how many cases have been computed.
        changes: what differs from the last run with this store that came to its end, in words.
    """

    def __init__(self, store: Store, study: Study, threads: int, progress: Callable[[int], None]) -> None:
        """Remove from the store what other versions or another machine computed."""
        self.study, self.computed = study, 0
        self._store, self._threads, self._progress = store, threads, progress
        self._scenario = key_of(to_yaml(study.scenario))
        self._columns = columns_of(line_up(study.scenario))
        wide = len(self._columns) > MOST_COLUMNS - len(STATUS)
        self._only = tuple(response.column for response in study.responses) if wide else ()
        self.changes = _renewed(
            store, Origin("study", study.scenario, {"study": study.source.values, "points": study.given})
        )

    def at(self, points: FloatArray, scenario: Scenario | None = None) -> Designs:
        """Simulate points (n, d) of the space, each once.

        Args:
            points: natural values.
            scenario: another one than the study's, for a check.
        """
        rows = self._rows([self._case(point) for point in points], scenario)
        values = [[row.get(r.column, np.nan) for r in self.study.responses] for row in rows]
        status, reason = ([row[name] for row in rows] for name in STATUS)
        return Designs(self.study, points, np.array(values, dtype=np.float64), status, reason)

    def as_it_stands(self) -> Row:
        """Status, reason and every response of the study's scenario, unchanged."""
        if self._only:  # more responses than the store keeps
            (computed,) = Local(self.study.scenario, self._threads)([("", {})])
            return computed.row
        (row,) = self._rows([{}])
        return {name: row.get(name, np.nan) for name in (*STATUS, *self._columns)}

    def finish(self) -> None:
        """Record that the results of the study include all changes so far."""
        self._store.describe({_CHANGES: "[]"})

    def _rows(self, cases: Sequence[Case], scenario: Scenario | None = None) -> list[Row]:
        """The rows of cases, in their order."""
        text = key_of(to_yaml(scenario)) if scenario else self._scenario  # takes long to write
        keys = [key_of(text, case, *self._only) for case in cases]
        before = self.computed

        def progress(finished: int) -> None:
            self.computed = before + finished
            self._progress(self.computed)

        engine = Local(scenario or self.study.scenario, self._threads)
        rows = rows_of(self._store, engine, dict(zip(keys, cases, strict=True)), self._keep, progress)
        return [rows[key] for key in keys]

    def _keep(self, computed: Computed) -> Row:
        """All responses of a case, or only those of the study where the store cannot hold all."""
        if not self._only:
            return computed.row
        return {name: computed.row[name] for name in (*STATUS, *self._only) if name in computed.row}

    def _case(self, point: FloatArray) -> dict[str, Any]:
        values = self.study.space.decode(point)
        case: dict[str, Any] = {}
        for value, targets in zip(values.values(), self.study.targets, strict=True):
            plain = float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
            case |= dict.fromkeys(targets, plain)
        return case


def _renewed(store: Store, origin: Origin) -> list[str]:
    """Make a store that of an origin, without the cases of another identity; return what has changed, in words."""
    about = store.about()
    changes: list[str] = []
    if about:
        said = stated(about, _CHANGES)
        changes += said if isinstance(said, list) else []
        others = "; ".join(origin.new_identity(about))
        if others:
            store.clear()
            changes.append(f"{others}: every collision is computed again")
        changes += origin.new_input(about)
    store.describe(origin.about() | {_CHANGES: json.dumps(changes)})
    return changes
