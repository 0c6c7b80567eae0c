"""Random trains with devices of every kind, ends, brakes, grades and obstacles, as the values of scenario files."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

Rng = np.random.Generator


def random_scenario(seed: int) -> dict[str, Any]:
    """A collision of 2 to 8 vehicles at 5 to 40 km/h, the same one for the same seed.

    Every train has couplers of one or several kinds, some of them a device on each end; fronts are equal or not.
    """
    rng = np.random.default_rng(seed)
    speed = float(rng.uniform(5.0, 40.0))
    carried = float(rng.choice([0.0, 0.0, rng.uniform(-10.0, 0.5 * speed)]))
    closing = (speed - carried) / 3.6
    partner = str(rng.choice(["train", "train", "train", "free", "fixed", "rigid_wall"]))
    n = int(rng.integers(2, 9))
    moving = n if partner in ("fixed", "rigid_wall") else n - 1 if partner == "free" else int(rng.integers(1, n))
    devices = {f"c{k}": _device(rng, 0.5 * closing, inner=True) for k in range(int(rng.integers(1, 4)))}
    devices["f0"] = _device(rng, closing, inner=False)
    devices["f1"] = _device(rng, closing, inner=False)
    fronts = ["f0", str(rng.choice(["f0", "f1", "f1"]))]
    if rng.random() < 0.15:  # two paths: different bolts on both sides
        devices["f0"], devices["f1"] = _staged(rng), _staged(rng)
    trains = {"a": _train(rng, moving, devices, fronts[0]) | {"rear": fronts[0]}}
    obstacles: dict[str, Any] = {}
    collision: dict[str, Any] = {
        "train": "a",
        "train_end": str(np.random.default_rng([seed, 2]).choice(["front", "front", "rear"])),
        "speed_km_h": speed,
        "partner": {"train": "b", "free": "thing", "fixed": "thing"}.get(partner, partner),
        "gap_mm": float(rng.choice([0.0, rng.uniform(0.0, 50.0)])),
        "rail_friction": float(rng.choice([0.0, rng.uniform(0.0, 0.02)])),
        "grade_per_mille": float(rng.choice([0.0, 0.0, rng.uniform(-20.0, 20.0)])),
    }
    if partner == "train":
        trains["b"] = _train(rng, n - moving, devices, fronts[1])
        trains["b"]["rear"] = fronts[1]
        collision["partner_end"] = str(rng.choice(["front", "front", "rear"]))
    if partner == "free":
        obstacles["thing"] = {"mass_t": float(rng.uniform(5.0, 40.0)), "length_m": 6.0, "front": fronts[1]}
        obstacles["thing"]["rail_friction"] = float(rng.choice([0.0, 0.3]))
    if partner == "fixed":
        obstacles["thing"] = {"fixed": True, "front": fronts[1]}
    if partner in ("train", "free"):
        collision["partner_speed_km_h"] = carried
    values = {
        "devices": devices,
        "trains": trains,
        "collision": collision,
        "simulation": {"step_ms": 0.01, "record_every_ms": 1.0, "time_limit_s": 1.0},
    }
    values |= {"obstacles": obstacles} if obstacles else {}
    return _by_ends(values, np.random.default_rng([seed, 3]))


def _by_ends(values: dict[str, Any], rng: Rng) -> dict[str, Any]:
    """The same collision, in half of the trains stated by the devices at the ends of vehicles, where there are two."""
    trains = {}
    for name, train in values["trains"].items():
        cars = [dict(car) for car in train["vehicles"]]
        for car, behind in pairwise(cars if rng.random() < 0.5 else []):
            if isinstance(car["coupler"], list):
                car["rear"], behind["front"] = car.pop("coupler")
        trains[name] = train | {"vehicles": cars}
    return values | {"trains": trains}


def _train(rng: Rng, count: int, devices: dict[str, Any], front: str) -> dict[str, Any]:
    names = [name for name in devices if name.startswith("c")]
    plain = [name for name in names if "pull" not in devices[name]]
    cars = []
    for k in range(count):
        car: dict[str, Any] = {"name": f"car {k + 1}", "mass_t": float(rng.uniform(15.0, 80.0))}
        car["coupler"] = str(rng.choice(names))
        if plain and rng.random() < 0.25:
            car["coupler"] = [str(rng.choice(plain)), str(rng.choice(plain))]
        if rng.random() < 0.2:
            car["rail_friction"] = float(rng.uniform(0.0, 0.05))
        if rng.random() < 0.2:
            car["brakes"] = {"force_kN": float(rng.uniform(5.0, 60.0))}
        if rng.random() < 0.2:
            car["load"] = {"seats": int(rng.integers(20, 80)), "share": float(rng.uniform(0.0, 1.0)), "kg": 80.0}
        cars.append(car)
    train: dict[str, Any] = {"vehicles": cars, "front": front}
    if rng.random() < 0.4:
        key, most = ("force_kN", 60.0) if rng.random() < 0.5 else ("deceleration_m_per_s2", 1.2)
        train["brakes"] = {
            key: float(rng.uniform(0.1, 1.0) * most),
            "delay_s": float(rng.uniform(0.0, 0.3)),
            "rise_s": float(rng.choice([0.0, rng.uniform(0.1, 0.5)])),
            "adhesion": float(rng.uniform(0.05, 0.2)),
        }
    return train


def _device(rng: Rng, rate: float, inner: bool) -> dict[str, Any]:
    """A device of any kind for about a closing rate [m/s]."""
    kind = str(rng.choice(["crush", "crush", "rate", "staged", "hysteresis", "hydraulic", "gas_hydraulic"]))
    if kind == "staged" and not inner:
        device = _staged(rng)
    elif kind == "hysteresis":
        device = _hysteresis(rng)
    elif kind == "hydraulic":
        device = _hydraulic(rng, rate)
    elif kind == "gas_hydraulic":
        device = _gas(rng, rate)
    else:
        device = _crush(rng, kind == "rate")
    if inner and rng.random() < 0.4:
        device["pull"] = _pull(rng)
    return device


def _points(rng: Rng, most: float) -> dict[str, list[float]]:
    """A curve that rises first, then rises, holds or falls from point to point [mm, kN]."""
    n = int(rng.integers(1, 5))
    stroke = np.cumsum(np.concatenate([[0.0, rng.uniform(2.0, 60.0)], rng.uniform(20.0, 250.0, n)]))
    force = rng.uniform(0.3, 0.6) * most * np.cumprod(np.append(1.0, rng.choice([0.9, 1.0, 1.1, 1.3], n)))
    return {"stroke_mm": stroke.tolist(), "force_kN": [0.0, *np.minimum(force, most).tolist()]}


def _crush(rng: Rng, rated: bool) -> dict[str, Any]:
    most = float(rng.uniform(500.0, 1400.0))
    device: dict[str, Any] = {
        "curve": _points(rng, most),
        "stiffness_kN_per_mm": float(10 ** rng.uniform(1.7, 3.0)),
        "damping_kN_s_per_m": float(rng.choice([0.0, rng.uniform(20.0, 400.0)])),
    }
    if rng.random() < 0.3:
        device["empty_stroke_mm"] = float(rng.uniform(1.0, 40.0))
    if not rated:
        return device | _end(rng)
    curve = device["curve"]
    curve["stroke_mm"].append(curve["stroke_mm"][-1] + 3000.0)  # long enough not to end
    curve["force_kN"].append(curve["force_kN"][-1])
    if rng.random() < 0.6:
        device["rate"] = {"C_m_per_s": float(rng.uniform(5.0, 100.0)), "P": float(rng.uniform(1.0, 5.0))}
    else:
        faster = {"stroke_mm": curve["stroke_mm"], "force_kN": [1.3 * f for f in curve["force_kN"]]}
        device["rate"] = {"curves": [{"speed_m_per_s": float(rng.uniform(1.0, 8.0)), "curve": faster}]}
    return device


def _end(rng: Rng) -> dict[str, Any]:
    """What is behind a device of its own stiffness; nothing in some."""
    kind = str(rng.choice(["none", "car_body", "stop", "hold"]))
    if kind == "none":
        return {}
    if kind == "car_body":
        return {"beyond": {"kind": "car_body", "collapse_force_kN": float(rng.uniform(1800.0, 2500.0))}}
    return {"beyond": kind}


def _staged(rng: Rng) -> dict[str, Any]:
    """A coupler with bolts that shear, and an absorber behind it."""
    first = _points(rng, float(rng.uniform(500.0, 900.0)))
    shear = first["force_kN"][-1] * float(rng.uniform(1.02, 1.4))
    level = float(rng.uniform(500.0, 1300.0))
    return {
        "stages": {
            "coupler": {"curve": first, "shear_off": {"force_kN": shear, "ramp_mm": 0.25}},
            "absorber": {
                "empty_stroke_mm": float(rng.uniform(2.0, 60.0)),
                "curve": {"stroke_mm": [0.0, 2.0, 2000.0], "force_kN": [0.0, level, level]},
            },
        },
        "stiffness_kN_per_mm": float(10 ** rng.uniform(2.0, 3.0)),
        "damping_kN_s_per_m": float(rng.choice([0.0, rng.uniform(20.0, 100.0)])),
    }


def _hysteresis(rng: Rng) -> dict[str, Any]:
    stroke = float(rng.uniform(60.0, 250.0))
    preload, top = float(rng.choice([0.0, rng.uniform(20.0, 200.0)])), float(rng.uniform(500.0, 1700.0))
    share = float(rng.uniform(0.1, 0.9))
    middle = preload + (top - preload) * float(rng.uniform(0.3, 0.6))
    strokes, force = [0.0, 0.5 * stroke, stroke], [preload, middle, top]
    device = {
        "kind": "hysteresis",
        "loading": {"stroke_mm": strokes, "force_kN": force},
        "unloading": {"stroke_mm": strokes, "force_kN": [share * f for f in force]},
        "transition_stiffness_kN_per_mm": float(rng.uniform(100.0, 300.0)),
    }
    if rng.random() < 0.3:
        device["empty_stroke_mm"] = float(rng.uniform(1.0, 50.0))
    return device | _end(rng)


def _orifice(rng: Rng, rate: float, stroke: float) -> dict[str, Any]:
    c = float(rng.uniform(200.0, 1200.0)) / rate**2
    if rng.random() < 0.5:
        return {"orifice_kN_s2_per_m2": c}
    table = {"stroke_mm": [0.0, 0.5 * stroke, stroke], "orifice_kN_s2_per_m2": [0.7 * c, c, 2.5 * c]}
    return {"metering": table}


def _behind(rng: Rng) -> dict[str, Any]:
    """What a hydraulic device must state."""
    beyond: dict[str, Any] = {"kind": "stop", "stiffness_kN_per_mm": float(rng.uniform(50.0, 300.0))}
    if rng.random() < 0.5:
        beyond |= {"kind": "car_body", "collapse_force_kN": float(rng.uniform(1800.0, 2500.0))}
    return {"beyond": beyond}


def _hydraulic(rng: Rng, rate: float) -> dict[str, Any]:
    stroke = float(rng.uniform(60.0, 400.0))
    device = {"kind": "hydraulic", "stroke_mm": stroke, **_orifice(rng, rate, stroke), **_behind(rng)}
    if rng.random() < 0.5:
        device |= {"preload_kN": float(rng.uniform(10.0, 100.0)), "preload_stiffness_kN_per_mm": 50.0}
    return device


def _gas(rng: Rng, rate: float) -> dict[str, Any]:
    stroke = float(rng.uniform(60.0, 250.0))
    gas = {
        "force_kN": float(rng.uniform(20.0, 100.0)),
        "length_mm": stroke * float(rng.uniform(1.2, 1.6)),
        "exponent": float(rng.uniform(1.0, 1.4)),
        "preload_stiffness_kN_per_mm": 50.0,
    }
    rebound = {"rebound_orifice_kN_s2_per_m2": float(rng.uniform(50.0, 600.0))}
    kind = {"kind": "gas_hydraulic", "stroke_mm": stroke, "gas": gas, **rebound}
    return {**kind, **_orifice(rng, rate, stroke), **_behind(rng)}


def _pull(rng: Rng) -> dict[str, Any]:
    gear: dict[str, Any] = {
        "stiffness_kN_per_mm": float(rng.uniform(20.0, 100.0)),
        "slack_mm": float(rng.choice([0.0, rng.uniform(1.0, 30.0)])),
    }
    if rng.random() < 0.5:
        gear["damping_kN_s_per_m"] = float(rng.uniform(10.0, 100.0))
    if rng.random() < 0.4:
        gear["breaking_force_kN"] = float(rng.uniform(300.0, 900.0))
    if rng.random() < 0.3:
        gear["curve"] = {"stroke_mm": [0.0, 10.0, 200.0], "force_kN": [0.0, 500.0, 800.0]}
    return gear


def with_bodies(values: dict[str, Any], seed: int) -> dict[str, Any]:
    """The same collision with car bodies that give: all vehicles of a train, some, or all but some.

    Some bodies are soft, some collapse far, some have bogies, and devices are attached behind their ends.
    """
    rng = np.random.default_rng([seed, 1])
    trains = {}
    for name, train in values["trains"].items():
        cars = [{**car, "length_m": float(rng.uniform(12.0, 28.0))} for car in train["vehicles"]]
        whole = rng.random() < 0.6
        for car in cars:
            if rng.random() < (0.3 if whole else 0.6):
                least = car["mass_t"]
                car["body"] = "rigid" if rng.random() < 0.25 else _body(rng, least, car["length_m"])
        least, length = (min(car[key] for car in cars) for key in ("mass_t", "length_m"))
        trains[name] = {**train, "vehicles": cars, **({"body": _body(rng, least, length)} if whole else {})}
    return {**values, "trains": trains}


def _body(rng: Rng, mass: float, length: float) -> dict[str, Any]:
    """A body for vehicles of at least a mass [t] and a length [m]."""
    stiffness = float(10 ** rng.uniform(1.7, 3.3))  # kN/mm
    stated = str(rng.choice(["stiffness_kN_per_mm", "EA_MN", "frequency_Hz"]))
    value = {
        "stiffness_kN_per_mm": stiffness,
        "EA_MN": stiffness * length,
        "frequency_Hz": max(1.0, 0.5 * float(np.sqrt(1e3 * stiffness / mass))),
    }[stated]
    body: dict[str, Any] = {stated: value, "members": int(rng.choice([1, 2, 3, 4, 4, 4, 7]))}
    body["damping_ratio"] = float(rng.choice([0.0, 0.02, 0.02, rng.uniform(0.0, 0.3)]))
    if rng.random() < 0.5:
        body["collapse_force_kN"] = float(rng.uniform(300.0, 2500.0))
        body["hardening_kN_per_mm"] = float(rng.choice([0.0, rng.uniform(0.2, 5.0)]))
    if rng.random() < 0.5:
        body["attached_m"] = [float(rng.uniform(0.0, 0.4) * length), float(rng.uniform(0.0, 0.4) * length)]
    if rng.random() < 0.4:
        body["bogies"] = {
            "mass_t": float(rng.uniform(0.08, 0.2) * mass),
            "centres_m": float(rng.uniform(0.5, 0.9) * length),
            "stiffness_kN_per_mm": float(rng.uniform(50.0, 500.0)),
        }
    return body


def random_train(seed: int, most: int = 12) -> dict[str, Any]:
    """A collision of 2 to 12 vehicles in the vertical plane at 5 to 40 km/h, the same one for the same seed.

    Their centres of gravity are off the middle, some stand higher or pitched; couplers are struts or faces, fronts are
    faces, struts, or both with a shear-off between them. A wall meets faces alone.
    """
    rng = np.random.default_rng([seed, 4])
    speed, n = float(rng.uniform(5.0, 40.0)), int(rng.integers(2, most + 1))
    wall = rng.random() < 0.2
    moving = n if wall else int(rng.integers(1, n))
    rough = rng.random() < 0.5
    types = {f"type_{k}": _vehicle_type(rng, rough) for k in range(int(rng.integers(1, 3)))}
    struts = rng.random() < 0.6  # those between vehicles of a train
    line = _strut if struts else _face
    devices = {f"c{k}": _inner(rng, speed / 3.6) | {"line": line(rng)} for k in range(int(rng.integers(1, 3)))}
    layout = "face" if wall else str(rng.choice(["staged", "staged", "face", "strut"]))
    for name in ("f0", "f1"):
        if layout == "staged":
            devices[name] = _staged(rng)
            devices[name]["stages"]["coupler"]["line"] = _strut(rng)
            devices[name]["stages"]["absorber"]["line"] = _face(rng)
        else:
            devices[name] = _crush(rng, False) | {
                "beyond": "hold",
                "line": (_face if layout == "face" else _strut)(rng),
            }
    collision: dict[str, Any] = {
        "train": "a",
        "speed_km_h": speed,
        "partner": "rigid_wall" if wall else "b",
        "gap_mm": float(rng.choice([0.0, rng.uniform(5.0, 50.0)])),
        "rail_friction": float(rng.choice([0.0, rng.uniform(0.0, 0.02)])),
        "grade_per_mille": float(rng.choice([0.0, 0.0, rng.uniform(-20.0, 20.0)])),
    }
    offsets: dict[str, float] = {} if wall else {"M": float(rng.uniform(-50.0, 50.0)) * (1.0 + rough)}
    if n > 3 and rng.random() < 0.5:
        offsets["M1" if moving == 1 else f"M{moving}"] = float(rng.uniform(-20.0, 20.0))
    collision |= {"offset_mm": offsets} if offsets else {}
    if rng.random() < 0.3:
        collision["pitch_mrad"] = {"M1": float(rng.uniform(-3.0, 3.0))}
    ties = str(rng.choice(["stated", "stated", "free", "tied"]))
    trains = {"a": _planar_train(rng, moving, devices, types) | {"front": "f0"}}
    if not wall:
        trains["b"] = _planar_train(rng, n - moving, devices, types) | {"front": str(rng.choice(["f0", "f1"]))}
    return {
        "plane": "vertical",
        "ties": "stated" if ties == "tied" and "'none'" in str(devices) else ties,  # nothing holds where there is none
        "vehicle_types": types,
        "devices": devices,
        "trains": trains,
        "collision": collision,
        "simulation": {"step_ms": 0.02, "record_every_ms": 1.0, "time_limit_s": 0.5},
    }


def _planar_train(rng: Rng, count: int, devices: dict[str, Any], types: dict[str, Any]) -> dict[str, Any]:
    names = [name for name in devices if name.startswith("c")]
    cars = []
    for k in range(count):
        car: dict[str, Any] = {"name": f"car {k + 1}", "mass_t": float(rng.uniform(28.0, 60.0))}
        car |= {"type": str(rng.choice(list(types))), "length_m": float(rng.uniform(19.0, 25.0))}
        car["coupler"] = str(rng.choice(names)) if rng.random() < 0.7 else [str(rng.choice(names)) for _ in range(2)]
        if rng.random() < 0.2:
            car["brakes"] = {"force_kN": float(rng.uniform(5.0, 60.0))}
        cars.append(car)
    return {"vehicles": cars}


def _inner(rng: Rng, rate: float) -> dict[str, Any]:
    kind = str(rng.choice(["crush", "crush", "crush", "hysteresis", "gas_hydraulic"]))
    if kind == "crush":
        return _crush(rng, False) | {"beyond": "hold"}
    return _hysteresis(rng) | {"beyond": "stop"} if kind == "hysteresis" else _gas(rng, 0.5 * rate)


def _strut(rng: Rng) -> dict[str, Any]:
    swing: Any = {"free_mrad": float(rng.uniform(20.0, 100.0)), "MN_m_per_rad": float(rng.uniform(1.0, 10.0))}
    line = {"acts": "strut", "height_mm": float(rng.uniform(640.0, 700.0)), "pin_m": float(rng.uniform(0.8, 1.8))}
    return {**line, "swing": swing if rng.random() < 0.8 else "none"}


def _face(rng: Rng) -> dict[str, Any]:
    tie: Any = {"friction": float(rng.uniform(0.05, 0.4)), "tooth_kN": float(rng.choice([0.0, 200.0]))}
    tie["kN_per_mm"] = float(10 ** rng.uniform(1.5, 2.3))
    line = {"acts": "face", "height_mm": float(rng.uniform(900.0, 1100.0)), "overlap_mm": float(rng.uniform(80, 200))}
    return {**line, "tie": tie if rng.random() < 0.8 else "none"}


def _vehicle_type(rng: Rng, rough: bool) -> dict[str, Any]:
    """Running gear like that of a metro; rough: light in pitch, high, and soon at its stops, so that wheels lift."""

    def around(value: float, part: float = 0.3) -> float:
        return float(value * rng.uniform(1.0 - part, 1.0 + part))

    def stops(lift: float, bump: float) -> dict[str, Any]:
        part = 0.3 if rough else 1.0
        stated = {"lift_stop_mm": around(part * lift), "bump_stop_mm": around(part * bump)}
        stated["stop_kN_per_mm"] = around(20.0)
        return stated if rng.random() < 0.8 else stated | {"lift_stop_mm": "none"}

    inertia = {"pitch_inertia_t_m2": around(400.0 if rough else 1000.0)}
    if rng.random() < 0.3:
        inertia = {"radius_of_gyration_m": around(4.0 if rough else 6.0, 0.2)}
    kind: dict[str, Any] = {
        "body": {
            **inertia,
            "cog_height_m": around(2.0 if rough else 1.6, 0.1),
            "cog_x_m": float(rng.uniform(-1.0, 1.0)),
        },
        "bogies": {
            "centres_m": float(rng.uniform(11.0, 14.0)),
            "wheelbase_m": around(2.3, 0.1),
            "frame_t": around(2.6),
            "frame_pitch_t_m2": around(2.0),
            "wheelset_t": around(1.6),
            "axle_height_m": 0.42,
            "link_height_m": float(rng.uniform(0.5, 0.8)),
            "cog_height_m": float(rng.uniform(0.45, 0.65)),
        },
        "secondary": {"kN_per_mm": around(0.7), "kN_s_per_m": around(50.0), **stops(60.0, 60.0)},
        "primary": {"kN_per_mm": around(2.8), "kN_s_per_m": around(20.0), **stops(30.0, 40.0)},
    }
    if rng.random() < 0.3:
        kind["rail"] = {"kN_per_mm": float(10 ** rng.uniform(2.5, 3.2)), "kN_s_per_m": around(100.0)}
    return kind
