"""The command study."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trainmj.cli.options import going_on, takes_figures, takes_fresh, takes_threads
from trainmj.cli.report import takes_report, write

if TYPE_CHECKING:
    from trainmj.output.style import Format, Width


@click.command()
@click.argument("study")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results; made if needed.")
@takes_fresh
@takes_threads
@takes_figures
@takes_report
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object instead of tables.")
def study(
    study: str,
    out: Path,
    fresh: bool,
    threads: int,
    figures: tuple[Format, ...],
    figure_width: Width,
    with_report: bool,
    as_json: bool,
) -> None:
    """Go from free values to one chosen and verified design.

    STUDY is a study file, or the name of one that ships with trainmj, such as b_type. Each step leaves its tables and
    figures in the folder; the same command goes on where it was stopped, and does again only what has changed.

    Exit code: 0 when done, 1 if the chosen design does not keep its limits when simulated, 2 for wrong input.
    """
    from trainmj.study import load_study, run_study

    loaded = load_study(study)
    from trainmj.study import screen

    line = screen.Screen()
    with going_on(out, fresh, line):
        result = run_study(
            loaded, out, threads=threads, fresh=fresh, watch=line, figures=figures, figure_width=figure_width
        )
    if as_json:
        click.echo(json.dumps(result.summary, indent=2))
    else:
        screen.print_study(result)
    if with_report:
        write(out, silent=as_json)
    if not result.summary["check"]["kept"]:
        sys.exit(1)
