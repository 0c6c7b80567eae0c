"""Rules of curves and devices: what the keys of each kind must agree on."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Iterator, Sequence
from functools import reduce
from itertools import pairwise
from operator import add

from trainmj.files.source import Path, Problem, dotted, no_such
from trainmj.scenario.curves import Curve, CurveFile, CurveRef, Metering, MeteringFile, TableFile, listed
from trainmj.scenario.devices import (
    AnyDevice,
    CrushDevice,
    CurveDevice,
    GasHydraulicDevice,
    Hydraulic,
    HydraulicDevice,
    HysteresisDevice,
    StageSpec,
)
from trainmj.scenario.parts import Parts
from trainmj.scenario.ranges import MAX_FORCE
from trainmj.symbol import largest, least

_MOST_POINTS = 4000  # of a device
_LEAST_WIDTH = 1e-6  # between two points of a curve [mm]
_LEAST_STROKE = 5.0  # at which a device ends [mm]; no crush zone has 5 m
_LEAST_FORCE = 5.0  # of the largest one of a device [kN]; no train weighs so little
_FULL_SIZE = 30.0  # mass of the lighter side from which on these hold [t]; what is lighter counts as a model
_ROUND_OFF = 1e-9


def not_read(path: Path, part: object) -> Iterator[Problem]:
    """The problem of a CSV file that was not read."""
    if isinstance(part, TableFile):
        yield Problem((*path, "file"), "is only read when a scenario is loaded from its file, by trainmj.load")


def curve_rules(path: Path, curve: Curve | CurveFile | Metering | MeteringFile) -> Iterator[Problem]:
    """Rules of one curve or table of points."""
    if isinstance(curve, TableFile):
        yield from not_read(path, curve)
        return
    heights = curve.force_kN if isinstance(curve, Curve) else curve.orifice_kN_s2_per_m2
    n, m = len(curve.stroke_mm), len(heights)
    if n != m:
        what = "forces" if isinstance(curve, Curve) else "orifice constants"
        yield Problem(path, f"needs as many strokes as {what}; it has {n} and {m}")
    for i, (a, b) in enumerate(pairwise(curve.stroke_mm)):
        if b < a + _LEAST_WIDTH:
            yield Problem(
                (*path, "stroke_mm", i + 1), f"must be more than the {a:.12g} mm before it{_by(a, b)}: strokes grow"
            )


def size_of(parts: Parts) -> float:
    """Scale of a collision by the mass of its lighter side, at most 1: a model of half the size has an eighth of it."""
    c = parts.collision
    sides = [
        reduce(add, (car.mass_t or 0.0 for car in parts.trains[s].cars()), 0.0)
        for s in (c.train, c.partner)
        if s in parts.trains
    ]
    if c.partner in parts.obstacles:
        sides.append(parts.obstacles[c.partner].mass_t or 0.0)
    sizes: list[float] = [(mass / _FULL_SIZE) ** (1 / 3) for mass in sides if mass > 0.0]
    return least([1.0, *sizes])


def _by(before: float, behind: float) -> str:
    """By how much a stroke must be more than the one before it, if it is more, but too little."""
    return f" by {_LEAST_WIDTH:.6f} mm or more" if behind > before else ""


def device_rules(
    path: Path, device: AnyDevice, parts: Parts, broken: Collection[str], size: float
) -> Iterator[Problem]:
    """Rules of one device.

    Args:
        path: of the device.
        device: to check.
        parts: that it is one of.
        broken: names of curves that break rules of their own.
        size: scale of the collision, by which the least stroke goes and, squared, the least force.
    """
    found = [problem for at, ref in device.curves() for problem in _curve_ref((*path, *at), ref, parts)]
    yield from found
    named = {part for _, ref in device.curves() for _, part in listed(ref) if isinstance(part, str)}
    whole = not found and named.isdisjoint(broken)  # what follows compares curves
    count = sum(len(parts.curve_points(ref)[0]) for _, ref in device.curves()) if whole else 0
    if count > _MOST_POINTS:
        yield Problem(path, f"has {count} points in all, more than {_MOST_POINTS}")
    if isinstance(device, CrushDevice):
        yield from _crush(path, device, parts, whole, size)
    elif isinstance(device, HysteresisDevice) and whole:
        yield from _hysteresis(path, device, parts, size)
    elif isinstance(device, Hydraulic):
        yield from _hydraulic(path, device, size)


def _curve_ref(path: Path, ref: CurveRef, parts: Parts) -> Iterator[Problem]:
    """Rules of a curve that a device refers to: its parts exist and make one curve from 0."""
    found: list[Problem] = []
    for at, curve in listed(ref):
        if not isinstance(curve, str):
            found += curve_rules((*path, *at), curve)
        elif curve not in parts.curves:
            found.append(no_such("curve", (*path, *at), curve, parts.curves))
    yield from found
    if found:
        return
    stroke, force = parts.curve_points(ref)
    if len(stroke) != len(force):
        return  # said where the curve of this name is checked
    if len(stroke) < 2:
        yield Problem(path, "needs two or more points")
        return
    if stroke[0] != 0:
        at, first = listed(ref)[0]
        start = ("curves", first) if isinstance(first, str) else (*path, *at)
        whose = dotted(path[:-1] if path[-1] == "curve" else path)
        rule = f"the curve of {whose} must start at a stroke of 0, not {stroke[0]:.12g} mm"
        yield Problem((*start, "stroke_mm", 0), rule)
    before = 0.0
    for n, (at, part) in enumerate(listed(ref)):
        stroke, _ = parts.curve_points(part)
        if n and stroke and stroke[0] < before + _LEAST_WIDTH:
            least = f"more than the {before:.12g} mm at which the part before it ends{_by(before, stroke[0])}"
            yield Problem((*path, *at), f"must begin at {least}, not at {stroke[0]:.12g} mm: strokes grow")
        before = stroke[-1] if stroke else before


def _crush(path: Path, device: CrushDevice, parts: Parts, whole: bool, size: float) -> Iterator[Problem]:
    stages = device.all_stages()
    if len({name.casefold() for name in stages}) < len(stages):
        yield Problem((*path, "stages"), "have names that differ only in upper and lower case: choose others")
    end = device.end()
    for name in stages:
        if end is not None and name.casefold() == end.kind == "car_body":
            rule = "has the name of the car body that beyond states: choose another one, or beyond: hold"
            yield Problem((*path, "stages", name), rule)
    length, most = 0.0, 0.0
    before: StageSpec | None = None
    for name, stage in stages.items():
        at = (*path, *device.place_of(name))
        if whole:
            stroke, force = parts.curve_points(stage.curve)
            length += stroke[-1]
            most = largest([most, *force, stage.shear_off.force_kN if stage.shear_off else 0.0])
            yield from _limit(at, stage.stroke_limit_mm, stroke[-1], "the curve")
            if stage.shear_off is not None and stage.shear_off.force_kN < force[-1]:
                rule = f"must be at least the {force[-1]:.12g} kN at which the curve ends"
                yield Problem((*at, "shear_off", "force_kN"), rule)
        if before is not None and before.shear_off and stage.empty_stroke_mm < 2 * before.shear_off.ramp_mm:
            yield Problem(
                (*at, "empty_stroke_mm"),
                f"must be at least {2 * before.shear_off.ramp_mm:g} mm, twice the ramp_mm in which the force of the "
                "stage before it rises and drops at shear-off",
            )
        before = stage
    for first, *others in device.runs():
        for name in others:
            if stages[name].line is not None and stages[name].line != stages[first].line:
                rule = f"must be that of {first}, or be left out: no bolts shear in between, so they act along one line"
                yield Problem((*path, *device.place_of(name), "line"), rule)
    if device.rate_curves():
        yield from _rate_curves(path, device, parts, whole)
    if whole:
        at_rate = [parts.curve_points(at_rate.curve)[1] for at_rate in device.rate_curves()]
        yield from _units(path, length, most, size)
        yield from _nothing(path, device, most)
        yield from _collapse(path, device, largest([most, *(largest(force) for force in at_rate)]))


def _rate_curves(path: Path, device: CrushDevice, parts: Parts, whole: bool) -> Iterator[Problem]:
    """Rules of curves at several rates."""
    at = (*path, "rate", "curves")
    if not isinstance(device, CurveDevice):
        yield Problem(at, "go with a device of one curve, not of stages: state C_m_per_s and P instead")
        return
    for n, (slow, fast) in enumerate(pairwise(device.rate_curves())):
        if fast.speed_m_per_s <= slow.speed_m_per_s:
            rule = f"must be more than the {slow.speed_m_per_s:.12g} m/s before it: speeds grow"
            yield Problem((*at, n + 1, "speed_m_per_s"), rule)
    if not whole:
        return
    end = parts.curve_points(device.curve)[0][-1]
    for n, at_rate in enumerate(device.rate_curves()):
        stroke, force = parts.curve_points(at_rate.curve)
        if abs(stroke[-1] - end) > _LEAST_WIDTH:
            yield Problem(
                (*at, n, "curve"),
                f"must end where the curve at rest does, at {end:.12g} mm, and ends at {stroke[-1]:.12g} mm",
            )
        if device.shear_off is not None and device.shear_off.force_kN < force[-1]:
            rule = (
                f"must be at least the {force[-1]:.12g} kN at which the curve at {at_rate.speed_m_per_s:.12g} m/s ends"
            )
            yield Problem((*path, "shear_off", "force_kN"), rule)


def _hysteresis(path: Path, device: HysteresisDevice, parts: Parts, size: float) -> Iterator[Problem]:
    loading, unloading = (parts.curve_points(ref) for ref in (device.loading, device.unloading))
    end, most = loading[0][-1], largest(loading[1])
    stiffness = device.transition_stiffness_kN_per_mm
    yield from _units(path, end, most, size)
    yield from _nothing(path, device, most)
    yield from _limit(path, device.stroke_limit_mm, end, "the loading curve")
    if unloading[0][-1] < end - _LEAST_WIDTH:
        rule = (
            f"must reach as far as loading, to {end:.12g} mm, and ends at {unloading[0][-1]:.12g} mm: extend the curve"
        )
        yield Problem((*path, "unloading"), rule)
        return
    for u in sorted([*loading[0], *(u for u in unloading[0] if u <= end)]):
        inwards, outwards = _at(loading, u), _at(unloading, u)
        if outwards > inwards * (1 + _ROUND_OFF):
            rule = f"is above loading at {u:.12g} mm, {outwards:.12g} kN over {inwards:.12g} kN: lower it there"
            yield Problem((*path, "unloading"), rule)
            break
    for key, (stroke, force) in (("loading", loading), ("unloading", unloading)):
        slope, at = max(((g - f) / (v - u), u) for (u, f), (v, g) in pairwise(zip(stroke, force, strict=True)))
        if slope >= stiffness:
            rule = f"must be more than every slope of the curves; {key} rises by {slope:g} kN/mm behind {at:g} mm"
            yield Problem((*path, "transition_stiffness_kN_per_mm"), rule)
    yield from _collapse(path, device, most)


def _hydraulic(path: Path, device: Hydraulic, size: float) -> Iterator[Problem]:
    if device.stroke_mm < size * _LEAST_STROKE:
        rule = f"must be at least {size * _LEAST_STROKE:.3g} mm{_for(size)}: multiply by 1000 if it is in m"
        yield Problem((*path, "stroke_mm"), rule)
    yield from _limit(path, device.stroke_limit_mm, device.stroke_mm, "stroke_mm")
    yield from _orifice(path, device)
    least = 0.0
    if isinstance(device, HydraulicDevice):
        least = device.preload_kN
        if least > 0 and device.preload_stiffness_kN_per_mm is None:
            rule = "is missing: a preload is reached along a stiffness; add it, or leave preload_kN out"
            yield Problem((*path, "preload_stiffness_kN_per_mm"), rule)
    yield from _stiff_end(path, device)
    if isinstance(device, GasHydraulicDevice):
        if device.gas.length_mm <= device.stroke_mm * (1 + _ROUND_OFF):
            rule = f"must be more than the {device.stroke_mm:.12g} mm of stroke: gas is not pressed to nothing"
            yield Problem((*path, "gas", "length_mm"), rule)
            return
        least = device.gas.force_at_kN(device.stroke_mm)
        if least > MAX_FORCE:
            rule = (
                f"gives {least:g} kN at {device.stroke_mm:.12g} mm of stroke, more than {MAX_FORCE:g} kN: lengthen it"
            )
            yield Problem((*path, "gas", "length_mm"), rule)
            return
    yield from _collapse(path, device, least, "without speed ")


def _orifice(path: Path, device: Hydraulic) -> Iterator[Problem]:
    if device.orifice_kN_s2_per_m2 is None and device.metering is None:
        yield Problem(path, "needs orifice_kN_s2_per_m2 or metering")
        return
    if device.orifice_kN_s2_per_m2 is not None and device.metering is not None:
        yield Problem((*path, "metering"), "does not go with orifice_kN_s2_per_m2: leave one of them out")
        return
    if device.metering is not None:
        yield from _metering((*path, "metering"), device.metering, device.stroke_mm)
    if isinstance(device, HydraulicDevice) and not device.preload_kN and not any(device.orifice_points()[1]):
        yield Problem(path, "has neither an orifice constant above 0 nor a preload: it gives no force")


def _metering(path: Path, metering: Metering | MeteringFile, stroke_mm: float) -> Iterator[Problem]:
    """Rules of the metering of a hydraulic device."""
    yield from curve_rules(path, metering)
    if not isinstance(metering, Metering):
        return
    stroke = metering.stroke_mm
    if stroke[0] != 0:
        yield Problem((*path, "stroke_mm", 0), "must be 0: metering covers the stroke of the device from its beginning")
    if stroke[-1] < stroke_mm - _LEAST_WIDTH:
        rule = f"must be at least the {stroke_mm:.12g} mm of stroke of the device, which metering covers"
        yield Problem((*path, "stroke_mm", len(stroke) - 1), rule)


def _stiff_end(path: Path, device: Hydraulic) -> Iterator[Problem]:
    """Behind a hydraulic device something stiff stops the plunger, and the device has no stiffness to lend it."""
    rule = (
        f"kind {device.kind} needs a stop or a car body with a stiffness of its own behind it, such as "
        "{ kind: stop, stiffness_kN_per_mm: 100 }"
    )
    end = device.end()
    if end is None:
        yield Problem((*path, "beyond"), f"is missing: {rule}")
    elif end.kind == "hold" or end.stiffness_kN_per_mm is None:
        yield Problem((*path, "beyond"), rule)


def _collapse(path: Path, device: AnyDevice, most: float, when: str = "") -> Iterator[Problem]:
    """The car body carries every force of the device in front of it; most is the largest one [kN]."""
    end = device.end()
    force = end.collapse_force_kN if end else None
    if force is not None and force < most:
        at = (*path, "beyond") if isinstance(device.beyond, str) else (*path, "beyond", "collapse_force_kN")
        own = f"collapses at {force:.12g} kN if nothing else is stated, and " if isinstance(device.beyond, str) else ""
        rule = f"{own}must be at least the {most:.12g} kN that the device {when}reaches before its end"
        yield Problem(at, f"{rule}: state a larger collapse_force_kN, or check the curve")


def _nothing(path: Path, device: AnyDevice, most: float) -> Iterator[Problem]:
    """A device without force, which is limited to its curve with its dashpot, needs something behind it."""
    end = device.end()
    if most == 0.0 and (end is None or end.kind == "hold"):
        yield Problem(path, "has no force at any stroke: it would be pressed without an end")


def _limit(path: Path, limit: float | None, end: float, what: str) -> Iterator[Problem]:
    if limit is not None and limit > end:
        cure = "extend the curve" if "curve" in what else "lower it, or increase stroke_mm"
        yield Problem((*path, "stroke_limit_mm"), f"must be within {what}, which ends at {end:.12g} mm: {cure}")


def _units(path: Path, end: float, most: float, size: float) -> Iterator[Problem]:
    """Stroke [mm] and force [kN] of a device that are too small for their units."""
    if 0 < end < size * _LEAST_STROKE:
        least = f"less than {size * _LEAST_STROKE:.3g} mm{_for(size)}"
        yield Problem(path, f"has {end:.12g} mm of stroke in all, {least}: multiply by 1000 if strokes are in m")
    if 0 < most < size**2 * _LEAST_FORCE:
        least = f"less than {size**2 * _LEAST_FORCE:.3g} kN{_for(size)}"
        rule = f"has {most:.12g} kN at most, {least}: multiply by 1000 if forces are in MN"
        yield Problem(path, rule)


def _for(size: float) -> str:
    """Why a least value is smaller than that of full-size vehicles."""
    return f", for a lighter side of {_FULL_SIZE * size**3:.3g} t" if size < 1.0 else ""


def _at(points: tuple[Sequence[float], Sequence[float]], stroke: float) -> float:
    """Force of a curve at a stroke [kN]; past its end the last one."""
    u, f = points
    k = bisect_right(u, stroke) - 1
    return f[-1] if k >= len(u) - 1 else f[k] + (f[k + 1] - f[k]) * (stroke - u[k]) / (u[k + 1] - u[k])
