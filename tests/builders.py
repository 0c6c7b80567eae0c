"""Small systems that the tests collide; most are those of the verification that ships."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import pytest
import xarray as xr

from trainmj.cases import intact
from trainmj.cases.rows import Rows
from trainmj.collision import kernel
from trainmj.collision.block import Tally, alone
from trainmj.collision.chain import Chain, Element, Interface, meet
from trainmj.collision.device import Device
from trainmj.collision.element import advance
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import ELEMENT, N_ELEMENT
from trainmj.collision.law import KINDS
from trainmj.collision.simulation import start
from trainmj.files import signed as checksums
from trainmj.scenario import Scenario, shipped
from trainmj.verification.systems import (
    FACE,
    METRO,
    STRUT,
    chain,
    device,
    envelope,
    planar,
    pulses,
    scenario,
    values,
)

__all__ = [
    "ALONG",
    "FACE",
    "KINDS_OF_DEVICE",
    "METRO",
    "SHIPPED",
    "STRUT",
    "Alone",
    "built",
    "chain",
    "changed",
    "device",
    "envelope",
    "few",
    "joined",
    "planar",
    "pulses",
    "scenario",
    "signed",
    "step_once",
    "values",
]

_VARIANTS = {"b_type_ends", "b_type_s08", "b_type_scenario_1", "b_type_scenario_2", "b_type_two_formations"}
_VARIANTS |= {"emu_vertical", "fra_cem_single", "fra_cem_two", "fra_conventional_single", "fra_conventional_train"}
SHIPPED = [pytest.param(name, marks=[pytest.mark.thorough] * (name in _VARIANTS)) for name in sorted(shipped())]
"""Shipped scenarios, each to be simulated; those that differ little from others only in thorough runs."""

ALONG = [param for param in SHIPPED if not str(param.values[0]).endswith("_vertical")]
"""Those whose vehicles move along the track only."""

assert {param.values[0] for param in SHIPPED} > _VARIANTS


def points(*pairs: tuple[float, float]) -> dict[str, list[float]]:
    """A curve of a scenario from pairs of mm and kN."""
    stroke, force = zip(*pairs, strict=True)
    return {"stroke_mm": list(map(float, stroke)), "force_kN": list(map(float, force))}


_TUBE = {"curve": points((0, 0), (20, 700), (60, 500), (150, 900)), "stiffness_kN_per_mm": 120}
_STOP = {"kind": "stop", "stiffness_kN_per_mm": 90}
_GEAR = {
    "kind": "hysteresis",
    "loading": points((0, 100), (60, 700), (110, 1900)),
    "unloading": points((0, 20), (80, 150), (110, 300)),
    "transition_stiffness_kN_per_mm": 150,
}
_OIL = {"kind": "hydraulic", "stroke_mm": 105, "orifice_kN_s2_per_m2": 40, "beyond": _STOP}
_GAS = {
    "kind": "gas_hydraulic",
    "stroke_mm": 105,
    "metering": {"stroke_mm": [0, 50, 105], "orifice_kN_s2_per_m2": [20, 40, 200]},
    "gas": {"force_kN": 50, "length_mm": 120, "exponent": 1.3, "preload_stiffness_kN_per_mm": 80},
    "rebound_orifice_kN_s2_per_m2": 400,
    "beyond": _STOP,
}
KINDS_OF_DEVICE: dict[str, dict[str, Any]] = {
    "tube": _TUBE,
    "damped": {**_TUBE, "damping_kN_s_per_m": 400, "beyond": "car_body"},
    "stopped": {**_TUBE, "empty_stroke_mm": 15, "beyond": "stop"},
    "jumps": {
        "stages": {"a": {"curve": points((0, 300), (40, 300))}, "b": {"curve": points((0, 800), (50, 200))}},
        "stiffness_kN_per_mm": 60,
    },
    "sheared": {
        "stages": {
            "coupler": {"curve": points((0, 0), (15, 600)), "shear_off": {"force_kN": 900, "ramp_mm": 0.5}},
            "absorber": {"empty_stroke_mm": 30, "curve": points((0, 1000), (90, 1100))},
        },
        "stiffness_kN_per_mm": 400,
        "damping_kN_s_per_m": 30,
    },
    "rated": {**_TUBE, "rate": {"C_m_per_s": 20, "P": 5}, "beyond": "car_body"},
    "at_speeds": {
        **_TUBE,
        "rate": {
            "curves": [
                {"speed_m_per_s": 2, "curve": points((0, 0), (20, 800), (150, 1100))},
                {"speed_m_per_s": 5, "curve": points((0, 0), (25, 900), (150, 1300))},
            ]
        },
    },
    "gear": {**_GEAR, "empty_stroke_mm": 12, "beyond": _STOP},
    "rubber": {**_GEAR, "beyond": {"kind": "car_body", "collapse_force_kN": 2500}},
    "held": _GEAR,
    "oil": _OIL,
    "preloaded": {**_OIL, "empty_stroke_mm": 10, "preload_kN": 100, "preload_stiffness_kN_per_mm": 100},
    "body_behind_oil": {**_OIL, "beyond": {"kind": "car_body", "collapse_force_kN": 1500, "stiffness_kN_per_mm": 100}},
    "gas": _GAS,
    "quick_gas": {**_GAS, "rebound_orifice_kN_s2_per_m2": 0},
}
"""A device of every kind and end, as a scenario states them."""


def built(**specs: Any) -> dict[str, Device]:
    """Devices by name; by default one of every kind and end."""
    specs = specs or KINDS_OF_DEVICE
    whole = Scenario.from_values(
        {
            "devices": specs,
            "trains": {"t": {"vehicles": 1, "mass_t": 40, "front": next(iter(specs))}},
            "collision": {"train": "t", "speed_km_h": 10, "partner": "rigid_wall"},
        }
    )
    return {name: KINDS[spec.law].device(name, spec, whole) for name, spec in whole.devices.items()}


def joined(left: Envelope, right: Envelope) -> Interface:
    """A front interface of two devices in series, between vehicles 0 and 1."""
    sides = device(left, "left"), device(right, "right")
    return Interface("front", 0, 1, meet(*sides, coupled=False), sides, ("front", "front partner"))


class Alone:
    """An element pressed by itself, by the law as plain Python."""

    def __init__(self, element: Element | Device | Envelope, follows: bool = False) -> None:
        """Take an element, or the one of a device or an envelope; followed through what happens to it within a step."""
        of = device(element) if isinstance(element, Envelope) else element
        self.element = meet(of)[0] if isinstance(of, Device) else of
        self.block: Array = alone(self.element, follows)
        self.time = self.work = 0.0

    def to(self, stroke: float, rate: float = 0.0, elapsed: float = 0.0) -> float:
        """Press it to a stroke [m] at a rate [m/s] within some time [s]; its force [N]."""
        self.time += elapsed
        before, force_before = self.stroke, self.force
        force, _ = advance(self.block, 0, stroke, rate, elapsed, self.time)
        self.work += 0.5 * (force_before + self.force) * (self.stroke - before) / self.element.share
        return force

    @property
    def stroke(self) -> float:
        """Its own stroke [m]."""
        return float(self.block[ELEMENT.STROKE])

    @property
    def force(self) -> float:
        """Its own force, positive where it acts [N]."""
        return float(self.block[ELEMENT.FORCE])

    def of(self, field: int, law: int | None = None) -> float:
        """A field of its record, or of that of a law of two."""
        at = 0 if law is None else N_ELEMENT * (law + 1)
        return float(self.block[at + field])

    @property
    def lost(self) -> float:
        """Energy that it has lost [J]."""
        return self.of(ELEMENT.DISSIPATED) / self.element.share

    @property
    def stored(self) -> float:
        """Energy that its laws hold [J]."""
        pair = len(self.element.laws) == 2
        found = 0.0
        for n, law in enumerate(self.element.laws):
            fields = (ELEMENT.STROKE, ELEMENT.FORCE, ELEMENT.STATE_0, ELEMENT.STATE_1)
            found += law.kind.stored(law, *(self.of(field, n if pair else None) for field in fields))
        return float(found / self.element.share)


def step_once(model: Any, chain: Chain) -> Any:
    """A simulation of a chain after one step with the law."""
    import mujoco

    from trainmj.collision.block import Layout

    data = start(model, chain, Layout.of(chain))
    with kernel.installed():
        mujoco.mj_step(model, data)
    return data


def changed(tally: Tally, **fields: Any) -> Tally:
    """A tally with some of its fields replaced."""
    return Tally(**(vars(tally) | fields))


def by_xarray(data: xr.Dataset) -> bytes:
    """What is in a result as the bytes of its file, by way of xarray and scipy, its checksum right."""
    sound = {checksums.CHECKSUM: checksums.UNSIGNED}
    return checksums.signed(bytes(data.assign_attrs(sound).to_netcdf(engine="scipy")))


def few(values: Iterable[Any], n: int) -> list[Any]:
    """Values of a parameter of which the default run takes the first n; thorough runs take the others."""
    every = [value if isinstance(value, tuple) else (value,) for value in values]
    return [pytest.param(*value, marks=[pytest.mark.thorough] * (k >= n)) for k, value in enumerate(every)]


def each_alone(chunks: Iterable[Rows]) -> Iterator[Rows]:
    """The rows of an engine one by one, however many it yields at a time."""
    for rows in chunks:
        for n in range(len(rows)):
            here = slice(n, n + 1)
            facts = {name: values[here] for name, values in rows.facts.items()}
            of_one = (
                {name: getattr(one, name)[here] for name in ("where", "found", "limit", "valid")} for one in rows.limits
            )
            limits = tuple(replace(one, **of) for one, of in zip(rows.limits, of_one, strict=True))
            yield replace(rows, keys=rows.keys[here], facts=facts, numbers=rows.numbers[here], limits=limits)


def signed(db: sqlite3.Connection) -> None:
    """State the digests of a store that a test has changed, as its writer does, or whoever changes it with intent."""
    db.execute("DELETE FROM about WHERE key = ?", intact.DIGESTS[:1])
    intact.count(db, intact.digest_of_rows(db))
    intact.sign(db)
