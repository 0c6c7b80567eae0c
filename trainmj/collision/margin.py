"""How strong the vertical ties of faces have to be: the factor on their capacity below which they no longer hold."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision.chain import Chain, places_of_sides
from trainmj.collision.line import Line, LineEnd
from trainmj.collision.lineup import line_up
from trainmj.collision.records import InterfaceMetrics
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.files.written import finite
from trainmj.scenario import Scenario, scenario_given

SLIP = 10.0
"""Slip up to which engaged faces hold, unless another one is asked for [mm]."""

MOST = 8.0
"""Largest factor that is tried."""

_FIRST = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, MOST)  # factors, which then are closed in on
_WITHIN = 0.01  # of the factor; and the least factor
_INNER = 3  # factors that are tried between two at once


@dataclass(frozen=True)
class Margin:
    """What the tie of an interface has to spare, or lacks.

    Attributes:
        interface: its name.
        factor: on the capacity of its ties, friction and teeth together, from which on they hold, to 1 %; 0 if they
            hold without any, infinite if not even with MOST.
        slip_mm: slip up to which they hold.
        slip_as_stated_mm: largest slip of its faces with the ties as stated.
        tied: whether its ties have any capacity as stated.
        valid: whether the collision is valid at that factor: nothing else slid off, and no curve ended.
    """

    interface: str
    factor: float
    slip_mm: float
    slip_as_stated_mm: float
    tied: bool = True
    valid: bool = True

    @property
    def said(self) -> str:
        """What it means, in words."""
        if self.factor == 0.0:
            return "holds without any tie"
        if not self.tied:
            return "does not hold: no tie is stated"
        if self.factor == math.inf:
            return f"never holds, up to {MOST:g} times its capacity"
        if self.factor <= 1.0:
            return f"holds, down to {self.factor:.3g} of its capacity"
        return f"too weak: needs {self.factor:.3g} times its capacity"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj run --margin --json`` prints them; the factor is None if ties never hold."""
        plain: dict[str, Any] = finite({**vars(self), "said": self.said})
        return plain


def margins(
    scenario: Scenario | str | Path,
    slip_mm: float = SLIP,
    *,
    changes: Mapping[str, Any] | None = None,
    **parameters: Any,
) -> tuple[Margin, ...]:
    """The capacity that ties need, as a factor on what is stated, for each interface whose faces engage.

    Ties hold if no face of the interface slides off the other and engaged faces slip no more than stated. The factor is
    that below which this is no longer so, the ties of all other interfaces as stated; of several such factors it is the
    largest. The peak force of a tie is no margin: it grows with the stiffness of the tie, whatever that has to spare.

    Args:
        scenario: in the vertical plane with its ties as stated, or the path of its file.
        slip_mm: slip of engaged faces up to which they hold.
        changes: values of the scenario to change, by path or parameter.
        parameters: the same, as keywords.

    Returns:
        A margin for each interface under test whose faces engage, from the front backwards.

    Raises:
        InputError: if the scenario is not in the vertical plane, ties are not as stated, or the slip is no length.
    """
    scenario = scenario_given(scenario, changes, parameters)
    if scenario.plane != "vertical":
        raise InputError("margin: ties have an effect in the vertical plane only: state plane: vertical")
    if scenario.ties != "stated":
        raise InputError(f"margin: is that of ties as stated, and the scenario has ties: {scenario.ties}")
    if not (math.isfinite(slip_mm) and slip_mm >= 0.0):
        raise InputError(f"margin: a slip of {slip_mm:g} mm is no length")
    from trainmj.collision.batch import run_chains

    chain = line_up(scenario)
    stated = next(summary for _, summary in run_chains([(0, chain)]))
    engaged = [k for k, sides in _by_interface(chain, stated).items() if any(map(_engaged, sides))]
    tied = {k: any(_tied(element.line) for element in chain.interfaces[k].elements) for k in engaged}
    tried: dict[int, dict[float, Summary]] = {k: {1.0 if tied[k] else 0.0: stated} for k in engaged}

    def span(k: int) -> tuple[float, float]:
        """The largest factor tried at which ties fail, and the next one; negative and infinite if there is none."""
        held = {factor: _holds(chain, found, k, slip_mm) for factor, found in tried[k].items()}
        low = max((factor for factor, holds in held.items() if not holds), default=-math.inf)
        return low, min((factor for factor in held if factor > low), default=math.inf)

    asked = {k: [factor for factor in _FIRST if factor != 1.0] for k in engaged if tied[k]}
    while asked:
        cases = [((k, factor), _with(chain, k, factor)) for k, factors in asked.items() for factor in factors]
        for (k, factor), summary in run_chains(cases):
            tried[k][factor] = summary
        asked = {k: _between(*span(k)) for k in engaged}
        asked = {k: factors for k, factors in asked.items() if factors}
    found = []
    for k in engaged:
        factor = span(k)[1]
        slip = max(side.slip_mm for side in _by_interface(chain, stated)[k])
        valid = factor == math.inf or not tried[k][factor].not_valid
        found.append(Margin(chain.interfaces[k].name, factor, slip_mm, slip, tied[k], valid))
    return tuple(found)


def _between(low: float, high: float) -> list[float]:
    """Factors to try next; none if it is known well enough."""
    if not (math.isfinite(low) and math.isfinite(high)) or high - low <= _WITHIN * max(high, _WITHIN):
        return []
    return [float(factor) for factor in np.linspace(low, high, _INNER + 2)[1:-1]]


def _by_interface(chain: Chain, summary: Summary) -> dict[int, list[InterfaceMetrics]]:
    """The sides of each interface under test."""
    found: dict[int, list[InterfaceMetrics]] = {}
    for (k, _), side in zip(places_of_sides(chain), summary.interfaces, strict=True):
        if side.judged or k == chain.front:
            found.setdefault(k, []).append(side)
    return found


def _engaged(side: InterfaceMetrics) -> bool:
    return any(face.met_step_mm is not None for face in side.faces)


def _holds(chain: Chain, summary: Summary, k: int, slip_mm: float) -> bool:
    sides: Iterable[InterfaceMetrics] = _by_interface(chain, summary)[k]
    return not any(side.slid for side in sides) and all(side.slip_mm <= slip_mm for side in sides)


def _tied(line: Line | None) -> bool:
    """Whether a line has a tie with some capacity."""
    return line is not None and line.tie > 0.0 and (line.friction > 0.0 or line.tooth > 0.0)


def _with(chain: Chain, k: int, factor: float) -> Chain:
    """A chain with the capacity of the ties of an interface times a factor."""
    interface = chain.interfaces[k]
    elements = tuple(replace(e, line=None if e.line is None else _scaled(e.line, factor)) for e in interface.elements)
    interfaces = list(chain.interfaces)
    interfaces[k] = replace(interface, elements=elements)
    return replace(chain, interfaces=tuple(interfaces))


def _scaled(line: Line, factor: float) -> Line:
    def end(of: LineEnd) -> LineEnd:
        return replace(of, friction=factor * of.friction, tooth=factor * of.tooth)

    return replace(line, left=end(line.left), right=end(line.right))
