"""The second half of a study's report: fronts, weights and decision."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING, Any

from trainmj.output.blocks import Section
from trainmj.output.plot import axes, dots, line
from trainmj.output.style import BLUE, ORANGE, YELLOW
from trainmj.output.table import Column, Table
from trainmj.study import tables
from trainmj.study.fronts import FILES
from trainmj.study.tables import Summary

if TYPE_CHECKING:
    from trainmj.study.folder import Tables

_MOST_PAIRS = 6  # of objectives over which the front is drawn
_MOST_RANKED = 15
_LOOKS = {"surrogate": (YELLOW, "square-open"), "simulator": (BLUE, "circle")}
"""Colour and sign of each search."""


def add_fronts(section: Section, summary: Summary, files: Tables) -> None:
    """The fronts that were searched, the chosen design on them, and how the searches went."""
    there = {where: FILES[where] for where in _LOOKS if FILES[where] in files}
    section.notes(tables.notes_on_fronts(summary))
    section.table(tables.fronts(summary))
    found = summary["decision"]
    for (x, a), (y, b) in list(combinations(tables.columns(summary, summary["objectives"]).items(), 2))[:_MOST_PAIRS]:
        traces = []
        for where, file in there.items():
            records = files[file].to_dict("records")
            texts = [_read_out(summary, row) for row in records]
            xy = ([row[x] for row in records], [row[y] for row in records])
            traces.append(dots(f"found on the {where}", *xy, *_LOOKS[where], 7, texts))
        chosen, said = found["chosen"], f"chosen ({found['method']})"
        traces.append(dots(said, [chosen[x]], [chosen[y]], ORANGE, "star", 16, [_read_out(summary, chosen)]))
        section.plot(
            traces,
            axes(a.name, a.unit, b.name, b.unit),
            title=f"Front: {a.name} and {b.name}",
            note="The read-out names each design.",
            height=460,
        )
    for where, file in there.items():
        progress = files.get(f"{file}_progress")
        if progress is not None and len(progress) > 1:
            section.plot(
                [line("hypervolume", progress["evaluations"], progress["hypervolume"], "", _LOOKS[where][0])],
                axes("Evaluations", "", "Hypervolume", ""),
                title=f"Search on the {where}",
                height=300,
                half=True,
            )


def _read_out(summary: Summary, row: Mapping[Any, Any]) -> str:
    named = tables.columns(summary, [*summary["factors"], *summary["responses"]])
    return ", ".join(f"{c.name} {tables.number(row[head])} {c.unit}".rstrip() for head, c in named.items())


def add_decision(section: Section, summary: Summary, files: Tables) -> None:
    """Weights, the chosen design, what other methods would choose, and the best of the rest."""
    section.table(tables.weights(summary), half=True)
    section.table(tables.decision(summary), half=True)
    section.notes(tables.notes_on_decision(summary))
    ranked = files["09_ranking"]
    named = tables.columns(summary, [*summary["factors"], *summary["responses"]])
    section.table(
        Table(
            [Column("Rank"), *named.values(), Column("score")],
            [
                (row["rank"], *(row[head] for head in named), float(row["score"]))
                for row in ranked.head(_MOST_RANKED).to_dict("records")
            ],
            f"The best {min(_MOST_RANKED, len(ranked))} of {len(ranked)} designs",
        )
    )
