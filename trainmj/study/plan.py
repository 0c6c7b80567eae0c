"""A study as a frozen value: scenario, space, responses, criteria; read from a file or from plain values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.doe import Space
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.files.problems import Origins, Problem, refuse, validated
from trainmj.files.problems import Path as Place
from trainmj.files.resources import shipped_files
from trainmj.files.text import beside
from trainmj.files.yaml import find_file, read_yaml
from trainmj.scenario import Scenario, load, to_yaml
from trainmj.scenario.files import find_beside
from trainmj.study.file import ConstraintPart, StudyFile
from trainmj.study.rules import broken_rules, factor_of, paths_set, targets_of
from trainmj.units import head, label, unit_of

_ENDING = ".study.yaml"


@dataclass(frozen=True)
class Response:
    """A response: short name, column of :func:`trainmj.run_cases`, unit."""

    name: str
    column: str
    unit: str

    @property
    def head(self) -> str:
        """Head of its column in the study's tables: ``TS_mm``."""
        return head(self.name, self.unit)

    @property
    def label(self) -> str:
        """Label of its axis: ``TS (mm)``."""
        return label(self.name, self.unit)


@dataclass(frozen=True)
class Limit:
    """One side of a constraint.

    Attributes:
        response: what is limited.
        sign: 1 for at most, -1 for at least.
        value: the limit, in the unit of the response.
        margin: how far inside the search on the surrogate stays.
    """

    response: Response
    sign: int
    value: float
    margin: float

    @property
    def text(self) -> str:
        """As a person writes it: ``S_anti <= 265 mm``."""
        return f"{self.response.name} {'<=' if self.sign > 0 else '>='} {self.value:g} {self.response.unit}".rstrip()

    def excess(self, values: FloatArray, margin: float = 0.0) -> FloatArray:
        """How far values (n,) are beyond the limit, less the margin: allowed where <= 0, (n,)."""
        return np.asarray(self.sign * (values - self.value) + margin, dtype=np.float64)


@dataclass(frozen=True)
class Study:
    """A checked study.

    Attributes:
        spec: the parts of its file.
        scenario: what is studied, with the changes of ``set``.
        space: the factors.
        targets: what each factor sets, one tuple for each.
        responses: in the order of the file.
        folder: where files named in it are.
        values: the plain values of the file, for messages.
        origins: where each of them stands.
    """

    spec: StudyFile
    scenario: Scenario
    space: Space
    targets: tuple[tuple[str, ...], ...]
    responses: tuple[Response, ...]
    folder: Path
    values: Mapping[str, Any] = field(repr=False)
    origins: Origins = field(repr=False)

    @property
    def title(self) -> str:
        """What is studied."""
        return self.spec.title or self.scenario.title or "Study"

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the factors' columns in the study's tables, (d,)."""
        return tuple(head(f.name, f.unit) for f in self.space.factors)

    @property
    def objectives(self) -> tuple[Response, ...]:
        """The responses that are made small or large, (m,)."""
        return tuple(self.response(name) for name in self.spec.objectives)

    @property
    def maximise(self) -> tuple[bool, ...]:
        """For each objective whether more is better, (m,)."""
        return tuple(direction == "maximise" for direction in self.spec.objectives.values())

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The constraints, each side by itself, (c,)."""
        return tuple(
            limit for name, part in self.spec.constraints.items() for limit in _sides(self.response(name), part)
        )

    def response(self, name: str) -> Response:
        """The response of a short name."""
        return next(r for r in self.responses if r.name == name)

    def problem(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value of the study's file."""
        return refuse([Problem(path, rule)], self.values, self.origins)

    @property
    def identity(self) -> list[Any]:
        """What every simulation depends on: the scenario, and what the factors set."""
        return [to_yaml(self.scenario), self.targets]


def _sides(response: Response, part: ConstraintPart) -> list[Limit]:
    sides = ((1, part.at_most), (-1, part.at_least))
    return [Limit(response, sign, value, part.margin) for sign, value in sides if value is not None]


def load_study(file: str | Path) -> Study:
    """Read a study file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for scenarios/b_type.study.yaml.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    path = find_file(file, str(file).removesuffix(_ENDING), shipped_studies(), "study")
    values, origins = read_yaml(path)
    if "factors" not in values and {"devices", "trains", "builds_on", "collision"} & set(values):
        raise InputError(
            f"{path}: is a scenario, not a study: a study file states scenario, factors, responses, design"
        )
    return study_of(values, path.parent, origins)


def study_of(values: Mapping[str, Any], folder: str | Path = ".", origins: Origins | None = None) -> Study:
    """Check plain values, keys as in a study file, and make the study.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where files named in it are.
        origins: where each value comes from, for messages.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    origins = origins or {}
    spec = validated(StudyFile, values, origins)
    scenario = _scenario(spec, Path(folder), values, origins)
    problems = [*paths_set(spec, scenario), *broken_rules(spec, scenario)]
    if problems:
        raise refuse(problems, values, origins)
    problems = list(_set_problems(("set",), spec.set, scenario))
    if not problems:
        scenario = scenario.with_values(spec.set)
        problems = [*_set_problems(("check", "set"), spec.check.set, scenario), *_file(spec, Path(folder))]
    if problems:
        raise refuse(problems, values, origins)
    return Study(
        spec,
        scenario,
        Space(tuple(factor_of(name, part) for name, part in spec.factors.items())),
        tuple(targets_of(part) for part in spec.factors.values()),
        tuple(Response(name, column, unit_of(column)) for name, column in spec.responses.items()),
        Path(folder),
        values,
        origins,
    )


def _file(spec: StudyFile, folder: Path) -> Iterator[Problem]:
    """What is wrong with the file of a given design."""
    name = spec.design.file
    if name is not None:
        try:
            if beside(folder, name, "file") is None:
                yield Problem(("design", "file"), "there is no such file beside it")
        except InputError as error:
            yield Problem(("design", "file"), str(error).removeprefix("file: "))


def _set_problems(at: Place, changes: Mapping[str, Any], scenario: Scenario) -> Iterator[Problem]:
    """What is wrong with values that are set, by key where one is wrong by itself."""
    rule = _refused(changes, scenario)
    if rule is None:
        return
    alone = {name: _refused({name: value}, scenario) for name, value in changes.items()}
    wrong = [Problem((*at, name), rule) for name, rule in alone.items() if rule is not None]
    yield from wrong or [Problem(at, rule)]


def _refused(changes: Mapping[str, Any], scenario: Scenario) -> str | None:
    try:
        scenario.with_values(changes)
    except InputError as error:
        return str(error)
    return None


def shipped_studies() -> dict[str, Path]:
    """Names and paths of the studies that ship with trainmj."""
    return shipped_files(_ENDING)


def _scenario(spec: StudyFile, folder: Path, values: Mapping[str, Any], origins: Origins) -> Scenario:
    where = origins.get(("scenario",))
    said = f"{f'{where}: ' if where else ''}scenario = {spec.scenario[:200]!a}"
    return load(find_beside(folder, spec.scenario, said))
