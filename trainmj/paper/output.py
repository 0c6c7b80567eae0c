"""The folder of ``trainmj paper``: one CSV for each table, figures, the verdicts, and the page; and of its --beyond."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import Any

import pandas as pd

from trainmj.files.folder import staged
from trainmj.output.style import ENDINGS, Format, save
from trainmj.paper import BEYOND, PAGE, page_beyond
from trainmj.paper.beyond import Beyond
from trainmj.paper.figures import figures
from trainmj.paper.page import page_of
from trainmj.paper.reproduce import Reproduction

SUMMARY = "summary.json"
OWN = (
    rf"(table\d+|eq7_eq8|balance|figure\d+|tables)_\w+\.(csv|{ENDINGS})|(optima|verdicts|laws|defects)\.csv"
    rf"|(scatter_over_D|misfit_over_K)\.(csv|{ENDINGS})|scatter\.csv|summary\.json|paper\.html"
)
"""The files of the folder, as a pattern of their names."""

OWN_BEYOND = rf"beyond_\w+\.(csv|{ENDINGS})|beyond\.(json|html)"
"""Those of --beyond, which may be in the same folder."""

_LONG = ("beyond_values", "beyond_responses")  # tables that the summary leaves out


def write_paper(reproduction: Reproduction, folder: Path, formats: Sequence[Format] = ("png",)) -> None:
    """Write tables, figures, verdicts and page into a folder; all are finished before the first one is replaced.

    Args:
        reproduction: what was computed.
        folder: an existing folder.
        formats: of the figures beside the page, which has them anyway.

    Raises:
        OutputError: if a file cannot be written.
    """
    with staged(folder, OWN, SUMMARY) as stage:
        for name, table in tables(reproduction).items():
            table.to_csv(stage / f"{name}.csv", index=False, float_format="%.9g")
        (stage / SUMMARY).write_text(json.dumps(summary(reproduction), indent=2), encoding="utf-8")
        drawn = figures(reproduction)
        for name, picture in drawn.items():
            save(picture, stage / name, formats)
        page_of(reproduction, drawn, f"trainmj paper --out {quote(str(folder))}").write(stage / PAGE)


def write_beyond(found: Beyond, folder: Path, formats: Sequence[Format] = ("png",)) -> None:
    """Write what was found beyond the paper's range into a folder, as write_paper does.

    Raises:
        OutputError: if a file cannot be written.
    """
    with staged(folder, OWN_BEYOND, BEYOND) as stage:
        for name, table in page_beyond.tables(found).items():
            table.to_csv(stage / f"{name}.csv", index=False, float_format="%.9g")
        (stage / "beyond.json").write_text(json.dumps(summary_beyond(found), indent=2), encoding="utf-8")
        drawn = page_beyond.figures(found)
        for name, picture in drawn.items():
            save(picture, stage / name, formats)
        page_beyond.page_of(found, drawn, f"trainmj paper --beyond --out {quote(str(folder))}").write(stage / BEYOND)


def summary_beyond(found: Beyond) -> dict[str, Any]:
    """Where the laws hold, break and why, as JSON holds it."""
    given = {name: table for name, table in page_beyond.tables(found).items() if name not in _LONG}
    return {name.removeprefix("beyond_"): json.loads(t.to_json(orient="records")) for name, t in given.items()}


def tables(reproduction: Reproduction) -> dict[str, pd.DataFrame]:
    """Everything that is written as CSV, by the name of its file."""
    found = summary(reproduction)
    said = {name: pd.DataFrame(found[name]) for name in ("verdicts", "laws", "defects")}
    said["defects"]["arithmetic"] = said["defects"]["arithmetic"].str.join(" ")
    return {
        **{table.name: table.table() for table in reproduction.tables.values()},
        "optima": reproduction.optima,
        "scatter": reproduction.scatter.left,
        "scatter_over_D": reproduction.scatter.fine,
        "misfit_over_K": reproduction.scatter.misfit,
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
        "scatter": {
            "left_mm": json.loads(reproduction.scatter.left.to_json(orient="records", double_precision=10)),
            "best": dict(zip(("K_kN_per_mm", "misfit"), reproduction.scatter.best, strict=True)),
            "steps": reproduction.scatter.steps,
        },
        "optima": json.loads(reproduction.optima.to_json(orient="records", double_precision=10)),
    }
