"""Commands that set results beside known ones: verify, paper."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.options import say, say_json, takes_formats, takes_json, takes_threads, takes_time

if TYPE_CHECKING:
    from trainmj.output.style import Format


@click.command()
@takes_json
@click.option("--page", type=click.Path(path_type=Path, dir_okay=False), help="HTML page to write as well.")
@takes_time
def verify(as_json: bool, page: Path | None) -> None:
    """Compute collisions whose outcome is known.

    Shows how close they come on this machine: closed forms, every kind of device, brakes and grades, MuJoCo's own
    plastic springs, scipy's integrators on the standard case and on random trains, symmetries, energy and momentum,
    the step, batches, and published numbers. It takes about a minute.

    Exit code: 0 if every check passes, 1 if one fails, 2 if the page cannot be written.
    """
    from trainmj.files.written import replacing
    from trainmj.output.waiting import tell

    with replacing(page) if page is not None else nullcontext() as part:
        if part is not None:
            part.touch()  # refuses a page that cannot be written before the work
        found = trainmj.verify(lambda title: tell(f"verify: {title}"))
        if page is not None and part is not None:
            from trainmj.verification.page import page_of

            part.write_text(page_of(found, f"trainmj verify --page {page.name}").html(), encoding="utf-8")
    if as_json:
        say_json(found.as_dict())
    else:
        from trainmj.verification.screen import print_verification

        print_verification(found)
        if page is not None:
            say(f"The page is {page}")
    if not found.passed:
        sys.exit(1)


@click.command()
@click.option("--out", type=click.Path(path_type=Path), help="Folder for tables, figures and page; made if needed.")
@click.option("--beyond", is_flag=True, help="Judge its laws outside its range instead: what it leaves to future work.")
@takes_threads
@takes_formats
@takes_json
@takes_time
def paper(out: Path | None, beyond: bool, threads: int, figures: tuple[Format, ...], as_json: bool) -> None:
    """Reproduce the paper that the B-type train comes from.

    Liu et al. 2022, doi 10.1186/s10033-022-00755-8: its 30 collisions, the study of Tables 9 to 13 on its own numbers
    and on ours, each published table beside ours, Figures 4 to 9, the laws that it states in words, and its defects.

    With --beyond: its laws at other speeds, masses and empty strokes, and with unequal masses; where each stops
    holding, with the numbers there, and why.

    Exit code: 0 when done, however many bars are missed (the first line counts them); 2 if something cannot be written.
    """
    from trainmj.files.folder import filling
    from trainmj.paper import BEYOND, PAGE, output

    if out is not None:
        click.get_current_context().with_resource(filling(out, output.OWN_BEYOND if beyond else output.OWN))
    from trainmj.paper import screen
    from trainmj.paper.beyond import judge_beyond
    from trainmj.paper.reproduce import reproduce

    found: Any = judge_beyond(threads) if beyond else reproduce(threads)
    write, summary, show, page = (
        (output.write_beyond, output.summary_beyond, screen.print_beyond, BEYOND)
        if beyond
        else (output.write_paper, output.summary, screen.print_paper, PAGE)
    )
    if out is not None:
        write(found, out, figures)
    if as_json:
        say_json(summary(found))
        return
    show(found)
    if out is not None:
        say(f"\nWritten to {out}; the page is {out / page}")
