"""Every collision of a study, computed once: designs, swarms and checks share one file of finished cases.

The file keeps all responses of a case under its scenario and values. A study that was stopped, or changed in a step,
finds there what it has computed before; a swarm with the same seed asks for the same points again.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from trainmj.cases.table import FAILED, case_rows
from trainmj.doe.arrays import FloatArray
from trainmj.errors import OutputError
from trainmj.scenario import Scenario, to_yaml
from trainmj.study.folder import versions
from trainmj.study.plan import Response, Study

if TYPE_CHECKING:
    import pandas as pd

FILE = "simulations.sqlite"
_COMMIT_EVERY = 0.5  # longest time that finished cases wait to be written [s]
_DIGITS = 12  # significant digits of a factor's value: nearer points are the same case


class Simulator:
    """The simulations of a study.

    Args:
        file: SQLite file of finished cases; made if it is not there.
        study: scenario, factors and responses.
        threads: native threads; 0 for all cores.
        progress: called with the number of cases computed so far, as they end.

    Raises:
        OutputError: if the file cannot be opened or is damaged.
    """

    def __init__(self, file: Path, study: Study, threads: int, progress: Callable[[int], None]) -> None:
        """Open or make the file."""
        self.file, self.study, self.computed = file, study, 0
        self._threads, self._progress = threads, progress
        self._last: tuple[Scenario, str] | None = None
        try:
            self._db = sqlite3.connect(file, timeout=10.0)
            self._db.execute("CREATE TABLE IF NOT EXISTS cases (key TEXT PRIMARY KEY, responses TEXT)")
        except sqlite3.Error as error:
            raise OutputError(f"{file}: cannot be used ({error}): remove it, or take another folder") from None

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._db.close()

    def at(self, points: FloatArray, scenario: Scenario | None = None) -> pd.DataFrame:
        """Simulate points (n, d) of the space, each once.

        Args:
            points: natural values.
            scenario: another one than the study's, for a check.

        Returns:
            One row for each point: status, reason and the study's responses by head; nan where a case failed.
        """
        cases = [self._case(point) for point in points]
        rows = self.rows(scenario or self.study.scenario, cases)
        return _table(rows, self.study.responses)

    def rows(self, scenario: Scenario, cases: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """All responses of cases of a scenario, in their order; computed if the file has them not."""
        identity = self._identity(scenario)
        keys = [_hash([identity, case]) for case in cases]
        found = self._read(set(keys))
        missing = {key: case for key, case in zip(keys, cases, strict=True) if key not in found}
        if missing:
            found |= self._compute(scenario, missing)
        return [found[key] for key in keys]

    def _identity(self, scenario: Scenario) -> str:
        """What stands for a scenario in the keys; the text is long to write, so once for each."""
        if self._last is None or self._last[0] is not scenario:
            self._last = (scenario, _hash([to_yaml(scenario), versions()]))
        return self._last[1]

    def _case(self, point: FloatArray) -> dict[str, Any]:
        values = self.study.space.decode(point)
        case: dict[str, Any] = {}
        for value, targets in zip(values.values(), self.study.targets, strict=True):
            plain = float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
            case |= dict.fromkeys(targets, plain)
        return case

    def _read(self, keys: set[str]) -> dict[str, dict[str, Any]]:
        rows = {}
        for key in keys:
            found = self._db.execute("SELECT responses FROM cases WHERE key = ?", (key,)).fetchone()
            if found is not None:
                rows[key] = json.loads(found[0])
        return rows

    def _compute(self, scenario: Scenario, cases: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
        """Compute cases and write them as they end, also when something stops the work."""
        keys = list(cases)
        rows: dict[str, dict[str, Any]] = {}
        waiting: list[tuple[str, str]] = []
        written = time.monotonic()
        try:
            for number, row in case_rows(scenario, enumerate(cases.values()), self._threads):
                rows[keys[number]] = row
                waiting.append((keys[number], json.dumps(row, default=_plain)))
                self.computed += 1
                if time.monotonic() - written > _COMMIT_EVERY:
                    waiting = self._write(waiting)
                    written = time.monotonic()
                    self._progress(self.computed)
        finally:
            self._write(waiting)
        self._progress(self.computed)
        return rows

    def _write(self, rows: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
        try:
            with self._db:
                self._db.executemany("INSERT OR REPLACE INTO cases VALUES (?, ?)", rows)
        except sqlite3.Error as error:
            raise OutputError(f"{self.file}: cannot be written ({error}); finished cases are kept") from None
        return []


def failed(table: pd.DataFrame) -> NDArray[np.bool_]:
    """Rows of a table of simulations that have no use: refused, unstable, or without one of the responses, (n,)."""
    numbers = table.drop(columns=["status", "reason"]).to_numpy(dtype=np.float64)
    return np.asarray(table["status"].isin(FAILED).to_numpy() | ~np.isfinite(numbers).all(axis=1))


def _table(rows: Sequence[dict[str, Any]], responses: Sequence[Response]) -> pd.DataFrame:
    import pandas as pd

    columns: dict[str, Any] = {key: [row[key] for row in rows] for key in ("status", "reason")}
    for response in responses:
        columns[response.head] = np.array([row.get(response.column, np.nan) for row in rows], dtype=np.float64)
    return pd.DataFrame(columns)


def _hash(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, default=str).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """A numpy number as JSON holds it."""
    return value.item()
