"""A study as a frozen value: scenario, space, responses, criteria; read from a file or from plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of
from trainmj.doe import Space
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.files.kinds import STUDY
from trainmj.files.resources import find_file
from trainmj.files.source import Source, source_of
from trainmj.files.tables import read_beside
from trainmj.files.yaml import read_yaml
from trainmj.scenario import Scenario
from trainmj.scenario.files import scenario_of
from trainmj.study.file import GivenPoints, StudyFile
from trainmj.study.rules import broken_rules, factor_of
from trainmj.units import ROUND_OFF, head, label


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
    """One side of a constraint."""

    response: Response
    sign: int  # 1 for at most, -1 for at least
    value: float  # in the unit of the response
    margin: float  # how far inside the search on the surrogates stays

    @property
    def text(self) -> str:
        """In print: ``S_anti <= 265 mm``."""
        return f"{self.response.name} {'<=' if self.sign > 0 else '>='} {self.value:.12g} {self.response.unit}".rstrip()

    def excess(self, values: FloatArray, margin: float = 0.0) -> FloatArray:
        """How far values (n,) are beyond the limit, less the margin: allowed where <= 0, (n,); round-off is nothing."""
        excess = np.asarray(self.sign * (values - self.value) + margin, dtype=np.float64)
        return np.where(np.abs(excess) <= ROUND_OFF * abs(self.value), 0.0, excess)


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
        given: points of a design that a file gives, (n, d); empty for the others.
    """

    spec: StudyFile
    scenario: Scenario
    space: Space
    targets: tuple[tuple[str, ...], ...]
    responses: tuple[Response, ...]
    source: Source = field(repr=False)
    given: Sequence[Sequence[float]] = field(default=(), repr=False)

    @property
    def title(self) -> str:
        """What is studied."""
        return self.spec.title or self.scenario.heading

    @property
    def files(self) -> frozenset[Path]:
        """The files that it was read from."""
        return self.source.files | self.scenario.files

    @property
    def objectives(self) -> tuple[Response, ...]:
        """The responses that are minimised or maximised, (m,)."""
        named = self._named()
        return tuple(named[name] for name in self.spec.objectives)

    @property
    def on_surrogates(self) -> bool:
        """Whether the choice is made among designs as the surrogates predict them."""
        return self.spec.optimiser.on != "simulator" and self.spec.decision.front != "simulator"

    @property
    def maximise(self) -> tuple[bool, ...]:
        """For each objective whether more is better, (m,)."""
        return tuple(direction == "maximise" for direction in self.spec.objectives.values())

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The constraints, each side by itself, (c,)."""
        named = self._named()
        return tuple(
            Limit(named[name], sign, value, part.margin)
            for name, part in self.spec.constraints.items()
            for sign, value in ((1, part.at_most), (-1, part.at_least))
            if value is not None
        )

    def criteria(self, values: FloatArray) -> FloatArray:
        """The objectives (n, m) among the responses (n, r)."""
        chosen = values[:, [self.responses.index(r) for r in self.objectives]]
        return np.asfortranarray(chosen)  # columns in one piece are added up most accurately

    def minimised(self, values: FloatArray) -> FloatArray:
        """The objectives (n, m) among the responses (n, r), negative where they are maximised."""
        return np.asarray(self.criteria(values) * np.where(self.maximise, -1.0, 1.0), dtype=np.float64)

    def excess(self, values: FloatArray, margins: bool = False) -> FloatArray:
        """How far the responses (n, r) are beyond each limit, less its margin if wanted, (n, c)."""
        found = [
            limit.excess(values[:, self.responses.index(limit.response)], limit.margin * margins)
            for limit in self.limits
        ]
        return np.stack(found, axis=1) if found else np.zeros((len(values), 0))

    def _named(self) -> dict[str, Response]:
        return {response.name: response for response in self.responses}


def load_study(file: str | Path) -> Study:
    """Read a study file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for b_type.study.yaml.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    return _checked(read_yaml(find_file(file, STUDY.ending, "study")))


def study_of(values: Mapping[str, Any], folder: str | Path = ".") -> Study:
    """Check plain values, keys as in a study file, and make the study.

    Args:
        values: nested dicts, lists, strings and numbers.
        folder: where files named in it are.

    Raises:
        InputError: listing every key, value and rule that is broken.
    """
    return _checked(source_of(values, folder))


def _checked(source: Source) -> Study:
    spec = source.checked(StudyFile)
    scenario = scenario_of(source, spec.scenario, spec.set)
    try:
        chain = line_up(scenario)
    except InputError as error:
        raise source.error(str(error), "scenario") from None
    source.refuse(broken_rules(spec, scenario, chain))
    columns = columns_of(chain)
    study = Study(
        spec,
        scenario,
        Space(tuple(factor_of(name, part) for name, part in spec.factors.items())),
        tuple(part.targets for part in spec.factors.values()),
        tuple(Response(name, column, columns[column].unit) for name, column in spec.responses.items()),
        source,
    )
    if not isinstance(spec.design, GivenPoints):
        return study
    import pandas as pd

    of_numbers = {head for f in study.space.factors if f.kind != "choice" for head in (f.name, f.head)}
    try:
        table = read_beside(source.folder, spec.design.file, "file")
        points: dict[str, Any] = dict(table.columns)
        points |= {head: table.numbers(head) for head in of_numbers & points.keys()}
        given = study.space.from_table(pd.DataFrame(points)).tolist()
        return replace(study, given=given, source=source.reading(spec.design.file))
    except InputError as error:
        raise source.error(str(error).removeprefix("file: "), "design", "file") from None
