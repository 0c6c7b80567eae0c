"""The folder of one run: result, tables and figure, for a spreadsheet, MATLAB or a report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from trainmj import plotting
from trainmj.errors import OutputError
from trainmj.metrics import InterfaceMetrics, Summary, VehicleMetrics
from trainmj.result import Result
from trainmj.scenario import to_yaml


def write_run(
    result: Result,
    summary: Summary,
    folder: Path,
    formats: Sequence[plotting.Format] = ("png",),
    width: plotting.Width = "page",
) -> None:
    """Write scenario.yaml, result.nc, the tables as CSV, summary.json and the figure into a folder.

    Args:
        result: of the collision.
        summary: of the same.
        folder: where.
        formats: of the figure, collision.png and so on.
        width: of the figure.

    Raises:
        OutputError: if a file cannot be written.
    """
    result.save(folder / "result.nc")
    try:
        (folder / "scenario.yaml").write_text(to_yaml(result.scenario), encoding="utf-8")
        (folder / "summary.json").write_text(json.dumps(summary.as_dict(), indent=2), encoding="utf-8")
        result.table().to_csv(folder / "histories.csv", index=False, float_format="%.9g")
        _write_table(summary.interfaces, folder / "interfaces.csv", left_out={"stages"})
        _write_table(summary.vehicles, folder / "vehicles.csv")
    except OSError as error:
        raise OutputError(f"{error.filename or folder}: cannot be written ({error.strerror})") from None
    plotting.save(plotting.collision(result, width), folder / "collision", formats)


def _write_table(
    rows: Sequence[InterfaceMetrics] | Sequence[VehicleMetrics],
    file: Path,
    left_out: frozenset[str] | set[str] = frozenset(),
) -> None:
    import pandas as pd

    table = pd.DataFrame([{k: v for k, v in vars(row).items() if k not in left_out} for row in rows])
    table.to_csv(file, index=False, float_format="%.9g")
