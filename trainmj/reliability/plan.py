"""A reliability file read and checked: load cases, what scatters in them, and the draws by number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.cases.effect import idle_held, refuse, why_idle
from trainmj.cases.load_cases import scenarios_of, with_tolerances, within
from trainmj.cases.rows import STATUS
from trainmj.cases.scatter import Together, scatter_of, together
from trainmj.collision.cases import Case
from trainmj.collision.chain import Chain
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import Column, columns_of, fitting, matching, no_number
from trainmj.doe.arrays import FloatArray
from trainmj.doe.draws import normal_draws
from trainmj.errors import InputError
from trainmj.files.arguments import given
from trainmj.files.kinds import RELIABILITY, SCENARIO
from trainmj.files.provenance import lost
from trainmj.files.resources import find_file, kind_at
from trainmj.files.shown import Shown
from trainmj.files.source import Source, source_of
from trainmj.files.text import Folders, allowing
from trainmj.files.yaml import read_yaml
from trainmj.reliability.file import ReliabilityFile
from trainmj.scenario import Scenario, load

CHUNK = 2048
"""Draws made at a time."""

_SPREAD = (-1.0, 1.0, 0.0, -2.0, 2.0, -8.0, 8.0)  # normal scores at which a tolerance is looked at for its effect


@dataclass(frozen=True, eq=False)
class Reliability(Shown):
    """What is asked: scenarios by load case, what scatters in them, and the keys of the file.

    Attributes:
        spec: the parts of the file, or what is taken for a scenario alone.
        scenarios: by load case; under no name, "", if there is only one.
        read: the files that it was read from, besides those of the scenarios.

    Raises:
        InputError: if nothing scatters, a tolerance leads nowhere, a case cannot be computed, or no response has a name
            that is asked for.
    """

    spec: ReliabilityFile
    scenarios: Mapping[str, Scenario]
    read: frozenset[Path] = field(default=frozenset(), repr=False)
    scatter: Together = field(init=False, repr=False)
    chains: Mapping[str, Chain] = field(init=False, repr=False)  # of the trains as designed

    def __repr__(self) -> str:
        """Title and what scatters."""
        return f"<Reliability {self.title}: {self.spec.runs} draws of {len(self.scatter.names)} things that scatter>"

    def __post_init__(self) -> None:
        """Check everything that needs no collision."""
        scatters = {}
        for name, scenario in self.scenarios.items():
            with within(name):
                scatters[name] = scatter_of(scenario)
        object.__setattr__(self, "scatter", together(scatters))
        chains = {}
        for name, scenario in self.scenarios.items():
            (median,) = scatters[name].cases(np.zeros((1, scatters[name].d)))
            with within(name):
                chains[name] = line_up(scenario)
                line_up(self.changed(name, median))
        object.__setattr__(self, "chains", chains)
        for pattern in self.patterns:
            self._check(pattern)
        self._check_effect()

    def _check_effect(self) -> None:
        """Refuse a tolerance whose draws have no effect in any load case."""
        for part in dict.fromkeys(self.scatter.parts):
            z = np.outer(_SPREAD, [float(name == part) for name in self.scatter.parts])
            rules = []
            for case, scenario in self.scenarios.items():
                if part in scenario.tolerances:
                    bare = scenario.with_values({"tolerances": None})
                    rules.append(why_idle([bare], scenario.tolerances[part].targets, self.scatter.cases(case, z)))
            if all(rules):
                raise InputError(f"tolerances.{part}: {rules[0]}")

    @property
    def title(self) -> str:
        """That of the file, or of the scenario."""
        return self.spec.title or f"Reliability: {next(iter(self.scenarios.values())).heading}"

    @property
    def files(self) -> frozenset[Path]:
        """The files that it was read from."""
        return self.read.union(*(scenario.files for scenario in self.scenarios.values()))

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the load cases."""
        return tuple(self.scenarios)

    @cached_property
    def patterns(self) -> tuple[str, ...]:
        """Of the responses that are kept."""
        sensitive = self.spec.sensitivity.responses if self.spec.sensitivity else []
        return tuple(dict.fromkeys([*self.spec.responses, *sensitive]))

    def responses(self, case: str, patterns: Sequence[str]) -> dict[str, Column]:
        """The responses of a load case that patterns choose."""
        return fitting(patterns, columns_of(self.chains[case]))

    def draws(self, first: int, n: int) -> FloatArray:
        """Independent standard normal draws (n, d) from a number on; the same however many are made."""
        return normal_draws(self.scatter.d, n, seed=self.spec.seed, method=self.spec.draws, first=first)

    def chunks(self) -> Iterator[tuple[int, FloatArray]]:
        """All draws, some at a time, each time with the number of the first."""
        for first in range(0, self.spec.runs, CHUNK):
            yield first, self.draws(first, min(CHUNK, self.spec.runs - first))

    def changed(self, case: str, changes: Case) -> Scenario:
        """The scenario of a load case with the train as built in a draw; it has no tolerances any more.

        Raises:
            InputError: if the values break a rule.
        """
        return self.scenarios[case].with_values({**changes, "tolerances": None})

    @property
    def inputs(self) -> dict[str, Any]:
        """What the collisions depend on besides the first scenario."""
        others = {name: scenario.counted() for name, scenario in list(self.scenarios.items())[1:]}
        return {
            "draws": {"seed": self.spec.seed, "draws": self.spec.draws},
            "load_cases": list(self.cases),
            "cases": others,
            "responses": ", ".join(self.patterns),
        }

    def _check(self, pattern: str) -> None:
        """Refuse a response that no load case has, or that is a number in none."""
        reasons = []
        for chain in self.chains.values():
            columns = columns_of(chain)
            try:
                found = matching([pattern], columns)
            except InputError as error:
                reasons.append(str(error))
                continue
            why = [no_number(column, chain) for column in found.values()]
            if not all(why):
                return
            reasons.append(f"responses: {pattern}: {why[0]}")
        if pattern in STATUS:
            raise InputError(f"responses: {pattern}: every draw has it: leave it out")
        raise InputError(reasons[0])


def load_reliability(
    file: str | Path, changes: Mapping[str, Any] | None = None, *, allow_folder: Folders = ()
) -> Reliability:
    """Read a reliability file, or take a scenario that states tolerances, with what a file would say by default.

    Args:
        file: path of either, or the name of one that ships.
        changes: values changed in every load case; they come after those of the file.
        allow_folder: in which, or below which, input files may name files besides their own folder; one or several.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    name = str(file)
    with allowing(allow_folder):
        if not name.endswith(RELIABILITY.ending) and kind_at(name) is SCENARIO:
            scenario = load(file, changes)
            refuse(idle_held([scenario], changes or {}))
            return reliability_of_scenario(scenario, name)
        return _checked(read_yaml(find_file(file, RELIABILITY.ending, "reliability")), changes or {})


def reliability_of(values: Mapping[str, Any], folder: str | Path = ".") -> Reliability:
    """Make the plan of a reliability run from plain values, with the keys of a reliability file.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where the files that it names are.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    return _checked(source_of(values, folder), {})


def reliability_of_scenario(scenario: Scenario, name: str = "scenario") -> Reliability:
    """The plan for a scenario that states tolerances, under what a file would say by default."""
    return Reliability(ReliabilityFile(scenario=name), {"": scenario})


def reliability_given(plan: Reliability | Scenario | str | Path) -> Reliability:
    """A plan, or that of a scenario, or of the path of a file or the name of a shipped one.

    Raises:
        InputError: if the file cannot be read or breaks a rule.
        TypeError: if it is something else.
    """
    return reliability_of_scenario(plan) if isinstance(plan, Scenario) else given(plan, Reliability, load_reliability)


def _checked(source: Source, changes: Mapping[str, Any]) -> Reliability:
    spec = source.checked(ReliabilityFile)
    source.refuse(lost(source.values))
    scenarios = with_tolerances(source, scenarios_of(source, spec))
    if changes:
        scenarios = {name: scenario.with_values(changes) for name, scenario in scenarios.items()}
    try:
        refuse(idle_held(scenarios.values(), {**spec.set, **changes}))
        for name, case in (spec.cases or {}).items():
            with within(name):
                refuse(idle_held([scenarios[name]], case.set))
        return Reliability(spec, scenarios, source.files)
    except InputError as error:
        if () not in source.origins:
            raise
        raise InputError(f"{source.origins[()]}: {error}") from None
