"""From a scenario to the chain that it describes: vehicles in line, devices laid end to end, everything in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from trainmj.collision.body import Body, Bogies
from trainmj.collision.chain import WALL, Brake, Chain, Interface, Vehicle, meet
from trainmj.collision.device import Device
from trainmj.collision.gear import BOGIES, Gear, Suspension
from trainmj.collision.law import KINDS
from trainmj.collision.line import Line, LineEnd
from trainmj.collision.quantities import columns_of, in_place_of, no_limit, no_number, of_each, only_in_plane
from trainmj.collision.stability import check_step
from trainmj.files.provenance import said
from trainmj.files.source import Problem
from trainmj.scenario import Scenario, scenario_given
from trainmj.scenario.as_built import Installed, cars_as_built, joints
from trainmj.scenario.bodies import BodySpec
from trainmj.scenario.devices import AnyDevice
from trainmj.scenario.lines import LineSpec, Strut, Ties
from trainmj.scenario.parts import Collision
from trainmj.scenario.running_gear import SuspensionSpec, VehicleType
from trainmj.scenario.trains import RIGID_WALL, Car
from trainmj.symbol import square_root
from trainmj.units import KM_H, KN, KN_PER_MM, KN_S_PER_M, MM, MN_M, MRAD, MS, TONNE, G


def line_up(scenario: Scenario | str | Path) -> Chain:
    """The chain of vehicles and interfaces that a scenario describes.

    Args:
        scenario: a scenario, or the path of its file.

    Raises:
        InputError: if its step is too large for the stiffest device and the lightest vehicle, a limit is stated for
            what this chain does not have, or a vehicle is pitched up to a stop of its suspension.
    """
    scenario = scenario_given(scenario)
    c = scenario.collision
    moving = cars_as_built(scenario, "M")
    n = len(moving)
    vehicles = [_vehicle(f"M{i + 1}", car, c.speed_km_h, scenario, True) for i, car in enumerate(moving)][::-1]
    obstacle, fixed = scenario.obstacles.get(c.partner), None
    if obstacle is not None and obstacle.fixed:
        fixed = Vehicle("wall", c.partner, math.inf, obstacle.length_m, 0.0, drawing=obstacle.drawn)
    elif c.partner != RIGID_WALL:
        speed, cars = c.partner_speed_km_h, _partner(scenario)
        vehicles += [_vehicle(f"S{i + 1}", car, speed, scenario, False) for i, car in enumerate(cars)]
    s = scenario.simulation
    flattened = scenario.plane == "line" and scenario.states_the_plane
    limits = {name: most for name, most in scenario.limits.items() if not (flattened and only_in_plane(name))}
    chain = Chain(
        tuple(vehicles),
        tuple(_interfaces(scenario, n, vehicles[n - 1])),
        n,
        c.gap_mm * MM,
        s.step_ms * MS,
        s.steps_per_record,
        s.time_limit_s,
        s.integrator,
        grade=c.grade_per_mille * 1e-3,
        steps_per_window=s.steps_per_window,
        contact_threshold=s.contact_threshold_kN * KN,
        limits=limits,
        sources={path: said(entry) for path, entry in scenario.sources.items()},
        twin=c.partner == c.train,
        obstacle=fixed,
        free_flights=tuple(flight * MM for flight in scenario.occupants.free_flight_mm),
        plane=scenario.plane == "vertical",
        flattened=flattened,
    )
    scenario.refuse(_pitches(chain, c.pitch_mrad))
    check_step(chain)
    scenario.refuse(_limits(chain))
    return chain


def _pitches(chain: Chain, stated: Mapping[str, float]) -> Iterator[Problem]:
    """What is wrong with pitches at the start: suspensions at a stop, where nothing is in balance."""
    found: set[str] = set()
    for vehicle in chain.vehicles:
        gear, key = vehicle.gear, _stated_by(stated, vehicle.name)
        if gear is None or gear.pitch == 0.0 or key in found:
            continue
        pressed = gear.standing.q[list(BOGIES)]
        if pressed.min() <= -gear.secondary.lift_stop or pressed.max() >= gear.secondary.bump_stop:
            most = float(abs(pressed).max()) / MM
            rule = (
                f"moves a secondary suspension of {vehicle.name} by {most:.3g} mm, to a stop or beyond: state a smaller"
            )
            found.add(key)
            yield Problem(("collision", "pitch_mrad", key), f"{rule} pitch")


def _limits(chain: Chain) -> Iterator[Problem]:
    """What is wrong with the limits of a chain: names of nothing, and of what is not a number here."""
    for name in chain.limits:
        thing = of_each(chain).get(name) or columns_of(chain).get(name)
        if thing is None:
            instead = in_place_of(name, [*of_each(chain), *columns_of(chain)])
            yield Problem(("limits", name), f"there is no quantity or response of this name{instead}")
        elif reason := no_number(thing, chain) or no_limit(thing):
            yield Problem(("limits", name), reason)


def _partner(scenario: Scenario) -> list[Car]:
    """The vehicles of a partner that moves, from the end that is struck."""
    name = scenario.collision.partner
    obstacle = scenario.obstacles.get(name)
    if obstacle is None:
        return cars_as_built(scenario, "S")
    friction, drawn = obstacle.rail_friction, obstacle.drawn
    return [Car(name, obstacle.mass_t, obstacle.length_m, rail_friction=friction, drawing=drawn)]


def _interfaces(scenario: Scenario, n_moving: int, head: Vehicle) -> list[Interface]:
    """The interfaces from left to right; head leads the moving train."""
    made: dict[str, Device] = {}

    def device(at: Installed) -> Device:
        own = scenario.built.devices.get(at.place)
        if own is None and at.device in made:
            return made[at.device]
        spec = own or scenario.devices[at.device]
        found = replace(KINDS[spec.law].device(at.device, spec, scenario), lines=_ends_of_lines(spec, scenario))
        return found if own else made.setdefault(at.device, found)

    front, *behind = joints(scenario)
    devices = tuple(map(device, front.devices))
    like = len(devices) == 1 or devices[0].is_like(devices[1])  # equal ones are reported as one
    right = WALL if front.name.endswith("wall") else n_moving
    ends = () if like else front.places
    elements = meet(*devices, coupled=False, lines=_lines(devices, False, head if right == WALL else None))
    found = [Interface(front.name, n_moving - 1, right, elements, devices, ends)]
    for joint in behind:
        leads_right = joint.name.startswith("M")
        order = -1 if leads_right else 1
        devices = tuple(map(device, joint.devices[::order]))
        ends = joint.places[::order] if len(devices) > 1 else ()
        left = n_moving - len(found) - 1 if leads_right else len(found)
        elements = meet(*devices, lines=_lines(devices, True))
        found.insert(0 if leads_right else left, Interface(joint.name, left, left + 1, elements, devices, ends))
    return found


def _lines(devices: tuple[Device, ...], inner: bool, before_wall: Vehicle | None = None) -> tuple[Line, ...]:
    """The line of each path between two vehicles, or one and the wall before which it comes; none without the plane."""
    left, right = devices[0].lines, devices[-1].lines
    if before_wall is not None and len(devices) == 1:
        right = tuple(_on_wall(end, before_wall) for end in left)
    last, walled = len(left) - 1, before_wall is not None
    return tuple(Line(*ends, walled, inner, shears=k < last) for k, ends in enumerate(zip(left, right, strict=True)))


def _ends_of_lines(spec: AnyDevice, scenario: Scenario) -> tuple[LineEnd, ...]:
    """The ends of the lines of a device, one for each path through it; none along the track only."""
    if scenario.plane == "line":
        return ()
    stated = (line for _, line in spec.lines() if line is not None)  # the rules want them all
    return tuple(_end_of_line(line, scenario.ties) for line in stated)


def _end_of_line(line: LineSpec, ties: Ties) -> LineEnd:
    """A line as its device states it, with what ties make of it."""
    height = line.height_mm * MM
    if isinstance(line, Strut):
        end = LineEnd(strut=True, height=height, pin=line.pin_m)
        if isinstance(line.swing, str) or ties == "free":
            return end
        free = 0.0 if ties == "tied" else line.swing.free_mrad * MRAD
        return replace(end, free=free, swing=line.swing.MN_m_per_rad * MN_M)
    end = LineEnd(strut=False, height=height, overlap=line.overlap_mm * MM)
    if isinstance(line.tie, str) or ties == "free":
        return end
    tooth = math.inf if ties == "tied" else line.tie.tooth_kN * KN
    return replace(end, friction=line.tie.friction, tooth=tooth, tie=line.tie.kN_per_mm * KN_PER_MM)


def _on_wall(end: LineEnd, before: Vehicle) -> LineEnd:
    """What a wall has for an end of a line: a face, at the height at which the vehicle before it stands."""
    gear = before.gear
    assert gear is not None  # held by the rules of a scenario
    along, up = 0.5 * before.length - gear.cog_x, end.height - gear.cog_height
    height = gear.cog_height + gear.offset + along * math.sin(gear.pitch) + up * math.cos(gear.pitch)
    return replace(end, height=height, pin=0.0, free=math.inf, swing=0.0)


def _vehicle(name: str, car: Car, speed_km_h: float, scenario: Scenario, leads_right: bool) -> Vehicle:
    assert car.mass_t is not None  # held by the rules of a scenario
    brake = None
    if car.brakes is not None:
        b = car.brakes
        most = math.inf if b.adhesion is None else b.adhesion * car.mass_t * TONNE * G
        brake = Brake(b.whole_kN(car.mass_t) * KN, b.delay_s, b.rise_s, most)
    friction = scenario.collision.rail_friction if car.rail_friction is None else car.rail_friction
    speed, body = speed_km_h * KM_H, None if car.body is None else _body(car.body, car, leads_right)
    gear = None
    if scenario.plane == "vertical" and car.type is not None:  # obstacles have none
        gear = _gear(scenario.vehicle_types[car.type], name, car, scenario.collision, leads_right)
    return Vehicle(name, car.name, car.mass_t * TONNE, car.length_m, speed, friction, brake, car.drawing, body, gear)


def _gear(spec: VehicleType, name: str, car: Car, collision: Collision, leads_right: bool) -> Gear:
    """What carries a vehicle, whose end that meets the other side is on its right or on its left."""
    assert car.mass_t is not None
    bogies, own_t = spec.bogies, car.mass_t - spec.bogies.mass_t
    ahead = 1.0 if leads_right else -1.0
    return Gear(
        own_t * TONNE,
        spec.body.inertia_t_m2(own_t) * TONNE,
        spec.body.cog_height_m,
        (-ahead if car.turned else ahead) * spec.body.cog_x_m,
        bogies.centres_m,
        bogies.wheelbase_m,
        bogies.frame_t * TONNE,
        bogies.frame_pitch_t_m2 * TONNE,
        bogies.cog_height_m,
        bogies.wheelset_t * TONNE,
        bogies.axle_height_m,
        bogies.link_height_m,
        _suspension(spec.secondary),
        _suspension(spec.primary),
        spec.rail.kN_per_mm * KN_PER_MM,
        spec.rail.kN_s_per_m * KN_S_PER_M,
        collision.offset_mm.get(_stated_by(collision.offset_mm, name), 0.0) * MM,
        ahead * collision.pitch_mrad.get(_stated_by(collision.pitch_mrad, name), 0.0) * MRAD,
    )


def _suspension(spec: SuspensionSpec) -> Suspension:
    lift, bump = (math.inf if isinstance(mm, str) else mm * MM for mm in (spec.lift_stop_mm, spec.bump_stop_mm))
    stop = 0.0 if spec.stop_kN_per_mm is None else spec.stop_kN_per_mm * KN_PER_MM
    return Suspension(spec.kN_per_mm * KN_PER_MM, spec.kN_s_per_m * KN_S_PER_M, lift, bump, stop)


def _stated_by(values: Mapping[str, float], name: str) -> str:
    """The key by which a value is stated of a vehicle: its own, or that of its side."""
    return name if name in values else name[0]


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
    damping = 2.0 * spec.damping_ratio * square_root(stiffness * mass)
    return replace(body, bogies=Bogies(mass, stiffness, damping, spec.bogies.centres_m))
