"""Commands that compute much and go on where they were stopped: sweep, study, identify."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.completing import offers, settings
from trainmj.cli.options import (
    going_on,
    kind_of_input,
    parts_of,
    say_json,
    say_notes,
    split_assignment,
    takes_allowed,
    takes_changes,
    takes_fail_on_limit,
    takes_figures,
    takes_folder,
    takes_json,
    takes_time,
)
from trainmj.cli.report import takes_report, write
from trainmj.errors import InputError
from trainmj.files.kinds import SCENARIO, STUDY, SWEEP, TARGETS

if TYPE_CHECKING:
    from trainmj.cases.engine import Engine
    from trainmj.files.cover import Cover
    from trainmj.output.style import Format, Width
    from trainmj.scenario import Scenario


def _grid(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, str]:
    """The values of --vary by path."""
    grid: dict[str, str] = {}
    for text in texts:
        path, values = split_assignment("--vary", text, "mass_t=30,33,36")
        if path in grid:
            raise InputError(f"--vary {text}: {path} is varied twice")
        grid[path] = values
    return grid


def _numbers(text: str) -> tuple[int, ...]:
    parts = parts_of(text)
    if not all(part.isdecimal() for part in parts):
        raise InputError(f"--histories {text}: must be whole numbers with commas between, as in 0,17")
    return tuple(map(int, parts))


def engine_at(dask: str | None, scenario: Scenario) -> AbstractContextManager[Engine | None]:
    """The engine of a cluster, if there is one."""
    if dask is None:
        return nullcontext()
    from trainmj.cases.cluster import connected

    return connected(dask, scenario)


takes_dask = click.option(
    "--dask", metavar="ADDRESS", help="Compute on a Dask cluster: its scheduler's address, or 'local'."
)


@click.command()
@click.argument("scenario", shell_complete=offers(SCENARIO, SWEEP))
@takes_changes
@click.option(
    "--vary",
    multiple=True,
    metavar="PATH=VALUES",
    callback=_grid,
    shell_complete=settings,
    help="Vary a value: FROM:TO:COUNT (20:50:9) or a list (30,33,36). Several make a full grid.",
)
@takes_folder
@click.option(
    "--responses", metavar="NAMES", help="Columns wanted, with commas between; * stands for any part of a name."
)
@click.option("--histories", metavar="NUMBERS", help="Numbers of cases (from 0) whose histories are kept as NetCDF.")
@takes_dask
@click.option("--parquet", is_flag=True, help="Write results.parquet too.")
@takes_report
@takes_fail_on_limit
@takes_time
def sweep(
    scenario: str,
    changes: dict[str, Any],
    vary: dict[str, str],
    out: Path,
    fresh: bool,
    threads: int,
    responses: str | None,
    histories: str | None,
    dask: str | None,
    parquet: bool,
    cover: Cover | None,
    fail_on_limit: bool,
) -> None:
    """Compute many cases of a scenario, one row for each.

    SCENARIO may also be a sweep file, which states the cases itself. Results are kept as they come, in
    results.sqlite and at the end results.csv; whatever stops a sweep, the same command goes on.

    Exit code: 0 when done; 1 if no case has numbers that may be used, or with --fail-on-limit if one failed, is not
    valid (a curve ended behind which nothing is stated, or one vehicle overrode another) or passed a limit; 2 for wrong
    input.
    """
    from trainmj.output.console import Progress
    from trainmj.sweep.screen import print_sweep

    if kind_of_input(scenario) is SCENARIO:
        cases = trainmj.grid_of(scenario, vary, changes=changes)
    else:
        cases = trainmj.load_sweep(scenario, changes)
        if vary:
            raise InputError(f"--vary: the sweep file {scenario} states what is varied: write it there")
    say_notes((*cases.scenario.told, *cases.told))
    if responses is not None:
        cases = replace(cases, responses=parts_of(responses))
    if histories is not None:
        cases = replace(cases, histories=_numbers(histories))
    if parquet:
        from trainmj.sweep.parquet import write_parquet  # says that its package is missing before the work
    progress = Progress(len(cases))
    with progress, going_on(out, fresh, progress.stop), engine_at(dask, cases.scenario) as engine:
        result = trainmj.run_sweep(cases, out, threads=threads, fresh=fresh, engine=engine, progress=progress)
    if parquet:
        write_parquet(out)
    print_sweep(result)
    if cover is not None:
        write(out, cover)
    unusable = result.failed + result.not_valid
    if unusable == result.cases or (fail_on_limit and (unusable or result.past_limits)):
        sys.exit(1)


@click.command()
@click.argument("study", shell_complete=offers(STUDY))
@takes_allowed
@takes_folder
@takes_figures
@takes_report
@takes_json
@takes_time
def study(
    study: str,
    out: Path,
    fresh: bool,
    threads: int,
    figures: tuple[Format, ...],
    figure_width: Width,
    cover: Cover | None,
    as_json: bool,
) -> None:
    """Go from free values to one chosen and verified design.

    STUDY is a study file, or the name of one that ships with trainmj, such as b_type. Each step leaves its tables and
    figures in the folder; the same command goes on where it was stopped, and does again only what has changed.

    Exit code: 0 when done; 1 if the study is not to be trusted: it rests on a surrogate that fits badly, or the chosen
    design, when simulated, is not what was predicted, does not keep its limits, or has no numbers that may be used; 2
    for wrong input.
    """
    kind_of_input(study)
    plan = trainmj.load_study(study)
    say_notes(plan.source.told)
    from trainmj.study import screen

    line = screen.Screen()
    with going_on(out, fresh, line.stop):
        result = trainmj.run_study(
            plan, out, threads=threads, fresh=fresh, watch=line, figures=figures, figure_width=figure_width
        )
    if as_json:
        say_json(result.summary)
    else:
        screen.print_study(result)
    if cover is not None:
        write(out, cover, silent=as_json)
    if not result.summary["trusted"]:
        sys.exit(1)


@click.command()
@click.argument("targets", shell_complete=offers(TARGETS))
@takes_allowed
@takes_folder
@takes_figures
@takes_report
@takes_json
@takes_time
def identify(
    targets: str,
    out: Path,
    fresh: bool,
    threads: int,
    figures: tuple[Format, ...],
    figure_width: Width,
    cover: Cover | None,
    as_json: bool,
) -> None:
    """Find device curves and other values from known responses.

    It looks for values of a scenario with which its responses meet those of a test, a table or another program.

    TARGETS is a targets file, or the name of one that ships with trainmj, such as b_type. The folder gets the values
    found as a scenario, how well the data determine them, and every deviation. The result depends on the file alone:
    whatever stops a search, the same command goes on to the same end.

    Exit code: 0 when done, 1 if a bar that the file states is not kept, 2 for wrong input.
    """
    kind_of_input(targets)
    plan = trainmj.load_targets(targets)
    say_notes(plan.source.told)
    from trainmj.identification import page, screen
    from trainmj.output.page import REPORT

    line = screen.Screen()
    with going_on(out, fresh, line.stop):
        found = trainmj.identify(
            plan,
            out,
            threads=threads,
            fresh=fresh,
            watch=line.watch,
            progress=line.trials,
            figures=figures,
            figure_width=figure_width,
        )
    if cover is not None:
        page.page_of(found, page.command_of(targets, found)).headed(cover).write(out / REPORT)
    if as_json:
        say_json(found.summary)
    else:
        screen.print_found(found)
    if not found.kept:
        sys.exit(1)
