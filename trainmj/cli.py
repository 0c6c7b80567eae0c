"""The command line: ``trainmj run b_type --set speed_km_h=25 --out results``.

Heavy imports come late, inside the commands, so that help answers at once.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from trainmj.errors import InputError, OutputError, TrainmjError

if TYPE_CHECKING:
    from trainmj.scenario import Scenario
    from trainmj.sweep.plan import Plan
    from trainmj.sweep.run import Engine

F = TypeVar("F", bound=Callable[..., Any])

_SET_HELP = "Change a value: a parameter of the scenario (mass_t=33) or a path (collision.gap_mm=50). May be repeated."


class _Group(click.Group):
    """Errors that trainmj raises on purpose end in one message and exit code 2, never in a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except TrainmjError as error:
            click.echo(f"Error: {error}", err=True)
            sys.exit(2)
        except BrokenPipeError:
            sys.stderr.close()  # the reader of our output has gone; nobody is left to tell
            sys.exit(0)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="trainmj")
def main() -> None:
    """Train collisions on a straight track, computed with MuJoCo.

    SCENARIO is a YAML file, or the name of one that ships with trainmj: see `trainmj scenarios`.
    """


def _takes_scenario(function: F) -> F:
    """The argument SCENARIO and the option --set."""
    function = click.option("--set", "changes", multiple=True, metavar="PATH=VALUE", help=_SET_HELP)(function)
    return click.argument("scenario")(function)


@main.command()
@_takes_scenario
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for the result, tables and figure; made if needed."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def run(scenario: str, changes: tuple[str, ...], out: Path | None, as_json: bool) -> None:
    """Compute one collision and print its interfaces, vehicles, criteria and balances.

    Exit code: 0 when computed (the status says how it ended), 1 if unstable, 2 for wrong input.
    """
    loaded = _load(scenario, changes)
    if out is not None:
        _make_folder(out)
    from trainmj import terminal
    from trainmj.metrics import summarise
    from trainmj.simulation import run as simulate

    result = simulate(loaded)
    summary = summarise(result)
    if out is not None:
        from trainmj.output import write_run

        write_run(result, summary, out)
    if as_json:
        click.echo(json.dumps(_finite(summary.as_dict()), indent=2))
    else:
        terminal.print_summary(loaded, summary)
        if out is not None:
            click.echo(f"Written to {out}{'' if str(out).endswith('/') else '/'}")
    if summary.status.startswith("unstable"):
        sys.exit(1)


@main.command()
@_takes_scenario
def check(scenario: str, changes: tuple[str, ...]) -> None:
    """Check a scenario and print what would run, without running it."""
    loaded = _load(scenario, changes)
    from trainmj import terminal
    from trainmj.chain import line_up
    from trainmj.simulation import check_step

    chain = line_up(loaded)
    terminal.print_chain(loaded, chain)
    check_step(chain)


@main.command()
@_takes_scenario
@click.option("--out", type=click.Path(path_type=Path), help="MJCF file to write; without it the text is printed.")
def export(scenario: str, changes: tuple[str, ...], out: Path | None) -> None:
    """Write the MuJoCo model of a scenario as MJCF, which MuJoCo's own viewer opens."""
    loaded = _load(scenario, changes)
    from trainmj import model
    from trainmj.chain import line_up

    text = model.export(line_up(loaded), loaded.title)
    if out is None:
        click.echo(text)
    else:
        model.write(text, out)


@main.command()
def schema() -> None:
    """Print the JSON schema of scenario files, for editors."""
    from trainmj.scenario import schema as scenario_schema

    click.echo(json.dumps(scenario_schema(), indent=2))


@main.command()
def scenarios() -> None:
    """List the scenarios that ship with trainmj."""
    from trainmj import terminal
    from trainmj.scenario import load, shipped

    terminal.print_scenarios({name: load(name) for name in shipped()})


@main.command()
@click.argument("scenario")
@click.option("--set", "changes", multiple=True, metavar="PATH=VALUE", help=_SET_HELP)
@click.option(
    "--vary",
    multiple=True,
    metavar="PATH=VALUES",
    help="Vary a value: FROM:TO:COUNT (20:50:9) or a list (30,33,36). Several make a full grid.",
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results; made if needed.")
@click.option(
    "--resume", is_flag=True, help="Go on with the sweep in the folder; finished cases are not computed again."
)
@click.option("--threads", type=click.IntRange(0, 1024), default=0, help="Native threads; all cores by default.")
@click.option(
    "--responses", metavar="NAMES", help="Columns wanted, with commas between; * stands for any part of a name."
)
@click.option("--histories", metavar="NUMBERS", help="Numbers of cases (from 0) whose histories are kept as NetCDF.")
@click.option("--dask", metavar="ADDRESS", help="Compute on a Dask cluster: its scheduler's address, or 'local'.")
@click.option("--parquet", is_flag=True, help="Write results.parquet too.")
def sweep(
    scenario: str,
    changes: tuple[str, ...],
    vary: tuple[str, ...],
    out: Path,
    resume: bool,
    threads: int,
    responses: str | None,
    histories: str | None,
    dask: str | None,
    parquet: bool,
) -> None:
    """Compute many cases of a scenario and store one row of responses for each.

    SCENARIO may also be a sweep file, which states the cases itself. Results are kept as they come, in
    results.sqlite and at the end results.csv; whatever stops a sweep, --resume goes on.
    """
    from trainmj import terminal
    from trainmj.sweep import plan
    from trainmj.sweep.run import run_sweep

    new = dict(_change(text) for text in changes)
    if plan.is_sweep_file(scenario):
        if vary:
            raise InputError(f"--vary: the sweep file {scenario} states what is varied: write it there")
        cases = plan.load_plan(scenario, new)
    else:
        cases = plan.plan_of(_load(scenario, changes), dict(_variation(text) for text in vary))
    if responses is not None:
        cases = replace(cases, responses=tuple(part.strip() for part in responses.split(",")))
    if histories is not None:
        cases = replace(cases, histories=tuple(_numbers(histories)))
    write_parquet = _parquet_writer() if parquet else None
    with terminal.progress(len(cases)) as progress, _engine(dask, cases) as engine:
        try:
            outcome = run_sweep(cases, out, threads, resume, engine, progress)
        except KeyboardInterrupt:
            progress.stop()
            click.echo(f"Stopped. What was finished is in {out}; the same command with --resume goes on.", err=True)
            sys.exit(130)
    if write_parquet is not None:
        write_parquet(out)
    terminal.print_outcome(outcome)


def _variation(text: str) -> tuple[str, str]:
    path, equals, values = text.partition("=")
    if not (equals and path.strip() and values.strip()):
        raise InputError(f"--vary {text}: must be PATH=VALUES, as in --vary mass_t=30,33,36")
    return path.strip(), values.strip()


def _numbers(text: str) -> list[int]:
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise InputError(f"--histories {text}: must be whole numbers with commas between, as in 0,17")
    return [int(part) for part in parts]


def _engine(dask: str | None, cases: Plan) -> AbstractContextManager[Engine | None]:
    if dask is None:
        return nullcontext()
    from trainmj.sweep.cluster import connected

    return connected(dask, cases)


def _parquet_writer() -> Callable[[Path], None]:
    """The writer, asked for before the work so that a missing package is not found out at the end."""
    from trainmj.sweep.parquet import write_parquet

    return write_parquet


def _load(scenario: str, changes: tuple[str, ...]) -> Scenario:
    from trainmj.scenario import load

    return load(scenario, dict(_change(text) for text in changes))


def _change(text: str) -> tuple[str, Any]:
    """A path and its value, read as YAML reads it, from PATH=VALUE."""
    path, equals, value = text.partition("=")
    if not (equals and path.strip() and value.strip()):
        raise InputError(f"--set {text}: must be PATH=VALUE, as in --set mass_t=33")
    from trainmj.scenario.files import read_value

    return path.strip(), read_value(value, f"--set {text}")


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"--out {out}: cannot be made a folder ({error.strerror})") from None


def _finite(value: Any) -> Any:
    """The same with None for numbers that JSON cannot hold."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value


if __name__ == "__main__":
    main()
