"""Results of a sweep as Parquet: an extra, for who reads them with Arrow, Polars or Spark."""

from __future__ import annotations

from pathlib import Path

from trainmj.errors import InputError, OutputError

try:
    import pyarrow.csv
    import pyarrow.parquet
except ImportError:
    raise InputError("--parquet needs the package pyarrow: pip install 'trainmj[parquet]'") from None


def write_parquet(folder: Path) -> None:
    """Write results.parquet from the results.csv of a finished sweep.

    Raises:
        OutputError: if it cannot be written.
    """
    file = folder / "results.parquet"
    try:
        pyarrow.parquet.write_table(pyarrow.csv.read_csv(folder / "results.csv"), file)
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error})") from None
