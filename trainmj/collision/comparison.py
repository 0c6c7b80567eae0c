"""Do a saved collision again, and say whether it comes out the same, bit for bit.

::

    again = repeat(load_result("results/result.nc"))
    again.same          # every number as it was
    again.differences   # if not: by how much, for each quantity
    again.changed       # versions and platform that are others now
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from trainmj.collision.result import Result
from trainmj.collision.simulation import run, versions


@dataclass(frozen=True)
class Repeat:
    """A saved collision, computed again.

    Attributes:
        result: as it is now.
        differences: largest difference of each quantity that is not the same to the last bit, as part of its largest
            value; infinite where there is another number of records.
        changed: versions and platform that are others now: then, now.
    """

    result: Result
    differences: Mapping[str, float]
    changed: Mapping[str, tuple[str, str]]

    @property
    def same(self) -> bool:
        """Whether every number is the same, bit for bit."""
        return not self.differences

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return {
            "same": self.same,
            "differences": {name: value if np.isfinite(value) else None for name, value in self.differences.items()},
            "changed": {name: {"then": then, "now": now} for name, (then, now) in self.changed.items()},
        }

    def said(self) -> list[str]:
        """What to tell a person."""
        lines = ["The same as the saved result, bit for bit."]
        if not self.same:
            worst = sorted(self.differences.items(), key=lambda item: -item[1])[:3]
            parts = ", ".join(f"{name} by {value:.1e} of its largest value" for name, value in worst)
            lines = [f"Differs from the saved result: {parts}."]
        others = [f"{name} {then} then, {now} now" for name, (then, now) in self.changed.items()]
        lines.append(f"Other versions: {'; '.join(others)}." if others else "Versions and platform are the same.")
        return lines


def repeat(before: Result) -> Repeat:
    """Compute the scenario of a result again and compare."""
    after, now = run(before.scenario), versions()
    changed = {
        name: (before.versions.get(name, "unknown"), now[name])
        for name in now
        if before.versions.get(name, "unknown") != now[name]
    }
    return Repeat(after, _differences(before, after), changed)


def _differences(before: Result, after: Result) -> dict[str, float]:
    found = {}
    for name, old in before.numbers().items():
        new = after.numbers()[name]
        if old.shape != new.shape:
            found[name] = float("inf")
        elif old.tobytes() != new.tobytes():
            largest = float(np.abs(old).max(initial=0.0))
            found[name] = float(np.abs(new - old).max(initial=0.0)) / (largest or 1.0)
    return found
