"""From a computed collision to what a crashworthiness engineer reads: strokes, energies, accelerations, TS, TAMA.

Everything comes from the tally of every step, except what :mod:`~trainmj.collision.deceleration` takes from recorded
speeds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from trainmj.collision.chain import WALL, Chain, Interface
from trainmj.collision.deceleration import cfc60_peak, mean_deceleration, window_peak
from trainmj.collision.device import Array
from trainmj.collision.result import Result, Tally
from trainmj.files.plain import finite
from trainmj.units import KJ, KM_H, KN, MM, TONNE, G

WINDOWS = (0.030, 0.100)
"""Moving windows of the mean deceleration [s]."""

UNSTABLE = 1e-3
"""An energy balance that is further off, relative to the energy a collision can convert, makes a run unstable."""


@dataclass(frozen=True)
class StageUse:
    """How far one stage of a device was used.

    Attributes:
        name: of the stage, such as anti_climber.
        stroke_mm: largest stroke.
        limit_mm: what the design allows; None if it states nothing.
    """

    name: str
    stroke_mm: float
    limit_mm: float | None

    @property
    def exhausted(self) -> bool:
        """Whether the limit was passed."""
        return self.limit_mm is not None and self.stroke_mm > self.limit_mm


@dataclass(frozen=True)
class InterfaceMetrics:
    """One interface, or one train's side of the front interface.

    Attributes:
        name: S1-M1, M1-M2 and so on; the partner's side of an unequal front is "S1-M1 partner".
        device: name of the device.
        stroke_mm: largest stroke; at the front that of one train.
        permanent_mm: permanent set, likewise.
        peak_force_kN: largest force.
        energy_kJ: absorbed; at the front by one train.
        peak_time_s: when the stroke was largest.
        stages: how far each stage of the device was used.
        beyond_curve: whether the stroke went past the last point of the curve, where the force is only held.
    """

    name: str
    device: str
    stroke_mm: float
    permanent_mm: float
    peak_force_kN: float
    energy_kJ: float
    peak_time_s: float
    stages: tuple[StageUse, ...]
    beyond_curve: bool

    @property
    def crush_mm(self) -> float:
        """Stroke without empty strokes: what counts in TS."""
        return sum(stage.stroke_mm for stage in self.stages)

    @property
    def exhausted(self) -> bool:
        """Whether a stroke limit was passed, or the end of the curve."""
        return self.beyond_curve or any(stage.exhausted for stage in self.stages)


@dataclass(frozen=True)
class VehicleMetrics:
    """One vehicle.

    Attributes:
        name: M1, S1 and so on.
        kind: what its train calls it.
        mass_t: mass.
        peak_device_acceleration_g: largest |acceleration| by the devices alone, as the paper counts it.
        peak_acceleration_g: the same with rail friction.
        mean_deceleration_g: from the first to the last force at the front interface.
        mean_30ms_g: largest mean over 30 ms.
        mean_100ms_g: largest mean over 100 ms.
        cfc60_peak_g: largest |acceleration| behind a CFC 60 filter (SAE J211).
        final_speed_km_h: at the end of the run.
        balance_time_s: when the interface on the side of the impact had its largest stroke.
    """

    name: str
    kind: str
    mass_t: float
    peak_device_acceleration_g: float
    peak_acceleration_g: float
    mean_deceleration_g: float
    mean_30ms_g: float
    mean_100ms_g: float
    cfc60_peak_g: float
    final_speed_km_h: float
    balance_time_s: float


@dataclass(frozen=True)
class Balance:
    """Where energy and momentum went.

    The forces times the travel of a step give back the kinetic energy exactly, by the way the step is made, and so
    would prove nothing. The absorbed energy is therefore added up from the law: crush force times plastic travel, and
    dashpot force times travel. It closes the balance only where the step is small enough.

    Attributes:
        kinetic_start_kJ: at the start.
        kinetic_end_kJ: at the end.
        elastic_kJ: still in the devices.
        absorbed_kJ: by all devices.
        friction_kJ: by the rails.
        energy_error: what is missing, relative to what a collision can convert: the kinetic energy about the common
            centre of mass, all of it against a wall. Two trains that travel together cannot hide an error in it.
        momentum_error: momentum less the impulses of rails and wall, relative to the sum of |m v| at the start.
    """

    kinetic_start_kJ: float
    kinetic_end_kJ: float
    elastic_kJ: float
    absorbed_kJ: float
    friction_kJ: float
    energy_error: float
    momentum_error: float


@dataclass(frozen=True)
class Summary:
    """All numbers of a collision in engineering units.

    Attributes:
        status: "over", "time limit", "stroke exhausted at ...", "no contact: ..." or "unstable: ...".
        TS_mm: total compression along the moving train, empty strokes not counted (Eq. 1 of the paper).
        TAMA_g: mean of the peak device accelerations of the moving train (Eq. 2).
        duration_s: simulated time.
        interfaces: from the front backwards, the moving train first.
        vehicles: likewise.
        balance: energy and momentum.
    """

    status: str
    TS_mm: float
    TAMA_g: float
    duration_s: float
    interfaces: tuple[InterfaceMetrics, ...]
    vehicles: tuple[VehicleMetrics, ...]
    balance: Balance

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj run --json`` prints them; None for NaN and infinity, which JSON cannot hold."""
        plain: dict[str, Any] = finite(
            {
                "status": self.status,
                "criteria": {"TS_mm": self.TS_mm, "TAMA_g": self.TAMA_g},
                "duration_s": self.duration_s,
                "interfaces": [
                    vars(i) | {"stages": [vars(s) for s in i.stages], "crush_mm": i.crush_mm, "exhausted": i.exhausted}
                    for i in self.interfaces
                ],
                "vehicles": [vars(v) for v in self.vehicles],
                "balance": vars(self.balance),
            }
        )
        return plain


def summarise(result: Result) -> Summary:
    """The numbers of one computed collision."""
    return measure(result.chain, result.tally, result.time, result.velocity)


def measure(chain: Chain, tally: Tally, time: Array, velocity: Array) -> Summary:
    """The numbers of a collision from its tally and recorded speeds.

    Args:
        chain: what was collided.
        tally: from every step.
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].
    """
    interfaces = tuple(_interfaces(chain, tally))
    vehicles = tuple(_vehicles(chain, tally, time, velocity))
    balance = _balance(chain, tally)
    own = interfaces[: chain.n_moving]
    return Summary(
        status=_status(tally, interfaces, balance),
        TS_mm=sum(i.crush_mm for i in own),
        TAMA_g=float(np.mean([v.peak_device_acceleration_g for v in vehicles[: chain.n_moving]])),
        duration_s=tally.time,
        interfaces=interfaces,
        vehicles=vehicles,
        balance=balance,
    )


def _interfaces(chain: Chain, tally: Tally) -> Iterator[InterfaceMetrics]:
    """The front (the moving train's side), those behind it along the moving train, then the partner's."""
    front = chain.front
    for k in range(front, -1, -1):
        yield _interface(chain.interfaces[k], tally, k, 0)
    if len(chain.interfaces[front].devices) == 2 and not chain.interfaces[front].equal_sides:
        yield _interface(chain.interfaces[front], tally, front, 1)
    for k in range(front + 1, len(chain.interfaces)):
        yield _interface(chain.interfaces[k], tally, k, 0)


def _interface(interface: Interface, tally: Tally, k: int, side: int) -> InterfaceMetrics:
    largest = float(tally.stroke_max[k])
    device = interface.devices[side]
    stroke = interface.side_stroke(largest, side)
    share = _energy_share(interface, largest, side)
    # what the interface gives back its sides share as their stiffnesses say: K is 1 / (1 / K_left + 1 / K_right)
    given_back = (largest - float(tally.plastic[k])) * interface.envelope.stiffness / device.envelope.stiffness
    return InterfaceMetrics(
        name=interface.name + (" partner" if side else ""),
        device=device.name,
        stroke_mm=stroke / MM,
        permanent_mm=max(0.0, stroke - given_back) / MM,
        peak_force_kN=float(tally.force_max[k]) / KN,
        energy_kJ=share * float(tally.dissipated[k]) / KJ,
        peak_time_s=float(tally.stroke_max_time[k]),
        stages=tuple(
            StageUse(s.name, s.stroke(stroke) / MM, s.limit / MM if np.isfinite(s.limit) else None)
            for s in device.stages
        ),
        beyond_curve=bool(stroke > device.envelope.stroke[-1]),
    )


def _energy_share(interface: Interface, stroke: float, side: int) -> float:
    """Part of an interface's absorbed energy that one side takes: its work up to a stroke, less what it gives back."""
    if len(interface.devices) == 1:
        return 1.0
    if interface.equal_sides:
        return 0.5
    envelope = interface.envelope
    inner = envelope.stroke[envelope.stroke < stroke]
    until = np.append(inner, stroke)
    left = np.array([interface.side_stroke(x, 0) for x in until])
    peak = envelope.force_at(stroke)
    force = np.append(envelope.force[: inner.size], peak)
    own = float(np.trapezoid(force, left)) - 0.5 * peak**2 / interface.devices[0].envelope.stiffness
    total = float(np.trapezoid(force, until)) - 0.5 * peak**2 / envelope.stiffness
    share = min(1.0, max(0.0, own / total)) if total > 0 else 0.5
    return share if side == 0 else 1.0 - share


def _elastic(interface: Interface, tally: Tally, k: int) -> float:
    """Energy in the spring of an interface at the end [J]."""
    return 0.5 * interface.envelope.stiffness * max(0.0, float(tally.stroke[k] - tally.plastic[k])) ** 2


def _vehicles(chain: Chain, tally: Tally, time: Array, velocity: Array) -> Iterator[VehicleMetrics]:
    first, last = tally.first_force_time[chain.front], tally.last_force_time[chain.front]
    mean = mean_deceleration(float(first), float(last), time, velocity)
    windows = [window_peak(w, time, velocity) for w in WINDOWS]
    filtered = cfc60_peak(time, velocity)
    n = len(chain.vehicles)
    for i in [*range(chain.front, -1, -1), *range(chain.n_moving, n)]:
        ahead = i if i < chain.n_moving else i - 1  # the interface on the side of the impact
        yield VehicleMetrics(
            name=chain.vehicles[i].name,
            kind=chain.vehicles[i].kind,
            mass_t=chain.vehicles[i].mass / TONNE,
            peak_device_acceleration_g=float(tally.device_peak[i]) / G,
            peak_acceleration_g=float(tally.total_peak[i]) / G,
            mean_deceleration_g=float(mean[i]) / G,
            mean_30ms_g=float(windows[0][i]) / G,
            mean_100ms_g=float(windows[1][i]) / G,
            cfc60_peak_g=float(filtered[i]) / G,
            final_speed_km_h=float(tally.speed[i]) / KM_H,
            balance_time_s=float(tally.stroke_max_time[ahead]),
        )


def _balance(chain: Chain, tally: Tally) -> Balance:
    mass = chain.mass
    start, end = (float(0.5 * np.sum(mass * v**2)) for v in (chain.speed, tally.speed))
    elastic = sum(_elastic(interface, tally, k) for k, interface in enumerate(chain.interfaces))
    absorbed, friction = float(tally.dissipated.sum()), float(tally.friction_work.sum())
    momentum = float(np.sum(mass * (tally.speed - chain.speed))) - tally.impulse
    return Balance(
        kinetic_start_kJ=start / KJ,
        kinetic_end_kJ=end / KJ,
        elastic_kJ=elastic / KJ,
        absorbed_kJ=absorbed / KJ,
        friction_kJ=friction / KJ,
        energy_error=(start - end - elastic - absorbed - friction) / _convertible(chain),
        momentum_error=momentum / float(np.sum(mass * np.abs(chain.speed))),
    )


def _convertible(chain: Chain) -> float:
    """Kinetic energy at the start [J] that a plastic collision takes: about the centre of mass, or all at a wall."""
    common = 0.0 if chain.interfaces[-1].right == WALL else float(np.average(chain.speed, weights=chain.mass))
    return float(0.5 * np.sum(chain.mass * (chain.speed - common) ** 2))


def _status(tally: Tally, interfaces: tuple[InterfaceMetrics, ...], balance: Balance) -> str:
    if not (np.isfinite(balance.energy_error) and np.isfinite(tally.stroke_max).all()):
        return "unstable: a value is not finite; take a smaller step"
    if abs(balance.energy_error) > UNSTABLE:
        return f"unstable: the energy balance is off by {abs(balance.energy_error):.2%}; take a smaller step"
    if tally.first_force_time.max() < 0.0:
        return "no contact: " + (
            "the two sides came to rest, or stopped coming closer, before a device was pressed"
            if tally.over
            else "no device was pressed before the time limit"
        )
    spent = [_spent(i) for i in interfaces if i.exhausted]
    if spent:
        return "stroke exhausted at " + ", ".join(spent)
    return "over" if tally.over else "time limit"


def _spent(interface: InterfaceMetrics) -> str:
    for stage in interface.stages:
        if stage.exhausted:
            of = f" {stage.name}" if len(interface.stages) > 1 else ""
            return f"{interface.name}{of} ({stage.stroke_mm:.1f} of {stage.limit_mm:g} mm)"
    return f"{interface.name} ({interface.stroke_mm:.1f} mm, past the end of its curve)"
