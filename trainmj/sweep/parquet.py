"""Results of a sweep as Parquet, for Arrow, Polars or Spark; needs the extra ``parquet``."""

from __future__ import annotations

from pathlib import Path

from trainmj.errors import InputError
from trainmj.files.written import replacing

try:
    import pyarrow.csv
    import pyarrow.parquet
except ImportError:
    raise InputError("--parquet needs the package pyarrow: pip install 'trainmj[parquet]'") from None


def write_parquet(folder: Path) -> None:
    """Write results.parquet from the results.csv of a finished sweep."""
    with (
        replacing(folder / "results.parquet") as part,
        (folder / "results.csv").open("rb") as table,
        part.open("wb") as out,  # Arrow itself opens only what has a name in UTF-8
    ):
        pyarrow.parquet.write_table(pyarrow.csv.read_csv(table), out)
