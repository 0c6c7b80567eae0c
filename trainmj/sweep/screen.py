"""What ``trainmj sweep`` prints when it is done."""

from __future__ import annotations

from trainmj.output.console import new_console
from trainmj.sweep.run import SweepResult


def print_sweep(result: SweepResult) -> None:
    """How many cases there are, how many failed or passed a limit, and the first of these."""
    cases = f"{result.cases} case{'s' if result.cases > 1 else ''}"
    there = result.cases - result.computed
    ends = f"{result.failed} failed, {result.past_limits} past a limit"
    if result.computed:
        rate = f"{result.seconds:.1f} s, {result.computed / result.seconds:.0f} collisions a second"
        said = f"{cases}{f' ({there} were there)' if there else ''}, {ends}, {rate}"
    else:
        said = f"All {cases} were there, {ends}"
    firsts = {"failed": result.first_failure, "passed a limit": result.first_past_limits}
    lines = [f"{said}; written to {result.folder}", *(f"The first that {k}: {v}" for k, v in firsts.items() if v)]
    new_console().print("\n".join(lines), soft_wrap=True)
