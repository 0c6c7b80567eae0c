"""An identification as a frozen value: scenario, unknowns, cases, observations; read from a file or plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of, in_place_of, no_number
from trainmj.errors import InputError
from trainmj.files.kinds import TARGETS
from trainmj.files.resources import find_file
from trainmj.files.source import Problem, Source, source_of
from trainmj.files.yaml import read_yaml
from trainmj.identification.data import Observation, Sum, cases_of, observations, parse_sum
from trainmj.identification.file import TargetPart, TargetsFile, absolute
from trainmj.identification.rules import broken_rules
from trainmj.identification.unknowns import Unknowns
from trainmj.scenario import Scenario
from trainmj.scenario.files import scenario_of


@dataclass(frozen=True)
class Target:
    """A response that has values to meet."""

    name: str  # the user's
    terms: Sum  # the columns of the results that add up to it
    unit: str  # of the response
    part: TargetPart  # its entry in the file


@dataclass(frozen=True)
class Sample:
    """Observations as arrays, and the cases that are simulated for them."""

    observations: tuple[Observation, ...]  # n of them
    cases: tuple[Mapping[str, Any], ...]  # m different ones
    case: np.ndarray  # (n,) place of each observation's case
    target: np.ndarray  # (n,) place of its target
    wanted: Array  # (n,) values
    tolerance: Array  # (n,) standard deviations
    weight: Array  # (n,) by which residuals are multiplied
    bar: Array  # (n,) largest deviations allowed; infinite where none is stated

    @classmethod
    def of(cls, found: Sequence[Observation], targets: tuple[Target, ...]) -> Sample:
        """The arrays of observations."""
        cases, case = cases_of(found)
        place = {t.name: k for k, t in enumerate(targets)}
        parts = [(targets[place[o.target]].part, o.wanted) for o in found]
        return cls(
            tuple(found),
            tuple(cases),
            np.array(case, dtype=int),
            np.array([place[o.target] for o in found], dtype=int),
            np.array([wanted for _, wanted in parts]),
            np.array([absolute(part.tolerance, wanted) for part, wanted in parts]),
            np.array([part.weight for part, _ in parts]),
            np.array([absolute(part.bars.each, wanted) for part, wanted in parts]),
        )

    def __len__(self) -> int:
        """How many observations there are."""
        return len(self.observations)

    def some(self, n_case: int | None) -> tuple[Self, tuple[int, ...]]:
        """The observations of at most so many cases, spread evenly over the list, and the places of these cases."""
        m = len(self.cases)
        chosen = np.unique(np.round(np.linspace(0, m - 1, min(n_case or m, m))).astype(int))
        keep = np.isin(self.case, chosen)
        sample = type(self)(
            tuple(o for o, kept in zip(self.observations, keep, strict=True) if kept),
            tuple(self.cases[k] for k in chosen),
            np.searchsorted(chosen, self.case[keep]),
            *(values[keep] for values in (self.target, self.wanted, self.tolerance, self.weight, self.bar)),
        )
        return sample, tuple(chosen.tolist())


@dataclass(frozen=True)
class Identification:
    """A checked targets file.

    Attributes:
        spec: the parts of its file.
        scenario: with the changes of ``set``.
        unknowns: what is sought.
        targets: in the order of the file.
        fitted: what the search sees.
        held_out: what it does not.
        source: the file, for messages.
    """

    spec: TargetsFile
    scenario: Scenario
    unknowns: Unknowns
    targets: tuple[Target, ...]
    fitted: Sample
    held_out: Sample
    source: Source = field(repr=False)

    @cached_property
    def start(self) -> Scenario:
        """The scenario with the start values, in the first case that is fitted."""
        values = self.unknowns.changes(self.unknowns.start().value)
        return self.scenario.with_values({**values, **self.fitted.cases[0]})

    @property
    def title(self) -> str:
        """What is identified."""
        return self.spec.title or self.scenario.heading

    @property
    def files(self) -> frozenset[Path]:
        """The files that it was read from."""
        return self.source.files | self.scenario.files

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """The columns of the results that the targets need."""
        return tuple(sorted({column for t in self.targets for column in t.terms}))

    def found(self, sample: Sample, responses: Array) -> Array:
        """Values of the observations of a sample.

        Args:
            sample: n observations of m cases.
            responses: (..., m, n_column) of its cases.

        Returns:
            (..., n).
        """
        mix = np.zeros((len(self.targets), len(self.columns)))
        for k, t in enumerate(self.targets):
            for column, factor in t.terms.items():
                mix[k, self.columns.index(column)] = factor
        rows, used = np.asarray(responses)[..., sample.case, :], mix[sample.target]
        return np.asarray(np.sum(np.where(used != 0, rows * used, 0.0), axis=-1))  # NaN is that of its own target


def load_targets(file: str | Path) -> Identification:
    """Read a targets file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for scenarios/b_type.targets.yaml.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    return _checked(read_yaml(find_file(file, TARGETS.ending, "targets file")))


def targets_of(values: Mapping[str, Any], folder: str | Path = ".") -> Identification:
    """Check plain values, keys as in a targets file, and make the identification.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where files named in it are.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    return _checked(source_of(values, folder))


def _checked(source: Source) -> Identification:
    spec = source.checked(TargetsFile)
    scenario = scenario_of(source, spec.scenario, spec.set)
    problems: list[Problem] = []
    found: dict[str | int, list[Observation]] = {"data": [], "held_out": []}
    for at, part in spec.tables():
        try:
            found[at[0]] += observations(str(at[1]), part, source.folder)
        except InputError as error:
            problems.append(Problem(at, str(error)))
    fitted, held_out = found.values()
    source.refuse([*problems, *broken_rules(spec, scenario, fitted, held_out)])
    unknowns = Unknowns.of(spec, scenario)
    start = scenario.with_values(unknowns.changes(unknowns.start().value))
    chains = _chains([*fitted, *held_out], start)
    targets = tuple(_target(name, part, chains, source) for name, part in spec.targets.items())
    samples = Sample.of(fitted, targets), Sample.of(held_out, targets)
    _check_steps(spec, targets, samples[0], start, source)
    read = [name for _, part in spec.tables() for name in part.files]
    return Identification(spec, scenario, unknowns, targets, *samples, source.reading(*read))


def at_step(scenario: Scenario, step: float) -> dict[str, float]:
    """Another step [ms], and as many of them between records, and in a window, as come nearest to the scenario's."""
    now = scenario.simulation
    lengths = {"record_every_ms": now.record_every_ms, "averaging_ms": now.averaging_ms}
    found = {key: max(1, round(length / step)) * step for key, length in lengths.items() if length is not None}
    return {"simulation.step_ms": step} | {f"simulation.{key}": length for key, length in found.items()}


Chains = Mapping[str, Sequence[tuple[Mapping[str, Any], Chain]]]
"""The cases that have a value for a target, by its name, each lined up with the start values."""


def _chains(found: Sequence[Observation], start: Scenario) -> Chains:
    cases, place = cases_of(found)
    chains = [_lined_up(start, case) for case in cases]
    used: dict[str, dict[int, tuple[Mapping[str, Any], Chain]]] = {}
    for o, k in zip(found, place, strict=True):
        used.setdefault(o.target, {})[k] = cases[k], chains[k]
    return {target: list(of.values()) for target, of in used.items()}


def _lined_up(start: Scenario, case: Mapping[str, Any]) -> Chain:
    try:
        return line_up(start.with_values(case))
    except InputError as error:
        raise InputError(f"start values, the case {dict(case)}: {error}") from None


def _target(name: str, part: TargetPart, chains: Chains, source: Source) -> Target:
    """A target, its response looked up in every case that has a value for it."""
    terms = parse_sum(part.response)
    for case, chain in chains[name]:
        columns = columns_of(chain)
        for column in terms:
            if column not in columns:
                rule = f"there is no response {column!r} in the case {dict(case)}{in_place_of(column, columns)}"
                raise source.error(rule, "targets", name, "response")
            if (unit := columns[column].unit) != (first := columns[next(iter(terms))].unit):
                rule = f"adds {column} in {unit or 'no unit'} to a response in {first or 'no unit'}"
                raise source.error(rule, "targets", name, "response")
            if reason := no_number(columns[column], chain):
                raise source.error(f"{reason}, in the case {dict(case)}", "targets", name, "response")
    return Target(name, terms, columns[next(iter(terms))].unit, part)


def _check_steps(spec: TargetsFile, targets: Sequence[Target], fitted: Sample, start: Scenario, source: Source) -> None:
    """Refuse steps of the search with which no trial could be simulated, or a target is no number."""
    for key, step in (("explore", spec.method.explore.step_ms), ("refine", spec.method.refine.step_ms)):
        for case in fitted.cases if step is not None else ():
            assert step is not None
            try:
                chain = line_up(start.with_values({**case, **at_step(start, step)}))
            except InputError as error:
                rule = f"at the start values, in the case {dict(case)}: {error}"
                raise source.error(rule, "method", key, "step_ms") from None
            columns = columns_of(chain)
            for target in targets:
                for column in target.terms:
                    if target.part.weight > 0 and column in columns and (reason := no_number(columns[column], chain)):
                        raise source.error(f"targets.{target.name}: {reason}", "method", key, "step_ms")
