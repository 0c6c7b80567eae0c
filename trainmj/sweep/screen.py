"""What is printed of a sweep: what would run, and how it went."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rich.text import Text

from trainmj.cases.origin import stated
from trainmj.cases.reader import read_sweep
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import Column as Response
from trainmj.collision.quantities import columns_of, fitting
from trainmj.errors import InputError
from trainmj.output.console import new_console, print_table, print_verdict
from trainmj.output.table import Column, Table, worded
from trainmj.scenario import from_yaml
from trainmj.sweep.outcome import say_coarse, tables_of, where_kept
from trainmj.sweep.plan import Sweep
from trainmj.sweep.run import SweepResult, check_responses

_TRIED = 1000  # cases that are checked
_LISTED = 40  # characters of values that are listed
_MOST_LISTED = 8  # of them
_MOST_LOOKED_THROUGH = 5000  # cases, for where limits are kept


def print_plan(sweep: Sweep) -> None:
    """What a sweep would compute: its cases, what they vary, and how many of them break a rule."""
    check_responses(sweep)
    console = new_console()
    console.print(Text(f"Sweep: {len(sweep)} case{'s' * (len(sweep) > 1)}", style="bold"))
    for table in tables_of_plan(sweep):
        print_table(console, table)
    tried = min(len(sweep), _TRIED)
    refused: list[str] = []
    columns: dict[str, Response] = {}
    for number in range(tried):
        try:
            columns |= columns_of(line_up(sweep.scenario_of(number)))
        except InputError as error:
            refused.append(f"case {number}: {error}")
    if columns:
        kept = len(fitting(sweep.responses, columns))
        console.print(f"Responses: {kept} of {len(columns)}", soft_wrap=True)
    if sweep.histories:
        console.print(f"Histories: of the cases {', '.join(map(str, sweep.histories))}", soft_wrap=True)
    for note in sweep.told:
        console.print(f"Note: {note}", soft_wrap=True, markup=False)
    if refused:
        said = f"Note: {len(refused)} of {tried} cases would be refused; the first, {refused[0]}"
    else:
        said = f"{'All' if tried == len(sweep) else f'The first {tried}'} cases keep the rules of a scenario."
    console.print(said, soft_wrap=True)


def tables_of_plan(sweep: Sweep) -> list[Table]:
    """The load cases of a sweep, and what it varies."""
    tables = [_load_cases(sweep)] if sweep.load_cases else []
    return [*tables, _varied(sweep)] if sweep.blocks else tables


def _load_cases(sweep: Sweep) -> Table:
    """The load cases of a sweep, each with what collides there."""
    rows = [(name, sweep.titles.get(name, ""), scenario.subject) for name, scenario in sweep.load_cases.items()]
    note = "All that varies is combined with each." if sweep.blocks else ""
    return Table(worded("Load case", "what it is", "what collides"), rows, note=note)


def _varied(sweep: Sweep) -> Table:
    """What a sweep varies; values in one row of a table or sample go together, all others are combined."""
    several = [block for block in sweep.blocks if len(block) > 1]
    columns = [*worded("Varied"), Column("values"), *worded("which")]
    rows: list[list[Any]] = [
        [name, len(values), _listed(values)] for block in sweep.blocks for name, values in block.items()
    ]
    together = [", ".join(block) for block in several]
    note = f"These vary together: {'; '.join(together)}." if together else ""
    return Table(columns, rows, note=note)


def _listed(values: Sequence[Any]) -> str:
    """Values in full if they are few; otherwise the lowest and the highest number, or the first of them."""
    try:
        different = sorted(set(values)) if len(values) > _MOST_LISTED else list(dict.fromkeys(values))
        numbers = all(isinstance(value, (int, float)) for value in different)
    except TypeError:  # lists, or numbers and text
        different, numbers = list(values), False
    texts = [f"{value:g}" if isinstance(value, float) else str(value) for value in different[:_MOST_LISTED]]
    whole = ", ".join(texts)
    if len(different) <= _MOST_LISTED and len(whole) <= _LISTED:
        return whole
    return f"{different[0]:g} to {different[-1]:g}" if numbers else f"{whole[:_LISTED]}..."


def print_sweep(result: SweepResult) -> None:
    """How the cases ended, which are the first that failed or passed a limit, and where limits are kept."""
    console = new_console()
    print_verdict(console, result.verdict)
    for text in said_of_result(result):
        console.print(Text(text), soft_wrap=not console.is_terminal)
    for table in tables_of_result(result):
        console.print()
        print_table(console, table)
    console.print(f"Written to {result.folder}", soft_wrap=True)  # a path stays whole


def said_of_result(result: SweepResult) -> Iterator[str]:
    """How many cases were computed and how fast; the first of each kind that the verdict does not name."""
    cases = f"{result.cases} case{'s' if result.cases > 1 else ''}"
    there = result.cases - result.computed
    if result.computed:
        rate = f"{result.seconds:.1f} s, {result.computed / result.seconds:.0f} collisions a second"
        yield f"{cases}{f' ({there} were there)' if there else ''}, {rate}"
    else:
        yield f"All {cases} were there"
    firsts = {
        "failed": result.first_failure,
        "is not valid": result.first_not_valid,
        "passed a limit": result.first_past_limits,
    }
    yield from (f"The first that {k}: {v}" for k, v in firsts.items() if v and v not in result.verdict.text)
    if result.coarse:
        yield say_coarse(result.coarse, result.cases)


def tables_of_result(result: SweepResult) -> list[Table]:
    """From where to where limits are kept, if they are not everywhere; how load cases ended, if there are any."""
    found = [] if result.outcome is None else tables_of(result.outcome)
    if not result.all_kept and result.cases <= _MOST_LOOKED_THROUGH:
        table, about = read_sweep(result.folder)
        limits = {} if result.outcome else from_yaml(about["scenario"]).limits
        kept = where_kept(table, stated(about, "varied") or [], limits)
        return [*([kept] if kept else []), *found]
    return found
