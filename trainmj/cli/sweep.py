"""The command sweep."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trainmj.cli.options import going_on, load_scenario, split_assignment, takes_fresh, takes_scenario, takes_threads
from trainmj.cli.report import takes_report, write
from trainmj.errors import InputError

if TYPE_CHECKING:
    from trainmj.cases.engine import Engine
    from trainmj.sweep.plan import Sweep


@click.command()
@takes_scenario
@click.option(
    "--vary",
    multiple=True,
    metavar="PATH=VALUES",
    help="Vary a value: FROM:TO:COUNT (20:50:9) or a list (30,33,36). Several make a full grid.",
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results; made if needed.")
@takes_fresh
@takes_threads
@click.option(
    "--responses", metavar="NAMES", help="Columns wanted, with commas between; * stands for any part of a name."
)
@click.option("--histories", metavar="NUMBERS", help="Numbers of cases (from 0) whose histories are kept as NetCDF.")
@click.option("--dask", metavar="ADDRESS", help="Compute on a Dask cluster: its scheduler's address, or 'local'.")
@click.option("--parquet", is_flag=True, help="Write results.parquet too.")
@takes_report
def sweep(
    scenario: str,
    changes: dict[str, Any],
    vary: tuple[str, ...],
    out: Path,
    fresh: bool,
    threads: int,
    responses: str | None,
    histories: str | None,
    dask: str | None,
    parquet: bool,
    with_report: bool,
) -> None:
    """Compute many cases of a scenario, one row for each.

    SCENARIO may also be a sweep file, which states the cases itself. Results are kept as they come, in
    results.sqlite and at the end results.csv; whatever stops a sweep, the same command goes on.
    """
    from trainmj.output.console import Progress
    from trainmj.sweep import plan
    from trainmj.sweep.run import run_sweep
    from trainmj.sweep.screen import print_sweep

    if plan.is_sweep_file(scenario):
        if vary:
            raise InputError(f"--vary: the sweep file {scenario} states what is varied: write it there")
        cases = plan.load_sweep(scenario, changes)
    else:
        grid: dict[str, str] = {}
        for text in vary:
            path, values = split_assignment("--vary", text, "mass_t=30,33,36")
            if path in grid:
                raise InputError(f"--vary {text}: {path} is varied twice")
            grid[path] = values
        cases = plan.grid_of(load_scenario(scenario, changes), grid)
    if responses is not None:
        cases = replace(cases, responses=tuple(part.strip() for part in responses.split(",")))
    if histories is not None:
        cases = replace(cases, histories=tuple(_numbers(histories)))
    write_parquet = _parquet_writer() if parquet else None
    with Progress(len(cases)) as progress, going_on(out, fresh, progress), _engine(dask, cases) as engine:
        result = run_sweep(cases, out, threads=threads, fresh=fresh, engine=engine, progress=progress)
    if write_parquet is not None:
        write_parquet(out)
    print_sweep(result)
    if with_report:
        write(out)


def _numbers(text: str) -> list[int]:
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise InputError(f"--histories {text}: must be whole numbers with commas between, as in 0,17")
    return [int(part) for part in parts]


def _engine(dask: str | None, cases: Sweep) -> AbstractContextManager[Engine | None]:
    if dask is None:
        return nullcontext()
    from trainmj.cases.cluster import connected

    return connected(dask, cases.scenario)


def _parquet_writer() -> Callable[[Path], None]:
    """The writer, asked for before the work so that a missing package is not found out at the end."""
    from trainmj.sweep.parquet import write_parquet

    return write_parquet
