"""The same collisions computed by others: MuJoCo's own plastic springs, and scipy's integrator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from trainmj.collision import kernel
from trainmj.collision.block import Joint, Tally
from trainmj.collision.simulation import run
from trainmj.collision.summary import UNSTABLE, summarise
from trainmj.scenario import load
from trainmj.units import MM
from trainmj.verification.check import Check, Kind, furthest
from trainmj.verification.independent import Solution, solve
from trainmj.verification.random_trains import random_collision
from trainmj.verification.systems import Ride, chain, envelope

FINE_STEP_MS = 0.002
"""At which the standard case is held against the independent integrator."""

SEEDS = range(6)
"""Random trains in the suite; the tests can take more."""

_PLASTIC_SPRINGS = """<mujoco><option timestep="1e-5">
  <flag gravity="disable" contact="disable" constraint="disable" eulerdamp="disable"/></option>
  <worldbody>
    <body><joint name="a" type="slide" axis="1 0 0"/><inertial mass="33000" pos="0 0 0" diaginertia="1 1 1"/></body>
    <body><joint name="b" type="slide" axis="1 0 0"/><inertial mass="21000" pos="0 0 0" diaginertia="1 1 1"/></body>
    <body><joint name="c" type="slide" axis="1 0 0"/><inertial mass="47000" pos="0 0 0" diaginertia="1 1 1"/></body>
  </worldbody>
  <tendon>
    <fixed stiffness="4e7" springyield="0.02"><joint joint="a" coef="1"/><joint joint="b" coef="-1"/></fixed>
    <fixed stiffness="6e7" springyield="0.01"><joint joint="b" coef="1"/><joint joint="c" coef="-1"/></fixed>
  </tendon></mujoco>"""


def plastic_springs() -> Iterator[Check]:
    """MuJoCo's springyield tendons are ideal elasto-plastic: no code of this project is in that model."""
    name = "MuJoCo's plastic springs, three masses"
    theirs = mujoco.MjModel.from_xml_string(_PLASTIC_SPRINGS)
    data = mujoco.MjData(theirs)
    data.qvel[0] = 3.0
    devices = [envelope([(0, 0), (20, 800), (2000, 800)], 40), envelope([(0, 0), (10, 600), (2000, 600)], 60)]
    ours = Ride(chain([33e3, 21e3, 47e3], devices, [3.0, 0.0, 0.0], step=1e-5))
    places, speeds, compared, plastic = 0.0, 0.0, 0, 0.0
    with kernel.installed():
        while data.time < 0.3:
            mujoco.mj_step(theirs, data)
            mujoco.mj_step(ours.model, ours.data)
            force = ours.joint(Joint.FORCE)
            if data.time > 1e-3 and (force <= 0).any():
                break  # from here on their springs pull, devices do not
            places = max(places, furthest(ours.data.qpos, data.qpos, 0.1))
            speeds = max(speeds, furthest(ours.data.qvel, data.qvel, 3.0))
            compared += 1
            plastic = float(ours.joint(Joint.PLASTIC).min())
    yield Check(name, "positions, largest difference", 0.0, places, 1e-9, Kind.ABSOLUTE)
    yield Check(name, "speeds, largest difference", 0.0, speeds, 1e-9, Kind.ABSOLUTE)
    yield Check(name, "steps compared", 1000, compared, 0, Kind.AT_LEAST)
    yield Check(name, "both springs had yielded by", 1.0, plastic / MM, 0, Kind.AT_LEAST, "mm")


def standard_by_scipy() -> Iterator[Check]:
    """The paper's case, 12 vehicles with rail friction, at a fine step."""
    name = "B-type train by solve_ivp"
    result = run(load("b_type", {"simulation.step_ms": FINE_STEP_MS}))
    ours, theirs = result.tally, solve(result.chain, result.tally.time)
    c = result.chain
    again = Tally(**vars(ours) | {"stroke_max": theirs.stroke})
    TS = [summarise(replace(result, tally=t)).TS_mm for t in (ours, again)]
    strokes = furthest(ours.stroke_max, theirs.stroke, MM)
    peaks = furthest(ours.device_peak, theirs.acceleration)
    yield Check(name, "strokes, largest difference", 0.0, strokes, 0.05, Kind.ABSOLUTE, "mm")
    yield Check(name, "TS", TS[1], TS[0], 1e-4, unit="mm")
    yield Check(name, "peak accelerations, largest difference, relative", 0.0, peaks, 0.002, Kind.ABSOLUTE)
    speeds = furthest(ours.speed, theirs.speed, float(np.abs(c.speed).max()))
    yield Check(name, "speeds at the end, largest difference, relative", 0.0, speeds, 1e-4, Kind.ABSOLUTE)


def three_masses_by_scipy() -> Iterator[Check]:
    """An unequal chain that loads, unloads and loads again."""
    for damping in (0.0, 20.0):
        name = f"Three masses by solve_ivp, {damping:g} kN s/m"
        devices = [
            envelope([(0, 0), (20, 700), (600, 900)], 80, damping),
            envelope([(0, 0), (73, 500), (300, 1100)], 50, damping),
        ]
        case = chain([33e3, 20e3, 41e3], devices, [4.0, 0.0, 0.0], step=2e-6, time_limit=0.4)
        ours, theirs = Ride(case).go(case.time_limit).tally, solve(case, case.time_limit)
        strokes, forces = furthest(ours.stroke_max, theirs.stroke), furthest(ours.force_max, theirs.force)
        yield Check(name, "strokes, largest difference, relative", 0.0, strokes, 1e-4, Kind.ABSOLUTE)
        yield Check(name, "forces, largest difference, relative", 0.0, forces, 1e-4, Kind.ABSOLUTE)
        speeds = furthest(ours.speed, theirs.speed)
        yield Check(name, "speeds at the end, largest difference, relative", 0.0, speeds, 1e-4, Kind.ABSOLUTE)


@dataclass(frozen=True)
class Agreement:
    """How one random train came out against the independent integrator, relative to the largest of its kind.

    Attributes:
        seed: of the train.
        vehicles: how many.
        stroke: largest difference of strokes.
        acceleration: likewise of peak accelerations.
        energy: error of our energy balance.
        switches: how often a branch was left.
    """

    seed: int
    vehicles: int
    stroke: float
    acceleration: float
    energy: float
    switches: int


def compare_random(seed: int, most: int = 40) -> Agreement:
    """One random train both ways."""
    result = run(random_collision(seed, most))
    ours = result.tally
    theirs: Solution = solve(result.chain, ours.time)
    return Agreement(
        seed,
        len(result.chain.vehicles),
        furthest(ours.stroke_max, theirs.stroke, theirs.stroke.max()),
        furthest(ours.device_peak, theirs.acceleration, theirs.acceleration.max()),
        abs(summarise(result).balance.energy_error),
        theirs.switches,
    )


def random_by_scipy(seeds: Sequence[int] = SEEDS, most: int = 16) -> Iterator[Check]:
    """Random trains, devices, masses, speeds and friction; the worst of all."""
    found = [compare_random(seed, most) for seed in seeds]
    name = f"{len(found)} random trains by solve_ivp"
    stroke, energy = max(a.stroke for a in found), max(a.energy for a in found)
    yield Check(name, "strokes, largest difference over the largest", 0.0, stroke, 1e-3, Kind.ABSOLUTE)
    yield Check(name, "error of the energy balance", 0.0, energy, UNSTABLE, Kind.ABSOLUTE)
