"""A result as CSV files with the separators that a reader wants, or for a spreadsheet."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.files.folder import filling, staged
from trainmj.single.folder import NUMBER, tables_of

if TYPE_CHECKING:
    import pandas as pd

OWN = r"(histories|interfaces|stages|vehicles|wheelsets|bodies)\.csv"
"""The files of a folder of tables, as a pattern of their names."""


def validity(summary: Summary) -> str:
    """Whether the numbers of a result may be used, in words for every sheet and file."""
    if summary.not_valid:
        return summary.not_valid.upper()
    return "NUMBERS MAY NOT BE USED" if summary.status.unusable else "all numbers are valid"


def tables(result: Result, summary: Summary) -> dict[str, pd.DataFrame]:
    """The tables of a run by name, those of the stages of its devices among them, both sides of the front over time."""
    import pandas as pd

    stages: list[dict[str, Any]] = [
        {
            "interface": i.name,
            "device": i.device,
            "stage": stage.name,
            "stroke_mm": stage.stroke_mm,
            "limit_mm": stage.limit_mm,
            "energy_kJ": stage.energy_kJ,
            "valid_until_s": summary.valid_until_s,
        }
        for i in summary.interfaces
        for stage in i.stages
    ]
    return {**tables_of(result, summary, both_sides=True), "stages": pd.DataFrame(stages)}


def write(
    result: Result,
    summary: Summary,
    out: Path,
    inputs: Iterable[Path] = (),
    separator: str = ",",
    decimal: str = ".",
) -> None:
    """Write the tables into a folder as CSV files.

    Raises:
        OutputError: if one cannot be written.
    """
    with filling(out, OWN, inputs), staged(out, OWN, "histories.csv") as stage:
        for name, table in tables(result, summary).items():
            table.to_csv(stage / f"{name}.csv", sep=separator, decimal=decimal, index=False, float_format=NUMBER)
