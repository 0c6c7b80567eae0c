"""The command compare: two results, or a result and a test."""

from __future__ import annotations

import sys
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

import trainmj
from trainmj.cli.completing import offers
from trainmj.cli.options import say, say_json, split_assignment, takes_figures, takes_json, takes_time
from trainmj.cli.report import takes_report
from trainmj.errors import InputError
from trainmj.files.kinds import SCENARIO

if TYPE_CHECKING:
    from trainmj.files.cover import Cover
    from trainmj.output.style import Format, Width


@click.command()
@click.argument("a", shell_complete=offers(SCENARIO, results=True))
@click.argument("b", shell_complete=offers(SCENARIO, results=True))
@click.option(
    "--channel",
    "channels",
    multiple=True,
    metavar="NAME=COLUMN",
    help="Which column of a test is which channel, or a sum of columns: velocity_M1_km_h='3.6 * v1'. May be repeated.",
)
@click.option("--time", metavar="COLUMN", help="Column of times of a test, or a sum; by default the one called time.")
@click.option("--sheet", metavar="NAME", help="Sheet of a workbook with a test, if several have tables.")
@click.option("--range", "cells", metavar="CELLS", help="Where on the sheet it is, heads included, as B3:F200.")
@click.option("--align", is_flag=True, help="Seek the shift of B's clock with which the two differ least, and say it.")
@click.option(
    "--offset-ms", type=float, metavar="MS", default=0.0, help="A shift of B's clock that is known, added to its times."
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for tables and figure; made if needed.")
@takes_figures
@takes_report
@takes_json
@takes_time
def compare(
    a: str,
    b: str,
    channels: tuple[str, ...],
    time: str | None,
    sheet: str | None,
    cells: str | None,
    align: bool,
    offset_ms: float,
    out: Path | None,
    figures: tuple[Format, ...],
    figure_width: Width,
    cover: Cover | None,
    as_json: bool,
) -> None:
    """Hold a result against another one, or against a test.

    A is a saved result or its folder; a scenario is computed. B is likewise, or a test: a table with a column for each
    channel (CSV, or an Excel workbook), or an ISO-MME folder. Prints how far channels differ while both are there, and
    the rules that the validation of a model by EN 15227 speaks of: sequence, energy, strokes and mean forces. No
    compliance is claimed.

    Exit code: 0 if the rules are kept that could be judged, or none could; 1 if one is not kept, or the numbers of a
    result may not be used; 2 for wrong input.
    """
    if cover is not None and out is None:
        raise InputError("--report: needs --out, the folder to write report.html into")
    if align and offset_ms:
        raise InputError("--align: seeks the offset that --offset-ms states: leave one of them out")
    chosen: dict[str, str] = {}
    for text in channels:
        name, column = split_assignment("--channel", text, "velocity_M1_km_h=v1")
        if name in chosen:
            raise InputError(f"--channel {text}: {name} is named twice")
        chosen[name] = column
    from trainmj.collision.saved import find_result
    from trainmj.comparison import folder
    from trainmj.comparison.screen import print_comparison
    from trainmj.files.folder import filling
    from trainmj.output.page import REPORT

    if out is not None:
        inputs = [Path(given) for given in (a, b) if Path(given).is_file()]
        for saved in (find_result(a), find_result(b)):
            if saved is not None and out.resolve() == saved.parent.resolve():
                raise InputError(f"--out {out}: has a result that is compared: take another folder")
        click.get_current_context().with_resource(filling(out, folder.OWN, inputs))
    found = trainmj.compare(a, b, chosen, time, align, offset_ms, sheet, cells)
    if out is not None:
        words = [f"--channel {quote(text)}" for text in channels] + ([f"--time {quote(time)}"] if time else [])
        words += ([f"--sheet {quote(sheet)}"] if sheet else []) + ([f"--range {quote(cells)}"] if cells else [])
        words += (["--align"] if align else []) + ([f"--offset-ms {offset_ms:g}"] if offset_ms else [])
        command = " ".join(["trainmj compare", quote(a), quote(b), *words, f"--out {quote(str(out))} --report"])
        folder.write(found, out, command, figures, figure_width, cover)
    if as_json:
        say_json(found.as_dict())
    else:
        print_comparison(found)
        if out is not None:
            say(f"Written to {out}/" + (f"; open {out / REPORT}" if cover is not None else ""))
    if found.kept is False:
        sys.exit(1)
