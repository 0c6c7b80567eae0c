"""What is said and drawn of the devices of a chain: kind, end, draw gear, and the force over the stroke."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from trainmj.collision.chain import Chain, Element, Interface, places_of_sides
from trainmj.collision.device import CAR_BODY, Device
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.press import force_along
from trainmj.output.table import Table, Verdict, warned, worded
from trainmj.scenario import Scenario
from trainmj.scenario.devices import AnyDevice, CowperSymonds, CrushDevice
from trainmj.units import KN, MM, MS

_POINTS = 120  # of a curve, one way, beside those where it bends
_SEEN = 0.01  # part of the work at rest by which a curve must differ from that to be drawn too


@dataclass(frozen=True)
class Place:
    """Where a device stands."""

    interface: Interface  # at which interface
    index: int  # of the interface
    side: int  # 0 on its left, 1 on its right

    @property
    def device(self) -> Device:
        """What stands there."""
        return self.interface.devices[self.side]

    @property
    def name(self) -> str:
        """Of the interface, and of its side where both are reported."""
        return self.interface.sides[self.side]

    @property
    def share(self) -> float:
        """Part of stroke and rate of the interface that it takes at most."""
        return 0.5 if self.interface.equal_sides else 1.0


@dataclass(frozen=True)
class Drawn:
    """Force over stroke of a device, in and out again.

    Attributes:
        name: "at rest", "at 6.94 m/s", "draw gear".
        stroke: (n,) [m].
        force: (n,) [N].
        n_in: how many of the points are on the way in.
    """

    name: str
    stroke: Array
    force: Array
    n_in: int

    @property
    def parts(self) -> tuple[tuple[Array, Array], ...]:
        """The way in and the way out: strokes [mm], forces [kN]."""
        u, f, n = self.stroke / MM, self.force / KN, self.n_in
        return (u[:n], f[:n]), (u[n - 1 :], f[n - 1 :])


def users(chain: Chain, as_built: Collection[str] = ()) -> dict[str, list[Place]]:
    """Where each device stands, the front first, those places last where one differs as it was built.

    If both sides of an interface are equal, one stands for both.
    """
    found: dict[str, list[Place]] = {}
    for k, side in places_of_sides(chain):
        place = Place(chain.interfaces[k], k, side)
        found.setdefault(place.device.name, []).append(place)
    for k, interface in enumerate(chain.interfaces):
        for side, device in enumerate(interface.devices):
            found.setdefault(device.name, [Place(interface, k, side)])  # equal to the other side, of another name
    return {name: sorted(places, key=lambda place: place.name in as_built) for name, places in found.items()}


def curves(chain: Chain, places: list[Place], reached: float = 0.0) -> Iterator[Drawn]:
    """Force over stroke of a device, from new: at rest and, where that differs, at the largest rate that it sees.

    Args:
        chain: that it is part of.
        places: where it stands.
        reached: stroke up to which at least [m].
    """
    device = places[0].device
    strokes = np.linspace(0.0, max(_end(device), 1.05 * reached), _POINTS)
    strokes = np.unique(np.append(strokes, device.envelope.stroke[device.envelope.stroke < strokes[-1]]))
    way = np.append(strokes, strokes[-2::-1])
    element = Element((device.law,))
    rest, _ = force_along(element, way)
    yield Drawn("at rest", way, rest, strokes.size)
    speed = chain.closing_speed * max(place.share for place in places)
    moving, _ = force_along(element, way, speed)
    work, more = (float(np.trapezoid(f[: strokes.size], strokes)) for f in (rest, np.abs(moving - rest)))
    if more > _SEEN * work:
        yield Drawn(f"at {speed:.3g} m/s", way, moving, strokes.size)


def pulled(interface: Interface, most: float) -> Drawn:
    """Force over extension of the draw gear of an interface, both negative, up to an extension at least [m]."""
    element = next(element for element in interface.elements if element.sign < 0.0)
    out = np.linspace(0.0, -1.1 * max(element.start + 20 * MM, most), _POINTS)
    way = np.append(out, out[-2::-1])
    return Drawn("draw gear", way, force_along(element, way)[0], out.size)


def _end(device: Device) -> float:
    """Stroke up to which a device is drawn [m]: a little beyond its curve, and its limits."""
    path = device.envelope.climbing
    end = float(path.stroke[-1])
    room = 0.1 * end
    if path.last_slope > 0.0:
        room = min(room, 0.3 * max(float(path.force.max()), 200 * KN) / path.last_slope)
    return max([end + room, *(s.start + s.limit for s in device.stages if np.isfinite(s.limit))])


def table(scenario: Scenario, chain: Chain) -> Table:
    """What each device is: kind, stages, end, draw gear."""
    found = [(scenario.devices[name], places[0].device) for name, places in users(chain, scenario.as_built).items()]
    pulls = any(spec.pull for spec, _ in found)
    rows = [
        (device.name, _kind(spec), _stages(device), _behind(spec, device), *([_pull(spec)] if pulls else []))
        for spec, device in found
    ]
    heads = ["Device", "kind", "stages (limit mm)", "behind its end", *(["pull"] if pulls else [])]
    return Table(worded(*heads), rows, "Devices")


def as_built(scenario: Scenario) -> Table:
    """What single vehicles and devices differ in from what is stated of their kind."""
    rows = []
    for place, values in scenario.as_built.items():
        for path, value in values.items():
            several = isinstance(value, dict | list)
            rows.append(
                (place, path, "points of its own" if several else f"{value:.6g}" if isinstance(value, float) else value)
            )
    return Table(worded("As built", "value", "is"), rows)


def _kind(spec: AnyDevice) -> str:
    """Kind of a device, with its rate."""
    if isinstance(spec, CrushDevice) and spec.rate is not None:
        if isinstance(spec.rate, CowperSymonds):
            return f"crush, rate C {spec.rate.C_m_per_s:g} m/s, P {spec.rate.P:g}"
        return f"crush, rate curves up to {spec.rate_curves()[-1].speed_m_per_s:g} m/s"
    return spec.kind


def _stages(device: Device) -> str:
    """The stages of a device, the car body aside, with their limits."""
    own = [stage for stage in device.stages if stage.name != CAR_BODY]
    return ", ".join(f"{s.name} ({s.limit / MM:g})" if s.limit < np.inf else s.name for s in own)


def _behind(spec: AnyDevice, device: Device) -> str | Verdict:
    """What is behind the end of a device, and from which stroke on."""
    end = spec.end()
    if end is None:
        return warned("nothing stated")
    if end.kind == "car_body":
        start = device.stages[-1].start / MM
        return f"car body from {start:.6g} mm: {end.collapse_force_kN:g} kN"
    last = device.envelope.stroke[-1] / MM
    if end.kind == "stop":
        return f"stop from {last:.6g} mm: {end.stiffness_kN_per_mm:g} kN/mm"
    return f"held from {last:.6g} mm: {device.envelope.force[-1] / KN:.6g} kN"


def _pull(spec: AnyDevice) -> str:
    """The draw gear of a device."""
    pull = spec.pull
    if pull is None:
        return ""
    parts = [f"{'curve, ' if pull.curve is not None else ''}{pull.stiffness_kN_per_mm:g} kN/mm"]
    parts += [f"slack {pull.slack_mm:g} mm"] if pull.slack_mm else []
    parts += [f"breaks at {pull.breaking_force_kN:g} kN"] if pull.breaking_force_kN else []
    return ", ".join(parts)


def narrow(chain: Chain) -> Iterator[str]:
    """Devices with a peak of their curve that a step may pass at the closing speed, a sentence each."""
    for name, places in users(chain).items():
        way = chain.closing_speed * chain.step * max(place.share for place in places)
        part = _narrowest(places[0].device.envelope)
        if part < way:
            yield (
                f"{name}: in a step of {chain.step / MS:g} ms it is pressed by up to {way / MM:.3g} mm, and a peak of "
                f"its curve is {part / MM:.3g} mm wide; if that is passed unseen, the run makes smaller steps there."
            )


def _narrowest(curve: Envelope) -> float:
    """Width of the narrowest peak of a curve [m]: its top or, where that is a point, its steeper flank."""
    from scipy.signal import find_peaks

    u = curve.stroke
    _, found = find_peaks(curve.force, plateau_size=1)
    widths = [np.inf]
    for left, right in zip(found["left_edges"], found["right_edges"], strict=True):
        flanks = u[left] - u[left - 1], u[right + 1] - u[right]
        widths.append(u[right] - u[left] or min((w for w in flanks if w > 0.0), default=np.inf))
    return float(min(widths))
