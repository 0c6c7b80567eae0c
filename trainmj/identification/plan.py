"""An identification as a frozen value: scenario, unknowns, cases, observations; read from a file or plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import Any, Self

import numpy as np

from trainmj.collision.device import Array
from trainmj.errors import InputError
from trainmj.files.problems import Origins, Problem, refuse, validated
from trainmj.files.resources import shipped_files
from trainmj.files.yaml import find_file, read_yaml
from trainmj.identification.data import Observation, cases_of, observations
from trainmj.identification.file import Amount, CurvePart, TargetPart, TargetsFile
from trainmj.identification.rules import broken_rules, member_name, settings_of, start_of, unit_of_path
from trainmj.identification.sums import Sum, parse_sum
from trainmj.identification.unknowns import Area, Rise, Setting, Unknown, Unknowns, curve_points
from trainmj.scenario import Scenario, load
from trainmj.scenario.files import find_beside
from trainmj.units import unit_of

_ENDING = ".targets.yaml"


@dataclass(frozen=True)
class Target:
    """A response that has values to meet.

    Attributes:
        name: the user's.
        terms: the columns of the results that add up to it.
        unit: of the response.
        part: its entry in the file.
    """

    name: str
    terms: Sum
    unit: str
    part: TargetPart

    def amount(self, amount: Amount | None, wanted: float) -> float | None:
        """An amount in the unit of the response; None where none is stated."""
        return None if amount is None else absolute(amount, wanted)


@dataclass(frozen=True)
class Sample:
    """Observations as arrays, and the cases that are simulated for them.

    Attributes:
        observations: n of them.
        cases: m different ones.
        case: (n,) place of each observation's case.
        target: (n,) place of its target.
        wanted: (n,) values.
        tolerance: (n,) standard deviations.
        weight: (n,) by which residuals are multiplied.
        bar: (n,) largest deviations allowed; infinite where none is stated.
    """

    observations: tuple[Observation, ...]
    cases: tuple[Mapping[str, Any], ...]
    case: np.ndarray
    target: np.ndarray
    wanted: Array
    tolerance: Array
    weight: Array
    bar: Array

    @classmethod
    def of(cls, found: list[Observation], targets: tuple[Target, ...]) -> Sample:
        """The arrays of observations."""
        cases, case = cases_of(found)
        place = {t.name: k for k, t in enumerate(targets)}
        of = [targets[place[o.target]] for o in found]
        bars = [t.amount(t.part.bars.each, o.wanted) for t, o in zip(of, found, strict=True)]
        return cls(
            tuple(found),
            tuple(cases),
            np.array(case, dtype=int),
            np.array([place[o.target] for o in found], dtype=int),
            np.array([o.wanted for o in found]),
            np.array([absolute(t.part.tolerance, o.wanted) for t, o in zip(of, found, strict=True)]),
            np.array([t.part.weight for t in of]),
            np.array([np.inf if bar is None else bar for bar in bars]),
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
        values: the plain values of the file, for messages.
        origins: where each of them stands.
    """

    spec: TargetsFile
    scenario: Scenario
    unknowns: Unknowns
    targets: tuple[Target, ...]
    fitted: Sample
    held_out: Sample
    values: Mapping[str, Any] = field(repr=False)
    origins: Origins = field(repr=False)

    @property
    def title(self) -> str:
        """What is identified."""
        return self.spec.title or self.scenario.title or "Identification"

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
        rows = np.asarray(responses)[..., sample.case, :]
        return np.asarray(np.sum(rows * mix[sample.target], axis=-1))

    def problem(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value of the file."""
        return refuse([Problem(path, rule)], self.values, self.origins)


def absolute(amount: Amount, wanted: float) -> float:
    """An amount in the unit of the response: itself, or its part of the value that is wanted."""
    if isinstance(amount, str):
        return float(amount.strip().removesuffix("%")) / 100.0 * abs(wanted)
    return amount


def load_targets(file: str | Path) -> Identification:
    """Read a targets file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for scenarios/b_type.targets.yaml.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    path = find_file(file, str(file).removesuffix(_ENDING), shipped_files(_ENDING), "targets file")
    values, origins = read_yaml(path)
    if "targets" not in values and {"devices", "trains", "builds_on", "collision", "factors"} & set(values):
        raise InputError(
            f"{path}: is no targets file: one states scenario, parameters, targets and data; see docs/identification.md"
        )
    return identification_of(values, path.parent, origins)


def identification_of(
    values: Mapping[str, Any], folder: str | Path = ".", origins: Origins | None = None
) -> Identification:
    """Check plain values, keys as in a targets file, and make the identification.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where files named in it are.
        origins: where each value comes from, for messages.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    origins, folder = origins or {}, Path(folder)
    spec = validated(TargetsFile, values, origins)
    scenario = _scenario(spec, folder, values, origins)
    problems: list[Problem] = []
    samples = []
    for key in ("data", "held_out"):
        found: list[Observation] = []
        for name, part in getattr(spec, key).items():
            if (part.table is None) == (part.rows is None):
                problems.append(Problem((key, name), "needs either table or rows"))
                continue
            try:
                found += observations(name, part, folder)
            except InputError as error:
                problems.append(Problem((key, name), str(error)))
        samples.append(found)
    problems += broken_rules(spec, scenario, *samples)
    if problems:
        raise refuse(problems, values, origins)
    targets = tuple(_target(name, part) for name, part in spec.targets.items())
    unknowns = _unknowns(spec, scenario)
    fitted, held_out = (Sample.of(found, targets) for found in samples)
    return Identification(spec, scenario, unknowns, targets, fitted, held_out, values, origins)


def _scenario(spec: TargetsFile, folder: Path, values: Mapping[str, Any], origins: Origins) -> Scenario:
    where = origins.get(("scenario",))
    said = f"{f'{where}: ' if where else ''}scenario = {spec.scenario[:200]!a}"
    scenario = load(find_beside(folder, spec.scenario, said))
    try:
        return scenario.with_values(spec.set) if spec.set else scenario
    except InputError as error:
        raise refuse([Problem(("set",), str(error))], values, origins) from None


def _target(name: str, part: TargetPart) -> Target:
    terms = parse_sum(part.response)
    return Target(name, terms, unit_of(next(iter(terms))), part)


def _unknowns(spec: TargetsFile, scenario: Scenario) -> Unknowns:
    points = {
        name: curve_points(scenario.values(), part.curve)
        for name, part in spec.parameters.items()
        if isinstance(part, CurvePart)
    }
    sizes = [points[name][0].size - 2 if name in points else 1 for name in spec.parameters]
    places = dict(zip(spec.parameters, accumulate(sizes, initial=0), strict=False))  # of a curve, of its first member
    parameters: list[Unknown] = []
    rises: dict[str, Rise] = {}
    for name, part in spec.parameters.items():
        if isinstance(part, CurvePart):
            stroke, force = points[name]
            members = tuple(range(places[name], places[name] + stroke.size - 2))
            rises[name] = Rise(name, members, stroke, float(force[0]), float(force[-1]), part.slopes)
            parameters += _inner(name, part, stroke, force)
            continue
        settings = settings_of(part, scenario)
        parameters.append(
            Unknown(
                name,
                unit_of_path(settings[0].path) if part.unit is None else part.unit,
                part.bounds[0],
                part.bounds[1],
                part.scale == "log",
                start_of(settings, scenario) if part.start is None else part.start,
                None if part.above is None else places[part.above],
                part.gap,
                settings,
            )
        )
    areas = tuple(
        Area(
            name,
            c.of,
            c.from_mm,
            c.to_mm,
            c.area_kJ,
            rises[c.by].widest(c.from_mm, c.to_mm) if c.by in rises else places[c.by],
            absolute(c.tolerance, c.area_kJ),
        )
        for name, c in spec.constraints.items()
    )
    return Unknowns(scenario, tuple(parameters), areas, tuple(rises.values()))


def _inner(name: str, part: CurvePart, stroke: Array, force: Array) -> list[Unknown]:
    """The inner forces of a curve that is sought as a whole, by the strokes at which they are."""
    return [
        Unknown(
            member_name(name, stroke[k]),
            "kN",
            float(force[0]),
            float(force[-1]),
            False,
            float(np.clip(force[k], force[0], force[-1])),
            None,
            0.0,
            (Setting(f"{part.curve}.force_kN.{k}", 1.0, 0.0),),
        )
        for k in range(1, stroke.size - 1)
    ]
