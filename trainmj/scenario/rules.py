"""Rules that concern several parts of a scenario: names that must exist, curves that must fit together."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from trainmj.files.source import Path, Problem, dotted, no_such
from trainmj.scenario.parts import (
    MAX_DEVICE_POINTS,
    MAX_VEHICLES,
    RIGID_WALL,
    Curve,
    CurveFile,
    CurveRef,
    DeviceSpec,
    Parts,
    StageSpec,
    listed,
)

_LEAST_CLOSING = 0.1  # km/h; a collision whose sides close in at a third of this counts as over
_MOST_STEPS = 5_000_000
_MOST_RECORDS = 3_000_000  # of all vehicles together: 200 MB
_MOST_POINTS = 20_000  # of all curves together, so that a scenario that was written can be read again
_LEAST_WIDTH = 1e-6  # between two points of a curve [mm]
_LEAST_STROKE = 5.0  # at which the curves of a device end [mm]; no crush zone has 5 m
_LEAST_FORCE = 5.0  # of the largest one of a device [kN]; no train weighs so little


def broken_rules(parts: Parts) -> Iterator[Problem]:
    """Every rule that the parts break between them."""
    for name, curve in parts.curves.items():
        yield from _curve(("curves", name), curve)
    for name, device in parts.devices.items():
        yield from _device(("devices", name), device, parts)
    for name in parts.trains:
        yield from _train(name, parts)
    yield from _points(parts)
    yield from _collision(parts)
    yield from _simulation(parts)


def _points(parts: Parts) -> Iterator[Problem]:
    stages = [stage for device in parts.devices.values() for stage in device.all_stages().values()]
    inline = [curve for stage in stages for _, curve in listed(stage.curve)]
    count = sum(len(c.stroke_mm) for c in [*parts.curves.values(), *inline] if isinstance(c, Curve))
    if count > _MOST_POINTS:
        yield Problem(("curves",), f"have {count} points in all, more than {_MOST_POINTS}: state fewer")


def _curve(path: Path, curve: Curve | CurveFile) -> Iterator[Problem]:
    if isinstance(curve, CurveFile):
        yield Problem((*path, "file"), "is only read when a scenario is loaded from its file, by trainmj.load")
        return
    n, m = len(curve.stroke_mm), len(curve.force_kN)
    if n != m:
        yield Problem(path, f"needs as many strokes as forces; it has {n} and {m}")
    for i, (a, b) in enumerate(pairwise(curve.stroke_mm)):
        if b < a + _LEAST_WIDTH:
            yield Problem((*path, "stroke_mm", i + 1), f"must be more than the {a:g} mm before it: strokes grow")


def _device(path: Path, device: DeviceSpec, parts: Parts) -> Iterator[Problem]:
    if len({name.casefold() for name in device.all_stages()}) < len(device.all_stages()):
        yield Problem((*path, "stages"), "have names that differ only in upper and lower case: choose others")
    count, end, most = 0, 0.0, 0.0
    before: StageSpec | None = None
    for name, stage in device.all_stages().items():
        at = path if stage is device else (*path, "stages", name)
        broken = list(_curve_ref((*at, "curve"), stage.curve, parts))
        yield from broken
        if not broken:
            yield from _stage(at, stage, parts)
            stroke, force = parts.curve_points(stage.curve)
            count, end = count + len(stroke), end + max(stroke, default=0.0)
            most = max(most, *force, stage.shear_off.force_kN if stage.shear_off else 0.0)
        if before is not None and before.shear_off and stage.empty_stroke_mm < 2 * before.shear_off.ramp_mm:
            yield Problem(
                (*at, "empty_stroke_mm"),
                f"must be at least {2 * before.shear_off.ramp_mm:g} mm, twice the ramp_mm in which the force of the "
                "stage before it rises and drops at shear-off",
            )
        before = stage
    if 0 < end < _LEAST_STROKE:
        rule = f"has {end:g} mm of stroke in all, less than {_LEAST_STROKE:g} mm: multiply by 1000 if strokes are in m"
        yield Problem(path, rule)
    if 0 < most < _LEAST_FORCE:
        rule = f"has {most:g} kN at most, less than {_LEAST_FORCE:g} kN: multiply by 1000 if forces are in MN"
        yield Problem(path, rule)
    if count > MAX_DEVICE_POINTS:
        yield Problem(path, f"has {count} points in all, more than {MAX_DEVICE_POINTS}")


def _curve_ref(path: Path, ref: CurveRef, parts: Parts) -> Iterator[Problem]:
    for at, curve in listed(ref):
        if not isinstance(curve, str):
            yield from _curve((*path, *at), curve)
        elif curve not in parts.curves:
            yield no_such("curve", (*path, *at), curve, parts.curves)


def _stage(path: Path, stage: StageSpec, parts: Parts) -> Iterator[Problem]:
    stroke, force = parts.curve_points(stage.curve)
    if len(stroke) != len(force):
        return  # reported where the curve itself is checked
    if len(stroke) < 2:
        yield Problem((*path, "curve"), "needs two or more points")
        return
    if stroke[0] != 0:
        at, first = listed(stage.curve)[0]
        start = ("curves", first) if isinstance(first, str) else (*path, "curve", *at)
        rule = f"the curve of {dotted(path)} must start at a stroke of 0, not {stroke[0]:g} mm"
        yield Problem((*start, "stroke_mm", 0), rule)
    yield from _joints((*path, "curve"), stage.curve, parts)
    if stage.stroke_limit_mm is not None and stage.stroke_limit_mm > stroke[-1]:
        yield Problem(
            (*path, "stroke_limit_mm"), f"must be within the curve, which ends at {stroke[-1]:g} mm: extend the curve"
        )
    if stage.shear_off is not None and stage.shear_off.force_kN < force[-1]:
        yield Problem(
            (*path, "shear_off", "force_kN"), f"must be at least the {force[-1]:g} kN at which the curve ends"
        )


def _joints(path: Path, ref: CurveRef, parts: Parts) -> Iterator[Problem]:
    before = 0.0
    for n, (at, part) in enumerate(listed(ref)):
        stroke, _ = parts.curve_points(part)
        if n and stroke and stroke[0] < before + _LEAST_WIDTH:
            rule = f"must continue from the {before:g} mm of the part before it, and begins at {stroke[0]:g} mm"
            yield Problem((*path, *at), rule)
        before = stroke[-1] if stroke else before


def _train(name: str, parts: Parts) -> Iterator[Problem]:
    train = parts.trains[name]
    path: Path = ("trains", name)
    if name == RIGID_WALL:
        yield Problem(path, "is reserved for the rigid wall: choose another name")
    for key in ("front", "rear", "coupler"):
        yield from _device_ref((*path, key), getattr(train, key), parts)
    cars = train.cars()
    for i, car in enumerate(cars):
        at = (*path, "vehicles", i) if isinstance(train.vehicles, list) else path
        if isinstance(train.vehicles, list):
            yield from _device_ref((*at, "coupler"), train.vehicles[i].coupler, parts)
        if car.mass_t is None:
            yield Problem(at, "has no mass_t, and the train states none for all: add one of them")
        if car.coupler is None and i < len(cars) - 1:
            yield Problem(at, "has no coupler to the next vehicle, and the train states none for all: add one of them")
        if not isinstance(train.vehicles, list) and (car.mass_t is None or car.coupler is None):
            return


def _device_ref(path: Path, name: str | None, parts: Parts) -> Iterator[Problem]:
    if name is not None and name not in parts.devices:
        yield no_such("device", path, name, parts.devices)


def _collision(parts: Parts) -> Iterator[Problem]:
    collision = parts.collision
    sides = {"train": (collision.train, "front")}
    if collision.partner != RIGID_WALL:
        sides["partner"] = (collision.partner, collision.partner_end)
    elif collision.partner_speed_km_h != 0:
        yield Problem(("collision", "partner_speed_km_h"), "must be 0: the rigid wall does not move")
    known = True
    for key, (name, end) in sides.items():
        if name not in parts.trains:
            known = False
            offered = [*parts.trains, *([RIGID_WALL] if key == "partner" else [])]
            yield no_such("train", ("collision", key), name, offered)
        elif getattr(parts.trains[name], end) is None:
            yield Problem(("trains", name), f"states no device at its {end}, the end that meets the other side")
    if collision.speed_km_h - collision.partner_speed_km_h < _LEAST_CLOSING - 1e-9:
        yield Problem(
            ("collision", "speed_km_h"),
            f"must be more than partner_speed_km_h ({collision.partner_speed_km_h:g}) by {_LEAST_CLOSING:g} km/h or "
            "more: the two sides must approach each other",
        )
    if not known:
        return
    count = sum(len(parts.trains[name].cars()) for name, _ in sides.values())
    if count > MAX_VEHICLES:
        yield Problem(("collision",), f"has more than {MAX_VEHICLES} vehicles in all")
    s = parts.simulation
    if count * s.time_limit_s * 1e3 / s.record_every_ms > _MOST_RECORDS:
        yield Problem(
            ("simulation", "record_every_ms"),
            f"gives more than {_MOST_RECORDS} records of {count} vehicles: increase it, or shorten time_limit_s",
        )


def _simulation(parts: Parts) -> Iterator[Problem]:
    s = parts.simulation
    if abs(s.record_every_ms - s.steps_per_record * s.step_ms) > 1e-9 * s.record_every_ms:
        yield Problem(("simulation", "record_every_ms"), f"must be a whole multiple of step_ms ({s.step_ms:g} ms)")
    if s.time_limit_s * 1e3 < s.record_every_ms * (1 - 1e-9):
        yield Problem(("simulation", "time_limit_s"), f"must be at least record_every_ms ({s.record_every_ms:g} ms)")
    if s.time_limit_s * 1e3 / s.step_ms > _MOST_STEPS:
        yield Problem(
            ("simulation", "time_limit_s"),
            f"takes more than {_MOST_STEPS} steps: shorten it, or increase step_ms",
        )
