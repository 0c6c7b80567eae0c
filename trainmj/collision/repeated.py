"""Whether two results are the same, bit for bit, and if not, by how much.

::

    before = load_result("results/result.nc")
    found = repeated(before, run(before.scenario))
    found.same          # every number as it was
    found.differences   # if not: by how much, for each quantity
    found.changes       # versions, platform and code that differ
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trainmj.collision.identity import changes
from trainmj.collision.result import Result
from trainmj.collision.saved import result_given


@dataclass(frozen=True)
class Repeated:
    """A result held against an earlier one.

    Attributes:
        differences: largest difference of each quantity that is not the same to the last bit, as part of its largest
            value; infinite where the number of records is another, or a value is not finite.
        changes: what computed them and differs, in words.
    """

    differences: Mapping[str, float]
    changes: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Whether every number is the same, bit for bit."""
        return not self.differences

    def as_dict(self) -> dict[str, object]:
        """Plain values, as ``trainmj run RESULT --json`` prints them."""
        shares = {name: value if np.isfinite(value) else None for name, value in self.differences.items()}
        return {"same": self.same, "differences": shares, "changes": list(self.changes)}

    def __str__(self) -> str:
        """Give the lines that are printed."""
        line = "The same as the saved result, bit for bit."
        if not self.same:
            worst = sorted(self.differences.items(), key=lambda item: -item[1])[:3]
            parts = ", ".join(f"{name} by {value:.1e} of its largest value" for name, value in worst)
            line = f"Differs from the saved result: {parts}."
        others = f"Since then: {'; '.join(self.changes)}." if self.changes else "Versions and code are the same."
        return f"{line}\n{others}"


def repeated(before: Result | str | Path, after: Result | str | Path) -> Repeated:
    """Hold a result against an earlier one, number by number."""
    before, after = result_given(before), result_given(after)
    found = {}
    for name, old in before.numbers().items():
        new = after.numbers()[name]
        if old.shape != new.shape:
            found[name] = float("inf")
        elif old.tobytes() != new.tobytes():
            with np.errstate(all="ignore"):
                share = float(np.abs(new - old).max(initial=0.0) / (np.abs(old).max(initial=0.0) or 1.0))
            found[name] = share if np.isfinite(share) else float("inf")
    return Repeated(found, tuple(changes(before.versions, after.versions)))
