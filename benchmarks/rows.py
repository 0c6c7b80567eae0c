"""What a sweep costs besides its collisions: from the plan to the store, to results.csv, and back into a table.

    python benchmarks/rows.py [--cases N]

An engine that computes nothing yields rows that are ready. Times are processor time for each case, with all responses
and with two.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import trainmj
from trainmj.cases.engine import Local
from trainmj.cases.rows import Rows
from trainmj.cases.runner import fill
from trainmj.cases.store import Store
from trainmj.collision.cases import Cases, gathered
from trainmj.sweep.plan import Sweep
from trainmj.sweep.run import _keeper

AT_ONCE = 128
"""Cases that end together, as many as a thread has side by side."""


class Ready:
    """Yields rows that are ready, with digits as real ones have them; the last ones may be of fewer cases."""

    def __init__(self, sweep: Sweep) -> None:
        """Compute one case of a sweep."""
        (rows,) = Local(sweep.scenario, 1, responses=sweep.responses)(gathered([(0, {})]))
        scatter = np.random.default_rng(1).uniform(0.5, 2.0, (AT_ONCE, rows.numbers.size))
        self._facts = {"status": ["over"] * AT_ONCE, "reason": [""] * AT_ONCE}
        self._rows = Rows(range(AT_ONCE), self._facts, rows.columns, rows.numbers * scatter)

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Rows]:
        """Give each case numbers."""
        for some in cases:
            for first in range(0, len(some), AT_ONCE):
                keys = some.keys[first : first + AT_ONCE]
                facts: dict[str, Sequence[Any]] = {name: of[: len(keys)] for name, of in self._facts.items()}
                yield Rows(keys, facts, self._rows.columns, self._rows.numbers[: len(keys)])


def costs(sweep: Sweep, folder: Path) -> dict[str, float]:
    """Microseconds of processor time a case, by what they are spent on."""
    ready, spent = Ready(sweep), {}
    with Store(folder / "results.sqlite") as store:
        began = time.process_time()
        store.prepare(sweep.case(0))
        for _, cases in sweep.by_scenario(store.there(len(sweep))):
            fill(store, ready, cases, _keeper(sweep), lambda finished: None)
        spent["plan to SQLite"] = time.process_time() - began
        began = time.process_time()
        store.write_csv(folder / "results.csv")
        spent["SQLite to CSV"] = time.process_time() - began
    spent["both"] = sum(spent.values())
    for _ in range(2):  # what takes long once does not count
        began = time.process_time()
        assert len(trainmj.read_table(folder)) == len(sweep)
        spent["read_table"] = time.process_time() - began
    return {name: 1e6 * seconds / len(sweep) for name, seconds in spent.items()}


def main() -> None:
    """Print the costs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=10_000)
    n = parser.parse_args().cases
    for responses in (("*",), ("TS_mm", "TAMA_g")):
        vary = {"empty_stroke_mm": f"20:50:{n // 100}", "mass_t": "30:36:10", "speed_km_h": "20:30:10"}
        sweep = trainmj.grid_of("b_type", vary, responses)
        with tempfile.TemporaryDirectory() as folder:
            found = costs(sweep, Path(folder))
        said = ", ".join(f"{name} {cost:.1f}" for name, cost in found.items())
        print(f"{len(sweep)} cases, responses {','.join(responses)}: {said} us a case")


if __name__ == "__main__":
    main()
