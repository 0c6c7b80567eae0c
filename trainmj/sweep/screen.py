"""What ``trainmj sweep`` prints when it is done."""

from __future__ import annotations

from trainmj.output.console import new_console
from trainmj.sweep.run import Outcome


def print_outcome(outcome: Outcome) -> None:
    """The last line of a sweep."""
    cases = f"{outcome.cases} case{'s' if outcome.cases > 1 else ''}"
    there = outcome.cases - outcome.computed
    if not outcome.computed:
        said = f"All {cases} were there, {outcome.failed} failed"
    else:
        rate = outcome.computed / outcome.seconds
        said = f"{cases}{f' ({there} were there)' if there else ''}, {outcome.failed} failed, "
        said += f"{outcome.seconds:.1f} s, {rate:.0f} collisions a second"
    lines = [f"{said}; written to {outcome.folder}"]
    if outcome.first_failure:
        lines.append(f"The first that failed: {outcome.first_failure}")
    for line in lines:
        new_console().print(line, markup=False, soft_wrap=True)
