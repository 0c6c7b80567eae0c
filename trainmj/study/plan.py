"""A study as a frozen value: scenario, space, responses, criteria; read from a file or from plain values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of, no_number
from trainmj.doe import Space
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.files.problems import Problem
from trainmj.files.resources import find_file
from trainmj.files.source import Source
from trainmj.files.text import beside
from trainmj.files.yaml import read_yaml
from trainmj.scenario import Scenario, to_yaml
from trainmj.scenario.files import refused, scenario_of
from trainmj.study.file import GivenPoints, StudyFile
from trainmj.study.rules import broken_rules, factor_of
from trainmj.units import head, label

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
        margin: how far inside the search on the surrogates stays.
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
        source: the file, for messages and the files that it names.
    """

    spec: StudyFile
    scenario: Scenario
    space: Space
    targets: tuple[tuple[str, ...], ...]
    responses: tuple[Response, ...]
    source: Source = field(repr=False)

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
        """The responses that are minimised or maximised, (m,)."""
        return tuple(self.responses[k] for k in self._chosen)

    @property
    def maximise(self) -> tuple[bool, ...]:
        """For each objective whether more is better, (m,)."""
        return tuple(direction == "maximise" for direction in self.spec.objectives.values())

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The constraints, each side by itself, (c,)."""
        return tuple(
            Limit(self.responses[self._place(name)], sign, value, part.margin)
            for name, part in self.spec.constraints.items()
            for sign, value in ((1, part.at_most), (-1, part.at_least))
            if value is not None
        )

    @property
    def identity(self) -> list[Any]:
        """What every simulation depends on: the scenario, and what the factors set."""
        return [to_yaml(self.scenario), self.targets]

    @property
    def _chosen(self) -> list[int]:
        return [self._place(name) for name in self.spec.objectives]

    def _place(self, name: str) -> int:
        """The place of a response among all."""
        return next(k for k, r in enumerate(self.responses) if r.name == name)

    def criteria(self, values: FloatArray) -> FloatArray:
        """The objectives (n, m) among the responses (n, r)."""
        return np.asfortranarray(values[:, self._chosen])  # columns in one piece are added up most accurately

    def minimised(self, values: FloatArray) -> FloatArray:
        """The objectives (n, m) among the responses (n, r), negative where they are maximised."""
        return np.asarray(self.criteria(values) * np.where(self.maximise, -1.0, 1.0), dtype=np.float64)

    def excess(self, values: FloatArray, margins: bool = False) -> FloatArray:
        """How far the responses (n, r) are beyond each limit, less its margin if wanted, (n, c)."""
        places = [self._place(limit.response.name) for limit in self.limits]
        found = [
            limit.excess(values[:, k], limit.margin * margins) for limit, k in zip(self.limits, places, strict=True)
        ]
        return np.stack(found, axis=1) if found else np.zeros((len(values), 0))

    def problem(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value of the study's file."""
        return self.source.error(rule, *path)


def load_study(file: str | Path) -> Study:
    """Read a study file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for b_type.study.yaml.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    return _checked(read_yaml(find_file(file, _ENDING, "study")))


def study_of(values: Mapping[str, Any], folder: str | Path = ".") -> Study:
    """Check plain values, keys as in a study file, and make the study.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where files named in it are.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    return _checked(Source(values, folder=Path(folder)))


def _checked(source: Source) -> Study:
    spec = source.checked(StudyFile)
    scenario = scenario_of(source, spec.scenario, spec.set)
    try:
        chain = line_up(scenario)
    except InputError as error:
        raise source.error(str(error), "scenario") from None
    columns = columns_of(chain)
    reasons = {name: no_number(columns[c], chain) for name, c in spec.responses.items() if c in columns}
    check = {name: {name: value} for name, value in spec.check.set.items()}
    source.refuse(
        [
            *broken_rules(spec, scenario, columns),
            *(Problem(("responses", name), reason) for name, reason in reasons.items() if reason),
            *refused(("check", "set"), check, scenario),
            *_file(spec, source.folder),
        ]
    )
    return Study(
        spec,
        scenario,
        Space(tuple(factor_of(name, part) for name, part in spec.factors.items())),
        tuple(part.targets for part in spec.factors.values()),
        tuple(Response(name, column, columns[column].unit) for name, column in spec.responses.items()),
        source,
    )


def _file(spec: StudyFile, folder: Path) -> Iterator[Problem]:
    """What is wrong with the file of given points."""
    if isinstance(spec.design, GivenPoints):
        try:
            if beside(folder, spec.design.file, "file") is None:
                yield Problem(("design", "file"), "there is no such file beside it")
        except InputError as error:
            yield Problem(("design", "file"), str(error).removeprefix("file: "))
