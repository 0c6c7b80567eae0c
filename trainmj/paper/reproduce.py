"""The paper, end to end: collide, analyse, compare, judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from trainmj.paper import responses, study_tables
from trainmj.paper.analysis import Analysis, analyse
from trainmj.paper.collisions import Collisions, collide
from trainmj.paper.comparison import OURS, Comparison
from trainmj.paper.defects_of_study import defects_of_study, from_table_9
from trainmj.paper.defects_of_tables import defects_of_tables
from trainmj.paper.finding import Defect, Law
from trainmj.paper.laws import laws
from trainmj.paper.verdicts import Verdict, verdicts

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Everything of the paper that was computed again.

    Attributes:
        collisions: ours.
        recomputed: the study on the published Table 9.
        ours: the study on our responses at the same points.
        tables: each published table beside its counterparts, by number.
        optima: the same decision on the paper's and on our responses.
        verdicts: item by item.
        laws: those the paper states in words, on our results.
        defects: the paper's own.
    """

    collisions: Collisions
    recomputed: Analysis
    ours: Analysis
    tables: Mapping[str, Comparison]
    optima: pd.DataFrame
    verdicts: tuple[Verdict, ...]
    laws: tuple[Law, ...]
    defects: tuple[Defect, ...]

    @property
    def agrees(self) -> bool:
        """Whether every verdict with a bar is within it."""
        return all(v.agrees is not False for v in self.verdicts)


def reproduce(threads: int = 0) -> Reproduction:
    """Compute the paper's collisions and study, and set them beside what it prints.

    Args:
        threads: native threads; 0 for all cores. The numbers do not depend on it.
    """
    collisions = collide(threads)
    recomputed = from_table_9()
    ours = analyse(our_table_9(collisions))
    tables = compare(collisions, recomputed, ours)
    return Reproduction(
        collisions,
        recomputed,
        ours,
        tables,
        study_tables.optima(recomputed, ours, collisions),
        tuple(verdicts(tables)),
        tuple(laws(collisions, tables, ours)),
        (*defects_of_tables(), *defects_of_study()),
    )


def our_table_9(collisions: Collisions) -> pd.DataFrame:
    """Our responses at the ten points, in the form of Table 9."""
    import pandas as pd

    table = responses.table_9(collisions)
    return pd.concat([table.keys, table.found[OURS]], axis=1)


def compare(collisions: Collisions, recomputed: Analysis, ours: Analysis) -> dict[str, Comparison]:
    """All tables, by number."""
    return {
        "2": responses.table_2(collisions),
        "3": responses.table_3(collisions),
        "4": responses.table_4(collisions),
        "5": responses.table_5(collisions),
        "6": responses.table_6(collisions),
        "7": responses.table_7(collisions),
        "8": responses.table_8(collisions),
        "9": responses.table_9(collisions),
        "balance": responses.balance_times(collisions),
        "10": study_tables.table_10(recomputed, ours),
        "Eqs": study_tables.equations_7_and_8(recomputed, ours),
        "11": study_tables.table_11(recomputed, ours),
        "12": study_tables.table_12(recomputed, ours),
        "13": study_tables.table_13(recomputed, ours, collisions),
    }
