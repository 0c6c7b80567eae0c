"""The command run: one collision."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.options import (
    parts_of,
    say,
    say_json,
    takes_fail_on_limit,
    takes_figures,
    takes_json,
    takes_scenario,
    takes_time,
    with_set,
)
from trainmj.cli.report import takes_report
from trainmj.errors import InputError

if TYPE_CHECKING:
    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary
    from trainmj.files.cover import Cover
    from trainmj.output.style import Format, Width
    from trainmj.scenario import Scenario


@click.command()
@takes_scenario
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for the result, tables and figure; made if needed."
)
@takes_figures
@takes_report
@click.option(
    "--converge", "with_steps", is_flag=True, help="Halve the step until TS and TAMA settle, and say what it changes."
)
@click.option(
    "--responses",
    metavar="NAMES",
    help="With --converge: what is to settle, as columns with commas between; * stands for any part of a name.",
)
@click.option(
    "--margin",
    "with_margin",
    is_flag=True,
    help="In the vertical plane: how much of their capacity the ties of faces need to hold, and say what is to spare.",
)
@click.option(
    "--slip",
    type=float,
    metavar="MM",
    help="With --margin: slip up to which engaged faces hold; 10 mm by default.",
)
@takes_fail_on_limit
@takes_json
@takes_time
def run(
    scenario: str,
    changes: dict[str, Any],
    out: Path | None,
    figures: tuple[Format, ...],
    figure_width: Width,
    cover: Cover | None,
    with_steps: bool,
    responses: str | None,
    with_margin: bool,
    slip: float | None,
    fail_on_limit: bool,
    as_json: bool,
) -> None:
    """Compute one collision.

    Prints criteria, limits, interfaces, vehicles and balances. SCENARIO may also be a saved result, or the folder of
    one: it is computed again and compared, number by number.

    Exit code: 0 when computed (the status says how it ended); 1 if the numbers may not be used: unstable, or not valid
    as a curve ended behind which nothing is stated, or one vehicle overrode another; 1 also if a repeated result
    differs from the saved one, if the responses do not settle as the step is halved, or with --fail-on-limit if a limit
    was passed, by any of a bracket of ties too, of which an override counts as well; 2 for wrong input.
    """
    if cover is not None and out is None:
        raise InputError("--report: needs --out, the folder to write report.html into")
    if responses is not None and not with_steps:
        raise InputError("--responses: needs --converge, which settles them")
    if slip is not None and not with_margin:
        raise InputError("--slip: needs --margin, which looks for it")
    from trainmj.collision.saved import FILE, find_result

    saved = find_result(scenario)
    before = None if saved is None else _load_saved(saved, changes, out)
    loaded = with_set(scenario, changes) if before is None else before.scenario
    from trainmj.collision.status import PAST_LIMITS
    from trainmj.single import screen
    from trainmj.single.beside import Beside

    if out is not None:
        from trainmj.files.folder import filling
        from trainmj.single.folder import OWN, write_run

        click.get_current_context().with_resource(filling(out, OWN, loaded.files))
    steps = None
    if with_steps:
        steps = trainmj.converge(loaded) if responses is None else trainmj.converge(loaded, parts_of(responses))
    margins = None
    if with_margin:
        margins = trainmj.margins(loaded) if slip is None else trainmj.margins(loaded, slip)
    result = trainmj.run(loaded)
    again = None if before is None else trainmj.repeated(before, result)
    summary = trainmj.summarise(result)
    asked = loaded.bracket and result.chain.plane
    beside = Beside(_bracketed(loaded, summary) if asked else (), margins)
    if out is not None:
        write_run(result, summary, out, figures, figure_width, beside)
        if cover is not None:
            from trainmj.output.page import REPORT
            from trainmj.single.page import page_of_run

            page_of_run(result, summary, out / FILE, beside).headed(cover).write(out / REPORT)
    if as_json:
        more = ({"repeated": again.as_dict()} if again else {}) | ({"convergence": steps.as_dict()} if steps else {})
        more |= beside.rows()
        say_json(summary.as_dict() | more)
    else:
        screen.print_summary(result, summary, beside)
        screen.print_beside(result.chain, beside)
        if steps is not None:
            screen.print_convergence(steps)
        if again is not None:
            say(str(again))
        if out is not None:
            say(f"Written to {out}/" + (f"; open {out / REPORT}" if cover is not None else ""))
    differs, drifts = again is not None and not again.same, steps is not None and not steps.settled
    past_limits = fail_on_limit and (summary.status.kind in PAST_LIMITS or beside.past_limits)
    if summary.status.unusable or differs or drifts or past_limits:
        sys.exit(1)


def _bracketed(scenario: Scenario, stated: Summary) -> tuple[dict[str, Any], ...]:
    """A row for each of the ties of a bracket, of which those stated are known."""
    from trainmj.collision.bracket import rows_of

    return tuple(rows_of(trainmj.bracket(scenario, stated)))


def _load_saved(file: Path, changes: dict[str, Any], out: Path | None) -> Result:
    """The result that is computed again."""
    if changes:
        raise InputError(f"--set: a result is computed again as it was: change its scenario, beside {file}, instead")
    if out is not None and out.resolve() == file.parent.resolve():
        raise InputError(f"--out {out}: has the result that is computed again: take another folder")
    return trainmj.load_result(file)
