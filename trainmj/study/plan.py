"""A study as a frozen value: scenario, space, responses, criteria; read from a file or from plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.cases.load_cases import scenarios_of, with_tolerances
from trainmj.cases.scatter import scatter_of, together
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import columns_of
from trainmj.doe import Space
from trainmj.doe.arrays import FloatArray
from trainmj.errors import InputError
from trainmj.files.kinds import STUDY
from trainmj.files.resources import find_file
from trainmj.files.shown import Shown
from trainmj.files.source import Source, source_of
from trainmj.files.tables import read_beside
from trainmj.files.text import Folders, allowing
from trainmj.files.yaml import read_yaml
from trainmj.scenario import Scenario
from trainmj.scenario.files import scenario_of
from trainmj.study.file import GivenPoints, StudyFile, name_in
from trainmj.study.rules import broken_rules, factor_of
from trainmj.units import ROUND_OFF, head, label

LIMITS = "limits"
"""The key of the nearest limit beside those of objectives."""


@dataclass(frozen=True)
class Response:
    """A response: short name, column of :func:`trainmj.run_cases`, unit.

    Attributes:
        name: in the study's tables: that of the file, with the load case behind it if there are any (TS_fast).
        column: of the results.
        unit: of it.
        case: load case of which it is; empty if the study has none, or for the worst of all.
        stated: its name in the file.
    """

    name: str
    column: str
    unit: str
    case: str = ""
    stated: str = ""

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
class Study(Shown):
    """A checked study.

    Attributes:
        spec: the parts of its file.
        scenario: what is studied, with the changes of ``set``.
        scenarios: by load case, each with its changes; the same one under no name, "", if there are none.
        space: the factors.
        targets: what each factor sets, one tuple for each.
        responses: in the order of the file.
        source: the file, for messages and the files that it names.
        given: points of a design that a file gives, (n, d); empty for the others.
        margins: found by simulation, in place of those of the file, by the text of a limit.
    """

    spec: StudyFile
    scenario: Scenario
    scenarios: Mapping[str, Scenario]
    space: Space
    targets: tuple[tuple[str, ...], ...]
    responses: tuple[Response, ...]
    source: Source = field(repr=False)
    given: Sequence[Sequence[float]] = field(default=(), repr=False)
    margins: Mapping[str, float] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        """Title, factors and objectives."""
        goals = ", ".join(self.spec.objectives)
        return f"<Study {self.title}: {', '.join(factor.name for factor in self.space.factors)} for {goals}>"

    @property
    def title(self) -> str:
        """What is studied."""
        return self.spec.title or self.scenario.heading

    @property
    def files(self) -> frozenset[Path]:
        """The files that it was read from."""
        return self.source.files.union(self.scenario.files, *(each.files for each in self.scenarios.values()))

    @property
    def objectives(self) -> tuple[Response, ...]:
        """The responses that are minimised or maximised, (m,); of several load cases the worst."""
        found = []
        for name in self.spec.objectives:
            first = self.responses[self._places(name)[0]]
            found.append(replace(first, name=name, case="") if self.spec.cases else first)
        return tuple(found)

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
        """The constraints, each side and load case by itself, (c,)."""
        stated = (
            Limit(response, sign, value, part.margin)
            for response in self.responses
            for name, part in self.spec.constraints_in(response.case).items()
            for sign, value in ((1, part.at_most), (-1, part.at_least))
            if name == response.stated and value is not None
        )
        return tuple(replace(limit, margin=self.margins.get(limit.text, limit.margin)) for limit in stated)

    def criteria(self, values: FloatArray) -> FloatArray:
        """The objectives (n, m) among the responses (n, r), of several load cases the worst."""
        found = np.empty((len(values), len(self.spec.objectives)), order="F")  # added up most accurately
        for k, (name, more) in enumerate(zip(self.spec.objectives, self.maximise, strict=True)):
            of_cases = values[:, self._places(name)]
            found[:, k] = of_cases.min(axis=1) if more else of_cases.max(axis=1)
        return found

    @property
    def worst_of_cases(self) -> tuple[Response, ...]:
        """The objectives of several load cases, which are no response of any single one."""
        return tuple(objective for objective in self.objectives if objective not in self.responses)

    def steps_ms(self, changes: Mapping[str, Any] | None = None) -> list[float]:
        """The time steps of its load cases, each once, with some changes [ms]."""
        steps = (scenario.with_values(changes or {}).simulation.step_ms for scenario in self.scenarios.values())
        return list(dict.fromkeys(steps))

    def with_worst(self, values: FloatArray) -> FloatArray:
        """The responses (n, r), then the objectives that are the worst of several load cases."""
        places = [k for k, objective in enumerate(self.objectives) if objective not in self.responses]
        return np.concatenate([values, self.criteria(values)[:, places]], axis=1)

    def governing(self, values: FloatArray) -> list[dict[str, str]]:
        """The load case that each objective of several is of, by objective, for n designs with responses (n, r).

        Under LIMITS stands the limit that is nearest, or passed by most, as a part of it.
        """
        found: list[dict[str, str]] = [{} for _ in values]
        for (name, goal), first in zip(self.spec.objectives.items(), self.objectives, strict=True):
            if first in self.responses:
                continue
            places = self._places(name)
            of_cases = values[:, places] * (-1.0 if goal == "maximise" else 1.0)
            for row, k in zip(found, np.argmax(of_cases, axis=1), strict=True):
                row[name] = self.responses[places[k]].case
        if self.spec.cases and self.limits:
            scale = np.array([abs(limit.value) or 1.0 for limit in self.limits])
            for row, k in zip(found, np.argmax(self.excess(values) / scale, axis=1), strict=True):
                row[LIMITS] = self.limits[k].text
        return found

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

    def _places(self, name: str) -> list[int]:
        """Of a response of the file, in every load case, among the responses."""
        return [k for k, response in enumerate(self.responses) if response.stated == name]


def load_study(file: str | Path, *, allow_folder: Folders = ()) -> Study:
    """Read a study file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or a name such as ``b_type`` for b_type.study.yaml.
        allow_folder: in which, or below which, input files may name files besides their own folder; one or several.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    with allowing(allow_folder):
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
    scenarios = with_tolerances(source, scenarios_of(source, spec) if spec.cases else {"": scenario})
    chains = {}
    for name, each in scenarios.items():
        try:
            chains[name] = line_up(each)
        except InputError as error:
            raise source.error(str(error), *(("cases", name) if name else ("scenario",))) from None
    source.refuse(broken_rules(spec, scenarios, chains))
    if spec.robust is not None:
        try:
            together({name: scatter_of(each) for name, each in scenarios.items()})
        except InputError as error:
            raise source.error(str(error), "robust") from None
    columns = {name: columns_of(chain) for name, chain in chains.items()}
    study = Study(
        spec,
        scenario,
        scenarios,
        Space(tuple(factor_of(name, part) for name, part in spec.factors.items())),
        tuple(part.targets for part in spec.factors.values()),
        tuple(
            Response(name_in(name, case), column, columns[case][column].unit, case, name)
            for name, column in ((name, spec.column(name)) for name in spec.responses)
            for case in spec.cases_of(name)
        ),
        source,
    )
    if not isinstance(spec.design, GivenPoints):
        return study
    import pandas as pd

    heads = {head: f for f in study.space.factors for head in (f.name, f.head)}
    units = {head: f.unit for head, f in heads.items()}
    try:
        table = read_beside(source.folder, spec.design, "file", units.get)
        points = {
            head: table.column(head) if heads[head].kind == "choice" else table.numbers(head)
            for head in table.columns
            if head in heads
        }
        given = study.space.from_table(pd.DataFrame(points)).tolist()
        told = [table.note] * bool(table.note)
        return replace(study, given=given, source=source.reading(spec.design.file, told=told))
    except InputError as error:
        raise source.error(str(error).removeprefix("file: "), "design", "file") from None
