"""A first scenario of one's own: a commented file that runs, from a few numbers or tables of curves and vehicles."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from trainmj.errors import InputError, close_match
from trainmj.files.spreadsheet import is_workbook, read_workbook, tables_on
from trainmj.files.tables import Table, TablePlace, read_beside
from trainmj.files.text import read_bytes
from trainmj.files.yaml import as_yaml
from trainmj.scenario.curves import CurveFile
from trainmj.scenario.trains import RIGID_WALL, VehiclesFile

_TRAIN = "train"

TWIN = "twin"
"""The partner that is a train as the moving one."""

_RISE = 20.0  # mm, over which a device of a constant force comes to it
_STIFFEST = 1000.0  # kN/mm that is proposed; a steeper rise is followed along it
_BODY = 2000.0  # kN at which a car body gives way, if a device is not stronger
_MOST_BYTES = 50_000_000
_SHOWN = 120  # characters of heads in a message
AT_ENDS = ("front", "head", "end", "buffer", "nose", "absorber")
BETWEEN = ("coupler", "between", "joint", "inter", "draw", "bar")
_NO_LABEL = re.compile(r"\W+")


@dataclass(frozen=True)
class Crush:
    """A device.

    Attributes:
        name: in the scenario.
        curve: as it is written there.
        steepest: slope of the curve [kN/mm].
        stroke: where the curve ends [mm].
        force: largest one [kN].
        told: where the curve is from.
    """

    name: str
    curve: str
    steepest: float
    stroke: float
    force: float
    told: str

    @classmethod
    def constant(cls, name: str, force: float, stroke: float) -> Crush:
        """A device that comes to a force and keeps it up to its stroke."""
        rise = min(_RISE, 0.1 * stroke)
        curve = f"{{ stroke_mm: [0, {rise:g}, {stroke:g}], force_kN: [0, {force:g}, {force:g}] }}"
        return cls(name, curve, force / rise, stroke, force, "a constant force: put your own curve here")


@dataclass(frozen=True)
class Data:
    """What tables give: devices by the names of their sheets or files, and where the vehicles are, if anywhere."""

    devices: tuple[Crush, ...]
    vehicles: str = ""

    def device(self, name: str | None, like: Sequence[str], unlike: Sequence[str]) -> Crush:
        """The device of a name, or the first whose name says that it is for this, or that is not for the other place.

        Raises:
            InputError: if there is none of the name.
        """
        by_name = {device.name: device for device in self.devices}
        if name is not None and _label(name) not in by_name:
            raise InputError(f"{name}: no table with a curve has this name{close_match(name, by_name)}")
        if name is not None:
            return by_name[_label(name)]
        fits = (device for device in self.devices if _says(device.name, like))
        others = (device for device in self.devices if not _says(device.name, unlike))
        return next(fits, next(others, self.devices[0]))


def _says(name: str, words: Sequence[str]) -> bool:
    """Whether a name begins or ends with one of some words, the number of a copy aside."""
    text = name.lower().rstrip("_0123456789")
    return text.startswith(tuple(words)) or text.endswith(tuple(words))


def _label(name: str) -> str:
    return _NO_LABEL.sub("_", name.strip()).strip("_") or "device"


def _unit(column: str) -> str | None:
    return CurveFile.unit(column) or VehiclesFile.unit(column)


def read_data(folder: Path, files: Sequence[Path]) -> Data:
    """The curves and vehicles in files that are in the folder of the scenario, or below it.

    Raises:
        InputError: if a file is not there, or a table in it is neither a curve nor a list of vehicles.
    """
    devices: list[Crush] = []
    vehicles: list[str] = []
    for file in files:
        for place, table in tables_in(folder, file):
            written = flow(place)
            if is_curve(table):
                u, f = points(file, table)
                slopes = [(b - a) / (v - w) for w, v, a, b in zip(u, u[1:], f, f[1:], strict=False) if v > w]
                named = _label(place.sheet or file.stem)
                name = named if named not in {d.name for d in devices} else f"{named}_{len(devices) + 1}"
                devices.append(Crush(name, written, max([*slopes, 1.0]), u[-1], max(f), f"from {place.file}"))
            elif is_of_vehicles(table):
                vehicles.append(written)
            else:
                there = ascii(", ".join(table.columns))[:_SHOWN]
                raise InputError(
                    f"{file}{f', {place.sheet}' if place.sheet else ''}: is neither a curve, with columns stroke_mm "
                    f"and force_kN, nor vehicles, with columns name and mass_t; its columns are {there}"
                )
    if not devices:
        raise InputError(f"{', '.join(map(str, files))}: has no curve, with columns stroke_mm and force_kN")
    if len(vehicles) > 1:
        raise InputError(f"{', '.join(map(str, files))}: has {len(vehicles)} tables of vehicles: leave one")
    return Data(tuple(devices), next(iter(vehicles), ""))


def tables_in(folder: Path, file: Path) -> Iterator[tuple[TablePlace, Table]]:
    """The tables of a file in a folder or below it, each with how a scenario there names it.

    Raises:
        InputError: if the file is not there, or one of them cannot be read.
    """
    for place in _places(folder, file):
        yield place, read_beside(folder, place, f"{file}", _unit, VehiclesFile.texts)


def points(file: Path, table: Table) -> tuple[list[float], list[float]]:
    """Strokes [mm] and forces [kN] of a curve in a file.

    Raises:
        InputError: if one is no number.
    """
    try:
        return table.numbers("stroke_mm"), table.numbers("force_kN")
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def is_curve(table: Table) -> bool:
    """Whether a table is a curve."""
    return set(CurveFile.columns) <= set(table.columns)


def is_of_vehicles(table: Table) -> bool:
    """Whether a table is a list of vehicles."""
    return set(VehiclesFile.columns) <= set(table.columns)


def _places(folder: Path, file: Path) -> list[TablePlace]:
    """The tables of a file, each as the scenario will name it."""
    try:
        name = file.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        where = f"the folder of the scenario ({folder})"
        raise InputError(f"{file}: is not in {where} or below it: copy it there") from None
    if not file.is_file():
        raise InputError(f"{file}: there is no such file")
    try:
        content = read_bytes(file, _MOST_BYTES)
        if not is_workbook(content, file.suffix.lower()):
            return [TablePlace(file=name)]
        shown = [sheet for sheet in read_workbook(content) if not sheet.hidden]
        found = [(sheet.name, tables_on(sheet, _unit)) for sheet in shown]
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    return [
        TablePlace(file=name, sheet=sheet, range=str(grid.box) if len(grids) > 1 else None)
        for sheet, grids in found
        for grid in grids
    ]


def flow(place: TablePlace) -> str:
    """A place as one line of a scenario."""
    return as_yaml(place.model_dump(exclude_none=True, exclude_defaults=True)).strip()


@dataclass(frozen=True)
class Start:
    """What a first scenario is made of.

    Attributes:
        title: what the train is called.
        vehicles: how many, or where they are listed, as the scenario says it.
        mass_t: of each that states none.
        length_m: likewise.
        speed_km_h: of the train.
        partner: TWIN, ``rigid_wall``, or the name of a partner that ships.
        ends: device at both ends.
        between: device between vehicles.
        others: devices that vehicles may name.
    """

    title: str
    vehicles: str
    mass_t: float
    length_m: float
    speed_km_h: float
    partner: str
    ends: Crush
    between: Crush
    others: tuple[Crush, ...] = ()

    def text(self) -> str:
        """The scenario file."""
        partner = _TRAIN if self.partner == TWIN else self.partner
        into = {TWIN: "a standing train of the same kind", RIGID_WALL: "a rigid wall"}.get(self.partner, partner)
        used = {self.ends.name: self.ends, self.between.name: self.between} | {d.name: d for d in self.others}
        devices = "\n".join(_device(device, self._use_of(device)) for device in used.values())
        mass = f"\n  mass_t: trains.{_TRAIN}.mass_t" if self.vehicles.isdecimal() else ""
        title = json.dumps(f"{self.title}, {self.speed_km_h:g} km/h into {into}", ensure_ascii=False)
        return f"""\
title: {title}

parameters: # short names for values further down: trainmj run FILE --set speed_km_h=20
  speed_km_h: collision.speed_km_h{mass}

devices: # force over stroke; what else a device may have: docs, "Scenarios"
{devices}
trains:
  {_TRAIN}:
    vehicles: {self.vehicles} # how many, or a list or table of them, from the front end
    mass_t: {self.mass_t:g} # of each that states none of its own
    length_m: {self.length_m:g}
    front: {self.ends.name}
    rear: {self.ends.name}
    coupler: {self.between.name} # between the vehicles

collision:
  train: {_TRAIN}
  speed_km_h: {self.speed_km_h:g}
  partner: {partner} # a train of this file, rigid_wall, or a partner that ships: trainmj scenarios
  rail_friction: 0.008

# limits: # what is judged besides the stroke limits of devices; any column of a result may have one
#   mean_deceleration_g: 5
"""

    def _use_of(self, device: Crush) -> str:
        places = [place for place, one in (("at both ends", self.ends), ("between", self.between)) if one == device]
        return " and ".join(places).replace("between", "between the vehicles") or "for vehicles that name it"


def _device(device: Crush, use: str) -> str:
    stiffness = math.ceil(min(max(2.0 * device.steepest, 1.0), _STIFFEST))
    body = max(_BODY, 100.0 * math.ceil(0.015 * device.force))
    return f"""\
  {device.name}: # {use}
    curve: {device.curve} # {device.told}
    stiffness_kN_per_mm: {stiffness} # of unloading: twice the steepest slope of the curve; try others
    stroke_limit_mm: {device.stroke:g} # the end of the curve; a run says where it is passed
    beyond: {{ kind: car_body, collapse_force_kN: {body:g} }} # what is behind that end
"""
