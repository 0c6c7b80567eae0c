"""Rules of the vertical plane: what every vehicle and device of a collision needs there, and who may meet whom."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

from trainmj.files.source import Path, Problem, dotted, no_such
from trainmj.scenario.as_built import Installed, cars_as_built, joints, standing
from trainmj.scenario.devices import AnyDevice
from trainmj.scenario.lines import LineSpec, Strut
from trainmj.scenario.parts import Parts
from trainmj.scenario.trains import Car

_NAMES = {"strut": "a strut", "face": "a face"}
_COPY = "; partners that ship have none: copy the file of such a one beside the scenario, and add it there"
"""How to add to a partner what it lacks."""


def plane_rules(parts: Parts) -> Iterator[Problem]:
    """What is wrong with the vertical plane of a collision whose trains, devices and single parts exist."""
    letters = ("M", "S") if parts.collision.partner in parts.trains else ("M",)
    cars = {f"{of}{n + 1}": car for of in letters for n, car in enumerate(cars_as_built(parts, of))}
    for key in ("offset_mm", "pitch_mrad"):
        for name in getattr(parts.collision, key):
            if name not in cars and name not in letters:
                yield no_such("vehicle on bogies", ("collision", key, name), name, [*letters, *cars])
    if parts.plane == "vertical":
        if parts.simulation.integrator == "events":
            yield Problem(
                ("simulation", "integrator"), "follows devices along the track only: state euler, or plane: line"
            )
        yield from dict.fromkeys((*_vehicles(parts, cars), *_devices(parts, cars)))


def _vehicles(parts: Parts, cars: dict[str, Car]) -> Iterator[Problem]:
    """Every vehicle stands on bogies, and none gives."""
    for place, name, position in standing(parts):
        train, car = parts.trains[name], cars[place]
        listed: Path = ("trains", name, "vehicles", position) if isinstance(train.vehicles, list) else ("trains", name)
        path = ("as_built", place) if place in parts.built.vehicles else listed
        if car.type is None:
            cure = "add type, one of vehicle_types" + ("" if parts.vehicle_types else ", of which there is none yet")
            cure += _COPY if place.startswith("S") and name != parts.collision.train else ""
            rule = f"has no type, and plane: vertical needs to know what vehicles stand on: {cure}"
            none = path[0] != "as_built" and not any(vehicle.type for vehicle in train.each())
            yield Problem(path[:2] if none else path, rule)
        if car.body is not None:
            own = train.each()[position].body is not None or path[0] == "as_built"
            rule = "gives, and bodies that give move along the track only: state body: rigid, or plane: line"
            yield Problem((*(path if own else path[:2]), "body"), rule)


class _End(NamedTuple):
    """A device at its place, with the vehicles that it stands on."""

    path: Path
    device: AnyDevice
    vehicles: tuple[str, ...]

    @property
    def lines(self) -> list[tuple[Path, LineSpec | None]]:
        """The line of each path through it, with where it is stated."""
        return [((*self.path, *below, "line"), line) for below, line in self.device.lines()]


def _devices(parts: Parts, cars: dict[str, Car]) -> Iterator[Problem]:
    """Every device in use acts along lines, and those that meet along lines of the same kinds."""
    for n, joint in enumerate(joints(parts)):
        ahead, behind = joint.name.split("-")
        vehicles = (behind, ahead) if n == 0 else (ahead, behind)  # S1-M1: that of the moving train comes first
        if joint.name.endswith("-wall"):
            vehicles = (ahead, "")
        shared = len(joint.devices) == 1
        ends = [
            _end(parts, at, vehicles if shared else (vehicle,))
            for at, vehicle in zip(joint.devices, vehicles, strict=False)
        ]
        problems = [problem for end in ends for problem in _lines(parts, end, cars)]
        yield from problems
        if not problems:
            for one, other in pairwise(ends):
                yield from _meeting(one, other)


def _end(parts: Parts, at: Installed, vehicles: tuple[str, ...]) -> _End:
    own = parts.built.devices.get(at.place)
    path = ("devices", at.device) if own is None else ("as_built", at.place)
    return _End(path, own or parts.devices[at.device], vehicles)


def _lines(parts: Parts, end: _End, cars: dict[str, Car]) -> Iterator[Problem]:
    """A device states its lines, which fit onto its vehicles."""
    tied = parts.ties == "tied" or "tied" in parts.bracket
    for at, line in end.lines:
        if line is None:
            rule = "is missing: plane: vertical needs the line along which it acts, with acts: strut or acts: face"
            of_partner = parts.collision.partner != parts.collision.train and all(v[:1] == "S" for v in end.vehicles)
            yield Problem(at, rule + (_COPY if of_partner else ""))
            continue
        holds = "swing" if isinstance(line, Strut) else "tie"
        if tied and getattr(line, holds) == "none":
            group = "{ free_mrad, MN_m_per_rad }" if holds == "swing" else "{ friction, tooth_kN, kN_per_mm }"
            rule = f"is none, and ties: tied holds ends by its stiffness: state {group}, or leave tied out"
            yield Problem((*at, holds), rule)
        pin_m = line.pin_m if isinstance(line, Strut) else 0.0
        for vehicle in end.vehicles:
            half = 0.5 * cars[vehicle].length_m if vehicle in cars else math.inf
            if pin_m > half:
                yield Problem((*at, "pin_m"), f"must be at most half the length of {vehicle}, {half:.12g} m")


def _meeting(one: _End, other: _End) -> Iterator[Problem]:
    """Two devices that meet have as many lines, and path by path of the same kind."""
    own, theirs = one.lines, other.lines
    if len(own) != len(theirs):
        rule = (
            f"has {len(theirs)} of the lines of the vertical plane and meets {dotted(one.path)}, which has {len(own)}: "
            "each needs as many stages behind a shear-off as the other"
        )
        yield Problem(other.path, rule)
        return
    for (at, line), (there, its) in zip(own, theirs, strict=True):
        if line is not None and its is not None and line.acts != its.acts:
            rule = f"is {_NAMES[its.acts]} and meets {dotted(at)}, {_NAMES[line.acts]}: both must be of one kind"
            yield Problem((*there, "acts"), rule)
