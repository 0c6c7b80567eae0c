"""The command reliability: how likely limits are passed under tolerances."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.completing import offers
from trainmj.cli.options import (
    going_on,
    kind_of_input,
    say,
    say_json,
    set_again,
    takes_changes,
    takes_figures,
    takes_folder,
    takes_json,
    takes_time,
)
from trainmj.cli.report import takes_report
from trainmj.cli.tasks import engine_at, takes_dask
from trainmj.errors import InputError
from trainmj.files.kinds import RELIABILITY, SCENARIO

if TYPE_CHECKING:
    from trainmj.files.cover import Cover
    from trainmj.output.style import Format, Width


@click.command()
@click.argument("file", shell_complete=offers(SCENARIO, RELIABILITY))
@takes_changes
@click.option("--runs", type=click.IntRange(1), metavar="N", help="Draws; more go on from those that are there.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), metavar="N", help="Of the random numbers.")
@click.option(
    "--draw",
    type=click.IntRange(0),
    metavar="N",
    help="Compute nothing: write the scenario of draw N into the folder, for trainmj run.",
)
@click.option("--case", metavar="NAME", help="With --draw: the load case; the first by default.")
@takes_folder
@takes_dask
@takes_figures
@takes_report
@takes_json
@takes_time
def reliability(
    file: str,
    changes: dict[str, Any],
    runs: int | None,
    seed: int | None,
    draw: int | None,
    case: str | None,
    out: Path,
    fresh: bool,
    threads: int,
    dask: str | None,
    figures: tuple[Format, ...],
    figure_width: Width,
    cover: Cover | None,
    as_json: bool,
) -> None:
    """Find how likely limits are passed when a train is built within its tolerances.

    FILE is a scenario that states tolerances, or a reliability file, which may state load cases, a search for small
    probabilities, and Sobol' indices. Collisions are kept as they end; whatever stops the command, the same one goes
    on, and with more --runs from those that are there.

    Exit code: 0 when done; 1 if no collision has numbers that may be used; 2 for wrong input.
    """
    kind = kind_of_input(file)
    if kind not in (SCENARIO, RELIABILITY) and not file.endswith(RELIABILITY.ending):
        raise InputError(f"{file}: is a {kind.name}: {kind.takes} reads it; give a scenario or a reliability file")
    plan = trainmj.load_reliability(file, changes)
    stated = {name: value for name, value in (("runs", runs), ("seed", seed)) if value is not None}
    plan = replace(plan, spec=plan.spec.model_copy(update=stated))
    if case is not None and draw is None:
        raise InputError("--case: goes with --draw")
    if draw is not None:
        _write_draw(plan, draw, case, out)
        return
    from trainmj.output.console import Progress
    from trainmj.output.page import REPORT
    from trainmj.reliability import page, screen

    progress = Progress(plan.spec.runs * len(plan.cases))
    first = next(iter(plan.scenarios.values()))
    with progress, going_on(out, fresh, progress.stop), engine_at(dask, first) as engine:
        result = trainmj.run_reliability(
            plan,
            out,
            threads=threads,
            fresh=fresh,
            engine=engine,
            progress=progress,
            figures=figures,
            figure_width=figure_width,
        )
    if cover is not None:
        page.page_of(result, _command(file, changes, stated, out)).headed(cover).write(out / REPORT)
    if as_json:
        say_json(result.as_dict())
    else:
        screen.print_reliability(result)
        if cover is not None:
            say(f"Report: {out / REPORT}")
    if not screen.usable(result):
        sys.exit(1)


def _write_draw(plan: trainmj.Reliability, draw: int, case: str | None, out: Path) -> None:
    """Write the scenario of a draw, and say how to run it."""
    from trainmj.files.folder import filling
    from trainmj.reliability.run import OWN

    scenario = trainmj.scenario_of_draw(plan, draw, case or "")
    name = case or plan.cases[0]
    with filling(out, OWN, plan.files) as folder:
        written = folder / f"draw_{draw}{f'_{name}' if name else ''}.yaml"
        trainmj.save(scenario, written)
    say(f"Draw {draw}{f' in {name}' if name else ''}: trainmj run {quote(str(written))}")


def _command(file: str, changes: dict[str, Any], stated: dict[str, int], out: Path) -> str:
    """The command that makes the page again."""
    words = ["trainmj reliability", quote(file), *set_again(changes)]
    words += [f"--{name} {value}" for name, value in stated.items()]
    return " ".join([*words, f"--out {quote(out.resolve().name)} --report"])
