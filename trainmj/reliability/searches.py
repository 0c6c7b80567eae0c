"""Collisions at points that a method asks for: searches for small probabilities, and samples for Sobol' indices.

Every collision is kept under its load case and its point, so a method that is run again, with the same seed, finds what
was computed before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from trainmj.cases.engine import Engine
from trainmj.cases.rows import Row, Rows
from trainmj.cases.runner import numbers_of, rows_of
from trainmj.cases.store import Store, key_of
from trainmj.collision.limits import Criterion
from trainmj.collision.status import PAST_LIMITS
from trainmj.doe.arrays import FloatArray
from trainmj.doe.probability import Rare, importance_sampling, subset_simulation
from trainmj.errors import InputError, close_match
from trainmj.reliability.file import ANY
from trainmj.reliability.found import FEW, Passed, Searched
from trainmj.reliability.plan import Reliability
from trainmj.units import ROUND_OFF


class Searches:
    """The collisions of a plan at any points.

    Args:
        plan: load cases, and what scatters in them.
        store: of finished collisions.
        engine: computes them.
        designed: the limits of each load case.
        progress: called with the number of collisions computed so far.

    Attributes:
        computed: how many have been computed.
    """

    def __init__(
        self,
        plan: Reliability,
        store: Store,
        engine: Engine,
        designed: Mapping[str, Sequence[Criterion]],
        progress: Callable[[int], None],
    ) -> None:
        """Compute nothing yet."""
        self.plan, self.computed = plan, 0
        self._store, self._engine, self._designed, self._progress = store, engine, designed, progress

    def rows(self, case: str, z: FloatArray) -> list[Row]:
        """Status, responses and how much of each limit is used, of a load case at standard normal points (n, d)."""
        keys = [key_of(case, point) for point in z.tolist()]
        before = self.computed

        def keep(rows: Rows) -> Rows:
            used = {limited.name: limited.used for limited in rows.limits}
            left = [k for k, name in enumerate(rows.columns) if name not in used]
            columns = {name: column for name, column in rows.columns.items() if name not in used}
            return replace(rows, facts={**rows.facts, **used}, columns=columns, numbers=rows.numbers[:, left])

        def progress(finished: int) -> None:
            self.computed = before + finished
            self._progress(self.computed)

        cases = replace(self.plan.scatter.cases(case, z), keys=keys)
        engine = self._engine.of(self.plan.scenarios[case], tuple(self.plan.responses(case, self.plan.patterns)))
        found = rows_of(self._store, engine, [cases], keep, progress)
        return [found[key] for key in keys]

    def numbers(self, case: str, name: str, z: FloatArray) -> FloatArray:
        """A response, or how much of a limit is used [%], (n,); nan where there is no usable number."""
        return numbers_of(self.rows(case, z), name)

    def beyond(self, case: str, limit: str, z: FloatArray) -> FloatArray:
        """By how much a limit is passed (n,) [% of it]; at or below 0 where it is kept."""
        return _beyond(self.rows(case, z), limit)

    def beyond_any(self, z: FloatArray) -> FloatArray:
        """The same of whichever limit is passed by most in any load case, or a car body that gives way."""
        most = np.full(len(z), -np.inf)
        for case in self.plan.cases:
            rows = self.rows(case, z)
            for criterion in self._designed[case]:
                most = np.maximum(most, _beyond(rows, criterion.name))  # nan stays
            gave_way = [row["status"] in PAST_LIMITS for row in rows]
            most = np.where(gave_way, np.maximum(most, ROUND_OFF), most)
        return most

    def search(self, passed: Sequence[Passed]) -> list[Searched]:
        """The small probabilities that the plan asks for."""
        return [self._searched(*target) for target in self._targets(passed)]

    def _targets(self, passed: Sequence[Passed]) -> list[tuple[str, str, str]]:
        """Load case, name and title of each."""
        rare = self.plan.spec.rare
        if rare is None:
            return []
        if rare.limits == ANY:
            return [("", ANY, passed[-1].title)]
        limits = [one for one in passed if one.name != ANY]
        if rare.limits != "auto":
            return [(one.case, one.name, one.title) for one in limits if one.name in rare.limits]
        return [(one.case, one.name, one.title) for one in limits if one.passes < FEW]

    def _searched(self, case: str, name: str, title: str) -> Searched:
        rare, spec = self.plan.spec.rare, self.plan.spec
        assert rare is not None  # there are no targets otherwise

        def state(z: FloatArray) -> FloatArray:
            return self.beyond_any(z) if name == ANY else self.beyond(case, name, z)

        d, sampling = self.plan.scatter.d, rare.method == "importance_sampling"
        found: Rare = subset_simulation(
            state,
            d,
            seed=spec.seed,
            n=min(rare.runs, 1000) if sampling else rare.runs,
            most=rare.levels,
            level=spec.level,
        )
        if sampling:
            found = importance_sampling(state, d, seed=spec.seed, n=rare.runs, start=found, level=spec.level)
        return Searched(case, name, title, found)


def _beyond(rows: Sequence[Row], limit: str) -> FloatArray:
    """By how much rows (n,) pass a limit [% of it]."""
    return numbers_of(rows, limit) - 100.0 * (1.0 + ROUND_OFF)


def check_limits(plan: Reliability, designed: Mapping[str, Sequence[Criterion]]) -> None:
    """Refuse a search for a limit that no load case has.

    Raises:
        InputError: naming the limit.
    """
    known = list(dict.fromkeys(criterion.name for criteria in designed.values() for criterion in criteria))
    asked = plan.spec.rare.limits if plan.spec.rare else "auto"
    for name in asked if isinstance(asked, list) else ():
        if name not in known:
            raise InputError(f"rare.limits: there is no limit {name!r}{close_match(name, known)}")
    if plan.spec.rare and not known:
        raise InputError("rare: no load case has a limit: state limits in the scenario")
