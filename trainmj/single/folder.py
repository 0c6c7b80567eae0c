"""The folder of one run: result, tables and figures."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.collision.chain import Chain, order_of_vehicles
from trainmj.collision.result import Result
from trainmj.collision.saved import FILE
from trainmj.collision.summary import Summary
from trainmj.files.commas import Columns, as_csv, columns_of
from trainmj.files.folder import staged
from trainmj.files.sealed import sealed
from trainmj.output.style import ENDINGS, Format, Width, save
from trainmj.scenario import to_yaml
from trainmj.single import figures
from trainmj.single.beside import SUMMARY, Beside

if TYPE_CHECKING:
    import pandas as pd

OWN = (
    r"scenario\.yaml|result\.nc|(histories|interfaces|vehicles|wheelsets|bodies|bracket|margins)\.csv"
    rf"|(collision|plane|bodies|occupants)\.{ENDINGS}"
    r"|summary\.json|report\.html"
)
"""The files of the folder, as a pattern of their names."""


NUMBER = "%.9g"
"""Format of numbers in CSV files."""


def tables_of(result: Result, summary: Summary, both_sides: bool = False) -> dict[str, pd.DataFrame]:
    """The tables of a run by name: histories over time, interfaces, vehicles and, where there are any, their parts.

    Args:
        result: of the collision.
        summary: of the result.
        both_sides: as of :meth:`trainmj.collision.result.Result.table`.
    """
    import pandas as pd

    tables = {name: pd.DataFrame(rows) for name, rows in _rows(result, summary).items()}
    return {"histories": result.table(both_sides), **tables}


def _rows(result: Result, summary: Summary) -> dict[str, list[dict[str, Any]]]:
    """The rows of all tables that are not over time."""
    rows = {
        "interfaces": [i.as_row() for i in summary.interfaces],
        "vehicles": [v.as_row() for v in summary.vehicles],
        "wheelsets": [{"vehicle": v.name, **w.as_row()} for v in summary.vehicles for w in v.wheelsets],
        "bodies": list(_bodies(result.chain, summary)),
    }
    valid = {"valid_until_s": summary.valid_until_s}
    return {name: [row | valid for row in of_name] for name, of_name in rows.items() if of_name}


def write_run(
    result: Result,
    summary: Summary,
    folder: Path,
    formats: Sequence[Format] = ("png",),
    width: Width = "page",
    beside: Beside | None = None,
) -> None:
    """Write scenario.yaml, result.nc, the tables as CSV, summary.json and the figures into a folder.

    All files are finished before those of an earlier run, its report and figures among them, give way to them. If
    summary.json is there, all the others belong to it.

    Raises:
        OutputError: if a file cannot be written.
    """
    with staged(folder, OWN, SUMMARY) as stage:
        result.save(stage / FILE)
        (stage / "scenario.yaml").write_text(to_yaml(result.scenario), encoding="utf-8")
        more = {} if beside is None else beside.rows()
        tables: dict[str, Columns] = {"histories": result.columns()}
        tables |= {name: columns_of(rows) for name, rows in (_rows(result, summary) | more).items() if rows}
        for name, columns in tables.items():
            (stage / f"{name}.csv").write_text(as_csv(columns, NUMBER), encoding="utf-8", newline="")
        for name, draw in figures.drawings(result, width, summary).items() if formats else ():
            save(draw(), stage / name, formats)
        (stage / SUMMARY).write_text(json.dumps(sealed(summary.as_dict() | more), indent=2), encoding="utf-8")


def _bodies(chain: Chain, summary: Summary) -> Iterator[dict[str, Any]]:
    """A row for each member and each point of a body that gives, with its place from the end that faces the impact."""
    for i, v in zip(order_of_vehicles(chain), summary.vehicles, strict=True):
        if not v.members:
            continue
        parts = []
        for k, member in zip(chain.members_inward(i), v.members, strict=True):
            left = chain.points[chain.members[k].left].place
            span = chain.members[k].span
            parts.append(("member" if span else "link", span or (left, left), member))
        for k, point in zip(chain.points_inward(i), v.points, strict=True):
            place = chain.points[k].place
            parts.append(("point" if k <= chain.edge(i, 1) else "bogie", (place, place), point))
        length = chain.vehicles[i].length
        for kind, (start, end), part in parts:
            inward = (length - end, length - start) if chain.facing(i) else (start, end)
            yield {"vehicle": v.name, "part": kind, "from_m": inward[0], "to_m": inward[1], **part.as_row()}
