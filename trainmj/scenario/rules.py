"""Rules that concern several parts of a scenario: names that must exist, who meets whom, how it is computed."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import chain

from trainmj.errors import InputError
from trainmj.files.kinds import PARTNER
from trainmj.files.resources import shipped_files
from trainmj.files.source import Path, Problem, no_such
from trainmj.scenario.as_built import standing
from trainmj.scenario.bodies import body_rules
from trainmj.scenario.curves import Curve, listed
from trainmj.scenario.parts import Parts
from trainmj.scenario.ranges import MAX_MASS
from trainmj.scenario.rules_of_devices import curve_rules, device_rules, not_read, size_of
from trainmj.scenario.rules_of_plane import plane_rules
from trainmj.scenario.running_gear import carried_rules, type_rules
from trainmj.scenario.tolerances import tolerance_rules
from trainmj.scenario.trains import (
    MAX_VEHICLES,
    PASSENGERS,
    RIGID_WALL,
    CouplerRef,
    End,
    ObstacleSpec,
    TrainSpec,
    VehicleSpec,
)

_LEAST_CLOSING = 0.1  # km/h; a collision whose sides close in at a third of this counts as over
_MOST_STEPS = 5_000_000
_MOST_RECORDS = 3_000_000  # of all vehicles together: 200 MB
_MOST_POINTS = 20_000  # of all curves together, so that a scenario that was written can be read again


def broken_rules(parts: Parts) -> Iterator[Problem]:
    """Every rule that the parts break between them."""
    curves = {name: list(curve_rules(("curves", name), curve)) for name, curve in parts.curves.items()}
    yield from chain.from_iterable(curves.values())
    broken = {name for name, problems in curves.items() if problems}
    size = size_of(parts)
    for name, device in parts.devices.items():
        yield from device_rules(("devices", name), device, parts, broken, size)
    for name, train in parts.trains.items():
        yield from _train(("trains", name), train, parts)
    for name, type_ in parts.vehicle_types.items():
        yield from type_rules(("vehicle_types", name), type_)
    for name, obstacle in parts.obstacles.items():
        yield from _obstacle(name, obstacle, parts)
    for kind, names in (("trains", parts.trains), ("obstacles", parts.obstacles)):
        if RIGID_WALL in names:
            yield Problem((kind, RIGID_WALL), "is reserved for the rigid wall: choose another name")
    yield from _points(parts)
    collision = list(_collision(parts))
    yield from collision
    if not collision:
        as_built = list(_as_built(parts, broken, size))
        yield from as_built or plane_rules(parts)
    yield from _simulation(parts)
    yield from tolerance_rules(("tolerances",), parts.tolerances)


def _as_built(parts: Parts, broken: Collection[str], size: float) -> Iterator[Problem]:
    """Rules of single vehicles and devices."""
    try:
        built = parts.built
    except InputError as error:
        yield Problem(("as_built",), str(error))
        return
    for at in standing(parts) if built.vehicles else ():
        if at.place in built.vehicles:
            yield from _vehicle(("as_built", at.place), parts.trains[at.train], built.vehicles[at.place], parts)
    for place, device in built.devices.items():
        yield from device_rules(("as_built", place), device, parts, broken, size)


def _points(parts: Parts) -> Iterator[Problem]:
    inline = [curve for device in parts.devices.values() for _, ref in device.curves() for _, curve in listed(ref)]
    count = sum(len(c.stroke_mm) for c in [*parts.curves.values(), *inline] if isinstance(c, Curve))
    if count > _MOST_POINTS:
        yield Problem(("curves",), f"have {count} points in all, more than {_MOST_POINTS}: state fewer")


def _train(path: Path, train: TrainSpec, parts: Parts) -> Iterator[Problem]:
    yield from not_read((*path, "vehicles"), train.vehicles)
    for key in ("front", "rear", "ends"):
        yield from _device_ref((*path, key), getattr(train, key), parts)
    yield from _coupler_ref((*path, "coupler"), train.coupler, parts)
    vehicles = train.each()
    yield from _ends(path, train, vehicles)
    for i, vehicle in enumerate(vehicles):
        at = (*path, "vehicles", i) if isinstance(train.vehicles, list) else path
        yield from _coupler_ref((*at, "coupler"), vehicle.coupler, parts)
        for key in ("front", "rear"):
            yield from _device_ref((*at, key), getattr(vehicle, key), parts)
        broken = list(_vehicle(at, train, vehicle, parts))
        if i < len(vehicles) - 1:
            broken += _between(at, train, vehicle, vehicles[i + 1], (*path, "vehicles", i + 1))
        yield from broken
        if broken and at == path:
            return  # the others are the same


def _ends(path: Path, train: TrainSpec, vehicles: list[VehicleSpec]) -> Iterator[Problem]:
    """The device at an end of the train is stated once, and what is between its vehicles in one way."""
    if train.ends and train.coupler:
        rule = "does not go with coupler, in place of which it is: leave one of them out, or state null for it"
        yield Problem((*path, "ends"), rule)
    for key, n in (("front", 0), ("rear", len(vehicles) - 1)):
        if vehicles and getattr(train, key) and getattr(vehicles[n], key):
            rule = f"is at the {key} of the train, which states a device there itself: leave one of them out"
            yield Problem((*path, "vehicles", n, key), rule)


def _between(at: Path, train: TrainSpec, vehicle: VehicleSpec, behind: VehicleSpec, next_: Path) -> Iterator[Problem]:
    """What is between a vehicle and the next one is stated, and in one way."""
    if vehicle.coupler and (vehicle.rear or behind.front):
        end = "rear" if vehicle.rear else f"front of the next vehicle, {behind.name}"
        yield Problem((*at, "coupler"), f"does not go with {end}: a coupler is in place of a device at each end")
    elif not train.between(vehicle, behind):
        cure = "add one, or ends of the train, the device at every end that states none"
        if vehicle.rear:
            rule = f"needs a device at the front of the next vehicle, {behind.name}, with which it is in series: {cure}"
            yield Problem((*at, "rear"), rule)
        elif behind.front:
            rule = (
                f"needs a device at the rear of the vehicle before, {vehicle.name}, with which it is in series: {cure}"
            )
            yield Problem((*next_, "front"), rule)
        else:
            rule = (
                "has no coupler to the next vehicle and no devices at the ends there, and the train states none for all"
            )
            yield Problem(at, f"{rule}: add coupler, or ends of the train")


def _vehicle(path: Path, train: TrainSpec, vehicle: VehicleSpec, parts: Parts) -> Iterator[Problem]:
    """Rules of a vehicle with what its train states for all."""
    mass_t, load = train.mass_t if vehicle.mass_t is None else vehicle.mass_t, train.load_of(vehicle)
    if mass_t is None:
        yield Problem(path, "has no mass_t, and the train states none for all: add one of them")
    missing = [key for key, value in load if key in PASSENGERS and value is None]
    if missing and len(missing) < len(PASSENGERS):
        own = vehicle.load is not None
        others = "the train states none for all" if own else "not every vehicle states its own"
        cure = "a load is seats x share x kg" + "; state seats: 0 for none" * ("seats" in missing)
        at = path if own else path[:2]
        yield Problem((*at, "load"), f"has no {' and no '.join(missing)}, and {others}: {cure}")
    elif mass_t is not None and mass_t + train.load_t(vehicle) > MAX_MASS:
        rule = f"makes {mass_t + train.load_t(vehicle):.12g} t of {mass_t:.12g} t, more than {MAX_MASS:g} t"
        yield Problem((*path, "load"), f"{rule}: kg is the mass of one passenger, freight_t that of all freight")
    length_m = train.length_m if vehicle.length_m is None else vehicle.length_m
    body = train.body_of(vehicle)
    if body is not None and mass_t is not None:
        at = path if vehicle.body is not None else path[:2]
        yield from body_rules((*at, "body"), body, mass_t + train.load_t(vehicle), length_m)
    type_ = vehicle.type or train.type
    if type_ is not None:
        at = (*(path if vehicle.type is not None else path[:2]), "type")
        if type_ not in parts.vehicle_types:
            yield no_such("type of vehicle", at, type_, parts.vehicle_types)
        elif mass_t is not None:
            mass_t += train.load_t(vehicle)
            yield from carried_rules(at, parts.vehicle_types[type_], vehicle.name, mass_t, length_m)


def _obstacle(name: str, obstacle: ObstacleSpec, parts: Parts) -> Iterator[Problem]:
    path: Path = ("obstacles", name)
    if name in parts.trains:
        yield Problem(path, "is the name of a train, too: choose another name")
    yield from _device_ref((*path, "front"), obstacle.front, parts)
    if obstacle.fixed:
        for key in ("mass_t", "rail_friction"):
            if getattr(obstacle, key) is not None:
                rule = "does not go with fixed, as what is fixed does not move: leave one of them out"
                yield Problem((*path, key), rule)
    elif obstacle.mass_t is None:
        yield Problem(path, "has no mass_t: add it, or fixed: true if it does not move")


def _device_ref(path: Path, name: str | None, parts: Parts) -> Iterator[Problem]:
    if name is not None and name not in parts.devices:
        yield no_such("device", path, name, parts.devices)


def _coupler_ref(path: Path, coupler: CouplerRef | None, parts: Parts) -> Iterator[Problem]:
    if isinstance(coupler, list):
        for n, name in enumerate(coupler):
            yield from _device_ref((*path, n), name, parts)
    else:
        yield from _device_ref(path, coupler, parts)


def _collision(parts: Parts) -> Iterator[Problem]:
    collision = parts.collision
    if collision.train not in parts.trains:
        yield no_such("train", ("collision", "train"), collision.train, parts.trains)
    else:
        yield from _at_end(collision.train, collision.train_end, parts)
    yield from _partner(parts)
    if collision.speed_km_h - collision.partner_speed_km_h < _LEAST_CLOSING - 1e-9:
        yield Problem(
            ("collision", "speed_km_h"),
            f"must be more than partner_speed_km_h ({collision.partner_speed_km_h:.12g}) by {_LEAST_CLOSING:g} km/h or "
            "more: the two sides must approach each other",
        )
    sides = [parts.trains[name] for name in (collision.train, collision.partner) if name in parts.trains]
    count = sum(len(train.each()) for train in sides) + (collision.partner in parts.obstacles)
    if count > MAX_VEHICLES:
        yield Problem(("collision",), f"has more than {MAX_VEHICLES} vehicles in all")
    bodies = [body for train in sides for car in train.cars() if (body := car.body) is not None]
    count += sum(body.n_points - 1 for body in bodies)
    what = "masses" if bodies else "vehicles"
    s = parts.simulation
    if count * s.time_limit_s * 1e3 / s.record_every_ms > _MOST_RECORDS:
        yield Problem(
            ("simulation", "record_every_ms"),
            f"gives more than {_MOST_RECORDS} records of {count} {what}: increase it, or shorten time_limit_s",
        )


def _partner(parts: Parts) -> Iterator[Problem]:
    """Rules of what is struck."""
    c = parts.collision
    obstacle = parts.obstacles.get(c.partner)
    if obstacle is not None and c.partner_end != "front":
        yield Problem(
            ("collision", "partner_end"), f"must be front: {c.partner} is an obstacle, which has no other end"
        )
    fixed = "the rigid wall" if c.partner == RIGID_WALL else c.partner if obstacle and obstacle.fixed else ""
    if fixed and c.partner_speed_km_h != 0:
        yield Problem(("collision", "partner_speed_km_h"), f"must be 0: {fixed} does not move")
    if c.partner in parts.trains:
        if (c.partner, c.partner_end) != (c.train, c.train_end):
            yield from _at_end(c.partner, c.partner_end, parts)
    elif obstacle is None and c.partner != RIGID_WALL:
        known = [*parts.trains, *parts.obstacles, RIGID_WALL, *shipped_files(PARTNER.ending)]
        yield no_such("train, obstacle or partner file", ("collision", "partner"), c.partner, known)


def _at_end(name: str, end: End, parts: Parts) -> Iterator[Problem]:
    """The end of a train that meets the other side has a device."""
    train = parts.trains[name]
    if train.each() and not train.joints(end)[0]:
        yield Problem(("trains", name), f"states no device at its {end}, the end that meets the other side: add {end}")


def _simulation(parts: Parts) -> Iterator[Problem]:
    s = parts.simulation
    for key, length, steps in (
        ("record_every_ms", s.record_every_ms, s.steps_per_record),
        ("averaging_ms", s.averaging_ms or 0.0, s.steps_per_window),
    ):
        if abs(length - steps * s.step_ms) > 1e-9 * length:
            yield Problem(("simulation", key), f"must be a whole multiple of step_ms ({s.step_ms:.12g} ms)")
    if s.time_limit_s * 1e3 < s.record_every_ms * (1 - 1e-9):
        yield Problem(("simulation", "time_limit_s"), f"must be at least record_every_ms ({s.record_every_ms:.12g} ms)")
    if s.time_limit_s * 1e3 / s.step_ms > _MOST_STEPS:
        yield Problem(
            ("simulation", "time_limit_s"),
            f"takes more than {_MOST_STEPS} steps: shorten it, or increase step_ms",
        )
