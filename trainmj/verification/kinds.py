"""Collisions of every kind of device whose outcome is a formula, as scenarios and the exact numbers they must give.

The formulas take the scenario as it stands: the rise of a force along its stiffness, the ramp of a preload and the
linear part of a rate factor are in them, so that the numbers hold to round-off and not only in a limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from scipy.optimize import brentq

G = 9.80665
FRONT = "front"
"""The interface at which the sides meet, in the name of a quantity."""


@dataclass(frozen=True)
class Exact:
    """One quantity of a collision, and what it is.

    Attributes:
        name: of the collision.
        values: the scenario, as its YAML file gives it.
        quantity: what is known, and where: ``stroke_mm front`` (both sides together), ``stroke_mm moving`` and
            ``struck`` (sides of the front), ``stroke_mm M1-M2``, ``force_kN``, ``pull_kN`` (largest), ``speed_m_s M1``
            (at the end), ``travel_m M1``, ``lost_kJ all`` (in all devices, at the end), ``stands_s M1`` (when it
            has come to rest), ``time_s front`` (of the largest stroke there).
        exact: its value.
    """

    name: str
    values: Mapping[str, Any]
    quantity: str
    exact: float


def cases() -> Iterator[Exact]:
    """Every exact number, kind by kind."""
    yield from hysteresis()
    yield from friction_gear()
    yield from rate(C=20.0, P=1)
    yield from rate(C=50.0, P=2)
    yield from orifice()
    yield from preload()
    yield from gas()
    yield from metering()
    yield from draw_gear()
    yield from breaking()
    yield from series_plateaus()
    yield from series_shear_off()
    for mass, speed in ((129.0, 110.0), (129.0, 60.0), (198.0, 25.0)):
        yield from obstacle(mass, speed)
    yield from car_body()
    yield from constant_brake()
    yield from rising_brake()
    yield from grades()


def scenario(
    devices: Mapping[str, Any],
    mass_t: float = 40.0,
    speed_m_s: float = 1.0,
    collision: Mapping[str, Any] | None = None,
    train: Mapping[str, Any] | None = None,
    obstacles: Mapping[str, Any] | None = None,
    time_limit_s: float = 1.0,
    step_ms: float = 0.01,
) -> dict[str, Any]:
    """One vehicle, with the first device on its front, on a rigid wall unless stated otherwise."""
    values: dict[str, Any] = {
        "devices": dict(devices),
        "trains": {"t": {"vehicles": 1, "mass_t": mass_t, "front": next(iter(devices)), **(train or {})}},
        "collision": {"train": "t", "speed_km_h": speed_m_s * 3.6, "partner": "rigid_wall", **(collision or {})},
        "simulation": {"step_ms": step_ms, "record_every_ms": max(step_ms, 1.0), "time_limit_s": time_limit_s},
    }
    if obstacles:
        values["obstacles"] = dict(obstacles)
    return values


def line(force_kN: float, to_mm: float, from_kN: float | None = None) -> dict[str, list[float]]:
    """A curve of two points."""
    return {"stroke_mm": [0.0, to_mm], "force_kN": [force_kN if from_kN is None else from_kN, force_kN]}


def hysteresis() -> Iterator[Exact]:
    """Loads along 10 MN/m, unloads along 2.5 MN/m, 100 MN/m in between; 80 t at 1 m/s."""
    load, unload, k, m, v = 10e6, 2.5e6, 100e6, 80e3, 1.0
    gear = {
        "kind": "hysteresis",
        "loading": line(2000.0, 200.0, 0.0),
        "unloading": line(500.0, 200.0, 0.0),
        "transition_stiffness_kN_per_mm": 100.0,
    }
    values = scenario({"gear": gear}, 80.0)
    stroke = v * math.sqrt(m / load)
    back = _given_back(stroke, load * stroke, (0.0, unload), k)
    name = "Hysteresis, from zero force"
    yield Exact(name, values, "stroke_mm front", stroke * 1e3)
    yield Exact(name, values, "speed_m_s M1", -math.sqrt(2 * back / m))
    yield Exact(name, values, "lost_kJ all", (0.5 * m * v**2 - back) / 1e3)


def _given_back(stroke: float, force: float, unloading: tuple[float, float], k: float) -> float:
    """Energy that comes back along k and then along an unloading line f + s u, whose start rises along k [J]."""
    f, s = unloading
    q = stroke - force / k
    u = (f + k * q) / (k - s)  # where the transition meets the unloading line
    low = f + s * u
    start = f / (k - s)  # where the rise along k meets it
    return (force**2 - low**2) / (2 * k) + f * (u - start) + 0.5 * s * (u**2 - start**2) + 0.5 * k * start**2


def friction_gear() -> Iterator[Exact]:
    """A draft gear with a preload: 240 kN + 25.7 MN/m in, 50 kN + 2.85 MN/m out, 250 MN/m between, 50 mm of slack."""
    k, m = 250e6, 60e3
    (f, s), out = (240e3, 25.7e6), (50e3, 2.85e6)
    top = 0.09
    gear = {
        "kind": "hysteresis",
        "empty_stroke_mm": 50.0,
        "loading": line(240.0 + 25.7 * 120, 120.0, 240.0),
        "unloading": line(50.0 + 2.85 * 120, 120.0, 50.0),
        "transition_stiffness_kN_per_mm": 250.0,
    }
    start = f / (k - s)
    taken = f * (top - start) + 0.5 * s * (top**2 - start**2) + 0.5 * k * start**2
    back = _given_back(top, f + s * top, out, k)
    values = scenario({"gear": gear}, 60.0, math.sqrt(2 * taken / m))
    name = "Friction draft gear with preload and slack"
    yield Exact(name, values, "stroke_mm front", 50.0 + top * 1e3)
    yield Exact(name, values, "speed_m_s M1", -math.sqrt(2 * back / m))
    yield Exact(name, values, "lost_kJ all", (taken - back) / 1e3)


RATE = {"m": 40e3, "force": 1e6, "speed": 10.0}
SLOW = 0.01  # below this rate the factor is linear [m/s]


def rate_ideal(
    C: float, P: int, m: float = RATE["m"], force: float = RATE["force"], v: float = 10.0
) -> tuple[float, float]:
    """Stroke [m] and time [s] to rest of a rigid-plastic device with Cowper-Symonds at all rates; P is 1 or 2."""
    if P == 1:
        return m * C**2 / force * (v / C - math.log1p(v / C)), m * C / force * math.log1p(v / C)
    w = math.sqrt(v / C)
    stroke = 2 * m * C**2 / force * (w**3 / 3 - w**2 / 2 + w - math.log1p(w))
    return stroke, 2 * m * C / force * (w - math.log1p(w))


def rate(C: float, P: int, k: float = 1e9) -> Iterator[Exact]:
    """A constant force that grows with the rate; rise along k and linear part below 0.01 m/s are in it."""
    m, force, v0 = RATE["m"], RATE["force"], RATE["speed"]
    device = {
        "curve": line(force / 1e3, 3000.0, force / 1e3),
        "stiffness_kN_per_mm": k / 1e6,
        "rate": {"C_m_per_s": C, "P": P},
    }
    values = scenario({"tube": device}, m / 1e3, v0)
    omega = math.sqrt(k / m)

    def over(t: float) -> float:
        """How far the spring's force is below that of the envelope."""
        faster = math.pow(v0 * math.cos(omega * t) / C, 1 / P)
        return force * (1 + faster) - k * v0 / omega * math.sin(omega * t)

    meets = float(brentq(over, 0.0, 0.5 * math.pi / omega, xtol=1e-16))
    v1, u1 = v0 * math.cos(omega * meets), v0 / omega * math.sin(omega * meets)
    fast, slow = rate_ideal(C, P, v=v1), rate_ideal(C, P, v=SLOW)
    steep = (SLOW / C) ** (1 / P) / SLOW
    linear = rate_ideal(1 / steep, 1, v=SLOW)
    name = f"Rate factor, C {C:g} m/s, P {P}"
    yield Exact(name, values, "stroke_mm front", (u1 + fast[0] - slow[0] + linear[0]) * 1e3)
    yield Exact(name, values, "time_s front", meets + fast[1] - slow[1] + linear[1])


def _hydraulic(**more: Any) -> dict[str, Any]:
    return {"kind": "hydraulic", "beyond": {"kind": "stop", "stiffness_kN_per_mm": 100.0}, **more}


def orifice() -> Iterator[Exact]:
    """A constant orifice slows a vehicle as 1/(1 + c v t / m)."""
    m, c, v = 40e3, 40e3, 3.0
    values = scenario({"buffer": _hydraulic(stroke_mm=2000.0, orifice_kN_s2_per_m2=40.0)}, 40.0, v)
    name = "Hydraulic buffer, constant orifice"
    yield Exact(name, values, "speed_m_s M1", v / (1 + c * v / m))
    yield Exact(name, values, "stroke_mm front", m / c * math.log1p(c * v / m) * 1e3)


def preload() -> Iterator[Exact]:
    """The same with a preload of 100 kN, which is reached within 1 mm."""
    m, c, v, force, k = 40e3, 40e3, 3.0, 100e3, 100e6
    device = _hydraulic(
        stroke_mm=2000.0, orifice_kN_s2_per_m2=40.0, preload_kN=100.0, preload_stiffness_kN_per_mm=k / 1e6
    )
    values = scenario({"buffer": device}, 40.0, v)
    start, a = force / k, 2 * c / m
    # (v^2)' = -2/m (k u + c v^2) on the ramp
    square = (v**2 - 2 * k / m / a**2) * math.exp(-a * start) - 2 * k / m * (start / a - 1 / a**2)
    name = "Hydraulic buffer, preload"
    yield Exact(name, values, "stroke_mm front", (start + m / (2 * c) * math.log1p(c * square / force)) * 1e3)


def preload_ideal() -> tuple[float, float]:
    """Stroke [m] and time [s] if the preload were there at once."""
    m, c, v, force = 40e3, 40e3, 3.0, 100e3
    return m / (2 * c) * math.log1p(c * v**2 / force), m / math.sqrt(force * c) * math.atan(v * math.sqrt(c / force))


def gas_ideal(force: float, length: float, n: float, energy: float) -> tuple[float, float]:
    """Stroke [m] and force [N] at which gas without a ramp has taken an energy [J]."""
    left = (1 + energy * (n - 1) / (force * length)) ** (-1 / (n - 1))
    return length * (1 - left), force * left**-n


def gas(k: float = 100e6) -> Iterator[Exact]:
    """Gas alone: its preload rises along k, and all comes back."""
    m, v, force, length, n = 40e3, 0.8, 50e3, 0.12, 1.3
    device = {
        "kind": "gas_hydraulic",
        "stroke_mm": 110.0,
        "orifice_kN_s2_per_m2": 0.0,
        "gas": {"force_kN": 50.0, "length_mm": 120.0, "exponent": n, "preload_stiffness_kN_per_mm": k / 1e6},
        "rebound_orifice_kN_s2_per_m2": 0.0,
        "beyond": {"kind": "stop", "stiffness_kN_per_mm": 100.0},
    }
    values = scenario({"buffer": device}, 40.0, v)
    start = float(brentq(lambda u: k * u - force * (1 - u / length) ** -n, 0.0, 0.1 * length, xtol=1e-16))
    ramp = 0.5 * k * start**2
    before = force * length / (n - 1) * ((1 - start / length) ** (1 - n) - 1)  # under the gas, which the ramp replaces
    stroke, top = gas_ideal(force, length, n, 0.5 * m * v**2 - ramp + before)
    name = "Gas buffer, no orifice"
    yield Exact(name, values, "stroke_mm front", stroke * 1e3)
    yield Exact(name, values, "force_kN front", top / 1e3)
    yield Exact(name, values, "speed_m_s M1", -v)


def metering() -> Iterator[Exact]:
    """An orifice metered for a constant force, as a table: speed falls as exp(-area/m), then a stop takes the rest."""
    m, v, length, k = 40e3, 1.0, 0.1, 100e6
    table = [(u, m / (2 * (length - u))) for u in (n * 1e-3 for n in range(91))]
    area = sum(0.5 * (c0 + c1) * (u1 - u0) for (u0, c0), (u1, c1) in pairwise(table))
    device = _hydraulic(
        stroke_mm=90.0,
        metering={"stroke_mm": [u * 1e3 for u, _ in table], "orifice_kN_s2_per_m2": [c / 1e3 for _, c in table]},
    )
    values = scenario({"buffer": device}, 40.0, v)
    last = v * math.exp(-area / m)
    name = "Hydraulic buffer, metered, up to its stop"
    yield Exact(name, values, "stroke_mm front", (0.09 + last * math.sqrt(m / k)) * 1e3)
    yield Exact(name, values, "speed_m_s M1", -last)
    yield Exact(name, values, "force_kN front", max(200.0, last * math.sqrt(m * k) / 1e3))


PULL = {"m": 30e3, "k": 50e6, "brake": 33e3}


def _pulled(slack: float, breaking: float | None, time: float) -> tuple[dict[str, Any], float]:
    """Two vehicles of which the second one brakes, and at what speed the slack between them is taken up."""
    gear: dict[str, Any] = {"stiffness_kN_per_mm": PULL["k"] / 1e6, "slack_mm": slack * 1e3}
    if breaking is not None:
        gear["breaking_force_kN"] = breaking / 1e3
    coupler = {"curve": line(500.0, 500.0, 0.0), "stiffness_kN_per_mm": 100.0, "pull": gear}
    vehicles = [
        {"name": "A", "coupler": "coupler"},
        {"name": "B", "brakes": {"force_kN": PULL["brake"] / 1e3}},
    ]
    values = scenario(
        {"coupler": coupler},
        PULL["m"] / 1e3,
        10.0,
        {"gap_mm": 100_000.0},
        {"vehicles": vehicles, "coupler": "coupler"},
        time_limit_s=time,
    )
    return values, math.sqrt(2 * PULL["brake"] / PULL["m"] * slack)


def draw_gear() -> Iterator[Exact]:
    """A braked vehicle takes up 0.455 m of slack and pulls the one before it."""
    slack, half, k = 0.455, PULL["m"] / 2, PULL["k"]
    values, v = _pulled(slack, None, time=0.95)
    steady = PULL["brake"] / 2  # half of the brake is passed on
    top = steady + math.sqrt(steady**2 + k * half * v**2)
    yield Exact("Draw gear", values, "pull_kN M1-M2", top / 1e3)


def breaking() -> Iterator[Exact]:
    """The same with a draw gear that breaks at 600 kN."""
    slack, half, k, limit = 0.455, PULL["m"] / 2, PULL["k"], 600e3
    values, v = _pulled(slack, limit, time=1.0)
    square = v**2 + 2 / half * (PULL["brake"] / 2 * limit / k - 0.5 * limit**2 / k)
    name = "Draw gear that breaks"
    yield Exact(name, values, "pull_kN M1-M2", limit / 1e3)
    yield Exact(name, values, "lost_kJ all", 0.5 * limit**2 / k / 1e3)
    # from the break on, the speeds part by the brake alone
    a, omega = PULL["brake"] / PULL["m"], math.sqrt(k / half)
    steady = PULL["brake"] / 2 / k
    phase = math.atan2(-steady * omega, v)
    far = math.hypot(steady, v / omega)
    spent = (math.asin((limit / k - steady) / far) - phase) / omega
    apart = math.sqrt(square) + a * (1.0 - v / a - spent)
    mean = 10.0 - PULL["brake"] / (2 * PULL["m"]) * 1.0
    yield Exact(name, values, "speed_m_s M1", mean + apart / 2)
    yield Exact(name, values, "speed_m_s M2", mean - apart / 2)


def _on_wall(front: Mapping[str, Any], other: Mapping[str, Any], mass_t: float, speed_m_s: float) -> dict[str, Any]:
    """A front device against a device on a wall."""
    return scenario(
        {"a": front, "b": other},
        mass_t,
        speed_m_s,
        {"partner": "stop"},
        obstacles={"stop": {"fixed": True, "front": "b"}},
    )


def series_plateaus() -> Iterator[Exact]:
    """600 kN that stiffen after 0.3 m, in series with 800 kN; 60 t at 6 m/s."""
    m, v, k, low, high, length = 60e3, 6.0, 1e9, 600e3, 800e3, 0.3
    stiff = k / 1e6
    a = {"curve": line(600.0, 300.0, 600.0), "stiffness_kN_per_mm": stiff, "beyond": "stop"}
    b = {"curve": line(800.0, 2000.0, 800.0), "stiffness_kN_per_mm": stiff}
    values = _on_wall(a, b, 60.0, v)
    first = length + (high - low) / k
    taken = low * length - 0.5 * low**2 / k + 0.5 * (high**2 - low**2) / k
    second = (0.5 * m * v**2 - taken + 0.5 * high**2 / k) / high
    name = "Two plateaus in series"
    yield Exact(name, values, "stroke_mm moving", first * 1e3)
    yield Exact(name, values, "stroke_mm struck", second * 1e3)
    yield Exact(name, values, "stroke_mm front", (first + second) * 1e3)


def series_shear_off() -> Iterator[Exact]:
    """Bolts of 1200 kN in series with a soft spring, which gives its energy up as they shear; 60 t at 2 m/s."""
    m, v, k, soft = 60e3, 2.0, 1e9, 100e6
    bolt, plateau, contact = 1.2e6, 1e6, 0.0517
    a = {
        "stages": {
            "coupler": {"curve": line(700.0, 0.7, 0.0), "shear_off": {"force_kN": 1200.0, "ramp_mm": 0.5}},
            "absorber": {"empty_stroke_mm": 51.0, "curve": line(1000.0, 1000.0, 1000.0)},
        },
        "stiffness_kN_per_mm": k / 1e6,
    }
    b = {"curve": line(5000.0, 50.0, 0.0), "stiffness_kN_per_mm": soft / 1e6}
    values = _on_wall(a, b, 60.0, v)
    lost = 0.5 * bolt**2 * (1 / k + 1 / soft)
    elastic = 0.5 * plateau**2 * (1 / k + 1 / soft)
    crushed = 0.5 * m * v**2 - lost - elastic
    stroke = contact + plateau / k + plateau / soft + crushed / plateau
    name = "Shear-off in series with a spring"
    yield Exact(name, values, "stroke_mm front", stroke * 1e3)
    yield Exact(name, values, "lost_kJ all", (lost + crushed) / 1e3)
    yield Exact(name, values, "speed_m_s M1", -math.sqrt(2 * elastic / m))
    after = _on_wall(a, b, 60.0, v)
    after["simulation"] |= {"time_limit_s": 0.012}  # sheared, and the absorber not met
    yield Exact("Shear-off in series with a spring, after it", after, "speed_m_s M1", math.sqrt(v**2 - 2 * lost / m))


def obstacle(mass_t: float, speed_km_h: float, stiff: float = 1e9) -> Iterator[Exact]:
    """A lorry of 15 t with 4.5 MN at 0.7 m and 3.0 MN at 1.5 m, which is then held, struck by a stiff front."""
    other, k = 15e3, 100.0
    points = [(0.0, 0.0), (0.7, 4.5e6), (1.5, 3.0e6), (5.0, 3.0e6)]
    m = mass_t * 1e3 * other / (mass_t * 1e3 + other)
    energy = 0.5 * m * (speed_km_h / 3.6) ** 2

    def force(u: float) -> float:
        for (u0, f0), (u1, f1) in pairwise(points):
            if u <= u1:
                return f0 + (f1 - f0) * (u - u0) / (u1 - u0)
        return points[-1][1]

    def missing(u: float) -> float:
        area = 0.0
        for (u0, f0), (u1, _) in pairwise(points):
            high = min(u, u1)
            if high > u0:
                area += 0.5 * (f0 + force(high)) * (high - u0)
        return area + 0.5 * force(u) ** 2 / stiff - energy

    stroke = float(brentq(missing, 0.0, 5.0, xtol=1e-15))
    side = {"curve": {"stroke_mm": [0.0, 700.0, 1500.0], "force_kN": [0.0, 4500.0, 3000.0]}}
    devices = {
        "stiff": {"curve": line(10_000.0, 10_000.0 / (stiff / 1e6), 0.0), "stiffness_kN_per_mm": stiff / 1e6},
        "lorry": {**side, "stiffness_kN_per_mm": k, "beyond": "hold"},
    }
    values = scenario(
        devices,
        mass_t,
        speed_km_h / 3.6,
        {"partner": "lorry"},
        obstacles={"lorry": {"mass_t": 15.0, "length_m": 6.0, "front": "lorry", "rail_friction": 0.0}},
    )
    name = f"Lorry of 15 t, {mass_t:g} t at {speed_km_h:g} km/h"
    yield Exact(name, values, "stroke_mm struck", stroke * 1e3)


def car_body() -> Iterator[Exact]:
    """800 kN to 418 mm, then the car body at 2000 kN; 40 t at 10 m/s."""
    m, v, k, force, length, collapse = 40e3, 10.0, 1e9, 800e3, 0.418, 2e6
    device = {"curve": line(800.0, 418.0, 800.0), "stiffness_kN_per_mm": k / 1e6, "beyond": "car_body"}
    values = scenario({"tube": device}, 40.0, v)
    taken = force * length - 0.5 * force**2 / k + 0.5 * (collapse**2 - force**2) / k
    body = (0.5 * m * v**2 - taken) / collapse
    yield Exact("Car body behind a tube", values, "stroke_mm front", (length + (collapse - force) / k + body) * 1e3)


SOFT = {"curve": line(500.0, 500.0, 0.0), "stiffness_kN_per_mm": 100.0}


def constant_brake() -> Iterator[Exact]:
    """33 t at 20 m/s: 33 kN after 0.5 s, rail friction of 0.008, 5 per mille downhill."""
    m, v, delay = 33e3, 20.0, 0.5
    roll = G * (0.008 - 0.005)
    hard = roll + 33e3 / m
    v1 = v - roll * delay
    train = {"brakes": {"force_kN": 33.0, "delay_s": delay}}
    collision = {"gap_mm": 1e6, "rail_friction": 0.008, "grade_per_mille": -5.0}
    values = scenario({"d": SOFT}, 33.0, v, collision, train, time_limit_s=30.0, step_ms=0.1)
    name = "Brake after a delay, downhill"
    yield Exact(name, values, "stands_s M1", delay + v1 / hard)
    yield Exact(name, values, "travel_m M1", (v + v1) / 2 * delay + v1**2 / (2 * hard))


def rising_brake() -> Iterator[Exact]:
    """1 m/s2 that rises over 1.5 s after 0.5 s, from 20 m/s."""
    v, a, delay, rise = 20.0, 1.0, 0.5, 1.5
    train = {"brakes": {"deceleration_m_per_s2": a, "delay_s": delay, "rise_s": rise}}
    values = scenario({"d": SOFT}, 33.0, v, {"gap_mm": 1e6}, train, time_limit_s=30.0, step_ms=0.1)
    v1 = v - a * rise / 2
    travel = v * (delay + rise) - a * rise**2 / 6 + v1**2 / (2 * a)
    name = "Brake that rises"
    yield Exact(name, values, "stands_s M1", delay + rise + v1 / a)
    yield Exact(name, values, "travel_m M1", travel)


def grades() -> Iterator[Exact]:
    """A wagon with a rail friction of 0.008 stands on 5 per mille, and rolls on 10."""
    for grade in (5.0, 10.0):
        collision = {"partner": "w", "gap_mm": 1e5, "rail_friction": 0.008, "grade_per_mille": grade}
        values = scenario({"d": SOFT}, 33.0, 5.0, collision, time_limit_s=10.0, step_ms=0.1)
        values["trains"]["w"] = {"vehicles": 1, "mass_t": 33.0, "front": "d"}
        rolls = max(0.0, G * (grade / 1e3 - 0.008))
        yield Exact(f"Standing wagon on {grade:g} per mille", values, "speed_m_s S1", -rolls * 10.0)
