"""The command identify."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trainmj.cli.options import takes_figures, takes_threads
from trainmj.cli.report import takes_report

if TYPE_CHECKING:
    from trainmj.output.style import Format, Width


@click.command()
@click.argument("targets")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results; made if needed.")
@click.option("--resume", is_flag=True, help="Use the trials in the folder; none of them is simulated again.")
@takes_threads
@takes_figures
@takes_report
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object instead of tables.")
def identify(
    targets: str,
    out: Path,
    resume: bool,
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
    a search that was stopped goes on with --resume to the same end.

    Exit code: 0 when done, 1 if a bar that the file states is not kept, 2 for wrong input.
    """
    from trainmj.identification.plan import load_targets

    plan = load_targets(targets)
    from trainmj.identification import screen
    from trainmj.identification.run import identify as find

    line = screen.Screen()
    try:
        found = find(plan, out, threads, resume, line.watch, line.trials, figures, figure_width)
    except KeyboardInterrupt:
        line.stop()
        click.echo(f"Stopped. What was computed is in {out}; the same command with --resume goes on.", err=True)
        sys.exit(130)
    finally:
        line.stop()
    if with_report:
        from trainmj.identification import page

        page.page_of(found, page.command_of(targets, found)).write(out / page.PAGE)
    if as_json:
        click.echo(json.dumps(found.summary, indent=2))
    else:
        screen.print_found(found)
    if not found.kept:
        sys.exit(1)
