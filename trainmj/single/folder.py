"""The folder of one run: result, tables and figure."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.errors import OutputError
from trainmj.output.style import Format, Width, save
from trainmj.scenario import to_yaml
from trainmj.single import figures

_LAST = "summary.json"


def write_run(
    result: Result,
    summary: Summary,
    folder: Path,
    formats: Sequence[Format] = ("png",),
    width: Width = "page",
) -> None:
    """Write scenario.yaml, result.nc, the tables as CSV, summary.json and the figure into a folder.

    All files are finished before the first one of an earlier run is replaced. If summary.json is there, all the
    others belong to it.

    Raises:
        OutputError: if a file cannot be written.
    """
    import pandas as pd

    try:
        with TemporaryDirectory(prefix=".part-", dir=folder) as name:
            stage = Path(name)
            result.save(stage / "result.nc")
            (stage / "scenario.yaml").write_text(to_yaml(result.scenario), encoding="utf-8")
            result.table().to_csv(stage / "histories.csv", index=False, float_format="%.9g")
            for file, parts in (("interfaces.csv", summary.interfaces), ("vehicles.csv", summary.vehicles)):
                rows = pd.DataFrame([part.as_row() for part in parts])
                rows.to_csv(stage / file, index=False, float_format="%.9g")
            save(figures.collision(result, width), stage / "collision", formats)
            (stage / _LAST).write_text(json.dumps(summary.as_dict(), indent=2), encoding="utf-8")
            _move(stage, folder)
    except OutputError as error:
        raise OutputError(str(error).replace(f"{name}{os.sep}", f"{folder}{os.sep}")) from None
    except OSError as error:
        at = folder / Path(error.filename).name if error.filename else folder
        raise OutputError(f"{at}: cannot be written ({error.strerror or error})") from None


def _move(stage: Path, folder: Path) -> None:
    """Put finished files where they belong: the summary is away before the first and comes after the last."""
    (folder / _LAST).unlink(missing_ok=True)
    for file in sorted(stage.iterdir(), key=lambda file: file.name == _LAST):
        os.replace(file, folder / file.name)
