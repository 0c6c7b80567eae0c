"""An identification as a frozen value: scenario, unknowns, cases, observations; read from a file or plain values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from trainmj.cases.effect import idle_held, spared, why_idle
from trainmj.collision.chain import Chain
from trainmj.collision.channels import Trace
from trainmj.collision.channels import channels_of as channels_of_chain
from trainmj.collision.envelope import Array
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of, in_place_of, no_number
from trainmj.errors import InputError
from trainmj.files.kinds import TARGETS
from trainmj.files.resources import find_file
from trainmj.files.shown import Shown
from trainmj.files.source import Problem, Source, source_of
from trainmj.files.text import Folders, allowing
from trainmj.files.yaml import read_yaml
from trainmj.identification.data import (
    Observation,
    Sum,
    cases_of,
    channels_of,
    in_units,
    observations,
    parse_sum,
    shares,
)
from trainmj.identification.file import ChannelTarget, TargetPart, TargetsFile, absolute
from trainmj.identification.rules import broken_rules
from trainmj.identification.unknowns import Point, Unknowns
from trainmj.scenario import Scenario
from trainmj.scenario.files import scenario_of
from trainmj.units import MS

_ROUNDING = 1e-9  # of times [s]


@dataclass(frozen=True)
class Target:
    """A response or a channel that has values to meet."""

    name: str  # the user's
    terms: Sum  # the columns of the results, or the channels, that add up to it
    unit: str  # of its values
    part: TargetPart | ChannelTarget  # its entry in the file

    @property
    def is_channel(self) -> bool:
        """Whether it has values over time."""
        return isinstance(self.part, ChannelTarget)


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
    time: Array  # (n,) of the test [s]; NaN for what is no sample of a channel
    share: Array  # (n,) as how many values it counts: 1, but samples of a channel count together

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
            np.array([np.nan if o.time is None else o.time for o in found]),
            np.array(shares(found, {t.name: t.part for t in targets})),
        )

    @cached_property
    def channels(self) -> dict[tuple[str, str], np.ndarray]:
        """The places of the samples of each channel, by data and target."""
        return {key: np.array(places) for key, places in channels_of(self.observations).items()}

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
            *(
                values[keep]
                for values in (self.target, self.wanted, self.tolerance, self.weight, self.bar, self.time, self.share)
            ),
        )
        return sample, tuple(chosen.tolist())


class Simulated(NamedTuple):
    """What trials have given in m cases."""

    responses: Array  # (n_trial, m, n_column)
    traces: list[list[Mapping[str, Trace]]]  # [n_trial][m], the channels by name


@dataclass(frozen=True)
class Identification(Shown):
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

    def __repr__(self) -> str:
        """Title, and how much is sought."""
        return f"<Identification {self.title}: {len(self.unknowns.names)} values from {len(self.targets)} targets>"

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
        return tuple(sorted({column for t in self.targets if not t.is_channel for column in t.terms}))

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """The channels that the targets need."""
        return tuple(sorted({channel for t in self.targets if t.is_channel for channel in t.terms}))

    def shifts(self, values: Array) -> dict[str, float]:
        """What is added to the times of each test, by the name of its data [s], for values of the parameters."""
        shifts = {name: part.offset_ms * MS for name, part in self.spec.channels().items()}
        found = zip(self.unknowns.parameters, values, strict=True)
        return shifts | {name: float(value) * MS for p, value in found for name in p.shifts}

    def found(self, sample: Sample, simulated: Simulated, points: Sequence[Point]) -> Array:
        """Values of the observations of a sample.

        Args:
            sample: n observations of m cases.
            simulated: what k trials have given in its cases.
            points: these trials.

        Returns:
            (k, n); NaN where there is none.
        """
        mix = np.zeros((len(self.targets), len(self.columns)))
        for k, t in enumerate(self.targets):
            for column, factor in t.terms.items() if not t.is_channel else ():
                mix[k, self.columns.index(column)] = factor
        rows, used = simulated.responses[:, sample.case, :], mix[sample.target]
        found = np.asarray(np.sum(np.where(used != 0, rows * used, 0.0), axis=-1))  # NaN is that of its own target
        for (data, _), places in sample.channels.items():
            terms, case = self.targets[sample.target[places[0]]].terms, sample.case[places[0]]
            for values, traces, point in zip(found, simulated.traces, points, strict=True):
                there, time = traces[case], sample.time[places] + self.shifts(point.value)[data]
                each = [factor * there[name].at(time) if name in there else np.nan for name, factor in terms.items()]
                values[places] = sum(each)
        return found


def load_targets(file: str | Path, *, allow_folder: Folders = ()) -> Identification:
    """Read a targets file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for scenarios/b_type.targets.yaml.
        allow_folder: in which, or below which, input files may name files besides their own folder; one or several.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    with allowing(allow_folder):
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
    told: list[str] = []
    found: dict[str | int, list[Observation]] = {"data": [], "held_out": []}
    for at, part in spec.tables():
        try:
            more, notes = observations(str(at[1]), part, source.folder, scenario.unit)
            found[at[0]] += more
            told += notes
        except InputError as error:
            problems.append(Problem(at, str(error)))
    fitted, held_out = found.values()
    source.refuse([*problems, *broken_rules(spec, scenario, fitted, held_out)])
    unknowns = Unknowns.of(spec, scenario)
    start = scenario.with_values(unknowns.changes(unknowns.start().value))
    chains = _chains([*fitted, *held_out], start)
    targets = tuple(_target(name, part, chains, source) for name, part in spec.targets.items())
    try:
        (fitted, new), (held_out, also) = (in_units(seen, {t.name: t.unit for t in targets}) for seen in found.values())
    except InputError as error:
        raise source.error(str(error), "data") from None
    samples = Sample.of(fitted, targets), Sample.of(held_out, targets)
    places = [place for _, part in spec.tables() for place in part.places]
    read = [place if isinstance(place, str) else place.file for place in places]
    told = list(dict.fromkeys([*told, *new, *also]))
    plan = Identification(spec, scenario, unknowns, targets, *samples, source.reading(*read, told=told))
    _check_effect(plan)
    _check_times(plan, start)
    _check_steps(spec, targets, samples[0], start, source)
    return plan


def _check_effect(plan: Identification) -> None:
    """Refuse parameters, and values that are set, which have no effect in any case."""
    unknowns, start = plan.unknowns, plan.unknowns.start().value
    cases = [*plan.fitted.cases, *plan.held_out.cases]
    if all(case.keys() == cases[0].keys() for case in cases):
        together = {name: [case[name] for case in cases] for name in cases[0]}
        for name, rule in idle_held([plan.scenario], plan.spec.set, [together] if together else []):
            raise plan.source.error(rule, "set", name)
    for k, parameter in enumerate(unknowns.parameters):
        names = [setting.path for setting in parameter.settings]
        if not names or spared([plan.scenario], names):
            continue
        values = [np.where(np.arange(len(start)) == k, x, start) for x in (start[k], parameter.lower, parameter.upper)]
        trials = map(unknowns.changes, values)
        if rule := why_idle([plan.scenario], names, trials, cases):
            raise plan.source.error(rule, "parameters", parameter.name)


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


def _target(name: str, part: TargetPart | ChannelTarget, chains: Chains, source: Source) -> Target:
    """A target, its response or channel looked up in every case that has a value for it."""
    key, text = part.asked
    terms = parse_sum(text)
    for case, chain in chains[name]:
        known = _known(part, chain)
        for column in terms:
            if column not in known:
                rule = f"there is no {key} {column!r} in the case {dict(case)}{in_place_of(column, known)}"
                raise source.error(rule, "targets", name, key)
            if (unit := known[column][0]) != (first := known[next(iter(terms))][0]):
                rule = f"adds {column} in {unit or 'no unit'} to a {key} in {first or 'no unit'}"
                raise source.error(rule, "targets", name, key)
            if reason := known[column][1](chain):
                raise source.error(f"{reason}, in the case {dict(case)}", "targets", name, key)
    return Target(name, terms, known[next(iter(terms))][0], part)


def _known(part: TargetPart | ChannelTarget, chain: Chain) -> dict[str, tuple[str, Callable[[Chain], str]]]:
    """Unit of every response or channel of a chain by name, and what says why it is no number with its records."""
    if isinstance(part, ChannelTarget):
        return {name: (channel.unit, channel.no_number) for name, (channel, _) in channels_of_chain(chain).items()}
    return {name: (column.unit, partial(no_number, column)) for name, column in columns_of(chain).items()}


def _check_times(plan: Identification, start: Scenario) -> None:
    """Refuse times of channels that no simulation can have, and samples finer than its records."""
    shifts = plan.shifts(plan.unknowns.start().value)
    for key, sample in (("data", plan.fitted), ("held_out", plan.held_out)):
        for (data, _), places in sample.channels.items():
            chain = _lined_up(start, sample.cases[sample.case[places[0]]])
            time = sample.time[places] + shifts[data]
            rule = ""
            if time[0] < -_ROUNDING:
                rule = f"its times begin {-time[0]:.6g} s before the simulation"
            elif time[-1] > chain.time_limit + _ROUNDING:
                rule = f"its times end at {time[-1]:.6g} s, and simulation.time_limit_s is {chain.time_limit:g}"
            if rule:
                cure = "times are in s (time: 0.001 * time_ms for a column in ms); use those that it has (between_s)"
                raise plan.source.error(f"{rule}: {cure}, or shift them (offset_ms)", key, data, "channels")
            if finer := _finer(time, chain):
                raise plan.source.error(f"{finer}: set that in set, or leave samples out", key, data, "channels")


def _finer(time: Array, chain: Chain) -> str:
    """What is wrong with samples (n,) that are finer than the records of a chain, and the cure."""
    between = (time[-1] - time[0]) / (len(time) - 1)
    if between >= chain.record_interval * (1 - 1e-3):
        return ""
    return (
        f"samples are {between / MS:.4g} ms apart, finer than simulation.record_every_ms = "
        f"{chain.record_interval / MS:g}: take at most {between / MS:.4g}"
    )


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
            for target in targets:
                known = _known(target.part, chain)
                for column in target.terms:
                    if target.part.weight > 0 and column in known and (reason := known[column][1](chain)):
                        raise source.error(f"targets.{target.name}: {reason}", "method", key, "step_ms")
            for (data, _), places in fitted.channels.items():
                if finer := _finer(fitted.time[places], chain):
                    raise source.error(f"data.{data}: {finer}", "method", key, "step_ms")
