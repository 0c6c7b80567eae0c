"""From a scenario to the chain that it describes: vehicles in line, devices laid end to end, everything in SI."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from trainmj.collision.chain import WALL, Chain, Interface, Vehicle, check_step
from trainmj.collision.device import Device, Envelope, Stage, in_series
from trainmj.collision.quantities import columns_of, no_number, of_each
from trainmj.files.source import Problem, no_such
from trainmj.scenario import Scenario, scenario_given
from trainmj.scenario.devices import CrushDevice
from trainmj.scenario.parts import Parts
from trainmj.scenario.trains import RIGID_WALL, Car
from trainmj.units import KM_H, KN, KN_PER_MM, KN_S_PER_M, MM, MS, TONNE

_LATER = "cannot be computed yet"


def line_up(scenario: Scenario | str | Path) -> Chain:
    """The chain of vehicles and interfaces that a scenario describes.

    Args:
        scenario: a scenario, or the path of its file.

    Raises:
        InputError: if its step is too large for the stiffest device and the lightest vehicle, or a limit is stated for
            what this chain does not have.
    """
    scenario = scenario_given(scenario)
    scenario.refuse(_not_computed(scenario))
    c = scenario.collision
    crushed = {name: spec for name, spec in scenario.devices.items() if isinstance(spec, CrushDevice)}
    devices = {name: _device(name, spec, scenario) for name, spec in crushed.items()}
    train = scenario.trains[c.train]
    moving = train.cars()
    vehicles = [_vehicle(f"M{i + 1}", car, c.speed_km_h) for i, car in enumerate(moving)][::-1]
    interfaces = [
        _joint(f"M{i + 1}-M{i + 2}", len(moving) - i - 2, devices[(moving[i].coupler or ("",))[0]])
        for i in range(len(moving) - 1)
    ][::-1]
    near = devices[str(train.front)]
    n = len(moving)
    if c.partner == RIGID_WALL:
        interfaces.append(Interface("M1-wall", n - 1, WALL, near.envelope, (near.envelope.stroke,), (near,)))
    else:
        partner = scenario.trains[c.partner]
        cars = partner.cars()
        couplers = [(car.coupler or ("",))[0] for car in cars[:-1]]
        if c.partner_end == "rear":
            cars, couplers = cars[::-1], couplers[::-1]
        far = devices[str(getattr(partner, c.partner_end))]
        envelope, strokes = in_series(near, far)
        interfaces.append(Interface("S1-M1", n - 1, n, envelope, strokes, (near, far)))
        vehicles += [_vehicle(f"S{i + 1}", car, c.partner_speed_km_h) for i, car in enumerate(cars)]
        interfaces += [_joint(f"S{i + 1}-S{i + 2}", n + i, devices[str(name)]) for i, name in enumerate(couplers)]
    s = scenario.simulation
    chain = Chain(
        tuple(vehicles),
        tuple(interfaces),
        n,
        c.gap_mm * MM,
        c.rail_friction,
        s.step_ms * MS,
        s.steps_per_record,
        s.time_limit_s,
        s.integrator,
        scenario.limits,
    )
    check_step(chain)
    scenario.refuse(_limits(chain))
    return chain


def _not_computed(scenario: Scenario) -> Iterator[Problem]:
    """What a scenario may state and this version does not compute."""
    c = scenario.collision
    if c.grade_per_mille:
        yield Problem(("collision", "grade_per_mille"), _LATER)
    if c.partner in scenario.obstacles:
        yield Problem(("collision", "partner"), f"an obstacle {_LATER}")
    sides = {name: scenario.trains[name] for name in (c.train, c.partner) if name in scenario.trains}
    used = {name for train in sides.values() for name in (train.front, train.rear)}
    for side, train in sides.items():
        for car in train.cars():
            used.update(car.coupler or ())
            if len(car.coupler or ()) > 1 or car.brakes is not None or car.rail_friction is not None:
                yield Problem(("trains", side), f"brakes, rail_friction or two couplers in series {_LATER}")
                break
    for name, spec in scenario.devices.items():
        if name in used and not (isinstance(spec, CrushDevice) and spec.pull is None and spec.rate is None):
            yield Problem(("devices", name), f"its kind, pull or rate {_LATER}")


def _limits(chain: Chain) -> Iterator[Problem]:
    """What is wrong with the limits of a chain: names of nothing, and of what is not a number here."""
    for name in chain.limits:
        thing = of_each().get(name) or columns_of(chain).get(name)
        if thing is None:
            yield no_such("quantity or response", ("limits", name), name, [*of_each(), *columns_of(chain)])
        elif reason := no_number(thing, chain):
            yield Problem(("limits", name), reason)


def _vehicle(name: str, car: Car, speed_km_h: float) -> Vehicle:
    assert car.mass_t is not None  # held by the rules of a scenario
    return Vehicle(name, car.name, car.mass_t * TONNE, car.length_m, speed_km_h * KM_H)


def _joint(name: str, left: int, device: Device) -> Interface:
    return Interface(name, left, left + 1, device.envelope, (device.envelope.stroke,), (device,))


def _device(name: str, spec: CrushDevice, parts: Parts) -> Device:
    """The envelope and stages of a device, its stages laid end to end."""
    stroke: list[float] = []
    force: list[float] = []
    stages: list[Stage] = []
    at = 0.0  # where the stage before ends [mm]
    for stage_name, stage in spec.all_stages().items():
        u, f = parts.curve_points(stage.curve)
        start = at + stage.empty_stroke_mm
        if stage.empty_stroke_mm > 0:
            idle_from = max(at, stroke[-1]) if stroke else 0.0
            stroke += [idle_from, start]
            force += [0.0, 0.0]
        stroke += [start + x for x in u]
        force += f
        at = start + u[-1]
        if stage.shear_off is not None:
            ramp = stage.shear_off.ramp_mm
            stroke += [at + ramp, at + 2 * ramp]
            force += [stage.shear_off.force_kN, 0.0]
        limit = np.inf if stage.stroke_limit_mm is None else stage.stroke_limit_mm * MM
        stages.append(Stage(stage_name, start * MM, at * MM, limit))
    stages[-1] = Stage(stages[-1].name, stages[-1].start, np.inf, stages[-1].limit)
    points = np.column_stack([stroke, force])
    points = points[np.append(True, np.any(np.diff(points, axis=0) != 0.0, axis=1))]
    envelope = Envelope(
        points[:, 0] * MM,
        points[:, 1] * KN,
        spec.stiffness_kN_per_mm * KN_PER_MM,
        spec.damping_kN_s_per_m * KN_S_PER_M,
    )
    return Device(name, envelope, tuple(stages))
