"""The folder of a comparison: tables, figure and report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from trainmj.comparison import figures
from trainmj.comparison.found import Comparison
from trainmj.comparison.page import page_of
from trainmj.files.cover import Cover
from trainmj.files.folder import staged
from trainmj.output.page import REPORT
from trainmj.output.style import ENDINGS, Format, Width, save

FILE = "comparison.json"
"""The file by which the folder is known."""

OWN = rf"(differences|rules)\.csv|comparison\.json|overlay\.{ENDINGS}|report\.html"
"""The files of the folder, as a pattern of their names."""


def write(
    found: Comparison,
    folder: Path,
    command: str,
    formats: Sequence[Format] = ("png",),
    width: Width = "page",
    cover: Cover | None = None,
) -> None:
    """Write the tables as CSV, all of it as JSON, the figure and, with a cover, the report into a folder.

    Raises:
        OutputError: if a file cannot be written.
    """
    import pandas as pd

    with staged(folder, OWN, FILE) as stage:
        found.to_frame().to_csv(stage / "differences.csv", index=False, float_format="%.9g")
        rows = pd.DataFrame([rule.as_dict() for rule in found.rules])
        rows.to_csv(stage / "rules.csv", index=False, float_format="%.9g")
        if formats:
            save(figures.overlay(found, width), stage / "overlay", formats)
        if cover is not None:
            page_of(found, command).headed(cover).write(stage / REPORT)
        (stage / FILE).write_text(json.dumps(found.as_dict(), indent=2), encoding="utf-8")
