"""The folder of ``trainmj paper``: one CSV for each table, figures, the verdicts, and the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import Any

import pandas as pd

from trainmj.files.written import write_bytes
from trainmj.output.style import Format, save
from trainmj.paper.figures import figures
from trainmj.paper.page import page_of
from trainmj.paper.reproduce import Reproduction

PAGE = "paper.html"
SUMMARY = "summary.json"


def write_paper(reproduction: Reproduction, folder: Path, formats: Sequence[Format] = ("png",)) -> None:
    """Write tables, figures, verdicts and page into a folder, each file whole or not at all.

    Args:
        reproduction: what was computed.
        folder: an existing folder.
        formats: of the figures beside the page, which has them anyway.

    Raises:
        OutputError: if a file cannot be written.
    """
    for name, table in tables(reproduction).items():
        write_bytes(folder / f"{name}.csv", table.to_csv(index=False, float_format="%.9g").encode())
    write_bytes(folder / SUMMARY, json.dumps(summary(reproduction), indent=2).encode())
    drawn = figures(reproduction)
    for name, picture in drawn.items():
        save(picture, folder / name, formats)
    page_of(reproduction, drawn, f"trainmj paper --out {quote(str(folder))}").write(folder / PAGE)


def tables(reproduction: Reproduction) -> dict[str, pd.DataFrame]:
    """Everything that is written as CSV, by the name of its file."""
    found = summary(reproduction)
    said = {name: pd.DataFrame(found[name]) for name in ("verdicts", "laws", "defects")}
    said["defects"]["arithmetic"] = said["defects"]["arithmetic"].str.join(" ")
    return {
        **{table.name: table.table() for table in reproduction.tables.values()},
        "optima": reproduction.optima,
        **said,
        "figure9_front_from_table_9": reproduction.recomputed.front_table(),
        "figure9_front_ours": reproduction.ours.front_table(),
    }


def summary(reproduction: Reproduction) -> dict[str, Any]:
    """Verdicts, laws, defects and optima as JSON holds them."""
    judged, missed = reproduction.judged, reproduction.missed
    return {
        "bars": {"stated": len(judged), "met": len(judged) - len(missed), "missed": [v.missed for v in missed]},
        "verdicts": [asdict(v) | {"met": v.met} for v in reproduction.verdicts],
        "laws": [asdict(law) for law in reproduction.laws],
        "defects": [asdict(defect) for defect in reproduction.defects],
        "optima": json.loads(reproduction.optima.to_json(orient="records", double_precision=10)),
    }
