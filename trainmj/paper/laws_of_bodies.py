"""What Section 3.2 says of the finite element model, checked on car bodies that give beside rigid vehicles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trainmj.collision.result import Result
from trainmj.collision.summary import summarise
from trainmj.paper.finding import Law
from trainmj.units import KJ, KM_H, MM, G

DIFFERENT = ("S1-M1", "S2-S3", "M2-M3")
"""The interfaces whose strokes Section 3.2 calls slightly different; it calls the others essentially the same."""

SLIGHTLY = 0.05
"""Most that a stroke may change and still be slightly different, relative to the largest."""


def laws_of_bodies(rigid: Result, elastic: Result, section: str) -> Iterator[Law]:
    """The statements about both models, for one scenario of Table 2."""
    for statements in (_energies, _strokes, _speeds):
        for law in statements(rigid, elastic, section):
            yield replace(law, holds=bool(law.holds))  # numpy's has no place in JSON


def _energies(rigid: Result, elastic: Result, section: str) -> Iterator[Law]:
    n = min(len(rigid.time), len(elastic.time))
    start = rigid.kinetic[0]
    apart = float(np.sqrt(np.mean((elastic.kinetic[:n] - rigid.kinetic[:n]) ** 2)) / start)
    said = "Energy curves of both models are very consistent"
    yield Law(
        section, said, f"{100 * apart:.2f} % apart (rms)", apart < 0.005, "kinetic energy, below 0.5 % of its start"
    )
    times = [
        float(np.interp(0.9, (r.kinetic[0] - r.kinetic) / (r.kinetic[0] - r.kinetic[-1]), r.time))
        for r in (rigid, elastic)
    ]
    said = "The times of the energy change are almost identical"
    found = f"90 % of it at {times[0]:.3f} and {times[1]:.3f} s"
    yield Law(section, said, found, abs(times[1] / times[0] - 1) < 0.02, "within 2 %")
    most = float(elastic.member_elastic.sum(axis=1).max() / KJ)
    said = "Car bodies absorb elastic energy"
    yield Law(
        section, said, f"at most {most:.1f} kJ, {100 * most * KJ / start:.2f} % of the kinetic energy", most > 0.0
    )


def _strokes(rigid: Result, elastic: Result, section: str) -> Iterator[Law]:
    names = [interface.name for interface in rigid.chain.interfaces]
    change = dict(zip(names, (elastic.tally.stroke_max - rigid.tally.stroke_max) / MM, strict=True))
    named = [abs(change[name]) for name in DIFFERENT]
    others = {name: abs(c) for name, c in change.items() if name not in DIFFERENT}
    largest = float(rigid.tally.stroke_max.max() / MM)
    said = f"Strokes are slightly different at {', '.join(DIFFERENT)}"
    found = ", ".join(f"{change[name]:+.1f}" for name in DIFFERENT) + " mm"
    rule = f"by more than at any other, and by less than {100 * SLIGHTLY:g} % of the largest"
    yield Law(section, said, found, max(others.values()) < min(named) and max(named) < SLIGHTLY * largest, rule)
    where = max(others, key=others.__getitem__)
    said = "Strokes at the other interfaces are essentially the same"
    yield Law(
        section,
        said,
        f"within {others[where]:.1f} mm ({where})",
        others[where] < 0.005 * largest,
        "0.5 % of the largest",
    )


def _speeds(rigid: Result, elastic: Result, section: str) -> Iterator[Law]:
    both = [summarise(result) for result in (rigid, elastic)]
    later = max(
        abs(b.balance_time_s - a.balance_time_s) for a, b in zip(both[0].vehicles, both[1].vehicles, strict=True)
    )
    said = "Speeds have the same trend and balance time"
    yield Law(section, said, f"balance times within {1e3 * later:.0f} ms", later < 0.02, "20 ms")
    more = _way(elastic) / _way(rigid)
    said = "Speeds fluctuate more with bodies that give"
    yield Law(
        section, said, f"{more:.2f} times as much up and down", more > 1.0, "way of all speeds beyond their change"
    )
    n, mass = rigid.chain.n_moving, rigid.chain.mass
    moving, struck = (
        np.array([_final(r, part) for r in (rigid, elastic)]) for part in (slice(None, n), slice(n, None))
    )
    said = "The final speed of the moving train is slightly lower"
    found = f"{moving[1]:.2f} against {moving[0]:.2f} km/h"
    yield Law(section, said, found, 0.0 < moving[0] - moving[1] < 0.05 * moving[0], "lower, by less than 5 %")
    fall, rise = moving[1] - moving[0], struck[1] - struck[0]
    said = "The final speeds of both trains are slightly lower"
    kept = f"{mass[:n].sum() / 1e3:.2f} t x ({fall:+.3f} km/h) + {mass[n:].sum() / 1e3:.2f} t x ({rise:+.3f} km/h)"
    left = float(mass[:n].sum() * fall + mass[n:].sum() * rise) / 1e3
    why = (
        f"momentum: rails brake both trains alike once both roll, so what one loses the other gains; {kept} = "
        f"{left:+.2f} t km/h"
    )
    yield Law(section, said, f"{fall:+.2f} and {rise:+.2f} km/h", fall < 0 and rise < 0, impossible=why)


def _way(result: Result) -> float:
    """How far all speeds go up and down beyond their change from first to last [m/s]."""
    return float(
        np.sum(np.abs(np.diff(result.velocity, axis=0))) - np.sum(np.abs(result.velocity[-1] - result.velocity[0]))
    )


def _final(result: Result, part: slice, at: float = 0.85) -> float:
    """Mean speed of a train at a time after the collision [km/h]: from its end on, the rails brake it."""
    mass, v = result.chain.mass[part], result.velocity[-1][part]
    friction = result.chain.vehicles[part.start or 0].rail_friction
    return float(mass @ v / mass.sum() - friction * G * (at - result.time[-1])) / KM_H
