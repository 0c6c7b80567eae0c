"""Which cases a sweep computes: load cases, grids, lists that go together, tables and random samples.

The number of a case depends on the sweep alone, so a sweep can stop, go on, and be spread over machines.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trainmj.cases.effect import idle, idle_held, refuse
from trainmj.cases.load_cases import LoadCase, in_case, scenarios_of, within
from trainmj.cases.rows import STATUS
from trainmj.collision.cases import AT_ONCE, Cases
from trainmj.collision.quantities import BALANCE, COLLISION, TRAIN
from trainmj.errors import InputError
from trainmj.files.arguments import given, group_given, listed
from trainmj.files.kinds import SWEEP
from trainmj.files.resources import find_file
from trainmj.files.shown import Shown
from trainmj.files.source import Source, plain, source_of
from trainmj.files.tables import Table, TablePlace, read_beside
from trainmj.files.text import FORMULA, HIDDEN, Folders, allowing, is_formula
from trainmj.files.yaml import read_value, read_yaml
from trainmj.scenario import Scenario, scenario_given
from trainmj.scenario.files import nowhere
from trainmj.sweep.file import MAX_VALUES, Span, SweepFile, broken_rules

MAX_CASES = 10_000_000
LOAD_CASE = "load_case"
"""The column that says of which load case a row is."""

LOAD_CASES = "load_cases"
"""Under which a store has the titles of load cases by name."""

_RESULTS = {"case", LOAD_CASE, *STATUS, *(q.head_of() for q in (*TRAIN, *COLLISION, *BALANCE) if q.column)}
_WORD = 2**63  # larger whole numbers do not fit into an SQLite file
_SHORT = 60  # characters of values that are kept in full


@dataclass(frozen=True)
class Sweep(Shown):
    """A scenario and its numbered cases.

    Attributes:
        scenario: what the cases vary; with load cases, that of the first of them.
        blocks: tables whose rows are combined, each with lists of equal length by name; the last varies fastest.
        responses: patterns of the columns wanted.
        histories: numbers of cases whose histories are kept.
        seed: of the random sample; None if there is none.
        load_cases: scenarios by name, each of which is combined with all that is varied; empty if there are none.
        titles: what load cases are, in words, by their names.
        read: the files that it was read from, besides those of the scenario.
        told: what there is to know of how they were read, in words.

    Raises:
        InputError: if a name or value is wrong, there are too many cases, or one asked for does not exist.
    """

    scenario: Scenario
    blocks: tuple[Mapping[str, Sequence[Any]], ...]
    responses: tuple[str, ...] = ("*",)
    histories: tuple[int, ...] = ()
    seed: int | None = None
    load_cases: Mapping[str, Scenario] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    read: frozenset[Path] = field(default=frozenset(), repr=False)
    told: tuple[str, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        """Check names, values and numbers."""
        given(self.scenario, Scenario)
        if not self.crossed:
            raise InputError(
                "nothing is varied: give --vary, or vary, together, cases, table or sample in the sweep file"
            )
        double = [name for name, count in Counter(map(str.casefold, self.names)).items() if count > 1]
        if double:  # SQLite ignores the case of letters in column names
            raise InputError(f"{min(double)}: is varied twice")
        for case, scenario in self.scenarios.items():
            with within(case):
                if pair := given(scenario, Scenario).twice(self.names):
                    raise InputError(f"{pair[0]} and {pair[1]} set the same value: vary one of them")
        for name in self.names:
            if name in _RESULTS:
                raise InputError(f"{name}: is a column of the results: give the parameter another name")
        for block in self.blocks:
            for name, values in block.items():
                _check_values(name, values)
        count = math.prod(map(_length, self.crossed))  # may be more than len() can give
        if count > MAX_CASES:
            shown = str(count) if count < _WORD else f"2^{count.bit_length() - 1} or more"
            raise InputError(f"the sweep has {shown} cases, more than {MAX_CASES}")
        late = [n for n in self.histories if n >= len(self)]
        if late:
            raise InputError(f"histories: there is no case {late[0]}; the last is {len(self) - 1}")
        refuse(idle(self.scenarios.values(), self.blocks))

    def __repr__(self) -> str:
        """How many cases, of what, and what varies."""
        cases = f"{len(self)} case{'s' if len(self) > 1 else ''}"
        varied = ", ".join(name for block in self.crossed for name in block)
        return f"<Sweep {cases} of {self.scenario.heading}: {varied}>"

    def __len__(self) -> int:
        """How many cases there are."""
        return math.prod(map(_length, self.crossed))

    @property
    def scenarios(self) -> Mapping[str, Scenario]:
        """The scenarios of the cases by load case; under no name, "", if there are no load cases."""
        return self.load_cases or {"": self.scenario}

    @property
    def crossed(self) -> tuple[Mapping[str, Sequence[Any]], ...]:
        """The names of load cases, if there are any, and the blocks: what is combined."""
        return ({LOAD_CASE: list(self.load_cases)}, *self.blocks) if self.load_cases else self.blocks

    def columns(self, numbers: NDArray[np.int64]) -> dict[str, list[Any]]:
        """The values of the cases of these numbers (n,), from 0, by name; under "load_case" those of the load cases."""
        columns: dict[str, list[Any]] = {}
        for block in reversed(self.crossed):
            numbers, rows = np.divmod(numbers, _length(block))
            places = rows.tolist()
            columns = {name: [values[row] for row in places] for name, values in block.items()} | columns
        return columns

    def case(self, number: int) -> dict[str, Any]:
        """The values of the case of a number, from 0, under "load_case" that of the load case."""
        return {name: value for name, (value,) in self.columns(np.array([number])).items()}

    def cases(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """Number and values of every case."""
        return ((n, self.case(n)) for n in range(len(self)))

    def by_scenario(self, there: NDArray[np.bool_]) -> Iterator[tuple[Scenario, Iterator[Cases]]]:
        """The scenario of each load case with its cases, but for those that are there, (n_case,)."""
        each = len(self) // len(self.scenarios)
        for k, scenario in enumerate(self.scenarios.values()):
            yield scenario, self._missing(k * each, there[k * each : (k + 1) * each])

    def _missing(self, begin: int, there: NDArray[np.bool_]) -> Iterator[Cases]:
        """The cases from a number on that are not there, some at a time."""
        names = tuple((name,) for name in self.names)
        for first in range(0, len(there), AT_ONCE):
            numbers = begin + first + np.flatnonzero(~there[first : first + AT_ONCE])
            if numbers.size:
                columns = self.columns(numbers)
                yield Cases(numbers.tolist(), names, [columns[name] for name in self.names])

    def scenario_of(self, number: int) -> Scenario:
        """The scenario of a case, with its values.

        Raises:
            InputError: if it breaks a rule.
        """
        changes = self.case(number)
        return self.scenarios[changes.pop(LOAD_CASE, "")].with_values(changes)

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied in the scenarios: parameters and paths."""
        return tuple(name for block in self.blocks for name in block)

    @property
    def files(self) -> frozenset[Path]:
        """The files that it was read from."""
        return self.read.union(*(scenario.files for scenario in self.scenarios.values()))

    @property
    def inputs(self) -> dict[str, Any]:
        """What the rows depend on besides the scenario: the values, how they are combined, and the columns."""
        return {
            "values": {name: _in_words(values) for block in self.crossed for name, values in block.items()},
            "blocks": [list(block) for block in self.crossed],
            "responses": ", ".join(self.responses),
        }


def grid_of(
    scenario: Scenario | str | Path,
    vary: Mapping[str, Any],
    responses: Sequence[str] = ("*",),
    histories: Sequence[int] = (),
    changes: Mapping[str, Any] | None = None,
) -> Sweep:
    """The sweep of a full grid.

    Args:
        scenario: what the cases vary, or the path of its file.
        vary: values by parameter or path: one, a list, or text as after ``--vary`` ("20:50:9" or "30,33,36").
        responses: columns wanted, as names or patterns.
        histories: numbers of cases whose histories are kept.
        changes: values changed in every case.

    Raises:
        InputError: if a name or value is wrong.
    """
    varied = plain(group_given(vary)).items()
    blocks = tuple({name: grid_values(values, f"vary {name}={values}")} for name, values in varied)
    scenario = scenario_given(scenario)
    scenario = scenario.with_values(changes) if changes else scenario
    return _fixed(Sweep(scenario, blocks, listed(responses), tuple(histories)), changes or {}, {})


def _fixed(sweep: Sweep, fixed: Mapping[str, Any], cases: Mapping[str, LoadCase]) -> Sweep:
    """The same sweep, if what is set for all its cases or a load case is not varied, too, and has an effect.

    Args:
        sweep: to be checked.
        fixed: what is set for every case.
        cases: its load cases.
    """
    for case, scenario in sweep.scenarios.items():
        places = dict.fromkeys(fixed, "for every case")
        places |= dict.fromkeys(cases[case].set if case else (), f"in load case {case}")
        for name in sweep.names:
            lost = next((other for other in places if scenario.covers(name, other)), None)
            if lost is not None:
                same = "" if name == lost else f", as {lost},"
                raise InputError(f"{name}: is varied, and set{same} {places[lost]}: leave one of them out")
        with within(case):
            refuse(idle_held([scenario], cases[case].set if case else {}, sweep.blocks))
    refuse(idle_held(sweep.scenarios.values(), fixed, sweep.blocks))
    return sweep


def grid_values(values: Any, said: str) -> list[Any]:
    """The values of one name in a grid, from one, a list or text such as "20:50:9" or "30,33,36"; said is its place."""
    if not isinstance(values, str):
        return list(values) if isinstance(values, Iterable) and not isinstance(values, Mapping) else [values]
    if ":" in values:
        parts = (read_value(part, said) for part in values.split(":"))
        try:
            return Span.model_validate(dict(zip(("from", "to", "count"), parts, strict=True))).values()
        except ValueError:
            raise InputError(
                f"{said}: must be FROM:TO:COUNT, two numbers and a whole number from 2 to {MAX_VALUES}, as in 20:50:9"
            ) from None
    if not all(part.strip() for part in values.split(",")):
        raise InputError(f"{said}: must be values separated by commas, as in 30,33,36")
    return [read_value(part, said) for part in values.split(",")]


def load_sweep(file: str | Path, changes: Mapping[str, Any] | None = None, *, allow_folder: Folders = ()) -> Sweep:
    """Read a sweep file.

    Args:
        file: path of the YAML file.
        changes: values changed in every case; they come after those of the file.
        allow_folder: in which, or below which, input files may name files besides their own folder; one or several.

    Raises:
        InputError: with file, line, key, value and rule.
    """
    with allowing(allow_folder):
        return _checked(read_yaml(find_file(file, SWEEP.ending, "sweep")), changes or {})


def sweep_of(values: Mapping[str, Any], folder: str | Path = ".") -> Sweep:
    """Make a sweep from plain values, with the keys of a sweep file.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where the files that it names are.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    return _checked(source_of(values, folder), {})


def _checked(source: Source, changes: Mapping[str, Any]) -> Sweep:
    spec = source.checked(SweepFile)
    source.refuse(broken_rules(spec))
    cases, table = spec.load_cases(), spec.table_at()
    scenarios = scenarios_of(source, spec)
    varied: dict[tuple[str, ...], Iterable[str]] = {("vary",): spec.vary, ("together",): spec.together}
    varied |= {("sample", "factors"): spec.sample.factors} if spec.sample else {}
    places = [((*at, name), name) for at, names in varied.items() for name in names]
    for case, scenario in scenarios.items():
        source.refuse(in_case(case, nowhere(places, scenario)))
    blocks: list[Mapping[str, Sequence[Any]]] = []
    for name, grid in spec.vary.items():
        said = source.said("vary", name)
        blocks.append({name: grid.values() if isinstance(grid, Span) else grid_values(grid, said)})
    if spec.together:
        blocks.append(spec.together)
    if table is not None:
        found = _table(source, *table, scenarios)
        blocks.append(found.columns)
        name = table[1] if isinstance(table[1], str) else table[1].file
        source = source.reading(name, told=[found.note] * bool(found.note))
    if spec.sample is not None:
        blocks.append(spec.sample.columns())
    try:
        for case, scenario in scenarios.items():
            scenarios[case] = _on_top(changes, scenario, case, cases[case].set if case else ())
        sweep = Sweep(
            next(iter(scenarios.values())),
            tuple(blocks),
            tuple(spec.responses),
            tuple(spec.histories),
            spec.sample.seed if spec.sample else None,
            scenarios if cases else {},
            {name: case.title for name, case in cases.items()},
            source.files,
            source.told,
        )
        return _fixed(sweep, {**spec.set, **changes}, cases)
    except InputError as error:
        if () not in source.origins:
            raise
        raise InputError(f"{source.origins[()]}: {error}") from None


def _on_top(changes: Mapping[str, Any], scenario: Scenario, case: str, own: Iterable[str]) -> Scenario:
    """The scenario of a load case with changes for every case, none of which may undo its own ones."""
    own = list(own)
    with within(case):
        for name in changes:
            if any(scenario.covers(name, other) for other in own):
                raise InputError(
                    f"{name}: is set for every case and in a load case, which it would undo: change it there"
                )
        return scenario.with_values(changes) if changes else scenario


def _table(source: Source, key: str, place: str | TablePlace, scenarios: Mapping[str, Scenario]) -> Table:
    """A table of cases; what takes numbers in a scenario must have them."""
    said = source.said(key, *(["file"] if isinstance(place, TablePlace) else []))

    def unit(name: str) -> str | None:
        return next((u for each in scenarios.values() if (u := each.unit(name)) is not None), None)

    table = read_beside(source.folder, place, said, unit)
    try:
        for head in table.columns:
            for case, scenario in scenarios.items():
                with within(case):
                    if scenario.takes_numbers(head):
                        table.numbers(head)
            for row, cell in enumerate(table.column(head)):
                if cell == "" or cell != cell:
                    raise table.refusal(row, head, "is empty")
    except InputError as error:
        raise InputError(f"{said}: {error}") from None
    return table


def _check_values(name: str, values: Sequence[Any]) -> None:
    """Refuse values that the store cannot hold, or that a spreadsheet would take for formulas."""
    for value in values:
        if isinstance(value, int) and not -_WORD <= value < _WORD:
            raise InputError(f"{name} = {str(value)[:30]}...: is too large")
        if isinstance(value, str) and (is_formula(value) or HIDDEN.search(value)):
            raise InputError(
                f"{name} = {ascii(value)[:60]}: must be printable text that does not begin with {' '.join(FORMULA)}, "
                "which a spreadsheet takes for a formula"
            )


def _in_words(values: Sequence[Any]) -> str:
    """Values in full if they are few, otherwise their number and a hash."""
    text = json.dumps(list(values), default=str)
    return text if len(text) <= _SHORT else f"{len(values)} values {sha256(text.encode()).hexdigest()[:12]}"


def _length(block: Mapping[str, Sequence[Any]]) -> int:
    return len(next(iter(block.values())))
