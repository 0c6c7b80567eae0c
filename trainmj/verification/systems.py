"""Systems to collide: in a few words, shipped or drawn at random; and what their vehicles and devices do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trainmj.collision import kernel
from trainmj.collision.batch import run_chains
from trainmj.collision.block import Layout, Tally
from trainmj.collision.chain import WALL, Chain, Interface, Vehicle, meet
from trainmj.collision.device import Device, Stage
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import Element, Joint
from trainmj.collision.law import crush
from trainmj.collision.lineup import line_up
from trainmj.collision.mj import mujoco
from trainmj.collision.model import build
from trainmj.collision.simulation import start
from trainmj.collision.summary import Summary
from trainmj.scenario import Scenario, load
from trainmj.units import KN, KN_PER_MM, KN_S_PER_M, MM, MS

FRICTIONLESS = {"collision.rail_friction": 0}
"""Changes of a scenario under which momentum is kept."""


METRO: dict[str, Any] = {
    "body": {"pitch_inertia_t_m2": 750, "cog_height_m": 1.6},
    "bogies": {
        "centres_m": 12.6,
        "wheelbase_m": 2.3,
        "frame_t": 2.56,
        "frame_pitch_t_m2": 1.75,
        "wheelset_t": 1.42,
        "axle_height_m": 0.42,
        "link_height_m": 0.6,
        "cog_height_m": 0.5,
    },
    "secondary": {
        "kN_per_mm": 0.7,
        "kN_s_per_m": 60,
        "lift_stop_mm": 60,
        "bump_stop_mm": 60,
        "stop_kN_per_mm": 20,
    },
    "primary": {"kN_per_mm": 3.4, "kN_s_per_m": 20, "lift_stop_mm": 30, "bump_stop_mm": 40, "stop_kN_per_mm": 20},
}
"""A type of vehicle in the vertical plane, as a scenario states it."""

STRUT: dict[str, Any] = {
    "acts": "strut",
    "height_mm": 660,
    "pin_m": 1.5,
    "swing": {"free_mrad": 100, "MN_m_per_rad": 2},
}
FACE: dict[str, Any] = {
    "acts": "face",
    "height_mm": 950,
    "overlap_mm": 120,
    "tie": {"friction": 0.2, "tooth_kN": 0, "kN_per_mm": 100},
}


_LINES: dict[str, dict[str, Any]] = {
    "b_type": {
        "trains.b_type.type": "metro",
        "devices.front.stages.coupler.line": STRUT,
        "devices.front.stages.anti_climber.line": FACE,
        "devices.coupler_a_b.line": STRUT,
        "devices.coupler_c_d.line": STRUT,
    },
    "en15227_c1": {
        "trains.main_line.type": "metro",
        "devices.head.stages.coupler.line": FACE,
        "devices.between.stages.coupler.line": STRUT,
    },
    "wagon_80t": {
        "trains.main_line.type": "metro",
        "trains.wagon_80t.type": "metro",
        "devices.head.stages.coupler.line": FACE,
        "devices.between.stages.coupler.line": STRUT,
        "devices.wagon_buffers.line": FACE,
    },
}
"""What makes a shipped scenario one in the vertical plane."""


def envelope(points: Sequence[tuple[float, float]], stiffness: float, damping: float = 0.0) -> Envelope:
    """An envelope from points (mm, kN), its stiffness in kN/mm and its dashpot in kN s/m."""
    u, f = np.array(points, dtype=float).T
    return Envelope(u * MM, f * KN, stiffness * KN_PER_MM, damping * KN_S_PER_M)


def device(e: Envelope, name: str = "device") -> Device:
    """A device of one stage."""
    return Device(name, crush.law_of(e), (Stage(name, 0.0, np.inf),))


def chain(
    mass_kg: Sequence[float],
    envelopes: Sequence[Envelope],
    speed: Sequence[float],
    n_moving: int = 1,
    friction: float = 0.0,
    step: float = 1e-5,
    time_limit: float = 1.0,
    gap: float = 0.0,
    steps_per_record: int = 10,
) -> Chain:
    """Vehicles in line with given envelopes between them, the last one against a wall if there is one for it."""
    n = len(mass_kg)
    vehicles = tuple(
        Vehicle(f"V{i}", "", m, 20.0, v, friction) for i, (m, v) in enumerate(zip(mass_kg, speed, strict=True))
    )
    interfaces = tuple(
        Interface(f"I{i}", i, i + 1 if i + 1 < n else WALL, meet(device(e)), (device(e),))
        for i, e in enumerate(envelopes)
    )
    return Chain(vehicles, interfaces, n_moving, gap, step, steps_per_record, time_limit)


def values(
    points: Sequence[tuple[float, float]],
    stiffness: float,
    mass_t: Sequence[float] = (33,),
    partner: str = "rigid_wall",
    speed_m_s: float = 1.0,
    damping: float = 0.0,
    collision: Mapping[str, Any] | None = None,
    step_ms: float = 0.001,
    time_limit_s: float = 1.0,
) -> dict[str, Any]:
    """The values of a scenario file with one device everywhere; units of the device as in :func:`envelope`."""
    stroke, force = np.array(points, dtype=float).T.tolist()
    device = {
        "curve": {"stroke_mm": stroke, "force_kN": force},
        "stiffness_kN_per_mm": float(stiffness),
        "damping_kN_s_per_m": float(damping),
    }
    vehicles = [{"name": f"car {i + 1}", "mass_t": float(m)} for i, m in enumerate(mass_t)]
    return {
        "devices": {"d": device},
        "trains": {"t": {"vehicles": vehicles, "front": "d", "rear": "d", "coupler": "d"}},
        "collision": {"train": "t", "speed_km_h": speed_m_s * 3.6, "partner": partner, **(collision or {})},
        "simulation": {"step_ms": step_ms, "record_every_ms": max(step_ms, 0.1), "time_limit_s": time_limit_s},
    }


def scenario(*args: Any, **kwargs: Any) -> Scenario:
    """A checked scenario; arguments as in :func:`values`."""
    return Scenario.from_values(values(*args, **kwargs))


def pulses(mass_t: float, speed_m_s: float, parts: Sequence[tuple[float, float]], step_ms: float = 0.001) -> Scenario:
    """A vehicle into a wall, pushed by forces [kN] one after the other, each for so long [ms]; it rolls on after them.

    Forces change within a thousandth of a mm.
    """
    points: list[tuple[float, float]] = []
    u, v = 0.0, speed_m_s
    for force, ms in parts:
        change = force / mass_t * ms * MS
        way = (v - 0.5 * change) * ms * MS / MM
        points += [(u + 5e-4 * bool(points), force), (u + way - 5e-4, force)]
        u, v = u + way, v - change
    points += [(u + 5e-4, 0), (u + 3000, 0)]
    limit = sum(ms for _, ms in parts) * MS + 0.05
    return scenario(points, 5e4, [mass_t], speed_m_s=speed_m_s, step_ms=step_ms, time_limit_s=limit)


def random_collision(seed: int, most: int = 40) -> Scenario:
    """A collision of 2 to most vehicles, the same one for the same seed.

    Both sides move or one stands; one may be longer than the other; there may be a gap and an empty stroke; devices
    have plateaus, bulges, shear-offs and steep rises; masses go from 10 t to 100 t, closing speeds from 2 to 30 km/h.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, most + 1))
    n_moving = int(rng.integers(1, n))
    kinds = [f"d{i}" for i in range(int(rng.integers(1, 5)))]
    speed = float(rng.uniform(2.0, 30.0))
    carried = float(rng.choice([0.0, 0.0, rng.uniform(-30.0, 30.0)]))

    def train(count: int) -> dict[str, Any]:
        mass = rng.uniform(10.0, 100.0, count) if rng.random() < 0.7 else np.full(count, rng.uniform(10.0, 100.0))
        cars = [
            {"name": f"car {i + 1}", "mass_t": float(m), "coupler": str(rng.choice(kinds))} for i, m in enumerate(mass)
        ]
        return {"vehicles": cars, "front": str(rng.choice(kinds))}

    return Scenario.from_values(
        {
            "devices": {name: _device(rng) for name in kinds},
            "trains": {"a": train(n_moving), "b": train(n - n_moving)},
            "collision": {
                "train": "a",
                "partner": "b",
                "speed_km_h": speed + carried,
                "partner_speed_km_h": carried,
                "gap_mm": float(rng.choice([0.0, rng.uniform(0.0, 100.0)])),
                "rail_friction": float(rng.choice([0.0, rng.uniform(0.0, 0.05)])),
            },
            "simulation": {"step_ms": 0.005, "record_every_ms": 1.0, "time_limit_s": 1.0},
        }
    )


def _device(rng: np.random.Generator) -> dict[str, Any]:
    """A device of one or two stages; where its curve rises faster than its stiffness, it climbs along that."""
    stiffness = float(10 ** rng.uniform(1.0, 3.0))  # kN/mm
    stages: dict[str, Any] = {"coupler": _stage(rng)}
    if rng.random() < 0.3:
        top = stages["coupler"]["curve"]["force_kN"][-1]
        stages["coupler"]["shear_off"] = {"force_kN": float(top * rng.uniform(1.0, 1.3)), "ramp_mm": 0.25}
        stages["absorber"] = {**_stage(rng), "empty_stroke_mm": float(rng.uniform(1.0, 60.0))}
    damping = float(rng.choice([0.0, 10 ** rng.uniform(0.0, 3.5)]))  # kN s/m
    return {"stages": stages, "stiffness_kN_per_mm": stiffness, "damping_kN_s_per_m": damping}


def _stage(rng: np.random.Generator) -> dict[str, Any]:
    """A curve that rises first, then rises, holds or falls from point to point."""
    n = int(rng.integers(1, 6))
    stroke = np.cumsum(np.concatenate([[0.0, rng.uniform(1.0, 80.0)], rng.uniform(0.5, 250.0, n)]))
    force = rng.uniform(200.0, 800.0) * np.cumprod(np.append(1.0, rng.choice([0.9, 1.0, 1.2, 1.7], n)))
    return {"curve": {"stroke_mm": stroke.tolist(), "force_kN": [0.0, *force.tolist()]}}


def planar(changes: Mapping[str, Any] | None = None, name: str = "b_type") -> Scenario:
    """A shipped scenario in the vertical plane, with changes by path: every train on one type of vehicle.

    Couplers are struts and what is behind a shear-off are faces, and so are the heads of a train against a wagon.
    """
    return load(name, {"plane": "vertical", "vehicle_types": {"metro": METRO}, **_LINES[name], **(changes or {})})


def shipped(name: str = "b_type", changes: Mapping[str, Any] | None = None) -> Chain:
    """The chain of a shipped scenario, some values of it changed."""
    return line_up(load(name, changes or {}))


def collide(*cases: Chain) -> list[Summary]:
    """Collide cases side by side, and summarise each."""
    found = dict(run_chains(enumerate(cases)))
    return [found[k] for k in range(len(cases))]


class Ride:
    """A simulation that can go on after the collision is over."""

    def __init__(self, case: Chain) -> None:
        """Build the model of a case and put it at the start."""
        self.case, self.layout = case, Layout.of(case)
        self.model = build(case, bare=True)
        self.data = start(self.model, case, self.layout)

    def go(self, seconds: float) -> Ride:
        """Simulate some more seconds."""
        with kernel.installed():
            mujoco.mj_step(self.model, self.data, nstep=round(seconds / self.case.step))
        return self

    def joint(self, field: Joint) -> Array:
        """(n_interface,) view of what the law keeps of each interface."""
        return self.layout.joint(self.data.userdata, field)

    def element(self, field: Element) -> Array:
        """(n_element,) view of what it keeps of each of their elements."""
        return self.layout.element(self.data.userdata, field)

    @property
    def tally(self) -> Tally:
        """What the device law has counted."""
        return Tally.of(self.layout, self.data.userdata)


def follow(case: Chain, step: float | None = None) -> Tally:
    """What is counted up to the time limit of a case, at its own step or another one [s]."""
    case = case if step is None else replace(case, step=step)
    return Ride(case).go(case.time_limit).tally
