"""An assessment file read and checked, and the collisions of a train that it asks for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from trainmj.assessment.file import IDENTICAL, AssessmentFile, CollisionScenario, FromLineSpeed
from trainmj.collision.chain import Chain, Vehicle
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import BODY, Column, Quantity, columns_of, of_each, why_absent
from trainmj.errors import InputError, close_match
from trainmj.files.arguments import given
from trainmj.files.kinds import ASSESSMENT
from trainmj.files.provenance import Provenance, entry_of, lost
from trainmj.files.resources import find_file
from trainmj.files.shown import Shown
from trainmj.files.source import Path as Place
from trainmj.files.source import Problem, Source, dotted
from trainmj.files.yaml import read_yaml
from trainmj.scenario import Scenario
from trainmj.scenario.trains import TrainSpec


@dataclass(frozen=True, eq=False)
class Standard(Shown):
    """What a train must pass: an assessment file that has been checked.

    Attributes:
        spec: the parts of the file.
        name: of the file, without its ending.
        source: its plain values with their places.
    """

    spec: AssessmentFile = field(repr=False)
    name: str
    source: Source = field(repr=False)

    def __repr__(self) -> str:
        """Title and the collision scenarios."""
        return f"<Standard {self.spec.title}: {', '.join(self.spec.scenarios)}>"

    @property
    def files(self) -> frozenset[Path]:
        """The files that it was read from."""
        return self.source.files


@dataclass(frozen=True, eq=False)
class Case:
    """One collision of an assessment.

    Attributes:
        key: of its collision scenario in the file.
        end: of the train that leads.
        state: name of the load state; empty for the train as it stands.
        changes: of the train's scenario, by path: ``trainmj run`` with them computes the same.
        scenario: the train's, changed; None if it cannot be made.
        chain: of the scenario.
        refused: why it cannot be made.
        absent: what is asked of it and is not there, or not for every vehicle, with the reason, by the name of the
            response.
    """

    key: str
    end: str
    state: str
    changes: Mapping[str, Any]
    scenario: Scenario | None = field(default=None, repr=False)
    chain: Chain | None = field(default=None, repr=False)
    refused: str = ""
    absent: Mapping[str, str] = field(default_factory=dict)


_LONGEST = 200  # characters of a title
_NOT_THERE = "this collision has no such response"
_OWN = {
    "partner": "partner",
    "speed_km_h": "speed_km_h or speed_by_category_km_h",
    "train_end": "ends",
}
"""What an assessment states in its own words, by the keys under collision of a scenario."""


def load_assessment(file: str | Path) -> Standard:
    """Read an assessment file, or one that ships with trainmj by its name: ``en15227``.

    Raises:
        InputError: listing file, line, key, value and rule of everything that is wrong.
    """
    path = find_file(file, ASSESSMENT.ending, "assessment")
    source = read_yaml(path)
    spec = source.checked(AssessmentFile)
    source.refuse((*_broken_rules(spec), *lost(source.values)))
    return Standard(spec, path.name.removesuffix(ASSESSMENT.ending), source)


def standard_given(standard: Standard | str | Path) -> Standard:
    """A standard, or that of the path of a file or of a shipped one's name.

    Raises:
        InputError: if the file cannot be read or breaks a rule.
        TypeError: if it is something else.
    """
    return given(standard, Standard, load_assessment)


def _broken_rules(spec: AssessmentFile) -> Iterator[Problem]:
    """Every rule that the parts of the file break between them."""
    for key, scenario in spec.scenarios.items():
        at: Place = ("scenarios", key)
        if (scenario.speed_km_h is None) == (not scenario.speed_by_category_km_h):
            yield Problem(at, "needs speed_km_h or speed_by_category_km_h, one of them")
        for category in scenario.speed_by_category_km_h:
            if category not in spec.categories:
                rule = f"there is no category of this name{close_match(category, spec.categories)}"
                yield Problem((*at, "speed_by_category_km_h", category), rule)
        if len(set(scenario.ends)) < len(scenario.ends):
            yield Problem((*at, "ends"), "states an end twice")
        yield from _wrongly_set(scenario.set, (*at, "set"))
    yield from _wrongly_set(spec.set, ("set",))


def _wrongly_set(values: Mapping[str, Any], at: Place) -> Iterator[Problem]:
    """Values under ``set`` that would make a case another one than its row says."""
    for name in values:
        group, _, key = name.partition(".")
        if name in ("collision", "collision.train"):
            yield Problem((*at, name), "is of the train that is assessed, not of the assessment")
        elif group == "collision" and key in _OWN:
            yield Problem((*at, name), f"is said by {_OWN[key]} of a collision scenario")


def category_of(standard: Standard, category: str | None) -> str:
    """The category that is assessed; empty where the file has none.

    Raises:
        InputError: if one is missing, or there is none of the name.
    """
    known = standard.spec.categories
    words = "; ".join(f"{name}: {title}" for name, title in known.items())
    if category is None and known:
        raise InputError(f"category: {standard.name} needs one of its categories. {words}")
    if category is not None and category not in known:
        rule = f"is none of its categories. {words}" if known else "has no categories: leave it out"
        raise InputError(f"category: {standard.name}: {category!r} {rule}")
    return category or ""


def speed_stated(scenario: CollisionScenario, category: str) -> float | FromLineSpeed | None:
    """The speed of a collision scenario as the file states it; None if it does not apply to a category."""
    return scenario.speed_km_h if scenario.speed_km_h is not None else scenario.speed_by_category_km_h.get(category)


def speed_of(scenario: CollisionScenario, category: str, line_speed_km_h: float | None) -> float:
    """The speed of a collision scenario [km/h]; 0 if it asks for none, in this category or on such a line."""
    one = speed_stated(scenario, category)
    return max(0.0, one.at(line_speed_km_h)) if isinstance(one, FromLineSpeed) else one or 0.0


def cases_of(standard: Standard, train: Scenario, category: str, line_speed_km_h: float | None) -> Iterator[Case]:
    """Every collision that a standard asks of a train, in the order of the file.

    Args:
        standard: what must be passed.
        train: a scenario, whose moving train is assessed.
        category: of the train; empty where the standard has none.
        line_speed_km_h: speed of the line on which it runs; None if not known.
    """
    spec = standard.spec
    for key, scenario in spec.scenarios.items():
        speed = speed_of(scenario, category, line_speed_km_h)
        if speed == 0.0:
            continue
        for end in scenario.ends:
            for state, loads in states_of(spec, train).items():
                yield _case(standard, train, key, speed, end, state, loads)


def states_of(spec: AssessmentFile, train: Scenario) -> dict[str, dict[str, float]]:
    """The changes of each load state; the train as it stands, under an empty name, if no vehicle has seats."""
    name = train.collision.train
    places = list(_stated(train.trains[name], "load"))
    if not spec.load_states or not places:
        return {"": {}}
    found: dict[str, dict[str, float]] = {}
    for state, load in spec.load_states.items():
        stated = {"share": load.share} | ({} if load.kg is None else {"kg": load.kg})
        found[state] = {
            dotted(("trains", name, *place, key)): value
            for place, load_of in places
            for key, value in stated.items()
            if not place[:-1] or getattr(load_of, key) is not None or train.trains[name].load is None
        }
    return found


def _stated(train: TrainSpec, key: str) -> Iterator[tuple[Place, Any]]:
    """The places below a train at which a key of it or of a vehicle is stated, with what is there."""
    if getattr(train, key) is not None:
        yield (key,), getattr(train, key)
    for n, vehicle in enumerate(train.vehicles if isinstance(train.vehicles, list) else ()):
        if getattr(vehicle, key) is not None:
            yield ("vehicles", n, key), getattr(vehicle, key)


def _case(
    standard: Standard, train: Scenario, key: str, speed: float, end: str, state: str, loads: Mapping[str, float]
) -> Case:
    """A collision with the limits that it can be judged by, or the reason why it cannot be made."""
    spec = standard.spec
    changes = _changes(spec, train, key, speed, end, loads)
    try:
        partner = spec.scenarios[key].partner
        base = train if partner == IDENTICAL else train.with_partner(partner, standard.source.folder)
        changed = base.with_values(changes)
        bare = line_up(changed.with_values({"limits": None}))
        known: dict[str, Column | Quantity] = {**columns_of(bare), **of_each(bare)}
        limits = limits_of(spec, key)
        lost = {name: _NOT_THERE for name in changed.limits if name not in known}
        absent = {name: reason for name in (*limits, *spec.reported) if (reason := _absent(name, known))}
        of_bodies, none_yields = _unanswered(bare)
        missing = set(absent) | set(of_bodies if none_yields else ())
        stated = {
            f"limits.{name}": limit
            for name, limit in limits.items()
            if name not in missing and not changed.limits.get(name, math.inf) < limit
        }
        sources = changed.values().get("sources", {}) | {path: _plain_source(standard, key, path) for path in stated}
        changes |= stated | {f"limits.{name}": None for name in lost}
        title = f"{spec.scenarios[key].title}, {leading(spec, end, state)}: {train.collision.train}"
        limited = base.with_values(changes | {"sources": sources, "title": title[:_LONGEST]})
        absent |= lost | {n: why for n, why in of_bodies.items() if n in known and n in (*limits, *limited.limits)}
        return Case(key, end, state, changes, limited, line_up(limited), absent=absent)
    except InputError as error:
        return Case(key, end, state, changes, refused=str(error))


def _changes(
    spec: AssessmentFile, train: Scenario, key: str, speed: float, end: str, loads: Mapping[str, float]
) -> dict[str, Any]:
    """The changes that make the collision of a case of the train's scenario, by path; limits are not among them."""
    scenario = spec.scenarios[key]
    twin = scenario.partner == IDENTICAL
    return {
        "collision.partner": train.collision.train if twin else scenario.partner,
        "collision.speed_km_h": speed,
        "collision.partner_speed_km_h": 0.0,
        "collision.train_end": end,
        "collision.partner_end": end if twin else "front",
        **spec.set,
        **scenario.set,
        **({} if spec.brakes else _unbraked(train)),
        **loads,
    }


def leading(spec: AssessmentFile, end: str, state: str) -> str:
    """End and load state of a case in words: "rear leading, empty"."""
    load = spec.load_states.get(state)
    return f"{end} leading" + (f", {load.title or state.replace('_', ' ')}" if load else "")


def limits_of(spec: AssessmentFile, key: str) -> dict[str, float]:
    """The limits of an assessment in one of its collision scenarios."""
    return {n: limit for n, limit in {**spec.limits, **spec.scenarios[key].limits}.items() if limit is not None}


def _unbraked(train: Scenario) -> dict[str, None]:
    """The changes that leave out the brakes of a train."""
    name = train.collision.train
    return {dotted(("trains", name, *place)): None for place, _ in _stated(train.trains[name], "brakes")}


def _absent(name: str, known: Mapping[str, Any]) -> str:
    """Why a collision does not have a response; empty if it has it."""
    return "" if name in known else why_absent(name, known) or _NOT_THERE


def _unanswered(chain: Chain) -> tuple[dict[str, str], bool]:
    """Of quantities of bodies, for which vehicles of the train they say nothing; and whether for all of them."""
    train = chain.vehicles[: chain.n_moving][::-1]
    rigid = [v.kind for v in train if v.body is None]
    elastic = [v.kind for v in train if v.body is not None and v.body.collapse == math.inf]
    why = [f"{_said(rigid, train)} has no body that gives"] if rigid else []
    why += [f"the body of {_said(elastic, train)} never yields, without a collapse_force_kN"] if elastic else []
    plastic = (quantity.name for quantity in BODY if "plastic" in quantity.key)
    return {name: "; ".join(why) for name in plastic if why}, len(rigid) + len(elastic) == len(train)


def _said(kinds: Sequence[str], train: Sequence[Vehicle]) -> str:
    return "each vehicle of the train" if len(kinds) == len(train) else ", ".join(dict.fromkeys(kinds))


def check_names(standard: Standard, cases: Sequence[Case]) -> None:
    """Refuse limits, and what is to be reported, that none of the cases has that ask for it.

    Raises:
        InputError: with the place in the file, and the nearest name.
    """
    spec = standard.spec
    for case in cases:
        for name, reason in case.absent.items():
            alike = [c for c in cases if c.chain is not None and name in (*limits_of(spec, c.key), *spec.reported)]
            if reason == _NOT_THERE and alike and all(c.absent.get(name) == _NOT_THERE for c in alike):
                at: Place = ("reported",) if name in spec.reported else ("limits", name)
                at = ("scenarios", case.key, *at) if name in spec.scenarios[case.key].limits else at
                assert case.chain is not None  # a case without one is refused, and has nothing absent
                close = close_match(name, {**columns_of(case.chain), **of_each(case.chain)})
                raise standard.source.error(f"there is no quantity or response {name!r}{close}", *at)


def source_of_limit(standard: Standard, key: str, path: str) -> str | Provenance:
    """Where a limit, such as ``limits.TS_mm``, comes from in a collision scenario."""
    own = path.removeprefix("limits.") in standard.spec.scenarios[key].limits
    return entry_of(standard.spec.sources, f"scenarios.{key}.{path}" if own else path) or standard.spec.title


def _plain_source(standard: Standard, key: str, path: str) -> Any:
    entry = source_of_limit(standard, key, path)
    return entry if isinstance(entry, str) else entry.model_dump()
