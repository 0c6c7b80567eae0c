"""The command verify."""

from __future__ import annotations

import json
import sys
from contextlib import nullcontext
from pathlib import Path

import click

from trainmj.cli.options import takes_json


@click.command()
@takes_json
@click.option("--page", type=click.Path(path_type=Path, dir_okay=False), help="HTML page to write as well.")
def verify(as_json: bool, page: Path | None) -> None:
    """Compute collisions whose outcome is known.

    Shows how close they come on this machine: closed forms, MuJoCo's own plastic springs, scipy's integrator on the
    standard case and on random trains, symmetries, energy and momentum, the step, batches, and published numbers. It
    takes about ten seconds.

    Exit code: 0 if every check passes, 1 if one fails, 2 if the page cannot be written.
    """
    from rich.console import Console

    from trainmj.files.atomic import replacing
    from trainmj.verification import suite

    with replacing(page) if page is not None else nullcontext() as part:
        if part is not None:
            part.touch()  # refuses a page that cannot be written before the work
        with Console(stderr=True).status("") as status:
            found = suite.verify(lambda title: status.update(f"{title} ..."))
        if page is not None and part is not None:
            from trainmj.verification.page import page_of

            part.write_text(page_of(found, f"trainmj verify --page {page.name}").html(), encoding="utf-8")
    if as_json:
        click.echo(json.dumps(found.as_dict(), indent=2))
    else:
        from trainmj.verification.screen import print_verification

        print_verification(found)
        if page is not None:
            click.echo(f"The page is {page}")
    if not found.passed:
        sys.exit(1)
