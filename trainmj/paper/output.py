"""The folder of ``trainmj paper``: one CSV for each table, figures, the verdicts, and the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from trainmj.files.atomic import write_bytes
from trainmj.output.style import Format, save
from trainmj.paper.figures import figures
from trainmj.paper.page import page_of
from trainmj.paper.reproduce import Reproduction

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

PAGE = "paper.html"
SUMMARY = "summary.json"


def write_paper(reproduction: Reproduction, folder: Path, formats: Sequence[Format] = ("png",)) -> None:
    """Write tables, figures, verdicts and page into a folder, each file whole or not at all.

    Args:
        reproduction: what was computed.
        folder: that is there.
        formats: of the figures beside the page, which has them anyway.

    Raises:
        OutputError: if a file cannot be written.
    """
    for table in reproduction.tables.values():
        _write_table(table.table(), folder / f"{table.name}.csv")
    _write_table(reproduction.optima, folder / "optima.csv")
    for name, rows in records(reproduction).items():
        _write_table(_frame(rows), folder / f"{name}.csv")
    _write_table(reproduction.recomputed.front_table(), folder / "figure9_front_from_table_9.csv")
    _write_table(reproduction.ours.front_table(), folder / "figure9_front_ours.csv")
    write_bytes(folder / SUMMARY, json.dumps(summary(reproduction), indent=2).encode())
    drawn = {name: _settled(draw()) for name, draw in figures(reproduction).items()}
    for name, picture in drawn.items():
        save(picture, folder / name, formats)
    page_of(reproduction, drawn, f"trainmj paper --out {quote(str(folder))}").write(folder / PAGE)


def _settled(picture: Figure) -> Figure:
    """Lay a figure out once for all its files: that takes as long as drawing it."""
    engine = picture.get_layout_engine()
    if engine is not None:
        engine.execute(picture)
    picture.set_layout_engine("none")
    return picture


def summary(reproduction: Reproduction) -> dict[str, Any]:
    """Verdicts, laws, defects and optima as JSON holds them."""
    return {
        "agrees": reproduction.agrees,
        **records(reproduction),
        "optima": json.loads(reproduction.optima.to_json(orient="records", double_precision=10)),
    }


def records(reproduction: Reproduction) -> dict[str, list[dict[str, Any]]]:
    """Verdicts, laws and defects as plain rows."""
    return {
        "verdicts": [asdict(v) | {"agrees": v.agrees} for v in reproduction.verdicts],
        "laws": [asdict(law) for law in reproduction.laws],
        "defects": [asdict(defect) for defect in reproduction.defects],
    }


def _frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame([{k: " ".join(v) if isinstance(v, tuple) else v for k, v in row.items()} for row in rows])


def _write_table(table: pd.DataFrame, file: Path) -> None:
    write_bytes(file, table.to_csv(index=False, float_format="%.9g").encode())
