"""The limits that belong into the plots of a sweep: of single responses, and the same in all of its cases."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from trainmj.collision.chain import Chain, places_of_sides
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import INTERFACE, STAGE, columns_of, of_sides
from trainmj.errors import InputError
from trainmj.scenario import Scenario
from trainmj.scenario.devices import DEVICE
from trainmj.sweep.page_responses import Factor
from trainmj.sweep.plan import LOAD_CASE
from trainmj.units import MM

_MOST = 8  # levels of a factor at which limits are looked at


def limits_of(scenarios: Iterable[Scenario], factors: Sequence[Factor]) -> dict[str, float]:
    """The limits of responses by their columns, where every load case and every level of a factor has the same.

    None where a factor has levels that are groups, of which a table has only the text.
    """
    if any(factor.nested for factor in factors):
        return {}
    found = [by_column(chain) for scenario in scenarios for chain in _chains(scenario, factors)]
    first, *others = found or [{}]
    return {name: limit for name, limit in first.items() if all(other.get(name) == limit for other in others)}


def by_column(chain: Chain) -> dict[str, float]:
    """The limit of each response of the train under test that has one: as the scenario or a device states it."""
    columns = columns_of(chain)
    stages: dict[str, float] = {}  # largest strokes by column [mm]; infinite without a limit
    for k, side in places_of_sides(chain):
        name = chain.interfaces[k].sides[side]
        for stage in chain.interfaces[k].devices[side].stages:
            head = INTERFACE[0].head_of(name) if stage.name == DEVICE else STAGE.head_of(f"{name} {stage.name}")
            if head in columns and (chain.twin or not columns[head].of_partner):
                stages[head] = stage.limit / MM
    of_stages = {name for name in stages if columns[name].place[-1] >= len(of_sides(chain))}
    found: dict[str, float] = {}
    for name, column in columns.items():
        quantity = "" if name in of_stages else column.quantity  # of an interface, which has the same name
        stated = np.inf if column.of_partner else chain.limits.get(quantity, np.inf)
        limit = min(chain.limits.get(name, np.inf), stated, stages.get(name, np.inf))
        found |= {name: limit} if np.isfinite(limit) else {}
    return found


def _chains(scenario: Scenario, factors: Sequence[Factor]) -> Iterator[Chain]:
    """What collides in the scenario and at some levels of each factor, the others left as they are."""
    yield line_up(scenario)
    for factor in factors:
        places = np.unique(np.linspace(0, len(factor.levels) - 1, _MOST).round().astype(int))
        for level in (factor.levels[place] for place in places):
            if factor.name != LOAD_CASE:
                try:
                    yield line_up(scenario.with_values({factor.name: level}))
                except InputError:  # a level that is refused has no case with numbers
                    continue
