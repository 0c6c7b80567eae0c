"""One published table beside what was found: by us on the simulator, or from the paper's own numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.device import Array
from trainmj.paper.printed import split_unit

if TYPE_CHECKING:
    import pandas as pd

OURS = "ours"
RECOMPUTED = "from_table_9"


@dataclass(frozen=True, eq=False)
class Comparison:
    """A published table and its counterparts.

    Attributes:
        name: of the file, without ending.
        title: number and subject of the published table.
        keys: what the rows are, (n, k).
        published: the printed numbers, (n, q); heads with units.
        found: the same heads, by where they come from: ``ours`` or ``from_table_9``.
        note: what a reader must know to judge it; empty if nothing.
    """

    name: str
    title: str
    keys: pd.DataFrame = field(repr=False)
    published: pd.DataFrame = field(repr=False)
    found: Mapping[str, pd.DataFrame] = field(repr=False)
    note: str = ""

    @property
    def heads(self) -> list[str]:
        """Heads of the compared quantities."""
        return [str(head) for head in self.published.columns]

    def deviation(self, head: str, source: str = OURS) -> Array:
        """Found less published, (n,), in the unit of the head."""
        return self._values(self.found[source], head) - self._values(self.published, head)

    def relative(self, head: str, source: str = OURS) -> Array:
        """Deviation over the published value, (n,)."""
        return np.asarray(self.deviation(head, source) / self._values(self.published, head))

    def rms(self, head: str) -> float:
        """Root mean square of our deviation."""
        return float(np.sqrt(np.mean(self.deviation(head) ** 2)))

    def bias(self, head: str) -> float:
        """Mean of our deviation."""
        return float(np.mean(self.deviation(head)))

    def table(self) -> pd.DataFrame:
        """Everything side by side: keys, then published, found and deviation of each quantity, units in the heads."""
        columns = {str(k): self.keys[k].to_numpy() for k in self.keys.columns}
        for head in self.heads:
            columns[_head(head, "published")] = self.published[head].to_numpy()
            for source, values in self.found.items():
                columns[_head(head, source)] = values[head].to_numpy()
                deviation = "deviation" if len(self.found) == 1 else f"deviation_{source}"
                columns[_head(head, deviation)] = self.deviation(head, source)
        import pandas as pd

        return pd.DataFrame(columns)

    @staticmethod
    def _values(table: pd.DataFrame, head: str) -> Array:
        return table[head].to_numpy(dtype=np.float64)


def _head(head: str, what: str) -> str:
    quantity, unit = split_unit(head)
    return f"{quantity}_{what}_{unit}" if unit else f"{quantity}_{what}"
