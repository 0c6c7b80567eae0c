"""From a scenario to the chain that it describes: vehicles in line, devices laid end to end, everything in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from trainmj.collision.body import Body, Bogies
from trainmj.collision.chain import WALL, Brake, Chain, Interface, Vehicle, meet
from trainmj.collision.device import Device
from trainmj.collision.law import KINDS
from trainmj.collision.quantities import columns_of, in_place_of, no_number, of_each
from trainmj.collision.stability import check_step
from trainmj.files.provenance import said
from trainmj.files.source import Problem
from trainmj.scenario import Scenario, scenario_given
from trainmj.scenario.bodies import BodySpec
from trainmj.scenario.parts import Collision
from trainmj.scenario.trains import RIGID_WALL, Car, End
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
    moving, ((near,), *couplers), drawn = _side(c.train, c.train_end, scenario, devices)
    n = len(moving)
    vehicles = [_vehicle(f"M{i + 1}", car, c.speed_km_h, c, drawn, True) for i, car in enumerate(moving)][::-1]
    interfaces = [_coupled(f"M{i + 1}-M{i + 2}", n - i - 2, coupler[::-1]) for i, coupler in enumerate(couplers)][::-1]
    obstacle = scenario.obstacles.get(c.partner)
    fixed = None
    if c.partner == RIGID_WALL:
        interfaces.append(Interface("M1-wall", n - 1, WALL, meet(near, coupled=False), (near,)))
    elif obstacle is not None and obstacle.fixed:
        interfaces.append(_front("M1-wall", n - 1, WALL, near, devices[obstacle.front]))
        fixed = Vehicle("wall", c.partner, math.inf, obstacle.length_m, 0.0, drawing=obstacle.drawn)
    else:
        cars, ((far,), *couplers), drawn = _side(c.partner, c.partner_end, scenario, devices)
        interfaces.append(_front("S1-M1", n - 1, n, near, far))
        vehicles += [_vehicle(f"S{i + 1}", car, c.partner_speed_km_h, c, drawn, False) for i, car in enumerate(cars)]
        interfaces += [_coupled(f"S{i + 1}-S{i + 2}", n + i, coupler) for i, coupler in enumerate(couplers)]
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
        sources={path: said(entry) for path, entry in scenario.sources.items()},
        twin=c.partner == c.train,
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


def _side(
    name: str, end: End, scenario: Scenario, devices: Mapping[str, Device]
) -> tuple[list[Car], list[tuple[Device, ...]], str]:
    """A train or a free obstacle from the end that meets the other side.

    Its vehicles; its devices, those at this end and between each vehicle and the next; what pictures show it as.
    """
    obstacle = scenario.obstacles.get(name)
    if obstacle is not None:
        car = Car(name, obstacle.mass_t, obstacle.length_m, rail_friction=obstacle.rail_friction)
        return [car], [(devices[obstacle.front],)], obstacle.drawn
    train = scenario.trains[name]
    return train.cars(end), [tuple(devices[of] for of in joint) for joint in train.joints(end)], train.drawing


def _vehicle(name: str, car: Car, speed_km_h: float, collision: Collision, drawing: str, leads_right: bool) -> Vehicle:
    assert car.mass_t is not None  # held by the rules of a scenario
    brake = None
    if car.brakes is not None:
        b = car.brakes
        most = math.inf if b.adhesion is None else b.adhesion * car.mass_t * TONNE * G
        brake = Brake(b.whole_kN(car.mass_t) * KN, b.delay_s, b.rise_s, most)
    friction = collision.rail_friction if car.rail_friction is None else car.rail_friction
    speed, body = speed_km_h * KM_H, None if car.body is None else _body(car.body, car, leads_right)
    return Vehicle(name, car.name, car.mass_t * TONNE, car.length_m, speed, friction, brake, drawing, body)


def _body(spec: BodySpec, car: Car, leads_right: bool) -> Body:
    """The body of a vehicle, whose end that meets the other side is on its right or on its left."""
    assert car.mass_t is not None
    own_t = car.mass_t - spec.bogies_t
    near, far = spec.attached_m
    body = Body(
        spec.whole_kN_per_mm(own_t, car.length_m) * KN_PER_MM,
        spec.damping_ratio,
        spec.members,
        math.inf if spec.collapse_force_kN is None else spec.collapse_force_kN * KN,
        spec.hardening_kN_per_mm * KN_PER_MM,
        (far, near) if leads_right else (near, far),
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
