"""The folder of one run: result, tables and figures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from trainmj.collision.result import FILE, Result
from trainmj.collision.summary import Summary
from trainmj.files.folder import staged
from trainmj.output.style import ENDINGS, Format, Width, save
from trainmj.scenario import to_yaml
from trainmj.single import figures

OWN = (
    rf"scenario\.yaml|result\.nc|(histories|interfaces|vehicles)\.csv|(collision|occupants)\.{ENDINGS}"
    r"|summary\.json|report\.html"
)
"""The files of the folder, as a pattern of their names."""

_LAST = "summary.json"


def write_run(
    result: Result,
    summary: Summary,
    folder: Path,
    formats: Sequence[Format] = ("png",),
    width: Width = "page",
) -> None:
    """Write scenario.yaml, result.nc, the tables as CSV, summary.json and the figures into a folder.

    All files are finished before those of an earlier run, its report and figures among them, give way to them. If
    summary.json is there, all the others belong to it.

    Raises:
        OutputError: if a file cannot be written.
    """
    import pandas as pd

    with staged(folder, OWN, _LAST) as stage:
        result.save(stage / FILE)
        (stage / "scenario.yaml").write_text(to_yaml(result.scenario), encoding="utf-8")
        result.table().to_csv(stage / "histories.csv", index=False, float_format="%.9g")
        for file, parts in (("interfaces.csv", summary.interfaces), ("vehicles.csv", summary.vehicles)):
            rows = pd.DataFrame([part.as_row() | {"valid_until_s": summary.valid_until_s} for part in parts])
            rows.to_csv(stage / file, index=False, float_format="%.9g")
        save(figures.collision(result, width), stage / "collision", formats)
        if result.chain.free_flights and formats:
            save(figures.occupants(result, width), stage / "occupants", formats)
        (stage / _LAST).write_text(json.dumps(summary.as_dict(), indent=2), encoding="utf-8")
