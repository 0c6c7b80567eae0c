"""The command identify."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trainmj.cli.options import going_on, takes_figures, takes_fresh, takes_threads
from trainmj.cli.report import takes_report

if TYPE_CHECKING:
    from trainmj.output.style import Format, Width


@click.command()
@click.argument("targets")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results; made if needed.")
@takes_fresh
@takes_threads
@takes_figures
@takes_report
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object instead of tables.")
def identify(
    targets: str,
    out: Path,
    fresh: bool,
    threads: int,
    figures: tuple[Format, ...],
    figure_width: Width,
    with_report: bool,
    as_json: bool,
) -> None:
    """Find device curves and other values from known responses.

    Values of a scenario are sought with which its responses meet those of a test, a table or another program.

    TARGETS is a targets file, or the name of one that ships with trainmj, such as b_type. The folder gets the values
    found as a scenario, how well the data determine them, and every deviation. The result depends on the file alone:
    whatever stops a search, the same command goes on to the same end.

    Exit code: 0 when done, 1 if a bar that the file states is not kept, 2 for wrong input.
    """
    from trainmj.identification.plan import load_targets

    plan = load_targets(targets)
    from trainmj.identification import screen
    from trainmj.identification.run import identify as find

    line = screen.Screen()
    with going_on(out, fresh, line):
        found = find(
            plan,
            out,
            threads=threads,
            fresh=fresh,
            watch=line.watch,
            progress=line.trials,
            figures=figures,
            width=figure_width,
        )
    if with_report:
        from trainmj.identification import page

        page.page_of(found, page.command_of(targets, found)).write(out / page.PAGE)
    if as_json:
        click.echo(json.dumps(found.summary, indent=2))
    else:
        screen.print_found(found)
    if not found.kept:
        sys.exit(1)
