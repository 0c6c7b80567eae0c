"""A whole scenario: checked, frozen, and varied by copies.

Values are found by path, such as ``trains.b_type.mass_t``, or by the short name that the scenario gives to a path.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any, Self

from pydantic import PrivateAttr

from trainmj.errors import InputError, close_match
from trainmj.files.arguments import changes_given
from trainmj.files.provenance import outdated
from trainmj.files.shown import Shown
from trainmj.files.source import (
    Path,
    Problem,
    Source,
    change,
    dotted,
    groups_of,
    has_key,
    has_values_by_name,
    inside,
    placed,
    plain,
    put,
    source_of,
    type_at,
)
from trainmj.scenario.as_built import cars_as_built, in_place
from trainmj.scenario.partners import with_partner, with_partner_file
from trainmj.scenario.parts import Parts
from trainmj.scenario.rules import broken_rules
from trainmj.scenario.trains import RIGID_WALL
from trainmj.units import unit_of

_NOWHERE = Source({})
_DIGITS = 10  # of a position: longer ones are none
WORDS = ("title", "notes", "report", "sources", "changed")
"""Keys that say something of a scenario: no number depends on them."""

_UNSAID = (*WORDS, "parameters", "tolerances")  # of which a title says nothing
_MOST_SAID = 4  # changes in a heading
_LONGEST = 40  # characters of a value there
_LONGEST_NAME = 120  # and of its path
_PARTNER = ("collision", "partner")
_BUILT = "as_built"


class Scenario(Shown, Parts):
    """A scenario whose names all exist and whose values can all be simulated."""

    _source: Source = PrivateAttr(default_factory=lambda: _NOWHERE)  # a default would be copied for every case

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> Self:
        """Check plain values, as a YAML file gives them, and make the scenario.

        Args:
            values: nested dicts, lists, strings and numbers, keys as in a scenario file.

        Raises:
            InputError: listing every key, value and rule that is broken.
        """
        return cls.from_source(source_of(values))

    @classmethod
    def from_source(cls, source: Source) -> Self:
        """Check plain values whose places are known.

        Raises:
            InputError: listing every key, value and rule that is broken, each with its place.
        """
        source = with_partner(source)
        scenario = source.checked(cls)
        source.refuse(broken_rules(scenario))
        scenario._source = source
        return scenario

    @property
    def files(self) -> frozenset[FilePath]:
        """The files that it was read from."""
        return self._source.files

    def values(self) -> dict[str, Any]:
        """The plain values this scenario was made from; a copy."""
        return copy.deepcopy(dict(self._source.values))

    def counted(self) -> dict[str, Any]:
        """Those of them on which numbers may depend; results of a scenario are those of another one of the same."""
        return without_words(self.values())

    def __repr__(self) -> str:
        """Title, changes, and what collides: a scenario holds every value."""
        return f"<Scenario {self.heading}: {self.subject}>"

    def with_values(self, changes: Mapping[str, Any] | None = None, **parameters: Any) -> Self:
        """A copy with some values changed: ``with_values(mass_t=30)``, ``with_values({"collision.gap_mm": 5})``.

        Args:
            changes: new values by path (``"devices.front.stiffness_kN_per_mm"``) or parameter (``"mass_t"``); None
                takes a value back, so that its default applies.
            parameters: the same for names without points, as keywords.

        Raises:
            InputError: if a path leads nowhere, the changed scenario breaks a rule, or another vehicle or device would
                be at a place under as_built.
        """
        changes = changes_given(changes, parameters)
        found = self.from_source(changed(self._source, self.parameters, changes))
        if self.as_built and not any(_keys(path)[0] == _BUILT for name in changes for path in self.paths(name)):
            before, now = in_place(self, self.as_built), in_place(found, self.as_built)
            if other := next((at.place for at, then in zip(before, now, strict=True) if at != then), None):
                raise InputError(
                    f"as_built: {other} would be another vehicle or device with {', '.join(changes)}: state as_built "
                    "anew, too, or the values where they belong to all of a kind"
                )
        return found

    def with_partner(self, name: str, folder: FilePath) -> Self:
        """A copy that has the partner of a file, too, in a folder or shipped; the same if there is no file of the name.

        Raises:
            InputError: if the file is wrong, or states something else of a name that the scenario has as well.
        """
        return self.from_source(with_partner_file(self._source, name, folder))

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise the error that lists problems with the places of their values, if there are any.

        Raises:
            InputError: with the place and value of each.
        """
        self._source.refuse(problems)

    @property
    def heading(self) -> str:
        """The title, with the values that were changed since it was written, as it heads every output."""
        return "; changed: ".join(filter(None, (self.title or "Train collision", self.changes)))

    @property
    def changes(self) -> str:
        """The values that were changed since the title was written, in words; empty if none was."""
        said = [self._said(name) for name in self.changed[:_MOST_SAID]]
        more = len(self.changed) - len(said)
        return ", ".join(said + ([f"and {more} more"] if more > 0 else []))

    @property
    def subject(self) -> str:
        """What collides, whatever the title says: trains, vehicles, masses, speeds."""
        c = self.collision
        leads = "" if c.train_end == "front" else f", led by its {c.train_end},"
        moving = f"{self._train('M')}{leads} at {c.speed_km_h:.10g} km/h"
        if c.partner == RIGID_WALL:
            return f"{moving} into a rigid wall"
        obstacle = self.obstacles.get(c.partner)
        if obstacle is not None and obstacle.fixed:
            return f"{moving} into {c.partner} (fixed obstacle)"
        end = "" if c.partner_end == "front" else f", struck at its {c.partner_end}"
        v = c.partner_speed_km_h
        moves = "standing" if v == 0 else f"running {'ahead' if v > 0 else 'towards it'} at {abs(v):.10g} km/h"
        partner = self._train("S") if obstacle is None else f"{c.partner} ({obstacle.mass_t:.6g} t obstacle)"
        return f"{moving} into {partner} {moves}{end}"

    @property
    def under_test(self) -> str:
        """The moving train in words: "b_type (6 vehicles, 198 t)"."""
        return self._train("M")

    def _train(self, letter: str) -> str:
        """The moving train, M, or its partner, S, as they were built."""
        cars = cars_as_built(self, letter)
        mass = sum(car.mass_t or 0.0 for car in cars)
        name = self.collision.train if letter == "M" else self.collision.partner
        return f"{name} ({len(cars)} vehicle{'s' if len(cars) > 1 else ''}, {mass:.6g} t)"

    def _said(self, name: str) -> str:
        """A changed value, if it is a plain one, by its name."""
        shortened = name if len(name) <= _LONGEST_NAME else f"{name[: _LONGEST_NAME - 3]}..."
        try:
            values = self.locate(name)
        except InputError:
            return shortened
        one = isinstance(values[0], (int, float, str)) and values.count(values[0]) == len(values)
        return f"{shortened} = {values[0]}" if one and len(str(values[0])) <= _LONGEST else shortened

    def paths(self, name: str) -> tuple[str, ...]:
        """The paths that a parameter stands for; any other name stands for itself."""
        return _paths(name, self.parameters)

    @property
    def told(self) -> tuple[str, ...]:
        """What there is to know of how its files were read, in words.

        What files that build on each other gave up, because it does not go with what is stated over it, and what was
        read in other units.
        """
        return self._source.told

    def places(self, name: str) -> list[Path]:
        """The keys and positions to which a path or parameter leads.

        Raises:
            InputError: if it leads nowhere, or not to one value.
        """
        return [_find(self._source.values, path, self.parameters) for path in self.paths(name)]

    def locate(self, name: str) -> list[Any]:
        """The present values at a path or parameter; None for a key that only has a default.

        Raises:
            InputError: if it leads nowhere, or not to one value.
        """
        return [_at(self._source.values, path) for path in self.places(name)]

    def takes_numbers(self, name: str) -> bool:
        """Whether a number stands at all places to which a path or parameter leads, or is all that may.

        Raises:
            InputError: if it leads nowhere, or not to one value.
        """
        return all(
            isinstance(value, int | float) or type_at(Parts, place) is float
            for place, value in zip(self.places(name), self.locate(name), strict=True)
        )

    def unit(self, name: str) -> str | None:
        """The unit of the value to which a path or parameter leads, "" for none; None if it leads nowhere."""
        if not (name in self.parameters or "." in name or has_key(Parts, name)):
            return None
        try:
            self.places(name)
        except InputError:
            return None
        return unit_of(name) or unit_of(self.paths(name)[0])

    def covers(self, name: str, other: str) -> bool:
        """Whether a new value for a name takes the place of that of another one, which leads there or further in."""
        return any(inner[: len(outer)] == outer for outer in self.places(name) for inner in self.places(other))

    def overlap(self, name: str, other: str) -> bool:
        """Whether two names lead to the same value, or one into what the other leads to; never if one leads nowhere."""
        try:
            return self.twice((name, other)) is not None
        except InputError:
            return False

    def twice(self, names: Iterable[str]) -> tuple[str, str] | None:
        """Two names that lead to the same value, or one into what the other leads to; None if all are apart."""
        owner: dict[Path, str] = {}
        ways: dict[Path, str] = {}
        for name in names:
            for path in self.places(name):
                for n in range(1, len(path) + 1):
                    if path[:n] in owner:
                        return owner[path[:n]], name
                if path in ways:
                    return ways[path], name
                owner[path] = name
                ways |= {path[:n]: name for n in range(1, len(path))}
        return None


def without_words(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a scenario without its title, notes, cover and sources."""
    return {key: value for key, value in values.items() if key not in WORDS}


def marked(source: Source, names: set[str]) -> Source:
    """A source that says which values were changed after its title was written."""
    said = sorted(name for name in names if name.partition(".")[0] not in _UNSAID)
    kept = {key: value for key, value in source.values.items() if key != "changed"}
    return replace(source, values=kept | ({"changed": said} if said else {}))


def changed(source: Source, parameters: Mapping[str, str | list[str]], changes: Mapping[str, Any]) -> Source:
    """The values of a scenario with changes by path, or by a short name from its parameters; it says which are new.

    What is not on the way to a changed value is shared, not copied. A new partner comes first: other changes may be of
    what its file states.

    Raises:
        InputError: if a path leads nowhere.
    """
    values, own = dict(source.values), dict[Path, str]()
    owner: dict[Path, str] = {}
    replaced: list[Path] = []
    groups: list[Path] = []  # that were replaced with all that was in them
    new = set(source.values.get("changed", ()))
    for name, given in sorted(changes.items(), key=lambda change: not names_partner(change[0], parameters)):
        value = plain(given)
        for target in _paths(name, parameters):
            path = _find(values, target, parameters)
            for other in (other for other in owner if other[: len(path)] == path):
                raise InputError(
                    f"{name} takes the place of {owner[other]}, which is set before it: leave one of them out"
                )
            owner[path] = name
            before = _replace(values, path, value)
            if before != value:
                new.add(name)
                replaced.append(path)
            if isinstance(before, (dict, list)):
                groups.append(path)
            own[path] = change(name, value)
            if path == _PARTNER:
                source = with_partner(replace(source, values=values, origins={**source.origins, **own}))
                values = dict(source.values)
    origins = placed(source.origins, groups, own) if groups else {**source.origins, **own}
    values = without_old_sources(values, replaced, changes.get("sources") or ())
    return marked(replace(source, values=values, origins=origins), set() if "title" in changes else new)


def names_partner(name: str, parameters: Mapping[str, str | list[str]]) -> bool:
    """Whether a path or parameter leads to the name of the partner, whose file may bring further values."""
    return dotted(_PARTNER) in _paths(name, parameters)


def without_old_sources(values: dict[str, Any], new: Iterable[Path], stated: Collection[str] = ()) -> dict[str, Any]:
    """The same values, the sources of those at new paths marked as changed, but for entries that are new as well."""
    sources = values.get("sources")
    if not (isinstance(sources, dict) and sources and all(isinstance(name, str) for name in sources)):
        return values  # none, or the checks say what is wrong with them

    def find(name: str) -> tuple[Path, bool] | None:
        try:
            path = _find(values, name, {})
        except InputError:
            return None
        return path, _at(values, path) is not None

    kept = outdated({name: entry for name, entry in sources.items() if name not in stated}, new, find)
    return values | {"sources": kept | {name: sources[name] for name in stated if name in sources}}


def _at(values: Mapping[str, Any], path: Path) -> Any:
    """The value at a path that leads somewhere; None for a key that only has a default."""
    here: Any = values
    for key in path:
        here = here.get(key) if isinstance(here, dict) else here[key]
        if here is None:
            return None
    return here


def _paths(name: str, parameters: Mapping[str, str | list[str]]) -> tuple[str, ...]:
    """The paths that a name stands for."""
    paths = parameters.get(name, name)
    return (paths,) if isinstance(paths, str) else tuple(paths)


def _replace(values: dict[str, Any], path: Path, value: Any) -> Any:
    """Put a value at a path, copying each container on the way; return what was there."""
    here: Any = values
    for key in path[:-1]:
        within = here.get(key, {}) if isinstance(here, dict) else here[key]
        here[key] = here = within.copy()
    last = path[-1]
    before = here.get(last) if isinstance(here, dict) else here[last]
    if value is None and isinstance(here, dict):
        group: Any = Parts
        for key in path[:-1]:
            group = inside(group, key)
        put(here, last, None, group)
    else:
        here[last] = value
    return before


def _find(values: Mapping[str, Any], target: str, parameters: Mapping[str, object]) -> Path:
    """The keys and positions to which a path leads."""
    path: list[str | int] = []
    here: Any = values
    keys = _keys(target)
    for n, text in enumerate(keys):
        key = _resolve(here, text, path, target, parameters if n == 0 else {})
        path.append(key)
        if n < len(keys) - 1:
            here = here.get(key, {}) if isinstance(here, dict) else here[key]
    return tuple(path)


def _resolve(here: Any, text: str, path: list[str | int], target: str, parameters: Mapping[str, object]) -> str | int:
    """The key or position that a part of a path means in the container it is in."""
    last = len(_keys(target)) - 1 == len(path)
    if isinstance(here, dict):
        # a key that has a default may be missing at the end of a path, and so may values by name, and a place under
        # as_built; the checks know whether it exists
        if text in here or (last and path) or path == [_BUILT] or (not path and text in Parts.model_fields):
            return text
        if has_values_by_name(type_at(Parts, (*path, text))):
            return text
        said = f"{target}: there is no {text!r}{_within(path)}"
        place = type_at(Parts, tuple(path))
        if groups_of(place) and groups_of(inside(place, text)):
            raise InputError(f"{said}: state it as a whole, {dotted((*path, text))}={{...}}")
        raise InputError(f"{said}{close_match(text, {*here, *parameters})}")
    if isinstance(here, list):
        position = int(text) if text.isdecimal() and len(text) < _DIGITS else len(here)
        named = [n for n, entry in enumerate(here) if isinstance(entry, dict) and entry.get("name") == text]
        if position < len(here) and named not in ([], [position]):
            raise InputError(
                f"{target}: {text!r} is both a position{_within(path)} and the name of another entry: rename that"
            )
        if len(named) > 1:
            at, *others = (".".join(map(str, (*path, n))) for n in named)
            raise InputError(
                f"{target}: {len(named)} entries are called {text!r}: say which by its position, "
                f"{', '.join([at, *others[:-1]])} or {others[-1]}"
            )
        if named:
            return named[0]
        if position < len(here):
            return position
        raise InputError(f"{target}: there is no entry {text!r}{_within(path)}, which has {len(here)} (0 is the first)")
    raise InputError(f"{target}: {dotted(tuple(path))} is a single value and has no {text!r} inside")


def _keys(target: str) -> list[str]:
    """The parts of a path; a value of a single vehicle or device is one key there, however far down."""
    keys = target.split(".")
    return [*keys[:2], ".".join(keys[2:])] if keys[0] == _BUILT and len(keys) > 2 else keys


def _within(path: list[str | int]) -> str:
    return f" in {dotted(tuple(path))}" if path else " in the scenario"
