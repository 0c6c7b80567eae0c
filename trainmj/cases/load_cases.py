"""Load cases: the collisions that one design must pass, each a scenario of its own or a change of another one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, Protocol

from pydantic import Field

from trainmj.errors import InputError
from trainmj.files.parts import Name, Part, Title
from trainmj.files.source import Path, Problem, Source
from trainmj.scenario import Scenario
from trainmj.scenario.files import refused, scenario_of


class LoadCase(Part):
    """A collision that a design must pass."""

    title: Title = Field(default="", description="what it is, in words")
    scenario: str | None = Field(
        default=None, description="scenario file beside this one, or the name of a shipped one, in place of that of all"
    )
    set: dict[str, Any] = Field(
        default_factory=dict, description="values changed in this case, on top of those changed in every case"
    )


LoadCases = Annotated[dict[Name, LoadCase], Field(min_length=1, max_length=100)]


class _WithCases(Protocol):
    """A file that states load cases."""

    @property
    def scenario(self) -> str:
        """Of all cases that name none."""

    @property
    def set(self) -> Mapping[str, Any]:
        """Values changed in every case."""

    @property
    def cases(self) -> Mapping[str, LoadCase] | str | None:
        """By name; text is something else."""


def scenarios_of(source: Source, spec: _WithCases) -> dict[str, Scenario]:
    """The scenarios of a file by load case; under no name, "", if it states no cases.

    Raises:
        InputError: if there is no such scenario, or a change breaks a rule.
    """
    if not isinstance(spec.cases, Mapping):
        return {"": scenario_of(source, spec.scenario, spec.set)}
    found: dict[str, Scenario] = {}
    for name, case in spec.cases.items():
        at = ("cases", name)
        where = at if case.scenario else ()
        scenario = scenario_of(source, case.scenario or spec.scenario, {}, where)
        for group, changes in ((("set",), spec.set), ((*at, "set"), case.set)):
            problems = refused(group, {key: {key: value} for key, value in changes.items()}, scenario)
            source.refuse(in_case(name, problems) if group == ("set",) else problems)
            scenario = scenario.with_values(changes) if changes else scenario
        found[name] = scenario
    return found


def with_tolerances(source: Source, scenarios: Mapping[str, Scenario]) -> dict[str, Scenario]:
    """The scenarios of a file by load case with the tolerances that it states, name by name, over those of each.

    Raises:
        InputError: if a tolerance breaks a rule.
    """
    stated = {name: {f"tolerances.{name}": value} for name, value in (source.values.get("tolerances") or {}).items()}
    changes = {path: value for one in stated.values() for path, value in one.items()}
    found: dict[str, Scenario] = {}
    for name, scenario in scenarios.items():
        source.refuse(refused(("tolerances",), stated, scenario))
        found[name] = scenario.with_values(changes) if changes else scenario
        if name:
            own = source.values["cases"][name].get("set") or {}
            source.refuse(in_vain(("cases", name, "set"), {key: [key] for key in own}, found[name]))
    return found


def in_vain(at: Path, stated: Mapping[str, Iterable[str]], scenario: Scenario) -> Iterator[Problem]:
    """Values that are without effect on trains as built, by key with their paths: a tolerance draws others instead."""
    for name, tolerance in scenario.tolerances.items():
        if not tolerance.own_values or any(key.startswith(f"tolerances.{name}") for key in stated):
            continue
        for key, targets in stated.items():
            if any(scenario.overlap(target, of) for target in targets for of in tolerance.targets):
                rule = f"the tolerance {name} states values of its own for it, whatever is set here"
                yield Problem((*at, key), f"{rule}: state sigma or percent there, without a mean")


def in_case(name: str, problems: Iterable[Problem]) -> Iterator[Problem]:
    """Problems that a value for all load cases has in one of them, which the rules then name; "" is none."""
    return (Problem(p.path, f"{p.rule} (in load case {name})") if name else p for p in problems)


@contextmanager
def within(case: str) -> Iterator[None]:
    """Say of what is wrong that it is so in a load case; "" is none."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{error} (in load case {case})" if case else str(error)) from None
