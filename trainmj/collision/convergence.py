"""How far the step moves the criteria of a collision: halve it until TS and TAMA settle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trainmj.collision.batch import run_chains
from trainmj.collision.chain import line_up
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.scenario import Scenario
from trainmj.units import MS

SETTLED = 1e-4
"""TS and TAMA have settled when two halvings in a row change neither by more than this, relative."""

MOST_HALVINGS = 7


@dataclass(frozen=True)
class Estimate:
    """A criterion in the limit of small steps.

    Attributes:
        value: the limit.
        order: of convergence, seen in the last three steps; None where these follow no order, and value is that of the
            smallest step.
        error: of the scenario's own step, relative to value.
        doubt: of value: what the last halving changed, relative to value.
    """

    value: float
    order: float | None
    error: float
    doubt: float


@dataclass(frozen=True)
class Convergence:
    """What halving the step has shown.

    Attributes:
        step_ms: steps, the scenario's own first, each half of the one before.
        summaries: the collision at each.
        TS: its limit and error [mm].
        TAMA: likewise [g].
        settled: whether both have settled.
    """

    step_ms: tuple[float, ...]
    summaries: tuple[Summary, ...]
    TS: Estimate
    TAMA: Estimate
    settled: bool

    @property
    def stroke_changes_mm(self) -> list[float]:
        """Largest difference of any stroke from the smallest step's, at each step."""
        fine = self.summaries[-1]
        return [
            max(abs(a.stroke_mm - b.stroke_mm) for a, b in zip(s.interfaces, fine.interfaces, strict=True))
            for s in self.summaries
        ]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj run --converge --json`` prints them."""
        return {
            "settled": self.settled,
            "settled_within": SETTLED,
            "TS_mm": vars(self.TS),
            "TAMA_g": vars(self.TAMA),
            "steps": [
                {
                    "step_ms": h,
                    "status": s.status,
                    "TS_mm": s.TS_mm,
                    "TAMA_g": s.TAMA_g,
                    "largest_stroke_change_mm": change,
                    "energy_error": s.balance.energy_error,
                }
                for h, s, change in zip(self.step_ms, self.summaries, self.stroke_changes_mm, strict=True)
            ],
        }


def converge(scenario: Scenario) -> Convergence:
    """Halve the step of a collision until TS and TAMA settle, or seven times.

    Args:
        scenario: what to collide; the first step is its own.

    Raises:
        InputError: if its own step is too large, or so small that it cannot be halved three times.
    """
    steps: list[float] = []
    found: list[Summary] = []
    for n in range(MOST_HALVINGS + 1):
        step = scenario.simulation.step_ms / 2**n
        try:
            finer = scenario.with_values({"simulation.step_ms": step})
        except InputError as error:
            if n < 3:
                raise InputError(f"the step cannot be halved {n} times to see what it changes: {error}") from None
            break
        chain = line_up(finer)
        steps.append(chain.step / MS)
        found += [summary for _, summary in run_chains([(n, chain)], threads=1)]
        if len(found) > 3 and all(_settled([getattr(s, name) for s in found]) for name in ("TS_mm", "TAMA_g")):
            break
    TS, TAMA = ([float(getattr(s, name)) for s in found] for name in ("TS_mm", "TAMA_g"))
    return Convergence(tuple(steps), tuple(found), limit(TS), limit(TAMA), _settled(TS) and _settled(TAMA))


def _settled(values: Sequence[float]) -> bool:
    """Whether the last two halvings changed little."""
    last = np.asarray(values[-3:])
    return bool(np.isfinite(last).all() and (np.abs(np.diff(last)) <= SETTLED * np.abs(last[1:])).all())


def limit(values: Sequence[float]) -> Estimate:
    """The limit of values at steps that are each half of the one before.

    Richardson extrapolation, where the last three values show an order between a half and three: with changes d1 and
    d2 of the last two halvings, d1 / d2 = 2^p, and d2 / (2^p - 1) remains. Elsewhere the last value stands: events
    that fall between two steps, as a shear-off does, follow no order.

    Args:
        values: three or more.
    """
    a, b, c = (float(v) for v in values[-3:])
    first, second = b - a, c - b
    ratio = first / second if second else np.inf
    order = float(np.log2(ratio)) if 0.0 < ratio < np.inf else None
    if order is not None and not 0.5 <= order <= 3.0:
        order = None
    value = c if order is None else c + second / (2.0**order - 1.0)
    scale = abs(value) or 1.0
    return Estimate(value, order, abs(values[0] - value) / scale, abs(second) / scale)
