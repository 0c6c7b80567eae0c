"""From the plain values of a scenario file to numbers in SI; devices from the units of their names."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from trainmj.verification.oracle.bodies import Member
from trainmj.verification.oracle.devices import Body, Crush, Device, Hydraulic, Hysteresis, Points, factor_of
from trainmj.verification.oracle.elements import Element
from trainmj.verification.oracle.motion import WALL, Brake, G, Interface, Point, System

Values = Mapping[str, Any]
_FAR = 100.0  # a stop rises this far [m]
COLLAPSE_KN = 2000.0


@dataclass(frozen=True)
class Meeting:
    """Two neighbours, or a vehicle and the wall, and what is between them."""

    name: str
    left: int  # vehicle
    right: int  # WALL: a wall
    devices: tuple[str, ...]  # left to right
    inner: bool  # whether both are of one train


@dataclass(frozen=True)
class LineUp:
    """Vehicles left to right, as the collision puts them."""

    names: tuple[str, ...]
    cars: tuple[Values, ...]
    meetings: tuple[Meeting, ...]
    moving: int  # vehicles of the moving train

    def front_right(self, i: int) -> bool:
        """Whether the front end of a vehicle points along +x."""
        return bool(self.cars[i]["led"] == ("front" if i < self.moving else "rear"))


def lined_up(values: Values) -> LineUp:
    """Who stands beside whom; values as the YAML file gives them, files and names of curves resolved."""
    c = values["collision"]
    friction = c.get("rail_friction", 0.0)
    led, partner, speed = c.get("train_end", "front"), c["partner"], c.get("partner_speed_km_h", 0.0) / 3.6
    moving = _seen_from(led, _cars(values["trains"][c["train"]], friction, c["speed_km_h"] / 3.6))
    obstacle = values.get("obstacles", {}).get(partner)
    struck: list[dict[str, Any]] = []
    fronts = [_outer(values["trains"][c["train"]], led)]
    if obstacle is not None:
        fronts.append(obstacle["front"])
        if not obstacle.get("fixed"):
            car = {"mass": obstacle["mass_t"] * 1e3, "friction": obstacle.get("rail_friction", friction)}
            length = obstacle.get("length_m", 6.0)
            struck = [car | {"brake": Brake(0.0), "speed": speed, "led": "front", "length": length}]
    elif partner != "rigid_wall":
        end = c.get("partner_end", "front")
        fronts.append(_outer(values["trains"][partner], end))
        struck = _seen_from(end, _cars(values["trains"][partner], friction, speed))
    n = len(moving)
    wall = not struck
    meetings = []
    for k in range(n - 1):  # left to right, from the tail
        left, right = n - 1 - k, n - 2 - k  # of the moving train: behind, before
        between = _named(moving[right]["coupler"])[::-1]
        meetings.append(Meeting(f"M{right + 1}-M{left + 1}", k, k + 1, between, inner=True))
    front = "M1-wall" if wall else "S1-M1"
    meetings.append(Meeting(front, n - 1, WALL if wall else n, tuple(fronts), inner=False))
    for k in range(len(struck) - 1):
        meetings.append(Meeting(f"S{k + 1}-S{k + 2}", n + k, n + k + 1, _named(struck[k]["coupler"]), inner=True))
    names = [f"M{n - k}" for k in range(n)] + [f"S{k + 1}" for k in range(len(struck))]
    return LineUp(tuple(names), (*moving[::-1], *struck), tuple(meetings), n)


def _named(coupler: Any) -> tuple[str, ...]:
    """The devices of a coupler, near and far, or one."""
    return tuple(coupler) if isinstance(coupler, list | tuple) else (coupler,)


def read(values: Values) -> System:
    """The system that a scenario describes."""
    up = lined_up(values)
    points: list[Point] = []
    members: list[Member] = []
    bodies: list[Interface] = []
    ends: list[tuple[int, int]] = []  # of each vehicle: the points at which devices are attached
    for i, (name, car) in enumerate(zip(up.names, up.cars, strict=True)):
        ends.append(_points(i, name, car, up.front_right(i), i < up.moving, points, members, bodies))
    interfaces = []
    for m in up.meetings:
        at = ends[m.left][1], WALL if m.right == WALL else ends[m.right][0]
        join = _coupled if m.inner else _front
        interfaces.append(Interface(m.name, *at, join(list(m.devices), values, *at)))
    return system_of(values, up, points, interfaces, members, bodies)


def system_of(
    values: Values,
    up: LineUp,
    points: list[Point],
    interfaces: list[Interface],
    members: Sequence[Member] = (),
    bodies: Sequence[Interface] = (),
) -> System:
    """With what the collision states of the track and the time."""
    c = values["collision"]
    return System(
        up.names,
        tuple(points),
        tuple(interfaces),
        tuple(members),
        tuple(bodies),
        c.get("gap_mm", 0.0) / 1e3,
        up.moving - 1,
        c.get("grade_per_mille", 0.0) / 1e3,
        values.get("simulation", {}).get("time_limit_s", 3.0),
    )


def _outer(train: Values, end: str) -> str:
    """The device at an end of a train: the train states it, or the vehicle there."""
    return str(train.get(end) or train["vehicles"][0 if end == "front" else -1][end])


def _seen_from(end: str, cars: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Vehicles from an end of their train, each with the coupler to the next one from there."""
    cars = [{**car, "led": end} for car in cars]
    if end == "front":
        return cars
    couplers = [c[::-1] if isinstance(c, list) else c for c in (car["coupler"] for car in cars[:-1])]
    return [{**car, "coupler": c} for car, c in zip(cars[::-1], [*couplers[::-1], None], strict=True)]


def _cars(train: Values, friction: float, speed: float) -> list[dict[str, Any]]:
    """Vehicles of a train from its front end: mass [kg], speed [m/s], friction, brake, coupler."""
    stated = train["vehicles"]
    listed: list[Values] = [{} for _ in range(int(stated))] if isinstance(stated, int | float) else stated
    cars = []
    for one, behind in zip(listed, [*listed[1:], {}], strict=True):
        value: Values = {**train, **one}
        ends = [one.get("rear", train.get("ends")), behind.get("front", train.get("ends"))]
        load = value.get("load") or {}
        mass = value["mass_t"] * 1e3 + load.get("seats", 0) * load.get("share", 1.0) * load.get("kg", 0.0)
        mu = value.get("rail_friction")
        cars.append(
            {
                "mass": mass,
                "speed": speed,
                "friction": friction if mu is None else mu,
                "brake": _brake(value.get("brakes"), mass),
                "coupler": one.get("coupler") or (ends if all(ends) else train.get("coupler")),
                "body": value.get("body"),
                "length": value.get("length_m", 20.0),
                "type": value.get("type"),
            }
        )
    return cars


def _points(
    vehicle: int,
    name: str,
    car: Values,
    front_right: bool,
    facing_right: bool,
    points: list[Point],
    members: list[Member],
    bodies: list[Interface],
) -> tuple[int, int]:
    """Add a vehicle to what there is; the points at which the devices of its left and right end are attached."""
    mass, speed, brake, body = car["mass"], car["speed"], car["brake"], car.get("body")
    hold, first = car["friction"] * mass * G, len(points)
    if body is None or body == "rigid":
        points.append(Point(vehicle, mass, speed, hold, brake))
        return first, first
    length, bogies, parts = car["length"], body.get("bogies"), int(body.get("members", 4))
    ratio = body.get("damping_ratio", 0.02)
    heavy = bogies["mass_t"] * 1e3 if bogies else 0.0
    own = mass - 2 * heavy
    if "EA_MN" in body:
        k = body["EA_MN"] * 1e6 / length
    elif "frequency_Hz" in body:  # f = sqrt(EA / (L M)) / 2
        k = (2.0 * body["frequency_Hz"]) ** 2 * own
    else:
        k = body["stiffness_kN_per_mm"] * 1e6
    for i in range(parts + 1):
        own_part = own / parts * (0.5 if i in (0, parts) else 1.0)
        share = 0.0 if bogies else own_part / mass
        points.append(Point(vehicle, own_part, speed, share * hold, brake.shared(share)))
    lowest = 2.0 * parts * math.sqrt(k / own) * math.sin(math.pi / (2 * parts))
    collapse = body["collapse_force_kN"] * 1e3 if body.get("collapse_force_kN") is not None else math.inf
    h = body.get("hardening_kN_per_mm", 0.0) * 1e6
    for i in range(parts):
        number = parts - i if facing_right else i + 1
        member = f"{name} member {number}"
        one = Member(member, first + i, first + i + 1, parts * k, 2 * ratio * parts * k / lowest, collapse, parts * h)
        members.append(one)
    bodies.append(Interface(name, first, first + parts, []))

    def nearest(place: float) -> int:
        return min(range(parts + 1), key=lambda i: abs(i * length / parts - place))

    for right in (False, True) if bogies else ():
        place = 0.5 * (length + (bogies["centres_m"] if right else -bogies["centres_m"]))
        link = bogies.get("stiffness_kN_per_mm", 500.0) * 1e6
        number = 1 if right is facing_right else 2
        bogie = f"{name} bogie {number}"
        members.append(Member(bogie, first + nearest(place), len(points), link, 2 * ratio * math.sqrt(link * heavy)))
        points.append(Point(vehicle, heavy, speed, 0.5 * hold, brake.shared(0.5)))
    front, rear = body.get("attached_m", (0.0, 0.0))
    left, right_end = (rear, front) if front_right else (front, rear)
    return first + nearest(left), first + nearest(length - right_end)


def _brake(stated: Values | None, mass: float) -> Brake:
    if not stated:
        return Brake(0.0)
    force = stated["force_kN"] * 1e3 if "force_kN" in stated else stated["deceleration_m_per_s2"] * mass
    if stated.get("adhesion") is not None:
        most = stated["adhesion"] * mass * G
        if most < force and stated.get("rise_s", 0.0) > 0.0:
            # capped while it rises: the cap is reached sooner
            return Brake(most, stated.get("delay_s", 0.0), stated["rise_s"] * most / force)
        force = min(force, most)
    return Brake(force, stated.get("delay_s", 0.0), stated.get("rise_s", 0.0))


# devices


def curve_points(ref: Any, values: Values) -> list[tuple[float, float]]:
    """Points (m, N) of a curve, whichever way it is stated."""
    if isinstance(ref, list):
        return [p for part in ref for p in curve_points(part, values)]
    if isinstance(ref, str):
        return curve_points(values["curves"][ref], values)
    return [(u / 1e3, f * 1e3) for u, f in zip(ref["stroke_mm"], ref["force_kN"], strict=True)]


def _beyond(spec: Values, own: float) -> tuple[str, float, float]:
    """Kind, stiffness [N/m] and collapse force [N] of what is behind a device."""
    stated = spec.get("beyond")
    if stated is None:
        return "", own, math.inf
    group: Values = {"kind": stated} if isinstance(stated, str) else stated
    stiffness = group.get("stiffness_kN_per_mm")
    k = own if stiffness is None else stiffness * 1e6
    collapse = group.get("collapse_force_kN", COLLAPSE_KN) * 1e3 if group["kind"] == "car_body" else math.inf
    return group["kind"], k, collapse


def _extended(points: list[tuple[float, float]], kind: str, k: float, collapse: float) -> list[tuple[float, float]]:
    u, f = points[-1]
    if kind == "car_body":
        return [*points, (u + (collapse - f) / k, collapse)]
    if kind == "stop":
        return [*points, (u + _FAR, f + _FAR * k)]
    return points


def _stages(spec: Values) -> list[Values]:
    return list(spec["stages"].values()) if "stages" in spec else [spec]


def envelope(stages: list[Values], values: Values, first_empty: bool = True) -> list[tuple[float, float]]:
    """Points (m, N) of stages laid end to end."""
    points: list[tuple[float, float]] = []
    at = 0.0  # where a curve ends, and the empty stroke of the next stage begins
    for n, stage in enumerate(stages):
        begin = at
        if n or first_empty:
            begin += stage.get("empty_stroke_mm", 0.0) / 1e3
        if begin > at:
            points += [(max(at, points[-1][0] if points else 0.0), 0.0), (begin, 0.0)]
        points += [(begin + u, f) for u, f in curve_points(stage["curve"], values)]
        at = points[-1][0]
        shear = stage.get("shear_off")
        if shear:
            ramp = shear.get("ramp_mm", 0.25) / 1e3
            points += [(at + ramp, shear["force_kN"] * 1e3), (at + 2 * ramp, 0.0)]
    return points


def split_at_shear_off(spec: Values) -> int:
    """How many stages act up to the first shear-off that has stages behind it; 0 if there is none."""
    stages = _stages(spec)
    for n, stage in enumerate(stages[:-1]):
        if stage.get("shear_off"):
            return n + 1
    return 0


def _start_behind(spec: Values, count: int, values: Values) -> float:
    """Stroke at which the stages behind a shear-off begin [m]."""
    stages = _stages(spec)
    at = 0.0
    for stage in stages[:count]:
        at += stage.get("empty_stroke_mm", 0.0) / 1e3 + curve_points(stage["curve"], values)[-1][0]
    return float(at + stages[count].get("empty_stroke_mm", 0.0) / 1e3)


def device(name: str, values: Values, part: str = "all") -> tuple[Device, float]:
    """A device with the stroke from which on nothing is known of it [m]; part: all, before or behind its shear-off."""
    spec = values["devices"][name]
    kind = spec.get("kind", "crush")
    empty = spec.get("empty_stroke_mm", 0.0) / 1e3
    if kind == "crush":
        return _crush(spec, values, part)
    if kind == "hysteresis":
        k = spec["transition_stiffness_kN_per_mm"] * 1e6
        beyond, rise, collapse = _beyond(spec, k)
        loading, unloading = (curve_points(spec[key], values) for key in ("loading", "unloading"))
        end, top = loading[-1]
        if beyond in ("car_body", "stop"):
            # the unloading curve is known up to the end of the loading curve, and rises with the body or stop behind it
            low = Points(unloading).at(end)
            more = (collapse - top) / rise if beyond == "car_body" else _FAR
            unloading = [p for p in unloading if p[0] < end] + [(end, low), (end + more, low + rise * more)]
            loading = [*loading, (end + more, top + rise * more)]
        curves = [Points(_risen(points, k)) for points in (loading, unloading)]
        ends = math.inf if beyond else end + empty
        return Hysteresis(curves[0], curves[1], k, Body(collapse), empty), ends
    return _hydraulic(spec, values, empty), math.inf


def _risen(points: list[tuple[float, float]], k: float) -> list[tuple[float, float]]:
    """A curve that rises along k from zero stroke and force until it meets the curve given."""
    if points[0][1] <= 0.0:
        return points
    for (u0, f0), (u1, f1) in zip(points, [*points[1:], (math.inf, points[-1][1])], strict=True):
        s = (f1 - f0) / (u1 - u0) if math.isfinite(u1) else 0.0
        meets = (f0 - s * u0) / (k - s)
        if meets <= u1:
            return [(0.0, 0.0), (meets, k * meets), *[p for p in points if p[0] > meets]]
    raise AssertionError


def _crush(spec: Values, values: Values, part: str) -> tuple[Device, float]:
    stages = _stages(spec)
    cut = split_at_shear_off(spec)
    k, c = spec["stiffness_kN_per_mm"] * 1e6, spec.get("damping_kN_s_per_m", 0.0) * 1e3
    beyond, rise, collapse = _beyond(spec, k)
    if part == "before":
        return _with_rate(spec, Crush(Points(envelope(stages[:cut], values)), k, c), values), math.inf
    points = envelope(stages[cut:], values, first_empty=False) if part == "behind" else envelope(stages, values)
    sheared = stages[-1].get("shear_off")
    end = points[-1][0]
    if not sheared:
        points = _extended(points, beyond, rise, collapse)
    crush = Crush(Points(points), k, c, own=end)
    return _with_rate(spec, crush, values), math.inf if beyond or sheared else end


def _with_rate(spec: Values, crush: Crush, values: Values) -> Crush:
    rate = spec.get("rate")
    if not rate:
        return crush
    if "curves" not in rate:
        crush.factor = factor_of(rate["C_m_per_s"], rate["P"])
        return crush
    k = spec["stiffness_kN_per_mm"] * 1e6
    beyond, rise, collapse = _beyond(spec, k)
    empty = spec.get("empty_stroke_mm", 0.0) / 1e3
    curves = [crush.curve]
    for one in rate["curves"]:
        points = [(u + empty, f) for u, f in curve_points(one["curve"], values)]
        points = [(0.0, 0.0), (empty, 0.0), *points] if empty else points
        curves.append(Points(_extended(points, beyond, rise, collapse)))
    # all on the same segments, so that each is a line on each
    strokes = sorted({u for curve in curves for u in curve.u})
    same = [Points([(u, curve.at(u)) for u in strokes]) for curve in curves]
    crush.curve = same[0]
    crush.faster = tuple((one["speed_m_per_s"], curve) for one, curve in zip(rate["curves"], same[1:], strict=True))
    return crush


def _hydraulic(spec: Values, values: Values, empty: float) -> Hydraulic:
    length = spec["stroke_mm"] / 1e3
    if "metering" in spec:
        m = spec["metering"]
        table = zip(m["stroke_mm"], m["orifice_kN_s2_per_m2"], strict=True)
        orifice = Points([(u / 1e3, c * 1e3) for u, c in table])
    else:
        orifice = Points([(0.0, spec["orifice_kN_s2_per_m2"] * 1e3)])
    gas, energy, rebound = _preload(spec)
    if spec["kind"] == "gas_hydraulic":
        gas, energy = _gas(spec["gas"])
        rebound = spec["rebound_orifice_kN_s2_per_m2"] * 1e3
    _, stop, collapse = _beyond(spec, math.nan)
    return Hydraulic(length, orifice, gas, energy, stop, rebound, Body(collapse), empty)


def _preload(spec: Values) -> tuple[Callable[[float], float], Callable[[float], float], None]:
    force = spec.get("preload_kN", 0.0) * 1e3
    if force <= 0.0:
        return (lambda d: 0.0), (lambda d: 0.0), None
    k = spec["preload_stiffness_kN_per_mm"] * 1e6
    return (lambda d: min(k * max(d, 0.0), force)), (lambda d: 0.0), None


def _gas(spec: Values) -> tuple[Callable[[float], float], Callable[[float], float]]:
    force, length, n = float(spec["force_kN"] * 1e3), float(spec["length_mm"] / 1e3), float(spec["exponent"])
    k = float(spec["preload_stiffness_kN_per_mm"] * 1e6)

    def gas(d: float) -> float:
        return force * math.pow(1.0 - d / length, -n)

    low, high = 0.0, length * (1 - 1e-9)
    start = force / k
    for _ in range(200):  # where the preload's rise meets the gas
        start = gas(start) / k

    def pressed(d: float) -> float:
        return k * max(d, 0.0) if d <= start else gas(min(d, high))

    def energy(d: float) -> float:
        if d <= start:
            return 0.5 * k * max(d, 0.0) ** 2
        first, last = (1.0 - x / length for x in (start, d))
        area = math.log(first / last) if n == 1.0 else (math.pow(last, 1 - n) - math.pow(first, 1 - n)) / (n - 1)
        return 0.5 * k * start**2 + force * length * area

    assert low <= start < high
    return pressed, energy


# elements


def _part(name: str, values: Values, part: str) -> Values:
    """What is stated of the part of a device."""
    spec: Values = values["devices"][name]
    if part == "all":
        return spec
    cut = split_at_shear_off(spec)
    stages = _stages(spec)[:cut] if part == "before" else _stages(spec)[cut:]
    stated: dict[str, Any] = {key: value for key, value in spec.items() if key != "stages"}
    if part == "behind":  # where they begin is the path's
        stages = [{**stages[0], "empty_stroke_mm": 0.0}, *stages[1:]]
    return {**stated, "stages": stages}


def series(names: list[str], values: Values, left: int, right: int, offset: float, part: str = "all") -> Element:
    """Devices, left to right, as one element; two with the same values take half of it each."""
    share = 1.0
    if len(names) == 2 and _part(names[0], values, part) == _part(names[1], values, part):
        names, share = names[:1], 2.0
    element = Element(left, right, offset, share=share)
    for name in names:
        one, end = device(name, values, part)
        element.devices.append(one)
        element.ends.append(end)
        element.top.append(0.0)
    return element


def _front(fronts: list[str], values: Values, left: int, right: int) -> list[Element]:
    cuts = [split_at_shear_off(values["devices"][name]) for name in fronts]
    equal = len(fronts) == 2 and values["devices"][fronts[0]] == values["devices"][fronts[1]]
    if len(fronts) == 2 and all(cuts) and not equal:
        starts = [_start_behind(values["devices"][name], cut, values) for name, cut in zip(fronts, cuts, strict=True)]
        return [
            series(fronts, values, left, right, 0.0, "before"),
            series(fronts, values, left, right, sum(starts), "behind"),
        ]
    return [series(fronts, values, left, right, 0.0)]


def _coupled(names: list[str], values: Values, left: int, right: int) -> list[Element]:
    """A coupler between two vehicles of one train: the device, or two left to right, and its draw gear."""
    pull = draw_gear(names, values, left, right)
    return [series(names, values, left, right, 0.0), *([pull] if pull else [])]


def draw_gear(names: Sequence[str], values: Values, left: int, right: int) -> Element | None:
    """What pulls in a coupler of some devices."""
    pulls = [values["devices"][name].get("pull") for name in names]
    if any(pulls) and len(pulls) > 1 and pulls[0] != pulls[1]:
        raise NotImplementedError("two different draw gears on one coupler")
    return _pull(pulls[0], values, left, right, len(pulls)) if pulls[0] else None


def _pull(spec: Values, values: Values, left: int, right: int, share: int) -> Element:
    k = spec["stiffness_kN_per_mm"] * 1e6
    end = math.inf
    if "curve" in spec:
        points = curve_points(spec["curve"], values)
        end = points[-1][0]
    else:
        points = [(0.0, 0.0), (_FAR, _FAR * k)]
    one = Crush(Points(points), k, spec.get("damping_kN_s_per_m", 0.0) * 1e3)
    return Element(
        left,
        right,
        share * spec.get("slack_mm", 0.0) / 1e3,
        sign=-1.0,
        share=float(share),
        breaking=spec["breaking_force_kN"] * 1e3 if spec.get("breaking_force_kN") else math.inf,
        devices=[one],
        ends=[end],
        top=[0.0],
    )
