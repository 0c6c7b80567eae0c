"""How far the step moves the responses of a collision: halve it until they settle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.collision.quantities import Column, columns_of, matching, no_number
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.files.shown import Shown
from trainmj.files.written import finite
from trainmj.scenario import Scenario, scenario_given
from trainmj.units import MS

SETTLED = 1e-4
"""A response has settled when two halvings in a row change it by no more than this, relative."""

MOST_HALVINGS = 7

CRITERIA = ("TS_mm", "TAMA_g")
"""The responses that are settled unless others are asked for."""


@dataclass(frozen=True)
class Estimate:
    """A response in the limit of small steps.

    Attributes:
        value: the limit.
        order: of convergence, seen in the last three steps; None where these follow no order, and value is that of the
            smallest step.
        error: of the scenario's own step, relative to value.
        doubt: of value: what the last halving changed, relative to value.
        unit: of value.
    """

    value: float
    order: float | None
    error: float
    doubt: float
    unit: str = ""


@dataclass(frozen=True)
class Convergence(Shown):
    """What halving the step has shown.

    Attributes:
        step_ms: steps, the scenario's own first, each half of the one before.
        summaries: the collision at each.
        columns: the responses that were to settle, by the names of their columns.
        values: of each of them at each step.
        estimates: the limit of each, and how far off the scenario's own step is.
        settled: whether all have settled.
    """

    step_ms: tuple[float, ...]
    summaries: tuple[Summary, ...]
    columns: Mapping[str, Column]
    values: Mapping[str, tuple[float, ...]]
    estimates: Mapping[str, Estimate]
    settled: bool

    def __repr__(self) -> str:
        """Whether it settled, and the limits: it holds a whole summary for each step."""
        said = ", ".join(f"{name} {one.value:.6g}" for name, one in self.estimates.items())
        return f"<Convergence {'settled' if self.settled else 'NOT SETTLED'} at {self.step_ms[-1]:g} ms: {said}>"

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
        rows = zip(self.step_ms, self.summaries, self.stroke_changes_mm, strict=True)
        plain: dict[str, Any] = finite(
            {
                "settled": self.settled,
                "settled_within": SETTLED,
                **{name: asdict(estimate) for name, estimate in self.estimates.items()},
                "steps": [
                    {
                        "step_ms": step,
                        "status": str(summary.status),
                        "valid_until_s": summary.valid_until_s,
                        **{name: values[k] for name, values in self.values.items()},
                        "largest_stroke_change_mm": change,
                        "energy_error": summary.balance.energy_error,
                    }
                    for k, (step, summary, change) in enumerate(rows)
                ],
            }
        )
        return plain


def converge(
    scenario: Scenario | str | Path,
    responses: Sequence[str] = CRITERIA,
    *,
    changes: Mapping[str, Any] | None = None,
    **parameters: Any,
) -> Convergence:
    """Halve the step of a collision until its responses settle, or seven times.

    Args:
        scenario: what to collide, or the path of its file; the first step is its own.
        responses: what is to settle, as names of columns or patterns such as ``"peak_device_*"``.
        changes: values of the scenario to change, by path or parameter.
        parameters: the same, as keywords.

    Raises:
        InputError: if its own step is too large, or so small that it cannot be halved three times; or if no response
            has a name that is asked for.
    """
    scenario = scenario_given(scenario, changes, parameters)
    first = line_up(scenario)
    columns = matching(responses, columns_of(first))
    for column in columns.values():
        if reason := no_number(column, first):
            raise InputError(f"responses: {reason}")
    steps: list[float] = []
    found: list[Summary] = []
    values: dict[str, list[float]] = {name: [] for name in columns}
    settled = False
    for n in range(MOST_HALVINGS + 1):
        step = scenario.simulation.step_ms / 2**n
        try:
            finer = scenario.with_values({"simulation.step_ms": step})
        except InputError as error:
            if n < 3:
                raise InputError(f"the step cannot be halved often enough to see what it changes: {error}") from None
            break
        chain = line_up(finer)
        steps.append(chain.step / MS)
        ((_, summary),) = run_chains([(n, chain)], threads=1)
        found.append(summary)
        row = summary.row()
        for name in columns:
            values[name].append(float(row[name]))
        settled = n > 1 and all(map(_settled, values.values()))
        if n > 2 and settled:
            break
    return Convergence(
        tuple(steps),
        tuple(found),
        columns,
        {name: tuple(of) for name, of in values.items()},
        {name: limit(of, columns[name].unit) for name, of in values.items()},
        settled,
    )


def _settled(values: Sequence[float]) -> bool:
    """Whether the last two halvings changed little."""
    last = np.asarray(values[-3:])
    return bool(np.isfinite(last).all() and (np.abs(np.diff(last)) <= SETTLED * np.abs(last[1:])).all())


def limit(values: Sequence[float], unit: str = "") -> Estimate:
    """The limit of values at steps that are each half of the one before.

    Richardson extrapolation, where the last three values show an order between a half and three: with changes d1 and
    d2 of the last two halvings, d1 / d2 = 2^p, and d2 / (2^p - 1) remains. Elsewhere the last value stands: events
    that fall between two steps, as a shear-off does, follow no order.

    Args:
        values: three or more.
        unit: of the values.
    """
    a, b, c = (float(v) for v in values[-3:])
    first, second = b - a, c - b
    ratio = first / second if second else np.inf
    order = float(np.log2(ratio)) if 0.0 < ratio < np.inf else None
    if order is not None and not 0.5 <= order <= 3.0:
        order = None
    value = c if order is None else c + second / (2.0**order - 1.0)
    scale = abs(value) or 1.0
    return Estimate(value, order, abs(values[0] - value) / scale, abs(second) / scale, unit)
