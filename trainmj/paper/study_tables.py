"""Tables 10 to 13 and Eqs (7), (8): published, from the published Table 9, and from our ten responses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from trainmj.paper.analysis import CRITERIA, Analysis
from trainmj.paper.collisions import Collisions, cases_of
from trainmj.paper.comparison import OURS, RECOMPUTED, Comparison
from trainmj.paper.printed import number, published
from trainmj.paper.responses import our_responses

if TYPE_CHECKING:
    import pandas as pd


def table_10(recomputed: Analysis, ours: Analysis) -> Comparison:
    """Correlation of D and M with the responses."""
    title = "Table 10. Correlation coefficients"
    found = {source: a.correlations() for source, a in _both(recomputed, ours)}
    return _compare("table10_correlation", title, "parameter", found)


def equations_7_and_8(recomputed: Analysis, ours: Analysis) -> Comparison:
    """Coefficients of the surrogates."""
    title = "Eqs (7) and (8). Coefficients of the cubic surrogates, D in mm and M in t"
    found = {source: a.coefficients().reset_index(drop=True) for source, a in _both(recomputed, ours)}
    note = "A published 0 is a term that Eq. (8) does not have as printed. See the defects."
    compared = _compare("eq7_eq8_coefficients_as_printed", title, "term", found, note)
    return replace(compared, name="eq7_eq8_coefficients")


def table_11(recomputed: Analysis, ours: Analysis) -> Comparison:
    """Accuracy of the surrogates."""
    title = "Table 11. Accuracy of the surrogates: each point left out in turn, errors over the range"
    found = {source: a.accuracies() for source, a in _both(recomputed, ours)}
    return _compare("table11_surrogate_accuracy", title, "criterion", found)


def table_12(recomputed: Analysis, ours: Analysis) -> Comparison:
    """Entropy weights."""
    title = "Table 12. Entropy weights of the criteria"
    found = {source: a.weights() for source, a in _both(recomputed, ours)}
    return _compare("table12_entropy_weights", title, "criterion", found)


def _compare(name: str, title: str, key: str, found: Mapping[str, pd.DataFrame], note: str = "") -> Comparison:
    """A published table, its rows named by one column, beside what was found."""
    table = published(name)
    return Comparison(name, title, table[[key]], table.drop(columns=key), found, note)


def table_13(recomputed: Analysis, ours: Analysis, collisions: Collisions) -> Comparison:
    """The paper's optimum, on the surrogates and by collision dynamics."""
    import pandas as pd

    table = published("table13_optimum")
    criteria = list(CRITERIA.values())
    simulated = our_responses(collisions, cases_of(table), criteria)
    found: dict[str, pd.DataFrame] = {}
    for source, a in _both(recomputed, ours):
        rows = [
            a.predict(d, m) if method == "surrogate" else simulated.iloc[k].to_dict()
            for k, (method, d, m) in enumerate(zip(table["method"], table["D_mm"], table["M_t"], strict=True))
        ]
        found[source] = pd.DataFrame(rows)[criteria]
    return Comparison(
        "table13_optimum",
        "Table 13. The paper's optimum, on the surrogates and by collision dynamics",
        table[["method", "D_mm", "M_t"]],
        table[criteria],
        found,
        "The row of the collision dynamics is our simulation under both heads: it was never used to identify the "
        "devices.",
    )


def optima(recomputed: Analysis, ours: Analysis, collisions: Collisions) -> pd.DataFrame:
    """Where the same decision ends: the paper's optimum, that from its Table 9 and that from our responses."""
    import pandas as pd

    from trainmj.paper.collisions import simulate

    at = {head: number("table13_optimum", "surrogate", head) for head in ("D_mm", "M_t", *CRITERIA.values())}
    rows = [("published", at["D_mm"], at["M_t"], at)]
    rows += [(source, *a.chosen, a.predict(*a.chosen)) for source, a in _both(recomputed, ours)]
    summaries = simulate([(d, m) for _, d, m, _ in rows]) | dict(collisions.summaries)
    table = []
    for source, d, m, predicted in rows:
        summary = summaries[d, m]
        table.append(
            {
                "source": source,
                "D_mm": d,
                "M_t": m,
                "TS_surrogate_mm": predicted["TS_mm"],
                "TS_simulated_mm": summary.TS_mm,
                "TAMA_surrogate_g": predicted["TAMA_g"],
                "TAMA_simulated_g": summary.TAMA_g,
                "anti_climber_simulated_mm": summary.interfaces[0].stages[1].stroke_mm,
            }
        )
    return pd.DataFrame(table)


def _both(recomputed: Analysis, ours: Analysis) -> tuple[tuple[str, Analysis], tuple[str, Analysis]]:
    return (RECOMPUTED, recomputed), (OURS, ours)
