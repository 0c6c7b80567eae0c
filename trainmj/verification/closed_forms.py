"""Collisions whose outcome is a formula, and the energy and momentum that no collision makes or loses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trainmj.collision.measured import MOMENTUM, MOMENTUM_IN_PLANE, UNSTABLE
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import Scenario
from trainmj.scenario import shipped as shipped_names
from trainmj.units import KJ, KM_H, MM, MS, G
from trainmj.verification.check import Check, Kind, at_least, furthest, zero
from trainmj.verification.systems import FRICTIONLESS, Ride, chain, collide, envelope, pulses, scenario, shipped

FINE = 1e-4
"""What closed forms are met to, relative; most are met far better."""

FREE = 1e-5
"""... and the free flights of occupants."""


def hooke_wall() -> Iterator[Check]:
    """1 t at 1 m/s onto 1 kN/mm: F = v sqrt(k m), u = v sqrt(m / k), contact pi sqrt(m / k), speed returned."""
    case = "Spring against a wall"
    tally = run(scenario([(0, 0), (50, 50_000)], 1.0, mass_t=[1.0], speed_m_s=1.0, time_limit_s=0.2)).tally
    contact = float(tally.last_force_time[0] - tally.first_force_time[0])
    yield Check(case, "largest force", 31_622.777, float(tally.force_max[0]), FINE, unit="N")
    yield Check(case, "largest stroke", 31.622777, float(tally.stroke_max[0]) / MM, FINE, unit="mm")
    yield Check(case, "time of contact", 99.3459, contact * 1e3, FINE, unit="ms")
    yield Check(case, "speed at the end", -1.0, float(tally.speed[0]), FINE, unit="m/s")
    yield zero(case, "permanent set", float(tally.element_state_0[0]) / MM, 0.0, "mm")


def elasto_plastic() -> Iterator[Check]:
    """33 t each, k = 4e7 N/m, F_y = 800 kN, 3 m/s; 50 mm of travel without force change when, not what, happens."""
    for idle in ("", ", gap of 50 mm", ", empty stroke of 50 mm"):
        name = f"Two masses, ideal plasticity{idle}"
        gap = {"gap_mm": 50.0} if "gap" in idle else {}
        # each train brings 80 kN/mm; the pair in series has 40
        case = scenario(
            [(0, 0), (10, 800), (1000, 800)], 80.0, partner="t", speed_m_s=3.0, collision=gap, time_limit_s=0.3
        )
        if "empty" in idle:
            case = case.with_values({"devices.d.empty_stroke_mm": 25.0})  # of each train
        result = run(case)
        tally, summary = result.tally, summarise(result)
        more = 50.0 if "empty" in idle else 0.0
        rebound = float(tally.speed[1] - tally.speed[0])
        first = float(tally.first_force_time[0]) * 1e3
        yield Check(name, "largest stroke", 102.8125 + more, float(tally.stroke_max[0]) / MM, FINE, unit="mm")
        yield Check(name, "permanent set", 82.8125 + more, 2 * summary.interfaces[0].permanent_mm, FINE, unit="mm")
        yield Check(name, "rebound", 0.984732, rebound, FINE, unit="m/s")
        yield Check(name, "absorbed by both trains", 66.25, 2 * summary.interfaces[0].energy_kJ, FINE, unit="kJ")
        yield Check(name, "first force", 50 / 3 if idle else 0.0, first, 2e-3, Kind.ABSOLUTE, "ms")
        yield Check(name, "TS, without empty strokes", 102.8125 / 2, summary.TS_mm, FINE, unit="mm")


def plastic_chain() -> Iterator[Check]:
    """Plateaus without spring: what is lost is the kinetic energy about the common centre of mass."""
    e = envelope([(0, 0), (0.01, 500), (9000, 500)], 1e5)
    for n in (2, 5):
        name = f"{n} wagons of ideal plasticity"
        (summary,) = collide(chain([20e3] * n, [e] * (n - 1), [5.0] + [0.0] * (n - 1), step=2e-5, time_limit=3.0))
        lost = 0.5 * 20e3 * 5.0**2 * (1 - 1 / n) / KJ
        common = furthest([v.final_speed_km_h for v in summary.vehicles], [18.0 / n] * n)
        yield Check(name, "absorbed", lost, summary.balance.absorbed_kJ, FINE, unit="kJ")
        yield zero(name, "speeds from the common one, relative", common, 0.02)


def standard_case() -> Iterator[Check]:
    """6 x 33 t at 25 km/h: 4774.306 kJ; without rail friction 3.47222 m/s in common and 2387.153 kJ lost."""
    name = "B-type train, no rail friction"
    (summary,) = collide(shipped(changes=FRICTIONLESS))
    mean = float(np.mean([v.final_speed_km_h for v in summary.vehicles])) * KM_H
    yield Check(name, "kinetic energy at the start", 4774.306, summary.balance.kinetic_start_kJ, 1e-7, unit="kJ")
    yield Check(name, "common speed", 3.47222, mean, 2e-6, unit="m/s")
    # the vehicles part at a few cm/s, which is what the tolerance leaves
    yield Check(name, "absorbed", 2387.153, summary.balance.absorbed_kJ, 2e-3, unit="kJ")


def coasting() -> Iterator[Check]:
    """Rail friction stops a vehicle after v2 / (2 mu g), and once it stands it stays."""
    e, v = envelope([(0, 0), (100, 1000)], 100), 2.0
    for mu in (0.008, 0.1):
        name = f"Coasting, mu = {mu:g}"
        distance = v**2 / (2 * mu * G)
        ride = Ride(chain([33e3], [e], [v], friction=mu, step=1e-4, gap=2 * distance))
        ride.go(1.1 * v / (mu * G))
        stopped = float(ride.data.qpos[0] - ride.case.start[0])
        crept = float(ride.go(0.5).data.qpos[0] - ride.case.start[0]) - stopped
        yield Check(name, "way to the stop", distance, stopped, FINE, unit="m")
        yield zero(name, "creep in the next 0.5 s", crept, 1e-12, "m")


def standing() -> Iterator[Check]:
    """47 t pushed with 100 kN: 101.4 kN of rail friction hold, 96.8 kN do not."""
    soft = envelope([(0, 0), (100, 100), (5000, 100)], 50)
    for mu, held in ((0.22, True), (0.21, False)):
        name = f"Standing vehicle, mu = {mu:g}"
        ride = Ride(chain([10e3, 47e3], [soft], [3.0, 0.0], friction=mu, step=1e-4)).go(1.0)
        moved = abs(float(ride.data.qpos[1])) / MM
        yield Check(name, "push", 100.0, float(ride.tally.force_max[0]) / 1e3, 1e-12, unit="kN")
        if held:
            yield zero(name, "moved", moved, 1e-9, "mm")
        else:
            yield at_least(name, "moved", 0.01, moved, "mm")


def free_flight() -> Iterator[Check]:
    """Constant 5 g: sqrt(2 a d), whichever way a vehicle is pushed; 5 g for 100 ms; a triangle of 8 g in 250 ms."""
    mass, a = 40.0, 5 * G
    force = mass * a
    flights = {0.3: 5.4240160, 0.6: 7.6707171, 0.76: 8.6331072}
    pushed = scenario([(0, force), (3000, force)], 1000, [mass], "t", 18.0, step_ms=0.01, time_limit_s=0.25)
    yield from _impacts("Free flight at constant 5 g", pushed, flights)

    before, after, drop = 6.0, 6.0 - 4.903325, 1.0  # m/s, m/s, mm; the springs' share of the work is that of the rise
    stroke = mass * (before**2 - after**2) / 2 / force * 1e3 - drop / 2 + force / 1000 / 2
    curve = [(0, force), (stroke, force), (stroke + drop, 0), (stroke + 3000, 0)]
    braked = scenario(curve, 1000, [mass], speed_m_s=before, step_ms=0.01, time_limit_s=0.2)
    yield from _impacts("Free flight, 5 g for 100 ms", braked, {0.2: 4.428691, 0.3: 4.903325})

    time = np.linspace(0.0, 0.25, 1001)
    deceleration = 8 * G * (1 - np.abs(time / 0.125 - 1))
    speed = 12.0 - np.where(time < 0.125, time * deceleration / 2, 8 * G * 0.125 - (0.25 - time) * deceleration / 2)
    way = np.concatenate([[0.0], np.cumsum(np.diff(time) * (speed[1:] + speed[:-1]) / 2)]) / MM
    curve = [*zip(way, mass * deceleration, strict=True), (way[-1] + 3000, 0)]
    pulse = scenario(curve, 10_000, [mass], speed_m_s=12.0, time_limit_s=0.25)
    times = {0.3: 142.246, 0.6: 182.971, 0.76: 201.264}
    yield from _impacts("Free flight, 8 g in a triangle", pulse, {0.3: 6.163011, 0.6: 8.396708, 0.76: 9.061272}, times)


def _impacts(
    case: str, collision: Scenario, speeds: dict[float, float], times: dict[float, float] | None = None
) -> Iterator[Check]:
    """Secondary impact velocities [m/s], and times [ms], of every vehicle by the distance [m]."""
    flights = [round(distance / MM) for distance in speeds]
    summary = summarise(run(collision.with_values({"occupants.free_flight_mm": flights})))
    for v in summary.vehicles:
        for mm, speed in zip(flights, speeds.values(), strict=True):
            found = v.values[f"SIV_{mm}mm_m_per_s"]
            yield Check(case, f"against {v.name} after {mm} mm", speed, found, FREE, unit="m/s")
        for mm, at in zip(flights, (times or {}).values(), strict=False):
            found = v.values[f"SIV_time_{mm}mm_s"] / MS
            yield Check(case, f"time of {mm} mm", at, found, FREE, unit="ms")


def contact_windows() -> Iterator[Check]:
    """40 t: 1 MN for 100 ms, nothing for 20 ms, 0.5 MN for 200 ms. 1 t on a spring, whose force is half a sine."""
    case = "Two pulses, mean decelerations"
    (v,) = summarise(run(pulses(40.0, 9.0, [(1000, 100), (0, 20), (500, 200)]))).vehicles
    yield zero(case, "contact windows, more than two", v.contact_windows - 2.0, 0.0)
    for name, window, mean in zip(("first", "second"), v.contacts, (2.54929, 1.27465), strict=False):
        yield Check(case, f"{name} window", mean, window.mean_g, FINE, unit="g")
    yield Check(case, "mean deceleration", 2.54929, v.mean_deceleration_g, FINE, unit="g")
    yield Check(case, "over 120 ms", 2.12441, v.mean_120ms_g, FINE, unit="g")
    yield Check(case, "over 100 ms", 2.54929, v.mean_100ms_g, FINE, unit="g")
    yield Check(case, "from the first to the last force", 1.59331, v.front_mean_deceleration_g, FINE, unit="g")

    case = "Half a sine, mean decelerations"
    spring = scenario([(0, 0), (50, 50_000)], 1.0, mass_t=[1.0], speed_m_s=1.0, step_ms=0.01, time_limit_s=0.2)
    for threshold, mean, length in ((0.001, 2.0529019, 99.34388), (1, 2.0939966, 97.34555), (20, 2.8189244, 56.04044)):
        (v,) = summarise(run(spring.with_values({"simulation.contact_threshold_kN": threshold}))).vehicles
        above, (window, *_) = f"above {threshold:g} kN", v.contacts
        yield Check(case, above, mean, v.mean_deceleration_g, FINE, unit="g")
        yield Check(case, f"time {above}", length, (window.end_s - window.start_s) / MS, FINE, unit="ms")


def momentum() -> Iterator[Check]:
    """Kept to round-off without rail friction, and not only by the program's own account."""
    name = "B-type train, no rail friction"
    (summary,) = collide(shipped(changes=FRICTIONLESS))
    kept = sum(v.mass_t * v.final_speed_km_h for v in summary.vehicles)
    yield Check(name, "momentum at the end", 6 * 33 * 25, kept, 1e-9, unit="t km/h")


def balances() -> Iterator[Check]:
    """Every shipped scenario at its default step: rails and wall take the momentum, devices and rails the energy."""
    names = list(shipped_names())
    for name, summary in zip(names, collide(*(shipped(name) for name in names)), strict=True):
        b = summary.balance
        parts = b.kinetic_end_kJ + b.elastic_kJ + b.absorbed_kJ + b.friction_kJ
        plane = "damped_kJ" in b.values
        if plane:
            parts += b.suspensions_kJ + b.damped_kJ + b.ties_kJ
        yield Check(name, "energy at the end, in all its forms", b.kinetic_start_kJ, parts, UNSTABLE, unit="kJ")
        missing = "momentum that is missing, relative"
        yield zero(name, missing, b.momentum_error, MOMENTUM_IN_PLANE if plane else MOMENTUM)


CASES = (hooke_wall, elasto_plastic, plastic_chain, standard_case, coasting, standing, free_flight, contact_windows)
BALANCES = (momentum, balances)
