"""Partners in files of their own: wagons, lorries and reference trains that any train can be run into.

A scenario whose ``collision.partner`` is the name of such a file, and of no train or obstacle of its own, takes over
what the file states: as a train or obstacle of that name, with devices, curves and sources.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path as FilePath
from typing import Annotated, Any

from pydantic import Field

from trainmj.errors import InputError
from trainmj.files.kinds import PARTNER
from trainmj.files.parts import Either, Notes, Part, Title
from trainmj.files.provenance import Sources, lost
from trainmj.files.resources import shipped_files
from trainmj.files.source import Path, Problem, Source, dotted
from trainmj.files.text import beside
from trainmj.files.yaml import read_yaml
from trainmj.scenario.curves import Curve, CurveFile
from trainmj.scenario.devices import DeviceSpec
from trainmj.scenario.parts import MAX_NAMES, Parts
from trainmj.scenario.ranges import Key
from trainmj.scenario.reading import with_tables
from trainmj.scenario.rules import broken_rules
from trainmj.scenario.running_gear import VehicleType
from trainmj.scenario.trains import RIGID_WALL, ObstacleSpec, TrainSpec

_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_GROUPS = ("curves", "devices", "vehicle_types")
_HOMES = {"train": "trains", "obstacle": "obstacles"}


class PartnerFile(Part, title="partner file"):
    """What can be struck by any train: a train or an obstacle, with its devices and where its values come from."""

    title: Title = Field(description="one line that says what it is")
    notes: Notes = Field(default="", description="what a user of it must know")
    sources: Sources = Field(default_factory=dict, description="where values come from, by path")
    curves: dict[Key, Annotated[Curve | CurveFile, Either()]] = Field(
        default_factory=dict, max_length=MAX_NAMES, description="curves that several devices share, by name"
    )
    devices: dict[Key, DeviceSpec] = Field(max_length=MAX_NAMES, description="its devices, by name")
    vehicle_types: dict[Key, VehicleType] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="what carries its vehicles in the vertical plane, by name",
    )
    train: TrainSpec | None = Field(default=None, description="a train or wagon")
    obstacle: ObstacleSpec | None = Field(default=None, description="in its place: an obstacle that is no train")


def shipped_partners() -> dict[str, FilePath]:
    """Names and paths of the partners that ship with trainmj."""
    return shipped_files(PARTNER.ending)


def read_partner(file: FilePath) -> Source:
    """A partner file, checked, with the tables that it names.

    Raises:
        InputError: if it cannot be read, or a key or value of it is wrong.
    """
    source = with_tables(read_yaml(file), PartnerFile)
    checked = source.checked(PartnerFile)
    if (checked.train is None) == (checked.obstacle is None):
        raise source.refusal([Problem((), "must state a train or an obstacle, one of them")])
    source.refuse(_broken_rules(source))
    return source


def _broken_rules(source: Source) -> Iterator[Problem]:
    """Every rule that the parts of a partner file break between them: it needs nothing of a scenario."""
    values: dict[str, Any] = {key: dict(source.values.get(key) or {}) for key in _GROUPS}
    values |= {home: {key: source.values[key]} if key in source.values else {} for key, home in _HOMES.items()}
    values["collision"] = {"train": "train", "speed_km_h": 10.0, "partner": RIGID_WALL}
    for problem in broken_rules(Parts.model_validate(values)):
        home, *rest = problem.path
        if home != "collision":
            yield Problem(tuple(rest) if home in _HOMES.values() else problem.path, problem.rule)
    yield from lost(source.values)


def with_partner(source: Source) -> Source:
    """The values of a scenario with those of the partner file that its collision names; the same if it names none.

    Raises:
        InputError: if the file is wrong, or states something of a name that the scenario has as well.
    """
    collision = source.values.get("collision")
    name = collision.get("partner") if isinstance(collision, Mapping) else None
    homes = [values for home in _HOMES.values() if isinstance(values := source.values.get(home), Mapping)]
    if not isinstance(name, str) or any(name in home for home in homes):
        return source
    return with_partner_file(source, name, source.folder)


def with_partner_file(source: Source, name: str, folder: FilePath) -> Source:
    """The values of a scenario with those of the partner file of a name, in a folder or shipped; the same without one.

    Raises:
        InputError: as :func:`with_partner`.
    """
    if name == RIGID_WALL or not _KEY.fullmatch(name):
        return source
    file = beside(folder, name + PARTNER.ending, source.said("collision", "partner"))
    file = file or shipped_partners().get(name)
    if file is None:
        return source  # the rules of a scenario say what there is
    status = file.stat()
    return _merged(source, _read(file, status.st_mtime_ns, status.st_size), name)


@lru_cache(maxsize=32)
def _read(file: FilePath, *_: int) -> Source:
    """A partner file as it was at a time, of a size; not to be changed."""
    return read_partner(file)


def _merged(source: Source, partner: Source, name: str) -> Source:
    values, origins = dict(source.values), dict(source.origins)
    for path, value in _placed(partner, name):
        group, thing = str(path[0]), path[1]
        there = values.get(group) or {}
        if not isinstance(there, Mapping):
            return source  # the checks say what is wrong with it
        if group != "sources" and thing in there and there[thing] != value:
            raise InputError(
                f"{source.said(*path)}: there is one of this name in {partner.origin() or name}, which "
                f"collision.partner takes over: rename it"
            )
        values[group] = {**there, thing: value}
    origins |= {home: place for path, place in partner.origins.items() if (home := _home(path, name))}
    told = tuple(dict.fromkeys((*source.told, *partner.told)))
    return replace(source, values=values, origins=origins, files=source.files | partner.files, told=told)


def _placed(partner: Source, name: str) -> Iterator[tuple[Path, Any]]:
    """What a partner file states, each thing with its place in a scenario."""
    for key, value in partner.values.items():
        stated: dict[Path, Any] = {(key,): value} if key in _HOMES else {}
        if key in (*_GROUPS, "sources"):
            stated = {(key, thing): inner for thing, inner in value.items()}
        for path, inner in stated.items():
            if home := _home(path, name):
                yield home, inner


def _home(path: Path, name: str) -> Path:
    """Where a value of a partner file stands in a scenario; empty for what has no place there."""
    if not path or path[0] in ("title", "notes"):
        return ()
    if path[0] == "sources":
        of = dotted(_home(tuple(str(path[1]).split(".")), name)) if len(path) > 1 else ""
        return ("sources", of, *path[2:]) if of else ()
    return (_HOMES[str(path[0])], name, *path[1:]) if path[0] in _HOMES else path
