"""What ``trainmj sweep`` prints when it is done."""

from __future__ import annotations

from trainmj.output.console import new_console
from trainmj.sweep.run import SweepResult


def print_sweep(result: SweepResult) -> None:
    """The last line of a sweep."""
    cases = f"{result.cases} case{'s' if result.cases > 1 else ''}"
    there = result.cases - result.computed
    if not result.computed:
        said = f"All {cases} were there, {result.failed} failed"
    else:
        rate = result.computed / result.seconds
        said = f"{cases}{f' ({there} were there)' if there else ''}, {result.failed} failed, "
        said += f"{result.seconds:.1f} s, {rate:.0f} collisions a second"
    lines = [f"{said}; written to {result.folder}"]
    if result.first_failure:
        lines.append(f"The first that failed: {result.first_failure}")
    for line in lines:
        new_console().print(line, markup=False, soft_wrap=True)
