"""The command report, and the option --report of the commands that make results."""

from __future__ import annotations

from pathlib import Path

import click

takes_report = click.option(
    "--report", "with_report", is_flag=True, help="Write report.html too: everything seen, in one file."
)
"""The option --report."""


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="HTML file to write; report.html in the folder otherwise.")
def report(results: Path, out: Path | None) -> None:
    """Write the report of a run, a sweep or a study.

    RESULTS is the folder that the command wrote, or one saved result in it, such as case_3.nc. The report is one HTML
    file, which works offline and opens by double click: tables, plots with zoom and read-out, and for a run the
    collision as an animation.
    """
    write(results, out)


def write(results: Path, out: Path | None = None, silent: bool = False) -> None:
    """Write a report and say where, unless silent."""
    from trainmj.cli.reports import write_report

    file = write_report(results, out)
    if not silent:
        click.echo(f"Report: {file}")
