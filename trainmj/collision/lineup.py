"""From a scenario to the chain that it describes: vehicles in line, devices laid end to end, everything in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from trainmj.collision.body import Body, Bogies
from trainmj.collision.chain import WALL, Brake, Chain, Interface, Vehicle, check_step, meet
from trainmj.collision.device import Device
from trainmj.collision.law import KINDS
from trainmj.collision.quantities import columns_of, in_place_of, no_number, of_each
from trainmj.files.source import Problem
from trainmj.scenario import Scenario, scenario_given
from trainmj.scenario.bodies import BodySpec
from trainmj.scenario.parts import Collision
from trainmj.scenario.trains import RIGID_WALL, Car
from trainmj.units import KM_H, KN, KN_PER_MM, MM, MS, TONNE, G


def line_up(scenario: Scenario | str | Path) -> Chain:
    """The chain of vehicles and interfaces that a scenario describes.

    Args:
        scenario: a scenario, or the path of its file.

    Raises:
        InputError: if its step is too large for the stiffest device and the lightest vehicle, or a limit is stated for
            what this chain does not have.
    """
    scenario = scenario_given(scenario)
    c = scenario.collision
    devices = {name: KINDS[spec.law].device(name, spec, scenario) for name, spec in scenario.devices.items()}
    moving = scenario.trains[c.train].cars()
    n = len(moving)
    drawn: str = scenario.trains[c.train].drawing
    vehicles = [_vehicle(f"M{i + 1}", car, c.speed_km_h, c, drawn, True) for i, car in enumerate(moving)][::-1]
    interfaces = [
        _coupled(f"M{i + 1}-M{i + 2}", n - i - 2, [devices[name] for name in (car.coupler or ())][::-1])
        for i, car in enumerate(moving[:-1])
    ][::-1]
    near = devices[str(scenario.trains[c.train].front)]
    obstacle = scenario.obstacles.get(c.partner)
    fixed = None
    if c.partner == RIGID_WALL:
        interfaces.append(Interface("M1-wall", n - 1, WALL, meet(near, coupled=False), (near,)))
    elif obstacle is not None and obstacle.fixed:
        far = devices[obstacle.front]
        interfaces.append(_front("M1-wall", n - 1, WALL, near, far))
        fixed = Vehicle("wall", c.partner, math.inf, obstacle.length_m, 0.0, drawing=obstacle.drawn)
    else:
        struck, cars = _partner(scenario)
        far = devices[struck]
        interfaces.append(_front("S1-M1", n - 1, n, near, far))
        drawn = scenario.trains[c.partner].drawing if obstacle is None else obstacle.drawn
        front_right = c.partner_end == "rear"
        vehicles += [
            _vehicle(f"S{i + 1}", car, c.partner_speed_km_h, c, drawn, front_right) for i, car in enumerate(cars)
        ]
        interfaces += [
            _coupled(f"S{i + 1}-S{i + 2}", n + i, [devices[name] for name in (car.coupler or ())])
            for i, car in enumerate(cars[:-1])
        ]
    s = scenario.simulation
    chain = Chain(
        tuple(vehicles),
        tuple(interfaces),
        n,
        c.gap_mm * MM,
        s.step_ms * MS,
        s.steps_per_record,
        s.time_limit_s,
        s.integrator,
        grade=c.grade_per_mille * 1e-3,
        steps_per_window=s.steps_per_window,
        contact_threshold=s.contact_threshold_kN * KN,
        limits=scenario.limits,
        obstacle=fixed,
        free_flights=tuple(flight * MM for flight in scenario.occupants.free_flight_mm),
    )
    check_step(chain)
    scenario.refuse(_limits(chain))
    return chain


def _limits(chain: Chain) -> Iterator[Problem]:
    """What is wrong with the limits of a chain: names of nothing, and of what is not a number here."""
    for name in chain.limits:
        thing = of_each(chain).get(name) or columns_of(chain).get(name)
        if thing is None:
            instead = in_place_of(name, [*of_each(chain), *columns_of(chain)])
            yield Problem(("limits", name), f"there is no quantity or response of this name{instead}")
        elif reason := no_number(thing, chain):
            yield Problem(("limits", name), reason)


def _partner(scenario: Scenario) -> tuple[str, list[Car]]:
    """The device of what is struck, and its vehicles from there; the coupler of each is that to the next one."""
    c = scenario.collision
    obstacle = scenario.obstacles.get(c.partner)
    if obstacle is not None:
        return obstacle.front, [
            Car(c.partner, obstacle.mass_t, obstacle.length_m, None, rail_friction=obstacle.rail_friction)
        ]
    partner = scenario.trains[c.partner]
    cars = partner.cars()
    if c.partner_end == "rear":
        couplers = [car.coupler[::-1] if car.coupler else None for car in cars[:-1]]
        cars = [car._replace(coupler=coupler) for car, coupler in zip(cars[::-1], [*couplers[::-1], None], strict=True)]
    return str(getattr(partner, c.partner_end)), cars


def _vehicle(name: str, car: Car, speed_km_h: float, collision: Collision, drawing: str, front_right: bool) -> Vehicle:
    assert car.mass_t is not None  # held by the rules of a scenario
    brake = None
    if car.brakes is not None:
        b = car.brakes
        most = math.inf if b.adhesion is None else b.adhesion * car.mass_t * TONNE * G
        brake = Brake(b.whole_kN(car.mass_t) * KN, b.delay_s, b.rise_s, most)
    friction = collision.rail_friction if car.rail_friction is None else car.rail_friction
    speed, body = speed_km_h * KM_H, None if car.body is None else _body(car.body, car, front_right)
    return Vehicle(name, car.name, car.mass_t * TONNE, car.length_m, speed, friction, brake, drawing, body)


def _body(spec: BodySpec, car: Car, front_right: bool) -> Body:
    """The body of a vehicle, whose front end is on its right or on its left."""
    assert car.mass_t is not None
    own_t = car.mass_t - spec.bogies_t
    front, rear = spec.attached_m
    body = Body(
        spec.whole_kN_per_mm(own_t, car.length_m) * KN_PER_MM,
        spec.damping_ratio,
        spec.members,
        math.inf if spec.collapse_force_kN is None else spec.collapse_force_kN * KN,
        spec.hardening_kN_per_mm * KN_PER_MM,
        (rear, front) if front_right else (front, rear),
    )
    if spec.bogies is None:
        return body
    stiffness, mass = spec.bogies.stiffness_kN_per_mm * KN_PER_MM, spec.bogies.mass_t * TONNE
    damping = 2.0 * spec.damping_ratio * math.sqrt(stiffness * mass)
    return replace(body, bogies=Bogies(mass, stiffness, damping, spec.bogies.centres_m))


def _front(name: str, left: int, right: int, near: Device, far: Device) -> Interface:
    """The interface at which the two sides meet; equal devices are reported as one."""
    ends = () if near.is_like(far) else (name, f"{name} partner")
    return Interface(name, left, right, meet(near, far, coupled=False), (near, far), ends)


def _coupled(name: str, left: int, devices: Sequence[Device]) -> Interface:
    """An interface within a train, of one device or of one at each end, from left to right."""
    vehicles = sorted(name.split("-"), reverse=name.startswith("M"), key=lambda vehicle: int(vehicle[1:]))
    ends = tuple(f"{name} {vehicle}" for vehicle in vehicles) if len(devices) > 1 else ()
    return Interface(name, left, left + 1, meet(*devices), tuple(devices), ends)
