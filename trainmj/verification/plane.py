"""The vertical plane beside statics, frequencies, what is conserved, and the same collisions along the track."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import eigvals

from trainmj.collision import kernel
from trainmj.collision.batch import run_chains
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.gear import N_DOF, Gear
from trainmj.collision.lineup import line_up
from trainmj.collision.measured import Measured
from trainmj.collision.mj import mujoco
from trainmj.collision.model import places_of
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import Scenario
from trainmj.units import MM, MRAD, G
from trainmj.verification.check import Check, alike, at_least, zero
from trainmj.verification.mixed import random_train
from trainmj.verification.oracle.plane import InPlane, solve
from trainmj.verification.systems import Ride, planar

_LOCKED = 1e18
"""Inertia that holds a degree of freedom where it is."""

_METRO = "vehicle_types.metro"
OFF_CENTRE: dict[str, Any] = {
    f"{_METRO}.body.cog_x_m": 0.6,
    "collision.offset_mm": {"M": 40, "S1": -5},
    "collision.pitch_mrad": {"M1": 3, "S2": -2},
    "trains.b_type.vehicles": [{"name": "Tc", "mass_t": 36, "coupler": "coupler_a_b"}, {"name": "M"}],
}
"""Vehicles whose centre of gravity is not in the middle, some of them higher or pitched."""


def rest() -> Iterator[Check]:
    """Vehicles that are not symmetric stand for two seconds where their statics, in closed form, have put them."""
    case = line_up(planar(OFF_CENTRE | {"collision.gap_mm": 1000}))
    ride = Ride(replace(case, vehicles=tuple(replace(v, speed=0.0) for v in case.vehicles)))
    begun = ride.data.qpos.copy()
    moved = 0.0
    for _ in range(20):
        moved = max(moved, float(np.abs(ride.go(0.1).data.qpos - begun).max()))
    yield zero("Two seconds of rest, vehicles off centre", "largest displacement", moved, 1e-12, "m")
    loads = ride.tally.wheel_load.reshape(-1, 4).sum(axis=1)
    yield alike("Two seconds of rest, vehicles off centre", "loads on the rails", loads, case.mass * G, 1e-12)


def frequencies() -> Iterator[Check]:
    """Small motions from rest, where all heights coincide, against the closed forms of :class:`Gear`."""
    case = line_up(planar({"trains.b_type.vehicles": [{"name": "Tc"}], "collision.gap_mm": 1000}))
    gear = case.vehicles[0].gear
    assert gear is not None
    high = gear.cog_height
    gear = replace(gear, axle_height=high, link_height=high, frame_height=high)
    case = replace(case, vehicles=tuple(replace(v, gear=gear) for v in case.vehicles))
    found = np.sqrt(np.maximum(np.sort(eigvals(*_linear(Ride(case)))).real, 0.0)) / (2.0 * math.pi)
    for name, expected in gear.frequencies.items():
        nearest = float(found[np.abs(found - expected).argmin()])
        yield Check("Frequencies, coincident heights", name, expected, nearest, 3e-3, unit="Hz")


def _linear(ride: Ride) -> tuple[Array, Array]:
    """(11, 11) stiffness, by differences of the forces, and mass matrix of the first vehicle at rest."""
    model, data, size = ride.model, ride.data, 1e-7

    def force(dof: int, by: float) -> Array:
        data.userdata[:] = ride.layout.block(ride.case)
        data.qvel[:] = 0.0
        data.qpos[:] = ride.case.start_qpos
        data.qpos[dof] += by
        with kernel.installed():
            mujoco.mj_forward(model, data)
        return np.asarray((data.qfrc_passive - data.qfrc_bias)[:N_DOF].copy())

    stiffness = np.column_stack([(force(k, -size) - force(k, size)) / (2 * size) for k in range(N_DOF)])
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return stiffness, full[:N_DOF, :N_DOF]


def locked() -> Iterator[Check]:
    """With all but the motion along the track held, collisions are those along the track."""
    for name in ("b_type", "en15227_c1", "wagon_80t"):
        case = line_up(planar({"simulation.time_limit_s": 0.5}, name))
        flat = line_up(planar({"simulation.time_limit_s": 0.5, "plane": "line"}, name))
        ride, free = Ride(case), Ride(flat)
        ride.model.dof_armature[:] = _LOCKED
        ride.model.dof_armature[list(case.first_dof[:-1])] = 0.0
        seen, known = (r.go(0.5).tally for r in (ride, free))
        strokes = np.abs(seen.stroke_max - known.stroke_max).max() / MM
        yield zero(f"{name}, locked", "strokes, largest difference", float(strokes), 1e-6, "mm")
        yield alike(f"{name}, locked", "forces", seen.force_max, known.force_max, 1e-10)


def floating(step_ms: float) -> Chain:
    """Vehicles without weight or rails, off centre and at different heights, with ties and swing stops."""
    changes = {"simulation.step_ms": step_ms, "collision.rail_friction": 0, "simulation.time_limit_s": 0.6}
    case = line_up(planar(OFF_CENTRE | changes))

    def afloat(gear: Gear) -> Gear:
        return replace(gear, gravity=0.0, rail_stiffness=1e-9, rail_damping=0.0)

    return replace(case, vehicles=tuple(replace(v, gear=afloat(v.gear)) for v in case.vehicles if v.gear))


def conserved() -> Iterator[Check]:
    """Momentum, angular momentum and energy of vehicles that float; their errors fall with the step."""
    whole, half = _errors(floating(0.1)), _errors(floating(0.05))
    for what, error, finer in zip(("momentum", "angular momentum", "energy"), whole, half, strict=True):
        yield zero("Vehicles that float", f"{what}, relative, at 0.1 ms", error, 5e-6)
        yield zero("Vehicles that float", f"{what}, relative, at half of it", finer, max(0.7 * error, 1e-9))
    error = _errors(line_up(planar(OFF_CENTRE | {"simulation.time_limit_s": 0.6})))[2]
    yield zero("Vehicles on the rails", "energy, relative, at 0.1 ms", error, 5e-6)


def _errors(case: Chain) -> tuple[float, float, float]:
    """Errors of momentum, angular momentum and energy over a collision, relative to what there was at the start."""
    ride = Ride(case)
    if all(v.gear is None or v.gear.gravity == 0.0 for v in case.vehicles):
        ride.model.opt.gravity[:] = 0.0
    turned = angular_momentum(case, ride.data.qpos, ride.data.qvel)
    tally = ride.go(case.time_limit).tally
    seen = Measured.of_one(case, tally, np.zeros(2), np.zeros((2, len(case.vehicles))))
    at_end = (of[0, :, :N_DOF].ravel() for of in (seen.plane.q, seen.plane.v))
    energy = float((seen.energy_error * seen.convertible / seen.kinetic[0])[0])
    return abs(float(seen.momentum_error[0])), abs(angular_momentum(case, *at_end) / turned - 1.0), abs(energy)


def angular_momentum(case: Chain, qpos: Array, qvel: Array) -> float:
    """About the place on the rail where the two sides touch [kg m2/s], positive from +x to +z."""
    found = 0.0
    for i, (vehicle, place) in enumerate(zip(case.vehicles, places_of(case), strict=True)):
        first, gear = case.first_dof[i], vehicle.gear
        assert gear is not None
        p, v = gear.placed(qpos[first : first + N_DOF]), qvel[first : first + N_DOF]
        x = place + gear.cog_x + p.x
        found += float(p.mass @ (x * (p.up @ v) - p.z * (p.along @ v)) + p.inertia @ (p.turn @ v))
    return found


def mirror() -> Iterator[Check]:
    """Two equal trains with equal speeds towards each other, none of them higher: both sides do the same."""
    changes = {"collision.partner_speed_km_h": -12.5, "collision.speed_km_h": 12.5, "collision.rail_friction": 0}
    found = summarise(run(planar(changes | {f"{_METRO}.body.cog_x_m": 0.4, "simulation.time_limit_s": 0.6})))
    n = len(found.vehicles) // 2
    for name in ("pitch_mrad", "heave_mm", "wheel_load", "peak_device_acceleration_g"):
        moving, partner = ([v.values[name] for v in found.vehicles[k : k + n]] for k in (0, n))
        yield alike("Two equal trains meet", name, partner, moving, 1e-6)
    yield zero("Two equal trains meet", "step between them", found.interfaces[0].step_mm, 1e-6, "mm")
    yield at_least("Two equal trains meet", "pitch (or little is compared)", 1.0, abs(found.vehicles[0].pitch_mrad))


def batch_and_single() -> Iterator[Check]:
    """Collisions side by side give the numbers of single runs, bit for bit, whatever their gears."""
    softer = {f"{_METRO}.secondary.kN_per_mm": 0.6, "collision.gap_mm": 12.5}
    cases = [planar(c | {"simulation.step_ms": 0.25, "simulation.time_limit_s": 0.5}) for c in ({}, OFF_CENTRE, softer)]
    batch = dict(run_chains(((k, line_up(s)) for k, s in enumerate(cases)), threads=2))
    differ = sum(batch[k].as_dict() != summarise(run(s)).as_dict() for k, s in enumerate(cases))
    yield zero("Batch and single runs in the plane", "cases of 3 that differ in any bit", differ, 0)


def by_scipy(seeds: Sequence[int] = (5, 15), seconds: float = 0.2) -> Iterator[Check]:
    """Random trains, beside an integration of the equations of motion in other coordinates by scipy."""
    for seed in seeds:
        values = random_train(seed)
        values["simulation"] |= {"time_limit_s": seconds}
        result = run(Scenario.from_values(values))
        yield from _beside(f"Random train {seed}, by scipy", result, solve(values))


def _beside(name: str, result: Result, known: InPlane) -> Iterator[Check]:
    found, tally = summarise(result), result.tally
    strokes = []
    for i, places in zip(result.chain.interfaces, result.chain.records, strict=True):
        paths = known.interfaces[i.name].paths
        for n, (path, records) in enumerate(zip(paths, places, strict=False)):  # draw gear has none
            idle = i.paths(0)[n].start - i.devices[0].paths(len(paths))[n].start
            own = sum(max(0.0, tally.element_stroke_max[k] + idle) for k in records)
            strokes.append((own, sum(max(0.0, one) for one in path.strokes[: len(records)])))
    steps = [
        (step, known.interfaces[i.name].step)
        for step, i in zip(tally.ends_step_max, result.chain.interfaces, strict=True)
    ]
    vehicles = [(v, known.vehicles[v.name]) for v in found.vehicles]
    pairs = {
        "strokes": (strokes, 1e-3),
        "steps while ends touch": ([pair for pair in steps if not math.isnan(pair[1])], 1e-2),
        "pitch": ([(abs(v.pitch_mrad) * MRAD, other.pitch) for v, other in vehicles], 1e-2),
        "heave": ([(abs(v.heave_mm) * MM, other.heave) for v, other in vehicles], 1e-2),
    }
    for what, (values, most) in pairs.items():
        own, others = np.array(values).T
        yield alike(name, f"{what}, of the largest", own, others, most, others.max())
    loads = [(w.load, one) for v, other in vehicles for w, one in zip(v.wheelsets, other.load, strict=True)]
    own, others = np.array(loads).T
    yield alike(name, "least loads of wheelsets over those at rest", own, others, 1e-2, 1.0)


CASES = (rest, frequencies, locked, conserved, mirror, batch_and_single, by_scipy)
