"""The command paper."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trainmj.cli.options import takes_formats, takes_json, takes_threads
from trainmj.files.folder import held

if TYPE_CHECKING:
    from trainmj.output.style import Format


@click.command()
@click.option("--out", type=click.Path(path_type=Path), help="Folder for tables, figures and page; made if needed.")
@takes_threads
@takes_formats
@takes_json
def paper(out: Path | None, threads: int, figures: tuple[Format, ...], as_json: bool) -> None:
    """Reproduce the paper that the B-type train comes from.

    Liu et al. 2022, doi 10.1186/s10033-022-00755-8: its 30 collisions, the study of Tables 9 to 13 on its own numbers
    and on ours, each published table beside ours, Figures 4 to 9, the laws that it states in words, and its defects.

    Exit code: 0 when done, whatever agrees; 2 if something cannot be written.
    """
    if out is not None:
        click.get_current_context().with_resource(held(out))
    from trainmj.paper.reproduce import reproduce

    reproduction = reproduce(threads)
    if out is not None:
        from trainmj.paper.output import PAGE, write_paper

        write_paper(reproduction, out, figures)
    if as_json:
        from trainmj.paper.output import summary

        click.echo(json.dumps(summary(reproduction), indent=2))
        return
    from trainmj.paper.screen import print_paper

    print_paper(reproduction)
    if out is not None:
        click.echo(f"\nWritten to {out}; the page is {out / PAGE}")
