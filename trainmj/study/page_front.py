"""The second half of a study's report: fronts, weights and decision."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from trainmj.output.blocks import Column, Section
from trainmj.output.plot import Trace, axes, dots, line
from trainmj.output.style import BLUE, ORANGE, YELLOW
from trainmj.study.finished import Finished, number

_MOST_RANKED = 15
_SEARCHES = {
    "found on the surrogates": ("05_front_surrogate", "front_on_the_surrogates", YELLOW, "square-open"),
    "found on the simulator": ("06_front_simulator", "front_on_the_simulator", BLUE, "circle"),
}
"""Table, key in the summary, colour and sign of each search."""


def add_fronts(section: Section, study: Finished) -> None:
    """The fronts that were searched, the chosen design on them, and how the searches went."""
    there = {said: part for said, part in _SEARCHES.items() if part[0] in study.tables}
    section.notes(
        f"{said.capitalize()}: {found['points']} designs of {found['evaluations']} evaluations; {found['status']}."
        for said, found in ((said, study.facts[key]) for said, (_, key, _, _) in there.items())
    )
    for a, b in list(combinations(study.facts["objectives"], 2))[:6]:
        traces = [
            _front(study, table, said, a, b, colour, symbol) for said, (table, _, colour, symbol) in there.items()
        ]
        traces.append(_chosen(study, a, b))
        section.plot(
            traces,
            axes(a, study.unit(a), b, study.unit(b)),
            title=f"Front: {a} and {b}",
            note="The read-out names each design.",
            height=460,
        )
    if "fronts_compared" in study.facts:
        c = study.facts["fronts_compared"]
        section.text(
            f"Hypervolume of the surrogates' front over that of the simulator's: {number(c['ratio_predicted'])} as "
            f"predicted, {number(c['ratio_simulated'])} when simulated; {c['kept']} of {c['points']} designs of the "
            "surrogates' front keep the limits then."
        )
    for said, (table, _, colour, _) in there.items():
        progress = study.tables.get(f"{table}_progress")
        if progress is not None and len(progress) > 1:
            section.plot(
                [line("hypervolume", progress["evaluations"], progress["hypervolume"], "", colour)],
                axes("Evaluations", "", "Hypervolume", ""),
                title=f"Search of the front {said}",
                height=300,
                half=True,
            )


def _front(study: Finished, table: str, said: str, a: str, b: str, colour: str, symbol: str) -> Trace:
    found = study.tables[table]
    texts = [_design(study, row) for _, row in found.iterrows()]
    return dots(said, found[study.column(a)], found[study.column(b)], colour, symbol, 7, texts)


def _chosen(study: Finished, a: str, b: str) -> Trace:
    chosen = study.facts["decision"]["chosen"]
    return dots(
        f"chosen ({study.facts['decision']['method']})",
        [chosen[study.column(a)]],
        [chosen[study.column(b)]],
        ORANGE,
        "star",
        16,
        [_design(study, chosen)],
    )


def _design(study: Finished, row: Any) -> str:
    names = [*study.factors, *study.responses]
    return ", ".join(f"{n} {number(row[study.column(n)])} {study.unit(n)}".rstrip() for n in names)


def add_decision(section: Section, study: Finished) -> None:
    """Weights, the chosen design, what other methods would choose, and the best of the rest."""
    d, w = study.facts["decision"], study.facts["weights"]
    section.table(
        [Column("Objective", text=True), Column("goal", text=True), Column("weight", "", 4)],
        [(name, study.facts["objectives"][name], weight) for name, weight in w["weights"].items()],
        title="Weights",
        note=f"From: {w['description']}.",
        half=True,
    )
    section.table(
        [Column("Design", text=True), *(Column(n, u) for n, u in study.factors.items())],
        [
            (f"chosen: {d['method']}", *(number(d["chosen"][study.column(n)]) for n in study.factors)),
            *(
                (name, *(number(values[study.column(n)]) for n in study.factors))
                for name, values in d["others"].items()
            ),
        ],
        title="Chosen, and what other methods would choose",
        half=True,
    )
    if "stays" in d:
        section.notes(
            [
                *(
                    f"The choice stays for weights of {name} from {low:.4f} to {high:.4f}."
                    for name, (low, high) in d["stays"].items()
                ),
                f"It stays for {100 * d['share']:.0f} % of weights scattered by {100 * d['spread']:g} %.",
            ]
        )
    ranked = study.tables.get("09_ranking")
    if ranked is not None:
        names = [*study.factors, *study.responses]
        section.table(
            [Column("Rank"), *(Column(n, study.unit(n)) for n in names), Column("score")],
            [
                (int(row["rank"]), *(number(row[study.column(n)]) for n in names), float(row["score"]))
                for _, row in ranked.head(_MOST_RANKED).iterrows()
            ],
            title=f"The best {min(_MOST_RANKED, len(ranked))} of {len(ranked)} designs",
        )
