"""The same collisions computed by others: MuJoCo's own plastic springs, and scipy's integrators."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from trainmj.collision import kernel
from trainmj.collision.block import Tally
from trainmj.collision.envelope import Array
from trainmj.collision.fields import Element, Joint
from trainmj.collision.measured import UNSTABLE
from trainmj.collision.mj import mujoco
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import Scenario, load
from trainmj.units import KJ, MM
from trainmj.verification.check import Check, alike, at_least, furthest, zero
from trainmj.verification.mixed import random_scenario, with_bodies
from trainmj.verification.oracle import Solution, solve
from trainmj.verification.systems import Ride, chain, envelope, random_collision

FINE_STEP_MS = 0.002
"""At which the standard case is held against the independent integrator."""

SEEDS = range(3)
"""Random trains in the suite; the tests can take more."""

SEEDS_OF_EVERY_KIND = (31, 32, 34, 39, 41)
"""Those with devices of every kind: quick ones, and a curve that ends."""

SEEDS_OF_BODIES = (4, 5, 19, 24, 31, 34, 47)
"""Those with bodies that give: quick ones; most of them collapse."""

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
            plastic = float(ours.element(Element.STATE_0).min())
    yield zero(name, "positions, largest difference", places, 1e-9)
    yield zero(name, "speeds, largest difference", speeds, 1e-9)
    yield at_least(name, "steps compared", 1000, compared)
    yield at_least(name, "both springs had yielded by", 1.0, plastic / MM, "mm")


def strokes(result: Result, theirs: Solution) -> Array:
    """(n_interface,) largest strokes of an independent solution in the order of a result [m]."""
    return np.array([theirs.interfaces[interface.name].stroke for interface in result.chain.interfaces])


def standard_by_scipy() -> Iterator[Check]:
    """The paper's case, 12 vehicles with rail friction, at a fine step."""
    name = "B-type train by scipy"
    result = run(load("b_type", {"simulation.step_ms": FINE_STEP_MS}))
    ours, theirs = result.tally, solve(result.scenario.values(), result.tally.time)
    names = [vehicle.name for vehicle in result.chain.vehicles]
    stroke = strokes(result, theirs)
    front = [theirs.interfaces[interface.name].sides[0] for interface in result.chain.interfaces]
    again = replace(result, tally=Tally(**vars(ours) | {"stroke_max": stroke, "element_stroke_max": np.array(front)}))
    yield alike(name, "strokes", ours.stroke_max, stroke, 0.05, MM, "mm")
    yield Check(name, "TS", summarise(again).TS_mm, summarise(result).TS_mm, 1e-4, unit="mm")
    accelerations = [theirs.acceleration[vehicle] for vehicle in names]
    yield alike(name, "peak accelerations", ours.device_peak, accelerations, 0.002)
    speeds = [theirs.speed[vehicle] for vehicle in names]
    yield alike(name, "speeds at the end", ours.speed, speeds, 1e-4, np.abs(result.chain.speed).max())


def three_masses_by_scipy() -> Iterator[Check]:
    """An unequal chain against a wall that loads, unloads and loads again."""
    for damping in (0.0, 20.0):
        name = f"Three masses by scipy, {damping:g} kN s/m"
        devices = {
            "first": _damped([0, 20, 600], [0, 700, 900], 80, damping),
            "second": _damped([0, 73, 300], [0, 500, 1100], 50, damping),
        }
        vehicles = [{"name": name, "mass_t": mass} for name, mass in (("a", 33.0), ("b", 20.0), ("c", 41.0))]
        values = {
            "devices": devices,
            "trains": {"t": {"vehicles": vehicles, "coupler": "second", "front": "first"}},
            "collision": {"train": "t", "partner": "rigid_wall", "speed_km_h": 3 * 3.6},
            "simulation": {"step_ms": 0.002, "record_every_ms": 0.1, "time_limit_s": 0.4},
        }
        result = run(Scenario.from_values(values))
        ours, theirs = result.tally, solve(values, result.tally.time)
        found = [theirs.interfaces[interface.name] for interface in result.chain.interfaces]
        yield alike(name, "strokes", ours.stroke_max, [f.stroke for f in found], 1e-4)
        yield alike(name, "forces", ours.force_max, [f.force for f in found], 1e-4)
        yield alike(name, "speeds at the end", ours.speed, [theirs.speed[v.name] for v in result.chain.vehicles], 1e-4)


def _damped(stroke_mm: list[float], force_kN: list[float], stiffness: float, damping: float) -> dict[str, object]:
    """A device; its stiffness in kN/mm, its dashpot in kN s/m."""
    curve = {"stroke_mm": stroke_mm, "force_kN": force_kN}
    return {"curve": curve, "stiffness_kN_per_mm": stiffness, "damping_kN_s_per_m": damping, "beyond": "hold"}


def beside(name: str, scenarios: Iterable[Scenario]) -> Iterator[Check]:
    """Collisions by a run and by the independent solution; the worst of all."""
    apart = []
    for scenario in scenarios:
        result = run(scenario)
        theirs, summary = solve(scenario.values(), result.tally.time), summarise(result)
        stroke, balance = strokes(result, theirs), summary.balance
        given = [theirs.members[member.name] for member in result.chain.members]
        shortened = [theirs.shortened.get(vehicle.name, 0.0) for vehicle in result.chain.vehicles]
        lengths = [*stroke, *shortened, *(m.stroke for m in given), *(m.plastic for m in given)]
        tally = result.tally
        own = [tally.stroke_max, tally.shortened_max, tally.member_stroke_max, tally.member_plastic]
        absorbed = [theirs.interfaces[interface.name].absorbed for interface in result.chain.interfaces]
        energies = [*absorbed, *(m.lost for m in given), theirs.kinetic[1], theirs.rails, theirs.brakes, -theirs.grade]
        ours = (balance.kinetic_end_kJ, balance.friction_kJ, balance.brakes_kJ, balance.grade_kJ)
        until = np.nan_to_num([summary.valid_until_s, theirs.valid_until], nan=np.inf, posinf=np.inf)
        apart.append(
            (
                furthest(np.concatenate(own), lengths, np.abs(lengths).max()),
                furthest(
                    [*result.energy[-1], *tally.member_dissipated, *np.multiply(ours, KJ)], energies, theirs.convertible
                ),
                furthest(tally.speed, list(theirs.speed.values()), np.abs(result.chain.speed).max()),
                0.0 if until[0] == until[1] else furthest(until[0], until[1]),
                abs(balance.energy_error),
                abs(theirs.missing) / theirs.convertible,
            )
        )
    length, energy, speed, until, error, missing = np.max(apart, axis=0)
    yield zero(name, "strokes and shortenings, largest difference over the largest", length, 1e-3)
    yield zero(name, "energies, largest difference over what can be converted", energy, 1e-3)
    # where a stiff device is at work at the end, speeds change within a few steps
    yield zero(name, "speeds at the end, largest difference over the largest at the start", speed, 5e-3)
    yield zero(name, "when a curve ended, largest difference, relative", until, 1e-3)
    yield zero(name, "error of the energy balance", error, UNSTABLE)
    yield zero(name, "error of that of the independent solution", missing, 1e-4)


def random_by_scipy(seeds: Sequence[int] = SEEDS, most: int = 16) -> Iterator[Check]:
    """Random trains, crush devices, masses, speeds and friction."""
    yield from beside(f"{len(seeds)} random trains by scipy", (random_collision(seed, most) for seed in seeds))


def every_kind_by_scipy(seeds: Sequence[int] = SEEDS_OF_EVERY_KIND) -> Iterator[Check]:
    """Random trains and obstacles with devices of every kind and end, draw gear, brakes and a grade."""
    scenarios = (Scenario.from_values(random_scenario(seed)) for seed in seeds)
    yield from beside(f"{len(seeds)} random trains with devices of every kind by scipy", scenarios)


def bodies_by_scipy(seeds: Sequence[int] = SEEDS_OF_BODIES) -> Iterator[Check]:
    """The same trains with car bodies that give: soft, weak, with bogies, attached behind their ends; some rigid."""
    yield from beside(f"{len(seeds)} random trains with bodies that give by scipy", map(scenario_of_bodies, seeds))


def scenario_of_bodies(seed: int) -> Scenario:
    """A random train of every kind with bodies, up to 0.3 s."""
    values = with_bodies(random_scenario(seed), seed)
    return Scenario.from_values(values | {"simulation": {**values["simulation"], "time_limit_s": 0.3}})


CASES = (
    plastic_springs,
    three_masses_by_scipy,
    standard_by_scipy,
    random_by_scipy,
    every_kind_by_scipy,
    bodies_by_scipy,
)
