"""Bodies that give beside formulas: waves in bars and chains, how a free body swings, what one that yields loses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trainmj.collision import kernel
from trainmj.collision.body import Body
from trainmj.collision.chain import Chain
from trainmj.collision.fields import Joint
from trainmj.collision.mj import mujoco
from trainmj.collision.stability import largest_step
from trainmj.units import KJ, KN_PER_MM, MM
from trainmj.verification.check import Check, alike, at_least, zero
from trainmj.verification.systems import Ride, chain, envelope, follow

ROUND_OFF = 1e-12
FINE = 1e-6

_MASS, _STIFFNESS = 33e3, 500 * KN_PER_MM
_STEP = 2e-5  # at which a body swings [s]


def free(body: Body, mass: float = _MASS, step: float = 1e-5) -> Chain:
    """One vehicle with a body that gives, standing 100 m before a wall."""
    case = chain([mass], [envelope([(0, 0), (100, 1000)], 10)], [0.0], gap=100.0, step=step)
    return replace(case, vehicles=(replace(case.vehicles[0], body=body),))


def wave_in_a_train() -> Iterator[Check]:
    """N equal masses and springs run onto a wall, at the step with which the wave goes from one to the next."""
    mass, stiffness, speed = 30e3, 20 * KN_PER_MM, 2.0
    step = math.sqrt(mass / stiffness)
    spring = envelope([(0, 0), (2000, 2000 * stiffness / KN_PER_MM)], stiffness / KN_PER_MM)
    for n in (1, 5, 12):
        name = f"{n} masses and springs against a wall, h = sqrt(m / K)"
        ride = Ride(chain([mass] * n, [spring] * n, [speed] * n, n_moving=n, step=step))
        forces = [_step(ride)[1] for _ in range(2 * n + 2)]
        expected = [speed * math.sqrt(stiffness * mass)] * 2 * n
        yield alike(name, "force at the wall, v sqrt(K m)", forces[1 : 2 * n + 1], expected, ROUND_OFF)
        yield zero(name, "force after 2 N steps", abs(forces[-1]), 1e-3, "N")
        yield alike(name, "speeds at the end, -v", ride.data.qvel, [-speed] * n, ROUND_OFF)


def _step(ride: Ride) -> tuple[float, float]:
    """Make one step; the speed of the last point and the force at the last interface, both when it began."""
    speed = float(ride.data.qvel[-1])
    with kernel.installed():
        mujoco.mj_step(ride.model, ride.data)
    return speed, float(ride.layout.joint(ride.data.userdata, Joint.FORCE)[-1])


def step_force_on_a_bar() -> Iterator[Check]:
    """A free bar is pushed at one end: its speed goes up by F / sqrt(k M) times 1, 3, 5, each for 2 L / c."""
    force, k = 1.25e6, _STIFFNESS
    for n in (1, 4, 8):
        name = f"Step force on a free bar of {n} members"
        case = free(Body(k, n_members=n), step=math.sqrt(_MASS / k) / n)
        ride = Ride(case)
        ride.data.qfrc_applied[-1] = force
        speeds = np.array([_step(ride)[0] for _ in range(6 * n + 1)])
        means = 0.5 * (speeds[1:] + speeds[:-1])
        expected = np.repeat([1.0, 3.0, 5.0], 2 * n) * force / math.sqrt(k * _MASS)
        yield alike(name, "speed of the end, a staircase", means, expected, FINE)
        yield Check(name, "first speed", 0.307729, float(means[0]), 2e-6, unit="m/s")
        yield Check(name, "time of a stair", 16.248, 2 * n * case.step * 1e3, 1e-4, unit="ms")


def frequencies() -> Iterator[Check]:
    """A free body swings at 2 N sqrt(k / M) sin(j pi / 2N); a step of h makes that 2 / h asin(omega h / 2)."""
    for n, published in ((1, 39.18), (2, 55.41), (4, 59.98), (8, 61.15)):
        name = f"Free body of {n} members"
        body = Body(_STIFFNESS, n_members=n)
        yield Check(name, "first frequency", published, body.frequency(_MASS), 1e-4, unit="Hz")
        for mode in sorted({1, n}):
            found = _swing(free(body, step=_STEP), mode)
            omega = 2 * math.pi * body.frequency(_MASS, mode)
            stepped = 2.0 / _STEP * math.asin(0.5 * _STEP * omega)
            yield Check(name, f"frequency of mode {mode}, swinging", stepped / (2 * math.pi), found, FINE, unit="Hz")


def _swing(case: Chain, mode: int, periods: int = 3) -> float:
    """Frequency with which a body swings in one of its modes [Hz], from the times at which its end turns."""
    body = case.vehicles[0].body
    assert body is not None
    ride = Ride(case)
    n = body.n_members
    ride.data.qvel[:] = 0.1 * np.cos(np.arange(n + 1) * mode * math.pi / n)
    count = int(1.02 * periods / body.frequency(_MASS, mode) / case.step)
    speeds = np.array([_step(ride)[0] for _ in range(count)])
    before = np.flatnonzero(speeds[:-1] * speeds[1:] < 0)
    turns = (before + speeds[before] / (speeds[before] - speeds[before + 1])) * case.step
    return float((len(turns) - 1) / 2 / (turns[-1] - turns[0]))


def yielding() -> Iterator[Check]:
    """Two halves of a body run into each other: it yields until the rest is elastic, and hardens meanwhile."""
    mass, speed, k, collapse = _MASS, 4.0, _STIFFNESS, 2e6
    for hardening in (0.0, 5 * KN_PER_MM):
        name = f"A body of one member yields, hardening {hardening / KN_PER_MM:g} kN/mm"
        ride = Ride(free(Body(k, n_members=1, collapse=collapse, hardening=hardening), step=1e-6))
        ride.data.qvel[:] = speed / 2, -speed / 2
        ride.go(0.1)
        # energy of relative motion m v2 / 8 = F p + h p2 / 2 + (F + h p)2 / 2 k
        energy = mass * speed**2 / 8
        a, b, c = hardening / 2 + hardening**2 / (2 * k), collapse * (1 + hardening / k), collapse**2 / (2 * k) - energy
        plastic = -c / b if a == 0.0 else (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
        tally = ride.tally
        most = collapse + hardening * plastic
        lost = (collapse + 0.5 * hardening * plastic) * plastic / KJ
        yield Check(name, "plastic shortening", plastic / MM, float(tally.member_plastic[0]) / MM, 1e-5, unit="mm")
        yield Check(name, "largest force", most, float(tally.member_force_max[0]), 1e-5, unit="N")
        yield Check(name, "energy lost", lost, float(tally.member_dissipated[0]) / KJ, 1e-5, unit="kJ")


def damped() -> Iterator[Check]:
    """The first mode dies down with the stated ratio: by exp(-2 pi z / sqrt(1 - z2)) in a period."""
    for n in (1, 4):
        ratio = 0.03
        name = f"Damping ratio of a body of {n} members"
        body = Body(_STIFFNESS, damping_ratio=ratio, n_members=n)
        ride = Ride(free(body, step=1e-6))
        ride.data.qvel[:] = 0.1 * np.cos(np.arange(n + 1) * math.pi / n)
        period = 1.0 / (body.frequency(_MASS) * math.sqrt(1 - ratio**2))
        start = float(ride.data.qvel[-1])
        left = float(ride.go(period).data.qvel[-1])
        yield Check(
            name, "left after a period", math.exp(-2 * math.pi * ratio / math.sqrt(1 - ratio**2)), left / start, 2e-4
        )


def stability() -> Iterator[Check]:
    """Just below the largest step a body swings on; just above it, it flies apart."""
    body = Body(_STIFFNESS, damping_ratio=0.05, n_members=4)
    case = free(body)
    limit = 2.0 / _fastest(body)
    name = "Largest step of a body of 4 members"
    yield Check(
        name, "stated, the soft device before it included", limit * 1e3, largest_step(case) * 1e3, 1e-3, unit="ms"
    )
    below, above = (_shaken(free(body, step=part * limit)) for part in (0.999, 1.001))
    yield zero(name, "speed at 0.999 of it", below, 1e-2, "m/s")
    yield at_least(name, "speed at 1.001 of it", 1.0, above, "m/s")


def _shaken(case: Chain) -> float:
    """Largest speed of a point [m/s], 20 000 steps after its body began to swing in its fastest mode at 1 mm/s."""
    ride = Ride(case)
    ride.data.qvel[:] = 1e-3 * np.cos(np.arange(len(case.points)) * math.pi)
    ride.go(20000 * case.step)
    return float(np.abs(ride.data.qvel).max())


def _fastest(body: Body) -> float:
    """1 / (half the largest stable step) of the fastest mode of a free body, its damping counted [1/s]."""
    omega = 2 * math.pi * body.frequency(_MASS, body.n_members)
    ratio = body.damping_ratio * omega / (2 * math.pi * body.frequency(_MASS))
    return omega / (math.sqrt(1 + ratio**2) - ratio)


def stiff_body() -> Iterator[Check]:
    """A body of one member, stiff beyond reason, is the vehicle of one mass."""
    name = "A body of 1e14 N/m beside one mass"
    tube = envelope([(0, 0), (10, 800), (1000, 800)], 80.0, 50.0)
    rigid = chain([33e3, 30e3], [tube, tube], [4.0, 4.0], n_moving=2, step=1e-5, friction=0.008)
    bodies = tuple(replace(v, body=Body(1e14, damping_ratio=0.05, n_members=1)) for v in rigid.vehicles)
    one, other = (follow(case) for case in (rigid, replace(rigid, vehicles=bodies)))
    yield alike(name, "strokes, over the largest", other.stroke_max, one.stroke_max, FINE, one.stroke_max.max())
    yield alike(name, "energies, over the largest", other.dissipated, one.dissipated, FINE, one.dissipated.max())


CASES = (wave_in_a_train, step_force_on_a_bar, frequencies, yielding, damped, stability, stiff_body)
