"""The paper, end to end: collide, analyse, compare, judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from trainmj.paper.analysis import CRITERIA, Analysis, analyse, from_table_9
from trainmj.paper.collisions import Case, Collisions, collide, simulate
from trainmj.paper.defects_of_study import defects_of_study
from trainmj.paper.defects_of_tables import defects_of_tables
from trainmj.paper.finding import Defect, Law
from trainmj.paper.laws import laws
from trainmj.paper.printed import number
from trainmj.paper.scatter import Scatter, scatter
from trainmj.paper.tables import OURS, RECOMPUTED, S08, Tables, compare_collisions, compare_scenarios, compare_studies
from trainmj.paper.verdicts import Verdict, verdicts


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Everything of the paper that was computed again."""

    collisions: Collisions
    recomputed: Analysis  # the study on the published Table 9
    ours: Analysis  # the study on our responses at the same points
    tables: Tables  # each published table beside its counterparts, by number
    optima: pd.DataFrame  # where the same decision ends on the paper's and on our responses
    verdicts: tuple[Verdict, ...]  # item by item
    laws: tuple[Law, ...]  # those the paper states in words, on our results
    defects: tuple[Defect, ...]  # the paper's own
    threads: int = 0  # that what is computed later may use

    @cached_property
    def scatter(self) -> Scatter:
        """The scatter of the strokes over D, and what either law leaves of it: some 600 collisions more."""
        c = self.collisions
        return scatter(self.tables, {OURS: c.summaries, S08: c.documented}, self.threads)

    @property
    def judged(self) -> list[Verdict]:
        """The verdicts that have a bar."""
        return [v for v in self.verdicts if v.met is not None]

    @property
    def missed(self) -> list[Verdict]:
        """Those whose bar is missed."""
        return [v for v in self.judged if not v.met]


def reproduce(threads: int = 0) -> Reproduction:
    """Compute the paper's collisions and study, and set them beside what it prints.

    Args:
        threads: native threads; 0 for all cores. The numbers do not depend on it.
    """
    collisions = collide(threads)
    tables = compare_collisions({OURS: collisions.summaries, S08: collisions.documented})
    nine, thirteen = tables["9"], tables.pop("13")  # which stands behind those of the study
    studies = {RECOMPUTED: from_table_9(), OURS: analyse(pd.concat([nine.keys, nine.found[OURS]], axis=1))}
    tables = {"2": compare_scenarios(collisions.scenarios)} | tables | compare_studies(thirteen, studies)
    return Reproduction(
        collisions,
        studies[RECOMPUTED],
        studies[OURS],
        tables,
        optima(studies, collisions),
        tuple(verdicts(tables)),
        tuple(laws(collisions, tables, studies[OURS])),
        (*defects_of_tables, *defects_of_study),
        threads,
    )


def optima(studies: Mapping[str, Analysis], collisions: Collisions) -> pd.DataFrame:
    """Where the same decision ends: the paper's optimum, that from its Table 9 and that from our responses."""
    printed = {head: number("13", "surrogate", head) for head in ("D_mm", "M_t", *CRITERIA.values())}
    rows: list[tuple[str, Case, Mapping[str, float]]] = [("published", (printed["D_mm"], printed["M_t"]), printed)]
    rows += [(source, study.chosen, study.predict(*study.chosen)) for source, study in studies.items()]
    summaries = dict(collisions.summaries)
    summaries |= simulate(case for _, case, _ in rows if case not in summaries)
    table = []
    for source, case, predicted in rows:
        row = {"source": source, "D_mm": case[0], "M_t": case[1]}
        for name, head in CRITERIA.items():
            unit = head.removeprefix(name)
            row[f"{name}_surrogate{unit}"] = predicted[head]
            row[f"{name}_simulated{unit}"] = getattr(summaries[case], head)
        row["anti_climber_simulated_mm"] = summaries[case].interfaces[0].stages[1].stroke_mm
        table.append(row)
    return pd.DataFrame(table)
