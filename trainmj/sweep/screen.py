"""What ``trainmj sweep`` prints when it is done."""

from __future__ import annotations

from trainmj.output.console import new_console
from trainmj.sweep.run import Outcome


def print_outcome(outcome: Outcome) -> None:
    """The last line of a sweep."""
    there = outcome.cases - outcome.computed
    rate = outcome.computed / outcome.seconds if outcome.seconds > 0 else 0.0
    console = new_console()
    cases = f"{outcome.cases} case{'s' if outcome.cases > 1 else ''}" + (f" ({there} were there)" if there else "")
    console.print(
        f"{cases}, {outcome.failed} failed, {outcome.seconds:.1f} s, {rate:.0f} collisions a second; "
        f"written to {outcome.folder}",
        markup=False,
        soft_wrap=True,
    )
    if outcome.first_failure:
        console.print(f"The first that failed: {outcome.first_failure}", markup=False, soft_wrap=True)
