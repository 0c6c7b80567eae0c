"""The command assess: does a train pass?"""

from __future__ import annotations

import sys
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.completing import offers
from trainmj.cli.options import say, say_json, set_again, takes_changes, takes_json, takes_threads, takes_time
from trainmj.cli.report import takes_report
from trainmj.errors import InputError
from trainmj.files.kinds import ASSESSMENT, SCENARIO

if TYPE_CHECKING:
    from trainmj.files.cover import Cover


@click.command()
@click.argument("train", shell_complete=offers(SCENARIO))
@takes_changes
@click.option(
    "--standard",
    required=True,
    metavar="FILE",
    shell_complete=offers(ASSESSMENT),
    help="Assessment file, or the name of one that ships, such as en15227.",
)
@click.option("--category", metavar="NAME", help="Category of the train in the file, such as C-II.")
@click.option(
    "--line-speed",
    type=click.FloatRange(0, 500, min_open=True),
    metavar="KM/H",
    help="Speed of the line on which it runs, where a collision speed follows from it.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for tables and scenarios; made if needed.")
@takes_threads
@takes_report
@takes_json
@takes_time
def assess(
    train: str,
    changes: dict[str, Any],
    standard: str,
    category: str | None,
    line_speed: float | None,
    out: Path | None,
    threads: int,
    cover: Cover | None,
    as_json: bool,
) -> None:
    """Assess a train: every collision that a standard asks of it.

    TRAIN is a scenario, whose moving train is assessed, its own limits included. The assessment file says what it runs
    into and how fast. Every collision scenario of the category is computed with each end leading that it names, in
    every load state. What is not computed is listed. No compliance with a standard is claimed: the numbers of the
    shipped files have marks that say how far each was seen.

    Exit code: 0 if every criterion that is computed is kept; 1 if one is not, a car body gave way, a case has no
    usable numbers, or there is nothing to judge; 2 for wrong input.
    """
    if cover is not None and out is None:
        raise InputError("--report: needs --out, the folder to write report.html into")
    loaded, asked = trainmj.load(train, changes), trainmj.load_assessment(standard)
    from trainmj.assessment import screen
    from trainmj.assessment.folder import OWN, write_assessment
    from trainmj.files.folder import filling
    from trainmj.files.written import finite
    from trainmj.output.page import REPORT

    if out is not None:
        click.get_current_context().with_resource(filling(out, OWN, loaded.files | asked.files))
    found = trainmj.assess(loaded, asked, category, line_speed_km_h=line_speed, threads=threads)
    if out is not None:
        write_assessment(found, out, _command(train, changes, standard, category, line_speed, out), cover)
    if as_json:
        say_json(finite(found.as_dict()))
    else:
        screen.print_assessment(found)
        if out is not None:
            say(f"Written to {out}/" + (f"; open {out / REPORT}" if cover is not None else ""))
    if not found.passed:
        sys.exit(1)


def _command(
    train: str, changes: dict[str, Any], standard: str, category: str | None, line_speed: float | None, out: Path
) -> str:
    """The command that makes the page again."""
    words = ["trainmj assess", quote(train), *set_again(changes)]
    words += [f"--standard {quote(standard)}"] + ([f"--category {quote(category)}"] if category else [])
    words += [f"--line-speed {line_speed:g}"] if line_speed is not None else []
    return " ".join([*words, f"--out {quote(out.resolve().name)} --report"])
