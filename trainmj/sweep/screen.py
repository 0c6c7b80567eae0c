"""What ``trainmj sweep`` prints when it is done."""

from __future__ import annotations

from trainmj.output.console import new_console
from trainmj.sweep.run import SweepResult


def print_sweep(result: SweepResult) -> None:
    """How many cases there are, how many failed, and the first of these."""
    cases = f"{result.cases} case{'s' if result.cases > 1 else ''}"
    there = result.cases - result.computed
    if result.computed:
        rate = f"{result.seconds:.1f} s, {result.computed / result.seconds:.0f} collisions a second"
        said = f"{cases}{f' ({there} were there)' if there else ''}, {result.failed} failed, {rate}"
    else:
        said = f"All {cases} were there, {result.failed} failed"
    first = f"\nThe first that failed: {result.first_failure}" if result.first_failure else ""
    new_console().print(f"{said}; written to {result.folder}{first}", soft_wrap=True)
