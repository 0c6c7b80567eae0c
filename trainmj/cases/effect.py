"""Values that are varied without effect, as others take their place: the chain is the same whatever they are.

Nothing is known here of which value goes before which. Chains that are the same have the same numbers, so a value makes
a column that says nothing if the chain stays the same with all that a plan combines it with.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from itertools import product
from math import prod
from typing import Any, NamedTuple

from trainmj.collision.cases import Case
from trainmj.collision.lineup import line_up
from trainmj.collision.lot import contents_of
from trainmj.errors import InputError
from trainmj.files.source import Path, dotted
from trainmj.scenario import Scenario
from trainmj.scenario.scenario import WORDS

Block = Mapping[str, Sequence[Any]]
"""Values by name that change together: a case has those of one row."""

OF_MANY = ("parameters", "tolerances", "bracket")
"""Keys of a scenario that no single collision follows from."""

_ENDS = {("collision", "train_end"), ("collision", "partner_end")}  # a train may be the same from both

_FEW = 8  # different values that are no numbers, of which all are looked at
_MOST = 100  # chains for one name; where it would take more, it cannot be told
_NAMED = 3  # values that a message names


class _Compared(NamedTuple):
    """What changes have done."""

    differ: bool
    same: Scenario | None  # one of those that are alike, if all could be compared


def idle(
    scenarios: Iterable[Scenario],
    blocks: Sequence[Block],
    together: Sequence[Sequence[str]] = (),
    beside: Collection[str] = (),
) -> Iterator[tuple[Sequence[str], str]]:
    """Names whose values have no effect in any case, each with the rule that it breaks.

    Args:
        scenarios: of all load cases; an effect in one of them is enough.
        blocks: columns, whose rows are combined.
        together: names in one block that stand for one thing, an effect of one of which is enough; by default each is
            by itself.
        beside: keys of a scenario on which more depends than a single collision.
    """
    scenarios = tuple(scenarios)
    for names in together or [[name] for block in blocks for name in block]:
        if spared(scenarios, names, beside):
            continue
        own = next(block for block in blocks if names[0] in block)
        rest = [{name: block[name] for name in block if name not in names} for block in blocks]
        changes = _different({name: own[name] for name in names})
        first = _joined(_row(columns, 0) for columns in rest)
        if _compared(scenarios, [first], changes[:2]).differ:
            continue
        contexts = [_representatives(columns) for columns in rest]
        if prod(map(len, contexts)) <= _MOST:
            rule = why_idle(scenarios, names, changes, list(map(_joined, product(*contexts))))
            yield from [(names, rule)] if rule else []


def spared(scenarios: Iterable[Scenario], names: Iterable[str], beside: Collection[str] = ()) -> bool:
    """Whether no other chain need follow from some names: one is a word, an end, or below a key with other uses."""
    known = {*WORDS, *beside}
    places = (place for scenario in scenarios for name in names for place in scenario.places(name))
    return any(place[0] in known or place in _ENDS for place in places)


def why_idle(
    scenarios: Collection[Scenario], names: Sequence[str], changes: Iterable[Case], contexts: Sequence[Case] = ({},)
) -> str:
    """Why changes of some names make no difference in any case; empty if one does, or it cannot be told.

    Args:
        scenarios: of all load cases.
        names: of what is changed.
        changes: of which equal ones count once.
        contexts: what else is changed in a case.
    """
    different = list({repr(change): change for change in changes}.values())
    if len(scenarios) * len(contexts) * len(different) > _MOST:
        return ""
    found = _compared(scenarios, contexts, different)
    return _rule(names, found.same, different) if found.same is not None else ""


def idle_held(scenarios: Iterable[Scenario], held: Case, blocks: Sequence[Block] = ()) -> Iterator[tuple[str, str]]:
    """Names of values that are held in all cases and have no effect beside each other and what is varied."""
    if held:
        stated = [{name: [value]} for name, value in held.items()]
        for (name,), rule in idle(scenarios, [*stated, *blocks], [[name] for name in held], OF_MANY):
            yield name, rule


def refuse(found: Iterable[tuple[str | Sequence[str], str]]) -> None:
    """Raise the error that says the first of what was found, if anything was.

    Raises:
        InputError: with the name, and what takes its place.
    """
    for name, rule in found:
        raise InputError(f"{name if isinstance(name, str) else name[0]}: {rule}")


def _compared(scenarios: Iterable[Scenario], contexts: Iterable[Case], changes: Sequence[Case]) -> _Compared:
    """Whether chains differ by changes in one of the contexts; a change that breaks a rule says nothing."""
    same, every = None, True
    for context, scenario in product(contexts, scenarios):
        found: list[tuple[Scenario, Hashable]] = []
        for change in changes:
            try:
                changed = scenario.with_values({**context, **change})
                found.append((changed, contents_of(line_up(changed))))
            except InputError:
                continue
        if any(contents != found[0][1] for _, contents in found):
            return _Compared(True, None)
        every &= len(found) > 1
        same = found[0][0] if found else same
    return _Compared(False, same if every else None)


def _different(columns: Block) -> list[Case]:
    """Rows of columns that differ: of numbers the smallest, the largest and one between, of others all but for many.

    Of a single number there are others beside it: it may be what holds anyway.
    """
    if _are_numbers(columns):
        values = next(iter(columns.values()))
        low, high = (_row(columns, values.index(value)) for value in (min(values), max(values)))
        return [low, high, _row(columns, len(values) // 2)] if low != high else [low, *_beside(low)]
    found: dict[str, Case] = {}
    for row in zip(*columns.values(), strict=True):
        found.setdefault(repr(row), dict(zip(columns, row, strict=True)))
        if len(found) > _FEW:
            return []
    return list(found.values())


def _beside(row: Case) -> list[Case]:
    """Other numbers than those of a row; some may break a rule."""
    shifts, factors = (1.0, -1.0), (1.1, 0.9)
    by_one: list[Case] = [{name: value + shift for name, value in row.items()} for shift in shifts]
    return by_one + [{name: value * factor for name, value in row.items()} for factor in factors]


def _representatives(columns: Block) -> list[Case]:
    """Rows that stand for all: with each that is no number, and the smallest and the largest of each number."""
    numbers = {name: values for name, values in columns.items() if _are_numbers({name: values})}
    others = {name: values for name, values in columns.items() if name not in numbers}
    rows = dict.fromkeys(values.index(value) for values in numbers.values() for value in (min(values), max(values)))
    if others:
        known: dict[str, int] = {}
        for n, row in enumerate(zip(*others.values(), strict=True)):
            known.setdefault(repr(row), n)
        rows |= dict.fromkeys(known.values())
    return [_row(columns, n) for n in rows] or [{}]


def _are_numbers(columns: Block) -> bool:
    """Whether all values are numbers."""
    return all(set(map(type, values)) <= {int, float} for values in columns.values())


def _row(columns: Block, n: int) -> dict[str, Any]:
    return {name: values[n] for name, values in columns.items()}


def _joined(rows: Iterable[Case]) -> dict[str, Any]:
    return {name: value for row in rows for name, value in row.items()}


def _rule(names: Sequence[str], here: Scenario, changes: Sequence[Case]) -> str:
    """Why changes of names have no effect: by what their values are stated, if they have one without that."""
    places = [place for name in names for place in here.places(name)]
    keys = {_last(place) for place in places}
    stated = [path for path in _leaves(here.values()) if _last(path) in keys and path not in places]

    def acts_without(paths: Collection[Path]) -> bool:
        try:
            return _compared([Scenario.from_values(_without(here.values(), paths))], [{}], changes).differ
        except InputError:
            return False

    before = [path for path in stated[:_FEW] if acts_without([path])] or (stated if acts_without(stated) else [])
    if not before:
        return "has no effect: nothing that collides depends on it: leave it out"
    named = [*map(dotted, before[:_NAMED]), *["others"] * (len(before) > _NAMED)]
    listed = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
    return f"has no effect: what it would change is stated by {listed}: leave it out"


def _leaves(value: Any, path: Path = ()) -> Iterator[Path]:
    """The paths of single values on which collisions depend."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        if path or key not in (*WORDS, *OF_MANY):
            yield from _leaves(inner, (*path, key)) if isinstance(inner, dict | list) else [(*path, key)]


def _without(value: Any, paths: Collection[Path], at: Path = ()) -> Any:
    """The same values less those at some paths, and less groups of which nothing is left."""
    if not isinstance(value, dict):
        return [_without(v, paths, (*at, n)) for n, v in enumerate(value)] if isinstance(value, list) else value
    kept = {key: _without(v, paths, (*at, key)) for key, v in value.items() if (*at, key) not in paths}
    return {key: v for key, v in kept.items() if v != {} or value[key] == {}}


def _last(path: Path) -> str:
    """The last key of a path; one under as_built is a path itself."""
    return str(path[-1]).rpartition(".")[2]
