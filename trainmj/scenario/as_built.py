"""Single vehicles and devices that differ from what is stated of their kind, by their place in the collision.

A vehicle's place is M1 for the head of the moving train, S1 for the one that is struck. A device's place is its
interface, such as M1-M2; where each side has a device of its own, it is S1-M1 and S1-M1 partner at the front, M1-M2 M1
and M1-M2 M2 behind it. Results report them under the same names.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from copy import copy
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import Field

from trainmj.errors import InputError, close_match
from trainmj.files.parts import Part, Spelt
from trainmj.files.source import Source
from trainmj.scenario.devices import DeviceSpec
from trainmj.scenario.trains import RIGID_WALL, Car, End, VehicleSpec

if TYPE_CHECKING:
    from trainmj.scenario.parts import Parts

Place = Annotated[
    str,
    Field(pattern=r"^([MS]\d{1,3}|[MS]\d{1,3}-([MS]\d{1,3}|wall)( partner| [MS]\d{1,3})?)$"),
    Spelt("must be a vehicle, such as M1, or a device, such as M1-M2, S1-M1 partner or M1-M2 M2"),
]
_DEVICES = ("front", "rear", "coupler")
"""Keys of a vehicle that name devices."""

_TAKEN_OVER = {"brakes", "body"}
"""Groups that a vehicle takes over from its train as a whole, if it has none of its own."""

AsBuilt = dict[Place, Annotated[dict[str, Any], Field(min_length=1)]]
"""New values by their paths below the vehicle or device at a place."""


class Standing(NamedTuple):
    """A vehicle of a train at its place."""

    place: str
    train: str
    position: int  # in the train as it is stated, from 0


class Installed(NamedTuple):
    """A device at its place."""

    place: str
    device: str  # what it is called in the scenario


class Joint(NamedTuple):
    """The devices of an interface, the one nearer to the head of the moving train first."""

    name: str
    devices: tuple[Installed, ...]

    @property
    def places(self) -> tuple[str, ...]:
        """Of its devices."""
        return tuple(at.place for at in self.devices)


def standing(parts: Parts) -> Iterator[Standing]:
    """The vehicles of both trains at their places, each train from the end that meets the other side."""
    for letter, name, end in _trains(parts):
        n = len(parts.trains[name].each())
        for k in range(n):
            yield Standing(f"{letter}{k + 1}", name, k if end == "front" else n - 1 - k)


def joints(parts: Parts) -> Iterator[Joint]:
    """The interfaces of a collision with their devices at their places: the front, then those within each train."""
    c = parts.collision
    obstacle = parts.obstacles.get(c.partner)
    fronts = [device for _, name, end in _trains(parts) for device in parts.trains[name].joints(end)[0]]
    fronts += [obstacle.front] if obstacle else []
    name = "M1-wall" if c.partner == RIGID_WALL or (obstacle and obstacle.fixed) else "S1-M1"
    yield Joint(name, tuple(map(Installed, (name, f"{name} partner"), fronts)))
    for letter, train, end in _trains(parts):
        for n, devices in enumerate(parts.trains[train].joints(end)[1:], start=1):
            near, far = f"{letter}{n}", f"{letter}{n + 1}"
            name = f"{near}-{far}"
            places = (name,) if len(devices) == 1 else (f"{name} {near}", f"{name} {far}")
            yield Joint(name, tuple(map(Installed, places, devices)))


def in_place(parts: Parts, places: Collection[str]) -> list[Standing | Installed]:
    """What is at places; what is nowhere is left out."""
    found: list[Standing | Installed] = list(standing(parts))
    found += [at for joint in joints(parts) for at in joint.devices]
    return [at for at in found if at.place in places]


def _trains(parts: Parts) -> Iterator[tuple[str, str, End]]:
    """The trains that meet, with the letter of their vehicles and the end that meets the other side."""
    c = parts.collision
    yield "M", c.train, c.train_end
    if c.partner in parts.trains:
        yield "S", c.partner, c.partner_end


class Built(NamedTuple):
    """The vehicles and devices that differ, by their places."""

    vehicles: dict[str, VehicleSpec]
    devices: dict[str, DeviceSpec]


class _Vehicle(Part):
    vehicle: VehicleSpec


class _Device(Part):
    device: DeviceSpec


def built(parts: Parts) -> Built:
    """The vehicles and devices that differ, of a collision whose trains and devices exist.

    Raises:
        InputError: if nothing is at a place or path, or a value breaks a rule of its own.
    """
    found = Built({}, {})
    if not parts.as_built:
        return found
    each = {name: parts.trains[name].each() for _, name, _ in _trains(parts)}
    vehicles = {at.place: (parts.trains[at.train], each[at.train][at.position]) for at in standing(parts)}
    values: dict[int, Any] = {}  # of those of a kind

    def stated(part: Part, only: set[str] | None = None) -> Any:
        if id(part) not in values:
            values[id(part)] = part.model_dump(
                include=only, exclude_unset=True, exclude_none=True, by_alias=True, warnings=False
            )
        return values[id(part)]

    devices = {at.place: parts.devices[at.device] for joint in joints(parts) for at in joint.devices}
    for place, changes in parts.as_built.items():
        try:
            if place in vehicles:
                for path in changes.keys() & _DEVICES:
                    raise InputError(
                        f"{path}: is a device, which has a place of its own, such as {next(iter(devices))}"
                    )
                train, vehicle = vehicles[place]
                own = stated(train, _TAKEN_OVER) | stated(vehicle)
                found.vehicles[place] = _altered("vehicle", own, changes).checked(_Vehicle).vehicle
            elif place in devices:
                found.devices[place] = _altered("device", stated(devices[place]), changes).checked(_Device).device
            else:
                raise InputError(f"there is none{close_match(place, [*vehicles, *devices])}")
        except InputError as error:
            raise InputError(f"{place}: {error}") from None
    return found


def _altered(name: str, part: Mapping[str, Any], changes: Mapping[str, Any]) -> Source:
    """The plain values of a part with new ones by path, under a name; the part stays as it is."""
    values = {name: part}
    for path, value in changes.items():
        if other := next((other for other in changes if path.startswith(f"{other}.")), None):
            raise InputError(f"{path}: is in {other}, which is set too: leave one of them out")
        *way, last = (name, *path.split("."))
        here: Any = values
        try:
            for key in way:
                at: Any = _position(key) if isinstance(here, list) else key
                here[at] = here = copy(here[at] if isinstance(here, list) else here.get(at, {}))
            here[_position(last) if isinstance(here, list) else last] = value
        except (IndexError, TypeError, ValueError, AttributeError):
            raise InputError(f"{path}: leads to no value") from None
    return Source(values)


def _position(key: str) -> int:
    """A position in a list, from 0.

    Raises:
        ValueError: if it is none.
    """
    if not (key.isascii() and key.isdecimal()):
        raise ValueError(key)
    return int(key)


def cars_as_built(parts: Parts, letter: str) -> list[Car]:
    """Every vehicle of the train of a letter as it was built, from the end that meets the other side."""
    ((name, end),) = [(name, end) for of, name, end in _trains(parts) if of == letter]
    train, altered = parts.trains[name], parts.built.vehicles
    own = {at.position: altered[at.place] for at in standing(parts) if at.place in altered and at.place[0] == letter}
    if own:
        vehicles = [own.get(n, vehicle) for n, vehicle in enumerate(train.each())]
        train = train.model_copy(update={"vehicles": vehicles})
    return train.cars(end)
