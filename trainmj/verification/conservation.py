"""Energy and momentum, which no collision makes or loses."""

from __future__ import annotations

from collections.abc import Iterator

from trainmj.collision.summary import UNSTABLE
from trainmj.scenario import shipped as shipped_names
from trainmj.verification.check import Check, Kind
from trainmj.verification.systems import FRICTIONLESS, collide, shipped


def momentum() -> Iterator[Check]:
    """Kept to round-off without rail friction, and not only by the program's own account."""
    name = "B-type train, no rail friction"
    (summary,) = collide(shipped(changes=FRICTIONLESS))
    kept = sum(v.mass_t * v.final_speed_km_h for v in summary.vehicles)
    yield Check(name, "momentum at the end", 6 * 33 * 25, kept, 1e-9, unit="t km/h")


def balances() -> Iterator[Check]:
    """Every shipped scenario at its default step: rails and wall take the momentum, devices and rails the energy."""
    names = list(shipped_names())
    for name, summary in zip(names, collide(*(shipped(name) for name in names)), strict=True):
        b = summary.balance
        parts = b.kinetic_end_kJ + b.elastic_kJ + b.absorbed_kJ + b.friction_kJ
        yield Check(name, "energy at the end, in all its forms", b.kinetic_start_kJ, parts, UNSTABLE, unit="kJ")
        yield Check(name, "momentum that is missing, relative", 0.0, b.momentum_error, 1e-9, Kind.ABSOLUTE)
